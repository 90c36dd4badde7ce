"""One socket service from the request switch to its response code, and the parameter area that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fbvm.units.etn21_map import CLOSE, FLAG_OF, Parameters, Switch

if TYPE_CHECKING:
    from fbvm.units.etn21_socket import Socket

NEVER_NS = 1 << 63


class Service:
    """A request that a switch has made; `code` stays None until it is decided how the service ends."""

    parameters: Parameters | None = None
    """None until the request is accepted."""

    socket: Socket | None = None
    """None if a check refused the request."""

    code: int | None = None
    earliest_cycle = 0
    earliest_ns = 0
    deadline_ns = NEVER_NS
    deadline_code = 0
    unanswered = 0
    """Parts of a send that the network has not answered yet."""

    count = 0
    """Bytes really sent or received, for +5."""

    data = b""
    interrupts: tuple[Service, ...] = ()
    """The services that this close ended; their results come first, a cycle apart."""

    concluded_cycle = NEVER_NS
    """Refresh that writes the response code; the switch goes OFF with it."""

    def __init__(self, switch: Switch, area: Area | None, accept_cycle: int) -> None:
        self.switch = switch
        self.area = area
        """None for the closes of a force-close, which have neither switch nor response code of their own."""
        self.accept_cycle = accept_cycle
        self.flag = FLAG_OF[switch]
        """Its bit in the socket's status word."""
        self.switch_bit = 1 << area.shift + switch if area else 0
        """Its switch in a mask of all switches."""
        self.results: dict[int, int] = {}
        """Further result words: offset in the parameter area -> value."""

    @property
    def rank(self) -> int:
        """Order in which results are written: refusals, services, closes."""
        if self.socket is None:
            return 0
        return 2 if self.switch is CLOSE else 1


@dataclass(slots=True, eq=False)
class Area:
    """Parameter area 1..8: what runs in it and to which socket it is bound."""

    shift: int
    """By how much its switches stand higher in a mask of all switches than those of the first area."""
    first: int
    """D address of its first word."""
    switches: tuple[int, int]
    """CIO address of the word with its switches, and the bit number of the first."""
    services: list[Service] = field(default_factory=list)
    bound: Socket | None = None
    """From a successful open until the close (W421 6-7-1 p113)."""

    result_cycle: int = -1
    """Refresh of the last response code: one word holds it, so results are a cycle apart (W343 6-2-7 p128)."""

