"""The events inside a scan: statements, calls, reads and writes, each with its instance and values.

`ObservedEngine` replaces the engine of a PLC as long as a listener is attached (`history.observing`).  It reports events and
keeps none.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from mmap import mmap
from typing import NamedTuple, TypeAlias

from fbvm.base.memory import WHOLE_BYTES, Memory
from fbvm.code.image import Image
from fbvm.code.operations import detail_size
from fbvm.engine.allowance import Allowance
from fbvm.engine.choice.tiers import substitutes_of
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.python.runtime import NO_SITE, Observation
from fbvm.engine.trap import Trap
from fbvm.wire.tap import TapEvent


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One execution of a body: its number in the image, the offset of its instance, the site of the call, and the caller.

    `site` is NO_SITE for a program."""

    body: int
    base: int
    site: int
    caller: Frame | None


OUTSIDE = Frame(NO_SITE, 0, NO_SITE, None)
"""The caller of programs."""


class Call(NamedTuple):
    """The execution of a body begins."""

    frame: Frame


class Return(NamedTuple):
    """The execution of a body has ended."""

    frame: Frame


class Statement(NamedTuple):
    """A statement, or a rung, is about to be executed."""

    site: int
    frame: Frame
    is_rung: bool = False


class Read(NamedTuple):
    """A variable has been read.  `bit` is WHOLE_BYTES; of a located BOOL its bit, and `value` is then one byte, 0 or 1."""

    site: int
    frame: Frame
    offset: int
    bit: int
    value: bytes


class Write(NamedTuple):
    """A variable has been written; `old` and `value` may be equal."""

    site: int
    frame: Frame
    offset: int
    bit: int
    old: bytes
    value: bytes


class Contact(NamedTuple):
    """A contact of a rung has been evaluated; `value` is True if it conducts, `element` its key in the image."""

    site: int
    frame: Frame
    element: object
    value: bool


class NetworkEvent(NamedTuple):
    """An event of the network at a unit of the PLC, reported in the I/O refresh."""

    now_ns: int
    tap_event: TapEvent


Event: TypeAlias = Call | Return | Statement | Read | Write | Contact | NetworkEvent


class ObservedEngine:
    """An engine that calls `report` for every event of a task.

    `program` is the engine that it replaces, whose substitutes of bodies it takes over."""

    machine = None
    """There is no machine code."""

    def __init__(self, image: Image, memory: Memory, report: Callable[[Event], None], program: object = None) -> None:
        self.memory = memory
        self.report = report
        self.program = program
        self._engine = PythonEngine(image, memory, observed=True)
        known = program._engine if isinstance(program, ObservedEngine) else program
        for body, function in substitutes_of(known).items():
            self._engine.substitute(body, function)
        self._shadow = bytearray(memory.size)
        self._frame, self._generated_depth = OUTSIDE, 0
        """The current frame, and the depth of calls inside a call that no statement of the source has made."""

    @property
    def allowance(self) -> Allowance:
        """How much of the step budget runs may use up."""
        return self._engine.allowance

    @allowance.setter
    def allowance(self, allowance: Allowance) -> None:
        self._engine.allowance = allowance

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once and reports their events; returns the trap that ended them, if any."""
        observations, report, to_event = self._observe(task_index), self.report, self._event
        while True:
            try:
                event = to_event(next(observations))
            except StopIteration as end:
                trap: Trap | None = end.value
                return trap
            if event is not None:
                report(event)

    def steps(self, task_index: int) -> Generator[Event, None, Trap | None]:
        """Executes a task once; yields each event, and execution waits until the next one is asked for."""
        observations = self._observe(task_index)
        while True:
            try:
                seen = next(observations)
            except StopIteration as end:
                trap: Trap | None = end.value
                return trap
            event = self._event(seen)
            if event is not None:
                yield event

    def _observe(self, task_index: int) -> Generator[Observation, None, Trap | None]:
        self._shadow[:] = self.memory.u8
        self._frame, self._generated_depth = OUTSIDE, 0
        return self._engine.observe(task_index)

    def _event(self, seen: Observation) -> Event | None:
        """The event of an observation of the Python engine; keeps the current frame.

        None for a statement inside a call that the compiler has added, such as one at the beginning of rungs."""
        kind, site, detail = seen
        frame = self._frame
        if kind == "statement" or kind == "rung":
            return None if self._generated_depth else Statement(site, frame, kind == "rung")
        if kind == "read" or kind == "write":
            form, offset, bit = detail
            size = detail_size(form)
            value = value_at(self.memory.map, offset, size, bit)
            if kind == "read":
                return Read(site, frame, offset, bit, value)
            old = value_at(self._shadow, offset, size, bit)
            if old != value:
                self._shadow[offset : offset + size] = self.memory.map[offset : offset + size]
            return Write(site, frame, offset, bit, old, value)
        if kind == "call":
            body, base = detail
            self._frame = Frame(body, base, site, frame)
            self._generated_depth += bool(self._generated_depth) or frame is not OUTSIDE and site == NO_SITE
            return Call(self._frame)
        if kind == "return":
            assert frame.caller is not None
            self._frame = frame.caller
            self._generated_depth -= bool(self._generated_depth)
            return Return(frame)
        return Contact(site, frame, *detail)


def value_at(buffer: bytes | bytearray | mmap, offset: int, size: int, bit: int = WHOLE_BYTES) -> bytes:
    """The bytes of a value; of a bit, one byte 0 or 1."""
    if bit != WHOLE_BYTES:
        return bytes((buffer[offset] >> bit & 1,))
    value = buffer[offset : offset + size]
    return bytes(value) if isinstance(value, bytearray) else value

