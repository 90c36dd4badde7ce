"""Lowering of statements, except loops."""

from __future__ import annotations

from dataclasses import replace

from fbvm.base.types import BOOL, StructType, machine
from fbvm.check.symbols.facts import StandardCall
from fbvm.code.builder.places import is_aggregate
from fbvm.code.image import RungPicture
from fbvm.code.lowering import byte_order, dispatch, own_in_outs, pointers, pou_calls
from fbvm.code.lowering.context import EXIT, BodyContext, StatementRules
from fbvm.code.operations import Block, Node
from fbvm.code.pictures.sfc import sfc_picture
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc

# --- assignments ------------------------------------------------------------------------------------------------------


def _assign(body: BodyContext, node: tree.Assign, site: int) -> None:
    if node.op == "REF=" and node.targets[0] not in body.facts.sets:
        slot = body.reusable(body.reference_slot(node.targets[0]))
        body.emit(slot.store(pointers.binding(body, node.value), site))
        return
    if node.op in ("S=", "R="):
        condition = body.value(node.value, BOOL)
        with body.block() as inner:
            for target in node.targets:
                body.write(body.place(target), ("const", "b", int(node.op == "S=")), site)
        body.emit(("if", ((condition, tuple(inner)),), ()))
        return
    value = node.value
    for target in reversed(node.targets):
        if (wanted := body.facts.attempts.get(target)) is not None:
            reference = dispatch.attempted(body, body.value(value), wanted, site)
            body.write(body.place(target), reference, site)
        elif target in body.facts.failed:
            is_instance = isinstance(body.facts.types[value], StructType)
            body.to_temporary(body.place(value).reference() if is_instance else body.value(value))
            body.write(body.place(target), ("const", "ref", 0), site)
        else:
            _assign_one(body, target, value, site)
        value = target


def _assign_one(body: BodyContext, target: tree.Expr, value: tree.Expr, site: int) -> None:
    """`target := value`: the subscripts of the target are evaluated first, then the value."""
    kind = body.facts.types[target]
    if (setter := body.facts.sets.get(target)) is not None:
        pou_calls.run(body, target, replace(setter, inputs=[(setter.pou.parameters("VAR_INPUT")[0], value)]))
        return
    if isinstance(value, tree.Call) and value in body.facts.reversed_bytes:
        called = body.facts.calls[value]
        assert isinstance(called, StandardCall)
        byte_order.assign(body, target, called, site)
        return
    own_in_outs.written(body, target)
    place = body.reusable(body.place(target))
    if is_aggregate(kind):
        body.copy(place, body.aggregate(value), site)
        return
    mark = len(body.out)
    node = body.value(value, kind)
    if len(body.out) > mark and isinstance(place.address[0], tuple):
        place = body.reusable(place)
    body.write(place, node, site)


# --- selections -------------------------------------------------------------------------------------------------------


def _if(body: BodyContext, node: tree.If, site: int) -> None:
    _branches(body, list(node.branches), node.otherwise or (), site)


def _branches(body: BodyContext, branches: list[tuple[tree.Expr, tree.Block]], otherwise: tree.Block, site: int) -> None:
    """One `if` as long as conditions emit no statements; from the first that does, a nested `if`."""
    rows: list[tuple[Node, Block]] = []
    rest: Block | None = None
    for position, (condition, inner) in enumerate(branches):
        with body.block() as before:
            node = body.value(condition, BOOL)
        if before and rows:
            with body.block() as nested:
                _branches(body, branches[position:], otherwise, site)
            rest = tuple(nested)
            break
        body.out += before
        rows.append((node, body.lowered(inner)))
    body.emit(("if", tuple(rows), body.lowered(otherwise) if rest is None else rest))


def _case(body: BodyContext, node: tree.Case, site: int) -> None:
    if node in body.facts.text_cases:
        _text_case(body, node)
        return
    form = machine(body.facts.types[node.selector])
    selector = body.value(node.selector)
    rows = tuple((labels, body.lowered(branch.body)) for branch in node.branches if (labels := body.facts.labels[branch]))
    body.emit(("case", form, selector, rows, body.lowered(node.otherwise or ())))


def _text_case(body: BodyContext, node: tree.Case) -> None:
    """CASE of a text: the first branch one of whose labels equals it."""
    kind = body.facts.types[node.selector]
    form, selector = machine(kind), body.to_temporary(body.value(node.selector), always=True)
    rows = []
    for branch in node.branches:
        equal, *more = (("eq", "b", form, selector, body.value(label, kind)) for label, _ in branch.labels)
        for other in more:
            equal = body.cut_if_deep(("or", "b", equal, other))
        rows.append((equal, body.lowered(branch.body)))
    otherwise = body.lowered(node.otherwise or ())
    body.emit(*([("if", tuple(rows), otherwise)] if rows else otherwise))


# --- jumps ------------------------------------------------------------------------------------------------------------


def _exit(body: BodyContext, node: tree.Exit, site: int) -> None:
    body.leave(node, EXIT, site)


def _continue(body: BodyContext, node: tree.Continue, site: int) -> None:
    body.leave(node, (("next",),), site)


def _return(body: BodyContext, node: tree.Return, site: int) -> None:
    if node in body.facts.conditional:
        assert node.value is not None
        condition = body.value(node.value, BOOL)
        with body.block() as leaving:
            body.leave(node, (*body.at_return, ("return",)), site)
        body.emit(("if", ((condition, tuple(leaving)),), ()))
        return
    if node.value is not None:
        assert body.pou.result is not None
        place = body.slot(body.pou.result)
        if is_aggregate(place.type):
            body.copy(place, body.aggregate(node.value), site)
        else:
            body.write(place, body.value(node.value, place.type), site)
    body.leave(node, (*body.at_return, ("return",)), site)


# --- ladder and charts ------------------------------------------------------------------------------------------------


def _lines(body: BodyContext, node: ladder.Ladder | il.InstructionList, site: int) -> None:
    body.lower(node.body)


def _rung(body: BodyContext, node: ladder.Rung, site: int) -> None:
    steps = tuple((body.site(step), step.prefix, step.mnemonic, step.operands) for step in node.steps)
    body.program.rungs.append(RungPicture(body.pou.number, site, node.number, node.comment, steps, section=node.section))
    body.emit(("observe", "rung", site, node.number))
    body.lower(node.body)


def _sfc(body: BodyContext, node: sfc.Sfc, site: int) -> None:
    picture = sfc_picture(node, body.pou, body.site)
    body.program.charts.append(picture)
    body.emit(("observe", "statement", picture.site, None))
    body.lower(node.body)


STATEMENTS: StatementRules = {
    tree.Assign: _assign, tree.If: _if, tree.Case: _case, tree.Exit: _exit, tree.Continue: _continue, tree.Return: _return,
    il.InstructionList: _lines, ladder.Ladder: _lines, ladder.Rung: _rung, sfc.Sfc: _sfc,
}
