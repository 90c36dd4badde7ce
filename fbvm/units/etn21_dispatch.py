"""Takes every request of an ETN21 from the switch to the response code: notice, accept, wait, conclude.

Owns the parameter areas, the sockets and what runs; the unit calls its phases once per refresh, in the order in which
they stand here.  Rules of switches are from W421 6-7-5 p120 and p125, W343 6-2-7 p128.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

from fbvm.units import etn21_codes as codes
from fbvm.units import etn21_map as at
from fbvm.units.etn21_checks import check_request
from fbvm.units.etn21_data import store
from fbvm.units.etn21_display import Display
from fbvm.units.etn21_map import CLOSE, TRANSFERS, Layout, Parameters, Switch
from fbvm.units.etn21_service import NEVER_NS, Area, Service
from fbvm.units.etn21_socket import OPEN, OPENING, Socket
from fbvm.units.etn21_start import Surroundings, start_open, start_transfer
from fbvm.units.etn21_timing import NEXT, TOGETHER, Delay, Skew, Timing
from fbvm.units.etn21_words import Words
from fbvm.units.unit import AreaMemory
from fbvm.wire.link import Event, Request

BY_RANK = attrgetter("rank")
CHECKED_FIRST = frozenset({codes.CPU_UNIT_ERROR, codes.LOCAL_ADDRESS_ERROR})


@dataclass(frozen=True, slots=True)
class Fault:
    """A response code that the unit gives to the next request that fits, instead of serving it."""

    code: int
    switch: Switch | None = None
    """None fits every switch."""

    socket: int | None = None
    """None fits every socket number."""


@dataclass(frozen=True, slots=True)
class Choices:
    """What the manuals leave open, or a test wants otherwise."""

    time_wait_ns: int
    """How long a fixed local port is held after a close from this side."""

    odd_filler: int | None
    """Low byte that is stored beside an odd last byte; None keeps what is there."""


Found = tuple[Area, tuple[Switch, ...], bool]
"""Switches of an area that belong to no request yet; True if the program could see something running when it turned them ON."""


class Dispatch:
    """What runs in one unit."""

    def __init__(self, layout: Layout, address: str, timing: Timing, choices: Choices, faults: list[Fault]) -> None:
        self._layout = layout
        self._address = address
        self._timing = timing
        self._choices = choices
        self._faults = faults
        self._sockets = {number: Socket(number) for number in at.SOCKETS}
        self.forget()

    def forget(self) -> None:
        """As after power-on, but for what the network still has to close."""
        self.cycle = 0
        layout = self._layout
        shifts = {layout.switches_shift(number): number for number in at.AREAS}
        self._areas = {shift: Area(shift, layout.parameters(number), layout.switches(number))
                       for shift, number in shifts.items()}  # fmt: skip
        """By where their switches stand."""
        self._services: list[Service] = []
        self._noticed: list[Service] = []
        """Those that have not been accepted yet."""
        self._owned = 0
        """Switches that belong to a request already seen, as a mask."""
        self._deadline_ns = NEVER_NS
        """No service has an earlier one."""
        self._forced: list[Service] | None = None
        self._held_ports: dict[int, int] = {}
        self._display = Display(self._layout)
        self._touched: dict[Socket, Skew] = {}
        self.changed = False
        """The last refresh has written something."""

    def reset_sockets(self) -> list[Request]:
        """Requests that end every connection."""
        return [request for socket in self._sockets.values() for request in socket.reset()]

    def refresh(self, words: Words, events: Sequence[Event], switches: int, force: int, now_ns: int) -> list[Request]:
        """One I/O refresh, phase by phase.

        `switches` are n+19..n+22 as one number; `force` says that a force-close is asked for."""
        self._display.begin(words, self.cycle)
        start_force = force and self._forced is None
        new = switches & at.ALL_SWITCHES & ~self._owned
        found = self._find(new) if new else ()
        requests: list[Request] = []
        for event in events:
            requests += self.take(event)
        if self._services:
            if now_ns >= self._deadline_ns:
                requests += self._expire(now_ns)
            self._conclude_all(words.memory, now_ns)
        if self._forced is not None:
            self._conclude_force_close(self._forced)
        for area, asked, busy in found:
            self._notice(area, asked, busy)
        if self._noticed:
            requests += self._accept_all(words, now_ns)
        if start_force:
            requests += self._force_close(now_ns)
        self.changed = self._display.end(self._touched)
        return requests

    # --- 1. switches that are new ------------------------------------------------------------------------------------

    def _find(self, new: int) -> list[Found]:
        """New switches by area, judged before this refresh ends anything."""
        found = []
        while new:
            shift = (new & -new).bit_length() - 1 & ~7
            area, asked = self._areas[shift], at.SWITCHES_IN[new >> shift & at.AREA_SWITCHES]
            busy = bool(area.services) and any(service.code != codes.OTHER_PROCESSING for service in area.services)
            found.append((area, asked, busy))
            new &= ~(at.AREA_SWITCHES << shift)
        return found

    # --- 2. what the network and the clock say -----------------------------------------------------------------------

    def take(self, event: Event) -> list[Request]:
        """Let the socket of this channel take an event; events of unknown channels are dropped."""
        socket = self._sockets.get(event.channel)
        if socket is None:
            return []
        self._touched.setdefault(socket, TOGETHER)
        return socket.take(event)

    def _expire(self, now_ns: int) -> list[Request]:
        """End services whose time has run out; an open is withdrawn from the network."""
        requests: list[Request] = []
        self._deadline_ns = min((service.deadline_ns for service in self._services if service.deadline_ns > now_ns),
                                default=NEVER_NS)  # fmt: skip
        for service in self._services:
            if now_ns >= service.deadline_ns and service.code is None and service.socket is not None:
                service.code = service.deadline_code
                self._touched.setdefault(service.socket, TOGETHER)
                if service.switch in at.OPENS:
                    requests += service.socket.withdraw()
        return requests

    # --- 3. services that are ready ----------------------------------------------------------------------------------

    def _conclude_all(self, memory: AreaMemory, now_ns: int) -> None:
        """Write the results of what has ended: refusals first, closes last, one result an area and refresh."""
        ended = [service for service in self._services if service.code is not None]
        if len(ended) > 1:
            ended.sort(key=BY_RANK)
        for service in ended:
            if service.concluded_cycle == NEVER_NS and self._is_ready(service, now_ns):
                self._conclude(service, memory, now_ns)
            if service.concluded_cycle <= self.cycle:
                self._services.remove(service)
                if service.area is not None:
                    service.area.services.remove(service)
                    self._owned &= ~service.switch_bit

    def _is_ready(self, service: Service, now_ns: int) -> bool:
        if self.cycle < service.earliest_cycle or now_ns < service.earliest_ns:
            return False
        if service.area is not None and service.area.result_cycle >= self.cycle:
            return False
        return not service.interrupts or all(other.concluded_cycle < self.cycle for other in service.interrupts)

    def _conclude(self, service: Service, memory: AreaMemory, now_ns: int) -> None:
        skew = self._timing.skew()
        due = service.concluded_cycle = self.cycle + skew.switch
        socket = service.socket
        if socket is not None:
            if service.flag & TRANSFERS:
                socket.end(service)
            else:
                self._hold_port(service, socket, now_ns)
                was_connected = socket.connected
                socket.end(service)
                socket.settled_cycle = self.cycle + (skew.open if socket.connected != was_connected else 0)
            self._touched[socket] = skew
        if service.area is not None:
            if service.flag & TRANSFERS and socket is not None and service.parameters is not None:
                if service.data:
                    store(memory, service.parameters, service.data, self._choices.odd_filler)
                service.results[at.COUNT] = service.count
            self._display.show_result(service, service.area, due)
            service.area.result_cycle = due

    def _hold_port(self, service: Service, socket: Socket, now_ns: int) -> None:
        """A fixed local port stays taken after a close from this side, unless it was by RST (W421 6-9-3 p156)."""
        if service.switch is CLOSE and socket.holds_port:
            self._held_ports[socket.local_port] = now_ns + self._choices.time_wait_ns

    # --- 4. new requests ---------------------------------------------------------------------------------------------

    def _notice(self, area: Area, switches: tuple[Switch, ...], busy: bool) -> None:
        """Latch new switches of an area: a close always, else the lowest (assumed), and 110C for the others."""
        chosen = CLOSE if CLOSE in switches else None if busy else switches[0]
        for switch in switches:
            service = Service(switch, area, self.cycle + self._timing.accept_refreshes)
            if switch is not chosen:
                service.code = codes.OTHER_PROCESSING
                service.earliest_cycle = self.cycle + 1
            else:
                self._noticed.append(service)
            area.services.append(service)
            self._services.append(service)
            self._owned |= service.switch_bit

    def _accept_all(self, words: Words, now_ns: int) -> list[Request]:
        """Check and start what was noticed."""
        noticed, self._noticed = self._noticed, []
        requests: list[Request] = []
        for service in noticed:
            if service.accept_cycle > self.cycle:
                self._noticed.append(service)
            elif service.code is None and service.area is not None:
                requests += self._accept(service, service.area, words, now_ns)
                self._deadline_ns = min(self._deadline_ns, service.deadline_ns)
        return requests

    def _accept(self, service: Service, area: Area, words: Words, now_ns: int) -> list[Request]:
        parameters = service.parameters = Parameters.read(words.d, area.first)
        self._delay(service, self._timing.delay(), now_ns)
        number = parameters.socket
        socket = self._sockets.get(number)
        refusal = (
            self._fault(service.switch, number, first=True)
            or check_request(service.switch, parameters, area, socket, words.memory, self.cycle)
            or self._fault(service.switch, number, first=False)
        )
        if refusal or socket is None:
            service.code = refusal
            return []
        self._touched.setdefault(socket, TOGETHER)
        if service.flag & TRANSFERS:
            return start_transfer(service, parameters, socket, words.memory, now_ns)
        if service.switch is CLOSE:
            service.interrupts = self._interrupt(socket, now_ns)
            return socket.begin_close(service)
        return start_open(service, parameters, socket, Surroundings(self._address, self._held_ports, now_ns))

    def _interrupt(self, socket: Socket, now_ns: int) -> tuple[Service, ...]:
        """End what runs on a socket with 0081; a result that is already decided stays."""
        running = tuple(service for service in socket.services.values() if service.switch is not CLOSE)
        for service in running:
            if service.code is None:
                service.code = codes.SOCKET_CLOSED
                self._delay(service, NEXT, now_ns)
        return running

    def _delay(self, service: Service, delay: Delay, now_ns: int) -> None:
        service.earliest_cycle = self.cycle + delay.refreshes
        service.earliest_ns = now_ns + delay.time_ns

    def _fault(self, switch: Switch, socket: int, first: bool) -> int:
        """The code of the next fault that fits, which is then used up; 0 if none does."""
        for fault in self._faults:
            fits = fault.switch in (None, switch) and fault.socket in (None, socket)
            if fits and (fault.code in CHECKED_FIRST) == first:
                self._faults.remove(fault)
                return fault.code
        return codes.NORMAL_END

    # --- 5. force-close ----------------------------------------------------------------------------------------------

    def _force_close(self, now_ns: int) -> list[Request]:
        """Close every socket, whatever it does (W421 6-7-5 p120).  Stores no response code of its own (assumed).

        Requests that were seen and are not accepted yet end, too (assumed)."""
        requests: list[Request] = []
        self._forced = []
        for service in self._services:
            if service.code is None and service.parameters is None:
                service.code = codes.SOCKET_CLOSED
                service.earliest_cycle = self.cycle + 1
        for socket in self._sockets.values():
            if socket.phase in (OPENING, OPEN):
                service = Service(CLOSE, None, self.cycle)
                service.interrupts = self._interrupt(socket, now_ns)
                self._delay(service, self._timing.delay(), now_ns)
                requests += socket.begin_close(service)
                self._touched.setdefault(socket, TOGETHER)
                self._forced.append(service)
        self._services += self._forced
        return requests

    def _conclude_force_close(self, forced: list[Service]) -> None:
        if all(service.concluded_cycle <= self.cycle for service in forced):
            self._display.end_force_close()
            self._forced = None

    # --- 6. what is seen ---------------------------------------------------------------------------------------------

    def wake_ns(self, now_ns: int) -> int:
        """Until when nothing happens by itself: 0 if the next refresh has work, `NEVER_NS` if nothing is timed."""
        if self._display.pending or self._forced is not None:
            return 0
        wake_ns = NEVER_NS
        for service in self._services:
            if service.code is not None and service.earliest_ns > now_ns:
                wake_ns = min(wake_ns, service.earliest_ns)
            elif service.code is not None or service.accept_cycle > self.cycle:
                return 0
            if service.deadline_ns < wake_ns:
                wake_ns = service.deadline_ns
        return wake_ns
