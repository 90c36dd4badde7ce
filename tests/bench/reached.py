"""Which tests of the whole suite execute a statement, by a data file of coverage.py with one context a test."""

from __future__ import annotations

import ast
import difflib
import sqlite3
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

MEASURED = ("fbvm", "fblib")
"""The folders of the repository whose files are measured."""


class Reached:
    """The tests that executed each line, when the file was written, and what of tests and sources was changed since."""

    def __init__(self, file: Path, house: Path) -> None:
        from coverage import CoverageData  # pip install pytest-cov

        self._data = CoverageData(str(file))
        self._data.read()
        self._house = house
        self._sizes = _sizes(file)
        self._known = {_file(test) for test in self._sizes}
        folders = (folder for name in self._data.measured_files() for folder in Path(name).parents)
        self._root = next(folder.parent for folder in folders if folder.name in MEASURED)

    def tests(self, path: Path, text: str, start: int) -> list[str] | None:
        """The tests that executed the statement at an offset of a source; None if that is not known, as for what is imported.

        For a source in ST, of which all is known, their files, too: of tests that share a program, one is noted."""
        if not (self._root / path).is_file():
            return None
        contexts = self._data.contexts_by_lineno(str(self._root / path))
        then = _lines_then((self._root / path).read_text(encoding="utf-8"), text)
        line = text.count("\n", 0, start) + 1
        changed = _statement(text, line) if path.suffix == ".py" else range(line, line + 1)
        lines = [then[line] for line in changed if line in then]
        found = {context.rpartition("|")[0] for line in lines for context in contexts.get(line, ())} - {""}
        files = () if path.suffix == ".py" else {_file(test) for test in found}
        return sorted({*found, *files}) or (None if path.suffix == ".py" else [])

    def among(self, reaching: list[str] | None, own: list[str]) -> list[str]:
        """Those tests of a room that execute the statement, and the whole files that were changed since or did not run; all if
        none is known.  The tests of the folder of the first file come first."""
        if reaching is None:
            return own
        changed = [file for file in own if self._is_changed(file)]
        left = set(own) - set(changed)
        known = self._small_first(test for test in reaching if _file(test) in left)
        return changed + sorted(known, key=lambda test: _folder(test) != _folder(own[0]))

    def elsewhere(self, reaching: list[str] | None, own: list[str]) -> list[str]:
        """Those tests of other rooms that execute the statement; none if it is not known."""
        others = [test for test in reaching or () if _file(test) not in own and (self._house / _file(test)).is_file()]
        small = self._small_first(others)
        return list(dict.fromkeys(_file(test) if self._is_changed(_file(test)) else test for test in small))

    def _small_first(self, tests: Iterable[str]) -> list[str]:
        """First the tests that execute few lines, which take little time and say much about each line; last whole files."""
        return sorted(tests, key=lambda test: ("::" not in test, self._sizes[test]))

    def _is_changed(self, file: str) -> bool:
        then = self._root / file
        return file not in self._known or not then.is_file() or then.read_bytes() != (self._house / file).read_bytes()


def _file(test: str) -> str:
    return test.partition("::")[0]


def _folder(test: str) -> str:
    return _file(test).rpartition("/")[0]


def _sizes(file: Path) -> Counter[str]:
    """How many lines each test has executed; the API of coverage.py tells that of one file at a time."""
    found = Counter[str]()
    data = sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)
    for context, lines in data.execute("SELECT context, numbits FROM line_bits JOIN context ON context.id = context_id"):
        if test := context.rpartition("|")[0]:
            found[test] += int.from_bytes(lines, "little").bit_count()
    data.close()
    return found


def _lines_then(then: str, now: str) -> dict[int, int]:
    """The lines of a source that it had before, too, with their numbers then; both begin with 1."""
    matcher = difflib.SequenceMatcher(None, then.splitlines(), now.splitlines(), autojunk=False)
    return {one.b + count + 1: one.a + count + 1 for one in matcher.get_matching_blocks() for count in range(one.size)}


def _statement(text: str, line: int) -> range:
    """The lines of the innermost statement at a line; of one with a body, those in front of the body."""
    best = range(line, line + 1)
    least = len(text)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.stmt) and node.end_lineno is not None:
            body = getattr(node, "body", None)
            end = body[0].lineno - 1 if isinstance(body, list) and body else node.end_lineno
            if node.lineno <= line <= end and end - node.lineno < least:
                best, least = range(node.lineno, end + 1), end - node.lineno
    return best
