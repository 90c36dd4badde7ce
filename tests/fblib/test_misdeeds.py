"""Servers that misbehave in every way that has a name: never wrong data, nobody stuck, nothing else touched, a code
that the README explains, and the next good exchange works by itself."""

from __future__ import annotations

import re

import pytest
from depth import times
from mtcp_rig import SECOND_NS, SERVER, Rig

from fbvm.base.data import data_folder
from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS, RudePeer, by_script, by_seed, right
from fbvm.net.peers import ModbusPeer

README = (data_folder("fblib") / "omron" / "mtcp_etn" / "README.md").read_text(encoding="utf-8")
READ, WRITE = 1000, 2000
BLOCKS = {
    "rd": f"Fn03(Register_Address := {READ}, Register_Qty := 3, RespData_DM := 200)",
    "bits": "Fn01(Coil_Address := 7, Coil_Qty := 21, RespData_DM := 210)",
    "wr": f"Fn10(Register_Address := {WRITE}, Register_Qty := 2, DataAddress_DM := 300)",
}
REPLY_NS = 700_000_000
HELD = [0x1234, 0xFFFF, 0x8001]
COILS = [0b1010101010101010, 0b01010]
OWN_CIO = range(1500, 1525)
AREAS = ("CIO", "D", "W", "H", "T", "C")


def documented() -> set[str]:
    """The codes that the library's README explains."""
    table = README.partition("## Error codes")[2].partition("\n## ")[0]
    rows = [re.match(r"\| ([0-9A-F]{4}[^|]*) \|", line) for line in table.splitlines()]
    codes = {code for row in rows if row for code in re.findall(r"[0-9A-F]{4}", row[1])}
    return codes | {f"{code:04X}" for code in range(1, 12)}


DOCUMENTED = documented()


QUICK_RUDE = ("nobody listens", "closes at once", "never reads", "previous reply behind", "resets in mid-request")
"""The rude servers of every run; each takes a tenth of a second."""


def rig_with(peer: RudePeer | ModbusPeer | None = None, **options: object) -> Rig:
    """A rig whose server holds known values, with blocks that do not wait long."""
    rig = Rig(peer, **options, **BLOCKS)  # type: ignore[arg-type]
    server = rig.server
    server.holding_registers[READ : READ + 3] = type(server.holding_registers)("H", HELD)
    server.coils[7:28] = bytes(bit % 2 for bit in range(21))
    rig.fill(300, [11, 22])
    for name in BLOCKS:
        rig.set(f"{name}.Reply_Time", REPLY_NS)
    return rig


class Watch:
    """What a block may have changed, and what it must not."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.rest = self.others()
        self.counters = {name: rig.result(name)[0] for name in BLOCKS}

    def others(self) -> list[list[int]]:
        """All words but the unit's, the sheet's areas, and the two destinations."""
        words = [list(self.rig.plc.memory.words(area)) for area in AREAS]
        for at in OWN_CIO:
            words[0][at] = 0
        words[1] = self.rig.all_words()
        words[1][200:203], words[1][210:212] = [0] * 3, [0] * 2
        return words

    def ended_well(self, name: str) -> bool:
        """Looks at one block after its command; True if it was served."""
        counter, code = self.rig.result(name)
        assert code == "" or code in DOCUMENTED
        replied = code == "" or "0001" <= code <= "000B"
        assert counter - self.counters[name] == replied, "Rcv_Counter counts right replies"
        self.counters[name] = counter
        return code == ""

    def check(self, served: dict[str, bool]) -> None:
        """Destinations are right, or as they were; all else as it was."""
        assert self.others() == self.rest
        assert self.rig.words(200, 3) == (HELD if served["rd"] else [0] * 3)
        assert self.rig.words(210, 2) == (COILS if served["bits"] else [0] * 2)


def command_all(rig: Rig, watch: Watch, names: list[str]) -> dict[str, str]:
    """Commands blocks one after the other; what each that could begin ended with, "ok" or its code."""
    ended = {}
    for name in names:
        if not rig.get("conn.ENO"):
            rig.run_until("Main.conn.ENO", 15)
        rig.fill(200, [0] * 3)
        rig.fill(210, [0] * 2)
        served = dict.fromkeys(BLOCKS, False)
        if rig.command(name, max_s=25):
            served[name] = watch.ended_well(name)
            ended[name] = rig.result(name)[1] or "ok"
        watch.check(served)
    return ended


def good_again(rig: Rig) -> None:
    """The server behaves: without anybody's help everything works within seconds."""
    rig.network.place(SERVER, rig.peer)
    rig.peer.reply = right
    rig.server.holding_registers[WRITE : WRITE + 2] = type(rig.server.holding_registers)("H", [0, 0])
    rig.run_until("Main.conn.ENO", 15)
    rig.scan(2)
    for attempt in (1, 2):  # the first may still meet what a bad server left on a connection that looks good
        watch = Watch(rig)
        ended = command_all(rig, watch, list(BLOCKS))
        if attempt == 2 or ended == dict.fromkeys(BLOCKS, "ok"):
            break
        rig.run_until("Main.conn.ENO", 15)
    assert ended == dict.fromkeys(BLOCKS, "ok")
    assert list(rig.server.holding_registers[WRITE : WRITE + 2]) == [11, 22]


