"""Decimal digits to numbers, however many digits there are."""

from __future__ import annotations

MOST_DIGITS = 40
"""No number in a program, an address or a file has so many digits."""
TOO_LARGE = 10**MOST_DIGITS


def whole_number(text: str) -> int:
    """The value of decimal digits with or without a sign, limited to TOO_LARGE in size.

    Python's `int` raises ValueError for more than 4,300 digits; here all such numbers are simply larger than any limit with
    which they are compared.  Raises ValueError for text that is no whole number.

    >>> whole_number("-12"), whole_number("9" * 5000) == TOO_LARGE, whole_number("0" * 5000 + "7")
    (-12, True, 7)
    """
    if len(text) <= MOST_DIGITS:
        return int(text)
    sign = -1 if text.lstrip().startswith("-") else 1
    digits = text.strip().removeprefix("-").removeprefix("+").lstrip("0") or "0"
    if not digits.isdecimal():
        raise ValueError(f"{text[:MOST_DIGITS]}... is no whole number")
    return sign * (int(digits) if len(digits) <= MOST_DIGITS else TOO_LARGE)
