"""Damaged files of all kinds, given to all verbs that read them: a slice of what `broken_input.py` tries by the thousand."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from broken_input import KINDS, broken, complaint, furnish
from depth import times

SLICE = 10
"""Files of one test."""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))
    furnish()


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SLICE * times(12, 50), SLICE))
def test_a_damaged_file_gives_diagnostics_in_time(first: int) -> None:
    for seed in range(first, first + SLICE):
        kind, data = broken(Random(seed))
        assert complaint(kind, data) is None, f"seed {seed}, {kind}"


@pytest.mark.slow
def test_damage_is_done_to_files_of_every_kind() -> None:
    assert {broken(Random(seed))[0] for seed in range(100)} == KINDS.keys()
