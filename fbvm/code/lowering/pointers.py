"""References and pointers: how they are made, moved and compared, and what they may be moved in.

A reference is 64 bits: object, offset in the buffer, bit (`code.operations`).  One to the buffer as a whole becomes a pointer
that can be moved when it names the object it may be moved in.  A *lease* is the object of something that ends with the
body, such as a variable of its frame: a row in the buffer with its extent and the number under which the body holds it.
The pointer carries that number, so that one which is kept longer traps."""

from __future__ import annotations

from fbvm.base.types import (
    ANY_SIZE,
    UDINT,
    AnyType,
    ArrayType,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    Type,
    machine,
)
from fbvm.check.declarations.interfaces import OBJECTS_AT, PADDED_BYTES
from fbvm.check.expressions.values import is_null
from fbvm.check.symbols.facts import Holder, Start, Variable
from fbvm.code.builder.places import Place
from fbvm.code.lowering import any_parameters, frame_stack
from fbvm.code.lowering.arrays import size_of
from fbvm.code.lowering.context import BodyContext
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

_COMPARE = {"=": "eq", "<>": "ne", "<": "lt", ">": "gt", "<=": "le", ">=": "ge"}
_POSITION = (1 << OBJECT_SHIFT) - 1
"""The bits of a reference that say where, not in which object."""
_LEASE_START, _LEASE_END, _LEASE_HELD, _LEASE_COUNT = 0, 4, 8, 12
"""Offsets in the row of a lease (`operations.LEASE_BYTES`)."""


def _word(value: int) -> Node:
    return ("const", "u64", value)


def _bits(reference: Node) -> Node:
    return ("bits", "u64", "ref", reference)


def _from_bits(number: Node) -> Node:
    return ("bits", "ref", "u64", number)


# --- making them ------------------------------------------------------------------------------------------------------


def reference_to(body: BodyContext, expr: tree.Expr) -> Node:
    """A reference to the place that an expression names, in the object that the reference may be moved in."""
    holder = body.facts.holders[expr]
    place = body.reusable(body.place(expr))
    reference = place.reference()
    if holder.lease is not None:
        return _leased(body, holder, reference)
    if holder.expr is None:
        return reference
    number = _object(body, holder)
    if number[0] == "const":
        return _from_bits(("add", "u64", _bits(reference), _word((number[2] - BUFFER_OBJECT) << OBJECT_SHIFT)))
    moved = ("mul", "u64", ("sub", "u64", number, _word(BUFFER_OBJECT)), _word(1 << OBJECT_SHIFT))
    return _from_bits(("add", "u64", _bits(reference), moved))


def initial(body: BodyContext, start: Start) -> Node:
    """The reference of an initial value: of an interface to an instance as a whole, of others to a variable."""
    return body.value(start.place, start.kind) if start.kind.interface else reference_to(body, start.place)


def binding(body: BodyContext, expr: tree.Expr) -> Node:
    """The reference that a REFERENCE TO gets when it is bound to what `expr` names, or to NULL."""
    return ("const", "ref", 0) if is_null(expr) else reference_to(body, expr)


def held(body: BodyContext, expr: tree.Expr) -> Node:
    """The reference that a REFERENCE TO, or the result of a function that yields one, holds."""
    if isinstance(expr, tree.Call):
        pointer: Node = body.place(expr).address[0][1]
        return pointer
    return body.reference_slot(expr).load()


def is_valid(body: BodyContext, expr: tree.Expr) -> Node:
    """__ISVALIDREF(r): whether a REFERENCE TO or an in-out is bound to anything, or an interface refers to anything."""
    variable, kind = body.facts.variables.get(expr), body.facts.types[expr]
    if expr in body.facts.followed:
        reference = held(body, expr)
    elif variable is not None and not (isinstance(kind, RefType) and kind.interface):
        reference = ("load", "ref", body.slot(variable).address)
    else:
        reference = body.value(expr)
    return ("ne", "b", "ref", reference, ("const", "ref", 0))


