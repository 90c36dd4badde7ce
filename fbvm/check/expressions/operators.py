"""Operators: on which types each works, and in which type (IEC 61131-3 ed. 3, tables 28 to 33 and 71)."""

from __future__ import annotations

from fbvm.base.dialects import Dialect, takers
from fbvm.base.types import (
    BOOL,
    DATE,
    DINT,
    DT,
    ELEMENTARY,
    IMPLICIT,
    LINT,
    LREAL,
    NULL,
    REAL,
    TIME,
    TOD,
    UDINT,
    USINT,
    Elementary,
    EnumType,
    RefType,
    StringType,
    Type,
    base,
    common,
    converts,
    fold,
    machine,
)
from fbvm.check.expressions import constants
from fbvm.check.expressions.assignability import ADDRESSES, UNSIGNED, as_number, is_untyped
from fbvm.check.expressions.literals import as_character
from fbvm.check.expressions.operator_hints import COMPARISONS, bit_hint, report_larger, report_undefined
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, Value
from fbvm.syntax import tree

_FAMILY = {
    "+": ("ANY_NUM",), "-": ("ANY_NUM",), "*": ("ANY_NUM",), "/": ("ANY_NUM",), "MOD": ("ANY_INT",),
    "AND": ("ANY_BIT",), "OR": ("ANY_BIT",), "XOR": ("ANY_BIT",),
}
_L: dict[Type, Type] = {DATE: ELEMENTARY["LDATE"], TOD: ELEMENTARY["LTIME_OF_DAY"], DT: ELEMENTARY["LDATE_AND_TIME"],
                        TIME: ELEMENTARY["LTIME"]}


def _time_rows() -> dict[tuple[str, Type, Type], Type]:
    """What + and - mean on times and dates: (operator, left, right) -> result; the L types only among themselves."""
    rows: dict[tuple[str, Type, Type], Type] = {}
    for op in "+-":
        for left in (TIME, TOD, DT):
            rows[op, left, TIME] = left
    for left in (DATE, TOD, DT):
        rows["-", left, left] = TIME
    return rows | {(op, _L[a], _L[b]): _L[r] for (op, a, b), r in rows.items()}


TIMES = _time_rows()


# --- unary ------------------------------------------------------------------------------------------------------


def unary(scope: Scope, expr: tree.Unary, want: Type | None) -> Type | None:
    kind = scope.infer(expr.operand, want)
    if kind is None:
        return None
    if expr.op == "NOT":
        if kind is UNTYPED_INT and want is not None and is_any(want, "ANY_BIT"):
            kind = scope.adopt(expr.operand, want)
            if kind is None:
                return None
        good = is_any(kind, *_family(scope, "AND"))
    else:
        good = is_untyped(kind) or is_any(kind, "ANY_NUM", "ANY_DURATION")
    if not good and is_any(kind, "ANY_BIT") and kind != BOOL and scope.dialect.arithmetic_of_bits:
        zero = tree.Literal(expr.start, expr.start, "int", 0, base(kind).name, f"{base(kind).name}#0")
        scope.facts.rewritten[expr] = meant = tree.Binary(expr.start, expr.end, expr.op, zero, expr.operand, expr.start)
        return scope.infer(meant, want)
    if not good:
        scope.error("S0302", expr, f"{expr.op} is not defined for {kind}",
                    _unary_hint(expr.op, base(kind), want))
        return None
    kind = base(kind)
    value = scope.facts.constants.get(expr.operand)
    if value is not None:
        scope.facts.constants[expr] = constants.unary(expr.op, kind, value)
    return kind


def _unary_hint(op: str, kind: Type, want: Type | None) -> str:
    """What to write where a sign or NOT meets a type for which it is not defined."""
    if op == "NOT":
        return bit_hint(kind, want) + (f", or take {takers('integers_and_bits')}" if is_any(kind, "ANY_INT") else "")
    if kind.name in UNSIGNED:
        return f"convert with {kind}_TO_{UNSIGNED[kind.name]}(...), or take {takers('arithmetic_of_bits')}"
    return ""


# --- binary -----------------------------------------------------------------------------------------------------


