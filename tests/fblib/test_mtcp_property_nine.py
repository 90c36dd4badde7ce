"""All nine blocks at once, in any order of commands, cut of segments and fault at any scan: destinations are right or
untouched, counters count right replies, and what was written stands at the server."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from mtcp_rig import SERVER, Rig

from fbvm.net.faults import KINDS, Fault, random_faults
from fbvm.net.misdeeds import MISDEEDS, RudePeer, by_seed, right
from fbvm.net.peers import Actions
from fbvm.wire.modbus import Adu, parse_adu


@dataclass(frozen=True)
class Job:
    """A block with its call, the D words that it may write, and what is right there."""

    call: str
    first: int = 0
    words: tuple[int, ...] = ()


JOBS = {
    "r1": Job("Fn01(Coil_Address := 16, Coil_Qty := 20, RespData_DM := 100)", 100, (0b0110110110110110, 0b1011)),
    "r2": Job("Fn02(Coil_Address := 32, Coil_Qty := 16, RespData_DM := 110)", 110, (0b1010101010101010,)),
    "r3": Job("Fn03(Register_Address := 30, Register_Qty := 3, RespData_DM := 120)", 120, (1030, 1031, 1032)),
    "r4": Job("Fn04(Register_Address := 40, Register_Qty := 125, RespData_DM := 200)", 200, tuple(range(2040, 2165))),
    "w5": Job("Fn05(Coil_Address := 500, Value := TRUE)"),
    "w6": Job("Fn06(Register_Address := 600, Value := 666)"),
    "wF": Job("Fn0F(Coil_Address := 700, Coil_Qty := 9, DataAddress_DM := 130)"),
    "w10": Job("Fn10(Register_Address := 800, Register_Qty := 40, DataAddress_DM := 140)"),
}
SOURCES = {130: [0b101010101], 140: list(range(5000, 5040))}
WRITTEN = [1, 666, bytes(1 - number % 2 for number in range(9)), list(range(5000, 5040))]
LATE = {"late", "late by one request", "again later", "half, the rest late"}
CUT = {"two pieces", "byte by byte", "half", "all but one byte", "half, the rest late"}


def misdeeds(seed: int, chance: float) -> Callable[[bytes], Actions]:
    """Misdeeds by chance, but none that completes the frame of another: Modbus TCP has no check sum, so a late frame in
    the place of the missing end of a reply is data like any other, for every client there is."""
    return by_seed(seed, chance, [name for name in MISDEEDS if name not in (LATE if seed % 2 else CUT)])


TIMINGS = st.sampled_from(["exact", "real"])
SEEDS = st.integers(0, 10**6)
ORDERS = st.permutations(["conn", *JOBS])


class Nine(Rig):
    """A rig with all blocks, whose server counts the right replies that it gives."""

    def __init__(self, timing: str, seed: int, order: Sequence[str] = ("conn", *JOBS)) -> None:
        peer = RudePeer(reply=self._counted)
        blocks = {name: job.call for name, job in JOBS.items()}
        super().__init__(peer, timing=timing, seed=seed, order=order, **blocks)  # type: ignore[arg-type]
        self.rude = peer
        self.misdeed: Callable[[bytes], Actions] = right
        self.right_replies = 0
        server = self.server
        server.coils[16:36] = bytes(number % 3 != 0 for number in range(20))
        server.discrete_inputs[32:48] = bytes(number % 2 for number in range(16))
        for register in range(200):
            server.holding_registers[register] = 1000 + register
            server.input_registers[register] = 2000 + register
        for first, words in SOURCES.items():
            self.fill(first, words)
        for name in JOBS:
            self.set(f"{name}.Reply_Time", 500_000_000)
        self.before = self.all_words()

    def _counted(self, frame: bytes) -> Actions:
        self.right_replies += 1
        return self.misdeed(frame)

    def counted(self) -> int:
        return sum(self.result(name)[0] for name in JOBS)

    def nothing_wrong(self) -> None:
        """Each destination is whole or untouched, all other words are as they were, no more is counted than came."""
        expected = list(self.before)
        for job in JOBS.values():
            at = slice(job.first, job.first + len(job.words))
            if self.words(job.first, 1) != self.before[job.first : job.first + 1]:
                expected[at] = job.words
        assert self.all_words() == expected
        assert self.counted() <= self.right_replies

    def all_right(self) -> None:
        """Everything was served."""
        for job in JOBS.values():
            assert self.words(job.first, len(job.words)) == list(job.words)
        server = self.server
        assert [server.coils[500], server.holding_registers[600], bytes(server.coils[700:709]),
                list(server.holding_registers[800:840])] == WRITTEN  # fmt: skip

    def works_by_itself(self) -> None:
        """With a good network and server, everything is served within seconds; two rounds, for what was still on its
        way."""
        self.network.faults.clear()
        self.network.place(SERVER, self.rude)
        self.rude.reform()
        for name in JOBS:
            self.set(f"{name}_EN", True)
            self.set(f"{name}_Cmd", False)
            # in real timing half a second is not enough to take a stray frame and the reply behind it
            self.set(f"{name}.Reply_Time", 5_000_000_000)
        self.set("Connect", True)
        for _ in range(2):
            self.scan(150)
            self.run_until("Main.conn.ENO", 100)
            self.command(*JOBS, max_s=20)
        assert {self.result(name)[1] for name in JOBS} == {""}
        self.all_right()


@pytest.mark.slow
@given(TIMINGS, SEEDS, ORDERS, st.integers(1, 60), st.integers(0, 12_000_000))
@settings(max_examples=times(8), deadline=None)
def test_any_order_of_calls_and_any_cut(
    timing: str, seed: int, order: list[str], segment_bytes: int, gap_ns: int
) -> None:
    rig = Nine(timing, seed, order)
    for name in JOBS:
        rig.set(f"{name}.Reply_Time", 5_000_000_000)
    rig.network.faults.append(Fault(segment_bytes=segment_bytes, random_cut=True, gap_ns=gap_ns))
    rig.connect()
    rig.command(*JOBS, max_s=30)
    assert {rig.result(name) for name in JOBS} == {(1, "")}
    assert rig.right_replies == 8
    rig.nothing_wrong()
    rig.all_right()


COMMANDS = st.lists(st.tuples(st.integers(0, 25), st.sets(st.sampled_from(list(JOBS)), max_size=8)), max_size=15)


@pytest.mark.slow
@given(TIMINGS, SEEDS, ORDERS, COMMANDS)
@settings(max_examples=times(20), deadline=None)
def test_any_order_of_commands(
    timing: str, seed: int, order: list[str], commands: list[tuple[int, set[str]]]
) -> None:
    """Edges at any time: what is served is served right, and every reply is counted by exactly one block."""
    rig = Nine(timing, seed, order).connect()
    for scans, names in commands:
        for name in names:
            rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        rig.scan(scans)
        rig.nothing_wrong()
    busy = " OR ".join(f"Main.{name}.Exchange.State <> 0" for name in JOBS)
    rig.run_until(f"NOT ({busy})", 30)
    assert rig.counted() == rig.right_replies
    assert {rig.code(name) for name in JOBS} <= {"", "110C"}
    rig.works_by_itself()


FAULTS = st.lists(
    st.tuples(st.integers(0, 250), st.integers(1, 120), st.sampled_from(list(KINDS))), min_size=1, max_size=5
)


@pytest.mark.slow
@given(TIMINGS, SEEDS, FAULTS)
@settings(max_examples=times(20), deadline=None)
def test_any_fault_at_any_scan(timing: str, seed: int, faults: list[tuple[int, int, str]]) -> None:
    rig = Nine(timing, seed)
    for scan, length, kind in faults:
        rig.network.faults.append(replace(KINDS[kind], from_scan=scan, until_scan=scan + length))
    for _ in range(12):
        for name in JOBS:
            rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        rig.scan(30)
        rig.nothing_wrong()
    rig.works_by_itself()


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.floats(0.1, 1))
@settings(max_examples=times(20), deadline=None)
def test_any_misdeed_at_any_request(timing: str, seed: int, chance: float) -> None:
    rig = Nine(timing, seed)
    rig.misdeed = misdeeds(seed, chance)
    for _ in range(12):
        for name in JOBS:
            rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        rig.scan(40)
        rig.nothing_wrong()
    rig.works_by_itself()


@pytest.mark.slow
@given(TIMINGS, SEEDS)
@settings(max_examples=times(15), deadline=None)
def test_everything_together(timing: str, seed: int) -> None:
    """Faults of the network and misdeeds of the server by one seed, for 20 s of the PLC's time."""
    rig = Nine(timing, seed)
    rig.network.faults += random_faults(seed, 2000)
    rig.misdeed = misdeeds(seed, 0.3)
    for _ in range(50):
        for name in JOBS:
            rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        rig.scan(40)
        rig.nothing_wrong()
    rig.works_by_itself()


def test_every_misdeed_leaves_the_frame_of_the_server_alone() -> None:
    """The right frame is what is counted: it parses, whatever is made of it."""
    frame = Adu(7, 255, bytes.fromhex("03 04 1234 5678")).to_bytes()
    for misdeed in MISDEEDS.values():
        list(misdeed(frame))
    assert parse_adu(frame) == Adu(7, 255, bytes.fromhex("03 04 1234 5678"))
