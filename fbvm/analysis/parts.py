"""A source text in parts, one for each top-level declaration: after a change only the parts that it touches are parsed again.

A part has a `Source` and a tree of its own, with offsets that count from the part's beginning; so a part stays valid when the
text in front of it changes.  Who speaks of places in the whole text adds the part's `base`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.namespaces import Surroundings
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.st.comments import comment_end
from fbvm.syntax.tree.node import walk

_POUS = ("FUNCTION_BLOCK", "FUNCTION", "PROGRAM")
_CUT = (*_POUS, "TYPE", "CONFIGURATION")
"""Words that show, at the beginning of a line, that the END of the declaration in front of them is missing."""
_HOLDS = {"CONFIGURATION": ("PROGRAM",), "CLASS": _CUT, "INTERFACE": _CUT, "NAMESPACE": _CUT}
"""Declarations that hold others: these do not end them."""
_JOINED = ("ACTION", "ACTIONS")
"""Declarations that belong to the POU in front of them, and stay in one part with it."""
_ENDS = {"VAR_GLOBAL": "END_VAR", "VAR_CONFIG": "END_VAR", "VAR_ACCESS": "END_VAR"}
_OPENERS = (*_CUT, *_ENDS, *_JOINED, "CLASS", "INTERFACE", "NAMESPACE")
_MARK = re.compile(
    r"//[^\n]*|(?P<comment>\(\*|/\*)|\{\{(?s:.*?)\}\}|\{[^}]*\}?|'(?:\$.|[^'$\r\n])*'?|\"(?:\$.|[^\"$\r\n])*\"?|"
    r"(?<![\w.#%])(?P<word>LADDER|END_VAR|(?:END_)?(?:" + "|".join(_OPENERS) + r"))\b", re.I)
_END_LADDER = re.compile(r"^[ \t]*END_LADDER\b", re.I | re.M)
_LADDER = re.compile(r"\bLADDER\b", re.I)
_TIMER_SYMBOL = re.compile(r"\bAT\s+%?[TC][0-9]", re.I)
"""A symbol of a timer or counter, which rungs in all later declarations of a text may name."""
_REST_OF_LINE = re.compile(r"[ \t]*;?[ \t]*(?://[^\n]*)?(?:\r?\n)?")


@dataclass(eq=False)
class Part:
    """A piece of a text with at most one POU and its actions."""

    source: Source
    """The text of the part under the name of its file."""
    base: int = field(init=False)
    """Where the part begins in its file, in characters from 0: its file says so, again when text in front of it changes."""

    @cached_property
    def _parsed(self) -> tuple[tree.SourceText, list[Diagnostic]]:
        return parse(self.source)

    def copied(self) -> Part:
        """The same part, with the same tree, which moves apart from this one."""
        other = Part(Source(self.source.name, self.source.text, first_line=self.source.first_line))
        vars(other).update({name: known for name, known in vars(self).items() if name != "source"})
        return other

    @property
    def syntax(self) -> tree.SourceText:
        """What the part declares; parsed at the first use."""
        return self._parsed[0]

    @property
    def mistakes(self) -> list[Diagnostic]:
        """What the parser says about the part, with places that count from its beginning."""
        return self._parsed[1]

    @cached_property
    def nodes(self) -> tuple[tree.Node, ...]:
        """All nodes of the tree, in no order: looking through them is quicker than walking."""
        return tuple(walk(self.syntax.declarations))

    @property
    def pou(self) -> tree.Pou | None:
        """The POU that the part declares, with nothing beside it but its actions; None for any other part."""
        declared = self.syntax.declarations
        first = declared[0] if declared else None
        if isinstance(first, tree.Pou) and all(isinstance(other, tree.Action | tree.Actions) for other in declared[1:]):
            return first
        return None

    @property
    def names_lines(self) -> bool:
        """True if a message about the part says the number of a line."""
        return "_parsed" in vars(self) and any(re.search(r"\bline \d", each.message + each.hint) for each in self.mistakes)


@dataclass(eq=False)
class File:
    """A source file as it is now in the editor, or on disk."""

    name: str
    """The name under which messages show it, and by which lists of global variables are called."""
    text: str
    parts: list[Part] = field(default_factory=list)
    """In the order of the text, which they cover without gaps."""

    def __post_init__(self) -> None:
        self._is_one = True
        text, self.text = self.text, ""
        self.replace(text)

    @property
    def source(self) -> Source:
        """The whole text, for places in it."""
        return self._source

    def replace(self, text: str) -> list[tuple[Part | None, Part | None]]:
        """Take another text.  Returns the parts that differ: before (None: new) and after (None: gone), in pairs."""
        before, old = self.text, self.parts
        self._source = Source(self.name, text)
        self.text = text = self._source.text
        head, tail, cuts = self._changed(before, text) if old and not self._is_one else (0, 0, spans(text))
        again = text[cuts[0][0]:cuts[-1][1]]
        if self._is_one or _LADDER.search(again) or _TIMER_SYMBOL.search(again):
            self._is_one = _is_one(text)
            head, tail, cuts = (0, 0, spans(text)) if self._is_one else (head, tail, cuts)
        gone = old[head:len(old) - tail]
        texts = [text[start:end] for start, end in cuts]
        while gone and texts and gone[0].source.text == texts[0]:
            del gone[0], texts[0]
            head += 1
        while gone and texts and gone[-1].source.text == texts[-1]:
            del gone[-1], texts[-1]
            tail += 1
        return self._exchange(head, tail, gone, texts)

    def _exchange(self, head: int, tail: int, gone: list[Part],
                  texts: list[str]) -> list[tuple[Part | None, Part | None]]:  # fmt: skip
        """Puts parts with some texts in place of those that are gone, between `head` parts in front and `tail` behind.

        Returns the pairs that `replace` does.  Of as many texts as parts, each part whose text is the same stays."""
        kept = {at for at, part in enumerate(gone) if len(gone) == len(texts) and part.source.text == texts[at]}
        between = [gone[at] if at in kept else Part(Source(self.name, part)) for at, part in enumerate(texts)]
        self.parts = [*self.parts[:head], *between, *self.parts[len(self.parts) - tail:]]
        moved = self._place_parts()
        new = [part for at, part in enumerate(self.parts[head:len(self.parts) - tail]) if at not in kept]
        gone = [part for at, part in enumerate(gone) if at not in kept]
        longer = max(len(gone), len(new))
        return moved + list(zip([*gone, *[None] * (longer - len(gone))], [*new, *[None] * (longer - len(new))], strict=True))

    def _changed(self, before: str, text: str) -> tuple[int, int, list[tuple[int, int]]]:
        """How many parts in front and behind have not changed, and the spans of the text between these."""
        same = common_beginning(before, text)
        head = max(0, next((at for at, part in enumerate(self.parts) if part.base + len(part.source.text) >= same),
                           len(self.parts)) - 1)
        added = len(text) - len(before)
        behind = {part.base + added: at for at, part in enumerate(self.parts) if part.base > same}
        untouched = len(text) - common_beginning(before[same:][::-1], text[same:][::-1])
        cuts: list[tuple[int, int]] = []
        for cut in _cuts(text, self.parts[head].base):
            if cut[0] >= untouched and cut[0] in behind and cuts:
                return head, len(self.parts) - behind[cut[0]], cuts
            cuts.append(cut)
        return head, 0, cuts

    def _place_parts(self) -> list[tuple[Part | None, Part | None]]:
        """Tell the parts where they begin.  A part whose messages name lines is made anew if it moves; returns those pairs."""
        made: list[tuple[Part | None, Part | None]] = []
        base, line = 0, 1
        for at, part in enumerate(self.parts):
            if part.source.first_line != line and part.names_lines:
                self.parts[at] = Part(Source(self.name, part.source.text))
                made.append((part, self.parts[at]))
                part = self.parts[at]
            part.base, part.source.first_line = base, line
            base, line = base + len(part.source.text), line + len(part.source.line_starts) - 1
        return made

    def share_usings(self) -> None:
        """Let names in all parts be looked up with the USINGs of the file, which stand in one or two parts."""
        usings = tuple(name.text for part in self.parts for declared in part.syntax.declarations
                       if isinstance(declared, tree.Using) for name in declared.names)
        for part in self.parts:
            part.source.surroundings = Surroundings("", usings) if usings else None

    def copied(self) -> File:
        """The same file with the same parts, which changes apart from this one."""
        other = File(self.name, "")
        other._source, other.text, other._is_one = self._source, self.text, self._is_one
        other.parts = [part.copied() for part in self.parts]
        return other

    def part_at(self, offset: int) -> Part:
        """The part in which an offset lies; at the seam of two, the one that begins there."""
        return next((part for part in reversed(self.parts) if part.base <= offset), self.parts[0])


def spans(text: str) -> list[tuple[int, int]]:
    """Start and end of each part of a text, in characters; they cover it without gaps.

    Comments, strings, pragmas and LADDER .. END_LADDER are passed over.  A declaration without its END is one part with the
    next one, so that it is parsed as in the whole text.

    >>> spans("FUNCTION A : INT END_FUNCTION PROGRAM B END_PROGRAM")
    [(0, 30), (30, 51)]
    """
    return [(0, len(text))] if _is_one(text) else list(_cuts(text, 0))


def _is_one(text: str) -> bool:
    """True for a text in which rungs may name symbols of timers or counters that a declaration in front of theirs has."""
    return _TIMER_SYMBOL.search(text) is not None and _LADDER.search(text) is not None


def _cuts(text: str, start: int) -> Iterator[tuple[int, int]]:
    """The spans of the parts of a text from the beginning of one of them on."""
    opened, depth, ended = "", 0, -1
    for word, at, end in _words(text, start):
        if not opened and word in _OPENERS:
            if word not in _JOINED and ended > start:
                yield start, ended
                start = ended
            opened, depth = word, 1
        elif word == _ENDS.get(opened, f"END_{opened}"):
            depth -= 1
            if not depth:
                opened, ended = "", _line_end(text, end)
        elif word == opened == "NAMESPACE":
            depth += 1
        elif word in _CUT and word not in _HOLDS.get(opened, ()) and _begins_line(text, at):
            opened, depth = word, 1
    if start < len(text) or not text:
        yield start, len(text)


def common_beginning(one: str, other: str) -> int:
    """How many characters two texts have in common at their beginning."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def _words(text: str, at: int) -> Iterator[tuple[str, int, int]]:
    """The words in capitals that begin and end declarations, with their places, from `at` on."""
    while found := _MARK.search(text, at):
        at = found.end()
        if found["comment"]:
            at = end if (end := comment_end(text, found.start())[0]) >= 0 else len(text)
        elif word := found["word"]:
            word = word.upper()
            if word == "LADDER":
                ladder = _END_LADDER.search(text, at)
                at = ladder.end() if ladder else len(text)
            else:
                yield word, found.start(), at


def _begins_line(text: str, at: int) -> bool:
    return not text[text.rfind("\n", 0, at) + 1:at].strip()


def _line_end(text: str, at: int) -> int:
    """Where the rest of a line ends, if only a `;` and a comment follow on it; else the same place behind blanks."""
    found = _REST_OF_LINE.match(text, at)
    return found.end() if found else at
