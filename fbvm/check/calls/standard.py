"""Calls of standard functions: which function is meant, and in which types it works."""

from __future__ import annotations

from fbvm.base.arithmetic import Undefined
from fbvm.base.dialects import takers
from fbvm.base.types import (
    BOOL,
    ELEMENTARY,
    GENERIC,
    LREAL,
    UDINT,
    ArrayType,
    Elementary,
    EnumType,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    Type,
    base,
    common,
    converts,
    families,
    machine,
    string,
)
from fbvm.check.calls import functions, intrinsics
from fbvm.check.calls.arguments import Arguments, callee
from fbvm.check.calls.functions import Conversion, Signature
from fbvm.check.expressions import references, unknown_names
from fbvm.check.expressions.assignability import BOUNDS_HINT, UNSIGNED, as_number, convertible, is_untyped, same
from fbvm.check.expressions.literals import as_character
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import MAKERS, is_any
from fbvm.check.symbols import vendor_names
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, PouCall, StandardCall, is_block
from fbvm.syntax import tree
from fbvm.syntax.st.builder import CHAIN_LIMIT

_SHOWN = {"ANY": "any value", "ENUMERATION": "enumerations", "ANY_STRING": "STRING and WSTRING"}
_NUMBERS = ("ANY_NUM", "ANY_BIT")
Passed = list[tuple[tree.Expr, Type]]
"""Arguments, each with the type of its parameter."""


RAISE = "F_RAISEEXCEPTION"


def is_known(name: str) -> bool:
    """True for the folded name of a standard function or of an intrinsic that is not refused."""
    return functions.is_standard(name) or name in MAKERS or name in intrinsics.NAMES and name not in intrinsics.REFUSED


def call(scope: Scope, call: tree.Call, name: str, want: Type | None, as_value: bool) -> Type | str | None:
    """The result's type, "" for a call without result, None after a diagnostic."""
    result = _typed(scope, call, name, want, as_value)
    called = scope.facts.calls.get(call)
    if result and isinstance(called, StandardCall) and call not in scope.facts.guards and \
            call not in scope.facts.reversed_bytes:
        _fold(scope, call, called)
    return result


def _fold(scope: Scope, call: tree.Call, called: StandardCall) -> None:
    """Fold a call of constants; a call that would trap is left to the program."""
    values = [value for argument, _ in called.arguments if (value := scope.facts.constants.get(argument)) is not None]
    if len(values) < len(called.arguments):
        return
    try:
        value = scope.context.evaluate(called, values, scope.dialect)
    except Undefined as undefined:
        scope.facts.undefined[call] = scope.source, undefined.code
        return
    if value is not None:
        scope.facts.constants[call] = value
        scope.unbounded(call, values)


def _typed(scope: Scope, call: tree.Call, name: str, want: Type | None, as_value: bool) -> Type | str | None:
    if name in intrinsics.NAMES:
        return intrinsics.intrinsic(scope, call, name)
    if name == RAISE and scope.dialect.raises_exceptions:
        return _raise(scope, call)
    if name in MAKERS:
        values = Arguments(scope, call, ["IN"]).in_order()
        return references.make(scope, call, name, values[0]) if values is not None else None
    if name in functions.TIME_OPERATORS:
        return _time_operator(scope, call, *functions.TIME_OPERATORS[name], want)
    if name in functions.OPERATORS:
        return _operator(scope, call, name, None, want)
    if name in functions.SIGNATURES:
        return _signature(scope, call, functions.SIGNATURES[name], None, want)
    conversion = functions.conversion(name) or _enum_conversion(scope, name)
    if conversion is not None:
        return _conversion(scope, call, conversion)
    typed = functions.typed_name(name)
    if typed is not None:
        if typed[0] in functions.OPERATORS:
            return _operator(scope, call, *typed, want)
        return _signature(scope, call, functions.SIGNATURES[typed[0]], typed[1], want)
    for argument in call.arguments:
        if argument.value is not None:
            scope.infer(argument.value)
    if unknown_names.is_reported(scope, call.callee):
        return None
    project = scope.project
    if (why := project.why_unseen(callee(call), scope.source)) is not None:
        scope.error(why[0], call.callee, *why[1:])
        return None
    scope.error("S0401", call.callee, f"there is no function or instance {callee(call)}",
                vendor_names.FUNCTIONS.get(name) or vendor_names.library_of(callee(call)) or
                project.nearest_pou(callee(call), functions.names()))
    return None


