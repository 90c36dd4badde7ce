"""THIS, SUPER, and the members of instances that are executed: which method or property a name means, who may name it.

Source: IEC 61131-3 ed. 3, 6.6.5.5 to 6.6.5.9 and 6.6.7; THIS^, SUPER^ and properties are CODESYS's."""

from __future__ import annotations

from fbvm.base.types import RefType, StructType, Type, fold, pointer
from fbvm.check.expressions import qualified
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import Pou, PouCall, Variable
from fbvm.syntax import tree

WORDS = ("THIS", "SUPER")


def is_self(scope: Scope, expr: tree.Expr) -> bool:
    """True for THIS and SUPER, where no variable is called so."""
    return isinstance(expr, tree.NameRef) and fold(expr.text) in WORDS and scope.variable(expr.text) is None


def self_type(scope: Scope, expr: tree.NameRef) -> StructType | None:
    """The type as which THIS or SUPER sees the instance; None after a diagnostic."""
    word = fold(expr.text)
    block = scope.pou.own_block if scope.pou is not None else None
    if block is None or block.kind == "PROGRAM" and word == "SUPER":
        scope.error("S1009", expr, f"{word} stands in methods and bodies of blocks only",
                    "a FUNCTION has no instance" if scope.pou is not None and scope.pou.is_function else "")
        return None
    if word == "SUPER":
        if block.base is None:
            if not block.inherits:
                scope.error("S1009", expr, f"{block.name} extends no block, and has no SUPER", "write THIS, or add EXTENDS")
            return None
        block = block.base
    scope.facts.selves[expr] = block
    scope.project.dependencies.repeatable = False
    return block.type


def instance_of(scope: Scope, expr: tree.Expr) -> StructType | None:
    """The type of the instance whose members `expr` names in front of a point: THIS, SUPER, an instance, an interface.

    None for anything else; what is wrong in `expr` is reported then."""
    if is_self(scope, expr):
        kind = scope.facts.types.get(expr)
        if isinstance(kind, StructType):
            return kind
        assert isinstance(expr, tree.NameRef)
        found = self_type(scope, expr)
        if found is not None:
            scope.facts.types[expr] = found
        return found
    if isinstance(expr, tree.NameRef):
        program(scope, expr)
    whole = scope.infer(expr)
    if isinstance(whole, RefType) and whole.interface:
        whole = whole.target
    return whole if isinstance(whole, StructType) and whole.block else None


def is_own_instance(scope: Scope, expr: tree.Expr) -> bool:
    """True for THIS^, THIS, SUPER^ and SUPER as the instance whose body is executed."""
    return (expr.of if isinstance(expr, tree.Deref) else expr) in scope.facts.selves


def pointer_to_self(scope: Scope, expr: tree.NameRef, want: Type | None) -> Type | None:
    """The type of THIS or SUPER as a value: a pointer to the instance."""
    kind = self_type(scope, expr)
    if kind is None:
        return None
    if scope.pou is not None and (block := scope.pou.own_block) is not None:
        block.refer_to_instances()
    return pointer(kind)


def way_to_write(scope: Scope, expr: tree.Expr) -> str:
    """How a member of THIS or SUPER is written to that is named without ^; "" for any other expression."""
    if isinstance(expr, tree.Member) and is_self(scope, expr.of):
        assert isinstance(expr.of, tree.NameRef)
        return f"write {expr.name.text} := or {expr.of.text}^.{expr.name.text} :="
    return ""


# --- members ----------------------------------------------------------------------------------------------------------


def find(scope: Scope, expr: tree.Expr, keys: tuple[str, ...]) -> tuple[list[Pou | None], tree.Expr | None] | None:
    """The methods with these forms of key that an expression names, and its instance: None for the one whose body this is.

    `keys` are "{}" for a method, "GET {}" and "SET {}" for accessors.  None if the expression names none of them."""
    if isinstance(expr, tree.NameRef):
        block = scope.pou.own_block if scope.pou is not None else None
        if block is None or _has_no_methods(block) or \
                scope.own_variable(expr.text) is not None and not _is_result(scope, expr.text):
            return None
        of, name = None, expr
    elif isinstance(expr, tree.Member):
        kind = instance_of(scope, expr.of) if _may_be_instance(scope, expr.of) else None
        if kind is None:
            return None
        block, of, name = scope.context.block_of(kind), expr.of, expr.name  # type: ignore[assignment]
    else:
        return None
    if _has_no_methods(block):
        return None
    found = [block.method(key.format(fold(name.text))) for key in keys]
    return (found, of) if any(found) else None


