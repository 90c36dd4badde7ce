"""What an editor shows when the pointer rests on a place: the name, the address or the instruction that stands there."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fbvm.analysis import describe
from fbvm.analysis.declarations import find
from fbvm.analysis.program import Program
from fbvm.analysis.references import use_at
from fbvm.base.areas import AREAS, Address, AddressError, parse_address
from fbvm.base.pages import page
from fbvm.base.types import fold
from fbvm.check import block_pages, instructions
from fbvm.check.symbols.facts import Variable
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

_WORD = re.compile(r"[@%!]*[\w.]+(?:\(\d+\))?")


@dataclass(frozen=True)
class Hover:
    """A text in Markdown about a piece of a file, in characters from 0."""

    start: int
    end: int
    markdown: str


def hover(program: Program, name: str, offset: int) -> Hover | None:
    """What is known about a place of a file, with the pages of the diagnostics there; None if nothing is."""
    known = _name(program, name, offset) or _address(program, name, offset) or _instruction(program, name, offset)
    wrong = [each for each in program.diagnostics(name) if each.start <= offset < max(each.end, each.start + 1)]
    if not wrong:
        return known
    pages = [page(code).partition("\n## See also")[0].rstrip() for code in dict.fromkeys(each.code for each in wrong)]
    start, end = (known.start, known.end) if known is not None else (wrong[0].start, wrong[0].end)
    return Hover(start, end, "\n\n---\n\n".join([*([known.markdown] if known is not None else []), *pages]))


def hover_of_word(program: Program, text: str, offset: int) -> Hover | None:
    """What is known about a word of a text that is no source of the program: an address, a global name, an instruction."""
    found = next((each for each in _WORD.finditer(text) if each.start() <= offset <= each.end()), None)
    if found is None or program.checked is None:
        return None
    word, checker = found[0], program.checked.checker
    known = _described(program, word)
    for key in (("global", "", fold(word)), ("pou", "", fold(word)), ("type", "", fold(word))) if not known else ():
        declared = find(checker, key)
        known = describe.markdown(declared) if declared is not None else known
    known = known or _page(word)
    return Hover(found.start(), found.end(), known) if known else None


def _name(program: Program, name: str, offset: int) -> Hover | None:
    used = use_at(program, name, offset)
    if used is None or program.checked is None:
        return None
    part, use = used
    declared = find(program.checked.checker, use.key)
    text = describe.markdown(declared) if declared is not None else describe.standard(use.key[2])
    return Hover(part.base + use.start, part.base + use.end, text)


def _address(program: Program, name: str, offset: int) -> Hover | None:
    part = program.files[name].part_at(offset)
    at = offset - part.base
    for node in part.nodes:
        if isinstance(node, tree.Direct | tree.Location) and node.start <= at <= node.end:
            text = _described(program, node.text)
            return Hover(part.base + node.start, part.base + node.end, text) if text else None
    return None


def _described(program: Program, text: str) -> str:
    """What is known of an address, as Markdown; "" for a text that is none."""
    meant = _meant(program, text)
    return "" if meant is None else describe.address(meant, [describe.variable(each) for each in located(program, text)])


def located(program: Program, text: str) -> list[Variable]:
    """The variables that are declared at an address."""
    meant = _meant(program, text)
    return [each for each in all_located(program) if each.location == meant] if meant is not None else []


def _meant(program: Program, text: str) -> Address | None:
    """The address that a text names in the dialect of a program; None for a text that is none."""
    try:
        return parse_address(text, program.checked.checker.areas if program.checked is not None else AREAS)
    except AddressError:
        return None


def all_located(program: Program) -> list[Variable]:
    """All variables of the program's files that are declared at an address."""
    if program.checked is None:
        return []
    project = program.checked.project
    variables = [*project.globals.values(), *(each for pou in project.pous.values() for each in pou.order)]
    return [each for each in dict.fromkeys(variables) if each.location is not None and not each.source.library]


def _instruction(program: Program, name: str, offset: int) -> Hover | None:
    """The page of an instruction of ladder."""
    part = program.files[name].part_at(offset)
    at = offset - part.base
    inside = any(isinstance(node, ladder.Ladder) and node.start <= at <= node.end for node in part.nodes)
    word = next((found for found in _WORD.finditer(part.source.text) if found.start() <= at <= found.end()), None)
    if not inside or word is None:
        return None
    text = _page(word[0])
    return Hover(part.base + word.start(), part.base + word.end(), text) if text else None


def _page(word: str) -> str:
    """The page of an instruction or of a block; "" for other words, and for digits: a number is not meant as a function code."""
    row = instructions.find(word) if not word.isdecimal() else None
    return f"```\n{instructions.page(row)}\n```" if row is not None else block_pages.page(word) or ""
