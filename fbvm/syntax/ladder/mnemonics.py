"""Text to steps: reads the lines between LADDER and END_LADDER, by the grammar of `grammar/mnemonics.lark`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.drawing.grid import DrawingError
from fbvm.syntax.ladder.drawing.reading import Picture, Placed, is_drawn, read_drawing, remark_of
from fbvm.syntax.ladder.instructions.instruction_set import NO_INSTRUCTIONS, Instruction, instruction_set, meant, spelling
from fbvm.syntax.st.automaton import Automaton, ErrorRecovery
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.tables import tables
from fbvm.syntax.tree.ladder import Step

Report = Callable[..., None]


@dataclass
class Line:
    """An instruction as it was read: its row of the table, its step, and the places of its operands."""

    row: Instruction
    step: Step
    places: list[tuple[int, int]]
    coded: bool = False
    """Whether its function code was written."""
    remark: str = ""
    """The comment behind it."""


class Symbol(NamedTuple):
    """A row of a table of symbols as the programming tool exports it."""

    start: int
    end: int
    name: str
    address: str
    type: str
    comment: str


@dataclass
class RungText:
    """The lines of one rung, with their instructions looked up."""

    start: int
    number: int | None = None
    comment: str = ""
    lines: list[Line] = field(default_factory=list)
    notes: list[tuple[int, str]] = field(default_factory=list)
    declared: bool = False
    """Whether a line RUNG began it."""
    damaged: bool = False
    """Whether a line of it could not be read."""
    picture: Picture | None = None
    """What its drawing has besides instructions, if it is drawn."""
    section: str = ""
    """The line SECTION in front of it."""
    symbols: list[Symbol] = field(default_factory=list)
    """Rows of a table of symbols in front of it."""
    is_guessed: bool = False
    """Whether it begins only because an instruction at the bus bar follows an output."""

    @property
    def is_continued(self) -> bool:
        """Whether its blocks are too few for another AND LD or OR LD, so that it belongs to the rung before."""
        return self.is_guessed and not self.declared and bool(self.lines) and blocks(self.lines) < 2

    @property
    def is_empty(self) -> bool:
        """Whether no line of it has been read yet."""
        return not (self.lines or self.declared or self.notes or self.section or self.symbols)

    @property
    def may_end(self) -> bool:
        """Whether an instruction at the bus bar begins another rung; the conditions of a damaged rung are not known."""
        return closes(self.lines) or self.damaged and not is_input(self.lines[-1].row)

    @property
    def missing(self) -> int:
        """How many operands the last instruction has less than it takes."""
        if not self.lines or self.lines[-1].row.does == ".call":
            return 0
        return max(self.lines[-1].row.least - len(self.lines[-1].step.operands), 0)


ALONE = (".end", ".jump_end", ".for", ".next", ".step", ".subroutine", ".return", ".loop")
"""Instructions that begin or end more than a rung, and are therefore rungs of their own, whatever a line RUNG says."""
LAST = (*ALONE, ".loop_end")
"""Instructions behind which another rung begins."""
INSIDE = (".block_end", ".if", ".else", ".if_end", ".wait", ".exit")
"""Instructions at the bus bar that go on with a rung, in the lines of a block program."""


class Refusal(Exception):
    """A line cannot be read; the arguments are start, end, message and hint."""


@cache
def _patterns() -> dict[str, re.Pattern[str]]:
    return {t.name: re.compile(t.pattern, re.I if t.ignore_case else 0) for t in tables("mnemonics").terminals}


def read_rungs(text: str, start: int, end: int, report: Report) -> list[RungText]:
    """The rungs of the lines in `text[start:end]`; what cannot be read has a diagnostic and is left out.

    Where no line RUNG says so, a rung begins with a drawing, and with an instruction at the bus bar that follows an
    output."""
    rungs = [RungText(start)]
    for lines in _groups(text, start, end):
        if is_drawn([line for _, line in lines]):
            _read_drawing(rungs, lines, report)
            continue
        for at, line in lines:
            try:
                tokens = _tokens(text, at, at + len(line), rungs[-1].missing)
                Automaton(_LineReader(text, rungs), tokens, text, "mnemonics").run(_stuck)
            except Refusal as refusal:
                report("S0109", *refusal.args)
                rungs[-1].damaged = True
    return [rung for rung in rungs if not rung.is_empty]


APART = ("RUNG", "NOTE", "REMARK", "SECTION", "SYMBOL")
"""Terminals of lines that belong to no drawing."""


def _groups(text: str, start: int, end: int) -> Iterator[list[tuple[int, str]]]:
    """Lines that belong together, with their offsets: up to an empty line, a comment, or RUNG."""
    patterns, group = _patterns(), []  # type: dict[str, re.Pattern[str]], list[tuple[int, str]]
    for line in text[start:end].splitlines(keepends=True):
        bare = line.strip()
        if not bare or any(patterns[kind].match(bare) for kind in APART):
            yield from filter(None, (group, [(start, line.rstrip("\r\n"))]))
            group = []
        else:
            group.append((start, line.rstrip("\r\n")))
        start += len(line)
    yield from filter(None, (group,))


def _read_drawing(rungs: list[RungText], lines: list[tuple[int, str]], report: Report) -> None:
    """A rung that is drawn; its comments become notes in front of it."""
    first = lines[0][0] + len(lines[0][1]) - len(lines[0][1].lstrip())
    if rungs[-1].lines or rungs[-1].damaged:
        rungs.append(RungText(first))
    rung = rungs[-1]
    rung.notes += [(0, remark) for _, line in lines if (remark := remark_of(line))]
    try:
        placed, rung.picture = read_drawing([line for _, line in lines], [at for at, _ in lines])
        rung.lines = [_line(one) for one in placed]
    except DrawingError as bad:
        x, y, width, message, hint = bad.args
        start = lines[min(y, len(lines) - 1)][0] + x
        report("S0113", start, start + width, message, hint)
        rung.damaged = True
    except Refusal as refusal:
        report("S0109", *refusal.args)
        rung.damaged = True


def _line(placed: Placed) -> Line:
    """An instruction that was drawn.  Raises Refusal if there is none of that name."""
    prefix, mnemonic, operands, _ = placed.coded
    row = instruction(prefix, mnemonic, placed.start, placed.end)
    return Line(row, Step(placed.start, placed.end, prefix, row.mnemonic, operands), placed.operands)


def instruction(prefix: str, mnemonic: str, start: int, end: int) -> Instruction:
    """The row of the table for an instruction that stands from `start` to `end`.  Raises Refusal."""
    name = spelling(mnemonic)
    row = instruction_set().rows.get(name)
    if row is None:
        near = meant(name)
        advice = "write END_LADDER" if name.startswith("END_LA") else NO_INSTRUCTIONS.get(name, "")
        raise Refusal(start, end, f"`{mnemonic}` is no instruction of this instruction set",
                      advice or (f"did you mean {' or '.join(near)}?" if near else
                                 "an unknown instruction is never left out: say what it does with others"))
    if missing := [sign for sign in prefix if sign not in row.variations]:
        raise Refusal(start, end, f"there is no {missing[0]}{name}",
                      f"{name} has {', '.join(row.variations) or 'no variations'}")
    return row


def _stuck(automaton: Automaton) -> ErrorRecovery:
    before = automaton.before
    if before.text.endswith((":=", "=>")):
        raise Refusal(before.start, before.end, f"the operand behind `{before.text}` is missing",
                      "write a pin as IN:=Start or Q=>Done")
    raise Refusal(before.start, before.end, "this is no instruction", "")


def _step_number(text: str, at: int, end: int) -> Token | None:
    """The number of the step, or of rung and step, in front of an instruction."""
    patterns = _patterns()
    number = patterns["STEP_NUMBER"].match(text, at, end)
    if not number:
        return None
    prefix = patterns["PREFIX"].match(text, number.end(), end)
    is_step = instruction_set().pattern.match(text, prefix.end() if prefix else number.end(), end)
    is_listed = len(number[0].strip()) > 4  # of a printed listing: what follows is meant as an instruction, known or not
    return Token("STEP_NUMBER", number[0], number.start(), number.end()) if is_step or is_listed else None


_COLUMN = re.compile(r" *\t[ \t]*([^ \t\r\n][^\r\n]*?)[ \t\r]*$", re.M)
"""What stands in further columns behind the operands, in rows that were copied from a window: a value, a comment."""


def _wanted(mnemonic: str) -> int | None:
    """The number of operands of an instruction; None if it has any number."""
    row = instruction_set().rows[spelling(mnemonic)]
    return None if row.does == ".call" else len(row.operands)


def _operand_tokens(text: str, at: int, end: int, wanted: int | None, *, columns: bool) -> Iterator[Token]:
    """The operands in a line; with `columns`, what stands in a column behind as many as are `wanted` is a remark."""
    patterns = _patterns()
    while True:
        while at < end and text[at] in " \t":
            at += 1
        kind = next((kind for kind in ("PIN", "OPERAND") if patterns[kind].match(text, at, end)), "")
        if not kind:
            return
        found = patterns[kind].match(text, at, end)
        assert found is not None
        yield Token(kind, found[0], at, found.end())
        at = found.end()
        if kind == "PIN" and (value := patterns["OPERAND"].match(text, at, end)):
            yield Token("OPERAND", value[0], at, value.end())
            at = value.end()
        wanted = wanted and wanted - 1
        if columns and wanted == 0 and (column := _COLUMN.match(text, at, end)):
            yield Token("REMARK", f"// {column[1]}", column.start(1), column.end())
            return


def _tokens(text: str, at: int, end: int, more: int) -> Iterator[Token]:
    """The tokens of one line; which terminal is tried depends on the position in the line.  If the instruction in front wants
    `more` operands, a line without a mnemonic has them."""
    patterns = _patterns()
    bare = text[at:end].lstrip()
    plain = patterns["RUNG"].match(bare) or patterns["SYMBOL"].match(bare) or patterns["SECTION"].match(bare)
    remark = None if plain else patterns["REMARK"].search(text, at, end)
    end = remark.start() if remark else end

    def take(kind: str) -> Token | None:
        nonlocal at
        while at < end and text[at] in " \t":
            at += 1
        found = patterns[kind].match(text, at, end)
        if not found:
            return None
        token = Token(kind, found[0], at, found.end())
        at = found.end()
        return token

    if token := take("NOTE") or take("SYMBOL") or take("SECTION"):
        yield token
    elif token := take("RUNG"):
        yield token
        yield from filter(None, (take("RUNG_NUMBER"), take("RUNG_COMMENT")))
    else:
        begin, number = at, _step_number(text, at, end)
        at = number.end if number else at
        head = [token for token in (number, take("PREFIX")) if token]
        known = instruction_set().pattern.match(text, at, end)
        if known:
            yield from (*head, Token("MNEMONIC", known[0], at, known.end()))
            at = known.end()
        elif more:
            at = begin
        else:
            yield from filter(None, (*head, take("MNEMONIC")))
        yield from filter(None, (take("CODE"),))
        yield from _operand_tokens(text, at, end, _wanted(known[0]) if known else more or None, columns=remark is None)
    if remark:
        yield Token("REMARK", remark[0], remark.start(), remark.end())
    yield Token("$END", "", end, end)


class _LineReader:
    """The functions of the grammar's rules."""

    def __init__(self, text: str, rungs: list[RungText]) -> None:
        self.text, self.rungs = text, rungs

    def empty(self) -> list[Token]:
        return []

    def add(self, operands: list[Token], operand: Token) -> list[Token]:
        operands.append(operand)
        return operands

    def operand(self, token: Token) -> Token:
        return token

    def pin(self, name: Token, value: Token) -> Token:
        return Token("PIN", name.text + value.text, name.start, value.end)

    def nothing(self) -> None:
        """An empty line carries no meaning."""

    def note(self, token: Token) -> None:
        rung = self.rungs[-1]
        rung.notes.append((len(rung.lines), token.text.strip()))

    def section(self, token: Token) -> None:
        self._fresh(token).section = token.text.strip()

    def symbol(self, token: Token) -> None:
        name, address, kind, *rest = token.text.rstrip("; \t\r").split(",")
        comment = ",".join(rest).strip(", ").strip('"')
        self._fresh(token).symbols.append(
            Symbol(token.start, token.end, name, address.strip(), kind.strip().upper(), comment))

    def more(self, operand: Token, operands: list[Token], remark: Token | None) -> None:
        """Operands of the instruction in front, as printed listings have them on lines of their own."""
        rung = self.rungs[-1]
        if not rung.missing:
            raise Refusal(operand.start, operand.end, "this is no instruction", "operands stand behind their instruction")
        line = rung.lines[-1]
        given, step = [operand, *operands], line.step
        line.step = Step(step.start, given[-1].end, step.prefix, step.mnemonic,
                         (*step.operands, *(each.text for each in given)))
        line.places += [(each.start, each.end) for each in given]
        line.remark = line.remark or (remark.text.strip() if remark else "")

    def _fresh(self, token: Token) -> RungText:
        """The rung behind a SECTION or a table of symbols: a new one if the last one has begun."""
        last = self.rungs[-1]
        if last.lines or last.declared or last.notes or last.section:
            self.rungs.append(RungText(token.start))
        return self.rungs[-1]

    def rung(self, word: Token, number: Token | None, comment: Token | None) -> None:
        before = self.rungs[-1]
        if before.lines or before.declared or before.notes:
            before = RungText(word.start)
            self.rungs.append(before)
        before.start, before.declared = word.start, True
        before.number = whole_number(number.text) if number else None
        before.comment = comment.text.strip() if comment else ""

    def step(self, number: Token | None, prefix: Token | None, mnemonic: Token, code: Token | None,
             operands: list[Token], remark: Token | None) -> None:
        written = prefix.text if prefix else ""
        self._refuse_statement(mnemonic, operands)
        name, operands = _with_not(mnemonic.text, operands)
        row = instruction("", name, mnemonic.start, mnemonic.end)
        if code and whole_number(code.text[1:-1]) != int(row.code or 1000):
            raise Refusal(code.start, code.end,
                          f"{row.mnemonic} has the function code {row.code or 'none'}, not {code.text[1:-1]}",
                          "leave the code out, or write the mnemonic that belongs to it")
        instruction(written, name, mnemonic.start - len(written), mnemonic.end)
        operands = _joined(operands, len(row.operands)) if row.does != ".call" else operands
        if not (operands and _is_branch(operands[0].text)):
            self._begin(row, mnemonic)
        if row.does in (".and_block", ".or_block") and self.rungs[-1].is_continued:
            self._go_on()
        step = Step(mnemonic.start - len(written), operands[-1].end if operands else mnemonic.end, written, row.mnemonic,
                    tuple(operand.text for operand in operands))
        rung = self.rungs[-1]
        if not (rung.lines or rung.declared or rung.notes or rung.section or rung.symbols):
            rung.start = step.start  # where its first instruction stands, as that of rungs behind it
        self.rungs[-1].lines.append(Line(row, step, [(o.start, o.end) for o in operands],
                                         code is not None, remark.text.strip() if remark else ""))

    def _refuse_statement(self, mnemonic: Token, operands: list[Token]) -> None:
        """Refuse a line with signs of Structured Text."""
        if operands and operands[0].text.startswith(":="):
            raise Refusal(mnemonic.start, operands[-1].end, "this is a statement of Structured Text",
                          "it stands behind END_LADDER; a rung writes a bit by OUT, a word by MOV")
        for at, operand in enumerate(operands):
            if operand.text.endswith(";") and operand is operands[-1]:
                raise Refusal(operand.end - 1, operand.end, "`;` ends no instruction", "an instruction ends with its line")
            if operand.text.endswith(",") and at + 1 < len(operands) and len(operand.text) > 1:
                raise Refusal(operand.end - 1, operand.end, "`,` separates no operands", "a space stands between them")

    def _go_on(self) -> None:
        """Append the last rung to the one before: a block that AND LD or OR LD joins stands behind its output."""
        behind = self.rungs.pop()
        rung = self.rungs[-1]
        rung.notes += [(len(rung.lines) + at, note) for at, note in behind.notes]
        rung.lines += behind.lines
        rung.damaged |= behind.damaged

    def _begin(self, row: Instruction, mnemonic: Token) -> None:
        """Begin another rung if this instruction does."""
        rung = self.rungs[-1]
        apart = rung.lines and (row.does in ALONE or rung.lines[-1].row.does in LAST)
        begins = row.inputs == 0 and row.does not in INSIDE or rung.lines and rung.lines[-1].row.does in LAST
        if rung.picture or rung.lines and (apart or not rung.declared) and begins and rung.may_end:
            self.rungs.append(RungText(mnemonic.start, is_guessed=not rung.picture and not apart))