def binary(scope: Scope, expr: tree.Binary, want: Type | None) -> Type | None:
    hint = want if expr.op not in COMPARISONS else None
    left = scope.infer(expr.left, hint)
    is_bits = hint is None and expr.op in ("AND", "OR", "XOR") and left is not None and is_any(left, "ANY_BIT")
    right = scope.infer(expr.right, left if is_bits else hint)  # w XOR NOT 16#F0
    if left is None or right is None:
        return None
    left, right = base(left), base(right)
    if expr.left in scope.facts.constants or expr.right in scope.facts.constants:
        return _meant(scope, expr, left, right, want)
    known = scope.project.operator_types.get((expr.op, left, right))
    if known is not None:
        scope.facts.operands[expr], result = known
        return result
    found = _meant(scope, expr, left, right, want)
    if isinstance(left, Elementary) and isinstance(right, Elementary) and found is not None and \
            expr not in scope.facts.rewritten:
        scope.project.operator_types[expr.op, left, right] = scope.facts.operands[expr], found
    return found


def _meant(scope: Scope, expr: tree.Binary, left: Type, right: Type, want: Type | None) -> Type | None:
    """The type of an operator's result, or None after a diagnostic."""
    if _chained(scope, expr, right):
        return None
    left = as_character(scope, expr.left, right) or left
    right = as_character(scope, expr.right, left) or right
    if expr.op == "**":
        return _power(scope, expr, left, right, want)
    if isinstance(left, RefType) or isinstance(right, RefType):
        return _reference(scope, expr)
    if expr.op in COMPARISONS and (spans := _beside_duration(scope, expr, left, right)) is not None:
        return scope.infer(spans)
    timed = _time(scope, expr, left, right)
    if timed is not None:
        return _folded(scope, expr, timed, timed)
    kind = _operand_type(scope, expr, left, right, want)
    if kind is None or not _defined(scope, expr, kind):
        numbers = _as_numbers(scope, expr, left, right, want)
        if numbers is not None:
            return numbers
        report_undefined(scope, expr, left, right, want)
        return None
    kind = _widened(scope, expr.op, kind)
    if not is_untyped(kind):
        for side, side_kind in ((expr.left, left), (expr.right, right)):
            if is_untyped(side_kind) and (report_larger(scope, expr.op, side, kind) or scope.adopt(side, kind) is None):
                return None
    return _folded(scope, expr, kind, BOOL if expr.op in COMPARISONS else kind)


def _reference(scope: Scope, expr: tree.Binary) -> Type | None:
    """The type of an operator with a reference: references are compared; pointers are ordered too, and moved by numbers of
    bytes; in a dialect that counts elements all references are moved."""
    left, right = (_beside_reference(scope, expr, side) for side in (expr.left, expr.right))
    counts = scope.dialect.pointers_count_elements
    if expr.op in COMPARISONS and scope.dialect.short_addresses and (address := _address(left, right)) is not None:
        return _folded(scope, expr, address, BOOL)
    result = _compared_references(expr.op, left, right) if expr.op in COMPARISONS else _moved(expr.op, left, right, counts)
    if result is None:
        report_undefined(scope, expr, left, right, None)
        return None
    scope.facts.operands[expr] = NULL
    if counts and isinstance(result, RefType) and not _made_by_adr(scope, expr):
        scope.facts.by_elements.add(expr)
    return result


def _address(left: Type, right: Type) -> Type | None:
    """The number that holds an address, where a pointer is compared with one; else None."""
    for pointer, number in ((left, right), (right, left)):
        if isinstance(pointer, RefType) and pointer.moves and number in ADDRESSES:
            return number
    return None


def _compared_references(op: str, left: Type, right: Type) -> Type | None:
    """BOOL if two references are compared for equality, or two pointers in any way; else None."""
    if not isinstance(left, RefType) or not isinstance(right, RefType):
        return None
    return BOOL if left.moves and right.moves or op in ("=", "<>") and common(left, right) is not None else None


def _moved(op: str, left: Type, right: Type, counts: bool) -> Type | None:
    """The type of a sum or difference with a reference, None if there is none; with `counts` all references are moved."""
    moves = [isinstance(kind, RefType) and kind.moves for kind in (left, right)]
    if op == "-" and all(moves):
        return DINT
    if counts:
        moves = [isinstance(kind, RefType) and kind.target is not None for kind in (left, right)]
    if op in ("+", "-") and moves[0] and is_any(right, "ANY_INT", "ANY_BIT"):
        return left
    return right if op == "+" and moves[1] and is_any(left, "ANY_INT", "ANY_BIT") else None


