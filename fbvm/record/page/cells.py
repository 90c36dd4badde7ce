"""How a page carries a value and shows it: the cell of memory that it is read from, and the form of its text.

Numbers are written by the page itself, so that no text of any scan has to be made here; other values, such as strings and
dates, are carried as texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fbvm.base.types import ELEMENTARY, EnumType, StringType, base, families, machine
from fbvm.record.trace.recorder import HEXADECIMAL_AREAS, Signal

BIT, TEXT = "bit", "text"
SIZES = {BIT: 1, "i8": 1, "u8": 1, "i16": 2, "u16": 2, "i32": 4, "u32": 4, "i64": 8, "u64": 8, "f32": 4, "f64": 8, TEXT: 4}
"""Bytes of an element of a column, by the code of its cell.  A bit is a byte 0 or 1, a text the number of one."""
WORD = "u16"


@dataclass(frozen=True)
class Cell:
    """A value in the memory: its first byte and its code.  `bit` is that of a BOOL which shares its byte, else None.

    Of a text `signal` is the number of its signal, and `size` how many bytes it is made of; 0 if they may lie anywhere."""

    code: str
    offset: int
    bit: int | None = None
    signal: int = -1
    size: int = 0


def cell_of(signal: Signal, number: int) -> Cell:
    """The cell of signal number `number`."""
    place, kind = signal.place, base(signal.place.type)
    code = machine(kind)
    if place.hops or code == "ref":
        return Cell(TEXT, -1, signal=number)
    if isinstance(kind, StringType) or families(kind) & {"ANY_DATE", "ANY_CHAR"}:
        return Cell(TEXT, place.offset, signal=number, size=place.type.size)
    return Cell(BIT, place.offset, place.bit) if code == "b" else Cell(code, place.offset)


def form_of(signal: Signal) -> dict[str, Any]:
    """How the page writes a number: `form` is "" for digits, "hex" or "time"; `texts` are those of some values."""
    kind = base(signal.place.type)
    texts = {str(value): text for value, text in kind.shown.items()} if isinstance(kind, EnumType) else {}
    wanted = (signal.place.hexadecimal or signal.place.area in HEXADECIMAL_AREAS) and machine(kind)[:1] in ("i", "u")
    form = "hex" if wanted else "time" if kind in _DURATIONS else ""
    if wanted:
        texts = {}
    texts |= {str(value): text for value, text in signal.meanings}
    return {"form": form, "texts": texts}


_DURATIONS = tuple(ELEMENTARY[name] for name in ("TIME", "LTIME"))