def _with_not(mnemonic: str, operands: list[Token]) -> tuple[str, list[Token]]:
    """The mnemonic and the operands of `IF(802) NOT 0.01`, where NOT belongs to the mnemonic."""
    if operands and operands[0].text.upper() == "NOT" and f"{spelling(mnemonic)}NOT" in instruction_set().rows:
        return f"{mnemonic}NOT", operands[1:]
    return mnemonic, operands


def _joined(operands: list[Token], wanted: int) -> list[Token]:
    """The operands, of which there are `wanted`: an area and its number, as in `TIM 000`, are one."""
    made: list[Token] = []
    left = len(operands) - wanted
    for operand in operands:
        before = made[-1] if made else None
        if left > 0 and before and before.text.upper() in ("TIM", "CNT", "HR", "AR", "DM") and _NUMBER.fullmatch(operand.text):
            made[-1] = Token("OPERAND", before.text + operand.text, before.start, operand.end)
            left -= 1
        else:
            made.append(operand)
    return made


_NUMBER = re.compile(r"\d+(?:\.\d+)?")


def is_input(row: Instruction) -> bool:
    """Whether an instruction makes the execution condition and does not use it."""
    return row.kind == "?" or row.does in (".load", ".and", ".or", ".and_block", ".or_block", ".not", ".up", ".down")


def closes(lines: list[Line]) -> bool:
    """Whether a rung may end behind these lines: the last one is an output, and no condition is left over."""
    return not is_input(lines[-1].row) and blocks(lines) <= 1


def blocks(lines: list[Line]) -> int:
    """How many blocks behind these lines are not joined yet, or used by an instruction with several inputs."""
    left = 0
    for line in lines:
        row = line.row
        if row.does == ".load" or row.kind == "?" and row.inputs == 0:
            left += 0 if line.step.operands and _is_branch(line.step.operands[0]) else 1
        elif row.does in (".and_block", ".or_block"):
            left -= 1
        elif row.inputs > 1:
            left -= row.inputs - 1
    return left


def _is_branch(operand: str) -> bool:
    return operand.upper().startswith("TR") and operand[2:].isdecimal()
