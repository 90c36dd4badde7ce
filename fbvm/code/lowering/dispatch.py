"""Dispatch: which body a call executes whose instance may be of a derived type.

Every instance begins with the number of its type.  A call that several bodies may be meant by is a CASE over that number; where
only one can be meant, the call is the same as that of a function.  Where very many can be meant, all calls share one CASE in a
body of its own (DISPATCH), so that code does not grow with the product of calls and bodies.

The parameters of a method lie in the frame of the method that the call names; an override gets them copied into its own frame,
where they lie alike (S1004), and gives outputs and result back.  Frames on the stack need no copy (`frame_stack`)."""

from __future__ import annotations

from fbvm.base.types import UDINT, RefType, StructType
from fbvm.check.symbols.facts import Pou, PouCall, StandardCall
from fbvm.code.builder.places import Place
from fbvm.code.image import DISPATCH, Body
from fbvm.code.lowering.context import BodyContext
from fbvm.code.lowering.step_costs import with_costs
from fbvm.code.operations import Address, Block, Node

Candidates = dict[Pou, list[int]]
MOST_ROWS = 16
"""Bodies up to which each call has a CASE of its own."""
_NO_SUCH_TYPE = "R0110"
"""The trap of a call whose instance has the number of no type that is possible there."""


def call(body: BodyContext, called: PouCall, instance: Place | None, site: int) -> Node:
    """The statement that executes the body of a call whose parameters are passed already.

    instance: where the instance lies, None for a function; it can be used more than once."""
    pou = called.pou
    address = instance.address if instance is not None else None
    if not called.dynamic or instance is None:
        return ("call", body.program.number(body.program.executed(pou)), address)
    found = body.program.candidates(pou)
    if not found:
        return ("stop", _NO_SUCH_TYPE, site)
    if len(found) == 1:
        (only,) = found
        block = _row(body, pou, only, address)
        return block[0] if len(block) == 1 else ("if", ((("const", "b", 1), block),), ())
    if len(found) > MOST_ROWS:
        return ("call", body.program.shared_part((_shared, pou), lambda: _shared(body, pou, found)), address)
    return _chosen(body, pou, found, instance, site)


def _shared(body: BodyContext, pou: Pou, found: Candidates) -> Body:
    """The body of a part that executes the body which its instance has for calls of a method, an ACTION or a block."""
    site = body.part({}, pou).entry_site
    chosen = _chosen(body, pou, found, Place(("self", 0, ()), UDINT), site)
    return Body(pou.name, DISPATCH, with_costs((("charge", 1, site), chosen)), UDINT.size, True)


def _chosen(body: BodyContext, pou: Pou, found: Candidates, instance: Place, site: int) -> Node:
    """The CASE over the type of an instance."""
    rows = tuple((tuple((number, number) for number in numbers), _row(body, pou, meant, instance.address))
                 for meant, numbers in found.items())
    return ("case", "u32", instance.moved(0, UDINT).load(), rows, (("stop", _NO_SUCH_TYPE, site),))


def attempted(body: BodyContext, reference: Node, wanted: StructType, site: int) -> Node:
    """A reference to an instance if that is of a type, or derived from it, else NULL.

    wanted: the type of a block, or of what an interface refers to."""
    held = body.to_temporary(reference)
    result = body.to_temporary(("const", "ref", 0), always=True)
    found: Block = (("let", result[2], "ref", held),)
    labels = tuple((number, number) for number in body.checker.numbers_of(wanted))
    number = Place((("ref", held, site), 0, ()), UDINT).load()
    asked: Block = (("case", "u32", number, ((labels, found),), ()),) if labels else ()
    body.emit(("if", ((("ne", "b", "ref", held, ("const", "ref", 0)), asked),), ()))
    return result


def query(body: BodyContext, called: StandardCall, site: int) -> Node:
    """__QUERYINTERFACE(object, target) and __QUERYPOINTER: whether the object is of the target's type; the target refers to it
    then, and is NULL otherwise."""
    (source, _), (target, kind) = called.arguments
    assert isinstance(kind, RefType) and isinstance(kind.target, StructType)
    place = body.reusable(body.place(target))
    result = attempted(body, body.value(source, kind), kind.target, site)
    body.write(place, result, site)
    return body.to_temporary(("ne", "b", "ref", result, ("const", "ref", 0)))


def _row(body: BodyContext, named: Pou, meant: Pou, address: Address | None) -> Block:
    """The call of the body that is meant: parameters of the method that is named in, outputs and result of it back.

    On the stack both have the same frame."""
    statement: Node = ("call", body.program.number(body.program.executed(meant)), address)
    if meant is named or not named.is_routine or named.stack_bytes:
        return (statement,)
    (to, start), (source, begin) = body.program.frame(meant), body.program.frame(named)
    passed: Node = ("copy", (to, start, ()), (source, begin, ()), named.frame_inputs)
    size = named.frame_given - named.frame_inputs
    given: Node = ("copy", (source, begin + named.frame_inputs, ()), (to, start + named.frame_inputs, ()), size)
    return (*([passed] if named.frame_inputs else []), statement, *([given] if size else []))
