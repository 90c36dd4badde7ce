"""What passed the network, in words: connections, and Modbus frames taken apart however TCP cut them.

    192.168.250.21:49152 -> 192.168.250.1:502  Modbus 1, unit 1: 03 read holding registers, address 0, quantity 10
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Splitter, decode_reply, decode_request
from fbvm.wire.tap import Happening, Tap, What

MODBUS_PORT = 502
WORDS = {
    What.SYN: "asks for a connection",
    What.OPEN: "the connection is open",
    What.FIN: "ends its side of the connection",
    What.RST: "breaks the connection off",
    What.UDP: "datagram",
}


@dataclass(frozen=True)
class Passed:
    """One thing that passed: when, from where to where, what in words, and its bytes."""

    now_ns: int
    sender: Peer
    receiver: Peer
    said: str
    data: bytes = b""

    def __str__(self) -> str:
        return f"{self.sender} -> {self.receiver}  {self.said}"


def listen(network: object, tap: Tap) -> Tap | None:
    """Lets somebody hear what passes a network besides who does already, who is given back."""
    before: Tap | None = getattr(network, "tap", None)

    def both(now_ns: int, unit: str, happening: Happening) -> None:
        if before:
            before(now_ns, unit, happening)
        tap(now_ns, unit, happening)

    network.tap = both  # type: ignore[attr-defined]
    return before


class Reader:
    """Reads a network's tap.  Knows a Modbus server by who was asked for the connection, else by its port.

    `once` is for somebody who hears all units of a network: what two of them say to each other is told by both."""

    def __init__(self, once: bool = False) -> None:
        self._once = once
        self._streams: dict[tuple[Peer, Peer], Splitter] = {}
        self._servers: dict[frozenset[Peer], Peer] = {}

    def read(self, now_ns: int, happening: Happening) -> Iterator[Passed]:
        """What a happening is."""
        if self._once and happening.mirrored and not happening.out:
            return
        pair = happening.local, happening.remote
        sender, receiver = pair if happening.out else pair[::-1]
        if happening.what is What.SYN:
            self._servers[frozenset(pair)] = receiver
            for way in (pair, pair[::-1]):
                self._streams.pop(way, None)
        if happening.what is not What.DATA:
            yield Passed(now_ns, sender, receiver, self._plain(happening), happening.data)
            return
        stream = self._streams.setdefault((sender, receiver), Splitter())
        if stream.broken:
            yield Passed(now_ns, sender, receiver, _bytes(happening.data), happening.data)
            return
        found = stream.feed(happening.data)
        if not found:
            yield Passed(now_ns, sender, receiver, f"{_bytes(happening.data)}, a frame in part", happening.data)
        for frame in found:
            if isinstance(frame, Adu):
                asks = receiver == self._server(pair)
                message = decode_request(frame.pdu) if asks else decode_reply(frame.pdu)
                said = f"Modbus {frame.transaction}, unit {frame.unit}: {message}"
                yield Passed(now_ns, sender, receiver, said, frame.to_bytes())
            else:
                yield Passed(now_ns, sender, receiver, f"{_bytes(frame.data)}, no Modbus: {frame.reason}", frame.data)

    def _server(self, pair: tuple[Peer, Peer]) -> Peer:
        local, remote = pair
        return self._servers.get(frozenset(pair), local if local.port == MODBUS_PORT else remote)

    @staticmethod
    def _plain(happening: Happening) -> str:
        return f"{WORDS[happening.what]} of {_bytes(happening.data)}" if happening.data else WORDS[happening.what]


def _bytes(data: bytes) -> str:
    return f"{len(data)} byte{'s' * (len(data) != 1)}"
