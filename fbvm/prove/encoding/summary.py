"""The summary of a program: one scan, executed symbolically once, from any state that the program can be in.

State is what a scan can change; everything else keeps its initial value and is a constant.  Inputs are free in each scan."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

from fbvm.base.areas import AREAS, INPUT_AREAS
from fbvm.base.types import ArrayType, Field, StructType
from fbvm.code.image import Image
from fbvm.engine.depths import with_recursion_room
from fbvm.prove.encoding.cells import BIT, Cell, Contents, Partition, Reshape, constant_of, initial_bytes
from fbvm.prove.encoding.execution import Refused, TrapCondition
from fbvm.prove.encoding.properties import place_term
from fbvm.prove.encoding.scan import WIDTHS, Scanned, Signal, scan
from fbvm.prove.encoding.term import constants_of
from fbvm.prove.encoding.terms import Term, Terms, never
from fbvm.prove.encoding.writes import Writes
from fbvm.watch.paths import Place

FRAMES_A_LEVEL = 8
"""Python frames that executing takes at most for each level of nested code."""
MOST_VALUES = 8
"""Values that a number of the state has, up to which each is told apart: phases of a sequence, parameters of a request."""
MOST_ROUNDS = 400
"""Symbolic executions until state and constants are told apart."""


@dataclass
class Summary:
    """One scan in terms of the variables of the state before it, of its inputs, and of what the machine says (`signals`)."""

    image: Image
    terms: Terms
    contents: Contents
    """What memory holds behind the scan."""
    before: Contents
    """What it holds when the scan begins: the state and the inputs."""
    writes: Writes
    """Which statements write the bits that are watched."""
    initial: dict[Term, Term] = field(default_factory=dict)
    """The value of each variable of the state before the first scan."""
    next: dict[Term, Term] = field(default_factory=dict)
    """The term of each of them behind the scan."""
    cells: dict[Term, Cell] = field(default_factory=dict)
    """The cells of variables of the state."""
    inputs: dict[Term, Cell] = field(default_factory=dict)
    """The cells of the variables that are free in each scan."""
    signals: dict[Term, Signal] = field(default_factory=dict)
    traps: list[TrapCondition] = field(default_factory=list)
    reached: dict[int, Term] = field(default_factory=dict)
    """When the statement at each site is executed."""
    unknowns: dict[str, int] = field(default_factory=dict)
    """Operations of which nothing is known, with the site of one each."""
    never_written: set[Cell] = field(default_factory=set)
    """Cells that the code reads and nobody writes: they keep their initial value."""


def summarize(image: Image, budget: int, free: Iterable[tuple[int, int, int | None]] = (),
              expired: Callable[[], bool] = never, seen: Sequence[Place] = (),
              watched: Sequence[range] = ()) -> Summary:  # fmt: skip
    """The summary of a program.

    `budget` is the step budget of a scan; `free` are places (offset, bytes, bit or None) that are inputs besides those that
    `input_places` finds; `seen` are places at which somebody looks behind a scan, `watched` bits of which it is asked who writes
    them.  Raises Refused for a program that cannot be followed, with the site, and TimeOver
    if `expired` answers True before it is done."""
    places = [*input_places(image), *free]
    return with_recursion_room(image, FRAMES_A_LEVEL, partial(_summarized, image, budget, places, expired, seen, watched))


def _summarized(image: Image, budget: int, free: list[tuple[int, int, int | None]], expired: Callable[[], bool],
                seen: Sequence[Place], watched: Sequence[range]) -> Summary:  # fmt: skip
    area = AREAS["CIO"]
    partition = Partition(bitwise=range(area.offset, area.offset + area.size_bytes))
    numbers: frozenset[int] = frozenset()
    for _ in range(MOST_ROUNDS):
        try:
            used = set(partition.used)
            found = _Fixpoint(image, budget, partition, free, expired, seen, watched).summary()
            if partition.used == used:
                found.terms.expired = never
                return found
            partition = partition.shaped()
        except Reshape as reshape:
            numbers |= {reshape.offset}
            fresh = Partition(numbers, partition.bitwise)
            fresh.used = partition.used
            partition = fresh.shaped()
    raise Refused("its memory is used in too many shapes")


class _Fixpoint:
    """Finds what is state: at first nothing is, then what some scan leaves with another value than it may have had before."""

    def __init__(self, image: Image, budget: int, partition: Partition, free: list[tuple[int, int, int | None]],
                 expired: Callable[[], bool], seen: Sequence[Place], watched: Sequence[range]) -> None:  # fmt: skip
        self.seen, self.watched = [place for place in seen if not place.hops], watched
        self.image, self.budget, self.partition, self.terms = image, budget, partition, Terms(expired)
        self.power_on = initial_bytes(image.initial)
        self.free_bytes = {at for offset, size, bit in free if bit is None for at in range(offset, offset + size)}
        self.free_bits = {(offset, bit) for offset, _, bit in free if bit is not None}
        self.variable: set[Cell] = set()
        self.values: dict[Cell, set[int]] = {}
        """The values that a number of the state can have, where they are few; empty where they are not."""
        self.changing: set[Signal] = set()
        self.written: set[Cell] = set()
        self.signals: dict[Term, Signal] = {}
        self.inputs: dict[Term, Cell] = {}

    def summary(self) -> Summary:
        for _ in range(MOST_ROUNDS):
            before = self._known()
            scanned = self._scan()
            self._take(scanned)
            if before == self._known():
                return self._made(scanned)
        raise Refused("what is state cannot be told")

    def _known(self) -> tuple[object, ...]:
        sizes = tuple(len(some) for some in (self.partition.at, self.variable, self.written, self.changing))
        return *sizes, {cell: len(values) for cell, values in self.values.items()}

    def is_input(self, cell: Cell) -> bool:
        """True for a cell that is free in each scan: named so, or a CIO cell that no code writes."""
        if self._is_named(cell):
            return True
        area = AREAS["CIO"]
        return area.offset <= cell.offset < area.offset + area.size_bytes and cell not in self.written

    def _is_named(self, cell: Cell) -> bool:
        return cell.offset in self.free_bytes or cell.kind == BIT and (cell.offset, cell.bit) in self.free_bits

    def initial(self, cell: Cell) -> Term:
        if self._is_named(cell):
            return self._input(cell)  # the code does not read it, the property does
        if cell in self.variable:
            return self._one_of(self.terms.variable(("state", cell), cell.width), self.values.get(cell))
        return constant_of(self.terms, cell, self.power_on(cell.offset, cell.size))

    def _one_of(self, variable: Term, values: set[int] | None) -> Term:
        """A variable of the state as one of the few values that it can have, so that comparisons with others fold."""
        if not values:
            return variable
        first, *rest = sorted(values)
        found = self.terms.constant(variable.width, first)
        for value in rest:
            constant = self.terms.constant(variable.width, value)
            found = self.terms.ite(self.terms.eq(variable, constant), constant, found)
        return found

    def _input(self, cell: Cell) -> Term:
        term = self.terms.variable(("input", cell), cell.width)
        self.inputs[term] = cell
        return term

    def signal(self, signal: Signal) -> Term:
        if signal[0] in ("level", "fresh") and signal not in self.changing:
            return self.terms.boolean(signal[0] == "fresh")
        term = self.terms.variable(signal, WIDTHS[signal[0]])
        self.signals[term] = signal
        return term

    def _scan(self) -> Scanned:
        contents = Contents(self.terms, self.partition, self.initial)
        self.inputs = {}
        for cell in dict.fromkeys(cell for cells in self.partition.at.values() for cell in cells):
            if self.is_input(cell):
                contents.written[cell] = self._input(cell)
        self.before = contents
        begun = contents.child()
        for place in self.seen:  # what only the property reads: the machine, too, writes where somebody looks
            place_term(begun, place)
        return scan(self.image, begun, self.signal, self.budget, self.watched)

    def _take(self, scanned: Scanned) -> None:
        """What the scan shows to be written, and to be state."""
        given = {cell: term for term, cell in self.inputs.items()}
        for cell in scanned.contents.written_since(None):
            value = scanned.contents.get(cell)
            if cell in given and value is given[cell]:
                continue
            self.written.add(cell)
            if not self.is_input(cell) and value is not self.initial(cell):
                if cell.width > 0:
                    self._meet(cell, value)
                self.variable.add(cell)
        for signal, term in scanned.following.items():
            if term is not self.signal(signal):
                self.changing.add(signal)

    def _meet(self, cell: Cell, value: Term) -> None:
        """Notes the values that a cell of the state may have; none if there are many."""
        if cell not in self.variable:
            self.values[cell] = {constant_of(self.terms, cell, self.power_on(cell.offset, cell.size)).value}
        if known := self.values[cell]:
            found = constants_of(value, MOST_VALUES)
            self.values[cell] = known | found if found and len(known | found) <= MOST_VALUES else set()

    def _made(self, scanned: Scanned) -> Summary:
        terms, x = self.terms, scanned.execution
        made = Summary(self.image, terms, scanned.contents, self.before, inputs=self.inputs, traps=x.traps, reached=x.reached,
                       unknowns=x.unknowns, writes=x.writes)  # fmt: skip
        for cell in sorted(self.variable):
            term = terms.variable(("state", cell), cell.width)
            made.cells[term] = cell
            made.initial[term] = constant_of(terms, cell, self.power_on(cell.offset, cell.size))
            made.next[term] = scanned.contents.get(cell)
        for signal in self.changing:
            term = self.signal(signal)
            made.initial[term] = terms.boolean(signal[0] == "fresh")
            made.next[term] = scanned.following.get(signal, term)
        made.signals = {term: signal for term, signal in self.signals.items() if term not in made.next}
        known = {cell for cells in self.partition.at.values() for cell in cells}
        made.never_written = known - self.written - set(self.inputs.values())
        return made


def input_places(image: Image) -> list[tuple[int, int, int | None]]:
    """The places (offset, bytes, bit) of inputs: %I, and VAR_INPUT of programs."""
    found: list[tuple[int, int, int | None]] = [(area.offset, area.size_bytes, None)
                                                for area in image.layout.areas.values() if area.name in INPUT_AREAS]
    for task in image.tasks:
        for run in task.programs:
            symbol = image.symbols.get(run.name.upper())
            if symbol is not None and isinstance(symbol.type, StructType):
                found += [place for member in symbol.type.fields.values() if member.kind == "VAR_INPUT" and not member.reference
                          for place in _extent(member, symbol.offset)]  # fmt: skip
    return found


def _extent(member: Field, base: int) -> list[tuple[int, int, int | None]]:
    offset = member.offset if member.absolute else base + member.offset
    if member.bit is None:
        return [(offset, member.type.size, None)]
    count = member.type.count if isinstance(member.type, ArrayType) else 1
    return [(offset + (member.bit + at) // 8, 1, (member.bit + at) % 8) for at in range(count)]
