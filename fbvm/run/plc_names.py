"""Names of several PLCs side by side: `pump.Main.Done` is `Main.Done` of the PLC `pump`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.values import Value

Find = Callable[[str], Place | Span]
Reader = Callable[[Place], Callable[[], Value]]


@dataclass
class PlcNames:
    """Finds and reads places of PLCs, each given by how its own names are found, and how a place gets its reader.

    The name of an only PLC may be left out if `alone` says so."""

    plcs: Mapping[str, tuple[Find, Reader]]
    alone: bool = False
    _owners: dict[Place, tuple[str, Place]] = field(default_factory=dict)
    """By place with its full name: the PLC, and the place as that PLC has it."""
    _readers: dict[str, Callable[[], Value]] = field(default_factory=dict)

    def find(self, text: str) -> Place:
        """The single place of a name.  Raises UnknownPlace."""
        owner, path = self.parted(text)
        place = self.plcs[owner][0](path)
        if not isinstance(place, Place):
            raise UnknownPlace(f"{text} is a range; name one place")
        made = replace(place, name=text)
        self._owners[made] = owner, place
        self._readers[text] = self.plcs[owner][1](place)
        return made

    def parted(self, text: str) -> tuple[str, str]:
        """The PLC that a name begins with, and the rest.  Raises UnknownPlace."""
        name, _, path = text.partition(".")
        if name in self.plcs:
            return name, path
        if self.alone and len(self.plcs) == 1:
            return next(iter(self.plcs)), text
        raise UnknownPlace(f"{text} begins with the name of no PLC; there is {', '.join(self.plcs)}")

    def owner(self, place: Place) -> tuple[str, Place]:
        """The PLC of a place that `find` has returned, and the place as that PLC has it."""
        return self._owners[place]

    def read(self, place: Place) -> Value:
        """The present value of a place that `find` has returned."""
        return self._readers[place.name]()
