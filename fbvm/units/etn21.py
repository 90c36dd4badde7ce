"""The Omron ETN21 Ethernet unit: socket services by request switches, as a CS/CJ program sees them in CIO and D words.

A state machine without I/O: memory words, network events and the time go in; memory words and network requests come
out.  FINS, mail, FTP and clock adjustment are not emulated; their words stay 0.  From W420, W421 and, for points that
these leave open, W343.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

from fbvm.units import etn21_map as at
from fbvm.units.etn21_dispatch import Choices, Dispatch, Fault
from fbvm.units.etn21_map import Layout
from fbvm.units.etn21_names import descriptions, meanings
from fbvm.units.etn21_service import NEVER_NS
from fbvm.units.etn21_timing import timing_of
from fbvm.units.etn21_words import Words
from fbvm.units.unit import AreaMemory
from fbvm.wire.link import Event, Request

__all__ = ["TIME_WAIT_NS", "Etn21", "Fault"]

TIME_WAIT_NS = 60_000_000_000  # W421 6-9-3 p156


class Etn21:
    """One CS1W-ETN21 or CJ1W-ETN21 with a unit number from 0 to 15.

    `timing` is "exact" (a switch is accepted by the next refresh and finished by the one after, all words together)
    or "real" (seeded delays and words out of step).  `time_wait_ns` is how long a fixed local TCP port is held after
    a close from this side.  `odd_filler` is the low byte stored beside an odd last byte (00 is assumed); None keeps
    what is there.  Raises ValueError for a wrong argument."""

    def __init__(
        self,
        unit_number: int = 0,
        address: str = "192.168.250.1",
        *,
        timing: str = "exact",
        seed: int = 0,
        time_wait_ns: int = TIME_WAIT_NS,
        odd_filler: int | None = 0x00,
        faults: Iterable[Fault] = (),
    ) -> None:
        self.layout = Layout.of(unit_number)
        self.name = f"ETN21 {unit_number}"
        self.address = address
        self.faults = list(faults)
        """Each is used up by the first request that it fits."""
        self._service_status, self._error_status = at.LINK_UP, 0
        choices = Choices(time_wait_ns, odd_filler)
        self._made = {"unit_number": unit_number, "address": address, "timing": timing, "seed": seed,
                      "time_wait_ns": time_wait_ns, "odd_filler": odd_filler}  # fmt: skip
        self._timing = timing_of(timing, seed)
        self._dispatch = Dispatch(self.layout, address, self._timing, choices, self.faults)
        self._starting: tuple[int, int] | None = None
        """Cycle and time at which a restart ends; None if none is going on."""
        self._words: Words | None = None
        self._seen = 0
        """The request switches, as they were when the last refresh ended."""
        self._mask = 1 << self.layout.bit
        """Its bit in words for all units."""
        self.wake_ns = NEVER_NS
        self.news = False

    @property
    def watched(self) -> tuple[tuple[str, int], ...]:
        """Force-close switch, unit status and request switches, restart bit."""
        n = self.layout.n
        return ("CIO", n), ("CIO", n + at.SERVICE_STATUS), ("CIO", n + at.SWITCHES), ("A", at.RESTART)

    @property
    def link_up(self) -> bool:
        """Whether n+17 says that the cable is plugged; what the network does is the network's affair."""
        return self._service_status != 0

    @link_up.setter
    def link_up(self, up: bool) -> None:
        self._service_status, self.wake_ns = at.LINK_UP if up else 0, 0

    @property
    def error_status(self) -> int:
        """What n+18 shows."""
        return self._error_status

    @error_status.setter
    def error_status(self, status: int) -> None:
        self._error_status, self.wake_ns = status, 0

    @cached_property
    def descriptions(self) -> dict[str, str]:
        """What the unit's bits and words are called, by address as charts write it (`CIO 1519.02`, `D30001`)."""
        return descriptions(self.layout)

    @cached_property
    def meanings(self) -> dict[str, dict[int, str]]:
        """What the values of its words mean, by address."""
        return meanings(self.layout)

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which `Etn21` makes the same unit, but for its faults: they are `settings`."""
        return dict(self._made)

    @property
    def settings(self) -> dict[str, Any]:
        """What may be set on the unit while it runs, as plain data: faults, link, error status."""
        faults = [[fault.code, fault.switch, fault.socket] for fault in self.faults]
        return {"faults": faults, "link_up": self.link_up, "error_status": self.error_status}

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None:
        self.link_up, self.error_status = bool(given["link_up"]), int(given["error_status"])
        self.faults[:] = [Fault(code, None if switch is None else at.Switch(switch), socket)
                          for code, switch, socket in given["faults"]]  # fmt: skip

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: the unit's own words and all switches 0, connections broken by RST."""
        words = self._words = Words(self.layout, memory)
        for word in (at.INITIALIZING, at.RESTART):
            words.a[word] &= ~self._mask
        self._starting = None
        return self._begin_anew(words)

    def _begin_anew(self, words: Words) -> list[Request]:
        self._dispatch.forget()
        self._seen = 0
        self.wake_ns, self.news = 0, False
        cio, d = words.cio, words.d
        n, m = self.layout.n, self.layout.m
        for word in range(n + 1, n + at.FINS_TCP_STATUS + 1):
            cio[word] = 0
        cio[n] &= ~at.FORCE_CLOSE
        for word in range(m + 1, m + at.MAIL_STATUS + 1):
            d[word] = 0
        cio[n + at.SERVICE_STATUS], cio[n + at.ERROR_STATUS] = self._service_status, self.error_status
        return self._dispatch.reset_sockets()

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: take the network's events and new switches, end what is ready, show what changed."""
        words = self._words
        if words is None or words.memory is not memory:
            words = self._words = Words(self.layout, memory)
        dispatch, status = self._dispatch, words.status
        dispatch.cycle += 1
        if self._starting or words.a[at.RESTART] & self._mask:
            return self._restart(words, events, now_ns)
        status[0], status[1] = self._service_status, self._error_status
        switches, force = words.switches[0], words.cio[self.layout.n] & at.FORCE_CLOSE
        if not events and switches == self._seen and now_ns < self.wake_ns and not force:
            self.news = False
            return []
        requests = dispatch.refresh(words, events, switches, force, now_ns)
        self.news = dispatch.changed
        self._seen = words.switches[0]
        self.wake_ns = dispatch.wake_ns(now_ns)
        return requests

    def _restart(self, words: Words, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh of a restart, from the restart bit ON to the initializing flag OFF: requests are not seen."""
        a, mask = words.a, self._mask
        requests: list[Request] = []
        if self._starting is None:
            requests = self._begin_anew(words)
            delay = self._timing.start_up()
            self._starting = self._dispatch.cycle + delay.refreshes, now_ns + delay.time_ns
            a[at.INITIALIZING] |= mask
        elif self._dispatch.cycle >= self._starting[0] and now_ns >= self._starting[1]:
            self._starting = None
            a[at.INITIALIZING] &= ~mask
            a[at.RESTART] &= ~mask
        for event in events:
            requests += self._dispatch.take(event)
        self.wake_ns = self._starting[1] if self._starting and self._dispatch.cycle >= self._starting[0] else 0
        return requests
