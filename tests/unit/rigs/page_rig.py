"""Reads the data of a page again, as its script does: the values of signals and words, the rows inside scans."""

from __future__ import annotations

import base64
import json
import re
import struct
import zlib
from itertools import accumulate, pairwise
from typing import Any

from fbvm.base.memory import FORMATS
from fbvm.record.page.cells import BIT, SIZES, TEXT
from fbvm.record.page.data import PageData

LETTERS = {BIT: "B", TEXT: "I"} | {code: FORMATS[code] for code in SIZES if code not in (BIT, TEXT)}

NUMBERS = """\
PROGRAM Main
VAR
    n : INT; s : SINT; b : BYTE; u : UINT; d : DINT; dw : DWORD; l : LINT; lw : LWORD; r : REAL; lr : LREAL; t : TIME; low : BOOL;
    located AT D7 : WORD; bit AT D9.3 : BOOL; text : STRING[20]; day : DATE := D#2024-02-28; far : ARRAY[0..400] OF LINT;
    p : REF_TO INT;
END_VAR
    n := n + 1;
    s := INT_TO_SINT(n * 7 MOD 100 - 50); b := BYTE#250 OR INT_TO_BYTE(n MOD 4); u := INT_TO_UINT(n) * 999; d := -70000 * n;
    dw := ROL(DWORD#16#8000_0001, n); l := l * 3 - 12345678901; lw := LWORD#16#FFFF_FFFF_0000_0000 OR INT_TO_LWORD(n);
    r := r / 3.0 + 1.5; lr := SQRT(INT_TO_LREAL(n)); t := t + T#1ms500us; low := n MOD 3 = 0; bit := n > 20;
    IF n MOD 10 = 0 THEN text := CONCAT('at ', INT_TO_STRING(n)); END_IF
    far[n] := n; far[30] := n; p := REF(n);
END_PROGRAM
"""
"""Numbers of every size, bits and texts that change."""


def unpacked(stream: bytes) -> bytes:
    return zlib.decompress(stream, -15)


class ReadPage:
    """What stands on a page."""

    def __init__(self, data: PageData) -> None:
        self._read(data.head, b"".join(data.parts))

    @classmethod
    def of_html(cls, text: str) -> ReadPage:
        """What stands on the page in a file."""
        found = re.search(r'id="data">([^<]*)<', text)
        assert found
        held = base64.b64decode(found[1])
        size = int.from_bytes(held[:4], "little")
        made = cls.__new__(cls)
        made._read(json.loads(unpacked(held[4:4 + size])), held[4 + size:])
        return made

    def _read(self, head: dict[str, Any], data: bytes) -> None:
        self.head = head
        ends = list(accumulate(head["parts"], initial=0))
        parts = [data[start:end] for start, end in pairwise(ends)]
        index = unpacked(parts.pop(0))
        windows = [json.loads(unpacked(parts.pop(0))) for _ in head["windows"]]
        self.rows = {int(scan): rows for window in windows for scan, rows in window["rows"].items()}
        self.ladder = {int(scan): drawn for window in windows for scan, drawn in window["ladder"].items()}
        self.pictures = [text for _ in range(0, head["pictures"], head["pictures_a_part"])
                         for text in json.loads(unpacked(parts.pop(0)))]  # fmt: skip
        self.frames = [row for _ in head["frames"] for row in json.loads(unpacked(parts.pop(0)))]
        self.columns = self._columns(index, data[ends[-1]:])
        assert not parts

    def _columns(self, index: bytes, streams: bytes) -> list[list[Any]]:
        """The values of each column at each scan, numbers or numbers of texts."""
        head, blocks = self.head, self.head["blocks"]
        varying = [number for number, column in enumerate(head["columns"]) if "value" not in column]
        rows = len(varying) * len(blocks)
        assert len(index) == (4 + 8 + 8 + 8) * rows
        lengths = struct.unpack(f"<{rows}I", index[:4 * rows])
        firsts = index[4 * rows:12 * rows]
        values: dict[int, list[Any]] = {
            number: [] if "value" not in column else [self._one(column, bytes.fromhex(column["value"]))] * sum(blocks)
            for number, column in enumerate(head["columns"])}  # fmt: skip
        for block, count in enumerate(blocks):
            for row, number in enumerate(varying):
                column, at = head["columns"][number], row * len(blocks) + block
                first = firsts[8 * at:8 * at + SIZES[column["code"]]]
                stream = unpacked(streams[:lengths[at]]) if lengths[at] else bytes(len(first) * count)
                streams = streams[lengths[at]:]
                values[number] += self._summed(column, first, stream)
        assert not streams
        return [values[number] for number in range(len(head["columns"]))]

    @staticmethod
    def _one(column: dict[str, Any], data: bytes) -> Any:
        return struct.unpack("<" + LETTERS[column["code"]], data)[0]

    def _summed(self, column: dict[str, Any], first: bytes, differences: bytes) -> list[Any]:
        size, number, made = len(first), int.from_bytes(first, "little"), []
        for at in range(0, len(differences), size):
            number = number + int.from_bytes(differences[at:at + size], "little") & (1 << 8 * size) - 1
            made.append(self._one(column, number.to_bytes(size, "little")))
        return made

    @property
    def times(self) -> list[int]:
        """The time of each scan in nanoseconds."""
        return self.columns[0]

    def value(self, signal: dict[str, Any], scan: int) -> Any:
        """The value of a signal at the end of a scan; of one that is carried as texts the text."""
        column = self.head["columns"][signal["cell"]]
        value = self.columns[signal["cell"]][scan - self.head["scans"][0]]
        return column["texts"][value] if column["code"] == TEXT else value

    def values(self, name: str) -> list[Any]:
        """The values of a signal at all scans."""
        [signal] = [signal for signal in self.head["signals"] if signal["name"] == name]
        first, count = self.head["scans"]
        return [self.value(signal, scan) for scan in range(first, first + count)]

    def word(self, area: str, address: int, scan: int) -> int:
        """A word of an area at the end of a scan."""
        number = self.head["words"].get(area, {}).get(str(address))
        if number is None:
            return int(self.head["constants"].get(area, {}).get(str(address), 0))
        return int(self.columns[number][scan - self.head["scans"][0]])
