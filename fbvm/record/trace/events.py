"""The events inside a scan: statements, calls, reads and writes, each with its instance and values.

`ObservedEngine` replaces the engine of a PLC as long as a listener is attached (`history.observing`).  It reports events and
keeps none.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from mmap import mmap
from typing import Any, NamedTuple, TypeAlias

from fbvm.base.memory import WHOLE_BYTES, Memory
from fbvm.code.image import Image
from fbvm.code.operations import detail_size
from fbvm.engine.allowance import Allowance
from fbvm.engine.choice.tiers import add_counts, image_of, substitutes_of
from fbvm.engine.observation import NO_SITE, Observation
from fbvm.engine.python.engine import PythonEngine
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


class Cut(NamedTuple):
    """The task has executed more statements, of which nothing is reported."""


Event: TypeAlias = Call | Return | Statement | Read | Write | Contact | NetworkEvent | Cut


class ObservedEngine:
    """An engine that calls `report` for every event of a task.

    `program` is the engine that it replaces, whose substitutes of bodies it takes over.  With `stands_still` the run waits at
    each event, so that `report` may change the memory; without, it is over before its first event is reported, which takes
    a fraction of the time, and the memory is brought back to each moment (but for the system page).  `most` limits what is
    reported of a task that loops, see `PythonEngine.observations`."""

    machine = None
    """There is no machine code."""

    def __init__(self, image: Image, memory: Memory, report: Callable[[Event], None], program: object = None,
                 stands_still: bool = False, most: int | None = None) -> None:  # fmt: skip
        self.memory = memory
        self.report = report
        self.stands_still, self.most = stands_still, most
        known: object = program._engine if isinstance(program, ObservedEngine) else program
        self._counter: object = program._counter if isinstance(program, ObservedEngine) else program
        self._engine: PythonEngine = PythonEngine(image_of(known, image), memory, observed=True)
        for body, function in substitutes_of(known).items():
            self._engine.substitute(body, function)
        self._shadow = mmap(-1, memory.size)  # whose slices are bytes
        self._trap: Trap | None = None

    @property
    def allowance(self) -> Allowance:
        """How much of the step budget runs may use up."""
        return self._engine.allowance

    @allowance.setter
    def allowance(self, allowance: Allowance) -> None:
        self._engine.allowance = allowance

    def run(self, task_index: int) -> Trap | None:
        """Executes the programs of one task once and reports their events; returns the trap that ended them, if any."""
        self._shadow[:] = self.memory.u8
        try:
            self._report_all(self._observations(task_index))
        finally:
            if self._engine.counted:
                add_counts(self._counter, self._engine.counted)
                self._engine.counted[:] = [0] * len(self._engine.counted)
        return self._trap

    def _observations(self, task_index: int) -> Generator[Observation, None, None]:
        """The observations of a task; keeps the trap that ended it."""
        engine = self._engine
        self._trap = yield from (
            engine.observe(task_index) if self.stands_still else engine.observations(task_index, self.most))

    def _report_all(self, observations: Iterable[Observation]) -> None:
        """Reports the events of observations, but not statements inside a call that the compiler has added, such as one at the
        beginning of rungs."""
        report, shadow, buffer, frame = self.report, self._shadow, self.memory.map, OUTSIDE
        made = tuple.__new__  # a third of the time of calling the class
        generated_depth = 0
        for kind, site, detail in observations:
            if kind == "read":
                form, offset, bit = detail
                value = buffer[offset : offset + _SIZES[form]] if bit == WHOLE_BYTES else bit_at(buffer, offset, bit)
                report(made(Read, (site, frame, offset, bit, value)))
            elif kind == "write":
                form, offset, bit = detail
                end = offset + _SIZES[form]
                old, value = shadow[offset:end], buffer[offset:end]
                if bit != WHOLE_BYTES:
                    old, value = bit_at(shadow, offset, bit), bit_at(buffer, offset, bit)
                if old != value:
                    shadow[offset:end] = buffer[offset:end]
                report(made(Write, (site, frame, offset, bit, old, value)))
            elif kind == "statement" or kind == "rung":
                if not generated_depth:
                    report(made(Statement, (site, frame, kind == "rung")))
            elif kind == "call":
                generated_depth += bool(generated_depth) or frame is not OUTSIDE and site == NO_SITE
                body, base = detail
                frame = Frame(body, base, site, frame)
                report(Call(frame))
            elif kind == "return":
                ended, caller = frame, frame.caller
                assert caller is not None
                frame = caller
                generated_depth -= bool(generated_depth)
                report(Return(ended))
            elif kind == "cut":
                report(Cut())
            else:
                report(Contact(site, frame, *detail))


class _Sizes(dict[Any, int]):
    """By the type in a detail the number of bytes."""

    def __missing__(self, form: Any) -> int:
        self[form] = size = detail_size(form)
        return size


_SIZES = _Sizes()


def bit_at(buffer: bytes | mmap, offset: int, bit: int) -> bytes:
    """The value of a bit: one byte, 0 or 1."""
    return bytes((buffer[offset] >> bit & 1,))

