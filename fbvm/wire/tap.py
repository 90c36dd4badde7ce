"""What a network tells whoever listens in: every event on a connection, as the PLC program sees its endpoints.

Both networks use these words, so a capture or a trace does not care whether bytes stayed in memory or left the host.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from fbvm.wire.link import Peer


class TapKind(Enum):
    """The kinds of events."""

    SYN = "syn"
    """Somebody asks for a connection; nothing is open yet."""
    OPEN = "open"
    """The connection that was asked for is open."""
    DATA = "data"
    FIN = "fin"
    RST = "rst"
    """The connection, or the wish for one, is refused or torn down."""
    UDP = "udp"
    """One datagram."""


DATA = TapKind.DATA


@dataclass(frozen=True, slots=True)
class TapEvent:
    """One event at one unit.  `local` is the unit's endpoint, `remote` its peer's, with the program's addresses.

    `out` says who did it: the unit (for SYN and OPEN: the unit opens actively) or its peer.  `mirrored`: the peer is a
    unit of the same network, which tells the same from its side; who wants each frame once takes those that are `out`
    or not `mirrored`."""

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
