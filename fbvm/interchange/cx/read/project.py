"""What a project of CX-Programmer holds, as values: PLCs with symbols, function blocks, programs, sections and rungs."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.digits import whole_number
from fbvm.interchange.cx.markup import CxText, Row, Value
from fbvm.interchange.cx.read.symbols import Symbol, symbols

CYCLIC = range(256, 384)
"""Task numbers of cyclic tasks; interrupt tasks have lower ones."""
LADDER_SECTION = "11"


@dataclass
class Reading:
    """The import of one project: its text, and the diagnostics so far; `where` names the POU and section at work."""

    text: CxText
    diagnostics: list[Diagnostic] = field(default_factory=list)
    where: str = ""

    def report(self, code: str, at: Value | int, message: str, hint: str = "") -> None:
        """A message about a place in the text."""
        start = at if isinstance(at, int) else at.start if at.kind == "block" else at.inner
        end = start + len(self.text.source.text[start:start + 80].split("\n")[0].rstrip())
        said = f"{self.where}: {message}" if self.where else message
        self.diagnostics.append(Diagnostic(code, self.text.source, start, max(end, start), said, hint))


@dataclass(frozen=True)
class Elements:
    """The elements of a rung that is stored as cells: each as written, with its place; `separator` stands between fields."""

    rows: tuple[tuple[str, int], ...]
    separator: str


@dataclass(frozen=True)
class Rung:
    """A rung: its comment, the lines of its statement list with their attached comments, or its elements."""

    value: Value
    comment: str
    lines: tuple[str, ...]
    attached: tuple[str, ...]
    elements: Elements | None

    @property
    def is_empty(self) -> bool:
        """Whether nothing is in it, as in the rung that the tool keeps behind each section."""
        return not (self.comment or self.lines or self.elements)


@dataclass(frozen=True)
class Section:
    """A part of a program's rungs."""

    value: Value
    name: str
    comment: str
    kind: str
    rungs: tuple[Rung, ...]


@dataclass(frozen=True)
class Program:
    """A program; `task` is None where the file gives none."""

    value: Value
    name: str
    comment: str
    task: int | None
    starts: bool
    protected: bool
    symbols: tuple[Symbol, ...]
    sections: tuple[Section, ...]


@dataclass(frozen=True)
class BlockVariable:
    """A row of a function block's variables."""

    row: Row
    usage: str
    name: str
    type: str
    address: str
    count: int
    initial: str
    retain: bool
    comment: str


@dataclass(frozen=True)
class FunctionBlock:
    """A definition; `kind` is that of its body."""

    value: Value
    name: str
    kind: str
    comment: str
    protected: bool
    variables: tuple[BlockVariable, ...]
    rungs: tuple[Rung, ...]


@dataclass(frozen=True)
class Plc:
    """A resource: one PLC with all its programs."""

    value: Value
    name: str
    device: str
    symbols: tuple[Symbol, ...]
    blocks: tuple[FunctionBlock, ...]
    programs: tuple[Program, ...]
    memory: str


def read_plcs(text: CxText) -> list[Plc]:
    """The PLCs of a project."""
    return [_plc(value) for value in text.root.numbered("Resource")]


def _plc(value: Value) -> Plc:
    config = value.string("PLC", "Config")
    words = [found[1] for key in ("DEV", "CPU") if (found := re.search(rf"(?:^|[\];]){key}:([^;\[]+)", config))]
    table = value.get("GlobalVariables", "VariableList")
    blocks = value.get("FunctionBlocks")
    programs = value.get("Programs")
    return Plc(value, value.string("PLC", "Name") or value.string("Name"), " ".join(words),
               tuple(symbols(table.rows if table else ())),
               tuple(_block(one) for one in (blocks.numbered("FunctionBlockWrapper") if blocks else ())),
               tuple(_program(one) for one in (programs.numbered("Program") if programs else ())),
               value.string("PLC", "Memory", "Data"))


def _program(value: Value) -> Program:
    table, sections, task = value.get("LocalVariables", "VariableList"), value.get("Sections"), value.string("TaskID")
    return Program(value, value.string("Name"), value.string("Comment"),
                   whole_number(task) if re.fullmatch(r"-?\d{1,6}", task) else None, value.string("OpStart") == "1",
                   value.string("Protection", "Enabled") == "1", tuple(symbols(table.rows if table else ())),
                   tuple(_section(one) for one in (sections.numbered("Sec") if sections else ())))


def _section(value: Value) -> Section:
    data = value.get("ProgramData")
    return Section(value, value.string("SecName"), value.string("Comment"), value.string("IEC1131Type"),
                   tuple(_rung(one, "\x11") for one in (data.numbered("R") if data else ())))


def _rung(value: Value, separator: str) -> Rung:
    attached = value.get("AtchCmts")
    comments: list[str] = []
    while attached and (found := attached.get(str(len(comments)))):
        comments.append(found.text)
    rows = tuple((one.text, one.inner) for one in value.numbered(""))
    lines = tuple(line.strip() for line in value.string("SL").splitlines() if line.strip())
    return Rung(value, value.string("Com"), tuple(line for line in lines if not re.fullmatch(r"'\s*R0", line)), tuple(comments),
                Elements(rows, separator) if rows else None)


def _block(wrapper: Value) -> FunctionBlock:
    value = wrapper.get("FunctionBlock") or wrapper
    rows, body = value.get("POUHeader", "PouVarList"), value.get("POUBody", "FBProgramData")
    return FunctionBlock(
        value, value.string("Name"), wrapper.string("FBType"), value.string("Comment"),
        value.string("Protection", "Enabled") == "1",
        tuple(_variable(row) for row in (rows.rows if rows else ())),
        tuple(_rung(one, ",") for one in (body.numbered("FBR") if body else ())))


def _variable(row: Row) -> BlockVariable:
    fields = [field.strip() for field in row.fields]
    usage, name, kind, address, count, initial, retain, comment = (*fields[:7], *[""] * (7 - len(fields)), " ".join(
        (fields[7] if len(fields) > 7 else "").split()))
    return BlockVariable(row, usage, name, kind, address, whole_number(count) if count.isdecimal() else 0, initial, retain == "1",
                         comment)
