"""The mutants of tests/bench/mutants.py: each differs from its source, can be compiled, and is gone when it has been tried."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import coverage
import pytest

HOUSE = Path(__file__).resolve().parent.parent


def load() -> Any:
    path = HOUSE / "tests" / "bench" / "mutants.py"
    described = importlib.util.spec_from_file_location("mutants", path)
    assert described is not None and described.loader is not None
    module = sys.modules["mutants"] = importlib.util.module_from_spec(described)
    described.loader.exec_module(module)
    return module


m = load()
import forked  # noqa: E402
from reached import Reached  # noqa: E402

PYTHON = '''"""Text with 1 < 2."""
LIMIT: int = 3  # ö


def f(a: Literal[1], ö: bool = True) -> int:
    if a <= LIMIT and not ö:
        a.count += 1
        a.call(f"{a == 1}")
    return a if a is not None else -2
'''
ST = """FUNCTION F : INT
VAR_INPUT a : INT; b : BOOL := TRUE; END_VAR
(* 1 < 2 *)
IF a < 10 AND b THEN
    F := 16#0F; // 7
END_IF;
END_FUNCTION
"""


def lines(name: str, text: str) -> list[str]:
    """The changed lines of all mutants of a text."""
    made = m.mutants(Path(name), text)
    return [line[1:].strip() for one in made for line in m.difference(one, text).splitlines()
            if line.startswith("+")]


def copy_without_tests(folder: Path) -> Any:
    copy = m.Copy(folder)
    for file in (copy.folder / "tests").rglob("test_*.py"):
        file.unlink()
    return copy


def test_mutants_of_python() -> None:
    assert sorted(lines("x.py", PYTHON)) == sorted([
        "LIMIT: int = 4  # ö",
        "def f(a: Literal[1], ö: bool = False) -> int:",
        "if a < LIMIT and not ö:",
        "if a <= LIMIT or not ö:",
        "if (not (a <= LIMIT and not ö)):",
        "a.count += 2",
        "pass",
        "pass",
        "return a if a is None else -2",
        "return a if a is not None else -3",
        "return a if (not (a is not None)) else -2",
        "return None",
    ])


def test_mutants_of_st() -> None:
    assert sorted(lines("x.st", ST)) == sorted([
        "VAR_INPUT a : INT; b : BOOL := FALSE; END_VAR",
        "IF a <= 10 AND b THEN",
        "IF a < 11 AND b THEN",
        "IF a < 10 OR b THEN",
        "IF NOT (a < 10 AND b) THEN",
        "F := 16#10; // 7",
        "; // 7",
    ])


@pytest.mark.slow
def test_every_mutant_of_a_file_differs_from_it_and_compiles() -> None:
    path = Path("fbvm/wire/modbus.py")
    text = (HOUSE / path).read_text(encoding="utf-8")
    made = m.mutants(path, text)
    assert len(made) > 50
    texts = [one.apply(text) for one in made]
    assert len({text, *texts}) == len(made) + 1
    for one in texts:
        compile(one, str(path), "exec")


def test_a_room_has_files_and_tests() -> None:
    files = m.files_of("units/etn21")
    assert Path("fbvm/units/etn21/mail.py") in files
    assert m.files_of("omron/etn21")[0] == Path("fblib/omron/etn21/ETN21_Accept.st")
    tests = m.tests_of(Path("fbvm/record/draw/why.py"))
    assert tests[0].startswith("tests/unit/record/") and {"tests/unit/cli/test_cli.py", "tests/cx/test_diff.py"} <= set(tests)
    folders = {Path(name).parent.as_posix() for name in m.tests_of(Path("fbvm/cli/projects/mutate.py"))}
    assert folders == {"tests/unit/cli", "tests/unit/campaign", "tests/unit/testing"}
    assert {Path(name).parent.name for name in m.tests_of(Path("fbvm/cli/programs/check.py"))} == {"cli"}
    with pytest.raises(ValueError, match="no room 'nowhere'"):
        m.files_of("nowhere")


@pytest.mark.slow
def test_every_room_has_tests() -> None:
    rooms = [path for path in sorted((HOUSE / "fbvm").iterdir()) if (path / "__init__.py").is_file()]
    assert len(rooms) > 10
    for room in rooms:
        assert m.tests_of(room.relative_to(HOUSE) / "x.py"), room


@pytest.mark.slow
def test_a_copy_runs_the_mutant_and_is_restored(tmp_path: Path) -> None:
    """The tests of the copy import the copy's sources, and the repository keeps its own."""
    copy = m.Copy(tmp_path)
    path = Path("fbvm/wire/modbus.py")
    text = (HOUSE / path).read_text(encoding="utf-8")
    run = (["tests/unit/wire"], "not slow", 100)
    start = text.index("\nMAX_PDU_BYTES = ") + 1
    broken = m.Mutant(path, start, text.index("\n", start), "MAX_PDU_BYTES = 9")
    assert copy.finds(broken, *run)
    same = m.Mutant(path, len(text), len(text), "\n")
    assert not copy.finds(same, *run)
    assert (HOUSE / path).read_text(encoding="utf-8") == (copy.folder / path).read_text(encoding="utf-8") == text


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="POSIX only")
def test_a_mutant_within_functions_is_tried_in_a_fork(tmp_path: Path) -> None:
    """Also one of an inner function and of a method; what stands outside of functions is left to a new process."""
    copy = copy_without_tests(tmp_path)
    path = Path("fbvm/wire/made.py")
    text = ("LIMIT = 1\n\ndef outer():\n    def inner():\n        return 2\n    return inner\n\n"
            "class Made:\n    size = 3\n    def get(self):\n        return 4\n    def unseen(self):\n        return 5\n")
    (copy.folder / path).write_text(text, encoding="utf-8")
    (copy.folder / "tests" / "unit" / "wire" / "test_made.py").write_text(
        "import pytest\nfrom fbvm.wire import made\nKEPT = made.outer()\n\n"
        "def test_outer():\n    assert (KEPT(), made.outer()()) == (2, 2)\n\n"
        "@pytest.mark.slow\ndef test_get():\n    assert made.Made().get() == 4\n", encoding="utf-8")

    tests = ["tests/unit/wire/test_made.py"]

    def found(number: int, marks: str) -> bool:
        at = text.index(f" {number}\n") + 1
        return bool(copy.finds_in_fork(m.Mutant(path, at, at + 1, "0"), tests, marks, 20))

    try:
        assert found(2, "not slow") and not found(4, "not slow") and found(4, "slow") and not found(5, "slow")
        for number in (1, 3):
            with pytest.raises(NotImplementedError):
                found(number, "slow")
        assert (copy.folder / path).read_text(encoding="utf-8") == text
    finally:
        copy.close()


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="POSIX only")
def test_a_mutant_of_a_library_is_tried_in_a_fork(tmp_path: Path) -> None:
    """Though the session has compiled a program with the block, and keeps it."""
    copy = copy_without_tests(tmp_path)
    name = "tests/lang/test_made.py"
    (copy.folder / name).write_text(
        "from functools import cache\nfrom fbvm.code.compiler import compile_text\nfrom fbvm.machine.plc import Plc\n\n"
        "@cache\ndef image():\n"
        "    text = 'PROGRAM P VAR c : CTU; b : BOOL; END_VAR b := NOT b; c(CU := b, PV := 2); END_PROGRAM'\n"
        "    return compile_text(text).image\n\n"
        "image()\n\ndef test_count():\n    plc = Plc(image(), engine='python')\n    plc.scan()\n    plc.scan()\n    plc.scan()\n"
        "    assert plc.read('P.c.CV') == 2\n", encoding="utf-8")
    path = Path("fblib/iec/CTU.st")
    text = (copy.folder / path).read_text(encoding="utf-8")
    at = text.index("+ 1") + 2
    try:
        assert copy.finds_in_fork(m.Mutant(path, at, at + 1, "2"), [name], "not slow", 20)
        assert not copy.finds_in_fork(m.Mutant(path, at, at, "0"), [name], "not slow", 20)
        assert (copy.folder / path).read_text(encoding="utf-8") == text
    finally:
        copy.close()


