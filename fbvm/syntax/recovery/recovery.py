"""Reports a syntax error and finds where parsing can go on, so that one mistake hides no other and is reported once.

Three ways are tried in this order: a repair (`repairs`): a known mistake, or one token inserted, removed or replaced; the
blocks that are open: an END that is missing or has no beginning; giving up the statement or declaration."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic
from fbvm.syntax.recovery.chart_mistakes import pass_over
from fbvm.syntax.recovery.frames import (
    ENDS,
    HEADS,
    OPENERS,
    POUS,
    STATEMENT_WORDS,
    UNITS,
    Frame,
    anchor,
    cut,
    frames,
    open_head,
    reopen,
)
from fbvm.syntax.recovery.indentation import BLOCKS, advice, ends_alike
from fbvm.syntax.recovery.mistakes import open_bracket
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.repairs import BRACKETS, best_repair
from fbvm.syntax.recovery.wording import found, hint, sign, unlike
from fbvm.syntax.st.automaton import ELEMENTS, NESTING_LIMIT, Automaton
from fbvm.syntax.st.builder import CHAIN_LIMIT, Builder, Stop
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.lookahead import advance, expected

LOOK = 4
"""Tokens of look-ahead by which a repair is judged."""

HOLES = {"IF": ("TRUE",), "ELSIF": ("TRUE",), "WHILE": ("TRUE",), "UNTIL": ("TRUE",), "CASE": ("NUMBER",),
         "FOR": ("NAME", "ASSIGN", "NUMBER", "TO", "NUMBER")}
"""Word -> the terminals that are read in place of a head that cannot be parsed, so that its block can be parsed."""

PARTS = {*ELEMENTS, "ACTION"}
"""Words that begin an element of a chart."""

HOLE_TEXTS = {"NUMBER": "0", "NAME": "i"}


class Recovery:
    """Takes over from the automaton at an error, and hands it tokens to go on with."""

    def __init__(self, automaton: Automaton, builder: Builder) -> None:
        self.automaton, self.builder = automaton, builder
        self.states, self.values = automaton.states, automaton.values
        self.last = -1
        """Where the last error was reported; an error there or in front of it is a consequence and not reported."""
        self.mute = False
        """Whether the cause of the error was reported already: a comment without end, an unknown character."""
        self.seen: set[tuple[int, int]] = set()
        """Where the token was refused: offsets in the text with the height of the stack, to notice an endless loop."""

    # --- what the automaton calls ---

    def unexpected(self, token: Token) -> list[Token]:
        """Report that `token` cannot stand here and correct the stacks; returns the tokens to feed in its place.  Raises Stop."""
        if self.builder.full:
            raise Stop
        if self.turns_in_circles(token):
            return []
        following = self.peek(token)
        self.mute = self.swallowed(token) or self.unclosed(token) or any(
            self.automaton.before.end <= odd <= token.start for odd in self.builder.odd)
        reopen(self.states, self.values)
        repair = best_repair(self.automaton, token, following)
        if repair:
            return self.repaired(repair, token)
        if token.type in UNITS and self.amid(token):
            self.tell(token)
            return self.give_up(self.following())
        if token.type in OPENERS or token.type in UNITS or self.shows_end_of_section(token) or self.open_element(token):
            return self.closing(token)
        self.tell(token)
        return self.give_up(token)

    def swallowed(self, token: Token) -> bool:
        """Whether the text ends here because of a comment without end."""
        return token.type == "$END" and self.builder.cut_short

    def unclosed(self, token: Token) -> bool:
        """Whether a string without end ends on the line of a token, at or behind the token: quotes are mixed up."""
        line_end = self.automaton.text.find("\n", token.start)
        return any(token.start <= end and (end <= line_end or line_end < 0) for end in self.builder.unclosed)

    def turns_in_circles(self, token: Token) -> bool:
        """Whether the same token was refused at the same height before: then it is dropped, whatever it means."""
        if token.type == "$END":
            if len(self.states) == 1 or (token.start, len(self.states)) in self.seen:
                raise Stop
        elif (token.start, len(self.states)) in self.seen:
            self.automaton.before = token
            return True
        if all(start != token.start for start, _ in self.seen):
            self.seen.clear()
        self.seen.add((token.start, len(self.states)))
        return False

    def too_deep(self, token: Token, why: str) -> list[Token]:
        """Report that the nesting is too deep and give up the statement or, for blocks, the whole declaration.

        `why` is "operators" or "levels".  Returns the tokens to go on with."""
        if self.builder.full:
            raise Stop
        self.mute = False
        if why == "operators":
            self.report("S0106", token.start, token.end, f"the expression is more than {CHAIN_LIMIT} operators deep",
                        "split it into several statements")
            cut(self.states, self.values, anchor(self.states))
            return self.skip(token)
        self.report("S0106", token.start, token.end,
                    f"nested too deep: more than {NESTING_LIMIT} brackets, blocks or types inside one another",
                    "move the inner part into a function or function block of its own")
        outermost = next((f.at for f in frames(self.states, self.values)), 1)
        cut(self.states, self.values, anchor(self.states, outermost))
        while token.type not in UNITS:
            token = self.following()
        return [token]

    # --- messages ---

    def report(self, code: str, start: int, end: int, message: str, help_: str, opener: Token | None = None,
               lossless: bool = False) -> None:
        if start <= self.last or self.mute:
            return
        self.last = start
        source = self.builder.source
        related = (source, opener.start, f"{found(opener)} stands here") if opener else None
        self.builder.tell(Diagnostic(code, source, start, end, message, help_, related, lossless=lossless))

    def tell(self, token: Token) -> None:
        """Report what is expected and what was found."""
        kinds = expected(self.states)
        message = unlike(token, kinds)
        if token.type in BRACKETS and not open_bracket(self.automaton, BRACKETS[token.type]):
            message = f"{found(token)} without `{sign(BRACKETS[token.type])}`"
        self.report("S0101", self.place(token), token.end, message, hint(token, kinds))

    def place(self, token: Token) -> int:
        """Where a message about a token points: at its beginning; for the end of the text behind the last token."""
        return self.automaton.before.end if token.type == "$END" else token.start

    def repaired(self, repair: Repair, token: Token) -> list[Token]:
        """Report and execute a repair; returns the tokens to feed."""
        lossless = bool(repair.tokens) and not repair.cut if repair.lossless is None else repair.lossless
        self.report(repair.code, repair.start, repair.end, repair.message, repair.hint, repair.opener, lossless)
        self.last = max(self.last, repair.start)
        if repair.silent:
            self.builder.forget(repair.end, repair.silent)
        if repair.cut:
            cut(self.states, self.values, anchor(self.states))
        return repair.tokens

    # --- tokens ---

    def peek(self, token: Token) -> list[Token]:
        """The next tokens, `token` first, without taking them."""
        tokens = [token]
        while len(tokens) < LOOK and tokens[-1].type != "$END":
            tokens.append(self.automaton.next())
        self.automaton.ahead.extend(reversed(tokens[1:]))
        return tokens

    def following(self) -> Token:
        """Take the next token in place of one that is given up."""
        token = self.automaton.next()
        if token.type != "$END":
            self.automaton.before = token
        return token

    # --- ends that are missing or too many ---

    def shows_end_of_section(self, token: Token) -> bool:
        """Whether a token shows that the END of the VAR section or TYPE around it is missing."""
        place = anchor(self.states)
        return place.symbol in ("var_decls", "type_decls") and (token.type in STATEMENT_WORDS or token.type == "VAR")

    def open_element(self, token: Token) -> list[Frame]:
        """The open blocks from the element of a chart on, if a STEP, TRANSITION or ACTION shows that the END of the element is
        missing; else none."""
        open_ = frames(self.states, self.values) if token.type in PARTS else []
        first = next((at for at, frame in enumerate(open_) if frame.word.type in PARTS), len(open_))
        return open_[first:]

    def closing(self, token: Token) -> list[Token]:
        """A word that ends a block or begins something new: close the blocks that are still open inside, or drop the word."""
        open_ = frames(self.states, self.values)
        inner = open_
        if token.type in OPENERS:
            target = next((f for f in reversed(open_) if f.word.type in OPENERS[token.type]), None)
            if target is None:
                return self.other_end(open_[-1].word, token) if open_ else self.no_opener(token)
            inner = open_[open_.index(target) + 1:]
        elif token.type in PARTS:
            inner = self.open_element(token)
        elif token.type not in UNITS:
            inner = open_[-1:]
        if inner:
            self.mute = self.swallowed(token)
            return self.close(inner, token)
        self.tell(token)
        if open_head(self.states, self.values):
            return self.give_up(token)
        cut(self.states, self.values, anchor(self.states))
        if token.type in UNITS or advance(self.states, token.type):
            return [token]
        return self.behind_then() if token.type == "ELSIF" else []

    def behind_then(self) -> list[Token]:
        """Pass over the head of an ELSIF that follows an ELSE."""
        token = self.following()
        while token.type != "THEN":
            if token.type == "SEMICOLON" or self.stops(token):
                return [token]
            token = self.following()
        return []

    def amid(self, token: Token) -> bool:
        """Whether a word that begins a declaration stands in the middle of a line and of a statement."""
        before = self.automaton.before
        if token.type == "$END" or before.type == "SEMICOLON" or before.type in OPENERS:
            return False
        return bool(self.values) and "\n" not in self.builder.source.text[before.end:token.start]

    def other_end(self, word: Token, token: Token) -> list[Token]:
        """`IF .. END_FOR`: take the END of another block for the right one if the indentation says so."""
        end = ENDS[word.type]
        if not ends_alike(self.builder.source, word, token) or word.type not in BLOCKS:
            return self.no_opener(token)
        self.report("S0101", token.start, token.end, f"{sign(end)} expected, but {found(token)} found",
                    f"{sign(word.type)} ends with {sign(end)}", word, lossless=True)
        return [Token(end, end, token.start, token.end)]

    def no_opener(self, token: Token) -> list[Token]:
        words = " or ".join(map(sign, sorted(OPENERS[token.type])))
        self.report("S0101", token.start, token.end, f"{found(token)} without {words}", "", lossless=True)
        following = self.following()
        return [] if following.type == "SEMICOLON" else [following]

    def close(self, inner: list[Frame], token: Token) -> list[Token]:
        """End the open blocks, innermost first, and report each."""
        for frame in reversed(inner):
            place = anchor(self.states)
            self.tell_open(frame, token, place.size >= len(self.states))
            end = ENDS[frame.word.type]
            states = list(self.states)
            cut(states, [None] * len(states), place)
            if place.size > frame.at and advance(states, end):
                cut(self.states, self.values, place)
                self.automaton.feed(Token(end, end, token.start, token.start))
                self.automaton.settle()
            else:
                cut(self.states, self.values, anchor(self.states, frame.at))
        self.last = token.start
        return [token]

    def tell_open(self, frame: Frame, token: Token, lossless: bool) -> None:
        word, source = frame.word, self.builder.source
        line = source.place(word.start)[0]
        head = self.values[frame.at] if word.type in POUS and len(self.values) > frame.at else None
        name = f" `{head[0].text}`" if isinstance(head, tuple) else ""
        self.last = min(self.last, self.place(token) - 1)
        self.report("S0101", self.place(token), token.end,
                    f"{sign(ENDS[word.type])} expected before {found(token)}: "
                    f"the {word.text.upper()}{name} of line {line} is still open", advice(source, word, token), word, lossless)

    # --- giving up a part ---

    def give_up(self, token: Token) -> list[Token]:
        """Give up the statement or declaration; keep the block if only its head is wrong."""
        head = open_head(self.states, self.values)
        if head:
            return self.skip_head(head, token)
        place = anchor(self.states)
        lost = next((f.word for f in frames(self.states, self.values) if f.at >= place.size and f.word.type in PARTS), None)
        cut(self.states, self.values, place)
        if lost:
            return pass_over(self.automaton, token, ENDS[lost.type])
        if token.type in ("VAR", "VAR_GLOBAL") and place.symbol in ("ended_list", "some_actions"):
            while token.type not in ("END_VAR", "$END") and token.type not in POUS:
                token = self.following()
            return [] if token.type == "END_VAR" else [token]
        return self.skip(token)

    def skip_head(self, head: Frame, token: Token) -> list[Token]:
        """Go on behind THEN, DO or OF, as if a good head had stood in front of it."""
        word = head.word.type
        divider = HEADS[word]
        while token.type not in (divider, "SEMICOLON") and not self.stops(token):
            token = self.following()
        if token.type in UNITS or (word == "UNTIL" and token.type != divider):
            cut(self.states, self.values, anchor(self.states, head.at))
            return self.skip(token)
        del self.states[head.at + 1:]
        del self.values[head.at:]
        kinds = HOLES[word] if word == "UNTIL" else (*HOLES[word], divider)
        tokens = [Token(kind, HOLE_TEXTS.get(kind, sign(kind)), token.start, token.start) for kind in kinds]
        if token.type == "SEMICOLON" or (token.type == divider and word != "UNTIL"):
            return tokens
        return [*tokens, token]

    def stops(self, token: Token) -> bool:
        return token.type in OPENERS or token.type in UNITS or token.type in STATEMENT_WORDS

    def skip(self, token: Token) -> list[Token]:
        """Pass over tokens up to and including the next `;`, or up to a word that begins or ends a block."""
        symbol = anchor(self.states).symbol
        while True:
            kind = token.type
            if kind in UNITS:
                return [token]
            if symbol != "declarations":
                if kind == "SEMICOLON":
                    return []
                if kind in OPENERS:
                    return [token]
                if symbol == "ended_list" and (kind in STATEMENT_WORDS or kind == "VAR"):
                    return [token]
                if symbol == "var_decls" and kind == "VAR":
                    return [token]
            token = self.following()
