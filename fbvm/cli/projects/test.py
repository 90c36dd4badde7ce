"""`fbvm test`: pytest with the plugin for PLC programs, in a process of its own."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import click

from fbvm.cli.shared import status
from fbvm.cli.shared.files import check_free_files

STATUS = {0: status.GOOD, 4: status.USAGE, 5: status.USAGE}
"""Exit statuses by pytest's; all others are failures: 1 a failed test, 2 a failed collection (Ctrl-C ends both processes).
pytest's 5 is a run without tests."""
PYTEST_FILES = 12
"""Files that pytest opens for itself; it prints a traceback if it cannot."""


@click.command("test", context_settings={"ignore_unknown_options": True, "help_option_names": ["-h", "--help"]},
               epilog="Try -k WORD (only tests with that word), -x (stop at the first failure), --fbvm-cov (coverage).")
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="[PYTEST ARGUMENT]...")
def command(arguments: tuple[str, ...]) -> None:
    """Run the tests of this folder with pytest: test_*.py, and programs in test_*.st.

    What follows goes to pytest.  Status 1 if a test failed, 2 if there is none."""
    if find_spec("pytest") is None:
        raise click.UsageError("tests need pytest: pip install pytest")
    check_free_files(PYTEST_FILES)
    from fbvm.testing.pytest_process import run_pytest

    sys.exit(STATUS.get(run_pytest(arguments), status.FAILED))
