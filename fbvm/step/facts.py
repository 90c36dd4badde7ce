"""What a stepping session knows of a program, whether it runs or only its recording is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fbvm.base.areas import FRAME_LINK, Area
from fbvm.base.types import Field, fold
from fbvm.code.image import Image, RungPicture, SfcPicture, Site
from fbvm.machine.plc import Plc
from fbvm.record.trace.writer import descriptions, meanings
from fbvm.watch.names import Names


@dataclass(frozen=True)
class ProgramFacts:
    """Sites, bodies (name and kind each), rungs, charts, variables and areas of a program, and what its units call their words.

    `described` has a text for each address of a unit, `meanings` what values of such words mean."""

    image: Image
    areas: Mapping[str, Area]
    names: Names
    cycle_ns: int
    described: Mapping[str, str]
    meanings: Mapping[str, Mapping[int, str]]

    @classmethod
    def of(cls, plc: Plc) -> ProgramFacts:
        """The facts of the program of a PLC and of its units."""
        names = Names.of(plc.image, plc.memory.areas)
        return cls(plc.image, plc.memory.areas, names, plc.cycle_ns, descriptions(plc), meanings(plc))

    @property
    def sites(self) -> Sequence[Site]:
        return self.image.sites

    @property
    def rungs(self) -> Sequence[RungPicture]:
        return self.image.rungs

    @property
    def charts(self) -> Sequence[SfcPicture]:
        return self.image.charts

    @property
    def symbols(self) -> Mapping[str, Field]:
        return self.image.symbols

    def name_in_block(self, body: int) -> str:
        """The name of a method or an accessor of a property without that of its block."""
        parts = self.body_name(body).split(".")
        blocks = (count for count in range(len(parts) - 1, 0, -1) if fold(".".join(parts[:count])) in self.image.types)
        return ".".join(parts[next(blocks, 1):])

    def body_name(self, body: int) -> str:
        """The name of the POU that is body number `body`."""
        return self.image.bodies[body].name

    def is_method(self, body: int) -> bool:
        """True for a method, or an accessor of a property."""
        return self.image.bodies[body].kind in ("METHOD", "GET", "SET")

    def local(self, body: int, older: int = 0) -> Mapping[str, Field]:
        """The variables of a body that live while it is executed, by folded name: those of a function, and VAR_TEMP.

        older: of a body that has been called again, how many newer executions of it there are."""
        found = self.image.frames.get(fold(self.body_name(body)), {})
        if not older:
            return found
        return {name: replace(field, frame_at=(*field.frame_at, *[FRAME_LINK] * older)) for name, field in found.items()}
