"""Files that verbs write; an error of the host is reported in words."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import click

from fbvm.base.files import check_writable, holds, reason
from fbvm.cli.shared.terminal import named


class OutputError(Exception):
    """A file that grows during a run could not be written any further; the message names the file and the reason."""


class _GrowingFile(io.RawIOBase):
    """A file to which a run appends.  The first error of the host raises OutputError; what is written afterwards is dropped, so
    that the file is good up to where it was cut."""

    def __init__(self, path: Path | str, mode: str = "wb") -> None:
        super().__init__()
        self._path, self._failed = path, False
        self._file = open(path, mode, buffering=0)  # noqa: SIM115 - close closes it

    def writable(self) -> bool:
        return True

    def write(self, data: bytes, /) -> int:  # type: ignore[override]
        """Writes all bytes."""
        left = memoryview(data).cast("B")
        size = len(left)
        while left and not self._failed:
            try:
                left = left[self._file.write(left) or 0 :]
            except OSError as error:
                self._failed = True
                raise OutputError(f"{named(self._path)} cannot be written any further: {reason(error)}") from None
        return size

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
        super().close()


def growing_file(path: Path | str, mode: str = "wb") -> BinaryIO:
    """Opens a file to which a run appends.  An error of the host while it is written raises OutputError; nothing is written
    behind the gap, so that the file is good up to there.  Raises OSError if the file cannot be opened."""
    raw: io.RawIOBase = _GrowingFile(path, mode)
    return io.BufferedWriter(raw)


@contextmanager
def writing(target: Path | str) -> Iterator[None]:
    """For a `with` block that opens and writes `target`: an OSError in it ends the verb with status 2 and a message."""
    try:
        yield
    except OSError as error:
        raise click.UsageError(f"{named(target)} cannot be written: {reason(error)}") from None


def in_the_way(files: Mapping[Path, str]) -> list[Path]:
    """Those of the files that a verb makes that are there already.

    None if a call that was broken off has left them, which the next call completes: each that is there has what the verb would
    write, and one is missing."""
    there = [path for path in files if os.path.lexists(path)]
    is_unfinished = len(there) < len(files) and all(holds(path, files[path].encode("utf-8")) for path in there)
    return [] if is_unfinished else there


def check_outputs(*paths: Path | None) -> None:
    """Ends the verb as `writing` does if a file cannot be written.  To be called before long work whose outcome goes there."""
    for path in paths:
        if path:
            with writing(path):
                check_writable(path)


def check_free_files(count: int) -> None:
    """Raises OSError if this process cannot open so many files and sockets more: for libraries that would print a traceback."""
    pipes: list[int] = []
    try:
        while len(pipes) < count:
            pipes += os.pipe()
    finally:
        for number in pipes:
            os.close(number)
