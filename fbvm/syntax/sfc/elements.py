"""Builds the nodes of steps and transitions (grammar/sfc.lark)."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.syntax.st.declarations import Declarations
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.statements import Items
from fbvm.syntax.tree import Action, Assign, Block, Call, CallStatement, Expr, Literal, Name, NameRef, Statement
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.node import changed
from fbvm.syntax.tree.sfc import QUALIFIERS, Association, Step, Transition

Part = Step | Transition


class SfcElements(Declarations):
    """The functions of the rules of steps and transitions."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.charted: dict[Action, list[Part]] = {}
        """Actions of the POU that is being read whose bodies are charts, with the elements of these.  Charts are lowered when
        the POU is complete, since they need to know all its actions."""

    def step(self, word: Token, token: Token, colon: Token, associations: list[Association], end: Token) -> Step:
        return Step(word.start, end.end, self.declared(token), word.text.upper() == "INITIAL_STEP", tuple(associations))

    def association(self, token: Token, opener: Token | None, given: list[Expr] | None, closer: Token | None,
                    end: Token) -> Association:
        values = list(given or ())
        qualifier = "N"
        first = values[0] if values else None
        if isinstance(first, NameRef) and first.text.upper() in QUALIFIERS:
            qualifier = first.text.upper()
            del values[0]
        elif first is not None:
            none = f", and {first.text} is none" if isinstance(first, NameRef) else ""
            self.report("S0112", first.start, first.end, f"the first thing in the parentheses is a qualifier{none}",
                        f"one of {', '.join(QUALIFIERS)}; indicators stand behind it")
            values.clear()
        time = values.pop(0) if values and QUALIFIERS[qualifier] else None
        return Association(token.start, end.end, self.name(token), qualifier, time, tuple(values))

    def transition(self, word: Token, token: Token | None, priority: int | None, from_: Token, sources: list[Name],
                   to: Token, targets: list[Name], sign: Token, condition: Expr, semicolon: Token, end: Token) -> Transition:
        self.depths.clear()
        return self._transition(word, token, priority, sources, targets, condition, None, end)

    def transition_body(self, word: Token, token: Token | None, priority: int | None, from_: Token, sources: list[Name],
                        to: Token, targets: list[Name], colon: Token, items: Items, end: Token) -> Transition:
        body = self.without_jumps(tuple(map(self._with_open_result, self.block(items))), word.start)
        only = body[0] if len(body) == 1 else None
        if isinstance(only, InstructionList):
            return self._condition_of_list(word, token, priority, sources, targets, only, end)
        if isinstance(only, CallStatement) and not isinstance(only.call, Call):
            self.report("S0101", colon.start, colon.end, "`:=` expected in front of the condition, but `:` found",
                        "behind `:` stand statements that assign the condition to the transition's name")
            return self._transition(word, token, priority, sources, targets, only.call, None, end)
        if token is None:
            self.report("S0111", word.start, word.end, "a transition with statements needs a name",
                        "the statements assign the condition to it; or write `:= condition;`")
            token = word
        return self._transition(word, token, priority, sources, targets, NameRef(token.start, token.end, token.text), body, end)

    def _with_open_result(self, made: Statement) -> Statement:
        """An instruction list without the statement that only works out its last current result."""
        if not isinstance(made, InstructionList) or not made.ends_with_result:
            return made
        kept = made.temporaries[:-1] if isinstance(made.body[-1], Assign) else made.temporaries
        at = self.lists.index(made)
        self.lists[at] = changed(made, body=made.body[:-1], temporaries=kept, ends_with_result=False)
        return self.lists[at]

    def _condition_of_list(self, word: Token, token: Token | None, priority: int | None, sources: list[Name], targets: list[Name],
                           made: InstructionList, end: Token) -> Transition:
        """A transition whose condition is the current result at the end of an instruction list (table 54)."""
        truth = made.result
        if truth is None:
            self.report("S0111", made.start, made.end, "this instruction list has no current result at its end",
                        "the condition is the last current result")
            truth = Literal(made.start, made.end, "bool", False, None, "FALSE")
        if not made.body:
            return self._transition(word, token, priority, sources, targets, truth, (made,), end)
        if token is None:
            self.report("S0111", word.start, word.end, "a transition whose instruction list stores, calls or jumps needs a name",
                        "write a name behind TRANSITION")
            token = word
        named = NameRef(token.start, token.end, token.text)
        body = (made, Assign(made.end, made.end, (named,), ":=", truth))
        return self._transition(word, token, priority, sources, targets, named, body, end)

    def _transition(self, word: Token, token: Token | None, priority: int | None, sources: list[Name],
                    targets: list[Name], condition: Expr, body: Block | None, end: Token) -> Transition:
        return Transition(word.start, end.end, self.declared(token) if token else None, priority, tuple(sources),
                          tuple(targets), condition, body)

    def step_names(self, token: Token) -> list[Name]:
        return [self.name(token)]

    def step_names_listed(self, opener: Token, names: list[Name], closer: Token) -> list[Name]:
        return names

    def step_name(self, token: Token) -> Name:
        return self.name(token)

    def priority(self, opener: Token, word: Token, sign: Token, number: Token, closer: Token) -> int | None:
        value = self.number(number).value
        if not isinstance(value, int):
            self.report("S0111", number.start, number.end, "a priority is a whole number", "the lowest one goes first")
            return None
        return value
