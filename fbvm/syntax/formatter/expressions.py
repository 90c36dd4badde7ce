"""Lays out expressions: the rules of grammar/st.lark, 7.3.2, with pieces of layout in place of nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from fbvm.syntax.formatter.comments import Comments
from fbvm.syntax.formatter.layout import SPACE, Doc, Fill, Group, Hang, Indent, Leaf
from fbvm.syntax.recovery.frames import LEVELS
from fbvm.syntax.st.lexer import Token, lexis
from fbvm.syntax.st.literals import ELEMENTARY

TEXTS = {"NAME", "NUMBER", "STRING_LITERAL", "TYPED_LITERAL", "DATE_LITERAL"}
"""Terminals that keep their case; all others are written in capitals."""

Spell = Callable[[int, str], str]
"""How the name that stands at a place is spelt where it is declared."""


class Phrase:
    """The layout that a rule has made: where it starts, and its parts.

    `level` is the production of an operator chain, whose parts are its operands, "sign" or "list" for what its
    surroundings write differently, else ""."""

    __slots__ = ("level", "parts", "start")

    def __init__(self, start: int, *parts: Doc, level: str = "") -> None:
        self.start, self.level = start, level
        self.parts = list(parts)

    @property
    def doc(self) -> Doc:
        return Group(tuple(self.parts)) if self.level in CHAINS else tuple(self.parts)


CHAINS = frozenset(LEVELS.values())


class ExpressionLayout:
    """The functions of the rules of expressions, and what all rules share."""

    def __init__(self, comments: Comments, spell: Spell) -> None:
        self.comments, self.spell = comments, spell
        self.reserved = lexis().reserved
        self.words = lexis().words

    # --- tokens ---

    def leaf(self, token: Token, text: str | None = None) -> Leaf:
        """A token as it is to be written."""
        if text is None:
            text = token.text
            if token.type not in TEXTS:
                text = text.upper()
            elif token.type == "NAME":
                text = text.upper() if self.words.get(text.upper()) in self.reserved else self.spell(token.start, text)
            elif token.type in ("TYPED_LITERAL", "DATE_LITERAL"):
                text = self._typed(token)
        return Leaf(text, token.start, token.end)

    def closer(self, token: Token, text: str | None = None) -> Leaf:
        """A sign or word directly behind the text that it closes; a comment between them goes behind the sign."""
        self.comments.draw(token)
        return self.leaf(token, text)

    # --- lists ---

    def empty(self) -> list[Any]:
        return []

    def one(self, item: Any) -> list[Any]:
        return self.add([], item)

    def add(self, items: list[Any], item: Any) -> list[Any]:
        items.append(self.leaf(item) if isinstance(item, Token) else item)
        return items

    def add_separated(self, items: list[Phrase], comma: Token, item: Phrase) -> list[Phrase]:
        items[-1].parts = [items[-1].doc, self.closer(comma)]
        items[-1].level = "list" if items[-1].level == "list" else ""
        items.append(item)
        return items

    def drop_comma(self, items: list[Phrase], comma: Token) -> list[Phrase]:
        self.comments.draw(comma, always=True)
        items[-1].parts.append(self.leaf(comma, ""))
        return items

    def one_name(self, token: Token) -> list[Phrase]:
        return [Phrase(token.start, self.leaf(token))]

    def add_name_separated(self, names: list[Phrase], comma: Token, token: Token) -> list[Phrase]:
        return self.add_separated(names, comma, Phrase(token.start, self.leaf(token)))

    def add_name(self, names: list[Leaf], token: Token) -> list[Leaf]:
        names.append(self.leaf(token))
        return names

    def listed(self, items: Sequence[Phrase] | None, *, fill: bool = False) -> Doc:
        """The members of a list, behind its bracket: on one line, or one a line, or filled."""
        docs = [item.doc for item in items or ()]
        if not docs:
            return ()
        if fill:
            return Hang(Fill(tuple(docs)))
        return Hang(Group(tuple(part for doc in docs for part in (SPACE, doc))[1:]))

    def hung(self, phrase: Phrase) -> Doc:
        return Hang(phrase.doc)

    # --- literals ---

    def number(self, token: Token) -> Phrase:
        return Phrase(token.start, self.leaf(token))

    string_literal = typed_literal = truth = null = name_ref = direct = self_reference = number

    def _typed(self, token: Token) -> str:
        prefix, rest = token.text.split("#", 1)
        if prefix.upper() in ELEMENTARY:
            return f"{prefix.upper()}#{rest}"
        return f"{self.spell(token.start, prefix)}#{self.spell(token.start + len(prefix) + 1, rest)}"

    # --- variables ---

    def member(self, of: Phrase, dot: Token, token: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.leaf(dot), self.leaf(token))

    def member_literal(self, of: Phrase, dot: Token, token: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.leaf(dot), self.typed_literal(token).doc)

    def part(self, of: Phrase, token: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.leaf(token, "." + token.text[1:].lstrip().upper()))

    def index(self, of: Phrase, opener: Token, subscripts: list[Phrase], closer: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.closer(opener), self.listed(subscripts), self.closer(closer))

    def deref(self, of: Phrase, caret: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.leaf(caret))

    def call(self, callee: Phrase, opener: Token, arguments: list[Phrase] | None, closer: Token) -> Phrase:
        return self.index(callee, opener, arguments or [], closer)

    def argument_positional(self, value: Phrase) -> Phrase:
        return value

    def argument_type(self, spec: Phrase) -> Phrase:
        return spec

    def argument_named(self, token: Token, sign: Token, value: Phrase | None) -> Phrase:
        phrase = Phrase(token.start, self.leaf(token), " ", self.leaf(sign))
        if value:
            phrase.parts += (" ", self.hung(value))
        return phrase

    def argument_negated(self, word: Token, token: Token, sign: Token, value: Phrase | None) -> Phrase:
        phrase = self.argument_named(token, sign, value)
        return Phrase(word.start, self.leaf(word), " ", phrase.doc)

    # --- operators ---

    def parenthesized(self, opener: Token, inner: Phrase, closer: Token) -> Phrase:
        return Phrase(opener.start, self.leaf(opener), self.hung(inner), self.closer(closer))

    def unary(self, operator: Token, operand: Phrase) -> Phrase:
        word = operator.type == "NOT"
        apart = " " if word or operand.level == "sign" else ""
        return Phrase(operator.start, self.leaf(operator), apart, operand.doc, level="" if word else "sign")

    def address_of(self, sign: Token, operand: Phrase) -> Phrase:
        return Phrase(sign.start, self.leaf(sign), operand.doc)

    def binary(self, left: Phrase, operator: Token, right: Phrase) -> Phrase:
        self.comments.lift(operator)
        level = LEVELS["AND" if operator.type == "AMPERSAND" else operator.text.upper()]
        if left.level != level:
            left = Phrase(left.start, self.operand(left), level=level)
        left.parts += (SPACE, self.leaf(operator), " ", self.operand(right))
        return left

    def operand(self, phrase: Phrase) -> Doc:
        """A part of a chain; a chain in it is broken further in."""
        return Indent(phrase.doc) if phrase.level in CHAINS else phrase.doc


def in_capitals(doc: Doc) -> Doc:
    """A piece whose first word is written in capitals."""
    if isinstance(doc, tuple) and doc:
        return (in_capitals(doc[0]), *doc[1:])
    return replace(doc, text=doc.text.upper()) if isinstance(doc, Leaf) else doc
