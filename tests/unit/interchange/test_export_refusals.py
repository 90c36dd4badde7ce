"""What is said of sources that cannot be exported, place and words."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from refused_texts import messages, refused_texts
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.plcopen.write.exporting import export_xml


def check(text: str) -> Iterable[Diagnostic]:
    return export_xml([Source("x.st", text)]).diagnostics


@each_of(("title", "text", "said"), refused_texts(Path(__file__).with_name("refused"), check), ids=lambda case: case[0])
def test_a_source_without_a_form_in_the_format_says_what_and_where(title: str, text: str, said: list[str]) -> None:
    assert messages(check, text) == said != [], title
