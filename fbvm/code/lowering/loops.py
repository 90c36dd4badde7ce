"""Lowering of FOR, WHILE and REPEAT.  Each pass charges the step budget at its start."""

from __future__ import annotations

from fbvm.base.types import Elementary, SubrangeType, Type, base, machine
from fbvm.code.builder.places import Place
from fbvm.code.lowering.context import EXIT, BodyContext, StatementRules
from fbvm.code.lowering.step_costs import step_cost
from fbvm.code.operations import Block, Node
from fbvm.syntax import tree


def _charge(statements: tree.Block, site: int) -> Node:
    return ("charge", step_cost(statements) + 1, site)


def _while(body: BodyContext, node: tree.While, site: int) -> None:
    head = (_charge(node.body, site), *body.exit_if(node.condition, False, site))
    body.emit(("loop", head, body.lowered(node.body), ()))


def _repeat(body: BodyContext, node: tree.Repeat, site: int) -> None:
    tail = body.exit_if(node.until, True, body.site(node.until))
    body.emit(("loop", (_charge(node.body, site),), body.lowered(node.body), tail))


# --- FOR --------------------------------------------------------------------------------------------------------------


def _for(body: BodyContext, node: tree.For, site: int) -> None:
    """Bounds and step are evaluated once, in the order of writing.

    The variable ends beyond the last value.  Where the next value does not fit its type, it ends at the last one that was
    used, or in a dialect at the next one as it wraps."""
    place = body.reusable(body.place(node.variable))
    step = _constant_step(body, node)
    if body.dialect.loop_ends_each_pass and (step is None or node.last not in body.facts.constants):
        _for_with_bounds_of_each_pass(body, node, place, step, site)
        return
    kind = base(place.type)
    wanted: list[tuple[tree.Expr, Type | None]] = [(node.first, kind), (node.last, kind)]
    if step is None:
        assert node.step is not None
        wanted.append((node.step, kind))
    first, last, *computed = body.operands(*wanted)
    first = body.to_temporary(first)
    last = body.to_temporary(last)
    by = body.to_temporary(computed[0]) if computed else last
    if computed:
        _stop_if_zero(body, by, site)
    body.write(place, first, site)
    head, tail = _known_step(body, place, last, step, site) if step is not None else \
        _computed_step(body, place, last, by, by, site)
    head = (_charge(node.body, site), *head)
    body.emit(("loop", head, body.lowered(node.body), (*tail, _observation(place, site))))


def _constant_step(body: BodyContext, node: tree.For) -> int | None:
    """The step of a FOR, or None if it is known only when the program runs."""
    if node.step is None:
        return 1
    known = body.facts.constants.get(node.step)
    return int(known) if known is not None else None


def _for_with_bounds_of_each_pass(body: BodyContext, node: tree.For, place: Place, step: int | None, site: int) -> None:
    """FOR in a dialect that evaluates the end in front of every pass, and the step behind it.

    Whether the loop counts up or down is settled by the step in front of the first pass."""
    kind = base(place.type)
    body.write(place, body.value(node.first, kind), site)
    behind: Block = ()
    begun = _evaluated_step(body, node, kind, site) if step is None else None
    with body.block() as begin:
        last = body.to_temporary(body.value(node.last, kind), always=True)
    if begun is None:
        assert step is not None
        head, tail = _known_step(body, place, last, step, site)
    else:
        with body.block() as stepped:
            following = _evaluated_step(body, node, kind, site)
        behind = tuple(stepped)
        head, tail = _computed_step(body, place, last, begun, following, site)
    head = (_charge(node.body, site), *begin, *head)
    body.emit(("loop", head, body.lowered(node.body), (*behind, *tail, _observation(place, site))))


def _evaluated_step(body: BodyContext, node: tree.For, kind: Type, site: int) -> Node:
    """The step in a temporary of its own; a step of 0 traps R0109."""
    assert node.step is not None
    by = body.to_temporary(body.value(node.step, kind), always=True)
    _stop_if_zero(body, by, site)
    return by


def _stop_if_zero(body: BodyContext, step: Node, site: int) -> None:
    form = step[1]
    body.emit(("if", ((("eq", "b", form, step, ("const", form, 0)), (("stop", "R0109", site),)),), ()))


def _observation(place: Place, site: int) -> Node:
    """The observation of a write to the variable of the loop."""
    return ("observe", "write", site, place.detail())


def _known_step(body: BodyContext, place: Place, last: Node, step: int, site: int) -> tuple[Block, Block]:
    """What stands in front of and behind each pass: the test of the end, and the addition of a constant step."""
    form = machine(place.type)
    low, high = _limits(place.type)
    now = place.load()
    up = step > 0
    edge = high - step if up else low - step
    following = ("add" if up else "sub", form, now, ("const", form, abs(step)))
    head = (_exit_if("gt" if up else "lt", form, now, last),)
    tail: list[Node] = []
    if not low <= edge <= high:  # one step leaves the type
        return head, _overflow(body, place, following, site)
    if not (last[0] == "const" and (last[2] <= edge if up else last[2] >= edge)):
        tail.append(_exit_if("gt" if up else "lt", form, now, ("const", form, edge), _overflow(body, place, following, site)))
    tail.append(place.store(following, site))
    return head, tuple(tail)


def _computed_step(body: BodyContext, place: Place, last: Node, begun: Node, step: Node, site: int) -> tuple[Block, Block]:
    """The same for a step that is known only when the program runs; its first value, `begun`, says which way it counts."""
    form = machine(place.type)
    low, high = _limits(place.type)
    now, none = place.load(), ("const", form, 0)
    head = (("if", ((("gt", "b", form, begun, none), (_exit_if("gt", form, now, last),)),),
             (_exit_if("lt", form, now, last),)),)
    highest = ("sub", form, ("const", form, high), step)
    lowest = ("sub", form, ("const", form, low), step)
    following = ("add", form, now, step)
    leave = _overflow(body, place, following, site)
    ends = ("if", ((("gt", "b", form, step, none), (_exit_if("gt", form, now, highest, leave),)),),
            (_exit_if("lt", form, now, lowest, leave),))
    return head, (ends, place.store(following, site))


def _overflow(body: BodyContext, place: Place, following: Node, site: int) -> Block:
    """What leaves the loop where the following value does not fit the type of the variable."""
    if body.dialect.loop_counters_wrap and not isinstance(place.type, SubrangeType):
        return (place.store(following, site), _observation(place, site), *EXIT)
    return EXIT


def _exit_if(name: str, form: str, left: Node, right: Node, leave: Block = EXIT) -> Node:
    return ("if", (((name, "b", form, left, right), leave),), ())


def _limits(kind: Type) -> tuple[int, int]:
    kind = kind if isinstance(kind, SubrangeType) and kind.checked else base(kind)
    assert isinstance(kind, SubrangeType | Elementary)
    return kind.low, kind.high


STATEMENTS: StatementRules = {tree.For: _for, tree.While: _while, tree.Repeat: _repeat}
