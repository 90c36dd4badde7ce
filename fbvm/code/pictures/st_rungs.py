"""Statements of Structured Text as rungs: boolean assignments and calls of blocks as contacts, coils and boxes.

The statement is executed as ever.  Its rung says which part of it each step shows, so that lowering can observe the value of that
part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fbvm.base.types import BOOL
from fbvm.check.symbols.facts import Facts, PouCall
from fbvm.syntax import tree
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Contact, Parallel, Pin, Point, Series, StepText, Undrawable, diagram
from fbvm.syntax.ladder.drawing.steps import steps

COMPARISONS = {"=": "<>", "<>": "=", "<": ">=", ">=": "<", ">": "<=", "<=": ">"}
"""Comparisons and their negations."""
MOST_CONTACTS = 60
"""Contacts of one rung; each XOR doubles those of its operands."""
_CHAINS = {"AND": False, "AND_THEN": False, "OR": True, "OR_ELSE": True}
"""Operators that join contacts: True for branches side by side, False for one behind the other."""
_COILS = {":=": " ", "S=": "S", "R=": "R"}
"""Signs of assignments, and the marks of coils that do the same."""
_LEAVES = (tree.NameRef, tree.Member, tree.Index, tree.Direct, tree.Part, tree.Literal, tree.Deref)
_NAMES = {"If": "IF", "For": "FOR", "While": "WHILE", "Repeat": "REPEAT", "Case": "CASE", "Try": "__TRY", "Return": "RETURN",
          "Exit": "EXIT", "Assign": "this assignment", "CallStatement": "this call"}


class NoRung(Exception):
    """A statement cannot be drawn as a rung; the argument names what is not drawn."""


class Mark(NamedTuple):
    """A step that shows the value of an expression, negated if it is drawn so."""

    step: int
    negated: bool


class StRung(NamedTuple):
    """The steps of a statement, each with the part that it shows, and by expression the steps that show its value."""

    steps: list[tuple[tree.Node | None, StepText]]
    marks: dict[tree.Expr, list[Mark]]


def with_coils(statements: Sequence[tree.Statement]) -> list[list[tree.Statement]]:
    """Statements in groups, each of which is a rung: one that keeps the current result of an instruction list, with those behind
    it that store this."""
    groups: list[list[tree.Statement]] = []
    for statement in statements:
        first = groups[-1][0] if groups else None
        if first is not None and isinstance(statement, tree.Assign) and _keeps(first) == _stored_result(statement.value) != "":
            groups[-1].append(statement)
        else:
            groups.append([statement])
    return groups


def _keeps(statement: tree.Statement) -> str:
    """The hidden variable in which a statement keeps the current result; "" if it keeps none."""
    name = _text_of(statement.targets[0]) if isinstance(statement, tree.Assign) and len(statement.targets) == 1 else ""
    return name if name.startswith("$CR") else ""


def _stored_result(value: tree.Expr) -> str:
    """The variable that is stored, as it is or inverted."""
    return _text_of(value.operand if isinstance(value, tree.Unary) and value.op == "NOT" else value)


def _text_of(expr: tree.Expr) -> str:
    return expr.text if isinstance(expr, tree.NameRef) else ""


def st_rung(statement: tree.Statement, facts: Facts, text: str, coils: Sequence[tree.Statement] = ()) -> StRung:
    """A statement as a rung.

    statement: a statement that the checker has found right.
    coils: assignments of what it keeps, if it keeps the current result of an instruction list.
    facts: what the checker found out about it.
    text: the source text, of which operands are shown as they are written.

    Raises NoRung if it cannot be drawn."""
    reader = _Reader(facts, text)
    try:
        made = reader.rung(statement, coils)
        diagram([step for _, step in made.steps])
    except Undrawable:
        raise NoRung(_NAMES.get(type(statement).__name__, "this statement")) from None
    return made


class _Reader:
    def __init__(self, facts: Facts, text: str) -> None:
        self.facts, self.text = facts, text
        self.shown: dict[int, tuple[tree.Expr, bool]] = {}
        """By identity of a contact, coil or box the expression whose value it shows, and whether negated."""

    def rung(self, statement: tree.Statement, coils: Sequence[tree.Statement]) -> StRung:
        bar = Point(Series(), [self._stored(statement, coils) if coils else self._point(statement)])
        coded = steps(bar)
        marks: dict[tree.Expr, list[Mark]] = {}
        for number, step in enumerate(coded):
            shown = self.shown.get(id(step.drawn))
            if shown:
                marks.setdefault(shown[0], []).append(Mark(number, shown[1]))
        return StRung([(shown[0] if (shown := self.shown.get(id(step.drawn))) else None, step[:3]) for step in coded], marks)

    def _point(self, statement: tree.Statement) -> Point | Box:
        """What stands between the bars: contacts and what they act on, or a box alone."""
        if isinstance(statement, tree.Assign):
            return self._assignment(statement)
        if isinstance(statement, tree.If):
            return self._setting(statement)
        if isinstance(statement, tree.CallStatement) and isinstance(statement.call, tree.Call):
            return self._call(statement.call)
        raise NoRung(_NAMES.get(type(statement).__name__, "this statement"))

    def _stored(self, statement: tree.Statement, coils: Sequence[tree.Statement]) -> Point:
        """Contacts with several coils: what is kept, and the assignments of it."""
        assert isinstance(statement, tree.Assign)
        outs: list[Coil | Box | Point] = []
        for each in coils:
            assert isinstance(each, tree.Assign)
            if each.op not in _COILS or any(self.facts.types.get(target) != BOOL for target in each.targets):
                raise NoRung("an assignment that is not of BOOL")
            mark = "/" if isinstance(each.value, tree.Unary) else _COILS[each.op]
            outs += [self._coil(mark, target, statement.value) for target in each.targets]
        return Point(self.condition(statement.value), outs)

    # --- statements -------------------------------------------------------------------------------------------------

    def _assignment(self, node: tree.Assign) -> Point:
        self._refuse_hidden(node)
        if node.op not in _COILS or any(self.facts.types.get(part) != BOOL for part in (*node.targets, node.value)):
            raise NoRung("an assignment that is not of BOOL")
        return Point(self.condition(node.value), [self._coil(_COILS[node.op], target, node.value) for target in node.targets])

    def _refuse_hidden(self, node: tree.Assign) -> None:
        """Raises NoRung, with the reason, for an assignment to a variable that is not written."""
        for target in node.targets:
            self.written(target)

    def _coil(self, mark: str, target: tree.Expr, power: tree.Expr) -> Coil:
        coil = Coil(-1, mark, (self.written(target),))
        self.shown[id(coil)] = power, False
        return coil

    def _setting(self, node: tree.If) -> Point:
        """IF c THEN x := TRUE; y := FALSE; END_IF: contacts in front of coils that set and reset."""
        (condition, body), *more = node.branches
        outs: list[Coil | Box | Point] = []
        for inner in body:
            if isinstance(inner, tree.Assign):
                self._refuse_hidden(inner)
            if not isinstance(inner, tree.Assign) or inner.op != ":=" or not isinstance(inner.value, tree.Literal) or \
                    self.facts.types.get(inner.value) != BOOL:
                raise NoRung("an IF that does more than setting and resetting")
            outs += [self._coil("S" if inner.value.value else "R", target, condition) for target in inner.targets]
        if more or node.otherwise or not outs:
            raise NoRung("an IF with ELSE" if outs else "an empty IF")
        return Point(self.condition(condition), outs)

    def _call(self, call: tree.Call) -> Point | Box:
        called = self.facts.calls.get(call)
        if not isinstance(called, PouCall) or called.instance is None or called.pou.kind != "FUNCTION_BLOCK":
            raise NoRung("a call that is none of a function block")
        given = [(variable.name, value) for variable, value in called.inputs]
        given += [("EN", called.enable)] if called.enable is not None else []
        entries: list[tuple[str, tree.Expr, Series]] = []
        pins: list[Pin] = []
        for name, value in sorted(given, key=lambda pair: pair[1].start):
            if self.facts.types.get(value) == BOOL and not isinstance(value, tree.Literal) and (path := self._path(value)):
                entries.append((name, value, path))
            else:
                pins.append(Pin(name, self.written(value)))
        pins += [Pin(variable.name, self.written(value)) for variable, value in called.in_outs]
        pins += [Pin(variable.name, self.written(value), True) for variable, value, _ in called.outputs]
        box = Box(-1, called.pou.name, (), tuple(path for _, _, path in entries[1:]), False, self.written(called.instance),
                  tuple(pins), tuple(name for name, _, _ in entries))
        if not entries:
            return box
        self.shown[id(box)] = entries[0][1], False
        return Point(entries[0][2], [box])

    def _path(self, value: tree.Expr) -> Series | None:
        try:
            return self.condition(value)
        except NoRung:
            return None

    # --- conditions -------------------------------------------------------------------------------------------------

    def condition(self, expr: tree.Expr) -> Series:
        """An expression of BOOL as contacts.  Raises NoRung if it has too many, or anything else in it."""
        made = self._contacts(expr, False)
        if _count(made) > MOST_CONTACTS:
            raise NoRung(f"an expression of more than {MOST_CONTACTS} contacts")
        return made

    def _contacts(self, expr: tree.Expr, negated: bool) -> Series:
        if self.facts.types.get(expr) != BOOL:
            raise NoRung("an expression that is not of BOOL")
        if isinstance(expr, tree.Unary) and expr.op == "NOT":
            return self._contacts(expr.operand, not negated)
        if isinstance(expr, tree.Binary):
            return self._binary(expr, negated)
        if not isinstance(expr, _LEAVES):
            raise NoRung("a call in an expression" if isinstance(expr, tree.Call) else "this expression")
        return self._leaf(expr, "/" if negated else " ", (self.written(expr),), negated)

    def _binary(self, expr: tree.Binary, negated: bool) -> Series:
        if expr.op in _CHAINS:
            left, right = self._contacts(expr.left, negated), self._contacts(expr.right, negated)
            return _branches(left, right) if _CHAINS[expr.op] != negated else Series([*left.parts, *right.parts])
        of_bools = self.facts.types.get(expr.left) == BOOL and self.facts.types.get(expr.right) == BOOL
        if expr.op in ("XOR", "=", "<>") and of_bools:
            unequal = (expr.op == "=") == negated
            both = [Series([*self._contacts(expr.left, first).parts, *self._contacts(expr.right, first != unequal).parts])
                    for first in (False, True)]
            return _branches(*both)
        mark = COMPARISONS[expr.op] if negated else expr.op
        return self._leaf(expr, mark, (self.written(expr.left), self.written(expr.right)), negated)

    def _leaf(self, expr: tree.Expr, mark: str, operands: tuple[str, ...], negated: bool) -> Series:
        contact = Contact(-1, mark, operands)
        self.shown[id(contact)] = expr, negated
        return Series([contact])

    def written(self, expr: tree.Node) -> str:
        """An expression as it is written, on one line.  Raises NoRung for a variable that is not written: jumps and current
        results have such."""
        if isinstance(expr, tree.NameRef) and self.text[expr.start:expr.end].upper() != expr.text.upper():
            raise NoRung("a jump, or a current result that is used again")
        return " ".join(self.text[expr.start:expr.end].split())


def _branches(left: Series, right: Series) -> Series:
    """Two paths as branches; a path that consists of branches only adds these."""
    made: list[Series] = []
    for path in (left, right):
        first = path.parts[0]
        made += first.branches if len(path.parts) == 1 and isinstance(first, Parallel) else [path]
    return Series([Parallel(made)])


def _count(path: Series) -> int:
    return sum(sum(map(_count, part.branches)) if isinstance(part, Parallel) else 1 for part in path.parts)
