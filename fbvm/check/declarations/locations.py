"""Where variables are declared AT: the address behind it, checked against the area and the type."""

from __future__ import annotations

import re

from fbvm.base.areas import E_NAMES, FLAG_AREAS, PORTABLE_AREAS, SIZED_AREAS, Address, AddressError
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, ArrayType, StringType, StructType, Type, base
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Variable, holds_block
from fbvm.syntax import tree

_WITHOUT_SIGN = re.compile(r"[IQM][XBWDL]?\d+(?:\.\d+)*", re.IGNORECASE)


def location_of(context: Context, declared: tree.VarDecl, kind: Type, source: Source) -> Address | None:
    """The address behind AT, checked against the type; None after a diagnostic."""
    node = declared.location
    assert node is not None
    if is_open(node, kind):
        return None
    try:
        address = context.address(node.text, source)
    except AddressError as error:
        context.report.add("S0601", source, node, str(error), _hint(node.text, declared, kind))
        return None
    if address.area in ("T", "C") and base(kind) == BOOL:
        address = Address("TF" if address.area == "T" else "CNF", address.number)
    if len(declared.names) > 1:
        context.report.add("S0604", source, node, "one location cannot serve several names")
        return None
    return address if _fits(context, address, kind, source, node) else None


_INCOMPLETE = re.compile(r"%([IQM]|[A-Z]+?)([XBWDL]?)(?:\*|\d[\d.]*)", re.I)
_SIZES = {"X": 1, "B": 8, "W": 16, "D": 32, "L": 64}


def completes(context: Context, address: Address, variable: Variable, node: tree.Location, source: Source) -> bool:
    """True if VAR_CONFIG may give an address to a variable `AT %I*`: it is one of that area and, for `%IW*`, of that size.

    `node` is the address as it is written.  False after a diagnostic (IEC 61131-3 ed. 3, table 16: `*` stands for what is left
    open, and the letters in front of it are not)."""
    area, size = _parts(variable)
    where = f"{variable.name} is declared AT {variable.open_location}"
    if area not in _names(address.area):
        letters = _names(address.area)[-1]
        context.report.add("S0604", source, node, f"{where}, and {address} lies in another area",
                           f"write {example(variable)}, or declare it  AT %{letters}*",
                           (variable.source, variable.node.start, "declared here"))
        return False
    written = 1 if address.bit is not None else address.size_bits
    if size and written and size != written:
        context.report.add("S0602", source, node, f"{where}, and {address} has another size", "",
                           (variable.source, variable.node.start, "declared here"))
        return False
    return True


def example(variable: Variable) -> str:
    """An address that VAR_CONFIG may give to a variable `AT %I*`."""
    area, _ = _parts(variable)
    bit = base(variable.type) == BOOL
    if area in PORTABLE_AREAS:
        letter = "X" if bit else {1: "B", 4: "D", 8: "L"}.get(variable.type.size, "W")
        return f"%{area}{letter}0" + (".0" if bit else "")
    return str(Address({"DM": "D"}.get(area, area), 0, 0 if bit else None))


def _parts(variable: Variable) -> tuple[str, int]:
    """The area and the size in bits that a variable `AT %IW*` asks for; 0 where it leaves the size open."""
    said = _INCOMPLETE.fullmatch(variable.open_location)
    assert said is not None
    return said[1].upper(), _SIZES.get(said[2].upper(), 0)


def _names(area: str) -> tuple[str, ...]:
    """The letters that name an area: those of its words, of its flags, and of all banks of E."""
    if area in E_NAMES:
        return area, "EM", "E"
    if area in SIZED_AREAS:
        return (area[1],)
    return {"D": ("DM", "D"), "TF": ("TF", "T"), "CNF": ("CNF", "C")}.get(area, (area,))


def _hint(text: str, declared: tree.VarDecl, kind: Type) -> str:
    """The hint for a text that is no address: a `%` in front, or for the name of a variable a reference."""
    if _WITHOUT_SIGN.fullmatch(text):
        return f"write %{text.upper()}"
    name = declared.names[0].text if declared.names else "x"
    return f"another name for a variable is a reference: {name} : REFERENCE TO {kind} REF= {text};" if text.isidentifier() else ""


def _fits(context: Context, address: Address, kind: Type, source: Source, node: tree.Node) -> bool:
    """True if a variable of the type can lie at the address; else a diagnostic."""
    is_bit = address.bit is not None or address.area in FLAG_AREAS
    if is_bit and isinstance(kind, ArrayType) and kind.element == BOOL:
        context.use_area(address.area)
        end = address.byte_offset() * 8 + address.bit_in_byte() + kind.count
        if end > context.areas[address.area].size_bytes * 8:
            context.report.add("S0601", source, node, f"{kind} at {address} runs past the end of the area")
            return False
        return True
    if is_bit != (base(kind) == BOOL):
        if is_bit:
            context.report.add("S0602", source, node, f"{address} is one bit and {kind} is not BOOL")
        else:
            context.report.add("S0602", source, node, f"{address} is a word and {kind} needs a bit",
                               "name a bit, such as CIO 1519.03")
        return False
    if holds_block(kind):
        context.report.add("S0604", source, node, "instances of blocks have no location")
        return False
    context.use_area(address.area)
    size = context.areas[address.area].size_bytes
    if address.size_bits and not isinstance(kind, ArrayType | StructType | StringType) \
            and kind.size * 8 != max(8, address.size_bits):
        said, taken = f"{address} has {address.size_bits} bits, {kind} {kind.size * 8}", context.project.dialect.any_width_at
        context.report.add("S0193" if taken else "S0602", source, node, said,
                           "" if taken else f"write an address of that size, or take {takers('any_width_at')}")
        if not taken:
            return False
    if address.byte_offset() + kind.size > size:
        context.report.add("S0601", source, node, f"{kind} at {address} runs past the end of the area")
        return False
    return True


def is_open(location: tree.Location, kind: Type) -> bool:
    """True for `%I*`, which VAR_CONFIG completes, and for addresses of several levels, which mean a module to its maker."""
    written = location.text.strip()
    return written.endswith("*") or _LEVELS.fullmatch(written) is not None or \
        base(kind) != BOOL and _WORD_LEVELS.fullmatch(written) is not None


_LEVELS = re.compile(r"%[IQM](?:[BWDL]\d+(?:\.\d+){2,}|X?\d+(?:\.\d+){2,})", re.I)
_WORD_LEVELS = re.compile(r"%[IQM][BWDL]?\d+\.\d+", re.I)
"""With a BOOL it is a bit of that byte or word, and without a size a bit; Beremiz has structures of extensions at %I3.0."""
