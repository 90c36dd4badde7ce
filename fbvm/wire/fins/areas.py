"""The memory areas of FINS: which words and bits of the PLC a code and an address name.

Rows of CS/CJ mode: CIO and W, W342 5-2-1 p163; D, W342 p170; H and A, W343 p117; all others from public programs that agree
(wireshark, omron-fins).  Rows of CV mode are from those programs alone.  Forced forms, index and data registers, task flags and
the number of the current bank are not served: no page of them was seen.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.base.areas import E_BANKS, E_WORDS, Address

LAST_BIT = 15


@dataclass(frozen=True, slots=True)
class Span:
    """The elements of one area that a code names: FINS numbers `first` to `first` + `count` - 1 are those of `area` from its
    first one on.  `size` is 2 for words, 1 for bits of words (`has_bits`) and for flags."""

    code: int
    first: int
    count: int
    area: str
    size: int = 2
    has_bits: bool = False

    @property
    def elements(self) -> int:
        """How many elements there are, bits or words."""
        return 16 * self.count if self.has_bits else self.count

    def address(self, element: int) -> Address:
        """The PLC's address of an element of this span."""
        if self.has_bits:
            return Address(self.area, element // 16, element % 16)
        return Address(self.area, element)


def _words(code: int, first: int, count: int, area: str) -> Span:
    return Span(code, first, count, area)


def _bits(code: int, first: int, count: int, area: str) -> Span:
    return Span(code, first, count, area, 1, True)


def _flags(code: int, first: int, count: int, area: str) -> Span:
    return Span(code, first, count, area, 1)


_BANKS = tuple(span for bank in range(E_BANKS) for span in (
    _bits(0x20 + bank, 0, E_WORDS, f"E{bank:X}"), _words(0xA0 + bank, 0, E_WORDS, f"E{bank:X}")))  # fmt: skip
SPANS: tuple[Span, ...] = (
    # CS/CJ mode
    _bits(0x30, 0, 6144, "CIO"), _words(0xB0, 0, 6144, "CIO"),
    _bits(0x31, 0, 512, "W"), _words(0xB1, 0, 512, "W"),
    _bits(0x32, 0, 512, "H"), _words(0xB2, 0, 512, "H"),
    _bits(0x33, 0, 960, "A"), _words(0xB3, 0, 960, "A"),
    _flags(0x09, 0, 4096, "TF"), _flags(0x09, 0x8000, 4096, "CNF"),
    _words(0x89, 0, 4096, "T"), _words(0x89, 0x8000, 4096, "C"),
    _bits(0x02, 0, 32768, "D"), _words(0x82, 0, 32768, "D"),
    *_BANKS,
    _bits(0x0A, 0, E_WORDS, "E0"), _words(0x98, 0, E_WORDS, "E0"),  # the current bank, assumed to be bank 0
    # CV mode; 82 and 98 are the same
    _bits(0x00, 0, 2560, "CIO"), _words(0x80, 0, 2560, "CIO"),
    _bits(0x00, 0x0B00, 960, "A"), _words(0x80, 0x0B00, 960, "A"),
    _flags(0x01, 0, 2048, "TF"), _flags(0x01, 0x0800, 2048, "CNF"),
    _words(0x81, 0, 2048, "T"), _words(0x81, 0x0800, 2048, "C"),
    *(_words(0x90 + bank, 0, E_WORDS, f"E{bank:X}") for bank in range(8)),
)  # fmt: skip
_BY_CODE: dict[int, list[Span]] = {}
for _span in SPANS:
    _BY_CODE.setdefault(_span.code, []).append(_span)


def spans_of(code: int) -> list[Span]:
    """The spans that an area code names; none for a code that is not served."""
    return _BY_CODE.get(code, [])


def span_at(code: int, number: int) -> Span | None:
    """The span of a code in which an element's number lies."""
    for span in spans_of(code):
        if span.first <= number < span.first + span.count:
            return span
    return None


def place_of(code: int, number: int, bit: int) -> tuple[Span, int] | None:
    """The span that an address begins in, and the number of its element there; None if there is no such element."""
    span = span_at(code, number)
    if span is None or bit > (LAST_BIT if span.has_bits else 0):
        return None
    element = number - span.first
    return span, 16 * element + bit if span.has_bits else element


WORD_CODES = {span.area: (span.code, span.first) for span in reversed(SPANS) if span.size == 2}
"""For each area of words its code, and the FINS number of its first word; where there are several, that of CS/CJ mode."""