def _raise(scope: Scope, call: tree.Call) -> str | None:
    """F_RaiseException(code), which has no result (Beckhoff Information System, Tc2_System)."""
    values = Arguments(scope, call, ["EXCEPTIONCODE"]).in_order()
    if values is None or not scope.fit(values[0], UDINT, "S0405"):
        return None
    scope.facts.calls[call] = StandardCall("__RAISE", [(values[0], UDINT)])
    return ""


# --- kinds ------------------------------------------------------------------------------------------------------


def _operator(scope: Scope, call: tree.Call, name: str, kind: Elementary | StringType | None,
              want: Type | None) -> Type | None:
    """ADD(a, b, c) means a + b + c; NOT(a) means NOT a."""
    values = (_assigned(scope, call) if name == "NOT" else None) or Arguments(
        scope, call, ["IN"] if name == "NOT" else ["IN1", "IN2"], name in functions.EXTENSIBLE_OPERATORS).in_order()
    if values is None:
        return None
    if scope.operators + len(values) > CHAIN_LIMIT:
        scope.error("S0106", call, f"the expression is more than {CHAIN_LIMIT} operators deep", "split it into statements")
        return None
    scope.operators += len(values)
    try:
        return _meaning(scope, call, name, values, kind, want)
    finally:
        scope.operators -= len(values)


def _assigned(scope: Scope, call: tree.Call) -> list[tree.Expr] | None:
    """The operand of `NOT (in := a)` where that assigns to a variable with the name of an input."""
    if len(call.arguments) != 1 or not scope.dialect.assignments_are_values:
        return None
    name, value = call.arguments[0].name, call.arguments[0].value
    if name is None or value is None or scope.variable(name.text) is None:
        return None
    return [tree.StructInit(name.start, value.end, ((name, value),))]


def _time_operator(scope: Scope, call: tree.Call, name: str, wanted: tuple[str, str], want: Type | None) -> Type | None:
    """ADD_TOD_TIME(a, b) means a + b, and takes these types only."""
    values = Arguments(scope, call, ["IN1", "IN2"]).in_order()
    if values is None:
        return None
    for value, type_name in zip(values, wanted, strict=True):
        kind = functions.named_type(type_name)
        if kind is None and not _is_number(scope, value) or \
                kind is not None and not scope.fit(value, kind, "S0405"):
            return None
    return _meaning(scope, call, name, values, None, want)


def _is_number(scope: Scope, value: tree.Expr) -> bool:
    """True for a number, whose type stays open if it is a literal; else a diagnostic."""
    kind = scope.infer(value)
    if kind is not None and not is_untyped(kind) and not is_any(kind, "ANY_NUM"):
        scope.error("S0405", value, f"a number is needed here, this is {kind}")
        return False
    return kind is not None


def _meaning(scope: Scope, call: tree.Call, name: str, values: list[tree.Expr], kind: Elementary | StringType | None,
             want: Type | None) -> Type | None:
    """The type of a call that means an operator between its arguments."""
    op = functions.OPERATORS[name]
    if name == "NOT":
        meaning: tree.Expr = tree.Unary(call.start, call.end, "NOT", values[0])
    else:
        meaning = values[0]
        for value in values[1:]:
            meaning = tree.Binary(call.start, call.end, op, meaning, value, value.start)
    result = scope.infer(meaning, kind or want)
    if is_untyped(result) and kind is not None:
        result = scope.adopt(meaning, kind)
    elif is_untyped(result) and call in scope.facts.guards:
        result = scope.settle(meaning, want)
    if result is None:
        return None
    if kind is not None and not converts(result, kind):
        scope.error("S0405", call, f"the arguments are {result}, {callee(call)} takes {kind}")
        return None
    scope.facts.rewritten[call] = meaning
    if meaning in scope.facts.constants and call not in scope.facts.guards:
        scope.facts.constants[call] = scope.facts.constants[meaning]
    return result


