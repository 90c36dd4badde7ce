"""What is said of texts that are refused, place and words."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from refused_texts import messages, refused_texts
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax.parser import parse


def check(text: str) -> Iterable[Diagnostic]:
    return parse(Source("x.st", text))[1]


@each_of(("title", "text", "said"), refused_texts(Path(__file__).with_name("refused"), check), ids=lambda case: case[0])
def test_a_text_that_is_refused_says_what_and_where(title: str, text: str, said: list[str]) -> None:
    assert messages(check, text) == said != [], title
