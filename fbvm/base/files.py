"""Files: of others' making only regular ones are read, and only up to a size, so that no device or pipe holds a reader up; of our
own making all are whole, since they are written beside and then put in place."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from fbvm.base.host import WAITLESS, has_ended, process_space, replace

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

MOST_FOLDERS = 20_000
"""How many folders are looked through below one that is given: about a second."""


class Unreadable(OSError):
    """The path is no regular file, or the file is too large; `strerror` says which."""


def reason(error: OSError) -> str:
    """Why a file could not be read or written, in words that continue a sentence."""
    if isinstance(error, Unreadable):
        return str(error.strerror)
    return (error.strerror or str(error)).lower()


def resolved(path: Path) -> Path:
    """The absolute path without links; of links that lead to one another the path as it is written, which nobody can open.

    `Path.resolve` raises RuntimeError for these up to Python 3.12."""
    return Path(os.path.realpath(path))


def open_file(path: Path | str) -> BinaryIO:
    """Opens a regular file for reading, or a link to one.  Raises OSError, which is Unreadable for a pipe, a device or a socket;
    never waits for another process."""
    number = os.open(path, WAITLESS)
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


def folders_below(root: Path) -> list[tuple[Path, list[str]]]:
    """A folder and all folders below it with the names of their files, sorted.  Links to folders are not followed.

    Raises Unreadable if there are more than MOST_FOLDERS: a whole disk was given in place of a folder."""
    folders: list[tuple[Path, list[str]]] = []
    for at, _, names in os.walk(root):
        if len(folders) > MOST_FOLDERS:
            raise Unreadable(errno.EFBIG, f"it has more than {MOST_FOLDERS} folders; give the one in which the files are")
        folders.append((Path(at), sorted(names)))
    return sorted(folders)


def read_file(path: Path | str, most_bytes: int) -> bytes:
    """The contents of a regular file.  Raises OSError, which is Unreadable also for a file of more than `most_bytes` bytes."""
    with open_file(path) as file:
        return read_all(file, most_bytes)


def read_all(file: BinaryIO, most_bytes: int) -> bytes:
    """All that a file or pipe holds.  Raises OSError, which is Unreadable for more than `most_bytes` bytes."""
    data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise Unreadable(errno.EFBIG, f"it has more than {most_bytes // MIB} MiB")
    return data


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """A file for a `with` block that writes all of `path`.  When the block ends it takes the place of what is there; an exception
    such as Ctrl-C removes it.

    A link keeps leading where it leads, and a file that is there keeps its rights.  Devices and pipes are written directly.
    Raises OSError."""
    target = _behind_links(path)
    if _is_no_file(target):
        with open(target, "wb") as device:
            yield device
        return
    part = _beside(target)
    try:
        with open(part, "wb") as file:
            yield file
        if target.exists():
            _refuse_unwritable(target, path)
            shutil.copymode(target, part)
        replace(part, target)
    finally:
        part.unlink(missing_ok=True)


def check_writable(path: Path) -> None:
    """Raises OSError if `new_file` could not write this file now; leaves what is there, and nothing beside it."""
    target = _behind_links(path)
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if os.path.lexists(target):
        _refuse_unwritable(target, path)
    if not _is_no_file(target):
        part = _beside(target)
        part.write_bytes(b"")
        part.unlink()


def _behind_links(path: Path) -> Path:
    """Where a path leads.  Raises OSError for links that lead to one another, for which `Path.resolve` may raise RuntimeError."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    return target


def _is_no_file(target: Path) -> bool:
    """True for a device, a pipe or a folder, which nothing takes the place of."""
    return os.path.lexists(target) and not target.is_file()


def _refuse_unwritable(target: Path, path: Path) -> None:
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def _beside(target: Path) -> Path:
    """The file that is written before it takes the place of another one.  Those in its folder that killed processes have left are
    removed, once for each folder."""
    space = process_space()
    if space and target.parent not in _tidied:
        _tidied.add(target.parent)
        _tidy(target.parent, space)
    return target.with_name(f".fbvm.{f'{space}.' if space else ''}{os.getpid()}.part")


_tidied: set[Path] = set()
"""Folders in which this process has removed what others have left."""


def _tidy(folder: Path, space: str) -> None:
    """Removes the parts of processes of this space that have ended; what cannot be removed stays."""
    own = re.compile(rf"\.fbvm\.{space}\.([1-9][0-9]{{0,9}})\.part")
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if (match := own.fullmatch(entry.name)) and has_ended(int(match[1])):
                with suppress(OSError):
                    os.unlink(entry.path)


def is_part(path: Path) -> bool:
    """True for the name of a file that `new_file` writes first; a process that is killed leaves it behind."""
    return path.name.startswith(".fbvm.") and path.suffix == ".part"


def holds(path: Path, content: bytes) -> bool:
    """True if a path is a regular file, not a link, with exactly these contents."""
    try:
        return not path.is_symlink() and read_file(path, len(content)) == content
    except OSError:
        return False


def write_file(path: Path, content: bytes | str) -> None:
    """Writes all of a file, as `new_file` does; a text in UTF-8.  Raises OSError, and leaves what was there."""
    with new_file(path) as file:
        file.write(content.encode("utf-8") if isinstance(content, str) else content)
