"""The page of a run: the server of its pages, its workbench, and what both do between scans (`run.interactive.Audience`)."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.live.session import UPDATE_NS, Session
from fbvm.live.sockets import LiveServer
from fbvm.live.workbench import Workbench


class LiveHost:
    """Serves the pages of a workbench at `bind` and `port`.  Raises OSError if that cannot be used.  `tick` is called every
    100 ms, between scans."""

    def __init__(self, workbench: Workbench, bind: str = "127.0.0.1", port: int = 0, token: str | None = None,
                 tick: Callable[[], None] = lambda: None) -> None:  # fmt: skip
        self.workbench, self._tick, self._ticked_ns = workbench, tick, 0
        self._plcs = list(workbench.plcs.values())
        self.server = LiveServer(lambda: Session(workbench), bind, port, token)

    @property
    def address(self) -> str:
        """The address to be opened in a browser of this computer, with its token."""
        return self.server.guard.address()

    def serve(self, wait_ns: int) -> bool:
        return self.server.serve(wait_ns)

    def before_scan(self, number: int, now_ns: int) -> None:
        self._plcs[number].before_scan()

    def after_scan(self, number: int, now_ns: int) -> None:
        self._plcs[number].after_scan()

    def update(self, now_ns: int) -> None:
        self.server.update(now_ns)
        if now_ns - self._ticked_ns >= UPDATE_NS:
            self._ticked_ns = now_ns
            self._tick()

    def close(self) -> None:
        """Ends all connections."""
        self.server.close()
