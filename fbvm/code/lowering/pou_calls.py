"""Lowering of calls of POUs: inputs in, body, outputs out; EN and ENO.

With EN FALSE nothing of the call happens but that EN and ENO become FALSE: inputs are neither evaluated nor passed, the body
is not run, outputs keep their values, a function's result is the default of its type."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass

from fbvm.base.types import BOOL, DINT, LINT, AnyType, OpenArrayType, RefType, StringType, base, followed, machine
from fbvm.check.expressions.constants import default
from fbvm.check.symbols.facts import PouCall, Variable
from fbvm.code.builder.constants import FALSE, TRUE, zero
from fbvm.code.builder.conversions import implicit
from fbvm.code.builder.places import Place, is_aggregate
from fbvm.code.lowering import dispatch, frame_stack, own_in_outs, pointers
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
        with _callee(body, call, called) as callee:
            _enabled(callee, call, ())
        return
    callee = Callee(body, called, _instance(body, called) or Place(("self", 0, ()), BOOL), None)
    if called.inputs or called.in_outs:
        _inputs(callee, body.site(call))
    with frame_stack.frame(body, called, body.site(call)):
        body.emit(dispatch.call(body, called, callee.instance, body.site(call)))
    _outputs(callee, called.outputs, body.site(call))
    _forget(callee)


def value(body: BodyContext, call: tree.Call, called: PouCall) -> Node:
    """A call of a function; its result as a temporary."""
    result = called.pou.result
    assert result is not None
    number = body.new_temporary()
    form = machine(result.type)
    with _callee(body, call, called) as callee:
        place = callee.slot(result)
        if called.enable is not None:
            initial = zero(form)
            if form in INTEGERS:  # an enumeration begins with its first member
                initial = ("const", form, int.from_bytes(default(result.type), "little"))
            body.emit(("let", number, form, initial))
        _enabled(callee, call, (("let", number, form, place.load()),))
    return ("tmp", form, number)


def aggregate(body: BodyContext, call: tree.Call, called: PouCall) -> Place:
    """A call of a function whose result is an array or a structure; the place of the result."""
    result = called.pou.result
    assert result is not None
    with _callee(body, call, called) as callee:
        place = callee.slot(result)
        if called.enable is not None:
            body.emit(("fill", place.address, result.initial))
        _enabled(callee, call, ())
    return place


# --- the POU that is called -------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Callee:
    """A call of a POU from a body, and where the variables of the POU lie: in its instance, in its frame on the stack, or at
    fixed places.  It never changes."""

    body: BodyContext
    called: PouCall
    instance: Place | None
    frame: Place | None

    def slot(self, variable: Variable) -> Place:
        """The slot of a variable; of one to which VAR_CONFIG gives a place, that place."""
        if self.frame is not None and variable.place == "frame":
            return self.frame.moved(variable.offset, variable.type)
        if self.instance is None or variable.place != "self":
            return self.body.slot(variable)
        slot = self.instance.moved(variable.offset, variable.type)
        return slot.target(self.body.entry_site) if variable.open else slot

    def parameter(self, name: str, kind: str) -> Variable | None:
        """The parameter of that name and kind, if the POU declares it."""
        return next((v for v in self.called.pou.parameters(kind) if v.name.upper() == name), None)


def _callee(body: BodyContext, call: tree.Expr, called: PouCall) -> AbstractContextManager[Callee]:
    """The POU of a call, with its frame on the stack of frames as long as the `with` statement emits, if it has one there."""
    if not called.pou.stack_bytes:
        return nullcontext(Callee(body, called, _instance(body, called), None))
    return _on_stack(body, call, called)


@contextmanager
def _on_stack(body: BodyContext, call: tree.Expr, called: PouCall) -> Iterator[Callee]:
    with frame_stack.frame(body, called, body.site(call)) as frame:
        yield Callee(body, called, _instance(body, called), frame)


# --- EN and ENO -------------------------------------------------------------------------------------------------------


def _enabled(callee: Callee, call: tree.Expr, after: Block) -> None:
    """The whole call and the statements `after` it, inside an IF where EN is given or declared."""
    body, called = callee.body, callee.called
    site = body.site(call)
    eno = callee.parameter("ENO", "VAR_OUTPUT")
    enable = _enable(callee, site)
    if enable is None:
        _execute(callee, site, eno)
        body.emit(*after)
        _report(body, called, TRUE, site)
        return
    enable = body.to_temporary(enable)
    with body.block() as inner:
        _execute(callee, site, eno)
        body.emit(*after)
    otherwise: Block = ()
    if eno is not None and (callee.instance is not None or called.outputs):
        with body.block() as disabled:
            body.emit(callee.slot(eno).store(FALSE, site))
            _outputs(callee, [output for output in called.outputs if output[0] is eno], site)
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


def _enable(callee: Callee, site: int) -> Node | None:
    """The value of EN, which is stored if the POU declares it; None if it is neither given nor declared, or an input as any
    other."""
    body, called = callee.body, callee.called
    declared = next((variable for variable in called.pou.parameters("VAR_INPUT") if variable.guards), None)
    enable = body.value(called.enable, BOOL) if called.enable is not None else None
    if declared is None:
        return enable
    place = callee.slot(declared)
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


# --- what is passed and executed --------------------------------------------------------------------------------------


def _execute(callee: Callee, site: int, eno: Variable | None) -> None:
    """Inputs, the body unless a task of its own runs it, outputs."""
    body, called = callee.body, callee.called
    _inputs(callee, site)
    if eno is not None and (called.pou.enables_itself or not called.pou.writes_eno):
        body.emit(callee.slot(eno).store(TRUE, site))
    statement = dispatch.call(body, called, callee.instance, site)
    if called.tasked is not None:
        statement = ("if", ((("not", "b", body.slot(called.tasked).load()), (statement,)),), ())
    body.emit(statement)
    _outputs(callee, called.outputs, site)
    if called.pou.actions:
        _forget(callee)


def _forget(callee: Callee) -> None:
    """Have an ACTION that is called later find NULL in place of arguments of in-outs that may have ended by then."""
    body = callee.body
    for variable, expr in callee.called.in_outs:
        if _may_end(body, expr):
            body.emit(("store", "ref", callee.slot(variable).address, ("const", "ref", 0)))


def _may_end(body: BodyContext, expr: tree.Expr) -> bool:
    """True if what an in-out is bound to may end with the body that passes it."""
    variable = body.facts.variables.get(body.facts.root(expr))
    return variable is not None and (variable.kind == "VAR_IN_OUT" or variable.place == "frame")


def _inputs(callee: Callee, site: int) -> None:
    """Evaluate all arguments in the order of writing, then store them; aggregates are copied in between."""
    body, called = callee.body, callee.called
    passed = sorted([*called.inputs, *called.in_outs], key=lambda pair: pair[1].start)
    aggregates = [(v, e) for v, e in passed if v.kind == "VAR_INPUT" and is_aggregate(v.type)]
    passed = [pair for pair in passed if pair not in aggregates]
    nodes = body.sequence(_argument(body, variable, expr) for variable, expr in passed)
    for variable, expr in aggregates:
        body.copy(callee.slot(variable), body.aggregate(expr), site)
    for (variable, expr), node in zip(passed, nodes, strict=True):
        place = callee.slot(variable)
        if variable.kind == "VAR_IN_OUT":
            _bind(body, variable, place, expr, node)
        else:
            body.write(place, node, site)
    for variable in called.kept:
        assert variable.own is not None
        own_in_outs.bind(body, callee.slot(variable), callee.slot(variable.own), site)
    if called.pou.is_routine:
        given = {id(v) for v, _ in called.inputs}
        for variable in called.pou.parameters("VAR_INPUT"):
            if id(variable) not in given and not variable.guards:
                body.emit(("fill", callee.slot(variable).address, variable.initial))


def _argument(body: BodyContext, variable: Variable, expr: tree.Expr) -> Node:
    if (copy := body.facts.copies.get(expr)) is not None:
        if isinstance(copy.type, StringType):
            body.write(body.slot(copy), body.value(expr, copy.type), body.site(expr))
            return body.slot(copy).reference()
        held = body.to_temporary(body.value(expr, BOOL))
        body.emit(body.slot(copy).store(held, body.site(expr)))
        return body.slot(copy).reference()
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


def _outputs(callee: Callee, outputs: list[tuple[Variable, tree.Expr, bool]], site: int) -> None:
    body = callee.body
    for variable, target, negated in outputs:
        source = callee.slot(variable)
        if source.type is not (kind := followed(source.type)):
            source = Place((("ref", source.load(), site), 0, ()), kind)
        own_in_outs.written(body, target)
        place = body.place(target)
        if is_aggregate(source.type):
            body.copy(place, source, site)
            continue
        node = source.load()
        if negated:
            node = ("not", "b", node)
        body.write(place, implicit(body, node, source.type, base(place.type)), site)
