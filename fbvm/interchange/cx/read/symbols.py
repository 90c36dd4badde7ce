"""Tables of symbols to declarations: what each row declares, and under which name."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fbvm.base.areas import AddressError, parse_address
from fbvm.base.digits import whole_number
from fbvm.base.types import DINT, INT, LINT, UDINT, UINT, ULINT
from fbvm.interchange.cx.markup import Row
from fbvm.syntax.st.lexer import lexis

TYPES = {
    "BOOL": "BOOL", "CHANNEL": "WORD", "WORD": "WORD", "DWORD": "DWORD", "LWORD": "LWORD", "INT": "INT", "UINT": "UINT",
    "DINT": "DINT", "UDINT": "UDINT", "LINT": "LINT", "ULINT": "ULINT", "REAL": "REAL", "LREAL": "LREAL", "UINT_BCD": "WORD",
    "UDINT_BCD": "DWORD", "ULINT_BCD": "LWORD"}  # fmt: skip
"""Types of CX-Programmer -> types of IEC 61131-3.  A CHANNEL is a word of no type, or the first of several."""
BLOCK = "FUNCTION BLOCK"
NUMBERED = ("TIMER", "COUNTER")
_ARRAY = re.compile(r"([A-Z_]+)\[(\d{1,6})\]")
_NAME = re.compile(r"[^\W\d]\w*")


class SymbolError(Exception):
    """A row that declares nothing that fbvm has; the argument says why."""


@dataclass(frozen=True)
class Symbol:
    """A row of a table: `name` as rungs write it, `own` as the sources do; `name` "" is the comment of an address."""

    row: Row
    name: str
    own: str
    address: str
    type: str
    block: str
    comment: str

    @property
    def is_constant(self) -> bool:
        """Whether the row names a number."""
        return self.type == "NUMBER"

    @property
    def is_numbered(self) -> bool:
        """Whether the row names a timer or a counter."""
        return self.type in NUMBERED

    def declared(self, block: str) -> str:
        """The declaration in Structured Text; `block` is what the sources call its function block.  Raises SymbolError."""
        if self.is_constant:
            if not re.fullmatch(r"[+-]?\d{1,10}", self.address):
                raise SymbolError(f"{self.address} is no number")
            value = whole_number(self.address)
            kinds = (DINT, LINT) if value < INT.low else (INT,) if value < 0 else (UINT, UDINT, ULINT)
            kind = next(kind for kind in kinds if value in range(kind.low, kind.high + 1))
            return f"{self.own} : {kind.name} := {value};"
        place = f" AT {location(self.address, self.type)}" if self.address else ""
        return f"{self.own}{place} : {block or self._spec()};"

    def _spec(self) -> str:
        found = _ARRAY.fullmatch(self.type)
        kind = TYPES.get(found[1] if found else self.type)
        if kind is None:
            raise SymbolError(f"the type {self.type} is not known")
        return f"ARRAY [0..{whole_number(found[2]) - 1}] OF {kind}" if found else kind


def location(address: str, kind: str) -> str:
    """An address as AT takes it.  Raises SymbolError for one that is none."""
    text = re.sub(r"^(?:DM|HR|AR)(?=\d)", lambda area: {"DM": "D", "HR": "H", "AR": "A"}[area[0]], address)
    text = f"CIO {text}" if text[:1].isdigit() else text
    if kind == "BOOL":
        text = re.sub(r"^([TC])(?=\d+$)", lambda area: {"T": "TF", "C": "CNF"}[area[0]], text)
    try:
        parse_address(text)
    except AddressError as error:
        raise SymbolError(str(error)) from None
    return text


def spelling(name: str) -> str:
    """A name of CX-Programmer as Structured Text can have it: a reserved word gets an underscore behind it."""
    words = lexis()
    made = re.sub(r"\W", "_", name)
    made = re.sub(r"_{2,}", "_", made)
    made = made if _NAME.match(made) else f"_{made}" if made else "Unnamed"
    made = made.rstrip("_") or "Unnamed"
    return f"{made}_1" if words.words.get(made.upper()) in words.reserved else made


def symbols(rows: Iterable[Row]) -> list[Symbol]:
    """The symbols of a table, in the order of its rows; names that could not be told apart get a number."""
    made: list[Symbol] = []
    taken: set[str] = set()
    for row in rows:
        fields = [field.strip() for field in row.fields]
        if len(fields) < 4:
            continue
        name, address, kind = fields[:3]
        block = fields[3] if len(fields) > 5 else ""
        own = spelling(name) if name else ""
        free, number = own, 1
        while own and free.casefold() in taken:
            number += 1
            free = f"{own}_{number}"
        taken.add(free.casefold())
        address = "" if address in ("[Auto]", "Auto") else address
        made.append(Symbol(row, name, free, address, kind.upper(), block, " ".join(row.fields[-1].split())))
    return made
