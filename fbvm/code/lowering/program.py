"""The program: what the lowering of all its bodies shares, such as sites, pictures, objects, and where everything lies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from fbvm.base.areas import Area
from fbvm.base.types import Type
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Pou, Start, Variable
from fbvm.code.image import Body, Objects, RungPicture, SfcPicture, Site
from fbvm.code.layout.layout import Placement
from fbvm.code.layout.reference_marks import Marked, references_in
from fbvm.code.operations import FIRST_OBJECT, LEASED, Node
from fbvm.syntax import tree

Origin = tuple[str, int]
"""The first two parts of an address: what the offset counts from, and the offset in bytes."""


class Program:
    """What the lowering of one body needs to know of the others, and what it leaves for the Image.

    `drawn` says whether statements of Structured Text get pictures as rungs."""

    def __init__(self, checker: Checker, placement: Placement, drawn: bool = False) -> None:
        self.checker = checker
        self.drawn = drawn
        self.areas: dict[str, Area] = placement.layout.areas
        self.sites: list[Site] = []
        self.rungs: list[RungPicture] = []
        self.charts: list[SfcPicture] = []
        self.entry_references: dict[Pou, list[tuple[int, Start]]] = {}
        """By POU the references that its body makes when it starts, and where in the buffer each lies."""
        self.leases_at, self.held_bits = placement.objects.leases_at, placement.objects.held_bits
        self.stack = placement.stack
        self.parts: list[Body] = []
        """Bodies of parts of POUs, which are numbered behind those of all POUs."""
        self._objects = placement.objects
        self.has_heap = placement.objects.heap_rows > 0
        self._shared: dict[object, int] = {}
        self._area_objects: dict[str, tuple[int, int]] = {}
        self._numbers: dict[tuple[str, str, int], int] = {}

    # --- what bodies leave --------------------------------------------------------------------------------------------

    def site(self, pou: Pou, node: tree.Node) -> int:
        """The number of the place in the source at which a node of a POU begins."""
        key = pou.source.name, pou.name, node.start
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = len(self.sites)
            line, column = pou.source.place(node.start)
            self.sites.append(Site(pou.source.name, pou.name, line, column))
        return number

    def known_site(self, pou: Pou, start: int, site: Site) -> int:
        """The number of a place in the source whose line and column are known already."""
        number = self._numbers.setdefault((pou.source.name, pou.name, start), len(self.sites))
        if number == len(self.sites):
            self.sites.append(site)
        return number

    def area_object(self, area: str) -> int:
        """The number of the object that a whole area is, for pointers that may be moved all over it."""
        row = self.areas[area]
        self._area_objects.setdefault(area, (row.offset, row.offset + row.size_bytes))
        return FIRST_OBJECT + len(self._objects.extents) + list(self._area_objects).index(area)

    @property
    def objects(self) -> Objects:
        """All objects, those of `area_object` included."""
        return replace(self._objects, extents=(*self._objects.extents, *self._area_objects.values()))

    def object_of(self, first: Node, number: int) -> Node:
        """The object of a variable in an instance, as u64.

        first: what the head of the instance says: the number of its first object, or the object that __NEW has made.
        number: that of the variable among the objects of an instance."""
        following: Node = ("add", "u64", first, ("const", "u64", number))
        if not self.has_heap or not number:
            return following if number or not self.has_heap else first
        return ("select", "u64", ("ge", "b", "u64", first, ("const", "u64", LEASED)), following, first)

    def shared_part(self, key: object, make: Callable[[], Body]) -> int:
        """The number of a body that several POUs call: `make` makes it at the first call with a key."""
        if key not in self._shared:
            self._shared[key] = self.add_part(make())
        return self._shared[key]

    def add_part(self, body: Body) -> int:
        """Adds the body of a part of a POU, whose name gets a number behind it.  Returns the number of the body."""
        self.parts.append(replace(body, name=f"{body.name} {1 + len(self.parts)}"))
        return len(self.checker.bodies) + len(self.parts) - 1

    # --- where things lie ---------------------------------------------------------------------------------------------

    def number(self, pou: Pou) -> int:
        """The number of the body of a POU."""
        return pou.number

    def executed(self, pou: Pou) -> Pou:
        """The POU whose body is executed for another one."""
        return self.checker.executed(pou)

    def candidates(self, pou: Pou) -> dict[Pou, list[int]]:
        """The bodies that a call of a method or block may mean, by the numbers of the types for which each is meant."""
        return self.checker.candidates(pou)

    def frame(self, pou: Pou) -> Origin:
        """Where the fixed frame of a POU begins."""
        return "abs", pou.frame_offset

    def area(self, name: str) -> Origin:
        """Where an area begins."""
        return "abs", self.areas[name].offset

    def origin(self, variable: Variable) -> Origin:
        """Where a variable lies that is in no instance and in no frame on the stack."""
        assert variable.place != "self"
        offset = variable.offset
        if variable.place == "frame":
            assert variable.owner is not None
            offset += variable.owner.frame_offset
        return "abs", offset

    def references_in(self, kind: Type, content: bytes) -> Iterator[tuple[int, Start]]:
        """The references in the bytes of a value that a body makes, each with its offset; all are to global variables."""
        for at, start, _ in references_in(self.checker, kind, content):
            yield at, start

    def instances_in(self, kind: Type, content: bytes) -> Iterator[Marked]:
        """As `references_in`, with the instances in the value that each reference lies in, by their offsets."""
        return references_in(self.checker, kind, content)
