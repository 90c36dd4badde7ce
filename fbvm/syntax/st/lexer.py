"""Characters to tokens: words, literals, signs; comments skipped, pragmas collected.

The patterns and words come from `grammar/common.lark`.  A word that the grammar takes only in some places is handed on
as that word; the automaton makes it a name where the word cannot stand.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

from fbvm.base.dialects import takers
from fbvm.syntax.st.comments import CLOSERS, comment_end
from fbvm.syntax.st.foreign import LITERALS, OPERATORS, SIGNS
from fbvm.syntax.st.pragmas import GENERATOR, NO_EFFECT, attribute_name, dialectal, harmless
from fbvm.syntax.st.tables import Terminal, tables
from fbvm.syntax.tree import Form, Pragma

Report = Callable[..., None]
"""Called with code, start, end, message and hint."""


class Token(NamedTuple):
    """A terminal of the grammar as it stands in the text; `type` "$END" ends the stream."""

    type: str
    text: str
    start: int
    end: int


MISSPELT = {
    "ELSEIF": "ELSIF", "ELIF": "ELSIF", "ENDIF": "END_IF", "ENDFOR": "END_FOR", "ENDWHILE": "END_WHILE",
    "ENDCASE": "END_CASE", "ENDREPEAT": "END_REPEAT", "ENDVAR": "END_VAR", "ENDSTRUCT": "END_STRUCT",
    "ENDTYPE": "END_TYPE", "ENDFUNCTION": "END_FUNCTION", "ENDFUNCTION_BLOCK": "END_FUNCTION_BLOCK",
    "ENDPROGRAM": "END_PROGRAM", "ENDSTEP": "END_STEP", "ENDTRANSITION": "END_TRANSITION", "ENDACTION": "END_ACTION",
    "END_TRANS": "END_TRANSITION", "END_VAR_INPUT": "END_VAR", "END_VAR_OUTPUT": "END_VAR", "END_VARS": "END_VAR",
    "VARINPUT": "VAR", "VAROUTPUT": "VAR", "VARINOUT": "VAR", "FUNCTIONBLOCK": "FUNCTION_BLOCK",
    "END_FUNCTIONBLOCK": "END_FUNCTION_BLOCK",
    "SWITCH": "CASE", "BREAK": "EXIT", "END": "END_"}
"""Word of another language, or of ours without its `_` -> the terminal that is meant.  These words have the type MISSPELT and
are names where names fit; so have END with a space behind it, and words that begin with VAR_."""

_JOINED = {"FUNCTIONBLOCK": "FUNCTION_BLOCK", "END_FUNCTIONBLOCK": "END_FUNCTION_BLOCK"}
"""Those of them that some dialects take, and that are these words at the beginning of a line."""

def _joined(text: str, start: int, end: int) -> str:
    """The terminal of a word that stands joined at the beginning of a line, and is no name; "" for other words."""
    begins = not text[text.rfind("\n", 0, start) + 1:start].strip()
    return _JOINED.get(text[start:end].upper(), "") if begins and not _USED_AS_NAME.match(text, end) else ""


_USED_AS_NAME = re.compile(r"\s*[,:;.(\[^]")
_END_OF = re.compile(r"(?i)[ \t]+(?:IF|CASE|FOR|WHILE|REPEAT|VAR|STRUCT|TYPE|FUNCTION|FUNCTION_BLOCK|PROGRAM|STEP|TRANSITION|"
                     r"ACTION)\b")


_LIST_ENDS = re.compile(r"""(?isx) // [^\n]* | \(\* .*? \*\) | /\* .*? \*/ | \{ [^}]* \} | (?P<text> '[^'\n]*' | "[^"\n]*")
                        | (?P<end> \b (?:END_\w+ | ACTION | TRANSITION | STEP | INITIAL_STEP) \b) | (?P<other> ; | \bLADDER\b)""")
"""What is passed over in an instruction list, what ends it, and what shows that it is none."""
_FIRST = re.compile(r"[ \t]*(?:\w+[ \t]*:[ \t]*)?")
"""What may stand on its line in front of the first instruction of an instruction list."""
_LABEL_BEHIND = re.compile(r"[ \t]+[A-Za-z_]\w*[ \t]*(?:\r?\n|\(\*|//)")
_FORMAL_CALL = re.compile(r"""(?isx) [ \t]* \( [ \t]* \r?\n [^()]* \n [ \t]* \) [ \t]* \r?\n \s*
                          (?: ST | S | R | CAL | RET | JMP | ADD | SUB | MUL | DIV | AND | OR | XOR | GT | GE | EQ | NE | LE
                          | LT) C? N? [ \t\r\n] """)
"""What stands behind the name of a function with which an instruction list begins: arguments on lines of their own, and an
operator on the line behind them."""
_PLACES = frozenset(("AT", "END_VAR"))
"""Terminals behind which a name may begin something that is none."""
_READ_AGAIN = frozenset(("FOREIGN", "TYPED_LITERAL", "STRING_LITERAL"))
_QUOTED = re.compile(r"""'(?:\$.|[^'$\r\n])*'|"(?:\$.|[^"$\r\n])*\"""")
_END_LADDER = re.compile(r"(?im)^[ \t]*END_LADDER\b")


