"""Answers a question about a program: runs on the engine first, then bounded search, induction and invariants in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from fbvm.base.types import EnumType, SubrangeType, base
from fbvm.code.image import Image
from fbvm.machine.plc import STEP_BUDGET
from fbvm.prove.bounded import BoundedSearch, Goal, Inputs
from fbvm.prove.copies import copied
from fbvm.prove.cycle import show_cycle
from fbvm.prove.encoding.cells import initial_bytes
from fbvm.prove.encoding.clocks import Clock, clock_of
from fbvm.prove.encoding.execution import UNWOUND, Refused
from fbvm.prove.encoding.properties import condition_term, place_term
from fbvm.prove.encoding.rewriting import cone, distances, leaves
from fbvm.prove.encoding.scan import WIDTHS
from fbvm.prove.encoding.summary import Summary, summarize
from fbvm.prove.encoding.terms import Term, TimeOver
from fbvm.prove.induction import Induction
from fbvm.prove.invariants import Guess, Invariants, Literal, facts_of, guesses
from fbvm.prove.lemmas import lemma_places, lemmas
from fbvm.prove.question import (
    ALWAYS,
    BROKEN,
    NO_TRAP,
    PROVED,
    REACHED,
    UNDECIDED,
    UNREACHABLE,
    WITHIN,
    WRITTEN_ONCE,
    Names,
    Question,
    Run,
    Verdict,
)
from fbvm.prove.runs import Judge, Machine, replayed, sampled, simulated
from fbvm.prove.shortening import shortened
from fbvm.prove.solver import UNSAT
from fbvm.prove.unit_rules import Word, free_words, offset_of, words_of
from fbvm.prove.unit_rules import rules as rules_of
from fbvm.prove.unreached import unreached
from fbvm.watch.bits import bits_of
from fbvm.watch.names import Names as PlaceNames
from fbvm.watch.paths import Place

SIMULATED_SCANS = 2_000
"""Scans of each random run before the solver is asked."""
FIRST_SIMULATED = 2_000
"""Scans of those random runs that come before invariants are guessed: a run that needs more may be looked for in vain."""
SAMPLED_SCANS = 200
FIRST_SCANS = 4
"""Scans that are searched before anything is tried that looks back."""
DEPTHS = (16, 64)
"""Scans that are searched before random runs, and before deeper induction."""
MOST_INDUCTION = 5
MOST_LINES = 12
"""Lines that a note lists."""
FEW_STATE, MOST_STATE = 24, 200
"""Variables of the state of which invariants are guessed, those next to the goal: before a longer search, and behind it."""


@dataclass(frozen=True)
class Limits:
    """How far to go: `scans` from power-on on, until `expired` answers True.  `seed` is that of random runs.

    Scans begin every `cycle_ns`; with `longest_ns`, any time between these two lies between two scans, another one each time."""

    cycle_ns: int = 10_000_000
    scans: int = 1000
    seed: int = 0
    expired: Callable[[], bool] = lambda: False
    simulated_scans: int = SIMULATED_SCANS
    longest_ns: int = 0


Tell = Callable[[str], None]


def prove(image: Image, question: Question, limits: Limits | None = None, tell: Tell = lambda said: None) -> Verdict:
    """The answer to a question about the runs of a program from power-on, with any inputs.

    `tell` is told what is done.  Raises Refused for a program or property that cannot be followed, ConditionError and
    UnknownPlace for names that it does not have, SolverMissing."""
    try:
        prover = Prover(image, question, limits or Limits(), tell)
    except TimeOver:
        how = "the time is over: one scan has too many ways to follow all of them"
        return Verdict(question, UNDECIDED, how, places=Judge.of(image, question).places)
    return prover.answer()


class Prover:
    """One question on its way to an answer."""

    def __init__(self, image: Image, question: Question, limits: Limits, tell: Tell) -> None:
        self.image, self.question, self.limits, self.tell = image, question, limits, tell
        self.judge = Judge.of(image, question)
        names = Names(image, question.prefix)
        rules = [rule for unit, socket in question.units for rule in rules_of(unit, socket)]
        self.rules = tuple(rules)
        free = [extent for name in (*question.free, *free_words(rules)) for extent in names.extents(name)]
        seen = [place for word in words_of(rules) for place in names.places(f"{word[0]}{word[1]}")]
        seen += lemma_places(names, question)
        self.summary: Summary = summarize(image, STEP_BUDGET, free, limits.expired, [*self.judge.all_places, *seen],
                                           [bits_of(place) for place in self.judge.written])  # fmt: skip
        longest_ns = max(limits.longest_ns, limits.cycle_ns)
        self.clock: Clock = clock_of(self.summary.terms, image.tasks, limits.cycle_ns, longest_ns)
        self.machine = Machine(image, limits.cycle_ns, longest_ns, STEP_BUDGET)
        self.goal = self._goal(names)
        self.lemmas = lemmas(self.summary, names, question) if question.lemmas else {}
        self.notes: list[str] = []
        relevant = leaves([*self.goal.terms, *self.summary.next.values()])
        self.inputs = [cell for variable, cell in self.summary.inputs.items() if variable in relevant]
        self.search = BoundedSearch(self.summary, self.whole(self.goal), self.clock, limits.expired)

    def _goal(self, names: Names) -> Goal:
        terms, summary = self.summary.terms, self.summary
        stop = terms.any_of(*(trap.condition for trap in summary.traps if trap.code != UNWOUND))
        self.unwound = [trap for trap in summary.traps if trap.code == UNWOUND]
        assumed = (condition_term(summary.contents, names.condition(text).term) for text in self.question.assumptions)
        given = terms.all_of(*assumed, *self._types(), *self._kept_rules())
        self.condition = stop
        if self.question.kind == NO_TRAP:
            return Goal(stop, stop, given)
        self.condition = hit = self._hit(names)
        return Goal(terms.and_(hit, terms.not_(stop)), stop, given)

    def _hit(self, names: Names) -> Term:
        """The condition that a scan which does not trap gets to the goal."""
        terms, summary = self.summary.terms, self.summary
        if self.question.kind == WRITTEN_ONCE:
            return summary.writes.twice()
        condition = condition_term(summary.contents, names.condition(self.question.text).term)
        if self.question.kind == WITHIN:
            condition = self._awaited(condition, condition_term(summary.contents, names.condition(self.question.trigger).term))
        return terms.not_(condition) if self.question.kind == ALWAYS else condition

    def _awaited(self, answer: Term, trigger: Term) -> Term:
        """The condition that an answer is late.

        Adds to the state whether the trigger held behind the scan before, whether its answer is awaited, and for how long."""
        terms, summary = self.summary.terms, self.summary
        before, waits = terms.variable(("trigger", "before"), 0), terms.variable(("answer", "awaited"), 0)
        waited = terms.variable(("answer", "time"), 64)
        passed, zero = terms.variable(("passed", 0), WIDTHS["passed"]), terms.constant(64, 0)
        since = terms.ite(waits, terms.add(waited, passed), zero)
        asked = terms.or_(waits, terms.and_(trigger, terms.not_(before)))
        open_ = terms.and_(asked, terms.not_(answer))
        summary.signals[passed] = ("passed", 0)
        summary.initial |= {before: terms.false, waits: terms.false, waited: zero}
        summary.next |= {before: trigger, waits: open_, waited: terms.ite(open_, since, zero)}
        limit = terms.constant(64, self.question.within_ns)
        next_one = terms.add(since, terms.constant(64, self.limits.cycle_ns))  # begins then at the earliest
        comes_late = terms.and_(asked, terms.less(limit, since, False))
        return terms.or_(comes_late, terms.and_(open_, terms.less(limit, next_one, False)))

    def _kept_rules(self) -> Iterable[Term]:
        """That units keep their rules.  Adds to the state the words as the program left them in the scan before."""
        terms, summary = self.summary.terms, self.summary
        initial = initial_bytes(self.image.initial)
        before, after = dict[Word, Term](), dict[Word, Term]()
        for word in words_of(self.rules):
            offset = offset_of(word)
            before[word] = left = terms.variable(("left", offset), 16)
            after[word] = summary.before.number(offset, 2)
            summary.initial[left] = terms.constant(16, int.from_bytes(initial(offset, 2), "little"))
            summary.next[left] = summary.contents.number(offset, 2)
        return [rule.term(terms, before, after) for rule in self.rules]

    def _types(self) -> Iterable[Term]:
        """What the types of inputs say: enumerations have their members, subranges their limits."""
        terms, names = self.summary.terms, PlaceNames.of(self.image, self.image.layout.areas)
        for variable, cell in self.summary.inputs.items():
            place = names.at(cell.offset) if cell.width else None
            if place is None or place.offset != cell.offset or place.type.size != cell.size:
                continue
            kind = base(place.type)
            if isinstance(kind, EnumType):
                yield terms.any_of(*(terms.eq(variable, terms.constant(cell.width, value)) for value in kind.shown))
            elif isinstance(place.type, SubrangeType):
                low, high = (terms.constant(cell.width, limit) for limit in (place.type.low, place.type.high))
                sign = place.type.low < 0
                yield terms.and_(terms.less(low, variable, sign, True), terms.less(variable, high, sign, True))

    # --- the answer

    def answer(self) -> Verdict:
        """Tries one method after the other, the cheap ones first."""
        self._note_limits()
        shallow, deeper = (min(depth, self.limits.scans) for depth in DEPTHS)
        has_more = len(self._state()) > FEW_STATE or self.question.kind == WITHIN
        methods: list[Callable[[], Verdict | None]] = [
            lambda: self._searched(min(FIRST_SCANS, shallow)),
            lambda: self._induced([], 1),
            self._with_lemmas,
            self._with_copies,
            lambda: self._searched(shallow),
            lambda: self._simulated(min(FIRST_SIMULATED, self.limits.simulated_scans)),
            lambda: self._with_invariants(FEW_STATE),
            lambda: self._simulated(self.limits.simulated_scans) if self.limits.simulated_scans > FIRST_SIMULATED else None,
            lambda: self._searched(deeper),
            lambda: self._induced([], self._deepest()),
            lambda: self._with_invariants(MOST_STATE) if has_more else None,
            lambda: self._searched(self.limits.scans),
        ]
        for method in methods:
            if (found := method()) is not None:
                return self._with_unreached(found) if found.word in (PROVED, UNREACHABLE) else found
        return self._undecided()

    def _with_unreached(self, verdict: Verdict) -> Verdict:
        """A proof with the scans and the statements of which it says nothing."""
        if self.question.assumptions and (most := self.search.longest_run(DEPTHS[-1])) is not None:
            ends = f"{self._why_runs_end()} {_scans(most)}: nothing is said of later ones"
            verdict = replace(verdict, notes=(*verdict.notes, ends))
        self.tell("looking for statements that no run reaches")
        sites = unreached(self.summary, self.goal, self.clock, DEPTHS[-1], self.limits.expired)
        if not sites:
            return verdict
        lines = dict.fromkeys(f"{self.image.sites[site].file}:{self.image.sites[site].line}" for site in sites)
        some = ", ".join([*lines][:MOST_LINES]) + (f" and {len(lines) - MOST_LINES} more" if len(lines) > MOST_LINES else "")
        return replace(verdict, notes=(*verdict.notes, f"no run of {DEPTHS[-1]} scans executes {some}"))

    def _why_runs_end(self) -> str:
        """The beginning of a sentence that ends with the number of scans after which no run is left."""
        if self.question.assumptions:
            return "no run keeps the assumptions, or does not trap, for longer than"
        return "each run ends in a trap (--no-trap shows one) within"

    def _undecided(self) -> Verdict:
        cleared = self.search.cleared
        if self.search.cleared >= self.limits.scans:
            how = f"no run of {cleared} scans gets there, and no proof was found that none ever does"
        elif cleared:
            how = f"the time is over: no run of {_scans(cleared)} gets there"
        else:
            how = "the time is over, and no scan has been searched to its end"
        return self._verdict(UNDECIDED, how)

    def _verdict(self, word: str, how: str, run: Run | None = None) -> Verdict:
        return Verdict(self.question, word, how, self.search.cleared, run, self.judge.places, tuple(self.notes))

    def _note_limits(self) -> None:
        """Notes what makes an answer worth less: variables that never change, operations of which nothing is known."""
        is_about_writes = self.question.kind == WRITTEN_ONCE
        if is_about_writes and not self.summary.writes.conditions:
            self.notes.append(f"no statement writes {self.question.text}")
        for place in () if is_about_writes else self._constants():
            self.notes.append(f"{place.name} has the same value in every scan: it is no input, and no code changes it")
        if found := self._unknowns():
            self.notes.append(f"taken for any value: {', '.join(found)}")
        if self.clock.is_free:
            self.notes.append(f"time between two scans: {show_cycle(self.clock.cycle_ns, self.clock.longest_ns)}")
        for unit, socket in self.question.units:
            self.notes.append(f"assumed: what the manuals say of socket {socket} of ETN21 {unit}")
        if self.question.assumptions:
            self.notes.append(f"assumed: {'; '.join(self.question.assumptions)}")

    def _constants(self) -> list[Place]:
        """The variables in the property that nothing can change."""
        return [place for place in self.judge.places if place_term(self.summary.contents, place).is_constant]

    def _unknowns(self) -> list[str]:
        """Operations of which nothing is known and on which the answer depends, with their places."""
        depends = cone(self.summary.next, self.goal.terms)
        wanted = [*self.goal.terms, *(self.summary.next[variable] for variable in depends)]
        if not any(leaf.op == "unknown" for leaf in leaves(wanted)):
            return []
        return [f"{what} ({self.image.sites[site]})" if site >= 0 else what for what, site in self.summary.unknowns.items()] or \
            ["comparisons of REAL"]  # fmt: skip

    # --- methods

    def _simulated(self, scans: int) -> Verdict | None:
        """Random runs of so many scans; what they find is made shorter on the engine, and then by the solver."""
        self.tell("trying random inputs")
        for found in simulated(self.machine, self.judge, self.inputs, scans, self.limits.seed):
            if found is not None:
                inputs = shortened(self.machine, self.judge, found.inputs, self.limits.expired)
                self.tell(f"a random run gets there after {_scans(len(inputs))}: looking for the shortest")
                return self._searched(min(len(inputs), self.limits.scans)) or self._met(inputs, False)
            if self.limits.expired():
                break
        return None

    def _searched(self, scans: int) -> Verdict | None:
        self.tell(f"searching {scans} scans")
        inputs = self.search.until(scans)
        if inputs is not None:
            return self._met(inputs, self.search.is_shortest)
        if self.search.cleared and self.search.all_runs_end():
            raise Refused(f"{self._why_runs_end()} {_scans(self.search.cleared)}: there is nothing to prove")
        return None

    def _met(self, inputs: Inputs, is_shortest: bool) -> Verdict:
        """The verdict about a run that gets to the goal, which the engine has to confirm."""
        run = replayed(self.machine, self.judge, inputs, is_shortest)
        if run is not None:
            word = REACHED if self.question.is_reach else BROKEN
            how = "the shortest run" if is_shortest else "a run that may not be the shortest"
            return self._verdict(word, f"after {_scans(run.scans)}, by {how}", run)
        if self.unwound:
            site = self.image.sites[self.unwound[0].site]
            return self._verdict(UNDECIDED, f"a loop goes on for longer than it can be followed ({site})")
        if self._unknowns():
            how = f"a run of {len(inputs)} scans may get there, but does not on the engine: it depends on values of which the " \
                  "solver knows nothing"  # fmt: skip
            return self._verdict(UNDECIDED, how)
        raise SpuriousRun(f"the solver's run of {len(inputs)} scans does not do on the engine what the solver says; this is a "
                          f"defect of the encoding, not of the program (image {self.image.fingerprint})")  # fmt: skip

    def _induced(self, found: Sequence[Guess], most: int) -> Verdict | None:
        """k-induction up to a depth, which the bounded search has cleared."""
        facts = facts_of(self.summary, found, self.clock)
        induction = Induction(self.summary, self.whole(self.goal), self.clock, self.limits.expired, facts)
        while induction.depth <= min(most, self.search.cleared - 1) and not self.limits.expired():
            if induction.step() == UNSAT:
                how = f"by induction over {induction.depth + 1} scan{'s' * (induction.depth > 0)}"
                if found:
                    how += f" with {len(found)} invariant{'s' * (len(found) > 1)}"
                return self._verdict(UNREACHABLE if self.question.is_reach else PROVED, how)
        return None

    def whole(self, goal: Goal) -> Goal:
        """A goal with loops that were not followed to their end as part of it: nothing is known of the scans behind."""
        terms = self.summary.terms
        return replace(goal, hit=terms.or_(goal.hit, terms.any_of(*(trap.condition for trap in self.unwound))))

    def _state(self) -> list[Term]:
        """The variables of the state on which the answer depends, the nearest first."""
        return [variable for variable in distances(self.summary.next, self.goal.terms) if variable in self.summary.cells]

    def _with_invariants(self, most: int) -> Verdict | None:
        """Induction with invariants of so many variables that are guessed."""
        state = self._state()[:most]
        if not state or self.limits.expired():
            return None
        self.tell(f"guessing invariants of {len(state)} variables")
        cells = {variable: self.summary.cells[variable] for variable in state}
        samples = sampled(self.machine, self.judge, self.inputs, cells, SAMPLED_SCANS, self.limits.seed)
        if not samples:
            return None
        found = guesses(state, samples)
        self.tell(f"trying {len(found)} invariants")
        invariants = Invariants(self.summary, state, self.goal.stop, self.goal.given, self.clock, self.limits.expired)
        kept = invariants.kept(found)
        if kept is not None and (doubted := {guess for guess in found if isinstance(guess, Literal)} - {*kept}):
            # what a scan has broken only behind a state of the doubted may hold with the clauses that exclude this state
            kept = invariants.kept([guess for guess in guesses(state, samples, doubted) if guess not in doubted])
        return self._induced(kept, self._deepest()) if kept else None

    def _with_lemmas(self) -> Verdict | None:
        """Induction with the lemmas that somebody has given, as far as no scan breaks them."""
        if not self.lemmas or self.limits.expired():
            return None
        self.tell("proving the lemmas")
        kept = self._kept([*self.lemmas])
        if kept is None:
            return None
        self.notes += [f"no help, because a scan may break it: {text}" for lemma, text in self.lemmas.items()
                       if text and lemma not in kept]  # fmt: skip
        return self._induced(kept, MOST_INDUCTION) if kept else None

    def _kept(self, found: Sequence[Guess]) -> list[Guess] | None:
        """What of some guesses about any variables holds behind every scan; None if the time is over."""
        return Invariants(self.summary, [*self.summary.cells], self.goal.stop, self.goal.given, self.clock,
                          self.limits.expired).kept(found)  # fmt: skip

    def _with_copies(self) -> Verdict | None:
        """Induction with the same property of what the variables of the property are copied from."""
        found = [*copied(self.summary, self.condition)]
        if not found or self.limits.expired():
            return None
        self.tell("trying the property of what was copied")
        kept = self._kept(found)
        return self._induced(kept, MOST_INDUCTION) if kept else None

    def _deepest(self) -> int:
        """The scans that induction looks back: those in which an answer is awaited, if there are not too many."""
        awaited = self.question.within_ns // self.limits.cycle_ns + 2 if self.question.kind == WITHIN else 0
        return max(MOST_INDUCTION, min(awaited, DEPTHS[-1]))


class SpuriousRun(Exception):
    """A run of the solver that the engine does not do: a defect of fbvm."""


def _scans(count: int) -> str:
    return f"{count} scan{'s' if count > 1 else ''}"
