"""Instructions to statements (IEC 61131-3 ed. 3, 7.2; ed. 2, 3.2).

The current result is kept as the expression that computes it, and written where it is used.  If it is used again, or if
what it was computed from may change before, a temporary keeps its value.  Jumps and labels become those of Structured Text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.il.flow import is_formal, needs
from fbvm.syntax.il.instructions import Instruction, read_instructions
from fbvm.syntax.il.operators import OPERATORS, Operator
from fbvm.syntax.ladder.instructions.pasted import ladder_lines
from fbvm.syntax.st.automaton import NESTING_LIMIT, Automaton, ErrorRecovery
from fbvm.syntax.st.builder import CHAIN_LIMIT, TooDeep
from fbvm.syntax.st.declarations import SET_BY
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.statements import Statements
from fbvm.syntax.tree import Argument, Expr, Name, NameRef
from fbvm.syntax.tree.il import CallsInRow, InstructionList, TypeOf

LONGEST = 100
"""Operations of one expression: a longer current result is kept in a temporary."""
_OPERANDS = (tree.NameRef | tree.Literal | tree.Member | tree.Index | tree.Part | tree.Deref | tree.Direct | tree.EnumLiteral
             | tree.NullLiteral)  # fmt: skip
RUNGS_STAND = "rungs stand between LADDER and END_LADDER"
_RUNG_WORDS = {"OUT", "OUTNOT", "LDNOT", "ANDNOT", "ORNOT", "TIM", "CNT", "ANDLD", "ORLD", "KEEP", "DIFU", "DIFD"}


_BEHIND_CONDITION = re.compile(r"(?is)(?:\s|//[^\n]*|\(\*.*?\*\))*END_TRANSITION\b")
"""What stands behind a list whose last current result is the condition of a transition."""


class InstructionError(Exception):
    """An instruction cannot be executed: a message, a hint, and where, if that is not the whole instruction."""

    def __init__(self, message: str, hint: str = "", token: Token | None = None) -> None:
        super().__init__(message)
        self.message, self.hint, self.token = message, hint, token


class _Open(NamedTuple):
    """A list in brackets that is being read, and the current result in front of it."""

    instruction: Instruction
    outer: Expr


class ListLowering:
    """Makes the statements of one instruction list."""

    def __init__(self, builder: Statements) -> None:
        self.builder = builder
        self.out: list[tree.Statement] = []
        self.result: Expr | None = None
        """The current result."""
        self.is_unused = False
        """Whether no statement has used the current result yet."""
        self.operations = 0
        """Operations of `result`."""
        self.first = 0
        """Where the instructions begin that the next statement stands for."""
        self.open: list[_Open] = []
        self.temporaries: list[tree.VarDecl] = []
        self.others = sum(len(each.temporaries) for each in builder.lists)
        """How many temporaries the other lists of the POU have."""
        self.at_labels: dict[str, str] = {}
        """Folded label -> the temporary with the current result there."""
        self.needed_at: dict[str, bool] = {}
        """Folded label -> whether the current result is needed there."""
        self.is_reached = True
        """False behind a JMP or RET without condition, up to the next label."""
        self.is_wrong = False
        """True once something has been reported: the current result may be missing because of that."""
        self._rules: dict[str, Callable[[Instruction, Operator, bool], None]] = {
            "load": self._load, "store": self._store, "set": self._set, "not": self._not, "binary": self._binary,
            "jump": self._jump, "call": self._call, "return": self._return, "input": self._input, "close": self._close,
        }  # fmt: skip

    def lower(self, instructions: list[Instruction], start: int, end: int) -> InstructionList:
        """The node of the list from `start` to `end`; what cannot be executed is reported to the builder."""
        at_end = bool(_BEHIND_CONDITION.match(self.builder.source.text, end))
        needed_at = needs(instructions, at_end).front
        needed = needs(instructions, at_end, calls_replace=False)
        for at, each in enumerate(instructions):
            if each.label is not None:
                self.needed_at[fold(each.label.text)] = needed_at[at]
        self.first = start
        for at, each in enumerate(instructions):
            try:
                if each.label is not None:
                    self._label(each, each.label)
                if each.name:
                    self._instruction(each, needed.behind[at])
            except InstructionError as error:
                self._report(error.token or each, error.message, error.hint)
        for one in self.open:
            self._report(one.instruction, f"the bracket behind {one.instruction.name} is not closed", "a line with `)` closes it")
        written = len(self.out)
        self._use_up()
        return InstructionList(start, end, tuple(self.out), tuple(self.temporaries), self.result, len(self.out) > written)

    def _report(self, place: Token | Instruction, message: str, hint: str) -> None:
        self.is_wrong = True
        self.builder.report("S0114", place.start, place.end, message, hint)

    def _instruction(self, each: Instruction, needed: bool) -> None:
        operator = OPERATORS.get(each.name)
        if operator is None:
            self._function(each, needed)
            return
        if self.open and operator.kind not in ("load", "not", "binary", "close"):
            raise InstructionError(f"{each.name} stands in brackets", "only operations and functions stand between `(` and `)`")
        if not each.opens:
            self._rules[operator.kind](each, operator, needed)
            return
        self.open.append(_Open(each, self._current(each)))
        self.result, self.is_unused = None, False
        if len(self.open) > NESTING_LIMIT:
            raise InstructionError(f"brackets stand in each other more than {NESTING_LIMIT} deep", "store what is in between")
        if each.operands:
            self.result, self.is_unused = self._operand(each), True

    # --- the current result ---

    def _current(self, each: Instruction) -> Expr:
        """The current result.  Raises InstructionError if there is none."""
        if self.result is None:
            if self.is_wrong:
                self.result = NameRef(each.start, each.end, "$CR")  # what is missing has been reported
                return self.result
            raise InstructionError(f"there is no current result for {each.name}", "the first instruction is LD")
        return self.result

    def _kept(self, each: Instruction, needed: bool, target: Expr | None = None) -> Expr:
        """The current result for a statement; kept in a temporary first if it is needed behind the statement, too.

        What is made of constants alone has the type of the `target` that it is stored in."""
        result = self._current(each)
        self.is_unused = False
        if needed and not isinstance(result, tree.Literal) and not self._is_temporary(result):
            result = self.result = self._temporary(each, result, target if target is not None and _is_untyped(result) else result)
            self.operations = 0
        return result

    def _use_up(self) -> None:
        """Execute what the current result is made of, before it is lost: it may be a call, or name what there is not."""
        result, self.is_unused = self.result if self.is_unused else None, False
        if result is None or self.is_wrong or isinstance(result, tree.Literal) or self._is_temporary(result):
            return
        start = min(self.first, result.start)
        if isinstance(result, tree.Call | CallsInRow):
            for call in result.calls if isinstance(result, CallsInRow) else (result,):
                self._add(tree.CallStatement(min(start, call.start), call.end, call))
            return
        target = self._declared(start, result.end, result)
        self._add(tree.Assign(start, result.end, (target,), ":=", result))

    def _temporary(self, each: Instruction, value: Expr, typed: Expr) -> Expr:
        """Assign a value to a new temporary of the type of `typed`; returns the temporary."""
        made = self._declared(each.start, each.end, typed)
        self._assign(each, made, ":=", value)
        return NameRef(each.start, each.end, made.text)

    def _declared(self, start: int, end: int, typed: Expr) -> NameRef:
        """A new temporary of the type of `typed`, declared between two positions."""
        name = f"$CR{self.others + len(self.temporaries) + 1}"
        self.temporaries.append(tree.VarDecl(start, end, (Name(start, end, name),), None, TypeOf(start, end, typed), None))
        return NameRef(start, end, name)

    def _is_temporary(self, expr: Expr) -> bool:
        return isinstance(expr, NameRef) and expr.text.startswith("$")

    def _assign(self, each: Instruction, target: Expr, sign: str, value: Expr) -> None:
        self._add(tree.Assign(self.first, each.end, (target,), sign, value))

    def _add(self, statement: tree.Statement) -> None:
        self.out.append(statement)
        self.first = statement.end

    def _begin(self, each: Instruction) -> None:
        """Note where the instructions of the next statement begin."""
        if not self.out or self.first <= self.out[-1].end:
            self.first = each.word.start if each.word else each.start

    # --- loads, stores, operations ---

    def _load(self, each: Instruction, operator: Operator, needed: bool) -> None:
        self._use_up()
        if not self.open:
            self.first = each.word.start if each.word else each.start
        value = self._operand(each)
        self.result = self._inverse(each, value) if operator.negated else value
        self.operations, self.is_unused = self.operations + 1 if self.open else 1, True
        self.is_wrong = False

    def _store(self, each: Instruction, operator: Operator, needed: bool) -> None:
        target = self._operand(each)
        value = self._kept(each, needed, None if operator.negated else target)
        self._assign(each, target, ":=", self._inverse(each, value) if operator.negated else value)

    def _set(self, each: Instruction, operator: Operator, needed: bool) -> None:
        target = self._operand(each)
        kind = self.builder.blocks.get(target.text.upper(), "") if isinstance(target, NameRef) else ""
        if kind.partition("_")[0] in SET_BY[each.name]:
            self._give(each, target, needed)
        else:
            self._assign(each, target, operator.sign, self._kept(each, needed))

    def _not(self, each: Instruction, operator: Operator, needed: bool) -> None:
        if each.operands:
            raise InstructionError("NOT has no operand: it inverts the current result", "LDN, ANDN, STN invert an operand")
        self._combine(each, self._inverse(each, self._current(each)))

    def _binary(self, each: Instruction, operator: Operator, needed: bool) -> None:
        self._operate(each, operator, self._current(each), self._operand(each))

    def _operate(self, each: Instruction, operator: Operator, left: Expr, right: Expr) -> None:
        right = self._inverse(each, right) if operator.negated else right
        assert each.word is not None
        self._combine(each, tree.Binary(left.start, right.end, operator.sign, left, right, each.word.start))

    def _combine(self, each: Instruction, value: Expr) -> None:
        self.result, self.is_unused = value, True
        self.operations += 1
        if self.operations > LONGEST and not self.open:
            self._kept(each, True)
        elif self.operations > CHAIN_LIMIT:
            self.result, self.operations = None, 0
            raise InstructionError(f"more than {CHAIN_LIMIT} operations stand in brackets", "store what is in between")

    def _close(self, each: Instruction, operator: Operator, needed: bool) -> None:
        if not self.open:
            raise InstructionError("`)` closes no bracket")
        opener, outer = self.open[-1]
        inner = self._current(each)
        self.open.pop()
        self._operate(opener, OPERATORS[opener.name], outer, inner)

    def _inverse(self, each: Instruction, value: Expr) -> Expr:
        return tree.Unary(value.start, value.end, "NOT", value)

    def _operand(self, each: Instruction) -> Expr:
        """The one operand of an instruction."""
        operands = self._operands(each, each.operands)
        if len(operands) != 1:
            raise InstructionError(f"{each.name} has one operand" + (f", not {len(operands)}" if operands else ""))
        return operands[0]

    def _operands(self, each: Instruction, tokens: list[Token]) -> list[Expr]:
        operands = self._parsed(each, tokens)
        for operand in operands:
            plain = operand.operand if isinstance(operand, tree.Unary) and operand.op != "NOT" else operand
            if not isinstance(plain, _OPERANDS):
                shown = Token("", "", operand.start, operand.end)
                raise InstructionError("an operand is a variable or a constant, not an expression",
                                       "each operation stands on a line of its own", shown)
        return operands

    def _parsed(self, each: Instruction, tokens: list[Token]) -> list[Expr]:
        """The operands that some tokens stand for.  Raises InstructionError."""
        if not tokens:
            return []
        try:
            return list(Automaton(self.builder, iter(tokens), self.builder.source.text[:each.end], "il").run(_refuse))
        except TooDeep:
            raise InstructionError("this is nested too deep") from None
        finally:
            self.builder.depths.clear()

    # --- calls ---

    def _function(self, each: Instruction, needed: bool) -> None:
        assert each.word is not None
        if each.name in _RUNG_WORDS:
            raise InstructionError(f"{each.name} is a mnemonic of ladder, no operator of the instruction list",
                                   RUNGS_STAND)
        if each.word.type in ("RPAR", "NUMBER") or not each.word.text[0].isidentifier():
            raise InstructionError(f"an operator is expected, but `{each.word.text}` found", "", each.word)
        if is_formal(each):
            self._formal_call(each, each.word, needed)
            return
        arguments = (self._current(each), *self._operands(each, each.operands))
        name = NameRef(each.word.start, each.word.end, each.word.text)
        given = tuple(Argument(one.start, one.end, "", None, one) for one in arguments)
        self._combine(each, tree.Call(each.word.start, each.end, name, given))

    def _formal_call(self, each: Instruction, word: Token, needed: bool) -> None:
        """A call with all arguments in brackets.  The current result stays if the function has none, which the checker knows."""
        calls: tuple[tree.Call, ...] = ()
        before = self.result
        if needed and self.is_unused and isinstance(before, tree.Call):
            calls, before = (before,), None
        elif needed and self.is_unused and isinstance(before, CallsInRow):
            calls, before = before.calls, before.before
        elif needed and before is not None:
            self._kept(each, True)
            before = self.result
        else:
            self._use_up()
            before = None
        if not calls:
            self._begin(each)
        call = self._parsed(each, [word, *each.operands])[0]
        if isinstance(call, tree.Call) and (calls or before is not None):
            self.result = CallsInRow(call.start, call.end, (*calls, call), before)
        else:
            self.result = call
        self.operations, self.is_unused = 1, True

    def _call(self, each: Instruction, operator: Operator, needed: bool) -> None:
        called = self._parsed(each, each.operands)
        if len(called) != 1 or not isinstance(called[0], tree.Call | _OPERANDS):
            raise InstructionError(f"{each.name} calls one instance", "CAL timer(IN := a, PT := T#1s)")
        call = called[0]
        if not isinstance(call, tree.Call):
            call = tree.Call(call.start, call.end, call, ())
        self._when(each, operator, needed, tree.CallStatement(call.start, call.end, call))

    def _input(self, each: Instruction, operator: Operator, needed: bool) -> None:
        self._give(each, self._operand(each), needed)

    def _give(self, each: Instruction, instance: Expr, needed: bool) -> None:
        """Call an instance with the current result as the input that the operator names."""
        assert each.word is not None
        value = self._kept(each, needed)
        name = Name(each.word.start, each.word.end, each.name)
        call = tree.Call(instance.start, instance.end, instance, (Argument(name.start, name.end, ":=", name, value),))
        self._add(tree.CallStatement(self.first, each.end, call))

    # --- jumps ---

    def _when(self, each: Instruction, operator: Operator, needed: bool, *statements: tree.Statement) -> None:
        """Add statements that are executed as the condition of the operator says."""
        if not operator.condition:
            if needed and self.result is not None:
                self._kept(each, True)
            for statement in statements:
                self._add(statement)
            return
        value = self._kept(each, needed)
        condition = self._inverse(each, value) if operator.condition == "CN" else value
        self._add(tree.If(self.first, each.end, ((condition, statements),), None))

    def _jump(self, each: Instruction, operator: Operator, needed: bool) -> None:
        if len(each.operands) != 1 or not each.operands[0].text.isidentifier():
            raise InstructionError(f"{each.name} has a label as its operand")
        label = each.operands[0]
        jump = tree.RefusedStatement(each.start, label.end, "JMP")
        self.builder.targets[jump] = label.text
        carried: list[tree.Statement] = []
        if self.needed_at.get(fold(label.text)):
            self._kept(each, True)
            carried = self._carried(each, label)
        elif not operator.condition:
            self._use_up()
        self._when(each, operator, needed, *carried, jump)
        self.is_reached = self.is_reached and bool(operator.condition)

    def _return(self, each: Instruction, operator: Operator, needed: bool) -> None:
        if not operator.condition:
            self._use_up()
        self._when(each, operator, needed, tree.Return(each.start, each.end, None))
        self.is_reached = self.is_reached and bool(operator.condition)

    def _label(self, each: Instruction, label: Token) -> None:
        if self.open:
            raise InstructionError("a label stands in brackets", "only operations and functions stand between `(` and `)`", label)
        needed = self.needed_at[fold(label.text)]
        if needed and self.is_reached and self.result is not None:
            for statement in self._carried(each, label):
                self._add(statement)
        self._use_up()
        mark = tree.RefusedStatement(label.start, label.end, f"label `{label.text}`")
        self.builder.labels[mark] = label.text
        self._add(mark)
        self.is_reached = True
        self.result = None
        if needed and fold(label.text) in self.at_labels:
            self.result = NameRef(label.start, label.end, self.at_labels[fold(label.text)])

    def _carried(self, each: Instruction, label: Token) -> list[tree.Statement]:
        """The assignment that gives the current result to the instructions behind a label."""
        value, self.is_unused = self._current(each), False
        name = self.at_labels.get(fold(label.text))
        if name is None:
            name = self.at_labels[fold(label.text)] = self._declared(each.start, each.end, value).text
        return [tree.Assign(each.start, each.end, (NameRef(each.start, each.end, name),), ":=", value)]


def _is_untyped(expr: Expr) -> bool:
    """True for numbers without a type in front, and what operators make of them."""
    if isinstance(expr, tree.Binary):
        return _is_untyped(expr.left) and _is_untyped(expr.right)
    if isinstance(expr, tree.Unary):
        return _is_untyped(expr.operand)
    return isinstance(expr, tree.Literal) and expr.type_name is None and expr.kind in ("int", "real")


class _Refusal(ErrorRecovery):
    """Ends the parse of operands at the first token that cannot stand there."""

    def unexpected(self, token: Token) -> list[Token]:
        if token.type == "$END":
            raise InstructionError("the instruction ends too early")
        raise InstructionError(f"`{token.text}` cannot stand here", "", token)

    def too_deep(self, token: Token, why: str) -> list[Token]:
        raise InstructionError("this is nested too deep", "", token)


def _refuse(stuck: Automaton) -> ErrorRecovery:
    return _Refusal()


def read_list(builder: Statements, token: Token) -> InstructionList:
    """The node of an instruction list; what is wrong with its lines is reported to the builder."""
    if ladder_lines(builder.source.text, token.start):
        line_end = builder.source.text.find("\n", token.start)
        builder.report("S0101", token.start, min(token.end, line_end), "these lines are ladder as mnemonics", RUNGS_STAND, False)
        return InstructionList(token.start, token.end, (), (), None)
    instructions = read_instructions(builder.source.text, token.start, token.end, builder.report)
    return ListLowering(builder).lower(instructions, token.start, token.end)
