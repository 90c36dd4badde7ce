"""Assignability: which values a variable, an in-out and a conversion take, and the hints for those that they do not."""

from __future__ import annotations

from fbvm.base.dialects import DIALECTS, Dialect, option
from fbvm.base.types import (
    BOOL,
    ELEMENTARY,
    AnyType,
    ArrayType,
    Elementary,
    EnumType,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
    converts,
    derives,
    families,
    families_of,
    fold,
)
from fbvm.check.expressions.constants import limits
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, Value
from fbvm.syntax import tree

_PASSED_WITH_BOUNDS = OpenArrayType | AnyType


def is_untyped(kind: Type | None) -> bool:
    """True for a literal, or an expression of nothing but literals, that has no type yet."""
    return kind is UNTYPED_INT or kind is UNTYPED_REAL


def assignable(kind: Type, target: Type) -> bool:
    """True if a value of `kind` may be stored where `target` is declared, arrays and structures as a whole included."""
    if kind is target and isinstance(kind, Elementary):
        return True
    if isinstance(kind, _PASSED_WITH_BOUNDS):
        return False
    if isinstance(target, ArrayType) and isinstance(kind, ArrayType):
        return kind.bounds == target.bounds and same(kind.element, target.element) and not (kind.packed or target.packed)
    if isinstance(target, RefType) and target.interface and isinstance(kind, StructType):
        return kind.block and derives(kind, target.target)
    if isinstance(target, StructType) or isinstance(kind, StructType):
        return kind == target and not (isinstance(target, StructType) and target.block)
    return converts(kind, target)


def converted_by_dialect(kind: Type, target: Type, dialect: Dialect) -> bool:
    """True if a dialect converts a value implicitly where the standard demands a conversion function."""
    if isinstance(target, EnumType) and "strict" in target.attributes:
        return False
    if dialect.numbers_of_enumerations and (isinstance(kind, EnumType) or isinstance(target, EnumType)):
        kind = kind.base if isinstance(kind, EnumType) else kind
        target = target.base if isinstance(target, EnumType) else target
        if converts(kind, target):
            return True
    if dialect.instances_are_values and isinstance(target, StructType) and target.block:
        return kind == target
    kind, target = base(kind), base(target)
    if isinstance(kind, RefType) and kind.moves and isinstance(target, Elementary):
        return _holds_pointer(target, dialect)
    return any(getattr(dialect, switch) and holds_all(kind, target) for switch, holds_all in _BY_DIALECT)


def _holds_pointer(target: Elementary, dialect: Dialect) -> bool:
    """True if a dialect converts a pointer, which has 64 bits, or its address to a number."""
    return target in (ELEMENTARY["ULINT"], ELEMENTARY["LWORD"]) and dialect.integers_and_bits or \
        target in ADDRESSES and dialect.short_addresses


def _narrows(kind: Type, target: Type) -> bool:
    """True for a conversion between any two numbers or bit strings, but to BOOL, and between any two references."""
    if isinstance(kind, RefType) and isinstance(target, RefType):
        return True
    return is_any(kind, "ANY_NUM", "ANY_BIT") and is_any(target, "ANY_NUM", "ANY_BIT") and target != BOOL


def _holds_bits(kind: Type, target: Type) -> bool:
    """True for a conversion between integers and bit strings that keeps all bits, and of any number to a real; not for BOOL."""
    if not isinstance(kind, Elementary) or not isinstance(target, Elementary) or BOOL in (kind, target):
        return False
    if is_any(target, "ANY_REAL"):
        return is_any(kind, "ANY_INT", "ANY_REAL")
    return is_any(kind, "ANY_INT", "ANY_BIT") and is_any(target, "ANY_INT", "ANY_BIT") and kind.bits <= target.bits


def _holds_nanoseconds(kind: Type, target: Type) -> bool:
    """True for a conversion between durations, dates and moments, and between these and integers or bit strings."""
    times = [is_any(each, *_TIMES) for each in (kind, target)]
    return any(times) and all(time or is_any(each, "ANY_INT", "ANY_BIT") and each != BOOL
                              for time, each in zip(times, (kind, target), strict=True))