def meant(text: str) -> str:
    """The terminal that is meant by a misspelt word."""
    word = text.upper()
    if word.startswith("END") and word[3:4].isspace():
        return f"END_{word[3:].strip()}"
    return MISSPELT.get(word, "VAR")


_RAILS = "│├┃┣"
_DRAWN = re.compile(rf"(?:[ \t]*[{_RAILS}][^\n]*\n)+")
"""Lines that begin with the left rail of a rung."""
END_OF_FILE = "\x1a\0"
"""Characters with which older systems fill a file behind its end."""
_FILLED = re.compile(rf"[{END_OF_FILE} \t\r\n]*+\Z")
NO_VALUE = ("<<", ">>", "++", "--")
"""Operators of other languages for which there is none of ours."""
_WORDS = r"(?s:\(?([A-Z_]+(?:\|[A-Z_]+)*)\)?(\(\?[=!].*)?)"
_ORDER = ("NAME", "PART", "COMMENT", "FOREIGN", "SIGN", "NUMBER", "DATE_LITERAL", "TYPED_LITERAL", "STRING_LITERAL", "DIRECT")
_BEHIND_DURATION = re.compile(
    r"(?i)(L?T(?:IME)?#)([ \t]*)(?:(?<=[ \t])-?[0-9][0-9a-z_.]*|(?<=#)[0-9]+(?:\.[0-9]+[a-z_0-9]*){2,})")
"""A duration of which the pattern of a literal takes only the beginning: with a blank behind `#`, or with two fractions."""
_GLUED = re.compile(r"(?i)([0-9]+)(DO|THEN|TO|BY|OF)")
"""A number and the word behind it without a blank between them."""
_NAMED_BIT = re.compile(r"(?i)(?<=\.)%X(?=[A-Z_])")
OPERAND_ENDS = {"NAME", "RPAR", "RSQB", "CARET", "DIRECT", "PART"}


class Lexis(NamedTuple):
    """The words and characters of the grammar, as tables and patterns."""

    words: dict[str, str]
    """Word in capitals -> terminal."""
    conditions: dict[str, re.Pattern[str]]
    """Terminal -> pattern of the text that must follow the word."""
    in_context: frozenset[str]
    """Terminals of words whose meaning depends on the text behind them."""
    reserved: frozenset[str]
    operand_ends: frozenset[str]
    """Terminals with which an operand may end."""
    signs: dict[str, str]
    master: re.Pattern[str]
    location: re.Pattern[str]
    unknown: re.Pattern[str]
    """A run of characters with which no token begins."""
    foreign_word: re.Pattern[str]
    """A word with letters of any alphabet."""
    set_assign: re.Pattern[str]


