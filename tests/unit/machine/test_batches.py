"""PLCs that scan by one call of machine code: to the bit what each of them does alone."""

from __future__ import annotations

import ctypes
from types import SimpleNamespace
from typing import Any, cast

import pytest
from test_units_in_code import MS, Rig, image
from toy_unit import Echoing, _Echo

from fbvm import Etn21, Plc, compile_text
from fbvm.engine.native import engine as native
from fbvm.engine.native.scans.code import ALL_OVER
from fbvm.machine.batch import BatchPlace, BatchScans, place_of
from fbvm.machine.plc import Mode
from fbvm.run import batches, loop, watchdog
from fbvm.run.loop import run_all
from fbvm.run.running import Running

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)


class Clock:
    """Stands in for the module `time`: sleeping moves it.  Every `late`-th sleep is as long again as it should be, and longer."""

    def __init__(self, late: int) -> None:
        self.now_ns, self._late, self._sleeps = 1_000_000_000_000, late, 0

    def get_clock_info(self, name: str) -> SimpleNamespace:
        return SimpleNamespace(implementation="a stand-in")

    def monotonic_ns(self) -> int:
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self._sleeps += 1
        self.now_ns += round(seconds * 1e9) + (self._late and self._sleeps % self._late == 0) * 2_300_000


class Line(_Echo):
    """A link of real time that is quiet when nothing can come before the next request, as links are."""

    @property
    def is_quiet(self) -> bool:
        return not self._waiting


def attach(network: Echoing, address: str) -> Line:
    network.links.append(Line(address, network._latency_ns, False, network))
    return network.links[-1]


SCAN = batches.Batch.scan


