"""Operands of ladder instructions as expressions: `0.00`, `D100`, `#1234`, `&10`, `T0010`, `P_On`, symbols.

What an operand means depends on what the instruction wants there (a letter of `grammar/mnemonics.txt`): `0010` is a
word, the number of a timer or a part of a bit's address.  Forms and marks: W451 sec. 1-1 and 3-8, W394 2-1, W474 1-3.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from fbvm.base.areas import (
    AREAS,
    E_NAMES,
    E_PLC_ADDRESS,
    E_WORDS,
    FLAG_AREAS,
    PLC_ADDRESSES,
    Address,
    AddressError,
    parse_address,
)
from fbvm.base.digits import whole_number
from fbvm.syntax import tree
from fbvm.syntax.tree import Argument, Binary, Call, Direct, Expr, Index, Literal, Member, Name, NameRef
from fbvm.syntax.tree.ladder import Contents, Memory, Words

SYMBOLS = {
    "P_GE": "CF000", "P_NE": "CF001", "P_LE": "CF002", "P_ER": "CF003", "P_CY": "CF004", "P_GT": "CF005", "P_EQ": "CF006",
    "P_LT": "CF007", "P_N": "CF008", "P_OF": "CF009", "P_UF": "CF010", "P_AER": "CF011", "P_0_1S": "CF100", "P_0_2S": "CF101",
    "P_1S": "CF102", "P_0_02S": "CF103", "P_1MIN": "CF104", "P_ON": "CF113", "P_OFF": "CF114", "P_FIRST_CYCLE": "A200.11",
    "P_FIRST_CYCLE_TASK": "A200.15", "P_MAX_CYCLE_TIME": "A262", "P_CYCLE_TIME_VALUE": "A264", "P_OUTPUT_OFF_BIT": "A500.15"}
"""Symbols that every program has (W473 6-21 p6-43; numbers of flags from memory of the family, assumed)."""

_TYPES = {"w": "WORD", "W": "WORD", "d": "DWORD", "q": "LWORD", "n": "UINT"}
_REALS = {"r": "REAL", "l": "LREAL"}
_BITS = {"WORD": 16, "DWORD": 32, "LWORD": 64, "UINT": 16}
_OLD = re.compile(r"\d{5,6}")
_SYMBOL = re.compile(r"[^\W\d]\w*(?:\.[^\W\d]\w*|\[\d+\])*")
_C_SERIES = re.compile(r"(TIM|CNT|HR|AR|DM)(\d+)(\.\d+)?", re.I)
"""Addresses as programs for the C series have them."""
_AREAS_OF_C_SERIES = {"TIM": "T", "CNT": "C", "HR": "H", "AR": "A", "DM": "D"}
_REAL = re.compile(r"[+-]\d+[.,]\d+(?:[Ee][+-]?\d+)?")
_TASK = re.compile(r"TK\d+", re.I)
_REGISTER = re.compile(r"([ID]R)(\d+)", re.I)
_POINTED = re.compile(r"([+-]?\d+|DR\d+)?,(-{0,2})IR(\d+)(\+{0,2})", re.I)
"""An operand by index register: `5,IR0` with an offset, `,-IR0` counted down before its use, `,IR0+` counted up after it."""
TASKS = 128
"""Number of cyclic tasks, and of their flags."""
REGISTERS = 16
"""Number of index registers, and of data registers."""
BCD = {"z": "w", "Z": "d"}
"""Letter for a BCD operand -> the letter for the same operand in binary."""
WORDS = {"d": 2, "r": 2, "q": 4, "l": 4}
"""Letter -> number of words of the operand, if more than one."""

Reach = Callable[[Expr, int, bool], NameRef]
"""Takes a PLC memory address that a step computes, the number of words there and whether they are written; returns the
variable that keeps the address."""


class OperandError(Exception):
    """An operand that the instruction cannot take; the arguments are a message and a hint, `place` its start and end."""

    place: tuple[int, int] | None = None


def _nowhere(address: Expr, words: int, written: bool) -> NameRef:
    raise OperandError("an address that is worked out cannot stand here", "")


class Operands:
    """Makes expressions of the operands of one LADDER.  `located` grows by the variables that these need at addresses of PLC
    memory: (address, letter) -> declaration.  `numbered` are symbols of timers and counters, in capitals."""

    def __init__(self, reach: Reach = _nowhere, numbered: Mapping[str, str] | None = None) -> None:
        self.reach = reach
        self.numbered = {} if numbered is None else numbered
        self.own: dict[str, tuple[str, str]] = {}
        """Symbols of timers and counters of each instance, in capitals: T or C, and the name of the present value."""
        self.role = ""
        self.located: dict[tuple[str, str], tree.VarDecl] = {}

    def expression(self, text: str, wanted: str, start: int, end: int, role: str = "a pin") -> Expr:
        """What `text` stands for where an instruction wants `wanted`, as its operand `role`.  Raises OperandError."""
        self.role = role
        if wanted in BCD:
            wanted = BCD[wanted]
            if text[:1] in "#&+-" and "," not in text:
                _check_decimal(text, wanted, role)
        text = self.numbered.get(text.upper(), text)
        if wanted == "x" and not _REGISTER.fullmatch(text):
            raise OperandError(f"{text} cannot be {role}", "write IR0 to IR15")
        if _TASK.fullmatch(text):
            return self._task(text, wanted, start, end)
        if register := _REGISTER.fullmatch(text):
            return self._register(register, wanted, start, end)
        if "," in text and not _REAL.fullmatch(text):
            return self._pointed(text, wanted, start, end)
        if (own := self.own.get(text.upper())) and wanted not in "bBv":
            return self._own_value(text, own[1], wanted, start, end)
        if text[:1] in "#&+-":
            return self._constant(text, wanted, start, end)
        if text[:1] in "@*":
            return self._indirect(text, wanted, start, end)
        known = SYMBOLS.get(text.upper())
        if known is None and _SYMBOL.fullmatch(text) and not _is_address(text):
            return self._symbol(text, wanted, start, end)
        return self._direct(_address(known or text, wanted), wanted, start, end)

    def pin(self, text: str, start: int, end: int) -> Expr:
        """The expression for a pin of a function block; a constant has no type, so that it takes that of the pin."""
        if text[0] in "#&+-":
            real = _REAL.fullmatch(text)
            value = float(text.replace(",", ".")) if real else _number(text, 64)
            return Literal(start, end, "real" if real else "int", value, None, text)
        text = self.numbered.get(text.upper(), text)
        wanted = "b" if "." in text and not _SYMBOL.fullmatch(text) or text.upper() in SYMBOLS else "w"
        if _SYMBOL.fullmatch(text) and not _is_address(text) and text.upper() not in SYMBOLS:
            place = self._symbol(text, "b", start, end)
        else:
            place = self.expression(text, wanted, start, end)
        return Contents(start, end, place, "", None)

    def _own_value(self, text: str, name: str, wanted: str, start: int, end: int) -> Expr:
        """The present value of a timer or counter of the instance."""
        if wanted not in "wWaA":
            raise OperandError(f"{text} cannot be {self.role}", "its present value is one word, and it has no number")
        value = NameRef(start, end, name)
        return value if wanted in "wW" else Words(start, end, value)

    # --- constants ---

    def _constant(self, text: str, wanted: str, start: int, end: int) -> Expr:
        kind = _REALS.get(wanted) or _TYPES.get(wanted)
        if kind is None or wanted == "W":
            raise OperandError(f"the constant {text} cannot be {self.role}", "write an address or a symbol")
        if wanted in _REALS:
            if not _REAL.fullmatch(text):
                raise OperandError(f"{text} is no REAL constant", "write its sign and a point, as in +1.5")
            return Literal(start, end, "real", float(text.replace(",", ".")), kind, text)
        return Literal(start, end, "int", _number(text, _BITS[kind]), kind, text)

    # --- addresses ---

    def _direct(self, address: Address, wanted: str, start: int, end: int) -> Expr:
        is_bit = address.bit is not None or address.area in FLAG_AREAS
        if wanted == "m":
            if address.area not in ("T", "C"):
                raise OperandError(f"{address} is no present value", "write T0005 or C0005")
            wanted = "w"
        if is_bit != (wanted in "bB") and wanted != "v":
            raise OperandError(f"{address} is a {'bit' if is_bit else 'word'}, and {self.role} is a "
                               f"{'bit' if wanted in 'bB' else 'word'}", "a bit is written as word.bit, as in 0.05 or W3.15")
        if wanted in "bBwWnv":
            shown = f"{address.area}{address.number}" if address.area in FLAG_AREAS else str(address).replace(" ", "")
            return Direct(start, end, f"%{shown.removeprefix('%')}")
        return NameRef(start, end, self._at(address, wanted, start, end))

    def _at(self, address: Address, wanted: str, start: int, end: int) -> str:
        """The name of the variable at an address for an operand that is longer than a word."""
        wanted = wanted.upper() if wanted == "a" else wanted
        key = str(address), wanted
        if key not in self.located:
            name = Name(start, end, f"${address}:{wanted}")
            place = f"%{address.area}W{address.byte_offset() // 2}" if wanted == "A" and address.size_bits else str(address)
            self.located[key] = tree.VarDecl(start, end, (name,), tree.Location(start, end, place),
                                             _spec(address, wanted, start, end), None)
        return self.located[key].names[0].text

    def _indirect(self, text: str, wanted: str, start: int, end: int) -> Expr:
        """`@D100`: the word of D whose number is in D100; numbers beyond D go on in E bank 0.  `*D100`: the same with a number in
        BCD.  With another number the step is not executed."""
        pointer = _address(text[1:], "w")
        if pointer.area not in ("D", *E_NAMES):
            raise OperandError(f"{text} does not point anywhere: only D and E words do", "write @D.. or *D..")
        if wanted in "bBtcm":
            raise OperandError(f"{text} is a word, and {self.role} is a {'bit' if wanted in 'bB' else 'number'}", "")
        base = PLC_ADDRESSES["D"] if pointer.area == "D" else E_PLC_ADDRESS + E_WORDS * E_NAMES.index(pointer.area)
        name = "CX_Decimal" if text[0] == "*" else "WORD_TO_UDINT"
        number = self._called(name, start, end, self._direct(pointer, "w", start, end))
        return self._memory(Binary(start, end, "+", self._number(base, start, end), number, start), wanted, start, end)

    # --- index and data registers ---

    def _task(self, text: str, wanted: str, start: int, end: int) -> Expr:
        """TK03: whether a cyclic task is executed."""
        number = whole_number(text[2:])
        if number >= TASKS or wanted != "b":
            raise OperandError(f"{text} cannot be {self.role}", f"TK000 to TK{TASKS - 1} are flags that are read")
        return Index(start, end, NameRef(start, end, "CX_TK"), (self._index(number, start, end),))

    def _register(self, register: re.Match[str], wanted: str, start: int, end: int) -> Expr:
        """IR0 as two words, DR0 as one."""
        kind, number = register[1].upper(), whole_number(register[2])
        if number >= REGISTERS:
            raise OperandError(f"there is no {register[0]}", f"{kind}0 to {kind}{REGISTERS - 1} are there")
        if wanted not in ("dAax" if kind == "IR" else "wWAa"):
            raise OperandError(f"{register[0]} cannot be {self.role}", "an index register has two words, a data register one")
        if wanted in "dw":
            return self._called("CX_Pointed" if kind == "IR" else "CX_Offset", start, end, self._index(number, start, end))
        return Index(start, end, NameRef(start, end, f"CX_{kind}"), (self._index(number, start, end),))

    def _pointed(self, text: str, wanted: str, start: int, end: int) -> Expr:
        """`,IR0` and its forms: the word, or the bit, at the address in an index register; the address of a bit counts bits."""
        found = _POINTED.fullmatch(text)
        if not found or whole_number(found[3]) >= REGISTERS:
            raise OperandError(f"{text} is no operand",
                               f"write ,IR0 +5,IR0 DR0,IR0 ,IR0+ or ,-IR0, with IR0 to IR{REGISTERS - 1}")
        if wanted in "tcmx":
            raise OperandError(f"{text} cannot be {self.role}",
                               "numbers of timers and counters are known before the program runs")
        offset, down, register, up = found[1] or "", len(found[2]), whole_number(found[3]), len(found[4])
        if down and up or offset and (down or up):
            raise OperandError(f"{text} has more than one offset", "a register is counted up, or down, or has an offset")
        if down or up:
            step = [Literal(start, end, "int", value, "DINT", str(value)) for value in (-down, up)]
            stepped = self._called("CX_Step", start, end, self._index(register, start, end), *step)
            return self._memory(stepped, wanted, start, end)
        pointed = self._called("CX_Pointed", start, end, self._index(register, start, end))
        place: Expr = self._called("DWORD_TO_UDINT", start, end, pointed)
        if offset[:2].upper() == "DR":
            data = self._register(_REGISTER.fullmatch(offset) or found, "w", start, end)
            more = self._called("INT_TO_UDINT", start, end, self._called("WORD_TO_INT", start, end, data))
            place = Binary(start, end, "+", place, more, start)
        elif offset:
            if not -2048 <= whole_number(offset) <= 2047:
                raise OperandError(f"{text} leads too far", "offsets are -2048 to +2047")
            place = Binary(start, end, "+", place, self._number(whole_number(offset) & 0xFFFF_FFFF, start, end), start)
        return self._memory(place, wanted, start, end)

    def _memory(self, address: Expr, wanted: str, start: int, end: int) -> Expr:
        """The operand at a PLC memory address that the step computes."""
        if wanted in "bB":
            return Memory(start, end, self.reach(address, 0, wanted == "B"), "BOOL")
        if wanted == "v":
            raise OperandError("the address of what is pointed at is in the register already", "copy that with MOVL")
        kept = self.reach(address, WORDS.get(wanted, 1), wanted in "WA")
        return Memory(start, end, kept, "" if wanted in "aA" else _REALS.get(wanted) or _TYPES[wanted])

    def _index(self, register: int, start: int, end: int) -> Expr:
        return Literal(start, end, "int", register, "UINT", str(register))

    def _number(self, value: int, start: int, end: int) -> Expr:
        return Literal(start, end, "int", value, "UDINT", str(value))

    def _called(self, function: str, start: int, end: int, *values: Expr) -> Expr:
        return Call(start, end, NameRef(start, end, function), tuple(Argument(start, end, "", None, v) for v in values))

    # --- symbols ---

    def _symbol(self, text: str, wanted: str, start: int, end: int) -> Expr:
        place = self._place(text, start, end)
        if wanted in "aA":
            return Words(start, end, place)
        if wanted not in "wdqnrl":
            return place
        kind = _REALS.get(wanted) or _TYPES[wanted]
        converted = self._place(text, start, end)
        if wanted not in _REALS:
            converted = self._called(f"TO_{kind}", start, end, converted)
        return Contents(start, end, place, kind, converted)

    def _place(self, text: str, start: int, end: int) -> Expr:
        """A symbol with its members and elements; each name has its own place if the operand stands in the text as it is here."""
        first, *rest = re.finditer(r"\w+|\[\d+\]", text)
        is_written = end - start == len(text)

        def span(part: re.Match[str]) -> tuple[int, int]:
            return (start + part.start(), start + part.end()) if is_written else (start, end)

        place: Expr = NameRef(*span(first), first[0])
        for part in rest:
            at, behind = span(part)
            if part[0].startswith("["):
                number = Literal(at, behind, "int", whole_number(part[0][1:-1]), None, part[0][1:-1])
                place = Index(start, behind, place, (number,))
            else:
                place = Member(start, behind, place, Name(at, behind, part[0]))
        return place


def _number(text: str, bits: int) -> int:
    """The bits of an integer constant."""
    digits = text[1:]
    if text[0] == "#":
        if not re.fullmatch(r"[0-9A-Fa-f]+", digits):
            raise OperandError(f"{text} is no constant", "behind # stand hexadecimal digits")
        value = int(digits, 16)
    else:
        if not digits.isdecimal():
            raise OperandError(f"{text} is no constant", "behind &, + and - stand decimal digits")
        value = whole_number(digits) * (-1 if text[0] == "-" else 1)
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if text[0] in "+-" else (0, (1 << bits) - 1)
    if not low <= value <= high:
        raise OperandError(f"{text} does not fit in {bits} bits", "")
    return value & (1 << bits) - 1


def _check_decimal(text: str, wanted: str, role: str) -> None:
    """Refuse a constant with digits above 9 where BCD is read: the instruction would never be executed."""
    bits = _BITS[_TYPES[wanted]]
    digits = f"{_number(text, bits):0{bits // 4}X}"
    if not digits.isdecimal():
        raise OperandError(f"{text} is {digits} hex, and {role} is read as BCD",
                           f"write #{text[1:]}" if text[1:].isdecimal() else "BCD has the digits 0 to 9")


def _is_address(text: str) -> bool:
    """Whether a word that could be a symbol is an address such as D100 or W5."""
    return bool(_C_SERIES.fullmatch(text) or re.fullmatch(r"(?:CIO|DM|D|W|H|A|T|C|E[0-9A-F]_)\d+", text, re.I))


def _address(text: str, wanted: str) -> Address:
    """The address that a text means for an operand of the kind `wanted`.  Raises OperandError."""
    if older := _C_SERIES.fullmatch(text):
        number, bit = older[2], older[3] or ""
        if wanted in "bB" and older[1].upper() in ("HR", "AR") and not bit:
            number, bit = number[:-2] or "0", f".{number[-2:]}"
        text = f"{_AREAS_OF_C_SERIES[older[1].upper()]}{number}{bit}"
    if _OLD.fullmatch(text) and wanted in "bB":
        text = f"{whole_number(text[:-2])}.{text[-2:]}"
    if wanted in "bBv" and re.fullmatch(r"[TC]\d+", text, re.I):
        text = ("TF" if text[0] in "Tt" else "CNF") + text[1:]
    try:
        return parse_address(text)
    except AddressError as error:
        raise OperandError(str(error), "") from error


def _spec(address: Address, wanted: str, start: int, end: int) -> tree.TypeSpec:
    """The type of a variable at an address: words up to the end of the area, or the number that begins there."""
    if wanted not in "aA":
        return tree.NamedType(start, end, _REALS.get(wanted) or _TYPES[wanted])
    size_bytes = AREAS[address.area].size_bytes if address.area in AREAS else 2 * E_WORDS
    last = (size_bytes - address.byte_offset()) // 2 - 1
    bounds = tuple(Literal(start, end, "int", value, None, str(value)) for value in (0, last))
    return tree.ArraySpec(start, end, ((bounds[0], bounds[1]),), tree.NamedType(start, end, "WORD"))