def _has_as_many(kind: Type, target: Type) -> bool:
    """True for two arrays that have as many elements of one type in each dimension."""
    if not isinstance(kind, ArrayType) or not isinstance(target, ArrayType) or kind.packed or target.packed:
        return False
    sizes, wanted = ([high - low for low, high in each.bounds] for each in (kind, target))
    return sizes == wanted and same(kind.element, target.element)


def _is_address(kind: Type, target: Type) -> bool:
    """True for a number that holds an address where a pointer is needed."""
    return kind in ADDRESSES and isinstance(target, RefType) and target.moves


_BY_DIALECT = (("short_addresses", _is_address), ("bounds_are_not_compared", _has_as_many),
               ("times_are_numbers", _holds_nanoseconds), ("narrowing", _narrows), ("integers_and_bits", _holds_bits))
"""Switches of dialects, and between which types each of them converts."""


def as_number(kind: Type, dialect: Dialect) -> Type:
    """The type in which a dialect computes with a value: a bit string as an unsigned number, an enumeration as its base."""
    if isinstance(kind, EnumType) and dialect.numbers_of_enumerations:
        kind = kind.base
    if dialect.arithmetic_of_bits and is_any(kind, "ANY_BIT") and kind != BOOL:
        return ELEMENTARY[UNSIGNED[kind.name]]
    return kind


ADDRESSES = (ELEMENTARY["DWORD"], ELEMENTARY["UDINT"])
"""What holds the address of a pointer in a dialect whose pointers have 32 bits."""
UNSIGNED = {"BYTE": "USINT", "WORD": "UINT", "DWORD": "UDINT", "LWORD": "ULINT"}
"""The unsigned number of each bit string."""


def holds(target: Type, kind: Type) -> bool:
    """True if an integer type holds every value of a subrange, as of the parts that SPLIT_DATE gives."""
    if not isinstance(kind, SubrangeType) or not is_any(target, "ANY_INT"):
        return False
    low, high = limits(target) or (1, 0)
    return low <= kind.low and kind.high <= high


def same(kind: Type, other: Type) -> bool:
    """True if a variable of `kind` may be passed to an in-out of type `other`: both are the same, but for open bounds."""
    if isinstance(other, AnyType):
        return kind == other or other.name in (families_of(kind.name) if isinstance(kind, AnyType) else families(kind))
    if isinstance(other, OpenArrayType):
        dimensions = len(kind.bounds) if isinstance(kind, ArrayType) else getattr(kind, "dimensions", 0)
        return isinstance(kind, ArrayType | OpenArrayType) and dimensions == other.dimensions and \
            same(kind.element, other.element) and not (isinstance(kind, ArrayType) and kind.packed)
    if isinstance(kind, ArrayType) and isinstance(other, ArrayType):
        return kind.bounds == other.bounds and same(kind.element, other.element) and kind.packed == other.packed
    return kind == other


# --- conversions ----------------------------------------------------------------------------------------------------

_TIMES = ("ANY_DURATION", "ANY_DATE")
_DATES = {
    ("DATE_AND_TIME", "DATE"), ("DATE_AND_TIME", "TIME_OF_DAY"), ("LDATE_AND_TIME", "LDATE"),
    ("LDATE_AND_TIME", "LTIME_OF_DAY"), ("LDATE_AND_TIME", "DATE"), ("LDATE_AND_TIME", "TIME_OF_DAY"),
    ("DATE_AND_TIME", "LTIME_OF_DAY"), ("DATE_AND_TIME", "LDATE"), ("DATE", "DATE_AND_TIME"), ("DATE", "LDATE_AND_TIME"),
    ("LDATE", "LDATE_AND_TIME"), ("LDATE", "DATE_AND_TIME"),
    ("TIME", "TIME_OF_DAY"), ("TIME_OF_DAY", "TIME"), ("LTIME", "LTIME_OF_DAY"), ("LTIME_OF_DAY", "LTIME"),
}


