"""The context in which a body is lowered: what rules for nodes of the tree share, and how they lower the nodes inside theirs.

A rule imports this module and never another rule's caller: it calls `body.value(node)`, `body.place(node)` or
`body.lower(statements)`, which look the rule of the node's class up in the tables that `bodies` puts together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from fbvm.base.memory import reference_to_byte
from fbvm.base.types import BOOL, UDINT, RefType, StructType, Type, base, machine
from fbvm.check.checker import Checker
from fbvm.check.declarations.interfaces import OBJECTS_AT
from fbvm.check.expressions.constants import convert as convert_constant
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.code.builder.constants import constant
from fbvm.code.builder.conversions import implicit
from fbvm.code.builder.emitter import Emitter
from fbvm.code.builder.places import Place
from fbvm.code.layout.layout import variable_bit
from fbvm.code.layout.objects import runs
from fbvm.code.lowering.program import Program
from fbvm.code.operations import FLOATS, OBJECT_SHIFT, TEXT_UNITS, Block, Node
from fbvm.code.pictures.st_rungs import Mark
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import hides_inside
from fbvm.syntax.tree import il, ladder, sfc

ValueRules = dict[type, Callable[..., Node]]
"""By class of expression `rule(body, expr)`: the value of one that is no constant, in the expression's own type."""
PlaceRules = dict[type, Callable[..., Place]]
"""By class of expression `rule(body, expr, kind)`: the place of type `kind` that it names.  Names of variables need no rule."""
StatementRules = dict[type, Callable[..., None]]
"""By class of statement `rule(body, statement, site)`: emits it."""


class Rules(NamedTuple):
    """How all nodes are lowered."""

    values: ValueRules
    places: PlaceRules
    statements: StatementRules


