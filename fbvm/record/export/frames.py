"""Ethernet frames with IPv4, TCP and UDP, checksums included, for captures.

Addresses are those that the PLC program sees; the MAC address of each is made of its IPv4 address."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from fbvm.wire.link import Peer

FIN, SYN, RST, PSH, ACK = 0x01, 0x02, 0x04, 0x08, 0x10
"""TCP flags, RFC 9293 3.1."""
MAX_SEGMENT_BYTES = 1460
"""TCP data in one Ethernet frame: 1500 less two headers of 20."""
MAX_PACKET_BYTES = 1480
"""What follows the IP header in one Ethernet frame; a multiple of 8, as fragments have to be (RFC 791 3.2)."""
WINDOW_BYTES = 65_535
TIME_TO_LIVE = 64
PROTOCOL_TCP, PROTOCOL_UDP = 6, 17
ETHERTYPE_IPV4 = 0x0800
DONT_FRAGMENT, MORE_FRAGMENTS = 0x4000, 0x2000


def mac(host: str) -> bytes:
    """A locally administered MAC address for an IPv4 address; all ones for a broadcast."""
    address = _packed(host)
    return b"\xff" * 6 if address[3] == 255 else b"\x02\x00" + address


def checksum(data: bytes) -> int:
    """The Internet checksum, RFC 1071."""
    if len(data) % 2:
        data += b"\0"
    total: int = sum(struct.unpack(f">{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def tcp(sender: Peer, receiver: Peer, number: int, sequence: int, ack: int, flags: int, data: bytes = b"") -> bytes:
    """One frame with one segment.  `number` is the IP identification; a SYN has the option of the maximum segment size."""
    options = struct.pack(">BBH", 2, 4, MAX_SEGMENT_BYTES) if flags & SYN else b""
    offset = (20 + len(options)) // 4 << 4
    head = struct.pack(
        ">HHIIBBHHH", sender.port, receiver.port, sequence, ack, offset, flags, WINDOW_BYTES, 0, 0
    )
    segment = _with_checksum(sender, receiver, PROTOCOL_TCP, head + options + data, 16)
    [frame] = _packets(sender, receiver, PROTOCOL_TCP, number, segment)
    return frame


def udp(sender: Peer, receiver: Peer, number: int, data: bytes) -> list[bytes]:
    """The frames of one datagram: one, or several fragments."""
    datagram = struct.pack(">HHHH", sender.port, receiver.port, 8 + len(data), 0) + data
    datagram = _with_checksum(sender, receiver, PROTOCOL_UDP, datagram, 6)
    return list(_packets(sender, receiver, PROTOCOL_UDP, number, datagram))


def _with_checksum(sender: Peer, receiver: Peer, protocol: int, packet: bytes, place: int) -> bytes:
    """The packet with the checksum over pseudo header and packet in its place; UDP writes 0 as FFFF (RFC 768)."""
    pseudo = _packed(sender.host) + _packed(receiver.host) + struct.pack(">BBH", 0, protocol, len(packet))
    value = checksum(pseudo + packet)
    if protocol == PROTOCOL_UDP:
        value = value or 0xFFFF
    return packet[:place] + value.to_bytes(2, "big") + packet[place + 2 :]


def _packets(sender: Peer, receiver: Peer, protocol: int, number: int, content: bytes) -> Iterator[bytes]:
    whole = len(content) <= MAX_PACKET_BYTES
    for start in range(0, len(content), MAX_PACKET_BYTES):
        part = content[start : start + MAX_PACKET_BYTES]
        more = MORE_FRAGMENTS if start + len(part) < len(content) else 0
        flags = DONT_FRAGMENT if whole else more | start // 8
        head = struct.pack(
            ">BBHHHBBH4s4s", 0x45, 0, 20 + len(part), number & 0xFFFF, flags, TIME_TO_LIVE, protocol, 0,
            _packed(sender.host), _packed(receiver.host),
        )
        head = head[:10] + checksum(head).to_bytes(2, "big") + head[12:]
        yield mac(receiver.host) + mac(sender.host) + struct.pack(">H", ETHERTYPE_IPV4) + head + part


def _packed(host: str) -> bytes:
    return bytes(int(part) for part in host.split("."))
