"""What the lowering of all bodies of a program shares: sites, pictures, objects, and where everything lies."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from fbvm.base.areas import Area
from fbvm.check.symbols.facts import Pou, Start, Variable
from fbvm.code.image import Objects, RungPicture, SfcPicture, Site
from fbvm.code.lowering.layout import Placed
from fbvm.code.operations import FIRST_OBJECT
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.code.lowering.initial_references import InitialReferences

Origin = tuple[str, int]
"""The first two parts of an address: what the offset counts from, and the offset."""


class Program:
    """What the lowering of all bodies shares."""

    def __init__(self, placed: Placed, drawn: bool = False) -> None:
        self.drawn = drawn
        self.areas: dict[str, Area] = placed.layout.areas
        self.sites: list[Site] = []
        self.rungs: list[RungPicture] = []
        self.charts: list[SfcPicture] = []
        self.held: InitialReferences
        self.late_starts: dict[Pou, list[tuple[int, Start]]] = {}
        """References in frames that bodies make when they start, by POU, and where in the buffer they lie."""
        self.leases_at, self.held_bits = placed.objects.leases_at, placed.objects.held_bits
        self._objects = placed.objects
        self._area_objects: dict[str, tuple[int, int]] = {}
        self._numbers: dict[tuple[str, str, int], int] = {}

    def site(self, pou: Pou, node: tree.Node) -> int:
        """The number of a place in the source."""
        key = pou.source.name, pou.name, node.start
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = len(self.sites)
            line, column = pou.source.place(node.start)
            self.sites.append(Site(pou.source.name, pou.name, line, column))
        return number

    def known_site(self, pou: Pou, start: int, site: Site) -> int:
        """The number of a place that was looked up before."""
        number = self._numbers.setdefault((pou.source.name, pou.name, start), len(self.sites))
        if number == len(self.sites):
            self.sites.append(site)
        return number

    def area_object(self, area: str) -> int:
        """The number of the object that a whole area is."""
        row = self.areas[area]
        self._area_objects.setdefault(area, (row.offset, row.offset + row.size_bytes))
        return FIRST_OBJECT + len(self._objects.extents) + list(self._area_objects).index(area)

    @property
    def objects(self) -> Objects:
        """What pointers may be moved in, areas that were asked for included."""
        return replace(self._objects, extents=(*self._objects.extents, *self._area_objects.values()))

    # --- where things lie ---------------------------------------------------------------------------------------------

    def number(self, pou: Pou) -> int:
        """The number of a body."""
        return pou.number

    def frame(self, pou: Pou) -> Origin:
        """Where the frame of a POU begins."""
        return "abs", pou.frame_offset

    def area(self, name: str) -> Origin:
        """Where an area begins."""
        return "abs", self.areas[name].offset

    def origin(self, variable: Variable) -> Origin:
        """Where a variable lies that is in no instance."""
        assert variable.place != "self"
        offset = variable.offset
        if variable.place == "frame":
            assert variable.owner is not None
            offset += variable.owner.frame_offset
        return "abs", offset
