"""Statements that no run reaches: what is proved of a program says nothing about them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from fbvm.base.data import data_folder
from fbvm.code.image import Image
from fbvm.code.operations import CALLS
from fbvm.code.shapes import statements
from fbvm.prove.bounded import Goal
from fbvm.prove.encoding.clocks import Clock
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.invariants import balanced
from fbvm.prove.solver import UNKNOWN, UNSAT, Solver
from fbvm.prove.unrolling import from_power_on

STEPS = (1, 4, 16, 64)
"""Scans after which the solver is asked."""


def unreached(summary: Summary, goal: Goal, clock: Clock, scans: int, expired: Callable[[], bool]) -> list[int]:
    """The sites of the user's statements that no run of so many scans reaches, in the order of the source."""
    image, terms = summary.image, summary.terms
    own = own_files(image)
    met = {site: term for site, term in summary.reached.items() if image.sites[site].file in own}
    missing = {site for site, term in met.items() if term is terms.false}
    missing |= {site for site in _never_called(summary) if image.sites[site].file in own}
    missing |= set(_unmet(summary, goal, clock, [site for site, term in met.items() if not term.is_constant], scans, expired))
    return sorted(missing, key=lambda site: (image.sites[site].file, image.sites[site].line))


def _unmet(summary: Summary, goal: Goal, clock: Clock, sites: list[int], scans: int,
           expired: Callable[[], bool]) -> list[int]:  # fmt: skip
    """The sites of some that no run of so many scans reaches; none if the time is over before that is known."""
    terms = summary.terms
    unrolling = from_power_on(summary, [goal.stop, goal.given, *(summary.reached[site] for site in sites)], clock)
    solver = Solver(expired)
    waiting = dict.fromkeys(sites)
    done = 0
    for depth in (step for step in STEPS if step <= scans):
        goals = dict.fromkeys(waiting, terms.false)
        for number in range(done, depth):
            _, given, *found = unrolling.scan(number)
            solver.assume(given)
            for site, term in zip(sites, found, strict=True):
                if site in waiting:
                    goals[site] = terms.or_(goals[site], term)
        done = depth
        while goals and (answer := solver.ask(balanced(terms, list(goals.values())))) != UNSAT:
            if answer == UNKNOWN:
                return []
            values = solver.values(set(goals.values()))
            met = [site for site, term in goals.items() if values[term]]
            for site in met:
                del goals[site], waiting[site]
    return list(waiting)


def own_files(image: Image) -> set[str]:
    """The files that are no part of a shipped library."""
    library = data_folder("fblib")
    names = {site.file for site in image.sites}
    return {name for name in names if Path(name).is_absolute() or not (library / name).is_file()}


def _called(image: Image) -> set[int]:
    """The numbers of the bodies that programs call, or would on paths that are impossible."""
    found: set[int] = set()
    waiting = [run.body for task in image.tasks for run in task.programs]
    while waiting:
        number = waiting.pop()
        if number not in found:
            found.add(number)
            waiting += [node[1] for node in statements(image.bodies[number].code) if node[0] in CALLS]
    return found


def _never_called(summary: Summary) -> Iterable[int]:
    """The sites of statements at which the execution never came by, not even on a path that is impossible."""
    for number in _called(summary.image):
        for node in statements(summary.image.bodies[number].code):
            if node[0] == "observe" and node[1] in ("statement", "rung") and node[2] not in summary.reached:
                yield node[2]