def _signature(scope: Scope, call: tree.Call, row: Signature, fixed: Elementary | StringType | None,
               want: Type | None) -> Type | str | None:
    """The result of a function with a signature, "" for none; `fixed` is the type in its name, as in MAX_INT."""
    values = Arguments(scope, call, [name for name, _ in row.parameters], row.repeats,
                       functions.OTHER_NAMES.get(row.key, ())).in_order()
    if values is None:
        return None
    if (whole := _whole(scope, call, row, values)) is not None:
        return whole
    wanted = _parameter_types(row, len(values))
    variable: Type | None = fixed
    if "T" in wanted and fixed is None:
        places = [v for v, w in zip(values, wanted, strict=True) if w == "T"]
        variable = _bind(scope, call, places, row, want if row.result == "T" else None)
        if variable is None:
            return None
    arguments = _fitted(scope, values, wanted, variable)
    if arguments is None or variable is not None and not _may_pass(scope, call, row, arguments, variable):
        return None
    if row.key == "TRUNC" and want is not None and is_any(want, "ANY_INT"):
        scope.facts.calls[call] = StandardCall(row.key, arguments, (arguments[0][1], base(want)))
        return base(want)
    scope.facts.calls[call] = StandardCall(row.key, arguments, (variable,) if variable else ())
    if row.result == "T":
        assert variable is not None
        return variable
    return ELEMENTARY[row.result] if row.result else ""


def _whole(scope: Scope, call: tree.Call, row: Signature, values: list[tree.Expr]) -> Type | None:
    """The type of TRUNC of a whole number, which is that number: CODESYS 2.3 takes it as a REAL without a message."""
    if row.key != "TRUNC" or not scope.dialect.narrowing:
        return None
    value = values[0]
    kind = scope.infer(value)
    if kind is None or not is_any(kind, "ANY_INT", "ANY_BIT") or kind == BOOL:
        return None
    scope.facts.rewritten[call] = value
    if value in scope.facts.constants:
        scope.facts.constants[call] = scope.facts.constants[value]
    return kind


def _parameter_types(row: Signature, count: int) -> list[str]:
    """The names of the types of so many parameters, of which the last one may repeat."""
    wanted = [kind for _, kind in row.parameters]
    return wanted + [wanted[-1]] * (count - len(wanted)) if wanted else []


def _fitted(scope: Scope, values: list[tree.Expr], wanted: list[str], variable: Type | None) -> Passed | None:
    """Each value with the type of its parameter, where `variable` stands for T; None after a diagnostic."""
    arguments = []
    for value, name in zip(values, wanted, strict=True):
        kind = variable if name == "T" else _parameter(scope, value, name)
        if kind is None or not scope.fit(value, kind, "S0405"):
            return None
        arguments.append((value, kind))
    return arguments


def _may_pass(scope: Scope, call: tree.Call, row: Signature, arguments: Passed, variable: Type) -> bool:
    """True if a function with a type variable can pass on values of this type; else a diagnostic."""
    if row.key in functions.BYTE_ORDER and not _may_reverse(scope, call, variable):
        return False
    whole = [value for value, kind in arguments if kind == variable and not machine(kind)]
    return not whole or _as_a_whole(scope, call, whole)


def _as_a_whole(scope: Scope, call: tree.Call, values: list[tree.Expr]) -> bool:
    """True if a function can pass on arrays or structures; else a diagnostic.

    The results of two calls of a function would lie in the same memory."""
    if call in scope.facts.guards:
        scope.error("S0405", call, f"{callee(call)} of an array or structure takes no EN and ENO", "write IF instead")
        return False
    made = [value for value in values if _is_result(scope, value)]
    if made and callee(call).upper() not in ("MOVE", *functions.BYTE_ORDER):
        scope.error("S0405", made[0], f"{callee(call)} chooses among variables, not among results of that size",
                    "assign the result to a variable first")
        return False
    return True


