"""Notices: what a network of the host has to say to whoever looks after it, which no program is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from fbvm.wire.link import Peer


class NoticeKind(Enum):
    """The kinds of notices."""

    LISTENING = "listening"
    """A unit listens; `real` is where on the host."""
    NOT_MAPPED = "not mapped"
    """A unit wants to listen on a port below 1024 that is mapped nowhere; it is not tried."""
    UNUSABLE = "unusable"
    """The host does not let a unit listen at `real`."""
    UNREACHED = "unreached"
    """Nobody has answered a unit at `real`."""
    FULL = "full"
    """A caller waits at `real` for one of the unit's sockets, which are all in use."""
    TURNED_AWAY = "turned away"
    """A caller, `real`, was reset since no socket of the unit waited for it."""


@dataclass(frozen=True)
class Notice:
    """`endpoint` is that of the program, `real` that of the host; `error` says why, in words."""

    kind: NoticeKind
    endpoint: Peer
    real: Peer
    error: str = ""


Noticed = Callable[[Notice], None]
EACH_TIME = {NoticeKind.TURNED_AWAY, NoticeKind.FULL}
"""Kinds of which every notice is told; of others only the first for each endpoint."""


class Notices:
    """Passes notices on to `tell`, if that is set; each once, but for those that are told each time."""

    def __init__(self) -> None:
        self.tell: Noticed | None = None
        self._told: set[tuple[NoticeKind, Peer]] = set()

    def note(self, kind: NoticeKind, endpoint: Peer, real: Peer, error: str = "") -> None:
        """Tells a notice."""
        if (kind, endpoint) not in self._told or kind in EACH_TIME:
            self._told.add((kind, endpoint))
            if self.tell:
                self.tell(Notice(kind, endpoint, real, error))
