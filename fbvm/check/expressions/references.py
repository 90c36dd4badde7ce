"""References: what may be referred to, REF(), ADR() and REF= (IEC 61131-3 ed. 3, table 12, and CODESYS's forms).

REF() refers to a variable that lives as long as the program: never to VAR_TEMP, to variables of functions or to what an
in-out stands for.  ADR() and REF= refer to these too; following such a pointer after its POU has ended stops the program.
A pointer is moved in the variable that it was made of, or, in an instance, in its member: that is an object of its own.
"""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import (
    BYTE,
    AnyType,
    ArrayType,
    StringType,
    StructType,
    Type,
    derives,
    fold,
    pointer,
    reference,
    string,
)
from fbvm.check.expressions.constants import encode
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import MAKERS, is_null
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import Facts, Holder, StandardCall, Start, Variable
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed

_ROOM = 255
"""Characters that the place of a constant text has at least."""


def refer(scope: Scope, expr: tree.Expr, lasting: bool) -> Type | None:
    """The type of the variable that a reference is made to, or None after a diagnostic.

    It has to be `lasting` for REF(), which gives a reference that can be written through."""
    kind = scope.infer(expr)
    if kind is None:
        return None
    if not scope.is_variable(expr):
        scope.error("S0407", expr, "a reference can be made to a variable only, not to a value")
        return None
    if isinstance(kind, ArrayType) and kind.packed:
        scope.error("S0407", expr, f"{kind} fills no bytes that a reference could name", "refer to one of its elements")
        return None
    root = scope.facts.root(expr)
    variable = scope.facts.variables.get(root) if root not in scope.facts.followed else None
    if lasting and variable is not None and not scope.dialect.short_references and (reason := _short_lived(variable)):
        scope.error("S0407", expr, f"{variable.name} is {reason}, which may end before the reference is followed",
                    f"ADR gives a pointer to it that holds until then; or take {takers('short_references')}")
        return None
    if lasting and not writable(scope, expr, "be referred to"):
        return None
    if variable is not None:
        variable.written = True
    scope.facts.holders[expr] = _holder(scope, expr)
    scope.project.dependencies.repeatable = False
    return kind


def _holder(scope: Scope, expr: tree.Expr) -> Holder:
    """The variable, or member of an instance, within which a reference to this place can be moved."""
    facts = scope.facts
    while facts.is_part(expr):
        whole = facts.types[expr.of]
        if isinstance(expr, tree.Member) and isinstance(whole, StructType) and whole.block:
            member = scope.context.block_of(whole).variables[fold(expr.name.text)]
            return _held(scope, expr, member)
        expr = expr.of
    if isinstance(expr, tree.Direct):
        return Holder(expr)
    variable = facts.variables.get(expr) if expr not in facts.followed else None
    return Holder() if variable is None else _held(scope, expr, variable)


def _held(scope: Scope, expr: tree.Expr, variable: Variable) -> Holder:
    """The holder for a variable, which becomes an object by that."""
    facts = scope.facts
    if variable.kind == "VAR_IN_OUT" or variable.place == "frame":
        number = facts.leases.setdefault(variable, len(facts.leases))
        assert scope.pou is not None
        if number not in scope.pou.owner.leases:
            scope.pou.owner.leases.append(number)
        return Holder(expr, variable, number)
    if variable.reference:
        return Holder()
    row = facts.referred
    if variable.place == "self":
        assert variable.owner is not None
        row = variable.owner.referred
    if variable not in row:
        row.append(variable)
    return Holder(expr, variable)


def to_parameter(scope: Scope, expr: tree.Member) -> Type:
    """`x.pValue` of an ANY: a pointer to what was passed."""
    facts = scope.facts
    facts.holders[expr] = _held(scope, expr.of, facts.variables[expr.of])
    scope.project.dependencies.repeatable = False
    return pointer(BYTE)


def _short_lived(variable: Variable) -> str:
    if variable.kind == "VAR_IN_OUT":
        return "an in-out"
    if variable.kind == "VAR_TEMP":
        return "a VAR_TEMP"
    return "a variable of a function" if variable.owner is not None and variable.owner.is_function else ""


def make(scope: Scope, call: tree.Call, name: str, value: tree.Expr) -> Type | None:
    """REF(x) and ADR(x)."""
    kind = (_constant_text(scope, value) if name == "ADR" else None) or refer(scope, value, lasting=name == "REF")
    if kind is None:
        return None
    made = reference(kind) if name == "REF" else pointer(kind)
    scope.facts.calls[call] = StandardCall("REF", [(value, kind)], (made,))
    return made


