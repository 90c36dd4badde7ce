"""Comments around an operator that reach to a line end stand in front of it in the canonical text, which stays as it is then."""

from __future__ import annotations

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.formatter.formatter import formatted

HEAD, END = "PROGRAM Main\nVAR\n    x, y : INT;\nEND_VAR\n", "END_PROGRAM\n"


@pytest.mark.parametrize(("written", "lines"), [
    ("x := y (* 1 *) + y;", ["x := y (* 1 *) + y;"]),
    ("x := y + (* 1 *) y;", ["x := y + (* 1 *) y;"]),
    ("x := y // 1\n + y;", ["x := y  // 1", "     + y;"]),
    ("x := y + // 1\n y;", ["x := y  // 1", "     + y;"]),
    ("x := y (* 1 *) + // 2\n y;", ["x := y", "     (* 1 *)", "     // 2", "     + y;"]),
    ("x := y +\n // 1\n y;", ["x := y", "     // 1", "     + y;"]),
    ("x := y (* 1 *) + // 2\n // 3\n y;", ["x := y", "     (* 1 *)", "     // 2", "     // 3", "     + y;"]),
    ("x := (y (* 1 *) + // 2\n // 3\n y);", ["x := (y", "      (* 1 *)", "      // 2", "      // 3", "      + y);"]),
])  # fmt: skip
def test_where_comments_stand(written: str, lines: list[str]) -> None:
    text, wrong = formatted(Source("a.st", f"{HEAD}    {written}\n{END}"))
    body = text.removeprefix(HEAD).removesuffix(END).splitlines()
    assert (wrong, [line.removeprefix("    ") for line in body]) == ([], lines)
    assert formatted(Source("a.st", text))[0] == text
