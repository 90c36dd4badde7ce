"""The loop of a run under somebody's hands, with a clock of the test's own: pause, steps, speed, traps."""

from __future__ import annotations

from collections.abc import Callable

from fbvm import Plc, compile_text
from fbvm.run.interactive import Control, run_interactive
from fbvm.run.running import Running

COUNTS = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM"


class Hands:
    """Lets the host's time pass in `serve`, and calls a function of the turn there."""

    def __init__(self, act: Callable[[int], None], turn_ns: int = 10_000_000) -> None:
        self.now_ns, self.turns, self._act, self._turn_ns = 0, 0, act, turn_ns
        self.scanned = 0

    def monotonic_ns(self) -> int:
        return self.now_ns

    def serve(self, wait_ns: int) -> bool:
        self.now_ns += self._turn_ns
        self.turns += 1
        self._act(self.turns)
        return False

    def before_scan(self, number: int, now_ns: int) -> None:
        """Nothing to do."""

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


def nothing(turn: int, control: Control, plc: Plc) -> None:
    """Lets it run."""


def test_virtual_time_passes_as_the_clock_does() -> None:
    plc, _ = ran(nothing)
    assert 98 <= plc.scans <= 101


def test_ten_times_slower_scans_a_tenth_as_often() -> None:
    plc, _ = ran(nothing, Control(speed=0.1))
    assert 9 <= plc.scans <= 11


def test_ten_times_faster_scans_ten_times_as_often() -> None:
    plc, _ = ran(nothing, Control(speed=10.0))
    assert 980 <= plc.scans <= 1010


def test_a_pause_stops_the_time_of_the_plc_and_nothing_is_made_up_for() -> None:
    seen: list[int] = []

    def act(turn: int, control: Control, plc: Plc) -> None:
        if turn == 20:
            control.pause()
        if turn in (21, 79):
            seen.append(plc.scans)
        if turn == 80:
            control.go_on()

    plc, _ = ran(act)
    assert seen[0] == seen[1]
    assert 38 <= plc.scans <= 42


def test_a_step_executes_so_many_scans_and_pauses() -> None:
    def act(turn: int, control: Control, plc: Plc) -> None:
        if turn == 10:
            control.step(3)

    plc, _ = ran(act, Control(is_paused=True))
    assert (plc.scans, plc.read("Main.n")) == (3, 3)


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
