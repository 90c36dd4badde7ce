"""What an ETN21 may write into its words between two scans, as rules with their sources: for proofs about programs that use it.

A rule is about the words as the program left them and as the next scan finds them.  All rules hold where nothing has changed, so
that a unit which is silent keeps them, unless the program writes into the unit's own words.  From W420 and W421, the manuals of
the ETN21."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from fbvm.base.areas import AREAS
from fbvm.machine.plc import Phase, Plc
from fbvm.prove.encoding.terms import Term, Terms
from fbvm.units.etn21 import codes
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.map import Layout, Switch

Word = tuple[str, int]
"""Area and number of a word: ("CIO", 1509)."""
Values = Mapping[Word, Term]
UNUSED = 0x1FF0
MOST_BYTES = 0x07C0
MOST_STATE = max(at.TcpState)
UNUSED_OF_UDP = 0x3FF0
UDP_OPENS, TCP_OPENS = 1 << Switch.UDP_OPEN, 1 << Switch.PASSIVE_OPEN | 1 << Switch.ACTIVE_OPEN
OPENING = 1 << 0
RUNNING = OPENING | 1 << 1 | 1 << 2
"""Opening, Receiving and Sending."""
CODES = tuple(sorted({*codes.MEANING, *codes.ERRNO.values()}))
FLAGS = {1 << 1: 1 << Switch.RECEIVE, 1 << 2: 1 << Switch.SEND, 1 << 3: 1 << Switch.CLOSE}
"""Receiving, Sending and Closing of a socket's status word, each with the switch that asks for it."""


@dataclass(frozen=True)
class Rule:
    """What holds of one word: `kind` is a key of KINDS, `number` its mask or limit, `source` where the manuals say so.

    Of "rises while" and "changes while", `cause` are words with bits, one of which the program has left ON."""

    word: Word
    kind: str
    number: int
    source: str
    cause: tuple[tuple[Word, int], ...] = ()
    values: tuple[int, ...] = ()
    """Of "becomes one of": the values."""

    def term(self, terms: Terms, before: Values, after: Values) -> Term:
        """The rule about the words as the program left them, and as the next scan finds them."""
        return KINDS[self.kind](terms, self, before, after)

    @property
    def words(self) -> tuple[Word, ...]:
        return self.word, *(word for word, _ in self.cause)


def _has(terms: Terms, value: Term, mask: int) -> Term:
    return terms.is_set(terms.bitwise("bvand", value, terms.constant(16, mask)))


