"""The symbol table: all declarations of a program, the user's own and those of libraries, whose files are read on demand.

A user's own POU or type shadows a library's of the same name, except for names that libraries use."""

from __future__ import annotations

import difflib
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TypeVar

from fbvm.base.codes import CODES
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import STANDARD, Dialect, takers
from fbvm.base.namespaces import Surroundings
from fbvm.base.types import EnumType, RefType, Type, fold
from fbvm.check.symbols.dependencies import Dependencies, Key
from fbvm.check.symbols.facts import Facts, Pou, Variable
from fbvm.check.symbols.library import Libraries
from fbvm.check.symbols.namespaces import Namespaces, full_name
from fbvm.check.symbols.refused_forms import report_objects
from fbvm.check.symbols.report import Report
from fbvm.check.symbols.reserved_names import refuse_reserved
from fbvm.check.symbols.size_limits import SizeLimits
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import attributes, external, pack_mode

Resolved = tuple[Type, bytes]
"""A type, and the initial bytes of a variable of it that is declared without an initial value."""


@dataclass(eq=False)
class TypeEntry:
    """A declared type; `resolved` is set at its first use, and stays None if the declaration has an error."""

    name: str
    """Its name with its namespace in front."""
    tree: tree.TypeDecl
    source: Source
    attributes: frozenset[str] = frozenset()
    """The names of its attributes."""
    pack: int | None = None
    """The multiple of bytes at which members lie at most, where an attribute says that."""
    resolved: Resolved | None = None
    busy: bool = False
    """True while it is being resolved."""
    done: bool = False
    """True once it was resolved."""
    awaited: list[RefType] = field(default_factory=list)
    """References to the type that were made while it was being resolved; they get their target afterwards."""


@dataclass(eq=False)
class GlobalDeclaration:
    """One declaration of global variables, which is resolved in the order of the text or when a name is looked up."""

    declared: tree.VarDecl
    section: tree.VarSection
    source: Source
    done: bool = False


COMPARISONS = 50_000
"""Pairs of names that are compared at most: about a second."""
LISTED = 8
"""How many names a hint lists."""
T = TypeVar("T")
Seen = tuple[str, Surroundings | None]
"""The library and the namespaces from which a name is seen."""


