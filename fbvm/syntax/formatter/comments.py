"""Comments and pragmas of a text, each at the token where it belongs, and the blank lines between tokens."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fbvm.syntax.st.comments import comment_end
from fbvm.syntax.st.lexer import Token

TAB = 4
BESIDE = "  "
"""Between a pragma and the comment behind it."""
_OPENING = re.compile(r"//[^\n]*|\(\*|/\*|\{")


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment or pragma.  `column` is its column in the source; `own` says that it has lines of its own, `blank` that an
    empty line stands before it."""

    text: str
    column: int
    own: bool
    blank: bool

    @property
    def to_line_end(self) -> bool:
        return self.text.startswith("//") or f"}}{BESIDE}//" in self.text


class Comments:
    """All comments of a text.

    `ahead` has those in front of the token that starts at a place: on lines of their own, or on its line.  `behind` has
    those that stand behind the token that ends at a place and are the last on its line."""

    def __init__(self, text: str, tokens: Sequence[Token]) -> None:
        self.text = text
        self.ahead: dict[int, list[Comment]] = {}
        self.behind: dict[int, list[Comment]] = {}
        self.blanks: set[int] = set()
        """Starts of tokens in front of which, and behind their last comment, a line is empty."""
        self.end_before: dict[int, int] = {}
        """Start of a token -> end of the one before it."""
        self.start_after: dict[int, int] = {}
        self._column = (0, 0)
        """The place whose column was asked for last, and that column."""
        end = 0
        for token in tokens:
            self.end_before[token.start] = end
            self.start_after[end] = token.start
            if token.start - end > 1 or token.type == "$END":
                self._between(end, token.start, token.type == "$END")
            end = token.end

    def _between(self, start: int, end: int, last: bool) -> None:
        """Assign the comments between two tokens to one of them."""
        found = list(_comments(self.text, start, end))
        gap = found[-1][1] if found else start
        if self.text.count("\n", gap, end) > 1:
            self.blanks.add(end)
        if not found:
            return
        gaps = [self.text.count("\n", before, here) for before, here in zip(
            [start, *(stop for _, stop in found)], [*(begin for begin, _ in found), end], strict=True)]
        first_end, last_end = _ends(gaps)
        ahead: list[Comment] = []
        behind: list[Comment] = []
        for at, (begin, stop) in enumerate(found):
            ended = last or last_end > at
            if ahead and ahead[-1].own and ahead[-1].text[0] == "{" and not gaps[at] and self.text.startswith("//", begin):
                ahead[-1] = replace(ahead[-1], text=f"{ahead[-1].text}{BESIDE}{self.text[begin:stop].rstrip()}")
                continue
            if first_end > at and start and ended:
                behind.append(self._comment(begin, stop, own=False, blank=False))
            else:
                ahead.append(self._comment(begin, stop, own=ended, blank=gaps[at] > 1))
        if ahead:
            self.ahead[end] = ahead
        if behind:
            self.behind[start] = behind

    def _comment(self, start: int, end: int, own: bool, blank: bool) -> Comment:
        lines = self.text[start:end].split("\n")
        return Comment("\n".join(line.rstrip() for line in lines), self.column(start), own, blank)

    def column(self, at: int) -> int:
        """Column of a place, from 0; a tab goes to the next multiple of TAB.  Places on one line are asked for in their order."""
        known, column = self._column if self._column[0] <= at else (0, 0)
        start = self.text.rfind("\n", known, at) + 1
        if start:
            known, column = start, 0
        over = " " * (column % TAB)
        self._column = at, column - len(over) + len((over + self.text[known:at]).expandtabs(TAB))
        return self._column[1]

    # --- moving ---

    def claim(self, start: int) -> list[Comment]:
        """Take the comments on lines of their own in front of a token away from the token."""
        ahead = self.ahead.pop(start, [])
        count = next((at for at, comment in enumerate(ahead) if not comment.own), len(ahead))
        if ahead[count:]:
            self.ahead[start] = ahead[count:]
        return ahead[:count]

    def draw(self, token: Token, always: bool = False) -> None:
        """Let comments that part a token from the one before it by a line end stand behind it, as with `x // comment`
        in front of `;`; or any comments, if `always`."""
        before = self.end_before[token.start]
        ahead = self.ahead.get(token.start, [])
        if before in self.behind or any(comment.own for comment in ahead) or (always and ahead):
            self.ahead.pop(token.start, None)
            self._set_behind(token.end, [*self.behind.pop(before, []), *ahead, *self.behind.pop(token.end, [])])

    def _set_behind(self, end: int, comments: list[Comment]) -> None:
        """Put comments behind a token, up to the first that reaches to the end of the line."""
        count = next((at + 1 for at, comment in enumerate(comments) if comment.to_line_end), len(comments))
        self.behind[end] = [replace(comment, own=False) for comment in comments[:count]]
        if rest := [replace(comment, own=True, blank=False) for comment in comments[count:]]:
            after = self.start_after[end]
            self.ahead[after] = rest + self.ahead.get(after, [])

    def lift(self, token: Token) -> None:
        """Let comments between an operator and its right operand stand in front of the operator."""
        before, after = self.end_before[token.start], self.start_after[token.end]
        if behind := self.behind.pop(token.end, None):
            if token.start in self.ahead or any(c.to_line_end for c in self.behind.get(before, ())):
                self.ahead.setdefault(token.start, []).extend(replace(c, own=True) for c in behind)
            else:
                self.behind.setdefault(before, []).extend(behind)
        if own := self.claim(after):
            inline = self.ahead.get(token.start, [])
            self.ahead[token.start] = [replace(c, own=True) for c in inline] + own


def _comments(text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Start and end of each comment and pragma between two tokens."""
    at = start
    while found := _OPENING.search(text, at, end):
        at = found.end()
        if found[0] == "{":
            at = text.index("}}", at) + 2 if text.startswith("{{", found.start()) else text.index("}", at) + 1
        elif not found[0].startswith("//"):
            at, _ = comment_end(text, found.start())
        yield found.start(), at


def _ends(gaps: Sequence[int]) -> tuple[int, int]:
    """The first and the last of the gaps that have a line end; of none, that behind the last and the first."""
    parted = [at for at, count in enumerate(gaps) if count]
    return (parted[0], parted[-1]) if parted else (len(gaps), 0)
