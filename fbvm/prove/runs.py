"""Runs on the engine: random ones, before any solver is asked, and those that a solver has found, which have to do there what the
solver says."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from random import Random

from fbvm.base.types import BOOL, Elementary, EnumType, SubrangeType, base
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.bounded import Inputs
from fbvm.prove.encoding.cells import BIT, NUMBER, Cell
from fbvm.prove.encoding.terms import Term
from fbvm.prove.invariants import Sample, Values
from fbvm.prove.question import ALWAYS, NO_TRAP, WITHIN, WRITTEN_ONCE, Question, Run
from fbvm.prove.question import Names as QuestionNames
from fbvm.prove.unit_rules import Rule, Watch, rules
from fbvm.record.trace.writes import Writes, noting_writes
from fbvm.watch.conditions import Condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place
from fbvm.watch.values import Value

HOLD_SCANS = (1, 10, 100, 1000)
"""How long an input keeps its value in a random run, on the average."""
SCANS_AT_A_TIME = 64
EDGES = 3
"""One number of so many is one of the edges: 0, 1, the greatest, the smallest."""


@dataclass
class Waiting:
    """Of WITHIN, in a run: whether the trigger held behind the scan before, whether its answer is awaited, and since when
    the last one was."""

    triggered: bool = False
    is_open: bool = False
    since_ns: int = 0


@dataclass(frozen=True)
class Judge:
    """Tells behind a scan whether a run got to the goal of a question, and whether it keeps the assumptions."""

    question: Question
    condition: Condition | None
    assumptions: tuple[Condition, ...]
    trigger: Condition | None = None
    waiting: Waiting = field(default_factory=Waiting)
    written: tuple[Place, ...] = ()
    """Of WRITTEN_ONCE: the places of which it is asked who writes them."""
    rules: tuple[Rule, ...] = ()
    watch: Watch | None = None
    """Whether the units of this run keep their rules."""
    writes: Writes | None = None
    """Who writes them in the last scan of this run."""

    @classmethod
    def of(cls, image: Image, question: Question) -> Judge:
        """Raises ConditionError for conditions that do not fit the program."""
        names = QuestionNames(image, question.prefix)
        written = names.places(question.text) if question.kind == WRITTEN_ONCE else ()
        condition = None if question.kind in (NO_TRAP, WRITTEN_ONCE) else names.condition(question.text)
        trigger = names.condition(question.trigger) if question.kind == WITHIN else None
        return cls(question, condition, tuple(names.condition(text) for text in question.assumptions), trigger,
                   written=written, rules=tuple(rule for unit, socket in question.units for rule in rules(unit, socket)))

    @contextmanager
    def judging(self, plc: Plc) -> Iterator[Judge]:
        """The judge of the run that `plc` does inside the `with` block."""
        begun = replace(self, waiting=Waiting())
        if self.rules:
            watch = Watch(plc, self.rules)
            begun = replace(begun, watch=watch)
            plc.phases.append(watch.phase)
        if not self.written:
            yield begun
            return
        with noting_writes(plc, self.written) as writes:
            yield replace(begun, writes=writes)

    @property
    def places(self) -> tuple[Place, ...]:
        """What the property names."""
        conditions = [each for each in (self.trigger, self.condition) if each is not None]
        plain = [place for place in self.written if isinstance(base(place.type), Elementary)]
        return tuple(dict.fromkeys([*(place for condition in conditions for place in condition.places), *plain]))

    @property
    def all_places(self) -> tuple[Place, ...]:
        """What the property and the assumptions name."""
        return (*self.places, *(place for assumption in self.assumptions for place in assumption.places))

    def met(self, plc: Plc) -> bool:
        """True if the last scan of a PLC met the goal.  To be asked once behind each scan of a run."""
        if self.writes is not None:
            return plc.trap is None and bool(self.writes.twice())
        if self.condition is None:
            return plc.trap is not None
        if self.trigger is not None:
            return plc.trap is None and self._is_late(plc, self.condition.holds(plc.read), self.trigger.holds(plc.read))
        return plc.trap is None and self.condition.holds(plc.read) != (self.question.kind == ALWAYS)

    def _is_late(self, plc: Plc, answered: bool, triggered: bool) -> bool:
        waiting = self.waiting
        if triggered and not waiting.triggered and not waiting.is_open:
            waiting.since_ns, waiting.is_open = plc.now_ns, True
        waiting.triggered, was_open = triggered, waiting.is_open
        waiting.is_open &= not answered
        waited_ns = plc.now_ns - waiting.since_ns + (0 if answered else plc.cycle_ns)  # the next scan begins then at the earliest
        return was_open and waited_ns > self.question.within_ns

    def kept(self, plc: Plc) -> bool:
        """True if the assumptions hold now."""
        return (self.watch is None or self.watch.is_kept) and all(assumption.holds(plc.read) for assumption in self.assumptions)


class InputWriter:
    """Writes cells of inputs into the memory of a PLC, and tells which variables these are."""

    def __init__(self, plc: Plc, cells: Sequence[Cell]) -> None:
        self.plc = plc
        self.cells = cells
        names = Names.of(plc.image, plc.memory.areas)
        self.places = {cell: _named(names, cell) for cell in cells}

    def write(self, cell: Cell, value: int) -> None:
        memory = self.plc.memory
        if cell.kind == BIT:
            memory.write(cell.offset, "b", bool(value), cell.bit)
        else:
            memory.u8[cell.offset : cell.offset + cell.size] = value.to_bytes(cell.size, "little")

    def read(self, cell: Cell) -> int:
        """What lies in a cell now."""
        data = bytes(self.plc.memory.u8[cell.offset : cell.offset + cell.size])
        return data[0] >> cell.bit & 1 if cell.kind == BIT else int.from_bytes(data, "little")


def _named(names: Names, cell: Cell) -> list[Place]:
    """The variables, or parts of them, that a cell consists of."""
    if cell.kind == BIT:
        place = names.at(cell.offset, cell.bit)
        if place is None or place.bit is not None:
            return [place] if place else []
        number = 8 * (cell.offset - place.offset) + cell.bit
        return [place.inner(f"{place.name}.{number}", BOOL, number // 8, number % 8)]
    return list(dict.fromkeys(names.within(cell.offset, cell.size)))


class RandomInputs:
    """Random values for the cells of inputs.  Inputs of enumerations and subranges get values of their type."""

    def __init__(self, writer: InputWriter, random: Random) -> None:
        self._random = random
        self._choices: dict[Cell, Callable[[], int]] = {cell: self._choice(cell, writer.places[cell]) for cell in writer.cells}

    def _choice(self, cell: Cell, places: list[Place]) -> Callable[[], int]:
        random = self._random
        if cell.width == 0:
            return lambda: random.getrandbits(1)
        top = (1 << cell.width) - 1
        kind = places[0].type if len(places) == 1 and places[0].type.size == cell.size else None
        plain = base(kind) if kind else None
        if isinstance(plain, EnumType):
            members = sorted(plain.shown)
            return lambda: random.choice(members) & top
        if isinstance(kind, SubrangeType):
            return lambda: random.randint(kind.low, kind.high) & top
        edges = (0, 1, top, top >> 1, (top >> 1) + 1, 10, 100)
        return lambda: random.choice(edges) if random.randrange(EDGES) == 0 else random.getrandbits(cell.width)

    def value(self, cell: Cell) -> int:
        return self._choices[cell]()


@dataclass(frozen=True)
class Machine:
    """Makes PLCs of a program, and says when they scan: every `cycle_ns`, or up to `longest_ns` apart where that is more."""

    image: Image
    cycle_ns: int
    longest_ns: int
    budget: int

    def plc(self) -> Plc:
        return Plc(self.image, self.cycle_ns, budget=self.budget, engine="python")

    def random_times(self, random: Random, hold_scans: int) -> Iterator[int]:
        """The times of the scans of a random run."""
        now_ns, passed_ns = 0, self.cycle_ns
        while True:
            yield now_ns
            if self.longest_ns > self.cycle_ns and random.randrange(hold_scans) == 0:
                passed_ns = random.choice((self.cycle_ns, self.longest_ns, random.randint(self.cycle_ns, self.longest_ns)))
            now_ns += passed_ns


@dataclass(frozen=True)
class Found:
    """A random run that met the goal: its inputs, scan by scan."""

    inputs: Inputs
    seed: int
    hold_scans: int


def simulated(machine: Machine, judge: Judge, cells: Sequence[Cell], scans: int, seed: int) -> Iterator[Found | None]:
    """Runs with random inputs, some scans each; yields None now and then, and the run that met the goal, at last."""
    for number, hold_scans in enumerate(HOLD_SCANS):
        plc = machine.plc()
        random = Random(f"{seed} {number}")
        times_ns = machine.random_times(random, hold_scans)
        writer = InputWriter(plc, cells)
        values = RandomInputs(writer, random)
        inputs = Inputs([], [])
        with judge.judging(plc) as judging:
            for _ in range(scans):
                inputs.values.append(_drawn(writer, values, random, hold_scans, judging))
                inputs.times_ns.append(next(times_ns))
                plc.scan(inputs.times_ns[-1])
                if not judging.kept(plc):
                    break
                if judging.met(plc):
                    yield Found(inputs, seed, hold_scans)
                    return
                if plc.trap:
                    break
                if plc.scans % SCANS_AT_A_TIME == 0:
                    yield None


def sampled(machine: Machine, judge: Judge, cells: Sequence[Cell], state: dict[Term, Cell], scans: int,
            seed: int) -> list[Sample]:  # fmt: skip
    """States behind scans of random runs: the values of the cells `state`."""
    found: list[Sample] = []
    for number, hold_scans in enumerate(HOLD_SCANS[:3] * 2):
        plc = machine.plc()
        random = Random(f"states {seed} {number}")
        times_ns = machine.random_times(random, hold_scans)
        writer = InputWriter(plc, cells)
        values = RandomInputs(writer, random)
        with judge.judging(plc) as judging:
            for _ in range(scans):
                _drawn(writer, values, random, hold_scans, judging)
                plc.scan(next(times_ns))
                if plc.trap or not judging.kept(plc):
                    break
                seen: Values = {variable: writer.read(cell) for variable, cell in state.items()}
                found.append(Sample(seen, plc.now_ns))
    return found


def _drawn(writer: InputWriter, values: RandomInputs, random: Random, hold_scans: int, judging: Judge) -> dict[Cell, int]:
    """Writes the inputs of a scan at random, each of which keeps its value for some scans; a unit writes what its rules allow.

    Returns what all of them are then."""
    for cell in writer.cells:
        if writer.plc.scans and random.randrange(hold_scans):
            continue
        value, before = values.value(cell), writer.read(cell)
        writer.write(cell, value)
        if judging.watch is not None and not judging.watch.allows(writer.plc, cell.offset):
            writer.write(cell, before)
    return {cell: writer.read(cell) for cell in writer.cells}


def stepped(plc: Plc, writer: InputWriter, inputs: Inputs) -> Iterator[dict[Place, Value]]:
    """Does a run scan by scan: behind each, what was written before it."""
    for now, now_ns in zip(inputs.values, inputs.times_ns, strict=True):
        changed = [cell for cell, value in now.items() if value != writer.read(cell)]  # the program may have written it, too
        for cell in changed:
            writer.write(cell, now[cell])
        written = {place: plc.read(place) for cell in changed for place in writer.places[cell]}
        plc.scan(now_ns)
        yield written


def replayed(machine: Machine, judge: Judge, inputs: Inputs, is_shortest: bool) -> Run | None:
    """The run with these inputs, done on the engine; None if it does not meet the goal in its last scan, or earlier only."""
    plc = machine.plc()
    writer = InputWriter(plc, [*dict.fromkeys(cell for now in inputs.values for cell in now)])
    writes: list[dict[Place, Value]] = []
    with judge.judging(plc) as judging:
        for number, written in enumerate(stepped(plc, writer, inputs)):
            writes.append(written)
            if not judging.kept(plc):
                return None
            if judging.met(plc):
                writers = judging.writes.twice() if judging.writes else ()
                run = Run(tuple(writes), tuple(inputs.times_ns), machine.cycle_ns, is_shortest, plc.trap,
                          judging.waiting.since_ns, machine.longest_ns > machine.cycle_ns,
                          writers)  # fmt: skip
                return run if number == len(inputs) - 1 else None
            if plc.trap:
                return None
    return None


def inputs_of(machine: Machine, run: Run) -> Inputs:
    """What a run is given, as `replayed` takes it: of each scan only what is written before it."""
    plc, inputs = machine.plc(), Inputs([], [*run.times_ns])
    for writes, now_ns in zip(run.writes, run.times_ns, strict=True):
        for place, value in writes.items():
            plc.write(place, value)
        cells = [Cell(place.offset, 1, BIT, place.bit) if place.bit is not None else Cell(place.offset, place.type.size, NUMBER)
                 for place in writes]  # fmt: skip
        writer = InputWriter(plc, cells)
        inputs.values.append({cell: writer.read(cell) for cell in cells})
        plc.scan(now_ns)
    return inputs


def repeated(plc: Plc, run: Run) -> None:
    """Does a run again on a PLC that has not scanned yet."""
    for writes, now_ns in zip(run.writes, run.times_ns, strict=True):
        for place, value in writes.items():
            plc.write(place, value)
        plc.scan(now_ns)
