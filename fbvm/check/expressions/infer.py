"""Types of expressions, names and operators; literals take the type that their context wants."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fbvm.base.areas import FLAG_AREAS, AddressError, parse_address
from fbvm.base.diagnostics import Source
from fbvm.base.types import (
    BOOL,
    BYTE,
    DINT,
    DWORD,
    ELEMENTARY,
    INT,
    LINT,
    LREAL,
    LWORD,
    NULL,
    UDINT,
    ULINT,
    WORD,
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
    fold,
)
from fbvm.check.expressions import any_parameters, literals, qualified, unknown_names
from fbvm.check.expressions.aggregates import Aggregates
from fbvm.check.expressions.assignability import (
    BOUNDS_HINT,
    assignable,
    conversion_hint,
    fitting_hint,
    hidden_hint,
    is_untyped,
    lent,
    literal_hint,
)
from fbvm.check.expressions.constants import convert, cut, limits
from fbvm.check.expressions.operators import Operators
from fbvm.check.expressions.subscripts import Subscripts
from fbvm.check.expressions.values import is_any
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL, Facts, Pou, Value, Variable, is_block
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

if TYPE_CHECKING:
    from fbvm.check.checker import Checker

_BEHIND = tree.Deref | tree.Index | ladder.Memory | ladder.Words
"""What names a place by itself."""
_PLACES = _BEHIND | tree.NameRef | tree.Direct | tree.Member | tree.Part
"""What a place may look like."""
PARTS = {"X": BOOL, "B": BYTE, "W": WORD, "D": DWORD, "L": LWORD}


class Expressions:
    """Types the expressions of one POU (or of none: constants of declarations)."""

    def __init__(self, checker: Checker, source: Source, pou: Pou | None) -> None:
        self.checker = checker
        self.project = checker.project
        self.facts: Facts = checker.project.facts
        self.source = source
        self.pou = pou
        self.operators = Operators(self)
        self.spaces: set[tree.NameRef] = set()
        """Names that stand in front of a point."""
        self.counting: list[tuple[object, ...]] = []
        """Places of the counters of the FOR loops around the present statement."""

    def error(self, code: str, node: tree.Node, message: str, hint: str = "",
              related: tuple[Source, int, str] | None = None) -> None:
        self.project.report.add(code, self.source, node, message, hint, related)

    def text(self, node: tree.Node) -> str:
        """A piece of the program as it is written, for messages."""
        return " ".join(self.source.text[node.start:node.end].split())

    # --- entry points -----------------------------------------------------------------------------------------------

    def infer(self, expr: tree.Expr, want: Type | None = None) -> Type | None:
        """The type of an expression, or None after a diagnostic.  `want` helps literals that meet nothing else.

        An expression is worked out once; calls ask for their arguments' types more than once."""
        if expr in self.facts.types or expr in self.facts.wrong:
            return self.facts.types.get(expr)
        kind = _INFER[type(expr)](self, expr, want)
        if isinstance(kind, RefType) and kind.follows:
            self.facts.followed[expr] = kind
            kind = kind.target
        if kind is not None:
            self.facts.types[expr] = kind
        else:
            self.facts.wrong.add(expr)
        return kind

    def settle(self, expr: tree.Expr, want: Type | None = None) -> Type | None:
        """As `infer`, but a literal without a context takes its own smallest type."""
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
        """Type `expr` for a place of type `target`; False after a diagnostic."""
        kind = self.infer(expr, target)
        if kind is None:
            return False
        if is_untyped(kind):
            return self.adopt(expr, target, code) is not None
        if assignable(kind, target):
            value = self.facts.constants.get(expr)
            return value is None or self._in_range(expr, value, target, code)
        if lent(kind, target, self.project.dialect):
            if expr in self.facts.constants:
                self.facts.constants[expr] = cut(self.facts.constants[expr], base(target))
            return True
        known = code in _KNOWN and not is_block(kind)
        self.error(code, expr, f"{role or 'the value'} is {kind}, but {target} is needed here",
                   hidden_hint(expr, target) or
                   (literal_hint(self.facts.constants.get(expr), base(target)) if known else fitting_hint(expr, kind, target)))
        return False

    def _in_range(self, expr: tree.Expr, value: Value, target: Type, code: str) -> bool:
        if isinstance(target, StringType) and isinstance(value, bytes | str) and len(value) > target.capacity and code != "S0503":
            self._loses(expr, "S0790", f"the text has {len(value)} characters, and {target} keeps {target.capacity} of them")
        if isinstance(target, SubrangeType) and isinstance(value, int) and not target.low <= value <= target.high:
            self.error("S0702", expr, f"{value} is outside {target.low}..{target.high} of {target}")
            return False
        return True

    def _loses(self, expr: tree.Expr, code: str, message: str) -> None:
        """Remember a constant that its place does not keep as it is written."""
        self.facts.losses.append((self.source, expr, code, message))

    def condition(self, expr: tree.Expr, what: str) -> None:
        """An expression that must be BOOL."""
        kind = self.infer(expr, BOOL)
        if is_untyped(kind):
            kind = self.adopt(expr, BOOL, "S0303")
        if kind is not None and base(kind) != BOOL:
            step = isinstance(kind, StructType) and not kind.block and set(kind.fields) == {fold("X"), fold("T")}
            self.error("S0303", expr, f"the condition of {what} is {'a step' if step else kind}, not BOOL",
                       f"write {self.text(expr)}.X" if step else conversion_hint(kind, BOOL))

    def adopt(self, expr: tree.Expr, target: Type, code: str = "S0301") -> Type | None:
        """Give an expression of nothing but untyped literals the type `target`."""
        value = self.facts.constants[expr]
        kind = base(target)
        untyped = self.facts.types[expr]
        assert isinstance(value, int | float)
        if isinstance(kind, RefType) and value == 0:  # CODESYS writes 0 for NULL
            self.facts.types[expr] = target
            return target
        if isinstance(kind, EnumType) and self.project.dialect.numbers_of_enumerations:
            kind = kind.base
        if self.project.dialect.narrowing and untyped is UNTYPED_REAL and is_any(kind, "ANY_INT"):
            untyped, value = UNTYPED_INT, int(value)
        if untyped is UNTYPED_REAL and not is_any(kind, "ANY_REAL") or \
                not is_any(kind, "ANY_INT", "ANY_BIT", "ANY_REAL"):
            self.error(code, expr, f"{untyped} does not fit {target}", literal_hint(value, kind))
            return None
        span = limits(target)
        if span is not None and not span[0] <= value <= span[1]:
            self.error("S0702", expr, f"{value} does not fit {target}, which holds {span[0]} to {span[1]}",
                       literal_hint(value, kind) if kind == BOOL else "")
            return None
        self.facts.constants[expr] = held = convert(value, kind)
        if untyped is UNTYPED_INT and isinstance(held, float) and held != value:
            self._loses(expr, "S0791", f"{kind} cannot hold {value}: it becomes {held:.0f}")
        self.facts.types[expr] = target
        return target

    def note_call(self, pou: Pou, node: tree.Node) -> None:
        """Remember who calls whom, for the check of recursion."""
        if self.pou is not None:
            self.pou.calls.setdefault(pou, node)

    # --- names --------------------------------------------------------------------------------------------------------

    def variable(self, name: str) -> Variable | None:
        """The variable that a name means here: the POU's own, else a global one."""
        if self.pou is not None:
            found = self.pou.variables.get(fold(name))
            if found is not None:
                return found
        return self.project.global_variable(name, self.source)

    def _name(self, expr: tree.NameRef, want: Type | None) -> Type | None:
        if self.pou is not None and self.pou.later and fold(expr.text) in self.pou.later:
            early = self.checker.interfaces.early(expr, self.pou)
            return self._variable(expr, early) if early is not None else None
        variable = self.variable(expr.text)
        if variable is not None:
            return self._variable(expr, variable)
        own = self.source.library
        members = [m for m in self.project.enum_members.get(fold(expr.text), ()) if m[2] or not own]
        near = [m for m in members if m[2] == own]
        wanted = [m for m in members if m[0] == want] or near or members
        if len({kind.name for kind, _, _ in wanted}) == 1:
            self.facts.constants[expr] = wanted[0][1]
            return wanted[0][0]
        if wanted:
            self.error("S0201", expr, f"{expr.text} is a member of several enumerations",
                       "write which: " + " or ".join(f"{kind}#{expr.text}" for kind, _, _ in wanted))
            return None
        unknown_names.complain(self, expr)
        return None

    def program(self, expr: tree.NameRef) -> bool:
        """True for the name of a program that stands for its one instance; it is known from then on."""
        if expr in self.facts.types or expr in self.facts.wrong:
            return False
        pou = self.project.pou(expr.text, self.source) if self.variable(expr.text) is None else None
        instance = self.checker.program(pou, expr) if pou is not None and pou.kind == "PROGRAM" else None
        if instance is None:
            return False
        self.facts.types[expr], self.facts.variables[expr] = instance.type, instance
        return True

    def _variable(self, expr: tree.Expr, variable: Variable) -> Type | None:
        if variable.wrong:
            return None
        self.facts.variables[expr] = variable
        if variable.constant and variable.value is not None:
            self.facts.constants[expr] = variable.value
        return variable.type

    def _direct(self, expr: tree.Direct, want: Type | None) -> Type | None:
        try:
            address = parse_address(expr.text, self.checker.areas)
        except AddressError as error:
            self.error("S0601", expr, str(error))
            return None
        self.facts.directs[expr] = address
        self.checker.use_area(address.area)
        if address.bit is not None or address.area in FLAG_AREAS:
            return BOOL
        return {8: BYTE, 32: DWORD, 64: LWORD}.get(address.size_bits, WORD)

    # --- parts of variables -----------------------------------------------------------------------------------------

    def _member(self, expr: tree.Member, want: Type | None) -> Type | None:
        meant = qualified.member(self, expr)
        if isinstance(meant, EnumType):
            return literals.enum_value(self, expr, meant, expr.name)
        if isinstance(meant, Variable):
            return self._variable(expr, meant)
        if isinstance(expr.of, tree.NameRef) and qualified.is_space(self, expr.of):
            if self.checker.globals.is_lost(expr.of.text, expr.name.text, self.source):
                return None
            self.error("S0210", expr.name, f"{expr.of.text} has no {expr.name.text}",
                       self.project.choices(expr.name.text, self.project.names_in(expr.of.text)))
            return None
        if isinstance(expr.of, tree.NameRef):
            self.program(expr.of)
            self.spaces.add(expr.of)
        whole = self.infer(expr.of)
        if whole is None:
            return None
        if isinstance(whole, AnyType):
            return any_parameters.member(self, expr, whole)
        if not isinstance(whole, StructType):
            if qualified.is_bit(self, expr, whole):
                return self._part(self.facts.bits[expr], want)
            if isinstance(whole, EnumType) and isinstance(expr.of, tree.NameRef) and \
                    self.checker.specs.named_type(expr.of.text, self.source) is whole:
                return literals.enum_value(self, expr, whole, expr.name)  # a variable that is called like its type
            self.error("S0304", expr.of, f"this is {whole} and has no members",
                       f"what it points to has: write {self.text(expr.of)}^.{expr.name.text}"
                       if isinstance(whole, RefType) and isinstance(whole.target, StructType) else BOUNDS_HINT
                       if isinstance(whole, ArrayType | OpenArrayType) else "")
            return None
        member = whole.member(expr.name.text)
        if member is None and whole.block and self.checker.block_of(whole).lost(expr.name.text):
            return None
        if member is None:
            readable = [f.name for f in whole.fields.values() if not whole.block or f.kind in READABLE]
            self.error("S0210", expr.name, f"{whole} has no {expr.name.text}",
                       self.project.choices(expr.name.text, readable))
            return None
        if whole.block and member.kind not in READABLE and \
                not (member.kind == "VAR" and (self.project.dialect.locals_are_read or
                                               self.checker.block_of(whole).kind == "PROGRAM")):
            unknown_names.complain_internal(self, expr.name, member, whole)
            return None
        self.facts.fields[expr] = member
        return member.type

    def _index(self, expr: tree.Index, want: Type | None) -> Type | None:
        return Subscripts(self).element(expr)

    def _part(self, expr: tree.Part, want: Type | None) -> Type | None:
        whole = self.infer(expr.of)
        if whole is None:
            return None
        kind = base(whole)
        bits = kind.bits if isinstance(kind, Elementary) and is_any(kind, "ANY_BIT", "ANY_INT") else 0
        part = PARTS[expr.size]
        if bits <= part.bits or (expr.index + 1) * part.bits > bits:
            text = f".{expr.index}" if expr.size == "X" else f".%{expr.size}{expr.index}"
            self.error("S0210", expr, f"{whole} has no part {text}")
            return None
        if not self._is_variable(expr.of):
            self.error("S0407", expr.of, "a part can be taken of a variable only")
            return None
        return part

    def _is_variable(self, expr: tree.Expr) -> bool:
        expr = self.facts.root(expr)
        return isinstance(expr, _BEHIND) or expr in self.facts.variables or expr in self.facts.directs or \
            expr in self.facts.followed

    def is_variable(self, expr: tree.Expr) -> bool:
        """True for an expression that names a place in memory."""
        if isinstance(expr, tree.Member) and isinstance(self.facts.types.get(expr.of), AnyType):
            return any_parameters.is_array(expr)
        return expr not in self.facts.rewritten and self._is_variable(expr) and \
            (isinstance(expr, _PLACES) or expr in self.facts.followed)

    def _deref(self, expr: tree.Deref, want: Type | None) -> Type | None:
        kind = self.infer(expr.of)
        if kind is None:
            return None
        if not isinstance(kind, RefType):
            self.error("S0304", expr.of, f"this is {kind}, not a reference: ^ has nothing to follow")
            return None
        return kind.target

    def _aggregate(self, expr: tree.ArrayInit | tree.StructInit, want: Type | None) -> Type | None:
        return Aggregates(self).kind(expr, want)

    def _null(self, expr: tree.NullLiteral, want: Type | None) -> Type | None:
        return NULL

    def _call(self, expr: tree.Call, want: Type | None) -> Type | None:
        return self.checker.calls(self).value(expr, want)

    def _edge(self, expr: ladder.Edge, want: Type | None) -> Type | None:
        self.infer(expr.memory)
        self.condition(expr.of, "an edge")
        return BOOL

    def _element(self, expr: ladder.Element, want: Type | None) -> Type | None:
        self.condition(expr.value, "a contact")
        return BOOL

    def _memory(self, expr: ladder.Memory, want: Type | None) -> Type | None:
        self.fit(expr.address, UDINT)
        return ELEMENTARY[expr.kind] if expr.kind else any_parameters.VIEWS["WORDS"]

    def _words(self, expr: ladder.Words, want: Type | None) -> Type | None:
        kind = self.infer(expr.of)
        if kind is not None and (base(kind) == BOOL or not self.is_variable(expr.of)):
            self.error("S0405", expr, f"words are needed here, this is {kind}")
            return None
        return kind and any_parameters.VIEWS["WORDS"]

    def _unary(self, expr: tree.Unary, want: Type | None) -> Type | None:
        return self.operators.unary(expr, want)

    def _binary(self, expr: tree.Binary, want: Type | None) -> Type | None:
        return self.operators.binary(expr, want)


_KNOWN = ("S0503", "S0705", "S0801")
"""Codes of places whose values must be known before the program runs: a conversion does not help there."""
READABLE = ("", "VAR_INPUT", "VAR_OUTPUT")
"""Kinds of members that may be named from outside."""
_INFER: dict[type, Callable[..., Type | None]] = {
    tree.Literal: literals.literal, tree.EnumLiteral: literals.enum_literal, tree.NameRef: Expressions._name,
    tree.Direct: Expressions._direct, tree.Member: Expressions._member, tree.Index: Expressions._index,
    tree.Part: Expressions._part, tree.Deref: Expressions._deref, tree.NullLiteral: Expressions._null,
    tree.ArrayInit: Expressions._aggregate, tree.StructInit: Expressions._aggregate,
    tree.Call: Expressions._call, tree.Unary: Expressions._unary, tree.Binary: Expressions._binary,
    ladder.Edge: Expressions._edge, ladder.Element: Expressions._element, ladder.Memory: Expressions._memory,
    ladder.Words: Expressions._words,
}
