"""Builds the nodes of statements (grammar/st.lark, 7.3.3)."""

from __future__ import annotations

from itertools import pairwise, zip_longest

from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.jumps import Jumps, Tangled
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.literals import ELEMENTARY
from fbvm.syntax.tree import (
    Assign,
    Block,
    Call,
    CallStatement,
    Case,
    CaseBranch,
    Continue,
    Empty,
    Exit,
    Expr,
    For,
    Form,
    If,
    Literal,
    NameRef,
    Node,
    Pou,
    RefusedStatement,
    Repeat,
    Return,
    Statement,
    Try,
    While,
)

_TYPES = frozenset(ELEMENTARY) - {"T", "D", "LT", "LD"}
"""Words that cannot be names of variables; the four short ones mean a type in front of `#` only."""
Value = tuple[Expr, Expr | None]
Branch = tuple[Expr, Block]


class Label(Node):
    """`1, 3..5:`; stands in a list of statements until its CASE takes it."""

    __slots__ = ("values",)

    def __init__(self, start: int, end: int, values: tuple[Value, ...]) -> None:
        super().__init__(start, end)
        self.values = values


class Members(Node):
    """A METHOD, or a PROPERTY with its accessors; stands in a list of statements until its POU takes it."""

    __slots__ = ("methods",)

    def __init__(self, start: int, end: int, methods: tuple[Pou, ...]) -> None:
        super().__init__(start, end)
        self.methods = methods


Items = list[Statement | Label | Members]