def to_parameter(body: BodyContext, expr: tree.Member) -> Node:
    """`x.pValue` of an ANY: a reference to what was passed."""
    return _leased(body, body.facts.holders[expr], body.place(expr.of).reference())


def _object(body: BodyContext, holder: Holder) -> Node:
    """The number of the object that holds a place, as u64."""
    variable, expr = holder.variable, holder.expr
    if variable is None:
        assert isinstance(expr, tree.Direct)
        return _word(body.program.area_object(body.facts.directs[expr].area))
    assert variable.object is not None
    if variable.place != "self":
        return _word(variable.object)
    instance = body.place(expr.of) if isinstance(expr, tree.Member) else Place(("self", 0, ()), UDINT)
    first = instance.moved(OBJECTS_AT, UDINT).load()
    return body.program.object_of(("convert", "u64", "u32", first), variable.object)


# --- leases -----------------------------------------------------------------------------------------------------------


def _leased(body: BodyContext, holder: Holder, reference: Node) -> Node:
    """A reference to something that ends with the body, or to what an in-out stands for, which may end with it."""
    variable = holder.variable
    assert variable is not None and holder.lease is not None and holder.expr is not None
    bits = body.to_temporary(_bits(reference))
    if body.pou.stack_bytes and not variable.reference:
        return frame_stack.leased(body, bits)
    passed = variable.reference and not isinstance(variable.type, AnyType)
    whole = body.place(holder.expr)
    number = body.to_temporary(("shr", "u64", bits, ("const", "i64", OBJECT_SHIFT), body.entry_site)) if passed else None
    with body.block() as taken:
        start = _offset(body, _bits(whole.reference()))
        _take(body, holder.lease, start, _padded(body, variable, _size(body, holder.expr, whole.type)))
    needed: Node = ("eq", "b", "u64", number, _word(BUFFER_OBJECT)) if number is not None else ("const", "b", 1)
    body.emit(*([("if", ((needed, tuple(taken)),), ())] if number is not None else taken))
    current = ("load", "u32", _row(body, holder.lease, _LEASE_HELD))
    first = LEASED + (holder.lease << body.program.held_bits)
    moved = ("mul", "u64", ("add", "u64", ("convert", "u64", "u32", current), _word(first)), _word(1 << OBJECT_SHIFT))
    made: Node = ("or", "u64", ("and", "u64", bits, _word(_POSITION)), moved)
    return body.to_temporary(_from_bits(("select", "u64", needed, bits, made) if number is not None else made))


def _take(body: BodyContext, lease: int, start: Node, size: Node) -> None:
    """Hold a lease from now on, under a new number unless the body holds it already."""
    most = (1 << body.program.held_bits) - 1
    count, held = _row(body, lease, _LEASE_COUNT), _row(body, lease, _LEASE_HELD)
    following: Node = ("add", "u32", ("mod", "u32", ("load", "u32", count), ("const", "u32", most), body.entry_site),
                       ("const", "u32", 1))
    new: Block = (("store", "u32", count, following), ("store", "u32", held, ("load", "u32", count)))
    free = ("eq", "b", "u32", ("load", "u32", held), ("const", "u32", 0))
    end = ("add", "u64", start, ("convert", "u64", "i64", size))
    body.emit(("if", ((free, new),), ()),
              ("store", "u32", _row(body, lease, _LEASE_START), ("convert", "u32", "u64", start)),
              ("store", "u32", _row(body, lease, _LEASE_END), ("convert", "u32", "u64", end)))


def _size(body: BodyContext, expr: tree.Expr, kind: Type) -> Node:
    """Bytes of what is leased, as i64."""
    if isinstance(kind, AnyType):
        return any_parameters.number(body, expr, ANY_SIZE)
    return size_of(body, expr, kind) if isinstance(kind, OpenArrayType) else ("const", "i64", kind.size)