def _made_by_adr(scope: Scope, expr: tree.Expr) -> bool:
    """True for a sum with ADR(x) as its pointer: ADR gives bytes, also in a dialect that counts elements."""
    while isinstance(expr, tree.Binary):
        expr = expr.left if isinstance(scope.facts.types[expr.left], RefType) else expr.right
    return isinstance(expr, tree.Call) and isinstance(expr.callee, tree.NameRef) and fold(expr.callee.text) == "ADR"


def _is_strict(expr: tree.Binary, *operands: Type) -> bool:
    """True for arithmetic of an enumeration with the attribute strict."""
    return expr.op not in COMPARISONS and any(isinstance(kind, EnumType) and "strict" in kind.attributes for kind in operands)


def _as_numbers(scope: Scope, expr: tree.Binary, left: Type, right: Type, want: Type | None) -> Type | None:
    """The type of an operator in a dialect that takes bit strings and enumerations as numbers; None if the dialect does not."""
    dialect = scope.dialect
    number = is_untyped(left) or is_any(left, "ANY_NUM")
    if expr.op == "*" and dialect.number_times_duration and is_any(right, "ANY_DURATION") and number:
        turned = tree.Binary(expr.start, expr.end, "*", expr.right, expr.left, expr.op_start)
        scope.facts.rewritten[expr] = turned
        return scope.infer(turned)
    timed = _nanoseconds(scope, expr, left, right)
    if timed is not None:
        return scope.infer(timed)
    a, b = _numbers(expr.op, left, right, dialect)
    if (a, b) == (left, right) or _is_strict(expr, left, right):
        return None
    kind = _operand_type(scope, expr, a, b, want)
    if kind is None or not _defined(scope, expr, kind):
        return None
    kind = _widened(scope, expr.op, kind)
    for side, side_kind in ((expr.left, a), (expr.right, b)):
        if is_untyped(side_kind) and scope.adopt(side, kind) is None:
            return None
    keeps = left != a and right in (left, UNTYPED_INT) and machine(kind) == machine(left)
    result = left if keeps else kind
    return _folded(scope, expr, kind, BOOL if expr.op in COMPARISONS else result)


def _numbers(op: str, left: Type, right: Type, dialect: Dialect) -> tuple[Type, Type]:
    """Both types as the numbers that a dialect takes them for; a BOOL is one beside a number with which it is compared."""
    if op in COMPARISONS and dialect.narrowing and (left == BOOL) is not (right == BOOL):
        left, right = (USINT if kind == BOOL else kind for kind in (left, right))
    return as_number(left, dialect), as_number(right, dialect)


def _beside_duration(scope: Scope, expr: tree.Binary, left: Type, right: Type) -> tree.Binary | None:
    """A comparison of a duration with an integer in a dialect that takes 0, or any integer as nanoseconds: what it means."""
    for side, literal, other in ((expr.left, left, right), (expr.right, right, left)):
        zero = literal is UNTYPED_INT and scope.facts.constants.get(side) == 0
        if not zero or not isinstance(other, Elementary) or not is_any(other, "ANY_DURATION"):
            continue
        if not scope.dialect.zero_durations and not scope.dialect.integers_are_nanoseconds:
            scope.error("S0301", side, f"an integer literal does not fit {other}",
                        f"a duration is written T#0s, or take {takers('zero_durations')}")
        elif scope.dialect.zero_durations:
            span = tree.Literal(side.start, side.end, "time", 0, other.name, f"{other.name}#0s")
            left_side, right_side = (span, expr.right) if side is expr.left else (expr.left, span)
            meant = tree.Binary(expr.start, expr.end, expr.op, left_side, right_side, expr.op_start)
            scope.facts.rewritten[expr] = meant
            return meant
    return _nanoseconds(scope, expr, left, right)


def _nanoseconds(scope: Scope, expr: tree.Binary, left: Type, right: Type) -> tree.Binary | None:
    """A sum of a duration and an integer in a dialect that takes integers as nanoseconds: what it means."""
    integer = [kind is UNTYPED_INT or is_any(kind, "ANY_INT") for kind in (left, right)]
    duration = [is_any(kind, "ANY_DURATION") for kind in (left, right)]
    turned = integer[0] and duration[1] and expr.op == "+"
    turned = turned or integer[0] and duration[1] and expr.op in COMPARISONS
    if not scope.dialect.integers_are_nanoseconds or expr.op not in ("+", "-", *COMPARISONS) or \
            not (turned or duration[0] and integer[1]):
        return None
    kind, number = (right, expr.left) if turned else (left, expr.right)
    unit = tree.Literal(number.start, number.end, "time", 1, kind.name, f"{kind.name}#1ns")
    span = tree.Binary(number.start, number.end, "*", unit, number, number.start)
    left_side, right_side = (span, expr.right) if turned else (expr.left, span)
    meant = tree.Binary(expr.start, expr.end, expr.op, left_side, right_side, expr.op_start)
    scope.facts.rewritten[expr] = meant
    return meant


