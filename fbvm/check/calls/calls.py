"""Calls: which POU, ACTION or standard function is meant, and the type of its result."""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import ArrayType, Elementary, EnumType, RefType, StringType, StructType, Type, base, fold
from fbvm.check.calls import generics, methods, standard
from fbvm.check.calls.binding import bind, bind_of_action
from fbvm.check.expressions import objects, qualified
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import Pou, PouCall, Variable
from fbvm.check.symbols.report import with_article
from fbvm.syntax import tree
from fbvm.syntax.tree.il import CallsInRow


def value(scope: Scope, call: tree.Call, want: Type | None) -> Type | None:
    """The type of a call in an expression; None after a diagnostic."""
    result = _resolve(scope, call, want, as_value=True)
    if result == "":
        scope.error("S0409", call, f"{_shown(call.callee)} gives no value",
                    "call it as a statement of its own and read its outputs")
        return None
    return result if isinstance(result, Type) else None


def statement(scope: Scope, call: tree.Call) -> None:
    """Check a call that is a statement; it may drop a result."""
    result = _resolve(scope, call, None, as_value=False)
    if isinstance(result, Type):
        scope.facts.types[call] = result


def in_row(scope: Scope, expr: CallsInRow, want: Type | None) -> Type | None:
    """The type of the result of the last call of an instruction list that has one, else of the current result before."""
    kind: Type | None = None
    for call in expr.calls:
        errors = len(scope.project.report.diagnostics)
        statement(scope, call)
        if call in scope.facts.types:
            scope.facts.last_calls[expr] = call
            kind = scope.settle(call)
        elif call not in scope.facts.calls or len(scope.project.report.diagnostics) > errors:
            return None
    if kind is None and expr.before is None:
        return value(scope, expr.calls[-1], want)
    return kind if kind is not None or expr.before is None else scope.settle(expr.before)


def _resolve(scope: Scope, call: tree.Call, want: Type | None, as_value: bool) -> Type | str | None:
    """The result's type, "" for a call without result, None after a diagnostic."""
    callee = call.callee
    variable = _called_variable(scope, callee) if isinstance(callee, tree.NameRef) else None
    name = callee.text if isinstance(callee, tree.NameRef) else qualified.bare(scope, callee)
    if (named := action(scope, callee)) is not None:
        return _bind_action(scope, call, named)
    is_method, result = methods.call(scope, call)
    if is_method:
        return result
    if objects.is_self(scope, callee):
        return _instance(scope, call, as_value)
    if name is None or variable is not None and variable.kind != "RESULT" or \
            isinstance(callee, tree.Member) and isinstance(qualified.member(scope, callee), Variable):
        return _instance(scope, call, as_value)
    unwritten = call.start == call.end  # of charts and rungs: they mean the standard function, whatever the program declares
    pou = scope.project.pou(name, scope.source) if not (unwritten and standard.is_known(fold(name))) else None
    if pou is not None and pou.is_function:
        return _function(scope, call, pou, want)
    if isinstance(callee, tree.NameRef) and objects.program(scope, callee):
        return _instance(scope, call, as_value)
    if pou is not None:
        scope.error("S0401", callee, f"{pou.name} is {with_article(pou.kind)}: what is called is an instance of it",
                    f"declare one, such as  my_{pou.name.lower()} : {pou.name};" if pou.kind != "PROGRAM" else
                    "a CONFIGURATION has several of it, and none is meant")
        _arguments_alone(scope, call)
        return None
    return standard.call(scope, call, fold(name), want, as_value)


def _called_variable(scope: Scope, name: tree.NameRef) -> Variable | None:
    """The variable that a call names; None if a dialect calls the function of its name, since the variable cannot be called."""
    variable = scope.variable(name.text)
    if variable is None or not scope.dialect.callables_apart or \
            not isinstance(base(variable.type), Elementary | StringType | EnumType):
        return variable
    pou = scope.project.pou(variable.name, scope.source)
    is_function = pou.is_function if pou is not None else standard.is_known(fold(variable.name))
    return None if is_function else variable


def action(scope: Scope, callee: tree.Expr) -> tuple[Pou, tree.Expr | None] | None:
    """The ACTION that an expression names, and its instance: None for an ACTION of the POU itself.

    None for an expression that names no ACTION."""
    hides = scope.variable(callee.text) if isinstance(callee, tree.NameRef) else None
    if hides is not None and hides.role != "action":
        return None
    name = callee.text if isinstance(callee, tree.NameRef) else qualified.bare(scope, callee)
    if name is not None:
        home = scope.pou.own_block if scope.pou is not None else None
        own = home.action(fold(name)) if home is not None else None
        return (own, None) if own is not None else None
    if not isinstance(callee, tree.Member):
        return None
    kind = objects.instance_of(scope, callee.of)
    if kind is None:
        return None
    of_instance = scope.context.block_of(kind).action(fold(callee.name.text))
    return (of_instance, callee.of) if of_instance is not None else None


