"""Mistakes in the elements of a chart: a step without `:`, a transition without FROM and the like.

STEP and the other words of charts are names unless what follows fits, so that programs may have a variable `step`.  The
head of a damaged element therefore begins with a name, at the beginning of a statement or behind another element.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from fbvm.syntax.recovery.frames import ENDS, OPENERS, POUS, STATEMENT_WORDS, UNITS, anchor, frames
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.wording import found
from fbvm.syntax.st.automaton import ELEMENTS, Automaton
from fbvm.syntax.st.lexer import Lexer, Token
from fbvm.syntax.tree.sfc import QUALIFIERS, Step, Transition

HEADS = {"STEP": "STEP", "INITIAL_STEP": "STEP", "TRANSITION": "TRANSITION", "ACTION": "ACTION"}
"""Words that begin an element -> their terminals."""
INITIAL = {"INITIALSTEP", "INIT_STEP", "INITSTEP", "START_STEP", "INITIAL"}
"""What people write for INITIAL_STEP; INITIAL if STEP follows."""
ACTIONS_ONLY = "a step has no statements of its own: it names actions"
NOT_HERE = "what is to be executed in every scan belongs in an ACTION of a step, or in a POU of its own"
LONGEST_HEAD = 400
"""Characters of a head within which its mistake is looked for."""


def chart_mistake(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """The repair of a known mistake in a chart; None if there is none."""
    for known in (_damaged_head, _name, _qualifier, _statement_in_step, _in_transition, _behind):
        repair = known(automaton, token, following)
        if repair:
            return repair
    return None


# --- heads ------------------------------------------------------------------------------------------------------------


def _damaged_head(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`STEP Work`, `TRANSITION T1 := go;`"""
    place, height = anchor(automaton.states), len(automaton.states)
    if place.symbol == "some_actions" and height == place.size and len(following) > 1:
        word, behind = token, following[1]
    elif place.symbol == "ended_list" and height == place.size + 1:
        word, behind = automaton.before, token
    else:
        return None
    text = word.text.upper()
    known = HEADS.get(text) or ("INITIAL" if text in INITIAL and (text != "INITIAL" or behind.type == "STEP") else "")
    if text == "SFC" and behind.type in ELEMENTS:
        known = "SFC"
    if not known or not _first(automaton, word):
        return None
    return _HEADS[known](automaton, word, automaton.next() if word is token else token)


def _initial(automaton: Automaton, word: Token, behind: Token) -> Repair:
    step = Token("STEP", "INITIAL_STEP", word.start, word.end)
    rest = [] if behind.type == "STEP" else [behind]
    return Repair([step, *rest], word.start, word.end, f"{found(word)} is no word of a chart", "write INITIAL_STEP", cut=True,
                  lossless=True)


def _no_head(automaton: Automaton, word: Token, behind: Token) -> Repair:
    return Repair([behind], word.start, word.end, f"{found(word)} is no word of a chart",
                  "leave it out: steps stand behind the VAR sections", cut=True, lossless=True)


def _step(automaton: Automaton, word: Token, name: Token) -> Repair:
    """The repair of a STEP or ACTION without a name, or without `:` behind its name."""
    kind, text = HEADS[word.text.upper()], word.text.upper()
    article = "an" if text[0] in "AI" else "a"
    if name.type != "NAME" or not _on_line(automaton, word, name):
        rest = [] if name.type in ("COLON", "NUMBER") else [name]
        colon = [Token("COLON", ":", word.end, word.end)] if name.type != "NUMBER" else []
        if name.type == "NUMBER":
            message, advice = f"{found(name)} cannot be a name", f"a name begins with a letter: {text} S{name.text}:"
        else:
            message, advice = f"{article} {text} without a name", f"write {text} Name: .. END_{kind}"
        head = [Token(kind, word.text, word.start, word.end), Token("NAME", "?", word.end, word.end), *colon]
        return Repair([*head, *rest], word.start, word.end, message, advice, cut=True, lossless=False)
    behind = automaton.next()
    wrong = behind if _on_line(automaton, name, behind) else name
    while _on_line(automaton, name, behind) and behind.type not in ("COLON", "$END"):
        behind = automaton.next()
    rest = [] if behind.type == "COLON" else [behind]
    head = [Token(kind, word.text, word.start, word.end), name, Token("COLON", ":", name.end, name.end)]
    if wrong.type == "MINUS":
        whole = automaton.text[name.start:behind.start].strip()
        return Repair([*head, *rest], name.start, name.start + len(whole), f"`{whole}` is no name",
                      f"a name has letters, digits and `_`: {whole.replace('-', '_')}", cut=True, lossless=False)
    at = (name.end, name.end) if wrong is name else (wrong.start, wrong.end)
    return Repair([*head, *rest], *at, f"`:` expected behind the name of the {text}", f"write {text} {name.text}:", cut=True,
                  lossless=True)


