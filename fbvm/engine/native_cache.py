"""Objects on disk: what was compiled once is loaded the next time, by any process of this user on this machine.

A file is named by the hash of all that its contents depend on, and ends with a hash of these: damaged or foreign files
are passed over.  Nothing is unpickled.  What cannot be read or written does no harm, it only takes longer."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from fbvm.base.data import cache_folder
from fbvm.engine.native_compiler import host

FORMAT = b"fbvm object 1\n"
"""What a file begins with."""
LIMIT_BYTES, LIMIT_FILES = 256 << 20, 2000
"""Size and number of all files above which the oldest go, until a quarter of the room is free.  Each time that one is
written all are looked at, which takes as long as there are many."""
_DIGEST_BYTES = 32
_on = True


@dataclass(frozen=True)
class Stored:
    """An object, and what JSON can say about it."""

    facts: dict[str, Any]
    compiled: bytes


def switch(on: bool) -> None:
    """Use the cache from now on, or do not."""
    global _on
    _on = on


def name_of(*parts: str) -> str:
    """The name for what depends on these texts, on this package's native modules, on LLVM and on the processor."""
    digest = hashlib.sha256()
    for part in (*parts, *host(), _modules()):
        digest.update(f"{len(part)}:{part}".encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


@cache
def _modules() -> str:
    """A hash of the modules that make code."""
    digest = hashlib.sha256(sys.version.encode())
    folder = Path(__file__).parent
    for path in (*sorted(folder.glob("native*.py")), folder / "ranges.py", folder / "bases.py"):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def read(name: str) -> Stored | None:
    """What was stored under a name; None if there is nothing, or nothing that can be trusted."""
    if not _on or not _private(folder := _folder()):
        return None
    path = folder / name
    try:
        content = path.read_bytes()
        stored = _unpacked(content)
        if stored:
            os.utime(path)
    except (OSError, ValueError):
        return None
    return stored


def write(name: str, stored: Stored) -> None:
    """Store an object under a name, by way of a file of its own so that nobody reads half of it."""
    folder = _folder()
    if not _on:
        return
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _private(folder):
            return
        handle, part = tempfile.mkstemp(dir=folder, suffix=".part")
        with os.fdopen(handle, "wb") as file:
            file.write(_packed(stored))
        os.replace(part, folder / name)
        _make_room(folder)
    except OSError:
        return


def _folder() -> Path:
    return cache_folder() / "native"


def _private(folder: Path) -> bool:
    """True if nobody but this user can put files there: an object is executed."""
    try:
        found = folder.stat()
    except OSError:
        return False
    if sys.platform == "win32":
        return True
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _packed(stored: Stored) -> bytes:
    facts = json.dumps(stored.facts, separators=(",", ":")).encode()
    content = FORMAT + len(facts).to_bytes(4, "little") + facts + stored.compiled
    return content + hashlib.sha256(content).digest()


def _unpacked(content: bytes) -> Stored | None:
    start = len(FORMAT)
    body, digest = content[:-_DIGEST_BYTES], content[-_DIGEST_BYTES:]
    if not body.startswith(FORMAT) or hashlib.sha256(body).digest() != digest:
        return None
    size = int.from_bytes(body[start:start + 4], "little")
    return Stored(json.loads(body[start + 4:start + 4 + size]), body[start + 4 + size:])


def _make_room(folder: Path) -> None:
    files = list(_files(folder))
    count, total = len(files), sum(size for _, size, _ in files)
    if total <= LIMIT_BYTES and count <= LIMIT_FILES:
        return
    for _, size, path in sorted(files):
        if total <= LIMIT_BYTES * 3 // 4 and count <= LIMIT_FILES * 3 // 4:
            return
        Path(path).unlink(missing_ok=True)
        total -= size
        count -= 1


def _files(folder: Path) -> Iterator[tuple[float, int, str]]:
    """When each file was used last, its size, and where it is."""
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                found = entry.stat()
            except OSError:  # somebody else made room
                continue
            yield found.st_mtime, found.st_size, entry.path
