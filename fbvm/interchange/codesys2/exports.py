"""Exports of CODESYS 2.3 and TwinCAT 2 as text: their POUs, types and global variables are Structured Text already.

What else is in them, such as alarms, windows, modules and the list of libraries, becomes blanks, so that lines and columns stay
those of the file.  Ladder and FBD become rungs and statements on the lines of their networks; other diagrams become blanks, each
with an error."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.codesys2.diagrams import Unreadable, networks
from fbvm.interchange.codesys2.statements import Pins, Writer
from fbvm.interchange.plcopen.read.scope import library_block
from fbvm.syntax import tree
from fbvm.syntax.parser import parse

_SETTINGS = re.compile(
    r"(?m)^[ \t]*(?:(?P<word>_ALARMCONFIG|_WORKSPACE|_MOTION_\w+|LIBRARY|VISUALISATION|RESOURCE)\b|(?P<plc>PLC_CONFIGURATION)\b)")
"""Where a part begins that is no program."""
_ENDS = {"RESOURCE": "END_RESOURCE", "LIBRARY": "END_LIBRARY", "VISUALISATION": "END_VISUALISATION"}
_BODY = re.compile(r"(?m)^[ \t]*_(LD|FBD|CFC|SFC)_BODY\b")
_END_OF_POU = re.compile(r"(?m)^[ \t]*END_(?:PROGRAM|FUNCTION_?BLOCK|FUNCTION|ACTION)\b")
_HEAD = re.compile(r"(?m)^[ \t]*(PROGRAM|FUNCTION_?BLOCK|FUNCTION|ACTION)\s+(\w+)")
_TASK = re.compile(r"(?m)^[ \t]*TASK\s+(\w+)")
_BEGINS = r"FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE|VAR_GLOBAL|VAR_CONFIG|ACTION"
_MARK = re.compile(rf"(?m)^[ \t]*(?:{_BEGINS}|(?P<end>END_(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE|VAR|ACTION)))\b")
"""Where a POU, a type or a list of variables begins or ends."""


def as_source(source: Source) -> tuple[Source, list[Diagnostic]]:
    """The program in an export, at its lines and columns, and what is said about the rest."""
    said: list[Diagnostic] = []
    parts = _settings(source.text)
    for start, end, word in parts:
        said += _tasks(source, start, end) if word == "RESOURCE" else []
    text = _blanked(source.text, [(start, end) for start, end, _ in parts])
    bodies = []
    for body in _BODY.finditer(text):
        found = _END_OF_POU.search(text, body.end())
        bodies.append((body, found.start() if found else len(text)))
    places = [(body.start(), end) for body, end in bodies]
    pins = _pins(_blanked(text, places))
    drawn: dict[int, str] = {}
    for body, end in bodies:
        if text[body.end():end].strip():
            try:
                drawn[body.start()] = "\n".join(_lines(source, text, body, end, pins)) + "\n"
            except Unreadable as refusal:
                said.append(_refused(source, text, body, *refusal.args))
    return Source(source.name, _blanked(text, places, drawn), source.library), sorted(said, key=Diagnostic.order)


def _blanked(text: str, places: Sequence[tuple[int, int]], instead: Mapping[int, str] | None = None) -> str:
    """The text with blanks at places that follow each other, or with what stands there `instead`, by where it begins."""
    kept, at = [], 0
    for start, end in places:
        kept += [text[at:max(start, at)], (instead or {}).get(start) or _blank(text[max(start, at):end])]
        at = max(end, at)
    return "".join((*kept, text[at:]))


def _lines(source: Source, text: str, body: re.Match[str], end: int, pins: Pins) -> list[str]:
    """The lines in place of a diagram, each network at the line where it begins.  Raises Unreadable."""
    if body[1] not in ("LD", "FBD"):
        raise Unreadable(body.start(), "only ladder and FBD are read")
    writer, first = Writer(pins), source.place(body.start())[0]
    lines = [""]
    for number, network in enumerate(networks(text, body.end(), end), 1):
        lines += [""] * (source.place(network.start)[0] - first - len(lines)) + writer.network(number, network)
    if writer.power:
        kind = (_owner(text, body.start()) or ("", ""))[0]
        if kind == "ACTION":
            raise Unreadable(body.start(), "an action has no variables, and this one needs some for the power of boxes with EN")
        lines[0] = f"VAR{'' if kind == 'FUNCTION' else '_TEMP'} {', '.join(writer.power)} : BOOL; END_VAR"
    return lines + [""] * (source.place(end)[0] - first - len(lines))


def _pins(declared: str) -> Pins:
    """The inputs and outputs of the blocks of an export, whose bodies are blank in the text, and of libraries."""
    @cache
    def pous() -> dict[str, tree.Pou]:
        return {pou.name.text.upper(): pou for pou in parse(Source("", declared))[0].everything() if isinstance(pou, tree.Pou)}

    def pins(name: str) -> tuple[list[str], list[str]] | None:
        found = library_block(name.upper())
        pou = pous().get(name.upper(), found[1] if found else None)
        inputs, outputs = ([variable.text for section in pou.sections if section.kind in kinds for declared in section.variables
                            for variable in declared.names] if pou else []
                           for kinds in (("VAR_INPUT", "VAR_IN_OUT"), ("VAR_OUTPUT",)))
        return (inputs, outputs) if pou else None

    return pins


def _settings(text: str) -> list[tuple[int, int, str]]:
    """The parts that are no program: from, to, and the first word."""
    parts: list[tuple[int, int, str]] = []
    marks, opened, at = _MARK.finditer(text), False, 0
    mark = next(marks, None)
    for found in _SETTINGS.finditer(text):
        while mark is not None and mark.start() < found.start():
            opened, mark = mark["end"] is None, next(marks, None)
        if found.start() < at or opened:
            continue
        word = found["word"] or found["plc"]
        last = "PLC_END" if found["plc"] else _ENDS.get(word, f"_END{word}")
        ends = _end_of(last).search(text, found.end())
        at = ends.end() if ends else len(text)
        parts.append((found.start(), at, word))
    return parts


@cache
def _end_of(last: str) -> re.Pattern[str]:
    return re.compile(rf"(?m)^[ \t]*{last}\b.*")


def _tasks(source: Source, start: int, end: int) -> list[Diagnostic]:
    return [Diagnostic("X0190", source, start + found.start(1), start + found.end(1),
                       f"the task {found[1]} is not taken over",
                       "a CONFIGURATION with a TASK says when a PROGRAM runs; without one it runs in each scan")
            for found in _TASK.finditer(source.text[start:end])]


def _owner(text: str, at: int) -> tuple[str, str] | None:
    """The kind and name of the POU or action whose body stands at an offset."""
    heads = _heads(text)
    found = bisect_left(heads, at, key=lambda head: head.end())
    return (heads[found - 1][1], heads[found - 1][2]) if found else None


@lru_cache(maxsize=1)
def _heads(text: str) -> list[re.Match[str]]:
    return list(_HEAD.finditer(text))


def _refused(source: Source, text: str, body: re.Match[str], at: int, why: str) -> Diagnostic:
    """The message that a diagram is not read, at what keeps it from that."""
    name = " ".join(_owner(text, body.start()) or ("this",))
    end = text.find("\n", at)
    return Diagnostic("X0203", source, at, end if end > at else len(text),
                      f"the body of {name} is a diagram ({body[1]}), which is not read from an export as text: {why}",
                      "open the project in CODESYS 3 and export it as PLCopen XML, or write the body as Structured Text")


def _blank(text: str) -> str:
    """Blanks in place of all but the ends of lines."""
    return re.sub(r"[^\r\n]", " ", text)