def _beside_reference(scope: Scope, expr: tree.Binary, side: tree.Expr) -> Type:
    """The type of an operand of an operator on references; a literal 0 that is compared is NULL."""
    kind = scope.facts.types[side]
    if kind is UNTYPED_INT:
        null = expr.op in COMPARISONS and scope.facts.constants[side] == 0
        number = UDINT if expr.op in COMPARISONS and scope.dialect.short_addresses else LINT
        kind = scope.adopt(side, NULL if null else number) or kind
    return kind


def _chained(scope: Scope, expr: tree.Binary, right: Type) -> bool:
    """Report `a < b < c`, which compares a BOOL with a number; True if it did."""
    first = expr.left
    if expr.op not in COMPARISONS[2:] or not isinstance(first, tree.Binary) or first.op not in COMPARISONS or right == BOOL:
        return False
    text = scope.text
    meant = f"write {text(first)} AND {text(first.right)} {expr.op} {text(expr.right)}"
    if scope.dialect.narrowing:
        scope.error("S0193", expr, f"this compares a BOOL, 0 or 1, with {right}", meant)
        return False
    scope.error("S0302", expr, f"{expr.op} is not defined for BOOL and {right}", meant)
    return True


def _operand_type(scope: Scope, expr: tree.Binary, left: Type, right: Type, want: Type | None) -> Type | None:
    """The type in which both operands meet."""
    if is_untyped(left) and is_untyped(right):
        kind = left if left is UNTYPED_REAL else right
        return BOOL if expr.op in ("AND_THEN", "OR_ELSE") else kind
    for side, literal, other in ((expr.left, left, right), (expr.right, right, left)):
        if literal is UNTYPED_INT:
            return _meet_integer(scope, expr.op, side, other)
        if literal is UNTYPED_REAL:
            return _meet_real(scope, other, want)
    if isinstance(left, EnumType) and left == right:
        return left
    return common(left, right)


def _meet_integer(scope: Scope, op: str, literal: tree.Expr, other: Type) -> Type:
    """The type in which an untyped integer meets `other`: that, or if it does not hold it a larger one, in which is computed,
    and in dialects that compare numbers of different types compared."""
    value, span, compares = scope.facts.constants.get(literal), constants.limits(other), op in COMPARISONS
    number = as_number(base(other), scope.dialect) if compares else other
    if not isinstance(value, int) or span is None or not is_any(number, "ANY_INT") or span[0] <= value <= span[1]:
        return other
    if compares and (not scope.dialect.integers_and_bits or value < span[0]):
        return other
    larger = (ELEMENTARY[name] for name in IMPLICIT[base(number).name] if is_any(ELEMENTARY[name], "ANY_INT"))
    return next((kind for kind in larger if kind.low <= value <= kind.high), other)


def _meet_real(scope: Scope, other: Type, want: Type | None) -> Type | None:
    """The real type in which an untyped real literal meets `other`."""
    if is_any(other, "ANY_REAL"):
        return other
    if want is not None and is_any(want, "ANY_REAL") and converts(other, base(want)):
        return base(want)
    return LREAL if converts(other, LREAL) else None


def _defined(scope: Scope, expr: tree.Binary, kind: Type) -> bool:
    op = expr.op
    if op in ("AND_THEN", "OR_ELSE"):
        return kind == BOOL
    if op in COMPARISONS:
        if isinstance(kind, EnumType | RefType):
            return op in ("=", "<>")
        return isinstance(kind, Elementary | StringType)
    if kind is UNTYPED_INT:
        return True
    if kind is UNTYPED_REAL:
        return _FAMILY[op] == ("ANY_NUM",)
    return is_any(kind, *_family(scope, op))


def _widened(scope: Scope, op: str, kind: Type) -> Type:
    """The type in which a dialect computes: DINT for what is smaller, where it takes sums so."""
    small = op in ("+", "-", "*", "/", "MOD") and is_any(kind, "ANY_INT") and 0 < kind.size < DINT.size
    return DINT if small and scope.dialect.sums_in_dint else kind


