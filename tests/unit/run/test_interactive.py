"""The loop of a run under somebody's hands, with a clock of the test's own: pause, steps, speed, traps."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from test_run_loop import Clock, RealNetwork, real_plc

from fbvm import Plc, compile_text
from fbvm.run import interactive
from fbvm.run.interactive import AS_FAST_AS_POSSIBLE, AUDIENCE_NS, MOST_WAIT_NS, SLICE_NS, Control, let_look_on, run_interactive
from fbvm.run.running import EVENT, Running

COUNTS = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM"


class Hands:
    """Lets the host's time pass in `serve`, and calls a function of the turn there."""

    def __init__(self, act: Callable[[int], None], turn_ns: int = 10_000_000) -> None:
        self.now_ns, self.turns, self._act, self._turn_ns = 0, 0, act, turn_ns
        self.scanned = self.begun = 0

    def monotonic_ns(self) -> int:
        return self.now_ns

    def serve(self, wait_ns: int) -> bool:
        self.now_ns += self._turn_ns
        self.turns += 1
        self._act(self.turns)
        return False

    def before_scan(self, number: int, now_ns: int) -> None:
        self.begun += 1
        assert self.begun == self.scanned + 1, "one scan after the other"

    def after_scan(self, number: int, now_ns: int) -> None:
        self.scanned += 1

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        """Nothing to do."""


def ran(act: Callable[[int, Control, Plc], None], control: Control | None = None, text: str = COUNTS) -> tuple[Plc, Hands]:
    """A PLC after 100 turns of 10 ms each, in each of which `act` is called."""
    image = compile_text(text).image
    assert image is not None
    plc, control = Plc(image), control or Control()

    def turn(number: int) -> None:
        act(number, control, plc)
        if number == 100:
            control.end()

    hands = Hands(turn)
    run_interactive([Running(plc, scans=1 << 62)], control, hands, monotonic_ns=hands.monotonic_ns)
    return plc, hands


def test_after_a_trap_a_start_lets_the_plc_run_again() -> None:
    def act(turn: int, control: Control, plc: Plc) -> None:
        if turn == 50:
            assert plc.trap is not None
            plc.write("Main.b", 1)
            plc.warm_start()
            plc.write("Main.b", 1)

    plc, _ = ran(act, text="PROGRAM Main VAR a, b : INT; END_VAR a := 1 / b; END_PROGRAM")
    assert plc.trap is None and 40 <= plc.scans <= 60


def test_the_run_says_that_it_was_stopped() -> None:
    image = compile_text(COUNTS).image
    assert image is not None
    run, control = Running(Plc(image), scans=1 << 62), Control()
    hands = Hands(lambda turn: control.end())
    run_interactive([run], control, hands, monotonic_ns=hands.monotonic_ns)
    assert run.reason == "stopped"


def plcs(*cycles_ms: int) -> list[Plc]:
    image = compile_text(COUNTS).image
    assert image is not None
    return [Plc(image, cycle_ms * 1_000_000) for cycle_ms in cycles_ms]


def test_as_fast_as_possible_many_scans_follow_one_another_and_each_plc_has_its_end() -> None:
    fast, slow = plcs(10, 30)
    runs, control, order = [Running(fast, scans=300), Running(slow, scans=50)], Control(speed=AS_FAST_AS_POSSIBLE), []
    fast.watchers.append(lambda plc: order.append("fast"))
    slow.watchers.append(lambda plc: order.append("slow"))
    hands = Hands(lambda turn: control.end() if turn == 3 else None)
    run_interactive(runs, control, hands, monotonic_ns=hands.monotonic_ns)
    assert [(run.plc.scans, run.reason) for run in runs] == [(300, "scans"), (50, "scans")]
    assert order[:8] == ["fast", "slow", "fast", "fast", "fast", "slow", "fast", "fast"]
    assert hands.scanned == hands.begun == 350


def test_a_slice_ends_so_that_who_looks_on_is_heard() -> None:
    [plc] = plcs(10)
    control, hands = Control(speed=AS_FAST_AS_POSSIBLE), Hands(lambda turn: control.end() if turn == 3 else None)

    def scanned(plc: Plc) -> None:
        hands.now_ns += SLICE_NS // 4

    plc.watchers.append(scanned)
    run_interactive([Running(plc, scans=1 << 62)], control, hands, monotonic_ns=hands.monotonic_ns)
    assert plc.scans == 2 * 4, "an end that comes in `serve` lets no further scan begin"


def test_a_breakpoint_pauses_the_run_and_its_scan_goes_on_with_the_next_step() -> None:
    seen: list[tuple[int, int, bool, bool]] = []

    def act(turn: int, control: Control, plc: Plc) -> None:
        if turn == 1:
            plc.breakpoints.condition("Main.n = 5")
        if turn == 50:
            seen.append((plc.scans, plc.read("Main.n"), plc.halted is not None, control.is_paused))
            control.step(1)
        if turn == 60:
            seen.append((plc.scans, plc.read("Main.n"), plc.halted is not None, control.is_paused))

    ran(act)
    assert seen == [(4, 5, True, True), (5, 5, False, True)]


def test_the_loop_is_left_for_somebody_else_and_goes_on() -> None:
    [plc] = plcs(10)
    run, control, hands = Running(plc, scans=1 << 62), Control(), Hands(lambda turn: control.end() if turn == 20 else None)
    run_interactive([run], control, hands, until=lambda: hands.turns == 10, monotonic_ns=hands.monotonic_ns)
    assert (hands.turns, run.reason, control.has_ended) == (10, "", False)
    scans = plc.scans
    run_interactive([run], control, hands, until=lambda: False, monotonic_ns=hands.monotonic_ns)
    assert run.reason == "stopped" and plc.scans > scans >= 9