_FORMS = {"TRUNC": ("ANY_REAL", "ANY_INT"), "BCD_TO": ("ANY_BIT", "ANY_INT"), "TO_BCD": ("ANY_INT", "ANY_BIT")}
"""Source and target of the conversions that are none between any two types; BOOL is no BCD number."""


def convertible(form: str, source: Type, target: Type) -> bool:
    """True if the tables (22 to 27, and our additions) have the conversion; `form` is TO, TRUNC, BCD_TO or TO_BCD."""
    if form in _FORMS:
        of, to = _FORMS[form]
        return is_any(source, of) and is_any(target, to) and BOOL not in (source, target)
    if not isinstance(source, Elementary | StringType | EnumType):
        return False
    both = source, target
    if isinstance(source, EnumType) or isinstance(target, EnumType):
        return any(is_any(kind, "ANY_INT", "ANY_BIT", "ANY_STRING") for kind in both)
    if isinstance(source, StringType) or isinstance(target, StringType):
        return True
    if any(is_any(kind, "ANY_CHAR") for kind in both):
        return all(is_any(kind, "ANY_CHAR", "ANY_INT", "ANY_BIT") and kind != BOOL for kind in both)
    if any(is_any(kind, *_TIMES) for kind in both):
        return _time_convertible(source, target)
    if any(is_any(one, "ANY_REAL") and is_any(other, "ANY_BIT") for one, other in (both, both[::-1])):
        return BOOL in both or source.size == target.size  # the bits of a real; those of a BOOL are its truth
    return True


def _time_convertible(source: Type, target: Type) -> bool:
    """True for a conversion between a time or date and another one or a number."""
    timed = [is_any(kind, *_TIMES) for kind in (source, target)]
    if not all(timed):
        return is_any(target if timed[0] else source, "ANY_NUM", "ANY_BIT")
    short = [kind.name.removeprefix("L") for kind in (source, target)]
    return short[0] == short[1] or (source.name, target.name) in _DATES


# --- hints ----------------------------------------------------------------------------------------------------------


def hidden_hint(expr: tree.Expr, target: Type) -> str:
    """What to write for a name that means a variable here, and a member of the enumeration that is needed; "" for others."""
    if isinstance(expr, tree.NameRef) and isinstance(target, EnumType) and fold(expr.text) in target.members:
        return f"a variable hides the member: write {target}#{expr.text}"
    return ""


BOUNDS_HINT = "how long an array is say LOWER_BOUND(a, 1) and UPPER_BOUND(a, 1)"


def mismatch_hint(expr: tree.Expr, kind: Type, target: Type) -> str:
    """What to write where `expr` of type `kind` stands and `target` is needed: a literal another way, else a conversion."""
    wanted = base(target)
    if isinstance(expr, tree.Literal) and isinstance(expr.value, str) and isinstance(wanted, StringType):
        return f"a {wanted.name.partition('[')[0]} literal stands in {'double' if wanted.wide else 'single'} quotes"
    if isinstance(expr, tree.Literal):
        hint = literal_hint(expr.value if isinstance(expr.value, int | float | str) else None, base(target))
    else:
        hint = bcd_hint(expr, target) or conversion_hint(kind, target)
    takers = [row for row in DIALECTS.values() if row.offered and converted_by_dialect(kind, target, row)]
    return hint + (", or " if hint and takers else "") + (f"take {option(takers)}" if takers else "")


def conversion_hint(kind: Type, target: Type) -> str:
    """How to turn a value of one type into another, "" if there is no conversion."""
    source, wanted = base(kind), base(target)
    if isinstance(source, RefType) or isinstance(wanted, RefType):
        return _reference_hint(source, wanted)
    if wanted == BOOL and not isinstance(source, StructType):
        return comparison_hint(source)
    if isinstance(source, ArrayType) and source.element == wanted:
        return f"one of its elements is meant: write [{', '.join(str(low) for low, _ in source.bounds)}] behind it"
    if isinstance(source, StructType) and source.block:
        outputs = [field.name for field in source.fields.values() if field.kind == "VAR_OUTPUT"]
        return f"name an output of the instance: {' or '.join(outputs[:4])}" if outputs else ""
    return _function_hint(source, wanted)


