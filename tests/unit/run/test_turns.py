"""A run under somebody's hands turn by turn, beside `turns.txt`.

A line of it is a turn: at which time of the host it begins and how long it waits, which PLC executes a scan for which time of
its own, how long who looks on may tell; all in milliseconds.  A scan takes one.  `FBVM_REWRITE=1 pytest` of this file writes it
anew."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from images import counter_image
from test_run_loop import Idle

from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.run import interactive
from fbvm.run.interactive import Control, run_interactive
from fbvm.run.running import Running

MS = 1_000_000
SCAN_NS = MS
"""How long each scan takes on the host."""


class Desk:
    """Who looks on, with a clock of its own: notes each turn as a line, and acts at turns."""

    def __init__(self, plcs: list[Plc], control: Control, acts: dict[int, Callable[[Control], None]], turns: int) -> None:
        self.now_ns = 0
        self.lines: list[list[str]] = []
        self._plcs, self._control, self._acts, self._turns = plcs, control, acts, turns
        self.driven: list[bool] = []
        for number, plc in enumerate(plcs):
            plc.watchers.append(lambda plc, number=number: self._scanned(number, plc))  # type: ignore[misc]

    def monotonic_ns(self) -> int:
        return self.now_ns

    def _scanned(self, number: int, plc: Plc) -> None:
        self.lines[-1].append(f"{'abc'[number]}{plc.now_ns // MS}")
        self.now_ns += SCAN_NS

    def serve(self, wait_ns: int) -> bool:
        self.lines.append([f"{self.now_ns / MS:g}: {wait_ns / MS:g},"])
        self.now_ns += wait_ns
        if act := self._acts.get(len(self.lines)):
            act(self._control)
        if len(self.lines) == self._turns:
            self._control.end()
        return False

    def before_scan(self, number: int, now_ns: int) -> None:
        assert now_ns == self.now_ns

    def after_scan(self, number: int, now_ns: int) -> None:
        assert now_ns == self.now_ns
        if not self.lines[-1][-1].startswith("abc"[number]):
            self.lines[-1].append(f"{'abc'[number]}..{self._plcs[number].now_ns // MS}")

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        assert now_ns == self.now_ns
        while not is_late():
            self.now_ns += MS // 20
        self.lines[-1].append(f"+{(self.now_ns - now_ns) / MS:g}")


def turns(cycles_ms: list[int], control: Control, acts: dict[int, Callable[[Control], None]], *, count: int = 6,
          real: bool = False, scans: int = 1 << 40) -> str:  # fmt: skip
    """A run, a line for each turn."""
    plcs = [Plc(counter_image(), cycle_ms * MS) for cycle_ms in cycles_ms]
    network = LoopNetwork()
    network.virtual_time = not real
    network.serve = lambda now_ns: ()  # type: ignore[attr-defined]
    plcs[0].attach(Idle(), network)
    desk = Desk(plcs, control, acts, count)
    runs = [Running(plc, scans=scans) for plc in plcs]
    run_interactive(runs, control, desk, monotonic_ns=desk.monotonic_ns)
    assert {run.reason for run in runs} <= {"stopped", "scans"}
    return "".join(f"{' '.join(line)}\n" for line in desk.lines)


def cases() -> Iterator[tuple[str, str]]:
    """What each case is, and how it goes."""
    for speed in (1.0, 0.5, 4.0, 0.0):
        yield f"virtual time, speed {speed:g}", turns([10], Control(speed=speed), {})
    yield "a pause from turn 2 to 4", turns([10], Control(), {2: Control.pause, 4: Control.go_on})
    yield "paused at 2, steps at 3 and 5", turns(
        [10], Control(), {2: Control.pause, 3: Control.step, 5: lambda control: control.step(2)}, count=7)
    yield "as fast as it goes from turn 3 on", turns(
        [10], Control(), {3: lambda control: setattr(control, "speed", 0.0)}, count=4)
    yield "ended at turn 3", turns([10], Control(), {3: Control.end})
    yield "three PLCs", turns([10, 30, 10], Control(), {})
    yield "two PLCs as fast as they go", turns([10, 25], Control(speed=0.0), {}, count=2)
    yield "four steps of two PLCs", turns([10, 25], Control(is_paused=True), {2: lambda control: control.step(4)}, count=4)
    yield "two scans of each of two PLCs", turns([10, 25], Control(), {}, scans=2)
    yield "real connections, speed 4, a pause from turn 3 to 5", turns(
        [10, 25], Control(speed=4.0), {3: Control.pause, 5: Control.go_on}, real=True, count=8)
    yield "real connections, as fast as they go", turns([10], Control(speed=0.0), {}, real=True)
    yield "real connections, three steps", turns(
        [10, 25], Control(is_paused=True), {2: lambda control: control.step(3)}, real=True, count=8)


def test_a_run_goes_turn_by_turn_as_it_is_kept() -> None:
    file = Path(__file__).with_name("turns.txt")
    kept = file.read_text(encoding="utf-8")
    came = "".join(f"# {name}\n{text}" for name, text in cases())
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == kept


def test_scans_of_real_time_have_a_watchdog_from_their_beginning_to_their_end(monkeypatch: pytest.MonkeyPatch) -> None:
    for real in (True, False):
        told: list[str] = []

        class Dog:
            def __init__(self, plc: Plc, told: list[str] = told) -> None:
                self._told = told

            def begin(self, now_ns: int) -> None:
                self._told.append(f"{now_ns / MS:g}")

            def end(self) -> None:
                self._told.append("end")

            def stop(self) -> None:
                self._told.append("stop")

        monkeypatch.setattr(interactive, "Watchdog", Dog)
        turns([10], Control(), {}, count=3, real=real)
        assert told == (["0", "end", "10", "end", "stop"] if real else [])
