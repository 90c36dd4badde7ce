"""Arguments of a call of a standard function: each finds its parameter, and what is missing is named."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count, islice

from fbvm.base.dialects import Dialect, takers
from fbvm.base.types import BOOL, Type, base, fold
from fbvm.check.expressions import qualified
from fbvm.check.expressions.assignability import assignable, converted_by_dialect, holds
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.writes import warn_of_written_counter, writable
from fbvm.check.symbols.facts import Guard
from fbvm.check.symbols.vendor_names import comma_hint, format_hint
from fbvm.syntax import tree

MIXED = "a call names all of its parameters or none"
MIXED_HINT = f"name them: parameter := value, or take {takers('mixed_arguments')}"
NAMED = 3
"""How many of the missing parameters a message names."""


def mixed(call: tree.Call, dialect: Dialect) -> tree.Argument | None:
    """The first argument that is named where the first of its call is not, or the other way round.

    None if there is no such argument, or the dialect takes both."""
    if dialect.mixed_arguments:
        return None
    return next((a for a in call.arguments if bool(a.kind) != bool(call.arguments[0].kind)), None)


class Arguments:
    """The arguments of one call.

    `names` are the parameters of the function, of which the last one repeats if `repeats`; `others` are second names of the
    first ones."""

    def __init__(self, scope: Scope, call: tree.Call, names: Sequence[str], repeats: bool = False,
                 others: Sequence[str] = ()) -> None:
        self.scope = scope
        self.error = scope.error
        self.call = call
        self.names = names
        self.repeats = repeats
        self.others = others

    def in_order(self) -> list[tree.Expr] | None:
        """Values in the order of the parameters, or None after a diagnostic."""
        other = mixed(self.call, self.scope.dialect)
        if other is not None:
            self.error("S0406", other, MIXED, MIXED_HINT)
            return None
        values: dict[int, tree.Expr] = {}
        given: set[int] = set()
        arguments = [a for a in self.call.arguments if not self._guard(a)]
        free = (i for i in count() if i not in given)
        for argument in sorted(arguments, key=lambda a: a.name is None):
            index = next(free) if argument.name is None else self._index(argument)
            if index is None:
                return None
            if index in given:
                assert argument.name is not None
                self.error("S0403", argument, f"{argument.name.text} is given twice")
                return None
            given.add(index)
            if argument.value is not None:
                values[index] = argument.value
        return [values[i] for i in sorted(values)] if self._complete(values, given) else None

    def _complete(self, values: dict[int, tree.Expr], given: set[int]) -> bool:
        """True if every parameter has a value; one that is named without a value has none."""
        least = len(self.names)
        if len(given) > least and not self.repeats:
            self.error("S0402", self.call, self._takes(len(given)),
                       comma_hint(self.scope.text(self.call)) or format_hint(callee(self.call), len(given)))
            return False
        count = max(least, 1 + max(given, default=0)) if least else 0
        missing = [self._name(i) for i in islice((i for i in range(count) if i not in values), NAMED)]
        if not missing:
            return True
        named = bool(self.call.arguments) and self.call.arguments[0].name is not None
        self.error("S0404", self.call, f"{callee(self.call)} needs {' and '.join(missing)} too" if named else
                   self._takes(len(given)))
        return False

    def _takes(self, given: int) -> str:
        least = len(self.names)
        more = " or more" if self.repeats else ""
        plural = "" if least == 1 and not self.repeats else "s"
        shown = f" ({', '.join(self.names)})" if self.names else ""
        return f"{callee(self.call)} takes {least or 'no'}{more} argument{plural}{shown}, {given or 'none'} given"

    def _name(self, index: int) -> str:
        """The name of a parameter, those that repeat included."""
        if index < len(self.names):
            return self.names[index]
        stem = self.names[-1].rstrip("0123456789")
        return f"{stem}{int(self.names[-1][len(stem):]) + index - len(self.names) + 1}"

    def _index(self, argument: tree.Argument) -> int | None:
        assert argument.name is not None
        name = fold(argument.name.text)
        if argument.kind == ":=":
            if name in self.names:
                return self.names.index(name)
            if name in self.others:
                return self.others.index(name)
            stem = self.names[-1].rstrip("0123456789") if self.names else ""
            number = name[len(stem):]
            if self.repeats and name.startswith(stem) and number.isdecimal() and len(number) < 10:
                index = int(number) - int(self.names[-1][len(stem):]) + len(self.names) - 1
                if index >= len(self.names):
                    return index
        elif name in self.names:
            self.error("S0402", argument, f"{name} is an input: write {name} := ...")
            return None
        known = ", ".join(self.names) + (" ..." if self.repeats else "")
        self.error("S0402", argument.name, f"there is no parameter {argument.name.text} here",
                   f"the parameters are {known}" if known else "it takes none")
        return None

    def _guard(self, argument: tree.Argument) -> bool:
        """True for EN and ENO, which every function has; with a value they become the guard of the call."""
        name = fold(argument.name.text) if argument.name is not None else ""
        if (name, argument.kind) not in (("EN", ":="), ("ENO", "=>")):
            return False
        if argument.value is None:
            return True
        guard = self.scope.facts.guards.setdefault(self.call, Guard())
        if name == "EN":
            if self.scope.fit(argument.value, BOOL, "S0405", "EN"):
                guard.enable = argument.value
        elif output(self.scope, argument, BOOL, "ENO"):
            guard.enabled.append((argument.value, argument.negated))
        return True


def callee(call: tree.Call) -> str:
    """The name of what is called, for messages."""
    return qualified.dotted(call.callee) or "this"


def output(scope: Scope, argument: tree.Argument, kind: Type, name: str) -> bool:
    """True if the target of `name => target` takes an output of `kind`; else a diagnostic."""
    value = argument.value
    assert value is not None
    target = scope.infer(value, kind)
    if target is None:
        return False
    if not scope.is_variable(value):
        scope.error("S0407", value, f"the output {name} needs a variable to go to")
        return False
    if argument.negated and base(kind) != BOOL:
        scope.error("S0405", value, f"NOT needs a BOOL output; {name} is {kind}")
        return False
    if not assignable(kind, target) and not holds(target, kind) and not converted_by_dialect(kind, target, scope.dialect):
        scope.error("S0405", value, f"the output {name} is {kind} and does not fit {target}",
                    f"let a variable of {base(kind)} take it, and convert that afterwards")
        return False
    warn_of_written_counter(scope, value)
    return writable(scope, value, f"take the output {name}")
