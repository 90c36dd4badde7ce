"""XML to elements that know their place, and back to text; knows nothing of PLCopen.

What comes from outside is not trusted: a document type is refused, so that there are no entities, and nothing is ever
fetched; size, depth and number of elements have limits.  The parser is expat, which the host's library brings.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, open_file, reason
from fbvm.syntax.text import MARKS

MAX_BYTES = SOURCE_BYTES
MAX_DEPTH = 200
"""Deepest nesting; projects of editors have less than 40."""
MAX_ELEMENTS = 1_000_000
_DECLARED = re.compile(rb"""<\?xml[^>]*?encoding\s*=\s*["']([A-Za-z][\w.-]*)["']""")
_UNMARKED = {b"<\0": "utf-16-le", b"\0<": "utf-16-be"}
"""How a document in UTF-16 begins that has no mark: expat recognises it, so its text has to be the same."""
_ENCODINGS = re.compile(r"utf-8|utf-16|ascii|iso8859-\d+|cp125\d|cp437|cp850|koi8-[ru]|gbk|gb2312|gb18030|big5|"
                        r"shift_jis|euc_\w+")
"""Encodings that are accepted, by their names in Python."""


@dataclass(eq=False)
class Element:
    """An element: `name` without its prefix, the address of its `namespace`, attributes by local name, and what it holds:
    elements, and texts between them.  `at` is the character offset of its tag in the source."""

    name: str
    namespace: str
    attributes: dict[str, str]
    at: int
    content: list[Element | str] = field(default_factory=list)

    @property
    def children(self) -> list[Element]:
        return [part for part in self.content if isinstance(part, Element)]

    def all(self, *names: str) -> list[Element]:
        """The children of these names, in their order."""
        return [part for part in self.content if isinstance(part, Element) and part.name in names]

    def one(self, *path: str) -> Element | None:
        """The first child of that name, or what a path of names leads to."""
        here: Element | None = self
        for name in path:
            here = next(iter(here.all(name)), None) if here else None
        return here

    def get(self, name: str, default: str = "") -> str:
        return self.attributes.get(name, default)

    def walk(self) -> Iterator[Element]:
        """The element and all that are in it, in the order of writing."""
        todo = [self]
        while todo:
            element = todo.pop()
            yield element
            todo.extend(reversed(element.children))

    @property
    def text(self) -> str:
        """All text in it, in whatever elements it stands; `<br/>` is a line end."""
        pieces: list[str] = []
        todo: list[Element | str] = [self]
        while todo:
            part = todo.pop()
            if isinstance(part, str):
                pieces.append(part)
            else:
                pieces += ["\n"] if part.name == "br" else []
                todo.extend(reversed(part.content))
        return "".join(pieces)


class Refusal(Exception):
    """The document is not read; the arguments are code, message and hint."""


def read_markup(path: Path, name: str) -> tuple[Source, Element] | Diagnostic:
    """The text and the root element of a file, or the diagnostic that says why there is none.  Never raises for what a file
    contains."""
    try:
        with open_file(path) as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        return Diagnostic("X0101", Source(name, ""), 0, 0, f"{name} cannot be read: {reason(error)}")
    return parse_markup(data, name)


def parse_markup(data: bytes, name: str) -> tuple[Source, Element] | Diagnostic:
    """The same for bytes already read."""
    if len(data) > MAX_BYTES:
        return _too_large(name)
    try:
        source = Source(name, _decoded(data))
    except Refusal as refusal:
        code, message, hint = refusal.args
        return Diagnostic(code, Source(name, ""), 0, 0, f"{name} {message}", hint)
    builder = _Builder(source)
    try:
        return source, builder.build()
    except Refusal as refusal:
        code, message, hint = refusal.args
        at = builder.place()
        return Diagnostic(code, source, at, at + 1, message, hint)


def _too_large(name: str) -> Diagnostic:
    return Diagnostic("X0103", Source(name, ""), 0, 0, f"{name} has more than {MAX_BYTES >> 20} MiB",
                      "export parts of the project one by one")


def _decoded(data: bytes) -> str:
    mark, encoding = next((known for known in MARKS if data.startswith(known[0])), (b"", _UNMARKED.get(data[:2], "")))
    data = data.removeprefix(mark)
    if not encoding and (found := _DECLARED.match(data[:200])):
        encoding = _known(found[1].decode("ascii"))
    try:
        return data.decode(encoding or "utf-8")
    except UnicodeDecodeError as error:
        said = f"says that it is {encoding.upper()}" if encoding else "names no encoding, and so is UTF-8"
        raise Refusal("X0101", f"{said}, and is none at byte {error.start}",
                      "save it as UTF-8, or correct `encoding` in its first line") from None


def _known(declared: str) -> str:
    try:
        name = codecs.lookup(declared).name
    except LookupError:
        name = ""
    if not _ENCODINGS.fullmatch(name):
        raise Refusal("X0101", f"is written in {declared}, which is not read here", "save it as UTF-8")
    return name


class _Builder:
    """Makes elements from the events of expat."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.top = Element("", "", {}, 0)
        self.open = [self.top]
        self.count = 0
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._doctype

    def build(self) -> Element:
        try:
            self.parser.Parse(self.source.text, True)
        except expat.ExpatError as error:
            said = expat.ErrorString(error.code)
            raise Refusal("X0101", f"this is no well-formed XML: {said}", self._advice()) from None
        return self.top.children[0]

    def place(self) -> int:
        """The offset that the parser has reached."""
        starts = self.source.line_starts
        line = min(max(self.parser.CurrentLineNumber, 1), len(starts))
        return min(starts[line - 1] + self.parser.CurrentColumnNumber, len(self.source.text))

    def _advice(self) -> str:
        opened = self.open[-1]
        if opened is self.top:
            return "an export of a PLC tool begins with <?xml and <project"
        line = self.source.place(opened.at)[0]
        return f"<{opened.name}> of line {line} is open here; if the file was cut, export it once more"

    def _doctype(self, *declared: object) -> None:
        raise Refusal("X0102", "the document declares a document type, and with it perhaps entities: it is not read",
                      "PLCopen XML has none; take <!DOCTYPE ...> out if you trust the file")

    def _start(self, tag: str, attributes: Mapping[str, str]) -> None:
        self.count += 1
        if len(self.open) > MAX_DEPTH:
            raise Refusal("X0103", f"elements are nested more than {MAX_DEPTH} deep", "no PLC tool writes that")
        if self.count > MAX_ELEMENTS:
            raise Refusal("X0103", f"there are more than {MAX_ELEMENTS} elements", "export parts of the project one by one")
        namespace, _, name = tag.rpartition(" ")
        element = Element(name, namespace, {key.rpartition(" ")[2]: value for key, value in attributes.items()}, self.place())
        self.open[-1].content.append(element)
        self.open.append(element)

    def _end(self, tag: str) -> None:
        self.open.pop()

    def _text(self, text: str) -> None:
        self.open[-1].content.append(text)


# --- back to text -----------------------------------------------------------------------------------------------------

STEP = "  "


def element(tag: str, /, *content: Element | str | None, **attributes: str | int) -> Element:
    """A new element; None among the contents is left out."""
    written = {key: str(value) for key, value in attributes.items()}
    return Element(tag, "", written, 0, [part for part in content if part is not None])


def written(root: Element) -> str:
    """An XML document; an element that holds text stands on one line."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>']
    todo: list[tuple[int, Element | str]] = [(0, root)]
    while todo:
        depth, part = todo.pop()
        indent = STEP * depth
        if isinstance(part, str):
            lines.append(part)
        elif not part.content:
            lines.append(f"{indent}<{_tag(part)}/>")
        elif any(isinstance(inner, str) for inner in part.content):
            lines.append(indent + _inline(part))
        else:
            lines.append(f"{indent}<{_tag(part)}>")
            todo.append((depth, f"{indent}</{part.name}>"))
            todo.extend((depth + 1, inner) for inner in reversed(part.content))
    return "\n".join(lines) + "\n"


def _tag(part: Element) -> str:
    return " ".join([part.name, *(f"{key}={quoteattr(value)}" for key, value in part.attributes.items())])


def _inline(part: Element | str) -> str:
    if isinstance(part, str):
        return escape(part)
    inside = "".join(_inline(inner) for inner in part.content)
    return f"<{_tag(part)}>{inside}</{part.name}>"
