"""Steps to statements: what the rungs of a LADDER do, written in the statements that everybody behind `syntax/` knows.

The model is that of the mnemonics (C200HS p134, CV p79 to 95): one execution condition and a stack of saved ones; an
output uses the condition and leaves it as it is.  A jump or an interlock is a variable that guards what it covers.
"""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax import tree
from fbvm.syntax.ladder.blocks import LadderBlocks
from fbvm.syntax.ladder.instructions.instruction_set import Instruction, instruction_set, spelling
from fbvm.syntax.ladder.mnemonics import Line, RungText, is_input, read_rungs
from fbvm.syntax.ladder.operands import Operands, Wrong
from fbvm.syntax.ladder.sequences import Steps
from fbvm.syntax.ladder.spans import Spans, StepRefused
from fbvm.syntax.ladder.symbols import declaration, number
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Assign, Binary, Expr, If, NameRef, Statement, Unary
from fbvm.syntax.tree.ladder import Edge, Element, Ladder, Rung

DEEPEST = 32
"""Most conditions that may be saved (8 on the real CPU units; assumed)."""


class Rungs:
    """Builds one LADDER.  `line` is the step at work; statements are placed where it stands."""

    def __init__(self, builder: Expressions) -> None:
        self.builder = builder
        self.report = builder.report
        self.operands = Operands(self.reach, builder.numbered)
        self.variables: dict[str, tree.VarDecl] = {}
        self.temporaries: dict[str, tree.VarDecl] = {}
        self.spans = Spans(self)
        self.blocks = LadderBlocks(self)
        self.steps = Steps(self)
        self.out: list[Statement] = []
        self.condition: Expr | None = None
        self.saved: list[Expr] = []
        self.used: set[str] = set()
        """Conditions of this rung that an output has used, by the names under which they are kept."""
        self.branches: set[str] = set()
        """TR bits that this rung has written."""
        self.rung = 0
        """Which rung of the POU it is, whatever number was written."""
        self.step = 0
        self.line: Line
        self._position = 0
        self.reached: dict[str, tuple[Statement, Expr]] = {}
        """Addresses that the step works out, by the names under which they are kept: how, and whether they lead anywhere."""
        self.instances: list[tree.VarDecl] = []

    # --- the whole --------------------------------------------------------------------------------------------------

    def ladder(self, texts: list[RungText], start: int, end: int) -> Ladder:
        """The LADDER of these rungs."""
        for symbol in (symbol for text in texts for symbol in text.symbols):
            if timer := number(symbol):
                self.builder.numbered[symbol.name.upper()] = timer
            else:
                self.instances.append(declaration(symbol))
        self.spans.look(texts)
        self.blocks.look(texts)
        rungs = []
        before = sum(len(ladder.rungs) for ladder in self.builder.ladders)
        for position, text in enumerate(texts, 1):
            self.rung = before + position
            rung = self._rung(text, position if text.number is None else text.number)
            rungs.append(rung)
            self.spans.place(rung)
        body = self.spans.close(end)
        located = tuple(self.operands.located.values())
        return Ladder(start, end, tuple(rungs), body, (*located, *self.variables.values()),
                      tuple(self.temporaries.values()), tuple(self.instances), tuple(self.spans.subroutines))

    def _rung(self, text: RungText, number: int) -> Rung:
        self.out, self.condition, self.saved, self.used, self.branches = [], None, [], set(), set()
        for step, line in enumerate(text.lines):
            self.line, self.step, self.reached = line, step, {}
            try:
                self._step(line.row)
            except (StepRefused, Wrong) as refusal:
                start, end = refusal.place if isinstance(refusal, Wrong) and refusal.place else (self.start, self.end)
                self.report("S0110", start, end, *refusal.args)
                text.damaged = True
                if is_input(line.row):
                    break
        end = text.lines[-1].step.end if text.lines else text.start
        if text.lines and not text.damaged:
            self._finish(text)
        steps = tuple(line.step for line in text.lines)
        return Rung(text.start, end, number, text.comment, steps, tuple(text.notes), tuple(self.out))

    def _finish(self, text: RungText) -> None:
        """See to it that every condition was used."""
        last = text.lines[-1].step
        if is_input(text.lines[-1].row):
            self.report("S0110", last.start, last.end, "the rung ends with a condition that nothing uses",
                        "an output or another instruction must follow")
        elif any(not isinstance(one, NameRef) or one.text not in self.used for one in self.saved):
            self.report("S0110", last.start, last.end, "a condition is left that no AND LD, OR LD or output has used",
                        "a block that begins with LD is joined to the one before by AND LD or OR LD")

    def _step(self, row: Instruction) -> None:
        if not row.does:
            raise StepRefused(f"{row.mnemonic} is understood and not executed", row.words)
        self._count(row)
        if row.kind == "?":
            self._join(row.join, self.contact(self.seen(self.call())))
        elif row.does.startswith("."):
            _NATIVE[row.does](self)
        else:
            self.blocks.execute(row)

    def _count(self, row: Instruction) -> None:
        """The number of operands, and that there is a condition for who wants one."""
        given = len(self.line.step.operands)
        wanted = len(row.operands)
        if row.does != ".call" and not row.least <= given <= wanted:
            names = f" ({', '.join(row.names)})" if wanted else ""
            raise StepRefused(f"{row.mnemonic} takes {wanted or 'no'} operand{'s' * (wanted != 1)}{names}, not {given}",
                              self._too_many(wanted) or row.described)
        if row.inputs and self.condition is None:
            raise StepRefused(f"{row.mnemonic} needs an execution condition", "write LD in front of it; LD P_On is always ON")

    def _too_many(self, wanted: int) -> str:
        """What to do if one of the operands in excess is an instruction; "" otherwise."""
        excess = (text for text in self.line.step.operands[wanted:] if spelling(text) in instruction_set().rows)
        return f"{inner} begins a line of its own" if (inner := next(excess, "")) else ""

    # --- what the parts share ---------------------------------------------------------------------------------------

    @property
    def start(self) -> int:
        return self.line.step.start

    @property
    def end(self) -> int:
        return self.line.step.end

    def operand(self, position: int) -> Expr:
        """An operand of the step as an expression."""
        row, (start, end) = self.line.row, self.line.places[position]
        text, wanted = self.line.step.operands[position], row.operands[position]
        self._position = position
        try:
            if wanted == "k":
                return self._words(text, start, end, row.role(position))
            return self.operands.expression(text, wanted, start, end, row.role(position))
        except Wrong as wrong:
            wrong.place = start, end
            raise

    def _words(self, text: str, start: int, end: int, role: str) -> Expr:
        """Words that are read, or the one word of a constant."""
        if text[:1] not in "#&+-" or "," in text:
            return self.operands.expression(text, "a", start, end, role)
        kept = self.temporary(self.name(f"word{self._position}"), "WORD")
        self.out.append(self.assign(kept, self.operands.expression(text, "w", start, end, role)))
        return self.temporary(kept.text, "WORD")

    def reach(self, address: Expr, words: int, written: bool) -> NameRef:
        """Keep an address that the step works out: what it does is done only if so many words lie there."""
        kept = self.temporary(self.name(f"at{self._position}"), "UDINT")
        if kept.text not in self.reached:
            values = (self.temporary(kept.text, "UDINT"), self.number(words), self.truth(written))
            found = tree.Call(self.start, self.end, NameRef(self.start, self.end, "CX_Reachable"),
                              tuple(tree.Argument(self.start, self.end, "", None, value) for value in values))
            self.reached[kept.text] = self.assign(kept, address), found
        return self.temporary(kept.text, "UDINT")

    def reaching(self, *statements: Statement) -> tuple[Statement, ...]:
        """Statements that are executed if all addresses that the step works out lead somewhere."""
        if not self.reached:
            return statements
        made = [assign for assign, _ in self.reached.values()]
        return (*made, self.when(self._found(), *statements))

    def seen(self, value: Expr) -> Expr:
        """The state of a contact: OFF if an address that it works out leads nowhere."""
        if not self.reached:
            return value
        self.emit(*(assign for assign, _ in self.reached.values()))
        return self.binary("AND_THEN", self._found(), value)

    def _found(self) -> Expr:
        first, *more = (found for _, found in self.reached.values())
        for found in more:
            first = self.binary("AND", first, found)
        return first

    def value(self, text: str, start: int, end: int) -> Expr:
        """What enters a pin of a block: an operand, or a literal of Structured Text."""
        if text[0] in "'\"":
            return self.builder.string_literal(Token("STRING_LITERAL", text, start, end))
        if text.upper() in ("TRUE", "FALSE"):
            return self.truth(text.upper() == "TRUE")
        if "#" in text[1:]:
            return self.builder.typed_literal(Token("TYPED_LITERAL", text, start, end))
        return self.operands.pin(text, start, end)

    def call(self) -> Expr:
        """The function of the step with its operands."""
        arguments = [self.operand(position) for position in range(len(self.line.row.operands))]
        return tree.Call(self.start, self.end, NameRef(self.start, self.end, self.line.row.does),
                         tuple(tree.Argument(a.start, a.end, "", None, a) for a in arguments))

    def called(self, function: str, *values: Expr) -> Statement:
        """A call of a function for what it does."""
        arguments = tuple(tree.Argument(value.start, value.end, "", None, value) for value in values)
        call = tree.Call(self.start, self.end, NameRef(self.start, self.end, function), arguments)
        return tree.CallStatement(self.start, self.end, call)

    def variable(self, name: str, kind: str = "BOOL") -> NameRef:
        """A variable that is kept from cycle to cycle."""
        return self._declared(self.variables, name, kind)

    def temporary(self, name: str, kind: str = "BOOL") -> NameRef:
        """A variable that lives for one execution."""
        return self._declared(self.temporaries, name, kind)

    def _declared(self, table: dict[str, tree.VarDecl], name: str, kind: str) -> NameRef:
        if name not in table:
            spec = tree.NamedType(self.start, self.end, kind)
            table[name] = tree.VarDecl(self.start, self.end, (tree.Name(self.start, self.end, name),), None, spec, None)
        return NameRef(self.start, self.end, name)

    def name(self, what: str) -> str:
        """A name for something that belongs to the step."""
        return f"${self.rung}.{self.step}:{what}"

    def edge(self, of: Expr, falling: bool) -> Edge:
        """Whether `of` rises or falls at this step."""
        return Edge(self.start, self.end, of, self.variable(self.name("was")), falling)

    def contact(self, value: Expr) -> Element:
        return Element(self.start, self.end, self.step, value)

    def assign(self, target: Expr, value: Expr) -> Statement:
        return Assign(self.start, self.end, (target,), ":=", value)

    def binary(self, operator: str, left: Expr, right: Expr) -> Expr:
        return Binary(self.start, self.end, operator, left, right, self.start)

    def negated(self, value: Expr) -> Expr:
        return Unary(self.start, self.end, "NOT", value)

    def number(self, value: int) -> Expr:
        return tree.Literal(self.start, self.end, "int", value, None, str(value))

    def truth(self, value: bool) -> Expr:
        return tree.Literal(self.start, self.end, "bool", value, None, "TRUE" if value else "FALSE")

    def when(self, condition: Expr, *statements: Statement, otherwise: tuple[Statement, ...] = ()) -> Statement:
        return If(self.start, self.end, ((condition, statements),), otherwise or None)

    def power(self) -> NameRef:
        """The execution condition, worked out and kept; what follows uses the kept one."""
        assert self.condition is not None
        self._settle()
        kept = self.temporary(self.name("on"))
        self.used.add(kept.text)
        self.emit(self.assign(kept, self.contact(self.condition)), always=True)
        self.condition = kept
        return kept

    def _settle(self) -> None:
        """Work out what was saved before, in its order, if it was not yet."""
        for position, saved in enumerate(self.saved):
            if not isinstance(saved, NameRef):
                kept = self.temporary(f"{self.name('saved')}{position}")
                self.emit(self.assign(kept, saved), always=True)
                self.saved[position] = kept

    def emit(self, *statements: Statement, inhibited: tuple[Statement, ...] = (), passed: tuple[Statement, ...] = (),
             always: bool = False) -> None:
        """Write statements; inside an interlock that inhibits, `inhibited` in their place, under a jump `passed`.  What is
        done `always` is done in an interlock that forgets edges, too."""
        self.out += self.spans.guarded(statements, inhibited, passed, always)

    def variation(self, condition: Expr) -> Expr:
        """The condition under which the step is executed: its prefix may want an edge of it."""
        prefix = self.line.step.prefix.replace("!", "")
        return self.noticed(self.edge(condition, prefix == "%")) if prefix else condition

    def noticed(self, edge: Edge) -> Expr:
        """An edge that is worked out in an interlock that forgets edges, too."""
        if not self.spans.forgetful:
            return edge
        kept = self.temporary(self.name("edge"))
        self.emit(self.assign(kept, edge), always=True)
        return self.temporary(kept.text)

    # --- conditions -------------------------------------------------------------------------------------------------

    def _contact(self) -> Element:
        step = self.line.step
        value = self.operand(0)
        if step.prefix.replace("!", ""):
            value = self.edge(value, "%" in step.prefix)
        return self.contact(self.seen(self.negated(value) if step.mnemonic.endswith("NOT") else value))

    def _join(self, how: str, contact: Expr) -> None:
        if how == "LD":
            if self.condition is not None:
                self.saved.append(self.condition)
            if len(self.saved) > DEEPEST:
                raise StepRefused(f"more than {DEEPEST} conditions are saved", "")
            self.condition = contact
        else:
            assert self.condition is not None
            self.condition = self.binary(how, self.condition, contact)

    def _load(self) -> None:
        text = self.line.step.operands[0].upper()
        if text.startswith("TR") and text[2:].isdigit():
            if text not in self.branches:
                raise StepRefused(f"nothing was written to {text} in this rung", f"OUT {text} comes first")
            self.condition = self.temporary(f"${text}")
        else:
            self._join("LD", self._contact())

    def _series(self) -> None:
        self._join("AND", self._contact())

    def _parallel(self) -> None:
        self._join("OR", self._contact())

    def _block(self, how: str) -> None:
        if not self.saved:
            raise StepRefused(f"{how} LD joins two blocks, and there is one", "each block begins with LD")
        assert self.condition is not None
        self.condition = self.binary(how, self.saved.pop(), self.condition)

    def _not(self) -> None:
        assert self.condition is not None
        self.condition = self.negated(self.condition)

    def _differentiated(self, falling: bool) -> None:
        assert self.condition is not None
        self.condition = self.contact(self.edge(self.condition, falling))

    # --- bits -------------------------------------------------------------------------------------------------------

    def _out(self) -> None:
        text = self.line.step.operands[0].upper()
        if text.startswith("TR") and text[2:].isdigit():
            self._branch(text)
            return
        target, power = self.operand(0), self.power()
        value = self.negated(power) if self.line.step.mnemonic == "OUTNOT" else power
        self.emit(*self.reaching(self.assign(target, value)),
                  inhibited=self.reaching(self.assign(self.operand(0), self.truth(False))))

    def _branch(self, text: str) -> None:
        if int(text[2:]) > 15:
            raise StepRefused(f"there is no {text}", "TR0 to TR15 are there")
        if text in self.branches:
            raise StepRefused(f"{text} is written twice in this rung", "each branch point has one of its own, TR0 to TR15")
        self.branches.add(text)
        assert self.condition is not None
        self._settle()
        kept = self.temporary(f"${text}")
        self.emit(self.assign(kept, self.contact(self.condition)), always=True)
        self.condition = kept

    def inputs(self, count: int) -> list[Expr]:
        """The conditions of an instruction with several inputs, the upper one first."""
        if len(self.saved) < count - 1:
            raise StepRefused(f"{self.line.step.mnemonic} takes {count} conditions, {len(self.saved) + 1} are there",
                              "each of them begins with LD")
        power = self.power()
        first = len(self.saved) - count + 1
        taken = self.saved[first:]
        del self.saved[first:]
        return [*taken, power]

    def _keep(self) -> None:
        target = self.operand(0)
        set_, reset = self.inputs(2)
        kept = self.binary("AND", self.binary("OR", set_, self.operand(0)), self.negated(reset))
        self.emit(*self.reaching(self.assign(target, kept)))

    def _pulse(self, falling: bool) -> None:
        edge = self.noticed(self.edge(self.power(), falling))
        self.emit(*self.reaching(self.assign(self.operand(0), edge)))

    def _set(self, value: bool) -> None:
        target = self.operand(0)
        self.emit(self.when(self.variation(self.power()), *self.reaching(self.assign(target, self.truth(value)))))

    def _nothing(self) -> None:
        """NOP."""


