"""Lowering of calls of POUs: inputs in, body, outputs out; EN and ENO.

With EN FALSE nothing of the call happens but that EN and ENO become FALSE: inputs are neither evaluated nor passed, the body
is not run, outputs keep their values, a function's result is the default of its type."""

from __future__ import annotations

from fbvm.base.types import BOOL, DINT, LINT, AnyType, OpenArrayType, RefType, base, followed, machine
from fbvm.check.expressions.constants import default
from fbvm.check.symbols.facts import PouCall, Variable
from fbvm.code.builder.constants import FALSE, TRUE, zero
from fbvm.code.builder.conversions import implicit
from fbvm.code.builder.places import Place, is_aggregate
from fbvm.code.lowering import dispatch, pointers
from fbvm.code.lowering.any_arguments import described
from fbvm.code.lowering.arrays import bounds
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import INTEGERS, Block, Node
from fbvm.syntax import tree


def run(body: BodyContext, call: tree.Expr, called: PouCall) -> None:
    """A call whose result, if it has one, is not used.

    body: the caller.
    call: the call in the tree, or the property that is assigned.
    called: what the checker found out about it."""
    if called.pou.home is None:
        _enabled(body, call, called, ())
        return
    instance = _instance(body, called) or Place(("self", 0, ()), BOOL)
    if called.inputs:
        _inputs(body, called, instance, body.site(call))
    body.emit(dispatch.call(body, called, instance, body.site(call)))


def value(body: BodyContext, call: tree.Call, called: PouCall) -> Node:
    """A call of a function; its result as a temporary."""
    result = called.pou.result
    assert result is not None
    number = body.new_temporary()
    form = machine(result.type)
    place = body.slot(result)
    if called.enable is not None:
        initial = zero(form)
        if form in INTEGERS:  # an enumeration begins with its first member
            initial = ("const", form, int.from_bytes(default(result.type), "little"))
        body.emit(("let", number, form, initial))
    _enabled(body, call, called, (("let", number, form, place.load()),))
    return ("tmp", form, number)


def aggregate(body: BodyContext, call: tree.Call, called: PouCall) -> Place:
    """A call of a function whose result is an array or a structure; the place of the result."""
    result = called.pou.result
    assert result is not None
    place = body.slot(result)
    if called.enable is not None:
        body.emit(("fill", place.address, result.initial))
    _enabled(body, call, called, ())
    return place


# --- EN and ENO -------------------------------------------------------------------------------------------------------


def _enabled(body: BodyContext, call: tree.Expr, called: PouCall, after: Block) -> None:
    """The whole call and the statements `after` it, inside an IF where EN is given or declared."""
    site = body.site(call)
    instance = _instance(body, called)
    eno = _parameter(called, "ENO", "VAR_OUTPUT")
    enable = _enable(body, called, instance, site)
    if enable is None:
        _execute(body, called, instance, site, eno)
        body.emit(*after)
        _report(body, called, TRUE, site)
        return
    enable = body.to_temporary(enable)
    with body.block() as inner:
        _execute(body, called, instance, site, eno)
        body.emit(*after)
    otherwise: Block = ()
    if eno is not None and (instance is not None or called.outputs):
        with body.block() as disabled:
            body.emit(_slot(body, eno, instance).store(FALSE, site))
            _outputs(body, [output for output in called.outputs if output[0] is eno], instance, site)
        otherwise = tuple(disabled)
    body.emit(("if", ((enable, tuple(inner)),), otherwise))
    _report(body, called, enable, site)


def _instance(body: BodyContext, called: PouCall) -> Place | None:
    """The instance that is called, or whose method is; None for a function."""
    expr = called.instance
    if expr is None:
        return None if called.pou.block is None else Place(("self", 0, ()), BOOL)
    kind = body.facts.types.get(expr)
    if isinstance(kind, RefType) and kind.interface and kind.target is not None and expr not in body.facts.selves:
        return Place((("ref", body.to_temporary(body.value(expr)), body.site(expr)), 0, ()), kind.target)
    return body.reusable(body.place(expr))


def _enable(body: BodyContext, called: PouCall, instance: Place | None, site: int) -> Node | None:
    """The value of EN, which is stored if the POU declares it; None if it is neither given nor declared."""
    declared = _parameter(called, "EN", "VAR_INPUT")
    enable = body.value(called.enable, BOOL) if called.enable is not None else None
    if declared is None:
        return enable
    place = _slot(body, declared, instance)
    if enable is not None:
        body.write(place, enable, site)
    elif called.pou.is_routine:
        body.write(place, TRUE, site)
    return place.load()