def _function_hint(source: Type, wanted: Type) -> str:
    """The conversion function to write; "" if there is none."""
    if isinstance(source, StringType) and isinstance(wanted, EnumType):
        return f"no function makes a member of a text: compare it, and assign a member, such as {wanted}#{_first_of(wanted)}"
    if not all(isinstance(t, Elementary | StringType | EnumType) for t in (source, wanted)) or \
            source == wanted or not convertible("TO", source, wanted):
        return ""
    names = [t.name.partition("[")[0] for t in (source, wanted)]
    if isinstance(source, EnumType):
        return f"write TO_{names[1]}(...)"
    return f"write {names[0]}_TO_{names[1]}(...)"


def _first_of(kind: EnumType) -> str:
    return next(iter(kind.shown.values()))


def bcd_hint(call: tree.Expr, target: Type) -> str:
    """For BCD_TO_INT where another integer is needed, the function for that; "" for other expressions."""
    callee = call.callee if isinstance(call, tree.Call) else None
    name = fold(callee.text) if isinstance(callee, tree.NameRef) else ""
    wanted = base(target).name
    return f"write BCD_TO_{wanted}(...)" if name.startswith("BCD_TO_") and wanted in _BCD else ""


_BCD = ("USINT", "UINT", "UDINT", "ULINT", "INT", "DINT", "LINT", "SINT")


def _reference_hint(source: Type, wanted: Type) -> str:
    """What to write where a reference meets a value."""
    if isinstance(source, RefType) and isinstance(wanted, RefType):
        return "REF_TO and REFERENCE TO have one type; POINTER TO, which ADR(...) gives, may change it" \
            if not source.moves and not wanted.moves else ""
    if isinstance(source, RefType):
        if wanted == source.target:
            return "^ behind a reference is what it refers to"
        if wanted == BOOL:
            return "compare it with NULL"
        return "a reference is no number here: keep it in a POINTER TO, such as PVOID"
    assert isinstance(wanted, RefType)
    made = "ADR" if wanted.moves else "REF"
    return f"write {made}(...)" if source == wanted.target else f"a reference is made of a variable: {made}(x)"


def comparison_hint(kind: Type) -> str:
    """What to write where a BOOL is needed."""
    if is_any(kind, "ANY_NUM", "ANY_BIT"):
        return "compare it, for example with <> 0"
    if isinstance(kind, StringType):
        return "compare it, for example with = 'text'"
    return "compare it" if is_any(kind, "ANY_ELEMENTARY") or isinstance(kind, EnumType) else ""


def literal_hint(value: Value | None, kind: Type) -> str:
    """How a literal of `kind` is written; the hint where another literal stands."""
    if kind == BOOL:
        return "write TRUE or FALSE, or a comparison"
    if isinstance(kind, StringType):
        return 'a WSTRING is written "text"' if kind.wide else "a text is written 'text'"
    if is_any(kind, "ANY_CHAR"):
        return 'a WCHAR is one character, written "A"' if kind.name == "WCHAR" else "a CHAR is one character, written 'A'"
    if isinstance(kind, RefType):
        return "a reference is made of a variable, or NULL"
    if isinstance(kind, EnumType):
        number = kind.members.get(fold(value)) if isinstance(value, str) else value
        same = kind.shown.get(number) if isinstance(number, int) else None
        return f"name a member, such as {kind}#{same or _first_of(kind)}"
    time_ms = value if isinstance(value, int) and value > 0 and not isinstance(value, bool) else 500
    for name, written in (("DURATION", f"a duration is written T#{time_ms}ms"), ("DATE", f"a literal is written {_dated(kind)}")):
        if f"ANY_{name}" in families(kind):
            return written
    if is_any(kind, "ANY_INT") and isinstance(value, float):
        return "write a number without a point"
    return "write a number" if is_any(kind, "ANY_NUM", "ANY_BIT") else ""


def _dated(kind: Type) -> str:
    day, time = "2024-12-31", "23:59:59"
    return {"DATE": f"D#{day}", "TIME_OF_DAY": f"TOD#{time}"}.get(kind.name.removeprefix("L"), f"DT#{day}-{time}")
