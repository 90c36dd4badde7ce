"""Builds the nodes of POUs and of whole source texts from what their sections, bodies, LADDERs and charts were built to
(grammar/declarations.lark, 6.6 and 6.7)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.syntax.sfc.elements import Part, SfcElements
from fbvm.syntax.st.declarations import Settings
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.statements import Items, Members
from fbvm.syntax.tree import (
    AccessVars,
    Action,
    Actions,
    Block,
    Declaration,
    Form,
    GlobalVars,
    Name,
    NamedType,
    Namespace,
    Pou,
    Refused,
    SourceText,
    TypeDecl,
    TypeSpec,
    Using,
    VarDecl,
    VarSection,
)
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.ladder import Ladder
from fbvm.syntax.tree.node import Node
from fbvm.syntax.tree.sfc import Step, Transition


class Behind(NamedTuple):
    """EXTENDS or IMPLEMENTS that stands behind VAR_GENERIC, with the names behind it."""

    word: str
    names: tuple[NamedType, ...]


Section = VarSection | Settings | Behind
Element = Action | Step | Transition | Members


class Head(NamedTuple):
    """The head of a POU: its name, the words in front of that, what it EXTENDS and IMPLEMENTS, and its USINGs."""

    name: Name
    modifiers: tuple[Name, ...]
    bases: tuple[NamedType, ...]
    interfaces: tuple[NamedType, ...]
    usings: tuple[Using, ...] = ()

    def with_usings(self, more: list[Using] | None) -> tuple[Using, ...]:
        """Its USINGs and those behind the type of its result."""
        return (*self.usings, *(more or ()))

    def with_more(self, sections: list[Section]) -> tuple[Head, list[Section]]:
        """The head with what stands behind VAR_GENERIC, and the sections without that."""
        more = [(each.word, name) for each in sections if isinstance(each, Behind) for name in each.names]
        head = self._replace(bases=(*self.bases, *(name for word, name in more if word == "EXTENDS")),
                             interfaces=(*self.interfaces, *(name for word, name in more if word == "IMPLEMENTS")))
        return head, [each for each in sections if not isinstance(each, Behind)]


Inherited = list[tuple[str, NamedType] | Using]
"""What stands behind the name of a POU: EXTENDS and IMPLEMENTS with a name each, and USING."""


class SourceBuilder(SfcElements):
    """The functions of the rules of POUs; with those that it inherits, the functions of all rules of the grammar."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.in_front: Pou | None = None
        """The POU whose actions may stand here, behind it; None within a POU."""
        self.elsewhere: list[Action | Actions] = []
        """Actions behind that POU which name another one."""

    def source_text(self, declarations: list[Declaration]) -> SourceText:
        self._usings_in_front(declarations)
        self._take_from_behind()
        self._refuse_outside(len(self.source.text))
        return SourceText(0, len(self.source.text), tuple(declarations))

    # --- namespaces ---

    def namespace(self, word: Token, modifiers: list[Token], name: NamedType, declarations: list[Declaration],
                  end: Token) -> Namespace:
        self._take_from_behind()
        words = tuple(Name(each.start, each.end, each.text.upper()) for each in modifiers)
        for each in words:
            if each.text != "INTERNAL":
                self.report("S0211", each.start, each.end, f"a NAMESPACE is not {each.text}", "it may be INTERNAL")
        kept = [each for each in declarations if isinstance(each, _IN_NAMESPACE) and not _is_program(each)]
        for outer in (each for each in declarations if each not in kept and not isinstance(each, Using)):
            what = "a PROGRAM" if isinstance(outer, Pou) else "VAR_GLOBAL" if isinstance(outer, GlobalVars) else "this"
            self.report("S0211", outer.start, outer.end, f"{what} cannot stand in a NAMESPACE", "put it behind END_NAMESPACE")
        return Namespace(word.start, end.end, name, words, self._usings_in_front(declarations), tuple(kept))

    def using(self, word: Token, names: list[NamedType], end: Token) -> Using:
        return Using(word.start, end.end, tuple(names))

    def _usings_in_front(self, declarations: list[Declaration]) -> tuple[Using, ...]:
        """The USINGs among some declarations; one that stands behind another declaration is reported."""
        other = next((each.start for each in declarations if not isinstance(each, Using)), len(self.source.text))
        usings = tuple(each for each in declarations if isinstance(each, Using))
        for late in (each for each in usings if each.start > other):
            self.report("S0211", late.start, late.end, "USING stands behind a declaration", "put it in front of the first one")
        return usings

    # --- heads ---

    def add_inheritance(self, parts: Inherited, word: Token, names: list[NamedType]) -> Inherited:
        parts += [(word.text.upper(), name) for name in names]
        return parts

    def add_using(self, parts: Inherited, using: Using) -> Inherited:
        parts.append(using)
        return parts

    def add_inheritance_behind(self, sections: list[Section], word: Token, names: list[NamedType]) -> list[Section]:
        """EXTENDS and IMPLEMENTS behind VAR_GENERIC, as CODESYS writes a block with generic constants."""
        before = sections[-1] if sections else None
        if isinstance(before, VarSection) and before.kind != "VAR_GENERIC":
            self.report("S0101", word.start, word.end, f"{word.text} stands behind the name of the block",
                        "only VAR_GENERIC may stand between them")
        sections.append(Behind(word.text.upper(), tuple(names)))
        return sections

    def generic_type(self, token: Token, colon: Token, kind: Token) -> tuple[Token, Token]:
        return token, kind

    def generics(self, opener: Token, types: list[tuple[Token, Token]], closer: Token) -> None:
        """`<T : ANY_NUM>`: in the POU T means ANY_NUM, which is one type in each call."""
        self.forms.append(Form("generic_functions", opener.start, closer.end, (
            "S0901", "generic types behind the name of a function are of RuSTy", "declare the parameters as ANY_NUM and so on")))
        self.generic_types = {token.text.upper(): kind.text for token, kind in types}
        if len({kind.text.upper() for _, kind in types}) < len(types):
            self.report("S0901", opener.start, closer.end, "two generic types of one kind are not told apart",
                        "give them two kinds, such as ANY_NUM and ANY_INT")

    def pou_head(self, modifiers: list[Token], token: Token, generics: None, inheritance: Inherited) -> Head:
        self._take_from_behind()
        words = tuple(Name(each.start, each.end, each.text.upper()) for each in modifiers)
        named = [each for each in inheritance if not isinstance(each, Using)]
        return Head(self.declared(token), words, tuple(each for word, each in named if word == "EXTENDS"),
                    tuple(each for word, each in named if word == "IMPLEMENTS"),
                    tuple(each for each in inheritance if isinstance(each, Using)))

    # --- POUs ---

    def pou(self, word: Token, head: Head, sections: list[Section], items: Items, actions: list[Element],
            end: Token) -> Pou:
        return self.function(word, head, None, None, None, sections, items, actions, end)

    def function(self, word: Token, head: Head, colon: Token | None, result: TypeSpec | None, usings: list[Using] | None,
                 sections: list[Section], items: Items, elements: list[Element], end: Token) -> Pou:
        self._refuse_outside(word.start)
        head, sections = head.with_more(sections)
        accesses = tuple(each for each in sections if isinstance(each, AccessVars) and word.type == "PROGRAM")
        refused = tuple(_out_of_place(each) for each in sections if isinstance(each, Settings) and each not in accesses)
        methods = [method for each in (*items, *elements) if isinstance(each, Members) for method in each.methods]
        body = self.block([each for each in items if not isinstance(each, Members)])
        declared = [each for each in sections if isinstance(each, VarSection)]
        actions = [each for each in elements if isinstance(each, Action)]
        self._add_ladders(self.ladders, [], word.type == "PROGRAM", actions, declared)
        declared += _sections_of(self.lists)
        body = self.without_jumps(body)
        declared += self.jump_sections
        if self.charted or any(isinstance(each, Step | Transition) for each in elements):
            body, actions = self._charts(word, body, elements, actions, declared)
        self.generic_types = {}
        kind = "FUNCTION_BLOCK" if word.type == "FUNCTION_BLOCK" else word.text.upper()
        self.in_front = Pou(word.start, end.end, kind, head.name, result, tuple(declared), body, refused,
                            tuple(actions), accesses, head.modifiers, head.bases, head.interfaces, tuple(methods),
                            head.with_usings(usings))
        return self.in_front

    def _take_from_behind(self) -> None:
        """Give the POU in front what its actions behind it need: another POU begins here, or the text ends.  Until here
        rungs, lists and jumps are counted on from those within the POU, so that their variables have other names."""
        pou, self.in_front = self.in_front, None
        if pou is None:
            return

        def is_own(made: Node) -> bool:
            return made.start > pou.end and not any(each.start < made.start < each.end for each in self.elsewhere)

        def is_other(made: Node) -> bool:
            return made.start > pou.end and not is_own(made)

        sections, actions = list(pou.sections), list(pou.actions)
        within = [each for each in self.ladders if each.start < pou.end]
        self._add_ladders(list(filter(is_own, self.ladders)), within, pou.kind == "PROGRAM", actions, sections)
        sections += [*_sections_of(filter(is_own, self.lists)), *filter(is_own, self.jump_sections)]
        pou.sections, pou.actions = tuple(sections), tuple(actions)
        self.ladders = list(filter(is_other, self.ladders))
        self.lists = list(filter(is_other, self.lists))
        self.jump_sections = list(filter(is_other, self.jump_sections))
        self._refuse_outside(len(self.source.text))
        self.elsewhere.clear()
        self.blocks.clear()
        self.numbered = dict(self.numbered_everywhere)

    def interface(self, word: Token, head: Head, members: list[Members], end: Token) -> Pou:
        methods = tuple(method for each in members for method in each.methods)
        return Pou(word.start, end.end, "INTERFACE", head.name, None, (), (), modifiers=head.modifiers, bases=head.bases,
                   interfaces=head.interfaces, methods=methods, usings=head.usings)

    # --- methods and properties ---

    def method(self, word: Token, head: Head, colon: Token | None, result: TypeSpec | None, usings: list[Using] | None,
               sections: list[Section], items: Items, end: Token) -> Members:
        with self._apart(word.start):
            made = self.function(word, head, colon, result, usings, sections, items, [], end)
        return Members(word.start, end.end, (made,))

    def accessor(self, modifiers: list[Token], word: Token, sections: list[Section], items: Items, end: Token) -> Pou:
        """GET or SET of a property, whose name and type `property` puts in."""
        start = modifiers[0].start if modifiers else word.start
        head = Head(self.name(word), tuple(Name(each.start, each.end, each.text.upper()) for each in modifiers), (), ())
        with self._apart(start):
            made = self.function(word, head, None, None, None, sections, items, [], end)
        if end.text.upper() != f"END_{word.text.upper()}":
            self.report("S0101", end.start, end.end, f"END_{word.text.upper()} expected, but {end.text} found", "")
        return made

    def property(self, word: Token, head: Head, colon: Token, spec: TypeSpec, accessors: list[Pou], end: Token) -> Members:
        methods: list[Pou] = []
        for each in accessors:
            value = VarDecl(head.name.start, spec.end, (head.name,), None, spec, None)
            sections = (VarSection(head.name.start, spec.end, "VAR_INPUT", (), (value,), True), *each.sections)
            own = tuple(word.text for word in each.modifiers)
            modifiers = (*(word for word in head.modifiers if not (own and word.text in _ACCESS)), *each.modifiers)
            getting = each.kind == "GET"
            if any(known.kind == each.kind for known in methods):
                self.report("S0101", each.start, each.end, f"{head.name.text} has two {each.kind}", "")
                continue
            methods.append(Pou(head.name.start, each.end, each.kind, head.name, spec if getting else None,
                               each.sections if getting else sections, each.body, each.refused, modifiers=modifiers))
        if not accessors:
            self.report("S0101", head.name.start, head.name.end, f"the PROPERTY {head.name.text} has neither GET nor SET",
                        "write GET .. END_GET, SET .. END_SET, or both")
        return Members(word.start, end.end, tuple(methods))

    def property_half(self, word: Token, head: Head, colon: Token, spec: TypeSpec, sections: list[Section], items: Items,
                      end: Token) -> Members:
        """`PROPERTY_GET name : T .. END_PROPERTY` and PROPERTY_SET: one accessor of a property."""
        kind = word.text.upper().removeprefix("PROPERTY_")
        accessor = self.accessor([], Token("ACCESSOR", kind, word.start, word.end), sections, items,
                                 Token("END_ACCESSOR", f"END_{kind}", end.start, end.end))
        return self.property(word, head, colon, spec, [accessor], end)

    @contextmanager
    def _apart(self, start: int) -> Iterator[None]:
        """Build what was read from `start` on as a POU of its own, inside the POU that is being read."""
        ladders, lists, targets, labels = self.ladders, self.lists, self.targets, self.labels
        blocks, numbered, charted, jump_sections = dict(self.blocks), self.numbered, self.charted, self.jump_sections
        self.ladders = [each for each in ladders if each.start >= start]
        self.lists = [each for each in lists if each.start >= start]
        self.targets = {each: name for each, name in targets.items() if each.start >= start}
        self.labels = {each: name for each, name in labels.items() if each.start >= start}
        self.charted, self.jump_sections = {}, []
        yield
        self.in_front = None
        self.ladders = [each for each in ladders if each.start < start]
        self.lists = [each for each in lists if each.start < start]
        self.targets = {each: name for each, name in targets.items() if each.start < start}
        self.labels = {each: name for each, name in labels.items() if each.start < start}
        self.rungs = _rungs(self.ladders)
        self.blocks, self.numbered, self.charted, self.jump_sections = blocks, numbered, charted, jump_sections

    def _add_ladders(self, ladders: list[Ladder], others: list[Ladder], is_program: bool, actions: list[Action],
                     declared: list[VarSection]) -> None:
        """Add to `actions` the subroutines of LADDERs of a POU, and to `declared` what their rungs need.  `others` are LADDERs
        of the POU for which that was done."""
        if not ladders:
            return
        from fbvm.syntax.ladder.sections import hidden_sections, turn_condition_flags_off

        actions += [subroutine for ladder in ladders for subroutine in ladder.subroutines]
        if is_program:
            turn_condition_flags_off(ladders, others)
        declared += hidden_sections(ladders, declared, self.report)

    def _charts(self, word: Token, body: Block, elements: Iterable[Element], actions: list[Action],
                declared: list[VarSection]) -> tuple[Block, list[Action]]:
        """The body and the actions of a POU with statements in place of charts, whose variables are added to `declared`."""
        from fbvm.syntax.sfc.charts import Charts

        charts = Charts(self, actions, declared)
        body = charts.body(word, body, [each for each in elements if not isinstance(each, Members)])
        declared += charts.sections
        return body, charts.actions

    def instruction_list(self, token: Token) -> InstructionList:
        """A body in the instruction list, which has a front end of its own."""
        from fbvm.syntax.il.lowering import read_list

        made = read_list(self, token)
        self.lists.append(made)
        return made

    def ladder(self, token: Token) -> Ladder:
        """LADDER .. END_LADDER, which has a front end of its own."""
        from fbvm.syntax.ladder.lowering import read_ladder

        made = read_ladder(self, token)
        self.ladders.append(made)
        self.rungs += len(made.rungs)
        return made

    # --- actions ---

    def action(self, word: Token, owner: Token | None, dot: Token | None, token: Token, colon: Token | None, items: Items,
               end: Token) -> Action:
        body = self.without_jumps(self.block(items), word.start)
        made = Action(word.start, end.end, self.name(owner) if owner else None, self.declared(token), body)
        self._note_owner(made)
        return made

    def action_chart(self, word: Token, token: Token, colon: Token, items: Items, parts: list[Part], end: Token) -> Action:
        made = self.action(word, None, None, token, colon, items, end)
        self.charted[made] = parts
        return made

    def actions_of(self, word: Token, owner: Token | None, actions: list[Element], end: Token) -> Actions:
        for part in (each for each in actions if isinstance(each, Step | Transition)):
            self._refuse_chart(part)
        made = Actions(word.start, end.end, self.name(owner) if owner else None,
                       tuple(each for each in actions if isinstance(each, Action)))
        self._note_owner(made)
        return made

    def _note_owner(self, made: Action | Actions) -> None:
        if self.in_front is not None and made.owner is not None and fold(made.owner.text) != fold(self.in_front.name.text):
            self.elsewhere.append(made)

    def _refuse_outside(self, end: int) -> None:
        """Report what stands in actions outside of POUs, up to `end`, and needs variables of a POU that is not in front."""
        for action in [each for each in self.charted if each.start < end]:
            self._refuse_chart(self.charted.pop(action)[0])
        wrong: list[tuple[str, str, Sequence[Node]]] = [
            ("S0110", "a LADDER stands in its", self.ladders),
            ("S0114", "this instruction list stands in its", [each for each in self.lists if each.temporaries]),
            ("S0101", "statements with jumps stand in their", self.jump_sections)]  # fmt: skip
        for code, what, found in wrong:
            for each in (each for each in found if each.start < end):
                self.report(code, each.start, each.end, f"{what} POU, or directly behind it", _BEHIND)
        self.ladders = [each for each in self.ladders if each.start >= end]
        self.lists = [each for each in self.lists if each.start >= end]
        self.jump_sections = [each for each in self.jump_sections if each.start >= end]
        self.rungs = _rungs(self.ladders)

    def _refuse_chart(self, part: Part) -> None:
        self.report("S0111", part.start, part.end, "a chart stands in its POU, not behind it", "")


_BEHIND = "put the ACTION into its POU, or behind it before another POU begins"
_ACCESS = ("PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL")


_IN_NAMESPACE = (Pou, TypeDecl, Namespace, Action, Actions)


def _sections_of(lists: Iterable[InstructionList]) -> list[VarSection]:
    """The hidden sections with the temporaries of instruction lists."""
    return [VarSection(each.start, each.end, "VAR_TEMP", (), each.temporaries, True) for each in lists if each.temporaries]


def _rungs(ladders: Sequence[Ladder]) -> int:
    return sum(len(ladder.rungs) for ladder in ladders)


def _is_program(declaration: Declaration) -> bool:
    return isinstance(declaration, Pou) and declaration.kind == "PROGRAM"


def _out_of_place(item: Settings) -> Refused:
    """The refusal of a part that a POU cannot have."""
    return Refused(item.start, item.end, f"{'VAR_ACCESS' if isinstance(item, AccessVars) else 'VAR_CONFIG'} of a POU")