def _padded(body: BodyContext, variable: Variable, size: Node) -> Node:
    """The bytes that a variable of a frame takes, with what pads it where the dialect lets programs write that."""
    if not body.dialect.padding_is_written or variable.place != "frame" or variable.reference or size[0] != "const" or \
            not isinstance(variable.type, ArrayType | StructType | StringType):
        return size
    return ("const", "i64", -(-size[2] // PADDED_BYTES) * PADDED_BYTES)


def _row(body: BodyContext, lease: int, offset: int) -> Address:
    return ("abs", body.program.leases_at + lease * LEASE_BYTES + offset, ())


def begin_leases(body: BodyContext) -> None:
    """Have all leases of the body end wherever it returns.

    A body that may be active already keeps those of in-outs, and gives them back; variables in its frame need none."""
    if not body.pou.stack_bytes:
        body.at_return = tuple(("store", "u32", _row(body, lease, _LEASE_HELD), ("const", "u32", 0)) for lease in body.pou.leases)
        return
    for variable, lease in body.facts.leases.items() if body.pou.leases else ():
        if lease in body.pou.leases and variable.reference:
            fields = [_row(body, lease, offset) for offset in (_LEASE_START, _LEASE_END, _LEASE_HELD)]
            kept = [body.to_temporary(("load", "u32", field)) for field in fields]
            body.emit(("store", "u32", fields[-1], ("const", "u32", 0)))
            body.at_return += tuple(("store", "u32", field, value) for field, value in zip(fields, kept, strict=True))


def kept(body: BodyContext) -> list[tuple[str, Address]]:
    """The words that say which leases of other POUs are held."""
    own = () if body.pou.stack_bytes else body.pou.owner.leases
    return [("u32", _row(body, lease, _LEASE_HELD)) for lease in range(len(body.facts.leases)) if lease not in own]


# --- working with them ------------------------------------------------------------------------------------------------


def binary(body: BodyContext, expr: tree.Binary) -> Node:
    """An operator one of whose operands is a reference: comparison, difference, sum with a number."""
    left, right = body.facts.types[expr.left], body.facts.types[expr.right]
    a, b = body.operands((expr.left, None), (expr.right, None))
    if expr.op in _COMPARE:
        return (_COMPARE[expr.op], "b", "u64", _position(a), _position(b))
    if isinstance(left, RefType) and isinstance(right, RefType):
        difference = ("sub", "u64", _offset(body, _bits(a)), _offset(body, _bits(b)))
        return ("convert", "i32", "u64", difference)
    if isinstance(right, RefType):
        a, b, left, right = b, a, right, left
    form = machine(right)
    stride = 1
    if expr in body.facts.by_elements:
        assert isinstance(left, RefType) and left.target is not None
        stride = left.target.size
    steps = ("mul", "u64", b if form == "u64" else ("convert", "u64", form, b), _word(stride << OFFSET_SHIFT))
    number = body.to_temporary(_bits(a))
    mask = OFFSET_MASK << OFFSET_SHIFT
    moved = ("and", "u64", ("add" if expr.op == "+" else "sub", "u64", number, steps), _word(mask))
    return _from_bits(("or", "u64", ("and", "u64", number, _word((1 << 64) - 1 - mask)), moved))


def _position(reference: Node) -> Node:
    return ("and", "u64", _bits(reference), _word(_POSITION))


def _offset(body: BodyContext, bits: Node) -> Node:
    """The offset in the bits of a reference, as u64."""
    return ("and", "u64", ("shr", "u64", bits, ("const", "i64", OFFSET_SHIFT), body.entry_site), _word(OFFSET_MASK))


def element(body: BodyContext, expr: tree.Index, kind: Type) -> Place:
    """The place that `p[i]` names, where p is a pointer to `kind`."""
    pointer, = body.operands((expr.of, None))
    subscript, = expr.subscripts
    start = ("ref", pointer, body.site(expr))
    known = body.facts.constants.get(subscript)
    if known is not None:
        return Place((start, int(known) * kind.size, ()), kind)
    return Place((start, 0, ((kind.size, body.as_i64(subscript)),)), kind)
