"""Intrinsics: calls that the compiler answers, such as SIZEOF, LOWER_BOUND, BITADR and __ISVALIDREF.

Source: IEC 61131-3 ed. 3 table 15, and the operators of CODESYS, of which some need what no program has here."""

from __future__ import annotations

from fbvm.base.areas import PORTABLE_AREAS
from fbvm.base.types import BOOL, DINT, DWORD, UDINT, AnyType, ArrayType, OpenArrayType, RefType, StructType, Type, string
from fbvm.check.calls import dynamic_memory
from fbvm.check.calls.arguments import Arguments
from fbvm.check.expressions import qualified
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import is_any
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import UNTYPED_INT, StandardCall, is_block
from fbvm.syntax import tree

_PARAMETERS = {"SIZEOF": ["IN"], "XSIZEOF": ["IN"], "LOWER_BOUND": ["ARR", "DIM"], "UPPER_BOUND": ["ARR", "DIM"],
               "__ISVALIDREF": ["REF"], "__POUNAME": [], "__POSITION": [], "BITADR": ["IN"], "__PLC_ADDRESS": ["IN"],
               "__QUERYINTERFACE": ["ITFOBJECT", "ITFDST"], "__QUERYPOINTER": ["ITFOBJECT", "PDST"],
               "__ISDYNAMIC": ["POINTER"]}
REFUSED = {
    "INDEXOF": ("S0901", "gives the number of a POU in the runtime system of CODESYS", "no program here needs it"),
    "ADRINST": ("S0901", "gives the place of the own instance", "pass the instance as VAR_IN_OUT"),
    "INI": ("S0901", "gives RETAIN variables of an instance their first values again", "assign these in the program"),
    "__VARINFO": ("S0901", "asks for a description that CODESYS keeps of a variable", "SIZEOF and ADR tell size and place"),
    "__CURRENTTASK": ("S0901", "asks for a task of the runtime system of CODESYS", "declare a program for each task"),
}
"""Operators of CODESYS that are refused: the code, what each does, and what to do here."""
NAMES = frozenset(_PARAMETERS) | frozenset(REFUSED) | {dynamic_memory.NEW, dynamic_memory.DELETE}
_SEGMENTS = {"M": 0x40000000, "I": 0x80000000, "Q": 0xC0000000}
"""What BITADR adds to the number of the bit, by area (CODESYS online help, BITADR)."""


def intrinsic(scope: Scope, call: tree.Call, name: str) -> Type | str | None:
    """The type of a call of the intrinsic `name`, folded, "" if it has no result; None after a diagnostic."""
    if name == dynamic_memory.NEW:
        return dynamic_memory.new(scope, call)
    if name == dynamic_memory.DELETE:
        return dynamic_memory.delete(scope, call)
    if name in REFUSED:
        code, what, hint = REFUSED[name]
        scope.error(code, call.callee, f"{name} {what}: it is understood but not executed", hint)
        return None
    values = Arguments(scope, call, _PARAMETERS[name]).in_order()
    if values is None:
        return None
    if name == "__POUNAME":
        shown = scope.pou.name.encode("latin-1", "replace") if scope.pou is not None else b""
        scope.facts.constants[call] = shown
        return string(max(1, len(shown)))
    if name == "__POSITION":
        return _position(scope, call)
    if name == "__ISVALIDREF":
        return _is_bound(scope, call, values[0])
    if name == "__ISDYNAMIC":
        return _is_dynamic(scope, call, values[0])
    if name in ("__QUERYINTERFACE", "__QUERYPOINTER"):
        return _query(scope, call, name, values[0], values[1])
    if name == "BITADR":
        return _bit_address(scope, call, values[0])
    if name == "__PLC_ADDRESS":
        return _plc_address(scope, call, values[0])
    if name in ("SIZEOF", "XSIZEOF"):
        return _size(scope, call, values[0])
    return _bound(scope, call, name, values[0], values[1])


def _position(scope: Scope, call: tree.Call) -> Type:
    """Where a statement or declaration stands, as a text (CODESYS online help, __POSITION).

    Lines and columns are those of the whole file, which diagnostics name, too; CODESYS counts them in each of its editors."""
    line, column = scope.source.place(call.start)
    statements = scope.pou.tree.body if scope.pou is not None else ()
    is_executed = any(statement.start <= call.start < statement.end for statement in statements)
    shown = f"Line {line}, Column {column} (Impl)" if is_executed else f"Line {line} (Decl)"
    scope.facts.constants[call] = shown.encode("ascii")
    return string(len(shown))


def _is_bound(scope: Scope, call: tree.Call, value: tree.Expr) -> Type | None:
    """__ISVALIDREF(r): TRUE if a REFERENCE TO is bound, an in-out, or an interface that refers to an object."""
    kind = scope.infer(value)
    if kind is None:
        return None
    variable = scope.facts.variables.get(value)
    refers = isinstance(kind, RefType) and kind.interface or variable is not None and variable.kind == "VAR_IN_OUT"
    if value not in scope.facts.followed and not refers:
        scope.error("S0405", value, "this is no variable that is declared REFERENCE TO", "compare a REF_TO with NULL")
        return None
    scope.facts.calls[call] = StandardCall("__ISVALIDREF", [(value, kind)])
    return BOOL


