"""Mistakes in declarations, as they come from other languages: `INT a;`, `VAR INPUT`, `a[10] : INT`, `STRING 20`."""

from __future__ import annotations

import re

from fbvm.syntax.recovery.frames import anchor, cut, frames
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.wording import found
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.literals import ELEMENTARY
from fbvm.syntax.st.lookahead import advance, symbols
from fbvm.syntax.tree import Name

ARRAY = "an array is written ARRAY [0..9] OF INT"
SECTIONS = {"INPUT": "VAR_INPUT", "OUTPUT": "VAR_OUTPUT", "IN_OUT": "VAR_IN_OUT", "INOUT": "VAR_IN_OUT", "TEMP": "VAR_TEMP",
            "GLOBAL": "VAR_GLOBAL", "EXTERNAL": "VAR_EXTERNAL", "CONST": "VAR CONSTANT", "FINAL": "VAR CONSTANT",
            "READONLY": "VAR CONSTANT", "RETENTIVE": "VAR RETAIN"}
"""Word behind VAR -> the section to write."""
TYPES = {*ELEMENTARY, "STRING", "WSTRING"}
_HEAD = re.compile(r"(?i)FUNCTION[ \t]+(\w+)[ \t]+(\w+)")


def _in_names(automaton: Automaton) -> bool:
    """Whether the names of a variable have just been read."""
    return symbols()[automaton.states[-1]] == "names" and automaton.before.type == "NAME"


