"""Arguments of a call of a POU: each finds its parameter and fits it, and what is missing is reported."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.base.dialects import takers
from fbvm.base.types import BOOL, DEFAULT_STRING, AnyType, EnumType, RefType, StringType, Type, derives, fold, followed
from fbvm.check.calls.arguments import MIXED, MIXED_HINT, mixed, output
from fbvm.check.expressions import aggregates, references
from fbvm.check.expressions.assignability import same
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import Pou, PouCall, Variable, holds_block, is_block
from fbvm.check.symbols.vendor_names import comma_hint
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

PARAMETER_KINDS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
"""Sections whose variables callers name."""


def bind(scope: Scope, call: tree.Call, pou: Pou, bound: PouCall) -> None:
    """Match the arguments of a call with the parameters of a POU; report those that do not fit or are missing."""
    scope.note_call(pou, call, bound.dynamic)
    other = mixed(call, scope.dialect)
    if other is not None:
        scope.error("S0406", other, MIXED, MIXED_HINT)
        return
    for argument in call.arguments:
        if (name := _compared(scope, argument, pou)):
            scope.error("S0402", argument, f"this compares {name}, and passes the result",
                        f"`:=` passes an argument: {name} := ...")
            return
    named = [a for a in call.arguments if a.kind]
    positional = [a for a in call.arguments if not a.kind]
    given: dict[str, tree.Node] = {}
    if positional:
        _positional(scope, call, positional, named, pou, bound, given)
    for argument in named:
        _named(scope, argument, pou, bound, given)
    _leave_out(scope, call, pou, bound, given)


def _leave_out(scope: Scope, call: tree.Call, pou: Pou, bound: PouCall, given: dict[str, tree.Node]) -> None:
    """Note the in-outs without an argument that keep their value, and report the others."""
    empty = {name for name, node in given.items() if isinstance(node, tree.Argument) and node.value is None}
    missing = [v for v in pou.parameters("VAR_IN_OUT") if fold(v.name) not in given.keys() - empty]
    bound.kept += [v for v in missing if v.own is not None]
    missing = [v for v in missing if v.own is None]
    if missing and not pou.has_failed_names:
        names = " and ".join(v.name for v in missing)
        scope.error("S0404", call, f"the {missing[0].role_of_parameter} {names} of {pou.name} is missing",
                    f"pass a variable: {missing[0].name} := ...")


def bind_of_action(scope: Scope, call: tree.Call, pou: Pou, bound: PouCall) -> None:
    """Match the arguments of a call of an ACTION with the parameters of its POU `pou`; report those that do not fit."""
    given: dict[str, tree.Node] = {}
    known = {fold(variable.name) for kind in PARAMETER_KINDS for variable in pou.parameters(kind)}
    for argument in call.arguments:
        if argument.name is None or fold(argument.name.text) not in known:
            hint = scope.project.choices(argument.name.text, known) if argument.name is not None else "write input := value"
            scope.error("S0402", argument, f"an ACTION of {pou.name} takes parameters of {pou.name}, by name", hint)
        else:
            _named(scope, argument, pou, bound, given)


def _without_names(pou: Pou, named: Sequence[tree.Argument]) -> list[Variable]:
    """The parameters that arguments without a name are for, in their order, where `named` are those with one."""
    names = {fold(a.name.text) for a in named if a.name is not None}
    names = {pou.other_names.get(name, name) for name in names} | {"ENO"}
    return [v for v in pou.order if v.kind in PARAMETER_KINDS and fold(v.name) not in names and not v.guards]


def _positional(scope: Scope, call: tree.Call, arguments: Sequence[tree.Argument], named: Sequence[tree.Argument], pou: Pou,
                bound: PouCall, given: dict[str, tree.Node]) -> None:
    parameters = _without_names(pou, named)
    if _lacks_parameters(pou):  # the others would move up
        given.update((fold(v.name), call) for v in parameters)
        for argument in arguments:
            assert argument.value is not None
            scope.infer(argument.value)
        return
    if len(arguments) > len(parameters) and not pou.has_failed_names:
        plural = "" if len(parameters) == 1 else "s"
        scope.error("S0402", arguments[len(parameters)],
                    f"{pou.name} has {len(parameters) or 'no'} parameter{plural}, {len(arguments)} given",
                    comma_hint(scope.text(call)))
    for argument, variable in zip(arguments, parameters, strict=False):
        assert argument.value is not None
        given[fold(variable.name)] = argument
        _pass(scope, argument, variable, bound)
    open_inputs = [v.name for v in parameters[len(arguments):] if v.kind == "VAR_INPUT" and not v.explicit]
    if open_inputs and not named:
        scope.error("S0404", call, f"{pou.name} needs {' and '.join(open_inputs)} too",
                    "a call without names gives all inputs; name the parameters to leave some out")


def _lacks_parameters(pou: Pou) -> bool:
    """Whether the declaration of a parameter has an error, which is reported, so that the POU does not have it."""
    declared = (name for section in pou.tree.sections if section.kind in PARAMETER_KINDS
                for variable in section.variables for name in variable.names)
    return bool(pou.failed_names) and any(
        fold(name.text) in pou.failed_names and fold(name.text) not in pou.variables for name in declared)


def _compared(scope: Scope, argument: tree.Argument, pou: Pou) -> str:
    """The parameter of an argument that is written `IN = x`, probably for `IN := x`; "" for other arguments."""
    value = argument.value
    if argument.kind or not isinstance(value, tree.Binary) or value.op != "=" or not isinstance(value.left, tree.NameRef):
        return ""
    name = fold(value.left.text)
    known = next((v.name for v in pou.order if fold(v.name) == name and v.kind in PARAMETER_KINDS), "")
    return known if scope.variable(name) is None else ""


def _named(scope: Scope, argument: tree.Argument, pou: Pou, bound: PouCall, given: dict[str, tree.Node]) -> None:
    assert argument.name is not None
    name = fold(argument.name.text)
    name = pou.other_names.get(name, name)
    if name in given:
        if argument.kind == "=>" and argument.value is None:
            return  # this says nothing, as TwinCAT's editor writes it
        scope.error("S0403", argument.name, f"{argument.name.text} is given twice")
        return
    given[name] = argument
    variable = _parameter(pou, name)
    if variable is None:
        _implicit(scope, argument, name, pou, bound)
    elif (variable.kind == "VAR_OUTPUT") != (argument.kind == "=>") and not (
            variable.kind == "VAR_OUTPUT" and scope.dialect.outputs_with_assign):
        arrow = "=>" if variable.kind == "VAR_OUTPUT" else ":="
        others = f"or take {takers('outputs_with_assign')}" if variable.kind == "VAR_OUTPUT" else ""
        scope.error("S0402", argument, f"{variable.name} is {_described(variable)}: write {variable.name} {arrow} ...", others)
    elif argument.value is not None:
        _pass(scope, argument, variable, bound)


def _parameter(pou: Pou, name: str) -> Variable | None:
    """The parameter of that folded name.  Behind the name of an input with R_EDGE stands what the body reads of it."""
    found = pou.variables.get(name)
    if found is not None and found.kind in PARAMETER_KINDS and not pou.edges:
        return found
    return next((v for v in pou.order if fold(v.name) == name and v.kind in PARAMETER_KINDS), None)


def _implicit(scope: Scope, argument: tree.Argument, name: str, pou: Pou, bound: PouCall) -> None:
    """Bind EN and ENO of a POU that does not declare them; report any other name as unknown."""
    assert argument.name is not None
    if name == "EN" and argument.kind == ":=":
        if argument.value is not None and scope.fit(argument.value, BOOL, "S0405", "EN"):
            bound.enable = argument.value
    elif name == "ENO" and argument.kind == "=>":
        if argument.value is not None and output(scope, argument, BOOL, "ENO"):
            bound.enabled.append((argument.value, argument.negated))
    elif not pou.is_failed(name):
        known = [v.name for v in pou.order if v.kind in PARAMETER_KINDS]
        scope.error("S0402", argument.name, f"{pou.name} has no parameter {argument.name.text}",
                    scope.project.choices(argument.name.text, known))
        if argument.value is not None:
            scope.infer(argument.value)


def _pass(scope: Scope, argument: tree.Argument, variable: Variable, bound: PouCall) -> None:
    value = argument.value
    assert value is not None
    if variable.kind == "VAR_INPUT":
        if variable.guards:
            if scope.fit(value, BOOL, "S0405", "EN"):
                bound.enable = value
        elif is_block(variable.type):
            if _in_out(scope, value, variable):
                bound.inputs.append((variable, value))
        elif isinstance(variable.type, RefType) and variable.type.follows:
            if references.lend(scope, value, followed(variable.type), "S0405", f"the input {variable.name}", variable.any_length):
                bound.inputs.append((variable, value))
        elif scope.fit(value, variable.type, "S0405", variable.name):
            bound.inputs.append((variable, value))
    elif variable.kind == "VAR_IN_OUT":
        if _in_out(scope, value, variable):
            bound.in_outs.append((variable, value))
    elif output(scope, argument, followed(variable.type), variable.name):
        bound.outputs.append((variable, value, argument.negated))


def _in_out(scope: Scope, value: tree.Expr, variable: Variable) -> bool:
    kind, role = scope.infer(value), variable.role_of_parameter
    if kind is None:
        return False
    if _takes_copy(scope, value, kind, variable):
        scope.fit(value, variable.type, "S0405", variable.name)
        scope.facts.copies[value] = aggregates.in_frame(scope, value, variable.type, "copy of a text")
        return True
    if isinstance(kind, AnyType) and not isinstance(variable.type, AnyType) and scope.describes(value, variable.type):
        return True
    if not scope.is_variable(value):
        scope.error("S0407", value, f"the {role} {variable.name} needs a variable, not a value",
                    "it is read where it lies: assign the value to a variable, and pass that" if variable.by_reference else "")
        return False
    if isinstance(variable.type, AnyType) and holds_block(kind):
        scope.error("S0405", value, f"{variable.name} is {variable.type}, and {kind} is or holds an instance",
                    "pass a variable of it")
        return False
    if isinstance(variable.type, AnyType) and _is_read_bit(scope, value, variable):
        scope.facts.copies[value] = aggregates.in_frame(scope, value, BOOL, "copy of a bit")
        return True
    return _has_its_type(scope, value, kind, variable)


def _takes_copy(scope: Scope, value: tree.Expr, kind: Type, variable: Variable) -> bool:
    """True for a text that a VAR_IN_OUT CONSTANT cannot read where it lies: a literal, or one of another length."""
    return scope.dialect.constant_in_outs_take_texts and variable.constant and scope.pou is not None and \
        isinstance(variable.type, StringType) and isinstance(kind, StringType) and variable.type.wide == kind.wide and \
        not (scope.is_variable(value) and (same(kind, variable.type) or _long_enough(kind, variable)))


def _is_read_bit(scope: Scope, value: tree.Expr, variable: Variable) -> bool:
    """True for a member on a single bit that an ANY input reads."""
    member = scope.facts.fields.get(value)
    return variable.by_reference and scope.pou is not None and member is not None and member.bit is not None


def _has_its_type(scope: Scope, value: tree.Expr, kind: Type, variable: Variable) -> bool:
    """True if an argument has the type of its in-out; else a diagnostic."""
    role = variable.role_of_parameter
    numbers = scope.dialect.numbers_of_enumerations
    if not same(kind.base if numbers and isinstance(kind, EnumType) else kind, variable.type) and \
            not _long_enough(kind, variable) and not (is_block(variable.type) and derives(kind, variable.type)):
        hint = "an in-out takes a variable of exactly its own type"
        if variable.by_reference:
            hint = "an input that is read where it lies takes a variable of exactly its own type"
        if isinstance(kind, StringType) and variable.any_length:
            hint = f"an in-out STRING without a length works on {DEFAULT_STRING} characters: " \
                "pass a variable that has as many, or give both the same length"
        scope.error("S0405", value, f"the {role} {variable.name} needs {variable.type}, this is {kind}", hint)
        return False
    if isinstance(value, ladder.Words):
        value = value.of
    return variable.constant or variable.kind == "VAR_INPUT" or \
        writable(scope, value, f"be passed to the {role} {variable.name}")


def _long_enough(kind: Type, variable: Variable) -> bool:
    """True for a STRING that is longer than an in-out declared without a length, which uses the first characters of it.

    The standard leaves open what such an in-out takes; a reference carries no length, so a shorter one is refused."""
    wanted = variable.type
    return variable.any_length and isinstance(kind, StringType) and isinstance(wanted, StringType) and \
        kind.wide == wanted.wide and kind.capacity >= wanted.capacity


def _described(variable: Variable) -> str:
    kind = "VAR_INPUT" if variable.by_reference else variable.kind
    return {"VAR_INPUT": "an input", "VAR_OUTPUT": "an output", "VAR_IN_OUT": "an in-out"}[kind]
