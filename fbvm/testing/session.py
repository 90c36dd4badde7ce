"""What the fixtures and the tests in ST take from a pytest session: folders of sources, coverage, pages of failed tests."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from fbvm.machine.counting import Counting
    from fbvm.machine.plc import Plc
    from fbvm.run.varied import VariedRun
    from fbvm.testing.coverage_plugin import CoveragePlugin
    from fbvm.testing.subject import Subject

PAGES: pytest.StashKey[list[Path]] = pytest.StashKey()
"""The pages that the session has written for failed tests."""
VARIED: pytest.StashKey[VariedRun] = pytest.StashKey()
"""In the stash of the configuration: what the campaign that executes the session varies in the test that runs now."""
UNEXPLAINED: pytest.StashKey[bool] = pytest.StashKey()
"""In the stash of the configuration: that nobody reads why tests fail, which takes longer to find out than to execute them."""
MOST_PAGES = 20
"""Pages that one session writes unless --fbvm-pages says another number."""
PROJECT_FILES = ("fbvm.toml", "answers.toml")
"""Files that show that a folder is a project (run.project) or a lesson (testing.lesson)."""
SOURCE_FOLDER = "src"
"""The folder of a project's blocks, beside its pytest.ini or pyproject.toml."""


def explains(config: pytest.Config) -> bool:
    """True if somebody reads why tests of the session fail."""
    return not config.stash.get(UNEXPLAINED, False)


def varied_run(config: pytest.Config) -> VariedRun | None:
    """What varies the test that is executed now, if a campaign does."""
    return config.stash.get(VARIED, None)


def search_folders(path: Path, root: Path) -> list[Path]:
    """The folders in which the files that a test names are looked for: that of the test, then those above it up to `root`, or to
    the project of the test if that lies elsewhere."""
    top = root if path.is_relative_to(root) else project_folder(path) or path.parent
    return [folder for folder in path.parents if folder.is_relative_to(top)]


def project_folder(path: Path) -> Path | None:
    """The project or lesson to which a test file belongs: the nearest folder above it with one of PROJECT_FILES, if any."""
    return next((folder for folder in path.parents if any((folder / name).is_file() for name in PROJECT_FILES)), None)


def library_folders(config: pytest.Config, path: Path) -> list[Path]:
    """The folders in which a test finds blocks by the names of their files: the ini option fbvm_libraries, and `src` near it."""
    sources = [folder / SOURCE_FOLDER for folder in search_folders(path, config.rootpath)]
    return list(dict.fromkeys([*config.getini("fbvm_libraries"), *(folder for folder in sources if folder.is_dir())]))


@contextmanager
def count_coverage(config: pytest.Config, plc: Plc, subject: Subject) -> Iterator[None]:
    """Counts the statements that `plc` executes inside the `with` block, if the session measures coverage."""
    if not config.pluginmanager.has_plugin("fbvm_coverage"):
        yield
        return
    from fbvm.machine.counting import counting

    with counting(plc, covered(config, subject)) as counts:
        try:
            yield
        finally:
            add_coverage(config, subject, counts)


def covered(config: pytest.Config, subject: Subject) -> set[str]:
    """The files whose statements are counted, by their names in sites; none if the session measures no coverage."""
    if not config.pluginmanager.has_plugin("fbvm_coverage"):
        return set()
    from fbvm.testing.coverage import covered_files

    return covered_files(subject)


def add_coverage(config: pytest.Config, subject: Subject, counts: Counting) -> None:
    """Adds what a run of a program has executed to the coverage of the session, if it measures some."""
    plugin: CoveragePlugin | None = config.pluginmanager.get_plugin("fbvm_coverage")
    if plugin:
        plugin.coverage.add_run(subject, counts)


def failure_page(item: pytest.Item, suffix: str, write: Callable[[Path], bool]) -> str:
    """Calls `write` with the path of the HTML page of a failed test; returns the line of the report that names the page.

    `suffix` tells several pages of one test apart.  "" if `write` returned False, or if the session has written enough."""
    from fbvm.testing.pages import page_path

    written, most = item.config.stash.setdefault(PAGES, []), item.config.getoption("fbvm_pages")
    path = page_path(item.config.rootpath, f"{item.nodeid}{suffix}")
    try:
        if len(written) >= most or not write(path):
            return ""
    except OSError as error:
        return f"the page could not be written: {error}"
    written.append(path)
    return f"every scan, in a browser: {os.path.relpath(path, item.config.invocation_params.dir)}"
