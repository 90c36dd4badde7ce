"""Each fast path of a scan leaves what the plain scan leaves, to the bit; docs/explanation/fast-paths.md lists them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of, first_quick
from test_many_scans import IMAGE
from test_units_in_code import MS, Rig, image, way

from fbvm import Plc
from fbvm.base.areas import NEVER
from fbvm.engine.native import engine as native
from fbvm.machine.fast.paths import ProgramAlone
from fbvm.machine.fast.units_in_code import WithUnits

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

HOUSE = Path(__file__).resolve().parents[3]
PAGE = HOUSE / "docs" / "explanation" / "fast-paths.md"


def plain(plc: Plc) -> Plc:
    """The same PLC on the plain path: somebody looks inside its scans."""
    plc.phases.append(lambda plc, phase: None)
    return plc


@pytest.mark.parametrize("cycle_ns", first_quick([10 * MS, 1, 33 * MS, 1000 * MS]))
def test_the_program_alone_scan_by_scan(cycle_ns: int) -> None:
    fast, slow = Plc(IMAGE, cycle_ns, engine="native"), plain(Plc(IMAGE, cycle_ns, engine="native"))
    for _ in range(300):
        assert fast.scan() == slow.scan()
        assert bytes(fast.memory.u8) == bytes(slow.memory.u8) and fast.due_ns == slow.due_ns
    assert isinstance(fast.fast_path(), ProgramAlone) and slow.fast_path() is None


CASES = [((0,), 0, True), ((0,), 0, False), ((MS, 0), 300_000, True), ((7000, 0), 10_000, False), ((MS,), 5000, False)]


@pytest.mark.slow
@pytest.mark.parametrize(("delays_ns", "latency_ns", "is_inside"), first_quick(CASES, 2))
def test_a_burst_is_its_scans_one_by_one(delays_ns: tuple[int, ...], latency_ns: int, is_inside: bool) -> None:
    """The plain PLC does what was left out of the last burst when the next one begins: it has waited before the refresh."""
    fast = Rig(image(2), delays_ns, latency_ns, is_inside=is_inside, virtual_time=False, is_told=False)
    slow = Rig(image(2), delays_ns, latency_ns, virtual_time=False)
    plain(slow.plc)
    for _ in range(2):
        now_ns = fast.clock()
        fast.plc.scan(now_ns)
        slow.plc.scan(now_ns)
    scans = 0
    for number in range(80):
        fast.clock.now_ns += (200_000, 1000, 20_000)[number % 3]
        now_ns, waits = fast.clock.now_ns, fast.plc._io.skipped > 0
        for network in (*fast.networks, *slow.networks):
            network.serve(now_ns)
        times = fast.plc.scan_at_once(16, now_ns, fast.time)
        if waits:
            slow.plc._io.refresh(times[0])
        for time_ns in times:
            slow.plc.scan(time_ns)
        assert fast.state == slow.state
        scans += len(times)
    assert isinstance(way(fast), WithUnits if is_inside else ProgramAlone)
    assert scans > 80 and fast.plc.read("D20001") > 3  # type: ignore[operator]


# --- the program alone, beside units and machine code that say what is asked of them ---------------------------------------


class Units:
    """The I/O refresh of one PLC, whose units are idle, want a scan at `unit_at_ns`, and are refreshed or skipped."""

    def __init__(self, **state: Any) -> None:
        self.units: list[Any] = []
        self.watched: Any = []
        self.idle, self.after, self.unit_at_ns = True, True, NEVER
        self.skipped, self.changed_words, self.recorder = 0, False, None
        self.told: list[Any] = []
        vars(self).update(state)

    def refresh(self, now_ns: int, journal: Any = None, seen: Any = None) -> bool:
        self.told.append(("refresh", now_ns))
        self.skipped = 0
        return self.after

    def is_idle(self, now_ns: int) -> bool:
        return self.idle

    def unit_ns(self, latest_ns: int) -> int:
        return min(self.unit_at_ns, latest_ns)

    def wake_ns(self, latest_ns: int) -> int:
        return 0 if self.changed_words else self.unit_ns(latest_ns)


def alone(units: Units, is_idle: bool = True, **answers: Any) -> ProgramAlone:
    """A path whose machine code does the scans that it is asked for and ends at `point`, as far as `answers` say nothing else."""
    def run(most: int, *asked: int) -> tuple[int, int]:
        units.told.append(("run", most, *asked))
        return answers.get("done", most), answers.get("point", 0)

    def once(now_ns: int, budget: int) -> int:
        units.told.append(("scan", now_ns, budget))
        return int(answers.get("point", 0))

    scans = SimpleNamespace(
        run=run, once=once, changed=answers.get("changed", False), expect=None, parameters=SimpleNamespace(scan_budget=0),
        load_times=lambda: units.told.append("times loaded"), store_times=lambda: units.told.append("times stored"))
    machine: Any = SimpleNamespace(scans=lambda *given: scans, trap_at=lambda point: f"trap at {point}")
    as_refresh: Any = units
    path = ProgramAlone(as_refresh, machine, [])
    path._idle = is_idle
    return path


@each_of(("is_idle", "units", "answers", "result", "told", "skipped"), [
    (True, {}, {}, (5, None), [("run", 5, 120, 20, 70, 7)], 5),
    (True, {"changed_words": True}, {}, (5, None), [("run", 5, 120, 20, 70, 7)], 5),
    (False, {}, {}, (0, None), [], 0),
    (True, {"idle": False}, {}, (0, None), [], 0),
    (True, {"unit_at_ns": 160}, {}, (2, None), [("run", 2, 120, 20, 70, 7)], 2),
    (True, {"unit_at_ns": 161}, {}, (3, None), [("run", 3, 120, 20, 70, 7)], 3),
    (True, {"unit_at_ns": 121}, {}, (1, None), [("run", 1, 120, 20, 70, 7)], 1),
    (True, {"unit_at_ns": 120}, {}, (0, None), [], 0),
    (True, {"unit_at_ns": 100}, {}, (0, None), [], 0),
    (True, {"skipped": 4}, {"done": 3, "point": 8}, (3, "trap at 8"), [("run", 5, 120, 20, 70, 7)], 6),
    (True, {"skipped": 4}, {"done": 3, "changed": True, "point": 8}, (3, "trap at 8"), [("run", 5, 120, 20, 70, 7)], 6),
    (True, {}, {"done": 3, "changed": True}, (3, None), [("run", 5, 120, 20, 70, 7), ("refresh", 160)], 0),
])
def test_many_scans_end_before_a_unit_wants_one(is_idle: bool, units: dict[str, Any], answers: dict[str, Any], result: Any,
                                                told: list[Any], skipped: int) -> None:  # fmt: skip
    io = Units(**units)
    assert alone(io, is_idle, **answers).many(5, 100, 20, 70, 7) == result
    assert (io.told, io.skipped, io.changed_words) == (told, skipped, False)


def test_who_records_is_told_before_many_scans() -> None:
    io = Units()
    io.recorder = SimpleNamespace(before=lambda now_ns: io.told.append(("before", now_ns)))
    assert alone(io).many(2, 100, 20, 70, 7) == (2, None)
    assert io.told == [("before", 120), ("run", 2, 120, 20, 70, 7)]


@each_of(("is_idle", "units", "answers", "trap", "refreshed", "skipped"), [
    (True, {}, {}, None, False, 1), (False, {}, {}, None, True, 0), (True, {"idle": False}, {}, None, True, 0),
    (True, {}, {"changed": True}, None, True, 0), (True, {}, {"point": 8}, "trap at 8", False, 0),
])
def test_a_refresh_is_left_out_where_it_would_change_nothing(is_idle: bool, units: dict[str, Any], answers: dict[str, Any],
                                                             trap: Any, refreshed: bool, skipped: int) -> None:  # fmt: skip
    io = Units(changed_words=True, **units)
    assert alone(io, is_idle, **answers).once(100, 70) == trap
    assert (io.told, io.skipped) == ([("scan", 100, 70), *[("refresh", 100)] * refreshed], skipped)
    assert io.changed_words == (refreshed or trap is not None)


@each_of(("units", "answers", "most", "times", "trap", "told"), [
    ({}, {}, 3, [11], None, [("scan", 11, 70)]),
    ({"unit_at_ns": 11}, {}, 3, [11, 12, 13], None, [("scan", 11, 70), ("scan", 12, 70), ("scan", 13, 70)]),
    ({"unit_at_ns": 12}, {}, 3, [11], None, [("scan", 11, 70)]),
    ({"skipped": 2}, {}, 1, [11], None, [("scan", 11, 70)]),
    ({"skipped": 2, "idle": False}, {}, 1, [11], None, [("1 skipped", 11), ("scan", 11, 70), ("0 skipped", 11)]),
    ({"idle": False, "changed_words": True}, {}, 2, [11, 12], None,
     [("scan", 11, 70), ("0 skipped", 11), ("scan", 12, 70), ("0 skipped", 12)]),
    ({"idle": False, "changed_words": True}, {"point": 8}, 2, [11], "trap at 8", [("scan", 11, 70)]),
])
def test_a_burst_goes_on_while_units_have_changed_words(units: dict[str, Any], answers: dict[str, Any], most: int,
                                                        times: list[int], trap: Any, told: list[Any]) -> None:  # fmt: skip
    """The refresh that was left out last is done first: those before it alone count as skipped."""
    io, ticks, seen = Units(**units), iter(range(11, 20)), list[int]()
    path = alone(io, **answers)

    def refresh(now_ns: int, journal: Any = None) -> None:
        io.told.append((f"{io.skipped} skipped", now_ns))
        io.skipped = 0

    path.refresh = refresh  # type: ignore[method-assign]
    clock: Any = SimpleNamespace(now=lambda: next(ticks))
    assert path.burst(seen, most, 5, clock, 70) == trap
    assert (seen, io.told) == (times, told)


@each_of(("is_idle", "idle"), [(True, True), (True, False), (False, True), (False, False)])
def test_only_a_plc_with_nothing_to_do_enters_a_batch(is_idle: bool, idle: bool) -> None:
    io = Units(idle=idle, unit_at_ns=500)
    path = alone(io, is_idle)
    entered = path.enter_batch(100, 70)
    if is_idle and idle:
        assert entered == (path._scans, 500) and path._scans.parameters.scan_budget == 70 and io.told == ["times loaded"]
    else:
        assert (entered, io.told) == (None, [])
    io.skipped, io.changed_words = 4, True
    path.leave_batch(3)
    assert (io.told[-1], io.skipped, io.changed_words) == ("times stored", 7, False)


@each_of(("unfinished", "events", "is_recorded", "more", "told"), [
    (0, [7], True, False, [("skipped told",), ("passed", 1), ("post", [7]), ("recorded", 1, [7])]),
    (2, [7], True, True, [("skipped told",), ("submit", 90), ("passed", 1), ("post", [7]), ("recorded", 1, [7])]),
    (2, [7], False, False, [("skipped told",), ("submit", 90), ("passed", 1), ("post", [7])]),
    (0, [], True, False, [("skipped told",), ("passed", 1)]),
])
def test_what_a_unit_has_asked_goes_out_before_it_is_told_more(unfinished: int, events: list[int], is_recorded: bool, more: bool,
                                                               told: list[Any]) -> None:  # fmt: skip
    """Ctrl-C may have come between machine code, which left a request, and its submission."""
    said, path = list[Any](), object.__new__(WithUnits)
    link = SimpleNamespace(is_quiet=False, submit=lambda requests, now_ns: said.append(("submit", now_ns)))
    link.events = lambda now_ns: setattr(link, "is_quiet", not more) or events
    quiet = SimpleNamespace(is_quiet=True, pass_by=lambda count: said.append(("passed", count)))
    unit: Any = SimpleNamespace(finish=lambda: ["asked"], post=lambda events: said.append(("post", events)))
    recorder = SimpleNamespace(received=lambda *row: said.append(("recorded", *row)))
    io = Units(skipped=3, report_skipped=lambda: said.append(("skipped told",)), recorder=recorder if is_recorded else None)
    parameters: Any = SimpleNamespace(unfinished=unfinished, faulty=0)
    rows: Any = [(0, unit, quiet), (1, unit, link)]
    vars(path).update(_io=io, _parameters=parameters, _rows=rows)
    assert path._collect_events(90) == more
    assert (said, parameters.unfinished) == (told, 0)


@each_of("begin_anew", [Plc.warm_start, Plc.cold_start, lambda plc: plc.restore(plc.snapshot())])
def test_a_start_or_a_restore_makes_the_path_anew(begin_anew: Callable[[Plc], None]) -> None:
    """With what its machine code still had to tell of the scan that a trap has ended."""
    plc = Plc(IMAGE, MS, engine="native")
    plc.run(scans=3)
    before = plc.fast_path()
    plc.run(scans=3)
    assert before is not None and plc.fast_path() is before
    begin_anew(plc)
    plc.run(scans=3)
    assert isinstance(plc.fast_path(), ProgramAlone) and plc.fast_path() is not before


def test_the_page_names_tests_that_there_are() -> None:
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))
    assert len(named) > 8
    assert [(file, test) for file, test in named if f"def {test}(" not in (HOUSE / file).read_text(encoding="utf-8")] == []
