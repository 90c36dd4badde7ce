"""Runs that execute every statement, and every IF and CASE without one of its branches: inputs for tests where there are none.

A goal is counted as met when the engine has executed it, as coverage counts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from fbvm.base.types import Elementary, StructType
from fbvm.code.image import Image, Site
from fbvm.machine.counting import counting
from fbvm.prove.bounded import BoundedSearch, Goal, Inputs
from fbvm.prove.encoding.properties import place_term
from fbvm.prove.encoding.terms import Term
from fbvm.prove.induction import Induction
from fbvm.prove.prover import Limits, Prover
from fbvm.prove.question import NO_TRAP, Question, Run
from fbvm.prove.runs import InputWriter, stepped
from fbvm.prove.solver import UNSAT
from fbvm.prove.unreached import own_files
from fbvm.record.trace.branches import branches, statements
from fbvm.watch.paths import Place, find_place, member
from fbvm.watch.values import Value

FIRST_SCANS = 16
"""Scans that are searched before it is tried whether no run ever gets there."""
INDUCTION = 2
PLAIN = ("b", "i8", "i16", "i32", "i64", "u8", "u16", "u32", "u64")
"""What tests compare: no REAL, whose last digits differ."""

Known = Callable[[Site, list[Site]], bool]
"""Whether a statement is executed already; or, if the first statements of its branches are given, it without one of them."""


@dataclass(frozen=True)
class Spot:
    """A statement to be executed, or with `is_skip` an IF or CASE that takes none of its branches with statements."""

    site: int
    is_skip: bool = False

    def words(self, image: Image) -> str:
        at: Site = image.sites[self.site]
        return f"{at.file}:{at.line}" + (" without a branch" if self.is_skip else "")


@dataclass(frozen=True)
class Reaching:
    """A run, the goals that it meets first, and what the outputs are behind each scan."""

    run: Run
    spots: tuple[Spot, ...]
    outputs: tuple[dict[Place, Value], ...]


@dataclass
class Covered:
    """What was found: runs, goals that no run ever meets, and goals of which that is not known, with the scans in which none is
    met."""

    met: int = 0
    """The goals that were met, by runs or before."""
    runs: list[Reaching] = field(default_factory=list)
    never: list[Spot] = field(default_factory=list)
    missed: dict[Spot, int] = field(default_factory=dict)


def cover(image: Image, limits: Limits, assumed: tuple[str, ...] = (), free: tuple[str, ...] = (),
          known: Known = lambda site, others: False, tell: Callable[[str], None] = lambda said: None,
          units: tuple[tuple[int, int], ...] = ()) -> Covered:  # fmt: skip
    """Runs that meet the goals of a program that are not `known` to be met; `units` are those of a `Question`.

    Raises what `prove` raises."""
    prover = Prover(image, Question(NO_TRAP, "", assumed, free, units=units), limits, tell)
    spots = _spots(image)
    waiting = dict.fromkeys(spot for spot in spots if not known(image.sites[spot.site], _others(image, spot)))
    outputs = output_places(prover)
    found = Covered()
    while waiting:
        spot = next(iter(waiting))
        del waiting[spot]
        tell(f"looking for a run to {spot.words(image)}")
        inputs = _searched(prover, spot, found)
        if inputs is None:
            continue
        reaching = _done(prover, inputs, [spot, *waiting], outputs)
        if spot not in reaching.spots:  # it depends on values of which the solver knows nothing
            found.missed[spot] = len(inputs) - 1
        if reaching.spots:
            found.runs.append(reaching)
        for each in reaching.spots:
            waiting.pop(each, None)
    found.met = len(spots) - len(found.never) - len(found.missed)
    return found


def _spots(image: Image) -> list[Spot]:
    own = own_files(image)
    skips = [branch.site for branch in branches(image) if branch.may_skip and branch.site not in branch.targets]
    found = [*(Spot(site) for site in statements(image)), *(Spot(site, True) for site in skips)]
    return [spot for spot in found if image.sites[spot.site].file in own]


def _others(image: Image, spot: Spot) -> list[Site]:
    """The branches that a skip does not take; none for a statement."""
    found = (branch.targets for branch in branches(image) if spot.is_skip and branch.site == spot.site)
    return [image.sites[target] for target in next(found, ())]


def _condition(prover: Prover, spot: Spot) -> Term:
    terms, reached = prover.summary.terms, prover.summary.reached
    here = reached.get(spot.site, terms.false)
    if not spot.is_skip:
        return here
    targets = next(branch.targets for branch in branches(prover.image) if branch.site == spot.site)
    return terms.and_(here, terms.not_(terms.any_of(*(reached.get(target, terms.false) for target in targets))))


def _searched(prover: Prover, spot: Spot, found: Covered) -> Inputs | None:
    """The inputs of the shortest run to a goal, of one that ends in a trap if no other gets there; without one the goal is noted
    in `found`."""
    terms, stop = prover.summary.terms, prover.goal.stop
    condition = _condition(prover, spot)
    missed: list[int] = []
    for hit in dict.fromkeys((terms.and_(condition, terms.not_(stop)), condition)):
        inputs, cleared = _run_to(prover, Goal(hit, stop, prover.goal.given))
        if inputs is not None:
            return inputs
        missed += [] if cleared is None else [cleared]
    if missed:
        found.missed[spot] = min(missed)
    else:
        found.never.append(spot)
    return None


def _run_to(prover: Prover, goal: Goal) -> tuple[Inputs | None, int | None]:
    """The inputs of the shortest run to a goal, and how many scans were searched; None for these if no run ever gets there."""
    limits, whole = prover.limits, prover.whole(goal)
    if whole.hit is prover.summary.terms.false:
        return None, None
    search = BoundedSearch(prover.summary, goal, prover.clock, limits.expired)
    inputs = search.until(min(FIRST_SCANS, limits.scans))
    if inputs is None and search.cleared > INDUCTION:
        induction = Induction(prover.summary, whole, prover.clock, limits.expired)
        while induction.depth < INDUCTION and not limits.expired():
            if induction.step() == UNSAT:
                return None, None
    return inputs or search.until(limits.scans), search.cleared


def _done(prover: Prover, inputs: Inputs, spots: Sequence[Spot], places: Sequence[Place]) -> Reaching:
    """The run with some inputs on the engine, and which goals it has met there."""
    plc = prover.machine.plc()
    writes, outputs = [], []
    with counting(plc, own_files(prover.image)) as counts:
        for written in stepped(plc, InputWriter(plc, list(inputs.values[0])), inputs):
            writes.append(written)
            outputs.append({place: plc.read(place) for place in places})
        executed, skipped = counts.executed(), counts.skipped()
    met = tuple(spot for spot in spots if (skipped if spot.is_skip else executed).get(spot.site))
    run = Run(tuple(writes), tuple(inputs.times_ns), prover.machine.cycle_ns, True, plc.trap, 0, prover.clock.is_free)
    return Reaching(run, met, tuple(outputs))


def output_places(prover: Prover) -> list[Place]:
    """What a test looks at: VAR_OUTPUT and located variables of programs that scans change, or all that they change."""
    places = [place for task in prover.image.tasks for run in task.programs for place in _members(prover.image, run.name)]
    changed = [(kind, place) for kind, place in places if not (term := place_term(prover.summary.contents, place)).is_constant
               and term not in prover.summary.inputs]  # fmt: skip
    outputs = [place for kind, place in changed if kind]
    return outputs or [place for _, place in changed]


def _members(image: Image, program: str) -> Iterator[tuple[bool, Place]]:
    """The plain variables of a program, and whether each is an output."""
    whole = find_place(image.symbols, image.layout.areas, program)
    assert isinstance(whole.type, StructType)
    for each in whole.type.fields.values():
        if isinstance(each.type, Elementary) and each.type.machine in PLAIN and not each.reference:
            yield each.kind == "VAR_OUTPUT" or each.absolute, member(whole, each.name)
