"""Every block of fblib on the test rig that users have: by the plugin's own fixture, with inputs and outputs by name."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rows import first_quick

from fbvm.base.data import data_folder
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.testing import ns
from fbvm.testing.rig import Rig
from fbvm.wire.link import Peer

Fb = Callable[..., Rig]
BLOCKS = sorted(path for path in data_folder("fblib").rglob("*.st")
                if re.search(r"^FUNCTION_BLOCK ", path.read_text(encoding="utf-8"), re.M))  # fmt: skip
ANY = [path for path in BLOCKS if re.search(r": ANY;", path.read_text(encoding="utf-8"))]
"""A rig has no variable of type ANY to offer: these are called by their own tests' programs."""


DIALECTS = {"matiec": [data_folder("fblib") / "matiec" / folder for folder in ("additional", "beremiz")],
            "twincat": [data_folder("fblib") / "twincat" / part for part in ("tcunit", "motion", "blocks/RTC.st")]}
"""By dialect the folders and files of blocks that only this one has, or has in another way."""
NEEDED = {name: {"Socket": 1} for name in ("ETN_Modbus_Line", "ETN_Modbus_Session")}
"""Parts of other blocks that are never without these."""


@pytest.mark.parametrize("path", [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * ("iec" not in path.parts)) for path in BLOCKS if path not in ANY
])
def test_it_stands_on_a_rig_without_inputs(fb: Fb, path: Path) -> None:
    """100 ms with every input at its initial value: no trap, and twice the same memory."""
    dialect = next((name for name, places in DIALECTS.items() if {path, path.parent} & set(places)), "")
    one, two = fb(path.stem, dialect=dialect), fb(path.stem, dialect=dialect)
    for rig in (one, two):
        rig.write(**NEEDED.get(path.stem, {}))
    one.run("100ms")
    for _ in range(10):
        two.scan()
    assert one.scans == 10 and bytes(one.plc.memory.u8) == bytes(two.plc.memory.u8)


STEPS = """
TON     | IN=TRUE PT=T#20ms         | 1: Q=FALSE | 3: Q=TRUE ET=T#20ms
TOF     | IN=TRUE PT=T#20ms         | 1: Q=TRUE
TP      | IN=TRUE PT=T#20ms         | 1: Q=TRUE  | 3: Q=FALSE
LTON    | IN=TRUE PT=LTIME#20ms     | 1: Q=FALSE | 3: Q=TRUE
R_TRIG  | CLK=TRUE                  | 1: Q=TRUE  | 2: Q=FALSE
F_TRIG  | CLK=FALSE                 | 1: Q=TRUE  | 2: Q=FALSE
SR      | S1=TRUE R=TRUE            | 1: Q1=TRUE
RS      | S=TRUE R1=TRUE            | 1: Q1=FALSE
CTU     | CU=TRUE PV=1              | 1: Q=TRUE CV=1  | 3: CV=1
CTD     | LD=TRUE PV=2              | 1: CV=2 Q=FALSE
CTUD    | LD=TRUE PV=3              | 1: CV=3 QU=TRUE QD=FALSE
"""


def values(text: str) -> dict[str, str]:
    return dict(item.split("=") for item in text.split())


@pytest.mark.parametrize("row", [row for row in STEPS.splitlines() if row], ids=lambda row: row.split()[0])
def test_the_blocks_of_the_standard(fb: Fb, row: str) -> None:
    block, inputs, *wanted = (part.strip() for part in row.split("|"))
    rig = fb(block)
    rig.write(**{name: _plain(value) for name, value in values(inputs).items()})
    for step in wanted:
        scan, _, outputs = step.partition(":")
        while rig.scans < int(scan):
            rig.scan()
        assert {name: rig[name] for name in values(outputs)} == {n: _plain(v) for n, v in values(outputs).items()}, step


def _plain(text: str) -> Any:
    if "#" in text:
        return ns(text.partition("#")[2])
    return text == "TRUE" if text in ("TRUE", "FALSE") else int(text)


QUANTITIES = {"Fn01": "Coil_Qty", "Fn02": "Coil_Qty", "Fn03": "Register_Qty", "Fn04": "Register_Qty", "Fn05": "", "Fn06": "",
              "Fn0F": "Coil_Qty", "Fn10": "Register_Qty"}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", first_quick(QUANTITIES))
def test_each_client_block_on_a_network(fb: Fb, network: LoopNetwork, name: str) -> None:
    """The block beside MTCP_ETN_Connect, as its library's README has them: one command, one good reply."""
    network.place(Peer("192.168.250.2", 502), ModbusPeer())
    command = "Cmd_Read" if name < "Fn05" else "Cmd_Write"
    quantity = QUANTITIES[name] and f"{QUANTITIES[name]} := 1, "
    text = f"""
        FUNCTION_BLOCK Client
        VAR_INPUT Go : BOOL; END_VAR
        VAR_OUTPUT Replies : UINT; Failed : BOOL; END_VAR
        VAR conn : MTCP_ETN_Connect; block : MTCP_ETN_{name}; END_VAR
            conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := TRUE);
            block(EN := conn.ENO, {quantity}{command} := Go);
            Replies := block.Rcv_Counter;
            Failed := block.Error;
        END_FUNCTION_BLOCK
    """
    rig = fb("Client", text=text, etn21="192.168.250.1", network=network)
    rig.run("300ms")
    rig.write(Go=True)
    rig.until("Replies > 0 OR Failed", max="5s")
    assert (rig.Replies, rig.Failed) == (1, False)
