"""The program of a recorded PLC as its file holds it: texts and how they are compiled, so that it can be executed elsewhere.

A file may come from anywhere, and code that is executed has to come from the compiler: therefore it holds texts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fbvm.base.diagnostics import Source
from fbvm.base.files import reason
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.code.store import cache as image_cache
from fbvm.record.recording.library_texts import LibraryTexts, unpacked


@dataclass(frozen=True)
class ProgramText:
    """The sources of a program, and the choices that `compile_sources` had."""

    sources: tuple[tuple[str, str], ...] = ()
    """Name and text of each; none for a program that Python has put together."""
    libraries: tuple[str, ...] = ()
    """Folders of libraries beside the shipped ones."""
    held: tuple[LibraryTexts, ...] = ()
    """What is in these folders; none if they have too much."""
    program: str | None = None
    resource: str | None = None
    dialect: str = "standard"
    drawn: bool = False
    e_banks: tuple[str, ...] = field(default=())
    """Banks of the E area that are added to those that the program names."""
    heap: int | None = None
    """Bytes of the heap; None for as many as usual."""

    def as_data(self) -> dict[str, Any]:
        """As plain data."""
        return dict(vars(self)) | {"held": [library.as_data() for library in self.held]}

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> ProgramText:
        """From plain data.  Raises KeyError, TypeError, ValueError for other data."""
        program, resource = data["program"], data["resource"]
        return cls(tuple((str(name), str(text)) for name, text in data["sources"]), tuple(map(str, data["libraries"])),
                   tuple(map(LibraryTexts.of, data.get("held", ()))), None if program is None else str(program),
                   None if resource is None else str(resource), str(data["dialect"]), bool(data["drawn"]),
                   tuple(map(str, data["e_banks"])), None if data.get("heap") is None else int(data["heap"]))  # fmt: skip

    @property
    def texts(self) -> dict[str, str]:
        """The sources of the program and of its own libraries, by the names that sites have."""
        held = {path if "/" in path else f"{library.name}/{path}": text for library in self.held for path, text in library.files}
        return held | dict(self.sources)

    def compiled(self, libraries: Sequence[Path] = ()) -> Image | str:
        """The program, or why there is none.  `libraries` take the place of its own folders."""
        if not self.sources:
            return "it holds no sources of the program; from Python, hand over its image"
        sources = [Source(name, text) for name, text in self.sources]
        options = "recording", self.program, self.resource, self.dialect, self.drawn
        if self.held and not libraries:
            texts = [Source(name, text, library.name) for library in self.held for name, text in library.files]
            entry = image_cache.name([*sources, *texts], (), options)
            return self._known(entry, sources) or self._compiled_with_held(entry, sources)
        folders = list(libraries) or [Path(folder) for folder in self.libraries]
        for folder in folders:
            if not folder.is_dir():
                return f"the program needs the library folder {folder}; say where it is now with --library"
        entry = image_cache.name(sources, folders, options)
        return self._known(entry, sources) or self._made(entry, sources, folders)

    def _known(self, entry: str, sources: Sequence[Source]) -> Image | None:
        known = image_cache.read(entry, sources)
        return self._fitted(known[0]) if known else None

    def _fitted(self, image: Image) -> Image:
        """The image for the memory that the PLC had."""
        return image.with_e_banks(self.e_banks).with_heap(self.heap)

    def _compiled_with_held(self, entry: str, sources: Sequence[Source]) -> Image | str:
        try:
            with unpacked(self.held) as folders:
                return self._made(entry, sources, folders)
        except OSError as error:
            return f"the libraries that it holds cannot be written to a temporary folder: {reason(error)}"

    def _made(self, entry: str, sources: Sequence[Source], folders: Sequence[Path]) -> Image | str:
        try:
            made = compile_sources(sources, self.program, folders, resource=self.resource, dialect=self.dialect, lint=False,
                                   drawn=self.drawn)
        except ValueError as error:
            return str(error)
        if made.image is None:
            return f"the program does not compile here: {made.errors[0].code} {made.errors[0].message}"
        image_cache.write(entry, sources, made.image, [])
        return self._fitted(made.image)
