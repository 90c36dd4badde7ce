"""Operands of ladder instructions as expressions: `0.00`, `D100`, `#1234`, `&10`, `T0010`, `P_On`, symbols.

What an operand means depends on what the instruction wants there (a letter of `grammar/mnemonics.txt`): `0010` is a
word, the number of a timer or a part of a bit's address.  Forms and marks: W451 sec. 1-1 and 3-8, W394 2-1, W474 1-3.
"""

from __future__ import annotations

import re

from fbvm.base.areas import AREAS, E_NAMES, E_WORDS, FLAG_AREAS, Address, AddressError, parse_address
from fbvm.syntax import tree
from fbvm.syntax.tree import Argument, Call, Direct, Expr, Index, Literal, Member, Name, NameRef

SYMBOLS = {
    "P_GE": "CF000", "P_NE": "CF001", "P_LE": "CF002", "P_ER": "CF003", "P_CY": "CF004", "P_GT": "CF005", "P_EQ": "CF006",
    "P_LT": "CF007", "P_N": "CF008", "P_OF": "CF009", "P_UF": "CF010", "P_AER": "CF011", "P_0_1S": "CF100", "P_0_2S": "CF101",
    "P_1S": "CF102", "P_0_02S": "CF103", "P_1MIN": "CF104", "P_ON": "CF113", "P_OFF": "CF114", "P_FIRST_CYCLE": "A200.11",
    "P_FIRST_CYCLE_TASK": "A200.15", "P_MAX_CYCLE_TIME": "A262", "P_CYCLE_TIME_VALUE": "A264", "P_OUTPUT_OFF_BIT": "A500.15"}
"""Symbols that every program knows (W473 6-21 p6-43; numbers of flags from memory of the family, assumed)."""

_TYPES = {"w": "WORD", "W": "WORD", "d": "DWORD", "q": "LWORD", "n": "UINT"}
_BITS = {"WORD": 16, "DWORD": 32, "LWORD": 64, "UINT": 16}
_OLD = re.compile(r"\d{5,6}")
_SYMBOL = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*|\[\d+\])*")
_REAL = re.compile(r"[+-]\d+[.,]\d+(?:[Ee][+-]?\d+)?")
_REGISTER = re.compile(r"(?:[IDd][Rr]\d+|TK\d+|[^\[\]]*,-{0,2}IR\d+\+{0,2})", re.I)


class Wrong(Exception):
    """An operand that cannot stand where it stands; the arguments are a message and a hint."""


