"""The FINS service of one unit: what the network told becomes commands, and their responses requests to the network.

Commands are served in the order of their arrival, each in one piece, in peripheral servicing.  An answer goes back to where its
command came from; a real unit looks the node up in its table, so that two clients with one node steal each other's answers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from fbvm.base.areas import NEVER
from fbvm.units.contract import CpuUnit
from fbvm.units.etn21.fins import routing
from fbvm.units.etn21.fins.state import (
    BEFORE_CLIENTS,
    CONNECTIONS,
    TCP_CHANNELS,
    UDP_CHANNEL,
    Connection,
    FinsSettings,
    FinsState,
)
from fbvm.wire.fins import tcp
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import CPU_UNIT, EVERY_NODE, LAST_NODE, Command, Response, parse_frame
from fbvm.wire.link import (
    Bind,
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
)

MOST_FRAMES = 192
"""Commands that are executed in one servicing: as many as the unit has buffers (W465 8-1 p199).  Those behind them are
answered at once: 0204, the destination is busy."""
BUFFER_BYTES = 4096
"""Of each connection."""
PATIENCE_NS = 10_000_000_000
"""How long the other side may owe its node, or the rest of a message, before the connection is broken."""
RECONNECT_NS = 3_000_000_000
"""After this time a connection of which the unit is the client is opened again: every few seconds, for ever (W421 7-4 p174)."""
FIRST_ALLOTTED = 239
"""The node that connection 1 allots; W421 p174."""


class FinsService:
    """The service with these settings; `state` is all that changes in it."""

    def __init__(self, settings: FinsSettings, state: FinsState | None = None) -> None:
        self.settings = settings
        self._clients = {BEFORE_CLIENTS + number: number for number in settings.clients}
        """Numbers of the connections of which this unit is the client, by channel."""
        self._channels = frozenset((UDP_CHANNEL, *TCP_CHANNELS, *self._clients))
        self.state = state or FinsState()
        self._requests: list[Request] = []
        self._frames = 0
        """Commands of this servicing."""
        self.asks_restart = False
        """True if a command restarts the unit; who does so resets it."""
        self.error_status = 0
        """What n+18 shows; the unit says so before each servicing."""
        self._cpu: CpuUnit
        self._now_ns = 0

    # --- between two servicings ---------------------------------------------------------------------------------------

    def take(self, events: Iterable[Event]) -> list[Event]:
        """Keeps the events that are for this service until they are served; returns the others."""
        others = []
        for event in events:
            self.state.received += isinstance(event, Received)
            if event.channel in self._channels:
                self.state.events.append(event)
            else:
                others.append(event)
        return others

    def count(self, requests: Iterable[Request]) -> None:
        """Counts what the unit sends."""
        self.state.sent += sum(isinstance(request, Send | SendTo) for request in requests)

    @property
    def wake_ns(self) -> int:
        """When there is something to do without an event: 0 for the next scan."""
        state = self.state
        if state.events or state.outgoing:
            return 0
        times = [found.since_ns + PATIENCE_NS for found in state.connections.values() if not found.node or found.held]
        times += [state.retry_ns.get(channel, 0) for channel in self._channels - state.busy - state.failed]
        return min(times, default=NEVER)

    def reset(self) -> list[Request]:
        """Power on or restart: breaks everything off, which the next servicing opens anew."""
        for event in self.state.events:
            if isinstance(event, Closed) or (isinstance(event, Failed) and event.service == "open"):
                self._event(event)
        busy, closing = self.state.busy, self.state.closing
        self.state = FinsState(busy=busy, closing=set(busy))
        return [Close(channel, True) for channel in sorted(busy - closing)]

    def execute(self, command: Command, cpu: CpuUnit) -> tuple[int, bytes]:
        """Executes a command of the PLC's own program; end code and data."""
        if refused := routing.refusal(self.settings, command, len(command.to_bytes())):
            return refused, b""
        end_code, data = routing.execute(self.settings, self.state, self.error_status, command, cpu)
        self.asks_restart = self.asks_restart or routing.restarts(command, end_code)
        return end_code, data

    def send(self, command: Command) -> int:
        """Takes a command of a network instruction; an end code, 0000 if it goes out in the next servicing, from this node."""
        header = command.header
        header = replace(header, source=replace(header.source, node=self.settings.own_node))
        command, node = replace(command, header=header), header.destination.node
        for channel, found in self.state.connections.items():
            if found.node == node:
                self.state.outgoing.append(Send(channel, tcp.Message(tcp.Kind.FRAME, command.to_bytes()).to_bytes()))
                return EndCode.NORMAL
        if UDP_CHANNEL in self.state.failed:
            return EndCode.NOT_IN_NETWORK
        remote = routing.endpoint_of(self.settings, self.state, node)
        self.state.outgoing.append(SendTo(UDP_CHANNEL, remote, command.to_bytes()))
        return EndCode.NORMAL

    @property
    def connection_bits(self) -> int:
        """What n+23 shows: bit k-1 for each connection k whose node is agreed on."""
        return sum(1 << found.number - 1 for found in self.state.connections.values() if found.node)

    # --- one servicing ------------------------------------------------------------------------------------------------

    def serve(self, cpu: CpuUnit, now_ns: int) -> list[Request]:
        """Serves what has come; returns what the network has to do."""
        self._requests, self._frames, self._cpu, self._now_ns = [], 0, cpu, now_ns
        state = self.state
        events, state.events = state.events, []
        for event in events:
            self._event(event)
        if state.connections:
            self._expire()
        if state.changed_servers:
            self._leave_former_servers()
        if not state.busy | state.failed >= self._channels:
            self._open()
        if state.outgoing:
            self._send_outgoing()
        self.count(self._requests)
        return self._requests

    def _open(self) -> None:
        """Opens every channel that is not in use, connections of a client not before their time."""
        state, port = self.state, self.settings.port
        for channel in sorted(self._channels - state.busy - state.failed):
            if channel in self._clients:
                if self._now_ns < state.retry_ns.get(channel, 0):
                    continue
                state.dialled[channel] = self._server(channel)
                self._requests.append(Connect(channel, state.dialled[channel]))
            else:
                self._requests.append(Bind(channel, port) if channel == UDP_CHANNEL else Listen(channel, port))
            state.busy.add(channel)

    def _server(self, channel: int) -> Peer:
        """Where a connection of which this unit is the client is to lead."""
        number = self._clients[channel]
        return self.state.changed_servers.get(number) or self.settings.clients[number]

    def _leave_former_servers(self) -> None:
        """Closes connections to which 2730 has given another server."""
        for channel in self.state.busy.intersection(self._clients) - self.state.closing:
            if self.state.dialled.get(channel) != self._server(channel):
                self._close(channel)

    def _send_outgoing(self) -> None:
        """Sends what network instructions want to send; datagrams wait until the port is open.  What is for a connection that
        has ended is lost: the instruction repeats it."""
        state = self.state
        waiting: list[Send | SendTo] = []
        for request in state.outgoing:
            if isinstance(request, SendTo) and not state.udp_open:
                waiting.append(request)
            elif isinstance(request, SendTo) or request.channel in state.connections:
                self._requests.append(request)
        state.outgoing = waiting if UDP_CHANNEL not in state.failed else []

    def _event(self, event: Event) -> None:
        state, channel = self.state, event.channel
        match event:
            case Received():
                self._received(event)
            case Opened():
                if channel == UDP_CHANNEL:
                    state.udp_open = True
                else:
                    self._opened(event)
            case PeerClosed() | Broken():
                self._close(channel)
            case Failed(service="open"):
                state.busy.discard(channel)
                if channel in self._clients:
                    self._retry(channel)
                else:
                    state.failed.add(channel)
            case Failed() if channel != UDP_CHANNEL:
                self._close(channel, reset=True)
            case Closed():
                state.busy.discard(channel)
                state.closing.discard(channel)
                if channel in self._clients:
                    self._retry(channel)

    def _opened(self, event: Opened) -> None:
        """A connection is open: its client says its node, and waits for that of the server."""
        channel = event.channel
        is_client = channel in self._clients
        number = self._clients[channel] if is_client else self._free_number()
        self.state.connections[channel] = Connection(number, event.local_port, event.remote, is_client, self._now_ns)
        if is_client:
            self._requests.append(Send(channel, tcp.client_node(self.settings.own_node).to_bytes()))
        self._requests.append(Grant(channel, BUFFER_BYTES))

    def _retry(self, channel: int) -> None:
        """A connection of which this unit is the client is gone: it is opened again, one to another server at once."""
        if self.state.dialled.pop(channel, None) == self._server(channel):
            self.state.retry_ns[channel] = self._now_ns + RECONNECT_NS

    def _free_number(self) -> int:
        used = {found.number for found in self.state.connections.values()} | set(self._clients.values())
        return next((number for number in CONNECTIONS if number not in used), 0)

    def _received(self, event: Received) -> None:
        if event.channel == UDP_CHANNEL:
            if response := self._frame(event.data, event.remote, None):
                self._requests.append(SendTo(UDP_CHANNEL, event.remote, response))
        elif found := self.state.connections.get(event.channel):
            self._stream(event.channel, found, event.data)

    def _expire(self) -> None:
        """Breaks off connections whose clients owe something for too long."""
        for channel, found in list(self.state.connections.items()):
            if (not found.node or found.held) and self._now_ns - found.since_ns >= PATIENCE_NS:
                self._close(channel, reset=True)

    def _close(self, channel: int, reset: bool = False) -> None:
        is_open = self.state.connections.pop(channel, None) is not None
        if is_open or (channel in self._clients and channel in self.state.busy - self.state.closing):
            self.state.closing.add(channel)
            self._requests.append(Close(channel, reset))

    # --- FINS/TCP -----------------------------------------------------------------------------------------------------

    def _stream(self, channel: int, found: Connection, data: bytes) -> None:
        """Bytes of a connection: messages are served, the beginning of one is kept."""
        splitter = tcp.Splitter(found.held)
        was_whole = not found.held
        for message in splitter.feed(data):
            if channel in self.state.connections:
                self._message(channel, found, message)
                was_whole = True
        if channel not in self.state.connections:
            return
        found.held = splitter.pending
        if found.held and was_whole and found.node:
            found.since_ns = self._now_ns
        self._requests.append(Grant(channel, BUFFER_BYTES))

    def _message(self, channel: int, found: Connection, message: tcp.Message | tcp.Unreadable) -> None:
        if isinstance(message, tcp.Unreadable):
            self._refuse(channel, found, message.error)
        elif message.kind == tcp.Kind.ERROR:
            self._close(channel)
        elif found.is_client and message.kind == tcp.Kind.SERVER_NODE and not found.node:
            self._welcome(channel, found, message)
        elif found.is_client and message.kind == tcp.Kind.CONFIRMATION:
            pass
        elif message.kind == tcp.Kind.CLIENT_NODE and not found.node and not found.is_client:
            self._hello(channel, found, message)
        elif message.kind != tcp.Kind.FRAME or not found.node:
            self._refuse(channel, found, tcp.Error.NOT_SUPPORTED)
        elif message.is_wrong:
            self._refuse(channel, found, tcp.Error.TOO_LONG)
        else:
            if response := self._frame(message.body, found.remote, found):
                self._requests.append(Send(channel, tcp.Message(tcp.Kind.FRAME, response).to_bytes()))

    def _refuse(self, channel: int, found: Connection, error: tcp.Error) -> None:
        """Tells the other side an error and closes: by an error notification, or, before a client's node is agreed on, in the
        answer."""
        by_notification = found.node or found.is_client or error == tcp.Error.NOT_SUPPORTED
        said = tcp.Message(tcp.Kind.ERROR, b"", error) if by_notification else tcp.server_node(0, 0, error)
        self._requests.append(Send(channel, said.to_bytes()))
        self._close(channel)

    def _hello(self, channel: int, found: Connection, message: tcp.Message) -> None:
        """Agrees on the client's node, W421 7-4 p178-180."""
        node = FIRST_ALLOTTED + found.number - 1 if not message.is_wrong and message.node == 0 else 0
        if message.is_wrong:
            error = tcp.Error.TOO_LONG
        elif self.settings.permitted and found.remote.host not in self.settings.permitted:
            error = tcp.Error.NOT_PERMITTED
        elif not found.number:
            error = tcp.Error.ALL_IN_USE
        elif node:
            error = tcp.Error.NO_NODE_LEFT if self._holder(node) or node == self.settings.own_node else tcp.Error.NONE
        else:
            node = message.node
            error = self._refusal(node)
        if error:
            self._refuse(channel, found, error)
            return
        found.node = node
        self._requests.append(Send(channel, tcp.server_node(node, self.settings.own_node).to_bytes()))

    def _welcome(self, channel: int, found: Connection, message: tcp.Message) -> None:
        """Takes the node that a server says it has; without one the connection is closed, and opened again later."""
        if message.is_wrong or message.error or not 0 < message.server <= LAST_NODE or message.server == self.settings.own_node:
            self._close(channel)
        else:
            found.node = message.server

    def _refusal(self, node: int) -> tcp.Error:
        """Why a client cannot have the node that it asks for.  Whoever has it is asked whether it lives."""
        if node > LAST_NODE:
            return tcp.Error.NODE_OUT_OF_RANGE
        if node == self.settings.own_node:
            return tcp.Error.NODE_OF_SERVER
        if holder := self._holder(node):
            self._requests.append(Send(holder, tcp.Message(tcp.Kind.CONFIRMATION).to_bytes()))
            return tcp.Error.NODE_CONNECTED
        return tcp.Error.NONE

    def _holder(self, node: int) -> int:
        """The channel of the connection whose client has a node, 0 if none has."""
        return next((channel for channel, found in self.state.connections.items() if found.node == node), 0)

    # --- frames -------------------------------------------------------------------------------------------------------

    def _frame(self, data: bytes, remote: Peer, connection: Connection | None) -> bytes:
        """Serves a frame; the bytes of the answer, none if there is none to be given."""
        frame = parse_frame(data)
        if isinstance(frame, Response):
            self._cpu.take_response(frame)
            return b""
        if not isinstance(frame, Command):
            return b""
        header = frame.header
        self._frames += 1
        end_code, found = routing.refusal(self.settings, frame, len(data)), b""
        if not end_code and connection is None:
            end_code = routing.learn(self.settings, self.state, header.source.node, remote)
        if not end_code and self._frames > MOST_FRAMES:
            end_code = EndCode.BUSY
        if not end_code:
            end_code, found = routing.execute(self.settings, self.state, self.error_status, frame, self._cpu)
            self.asks_restart = self.asks_restart or routing.restarts(frame, end_code)
        if not header.wants_response or header.destination.node == EVERY_NODE:
            return b""
        if self.settings.error_flags and header.destination.unit == CPU_UNIT:
            end_code |= routing.error_flags(self._cpu)
        return Response(header.answer(), frame.code, end_code, found).to_bytes()
