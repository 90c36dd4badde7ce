"""The state of one debug session: what the client can, what is debugged, what references of the client mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from fbvm.dap.sources import Sources
from fbvm.dap.target import Target
from fbvm.record.trace.events import Frame
from fbvm.step.commands import Commands
from fbvm.step.debugger import Debugger
from fbvm.step.past_session import PastSession
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport
from fbvm.watch.paths import Place, Span
from fbvm.watch.scopes import Scope

Arguments = Mapping[str, Any]
Body = dict[str, Any]


class Refusal(Exception):
    """A request cannot be done; the message says why, to a person."""


@dataclass(frozen=True)
class StackFrame:
    """A frame of the stack: the PLC, the body in execution, and the site at which it is, None for the bottom of the stack."""

    plc: str
    frame: Frame | None
    site: int | None


Children = Callable[[int, int | None], list[Body]]
"""Rows of variables: from a number on, so many at most (None for all)."""


@dataclass
class Container:
    """What has variables: `children` are rows, `named` finds the place of one by its name."""

    children: Children
    named: Callable[[str], Place | Span]


@dataclass
class DebugSession:
    """One debug session.  `send_event` sends an event."""

    send_event: Callable[[str, Body], None]
    client: Body = field(default_factory=dict)
    """What the client said of itself in `initialize`."""
    target: Target | None = None
    debugger: Debugger | None = None
    sources: Sources = field(default_factory=lambda: Sources({}, {}, {}))
    hexadecimal: bool = False
    moves: int = 0
    """How often the position has changed."""
    moved_by_command: bool = False
    """True after a typed command that has changed the position."""
    _references: dict[int, object] = field(default_factory=dict)
    _next_reference: int = 1

    @property
    def running(self) -> Debugger:
        """The debugger.  Raises Refusal if nothing is debugged."""
        if self.debugger is None:
            raise Refusal("nothing is debugged: launch or attach comes first")
        return self.debugger

    def plc(self, name: str | None = None) -> Session | PastSession:
        """The session of a PLC, of the one that is stepped through without a name."""
        debugger = self.running
        return debugger.plcs[name or debugger.focus].session

    def report(self, name: str | None = None) -> StopReport:
        """The texts about the position of a PLC."""
        assert self.target is not None
        return StopReport(self.plc(name), self.target.texts)

    def commands(self, name: str | None = None) -> Commands:
        """The language of stepping for a PLC."""
        target = self.target
        assert target is not None
        return Commands(self.plc(name), self.report(name), lambda: list(target.packets()))

    # --- references, which live until the position changes

    def refer(self, thing: object) -> int:
        """A number for something, for the client."""
        number, self._next_reference = self._next_reference, self._next_reference + 1
        self._references[number] = thing
        return number

    def referred(self, number: object, kind: type) -> Any:
        """What a number means.  Raises Refusal for one of an earlier stop."""
        found = self._references.get(number) if isinstance(number, int) else None
        if not isinstance(found, kind):
            raise Refusal(f"reference {number} is not known; references end when the position changes")
        return found

    def forget_references(self) -> None:
        """Called when the position changes."""
        self._references.clear()
        self.moves += 1

    # --- names

    def scope(self, frame: StackFrame | None) -> Scope:
        """The names as they are written inside a frame."""
        session = self.plc(frame.plc if frame else None)
        newest = session.statement.frame if session.statement else None
        inner = newest if frame is None else frame.frame
        return session.scope(inner)

    def frame_of(self, arguments: Arguments) -> StackFrame | None:
        """The frame that a request names, None if it names none."""
        number = arguments.get("frameId")
        found: StackFrame | None = None if number is None else self.referred(number, StackFrame)
        return found

    def supports(self, capability: str) -> bool:
        """True if the client declared something in `initialize`."""
        return bool(self.client.get(capability))
