"""Common mistakes, each with a repair of its own: `ENDIF`, `FOR := 1;`, parameters behind the name of a POU and the like.

A function of the table takes the automaton at the error, the token that cannot stand there, and the next tokens (that one
first); it returns the repair, or None if the mistake is another one.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from fbvm.syntax.ladder.instructions.pasted import INSTRUCTION_LIST, ladder_lines
from fbvm.syntax.recovery.declaration_mistakes import (
    alias,
    braces,
    function_head,
    misnamed,
    sized_text,
    two_names,
    variadic,
    written_type,
)
from fbvm.syntax.recovery.foreign_forms import bare_function, bare_point, decimal_comma, infix
from fbvm.syntax.recovery.frames import ENDS, OPENERS, POUS, STATEMENT_WORDS, UNITS, Anchor, anchor, cut, frames
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.word_mistakes import colon_behind, comment_signs, foreign_word, networks, statement_as_value, until
from fbvm.syntax.recovery.wording import found
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.lexer import Token, lexis, meant
from fbvm.syntax.st.literals import ELEMENTARY
from fbvm.syntax.st.lookahead import advance, symbols
from fbvm.syntax.tree import Deref, Name

ACCESS = {"PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL"}
POU_ENDS = {ENDS[word] for word in POUS}
BODY_ENDS = POU_ENDS | {"END_ACTION", "END_TRANSITION"}
"""Words that end a body."""


def known_mistake(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """The repair of a common mistake; None if it is none.  `following` are the next tokens, `token` first."""
    for known in MISTAKES:
        repair = known(automaton, token, following)
        if repair:
            return repair
    return None


def open_bracket(automaton: Automaton, kind: str | None) -> Token | None:
    """The innermost open bracket of a kind."""
    return next((v for v in reversed(automaton.values) if isinstance(v, Token) and v.type == kind), None)


def _misspelt(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`ENDIF`, `ELSEIF`: the lexer knows them, and the automaton has found that the right word fits."""
    if token.type != "MISSPELT":
        return None
    kind = meant(token.text)
    inside = [frame.word.type for frame in frames(automaton.states, automaton.values)]
    around = next((word for word in reversed(inside) if word in ("CASE", "FOR", "WHILE", "REPEAT")), "")
    if kind == "EXIT" and around == "CASE":
        return Repair([], token.start, token.end, f"{found(token)} is no word of Structured Text",
                      "leave it out: a branch of CASE ends where the next one begins", lossless=True)
    advice = "write VAR, VAR_INPUT, VAR_OUTPUT, VAR_IN_OUT, VAR_TEMP or VAR_EXTERNAL" if kind == "VAR" else f"write {kind}"
    return Repair([Token(kind, kind, token.start, token.end)], token.start, token.end,
                  f"{found(token)} is no word of Structured Text", advice)


