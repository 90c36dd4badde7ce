"""References and pointers: how they are made, moved and compared, and what they may be moved in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import ANY_SIZE, UDINT, AnyType, OpenArrayType, RefType, Type, machine
from fbvm.check.declarations.interfaces import OBJECTS_AT
from fbvm.check.expressions.values import is_null
from fbvm.check.symbols.facts import Holder, Variable
from fbvm.code.lowering.any_parameters import size_of
from fbvm.code.lowering.places import Place
from fbvm.code.operations import (
    BUFFER_OBJECT,
    LEASE_BYTES,
    LEASED,
    OBJECT_SHIFT,
    OFFSET_MASK,
    OFFSET_SHIFT,
    Address,
    Block,
    Node,
)
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

_COMPARE = {"=": "eq", "<>": "ne", "<": "lt", ">": "gt", "<=": "le", ">=": "ge"}
_WHERE = (1 << OBJECT_SHIFT) - 1
"""The bits of a reference that say where, not in which object."""


def _word(value: int) -> Node:
    return ("const", "u64", value)


def _number(reference: Node) -> Node:
    return ("bits", "u64", "ref", reference)


def _reference(number: Node) -> Node:
    return ("bits", "ref", "u64", number)


class PointerLowering:
    """Lowers what one body does with references."""

    def __init__(self, body: BodyLowering) -> None:
        self.body = body
        self.facts = body.facts

    # --- making them ------------------------------------------------------------------------------------------------

    def to(self, expr: tree.Expr) -> Node:
        """A reference to the place that an expression names, which may be kept."""
        holder = self.facts.holders[expr]
        place = self.body.places.fixed(self.body.places.of(expr))
        reference = self.body.places.reference(place)
        if holder.lease is not None:
            return self._leased(holder, reference)
        if holder.expr is None:
            return reference
        number = self._object(holder)
        if number[0] == "const":
            return _reference(("add", "u64", _number(reference), _word((number[2] - BUFFER_OBJECT) << OBJECT_SHIFT)))
        moved = ("mul", "u64", ("sub", "u64", number, _word(BUFFER_OBJECT)), _word(1 << OBJECT_SHIFT))
        return _reference(("add", "u64", _number(reference), moved))

    def lent(self, expr: tree.Expr) -> Node:
        """What a REFERENCE TO is bound to."""
        return ("const", "ref", 0) if is_null(expr) else self.to(expr)

    def bound(self, expr: tree.Expr) -> Node:
        """The reference that a REFERENCE TO holds."""
        places = self.body.places
        pointer: Node = places.of(expr).address[0][1] if isinstance(expr, tree.Call) else places.load(places.binding(expr))
        return pointer

    def to_parameter(self, expr: tree.Member) -> Node:
        """`x.pValue` of an ANY."""
        return self._leased(self.facts.holders[expr], self.body.places.reference(self.body.places.of(expr.of)))

    def _object(self, holder: Holder) -> Node:
        """The number of the object that holds a place, as u64."""
        variable, expr = holder.variable, holder.expr
        if variable is None:
            assert isinstance(expr, tree.Direct)
            return _word(self.body.program.area_object(self.facts.directs[expr].area))
        assert variable.object is not None
        if variable.place != "self":
            return _word(variable.object)
        instance = self.body.places.of(expr.of) if isinstance(expr, tree.Member) else Place(("self", 0, ()), UDINT)
        first = self.body.places.load(instance.moved(OBJECTS_AT, UDINT))
        return ("add", "u64", ("convert", "u64", "u32", first), _word(variable.object))

    # --- leases -----------------------------------------------------------------------------------------------------

    def _leased(self, holder: Holder, reference: Node) -> Node:
        """A reference to something that ends with the body, or to what an in-out stands for, which may end with it."""
        body, variable = self.body, holder.variable
        assert variable is not None and holder.lease is not None and holder.expr is not None
        kept = body.keep(_number(reference))
        passed = variable.reference and not isinstance(variable.type, AnyType)
        whole = body.places.of(holder.expr)
        number = body.keep(("shr", "u64", kept, ("const", "i64", OBJECT_SHIFT), body.entry_site)) if passed else None
        with body.block() as taken:
            start = self._offset(_number(body.places.reference(whole)))
            self._take(holder.lease, start, self._size(variable, holder.expr, whole.type))
        known: Node = ("eq", "b", "u64", number, _word(BUFFER_OBJECT)) if number is not None else ("const", "b", 1)
        body.out.append(("if", ((known, tuple(taken)),), ())) if number is not None else body.out.extend(taken)
        held = ("load", "u32", self._lease(holder.lease, 8))
        first = LEASED + (holder.lease << body.program.held_bits)
        moved = ("mul", "u64", ("add", "u64", ("convert", "u64", "u32", held), _word(first)), _word(1 << OBJECT_SHIFT))
        made: Node = ("or", "u64", ("and", "u64", kept, _word(_WHERE)), moved)
        return body.keep(_reference(("select", "u64", known, kept, made) if number is not None else made))

    def _take(self, lease: int, start: Node, size: Node) -> None:
        """Hold a lease from now on, under a new number unless it is held already."""
        most = (1 << self.body.program.held_bits) - 1
        count, held = self._lease(lease, 12), self._lease(lease, 8)
        following: Node = ("add", "u32", ("mod", "u32", ("load", "u32", count), ("const", "u32", most), self.body.entry_site),
                           ("const", "u32", 1))
        new: Block = (("store", "u32", count, following), ("store", "u32", held, ("load", "u32", count)))
        free = ("eq", "b", "u32", ("load", "u32", held), ("const", "u32", 0))
        end = ("add", "u64", start, ("convert", "u64", "i64", size))
        self.body.out += [
            ("if", ((free, new),), ()), ("store", "u32", self._lease(lease, 0), ("convert", "u32", "u64", start)),
            ("store", "u32", self._lease(lease, 4), ("convert", "u32", "u64", end))]

    def _size(self, variable: Variable, expr: tree.Expr, kind: Type) -> Node:
        """Bytes of what is leased, as i64."""
        if isinstance(kind, AnyType):
            return self.body.places.any_number(expr, ANY_SIZE)
        return size_of(self.body, expr, kind) if isinstance(kind, OpenArrayType) else ("const", "i64", kind.size)

    def _lease(self, number: int, offset: int) -> Address:
        return ("abs", self.body.program.leases_at + number * LEASE_BYTES + offset, ())

    def released(self) -> Block:
        """The end of all leases of the body."""
        return tuple(("store", "u32", self._lease(number, 8), ("const", "u32", 0)) for number in self.body.pou.leases)

    # --- working with them ------------------------------------------------------------------------------------------

    def binary(self, expr: tree.Binary) -> Node:
        """An operator one of whose operands is a reference."""
        body = self.body
        left, right = self.facts.types[expr.left], self.facts.types[expr.right]
        a, b = body.values.operands((expr.left, None), (expr.right, None))
        if expr.op in _COMPARE:
            return (_COMPARE[expr.op], "b", "u64", self._where(a), self._where(b))
        if isinstance(left, RefType) and isinstance(right, RefType):
            difference = ("sub", "u64", self._offset(_number(a)), self._offset(_number(b)))
            return ("convert", "i32", "u64", difference)
        if isinstance(right, RefType):
            a, b, left, right = b, a, right, left
        form = machine(right)
        stride = 1
        if expr in self.facts.by_elements:
            assert isinstance(left, RefType) and left.target is not None
            stride = left.target.size
        steps = ("mul", "u64", b if form == "u64" else ("convert", "u64", form, b), _word(stride << OFFSET_SHIFT))
        number = body.keep(_number(a))
        mask = OFFSET_MASK << OFFSET_SHIFT
        there = ("and", "u64", ("add" if expr.op == "+" else "sub", "u64", number, steps), _word(mask))
        return _reference(("or", "u64", ("and", "u64", number, _word((1 << 64) - 1 - mask)), there))

    def _where(self, reference: Node) -> Node:
        if reference[0] == "const":
            return _word(reference[2] & _WHERE)
        return ("and", "u64", _number(reference), _word(_WHERE))

    def _offset(self, number: Node) -> Node:
        """The offset that the number of a reference holds, as u64."""
        return ("and", "u64", ("shr", "u64", number, ("const", "i64", OFFSET_SHIFT), self.body.entry_site),
                _word(OFFSET_MASK))

    def element(self, expr: tree.Index, kind: Type) -> Place:
        """What `p[i]` names, which is `kind`."""
        pointer, = self.body.values.operands((expr.of, None))
        subscript, = expr.subscripts
        start = ("ref", pointer, self.body.site(expr))
        known = self.facts.constants.get(subscript)
        if known is not None:
            return Place((start, int(known) * kind.size, ()), kind)
        return Place((start, 0, ((kind.size, self.body.as_i64(subscript)),)), kind)


