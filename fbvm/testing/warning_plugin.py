"""Warnings in pytest: those of all programs that the tests ran, once each, at the end.

    pytest --fbvm-no-warn S0390 --fbvm-warnings-as-errors

The ini options `fbvm_no_warn` and `fbvm_warnings_as_errors` say the same for every run.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fbvm.check.lint.suppression import Wanted
    from fbvm.testing.subject import Subject

NAME = "fbvm_warned"
"""The name of the plugin in pytest."""


def add_options(parser: pytest.Parser, group: pytest.OptionGroup) -> None:
    """The options of the command line and of pytest's ini."""
    parser.addini("fbvm_no_warn", "codes of warnings of PLC code that are not wanted", type="args", default=[])
    parser.addini("fbvm_warnings_as_errors", "warnings of PLC code are errors", type="bool", default=False)
    group.addoption("--fbvm-no-warn", action="append", default=[], metavar="CODE",
                    help="do not warn of that in PLC code, such as S0390, or of `all`")  # fmt: skip
    group.addoption("--fbvm-warnings-as-errors", action="store_true", help="warnings of PLC code are errors")


class WarningPlugin:
    """The options about warnings of a session, and the warnings of all programs."""

    def __init__(self, config: pytest.Config) -> None:
        listed = [*config.getini("fbvm_no_warn"), *config.getoption("fbvm_no_warn")]
        self._unwanted = [code for codes in listed for code in codes.split(",")]
        self._as_errors = bool(config.getoption("fbvm_warnings_as_errors") or config.getini("fbvm_warnings_as_errors"))
        self._shown: dict[str, None] = {}
        if self._unwanted:
            self.wanted  # noqa: B018  a wrong code ends the session at its start

    @cached_property
    def wanted(self) -> Wanted:
        """Which warnings are wanted.  Raises UsageError for a code that no warning has."""
        from fbvm.check.lint.suppression import Wanted

        try:
            return Wanted.of(self._unwanted, self._as_errors)
        except ValueError as error:
            raise pytest.UsageError(f"--fbvm-no-warn: {error}") from None

    def add(self, subject: Subject) -> None:
        """Adds the warnings of a compiled program."""
        self._shown.update(dict.fromkeys(each.render() for each in subject.warnings))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """A worker of xdist hands its warnings to the controller."""
        output: dict[str, Any] | None = getattr(session.config, "workeroutput", None)
        if output is not None:
            output[NAME] = list(self._shown)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: Any) -> None:
        """The controller takes the warnings of a worker."""
        self._shown.update(dict.fromkeys(getattr(node, "workeroutput", {}).get(NAME, ())))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Every warning once."""
        if self._shown:
            terminalreporter.section("warnings of PLC code")
            for text in sorted(self._shown, key=_by_place):
                terminalreporter.line(text)


def _by_place(text: str) -> str:
    """The key that sorts texts as they read: line 9 before line 10."""
    return re.sub("[0-9]+", lambda number: number[0].zfill(9), text)


def warning_plugin(config: pytest.Config) -> WarningPlugin:
    """The warning plugin of a session."""
    plugin: WarningPlugin | None = config.pluginmanager.get_plugin(NAME)
    assert plugin is not None, "it is registered when pytest starts"
    return plugin
