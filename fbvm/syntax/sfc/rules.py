"""The rules that steps and transitions must keep to be a chart: every name exists once, each network has one initial step.

`check/lint/sfc.py` warns of what is allowed and hardly meant, such as steps that nothing reaches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from difflib import get_close_matches

from fbvm.base.types import fold
from fbvm.syntax.tree import Name
from fbvm.syntax.tree.sfc import Step, Transition

Report = Callable[..., None]


def sound(steps: Sequence[Step], transitions: Sequence[Transition], report: Report) -> bool:
    """Whether the chart can be executed; reports every rule that it breaks."""
    wrong: list[bool] = []

    def tell(code: str, name: Name, message: str, hint: str = "") -> None:
        wrong.append(True)
        report(code, name.start, name.end, message, hint)

    known: dict[str, Step] = {}
    for step in steps:
        if fold(step.name.text) in known:
            tell("S0202", step.name, f"the step {step.name.text} is declared twice", "every step has a name of its own")
        known.setdefault(fold(step.name.text), step)
    _names(transitions, known, tell)
    if not wrong:
        _initial(steps, transitions, tell)
    return not wrong


def _names(transitions: Iterable[Transition], known: dict[str, Step], tell: Callable[..., None]) -> None:
    """Check that every step that a transition names exists, and is named once on each side."""
    for transition in transitions:
        for side, names in (("FROM", transition.sources), ("TO", transition.targets)):
            seen: set[str] = set()
            for name in names:
                if fold(name.text) not in known:
                    close = get_close_matches(fold(name.text), known, 1)
                    hint = f"did you mean {known[close[0]].name.text}?" if close else f"declare it: STEP {name.text}: END_STEP"
                    tell("S0201", name, f"there is no step {name.text}", hint)
                elif fold(name.text) in seen:
                    tell("S0111", name, f"{name.text} stands twice behind {side}", "")
                seen.add(fold(name.text))


def networks(steps: Sequence[Step], transitions: Iterable[Transition]) -> list[tuple[list[Step], list[Transition]]]:
    """Groups of steps and transitions that are connected, each in the order of writing."""
    known = {fold(step.name.text): position for position, step in enumerate(steps)}
    number = list(range(len(steps)))
    joined = [(one, {known[fold(name.text)] for name in (*one.sources, *one.targets)}) for one in transitions]
    for _, together in joined:
        old = {number[position] for position in together}
        number = [min(old) if each in old else each for each in number]
    found: dict[int, tuple[list[Step], list[Transition]]] = {}
    for position, step in enumerate(steps):
        found.setdefault(number[position], ([], []))[0].append(step)
    for one, together in joined:
        found[number[min(together)]][1].append(one)
    return list(found.values())


def _initial(steps: Sequence[Step], transitions: Iterable[Transition], tell: Callable[..., None]) -> None:
    """Check that each network has one initial step."""
    for connected, _ in networks(steps, transitions):
        begins = [step for step in connected if step.initial]
        for step in begins[1:]:
            tell("S0111", step.name, f"{step.name.text} is a second initial step beside {begins[0].name.text}",
                 "a network begins with one step; begin several at once with a transition TO (a, b)")
        if not begins:
            name = connected[0].name
            alone = len(connected) == len(steps)
            tell("S0111", name, "there is no initial step" if alone else f"no initial step leads to {name.text}",
                 "write INITIAL_STEP in place of STEP where the chart begins")