@pytest.mark.slow
def test_what_the_quick_tests_do_not_find_is_tried_with_the_slow_ones(tmp_path: Path) -> None:
    """A file of tests where a quick one looks at `a`, a slow one at `b`, none at `c`; a stage without tests finds nothing."""
    copy = m.Copy(tmp_path)
    folder = copy.folder / "tests" / "unit" / "wire"
    for file in folder.glob("test_*.py"):
        file.unlink()
    path = Path("fbvm/wire/made.py")
    (copy.folder / path).write_text("a = 1\nb = 1\nc = 1\n", encoding="utf-8")
    quick = "from fbvm.wire import made\n\ndef test_a():\n    assert made.a == 1\n"
    slow = "import pytest\n\n@pytest.mark.slow\ndef test_b():\n    assert made.b == 1\n"
    (folder / "test_made.py").write_text(quick + slow, encoding="utf-8")
    for file in (copy.folder / "tests" / "unit" / "net").glob("test_*.py"):
        file.unlink()
    made = [m.Mutant(path, at, at + 1, "2") for at in (4, 10, 16)]
    stages = [m.Stage(copy, name) for name in m.STAGES]
    assert [[stage.finds(one) for stage in stages] for one in made] == [[True, False], [False, True], [False, False]]
    assert m.told(stages, 3) == "1 of 3 by quick tests, 1 by slow ones" and m.told(stages[:1], 3) == "1 of 3 by quick tests"
    (folder / "test_made.py").write_text(quick, encoding="utf-8")
    assert not m.Stage(copy, "slow").finds(made[0])
    (copy.folder / path).write_text("a = 3\n", encoding="utf-8")
    assert not m.Stage(copy, "quick").finds(made[0]), "a test that fails without the mutant finds nothing"


