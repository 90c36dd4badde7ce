"""E banks that options name: the PLC has them, also if the program does not use them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from fbvm.base.areas import E_NAMES

_BANK = re.compile(r"(?<!\w)(E[0-9A-F])\s*[_:]\s*\d", re.I)


def e_banks_in(texts: Iterable[str]) -> list[str]:
    """The E banks in names and conditions, `E3_100` or `E3:100`, in the order of their first use."""
    found = [match[1].upper() for text in texts for match in _BANK.finditer(text)]
    return [name for name in dict.fromkeys(found) if name in E_NAMES]
