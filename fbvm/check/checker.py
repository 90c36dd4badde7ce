"""The checker: trees in; variables, types, facts and diagnostics out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fbvm.base.areas import AREAS, E_NAMES
from fbvm.base.diagnostics import Source
from fbvm.base.types import StructType, Type, fold
from fbvm.check.calls import Calls
from fbvm.check.configurations import Configurations
from fbvm.check.expressions import Expressions
from fbvm.check.facts import Pou, TaskFact, Variable
from fbvm.check.interfaces import Interfaces
from fbvm.check.project import Project
from fbvm.check.specs import Specs
from fbvm.check.statements import Statements, assigns_to
from fbvm.check.values import Values
from fbvm.syntax import tree


class Checker:
    """Checks a whole project.  After `check`, the project's facts and these lists are what lowering needs."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self.report = project.report
        self.specs = Specs(project)
        self.values = Values(project, self._fit, self._infer, self.interface)
        self.specs.values = self.values
        self.interfaces = Interfaces(self)
        self.e_banks: set[str] = set()
        self.tasks: list[TaskFact] = []
        self.global_order: list[Variable] = []
        """Global variables and program instances in the order of their slots."""
        self.bodies: list[Pou] = []
        """POUs with checked bodies; their `number` is the position here."""
        self._scope: Pou | None = None
        self._declared_sections = 0
        self._blocks: dict[str, Pou] = {}

    def check(self, program: str | None = None) -> None:
        """Check everything that the user wrote and what it uses of libraries; choose what the tasks run."""
        for entry in list(self.project.types.values()):
            if not entry.source.library:
                self.specs.declared(entry.tree.name.text, entry.source)
        self._declare_globals()
        while self.project.new_pous:
            pou = self.project.new_pous.pop(0)
            if not pou.source.library:
                self._body(pou)
        Configurations(self).resolve(program)
        self._complain_of_recursion()

    # --- what others ask for ----------------------------------------------------------------------------------------

    def expressions(self, source: Source, pou: Pou | None) -> Expressions:
        return Expressions(self, source, pou)

    def calls(self, expressions: Expressions) -> Calls:
        return Calls(expressions)

    def use_area(self, name: str) -> None:
        """Note that a program names an area, which matters for E banks."""
        if name not in AREAS:
            assert name in E_NAMES
            self.e_banks.add(name)

    def is_damaged(self, pou: Pou, name: str) -> bool:
        return fold(name) in pou.damaged

    def block_of(self, kind: StructType) -> Pou:
        return self._blocks[kind.name]

    def interface(self, pou: Pou, source: Source, node: tree.Node) -> bool:
        """Make the variables and layout of a POU known; False if it holds itself."""
        if pou.resolved:
            return True
        if pou.busy:
            self.report.add("S0207", source, node, f"{pou.name} holds an instance of itself",
                            "an instance can hold instances of other blocks only")
            return False
        pou.busy = True
        self._declare_globals()
        with self.scope(pou):
            self.interfaces.resolve(pou)
        pou.busy = False
        pou.resolved = True
        if pou.type is not None:
            self._blocks[pou.type.name] = pou
        if pou.source.library:
            self._body(pou)
        return True

    @contextmanager
    def scope(self, pou: Pou | None) -> Iterator[None]:
        """Constants of `pou` are visible while its declarations are worked out."""
        before, self._scope = self._scope, pou
        yield
        self._scope = before

    def _fit(self, expr: tree.Expr, source: Source, kind: Type) -> bool:
        return Expressions(self, source, self._scope).fit(expr, kind, "S0705", "the initial value")

    def _infer(self, expr: tree.Expr, source: Source) -> Type | None:
        return Expressions(self, source, self._scope).settle(expr)

    # --- writing ----------------------------------------------------------------------------------------------------

    def writable(self, expressions: Expressions, expr: tree.Expr, purpose: str) -> bool:
        """True if the place may be written here; else a diagnostic that says why not."""
        facts = expressions.facts
        inner = expr
        while True:
            member = facts.fields.get(inner)
            if member is not None and (member.constant or member.kind == "VAR_OUTPUT"):
                what = "a constant" if member.constant else "an output"
                expressions.error("S0501", expr, f"{member.name} is {what} and cannot {purpose} from here")
                return False
            if not isinstance(inner, tree.Member | tree.Index | tree.Part):
                break
            inner = inner.of
        address = facts.directs.get(inner)
        variable = facts.variables.get(inner)
        if variable is not None:
            address = variable.location
            if variable.constant:
                expressions.error("S0501", expr, f"{variable.name} is CONSTANT and cannot {purpose}", "",
                                  (variable.source, variable.node.start, "declared here"))
                return False
            self._note_write(expressions, expr, inner, variable)
        if address is not None and address.area in AREAS and address.number < AREAS[address.area].read_only:
            expressions.error("S0501", expr, f"{address} is read-only for programs and cannot {purpose}")
            return False
        return True

    def _note_write(self, expressions: Expressions, expr: tree.Expr, inner: tree.Expr, variable: Variable) -> None:
        pou = expressions.pou
        variable.written = True
        raw = pou is not None and any(edge.hidden is variable for edge in pou.edges)
        is_input = variable.kind == "VAR_INPUT" and variable.owner is pou
        if inner is expr and (is_input or raw):
            expressions.error("S0591", expr, f"{variable.name.removesuffix(' edge')} is an input of {pou.name if pou else ''}"
                                             " and is written inside it")

    # --- the run of the check ---------------------------------------------------------------------------------------

    def _declare_globals(self) -> None:
        """Declare the VAR_GLOBAL sections that were read since the last time, constants first."""
        pending = self.project.sections
        self.project.sections = []
        pending.sort(key=lambda item: not any(fold(q.text) == "CONSTANT" for q in item[0].qualifiers))
        for section, source in pending:
            self.declare_globals(section, source)
        if self.project.sections:
            self._declare_globals()

    def declare_globals(self, section: tree.VarSection, source: Source) -> None:
        """Declare the variables of one VAR_GLOBAL section."""
        self.interfaces.qualified(section, source, "program")
        for declared in section.variables:
            resolved = self.interfaces.typed(declared, source, None)
            if resolved is None:
                continue
            for name in declared.names:
                variable = self.interfaces.variable(declared, name, section, source, resolved)
                variable.place = "area" if declared.location is not None else "abs"
                key = (source.library, fold(name.text))
                if key in self.project.globals:
                    other = self.project.globals[key]
                    self.report.add("S0202", source, name, f"the global {name.text} is declared twice", "",
                                    (other.source, other.node.start, "first declared here"))
                    continue
                self.project.globals[key] = variable
                self.global_order.append(variable)

    def _body(self, pou: Pou) -> None:
        if pou in self.bodies or not self.interface(pou, pou.source, pou.tree.name) or pou in self.bodies:
            return
        pou.number = len(self.bodies)
        self.bodies.append(pou)
        pou.writes_eno = assigns_to(pou.tree.body, "ENO")
        Statements(self, pou).block(pou.tree.body)

    def _complain_of_recursion(self) -> None:
        """POUs never call themselves, directly or through others (7.2)."""
        done: set[Pou] = set()
        path: list[Pou] = []

        def visit(pou: Pou) -> None:
            if pou in path:
                ring = [p.name for p in path[path.index(pou):]] + [pou.name]
                self.report.add("S0408", path[-1].source, path[-1].calls[pou],
                                f"{' calls '.join(ring)}: calls must not come back", "use a loop")
                return
            if pou in done:
                return
            done.add(pou)
            path.append(pou)
            for callee in pou.calls:
                visit(callee)
            path.pop()

        for pou in list(self.bodies):
            visit(pou)
