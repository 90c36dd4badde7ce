"""Contacts, coils and what joins them: the instructions that make the execution condition, and those that write a bit."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.context import RungContext, StepRefused
from fbvm.syntax.tree import Expr
from fbvm.syntax.tree.ladder import Element

DEEPEST = 32
"""Most conditions that may be saved (8 on the real CPU units; assumed)."""
BRANCH_POINTS = 16
"""TR0 to TR15."""


class BitLogic:
    """Lowers contacts, connections of blocks, and coils."""

    def __init__(self, context: RungContext) -> None:
        self.context = context
        self.instructions: dict[str, Callable[[], None]] = {
            ".load": self._load,
            ".and": lambda: self.join("AND", self._contact()),
            ".or": lambda: self.join("OR", self._contact()),
            ".and_block": lambda: self._join_blocks("AND"),
            ".or_block": lambda: self._join_blocks("OR"),
            ".not": self._invert,
            ".up": lambda: self._differentiate(falling=False),
            ".down": lambda: self._differentiate(falling=True),
            ".out": self._out,
            ".keep": self._keep,
            ".difu": lambda: self._pulse(falling=False),
            ".difd": lambda: self._pulse(falling=True),
            ".set": lambda: self._set(True),
            ".reset": lambda: self._set(False),
        }

    # --- the execution condition ---

    def join(self, how: str, contact: Expr) -> None:
        """Join a contact to the execution condition: LD saves the condition and begins another one, AND and OR extend it.
        Raises StepRefused if too many conditions are saved."""
        context = self.context
        if how == "LD":
            if context.condition is not None:
                context.saved.append(context.condition)
            if len(context.waiting()) > DEEPEST:
                raise StepRefused(f"more than {DEEPEST} conditions are saved", "")
            context.condition = contact
        else:
            assert context.condition is not None
            context.condition = context.binary(how, context.condition, contact)

    def _contact(self) -> Element:
        context, step = self.context, self.context.line.step
        value = context.operand(0)
        if step.prefix.replace("!", ""):
            value = context.edge(value, "%" in step.prefix)
        return context.element(context.state_if_reachable(context.negated(value) if step.mnemonic.endswith("NOT") else value))

    def _load(self) -> None:
        context, bit = self.context, self._branch_point()
        if not bit:
            self.join("LD", self._contact())
        elif bit not in context.branches:
            raise StepRefused(f"nothing was written to {bit} in this rung", f"OUT {bit} comes first")
        else:
            self.join("LD", context.temporary(context.branches[bit]))

    def _branch_point(self) -> str:
        """The TR bit that is the operand of the step; "" if the operand is no TR bit."""
        text = self.context.line.step.operands[0].upper()
        return text if text.startswith("TR") and text[2:].isdecimal() else ""

    def _join_blocks(self, how: str) -> None:
        context = self.context
        if not context.saved:
            raise StepRefused(f"{how} LD joins two blocks, and there is one", "each block begins with LD")
        assert context.condition is not None
        context.condition = context.binary(how, context.saved.pop(), context.condition)

    def _invert(self) -> None:
        assert self.context.condition is not None
        self.context.condition = self.context.negated(self.context.condition)

    def _differentiate(self, *, falling: bool) -> None:
        context = self.context
        assert context.condition is not None
        context.condition = context.element(context.edge(context.condition, falling))

    # --- bits that are written ---

    def _out(self) -> None:
        context = self.context
        if bit := self._branch_point():
            self._branch(bit)
            return
        target, power = context.operand(0), context.power()
        value = context.negated(power) if context.line.step.mnemonic == "OUTNOT" else power
        off = context.assign(context.operand(0), context.truth(False))
        context.emit(*context.if_reachable(context.assign(target, value)), inhibited=context.if_reachable(off))

    def _branch(self, bit: str) -> None:
        """OUT TR0: keep the execution condition for LD TR0."""
        context = self.context
        if whole_number(bit[2:]) >= BRANCH_POINTS:
            raise StepRefused(f"there is no {bit}", f"TR0 to TR{BRANCH_POINTS - 1} are there")
        assert context.condition is not None
        context.evaluate_saved()
        kept = context.temporary(f"${bit}" if bit not in context.branches else context.name(bit))
        context.branches[bit] = kept.text
        context.used.add(kept.text)
        context.emit(context.assign(kept, context.element(context.condition)), always=True)
        context.condition = kept

    def _keep(self) -> None:
        context = self.context
        target = context.operand(0)
        set_, reset = context.inputs(2)
        kept = context.binary("AND", context.binary("OR", set_, context.operand(0)), context.negated(reset))
        context.emit(*context.if_reachable(context.assign(target, kept)))

    def _pulse(self, *, falling: bool) -> None:
        context = self.context
        edge = context.tracked(context.edge(context.power(), falling))
        context.emit(*context.if_reachable(context.assign(context.operand(0), edge)))

    def _set(self, value: bool) -> None:
        context = self.context
        target = context.operand(0)
        writes = context.if_reachable(context.assign(target, context.truth(value)))
        context.emit(context.when(context.variation(context.power()), *writes))
