"""What happens inside a scan: every statement, call, read and write, with the instance that did it and the values.

`ObservedEngine` takes the place of a PLC's engine while somebody looks and gives it back afterwards.  It tells what happened
and keeps nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from mmap import mmap
from typing import NamedTuple, TypeAlias

from fbvm.base.memory import WHOLE_BYTES, Memory
from fbvm.code.image import Image
from fbvm.code.operations import detail_size
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.python.runtime import NO_SITE, Observation
from fbvm.engine.tiers import substitutes_of
from fbvm.engine.trap import Trap
from fbvm.wire.tap import TapEvent


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One execution of a body: its number in the image, where its instance begins, and who called it.

    `site` is the statement of the caller, NO_SITE for a program."""

    body: int
    base: int
    site: int
    caller: Frame | None


OUTSIDE = Frame(NO_SITE, 0, NO_SITE, None)
"""Who calls programs."""


class Call(NamedTuple):
    """A body began."""

    frame: Frame


class Return(NamedTuple):
    """A body ended."""

    frame: Frame


class Statement(NamedTuple):
    """A statement, or a rung, is about to be executed."""

    site: int
    frame: Frame
    is_rung: bool = False


class Read(NamedTuple):
    """A variable was read.  `bit` is WHOLE_BYTES, or that of a located BOOL, whose `value` is then one byte 0 or 1."""

    site: int
    frame: Frame
    offset: int
    bit: int
    value: bytes


class Write(NamedTuple):
    """A variable was written; `old` and `value` may be the same."""

    site: int
    frame: Frame
    offset: int
    bit: int
    old: bytes
    value: bytes


class Contact(NamedTuple):
    """A contact of a rung let power through or not; `element` is what the image calls it."""

    site: int
    frame: Frame
    element: object
    value: bool


class NetworkEvent(NamedTuple):
    """Something passed the network at a unit of the PLC, in the I/O refresh."""

    now_ns: int
    tap_event: TapEvent


Event: TypeAlias = Call | Return | Statement | Read | Write | Contact | NetworkEvent


class ObservedEngine:
    """An engine that tells every event of a run.  `program` is the engine in whose place it stands."""

    machine = None
    """It runs no machine code."""

    def __init__(self, image: Image, memory: Memory, tell: Callable[[Event], None], program: object = None) -> None:
        self.memory = memory
        self.report = tell
        self.program = program
        self._engine = PythonEngine(image, memory, observed=True)
        known = program._engine if isinstance(program, ObservedEngine) else program
        for body, function in substitutes_of(known).items():
            self._engine.substitute(body, function)
        self._shadow = bytearray(memory.size)
        self._frame, self._unwritten = OUTSIDE, 0
        """What is executed, and how many bodies are over it that no statement calls."""

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once, telling what they do."""
        observations, tell, event = self._observe(task_index), self.report, self._event
        while True:
            try:
                told = event(next(observations))
            except StopIteration as end:
                trap: Trap | None = end.value
                return trap
            if told is not None:
                tell(told)

    def steps(self, task_index: int) -> Generator[Event, None, Trap | None]:
        """The events of one execution of a task; execution stands still between two of them."""
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
        self._frame, self._unwritten = OUTSIDE, 0
        return self._engine.observe(task_index)

    def _event(self, seen: Observation) -> Event | None:
        """What an observation means; follows calls.  None for a statement of a body that no statement calls, such as one
        that the front end has called at the beginning of rungs: nobody stands still there."""
        kind, site, detail = seen
        frame = self._frame
        if kind == "statement" or kind == "rung":
            return None if self._unwritten else Statement(site, frame, kind == "rung")
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
            self._unwritten += bool(self._unwritten) or frame is not OUTSIDE and site == NO_SITE
            return Call(self._frame)
        if kind == "return":
            assert frame.caller is not None
            self._frame = frame.caller
            self._unwritten -= bool(self._unwritten)
            return Return(frame)
        return Contact(site, frame, *detail)


def value_at(buffer: bytes | bytearray | mmap, offset: int, size: int, bit: int = WHOLE_BYTES) -> bytes:
    """The bytes of a value; of a bit, one byte 0 or 1."""
    if bit != WHOLE_BYTES:
        return bytes((buffer[offset] >> bit & 1,))
    value = buffer[offset : offset + size]
    return bytes(value) if isinstance(value, bytearray) else value

