"""Which lines of a test are its statement that failed."""

from __future__ import annotations

from pathlib import Path

from fbvm.testing.plugin import _statement

TEXT = """\
def test(plc):
    plc.scan(
        3)
    if plc.n:
        assert (plc.a
                == 5)
"""


def test_the_lines_of_a_statement_are_those_of_the_smallest_one(tmp_path: Path) -> None:
    file = tmp_path / "test_a.py"
    file.write_text(TEXT)
    assert [_statement(str(file), line) for line in range(1, 8)] == [
        range(1, 7), range(2, 4), range(2, 4), range(4, 7), range(5, 7), range(5, 7), range(7, 8)]


def test_of_what_cannot_be_read_the_line_alone_is_the_statement(tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("def (")
    assert [_statement(str(file), 3) for file in (broken, tmp_path / "nowhere.py")] == [range(3, 4), range(3, 4)]