def _only_clears(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    risen = terms.bitwise("bvand", after[rule.word], terms.invert(before[rule.word]))
    return terms.not_(_has(terms, risen, rule.number))


def _stays_off(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    return terms.not_(_has(terms, after[rule.word], rule.number))


def _keeps(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    changed = terms.bitwise("bvxor", after[rule.word], before[rule.word])
    return terms.not_(_has(terms, changed, rule.number))


def _at_most(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    return terms.less(after[rule.word], terms.constant(16, rule.number), False, True)


def _becomes_at_most(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    return terms.or_(_at_most(terms, rule, before, after), terms.eq(after[rule.word], before[rule.word]))


def _becomes_one_of(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    new = after[rule.word]
    return terms.any_of(terms.eq(new, before[rule.word]), *(terms.eq(new, terms.constant(16, value)) for value in rule.values))


def _one_at_most(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    """Of the bits of the mask never two are ON, unless the program has left them so."""
    bits = [1 << bit for bit in range(16) if rule.number >> bit & 1]
    both = (terms.and_(_has(terms, after[rule.word], one), _has(terms, after[rule.word], other))
            for one, other in combinations(bits, 2))  # fmt: skip
    return terms.or_(terms.eq(after[rule.word], before[rule.word]), terms.not_(terms.any_of(*both)))


def _caused(terms: Terms, rule: Rule, before: Values) -> Term:
    return terms.any_of(*(_has(terms, before[word], mask) for word, mask in rule.cause))


def _rises_while(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    return terms.or_(_only_clears(terms, rule, before, after), _caused(terms, rule, before))


def _changes_while(terms: Terms, rule: Rule, before: Values, after: Values) -> Term:
    return terms.or_(terms.eq(after[rule.word], before[rule.word]), _caused(terms, rule, before))


KINDS: dict[str, Callable[[Terms, Rule, Values, Values], Term]] = {
    "only clears": _only_clears, "stays off": _stays_off, "keeps": _keeps, "at most": _at_most,
    "becomes at most": _becomes_at_most, "rises while": _rises_while,
    "changes while": _changes_while, "becomes one of": _becomes_one_of, "one at most": _one_at_most,
}  # fmt: skip


def rules(unit: int, socket: int) -> tuple[Rule, ...]:
    """The rules of the words of a socket 1..8, TCP and UDP, driven by the area of the same number, of the unit 0..15.

    Raises ValueError for other numbers."""
    layout = Layout.of(unit)
    if socket not in at.SOCKETS:
        raise ValueError(f"socket {socket} is not in 1..8")
    (switch_word, shift), area = layout.switches(socket), layout.parameters(socket)
    switches, status = ("CIO", switch_word), ("CIO", layout.status("TCP", socket))
    waiting, state = (("D", layout.m + first + socket) for first in (at.BYTES_RECEIVED, at.TCP_STATE))
    response = "D", area + at.RESPONSE
    asked = (switches, 0x3F << shift), (status, 0xF)
    found = [
        Rule(switches, "only clears", 0xFF << shift, "W421 6-7-1 p113, 6-7-5 p120: the program turns a switch ON, the unit OFF"),
        Rule(status, "stays off", UNUSED, "W420 4-1 p80: bits 4 to 12 are not used"),
        Rule(state, "at most", MOST_STATE, "W421 6-6-2 p112: states 0 to A, CLOSED to TIME WAIT"),
        Rule(waiting, "at most", MOST_BYTES, "W420 4-2 p88: the number of bytes saturates at 07C0"),
        Rule(("D", area + at.COUNT), "becomes at most", MOST_BYTES, "W421 6-7-4 p117: 0 to 07C0 bytes were sent or received"),
        Rule(response, "changes while", 0, "W421 6-7-5 p120: a code answers a request", asked),
    ]
    found += [Rule(response, "becomes one of", 0, "W421 6-7-6 p120 to 125, W420 8-6 p227: the codes of services", (), CODES),
              Rule(status, "one at most", RUNNING, "W421 6-7-6 p120: during another service only a close is accepted")]
    found += [Rule(("D", area + offset), "keeps", 0xFFFF, "W421 6-7-4 p117: the program alone writes it")
              for offset in (at.OPTION_AND_SOCKET, at.DATA_ADDRESS, at.DATA_ADDRESS + 1, at.TIMEOUT)]  # fmt: skip
    udp = "CIO", layout.status("UDP", socket)
    found += [Rule(udp, "stays off", UNUSED_OF_UDP, "W420 4-1 p80: bits 4 to 12 are not used, 13 is that of TCP"),
              Rule(udp, "one at most", RUNNING, "W421 6-7-6 p120: during another service only a close is accepted")]
    for word, opens in (status, TCP_OPENS), (udp, UDP_OPENS):
        for flag, mask in {OPENING: opens, **FLAGS}.items():
            found.append(Rule(word, "rises while", flag, "W420 4-1 p80: ON when its request was accepted",
                              ((switches, mask << shift),)))  # fmt: skip
    return tuple(found)


def words_of(some: Iterable[Rule]) -> tuple[Word, ...]:
    """The words of some rules, each once."""
    return tuple(dict.fromkeys(word for rule in some for word in rule.words))


def free_words(some: Iterable[Rule]) -> Iterator[str]:
    """The addresses of what a unit may change, as `--free` takes them: of words with switches the bits of their areas."""
    bits: dict[Word, int] = {}
    for rule in some:
        bits[rule.word] = bits.get(rule.word, 0) | (rule.number if rule.kind == "only clears" else 0xFFFF)
    for (area, number), mask in bits.items():
        first, last = (mask & -mask).bit_length() - 1, mask.bit_length() - 1
        yield f"{area}{number}" if mask == 0xFFFF else f"{area}{number}.{first:02}..{number}.{last:02}"


def offset_of(word: Word) -> int:
    """The byte of the memory at which a word lies."""
    return AREAS[word[0]].offset + 2 * word[1]


class Watch:
    """Watches in a run on the engine whether what is written before each scan keeps the rules."""

    def __init__(self, plc: Plc, some: Sequence[Rule]) -> None:
        self.rules, self.terms, self.is_kept = some, Terms(), True
        self._left = self._words(plc)
        self._of_byte: dict[int, list[Rule]] = {}
        for rule in some:
            for half in (0, 1):
                self._of_byte.setdefault(offset_of(rule.word) + half, []).append(rule)

    def _words(self, plc: Plc) -> dict[Word, Term]:
        words = plc.memory.views["u16"]
        return {word: self.terms.constant(16, words[offset_of(word) // 2]) for word in words_of(self.rules)}

    def _fit(self, plc: Plc, some: Sequence[Rule]) -> bool:
        now = self._words(plc) if some else {}
        return all(rule.term(self.terms, self._left, now) is self.terms.true for rule in some)

    def allows(self, plc: Plc, offset: int) -> bool:
        """True if the rules of the word at a byte are kept by what the memory holds now."""
        return self._fit(plc, self._of_byte.get(offset, ()))

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Compares where a scan begins; keeps what the program has left."""
        if phase is Phase.INPUTS:
            self.is_kept &= self._fit(plc, self.rules)
        elif phase is Phase.PROGRAM:
            self._left = self._words(plc)
