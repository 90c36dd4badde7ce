"""What an electrician knows, beside the rungs: names, addresses and comments."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from cx_text import SAMPLE

from fbvm.cli.main import main


def drawn(tmp_path: Path, old: bytes = b"", new: bytes = b"") -> list[str]:
    file = tmp_path / "line.cxt"
    file.write_bytes(SAMPLE.bytes().replace(old, new))
    done = CliRunner().invoke(main, ["ladder", str(file), "--comments"])
    assert done.exit_code == 0, done.output
    return [" ".join(line.split()) for line in done.output.splitlines()]


@pytest.mark.slow
def test_names_addresses_and_comments_stand_below_the_rung(tmp_path: Path) -> None:
    lines = drawn(tmp_path)
    at = lines.index("RUNG 0 self hold")
    assert [line for line in lines[at:] if line and line[0] not in "│├"][:6] == [
        "RUNG 0 self hold", "Start_PB 0.00 start button", 'Pump 100.00 pump of the 2" line',
        "Stop_PB 0.01 stop button, normally open", "RUNG 1", "D100 raw level"]  # fmt: skip
    assert "X raw value" in lines


def test_a_rung_that_was_stored_by_address_shows_the_symbol(tmp_path: Path) -> None:
    lines = drawn(tmp_path, b"LD Start_PB", b"LD 0.00")
    assert "││ Start_PB │ 0.01 100.00 │" in lines
    assert "Start_PB 0.00 start button" in lines
