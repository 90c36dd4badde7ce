"""Rules of statements (IEC 61131-3 ed. 3, table 72)."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable

from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, EnumType, RefType, StringType, StructType, Type, base, followed
from fbvm.check import charts
from fbvm.check.calls import calls
from fbvm.check.expressions import objects, references
from fbvm.check.expressions.assignability import as_number, assignable, conversion_hint
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.expressions.writes import place, warn_of_written_counter, writable
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Value, is_block
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc


def check_body(context: Context, pou: Pou) -> None:
    """Check the statements of a POU."""
    _Statements(context, pou).block(pou.tree.body)


def _is_enclosed(text: str, node: tree.Return) -> bool:
    """True for `RETURN(condition);`, whose value stands in parentheses as a whole."""
    assert node.value is not None
    depth = 0
    for found in _PARENTHESES.finditer(text, node.start + len("RETURN")):
        if depth == 0 and found.start() >= node.value.start:
            return False
        depth += {"(": 1, ")": -1}.get(found[0], 0)
        if depth == 0 and found[0] == ")":
            return found.end() > node.value.end
    return False


class _Statements:
    """The statements of one POU."""

    def __init__(self, context: Context, pou: Pou) -> None:
        self.pou = pou
        self.scope = Scope(context, pou.source, pou)
        self.facts = self.scope.facts
        self.error = self.scope.error
        self._loops = 0

    def block(self, statements: tree.Block) -> None:
        for statement in statements:
            _CHECK[type(statement)](self, statement)

    # --- assignments and calls --------------------------------------------------------------------------------------

    def target(self, expr: tree.Expr, purpose: str = "be written") -> Type | None:
        """The type of a place that is written, or None after a diagnostic."""
        if purpose == "be written":
            is_property, taken = objects.target_property(self.scope, expr)
            if is_property:
                return taken
        kind = self.scope.infer(expr)
        if kind is None:
            return None
        if not self.scope.is_variable(expr):
            self.error("S0501", expr, f"this is a value of {kind} and cannot {purpose}",
                       objects.way_to_write(self.scope, expr) or "only variables stand left of :=")
            return None
        warn_of_written_counter(self.scope, expr)
        return kind if writable(self.scope, expr, purpose) else None

    def _assign(self, node: tree.Assign) -> None:
        if node.op == "REF=":  # which has one target
            is_property, taken = objects.target_property(self.scope, node.targets[0])
            if is_property:
                self._set_reference(node, taken)
            else:
                references.bind(self.scope, node)
            return
        kinds = [self.target(target) for target in node.targets]
        last = kinds[-1]
        if node.op in ("S=", "R="):
            self._set_or_reset(node, kinds)
            return
        if node.op == "?=":
            self._attempt(node, kinds)
            return
        if isinstance(node.value, tree.Call):
            self.facts.assigned.add(node.value)
        if last is None:
            self.scope.infer(node.value)
            return
        if len(node.targets) > 1 and any(target in self.facts.sets for target in node.targets):
            self.error("S1008", node.targets[0], "one of several targets is a property", "assign to it by itself")
        if node.targets[-1] in self.facts.sets and isinstance(last, RefType) and last.follows:
            self._set_reference(node, last)
            return
        self.scope.fit(node.value, last)
        for kind, value, value_kind in zip(kinds, node.targets[1:], kinds[1:], strict=False):
            if kind is not None and value_kind is not None and not assignable(value_kind, kind):
                self.error("S0301", value, f"the value is {value_kind}, but {kind} is needed here",
                           conversion_hint(value_kind, kind))

    def _set_reference(self, node: tree.Assign, taken: Type | None) -> None:
        """`block.Name := x` and `block.Name REF= x` for a property whose SET takes a REFERENCE TO: it gets one to x."""
        target = node.targets[-1]
        if isinstance(taken, RefType) and taken.follows:
            references.lend(self.scope, node.value, followed(taken), "S0301", self.scope.text(target))
            return
        if taken is not None:
            self.error("S0301", target, "REF= binds a variable that is declared REFERENCE TO",
                       f"write {self.scope.text(target)} := ...")
        self.scope.infer(node.value)

    def _attempt(self, node: tree.Assign, kinds: list[Type | None]) -> None:
        """`r ?= s`: r becomes s if the types agree, else NULL; of references to instances the program finds out which."""
        kind = self.scope.infer(node.value, kinds[-1])
        for target, wanted in zip(node.targets, kinds, strict=True):
            if wanted is None or kind is None:
                continue
            if isinstance(wanted, RefType) and wanted.interface and is_block(kind):
                if assignable(kind, wanted):
                    self.scope.fit(node.value, wanted)
                else:
                    self.facts.failed.add(target)
                continue
            if not isinstance(wanted, RefType) or not isinstance(kind, RefType):
                wrong, shown = (target, wanted) if not isinstance(wanted, RefType) else (node.value, kind)
                self.error("S0301", wrong, f"?= tries a reference, this is {shown}", "write := for values")
            elif wanted.target is not None and is_block(wanted.target) and kind.target is not None and is_block(kind.target):
                assert isinstance(wanted.target, StructType)
                self.facts.attempts[target] = wanted.target
            elif not assignable(kind, wanted):
                self.facts.failed.add(target)

    def _set_or_reset(self, node: tree.Assign, kinds: list[Type | None]) -> None:
        for target in node.targets:
            if target in self.facts.sets:
                self.error("S1008", target, f"{node.op} works on a variable, and this is a property", "write IF and :=")
        for target, kind in zip(node.targets, kinds, strict=True):
            if kind is not None and base(kind) != BOOL:
                self.error("S0301", target, f"{node.op} sets a BOOL; this is {kind}")
        self.scope.condition(node.value, node.op)

    def _call(self, node: tree.CallStatement) -> None:
        if isinstance(node.call, tree.Call):
            calls.statement(self.scope, node.call)
            return
        if isinstance(node.call, tree.StructInit):
            self.error("S0101", node.call, "the name of an instance is missing in front of `(`",
                       "write the name of the instance that is called")
            return
        if calls.action(self.scope, node.call) is not None:
            self._bare_action(node)
            return
        kind = self.scope.infer(node.call)
        if kind is not None:
            compares = isinstance(node.call, tree.Binary) and node.call.op == "="
            if self.scope.dialect.idle_statements:
                if self.scope.settle(node.call) is not None:
                    self.error("S0193", node.call, "this statement does nothing",
                               "`=` compares, `:=` assigns" if compares else "")
                return
            self.error("S0401", node.call, "this is no statement: it does nothing", ("`=` compares, `:=` assigns" if compares else
                       "write () behind an instance to call it, := to assign") + f", or take {takers('idle_statements')}")

    def _bare_action(self, node: tree.CallStatement) -> None:
        """Check an ACTION that is named without (): a call in some dialects."""
        called = tree.Call(node.call.start, node.call.end, node.call, ())
        if self.scope.dialect.bare_actions:
            self.facts.bare[node] = called
            calls.statement(self.scope, called)
            return
        text = self.scope.text(node.call)
        self.error("S0401", node.call, f"the ACTION {text} is named and not called",
                   f"write {text}(), or take {takers('bare_actions')}")

    # --- choices ----------------------------------------------------------------------------------------------------

    def _if(self, node: tree.If) -> None:
        word = self._conditional(node)
        for condition, body in node.branches:
            self.scope.condition(condition, word, statement=word == "IF")
            self.block(body)
        self.block(node.otherwise or ())

    def _conditional(self, node: tree.If) -> str:
        """The word whose condition is checked: IF, or an instruction of an instruction list."""
        text, found = self.scope.source.text, None
        if text[node.start:node.start + 2].upper() != "IF":
            found = _CONDITIONAL.search(text, text.rfind("\n", 0, node.start) + 1, node.end)
        return found[1].upper() if found else "IF"

    def _case(self, node: tree.Case) -> None:
        kind = self.scope.settle(node.selector)
        if kind is not None and not is_any(kind, "ANY_INT", "ANY_BIT", "ANY_CHARS") and not isinstance(kind, EnumType):
            self.error("S0503", node.selector,
                       f"CASE chooses by an integer, a bit string, an enumeration or a text; {kind} is none",
                       "write IF and ELSIF")
            kind = None
        taken: list[tuple[int, int]] = []
        texts: set[Value] = set()
        if isinstance(kind, StringType):
            self.facts.text_cases.add(node)
        for branch in node.branches:
            if isinstance(kind, StringType):
                for label in branch.labels:
                    self._text_label(label, kind, texts)
            elif kind is not None:
                self.facts.labels[branch] = tuple(
                    span for label in branch.labels for span in self._label(label, kind, taken))
            self.block(branch.body)
        self.block(node.otherwise or ())

    def _text_label(self, label: tuple[tree.Expr, tree.Expr | None], kind: StringType, taken: set[Value]) -> None:
        low, high = label
        if high is not None:
            self.error("S0503", low, "texts have no ranges", "write the labels one by one")
        elif self.scope.fit(low, kind, "S0503", "the label"):
            value = self.facts.constants.get(low)
            shown = self.scope.text(low)
            if not isinstance(value, bytes | str):
                self._unknown_label(low)
            elif value in taken:
                self.error("S0503", low, f"the label {shown} is taken by a label above")
            elif len(value) > kind.capacity:
                self.error("S0503", low, f"the label {shown} has {len(value)} characters and never equals a {kind}")
            else:
                taken.add(value)

    def _unknown_label(self, expr: tree.Expr) -> None:
        self.error("S0503", expr, "a label must be known before the program runs",
                   "write a literal or the name of a constant")

    def _label(self, label: tuple[tree.Expr, tree.Expr | None], kind: Type,
               taken: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """The values that a label stands for and no label above takes, as ranges; none after a diagnostic."""
        low = self._label_value(label[0], kind)
        high = self._label_value(label[1], kind) if label[1] is not None else low
        if low is None or high is None:
            return []
        if low > high:
            self.error("S0503", label[0], f"the range {low}..{high} is empty", f"write {high}..{low}")
            return []
        free = _untaken(taken, low, high)
        if _take(taken, low, high):
            shown = f"{low}" if low == high else f"{low}..{high}"
            if self.scope.dialect.first_label_counts:
                self.error("S0193", label[0], f"the label {shown} is taken by a label above, which counts")
            else:
                self.error("S0503", label[0], f"the label {shown} is taken by a label above",
                           f"take it out, or take {takers('first_label_counts')}, where the first one counts")
        return free

    def _label_value(self, expr: tree.Expr, kind: Type) -> int | None:
        if not self.scope.fit(expr, kind, "S0503", "the label"):
            return None
        value = self.facts.constants.get(expr)
        if value is None or not isinstance(value, int):
            self._unknown_label(expr)
            return None
        return int(value)

    # --- loops ------------------------------------------------------------------------------------------------------

    def _for(self, node: tree.For) -> None:
        kind = self.target(node.variable, "count a loop")
        if kind is not None and not is_any(as_number(kind, self.scope.dialect), "ANY_INT"):
            self.error("S0504", node.variable, f"FOR counts with an integer, not with {kind}")
            kind = None
        for part, role in ((node.first, "the first value"), (node.last, "the last value"), (node.step, "the step")):
            if part is None:
                continue
            if kind is None:
                self.scope.infer(part)
            elif role == "the step":
                self._step(part, kind)
            else:
                self.scope.fit(part, base(kind), "S0504", role)
        self.scope.counters.append(place(self.facts, node.variable) or () if kind is not None else ())
        self._body(node.body)
        self.scope.counters.pop()

    def _step(self, expr: tree.Expr, kind: Type) -> None:
        """A step may be negative where the variable may not: it is then a literal of type LINT or smaller."""
        if self.scope.infer(expr) is None:
            return
        value = self.facts.constants.get(expr)
        if value == 0:
            self.error("S0504", expr, "a step of 0 never ends the loop")
        elif isinstance(value, int) and value < 0 and not isinstance(value, bool):
            self.scope.settle(expr)
        else:
            self.scope.fit(expr, base(kind), "S0504", "the step")

    def _body(self, statements: tree.Block) -> None:
        self._loops += 1
        self.block(statements)
        self._loops -= 1

    def _while(self, node: tree.While) -> None:
        self.scope.condition(node.condition, "WHILE", statement=True)
        self._body(node.body)

    def _repeat(self, node: tree.Repeat) -> None:
        self._body(node.body)
        self.scope.condition(node.until, "UNTIL", statement=True)

    def _try(self, node: tree.Try) -> None:
        self.block(node.body)
        wanted = self.scope.context.exception_codes()
        kind = self.target(node.code) if node.code is not None else None
        if node.code is not None and kind is not None and kind is not wanted:
            self.error("S0301", node.code, f"__CATCH gives an {wanted}, and this is {kind}",
                       f"declare it as __SYSTEM.{wanted}")
        self.block(node.handler)
        self.block(node.final or ())

    def _leave(self, node: tree.Exit | tree.Continue) -> None:
        if not self._loops:
            word = "EXIT" if isinstance(node, tree.Exit) else "CONTINUE"
            self.error("S0502", node, f"{word} stands outside a loop", "RETURN leaves the POU")

    def _return(self, node: tree.Return) -> None:
        if node.value is None:
            return
        is_enclosed = isinstance(node.value, tree.StructInit) or _is_enclosed(self.scope.source.text, node)
        if self.scope.dialect.conditional_returns and is_enclosed:
            self.scope.facts.conditional.add(node)
            self.scope.condition(node.value, "RETURN")
            return
        if self.pou.result is None:
            self.error("S0409", node.value, f"{self.pou.name} has no result to return")
            return
        self.scope.fit(node.value, self.pou.result.type)

    def _rungs(self, node: ladder.Ladder | ladder.Rung | il.InstructionList) -> None:
        self.block(node.body)

    def _sfc(self, node: sfc.Sfc) -> None:
        if charts.check(self.scope, self.pou.owner, node):
            self.block(node.body)

    def _empty(self, node: tree.Empty) -> None:
        """`;` is always correct."""

    def _refused(self, node: tree.RefusedStatement) -> None:
        self.scope.project.report.refuse(self.pou.source, node)


_CHECK: dict[type, Callable[..., None]] = {
    tree.Assign: _Statements._assign, tree.CallStatement: _Statements._call, tree.If: _Statements._if,
    tree.Case: _Statements._case, tree.For: _Statements._for, tree.While: _Statements._while,
    tree.Repeat: _Statements._repeat, tree.Try: _Statements._try,
    tree.Exit: _Statements._leave, tree.Continue: _Statements._leave,
    il.InstructionList: _Statements._rungs,
    ladder.Ladder: _Statements._rungs, ladder.Rung: _Statements._rungs, sfc.Sfc: _Statements._sfc,
    tree.Return: _Statements._return, tree.Empty: _Statements._empty, tree.RefusedStatement: _Statements._refused,
}


_PARENTHESES = re.compile(r"""\(\*.*?\*\)|//[^\n]*|'(?:\$.|[^$'])*'|"(?:\$.|[^$"])*"|[();]""", re.S)
"""Parentheses and ends of statements, and comments and texts as wholes, in which these say nothing."""
_CONDITIONAL = re.compile(r"(?im)^(?:[ \t]*\w+[ \t]*:)?[ \t]*((?:JMP|CAL|RET)CN?)\b")
"""An instruction that is executed if the current result is TRUE or FALSE."""


def _untaken(taken: list[tuple[int, int]], low: int, high: int) -> list[tuple[int, int]]:
    """The parts of low..high that are in none of the ranges `taken`, which are sorted and apart."""
    free: list[tuple[int, int]] = []
    for first, last in taken[bisect_left(taken, low, key=lambda span: span[1]):]:
        if first > high:
            break
        if low < first:
            free.append((low, first - 1))
        low = last + 1
    return [*free, (low, high)] if low <= high else free


def _take(taken: list[tuple[int, int]], low: int, high: int) -> bool:
    """Adds low..high to the labels taken, which stay sorted and apart; True if any of them was taken before."""
    start = bisect_left(taken, low, key=lambda span: span[1])
    end = bisect_right(taken, high, key=lambda span: span[0])
    met = taken[start:end]
    taken[start:end] = [(min(low, met[0][0]), max(high, met[-1][1])) if met else (low, high)]
    return bool(met)
