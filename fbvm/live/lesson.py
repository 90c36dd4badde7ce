"""A lesson beside its PLC: the text, predictions, and what a check says.  What a lesson is, is handed in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fbvm.live.messages import MessageError

TRIES = 3
"""So often a learner has tried before the page offers the solution by itself."""


@dataclass
class LiveLesson:
    """The lesson of a page.

    `questions` returns what is to be predicted: name, question, and the answer so far.  `predict` keeps answers, and returns what
    is wrong with them, "" for nothing; `check` returns what the program does not do yet, in sentences; `solution` is a text."""

    title: str
    text: str
    questions: Callable[[], Sequence[tuple[str, str, str]]]
    predict: Callable[[Mapping[str, str]], str]
    check: Callable[[], Sequence[str]]
    solution: Callable[[], str]
    tries: int = 0
    is_predicted: bool = False

    def about(self) -> dict[str, Any]:
        """As pages are told."""
        return {"title": self.title, "text": self.text, "questions": [list(one) for one in self.questions()],
                "predicted": self.is_predicted, "tries_left": max(0, TRIES - self.tries)}  # fmt: skip

    def take_prediction(self, names: Sequence[str], values: Sequence[str]) -> dict[str, Any]:
        """Keeps answers and says whether they are right; what is empty is not wrong, and no try."""
        known = {name for name, _, _ in self.questions()}
        if len(names) != len(values) or not set(names) <= known:
            raise MessageError(f"a prediction has one value for each of {', '.join(sorted(known))}")
        if empty := [name for name, value in zip(names, values, strict=True) if not value.strip()]:
            return {"mistake": f"{empty[0]} is still empty; predict first", "tries_left": max(0, TRIES - self.tries)}
        mistake = self.predict(dict(zip(names, values, strict=True)))
        self.is_predicted = not mistake
        self.tries += bool(mistake)
        return {"mistake": mistake, "tries_left": max(0, TRIES - self.tries)}

    def take_check(self) -> dict[str, Any]:
        """Checks the program; the prediction goes before it."""
        if not self.is_predicted:
            raise MessageError("predict first: the program is checked when the prediction is right")
        mistakes = list(self.check())
        self.tries += bool(mistakes)
        return {"mistakes": mistakes, "tries_left": max(0, TRIES - self.tries)}
