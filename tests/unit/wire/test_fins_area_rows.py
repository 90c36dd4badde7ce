"""The first and the last element of each area code, and what lies beside them (W342 5-2-2, the table of area codes)."""

from __future__ import annotations

from rows import each_of

from fbvm.wire.fins.areas import place_of, span_at


@each_of(("code", "first", "last", "area", "has_bits"), [
    (0x30, 0, 6143, "CIO", True), (0xB0, 0, 6143, "CIO", False), (0x31, 0, 511, "W", True), (0xB1, 0, 511, "W", False),
    (0x32, 0, 511, "H", True), (0xB2, 0, 511, "H", False), (0x33, 0, 959, "A", True), (0xB3, 0, 959, "A", False),
    (0x09, 0, 4095, "TF", False), (0x09, 0x8000, 0x8FFF, "CNF", False), (0x89, 0, 4095, "T", False),
    (0x89, 0x8000, 0x8FFF, "C", False), (0x02, 0, 32767, "D", True), (0x82, 0, 32767, "D", False),
    (0x20, 0, 32767, "E0", True), (0xA0, 0, 32767, "E0", False), (0xAC, 0, 32767, "EC", False), (0x0A, 0, 32767, "E0", True),
    (0x98, 0, 32767, "E0", False), (0x00, 0, 2559, "CIO", True), (0x80, 0, 2559, "CIO", False),
    (0x00, 0x0B00, 0x0EBF, "A", True), (0x80, 0x0B00, 0x0EBF, "A", False), (0x01, 0, 2047, "TF", False),
    (0x01, 0x0800, 0x0FFF, "CNF", False), (0x81, 0, 2047, "T", False), (0x81, 0x0800, 0x0FFF, "C", False),
    (0x90, 0, 32767, "E0", False), (0x97, 0, 32767, "E7", False),
])  # fmt: skip
def test_where_an_area_code_begins_and_ends(code: int, first: int, last: int, area: str, has_bits: bool) -> None:
    for number in (first, last):
        found = place_of(code, number, 0)
        assert found is not None
        span, element = found
        assert (span.area, span.has_bits, element) == (area, has_bits, (number - first) * (16 if has_bits else 1))
        assert (place_of(code, number, 15) is not None) is has_bits and place_of(code, number, 16) is None
    for number in (first - 1, last + 1):
        beside = span_at(code, number)
        assert beside is None or (beside.area, beside.first) != (area, first)
