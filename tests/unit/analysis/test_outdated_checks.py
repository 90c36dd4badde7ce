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


def test_a_file_that_is_removed_is_missed_by_the_next_check() -> None:
    program = Program()
    program.replace("main.st", "PROGRAM Main\nVAR p : Pump; END_VAR\n    p();\nEND_PROGRAM\n")
    program.replace("Pump.st", "FUNCTION_BLOCK Pump\nEND_FUNCTION_BLOCK\n")
    program.check_all()
    before = program.revision
    program.remove("nowhere.st")
    assert program.is_current and program.revision == before, "nothing has changed"
    program.remove("Pump.st")
    assert not program.is_current and program.revision == before + 1 and list(program.files) == ["main.st"]
    assert not program.check_changes(), "others may see what is gone"
    program.check_all()
    assert [each.code for each in program.diagnostics("main.st")] == ["S0204"]
