"""The objects of a project or library of CODESYS 2.3: each has a name, a declaration, and a body that is text or a diagram.

The format is not published; what is used of it was found in libraries whose exports are known.  An object is its name, 41 bytes,
its declaration, and, if it is a POU, the kind of its body in one byte: 12 hexadecimal for Structured Text, which
follows.  Names and texts have their length in front, 4 bytes with the lowest one first, and are in Windows-1252."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.base.diagnostics import Source
from fbvm.syntax.text import decode

_HEAD_BYTES = 41
_ST_BODY = 0x12
_LONGEST_NAME, _LONGEST_TEXT = 80, 1 << 20
_KEYWORD = re.compile(rb"(?<![A-Za-z0-9_])(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE|VAR_GLOBAL|VAR_CONFIG)(?![A-Za-z0-9_])")
_BEFORE = re.compile(rb"(?:\s|\(\*(?:[^*]|\*(?!\)))*\*\)|\{[^}\r\n]*\})*")
"""What may stand in front of the first word of a declaration."""
_POU = re.compile(r"(?i)^\s*(FUNCTION_?BLOCK|FUNCTION|PROGRAM)\b")
_FRONT_BYTES = 4_000
"""Most bytes of comments in front of a declaration's first word."""


@dataclass(frozen=True)
class Piece:
    """An object: its name, and its text as Structured Text; `diagram` is True for a POU whose body is no text."""

    name: str
    text: str
    kind: str
    """PROGRAM, FUNCTION_BLOCK or FUNCTION; "" for types and global variables."""
    diagram: bool = False


def pieces(data: bytes) -> Iterator[Piece]:
    """The objects of a file, in its order."""
    behind = 0
    for found in _KEYWORD.finditer(data):
        if found.start() < behind:
            continue
        start = _text_start(data, found.start(), behind)
        if start is None:
            continue
        declaration, behind = _text_at(data, start), start + 4 + _number(data, start)
        name = _name_before(data, start - _HEAD_BYTES)
        pou = _POU.match(_BEFORE.sub(b"", declaration, count=1).decode("cp1252", "replace"))
        if pou is None:
            yield Piece(name or _named(declaration), _decoded(declaration), "")
            continue
        kind, body = pou[1].upper().replace("NB", "N_B"), b""
        if diagram := data[behind:behind + 1] != bytes((_ST_BODY,)):
            behind += 1
        else:
            body = _text_at(data, behind + 1)
            behind += 5 + len(body)
        yield Piece(name or _named(declaration), f"{_decoded(declaration)}\n{_decoded(body)}\nEND_{kind}\n", kind, diagram)


def _text_start(data: bytes, keyword: int, least: int) -> int | None:
    """Where the length of the declaration stands whose first word is at `keyword`; None if that is no declaration."""
    if _fits(data, keyword - 4, keyword) and keyword - 4 >= least:
        return keyword - 4
    marked = data.rfind(b"\0", max(least, keyword - _FRONT_BYTES), keyword)
    for start in (marked - 3, marked - 2) if marked >= 3 else ():
        if start >= least and _fits(data, start, keyword) and _BEFORE.fullmatch(data, start + 4, keyword):
            return start
    return None


def _fits(data: bytes, start: int, keyword: int) -> bool:
    """Whether a length at `start` is that of a text which begins behind it and holds the word at `keyword`."""
    if start < 0:
        return False
    length = _number(data, start)
    return keyword - start - 4 < length <= _LONGEST_TEXT and start + 4 + length <= len(data) \
        and data.find(b"\0", start + 4, start + 4 + length) < 0  # without a copy of what may be long, at each of many words


def _number(data: bytes, at: int) -> int:
    return int.from_bytes(data[at:at + 4], "little")


def _text_at(data: bytes, at: int) -> bytes:
    return data[at + 4:at + 4 + _number(data, at)]


def _name_before(data: bytes, end: int) -> str:
    """The name that ends there, "" if none does."""
    for length in range(1, _LONGEST_NAME):
        start = end - length - 4
        if start >= 0 and _number(data, start) == length:
            name = data[start + 4:end]
            return name.decode("cp1252", "replace") if re.fullmatch(rb"[\w\x80-\xff .-]+", name) else ""
    return ""


def _named(declaration: bytes) -> str:
    """The name that a declaration gives itself; lists of global variables have none."""
    words = _BEFORE.sub(b"", declaration, count=1).split()
    if len(words) < 2 or words[0].startswith(b"VAR_"):
        return "Globals"
    return re.split(rb"[:;(]", words[1])[0].decode("cp1252", "replace")


def _decoded(data: bytes) -> str:
    """A text of the file, with line ends of one character."""
    read = decode(data.rstrip(b"\0 \r\n\t"), "")
    text = read.text if isinstance(read, Source) else data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")