def _is_dynamic(scope: Scope, call: tree.Call, value: tree.Expr) -> Type | None:
    """__ISDYNAMIC(p): TRUE if a pointer is one to what __NEW has made."""
    kind = scope.infer(value)
    if kind is None:
        return None
    if not isinstance(kind, RefType) or not kind.moves:
        scope.error("S0405", value, f"__ISDYNAMIC asks a POINTER TO, this is {kind}")
        return None
    scope.facts.calls[call] = StandardCall("__ISDYNAMIC", [(value, kind)])
    return BOOL


def _query(scope: Scope, call: tree.Call, name: str, source: tree.Expr, target: tree.Expr) -> Type | None:
    """__QUERYINTERFACE(object, interface) and __QUERYPOINTER(object, pointer): BOOL, whether the object is of that type."""
    kind, wanted = scope.infer(source), scope.infer(target)
    if kind is None or wanted is None:
        return None
    what = "a variable of an interface" if name == "__QUERYINTERFACE" else "a POINTER TO a block"
    if not isinstance(wanted, RefType) or wanted.interface != (name == "__QUERYINTERFACE") or wanted.target is None or \
            not is_block(wanted.target) or not scope.is_variable(target):
        scope.error("S0405", target, f"{name} writes {what}, this is {wanted}")
        return None
    if isinstance(kind, StructType) and kind.block:
        scope.refer_to(source, kind)
    elif not (isinstance(kind, RefType) and kind.interface):
        scope.error("S0405", source, f"{name} asks an instance or an interface, this is {kind}")
        return None
    if not writable(scope, target, "be written"):
        return None
    scope.facts.calls[call] = StandardCall("__QUERY", [(source, kind), (target, wanted)])
    return BOOL


def _plc_address(scope: Scope, call: tree.Call, value: tree.Expr) -> Type | None:
    """__PLC_ADDRESS(x): where a variable lies for the index registers of ladder, 0 if they cannot point there."""
    kind = scope.infer(value)
    if kind is None:
        return None
    if not scope.is_variable(value):
        scope.error("S0407", value, "this is no variable, and has no address")
        return None
    scope.facts.calls[call] = StandardCall("__PLC_ADDRESS", [(value, kind)])
    return UDINT


def _bit_address(scope: Scope, call: tree.Call, value: tree.Expr) -> Type | None:
    """BITADR(x): the number of the bit in its area, with the area in the highest digit."""
    if scope.infer(value) is None:
        return None
    facts = scope.facts
    address = facts.directs.get(value) or (facts.variables[value].location if value in facts.variables else None)
    if address is None or address.area not in PORTABLE_AREAS:
        scope.error("S0405", value, "BITADR asks where in %I, %Q or %M a variable lies, and this lies in none of them",
                    "declare it AT %MX0.0")
        return None
    facts.constants[call] = _SEGMENTS[address.area.lstrip("%")[0]] + address.byte_offset() * 8 + (
        address.bit_in_byte() if address.bit is not None else 0)
    return DWORD


def _bound(scope: Scope, call: tree.Call, name: str, value: tree.Expr, dimension: tree.Expr) -> Type | None:
    """LOWER_BOUND(array, dimension) and UPPER_BOUND, as DINT; a constant but for ARRAY [*]."""
    kind = scope.infer(value)
    counted = scope.settle(dimension)
    if kind is None or counted is None:
        return None
    number = scope.facts.constants.get(dimension)
    if isinstance(number, bool) or not is_any(counted, "ANY_INT"):
        scope.error("S0405", dimension, f"{name} needs its dimension as an integer, this is {counted}")
        return None
    if not isinstance(kind, ArrayType | OpenArrayType):
        scope.error("S0405", value, f"{name} needs an array, this is {kind}")
        return None
    count = kind.dimensions if isinstance(kind, OpenArrayType) else len(kind.bounds)
    if isinstance(number, int) and not 1 <= number <= count:
        scope.error("S0405", dimension, f"{kind} has dimensions 1 to {count}, not {number}")
        return None
    if isinstance(number, int) and isinstance(kind, ArrayType):
        scope.facts.constants[call] = kind.bounds[number - 1][name == "UPPER_BOUND"]
    else:
        scope.facts.calls[call] = StandardCall(name, [(value, kind), (dimension, DINT)], (kind,))
    return DINT


def _size(scope: Scope, call: tree.Call, value: tree.Expr) -> Type | None:
    """SIZEOF(x) of a variable or a type: bytes, as a literal would be written but for ANY."""
    kind: Type | None = None
    if isinstance(value, tree.TypeOperand):
        resolved = scope.context.rules.type_of(scope, value.spec)
        if resolved is None:
            return None
        kind = resolved[0]
    elif (name := qualified.bare(scope, value)) is not None:
        kind = scope.named_type(name)
        pou = scope.project.pou(name, scope.source) if kind is None else None
        if pou is not None and pou.kind == "FUNCTION_BLOCK" and scope.context.interface(pou, scope.source, value):
            kind = pou.type
    if kind is None:
        kind = scope.settle(value)
    if kind is None:
        return None
    if isinstance(kind, AnyType):
        scope.facts.calls[call] = StandardCall("SIZEOF", [(value, kind)])
        return UDINT
    scope.facts.constants[call] = kind.size
    return UNTYPED_INT
