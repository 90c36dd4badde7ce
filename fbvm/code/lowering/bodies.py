"""Lowering of bodies: statements of the tree in, operations out.  Every meaning is decided here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from fbvm.base.types import BOOL, NULL, Type, base, machine
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Pou, PouCall, StandardCall
from fbvm.code.image import Body, RungPicture
from fbvm.code.lowering import byte_order
from fbvm.code.lowering.functions import FUNCTIONS
from fbvm.code.lowering.loops import LoopLowering
from fbvm.code.lowering.places import Place, Places, detail
from fbvm.code.lowering.pointers import PointerLowering
from fbvm.code.lowering.pou_calls import CallLowering
from fbvm.code.lowering.st_rungs import Mark, NoRung, st_rung
from fbvm.code.lowering.step_costs import counted
from fbvm.code.lowering.values import DEEPEST, ValueLowering, is_aggregate
from fbvm.code.operations import Block, Node
from fbvm.code.pictures import sfc_picture
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import hides_inside
from fbvm.syntax.tree import ladder, sfc

if TYPE_CHECKING:
    from fbvm.code.lowering.program import Program


class BodyLowering:
    """Lowers the body of one POU.  `out` is the block that is being written."""

    def __init__(self, program: Program, checker: Checker, pou: Pou) -> None:
        self.program = program
        self.checker = checker
        self.facts = checker.project.facts
        self.dialect = checker.project.dialect
        self.pou = pou
        self.out: list[Node] = []
        self._sites: dict[int, int] = {}
        self.reads: list[Place] = []
        self.places = Places(self)
        self.values = ValueLowering(self)
        self.calls = CallLowering(self)
        self.pointers = PointerLowering(self)
        self.loops = LoopLowering(self)
        self.value = self.values.value
        self.entry_site = self.site(pou.tree.name)
        self.unseen = hides_inside(pou.source.text, pou.tree.start)
        self.marked: dict[tree.Expr, list[Mark]] = {}
        """What is seen of expressions that are drawn as steps of a rung."""
        self._rungs: dict[int, int] = {}
        """Statements that are drawn as rungs, and the numbers of those."""
        self._temporaries = 0
        self._heights: dict[int, tuple[int, Node]] = {}

    def body(self) -> Body:
        """The code of the POU, which is all that can be had of this."""
        count = counted(self.pou.tree.body)
        self.out.append(("charge", count + 1, self.entry_site))
        self._entry()
        if self.program.drawn and not self.pou.source.library and not self.unseen:
            self._draw(self.pou.tree.body)
        self.block_into(self.pou.tree.body)
        self.out += self.pointers.released()
        size = self.pou.type.size if self.pou.type is not None else 0
        made = Body(self.pou.name, self.pou.kind, tuple(self.out), size, count)
        vars(self).clear()  # its parts lead back to it, and would wait for the collector
        return made

    def _draw(self, statements: tree.Block) -> None:
        """Note what is seen of statements of Structured Text where they are drawn as rungs."""
        own = tree.Empty | ladder.Ladder | ladder.Rung | sfc.Sfc
        for number, statement in enumerate((one for one in statements if not isinstance(one, own)), 1):
            site, steps, said = self.site(statement), (), ""  # type: int, tuple[tuple[int, str, str, tuple[str, ...]], ...], str
            try:
                rung = st_rung(statement, self.facts, self.pou.source.text)
                steps = tuple((self.site(part or statement), *step) for part, step in rung.steps)
                self.marked |= rung.marks
            except NoRung as reason:
                said = f"in line {self.pou.source.place(statement.start)[0]} is not drawn: {reason}"
            self._rungs[site] = number
            self.program.rungs.append(RungPicture(self.pou.number, site, number, said, steps, is_text=True))

    def _entry(self) -> None:
        """Initial values of the frame, and edges of inputs."""
        start = self.pou.frame_inputs if self.pou.is_function else 0
        fresh = self.pou.frame_initial[start:]
        if fresh:
            base, offset = self.program.frame(self.pou)
            self.out.append(("fill", (base, offset + start, ()), fresh))
        for offset, made in self.program.late_starts.get(self.pou, ()):
            slot = Place(("abs", offset, ()), made.kind)
            self.out.append(self.places.store(slot, self.pointers.to(made.place), self.entry_site))
        for edge in self.pou.edges:
            raw, memory = self.places.slot(edge.raw), self.places.slot(edge.memory)
            pin = self.places.load(raw)
            before: Node = self.places.load(memory)
            if edge.falling:
                # the memory holds "the pin was low", which starts FALSE as in the standard's F_TRIG
                seen: Node = ("and", "b", ("not", "b", pin), ("not", "b", before))
                kept: Node = ("not", "b", pin)
            else:
                seen, kept = ("and", "b", pin, ("not", "b", before)), pin
            self.out.append(self.places.store(self.places.slot(edge.hidden), seen, self.entry_site))
            self.out.append(self.places.store(memory, kept, self.entry_site))

    # --- what the parts share ---------------------------------------------------------------------------------------

    def site(self, node: tree.Node) -> int:
        number = self._sites.get(node.start)
        if number is None:
            number = self._sites[node.start] = self.program.site(self.pou, node)
        return number

    def temporary(self) -> int:
        self._temporaries += 1
        return self._temporaries

    def keep(self, node: Node, always: bool = False) -> Node:
        """The value of an operation in a temporary, worked out now."""
        if node[0] in ("const", "tmp") and not always:
            return node
        number = self.temporary()
        self.out.append(("let", number, node[1], node))
        return ("tmp", node[1], number)

    def keep_at(self, position: int, node: Node) -> Node:
        """The value of an operation in a temporary, worked out where `position` of the block was."""
        if node[0] in ("const", "tmp"):
            return node
        number = self.temporary()
        self.out.insert(position, ("let", number, node[1], node))
        return ("tmp", node[1], number)

    def measured(self, node: Node) -> Node:
        """The same operation, or a temporary for it if it is nested too deep."""
        heights, height = self._heights, 1
        if id(node) in heights:
            return node
        for part in node[2:]:
            if isinstance(part, tuple):
                known = heights.get(id(part))
                if height <= (1 if known is None else known[0]):
                    height = 2 if known is None else known[0] + 1
        if height > DEEPEST:
            return self.keep(node)
        heights[id(node)] = height, node
        return node

    def as_i64(self, expr: tree.Expr) -> Node:
        """An integer expression as i64, for subscripts."""
        kind = self.facts.types[expr]
        node = self.value(expr)
        form = machine(base(kind))
        if form == "u64":
            node = ("min", "u64", node, ("const", "u64", (1 << 63) - 1))
        return node if form == "i64" else ("convert", "i64", form, node)

    @contextmanager
    def block(self) -> Iterator[list[Node]]:
        """Collect statements of an inner block."""
        outer, inner = self.out, []  # type: list[Node], list[Node]
        self.out = inner
        yield inner
        self.out = outer

    def lowered(self, statements: tree.Block) -> Block:
        """An inner block."""
        with self.block() as inner:
            self.block_into(statements)
        return tuple(inner)

    def note_read(self, place: Place, expr: tree.Expr) -> None:
        """Remember a variable that the statement reads, if looking at it beforehand can do no harm: its place needs no
        subscripts, and no reference that might be null."""
        start, _, terms = place.address
        if terms:
            return
        if isinstance(start, tuple):
            root = self.facts.variables.get(self.facts.root(expr))
            if root is None or root.kind != "VAR_IN_OUT":
                return
        self.reads.append(place)

    def observe_reads(self, mark: int, site: int) -> None:
        """Put the observations of what was read since `mark` of the block in front of it."""
        seen = {detail(place): None for place in self.reads}
        self.reads = []
        self.out[mark:mark] = [("observe", "read", site, one) for one in seen]

    def observe_write(self, place: Place, site: int) -> None:
        self.out.append(("observe", "write", site, detail(place)))

    # --- statements -------------------------------------------------------------------------------------------------

    def block_into(self, statements: tree.Block) -> None:
        """Lower statements into the present block."""
        for statement in statements:
            if isinstance(statement, tree.Empty):
                continue
            site = self.site(statement)
            if statement.end > statement.start and not self.unseen and not isinstance(statement, _SEEN_BY_THEMSELVES):
                rung = self._rungs.get(site)
                self.out.append(("observe", "statement" if rung is None else "rung", site, rung))
            mark = len(self.out)
            _LOWER[type(statement)](self, statement, site)
            if self.reads:
                self.observe_reads(mark, site)

    def _assign(self, node: tree.Assign, site: int) -> None:
        if node.op == "REF=":
            self._bind(node, site)
            return
        if node.op in ("S=", "R="):
            condition = self.value(node.value, BOOL)
            with self.block() as inner:
                for target in node.targets:
                    self.write(self.places.of(target), ("const", "b", int(node.op == "S=")), site)
            self.out.append(("if", ((condition, tuple(inner)),), ()))
            return
        value = node.value
        for target in reversed(node.targets):
            if target in self.facts.failed:
                self.discard(self.value(value))
                self.write(self.places.of(target), ("const", "ref", 0), site)
            else:
                self.assign(target, value, site)
            value = target

    def _bind(self, node: tree.Assign, site: int) -> None:
        """`r REF= x`: the slot of r takes a reference to x."""
        slot = self.places.fixed(self.places.binding(node.targets[0]))
        self.out.append(self.places.store(slot, self.pointers.lent(node.value), site))

    def assign(self, target: tree.Expr, value: tree.Expr, site: int) -> None:
        """`target := value`: the subscripts of the target first, then the value."""
        kind = self.facts.types[target]
        if isinstance(value, tree.Call) and value in self.facts.reversed_bytes:
            called = self.facts.calls[value]
            assert isinstance(called, StandardCall)
            byte_order.assign(self, target, called, site)
            return
        if is_aggregate(kind):
            to = self.places.fixed(self.places.of(target))
            self.copy(to, self.aggregate(value), site)
            return
        place = self.places.fixed(self.places.of(target))
        mark = len(self.out)
        node = self.value(value, kind)
        if len(self.out) > mark and isinstance(place.address[0], tuple):
            place = self.places.fixed(place)
        self.write(place, node, site)

    def aggregate(self, expr: tree.Expr) -> Place:
        """The place of an array or structure, also when it is a function's result."""
        if isinstance(expr, tree.Call) and expr not in self.facts.followed:
            called = self.facts.calls[expr]
            if isinstance(called, PouCall):
                return self.calls.aggregate(expr, called)
            return self._chosen(called, expr)
        place = self.places.of(expr)
        if expr not in self.facts.aggregates:
            self.note_read(place, expr)
        return place

    def _chosen(self, called: StandardCall, call: tree.Call) -> Place:
        """The place that MOVE, SEL or MUX of arrays or structures names."""
        kind = self.facts.types[call]
        if called.key == "MOVE":
            return self.aggregate(called.arguments[0][0])
        (chooser, wanted), *rest = called.arguments
        places = [self.aggregate(expr) for expr, _ in rest]
        arguments = [self.value(chooser, wanted), *(self.places.reference(place) for place in places)]
        site = self.site(call)
        chosen = FUNCTIONS[called.key](self, arguments, replace(called, detail=(NULL,)), site)
        return Place((("ref", chosen, site), 0, ()), kind)

    def copy(self, to: Place, source: Place, site: int) -> None:
        self.out.append(("copy", to.address, source.address, to.type.size))
        self.observe_write(to, site)

    def write(self, place: Place, node: Node, site: int) -> None:
        """Store a value and let it be observed."""
        self.out.append(self.places.store(place, node, site))
        self.observe_write(place, site)

    def converted(self, node: Node, kind: Type, target: Type) -> Node:
        return self.values.converted(node, kind, base(target))

    def _call(self, node: tree.CallStatement, site: int) -> None:
        call = self.facts.bare.get(node, node.call)
        assert isinstance(call, tree.Call)
        called = self.facts.calls.get(call)
        if isinstance(called, PouCall):
            self.calls.statement(call, called)
        elif called is not None and call not in self.facts.types:
            self.values.standard(called, call)
        else:
            self.discard(self.value(call))

    def discard(self, node: Node) -> None:
        """Work a value out for its traps only."""
        self.keep(node)

    def _if(self, node: tree.If, site: int) -> None:
        self._branches(list(node.branches), node.otherwise or (), site)

    def _branches(self, branches: list[tuple[tree.Expr, tree.Block]], otherwise: tree.Block, site: int) -> None:
        """One `if` as long as conditions need no statements of their own; a nested one from there on."""
        rows: list[tuple[Node, Block]] = []
        rest: Block | None = None
        for position, (condition, body) in enumerate(branches):
            with self.block() as before:
                node = self.value(condition, BOOL)
            if before and rows:
                with self.block() as inner:
                    self._branches(branches[position:], otherwise, site)
                rest = tuple(inner)
                break
            self.out += before
            rows.append((node, self.inner(body)))
        self.out.append(("if", tuple(rows), self.inner(otherwise) if rest is None else rest))

    def inner(self, statements: tree.Block) -> Block:
        """An inner block whose reads are its own."""
        reads, self.reads = self.reads, []
        made = self.lowered(statements)
        self.reads = reads
        return made

    def _case(self, node: tree.Case, site: int) -> None:
        if node in self.facts.text_cases:
            self._text_case(node)
            return
        form = machine(self.facts.types[node.selector])
        selector = self.value(node.selector)
        rows = tuple((self.facts.labels[branch], self.inner(branch.body)) for branch in node.branches)
        self.out.append(("case", form, selector, rows, self.inner(node.otherwise or ())))

    def _text_case(self, node: tree.Case) -> None:
        """CASE of a text: the first branch one of whose labels equals it."""
        kind = self.facts.types[node.selector]
        form, selector = machine(kind), self.keep(self.value(node.selector), always=True)
        rows = []
        for branch in node.branches:
            fits, *more = (("eq", "b", form, selector, self.value(label, kind)) for label, _ in branch.labels)
            for fit in more:
                fits = self.measured(("or", "b", fits, fit))
            rows.append((fits, self.inner(branch.body)))
        otherwise = self.inner(node.otherwise or ())
        self.out += [("if", tuple(rows), otherwise)] if rows else otherwise

    def _for(self, node: tree.For, site: int) -> None:
        self.loops.for_(node, site)

    def _while(self, node: tree.While, site: int) -> None:
        self.loops.while_(node, site)

    def _repeat(self, node: tree.Repeat, site: int) -> None:
        self.loops.repeat(node, site)

    def _exit(self, node: tree.Exit, site: int) -> None:
        self.out.append(("exit",))

    def _next(self, node: tree.Continue, site: int) -> None:
        self.out.append(("next",))

    def _ladder(self, node: ladder.Ladder, site: int) -> None:
        self.block_into(node.body)

    def _rung(self, node: ladder.Rung, site: int) -> None:
        steps = tuple((self.site(step), step.prefix, step.mnemonic, step.operands) for step in node.steps)
        self.program.rungs.append(RungPicture(self.pou.number, site, node.number, node.comment, steps))
        self.out.append(("observe", "rung", site, node.number))
        self.block_into(node.body)

    def _sfc(self, node: sfc.Sfc, site: int) -> None:
        self.program.charts.append(sfc_picture(node, self.pou, self.site))
        self.out.append(("observe", "statement", self.program.charts[-1].site, None))
        self.block_into(node.body)

    def _return(self, node: tree.Return, site: int) -> None:
        if node.value is not None:
            assert self.pou.result is not None
            place = self.places.slot(self.pou.result)
            if is_aggregate(place.type):
                self.copy(place, self.aggregate(node.value), site)
            else:
                self.write(place, self.value(node.value, place.type), site)
        self.out += [*self.pointers.released(), ("return",)]


_SEEN_BY_THEMSELVES = ladder.Ladder | ladder.Rung | sfc.Sfc
_LOWER: dict[type, Callable[..., None]] = {
    tree.Assign: BodyLowering._assign, tree.CallStatement: BodyLowering._call, tree.If: BodyLowering._if,
    tree.Case: BodyLowering._case, tree.For: BodyLowering._for, tree.While: BodyLowering._while,
    tree.Repeat: BodyLowering._repeat, tree.Exit: BodyLowering._exit, tree.Continue: BodyLowering._next,
    tree.Return: BodyLowering._return, ladder.Ladder: BodyLowering._ladder, ladder.Rung: BodyLowering._rung,
    sfc.Sfc: BodyLowering._sfc,
}