@cache
def lexis() -> Lexis:
    """The lexis of the grammar in use."""
    words = dict.fromkeys(MISSPELT, "MISSPELT")
    conditions: dict[str, re.Pattern[str]] = {}
    reserved: set[str] = set()
    signs: dict[str, str] = {}
    patterns: dict[str, str] = {}
    for terminal in tables("st").terminals:
        shape = re.fullmatch(_WORDS, terminal.pattern)
        if shape and terminal.ignore_case:
            words.update(dict.fromkeys(shape[1].split("|"), terminal.name))
            if shape[2]:
                conditions[terminal.name] = re.compile(shape[2], re.IGNORECASE)
            if terminal.reserved:
                reserved.add(terminal.name)
        elif terminal.literal:
            signs[terminal.pattern] = terminal.name
        else:
            patterns[terminal.name] = _pattern(terminal)
    patterns["COMMENT"] = r"//[^\n]*|\(\*|/\*"
    patterns["FOREIGN"] = r"==|:==|><|>[ \t]+=|<[ \t]+[=>]" + (
        r"|=<|<<|>>|->|!=|&&|\|\||[-+*/]=|=:|:[ \t]+=(?!>)|(?:\+\+|--)(?=\s*;)|[!|~]|%(?![A-Za-z*])")
    patterns["SIGN"] = "|".join(re.escape(sign) for sign in sorted(signs, key=len, reverse=True))
    alternatives = "|".join(f"(?P<{name}>{patterns[name]})" for name in _ORDER)
    begins = "|".join(patterns[name] for name in ("COMMENT", "FOREIGN", "SIGN"))
    return Lexis(
        words, conditions, frozenset({*conditions, "MISSPELT", "LADDER"}), frozenset(reserved),
        frozenset(OPERAND_ENDS | set(words.values()) - reserved), signs,
        re.compile(rf"\s*(?:{alternatives})"), re.compile(r"\s*(" + patterns["LOCATION"] + ")"),
        re.compile(rf"(?:(?!{begins})[^\s\w'\"{{%])+"), re.compile(r"[^\W0-9]\w*"), re.compile(patterns["SET_ASSIGN"]))


def _pattern(terminal: Terminal) -> str:
    return f"(?i:{terminal.pattern})" if terminal.ignore_case else f"(?:{terminal.pattern})"


class Kinds(dict[str, str]):
    """Word as written -> terminal, for the words of one text as they are met."""

    def __init__(self, words: dict[str, str]) -> None:
        super().__init__()
        self.words = words

    def __missing__(self, word: str) -> str:
        upper = word.upper()
        kind = self[word] = self.words.get(upper) or ("MISSPELT" if upper[:4] == "VAR_" else "NAME")
        return kind


