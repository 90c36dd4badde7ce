"""TOML texts: what is wrong with one is said in one way, with its place."""

from __future__ import annotations

import pytest

from fbvm.base.toml import TomlError, load_toml


@pytest.mark.parametrize(("text", "said", "line", "column"), [
    ("a = 1\nb == 2\n", "Invalid value", 2, 4),
    ("a = 1\nb = [", "Invalid value", 2, 6),
    ("a = " + "[" * 51 + "]" * 51, "values are nested too deeply", 1, 1),
])  # fmt: skip
def test_a_text_that_is_wrong(text: str, said: str, line: int, column: int) -> None:
    with pytest.raises(TomlError) as raised:
        load_toml(text)
    assert (str(raised.value), raised.value.line, raised.value.column) == (said, line, column)
