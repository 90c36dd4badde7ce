"""Files that save time: what was worked out once is there the next time, for any process of this user on this machine.

A file is named by the hash of all that its contents depend on, and ends with a hash of these: damaged or foreign files
are passed over.  Nothing is unpickled.  What cannot be read or written does no harm, it only takes longer."""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fbvm.base.data import cache_folder

_DIGEST_BYTES = 32
_on = True


def switch(on: bool) -> None:
    """Use the files from now on, or do not."""
    global _on
    _on = on


def name_of(parts: Iterable[str]) -> str:
    """The name for what depends on these texts."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(f"{len(part)}:{part}".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


SUFFIXES = (".py", ".st", ".toml", ".lark", ".txt")
"""What decides in this package how others are compiled."""


@cache
def state_of(*folders: Path) -> str:
    """A hash of the host and of the files of this package in some folders: where each is, how large, and when it was written.

    That stands for what they hold, as it does for the host's bytecode: to read hundreds of them takes longer than most
    compilations."""
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
    """The files of one kind.  `head` is what each begins with; above `limit_bytes` in all, or `limit_files`, the oldest go
    until a quarter of the room is free.

    Each time that one is written all are looked at, which takes as long as there are many."""

    kind: str
    head: bytes
    limit_bytes: int
    limit_files: int = 2000

    @property
    def folder(self) -> Path:
        """Where they are."""
        return cache_folder() / self.kind

    def read(self, name: str) -> bytes | None:
        """What was stored under a name; None if there is nothing, or nothing that can be trusted."""
        folder = self.folder
        if not _on or not _private(folder):
            return None
        try:
            content = (folder / name).read_bytes()
            body, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
            if not body.startswith(self.head) or hashlib.sha256(body).digest() != digest:
                return None
            os.utime(folder / name)
        except OSError:
            return None
        return body[len(self.head):]

    def write(self, name: str, content: bytes) -> None:
        """Store under a name, by way of a file of its own so that nobody reads half of it."""
        if not _on:
            return
        folder, body = self.folder, self.head + content
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not _private(folder):
                return
            handle, part = tempfile.mkstemp(dir=folder, suffix=".part")
            with os.fdopen(handle, "wb") as file:
                file.write(body + hashlib.sha256(body).digest())
            os.replace(part, folder / name)
            self._make_room(folder)
        except OSError:
            return

    def _make_room(self, folder: Path) -> None:
        files = list(_files(folder))
        count, total = len(files), sum(size for _, size, _ in files)
        if total <= self.limit_bytes and count <= self.limit_files:
            return
        for _, size, path in sorted(files):
            if total <= self.limit_bytes * 3 // 4 and count <= self.limit_files * 3 // 4:
                return
            Path(path).unlink(missing_ok=True)
            total -= size
            count -= 1


def _private(folder: Path) -> bool:
    """True if nobody but this user can put files there: what is in them is believed."""
    try:
        found = folder.stat()
    except OSError:
        return False
    if sys.platform == "win32":
        return True
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _files(folder: Path) -> Iterator[tuple[float, int, str]]:
    """When each file was used last, its size, and where it is."""
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                found = entry.stat()
            except OSError:  # somebody else made room
                continue
            yield found.st_mtime, found.st_size, entry.path
