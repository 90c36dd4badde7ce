"""Breaks fbvm in small ways and counts how many of them the tests find.  It gates nothing.

    python tests/bench/mutants.py ROOM [--count N] [--seed S] [--seconds T] [--quick] [--reach FILE] [--limit N] [--fork]

ROOM is a folder or file of `fbvm/` or `fblib/`: `check`, `units/etn21`, `omron/mtcp_etn`, `record/draw/why.py`.  A mutant is
one edit of one file: another relation, AND for OR, a constant plus one, a condition negated, a statement removed, None for a
result.  Each is written into a copy of the repository in a temporary folder, where the quick tests of the room run, first those
that name the file.  A mutant that they do not find is tried again with the slow tests of the same files, unless `--quick` is
given.  The last line counts both, and a mutant that no test finds is printed as a difference.

Which tests of the whole suite execute a line is known with `--reach FILE`, the `.coverage` of a run (with `pip install
pytest-cov`) of `pytest -n auto --cov=fbvm --cov-context=test --cov-report= -W ignore`, or for libraries in ST the file that
the plugin in loaded.py writes: then only those of the room's tests run that execute the changed statement, first those of the
room's own folder, and of each folder those that execute the fewest lines, `--limit` of them at most; a mutant that they do not
find is tried with those of other rooms.  The sources of that run stay where they were: what was changed since is told by
comparing.

With `--fork` a mutant within functions, or of a library, is first tried in forks of one session of pytest that has collected
all tests, which takes a fraction of a second; only what is not found there is tried in new processes (forked.py; POSIX).

A survivor is a question, not always a gap: some mutants mean the same program (a limit one higher, a quicker way left out).
Those that were looked at and stay are in mutants_survivors.md, each with its reason."""

from __future__ import annotations

import argparse
import ast
import difflib
import importlib.util
import os
import random
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(HOUSE), str(HOUSE / "tests" / "bench")]

from forked import WAITING, Forked  # noqa: E402
from reached import Reached  # noqa: E402

from fbvm.base.diagnostics import Source, errors  # noqa: E402
from fbvm.syntax import tree  # noqa: E402
from fbvm.syntax.parser import parse  # noqa: E402
from fbvm.syntax.st.lexer import Lexer  # noqa: E402
from fbvm.syntax.tree.node import Node, names_of  # noqa: E402

COPIED = ("fbvm", "fblib", "grammar", "tests", "examples", "docs", "pyproject.toml", "README.md", "ARCHITECTURE.md",
          "CONFORMANCE.md", "CHANGELOG.md", "LICENSE")  # fmt: skip
