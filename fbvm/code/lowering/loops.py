"""Lowering of FOR, WHILE and REPEAT."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.types import BOOL, Elementary, SubrangeType, Type, base, machine
from fbvm.code.lowering.places import Place
from fbvm.code.lowering.step_costs import counted
from fbvm.code.operations import Block, Node
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering

LEAVE: Block = (("exit",),)


class LoopLowering:
    """Lowers the loops of one body.  Each pass charges the step budget at its start."""

    def __init__(self, body: BodyLowering) -> None:
        self.body = body

    def _charge(self, statements: tree.Block, site: int) -> Node:
        return ("charge", counted(statements) + 1, site)

    def _condition(self, condition: tree.Expr, leave_on: bool, site: int) -> Block:
        """Statements that leave the loop if the condition is `leave_on`."""
        reads, self.body.reads = self.body.reads, []
        with self.body.block() as inner:
            node = self.body.value(condition, BOOL)
            node = node if leave_on else ("not", "b", node)
            inner.append(("if", ((node, LEAVE),), ()))
            self.body.observe_reads(0, site)
        self.body.reads = reads
        return tuple(inner)

    def while_(self, node: tree.While, site: int) -> None:
        head = (self._charge(node.body, site), *self._condition(node.condition, False, site))
        self.body.out.append(("loop", head, self.body.inner(node.body), ()))

    def repeat(self, node: tree.Repeat, site: int) -> None:
        tail = self._condition(node.until, True, self.body.site(node.until))
        self.body.out.append(("loop", (self._charge(node.body, site),), self.body.inner(node.body), tail))

    # --- FOR --------------------------------------------------------------------------------------------------------

    def for_(self, node: tree.For, site: int) -> None:
        """Bounds and step are worked out once, in order of writing.  The variable ends beyond the last value; where the
        next one does not fit its type, at the last one used, or in a dialect at the next one as it wraps."""
        body = self.body
        place = body.places.fixed(body.places.of(node.variable))
        kind = base(place.type)
        wanted: list[tuple[tree.Expr, Type | None]] = [(node.first, kind), (node.last, kind)]
        step: int | None = 1
        if node.step is not None:
            known = body.facts.constants.get(node.step)
            step = int(known) if known is not None else None
            if step is None:
                wanted.append((node.step, kind))
        if body.dialect.loop_ends_each_pass and (step is None or node.last not in body.facts.constants):
            self._each_pass(node, place, wanted, step, site)
            return
        first, last, *computed = body.values.operands(*wanted)
        first = body.keep(first)
        last = body.keep(last)
        by = body.keep(computed[0]) if computed else None
        if by is not None:
            zero = ("const", by[1], 0)
            body.out.append(("if", ((("eq", "b", by[1], by, zero), (("stop", "R0109", site),)),), ()))
        body.write(place, first, site)
        head, tail = self._known_step(place, last, step, site) if step is not None else \
            self._computed_step(place, last, by or last, by or last, site)
        head = (self._charge(node.body, site), *head)
        body.out.append(("loop", head, body.inner(node.body), (*tail, *self._observed(place, site))))

    def _each_pass(self, node: tree.For, place: Place, wanted: list[tuple[tree.Expr, Type | None]], step: int | None,
                   site: int) -> None:
        """The loop of a dialect that works out the end in front of every pass, and the step behind it; which way it counts
        is settled by the step in front of the first pass."""
        body = self.body
        body.write(place, body.value(*wanted[0]), site)
        behind: Block = ()
        begun = self._step(*wanted[2], site) if step is None else None
        with body.block() as begin:
            last = body.keep(body.value(*wanted[1]), always=True)
        if begun is None:
            assert step is not None
            head, tail = self._known_step(place, last, step, site)
        else:
            with body.block() as stepped:
                following = self._step(*wanted[2], site)
            behind = tuple(stepped)
            head, tail = self._computed_step(place, last, begun, following, site)
        head = (self._charge(node.body, site), *begin, *head)
        body.out.append(("loop", head, body.inner(node.body), (*behind, *tail, *self._observed(place, site))))

    def _step(self, expr: tree.Expr, kind: Type | None, site: int) -> Node:
        """A step worked out now, which stops the program if it is 0."""
        by = self.body.keep(self.body.value(expr, kind), always=True)
        self.body.out.append(("if", ((("eq", "b", by[1], by, ("const", by[1], 0)), (("stop", "R0109", site),)),), ()))
        return by

    def _observed(self, place: Place, site: int) -> Block:
        with self.body.block() as inner:
            self.body.observe_write(place, site)
        return tuple(inner)

    def _known_step(self, place: Place, last: Node, step: int, site: int) -> tuple[Block, Block]:
        """Test in front of a pass, and the step behind it, for a step known now."""
        form = machine(place.type)
        low, high = _span(place.type)
        now = self.body.places.load(place)
        up = step > 0
        edge = high - step if up else low - step
        size = ("const", form, abs(step))
        head = (_leave_if("gt" if up else "lt", form, now, last),)
        following = ("add" if up else "sub", form, now, size)
        tail: list[Node] = []
        if not low <= edge <= high:
            return head, self._leave(place, following, site)  # one step leaves the type
        if not (last[0] == "const" and (last[2] <= edge if up else last[2] >= edge)):
            tail.append(_leave_if("gt" if up else "lt", form, now, ("const", form, edge),
                                  self._leave(place, following, site)))
        tail.append(self.body.places.store(place, following, site))
        return head, tuple(tail)

    def _leave(self, place: Place, following: Node, site: int) -> Block:
        """What leaves the loop where the following value does not fit the type of the variable."""
        if self.body.dialect.loop_counters_wrap and not isinstance(place.type, SubrangeType):
            return (self.body.places.store(place, following, site), *self._observed(place, site), *LEAVE)
        return LEAVE

    def _computed_step(self, place: Place, last: Node, begun: Node, step: Node, site: int) -> tuple[Block, Block]:
        """The same for a step that is known only when the program runs; the first one, `begun`, says which way it counts."""
        form = machine(place.type)
        low, high = _span(place.type)
        now = self.body.places.load(place)
        forward = ("gt", "b", form, begun, ("const", form, 0))
        head = (("if", ((forward, (_leave_if("gt", form, now, last),)),), (_leave_if("lt", form, now, last),)),)
        room_up = ("sub", form, ("const", form, high), step)
        room_down = ("sub", form, ("const", form, low), step)
        upward = ("gt", "b", form, step, ("const", form, 0))
        following = ("add", form, now, step)
        leave = self._leave(place, following, site)
        ends = ("if", ((upward, (_leave_if("gt", form, now, room_up, leave),)),),
                (_leave_if("lt", form, now, room_down, leave),))
        return head, (ends, self.body.places.store(place, following, site))


def _leave_if(name: str, form: str, left: Node, right: Node, leave: Block = LEAVE) -> Node:
    return ("if", (((name, "b", form, left, right), leave),), ())


def _span(kind: Type) -> tuple[int, int]:
    assert isinstance(kind, SubrangeType | Elementary)
    return kind.low, kind.high
