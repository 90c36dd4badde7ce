"""Objects of machine code on disk: a process loads what an earlier one of the same user has compiled."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from fbvm.base import cache
from fbvm.base.cache import Cache
from fbvm.base.data import PACKAGE
from fbvm.engine.native.llvm.compiler import host

FILES = Cache("native", b"fbvm object 1\n", 256 << 20)


@dataclass(frozen=True)
class Stored:
    """An object file, and facts about it."""

    facts: dict[str, Any]
    """What JSON can say: names of routines, points at which a run can end, sizes."""
    compiled: bytes
    """The object file."""


def name_of(*parts: str) -> str:
    """The file name for an object that depends on these texts, on this package's engines, on LLVM and on the processor."""
    return cache.name_of((*parts, *host(), cache.state_of(PACKAGE / "engine")))


def read(name: str) -> Stored | None:
    """The object that was stored under a name; None if there is none, or if the file is damaged."""
    content = FILES.read(name)
    if content is None:
        return None
    size = int.from_bytes(content[:4], "little")
    try:
        return Stored(json.loads(content[4:4 + size]), content[4 + size:])
    except ValueError:
        return None


def write(name: str, stored: Stored) -> None:
    """Stores an object under a name; a full disk or a missing right is no error."""
    facts = json.dumps(stored.facts, separators=(",", ":")).encode()
    FILES.write(name, len(facts).to_bytes(4, "little") + facts + stored.compiled)
