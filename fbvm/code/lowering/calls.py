"""Lowering of calls: which kind a call is of, and calls of standard functions; those of POUs are in `pou_calls`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from fbvm.base.types import ANY_SIZE, BOOL, NULL, Type, base, machine
from fbvm.check.calls.dynamic_memory import DELETE, NEW
from fbvm.check.symbols.facts import Guard, PouCall, StandardCall
from fbvm.code.builder.constants import TRUE, zero
from fbvm.code.builder.functions import FUNCTIONS
from fbvm.code.builder.places import Place, is_aggregate
from fbvm.code.lowering import any_parameters, arrays, dispatch, dynamic_memory, plc_addresses, pointers, pou_calls
from fbvm.code.lowering.context import BodyContext, PlaceRules, StatementRules, ValueRules
from fbvm.code.lowering.variables import loaded
from fbvm.code.operations import Node
from fbvm.syntax import tree
from fbvm.syntax.tree.il import CallsInRow


def _statement(body: BodyContext, node: tree.CallStatement, site: int) -> None:
    """A call whose result, if it has one, is not used."""
    call = body.facts.bare.get(node, node.call)
    if not isinstance(call, tree.Call):
        if not is_aggregate(body.facts.types[call]):
            body.to_temporary(body.value(call))
        return
    called = body.facts.calls.get(call)
    if isinstance(called, PouCall):
        pou_calls.run(body, call, called)
    elif isinstance(called, StandardCall) and called.key == DELETE:
        dynamic_memory.delete(body, call)
    elif called is not None and call not in body.facts.types:
        _standard(body, called, call)
    else:
        body.to_temporary(body.value(call))


def _in_row(body: BodyContext, expr: CallsInRow) -> Node:
    """Executes calls of an instruction list one behind the other: the last result, or what was the current result before."""
    last = body.facts.last_calls.get(expr)
    position = expr.calls.index(last) if last is not None else -1
    kept: Node | None = None
    if last is None:
        assert expr.before is not None
        kept = body.to_temporary(body.value(expr.before), always=True)
    for number, call in enumerate(expr.calls):
        if number == position:
            kept = body.value(call) if last is expr.calls[-1] else body.to_temporary(body.value(call), always=True)
        else:
            body.lower((tree.CallStatement(call.start, call.end, call),))
    assert kept is not None
    return kept


def _value(body: BodyContext, call: tree.Call) -> Node:
    guard = body.facts.guards.get(call)
    return _unguarded(body, call) if guard is None else _guarded(body, call, guard)


def _guarded(body: BodyContext, call: tree.Call, guard: Guard) -> Node:
    """A standard function with EN or ENO: with EN FALSE the result is the default of its type."""
    enable = body.to_temporary(body.value(guard.enable, BOOL)) if guard.enable is not None else TRUE
    form = machine(body.facts.types[call])
    result = body.to_temporary(zero(form), always=True)
    with body.block() as inner:
        inner.append(("let", result[2], form, _unguarded(body, call)))
    body.emit(("if", ((enable, tuple(inner)),), ()))
    for target, negated in guard.enabled:
        body.write(body.place(target), ("not", "b", enable) if negated else enable, body.site(call))
    return result


def _unguarded(body: BodyContext, call: tree.Call) -> Node:
    meaning = body.facts.rewritten.get(call)
    if meaning is not None:
        return body.value(meaning)
    return loaded(body, call) if call in body.facts.followed else _result(body, call)


def _result(body: BodyContext, call: tree.Call) -> Node:
    """What a call yields: its value, or the reference of a function that yields a REFERENCE TO."""
    called = body.facts.calls[call]
    return pou_calls.value(body, call, called) if isinstance(called, PouCall) else _standard(body, called, call)


def _place(body: BodyContext, call: tree.Call, kind: Type) -> Place:
    """Where the array or structure lies that a call yields, or what a REFERENCE TO that it yields is bound to."""
    if call in body.facts.followed:
        return Place((("ref", _result(body, call), body.site(call)), 0, ()), kind)
    called = body.facts.calls[call]
    return pou_calls.aggregate(body, call, called) if isinstance(called, PouCall) else _chosen(body, called, call)


def _chosen(body: BodyContext, called: StandardCall, call: tree.Call) -> Place:
    """The place of the array or structure that MOVE, SEL or MUX chooses."""
    if called.key == "MOVE":
        return body.aggregate(called.arguments[0][0])
    (chooser, wanted), *rest = called.arguments
    places = [body.aggregate(expr) for expr, _ in rest]
    arguments = [body.value(chooser, wanted), *(place.reference() for place in places)]
    site = body.site(call)
    chosen = FUNCTIONS[called.key](body, arguments, replace(called, detail=(NULL,)), site)
    return Place((("ref", chosen, site), 0, ()), body.facts.types[call])


# --- standard functions -----------------------------------------------------------------------------------------------


def _standard(body: BodyContext, called: StandardCall, call: tree.Call) -> Node:
    """The result of a standard function."""
    intrinsic = _INTRINSICS.get(called.key)
    if intrinsic is not None:
        return intrinsic(body, called)
    if called.key == NEW:
        return dynamic_memory.new(body, call)
    if called.key == "SEL" and body.dialect.selects_at_first and any(map(partial(_is_work, body), called.arguments[1:])):
        return _selected(body, called)
    arguments, site = body.operands(*called.arguments), body.site(call)
    if called.key == "__PLC_WORDS":
        return plc_addresses.words_from(body, arguments[0])
    return FUNCTIONS[called.key](body, arguments, called, site)


def _is_work(body: BodyContext, argument: tuple[tree.Expr, Type]) -> bool:
    """True if an argument is more than a constant or a variable."""
    return argument[0] not in body.facts.constants and not isinstance(argument[0], tree.NameRef)


def _selected(body: BodyContext, called: StandardCall) -> Node:
    """SEL in a dialect that works out only the input that is chosen."""
    (chooser, wanted), first, second = called.arguments
    condition, form = body.value(chooser, wanted), machine(base(first[1]))
    result = body.to_temporary(zero(form), always=True)
    blocks = []
    for expr, kind in (second, first):
        with body.block() as inner:
            inner.append(("let", result[2], form, body.value(expr, kind)))
        blocks.append(tuple(inner))
    body.emit(("if", ((condition, blocks[0]),), blocks[1]))
    return result


def _bound(body: BodyContext, called: StandardCall) -> Node:
    return ("convert", "i32", "i64", arrays.bound_of_dimension(body, called))


_INTRINSICS: dict[str, Callable[[BodyContext, StandardCall], Node]] = {
    "REF": lambda body, called: pointers.reference_to(body, called.arguments[0][0]),
    "__ISDYNAMIC": lambda body, called: dynamic_memory.is_made(body, called.arguments[0][0]),
    "__ISVALIDREF": lambda body, called: pointers.is_valid(body, called.arguments[0][0]),
    "SIZEOF": lambda body, called: (
        "convert", "u32", "i64", any_parameters.number(body, called.arguments[0][0], ANY_SIZE)),
    "__QUERY": lambda body, called: dispatch.query(body, called, body.site(called.arguments[0][0])),
    "LOWER_BOUND": _bound, "UPPER_BOUND": _bound,
    "__PLC_ADDRESS": lambda body, called: plc_addresses.address_of(body, called.arguments[0][0]),
}
"""Functions of places, by their keys: what they take is not the value of an argument, but where it lies."""

VALUES: ValueRules = {tree.Call: _value, CallsInRow: _in_row}
PLACES: PlaceRules = {tree.Call: _place}
STATEMENTS: StatementRules = {tree.CallStatement: _statement}
