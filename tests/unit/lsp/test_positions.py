"""Positions of the protocol in texts with characters outside of ASCII, and what a diagnostic says to an editor."""

from __future__ import annotations

import pytest
from lsprotocol import types

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.lsp.positions import Positions
from fbvm.lsp.server import Server

pytestmark = pytest.mark.slow  # pygls and the protocol take their time to be imported

LINE = "s := '\U0001f600ä'; b := 1;"
"""`b` is character 11 from 0; the first character in the text takes 2 units of UTF-16 and 4 of UTF-8, the second 1 and 2."""


@pytest.mark.parametrize(("units", "column"), [("utf-32", 11), ("utf-16", 12), ("utf-8", 15)])
def test_columns_count_in_the_units_that_were_agreed_upon(units: str, column: int) -> None:
    positions = Positions(Source("Main.st", f"a := 0;\n{LINE}\nc := 2;\n"), units)
    offset = 8 + LINE.index("b")
    assert positions.position(offset) == types.Position(1, column)
    assert positions.offset(types.Position(1, column)) == offset
    assert positions.offset(types.Position(0, 5)) == 5


def test_only_what_is_unused_is_shown_faded(monkeypatch: pytest.MonkeyPatch) -> None:
    server, source = Server("1"), Source("Main.st", "PROGRAM Main END_PROGRAM")
    monkeypatch.setattr(server, "positions", Positions)  # no editor has agreed upon units
    made = [server.diagnostic(Diagnostic(code, source, 8, 12, "said"), source) for code in ("S0290", "S0201")]
    assert [each.tags for each in made] == [[types.DiagnosticTag.Unnecessary], None]
    assert [each.severity for each in made] == [types.DiagnosticSeverity.Warning, types.DiagnosticSeverity.Error]
