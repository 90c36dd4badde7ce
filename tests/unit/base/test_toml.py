"""TOML texts: what is wrong with one is said in one way, with its place."""

from __future__ import annotations

import pytest

from fbvm.base.toml import TomlError, load_toml


@pytest.mark.parametrize(("text", "said", "line", "column"), [
    ("a = 1\nb == 2\n", "Invalid value", 2, 4),
    ("a = 1\nb = [", "Invalid value", 2, 6),
    ("a = " + "[" * 51 + "]" * 51, "values are nested too deeply", 1, 1),
    ("a = 1\n" + "a." * 50 + "b = 1\n", "values are nested too deeply", 2, 1),
    ("\n[" + "a." * 50 + "b]\n", "values are nested too deeply", 2, 1),
    ("[[ " + "'a' . " * 50 + "b]]\n", "values are nested too deeply", 1, 2),
    ("a = {" + '"a."."\\"".' * 25 + "b = 1}\n", "values are nested too deeply", 1, 5),
    ("a." * 100_000 + "b = 1", "values are nested too deeply", 1, 1),
])  # fmt: skip
def test_a_text_that_is_wrong(text: str, said: str, line: int, column: int) -> None:
    with pytest.raises(TomlError) as raised:
        load_toml(text)
    assert (str(raised.value), raised.value.line, raised.value.column) == (said, line, column)


def test_a_value_or_a_comment_may_look_as_a_key_of_many_parts() -> None:
    dots = "a." * 60
    assert load_toml(f"# {dots}\na = '{dots}' # {dots}\n{'b.' * 48}c = 1")["a"] == dots