class SymbolTable:
    """Names of all POUs, types and global variables."""

    def __init__(self, libraries: Libraries, report: Report, dialect: Dialect = STANDARD) -> None:
        self.dialect = dialect
        self.libraries = libraries
        self.namespaces = Namespaces()
        self.report = report
        self.facts = Facts()
        self.size_limits = SizeLimits(report, dialect.large_memory)
        self.counts_words = False
        """True if words are counted behind %IX, since some text names a bit above 7."""
        self.pous: dict[tuple[str, str], Pou] = {}
        self.types: dict[tuple[str, str], TypeEntry] = {}
        self.globals: dict[tuple[str, str], Variable] = {}
        self.sections: list[tuple[tree.VarSection, Source]] = []
        """VAR_GLOBAL sections whose names are not in `global_declarations` yet."""
        self.global_declarations: dict[Key, GlobalDeclaration] = {}
        """The first declaration of each global variable that was read."""
        self.undeclared: list[GlobalDeclaration] = []
        """Declarations of global variables in the order of the text, of which some may be resolved already."""
        self.busy_globals: set[Key] = set()
        """Global variables whose declaration is being resolved."""
        self.failed_globals: set[Key] = set()
        """Global variables whose declaration has an error that was reported."""
        self.lists: set[str] = set()
        """Folded names of the files that declare global variables outside of a CONFIGURATION."""
        self.qualified_only: set[tree.VarSection] = set()
        """Sections whose variables are named with their list in front only."""
        self.configurations: list[tuple[tree.Configuration, Source]] = []
        self.enum_members: dict[str, list[tuple[EnumType, int, str]]] = {}
        """By folded name: enumeration, value, and the library that declares it ("" for the user's own)."""
        self.config_sections: list[tuple[tree.AccessVars | tree.ConfigVars, Source]] = []
        """VAR_ACCESS and VAR_CONFIG sections."""
        self.dependencies = Dependencies()
        """What the check of the present body looks up."""
        self._owners: dict[str, tuple[str, ...]] = {}
        self._declaring: dict[str, set[str]] = {}
        """By folded name of a POU or type: the libraries in which it was declared, "" for the user's own texts."""
        self._found_pous: dict[str, dict[Seen, Pou | None]] = {}
        self._found_types: dict[str, dict[Seen, TypeEntry | None]] = {}
        """Results of look-ups: by folded name, and by the library and the namespaces in which the name is used."""
        self._compared = 0
        self._indexed_globals = 0
        self._qualified: dict[str, Variable] = {}
        """The first global variable of each folded name that programs know by the name of its list only."""
        self.operator_types: dict[tuple[str, Type, Type], tuple[Type, Type]] = {}
        """By operator and elementary types of its operands, if none is constant: the types of the operation and the result."""
        self.instantiated: dict[tuple[Pou, tuple[tuple[str, str], ...]], Pou] = {}
        """Functions that were instantiated of generic ones, by the types that the generic types stand for, and blocks, by the
        values of their generic constants."""
        self.nameless: dict[Type, bytes] = {}
        """The initial bytes of structures that are declared where variables are."""
        self.new_pous: deque[Pou] = deque()
        """POUs that have been named but not checked yet."""

    def let_go(self) -> None:
        """Drop everything.  POUs, variables and facts refer to each other in circles, and would stay in memory until the next
        garbage collection."""
        owners = (variable.owner for variable in set(self.facts.variables.values()) if variable.owner)
        for pou in {*self.pous.values(), *self.instantiated.values(), *owners}:
            vars(pou).clear()
        for table in vars(self.facts).values():
            table.clear()
        vars(self).clear()

    def collect(self, text: tree.SourceText, source: Source) -> None:
        """Add the declarations of one text; report names that are declared twice."""
        self._report_forms(text, source)
        self.namespaces.used_in(text, source)
        self._collect(text.declarations, text, source)

    def _collect(self, declarations: Iterable[tree.Declaration], text: tree.SourceText, source: Source) -> None:
        """Add the declarations of a text, or of a NAMESPACE in it."""
        last: Pou | None = None
        for declaration in declarations:
            if isinstance(declaration, tree.Namespace):
                self._collect(declaration.declarations, text, self.namespaces.declare(declaration, source))
            elif isinstance(declaration, tree.Pou):
                last = self._add_pou(declaration, source)
                if self.dialect.pragmas_act and external(text, declaration):
                    name = declaration.name
                    self.report.add("S0901", source, name, f"the body of {name.text} is in another language ({{external}}), "
                                    "which fbvm does not call", "leave {external} out and write its body in Structured Text")
            elif isinstance(declaration, tree.Action):
                self._add_action(declaration, source, declaration.owner, last)
            elif isinstance(declaration, tree.Actions):
                for action in declaration.actions:
                    self._add_action(action, source, declaration.owner, last)
            elif isinstance(declaration, tree.TypeDecl):
                full = full_name(declaration.name.text, source)
                key = (source.library, fold(full))
                if not self._twice(key, declaration.name, source, "type"):
                    self._made_known(self._found_types, key)
                    self.types[key] = TypeEntry(full, declaration, source, frozenset(attributes(text, declaration)),
                                                pack_mode(text, declaration))
            elif isinstance(declaration, tree.GlobalVars):
                self.sections.append((declaration.section, source))
                self.lists.add(list_name(source))
                if "qualified_only" in attributes(text, declaration):
                    self.qualified_only.add(declaration.section)
            elif isinstance(declaration, tree.ConfigVars):
                self.config_sections.append((declaration, source))
            elif isinstance(declaration, tree.Configuration):
                self.configurations.append((declaration, source))
                self.config_sections += [(section, source) for section in declaration.settings]
                self.config_sections += [(section, source) for r in declaration.resources for section in r.settings]
                self.sections += [(s, source) for s in declaration.sections]

    def _report_forms(self, text: tree.SourceText, source: Source) -> None:
        """Report the forms of a text that the dialect does not take, and for the user's own texts those to be warned of."""
        for form in text.forms:
            taken = getattr(self.dialect, form.switch) is form.taken
            self.counts_words |= taken and form.switch == "bits_of_words" and not source.library
            said = form.accepted if taken else form.refused
            if said is None or source.library and CODES[said[0]].severity == "warning":
                continue
            code, message, hint = said
            hint += f", or take {takers(form.switch)}" if form.taken and not taken else ""
            self.report.add(code, source, tree.Node(form.start, form.end), message, hint)

    def _add_action(self, action: tree.Action, source: Source, owner: tree.Name | None, last: Pou | None) -> None:
        """Add an ACTION to the POU that it names, else to the POU in front of it."""
        pou = self.pous.get((source.library, fold(full_name(owner.text, source)))) if owner is not None else last
        if pou is not None and not pou.is_function:
            pou.written_actions.append((action, source))
            return
        named = f"there is no POU {owner.text}" if owner is not None and pou is None else \
            "it stands in or behind a FUNCTION_BLOCK or PROGRAM, or names it: ACTION Motor.Reset"
        self.report.add("S0205", source, action.name, f"the ACTION {action.name.text} belongs to no block or program", named)

    def _add_pou(self, declaration: tree.Pou, source: Source) -> Pou | None:
        name = full_name(declaration.name.text, source)
        key = (source.library, fold(name))
        for refused in declaration.refused:
            self.report.refuse(source, refused)
        if not self._twice(key, declaration.name, source, "POU"):
            self._made_known(self._found_pous, key)
            self.pous[key] = pou = Pou(name, declaration.kind, self.namespaces.used_by(declaration, source), declaration)
            pou.other_names = self.libraries.other_pins(source.library, pou.name)
            pou.modifiers = frozenset(word.text for word in declaration.modifiers)
            pou.written_actions += [(action, source) for action in declaration.actions]
            if any(section.kind == "VAR_GENERIC" for section in declaration.sections):
                pou.template = declaration
            self.new_pous.append(pou)
            report_objects(self.report, self.dialect, source, declaration)
            if self.dialect.functions_have_inputs and pou.is_function and not source.library and not any(
                    section.kind in ("VAR_INPUT", "VAR_IN_OUT") for section in declaration.sections):
                self.report.add("S0195", source, declaration.name, f"{name} has no input, and the tool of this dialect wants one",
                                "matiec takes it with its option -i")
            return pou
        return None

    def _made_known(self, known: dict[str, dict[Seen, T | None]], key: tuple[str, str]) -> None:
        """Note a new declaration, and forget what the names meant that may mean it."""
        owner, full = key
        self._declaring.setdefault(full, set()).add(owner)
        while full:
            known.pop(full, None)
            full = full.partition(".")[2]

    def _twice(self, key: tuple[str, str], name: tree.Name, source: Source, what: str) -> bool:
        refuse_reserved(self.report, source, name, self.dialect, what)
        other = self.pous.get(key) or self.types.get(key)
        if other is None:
            return False
        self.report.add("S0203", source, name, f"{name.text} is declared twice",
                        f"rename one of them: a {what} needs a name of its own",
                        (other.source, other.tree.name.start, "first declared here"))
        return True

    # --- look-up ----------------------------------------------------------------------------------------------------

    @contextmanager
    def recording(self, dependencies: Dependencies) -> Iterator[Dependencies]:
        """Record look-ups in `dependencies` for a while, and not as those of the body that is being checked."""
        before, self.dependencies = self.dependencies, dependencies
        try:
            yield dependencies
        finally:
            self.dependencies = before

    def owners(self, source: Source) -> tuple[str, ...]:
        """The libraries whose names `source` sees, nearest first, "" for the user's own names, which a library never sees."""
        own = source.library
        if own not in self._owners:
            shipped = bool(own) and self.libraries.is_shipped(own)
            others = [name for name in self.libraries.names if name != own]
            self._owners[own] = own, *(name for name in others if not (shipped and self.libraries.is_by_dialect(name)))
        return self._owners[own]

    def _load(self, name: str, owner: str) -> None:
        self._collect_loaded(self.libraries.load(name, owner, self.report))

    def load_list(self, name: str) -> bool:
        """Read the libraries' lists of global variables that a folded name means; False if there is nothing new."""
        return self._collect_loaded(self.libraries.load_list(name, self.report))

    def _collect_loaded(self, loaded: list[tuple[Source, tree.SourceText]]) -> bool:
        for source, text in loaded:
            self.collect(text, source)
        return bool(loaded)

    def pou(self, name: str, source: Source) -> Pou | None:
        """The POU of that name as seen from `source`."""
        return self._find(self.pous, self._found_pous, name, source, "POU")

    def type_entry(self, name: str, source: Source) -> TypeEntry | None:
        return self._find(self.types, self._found_types, name, source, "type")

    def _find(self, table: dict[tuple[str, str], T], known: dict[str, dict[Seen, T | None]], name: str, source: Source,
              what: str) -> T | None:
        folded = fold(name)
        found = known.setdefault(folded, {})
        seen = source.library, source.surroundings
        if seen not in found:
            found[seen] = self._look(table, folded, source)
        answer = found[seen]
        if answer is not None or self.libraries.has_file(folded):
            self.dependencies.record(what, folded)
        return answer

    def _look(self, table: dict[tuple[str, str], T], folded: str, source: Source) -> T | None:
        """What a name means in `source`; reads the libraries' files of that name first."""
        last = folded.rpartition(".")[2]
        in_file = self.libraries.has_file(last)
        if source.surroundings is not None or last != folded:
            if in_file:
                self._load_own(last, source)
            if (meant := self._in_namespaces(folded, source)) is not None:
                return table.get(meant[0]) if len(meant) == 1 else None
        holders, declaring = self.libraries.holders(last) if last == folded else (), self._declaring.get(folded, ())
        for owner in self.owners(source):
            if owner != source.library and owner not in holders and owner not in declaring:
                continue
            if owner in holders and (owner, folded) not in table:
                self._load(folded, owner)
            if (owner, folded) in table and self._kept_by((owner, folded), source) is None:
                return table[owner, folded]
        return None

    def _load_own(self, name: str, source: Source) -> None:
        """Read the files of that name in the user's libraries, since they may declare it in a NAMESPACE."""
        for owner in self.libraries.holders(name):
            if not self.libraries.is_shipped(owner):
                self._load(name, owner)

    def _in_namespaces(self, folded: str, source: Source) -> list[Key] | None:
        """The declarations that a name may mean by the namespaces around it and by USING; None if these say nothing of it."""
        for group in self.namespaces.candidates(folded, source):
            found: dict[str, Key] = {}
            for full in group:
                for key in ((owner, full) for owner in (self.owners(source) if "." in full else (source.library,))):
                    if (key in self.pous or key in self.types) and self._kept_by(key, source) is None:
                        found.setdefault(full, key)
            if found:
                return list(found.values())
        return None

    def _is_internal(self, key: Key) -> bool:
        if key in self.types:
            return self.types[key].tree.internal
        return "INTERNAL" in self.pous[key].modifiers

    def is_seen(self, internal: Source, source: Source) -> bool:
        """True if `source` may name what is INTERNAL in another source: it is of the same library and in the same namespace."""
        around = internal.surroundings
        return internal.library == source.library and \
            (around is None or not around.space or self.namespaces.keeps(fold(f"{around.space}.x"), True, source) is None)

    def _kept_by(self, key: Key, source: Source) -> str | None:
        """What keeps an INTERNAL declaration to itself though `source` names it; None if nothing does."""
        internal = self._is_internal(key)
        if internal and key[0] != source.library:
            return key[0]
        return self.namespaces.keeps(key[1], internal, source)

    def why_unseen(self, name: str, source: Source) -> tuple[str, str, str] | None:
        """Code, message and hint if a name that means nothing in `source` is ambiguous or INTERNAL; else None."""
        folded = fold(name)
        meant = self._in_namespaces(folded, source)
        if meant is not None and len(meant) > 1:
            full = [self.types[key].name if key in self.types else self.pous[key].name for key in meant]
            return "S0211", f"{name} may be {' or '.join(full)}", "write which, with its namespace in front"
        wanted = [key for group in [*self.namespaces.candidates(folded, source), [folded]] for full in group
                  for owner in self.owners(source) for key in [(owner, full)] if key in self.pous or key in self.types]
        keepers = [keeper for key in wanted if (keeper := self._kept_by(key, source)) is not None]
        return ("S1006", f"{name} is INTERNAL", f"{keepers[0]} alone names it") if keepers else None

    def is_space(self, name: str, source: Source) -> bool:
        """True for the name of a list of global variables, of a library or of a namespace, which may qualify other names; also
        for several of them with points between."""
        return self.namespaces.space(name, source) is not None or \
            all(part in self.lists or self.libraries.has_space(part) or self.load_list(part) for part in fold(name).split("."))

    def is_failed_global(self, name: str, source: Source) -> bool:
        """True if a global variable that `source` sees under this name has an error that was reported."""
        return any((owner, fold(name)) in self.failed_globals for owner in self.owners(source))

    def nearest_global(self, name: str, more: Iterable[str] = ()) -> str:
        """A hint for a name that means no global variable, and none of the names in `more`."""
        if len(self.globals) != self._indexed_globals:
            self._indexed_globals = len(self.globals)
            self._qualified = {fold(v.name): v for v in reversed(self.globals.values()) if v.qualified}
        if (variable := self._qualified.get(fold(name))) is not None:
            return f"its list is qualified_only: write {variable.space}.{variable.name}"
        return self.nearest(name, chain(more, (v.name for v in self.globals.values())))

    def nearest_pou(self, name: str, more: Iterable[str]) -> str:
        """A hint for a name that means no POU, and none of the names in `more`."""
        return self.nearest(name, chain(more, (pou.name for pou in self.pous.values()), self.libraries.block_names()))

    def names_in(self, space: str) -> list[str]:
        """The global variables of a list."""
        return [v.name for v in self.globals.values() if list_name(v.source) == fold(space)]

    def tasked(self, program: str) -> set[str]:
        """Folded names of the instances in a program that some CONFIGURATION gives a task of their own."""
        return {fold(row.instance.text) for configuration, _ in self.configurations for resource in configuration.resources
                for run in resource.programs if fold(run.type_name.text) == fold(program)
                for row in run.blocks if isinstance(row.instance, tree.NameRef)}

    def completes(self, name: str) -> bool:
        """True if a VAR_CONFIG gives places to variables of that name."""
        return any(isinstance(last, tree.Member) and fold(last.name.text) == fold(name) and row.location is not None
                   for section, _ in self.config_sections if isinstance(section, tree.ConfigVars)
                   for row in section.variables for last in (row.path,))

    def choices(self, name: str, candidates: Iterable[str]) -> str:
        """A hint that names the candidates most like a misspelt name, or the first ones if none is like it."""
        known = list(candidates)
        more = " ..." if len(known) > LISTED else ""
        return self.nearest(name, known) or (f"it has {', '.join(known[:LISTED])}{more}" if known else "it has none")

    def nearest(self, name: str, candidates: Iterable[str]) -> str:
        """A hint that names the candidates most like a misspelt name, "" if none is.

        After `COMPARISONS` comparisons there are no more hints: thousands of unknown names have another cause than spelling."""
        if self._compared > COMPARISONS:  # which is asked first: to gather the candidates for each name takes time, too
            return ""
        shown = {fold(c): c for c in candidates}
        self._compared += len(shown)
        if self._compared > COMPARISONS:
            return ""
        close = difflib.get_close_matches(fold(name), list(shown), n=3, cutoff=0.7)
        return "did you mean " + " or ".join(shown[c] for c in close) + "?" if close else ""


def list_name(source: Source) -> str:
    """The folded name under which programs know the global variables of a source: that of its file."""
    return fold(Path(source.name).stem)
