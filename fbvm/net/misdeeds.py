"""Wrong answers of a Modbus server, by name: `ModbusPeer(reply=MISDEEDS["wrong unit"])`.

Each takes the right reply frame and gives the actions done in its place, so that a client can be seen to cope."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.net.peers import Actions, Fin, Leave, Reset, Say

LATE_NS = 60_000_000_000
"""Later than any client waits."""
PIECE_GAP_NS = 25_000_000
"""Between pieces: more than a scan, so that a program sees them come one by one."""


def _changed(offset: int, value: int | None = None) -> Callable[[bytes], Actions]:
    """The frame with one byte changed: to a value, or all its bits."""

    def reply(frame: bytes) -> Actions:
        byte = frame[offset] ^ 0xFF if value is None else value
        return (Say(frame[:offset] + bytes((byte,)) + frame[offset + 1 :]),)

    return reply


def _cut(frame: bytes) -> Actions:
    """The frame with its last byte missing, and an MBAP length that says so."""
    return (Say(frame[:4] + (len(frame) - 7).to_bytes(2, "big") + frame[6:-1]),)


def _exception(frame: bytes) -> Actions:
    return (Say(frame[:4] + b"\0\3" + frame[6:7] + bytes((frame[7] | 0x80, 0x04))),)


def _byte_by_byte(frame: bytes) -> Actions:
    return [Say(frame[at : at + 1], at * PIECE_GAP_NS) for at in range(len(frame))]


MISDEEDS: dict[str, Callable[[bytes], Actions]] = {
    # The right reply, but not as one likes it.
    "late": lambda frame: (Say(frame, LATE_NS),),
    "two pieces": lambda frame: (Say(frame[:5]), Say(frame[5:], PIECE_GAP_NS)),
    "byte by byte": _byte_by_byte,
    "twice": lambda frame: (Say(frame + frame),),
    # Frames that do not fit the request.
    "wrong transaction": _changed(1),
    "wrong unit": _changed(6),
    "wrong function": _changed(7, 0x2B),
    "wrong content": _changed(8),
    "one byte short": _cut,
    "server failure": _exception,
    # Streams that are no Modbus.
    "wrong protocol": _changed(3, 1),
    "impossible length": _changed(4),
    "garbage": lambda frame: (Say(b"HTTP/1.1 400 Bad Request\r\n\r\n"),),
    # Nothing, or not all.
    "silence": lambda frame: (),
    "half": lambda frame: (Say(frame[: len(frame) // 2]),),
    "half, then fin": lambda frame: (Say(frame[: len(frame) // 2]), Fin()),
    "fin": lambda frame: (Leave(),),
    "reset": lambda frame: (Reset(),),
    "half, then reset": lambda frame: (Say(frame[: len(frame) // 2]), Reset(PIECE_GAP_NS)),
}
