"""Steps and transitions to statements: what one call of a chart does (IEC 61131-3, 6.7.5 and 6.7.6).

In this order: times of active steps; conditions of the transitions that are enabled, on the steps as the call found them;
all that fire, at once; the control of every action; BOOL variables that are actions; the ACTIONs that are to run.  A step
is active for one call at least.  The first call activates the initial steps and tests no transition.

Statements without extent in the text are those that nobody wrote: who looks statement by statement is not shown them.  What
is shown is the chart, where it begins; each transition that is tested; the step behind it, if it fires; what actions do.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.sfc.flags import steered
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Expr, Name, NameRef, Statement, VarDecl, VarSection
from fbvm.syntax.tree.ladder import Element
from fbvm.syntax.tree.node import walk
from fbvm.syntax.tree.sfc import Association, Sfc, Step, Transition

CONTROL = "SFC_ACTION_CONTROL"
"""The block that decides when an action is executed, in `fblib/iec` and, where a dialect has another answer, there."""
STEP_FLAGS = (("X", "BOOL"), ("T", "TIME"))
ACTION_FLAGS = (("Q", "BOOL"), ("A", "BOOL"))
PULSES = ("P", "P0", "P1")
Used = list[tuple[Step, Association]]


class Evolution:
    """Writes the statements of one chart.  They are placed `at` the element that they come from."""

    def __init__(self, builder: Expressions, steps: Sequence[Step], transitions: Sequence[Transition],
                 actions: Iterable[tree.Action], inside: tree.Action | None, flags: frozenset[str] = frozenset()) -> None:
        """`inside` is the action that the chart is the body of; `flags` are those of CODESYS that the POU declares."""
        self.builder = builder
        self.steps = steps
        self.transitions = transitions
        self.actions = {fold(action.name.text): action for action in actions}
        self.named = {fold(step.name.text): step for step in steps}
        self.inside = inside.name.text if inside is not None else "chart"
        self.flags = flags if inside is None else frozenset()
        self.is_called_often = inside is not None
        self.at = self.start = self.end = 0
        self.shown: dict[str, str] = {}
        """Names of actions as they are written first."""
        self.kept: dict[str, VarDecl] = {}
        self.temporaries: dict[str, VarDecl] = {}

    def sfc(self, start: int, end: int, sound: bool) -> Sfc:
        """The chart with its statements; one that is not `sound` has none."""
        used = self._used()
        self.start, self.end = start, end
        self.at = start
        body: tree.Block = () if not sound else (
            *self._fresh(), self._begun_or_evolved(), *map(self._commit, self.steps),
            *self._controls(used), *self.variables(used),
            *(statement for name, action in self.actions.items() if name in used for statement in self._run(action)))
        if sound and self.flags:
            self.at = start
            body = steered(self, body, used)
        sections = (self._section("VAR", [_flags(step.name, STEP_FLAGS) for step in self.steps], "step"),
                    self._section("VAR", list(self.kept.values())), self._section("VAR_TEMP", list(self.temporaries.values())))
        return Sfc(start, end, tuple(self.steps), tuple(self.transitions), body, sections)

    def _used(self) -> dict[str, Used]:
        """The associations of each action, actions in the order of their first one."""
        used: dict[str, Used] = {}
        for step in self.steps:
            for association in step.associations:
                used.setdefault(fold(association.action.text), []).append((step, association))
        return used

    # --- steps and transitions --------------------------------------------------------------------------------------

    def _fresh(self) -> Iterable[Statement]:
        """In an action, which may be called several times in one call of its POU: nothing is entered or left yet."""
        if self.is_called_often:
            for step in self.steps:
                yield from (self.put(self._entered(step), False), self.put(self.left(step), False))

    @property
    def begun(self) -> NameRef:
        """Whether the initial steps were activated."""
        return self._keep(f"${self.inside} begun", "BOOL")

    def _begun_or_evolved(self) -> Statement:
        begun = self.begun
        evolved = (*map(self._time, self.steps), *self._tested())
        first = (self.put(begun, True), *(self.put(self._entered(s), True) for s in self.steps if s.initial))
        return self.when(begun, evolved, first)

    def _time(self, step: Step) -> Statement:
        self.at = step.start
        passed = self._binary("-", self._now(), self._since(step))
        return self.when(self.flag(step.name, "X"), (self.assign(self.flag(step.name, "T"), passed),))

    def _tested(self) -> list[Statement]:
        """The transitions, those first that go first where several are enabled by one step."""
        order = sorted(self.transitions, key=lambda t: (t.priority is None, t.priority or 0))
        taken: set[str] = set()
        made = []
        for transition in order:
            made.append(self._transition(transition, taken))
            taken.update(fold(name.text) for name in transition.sources)
        return made

    def _transition(self, transition: Transition, taken: set[str]) -> Statement:
        """Test a transition if it is enabled: if all steps before it are active, and none is left by another one."""
        self.at = transition.start
        steps = [self.named[fold(name.text)] for name in transition.sources]
        enabled = [self.flag(step.name, "X") for step in steps]
        enabled += [self.negated(self.left(step)) for step in steps if fold(step.name.text) in taken]
        seen = Element(self.at, transition.end, self.transitions.index(transition), transition.condition)
        first, *others = (self._entered(self.named[fold(name.text)]) for name in transition.targets)
        begin = tree.Assign(transition.targets[0].start, transition.targets[0].end, (first,), ":=", self.truth(True))
        fires = (begin, *(self.put(step, True) for step in (*others, *map(self.left, steps))))
        tested = tree.If(transition.start, transition.end, ((seen, fires),), tuple(self._waits(transition)) or None)
        if transition.body is not None and transition.name is not None:
            self._temporary(transition.name.text)
        return self.when(self._all(enabled), (*(transition.body or ()), tested))

    def _waits(self, transition: Transition) -> Iterable[Statement]:
        """For `step.T >= duration`: when that may become true by itself."""
        for node in walk(transition.condition):
            if isinstance(node, tree.Binary) and node.op in (">", ">=") and isinstance(node.right, tree.Literal | NameRef) \
                    and isinstance(node.left, tree.Member) and isinstance(node.left.of, NameRef) \
                    and fold(node.left.name.text) == "T" and fold(node.left.of.text) in self.named:
                yield self._due(self.named[fold(node.left.of.text)], node.right)

    def _commit(self, step: Step) -> Statement:
        """Enter or leave a step; one that is left and entered at once begins anew."""
        self.at = step.start
        active = self.flag(step.name, "X")
        enter = (self.put(active, True), self.assign(self.flag(step.name, "T"), self._duration()),
                 self.assign(self._since(step), self._now()))
        branches = (self._entered(step), enter), (self.left(step), (self.put(active, False),))
        return tree.If(self.at, self.at, branches, None)

    # --- actions ----------------------------------------------------------------------------------------------------

    def _controls(self, used: dict[str, Used]) -> Iterable[Statement]:
        for name, pairs in used.items():
            self.at = pairs[0][1].start
            yield from self._dues(pairs)
            inputs = self._inputs(pairs, name in self.actions)
            arguments = tuple(tree.Argument(self.at, self.at, ":=", Name(self.at, self.at, pin), value)
                              for pin, value in inputs.items())
            control = self._control(pairs[0][1].action)
            yield tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, control, arguments))

    def _inputs(self, pairs: Used, coded: bool) -> dict[str, Expr]:
        """What enters the control of an action.  L and D are N while their time says so; for a variable each pulse is one
        call long."""
        wanted: dict[str, list[Expr]] = {}
        times: dict[str, list[tuple[Expr, Expr]]] = {}
        for step, association in pairs:
            self.at = association.start
            qualifier, time = association.qualifier, association.time
            pin = {"L": "N", "D": "N"}.get(qualifier, qualifier if coded or qualifier not in PULSES else "P")
            wanted.setdefault(pin, []).append(self._term(step, association))
            if time is not None and qualifier in ("SD", "SL"):
                times.setdefault(f"{pin}_T", []).append((self.flag(step.name, "X"), time))
        inputs = {pin: self.joined("OR", terms) for pin, terms in wanted.items()}
        for pin, choices in times.items():
            *rest, (_, value) = choices
            for active, time in reversed(rest):
                value = self.function("SEL", active, value, time)
            inputs[pin] = value
        return inputs

    def _term(self, step: Step, association: Association) -> Expr:
        """What one association contributes."""
        qualifier, time = association.qualifier, association.time
        if qualifier in PULSES:
            return self.left(step) if qualifier == "P0" else self._entered(step)
        active = self.flag(step.name, "X")
        if qualifier not in ("L", "D", "DS") or time is None:
            return active
        return self._all([active, self._binary("<" if qualifier == "L" else ">=", self.flag(step.name, "T"), time)])

    def _dues(self, pairs: Used) -> Iterable[Statement]:
        """When L, D and DS change by themselves."""
        for step, association in pairs:
            if association.time is not None and association.qualifier in ("L", "D", "DS"):
                self.at = association.start
                waits = self._binary("<", self.flag(step.name, "T"), association.time)
                yield self.when(self._all([self.flag(step.name, "X"), waits]), (self._due(step, association.time),))

    def begin_again(self, used: Used) -> Iterable[Statement]:
        """Let go of an action, whatever was stored of it."""
        name = used[0][1].action
        held = tree.Argument(self.at, self.at, ":=", Name(self.at, self.at, "R"), self.truth(True))
        yield tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, self._control(name), (held,)))
        yield self.put(self._member(self._control(name), "R"), False)
        if fold(name.text) in self.actions:
            yield from (self.put(self.flag(name, flag), False) for flag, _ in ACTION_FLAGS)

    def variables(self, used: dict[str, Used]) -> Iterable[Statement]:
        for name, pairs in used.items():
            if name not in self.actions:
                action = pairs[0][1].action
                self.at = action.start
                yield self.assign(NameRef(action.start, action.end, action.text), self._member(self._control(action), "Q"))

    def _run(self, action: tree.Action) -> Iterable[Statement]:
        self.at = action.start
        for flag, _ in ACTION_FLAGS:
            yield self.assign(self.flag(action.name, flag), self._member(self._control(action.name), flag))
        call = tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, self.name(action.name.text), ()))
        yield self.when(self.flag(action.name, "A"), (call,))

    # --- variables --------------------------------------------------------------------------------------------------

    def _section(self, kind: str, variables: list[VarDecl], role: str = "") -> VarSection:
        return VarSection(self.start, self.end, kind, (), tuple(variables), True, role)

    def _keep(self, name: str, kind: str) -> NameRef:
        if name not in self.kept:
            self.kept[name] = _declared(Name(self.at, self.at, name), kind)
        return self.name(name)

    def _temporary(self, name: str) -> NameRef:
        if name not in self.temporaries:
            self.temporaries[name] = _declared(Name(self.at, self.at, name), "BOOL")
        return self.name(name)

    def _since(self, step: Step) -> NameRef:
        return self._keep(f"${step.name.text} since", "TIME")

    def _entered(self, step: Step) -> NameRef:
        return self._temporary(f"${step.name.text} entered")

    def left(self, step: Step) -> NameRef:
        return self._temporary(f"${step.name.text} left")

    def _control(self, action: Name) -> NameRef:
        return self._keep(f"${self.shown.setdefault(fold(action.text), action.text)} control", CONTROL)

    # --- statements and expressions ---------------------------------------------------------------------------------

    def name(self, text: str) -> NameRef:
        return NameRef(self.at, self.at, text)

    def _member(self, of: Expr, name: str) -> Expr:
        return tree.Member(self.at, self.at, of, Name(self.at, self.at, name))

    def flag(self, name: Name, flag: str) -> Expr:
        return self._member(self.name(name.text), flag)

    def when(self, condition: Expr, then: Iterable[Statement], otherwise: Iterable[Statement] = ()) -> Statement:
        return tree.If(self.at, self.at, ((condition, tuple(then)),), tuple(otherwise) or None)

    def assign(self, target: Expr, value: Expr) -> Statement:
        return tree.Assign(self.at, self.at, (target,), ":=", value)

    def put(self, target: Expr, value: bool) -> Statement:
        return self.assign(target, self.truth(value))

    def truth(self, value: bool) -> Expr:
        return tree.Literal(self.at, self.at, "bool", value, None, "TRUE" if value else "FALSE")

    def negated(self, value: Expr) -> Expr:
        return tree.Unary(self.at, self.at, "NOT", value)

    def _binary(self, operator: str, left: Expr, right: Expr) -> Expr:
        return tree.Binary(self.at, self.at, operator, left, right, self.at)

    def _all(self, parts: list[Expr]) -> Expr:
        return self.joined("AND", parts)

    def joined(self, operator: str, parts: list[Expr]) -> Expr:
        """A tree that is no deeper than needed: a step may have hundreds of associations."""
        if len(parts) == 1:
            return parts[0]
        half = len(parts) // 2
        return self._binary(operator, self.joined(operator, parts[:half]), self.joined(operator, parts[half:]))

    def _duration(self) -> Expr:
        return self.builder.typed_literal(Token("TYPED_LITERAL", "T#0s", self.at, self.at))

    def function(self, name: str, *values: Expr) -> Expr:
        arguments = tuple(tree.Argument(value.start, value.end, "", None, value) for value in values)
        return tree.Call(self.at, self.at, self.name(name), arguments)

    def _now(self) -> Expr:
        return self.function("TIME")

    def _due(self, step: Step, after: Expr) -> Statement:
        moment = self._binary("+", self._since(step), after)
        return tree.CallStatement(self.at, self.at, self.function("__DUE", moment))


def action_flags(start: int, end: int, actions: Iterable[tree.Action]) -> VarSection:
    """The flags of all actions of a POU with charts."""
    flags = tuple(_flags(action.name, ACTION_FLAGS) for action in actions)
    return VarSection(start, end, "VAR", (), flags, True, "action")


def _flags(name: Name, members: Iterable[tuple[str, str]]) -> VarDecl:
    """The variable that has the name of a step or action."""
    fields = tuple(_declared(Name(name.start, name.end, field), kind) for field, kind in members)
    return VarDecl(name.start, name.end, (name,), None, tree.StructSpec(name.start, name.end, fields), None)


def _declared(name: Name, kind: str) -> VarDecl:
    return VarDecl(name.start, name.end, (name,), None, tree.NamedType(name.start, name.end, kind), None)
