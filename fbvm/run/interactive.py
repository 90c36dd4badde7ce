"""The loop that runs PLCs under somebody's hands: it pauses, goes scan by scan, and slower or faster than life.

In virtual time `Control.speed` says how fast the PLCs' time passes; with real connections it passes as the host's does, and
stands still during a pause.  Between scans the loop serves whoever looks on, for a short time and never while a scan runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

from fbvm.run.interrupts import Interrupts
from fbvm.run.running import CYCLIC, Running
from fbvm.run.watchdog import Watchdog
from fbvm.wire.link import RealNetwork

MOST_WAIT_NS = 20_000_000
"""After this time at most the loop looks at who looks on, also while nothing is to be scanned."""
SLICE_NS = 20_000_000
"""So long scans may follow one another in virtual time before the loop looks at who looks on."""
AUDIENCE_NS = 500_000
"""So long at most who looks on is told between two scans, and no longer than until the next one is due."""
AS_FAST_AS_POSSIBLE = 0.0
"""The speed of virtual time that never waits."""
TRAP, STOPPED = "trap", "stopped"
"""Reasons of an end: a trap, after which a PLC can be switched off and on, and `Control.end`."""


class Audience(Protocol):
    """Who looks on between scans.  Times are the host's, in nanoseconds."""

    def serve(self, wait_ns: int) -> bool:
        """Handles what has come; waits up to `wait_ns` for something to come.  Returns True if something came."""

    def before_scan(self, number: int, now_ns: int) -> None:
        """Called before a scan of the PLC with this number; what it does is not part of the scan."""

    def after_scan(self, number: int, now_ns: int) -> None:
        """Called after each scan, or after many in one go."""

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        """Called between scans, at least every 20 ms: the time to tell what has changed.  What is left when `is_late` returns
        True is for the next call; `serve` then does not wait."""


@dataclass
class Control:
    """How a run goes on.  It may be changed in `Audience.serve`; the loop looks at it before each scan."""

    is_paused: bool = False
    steps: int = 0
    """So many scans of all PLCs are executed although the run is paused."""
    speed: float = 1.0
    """How fast virtual time passes: 1 as the host's, 0.1 ten times slower, 0 as fast as it goes."""
    has_ended: bool = False

    @property
    def stands(self) -> bool:
        """True if no scan is to be executed now."""
        return self.is_paused and not self.steps

    def pause(self) -> None:
        self.is_paused, self.steps = True, 0

    def go_on(self) -> None:
        self.is_paused, self.steps = False, 0

    def step(self, scans: int = 1) -> None:
        """Executes so many scans, and pauses then."""
        self.is_paused = True
        self.steps += scans

    def end(self) -> None:
        self.has_ended = True


def run_interactive(runs: Sequence[Running], control: Control, audience: Audience, *, until: Callable[[], bool] | None = None,
                    monotonic_ns: Callable[[], int] = time.monotonic_ns) -> None:  # fmt: skip
    """Runs PLCs until each has its `reason`: its own end, "stopped" after `control.end` or Ctrl-C.

    A PLC with a trap ends for itself and can still be looked at: the loop goes on until `control.end`.  One that meets a
    breakpoint pauses the run, and its scan goes on with the next one that is executed.  When `until` returns True between two
    turns, the loop is left; called again after `Running.resume` of each PLC, it goes on."""
    interrupts = Interrupts()
    networks = {id(unit.network): unit.network for run in runs for unit in run.plc.units if not unit.network.virtual_time}
    loop = _Loop(runs, control, audience, [cast(RealNetwork, network) for network in networks.values()], monotonic_ns)
    try:
        with interrupts:
            while not control.has_ended:
                loop.turn(interrupts)
                interrupts.check()
                if until and until():
                    return
    except KeyboardInterrupt:
        control.end()
    finally:
        loop.stop()
    reason = STOPPED
    for run in runs:
        run.reason = run.reason or reason


def let_look_on(audience: Audience) -> None:
    """Lets an audience look on for a moment while somebody else executes scans."""
    audience.serve(0)
    end_ns = time.monotonic_ns() + AUDIENCE_NS
    audience.update(time.monotonic_ns(), lambda: time.monotonic_ns() >= end_ns)


