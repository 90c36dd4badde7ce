"""The prompt of a terminal: history, editing, completion.  `step.commands` executes the lines."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.history import FileHistory, History, InMemoryHistory

from fbvm.base.cache import make_folder
from fbvm.cli.shared.ending import by_other_than_ctrl_c
from fbvm.step.commands import Commands

HISTORY = "step_history"


class Completions(Completer):
    """The completions of `Commands` for prompt_toolkit."""

    def __init__(self, commands: Commands) -> None:
        self._commands = commands

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        """The completions of the word before the cursor."""
        word = document.get_word_before_cursor(WORD=True)
        for found in self._commands.completions(document.text_before_cursor):
            yield Completion(found, start_position=-len(word))


def prompt_lines(commands: Commands) -> Iterator[str]:
    """The lines that a user types, until the end of input.  Ctrl-C discards the line; another signal ends it."""
    asking: PromptSession[str] = PromptSession(history=_history(), completer=Completions(commands), complete_while_typing=False)
    while True:
        here = commands.session.here
        try:
            yield asking.prompt(f"{here.scan}:{here.step}> ")
        except KeyboardInterrupt:
            if by_other_than_ctrl_c():
                raise
            continue
        except EOFError:
            return


def _history() -> History:
    """The lines of earlier sessions, in a file of the cache folder if it can be written."""
    try:
        path = make_folder() / HISTORY
        path.touch(mode=0o600)
    except OSError:
        return InMemoryHistory()
    return FileHistory(str(path))
