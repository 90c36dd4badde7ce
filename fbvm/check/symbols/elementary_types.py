"""Elementary types by name, with the names that CODESYS and TwinCAT have for some of them."""

from __future__ import annotations

from fbvm.base.types import ELEMENTARY, SHORT_NAMES, Type, fold, string

WIDE = {"__UXINT": "ULINT", "__XINT": "LINT", "__XWORD": "LWORD", "UXINT": "ULINT", "XINT": "LINT", "XWORD": "LWORD"}
"""CODESYS's and TwinCAT's names for the types that are as wide as a pointer; here one has 64 bits."""


def elementary_type(name: str) -> Type | None:
    """The elementary type of that name in any case, STRING and WSTRING included; None for any other name."""
    folded = fold(name)
    if folded in ("STRING", "WSTRING"):
        return string(wide=folded == "WSTRING")
    folded = WIDE.get(folded, folded)
    return ELEMENTARY.get(SHORT_NAMES.get(folded, folded) if folded not in ("T", "D", "LT", "LD") else folded)