def _may_reverse(scope: Scope, call: tree.Call, kind: Type) -> bool:
    """True if the bytes of a value of this type may be reversed here; else a diagnostic."""
    if _holds_references(kind):
        scope.error("S0405", call, f"{callee(call)}: {kind} holds references, which have no order of bytes")
        return False
    if machine(kind) and machine(kind)[0] not in ("f", "s"):
        return True
    if call not in scope.facts.assigned or call in scope.facts.guards:
        scope.error("S0405", call, f"the bytes of {kind} change places in a variable only",
                    f"write  variable := {callee(call)}(...);  and nothing else in that statement")
        return False
    scope.facts.reversed_bytes.add(call)
    return True


def _is_result(scope: Scope, value: tree.Expr) -> bool:
    """True for a value that lies in the memory of a user's function."""
    called = scope.facts.calls.get(value) if isinstance(value, tree.Call) else None
    if isinstance(called, StandardCall) and called.key == "MOVE":
        return _is_result(scope, called.arguments[0][0])
    return isinstance(called, PouCall)


def _parameter(scope: Scope, value: tree.Expr, name: str) -> Type | None:
    """The type of a parameter that is no type variable; of a generic one the type of its argument."""
    if name not in GENERIC:
        return ELEMENTARY[name]
    kind = scope.settle(value)
    if kind is not None and name not in families(as_number(kind, scope.dialect)):
        scope.error("S0405", value, f"{name[4:]} is needed here, this is {kind}")
        return None
    return base(kind) if kind is not None else None


def _bind(scope: Scope, call: tree.Call, values: list[tree.Expr], row: Signature, want: Type | None) -> Type | None:
    """The one type in which all arguments of a type variable meet; None after a diagnostic."""
    inferred = [scope.infer(value, want) for value in values]
    kinds = [kind for kind in inferred if kind is not None]
    if len(kinds) < len(inferred):
        return None
    character = next((kind for kind in kinds if is_any(kind, "ANY_CHAR")), None)
    kinds = [as_character(scope, value, character) or kind for value, kind in zip(values, kinds, strict=True)]
    bound: Type | None = None
    for kind in kinds:
        if not is_untyped(kind):
            met = _met(bound, kind)
            if met is None:
                scope.error("S0405", call, f"{bound} and {kind} have no type in common")
                return None
            bound = met
    if UNTYPED_REAL in kinds and (bound is None or not is_any(bound, "ANY_REAL")):
        bound = _real(scope, bound, want)
    elif bound is None:
        bound = _integer(scope, call, values, row, want)
    return _limited(scope, call, bound, row) if bound is not None else None


def _met(bound: Type | None, kind: Type) -> Type | None:
    """The type in which one more argument and those before it meet; None if there is none."""
    if isinstance(kind, EnumType) or isinstance(bound, EnumType):
        return kind if bound in (None, kind) else None
    met = base(kind) if bound is None or same(kind, bound) else common(bound, kind)
    return string(functions.RESULT_STRING, met.wide) if isinstance(met, StringType) else met


def _real(scope: Scope, bound: Type | None, want: Type | None) -> Type:
    fits = want is not None and is_any(want, "ANY_REAL") and (bound is None or converts(bound, want))
    return base(want) if fits and want is not None else LREAL


def _integer(scope: Scope, call: tree.Call, values: list[tree.Expr], row: Signature, want: Type | None) -> Type | None:
    """The type of a type variable that met only untyped integers."""
    if row.limits == ("ANY_REAL",):
        return base(want) if want is not None and is_any(want, "ANY_REAL") else LREAL
    if want is not None and is_any(want, "ANY_NUM", "ANY_BIT") and set(row.limits) & families(want):
        return base(want)
    settled = [scope.settle(value) for value in values]
    bound: Type | None = settled[0]
    for kind in settled[1:]:
        bound = common(bound, kind) if bound is not None and kind is not None else None
    return bound


