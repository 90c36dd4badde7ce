"""Exports of CODESYS 2.3 and TwinCAT 2 as text: their POUs, types and global variables are Structured Text already.

What else is in them, such as alarms, windows, modules and the list of libraries, becomes blanks, so that lines and columns stay
those of the file.  Ladder and FBD become rungs and statements on the lines of their networks; other diagrams become blanks, each
with an error."""

from __future__ import annotations

import re
from functools import cache

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
_STRUCTURE = re.compile(r"(?m)^[ \t]*(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE|VAR_GLOBAL|VAR_CONFIG|ACTION)\b")


def as_source(source: Source) -> tuple[Source, list[Diagnostic]]:
    """The program in an export, at its lines and columns, and what is said about the rest."""
    text, said = source.text, []
    for start, end, word in _settings(text):
        said += _tasks(source, start, end) if word == "RESOURCE" else []
        text = text[:start] + _blank(text[start:end]) + text[end:]
    bodies = []
    for body in _BODY.finditer(text):
        found = _END_OF_POU.search(text, body.end())
        bodies.append((body, found.start() if found else len(text)))
    declared = text
    for body, end in bodies:
        declared = declared[:body.start()] + _blank(declared[body.start():end]) + declared[end:]
    pins = _pins(declared)
    made = text
    for body, end in reversed(bodies):
        lines: list[str] = []
        if text[body.end():end].strip():
            try:
                lines = _lines(text, body, end, pins)
            except Unreadable as refusal:
                said.append(_refused(source, text, body, *refusal.args))
        kept = _blank(text[body.start():end])
        made = made[:body.start()] + ("\n".join(lines) + "\n" if lines else kept) + made[end:]
    return Source(source.name, made, source.library), sorted(said, key=Diagnostic.order)


def _lines(text: str, body: re.Match[str], end: int, pins: Pins) -> list[str]:
    """The lines in place of a diagram, each network at the line where it begins.  Raises Unreadable."""
    if body[1] not in ("LD", "FBD"):
        raise Unreadable(body.start(), "only ladder and FBD are read")
    writer, first = Writer(pins), text.count("\n", 0, body.start())
    lines = [""]
    for number, network in enumerate(networks(text, body.end(), end), 1):
        lines += [""] * (text.count("\n", 0, network.start) - first - len(lines)) + writer.network(number, network)
    if writer.power:
        kind = (_owner(text, body.start()) or ("", ""))[0]
        if kind == "ACTION":
            raise Unreadable(body.start(), "an action has no variables, and this one needs some for the power of boxes with EN")
        lines[0] = f"VAR{'' if kind == 'FUNCTION' else '_TEMP'} {', '.join(writer.power)} : BOOL; END_VAR"
    return lines + [""] * (text.count("\n", 0, end) - first - len(lines))


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
    for found in _SETTINGS.finditer(text):
        word = found["word"] or found["plc"]
        last = "PLC_END" if found["plc"] else _ENDS.get(word, f"_END{word}")
        ends = re.compile(rf"(?m)^[ \t]*{last}\b.*").search(text, found.end())
        if (parts and found.start() < parts[-1][1]) or _within_program(text, found.start()):
            continue
        parts.append((found.start(), ends.end() if ends else len(text), word))
    return parts


def _within_program(text: str, at: int) -> bool:
    """Whether a place lies in a POU, a type or a list of variables."""
    opened = max((found.start() for found in _STRUCTURE.finditer(text, 0, at)), default=-1)
    closed = max((found.start() for found in re.finditer(r"(?m)^[ \t]*END_(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|TYPE|VAR|ACTION)\b",
                                                         text[:at])), default=-1)
    return opened > closed


def _tasks(source: Source, start: int, end: int) -> list[Diagnostic]:
    return [Diagnostic("X0190", source, start + found.start(1), start + found.end(1),
                       f"the task {found[1]} is not taken over",
                       "a CONFIGURATION with a TASK says when a PROGRAM runs; without one it runs in each scan")
            for found in _TASK.finditer(source.text[start:end])]


def _owner(text: str, at: int) -> tuple[str, str] | None:
    """The kind and name of the POU or action whose body stands at an offset."""
    heads = list(_HEAD.finditer(text, 0, at))
    return (heads[-1][1], heads[-1][2]) if heads else None


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
