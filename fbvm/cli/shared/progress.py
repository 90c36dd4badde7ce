"""A word on the terminal while something takes long that tells nothing by itself; nothing where it is quick."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, ConsoleOptions, RenderResult
from rich.live import Live
from rich.spinner import Spinner

QUICK_S = 2.0
"""What ends sooner needs no word."""
PER_SECOND = 8


class _DelayedSpinner:
    """Renders as nothing first, later as a spinner and a text."""

    def __init__(self, console: Console, text: str) -> None:
        self._console = console
        self._text = text
        self._spinner = Spinner("line", text)
        self._began_s = console.get_time()

    def update(self, what: str, done: int, known: int) -> None:
        """Say how far the work is."""
        self._spinner.update(text=f"{self._text}: {what} {100 * done // max(known, 1)} %")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self._console.get_time() - self._began_s >= QUICK_S:
            yield self._spinner


@contextmanager
def show_progress(text: str, console: Console | None = None) -> Iterator[Callable[[str, int, int], None]]:
    """Shows `text` on stderr from two seconds on until the block is over, and how far it is.  Nothing in a pipe."""
    console = console or Console(stderr=True)
    spinner = _DelayedSpinner(console, text)
    if not console.is_terminal:
        yield spinner.update
        return
    with Live(spinner, console=console, transient=True, refresh_per_second=PER_SECOND):
        yield spinner.update
