"""Networks as mnemonics, if these do exactly what the network does.

They do if each contact and block is one step, and reads and writes keep the order of the network.  Other networks become
statements.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fbvm.interchange.plcopen.read.diagram import Object, Wire
from fbvm.interchange.plcopen.read.networks import Network
from fbvm.interchange.plcopen.read.rung_parts import Inexact, Parts
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.syntax.ladder.text import instruction_text

BRANCHES = 16
"""TR0 to TR15, each for one branch point of a rung."""
LONGEST = 200
"""Most objects of a network that is written as a rung."""


@dataclass(eq=False)
class Parallel:
    """Branches in parallel, each a series."""

    ways: list[Series]


Series = list["Object | Parallel"]


@dataclass(eq=False)
class Branch:
    """A branch point behind an element or a parallel: the outputs there, and the branches that go on from it."""

    outputs: list[Object] = field(default_factory=list)
    ways: list[tuple[Object | Parallel, Branch]] = field(default_factory=list)


def rung_steps(network: Network, scope: Scope, ours: bool = False) -> list[str] | None:
    """The lines of a rung; None if mnemonics cannot do what the network does.  `ours` says that fbvm has drawn the diagram: a
    wire from the rail then stands for P_On."""
    try:
        return _Rung(network, scope, ours).lines()
    except Inexact:
        return None


class _Rung:
    def __init__(self, network: Network, scope: Scope, ours: bool) -> None:
        self.network, self.ours = network, ours
        self.parts = Parts(network, scope)
        self.place = {item: at for at, item in enumerate(network.objects)}
        self.known: dict[tuple[Wire, ...], Series] = {}
        self.order: list[Object] = []
        self.steps: list[str] = []
        self.points = 0
        """Number of branch points so far: each has a TR bit of its own."""

    def lines(self) -> list[str]:
        if len(self.network.objects) > LONGEST or self.network.cut or self.network.rereads or not self.parts.outputs:
            raise Inexact
        first = self.parts.outputs[0]
        powers = self.parts.powers(first)
        if len(powers) != 1:
            self._alone(first, powers)
        else:
            self._tree()
        self.parts.compare(self.order, self.place)
        return self.steps

    def _alone(self, output: Object, powers: list[tuple[Wire, ...]]) -> None:
        """Write a rung for an instruction that takes no condition or several: it must be the only output."""
        if len(self.parts.outputs) > 1:
            raise Inexact
        for wires in powers:
            series = self._series(wires)
            if not series:
                self._always()
            for at, part in enumerate(series):
                self._part(part, at > 0)
        self._output(output)

    def _tree(self) -> None:
        root = Branch()
        for output in self.parts.outputs:
            powers = self.parts.powers(output)
            if len(powers) != 1:
                raise Inexact
            self._hang(root, self._series(powers[0]), output)
        begun = bool(root.outputs) or len(root.ways) != 1
        if begun:
            self._always()
        self._branch(root, begun)

    def _always(self) -> None:
        if not self.ours:
            raise Inexact
        self.steps.append(instruction_text("LD", "P_On"))

    # --- shape ---

    def _series(self, wires: tuple[Wire, ...]) -> Series:
        """The elements and parallels between the rail and a place that these wires lead to."""
        if not wires:
            raise Inexact
        if wires not in self.known:
            ways: list[Series] = []
            for wire in wires:
                if wire.source.kind == "leftPowerRail":
                    ways.append([])
                else:
                    element, before = self.parts.element(wire)
                    ways.append([*(self._series(before) if before else []), element])
            self.known[wires] = self._merged(ways)
        return self.known[wires]

    def _merged(self, ways: list[Series]) -> Series:
        """Several series as one: the elements with which they begin alike, and a parallel of the rest."""
        if len(ways) == 1:
            return ways[0]
        if not all(ways):
            raise Inexact
        groups: dict[int, list[Series]] = {}
        for way in ways:
            groups.setdefault(id(way[0]), []).append(way)
        merged: list[Series] = []
        for group in groups.values():
            rest = [way[1:] for way in group]
            merged.append([group[0][0], *self._merged(rest)])
        return merged[0] if len(merged) == 1 else [Parallel(merged)]

    def _hang(self, branch: Branch, series: Series, output: Object) -> None:
        for part in series:
            known = next((inner for what, inner in branch.ways if what is part), None)
            if known is None:
                known = Branch()
                branch.ways.append((part, known))
            branch = known
        branch.outputs.append(output)

    # --- steps ---

    def _branch(self, branch: Branch, follows: bool) -> None:
        """Write the outputs and branches of a branch point in the order of the network; a TR bit keeps the power."""
        parts: list[Object | tuple[Object | Parallel, Branch]] = [*branch.outputs, *branch.ways]
        parts.sort(key=lambda part: self.place[part if isinstance(part, Object) else self._first(part[0])])
        ways = [at for at, part in enumerate(parts) if not isinstance(part, Object)]
        keeps = bool(ways) and ways[0] < len(parts) - 1
        point = f"TR{self.points}"
        if keeps:
            self.points += 1
            if self.points > BRANCHES:
                raise Inexact
            self.steps.append(instruction_text("OUT", point))
        moved = False
        for part in parts:
            if moved:
                self.steps.append(instruction_text("LD", point))
            if isinstance(part, Object):
                self._output(part)
                moved = False
            else:
                self._part(part[0], follows)
                self._branch(part[1], True)
                moved = True

    def _first(self, part: Object | Parallel) -> Object:
        while isinstance(part, Parallel):
            part = part.ways[0][0]
        return part

    def _part(self, part: Object | Parallel, follows: bool) -> None:
        """Write an element or a parallel: at the rail, or with `follows` in series with what is written."""
        if isinstance(part, Object):
            self._element("AND" if follows else "LD", part)
            return
        for number, way in enumerate(part.ways):
            if number and len(way) == 1 and isinstance(way[0], Object) and not self.parts.goes_through(way[0]):
                self._element("OR", way[0])
                continue
            for at, inner in enumerate(way):
                self._part(inner, at > 0)
            if number:
                self.steps.append("OR LD")
        if follows:
            self.steps.append("AND LD")

    def _element(self, how: str, item: Object) -> None:
        if self.parts.goes_through(item):
            if how == "LD":
                self._always()
            self.steps.append(self.parts.through(item))
        else:
            self.steps.append(self.parts.contact(how, item))
        self.order.append(item)

    def _output(self, item: Object) -> None:
        self.steps.append(self.parts.output(item))
        self.order.append(item)
