"""A unit's place on the host's network: what of its connections waits to be fetched, and what it has been told."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fbvm.net.channels import Channel, ChannelLink
from fbvm.net.switchboard import Switchboard
from fbvm.wire.link import Event, Request


class HostLink(ChannelLink):
    """Looks only at connections for which the host has something."""

    def __init__(self, network: Switchboard, address: str) -> None:
        super().__init__(address)
        self._network = network
        self.waiting: dict[Channel, None] = {}
        """Those that may have something to fetch, in order."""

    @property
    def is_quiet(self) -> bool:
        """True if there is nothing to fetch, as far as is known to whoever asks the host."""
        return self.heard and (self._network.driven or not self.channels)

    def events(self, now_ns: int) -> Sequence[Event]:
        if not self._network.driven:
            self._network.serve(now_ns)
        if self.waiting:
            for there in list(self.waiting):
                there.fetch(now_ns)
        told = self.told
        if told:
            self.told = []
        self.heard = not self.waiting
        return told

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        super().submit(requests, now_ns)
        if self.told:
            self.heard = False
            self._network.told(self)