TESTS = {
    "fblib": ("tests/fblib", "tests/unit/units"), "iec": ("tests/lang", "tests/conformance"), "codesys": ("tests/lang",),
    "matiec": ("tests/lang", "tests/plcopen"), "rusty": ("tests/lang",), "strucpp": ("tests/lang",),
    "twincat": ("tests/lang", "tests/twincat"), "omron/ladder": ("tests/lang", "tests/unit/machine"),
    "omron/etn21": ("tests/unit/processor",), "base": ("tests/unit/base", "tests/lang"),
    "syntax": ("tests/unit/syntax", "tests/golden", "tests/lang", "tests/property"),
    "wire": ("tests/unit/wire", "tests/unit/net"),
    "check": ("tests/unit/check", "tests/lang", "tests/unit/code"),
    "interchange": ("tests/unit/interchange", "tests/plcopen", "tests/cx", "tests/twincat"),
    "net": ("tests/unit/net", "tests/unit/units", "tests/fblib"),
    "code": ("tests/unit/code", "tests/lang", "tests/unit/engine", "tests/golden"),
    "code/lowering/byte_order.py": ("tests/conformance",),
    "engine": ("tests/unit/engine", "tests/lang", "tests/property"),
    "engine/counted.py": ("tests/unit/machine/test_counting.py",), "engine/powered.py": ("tests/unit/machine/test_power.py",),
    "engine/stops.py": ("tests/unit/machine/test_breakpoints.py",),
    "engine/choice": ("tests/unit/machine/test_breakpoints.py", "tests/unit/machine/test_many_scans.py"),
    "engine/native/scans": ("tests/unit/machine/test_many_scans.py", "tests/unit/machine/test_units_in_code.py"),
    "units": ("tests/unit/units", "tests/fblib"),
    "processor": ("tests/unit/processor", "tests/unit/machine", "tests/unit/units"),
    "machine": ("tests/unit/machine", "tests/unit/units", "tests/unit/run", "tests/fblib/test_network_instructions.py"),
    "record": ("tests/unit/record", "tests/unit/cli", "tests/cx/test_diff.py"), "run": (
        "tests/unit/run", "tests/unit/net", "tests/unit/machine/test_batches.py", "tests/unit/campaign/test_campaign_parts.py",
        "tests/unit/campaign/test_campaign_items.py", "tests/unit/campaign/test_fleet.py", "tests/unit/live/test_pictures.py",
    ),
    "testing": ("tests/unit/testing", "tests/twincat"), "cli": ("tests/unit/cli",),
    "cli/editors": ("tests/unit/lsp",), "cli/projects": ("tests/unit/campaign", "tests/unit/testing/test_lessons.py"),
    "cli/programs/diff.py": ("tests/cx",), "cli/programs/export.py": ("tests/cx", "tests/plcopen"),
    "cli/programs/import.py": ("tests/cx", "tests/plcopen"), "cli/recordings": ("tests/unit/record",),
    "cli/running/dap.py": ("tests/unit/dap",), "cli/running/live.py": ("tests/unit/live",),
    "cli/running/step.py": ("tests/unit/step",), "cli/shared/debug": ("tests/unit/dap",), "cli/shared/live": ("tests/unit/live",),
    "analysis": ("tests/unit/analysis", "tests/unit/lsp"),
}  # fmt: skip
"""The folders and files of tests that matter for a room, and those beside them for a part of it; for other rooms the folder of
their own name."""
STAGES = {"quick": ("not slow", 60), "slow": ("slow", 200)}
"""The marks of the tests with which a mutant is tried, one stage after the other until one finds it, and how many seconds of
processor time a process of theirs may take: a mutant that takes longer runs for ever, and is found."""
ELSEWHERE = "others'"
"""The stage of the tests of other rooms that execute the changed statement."""
MOST = 400
"""So many tests that execute the changed statement are tried at a time, unless `--limit` says it."""
DISTURBED = 3
"""So many tests that fail without the mutant, too, are left out; with more of them, nothing is found."""
NO_TEST = 5
"""The exit status of pytest if it ran no test: nothing was found."""
RELATIONS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "is": "is not", "is not": "is",
             "in": "not in", "not in": "in"}  # fmt: skip
OPERATORS = re.compile(r"\bis\s+not\b|\bnot\s+in\b|\bis\b|\bin\b|[<>!=]=|[<>]")
ST_WORDS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "=": "<>", "<>": "=", "AND": "OR", "OR": "AND", "TRUE": "FALSE",
            "FALSE": "TRUE"}  # fmt: skip
FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.M)
"""A line of the summary of pytest."""


@dataclass(frozen=True)
class Mutant:
    """One edit of one file: `text[start:end]` becomes `new`."""

    path: Path
    start: int
    end: int
    new: str

    def apply(self, text: str) -> str:
        """The text of the file with the edit."""
        return text[: self.start] + self.new + text[self.end :]


# --- edits ------------------------------------------------------------------------------------------------------------


def mutants(path: Path, text: str) -> list[Mutant]:
    """All mutants of a source file, Python or ST by its suffix; each differs from `text` and can be parsed."""
    found = dict.fromkeys(Mutant(path, *edit) for edit in (_python if path.suffix == ".py" else _st)(text))
    return [mutant for mutant in found if mutant.apply(text) != text and _is_readable(path, mutant.apply(text))]


def _is_readable(path: Path, text: str) -> bool:
    if path.suffix == ".py":
        try:
            compile(text, str(path), "exec")
        except (SyntaxError, ValueError):
            return False
        return True
    return not errors(parse(Source(path.name, text))[1])


Edit = tuple[int, int, str]


