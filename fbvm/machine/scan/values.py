"""What a PLC reads, writes and forces by name."""

from __future__ import annotations

import re
from collections.abc import Callable

from fbvm.base.digits import whole_number
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.net.journal import Journal
from fbvm.watch import places
from fbvm.watch.paths import Place, Span, UnknownPlace, find, find_place
from fbvm.watch.values import Value

_FLAG = re.compile(r"([TC])(\d{4})")
"""How places name completion flags; read again, the name is that of the present value, which takes no BOOL."""


class NamedValues:
    """The variables and addresses of a program in a memory; `journal` is told what is written."""

    def __init__(self, image: Image, memory: Memory, journal: Journal | None) -> None:
        self.image, self.memory = image, memory
        self._journal = journal
        self._forces: dict[Place, Value] = {}
        self._found: dict[str, Place | Span] = {}

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        found = self._found.get(text)
        if found is None:
            found = self._found[text] = find(self.image.symbols, self.memory.areas, text)
        return found

    def read(self, where: str | Place | Span) -> Value:
        """The value of a variable, address or range.  Raises UnknownPlace."""
        return places.read_found(self.memory, self.find(where) if isinstance(where, str) else where)

    def reader(self, place: Place) -> Callable[[], Value]:
        """What reads a place again and again, several times as fast as `read`."""
        return places.reader(self.memory, place)

    def write(self, where: str | Place | Span, value: object) -> None:
        """Writes a variable, an address, or a range (a list).  Raises UnknownPlace, ValueError (range), TypeError."""
        found = self._meant(where, value) if isinstance(where, str) else where
        if self._journal:
            self._journal.remark(f"{found.name} := {value!r}")
        places.write_found(self.memory, found, value)

    def force(self, where: str, value: object) -> None:
        """Holds a variable or an address at `value` before and after the program, until `unforce`."""
        place = self._meant(where, value)
        if isinstance(place, Span):
            raise UnknownPlace(f"{where} is a range; name one place")
        places.write(self.memory, place, value)
        self._forces[place] = places.read(self.memory, place)

    def unforce(self, where: str | None = None) -> None:
        """Ends a force, or all forces; the value stays until somebody writes it."""
        if where is None:
            self._forces.clear()
        else:
            named = next((place for place in self._forces if place.name == where), None)
            self._forces.pop(named or find_place(self.image.symbols, self.memory.areas, where), None)

    def _meant(self, where: str, value: object) -> Place | Span:
        """The place that gets a value: of T0005 and a BOOL the completion flag."""
        flag = _FLAG.fullmatch(where) if isinstance(value, bool) else None
        return self.find(f"{'TF' if flag[1] == 'T' else 'CNF'}{whole_number(flag[2])}" if flag else where)

    @property
    def is_forced(self) -> bool:
        """True if something is forced."""
        return bool(self._forces)

    @property
    def forces(self) -> dict[str, Value]:
        """What is forced, by name."""
        return {place.name: value for place, value in self._forces.items()}
