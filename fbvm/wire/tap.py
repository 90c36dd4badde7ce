"""The tap of a network: a function that receives every event on a connection, with the endpoints of the program.

Both networks report the same events, so captures and traces are the same for bytes in memory and on the host.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from fbvm.wire.link import Peer


class TapKind(Enum):
    """The kinds of events."""

    SYN = "syn"
    """A connection is requested and not open yet."""
    OPEN = "open"
    """The requested connection is open."""
    DATA = "data"
    FIN = "fin"
    RST = "rst"
    """A request is refused, or the connection is reset."""
    UDP = "udp"
    """One datagram."""


DATA = TapKind.DATA


@dataclass(frozen=True, slots=True)
class TapEvent:
    """An event at one unit.  `local` is the unit's endpoint, `remote` its peer's, with the program's addresses.

    `out` is True for an event by the unit (SYN and OPEN: the unit opens actively), False for one by its peer.
    `mirrored`: the peer is a unit of the same network, and the event is reported from the peer's side, too; events that
    are `out` or not `mirrored` contain each frame once."""

    kind: TapKind
    local: Peer
    remote: Peer
    out: bool
    data: bytes = b""
    mirrored: bool = False

    def __str__(self) -> str:
        text = f"{self.kind.value} {self.local} {'->' if self.out else '<-'} {self.remote}"
        return f"{text} {self.data.hex(' ').upper()}" if self.data else text


Tap = Callable[[int, str, TapEvent], None]
"""Called with (now_ns, address of the unit's link, event)."""