def _report(body: BodyContext, called: PouCall, enable: Node, site: int) -> None:
    """ENO of a POU that declares none: whether it was run."""
    for target, negated in called.enabled:
        node: Node = ("not", "b", enable) if negated else enable
        body.write(body.place(target), node, site)
    variable = body.facts.variables.get(called.instance) if called.instance is not None else None
    if variable is not None and variable.eno is not None and called.pou.home is None:
        body.emit(body.slot(variable.eno).store(enable, site))


def _parameter(called: PouCall, name: str, kind: str) -> Variable | None:
    return next((v for v in called.pou.parameters(kind) if v.name.upper() == name), None)


def _slot(body: BodyContext, variable: Variable, instance: Place | None) -> Place:
    """The slot of a callee's variable; of one to which VAR_CONFIG gives a place, that place."""
    if instance is None or variable.place != "self":
        return body.slot(variable)
    slot = instance.moved(variable.offset, variable.type)
    return slot.target(body.entry_site) if variable.open else slot


# --- what is passed and executed --------------------------------------------------------------------------------------


def _execute(body: BodyContext, called: PouCall, instance: Place | None, site: int, eno: Variable | None) -> None:
    """Inputs, the body unless a task of its own runs it, outputs."""
    _inputs(body, called, instance, site)
    if eno is not None and (called.pou.enables_itself or not called.pou.writes_eno):
        body.emit(_slot(body, eno, instance).store(TRUE, site))
    statement = dispatch.call(body, called, instance, site)
    if called.tasked is not None:
        statement = ("if", ((("not", "b", body.slot(called.tasked).load()), (statement,)),), ())
    body.emit(statement)
    _outputs(body, called.outputs, instance, site)
    for variable, expr in called.in_outs if called.pou.actions else ():
        if _may_end(body, expr):  # an ACTION that is called later finds NULL instead of what has ended
            body.emit(("store", "ref", _slot(body, variable, instance).address, ("const", "ref", 0)))


def _may_end(body: BodyContext, expr: tree.Expr) -> bool:
    """True if what an in-out is bound to may end with the body that passes it."""
    variable = body.facts.variables.get(body.facts.root(expr))
    return variable is not None and (variable.kind == "VAR_IN_OUT" or variable.place == "frame")


def _inputs(body: BodyContext, called: PouCall, instance: Place | None, site: int) -> None:
    """Evaluate all arguments in the order of writing, then store them; aggregates are copied in between."""
    passed = sorted([*called.inputs, *called.in_outs], key=lambda pair: pair[1].start)
    aggregates = [(v, e) for v, e in passed if v.kind == "VAR_INPUT" and is_aggregate(v.type)]
    passed = [pair for pair in passed if pair not in aggregates]
    nodes = body.sequence(_argument(body, variable, expr) for variable, expr in passed)
    for variable, expr in aggregates:
        body.copy(_slot(body, variable, instance), body.aggregate(expr), site)
    for (variable, expr), node in zip(passed, nodes, strict=True):
        place = _slot(body, variable, instance)
        if variable.kind == "VAR_IN_OUT":
            _bind(body, variable, place, expr, node)
        else:
            body.write(place, node, site)
    if called.pou.is_routine:
        given = {id(v) for v, _ in called.inputs}
        for variable in called.pou.parameters("VAR_INPUT"):
            if id(variable) not in given and variable.name.upper() != "EN":
                body.emit(("fill", _slot(body, variable, instance).address, variable.initial))


def _argument(body: BodyContext, variable: Variable, expr: tree.Expr) -> Node:
    if variable.kind == "VAR_IN_OUT":
        return body.place(expr).reference()
    if isinstance(variable.type, RefType) and variable.type.follows:
        return pointers.binding(body, expr)
    return body.value(expr, variable.type)


def _bind(body: BodyContext, variable: Variable, slot: Place, expr: tree.Expr, reference: Node) -> None:
    """Store the reference of an in-out, and beside it the bounds of ARRAY [*], or what an ANY tells of its argument."""
    body.emit(("store", "ref", slot.address, reference))
    if isinstance(variable.type, OpenArrayType):
        for number, node in enumerate(bounds(body, expr)):
            body.emit(("store", "i64", slot.moved(8 + 8 * number, LINT).address, node))
    elif isinstance(variable.type, AnyType):
        for offset, node in described(body, expr):
            body.emit(("store", "i32", slot.moved(offset, DINT).address, node))


def _outputs(body: BodyContext, outputs: list[tuple[Variable, tree.Expr, bool]], instance: Place | None, site: int) -> None:
    for variable, target, negated in outputs:
        source = _slot(body, variable, instance)
        if source.type is not (kind := followed(source.type)):
            source = Place((("ref", source.load(), site), 0, ()), kind)
        place = body.place(target)
        if is_aggregate(source.type):
            body.copy(place, source, site)
            continue
        node = source.load()
        if negated:
            node = ("not", "b", node)
        body.write(place, implicit(body, node, source.type, base(place.type)), site)