def _constant_text(scope: Scope, expr: tree.Expr) -> Type | None:
    """The type of a text that is no variable and whose address a dialect takes; None for anything else.

    It gets a place of its own, which equal texts share, with room for what a pointer to a longer STRING reads."""
    kind, value = scope.infer(expr), scope.facts.constants.get(expr)
    if not scope.dialect.texts_have_addresses or not isinstance(kind, StringType) or value is None or scope.is_variable(expr):
        return None
    texts = scope.context.texts
    if value not in texts:
        room = string(max(kind.capacity, _ROOM), kind.wide)
        scope.project.size_limits.reserve(room.size, "the text takes", scope.source, expr)
        texts[value] = Variable(f"$text {len(texts) + 1}", room, "VAR_STAT", scope.source, expr, place="abs",
                                initial=encode(room, value), constant=True)
        scope.context.global_order.append(texts[value])
    scope.facts.variables[expr] = texts[value]
    scope.facts.holders[expr] = _held(scope, expr, texts[value])
    scope.project.dependencies.repeatable = False
    return kind


MARK = 0xFFFFFF << 40
"""The object number, which no object has, of references in initial bytes that layout has to place."""


def named(init: tree.Expr) -> tree.Expr:
    """The variable of an initial value of a reference: x of REF(x), ADR(x) or x itself."""
    if isinstance(init, tree.Call) and isinstance(init.callee, tree.NameRef) and fold(init.callee.text) in MAKERS:
        assert init.arguments[0].value is not None
        return init.arguments[0].value
    return init


def without_this(init: tree.Expr) -> tree.Expr:
    """The same initial value with the names alone of variables of the instance: x for THIS^.x, ADR(x) for ADR(THIS^.x)."""
    if named(init) is not init and isinstance(init, tree.Call):
        return changed(init, arguments=(changed(init.arguments[0], value=without_this(named(init))),))
    if not isinstance(init, tree.Member | tree.Index):
        return init
    of = init.of.of if isinstance(init.of, tree.Deref) else init.of
    if isinstance(init, tree.Member) and isinstance(of, tree.NameRef) and fold(of.text) == "THIS":
        return tree.NameRef(init.name.start, init.name.end, init.name.text)
    inner = without_this(init.of)
    return init if inner is init.of else changed(init, of=inner)


def placeholder(facts: Facts, start: Start) -> bytes:
    """The bytes that stand for an initial reference until layout has placed its target; `facts.starts` gets the reference."""
    facts.starts.append(start)
    return (MARK | len(facts.starts) - 1).to_bytes(8, "little")


def check_initial(scope: Scope, start: Start) -> None:
    """Check the target of an initial reference: its place must be known before the program runs."""
    if not _fits(scope, start):
        return
    place, facts = start.place, scope.facts
    root = facts.root(place)
    owner = facts.variables.get(root)
    known = root in facts.directs or owner is not None and (
        start.late or owner.place != "frame" and not owner.reference and root not in facts.followed)
    while facts.is_part(place):
        subscripts = place.subscripts if isinstance(place, tree.Index) else ()
        known &= start.late or all(subscript in facts.constants for subscript in subscripts)
        place = place.of
    if not known:
        scope.error("S0701", start.whole, "an initial value must be known before the program runs",
                    "assign it in the body instead")


def _fits(scope: Scope, start: Start) -> bool:
    """True if the reference is one to the right type; else a diagnostic."""
    if not start.kind.follows:
        return scope.fit(start.whole, start.kind, "S0705", "the initial value")
    kind = refer(scope, start.place, lasting=False)
    if kind is None or derives(kind, start.kind.target):
        return kind is not None
    scope.error("S0705", start.place, f"a {start.kind} is needed here, this is {kind}")
    return False


def bind(scope: Scope, node: tree.Assign) -> None:
    """`r REF= x` for what is declared REFERENCE TO."""
    target = node.targets[0]
    kind = scope.infer(target)
    if kind is None:
        scope.infer(node.value)
        return
    if target in scope.facts.gets:
        scope.error("S1008", target, f"the property {scope.text(target)} has no SET and cannot be bound")
        return
    if target not in scope.facts.followed:
        scope.error("S0301", target, "REF= binds a variable that is declared REFERENCE TO",
                    "assign REF(...) to a REF_TO")
        return
    if writable(scope, target, "be bound", rebinds=True):
        lend(scope, node.value, kind, "S0301", scope.text(target))


def _is_wide(kind: Type) -> bool:
    return isinstance(kind, StringType) and kind.wide


def lend(scope: Scope, value: tree.Expr, kind: Type, code: str, name: str, any_length: bool = False) -> bool:
    """True if a REFERENCE TO `kind` that is called `name` can be bound to a value; else a diagnostic.

    any_length: True for one to a STRING without a length, which is bound to a text of any length.  What it reads or writes
    behind the end of that is checked when the program runs."""
    if is_null(value):
        return True
    if named(value) is not value and value not in scope.facts.followed:
        scope.error("S0407", value, f"{name} is bound to a variable, and this makes a reference already",
                    f"name the variable alone: {scope.text(named(value))}")
        return False
    if isinstance(scope.infer(value), AnyType) and scope.describes(value, kind):
        scope.facts.holders[value] = _held(scope, value, scope.facts.aggregates[value].place)
        return True
    found = refer(scope, value, lasting=False)
    if found is None or derives(found, kind) or any_length and isinstance(found, StringType) and found.wide is _is_wide(kind):
        return found is not None
    scope.error(code, value, f"{name} refers to {kind}, this is {found}")
    return False
