"""What pytest knows of suites of TwinCAT from its start: files to look into and an option; the rest is loaded for such a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fbvm.interchange.twincat import PROJECT_SUFFIX

if TYPE_CHECKING:
    from fbvm.testing.suites.items import SuitesFile


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> SuitesFile | None:
    """`*.plcproj` whose program runs suites."""
    if file_path.suffix.lower() != PROJECT_SUFFIX:
        return None
    from fbvm.testing.suites.items import SuitesFile

    made: SuitesFile = SuitesFile.from_parent(parent, path=file_path)
    return made


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option for TcUnit's form of the results."""
    parser.getgroup("fbvm", "PLC programs").addoption(
        "--fbvm-xunit", metavar="FILE", help="write the results of TwinCAT's suites as TcUnit writes them")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Writes the file of --fbvm-xunit."""
    if path := session.config.getoption("fbvm_xunit"):
        from fbvm.testing.suites.items import FILES
        from fbvm.testing.suites.xunit import write_xunit

        write_xunit(Path(path), [file.run for file in session.stash.get(FILES, []) if file.run is not None])
