"""Instructions that a function or a function block of a library executes: data instructions, timers, counters, FBCALL."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.context import RungContext
from fbvm.syntax.ladder.drawing.diagram import WIRE
from fbvm.syntax.ladder.instructions.instruction_set import Instruction
from fbvm.syntax.ladder.mnemonics import RungText
from fbvm.syntax.ladder.operands import OperandError
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

TIMERS = 4096
"""Timer numbers and counter numbers are below this."""
REFRESHED = 2048
"""Timers below this number are updated while a jump passes over them (etn21 9.4, from memory of the family)."""
FAILURES = 512
"""Numbers of FAL and FALS are below this."""


class LadderBlocks:
    """Lowers the step at work to a call of a function, or of an instance that the POU keeps."""

    def __init__(self, context: RungContext) -> None:
        self.context = context
        self.instructions: dict[str, Callable[[], None]] = {
            ".call": self.call, ".reset_numbers": self.reset_numbers, ".reset_timer": self.reset_timer,
            ".address": self.address, ".value_address": self.address,
            ".failure": lambda: self.failure("CX_FAL"), ".fatal_failure": lambda: self.failure("CX_FALS"),
        }  # fmt: skip
        self._timers: dict[int | str, Instruction] = {}
        """By number, or by the name of one that each instance has, the row of the instruction that defines a timer in the
        LADDER."""

    def find_timers(self, texts: list[RungText]) -> None:
        """Note the timers that the rungs define; called before the first rung is lowered."""
        for line in (line for text in texts for line in text.lines):
            if line.row.operands[:1] == "t" and line.row.kind and line.step.operands:
                number = self._timer(line.step.operands[0])
                if number is not None:
                    self._timers.setdefault(number, line.row)

    def execute(self, row: Instruction) -> None:
        """Lower an instruction for which the table names a function or a function block."""
        if row.kind:
            self._instance(row)
            return
        context = self.context
        call = context.call()
        done = context.if_reachable(CallStatement(call.start, call.end, call))
        context.emit(context.when(context.variation(context.power()), *done))

    # --- blocks that have a state ---

    def _instance(self, row: Instruction) -> None:
        """Call a function block in every cycle with the conditions of the step.  A timer or counter has one instance for its
        number, every other instruction one for the step.  While an interlock inhibits, a block of kind FB is called with
        its conditions OFF, a block of kind FB- is not called."""
        context = self.context
        first = row.operands[:1]
        numbered = first in ("t", "c")
        operands = self.numbered(first) if numbered else [context.operand(0)]
        operands += [context.operand(position) for position in range(1, len(row.operands))]
        name = self.instance_name(row, self.number(first)) if numbered else context.name("block")
        conditions = context.inputs(row.inputs)
        instance = context.variable(name, row.does)
        off = (context.truth(False),) * row.inputs
        inhibited = context.if_reachable(self.called(instance, [*off, *operands])) if row.kind == "FB" else ()
        passed: tuple[Statement, ...] = ()
        number = self.number(first) if numbered else 0
        if first == "t" and row.kind == "FB" and isinstance(number, int) and number < REFRESHED:
            passed = (self.update(instance, operands[:2]),)
        context.emit(*context.if_reachable(self.called(instance, [*conditions, *operands])), inhibited=inhibited, passed=passed)

    def update(self, instance: Expr, flag_and_value: list[Expr], **pins: bool) -> CallStatement:
        """A call of a timer with its flag and present value and these pins; its other inputs keep their values."""
        context = self.context
        start, end = context.start, context.end
        arguments = [_named(start, end, pin, ":=", context.truth(value)) for pin, value in pins.items()]
        arguments += [_named(start, end, pin, ":=", value)
                      for pin, value in zip(("Flag", "PV"), flag_and_value, strict=True)]
        return CallStatement(start, end, Call(start, end, instance, tuple(arguments)))

    def instance_name(self, row: Instruction, number: int | str) -> str:
        """The name of the instance of a timer or counter; two mnemonics with one number have an instance each."""
        return f"${row.mnemonic}{number}" if isinstance(number, int) else f"${row.mnemonic}:{number}"

    def called(self, instance: Expr, arguments: list[Expr]) -> CallStatement:
        """A call of an instance with its inputs in their order."""
        context = self.context
        call = Call(context.start, context.end, instance, tuple(Argument(a.start, a.end, "", None, a) for a in arguments))
        return CallStatement(context.start, context.end, call)

    def number(self, letter: str) -> int | str:
        """The number of the timer or counter in the first operand, or the name of one that each instance has."""
        text = self.context.line.step.operands[0]
        number = self._timer(text, letter)
        if number is None:
            what = "timer" if letter == "t" else "counter"
            raise OperandError(f"{text} is no number of a {what}",
                               f"numbers are 0 to {TIMERS - 1}; a symbol is declared AT {letter.upper()}0005 before the rungs")
        return number

    def _timer(self, text: str, letter: str = "t") -> int | str | None:
        """The number of a timer or counter, written as a number or as a symbol, or the name of one that each instance has;
        None if `text` is none of these."""
        own = self.context.operands.own.get(text.upper())
        if own:
            return text.upper() if own[0] == letter.upper() else None
        text = self.context.operands.numbered.get(text.upper(), text)
        digits = text[1:] if text[:1].upper() == letter.upper() else text
        return whole_number(digits) if digits.isdecimal() and whole_number(digits) < TIMERS else None

    def numbered(self, letter: str) -> list[Expr]:
        """The completion flag and the present value of the timer or counter in the first operand."""
        start, end = self.context.line.places[0]
        flag, value = ("TF", "T") if letter == "t" else ("CNF", "C")
        number = self.number(letter)
        if isinstance(number, str):
            _, value = self.context.operands.own[number]
            return [NameRef(start, end, self.context.line.step.operands[0]), NameRef(start, end, value)]
        return [Direct(start, end, f"%{flag}{number}"), Direct(start, end, f"%{value}{number}")]

    def reset_timer(self) -> None:
        """TRSET: restarts the timer, as if its condition had been OFF for one cycle."""
        context, number = self.context, self.number("t")
        row = self._timers.get(number)
        if row is None:
            raise OperandError(f"there is no timer {number} in these rungs", "TRSET stands in the rungs of its timer")
        instance = context.variable(self.instance_name(row, number), row.does)
        pins = {"In": False, "Reset": True} if row.inputs == 2 else {"In": False}
        context.emit(context.when(context.variation(context.power()), self.update(instance, self.numbered("t"), **pins)))

    def reset_numbers(self) -> None:
        """CNR and CNRX: turn the timers or counters of a range of numbers OFF and set their present values to the maximum."""
        context = self.context
        texts = [context.operands.numbered.get(text.upper(), text).upper() for text in context.line.step.operands]
        kinds, digits = {text[0] for text in texts}, [text[1:] for text in texts]
        numbers = [whole_number(each) if each.isdecimal() else TIMERS for each in digits]
        if len(kinds) > 1 or not kinds <= {"T", "C"} or max(numbers) >= TIMERS:
            raise OperandError(f"{' and '.join(context.line.step.operands)} are no timers and no counters",
                               f"write T0000 T0009 or C0000 C0009, up to {TIMERS - 1}")
        highest = 0x9999 if context.line.step.mnemonic == "CNR" else 0xFFFF
        values = [context.truth(kinds == {"C"}), *map(context.number, numbers), context.number(highest)]
        context.emit(context.when(context.variation(context.power()), context.call_of("CX_CNR", *values)))

    # --- addresses and failures ---

    def address(self) -> None:
        """MOVR and MOVRW: put the PLC memory address of a bit, a word or a present value into an index register."""
        context = self.context
        place, register = context.operand(0), context.line.step.operands[1]
        context.operand(1)
        at = Call(context.start, context.end, NameRef(context.start, context.end, "__PLC_ADDRESS"),
                  (Argument(place.start, place.end, "", None, place),))
        point = context.call_of("CX_Point", context.number(whole_number(register[2:])), at)
        context.emit(context.when(context.variation(context.power()), point))

    def failure(self, function: str) -> None:
        """FAL and FALS: report the failure of a number, with a constant or with a message of eight words."""
        context, (number, message) = self.context, self.context.line.step.operands
        digits = number.lstrip("#&")
        least = 0 if function == "CX_FAL" else 1
        if not digits.isdecimal() or not least <= whole_number(digits) < FAILURES:
            raise OperandError(f"{number} is no number of a failure", f"numbers are {least} to {FAILURES - 1}")
        code, done = context.number(whole_number(digits)), []
        if message[0] in "#&":
            done.append(context.call_of(function, code, context.operand(1)))
        else:
            words = context.operands.expression(message, "a", *context.line.places[1], context.line.row.role(1))
            done += [context.call_of("CX_MSG", context.number(8), words), context.call_of(function, code, context.number(0))]
        if function == "CX_FALS":
            done.append(context.call_of("__STOP"))
        context.emit(context.when(context.variation(context.power()), *context.if_reachable(*done)))

    # --- function blocks of the user ---

    def call(self) -> None:
        """FBCALL Type instance PIN:=operand PIN=>operand: calls a function block of the user.

        The execution condition goes to EN, or to the input that is written `PIN:=*`; the condition behind the step comes
        from ENO, or from the output that is written `PIN=>*`.  Omron has no text form for this; this one is fbvm's own."""
        context, line = self.context, self.context.line
        if len(line.step.operands) < 2 or any("=" in text for text in line.step.operands[:2]):
            raise OperandError("FBCALL names the type of a function block and its instance",
                               "write FBCALL TON Delay IN:=Start PT:=T#5s")
        (start, end), (at, until) = line.places[:2]
        block, instance = line.step.operands[:2]
        eno = context.temporary(context.name("ENO"))
        wired = {text[:-3]: text[-3:] for text in line.step.operands[2:] if text[-3:] in (f":={WIRE}", f"=>{WIRE}")}
        entry = next((name for name, sign in wired.items() if sign[0] == ":"), "EN")
        leaving = next((name for name, sign in wired.items() if sign[0] == "="), "")
        arguments = [_named(start, end, entry, ":=", context.power())]
        arguments += [self._pin(position) for position, text in enumerate(line.step.operands) if position > 1
                      and text[:-3] not in wired]
        if not leaving:
            arguments.append(_named(start, end, "ENO", "=>", eno))
        call = Call(start, context.end, NameRef(at, until, instance), tuple(arguments))
        behind = Member(at, until, NameRef(at, until, instance), Name(at, until, leaving)) if leaving else eno
        seen = Assign(start, start, (eno,), ":=", context.element(behind))  # of no length: for those who see power
        context.emit(context.assign(eno, context.truth(False)), CallStatement(context.start, context.end, call), seen)
        context.instances.append(VarDecl(at, until, (Name(at, until, instance),), None, NamedType(start, end, block), None))
        context.condition = context.temporary(context.name("ENO"))

    def _pin(self, position: int) -> Argument:
        text, (start, end) = self.context.line.step.operands[position], self.context.line.places[position]
        sign = ":=" if ":=" in text else "=>"
        name, found, value = text.partition(sign)
        if not found or not value:
            raise OperandError(f"{text} is no pin", "write PIN:=operand for an input or PIN=>operand for an output")
        at = start + len(name) + 2
        return _named(start, end, name, sign, self.context.value(value, at, end))


def _named(start: int, end: int, name: str, sign: str, value: Expr) -> Argument:
    return Argument(start, end, sign, Name(start, start + len(name), name), value)