def _python(text: str) -> Iterator[Edit]:
    """The edits of a Python source."""
    module = ast.parse(text)
    lines = text.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def place(line: int, column: int) -> int:
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    def span(node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return place(node.lineno, node.col_offset), place(node.end_lineno, node.end_col_offset)

    for node in _executed(module):
        if isinstance(node, ast.Compare):
            for one, other in zip([node.left, *node.comparators], node.comparators, strict=False):
                yield from _between(text, span(one)[1], span(other)[0], OPERATORS, RELATIONS)
        elif isinstance(node, ast.BoolOp):
            for one, other in zip(node.values, node.values[1:], strict=False):
                yield from _between(text, span(one)[1], span(other)[0], re.compile(r"\band\b|\bor\b"), {"and": "or", "or": "and"})
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            yield *span(node), str(not node.value if isinstance(node.value, bool) else node.value + 1)
        elif isinstance(node, ast.AugAssign) or isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) or \
                isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute | ast.Subscript):
            yield *span(node), "pass"
        elif isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
            yield *span(node), "return None"
        if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
            start, end = span(node.test)
            yield start, end, f"(not ({text[start:end]}))"


def _executed(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below one that are more than text and types: no annotation, decorator, format string or `if TYPE_CHECKING`."""
    yield node
    for name, inner in ast.iter_fields(node):
        for child in inner if isinstance(inner, list) else [inner]:
            checked = isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING"
            if isinstance(child, ast.AST) and name not in ("annotation", "returns", "decorator_list") and not checked and \
                    not isinstance(child, ast.JoinedStr):
                yield from _executed(child)


def _between(text: str, start: int, end: int, pattern: re.Pattern[str], instead: dict[str, str]) -> Iterator[Edit]:
    """The edit of the operator that stands between two operands."""
    found = pattern.search(text, start, end)
    if found:
        yield found.start(), found.end(), instead[" ".join(found[0].split())]


def _st(text: str) -> Iterator[Edit]:
    """The edits of a source in Structured Text."""
    for token in Lexer(text, lambda *message: None).tokens():
        if token.type == "NUMBER" and re.fullmatch(r"[0-9]+", token.text):
            yield token.start, token.end, str(int(token.text) + 1)
        elif token.type == "NUMBER" and (based := re.fullmatch(r"16#([0-9A-Fa-f]+)", token.text)):
            yield token.start, token.end, f"16#{int(based[1], 16) + 1:X}"
        elif token.text.upper() in ST_WORDS:
            yield token.start, token.end, ST_WORDS[token.text.upper()]
    for node in _nodes(parse(Source("mutant.st", text))[0]):
        if isinstance(node, tree.Assign | tree.CallStatement | tree.Return | tree.Exit):
            yield node.start, node.end, ""
        elif isinstance(node, tree.If):
            for condition, _ in node.branches:
                yield condition.start, condition.end, f"NOT ({text[condition.start : condition.end]})"


def _nodes(part: object) -> Iterator[Node]:
    if isinstance(part, tuple):
        for item in part:
            yield from _nodes(item)
    elif isinstance(part, Node):
        yield part
        for name in names_of(part):
            yield from _nodes(getattr(part, name))


# --- runs -------------------------------------------------------------------------------------------------------------


def files_of(room: str, house: Path = HOUSE) -> list[Path]:
    """The sources of a room, relative to the repository.  Raises ValueError for a name that no folder or file has."""
    for base in ("", "fbvm", "fblib"):
        path = house / base / room
        if room and path.is_file():
            return [path.relative_to(house)]
        if room and path.is_dir():
            return [file.relative_to(house) for file in sorted(path.rglob("*")) if file.suffix in (".py", ".st")]
    raise ValueError(f"there is no room {room!r} in fbvm/ or fblib/")


def tests_of(path: Path, house: Path = HOUSE) -> list[str]:
    """The test files for a source file, in the order in which they run: first those of the room's own folder, and of
    each folder those that name the file."""
    room = path.parts[0] if path.parts[0] == "fblib" else path.parts[1].removesuffix(".py")
    parts = ["/".join(path.parts[1:count]) for count in range(2 if room == "fblib" else 3, len(path.parts) + 1)]
    files: list[Path] = []
    of_parts = [name for part in parts for name in TESTS.get(part, ())]
    for name in dict.fromkeys([*TESTS.get(room, (f"tests/unit/{room}",)), *of_parts]):
        place = house / name
        files += [place] if place.is_file() else sorted(place.rglob("test_*.py"))
    own = files[0].parent if files else house
    files.sort(key=lambda file: (file.parent != own, re.search(rf"\b{path.stem}\b", file.read_text(encoding="utf-8")) is None))
    return [file.relative_to(house).as_posix() for file in files]


class Copy:
    """A copy of the repository in which the tests run; the repository itself is only read."""

    def __init__(self, folder: Path, most: int = MOST) -> None:
        self.folder = folder / "fbvm"
        self._most = most
        self._environment = {**os.environ, "PYTHONPATH": str(self.folder), "XDG_CACHE_HOME": str(folder / "cache")}
        self._forked: Forked | None = None
        for name in COPIED:
            if (HOUSE / name).is_dir():
                shutil.copytree(HOUSE / name, self.folder / name, ignore=shutil.ignore_patterns("__pycache__", "node_modules"))
            elif (HOUSE / name).is_file():
                shutil.copyfile(HOUSE / name, self.folder / name)

    def failure(self, tests: list[str], marks: str, limit_s: int, without: list[str]) -> str | None:
        """Which of the tests with these marks fails first, or None if all pass, or if there are none.

        "" if it is not known, as after `limit_s` seconds of processor time."""
        chosen, said = self.folder.parent / "tests.txt", self.folder.parent / "said.txt"
        left_out = set([test for test in tests if "::" in test][self._most :])
        chosen.write_text("\n".join(test for test in tests if test not in left_out), encoding="utf-8")
        # `ulimit -t` holds for every process that a test starts, also for one in a session of its own, out of killpg's reach.
        pytest = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", "--tb=no", "-p", "no:cacheprovider", "-m", marks,
                  *(word for test in without for word in ("--deselect", test)), f"@{chosen}"]  # fmt: skip
        command = ["sh", "-c", f"ulimit -t {limit_s}; exec {shlex.join(pytest)}"]
        with said.open("w", encoding="utf-8") as out, subprocess.Popen(
                command, cwd=self.folder, env=self._environment, stdout=out, stderr=subprocess.DEVNULL,
                start_new_session=True) as running:  # fmt: skip
            try:
                if running.wait(limit_s * WAITING) in (0, NO_TEST):
                    return None
            except subprocess.TimeoutExpired:
                return ""
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(running.pid, signal.SIGKILL)
        failed = FAILED.search(said.read_text(encoding="utf-8", errors="replace"))
        return failed[1] if failed else ""

    def finds_in_fork(self, mutant: Mutant, tests: list[str], marks: str, limit_s: int) -> bool:
        """As `finds`, in forks of one session.  Raises NotImplementedError for a mutant outside of functions of Python."""
        self._forked = self._forked or Forked(self.folder, self._environment)
        file = self.folder / mutant.path
        text = file.read_text(encoding="utf-8")
        try:
            _write(file, mutant.apply(text))  # for the processes that tests start
            failed = self._forked.failure(mutant.path, text, mutant.apply(text), tests, marks, self._most, limit_s)
        finally:
            _write(file, text)
        again = [failed] if failed else tests
        return failed is not None and self._forked.failure(mutant.path, text, text, again, marks, self._most, limit_s) is None

    def close(self) -> None:
        """Ends the session of the forks."""
        if self._forked is not None:
            self._forked.close()

    def finds(self, mutant: Mutant, tests: list[str], marks: str, limit_s: int) -> bool:
        """True if one of the tests finds a mutant: fails with it, and passes without it.  Afterwards the file is as it was."""
        file = self.folder / mutant.path
        text = file.read_text(encoding="utf-8")
        disturbed: list[str] = []
        while len(disturbed) <= DISTURBED:
            try:
                _write(file, mutant.apply(text))
                failed = self.failure(tests, marks, limit_s, disturbed)
            finally:
                _write(file, text)
            if failed is None:
                return False
            if self.failure([failed] if failed else tests, marks, limit_s, disturbed) is None:
                return True
            disturbed.append(failed)
            if not failed:
                break
        return False


def _write(file: Path, text: str) -> None:
    """Writes a source.  Its byte code goes: it would pass for that of a text of the same size, written in the same second."""
    file.write_text(text, encoding="utf-8")
    Path(importlib.util.cache_from_source(file)).unlink(missing_ok=True)


Way = Callable[[Mutant, list[str], str, int], bool]
"""How a mutant is tried: True if one of the tests with these marks finds it within a time."""


class Stage:
    """The tests of a kind: the quick or the slow ones of the room, or those of other rooms."""

    def __init__(self, copy: Copy, name: str, reached: Reached | None = None, way: Way | None = None) -> None:
        self.name = name
        self.found = 0
        self._copy, self._reached, self._way = copy, reached, way or copy.finds
        self._runs = list(STAGES.values()) if name == ELSEWHERE else [STAGES[name]]

    def finds(self, mutant: Mutant) -> bool:
        """True if one of the tests finds the mutant.  Raises what its way raises."""
        tests = self._tests(mutant)
        found = bool(tests) and any(self._way(mutant, tests, *run) for run in self._runs)
        self.found += found
        return found

    def _tests(self, mutant: Mutant) -> list[str]:
        own = tests_of(mutant.path, self._copy.folder)
        if self._reached is None:
            return own
        text = (self._copy.folder / mutant.path).read_text(encoding="utf-8")
        reaching = self._reached.tests(mutant.path, text, mutant.start)
        if self.name == ELSEWHERE:
            return self._reached.elsewhere(reaching, own)
        return self._reached.among(reaching, own)


def difference(mutant: Mutant, text: str) -> str:
    """A mutant for people: file and line, then the changed lines."""
    line = text.count("\n", 0, mutant.start) + 1
    rows = difflib.unified_diff(text.splitlines(), mutant.apply(text).splitlines(), lineterm="", n=1)
    return "\n".join([f"{mutant.path.as_posix()}:{line}", *list(rows)[3:]])


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    options.add_argument("room")
    options.add_argument("--count", type=int, default=20, help="mutants that are tried (20)")
    options.add_argument("--seed", type=int, default=0, help="which of all mutants (0)")
    options.add_argument("--seconds", type=float, default=600, help="none is begun after this time (600)")
    options.add_argument("--quick", action="store_true", help="only the quick tests of the room")
    options.add_argument("--fork", action="store_true", help="try forks of one session of pytest first")
    options.add_argument("--reach", metavar="FILE", type=Path, help="which tests execute which lines: a .coverage with contexts")
    options.add_argument("--limit", metavar="N", type=int, default=MOST, help=f"with --reach: so many tests at a time ({MOST})")
    given = options.parse_args()
    begun = time.monotonic()
    texts = {path: (HOUSE / path).read_text(encoding="utf-8") for path in files_of(given.room)}
    found = [mutant for path, text in texts.items() for mutant in mutants(path, text)]
    chosen = random.Random(given.seed).sample(found, min(given.count, len(found)))
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder), given.limit)
        reached = Reached(given.reach, copy.folder) if given.reach else None
        names = ["quick"] if given.quick else [*STAGES, ELSEWHERE] if reached else [*STAGES]
        ways = [copy.finds_in_fork, copy.finds] if given.fork else [copy.finds]
        stages = [Stage(copy, name, reached, way) for way in ways for name in names]
        survivors, tried = 0, 0
        for mutant in chosen:
            if time.monotonic() - begun > given.seconds:
                break
            tried += 1
            if not any(_finds(stage, mutant) for stage in stages):
                survivors += 1
                print(difference(mutant, texts[mutant.path]), end="\n\n", flush=True)
        copy.close()
    print(f"{given.room}: {told(stages, tried)}, {survivors} survived; "
          f"{len(found)} exist, seed {given.seed}, {time.monotonic() - begun:.0f} s")
    return 0


def _finds(stage: Stage, mutant: Mutant) -> bool:
    with suppress(NotImplementedError):
        return stage.finds(mutant)
    return False


def told(stages: list[Stage], tried: int) -> str:
    """How many mutants each stage found: "31 of 40 by quick tests, 6 by slow ones, 1 by others' ones"."""
    found: dict[str, int] = {}
    for stage in stages:
        found[stage.name] = found.get(stage.name, 0) + stage.found
    (name, count), *slow = found.items()
    return ", ".join([f"{count} of {tried} by {name} tests", *(f"{more} by {other} ones" for other, more in slow)])


if __name__ == "__main__":
    sys.exit(main())
