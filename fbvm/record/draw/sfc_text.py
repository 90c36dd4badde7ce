"""Sequential function charts as drawings of characters: steps with their actions, transitions with their conditions, single
and double lines where branches diverge and converge, arrows for jumps; of a recorded scan also tokens and thick lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import groupby

from fbvm.code.image import SfcPicture
from fbvm.record.draw import sfc_pieces as pieces
from fbvm.record.draw.sfc_graph import Graph, Node
from fbvm.record.draw.sfc_pieces import Piece
from fbvm.syntax.ladder.drawing.box_lines import Surface

LEAST = 24
"""The least width of a drawing in columns."""
WRAPPED = (60, 36, 24, 16)
"""Widths of the lines of a condition that are tried, in columns, until the chart is narrow enough."""
MUCH = 4
"""While a drawing has so many times the columns that there are, several branches are drawn apart before the next is made."""
TOKEN = "●"
NAMED = 0
"""In place of a width: conditions are written below the chart, and transitions have names."""


@dataclass(frozen=True)
class ChartState:
    """The state of a chart in one scan: the numbers of the steps that were active at its end, and the values of evaluated
    conditions by the number of their transition."""

    active: frozenset[int] = frozenset()
    tested: Mapping[int, bool] = field(default_factory=dict)


def sfc_text(picture: SfcPicture, width: int = 80, seen: ChartState | None = None) -> list[str]:
    """The drawing of a chart as lines of text, at most `width` columns wide; without `seen` no step is active."""
    return sfc_surface(picture, width, seen).rows()


def sfc_surface(picture: SfcPicture, width: int = 80, seen: ChartState | None = None) -> Surface:
    """The drawing of a chart.  If it is too wide, conditions are wrapped, then written below it, and then branches are drawn
    apart."""
    width = max(width, LEAST)
    apart: frozenset[int] = frozenset()
    for wrapped in (*WRAPPED, NAMED):
        drawing = _Drawing(picture, seen, wrapped, apart)
        if drawing.width <= width:
            return drawing.surface()
    while drawing.width > width:
        steps = drawing.branches_of_the_widest(width, (drawing.width - MUCH * width) // 2)
        if not steps:
            break
        apart |= steps
        drawing = _Drawing(picture, seen, NAMED, apart)
    return drawing.surface()


class _Drawing:
    """The drawing for one width of conditions and one set of steps that are drawn apart."""

    def __init__(self, picture: SfcPicture, seen: ChartState | None, wrapped: int, apart: frozenset[int]) -> None:
        self.picture, self.seen, self.wrapped = picture, seen, wrapped
        self.graph = Graph(picture, apart)
        self._pieces: dict[Node, Piece] = {}
        for node in reversed(self.graph.order):
            self._pieces[node] = self._piece(node)
        self.width = max(self._pieces[root].width for root in self.graph.roots)

    def surface(self) -> Surface:
        """The networks and the branches that are drawn apart, one below the other, and conditions without room beside them."""
        surface, row = Surface(), 0
        for root in self.graph.roots:
            piece = self._pieces[root]
            piece.draw(surface, 0, row)
            row += piece.height + 1
        if self.wrapped == NAMED:
            for number in range(len(self.picture.transitions)):
                surface.write(0, row, f"{self._name(number)}: {self.picture.transitions[number][5]}{self._result(number)}")
                row += 1
        return surface

    def branches_of_the_widest(self, width: int, columns: int) -> frozenset[int]:
        """The last steps of the widest network that begin a branch and can be drawn apart: so many as take `columns` less room,
        at least one.  Where many branches have to go, a drawing for each would take a time that grows with their square; for
        the same reason a branch that will be wider than `width` by itself loses its own branches at once."""
        graph, found, gone = self.graph, set[int](), set[Node | None]()
        for node in self._inside(max(graph.roots, key=lambda root: self._pieces[root].width)):
            if graph.above[node] in gone:
                gone.add(node)
                continue
            branches = [follower for follower in graph.following[node] if not graph.is_jump(node, follower)]
            left = len(branches) if node.is_step else len(branches) - 1
            for branch in reversed(branches) if len(branches) > 1 else ():
                steps = [step for step in ([branch] if branch.is_step else graph.following[branch])
                         if step.number not in graph.apart and step not in graph.roots]  # fmt: skip
                if not steps or not left:
                    continue
                found.add(steps[0].number)
                left, wide = left - 1, self._pieces[branch].width
                if wide <= width:
                    gone.add(branch)
                    columns -= wide
                else:
                    columns -= max(1, self._pieces[node].width - wide)
                if columns <= 0 or len(steps) > 1:
                    return frozenset(found)
            if found and columns <= 0:
                break
        return frozenset(found)

    def _inside(self, root: Node) -> Iterator[Node]:
        """The nodes of a network, those that are nearer to its root first."""
        below: dict[Node | None, list[Node]] = {}
        for node in self.graph.order:
            below.setdefault(self.graph.above[node], []).append(node)
        left = deque([root])
        while left:
            node = left.popleft()
            yield node
            left += below.get(node, ())

    # --- pieces -----------------------------------------------------------------------------------------------------

    def _piece(self, node: Node) -> Piece:
        """A node with all nodes below it."""
        graph = self.graph
        children: list[Piece] = []
        for jumps, followers in groupby(graph.following[node], lambda follower: graph.is_jump(node, follower)):
            group = list(followers)
            if jumps and not node.is_step:
                children.append(pieces.jump([self._label(one) for one in group], self._fired(node, group[0])))
                continue
            for follower in group:
                thick = self._fired(node, follower)
                if jumps:
                    children.append(pieces.jump([self._label(follower)], thick))
                elif len(graph.before[follower]) == 1:
                    child = self._pieces[follower]
                    child.thick = thick
                    children.append(child)
                else:
                    children.append(pieces.passing(follower, thick))
        made = pieces.stack(self._own(node), children, double=not node.is_step)
        for merged in graph.below[node]:
            if any(end.to == merged for end in made.ends):
                made = pieces.join(made, merged, self._pieces[merged], not merged.is_step, self._label(merged))
        return made

    def _own(self, node: Node) -> Piece:
        if not node.is_step:
            label = f"{self._priority(node.number)}{self._name(node.number)}" if self.wrapped == NAMED else \
                self._full_label(node.number)
            piece = pieces.transition(label, self.wrapped or WRAPPED[0], self._tested(node.number) is True)
            return piece if node not in self.graph.met else pieces.arrow_target(piece, self._name(node.number))
        name, initial, _, rows = self.picture.steps[node.number]
        active = self.seen is not None and node.number in self.seen.active
        label = name if self.seen is None else f"{TOKEN if active else ' '} {name}"
        return pieces.step(label, initial, active, rows)

    def _label(self, node: Node) -> str:
        return self.picture.steps[node.number][0] if node.is_step else self._name(node.number)

    # --- transitions ------------------------------------------------------------------------------------------------

    def _tested(self, number: int) -> bool | None:
        return self.seen.tested.get(number) if self.seen is not None else None

    def _fired(self, node: Node, follower: Node) -> bool:
        """True if the transition of a link has fired."""
        return self._tested(follower.number if node.is_step else node.number) is True

    def _name(self, number: int) -> str:
        return self.picture.transitions[number][1] or f"t{number + 1}"

    def _priority(self, number: int) -> str:
        priority = self.picture.transitions[number][2]
        return f"({priority}) " if priority else ""

    def _full_label(self, number: int) -> str:
        _, name, _, _, _, condition = self.picture.transitions[number]
        named = f"{name}: " if name and condition != name else ""
        return f"{self._priority(number)}{named}{condition}{self._result(number)}"

    def _result(self, number: int) -> str:
        tested = self._tested(number)
        return "" if tested is None else " → TRUE" if tested else " → FALSE"
