"""The page of a run: the server of its pages, its workbench, and what both do between scans (`run.interactive.Audience`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fbvm.live.session import Session
from fbvm.live.sockets import LiveServer
from fbvm.live.stops import forget_statement
from fbvm.live.updates import UPDATE_NS
from fbvm.live.workbench import Workbench

LOOK_TICKS = 3
"""The files of a run are looked at every 300 ms."""


class LiveHost:
    """Serves the pages of a workbench at `bind` and `port`.  Raises OSError if that cannot be used.  `tick` is called every
    100 ms, between scans; pages of `frames` may hold the page in a frame."""

    def __init__(self, workbench: Workbench, bind: str = "127.0.0.1", port: int = 0, token: str | None = None,
                 tick: Callable[[], None] = lambda: None, frames: Sequence[str] = ()) -> None:  # fmt: skip
        self.workbench, self._tick, self._ticked_ns, self._ticks = workbench, tick, 0, 0
        self._plcs = list(workbench.plcs.values())
        self.server = LiveServer(lambda: Session(self.workbench), bind, port, token, frames)

    def show(self, workbench: Workbench) -> None:
        """Shows other PLCs on the pages that are open."""
        self.workbench, self._plcs = workbench, list(workbench.plcs.values())
        self.server.renew_sessions()

    @property
    def address(self) -> str:
        """The address to be opened in a browser of this computer, with its token."""
        return self.server.guard.address()

    def serve(self, wait_ns: int) -> bool:
        if self.workbench.changes:
            self.workbench.changes.step()
        return self.server.serve(0 if self.server.is_behind else wait_ns)

    def before_scan(self, number: int, now_ns: int) -> None:
        self._plcs[number].before_scan()

    def after_scan(self, number: int, now_ns: int) -> None:
        live = self._plcs[number]
        live.after_scan()
        if live.plc.halted:
            forget_statement(live)

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        self.workbench.let_go()
        self.server.update(now_ns, is_late)
        if now_ns - self._ticked_ns >= UPDATE_NS:
            self._ticked_ns = now_ns
            self._tick()
            self._end_unseen_power()
            self._ticks += 1
            if self._ticks % LOOK_TICKS == 0:
                for looked_at in (self.workbench.changes, self.workbench.pictures, self.workbench.groups):
                    if looked_at:
                        looked_at.look()

    def _end_unseen_power(self) -> None:
        """Lets machine code note power only where a page shows rungs, and nobody else has the PLCs."""
        seen = {session.live for session in self.server.sessions if session.shows_inside and not self.workbench.held_by}
        for live in self._plcs:
            if live not in seen:
                live.end_power()

    def close(self) -> None:
        """Ends all connections."""
        self.server.close()
