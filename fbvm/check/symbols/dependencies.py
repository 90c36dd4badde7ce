"""The recorded dependencies of a body: what its check looked up, so that the look-ups can be repeated without the check.

The check of a body resolves POUs, types and global variables on the way, and the order in which it does that decides where
they lie in memory.  A library never sees what users declare, so this order is the same in every program: the body of a
library's POU is checked once, and another program repeats the recorded look-ups."""

from __future__ import annotations

from collections.abc import Mapping

from fbvm.base.types import fold
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree

Key = tuple[str, str]
"""Library ("" for the user's own) and folded name of a POU or a global variable."""


class Dependencies:
    """What the check of one body looked up, each look-up once and in order, and which POUs the body calls."""

    def __init__(self) -> None:
        self.lookups: dict[tuple[str, str, str], None] = {}
        """What was looked up ("POU", "type", "global", "area", "declared" or "interface"), its folded name, its library."""
        self.calls: list[tuple[Key, tree.Node]] = []
        self.repeatable = True
        """False if the check has changed more than the look-ups say."""

    def record(self, what: str, name: str, library: str = "") -> None:
        """Record one look-up."""
        self.lookups[what, name, library] = None

    def record_calls(self, pou: Pou, pous: Mapping[Key, Pou]) -> None:
        """Record the calls of a body that was checked; `pous` are those of the project."""
        for callee, node in pou.calls.items():
            key = key_of(callee)
            self.repeatable = self.repeatable and pous.get(key) is callee
            self.calls.append((key, node))


def key_of(pou: Pou) -> Key:
    """The name of a POU for all programs."""
    return pou.source.library, fold(pou.name)


def has_lasting_body(pou: Pou) -> bool:
    """True for a POU of a library whose body is the same in every program.

    False for one with ACTIONs, methods or a base, and for a tree that was made for one call or one program."""
    return bool(pou.source.library) and pou.kind in ("FUNCTION", "FUNCTION_BLOCK") and \
        pou.as_written and not pou.written_actions and not pou.tree.methods and not pou.tree.bases
