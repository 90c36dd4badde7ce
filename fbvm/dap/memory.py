"""Memory as bytes: `readMemory` and `writeMemory`.

A reference is a byte of the flat memory, such as `0x18F20`.  The words of areas come with their high byte first, as W420 and
Modbus show them, and the variables of the program as they lie there."""

from __future__ import annotations

import base64
import binascii
import re

from fbvm.base.areas import Area
from fbvm.dap.session import Arguments, Body, DebugSession, Refusal
from fbvm.machine.plc import Plc
from fbvm.step.past_session import PastSession
from fbvm.step.session import Session
from fbvm.watch.paths import Place, UnknownPlace

LONGEST_BYTES = 1 << 20
_NUMBER = re.compile(r"0x[0-9a-f]+|\d+", re.I)


def reference_of(offset: int) -> str:
    """The memory reference of a byte of the flat memory."""
    return f"0x{offset:X}"


def place_of(session: Session | PastSession, reference: str) -> int:
    """The byte that a reference names: a number, or a name or address as people write it.  Raises Refusal."""
    text = reference.strip()
    if _NUMBER.fullmatch(text):
        return int(text, 0)
    try:
        found = session.player.find(text)
    except UnknownPlace as error:
        raise Refusal(str(error)) from None
    if not isinstance(found, Place) or found.hops:
        raise Refusal(f"{text} is no place in memory")
    return found.offset


def read_memory(debug: DebugSession, arguments: Arguments) -> Body:
    """The bytes at a reference; those behind the end of the memory are unreadable."""
    session = debug.plc()
    start = place_of(session, str(arguments.get("memoryReference", ""))) + int(arguments.get("offset") or 0)
    count = max(0, min(int(arguments.get("count") or 0), LONGEST_BYTES))
    memory = session.memory
    first, last = max(0, start), max(0, min(start + count, memory.size))
    swapped = _swapped(session)
    data = bytes(memory.u8[at ^ 1 if _in_words(swapped, at) else at] for at in range(first, max(first, last)))
    body: Body = {"address": reference_of(max(0, start)), "data": base64.b64encode(data).decode("ascii")}
    if (missing := count - len(data)) > 0:
        body["unreadableBytes"] = missing
    return body


def write_memory(debug: DebugSession, arguments: Arguments) -> Body:
    """Writes bytes at a reference, at this position, once."""
    session = debug.plc()
    start = place_of(session, str(arguments.get("memoryReference", ""))) + int(arguments.get("offset") or 0)
    try:
        data = base64.b64decode(str(arguments.get("data", "")), validate=True)
    except (binascii.Error, ValueError):
        raise Refusal("the data are not base64") from None
    if start < 0 or start + len(data) > session.memory.size:
        raise Refusal("that is outside of the memory")
    swapped = _swapped(session)
    rows = [(at ^ 1 if _in_words(swapped, at) else at, byte) for at, byte in enumerate(data, start)]

    def action(plc: Plc) -> None:
        for at, byte in rows:
            plc.memory.u8[at] = byte

    session.act(action)
    debug.running.forget()
    if debug.supports("supportsMemoryEvent"):
        debug.send_event("memory", {"memoryReference": reference_of(start), "offset": 0, "count": len(data)})
    return {"bytesWritten": len(data)}


def _swapped(session: Session | PastSession) -> list[Area]:
    return [area for area in session.facts.areas.values() if area.unit_bits == 16]


def _in_words(areas: list[Area], at: int) -> bool:
    return any(area.offset <= at < area.offset + area.size_bytes for area in areas)
