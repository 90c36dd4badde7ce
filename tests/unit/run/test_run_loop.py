"""The loop that waits: periods, overruns, events, timed writes, Ctrl-C.

The host's clock is a stand-in that never waits.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from types import SimpleNamespace

import pytest
from images import counter_image, task

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.run import Running, TimedWrite, loop, run, run_all
from fbvm.units.contract import AreaMemory
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Event, Link, Request

MS = 1_000_000


class Clock:
    """Stands in for the module `time`: sleeping moves it, and each look costs a microsecond."""

    def __init__(self) -> None:
        self.now_ns = 1_000_000_000_000
        self.slept_ns: list[int] = []

    def get_clock_info(self, name: str) -> SimpleNamespace:
        return SimpleNamespace(implementation="a stand-in")

    def monotonic_ns(self) -> int:
        self.now_ns += 1000
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        self.slept_ns.append(round(seconds * 1e9))
        self.now_ns += round(seconds * 1e9)


class RealNetwork:
    """A network of real time on which something happens at the given times."""

    virtual_time = driven = False
    address = ""

    def __init__(self, clock: Clock, *happenings_ms: int) -> None:
        self.clock = clock
        self.waits_ms: list[float] = []
        self._attached = self._happened = False
        self._happenings_ns = [clock.now_ns + at_ms * MS for at_ms in happenings_ms]

    is_quiet = False

    def attach(self, address: str) -> Link:
        """The first unit's link is the network itself, to which everything happens."""
        if not self._attached:
            self._attached = True
            return self
        return RealNetwork(self.clock)

    def wait(self, timeout_s: float) -> bool:
        self.waits_ms.append(round(timeout_s * 1e3))
        until_ns = self.clock.now_ns + max(0, round(timeout_s * 1e9))
        early = self._happenings_ns.pop(0) if self._happenings_ns and self._happenings_ns[0] < until_ns else None
        self.clock.now_ns = max(self.clock.now_ns, until_ns if early is None else early)
        self._happened = early is not None
        return self._happened

    def serve(self, now_ns: int) -> list[Link]:
        happened, self._happened = self._happened, False
        return [self] if happened else []

    def events(self, now_ns: int) -> list[Event]:
        return []

    def submit(self, requests: Sequence[Request], now_ns: int) -> None:  # type: ignore[override]
        pass

    def close(self) -> None:
        pass


class Idle:
    """A unit that does nothing."""

    name, address, wake_ns = "Idle 0", "192.168.250.9", 1 << 63
    changed_words = False
    watched = exchanged = None

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        return []

    def reset(self, memory: AreaMemory) -> list[Request]:
        return []


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    stand_in = Clock()
    monkeypatch.setattr(loop, "time", stand_in)
    return stand_in


def real_plc(clock: Clock, *happenings_ms: int) -> tuple[Plc, RealNetwork]:
    plc, network = Plc(counter_image()), RealNetwork(clock, *happenings_ms)
    plc.attach(Idle(), network)
    return plc, network


