"""What a unit shows to people who stand before it: what is set on it by hand, its lamps, and its sockets with their peers.

Read from the PLC's memory, so that a front can be seen of a past scan, too."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp on the front; `said` is what it means now."""

    name: str
    is_on: bool
    said: str


@dataclass(frozen=True, slots=True)
class Socket:
    """A socket of a unit, or a connection of it."""

    name: str
    state: str
    local: str = ""
    """The port on this side; "" if it is not known."""
    peer: str = ""
    """Address and port on the other side."""
    received: int = 0
    """Bytes that have come and wait for the program."""
    requested: int = 0
    """Bytes that the program wants to send, or of an ETN21 to send or receive, by its latest request."""
    result: str = ""
    """How its latest service has ended; "" for well, or not yet."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Front:
    """The front of a unit."""

    settings: tuple[tuple[str, str], ...] = ()
    """What is set by hand, or what the unit tells of itself: name and value."""
    lamps: tuple[Lamp, ...] = ()
    sockets: tuple[Socket, ...] = ()
    """Those that are in use."""
    restart: tuple[str, str] | None = None
    """The variable or address that restarts the unit, and the value that is written there."""
