"""Hit counts: at which passes of a breakpoint a run stops."""

from __future__ import annotations

import re
from collections.abc import Callable

from fbvm.base.digits import whole_number

_FORM = re.compile(r"\s*(=|==|>=|>|%)?\s*(\d+)\s*")
_TESTS: dict[str, Callable[[int, int], bool]] = {
    "=": lambda passes, number: passes == number,
    ">=": lambda passes, number: passes >= number,
    ">": lambda passes, number: passes > number,
    "%": lambda passes, number: passes % number == 0,
}


def parse_passes(text: str) -> Callable[[int], bool] | None:
    """A function that says of the number of a pass, from 1 on, whether a run stops there; None for an empty text.

    `5` and `= 5` are the fifth pass, `>= 5` and `> 5` those from there on, `% 5` each fifth.  Raises ValueError for another text.

    >>> [passes for passes in range(1, 12) if parse_passes("% 5")(passes)]
    [5, 10]
    """
    if not text.strip():
        return None
    match = _FORM.fullmatch(text)
    if match is None or whole_number(match[2]) == 0:
        raise ValueError(f"{text!r} is no hit count; write 5, = 5, >= 5, > 5 or % 5")
    test, number = _TESTS[(match[1] or "=").replace("==", "=")], whole_number(match[2])
    return lambda passes: test(passes, number)