def _limited(scope: Scope, call: tree.Call, bound: Type, row: Signature) -> Type | None:
    good = set(row.limits) & families(bound) or isinstance(bound, EnumType) and "ENUMERATION" in row.limits
    if row.limits == ("ANY_REAL",) and not good and converts(bound, LREAL):
        return LREAL
    if row.limits == ("ANY_STRING",) and is_any(bound, "ANY_CHAR"):
        return string(functions.RESULT_STRING, bound.name == "WCHAR")
    if not good or is_block(bound):
        shown = " or ".join(_SHOWN.get(limit, limit) for limit in row.limits)
        is_length = row.key == "LEN" and isinstance(bound, ArrayType | OpenArrayType)
        scope.error("S0405", call, f"{callee(call)} is defined for {shown}, not for {bound}",
                    "an instance cannot be copied" if is_block(bound) else BOUNDS_HINT if is_length else "")
        return None
    return bound


# --- conversions ------------------------------------------------------------------------------------------------


def _enum_conversion(scope: Scope, name: str) -> Conversion | None:
    """`INT_TO_Color`, `Color_TO_INT` and the like, where Color is a declared enumeration."""
    sides = tuple(name.split("_TO_"))
    if len(sides) != 2 or sum(functions.long_name(side) in ELEMENTARY for side in sides) != 1:
        return None
    source, target = (side if isinstance(_named(scope, side), EnumType) else functions.long_name(side) for side in sides)
    known = _named(scope, source) is not None and _named(scope, target) is not None
    return Conversion(source, "TO", target) if known else None


def _conversion(scope: Scope, call: tree.Call, row: Conversion) -> Type | None:
    values = Arguments(scope, call, ["IN"]).in_order()
    if values is None:
        return None
    value = values[0]
    target = _named(scope, row.target)
    source = _named(scope, row.source) if row.source else _own(scope, value, row)
    if source is None or target is None or not scope.fit(value, source, "S0405"):
        return None
    if isinstance(source, StringType):
        source = string(functions.RESULT_STRING, source.wide)
    by_value = scope.dialect.reals_of_other_widths and row.form == "TO" and is_any(source, *_NUMBERS) and \
        is_any(target, *_NUMBERS)
    if not convertible(row.form, base(source), target) and not by_value:
        scope.error("S0405", call, f"{callee(call)} is not defined for {source}", _by_way_of(base(source), target))
        return None
    scope.facts.calls[call] = StandardCall(row.form, [(value, base(source))], (base(source), target))
    return target


def _by_way_of(source: Type, target: Type) -> str:
    """The hint for a real and a bit string of two widths: an integer between them says that the value is meant."""
    if is_any(source, "ANY_BIT") and is_any(target, "ANY_REAL"):
        number = UNSIGNED.get(source.name, "INT")
        return f"write {number}_TO_{target}({source}_TO_{number}(...)), or take {takers('reals_of_other_widths')}"
    if is_any(source, "ANY_REAL") and is_any(target, "ANY_BIT"):
        number = UNSIGNED.get(target.name, "INT")
        return f"write {number}_TO_{target}({source}_TO_{number}(...)), or take {takers('reals_of_other_widths')}"
    return ""


def _own(scope: Scope, value: tree.Expr, row: Conversion) -> Type | None:
    """The type of an argument that the name leaves open; a literal is BCD in the smallest bit string that holds it."""
    kind = scope.infer(value)
    number = scope.facts.constants.get(value)
    if row.form != "BCD_TO" or kind is not UNTYPED_INT or not isinstance(number, int):
        return scope.settle(value)
    smallest = next((name for name in ("BYTE", "WORD", "DWORD", "LWORD") if 0 <= number <= ELEMENTARY[name].high), "LWORD")
    return scope.adopt(value, ELEMENTARY[smallest], "S0405")


def _named(scope: Scope, name: str) -> Type | None:
    return functions.named_type(name) or scope.named_type(name)


def _holds_references(kind: Type) -> bool:
    """True if a reference lies in a value of this type."""
    if isinstance(kind, ArrayType):
        return _holds_references(kind.element)
    if isinstance(kind, StructType):
        return any(_holds_references(field.type) for field in kind.fields.values())
    return isinstance(kind, RefType)
