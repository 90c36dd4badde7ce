"""The two timing models: what may be out of step, by how much, and that it is the same for the same seed."""

from __future__ import annotations

from copy import deepcopy

import pytest
from etn21_rig import SERVER, Rig
from rows import each_of

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Closed, Opened, Received, Send, Sent

SEEDS = range(40)


class Watched:
    """A unit of real timing; notes the cycle in which each thing of socket 1 and area 1 changed."""

    def __init__(self, seed: int) -> None:
        self.rig = Rig(Etn21(timing="real", seed=seed))
        self.rig.parameters()
        self.cycle = 0
        self.changed: dict[str, int] = {}

    def scan(self, *steps: Switch | Opened | Sent | Received | Closed) -> None:
        before = self._state()
        self.rig.scan(*steps)
        self.cycle += 1
        self.changed |= {name: self.cycle for name, value in self._state().items() if value != before[name]}

    def _state(self) -> dict[str, int]:
        rig = self.rig
        return {
            "switch": rig.cio[1519],
            "flag": rig.status() & 0xF,
            "open": rig.status() >> 15,
            "data": rig.status() >> 13 & 1,
            "state": rig.state(),
            "code": rig.result(9),
        }

    def settle(self) -> None:
        for _ in range(16):
            self.scan()

    def open(self) -> None:
        self.scan(Switch.ACTIVE_OPEN)
        self.scan()
        self.scan(Opened(1, 49152, SERVER))
        self.settle()


@pytest.mark.slow
@each_of("seed", SEEDS)
def test_real_open_ends_with_its_words_out_of_step_assumed(seed: int) -> None:
    watched = Watched(seed)
    watched.open()
    changed = watched.changed
    assert watched.rig.code() == "0000"
    assert changed["code"] == changed["switch"] >= 5
    assert -1 <= changed["flag"] - changed["switch"] <= 3
    assert -1 <= changed["open"] - changed["switch"] <= 3


@pytest.mark.slow
def test_real_words_are_apart_in_every_way_assumed() -> None:
    skews = set()
    for seed in SEEDS:
        watched = Watched(seed)
        watched.open()
        skews |= {watched.changed["open"] - watched.changed["switch"]}
    assert skews == {-1, 0, 1, 2, 3}


@pytest.mark.slow
def test_real_flag_of_a_receive_and_what_says_that_bytes_wait_are_apart_assumed() -> None:
    skews = set()
    for seed in SEEDS:
        watched = Watched(seed)
        watched.open()
        watched.rig.parameters(count=2)
        watched.scan(Switch.RECEIVE)
        watched.settle()
        watched.scan(Received(1, b"abc"))
        watched.settle()
        assert (watched.rig.status(), watched.rig.waiting(), watched.rig.code()) == (0xA000, 1, "0000")
        skews |= {watched.changed["flag"] - watched.changed["data"]}
    assert skews == {-4, -3, -2, -1, 0}


@pytest.mark.slow
def test_real_services_take_3_to_7_refreshes_and_5_to_21_ms_assumed() -> None:
    refreshes = set()
    for seed in SEEDS:
        watched = Watched(seed)
        watched.rig.cycle_ns = 100_000_000
        watched.open()
        refreshes.add(watched.changed["switch"])
    assert refreshes == {6, 7, 8, 9, 10}  # found in 1, accepted in 2, ended after 3..7, switch OFF one later
    short = Watched(0)
    short.rig.cycle_ns = 100_000
    short.rig.scan(Switch.ACTIVE_OPEN)
    short.rig.scan()
    short.rig.scan(Opened(1, 49152, SERVER))
    while short.rig.is_on(Switch.ACTIVE_OPEN):
        short.rig.scan()
    assert 5_000_000 <= short.rig.now_ns <= 22_000_000


@pytest.mark.slow
@each_of("seed", SEEDS)
def test_a_real_service_takes_as_long_whether_the_network_answers_in_the_first_refresh_or_in_the_fifth_assumed(seed: int) -> None:
    ends = []
    for refreshes in (1, 5):
        rig = Rig(Etn21(timing="real", seed=seed), cycle_ms=1)
        rig.parameters()
        rig.scan(Switch.ACTIVE_OPEN)
        for _ in range(refreshes):
            rig.scan()
        rig.scan(Opened(1, 49152, SERVER))
        while rig.is_on(Switch.ACTIVE_OPEN):
            rig.scan()
        ends.append(rig.now_ns)
    assert ends[0] == ends[1]


