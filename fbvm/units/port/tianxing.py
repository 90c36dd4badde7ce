"""The Ethernet port of a Baosight Tianxing controller, as its communication blocks meet it: a mailbox with a short head
and slots for connections.

Moves bytes and knows no protocol.  How many connections a controller has is from its manual, 7.15.4; the words are this
project's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fbvm.units.contract import AreaMemory
from fbvm.units.port.port import Port, mailbox
from fbvm.wire.link import Event, Request

AREA = "TXP"
HEAD_WORDS = 8
SLOTS = 32
READY, CONNECTIONS, OWN_IP = 0, 1, 2
MODELS = {"T3": 8, "T4": 32}
"""TCP connections of each controller."""
NUMBER = 1
NEVER_NS = 1 << 63


def number_of(errno_name: str) -> int:
    """The controller's blocks have no numbers for errors of connections: 1 for any."""
    return 1


class Tianxing:
    """The port of a controller of a model ("T3" or "T4").  Raises ValueError for another."""

    def __init__(self, address: str = "192.168.250.23", *, model: str = "T4") -> None:
        if model not in MODELS:
            raise ValueError(f"there is no model {model}; there are {' and '.join(MODELS)}")
        self.name = f"Tianxing {model}"
        self.address = address
        self.wake_ns = NEVER_NS
        self.changed_words = False
        self._made = {"address": address, "model": model}
        octets = [int(part) for part in address.split(".")]
        self._head = (1, MODELS[model], octets[0] << 8 | octets[1], octets[2] << 8 | octets[3], 0, 0, 0, 0)
        self._port = Port(NUMBER, HEAD_WORDS, SLOTS, number_of)
        self._seen = b""

    watched = None
    """Its mailbox is looked at in each refresh."""
    exchanged = None
    """It has no processor of its own."""

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which `Tianxing` makes the same port."""
        return dict(self._made)

    @property
    def settings(self) -> dict[str, Any]:
        """Nothing may be set while it runs."""
        return {}

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None:
        pass

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: connections broken by RST."""
        words = mailbox(memory, AREA)
        requests = self._port.reset(words)
        self._seen = b""
        self.wake_ns = 0 if words else NEVER_NS
        if words:
            self._show(words)
        return requests

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh.  A PLC whose program has no mailbox leaves the port idle."""
        words = mailbox(memory, AREA)
        if words is None:
            return []
        before = words.tobytes()
        self.wake_ns, self.changed_words = NEVER_NS, False
        if not events and before == self._seen:
            return []
        self._show(words)
        self._port.take(words, events)
        requests = self._port.exchange(words)
        self._seen = words.tobytes()
        self.changed_words = self._seen != before
        return requests

    def _show(self, words: memoryview) -> None:
        for number, word in enumerate(self._head):
            words[number] = word
