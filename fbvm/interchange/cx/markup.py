"""The text of a `.cxt` file as a tree: entries with a key and a value, in blocks; lists of rows; texts of any contents.

    key:=true;  key:=12;  key:="text";       a scalar; nothing is escaped in the quotes
    key:= BEGIN .. END;                      a block of entries
    key:= BEGIN_LIST_$#[7] .. END_LIST_$#[7];     rows, each with `;` at its end
    key:= $?St$Bk?_#[8] .. $?St$Bk?_#[8]     a text up to the next marker with the same number, whatever stands in between

A value keeps its place in the text, so that a part can be replaced and every other byte stays.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.cx.compression import CompressionError, decompress, is_compressed

HEAD = "CXProgVer:="
"""What every project begins with."""
DEEPEST = 60
"""Blocks inside one another beyond which a text is refused; real ones have 14."""
_KEY = re.compile(r"[ \t]*([^\s:\"]+):=[ \t]*")
_MARK = re.compile(r"[ \t]*(\$\?St\$Bk\?_#\[\d+\])(?:\r*\n|$)")
_LIST = re.compile(r"[ \t]*BEGIN_LIST_\$#\[(\d+)\][ \t\r]*(?:\n|$)")
_BLOCK = re.compile(r"[ \t]*BEGIN[ \t\r]*(?:\n|$)")
_END = re.compile(r"[ \t]*END;?[ \t\r]*(?:\n|$)")
_SPACE = re.compile(r"\s*")
_ENCODINGS = ("utf-8", "cp1252", "cp949", "cp932", "gbk", "cp1251")
"""Code pages that are tried where a file does not say its own: Western Europe before others."""
_USUAL = frozenset("°±²³µ·¹¼×÷§©®«»€£–—‘’“”„…•ºª™")
"""What Western European texts have beside letters."""
_ROW_NAME = re.compile(r"^[ ]+([^,\s\"]+),[^,\r\n]*,[A-Z_ ]+,", re.M)


class MarkupError(Exception):
    """A text that is no project; the arguments are the place, a message and a hint."""


@dataclass
class Value:
    """A value and its place: `text` of a scalar or a text without its signs, `rows` of a list, `entries` of a block.

    `start` to `end` is all of it, from behind `:=` up to its line end; `inner` to `inner_end` is what the signs enclose."""

    start: int
    end: int
    inner: int
    inner_end: int
    text: str = ""
    rows: list[Row] = field(default_factory=list)
    entries: dict[str, Value] = field(default_factory=dict)
    kind: str = "scalar"
    """scalar, text, list or block."""

    def get(self, *keys: str) -> Value | None:
        """The value behind these keys, one inside the other; None if one of them is missing."""
        found: Value | None = self
        for key in keys:
            found = found.entries.get(key) if found else None
        return found

    def string(self, *keys: str) -> str:
        """The text behind these keys; "" if it is missing."""
        found = self.get(*keys)
        return found.text if found else ""

    def numbered(self, key: str) -> Iterator[Value]:
        """The blocks `key[0]`, `key[1]` ... in the order of their numbers."""
        found = [(int(match[1]), value) for name, value in self.entries.items()
                 if (match := re.fullmatch(rf"{re.escape(key)}\[(\d{{1,9}})\]", name))]
        for _, value in sorted(found, key=lambda pair: pair[0]):
            yield value


@dataclass(frozen=True)
class Row:
    """A row of a list: its fields, and its place with the `;`."""

    start: int
    end: int
    fields: tuple[str, ...]


@dataclass(frozen=True)
class CxText:
    """The text of a project: decompressed and decoded."""

    source: Source
    text: str
    """The text with its own line ends; places in it are those of `source`."""
    root: Value
    encoding: str
    compressed: bool
    mark: bytes = b""
    """The byte order mark at the beginning."""

    def encoded(self, text: str) -> bytes:
        """A text as bytes of the file: in the same encoding."""
        return self.mark + text.encode(self.encoding, "surrogateescape")


def is_project(data: bytes) -> bool:
    """Whether bytes are a project of CX-Programmer, by how they begin."""
    start = data.removeprefix(b"\xef\xbb\xbf")
    if is_compressed(data):
        try:
            start = decompress(data, 1 << 10).removeprefix(b"\xef\xbb\xbf")
        except CompressionError:
            start = _beginning(data)
    return start.startswith(HEAD.encode())


def _beginning(data: bytes) -> bytes:
    """HEAD if the first bytes of a stream are those of compressed projects, which all begin alike; else nothing."""
    heads = (bytes.fromhex("0006866081"), bytes.fromhex("0006DEED"))
    return HEAD.encode() if data.startswith(heads) else b""


def read_markup(data: bytes, name: str, encoding: str = "") -> CxText | Diagnostic:
    """The tree of a project from the bytes of its file, or the diagnostic X0401 that says why there is none.

    name: what diagnostics call the file.  encoding: of the PC that wrote it; guessed if it is not given."""
    compressed = is_compressed(data)
    if data.startswith(b"PK\3\4"):
        return _refusal(name, "this is a zip archive, as Sysmac Studio writes it",
                        "of CX-Programmer, .cxp and .cxt are read; a Sysmac project is another world")
    try:
        plain = decompress(data) if compressed else data
    except CompressionError as error:
        return _refusal(name, f"it cannot be decompressed: {error}", "save the project again, or get an undamaged copy")
    mark = b"\xef\xbb\xbf" if plain.startswith(b"\xef\xbb\xbf") else b""
    plain = plain[len(mark):]
    if not plain.startswith(HEAD.encode()):
        return _refusal(name, f"it does not begin with {HEAD}", "CX-Programmer saves projects as .cxp and as .cxt")
    used, text = ("utf-8", plain.decode("utf-8", "surrogateescape")) if mark else _decoded(plain, encoding)
    source = Source(name, text)
    try:
        root = _Parser(text).file()
    except MarkupError as error:
        at, message, hint = error.args
        return Diagnostic("X0401", source, at, min(at + 1, len(text)), message, hint)
    return CxText(source, text, root, used, compressed, mark)


def _decoded(data: bytes, encoding: str) -> tuple[str, str]:
    """An encoding and the text: the one that is wanted; else the first one in which all is text and symbols have names."""
    if encoding:
        return encoding, data.decode(encoding, "surrogateescape")
    if data.isascii():
        return "cp1252", data.decode("ascii")
    for tried in _ENCODINGS:
        try:
            text = data.decode(tried)
        except UnicodeDecodeError:
            continue
        if tried == "utf-8" or _is_plausible(text):
            return tried, text
    return "cp1252", data.decode("cp1252", "surrogateescape")


def _is_plausible(text: str) -> bool:
    """Whether the symbols of a text have names, and what is not ASCII looks like words."""
    return all(sign.isalpha() or sign in _USUAL for sign in set(text) if not sign.isascii()) and \
        all(re.fullmatch(r"[^\W\d][\w.]*", name[1]) for name in _ROW_NAME.finditer(text))


def _refusal(name: str, why: str, hint: str) -> Diagnostic:
    return Diagnostic("X0401", Source(name, ""), 0, 0, f"{name} is no project of CX-Programmer that can be read: {why}", hint)


class _Parser:
    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def file(self) -> Value:
        """The whole text as a block."""
        root = Value(0, len(self.text), 0, len(self.text), kind="block")
        self._entries(root, 0, ends=False)
        return root

    def _entries(self, block: Value, depth: int, *, ends: bool) -> None:
        """Reads the entries of a block, up to its END if it `ends` with one."""
        if depth > DEEPEST:
            raise MarkupError(self.at, f"more than {DEEPEST} blocks stand inside one another", "the file is damaged")
        text = self.text
        while True:
            start = self.at
            if found := _END.match(text, start):
                if not ends:
                    raise MarkupError(start, "END stands here without its BEGIN", "the file is damaged")
                block.inner_end = start
                self.at = block.end = found.end()
                return
            key = _KEY.match(text, start)
            if not key:
                if not text[start:].strip():
                    if ends:
                        raise MarkupError(block.start, "the file ends before the END of this block", "the file is cut")
                    return
                if not (line := text[start:self._line_end(start)]).strip():
                    self.at = start + len(line)
                    continue
                raise MarkupError(start, "this is no entry: a key and := are missing", "the file is damaged")
            self.at = key.end()
            block.entries[key[1]] = self._value(key.end(), depth)

    def _line_end(self, at: int) -> int:
        found = self.text.find("\n", at)
        return len(self.text) if found < 0 else found + 1

    def _value(self, start: int, depth: int) -> Value:
        text, end = self.text, self._line_end(start)
        line = text[start:end].strip()
        if line:
            return self._scalar(start, end, line)
        at = end
        if found := _BLOCK.match(text, at):
            block = Value(start, at, found.end(), at, kind="block")
            self.at = found.end()
            self._entries(block, depth + 1, ends=True)
            return block
        if found := _MARK.match(text, at):
            inner, inner_end, end = self._raw(found)
            self.at = self._line_end(end)
            return Value(start, self.at, inner, inner_end, text[inner:inner_end], kind="text")
        if found := _LIST.match(text, at):
            return self._list(start, found)
        raise MarkupError(start, "nothing stands behind this :=", "the file is damaged")

    def _scalar(self, start: int, end: int, line: str) -> Value:
        if not line.endswith(";"):
            raise MarkupError(start, "the `;` at the end of this value is missing", "the file is damaged")
        inner = start + len(self.text[start:end]) - len(self.text[start:end].lstrip())
        bare = line[:-1].rstrip()
        self.at = end
        if bare.startswith('"'):
            if len(bare) < 2 or not bare.endswith('"'):
                raise MarkupError(start, 'the `"` at the end of this value is missing', "the file is damaged")
            return Value(start, end, inner + 1, inner + len(bare) - 1, bare[1:-1])
        return Value(start, end, inner, inner + len(bare), bare)

    def _raw(self, marker: re.Match[str]) -> tuple[int, int, int]:
        """The start and end of a text between markers, and the end of the marker behind it."""
        inner = marker.end()
        inner_end = self.text.find(marker[1], inner)
        if inner_end < 0:
            raise MarkupError(marker.start(1), f"the second marker {marker[1]} of this text is missing", "the file is cut")
        return inner, inner_end, inner_end + len(marker[1])

    def _list(self, start: int, head: re.Match[str]) -> Value:
        made = Value(start, head.end(), head.end(), head.end(), kind="list")
        end = re.compile(rf"[ \t]*END_LIST_\$#\[{head[1]}\];?[ \t\r]*(?:\n|$)")
        at = head.end()
        while not (found := end.match(self.text, at)):
            line_end = self._line_end(at)
            line = self.text[at:line_end].strip()
            if line_end == at or line.startswith("END_LIST_"):
                raise MarkupError(head.start(), f"the end of list {head[1]} is missing", "the file is cut")
            if not line:
                at = line_end
                continue
            begin, fields = at + len(self.text[at:line_end]) - len(self.text[at:line_end].lstrip()), _fields(line)
            if not line.endswith(";"):
                raw = _MARK.match(self.text, line_end)
                if not raw:
                    raise MarkupError(begin, "the `;` at the end of this row is missing", "the file is damaged")
                inner, inner_end, line_end = self._raw(raw)
                line_end = self._line_end(line_end)
                fields = [*fields[:-1], self.text[inner:inner_end]]
            made.rows.append(Row(begin, line_end, tuple(fields)))
            at = line_end
        made.inner_end, made.end = at, found.end()
        self.at = found.end()
        return made


def _fields(line: str) -> list[str]:
    """The fields of a row, which commas separate; one in quotes may have commas itself."""
    line = line.removesuffix(";")
    made: list[str] = []
    at = 0
    while at <= len(line):
        if line.startswith('"', at) and (end := _closing(line, at + 1)) >= 0:
            made.append(line[at + 1:end])
            at = end + 2
            continue
        end = line.find(",", at)
        end = len(line) if end < 0 else end
        made.append(line[at:end])
        at = end + 1
    return made


def _closing(line: str, at: int) -> int:
    """Where the quote of a field ends: in front of a comma or of the row's end; -1 if it does not."""
    while (at := line.find('"', at)) >= 0:
        if line[at + 1:at + 2] in ("", ","):
            return at
        at += 1
    return -1
