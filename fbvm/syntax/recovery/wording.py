"""The words of syntax errors: what is expected at a place, what was found, and what helps."""

from __future__ import annotations

from fbvm.syntax.st.lexer import Token, lexis
from fbvm.syntax.st.tables import tables

GROUPS = (
    ("a declaration (FUNCTION, FUNCTION_BLOCK, PROGRAM, TYPE, VAR_GLOBAL, CONFIGURATION)", {"FUNCTION", "TYPE"}, {
        "FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "TYPE", "VAR_GLOBAL", "CONFIGURATION", "REFUSED_SECTION",
        "REFUSED_BLOCK", "ACTION", "ACTIONS", "VAR_CONFIG", "SEMICOLON", "$END"}),
    ("a statement", {"IF", "FOR", "SEMICOLON"}, {
        "IF", "CASE", "FOR", "WHILE", "REPEAT", "EXIT", "CONTINUE", "RETURN", "JMP", "SEMICOLON", "REFUSED_BLOCK",
        "NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "NULL", "LPAR", "PLUS", "MINUS",
        "NOT", "DIRECT", "SELF", "LADDER"}),
    ("an expression", {"NAME", "NUMBER", "LPAR"}, {
        "NAME", "NUMBER", "TYPED_LITERAL", "DATE_LITERAL", "STRING_LITERAL", "TRUE", "FALSE", "NULL", "LPAR", "PLUS",
        "MINUS", "NOT", "DIRECT", "SELF"}),
    ("a type", {"NAME", "ARRAY"}, {
        "NAME", "ARRAY", "STRING", "WSTRING", "STRUCT", "UNION", "REF_TO", "POINTER", "REFERENCE", "LPAR"}),
    ("a name", {"NAME"}, {"NAME", "POU_MODIFIER", "QUALIFIER", "AT"}),
    ("an address such as D100, CIO 1519.03 or %MW10", {"LOCATION"}, {"LOCATION"}),
)
"""Phrase, the terminals that give it away, and all those that it stands for."""

CONTINUATIONS = {
    "PLUS", "MINUS", "STAR", "SLASH", "MOD", "POWER", "AND", "AMPERSAND", "AND_THEN", "OR", "OR_ELSE", "XOR", "EQUAL",
    "UNEQUAL", "LESS", "GREATER", "LESS_EQUAL", "GREATER_EQUAL", "DOT", "PART", "CARET", "LSQB"}
"""What may always follow an operand, and is nobody's news."""

STATEMENTS = {"IF", "CASE", "FOR", "WHILE", "REPEAT", "DIRECT"}
"""With these and names statements begin."""

LABEL_SIGNS = {"COLON", "COMMA", "RANGE", "SET_ASSIGN", "ATTEMPT"}
"""What may follow a name at the start of a statement, beside `:=`, `(` and `;`."""

UNSAID = {"REFUSED_SECTION", "REFUSED_BLOCK", "TRY", "ACCESS", "INHERITANCE", "POU_MODIFIER", "SELF", "JMP", "QUALIFIER", "EDGE",
          "OVERLAP", "ACTION", "DIRECTION", "STEP", "TRANSITION"}
"""What may stand there and would be refused, or is seldom meant."""

FIRST = ("SEMICOLON", "THEN", "DO", "OF", "TO", "ASSIGN", "COLON", "COMMA", "RPAR", "RSQB")
"""Order of the signs in a message; others follow by their names."""

SHOWN = 4

MEANT = {
    "STEP": ("BY", "the step of a loop stands behind BY"),
    "DOWNTO": ("TO", "write TO, and BY -1"),
    "IN": ("ASSIGN", "write FOR i := 0 TO 9 DO"),
}
"""Words of other languages -> ours, and advice."""
SLIPS = (
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
"""What stands where something else is expected, and advice; the first row that fits counts."""
OPENING = {"THEN": ("IF", "IF"), "DO": ("FOR", "FOR or WHILE"), "OF": ("CASE", "CASE"), "BY": ("FOR", "FOR")}
"""Words in the middle of a statement -> the word that shows that one begins here, and what stands in front of them."""
MIDDLE = {"THEN", "DO", "OF", "TO", "BY", "AND", "OR", "XOR", "MOD"}
"""Reserved words that nobody takes for a name."""


def sign(kind: str) -> str:
    """How a terminal is written."""
    for terminal in tables("st").terminals:
        if terminal.name == kind:
            return terminal.pattern if terminal.literal else kind
    return "the end of the text" if kind == "$END" else kind


def quoted(kind: str) -> str:
    """A terminal in a message."""
    return sign(kind) if kind == "$END" else f"`{sign(kind)}`"


def wanted(kinds: set[str]) -> str:
    """What is expected, in the user's words; "" if everything is."""
    rest = set(kinds) - UNSAID
    if {"NAME", "SEMICOLON"} <= rest and rest & {"END_VAR", "END_TYPE", "END_STRUCT", "END_UNION"}:
        rest -= {"SEMICOLON"}  # one too many is taken, and seldom meant
    if {"SEMICOLON", "ASSIGN"} <= rest:
        rest -= LABEL_SIGNS
    elif rest - CONTINUATIONS - {"LPAR"}:
        rest -= CONTINUATIONS
        if not {"NAME", "ARRAY"} & rest:
            rest -= {"LPAR"}
    rest = rest - CONTINUATIONS or rest
    parts = []
    for phrase, marks, members in GROUPS:
        if marks <= rest:
            parts.append(phrase)
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
    """The token that stands there."""
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
    for found_kind, wanted_kind, advice in SLIPS:
        if token.type == found_kind and wanted_kind in kinds:
            return advice
    if token.type == "ASSIGN" and "COLON" in kinds and "NUMBER" not in kinds:
        return "a declaration has a type, and then its value: `x : INT := 5;`"
    if {"FUNCTION", "TYPE"} <= kinds and (token.type == "NAME" or "FOR" in kinds or token.type in STATEMENTS):
        return "statements stand in a POU: PROGRAM Main .. END_PROGRAM"
    if token.type in ("STRUCT", "UNION") and {"FUNCTION", "TYPE"} <= kinds:
        return f"write TYPE Name : {token.type} .. END_{token.type} END_TYPE"
    if token.type in lexis().reserved - MIDDLE and "NAME" in kinds and "IF" not in kinds and token.type[:4] != "END_":
        return f"{token.text} is a reserved word and cannot be a name"
    if (token.type in ("RSQB", "COLON", "COMMA") and "RANGE" in kinds and "COMMA" not in kinds) or kinds == {"LSQB"}:
        return "an array is written ARRAY [0..9] OF INT"
    if token.type == "PART" and "NUMBER" in kinds:
        return "a number has digits in front of its point, as 0.5"
    return ""