def _transition(automaton: Automaton, word: Token, behind: Token) -> Repair | None:
    mistake = _mistake(automaton, word)
    at, message, advice = mistake or (word, "a TRANSITION that cannot be read", WHOLE)
    return Repair(pass_over(automaton, behind, "END_TRANSITION"), at.start, at.end, message, advice, cut=True, lossless=False)


_HEADS: dict[str, Callable[[Automaton, Token, Token], Repair | None]] = {
    "STEP": _step, "ACTION": _step, "INITIAL": _initial, "SFC": _no_head,
    "TRANSITION": _transition}


def _name(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`STEP 1:`"""
    word = automaton.before
    if token.type != "NUMBER" or word.type not in ("STEP", "ACTION") or automaton.values[-1:] != [word]:
        return None
    name = Token("NAME", f"S{token.text}", token.start, token.end)
    return Repair([name], token.start, token.end, f"{found(token)} cannot be a name", f"a name begins with a letter: {name.text}",
                  lossless=False)


# --- steps ------------------------------------------------------------------------------------------------------------


def _in_step(automaton: Automaton) -> bool:
    return anchor(automaton.states).symbol == "associations"


def _qualifier(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`Act N;`, `N Act;`, `Act : N;`"""
    before = automaton.before
    if not _in_step(automaton) or before.type != "NAME" or len(following) < 2 or automaton.values[-1:] != [before]:
        return None
    colon = token.type == "COLON"
    other = following[1] if colon else token
    if other.type != "NAME" or not _on_line(automaton, before, other):
        return None
    if other.text.upper() in QUALIFIERS:
        action, qualifier = before, other
    elif before.text.upper() in QUALIFIERS and not colon:
        action, qualifier = other, before
    else:
        return None
    if colon:
        automaton.next()
    at = qualifier.start, qualifier.end
    tokens = [action, Token("LPAR", "(", *at), Token("NAME", qualifier.text, *at), Token("RPAR", ")", *at)]
    return Repair(tokens, qualifier.start, qualifier.end, "a qualifier stands in parentheses behind its action",
                  f"write {action.text}({qualifier.text.upper()});", cut=True, lossless=True)


def _statement_in_step(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`STEP Work: a := TRUE; END_STEP`"""
    if not _in_step(automaton) or token.type not in STATEMENTS:
        return None
    place = anchor(automaton.states)
    begun = automaton.values[place.size - 1:]
    start = begun[0].start if begun and hasattr(begun[0], "start") else token.start
    step = next(value for value in reversed(automaton.values) if isinstance(value, Token) and value.type == "STEP")
    name = automaton.text[step.end:].split(":")[0].strip()
    return Repair(pass_over(automaton, token, "END_STEP", keep=True), start, token.end, ACTIONS_ONLY,
                  f"write {name}_action(N); here, and the statements in ACTION {name}_action: .. END_ACTION", cut=True,
                  lossless=False)


STATEMENTS = {*STATEMENT_WORDS, "ASSIGN", "OUTPUT", "SET_ASSIGN", "ATTEMPT", "DOT", "PART", "LSQB", "CARET", "COLON", "DIRECT"}
"""Tokens that show that an action of a step is a statement."""


# --- transitions ------------------------------------------------------------------------------------------------------

WHOLE = "write TRANSITION FROM step TO step := condition; END_TRANSITION"


def _in_transition(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`TRANSITION T1 FROM Start := go;`"""
    open_ = frames(automaton.states, automaton.values)
    if not open_ or open_[-1].word.type != "TRANSITION" or anchor(automaton.states).size > open_[-1].at:
        return None
    mistake = _mistake(automaton, open_[-1].word)
    if not mistake:
        return None
    at, message, advice = mistake
    return Repair(pass_over(automaton, token, "END_TRANSITION"), at.start, at.end, message, advice, cut=True, lossless=False)


Mistake = tuple[Token, str, str]
"""Where a transition is wrong, what is wrong, and what to write."""


class Head(NamedTuple):
    """The tokens of a transition up to the first `;` or END, and the positions among them of FROM, of TO and of the sign in
    front of the condition; a position is the number of tokens if there is no such token."""

    tokens: list[Token]
    from_: int
    to: int
    sign: int

    @property
    def kinds(self) -> list[str]:
        return [token.type for token in self.tokens]


def _mistake(automaton: Automaton, word: Token) -> Mistake | None:
    """The mistake of the transition that begins with `word`; None if it is not one of the known ones."""
    head = _head(automaton, word)
    return next((mistake for rule in _TRANSITION_RULES if (mistake := rule(head))), None)


def _without_steps(head: Head) -> Mistake | None:
    has_from, has_to = head.from_ < len(head.tokens), head.to < len(head.tokens)
    if not has_from and not has_to:
        return head.tokens[0], "the transition does not say which step it leaves and which it enters", WHOLE
    if not has_from:
        return head.tokens[head.to], "FROM and the step that is left are missing in front of TO", WHOLE
    if not has_to:
        where = head.tokens[min(head.from_ + 2, len(head.tokens) - 1)]
        return where, "TO and the step that is entered are missing", WHOLE
    return None


def _to_before_from(head: Head) -> Mistake | None:
    return (head.tokens[head.to], "FROM stands in front of TO", WHOLE) if head.to < head.from_ else None


def _no_priority(head: Head) -> Mistake | None:
    """Something between the name and FROM that is no `(PRIORITY := 1)`."""
    before = head.kinds[:head.from_]
    has_bracket, has_word = "LPAR" in before, "PRIORITY" in before
    if head.from_ > 2 and not has_bracket or head.from_ > 1 and has_bracket and not has_word:
        return head.tokens[2], "what stands between the name and FROM is no priority", "write (PRIORITY := 1)"
    return None


def _unbracketed_steps(head: Head) -> Mistake | None:
    """`FROM a, b TO c`"""
    for first, until in ((head.from_ + 1, head.to), (head.to + 1, head.sign)):
        names = head.tokens[first:until]
        joint = next((each for each in names if each.type in ("COMMA", "AND", "AMPERSAND")), None)
        if joint and names[0].type != "LPAR":
            listed = ", ".join(each.text for each in names if each.type == "NAME")
            return joint, "several steps stand in parentheses", f"write {head.tokens[first - 1].text} ({listed})"
    return None


def _no_sign(head: Head) -> Mistake | None:
    """`TO b` or `TO b go`"""
    behind = head.tokens[head.to + 1:head.to + 3]
    if head.sign < len(head.tokens) or not behind or behind[0].type != "NAME":
        return None
    advice = f"write TO {behind[0].text} := condition;"
    if len(behind) == 1:
        return behind[0], "the transition has no condition", advice
    return behind[1], "`:=` expected in front of the condition", advice


def _no_condition(head: Head) -> Mistake | None:
    """`:= IF a THEN`, `:= ;`"""
    if head.kinds[head.sign + 1:head.sign + 2] == ["IF"]:
        return head.tokens[head.sign + 1], "IF stands in front of a condition", "leave IF and THEN out: write := condition;"
    last = head.tokens[-1]
    if last.type == "ASSIGN":
        return last, "the transition has no condition", "write := TRUE; where the next scan is to leave the step"
    return None


_TRANSITION_RULES: tuple[Callable[[Head], Mistake | None], ...] = (
    _without_steps, _to_before_from, _no_priority, _unbracketed_steps, _no_sign, _no_condition)
"""Asked one after the other; each may rely on the ones before."""


def _head(automaton: Automaton, word: Token) -> Head:
    tokens: list[Token] = []
    for token in Lexer(automaton.text[word.start:word.start + LONGEST_HEAD], _silent).tokens():
        if tokens and (token.type in ("SEMICOLON", "$END") or token.type in OPENERS or token.type in HEADS):
            break
        tokens.append(Token(token.type, token.text, token.start + word.start, token.end + word.start))
    kinds, absent = [token.type for token in tokens], len(tokens)
    to = kinds.index("TO") if "TO" in kinds else absent
    sign = next((at for at, kind in enumerate(kinds) if at > to and kind in ("ASSIGN", "COLON", "EQUAL")), absent)
    return Head(tokens, kinds.index("FROM") if "FROM" in kinds else absent, to, sign)


def _silent(*message: object) -> None:
    """What is wrong with these characters is told elsewhere."""


# --- what stands between the elements ---------------------------------------------------------------------------------


def _behind(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """`END_STEP  a := TRUE;`: a statement where the next step could stand."""
    place = anchor(automaton.states)
    if place.symbol != "some_actions" or len(automaton.states) != place.size:
        return None
    if token.type not in STATEMENT_WORDS and token.type not in ("NAME", "DIRECT", "LADDER", "LPAR"):
        return None
    elements: Sequence[object] = automaton.values[-1]
    if any(isinstance(each, Step | Transition) for each in elements):
        message, advice = "a statement stands beside the steps and transitions of a chart", NOT_HERE
    else:
        message, advice = "a statement stands behind an ACTION", "the statements of the body stand in front of its ACTIONs"
    return Repair(pass_over(automaton, token, ""), token.start, token.end, message, advice, code="S0111", lossless=False)


def pass_over(automaton: Automaton, token: Token, end: str, keep: bool = False) -> list[Token]:
    """Pass over the tokens up to an END, or up to the next element if the END is missing.  Returns the token to go on with;
    none if that is the END, unless it is to `keep`."""
    while token.type not in UNITS and token.type not in ELEMENTS and token.type != "ACTION" and token.type not in _POU_ENDS:
        if token.type == end:
            return [token] if keep else []
        if token.text.upper() in HEADS and _first(automaton, token):
            break
        token = automaton.next()
    return [token]


_POU_ENDS = {ENDS[word] for word in POUS} | {"END_ACTIONS"}


def _first(automaton: Automaton, token: Token) -> bool:
    """Whether a token is the first on its line."""
    return not automaton.text[automaton.text.rfind("\n", 0, token.start) + 1:token.start].strip()


def _on_line(automaton: Automaton, before: Token, token: Token) -> bool:
    """Whether a token stands on the line of another one before it."""
    return "\n" not in automaton.text[before.end:token.start] and token.type != "$END"
