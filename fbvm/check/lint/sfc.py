"""Warnings about sequential function charts: what is never reached, what may be entered twice, times that contradict.

Which steps can be active together is found by trying every transition in every situation that is reached, whatever the
conditions are; in charts with very many situations only the links are followed."""

from __future__ import annotations

from collections import deque
from itertools import combinations

from fbvm.base.types import fold
from fbvm.check.lint.body import Body
from fbvm.syntax.sfc.rules import networks
from fbvm.syntax.tree import sfc

MOST = 5000
"""Situations of one network that are looked at."""
Situation = frozenset[str]
"""The steps that are active, by folded name."""


def look_at(body: Body, chart: sfc.Sfc) -> None:
    """Warn of all networks of a chart."""
    for steps, transitions in networks(chart.steps, chart.transitions):
        _Network(body, steps, transitions).warn()


class _Network:
    def __init__(self, body: Body, steps: list[sfc.Step], transitions: list[sfc.Transition]) -> None:
        self.body = body
        self.steps = {fold(step.name.text): step for step in steps}
        self.transitions = transitions
        self.before = [frozenset(fold(name.text) for name in one.sources) for one in transitions]
        self.behind = [frozenset(fold(name.text) for name in one.targets) for one in transitions]
        self.tried: set[int] = set()
        """Transitions that can be enabled."""
        self.doubled: tuple[int, str] | None = None
        """The first transition that can enter a step which is active, and that step."""
        self.reached: set[str] = set()

    def warn(self) -> None:
        """Try every situation, and warn."""
        situations = self._situations()
        if situations is None:
            self._follow_links()
            situations = set()
        if self.doubled:
            number, name = self.doubled
            step = self.steps[name]
            self.body.warn("S0598", self.transitions[number], f"{step.name.text} may be entered here while it is active",
                           "begin sequences that run at once with one transition TO (a, b), and end all of them with one "
                           "FROM (a, b)", self.body.there(step, f"{step.name.text} stands here"))
        for name, step in self.steps.items():
            if name not in self.reached:
                self.body.warn("S0597", step.name, f"{step.name.text} is never active: no way leads to it", "")
        for number, one in enumerate(self.transitions):
            if number not in self.tried and self.before[number] <= self.reached:
                names = " and ".join(name.text for name in one.sources)
                self.body.warn("S0597", one, f"this never fires: {names} are never active together",
                               "FROM (a, b) waits for sequences that were begun together; of sequences that exclude each "
                               "other each ends with a transition of its own")
        self._times(situations)

    def _situations(self) -> set[Situation] | None:
        """All situations that can be reached; None if there are more than MOST."""
        first = frozenset(name for name, step in self.steps.items() if step.initial)
        found, left = {first}, deque([first])
        while left:
            now = left.popleft()
            self.reached |= now
            for number, before in enumerate(self.before):
                if not before <= now:
                    continue
                self.tried.add(number)
                rest = now - before
                if self.doubled is None and rest & self.behind[number]:
                    self.doubled = number, min(rest & self.behind[number])
                following = rest | self.behind[number]
                if following not in found:
                    if len(found) >= MOST:
                        return None
                    found.add(following)
                    left.append(following)
        return found

    def _follow_links(self) -> None:
        """Fill the reached steps as if a transition needed only one of its steps to be active."""
        grown = True
        while grown:
            grown = False
            for number, before in enumerate(self.before):
                if number not in self.tried and before & self.reached:
                    self.tried.add(number)
                    self.reached |= self.behind[number]
                    grown = True

    def _times(self, situations: set[Situation]) -> None:
        """Warn of two times for one stored action at once, an error by the standard; here the time of the upper step counts."""
        used: dict[tuple[str, str], list[tuple[str, sfc.Association]]] = {}
        for name, step in self.steps.items():
            for one in step.associations:
                if one.qualifier in ("SD", "SL") and one.time is not None:
                    used.setdefault((fold(one.action.text), one.qualifier), []).append((name, one))
        for pairs in used.values():
            for (upper, one), (lower, other) in combinations(pairs, 2):
                assert one.time is not None and other.time is not None
                differ = self.body.facts.constants.get(one.time) != self.body.facts.constants.get(other.time)
                if differ and any({upper, lower} <= situation for situation in situations):
                    self.body.warn("S0599", other, f"{other.action.text} has another time in {self.steps[upper].name.text}, "
                                   "which may be active at the same time", "the time of the upper one counts",
                                   self.body.there(one, "written here"))
