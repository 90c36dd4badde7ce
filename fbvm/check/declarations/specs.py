"""Type specifications: a spec of the tree in, a Type and the initial bytes of its variables out."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from fbvm.base.diagnostics import Source
from fbvm.base.types import (
    ANYTHING,
    BOOL,
    ELEMENTARY,
    GENERIC,
    INT,
    SHORT_NAMES,
    ArrayType,
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
    open_array,
    pointer,
    reference,
    string,
)
from fbvm.check.declarations.structures import RELATIVE, Members
from fbvm.check.expressions.constants import default
from fbvm.check.expressions.values import Values
from fbvm.check.symbols import vendor_names
from fbvm.check.symbols.dependencies import Asked
from fbvm.check.symbols.facts import Pou, is_block, is_open
from fbvm.check.symbols.project import Project, TypeEntry
from fbvm.check.symbols.reserved_names import refuse_reserved
from fbvm.syntax import tree

MAX_STRING = 65534
WIDE = {"__UXINT": "ULINT", "__XINT": "LINT", "__XWORD": "LWORD", "UXINT": "ULINT", "XINT": "LINT", "XWORD": "LWORD"}
"""CODESYS's and TwinCAT's names for the types that are as wide as a pointer; here one has 64 bits."""
Resolved = tuple[Type, bytes]


def settle(awaited: list[RefType], target: Type | None) -> None:
    """Give references their target, which is known now."""
    for kind in awaited:
        object.__setattr__(kind, "target", target)
    awaited.clear()


class Specs:
    """Resolves type specifications.  `values` and `scope` are the checker's, which sets them."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self.report = project.report
        self.values: Values
        self.scope: Callable[[Pou | None], AbstractContextManager[None]]
        self.types: dict[str, Type] = {}
        """What generic types stand for in the function that is being resolved."""
        self._anonymous = 0

    def parameter(self, spec: tree.TypeSpec, source: Source) -> Resolved | None:
        """As `resolve`, for a variable of a POU, where generic types may stand."""
        generic = ANYTHING.get(fold(spec.text)) if isinstance(spec, tree.NamedType) else None
        if generic is not None and generic.name in self.types:
            return self.resolve(spec, source)
        return (generic, bytes(generic.size)) if generic is not None else self.resolve(spec, source)

    def resolve(self, spec: tree.TypeSpec, source: Source, name: str = "") -> Resolved | None:
        """Type and initial bytes, or None after a diagnostic.  `name` names a type declared with this spec."""
        self.allowed(spec, source, name)
        if isinstance(spec, tree.NamedType):
            return self._named(spec, source)
        if isinstance(spec, tree.StringSpec):
            return self._string(spec, source)
        if isinstance(spec, tree.SubrangeSpec):
            return self._subrange(spec, source, name)
        if isinstance(spec, tree.ArraySpec):
            return self._array(spec, source)
        if isinstance(spec, tree.EnumSpec):
            return self._enumeration(spec, source, name)
        if isinstance(spec, tree.ConstructedSpec):
            return self._constructed(spec, spec.base, None, source)
        if isinstance(spec, tree.UnionSpec | tree.StructSpec):
            return self._structure(spec, source, name)
        assert isinstance(spec, tree.RefSpec)
        return self._reference(spec, source)

    def allowed(self, spec: tree.TypeSpec, source: Source, name: str = "") -> None:
        """Complain about a form that the dialect does not take."""
        dialect = self.project.dialect
        if isinstance(spec, tree.RefSpec):
            form = spec.kind
        elif isinstance(spec, tree.StringSpec):
            form = "WSTRING" if spec.wide else "STRING"
        else:
            form = "alias" if name and isinstance(spec, tree.NamedType) else ""
        if form in dialect.refused and not source.library:
            what = f"another name for {spec.text}" if isinstance(spec, tree.NamedType) else form
            self.report.add("S0903", source, spec, f"{what} is not taken by the dialect {dialect.name}: {dialect.for_whom}")

    def _reference(self, spec: tree.RefSpec, source: Source) -> Resolved | None:
        """REF_TO, POINTER TO and REFERENCE TO.  The target may be what is being resolved just now: a list's node names itself."""
        target = spec.target
        if isinstance(target, tree.NamedType):
            entry = self.project.type_entry(target.text, source)
            pou = self.project.pou(target.text, source) if entry is None else None
            awaiting = entry if entry is not None and entry.busy else pou if pou is not None and pou.busy else None
            if awaiting is not None:
                name = awaiting.tree.name.text
                made = RefType(f"{spec.kind} {name}", 8, 8, None, spec.kind == "POINTER TO", spec.kind == "REFERENCE TO")
                awaiting.awaited.append(made)
                return made, bytes(8)
        resolved = self.resolve(target, source)
        if resolved is None:
            return None
        kind = resolved[0]
        if spec.kind == "REFERENCE TO":
            return bound(followed(kind)), bytes(8)
        return (pointer if spec.kind == "POINTER TO" else reference)(kind), bytes(8)

    # --- names ------------------------------------------------------------------------------------------------------

    def type_classes(self) -> EnumType:
        """The enumeration of the classes of types that ANY parameters tell, which a library declares."""
        kind = self.named_type("TYPE_CLASS", Source("", "", "codesys"))
        assert isinstance(kind, EnumType)
        return kind

    def elementary(self, name: str) -> Type | None:
        """The elementary type that a name stands for."""
        folded = fold(name)
        if folded in ("STRING", "WSTRING"):
            return string(wide=folded == "WSTRING")
        folded = WIDE.get(folded, folded)
        return ELEMENTARY.get(SHORT_NAMES.get(folded, folded) if folded not in ("T", "D", "LT", "LD") else folded)

    def _named(self, spec: tree.NamedType, source: Source) -> Resolved | None:
        folded = self._without_space(fold(spec.text))
        if folded in self.types:
            return self.types[folded], default(self.types[folded])
        entry = self.project.type_entry(folded, source)
        if entry is not None:
            return self.declared(folded, source)
        pou = self.project.pou(folded, source)
        if pou is not None:
            return self._block(pou, spec, source)
        kind = self.elementary(folded)
        if kind is not None:
            return kind, default(kind)
        if folded in GENERIC:
            self.report.add("S0205", source, spec, f"{folded} is no type of a variable", "it is one of a parameter only")
            return None
        if not self.project.is_refused(folded, source):
            self.report.add("S0204", source, spec, f"there is no type or block {spec.text}", self._meant(spec.text))
        return None

    def _without_space(self, name: str) -> str:
        """A folded name of a type without the name of a library in front."""
        space, dot, rest = name.rpartition(".")
        return rest if dot and self.project.is_space(space) else name

    def _meant(self, name: str) -> str:
        """A hint for a type that there is not."""
        if fold(name) in vendor_names.TYPES:
            also = ", and BIT in structures" if fold(name) == "BIT" else ""
            return f"its name here is {vendor_names.TYPES[fold(name)]}{also}"
        project = self.project
        known = (*ELEMENTARY, "STRING", *(entry.tree.name.text for entry in project.types.values()),
                 *(pou.name for pou in project.pous.values()), *project.libraries.block_names())
        return vendor_names.library_of(name) or project.nearest(name, known)

    def named_type(self, name: str, source: Source) -> Type | None:
        """The type of that name, elementary or declared, without any complaint."""
        entry = self.project.type_entry(name, source)
        if entry is None:
            return self.elementary(name)
        resolved = self.declared(name, source)
        return resolved[0] if resolved else None

    def declared(self, name: str, source: Source) -> Resolved | None:
        """A declared type as seen from `source`; its mistakes are reported at the first call."""
        entry = self.project.type_entry(name, source)
        assert entry is not None
        self.project.asked.note("declared", name)
        if entry.busy:
            self.report.add("S0207", entry.source, entry.tree.name,
                            f"{entry.tree.name.text} contains itself", "a type cannot hold a value of its own type")
            return None
        if not entry.known:
            entry.busy = True
            with self.scope(None), self.project.asking(Asked()):
                entry.resolved = self._type(entry)
            entry.busy = False
            entry.known = True
            settle(entry.awaited, entry.resolved[0] if entry.resolved else None)
        return entry.resolved

    def _type(self, entry: TypeEntry) -> Resolved | None:
        declared = entry.tree
        spec = declared.spec
        resolved = self._structure(spec, entry.source, declared.name.text, entry.pack) \
            if isinstance(spec, tree.UnionSpec | tree.StructSpec) else self.resolve(spec, entry.source, declared.name.text)
        if resolved and declared.initial is not None:
            kind, initial = resolved
            resolved = kind, self.values.initial(kind, declared.initial, entry.source, initial)
        return resolved

    def _block(self, pou: Pou, spec: tree.NamedType, source: Source) -> Resolved | None:
        if pou.kind != "FUNCTION_BLOCK":
            self.report.add("S0204", source, spec, f"{pou.name} is a {pou.kind}, not a type",
                            "only function blocks have instances in variables")
            return None
        if not self.values.interface(pou, source, spec):
            return None
        assert pou.type is not None
        return pou.type, pou.initial

    # --- forms ------------------------------------------------------------------------------------------------------

    def fresh(self, kind: Type) -> bytes:
        """The first value of a type, as its declaration gives it."""
        if isinstance(kind, ArrayType):
            return self.fresh(kind.element) * kind.count
        known = next((entry.resolved[1] for entry in self.project.types.values()
                      if entry.resolved is not None and entry.resolved[0] is kind), None)
        if known is not None or not isinstance(kind, StructType):
            return default(kind) if known is None else known
        content = bytearray(kind.size)
        for member in kind.fields.values():
            if member.bit is None and not any(content[member.offset:member.offset + member.type.size]):
                content[member.offset:member.offset + member.type.size] = self.fresh(member.type)
        return bytes(content)

    def _string(self, spec: tree.StringSpec, source: Source) -> Resolved | None:
        if spec.length is None:
            kind: Type = string(wide=spec.wide)
        else:
            length = self.values.integer(spec.length, source)
            if length is None:
                return None
            if not 1 <= length <= MAX_STRING:
                self.report.add("S0704", source, spec.length, f"a {'WSTRING' if spec.wide else 'STRING'} has 1 to "
                                                              f"{MAX_STRING} characters, not {length}")
                return None
            kind = string(length, spec.wide)
        return kind, default(kind)

    def _subrange(self, spec: tree.SubrangeSpec, source: Source, name: str) -> Resolved | None:
        resolved = self.resolve(spec.base, source)
        low, high = self.values.integer(spec.low, source), self.values.integer(spec.high, source)
        if resolved is None or low is None or high is None:
            return None
        kind = resolved[0]
        if not isinstance(kind, Elementary) or "ANY_INT" not in kind.families:
            self.report.add("S0704", source, spec.base, f"a subrange needs an integer type, not {kind}")
            return None
        if not kind.low <= low <= high <= kind.high:
            self.report.add("S0704", source, spec, f"{low}..{high} is not a range within {kind}")
            return None
        made = SubrangeType(name or f"{kind} ({low}..{high})", kind.size, kind.align, kind, low, high)
        return made, default(made)

    def _constructed(self, spec: tree.TypeSpec, base: tree.NamedType, values: tree.StructInit | None,
                     source: Source) -> Resolved | None:
        """A type with something in parentheses: initial values of an instance, arguments of FB_init, or a subrange or
        enumeration that is written wrongly."""
        resolved = self.resolve(base, source)
        if resolved is not None and values is not None and _has_inputs(resolved[0], values):
            return resolved[0], self.values.initial(resolved[0], values, source, resolved[1])
        if resolved is not None and is_block(resolved[0]):
            self._refuse_arguments(spec, base, source)
        elif resolved is not None:
            self.report.add("S0704", source, spec, f"{resolved[0]} takes no arguments",
                            f"a subrange is written {base.text} (0..9), an initial value {base.text} := 5")
        return resolved

    def _instances(self, spec: tree.ConstructedSpec, source: Source) -> Resolved | None:
        """The type of the elements of an array that have initial values behind their type."""
        resolved = self.resolve(spec.base, source)
        if resolved is None or spec.values is None:
            return self._constructed(spec, spec.base, None, source)
        given = [value for _, value in spec.values.items if value is not None]
        if is_block(resolved[0]) and not all(isinstance(v, tree.StructInit) and _has_inputs(resolved[0], v) for v in given):
            self._refuse_arguments(spec, spec.base, source)
            return None
        return resolved

    def _refuse_arguments(self, spec: tree.TypeSpec, base: tree.NamedType, source: Source) -> None:
        self.report.add("S0902", source, spec, f"arguments for FB_init of {base.text} are object-oriented text, which fbvm "
                        "does not execute", f"initial values of its inputs are written {base.text} := (name := value)")

    def _array(self, spec: tree.ArraySpec, source: Source) -> Resolved | None:
        if None in spec.dimensions:
            return self._open_array(spec, source)
        bounds = []
        for dimension in spec.dimensions:
            assert dimension is not None
            low, high = (self.values.integer(bound, source) for bound in dimension)
            if low is None or high is None:
                return None
            if low > high:
                self.report.add("S0704", source, dimension[0], f"the lower bound {low} is above the upper bound {high}")
                return None
            bounds.append((low, high))
        given = spec.element if isinstance(spec.element, tree.ConstructedSpec) else None
        element = self._instances(given, source) if given is not None else self.resolve(spec.element, source)
        if element is None:
            return None
        kind = array(tuple(bounds), element[0])
        if not self.project.room.has(kind.count * max(1, element[0].size), "the array takes", source, spec):
            return None
        content = element[1] * kind.count
        return kind, self.values.initial(kind, given.values, source, content) if given and given.values else content

    def _open_array(self, spec: tree.ArraySpec, source: Source) -> Resolved | None:
        """ARRAY [*], which only an in-out can be; who declares the variable looks after that."""
        element = self.resolve(spec.element, source)
        if element is None:
            return None
        if any(dimension is not None for dimension in spec.dimensions):
            self.report.add("S0704", source, spec, "all dimensions of ARRAY [*] are *, or none is")
            return None
        kind = open_array(len(spec.dimensions), element[0])
        return kind, bytes(kind.size)

    def _enumeration(self, spec: tree.EnumSpec, source: Source, name: str) -> Resolved | None:
        base = INT
        if spec.base is not None:
            resolved = self.resolve(spec.base, source)
            if resolved is None:
                return None
            if is_block(resolved[0]):
                return self._constructed(spec, spec.base, _given(spec), source)
            if not isinstance(resolved[0], Elementary) or not {"ANY_INT", "ANY_BIT"} & resolved[0].families:
                self.report.add("S0704", source, spec.base, "an enumeration is based on an integer or bit string type")
                return None
            base = resolved[0]
        members: dict[str, int] = {}
        shown: dict[int, str] = {}
        following = 0
        for member, written in spec.members:
            refuse_reserved(self.report, source, member)
            value = self.values.integer(written, source, members) if written is not None else following
            if value is None:
                return None
            if fold(member.text) in members:
                self.report.add("S0202", source, member, f"{member.text} stands twice in this enumeration")
                continue
            if not base.low <= value <= base.high:
                self.report.add("S0702", source, written or member, f"{value} does not fit {base}")
                return None
            members[fold(member.text)] = value
            shown.setdefault(value, member.text)
            following = value + 1
        if not name:
            self._anonymous += 1
            name = f"({', '.join(m.text for m, _ in spec.members)})"
        made = EnumType(name, base.size, base.align, base, members, shown)
        for member_name, value in members.items():
            self.project.enum_members.setdefault(member_name, []).append((made, value, source.library))
        return made, default(made)

    def _structure(self, spec: tree.StructSpec | tree.UnionSpec, source: Source, name: str,
                   pack: int | None = None) -> Resolved | None:
        """A structure, or a union: its members share their place, and the first initial value holds."""
        made = Members(isinstance(spec, tree.UnionSpec) or spec.overlap, pack)
        complete = True
        for declared in spec.members:
            packed = isinstance(declared.spec, tree.NamedType) and fold(declared.spec.text) == "BIT"
            resolved = (BOOL, bytes(1)) if packed else self.resolve(declared.spec, source)
            if resolved is None:
                complete = False
                continue
            kind, initial = resolved
            if declared.initial is not None:
                initial = self.values.initial(kind, declared.initial, source, initial)
            place = declared.location if declared.location is not None and not is_open(declared.location, kind) else None
            for member in declared.names:
                if fold(member.text) in made.fields:
                    self.report.add("S0202", source, member, f"{member.text} stands twice in this structure")
                elif not self.project.room.fits(made.size * (place is None) + kind.size, "the structure takes", source, member):
                    return None
                elif wrong := made.add(member.text, kind, initial, place, packed):
                    self.report.add("S0604", source, declared.location or member, wrong, RELATIVE)
        if not complete or not self.project.room.has(made.size, "the structure takes", source, spec):
            return None
        if not name:
            self._anonymous += 1
            name = f"STRUCT {self._anonymous}"
        return made.structure(name)


def _given(spec: tree.EnumSpec) -> tree.StructInit | None:
    """What looks like an enumeration as initial values of an instance; None if one of its names has no value."""
    fields = tuple((name, value) for name, value in spec.members if value is not None)
    return tree.StructInit(spec.start, spec.end, fields) if len(fields) == len(spec.members) else None


def _has_inputs(kind: Type, values: tree.StructInit) -> bool:
    """True if a block has an input of each of the names."""
    found = [kind.member(name.text) for name, _ in values.fields] if isinstance(kind, StructType) and kind.block else [None]
    return all(member is not None and member.kind == "VAR_INPUT" for member in found)