def _statement_word(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`FOR := 1;`"""
    word = automaton.before
    if token.type != "ASSIGN" or word.type not in STATEMENT_WORDS or automaton.values[-1] is not word:
        return None
    name = Token("NAME", word.text, word.start, word.end)
    return Repair([name, token], word.start, word.end, f"{found(word)} is a reserved word and cannot be a name",
                  "choose another name", cut=True, lossless=False)


def _reserved_name(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`VAR if : INT;`"""
    if token.type not in lexis().reserved or len(following) < 2 or advance(automaton.states, "NAME") is None:
        return None
    sign = following[1].type
    if sign != "ASSIGN" and (sign not in ("COLON", "COMMA") or advance(automaton.states, "NUMBER")):
        return None
    return Repair([Token("NAME", token.text, token.start, token.end)], token.start, token.end,
                  f"{found(token)} is a reserved word and cannot be a name", "choose another name", lossless=sign != "ASSIGN")


NEXT_WORD = re.compile(r"(?i)\b(?:(END_VAR)|VAR\w*|END_\w+|FUNCTION\w*|PROGRAM)\b")


def _end_of_section(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`VAR x : INT; x := 5;`: END_VAR is missing in front of the first statement, unless it follows behind that."""
    states, before = automaton.states, automaton.before
    if token.type not in ("ASSIGN", "LPAR", "LSQB", "DOT", "CARET", "PART") or symbols()[states[-1]] != "names":
        return None
    word = frames(states, automaton.values)[-1].word
    if anchor(states).symbol != "var_decls" or before.type != "NAME" or word.type != "VAR":
        return None
    next_word = NEXT_WORD.search(automaton.text, token.end)
    if next_word and next_word[1]:
        return None
    return Repair([Token("END_VAR", "END_VAR", before.start, before.start), before, token], before.start, before.end,
                  f"END_VAR expected before {found(before)}, which begins a statement", "", word, cut=True, lossless=True)


def _semicolon_in_call(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`fb(IN := a; PT := b);`: a comma is meant if the bracket is closed behind the `;`."""
    if token.type != "SEMICOLON" or not open_bracket(automaton, "LPAR") or advance(automaton.states, "COMMA") is None:
        return None
    end = automaton.text.find(";", token.end)
    rest = automaton.text[token.end:end if end >= 0 else token.end]
    if rest.count(")") <= rest.count("("):
        return None
    return Repair([Token("COMMA", ",", token.start, token.end)], token.start, token.end,
                  "`,` expected, but `;` found", "arguments are separated by commas")


_ANOTHER = re.compile(r"\s*[^\W\d]\w*\s*(?:,[\s\w,]*)?:(?!=)")
"""A declaration behind another one."""


def _parameters_in_head(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`PROGRAM Main() ..`, `FUNCTION f(x : INT; y : INT) ..`"""
    opener = open_bracket(automaton, "LPAR")
    head = next((v[0] for v in reversed(automaton.values) if isinstance(v, tuple) and hasattr(v[0], "end")), None)
    if opener is None or head is None or automaton.text[head.end:opener.start].strip():
        return None
    while not (token.type in ("RPAR", "$END") or token.type.startswith("VAR") or
               token.type == "SEMICOLON" and not _ANOTHER.match(automaton.text, token.end)):
        token = automaton.next()
    rest = [token] if token.type.startswith("VAR") else []
    if token.type == "RPAR":
        rest = [automaton.next()]
        if rest[0].type == "COLON":  # the type of the result goes with them
            automaton.next()
            rest = []
    return Repair(rest, opener.start, opener.end,
                  f"`(` behind the name `{head.text}` of a POU", "parameters are declared in VAR_INPUT .. END_VAR", cut=True)


def _nameless(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`PROGRAM VAR ..`, `FUNCTION : INT`"""
    word = automaton.before
    if word.type not in POUS or automaton.values[-1:] == [] or advance(automaton.states, "NAME") is None:
        return None
    if token.type not in ("COLON", "VAR", "VAR_GLOBAL", *STATEMENT_WORDS):
        return None
    kind = word.text.upper()
    return Repair([Token("NAME", "?", word.end, word.end), token], word.start, word.end, f"the {kind} has no name",
                  f"write it behind {kind}", lossless=False)


def _access_in_front(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`PUBLIC METHOD Stop ..`"""
    access, word = automaton.before, token.text.upper()
    if word not in ("METHOD", "PROPERTY", "ACTION") or access.text.upper() not in ACCESS or len(following) < 2:
        return None
    return Repair([Token(word, token.text, token.start, token.end)], access.start, access.end,
                  f"{found(access)} stands in front of {word}", f"write {word} {access.text.upper()} {following[1].text}",
                  cut=True, lossless=True)


def _no_instance(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`(IN := a, PT := b);`"""
    opener = open_bracket(automaton, "LPAR")
    if token.type not in ("ASSIGN", "OUTPUT") or opener is None or automaton.before.type != "NAME":
        return None
    at = automaton.values.index(opener)
    behind = len(automaton.values) - at  # `(name`, or `(`, the fields of a structure, a comma and a name
    if anchor(automaton.states, at + 2) != Anchor(at + 1, "ended_list") or behind not in (2, 4):
        return None
    depth = 1
    while depth and token.type not in ("SEMICOLON", "$END"):
        token = automaton.next()
        depth += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
    return Repair([] if not depth else [token], opener.start, opener.end, "the name of an instance is missing in front of `(`",
                  "write the name of the instance that is called", cut=True, lossless=True)


def _other_end(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`PROGRAM Main .. END_FUNCTION`"""
    open_ = frames(automaton.states, automaton.values)
    if token.type not in POU_ENDS or not open_ or open_[0].word.type not in POUS or len(following) < 2:
        return None
    word = open_[0].word
    if following[1].type not in UNITS or any(frame.word.type in OPENERS[token.type] for frame in open_):
        return None
    end = ENDS[word.type]
    return Repair([Token(end, end, token.start, token.end)], token.start, token.end,
                  f"{end} expected, but {found(token)} found", f"a {word.text.upper()} ends with {end}", word)


def _no_handler(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`__TRY .. __ENDTRY`"""
    open_ = frames(automaton.states, automaton.values)
    if token.type not in ("FINALLY", "END_TRY") or not open_ or open_[-1].word.type != "TRY" or \
            advance(automaton.states, "CATCH") is None:
        return None
    head = [Token(*each, token.start, token.start) for each in HANDLER]
    return Repair([*head, token], token.start, token.end, f"__CATCH(code) expected before {found(token)}",
                  "code is a variable of type __SYSTEM.ExceptionCode", open_[-1].word, lossless=False)


HANDLER = (("CATCH", "__CATCH"), ("LPAR", "("), ("NUMBER", "0"), ("RPAR", ")"))
"""The tokens that are read in place of the head of a handler."""


def _location_behind_type(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x : INT AT D5;`"""
    if token.type != "AT" or anchor(automaton.states).symbol != "var_decls" or following[1].type != "LOCATION":
        return None
    location = automaton.next()
    names = [v[-1] for v in automaton.values if isinstance(v, list) and v and isinstance(v[-1], Name)]
    name = names[-1].text if names else "x"
    return Repair([], token.start, location.end, "AT stands behind the type",
                  f"write it in front of the colon: {name} AT {location.text} : ...", lossless=True)


def _caret(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`a ^ 3` for XOR."""
    caret = automaton.before
    if caret.type != "CARET" or token.type not in ("NAME", "NUMBER", "TYPED_LITERAL", "LPAR") or not automaton.values:
        return None
    value = automaton.values[-1]
    if not isinstance(value, Deref) or advance(automaton.states, "XOR") is None:
        return None
    automaton.values[-1] = value.of
    return Repair([Token("XOR", "XOR", caret.start, caret.end), token], caret.start, caret.end,
                  "`^` stands behind a reference and leads to what it refers to", "write XOR for exclusive or, a ** b for powers")


def _begin(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`BEGIN` of other languages in front of the statements."""
    word, place = automaton.before, anchor(automaton.states)
    if word.text.upper() != "BEGIN" or place.symbol != "ended_list" or len(automaton.states) != place.size + 1:
        return None
    if token.type not in ("NAME", "VAR", *STATEMENT_WORDS):
        return None
    return Repair([token], word.start, word.end, f"{found(word)} is no word of Structured Text",
                  "leave it out: statements follow the VAR sections", cut=True, lossless=True)


def _c_loop(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`for (i = 0; i < 10; i++)`"""
    opener = open_bracket(automaton, "LPAR")
    open_ = frames(automaton.states, automaton.values)
    if opener is None or not open_ or open_[-1].word.type != "FOR" or token.type != "SEMICOLON":
        return None
    word, depth = open_[-1].word, 1
    if automaton.text[word.end:opener.start].strip():
        return None
    while depth and token.type != "$END":
        token = automaton.next()
        depth += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
    place = anchor(automaton.states, automaton.values.index(word) + 1)
    cut(automaton.states, automaton.values, place)
    head = [Token(*each, token.end, token.end) for each in HEAD]
    return Repair([word, *head, *([token] if depth else [])], word.start, opener.end,
                  "a FOR loop has no brackets and semicolons", "write FOR i := 0 TO 9 DO .. END_FOR;", lossless=False)


HEAD = (("NAME", "i"), ("ASSIGN", ":="), ("NUMBER", "0"), ("TO", "TO"), ("NUMBER", "0"), ("DO", "DO"))
"""The tokens that are read in place of the head of a loop of C."""


def _declared_in_body(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`int i;`, `i : INT;` among statements."""
    name = automaton.before
    states = automaton.states
    if anchor(states).symbol != "ended_list" or len(states) != anchor(states).size + 1 or name.type != "NAME":
        return None
    if token.type != "NAME" or name.text.upper() not in C_TYPES or len(following) < 2:
        return None
    if following[1].type not in ("SEMICOLON", "ASSIGN", "EQUAL", "COMMA", "LSQB"):
        return None
    while token.type not in ("SEMICOLON", "$END"):
        token = automaton.next()
    ours = C_TYPES[name.text.upper()]
    return Repair([] if token.type == "SEMICOLON" else [token], name.start, name.end,
                  f"{found(name)} begins a declaration, which stands in front of all statements",
                  f"write in a VAR section: {following[0].text} : {ours};", cut=True)


C_TYPES = {name: name for name in ELEMENTARY if len(name) > 2} | {
    "INTEGER": "INT", "BOOLEAN": "BOOL", "FLOAT": "REAL", "DOUBLE": "LREAL", "LONG": "DINT", "SHORT": "INT",
    "UNSIGNED": "UDINT", "INT8_T": "SINT", "UINT8_T": "BYTE", "INT16_T": "INT", "UINT16_T": "WORD", "INT32_T": "DINT",
    "UINT32_T": "DWORD", "AUTO": "INT", "CONST": "INT", "STATIC": "INT"}
"""Word that begins a declaration in other languages -> the type to write."""


def _ladder(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`LD 0.00`, `OUT 100.00` among statements: rungs without LADDER and END_LADDER."""
    symbol = anchor(automaton.states).symbol
    first = {"declarations": token, "ended_list": automaton.before}.get(symbol)
    if first is None or not ladder_lines(automaton.text, first.start):
        return None
    while token.type not in UNITS and token.type not in POU_ENDS:
        token = automaton.next()
    where = "in the body of a PROGRAM or FUNCTION_BLOCK, " if symbol == "declarations" else ""
    return Repair([token], first.start, first.end, "these lines are ladder as mnemonics",
                  f"rungs stand {where}between LADDER and END_LADDER", cut=True, silent=token.start)


_NEED_RESULT = INSTRUCTION_LIST - {"LD", "LDN", "JMP", "CAL", "RET"}
"""Operators that need a current result."""


def _instruction_list(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`LD a` at the beginning of a line, and a `;` somewhere: an instruction list with statements or `;` in it."""
    word = automaton.before
    line = automaton.text[:word.start].rpartition("\n")[2].strip()
    if word.type != "NAME" or word.text.upper() not in INSTRUCTION_LIST or (line and not line.endswith(":")):
        return None
    if token.type not in ("NAME", "NUMBER", "TYPED_LITERAL", "DIRECT") or "\n" in automaton.text[word.end:token.start]:
        return None
    while token.type not in BODY_ENDS and token.type != "$END":
        token = automaton.next()
    if word.text.upper() in _NEED_RESULT and not line:
        return Repair([token], word.start, word.end, f"there is no current result for {word.text}",
                      "an instruction list begins with LD", cut=True, silent=token.start)
    return Repair([token], word.start, word.end, "an instruction list has no `;` and no statements of Structured Text",
                  "each instruction stands on a line of its own, without `;`", cut=True, silent=token.start)


MISTAKES: tuple[Callable[[Automaton, Token, list[Token]], Repair | None], ...] = (
    networks, _ladder, _misspelt, _statement_word, function_head, _nameless, _reserved_name, _end_of_section,
    colon_behind, _semicolon_in_call, _parameters_in_head, _access_in_front, _no_instance, _other_end,
    _no_handler, _location_behind_type, _caret, _begin, infix, decimal_comma, bare_point, bare_function, _c_loop,
    _declared_in_body, _instruction_list, foreign_word, comment_signs, until, statement_as_value,
    two_names, misnamed, sized_text, variadic, alias, written_type, braces)
"""In the order in which they are asked; the first repair counts."""
