"""Reads a trace: values at the end of any scan, and the events inside scans; the program is not needed.

    trace = Trace.open("run.fbtrace")
    trace.at(41).read("D200")

Of a file that is still being written the complete blocks are read; `refresh` reads further ones.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from fbvm.base.files import open_file
from fbvm.base.memory import Memory
from fbvm.machine.plc import Phase
from fbvm.record.trace.description import DescriptionError, describe
from fbvm.record.trace.events import Call, Contact, Cut, Event, Frame, NetworkEvent, Read, Return, Statement, Write
from fbvm.record.trace.format import (
    BLOCK,
    CONTACT,
    CUT,
    END,
    FRAME,
    HEADER,
    LINE,
    MAGIC,
    NETWORK,
    PHASE,
    PHASES,
    READ,
    SCAN,
    STATEMENT,
    WRITE,
    Chunk,
    Cursor,
    TraceError,
    chunks,
    read_chunk,
    xor,
)
from fbvm.record.trace.scan_source import Follower, Moment, ScanSource
from fbvm.record.trace.writer import FORMAT
from fbvm.wire.link import read_peer
from fbvm.wire.tap import TapEvent, TapKind


class Trace(ScanSource):
    """A trace in a file that is open for reading.  Raises TraceError if the file is no trace."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        if file.read(len(MAGIC)) != MAGIC:
            raise TraceError("this is no trace of fbvm")
        header = next(chunks(file), None)
        if header is None or header.kind != HEADER:
            raise TraceError("the trace has no header yet")
        self.header = _header(read_chunk(file, header.at))
        try:
            self.size = describe(self, self.header)
        except DescriptionError as error:
            raise TraceError(f"the trace's header is damaged: {error}") from None
        self.rung_sites = frozenset(rung.site for rung in self.rungs)
        self._blocks: list[Chunk] = []
        self._end = file.tell()
        self.refresh()

    @classmethod
    def open(cls, path: Path | str) -> Trace:
        """Opens a trace file; close it, or use it in a `with` statement.  Raises OSError, TraceError."""
        file = open_file(path)
        try:
            return cls(file)
        except BaseException:
            file.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self) -> Trace:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def refresh(self) -> None:
        """Reads the blocks that have been written to the file since it was opened."""
        self._file.seek(self._end)
        for chunk in chunks(self._file):
            if chunk.kind == BLOCK and chunk.scans:
                while self._blocks and self._blocks[-1].first >= chunk.first:
                    self._blocks.pop()  # the PLC was put back to an earlier scan: the later block counts
                self._blocks.append(chunk)
        self._end = self._file.tell()

    # --- contents

    @property
    def scans(self) -> range:
        """Numbers from the first to the last recorded scan."""
        if not self._blocks:
            return range(0)
        return range(self._blocks[0].first, self._blocks[-1].first + self._blocks[-1].scans)

    def moments(self, scans: range | None = None) -> Iterator[Moment]:
        """The PLC at the end of each scan; the same object for all scans."""
        for phase, moment in self._play(scans, None):
            if phase is Phase.REFRESH:
                yield moment

    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Reports the phases and events of some scans, or of all, to `follower`."""
        for phase, moment in self._play(scans, follower):
            follower.phase(moment, phase)

    def _play(self, scans: range | None, follower: Follower | None) -> Iterator[tuple[Phase, Moment]]:
        wanted = self.scans if scans is None else scans
        if not wanted or not self._blocks:
            return
        first = max(0, bisect_right([block.first for block in self._blocks], wanted.start) - 1)
        memory = Memory(self.size, self.areas)
        nexts = [block.first for block in self._blocks[1:]] + [wanted.stop]
        for block, end in zip(self._blocks[first:], nexts[first:], strict=True):
            if block.first >= wanted.stop:
                break
            cursor, part = Cursor(read_chunk(self._file, block.at)), range(wanted.start, min(end, wanted.stop))
            player = _Player(self, cursor, memory, follower, part, block.first)
            try:
                yield from player.play()
                player.check_end(min(part.stop, self.scans.stop))
            except (ArithmeticError, LookupError, TypeError, ValueError, RecursionError) as error:
                raise TraceError(f"the block of scan {block.first} is damaged: {error}") from None


class _Player:
    """Reads one block: applies changes of memory and makes events."""

    def __init__(self, trace: Trace, cursor: Cursor, memory: Memory, follower: Follower | None, wanted: range,
                 first: int) -> None:  # fmt: skip
        self._cursor, self._follower, self._wanted, self._next = cursor, follower, wanted, first
        self._moment = Moment(trace, memory)
        self._rung_sites, self._sites = trace.rung_sites, len(trace.sites)
        self._base = bytearray(memory.size)
        self._touched: list[tuple[int, int]] = []
        self._frames: list[Frame] = []
        self._outside = Frame(-1, 0, -1, None)

    def play(self) -> Iterator[tuple[Phase, Moment]]:
        cursor, moment = self._cursor, self._moment
        self._lines()
        moment.memory.u8[:] = self._base
        while cursor.more:
            tag = cursor.number()
            if tag == SCAN:
                scan = moment.scans + cursor.number()
                if scan != self._next:
                    raise ValueError(f"scan {scan} stands where scan {self._next} belongs")
                if scan >= self._wanted.stop:
                    return
                self._next = scan + 1
                moment.scans, moment.now_ns = scan, moment.now_ns + cursor.number()
                self._frames.clear()
            elif tag == PHASE:
                phase = PHASES[cursor.number()]
                self._lines()
                if moment.scans in self._wanted:
                    yield phase, moment
            else:
                event = self._event(tag)
                if self._follower and moment.scans in self._wanted:
                    self._follower.event(moment, event)

    def check_end(self, stop: int) -> None:
        """Raises ValueError if scans in front of `stop` were missing."""
        if self._next < stop:
            raise ValueError(f"scans {self._next} to {stop - 1} are missing")

    def _lines(self) -> None:
        """Applies the changes of memory, which include those of recorded writes."""
        cursor, base, live = self._cursor, self._base, self._moment.memory.u8
        for start, end in self._touched:
            live[start:end] = base[start:end]
        self._touched.clear()
        line = 0
        for _ in range(cursor.number()):
            line += cursor.number()
            start, end = line * LINE, line * LINE + LINE
            base[start:end] = xor(base[start:end], cursor.bytes(LINE))
            live[start:end] = base[start:end]

    def _event(self, tag: int) -> Event:
        cursor = self._cursor
        if tag == NETWORK:
            return _passing(cursor.bytes(cursor.number()))
        if tag == CUT:
            return Cut()
        if tag == FRAME:
            body, start, site, caller = (cursor.number() for _ in range(4))
            frame = Frame(body, start, self._site(site), self._frames[caller - 1] if caller else self._outside)
            self._frames.append(frame)
            return Call(frame)
        frame = self._frames[cursor.number()]
        if tag == END:
            return Return(frame)
        if tag == STATEMENT:
            number = self._site(cursor.number() + 1)
            return Statement(number, frame, number in self._rung_sites)
        if tag == CONTACT:
            site, value, size = (cursor.number() for _ in range(3))
            return Contact(self._site(site + 1), frame, json.loads(cursor.bytes(size)), bool(value))
        site, offset, bit, size = (cursor.number() for _ in range(4))
        if tag == READ:
            return Read(self._site(site), frame, offset, bit, cursor.bytes(size))
        if tag != WRITE:
            raise IndexError(f"a record of kind {tag}")
        event = Write(self._site(site), frame, offset, bit, cursor.bytes(size), cursor.bytes(size))
        self._write(event)
        return event

    def _site(self, number: int) -> int:
        """The number of a site that a record has, raised by one.  Raises IndexError for one that the trace does not have."""
        if number > self._sites:
            raise IndexError(f"there is no statement {number}")
        return number - 1

    def _write(self, event: Write) -> None:
        memory, end = self._moment.memory, event.offset + len(event.value)
        if event.bit < 8:
            memory.write(event.offset, "b", event.value != b"\0", event.bit)
        else:
            memory.u8[event.offset : end] = event.value
        self._touched.append((event.offset, end))


def _passing(text: bytes) -> NetworkEvent:
    try:
        now_ns, what, host, port, other, other_port, out, mirrored, data = json.loads(text)
        local, remote = read_peer(host, port), read_peer(other, other_port)
        return NetworkEvent(int(now_ns), TapEvent(TapKind(what), local, remote, bool(out), bytes.fromhex(data), bool(mirrored)))
    except (ArithmeticError, ValueError, TypeError) as error:
        raise IndexError(f"an event of the network cannot be read: {error}") from None


def _header(payload: bytes) -> dict[str, Any]:
    try:
        head = json.loads(payload)
        if head["format"] != FORMAT:
            raise TraceError(f"a trace of format {head['format']}; this version of fbvm reads format {FORMAT}")
    except (ArithmeticError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise error if isinstance(error, TraceError) else TraceError(f"the trace's header is damaged: {error}") from None
    made: dict[str, Any] = head
    return made
