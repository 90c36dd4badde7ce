"""The recipes of CONTRIBUTING.md work: every file that they name is there, and their examples do what is said, in a copy."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path

import pytest
from click.testing import CliRunner

import fbvm
from fbvm.cli.main import main

HOUSE = Path(__file__).resolve().parent.parent
TEXT = (HOUSE / "CONTRIBUTING.md").read_text(encoding="utf-8")
RECIPES = dict(re.findall(r"^### (.*?)\n(.*?)(?=^### |^## Commits)", TEXT, re.M | re.S))
PARTS = ("fbvm", "fblib", "grammar", "examples")
FOLDERS = ("fbvm/", "fblib/", "grammar/", "examples/", "tests/", "docs/")
EXAMPLE = re.compile(r"`([\w./-]+)`(?:, below the line with `([^`]+)`)?:\n\n(`{3,})\w+\n(.*?)^\3$", re.M | re.S)


@dataclass(frozen=True)
class Example:
    """A piece of a recipe: the file, the beginning of the line below which it goes ("" for a new file), and its text."""

    file: str
    below: str
    text: str


def examples(recipe: str) -> list[Example]:
    found = [Example(match[1], match[2] or "", match[4]) for match in EXAMPLE.finditer(RECIPES[recipe])]
    assert found, recipe
    return found


def files(text: str) -> set[str]:
    """The files and folders of the repository that a text names."""
    return {name for name in re.findall(r"`([\w./-]+)`", text) if name.startswith(FOLDERS)}


class Copy:
    """A copy of what the product consists of, in which recipes are followed.  `restore` undoes all of them; bytecode and what
    fbvm keeps in its cache stay for the next recipe."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for part in PARTS:
            shutil.copytree(HOUSE / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
        for part in ("tests", "docs"):
            (folder / part).symlink_to(HOUSE / part)
        self._states = self._found()
        self._take_bytecode()

    def _take_bytecode(self) -> None:
        """Copied files have the times of the originals, so that Python takes the bytecode of these as theirs."""
        for path in (HOUSE / "fbvm").rglob("*.py"):
            kept, place = (Path(cache_from_source(str(top / path.relative_to(HOUSE)))) for top in (HOUSE, self.folder))
            with suppress(FileNotFoundError):  # a module that nobody has imported yet
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(kept, place)

    def _found(self) -> dict[Path, tuple[int, int]]:
        """Size and time of every file but bytecode and the cache of fbvm."""
        found = {}
        for top, folders, names in os.walk(self.folder):
            folders[:] = [name for name in folders if name not in ("__pycache__", "cache")]
            for name in names:
                stat = (path := Path(top, name)).stat()
                found[path] = stat.st_size, stat.st_mtime_ns
        return found

    def restore(self) -> None:
        """Make every file what it was."""
        found = self._found()
        for path in found.keys() - self._states.keys():
            path.unlink()
        for path, state in self._states.items():
            if found.get(path) != state:
                shutil.copy2(HOUSE / path.relative_to(self.folder), path)
        for top, _, _ in os.walk(self.folder, topdown=False):
            if not os.listdir(top):
                os.rmdir(top)
        assert self._found() == self._states

    def follow(self, recipe: str) -> None:
        """Do what a recipe says; its tests are done in a folder of their own, since those of the repository stay as they are."""
        for example in examples(recipe):
            path = self.folder / example.file.replace("tests/", "own_tests/")
            path.parent.mkdir(parents=True, exist_ok=True)
            if not example.below:
                assert not (HOUSE / example.file).exists(), f"{example.file} is no new file"
                path.write_text(example.text, encoding="utf-8")
                continue
            lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
            places = [number for number, line in enumerate(lines) if line.lstrip().startswith(example.below)]
            assert len(places) == 1, f"{example.file} has {len(places)} lines with {example.below}"
            lines.insert(places[0] + 1, example.text)
            path.write_text("".join(lines), encoding="utf-8")

    def python(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "FBVM_CACHE": str(self.folder / "cache")}
        command = [sys.executable, *map(str, arguments)]
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)

    def fbvm(self, *arguments: str) -> str:
        result = self.python("-m", "fbvm", *arguments)
        assert result.returncode == 0, result.stdout + result.stderr
        return result.stdout

    def corpus(self, recipe: str) -> None:
        """Run the programs of a recipe for `tests/lang` on every build of every engine."""
        [path] = [example.file for example in examples(recipe) if example.file.startswith("tests/lang/")]
        lang = HOUSE / "tests" / "lang"
        program = f"""
import sys
sys.path.insert(1, {str(lang)!r})
import fbvm, lang_corpus, lang_check
from pathlib import Path
from fbvm.machine.plc import Plc
assert Path(fbvm.__file__).is_relative_to({str(self.folder)!r})
builds = {{**lang_check.BUILDS, "native": lambda image, cycle_ns: Plc(image, cycle_ns, budget=100_000, engine="native")}}
done = 0
for item in lang_corpus.read(Path({path.replace("tests/", "own_tests/")!r})):
    lang_check.check(item, builds)
    done += 1
print(done)
"""
        result = self.python("-c", program)
        assert result.returncode == 0, result.stdout + result.stderr
        assert int(result.stdout) >= 1

    def house(self, broken: str = "") -> subprocess.CompletedProcess[str]:
        """The house test, over the copy; then once more the rule that a page without its file breaks, if one is named."""
        program = f"""
import gc, sys
gc.disable()  # a million nodes stay until the end
sys.path.insert(1, {str(HOUSE / "tests")!r})
from pathlib import Path
import house
house.HOUSE = Path({str(self.folder)!r})
house.PACKAGE = house.HOUSE / "fbvm"
house.MODULES = sorted(house.PACKAGE.rglob("*.py"))
import test_house
text = test_house.all_tests() + "".join(path.read_text() for path in Path("own_tests").rglob("*.st"))
test_house.all_tests = lambda: text
test_house.test_every_code_has_a_page_and_every_page_a_code()
test_house.test_every_code_has_a_test()
test_house.test_every_code_is_used()
test_house.test_imports_never_climb()
test_house.test_every_module_says_what_it_is_for()
if {broken!r}:
    print("all rules are kept")
    Path({broken!r}).unlink()
    test_house.test_every_code_has_a_page_and_every_page_a_code()
"""
        return self.python("-c", program)


