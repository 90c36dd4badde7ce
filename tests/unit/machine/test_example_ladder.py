"""The work of the demo written in ladder: the registers on the server are those of its twin in Structured Text."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbvm.code.compiler import compile_files
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

EXAMPLES = Path(__file__).resolve().parent.parent.parent.parent / "examples"
SECOND_NS = 10**9


def registers(name: str) -> tuple[str | None, list[int]]:
    """How the run of an example ends, and what the server holds then."""
    made = compile_files([EXAMPLES / name], runnable=True)
    assert made.image is not None and made.diagnostics == []
    plc, network, peer = Plc(made.image), LoopNetwork(), ModbusPeer()
    for number in range(10):
        peer.server.holding_registers[number] = 0xFFFF - number
    network.place(Peer("192.168.250.1", 502), peer)
    plc.attach(Etn21(0, "192.168.250.20"), network)
    return plc.run(until="Main.Done", max_ns=SECOND_NS), list(peer.server.holding_registers[:6000])


@pytest.mark.slow
def test_both_leave_the_same_registers() -> None:
    ended, held = registers("ladder.st")
    assert (ended, held) == registers("demo.st")
    assert ended == "until" and held[4999:5010] == [10, 0, *range(0xFFFF, 0xFFF6, -1)]
