"""Words of other languages at the beginning of a statement, and their signs of comments: `CALL t1();`, `GOTO a;`, `-- b`."""

from __future__ import annotations

from fbvm.syntax.recovery.frames import ENDS, POUS, UNITS, anchor, frames
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.wording import found
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.lookahead import advance

NO_WORD = "an assignment has no word in front of it: x := 5;"
BITS = {"SET": "TRUE", "RESET": "FALSE", "RST": "FALSE", "RSET": "FALSE"}
"""Word that sets or resets the bit behind it -> what is to be assigned to that."""
DROPPED = {"LET": NO_WORD,
           "CALL": "a block is called by the name of its instance: timer(IN := a);",
           "CAL": "a block is called by the name of its instance: timer(IN := a);",
           "WHEN": "a label of CASE has no word in front of it"}
"""Word that is dropped -> hint; the rest of the statement is read."""
SKIPPED = {"LOOP": "a loop without a condition is WHILE TRUE DO .. END_WHILE; EXIT leaves it",
           "UNLESS": "write IF NOT condition THEN .. END_IF", "DIM": "variables are declared in VAR .. END_VAR",
           "CONST": "constants are declared in VAR CONSTANT .. END_VAR", "TRY": "write __TRY .. __CATCH(code) .. __ENDTRY",
           "INPUT": "inputs are declared in VAR_INPUT .. END_VAR", "OUTPUT": "outputs are declared in VAR_OUTPUT .. END_VAR"}
"""Word whose whole statement is passed over -> hint."""
ENDED = {"LOOP": "END_LOOP", "CONST": "END_CONST", "TRY": "END_TRY", "INPUT": "END_INPUT", "OUTPUT": "END_OUTPUT"}
"""Those of them with an END of their own -> that END."""
BODIES = {ENDS[word] for word in POUS} | {"END_ACTION", "END_TRANSITION"}