class Operands:
    """Makes expressions of the operands of one LADDER.  `located` fills with the variables that they need at addresses
    of the PLC's memory: (area and number, letter) -> declaration."""

    def __init__(self) -> None:
        self.located: dict[tuple[str, str], tree.VarDecl] = {}

    def expression(self, text: str, wanted: str, start: int, end: int) -> Expr:
        """What `text` stands for where an instruction wants `wanted`.  Raises Wrong."""
        if _REGISTER.fullmatch(text):
            raise Wrong(f"{text} is understood but not executed by this version", "index and data registers are not emulated")
        if text[:1] in "#&+-":
            return self._constant(text, wanted, start, end)
        if text[:1] in "@*":
            return self._indirect(text, wanted, start, end)
        known = SYMBOLS.get(text.upper())
        if known is None and _SYMBOL.fullmatch(text) and not _is_address(text):
            return self._symbol(text, wanted, start, end)
        return self._direct(_address(known or text, wanted), wanted, start, end)

    def pin(self, text: str, start: int, end: int) -> Expr:
        """What a pin of a block takes or gives: its type is the pin's, so that a constant has none of its own."""
        if text[0] in "#&+-":
            real = _REAL.fullmatch(text)
            value = float(text.replace(",", ".")) if real else _number(text, 64)
            return Literal(start, end, "real" if real else "int", value, None, text)
        wanted = "b" if "." in text and not _SYMBOL.fullmatch(text) or text.upper() in SYMBOLS else "w"
        if text[:1] not in "@*" and _SYMBOL.fullmatch(text) and not _is_address(text) and text.upper() not in SYMBOLS:
            return self._symbol(text, "b", start, end)
        return self.expression(text, wanted, start, end)

    # --- constants ---

    def _constant(self, text: str, wanted: str, start: int, end: int) -> Expr:
        kind = "REAL" if wanted == "r" else _TYPES.get(wanted)
        if kind is None or wanted == "W":
            raise Wrong(f"the constant {text} cannot stand here", "write an address or a symbol")
        if kind == "REAL":
            if not _REAL.fullmatch(text):
                raise Wrong(f"{text} is no REAL constant", "write its sign and a point, as in +1.5")
            return Literal(start, end, "real", float(text.replace(",", ".")), "REAL", text)
        return Literal(start, end, "int", _number(text, _BITS[kind]), kind, text)

    # --- addresses ---

    def _direct(self, address: Address, wanted: str, start: int, end: int) -> Expr:
        is_bit = address.bit is not None or address.area in FLAG_AREAS
        if is_bit != (wanted in "bB"):
            raise Wrong(f"{address} is a {'bit' if is_bit else 'word'}, and the instruction wants a "
                        f"{'bit' if wanted in 'bB' else 'word'}", "a bit is written as word.bit, as in 0.05 or W3.15")
        if wanted in "bBwWn":
            shown = f"{address.area}{address.number}" if address.area in FLAG_AREAS else str(address).replace(" ", "")
            return Direct(start, end, f"%{shown}")
        return NameRef(start, end, self._at(address, wanted, start, end))

    def _at(self, address: Address, wanted: str, start: int, end: int) -> str:
        """The name of a variable at an address, for what is longer than a word."""
        key = str(address), wanted
        if key not in self.located:
            name = Name(start, end, f"${address}:{wanted}")
            self.located[key] = tree.VarDecl(start, end, (name,), tree.Location(start, end, str(address)),
                                             _spec(address, wanted, start, end), None)
        return self.located[key].names[0].text

    def _indirect(self, text: str, wanted: str, start: int, end: int) -> Expr:
        """`@D100`: the word of D whose number is in D100; `*D100`: likewise in BCD."""
        if wanted not in "wWn":
            raise Wrong(f"{text} is understood but not executed here by this version",
                        "indirect addresses are executed where one word is wanted")
        pointer = _address(text[1:], "w")
        if pointer.area not in ("D", *E_NAMES):
            raise Wrong(f"{text} does not point anywhere: only D and E words do", "write @D.. or *D..")
        base = Address(pointer.area, 0)
        number = Call(start, end, NameRef(start, end, "BCD_TO_UINT" if text[0] == "*" else "WORD_TO_UINT"),
                      (Argument(start, end, "", None, self._direct(pointer, "w", start, end)),))
        return Index(start, end, NameRef(start, end, self._at(base, "A", start, end)), (number,))

    # --- symbols ---

    def _symbol(self, text: str, wanted: str, start: int, end: int) -> Expr:
        first, *rest = re.findall(r"\w+|\[\d+\]", text)
        place: Expr = NameRef(start, end, first)
        for part in rest:
            if part.startswith("["):
                place = Index(start, end, place, (Literal(start, end, "int", int(part[1:-1]), None, part[1:-1]),))
            else:
                place = Member(start, end, place, Name(start, end, part))
        if wanted not in "wdqn":
            return place
        return Call(start, end, NameRef(start, end, f"TO_{_TYPES[wanted]}"), (Argument(start, end, "", None, place),))


def _number(text: str, bits: int) -> int:
    """The bits of an integer constant."""
    digits = text[1:]
    if text[0] == "#":
        if not re.fullmatch(r"[0-9A-Fa-f]+", digits):
            raise Wrong(f"{text} is no constant", "behind # stand hexadecimal digits")
        value = int(digits, 16)
    else:
        if not digits.isdigit():
            raise Wrong(f"{text} is no constant", "behind &, + and - stand decimal digits")
        value = int(digits) * (-1 if text[0] == "-" else 1)
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if text[0] in "+-" else (0, (1 << bits) - 1)
    if not low <= value <= high:
        raise Wrong(f"{text} does not fit in {bits} bits", "")
    return value & (1 << bits) - 1


def _is_address(text: str) -> bool:
    """Whether a word that could be a symbol is the address of an area: D100, W5, TR0 is none."""
    return bool(re.fullmatch(r"(?:CIO|DM|D|W|H|A|T|C|E[0-9A-F]_)\d+", text, re.I))


def _address(text: str, wanted: str) -> Address:
    """The address that a text means where `wanted` is wanted.  Raises Wrong."""
    if _OLD.fullmatch(text) and wanted in "bB":
        text = f"{int(text[:-2])}.{text[-2:]}"
    if wanted in "bB" and re.fullmatch(r"[TC]\d+", text, re.I):
        text = ("TF" if text[0] in "Tt" else "CNF") + text[1:]
    try:
        return parse_address(text)
    except AddressError as error:
        raise Wrong(str(error), "") from error


def _spec(address: Address, wanted: str, start: int, end: int) -> tree.TypeSpec:
    """The type of a variable at an address: words up to the end of the area, or the number that begins there."""
    if wanted != "A":
        return tree.NamedType(start, end, {"d": "DWORD", "q": "LWORD", "r": "REAL"}[wanted])
    count = AREAS[address.area].count if address.area in AREAS else E_WORDS
    bounds = tuple(Literal(start, end, "int", value, None, str(value)) for value in (0, count - 1 - address.number))
    return tree.ArraySpec(start, end, ((bounds[0], bounds[1]),), tree.NamedType(start, end, "WORD"))
