"""Layout: where each global, program instance and frame lies in the flat buffer, and what it holds at power-on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.types import ArrayType, Field, StructType, Type, fold
from fbvm.check.checker import Checker
from fbvm.check.facts import Pou, Variable, holds_block
from fbvm.code.image import Layout, Objects, Retained
from fbvm.code.objects import Numbering
from fbvm.code.operations import LEASE_BYTES

_CHUNK = 64
"""Initial bytes are kept in runs of chunks that are not all zero."""


@dataclass
class Placed:
    """The finished layout: sizes, symbols, initial bytes, retained places."""

    layout: Layout
    symbols: dict[str, Field] = field(default_factory=dict)
    initial: list[tuple[int, bytes]] = field(default_factory=list)
    retained: list[Retained] = field(default_factory=list)
    objects: Objects = field(default_factory=Objects)


def place(checker: Checker) -> Placed:
    """Give every variable its place; blocks' types learn where their located variables lie."""
    slots = bytearray()
    for variable in checker.global_order:
        if variable.place == "abs":
            slots += bytes(-len(slots) % 8)
            variable.offset = SLOTS_OFFSET + len(slots)
            slots += variable.initial
    frames = len(slots)
    for pou in checker.bodies:
        frames += -frames % 8
        pou.frame_offset = SLOTS_OFFSET + frames
        frames += pou.frame_size
    frames += -frames % 8
    leases, leases_at = len(checker.project.facts.leases), SLOTS_OFFSET + frames
    frames += leases * LEASE_BYTES
    placed = Placed(Layout(frames, tuple(sorted(checker.e_banks)), tuple(checker.mailboxes.values())))
    located = [v for v in checker.global_order if v.place == "area"]
    for pou in checker.bodies:
        located += [v for v in pou.order if v.place == "area"]
    _place_located(located, placed)
    for pou in checker.bodies:
        _fill_in(pou)
    placed.objects = Objects(_numbered(checker, slots), leases, leases_at)
    placed.initial += _runs(slots)
    for variable in checker.global_order:
        placed.symbols.setdefault(fold(variable.name), _symbol(variable))
        placed.retained += _retained(variable, checker)
    return placed


def _numbered(checker: Checker, slots: bytearray) -> tuple[tuple[int, int], ...]:
    """Give numbers to all objects; instances learn those of their variables in their initial bytes."""
    numbering = Numbering(checker)
    numbering.single()
    for variable in checker.global_order:
        if variable.place == "abs":
            numbering.instances(slots, variable.type, variable.offset)
    for pou in checker.bodies:
        frame = bytearray(pou.frame_initial)
        for variable in pou.order:
            if variable.place == "frame" and not variable.reference:
                numbering.instances(frame, variable.type, pou.frame_offset + variable.offset, pou.frame_offset)
        pou.frame_initial = bytes(frame)
    return tuple(numbering.extents)


def _place_located(variables: list[Variable], placed: Placed) -> None:
    areas = placed.layout.areas
    bits: dict[int, int] = {}
    for variable in variables:
        assert variable.location is not None
        variable.offset = areas[variable.location.area].offset + variable.location.byte_offset()
        if not variable.explicit:
            continue
        if variable_bit(variable) is None:
            placed.initial.append((variable.offset, variable.initial))
        elif variable.initial != b"\0":
            bits[variable.offset] = bits.get(variable.offset, 0) | 1 << variable.location.bit_in_byte()
    placed.initial += [(offset, bytes((value,))) for offset, value in bits.items()]


def variable_bit(variable: Variable) -> int | None:
    """The bit in its byte on which a BOOL is located, or None for what fills bytes."""
    location = variable.location
    if variable.place != "area" or location is None:
        return None
    return location.bit_in_byte() if location.bit is not None or location.area in ("TF", "CNF", "CF") else None


def _fill_in(pou: Pou) -> None:
    if pou.type is None:
        return
    for variable in pou.order:
        if variable.place == "area":
            made = pou.type.fields[fold(variable.name)]
            pou.type.fields[fold(variable.name)] = replace(made, offset=variable.offset, bit=variable_bit(variable))


def _symbol(variable: Variable) -> Field:
    return Field(variable.name, variable.type, variable.offset, variable.kind, variable_bit(variable), absolute=True,
                 constant=variable.constant, hexadecimal=variable.hexadecimal)


def _runs(content: bytearray) -> Iterator[tuple[int, bytes]]:
    """Runs of bytes that are not zero, in whole chunks."""
    start: int | None = None
    for at in range(0, len(content) + _CHUNK, _CHUNK):
        used = any(content[at:at + _CHUNK])
        if used and start is None:
            start = at
        elif not used and start is not None:
            yield SLOTS_OFFSET + start, bytes(content[start:at])
            start = None


def _retained(variable: Variable, checker: Checker) -> Iterator[Retained]:
    if variable.place == "abs":
        yield from _retained_in(variable.type, variable.offset, variable.name, checker, variable.retain)


def _retained_in(kind: Type, offset: int, path: str, checker: Checker, whole: bool) -> Iterator[Retained]:
    """A `whole` value, or RETAIN variables of instances inside it; headers of instances belong to the program."""
    if whole and not holds_block(kind):
        yield Retained(path, offset, kind.size)
    elif isinstance(kind, ArrayType) and isinstance(kind.element, StructType | ArrayType):
        for index in range(kind.count):
            yield from _retained_in(kind.element, offset + index * kind.element.size, f"{path}[{index}]", checker, whole)
    elif isinstance(kind, StructType) and not kind.block:
        for member in kind.fields.values():
            yield from _retained_in(member.type, offset + member.offset, f"{path}.{member.name}", checker, whole)
    elif isinstance(kind, StructType) and kind.block:
        for variable in checker.block_of(kind).order:
            if variable.place != "self" or variable.reference:
                continue
            name = f"{path}.{variable.name}"
            yield from _retained_in(variable.type, offset + variable.offset, name, checker, whole or variable.retain)
