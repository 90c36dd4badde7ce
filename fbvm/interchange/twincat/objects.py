"""Objects of TwinCAT, XML files that hold Structured Text, to sources with the same lines and columns.

A source is the text of its file with a blank in place of all that is no Structured Text, and with the words that the files
leave out: END_FUNCTION_BLOCK, GET, END_METHOD and their like.  So whatever is said of a place in the source is said of the file.

Formats: files of TwinCAT 3.1, versions 1.0 to 1.2 of TcPlcObject."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import unescape

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.twincat.drawings import LANGUAGES, Drawings, Owner

ROOT = "TcPlcObject"
_CHILDREN = {"POU": "", "Itf": "INTERFACE", "DUT": "", "EnumerationTextList": "", "GVL": "", "Task": ""}
"""Children of the root, and what each of them declares where its text need not be asked."""
_OTHERS = {"LADDER": "ladder", "SFC": "a sequential function chart"}
_NO_CODE = re.compile(r"//[^\n]*|\(\*.*?\*\)|\{[^}]*\}|'(?:\$.|[^'$])*'", re.S)
_KIND = re.compile(r"\b(FUNCTION_BLOCK|FUNCTION|PROGRAM|INTERFACE|CLASS)\b", re.I)
_TAG = re.compile(r"""<(?:"[^"]*"|'[^']*'|[^>"'])*>""")
_PIECE = re.compile(r"<!\[CDATA\[(?P<code>.*?)\]\]>|(?P<comment><!--.*?-->)|(?P<escaped>&[^;]+;)|(?P<end></)|"
                    r"(?P<text>[^<&]+)", re.S)  # fmt: skip


@dataclass
class ImportedObject:
    """What a file holds: a source, if it is one of Structured Text, or the element of a task; and what is said about it."""

    source: Source | None = None
    task: Element | None = None
    diagnostics: list[Diagnostic] = field(default_factory=list)


def read_object(data: bytes, name: str) -> ImportedObject:
    """Reads an object.

    data: the bytes of the file.  name: what diagnostics call it; a list of globals has the name of its file without the
    ending, as in TwinCAT.

    Never raises for what the file contains."""
    parsed = parse_markup(data, name)
    if isinstance(parsed, Diagnostic):
        return ImportedObject(diagnostics=[parsed])
    xml, root = parsed
    held = [child for child in root.children if child.name in _CHILDREN] if root.name == ROOT else []
    if len(held) != 1:
        why = "holds no object" if not held else f"holds {len(held)} objects"
        return ImportedObject(diagnostics=[Diagnostic(
            "X0501", xml, root.at, root.at + 1, f"the file {why} of TwinCAT",
            f"such a file has a <{ROOT}> with one <POU>, <DUT>, <GVL>, <Itf> or <Task> in it")])
    if held[0].name == "Task":
        return ImportedObject(task=held[0])
    written = _Written(xml)
    written.object(held[0])
    return ImportedObject(Source(name, written.text()), None, written.diagnostics)


_ACCESS = re.compile(r"(?:\s|//[^\n]*\n|\{[^}]*\}|\(\*(?:(?!\*\)).)*\*\))*(PUBLIC|PRIVATE|PROTECTED|INTERNAL)\b", re.I | re.S)
"""The access word of an accessor, which stands at the head of its declaration."""


