"""Places: where in memory an expression of the tree lies, and the loads and stores that reach it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.types import (
    ANY_BITS,
    ANY_SIZE,
    ANY_STRIDE,
    BOOL,
    DINT,
    LINT,
    AnyType,
    ArrayType,
    Field,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
    characters,
    fold,
    machine,
)
from fbvm.check.expressions.any_parameters import NUMBERS, VIEWS
from fbvm.check.symbols.facts import StandardCall, Value, Variable
from fbvm.code.lowering import aggregates, plc_addresses
from fbvm.code.lowering.layout import variable_bit
from fbvm.code.operations import SIZES, WHOLE_BYTES, Address, Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering


Detail = tuple[object, Address, int]
"""Form, address, and the bit or WHOLE_BYTES."""


@dataclass(slots=True)
class Place:
    """An address with the type of what lies there; `bit` for a located BOOL or a bit of a word.  It never changes."""

    address: Address
    type: Type
    bit: int | None = None
    loaded: Node | None = field(default=None, compare=False)
    """What loads it, once somebody wanted that."""
    detail: Detail | None = field(default=None, compare=False)
    """What its observations carry, once there was one."""

    def moved(self, offset: int, kind: Type, bit: int | None = None) -> Place:
        """A part of this place, `offset` bytes further on."""
        start, at, terms = self.address
        return Place((start, at + offset, terms), kind, bit)

    @property
    def is_reference(self) -> bool:
        return isinstance(self.address[0], tuple)

    def aligned(self, size: int) -> bool:
        """True if a value of `size` bytes lies on a multiple of its size."""
        start, offset, terms = self.address
        return size == 1 or not isinstance(start, tuple) and offset % size == 0 and \
            all(stride % size == 0 for stride, _ in terms)


class Places:
    """Finds places for the lowering of one body."""

    def __init__(self, body: BodyLowering) -> None:
        self.body = body
        self.facts = body.facts
        self._slots: dict[Variable, Place] = {}

    def of(self, expr: tree.Expr) -> Place:
        """The place that an expression names; of a REFERENCE TO what it is bound to."""
        if expr not in self.facts.followed:
            return self._named(expr, self.facts.types[expr])
        bound = self.body.values.call(expr) if isinstance(expr, tree.Call) else self.load(self.binding(expr))
        return Place((("ref", bound, self.body.site(expr)), 0, ()), self.facts.types[expr])

    def binding(self, expr: tree.Expr) -> Place:
        """Where a REFERENCE TO itself lies."""
        return self._named(expr, self.facts.followed[expr])

    def _named(self, expr: tree.Expr, kind: Type) -> Place:
        variable = self.facts.variables.get(expr)
        if variable is not None:
            return self.variable(variable, expr)
        if isinstance(expr, tree.Direct):
            address = self.facts.directs[expr]
            start, offset = self.body.program.area(address.area)
            is_bit = address.bit is not None or address.area in FLAG_AREAS
            return Place((start, offset + address.byte_offset(), ()), kind, address.bit_in_byte() if is_bit else None)
        if isinstance(expr, tree.Member) and isinstance(self.facts.types.get(expr.of), AnyType):
            return self._of_any(expr, kind)
        if expr in self.facts.bits:
            return self._part(self.facts.bits[expr], kind)
        if isinstance(expr, tree.Member):
            member = self.facts.fields[expr]
            if member.absolute:
                slot = self.slot(self._located(member, self.facts.types[expr.of]))
                return Place(slot.address, kind, slot.bit)
            slot = self.of(expr.of).moved(member.offset, kind, member.bit)
            return self.behind(slot, self.body.site(expr)) if member.reference else slot
        if isinstance(expr, tree.Part):
            return self._part(expr, kind)
        if isinstance(expr, tree.Call):
            return self.body.aggregate(expr)
        if isinstance(expr, tree.ArrayInit | tree.StructInit):
            return aggregates.written_out(self.body, expr)
        if isinstance(expr, tree.Index) and isinstance(self.facts.types.get(expr.of), RefType):
            return self.body.pointers.element(expr, kind)
        if isinstance(expr, tree.Deref):
            return Place((("ref", self.body.value(expr.of), self.body.site(expr)), 0, ()), kind)
        if isinstance(expr, ladder.Memory):
            return plc_addresses.place_at(self.body, expr, kind)
        if isinstance(expr, ladder.Words):
            return Place(self.of(expr.of).address, kind)
        assert isinstance(expr, tree.Index)
        whole = self.facts.types[expr.of]
        if whole is VIEWS["BITS"]:
            return self._bit_of_any(expr)
        return self._open_index(expr, whole) if isinstance(whole, OpenArrayType) else self._index(expr, kind)

    def variable(self, variable: Variable, expr: tree.Expr | None = None) -> Place:
        """The place of a variable; for an in-out, what its reference points at."""
        slot = self.slot(variable)
        if not variable.reference:
            return slot
        return self.behind(slot, self.body.site(expr) if expr is not None else self.body.entry_site)

    def behind(self, slot: Place, site: int) -> Place:
        """What the reference in a slot points at; the slot has the type of that."""
        return Place((("ref", ("load", "ref", slot.address), site), 0, ()), slot.type)

    def slot(self, variable: Variable) -> Place:
        """The place of a variable itself (of the reference, for an in-out)."""
        slot = self._slots.get(variable)
        if slot is None:
            slot = self._slots[variable] = self._slot(variable)
        return slot

    def _slot(self, variable: Variable) -> Place:
        if variable.place == "self":
            return Place(("self", variable.offset, ()), variable.type)
        return Place((*self.body.program.origin(variable), ()), variable.type, variable_bit(variable))

    def _located(self, member: Field, whole: Type) -> Variable:
        """A member of a block that lies in no instance."""
        assert isinstance(whole, StructType)
        block = self.body.checker.block_of(whole)
        known = block.variables[fold(member.name)]
        return known if known.name == member.name else next(v for v in block.order if v.name == member.name)

    def _part(self, expr: tree.Part, kind: Type) -> Place:
        whole = self.of(expr.of)
        if expr.size == "X":
            return whole.moved(expr.index // 8, kind, expr.index % 8)
        return whole.moved(expr.index * kind.size, kind)

    def _index(self, expr: tree.Index, kind: Type) -> Place:
        place = self.of(expr.of)
        if isinstance(place.type, ArrayType) and place.type.packed:
            return self._bit_of_array(place, place.type, expr)
        start, offset, terms = place.address
        element = characters(place.type) if isinstance(place.type, StringType) else place.type
        rest = list(expr.subscripts)
        while rest:
            assert isinstance(element, ArrayType)
            stride = element.size
            for low, high in element.bounds:
                subscript = rest.pop(0)
                stride //= high - low + 1
                constant = self.facts.constants.get(subscript)
                offset -= low * stride
                if constant is not None:
                    offset += int(constant) * stride
                else:
                    index = self.body.as_i64(subscript)
                    checked = ("check", "i64", index, low, high, "R0102", self.body.site(subscript))
                    terms = (*terms, (stride, checked))
            element = element.element
        return Place((start, offset, terms), kind)

    def _bit_of_array(self, place: Place, kind: ArrayType, expr: tree.Index) -> Place:
        """An element of an array that is located on bits."""
        number, stride = 0, kind.count
        distance: Node | None = None
        for (low, high), subscript in zip(kind.bounds, expr.subscripts, strict=True):
            stride //= high - low + 1
            known = self.facts.constants.get(subscript)
            if known is not None:
                number += (int(known) - low) * stride
                continue
            checked = ("check", "i64", self.body.as_i64(subscript), low, high, "R0102", self.body.site(subscript))
            step: Node = ("mul", "i64", ("sub", "i64", checked, ("const", "i64", low)), ("const", "i64", stride))
            distance = step if distance is None else ("add", "i64", distance, step)
        start, offset, terms = place.address
        if distance is None:
            number += place.bit or 0
            return Place((start, offset + number // 8, terms), BOOL, number % 8)
        bit = ("bit_behind", "ref", self.reference(place), ("add", "i64", distance, ("const", "i64", number)))
        return Place((("ref", bit, self.body.site(expr)), 0, ()), BOOL)

    def _open_index(self, expr: tree.Index, kind: OpenArrayType) -> Place:
        """An element of ARRAY [*]; the bounds lie beside the reference."""
        place = self.of(expr.of)
        start, offset, terms = place.address
        distance: Node | None = None
        for dimension, subscript in enumerate(expr.subscripts):
            low, high = (self._bound_at(expr.of, kind, dimension, upper) for upper in (False, True))
            checked = ("within", "i64", self.body.as_i64(subscript), low, high, "R0102", self.body.site(subscript))
            step: Node = ("sub", "i64", checked, low)
            if distance is not None:
                width = ("add", "i64", ("sub", "i64", high, low), ("const", "i64", 1))
                step = ("add", "i64", ("mul", "i64", distance, width), step)
            distance = step
        assert distance is not None
        return Place((start, offset, (*terms, (kind.element.size, distance))), kind.element)

    def _bound_at(self, expr: tree.Expr, kind: OpenArrayType, dimension: int, upper: bool) -> Node:
        if isinstance(expr, ladder.Memory | ladder.Words):
            return plc_addresses.bound(self.body, expr, upper)
        if isinstance(expr, tree.Member):
            return self._last_of_any(expr, kind) if upper else ("const", "i64", 0)
        slot = self.slot(self.facts.variables[expr])
        return ("load", "i64", slot.moved(kind.bound_offset(dimension, upper), LINT).address)

    def bound(self, called: StandardCall, constants: dict[tree.Expr, Value]) -> Node:
        """LOWER_BOUND or UPPER_BOUND, as i64, of ARRAY [*] or of a dimension that is worked out."""
        (array, kind), (dimension, _) = called.arguments
        upper = called.key == "UPPER_BOUND"
        if isinstance(kind, OpenArrayType):
            bounds = [self._bound_at(array, kind, number, upper) for number in range(kind.dimensions)]
        else:
            assert isinstance(kind, ArrayType)
            bounds = [("const", "i64", pair[upper]) for pair in kind.bounds]
        if dimension in constants:
            return bounds[int(constants[dimension]) - 1]
        site = self.body.site(dimension)
        number = self.body.keep(("check", "i64", self.body.as_i64(dimension), 1, len(bounds), "R0102", site), always=True)
        found = bounds[0]
        for place, bound in enumerate(bounds[1:], start=2):
            found = ("select", "i64", ("eq", "b", "i64", number, ("const", "i64", place)), found, bound)
        return found

    def bounds(self, expr: tree.Expr) -> list[Node]:
        """The bounds of an array that is passed to ARRAY [*], as i64: lower and upper of each dimension."""
        kind = self.facts.types[expr]
        if isinstance(kind, OpenArrayType):
            return [self._bound_at(expr, kind, d, upper) for d in range(kind.dimensions) for upper in (False, True)]
        assert isinstance(kind, ArrayType)
        return [("const", "i64", bound) for pair in kind.bounds for bound in pair]

    # --- ANY --------------------------------------------------------------------------------------------------------

    def any_number(self, expr: tree.Expr, offset: int) -> Node:
        """A number of the slot of an ANY, as i64."""
        slot = self.slot(self.facts.variables[expr])
        return ("convert", "i64", "i32", ("load", "i32", slot.moved(offset, DINT).address))

    def _of_any(self, expr: tree.Member, kind: Type) -> Place:
        """A member of an ANY: a number of its slot, or the bytes that it stands for."""
        offset = NUMBERS.get(fold(expr.name.text))
        variable = self.facts.variables[expr.of]
        return self.variable(variable, expr) if offset is None else self.slot(variable).moved(offset, kind)

    def _last_of_any(self, expr: tree.Member, kind: OpenArrayType) -> Node:
        """The last subscript of BITS, BYTES, WORDS ... of an ANY, as i64."""
        if kind is VIEWS["BITS"]:
            count = self.any_number(expr.of, ANY_BITS)
        else:
            count = ("floor_div", "i64", self.any_number(expr.of, ANY_SIZE), ("const", "i64", kind.element.size))
        return ("sub", "i64", count, ("const", "i64", 1))

    def _bit_of_any(self, expr: tree.Index) -> Place:
        """An element of BITS, behind a reference that names a bit."""
        assert isinstance(expr.of, tree.Member)
        subscript, = expr.subscripts
        last = self._last_of_any(expr.of, VIEWS["BITS"])
        site = self.body.site(subscript)
        number = ("within", "i64", self.body.as_i64(subscript), ("const", "i64", 0), last, "R0102", site)
        distance = ("mul", "i64", number, self.any_number(expr.of.of, ANY_STRIDE))
        start = ("load", "ref", self.slot(self.facts.variables[expr.of.of]).address)
        return Place((("ref", ("bit_behind", "ref", start, distance), self.body.site(expr)), 0, ()), BOOL)

    # --- access -----------------------------------------------------------------------------------------------------

    def load(self, place: Place) -> Node:
        """The value that lies at a place (not for arrays and structures)."""
        if place.loaded is None:
            place.loaded = self._load(place)
        return place.loaded

    def _load(self, place: Place) -> Node:
        kind = base(place.type)
        if isinstance(kind, StringType):
            return ("load_text", machine(kind), place.address, kind.capacity)
        form = machine(kind)
        if place.bit is not None:
            return ("load_bit", "b", place.address, place.bit)
        if form == "b" and place.is_reference:
            return ("load_flag", "b", place.address)
        return ("load" if place.aligned(SIZES[form]) else "load_raw", form, place.address)

    def store(self, place: Place, value: Node, site: int) -> Node:
        """The statement that stores a value of the place's machine type; a subrange is checked."""
        kind = place.type
        if isinstance(kind, SubrangeType) and not (value[0] == "const" and kind.low <= value[2] <= kind.high):
            value = ("check", machine(kind), value, kind.low, kind.high, "R0103", site)
        kind = base(kind)
        if isinstance(kind, StringType):
            return ("store_text", place.address, kind.capacity, value)
        form = machine(kind)
        if place.bit is not None:
            return ("store_bit", place.address, place.bit, value)
        if form == "b" and place.is_reference:
            return ("store_flag", place.address, value)
        return ("store" if place.aligned(SIZES[form]) else "store_raw", form, place.address, value)

    def reference(self, place: Place) -> Node:
        """A reference to a place."""
        start, offset, terms = place.address
        if isinstance(start, tuple) and not offset and not terms and place.bit is None:
            pointer: Node = start[1]
            return pointer
        return ("reference", "ref", place.address, WHOLE_BYTES if place.bit is None else place.bit)

    def fixed(self, place: Place) -> Place:
        """The same place with computed subscripts kept in temporaries, so that it can be used twice."""
        start, offset, terms = place.address
        if not terms and not isinstance(start, tuple):
            return place
        if isinstance(start, tuple) and start[1][0] != "tmp":
            start = ("ref", self.body.keep(start[1]), start[2])
        terms = tuple((stride, self.body.keep(index)) for stride, index in terms)
        return Place((start, offset, terms), place.type, place.bit)


def detail(place: Place) -> Detail:
    """What an observation of this place carries."""
    if place.detail is None:
        kind = base(place.type)
        form: object = machine(kind)
        if isinstance(kind, StringType):
            form = (machine(kind), kind.capacity)
        elif form == "":
            form = ("", kind.size)
        place.detail = form, place.address, WHOLE_BYTES if place.bit is None else place.bit
    return place.detail
