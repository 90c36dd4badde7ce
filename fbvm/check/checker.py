"""The checker: trees in; variables, types, facts and diagnostics out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext

from fbvm.base.areas import AREAS, E_NAMES, Area, Mailbox, e_bank
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import Dialect
from fbvm.base.types import RefType, StructType, Type, fold
from fbvm.check.calls.calls import Calls
from fbvm.check.calls.generics import is_generic
from fbvm.check.declarations import initializers
from fbvm.check.declarations.configurations import Configurations
from fbvm.check.declarations.globals import Globals
from fbvm.check.declarations.interfaces import Interfaces
from fbvm.check.declarations.specs import Specs, settle
from fbvm.check.declarations.var_config import Settings
from fbvm.check.expressions import references
from fbvm.check.expressions.infer import Expressions
from fbvm.check.expressions.values import Values
from fbvm.check.statements import Statements, writes_eno
from fbvm.check.symbols.dependencies import Asked, is_lasting, key_of
from fbvm.check.symbols.facts import Pou, StandardCall, Start, TaskFact, Value, Variable
from fbvm.check.symbols.project import Project
from fbvm.syntax import tree

_AS_IT_IS = nullcontext()
Evaluate = Callable[[StandardCall, Sequence[Value], Dialect], Value | None]


class Checker:
    """Checks a whole project.  After `check`, the project's facts and these lists are what lowering needs."""

    def __init__(self, project: Project, evaluate: Evaluate) -> None:
        self.project = project
        self.evaluate = evaluate
        """What a call of a standard function gives for constants, None if that is not known now; raises Undefined."""
        self.report = project.report
        self.specs = Specs(project)
        self.values = Values(project, self._fit, self._infer, self._variable, self.interface, self._start)
        self.specs.values = self.values
        self.specs.scope = self.scope
        self.interfaces = Interfaces(self)
        brought = project.libraries.mailboxes
        self.areas: dict[str, Area] = {**AREAS, **{name: e_bank(name, 0) for name in E_NAMES},
                                       **{name: box.at(0) for name, box in brought.items()}}
        """Areas that a program may name; where the optional ones lie is known after layout."""
        self.e_banks: set[str] = set()
        self.mailboxes: dict[str, Mailbox] = {}
        """Those that the program uses."""
        self.tasks: list[TaskFact] = []
        self.resource: tree.Resource | None = None
        """The RESOURCE that the PLC is."""
        self.settings: Settings
        self.globals = Globals(self)
        self.bodies: list[Pou] = []
        """POUs with checked bodies; their `number` is the position here."""
        self.progress: Callable[[int, int], None] = lambda done, known: None
        """Told how many POUs have been checked, and of how many."""
        self.keeps = False
        """True if what is known of bodies of libraries is kept for other programs."""
        self.known: Mapping[tree.Pou, Asked] = {}
        """Bodies of libraries that need no check: what theirs would ask for."""
        self.asked: dict[Pou, Asked] = {}
        """Of those that were checked, what that asked for, if a check of the same body in another program asks the same."""
        self._scope: Pou | None = None
        self._late = False
        self._blocks: dict[int, Pou] = {}

    def check(self, program: str | None = None, resource: str | None = None) -> None:
        """Check everything that the user wrote and what it uses of libraries; choose what the tasks run."""
        configurations = Configurations(self)
        self.resource = configurations.choose(resource, program)
        self.globals.enroll()
        for entry in list(self.project.types.values()):
            if not entry.source.library:
                self.specs.declared(entry.tree.name.text, entry.source)
        self.globals.declare()
        while self.project.new_pous:
            self.progress(len(self.bodies), len(self.bodies) + len(self.project.new_pous))
            pou = self.project.new_pous.popleft()
            if not pou.source.library and not is_generic(pou, self.project):
                self._body(pou)
        configurations.resolve(program)
        self.globals.declare()
        named = self.resource.name.text if self.resource is not None and self.resource.name is not None else ""
        self.settings = Settings(self, named)
        if program is None:
            self.settings.resolve()
        self._check_initial_references()
        self._complain_of_recursion()

    @property
    def global_order(self) -> list[Variable]:
        """Global variables and program instances in the order of their slots."""
        return self.globals.order

    # --- what others ask for ----------------------------------------------------------------------------------------

    def expressions(self, source: Source, pou: Pou | None) -> Expressions:
        return Expressions(self, source, pou)

    def calls(self, expressions: Expressions) -> Calls:
        return Calls(expressions)

    def use_area(self, name: str) -> None:
        """Note that a program names an area, which matters for those that a PLC has only then."""
        self.project.asked.note("area", name)
        if name in self.project.libraries.mailboxes:
            self.mailboxes[name] = self.project.libraries.mailboxes[name]
        elif name in E_NAMES:
            self.e_banks.add(name)

    def block_of(self, kind: StructType) -> Pou:
        return self._blocks[id(kind)]

    def interface(self, pou: Pou, source: Source, node: tree.Node) -> bool:
        """Make the variables and layout of a POU known; False if it holds itself."""
        self.project.asked.note("interface", *reversed(key_of(pou)))
        if pou.resolved:
            return True
        if pou.busy:
            self.report.add("S0207", source, node, f"{pou.name} holds an instance of itself",
                            "an instance can hold instances of other blocks only")
            return False
        pou.busy = True
        asked, self.project.asked = self.project.asked, Asked()
        with self.scope(pou):
            self.interfaces.resolve(pou)
        pou.busy = False
        pou.resolved = True
        settle(pou.awaited, pou.type)
        if pou.type is not None:
            self._blocks[id(pou.type)] = pou
        if pou.source.library:
            self.project.asked = Asked()
            self._body(pou)
        self.project.asked = asked
        return True

    def program(self, pou: Pou, node: tree.Node) -> Variable | None:
        """The one instance of a program that is called or looked into by its name; None if a CONFIGURATION has several."""
        self.project.asked.again = False
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

    def scope(self, pou: Pou | None, late: bool = False) -> AbstractContextManager[None]:
        """Constants of `pou` are visible while its declarations are worked out, `late` ones of its frame among them."""
        return _AS_IT_IS if pou is self._scope and late == self._late else self._other_scope(pou, late)

    @contextmanager
    def _other_scope(self, pou: Pou | None, late: bool) -> Iterator[None]:
        before, self._scope = self._scope, pou
        was_late, self._late = self._late, late
        self.specs.types = pou.types if pou is not None else {}
        yield
        self._scope, self._late = before, was_late
        self.specs.types = before.types if before is not None else {}

    def _fit(self, expr: tree.Expr, source: Source, kind: Type) -> bool:
        expressions = self._constants(source)
        good = expressions.fit(expr, kind, "S0705", "the initial value")
        if good and self.project.dialect.initial_variables and expr not in self.project.facts.constants and \
                initializers.worked_out(expressions, expr):
            return expressions.fit(expr, kind, "S0705", "the initial value")
        return good

    def _variable(self, name: str, source: Source) -> Variable | None:
        return self.expressions(source, self._scope).variable(name)

    def _start(self, init: tree.Expr, kind: RefType, source: Source) -> bytes:
        """The bytes of a reference that is made before anything runs; its place is looked for when all names are known."""
        self.project.asked.again = False
        return references.noted(self.project.facts, Start(references.named(init), init, kind, source, self._scope, self._late))

    def _infer(self, expr: tree.Expr, source: Source) -> Type | None:
        return self._constants(source).settle(expr)

    def _constants(self, source: Source) -> Expressions:
        """For constant expressions of declarations, which name constants of the POU that is being resolved."""
        return Expressions(self, source, self._scope)

    # --- the run of the check ---------------------------------------------------------------------------------------

    def _check_initial_references(self) -> None:
        """What references are made to before anything runs; all names are known by now."""
        for start in self.project.facts.starts:
            references.start(self.expressions(start.source, start.pou), start)

    def check_body(self, pou: Pou) -> None:
        """Check a body that stands in no source: the run of a program with its connections."""
        self._body(pou)

    def _body(self, pou: Pou) -> None:
        if pou.number >= 0 or not self.interface(pou, pou.source, pou.tree.name) or pou.number >= 0:
            return
        pou.number = len(self.bodies)
        self.bodies.append(pou)
        pou.writes_eno = writes_eno(pou)
        if (known := self.known.get(pou.tree)) is not None:
            known.repeat(pou, self)
        elif self.keeps and is_lasting(pou):
            self._asking(pou)
        else:
            Statements(self, pou).block(pou.tree.body)
        for action in pou.actions.values():
            self._body(action)

    def _asking(self, pou: Pou) -> None:
        """Check the body of a library's POU, and note what that asks for."""
        said, asked = len(self.report.diagnostics), self.project.asked
        Statements(self, pou).block(pou.tree.body)
        asked.end(pou, self.project)
        if asked.again and said == len(self.report.diagnostics):
            self.asked[pou] = asked

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
