"""The context of one check: the project with its facts, the rules of the language, and what is resolved on demand.

The parts of the check import this module and not one another.  Where a part needs a type, a global variable or the interface
of a POU, the context looks it up, and has it resolved first by the rule that `Rules` has for its declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from fbvm.base.areas import (
    AREAS,
    E_NAMES,
    SIZED_AREAS,
    Address,
    Area,
    Mailbox,
    e_bank,
    parse_address,
    with_sizes_apart,
)
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import Dialect
from fbvm.base.types import EnumType, RefType, StructType, Type, derives, fold
from fbvm.check.symbols.chain import Chain
from fbvm.check.symbols.config_facts import TaskFact
from fbvm.check.symbols.dependencies import Dependencies, Key, has_lasting_body, key_of
from fbvm.check.symbols.elementary_types import elementary_type
from fbvm.check.symbols.facts import Facts, Pou, StandardCall, Value, Variable
from fbvm.check.symbols.statement_lists import writes_eno
from fbvm.check.symbols.symbol_table import Resolved, SymbolTable, TypeEntry, list_name
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import attributes_before

Evaluate = Callable[[StandardCall, Sequence[Value], Dialect], Value | None]
"""The value of a call of a standard function with constant arguments, None if it is not known before the program runs.

Raises Undefined where the call would trap."""


@dataclass(frozen=True)
class Rules:
    """What is done with each kind of tree node.  The package's top module, `checker`, puts the rules together."""

    expressions: Mapping[type, Callable[..., Type | None]]
    """By class of expression: `rule(scope, expr, want)` infers its type, None after a diagnostic."""
    type_declaration: Callable[[Context, TypeEntry], Resolved | None]
    """Resolves a declared type; None after a diagnostic."""
    global_variable: Callable[[Context, Key], None]
    """Declares the global variable of that name, if a declaration of it was read and not resolved yet."""
    interface: Callable[[Context, Pou], None]
    """Fills in the variables and the layout of a POU."""
    later_constant: Callable[[Context, Pou, tree.NameRef], Variable | None]
    """Resolves a CONSTANT of a POU that is declared behind the declaration that names it; None after a diagnostic."""
    body: Callable[[Context, Pou], None]
    """Checks the statements of a POU."""
    members: Callable[[Context, Pou], None]
    """Checks the methods of a POU against those that it inherits and implements."""
    type_of: Callable[..., Resolved | None]
    """`rule(scope, spec)` resolves a type that is written where a value stands; None after a diagnostic."""
    construction: Callable[..., list[tree.Statement]]
    """`rule(context, source, place, kind, arguments)`: the statements that construct a value of a type, which __NEW has made."""
    destruction: Callable[..., list[tree.Statement]]
    """`rule(context, source, place, kind, known)`: those that end it, as a pointer to the type `known` has them."""