@pytest.fixture(scope="module")
def only_copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    return Copy(tmp_path_factory.mktemp("recipes") / "copy")


@pytest.fixture
def copy(only_copy: Copy) -> Iterator[Copy]:
    """The copy, to which nothing has been done."""
    yield only_copy
    only_copy.restore()


def test_every_file_that_is_named_is_there() -> None:
    made = {example.file for recipe in RECIPES if EXAMPLE.search(RECIPES[recipe]) for example in examples(recipe)
            if not example.below}  # fmt: skip
    named = {name for name in files(TEXT) if "VENDOR" not in name} - made
    assert len(named) > 30
    assert sorted(name for name in named if not (HOUSE / name).exists()) == []


def test_each_kind_of_change_has_a_recipe_that_names_files() -> None:
    assert list(RECIPES) == ["A standard function", "A standard block", "A question of dialects", "A ladder instruction",
                             "A diagnostic", "A vendor's unit", "A command", "A lesson"]  # fmt: skip
    assert [recipe for recipe, text in RECIPES.items() if not files(text)] == []


@pytest.mark.slow
def test_a_standard_function(copy: Copy) -> None:
    copy.follow("A standard function")
    copy.corpus("A standard function")


@pytest.mark.slow
def test_a_standard_block(copy: Copy) -> None:
    copy.follow("A standard block")
    copy.corpus("A standard block")
    assert "Q is TRUE for one call when CLK changes." in copy.fbvm("explain", "T_TRIG")
    copy.fbvm("fmt", "--check", "fblib/iec/T_TRIG.st")


@pytest.mark.slow
def test_a_ladder_instruction(copy: Copy) -> None:
    copy.follow("A ladder instruction")
    assert "Half of S, rounded down." in copy.fbvm("explain", "HALF")
    program = "PROGRAM Main\nLADDER\nLD P_On\nHALF #0009 D0\nEND_LADDER\nEND_PROGRAM\n"
    (copy.folder / "main.st").write_text(program, encoding="utf-8")
    for engine in ("python", "native"):
        assert copy.fbvm("run", "main.st", "--scans", "1", "--show", "D0", "--engine", engine) == "D0 = 4 (16#0004)\n"


@pytest.mark.slow
def test_a_diagnostic(copy: Copy) -> None:
    copy.follow("A diagnostic")
    copy.corpus("A diagnostic")
    shown = copy.fbvm("explain", "S0393")
    assert shown.startswith("# S0393 NOT of a NOT")
    wrong, right = re.findall(r"^```st\n(.*?)^```", shown, re.M | re.S)
    (copy.folder / "main.st").write_text(wrong, encoding="utf-8")
    assert "S0393" in copy.python("-m", "fbvm", "check", "main.st").stderr
    (copy.folder / "main.st").write_text(right, encoding="utf-8")
    assert copy.fbvm("check", "main.st") == ""
    result = copy.house("fbvm/base/pages/S0393.md")
    assert result.stdout == "all rules are kept\n", result.stderr
    assert result.returncode != 0
    assert "test_every_code_has_a_page_and_every_page_a_code" in result.stderr


@pytest.mark.slow
def test_a_command(copy: Copy) -> None:
    copy.follow("A command")
    assert re.search(r"^  size +Print how much memory a program takes\.$", copy.fbvm("--help"), re.M)
    (copy.folder / "main.st").write_text("PROGRAM Main\nEND_PROGRAM\n", encoding="utf-8")
    assert re.fullmatch(r"\d+ bytes\n", copy.fbvm("size", "main.st"))
    result = copy.house()
    assert result.returncode == 0, result.stderr


@pytest.mark.slow
def test_a_lesson(copy: Copy) -> None:
    first = copy.folder / "examples/lessons/01-the-late-lamp"
    assert [name for name in re.findall(r"^- `(\S+?)`", RECIPES["A lesson"], re.M) if not (first / name).exists()] == []
    shutil.copytree(first, copy.folder / "examples/lessons/13-a-new-one")
    assert "13" in copy.fbvm("learn")
    copy.fbvm("learn", "13", "--folder", "mine")
    [mine] = (copy.folder / "mine").iterdir()
    assert copy.python("-m", "fbvm", "learn", "13", "--check", "--folder", "mine").returncode == 1
    for solved in ("answers.toml", "program.st"):
        shutil.copy(first / "solution" / solved, mine)
    copy.fbvm("learn", "13", "--check", "--folder", "mine")


def test_the_version_is_said_once_and_alike() -> None:
    project = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"]
    assert project["tool"]["hatch"]["version"]["path"] == "fbvm/base/version.py"
    assert CliRunner().invoke(main, ["--version"]).output == f"fbvm, version {fbvm.__version__}\n"
    changes = (HOUSE / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.findall(r"^## \[?(\d+\.\d+\.\d+)\]?(.*)$", changes, re.M)
    newest, said = released[0]
    assert fbvm.__version__.partition(".dev")[0] == newest
    assert (".dev" in fbvm.__version__) == ("unreleased" in said)
