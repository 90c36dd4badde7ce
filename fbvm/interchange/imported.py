"""What reading a file of another tool gives: source texts, and what could not be taken over."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from fbvm.base.diagnostics import Diagnostic, Source, errors


@dataclass(frozen=True)
class Imported:
    """The result of an import."""

    files: dict[str, str]
    """Source texts by file name, in the order of the document; what was not understood is a comment."""
    diagnostics: list[Diagnostic]
    """Errors and warnings about the document, in the order of their places in it."""
    family: str = ""
    """The family of tools that wrote it: "beremiz", "codesys", "twincat"; "" if that is not known, or of no use."""
    because: str = ""
    """From what the family and the order of evaluation were concluded."""
    references: tuple[str, ...] = ()
    """Names of the libraries that it refers to, as far as they are known."""

    @property
    def errors(self) -> list[Diagnostic]:
        """Diagnostics about parts of the program that were not taken over."""
        return errors(self.diagnostics)

    @cached_property
    def sources(self) -> list[Source]:
        """The texts as sources, in their order."""
        return [Source(name, text) for name, text in self.files.items()]
