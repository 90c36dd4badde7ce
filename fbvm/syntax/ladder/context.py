"""What the lowering of a LADDER knows about the step at work, and the makers of statements that all its parts share.

The model is that of the mnemonics (C200HS p134, CV p79 to 95): one execution condition and a stack of saved ones; an
output uses the condition and leaves it as it is.  Jumps and interlocks that cover the step guard every statement that is
emitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from fbvm.syntax import tree
from fbvm.syntax.ladder.mnemonics import Line
from fbvm.syntax.ladder.operands import OperandError, Operands
from fbvm.syntax.st.builder import CHAIN_LIMIT
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Assign, Binary, Block, Expr, If, NameRef, Statement, Unary
from fbvm.syntax.tree.ladder import Edge, Element

Operation = TypeVar("Operation", Binary, Unary, Edge, Element)


class StepRefused(Exception):
    """A step cannot be executed; the arguments are a message and a hint."""


@dataclass
class Interlock:
    """An interlock that covers the step at work."""

    inhibits: str
    """The variable that is TRUE while outputs are inhibited."""
    start: int
    end: int
    forgets: bool = False
    """Whether edges that come while it inhibits are lost (MILR)."""


class RungContext:
    """The state of a LADDER while its steps are lowered in the order of writing.

    `line` is the step at work; every node that a method makes has the extent of that step.  A statement is written with
    `emit`, which puts it under the jumps and interlocks that cover the step."""

    rung: int
    """Which rung of the POU it is, whatever number was written."""
    step: int
    line: Line

    def __init__(self, builder: Expressions) -> None:
        """`builder` makes literals of Structured Text, knows the symbols of timers and counters, and takes diagnostics."""
        self.builder = builder
        self.report = builder.report
        self.operands = Operands(self.computed_address, builder.numbered)
        self.variables: dict[str, tree.VarDecl] = {}
        """What is kept from cycle to cycle, by name."""
        self.temporaries: dict[str, tree.VarDecl] = {}
        """What lives during one execution, by name."""
        self.instances: list[tree.VarDecl] = []
        """Variables of tables of symbols, and instances that FBCALL names."""
        self.interlocks: dict[str, Interlock] = {}
        """Interlocks that cover the step, by number; "IL" is that of IL and ILC."""
        self.jumps: dict[str, NameRef] = {}
        """By number of a jump that covers the step, the variable that is TRUE while the jump passes over rungs."""
        self.begin_rung()

    def begin_rung(self) -> None:
        """Forget what belongs to the rung before."""
        self.out: list[Statement] = []
        """The statements of the rung."""
        self.condition: Expr | None = None
        """The execution condition; None at the bus bar."""
        self.saved: list[Expr] = []
        """Conditions that wait for AND LD, OR LD or an instruction with several inputs, the last one on top."""
        self.used: set[str] = set()
        """Names of the variables that keep conditions which an output has used."""
        self.branches: dict[str, str] = {}
        """TR bits that the rung has written, each with the variable of its last value: a later one has a variable of its own."""
        self._depths: dict[Expr, int] = {}
        """How many operations of conditions stand in one another, by the outermost."""
        self._computed: dict[str, tuple[Statement, Expr]] = {}
        self._position = 0

    def begin_step(self, step: int, line: Line) -> None:
        """Go on to step number `step` of the rung."""
        self.line, self.step = line, step
        self._computed = {}
        """Addresses that the step computes, by the name of the variable that keeps each: the assignment that computes the
        address, and the call that says whether so many words lie there."""

    # --- operands ---

    @property
    def start(self) -> int:
        return self.line.step.start

    @property
    def end(self) -> int:
        return self.line.step.end

    def operand(self, position: int) -> Expr:
        """Operand number `position` of the step as an expression of the type that the instruction wants there.  Raises
        OperandError with the place of the operand."""
        row, (start, end) = self.line.row, self.line.places[position]
        text, wanted = self.line.step.operands[position], row.operands[position]
        self._position = position
        try:
            if wanted == "k":
                return self._words(text, start, end, row.role(position))
            return self.operands.expression(text, wanted, start, end, row.role(position))
        except OperandError as wrong:
            wrong.place = start, end
            raise

    def _words(self, text: str, start: int, end: int, role: str) -> Expr:
        """Words that are read, or a variable with the one word of a constant."""
        if text[:1] not in "#&+-" or "," in text:
            return self.operands.expression(text, "a", start, end, role)
        kept = self.temporary(self.name(f"word{self._position}"), "WORD")
        self.out.append(self.assign(kept, self.operands.expression(text, "w", start, end, role)))
        return self.temporary(kept.text, "WORD")

    def computed_address(self, address: Expr, words: int, written: bool) -> NameRef:
        """A variable that keeps `address`, a PLC memory address that the step computes.  The step is executed only if `words`
        words lie there (0: a bit) that may be read, or `written`."""
        kept = self.temporary(self.name(f"at{self._position}"), "UDINT")
        if kept.text not in self._computed:
            found = self.function("CX_Reachable", self.temporary(kept.text, "UDINT"), self.number(words), self.truth(written))
            self._computed[kept.text] = self.assign(kept, address), found
        return self.temporary(kept.text, "UDINT")

    def if_reachable(self, *statements: Statement) -> tuple[Statement, ...]:
        """The same statements, executed only if every address that the step computes is one of PLC memory."""
        if not self._computed:
            return statements
        made = [assign for assign, _ in self._computed.values()]
        return (*made, self.when(self._all_reachable(), *statements))

    def state_if_reachable(self, value: Expr) -> Expr:
        """The state of a contact: OFF if an address that the step computes is none of PLC memory."""
        if not self._computed:
            return value
        self.emit(*(assign for assign, _ in self._computed.values()))
        return self.binary("AND_THEN", self._all_reachable(), value)

    def _all_reachable(self) -> Expr:
        first, *more = (found for _, found in self._computed.values())
        for found in more:
            first = self.binary("AND", first, found)
        return first

    def value(self, text: str, start: int, end: int) -> Expr:
        """The expression for a pin of a function block: an operand, or a literal of Structured Text."""
        if text[0] in "'\"":
            return self.builder.string_literal(Token("STRING_LITERAL", text, start, end))
        if text.upper() in ("TRUE", "FALSE"):
            return self.truth(text.upper() == "TRUE")
        if "#" in text[1:]:
            return self.builder.typed_literal(Token("TYPED_LITERAL", text, start, end))
        return self.operands.pin(text, start, end)

    def call(self) -> Expr:
        """The function of the step with its operands."""
        return self.function(self.line.row.does, *(self.operand(position) for position in range(len(self.line.row.operands))))

    def call_of(self, function: str, *values: Expr) -> Statement:
        """A call of a function as a statement."""
        return tree.CallStatement(self.start, self.end, self.function(function, *values))

    def function(self, name: str, *values: Expr) -> tree.Call:
        """A call of a function for its result."""
        arguments = tuple(tree.Argument(value.start, value.end, "", None, value) for value in values)
        return tree.Call(self.start, self.end, NameRef(self.start, self.end, name), arguments)

    # --- nodes ---

    def variable(self, name: str, kind: str = "BOOL") -> NameRef:
        """A variable that is kept from cycle to cycle."""
        return self._declared(self.variables, name, kind)

    def temporary(self, name: str, kind: str = "BOOL") -> NameRef:
        """A variable that lives during one execution of the POU."""
        return self._declared(self.temporaries, name, kind)

    def _declared(self, table: dict[str, tree.VarDecl], name: str, kind: str) -> NameRef:
        if name not in table:
            spec = tree.NamedType(self.start, self.end, kind)
            table[name] = tree.VarDecl(self.start, self.end, (tree.Name(self.start, self.end, name),), None, spec, None)
        return NameRef(self.start, self.end, name)

    def name(self, what: str) -> str:
        """The name of a variable that belongs to the step; programs cannot write such a name."""
        return f"${self.rung}.{self.step}:{what}"

    def edge(self, of: Expr, falling: bool) -> Edge:
        """TRUE in the cycle in which `of` rises, or with `falling` falls."""
        return self._over(Edge(self.start, self.end, of, self.variable(self.name("was")), falling), of)

    def element(self, value: Expr) -> Element:
        return self._over(Element(self.start, self.end, self.step, value), value)

    def assign(self, target: Expr, value: Expr) -> Statement:
        return Assign(self.start, self.end, (target,), ":=", value)

    def binary(self, operator: str, left: Expr, right: Expr) -> Expr:
        return self._over(Binary(self.start, self.end, operator, left, right, self.start), left, right)

    def negated(self, value: Expr) -> Expr:
        return self._over(Unary(self.start, self.end, "NOT", value), value)

    def _over(self, made: Operation, *parts: Expr) -> Operation:
        """An operation over parts.  Raises StepRefused if too many stand in one another."""
        depth = self._depths[made] = 1 + max(self._depths.pop(part, 0) for part in parts)
        if depth > CHAIN_LIMIT:
            raise StepRefused(f"more than {CHAIN_LIMIT} conditions are joined", "write what is joined so far to a bit")
        return made

    def number(self, value: int) -> Expr:
        return tree.Literal(self.start, self.end, "int", value, None, str(value))

    def truth(self, value: bool) -> Expr:
        return tree.Literal(self.start, self.end, "bool", value, None, "TRUE" if value else "FALSE")

    def when(self, condition: Expr, *statements: Statement, otherwise: tuple[Statement, ...] = ()) -> Statement:
        return If(self.start, self.end, ((condition, statements),), otherwise or None)

    # --- conditions and statements ---

    def power(self) -> NameRef:
        """The execution condition in a variable, which takes its place for the steps that follow."""
        assert self.condition is not None
        self.evaluate_saved()
        kept = self.temporary(self.name("on"))
        self.used.add(kept.text)
        self.emit(self.assign(kept, self.element(self.condition)), always=True)
        self.condition = kept
        return kept

    def waiting(self) -> list[Expr]:
        """The saved conditions that no output has used: only these have to be joined by AND LD, OR LD or an instruction."""
        return [one for one in self.saved if not isinstance(one, NameRef) or one.text not in self.used]

    def evaluate_saved(self) -> None:
        """Assign the saved conditions to variables, so that they are evaluated in the order of writing."""
        for position, saved in enumerate(self.saved):
            if not isinstance(saved, NameRef):
                kept = self.temporary(f"{self.name('saved')}{position}")
                self.emit(self.assign(kept, saved), always=True)
                self.saved[position] = kept

    def emit(self, *statements: Statement, inhibited: tuple[Statement, ...] = (), passed: tuple[Statement, ...] = (),
             always: bool = False) -> None:
        """Write statements under the jumps and interlocks that cover the step.

        `inhibited` are executed in their place while an interlock inhibits, `passed` while a jump passes over the step.
        With `always`, interlocks that forget edges do not inhibit the statements."""
        self.out += self.guarded(statements, inhibited, passed, always)

    def variation(self, condition: Expr) -> Expr:
        """The condition under which the step is executed: `condition`, or its edge if the step begins with `@` or `%`."""
        prefix = self.line.step.prefix.replace("!", "")
        return self.tracked(self.edge(condition, prefix == "%")) if prefix else condition

    def tracked(self, edge: Edge) -> Expr:
        """The edge, evaluated also while an interlock that forgets edges inhibits, so that it is lost there."""
        if not any(lock.forgets for lock in self.interlocks.values()):
            return edge
        kept = self.temporary(self.name("edge"))
        self.emit(self.assign(kept, edge), always=True)
        return self.temporary(kept.text)

    def inputs(self, count: int) -> list[Expr]:
        """The conditions of an instruction with `count` inputs, the upper one first; all but the last were saved."""
        if len(self.saved) < count - 1:
            raise StepRefused(f"{self.line.step.mnemonic} takes {count} conditions, {len(self.saved) + 1} are there",
                              "each of them begins with LD")
        power = self.power()
        first = len(self.saved) - count + 1
        taken = self.saved[first:]
        del self.saved[first:]
        return [*taken, power]

    def guarded(self, statements: Block, inhibited: Block, passed: Block = (), always: bool = False) -> list[Statement]:
        """Statements as `emit` writes them."""
        whole = list(statements)
        locks = [lock for lock in self.interlocks.values() if not (always and lock.forgets)]
        if locks:
            here = self._any([self.temporary(lock.inhibits) for lock in locks])
            whole = [self._guard(here, inhibited, statements) if inhibited else
                     self._guard(self.negated(here), statements)]
        if self.jumps:
            passing = self.negated(self._any([self.temporary(jump.text) for jump in self.jumps.values()]))
            whole = [self._guard(passing, tuple(whole), passed or None)]
        return whole

    def _any(self, conditions: Sequence[Expr]) -> Expr:
        first, *more = conditions
        for one in more:
            first = self.binary("OR", first, one)
        return first

    def _guard(self, condition: Expr, statements: Block, otherwise: Block | None = None) -> Statement:
        """A condition that is not in the source: without extent, so that stepping does not stop at it."""
        return If(self.start, self.start, ((condition, statements),), otherwise)
