"""The packets of a network as Wireshark lists them: source, destination, and a line of text about the contents.

    192.168.250.21:49152 -> 192.168.250.1:502  Modbus 1, unit 1: 03 read holding registers, address 0, quantity 10

A Modbus frame is one packet, however TCP has split or joined it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
    """A Modbus frame, a datagram, a change of a connection, or bytes that are no Modbus.

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
    """Makes packets of the events of a tap.  A Modbus server is the endpoint to which the connection was opened, else the one
    with port 502.

    `once` is for a tap of all units of a network, which reports what two units exchange from either side: each packet
    comes once, from its sender's side."""

    def __init__(self, once: bool = False) -> None:
        self._once = once
        self._streams: dict[tuple[Peer, Peer], Splitter] = {}
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
        stream = self._streams.setdefault((source, destination), Splitter())
        if stream.broken:
            yield Packet(now_ns, source, destination, _size(event.data), event.data)
            return
        frames = stream.feed(event.data)
        if not frames:
            yield Packet(now_ns, source, destination, f"{_size(event.data)}, a frame in part", event.data)
        for frame in frames:
            if isinstance(frame, Adu):
                is_request = destination == self._server(pair)
                message = decode_request(frame.pdu) if is_request else decode_reply(frame.pdu)
                info = f"Modbus {frame.transaction}, unit {frame.unit}: {message}"
                yield Packet(now_ns, source, destination, info, frame.to_bytes())
            else:
                yield Packet(now_ns, source, destination, f"{_size(frame.data)}, no Modbus: {frame.reason}", frame.data)

    def _server(self, pair: tuple[Peer, Peer]) -> Peer:
        local, remote = pair
        return self._servers.get(frozenset(pair), local if local.port == MODBUS_PORT else remote)

    @staticmethod
    def _info(event: TapEvent) -> str:
        return f"{INFO[event.kind]} of {_size(event.data)}" if event.data else INFO[event.kind]


def _size(data: bytes) -> str:
    return f"{len(data)} byte{'s' * (len(data) != 1)}"
