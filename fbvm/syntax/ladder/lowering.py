"""Steps to statements: what the rungs of a LADDER do, written in the statements that everything behind `syntax/` knows.

`context` has the state and the makers of statements; `bits`, `blocks`, `spans` and `sequences` each lower a group of
instructions and import the context; this module puts them together.
"""

from __future__ import annotations

from fbvm.syntax.ladder.bits import BitLogic
from fbvm.syntax.ladder.block_programs import BlockPrograms
from fbvm.syntax.ladder.blocks import LadderBlocks
from fbvm.syntax.ladder.context import RungContext, StepRefused
from fbvm.syntax.ladder.instructions.instruction_set import Instruction, instruction_set, spelling
from fbvm.syntax.ladder.mnemonics import ALONE, LAST, RungText, is_input, read_rungs
from fbvm.syntax.ladder.operands import OperandError
from fbvm.syntax.ladder.sequences import Sequences
from fbvm.syntax.ladder.spans import Spans
from fbvm.syntax.ladder.stops import with_one_stop, without_stops
from fbvm.syntax.ladder.symbols import declaration, is_own, number, present_value
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree.ladder import Ladder, Rung


class LadderLowering:
    """Makes the node of one LADDER from its rungs."""

    def __init__(self, builder: Expressions) -> None:
        self.builder = builder
        self.context = context = RungContext(builder)
        self.bits = BitLogic(context)
        self.blocks = LadderBlocks(context)
        self.spans = Spans(context)
        self.sequences = Sequences(context, self.spans)
        self.programs = BlockPrograms(context, self.spans, self.blocks)
        self._instructions = {
            **self.bits.instructions, **self.blocks.instructions, **self.spans.instructions, **self.sequences.instructions,
            **self.programs.instructions, ".end": self._end, ".nop": self._nothing}  # fmt: skip
        """By the word of the front end in the table of instructions, what lowers a step."""

    def ladder(self, texts: list[RungText], start: int, end: int) -> Ladder:
        """The node of the LADDER from `start` to `end` with these rungs; steps that cannot be executed are reported."""
        context = self.context
        for symbol in (symbol for text in texts for symbol in text.symbols):
            if timer := number(symbol):
                self.builder.numbered[symbol.name.upper()] = timer
            elif symbol.name:
                if is_own(symbol):
                    value = present_value(symbol)
                    context.operands.own[symbol.name.upper()] = symbol.type[0], value.names[0].text
                    context.instances.append(value)
                context.instances.append(declaration(symbol))
        self.spans.find_jumps(texts)
        self.blocks.find_timers(texts)
        rungs = []
        before = self.builder.rungs
        self.programs.find_places(enumerate(texts, before + 1))
        for position, text in enumerate(texts, 1):
            context.rung = before + position
            rung = self._rung(text, position if text.number is None else text.number)
            rungs.append(rung)
            self.spans.add_rung(rung)
        self.sequences.close()
        self.programs.finish()
        body = self.spans.finish()
        located = tuple(context.operands.located.values())
        return Ladder(start, end, tuple(rungs), body, (*located, *context.variables.values()),
                      tuple(context.temporaries.values()), tuple(context.instances), tuple(self.spans.subroutines))

    def _rung(self, text: RungText, number: int) -> Rung:
        context = self.context
        context.begin_rung()
        for step, line in enumerate(text.lines):
            context.begin_step(step, line)
            before = len(context.out)
            try:
                self._check_alone(text, step)
                self._step(line.row)
            except (StepRefused, OperandError) as refusal:
                place = refusal.place if isinstance(refusal, OperandError) and refusal.place else (context.start, context.end)
                context.report("S0110", *place, *refusal.args)
                text.damaged = True
                if is_input(line.row):
                    break
            made = tuple(context.out[before:])
            context.out[before:] = without_stops(made) if line.step.start == text.start else \
                with_one_stop(made, context.temporaries)
        end = text.lines[-1].step.end if text.lines else text.start
        if text.lines and not text.damaged:
            self._finish(text)
        steps = tuple(line.step for line in text.lines)
        section = text.section[len("SECTION"):].strip()
        return Rung(text.start, end, number, text.comment, section, steps, tuple(text.notes), tuple(context.out))

    def _finish(self, text: RungText) -> None:
        """Report conditions of a rung that nothing uses."""
        context, last = self.context, text.lines[-1].step
        if is_input(text.lines[-1].row):
            context.report("S0110", last.start, last.end, "the rung ends with a condition that nothing uses",
                           "an output or another instruction must follow")
        elif context.waiting():
            context.report("S0110", last.start, last.end, "a condition is left that no AND LD, OR LD or output has used",
                           "a block that begins with LD is joined to the one before by AND LD or OR LD")

    def _check_alone(self, text: RungText, step: int) -> None:
        """Refuse an instruction that begins or ends more than its rung beside others: a drawing is not parted there."""
        row, last = text.lines[step].row, len(text.lines) - 1
        if last and row.does in ALONE or step < last and row.does in LAST:
            raise StepRefused(f"{row.mnemonic} stands in one drawing with other instructions", "it is a rung of its own")

    def _step(self, row: Instruction) -> None:
        context = self.context
        if not row.does:
            raise StepRefused(f"{row.mnemonic} is understood and not executed", row.words)
        self.programs.enter(row)
        self._check(row)
        if row.kind == "?":
            self.bits.join(row.join, context.element(context.state_if_reachable(context.call())))
        elif row.does.startswith("."):
            self._instructions[row.does]()
        else:
            self.blocks.execute(row)
        self.programs.exit(row)

    def _check(self, row: Instruction) -> None:
        """Refuse a step with too many or too few operands, or without the execution condition that it needs."""
        given = len(self.context.line.step.operands)
        wanted = len(row.operands)
        if row.does != ".call" and not row.least <= given <= wanted:
            names = f" ({', '.join(row.names)})" if wanted else ""
            raise StepRefused(f"{row.mnemonic} takes {wanted or 'no'} operand{'s' * (wanted != 1)}{names}, not {given}",
                              self._too_many(wanted) or row.described)
        if row.inputs and self.context.condition is None:
            raise StepRefused(f"{row.mnemonic} needs an execution condition", "write LD in front of it; LD P_On is always ON")

    def _too_many(self, wanted: int) -> str:
        """The hint if an operand in excess is an instruction; "" otherwise."""
        excess = (text for text in self.context.line.step.operands[wanted:] if spelling(text) in instruction_set().rows)
        return f"{inner} begins a line of its own" if (inner := next(excess, "")) else ""

    def _end(self) -> None:
        self.sequences.close()
        self.spans.end()

    def _nothing(self) -> None:
        """NOP."""


def read_ladder(builder: Expressions, token: Token) -> Ladder:
    """The node of a LADDER .. END_LADDER; errors in its lines are reported to the builder."""
    text = builder.source.text
    first = text.index("\n", token.start) + 1
    last = text.rfind("\n", 0, token.end) + 1
    rungs = read_rungs(text, first, max(first, last), builder.report)
    return LadderLowering(builder).ladder(rungs, token.start, token.end)
