"""Mutation operators of rungs, written as instructions or drawn, as changes of the source text.

CONTACT open for closed, COIL another output instruction, EDGE a differentiated instruction without its edge, RDL a rung left
out, SDL one of several outputs left out; and as in Structured Text: VRO an operand replaced by another one of its type, or of
its area, CRO a constant, ROR and ARO relations and arithmetic, LRO series for parallel, TRO the type of a block."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TypeAlias

from fbvm.base.types import fold
from fbvm.campaign.mutation import drawn
from fbvm.campaign.mutation.charts_and_lists import Replacement, Table
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set
from fbvm.syntax.ladder.mnemonics import Line, RungText, is_input, read_rungs
from fbvm.syntax.tree.ladder import Ladder

BLOCKS: Table = {"TON": ("TOF", "TP"), "TOF": ("TON",), "TP": ("TON",), "R_TRIG": ("F_TRIG",), "F_TRIG": ("R_TRIG",),
                 "RS": ("SR",), "SR": ("RS",), "CTU": ("CTD",), "CTD": ("CTU",)}  # fmt: skip
"""Standard blocks and those that are taken for them by mistake."""
CYCLE_MS = 10
"""By how much times are changed: one scan of the usual cycle."""

_NEGATED = {"LD": "LDNOT", "AND": "ANDNOT", "OR": "ORNOT"} | {"LDNOT": "LD", "ANDNOT": "AND", "ORNOT": "OR"}
"""Contacts: normally open for normally closed (W474 3-3)."""
_OUTPUTS = {"OUT": "OUTNOT", "OUTNOT": "OUT", "SET": "OUT", "RSET": "SET", "DIFU": "DIFD", "DIFD": "DIFU"}
"""Output instructions: a coil negated, a coil that holds for one that does not, set for reset, the other edge (W474 3-4)."""
_JOINED = {"AND": "OR", "OR": "AND", "ANDNOT": "ORNOT", "ORNOT": "ANDNOT", "ANDLD": "ORLD", "ORLD": "ANDLD"}
"""A contact or a block in series for one in parallel."""
_RELATIONS: Table = {"<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "=": ("<>",), "<>": ("=",)}
_RELATION = re.compile(r"(LD|AND|OR)([<>=]{1,2})(\w*\$?)")
_ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "++": "--", "--": "++"}
_CALCULATION = re.compile(r"(\+\+|--|[-+*/])(\w*)")

_CODE = re.compile(r"\(\d{1,3}\)")
_PIN = re.compile(r":=|=>")
_ADDRESS = re.compile(r"([A-Za-z]*)\d+(\.\d+)?")
_DIGITS = re.compile(r"([#&])([0-9A-Fa-f]+)")
_TIME = re.compile(r"(T(?:IME)?#)(\d+)(ms|s)", re.I)
_NUMBERS = "ntcm"
"""Letters of operands that are numbers of something, not values or places (`grammar/mnemonics.txt`)."""


Specs: TypeAlias = Mapping[str, tuple[int, int]]
"""Where the types of the variables of a POU stand in its text, by names as they are declared."""


def of_ladder(text: str, node: Ladder, specs: Specs) -> Iterator[Replacement]:
    """The changes of a LADDER, in a POU with these variables."""
    first, last = text.index("\n", node.start) + 1, text.rfind("\n", 0, node.end) + 1
    rungs = read_rungs(text, first, max(first, last), lambda *said: None)
    ladder = _Ladder(text, specs, rungs)
    for start, behind in pairwise([*(each.start for each in rungs), node.end - len(text[last : node.end].lstrip())]):
        yield "RDL", start, behind, ""
    for rung in rungs:
        outputs = [line for line in rung.lines if not is_input(line.row)]
        for line in rung.lines:
            if line.step.start == line.step.end:  # it is not drawn, and joins what others have drawn
                continue
            yield from _of_drawn(text, line) if rung.picture else _of_written(text, line)
            yield from ladder.of_operands(line, rung.picture is not None)
            if len(outputs) > 1 and line in outputs and not rung.picture:
                yield "SDL", line.step.start, line.step.end, ""


def called(node: Ladder) -> set[str]:
    """The instances that a LADDER calls; their types stand in the calls, too."""
    steps = (step for rung in node.rungs for step in rung.steps)
    return {fold(step.operands[1]) for step in steps if instruction_set().rows[step.mnemonic].does == ".call"}


# --- instructions -----------------------------------------------------------------------------------------------------


def _of_written(text: str, line: Line) -> Iterator[Replacement]:
    """An instruction in writing: another mnemonic, or no edge."""
    step = line.step
    at = step.start + len(step.prefix)
    found = instruction_set().pattern.match(text, at)
    if not found:
        return
    code = _CODE.match(text, found.end())
    for operator, new in _others(step.mnemonic):
        yield operator, at, code.end() if code else found.end(), new
    yield from _without_edge(step.start, step.prefix)


def _without_edge(start: int, prefix: str) -> Iterator[Replacement]:
    at = next((at for at, sign in enumerate(prefix) if sign in "@%"), None)
    if at is not None:
        yield "EDGE", start + at, start + at + 1, ""


def _others(mnemonic: str) -> Iterator[tuple[str, str]]:
    """The operators and the instructions that are taken for an instruction by mistake."""
    for operator, table in (("CONTACT", _NEGATED), ("COIL", _OUTPUTS), ("LRO", _JOINED)):
        if mnemonic in table:
            yield operator, table[mnemonic]
    if compared := _RELATION.fullmatch(mnemonic):
        join, relation, rest = compared.groups()
        yield from (("ROR", f"{join}{new}{rest}") for new in _RELATIONS.get(relation, ()))
        yield from (("LRO", f"{_JOINED[join]}{relation}{rest}") for _ in range(join in _JOINED))
    calculated = _CALCULATION.fullmatch(mnemonic)
    if calculated and (new := _ARITHMETIC[calculated[1]] + calculated[2]) in instruction_set().rows:
        yield "ARO", new


# --- drawings ---------------------------------------------------------------------------------------------------------


def _of_drawn(text: str, line: Line) -> Iterator[Replacement]:
    """A contact or a coil with another mark, or the instruction of a box."""
    step = line.step
    element, written = (step.start, step.end), text[step.start : step.end]
    if written[0] in drawn.STROKES:
        inside = next((text[start:end] for start, end in line.places if step.start < start < step.end), "")
        changed = [*drawn.marks(written, inside)]
        if compared := _RELATION.fullmatch(step.mnemonic):
            changed = [("ROR", f"{step.prefix}{new}{compared[3]}") for new in _RELATIONS.get(compared[2], ())]
        pieces = [(operator, drawn.mark(text, element, inside, new)) for operator, new in changed]
    else:
        at = step.end - len(written.lstrip())
        end = at + len(step.prefix + step.mnemonic)
        if text[at:end].upper() != step.prefix + step.mnemonic:
            return
        pieces = [(operator, drawn.fitted(text, at, end, step.prefix + new, " ")) for operator, new in _others(step.mnemonic)]
        if (bare := step.prefix.strip("@%")) != step.prefix:
            pieces.append(("EDGE", drawn.fitted(text, at, end, bare + step.mnemonic, " ")))
    yield from ((operator, *piece) for operator, piece in pieces if piece)


# --- operands ---------------------------------------------------------------------------------------------------------


class _Ladder:
    """The operands of a LADDER: for each the next one of the same kind, and for the last the first."""

    def __init__(self, text: str, specs: Specs, rungs: Sequence[RungText]) -> None:
        self._text, self._specs = text, {fold(name): place for name, place in specs.items()}
        symbols = {symbol.name: symbol.type for rung in rungs for symbol in rung.symbols if symbol.name}
        kinds: dict[str, list[str]] = {}
        for name, type_ in (symbols | {name: fold(text[slice(*place)]) for name, place in specs.items()}).items():
            kinds.setdefault(type_, []).append(name)
        for operand in dict.fromkeys(_addresses(rungs)):
            kinds.setdefault(_kind(operand), []).append(operand)
        self._next = {fold(each): (names * 2)[number + 1] for names in kinds.values() if len(names) > 1
                      for number, each in enumerate(names)}  # fmt: skip

    def of_operands(self, line: Line, is_drawn: bool) -> Iterator[Replacement]:
        """The operands of an instruction, each replaced by others."""
        text, element = self._text, (line.step.start, line.step.end)
        lettered = [*_lettered(line)]
        places = [(end - len(value), end) for (_, value), (_, end) in zip(lettered, line.places, strict=False)]
        for number, ((letter, value), (start, end)) in enumerate(zip(lettered, places, strict=True)):
            if letter in _NUMBERS or not value or text[start:end] != value:
                continue
            changed = [("VRO", self._next[fold(value)])] if fold(value) in self._next else []
            changed += [("CRO", new) for new in _values(value)]
            for operator, new in changed:
                piece = drawn.operand(text, places, number, element, new) if is_drawn else drawn.Piece(start, end, new)
                if piece:
                    yield operator, *piece
        if line.row.does == ".call":
            yield from self._types(line, places[0], is_drawn)

    def _types(self, line: Line, place: tuple[int, int], is_drawn: bool) -> Iterator[Replacement]:
        """A call of another block: its declaration, if there is one, and what stands between the two are part of the change."""
        text, (start, end) = self._text, place
        spec = self._specs.get(fold(line.step.operands[1]))
        for new in BLOCKS.get(text[start:end].upper(), ()):
            piece = drawn.fitted(text, start, end, new, drawn.WIRE + " ") if is_drawn else drawn.Piece(start, end, new)
            if piece and not spec:
                yield "TRO", *piece
            elif piece and spec and spec[1] <= piece.start:
                yield "TRO", spec[0], piece.end, new + text[spec[1] : piece.start] + piece.text


def _addresses(rungs: Sequence[RungText]) -> Iterator[str]:
    """The addresses that rungs name, in their order."""
    for line in (line for rung in rungs for line in rung.lines):
        for letter, operand in _lettered(line):
            if letter not in _NUMBERS and _kind(operand):
                yield operand


def _kind(address: str) -> str:
    """The area of an address, which need not be written for CIO, and whether it is that of a bit; "" for what is none."""
    found = _ADDRESS.fullmatch(address)
    return f"{found[1].upper().removeprefix('CIO')} {'bit' if found[2] else 'word'}" if found else ""


def _lettered(line: Line) -> Iterator[tuple[str, str]]:
    """The operands of an instruction with the letters of their kinds; of the call of a block with "v", without their pins."""
    if line.row.does == ".call":
        return (("v", _PIN.split(operand, maxsplit=1)[-1]) for operand in line.step.operands)
    return zip(line.row.operands, line.step.operands, strict=False)


def _values(constant: str) -> Iterator[str]:
    """Other values for a constant: a number one more or less, `#` with as many digits, a time a cycle longer or shorter."""
    if digits := _DIGITS.fullmatch(constant):
        is_decimal, size = digits[2].isdecimal(), len(digits[2]) * (digits[1] == "#")
        value = int(digits[2], 10 if is_decimal else 16)
        made = (f"{new:0{size}{'d' if is_decimal else 'X'}}" for new in (value + 1, value - 1) if new >= 0)
        yield from (digits[1] + new for new in made if len(new) == size or not size)
    elif time := _TIME.fullmatch(constant):
        milliseconds = int(time[2]) * (1 if time[3].lower() == "ms" else 1000)
        yield from (f"{time[1]}{new}ms" for new in (milliseconds + CYCLE_MS, milliseconds - CYCLE_MS) if new >= 0)
    elif constant.upper() in ("TRUE", "FALSE"):
        yield "FALSE" if constant.upper() == "TRUE" else "TRUE"
