"""Places: an address with the type of what lies there, and the operations that load, store and refer to it."""

from __future__ import annotations

from dataclasses import dataclass, field

from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import StringType, SubrangeType, Type, base, machine
from fbvm.code.operations import SIZES, Address, Node

Detail = tuple[object, Address, int]
"""What the observation of a read or write carries: machine type, address, and the bit or WHOLE_BYTES."""

_BITS = {"f32": "u32", "f64": "u64"}
"""By machine type of a float: the one of its bits."""


@dataclass(slots=True)
class Place:
    """An address with the type of what lies there; `bit` is set for a located BOOL or a bit of a word.  It never changes."""

    address: Address
    type: Type
    bit: int | None = None
    _load: Node | None = field(default=None, compare=False)
    """The result of `load`, once it was asked for."""
    _detail: Detail | None = field(default=None, compare=False)
    """The result of `detail`, once it was asked for."""

    def moved(self, offset: int, kind: Type, bit: int | None = None) -> Place:
        """A part of this place: the `kind` that lies `offset` bytes further on."""
        start, at, terms = self.address
        return Place((start, at + offset, terms), kind, bit)

    def target(self, site: int) -> Place:
        """What the reference that lies here points at, if this place has the type of that (an in-out's slot has)."""
        return Place((("ref", ("load", "ref", self.address), site), 0, ()), self.type)

    @property
    def is_reference(self) -> bool:
        """True if the address begins where a reference points."""
        return isinstance(self.address[0], tuple)

    def is_aligned(self, size: int) -> bool:
        """True if a value of `size` bytes lies on a multiple of its size, whatever its subscripts are."""
        start, offset, terms = self.address
        return size == 1 or not isinstance(start, tuple) and offset % size == 0 and \
            all(stride % size == 0 for stride, _ in terms)

    def load(self) -> Node:
        """The expression that loads the value (not of arrays and structures, which are copied)."""
        if self._load is None:
            self._load = self._loading()
        return self._load

    def _loading(self) -> Node:
        kind = base(self.type)
        if isinstance(kind, StringType):
            return ("load_text", machine(kind), self.address, kind.capacity)
        form = machine(kind)
        if self.bit is not None:
            return ("load_bit", "b", self.address, self.bit)
        if form == "b" and self.is_reference:
            return ("load_flag", "b", self.address)
        return ("load" if self.is_aligned(SIZES[form]) else "load_raw", form, self.address)

    def store(self, value: Node, site: int) -> Node:
        """The statement that stores a value of the machine type of this place; one of a subrange is checked at `site`."""
        kind = self.type
        if isinstance(kind, SubrangeType) and kind.checked and not (value[0] == "const" and kind.low <= value[2] <= kind.high):
            value = ("check", machine(kind), value, kind.low, kind.high, "R0103", site)
        kind = base(kind)
        if isinstance(kind, StringType):
            return ("store_text", self.address, kind.capacity, value)
        form = machine(kind)
        if self.bit is not None:
            return ("store_bit", self.address, self.bit, value)
        if form == "b" and self.is_reference:
            return ("store_flag", self.address, value)
        if form in _BITS and value[0] in ("load", "load_raw"):  # a REAL is copied as a structure is: no look at NaN
            form = _BITS[form]
            value = (value[0], form, value[2])
        return ("store" if self.is_aligned(SIZES[form]) else "store_raw", form, self.address, value)

    def reference(self) -> Node:
        """The expression that makes a reference to this place."""
        start, offset, terms = self.address
        if isinstance(start, tuple) and not offset and not terms and self.bit is None:
            pointer: Node = start[1]
            return pointer
        return ("reference", "ref", self.address, WHOLE_BYTES if self.bit is None else self.bit)

    def detail(self) -> Detail:
        """What an observation of a read or write of this place carries."""
        if self._detail is None:
            kind = base(self.type)
            form: object = machine(kind)
            if isinstance(kind, StringType):
                form = (machine(kind), kind.capacity)
            elif form == "":
                form = ("", kind.size)
            self._detail = form, self.address, WHOLE_BYTES if self.bit is None else self.bit
        return self._detail


def is_aggregate(kind: Type) -> bool:
    """True for arrays and structures, which are copied as bytes."""
    return machine(kind) == ""
