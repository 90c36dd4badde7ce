"""The scope of an expression: the names that it sees, and the type and constant that it gets."""

from __future__ import annotations

import math
from collections.abc import Iterable

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import (
    BOOL,
    DINT,
    INT,
    LINT,
    LREAL,
    ULINT,
    AnyType,
    Elementary,
    EnumType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
    converts,
    fold,
)
from fbvm.check.expressions import any_parameters, powers
from fbvm.check.expressions.assignability import (
    assignable,
    conversion_hint,
    converted_by_dialect,
    hidden_hint,
    is_untyped,
    literal_hint,
    mismatch_hint,
)
from fbvm.check.expressions.constants import convert, cut, limits
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import (
    UNTYPED_INT,
    UNTYPED_REAL,
    Aggregate,
    AggregatePart,
    Facts,
    Pou,
    Value,
    Variable,
    is_block,
)
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder
from fbvm.syntax.tree.node import written

_BEHIND_REFERENCE = frozenset((tree.Deref, tree.Index, ladder.Memory, ladder.Words, ladder.Contents))
"""Expressions that name a place in memory without a variable."""
_PLACES = _BEHIND_REFERENCE | {tree.NameRef, tree.Direct, tree.Member, tree.Part}
"""Expressions that may name a place in memory."""
_CONSTANT_PLACES = ("S0503", "S0705", "S0801")
"""Codes of places whose values must be known before the program runs: a conversion does not help there."""


