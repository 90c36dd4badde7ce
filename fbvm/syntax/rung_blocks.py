"""What a step does that a function or a block of a library does for it: instructions, timers, counters, FB calls."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from fbvm.syntax.instruction_set import Instruction
from fbvm.syntax.operands import Wrong
from fbvm.syntax.tree import Argument, Call, CallStatement, Direct, Expr, Name, NamedType, NameRef, VarDecl, VarSection

if TYPE_CHECKING:
    from fbvm.syntax.rungs import Rungs

TIMERS = 4096
"""Numbers of timers, and of counters."""


class LadderBlocks:
    """Writes calls for the step at work."""

    def __init__(self, rungs: Rungs) -> None:
        self.rungs = rungs

    def execute(self, row: Instruction) -> None:
        """A step that the table gives to a function or block."""
        if row.kind:
            self._instance(row)
            return
        rungs = self.rungs
        call = rungs.call()
        rungs.emit(rungs.when(rungs.variation(rungs.power()), CallStatement(call.start, call.end, call)))

    # --- blocks that have a state -----------------------------------------------------------------------------------

    def _instance(self, row: Instruction) -> None:
        """A block that is called in every cycle with its conditions: of a timer or counter by its number, else of the
        step.  In an interlock a block of kind FB has its conditions OFF, one of kind FB- stands still."""
        rungs = self.rungs
        first = row.operands[:1]
        numbered = first in ("t", "c")
        operands = self._numbered(first) if numbered else [rungs.operand(0)]
        operands += [rungs.operand(position) for position in range(1, len(row.operands))]
        name = f"${first.upper()}{self._number(first)}" if numbered else rungs.name("block")
        conditions = rungs.inputs(row.inputs)
        instance = rungs.variable(name, row.does)
        off = (rungs.truth(False),) * row.inputs
        inhibited = (self._called(instance, [*off, *operands]),) if row.kind == "FB" else ()
        rungs.emit(self._called(instance, [*conditions, *operands]), inhibited=inhibited)

    def _called(self, instance: Expr, arguments: list[Expr]) -> CallStatement:
        rungs = self.rungs
        call = Call(rungs.start, rungs.end, instance, tuple(Argument(a.start, a.end, "", None, a) for a in arguments))
        return CallStatement(rungs.start, rungs.end, call)

    def _number(self, letter: str) -> int:
        text = self.rungs.line.step.operands[0]
        digits = text[1:] if text[:1].upper() == letter.upper() else text
        if not digits.isdigit() or int(digits) >= TIMERS:
            what = "timer" if letter == "t" else "counter"
            raise Wrong(f"{text} is no number of a {what}", f"numbers are 0 to {TIMERS - 1}")
        return int(digits)

    def _numbered(self, letter: str) -> list[Expr]:
        """Completion flag and present value of the timer or counter."""
        start, end = self.rungs.line.places[0]
        flag, value = ("TF", "T") if letter == "t" else ("CNF", "C")
        number = self._number(letter)
        return [Direct(start, end, f"%{flag}{number}"), Direct(start, end, f"%{value}{number}")]

    # --- function blocks of the user --------------------------------------------------------------------------------

    def call(self) -> None:
        """FBCALL Type instance PIN:=operand PIN=>operand: the condition is EN, and ENO is the condition behind it.

        No text form of Omron's own was found; this one is ours."""
        rungs, line = self.rungs, self.rungs.line
        if len(line.step.operands) < 2 or any("=" in text for text in line.step.operands[:2]):
            raise Wrong("FBCALL names the type of a function block and its instance",
                        "write FBCALL TON Delay IN:=Start PT:=T#5s")
        (start, end), (at, until) = line.places[:2]
        block, instance = line.step.operands[:2]
        eno = rungs.temporary(rungs.name("ENO"))
        arguments = [_named(start, end, "EN", ":=", rungs.power())]
        arguments += [self._pin(position) for position in range(2, len(line.step.operands))]
        arguments.append(_named(start, end, "ENO", "=>", eno))
        call = Call(start, rungs.end, NameRef(at, until, instance), tuple(arguments))
        rungs.emit(rungs.assign(eno, rungs.truth(False)), CallStatement(rungs.start, rungs.end, call))
        rungs.instances.append(VarDecl(at, until, (Name(at, until, instance),), None, NamedType(start, end, block), None))
        rungs.condition = rungs.temporary(rungs.name("ENO"))

    def _pin(self, position: int) -> Argument:
        text, (start, end) = self.rungs.line.step.operands[position], self.rungs.line.places[position]
        sign = ":=" if ":=" in text else "=>"
        name, found, value = text.partition(sign)
        if not found or not value:
            raise Wrong(f"{text} is no pin", "write PIN:=operand for an input or PIN=>operand for an output")
        at = start + len(name) + 2
        return _named(start, end, name, sign, self.rungs.value(value, at, end))


def undeclared(instances: Iterable[VarDecl], sections: Iterable[VarSection],
               report: Callable[..., None]) -> list[VarDecl]:
    """Those instances that no section declares; one that is declared with another type has a diagnostic."""
    known = {name.text.upper(): variable for section in sections for variable in section.variables for name in variable.names}
    made: list[VarDecl] = []
    for instance in instances:
        name, spec = instance.names[0], instance.spec
        other = known.setdefault(name.text.upper(), instance)
        if other is instance:
            made.append(instance)
        elif isinstance(other.spec, NamedType) and isinstance(spec, NamedType) and other.spec.text.upper() != spec.text.upper():
            report("S0110", spec.start, name.end, f"{name.text} is an instance of {other.spec.text}, not of {spec.text}", "")
    return made


def _named(start: int, end: int, name: str, sign: str, value: Expr) -> Argument:
    return Argument(start, end, sign, Name(start, start + len(name), name), value)
