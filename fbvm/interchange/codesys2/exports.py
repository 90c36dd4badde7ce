"""Exports of CODESYS 2.3 and TwinCAT 2 as text: their POUs, types and global variables are Structured Text already.

What else is in them, such as alarms, windows, modules and the list of libraries, becomes blanks, so that lines and columns stay
those of the file.  So do diagrams, each with an error."""

from __future__ import annotations

import re

from fbvm.base.diagnostics import Diagnostic, Source

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
    for body in _BODY.finditer(text):
        found = _END_OF_POU.search(text, body.end())
        end = found.start() if found else len(text)
        if text[body.end():end].strip():
            said.append(_refused(source, text, body.start(), body[1]))
        text = text[:body.start()] + _blank(text[body.start():end]) + text[end:]
    return Source(source.name, text, source.library), said


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


def _refused(source: Source, text: str, at: int, language: str) -> Diagnostic:
    heads = list(_HEAD.finditer(text, 0, at))
    name = f"{heads[-1][1]} {heads[-1][2]}" if heads else "this"
    return Diagnostic("X0203", source, at, text.find("\n", at) if "\n" in text[at:] else len(text),
                      f"the body of {name} is a diagram ({language}), which is not read from an export as text",
                      "open the project in CODESYS 3 and export it as PLCopen XML, or write the body as Structured Text")


def _blank(text: str) -> str:
    """Blanks in place of all but the ends of lines."""
    return re.sub(r"[^\r\n]", " ", text)
