"""Coverage in pytest: counts in each process, adds up with pytest-xdist, and reports at the end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fbvm.base.files import write_file
from fbvm.testing.coverage import Coverage
from fbvm.testing.coverage_report import cobertura, table, write_pages

NAME = "fbvm_coverage"
"""Under which the plugin is registered while coverage is counted."""


class CoveragePlugin:
    """Holds the coverage of a session."""

    def __init__(self, config: pytest.Config) -> None:
        self.coverage = Coverage()
        self._config = config

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """A worker of xdist hands its counts to the controller."""
        output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
        if output is not None:
            output[NAME] = self.coverage.to_data()

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: Any) -> None:
        """The controller adds the counts of a worker."""
        data = getattr(node, "workeroutput", {}).get(NAME)
        if data:
            self.coverage.add(Coverage.from_data(data))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """The table, and files if they are wanted."""
        root, option = self._config.rootpath, self._config.getoption
        terminalreporter.section("coverage of PLC code")
        if not self.coverage.files:
            terminalreporter.line("nothing was executed")
            return
        for line in table(self.coverage, root):
            terminalreporter.line(line)
        if pages := option("fbvm_cov_html"):
            terminalreporter.line(f"written to {write_pages(self.coverage, root, Path(pages))}")
        if xml := option("fbvm_cov_xml"):
            write_file(Path(xml), cobertura(self.coverage, root))
            terminalreporter.line(f"written to {xml}")
