"""Which tasks are due in a scan, in the order in which they run.

Tasks never preempt each other.  A task without interval and SINGLE runs in every cycle; with SINGLE it runs once at
each rising edge, and with both also by its interval while SINGLE is FALSE (IEC 61131-3 ed. 3, 6.8.2).  An interval that
was missed is not made up for: the next one counts from the grid of the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from fbvm.base.areas import NEVER
from fbvm.code.image import TaskRow
from fbvm.engine.native.scans.scans import ScheduledTask
from fbvm.watch.values import show_time

UNPLANNED = -1
"""In place of the time of a task that has not been planned yet."""
TaskScheduleState = tuple[dict[int, int], dict[int, bool], frozenset[int]]
"""Next times by task, the last level of SINGLE by task, tasks that have not been executed."""


@dataclass
class TaskSchedule:
    """When each task runs next.  `tasks` are those of the image; `single` tells whether the BOOL of a path is TRUE."""

    tasks: tuple[TaskRow, ...]
    single: Callable[[str], bool]
    _levels: dict[int, bool] = field(default_factory=dict)
    """Of tasks with SINGLE what the BOOL was in the last scan."""
    fresh: set[int] = field(default_factory=set)
    """Tasks that have not been executed since the start."""

    def __post_init__(self) -> None:
        self.fresh.update(range(len(self.tasks)))
        self._order = sorted(range(len(self.tasks)), key=lambda number: self.tasks[number].priority)
        self._entries = [ScheduledTask(number, self.tasks[number].interval_ns, UNPLANNED) for number in self._order]
        self._timed = {entry.task: entry for entry in self._entries if entry.interval_ns}
        self._only_time = not any(task.single for task in self.tasks)
        self._always = self._only_time and not self._timed

    def due(self, now_ns: int) -> list[int]:
        """Numbers of the tasks that run in the scan at `now_ns`, by priority.  Plans the next time of those with an interval."""
        if self._always:
            return self._order
        return [number for number in self._order if self._is_due(number, now_ns)]

    def next_ns(self, now_ns: int) -> int:
        """The earliest time after `now_ns` at which an interval has passed; NEVER if no task has one."""
        if not self._timed:
            return NEVER
        return min((entry.next_ns for entry in self._timed.values() if entry.next_ns > now_ns), default=NEVER)

    def _is_due(self, number: int, now_ns: int) -> bool:
        task = self.tasks[number]
        level = bool(task.single) and self.single(task.single)
        edge = level and not self._levels.get(number, False)
        self._levels[number] = level
        if not task.interval_ns:
            return edge or not task.single
        entry = self._timed[number]
        if entry.next_ns == UNPLANNED:
            entry.next_ns = now_ns
        if now_ns < entry.next_ns:
            return edge
        missed = (now_ns - entry.next_ns) // task.interval_ns
        entry.next_ns += (missed + 1) * task.interval_ns
        return edge or not level

    def by_time(self) -> list[ScheduledTask] | None:
        """The tasks in their order if time alone says when each runs, and each has run once; else None.

        It is the same list each time, with the entries of this schedule: whoever runs the tasks keeps their `next_ns` right."""
        return self._entries if self._only_time and not self.fresh else None

    def reset(self) -> None:
        """As at power-on."""
        for entry in self._entries:
            entry.next_ns = UNPLANNED
        self._levels.clear()
        self.fresh.update(range(len(self.tasks)))

    def state(self) -> TaskScheduleState:
        """What a snapshot keeps."""
        planned = {entry.task: entry.next_ns for entry in self._timed.values() if entry.next_ns != UNPLANNED}
        return planned, dict(self._levels), frozenset(self.fresh)

    def restore(self, state: TaskScheduleState) -> None:
        """Back to a state that `state` gave."""
        for entry in self._timed.values():
            entry.next_ns = state[0].get(entry.task, UNPLANNED)
        self._levels, self.fresh = dict(state[1]), set(state[2])


def too_short_intervals(tasks: tuple[TaskRow, ...], cycle_ns: int) -> Iterator[str]:
    """A warning for each task whose INTERVAL is shorter than the cycle, so that it runs less often than it asks for."""
    for task in tasks:
        if 0 < task.interval_ns < cycle_ns:
            wanted, cycle = show_time(task.interval_ns)[2:], show_time(cycle_ns)[2:]
            yield (f"task {task.name} wants {wanted}, the PLC scans every {cycle}: it runs once a scan, what is between "
                   f"is lost; a cycle of {wanted} gives all")  # fmt: skip