OK, SILENT, GARBLED, LOST, RESET = "ok ok ok", "0080 0080 0080", "0045 0045 0045", "0081 0081 0081", "004B 004B 004B"
EXPECTED = {
    "two pieces": OK,
    "byte by byte": OK,
    "twice": OK,
    "again later": OK,
    "a wrong one first": OK,
    "a wrong one last": OK,
    "garbage behind": OK,  # the next command drops it
    "a byte behind": OK,
    "a frame begun behind": OK,
    "the next reply, too": OK,
    "the next reply soon": OK,
    "the next exception, too": OK,
    "flood behind": OK,
    "right, then fin": OK,
    "right, then closed": OK,
    "right, then reset": OK,
    "illegal function": "0001 0001 0001",
    "server failure": "0004 0004 0004",
    "gateway without target": "000B 000B 000B",
    "wrong protocol": GARBLED,
    "impossible length": GARBLED,
    "length 0": GARBLED,
    "length 1": GARBLED,
    "length 255": GARBLED,
    "length one less": GARBLED,
    "length one more": GARBLED,
    "length 254": GARBLED,
    "garbage": GARBLED,
    "garbage first": GARBLED,
    "flood": GARBLED,
    "half, then fin": LOST,
    "fin": LOST,
    "half closed": LOST,
    "header, then closed": LOST,
    "reset": RESET,
    "half, then reset": RESET,
    "one byte, then reset": RESET,
}
"""The ends of the commands of the three blocks, each of which meets the misdeed once.  All other misdeeds end like silence."""
EXPECTED_OF_REAL = {
    "right, then reset": RESET,  # a reset throws away what was not read yet
}
"""The misdeeds that end otherwise with the delays of timing "real"."""


TIMINGS = pytest.mark.parametrize("timing", ["exact", pytest.param("real", marks=pytest.mark.slow)])


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in EXPECTED)) for name in MISDEEDS]
)
def test_a_wrong_answer(name: str, timing: str) -> None:
    rig = rig_with(timing=timing, seed=len(name) + 100).connect()
    watch = Watch(rig)
    ended = []
    for block in BLOCKS:
        rig.peer.reply = by_script(name)
        ended.append(command_all(rig, watch, [block])[block])
        rig.scan(80)
    of_real = EXPECTED_OF_REAL if timing == "real" else {}
    assert " ".join(ended) == of_real.get(name, EXPECTED.get(name, SILENT))
    good_again(rig)


NOBODY = "- - - - - -"
RUDE = {
    "nobody listens": NOBODY,
    "never accepts": NOBODY,
    "closes at once": NOBODY,
    "half closes at once": NOBODY,
    "resets at once": NOBODY,
    "closes after a while": f"{OK} {OK}",
    "closes between requests": "ok lost ok lost ok lost",
    "resets between requests": "ok lost ok lost ok lost",
    "takes one connection only": "ok - - - - -",
    "never reads": f"{SILENT} {SILENT}",
    "never reads, then resets": f"{RESET} {RESET}",
    "closes in mid-request": f"{LOST} {LOST}",
    "resets in mid-request": f"{RESET} {RESET}",
    "hears every second request": "0080 ok 0080 ok 0080 ok",
    "previous reply instead": f"{SILENT} {SILENT}",
    "previous reply first": f"{OK} {OK}",
    "previous reply behind": f"{OK} {OK}",
    "speaks first": f"{OK} {OK}",
    "speaks first, garbage": f"{OK} {OK}",
    "drips for ever": f"{SILENT} {SILENT}",
    "floods from the start": f"{GARBLED} {GARBLED}",
}
"""The ends of six commands: "-" if no connection comes within 5 s, "lost" if it goes before the command begins."""
RUDE_OF_REAL = {
    "closes after a while": "- - 004B - lost -",
    "closes between requests": f"{OK} {OK}",
    "resets between requests": f"{RESET} {RESET}",
}
"""The servers for which commands end otherwise with the delays of timing "real"."""


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK_RUDE)) for name in RUDE_PEERS])
def test_a_rude_server(name: str, timing: str) -> None:
    rig = rig_with(timing=timing, seed=len(name))
    peer = RUDE_PEERS[name](rig.server)
    rig.network.place(SERVER, peer)
    rig.scan(300)
    watch, ended = Watch(rig), list[str]()
    for block in [*BLOCKS, *BLOCKS]:
        if rig.plc.run(until="Main.conn.ENO", max_ns=5 * SECOND_NS) == "until":
            ended.append(command_all(rig, watch, [block]).get(block, "lost"))
        else:
            ended.append("-")
    of_real = RUDE_OF_REAL if timing == "real" else {}
    assert " ".join(ended) == of_real.get(name, RUDE[name])
    if isinstance(peer, RudePeer):
        peer.reform()
    good_again(rig)


def test_there_are_enough_of_them() -> None:
    assert len(MISDEEDS) + len(RUDE_PEERS) >= 40
    assert set(RUDE) == set(RUDE_PEERS)
    assert set(EXPECTED) < set(MISDEEDS)
    assert set(EXPECTED_OF_REAL) < set(EXPECTED) and set(RUDE_OF_REAL) < set(RUDE)


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("seed", range(times(12)))
def test_all_of_them_by_chance(seed: int, timing: str) -> None:
    """Dozens of commands, each of which may meet anything."""
    rig = rig_with(timing=timing, seed=seed).connect()
    rig.peer.reply = by_seed(seed)
    watch, ended = Watch(rig), list[str]()
    for _ in range(12):
        ended += command_all(rig, watch, list(BLOCKS)).values()
    assert ended.count("ok") >= 9
    assert len(set(ended)) >= 3
    good_again(rig)
