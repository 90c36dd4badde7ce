"""The Image: everything that is needed to run, trace and draw a program, and nothing of its tree.

All code is plain data (see `operations`).  Names of sources stand in `sites`' table of files only.
"""

from __future__ import annotations

import hashlib
import marshal
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from fbvm.base.areas import AREAS, PAGE_BYTES, SLOTS_OFFSET, Area, Mailbox, e_bank
from fbvm.base.types import Field, Type
from fbvm.code.operations import Block

SAME_FOR_EQUAL = 2
"""The version of the host's form for data in which equal data are equal bytes, whatever shares their objects."""


@dataclass(frozen=True)
class Site:
    """A place in the source: file name, POU, line, column."""

    file: str
    pou: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" + (f" in {self.pou}" if self.pou else "")


@dataclass(frozen=True)
class Body:
    """The code of one POU.

    `instance_size` is the size of an instance in bytes, 0 for a function, whose frame lies at a fixed place."""

    name: str
    kind: str
    code: Block
    instance_size: int
    statements: int
    """Statements of the body outside loops: what an execution charges at its start."""


@dataclass(frozen=True)
class ProgramRun:
    """One program instance: its path name, the number of its body, the place of its instance."""

    name: str
    body: int
    offset: int


@dataclass(frozen=True)
class TaskRow:
    """A task: `interval_ns` 0 means in every cycle; `single` is the path of the BOOL that starts it, or "".

    Smaller `priority` goes first; programs run in the order of writing."""

    name: str
    priority: int
    interval_ns: int
    single: str
    programs: tuple[ProgramRun, ...]


@dataclass(frozen=True)
class Layout:
    """Where things lie in the flat buffer of a PLC."""

    slots_size: int
    e_banks: tuple[str, ...] = ()
    mailboxes: tuple[Mailbox, ...] = ()

    @cached_property
    def areas(self) -> dict[str, Area]:
        """All areas that a PLC with this image has: behind the slots what units bring, then E banks."""
        areas = dict(AREAS)
        at = _page_up(SLOTS_OFFSET + self.slots_size)
        for area in (*(box.at(0) for box in self.mailboxes), *(e_bank(name, 0) for name in self.e_banks)):
            areas[area.name] = replace(area, offset=at)
            at = _page_up(at + area.size_bytes)
        return areas

    @cached_property
    def size(self) -> int:
        """Bytes of the whole buffer, in whole pages."""
        return _page_up(max(SLOTS_OFFSET + self.slots_size, *(a.offset + a.size_bytes for a in self.areas.values())))


def _page_up(size: int) -> int:
    return (size + PAGE_BYTES - 1) // PAGE_BYTES * PAGE_BYTES


@dataclass(frozen=True)
class Retained:
    """Bytes that a warm start keeps, by the name under which they are found after a change of program."""

    name: str
    offset: int
    size: int


@dataclass(frozen=True)
class Objects:
    """What pointers may be moved in.  `extents` are offsets of first bytes and of first bytes behind, of variables that
    live as long as the program, for the objects from FIRST_OBJECT on.

    `leases` are so many rows in the buffer, from `leases_at` on (see LEASE_BYTES).  The object of one is LEASED + row <<
    `held_bits` + the number under which it is held: a pointer of an earlier lease of the same row is told from it."""

    extents: tuple[tuple[int, int], ...] = ()
    leases: int = 0
    leases_at: int = 0

    @property
    def held_bits(self) -> int:
        return 23 - max(self.leases - 1, 0).bit_length()


@dataclass(frozen=True)
class RungPicture:
    """A rung as it was written, for those who draw it: the number of its body, its place, and its steps, each with the
    place that observations of it name, prefix, mnemonic and operands."""

    body: int
    site: int
    number: int
    comment: str
    steps: tuple[tuple[int, str, str, tuple[str, ...]], ...]
    is_text: bool = False
    """Whether it is a statement of Structured Text that is drawn as a rung."""


@dataclass(frozen=True)
class SfcPicture:
    """A sequential function chart as it was written, for those who draw it: the number of its body, the place at which
    each call of it begins, its steps and its transitions.

    A step is its name, whether it is an initial one, where in an instance its flag lies, and (qualifier with time, action,
    indicators) of each association.  A transition is the place that observations of it name, its name, its priority (0
    for none), the numbers of the steps before and behind it, and its condition."""

    body: int
    site: int
    steps: tuple[tuple[str, bool, int, tuple[tuple[str, str, str], ...]], ...]
    transitions: tuple[tuple[int, str, int, tuple[int, ...], tuple[int, ...], str], ...]


@dataclass(frozen=True)
class Image:
    """A compiled program."""

    layout: Layout
    bodies: tuple[Body, ...]
    tasks: tuple[TaskRow, ...]
    symbols: dict[str, Field]
    """Programs and global variables by folded name; their offsets count from the start of the buffer.
    Members are found through their types."""
    initial: tuple[tuple[int, bytes], ...]
    """Bytes to write at power-on over a buffer of zeros."""
    retained: tuple[Retained, ...]
    sites: tuple[Site, ...]
    types: dict[str, Type] = field(default_factory=dict)
    """Derived types and blocks by folded name."""
    objects: Objects = field(default_factory=Objects)
    rungs: tuple[RungPicture, ...] = ()
    charts: tuple[SfcPicture, ...] = ()

    @cached_property
    def fingerprint(self) -> str:
        """A number in hexadecimal that another program, or the same in another layout, does not have."""
        around = repr((self.layout, self.tasks, self.initial, self.retained, self.objects)).encode()
        said = hashlib.sha256(b"%d:" % len(around) + around)
        for body in self.bodies:
            content = _plain_bytes((body.name, body.code, body.instance_size))
            said.update(b"%d:" % len(content) + content)
        return said.hexdigest()[:32]


def _plain_bytes(data: Any) -> bytes:
    """Plain data as bytes that other data does not have; in the host's form, if they are not nested too deep for that."""
    try:
        return marshal.dumps(data, SAME_FOR_EQUAL)
    except ValueError:
        left, found = [data], []
        while left:
            item = left.pop()
            found.append(f"({len(item)}" if isinstance(item, tuple) else repr(item))
            left += item if isinstance(item, tuple) else ()
        return "\n".join(found).encode("utf-8", "surrogatepass")
