"""The Omron ETN21 Ethernet unit: socket services by request switches, as a CS/CJ program sees them in CIO and D words.

What the unit does is a program, `fblib/omron/etn21`, which its own processor runs once in an I/O refresh.  This module
exchanges the words, as the backplane does, and carries what program and network tell each other.  No I/O in here.  FINS, if it
is asked for, is the service in `fins/`.  Mail, FTP and clock adjustment are not emulated; their words stay 0.  From W420, W421
and, for points that these leave open, W343.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from fbvm.base.areas import NEVER
from fbvm.units.addresses import words_of
from fbvm.units.contract import AreaMemory, CpuUnit, Exchanged, ExchangedWords, Moves, UnitState
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.data import AREA_OF_CODE, lengths
from fbvm.units.etn21.faults import Fault, Faults
from fbvm.units.etn21.fins.service import FinsService
from fbvm.units.etn21.fins.state import ACCESS, FinsSettings, FinsState, endpoints_of
from fbvm.units.etn21.front import front
from fbvm.units.etn21.inside import Inside, power_on, prepare
from fbvm.units.etn21.map import Layout
from fbvm.units.etn21.names import descriptions, meanings
from fbvm.units.etn21.words import Words
from fbvm.units.front import Front
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import PORT, Command
from fbvm.wire.link import Event, Request

__all__ = ["TIME_WAIT_NS", "Etn21", "Fault"]

TIME_WAIT_NS = 60_000_000_000  # W421 6-9-3 p156
TIMINGS = ("exact", "real")
MOVES = Moves(count="ETN21_Moved", rows="ETN21_Moves", rings="ETN21_Rings", targets="ETN21_Targets",
              areas={code: area for code, (area, _) in AREA_OF_CODE.items()})  # fmt: skip


class Etn21:
    """One CS1W-ETN21 or CJ1W-ETN21 with a unit number from 0 to 15.

    `timing` is "exact" (a switch is accepted by the next refresh and finished by the one after, all words together)
    or "real" (seeded delays and words out of step).  `time_wait_ns` is how long a fixed local TCP port is held after
    a close from this side.  `odd_filler` is the low byte stored beside an odd last byte (00 is assumed); None keeps
    what is there.

    `fins` lets the unit serve FINS by UDP and TCP on `fins_port`, as node `fins_node` (None: the host part of its address; 0:
    whatever node a frame is for).  `fins_nodes` is its IP address table, `fins_clients` the FINS/TCP connections (1 to 16) that
    it opens itself, with their servers, `fins_permitted` the addresses of FINS/TCP clients if not all may connect, `fins_access`
    what may be done by FINS: "full", "no-control" (no change of the operating mode) or "read-only".  With `fins_error_flags`
    end codes have a bit while the PLC has an error.  Raises ValueError for a wrong argument."""

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
        fins: bool = False,
        fins_port: int = PORT,
        fins_node: int | None = None,
        fins_nodes: Mapping[str, str] | None = None,
        fins_clients: Mapping[str, str] | None = None,
        fins_permitted: Sequence[str] = (),
        fins_access: str = "full",
        fins_error_flags: bool = False,
    ) -> None:
        if timing not in TIMINGS:
            raise ValueError(f"timing {timing!r} is neither 'exact' nor 'real'")
        if odd_filler is not None and odd_filler not in range(256):
            raise ValueError(f"odd_filler {odd_filler} is no byte")
        words_of(address)
        self.layout = Layout.of(unit_number)
        self.name = f"ETN21 {unit_number}"
        self.address = address
        self._made: dict[str, Any] = {"unit_number": unit_number, "address": address, "timing": timing, "seed": seed,
                      "time_wait_ns": time_wait_ns, "odd_filler": odd_filler}  # fmt: skip
        self._words: Words | None = None
        self._mask = 1 << self.layout.bit
        """Its bit in words for all units."""
        self._service_status, self._error_status = at.LINK_UP, 0
        self._fins: FinsService | None = None
        if fins_access not in ACCESS:
            raise ValueError(f"fins_access {fins_access!r} is none of {', '.join(ACCESS)}")
        if any((fins_nodes, fins_clients, fins_permitted, fins_error_flags)) and not fins:
            raise ValueError("fins_nodes, fins_clients, fins_permitted and fins_error_flags are settings of FINS; write "
                             "fins = true, too")  # fmt: skip
        if fins:
            nodes, clients = endpoints_of(fins_nodes or {}), endpoints_of(fins_clients or {}, "FINS/TCP connection")
            self._fins = FinsService(
                FinsSettings(address, unit_number, fins_port, fins_node, nodes, clients, tuple(fins_permitted),
                             fins_error_flags, ACCESS[fins_access]))
            self._error_status = at.DISAGREEMENT if self._fins.settings.disagrees else 0
            self._made |= {"fins": True, "fins_port": fins_port, "fins_node": fins_node, "fins_nodes": dict(fins_nodes or {}),
                           "fins_clients": dict(fins_clients or {}), "fins_permitted": list(fins_permitted),
                           "fins_error_flags": fins_error_flags, "fins_access": fins_access}  # fmt: skip
        self.changed_words = False
        self._engine = "auto"
        self._times_set = 0
        self._processor: Inside | None = None
        """Switched on when there is something to do for it: most programs ask nothing of an ETN21."""
        if faults := list(faults):
            self._inside.faults.extend(faults)

    @property
    def _inside(self) -> Inside:
        """The processor, which is switched on now if it is not yet."""
        inside = self._processor
        if inside is None:
            made = self._made
            inside = self._processor = power_on(
                self.layout, self.address, real=made["timing"] == "real", seed=made["seed"],
                time_wait_ns=made["time_wait_ns"], odd_filler=made["odd_filler"], engine=self._engine)  # fmt: skip
            inside.report(self._service_status, self._error_status)
            if self._words:
                inside.know(lengths(self._words.memory))
        return inside

    def __deepcopy__(self, known: dict[int, Any]) -> Etn21:
        """Another unit in the same state, which shares the PLC's memory."""
        twin = Etn21(**self._made)
        twin._engine = self._engine
        if self._processor:
            twin._processor = self._processor.copy(self._made["odd_filler"])
        twin._service_status, twin._error_status = self._service_status, self._error_status
        twin._words, twin.changed_words = self._words, self.changed_words
        if self._fins and twin._fins:
            twin._fins.state = FinsState.of(self._fins.state.plain)
        return twin

    @property
    def times_set(self) -> int:
        """How often faults, link or error status have been set."""
        return self._times_set + (self._processor.faults.times_set if self._processor else 0)

    @property
    def state(self) -> UnitState:
        """All that the unit knows now, beside its arguments."""
        inside = self._processor
        memory, mail = (inside.own.memory.snapshot(), inside.mail.state) if inside else (None, None)
        fins = self._fins.state.plain if self._fins else None
        return UnitState(memory, (self._service_status, self._error_status, self.changed_words, mail, fins))

    def resume(self, state: UnitState, memory: AreaMemory) -> None:
        """Goes on from a state of a unit with the same arguments, in a PLC with this memory."""
        self._words = Words(self.layout, memory)
        self._service_status, self._error_status, self.changed_words, mail, fins = state.other
        if self._fins and fins:
            self._fins.state = FinsState.of(fins)
        if state.memory is None:
            self._processor = None
        else:
            self._inside.own.memory.restore(state.memory)
            self._inside.mail.resume(*mail)

    @property
    def faults(self) -> Faults:
        """Each is used up by the first request that it fits."""
        return self._inside.faults

    @faults.setter
    def faults(self, faults: Iterable[Fault]) -> None:
        if faults is not self._inside.faults:
            self._inside.faults[:] = faults

    @property
    def watched(self) -> tuple[tuple[str, int], ...]:
        """The groups of four words with the force-close switch, with unit status and request switches, with the restart bit."""
        n = self.layout.n
        return ("CIO", n), ("CIO", n + at.SERVICE_STATUS), ("CIO", n + at.SWITCHES), ("A", at.RESTART)

    @property
    def exchanged(self) -> Exchanged | None:
        """The words of the unit, and where its program says what it wants; None as long as it has nothing to do."""
        inside = self._processor
        if inside is None:
            return None
        words = (ExchangedWords(area="CIO", first=self.layout.n, variable="ETN21_N"),
                 ExchangedWords(area="D", first=self.layout.m, variable="ETN21_M"),
                 ExchangedWords(area="A", first=at.INITIALIZING, variable="ETN21_Initializing"),
                 ExchangedWords(area="A", first=at.RESTART, variable="ETN21_Restart"))  # fmt: skip
        return Exchanged(processor=inside.own, words=words, posted="ETN21_Posted", urgent="ETN21_Urgent",
                         unfinished=("ETN21_Requested", "ETN21_Behind"), wake="ETN21_Wake", moves=MOVES)  # fmt: skip

    @property
    def wake_ns(self) -> int:
        """When the unit has something to do by itself, in ns of the PLC's time; 0 for the next refresh."""
        inside, fins_ns = self._processor, self._fins.wake_ns if self._fins else NEVER
        if inside is None:
            return fins_ns
        if inside.mail.has_events:
            return 0
        wake_ns: int = inside.wake[0]
        return wake_ns if wake_ns < fins_ns else fins_ns

    @property
    def link_up(self) -> bool:
        """Whether n+17 says that the cable is plugged; what the network does is the network's affair."""
        return self._service_status != 0

    @link_up.setter
    def link_up(self, up: bool) -> None:
        self._service_status = at.LINK_UP if up else 0
        self._times_set += 1
        self._inside.report(self._service_status, self._error_status)

    @property
    def error_status(self) -> int:
        """What n+18 shows."""
        return self._error_status

    @error_status.setter
    def error_status(self, status: int) -> None:
        self._inside.report(self._service_status, status)
        self._error_status = status
        self._times_set += 1

    @cached_property
    def descriptions(self) -> dict[str, str]:
        """What the unit's bits and words are called, by address as charts write it (`CIO 1519.02`, `D30001`)."""
        return descriptions(self.layout)

    @cached_property
    def meanings(self) -> dict[str, dict[int, str]]:
        """What the values of its words mean, by address."""
        return meanings(self.layout)

    def front(self, memory: AreaMemory) -> Front:
        """Its dials, lamps and sockets as the words in `memory` tell them."""
        node = self._fins.settings.own_node if self._fins else int(self.address.rpartition(".")[2])
        return front(self.layout, node, memory)

    @property
    def configuration(self) -> dict[str, Any]:
        """The arguments with which `Etn21` makes the same unit, but for its faults: they are `settings`."""
        return dict(self._made)

    @property
    def settings(self) -> dict[str, Any]:
        """What may be set on the unit while it runs, as plain data: faults, link, error status."""
        waiting = self.faults if self._processor else ()
        faults = [[fault.code, fault.switch, fault.socket] for fault in waiting]
        return {"faults": faults, "link_up": self.link_up, "error_status": self.error_status}

    @settings.setter
    def settings(self, given: dict[str, Any]) -> None:
        self.link_up, self.error_status = bool(given["link_up"]), int(given["error_status"])
        self.faults[:] = [Fault(code, None if switch is None else at.Switch(switch), socket)
                          for code, switch, socket in given["faults"]]  # fmt: skip

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: the unit's own words and all switches 0, connections broken by RST."""
        broken = self._fins.reset() if self._fins else []
        words = self._look_at(memory)
        asks = self._asks(words) or words.initializing[0] & self._mask
        if self._processor is None and words.are_blank and not asks:
            self._report(words)
            return broken
        self._inside.reset()
        self.changed_words = self._inside.run(words, 0)
        return broken + self.finish()

    def _look_at(self, memory: AreaMemory) -> Words:
        """Views of the unit's words in the PLC that the unit is in now; the program learns how long that PLC's areas are."""
        words = self._words = Words(self.layout, memory)
        if self._processor:
            self._processor.know(lengths(memory))
        return words

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: take the network's events and new switches, end what is ready, show what changed."""
        if not self.exchange(memory, events, now_ns):
            return []
        self.move(memory)
        return self.finish()

    def move(self, memory: AreaMemory) -> None:
        """Stores the bytes that receives were handed in the CPU unit's words, as far as machine code has not done so."""
        if self._processor:
            self._processor.mail.move(memory)

    def exchange(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> bool:
        """Posts events, copies the unit's words in, runs the program once, copies them out.  Returns False if none of this was
        needed, because no switch, no event and no time asks for it."""
        words, inside = self._words, self._processor
        if words is None or words.memory is not memory:
            words = self._look_at(memory)
        if events and self._fins:
            events = self._fins.take(events)
        if events:
            self._inside.mail.post(events)
        elif not self._asks(words):
            if inside is None:
                self.changed_words = self._report(words)
                return False
            if words.switches[0] == inside.seen[0] and words.status[0] == inside.reported[0] and now_ns < self.wake_ns:
                self.changed_words = False
                return False
        self.changed_words = self._inside.run(words, now_ns)
        return True

    def _asks(self, words: Words) -> bool:
        """True if the user's program wants a force-close or a restart, or turned a switch ON before the processor was on."""
        if words.n[0] & at.FORCE_CLOSE or words.restart[0] & self._mask:
            return True
        return self._processor is None and words.switches[0] != 0

    def _report(self, words: Words) -> bool:
        """Shows n+17 and n+18 while the processor is not on.  Returns True if they have changed."""
        status = self._service_status, self._error_status
        if (words.n[at.SERVICE_STATUS], words.n[at.ERROR_STATUS]) == status:
            return False
        words.n[at.SERVICE_STATUS], words.n[at.ERROR_STATUS] = status
        return True

    def run_on(self, engine: str) -> None:
        """From now on the unit's program runs on this engine."""
        self._engine = engine
        if self._processor:
            self._processor.own.run_on(engine)

    def prepare(self) -> None:
        """The unit's program is compiled and its code ready, for all units that are switched on from now on."""
        prepare(self._engine)

    def post(self, events: Iterable[Event]) -> None:
        """Events of the network for the next run of the program."""
        if self._fins:
            events = self._fins.take(events)
        (self._processor or self._inside).mail.post(events)

    def finish(self) -> list[Request]:
        """The requests that the unit's program has left for the network since the last call, in order."""
        inside, words = self._processor, self._words
        if inside is None or words is None:
            return []
        requests = inside.mail.collect(words.memory)
        if self._fins:
            self._fins.count(requests)
        return requests

    # --- FINS ---------------------------------------------------------------------------------------------------------

    @property
    def has_fins(self) -> bool:
        """True if the unit serves FINS."""
        return self._fins is not None

    @property
    def unit_number(self) -> int:
        """Its number among the CPU bus units."""
        return self.layout.bit

    @property
    def node(self) -> int:
        """Its FINS node address; the host part of its IP address where FINS is off."""
        return self._fins.settings.own_node if self._fins else int(self.address.rpartition(".")[2])

    def serve(self, cpu: CpuUnit, now_ns: int) -> list[Request]:
        """Peripheral servicing: executes the FINS commands that have come.  A unit that starts does nothing, and begins anew."""
        fins = self._fins
        if fins is None:
            return []
        fins.error_status = self._error_status
        if cpu.memory.words("A")[at.INITIALIZING] & self._mask:
            requests = fins.reset()
        else:
            requests = fins.serve(cpu, now_ns)
            if fins.asks_restart:
                fins.asks_restart = False
                cpu.memory.words("A")[at.RESTART] |= self._mask
        self._show_fins(cpu.memory, fins)
        return requests

    def _show_fins(self, memory: AreaMemory, fins: FinsService) -> None:
        """Writes the words about FINS: n+23, and m+98 and m+99 (the unit's address; assumed)."""
        cio, d, (n, m) = memory.words("CIO"), memory.words("D"), (self.layout.n, self.layout.m)
        if cio[n + at.FINS_TCP_STATUS] != fins.connection_bits:
            cio[n + at.FINS_TCP_STATUS] = fins.connection_bits
            self.changed_words = True
        if not d[m + at.LOCAL_IP]:
            d[m + at.LOCAL_IP], d[m + at.LOCAL_IP + 1] = words_of(self.address)

    def execute(self, command: Command, cpu: CpuUnit) -> tuple[int, bytes]:
        """Executes a command of the PLC's own program for this unit; end code and data."""
        if self._fins is None:
            return EndCode.NO_UNIT, b""
        self._fins.error_status = self._error_status
        return self._fins.execute(command, cpu)

    def send(self, command: Command) -> int:
        """Takes a command of a network instruction; an end code, 0000 if the next servicing sends it."""
        return self._fins.send(command) if self._fins else EndCode.NOT_IN_NETWORK
