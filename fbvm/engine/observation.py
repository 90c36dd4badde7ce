"""What an observed run tells, one observation after the other."""

from __future__ import annotations

from typing import Any, NamedTuple

NO_SITE = -1
"""In place of a site: no statement is the cause."""


class Observation(NamedTuple):
    """What an observed run reports.

    `kind` and `site` are those of the operation `observe`; `detail` is evaluated: (type, byte of the memory, bit) for read and
    write, (element, BOOL) for contact.  Two more kinds report that a body begins ("call") and has ended ("return"): `site` is
    the statement that calls, NO_SITE for a program, and `detail` (number of the body, byte at which its instance begins).
    After a trap no "return" is reported.  The last one may be "cut": the task did more, of which nothing is told."""

    kind: str
    site: int
    detail: Any
