"""A unit's link on the host's network: which of its channels have data to fetch, and the events that the unit has not fetched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from fbvm.net.channels import Channel, ChannelLink
from fbvm.wire.link import Event


class Host(Protocol):
    """What a link needs of its network (`Switchboard` has it)."""

    links_pending: set[HostLink]
    """Links with events that `wait` has to return for."""

    @property
    def is_idle(self) -> bool:
        """True if no socket is registered with the selector, and no connection is under faults."""

    def serve(self, now_ns: int) -> Sequence[HostLink]:
        """Handle every socket that is ready; returns the links of these sockets."""


class HostLink(ChannelLink):
    """A link that reads a socket only after the selector has reported it ready."""

    is_quiet = False
    """True if all events are fetched and the selector has reported nothing since."""
    driven = False
    """True if somebody calls `serve` of the network for all links at once."""

    def __init__(self, network: Host, address: str) -> None:
        super().__init__(address)
        self._network = network
        self.refreshes = 0
        """The I/O refreshes of the unit so far."""
        self.waiting: dict[Channel, None] = {}
        """Channels whose sockets may have data, in the order in which they became ready."""

    def events(self, now_ns: int) -> Sequence[Event]:
        if self.is_quiet:
            self.refreshes += 1
            return ()
        if not self.driven:
            self._network.serve(now_ns)
        self.refreshes += 1
        if self.waiting:
            self.fetch(now_ns)
        events, self.pending = self.pending, []
        self.is_quiet = not self.waiting and (self.driven or self._network.is_idle)
        return events

    def fetch(self, now_ns: int) -> None:
        """Has all channels that wait fetch their data.  One that has to be asked in the next refresh, too, waits again then."""
        waiting, self.waiting = self.waiting, {}
        for there in waiting:
            there.fetch(now_ns)

    def pass_by(self, refreshes: int) -> None:
        self.refreshes += refreshes

    def mark_pending(self) -> None:
        self.is_quiet = False
        self._network.links_pending.add(self)