def _has_no_methods(block: Pou) -> bool:
    """True for a block with neither methods nor accessors of its own or inherited."""
    return not block.methods and block.base is None and not block.interfaces


def _is_result(scope: Scope, name: str) -> bool:
    variable = scope.own_variable(name)
    return variable is not None and variable.kind == "RESULT"


def _may_be_instance(scope: Scope, expr: tree.Expr) -> bool:
    """False for a name in front of a point that is no value: of a library, of a list, of an enumeration."""
    if isinstance(expr, tree.NameRef):
        return expr in scope.facts.types or is_self(scope, expr) or scope.variable(expr.text) is not None or \
            find(scope, expr, ("GET {}",)) is not None or program(scope, expr)
    if isinstance(expr, tree.Member) and qualified.is_space(scope, expr.of):
        return isinstance(qualified.member(scope, expr), Variable)
    return not (isinstance(expr, tree.Member) and isinstance(expr.of, tree.NameRef) and not _may_be_instance(scope, expr.of)
                and not _is_program(scope, expr.of))


def program(scope: Scope, expr: tree.NameRef) -> bool:
    """True for the name of a program that stands for its one instance, which has its type and variable from then on."""
    if expr in scope.facts.types or expr in scope.facts.wrong:
        return False
    pou = scope.project.pou(expr.text, scope.source) if scope.variable(expr.text) is None else None
    instance = scope.context.program_instance(pou, expr) if pou is not None and pou.kind == "PROGRAM" else None
    if instance is None:
        return False
    scope.facts.types[expr], scope.facts.variables[expr] = instance.type, instance
    return True


def _is_program(scope: Scope, name: tree.NameRef) -> bool:
    """True for the name of a program, which stands for its one instance."""
    pou = scope.project.pou(name.text, scope.source)
    return pou is not None and pou.kind == "PROGRAM"


def is_dynamic(scope: Scope, method: Pou, instance: tree.Expr | None) -> bool:
    """True if a call may execute an override: the instance is not named itself, but reached through something."""
    if method.modifiers & {"PRIVATE", "FINAL"} or method.key in ("FB_INIT", "FB_EXIT"):
        return False
    return may_be_derived(scope, instance)


def may_be_derived(scope: Scope, instance: tree.Expr | None) -> bool:
    """True if an instance may be of a type derived from the one that is known: it is reached by a reference or in-out."""
    facts = scope.facts
    if instance is None:
        return True
    inner = instance.of if isinstance(instance, tree.Deref) else instance
    if inner in facts.selves:
        return isinstance(inner, tree.NameRef) and fold(inner.text) == "THIS"
    if isinstance(instance, tree.Deref) or instance in facts.followed or isinstance(facts.types.get(instance), RefType):
        return True
    if isinstance(instance, tree.Index):
        return isinstance(facts.types.get(instance.of), RefType) or isinstance(instance.of, tree.Expr) and \
            may_be_derived(scope, instance.of)
    variable, field = facts.variables.get(instance), facts.fields.get(instance)
    return variable is not None and variable.kind == "VAR_IN_OUT" or field is not None and field.reference


def may_name(scope: Scope, node: tree.Node, method: Pou) -> bool:
    """True if the access word of a method or accessor allows it to be named here; else a diagnostic."""
    home, own = method.block, scope.pou.own_block if scope.pou is not None else None
    assert home is not None
    words, what = method.modifiers, "method" if method.kind == "METHOD" else "property"
    lineage = [*own.lineage()] if own is not None else []
    if "PRIVATE" in words and own is not home:
        word, who = "PRIVATE", f"{home.name} alone names it"
    elif "PROTECTED" in words and home not in lineage:
        word, who = "PROTECTED", f"{home.name} and blocks that extend it name it"
    elif "INTERNAL" in words and not scope.project.is_seen(method.source, scope.source):
        word, who = "INTERNAL", "its own library or namespace names it"
    else:
        return True
    scope.error("S1006", node, f"the {what} {method.tree.name.text} of {home.name} is {word}", who,
                (method.source, method.tree.name.start, "declared here"))
    return False


# --- properties -------------------------------------------------------------------------------------------------------


