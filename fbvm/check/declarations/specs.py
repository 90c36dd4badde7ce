"""Type specifications: a spec of the tree in, a Type and the initial bytes of its variables out."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain

from fbvm.base.types import (
    ANYTHING,
    BOOL,
    ELEMENTARY,
    GENERIC,
    INT,
    Elementary,
    EnumType,
    RefType,
    StructType,
    SubrangeType,
    Type,
    array,
    bound,
    fold,
    followed,
    interface,
    open_array,
    pointer,
    reference,
    string,
)
from fbvm.check.declarations import generic_blocks
from fbvm.check.declarations.construction import INIT_KEY
from fbvm.check.declarations.initial_bytes import initial_bytes
from fbvm.check.declarations.locations import is_open
from fbvm.check.declarations.structures import RELATIVE, Members
from fbvm.check.expressions.constant_integers import integer
from fbvm.check.expressions.constants import default
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols import vendor_names
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.elementary_types import elementary_type
from fbvm.check.symbols.facts import Pou, is_block
from fbvm.check.symbols.refused_forms import report_form
from fbvm.check.symbols.reserved_names import refuse_reserved
from fbvm.check.symbols.symbol_table import Resolved, TypeEntry
from fbvm.syntax import tree
from fbvm.syntax.tree import il

MAX_STRING = 65534
"""Characters of the longest STRING and WSTRING."""


def type_declaration(context: Context, entry: TypeEntry) -> Resolved | None:
    """Resolve a TYPE declaration; None after a diagnostic."""
    declared, spec = entry.tree, entry.tree.spec
    scope = Scope(context, entry.source, None)
    if isinstance(spec, tree.UnionSpec | tree.StructSpec):
        resolved = _structure(scope, spec, entry.name, entry.pack)
    else:
        resolved = resolve(scope, spec, entry.name)
    if resolved is not None and isinstance(resolved[0], EnumType) and isinstance(spec, tree.EnumSpec):
        object.__setattr__(resolved[0], "attributes", entry.attributes)
    if resolved is None or declared.initial is None:
        return resolved
    kind, initial = resolved
    value = declared.initial
    if isinstance(kind, EnumType) and isinstance(value, tree.NameRef) and fold(value.text) in kind.members:
        scope.facts.types[value], scope.facts.constants[value] = kind, kind.members[fold(value.text)]
    return kind, initial_bytes(scope, kind, declared.initial, initial)


def _generic_types(scope: Scope) -> dict[str, Type]:
    """What generic types stand for in the function that is being resolved, by folded name."""
    return scope.pou.types if scope.pou is not None else {}


def resolve_parameter(scope: Scope, spec: tree.TypeSpec) -> Resolved | None:
    """As `resolve`, for a variable of a POU, where generic types may stand."""
    generic = ANYTHING.get(fold(spec.text)) if isinstance(spec, tree.NamedType) else None
    if generic is not None and generic.name in _generic_types(scope):
        return resolve(scope, spec)
    return (generic, bytes(generic.size)) if generic is not None else resolve(scope, spec)


def resolve(scope: Scope, spec: tree.TypeSpec, name: str = "") -> Resolved | None:
    """Type and initial bytes, or None after a diagnostic.  `name` names a type declared with this spec."""
    _refuse_by_dialect(scope, spec, name)
    return _RULES[type(spec)](scope, spec, name)


def _refuse_by_dialect(scope: Scope, spec: tree.TypeSpec, name: str = "") -> None:
    """Report a form that the dialect does not take."""
    if isinstance(spec, tree.RefSpec):
        form = spec.kind
    elif isinstance(spec, tree.StringSpec):
        form = "WSTRING" if spec.wide else "STRING"
    else:
        form = "alias" if name and isinstance(spec, tree.NamedType) else ""
    what = f"another name for {spec.text}" if isinstance(spec, tree.NamedType) else form
    report_form(scope.project.report, scope.dialect, scope.source, spec, form, what)


def _reference(scope: Scope, spec: tree.RefSpec, name: str) -> Resolved | None:
    """REF_TO, POINTER TO and REFERENCE TO.  The target may be the type that is being resolved: a node of a list names itself."""
    target = spec.target
    if isinstance(target, tree.ConstructedSpec) and target.arguments and spec.kind == "REFERENCE TO":
        scope.error("S0193", target, f"a reference constructs nothing: what stands behind {target.base.text} is not used",
                    f"write REFERENCE TO {target.base.text}")
        target = target.base
    if isinstance(target, tree.NamedType):
        entry = scope.project.type_entry(target.text, scope.source)
        pou = scope.project.pou(target.text, scope.source) if entry is None else None
        awaiting: TypeEntry | Pou | None = entry if entry is not None and entry.busy else None
        if awaiting is None and pou is not None and (pou.busy or scope.context.waits_for(pou, scope.source)):
            awaiting = pou
        if awaiting is not None and not (pou is not None and pou.kind == "INTERFACE"):
            name = awaiting.name
            made = RefType(f"{spec.kind} {name}", 8, 8, None, spec.kind == "POINTER TO", spec.kind == "REFERENCE TO")
            awaiting.awaited.append(made)
            return made, bytes(8)
    resolved = resolve(scope, target)
    if resolved is None:
        return None
    kind = resolved[0]
    made = bound(followed(kind)) if spec.kind == "REFERENCE TO" else (pointer if spec.kind == "POINTER TO" else reference)(kind)
    inner = [] if isinstance(kind, StructType) else [kind]
    return (made, bytes(8)) if scope.project.size_limits.nests(made, inner, "the reference has", scope.source, spec) else None


def _named(scope: Scope, spec: tree.NamedType, name: str) -> Resolved | None:
    folded = _without_space(scope, fold(spec.text))
    generic = _generic_types(scope)
    if folded in generic:
        return generic[folded], default(generic[folded])
    entry = scope.project.type_entry(folded, scope.source)
    pou = scope.project.pou(folded, scope.source) if entry is None else None
    if spec.constants and (pou is None or pou.kind != "FUNCTION_BLOCK"):
        scope.error("S0402", spec, f"{spec.text} has no generic constants", "blocks with VAR_GENERIC CONSTANT have")
    if entry is not None:
        return scope.context.declared_type(folded, scope.source)
    if pou is not None and not (pou.is_function and folded in ELEMENTARY):
        chosen = generic_blocks.chosen(scope, pou, spec)
        return _block(scope, chosen, spec) if chosen is not None else None
    kind = BOOL if folded == "BIT" and scope.pou is not None and scope.pou.kind == "FUNCTION_BLOCK" else elementary_type(folded)
    if kind is not None:
        return kind, default(kind)
    if folded in GENERIC:
        scope.error("S0205", spec, f"{folded} is no type of a variable", "it is one of a parameter only")
        return None
    if (why := scope.project.why_unseen(spec.text, scope.source)) is not None:
        scope.error(why[0], spec, *why[1:])
    else:
        scope.error("S0204", spec, f"there is no type or block {spec.text}", _hint(scope, spec.text))
    return None


_ARGUMENTS = {*ELEMENTARY, "STRING"}
"""Types for which TwinCAT has a function F_TYPE, which is no type."""


def _without_space(scope: Scope, name: str) -> str:
    """A folded name of a type without the name of a library in front; one in a namespace stays as it is."""
    space, dot, rest = name.rpartition(".")
    project, source = scope.project, scope.source
    return rest if dot and project.namespaces.space(space, source) is None and project.is_space(space, source) else name


def _hint(scope: Scope, name: str) -> str:
    """The hint for a name that means no type."""
    if fold(name) in vendor_names.TYPES:
        also = ", and BIT in structures" if fold(name) == "BIT" else ""
        return f"its name here is {vendor_names.TYPES[fold(name)]}{also}"
    project = scope.project
    known = chain(ELEMENTARY, ["STRING"], (entry.tree.name.text for entry in project.types.values()),
                  (pou.name for pou in project.pous.values()),
                  (name for name in project.libraries.block_names() if fold(name).removeprefix("F_") not in _ARGUMENTS))
    return vendor_names.library_of(name) or project.nearest(name, known)


def _block(scope: Scope, pou: Pou, spec: tree.NamedType) -> Resolved | None:
    if pou.kind not in ("FUNCTION_BLOCK", "CLASS", "INTERFACE"):
        scope.error("S0204", spec, f"{pou.name} is a {pou.kind}, not a type",
                    "only function blocks have instances in variables")
        return None
    if pou.kind == "INTERFACE":
        assert pou.type is not None or not pou.resolved
        return (interface(pou.type), bytes(8)) if scope.context.interface(pou, scope.source, spec) and pou.type else None
    if not scope.context.interface(pou, scope.source, spec):
        return None
    assert pou.type is not None
    return pou.type, pou.initial


def _type_of(scope: Scope, spec: il.TypeOf, name: str) -> Resolved | None:
    """The type of an expression in the body of the POU whose interface is being resolved."""
    kind = scope.settle(spec.of)
    if kind is None:
        return None
    if is_block(kind):
        scope.error("S0501", spec.of, f"{scope.text(spec.of)} is an instance and no value")
        return None
    return kind, default(kind)


def _string(scope: Scope, spec: tree.StringSpec, name: str) -> Resolved | None:
    if spec.length is None:
        kind: Type = string(wide=spec.wide)
    else:
        length = integer(scope, spec.length)
        if length is None:
            return None
        if not 1 <= length <= MAX_STRING:
            scope.error("S0704", spec.length, f"a {'WSTRING' if spec.wide else 'STRING'} has 1 to "
                        f"{MAX_STRING} characters, not {length}")
            return None
        kind = string(length, spec.wide)
    return kind, default(kind)


def _subrange(scope: Scope, spec: tree.SubrangeSpec, name: str) -> Resolved | None:
    resolved = resolve(scope, spec.base)
    low, high = integer(scope, spec.low), integer(scope, spec.high)
    if resolved is None or low is None or high is None:
        return None
    kind = resolved[0]
    counts = isinstance(kind, Elementary) and ("ANY_INT" in kind.families or "ANY_BIT" in kind.families and kind is not BOOL and
                                               scope.dialect.integers_and_bits)
    if not isinstance(kind, Elementary) or not counts:
        scope.error("S0704", spec.base, f"a subrange needs an integer type, not {kind}")
        return None
    if not kind.low <= low <= high <= kind.high:
        scope.error("S0704", spec, f"{low}..{high} is not a range within {kind}")
        return None
    made = SubrangeType(name or f"{kind} ({low}..{high})", kind.size, kind.align, kind, low, high,
                        not scope.dialect.subranges_unchecked)
    return made, default(made)


def _constructed(scope: Scope, spec: tree.TypeSpec, base: tree.NamedType, values: tree.StructInit | None,
                 ) -> Resolved | None:
    """A type with something in parentheses: initial values of an instance, arguments of FB_init, or a subrange or
    enumeration that is written wrongly."""
    resolved = resolve(scope, base)
    if resolved is not None and _has_init(scope, resolved[0]):
        return resolved
    if resolved is not None and values is not None and _has_inputs(resolved[0], values):
        return resolved[0], initial_bytes(scope, resolved[0], values, resolved[1])
    if resolved is not None and is_block(resolved[0]):
        if not isinstance(spec, tree.ConstructedSpec) or spec.arguments or spec.values is not None:
            _refuse_arguments(scope, spec, base)
    elif resolved is not None:
        scope.error("S0704", spec, f"{resolved[0]} takes no arguments",
                    f"a subrange is written {base.text} (0..9), an initial value {base.text} := 5")
    return resolved


def _instances(scope: Scope, spec: tree.ConstructedSpec) -> Resolved | None:
    """The type of the elements of an array that have initial values behind their type."""
    resolved = resolve(scope, spec.base)
    if resolved is None or spec.values is None:
        return _constructed(scope, spec, spec.base, None)
    given = [value for _, value in spec.values.items if value is not None]
    if _has_init(scope, resolved[0]) and all(isinstance(value, tree.StructInit) for value in given):
        return resolved
    if is_block(resolved[0]) and not all(isinstance(v, tree.StructInit) and _has_inputs(resolved[0], v) for v in given):
        _refuse_arguments(scope, spec, spec.base)
        return None
    return resolved


def _has_init(scope: Scope, kind: Type) -> bool:
    """True for a block with FB_init, its own or an inherited one, which takes the arguments of a declaration."""
    return isinstance(kind, StructType) and kind.block and scope.context.block_of(kind).method(INIT_KEY) is not None


def _refuse_arguments(scope: Scope, spec: tree.TypeSpec, base: tree.NamedType) -> None:
    scope.error("S1011", spec, f"{base.text} has no FB_init that takes arguments",
                f"initial values of its inputs are written {base.text} := (name := value)")


def _array(scope: Scope, spec: tree.ArraySpec, name: str) -> Resolved | None:
    if None in spec.dimensions:
        return _open_array(scope, spec)
    bounds = []
    for dimension in spec.dimensions:
        assert dimension is not None
        low, high = (integer(scope, bound) for bound in dimension)
        if low is None or high is None:
            return None
        if low > high:
            scope.error("S0704", dimension[0], f"the lower bound {low} is above the upper bound {high}")
            return None
        bounds.append((low, high))
    given = spec.element if isinstance(spec.element, tree.ConstructedSpec) else None
    element = _instances(scope, given) if given is not None else resolve(scope, spec.element)
    if element is None:
        return None
    kind, limits = array(tuple(bounds), element[0]), scope.project.size_limits
    if not limits.nests(kind, [element[0]], "the array has", scope.source, spec) or \
            not limits.reserve(kind.count * max(1, element[0].size), "the array takes", scope.source, spec):
        return None
    content = element[1] * kind.count
    return kind, initial_bytes(scope, kind, given.values, content) \
        if given and given.values and not _has_init(scope, element[0]) else content


def _open_array(scope: Scope, spec: tree.ArraySpec) -> Resolved | None:
    """ARRAY [*], which only an in-out can be; `interfaces` reports it elsewhere."""
    element = resolve(scope, spec.element)
    if element is None:
        return None
    if any(dimension is not None for dimension in spec.dimensions):
        scope.error("S0704", spec, "all dimensions of ARRAY [*] are *, or none is")
        return None
    kind = open_array(len(spec.dimensions), element[0])
    return kind, bytes(kind.size)


def _enumeration(scope: Scope, spec: tree.EnumSpec, name: str) -> Resolved | None:
    base = INT
    if spec.base is not None:
        resolved = resolve(scope, spec.base)
        if resolved is None:
            return None
        if is_block(resolved[0]):
            return _constructed(scope, spec, spec.base, _given(spec))
        if not isinstance(resolved[0], Elementary) or not {"ANY_INT", "ANY_BIT"} & resolved[0].families:
            scope.error("S0704", spec.base, "an enumeration is based on an integer or bit string type")
            return None
        base = resolved[0]
    members: dict[str, int] = {}
    shown: dict[int, str] = {}
    following = 0
    for member, written in spec.members:
        refuse_reserved(scope.project.report, scope.source, member, scope.dialect, "member")
        value = integer(scope, written, members) if written is not None else following
        if value is None:
            return None
        if fold(member.text) in members:
            scope.error("S0202", member, f"{member.text} stands twice in this enumeration")
            continue
        if not base.low <= value <= base.high:
            scope.error("S0702", written or member, f"{value} does not fit {base}")
            return None
        members[fold(member.text)] = value
        shown.setdefault(value, member.text)
        following = value + 1
    name = name or f"({', '.join(m.text for m, _ in spec.members)})"
    made = EnumType(name, base.size, base.align, base, members, shown)
    for member_name, value in members.items():
        scope.project.enum_members.setdefault(member_name, []).append((made, value, scope.source.library))
    return made, default(made)


def _structure(scope: Scope, spec: tree.StructSpec | tree.UnionSpec, name: str,
               pack: int | None = None) -> Resolved | None:
    """A structure, or a union: its members share their place, and the first initial value holds."""
    made = Members(isinstance(spec, tree.UnionSpec) or spec.overlap, pack)
    complete, limits = True, scope.project.size_limits
    if isinstance(spec, tree.StructSpec) and spec.bases and not _extend(scope, spec, made):
        return None
    for declared in spec.members:
        packed = isinstance(declared.spec, tree.NamedType) and fold(declared.spec.text) == "BIT"
        resolved = (BOOL, bytes(1)) if packed else resolve(scope, declared.spec)
        if resolved is None:
            complete = False
            continue
        kind, initial = resolved
        if declared.initial is not None:
            initial = initial_bytes(scope, kind, declared.initial, initial)
        place = declared.location if declared.location is not None and not is_open(declared.location, kind) else None
        for member in declared.names:
            if fold(member.text) in made.fields:
                scope.error("S0202", member, f"{member.text} stands twice in this structure")
            elif not limits.allows(made.size * (place is None) + kind.size, "the structure takes", scope.source, member):
                return None
            elif wrong := made.add(member.text, kind, initial, place, packed):
                scope.error("S0604", declared.location or member, wrong, RELATIVE)
    return _whole(scope, spec, made, name) if complete else None


def _whole(scope: Scope, spec: tree.StructSpec | tree.UnionSpec, made: Members, name: str) -> Resolved | None:
    """The structure that these members are; None after a diagnostic."""
    limits = scope.project.size_limits
    if not limits.reserve(made.size, "the structure takes", scope.source, spec):
        return None
    kind, content = made.structure(name or f"STRUCT {scope.context.new_anonymous_number()}")
    if not name:
        scope.project.nameless[kind] = content
    inner = (field.type for field in made.fields.values())
    return (kind, content) if limits.nests(kind, inner, "the structure has", scope.source, spec) else None


def _extend(scope: Scope, spec: tree.StructSpec, made: Members) -> bool:
    """Begin a structure with the members of the one that it extends; False after a diagnostic."""
    resolved = resolve(scope, spec.bases[0])
    if resolved is None:
        return False
    kind, initial = resolved
    if not isinstance(kind, StructType) or kind.block or len(spec.bases) > 1:
        scope.error("S1001", spec.bases[-1], f"a structure extends one structure, and {kind} is none" if len(spec.bases) == 1 else
                    "a structure extends one structure")
        return False
    made.extend(kind, initial)
    return True


def _given(spec: tree.EnumSpec) -> tree.StructInit | None:
    """What looks like an enumeration as initial values of an instance; None if one of its names has no value."""
    fields = tuple((name, value) for name, value in spec.members if value is not None)
    return tree.StructInit(spec.start, spec.end, fields) if len(fields) == len(spec.members) else None


def _has_inputs(kind: Type, values: tree.StructInit) -> bool:
    """True if a block has an input of each of the names."""
    found = [kind.member(name.text) for name, _ in values.fields] if isinstance(kind, StructType) and kind.block else [None]
    return all(member is not None and member.kind == "VAR_INPUT" for member in found)


_RULES: dict[type, Callable[..., Resolved | None]] = {
    tree.NamedType: _named, tree.StringSpec: _string, tree.SubrangeSpec: _subrange, tree.ArraySpec: _array,
    tree.EnumSpec: _enumeration, tree.StructSpec: _structure, tree.UnionSpec: _structure, tree.RefSpec: _reference,
    il.TypeOf: _type_of,
    tree.ConstructedSpec: lambda scope, spec, name: _constructed(scope, spec, spec.base, None),
}
"""By class of specification: `rule(scope, spec, name)`."""
