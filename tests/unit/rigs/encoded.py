"""The encoder of `fbvm.prove` as an engine: fed with constants it executes a scan, which is compared with one of the engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

from fbvm.base.areas import AREAS, PAGE_BYTES
from fbvm.code.image import Image, TaskRow
from fbvm.engine.depths import with_recursion_room
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.cells import BIT, Cell, Contents, Partition, Reshape, constant_of
from fbvm.prove.encoding.clocks import Clock, FixedCycle, FreeCycle
from fbvm.prove.encoding.scan import Scanned, Signal, scan
from fbvm.prove.encoding.terms import Term, Terms

FRAMES_A_LEVEL = 8
FROM_BYTE = AREAS["CIO"].offset
"""Before it lies the system page, which belongs to the engine."""
MACHINE_BYTES = range(AREAS["A"].offset, AREAS["A"].offset + AREAS["A"].size_bytes)
"""Where the machine writes words that no program asks for."""


class KnownTimes(FreeCycle):
    """Scans that begin at known times, in the way of those at any time."""

    def __init__(self, terms: Terms, tasks: tuple[TaskRow, ...], times_ns: Sequence[int]) -> None:
        passed_ns = [after - before for before, after in pairwise(times_ns)]
        super().__init__(terms, tasks, min(passed_ns), max(passed_ns))
        self._times_ns = times_ns

    def passed(self, number: int, *, later: bool = False) -> Term:
        return self.terms.constant(64, self._times_ns[number] - self._times_ns[number - 1] if number else 0)


class Encoded:
    """Scans of an image by the encoder, over the memory that a PLC has before each."""

    def __init__(self, image: Image, cycle_ns: int, budget: int, times_ns: Sequence[int] = ()) -> None:
        self.image, self.cycle_ns, self.budget, self.times_ns = image, cycle_ns, budget, times_ns
        self.carried: dict[Signal, bool] = {}

    def scan(self, number: int, memory: bytes) -> Scanned:
        """The scan of a number, from 0 on, over a memory.  Raises Refused for what it cannot follow."""
        scanned = with_recursion_room(self.image, FRAMES_A_LEVEL, partial(self._scan, number, memory))
        self.carried |= {signal: bool(term.value) for signal, term in scanned.following.items()}
        return scanned

    def _scan(self, number: int, memory: bytes) -> Scanned:
        terms, numbers = Terms(), frozenset[int]()
        clock: Clock = FixedCycle(terms, self.image.tasks, self.cycle_ns)
        if self.times_ns:
            clock = KnownTimes(terms, self.image.tasks, self.times_ns)

        def signal(asked: Signal) -> Term:
            known = clock.value(number, asked)
            return terms.boolean(self.carried.get(asked, asked[0] == "fresh")) if known is None else known

        def initial(cell: Cell) -> Term:
            return constant_of(terms, cell, memory[cell.offset : cell.offset + cell.size])

        while True:
            partition = Partition(numbers)
            try:
                while True:  # words that the machine writes are known when the program has asked for them once
                    before = len(partition.at)
                    scanned = scan(self.image, Contents(terms, partition, initial), signal, self.budget)
                    if len(partition.at) == before:
                        return scanned
            except Reshape as reshape:
                numbers |= {reshape.offset}


def differences(scanned: Scanned, before: bytes, plc: Plc) -> list[str]:
    """What a scan of the encoder leaves otherwise than the engine has: cells, other bytes that have changed, the trap."""
    contents, after = scanned.contents, bytes(plc.memory.u8)
    cells = {cell for cells in contents.partition.at.values() for cell in cells if cell.offset >= FROM_BYTE}
    wrong = []
    for cell in sorted(cells):
        data, term = after[cell.offset : cell.offset + cell.size], contents.get(cell)
        value = data[0] >> cell.bit & 1 if cell.kind == BIT else int.from_bytes(data, "little")
        if not term.is_constant or term.value != value:
            wrong.append(f"{cell}: {term}, on the engine {value}")
    for page in range(FROM_BYTE, len(after), PAGE_BYTES):
        if before[page : page + PAGE_BYTES] != after[page : page + PAGE_BYTES]:
            wrong += [f"byte {at} was not followed" for at in range(page, page + PAGE_BYTES)
                      if before[at] != after[at] and at not in contents.partition.at and at not in MACHINE_BYTES]
    ended = (scanned.ended.code, plc.image.sites[scanned.ended.site]) if scanned.ended else None
    trap = (plc.trap.code, plc.trap.site) if plc.trap else None
    return wrong + ([f"trap {ended}, on the engine {trap}"] if ended != trap else [])


def compare_scans(image: Image, cycle_ns: int, scans: int, budget: int,
                  write: Callable[[Plc, int], None] = lambda plc, number: None,
                  times_ns: Sequence[int] = ()) -> None:  # fmt: skip
    """Asserts that the encoder does so many scans as the engine does; `write` writes inputs before each.

    They begin every `cycle_ns`, or at `times_ns`."""
    plc, encoded = Plc(image, cycle_ns, budget=budget, engine="python"), Encoded(image, cycle_ns, budget, times_ns)
    for number in range(scans):
        write(plc, number)
        before = bytes(plc.memory.u8)
        scanned = encoded.scan(number, before)
        plc.scan(times_ns[number] if times_ns else None)
        assert differences(scanned, before, plc) == [], f"scan {number}"
        if plc.trap:
            break
