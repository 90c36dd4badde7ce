"""A source that nobody has formatted beside what `fmt` makes of it, word for word.  `FBVM_REWRITE=1 pytest` of this file writes
the text anew; read the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.ladder.notation import Form, Notation

TEXTS = Path(__file__).parent / "texts"


@pytest.mark.slow
def test_what_a_source_is_formatted_to() -> None:
    ugly = (TEXTS / "ugly.st").read_text(encoding="utf-8")
    made, wrong = formatted(Source("ugly.st", ugly), notation=Notation(Form.DRAWING))
    assert [found.render() for found in wrong] == []
    if os.environ.get("FBVM_REWRITE"):
        (TEXTS / "pretty.st").write_text(made, encoding="utf-8")
    assert made == (TEXTS / "pretty.st").read_text(encoding="utf-8")
    assert formatted(Source("pretty.st", made), notation=Notation(Form.DRAWING)) == (made, [])
