"""Lowering of bodies: a POU of the tree in, its code out.  Every meaning is decided here and in the rules for nodes.

This is the one module that knows all rules; a rule knows the context only (`context`)."""

from __future__ import annotations

from fbvm.base.types import BOOL
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Edge, Pou, Start
from fbvm.code.builder.places import Place
from fbvm.code.image import Body, RungPicture
from fbvm.code.lowering import aggregates, attempts, calls, frame_stack, loops, operators, pointers, statements, variables
from fbvm.code.lowering.context import BodyContext, Rules
from fbvm.code.lowering.program import Program
from fbvm.code.lowering.step_costs import step_cost, with_costs
from fbvm.code.operations import Node
from fbvm.code.pictures.st_rungs import NoRung, st_rung, with_coils
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc

RULES = Rules(
    values={**operators.VALUES, **calls.VALUES, **variables.VALUES, **aggregates.VALUES},
    places={**calls.PLACES, **variables.PLACES, **aggregates.PLACES},
    statements={**statements.STATEMENTS, **calls.STATEMENTS, **loops.STATEMENTS, **attempts.STATEMENTS},
)


def lower_body(program: Program, checker: Checker, pou: Pou) -> Body:
    """The code of a POU.

    program: takes what the body leaves besides its code, such as sites and pictures of rungs.
    checker: has checked the POU without an error.
    pou: the POU, to which layout has given its place."""
    body = BodyContext(program, checker, pou, RULES)
    body.emit(("charge", step_cost(pou.tree.body) + 1, body.entry_site))
    frame_stack.enter(body)
    pointers.begin_leases(body)
    _enter(body)
    if program.drawn and not pou.source.library and not body.is_hidden:
        _draw(body, pou.tree.body)
    body.lower(pou.tree.body)
    body.emit(*body.at_return)
    size = pou.type.size if pou.type is not None else 0
    return Body(pou.name, pou.kind, with_costs(tuple(body.out)), size)


def lower_reference(program: Program, checker: Checker, pou: Pou, start: Start) -> Node:
    """An initial reference of a variable of a POU, as an expression that needs no statements in front of it."""
    return pointers.initial(BodyContext(program, checker, pou, RULES), start)


def _enter(body: BodyContext) -> None:
    """Emit what a body does before its first statement: initial values of the frame, edges of inputs."""
    pou = body.pou
    start = pou.frame_inputs if pou.is_routine else 0
    initial = pou.frame_initial[start:]
    if initial:
        frame = body.frame or Place((*body.program.frame(pou), ()), BOOL)
        body.emit(("fill", frame.moved(start, BOOL).address, initial))
    for offset, reference in body.program.entry_references.get(pou, ()):
        slot = body.frame.moved(offset, reference.kind) if body.frame else Place(("abs", offset, ()), reference.kind)
        body.emit(slot.store(pointers.initial(body, reference), body.entry_site))
    for edge in pou.edges:
        _detect(body, edge)


def _detect(body: BodyContext, edge: Edge) -> None:
    """Set the hidden variable of an input declared R_EDGE or F_EDGE, and its memory for the next call."""
    memory = body.slot(edge.memory)
    pin = body.slot(edge.raw).load()
    before = memory.load()
    found: Node = ("and", "b", pin, ("not", "b", before))
    kept = pin
    if edge.falling:
        # the memory holds "the pin was low", which starts FALSE as in the standard's F_TRIG
        kept = ("not", "b", pin)
        found = ("and", "b", kept, ("not", "b", before))
    body.emit(body.slot(edge.hidden).store(found, body.entry_site), memory.store(kept, body.entry_site))


def _draw(body: BodyContext, block: tree.Block) -> None:
    """Record pictures of statements of Structured Text, and of those that instruction lists stand for, as rungs, and which
    expressions are observed for their contacts."""
    drawn_already = tree.Empty | ladder.Ladder | ladder.Rung | sfc.Sfc
    statements = [each for one in block for each in (one.body if isinstance(one, il.InstructionList) else (one,))]
    groups = with_coils([one for one in statements if not isinstance(one, drawn_already)])
    for number, (statement, *coils) in enumerate(groups, 1):
        site, steps, comment = body.site(statement), (), ""  # type: int, tuple[tuple[int, str, str, tuple[str, ...]], ...], str
        try:
            rung = st_rung(statement, body.facts, body.pou.source.text, coils)
            steps = tuple((body.site(part or statement), *step) for part, step in rung.steps)
            body.contacts |= rung.marks
        except NoRung as reason:
            comment = f"in line {body.pou.source.place(statement.start)[0]} is not drawn: {reason}"
        body.rung_numbers[site] = number
        body.program.rungs.append(RungPicture(body.pou.number, site, number, comment, steps, is_text=True))
