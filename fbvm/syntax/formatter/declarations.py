"""Lays out declarations: the rules of grammar/declarations.lark, with pieces of layout in place of nodes."""

from __future__ import annotations

from fbvm.syntax.formatter.expressions import Phrase, in_capitals
from fbvm.syntax.formatter.layout import BLANK, HARD, Doc, Indent, Leaf
from fbvm.syntax.formatter.sfc import SfcLayout
from fbvm.syntax.formatter.statements import Row, lines
from fbvm.syntax.formatter.types import TypeLayout
from fbvm.syntax.st.lexer import Token


class DeclarationLayout(TypeLayout, SfcLayout):
    """The functions of the rules of declarations; with those it inherits, the whole grammar's."""

    def source_text(self, declarations: list[Phrase]) -> Doc:
        """The whole text: at least one empty line between declarations."""
        rows = self.apart(declarations)
        rows += self.remarks(self.comments.claim(len(self.comments.text)))
        parts: list[Doc] = []
        for row in rows:
            parts += (BLANK if row.blank else HARD, row.doc)
        return tuple(parts[1:])

    def apart(self, items: list[Phrase]) -> list[Row]:
        """Items with at least one empty line between them, but for USINGs."""
        rows: list[Row] = []
        for before, item in zip([None, *items], items, strict=False):
            new = self.rows([item])
            together = item.level == "using" and before is not None and before.level == "using"
            if rows and not together and not any(row.blank for row in new):
                new[0] = new[0]._replace(blank=True)
            rows += new
        return rows

    # --- namespaces ---

    def namespace(self, word: Token, modifiers: list[Leaf], name: Phrase, declarations: list[Phrase], end: Token) -> Phrase:
        words = tuple(part for each in modifiers for part in (each, " "))
        return Phrase(word.start, self.leaf(word), " ", *words, name.doc, lines(self.apart(declarations) + self.before_end(end)),
                      HARD, self.leaf(end))

    def using(self, word: Token, names: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", self.listed(names, fill=True), self.closer(end), level="using")

    # --- POUs ---

    def add_inheritance(self, parts: list[Doc], word: Token, names: list[Phrase]) -> list[Doc]:
        return [*parts, " ", self.leaf(word), " ", self.listed(names, fill=True)]

    def add_inheritance_behind(self, sections: list[Phrase], word: Token, names: list[Phrase]) -> list[Phrase]:
        sections.append(Phrase(word.start, self.leaf(word), " ", self.listed(names, fill=True)))
        return sections

    def add_using(self, parts: list[Doc], using: Phrase) -> list[Doc]:
        return [*parts, " ", using.doc]

    def generic_type(self, token: Token, colon: Token, kind: Token) -> Phrase:
        return Phrase(token.start, self.leaf(token), " ", self.leaf(colon), " ", self.leaf(kind))

    def generics(self, opener: Token, types: list[Phrase], closer: Token) -> Doc:
        parts = [part for each in types for part in (" ", each.doc)]
        return self.leaf(opener), *parts[1:], self.leaf(closer)

    def pou_head(self, modifiers: list[Leaf], token: Token, generics: Doc | None, inheritance: list[Doc]) -> Doc:
        words = tuple(part for word in modifiers for part in (word, " "))
        return (*words, self.leaf(token), *([generics] if generics else []), *inheritance)

    def pou(self, word: Token, head: Doc, sections: list[Phrase], items: list[Phrase], actions: list[Phrase],
            end: Token) -> Phrase:
        return self.function(word, head, None, None, None, sections, items, actions, end)

    def function(self, word: Token, head: Doc, colon: Token | None, result: Phrase | None, usings: list[Phrase] | None,
                 sections: list[Phrase], items: list[Phrase], actions: list[Phrase], end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), " ", head)
        if colon and result:
            phrase.parts += (" ", self.leaf(colon), " ", result.doc)
        phrase.parts += [part for using in usings or () for part in (" ", using.doc)]
        declared, body = self.rows(sections), self.with_methods(items)
        if not actions:
            body += self.before_end(end)
        more = self.apart(actions)
        if more:
            more[0] = more[0]._replace(blank=True)
        phrase.parts += (lines(declared), Indent(lines(body, bool(declared))), lines(more, True))
        if actions:
            phrase.parts.append(Indent(lines(self.before_end(end))))
        phrase.parts += (HARD, self.leaf(end))
        return phrase

    def with_methods(self, items: list[Phrase]) -> list[Row]:
        """The items of a body, with an empty line around each method."""
        rows: list[Row] = []
        for before, item in zip([None, *items], items, strict=False):
            new = self.rows([item])
            if "method" in (item.level, before.level if before else ""):
                new[0] = new[0]._replace(blank=True)
            rows += new
        return rows

    def interface(self, word: Token, head: Doc, members: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", head, Indent(lines(self.with_methods(members) + self.before_end(end))),
                      HARD, self.leaf(end))

    def method(self, word: Token, head: Doc, colon: Token | None, result: Phrase | None, usings: list[Phrase] | None,
               sections: list[Phrase], items: list[Phrase], end: Token) -> Phrase:
        made = self.function(word, head, colon, result, usings, sections, items, [], end)
        made.level = "method"
        return made

    def property(self, word: Token, head: Doc, colon: Token, spec: Phrase, accessors: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", head, " ", self.leaf(colon), " ", spec.doc, self.block(accessors, end),
                      HARD, self.leaf(end), level="method")

    def property_half(self, word: Token, head: Doc, colon: Token, spec: Phrase, sections: list[Phrase], items: list[Phrase],
                      end: Token) -> Phrase:
        return self.method(word, head, colon, spec, None, sections, items, end)

    def accessor(self, modifiers: list[Leaf], word: Token, sections: list[Phrase], items: list[Phrase], end: Token) -> Phrase:
        words = tuple(part for each in modifiers for part in (each, " "))
        made = self.function(word, (), None, None, None, sections, items, [], end)
        made.parts[:2] = (*words, made.parts[0])
        return made

    def action(self, word: Token, owner: Token | None, dot: Token | None, token: Token, colon: Token | None,
               items: list[Phrase], end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), " ")
        if owner and dot:
            phrase.parts += (self.leaf(owner), self.leaf(dot))
        phrase.parts.append(self.leaf(token))
        phrase.parts.append(self.leaf(colon) if colon else ":")
        phrase.parts += (self.block(items, end), HARD, self.leaf(end))
        return phrase

    def action_chart(self, word: Token, token: Token, colon: Token, items: list[Phrase], parts: list[Phrase],
                     end: Token) -> Phrase:
        return self.action(word, None, None, token, colon, items + parts, end)

    def actions_of(self, word: Token, owner: Token | None, actions: list[Phrase], end: Token) -> Phrase:
        named = (" ", self.leaf(owner)) if owner else ()
        return Phrase(word.start, self.leaf(word), named, self.block(actions, end), HARD, self.leaf(end))

    def pass_over(self, items: list[Phrase], semicolon: Token) -> list[Phrase]:
        if items:
            items[-1].parts.append(self.dropped(semicolon))
        return items

    # --- variables ---

    def var_section(self, word: Token, qualifiers: list[Leaf], variables: list[Phrase], end: Token) -> Phrase:
        words = tuple(part for qualifier in qualifiers for part in (" ", qualifier))
        return Phrase(word.start, self.leaf(word), words, self.members(variables, end), HARD, self.leaf(end))

    def global_vars(self, section: Phrase) -> Phrase:
        return section

    # --- configuration ---

    def configuration(self, word: Token, token: Token, items: list[Phrase], end: Token) -> Phrase:
        return self.resource(word, token, None, None, items, end)

    def resource(self, word: Token, token: Token, on: Token | None, processor: Token | None, items: list[Phrase],
                 end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), " ", self.leaf(token))
        if on and processor:
            phrase.parts += (" ", self.leaf(on), " ", self.leaf(processor))
        phrase.parts += (self.block(items, end), HARD, self.leaf(end))
        return phrase

    def task(self, word: Token, token: Token, opener: Token, arguments: list[Phrase] | None, closer: Token,
             end: Token) -> Phrase:
        for argument in arguments or ():
            argument.parts[0] = in_capitals(argument.parts[0])
        return Phrase(word.start, self.leaf(word), " ", self.leaf(token), self.leaf(opener), self.listed(arguments),
                      self.closer(closer), self.closer(end))

    def program_instance(self, word: Token, qualifiers: list[Leaf], token: Token, with_: Token | None,
                         task: Token | None, colon: Token, type_name: Phrase, end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word), " ")
        phrase.parts += (part for qualifier in qualifiers for part in (qualifier, " "))
        phrase.parts.append(self.leaf(token))
        if with_ and task:
            phrase.parts += (" ", self.leaf(with_), " ", self.leaf(task))
        phrase.parts += (" ", self.leaf(colon), " ", type_name.doc, self.closer(end))
        return phrase

    def program_connected(self, word: Token, qualifiers: list[Leaf], token: Token, with_: Token | None,
                          task: Token | None, colon: Token, type_name: Phrase, opener: Token,
                          connections: list[Phrase] | None, closer: Token, end: Token) -> Phrase:
        program = Phrase(type_name.start, type_name.doc, self.leaf(opener), self.listed(connections), self.closer(closer))
        return self.program_instance(word, qualifiers, token, with_, task, colon, program, end)

    def path_direct(self, of: Phrase, dot: Token, address: Token) -> Phrase:
        return Phrase(of.start, of.doc, self.leaf(dot), self.leaf(address))

    def access_decl(self, token: Token, colon: Token, path: Phrase, second: Token, spec: Phrase, direction: Token | None,
                    end: Token) -> Phrase:
        phrase = Phrase(token.start, self.leaf(token), " ", self.leaf(colon), " ", path.doc, " ", self.leaf(second), " ")
        phrase.parts.append(spec.doc)
        if direction:
            phrase.parts += (" ", self.leaf(direction, direction.text.upper()))
        phrase.parts.append(self.closer(end))
        return phrase

    def access_vars(self, word: Token, variables: list[Phrase], end: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), self.block(variables, end), HARD, self.leaf(end))

    config_vars = access_vars

    def config_decl(self, path: Phrase, at: Token | None, location: Token | None, colon: Token, spec: Phrase,
                    sign: Token | None, initial: Phrase | None, end: Token) -> Phrase:
        phrase = Phrase(path.start, path.doc)
        if at and location:
            phrase.parts += (" ", self.leaf(at), " ", self.leaf(location))
        phrase.parts += (" ", self.leaf(colon), " ", spec.doc)
        if sign and initial:
            phrase.parts += (" ", self.leaf(sign), " ", initial.doc)
        phrase.parts.append(self.closer(end))
        return phrase

    def fb_task(self, instance: Phrase, with_: Token, task: Token) -> Phrase:
        return Phrase(instance.start, instance.doc, " ", self.leaf(with_), " ", self.leaf(task))
