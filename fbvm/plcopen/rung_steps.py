"""A network of contacts and coils as mnemonics, where they say exactly what the network does.

They do if each contact has one place among the mnemonics, and what is read and written comes in the same order as in the
network.  Other networks become statements.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fbvm.plcopen.diagram import Object
from fbvm.plcopen.networks import Network
from fbvm.plcopen.scope import Scope
from fbvm.syntax.operands import Operands, Wrong
from fbvm.syntax.tree import Index, Member, NameRef

BRANCHES = 16
"""TR0 to TR15."""
CONTACTS = {(False, ""): "", (True, ""): "NOT", (False, "rising"): "@", (False, "falling"): "%"}
"""Negation and edge of a contact, and how mnemonics say it."""
COILS = {(False, "", ""): "OUT", (True, "", ""): "OUT NOT", (False, "", "set"): "SET", (False, "", "reset"): "RSET",
         (False, "rising", ""): "DIFU", (False, "falling", ""): "DIFD", (False, "rising", "set"): "@SET",
         (False, "rising", "reset"): "@RSET", (False, "falling", "set"): "%SET", (False, "falling", "reset"): "%RSET"}
"""Negation, edge and storage of a coil."""
OPERANDS_AT = 8
LONGEST = 200
"""Objects of the largest network that is written as a rung."""


class Inexact(Exception):
    """Mnemonics do not say it."""


@dataclass(eq=False)
class Parallel:
    """Ways side by side, each a series."""

    ways: list[Series]


Series = list["Object | Parallel"]


@dataclass(eq=False)
class Branch:
    """A place behind a contact or a parallel: the coils there, and where it goes on."""

    coils: list[Object] = field(default_factory=list)
    ways: list[tuple[Object | Parallel, Branch]] = field(default_factory=list)


def rung_steps(network: Network, scope: Scope) -> list[str] | None:
    """The lines of a rung; None if mnemonics do not say it."""
    try:
        return _Rung(network, scope).lines()
    except Inexact:
        return None


class _Rung:
    def __init__(self, network: Network, scope: Scope) -> None:
        self.network, self.scope = network, scope
        self.place = {item: at for at, item in enumerate(network.objects)}
        self.known: dict[tuple[Object, ...], Series] = {}
        self.order: list[Object] = []
        self.steps: list[str] = []

    def lines(self) -> list[str]:
        contacts = [item for item in self.network.objects if item.kind == "contact"]
        coils = [item for item in self.network.objects if item.kind == "coil"]
        count = len(self.network.objects)
        if not coils or not contacts or count > LONGEST or len(contacts) + len(coils) < count or self.network.cut:
            raise Inexact
        root = Branch()
        for coil in coils:
            self._hang(root, self._series(tuple(wire.source for wire in coil.inputs[0].wires)), coil)
        if root.coils or len(root.ways) != 1:
            raise Inexact
        self._branch(root, 0)
        self._compare()
        return self.steps

    def _compare(self) -> None:
        """Each object has one place among the steps, and what is written is read before or behind as in the network."""
        if len(set(self.order)) < len(self.order) or len(self.order) < len(self.network.objects):
            raise Inexact
        for at, item in enumerate(self.order):
            for behind in self.order[at + 1:]:
                if "coil" in (item.kind, behind.kind) and self.place[behind] < self.place[item] \
                        and self.scope.roots(item.text) & self.scope.roots(behind.text):
                    raise Inexact

    # --- shape ---

    def _series(self, sources: tuple[Object, ...]) -> Series:
        """What lies between the rail and a place, as contacts and parallels one behind the other."""
        if not sources:
            raise Inexact
        if sources not in self.known:
            ways: list[Series] = []
            for source in sources:
                if source.kind == "leftPowerRail":
                    ways.append([])
                elif source.kind == "contact":
                    ways.append([*self._series(tuple(wire.source for wire in source.inputs[0].wires)), source])
                else:
                    raise Inexact
            self.known[sources] = self._merged(ways)
        return self.known[sources]

    def _merged(self, ways: list[Series]) -> Series:
        """Several ways as one: what they begin with together, and a parallel of the rest."""
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
            merged.append([group[0][0], *self._merged(rest)] if len(group) > 1 else group[0])
        return merged[0] if len(merged) == 1 else [Parallel(merged)]

    def _hang(self, branch: Branch, series: Series, coil: Object) -> None:
        for part in series:
            known = next((inner for what, inner in branch.ways if what is part), None)
            if known is None:
                known = Branch()
                branch.ways.append((part, known))
            branch = known
        branch.coils.append(coil)

    # --- steps ---

    def _branch(self, branch: Branch, depth: int) -> None:
        """What hangs on a place, in the order of the network; a TR keeps the power for what comes later."""
        parts: list[Object | tuple[Object | Parallel, Branch]] = [*branch.coils, *branch.ways]
        parts.sort(key=lambda part: self.place[part if isinstance(part, Object) else self._first(part[0])])
        ways = [at for at, part in enumerate(parts) if not isinstance(part, Object)]
        keeps = bool(ways) and ways[0] < len(parts) - 1
        if keeps and depth >= BRANCHES:
            raise Inexact
        if keeps:
            self._step("OUT", f"TR{depth}")
        moved = False
        for part in parts:
            if moved:
                self._step("LD", f"TR{depth}")
            if isinstance(part, Object):
                self._coil(part)
                moved = False
            else:
                self._part(part[0], bool(self.order))
                self._branch(part[1], depth + keeps)
                moved = True

    def _first(self, part: Object | Parallel) -> Object:
        while isinstance(part, Parallel):
            part = part.ways[0][0]
        return part

    def _part(self, part: Object | Parallel, follows: bool) -> None:
        """A contact or a parallel, behind what is there already, or at the rail."""
        if isinstance(part, Object):
            self._contact("AND" if follows else "LD", part)
            return
        for number, way in enumerate(part.ways):
            if number and len(way) == 1 and isinstance(way[0], Object):
                self._contact("OR", way[0])
                continue
            for at, inner in enumerate(way):
                self._part(inner, at > 0)
            if number:
                self.steps.append("OR LD")
        if follows:
            self.steps.append("AND LD")

    def _contact(self, how: str, item: Object) -> None:
        form = CONTACTS.get((item.negated, item.edge))
        if form is None or item.storage:
            raise Inexact
        self._step(f"{form}{how}" if form in ("@", "%") else f"{how} {form}".rstrip(), self._operand(item))
        self.order.append(item)

    def _coil(self, item: Object) -> None:
        mnemonic = COILS.get((item.negated, item.edge, item.storage))
        if mnemonic is None:
            raise Inexact
        self._step(mnemonic, self._operand(item))
        self.order.append(item)

    def _operand(self, item: Object) -> str:
        """A variable, if rungs read it as one: T1 and D5 are addresses there."""
        text = item.text
        if text.upper().startswith("TR") and text[2:].isdigit():
            raise Inexact
        try:
            meant = Operands().expression(text, "b", 0, 0)
        except Wrong:
            raise Inexact from None
        if not isinstance(meant, (NameRef, Member, Index)):
            raise Inexact
        return text

    def _step(self, mnemonic: str, operand: str) -> None:
        self.steps.append(f"{mnemonic:{OPERANDS_AT - 1}} {operand}")