def foreign_word(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`CALL timer();`, `GOTO over;`, `CONST a : INT := 5; END_CONST`"""
    word, place = automaton.before, anchor(automaton.states)
    if place.symbol != "ended_list" or len(automaton.states) != place.size + 1 or word.type not in ("NAME", "ACCESSOR"):
        return None
    if token.type not in ("NAME", "NUMBER", "TYPED_LITERAL", "DIRECT") or "\n" in automaton.text[word.end:token.start]:
        return None
    text = word.text.upper()
    message = f"{found(word)} begins no statement"
    if text == "GOTO":
        return Repair([Token("JMP", "JMP", word.start, word.end), token], word.start, word.end, message,
                      f"write JMP {token.text};", cut=True, lossless=True)
    if text in BITS and token.type in ("NAME", "DIRECT"):
        return _bit(automaton, word, token)
    if text in DROPPED:
        return Repair([token], word.start, word.end, message, DROPPED[text], cut=True, lossless=True)
    if text not in SKIPPED:
        return None
    return Repair(_behind(automaton, token, ENDED.get(text, ";")), word.start, word.end, message, SKIPPED[text], cut=True,
                  lossless=False)


def _bit(automaton: Automaton, word: Token, token: Token) -> Repair:
    """`SET x;`, `RESET t.IN;`: the assignment is read that was meant; `token` is the first of the bit."""
    bit, message = [], f"{found(word)} begins no statement"
    while token.type in ("NAME", "DIRECT", "NUMBER", "DOT", "PART", "LSQB", "RSQB", "COMMA", "CARET") and \
            "\n" not in automaton.text[word.end:token.start]:
        bit.append(token)
        token = automaton.next()
    if token.type in ("ASSIGN", "EQUAL"):
        return Repair([*bit, token], word.start, word.end, message, NO_WORD, cut=True, lossless=True)
    value, at = BITS[word.text.upper()], bit[-1].end
    rest = [token] if token.type == "SEMICOLON" else [Token("SEMICOLON", ";", at, at), token]
    return Repair([*bit, Token("ASSIGN", ":=", at, at), Token(value, value, word.start, word.end), *rest], word.start, word.end,
                  message, f"write {automaton.text[bit[0].start:at]} := {value};", cut=True, lossless=True)


def _behind(automaton: Automaton, token: Token, end: str) -> list[Token]:
    """Pass over tokens to the one behind `end`, or to the end of the body; returns the token to go on with."""
    while token.type not in UNITS and token.type not in BODIES:
        if token.text.upper() == end:
            token = automaton.next() if end != ";" else token
            return [] if token.type == "SEMICOLON" else [token]
        token = automaton.next()
    return [token]


def networks(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`NETWORK .. END_NETWORK`: rungs or lines of an instruction list as other tools write them."""
    symbol = anchor(automaton.states).symbol
    word = {"declarations": token, "ended_list": automaton.before}.get(symbol)
    if word is None or word.text.upper() != "NETWORK" or word.type != "NAME":
        return None
    if automaton.text[automaton.text.rfind("\n", 0, word.start) + 1:word.start].strip():
        return None
    behind: list[Token] | None = None
    while token.type not in UNITS and token.type not in BODIES:
        if token.text.upper() == "END_NETWORK":
            behind = []
        elif behind is not None:
            behind.append(token)
        token = automaton.next()
    rest = [*(behind or ()), token]
    return Repair(rest, word.start, word.end, "NETWORK .. END_NETWORK is another tool's form of rungs",
                  "rungs stand between LADDER and END_LADDER, each behind a line RUNG, as mnemonics or drawn; "
                  "`fbvm import` reads PLCopen XML", cut=True, silent=rest[0].start)


def comment_signs(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`-- text`, `*)`"""
    text, before = automaton.text, automaton.before
    if token.type == "STAR" and text[token.end:token.end + 1] == ")" and anchor(automaton.states).size == len(automaton.states):
        automaton.next()
        return Repair([], token.start, token.end + 1, "`*)` without `(*`", "a comment is closed once for each `(*`",
                      lossless=True)
    start = text.rfind("\n", 0, before.start) + 1
    line = text[start:text.find("\n", start) if "\n" in text[start:] else len(text)]
    if anchor(automaton.states).symbol != "ended_list" or not line.lstrip().startswith("--"):
        return None
    while token.start < start + len(line) and token.type != "$END":
        token = automaton.next()
    at = start + len(line) - len(line.lstrip())
    return Repair([token], at, at + 2, "`--` begins no comment", "a comment begins with // or stands in (* *)", cut=True,
                  silent=start + len(line), lossless=True)


def until(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`REPEAT .. END_REPEAT` without a condition"""
    open_ = frames(automaton.states, automaton.values)
    if token.type != "END_REPEAT" or not open_ or open_[-1].word.type != "REPEAT" or not advance(automaton.states, "UNTIL"):
        return None
    at = token.start, token.start
    return Repair([Token("UNTIL", "UNTIL", *at), Token("TRUE", "TRUE", *at), token], token.start, token.end,
                  "UNTIL and its condition are missing in front of END_REPEAT", "write UNTIL done END_REPEAT;", lossless=False)


def colon_behind(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`ELSE: ..`, `VAR: ..`, `PROGRAM Main: ..`, `IF a: ..`"""
    before, open_ = automaton.before, frames(automaton.states, automaton.values)
    if token.type != "COLON":
        return None
    text, here = before.text.upper(), (token.start, token.end)
    if before.type == "ELSE":
        return Repair([], *here, "`:` behind ELSE", "ELSE is no label: it has no `:`", lossless=True)
    if before.type in ("VAR", "VAR_GLOBAL") and len(following) > 2 and following[2].type not in ("COLON", "COMMA", "AT"):
        return None
    if before.type in ("VAR", "VAR_GLOBAL", "THEN", "DO", "OF", "REPEAT"):
        return Repair([], *here, f"`:` behind {text}", "leave it out", lossless=True)
    word = open_[-1].word if open_ else before
    if word.type in ("PROGRAM", "FUNCTION_BLOCK") and not automaton.text[word.end:before.start].strip():
        return Repair([], *here, f"`:` behind the name of a {word.type}", "leave it out", lossless=True)
    for kind in ("THEN", "DO"):
        if advance(automaton.states, kind) and advance(automaton.states, "COLON") is None:
            return Repair([Token(kind, kind, *here)], *here, f"`{kind}` expected, but `:` found",
                          "blocks are written IF .. THEN .. END_IF and FOR .. DO .. END_FOR", lossless=True)
    return None


def statement_as_value(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x := IF a THEN 1 ELSE 2;`"""
    if token.type not in ("IF", "CASE") or not advance(automaton.states, "NUMBER") or automaton.before.type != "ASSIGN":
        return None
    rest = _behind(automaton, automaton.next(), ";")
    return Repair(rest, token.start, token.end, f"{token.type} is a statement and has no value",
                  "SEL(condition, if_false, if_true) has one", cut=True, lossless=False)
