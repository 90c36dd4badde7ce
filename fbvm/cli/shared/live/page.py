"""The page of a run: its options, its server, and the run under it, begun again after a change of the program."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from fbvm.base.files import resolved
from fbvm.cli.shared.debug.door import DebugPort
from fbvm.cli.shared.debug.worlds import DebugSources
from fbvm.cli.shared.doors import unusable
from fbvm.cli.shared.live.origins import Built, Origin, ProjectOrigin
from fbvm.cli.shared.options import address
from fbvm.cli.shared.run_recording import RunRecording, record_run
from fbvm.cli.shared.terminal import say
from fbvm.live.lesson import LiveLesson
from fbvm.machine.endings import end_instances
from fbvm.machine.retention import start_with_retained
from fbvm.record.recording.file_writer import Described
from fbvm.record.trace.writer import source_lines
from fbvm.run.interactive import TRAP, Control, let_look_on, run_interactive
from fbvm.run.running import Running
from fbvm.step.world import Debugged
from fbvm.watch.paths import UnknownPlace


@dataclass
class PageOptions:
    """How a page is served, and what it may do."""

    bind: str = "127.0.0.1"
    port: int = 0
    read_only: bool = False
    writable: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    """Whose pages may hold the page in a frame."""
    debug_port: int | None = None
    """Where debuggers may attach meanwhile."""


def serve_page(origin: Origin, control: Control, options: PageOptions, recording: dict[str, Any] | None = None,
               tick: Callable[[], None] = lambda: None, lesson: LiveLesson | None = None) -> Built:  # fmt: skip
    """Runs the PLCs of `origin` under a page until Ctrl-C or `control.end`; returns what ran last, closed.

    `recording` has the options of `record_run`; `tick` is called every 100 ms, between scans."""
    with ExitStack() as stack:
        bind = address(options.bind)
        chosen = {"journal": None, "trace": None, "selected": (), "verify": False} | (recording or {})
        recorded = stack.enter_context(record_run(chosen, {"verb": "live"}, in_memory=True))
        page = _Page(origin, control, options, recorded, lesson)
        try:
            page.open(bind, tick)
            stack.callback(page.close)
            if bind != "127.0.0.1":
                say(f"--bind {bind}: who reaches this address and has the token can write into the PLC; nothing is encrypted",
                    fg="yellow", err=True)  # fmt: skip
            say(page.host.address)
            port = page.debug_port(options.debug_port) if options.debug_port is not None else None
            if port:
                stack.callback(port.close)
            while True:
                run_interactive(page.built.runs, control, page.host, until=(lambda: port.is_called) if port else None)
                bench = page.host.workbench
                if port and port.is_called and not control.has_ended:
                    if page.let_debug(port):
                        return page.built
                    continue
                if bench.branch_at:
                    page.branch(*bench.branch_at)
                elif bench.wants_restart:
                    page.restart()
                else:
                    return page.built
        finally:
            page.built.close()


class _Page:
    """The page of a run, and what runs under it."""

    def __init__(self, origin: Origin, control: Control, options: PageOptions, recorded: RunRecording,
                 lesson: LiveLesson | None) -> None:  # fmt: skip
        self._lesson = lesson
        self._origin, self._control, self._options, self._recorded = origin, control, options, recorded
        self._segments = 1
        self._has_past = True
        self.built = origin.build()

    def open(self, bind: str, tick: Callable[[], None]) -> None:
        """Begins to serve the page."""
        from fbvm.live.host import LiveHost

        def both() -> None:
            self._recorded.tick()
            tick()

        try:
            self.host = LiveHost(self._workbench(), bind, self._options.port, tick=both, frames=self._options.frames)
        except OSError as error:
            unusable(OSError(f"{bind}:{self._options.port} cannot be used for the page: {error.strerror}"))

    def close(self) -> None:
        self.host.close()

    def debug_port(self, number: int) -> DebugPort:
        """Where debuggers attach to the PLCs of this page."""
        texts = {name: text for seen in self.built.plcs.values() for name, text in seen.texts.items()}
        return DebugPort(number, DebugSources({name: path for name in texts if (path := Path(name)).is_file()}, texts))

    def let_debug(self, port: DebugPort) -> bool:
        """Lets the debugger that waits have the PLCs while pages look on; True if the run is to end."""
        bench, runs = self.host.workbench, self.built.runs

        def debugged() -> list[Debugged]:
            return [Debugged(live.name, live.plc, run.writes, live.recorded)
                    for live, run in zip(bench.plcs.values(), runs, strict=True)]  # fmt: skip

        def look_on() -> bool:
            let_look_on(self.host)
            return False

        bench.held_by = "a debugger"
        for live in bench.plcs.values():
            live.end_power()
        try:
            if port.serve(debugged, look_on):
                return True
        except KeyboardInterrupt:
            return True
        bench.held_by = ""
        for run in runs:
            run.resume()
        return False

    def branch(self, plc: str, scans: int) -> None:
        """Begins another future behind so many scans of a PLC; the one before is kept under a name."""
        from fbvm.live.futures import Future, run_again

        old, before = self.host.workbench, self.built
        self._build_again(before)
        bench = self._workbench()
        told = f"future {len(old.futures) + 1}, up to scan {old.plcs[plc].plc.scans - 1}"
        bench.futures = [*old.futures, Future(told, old.plcs)]
        run_again(bench, self.built.runs, old.orders, plc, scans)
        bench.orders[:] = [order for order in old.orders if order.scans[plc] <= scans]
        self._control.has_ended = False
        self._control.pause()
        self.host.show(bench)

    def _build_again(self, before: Built) -> None:
        """Ends PLCs and makes new ones, of which the recording has a segment of their own."""
        for name in before.plcs:
            self._recording[self._segment(name)].close()
        before.close()
        self._segments += 1
        self.built = self._origin.build()

    def restart(self) -> None:
        """Begins the changed program, with what is retained; a new segment of the recording begins with it."""
        old, before = self.host.workbench, self.built
        self._build_again(before)
        ended = {name: end_instances(seen.plc) for name, seen in before.plcs.items()}
        kept = {name: start_with_retained(seen.plc, before.plcs[name].plc)
                for name, seen in self.built.plcs.items() if name in before.plcs}  # fmt: skip
        bench = self._workbench()
        bench.can_branch = False  # the past began with what the program before had left
        self._has_past = False
        bench.note_restart(old, kept, ended)
        self._control.has_ended = False
        self.host.show(bench)

    @property
    def _recording(self) -> Any:
        assert self._recorded.recording
        return self._recorded.recording

    def _segment(self, name: str) -> str:
        """The name of a PLC in the recording: of each program that it had its own."""
        return name if self._segments == 1 else f"{name}#{self._segments}"

    def _workbench(self) -> Any:
        from fbvm.live.changes import SourceChanges
        from fbvm.live.groups import WatchGroups
        from fbvm.live.pictures import Pictures
        from fbvm.live.plcs import LivePlc
        from fbvm.live.pytest_text import plant_text, pytest_text
        from fbvm.live.workbench import Workbench

        lives = []
        for (name, seen), run in zip(self.built.plcs.items(), self.built.runs, strict=True):
            told = Described(seen.text, source_lines(seen.plc.image, seen.texts))
            recorded = self._recording.add(self._segment(name), seen.plc, told)
            lives.append(LivePlc(name, seen.plc, recorded, seen.texts, partial(_has_ended, run), seen.watch))
        test = None
        if self.built.repeated:
            files, program = self.built.repeated
            test = partial(pytest_text, files=[resolved(Path(file)) for file in files], program=program)
        origin = self._origin
        if isinstance(origin, ProjectOrigin) and not any(live.is_real for live in lives):
            test = partial(plant_text, file=resolved(origin.file), plcs={live.name: live for live in lives})
        changes = SourceChanges(origin.files, origin.programs, origin.mistakes, origin.matters) if origin.files else None
        pictures = Pictures(origin.file, origin.pictures, {live.name: live for live in lives}) \
            if isinstance(origin, ProjectOrigin) else None
        try:
            bench = Workbench(lives, self._control, read_only=self._options.read_only, writable=self._options.writable or None,
                             test=test, changes=changes, pictures=pictures)  # fmt: skip
        except UnknownPlace as error:
            raise click.UsageError(f"--allow-write: {error}") from None
        bench.lesson = self._lesson
        if file := origin.groups_file:
            bench.groups = WatchGroups(file)
        bench.can_branch = self._has_past and bool(origin.files) and not any(live.is_real for live in lives)
        return bench


def _has_ended(run: Running) -> bool:
    return run.reason not in ("", TRAP)
