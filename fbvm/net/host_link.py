"""A unit's place on the host's network: what of its connections waits to be fetched, and what it has been told."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.net.channels import Channel, ChannelLink
from fbvm.net.switchboard import Switchboard
from fbvm.wire.link import Event


class HostLink(ChannelLink):
    """Looks only at connections for which the host has something."""

    is_quiet = False
    """Everything has been fetched, and nothing can have happened since, as far as is known to whoever asks the host."""

    def __init__(self, network: Switchboard, address: str) -> None:
        super().__init__(address)
        self._network = network
        self.waiting: dict[Channel, None] = {}
        """Those that may have something to fetch, in order."""

    def events(self, now_ns: int) -> Sequence[Event]:
        if self.is_quiet:
            return ()
        driven = self._network.driven
        if not driven:
            self._network.serve(now_ns)
        if self.waiting:
            for there in list(self.waiting):
                there.fetch(now_ns)
        told, self.told = self.told, []
        self.is_quiet = not self.waiting and (driven or not self._network.watched)
        return told

    def stir(self) -> None:
        self.is_quiet = False
        self._network.unheard.add(self)
