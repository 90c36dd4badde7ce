"""The Omron ETN21 Ethernet unit: socket services by request switches, as a CS/CJ program sees them in CIO and D words.

What the unit does is a program, `fblib/omron/etn21`, which its own processor runs once in an I/O refresh.  This module
exchanges the words, as the backplane does, and carries what program and network tell each other.  No I/O in here.  FINS,
mail, FTP and clock adjustment are not emulated; their words stay 0.  From W420, W421 and, for points that these leave
open, W343.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

from fbvm.processor import OwnProcessor, processor
from fbvm.units import etn21_map as at
from fbvm.units.etn21_data import AREA_OF_CODE, lengths
from fbvm.units.etn21_faults import Fault, Faults
from fbvm.units.etn21_mail import RING_BYTES, Mail
from fbvm.units.etn21_map import Layout
from fbvm.units.etn21_names import descriptions, meanings
from fbvm.units.etn21_words import Words, numbers
from fbvm.units.unit import AreaMemory, Exchanged, Moves
from fbvm.wire.link import Event, Request

__all__ = ["TIME_WAIT_NS", "Etn21", "Fault"]

TIME_WAIT_NS = 60_000_000_000  # W421 6-9-3 p156
PROGRAM = "PROGRAM Unit ETN21_Refresh(); END_PROGRAM"
TIMINGS = ("exact", "real")
MOVES = Moves("ETN21_Moved", "ETN21_Moves", RING_BYTES, (
    "ETN21_Targets", {code - at.FIRST_AREA_CODE: area for code, (area, _) in AREA_OF_CODE.items()}))  # fmt: skip


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
        if timing not in TIMINGS:
            raise ValueError(f"timing {timing!r} is neither 'exact' nor 'real'")
        if odd_filler is not None and odd_filler not in range(256):
            raise ValueError(f"odd_filler {odd_filler} is no byte")
        parts = address.split(".")
        if len(parts) != 4 or not all(part.isdecimal() and int(part) < 256 for part in parts):
            raise ValueError(f'{address!r} is no IPv4 address; write "192.168.250.1"')
        self.layout = Layout.of(unit_number)
        self.name = f"ETN21 {unit_number}"
        self.address = address
        self._made = {"unit_number": unit_number, "address": address, "timing": timing, "seed": seed,
                      "time_wait_ns": time_wait_ns, "odd_filler": odd_filler}  # fmt: skip
        self._words: Words | None = None
        self._mask = 1 << self.layout.bit
        """Its bit in words for all units."""
        self.news = False
        self._connect(processor(PROGRAM, RING_BYTES * len(at.SOCKETS)), odd_filler)
        own = self._processor
        own.view("ETN21_Unit_Bit", "u16")[0] = self._mask
        ip = own.view("ETN21_IP", "u16")
        ip[0], ip[1] = at.words_of(address)
        own.view("ETN21_Real", "u8")[0] = timing == "real"
        own.view("ETN21_Random", "u64")[0] = _scattered(seed)
        own.view("ETN21_Time_Wait", "i64")[0] = time_wait_ns
        self._service_status[0] = at.LINK_UP
        self.faults += faults

    def _connect(self, own: OwnProcessor, odd_filler: int | None) -> None:
        """The unit's processor, and where its program keeps what is exchanged with it."""
        self._processor = own
        self._n, self._m = own.view("ETN21_N", "u16"), own.view("ETN21_M", "u16")
        self._initializing, self._restart = own.view("ETN21_Initializing", "u16"), own.view("ETN21_Restart", "u16")
        self._service_status = own.view("ETN21_Service_Status", "u16")
        self._error_status = own.view("ETN21_Error_Status", "u16")
        self._seen, self._reported = numbers(self._n)
        """As they were when the last refresh ended."""
        self._wake = own.view("ETN21_Wake", "i64")
        self._odd_filler = odd_filler
        self._mail = Mail(own, odd_filler)
        self.faults = Faults(own)
        """Each is used up by the first request that it fits."""

    def __deepcopy__(self, known: dict[int, Any]) -> Etn21:
        """Another unit in the same state, which shares the PLC's memory."""
        twin = Etn21(**self._made)  # type: ignore[arg-type]
        twin._connect(self._processor.copy(), twin._odd_filler)
        twin._mail.take_over(self._mail)
        twin._words, twin.news = self._words, self.news
        return twin

    @property
    def watched(self) -> tuple[tuple[str, int], ...]:
        """Force-close switch, unit status and request switches, restart bit."""
        n = self.layout.n
        return ("CIO", n), ("CIO", n + at.SERVICE_STATUS), ("CIO", n + at.SWITCHES), ("A", at.RESTART)

    @property
    def exchanged(self) -> Exchanged:
        """The words of the unit, and where its program says what it wants."""
        words = (("CIO", self.layout.n, "ETN21_N", at.CIO_WORDS), ("D", self.layout.m, "ETN21_M", at.D_WORDS),
                 ("A", at.INITIALIZING, "ETN21_Initializing", 1), ("A", at.RESTART, "ETN21_Restart", 1))  # fmt: skip
        left = "ETN21_Requested", "ETN21_Behind"
        return Exchanged(self._processor, words, "ETN21_Posted", "ETN21_Urgent", left, "ETN21_Wake", MOVES)

    @property
    def wake_ns(self) -> int:
        """When the unit has something to do by itself."""
        return 0 if self._mail.waits else int(self._wake[0])

    @property
    def link_up(self) -> bool:
        """Whether n+17 says that the cable is plugged; what the network does is the network's affair."""
        return self._service_status[0] != 0

    @link_up.setter
    def link_up(self, up: bool) -> None:
        self._service_status[0] = at.LINK_UP if up else 0
        self._wake[0] = 0

    @property
    def error_status(self) -> int:
        """What n+18 shows."""
        return int(self._error_status[0])

    @error_status.setter
    def error_status(self, status: int) -> None:
        self._error_status[0] = status
        self._wake[0] = 0

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
        words = self._look_at(memory)
        self._mail.forget()
        self._processor.view("ETN21_Reset", "u8")[0] = 1
        self._run(words, 0)
        return self.finish()

    def _look_at(self, memory: AreaMemory) -> Words:
        """The words of the PLC that the unit is in now."""
        words = self._words = Words(self.layout, memory)
        table = self._processor.view("ETN21_Lengths", "u32")
        known = lengths(memory)
        for number in range(len(table)):
            table[number] = known.get(at.FIRST_AREA_CODE + number, 0)
        return words

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: take the network's events and new switches, end what is ready, show what changed."""
        if not self.exchange(memory, events, now_ns):
            return []
        self.move(memory)
        return self.finish()

    def move(self, memory: AreaMemory) -> None:
        """Store what receives were handed."""
        self._mail.move(memory)

    def exchange(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> bool:
        """One I/O refresh but for what network and data have to do with it; False if there was nothing to do."""
        words = self._words
        if words is None or words.memory is not memory:
            words = self._look_at(memory)
        if events:
            self._mail.post(events)
        elif (now_ns < self.wake_ns and words.switches[0] == self._seen[0] and words.status[0] == self._reported[0]
              and not self._asked(words)):  # fmt: skip
            self.news = False
            return False
        self._run(words, now_ns)
        return True

    def _asked(self, words: Words) -> bool:
        """Does the program want a force-close, or a restart?"""
        return bool(words.n[0] & at.FORCE_CLOSE or words.restart[0] & self._mask)

    def _run(self, words: Words, now_ns: int) -> None:
        """The program of the unit once, between the two halves of the exchange of words."""
        self._n[:], self._m[:] = words.n, words.m
        self._initializing[:], self._restart[:] = words.initializing, words.restart
        before = self._state()
        self._processor.run(now_ns)
        self.news = self._state() != before
        words.n[:], words.m[:] = self._n, self._m
        words.initializing[:], words.restart[:] = self._initializing, self._restart

    def _state(self) -> tuple[bytes, bytes, int, int]:
        """The words that are exchanged, as the program sees them."""
        return self._n.tobytes(), self._m.tobytes(), self._initializing[0], self._restart[0]

    def post(self, events: Iterable[Event]) -> None:
        """Events of the network for the next run of the program."""
        self._mail.post(events)

    def finish(self) -> list[Request]:
        """What the program asked for since the last time, as far as it is the network's affair; the rest is done."""
        assert self._words is not None
        return self._mail.collect(self._words.memory)


def _scattered(seed: int) -> int:
    """A state to draw numbers from that is far from those of seeds nearby, and not 0 (splitmix64, G. Steele 2014)."""
    mixed = (seed + 1) * 0x9E37_79B9_7F4A_7C15 & 0xFFFF_FFFF_FFFF_FFFF
    mixed = (mixed ^ mixed >> 30) * 0xBF58_476D_1CE4_E5B9 & 0xFFFF_FFFF_FFFF_FFFF
    mixed = (mixed ^ mixed >> 27) * 0x94D0_49BB_1331_11EB & 0xFFFF_FFFF_FFFF_FFFF
    return mixed ^ mixed >> 31 or 1