def test_scans_that_somebody_else_has_executed_are_not_made_up_for() -> None:
    [plc] = plcs(10)
    run, control, hands = Running(plc, scans=1 << 62), Control(), Hands(lambda turn: control.end() if turn == 20 else None)
    run_interactive([run], control, hands, until=lambda: hands.turns == 5, monotonic_ns=hands.monotonic_ns)
    plc.run(scans=30)
    run.resume()
    times: list[int] = [plc.now_ns]
    plc.watchers.append(lambda plc: times.append(plc.now_ns))
    run_interactive([run], control, hands, monotonic_ns=hands.monotonic_ns)
    assert len(times) > 10 and {later - earlier for earlier, later in pairwise(times)} == {10_000_000}


def test_how_a_run_goes_on() -> None:
    control = Control()
    control.step()
    assert (control.is_paused, control.steps, control.stands) == (True, 1, False)
    control.step(3)
    assert control.steps == 4
    control.go_on()
    assert (control.is_paused, control.steps, control.stands) == (False, 0, False)
    control.pause()
    assert control.stands


def test_ctrl_c_ends_the_run() -> None:
    [plc] = plcs(10)
    run, control = Running(plc, scans=1 << 62), Control()

    def press(turn: int) -> None:
        if turn == 5:
            raise KeyboardInterrupt

    hands = Hands(press)
    run_interactive([run], control, hands, monotonic_ns=hands.monotonic_ns)
    assert control.has_ended and run.reason == "stopped"


def test_a_busy_host_does_not_make_up_for_a_second() -> None:
    [late] = plcs(10)
    control, hands = Control(), Hands(lambda turn: control.end() if turn == 3 else None, turn_ns=10_000_000_000)
    run_interactive([Running(late, scans=1 << 62)], control, hands, monotonic_ns=hands.monotonic_ns)
    assert late.scans <= 2 * (10 * SLICE_NS // 10_000_000 + 1)


SCAN_NS = 50_000


class Told(Hands):
    """Notes how long `serve` may wait, and how long `update` may take."""

    def __init__(self, act: Callable[[int], None], turn_ns: int = 0) -> None:
        super().__init__(act, turn_ns)
        self.waits_ns: list[int] = []
        self.lefts_ns: list[int] = []

    def serve(self, wait_ns: int) -> bool:
        self.waits_ns.append(wait_ns)
        self.now_ns += wait_ns
        return super().serve(wait_ns)

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        begun_ns = self.now_ns
        while not is_late():
            self.now_ns += 10_000
        self.lefts_ns.append(self.now_ns - begun_ns)


def told(control: Control, cycle_ms: int) -> Told:
    [plc] = plcs(cycle_ms)
    hands = Told(lambda turn: control.end() if turn == 6 else None)

    def scanned(plc: Plc) -> None:
        hands.now_ns += SCAN_NS

    plc.watchers.append(scanned)
    run_interactive([Running(plc, scans=1 << 62)], control, hands, monotonic_ns=hands.monotonic_ns)
    return hands


def test_who_looks_on_waits_until_the_next_scan_and_20_ms_at_most() -> None:
    assert max(told(Control(), 10).waits_ns[1:]) == 10_000_000 - AUDIENCE_NS - SCAN_NS
    assert set(told(Control(), 1000).waits_ns[1:]) == {MOST_WAIT_NS}
    assert set(told(Control(is_paused=True), 10).waits_ns) == {MOST_WAIT_NS}
    assert max(told(Control(speed=2.0), 10).waits_ns[1:]) == 5_000_000 - AUDIENCE_NS - SCAN_NS
    assert set(told(Control(speed=AS_FAST_AS_POSSIBLE), 10).waits_ns) == {0}


def test_who_looks_on_is_told_for_half_a_millisecond_or_until_the_next_scan() -> None:
    assert set(told(Control(), 10).lefts_ns[1:-1]) == {AUDIENCE_NS}
    assert set(told(Control(is_paused=True), 10).lefts_ns) == {AUDIENCE_NS}
    assert set(told(Control(speed=AS_FAST_AS_POSSIBLE), 10).lefts_ns) == {0}
    assert set(told(Control(speed=100.0), 10).lefts_ns[1:-1]) == {100_000 - SCAN_NS}


def test_while_somebody_else_scans_an_audience_looks_on_for_a_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    hands = Told(lambda turn: None)
    monkeypatch.setattr(interactive.time, "monotonic_ns", hands.monotonic_ns)
    let_look_on(hands)
    assert (hands.waits_ns, hands.lefts_ns) == ([0], [AUDIENCE_NS])


def test_real_connections_pass_the_time_and_are_served(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    plc, network = real_plc(clock)
    served: list[int] = []
    monkeypatch.setattr(RealNetwork, "serve", lambda self, now_ns: served.append(now_ns) or [])
    control = Control(speed=10.0)
    driven: list[bool] = []

    def act(turn: int) -> None:
        driven.append(network.driven)
        if turn == 30:
            control.pause()
        if turn == 50:
            control.end()

    hands = Hands(act)
    run = Running(plc, scans=1 << 62, pace=EVENT)
    run_interactive([run], control, hands, monotonic_ns=hands.monotonic_ns)
    assert all(driven) and not network.driven and len(served) == 50
    assert 29 <= plc.scans <= 31, "the speed is that of the host, and nobody scans during a pause"
