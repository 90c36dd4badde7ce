"""The log of a server of Modbus and FINS: a JSON line for each request that it has answered, made of the events of a network's
tap."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from typing import IO

from fbvm.wire.fins import tcp
from fbvm.wire.fins.codes import command_name
from fbvm.wire.fins.frames import PORT as FINS_PORT
from fbvm.wire.fins.frames import Command, Response, parse_frame
from fbvm.wire.fins.text import told
from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Splitter, decode_request
from fbvm.wire.tap import TapEvent, TapKind

SECOND_NS = 1_000_000_000
MOST_UNANSWERED = 1024
"""FINS commands that are remembered until they are answered; of more the oldest are forgotten."""


class _Connection:
    """The two streams of a connection, and the requests that have no reply yet."""

    def __init__(self) -> None:
        self.requests = Splitter()
        self.replies = Splitter()
        self.pending: deque[Adu] = deque()


class RequestLog:
    """Writes a line for each reply of the server to `file`: time (seconds since 1970), peer, function, address, count,
    result (0 or the exception code) and scan; null where a request has no such number.  A line of FINS has the command code,
    what the command says, and as its result the end code, null for a command that wants no response.

    `epoch_ns` is the date of the PLC's time 0 in nanoseconds since 1970, `scan` returns the number of the current scan.
    Set `network.tap` to `tap`; requests that came before are not in the log."""

    def __init__(self, file: IO[str], epoch_ns: int, scan: Callable[[], int]) -> None:
        self._file = file
        self._epoch_ns = epoch_ns
        self._scan = scan
        self._connections: dict[tuple[Peer, Peer], _Connection] = {}
        self._streams: dict[tuple[Peer, Peer, bool], tcp.Splitter] = {}
        """FINS/TCP by connection and direction."""
        self._commands: dict[tuple[Peer, int, int], Command] = {}
        """FINS commands without a response yet, by peer, node and service number."""

    def tap(self, now_ns: int, unit: str, event: TapEvent) -> None:
        """Called by the network for each event at a unit."""
        key = event.local, event.remote
        if event.kind is TapKind.UDP:
            self._frame(now_ns, event, event.data)
        elif event.kind is TapKind.DATA and event.local.port == FINS_PORT:
            for message in self._streams.setdefault((*key, event.out), tcp.Splitter()).feed(event.data):
                if isinstance(message, tcp.Message) and message.kind == tcp.Kind.FRAME:
                    self._frame(now_ns, event, message.body)
        elif event.kind is TapKind.DATA:
            self._data(now_ns, self._connections.setdefault(key, _Connection()), event)
        elif event.kind in (TapKind.OPEN, TapKind.RST):
            self._connections.pop(key, None)
            for out in (False, True):
                self._streams.pop((*key, out), None)

    def _data(self, now_ns: int, connection: _Connection, event: TapEvent) -> None:
        if not event.out:
            connection.pending += [found for found in connection.requests.feed(event.data) if isinstance(found, Adu)]
            return
        for found in connection.replies.feed(event.data):
            if isinstance(found, Adu) and connection.pending:
                self._write(now_ns, event.remote, connection.pending.popleft(), found)
        self._file.flush()

    def _frame(self, now_ns: int, event: TapEvent, data: bytes) -> None:
        """A FINS frame: a command is remembered, its response makes the line."""
        frame = parse_frame(data)
        if isinstance(frame, Command) and not event.out:
            if not frame.header.wants_response:
                self._write_fins(now_ns, event.remote, frame, None)
                return
            self._commands[event.remote, frame.header.source.node, frame.header.service] = frame
            if len(self._commands) > MOST_UNANSWERED:
                del self._commands[next(iter(self._commands))]
        elif isinstance(frame, Response) and event.out:
            asked = self._commands.pop((event.remote, frame.header.destination.node, frame.header.service), None)
            if asked is not None:
                self._write_fins(now_ns, event.remote, asked, frame)

    def _write_fins(self, now_ns: int, peer: Peer, command: Command, response: Response | None) -> None:
        row = {
            "time": round((self._epoch_ns + now_ns) / SECOND_NS, 6),
            "peer": str(peer),
            "command": f"{command.code:04X}",
            "says": ", ".join(filter(None, (command_name(command.code), told(command)))),
            "result": None if response is None else f"{response.end_code:04X}",
            "scan": self._scan(),
        }
        self._file.write(json.dumps(row) + "\n")
        self._file.flush()

    def _write(self, now_ns: int, peer: Peer, request: Adu, reply: Adu) -> None:
        fields = decode_request(request.pdu).fields
        row = {
            "time": round((self._epoch_ns + now_ns) / SECOND_NS, 6),
            "peer": str(peer),
            "function": request.pdu[0],
            "address": fields.get("address"),
            "count": fields.get("quantity", 1 if "value" in fields else None),
            "result": reply.pdu[1] if reply.pdu[0] & 0x80 else 0,
            "scan": self._scan(),
        }
        self._file.write(json.dumps(row) + "\n")