def scan_times_ms(plc: Plc, **bounds: object) -> list[int]:
    times: list[int] = []
    plc.watchers.append(lambda plc: times.append(plc.now_ns // MS))
    run(plc, **bounds)  # type: ignore[arg-type]
    return times


# --- virtual time -----------------------------------------------------------------------------------------------------


def test_virtual_time_never_sleeps(clock: Clock) -> None:
    assert scan_times_ms(Plc(counter_image()), scans=4) == [0, 10, 20, 30]
    assert clock.slept_ns == []


def test_writes_come_before_the_scan_of_their_time() -> None:
    plc = Plc(counter_image())
    writes = [TimedWrite(plc.find("Main.step"), 10, 15 * MS), TimedWrite(plc.find("Main.step"), 2)]
    assert run(plc, scans=4, writes=writes) == "scans"
    assert plc.read("Main.n") == 2 + 2 + 10 + 10


def test_progress_is_told_now_and_then(clock: Clock) -> None:
    told: list[int] = []
    run(Plc(counter_image()), scans=1000, progress=lambda plc: told.append(plc.scans))
    assert told == []
    plc = Plc(counter_image())
    plc.watchers.append(lambda plc: clock.sleep(0.03))
    run(plc, scans=8, progress=lambda plc: told.append(plc.scans))
    assert told == [4, 8]


def test_ctrl_c_ends_a_run_cleanly() -> None:
    plc = Plc(counter_image())

    def interrupt(plc: Plc) -> None:
        if plc.scans == 3:
            raise KeyboardInterrupt

    plc.watchers.append(interrupt)
    assert run(plc, scans=9) == "interrupted"
    assert plc.scans == 3


def test_an_unknown_pace_is_refused() -> None:
    with pytest.raises(ValueError, match="pace is cyclic or event"):
        run(Plc(counter_image()), scans=1, pace="fast")


# --- real time --------------------------------------------------------------------------------------------------------


def test_a_period_is_kept(clock: Clock) -> None:
    plc, _ = real_plc(clock)
    assert scan_times_ms(plc, scans=5) == [0, 10, 20, 30, 40]
    assert len(clock.slept_ns) == 4 and all(9 * MS < slept_ns <= 10 * MS for slept_ns in clock.slept_ns)


def test_a_period_that_was_overrun_is_not_made_up_for(clock: Clock) -> None:
    plc, _ = real_plc(clock)

    def long(plc: Plc) -> None:
        if plc.scans == 2:
            clock.now_ns += 25 * MS

    plc.watchers.append(long)
    assert scan_times_ms(plc, scans=5) == [0, 10, 35, 45, 55]


def test_a_real_run_goes_on_from_where_time_stands(clock: Clock) -> None:
    plc, _ = real_plc(clock)
    run(plc, scans=2)
    clock.now_ns += 500 * MS
    assert scan_times_ms(plc, for_ns=30 * MS) == [20, 30, 40]


def test_event_pace_scans_when_something_arrives(clock: Clock) -> None:
    plc, network = real_plc(clock, 3, 4, 22)
    assert scan_times_ms(plc, scans=6, pace="event") == [0, 3, 4, 14, 22, 32]
    assert network.waits_ms == [10, 10, 10, 10, 10]


def test_scans_that_take_long_do_not_follow_at_once(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is heard between them, no signal either.  Whether they take long is known behind the first."""
    plc, _ = real_plc(clock)
    scans_ms, at_once = [1, 5, 1, 1, 1], []

    def scan(most: int, now_ns: int, told: object) -> list[int]:
        at_once.append(plc.scans)
        return single(now_ns)

    def single(now_ns: int) -> list[int]:
        clock.now_ns += scans_ms[plc.scans] * MS
        plc.scans, plc.now_ns = plc.scans + 1, now_ns
        return [now_ns]

    monkeypatch.setattr(plc, "scan_at_once", scan)
    monkeypatch.setattr(plc, "scan", single)
    assert run(plc, scans=5, pace="event") == "scans"
    assert at_once == [0, 1, 3]


def test_event_pace_wakes_for_a_tasks_interval(clock: Clock) -> None:
    plc, network = Plc(counter_image(task("fast", interval_ns=4 * MS))), RealNetwork(clock)
    plc.attach(Idle(), network)
    assert scan_times_ms(plc, scans=4, pace="event") == [0, 4, 8, 12]


def test_event_pace_sleeps_until_a_unit_has_work(clock: Clock) -> None:
    plc, network = real_plc(clock)
    unit = plc.units[0].unit
    plc.watchers.append(lambda plc: setattr(unit, "wake_ns", [0, 7 * MS, 1 << 63][min(plc.scans - 1, 2)]))
    assert scan_times_ms(plc, scans=4, pace="event") == [0, 0, 7, 17]
    assert network.waits_ms == [7, 10]


@pytest.mark.slow
def test_an_idle_plc_with_a_running_timer_is_woken_by_the_timer_only(clock: Clock) -> None:
    compilation = compile_text("""PROGRAM Main
VAR t : TON; n : UDINT; END_VAR
    t(IN := TRUE, PT := T#1s);
    IF t.Q THEN n := n + 1; t(IN := FALSE); t(IN := TRUE); END_IF;
END_PROGRAM
""")
    assert compilation.image
    plc, network = Plc(compilation.image, 600_000 * MS, engine="python"), RealNetwork(clock)
    plc.attach(Idle(), network)
    run(plc, until=lambda plc: plc.now_ns >= 60_000 * MS, pace="event")
    assert (plc.read("Main.n"), plc.scans, len(network.waits_ms)) == (60, 61, 60)


def test_how_late_scans_begin_is_measured(clock: Clock) -> None:
    plc, _ = real_plc(clock)

    def long(plc: Plc) -> None:
        clock.now_ns += 25 * MS if plc.scans == 2 else MS

    plc.watchers.append(long)
    run(plc, scans=5)
    assert (plc.scan_times.count, plc.scan_times.overruns) == (5, 1)
    assert (plc.lateness.count, plc.lateness.missed, plc.lateness.longest_scan) == (5, 1, 2)
    assert 14 * MS < plc.lateness.longest_ns < 16 * MS


def test_a_unit_s_program_is_made_ready_before_time_begins(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Etn21, "prepare", lambda unit: clock.sleep(0.8))
    plc = Plc(counter_image())
    plc.attach(Etn21(0, "192.168.250.1"), RealNetwork(clock))
    run(plc, scans=3)
    assert clock.slept_ns[0] == 800 * MS
    assert (plc.lateness.count, plc.lateness.missed) == (3, 0)


# --- several PLCs -----------------------------------------------------------------------------------------------------


def test_plcs_take_turns_by_their_cycles() -> None:
    scans: list[tuple[str, int]] = []
    runs = []
    for name, cycle_ms in (("a", 10), ("b", 4)):
        plc = Plc(counter_image(), cycle_ms * MS)
        plc.watchers.append(lambda plc, name=name: scans.append((name, plc.now_ns // MS)))  # type: ignore[misc]
        runs.append(Running(plc, for_ns=20 * MS))
    run_all(runs)
    assert scans == [("a", 0), ("b", 0), ("b", 4), ("b", 8), ("a", 10), ("b", 12), ("b", 16)]
    assert [run.reason for run in runs] == ["time", "time"]


def test_each_plc_has_its_own_end() -> None:
    plcs = [Plc(counter_image()) for _ in range(3)]
    runs = [Running(plcs[0], scans=2), Running(plcs[1], until="Main.n >= 5"), Running(plcs[2], until="Main.n > 9", max_ns=MS)]
    run_all(runs)
    assert [(run.reason, run.plc.scans) for run in runs] == [("scans", 2), ("until", 5), ("max", 1)]


def test_plcs_need_not_scan_at_the_same_moment(clock: Clock) -> None:
    times: list[tuple[int, int, int]] = []
    runs = []
    for number in range(2):
        plc, _ = real_plc(clock)
        plc.watchers.append(lambda plc, number=number: times.append(  # type: ignore[misc]
            (number, clock.now_ns // MS % 100, plc.now_ns // MS)))
        runs.append(Running(plc, scans=2, phase_ns=4 * MS * number))
    run_all(runs)
    assert times == [(0, 0, 0), (1, 4, 0), (0, 10, 10), (1, 14, 10)]


def test_many_plcs_are_switched_on_one_after_another(clock: Clock) -> None:
    """Each scans at its place in the period, some whole periods later; its date is that of all the others."""
    first: list[int] = []
    runs = []
    for number in range(90):
        plc, _ = real_plc(clock)
        plc.watchers.append(lambda plc: plc.scans == 1 and first.append(clock.now_ns // MS % 1000))
        runs.append(Running(plc, scans=3, phase_ns=number % 10 * MS))
    run_all(runs)
    wanted = [number % 10 + number * loop.SWITCH_ON_NS // (10 * MS) * 10 for number in range(90)]
    assert sorted(first) == sorted(wanted) and max(wanted) == 29
    dates = {run.plc.servicing.clock_ns - at * MS for run, at in zip(runs, wanted, strict=True)}
    assert max(dates) - min(dates) < 1000 * MS
    assert all(run.plc.lateness.missed == 0 for run in runs)


def test_a_plc_in_real_time_has_the_date_of_the_host_unless_it_has_another(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    """The date at its beginning: a PLC that scans 8 ms later begins at a later date."""
    date_ns = 800_000_000_000_000_000
    monkeypatch.setattr(loop, "local_date_ns", lambda: date_ns)
    plcs = [real_plc(clock)[0] for _ in range(3)]
    plcs[1].servicing.clock_ns = 5
    run_all([Running(plc, scans=1, phase_ns=4 * MS * number) for number, plc in enumerate(plcs)])
    assert [plc.servicing.clock_ns for plc in plcs] == [date_ns, 5, date_ns + 8 * MS]


class Collector:
    """Stands in for the module `gc`, of which the loop is told that so many objects are frozen."""

    def __init__(self, frozen: int) -> None:
        self.frozen, self.calls = frozen, list[str]()

    def get_freeze_count(self) -> int:
        return self.frozen

    def freeze(self) -> None:
        self.calls.append("freeze")

    def unfreeze(self) -> None:
        self.calls.append("unfreeze")


def freezes_up_to_scans(clock: Clock, monkeypatch: pytest.MonkeyPatch, collector: Collector) -> list[int]:
    """How often what is there was kept from the garbage collector up to each scan of eight PLCs, 40 of each."""
    monkeypatch.setattr(loop, "gc", collector)
    plcs, network, calls = [Plc(counter_image(), 100 * MS) for _ in range(8)], RealNetwork(clock), list[int]()
    for plc in plcs:
        plc.attach(Idle(), network)

    def between() -> bool:
        calls.append(len(collector.calls))
        return False

    run_all([Running(plc, for_ns=4_000 * MS, phase_ns=number * 10 * MS) for number, plc in enumerate(plcs)], until=between)
    assert len(calls) == 8 * 40
    return calls


def test_the_garbage_collector_leaves_alone_what_plcs_make_when_they_are_switched_on(
        clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    calls = freezes_up_to_scans(clock, monkeypatch, collector := Collector(0))
    assert calls[:80] == list(range(2, 82)), "behind each of the first ten scans of each PLC"
    assert calls[88:] == [calls[88]] * 232, "but what is made later may become garbage"
    assert collector.calls == ["freeze"] * calls[-1] + ["unfreeze"]


def test_what_the_host_keeps_from_the_garbage_collector_stays_as_it_is(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    freezes_up_to_scans(clock, monkeypatch, collector := Collector(7))
    assert collector.calls == []


def test_news_wake_only_whose_they_are(clock: Clock) -> None:
    scans: list[tuple[str, int]] = []
    network, runs = RealNetwork(clock, 3, 4), []
    for name in ("with", "without", "cyclic"):
        plc = Plc(counter_image())
        unit = Idle()
        plc.attach(unit, network)
        plc.watchers.append(lambda plc, name=name: scans.append((name, plc.now_ns // MS)))  # type: ignore[misc]
        runs.append(Running(plc, scans=3, pace="cyclic" if name == "cyclic" else "event"))
    run_all(runs)
    assert scans[3:5] == [("with", 3), ("with", 4)]
    for other in ("without", "cyclic"):
        assert [at_ms for name, at_ms in scans if name == other] == [0, 10, 20]


def test_who_is_woken_again_and_again_stays_due_a_period_later(clock: Clock) -> None:
    scans: dict[str, list[int]] = {"with": [], "without": []}
    network, runs = RealNetwork(clock, 3, 4, 7, 22), []
    for name in scans:
        plc = Plc(counter_image())
        plc.attach(Idle(), network)
        plc.watchers.append(lambda plc, name=name: scans[name].append(plc.now_ns // MS))  # type: ignore[misc]
        runs.append(Running(plc, for_ns=50 * MS, pace="event"))
    run_all(runs)
    assert scans == {"with": [0, 3, 4, 7, 17, 22, 32, 42], "without": [0, 10, 20, 30, 40]}


def test_waking_does_not_fill_the_queue(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    pushed: list[int] = []
    push = heapq.heappush
    monkeypatch.setattr(heapq, "heappush", lambda heap, item: (pushed.append(item), push(heap, item)))
    network, runs = RealNetwork(clock, *range(1, 300)), []
    for _ in range(2):
        plc = Plc(counter_image(), 10_000 * MS)
        plc.attach(Idle(), network)
        runs.append(Running(plc, for_ns=10_200 * MS, pace="event"))
    run_all(runs)
    assert [run.plc.scans for run in runs] == [201, 2]
    assert len(pushed) < 10


class Unread(RealNetwork):
    """A network that always has something, and only for its first unit."""

    def wait(self, timeout_s: float) -> bool:
        self.waits_ms.append(round(timeout_s * 1e3))
        self._happened = True
        return True


def test_what_waits_for_a_cyclic_plc_keeps_nobody_busy(clock: Clock) -> None:
    network, runs = Unread(clock), []
    for pace in ("cyclic", "event"):
        plc = Plc(counter_image())
        plc.attach(Idle(), network)
        runs.append(Running(plc, scans=3, pace=pace))
    run_all(runs)
    assert [run.plc.scans for run in runs] == [3, 3]
    assert 15 < len(network.waits_ms) < 25  # about each millisecond