class _Loop:
    """One turn after another: serve, wait for what is due, scan."""

    def __init__(self, runs: Sequence[Running], control: Control, audience: Audience, networks: Sequence[RealNetwork],
                 monotonic_ns: Callable[[], int]) -> None:  # fmt: skip
        self._runs, self._control, self._audience = runs, control, audience
        self._networks, self._monotonic_ns = networks, monotonic_ns
        self._now_ns = max((run.plc.elapsed_ns for run in runs), default=0)
        """The PLCs' time."""
        self._told_ns = monotonic_ns()
        """The host's time at which `_now_ns` was worked out."""
        self._watchdogs = [Watchdog(run.plc) for run in runs] if networks else []
        for network in networks:
            network.driven = True
        for run in runs:
            run.begin(run.plc.elapsed_ns)
            run.pace = CYCLIC

    def turn(self, interrupts: Interrupts) -> None:
        """Serves, waits until something is due, and scans what is."""
        control = self._control
        for run in self._runs:
            if run.reason == TRAP and run.plc.trap is None:  # somebody has switched it off and on
                run.reason, run.due_ns = "", max(run.due_ns, self._now_ns)
        due_ns = min((run.due_ns for run in self._runs if not run.reason), default=None)
        stands = due_ns is None or control.stands
        self._advance(stands, due_ns)
        wait_ns = MOST_WAIT_NS if stands or due_ns is None else min(MOST_WAIT_NS, self._until_ns(due_ns))
        interrupts.begin_wait()
        self._audience.serve(wait_ns)
        interrupts.waits = False
        self._advance(stands or control.stands, due_ns)
        for network in self._networks:
            network.serve(self._now_ns)
        if due_ns is not None and not control.stands and not control.has_ended:
            self._scan_due()
        began_ns = self._monotonic_ns()  # behind the scans, so that the next ones begin in time
        end_ns = began_ns + min(AUDIENCE_NS, self._left_ns())
        self._audience.update(began_ns, lambda: self._monotonic_ns() >= end_ns)

    def _advance(self, stands: bool, due_ns: int | None) -> None:
        """Lets the PLCs' time pass as far as the host's time says; it stands during a pause."""
        now_ns = self._monotonic_ns()
        passed_ns, self._told_ns = now_ns - self._told_ns, now_ns
        control = self._control
        if stands:
            return
        if self._networks:
            self._now_ns += passed_ns
        elif control.speed == AS_FAST_AS_POSSIBLE or control.steps:
            self._now_ns = max(self._now_ns, due_ns or 0)
        else:
            self._now_ns += round(passed_ns * control.speed)
            if due_ns is not None:  # a host that was busy does not make up for a second of virtual time
                self._now_ns = min(self._now_ns, due_ns + 10 * SLICE_NS)

    def _left_ns(self) -> int:
        """How long the host has time until the next scan is due."""
        due_ns = min((run.due_ns for run in self._runs if not run.reason), default=None)
        if due_ns is None or self._control.stands:
            return AUDIENCE_NS
        self._advance(False, due_ns)
        return self._until_ns(due_ns)

    def _until_ns(self, due_ns: int) -> int:
        """How long the host has to wait until the PLCs' time is `due_ns`."""
        left_ns = max(0, due_ns - self._now_ns)
        if self._networks:
            return left_ns
        speed = self._control.speed
        return 0 if speed == AS_FAST_AS_POSSIBLE or self._control.steps else round(left_ns / speed)

    def _scan_due(self) -> None:
        """Scans what is due, in the order of time; in virtual time many scans may follow one another."""
        control, until_ns = self._control, self._monotonic_ns() + SLICE_NS
        while True:
            due_ns = min((run.due_ns for run in self._runs if not run.reason), default=None)
            fast = not self._networks and control.speed == AS_FAST_AS_POSSIBLE
            if due_ns is None or due_ns > self._now_ns and not fast and not control.steps:
                return
            self._now_ns = max(self._now_ns, due_ns)
            for number, run in enumerate(self._runs):
                if run.due_ns <= self._now_ns and not run.reason:
                    self._scan(number, run, self._now_ns if self._networks else due_ns)
            if control.steps:
                control.steps -= 1
            if control.is_paused and not control.steps:
                return
            if self._networks or control.has_ended or self._monotonic_ns() >= until_ns:
                return

    def _scan(self, number: int, run: Running, now_ns: int) -> None:
        plc, began_ns = run.plc, self._monotonic_ns()
        self._audience.before_scan(number, began_ns)
        scan, began_ns = plc.scans, self._monotonic_ns()
        if self._watchdogs:
            self._watchdogs[number].begin(began_ns)
        run.scan(now_ns)
        if self._watchdogs:
            self._watchdogs[number].end()
        if plc.halted:  # it goes on with the next scan that is due
            run.reason = ""
            self._control.pause()
        ended_ns = self._monotonic_ns()
        if scans := plc.scans - scan:
            plc.scan_times.note(scan, (ended_ns - began_ns) // scans, scans)
        self._audience.after_scan(number, ended_ns)

    def stop(self) -> None:
        for watchdog in self._watchdogs:
            watchdog.stop()
        for network in self._networks:
            network.driven = False
