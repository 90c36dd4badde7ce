"""Comments between two tokens: around an operator, those that reach to a line end stand in front of it in the canonical text,
which stays as it is then."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from growth import assert_linear

from fbvm.base.diagnostics import Source
from fbvm.syntax.formatter.comments import Comments
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.st.lexer import Token

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


@pytest.mark.slow
def test_the_time_of_pragmas_between_two_tokens_grows_with_their_number() -> None:
    def prepared(count: int) -> Callable[[], object]:
        text = "{a} " * count
        end = Token("$END", "", len(text), len(text))
        assert len(Comments(text, [end]).ahead[end.start]) == count
        return lambda: Comments(text, [end])

    assert_linear(prepared, 2_500)
