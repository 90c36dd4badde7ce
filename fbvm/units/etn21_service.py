"""One socket service from the request switch to its response code, and the parameter area that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fbvm.units.etn21_map import CLOSE, FLAG_OF, Parameters, Switch

if TYPE_CHECKING:
    from fbvm.units.etn21_socket import Socket

NEVER_NS = 1 << 63


@dataclass(slots=True, eq=False)
class Service:
    """A request that a switch has made; `code` stays None until it is decided how the service ends."""

    switch: Switch
    area: Area | None
    """None for the closes of a force-close, which have neither switch nor response code of their own."""

    accept_cycle: int
    parameters: Parameters | None = None
    """None until the request is accepted."""

    socket: Socket | None = None
    """None if a check refused the request."""

    code: int | None = None
    earliest_cycle: int = 0
    earliest_ns: int = 0
    deadline_ns: int = NEVER_NS
    deadline_code: int = 0
    unanswered: int = 0
    """Parts of a send that the network has not answered yet."""

    count: int = 0
    """Bytes really sent or received, for +5."""

    data: bytes = b""
    results: dict[int, int] = field(default_factory=dict)
    """Further result words: offset in the parameter area -> value."""

    interrupts: tuple[Service, ...] = ()
    """The services that this close ended; their results come first, a cycle apart."""

    concluded_cycle: int = NEVER_NS
    """Refresh that writes the response code; the switch goes OFF with it."""

    flag: int = 0
    """Its bit in the socket's status word; follows from the switch."""

    def __post_init__(self) -> None:
        self.flag = FLAG_OF[self.switch]

    @property
    def rank(self) -> int:
        """Order in which results are written: refusals, services, closes."""
        if self.socket is None:
            return 0
        return 2 if self.switch is CLOSE else 1


@dataclass(slots=True, eq=False)
class Area:
    """Parameter area 1..8: what runs in it and to which socket it is bound."""

    number: int
    first: int
    """D address of its first word."""
    switches: tuple[int, int]
    """CIO address of the word with its switches, and the bit number of the first."""
    services: list[Service] = field(default_factory=list)
    bound: Socket | None = None
    """From a successful open until the close (W421 6-7-1 p113)."""

    result_cycle: int = -1
    """Refresh of the last response code: one word holds it, so results are a cycle apart (W343 6-2-7 p128)."""

    def owned(self) -> int:
        """The switches that belong to a request already seen, as a mask."""
        mask = 0
        for service in self.services:
            mask |= 1 << service.switch
        return mask