def count_scans(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Has batches say how many scans they do."""
    scans: list[int] = []

    def counted(batch: batches.Batch, now_ns: int) -> list[int]:
        scans.append(len(batch.members))
        return SCAN(batch, now_ns)

    monkeypatch.setattr(batches.Batch, "scan", counted)
    return scans


class Ran:
    """PLCs with toys after a run in which they may be in batches, or not since somebody is told of each scan."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, programs: list[dict[str, Any]], bounds: dict[str, Any], *,
                 late: int = 0, is_batched: bool = True, most: int = 3, progress: Any = None,
                 until: Any = None) -> None:  # fmt: skip
        clock = Clock(late)
        for module in (loop, batches, watchdog):
            monkeypatch.setattr(module, "time", clock)
        monkeypatch.setattr(loop, "local_date_ns", lambda: clock.now_ns)
        monkeypatch.setattr(batches, "MOST", most)
        monkeypatch.setattr(Echoing, "attach", attach)
        scans = count_scans(monkeypatch)
        self.rigs = [Rig(image(**program), (0,), 300_000, virtual_time=False) for program in programs]
        if not is_batched:
            for rig in self.rigs:
                rig.plc.watchers.append(lambda plc: None)
        self.runs = [Running(rig.plc, **bounds, phase_ns=number % 3 * MS // 4) for number, rig in enumerate(self.rigs)]
        run_all(self.runs, progress and (lambda: progress(self)), until)
        self.batched = sum(scans)

    @property
    def told(self) -> list[tuple[Any, ...]]:
        for rig in self.rigs:
            rig.plc._io.report_skipped()
        return [(*rig.state, run.reason, rig.plc.lateness.count, rig.plc.lateness.missed, rig.plc.scan_times.count)
                for rig, run in zip(self.rigs, self.runs, strict=True)]  # fmt: skip


SELDOM: list[dict[str, Any]] = [{"every": every} for every in (40, 33, 50, 40, 29, 61, 40)]
OTHERS: list[dict[str, Any]] = [
    {"every": 17, "interval": "INTERVAL := T#7ms, "}, {"every": 90, "trap": 55}, {"every": 5, "slow": False}]  # fmt: skip


def test_machine_code_says_who_wants_something_and_goes_on_behind_it() -> None:
    """A point below 0 is no trap; the scans of the PLCs begin with the first, and again behind each that wanted something."""
    answers = iter([(1 << 32) | 0xFFFF_FFFE, (2 << 32) | 7, (4 << 32) | 0x8000_0000, ALL_OVER])
    calls: list[tuple[list[int], int, int, int]] = []

    def call(rows_at: int, first: int, count: int, now_ns: int) -> int:
        calls.append((list((ctypes.c_int64 * 10).from_address(rows_at)), first, count, now_ns))
        return next(answers)

    places = [SimpleNamespace(call=call, scans=SimpleNamespace(parameters_at=1000 + number)) for number in range(5)]
    batch = BatchScans([(cast(BatchPlace, place), 50 * number) for number, place in enumerate(places)])
    assert list(batch.scan(9)) == [(1, -2), (2, 7), (4, -0x8000_0000)]
    assert calls[0] == ([1000, 0, 1001, 50, 1002, 100, 1003, 150, 1004, 200], 0, 5, 9)
    assert [first for _, first, _, _ in calls] == [0, 2, 3, 5]


@pytest.mark.slow
@pytest.mark.parametrize("is_inside", [True, False])
def test_a_plc_that_leaves_a_batch_is_up_to_date(is_inside: bool) -> None:
    rig = Rig(image(), (0,), is_inside=is_inside, virtual_time=False)
    for scan in range(4):
        rig.plc.scan(scan * MS)
    place, before = place_of(rig.plc), rig.plc._io.skipped
    assert place is not None
    place.leave(rig.plc, 0, 0)
    assert (rig.plc.scans, rig.plc.now_ns, rig.plc._io.skipped) == (4, 3 * MS, before)
    rig.plc._io.changed_words = True
    place.leave(rig.plc, 3, 8 * MS)
    assert not rig.plc._io.changed_words
    assert (rig.plc.scans, rig.plc.now_ns, rig.plc._io.skipped) == (7, 8 * MS, before + 3)


@pytest.mark.slow
@pytest.mark.parametrize(("programs", "bounds", "late"), [
    (SELDOM, {"scans": 200}, 0), (SELDOM + OTHERS, {"for_ns": 203 * MS}, 0), (SELDOM + OTHERS, {"for_ns": 150 * MS}, 23),
])  # fmt: skip
def test_batches_are_scans_one_by_one(monkeypatch: pytest.MonkeyPatch, programs: list[dict[str, Any]], bounds: dict[str, Any],
                                      late: int) -> None:  # fmt: skip
    alone = Ran(monkeypatch, programs, bounds, late=late, is_batched=False)
    together = Ran(monkeypatch, programs, bounds, late=late)
    assert not alone.batched and together.batched > 300
    assert together.told == alone.told


@pytest.mark.slow
def test_what_is_changed_from_outside_counts_from_the_next_scan_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody has a turn now and then; the PLCs are up to date before it, and those that may not stay leave their batch."""
    seen: list[list[int]] = []

    def progress(ran: Ran) -> None:
        seen.append([rig.plc.scans - rig.plc.read("Main.n") for rig in ran.rigs])
        if len(seen) == 1:
            ran.rigs[0].plc.force("W5", 9)
            ran.rigs[1].plc.budget = 1
            ran.rigs[2].plc.mode = Mode.PROGRAM
            ran.rigs[3].plc.watchers.append(told.append)

    told: list[Plc] = []
    ran = Ran(monkeypatch, [{"every": 500}] * 5, {"for_ns": 350 * MS}, progress=progress)
    assert len(seen) == 3 and seen[0] == [0] * 5 and ran.batched > 300
    forced, trapped, stopped, watched, alone = (rig.plc for rig in ran.rigs)
    assert forced.read("W5") == 9 and trapped.trap is not None and trapped.scans < 110
    assert stopped.read("Main.n") < 110 < stopped.scans == alone.scans and len(told) > 200
    assert watched.read("Main.n") == alone.read("Main.n") == alone.scans == 350


@pytest.mark.slow
def test_plcs_are_up_to_date_when_the_loop_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def until() -> bool:
        asked.append(1)
        return len(asked) == 400

    ran = Ran(monkeypatch, [{"every": 500}] * 5, {"for_ns": 9_000 * MS}, until=until)
    assert ran.batched > 200 and not any(run.reason for run in ran.runs)
    assert all(rig.plc.read("Main.n") == rig.plc.scans > 100 for rig in ran.rigs)


ENDLESS = """
PROGRAM Main
VAR n : UDINT; looping AT %W0.0 : BOOL; END_VAR
  n := n + 1;
  WHILE looping OR n = 60 DO looping := TRUE; END_WHILE;
END_PROGRAM
"""


@pytest.mark.slow
def test_an_endless_scan_in_a_batch_is_ended_by_the_watch_cycle_time(monkeypatch: pytest.MonkeyPatch) -> None:
    class Passing(Clock):
        """A clock that each look moves by 200 ms while a scan asks."""

        def monotonic_ns(self) -> int:
            self.now_ns += 200 * MS if self.is_asked else 0
            return self.now_ns

        is_asked = False

    clock, asking, scans = Passing(0), Passing(0), count_scans(monkeypatch)
    asking.is_asked = True
    for module, stand_in in ((loop, clock), (batches, clock), (watchdog, asking)):
        monkeypatch.setattr(module, "time", stand_in)
    compilation = compile_text(ENDLESS)
    assert compilation.image
    plcs = [Plc(compilation.image, MS, engine="native", budget=1 << 40) for _ in range(3)]
    for number, plc in enumerate(plcs):
        network = Echoing(virtual_time=False)
        plc.attach(Etn21(0, f"10.0.0.{number}"), network)
    plcs[1].write("Main.n", 1000)
    run_all([Running(plc, for_ns=200 * MS) for plc in plcs])
    assert sum(scans) > 250
    assert [plc.scans for plc in plcs] == [60, 200, 60]
    assert [plc.trap and plc.trap.code for plc in plcs] == ["R0112", None, "R0112"]
