"""Objects on disk: what was compiled once is loaded the next time, by any process of this user on this machine."""

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
    """An object, and what JSON can say about it."""

    facts: dict[str, Any]
    compiled: bytes


def name_of(*parts: str) -> str:
    """The name for what depends on these texts, on this package's engines, on LLVM and on the processor."""
    return cache.name_of((*parts, *host(), cache.state_of(PACKAGE / "engine")))


def read(name: str) -> Stored | None:
    """What was stored under a name; None if there is nothing, or nothing that can be trusted."""
    content = FILES.read(name)
    if content is None:
        return None
    size = int.from_bytes(content[:4], "little")
    try:
        return Stored(json.loads(content[4:4 + size]), content[4 + size:])
    except ValueError:
        return None


def write(name: str, stored: Stored) -> None:
    """Store an object under a name."""
    facts = json.dumps(stored.facts, separators=(",", ":")).encode()
    FILES.write(name, len(facts).to_bytes(4, "little") + facts + stored.compiled)
