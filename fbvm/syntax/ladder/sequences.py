"""Steps of a sequence: STEP and SNXT (from memory of the family; when the outputs of a step fall is assumed).

The rungs of a step stand under a jump that passes over them while the step is OFF, and under an interlock for the one
execution after the step has ended: outputs turn OFF and timers are reset, everything else keeps its state.
"""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax.ladder.context import Interlock, RungContext, StepRefused
from fbvm.syntax.ladder.spans import Spans
from fbvm.syntax.tree import Statement

AREA = "STEP"
"""The number of the jump and of the interlock in the context."""
PASSES, INHIBITS = "$STEP", "$STEP ends"
"""Names of the variable of the jump and of that of the interlock."""


class Sequences:
    """Lowers STEP and SNXT, and covers the rungs of a step with their jump and their interlock."""

    def __init__(self, context: RungContext, spans: Spans) -> None:
        self.context, self.spans = context, spans
        self._bit: tuple[str, int, int] | None = None
        """The bit of the step that the rung at work belongs to, as it was written, with its start and end."""
        self.instructions: dict[str, Callable[[], None]] = {".step": self.step, ".next_step": self.next_step}

    def step(self) -> None:
        """STEP with a bit begins the rungs of that step; without a bit it ends the sequence."""
        context = self.context
        self.close()
        if self.spans.is_inside:
            raise StepRefused("STEP stands inside of a loop, a jump, an interlock or a subroutine", "steps stand by themselves")
        if not context.line.step.operands:
            return
        bit, before = context.operand(0), context.variable(context.name("step"))
        here = context.temporary(context.name("here"))
        is_off = context.negated(context.binary("OR", context.temporary(here.text), before))
        context.emit(
            *context.if_reachable(context.assign(here, bit)),
            context.assign(context.temporary(PASSES), is_off),
            context.assign(context.temporary(INHIBITS), context.negated(context.temporary(here.text))),
            context.assign(context.variable(before.text), context.temporary(here.text)))
        context.jumps[AREA] = context.temporary(PASSES)
        context.interlocks[AREA] = Interlock(INHIBITS, context.start, context.end)
        self._bit = (context.line.step.operands[0], *context.line.places[0])

    def next_step(self) -> None:
        """SNXT: with the condition ON, ends the step that the SNXT stands in and begins the step of the operand."""
        context = self.context
        begins = context.if_reachable(context.assign(context.operand(0), context.truth(True)))
        ends: tuple[Statement, ...] = ()
        if self._bit is not None:
            ends = (context.assign(context.operands.expression(self._bit[0], "B", *self._bit[1:]), context.truth(False)),)
        context.emit(context.when(context.variation(context.power()), *ends, *begins))

    def close(self) -> None:
        """End the step: the rungs that follow belong to none."""
        self._bit = None
        self.context.jumps.pop(AREA, None)
        self.context.interlocks.pop(AREA, None)