class BodyContext(Emitter):
    """The lowering of one body: facts about its POU, the code that is emitted, and the rules for what is in it."""

    def __init__(self, program: Program, checker: Checker, pou: Pou, rules: Rules) -> None:
        super().__init__(checker.project.dialect)
        self.program, self.checker, self.pou = program, checker, pou
        self.facts = checker.project.facts
        self._rules = rules
        self._values, self._places, self._statements = rules.values, rules.places, rules.statements
        self._sites: dict[int, int] = {}
        self._slots: dict[Variable, Place] = {}
        self.frame: Place | None = None
        """The frame of the body, if that lies on the stack of frames."""
        self.at_return: Block = ()
        """Statements that end the body, for wherever it returns."""
        self.ways_out: Mapping[tree.Statement, str] = {}
        """The statements that lead out of a part of the POU that has a body of its own, with the code of each (WAYS_OUT)."""
        self._reads: list[Place] = []
        """Variables that the present statement reads, for observations."""
        self.entry_site = self.site(pou.tree.name)
        self.is_hidden = hides_inside(pou.source.text, pou.tree.start)
        """True if a pragma says that nobody looks at the statements of the POU."""
        self.rung_numbers: dict[int, int] = {}
        """By site the numbers of statements that are drawn as rungs."""
        self.contacts: dict[tree.Expr, list[Mark]] = {}
        """The contacts of such rungs that show an expression."""

    def part(self, ways_out: Mapping[tree.Statement, str], pou: Pou | None = None) -> BodyContext:
        """The context of a part of the POU, or of another one, that has a body of its own."""
        made = BodyContext(self.program, self.checker, pou or self.pou, self._rules)
        made.ways_out = ways_out
        return made

    def site(self, node: tree.Node) -> int:
        """The number of the place in the source at which a node begins."""
        number = self._sites.get(node.start)
        if number is None:
            number = self._sites[node.start] = self.program.site(self.pou, node)
        return number

    # --- values -----------------------------------------------------------------------------------------------------

    def value(self, expr: tree.Expr, want: Type | None = None) -> Node:
        """The value of an expression.

        Calls inside it, and whatever nests too deep, are emitted as statements in front.

        expr: an expression that the checker has given a type.
        want: the type to which the value is converted; None leaves it in its own."""
        if self.contacts and (marks := self.contacts.get(expr)):
            return self._shown(expr, marks)
        return self._value(expr, want)

    def _value(self, expr: tree.Expr, want: Type | None) -> Node:
        facts = self.facts
        if facts.gets:
            expr = facts.gets.get(expr, expr)
        kind = facts.types[expr]
        known = facts.constants.get(expr)
        if known is not None:
            target = base(kind if want is None else want)
            form = machine(target)
            if form in FLOATS or form == "b" or form in TEXT_UNITS:
                known = convert_constant(known, target)
            elif form == "ref":
                known = reference_to_byte(int(known))
            return constant(target, known)
        if want is None or want is kind:
            return self.cut_if_deep(self._values[type(expr)](self, expr))
        if isinstance(kind, StructType) and kind.block and isinstance(want, RefType):
            return self.cut_if_deep(self.instance_reference(self.place(expr), kind))
        return self.cut_if_deep(implicit(self, self._values[type(expr)](self, expr), kind, base(want)))

    def _shown(self, expr: tree.Expr, marks: list[Mark]) -> Node:
        """A BOOL that contacts of a rung show, with the observations of those."""
        here = self.to_temporary(self._value(expr, BOOL), always=True)
        for mark in marks:
            shown: Node = ("not", "b", here) if mark.negated else here
            self.emit(("observe", "contact", self.site(expr), (mark.step, shown)))
        return here

    def operands(self, *wanted: tuple[tree.Expr, Type | None]) -> list[Node]:
        """The values of several expressions, each with the type that is wanted, evaluated from left to right."""
        nodes: list[Node] = []
        mark = len(self.out)
        for expr, kind in wanted:
            node = self.value(expr, kind)
            if len(self.out) > mark:
                nodes, mark = self.evaluated_before(nodes, mark)
            nodes.append(node)
        return nodes

    def as_i64(self, expr: tree.Expr) -> Node:
        """An integer expression as i64, for subscripts; what does not fit becomes the greatest."""
        node = self.value(expr)
        form = machine(base(self.facts.types[expr]))
        if form == "u64":
            node = ("min", "u64", node, ("const", "u64", (1 << 63) - 1))
        return node if form == "i64" else ("convert", "i64", form, node)

    # --- places -----------------------------------------------------------------------------------------------------

    def place(self, expr: tree.Expr) -> Place:
        """The place that an expression names; for a REFERENCE TO, the place that it is bound to."""
        facts = self.facts
        if facts.gets:
            expr = facts.gets.get(expr, expr)
        reference = facts.followed.get(expr)
        if reference is None or isinstance(expr, tree.Call):
            if expr in facts.aggregates and isinstance(expr, tree.NameRef):  # an ANY as a structure
                return self._places[tree.StructInit](self, expr, facts.types[expr])
            if (variable := facts.variables.get(expr)) is not None:
                return self.variable(variable, expr)
            return self._places[type(expr)](self, expr, facts.types[expr])
        held = self._named(expr, reference).load()
        return Place((("ref", held, self.site(expr)), 0, ()), self.facts.types[expr])

    def reference_slot(self, expr: tree.Expr) -> Place:
        """The place where a REFERENCE TO itself lies, which holds the reference."""
        return self._named(expr, self.facts.followed[expr])

    def _named(self, expr: tree.Expr, kind: Type) -> Place:
        variable = self.facts.variables.get(expr)
        if variable is not None:
            return self.variable(variable, expr)
        return self._places[type(expr)](self, expr, kind)

    def variable(self, variable: Variable, expr: tree.Expr) -> Place:
        """The place of a variable that `expr` names; for an in-out, what its reference points at."""
        slot = self.slot(variable)
        return slot.target(self.site(expr)) if variable.reference else slot

    def slot(self, variable: Variable) -> Place:
        """The place of a variable itself; for an in-out, of its reference, with the type of what that points at."""
        slot = self._slots.get(variable)
        if slot is None:
            slot = self._slots[variable] = self._slot(variable)
        return slot

    def _slot(self, variable: Variable) -> Place:
        if variable.place == "self":
            return Place(("self", variable.offset, ()), variable.type)
        if variable.place == "frame" and variable.owner is not None and variable.owner.stack_bytes:
            assert self.frame is not None and variable.owner is self.pou.owner
            return self.frame.moved(variable.offset, variable.type)
        return Place((*self.program.origin(variable), ()), variable.type, variable_bit(variable))

    def aggregate(self, expr: tree.Expr) -> Place:
        """The place of an array or structure that is read as a whole, also of one that a function yields."""
        place = self.place(expr)
        if (not isinstance(expr, tree.Call) or expr in self.facts.followed) and expr not in self.facts.aggregates:
            self.record_read(place, expr)
        return place

    def instance_reference(self, place: Place, kind: StructType) -> Node:
        """A reference to an instance at a place, in the object that the instance as a whole is."""
        variable = self.checker.block_of(kind).refer_to_instances()
        assert variable.object is not None
        place = self.reusable(place)
        first = ("convert", "u64", "u32", place.moved(OBJECTS_AT, UDINT).load())
        number = self.program.object_of(first, variable.object)
        moved = ("mul", "u64", number, ("const", "u64", 1 << OBJECT_SHIFT))
        position = ("and", "u64", ("bits", "u64", "ref", place.reference()), ("const", "u64", (1 << OBJECT_SHIFT) - 1))
        return ("bits", "ref", "u64", ("or", "u64", moved, position))

    def reusable(self, place: Place) -> Place:
        """The same place with its subscripts and references in temporaries, so that it can be used twice."""
        start, offset, terms = place.address
        if not terms and not isinstance(start, tuple):
            return place
        if isinstance(start, tuple) and start[1][0] != "tmp":
            start = ("ref", self.to_temporary(start[1]), start[2])
        terms = tuple((stride, self.to_temporary(index)) for stride, index in terms)
        return Place((start, offset, terms), place.type, place.bit)

    # --- writes and observations ------------------------------------------------------------------------------------

    def write(self, place: Place, node: Node, site: int) -> None:
        """Store a value of the place's machine type, and let the write be observed."""
        self.out.append(place.store(node, site))
        self.out.append(("observe", "write", site, place.detail()))

    def copy(self, to: Place, source: Place, site: int) -> None:
        """Copy an array, a structure or an instance, and let the write be observed.

        What an instance begins with stays: its type, and the objects that pointers to its variables are moved in."""
        for at, size in runs(to.type):
            whole = size == to.type.size
            self.emit(("copy", to.address, source.address, size) if whole else
                      ("copy", to.moved(at, to.type).address, source.moved(at, to.type).address, size))
        self.observe_write(to, site)

    def observe_write(self, place: Place, site: int) -> None:
        """Let a write that was emitted just now be observed."""
        self.emit(("observe", "write", site, place.detail()))

    def record_read(self, place: Place, expr: tree.Expr) -> None:
        """Have the read of a variable observed in front of the present statement.

        Only a place without subscripts, and behind no reference that might be null, can be looked at beforehand without
        doing harm; others are not observed."""
        start, _, terms = place.address
        if terms:
            return
        if isinstance(start, tuple):
            root = self.facts.variables.get(self.facts.root(expr))
            if root is None or root.kind != "VAR_IN_OUT":
                return
        self._reads.append(place)

    def observe_reads(self, position: int, site: int) -> None:
        """Insert the observations of all recorded reads at a position of the present block."""
        details = {place.detail(): None for place in self._reads}
        self._reads = []
        self.out[position:position] = [("observe", "read", site, detail) for detail in details]

    # --- statements -------------------------------------------------------------------------------------------------

    def lower(self, statements: tree.Block) -> None:
        """Lower statements into the present block, each with its observations."""
        for statement in statements:
            if isinstance(statement, tree.Empty):
                continue
            site = self.site(statement)
            if statement.end > statement.start and not self.is_hidden and type(statement) not in _OBSERVED_BY_RULE:
                rung = self.rung_numbers.get(site)
                self.out.append(("observe", "statement" if rung is None else "rung", site, rung))
            position = len(self.out)
            self._statements[type(statement)](self, statement, site)
            if self._reads:
                self.observe_reads(position, site)

    def lowered(self, statements: tree.Block) -> Block:
        """Statements as a block inside the present statement, whose reads are observed in that block."""
        reads, self._reads = self._reads, []
        with self.block() as inner:
            self.lower(statements)
        self._reads = reads
        return tuple(inner)

    def leave(self, node: tree.Statement, block: Block, site: int) -> None:
        """Emit a jump: `block`, or what makes the body around do that."""
        way = self.ways_out.get(node)
        self.emit(*(block if way is None else (("stop", way, site),)))

    def exit_if(self, condition: tree.Expr, holds: bool, site: int) -> Block:
        """Statements that leave the innermost loop if a condition has the value `holds`, and observe what it reads."""
        reads, self._reads = self._reads, []
        with self.block() as inner:
            node = self.value(condition, BOOL)
            self.emit(("if", ((node if holds else ("not", "b", node), EXIT),), ()))
            self.observe_reads(0, site)
        self._reads = reads
        return tuple(inner)


EXIT: Block = (("exit",),)
_OBSERVED_BY_RULE = frozenset((ladder.Ladder, ladder.Rung, sfc.Sfc, il.InstructionList))
