"""Files with results that are used again by later processes of the same user.

The name of a file is the hash of all inputs of its contents; a file ends with a hash of its contents, so damaged files are
ignored.  Nothing is unpickled.  A file that cannot be read or written only costs time.  Files are executed as machine code, so
only those are read that nobody but this user could have written."""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from fbvm.base.data import cache_folder
from fbvm.base.host import replace, why_untrusted

_DIGEST_BYTES = 32
_on = True
_warn: Callable[[str], None] | None = None
_warned: set[Path] = set()


def switch(on: bool) -> None:
    """Switches all caches on or off."""
    global _on
    _on = on


def warn_by(warn: Callable[[str], None]) -> None:
    """Has `warn` called with a sentence when a folder or a file is passed over because others could have written it.

    The sentence comes once a process for each of them.  Without this, nothing is said."""
    global _warn
    _warn = warn


def make_folder() -> Path:
    """The folder of all caches, which is made for this user alone if it is missing.  Raises OSError."""
    folder = cache_folder()
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def name_of(parts: Iterable[str]) -> str:
    """The name of the file whose contents depend on these texts: their SHA-256 hash in hexadecimal."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(f"{len(part)}:{part}".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


SUFFIXES = (".py", ".st", ".toml", ".lark", ".txt")
"""Endings of files of this package on which compilations depend."""


@cache
def state_of(*folders: Path) -> str:
    """A hash of the Python version and of path, size and modification time of all files of this package in some folders.

    The contents are not read, as for Python's bytecode: to read hundreds of files takes longer than most compilations."""
    return name_of((sys.version, *(part for folder in folders for part in _state(str(folder)))))


def _state(folder: str) -> Iterator[str]:
    with os.scandir(folder) as entries:
        found = sorted(entries, key=lambda entry: entry.name)
    for entry in found:
        if entry.name.endswith(SUFFIXES):
            at = entry.stat()
            yield f"{entry.path} {at.st_size} {at.st_mtime_ns}"
        elif entry.is_dir() and entry.name != "__pycache__":
            yield from _state(entry.path)


@dataclass
class Cache:
    """The files of one kind, in a folder of this name; each begins with the bytes `head`.

    Above `limit_bytes` in all, or `limit_files`, the files that were used least recently are removed until a quarter is
    free.  A process lists the folder at its first write, and again when what it has written since may have exceeded a limit:
    to list two thousand files takes longer than to write one.  What other processes write meanwhile is counted at the next
    listing."""

    kind: str
    head: bytes
    limit_bytes: int
    limit_files: int = 2000
    _held: dict[Path, tuple[int, int]] = field(default_factory=dict, repr=False)
    """By folder, the number of files and of their bytes at the last listing, with those that this process has added."""

    @property
    def folder(self) -> Path:
        """The folder of the files."""
        return cache_folder() / self.kind

    def read(self, name: str) -> bytes | None:
        """The contents that were written under a name; None without a file, or for a damaged or foreign one."""
        folder = self.folder
        if not _on or not _is_private(folder):
            return None
        try:
            with open(folder / name, "rb") as file:
                if not _trusts(folder / name, os.fstat(file.fileno())):
                    return None
                content = file.read()
            body, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
            if not body.startswith(self.head) or hashlib.sha256(body).digest() != digest:
                return None
            os.utime(folder / name)
        except OSError:
            return None
        return body[len(self.head):]

    def write(self, name: str, content: bytes) -> None:
        """Writes contents under a name, through a temporary file, so that no process reads an incomplete one."""
        if not _on:
            return
        folder, body = self.folder, self.head + content
        try:
            make_folder()
            folder.mkdir(mode=0o700, exist_ok=True)
            if not _is_private(folder):
                return
            handle, name_of_part = tempfile.mkstemp(dir=folder, suffix=".part")
            part = Path(name_of_part)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(body + hashlib.sha256(body).digest())
                replace(part, folder / name)
            finally:
                part.unlink(missing_ok=True)
            self._make_room(folder, len(body) + _DIGEST_BYTES)
        except OSError:
            return

    def _make_room(self, folder: Path, written_bytes: int) -> None:
        """Removes files if there are too many, or if they are too large, with one of so many bytes that was just written."""
        if known := self._held.get(folder):
            count, total = self._held[folder] = known[0] + 1, known[1] + written_bytes
            if total <= self.limit_bytes and count <= self.limit_files:
                return
        files = list(_files(folder))
        count, total = len(files), sum(size for _, size, _ in files)
        if total > self.limit_bytes or count > self.limit_files:
            for _, size, path in sorted(files):
                if total <= self.limit_bytes * 3 // 4 and count <= self.limit_files * 3 // 4:
                    break
                Path(path).unlink(missing_ok=True)
                total -= size
                count -= 1
        self._held[folder] = count, total


def _is_private(folder: Path) -> bool:
    """True if only this user can write into a folder of one kind of files, and into the folder of all caches above it.

    Either may be a link, if the link is this user's, too."""
    try:
        return all(_trusts(each, each.stat()) and (not each.is_symlink() or _trusts(each, each.lstat(), is_link=True))
                   for each in (folder.parent, folder))  # fmt: skip
    except OSError:  # it is missing
        return False


def _trusts(path: Path, found: os.stat_result, is_link: bool = False) -> bool:
    """True if nobody but this user could have written what was found at a path; else warns."""
    why = why_untrusted(found, is_link)
    if why and _warn and path not in _warned:
        _warned.add(path)
        _warn(f"{path} in the cache is not used: it {why}")
    return not why


def _files(folder: Path) -> Iterator[tuple[float, int, str]]:
    """The time of the last use, the size and the path of each file."""
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                found = entry.stat()
            except OSError:  # another process has removed it
                continue
            yield found.st_mtime, found.st_size, entry.path