@pytest.mark.slow
def test_tests_of_other_rooms_that_execute_the_statement_are_tried(tmp_path: Path) -> None:
    """`b` is looked at in another room only.  What was changed behind the run that was measured is tried as a whole file."""
    copy = m.Copy(tmp_path / "now")
    for room in ("wire", "net"):
        shutil.rmtree(copy.folder / "tests" / "unit" / room)
    path, other = Path("fbvm/wire/made.py"), "tests/unit/base/test_made.py"
    now = "# A comment.\n\ndef one():\n    return 1\n\ndef two():\n    return 2\n"
    (copy.folder / path).write_text(now, encoding="utf-8")
    looks = "from fbvm.wire import made\n\ndef test_two():\n    assert made.two() == 2\n"
    (copy.folder / other).write_text(looks, encoding="utf-8")
    then = tmp_path / "then"
    for name, text in ((path, now.partition("\n\n")[2]), (other, looks)):
        (then / name).parent.mkdir(parents=True)
        (then / name).write_text(text, encoding="utf-8")
    missed = "tests/unit/base/test_missed.py"
    for folder in (copy.folder, then):
        (folder / missed).write_text(looks, encoding="utf-8")
    data = coverage.CoverageData(str(tmp_path / "map"))
    data.set_context(f"{other}::test_two|run")
    data.add_lines({str(then / path): [5]})
    data.write()
    reached = Reached(tmp_path / "map", copy.folder)
    assert reached.tests(path, now, now.index("return 2")) == [f"{other}::test_two"]
    assert reached.tests(path, now, now.index("return 1")) is None
    at = now.index("2\n")
    broken = m.Mutant(path, at, at + 1, "3")
    assert not m.Stage(copy, "quick", reached).finds(broken), "the room has no tests"
    assert m.Stage(copy, m.ELSEWHERE, reached).finds(broken)
    assert reached.among([f"{other}::test_two"], [missed, other]) == [missed, f"{other}::test_two"], "it was not measured"
    (copy.folder / other).write_text(looks.replace("== 2", "> 0"), encoding="utf-8")
    assert reached.elsewhere([f"{other}::test_two"], []) == reached.among([f"{other}::test_two"], [other]) == [other]


