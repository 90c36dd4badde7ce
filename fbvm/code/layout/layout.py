"""Layout: where each global, program instance and frame lies in the flat buffer, and what it holds at power-on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import product

from fbvm.base.areas import FLAG_AREAS, SLOTS_OFFSET, Address
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import ArrayType, Field, StructType, Type, fold
from fbvm.check.checker import Checker
from fbvm.check.recursion import stack_bytes
from fbvm.check.symbols.config_facts import Completed, Spot
from fbvm.check.symbols.containment import Containment
from fbvm.check.symbols.facts import Pou, Variable, holds_block
from fbvm.code.builder.heap import ROWS
from fbvm.code.image import Layout, Objects, Retained
from fbvm.code.layout.objects import Numbering
from fbvm.code.operations import BUFFER_OBJECT, HEAP_BYTES, LEASE_BYTES, OBJECT_SHIFT, OFFSET_SHIFT

_CHUNK = 64
"""Initial bytes are kept in runs of whole chunks of so many bytes that are not all zero."""


@dataclass
class Placement:
    """What layout decides besides the offsets of variables: parts of the Image."""

    layout: Layout
    symbols: dict[str, Field] = field(default_factory=dict)
    initial: list[tuple[int, bytes]] = field(default_factory=list)
    retained: list[Retained] = field(default_factory=list)
    objects: Objects = field(default_factory=Objects)
    frames: dict[str, dict[str, Field]] = field(default_factory=dict)
    """Variables of frames, by the folded names of POU and variable; their offsets count from the start of the buffer."""
    config_initials: list[tuple[int, Type, bytes]] = field(default_factory=list)
    """Initial values that VAR_CONFIG gives: the offset of each in the buffer, its type and its bytes."""
    stack: FrameStack | None = None
    """The stack of frames, if any POU has its frames there."""


@dataclass(frozen=True)
class FrameStack:
    """Where the frames of POUs lie whose calls may come back: `start` and `end` in the buffer; the number of the lease whose
    extent is the part in use, and where its row lies."""

    start: int
    end: int
    lease: int
    row_at: int

    @property
    def top_at(self) -> int:
        """Where in the buffer it stands how far the stack is in use."""
        return self.row_at + 4


def lay_out(checker: Checker) -> Placement:
    """Give each global variable, program instance and frame its place in the buffer.

    The offsets of variables and frames are written into the facts of the checker; types of blocks are completed with the
    places of their located variables.  The result is what the Image needs of it."""
    slots = bytearray()
    for variable in checker.global_order:
        if variable.place == "abs":
            slots += bytes(-len(slots) % 8)
            variable.offset = SLOTS_OFFSET + len(slots)
            slots += bytes(8) if variable.reference else variable.initial
    placement = _frames_and_leases(checker, len(slots))
    located = [v for v in checker.global_order if v.place == "area"]
    for pou in checker.bodies:
        located += [v for v in pou.order if v.place == "area"]
    _place_located(list(dict.fromkeys(located)), placement)
    for pou in checker.bodies:
        _complete_type(pou)
    for row in checker.var_config.completed.values():
        _apply_config(row, slots, placement)
    placement.objects = replace(placement.objects, extents=_numbered(checker, slots, placement.stack))
    placement.initial += _runs(slots)
    retaining = Containment(checker, lambda pou: any(variable.retain for variable in pou.order))
    for variable in checker.global_order:
        if "$" not in variable.name:
            placement.symbols.setdefault(fold(_path(variable)), _symbol(variable))
        if variable.place == "abs" and not variable.reference:
            placement.retained += _retained_in(variable.type, variable.offset, _path(variable), retaining, variable.retain)
    placement.frames = {fold(pou.name): found for pou in checker.bodies if (found := _in_frame(pou))}
    for access in checker.var_config.accesses:
        offset, bit = _offset_of(access.spot, placement)
        placement.symbols.setdefault(fold(access.name), Field(
            access.name, access.spot.type, offset, "VAR_ACCESS", bit, absolute=True, constant=not access.writable))
    return placement


def _frames_and_leases(checker: Checker, end: int) -> Placement:
    """The placement with the fixed frames, leases and the stack of frames behind so many bytes of variables."""
    for pou in checker.bodies:
        end += -end % 8
        pou.frame_offset = SLOTS_OFFSET + end
        end += 8 if pou.stack_bytes else pou.frame_size
    end += -end % 8
    facts, leases_at = checker.project.facts, SLOTS_OFFSET + end
    largest, stack = max((pou.stack_bytes for pou in checker.bodies), default=0), None
    stack_row, heap_row = len(facts.leases), len(facts.leases) + bool(largest)
    heap_rows = ROWS if facts.made or facts.ended else 0
    end += (heap_row + heap_rows) * LEASE_BYTES
    if largest:
        start = SLOTS_OFFSET + end
        stack = FrameStack(start, start + stack_bytes(largest), stack_row, leases_at + stack_row * LEASE_BYTES)
        end = stack.end - SLOTS_OFFSET
    objects = Objects((), heap_row, leases_at)
    if heap_rows:
        objects = Objects((), heap_row + heap_rows, leases_at, heap_rows, heap_row, SLOTS_OFFSET + end)
        end += HEAP_BYTES
    placement = Placement(Layout(end, tuple(sorted(checker.e_banks)), tuple(checker.mailboxes.values()),
                                 tuple(sorted(checker.sized)) if checker.project.dialect.sizes_apart else None),
                          objects=objects, stack=stack)
    if stack is not None:
        placement.initial.append((stack.row_at, b"".join(n.to_bytes(4, "little") for n in (stack.start, stack.start, 1, 1))))
    return placement


def _offset_of(spot: Spot, placement: Placement) -> tuple[int, int | None]:
    """The offset in the buffer of what a path of VAR_CONFIG or VAR_ACCESS names, and its bit."""
    if spot.root is None:
        assert spot.address is not None
        return _at(spot.address, placement)
    offset, bit, kind = spot.root.offset, variable_bit(spot.root), spot.root.type
    for step in spot.steps:
        if isinstance(step, int):
            assert isinstance(kind, ArrayType)
            kind = kind.element
            offset += step * kind.size
            continue
        assert isinstance(kind, StructType)
        field = kind.fields[fold(step.name)]
        offset, bit, kind = field.offset if field.absolute else offset + field.offset, field.bit, field.type
    return offset, bit


def _at(address: Address, placement: Placement) -> tuple[int, int | None]:
    is_bit = address.bit is not None or address.area in FLAG_AREAS
    return placement.layout.areas[address.area].offset + address.byte_offset(), address.bit_in_byte() if is_bit else None


def _apply_config(row: Completed, slots: bytearray, placement: Placement) -> None:
    """Put what VAR_CONFIG says into the initial bytes: a reference to the place, and the first value there."""
    offset, bit = _offset_of(row.spot, placement)
    place = _at(row.address, placement) if row.address is not None else \
        (_offset_of(row.own, placement)[0], None) if row.own is not None else None
    if place is not None:
        there, bit = place
        reference = BUFFER_OBJECT << OBJECT_SHIFT | there << OFFSET_SHIFT | (WHOLE_BYTES if bit is None else bit)
        slots[offset - SLOTS_OFFSET:offset - SLOTS_OFFSET + 8] = reference.to_bytes(8, "little")
        offset = there
    if row.initial is None:
        return
    placement.config_initials.append((offset, row.spot.type, row.initial))
    if bit is not None:
        value = 1 << bit if any(row.initial) else 0
        placement.initial.append((offset, bytes((_initial_byte(placement, offset) & ~(1 << bit) | value,))))
    elif SLOTS_OFFSET <= offset < SLOTS_OFFSET + len(slots):
        slots[offset - SLOTS_OFFSET:offset - SLOTS_OFFSET + len(row.initial)] = row.initial
    else:
        placement.initial.append((offset, row.initial))


def _numbered(checker: Checker, slots: bytearray, stack: FrameStack | None) -> tuple[tuple[int, int], ...]:
    """The extents of all objects by number; the headers of instances get the numbers of theirs (see `objects`).

    What is in instances on the stack has no extent but that of the stack."""
    numbering = Numbering(checker)
    numbering.add_single()
    for variable in checker.global_order:
        if variable.place == "abs" and not variable.reference:
            numbering.add_instances(slots, variable.type, variable.offset)
    for pou in checker.bodies:
        frame = bytearray(pou.frame_initial)
        for variable in pou.order:
            if variable.place == "frame" and not variable.reference:
                extent = (stack.start, stack.end) if stack is not None and pou.stack_bytes else None
                numbering.add_instances(frame, variable.type, pou.frame_offset + variable.offset, pou.frame_offset, extent)
        pou.frame_initial = bytes(frame)
    return tuple(numbering.extents)


def _place_located(variables: list[Variable], placement: Placement) -> None:
    """Give variables with an address their offsets, and collect their initial values; bits of one byte are put together."""
    areas = placement.layout.areas
    bits: dict[int, int] = {}
    for variable in variables:
        assert variable.location is not None
        variable.offset = areas[variable.location.area].offset + variable.location.byte_offset()
        if not variable.explicit:
            continue
        if variable_bit(variable) is None:
            placement.initial.append((variable.offset, variable.initial))
        elif isinstance(variable.type, ArrayType):
            start = variable.location.bit_in_byte()
            for number in (start + index for index, value in enumerate(variable.initial) if value):
                at = variable.offset + number // 8
                bits[at] = bits.get(at, 0) | 1 << number % 8
        elif variable.initial != b"\0":
            bits[variable.offset] = bits.get(variable.offset, 0) | 1 << variable.location.bit_in_byte()
    placement.initial += [(offset, bytes((_initial_byte(placement, offset) | value,))) for offset, value in bits.items()]


def _initial_byte(placement: Placement, offset: int) -> int:
    """What a byte of the buffer holds at power-on, by the initial values that are placed so far."""
    return next((data[offset - at] for at, data in reversed(placement.initial) if at <= offset < at + len(data)), 0)


def variable_bit(variable: Variable) -> int | None:
    """The bit in its byte on which a BOOL is located, or None for what fills bytes."""
    location = variable.location
    if variable.place != "area" or location is None:
        return None
    return location.bit_in_byte() if location.bit is not None or location.area in FLAG_AREAS else None


def _complete_type(pou: Pou) -> None:
    """Complete the type of a block with the places of variables that lie in no instance."""
    if pou.type is None:
        return
    for variable in pou.order:
        if variable.place in ("area", "abs"):
            made = pou.type.fields[fold(variable.name)]
            pou.type.fields[fold(variable.name)] = replace(made, offset=variable.offset, bit=variable_bit(variable))


def _path(variable: Variable) -> str:
    """The name under which a variable is found from outside: with that of its POU in front for a VAR_STAT, with that of its
    list for a global variable that has to be qualified."""
    if variable.owner is not None:
        return f"{variable.owner.name}.{variable.name}"
    return f"{variable.space}.{variable.name}" if variable.qualified and variable.space else variable.name


def _symbol(variable: Variable) -> Field:
    return Field(_path(variable), variable.type, variable.offset, variable.kind, variable_bit(variable), absolute=True,
                 reference=variable.reference, constant=variable.constant, hexadecimal=variable.hexadecimal, space=variable.space)


def _in_frame(pou: Pou) -> dict[str, Field]:
    """The variables of the frame of a POU: those of a function, and VAR_TEMP."""
    start, newest = (0, (pou.frame_offset,)) if pou.stack_bytes else (pou.frame_offset, ())
    return {fold(variable.name): Field(variable.name, variable.type, start + variable.offset, variable.kind,
                                       absolute=True, reference=variable.reference, constant=variable.constant,
                                       hexadecimal=variable.hexadecimal, frame_at=newest)
            for variable in pou.order if variable.place == "frame" and "$" not in variable.name}  # fmt: skip


def _runs(content: bytearray) -> Iterator[tuple[int, bytes]]:
    """Runs of bytes that are not zero, in whole chunks."""
    start: int | None = None
    for at in range(0, len(content) + _CHUNK, _CHUNK):
        used = bool(content[at:at + _CHUNK].strip(b"\0"))
        if used and start is None:
            start = at
        elif not used and start is not None:
            yield SLOTS_OFFSET + start, bytes(content[start:at])
            start = None


def _retained_in(kind: Type, offset: int, path: str, retaining: Containment, whole: bool) -> Iterator[Retained]:
    """What a warm start keeps of a value: all of it if `whole`, else RETAIN variables of instances inside it.

    Headers of instances, which hold numbers of objects, are never kept, since they belong to the program."""
    if not whole and not retaining(kind):
        return
    if whole and not holds_block(kind):
        yield Retained(path, offset, kind.size)
    elif isinstance(kind, ArrayType) and isinstance(kind.element, StructType | ArrayType):
        for number, subscripts in enumerate(product(*(range(low, high + 1) for low, high in kind.bounds))):
            name = f"{path}[{', '.join(map(str, subscripts))}]"
            yield from _retained_in(kind.element, offset + number * kind.element.size, name, retaining, whole)
    elif isinstance(kind, StructType) and not kind.block:
        for member in kind.fields.values():
            yield from _retained_in(member.type, offset + member.offset, f"{path}.{member.name}", retaining, whole)
    elif isinstance(kind, StructType):
        for variable in retaining.context.block_of(kind).order:
            if variable.place != "self" or variable.reference:
                continue
            name = f"{path}.{variable.name}"
            yield from _retained_in(variable.type, offset + variable.offset, name, retaining, whole or variable.retain)
