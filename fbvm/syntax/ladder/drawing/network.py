"""Nets to a diagram: the elements of a drawing as series, branches, and points from which outputs leave."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NoReturn

from fbvm.syntax.ladder.drawing.box_lines import LEFT, RIGHT
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Contact, Parallel, Part, Pin, Point, Series
from fbvm.syntax.ladder.drawing.grid import DrawingError, DrawnBox, DrawnElement, Grid
from fbvm.syntax.ladder.drawing.wires import BUS, SINK, Net, Order, Wires, border

INLINE = ("NOT", "UP", "DOWN")
"""Instructions that are drawn as boxes on a line."""
Source = DrawnElement | DrawnBox


@dataclass(eq=False)
class _Edge:
    """The elements between two nets."""

    start: Hashable
    end: Hashable
    order: Order
    parts: list[Part]


@dataclass
class _Leaf:
    """An output on a net, and the nets of its other inputs."""

    order: Order
    out: Coil | Box
    others: list[Net] = field(default_factory=list)


class Nets(ABC):
    """Makes a diagram of elements that stand between nets: `add_edge` and `add_output` take them, `diagram` is the result.

    A subclass says in `bad` what is wrong with an element."""

    def __init__(self) -> None:
        self.edges: list[_Edge] = []
        self.leaves: dict[Hashable, list[_Leaf]] = {}
        self._rows: dict[int, list[tuple[Order, Series]]] = {}
        """By parallel connection, its branches with their positions."""
        self._from: defaultdict[Hashable, list[_Edge]] = defaultdict(list)
        self._into: defaultdict[Hashable, list[_Edge]] = defaultdict(list)
        """The edges that leave and enter each net, when all have been joined that can be."""
        self._inputs: set[Hashable] = set()
        """Nets of lower inputs that lead nowhere else."""

    def add_edge(self, start: Net, end: Hashable, part: Part) -> None:
        """An element through which power goes from one net to another."""
        self.edges.append(_Edge(start.name, end, start.order, [part]))

    def add_output(self, start: Net, out: Coil | Box, others: Sequence[Net] = ()) -> None:
        """An output on a net, and the nets of its lower inputs."""
        self.leaves.setdefault(start.name, []).append(_Leaf(start.order, out, list(others)))

    @abstractmethod
    def bad(self, part: Part | Coil, message: str, hint: str) -> NoReturn:
        """Raises the error about an element."""

    def diagram(self) -> Point:
        """The bus bar with all elements that follow it.  Raises DrawingError."""
        while self._merge_branches() or self._merge_series():
            pass
        self._from, self._into = self._by_net("start"), self._by_net("end")
        self._check()
        self._inputs = {name for name in self._others() if name not in self.leaves and not self._from[name]}
        bar = Point(Series())
        self._hang(bar, BUS, None)
        return bar

    # --- reduction --------------------------------------------------------------------------------------------------

    def _merge_branches(self) -> bool:
        """Join the edges between the same two nets to parallel connections."""
        found: dict[tuple[Hashable, Hashable], list[_Edge]] = {}
        for edge in self.edges:
            if edge.end != SINK:
                found.setdefault((edge.start, edge.end), []).append(edge)
        groups = [sorted(group, key=lambda edge: edge.order) for group in found.values() if len(group) > 1]
        merged = {edge for group in groups for edge in group}
        self.edges = [edge for edge in self.edges if edge not in merged]
        for group in groups:
            rows = sorted((row for edge in group for row in self._branches(edge)), key=lambda row: row[0])
            whole = Parallel([branch for _, branch in rows])
            self._rows[id(whole)] = rows
            self.edges.append(_Edge(group[0].start, group[0].end, group[0].order, [whole]))
        return bool(groups)

    def _branches(self, edge: _Edge) -> list[tuple[Order, Series]]:
        """The branches of an edge with their positions; one branch if the edge is no parallel connection."""
        first = edge.parts[0]
        if len(edge.parts) == 1 and isinstance(first, Parallel):
            return self._rows[id(first)]
        return [(edge.order, Series(edge.parts))]

    def _merge_series(self) -> bool:
        """Join edges to a series at each net that one edge enters and one edge leaves."""
        kept = {BUS, SINK, *self.leaves, *self._others()}
        entering, leaving = Counter(edge.end for edge in self.edges), self._by_net("start")
        merged: set[_Edge] = set()
        for before in self.edges:
            while before not in merged and before.end not in kept and entering[before.end] == len(leaving[before.end]) == 1:
                [behind] = leaving[before.end]
                if behind is before:  # a ring
                    break
                merged.add(behind)
                before.end = behind.end
                before.parts += behind.parts
        self.edges = [edge for edge in self.edges if edge not in merged]
        return bool(merged)

    def _by_net(self, side: Literal["start", "end"]) -> defaultdict[Hashable, list[_Edge]]:
        """The edges that start, or end, at each net."""
        found: defaultdict[Hashable, list[_Edge]] = defaultdict(list)
        for edge in self.edges:
            found[getattr(edge, side)].append(edge)
        return found

    # --- checks and the tree ----------------------------------------------------------------------------------------

    def _check(self) -> None:
        others = self._others()
        reached: set[Hashable] = {BUS}
        waiting: list[Hashable] = [BUS]
        while waiting:
            new = {edge.end for edge in self._from[waiting.pop()]} - reached - {SINK}
            reached |= new
            waiting += new
        for edge in self.edges:
            if edge.start not in reached:
                self.bad(edge.parts[0], "this hangs on no bus bar", "a wire leads here from the left rail, through contacts")
            if edge.end != SINK and len(self._into[edge.end]) > 1:
                self.bad(edge.parts[-1], "wires meet behind this that do not begin at one place",
                          "branches begin and end together; what else leads here has a rung of its own")
            if edge.end == SINK and isinstance(edge.parts[-1], Contact):
                self.bad(edge.parts[-1], "there is no coil and no box behind this contact",
                          "draw ( ) in front of the right rail")
            used = edge.end in self.leaves or self._from[edge.end] or edge.end in others
            if edge.end != SINK and not used:
                self.bad(edge.parts[-1], "the wire behind this leads nowhere", "let it lead to a coil or to a box")
        for net, leaves in self.leaves.items():
            for leaf in leaves:
                if net not in reached:
                    self.bad(leaf.out, "this hangs on no bus bar", "a wire leads here from the left rail, through contacts")

    def _others(self) -> dict[Hashable, Net]:
        return {net.name: net for leaves in self.leaves.values() for leaf in leaves for net in leaf.others}

    def _hang(self, point: Point, net: Hashable, before: Hashable) -> None:
        """Add to a point what follows its net, from above; `before` is the net of the point before."""
        outs: list[tuple[Order, Coil | Box | Point]] = []
        for leaf in self.leaves.get(net, ()):
            if leaf.others:
                assert isinstance(leaf.out, Box)
                branch = net if any(self._begins(other) == net for other in leaf.others) else before
                leaf.out.inputs = tuple(self._input(other, leaf.out, branch) for other in leaf.others)
                if branch == net != BUS:
                    outs.append((leaf.order, Point(Series(), [leaf.out])))
                    continue
            outs.append((leaf.order, leaf.out))
        for edge in self._from[net]:
            if edge.end not in self._inputs:
                behind = Point(Series(edge.parts))
                if edge.end != SINK:
                    self._hang(behind, edge.end, net)
                outs.append((edge.order, behind))
        point.outs = [out for _, out in sorted(outs, key=lambda pair: pair[0])]

    def _begins(self, net: Net) -> Hashable:
        """The net at which the condition of a lower input begins."""
        return next((edge.start for edge in self._into[net.name]), net.name)

    def _input(self, net: Net, box: Box, branch: Hashable) -> Series:
        """The condition of a lower input of a box; it begins at the bus bar, or at the net `branch`."""
        if net.name in (BUS, branch):
            return Series([], net.name != BUS)
        into = self._into[net.name]
        if net.name in self.leaves or self._from[net.name] or into[0].start not in (BUS, branch):
            self.bad(box, "a lower input of this box hangs on a wire that leads elsewhere, too",
                      "each of its inputs has a line of its own from the left rail")
        return Series(into[0].parts, into[0].start != BUS)


class Network(Nets):
    """Makes the diagram of a drawing.  `sources` maps each element of the diagram to what was drawn for it."""

    def __init__(self, grid: Grid) -> None:
        super().__init__()
        self.grid = grid
        self.wires = Wires(grid)
        for problem in grid.problems:
            raise problem
        self.sources: dict[int, Source] = {}
        for element in grid.elements:
            self._element(element)
        for box in grid.boxes:
            self._box(box)

    def _element(self, drawn: DrawnElement) -> None:
        start = self.wires.net(border(drawn.x, drawn.y, LEFT))
        if drawn.is_coil:
            coil = Coil(-1, drawn.mark, drawn.operands)
            self.sources[id(coil)] = drawn
            self.add_output(start, coil)
            return
        contact = Contact(-1, drawn.mark, drawn.operands)
        self.sources[id(contact)] = drawn
        self._edge(start, self.wires.net(border(drawn.until, drawn.y, RIGHT)), contact, drawn)

    def _edge(self, start: Net, end: Net, part: Part, drawn: Source) -> None:
        if start.name == end.name:
            raise DrawingError(drawn.x, drawn.y, drawn.until + 1 - drawn.x, "a wire leads around this, so it has no effect",
                               "take the wire away, or let it begin in front of another contact")
        self.add_edge(start, end.name, part)

    def _box(self, drawn: DrawnBox) -> None:
        rows = range(drawn.y + 1, drawn.bottom)
        entries = [y for y in rows if (LEFT, y) not in drawn.stubs and self.wires.is_used(border(drawn.x, y, LEFT))]
        exits = [y for y in rows if (RIGHT, y) not in drawn.stubs and self.wires.is_used(border(drawn.until, y, RIGHT))]
        if not entries:
            raise DrawingError(drawn.x, drawn.y, 1, "no wire leads to this box",
                               "draw ─ to its left side, in the row of its first line")
        if drawn.title:
            for side, used in ((LEFT, entries), (RIGHT, exits)):
                if len(used) > 1:
                    raise DrawingError(drawn.x if side == LEFT else drawn.until, used[1], 1,
                                       f"a second wire {_WAYS[side]} this block",
                                       "one wire leads through a block; at its other pins stand operands, such as a variable")
        box = _block(drawn, entries[0], exits[0] if exits else -1) if drawn.title else _instruction(drawn)
        self.sources[id(box)] = drawn
        start, *others = (self.wires.net(border(drawn.x, y, LEFT)) for y in entries)
        if drawn.title or box.name in INLINE:
            box.through = True
            end = self.wires.net(border(drawn.until, exits[0], RIGHT)) if exits else Net(SINK, ())
            self._edge(start, end, box, drawn)
        else:
            self.add_output(start, box, others)

    def bad(self, part: Part | Coil, message: str, hint: str) -> NoReturn:
        """Raises the error at an element; for branches, at the first one."""
        while isinstance(part, Parallel):
            part = part.branches[0].parts[0]
        drawn = self.sources[id(part)]
        raise DrawingError(drawn.x, drawn.y, drawn.until + 1 - drawn.x, message, hint)


def _instruction(drawn: DrawnBox) -> Box:
    """A box of an instruction: its mnemonic, then its operands."""
    words = [word for text in drawn.rows.values() for word in text.split(" = ")[0].split()]
    return Box(-1, words[0], tuple(words[1:]))


_WAYS = {LEFT: "enters", RIGHT: "leaves"}


def _block(drawn: DrawnBox, entry: int, leaving: int) -> Box:
    """A box of a function block: pins at its sides; power enters in one row and leaves in one."""
    assert drawn.title
    pins: list[Pin] = []
    wired = {LEFT: "EN", RIGHT: "ENO"}
    for y, text in drawn.rows.items():
        left, right = _names(text, (LEFT, y) in drawn.stubs or y == entry, (RIGHT, y) in drawn.stubs or y == leaving)
        wired[LEFT] = left or "EN" if y == entry else wired[LEFT]
        wired[RIGHT] = right or "ENO" if y == leaving else wired[RIGHT]
        for side, name in ((LEFT, left), (RIGHT, right)):
            if operand := drawn.stubs.get((side, y)):
                if not name:
                    raise DrawingError(drawn.x if side == LEFT else drawn.until, y, 1, f"`{operand}` stands at no pin",
                                       "write the name of the pin inside of the box, at this side")
                pins.append(Pin(name, operand, side == RIGHT))
    return Box(-1, drawn.title[1], (), (), True, drawn.title[0], tuple(pins), (wired[LEFT],), wired[RIGHT])


def _names(text: str, taking: bool, giving: bool) -> tuple[str, str]:
    """The names of the pins at the left and at the right of a row."""
    words = text.split()
    if len(words) == 1:
        return ("", words[0]) if giving and not taking else (words[0], "")
    return (words[0], words[-1]) if words else ("", "")