def test_tests_of_the_own_folder_come_first_and_then_those_that_execute_few_lines(tmp_path: Path) -> None:
    """Of each folder: what executes few lines takes little time.  What changed since then is tried as a whole file."""
    own = [f"tests/unit/record/test_{name}.py" for name in "ab"]
    files = [*own, "tests/unit/cli/test_c.py"]
    for folder in ("then", "now"):
        for file in [*files, "fbvm/x.py"]:
            (tmp_path / folder / file).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / folder / file).write_text("a = 1\nb = 2\nc = 3\n", encoding="utf-8")
    data = coverage.CoverageData(str(tmp_path / "map"))
    for test, lines in {f"{files[0]}::big": [1, 2, 3], f"{files[1]}::small": [1, 2], f"{files[2]}::smallest": [2],
                        f"{files[2]}::other": [1, 2, 3]}.items():  # fmt: skip
        data.set_context(f"{test}|run")
        data.add_lines({str(tmp_path / "then" / "fbvm" / "x.py"): lines})
    data.write()
    reached = Reached(tmp_path / "map", tmp_path / "now")
    reaching = reached.tests(Path("fbvm/x.py"), "a = 1\nb = 2\nc = 3\n", 6)
    big, small, other, smallest = f"{files[0]}::big", f"{files[1]}::small", f"{files[2]}::other", f"{files[2]}::smallest"
    assert reached.among(reaching, files) == [small, big, smallest, other]
    assert reached.elsewhere(reaching, own) == [smallest, other]
    (tmp_path / "now" / files[2]).write_text("", encoding="utf-8")
    assert reached.among(reaching, files) == [files[2], small, big]


def test_of_named_tests_so_many_are_tried_and_files_are_tried_whole() -> None:
    class Item:
        def __init__(self, nodeid: str, is_slow: bool = False) -> None:
            self.nodeid, self.is_slow = nodeid, is_slow

        def get_closest_marker(self, name: str) -> object:
            return object() if self.is_slow else None

    items: list[Any] = [Item("a.py::one"), Item("b.py::one"), Item("b.py::two"), Item("b.py::three", True), Item("c.py::one"),
                        Item("c.py::two")]  # fmt: skip
    tests = ["c.py", "b.py::three", "b.py::two", "b.py::one", "a.py::one"]
    quick = [item.nodeid for item in forked._chosen(items, tests, False, 2)]
    assert quick == ["c.py::one", "c.py::two", "b.py::two", "b.py::one"]
    assert [item.nodeid for item in forked._chosen(items, tests, True, 2)] == ["b.py::three"]


@pytest.mark.slow
def test_the_tests_that_load_a_file_of_a_library_are_noted(tmp_path: Path) -> None:
    """By tests, and by files that load some when they are collected; of both, the whole files are tried last."""
    (tmp_path / "test_made.py").write_text(
        "from fbvm.code.compiler import compile_text\n\n"
        "def made(block):\n    return compile_text(f'PROGRAM P VAR b : {block}; END_VAR b(); END_PROGRAM').image\n\n"
        "made('CTD')\n\ndef test_up():\n    assert made('CTU')\n\ndef test_none():\n    pass\n", encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HOUSE), str(HOUSE / "tests" / "bench")])}
    subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "loaded", "--loaded", "noted", "-n", "1", "test_made.py"],
                   cwd=tmp_path, env=environment, check=True, stdout=subprocess.DEVNULL)
    reached = Reached(tmp_path / "noted", HOUSE)

    def noted(block: str) -> list[str] | None:
        path = Path(f"fblib/iec/{block}.st")
        return reached.tests(path, (HOUSE / path).read_text(encoding="utf-8"), 200)

    assert noted("CTU") == ["test_made.py", "test_made.py::test_up"]
    assert noted("CTD") == ["test_made.py"]
    assert noted("CTUD") == []
    assert list(tmp_path.glob("notedgw*")) == []
