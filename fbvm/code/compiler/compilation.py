"""What a compilation gives, and what is said while it goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.code.image import Image

LONG = 50_000
"""Characters of sources from which on a garbage collection takes tenths of a second."""
Progress = Callable[[str, int, int], None]
"""Called with a stage, and how much of how much is done in it: ("read", characters, characters), ("checked", POUs, POUs),
("compiled", POUs, POUs)."""


@dataclass(frozen=True)
class Compilation:
    """The result of compiling sources.

    >>> from fbvm import compile_text
    >>> made = compile_text("PROGRAM Main VAR n : INT; END_VAR n := m; END_PROGRAM")
    >>> made.image, [error.code for error in made.errors]
    (None, ['S0201'])
    """

    image: Image | None
    """The compiled program; None if there are errors."""
    diagnostics: list[Diagnostic]
    """All errors and warnings, sorted by the name of their source, then by their place in it."""

    @property
    def errors(self) -> list[Diagnostic]:
        """The diagnostics whose `severity` is "error", in the order of `diagnostics`; empty if there is an image."""
        return errors(self.diagnostics)