def two_names(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`VAR INPUT a : INT;`, `INT a;`, `my name : INT;`"""
    word = automaton.before
    if token.type not in ("NAME", "STRING", "WSTRING") or not _in_names(automaton) or len(following) < 2:
        return None
    if "\n" in automaton.text[word.end:token.start]:
        return _section_word(automaton, word, token)
    text, behind = word.text.upper(), following[1].type
    if text in SECTIONS and behind in ("COLON", "COMMA", "AT"):
        return _section_word(automaton, word, token)
    if text in TYPES and behind in ("SEMICOLON", "ASSIGN", "EQUAL"):
        tokens = [token, Token("COLON", ":", token.end, token.end), Token("NAME", word.text, word.start, word.end)]
        return Repair(tokens, word.start, token.end, "the type stands in front of the name",
                      f"write {token.text} : {text};", cut=True, lossless=True)
    if behind == "COLON":
        return Repair([Token("NAME", f"{word.text}_{token.text}", word.start, token.end)], word.start, token.end,
                      f"`{word.text} {token.text}` is no name", f"a name has no spaces: {word.text}_{token.text}", cut=True,
                      lossless=False)
    return None


def _section_word(automaton: Automaton, word: Token, token: Token) -> Repair | None:
    meant = SECTIONS.get(word.text.upper())
    if meant is None or automaton.text[:word.start].rstrip()[-3:].upper() != "VAR":
        return None
    return Repair([token], word.start, word.end, f"`VAR {word.text}` begins no section", f"write {meant}", cut=True,
                  lossless=True)


def misnamed(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`1a : INT;`, `a-b : INT;`, `a[10] : INT;`, `a %QX0.0 : BOOL;`"""
    before = automaton.before
    if token.type == "NUMBER" and advance(automaton.states, "NAME") and not advance(automaton.states, "NUMBER") and (
            len(following) > 1 and following[1].type in ("COLON", "COMMA", "AT")):
        return Repair([Token("NAME", f"_{token.text}", token.start, token.end)], token.start, token.end,
                      f"{found(token)} cannot be a name", "a name begins with a letter", lossless=False)
    if not _in_names(automaton) or anchor(automaton.states).symbol != "var_decls":
        return None
    if token.type == "MINUS" and len(following) > 1 and following[1].type in ("NAME", "NUMBER"):
        whole = automaton.text[before.start:automaton.next().end]
        return Repair([], before.start, before.start + len(whole), f"`{whole}` is no name",
                      f"a name has letters, digits and `_`: {re.sub(r'[^A-Za-z0-9]+', '_', whole)}", lossless=False)
    if token.type == "LSQB":
        while token.type not in ("RSQB", "SEMICOLON", "$END"):
            token = automaton.next()
        return Repair([] if token.type == "RSQB" else [token], before.start, token.end, "the size stands behind the name",
                      f"write {before.text} : ARRAY [0..9] OF INT", lossless=False)
    if token.type == "DIRECT":
        at = Token("AT", "AT", token.start, token.start)
        return Repair([at, Token("LOCATION", token.text, token.start, token.end)], token.start, token.end,
                      f"`AT` expected before {found(token)}", f"write {before.text} AT {token.text} : ...", lossless=True)
    return None


def sized_text(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`STRING 20`"""
    word = automaton.before
    if token.type != "NUMBER" or word.type not in ("STRING", "WSTRING"):
        return None
    return Repair([], token.start, token.end, f"the length of a {word.type} stands in brackets",
                  f"write {word.type}[{token.text}]", lossless=False)


def variadic(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`args : DINT...;`, `args : ...;`, the inputs of any number that RuSTy has for functions of other languages"""
    if token.type != "RANGE" or automaton.before.type not in (*TYPES, "NAME", "COLON", "RSQB") or len(following) < 2 or \
            following[1].type not in ("DOT", "RANGE") or not automaton.text.startswith("...", token.start):
        return None
    automaton.next()
    bare = automaton.before.type == "COLON"
    return Repair([Token("NAME", "INT", token.start, token.start)] if bare else [], token.start, token.start + 3,
                  "`...` makes a variadic input, which RuSTy has for functions in another language, and fbvm calls none of these",
                  "declare each input, or one of ARRAY [*] OF a type", lossless=False)


def function_head(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`FUNCTION INT f`, `FUNCTION BLOCK f`"""
    open_ = frames(automaton.states, automaton.values)
    written = _HEAD.match(automaton.text, open_[0].word.start) if open_ and open_[0].word.type == "FUNCTION" else None
    if written is None or token.start < written.end() or automaton.before.start > written.end():
        return None
    kind, name = (Token("NAME", written[at], *written.span(at)) for at in (1, 2))
    start, end = open_[0].word.start, kind.end
    if kind.text.upper() == "BLOCK":
        head = [Token("FUNCTION_BLOCK", "FUNCTION_BLOCK", start, end), name]
        message, advice = "`FUNCTION BLOCK` is one word", "write FUNCTION_BLOCK"
    elif kind.text.upper() in TYPES:
        typed = kind._replace(type=kind.text.upper()) if kind.text.upper() in ("STRING", "WSTRING") else kind
        head = [open_[0].word, name, Token("COLON", ":", name.end, name.end), typed]
        message, advice = "the type of a FUNCTION stands behind its name", f"write FUNCTION {name.text} : {kind.text.upper()}"
    else:
        return None
    cut(automaton.states, automaton.values, anchor(automaton.states, open_[0].at))
    return Repair([*head, token], start, end, message, advice, lossless=True)


def alias(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x AT y : INT;`, another name for a variable in RuSTy"""
    if automaton.before.type != "AT" or token.type != "NAME" or len(following) < 3 or following[1].type != "COLON":
        return None
    names = [value[-1] for value in automaton.values if isinstance(value, list) and value and isinstance(value[-1], Name)]
    name, kind = names[-1].text if names else "x", following[2].text
    return Repair([Token("LOCATION", "%M*", token.start, token.end)], token.start, token.end,
                  f"AT binds to an address, and {token.text} is none",
                  "write %MW10, D100 or CIO 1519.03; another name for a variable is a reference: "
                  f"{name} : REFERENCE TO {kind} REF= {token.text};", lossless=False)


def written_type(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`SIZEOF(ARRAY [0..9] OF INT)`"""
    if token.type not in ("ARRAY", "STRUCT", "STRING", "WSTRING", "POINTER", "REF_TO") or automaton.before.type != "LPAR":
        return None
    if not advance(automaton.states, "NUMBER") or not advance(automaton.states, "RPAR"):
        return None
    first, depth = token, 1
    while depth and token.type not in ("SEMICOLON", "$END"):
        token = automaton.next()
        depth += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
    return Repair([token], first.start, first.end, "a type that is written out is no argument",
                  "give the type a name: TYPE Row : ARRAY [0..9] OF INT; END_TYPE, and then SIZEOF(Row)", lossless=False)


def braces(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`x := {1, 2};`, `TYPE Colour : {Red, Green};`"""
    between = automaton.text[automaton.before.end:token.start]
    if token.type != "SEMICOLON" or "{" not in between:
        return None
    for kind, text, advice in (("NUMBER", "0", "the values of an array stand in [ ]"),
                               ("NAME", "INT", "the members of an enumeration stand in ( )")):
        if advance(automaton.states, kind):
            at = automaton.before.end + between.index("{")
            return Repair([Token(kind, text, token.start, token.start), token], at, at + 1, "what stands in braces is a pragma",
                          advice, lossless=False)
    return None
