"""Lines of an instruction list: label, operator, operands, as tokens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from fbvm.syntax.il.operators import OPERATORS
from fbvm.syntax.st.lexer import Lexer, Token


@dataclass
class Instruction:
    """One instruction from `start` to `end`; a line with only a label has no `word`.

    `name` is the operator in capitals or the name of a function; `opens` if its operand is a list in brackets."""

    start: int
    end: int
    label: Token | None = None
    word: Token | None = None
    name: str = ""
    opens: bool = False
    operands: list[Token] = field(default_factory=list)


def read_instructions(text: str, start: int, end: int, report: Callable[..., None]) -> list[Instruction]:
    """The instructions of a piece of a text.  A line end ends an instruction unless a bracket of its operands is open."""
    return [_instruction(line) for line in instruction_tokens(text, start, end, report)]


def tokens_of(text: str, start: int, end: int, report: Callable[..., None]) -> list[Token]:
    """The tokens of a piece of a text, which is an instruction list."""
    return [*Lexer(text[:end], report, lists=False).tokens(start)][:-1]


def instruction_tokens(text: str, start: int, end: int, report: Callable[..., None]) -> Iterator[list[Token]]:
    """The tokens of each instruction.  `&N` is one operator, a `)` that closes a list in brackets an instruction of its own."""
    line: list[Token] = []
    depth = 0
    for token in tokens_of(text, start, end, report):
        if line and depth == 0 and ("\n" in text[line[-1].end:token.start] or token.text == ")"):
            yield line
            line = []
        if token.text == "(" and not _opens(line):
            depth += 1
        elif token.text == ")":
            depth = max(0, depth - 1)
        line.append(token)
    if line:
        yield line


def _opens(line: list[Token]) -> bool:
    """Whether a `(` behind these tokens opens a list of instructions."""
    words = line[2:] if has_label(line) else line
    if not words:
        return False
    name, size = _name(words)
    return name in OPERATORS and OPERATORS[name].nests and len(words) == size


def opens_list(line: list[Token]) -> bool:
    """Whether the tokens of an instruction open a list of instructions in brackets."""
    return any(token.text == "(" and _opens(line[:at]) for at, token in enumerate(line))


def has_label(line: list[Token]) -> bool:
    """Whether the tokens of an instruction begin with a label."""
    return len(line) > 1 and line[1].text == ":"


def _name(words: list[Token]) -> tuple[str, int]:
    """The operator or function with which tokens begin, and how many tokens its name has."""
    if words[0].text != "&":
        return words[0].text.upper(), 1
    negated = len(words) > 1 and words[1].text.upper() == "N" and words[1].start == words[0].end
    return ("ANDN", 2) if negated else ("AND", 1)


def _instruction(line: list[Token]) -> Instruction:
    made = Instruction(line[0].start, line[-1].end)
    if has_label(line):
        made.label = line[0]
        line = line[2:]
    if line:
        made.word = line[0]
        made.name, size = _name(line)
        made.operands = line[size:]
        if made.operands and made.operands[0].text == "(" and _opens(line[:size]):
            made.opens = True
            del made.operands[0]
    return made
