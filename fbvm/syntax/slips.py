"""Mistakes that everybody makes now and then, each with a mend of its own: `ENDIF`, `ELSE:`, `END_VAR;` ..."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from fbvm.syntax.automaton import Automaton
from fbvm.syntax.frames import ENDS, OPENERS, POUS, STATEMENT_WORDS, UNITS, Anchor, anchor, frames
from fbvm.syntax.lexer import Token, lexis, meant
from fbvm.syntax.phrases import found
from fbvm.syntax.prospect import advance, symbols

ACCESS = {"PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL"}
POU_ENDS = {ENDS[word] for word in POUS}


@dataclass(frozen=True)
class Mend:
    """What to say and which tokens to go on with; `cut` gives up the statement's beginning first."""

    tokens: list[Token]
    start: int
    end: int
    message: str
    hint: str = ""
    opener: Token | None = None
    cut: bool = False
    code: str = "S0101"


def slip(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """The mend of a slip that is known; None if it is none.  `following` begins with `token`."""
    for known in SLIPS:
        mend = known(automaton, token, following)
        if mend:
            return mend
    return None


def open_bracket(automaton: Automaton, kind: str | None) -> Token | None:
    """The innermost open bracket of a kind."""
    return next((v for v in reversed(automaton.values) if isinstance(v, Token) and v.type == kind), None)


def _misspelt(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`ENDIF`, `ELSEIF`; the automaton has seen that the right word fits."""
    if token.type != "MISSPELT":
        return None
    kind = meant(token.text)
    advice = "write VAR, VAR_INPUT, VAR_OUTPUT, VAR_IN_OUT, VAR_TEMP or VAR_EXTERNAL" if kind == "VAR" else f"write {kind}"
    return Mend([Token(kind, kind, token.start, token.end)], token.start, token.end,
                f"{found(token)} is no word of Structured Text", advice)


def _statement_word(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`FOR := 1;`"""
    word = automaton.before
    if token.type != "ASSIGN" or word.type not in STATEMENT_WORDS or automaton.values[-1] is not word:
        return None
    name = Token("NAME", word.text, word.start, word.end)
    return Mend([name, token], word.start, word.end, f"{found(word)} is a reserved word and cannot be a name",
                "choose another name", cut=True)


def _reserved_name(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`VAR if : INT;`"""
    if token.type not in lexis().reserved or len(following) < 2 or advance(automaton.states, "NAME") is None:
        return None
    sign = following[1].type
    if sign != "ASSIGN" and (sign not in ("COLON", "COMMA") or advance(automaton.states, "NUMBER")):
        return None
    return Mend([Token("NAME", token.text, token.start, token.end)], token.start, token.end,
                f"{found(token)} is a reserved word and cannot be a name", "choose another name")


NEXT_WORD = re.compile(r"(?i)\b(?:(END_VAR)|VAR\w*|END_\w+|FUNCTION\w*|PROGRAM)\b")


def _end_of_section(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`VAR x : INT; x := 5;`: the END_VAR is missing in front of the first statement, unless one stands behind it."""
    states, before = automaton.states, automaton.before
    if token.type not in ("ASSIGN", "LPAR", "LSQB", "DOT", "CARET", "PART") or symbols()[states[-1]] != "names":
        return None
    word = frames(states, automaton.values)[-1].word
    if anchor(states).symbol != "var_decls" or before.type != "NAME" or word.type != "VAR":
        return None
    next_word = NEXT_WORD.search(automaton.text, token.end)
    if next_word and next_word[1]:
        return None
    return Mend([Token("END_VAR", "END_VAR", before.start, before.start), before, token], before.start, before.end,
                f"END_VAR expected before {found(before)}, which begins a statement", "", word, cut=True)


def _colon_behind_else(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`ELSE: ..`"""
    if token.type != "COLON" or automaton.before.type != "ELSE":
        return None
    return Mend([], token.start, token.end, "`:` behind ELSE", "ELSE is no label: it has no `:`")


def _semicolon_in_call(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`fb(IN := a; PT := b);`: a comma is meant if the bracket is closed behind it."""
    if token.type != "SEMICOLON" or not open_bracket(automaton, "LPAR") or advance(automaton.states, "COMMA") is None:
        return None
    end = automaton.text.find(";", token.end)
    rest = automaton.text[token.end:end if end >= 0 else token.end]
    if rest.count(")") <= rest.count("("):
        return None
    return Mend([Token("COMMA", ",", token.start, token.end)], token.start, token.end,
                "`,` expected, but `;` found", "arguments are separated by commas")


def _parameters_in_head(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`PROGRAM Main() ..`, `FUNCTION f(x : INT) ..`"""
    opener = open_bracket(automaton, "LPAR")
    head = next((v[0] for v in reversed(automaton.values) if isinstance(v, tuple) and hasattr(v[0], "end")), None)
    if opener is None or head is None or automaton.text[head.end:opener.start].strip():
        return None
    while token.type not in ("RPAR", "SEMICOLON", "$END"):
        token = automaton.next()
    return Mend([] if token.type != "$END" else [token], opener.start, opener.end,
                f"`(` behind the name `{head.text}` of a POU", "parameters are declared in VAR_INPUT .. END_VAR", cut=True)


def _nameless(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`PROGRAM VAR ..`, `FUNCTION : INT`"""
    word = automaton.before
    if word.type not in POUS or automaton.values[-1:] == [] or advance(automaton.states, "NAME") is None:
        return None
    if token.type not in ("COLON", "VAR", "VAR_GLOBAL", *STATEMENT_WORDS):
        return None
    kind = word.text.upper()
    return Mend([Token("NAME", "?", word.end, word.end), token], word.start, word.end, f"the {kind} has no name",
                f"write it behind {kind}")


def _access_in_front(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`PUBLIC METHOD Stop ..`"""
    access, word = automaton.before, token.text.upper()
    if word not in ("METHOD", "PROPERTY", "ACTION") or access.text.upper() not in ACCESS or len(following) < 2:
        return None
    return Mend([Token("REFUSED_BLOCK", token.text, token.start, token.end)], access.start, access.end,
                f"{found(access)} stands in front of {word}", f"write {word} {access.text.upper()} {following[1].text}", cut=True)


def _no_instance(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`(IN := a, PT := b);`"""
    opener = open_bracket(automaton, "LPAR")
    if token.type not in ("ASSIGN", "OUTPUT") or opener is None or automaton.before.type != "NAME":
        return None
    at = automaton.values.index(opener)
    if anchor(automaton.states, at + 2) != Anchor(at + 1, "ended_list") or len(automaton.values) != at + 2:
        return None
    depth = 1
    while depth and token.type not in ("SEMICOLON", "$END"):
        token = automaton.next()
        depth += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
    return Mend([] if not depth else [token], opener.start, opener.end, "the name of an instance is missing in front of `(`",
                "write the name of the instance that is called", cut=True)


def _other_end(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`PROGRAM Main .. END_FUNCTION`"""
    open_ = frames(automaton.states, automaton.values)
    if token.type not in POU_ENDS or not open_ or open_[0].word.type not in POUS or len(following) < 2:
        return None
    word = open_[0].word
    if following[1].type not in UNITS or any(frame.word.type in OPENERS[token.type] for frame in open_):
        return None
    end = ENDS[word.type]
    return Mend([Token(end, end, token.start, token.end)], token.start, token.end,
                f"{end} expected, but {found(token)} found", f"a {word.text.upper()} ends with {end}", word)


def _location_behind_type(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`x : INT AT D5;`"""
    if token.type != "AT" or anchor(automaton.states).symbol != "var_decls" or len(following) < 2:
        return None
    location = automaton.next()
    return Mend([], token.start, location.end, "AT stands behind the type",
                f"write it in front of the colon: x AT {location.text} : ...")


INSTRUCTIONS = {
    "LD", "LDN", "ST", "STN", "S", "R", "AND", "ANDN", "OR", "ORN", "XOR", "XORN", "NOT", "ADD", "SUB", "MUL", "DIV", "MOD", "GT",
    "GE", "EQ", "NE", "LE", "LT", "JMP", "JMPC", "JMPCN", "CAL", "CALC", "CALCN", "RET", "RETC", "RETCN"}
"""Operators of the instruction list, as names (IEC 61131-3 ed. 3, table 68)."""


def _instruction_list(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`LD a` at the beginning of a line: the whole body is an instruction list."""
    word = automaton.before
    line = automaton.text[:word.start].rpartition("\n")[2].strip()
    if word.type != "NAME" or word.text.upper() not in INSTRUCTIONS or (line and not line.endswith(":")):
        return None
    if token.type not in ("NAME", "NUMBER", "TYPED_LITERAL", "DIRECT") or "\n" in automaton.text[word.end:token.start]:
        return None
    while token.type not in POU_ENDS and token.type != "$END":
        token = automaton.next()
    return Mend([token], word.start, word.end, "the instruction list is understood but not executed by this version",
                "write the body in Structured Text", cut=True, code="S0901")


SLIPS: tuple[Callable[[Automaton, Token, list[Token]], Mend | None], ...] = (
    _misspelt, _statement_word, _nameless, _reserved_name, _end_of_section, _colon_behind_else,
    _semicolon_in_call, _parameters_in_head, _access_in_front, _no_instance, _other_end, _location_behind_type,
    _instruction_list)
