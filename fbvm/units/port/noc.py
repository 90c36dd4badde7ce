"""The Ethernet module of a Schneider PLC, as the MBP_MSTR library meets it: a mailbox with a head for the module and
slots for its connections.

Moves bytes, counts what passes, restarts when it is asked to.  It knows neither Modbus nor operations of MBP_MSTR;
HTTP and FTP are states of services that nobody serves.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from fbvm.units.contract import AreaMemory
from fbvm.units.port import noc_map as at
from fbvm.units.port.port import Port, mailbox
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Opened, PeerClosed, Received, Request, Send

NEVER_NS = 1 << 63
RESTART_NS = 5_000_000_000
"""How long a restart takes, unless somebody says another time: assumed."""


class Noc:
    """A module in `rack_slot` (0 to 16, or 254 for the port of the CPU itself).

    `module_type` is a number of `noc_map.MODULE_TYPES`; `http` and `ftp` say whether the services are configured.
    Raises ValueError for a wrong argument."""

    def __init__(
        self,
        rack_slot: int = 7,
        address: str = "192.168.250.22",
        *,
        mac: str = "00:00:54:00:12:34",
        module_type: int = 14,
        http: bool = True,
        ftp: bool = True,
        restart_ns: int = RESTART_NS,
    ) -> None:
        if module_type not in at.MODULE_TYPES:
            raise ValueError(f"there is no module of type {module_type}")
        if not re.fullmatch(r"[0-9A-Fa-f]{2}([:-][0-9A-Fa-f]{2}){5}", mac):
            raise ValueError(f"{mac!r} is not six bytes in hexadecimal, parted by colons")
        place = at.place_of(rack_slot)
        self._rack_slot = rack_slot
        self.name = f"NOC {rack_slot}"
        self.address = address
        self.link_up = True
        """Whether the board status says that the cable is plugged; what the network does is the network's affair."""
        self.configured = True
        """Whether the module has its configuration."""
        self._made = {"rack_slot": rack_slot, "address": address, "mac": mac, "module_type": module_type,
                      "http": http, "ftp": ftp, "restart_ns": restart_ns}  # fmt: skip
        self._head_at = place * at.HEAD_WORDS
        octets = [int(part) for part in address.split(".")]
        self._own_ip = (octets[0] << 8 | octets[1], octets[2] << 8 | octets[3])
        self._mac = [int(part, 16) for part in re.split("[:-]", mac)]
        self._services = (at.FTP if ftp else 0) | (at.HTTP if http else 0)
        self._board = at.FAST | at.DUPLEX | module_type << at.TYPE_SHIFT
        self._restart_ns = restart_ns
        self._ready_ns: int | None = None
        self._before = b""
        """The head as the last refresh left it."""
        self._seen: tuple[bytes, bool, bool] | None = None
        """Mailbox and settings as the last refresh left them."""
        self.wake_ns = NEVER_NS
        self.changed_words = False
        self._port = Port(place + 1, at.PLACES * at.HEAD_WORDS, at.SLOTS, at.number_of)

    watched = None
    """Its mailbox is looked at in each refresh."""
    exchanged = None
    """It has no processor of its own."""

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which `Noc` makes the same module."""
        return dict(self._made)

    @property
    def settings(self) -> dict[str, Any]:
        """What may be set on the module while it runs, as plain data."""
        return {"link_up": self.link_up, "configured": self.configured}

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None:
        self.link_up, self.configured = bool(given["link_up"]), bool(given["configured"])

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: counters 0, services as configured, connections broken by RST."""
        words = mailbox(memory, at.AREA)
        requests = self._port.reset(words)
        self._ready_ns, self._before, self._seen = None, b"", None
        self.wake_ns = 0 if words else NEVER_NS
        if words:
            head = self._head(words)
            head[:] = memoryview(bytes(2 * at.HEAD_WORDS)).cast("H")
            self._show(head)
        return requests

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: connections, counters, restart.  A PLC whose program has no mailbox leaves it idle."""
        words = mailbox(memory, at.AREA)
        if words is None:
            return []
        before = (words.tobytes(), self.link_up, self.configured)
        if not events and before == self._seen and (self._ready_ns is None or now_ns < self._ready_ns):
            self.wake_ns, self.changed_words = self._next_ns(), False
            return []
        head = self._head(words)
        if head[at.REQUEST] & at.RESTART:
            head[at.REQUEST] &= ~at.RESTART
            self._restart(head)
            self._ready_ns = now_ns + self._restart_ns
        elif self._ready_ns is not None and now_ns >= self._ready_ns:
            self._ready_ns = None
        self._show(head)
        self._port.take(words, events)
        ready = head[at.STATUS] == at.READY
        requests = self._port.exchange(words) if ready else self._port.reset(words)
        self._count(head, events, requests)
        self._before = head.tobytes()
        self._seen = (words.tobytes(), self.link_up, self.configured)
        self.wake_ns, self.changed_words = self._next_ns(), self._seen != before
        return requests

    def _next_ns(self) -> int:
        """When something happens by itself."""
        return NEVER_NS if self._ready_ns is None else self._ready_ns

    def _restart(self, head: memoryview) -> None:
        """Counters begin anew but for that of restarts (assumed), services are as configured."""
        restarts = _counter(head, at.DRIVER_RESTARTS)
        for place in at.COUNTERS:
            _set_counter(head, place, 0)
        _set_counter(head, at.DRIVER_RESTARTS, restarts + 1)
        head[at.SERVICES] = self._services

    def _head(self, words: memoryview) -> memoryview:
        return words[self._head_at : self._head_at + at.HEAD_WORDS]

    def _show(self, head: memoryview) -> None:
        """What the head says of the module.  A mode change clears the mailbox, but not what the module knows."""
        if head[at.STATUS] == at.ABSENT:
            self._begin(head)
        status = at.RESTARTING if self._ready_ns is not None else at.READY if self.configured else at.UNCONFIGURED
        head[at.STATUS] = status
        board = self._board | (at.LINK if self.link_up else 0)
        board |= (at.CONFIGURED_BIT if self.configured else 0) | (at.RUNNING if status == at.READY else 0)
        head[at.STATISTICS + at.BOARD] = board

    def _begin(self, head: memoryview) -> None:
        """Words that only a mode change or power on makes necessary."""
        if self._before:
            head[:] = memoryview(self._before).cast("H")
            return
        head[at.RACK_SLOT] = self._rack_slot
        head[at.CONFIGURED] = head[at.SERVICES] = self._services
        head[at.OWN_IP], head[at.OWN_IP + 1] = self._own_ip
        table = head[at.STATISTICS :]
        for number in range(3):
            table[at.MAC + number] = self._mac[2 * number] << 8 | self._mac[2 * number + 1]
        table[at.IP + 1], table[at.IP] = self._own_ip

    def _count(self, head: memoryview, events: Sequence[Event], requests: Sequence[Request]) -> None:
        """What came over the wire and what goes out, by the counters of the table."""
        if not events and not requests:
            return
        received = sum(isinstance(event, Opened | Received | PeerClosed) for event in events)
        sent = sum(isinstance(request, Connect | Send | Close) for request in requests)
        errors = [event.error for event in events if isinstance(event, Failed | Broken)]
        for place, more in (
            (at.RECEIVER_INTERRUPTS, received + sum(error in ("ECONNRESET", "ECONNREFUSED") for error in errors)),
            (at.TRANSMITTER_INTERRUPTS, sent),
            (at.TRANSMIT_TIMEOUTS, errors.count("ETIMEDOUT")),
            (at.TRANSMIT_BUFFER_ERRORS, errors.count("ENOBUFS")),
            (at.LOST_CARRIER, 0 if self.link_up else sent),
        ):
            if more:
                _set_counter(head, place, _counter(head, place) + more)



def _counter(head: memoryview, place: int) -> int:
    low, high = head[at.STATISTICS + place], head[at.STATISTICS + place + 1]
    return low | high << 16


def _set_counter(head: memoryview, place: int, value: int) -> None:
    head[at.STATISTICS + place] = value & 0xFFFF
    head[at.STATISTICS + place + 1] = value >> 16 & 0xFFFF
