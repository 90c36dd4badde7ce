"""Block programs: what stands between BPRG and BEND is executed line by line and waits where it is told to (block programming
instructions of W340 and W474; from memory of the family, no page was seen: what the memory leaves open is assumed).

Each step of a block program stands under a jump that passes over it while the program is not executed, waits further up,
or has not come to the place yet at which it waited in the last cycle.  The branches of an IF are such jumps, too, and LOOP is a
loop around rungs.  The places at which a program can wait are numbered; one variable keeps the number of the present one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.blocks import REFRESHED, LadderBlocks
from fbvm.syntax.ladder.context import RungContext, StepRefused
from fbvm.syntax.ladder.instructions.instruction_set import IN_BLOCK_PROGRAMS, Instruction
from fbvm.syntax.ladder.mnemonics import RungText, is_input
from fbvm.syntax.ladder.spans import Spans
from fbvm.syntax.tree import Expr, If, Statement

NUMBERS = 128
"""Numbers of block programs are below this."""
DEEPEST_BRANCHES = 253
TIMERS = {"TIMW": "CX_TIM", "TIMWX": "CX_TIMX", "TMHW": "CX_TIMH", "TMHWX": "CX_TIMHX"}
"""An instruction that waits for a time -> the timer that counts it."""
COUNTERS = {"CNTW": "CX_CNT", "CNTWX": "CX_CNTX"}
"""An instruction that waits for a count -> its counter."""
CONDITIONAL = (".if", ".wait", ".exit", ".loop_end")
"""Instructions whose condition is a bit behind them, or is made by the contacts in front of them."""
WAITING = (".wait", ".timer_wait", ".counter_wait")
POWERED = (".timer_wait", ".counter_wait", ".pause", ".restart")
"""Instructions without a condition whose drawing shows whether they were executed."""
UNCONDITIONAL = (".set", ".reset", ".nop", ".address", ".value_address", ".failure", ".fatal_failure", ".reset_numbers",
                 ".reset_timer", ".call_subroutine", ".macro")
"""Instructions of rungs that a block program executes without a condition, beside those of the library that keep no state."""
INSTEAD = {".out": "SET and RSET write bits", ".keep": "SET and RSET write bits", ".difu": "a bit is SET, and RSET after a WAIT",
           ".difd": "a bit is SET, and RSET after a WAIT", ".jump": "IF passes over instructions", ".for": "LOOP repeats",
           "FB": "TIMW and TMHW wait for a time", "FB-": "CNTW waits for a count; others stand before BPRG or behind BEND"}
"""Word of the front end, or kind of an instruction, that has no place in a block program -> what does the same there."""


@dataclass
class Branch:
    """An IF whose IEND has not been read."""

    passed: str
    """The variable that is TRUE while the branch at work is passed over."""
    start: int
    end: int
    has_else: bool = False


@dataclass
class BlockProgram:
    """A block program whose BEND has not been read."""

    number: str
    start: int
    end: int
    place: str
    """The variable that keeps the number of the place at which the program waits; 0 at none: it begins from BPRG."""
    places: int = 0
    """How many places it can wait at, so far."""
    branches: list[Branch] = field(default_factory=list)
    loop: int | None = None
    """In how many branches the LOOP stands whose LEND has not been read."""

    @property
    def passes(self) -> str:
        """The variable that is TRUE while steps are passed over."""
        return f"$BPRG{self.number}"

    @property
    def seeks(self) -> str:
        """The variable that is TRUE from BPRG up to the place at which the program waited in the last cycle."""
        return f"$BPRG{self.number} seeks"


class BlockPrograms:
    """Lowers BPRG, BEND and what only stands between them, and covers the steps there with the jumps that pass over them."""

    def __init__(self, context: RungContext, spans: Spans, blocks: LadderBlocks) -> None:
        self.context, self.spans, self.blocks = context, spans, blocks
        self._open: BlockProgram | None = None
        self._defined: set[str] = set()
        self._paused: dict[str, tuple[int, int]] = {}
        """Numbers of the programs that BPPS and BPRS name, with the place of the first of these."""
        self._places: set[tuple[int, int]] = set()
        """Rung and step at which a place to wait begins: with the contacts of a WAIT, or with the instruction itself."""
        self.instructions: dict[str, Callable[[], None]] = {
            ".block_program": self.begin, ".block_end": self.end, ".if": self.begin_branch, ".else": self.turn_branch,
            ".if_end": self.end_branch, ".wait": self.wait, ".exit": self.leave, ".loop": self.begin_loop,
            ".loop_end": self.end_loop, ".pause": self.pause, ".restart": self.restart,
            ".timer_wait": self.wait_for_time, ".counter_wait": self.wait_for_count,
        }  # fmt: skip

    @property
    def program(self) -> BlockProgram:
        """The block program at work."""
        assert self._open is not None
        return self._open

    def find_places(self, texts: Iterable[tuple[int, RungText]]) -> None:
        """Note the places at which programs can wait, and the programs that are paused, of rungs with their numbers; called
        before the first rung is lowered."""
        for rung, text in texts:
            first = 0
            for step, line in enumerate(text.lines):
                if line.row.does in WAITING:
                    self._places.add((rung, first))
                if line.row.does in (".pause", ".restart") and line.step.operands:
                    self._paused.setdefault(_number(line.step.operands[0]), (line.step.start, line.step.end))
                first = first if is_input(line.row) else step + 1

    def finish(self) -> None:
        """Report what is left open at the end of a LADDER."""
        report = self.context.report
        if self._open is not None:
            report("S0110", self._open.start, self._open.end, f"there is no BEND of block program {self._open.number}",
                   "a block program ends with BEND")
        for number, (start, end) in self._paused.items():
            if number not in self._defined:
                report("S0110", start, end, f"there is no BPRG {number}", "BPPS and BPRS name a block program of these rungs")

    # --- every step ---

    def enter(self, row: Instruction) -> None:
        """Refuse a step that has no place in a block program, or outside of one, and make the condition under which the others
        are executed; at the beginning of a place to wait, go on if the program waits there."""
        context = self.context
        if self._open is None:
            if row.does in IN_BLOCK_PROGRAMS:
                raise StepRefused(f"{row.mnemonic} stands outside of a block program", "it stands between BPRG and BEND")
            return
        if (context.rung, context.step) in self._places:
            self._go_on()
        if not is_input(row):
            self._check(row)

    def _check(self, row: Instruction) -> None:
        context, step = self.context, self.context.line.step
        plain = not row.kind and row.does.startswith("CX_") or row.does in UNCONDITIONAL
        if not (plain or row.ends_condition):
            raise StepRefused(f"{row.mnemonic} cannot stand in a block program", INSTEAD.get(row.kind or row.does, ""))
        if step.prefix.replace("!", ""):
            raise StepRefused(f"there is no {step.prefix}{row.mnemonic} in a block program", "IF with a contact that has an edge")
        if row.does in CONDITIONAL and not step.operands:
            if context.condition is None:
                raise StepRefused(f"{row.mnemonic} needs a condition", "write LD in front of it, or a bit behind it")
        elif context.condition is not None and row.does != ".block_program":
            raise StepRefused(f"{row.mnemonic} takes no condition in a block program", "IF takes the condition")
        elif row.inputs or row.does in POWERED:
            context.condition = context.truth(True)

    def exit(self, row: Instruction) -> None:
        """Called behind each step: in a block program the next instruction has conditions of its own."""
        if (self._open is not None or row.does == ".block_end") and not is_input(row) and not self.context.waiting():
            self.context.condition = None

    # --- the program ---

    def begin(self) -> None:
        """BPRG: with the condition ON, what follows up to BEND is executed."""
        context, number = self.context, self._number()
        if self._open is not None:
            raise StepRefused(f"BPRG stands in block program {self._open.number}", "block programs stand behind one another")
        if number in self._defined:
            raise StepRefused(f"there is another BPRG {number}", "each block program has a number of its own")
        self._defined.add(number)
        made = BlockProgram(number, context.start, context.end, context.name("place"))
        executed: Expr = context.power()
        if number in self._paused:
            executed = context.binary("AND", executed, context.negated(context.variable(_paused(number))))
        here = context.temporary(context.name("here"))
        context.emit(
            context.assign(here, executed),
            context.assign(context.temporary(made.seeks), context.binary("AND", self._here(here.text), self._waits(made))),
            context.assign(context.temporary(made.passes),
                           context.binary("OR", context.negated(self._here(here.text)), self._waits(made))),
            inhibited=(context.assign(context.temporary(made.passes), context.truth(True)),))
        context.jumps[made.passes] = context.temporary(made.passes)
        self._open = made

    def _here(self, name: str) -> Expr:
        return self.context.temporary(name)

    def _waits(self, program: BlockProgram) -> Expr:
        return self.context.binary("<>", self._place(program), self.context.number(0))

    def _place(self, program: BlockProgram) -> Expr:
        return self.context.variable(program.place, "UINT")

    def end(self) -> None:
        """BEND: the end of the program; in the next cycle it begins from BPRG."""
        context, program = self.context, self.program
        for branch in program.branches:
            context.report("S0110", branch.start, branch.end, "IF without IEND", "IF and IEND stand in pairs")
            context.jumps.pop(branch.passed)
        if program.loop is not None:
            raise StepRefused("LOOP without LEND", "LOOP and LEND stand in pairs")
        context.jumps.pop(program.passes)
        context.out += [context.assign(context.temporary(name), context.truth(False)) for name in (program.seeks, program.passes)]
        self._open = None

    def leave(self) -> None:
        """EXIT: with the condition ON, goes to BEND."""
        context, program = self.context, self.program
        gone = context.assign(context.temporary(program.passes), context.truth(True))
        context.emit(context.when(self._condition(), gone))

    # --- waiting ---

    def _go_on(self, *more: Statement) -> None:
        """Begin a place to wait: a program that waits here is executed from here on."""
        context, program = self.context, self.program
        program.places += 1
        is_here = context.binary("=", self._place(program), context.number(program.places))
        names = (program.seeks, program.passes, *(branch.passed for branch in program.branches))
        falls = [context.assign(context.temporary(name), context.truth(False)) for name in names]
        condition = context.binary("AND", context.temporary(program.seeks), is_here)
        context.out.append(If(context.start, context.start, ((condition, (*falls, *more)),), None))

    def _stay(self) -> tuple[Statement, ...]:
        """Wait at this place: what follows is passed over up to BEND, and in the next cycle what stands before this place."""
        context, program = self.context, self.program
        return (context.assign(self._place(program), context.number(program.places)),
                context.assign(context.temporary(program.passes), context.truth(True)))

    def _at_beginning(self) -> Statement:
        return self.context.assign(self._place(self.program), self.context.number(0))

    def wait(self) -> None:
        """WAIT: unless the condition is ON, what follows waits."""
        context = self.context
        context.emit(context.when(self._condition(), self._at_beginning(), otherwise=self._stay()))

    def wait_for_time(self) -> None:
        """TIMW and its like: what follows waits for the set time, which begins when the program comes here."""
        number = self.blocks.number("t")
        late = isinstance(number, int) and number < REFRESHED
        self._wait_for(TIMERS, "t", lambda begins: [self.context.truth(not begins)], late)

    def wait_for_count(self) -> None:
        """CNTW and CNTWX: what follows waits until the bit has risen as often as is set."""
        context = self.context
        self._wait_for(COUNTERS, "c", lambda begins: [context.operand(2), context.truth(begins)], False)

    def _wait_for(self, table: dict[str, str], letter: str, conditions: Callable[[bool], list[Expr]], late: bool) -> None:
        """Wait for a timer or counter.  `conditions` gives its conditions where it begins and while it runs; one that is `late`
        is updated in cycles in which the program is not executed."""
        context, blocks, row = self.context, self.blocks, self.context.line.row
        name, kind = blocks.instance_name(row, blocks.number(letter)), table[row.mnemonic]
        context.power()

        def call(begins: bool) -> Statement:
            operands = [*blocks.numbered(letter), context.operand(1)]
            return blocks.called(context.variable(name, kind), [*conditions(begins), *operands])

        def waits(sign: str) -> Expr:
            return context.binary(sign, self._place(self.program), context.number(self.program.places))

        arrives = context.when(waits("<>"), context.assign(blocks.numbered(letter)[0], context.truth(False)), call(True))
        ends = context.when(blocks.numbered(letter)[0], self._at_beginning(), otherwise=self._stay())
        passed: tuple[Statement, ...] = ()
        if late:
            passed = (context.when(waits("="), blocks.update(context.variable(name, kind), blocks.numbered(letter))),)
        context.emit(*context.if_reachable(arrives, call(False), ends), passed=passed)

    # --- pausing ---

    def pause(self) -> None:
        """BPPS: the program of that number stands still; if it is this one, from here on."""
        context, number = self.context, self._number()
        context.power()
        pauses = context.assign(context.variable(_paused(number)), context.truth(True))
        if number != self.program.number:
            context.emit(pauses)
            return
        self.program.places += 1
        stays = self._stay()
        self.program.places -= 1
        context.emit(pauses, *stays)
        self._go_on(self._at_beginning())

    def restart(self) -> None:
        """BPRS: the program of that number goes on."""
        context, number = self.context, self._number()
        context.power()
        context.emit(context.assign(context.variable(_paused(number)), context.truth(False)))

    # --- branches ---

    def begin_branch(self) -> None:
        """IF: what follows up to ELSE or IEND is executed if the condition is ON."""
        context, program = self.context, self.program
        if len(program.branches) >= DEEPEST_BRANCHES:
            raise StepRefused(f"branches stand in each other more than {DEEPEST_BRANCHES} deep", "")
        passed = context.name("passed")
        context.emit(context.assign(context.temporary(passed), context.negated(self._condition())))
        program.branches.append(Branch(passed, context.start, context.end))
        context.jumps[passed] = context.temporary(passed)

    def turn_branch(self) -> None:
        """ELSE: what follows up to IEND is executed if the condition of the IF was OFF."""
        context, branch = self.context, self._branch("ELSE")
        if branch.has_else:
            raise StepRefused("there is another ELSE of this IF", "")
        branch.has_else = True
        jump = context.jumps.pop(branch.passed)
        context.emit(context.assign(context.temporary(branch.passed), context.negated(context.temporary(branch.passed))))
        context.jumps[branch.passed] = jump

    def end_branch(self) -> None:
        """IEND: the end of an IF."""
        context, branch = self.context, self._branch("IEND")
        self.program.branches.pop()
        context.jumps.pop(branch.passed)
        context.out.append(context.assign(context.temporary(branch.passed), context.truth(False)))

    def _branch(self, what: str) -> Branch:
        """The innermost IF, for the ELSE or IEND at work."""
        program = self.program
        if not program.branches:
            raise StepRefused(f"{what} without IF", "")
        if program.loop == len(program.branches):
            raise StepRefused(f"{what} stands between LOOP and LEND, and its IF does not", "an IF stands inside, or around them")
        return program.branches[-1]

    def _condition(self) -> Expr:
        """The condition of the step: its bit, inverted with NOT, or what the contacts in front of it make."""
        context, step = self.context, self.context.line.step
        if not step.operands:
            return context.power()
        bit = context.operand(0)
        return context.element(context.state_if_reachable(context.negated(bit) if step.mnemonic.endswith("NOT") else bit))

    # --- loops ---

    def begin_loop(self) -> None:
        """LOOP: what follows up to LEND is repeated."""
        if self.program.loop is not None:
            raise StepRefused("LOOP stands in another LOOP", "loops of a block program stand behind one another")
        self.program.loop = len(self.program.branches)
        self.spans.begin_repeat(self.context.name("again"))

    def end_loop(self) -> None:
        """LEND: unless the condition is ON, goes back to LOOP."""
        context, program = self.context, self.program
        if program.loop is None:
            raise StepRefused("LEND without LOOP", "LOOP and LEND stand in pairs")
        if program.loop != len(program.branches):
            raise StepRefused("an IF that begins behind LOOP is open at LEND", "an IF stands inside, or around them")
        program.loop = None
        condition = self._condition()
        context.emit(context.assign(self.spans.end_repeat(), context.negated(condition)))

    def _number(self) -> str:
        """The number of a block program in the first operand."""
        text = self.context.line.step.operands[0]
        number = _number(text)
        if not number.isdecimal() or whole_number(number) >= NUMBERS:
            raise StepRefused(f"{text} is no number of a block program", f"numbers are 0 to {NUMBERS - 1}")
        return number


def _number(operand: str) -> str:
    """The number of a block program as text without sign and leading zeros."""
    digits = operand.lstrip("#&")
    return str(whole_number(digits)) if digits.isdecimal() else operand


def _paused(number: str) -> str:
    """The name of the variable that is TRUE while the program of that number is paused."""
    return f"$BPRG{number} paused"
