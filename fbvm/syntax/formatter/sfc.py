"""Lays out steps and transitions: the rules of grammar/sfc.lark, with pieces of layout in place of nodes."""

from __future__ import annotations

from fbvm.syntax.formatter.expressions import Phrase, in_capitals
from fbvm.syntax.formatter.layout import HARD, Doc
from fbvm.syntax.formatter.statements import StatementLayout
from fbvm.syntax.st.lexer import Token


class SfcLayout(StatementLayout):
    """The functions of the rules of steps and transitions."""

    def step(self, word: Token, token: Token, colon: Token, associations: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", self.leaf(token), self.closer(colon),
                      self.block(associations, end), HARD, self.leaf(end))

    def association(self, token: Token, opener: Token | None, given: list[Phrase] | None, closer: Token | None,
                    end: Token) -> Phrase:
        phrase = Phrase(token.start, self.leaf(token))
        if given:  # the qualifier
            given[0].parts[0] = in_capitals(given[0].parts[0])
        if opener and closer:
            phrase.parts += (self.closer(opener), self.listed(given), self.closer(closer))
        phrase.parts.append(self.closer(end))
        return phrase

    def transition(self, word: Token, token: Token | None, priority: Doc | None, from_: Token, sources: Phrase, to: Token,
                   targets: Phrase, sign: Token, condition: Phrase, semicolon: Token, end: Token) -> Phrase:
        head = self._head(word, token, priority, from_, sources, to, targets)
        return Phrase(word.start, head, " ", self.leaf(sign), " ", self.hung(condition), self.closer(semicolon), HARD,
                      self.leaf(end))

    def transition_body(self, word: Token, token: Token | None, priority: Doc | None, from_: Token, sources: Phrase,
                        to: Token, targets: Phrase, colon: Token, items: list[Phrase], end: Token) -> Phrase:
        head = self._head(word, token, priority, from_, sources, to, targets)
        return Phrase(word.start, head, self.closer(colon), self.block(items, end), HARD, self.leaf(end))

    def _head(self, word: Token, token: Token | None, priority: Doc | None, from_: Token, sources: Phrase, to: Token,
              targets: Phrase) -> Doc:
        named: tuple[Doc, ...] = (" ", self.leaf(token)) if token else ()
        ranked: tuple[Doc, ...] = (" ", priority) if priority else ()
        return (self.leaf(word), named, ranked, " ", self.leaf(from_), " ", sources.doc, " ", self.leaf(to), " ", targets.doc)

    def priority(self, opener: Token, word: Token, sign: Token, number: Token, closer: Token) -> Doc:
        return (self.leaf(opener), self.leaf(word), " ", self.leaf(sign), " ", self.leaf(number), self.closer(closer))

    def step_names(self, token: Token) -> Phrase:
        return Phrase(token.start, self.leaf(token))

    step_name = step_names

    def step_names_listed(self, opener: Token, names: list[Phrase], closer: Token) -> Phrase:
        return Phrase(opener.start, self.closer(opener), self.listed(names, fill=True), self.closer(closer))
