"""The packets of a network as Wireshark lists them: source, destination, and a line of text about the contents.

    192.168.250.21:49152 -> 192.168.250.1:502  Modbus 1, unit 1: 03 read holding registers, address 0, quantity 10

A frame of Modbus or FINS is one packet, however TCP has split or joined it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import PORT as FINS_PORT
from fbvm.wire.fins.frames import parse_frame
from fbvm.wire.fins.tcp import MAGIC
from fbvm.wire.fins.text import described, described_message
from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Splitter, decode_reply, decode_request
from fbvm.wire.tap import Tap, TapEvent, TapKind

MODBUS_PORT = 502
INFO = {
    TapKind.SYN: "asks for a connection",
    TapKind.OPEN: "the connection is open",
    TapKind.FIN: "ends its side of the connection",
    TapKind.RST: "breaks the connection off",
    TapKind.UDP: "datagram",
}


@dataclass(frozen=True)
class Packet:
    """A frame of Modbus or FINS, another datagram, a change of a connection, or bytes that are neither.

    `info` is the line of text about it, `data` its bytes."""

    now_ns: int
    source: Peer
    destination: Peer
    info: str
    data: bytes = b""

    def __str__(self) -> str:
        return f"{self.source} -> {self.destination}  {self.info}"


def add_tap(network: object, tap: Tap) -> Tap | None:
    """Adds `tap` to the tap that a network has; returns the former tap, or None, to be set again afterwards."""
    before: Tap | None = getattr(network, "tap", None)

    def both(now_ns: int, unit: str, event: TapEvent) -> None:
        if before:
            before(now_ns, unit, event)
        tap(now_ns, unit, event)

    network.tap = both  # type: ignore[attr-defined]
    return before


class Dissector:
    """Makes packets of the events of a tap.  A server is the endpoint to which the connection was opened, else the one with the
    port of Modbus.  FINS is what goes to or comes from its port, and streams that begin as FINS/TCP does.

    `once` is for a tap of all units of a network, which reports what two units exchange from either side: each packet
    comes once, from its sender's side."""

    def __init__(self, once: bool = False) -> None:
        self._once = once
        self._streams: dict[tuple[Peer, Peer], _Stream] = {}
        self._servers: dict[frozenset[Peer], Peer] = {}

    def dissect(self, now_ns: int, event: TapEvent) -> Iterator[Packet]:
        """The packets that an event at time `now_ns` completes: none, one, or several frames in one segment."""
        if self._once and event.mirrored and not event.out:
            return
        pair = event.local, event.remote
        source, destination = pair if event.out else pair[::-1]
        if event.kind is TapKind.SYN:
            self._servers[frozenset(pair)] = destination
            for direction in (pair, pair[::-1]):
                self._streams.pop(direction, None)
        if event.kind is not TapKind.DATA:
            yield Packet(now_ns, source, destination, self._info(event), event.data)
            return
        stream = self._streams.get((source, destination))
        if stream is None:
            is_fins = FINS_PORT in (source.port, destination.port) or event.data.startswith(MAGIC)
            stream = _FinsStream() if is_fins else _ModbusStream(destination == self._server(pair))
            self._streams[source, destination] = stream
        for info, data in stream.feed(event.data):
            yield Packet(now_ns, source, destination, info, data)

    def _server(self, pair: tuple[Peer, Peer]) -> Peer:
        local, remote = pair
        return self._servers.get(frozenset(pair), local if local.port == MODBUS_PORT else remote)

    @staticmethod
    def _info(event: TapEvent) -> str:
        if event.kind is TapKind.UDP and FINS_PORT in (event.local.port, event.remote.port):
            return described(parse_frame(event.data))
        return f"{INFO[event.kind]} of {_size(event.data)}" if event.data else INFO[event.kind]


class _Stream(Protocol):
    """One direction of a connection."""

    def feed(self, data: bytes) -> Iterator[tuple[str, bytes]]:
        """A line of text and the bytes of each frame that `data` completes, and of bytes that are none."""


class _ModbusStream:
    def __init__(self, of_requests: bool) -> None:
        self._splitter = Splitter()
        self._decode = decode_request if of_requests else decode_reply

    def feed(self, data: bytes) -> Iterator[tuple[str, bytes]]:
        if self._splitter.broken:
            yield _size(data), data
            return
        frames = self._splitter.feed(data)
        if not frames:
            yield f"{_size(data)}, a frame in part", data
        for frame in frames:
            if isinstance(frame, Adu):
                message = self._decode(frame.pdu)
                yield f"Modbus {frame.transaction}, unit {frame.unit}: {message}", frame.to_bytes()
            else:
                yield f"{_size(frame.data)}, no Modbus: {frame.reason}", frame.data


class _FinsStream:
    def __init__(self) -> None:
        self._splitter = tcp.Splitter()

    def feed(self, data: bytes) -> Iterator[tuple[str, bytes]]:
        if self._splitter.broken:
            yield _size(data), data
            return
        messages = self._splitter.feed(data)
        if not messages:
            yield f"{_size(data)}, a FINS/TCP message in part", data
        for message in messages:
            if isinstance(message, tcp.Message):
                yield described_message(message), message.to_bytes()
            else:
                yield f"{_size(message.data)}, no FINS/TCP: {tcp.ERRORS[message.error]}", message.data


def _size(data: bytes) -> str:
    return f"{len(data)} byte{'s' * (len(data) != 1)}"
