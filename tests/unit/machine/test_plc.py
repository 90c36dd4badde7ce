"""The PLC: scan by scan, values, forces, modes, starts, travel in time, traps, units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest
from images import D200, counter_image, task
from rows import each_of

from fbvm.base.areas import AREAS, DUE
from fbvm.base.memory import Memory
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Mode, Plc, Stopped
from fbvm.machine.scan.refresh import Attached, IORefresh
from fbvm.net.loop import LoopNetwork
from fbvm.units.contract import AreaMemory
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.wire.link import Event, Link, Request, Send, Sent

MS = 1_000_000


@pytest.fixture
def plc() -> Plc:
    return Plc(counter_image())


# --- scans and time ---------------------------------------------------------------------------------------------------


def test_a_scan_executes_the_program_once(plc: Plc) -> None:
    assert plc.scan() is None
    assert (plc.read("Main.n"), plc.read("D200"), plc.scans) == (1, 1, 1)


def test_virtual_time_begins_at_0_and_goes_on_by_the_cycle(plc: Plc) -> None:
    times = []
    for _ in range(3):
        plc.scan()
        times.append((plc.now_ns, plc.read("Main.started"), plc.elapsed_ns))
    assert times == [(0, 0, 10 * MS), (10 * MS, 10 * MS, 20 * MS), (20 * MS, 20 * MS, 30 * MS)]


def test_time_may_be_told(plc: Plc) -> None:
    plc.scan(5 * MS)
    plc.scan(5 * MS)
    assert plc.read("Main.started") == 5 * MS
    with pytest.raises(ValueError, match="time runs forward only"):
        plc.scan(4 * MS)


@pytest.mark.parametrize(("bounds", "reason", "scans"), [
    ({"scans": 3}, "scans", 3),
    ({"scans": 0}, "scans", 0),
    ({"for_ns": 50 * MS}, "time", 5),
    ({"for_ns": 45 * MS}, "time", 5),
    ({"until": "Main.done"}, "until", 5),
    ({"until": lambda plc: plc.read("D200") == 4}, "until", 4),
    ({"until": "Main.n > 100", "max_ns": 200 * MS}, "max", 20),
    ({"until": "Main.done", "scans": 4}, "scans", 4),
])
def test_a_run_ends(plc: Plc, bounds: dict[str, int], reason: str, scans: int) -> None:
    assert (plc.run(**bounds), plc.scans) == (reason, scans)  # type: ignore[arg-type]


def test_bounds_count_from_where_a_run_begins(plc: Plc) -> None:
    plc.run(scans=7)
    assert (plc.run(scans=2), plc.run(for_ns=30 * MS), plc.scans) == ("scans", "time", 12)
    assert (plc.run(until="Main.done"), plc.scans) == ("until", 13)


@pytest.mark.parametrize(("bounds", "message"), [
    ({}, "say when to end"),
    ({"scans": -1}, "scans is -1; it cannot be negative"),
])
def test_a_run_without_sensible_end_is_refused(plc: Plc, bounds: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        plc.run(**bounds)  # type: ignore[arg-type]


def test_a_condition_that_is_none_is_refused(plc: Plc) -> None:
    with pytest.raises(ConditionError):
        plc.run(until="Main.n")


def test_a_cycle_takes_time() -> None:
    with pytest.raises(ValueError, match="a cycle takes time"):
        Plc(counter_image(), 0)


# --- tasks ------------------------------------------------------------------------------------------------------------


def test_a_task_runs_by_its_interval() -> None:
    plc = Plc(counter_image(task("slow", interval_ns=25 * MS)))
    counts = []
    for _ in range(8):
        plc.scan()
        counts.append(plc.read("D200"))
    assert counts == [1, 1, 1, 2, 2, 3, 3, 3]  # at 0, 30 (due 25), 50; next at 80 (due 75)


def test_a_missed_interval_is_not_made_up_for() -> None:
    plc = Plc(counter_image(task("fast", interval_ns=10 * MS)))
    for now_ms in (0, 95, 96, 100):
        plc.scan(now_ms * MS)
    assert plc.read("D200") == 3


def test_a_task_with_single_runs_at_its_rising_edge() -> None:
    plc = Plc(counter_image(task("once", single="Go")))
    counts = []
    for level in (False, True, True, False, True):
        plc.write("Go", level)
        plc.scan()
        counts.append(plc.read("D200"))
    assert counts == [0, 1, 1, 1, 2]


def test_a_task_with_single_and_interval_stands_while_single_is_true_but_for_the_edge() -> None:
    plc = Plc(counter_image(task("both", single="Go", interval_ns=10 * MS)))
    counts = []
    for level in (False, False, True, True, False):
        plc.write("Go", level)
        plc.scan()
        counts.append(plc.read("D200"))
    assert counts == [1, 2, 3, 3, 4]


def test_tasks_run_by_priority() -> None:
    ten = ("store", "u16", ("abs", D200 + 2, ()), ("load", "u16", ("abs", D200, ())))
    plc = Plc(counter_image(task("late", 9, 20 * MS), task("early", 1), extra=(ten,)))
    plc.run(scans=2)
    assert plc.read("D200..D201") == [3, 3]


# --- what the CPU unit tells ------------------------------------------------------------------------------------------


def test_the_first_cycle_flag_is_on_for_one_cycle(plc: Plc) -> None:
    flags = []
    for _ in range(3):
        plc.scan()
        flags.append(plc.read("A200.11"))
    assert flags == [True, False, False]


def test_cycle_times_count_tenths_of_a_millisecond(plc: Plc) -> None:
    seen = []
    for now_ms in (0, 10, 35, 45):
        plc.scan(now_ms * MS)
        seen.append((plc.read("A264"), plc.read("A262")))
    assert seen == [(0, 0), (100, 100), (250, 250), (100, 250)]


def test_a_long_cycle_fills_both_words(plc: Plc) -> None:
    plc.scan(0)
    plc.scan(10_000 * MS)
    assert plc.read("A264..A265") == plc.read("A262..A263") == [100_000 & 0xFFFF, 1]
    plc.scan(10_010 * MS)
    assert plc.read("A262..A265") == [100_000 & 0xFFFF, 1, 100, 0]


def test_clock_pulses_are_off_first_assumed(plc: Plc) -> None:
    levels = []
    for now_ms in (0, 499, 500, 999, 1000):
        plc.scan(now_ms * MS)
        levels.append(plc.read("CF102"))
    assert levels == [False, False, True, True, False]
    assert [plc.read(f"CF{number}") for number in (113, 114)] == [True, False]


@each_of("number, period_ms", [(103, 20), (100, 100), (101, 200), (102, 1_000), (104, 60_000)])
def test_each_clock_pulse_has_its_period(number: int, period_ms: int) -> None:
    """W394, condition flags: 0.02 s, 0.1 s, 0.2 s, 1 s and 1 min; half of it OFF, half of it ON."""
    plc, half = Plc(counter_image()), period_ms // 2
    levels = []
    for now_ms in (0, half - 1, half, period_ms - 1, period_ms, period_ms + half, 3 * period_ms - 1, 3 * period_ms):
        plc.scan(now_ms * MS)
        levels.append(plc.read(f"CF{number}"))
    assert levels == [False, False, True, True, False, True, True, False]


def test_free_running_counters_assumed(plc: Plc) -> None:
    plc.scan(655_370 * MS)
    assert plc.read("A0..A1") == [1, 6553]


# --- values -----------------------------------------------------------------------------------------------------------


def test_names_beat_addresses_and_ranges_are_lists(plc: Plc) -> None:
    plc.write("D300..D302", [1, 2, 3])
    assert plc.read("d300..d302") == [1, 2, 3]
    plc.write("Main.step", -2)
    plc.scan()
    assert plc.read("main.N") == -2


@pytest.mark.parametrize(("where", "value", "error", "message"), [
    ("Main.n", 40000, ValueError, "Main.n: 40000 is out of range of INT, which holds -32768..32767"),
    ("D5", -1, ValueError, "D5: -1 is out of range of WORD"),
    ("D5..D6", [1], ValueError, "D5..D6 takes a list of 2 values"),
    ("D5..D6", 7, ValueError, "takes a list"),
    ("Main.limit", 1, ValueError, "Main.limit is CONSTANT"),
    ("Main.done", "yes", TypeError, "Main.done is BOOL"),
    ("Main.missing", 1, UnknownPlace, "Main has no missing"),
])
def test_a_wrong_write_is_refused(plc: Plc, where: str, value: object, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        plc.write(where, value)


def test_an_instance_is_read_as_a_dictionary(plc: Plc) -> None:
    plc.scan()
    assert plc.read("Main") == {"n": 1, "done": False, "kept": 1, "step": 1, "started": 0, "limit": 5}


# --- forces -----------------------------------------------------------------------------------------------------------


def test_a_force_holds_before_and_after_the_program(plc: Plc) -> None:
    plc.force("Main.n", 50)
    plc.scan()
    assert (plc.read("Main.n"), plc.read("Main.done"), plc.forces) == (50, True, {"Main.n": 50})
    plc.unforce("main.N")
    plc.scan()
    assert (plc.read("Main.n"), plc.forces) == (51, {})


def test_a_force_is_there_again_before_the_program_whatever_was_written_meanwhile(plc: Plc) -> None:
    plc.force("Main.n", 50)
    plc.write("Main.n", -9)
    plc.scan()
    assert plc.read("Main.done") is True


def test_a_forced_bit_leaves_its_neighbours(plc: Plc) -> None:
    plc.force("CIO 100.03", True)
    plc.write("CIO 100", 0)
    plc.scan()
    assert plc.read("CIO 100") == 8
    plc.unforce()
    plc.write("CIO 100", 0)
    plc.scan()
    assert plc.read("CIO 100") == 0


@each_of("name", ["TF7", "T0007", "CNF12", "C0012"])
def test_a_completion_flag_is_forced_and_written_by_its_name_as_it_is_shown(name: str) -> None:
    image = compile_text("PROGRAM Main VAR n : INT; END_VAR n := 1; END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    flag, value = ("TF7", "T7") if name[0] == "T" else ("CNF12", "C12")
    plc.force(name, True)
    assert (plc.read(flag), plc.read(value), plc.forces) == (True, 0, {f"{name[0]}{flag.strip('TFCN'):0>4}": True})
    plc.force(value, 9)
    plc.unforce(next(iter(plc.forces)))
    assert (plc.read(flag), plc.forces) == (True, {value: 9})
    plc.write(name, False)
    plc.unforce(value)
    assert (plc.read(flag), plc.read(value), plc.forces) == (False, 9, {})
    plc.write("T0007", 5)
    assert plc.read("T7") == 5, "a number is for the present value"


def test_a_range_is_not_forced(plc: Plc) -> None:
    with pytest.raises(UnknownPlace, match="is a range"):
        plc.force("D1..D2", 1)


# --- starts and modes -------------------------------------------------------------------------------------------------


def test_a_warm_start_keeps_what_is_retained(plc: Plc) -> None:
    plc.write("W5", 1)
    plc.write("H5", 2)
    plc.run(scans=7)
    plc.warm_start()
    values = [plc.read(name) for name in ("Main.n", "Main.kept", "Main.step", "D200", "W5", "H5")]
    assert values == [0, 7, 1, 7, 0, 2]


def test_a_cold_start_keeps_nothing(plc: Plc) -> None:
    plc.run(scans=7)
    plc.cold_start()
    assert [plc.read(name) for name in ("Main.n", "Main.kept", "Main.step", "D200")] == [0, 0, 1, 0]
    plc.scan()
    assert (plc.read("A200.11"), plc.now_ns) == (True, 70 * MS)


def test_in_program_mode_the_program_stands(plc: Plc) -> None:
    plc.scan()
    plc.mode = Mode.PROGRAM
    plc.run(scans=3)
    assert (plc.read("D200"), plc.scans) == (1, 4)


@pytest.mark.parametrize(("held", "w5"), [(False, 0), (True, 9)])
def test_a_change_to_run_clears_unless_io_memory_is_held(plc: Plc, held: bool, w5: int) -> None:
    plc.run(scans=2)
    plc.mode = Mode.PROGRAM
    plc.write("W5", 9)
    plc.write("A500.12", held)
    plc.mode = Mode.RUN
    assert plc.read("W5") == w5
    plc.scan()
    assert (plc.read("A200.11"), plc.read("Main.n"), plc.read("D200")) == (True, 1, 3)


# --- traps ------------------------------------------------------------------------------------------------------------


def test_a_trap_stops_the_plc() -> None:
    plc = Plc(counter_image(extra=(("stop", "R0101", 0),)))
    trap = plc.scan()
    assert trap is not None
    assert (trap.code, plc.trap, plc.scans) == ("R0101", trap, 1)
    with pytest.raises(Stopped, match="R0101"):
        plc.scan()
    plc.warm_start()
    assert plc.trap is None


def test_a_run_ends_at_a_trap() -> None:
    assert Plc(counter_image(extra=(("stop", "R0101", 0),))).run(scans=5) == "trap"


def test_the_step_budget_is_counted_anew_in_each_scan() -> None:
    plc = Plc(counter_image(), budget=4)
    assert plc.run(scans=5) == "scans"
    assert Plc(counter_image(), budget=3).run(scans=5) == "trap"


# --- travel -----------------------------------------------------------------------------------------------------------


def test_a_snapshot_is_a_way_back(plc: Plc) -> None:
    plc.force("D7", 7)
    plc.run(scans=3)
    state = plc.snapshot()
    plc.run(scans=4)
    plc.unforce()
    after = plc.memory.snapshot()
    plc.restore(state)
    assert (plc.scans, plc.now_ns, plc.read("Main.n"), plc.forces) == (3, 20 * MS, 3, {"D7": 7})
    plc.run(scans=4)
    assert bytes(plc.memory.snapshot()) == bytes(after)


class _Told:
    """A recorder that counts what is no input."""

    wants_plain_scans = False

    def __init__(self) -> None:
        self.changes = 0
        self.times_ns: list[int] = []

    def changed(self) -> None:
        self.changes += 1

    def after(self, scans: int, now_ns: int, step_ns: int = 0) -> None:
        self.times_ns += [now_ns + step_ns * number for number in range(scans)]

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *told: None


@each_of("change", [
    lambda plc: plc.warm_start(), lambda plc: plc.cold_start(), lambda plc: setattr(plc, "mode", Mode.PROGRAM),
    lambda plc: plc.restore(plc.snapshot()), lambda plc: plc.attach(_Echo(), LoopNetwork()),
], ids=["warm start", "cold start", "mode", "restore", "unit"])
def test_a_recorder_is_told_of_a_change_that_is_no_input(change: Callable[[Plc], None]) -> None:
    plc, recorder = Plc(counter_image()), _Told()
    plc.record_inputs(recorder)
    assert plc.input_recorder is recorder
    plc.run(scans=2)
    assert recorder.changes == 0 and recorder.times_ns == [0, 10 * MS]
    change(plc)
    assert recorder.changes == 1


def test_a_reader_reads_a_place_again_and_again(plc: Plc) -> None:
    place = plc.find("Main.n")
    assert isinstance(place, Place)
    read = plc.reader(place)
    seen = []
    for _ in range(3):
        plc.scan()
        seen.append(read())
    assert seen == [1, 2, 3]


def test_a_fork_goes_its_own_way(plc: Plc) -> None:
    plc.run(scans=3)
    twin = plc.fork()
    twin.run(scans=2)
    assert (plc.read("Main.n"), twin.read("Main.n"), twin.now_ns) == (3, 5, 40 * MS)


# --- units ------------------------------------------------------------------------------------------------------------


class _Echo:
    """A unit that reports D200 of the refresh in D300 and what came from the network in D301."""

    name, address, wake_ns = "Echo 0", "192.168.250.2", 1 << 63
    changed_words = False
    watched = exchanged = None

    def __init__(self) -> None:
        self.resets = 0

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        d = memory.words("D")
        d[300] = d[200]
        d[301] += len(events)
        return [Send(1, bytes([d[200]]))]

    def reset(self, memory: AreaMemory) -> list[Request]:
        self.resets += 1
        return []


class _Wire:
    """A network that says `Sent` one refresh later."""

    virtual_time = True
    is_quiet = False

    def __init__(self) -> None:
        self.address = ""
        self.sent: list[tuple[int, bytes]] = []
        self._pending: list[Event] = []

    def attach(self, address: str) -> Link:
        self.address = address
        return self

    def submit(self, requests: Sequence[Request], now_ns: int) -> None:  # type: ignore[override]
        for request in requests:
            assert isinstance(request, Send)
            self.sent.append((now_ns, request.data))
            self._pending.append(Sent(1, 1))

    def events(self, now_ns: int) -> list[Event]:
        events, self._pending = self._pending, []
        return events

    def close(self) -> None:
        pass


def test_each_unit_is_refreshed_once_after_the_program(plc: Plc) -> None:
    wire = _Wire()
    plc.attach(_Echo(), wire)
    plc.run(scans=2)
    assert (plc.read("D300"), plc.read("D301"), wire.sent) == (2, 1, [(0, b"\1"), (10 * MS, b"\2")])


def test_the_next_scan_is_worth_while_when_timer_task_or_unit_say_so(plc: Plc) -> None:
    echo = _Echo()
    plc.attach(echo, _Wire())
    plc.scan()
    far = plc.due_ns
    echo.wake_ns = 7 * MS
    assert plc.due_ns == 7 * MS < far
    plc.memory.write(DUE, "i64", 5 * MS)
    assert plc.due_ns == 5 * MS
    echo.changed_words = True
    plc.scan()
    assert plc.due_ns == 0


def test_units_are_reset_at_power_on(plc: Plc) -> None:
    echo = _Echo()
    plc.attach(echo, _Wire())
    plc.warm_start()
    plc.cold_start()
    assert echo.resets == 3


def test_a_trapped_scan_does_not_reach_the_units() -> None:
    plc = Plc(counter_image(extra=(("stop", "R0101", 0),)))
    wire = _Wire()
    plc.attach(_Echo(), wire)
    plc.scan()
    assert wire.sent == []


def test_two_units_of_one_name_do_not_fit_one_backplane(plc: Plc) -> None:
    plc.attach(_Echo(), _Wire())
    with pytest.raises(ValueError, match="Echo 0 is on the backplane already"):
        plc.attach(_Echo(), _Wire())


def test_connections_do_not_travel_in_time(plc: Plc) -> None:
    state = plc.snapshot()
    plc.attach(_Echo(), _Wire())
    with pytest.raises(ValueError, match="do not travel in time"):
        plc.restore(state)


def test_a_refresh_is_worth_while_from_the_moment_on_that_a_unit_waits_for() -> None:
    layout = counter_image().layout
    memory = Memory(layout.size, layout.areas)

    def io(*units: tuple[int, bool]) -> IORefresh:
        return IORefresh([cast(Attached, SimpleNamespace(unit=SimpleNamespace(wake_ns=wake_ns, watched=[("D", 3)]),
                                                         link=SimpleNamespace(is_quiet=is_quiet)))
                          for wake_ns, is_quiet in units], memory)

    assert [io((9, True), (5, True)).is_idle(now_ns) for now_ns in (4, 5, 6)] == [True, False, False]
    assert not io((9, True), (9, False)).is_idle(4) and io().is_idle(4)
    assert (io((9, True), (5, True)).unit_ns(7), io((9, True)).unit_ns(7), io((9, True)).wake_ns(20)) == (5, 7, 9)
    told = io((9, True))
    told.changed_words = True
    assert told.wake_ns(20) == 0
    assert told.watched == [[AREAS["D"].offset + 6]]


def test_a_plc_goes_on_from_a_state_with_the_units_that_belong_to_it(plc: Plc) -> None:
    plc.attach(first := _Echo(), _Wire())
    plc.run(scans=3)
    state, attached = plc.snapshot(), list(plc.units)
    plc.run(scans=2)
    plc.resume(state)
    assert (plc.units, plc.scans, plc.read("D300")) == ([], 3, 3)
    plc.scan()
    assert plc.read("D300") == 3
    plc.resume(state, attached)
    plc.scan()
    assert [each.unit for each in plc.units] == [first] and plc.read("D300") == 4


def test_a_recorder_is_told_of_each_refresh_and_of_the_events_in_it(plc: Plc) -> None:
    class Refreshes(_Told):
        def __init__(self) -> None:
            super().__init__()
            self.told: list[object] = []

        def received(self, unit: int, events: Sequence[Event]) -> None:
            self.told.append((unit, list(events)))

        def refresh_begins(self) -> None:
            self.told.append("begins")

        def refresh_ended(self) -> None:
            self.told.append("ended")

    recorder = Refreshes()
    plc.record_inputs(recorder)
    plc.attach(_Echo(), _Wire())
    plc.run(scans=2)
    assert recorder.told == ["begins", "ended", "begins", (0, [Sent(1, 1)]), "ended"]


def test_real_connections_in_virtual_time_are_refused(plc: Plc) -> None:
    wire = _Wire()
    wire.virtual_time = False
    plc.attach(_Echo(), wire)
    with pytest.raises(ValueError, match="real connections need real time"):
        plc.scan()
    assert plc.scan(0) is None


def test_watchers_see_the_memory_after_the_refresh(plc: Plc) -> None:
    seen: list[object] = []
    plc.attach(_Echo(), _Wire())
    plc.watchers.append(lambda plc: seen.append(plc.read("D300")))
    plc.run(scans=3)
    assert seen == [1, 2, 3]


def test_a_snapshot_of_a_plc_with_units_is_compared_and_forked_but_no_way_back() -> None:
    plc = Plc(counter_image())
    plc.attach(_Echo(), _Wire())
    plc.run(scans=2)
    state, twin = plc.snapshot(), plc.fork()
    assert bytes(state.memory) == bytes(twin.snapshot().memory)
    assert (twin.units, twin.scans) == ([], 2)
    with pytest.raises(ValueError, match="with units attached cannot go back"):
        plc.restore(state)


def test_tasks_that_want_to_be_quicker_than_the_cycle_are_told() -> None:
    tasks = (task("Fast", interval_ns=5 * MS), task("Slow", interval_ns=15 * MS), task("Each"))
    assert [warning.partition(":")[0] for warning in Plc(counter_image(*tasks), 10 * MS).warnings] == [
        "task Fast wants 5ms, the PLC scans every 10ms"]
    assert Plc(counter_image(*tasks), 5 * MS).warnings == ()


def test_a_snapshot_keeps_when_tasks_are_next() -> None:
    """Of a PLC in the middle of an interval: later scans are the same after `restore`."""
    made = compile_text("""PROGRAM Count VAR n : INT; END_VAR n := n + 1; END_PROGRAM
        CONFIGURATION c RESOURCE r ON cpu
            TASK slow (INTERVAL := T#50ms, PRIORITY := 1); TASK quick (INTERVAL := T#30ms, PRIORITY := 2);
            PROGRAM a WITH slow : Count; PROGRAM b WITH quick : Count;
        END_RESOURCE END_CONFIGURATION""").image
    assert made is not None
    plc = Plc(made, 10_000_000)
    plc.run(scans=7)
    state = plc.snapshot()
    counted = []
    for _ in range(2):
        counted.append([])
        for _ in range(12):
            plc.scan()
            counted[-1].append((plc.read("a.n"), plc.read("b.n")))
        plc.restore(state)
    assert counted[0] == counted[1]
    assert counted[0][-1] == (4, 7)


@each_of("time_ns, is_taken", [
    (10 * MS, True), (10 * MS - 1, False), (1_000 * MS, True), (40_000 * MS, True), (40_000 * MS + 1, False), (0, False),
    (-MS, False),
])
def test_a_watch_cycle_time_is_10_ms_to_40_s_and_1_s_unless_somebody_says(time_ns: int, is_taken: bool) -> None:
    """W394, PLC Setup: the watch cycle time."""
    watch = Plc(counter_image()).watch_cycle
    assert watch.time_ns == 1_000 * MS
    if is_taken:
        watch.time_ns = time_ns
        assert watch.time_ns == time_ns
    else:
        with pytest.raises(ValueError, match="a watch cycle time is 10 ms to 40 s"):
            watch.time_ns = time_ns
        assert watch.time_ns == 1_000 * MS


@each_of(("trap", "needed", "mode", "recorded", "told"), [
    (None, True, Mode.PROGRAM, True, ["serve 5", "changed", Mode.PROGRAM]),
    (None, True, Mode.PROGRAM, False, ["serve 5", Mode.PROGRAM]),
    (None, True, None, True, ["serve 5"]), (None, False, Mode.PROGRAM, True, []), ("trap", True, Mode.PROGRAM, True, []),
])  # fmt: skip
def test_a_change_of_mode_by_a_command_is_recorded(
    trap: Any, needed: bool, mode: Mode | None, recorded: bool, told: list[Any]
) -> None:
    said: list[Any] = []
    servicing = SimpleNamespace(is_needed=needed, serve=lambda now_ns: said.append(f"serve {now_ns}") or recorded)
    plc: Any = SimpleNamespace(trap=trap, servicing=servicing, now_ns=5, _io=SimpleNamespace(changed_words=False),
                               _next_mode=mode, _change_mode=said.append,
                               _recorder=SimpleNamespace(changed=lambda: said.append("changed")) if recorded else None)
    Plc._serve_peripherals(plc)
    assert said == told and plc._io.changed_words is (bool(told) and recorded)
    assert plc._next_mode == (None if told else mode)
