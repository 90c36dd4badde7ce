"""The Modbus TCP server of OpenPLC's runtime, which answers from the memory of its PLC by itself.

A program asks it for nothing: as long as the PLC runs, it waits for clients on its port and answers them in the I/O refresh,
all requests that have come since the last one.  No I/O in here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from fbvm.base.areas import NEVER
from fbvm.units.addresses import words_of as address_words
from fbvm.units.contract import AreaMemory, UnitState
from fbvm.units.front import Front, Lamp, Socket
from fbvm.units.openplc import tables
from fbvm.units.openplc.tables import Bits, Kept, Registers
from fbvm.wire import modbus
from fbvm.wire.link import Broken, Close, Closed, Event, Failed, Grant, Listen, Opened, Peer, PeerClosed, Received, Request, Send
from fbvm.wire.modbus import Adu, Fault, Splitter
from fbvm.wire.modbus_server import ModbusServer

READING, WRITING = (1, 2, 3, 4), (5, 6, 15, 16)
"""Function codes of the server (OpenPLC's runtime v3, `modbus.cpp`)."""
MOST_CLIENTS = 64
BUFFER_BYTES = 8 * modbus.MAX_ADU_BYTES


@dataclass
class Client:
    """A client that is connected."""

    local_port: int
    remote: Peer
    stream: Splitter = field(default_factory=Splitter)


class OpenPlc:
    """The server at an address, for so many `clients` at once; `read_only` refuses everything that writes (exception 01).

    Raises ValueError for a wrong argument."""

    watched: Sequence[tuple[str, int]] = ()
    """Nothing that a program does asks it for anything."""
    exchanged = None
    """It has no processor of its own."""
    settings: dict[str, Any] = {}  # noqa: RUF012 - nothing may be set while it runs
    times_set = 0

    def __init__(self, address: str = "192.168.250.25", *, port: int = modbus.PORT, clients: int = 8,
                 read_only: bool = False) -> None:
        address_words(address)
        if not 0 < port < 1 << 16:
            raise ValueError(f"{port} is no port")
        if not 1 <= clients <= MOST_CLIENTS:
            raise ValueError(f"there may be 1 to {MOST_CLIENTS} clients at once, not {clients}")
        self.name, self.address = "OpenPLC", address
        self.configuration: dict[str, Any] = {"address": address, "port": port, "clients": clients, "read_only": read_only}
        self.port = port
        self.changed_words = False
        self._channels = range(clients)
        self._functions = READING if read_only else READING + WRITING
        self._clients: dict[int, Client] = {}
        self._busy: set[int] = set()
        """Channels in use, from the request to listen on."""
        self._closing: set[int] = set()
        """Those of them that were asked to close."""
        self._failed: set[int] = set()
        """Channels whose port cannot be used: they stay shut until the PLC is switched on again."""
        self._kept: Kept = {}

    def __deepcopy__(self, known: dict[int, Any]) -> OpenPlc:
        """Another unit in the same state."""
        twin = OpenPlc(**self.configuration)
        twin._take(self.state)
        return twin

    @property
    def wake_ns(self) -> int:
        """0 while a channel is to be opened, else NEVER: clients wake it."""
        return 0 if self._free() else NEVER

    @property
    def state(self) -> UnitState:
        """All that it knows beside the memory of its PLC."""
        clients = tuple((channel, found.local_port, found.remote.host, found.remote.port, found.stream.pending)
                        for channel, found in self._clients.items())  # fmt: skip
        return UnitState(None, (tuple(sorted(self._busy)), tuple(sorted(self._closing)), tuple(sorted(self._failed)), clients,
                                tables.plain(self._kept)))  # fmt: skip

    def resume(self, state: UnitState, memory: AreaMemory) -> None:
        """Goes on from a state of a unit with the same arguments."""
        self._take(state)

    def _take(self, state: UnitState) -> None:
        busy, closing, failed, clients, kept = state.other
        self._busy, self._closing, self._failed = set(busy), set(closing), set(failed)
        self._clients = {}
        for channel, local_port, host, port, pending in clients:
            self._clients[channel] = Client(local_port, Peer(host, port))
            self._clients[channel].stream.feed(pending)
        self._kept = {area: dict(values) for area, values in kept}

    def front(self, memory: AreaMemory) -> Front:
        """Its port, and who is connected."""
        sockets = [Socket(f"client {channel}", "CONNECTED", str(found.local_port), str(found.remote))
                   for channel, found in sorted(self._clients.items())]
        return Front(settings=(("port", str(self.port)), ("clients at once", str(len(self._channels)))),
                     lamps=(Lamp("RUN", not self._failed, "the port cannot be used" if self._failed else "serves"),),
                     sockets=tuple(sockets))  # fmt: skip

    # --- the refresh --------------------------------------------------------------------------------------------------

    def reset(self, memory: AreaMemory) -> list[Request]:
        """Power on: connections are broken, and what lies outside of the program's memory is 0."""
        broken = [Close(channel, True) for channel in sorted(self._busy - self._closing)]
        self._clients, self._failed, self._kept, self._closing = {}, set(), {}, set(self._busy)
        return list(broken)

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        """One I/O refresh: takes the network's events, answers, and waits for clients wherever a channel is free."""
        self.changed_words = False
        requests: list[Request] = []
        server = self._server(memory) if any(isinstance(event, Received) for event in events) else None
        for event in events:
            requests += self._event(event, server)
        for channel in self._free():
            self._busy.add(channel)
            requests.append(Listen(channel, self.port))
        return requests

    def _free(self) -> list[int]:
        return [channel for channel in self._channels if channel not in self._busy and channel not in self._failed]

    def _server(self, memory: AreaMemory) -> ModbusServer:
        """What answers from the memory as it is now."""
        server = ModbusServer(coils=0, discrete_inputs=0, holding_registers=0, input_registers=0, functions=self._functions)
        server.coils = Bits(memory, tables.COILS, self._kept)
        server.discrete_inputs = Bits(memory, tables.DISCRETE_INPUTS, self._kept)
        server.holding_registers = Registers(memory, tables.HOLDING_REGISTERS, self._kept)
        server.input_registers = Registers(memory, tables.INPUT_REGISTERS, self._kept)
        return server

    def _event(self, event: Event, server: ModbusServer | None) -> list[Request]:
        channel = event.channel
        match event:
            case Opened():
                self._clients[channel] = Client(event.local_port, event.remote)
                return [Grant(channel, BUFFER_BYTES)]
            case Received() if server is not None and channel in self._clients:
                return self._answers(channel, event.data, server)
            case PeerClosed() | Broken():
                return self._close(channel)
            case Failed(service="open"):
                self._busy.discard(channel)
                self._failed.add(channel)
            case Failed():
                return self._close(channel, reset=True)
            case Closed():
                self._busy.discard(channel)
                self._closing.discard(channel)
        return []

    def _answers(self, channel: int, data: bytes, server: ModbusServer) -> list[Request]:
        """The answers to the frames that bytes of a client complete; after bytes that are no frame the connection is closed."""
        requests: list[Request] = []
        for frame in self._clients[channel].stream.feed(data):
            if isinstance(frame, Adu):
                reply = Adu(frame.transaction, frame.unit, server.answer_pdu(frame.pdu, frame.unit))
                self.changed_words |= frame.pdu[0] in WRITING and not reply.pdu[0] & 0x80
                requests.append(Send(channel, reply.to_bytes()))
            elif isinstance(frame, Fault) and frame.fatal:
                return [*requests, *self._close(channel)]
        return [*requests, Grant(channel, BUFFER_BYTES)]

    def _close(self, channel: int, reset: bool = False) -> list[Request]:
        if self._clients.pop(channel, None) is None:
            return []
        self._closing.add(channel)
        return [Close(channel, reset)]
