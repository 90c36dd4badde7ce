"""A mutant: a program with one small mistake in it, which the tests of its project should find."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from fbvm.base.diagnostics import Source

KILLED, TIMED_OUT, SURVIVED, EQUAL, INVALID = "killed", "timed out", "survived", "equal", "invalid"
FOUND = (KILLED, TIMED_OUT)
"""The results of mutants that the tests have found."""
COUNTED = (*FOUND, SURVIVED)
"""The results that count: an equal mutant cannot be found, an invalid one is no program."""


@dataclass(frozen=True)
class Change:
    """One change of a source text: `text` stands in place of the characters from `start` to `end`.

    `operator` is the name of the mutation operator, `pou` the POU that is changed."""

    operator: str
    start: int
    end: int
    text: str
    pou: str


@dataclass(frozen=True)
class Mutant:
    """A change of a file.  `number` counts from 1; `file` is relative to the project's folder, with `/` between folders."""

    number: int
    file: str
    line: int
    change: Change

    def applied(self, text: str) -> str:
        """The text of the file with the change in it."""
        return text[: self.change.start] + self.change.text + text[self.change.end :]

    def diff(self, text: str) -> str:
        """The change as a unified diff without context lines."""
        rows = difflib.unified_diff(text.splitlines(), self.applied(text).splitlines(), self.file, self.file, n=0, lineterm="")
        return "\n".join(rows)


@dataclass(frozen=True)
class Tried:
    """What came of a mutant: KILLED, TIMED_OUT, SURVIVED, EQUAL or INVALID.

    `by` is the test that failed first, the proof, or the compiler's first error; "" where nothing is to be said."""

    mutant: Mutant
    result: str
    by: str = ""


def line_of(source: Source, change: Change) -> int:
    """The line in which a change begins, from 1 on."""
    return source.place(change.start)[0]
