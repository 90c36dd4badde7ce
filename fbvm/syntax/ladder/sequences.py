"""Steps of a sequence: STEP and SNXT (from memory of the family; when the outputs of a step fall is assumed).

The rungs of a step stand under a jump that passes over them while the step is OFF, and under an interlock for the one
execution after it has ended: outputs turn OFF and timers are reset, everything else keeps its state.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.syntax.ladder.spans import Interlock, StepRefused
from fbvm.syntax.tree import Statement

if TYPE_CHECKING:
    from fbvm.syntax.ladder.lowering import Rungs

AREA = "STEP"
"""The name of the jump and of the interlock."""
PASSES, INHIBITS = "$STEP", "$STEP ends"


class Steps:
    """Keeps the step in which the rung at work stands."""

    def __init__(self, rungs: Rungs) -> None:
        self.rungs = rungs
        self._bit: tuple[str, int, int] | None = None
        """The bit of the step as it was written, and where."""

    def step(self) -> None:
        """STEP with a bit begins the rungs of that step, without one it ends all."""
        rungs, spans = self.rungs, self.rungs.spans
        self.close()
        if spans.jumps or spans.interlocks or len(spans.frames) > 1:
            raise StepRefused("STEP stands inside of a loop, a jump, an interlock or a subroutine", "steps stand by themselves")
        if not rungs.line.step.operands:
            return
        bit, before = rungs.operand(0), rungs.variable(rungs.name("step"))
        here = rungs.temporary(rungs.name("here"))
        rungs.emit(
            *rungs.reaching(rungs.assign(here, bit)),
            rungs.assign(rungs.temporary(PASSES), rungs.negated(rungs.binary("OR", rungs.temporary(here.text), before))),
            rungs.assign(rungs.temporary(INHIBITS), rungs.negated(rungs.temporary(here.text))),
            rungs.assign(rungs.variable(before.text), rungs.temporary(here.text)))
        spans.jumps[AREA] = rungs.temporary(PASSES)
        spans.interlocks[AREA] = Interlock(INHIBITS, rungs.start, rungs.end)
        self._bit = (rungs.line.step.operands[0], *rungs.line.places[0])

    def next_step(self) -> None:
        """SNXT: with the condition ON the step in which it stands ends, and another one begins."""
        rungs = self.rungs
        begins = rungs.reaching(rungs.assign(rungs.operand(0), rungs.truth(True)))
        ends: tuple[Statement, ...] = ()
        if self._bit is not None:
            ends = (rungs.assign(rungs.operands.expression(self._bit[0], "B", *self._bit[1:]), rungs.truth(False)),)
        rungs.emit(rungs.when(rungs.variation(rungs.power()), *ends, *begins))

    def close(self) -> None:
        """The rungs that follow belong to no step."""
        self._bit = None
        self.rungs.spans.jumps.pop(AREA, None)
        self.rungs.spans.interlocks.pop(AREA, None)
