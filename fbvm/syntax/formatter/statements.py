"""Lays out statements: the rules of grammar/st.lark, 7.3.3, with pieces of layout in place of nodes."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from fbvm.syntax.formatter.comments import Comment
from fbvm.syntax.formatter.expressions import ExpressionLayout, Phrase
from fbvm.syntax.formatter.layout import BLANK, HARD, Doc, Hang, Indent, Leaf, Verbatim
from fbvm.syntax.il.text import list_lines
from fbvm.syntax.ladder.mnemonics import read_rungs
from fbvm.syntax.ladder.notation import Notation
from fbvm.syntax.ladder.text import rung_lines
from fbvm.syntax.st.lexer import Token

Branch = tuple[Token, Phrase, Token, list[Phrase]]


class Row(NamedTuple):
    """A piece that begins a line of its own; `blank` asks for an empty line before it."""

    blank: bool
    doc: Doc


def lines(rows: Iterable[Row], blank_first: bool = False) -> Doc:
    """Rows one below the other, behind a line end."""
    parts: list[Doc] = []
    for row in rows:
        parts += (BLANK if row.blank and (parts or blank_first) else HARD, row.doc)
    return tuple(parts)


class StatementLayout(ExpressionLayout):
    """The functions of the rules of statements."""

    notation: Notation | None = None
    """The notation that rungs are written in; None leaves each as it is."""

    # --- rows ---

    def remarks(self, comments: Iterable[Comment]) -> list[Row]:
        return [Row(c.blank, Verbatim(c.text, c.column)) for c in comments]

    def before_end(self, end: Token) -> list[Row]:
        """The comments in front of a word that ends a block; they belong to the block."""
        return self.remarks(self.comments.claim(end.start))

    def before_divider(self, start: int) -> tuple[list[Row], list[Row]]:
        """The comments in front of ELSE or a label: those of the block above, which stand further in, and its own."""
        comments = self.comments.claim(start)
        if not comments:
            return [], []
        column = self.comments.column(start)
        count = next((at for at, c in enumerate(comments) if c.column <= column), len(comments))
        return self.remarks(comments[:count]), self.remarks(comments[count:])

    def rows(self, items: Iterable[Phrase]) -> list[Row]:
        """Each item on its line, comments above it."""
        rows: list[Row] = []
        for item in items:
            rows += self.remarks(self.comments.claim(item.start))
            rows.append(Row(item.start in self.comments.blanks, item.doc))
        return rows

    def block(self, items: Iterable[Phrase], end: Token) -> Doc:
        """The items of a block, indented, up to the word that ends the block."""
        return Indent(lines(self.rows(items) + self.before_end(end)))

    # --- lists ---

    def add_empty(self, items: list[Phrase], semicolon: Token) -> list[Phrase]:
        items.append(Phrase(semicolon.start, self.leaf(semicolon)))
        return items

    def add_ended(self, items: list[Phrase], statement: Phrase, semicolon: Token) -> list[Phrase]:
        items.append(Phrase(statement.start, statement.doc, self.closer(semicolon)))
        return items

    def close(self, items: list[Phrase], semicolon: Token) -> list[Phrase]:
        """A `;` behind END_IF and the like, which are written with one already."""
        if items[-1].level == "refused":
            items[-1].parts.append(self.closer(semicolon))
        else:
            items[-1].parts.append(self.dropped(semicolon))
        return items

    def dropped(self, token: Token) -> Leaf:
        """A token that need not be written; its comments must be."""
        self.comments.draw(token, always=True)
        return self.leaf(token, "")

    def ended(self, end: Token) -> Leaf:
        """A word that ends a block, and the `;` that belongs to it."""
        return self.leaf(end, f"{end.text.upper()};")

    # --- simple statements ---

    def one_target(self, target: Phrase, sign: Token) -> Phrase:
        return Phrase(target.start, target.doc, " ", self.leaf(sign), " ")

    def add_target(self, targets: Phrase, target: Phrase, sign: Token) -> Phrase:
        targets.parts += (target.doc, " ", self.leaf(sign), " ")
        return targets

    def assignment(self, targets: Phrase, value: Phrase) -> Phrase:
        return Phrase(targets.start, targets.doc, self.hung(value))

    one_set_target, add_set_target, set_assignment = one_target, add_target, assignment

    def assignment_other(self, target: Phrase, sign: Token, value: Phrase) -> Phrase:
        return self.assignment(self.one_target(target, sign), value)

    def call_statement(self, call: Phrase) -> Phrase:
        return call

    def exit_statement(self, word: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word))

    continue_statement = exit_statement

    def return_statement(self, word: Token, value: Phrase | None) -> Phrase:
        more = (" ", self.hung(value)) if value else ()
        return Phrase(word.start, self.leaf(word), *more)

    def jump(self, word: Token, target: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", self.leaf(target))

    def method_among_statements(self, method: Phrase) -> Phrase:
        return method

    # --- compound statements ---

    def ladder(self, token: Token) -> Phrase:
        """LADDER .. END_LADDER, in the canonical form of its own."""
        first, last = token.text.index("\n") + 1, token.text.rindex("\n") + 1
        rungs = read_rungs(token.text, first, last, lambda *message: None)
        if self.notation is not None:
            rungs = self.notation.rewritten(rungs, self.comments.text, token.start)
        words = Token("", "LADDER", token.start, token.end)
        rows = [part for line in rung_lines(rungs) for part in (HARD, Verbatim(line, 0))]
        return Phrase(token.start, self.leaf(words), *rows, HARD, "END_LADDER", level="refused")

    def instruction_list(self, token: Token) -> Phrase:
        """An instruction list, in columns."""
        written = list_lines(self.comments.text, token.start, token.end, lambda word: self.leaf(word).text)
        rows = [part for line in written for part in (HARD, Verbatim(line, 0))]
        return Phrase(token.start, Leaf("", token.start, -1), *rows[1:], Leaf("", -1, token.end), level="refused")

    def head(self, word: Token, condition: Phrase, then: Token) -> Doc:
        return (self.leaf(word), " ", self.hung(condition), " ", self.closer(then))

    def branch(self, items: list[Phrase], divider: Token) -> Doc:
        """A block that ends at ELSIF or ELSE, and the comments of that."""
        inside, outside = self.before_divider(divider.start)
        above = self.rows(items) + inside
        return (Indent(lines(above)), lines(outside, bool(above)), HARD)

    def if_statement(self, word: Token, condition: Phrase, then: Token, items: list[Phrase], more: list[Branch],
                     other: Token | None, otherwise: list[Phrase] | None, end: Token) -> Phrase:
        phrase = Phrase(word.start)
        branches: list[Branch] = [(word, condition, then, items), *more]
        following = [b[0] for b in branches[1:]] + ([other] if other else [])
        for (opener, test, sign, block), divider in zip(branches, [*following, None], strict=False):
            phrase.parts.append(self.head(opener, test, sign))
            if divider:
                phrase.parts.append(self.branch(block, divider))
            else:
                phrase.parts += (self.block(block, end), HARD)
        if other and otherwise is not None:
            phrase.parts += (self.leaf(other), self.block(otherwise, end), HARD)
        phrase.parts.append(self.ended(end))
        return phrase

    def add_elsif(self, branches: list[Branch], word: Token, condition: Phrase, then: Token,
                  items: list[Phrase]) -> list[Branch]:
        branches.append((word, condition, then, items))
        return branches

    def label_value(self, value: Phrase) -> Phrase:
        return value

    def label_range(self, low: Phrase, sign: Token, high: Phrase) -> Phrase:
        return Phrase(low.start, low.doc, self.leaf(sign), high.doc)

    def label(self, values: list[Phrase], colon: Token) -> Phrase:
        return Phrase(values[0].start, self.listed(values, fill=True), self.closer(colon), level="label")

    def case_statement(self, word: Token, selector: Phrase, of: Token, items: list[Phrase], other: Token | None,
                       otherwise: list[Phrase] | None, end: Token) -> Phrase:
        phrase = Phrase(word.start, self.head(word, selector, of))
        rows = self.branches(items)
        if other and otherwise is not None:
            inside, outside = self.before_divider(other.start)
            phrase.parts += (Indent((lines(rows), Indent(lines(inside, True)))), lines(outside, True), HARD)
            phrase.parts += (self.leaf(other), self.block(otherwise, end))
        else:
            phrase.parts.append(Indent((lines(rows), Indent(lines(self.before_end(end), True)))))
        phrase.parts += (HARD, self.ended(end))
        return phrase

    def branches(self, items: list[Phrase]) -> list[Row]:
        """Each label of a CASE, and indented the statements behind it."""
        rows: list[Row] = []
        starts = [at for at, item in enumerate(items) if item.level == "label"]
        for at, until in pairwise([*starts, len(items)]):
            inside, outside = self.before_divider(items[at].start)
            if not rows:
                inside, outside = [], inside + outside
            elif inside:
                rows[-1] = rows[-1]._replace(doc=(rows[-1].doc, Indent(lines(inside, True))))
            body = self.rows(items[at + 1:until])
            blank = items[at].start in self.comments.blanks
            rows += [*outside, Row(blank, (items[at].doc, Indent(lines(body))))]
        return rows

    def for_statement(self, word: Token, variable: Phrase, sign: Token, first: Phrase, to: Token, last: Phrase,
                      by: Token | None, step: Phrase | None, do: Token, items: list[Phrase], end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), " ", variable.doc, " ", self.leaf(sign), " ", self.hung(first), " ",
                        self.leaf(to), " ", self.hung(last))
        if by and step:
            phrase.parts += (" ", self.leaf(by), " ", self.hung(step))
        phrase.parts += (" ", self.closer(do), self.block(items, end), HARD, self.ended(end))
        return phrase

    def while_statement(self, word: Token, condition: Phrase, do: Token, items: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.head(word, condition, do), self.block(items, end), HARD, self.ended(end))

    def repeat_statement(self, word: Token, items: list[Phrase], until: Token, condition: Phrase,
                         semicolon: Token | None, end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), self.branch(items, until), self.leaf(until), " ", Hang(condition.doc))
        if semicolon:
            phrase.parts.append(self.dropped(semicolon))
        phrase.parts += (lines(self.before_end(end)), HARD, self.ended(end))
        return phrase

    def try_statement(self, word: Token, items: list[Phrase], catch: Token, opening: Token | None, code: Phrase | None,
                      closing: Token | None, handler: list[Phrase], last: Token | None, final: list[Phrase] | None,
                      end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), self.branch(items, catch), self.leaf(catch))
        if opening and code and closing:
            phrase.parts += (self.leaf(opening), self.hung(code), self.closer(closing))
        if last and final is not None:
            phrase.parts += (self.branch(handler, last), self.leaf(last), self.block(final, end))
        else:
            phrase.parts.append(self.block(handler, end))
        phrase.parts += (HARD, self.ended(end))
        return phrase
