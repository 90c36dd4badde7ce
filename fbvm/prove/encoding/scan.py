"""One scan as a whole: what the machine writes before the program, the inputs, and the tasks that are due.

What the machine says of time and tasks is asked of a `Signals`: constants where the cycle is fixed, variables elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from fbvm.base.areas import AREAS
from fbvm.code.image import Image, TaskRow
from fbvm.machine.scan.clock_words import (
    ALWAYS_ON,
    CYCLE_TIME,
    FIRST_CYCLE,
    FIRST_TASK_CYCLE,
    FREE_COUNTERS,
    MAX_CYCLE_TIME,
    PERIODS_NS,
)
from fbvm.prove.encoding.cells import Contents
from fbvm.prove.encoding.execution import Execution, State, Trapped
from fbvm.prove.encoding.expressions import EXPRESSION_ROWS
from fbvm.prove.encoding.statements import STATEMENT_ROWS, call
from fbvm.prove.encoding.terms import Term
from fbvm.watch.paths import Place, find_place

Signal = tuple[str, int]
"""What the machine tells a scan: a kind and a number.

now 0: time in ns; passed 0: time since the scan before; first 0: the first scan; pulse N: clock pulse CFN; counter N: free
counter AN; cycle 0 and 1: cycle time and the longest one, in 0.1 ms; grid N: the interval of task N has passed; level N: what
SINGLE of task N was in the scan before; fresh N: task N has not been executed yet."""
WIDTHS = {"now": 64, "passed": 64, "first": 0, "pulse": 0, "counter": 16, "cycle": 32, "grid": 0, "level": 0, "fresh": 0}
Signals = Callable[[Signal], Term]


@dataclass
class Scanned:
    """What a scan came to: what memory holds, when it traps, which statements it reaches, and the levels of tasks behind it.

    `ended` is the trap that ended it on every path."""

    contents: Contents
    execution: Execution
    following: dict[Signal, Term]
    ended: Trapped | None = None


def scan(image: Image, contents: Contents, signals: Signals, budget: int, watched: Sequence[range] = ()) -> Scanned:
    """Executes one scan over `contents`, which holds its inputs already.

    `watched` are bits of which it is noted who writes them."""
    terms = contents.terms
    _write_clock(contents, signals)
    x = Execution(image, terms, signals(("now", 0)), budget, EXPRESSION_ROWS, STATEMENT_ROWS, watched)
    state = State(contents, terms.true)
    following: dict[Signal, Term] = {}
    due = [(number, _due(image, contents, number, task, signals, following)) for number, task in by_priority(image.tasks)]
    some_fresh = terms.any_of(*(_fresh(number, task, signals) for number, task in enumerate(image.tasks)))
    try:
        for number, condition in due:
            _run_task(x, state, number, condition, some_fresh, signals, following)
    except Trapped as trapped:
        return Scanned(state.contents, x, following, trapped)
    return Scanned(state.contents, x, following)


def by_priority(tasks: tuple[TaskRow, ...]) -> Iterator[tuple[int, TaskRow]]:
    """The tasks in the order in which they run, with their numbers."""
    return ((number, tasks[number]) for number in sorted(range(len(tasks)), key=lambda number: tasks[number].priority))


def _run_task(x: Execution, state: State, number: int, due: Term, some_fresh: Term, signals: Signals,
              following: dict[Signal, Term]) -> None:  # fmt: skip
    terms, task = x.terms, x.image.tasks[number]
    if due is terms.false:
        return
    fresh = _fresh(number, task, signals)
    inner = state if due is terms.true else state.child(due)
    word, bit = FIRST_TASK_CYCLE
    _flag(inner.contents, word, bit, fresh, some_fresh)
    for run in task.programs:
        x.site = -1
        call(x, inner, x.image.bodies[run.body], run.offset)
    if inner is not state:
        path, state.path = state.path, due
        state.join([inner, state.child(path)], [due, terms.not_(due)])
        state.path = path
    if task.single:
        following["fresh", number] = terms.and_(fresh, terms.not_(due))


def _fresh(number: int, task: TaskRow, signals: Signals) -> Term:
    return signals(("fresh", number)) if task.single else signals(("first", 0))


def _due(image: Image, contents: Contents, number: int, task: TaskRow, signals: Signals,
         following: dict[Signal, Term]) -> Term:  # fmt: skip
    """Whether a task runs in this scan, as `TaskSchedule` has it."""
    terms = contents.terms
    if not task.single:
        return signals(("grid", number)) if task.interval_ns else terms.true
    level = read_bool(contents, find_place(image.symbols, image.layout.areas, task.single))
    edge = terms.and_(level, terms.not_(signals(("level", number))))
    following["level", number] = level
    if not task.interval_ns:
        return edge
    return terms.or_(edge, terms.and_(signals(("grid", number)), terms.not_(level)))


def read_bool(contents: Contents, place: Place) -> Term:
    """The BOOL at a place that no reference leads to."""
    return contents.boolean(place.offset) if place.bit is None else contents.bit(place.offset, place.bit)


# --- what the machine writes ------------------------------------------------------------------------------------------


def _write_clock(contents: Contents, signals: Signals) -> None:
    """What `ClockWords.update` writes, where the program uses it."""
    terms, flags = contents.terms, AREAS["CF"].offset
    for number in PERIODS_NS:
        if flags + number // 8 in contents.partition.at:
            on = terms.true if number == ALWAYS_ON else signals(("pulse", number))
            contents.write_bit(flags + number // 8, number % 8, on, terms.true)
    _flag(contents, *FIRST_CYCLE, signals(("first", 0)), terms.true)
    _flag(contents, *FIRST_TASK_CYCLE, terms.false, terms.true)
    for word, _ in FREE_COUNTERS:
        _word(contents, word, lambda word=word: signals(("counter", word)))  # type: ignore[misc]
    for word, kind in ((CYCLE_TIME, 0), (MAX_CYCLE_TIME, 1)):
        for half in (0, 1):
            _word(contents, word + half, lambda kind=kind, half=half: terms.extract(signals(("cycle", kind)), 16 * half, 16))  # type: ignore[misc]


def _flag(contents: Contents, word: int, bit: int, value: Term, guard: Term) -> None:
    offset = AREAS["A"].offset + 2 * word + bit // 8
    if offset in contents.partition.at:
        contents.write_bit(offset, bit % 8, value, guard)


def _word(contents: Contents, word: int, value: Callable[[], Term]) -> None:
    offset = AREAS["A"].offset + 2 * word
    if offset in contents.partition.at or offset + 1 in contents.partition.at:
        contents.write(offset, 2, value(), contents.terms.true)