class _Written:
    """The Structured Text of an object, at the places at which it stands in the XML."""

    def __init__(self, xml: Source) -> None:
        self._xml = xml
        self._parts: list[str] = []
        self._at = 0
        """Up to where the XML is written."""
        self._words: list[str] = []
        """Words that wait for a place: they are written behind the next line end, where no comment swallows them."""
        self._ahead = 0
        """By how many columns the present line is ahead of that of the XML."""
        self._moves_access = False
        """Whether the access word at the head of the next text is among the words already."""
        self.diagnostics: list[Diagnostic] = []

    def text(self) -> str:
        """All of it."""
        self._blank(len(self._xml.text))
        return "".join(self._parts)

    def object(self, element: Element) -> None:
        """A POU, an interface, a type or a list of global variables."""
        kind = _CHILDREN[element.name] or _kind(element)
        drawings = self._declaration(element, kind, [element, *element.all("Action")])
        self._body(element, drawings)
        for member in element.children:
            if member.name == "Method":
                self._body(member, self._declaration(member, "METHOD", [member]))
                self._words.append("END_METHOD")
            elif member.name == "Property":
                self._property(member)
            elif member.name == "Action":
                self._words.append(f"ACTION {member.get('Name')}:")
                self._body(member, drawings)
                self._words.append("END_ACTION")
            elif member.name == "Transition":
                self._report(member, f"the transition {member.get('Name')} belongs to a chart, which is not imported")
        if kind:
            self._words.append(f"END_{kind}")

    def _property(self, element: Element) -> None:
        self._code(element.one("Declaration"))
        for accessor in element.all("Get", "Set"):
            declaration = accessor.one("Declaration")
            access = _ACCESS.match(declaration.text) if declaration else None
            self._words.append(f"{access[1] if access else ''} {accessor.name.upper()}".strip())
            self._moves_access = access is not None
            self._body(accessor, self._declaration(accessor, accessor.name.upper(), [accessor]))
            self._words.append(f"END_{accessor.name.upper()}")
        self._words.append("END_PROPERTY")

    def _declaration(self, element: Element, kind: str, holders: list[Element]) -> Drawings | None:
        """The declaration of a POU, method or accessor, with the variables that the drawings in `holders` need; those
        drawings, if there are any."""
        declaration = element.one("Declaration")
        self._code(declaration)
        bodies = [part for holder in holders if (inside := holder.one("Implementation")) for part in inside.all(*LANGUAGES)]
        if not bodies:
            return None
        owner = Owner(kind, element.get("Name"), declaration.text if declaration else "")
        drawings = Drawings(self._xml, owner, bodies)
        self.diagnostics += drawings.diagnostics
        self._words += drawings.variables()
        return drawings

    def _body(self, element: Element, drawings: Drawings | None) -> None:
        implementation = element.one("Implementation")
        for part in implementation.children if implementation else []:
            if part.name == "ST":
                self._code(part)
            elif part.name in LANGUAGES and drawings is not None:
                self._lines(drawings.written[id(part)])
            elif part.name in _OTHERS:
                language = _OTHERS[part.name]
                self._report(part, f"the body of {element.get('Name')} is {language}, which is not read from this file")

    def _report(self, element: Element, message: str) -> None:
        self.diagnostics.append(Diagnostic("X0203", self._xml, element.at, element.at + 1 + len(element.name), message,
                                           "export the object as PLCopen XML, and import that"))

    # --- text -------------------------------------------------------------------------------------------------------------

    def _code(self, element: Element | None) -> None:
        """The text of an element, where it stands."""
        for start, end, text in self._pieces(element) if element else []:
            if text.strip():
                self._blank(start)
                if self._moves_access and (access := _ACCESS.match(text)):  # blanks keep its place
                    text = text[:access.start(1)] + " " * len(access[1]) + text[access.end(1):]
                self._moves_access = False
                self._parts.append(text)
                self._at, self._ahead = end, 0 if "\n" in text else self._ahead

    def _pieces(self, element: Element) -> Iterator[tuple[int, int, str]]:
        xml = self._xml.text
        tag = _TAG.match(xml, element.at)
        assert tag is not None  # it was parsed
        at = tag.end()
        while not tag[0].endswith("/>") and (piece := _PIECE.match(xml, at)) and not piece["end"]:
            at = piece.end()
            for name in ("code", "escaped", "text"):
                if piece[name] is not None:
                    yield piece.start(name), piece.end(name), unescape(piece[name]) if name == "escaped" else piece[name]

    def _lines(self, lines: list[tuple[int, str]]) -> None:
        """Lines of rungs and statements, each on a line of its own: the first of a network on the one where the network begins,
        or on the next that is free."""
        for begins, line in lines:
            at = self._xml.text.find("\n", max(begins, self._at)) + 1
            if at > 0:
                self._blank(at)
                self._parts.append(line)
            else:
                self._parts.append(f"\n{line}\n")
            self._ahead = len(line)

    def _blank(self, to: int) -> None:
        """Blanks up to an offset of the XML; words that wait stand in the first line that begins there, or at once."""
        blank = re.sub(r"[^\r\n]", " ", self._xml.text[self._at:to])
        self._at = to
        if self._words:
            words, self._words = f" {' '.join(self._words)} ", []
            first, end, blank = blank.partition("\n")
            if not end and "//" in "".join(self._parts).rpartition("\n")[2]:
                words = f"\n{words}"
            if not end:
                blank, first = first, ""
            self._parts += [first, end, words]
            self._ahead = len(words) + (0 if end else self._ahead)
        line, end, rest = blank.partition("\n")
        kept = line[min(self._ahead, len(line) - line.endswith("\r")):]
        self._ahead = 0 if end else self._ahead - (len(line) - len(kept))
        self._parts += [kept, end, rest]


def _kind(element: Element) -> str:
    """The word with which the declaration of a POU begins; "" for types and global variables, whose text is whole."""
    declaration = element.one("Declaration")
    found = _KIND.search(_NO_CODE.sub(" ", declaration.text)) if declaration and element.name == "POU" else None
    return found[1].upper() if found else ""
