"""What earlier checks knew is freed by the next one at the latest, also where nobody asks for it."""

from __future__ import annotations

import pytest

from fbvm.analysis.program import Program
from fbvm.check.symbols.symbol_table import SymbolTable

TEXT = "PROGRAM Main\nVAR n : INT; END_VAR\n    n := {};\nEND_PROGRAM\n"


@pytest.mark.parametrize(("releases", "freed"), [(False, [0, 0, 1, 2]), (True, [0, 1, 2, 3])])
def test_each_check_frees_what_the_ones_before_the_last_knew(
    monkeypatch: pytest.MonkeyPatch, releases: bool, freed: list[int]
) -> None:
    gone: list[SymbolTable] = []
    let_go = SymbolTable.let_go
    monkeypatch.setattr(SymbolTable, "let_go", lambda table: gone.append(table) or let_go(table))  # type: ignore[func-returns-value]
    program, counts, known = Program(), [], []
    for number in range(4):
        program.replace("main.st", TEXT.format(number))
        for _ in program.check():
            pass
        if releases:
            program.release()
        assert program.is_current and program.checked is not None
        counts.append(len(gone))
        known.append(program.checked.project)
    assert counts == freed and all(one is other for one, other in zip(gone, known, strict=False)), "the oldest first"
