"""A spinner on the terminal for work that takes long."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, ConsoleOptions, RenderResult
from rich.live import Live
from rich.spinner import Spinner

QUICK_S = 2.0
"""The time after which the spinner appears, in seconds."""
PER_SECOND = 8


class _DelayedSpinner:
    """Renders as a spinner and a text, and as nothing in the first two seconds."""

    def __init__(self, console: Console, text: str) -> None:
        self._console = console
        self._text = text
        self._spinner = Spinner("line", text)
        self._began_s = console.get_time()

    def update(self, what: str, done: int, known: int) -> None:
        """Shows the part of the work that is done: `done` of `known` steps of `what`."""
        self._spinner.update(text=f"{self._text}: {what} {100 * done // max(known, 1)} %")

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self._console.get_time() - self._began_s >= QUICK_S:
            yield self._spinner


@contextmanager
def show_progress(text: str, console: Console | None = None) -> Iterator[Callable[[str, int, int], None]]:
    """Shows `text` with a spinner on stderr inside the `with` block, from its second second on; nothing in a pipe.

    The value of the block is a function that shows progress: name of the step, steps that are done, steps in all."""
    console = console or Console(stderr=True)
    spinner = _DelayedSpinner(console, text)
    if not console.is_terminal:
        yield spinner.update
        return
    with Live(spinner, console=console, transient=True, refresh_per_second=PER_SECOND):
        yield spinner.update
