"""Steps and transitions to statements: what one call of a chart does (IEC 61131-3, 6.7.5 and 6.7.6).

A call does in this order: it updates the times of active steps; tests the transitions that were enabled when the call began;
fires all whose conditions are TRUE, at once; calls the control of every action; assigns the BOOL variables that are
actions; runs the ACTIONs that are active.  A step is active for one call at least.  The first call activates the initial
steps and tests no transition.

Stepping and tracing stop at statements that have an extent in the text: the chart, where it begins; each transition that is
tested; the step that follows a transition that fires; the statements of actions.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.sfc.context import ACTION_FLAGS, Associations, ChartContext, flags_variable
from fbvm.syntax.sfc.flags import with_flags
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.tree import Expr, Name, NameRef, Statement, VarSection
from fbvm.syntax.tree.ladder import Element
from fbvm.syntax.tree.node import walk
from fbvm.syntax.tree.sfc import Association, Sfc, Step, Transition

STEP_FLAGS = (("X", "BOOL"), ("T", "TIME"))
"""The flags of a step, with their types."""
PULSES = ("P", "P0", "P1")
"""Qualifiers of actions that are executed when a step is entered or left."""


class ChartLowering(ChartContext):
    """Writes the statements of one chart."""

    def __init__(self, builder: Expressions, steps: Sequence[Step], transitions: Sequence[Transition],
                 actions: Iterable[tree.Action], inside: tree.Action | None, flags: frozenset[str], controls: dict[str, str],
                 elsewhere: dict[str, Associations]) -> None:
        """As ChartContext, with the transitions of the chart, and the associations of other charts of the POU by folded name of
        the BOOL variable that is their action."""
        super().__init__(builder, steps, actions, inside, flags, controls)
        self.transitions = transitions
        self.elsewhere = elsewhere
        self.named = {fold(step.name.text): step for step in steps}
        self.is_called_often = inside is not None

    def sfc(self, start: int, end: int, sound: bool) -> Sfc:
        """The node of the chart that stands from `start` to `end`; a chart that is not `sound` has no statements."""
        used = self._associations()
        self.at = start
        body: tree.Block = () if not sound else (
            *self._clear_transients(), self._begin_or_proceed(), *map(self._activate, self.steps),
            *self._call_controls(used), *self.assign_variables(used),
            *(statement for name, action in self.actions.items() if name in used for statement in self._run(action)))
        if sound and self.flags:
            self.at = start
            body = with_flags(self, body, used)
        flags = [flags_variable(step.name, STEP_FLAGS) for step in self.steps]
        declared = (("VAR", flags, "step"), ("VAR", self.kept.values(), ""), ("VAR_TEMP", self.temporaries.values(), ""))
        sections = tuple(VarSection(start, end, kind, (), tuple(variables), True, role) for kind, variables, role in declared)
        return Sfc(start, end, tuple(self.steps), tuple(self.transitions), body, sections)

    def _associations(self) -> dict[str, Associations]:
        """By folded name of each action, its associations; actions in the order of their first association."""
        used: dict[str, Associations] = {}
        for step in self.steps:
            for association in step.associations:
                used.setdefault(fold(association.action.text), []).append((step, association))
        return used

    # --- steps and transitions ---

    def _clear_transients(self) -> Iterable[Statement]:
        """Set back which steps were entered and left, if the chart is the body of an action: it may be called several times in
        one call of its POU, during which temporaries keep their values."""
        if self.is_called_often:
            for step in self.steps:
                yield from (self.put(self.entered(step), False), self.put(self.exited(step), False))

    def _begin_or_proceed(self) -> Statement:
        begun = self.begun
        proceed = (*map(self._update_time, self.steps), *self._test_all())
        first = (self.put(begun, True), *(self.put(self.entered(s), True) for s in self.steps if s.initial))
        return self.when(begun, proceed, first)

    def _update_time(self, step: Step) -> Statement:
        self.at = step.start
        passed = self.binary("-", self.now(), self.since(step))
        return self.when(self.flag(step.name, "X"), (self.assign(self.flag(step.name, "T"), passed),))

    def _test_all(self) -> list[Statement]:
        """Test the transitions by priority, so that of several that leave one step the first whose condition is TRUE fires."""
        order = sorted(self.transitions, key=lambda t: (t.priority is None, t.priority or 0))
        taken: set[str] = set()
        made = []
        for transition in order:
            made.append(self._test(transition, taken))
            taken.update(fold(name.text) for name in transition.sources)
        return made

    def _test(self, transition: Transition, taken: set[str]) -> Statement:
        """Test a transition if it is enabled: if all its source steps are active and no transition tested before leaves one of
        them.  `taken` are folded names of steps that transitions tested before leave."""
        self.at = transition.start
        steps = [self.named[fold(name.text)] for name in transition.sources]
        enabled = [self.flag(step.name, "X") for step in steps]
        enabled += [self.negated(self.exited(step)) for step in steps if fold(step.name.text) in taken]
        seen = Element(self.at, transition.end, self.transitions.index(transition), transition.condition)
        first, *others = (self.entered(self.named[fold(name.text)]) for name in transition.targets)
        begin = tree.Assign(transition.targets[0].start, transition.targets[0].end, (first,), ":=", self.truth(True))
        fires = (begin, *(self.put(step, True) for step in (*others, *map(self.exited, steps))))
        tested = tree.If(transition.start, transition.end, ((seen, fires),), tuple(self._wake_for_condition(transition)) or None)
        named = transition.name
        if named is not None and transition.body is not None and isinstance(transition.condition, NameRef) \
                and transition.condition.start == named.start:
            self.temporary(named.text)
        return self.when(self.join("AND", enabled), (*(transition.body or ()), tested))

    def _wake_for_condition(self, transition: Transition) -> Iterable[Statement]:
        """For `step.T >= duration` in a condition: ask for a scan when that becomes TRUE by the passing of time."""
        for node in walk(transition.condition):
            if isinstance(node, tree.Binary) and node.op in (">", ">=") and isinstance(node.right, tree.Literal | NameRef) \
                    and isinstance(node.left, tree.Member) and isinstance(node.left.of, NameRef) \
                    and fold(node.left.name.text) == "T" and fold(node.left.of.text) in self.named:
                yield self.wake_at(self.named[fold(node.left.of.text)], node.right)

    def _activate(self, step: Step) -> Statement:
        """Activate or deactivate a step by the transitions that have fired; one that is left and entered at once begins anew."""
        self.at = step.start
        active = self.flag(step.name, "X")
        enter = (self.put(active, True), self.assign(self.flag(step.name, "T"), self.no_time()),
                 self.assign(self.since(step), self.now()))
        branches = (self.entered(step), enter), (self.exited(step), (self.put(active, False),))
        return tree.If(self.at, self.at, branches, None)

    # --- actions ---

    def _call_controls(self, used: dict[str, Associations]) -> Iterable[Statement]:
        for name, pairs in used.items():
            self.at = pairs[0][1].start
            yield from self._wake_for_actions(pairs)
            lasting = [pair for pair in self.elsewhere.get(name, ()) if pair[1].qualifier not in PULSES]
            inputs = self._control_inputs([*pairs, *lasting], name in self.actions)
            arguments = tuple(tree.Argument(self.at, self.at, ":=", Name(self.at, self.at, pin), value)
                              for pin, value in inputs.items())
            control = self.control(pairs[0][1].action)
            yield tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, control, arguments))

    def _control_inputs(self, pairs: Associations, coded: bool) -> dict[str, Expr]:
        """The inputs of the control of an action, by pin.  L and D go to the pin N, as long as the time of the step allows;
        for a BOOL variable (not `coded`), P0 and P1 go to the pin P: each pulse lasts one call."""
        wanted: dict[str, list[Expr]] = {}
        times: dict[str, list[tuple[Expr, Expr]]] = {}
        for step, association in pairs:
            self.at = association.start
            qualifier, time = association.qualifier, association.time
            pin = {"L": "N", "D": "N"}.get(qualifier, qualifier if coded or qualifier not in PULSES else "P")
            wanted.setdefault(pin, []).append(self._contribution(step, association))
            if time is not None and qualifier in ("SD", "SL"):
                times.setdefault(f"{pin}_T", []).append((self.flag(step.name, "X"), time))
        inputs = {pin: self.join("OR", terms) for pin, terms in wanted.items()}
        for pin, choices in times.items():
            *rest, (_, value) = choices
            for active, time in reversed(rest):
                value = self.function("SEL", active, value, time)
            inputs[pin] = value
        return inputs

    def _contribution(self, step: Step, association: Association) -> Expr:
        """The expression that one association contributes to its pin."""
        qualifier, time = association.qualifier, association.time
        if qualifier in PULSES:
            return self.exited(step) if qualifier == "P0" else self.entered(step)
        active = self.flag(step.name, "X")
        if qualifier not in ("L", "D", "DS") or time is None:
            return active
        return self.join("AND", [active, self.binary("<" if qualifier == "L" else ">=", self.flag(step.name, "T"), time)])

    def _wake_for_actions(self, pairs: Associations) -> Iterable[Statement]:
        """Ask for a scan when an L, D or DS changes by the passing of time."""
        for step, association in pairs:
            if association.time is not None and association.qualifier in ("L", "D", "DS"):
                self.at = association.start
                waits = self.binary("<", self.flag(step.name, "T"), association.time)
                yield self.when(self.join("AND", [self.flag(step.name, "X"), waits]), (self.wake_at(step, association.time),))

    def _run(self, action: tree.Action) -> Iterable[Statement]:
        self.at = action.start
        for flag, _ in ACTION_FLAGS:
            yield self.assign(self.flag(action.name, flag), self.member(self.control(action.name), flag))
        call = tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, self.name(action.name.text), ()))
        yield self.when(self.flag(action.name, "A"), (call,))