class Scope:
    """Where expressions stand: a source, and the POU whose variables they see (None in types and global declarations).

    In the `late` scope of a POU are the initial values that its frame gets at each start of the body.  The rules of all
    expressions get the scope, and call `infer` for the parts of an expression."""

    def __init__(self, context: Context, source: Source, pou: Pou | None, late: bool = False) -> None:
        self.context = context
        self.project = context.project
        self.dialect = context.project.dialect
        self.facts: Facts = context.facts
        self.source = source
        self.pou = pou
        self.late = late
        self._rules = context.rules.expressions
        self._types = context.facts.types
        self.qualifiers: set[tree.NameRef] = set()
        """Names that stand in front of a point."""
        self.counters: list[tuple[object, ...]] = []
        """Places of the counters of the FOR loops around the present statement."""
        self.operators = 0
        """Operators that calls around the present expression mean, each of which is one level of the tree."""

    def error(self, code: str, node: tree.Node, message: str, hint: str = "",
              related: tuple[Source, int, str] | None = None) -> None:
        self.project.report.add(code, self.source, node, message, hint, related)

    def text(self, node: tree.Node) -> str:
        """A piece of the program as it is written, for messages."""
        return written(self.source.text, node)

    # --- entry points -----------------------------------------------------------------------------------------------

    def infer(self, expr: tree.Expr, want: Type | None = None) -> Type | None:
        """The type of an expression, or None after a diagnostic.

        `want` is the type that the place of the expression has; a literal takes it where no operand decides.  The first call
        runs the rule of the expression, further calls return the same type."""
        kind = self._types.get(expr)
        if kind is not None or expr in self.facts.wrong:
            return kind
        kind = self._rules[type(expr)](self, expr, want)
        if isinstance(kind, RefType) and kind.follows:
            self.facts.followed[expr] = kind
            kind = kind.target
        if kind is not None:
            self._types[expr] = kind
        else:
            self.facts.wrong.add(expr)
        return kind

    def settle(self, expr: tree.Expr, want: Type | None = None) -> Type | None:
        """As `infer`, but an untyped literal becomes INT, DINT, LINT, ULINT or LREAL, the first that holds it."""
        kind = self.infer(expr, want)
        if kind is UNTYPED_INT:
            value = self.facts.constants[expr]
            assert isinstance(value, int)
            for candidate in (INT, DINT, LINT, ULINT):
                if candidate.low <= value <= candidate.high:
                    return self.adopt(expr, candidate)
            self.error("S0108", expr, f"{value} does not fit any integer type")
            return None
        return self.adopt(expr, LREAL) if kind is UNTYPED_REAL else kind

    def fit(self, expr: tree.Expr, target: Type, code: str = "S0301", role: str = "") -> bool:
        """Infer `expr` for a place of type `target`; False after a diagnostic with `code`, in which `role` names the value."""
        kind = self.infer(expr, target)
        if kind is None:
            return False
        if isinstance(kind, AnyType) and self.describes(expr, target):
            return True
        if kind is target and isinstance(kind, Elementary) and expr not in self.facts.constants:
            return True  # most values
        if is_untyped(kind):
            return self.adopt(expr, target, code) is not None
        if assignable(kind, target):
            if isinstance(kind, StructType) and isinstance(target, RefType):
                self.refer_to(expr, kind)
            value = self.facts.constants.get(expr)
            return value is None or self._in_range(expr, value, target, code)
        if self._is_converted(expr, kind, target):
            if isinstance(target, StructType) and target.block:
                self.context.refuse_copy(self.context.block_of(target), self.source, expr)
            if expr in self.facts.constants:
                self.facts.constants[expr] = cut(self.facts.constants[expr], base(target))
            return True
        if self.takes_power(expr, base(target)):
            return self.adopt(expr, target, code) is not None
        self._misfit(expr, kind, target, code, role)
        return False

    def _misfit(self, expr: tree.Expr, kind: Type, target: Type, code: str, role: str) -> None:
        """Report a value that does not fit."""
        constant, value = code in _CONSTANT_PLACES and not is_block(kind), self.facts.constants.get(expr)
        self.error(code, expr, f"{role or 'the value'} is {kind}, but {target} is needed here",
                   hidden_hint(expr, target) or self.power_hint(expr, target) or
                   (literal_hint(value, base(target)) if constant else mismatch_hint(expr, kind, target)))

    def _is_converted(self, expr: tree.Expr, kind: Type, target: Type) -> bool:
        """True if the dialect converts a value implicitly.

        An enumeration with the attribute strict takes constants alone, of other enumerations too, that are values of members."""
        if converted_by_dialect(kind, target, self.dialect):
            return True
        number = kind.base if isinstance(kind, EnumType) else kind
        return self.dialect.numbers_of_enumerations and isinstance(target, EnumType) and isinstance(number, Elementary) and \
            self.facts.constants.get(expr) in target.shown and converts(number, target.base)

    def describes(self, expr: tree.Expr, target: Type) -> bool:
        """True if an ANY parameter stands where the structure AnyType is needed: one in the frame of the POU gets what the
        parameter tells of its argument (CODESYS online help, data type __SYSTEM.AnyType: an ANY is such a structure)."""
        if not isinstance(expr, tree.NameRef) or self.pou is None or not isinstance(target, StructType) or \
                target is not self.context.description():
            return False
        parts = []
        for field in target.fields.values():
            told = tree.Member(expr.start, expr.end, tree.NameRef(expr.start, expr.end, expr.text),
                               tree.Name(expr.start, expr.end, field.name))
            self.infer(told)
            parts.append(AggregatePart((field.offset,), None, field.type, told))
        self.facts.aggregates[expr] = Aggregate(self.in_frame(expr, target, "$any"), bytes(target.size), tuple(parts))
        return True

    def in_frame(self, expr: tree.Expr, kind: Type, what: str) -> Variable:
        """A new variable for a value in the frame of the POU that is executed."""
        assert self.pou is not None
        self.project.dependencies.repeatable = False  # the frame becomes larger
        owner = self.pou.owner
        owner.frame_size += -owner.frame_size % 8
        made = Variable(f"{what} at {expr.start}", kind, "VAR_TEMP", self.pou.source, expr, owner, place="frame",
                        offset=owner.frame_size)
        owner.frame_size += kind.size
        return made

    def refer_to(self, expr: tree.Expr, kind: StructType) -> None:
        """Record that an interface refers to an instance of this type."""
        self.facts.as_interfaces.add(expr)
        self.context.block_of(kind).refer_to_instances()
        self.project.dependencies.repeatable = False

    def power_hint(self, expr: tree.Expr, target: Type) -> str:
        """The hint for a power where an integer is needed, "" for another expression."""
        hint = powers.hint(self.facts, expr, self.text(expr), target) if powers.power_in(self.facts, expr) is not None else ""
        return f"** gives {self.facts.types[expr]}: {hint}" if hint else ""

    def _in_range(self, expr: tree.Expr, value: Value, target: Type, code: str) -> bool:
        if isinstance(target, StringType) and isinstance(value, bytes | str) and len(value) > target.capacity and code != "S0503":
            self.loses(expr, "S0790", f"the text has {len(value)} characters, and {target} keeps {target.capacity} of them")
        if isinstance(target, SubrangeType) and target.checked and isinstance(value, int) and \
                not target.low <= value <= target.high:
            self.error("S0702", expr, f"{value} is outside {target.low}..{target.high} of {target}")
            return False
        return True

    def loses(self, expr: tree.Expr, code: str, message: str) -> None:
        """Record a warning for a constant whose value is not the one that is written."""
        self.facts.losses.append((self.source, expr, code, message))

    def unbounded(self, expr: tree.Expr, operands: Iterable[Value]) -> None:
        """Record a warning if the constant `expr` is infinite or no number and its operands are finite."""
        value = self.facts.constants.get(expr)
        if isinstance(value, float) and not math.isfinite(value) and \
                all(math.isfinite(operand) for operand in operands if isinstance(operand, float)):
            self.loses(expr, "S0792", "this is no number (NAN)" if value != value else
                       f"this is infinite ({'-' if value < 0 else ''}INF)")

    def condition(self, expr: tree.Expr, what: str, statement: bool = False) -> None:
        """Infer an expression that must be BOOL; `what` names the statement in the message.

        For a `statement`, IF, WHILE or REPEAT, some dialects take a number, too."""
        kind = self.infer(expr, BOOL)
        if is_untyped(kind):
            kind = self.adopt(expr, BOOL, "S0303")
        if kind is not None and base(kind) != BOOL:
            number = statement and is_any(kind, "ANY_INT", "ANY_BIT")
            if number and self.dialect.integers_are_conditions:
                self.context.report.add("S0193", self.source, expr, f"the condition of {what} is {kind}: TRUE unless it is 0",
                                f"write {self.text(expr)} <> 0")
                return
            step = isinstance(kind, StructType) and not kind.block and set(kind.fields) == {fold("X"), fold("T")}
            self.error("S0303", expr, f"the condition of {what} is {'a step' if step else kind}, not BOOL",
                       f"write {self.text(expr)}.X" if step else
                       conversion_hint(kind, BOOL) + (f", or take {takers('integers_are_conditions')}" if number else ""))

    def adopt(self, expr: tree.Expr, target: Type, code: str = "S0301") -> Type | None:
        """Give an expression of untyped literals the type `target`, and convert its constant; None after a diagnostic."""
        value = self.facts.constants[expr]
        kind = base(target)
        untyped = self.facts.types[expr]
        assert isinstance(value, int | float)
        if isinstance(kind, RefType) and value == 0:  # CODESYS writes 0 for NULL
            self.facts.types[expr] = target
            return target
        if isinstance(kind, EnumType) and self.dialect.numbers_of_enumerations and \
                ("strict" not in kind.attributes or value in kind.shown):
            kind = kind.base
        if untyped is UNTYPED_REAL and self._becomes_integer(expr, kind):
            untyped, value = UNTYPED_INT, int(value) if math.isfinite(value) else cut(value, kind)
            assert isinstance(value, int)
        if untyped is UNTYPED_REAL and not is_any(kind, "ANY_REAL") or \
                not is_any(kind, "ANY_INT", "ANY_BIT", "ANY_REAL"):
            self._misfits(expr, untyped, target, code)
            return None
        within = self._within(expr, value, target, kind)
        if within is None:
            return None
        value = within
        self.facts.constants[expr] = held = convert(value, kind)
        self.unbounded(expr, (value,))
        if untyped is UNTYPED_INT and isinstance(held, float) and held != value:
            self.loses(expr, "S0791", f"{kind} cannot hold {value}: it becomes {held:.0f}")
        self.facts.types[expr] = target
        return target

    def _within(self, expr: tree.Expr, value: int | float, target: Type, kind: Type) -> int | float | None:
        """The value of an expression of literals if a type holds it, or cut to its width in a dialect that does so; None after
        a diagnostic."""
        span = limits(target)
        if span is None or span[0] <= value <= span[1]:
            return value
        cuts = not isinstance(target, SubrangeType) and kind != BOOL
        if not cuts or not self.dialect.constants_wrap and \
                not (self.dialect.signs_are_lost and _is_signed_bits(value, kind)):
            switch = "signs_are_lost" if cuts and _is_signed_bits(value, kind) else "constants_wrap"
            others = f"take {takers('constants_wrap', other=switch)}, where it is cut to the width of {target}" if cuts else ""
            self.error("S0702", expr, f"{value} does not fit {target}, which holds {span[0]} to {span[1]}",
                       literal_hint(value, kind) if kind == BOOL else others)
            return None
        held = cut(value, kind)
        assert isinstance(held, int | float)
        self.loses(expr, "S0791", f"{target} cannot hold {value}: it becomes {held}")
        return held

    def takes_power(self, expr: tree.Expr, kind: Type) -> bool:
        """True for a power of integers whose value a dialect takes where an integer is needed; a warning where it has to."""
        if not self.dialect.whole_powers or not powers.takes(kind) or not powers.is_whole(self.facts, expr):
            return False
        if not self.dialect.narrowing:
            self.loses(expr, "S0793", f"** gives LREAL, whose value is taken as {kind}")
        return True

    def _becomes_integer(self, expr: tree.Expr, kind: Type) -> bool:
        """True for an untyped real that a dialect takes as an integer."""
        return self.takes_power(expr, kind) or self.dialect.narrowing and is_any(kind, "ANY_INT")

    def _misfits(self, expr: tree.Expr, untyped: Type, target: Type, code: str) -> None:
        """Report an expression of literals that does not fit its place: a literal of another kind, or a power."""
        power = powers.power_in(self.facts, expr) if untyped is UNTYPED_REAL else None
        if power is not None:
            self.error(code, expr, powers.message(target), powers.hint(self.facts, expr, self.text(expr), target))
        else:
            self.error(code, expr, f"{untyped} does not fit {target}", literal_hint(self.facts.constants[expr], base(target)))

    def note_call(self, pou: Pou, node: tree.Node, dynamic: bool = False) -> None:
        """Record that the POU of this scope calls another one, or with `dynamic` perhaps one that overrides it."""
        self.context.warn_of_obsolete(pou, self.source, node)
        if self.pou is not None:
            self.pou.calls.setdefault(pou, node)
            if dynamic:
                self.pou.dynamic_calls.setdefault(pou, node)

    # --- names ------------------------------------------------------------------------------------------------------

    def variable(self, name: str) -> Variable | None:
        """The variable that a name means here: the POU's own, one of its instance, else a global one."""
        return self.own_variable(name) or self.context.global_variable(name, self.source)

    def own_variable(self, name: str) -> Variable | None:
        """The variable of that name of the POU or, in a method, of the instance: all but the VAR_TEMPs of that."""
        pou = self.pou
        found = pou.variables.get(fold(name)) if pou is not None else None
        if found is None and pou is not None and pou.block is not None:
            found = pou.block.variables.get(fold(name))
            return None if found is not None and found.kind == "VAR_TEMP" else found
        return found

    def named_type(self, name: str) -> Type | None:
        """The type of that name, elementary or declared; None without a diagnostic of its own."""
        return self.context.named_type(name, self.source)

    def is_in_memory(self, expr: tree.Expr) -> bool:
        """True for a variable, an address, what a reference refers to, or a part of one of these."""
        expr = self.facts.root(expr)
        return type(expr) in _BEHIND_REFERENCE or expr in self.facts.variables or expr in self.facts.directs or \
            expr in self.facts.followed

    def is_variable(self, expr: tree.Expr) -> bool:
        """True for an expression that names a place in memory, which can be written, passed by reference and referred to."""
        if isinstance(expr, tree.Member) and isinstance(self.facts.types.get(expr.of), AnyType):
            return any_parameters.is_array(expr)
        return expr not in self.facts.rewritten and self.is_in_memory(expr) and \
            (type(expr) in _PLACES or expr in self.facts.followed)


def _is_signed_bits(value: int | float, kind: Type) -> bool:
    """True for a negative integer that a signed type as wide as the unsigned type `kind` holds."""
    return isinstance(kind, Elementary) and is_any(kind, "ANY_UNSIGNED", "ANY_BIT") and isinstance(value, int) and \
        -(1 << kind.bits - 1) <= value < 0
