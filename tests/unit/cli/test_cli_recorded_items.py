"""One test that is run for a debugger: how it ended, what its PLCs did, what pytest said."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from fbvm.cli.shared.debug.recorded_item import record_item

pytestmark = pytest.mark.slow  # each runs a pytest of its own

TESTS = """
import helper
import pytest

FILE = "pump.st"


def test_good(plc):
    rig = plc(FILE)
    rig.run(scans=3)
    plc(FILE).run(scans=2)
    plc(FILE)
    assert rig["Main.n"] == helper.THREE


def test_bad(plc):
    rig = plc(FILE)
    rig.run(scans=2)
    assert rig["Main.n"] == 5, "counts too slowly"


@pytest.mark.parametrize("number", [1, 2])
def test_two(number):
    pass
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "test_pump.py").write_text(TESTS, encoding="utf-8")
    (tmp_path / "pump.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM", encoding="utf-8")
    (tmp_path / "helper.py").write_text("THREE = 3\n", encoding="utf-8")
    (tmp_path / "conftest.py").write_text("import sys\nsys.path.insert(0, str(__import__('pathlib').Path(__file__).parent))\n")
    return tmp_path


def test_a_test_that_passes_and_one_that_fails(folder: Path) -> None:
    before = list(sys.path)
    good = record_item("test_pump.py::test_good", folder)
    assert (good.failed, good.reason) == (False, "") and "1 passed" in good.output
    assert [len(recorded.scans) for recorded in good.recordings.values()] == [3, 2] and len(good.recordings) == 2
    written = (folder / "helper.py").stat()
    (folder / "helper.py").write_text("THREE = 4\n", encoding="utf-8")
    os.utime(folder / "helper.py", ns=(written.st_atime_ns, written.st_mtime_ns))  # as if in the same second
    assert record_item("test_pump.py::test_good", folder).failed, "what has changed is imported anew"
    bad = record_item("test_pump.py::test_bad", folder)
    assert bad.failed and bad.reason.startswith("counts too slowly") and "1 failed" in bad.output
    assert [len(recorded.scans) for recorded in bad.recordings.values()] == [2]
    sys.path[:] = before


@pytest.mark.parametrize(("node", "said", "output"), [
    ("test_pump.py::test_none", "'test_pump.py::test_none' is no test: name one", "not found"),
    ("test_none.py", "'test_none.py' is no test: name one", "not found"),
    ("test_pump.py::test_two", "'test_pump.py::test_two' is 2 tests: name one", "2 passed"),
])
def test_what_is_not_one_test_is_refused_with_what_pytest_says(folder: Path, node: str, said: str, output: str) -> None:
    before = list(sys.path)
    with pytest.raises(LookupError) as refused:
        record_item(node, folder)
    assert str(refused.value.args[0]).startswith(said) and output in str(refused.value.args[0])
    sys.path[:] = before
