"""A plugin of pytest that notes which tests compile programs with which files of the shipped libraries, for mutants.py:

    PYTHONPATH=tests/bench pytest -p loaded -n auto --loaded FILE

FILE becomes a data file of coverage.py (`pip install coverage`) with one context a test, in which all lines of the files that a
test has loaded are executed.  Of tests of one file that share a program, the first is noted; what earlier tests and processes
have compiled is compiled again for each file, so that the test of the cache fails."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from coverage import CoverageData

from fbvm.check.symbols.library import Libraries
from fbvm.code.store import cache
from fbvm.processor import processor


class Notes:
    """What the tests of one process have loaded: by test, the files."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._by_test: dict[str, set[str]] = {}
        self._now: set[str] = set()
        self._path: Path | None = None

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """One test, from its fixtures to their end."""
        if item.path != self._path:
            self._path = item.path
            processor.contract.cache_clear()
            processor._first.cache_clear()
        self._now = self._by_test.setdefault(item.nodeid, set())
        return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[None]:
        """A file, which may compile programs for all its tests."""
        self._now = self._by_test.setdefault(collector.nodeid, set())
        return (yield)

    def note(self, path: Path) -> None:
        """A file is loaded."""
        self._now.add(str(path))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Writes the file, or as a worker one beside it, which the process that started the workers adds to its own."""
        worker = getattr(session.config, "workerinput", {}).get("workerid", "")
        data = CoverageData(f"{self._file}{worker}")
        data.erase()
        for test, files in self._by_test.items():
            data.set_context(f"{test}|run")
            own = {str(session.config.rootpath / test.partition("::")[0]): [1]}  # it ran, whether it loaded something or not
            data.add_lines(own | {name: range(1, Path(name).read_bytes().count(b"\n") + 2) for name in files})
        for part in () if worker else sorted(self._file.parent.glob(f"{self._file.name}gw*")):
            other = CoverageData(str(part))
            other.read()
            data.update(other)
            other.erase()
        data.write()


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--loaded FILE`."""
    parser.addoption("--loaded", metavar="FILE", type=Path, required=True)


def pytest_configure(config: pytest.Config) -> None:
    """From now on, what is loaded is noted."""
    notes = Notes(config.getoption("--loaded").absolute())
    config.pluginmanager.register(notes)
    parse = Libraries._parse

    def noted(self: Libraries, library: Any, path: Path, report: Any) -> Any:
        found = parse(self, library, path, report)
        if found is not None:
            notes.note(path)
        return found

    Libraries._parse = noted  # type: ignore[method-assign]
    cache.read = lambda named, sources: None
