"""How a verb ends when it is asked to: SIGTERM and its like do what Ctrl-C does, with a sentence and a status of their own.

So verbs, and what they use, know of Ctrl-C only, which Python makes a KeyboardInterrupt: the other signals are passed on."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import NoReturn, Protocol

from fbvm.base.host import ending_signals, handle_from_now_on, handling, ignore, interrupt

AGAIN_S = 0.01
"""After this time Ctrl-C comes again that Python could not let through."""
SENTENCES = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "its terminal has gone", "SIGBREAK": "interrupted"}
_asked = signal.SIGINT
"""The signal that asked for the end."""
_is_process = False
"""True if the command line is all that the process does."""


class _Unraisable(Protocol):
    exc_type: type[BaseException]
    exc_value: BaseException | None
    exc_traceback: TracebackType | None


def exit_status() -> int:
    """The exit status of a verb that was asked to end, as shells count them: 130 for Ctrl-C, 143 for SIGTERM."""
    return 128 + _asked


def sentence() -> str:
    """What a verb says that was asked to end."""
    return SENTENCES[_asked.name]


def by_other_than_ctrl_c() -> bool:
    """True if another signal than Ctrl-C has asked for the end: who takes Ctrl-C for something else has to end all the same."""
    return _asked != signal.SIGINT


def _pass_on(number: int, frame: FrameType | None) -> None:
    """Does what Ctrl-C would do now, such as to end a run after the present scan."""
    global _asked
    _asked = signal.Signals(number)
    if not callable(signal.getsignal(signal.SIGINT)):  # it is ignored, as in a job in the background
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)


def _left_alone() -> list[signal.Signals]:
    """The signals that ask for the end and that nobody handles or ignores yet."""
    return [number for number in ending_signals() if signal.getsignal(number) is signal.SIG_DFL]


@contextmanager
def heard() -> Iterator[None]:
    """Passes the signals on that ask for the end, inside the `with` block.  One that is ignored, as by nohup, stays so."""
    global _asked
    numbers = _left_alone()
    try:
        with handling(numbers, _pass_on):
            yield
    finally:
        if numbers:  # the outermost block
            _asked = signal.SIGINT


@contextmanager
def loading() -> Iterator[None]:
    """For a `with` block that imports modules, before anything is written: asked to end, the process ends at once in it.

    An import that is broken off may say anything.  Does nothing where fbvm is not all that the process does."""
    numbers = [number for number in (signal.SIGINT, *ending_signals()) if callable(signal.getsignal(number))]
    with handling(numbers if _is_process else [], _end_at_once):
        yield


def _end_at_once(number: int, frame: FrameType | None) -> None:
    global _asked
    if not by_other_than_ctrl_c():  # else this Ctrl-C is another signal that was passed on
        _asked = signal.Signals(number)
    with suppress(OSError):
        sys.stderr.write(f"{sentence()}\n")
        sys.stderr.flush()
    os._exit(exit_status())


def run_process(verb: Callable[[], object]) -> NoReturn:
    """Runs the command line as all that this process does: asked to end, it does so without a traceback from here on.

    `verb` raises SystemExit or KeyboardInterrupt, or returns."""
    global _is_process
    _is_process, unraised = True, sys.unraisablehook

    def unraisable(args: _Unraisable) -> None:
        if not isinstance(args.exc_value, KeyboardInterrupt):
            unraised(args)  # type: ignore[arg-type]
        else:  # it came while something was finalised, where Python drops exceptions
            threading.Timer(AGAIN_S, interrupt, [threading.get_ident()]).start()

    sys.unraisablehook = unraisable
    try:
        handle_from_now_on(_left_alone(), _pass_on)  # a signal may come at once, so inside of the `try`
        verb()
    except KeyboardInterrupt:
        _exit_now(f"{sentence()}\n")
    except SystemExit as end:
        if end.code == exit_status():
            _exit_now()
        raise
    finally:
        ignore((signal.SIGINT, *ending_signals()))
    sys.exit()


def _exit_now(said: str = "") -> NoReturn:
    """Ends the process with the status of the signal, after these words.

    An ordinary end would be one by SIGINT if the KeyboardInterrupt has passed through an `exec`, whoever has caught it."""
    ignore((signal.SIGINT, *ending_signals()))
    with suppress(OSError):
        sys.stderr.write(said)
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(exit_status())
