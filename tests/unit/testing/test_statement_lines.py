"""Which lines of a test are its statement that failed."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from fbvm.testing.plugin import _rigs_read, _statement
from fbvm.testing.rig import Rig

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


def test_the_rigs_of_a_failure_are_those_that_its_statement_has_read(tmp_path: Path) -> None:
    file = tmp_path / "test_a.py"
    file.write_text(TEXT)
    rigs = {name: cast(Rig, SimpleNamespace(reads={(str(file), line, "a")})) for name, line in (("first", 2), ("last", 6))}
    none = cast(Rig, SimpleNamespace(reads=set()))

    def found(*entries: tuple[Path, int]) -> list[tuple[Rig, tuple[str, range] | None]]:
        traceback = [SimpleNamespace(path=path, lineno=line - 1) for path, line in entries]
        return _rigs_read(cast(Any, SimpleNamespace(traceback=traceback)), [*rigs.values(), none])

    assert found((file, 5)) == found((file, 5), (Path("/elsewhere.py"), 2)) == [(rigs["last"], (str(file), range(5, 7)))]
    assert found((file, 3), (file, 1)) == [(rig, (str(file), range(1, 7))) for rig in rigs.values()]
    assert found((Path("/elsewhere.py"), 2)) == [(rig, None) for rig in (*rigs.values(), none)]
    assert found((file, 2)) == [(rigs["first"], (str(file), range(2, 4)))]