@pytest.mark.slow
@each_of("seed", SEEDS)
def test_real_words_agree_in_the_end(seed: int) -> None:
    watched = Watched(seed)
    rig = watched.rig
    watched.open()
    assert (rig.status(), rig.state(), rig.code()) == (0x8000, 4, "0000")
    rig.parameters(count=2)
    watched.scan(Switch.RECEIVE)
    watched.scan()
    watched.scan(Received(1, b"abc"))
    watched.settle()
    assert (rig.status(), rig.waiting(), rig.result(5), rig.code()) == (0xA000, 1, 2, "0000")
    watched.scan(Switch.CLOSE)
    watched.scan()
    watched.scan(Closed(1))
    watched.settle()
    assert (rig.status(), rig.state(), rig.waiting(), rig.code()) == (0, 0xA, 0, "0000")


@pytest.mark.slow
def test_real_punishes_a_send_that_does_not_wait_for_bit_15_assumed() -> None:
    codes = set()
    for seed in SEEDS:
        rig = Rig(Etn21(timing="real", seed=seed))
        rig.parameters()
        rig.scan(Switch.ACTIVE_OPEN)
        rig.scan()
        rig.scan(Opened(1, 49152, SERVER))
        while rig.is_on(Switch.ACTIVE_OPEN):
            rig.scan()
        rig.parameters(count=2)
        requests = rig.scan(Switch.SEND) + rig.scan()
        rig.scan(*[Sent(1, 2) for request in requests if isinstance(request, Send)])
        while rig.is_on(Switch.SEND):
            rig.scan()
        codes.add(rig.code())
    assert codes == {"0000", "2210"}


@pytest.mark.slow
def test_real_punishes_an_open_that_does_not_wait_until_bit_15_is_off_assumed() -> None:
    codes = set()
    for seed in SEEDS:
        watched = Watched(seed)
        rig = watched.rig
        watched.open()
        watched.scan(Switch.CLOSE)
        watched.scan()
        watched.scan(Closed(1))
        while rig.is_on(Switch.CLOSE):
            watched.scan()
        rig.parameters()
        watched.scan(Switch.ACTIVE_OPEN)
        watched.scan()
        watched.scan(Opened(1, 49152, SERVER))
        while rig.is_on(Switch.ACTIVE_OPEN):
            watched.scan()
        codes.add(rig.code())
    assert codes == {"0000", "220F"}


@pytest.mark.slow
@each_of("seed", SEEDS)
def test_real_results_of_an_interrupted_service_are_a_cycle_apart_assumed(seed: int) -> None:
    watched = Watched(seed)
    rig = watched.rig
    watched.open()
    rig.parameters(count=2)
    watched.scan(Switch.RECEIVE)
    watched.settle()
    watched.scan(Switch.CLOSE)
    watched.scan()
    watched.scan(Closed(1))
    seen = []
    for _ in range(20):
        watched.scan()
        seen.append(rig.code())
    assert list(dict.fromkeys(["FFFF", *seen])) == ["FFFF", "0081", "0000"]


def run(seed: int, timing: str = "real") -> list[dict[str, bytes]]:
    rig = Rig(Etn21(timing=timing, seed=seed))
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.scan()
    rig.scan(Opened(1, 49152, SERVER))
    snapshots = []
    for _ in range(15):
        rig.scan()
        snapshots.append(rig.memory.snapshot())
    return snapshots


def test_the_same_seed_gives_the_same_run() -> None:
    assert run(3) == run(3)
    assert run(3) != run(4)
    assert run(3, "exact") == run(4, "exact")


@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_copy_of_a_unit_goes_on_like_the_unit(timing: str) -> None:
    rig = Rig(Etn21(timing=timing))
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.scan()
    twin = Rig()
    for area in ("CIO", "D"):
        twin.memory.words(area)[:] = rig.memory.words(area)
    twin.unit, twin.now_ns = deepcopy(rig.unit), rig.now_ns
    for one in (rig, twin):
        one.scan(Opened(1, 49152, SERVER))
        for _ in range(15):
            one.scan()
    assert rig.is_open()
    assert rig.memory.snapshot() == twin.memory.snapshot()
