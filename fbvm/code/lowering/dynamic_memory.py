"""Lowering of __NEW and __DELETE: memory of the heap (`builder.heap`), initial values in it, FB_init and FB_exit.

What is made is the object of a lease.  So is everything inside it: the instances in it have the number of that object in
their heads, in place of the number of their first object, and what refers to their variables refers to the whole."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.base.types import UDINT
from fbvm.check.declarations.interfaces import OBJECTS_AT
from fbvm.check.symbols.dynamic_facts import Made
from fbvm.check.symbols.facts import PouCall
from fbvm.code.builder import heap
from fbvm.code.builder.places import Place
from fbvm.code.image import LARGEST_HEAP, Body
from fbvm.code.layout.objects import headers
from fbvm.code.lowering import pointers, pou_calls
from fbvm.code.lowering.context import BodyContext
from fbvm.code.lowering.step_costs import UNITS_A_STEP
from fbvm.code.operations import HEAP_TRAPS, LEASED, OBJECT_SHIFT, Block, Node
from fbvm.syntax import tree

_CHARGED = 8
"""Steps that are charged at once."""
_CLEARED = 64
"""Bytes that a step of a loop sets to 0."""
_NULL: Node = ("const", "ref", 0)


def new(body: BodyContext, call: tree.Call) -> Node:
    """The pointer that __NEW gives: NULL if the heap has no room."""
    made, site = body.facts.made[call], body.site(call)
    objects, slot = body.program.objects, body.place(made.held)
    wanted = _size(body, made)
    body.emit(("store", "u32", heap.word(objects, "wanted"), wanted), _execute(body, "__NEW", heap.taking, site))
    _charge(body, site)
    reference = body.to_temporary(("load", "ref", heap.word(objects, "reference")))
    body.emit(slot.store(reference, site))
    with body.block() as filling:
        fill = (_filled if made.count is None else _repeated)(body, made)
        filled: Node = ("call", fill, (("ref", reference, site), 0, ()))
        if made.count is None:
            body.emit(("charge", 1 + made.kind.size // UNITS_A_STEP, site), filled)
        else:
            body.emit(("if", ((("ne", "b", "u32", wanted, ("const", "u32", 0)), (filled,)),), ()))
            _charge(body, site)
        _run(body, made.construction)
    body.emit(("if", ((("ne", "b", "ref", reference, _NULL), tuple(filling)),), ()))
    return reference


def delete(body: BodyContext, call: tree.Call) -> None:
    """__DELETE of a pointer: nothing if it is NULL; a trap if it is none to what __NEW has made, or that has ended."""
    ended, site = body.facts.ended[call], body.site(call)
    objects, held = body.program.objects, body.place(ended.held)
    place = body.reusable(body.place(ended.pointer)) if ended.clears else None
    reference = body.to_temporary(body.value(ended.pointer) if place is None else place.load())
    looks: Block = (("store", "ref", heap.word(objects, "reference"), reference), _execute(body, "__DELETE", heap.looking, site),
                    *(("if", ((("eq", "b", "u32", ("load", "u32", heap.word(objects, "verdict")), ("const", "u32", number)),
                               (("stop", code, site),)),), ()) for number, code in HEAP_TRAPS.items()))
    with body.block() as ending:
        body.emit(*looks)
        rows = []
        for number, calls in ended.exits.items():
            with body.block() as row:
                _run(body, calls)
            if row:
                rows.append((((number, number),), tuple(row)))
        with body.block() as parts:
            _run(body, ended.parts)
        if parts:
            body.emit(held.store(reference, site), *parts, *looks)
        elif rows:
            kind = Place((("ref", reference, site), 0, ()), UDINT)
            body.emit(held.store(reference, site), ("case", "u32", kind.load(), tuple(rows), ()), *looks)
        if place is not None:
            body.write(place, _NULL, site)
        body.emit(_execute(body, "__DELETE of it", heap.giving, site))
    body.emit(("if", ((("ne", "b", "ref", reference, _NULL), tuple(ending)),), ()))


def is_made(body: BodyContext, pointer: tree.Expr) -> Node:
    """Whether a pointer is one to what __NEW has made."""
    reference = body.value(pointer)
    if not body.program.has_heap:
        body.to_temporary(reference)
        return ("const", "b", 0)
    objects = body.program.objects
    first = LEASED + (objects.heap_row << objects.held_bits)
    return ("ge", "b", "u64", ("bits", "u64", "ref", reference), ("const", "u64", first << OBJECT_SHIFT))


def _run(body: BodyContext, calls: list[tree.Call]) -> None:
    """Emit the calls of hidden methods."""
    for call in calls:
        called = body.facts.calls[call]
        assert isinstance(called, PouCall)
        pou_calls.run(body, call, called)


def _size(body: BodyContext, made: Made) -> Node:
    """How many bytes are wanted, as u32; of a number that is negative or too large more than a heap has."""
    if made.count is None:
        return ("const", "u32", made.kind.size)
    count = body.to_temporary(body.as_i64(made.count))
    most = LARGEST_HEAP // max(made.kind.size, 1)
    fits: Node = ("and", "b", ("ge", "b", "i64", count, ("const", "i64", 0)), ("le", "b", "i64", count, ("const", "i64", most)))
    size = ("convert", "u32", "i64", ("mul", "i64", count, ("const", "i64", made.kind.size)))
    return body.to_temporary(("select", "u32", fits, ("const", "u32", 2 * LARGEST_HEAP), size))


def _execute(body: BodyContext, name: str, code: Callable[..., Block], site: int) -> Node:
    """The call of a body that works on the heap."""
    objects = body.program.objects
    return ("call", body.program.shared_part(name, lambda: Body(name, "FUNCTION", code(objects, site), 0, True)), None)


def _charge(body: BodyContext, site: int) -> None:
    """Emit the charge of the steps that a shared body has counted."""
    left = body.to_temporary(("load", "u32", heap.word(body.program.objects, "steps")), always=True)
    less = ("let", left[2], "u32", ("sub", "u32", left, ("const", "u32", _CHARGED)))
    over: Block = (("if", ((("lt", "b", "u32", left, ("const", "u32", _CHARGED)), (("exit",),)),), ()), less)
    body.emit(("loop", (("charge", _CHARGED, site),), over, ()))


# --- initial values ---------------------------------------------------------------------------------------------------


def _filled(body: BodyContext, made: Made) -> int:
    """The number of a body that gives what has been made its initial values, references in them included."""
    kind, content, site = made.kind, made.content, body.entry_site

    def make() -> Body:
        part = body.part({})
        part.emit(("fill", ("self", 0, ()), content))
        bits = ("bits", "u64", "ref", ("load", "ref", heap.word(body.program.objects, "reference")))
        number: Node = ("convert", "u32", "u64", ("div", "u64", bits, ("const", "u64", 1 << OBJECT_SHIFT), site))
        part.emit(*(("store", "u32", ("self", at + OBJECTS_AT, ()), number) for at in headers(kind, 0)))
        for at, start, around in body.program.instances_in(kind, content):
            owner = start.pou if start.pou in around else None
            node = pointers.initial(body.part({}, owner), start)
            if owner is not None:
                node = _moved(node, around[owner])
            part.emit(Place(("self", at, ()), start.kind).store(node, site))
        return Body(f"__NEW({kind.name})", "FUNCTION_BLOCK", tuple(part.out), kind.size, True)

    return body.program.shared_part((kind.name, content), make)


def _moved(node: Any, by: int) -> Any:
    """An expression of one instance as one of the instance that it lies in, so many bytes behind the start of that."""
    if type(node) is not tuple:
        return node
    if len(node) == 3 and node[0] == "self" and type(node[1]) is int:
        return "self", node[1] + by, _moved(node[2], by)
    return tuple(_moved(part, by) for part in node)


def _repeated(body: BodyContext, made: Made) -> int:
    """The number of a body that gives as many bytes as are wanted the initial value of one element again and again."""
    kind, content = made.kind, made.content

    def make() -> Body:
        part = body.part({})
        wanted = ("convert", "i64", "u32", ("load", "u32", heap.word(body.program.objects, "wanted")))
        steps = (_CLEARED, heap.UNIT) if not any(content) else (len(content),)
        counted = heap.word(body.program.objects, "steps")
        part.emit(("store", "u32", counted, ("const", "u32", 0)))
        at = part.to_temporary(("const", "i64", 0), always=True)
        for step in steps:  # what is left behind the last whole step, or, of units, within the block
            reach = ("add", "i64", at, ("const", "i64", step if step == _CLEARED else 1))
            pattern = content if any(content) else bytes(step)
            part.emit(("loop", (("store", "u32", counted, ("add", "u32", ("load", "u32", counted), ("const", "u32", 1))),), (
                ("if", ((("gt", "b", "i64", reach, wanted), (("exit",),)),), ()),
                ("fill", ("self", 0, ((1, at),)), pattern)),
                (("let", at[2], "i64", ("add", "i64", at, ("const", "i64", step))),)))
        return Body(f"__NEW({kind.name}, ...)", "FUNCTION_BLOCK", tuple(part.out), 0, True)

    return body.program.shared_part(("many", content if any(content) else b""), make)
