"""Builds the nodes of POUs and of whole source texts from what their sections, bodies, LADDERs and charts were built to
(grammar/declarations.lark, 6.6 and 6.7)."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.syntax.sfc.elements import Part, SfcElements
from fbvm.syntax.st.declarations import Settings
from fbvm.syntax.st.jumps import Jumps, Tangled
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.refused import refused_what
from fbvm.syntax.st.statements import Items
from fbvm.syntax.tree import (
    AccessVars,
    Action,
    Actions,
    Block,
    Declaration,
    Name,
    NamedType,
    Pou,
    Refused,
    RefusedStatement,
    SourceText,
    TypeSpec,
    VarSection,
)
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.ladder import Ladder
from fbvm.syntax.tree.sfc import Step, Transition

Head = tuple[Name, list[Refused]]
Section = VarSection | Refused | Settings
Element = Action | Step | Transition | Refused


class SourceBuilder(SfcElements):
    """The functions of the rules of POUs; with those that it inherits, the functions of all rules of the grammar."""

    def source_text(self, declarations: list[Declaration]) -> SourceText:
        return SourceText(0, len(self.source.text), tuple(declarations))

    # --- heads ---

    def add_inheritance(self, refused: list[Refused], word: Token, names: list[NamedType]) -> list[Refused]:
        what, code = refused_what(word.text)
        refused.append(Refused(word.start, names[-1].end, what, code))
        return refused

    def pou_head(self, modifiers: list[Token], token: Token, inheritance: list[Refused]) -> Head:
        """The name of a POU, and the parts of its head that are refused.  FINAL and the access words PUBLIC, PRIVATE ... are
        not among these: they change nothing that the POU does."""
        return self.declared(token), [*(self.refused(m) for m in modifiers if m.text.upper() == "ABSTRACT"), *inheritance]

    # --- POUs ---

    def pou(self, word: Token, head: Head, sections: list[Section], items: Items, actions: list[Element],
            end: Token) -> Pou:
        return self.function(word, head, None, None, sections, items, actions, end)

    def function(self, word: Token, head: Head, colon: Token | None, result: TypeSpec | None,
                 sections: list[Section], items: Items, elements: list[Element], end: Token) -> Pou:
        name, refused = head
        accesses = tuple(each for each in sections if isinstance(each, AccessVars) and word.type == "PROGRAM")
        refused += [_out_of_place(part) for part in (*sections, *elements)
                    if part not in accesses and not isinstance(part, VarSection | Action | Step | Transition)]
        body = self.block(_without_blocks(items, refused))
        self.refuse_self_references()
        declared = [each for each in sections if isinstance(each, VarSection)]
        actions = [each for each in elements if isinstance(each, Action)]
        self._add_ladders(word, actions, declared)
        declared += self._sections_of_lists()
        self.numbered = dict(self.numbered_everywhere)
        body = self._without_jumps(body, declared)
        if self.charted or any(isinstance(each, Step | Transition) for each in elements):
            body, actions = self._charts(word, body, elements, actions, declared)
        return Pou(word.start, end.end, word.text.upper(), name, result, tuple(declared), body, tuple(refused), tuple(actions),
                   accesses)

    def _add_ladders(self, word: Token, actions: list[Action], declared: list[VarSection]) -> None:
        """Add to `actions` the subroutines of the POU's LADDERs, and to `declared` what their rungs need."""
        if not self.ladders:
            return
        from fbvm.syntax.ladder.sections import hidden_sections, turn_condition_flags_off

        actions += [subroutine for ladder in self.ladders for subroutine in ladder.subroutines]
        if word.type == "PROGRAM":
            turn_condition_flags_off(self.ladders)
        declared += hidden_sections(self.ladders, declared, self.report)
        self.ladders.clear()

    def _without_jumps(self, body: Block, declared: list[VarSection]) -> Block:
        """The body of a POU with conditions and loops in place of its jumps, whose variables are added to `declared`; the same
        body if conditions and loops cannot do the same."""
        jumps = Jumps(self.targets, self.labels)
        for jump in jumps.astray():
            self.report("S0201", jump.start, jump.end, f"there is no label {self.targets[jump]} here",
                        "write `name:` in front of the statement to go on with")
        try:
            made = jumps.body(body) if self.targets or self.labels else body
        except Tangled:
            made = body
        else:
            declared += [jumps.section(body)] if jumps.flags else []
        self.targets.clear()
        self.labels.clear()
        return made

    def _charts(self, word: Token, body: Block, elements: Iterable[Element], actions: list[Action],
                declared: list[VarSection]) -> tuple[Block, list[Action]]:
        """The body and the actions of a POU with statements in place of charts, whose variables are added to `declared`."""
        from fbvm.syntax.sfc.charts import Charts

        charts = Charts(self, actions, declared)
        body = charts.body(word, body, [each for each in elements if not isinstance(each, Refused)])
        declared += charts.sections
        return body, charts.actions

    def _sections_of_lists(self) -> list[VarSection]:
        """The hidden sections with the temporaries of the POU's instruction lists."""
        lists = (each for each in self.lists if each.temporaries)
        made = [VarSection(each.start, each.end, "VAR_TEMP", (), each.temporaries, True) for each in lists]
        self.lists.clear()
        self.blocks.clear()
        return made

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
        return made

    # --- actions ---

    def action(self, word: Token, owner: Token | None, dot: Token | None, token: Token, colon: Token | None, items: Items,
               end: Token) -> Action:
        body = self.block(items)
        self.refuse_self_references()
        return Action(word.start, end.end, self.name(owner) if owner else None, self.declared(token), body)

    def action_chart(self, word: Token, token: Token, colon: Token, items: Items, parts: list[Part], end: Token) -> Action:
        made = self.action(word, None, None, token, colon, items, end)
        self.charted[made] = parts
        return made

    def actions_of(self, word: Token, owner: Token | None, actions: list[Element], end: Token) -> Actions:
        for part in (each for each in actions if isinstance(each, Step | Transition)):
            self.report("S0111", part.start, part.end, "a chart stands in its POU, not in ACTIONS", "")
        return Actions(word.start, end.end, self.name(owner) if owner else None,
                       tuple(a for a in actions if isinstance(a, Action)), tuple(a for a in actions if isinstance(a, Refused)))


def _without_blocks(items: Items, refused: list[Refused]) -> Items:
    """A list of statements without METHODs and the like, which are added to `refused`: these belong to the POU, not to its
    body."""
    blocks = [item for item in items if isinstance(item, RefusedStatement) and _is_block(item)]
    refused += [Refused(block.start, block.end, block.what, block.code) for block in blocks]
    return [item for item in items if item not in blocks] if blocks else items


def _is_block(statement: RefusedStatement) -> bool:
    """Whether a refused statement is a METHOD or the like."""
    return statement.what not in ("THIS", "SUPER", "JMP", "__TRY") and not statement.what.startswith("label")


def _out_of_place(item: Refused | Settings) -> Refused:
    """The refusal of a part that a POU cannot have."""
    if isinstance(item, Refused):
        return item
    return Refused(item.start, item.end, f"{'VAR_ACCESS' if isinstance(item, AccessVars) else 'VAR_CONFIG'} of a POU", "S0901")