class Context:
    """The state of one check.  `checked_before` has the bodies of libraries that need no check, with their dependencies;
    None if this check records no dependencies for others."""

    def __init__(self, project: SymbolTable, rules: Rules, evaluate: Evaluate,
                 checked_before: Mapping[tree.Pou, Dependencies] | None = None) -> None:
        self.project = project
        self.rules = rules
        self.evaluate = evaluate
        self.report = project.report
        self.facts: Facts = project.facts
        self.chain = Chain(project.report)
        mailboxes = project.libraries.mailboxes
        self.areas: dict[str, Area] = {**AREAS, **{name: e_bank(name, 0) for name in E_NAMES},
                                       **{name: box.at(0) for name, box in mailboxes.items()}}
        """Areas that a program may name; where the optional ones lie is known after layout."""
        if project.dialect.sizes_apart:
            self.areas = with_sizes_apart(self.areas, SIZED_AREAS.values())
        self.sized: set[str] = set()
        """Names of the areas for one size of address that the program uses."""
        self.e_banks: set[str] = set()
        """Names of the banks of E memory that the program uses."""
        self.mailboxes: dict[str, Mailbox] = {}
        """Mailboxes of units that the program uses, by area."""
        self.tasks: list[TaskFact] = []
        """The tasks that run, in the order of the CONFIGURATION."""
        self.resource: tree.Resource | None = None
        """The RESOURCE that the PLC is."""
        self.global_order: list[Variable] = []
        """Global variables and program instances in the order of their slots."""
        self.bodies: list[Pou] = []
        """POUs whose bodies are checked; their `number` is the position here."""
        self.dependencies: dict[Pou, Dependencies] = {}
        """Recorded dependencies of bodies of libraries whose check can be replaced by repeating them."""
        self.constructing: dict[tuple[Pou, str], bool] = {}
        """Of blocks that are resolved, whether they have something to construct in a phase (see declarations.construction)."""
        self.kept_values: Variable | None = None
        """Of a program with FB_init the hidden variable that says whether a start keeps RETAIN variables."""
        self.texts: dict[Value, Variable] = {}
        """Constant texts whose address the program takes, and the hidden variables that they lie in."""
        self.deletions: list[tuple[tree.Call, Source, Pou]] = []
        """Calls of __DELETE, with the POUs that they stand in."""
        self._attributes: dict[Pou, dict[str, str]] = {}
        self._checked_before = checked_before
        self._blocks: dict[int, Pou] = {}
        self._descendants: dict[str, list[Pou]] = {}
        """By name of a type the blocks whose types have that name or are derived from one that has."""
        self._candidates: dict[Pou, dict[Pou, list[int]]] = {}
        """What `candidates` has found, by what calls name."""
        self._indexed = 0
        """How many blocks there were when these two were made."""
        self._identifiers = 0
        self._anonymous = 0
        self._resolving = 0
        """How many interfaces are being resolved, one within the other."""
        self._awaited: list[Pou] = []
        """Blocks that references wait for until no interface is being resolved."""

    def address(self, text: str, source: Source) -> Address:
        """The address that a text of the program names.  Raises AddressError."""
        return parse_address(text, self.areas, self.project.counts_words and not source.library)

    # --- areas, numbers ---------------------------------------------------------------------------------------------

    def use_area(self, name: str) -> None:
        """Record that the program names an area: a PLC has E banks, mailboxes of units and areas for a size only then."""
        self.project.dependencies.record("area", name)
        if name in self.project.libraries.mailboxes:
            self.mailboxes[name] = self.project.libraries.mailboxes[name]
        elif name in E_NAMES:
            self.e_banks.add(name)
        elif name in SIZED_AREAS:
            self.sized.add(name)

    def new_type_identifier(self) -> int:
        """The number that begins each instance of one more block or program."""
        self._identifiers += 1
        return self._identifiers

    def new_anonymous_number(self) -> int:
        """A number for one more type without a name."""
        self._anonymous += 1
        return self._anonymous

    # --- types ------------------------------------------------------------------------------------------------------

    def named_type(self, name: str, source: Source) -> Type | None:
        """The type of that name as seen from `source`, elementary or declared; None without a diagnostic of its own."""
        entry = self.project.type_entry(name, source)
        if entry is None:
            return elementary_type(name)
        resolved = self.declared_type(name, source)
        return resolved[0] if resolved else None

    def declared_type(self, name: str, source: Source) -> Resolved | None:
        """A declared type as seen from `source`, resolved at the first call, which reports its errors."""
        entry = self.project.type_entry(name, source)
        assert entry is not None
        self.project.dependencies.record("declared", name)
        if self.chain.too_long:
            return entry.resolved
        if entry.busy:
            self.report.add("S0207", entry.source, entry.tree.name,
                            f"{entry.name} contains itself", "a type cannot hold a value of its own type")
            return None
        if not entry.done:
            entry.busy = True
            with self.chain.link(entry.source, entry.tree.name, entry.name), self.project.recording(Dependencies()):
                entry.resolved = self.rules.type_declaration(self, entry)
            entry.busy = False
            entry.done = True
            _set_targets(entry.awaited, entry.resolved[0] if entry.resolved else None)
        return entry.resolved

    def type_classes(self) -> EnumType:
        """The enumeration TYPE_CLASS, whose members ANY parameters tell; a library declares it."""
        kind = self.named_type("TYPE_CLASS", Source("", "", "codesys"))
        assert isinstance(kind, EnumType)
        return kind

    def description(self) -> Type | None:
        """The structure AnyType, which has what an ANY parameter tells; a library declares it."""
        return self.named_type("AnyType", Source("", "", "codesys"))

    def exception_codes(self) -> EnumType:
        """The enumeration ExceptionCode, of which __CATCH gives a member; a library declares it."""
        kind = self.named_type("ExceptionCode", Source("", "", "codesys"))
        assert isinstance(kind, EnumType)
        return kind

    def block_of(self, kind: StructType) -> Pou:
        """The function block or program whose instances have this type."""
        return self._blocks[id(kind)]

    def blocks(self) -> Iterable[Pou]:
        """All POUs that have instances or are interfaces, as far as they are resolved."""
        return self._blocks.values()

    def candidates(self, pou: Pou) -> dict[Pou, list[int]]:
        """The bodies that a call of a method or block may mean, by the numbers of the types for which each is meant.

        pou: what the call names: a method, an accessor, an ACTION or a block.  Types that are ABSTRACT have no instances."""
        home = pou.block or pou.owner
        assert home.type is not None, "what has no instances is not meant by different types"
        derived = self._derived_from(home.type)
        if pou in self._candidates:
            return self._candidates[pou]
        found = self._candidates[pou] = {}
        for block in derived:
            if "ABSTRACT" in block.modifiers:
                continue
            meant = block.method(pou.key) if pou.block is not None else block.action(pou.key) if pou.home is not None else block
            if meant is not None:
                found.setdefault(meant, []).append(block.identifier)
        return found

    def executed(self, pou: Pou) -> Pou:
        """The POU whose body is executed for another one: of a block without a statement, in some dialects, that of its base."""
        if pou.base is None or pou.kind not in ("FUNCTION_BLOCK", "CLASS") or self.project.dialect.empty_bodies:
            return pou
        empty = all(isinstance(each, tree.Empty) for each in pou.tree.body)
        return self.executed(pou.base) if empty else pou

    def numbers_of(self, kind: StructType) -> list[int]:
        """The numbers with which instances of a type begin, and of those derived from it."""
        return sorted(block.identifier for block in self._derived_from(kind))

    def _derived_from(self, kind: StructType) -> Iterator[Pou]:
        """The blocks and programs, as far as they are resolved, whose instances are of a type or of one derived from it."""
        if self._indexed != len(self._blocks):
            self._indexed = len(self._blocks)
            self._descendants.clear()
            self._candidates.clear()
            for block in self._blocks.values():
                for name in _names_of(block.type) if block.kind != "INTERFACE" and block.type is not None else ():
                    self._descendants.setdefault(name, []).append(block)
        return (block for block in self._descendants.get(kind.name, ()) if derives(block.type, kind))

    # --- attributes -------------------------------------------------------------------------------------------------

    def attributes(self, pou: Pou) -> dict[str, str]:
        """The attributes in front of a POU: names in small letters and values."""
        if pou not in self._attributes:
            self._attributes[pou] = attributes_before(pou.source.text, pou.tree.start)
        return self._attributes[pou]

    def refuse_copy(self, block: Pou, source: Source, node: tree.Node) -> None:
        """Report a copy of an instance if an attribute of its block forbids it, or one of a block that it extends warns of it.

        TwinCAT copies instances of a block that extends one with no_assign, as published programs do."""
        for level in block.lineage():
            if level is not block and "no_assign" in self.attributes(level):
                self.report.add("S0194", source, node, f"an instance of {block.name} is copied: {level.name}, which it extends, "
                                "has no_assign", "pointers in the copy still point into the source")
            elif "no_assign" in self.attributes(level):
                self.report.add("S1012", source, node, f"instances of {level.name} are not copied: it has no_assign",
                                "use a pointer, a reference or an in-out")
            elif "no_assign_warning" in self.attributes(level):
                self.report.add("S0194", source, node, f"an instance of {level.name} is copied: it has no_assign_warning",
                                "pointers in the copy still point into the source")

    def warn_of_obsolete(self, pou: Pou, source: Source, node: tree.Node) -> None:
        """Warn of a use of a POU that is marked as obsolete, but for uses inside of libraries."""
        said = None if source.library else self.attributes(pou).get("obsolete")
        if said is not None:
            self.report.add("S0194", source, node, f"{pou.name} is obsolete" + f": {said}" * bool(said))

    # --- global variables -------------------------------------------------------------------------------------------

    def global_variable(self, name: str, source: Source) -> Variable | None:
        """The global variable of that name as seen from `source`, declared now if it was not yet; None if there is none."""
        project, folded = self.project, fold(name)
        for owner in project.owners(source):
            key = owner, folded
            if key not in project.globals and (project.sections or key in project.global_declarations):
                self.rules.global_variable(self, key)
            if key in project.globals:
                project.dependencies.record("global", folded)
                return project.globals[key]
        return self.global_variable(name, source) if project.load_list(folded) else None

    def listed(self, space: str, name: str, source: Source) -> Variable | None:
        """The global variable `space.name`, both folded: of the list (file) of that name, of any list for a library's name."""
        variable = self.global_variable(f"{space}.{name}", source) or self.global_variable(name, source)
        if variable is not None and space in self.project.lists and \
                not self.project.libraries.has_space(space) and list_name(variable.source) != space:
            return None
        return variable

    def is_failed_global(self, name: tree.NameRef, source: Source) -> bool:
        """True if there is no such global variable and the reason is reported; it is now if its own declaration needs it."""
        project = self.project
        if self.chain.too_long:
            return True
        if any((owner, fold(name.text)) in project.busy_globals for owner in project.owners(source)):
            self.report.add("S0207", source, name, f"the initial value of {name.text} needs {name.text} itself")
            return True
        return project.is_failed_global(name.text, source)

    # --- POUs -------------------------------------------------------------------------------------------------------

    def interface(self, pou: Pou, source: Source, node: tree.Node) -> bool:
        """Resolve the variables and the layout of a POU that `node` names in `source`; False if it holds itself.

        The body of a library's POU is checked with it."""
        self.project.dependencies.record("interface", *reversed(key_of(pou)))
        if pou.resolved:
            return True
        if self.chain.too_long:
            return False
        if pou.busy:
            self.report.add("S0207", source, node, f"{pou.name} holds an instance of itself",
                            "an instance can hold instances of other blocks only")
            return False
        with self.chain.link(pou.source, pou.tree.name, pou.name):
            self._resolve(pou)
        while self._awaited and not self._resolving:
            awaited = self._awaited.pop()
            self.interface(awaited, awaited.source, awaited.tree.name)
        return pou.resolved

    def _resolve(self, pou: Pou) -> None:
        """Resolve the variables and the layout of a POU, and check the body of one of a library."""
        pou.busy = True
        self._resolving += 1
        outer, self.project.dependencies = self.project.dependencies, Dependencies()
        self.rules.interface(self, pou)
        pou.busy = False
        pou.resolved = True
        _set_targets(pou.awaited, pou.type)
        if pou.type is not None:
            self._blocks[id(pou.type)] = pou
        if pou.source.library:
            self.project.dependencies = Dependencies()
            self.check_body(pou)
        self.project.dependencies = outer
        self._resolving -= 1

    def guards_calls(self, variable: Variable) -> bool:
        """True for a declared EN that holds calls back while it is FALSE; in some dialects EN is an input like any other."""
        if variable.kind != "VAR_INPUT" or fold(variable.name) != "EN":
            return False
        libraries, owner = self.project.libraries, variable.source.library
        plain = libraries.has_plain_en(owner) if owner and libraries.is_shipped(owner) else self.project.dialect.plain_en
        return not plain

    def waits_for(self, pou: Pou, source: Source) -> bool:
        """True if a reference to a block that is declared now gets its target later, when nothing else is being resolved.

        The block may hold instances of what is derived from the one that declares the reference."""
        waits = self._resolving > 0 and not pou.resolved and pou.kind in ("FUNCTION_BLOCK", "CLASS") and \
            not source.library and not pou.source.library
        if waits and pou not in self._awaited:
            self._awaited.append(pou)
        return waits

    def program_instance(self, pou: Pou, node: tree.Node) -> Variable | None:
        """The one instance of a program that is called or looked into by its name; None if a CONFIGURATION has several."""
        self.project.dependencies.repeatable = False
        named = [run.name.text for run in (self.resource.programs if self.resource is not None else ())
                 if fold(run.type_name.text) == fold(pou.name)]
        if len(named) > 1 or not self.interface(pou, pou.source, node) or pou.type is None:
            return None
        name = named[0] if named else pou.name
        known = self.project.globals.get(("", fold(name)))
        if known is not None:
            return known if known.type is pou.type else None
        instance = Variable(name, pou.type, "PROGRAM", pou.source, pou.tree.name, place="abs", initial=pou.initial)
        self.global_order.append(instance)
        self.project.globals["", fold(name)] = instance
        return instance

    def check_body(self, pou: Pou) -> None:
        """Check the body of a POU and of its ACTIONs, once; for a library's POU, repeat recorded dependencies instead."""
        if pou.number >= 0 or not self.interface(pou, pou.source, pou.tree.name):
            return
        if pou.number >= 0:  # its interface has led back here
            return
        pou.number = len(self.bodies)
        self.bodies.append(pou)
        pou.writes_eno = writes_eno(pou)
        if self._checked_before is None or not has_lasting_body(pou):
            self.rules.body(self, pou)
        elif (recorded := self._checked_before.get(pou.tree)) is not None:
            self._repeat(recorded, pou)
        else:
            self._record(pou)
        for part in (*pou.actions.values(), *pou.methods.values()):
            self.check_body(part)
        if pou.block is None and (pou.methods or pou.tree.bases or pou.tree.interfaces):
            self.rules.members(self, pou)

    def _record(self, pou: Pou) -> None:
        """Check the body of a library's POU, and keep its dependencies if repeating them can replace the check."""
        reported, dependencies = len(self.report.diagnostics), self.project.dependencies
        self.rules.body(self, pou)
        dependencies.record_calls(pou, self.project.pous)
        if dependencies.repeatable and reported == len(self.report.diagnostics):
            self.dependencies[pou] = dependencies

    def _repeat(self, recorded: Dependencies, pou: Pou) -> None:
        """Look up what the check of the same body looked up in another project."""
        for what, name, library in recorded.lookups:
            _LOOK_UP[what](self, name, library, pou)
        for key, node in recorded.calls:
            pou.calls[self.project.pous[key]] = node

    def check_repeated(self, pou: Pou) -> None:
        """Check a body after all whose dependencies were repeated only: it has to be lowered with this program."""
        if self._checked_before is not None and pou.tree in self._checked_before:
            self.rules.body(self, pou)


_LOOK_UP: dict[str, Callable[[Context, str, str, Pou], object]] = {
    "POU": lambda context, name, library, pou: context.project.pou(name, pou.source),
    "type": lambda context, name, library, pou: context.project.type_entry(name, pou.source),
    "global": lambda context, name, library, pou: context.global_variable(name, pou.source),
    "area": lambda context, name, library, pou: context.use_area(name),
    "declared": lambda context, name, library, pou: context.declared_type(name, pou.source),
    "interface": lambda context, name, library, pou: context.interface(context.project.pous[library, name], pou.source, pou.tree),
}
"""How each kind of look-up of `Dependencies` is repeated for the body of a POU."""


def _names_of(kind: StructType) -> set[str]:
    """The names of a type and of all that it is derived from."""
    names, waiting = set[str](), [kind]
    while waiting:
        each = waiting.pop()
        if each.name not in names:
            names.add(each.name)
            waiting += each.parents
    return names


def _set_targets(references: list[RefType], target: Type | None) -> None:
    """Give references that were made before their target was resolved that target."""
    for kind in references:
        object.__setattr__(kind, "target", target)
    references.clear()