def _bind_action(scope: Scope, call: tree.Call, found: tuple[Pou, tree.Expr | None]) -> str:
    called, instance = found
    bound = PouCall(called, instance, dynamic=objects.may_be_derived(scope, instance))
    if call.arguments and scope.dialect.action_inputs and instance is not None and called.home is not None:
        bind_of_action(scope, call, called.home, bound)
    elif call.arguments:
        scope.error("S0402", call.arguments[0], f"the ACTION {called.tree.name.text} has no parameters",
                    "write the inputs of its instance first" +
                    (f", or take {takers('action_inputs')}" if instance is not None else ""))
    scope.note_call(called, call, bound.dynamic)
    scope.facts.calls[call] = bound
    return ""


def _arguments_alone(scope: Scope, call: tree.Call) -> None:
    """Check the arguments of a call that could not be resolved, for their own mistakes."""
    for argument in call.arguments:
        if argument.value is not None:
            scope.infer(argument.value)


def _warn_of_copy(scope: Scope, call: tree.Call, called: Variable | None) -> None:
    """Warn of the call of an input that is an instance: a block has a copy of the argument where dialects let it be called."""
    if called is not None and called.kind == "VAR_INPUT" and not isinstance(called.type, RefType) and not scope.source.library:
        scope.error("S0193", call, f"{called.name} is an input, a copy of the argument: this call leaves the argument as it is",
                    "make it a VAR_IN_OUT to call the instance that is passed")


def _instance(scope: Scope, call: tree.Call, as_value: bool) -> Type | str | None:
    kind = objects.instance_of(scope, call.callee) if objects.is_self(scope, call.callee) else scope.infer(call.callee)
    if kind is None:
        _arguments_alone(scope, call)
        return None
    if isinstance(kind, RefType) and kind.interface:
        scope.error("S0401", call.callee, f"{_shown(call.callee)} is an interface and has no body to call",
                    "call one of its methods: name.method()")
        _arguments_alone(scope, call)
        return None
    if not isinstance(kind, StructType) or not kind.block:
        name = _shown(call.callee)
        hidden = standard.is_known(fold(name)) or scope.project.pou(name, scope.source) is not None
        scope.error("S0401", call.callee, f"{name} is {kind} and cannot be called",
                    f"the variable hides the function {fold(name)}: rename it" if hidden else
                    f"an element is written {name}[...]" if isinstance(kind, ArrayType) else "")
        return None
    pou = scope.context.block_of(kind)
    called = scope.facts.variables.get(call.callee)
    if called is not None and called.constant and not writable(scope, call.callee, "be called here"):
        return None
    if as_value:
        return ""
    if pou.kind == "CLASS":
        scope.error("S0401", call.callee, f"{pou.name} is a CLASS and has no body to call",
                    "call one of its methods: name.method()")
        return None
    _warn_of_copy(scope, call, called)
    bound = PouCall(pou, call.callee, dynamic=objects.may_be_derived(scope, call.callee))
    if not _may_call(scope, call.callee, bound):
        return None
    variable = scope.facts.variables.get(call.callee)
    if variable is not None and variable.owner is not None:
        bound.tasked = variable.owner.tasked.get(variable)
    bind(scope, call, pou, bound)
    scope.facts.calls[call] = bound
    return ""


def _may_call(scope: Scope, callee: tree.Expr, bound: PouCall) -> bool:
    """False after a diagnostic if an attribute forbids to call the body of an instance by name."""
    said = scope.context.attributes(bound.pou).get("no_explicit_call")
    itself = callee.of if isinstance(callee, tree.Deref) else callee
    if said is None or bound.dynamic or objects.is_self(scope, itself):
        return True
    scope.error("S1012", callee, f"the body of {bound.pou.name} is not called by name: {said or 'it has no_explicit_call'}",
                "call its methods")
    return False


def _function(scope: Scope, call: tree.Call, generic: Pou, want: Type | None) -> Type | str | None:
    pou = generics.function(scope, call, generic, want) if generics.is_generic(generic, scope.project) else generic
    if pou is None:
        return None
    if not scope.context.interface(pou, scope.source, call):
        _arguments_alone(scope, call)
        return None
    bound = PouCall(pou, None)
    bind(scope, call, pou, bound)
    scope.facts.calls[call] = bound
    if pou.tree.result is not None and pou.result is None:
        return None
    return pou.result.type if pou.result is not None else ""


def _shown(expr: tree.Expr) -> str:
    return expr.text if isinstance(expr, tree.NameRef) else "this"
