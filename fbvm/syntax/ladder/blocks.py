"""What a step does that a function or a block of a library does for it: instructions, timers, counters, FB calls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.syntax.ladder.drawing.diagram import WIRE
from fbvm.syntax.ladder.instructions.instruction_set import Instruction
from fbvm.syntax.ladder.mnemonics import RungText
from fbvm.syntax.ladder.operands import Wrong
from fbvm.syntax.tree import (
    Argument,
    Assign,
    Call,
    CallStatement,
    Direct,
    Expr,
    Member,
    Name,
    NamedType,
    NameRef,
    Statement,
    VarDecl,
)

if TYPE_CHECKING:
    from fbvm.syntax.ladder.lowering import Rungs

TIMERS = 4096
"""Numbers of timers, and of counters."""
REFRESHED = 2048
"""Timers below this number count on while a jump passes over them (etn21 9.4, from memory of the family)."""
FAILURES = 512
"""Numbers of failures."""


class LadderBlocks:
    """Writes calls for the step at work."""

    def __init__(self, rungs: Rungs) -> None:
        self.rungs = rungs
        self._timers: dict[int, Instruction] = {}
        """Timers of this LADDER by their numbers."""

    def look(self, texts: list[RungText]) -> None:
        """Find out which timers there are."""
        for line in (line for text in texts for line in text.lines):
            if line.row.operands[:1] == "t" and line.row.kind and line.step.operands:
                number = self._timer(line.step.operands[0])
                if number is not None:
                    self._timers.setdefault(number, line.row)

    def execute(self, row: Instruction) -> None:
        """A step that the table gives to a function or block."""
        if row.kind:
            self._instance(row)
            return
        rungs = self.rungs
        call = rungs.call()
        done = rungs.reaching(CallStatement(call.start, call.end, call))
        rungs.emit(rungs.when(rungs.variation(rungs.power()), *done))

    # --- blocks that have a state -----------------------------------------------------------------------------------

    def _instance(self, row: Instruction) -> None:
        """A block that is called in every cycle with its conditions: of a timer or counter by its number, else of the
        step.  In an interlock a block of kind FB has its conditions OFF, one of kind FB- stands still."""
        rungs = self.rungs
        first = row.operands[:1]
        numbered = first in ("t", "c")
        operands = self._numbered(first) if numbered else [rungs.operand(0)]
        operands += [rungs.operand(position) for position in range(1, len(row.operands))]
        name = self._named(row, self._number(first)) if numbered else rungs.name("block")
        conditions = rungs.inputs(row.inputs)
        instance = rungs.variable(name, row.does)
        off = (rungs.truth(False),) * row.inputs
        inhibited = rungs.reaching(self._called(instance, [*off, *operands])) if row.kind == "FB" else ()
        passed: tuple[Statement, ...] = ()
        if first == "t" and row.kind == "FB" and self._number(first) < REFRESHED:
            passed = (self._gone_on(instance, operands[:2]),)
        rungs.emit(*rungs.reaching(self._called(instance, [*conditions, *operands])), inhibited=inhibited, passed=passed)

    def _gone_on(self, instance: Expr, flag_and_value: list[Expr], **pins: bool) -> CallStatement:
        """A call of a timer with these conditions, everything else as it was."""
        rungs = self.rungs
        start, end = rungs.start, rungs.end
        arguments = [_named(start, end, pin, ":=", rungs.truth(value)) for pin, value in pins.items()]
        arguments += [_named(start, end, pin, ":=", value)
                      for pin, value in zip(("Flag", "PV"), flag_and_value, strict=True)]
        return CallStatement(start, end, Call(start, end, instance, tuple(arguments)))

    def _named(self, row: Instruction, number: int) -> str:
        """The instance of a timer or counter: what defines a number twice has two."""
        return f"${row.mnemonic}{number}"

    def _called(self, instance: Expr, arguments: list[Expr]) -> CallStatement:
        rungs = self.rungs
        call = Call(rungs.start, rungs.end, instance, tuple(Argument(a.start, a.end, "", None, a) for a in arguments))
        return CallStatement(rungs.start, rungs.end, call)

    def _number(self, letter: str) -> int:
        text = self.rungs.line.step.operands[0]
        number = self._timer(text, letter)
        if number is None:
            what = "timer" if letter == "t" else "counter"
            raise Wrong(f"{text} is no number of a {what}",
                        f"numbers are 0 to {TIMERS - 1}; a symbol is declared AT {letter.upper()}0005 before the rungs")
        return number

    def _timer(self, text: str, letter: str = "t") -> int | None:
        """The number of a timer or counter as it is written, or of its symbol; None if there is none."""
        text = self.rungs.operands.numbered.get(text.upper(), text)
        digits = text[1:] if text[:1].upper() == letter.upper() else text
        return int(digits) if digits.isdigit() and int(digits) < TIMERS else None

    def _numbered(self, letter: str) -> list[Expr]:
        """Completion flag and present value of the timer or counter."""
        start, end = self.rungs.line.places[0]
        flag, value = ("TF", "T") if letter == "t" else ("CNF", "C")
        number = self._number(letter)
        return [Direct(start, end, f"%{flag}{number}"), Direct(start, end, f"%{value}{number}")]

    def reset_timer(self) -> None:
        """TRSET: the timer begins again, as if its condition had been OFF for a moment."""
        rungs, number = self.rungs, self._number("t")
        row = self._timers.get(number)
        if row is None:
            raise Wrong(f"there is no timer {number} in these rungs", "TRSET stands in the rungs of its timer")
        instance = rungs.variable(self._named(row, number), row.does)
        pins = {"In": False, "Reset": True} if row.inputs == 2 else {"In": False}
        rungs.emit(rungs.when(rungs.variation(rungs.power()), self._gone_on(instance, self._numbered("t"), **pins)))

    def reset_numbers(self) -> None:
        """CNR and CNRX: timers or counters from one number to another are OFF, with the highest present value."""
        rungs = self.rungs
        texts = [rungs.operands.numbered.get(text.upper(), text).upper() for text in rungs.line.step.operands]
        kinds, digits = {text[0] for text in texts}, [text[1:] for text in texts]
        if len(kinds) > 1 or not kinds <= {"T", "C"} or not all(each.isdigit() and int(each) < TIMERS for each in digits):
            raise Wrong(f"{' and '.join(rungs.line.step.operands)} are no timers and no counters",
                        f"write T0000 T0009 or C0000 C0009, up to {TIMERS - 1}")
        highest = 0x9999 if rungs.line.step.mnemonic == "CNR" else 0xFFFF
        values = [rungs.truth(kinds == {"C"}), *(rungs.number(int(each)) for each in digits), rungs.number(highest)]
        rungs.emit(rungs.when(rungs.variation(rungs.power()), rungs.called("CX_CNR", *values)))

    # --- addresses and failures -------------------------------------------------------------------------------------

    def address(self) -> None:
        """MOVR and MOVRW: where a bit, a word or a present value lies, for an index register."""
        rungs = self.rungs
        place, register = rungs.operand(0), rungs.line.step.operands[1]
        rungs.operand(1)
        at = Call(rungs.start, rungs.end, NameRef(rungs.start, rungs.end, "__PLC_ADDRESS"),
                  (Argument(place.start, place.end, "", None, place),))
        rungs.emit(rungs.when(rungs.variation(rungs.power()), rungs.called("CX_Point", rungs.number(int(register[2:])), at)))

    def failure(self, function: str) -> None:
        """FAL and FALS: the number of a failure, and a constant or the words of a message."""
        rungs, (number, message) = self.rungs, self.rungs.line.step.operands
        digits = number.lstrip("#&")
        least = 0 if function == "CX_FAL" else 1
        if not digits.isdigit() or not least <= int(digits) < FAILURES:
            raise Wrong(f"{number} is no number of a failure", f"numbers are {least} to {FAILURES - 1}")
        code, done = rungs.number(int(digits)), []
        if message[0] in "#&":
            done.append(rungs.called(function, code, rungs.operand(1)))
        else:
            words = rungs.operands.expression(message, "a", *rungs.line.places[1], rungs.line.row.role(1))
            done += [rungs.called("CX_MSG", rungs.number(8), words), rungs.called(function, code, rungs.number(0))]
        if function == "CX_FALS":
            done.append(rungs.called("__STOP"))
        rungs.emit(rungs.when(rungs.variation(rungs.power()), *rungs.reaching(*done)))

    # --- function blocks of the user --------------------------------------------------------------------------------

    def call(self) -> None:
        """FBCALL Type instance PIN:=operand PIN=>operand: the condition is EN, and ENO is the condition behind it; an input
        `:=*` takes the condition in place of EN, an output `=>*` gives the one behind in place of ENO.

        No text form of Omron's own was found; this one is ours."""
        rungs, line = self.rungs, self.rungs.line
        if len(line.step.operands) < 2 or any("=" in text for text in line.step.operands[:2]):
            raise Wrong("FBCALL names the type of a function block and its instance",
                        "write FBCALL TON Delay IN:=Start PT:=T#5s")
        (start, end), (at, until) = line.places[:2]
        block, instance = line.step.operands[:2]
        eno = rungs.temporary(rungs.name("ENO"))
        wired = {text[:-3]: text[-3:] for text in line.step.operands[2:] if text[-3:] in (f":={WIRE}", f"=>{WIRE}")}
        entry = next((name for name, sign in wired.items() if sign[0] == ":"), "EN")
        leaving = next((name for name, sign in wired.items() if sign[0] == "="), "")
        arguments = [_named(start, end, entry, ":=", rungs.power())]
        arguments += [self._pin(position) for position, text in enumerate(line.step.operands) if position > 1
                      and text[:-3] not in wired]
        if not leaving:
            arguments.append(_named(start, end, "ENO", "=>", eno))
        call = Call(start, rungs.end, NameRef(at, until, instance), tuple(arguments))
        behind = Member(at, until, NameRef(at, until, instance), Name(at, until, leaving)) if leaving else eno
        seen = Assign(start, start, (eno,), ":=", rungs.contact(behind))  # of no length: for those who see power
        rungs.emit(rungs.assign(eno, rungs.truth(False)), CallStatement(rungs.start, rungs.end, call), seen)
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


def _named(start: int, end: int, name: str, sign: str, value: Expr) -> Argument:
    return Argument(start, end, sign, Name(start, start + len(name), name), value)
