"""What reading a file of another tool gives: source texts, and what could not be taken over."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source, errors


@dataclass(frozen=True)
class Place:
    """Where something of a source stands in the document of which it was made: characters from 0, and words that say it."""

    document: Source
    start: int
    end: int
    where: str


Places = Mapping[str, Sequence[Place | None]]
"""By file name, the place of each line of a source; None for a line that nothing in the document stands for."""


@dataclass(frozen=True)
class Imported:
    """The result of an import."""

    files: dict[str, str]
    """Source texts by file name, in the order of the document; what was not understood is a comment."""
    diagnostics: list[Diagnostic]
    """Errors and warnings about the document, in the order of their places in it."""
    family: str = ""
    """The family of tools that wrote it: "beremiz", "codesys", "twincat", "fbvm"; "" if that is not known, or of no use."""
    because: str = ""
    """From what the family and the order of evaluation were concluded."""
    references: tuple[str, ...] = ()
    """Names of the libraries that it refers to, as far as they are known."""
    uses: tuple[Path, ...] = ()
    """Files of other projects that it refers to."""
    parameters: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Values of constants in libraries that it sets, by the names of list and constant in small letters."""
    find_places: Callable[[], Places] | None = None
    """Finds where the sources stand in the document; None if nobody can tell."""
    is_text: bool = True
    """Whether an editor can show the document; places of a compressed one are those of the text within."""

    @property
    def errors(self) -> list[Diagnostic]:
        """Diagnostics about parts of the program that were not taken over."""
        return errors(self.diagnostics)

    @cached_property
    def places(self) -> Places:
        """Where the lines of the sources stand in the document."""
        return self.find_places() if self.find_places is not None else {}

    @cached_property
    def sources(self) -> list[Source]:
        """The texts as sources, in their order."""
        return [Source(name, text) for name, text in self.files.items()]
