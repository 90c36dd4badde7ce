"""What the lowering of a chart shares: the steps and their flags, the variables that a chart needs, and makers of statements.

Statements are placed at the element that they come from.  Those that nobody wrote have no extent in the text, so that
stepping does not stop at them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.st.expressions import Expressions
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Expr, Name, NameRef, Statement, VarDecl, VarSection
from fbvm.syntax.tree.sfc import Association, Step

CONTROL = "SFC_ACTION_CONTROL"
"""The block that decides when an action is executed, in `fblib/iec`; a dialect that answers otherwise has its own."""
ACTION_FLAGS = (("Q", "BOOL"), ("A", "BOOL"))
"""The flags of an action, with their types."""
Associations = list[tuple[Step, Association]]
"""The associations of one action, each with its step."""


class ChartContext:
    """The state of one chart while its elements are lowered; `at` is the offset at which statements are placed."""

    def __init__(self, builder: Expressions, steps: Sequence[Step], actions: Iterable[tree.Action],
                 inside: tree.Action | None, flags: frozenset[str], controls: dict[str, str]) -> None:
        """`builder` makes literals; `actions` are all ACTIONs of the POU; `inside` is the action that the chart is the body
        of, None for the body of the POU; `flags` are the flags of CODESYS that the POU declares, folded; `controls` are the
        controls that charts of the POU have declared so far, by folded name of their action, and grow by those of this one."""
        self.builder = builder
        self.steps = steps
        self.actions = {fold(action.name.text): action for action in actions}
        self.inside = inside.name.text if inside is not None else "chart"
        self.flags = flags if inside is None else frozenset()
        self.at = 0
        self.kept: dict[str, VarDecl] = {}
        """Variables that last from call to call, by name."""
        self.temporaries: dict[str, VarDecl] = {}
        """Variables that live during one call, by name."""
        self._controls = controls

    # --- variables ---

    def keep(self, name: str, kind: str) -> NameRef:
        """A variable that lasts from call to call."""
        if name not in self.kept:
            self.kept[name] = _declaration(Name(self.at, self.at, name), kind)
        return self.name(name)

    def temporary(self, name: str) -> NameRef:
        """A BOOL variable that lives during one call."""
        if name not in self.temporaries:
            self.temporaries[name] = _declaration(Name(self.at, self.at, name), "BOOL")
        return self.name(name)

    def since(self, step: Step) -> NameRef:
        """The time at which a step became active."""
        return self.keep(f"${step.name.text} since", "TIME")

    def entered(self, step: Step) -> NameRef:
        """Whether a transition that has fired in this call leads to the step."""
        return self.temporary(f"${step.name.text} entered")

    def exited(self, step: Step) -> NameRef:
        """Whether a transition that has fired in this call leaves the step."""
        return self.temporary(f"${step.name.text} left")

    def control(self, action: Name) -> NameRef:
        """The instance of CONTROL for an action."""
        known = self._controls.get(fold(action.text))
        if known is not None:
            return self.name(known)
        self._controls[fold(action.text)] = f"${action.text} control"
        return self.keep(f"${action.text} control", CONTROL)

    # --- statements and expressions ---

    def name(self, text: str) -> NameRef:
        return NameRef(self.at, self.at, text)

    def member(self, of: Expr, name: str) -> Expr:
        return tree.Member(self.at, self.at, of, Name(self.at, self.at, name))

    def flag(self, name: Name, flag: str) -> Expr:
        """`name.X` and its like: the flag of a step or an action."""
        return self.member(self.name(name.text), flag)

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

    def binary(self, operator: str, left: Expr, right: Expr) -> Expr:
        return tree.Binary(self.at, self.at, operator, left, right, self.at)

    def join(self, operator: str, parts: list[Expr]) -> Expr:
        """The parts joined by AND or OR, as a balanced tree: a step may have hundreds of associations."""
        if len(parts) == 1:
            return parts[0]
        half = len(parts) // 2
        return self.binary(operator, self.join(operator, parts[:half]), self.join(operator, parts[half:]))

    def no_time(self) -> Expr:
        return self.builder.typed_literal(Token("TYPED_LITERAL", "T#0s", self.at, self.at))

    def function(self, name: str, *values: Expr) -> Expr:
        arguments = tuple(tree.Argument(value.start, value.end, "", None, value) for value in values)
        return tree.Call(self.at, self.at, self.name(name), arguments)

    def now(self) -> Expr:
        return self.function("TIME")

    def wake_at(self, step: Step, after: Expr) -> Statement:
        """Ask for a scan at the time at which the step will have been active for the duration `after`."""
        moment = self.binary("+", self.since(step), after)
        return tree.CallStatement(self.at, self.at, self.function("__DUE", moment))

    # --- parts of a call ---

    @property
    def begun(self) -> NameRef:
        """Whether the initial steps were activated."""
        return self.keep(f"${self.inside} begun", "BOOL")

    def assign_variables(self, used: dict[str, Associations]) -> Iterable[Statement]:
        """Assign to each BOOL variable that is an action whether its control has it TRUE."""
        for name, pairs in used.items():
            if name not in self.actions:
                action = pairs[0][1].action
                self.at = action.start
                yield self.assign(NameRef(action.start, action.end, action.text), self.member(self.control(action), "Q"))

    def reset_action(self, used: Associations) -> Iterable[Statement]:
        """Reset the control of an action, so that nothing is stored or delayed, and the flags of the action."""
        name = used[0][1].action
        held = tree.Argument(self.at, self.at, ":=", Name(self.at, self.at, "R"), self.truth(True))
        yield tree.CallStatement(self.at, self.at, tree.Call(self.at, self.at, self.control(name), (held,)))
        yield self.put(self.member(self.control(name), "R"), False)
        if fold(name.text) in self.actions:
            yield from (self.put(self.flag(name, flag), False) for flag, _ in ACTION_FLAGS)


def action_flags(start: int, end: int, actions: Iterable[tree.Action]) -> VarSection:
    """The hidden section that declares the flags Q and A of all actions of a POU with charts."""
    flags = tuple(flags_variable(action.name, ACTION_FLAGS) for action in actions)
    return VarSection(start, end, "VAR", (), flags, True, "action")


def flags_variable(name: Name, members: Iterable[tuple[str, str]]) -> VarDecl:
    """The structure variable with the flags `members` that has the name of a step or an action."""
    fields = tuple(_declaration(Name(name.start, name.end, field), kind) for field, kind in members)
    return VarDecl(name.start, name.end, (name,), None, tree.StructSpec(name.start, name.end, fields), None)


def _declaration(name: Name, kind: str) -> VarDecl:
    return VarDecl(name.start, name.end, (name,), None, tree.NamedType(name.start, name.end, kind), None)