class Statements(Expressions):
    """The functions of the rules of statements."""

    # --- lists ---

    def add_empty(self, items: Items, semicolon: Token) -> Items:
        items.append(Empty(semicolon.start, semicolon.end))
        return items

    def add_ended(self, items: Items, statement: Statement, semicolon: Token) -> Items:
        items.append(statement)
        self.depths.clear()
        return items

    def close(self, items: Items, semicolon: Token) -> Items:
        return items

    def block(self, items: Items) -> Block:
        """The statements of a list outside CASE: a label of one name is a label for JMP, another one is reported."""
        made: list[Statement] = []
        for item, behind in zip_longest(items, items[1:]):
            if isinstance(item, Members):
                self.report("S0101", item.start, item.end, "a METHOD or PROPERTY stands inside a statement",
                            "it stands in its block, in front of the statements or behind them", False)
            elif not isinstance(item, Label):
                made.append(item)
            elif not self._no_label(item, behind):
                made.append(self._outside_case(item))
        return tuple(made)

    def without_jumps(self, body: Block, start: int = 0) -> Block:
        """A body that is read from `start` on, with conditions and loops in place of its jumps; the same body if conditions and
        loops cannot do the same."""
        targets = {each: name for each, name in self.targets.items() if each.start >= start}
        labels = {each: name for each, name in self.labels.items() if each.start >= start}
        if not targets and not labels:
            return body
        jumps = Jumps(targets, labels, len(self.jump_sections))
        for jump in jumps.astray():
            self.report("S0201", jump.start, jump.end, f"there is no label {targets[jump]} here",
                        "write `name:` in front of the statement to go on with")
        try:
            made = jumps.body(body)
        except Tangled:
            made = body
        else:
            self.jump_sections += [jumps.section(body)] if jumps.is_needed else []
        for known, read in ((self.targets, targets), (self.labels, labels)):
            for each in read:
                del known[each]
        return made

    def _no_label(self, label: Label, behind: Label | Statement | Members | None) -> bool:
        """Whether a label is none, since `a : INT;` or `a : 5;` is written; that is reported."""
        value, high = label.values[0]
        first = behind.targets[0] if isinstance(behind, Assign) else behind.call if isinstance(behind, CallStatement) else None
        if high is not None or first is None or not isinstance(value, NameRef):
            return False
        if "\n" in self.source.text[label.start:first.start]:
            return False
        if isinstance(first, NameRef) and first.text.upper() in _TYPES:
            self.report("S0101", label.start, first.end, "a declaration stands in front of all statements",
                        f"write it between VAR and END_VAR: {value.text} : {first.text.upper()};", False)
            return True
        if isinstance(behind, CallStatement) and not isinstance(first, Call | NameRef):
            self.report("S0101", label.end - 1, label.end, "`:=` expected, but `:` found",
                        "`:=` assigns, `:` stands behind a label", False)
            return True
        return False

    def _outside_case(self, label: Label) -> Statement:
        value, high = label.values[0]
        if len(label.values) == 1 and high is None and isinstance(value, NameRef):
            made = RefusedStatement(label.start, label.end, f"label `{value.text}`")
            self.labels[made] = value.text
            return made
        if not any(odd <= label.start and "\n" not in self.source.text[odd:label.start] for odd in self.odd):
            self.report("S0101", label.start, label.end, "label of CASE outside of a CASE statement", "")
        return Empty(label.start, label.end)

    # --- simple statements ---

    def one_target(self, target: Expr, sign: Token) -> list[Expr]:
        return [target]

    def add_target(self, targets: list[Expr], target: Expr, sign: Token) -> list[Expr]:
        targets.append(target)
        return targets

    def assignment(self, targets: list[Expr], value: Expr) -> Statement:
        return Assign(targets[0].start, value.end, tuple(targets), ":=", value)

    def assignment_other(self, target: Expr, sign: Token, value: Expr) -> Statement:
        return Assign(target.start, value.end, (target,), sign.text.upper(), value)

    def one_set_target(self, target: Expr, sign: Token) -> list[tuple[Expr, Token]]:
        return [(target, sign)]

    def add_set_target(self, targets: list[tuple[Expr, Token]], target: Expr, sign: Token) -> list[tuple[Expr, Token]]:
        targets.append((target, sign))
        return targets

    def set_assignment(self, targets: list[tuple[Expr, Token]], value: Expr) -> Statement:
        """`a S= b R= c` sets a and resets b while c is TRUE: all of them look at the last value."""
        signs = {sign.text.upper() for _, sign in targets}
        if "REF=" in signs and len(targets) > 1:
            sign = targets[1][1]
            self.report("S0101", sign.start, sign.end, f"`;` expected, but `{sign.text}` found", "REF= binds one reference")
        if len(signs) == 1 or "REF=" in signs:
            found = tuple(target for target, _ in targets)
            return Assign(found[0].start, value.end, found, targets[0][1].text.upper(), value)
        given = [Assign(target.start, target.end, (target,), ":=", Literal(
            sign.start, sign.end, "bool", sign.text.upper() == "S=", None, sign.text)) for target, sign in targets]
        return If(targets[0][0].start, value.end, ((value, self.block([*given])),), None)

    def call_statement(self, call: Expr) -> Statement:
        return CallStatement(call.start, call.end, call)

    def exit_statement(self, word: Token) -> Exit:
        return Exit(word.start, word.end)

    def continue_statement(self, word: Token) -> Continue:
        return Continue(word.start, word.end)

    def return_statement(self, word: Token, value: Expr | None) -> Statement:
        return Return(word.start, value.end if value else word.end, value)

    def jump(self, word: Token, target: Token) -> RefusedStatement:
        self.forms.append(Form("jumps_in_text", word.start, target.end, (
            "S0195", "JMP in Structured Text is CODESYS's: the standard and other compilers do not have it",
            "write IF or a loop")))
        made = RefusedStatement(word.start, target.end, "JMP")
        self.targets[made] = target.text
        return made

    def method_among_statements(self, members: Members) -> Members:
        return members

    # --- compound statements ---

    def if_statement(self, word: Token, condition: Expr, then: Token, items: Items, more: list[Branch],
                     other: Token | None, otherwise: Items | None, end: Token) -> Statement:
        branches = ((condition, self.block(items)), *more)
        return If(word.start, end.end, branches, None if otherwise is None else self.block(otherwise))

    def add_elsif(self, branches: list[Branch], word: Token, condition: Expr, then: Token,
                  items: Items) -> list[Branch]:
        branches.append((condition, self.block(items)))
        return branches

    def label_value(self, value: Expr) -> Value:
        return value, None

    def label_range(self, low: Expr, sign: Token, high: Expr) -> Value:
        return low, high

    def label(self, values: list[Value], colon: Token) -> Label:
        return Label(values[0][0].start, colon.end, tuple(values))

    def case_statement(self, word: Token, selector: Expr, of: Token, items: Items, other: Token | None,
                       otherwise: Items | None, end: Token) -> Statement:
        starts = [at for at, item in enumerate(items) if isinstance(item, Label)]
        if items and (not starts or starts[0] > 0):
            first = items[0]
            self.report("S0101", first.start, first.end,
                        "a statement in CASE stands behind a label, none is in front of this one",
                        "write `value:` in front of it")
        branches = tuple(self._branch(items[at:until]) for at, until in pairwise([*starts, len(items)]))
        rest = None if otherwise is None else self.block(otherwise)
        return Case(word.start, end.end, selector, branches, rest)

    def _branch(self, items: Items) -> CaseBranch:
        label = items[0]
        assert isinstance(label, Label)
        return CaseBranch(label.start, items[-1].end, label.values, self.block(items[1:]))

    def for_statement(self, word: Token, variable: Expr, sign: Token, first: Expr, to: Token, last: Expr,
                      by: Token | None, step: Expr | None, do: Token, items: Items, end: Token) -> Statement:
        return For(word.start, end.end, variable, first, last, step, self.block(items))

    def while_statement(self, word: Token, condition: Expr, do: Token, items: Items, end: Token) -> Statement:
        return While(word.start, end.end, condition, self.block(items))

    def repeat_statement(self, word: Token, items: Items, until: Token, condition: Expr, semicolon: Token | None,
                         end: Token) -> Statement:
        return Repeat(word.start, end.end, self.block(items), condition)

    def try_statement(self, word: Token, items: Items, catch: Token, opening: Token, code: Expr, closing: Token, handler: Items,
                      last: Token | None, final: Items | None, end: Token) -> Statement:
        self.forms.append(Form("exceptions", word.start, word.end, (
            "S0195", "__TRY is CODESYS's: the standard and other compilers do not have it", "check before what may go wrong")))
        rest = None if final is None else self.block(final)
        return Try(word.start, end.end, self.block(items), code, self.block(handler), rest)
