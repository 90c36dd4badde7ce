"""Lays out types, initial values and lists of variables: grammar/declarations.lark, 6.4 and 6.5."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.syntax.formatter.expressions import Phrase
from fbvm.syntax.formatter.layout import HARD, Doc, Fill, Hang, Indent, Leaf, flat_width
from fbvm.syntax.formatter.statements import Row, StatementLayout, lines
from fbvm.syntax.st.lexer import Token

SPREAD = 16
"""Largest difference of the lengths of what is aligned."""


class Declared(Phrase):
    """A declaration of variables, in columns: names, AT and address, type, initial value."""

    __slots__ = ("at", "colon", "end", "initial", "names", "spec")

    def __init__(self, start: int, names: Doc, at: Doc, colon: Doc, spec: Doc, initial: Doc, end: Doc) -> None:
        super().__init__(start)
        self.names, self.at, self.colon, self.spec, self.initial, self.end = names, at, colon, spec, initial, end

    def place(self, pads: Sequence[int]) -> None:
        """Put it together with spaces behind names, address and type."""
        behind_names, behind_address, behind_type = (" " * pad for pad in pads)
        self.parts = [self.names, behind_names, self.at, behind_address, " ", self.colon, " ", self.spec]
        if self.initial:
            self.parts += (behind_type, self.initial)
        self.parts.append(self.end)


def paddings(widths: Sequence[int | None]) -> list[int]:
    """Spaces behind each cell of a column.  None parts a column in two, and so do widths that differ too much."""
    pads = [0] * len(widths)
    first, shortest, longest = 0, 0, 0
    for at, width in enumerate([*widths, None]):
        if width is None or (first < at and max(longest, width) - min(shortest, width) > SPREAD):
            for each in range(first, at):
                pads[each] = longest - (widths[each] or 0)
            first = at + (width is None)
        if width is not None:
            shortest, longest = (width, width) if first == at else (min(shortest, width), max(longest, width))
    return pads


class TypeLayout(StatementLayout):
    """The functions of the rules of types, variables and initial values."""

    # --- variables ---

    def var_decl(self, names: list[Phrase] | None, at: Token | None, location: Token | None, colon: Token, spec: Phrase,
                 edge: Token | None, sign: Token | None, initial: Phrase | None, end: Token | None) -> Declared:
        place: Doc = ()
        if at and location:
            address = self.leaf(location, " ".join(location.text.upper().split()))
            place = (" " if names else "", self.leaf(at), " ", address)
        start = names[0].start if names else at.start if at else colon.start
        listed = Hang(Fill(tuple(name.doc for name in names))) if names else ()
        kind: Doc = (spec.doc, " ", self.leaf(edge)) if edge else spec.doc
        value: Doc = (" ", self.leaf(sign), " ", self.hung(initial)) if sign and initial else ()
        return Declared(start, listed, place, self.leaf(colon), kind, value, self.closer(end) if end else ())

    def pass_over_variable(self, variables: list[Phrase], semicolon: Token) -> list[Phrase]:
        if variables and isinstance(variables[-1], Declared):
            variables[-1].end = (variables[-1].end, self.dropped(semicolon))
        return variables

    def var_decl_nameless(self, at: Token, location: Token, colon: Token, spec: Phrase, sign: Token | None,
                          initial: Phrase | None, end: Token) -> Declared:
        return self.var_decl(None, at, location, colon, spec, None, sign, initial, end)

    def var_decl_struct(self, names: list[Phrase], at: Token | None, location: Token | None, colon: Token, spec: Phrase,
                        end: Token | None) -> Declared:
        self.end_structure(spec, end)
        return self.var_decl(names, at, location, colon, spec, None, None, None, None)

    def var_decl_struct_init(self, names: list[Phrase], at: Token | None, location: Token | None, colon: Token,
                             spec: Phrase, sign: Token, initial: Phrase, end: Token) -> Declared:
        return self.var_decl(names, at, location, colon, spec, None, sign, initial, end)

    def members(self, variables: Sequence[Phrase], end: Token) -> Doc:
        """Variables one below the other, in columns where lines follow directly."""
        declared = [each for each in variables if isinstance(each, Declared)]
        above = [self.remarks(self.comments.claim(each.start)) for each in declared]
        blanks = [each.start in self.comments.blanks for each in declared]
        groups: list[list[Declared]] = []
        for each, remarks, blank in zip(declared, above, blanks, strict=True):
            if not groups or blank or any(row.blank for row in remarks):
                groups.append([])
            groups[-1].append(each)
        for group in groups:
            self.align(group)
        rows: list[Row] = []
        for each, remarks, blank in zip(declared, above, blanks, strict=True):
            rows += [*remarks, Row(blank, each.doc)]
        return Indent(lines(rows + self.before_end(end)))

    def align(self, group: Sequence[Declared]) -> None:
        """Put the declarations of a group together."""
        whole = [flat_width((each.names, each.spec), self.comments) is not None for each in group]
        names = [flat_width(each.names, self.comments) if fits else None for each, fits in zip(group, whole, strict=True)]
        kinds = [flat_width(each.spec, self.comments) if each.initial else None for each in group]

        def apart(widths: Sequence[int | None]) -> list[int]:
            """Padding of what has an address, and of what has none, each among its like."""
            kept = [paddings([width if bool(each.at) is placed else None for each, width in zip(group, widths, strict=True)])
                    for placed in (False, True)]
            return [sum(pads) for pads in zip(*kept, strict=True)]

        address = paddings([flat_width(each.at, self.comments) if each.at and each.names and fits else None
                            for each, fits in zip(group, whole, strict=True)])
        for each, *pads in zip(group, apart(names), address, apart(kinds), strict=True):
            each.place(pads)

    # --- types ---

    def type_declaration(self, word: Token, declarations: list[Phrase], end: Token) -> list[Phrase]:
        return self.modified_type_declaration(word, [], declarations, end)

    def modified_type_declaration(self, word: Token, modifiers: list[Leaf], declarations: list[Phrase],
                                  end: Token) -> list[Phrase]:
        words = tuple(part for each in modifiers for part in (" ", each))
        return [Phrase(word.start, self.leaf(word), *words, self.block(declarations, end), HARD, self.leaf(end))]

    def join(self, items: list[Phrase], more: list[Phrase]) -> list[Phrase]:
        items += more
        return items

    def type_decl(self, token: Token, colon: Token, spec: Phrase, sign: Token | None, initial: Phrase | None,
                  end: Token) -> Phrase:
        value: Doc = (" ", self.leaf(sign), " ", self.hung(initial)) if sign and initial else ()
        return Phrase(token.start, self.leaf(token), " ", self.leaf(colon), " ", spec.doc, value, self.closer(end))

    def type_decl_open(self, token: Token, colon: Token, spec: Phrase, end: Token | None = None) -> Phrase:
        self.end_structure(spec, end)
        return Phrase(token.start, self.leaf(token), " ", self.leaf(colon), " ", spec.doc)

    def type_decl_extends(self, token: Token, word: Token, bases: list[Phrase], colon: Token, spec: Phrase,
                          end: Token | None) -> Phrase:
        phrase = self.type_decl_open(token, colon, spec, end)
        phrase.parts[1:1] = (" ", self.leaf(word), " ", self.listed(bases, fill=True))
        return phrase

    def type_name(self, token: Token) -> Phrase:
        return Phrase(token.start, self.leaf(token))

    def type_name_dotted(self, name: Phrase, dot: Token, token: Token) -> Phrase:
        return self.member(name, dot, token)

    def type_name_given(self, name: Phrase, opener: Token, values: list[Phrase], closer: Token) -> Phrase:
        return Phrase(name.start, name.doc, self.leaf(opener), self.listed(values), self.closer(closer))

    def named_type(self, name: Phrase) -> Phrase:
        return name

    def string_plain(self, word: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word))

    def string_sized(self, word: Token, opener: Token, length: Phrase, closer: Token) -> Phrase:
        return Phrase(word.start, self.leaf(word), self.leaf(opener), self.hung(length), self.closer(closer))

    def subrange_spec(self, base: Phrase, opener: Token, low: Phrase, sign: Token, high: Phrase, closer: Token) -> Phrase:
        return Phrase(base.start, base.doc, " ", self.leaf(opener), low.doc, self.leaf(sign), high.doc, self.closer(closer))

    def enum_plain(self, opener: Token, members: list[Phrase], closer: Token) -> Phrase:
        return Phrase(opener.start, self.leaf(opener), self.listed(members), self.closer(closer))

    def constructed_elements(self, base: Phrase, opener: Token, items: list[Phrase], closer: Token) -> Phrase:
        return Phrase(base.start, base.doc, self.array_init(opener, items, closer).doc)

    def constructed_plain(self, base: Phrase, opener: Token, closer: Token) -> Phrase:
        return Phrase(base.start, base.doc, self.leaf(opener), self.closer(closer))

    def based(self, base: Phrase, opener: Token, members: list[Phrase], closer: Token) -> Phrase:
        return Phrase(base.start, base.doc, " ", self.enum_plain(opener, members, closer).doc)

    def enum_based_behind(self, opener: Token, members: list[Phrase], closer: Token, base: Phrase) -> Phrase:
        return Phrase(opener.start, self.enum_plain(opener, members, closer).doc, " ", base.doc)

    def enum_member(self, token: Token, sign: Token | None, value: Phrase | None) -> Phrase:
        phrase = Phrase(token.start, self.leaf(token))
        if sign and value:
            phrase.parts += (" ", self.leaf(sign), " ", self.hung(value))
        return phrase

    def array_spec(self, word: Token, opener: Token, dimensions: list[Phrase], closer: Token, of: Token,
                   element: Phrase) -> Phrase:
        return Phrase(word.start, self.leaf(word), self.leaf(opener), self.listed(dimensions), self.closer(closer), " ",
                      self.leaf(of), " ", element.doc)

    def dimension(self, low: Phrase, sign: Token, high: Phrase) -> Phrase:
        return self.label_range(low, sign, high)

    def dimension_open(self, star: Token) -> Phrase:
        return Phrase(star.start, self.leaf(star))

    def struct_spec(self, word: Token, overlap: Token | None, members: list[Phrase], end: Token) -> Phrase:
        phrase = Phrase(word.start, self.leaf(word))
        if overlap:
            phrase.parts += (" ", self.leaf(overlap))
        phrase.parts += (self.members(members, end), HARD, self.leaf(end))
        return phrase

    def union_spec(self, word: Token, members: list[Phrase], end: Token) -> Phrase:
        return self.struct_spec(word, None, members, end)

    def end_structure(self, spec: Phrase, end: Token | None) -> None:
        """Give END_STRUCT its `;`, whether it has brought one or not."""
        closing = spec.parts[-1]
        assert isinstance(closing, Leaf), "a structure ends with its word"
        spec.parts[-1] = Leaf(f"{closing.text};", closing.start, closing.end)
        if end:
            spec.parts.append(self.dropped(end))

    def ref_to(self, word: Token, target: Phrase) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", target.doc)

    def pointer_to(self, word: Token, to: Token, target: Phrase) -> Phrase:
        return Phrase(word.start, self.leaf(word), " ", self.leaf(to), " ", target.doc)

    # --- initial values ---

    def array_init(self, opener: Token, items: list[Phrase] | None, closer: Token) -> Phrase:
        fill = not any(item.level == "list" for item in items or ())
        inside = self.listed(items, fill=fill)
        return Phrase(opener.start, self.leaf(opener), inside, self.closer(closer), level="list")

    def array_bare(self, first: Phrase, comma: Token, items: list[Phrase]) -> Phrase:
        """An array without brackets gets them."""
        inside = self.listed([*self.add_separated([first], comma, items[0]), *items[1:]], fill=True)
        return Phrase(first.start, "[", inside, "]", level="list")

    def array_bare_repeated(self, count: Token, opener: Token, values: list[Phrase] | None, closer: Token) -> Phrase:
        return Phrase(count.start, "[", self.array_repeated(count, opener, values, closer).doc, "]", level="list")

    def array_round(self, opener: Token, bare: Phrase, closer: Token) -> Phrase:
        """... and one in parentheses keeps these, which only a dialect takes."""
        return Phrase(opener.start, self.leaf(opener), *bare.parts[1:-1], self.closer(closer), level="list")

    def array_item(self, value: Phrase) -> Phrase:
        return value

    def array_repeated(self, count: Token, opener: Token, values: list[Phrase] | None, closer: Token) -> Phrase:
        level = "list" if any(value.level == "list" for value in values or ()) else ""
        return Phrase(count.start, self.leaf(count), self.leaf(opener), self.listed(values), self.closer(closer), level=level)

    def struct_init(self, opener: Token, fields: list[Phrase], closer: Token) -> Phrase:
        return Phrase(opener.start, self.leaf(opener), self.listed(fields), self.closer(closer), level="list")

    def empty_struct(self, opener: Token, closer: Token) -> Phrase:
        return Phrase(opener.start, self.leaf(opener), self.leaf(closer))

    def struct_field(self, token: Token, sign: Token, value: Phrase) -> Phrase:
        return self.argument_named(token, sign, value)

    assigned_condition = struct_field
