"""Lowering of __TRY: its statements become a body of their own, which the operation `attempt` executes.

A jump that leads out of them stops that body, and the body around does it.  With __FINALLY the handler has a body of its own as
well if something leads out of it, so that __FINALLY comes first.  (CODESYS Development System, Operator: __TRY, __CATCH,
__FINALLY, __ENDTRY.)"""

from __future__ import annotations

from collections.abc import Mapping

from fbvm.check.symbols.statement_lists import bodies
from fbvm.code.image import Body
from fbvm.code.lowering import frame_stack, pointers
from fbvm.code.lowering.context import EXIT, BodyContext, StatementRules
from fbvm.code.lowering.step_costs import step_cost, with_costs
from fbvm.code.operations import WAYS_OUT, Block, Node
from fbvm.syntax import tree

_LOOPS = tree.For | tree.While | tree.Repeat
_WAYS: dict[type, str] = {tree.Return: "return", tree.Exit: "exit", tree.Continue: "next"}
_JUMPS: dict[str, Block] = {"exit": EXIT, "next": (("next",),)}


def _try(body: BodyContext, node: tree.Try, site: int) -> None:
    before = [(form, word, body.to_temporary(("load", form, word)))
              for form, word in (*frame_stack.kept(body), *pointers.kept(body))]
    ways = _ways_out(node.body)
    ended = _attempt(body, node.body, ways, True, site)
    with body.block() as handling:
        body.emit(*(("store", form, word, value) for form, word, value in before))
        if node.code is not None:
            body.write(body.place(node.code), ended, site)
        more = _ways_out(node.handler) if node.final is not None else {}
        if more:
            ended_again = _attempt(body, node.handler, more, False, site)
            body.emit(("let", ended[2], "u32", ended_again))
        else:
            body.lower(node.handler)
    body.emit(("if", ((("gt", "b", "u32", ended, ("const", "u32", max(WAYS_OUT.values()))), tuple(handling)),), ()))
    body.lower(node.final or ())
    _follow(body, {**ways, **more}, ended, site)


def _ways_out(block: tree.Block, in_loop: bool = False) -> dict[tree.Statement, str]:
    """The statements that lead out of a block, each with its code."""
    found: dict[tree.Statement, str] = {}
    for statement in block:
        if isinstance(statement, tree.Return) or not in_loop and isinstance(statement, tree.Exit | tree.Continue):
            found[statement] = _WAYS[type(statement)]
        for inner in bodies(statement):
            found |= _ways_out(inner, in_loop or isinstance(statement, _LOOPS))
    return found


def _attempt(body: BodyContext, block: tree.Block, ways: Mapping[tree.Statement, str], traps: bool, site: int) -> Node:
    """Emit the execution of a block that has a body of its own.  Returns what has ended that, as u32."""
    part, pou = body.part(ways), body.pou
    part.emit(("charge", step_cost(block) + 1, site))
    frame_stack.enter_part(part)
    part.lower(block)
    size = pou.type.size if pou.type is not None else 0
    name = f"{pou.name} {'__TRY' if traps else '__CATCH'}"
    number = body.program.add_part(Body(name, pou.kind, with_costs(tuple(part.out)), size, True))
    ended = body.new_temporary()
    body.emit(("attempt", number, None if pou.kind == "FUNCTION" else ("self", 0, ()), ended, traps))
    return ("tmp", "u32", ended)


def _follow(body: BodyContext, ways: Mapping[tree.Statement, str], ended: Node, site: int) -> None:
    """Emit the jumps with which the statements of a block may have ended."""
    for way, number in WAYS_OUT.items():
        statement = next((statement for statement, its in ways.items() if its == way), None)
        if statement is not None:
            with body.block() as jump:
                body.leave(statement, _JUMPS.get(way, (*body.at_return, ("return",))), site)
            body.emit(("if", ((("eq", "b", "u32", ended, ("const", "u32", number)), tuple(jump)),), ()))


STATEMENTS: StatementRules = {tree.Try: _try}