_NATIVE: dict[str, Callable[[Rungs], None]] = {
    ".load": Rungs._load, ".and": Rungs._series, ".or": Rungs._parallel,
    ".and_block": lambda rungs: rungs._block("AND"), ".or_block": lambda rungs: rungs._block("OR"),
    ".not": Rungs._not, ".up": lambda rungs: rungs._differentiated(False),
    ".down": lambda rungs: rungs._differentiated(True),
    ".out": Rungs._out, ".keep": Rungs._keep, ".difu": lambda rungs: rungs._pulse(False),
    ".difd": lambda rungs: rungs._pulse(True), ".set": lambda rungs: rungs._set(True),
    ".reset": lambda rungs: rungs._set(False), ".nop": Rungs._nothing,
    ".call": lambda rungs: rungs.blocks.call(), ".end": lambda rungs: rungs.spans.end(),
    ".interlock": lambda rungs: rungs.spans.interlock(), ".interlock_clear": lambda rungs: rungs.spans.clear(),
    ".jump": lambda rungs: rungs.spans.jump(), ".jump_end": lambda rungs: rungs.spans.land(),
    ".for": lambda rungs: rungs.spans.loop(), ".next": lambda rungs: rungs.spans.next(),
    ".break": lambda rungs: rungs.spans.leave(), ".call_subroutine": lambda rungs: rungs.spans.visit(),
    ".subroutine": lambda rungs: rungs.spans.subroutine(), ".return": lambda rungs: rungs.spans.go_back(),
    ".macro": lambda rungs: rungs.spans.visit_with_words(),
    ".interlock_number": lambda rungs: rungs.spans.interlock_number(),
    ".interlock_end": lambda rungs: rungs.spans.clear_number(),
    ".step": lambda rungs: rungs.steps.step(), ".next_step": lambda rungs: rungs.steps.next_step(),
    ".reset_numbers": lambda rungs: rungs.blocks.reset_numbers(),
    ".reset_timer": lambda rungs: rungs.blocks.reset_timer(),
    ".address": lambda rungs: rungs.blocks.address(), ".value_address": lambda rungs: rungs.blocks.address(),
    ".failure": lambda rungs: rungs.blocks.failure("CX_FAL"),
    ".fatal_failure": lambda rungs: rungs.blocks.failure("CX_FALS"),
}


def read_ladder(builder: Expressions, token: Token) -> Ladder:
    """The node of a LADDER .. END_LADDER; what is wrong in it is reported to the builder."""
    text = builder.source.text
    first = text.index("\n", token.start) + 1
    last = text.rfind("\n", 0, token.end) + 1
    rungs = read_rungs(text, first, max(first, last), builder.report)
    return Rungs(builder).ladder(rungs, token.start, token.end)
