"""A capture file that Wireshark opens: the events of a network's tap, as the frames that a real network would have carried.

    with open("run.pcapng", "wb") as file:
        network.tap = Capture(file).tap

The bytes and times are those of the run.  The tap has no MAC addresses, sequence numbers and
acknowledgements; these are generated.  File format: draft-ietf-opsawg-pcapng, sections 3.5 and 4.1 to 4.3.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import BinaryIO

from fbvm.record.export import frames
from fbvm.record.export.frames import ACK, FIN, MAX_SEGMENT_BYTES, PSH, RST, SYN
from fbvm.record.trace.packets import Dissector
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

SECTION_HEADER, INTERFACE, ENHANCED_PACKET = 0x0A0D0D0A, 1, 6
BYTE_ORDER_MAGIC = 0x1A2B3C4D
LINKTYPE_ETHERNET = 1
OPTION_END, COMMENT, IF_NAME, SHB_USERAPPL, IF_TSRESOL = 0, 1, 2, 4, 9
NANOSECONDS = b"\x09"
"""Resolution of time stamps: 10 to the power of -9."""


@dataclass
class _Flow:
    """A connection in the file so far: the next sequence number of each endpoint, and the endpoints that have sent FIN."""

    next: dict[Peer, int]
    open: bool
    finished: set[Peer] = field(default_factory=set)
    reset: bool = False


class Capture:
    """Writes each event of a tap to a pcapng file.  The caller closes the file, and flushes what others shall see meanwhile.

    `epoch_ns`, in nanoseconds since 1970, is the date of the PLC's time 0.  Each unit is an interface of the file, named by
    its address; packets between two units of one network are written once.  `comment` returns the comment of a packet by
    the address of its unit, such as the number of the scan.  A packet that completes FINS frames says in its comment what they
    are."""

    def __init__(self, file: BinaryIO, epoch_ns: int = 0, comment: Callable[[str], str] | None = None) -> None:
        self._file = file
        self._comment = comment
        self._dissector = Dissector()
        self._epoch_ns = epoch_ns
        self._flows: dict[frozenset[Peer], _Flow] = {}
        self._interfaces: dict[str, int] = {}
        self._numbers: dict[str, int] = {}
        self._count = 0
        self._is_behind = False
        section = struct.pack("<IHHq", BYTE_ORDER_MAGIC, 1, 0, -1)
        self._block(SECTION_HEADER, section + _option(SHB_USERAPPL, b"fbvm") + _option(OPTION_END, b""))

    def tap(self, now_ns: int, address: str, event: TapEvent) -> None:
        """Writes the frames of an event; called by the network.  Mirrored events are written from the sender's side only."""
        if event.mirrored and not event.out:
            return
        pair = event.local, event.remote
        sender, receiver = pair if event.out else pair[::-1]
        packets = self._dissector.dissect(now_ns, event)
        said = [self._comment(address)] if self._comment else []
        fins = [packet.info for packet in packets if packet.info.startswith("FINS")]
        written = self._frames(event.kind, sender, receiver, event.data)
        last = len(written) - 1 - (event.kind is TapKind.DATA)  # behind data comes an acknowledgement
        for number, frame in enumerate(written):
            self._packet(now_ns, address, frame, "; ".join(said + fins if number == last else said))

    def flush(self) -> None:
        """Lets others see what was written; cheap where nothing was."""
        if self._is_behind:
            self._is_behind = False
            self._file.flush()

    # From events to frames.

    def _frames(self, what: TapKind, sender: Peer, receiver: Peer, data: bytes) -> list[bytes]:
        key = frozenset((sender, receiver))
        if what is TapKind.UDP:
            return frames.udp(sender, receiver, self._number(sender.host), data)
        flow = self._flows.get(key)
        if what is TapKind.SYN or flow is None:
            flow = self._flows[key] = self._new_flow(sender, receiver, what is not TapKind.SYN)
        if flow.reset:
            return []
        if what is TapKind.SYN:
            return [self._segment(flow, sender, receiver, SYN)]
        if what is TapKind.OPEN:
            return self._opened(flow, sender, receiver)
        if what is TapKind.RST:
            flow.reset = True
            return [self._segment(flow, sender, receiver, RST | ACK)]
        if sender in flow.finished:
            return []
        if what is TapKind.FIN:
            flow.finished.add(sender)
            segments = [self._segment(flow, sender, receiver, FIN | ACK)]
        else:
            parts = [data[start : start + MAX_SEGMENT_BYTES] for start in range(0, len(data), MAX_SEGMENT_BYTES)]
            flags = [ACK] * (len(parts) - 1) + [PSH | ACK]
            segments = [
                self._segment(flow, sender, receiver, flag, part) for flag, part in zip(flags, parts, strict=False)
            ]
        return [*segments, self._segment(flow, receiver, sender, ACK)]

    def _new_flow(self, opener: Peer, other: Peer, is_open: bool) -> _Flow:
        """Sequence numbers begin at another number for each connection, and are the same in each run."""
        self._count += 1
        first = self._count * 0x0100_0000
        return _Flow({opener: first % 2**32, other: (first + 0x0080_0000) % 2**32 if is_open else 0}, is_open)

    def _opened(self, flow: _Flow, opener: Peer, other: Peer) -> list[bytes]:
        if flow.open:  # the tap was set after the SYN
            return []
        flow.open = True
        flow.next[other] = (flow.next[opener] + 0x0080_0000) % 2**32
        return [self._segment(flow, other, opener, SYN | ACK), self._segment(flow, opener, other, ACK)]

    def _segment(self, flow: _Flow, sender: Peer, receiver: Peer, flags: int, data: bytes = b"") -> bytes:
        sequence, ack = flow.next[sender], flow.next[receiver] if flags & ACK else 0
        flow.next[sender] = (sequence + len(data) + bool(flags & (SYN | FIN))) % 2**32
        return frames.tcp(sender, receiver, self._number(sender.host), sequence, ack, flags, data)

    def _number(self, host: str) -> int:
        """IP identification: counts on for each address."""
        self._numbers[host] = number = self._numbers.get(host, 0) + 1
        return number

    # From frames to blocks.

    def _packet(self, now_ns: int, address: str, frame: bytes, comment: str) -> None:
        if address not in self._interfaces:
            self._interfaces[address] = len(self._interfaces)
            options = _option(IF_NAME, address.encode()) + _option(IF_TSRESOL, NANOSECONDS) + _option(OPTION_END, b"")
            self._block(INTERFACE, struct.pack("<HHI", LINKTYPE_ETHERNET, 0, 0) + options)
        stamp = self._epoch_ns + now_ns
        head = struct.pack(
            "<IIIII", self._interfaces[address], stamp >> 32, stamp & 0xFFFF_FFFF, len(frame), len(frame)
        )
        options = _option(COMMENT, comment.encode()) + _option(OPTION_END, b"") if comment else b""
        self._block(ENHANCED_PACKET, head + _padded(frame) + options)

    def _block(self, kind: int, body: bytes) -> None:
        size = struct.pack("<I", 12 + len(body))
        self._file.write(struct.pack("<I", kind) + size + body + size)
        self._is_behind = True


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)
