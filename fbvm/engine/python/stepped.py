"""The build that stands still: bodies are generators, which yield each observation and wait there.

Whoever steps, or changes memory in the middle of a scan, runs this build.  Who only looks takes `logged`, which is faster."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.image import Body
from fbvm.code.operations import Address
from fbvm.engine.observation import NO_SITE, Observation
from fbvm.engine.python.observed import ObservedWriter, names_bit
from fbvm.engine.python.writer import bare


class SteppedWriter(ObservedWriter):
    """Writes one body as a generator of observations."""

    def ended(self, lines: list[str]) -> list[str]:
        return [*lines, "    yield from ()"]

    def calling(self, call: str) -> str:
        return f"yield from {call}"

    def call_body(self, pou: int, address: Address | None, place: str) -> None:
        if not place.isdigit():
            name = self.name("v")
            self.line(f"{name} = {place}")
            place = name
        self.line(f"yield Observation('call', {self.site}, ({pou}, {place}))")
        self.line(f"yield from {self.function(pou)}({place})")
        self.line(f"yield Observation('return', {self.site}, ({pou}, {place}))")

    def attempt_body(self, pou: int, place: str, number: str) -> None:
        self.line(f"yield from {self.function(pou)}({place})")
        self.line(f"{number} = 0")

    def after_stop(self, number: str, traps: bool) -> None:
        self.line(f"{number}, _, ended = caught(stopped, {traps})")
        self.line(f"for each in ended: yield Observation('return', {self.site}, each)")

    def observe(self, kind: str, site: int, detail: Any) -> None:
        self.line(f"yield Observation({kind!r}, {site}, {self._shown(kind, detail)})")

    def _shown(self, kind: str, detail: Any) -> str:
        """Python for the detail of an observation."""
        if kind == "contact":
            element, value = detail
            return f"({element!r}, {bare(self.value(value))})"
        if kind not in ("read", "write"):
            return repr(detail)
        form, address, bit = detail
        place = bare(self.place(address, 1))
        named = f"{bare(self.value(address[0][1]))} & {WHOLE_BYTES}" if names_bit(form, address, bit) else bit
        return f"({form!r}, {place}, {named})"


def reporting(function: Callable[[int], None], body: Body) -> Callable[[int], Generator[Observation, None, None]]:
    """A Python function in place of a body of this build: what is observed is one write of the whole instance."""

    def steps(base: int) -> Generator[Observation, None, None]:
        function(base)
        yield Observation("write", NO_SITE, (("", body.instance_size), base, WHOLE_BYTES))

    return steps
