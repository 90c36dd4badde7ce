"""Bodies in ladder and FBD of an export of CODESYS 2.3, as trees: an export writes each network as words, one a line.

    _NETWORK  _COMMENT 'text' _END_COMMENT  then one of
    _LD_ASSIGN power _EXPRESSION sign  ENABLELIST : n  box* ENABLELIST_END  _OUTPUTS : n output*      ladder
    _ASSIGN value _EXPRESSION sign  _OUTPUTS : n output*                                               FBD, boxes of ENABLELIST

    power     _EMPTY, or _LD_CONTACT name, or _LD_AND, _LD_OR with _LD_OPERATOR : n power*, each with _EXPRESSION sign; or a value
    value     _OPERAND _EXPRESSION sign text; _EMPTY; _OPERATOR, _FUNCTION _BOX_EXPR : n [_ENABLED] value* _EXPRESSION sign name;
              _FUNCTIONBLOCK instance _BOX_EXPR : n value* _EXPRESSION sign type _OUTPUTS : n output*
    output    _OUTPUT sign _NO_SET or _SET name                sign _POSITIV or _NEGATIV; _NEGATIV with _SET resets

The format is not published; this much of it was found in programs that write such files.  Whatever else stands in a body, such as
jumps, labels and returns, is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from fbvm.base.digits import whole_number

_COUNT = re.compile(r"(\w+) ?: ?(\d+);?")
_LINE = re.compile(r"[^\r\n]*")
MOST_DEEP = 150
"""How many boxes, rows and branches may stand in one another."""
UNKNOWN_OPERAND = "???"
"""What the editor writes where an operand is still missing."""


class Unreadable(Exception):
    """A body has something that is not known; the arguments are the offset of that word and a message."""


@dataclass(frozen=True)
class Output:
    """A variable at an output; `stores` for set, or reset if it is `negated` too."""

    name: str
    negated: bool
    stores: bool


@dataclass(frozen=True)
class Value:
    """A node: `kind` is one of the words above in small letters without `_`; `text` its name, operand or function; `parts` its
    inputs; an instance has its `type` and further `outputs`, a box of ENABLELIST is `enabled`."""

    kind: str
    text: str = ""
    parts: tuple[Value, ...] = ()
    negated: bool = False
    type: str = ""
    outputs: tuple[Output, ...] = ()
    enabled: bool = False
    at: int = 0


@dataclass
class Network:
    """A network: where it begins and ends in the text, its comment, its value, and the variables that get it; `boxes` are those
    of ENABLELIST, which are executed while the value is TRUE."""

    start: int
    comment: list[str] = field(default_factory=list)
    value: Value = field(default_factory=lambda: Value("empty"))
    boxes: list[tuple[Value, tuple[Output, ...]]] = field(default_factory=list)
    outputs: tuple[Output, ...] = ()
    end: int = 0


def networks(text: str, start: int, end: int) -> list[Network]:
    """The networks between two offsets, the first of which stands behind the word that begins the body.  Raises Unreadable."""
    return _Reader(text, start, end).body()


class _Reader:
    """Reads the words of one body: `word` is the one at hand, at the offset `at`; "" behind the last one."""

    def __init__(self, text: str, start: int, end: int) -> None:
        self.text, self.end = text, end
        self.lines: Iterator[tuple[int, str]] = ((found.start(), found[0].strip()) for found in _LINE.finditer(text, start, end)
                                                 if found[0].strip())
        self.at, self.word = start, ""
        self.deep = 0
        self._next()

    def _next(self) -> str:
        """Go on to the next word; returns the one that was at hand."""
        taken = self.word
        self.at, self.word = next(self.lines, (self.end, ""))
        return taken

    def _expect(self, *words: str) -> str:
        if self.word not in words:
            raise self._strange()
        return self._next()

    def _count(self, word: str) -> int:
        found = _COUNT.fullmatch(self.word)
        if found is None or found[1] != word:
            raise self._strange()
        self._next()
        return min(whole_number(found[2]), len(self.text))

    def _strange(self) -> Unreadable:
        return Unreadable(self.at, f"`{self.word}` stands in it" if self.word else "it ends too early")

    def _name(self) -> str:
        """A name or an operand."""
        if not self.word or self.word == UNKNOWN_OPERAND or self.word.startswith("_") and self.word.isupper():
            raise Unreadable(self.at, "an operand is missing in it") if self.word == UNKNOWN_OPERAND else self._strange()
        return self._next()

    def _sign(self) -> bool:
        return self._expect("_POSITIV", "_NEGATIV") == "_NEGATIV"

    def _signed(self) -> bool:
        self._expect("_EXPRESSION")
        return self._sign()

    # --- networks ---

    def body(self) -> list[Network]:
        found = [self._network() for _ in range(self._count("_NETWORKS"))]
        if self.word:
            raise self._strange()
        return found

    def _network(self) -> Network:
        made = Network(self.at)
        self._expect("_NETWORK")
        self._expect("_COMMENT")
        while self.word and self.word != "_END_COMMENT":
            made.comment.append(self._next())
        self._expect("_END_COMMENT")
        if self._expect("_LD_ASSIGN", "_ASSIGN") == "_LD_ASSIGN":
            made.value = self._negated(self._value())
            made.boxes = [self._box() for _ in range(self._count("ENABLELIST"))]
            self._expect("ENABLELIST_END")
            made.outputs = self._outputs()
        else:
            made.value, made.outputs = self._assigned()
        made.end = self.at
        return made

    def _assigned(self) -> tuple[Value, tuple[Output, ...]]:
        return self._negated(self._value()), self._outputs()

    def _box(self) -> tuple[Value, tuple[Output, ...]]:
        self._expect("_ASSIGN")
        return self._assigned()

    def _negated(self, value: Value) -> Value:
        return Value("not", parts=(value,), at=value.at) if self._signed() else value

    def _outputs(self) -> tuple[Output, ...]:
        return tuple(self._output() for _ in range(self._count("_OUTPUTS")))

    def _output(self) -> Output:
        self._expect("_OUTPUT")
        negated = self._sign()
        stores = self._expect("_NO_SET", "_SET") == "_SET"
        return Output("" if self.word == "_EMPTY" and self._next() else self._name(), negated, stores)

    # --- values ---

    def _value(self) -> Value:
        self.deep += 1
        if self.deep > MOST_DEEP:
            raise Unreadable(self.at, f"a network is deeper than {MOST_DEEP}")
        made = self._node()
        self.deep -= 1
        return made

    def _node(self) -> Value:
        at, kind = self.at, self.word.removeprefix("_").lower()
        if self.word == "_EMPTY":
            self._next()
            return Value("empty", at=at)
        self._expect("_OPERAND", "_LD_CONTACT", "_LD_AND", "_LD_OR", "_OPERATOR", "_FUNCTION", "_FUNCTIONBLOCK")
        if kind == "operand":
            negated = self._signed()
            return Value(kind, self._name(), negated=negated, at=at)
        if kind == "ld_contact":
            name = self._name()
            return Value(kind, name, negated=self._signed(), at=at)
        if kind in ("ld_and", "ld_or"):
            parts = self._values("_LD_OPERATOR")
            return Value(kind, parts=parts, negated=self._signed(), at=at)
        if kind in ("operator", "function"):
            enabled, parts = self._inputs()
            negated = self._signed()
            return Value(kind, self._name(), parts, negated, enabled=enabled, at=at)
        name = self._name()
        enabled, parts = self._inputs()
        negated = self._signed()
        return Value(kind, name, parts, negated, self._name(), self._outputs(), enabled, at)

    def _inputs(self) -> tuple[bool, tuple[Value, ...]]:
        count = self._count("_BOX_EXPR")
        enabled = self.word == "_ENABLED"
        if enabled:
            self._next()
        return enabled, tuple(self._value() for _ in range(count))

    def _values(self, word: str) -> tuple[Value, ...]:
        return tuple(self._value() for _ in range(self._count(word)))
