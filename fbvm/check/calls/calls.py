"""Calls: which POU or standard function is meant, and which argument goes to which parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fbvm.base.types import (
    BOOL,
    DEFAULT_STRING,
    AnyType,
    ArrayType,
    EnumType,
    RefType,
    StringType,
    StructType,
    Type,
    base,
    fold,
    followed,
)
from fbvm.check.calls.arguments import MIXED, MIXED_HINT, mixed
from fbvm.check.calls.generics import Generics, is_generic
from fbvm.check.calls.standard import StandardCalls, is_known
from fbvm.check.expressions import qualified, references
from fbvm.check.expressions.assignability import assignable, holds, lent, same
from fbvm.check.expressions.writes import note_count, writable
from fbvm.check.symbols.facts import Pou, PouCall, Variable, holds_block, is_block
from fbvm.check.symbols.vendor_names import comma_hint
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

if TYPE_CHECKING:
    from fbvm.check.expressions.infer import Expressions

PARAMETER_KINDS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")


class Calls:
    """The calls in one POU."""

    def __init__(self, expressions: Expressions) -> None:
        self.expressions = expressions
        self.facts = expressions.facts
        self.project = expressions.project
        self.checker = expressions.checker
        self.standard = StandardCalls(expressions)
        self.error = expressions.error

    def value(self, call: tree.Call, want: Type | None) -> Type | None:
        """A call as part of an expression."""
        result = self._resolve(call, want, as_value=True)
        if result == "":
            self.error("S0409", call, f"{_shown(call.callee)} gives no value",
                       "call it as a statement of its own and read its outputs")
            return None
        return result if isinstance(result, Type) else None

    def statement(self, call: tree.Call) -> None:
        """A call as a statement; a result is thrown away."""
        result = self._resolve(call, None, as_value=False)
        if isinstance(result, Type):
            self.facts.types[call] = result

    def _resolve(self, call: tree.Call, want: Type | None, as_value: bool) -> Type | str | None:
        """The result's type, "" for a call without result, None after a diagnostic."""
        callee = call.callee
        variable = self.expressions.variable(callee.text) if isinstance(callee, tree.NameRef) else None
        name = callee.text if isinstance(callee, tree.NameRef) else qualified.bare(self.expressions, callee)
        if (action := self.action(callee)) is not None:
            return self._bind_action(call, action)
        if name is None or variable is not None and variable.kind != "RESULT":
            return self._instance(call, as_value)
        pou = self.project.pou(name, self.expressions.source)
        if pou is not None and pou.is_function:
            return self._function(call, pou, want)
        if isinstance(callee, tree.NameRef) and self.expressions.program(callee):
            return self._instance(call, as_value)
        if pou is not None:
            self.error("S0401", callee, f"{pou.name} is a {pou.kind}: what is called is an instance of it",
                       f"declare one, such as  my_{pou.name.lower()} : {pou.name};" if pou.kind != "PROGRAM" else
                       "a CONFIGURATION has several of it, and none is meant")
            self._arguments_alone(call)
            return None
        return self.standard.call(call, fold(name), want, as_value)

    def action(self, callee: tree.Expr) -> tuple[Pou, tree.Expr | None] | None:
        """The ACTION that an expression names, and the instance of which; None for one of the POU itself."""
        hides = self.expressions.variable(callee.text) if isinstance(callee, tree.NameRef) else None
        if hides is not None and hides.role != "action":
            return None
        name = callee.text if isinstance(callee, tree.NameRef) else qualified.bare(self.expressions, callee)
        if name is not None:
            home = self.expressions.pou.owner if self.expressions.pou is not None else None
            action = home.actions.get(fold(name)) if home is not None else None
            return (action, None) if action is not None else None
        if not isinstance(callee, tree.Member):
            return None
        kind = self.expressions.infer(callee.of)
        if not isinstance(kind, StructType) or not kind.block:
            return None
        action = self.checker.block_of(kind).actions.get(fold(callee.name.text))
        return (action, callee.of) if action is not None else None

    def _bind_action(self, call: tree.Call, found: tuple[Pou, tree.Expr | None]) -> str:
        action, instance = found
        if call.arguments:
            self.error("S0402", call.arguments[0], f"the ACTION {action.tree.name.text} has no parameters",
                       "write the inputs of its instance first")
        self.expressions.note_call(action, call)
        self.facts.calls[call] = PouCall(action, instance)
        return ""

    def _arguments_alone(self, call: tree.Call) -> None:
        """Check the arguments of a call that could not be resolved, for their own mistakes."""
        for argument in call.arguments:
            if argument.value is not None:
                self.expressions.infer(argument.value)

    def _instance(self, call: tree.Call, as_value: bool) -> Type | str | None:
        kind = self.expressions.infer(call.callee)
        if kind is None:
            self._arguments_alone(call)
            return None
        if not isinstance(kind, StructType) or not kind.block:
            name = _shown(call.callee)
            hidden = is_known(fold(name)) or self.project.pou(name, self.expressions.source) is not None
            self.error("S0401", call.callee, f"{name} is {kind} and cannot be called",
                       f"the variable hides the function {fold(name)}: rename it" if hidden else
                       f"an element is written {name}[...]" if isinstance(kind, ArrayType) else "")
            return None
        pou = self.checker.block_of(kind)
        called = self.facts.variables.get(call.callee)
        if called is not None and called.constant and not writable(self.expressions, call.callee, "be called here"):
            return None
        if as_value:
            return ""
        bound = PouCall(pou, call.callee)
        variable = self.facts.variables.get(call.callee)
        if variable is not None and variable.owner is not None:
            bound.tasked = variable.owner.tasked.get(variable)
        self._bind(call, pou, bound)
        self.facts.calls[call] = bound
        return ""

    def _function(self, call: tree.Call, generic: Pou, want: Type | None) -> Type | str | None:
        pou = Generics(self).function(call, generic, want) if is_generic(generic, self.project) else generic
        if pou is None:
            return None
        if not self.checker.interface(pou, self.expressions.source, call):
            self._arguments_alone(call)
            return None
        bound = PouCall(pou, None)
        self._bind(call, pou, bound)
        self.facts.calls[call] = bound
        if pou.tree.result is not None and pou.result is None:
            return None
        return pou.result.type if pou.result is not None else ""

    # --- binding ----------------------------------------------------------------------------------------------------

    def _bind(self, call: tree.Call, pou: Pou, bound: PouCall) -> None:
        """Match arguments with parameters, complain about what does not fit or is missing."""
        self.expressions.note_call(pou, call)
        other = mixed(call, self.project.dialect)
        if other is not None:
            self.error("S0406", other, MIXED, MIXED_HINT)
            return
        for argument in call.arguments:
            if (name := self._compared(argument, pou)):
                self.error("S0402", argument, f"this compares {name}, and passes the result",
                           f"`:=` passes an argument: {name} := ...")
                return
        named = [a for a in call.arguments if a.kind]
        positional = [a for a in call.arguments if not a.kind]
        given: dict[str, tree.Node] = {}
        if positional:
            self._positional(call, positional, named, pou, bound, given)
        for argument in named:
            self._named(argument, pou, bound, given)
        empty = {name for name, node in given.items() if isinstance(node, tree.Argument) and node.value is None}
        missing = [v.name for v in pou.parameters("VAR_IN_OUT") if fold(v.name) not in given.keys() - empty]
        if missing and not pou.has_lost:
            self.error("S0404", call, f"the in-out {' and '.join(missing)} of {pou.name} is missing",
                       f"pass a variable: {missing[0]} := ...")

    def _positional(self, call: tree.Call, arguments: Sequence[tree.Argument], named: Sequence[tree.Argument], pou: Pou,
                    bound: PouCall, given: dict[str, tree.Node]) -> None:
        names = {fold(a.name.text) for a in named if a.name is not None}
        names = {pou.other_names.get(name, name) for name in names} | {"EN", "ENO"}
        parameters = [v for v in pou.order if v.kind in PARAMETER_KINDS and fold(v.name) not in names]
        if len(arguments) > len(parameters) and not pou.has_lost:
            plural = "" if len(parameters) == 1 else "s"
            self.error("S0402", arguments[len(parameters)],
                       f"{pou.name} has {len(parameters) or 'no'} parameter{plural}, {len(arguments)} given",
                       comma_hint(self.expressions.text(call)))
        for argument, variable in zip(arguments, parameters, strict=False):
            assert argument.value is not None
            given[fold(variable.name)] = argument
            if variable.kind != "VAR_INPUT" or not is_block(variable.type):
                self._pass(argument, variable, bound)
        open_inputs = [v.name for v in parameters[len(arguments):] if v.kind == "VAR_INPUT" and not v.explicit]
        if open_inputs and not named:
            self.error("S0404", call, f"{pou.name} needs {' and '.join(open_inputs)} too",
                       "a call without names gives all inputs; name the parameters to leave some out")

    def _compared(self, argument: tree.Argument, pou: Pou) -> str:
        """The parameter that `IN = x` names for `IN := x`; "" if it is none of that."""
        value = argument.value
        if argument.kind or not isinstance(value, tree.Binary) or value.op != "=" or not isinstance(value.left, tree.NameRef):
            return ""
        name = fold(value.left.text)
        known = next((v.name for v in pou.order if fold(v.name) == name and v.kind in PARAMETER_KINDS), "")
        return known if self.expressions.variable(name) is None else ""

    def _named(self, argument: tree.Argument, pou: Pou, bound: PouCall, given: dict[str, tree.Node]) -> None:
        assert argument.name is not None
        name = fold(argument.name.text)
        name = pou.other_names.get(name, name)
        if name in given:
            self.error("S0403", argument.name, f"{argument.name.text} is given twice")
            return
        given[name] = argument
        variable = next((v for v in pou.order if fold(v.name) == name and v.kind in PARAMETER_KINDS), None)
        if variable is None:
            self._implicit(argument, name, pou, bound)
        elif (variable.kind == "VAR_OUTPUT") != (argument.kind == "=>"):
            arrow = "=>" if variable.kind == "VAR_OUTPUT" else ":="
            self.error("S0402", argument, f"{variable.name} is {_described(variable)}: write {variable.name} {arrow} ...")
        elif argument.value is not None:
            if variable.kind == "VAR_INPUT" and is_block(variable.type):
                return  # refused where it is declared
            self._pass(argument, variable, bound)

    def _implicit(self, argument: tree.Argument, name: str, pou: Pou, bound: PouCall) -> None:
        """EN and ENO of a POU that does not declare them; anything else is unknown."""
        assert argument.name is not None
        if name == "EN" and argument.kind == ":=":
            if argument.value is not None and self.expressions.fit(argument.value, BOOL, "S0405", "EN"):
                bound.enable = argument.value
        elif name == "ENO" and argument.kind == "=>":
            if argument.value is not None and self.output(argument, BOOL, "ENO"):
                bound.enabled.append((argument.value, argument.negated))
        elif not pou.lost(name):
            known = [v.name for v in pou.order if v.kind in PARAMETER_KINDS]
            self.error("S0402", argument.name, f"{pou.name} has no parameter {argument.name.text}",
                       self.project.choices(argument.name.text, known))
            if argument.value is not None:
                self.expressions.infer(argument.value)

    def _pass(self, argument: tree.Argument, variable: Variable, bound: PouCall) -> None:
        value = argument.value
        assert value is not None
        if variable.kind == "VAR_INPUT":
            if fold(variable.name) == "EN":
                if self.expressions.fit(value, BOOL, "S0405", "EN"):
                    bound.enable = value
            elif isinstance(variable.type, RefType) and variable.type.follows:
                if references.lend(self.expressions, value, followed(variable.type), "S0405", f"the input {variable.name}"):
                    bound.inputs.append((variable, value))
            elif self.expressions.fit(value, variable.type, "S0405", variable.name):
                bound.inputs.append((variable, value))
        elif variable.kind == "VAR_IN_OUT":
            if self._in_out(value, variable):
                bound.in_outs.append((variable, value))
        elif self.output(argument, followed(variable.type), variable.name):
            bound.outputs.append((variable, value, argument.negated))

    def _in_out(self, value: tree.Expr, variable: Variable) -> bool:
        kind = self.expressions.infer(value)
        if kind is None:
            return False
        if not self.expressions.is_variable(value):
            self.error("S0407", value, f"the in-out {variable.name} needs a variable, not a value")
            return False
        if isinstance(variable.type, AnyType) and holds_block(kind):
            self.error("S0405", value, f"{variable.name} is {variable.type}, and {kind} is or holds an instance",
                       "pass a variable of it")
            return False
        numbers = self.project.dialect.numbers_of_enumerations
        if not same(kind.base if numbers and isinstance(kind, EnumType) else kind, variable.type) and \
                not _long_enough(kind, variable):
            hint = "an in-out takes a variable of exactly its own type"
            if isinstance(kind, StringType) and variable.any_length:
                hint = f"an in-out STRING without a length works on {DEFAULT_STRING} characters: " \
                    "pass a variable that has as many, or give both the same length"
            self.error("S0405", value, f"the in-out {variable.name} needs {variable.type}, this is {kind}", hint)
            return False
        if isinstance(value, ladder.Words):
            value = value.of
        return variable.constant or writable(self.expressions, value, f"be passed to the in-out {variable.name}")

    def output(self, argument: tree.Argument, kind: Type, name: str) -> bool:
        """True if the target of `name => target` takes an output of `kind`; else a diagnostic."""
        value = argument.value
        assert value is not None
        target = self.expressions.infer(value)
        if target is None:
            return False
        if not self.expressions.is_variable(value):
            self.error("S0407", value, f"the output {name} needs a variable to go to")
            return False
        if argument.negated and base(kind) != BOOL:
            self.error("S0405", value, f"NOT needs a BOOL output; {name} is {kind}")
            return False
        if not assignable(kind, target) and not holds(target, kind) and not lent(kind, target, self.project.dialect):
            self.error("S0405", value, f"the output {name} is {kind} and does not fit {target}",
                       f"let a variable of {base(kind)} take it, and convert that afterwards")
            return False
        note_count(self.expressions, value)
        return writable(self.expressions, value, f"take the output {name}")


def _long_enough(kind: Type, variable: Variable) -> bool:
    """True for a STRING that is longer than an in-out declared without a length, which uses its beginning.

    The standard leaves open what such an in-out takes; a reference carries no length, so a shorter one is refused."""
    wanted = variable.type
    return variable.any_length and isinstance(kind, StringType) and isinstance(wanted, StringType) and \
        kind.wide == wanted.wide and kind.capacity >= wanted.capacity


def _described(variable: Variable) -> str:
    return {"VAR_INPUT": "an input", "VAR_OUTPUT": "an output", "VAR_IN_OUT": "an in-out"}[variable.kind]


def _shown(expr: tree.Expr) -> str:
    return expr.text if isinstance(expr, tree.NameRef) else "this"



