"""The wording of syntax errors: what is expected at a place, what was found, and a hint."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax.st.lexer import Token, lexis
from fbvm.syntax.st.tables import tables

GROUPS = (
    ("a declaration (FUNCTION, FUNCTION_BLOCK, PROGRAM, TYPE, VAR_GLOBAL, CONFIGURATION)", {"FUNCTION", "TYPE"}, {
        "FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "TYPE", "VAR_GLOBAL", "CONFIGURATION", "NAMESPACE", "END_NAMESPACE",
        "USING", "CLASS", "INTERFACE", "ACTION", "ACTIONS", "VAR_CONFIG", "SEMICOLON", "$END"}),
    ("a statement", {"IF", "FOR", "SEMICOLON"}, {
        "IF", "CASE", "FOR", "WHILE", "REPEAT", "EXIT", "CONTINUE", "RETURN", "JMP", "SEMICOLON", "METHOD",
        "PROPERTY", "PROPERTY_HALF",
        "NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "NULL", "LPAR", "PLUS", "MINUS",
        "NOT", "DIRECT", "LADDER", "INSTRUCTION_LIST"}),
    ("an expression", {"NAME", "NUMBER", "LPAR"}, {
        "NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "NULL", "LPAR", "PLUS",
        "MINUS", "NOT", "DIRECT", "REF_TO", "POINTER", "REFERENCE"}),
    ("a type", {"NAME", "ARRAY"}, {
        "NAME", "ARRAY", "STRING", "WSTRING", "STRUCT", "UNION", "REF_TO", "POINTER", "REFERENCE", "LPAR"}),
    ("a name", {"NAME"}, {"NAME", "POU_MODIFIER", "QUALIFIER", "AT", "TYPED_LITERAL"}),
    ("an address such as D100, CIO 1519.03 or %MW10", {"LOCATION"}, {"LOCATION"}),
)
"""The name of a group of terminals, the terminals that must all be expected for the name to be used, and the group."""

CONTINUATIONS = {
    "PLUS", "MINUS", "STAR", "SLASH", "MOD", "POWER", "AND", "AMPERSAND", "AND_THEN", "OR", "OR_ELSE", "XOR", "EQUAL",
    "UNEQUAL", "LESS", "GREATER", "LESS_EQUAL", "GREATER_EQUAL", "DOT", "PART", "CARET", "LSQB"}
"""Terminals that may follow any operand, and are not worth a mention."""

STATEMENTS = {"IF", "CASE", "FOR", "WHILE", "REPEAT", "DIRECT"}
"""Terminals besides names with which a statement begins."""

LABEL_SIGNS = {"COLON", "COMMA", "RANGE", "SET_ASSIGN", "ATTEMPT"}
"""What may follow a name at the start of a statement, beside `:=`, `(` and `;`."""

UNSAID = {"NAMESPACE", "USING", "TRY", "ACCESS", "INHERITANCE", "POU_MODIFIER", "JMP", "QUALIFIER", "EDGE",
          "OVERLAP", "ACTION", "DIRECTION", "STEP", "TRANSITION", "METHOD", "PROPERTY", "PROPERTY_HALF",
          "ACCESSOR", "CLASS", "INTERFACE"}
"""Terminals that are allowed and never mentioned: they would be refused later, or are seldom meant."""

FIRST = ("SEMICOLON", "THEN", "DO", "OF", "TO", "ASSIGN", "COLON", "COMMA", "RPAR", "RSQB")
"""Terminals that a message names first, in this order; others follow in the order of their names."""

SHOWN = 4
"""Most terminals that a message names."""

MEANT = {
    "STEP": ("BY", "the step of a loop stands behind BY"),
    "DOWNTO": ("TO", "write TO, and BY -1"),
    "IN": ("ASSIGN", "write FOR i := 0 TO 9 DO"),
}
"""Word of another language -> the terminal that is meant, and advice."""
CONFUSED = (
    ("TO", "ASSIGN", "the variable of a loop takes its first value with `:=`"),
    ("RANGE", "TO", "the last value of a loop stands behind TO"),
    ("OUTPUT", "ASSIGN", "`:` stands behind a label of CASE, `:=` assigns"),
    ("OUTPUT", "GREATER_EQUAL", "`>=` compares; `=>` takes an output of a call"),
    ("EQUAL", "ASSIGN", "`:=` assigns and gives initial values, `=` compares"),
    ("ASSIGN", "EQUAL", "`=` compares, `:=` assigns"),
    ("VAR", "TYPE", "VAR sections stand in a FUNCTION, FUNCTION_BLOCK or PROGRAM; VAR_GLOBAL by itself"),
    ("VAR", "SEMICOLON", "VAR sections stand in front of the first statement"),
    ("NOT", "UNEQUAL", "unequal is written `<>`"),
    ("CARET", "POWER", "a power is written 2 ** 3"),
    ("DO", "FOR", "a loop that tests at its end is REPEAT .. UNTIL condition END_REPEAT"),
)
"""A terminal that is found, the terminal that is expected there, and advice; the first row that fits counts."""
OPENING = {"THEN": ("IF", "IF"), "DO": ("FOR", "FOR or WHILE"), "OF": ("CASE", "CASE"), "BY": ("FOR", "FOR")}
"""Word in the middle of a statement -> a terminal that is expected only where a statement begins, and the words that the
word belongs to."""
MIDDLE = {"THEN", "DO", "OF", "TO", "BY", "AND", "OR", "XOR", "MOD"}
"""Reserved words that are hardly ever meant as a name."""


def sign(kind: str) -> str:
    """How a terminal is written in a program."""
    return next((terminal.pattern for terminal in tables("st").terminals if terminal.name == kind and terminal.literal), kind)


def quoted(kind: str) -> str:
    """How a terminal is written in a message."""
    return f"`{sign(kind)}`"


def wanted(kinds: set[str]) -> str:
    """The part of a message that says what is expected; "" if nothing of `kinds` is worth a mention."""
    rest = set(kinds) - UNSAID
    if {"NAME", "SEMICOLON"} <= rest and rest & {"END_VAR", "END_TYPE", "END_STRUCT", "END_UNION"}:
        rest -= {"SEMICOLON"}  # one too many is taken, and seldom meant
    if {"THEN", "DO", "END_REPEAT"} & rest:
        rest -= {"ASSIGN"}  # an assignment is a condition for some compilers, and seldom meant as one
    if {"SEMICOLON", "ASSIGN"} <= rest:
        rest -= LABEL_SIGNS
    elif rest - CONTINUATIONS - {"LPAR"}:
        rest -= CONTINUATIONS
        if not {"NAME", "ARRAY"} & rest:
            rest -= {"LPAR"}
    rest = rest - CONTINUATIONS or rest
    parts = []
    for name, marks, members in GROUPS:
        if marks <= rest:
            parts.append(name)
            rest -= members
            break
    signs = [kind for kind in FIRST if kind in rest] + sorted(rest - set(FIRST))
    if "VAR" in rest:
        signs = ["VAR", *(kind for kind in signs if not kind.startswith("VAR"))]
    parts += ["a VAR section" if kind == "VAR" else quoted(kind) for kind in signs]
    if len(parts) > SHOWN:
        parts = parts[:SHOWN]
    return " or ".join(parts) if len(parts) < 3 else ", ".join(parts[:-1]) + " or " + parts[-1]


def found(token: Token) -> str:
    """The part of a message that says which token was found."""
    if token.type == "$END":
        return "the end of the text"
    text = token.text if len(token.text) <= 40 else token.text[:37] + "..."
    return f"`{text}`"


def unlike(token: Token, kinds: set[str]) -> str:
    """The message for a token where `kinds` are expected."""
    if token.type == "VAR" and kinds & {"END_PROGRAM", "END_FUNCTION_BLOCK", "END_FUNCTION"} and "VAR" not in kinds:
        return f"{found(token)} behind the first statement"
    if token.type in OPENING and OPENING[token.type][0] in kinds:
        return f"{found(token)} without {OPENING[token.type][1]}"
    want = wanted(kinds)
    return f"{want} expected, but {found(token)} found" if want else f"unexpected {found(token)}"


def hint(token: Token, kinds: set[str]) -> str:
    """Advice for a token in a place where `kinds` are expected; "" if there is none."""
    ours, advice = MEANT.get(token.text.upper(), ("", ""))
    if ours in kinds:
        return advice
    for found_kind, wanted_kind, advice in CONFUSED:
        if token.type == found_kind and wanted_kind in kinds:
            return advice
    return next((advice(token) for applies, advice in _ADVICE if applies(token, kinds)), "")


def _begins_type_or_value(token: Token, kinds: set[str]) -> bool:
    return token.type == "ASSIGN" and "COLON" in kinds and "NUMBER" not in kinds


def _begins_statement_outside(token: Token, kinds: set[str]) -> bool:
    return {"FUNCTION", "TYPE"} <= kinds and (token.type == "NAME" or "FOR" in kinds or token.type in STATEMENTS)


def _begins_test_outside(token: Token, kinds: set[str]) -> bool:
    return {"FUNCTION", "TYPE"} <= kinds and token.text.upper() in ("TEST", "TEST_PROGRAM", "TEST_FUNCTION_BLOCK", "SETUP")


def _begins_part_of_block_outside(token: Token, kinds: set[str]) -> bool:
    return {"FUNCTION", "TYPE"} <= kinds and token.text.upper() in ("METHOD", "PROPERTY", "ACTION", "TRANSITION")


def _begins_structure_outside(token: Token, kinds: set[str]) -> bool:
    return token.type in ("STRUCT", "UNION") and {"FUNCTION", "TYPE"} <= kinds


def _is_reserved_as_name(token: Token, kinds: set[str]) -> bool:
    is_word = token.type in lexis().reserved - MIDDLE and token.type[:4] != "END_"
    return is_word and "NAME" in kinds and "IF" not in kinds


def _is_in_array_type(token: Token, kinds: set[str]) -> bool:
    is_bound = token.type in ("RSQB", "COLON", "COMMA") and "RANGE" in kinds and "COMMA" not in kinds
    return is_bound or kinds == {"LSQB"}


def _is_number_without_digits(token: Token, kinds: set[str]) -> bool:
    return token.type == "PART" and "NUMBER" in kinds


_ADVICE: tuple[tuple[Callable[[Token, set[str]], bool], Callable[[Token], str]], ...] = (
    (_begins_type_or_value, lambda token: "a declaration has a type, and then its value: `x : INT := 5;`"),
    (_begins_test_outside, lambda token: f"{token.text} begins a test of STruC++ or truST: leave such files out"),
    (_begins_part_of_block_outside, lambda token: f"{token.text.upper()} stands in its POU, in front of END_FUNCTION_BLOCK"),
    (_begins_statement_outside, lambda token: "statements stand in a POU: PROGRAM Main .. END_PROGRAM"),
    (_begins_structure_outside, lambda token: f"write TYPE Name : {token.type} .. END_{token.type} END_TYPE"),
    (_is_reserved_as_name, lambda token: f"{token.text} is a reserved word and cannot be a name"),
    (_is_in_array_type, lambda token: "an array is written ARRAY [0..9] OF INT"),
    (_is_number_without_digits, lambda token: "a number has digits in front of its point, as 0.5"),
)
"""When an advice applies, given the token and what is expected in its place, and its text; the first that applies counts."""
