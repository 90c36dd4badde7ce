"""Reading of files that others made: only regular files and only up to a size, so that no device or pipe holds a reader up."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

MIB = 1 << 20
SOURCE_BYTES = 64 * MIB
"""Most bytes of a source or a document."""
SETTINGS_BYTES = MIB
"""Most bytes of `fbvm.toml` and `library.toml`."""
IMAGE_BYTES = 16 * MIB
"""Most bytes of a memory image; all areas and E banks with all digits have less."""
TABLE_BYTES = 256 * MIB
"""Most bytes of a table in CSV."""
LINE_CHARACTERS = 256 * MIB
"""Longest line of a journal; its first line holds the sources."""


class Unreadable(OSError):
    """The path is no regular file, or the file is too large; `strerror` says which."""


def reason(error: OSError) -> str:
    """Why a file could not be read or written, in words that continue a sentence."""
    if isinstance(error, Unreadable):
        return str(error.strerror)
    return (error.strerror or str(error)).lower()


def open_file(path: Path | str) -> BinaryIO:
    """Opens a regular file for reading, or a link to one.  Raises OSError, which is Unreadable for a pipe, a device or a socket;
    never waits for another process."""
    number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        mode = os.fstat(number).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if not stat.S_ISREG(mode):
            raise Unreadable(errno.EINVAL, "it is no file")
        return open(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_file(path: Path | str, most_bytes: int) -> bytes:
    """The contents of a regular file.  Raises OSError, which is Unreadable also for a file of more than `most_bytes` bytes."""
    with open_file(path) as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise Unreadable(errno.EFBIG, f"it has more than {most_bytes // MIB} MiB")
    return data
