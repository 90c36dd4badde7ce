"""What sources hold, as those compare it who look for differences: rungs by section, declared symbols, all else as text."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.syntax import tree
from fbvm.syntax.ladder.mnemonics import Line, RungText, read_rungs
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.ladder import Ladder

_OWN = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT")
"""Sections of what a POU declares itself."""
_COMMENT = re.compile(r"[ \t]*;?[ \t]*//[ \t]*([^\r\n]*?)[ \t]*(?=\r?\n|$)")


@dataclass(frozen=True)
class WrittenStep:
    """An instruction as statement lists have it, and the comment behind it."""

    prefix: str
    mnemonic: str
    code: str
    operands: tuple[str, ...]
    remark: str

    @property
    def text(self) -> str:
        """The instruction without its operands."""
        return self.prefix + self.mnemonic + (f"({self.code})" if self.code else "")

    @property
    def is_call(self) -> bool:
        """Whether it calls a function block, which statement lists cannot say."""
        return self.mnemonic == "FBCALL"


@dataclass(frozen=True)
class WrittenRung:
    """A rung: comment lines and steps.  Rungs are equal if they say the same; `at` is their place in the source."""

    comment: tuple[str, ...]
    steps: tuple[WrittenStep, ...]
    at: int = field(compare=False)


@dataclass(frozen=True)
class Declared:
    """A variable: its name, address and type as they are written, and the comment behind it."""

    name: str
    address: str
    type: str
    comment: str
    at: int = field(compare=False)


@dataclass
class Program:
    """A PROGRAM or FUNCTION_BLOCK with a LADDER: its sections by name in the order of writing, and what it declares."""

    source: Source
    name: str
    at: int
    kind: str = "PROGRAM"
    sections: dict[str, list[WrittenRung]] = field(default_factory=dict)
    declared: dict[str, Declared] = field(default_factory=dict)


@dataclass
class Contents:
    """All that sources hold: programs with rungs, other POUs with rungs, global symbols, and all POUs but these programs with
    their text."""

    programs: dict[str, Program] = field(default_factory=dict)
    blocks: dict[str, Program] = field(default_factory=dict)
    symbols: dict[str, tuple[Source, Declared]] = field(default_factory=dict)
    others: dict[str, tuple[Source, int, str]] = field(default_factory=dict)
    addresses: dict[str, str] = field(default_factory=dict)
    """Comments of addresses that have no name, from rows of tables of symbols."""
    diagnostics: list[Diagnostic] = field(default_factory=list)


def contents(sources: Iterable[Source]) -> Contents:
    """What sources hold; with errors in `diagnostics` if one cannot be read."""
    made = Contents()
    for source in sources:
        text, diagnostics = parse(source)
        made.diagnostics += errors(diagnostics)
        for part in text.everything():
            if isinstance(part, tree.GlobalVars) and not _is_constant(part.section):
                made.symbols.update((name.casefold(), (source, one)) for name, one in _declared(source, part.section).items())
            elif isinstance(part, tree.Pou) and part.kind == "PROGRAM" and any(isinstance(one, Ladder) for one in part.body):
                made.programs[part.name.text.casefold()] = _program(source, part, made.addresses)
            elif isinstance(part, tree.Pou):
                if any(isinstance(one, Ladder) for one in part.body):
                    made.blocks[part.name.text.casefold()] = _program(source, part, made.addresses)
                words = re.sub(r"\s+", " ", source.text[part.start:part.end])
                made.others[part.name.text.casefold()] = source, part.start, words
    return made


def _is_constant(section: tree.VarSection) -> bool:
    """Whether a section declares numbers, which an export leaves alone."""
    return any(word.text.upper() == "CONSTANT" for word in section.qualifiers)


def _declared(source: Source, section: tree.VarSection) -> dict[str, Declared]:
    found: dict[str, Declared] = {}
    for variable in section.variables:
        comment = _COMMENT.match(source.text, variable.end)
        address = variable.location.text if variable.location is not None else ""
        kind = " ".join(source.text[variable.spec.start:variable.spec.end].split()) if variable.spec is not None else ""
        for name in variable.names:
            found[name.text] = Declared(name.text, address, kind, comment[1] if comment else "", name.start)
    return found


def _program(source: Source, pou: tree.Pou, addresses: dict[str, str]) -> Program:
    made = Program(source, pou.name.text, pou.name.start, pou.kind)
    for section in pou.sections:
        if section.kind in _OWN and not section.hidden and not _is_constant(section):
            made.declared.update((name.casefold(), one) for name, one in _declared(source, section).items())
    for ladder in pou.body:
        if isinstance(ladder, Ladder):
            _add_rungs(made, ladder, addresses)
    return made


def _add_rungs(made: Program, ladder: Ladder, addresses: dict[str, str]) -> None:
    """Adds the rungs of a LADDER to the sections of a POU.  One without a line RUNG belongs to the one before it if others have
    one."""
    text, name = made.source.text, next(reversed(made.sections), "")
    first = text.index("\n", ladder.start) + 1
    last = text.rfind("\n", 0, ladder.end) + 1
    rungs = read_rungs(text, first, max(first, last), lambda *message: None)
    addresses.update((row.address, row.comment) for rung in rungs for row in rung.symbols if not row.name and row.comment)
    numbered = any(rung.declared for rung in rungs)
    for rung in rungs:
        name = " ".join(rung.section.split()[1:]) if rung.section else name
        listed = made.sections.setdefault(name, [])
        written = _rung(rung)
        if numbered and not rung.declared and listed:
            listed[-1] = WrittenRung(listed[-1].comment, listed[-1].steps + written.steps, listed[-1].at)
        elif rung.declared or rung.lines:
            listed.append(written)


def _rung(rung: RungText) -> WrittenRung:
    notes = (note.lstrip("'").strip() for _, note in rung.notes)
    return WrittenRung(tuple(filter(None, (rung.comment, *notes))), tuple(map(_step, rung.lines)), rung.start)


def _step(line: Line) -> WrittenStep:
    return WrittenStep(line.step.prefix, line.step.mnemonic, line.row.code if line.row.code.isdecimal() else "",
                       line.step.operands, line.remark.removeprefix("//").strip())
