"""What all builders share: reporting, lists, names.  The methods of a builder are named as the grammar's rules."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Expr, Form, Name, Statement, VarSection
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.ladder import Ladder

CHAIN_LIMIT = 1000
"""Deepest tree of one expression, in nodes; recursion over trees relies on it."""


ERROR_LIMIT = 100
"""Errors of one text after which the parser stops."""


LOSSLESS = {"S0101", "S0105", "S0108"}
"""Errors of single words that leave nothing out: an operator of another language, a literal without a value."""


_NUMBERED = re.compile(r"%?\s*([TC]\d+)", re.I)


class Stop(Exception):
    """The rest of the text is not parsed."""


class TooDeep(Exception):
    """An expression grew deeper than CHAIN_LIMIT at `token`; the driver reports it and goes on behind the statement."""

    token: Token | None = None


class Builder:
    """Makes the nodes of one source text.  Lists grow in place while their rule repeats."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.diagnostics: list[Diagnostic] = []
        self.forms: list[Form] = []
        """What only some dialects take."""
        self.generic_types: dict[str, str] = {}
        """Generic types of the function that is being read, in capitals -> the kind of each, as ANY_NUM."""
        self.errors = 0
        self.odd: list[int] = []
        """Ends of unknown characters that were passed over, and of strings without end."""
        self.unclosed: list[int] = []
        """Ends of strings without end, also of strings with a wrong escape."""
        self.cut_short = False
        """Whether a comment or pragma without end reaches to the end of the text."""
        self.full = False
        """Whether ERROR_LIMIT is reached."""
        self.ladders: list[Ladder] = []
        """LADDERs of the POU that is being read."""
        self.rungs = 0
        """How many rungs these have."""
        self.lists: list[InstructionList] = []
        """Instruction lists of the POU that is being read."""
        self.blocks: dict[str, str] = {}
        """Variables of the POU that is being read whose types are the names of blocks with inputs S and R -> these types, both in
        capitals."""
        self.numbered: dict[str, str] = {}
        """Symbol of a timer or counter, in capitals -> the number that it is declared AT, as T5."""
        self.numbered_everywhere: dict[str, str] = {}
        """The same for symbols among global variables."""
        self.targets: dict[Statement, str] = {}
        """JMPs of the POU that is being read -> the label that each names."""
        self.labels: dict[Statement, str] = {}
        """Labels of the POU that is being read -> their names."""
        self.jump_sections: list[VarSection] = []
        """Hidden sections with the variables of jumps in actions and transitions of the POU that is being read."""
        self.depths: dict[Expr, int] = {}
        """Depth of expressions under construction, if it is not 1."""

    def note_numbered(self, names: Sequence[Name], place: str) -> None:
        """Note the names of a declaration AT a timer or counter as its symbols; forget those AT another `place`."""
        found = _NUMBERED.fullmatch(place)
        for name in names:
            if found:
                self.numbered[name.text.upper()] = found[1].upper()
            else:
                self.numbered.pop(name.text.upper(), None)

    def report(self, code: str, start: int, end: int, message: str, hint: str = "", lossless: bool = True) -> None:
        self.tell(Diagnostic(code, self.source, start, end, message, hint, lossless=lossless and code in LOSSLESS))

    def tell(self, diagnostic: Diagnostic) -> None:
        """Keep a diagnostic; of errors only the first ERROR_LIMIT."""
        if diagnostic.severity == "error":
            if self.full:
                return
            self.errors += 1
            self.full = self.errors >= ERROR_LIMIT
        self.cut_short |= diagnostic.code == "S0103"
        if diagnostic.code in ("S0102", "S0104"):
            self.odd.append(diagnostic.end)
        if diagnostic.code == "S0104":
            self.unclosed.append(diagnostic.end)
        self.diagnostics.append(diagnostic)

    def forget(self, start: int, end: int) -> None:
        """Remove the diagnostics of a part of the text."""
        self.diagnostics = [each for each in self.diagnostics if not start <= each.start < end]

    def empty(self) -> list[Any]:
        return []

    def one(self, item: Any) -> list[Any]:
        return [item]

    def add(self, items: list[Any], item: Any) -> list[Any]:
        items.append(item)
        return items

    def add_separated(self, items: list[Any], comma: Token, item: Any) -> list[Any]:
        items.append(item)
        return items

    def drop_comma(self, items: list[Any], comma: Token) -> list[Any]:
        """A `,` behind the last item of a list."""
        return items

    def pass_over(self, items: list[Any], semicolon: Token) -> list[Any]:
        """A `;` behind the END of a declaration, which means nothing."""
        return items

    def join(self, items: list[Any], more: Sequence[Any]) -> list[Any]:
        items.extend(more)
        return items

    def name(self, token: Token) -> Name:
        return Name(token.start, token.end, token.text)

    def declared(self, token: Token) -> Name:
        """A name at its declaration, where the standard's rule for underscores is checked."""
        text = token.text
        if ("__" in text or text.endswith("_")) and not self.source.library:
            self.report("S0191", token.start, token.end, f"`{text}` has a doubled or trailing underscore",
                        "the standard forbids it; other compilers may refuse this name")
        return Name(token.start, token.end, text)

    def one_name(self, token: Token) -> list[Name]:
        return [self.declared(token)]

    def add_name_separated(self, names: list[Name], comma: Token, token: Token) -> list[Name]:
        names.append(self.declared(token))
        return names

    def add_name(self, names: list[Name], token: Token) -> list[Name]:
        names.append(Name(token.start, token.end, token.text.upper()))
        return names

    def deepen(self, node: Expr, left: Expr, right: Expr | None = None) -> None:
        """Note the depth of a new node over one or two parts."""
        depths = self.depths
        depth = depths.pop(left, 1)
        if right is not None:
            depth = max(depth, depths.pop(right, 1))
        if depth >= CHAIN_LIMIT:
            raise TooDeep
        depths[node] = depth + 1
