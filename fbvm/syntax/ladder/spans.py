"""Instructions that cover several rungs: jumps, interlocks, loops and subroutines (C200HS p107, CPM1 p175; omissions of
the manuals assumed).

A jump over rungs is a variable that is TRUE while the rungs are passed over; a jump back and FOR are loops around rungs; an
interlock is a variable that is TRUE while the outputs under the interlock are inhibited.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from fbvm.base.digits import whole_number
from fbvm.syntax import tree
from fbvm.syntax.ladder.context import Interlock, RungContext, StepRefused
from fbvm.syntax.ladder.mnemonics import RungText
from fbvm.syntax.ladder.operands import TASKS
from fbvm.syntax.tree import Action, Block, Continue, Exit, Expr, For, NameRef, Repeat, Return, Statement
from fbvm.syntax.tree.ladder import Rung

INTERLOCK = "$IL"
INTERLOCKS = 16
"""Interlock numbers of MILH and MILR are below this."""
NUMBERS = 1024
"""Jump numbers and subroutine numbers are below this."""
DEEPEST_LOOPS = 15
WITHOUT_NUMBER = "0 without number"
"""The number of JMP0 and JME0."""


@dataclass
class Span:
    """A loop or a subroutine whose end has not been read."""

    what: str
    """FOR, or JME or SBN with the number; "" for the whole LADDER."""
    rung: Rung | None = None
    """The rung that begins it."""
    statements: list[Statement] = field(default_factory=list)
    """The rungs in it that have been read."""
    count: Expr | None = None
    """How often the rungs of a FOR are executed."""
    counter: NameRef | None = None
    """The variable that counts the executions of a FOR."""
    again: NameRef | None = None
    """The variable that a jump back to a JME sets."""
    enclosing: tuple[str, ...] = ()
    """The interlocks and jumps that cover the FOR."""


class Spans:
    """Lowers the instructions whose effect goes beyond their rung, and puts rungs into the loops that they belong to."""

    def __init__(self, context: RungContext) -> None:
        self.context = context
        self.open = [Span("")]
        """Loops and subroutines whose end has not been read, the innermost last; the first is the whole LADDER."""
        self.subroutines: list[Action] = []
        self._enclosing: dict[str, tuple[str, ...]] = {}
        """By number of a jump over rungs, the loops and interlocks that its JMP stands in."""
        self._jump_ends: dict[str, list[int]] = {}
        """By number, where the JMEs stand."""
        self._jump_starts: dict[str, list[int]] = {}
        """By number, where the JMPs, CJPs and CJPNs stand."""
        self._called: dict[str, tuple[int, int]] = {}
        """Numbers of subroutines that are called, with the place of the first call."""
        self._defined: set[str] = set()
        """Numbers of subroutines that are defined."""
        self._opening: Span | None = None
        """The loop or subroutine that begins behind the rung at work."""
        self._closing: str = ""
        """FOR, JMP or RET if the rung at work ends the innermost loop or subroutine."""
        self.instructions: dict[str, Callable[[], None]] = {
            ".end": self.end, ".task_on": self.task_on, ".task_off": self.task_off,
            ".interlock": self.interlock, ".interlock_clear": self.interlock_clear,
            ".interlock_number": self.interlock_number, ".interlock_end": self.interlock_end,
            ".jump": self.jump, ".jump_end": self.jump_end,
            ".for": self.begin_loop, ".next": self.end_loop, ".break": self.break_loop,
            ".call_subroutine": self.call_subroutine, ".macro": self.macro,
            ".subroutine": self.subroutine, ".return": self.end_subroutine,
        }  # fmt: skip

    @property
    def is_inside(self) -> bool:
        """Whether the step at work stands in a loop, a subroutine, an interlock or under a jump."""
        return len(self.open) > 1 or bool(self.context.jumps or self.context.interlocks)

    def find_jumps(self, texts: list[RungText]) -> None:
        """Note where the jumps and jump ends of all rungs stand; called before the first rung is lowered."""
        for text in texts:
            for line in text.lines:
                if line.row.does in (".jump", ".jump_end"):
                    table = self._jump_ends if line.row.does == ".jump_end" else self._jump_starts
                    number = _number(line.step.operands[0]) if line.step.operands else WITHOUT_NUMBER
                    table.setdefault(number, []).append(line.step.start)

    # --- putting rungs together ---

    def add_rung(self, rung: Rung) -> None:
        """Put a lowered rung into the innermost loop, and open or close the loop or subroutine that the rung begins or ends."""
        if self._closing == "FOR":
            self._close_loop()
        self.open[-1].statements.append(rung)
        if self._closing == "JMP":
            self._close_jump_back()
        elif self._closing == "RET":
            self._close_subroutine()
        if self._opening is not None:
            self._opening.rung = rung
            self.open.append(self._opening)
        self._closing, self._opening = "", None

    def finish(self) -> Block:
        """The body of the LADDER: all rungs.  Reports loops, numbered interlocks and calls without their counterparts."""
        report = self.context.report
        for number, lock in self.context.interlocks.items():
            if number != "IL":
                report("S0110", lock.start, lock.end, f"there is no MILC {number}",
                                  "an interlock with a number ends with the MILC of its number")
        for span in self.open[1:]:
            assert span.rung is not None
            message, hint = _OPEN.get(span.what[:3], ("the jump back to this JME leads into a loop", "jumps stay inside"))
            report("S0110", span.rung.start, span.rung.end, message, hint)
        for number, (start, end) in self._called.items():
            if number not in self._defined:
                report("S0110", start, end, f"there is no SBN {number}",
                                  "a subroutine stands between SBN and RET, before END")
        return tuple(self.open[0].statements)

    # --- subroutines ---

    def call_subroutine(self) -> None:
        """SBS: executes the subroutine when the condition is ON."""
        context = self.context
        context.emit(context.when(context.variation(context.power()), self._call()))

    def macro(self) -> None:
        """MCRO: as SBS, with four words copied to A600..A603 before the call and four copied from A604..A607 after the call.
        Nothing of that is done where fewer than four words lie at an operand."""
        context = self.context
        source, target = context.operand(1), context.operand(2)
        fits = context.function("CX_MCRO_In", source, target)
        whole = context.when(fits, self._call(), context.call_of("CX_MCRO_Out", context.operand(2)))
        context.emit(context.when(context.variation(context.power()), *context.if_reachable(whole)))

    def _call(self) -> Statement:
        context = self.context
        number = self._number(context.line.step.operands[0], "subroutine")
        if any(span.what == f"SBN{number}" for span in self.open):
            raise StepRefused(f"subroutine {number} calls itself", "FOR and NEXT repeat rungs")
        self._called.setdefault(number, (context.start, context.end))
        return context.call_of(f"$SBN{number}")

    def subroutine(self) -> None:
        """SBN: the rungs up to RET are executed by SBS and MCRO only."""
        number = self._number(self.context.line.step.operands[0], "subroutine")
        if self.is_inside:
            raise StepRefused("SBN stands inside of a loop, a jump, an interlock or another subroutine",
                              "subroutines stand by themselves, before END")
        if number in self._defined:
            raise StepRefused(f"there is another SBN {number}", "")
        self._defined.add(number)
        self._opening = Span(f"SBN{number}")

    def end_subroutine(self) -> None:
        """RET ends a subroutine."""
        if not self.open[-1].what.startswith("SBN"):
            raise StepRefused("RET without SBN", "")
        self._closing = "RET"

    def _close_subroutine(self) -> None:
        context, span = self.context, self.open.pop()
        name = tree.Name(context.start, context.end, f"${span.what}")
        self.subroutines.append(Action(context.start, context.end, None, name, tuple(span.statements)))

    # --- the end ---

    def end(self) -> None:
        """END: the rungs that follow are not executed."""
        self.context.out.append(Return(self.context.start, self.context.end))

    def task_on(self) -> None:
        """TKON: a cyclic task is executed from now on."""
        self._switch_task("CX_TKON")

    def task_off(self) -> None:
        """TKOF: a cyclic task is executed no longer; the rungs that follow are not executed if it is the own one."""
        self._switch_task("CX_TKOF")

    def _switch_task(self, function: str) -> None:
        """Calls a function with the number of a task, and leaves the program if it says so."""
        context = self.context
        number = context.number(whole_number(self._number(context.line.step.operands[0], "cyclic task", TASKS)))
        leaves = context.function(function, number)
        done = context.if_reachable(context.when(leaves, Return(context.start, context.end)))
        context.emit(context.when(context.variation(context.power()), *done))

    # --- interlocks ---

    def interlock(self) -> None:
        """IL: outputs up to ILC are inhibited unless the condition is ON."""
        context = self.context
        off = context.negated(context.power())
        on = context.assign(context.temporary(INTERLOCK), context.truth(True))
        context.emit(context.assign(context.temporary(INTERLOCK), off), inhibited=(on,))
        context.interlocks["IL"] = Interlock(INTERLOCK, context.start, context.end)

    def interlock_clear(self) -> None:
        """ILC ends all interlocks of IL."""
        context = self.context
        context.interlocks.pop("IL", None)
        context.out.append(context.assign(context.temporary(INTERLOCK), context.truth(False)))

    def interlock_number(self) -> None:
        """MILH and MILR: outputs up to the MILC of the same number are inhibited unless the condition is ON.  The second
        operand is a bit that shows the condition.  Numbered interlocks may be nested."""
        context = self.context
        number = self._number(context.line.step.operands[0], "interlock", INTERLOCKS)
        if number in context.interlocks:
            raise StepRefused(f"there is an interlock {number} already", f"MILC {number} ends it")
        power, inhibits = context.power(), f"$MIL{number}"
        shown, hidden = context.operand(1), context.operand(1)
        context.emit(*context.if_reachable(context.assign(shown, power)),
                   context.assign(context.temporary(inhibits), context.negated(context.temporary(power.text))),
                   inhibited=(*context.if_reachable(context.assign(hidden, context.truth(False))),
                              context.assign(context.temporary(inhibits), context.truth(True))))
        context.interlocks[number] = Interlock(inhibits, context.start, context.end, context.line.step.mnemonic == "MILR")

    def interlock_end(self) -> None:
        """MILC ends the interlock of its number."""
        number = self._number(self.context.line.step.operands[0], "interlock", INTERLOCKS)
        if self.context.interlocks.pop(number, None) is None:
            raise StepRefused(f"MILC {number} without MILH or MILR", "it ends the interlock of its number")

    # --- jumps ---

    def jump(self) -> None:
        """JMP and JMP0 (they jump when OFF), CJP (when ON), CJPN (when OFF)."""
        context = self.context
        number = self._jump_number()
        power = context.power()
        leaves = power if context.line.step.mnemonic == "CJP" else context.negated(power)
        if any(at > context.start for at in self._jump_ends.get(number, ())):
            self._jump_over(number, leaves)
        elif number in self._jump_ends:
            self._jump_back(number, leaves)
        else:
            raise StepRefused(f"there is no JME {number}", "a jump leads to the JME of its number")

    def _jump_over(self, number: str, leaves: Expr) -> None:
        context = self.context
        passing = context.temporary(f"$JMP{number}")
        context.emit(context.assign(passing, leaves), inhibited=(context.assign(passing, context.truth(True)),))
        context.jumps[number] = passing
        self._enclosing[number] = self._enclosing_here()

    def _enclosing_here(self) -> tuple[str, ...]:
        """The loops and interlocks that the step at work stands in."""
        return (*(f"{span.what} {span.rung.start if span.rung else ''}" for span in self.open), *self.context.interlocks)

    def _jump_back(self, number: str, leaves: Expr) -> None:
        context, span = self.context, self.open[-1]
        if span.what != f"JME{number}" or span.again is None:
            raise StepRefused(f"the jump back to JME {number} leads into or out of a loop", "")
        again = context.temporary(f"$JME{number}")
        context.emit(context.when(leaves, context.assign(again, context.truth(True)), Continue(context.start, context.end)))
        if context.start == max(self._jump_starts[number]):
            self._closing = "JMP"

    def jump_end(self) -> None:
        """JME and JME0: where a jump over rungs ends, or where a loop begins that a jump back closes."""
        context = self.context
        number = self._jump_number()
        passing = context.jumps.pop(number, None)
        if passing is not None:
            if self._enclosing_here() != self._enclosing[number]:
                raise StepRefused(f"a loop or an interlock begins or ends between JMP {number} and JME {number}",
                                  "it stands inside of a jump, or around it")
            context.out.append(context.assign(context.temporary(f"$JMP{number}"), context.truth(False)))
        elif self._is_jumped_back_to(number):
            again = context.temporary(f"$JME{number}")
            self._opening = Span(f"JME{number}", again=again)

    def _is_jumped_back_to(self, number: str) -> bool:
        """Whether a jump below the JME at work leads back to it: one that no other JME of the number follows."""
        here = self.context.start
        later = [at for at in self._jump_ends[number] if at > here]
        return any(at > here and not any(landing > at for landing in later) for at in self._jump_starts.get(number, ()))

    def _jump_number(self) -> str:
        operands = self.context.line.step.operands
        return self._number(operands[0], "jump") if operands else WITHOUT_NUMBER

    def _number(self, operand: str, what: str, numbers: int = NUMBERS) -> str:
        number = _number(operand)
        if not number.isdecimal() or whole_number(number) >= numbers:
            raise StepRefused(f"{operand} is no number of {'an' if what[0] in 'aeiou' else 'a'} {what}",
                              f"numbers are 0 to {numbers - 1}")
        return number

    def begin_repeat(self, again: str) -> None:
        """LOOP: repeats the rungs behind the one at work, up to the one of `end_repeat`; `again` names the variable that says
        whether."""
        self._opening = Span("LOOP", again=self.context.temporary(again))

    def end_repeat(self) -> NameRef:
        """The variable to be set behind the last rung that is repeated; the rung at work is that rung."""
        again = self.open[-1].again
        assert again is not None
        self._closing = "JMP"
        return self.context.temporary(again.text)

    def _close_jump_back(self) -> None:
        context, span = self.context, self.open.pop()
        assert span.again is not None
        first = context.assign(span.again, context.truth(False))
        self.open[-1].statements.append(Repeat(context.start, context.end, (first, *span.statements),
                                                 context.negated(context.temporary(span.again.text))))

    # --- FOR and NEXT ---

    def begin_loop(self) -> None:
        """FOR: the rungs up to NEXT are executed as often as the operand says."""
        context = self.context
        if sum(span.what == "FOR" for span in self.open) >= DEEPEST_LOOPS:
            raise StepRefused(f"loops stand in each other more than {DEEPEST_LOOPS} deep", "")
        count = tree.Call(context.start, context.end, NameRef(context.start, context.end, "TO_UINT"),
                          (tree.Argument(context.start, context.end, "", None, context.operand(0)),))
        kept = context.temporary(context.name("times"), "UINT")
        found = context.if_reachable(context.assign(kept, count))
        context.out += [context.assign(context.temporary(kept.text), context.number(0)), *context.guarded(found, found)]
        self._opening = Span("FOR", count=context.temporary(kept.text), counter=context.temporary(context.name("count"), "UDINT"),
                              enclosing=(*context.interlocks, *context.jumps))

    def end_loop(self) -> None:
        """NEXT: the end of the innermost FOR."""
        if self.open[-1].what != "FOR":
            raise StepRefused("NEXT without FOR", "")
        self._closing = "FOR"
        if self.open[-1].enclosing != (*self.context.interlocks, *self.context.jumps):
            raise StepRefused("a jump or an interlock begins or ends between FOR and NEXT", "it stands inside, or around them")

    def break_loop(self) -> None:
        """BREAK: leaves the innermost FOR when the condition is ON."""
        context = self.context
        if self.open[-1].what != "FOR":
            raise StepRefused("BREAK stands outside FOR and NEXT", "")
        context.emit(context.when(context.power(), Exit(context.start, context.end)))

    def _close_loop(self) -> None:
        context, span = self.context, self.open.pop()
        assert span.counter is not None and span.count is not None
        one = tree.Literal(context.start, context.end, "int", 1, None, "1")
        self.open[-1].statements.append(
            For(context.start, context.end, span.counter, one, span.count, None, tuple(span.statements)))


_OPEN = {"FOR": ("FOR without NEXT", "FOR and NEXT stand in pairs"),
         "LOO": ("LOOP without LEND", "LOOP and LEND stand in pairs"),
         "SBN": ("SBN without RET", "RET ends a subroutine")}
"""By the beginning of `Span.what`, message and hint for a span without its end."""


def _number(operand: str) -> str:
    """The number of a jump as text without sign and leading zeros."""
    digits = operand.lstrip("#&")
    return str(whole_number(digits)) if digits.isdecimal() else operand