def _family(scope: Scope, op: str) -> tuple[str, ...]:
    """The generic types that an operator works on; dialects take the bits of integers too."""
    family = _FAMILY[op]
    return (*family, "ANY_INT") if family == ("ANY_BIT",) and scope.dialect.integers_and_bits else family


def _time(scope: Scope, expr: tree.Binary, left: Type, right: Type) -> Type | None:
    """The result of an operator on times and dates, or None if it is none of those."""
    result = TIMES.get((expr.op, left, right))
    if result is None and expr.op in "+-" and (left, right) == (DATE, TIME) and scope.dialect.dates_take_durations:
        result = DATE
    if result is None and expr.op in "+-" and common(left, right) is not None:
        met = common(left, right)
        assert met is not None
        result = TIMES.get((expr.op, met, met)) if is_any(left, "ANY_DURATION", "ANY_DATE") else None
    if result is not None:
        scope.facts.operands[expr] = result
        return result
    if expr.op in "*/" and is_any(left, "ANY_DURATION") and \
            (is_untyped(right) or is_any(as_number(right, scope.dialect), "ANY_NUM")):
        if is_untyped(right):
            scope.adopt(expr.right, LINT if right is UNTYPED_INT else LREAL)
        scope.facts.operands[expr] = left
        return left
    return None


def _power(scope: Scope, expr: tree.Binary, left: Type, right: Type, want: Type | None) -> Type | None:
    """`a ** b`: a real base keeps its type, an integer one gives LREAL."""
    if is_untyped(left) and is_untyped(right):
        return _folded(scope, expr, UNTYPED_REAL, UNTYPED_REAL)
    left, right = as_number(left, scope.dialect), as_number(right, scope.dialect)
    if not all(is_untyped(k) or is_any(k, "ANY_NUM") for k in (left, right)):
        report_undefined(scope, expr, left, right, want)
        return None
    kind: Type = left if is_any(left, "ANY_REAL") else LREAL
    single = is_untyped(left) and right == REAL or left is UNTYPED_REAL and is_any(right, "ANY_INT")
    if single and want is not None and base(want) == REAL:
        kind = REAL
    for side, side_kind in ((expr.left, left), (expr.right, right)):
        if is_untyped(side_kind):
            scope.adopt(side, kind)
    return _folded(scope, expr, kind, kind)


def _folded(scope: Scope, expr: tree.Binary, operand: Type, result: Type) -> Type | None:
    """Note the operand type; work out the value if both sides are constant."""
    scope.facts.operands.setdefault(expr, operand)
    a, b = scope.facts.constants.get(expr.left), scope.facts.constants.get(expr.right)
    if a is None or b is None:
        return result if b != 0 or _may_divide_by_zero(scope, expr, operand) else None
    if isinstance(operand, Elementary | EnumType | StringType):
        try:
            scope.facts.constants[expr] = _constant(scope, expr, operand, a, b)
        except constants.NotConstant as error:
            scope.error("S0703", expr, f"the constant expression has no value: {error}")
            return None
        scope.unbounded(expr, (a, b))
    if operand is UNTYPED_INT and result is BOOL or operand is UNTYPED_REAL and result is BOOL:
        scope.facts.operands[expr] = LREAL if operand is UNTYPED_REAL else LINT
    return result


def _may_divide_by_zero(scope: Scope, expr: tree.Binary, operand: Type) -> bool:
    """False after a diagnostic for an integer that is divided by the constant 0; a warning for a real."""
    if expr.op in ("/", "MOD") and is_any(operand, "ANY_INT"):
        scope.error("S0703", expr.right, "this divides by zero")
        return False
    if expr.op == "/" and is_any(operand, "ANY_REAL"):
        scope.loses(expr.right, "S0792", "this divides by zero: the result is infinite or no number")
    return True


def _constant(scope: Scope, expr: tree.Binary, operand: Type, a: Value, b: Value) -> Value:
    """The value of an operator between constants.  Raises NotConstant."""
    if expr.op in "+-" and isinstance(a, int) and isinstance(b, int) and constants.is_moment(scope.facts.types[expr.left]):
        return constants.moment(expr.op, a, b)
    if not is_untyped(operand) and not is_any(operand, "ANY_DURATION", "ANY_DATE"):
        a, b = constants.convert(a, operand), constants.convert(b, operand)
    return constants.binary(expr.op, operand, a, b)