def value_of_property(scope: Scope, expr: tree.NameRef | tree.Member) -> tuple[bool, Type | None]:
    """Whether an expression names a property, and the type that GET yields, None after a diagnostic."""
    found = _accessors(scope, expr, "GET {}", "SET {}")
    if found is None:
        return False, None
    getter, setter, instance = found
    if getter is None:
        _refuse_access(scope, expr, setter, "GET and cannot be read")
        return True, None
    if not _is_callable(scope, expr, getter, instance):
        return True, None
    call = tree.Call(expr.start, expr.end, expr, ())
    scope.facts.calls[call] = _called(scope, getter, instance, call)
    scope.facts.gets[expr] = call
    kind = getter.result.type if getter.result is not None else None
    if kind is not None:
        if isinstance(kind, RefType) and kind.follows:
            scope.facts.followed[call] = kind
            scope.facts.types[call] = kind.target or kind
        else:
            scope.facts.types[call] = kind
    return True, kind


def target_property(scope: Scope, expr: tree.Expr) -> tuple[bool, Type | None]:
    """Whether the target of an assignment names a property with SET, and the type that SET takes, None after a diagnostic."""
    if not isinstance(expr, tree.NameRef | tree.Member) or (found := _accessors(scope, expr, "SET {}", "GET {}")) is None:
        return False, None
    setter, getter, instance = found
    if setter is None:
        assert getter is not None
        result = getter.result if scope.context.interface(getter, scope.source, expr) else None
        if result is not None and isinstance(result.type, RefType) and result.type.follows:
            return False, None  # what it is bound to is written
        _refuse_access(scope, expr, getter, "SET and cannot be written")
        return True, None
    if not _is_callable(scope, expr, setter, instance):
        return True, None
    call = _called(scope, setter, instance, expr)
    scope.facts.sets[expr] = call
    parameter = setter.parameters("VAR_INPUT")[0] if setter.parameters("VAR_INPUT") else None
    if parameter is not None:
        scope.facts.types[expr] = parameter.type
    return True, parameter.type if parameter is not None else None


def _accessors(scope: Scope, expr: tree.NameRef | tree.Member, wanted: str,
               other: str) -> tuple[Pou | None, Pou | None, tree.Expr | None] | None:
    """The accessor with the wanted form of key, the other accessor and the instance of the property that is named.

    None if no property is named, or inside its own accessors, where the name means the value."""
    found = find(scope, expr, (wanted, other))
    if found is None or _in_accessor(scope, expr):
        return None
    (first, second), instance = found
    return first, second, instance


def _refuse_access(scope: Scope, expr: tree.NameRef | tree.Member, accessor: Pou | None, lacks: str) -> None:
    """The diagnostic for a property of which `accessor` is the only one."""
    assert accessor is not None, "one of both accessors was found"
    name = expr.text if isinstance(expr, tree.NameRef) else expr.name.text
    scope.error("S1008", expr, f"the property {name} of {_home(accessor)} has no {lacks}")


def _home(method: Pou) -> str:
    return method.block.name if method.block is not None else ""


def _in_accessor(scope: Scope, expr: tree.Expr) -> bool:
    """True for the name of a property inside its own accessors, where it means the value."""
    pou = scope.pou
    return isinstance(expr, tree.NameRef) and pou is not None and pou.kind in ("GET", "SET") and \
        fold(expr.text) == fold(pou.tree.name.text)


def _is_callable(scope: Scope, expr: tree.Expr, method: Pou, instance: tree.Expr | None) -> bool:
    if not may_name(scope, expr, method) or not scope.context.interface(method, scope.source, expr):
        return False
    return has_body(scope, expr, method, instance)


def has_body(scope: Scope, node: tree.Node, method: Pou, instance: tree.Expr | None) -> bool:
    """False, after a diagnostic, for SUPER with a method that is ABSTRACT."""
    if "ABSTRACT" in method.modifiers and instance is not None and is_own_instance(scope, instance) and \
            not may_be_derived(scope, instance):
        scope.error("S1007", node, f"{method.tree.name.text} of {_home(method)} is ABSTRACT and has no body to execute")
        return False
    return True


def _called(scope: Scope, method: Pou, instance: tree.Expr | None, node: tree.Node) -> PouCall:
    made = PouCall(method, instance, dynamic=is_dynamic(scope, method, instance))
    scope.note_call(method, node, made.dynamic)
    return made
