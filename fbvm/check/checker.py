"""The checker: trees in; variables, types, facts and diagnostics out.

This module puts the parts of the check together: its `RULES` say which part has the rule of which tree node."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from fbvm.check.calls import calls, dynamic_memory, generics
from fbvm.check.declarations import construction, first_cycle, generic_blocks, globals, inheritance, interfaces, specs, variables
from fbvm.check.declarations.configurations import Configurations
from fbvm.check.declarations.var_config import VarConfig
from fbvm.check.expressions import references, rules
from fbvm.check.expressions.scope import Scope
from fbvm.check.recursion import check_recursion
from fbvm.check.statements import check_body
from fbvm.check.symbols.context import Context, Evaluate, Rules
from fbvm.check.symbols.dependencies import Dependencies
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.syntax import tree
from fbvm.syntax.tree import il

RULES = Rules(
    expressions={**rules.RULES, tree.Call: calls.value, il.CallsInRow: calls.in_row},
    type_declaration=specs.type_declaration,
    global_variable=globals.declare_early,
    interface=interfaces.resolve_interface,
    later_constant=variables.later_constant,
    body=check_body,
    members=inheritance.check_members,
    type_of=specs.resolve,
    construction=construction.of_value,
    destruction=construction.endings_of_value,
)


def _no_progress(done: int, known: int) -> None:
    """The default of `progress`."""


class Checker(Context):
    """Checks a whole project.  After `check`, the project's facts and the lists of the context are what lowering needs.

    `evaluate` folds calls of standard functions; `progress` is called with the number of POUs that are checked and of those
    that are known; `checked_before` as for `Context`."""

    def __init__(self, project: SymbolTable, evaluate: Evaluate, checked_before: Mapping[tree.Pou, Dependencies] | None = None,
                 progress: Callable[[int, int], None] = _no_progress) -> None:
        super().__init__(project, RULES, evaluate, checked_before)
        self._progress = progress
        self.var_config = VarConfig(self)

    def check(self, program: str | None = None, resource: str | None = None) -> None:
        """Check everything that the user declares and what it uses of libraries; choose what the tasks run."""
        for _ in self.steps(program, resource):
            pass

    def steps(self, program: str | None = None, resource: str | None = None) -> Iterator[None]:
        """As `check`, but stops in front of each POU, so that a caller can do something else, or give up, between two of them."""
        configurations = Configurations(self)
        self.resource = configurations.choose(resource, program)
        globals.enroll(self)
        for entry in list(self.project.types.values()):
            if not entry.source.library:
                self.declared_type(entry.name, entry.source)
        globals.declare(self)
        yield from self._bodies()
        configurations.resolve(program)
        globals.declare(self)
        configurations.begin_tasks()
        first_cycle.construct_at_start(self)
        dynamic_memory.find_exits(self)
        yield from self._bodies()
        globals.declare(self)
        self.check_usings()
        if program is None:
            self.var_config.resolve()
        self.check_starts()
        check_recursion(self)

    def _bodies(self) -> Iterator[None]:
        """Check the bodies of the user's POUs that were not checked yet, and stop in front of each."""
        while self.project.new_pous:
            self._progress(len(self.bodies), len(self.bodies) + len(self.project.new_pous))
            yield
            pou = self.project.new_pous.popleft()
            if (not pou.source.library or pou.block is not None) and not generics.is_generic(pou, self.project) \
                    and not generic_blocks.lacks_constants(pou):
                self.check_body(pou)

    def check_usings(self) -> None:
        """Report names behind USING that are no namespace."""
        project = self.project
        for name, source in project.namespaces.usings:
            if not project.is_space(name.text, source) and not project.libraries.declares_space(name.text):
                self.report.add("S0211", source, name, f"there is no NAMESPACE {name.text}",
                                project.nearest(name.text, project.namespaces.declared.values()))

    def check_starts(self, first: int = 0) -> None:
        """Check the references in initial values, from the one with the number `first` in `Facts.starts` on."""
        for start in self.facts.starts[first:]:
            references.check_initial(Scope(self, start.source, start.pou), start)
