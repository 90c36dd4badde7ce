"""pytest in this process and folder, as often as a campaign wants it."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

import pytest

from fbvm.testing.session import UNEXPLAINED

PLUGIN = "fbvm.testing.plugin"
QUIET = ("-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:unraisableexception", "--fbvm-pages", "0", "--capture=sys")
"""Options of pytest: it writes no files, and does not look through all objects at its end, which takes as long as quick tests."""
SETTINGS = ("pytest.ini", ".pytest.ini", "pyproject.toml", "tox.ini", "setup.cfg")


class _Unexplained:
    """A plugin of pytest: fbvm does not explain why tests fail."""

    def pytest_configure(self, config: pytest.Config) -> None:
        config.stash[UNEXPLAINED] = True


def run_pytest(arguments: Sequence[str], plugins: Sequence[object], explained: bool = False) -> int:
    """Runs pytest: its exit status.  Failures are `explained` if somebody reads them.

    The folder is the root of the tests if no settings of pytest say another one, also where a test below it is named.  Modules
    of the folder are forgotten afterwards, since they may hold programs that were compiled from what it held."""
    installed = any(entry.value == PLUGIN for entry in entry_points(group="pytest11"))
    path, here = list(sys.path), Path.cwd()
    has_settings = any((folder / name).is_file() for folder in (here, *here.parents) for name in SETTINGS)
    options = [*QUIET, *([] if has_settings else ["--rootdir", str(here)]), *([] if installed else ["-p", PLUGIN]),
               *(["-n", "0"] if find_spec("xdist") else [])]  # fmt: skip
    try:
        return int(pytest.main([*options, *arguments], [*plugins, *([] if explained else [_Unexplained()])]))
    finally:
        sys.path[:] = path
        for name, module in list(sys.modules.items()):
            if str(vars(module).get("__file__")).startswith(f"{here}{os.sep}"):
                del sys.modules[name]
