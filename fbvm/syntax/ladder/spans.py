"""What covers several rungs: jumps, interlocks and loops (C200HS p107, CPM1 p175; omissions of the manuals assumed).

A jump over rungs is a variable that is ON while they are passed over; a jump back and FOR are loops around them; an
interlock is a variable that says to each output whether it is inhibited.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fbvm.syntax import tree
from fbvm.syntax.ladder.mnemonics import RungText
from fbvm.syntax.tree import Action, Block, Continue, Exit, Expr, For, If, NameRef, Repeat, Return, Statement
from fbvm.syntax.tree.ladder import Rung

if TYPE_CHECKING:
    from fbvm.syntax.ladder.lowering import Rungs

INTERLOCK = "$IL"
INTERLOCKS = 16
"""Numbers of MILH and MILR."""
NUMBERS = 1024
"""Of jumps, and of subroutines."""
DEEPEST_LOOPS = 15
WITHOUT_NUMBER = "0 without number"
"""The number of JMP0 and JME0."""


class StepRefused(Exception):
    """A step cannot be executed; the arguments are a message and a hint."""


@dataclass
class Frame:
    """A loop that is open: what began it, and what stands in it so far."""

    what: str
    rung: Rung | None = None
    statements: list[Statement] = field(default_factory=list)
    count: Expr | None = None
    counter: NameRef | None = None
    again: NameRef | None = None
    around: tuple[str, ...] = ()
    """What it stands in."""


@dataclass
class Interlock:
    """An interlock that is open: the variable that is ON while it inhibits; whether edges in the meantime are forgotten."""

    inhibits: str
    start: int
    end: int
    forgets: bool = False


class Spans:
    """Keeps what covers the rung at work, and puts rungs where they belong."""

    def __init__(self, rungs: Rungs) -> None:
        self.rungs = rungs
        self.frames = [Frame("")]
        self.interlocks: dict[str, Interlock] = {}
        """Those that may inhibit the rung at work, by number; IL has none."""
        self.jumps: dict[str, NameRef] = {}
        """Jumps that may be passing over the rung at work, by number."""
        self._around: dict[str, tuple[str, ...]] = {}
        """What each of them stands in."""
        self._landings: dict[str, list[int]] = {}
        self._takeoffs: dict[str, list[int]] = {}
        self._visited: dict[str, tuple[int, int]] = {}
        self._begun: set[str] = set()
        self.subroutines: list[Action] = []
        self._opening: Frame | None = None
        self._closing: str = ""

    @property
    def forgetful(self) -> bool:
        """Whether an interlock is open that forgets edges."""
        return any(lock.forgets for lock in self.interlocks.values())

    def look(self, texts: list[RungText]) -> None:
        """Find out where jumps lead."""
        for text in texts:
            for line in text.lines:
                if line.row.does in (".jump", ".jump_end"):
                    table = self._landings if line.row.does == ".jump_end" else self._takeoffs
                    number = _number(line.step.operands[0]) if line.step.operands else WITHOUT_NUMBER
                    table.setdefault(number, []).append(line.step.start)

    # --- putting rungs together -------------------------------------------------------------------------------------

    def guarded(self, statements: Block, inhibited: Block, passed: Block = (), always: bool = False) -> list[Statement]:
        """Statements as they stand under the jumps and the interlocks of this place."""
        rungs, whole = self.rungs, list(statements)
        locks = [lock for lock in self.interlocks.values() if not (always and lock.forgets)]
        if locks:
            here = self._any([rungs.temporary(lock.inhibits) for lock in locks])
            whole = [self._guard(here, inhibited, statements) if inhibited else
                     self._guard(rungs.negated(here), statements)]
        if self.jumps:
            passing = rungs.negated(self._any([rungs.temporary(jump.text) for jump in self.jumps.values()]))
            whole = [self._guard(passing, tuple(whole), passed or None)]
        return whole

    def _any(self, conditions: Sequence[Expr]) -> Expr:
        first, *more = conditions
        for one in more:
            first = self.rungs.binary("OR", first, one)
        return first

    def _guard(self, condition: Expr, statements: Block, otherwise: Block | None = None) -> Statement:
        """A condition that nobody has written: of no length, so that it is not seen as a statement of its own."""
        return If(self.rungs.start, self.rungs.start, ((condition, statements),), otherwise)

    def place(self, rung: Rung) -> None:
        """Put a rung where it belongs, and open or close the loops that it begins or ends."""
        if self._closing == "FOR":
            self._close_loop()
        self.frames[-1].statements.append(rung)
        if self._closing == "JMP":
            self._close_again()
        elif self._closing == "RET":
            self._close_subroutine()
        if self._opening is not None:
            self._opening.rung = rung
            self.frames.append(self._opening)
        self._closing, self._opening = "", None

    def close(self, end: int) -> Block:
        """All rungs; loops and interlocks with a number that are still open have a diagnostic."""
        self.rungs.steps.close()
        for number, lock in self.interlocks.items():
            if number != "IL":
                self.rungs.report("S0110", lock.start, lock.end, f"there is no MILC {number}",
                                  "an interlock with a number ends with the MILC of its number")
        for frame in self.frames[1:]:
            assert frame.rung is not None
            message, hint = _OPEN.get(frame.what[:3], ("the jump back to this JME leads into a loop", "jumps stay inside"))
            self.rungs.report("S0110", frame.rung.start, frame.rung.end, message, hint)
        for number, (start, end) in self._visited.items():
            if number not in self._begun:
                self.rungs.report("S0110", start, end, f"there is no SBN {number}",
                                  "a subroutine stands between SBN and RET, before END")
        return tuple(self.frames[0].statements)

    # --- subroutines ------------------------------------------------------------------------------------------------

    def visit(self) -> None:
        """SBS: the subroutine is executed when the condition is ON."""
        self.rungs.emit(self.rungs.when(self.rungs.variation(self.rungs.power()), self._visit()))

    def visit_with_words(self) -> None:
        """MCRO: likewise, with four words into A600 to A603 before and four out of A604 to A607 behind."""
        rungs = self.rungs
        whole = (rungs.called("CX_MCRO_In", rungs.operand(1)), self._visit(), rungs.called("CX_MCRO_Out", rungs.operand(2)))
        rungs.emit(rungs.when(rungs.variation(rungs.power()), *rungs.reaching(*whole)))

    def _visit(self) -> Statement:
        rungs = self.rungs
        number = self._number(rungs.line.step.operands[0], "subroutine")
        if any(frame.what == f"SBN{number}" for frame in self.frames):
            raise StepRefused(f"subroutine {number} calls itself", "FOR and NEXT repeat rungs")
        self._visited.setdefault(number, (rungs.start, rungs.end))
        return rungs.called(f"$SBN{number}")

    def subroutine(self) -> None:
        """SBN: what follows, up to RET, is executed by SBS only."""
        number = self._number(self.rungs.line.step.operands[0], "subroutine")
        if len(self.frames) > 1 or self.jumps or self.interlocks:
            raise StepRefused("SBN stands inside of a loop, a jump, an interlock or another subroutine",
                              "subroutines stand by themselves, before END")
        if number in self._begun:
            raise StepRefused(f"there is another SBN {number}", "")
        self._begun.add(number)
        self._opening = Frame(f"SBN{number}")

    def go_back(self) -> None:
        """RET ends a subroutine."""
        if not self.frames[-1].what.startswith("SBN"):
            raise StepRefused("RET without SBN", "")
        self._closing = "RET"

    def _close_subroutine(self) -> None:
        frame, rungs = self.frames.pop(), self.rungs
        name = tree.Name(rungs.start, rungs.end, f"${frame.what}")
        self.subroutines.append(Action(rungs.start, rungs.end, None, name, tuple(frame.statements)))

    # --- the end ----------------------------------------------------------------------------------------------------

    def end(self) -> None:
        """END: what follows is not executed."""
        self.rungs.steps.close()
        self.rungs.out.append(Return(self.rungs.start, self.rungs.end))

    # --- interlocks -------------------------------------------------------------------------------------------------

    def interlock(self) -> None:
        """IL: from here to ILC outputs are inhibited unless the condition is ON."""
        rungs = self.rungs
        off = rungs.negated(rungs.power())
        on = rungs.assign(rungs.temporary(INTERLOCK), rungs.truth(True))
        rungs.emit(rungs.assign(rungs.temporary(INTERLOCK), off), inhibited=(on,))
        self.interlocks["IL"] = Interlock(INTERLOCK, rungs.start, rungs.end)

    def clear(self) -> None:
        """ILC ends all interlocks of IL."""
        self.interlocks.pop("IL", None)
        self.rungs.out.append(self.rungs.assign(self.rungs.temporary(INTERLOCK), self.rungs.truth(False)))

    def interlock_number(self) -> None:
        """MILH and MILR: from here to the MILC of the number outputs are inhibited unless the condition is ON, which a bit
        shows.  They may stand in each other."""
        rungs = self.rungs
        number = self._number(rungs.line.step.operands[0], "interlock", INTERLOCKS)
        if number in self.interlocks:
            raise StepRefused(f"there is an interlock {number} already", f"MILC {number} ends it")
        power, inhibits = rungs.power(), f"$MIL{number}"
        shown, hidden = rungs.operand(1), rungs.operand(1)
        rungs.emit(*rungs.reaching(rungs.assign(shown, power)),
                   rungs.assign(rungs.temporary(inhibits), rungs.negated(rungs.temporary(power.text))),
                   inhibited=(*rungs.reaching(rungs.assign(hidden, rungs.truth(False))),
                              rungs.assign(rungs.temporary(inhibits), rungs.truth(True))))
        self.interlocks[number] = Interlock(inhibits, rungs.start, rungs.end, rungs.line.step.mnemonic == "MILR")

    def clear_number(self) -> None:
        """MILC ends the interlock of its number."""
        number = self._number(self.rungs.line.step.operands[0], "interlock", INTERLOCKS)
        if self.interlocks.pop(number, None) is None:
            raise StepRefused(f"MILC {number} without MILH or MILR", "it ends the interlock of its number")

    # --- jumps ------------------------------------------------------------------------------------------------------

    def jump(self) -> None:
        """JMP and JMP0 (they jump when OFF), CJP (when ON), CJPN (when OFF)."""
        rungs = self.rungs
        number = self._jump_number()
        power = rungs.power()
        leaves = power if rungs.line.step.mnemonic == "CJP" else rungs.negated(power)
        if any(at > rungs.start for at in self._landings.get(number, ())):
            self._jump_over(number, leaves)
        elif number in self._landings:
            self._jump_back(number, leaves)
        else:
            raise StepRefused(f"there is no JME {number}", "a jump leads to the JME of its number")

    def _jump_over(self, number: str, leaves: Expr) -> None:
        rungs = self.rungs
        passing = rungs.temporary(f"$JMP{number}")
        rungs.emit(rungs.assign(passing, leaves), inhibited=(rungs.assign(passing, rungs.truth(True)),))
        self.jumps[number] = passing
        self._around[number] = self._inside()

    def _inside(self) -> tuple[str, ...]:
        """The loops and interlocks of this place."""
        return (*(f"{frame.what} {frame.rung.start if frame.rung else ''}" for frame in self.frames), *self.interlocks)

    def _jump_back(self, number: str, leaves: Expr) -> None:
        rungs, frame = self.rungs, self.frames[-1]
        if frame.what != f"JME{number}" or frame.again is None:
            raise StepRefused(f"the jump back to JME {number} leads into or out of a loop", "")
        again = rungs.temporary(f"$JME{number}")
        rungs.emit(rungs.when(leaves, rungs.assign(again, rungs.truth(True)), Continue(rungs.start, rungs.end)))
        if rungs.start == max(self._takeoffs[number]):
            self._closing = "JMP"

    def land(self) -> None:
        """JME and JME0."""
        rungs = self.rungs
        number = self._jump_number()
        passing = self.jumps.pop(number, None)
        if passing is not None:
            if self._inside() != self._around[number]:
                raise StepRefused(f"a loop or an interlock begins or ends between JMP {number} and JME {number}",
                                  "it stands inside of a jump, or around it")
            rungs.out.append(rungs.assign(rungs.temporary(f"$JMP{number}"), rungs.truth(False)))
        elif self._comes_back(number):
            again = rungs.temporary(f"$JME{number}")
            self._opening = Frame(f"JME{number}", again=again)

    def _comes_back(self, number: str) -> bool:
        """Whether a jump behind this JME leads back to it."""
        here = self.rungs.start
        later = [at for at in self._landings[number] if at > here]
        return any(at > here and not any(landing > at for landing in later) for at in self._takeoffs.get(number, ()))

    def _jump_number(self) -> str:
        operands = self.rungs.line.step.operands
        return self._number(operands[0], "jump") if operands else WITHOUT_NUMBER

    def _number(self, operand: str, what: str, numbers: int = NUMBERS) -> str:
        number = _number(operand)
        if not number.isdigit() or int(number) >= numbers:
            raise StepRefused(f"{operand} is no number of {'an' if what[0] in 'aeiou' else 'a'} {what}",
                              f"numbers are 0 to {numbers - 1}")
        return number

    def _close_again(self) -> None:
        frame = self.frames.pop()
        rungs = self.rungs
        assert frame.again is not None
        first = rungs.assign(frame.again, rungs.truth(False))
        self.frames[-1].statements.append(Repeat(rungs.start, rungs.end, (first, *frame.statements),
                                                 rungs.negated(rungs.temporary(frame.again.text))))

    # --- FOR and NEXT -----------------------------------------------------------------------------------------------

    def loop(self) -> None:
        """FOR: what follows is executed so many times, up to NEXT."""
        rungs = self.rungs
        if sum(frame.what == "FOR" for frame in self.frames) >= DEEPEST_LOOPS:
            raise StepRefused(f"loops stand in each other more than {DEEPEST_LOOPS} deep", "")
        count = tree.Call(rungs.start, rungs.end, NameRef(rungs.start, rungs.end, "TO_UINT"),
                          (tree.Argument(rungs.start, rungs.end, "", None, rungs.operand(0)),))
        kept = rungs.temporary(rungs.name("times"), "UINT")
        found = rungs.reaching(rungs.assign(kept, count))
        rungs.out += [rungs.assign(rungs.temporary(kept.text), rungs.number(0)), *self.guarded(found, found)]
        self._opening = Frame("FOR", count=rungs.temporary(kept.text), counter=rungs.temporary(rungs.name("count"), "UDINT"),
                              around=(*self.interlocks, *self.jumps))

    def next(self) -> None:
        """NEXT."""
        if self.frames[-1].what != "FOR":
            raise StepRefused("NEXT without FOR", "")
        self._closing = "FOR"
        if self.frames[-1].around != (*self.interlocks, *self.jumps):
            raise StepRefused("a jump or an interlock begins or ends between FOR and NEXT", "it stands inside, or around them")

    def leave(self) -> None:
        """BREAK: with the condition ON the innermost loop is left."""
        rungs = self.rungs
        if self.frames[-1].what != "FOR":
            raise StepRefused("BREAK stands outside FOR and NEXT", "")
        rungs.emit(rungs.when(rungs.power(), Exit(rungs.start, rungs.end)))

    def _close_loop(self) -> None:
        frame, rungs = self.frames.pop(), self.rungs
        assert frame.counter is not None and frame.count is not None
        one = tree.Literal(rungs.start, rungs.end, "int", 1, None, "1")
        self.frames[-1].statements.append(
            For(rungs.start, rungs.end, frame.counter, one, frame.count, None, tuple(frame.statements)))


_OPEN = {"FOR": ("FOR without NEXT", "FOR and NEXT stand in pairs"),
         "SBN": ("SBN without RET", "RET ends a subroutine")}
"""What is wrong with a frame that nothing has closed."""


def _number(operand: str) -> str:
    """The number of a jump as text without sign and leading zeros."""
    digits = operand.lstrip("#&")
    return str(int(digits)) if digits.isdigit() else operand