class Lexer:
    """The tokens of one text, in order; `pragmas` fills while they are taken.  Without `lists`, an instruction list is not one
    token: its words are."""

    def __init__(self, text: str, report: Report, lists: bool = True) -> None:
        self.text, self.report, self.lists = text, report, lists
        self.pragmas: list[Pragma] = []
        self.forms: list[Form] = []
        """What only some dialects take."""
        self._line = (0, 0)
        """The place whose line was asked for last, and where that begins."""

    def tokens(self, start: int = 0) -> Iterator[Token]:
        """Every token from an offset on, then one of type "$END"."""
        text, at, lex = self.text, start, lexis()
        match, signs, kinds, in_context, ends = lex.master.match, lex.signs, Kinds(lex.words), lex.in_context, lex.operand_ends
        before, length, new = "", len(text), tuple.__new__
        while True:
            found = match(text, at)
            if found is None:
                odd, at = self._odd(lex, at)
                if odd:
                    before = odd.type
                    yield odd
                if at >= length:
                    break
                continue
            kind, at = found.lastgroup or "", found.end()
            word = found[kind]
            start = at - len(word)
            if kind == "SIGN":
                kind = signs[word]
            elif kind == "NAME":
                kind = kinds[word]
                if kind in in_context:
                    kind, at = self._word_in_context(lex, kind, start, at)
                    word = text[start:at]
                elif before in _PLACES or (before in ends and text.startswith("=", at)):
                    kind, at = self._special(lex, before, kind, start, at)
                    word = text[start:at]
            elif kind == "COMMENT":
                if word[:2] != "//":
                    at = self._comment(start)
                continue
            elif kind in _READ_AGAIN:
                kind, word, at = self._read_again(kind, word, start, at)
                if not kind:
                    continue
            elif before == "AT":
                kind, at = self._special(lex, before, kind, start, at)
                word = text[start:at]
            elif kind == "NUMBER" and word[-1] > "9" and (glued := _GLUED.fullmatch(word)):
                word, at = glued[1], start + glued.end(1)
                self.forms.append(Form("glued_words", start, start + glued.end(), (
                    "S0105", f"`{glued[0]}` is no number", f"write a blank between {word} and {glued[2]}")))
            yield new(Token, (kind, word, start, at))
            before = kind
        yield Token("$END", "", length, length)

    def _word_in_context(self, lex: Lexis, kind: str, start: int, end: int) -> tuple[str, int]:
        """The terminal of a word that depends on the text behind the word, and where its token ends."""
        condition = lex.conditions.get(kind)
        if condition is not None and not condition.match(self.text, end):
            if kind == "JMP" and _LABEL_BEHIND.match(self.text, end) and (last := self._instruction_list(start)):
                return "INSTRUCTION_LIST", last
            kind = "NAME"
        if kind == "MISSPELT" and (joined := _joined(self.text, start, end)):
            self.forms.append(Form("joined_words", start, end, (
                "S0101", f"`{self.text[start:end]}` is no word of Structured Text", f"write {joined}")))
            return joined, end
        if kind == "MISSPELT" and end - start == len("END"):
            end_of = _END_OF.match(self.text, end)
            return (kind, end_of.end()) if end_of else ("NAME", end)
        if kind == "LADDER":
            return kind, self._ladder(start, end)
        if kind == "INSTRUCTION_LIST":
            last = self._instruction_list(start)
            if last:
                return kind, last
            kind = "NAME"
        return kind, end

    def _read_again(self, kind: str, word: str, start: int, end: int) -> tuple[str, str, int]:
        """Terminal, text and end of an operator of another language, for which the terminal is empty if we have none, or of a
        literal; of a duration the pattern of literals takes only the beginning in `T# 30s` and `T#1.0s500.0ms`."""
        if kind == "FOREIGN":
            return *self._foreign(word, start, end), end
        if kind == "STRING_LITERAL":
            return kind, *self._quoted(word, start, end)
        found = _BEHIND_DURATION.match(self.text, start)
        if found is None:
            return kind, word, end
        word = found[1] + self.text[found.end(2):found.end()]
        if found[2]:
            self.forms.append(Form("spaced_durations", start, found.end(), (
                "S0105", "a blank stands behind `#`", f"a duration is written {word}"),
                ("S0193", "a blank stands behind `#`", f"write {word}")))
        return kind, word, found.end()

    def _quoted(self, word: str, start: int, end: int) -> tuple[str, int]:
        """The text of a string literal and its end: a quote that is doubled, `'it''s'`, is one of the text."""
        quote, pieces = word[0], [word[1:-1]]
        while self.text.startswith(quote, end) and (found := _QUOTED.match(self.text, end)):
            pieces.append(found[0][1:-1])
            end = found.end()
        if len(pieces) > 1:
            self.forms.append(Form("doubled_quotes", start, end, (
                "S0101", f"a text with two {quote} inside", f"inside a text {quote} is written ${quote}")))
        return f"{quote}{f'${quote}'.join(pieces)}{quote}", end

    def _special(self, lex: Lexis, before: str, kind: str, start: int, end: int) -> tuple[str, int]:
        """The terminal of a token and its end: LOCATION behind AT, behind END_VAR an instruction list that begins with a formal
        call, `S=` behind an operand; otherwise `kind` and `end`."""
        if before == "END_VAR":
            last = self._instruction_list(start) if _FORMAL_CALL.match(self.text, end) else 0
            return ("INSTRUCTION_LIST", last) if last else (kind, end)
        pattern, name = (lex.location, "LOCATION") if before == "AT" else (lex.set_assign, "SET_ASSIGN")
        found = pattern.match(self.text, start)
        return (name, found.end()) if found else (kind, end)

    def _odd(self, lex: Lexis, at: int) -> tuple[Token | None, int]:
        """Pass over text with which no terminal begins: spaces at the end, pragmas, unknown characters.  Returns the token to
        read in its place, if any, and where to go on."""
        text = self.text
        while at < len(text) and text[at].isspace():
            at += 1
        if at >= len(text):
            return None, at
        character = text[at]
        if character == "\ufeff" and at == 0:
            return None, 1
        if character == "{":
            return None, self._pragma(at)
        if named := _NAMED_BIT.match(text, at):
            self.forms.append(Form("bits_by_name", at, named.end(), (
                "S0102", "the number of a bit stands behind %X", "the bit of a constant k is written name.k")))
            return None, named.end()
        if character in END_OF_FILE and _FILLED.match(text, at):
            return None, len(text)
        if character in "'\"":
            return self._open_string(at)
        if character in _RAILS and (drawn := _DRAWN.match(text, self._begin(at))):
            self.report("S0101", at, min(drawn.end(), text.find("\n", at)), "these lines are a rung that is drawn",
                        "rungs stand between LADDER and END_LADDER", False)
            return None, drawn.end()
        if word := lex.foreign_word.match(text, at):
            return Token("NAME", word[0], at, word.end()), word.end()
        if written := next((row for row in LITERALS if row[0].match(text, at)), None):
            return self._meant(at, *written)
        run = lex.unknown.match(text, at + 1)
        end = run.end() if run else at + 1
        advice = next((words for shape, words in SIGNS if shape.match(text, at)), "")
        self.report("S0102", at, end, f"unexpected {_characters(text[at:end])}", advice)
        return None, end

    def _begin(self, at: int) -> int:
        """Where the line of a place begins; a long line is looked through once."""
        known, begin = self._line if self._line[0] <= at else (0, 0)
        self._line = at, self.text.rfind("\n", known, at) + 1 or begin
        return self._line[1]

    def _meant(self, at: int, shape: re.Pattern[str], kind: str, ours: str, message: str,
               advice: str) -> tuple[Token | None, int]:
        """Report a form of another language; returns the token that is meant, None for a comment, and where to go on."""
        match = shape.match(self.text, at)
        assert match is not None
        self.report("S0102", at, match.end(), match.expand(message), match.expand(advice))
        return Token(kind, match.expand(ours), at, match.end()) if kind else None, match.end()

    def _open_string(self, at: int) -> tuple[Token, int]:
        quote = self.text[at]
        end = min((e for e in (self.text.find("\n", at), self.text.find("\r", at)) if e >= 0), default=len(self.text))
        self.report("S0104", at, end, "string literal without end on its line",
                    f"close it with {quote}; inside, a {quote} is written ${quote}, and a line end $N")
        return Token("STRING_LITERAL", quote * 2, at, end), end

    def _foreign(self, word: str, start: int, end: int) -> tuple[str, str]:
        """Our operator for one of other languages: terminal and text, which are empty if we have none."""
        kind, ours, advice = OPERATORS.get(re.sub(r"[ \t]+", " ", word), ("ASSIGN", ":=", f"write out `x := x {word[0]} ..`"))
        if word[:1] == ":" and word != ":==":
            advice = "`:=` is one sign, without a space inside"
        self.report("S0101", start, end, f"`{word}` is no operator of Structured Text", advice, word not in NO_VALUE)
        return kind, ours

    def _pragma(self, start: int) -> int:
        if self.text.startswith("{{", start):
            return self._text_of_c(start)
        end = self.text.find("}", start)
        if end < 0:
            self.report("S0103", start, start + 1, "pragma without end", "close it with }")
            return len(self.text)
        contents = self.text[start + 1:end]
        self.pragmas.append(Pragma(start, end + 1, contents))
        if ";" in contents and not harmless(contents):
            self.report("S0190", start, end + 1, "what stands in braces is a pragma, and no statement is executed in one",
                        "blocks are written IF .. END_IF, FOR .. END_FOR, without braces")
        elif not harmless(contents) and not dialectal(contents):
            named = attribute_name(contents)
            what = f"attribute '{named}'" if named else f"pragma `{{{_short(contents.strip())}}}`"
            unknown = "S0190", f"the {what} is not known and has no effect", NO_EFFECT
            acts = next((row for row in GENERATOR if row[0].fullmatch(contents)), None)
            if acts:
                self.forms.append(Form("pragmas_of_c", start, end + 1, ("S0901", *acts[1:]), unknown, taken=False))
            else:
                self.report(unknown[0], start, end + 1, *unknown[1:])
        return end + 1

    def _text_of_c(self, start: int) -> int:
        """Where `{{ .. }}` ends, which is text of C that the generator of matiec copies."""
        end = self.text.find("}}", start)
        if end < 0:
            self.report("S0103", start, start + 2, "text of C without end", "close it with }}")
            return len(self.text)
        words = "text of C in {{ }} is not executed"
        self.pragmas.append(Pragma(start, end + 2, self.text[start + 1:end + 1]))
        self.forms.append(Form("pragmas_of_c", start, end + 2, ("S0102", words, "write it in Structured Text"),
                               ("S0190", words, "what it does has to be written in Structured Text")))
        return end + 2

    def _ladder(self, start: int, end: int) -> int:
        """Where LADDER .. END_LADDER ends."""
        found = _END_LADDER.search(self.text, end)
        if not found:
            self.report("S0101", start, end, "LADDER without END_LADDER", "END_LADDER stands on a line of its own")
            return len(self.text)
        return found.end()

    def _instruction_list(self, start: int) -> int:
        """Where the instruction list ends that may begin here; 0 if this is none: a `;` follows."""
        text = self.text
        if not self.lists or not _FIRST.fullmatch(text, text.rfind("\n", 0, start) + 1, start):
            return 0
        at, last = start, start
        for found in _LIST_ENDS.finditer(text, start):
            if text[at:found.start()].strip():
                last = at + len(text[at:found.start()].rstrip())
            if found["other"]:
                return 0
            if found["end"]:
                return last
            last = found.end() if found["text"] else last
            at = found.end()
        return 0

    def _comment(self, start: int) -> int:
        """Where the bracket comment that begins at `start` ends; notes a comment inside it."""
        end, inner = comment_end(self.text, start)
        first = self.text.find(CLOSERS[self.text[start]], start) + 2
        once_for_each = f"close it with {CLOSERS[self.text[start]]}" + (", once for each sign of a beginning" if inner else "")
        if end < 0 or inner and end == first and self.text[start] == "/":
            self.report("S0103", start, start + 2, "comment without end", once_for_each)
        elif inner and end == first:
            self.forms.append(Form("comments_end_at_once", start, start + 2, ("S0103", "comment without end", once_for_each)))
        elif inner and self.text[start] == "(":
            self.forms.append(Form("comments_end_at_once", first, end, (
                "S0103", "the comment ended at the first `*)`", "comments do not nest in this dialect: leave the inner (* and "
                f"*) out, or take {takers('comments_end_at_once', False)}"), taken=False))
        return end if end >= 0 else len(self.text)


def _short(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


def _characters(text: str) -> str:
    """Unknown characters in a message, readable whatever they are."""
    if len(text) == 1:
        return f"character {text!r}" if text.isprintable() else f"character {text!a}"
    return f"characters {_short(text)!a}"
