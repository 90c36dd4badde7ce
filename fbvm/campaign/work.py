"""What a process does for a campaign: executes runs in batches, and makes failing runs small.

Images travel to it, not sources."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeAlias

from fbvm.base.version import VERSION
from fbvm.campaign.execution import Execution, Result
from fbvm.campaign.plan import Plan
from fbvm.campaign.shrinking import Executes, Shrunk, shrink
from fbvm.campaign.variants import Variant, draw
from fbvm.code.image import Image
from fbvm.code.store.encoding import decode, encode


@dataclass(frozen=True)
class Batch:
    """A task: some runs, by their numbers.  What comes of it is a list of results."""

    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Shrinking:
    """A task: the failing run that is to be made smaller, by its result."""

    result: Result


Task = Batch | Shrinking
Done = list[Result] | Shrunk


class Mismatch(Exception):
    """A process has another version of fbvm, or has received another program than was sent."""


class Unreachable(Exception):
    """There is no such cluster, it has no workers, or it has gone; the message says which."""


BATCH_NS = 200_000_000
"""About how long a batch takes; to send one costs half a millisecond."""


class AnyBench(Protocol):
    """What does tasks in a process: it has all that this needs, but for what lies in a folder."""

    @property
    def plan(self) -> Plan: ...

    @property
    def mark(self) -> str:
        """A hash of all that results depend on."""

    @property
    def batch_ns(self) -> int:
        """About how long a batch takes."""

    @property
    def ends_processes(self) -> bool:
        """True if a run may end the process that executes it, as a test may; a program cannot."""

    def prepare(self, number: int) -> None:
        """Makes a process ready."""

    def execution(self) -> Executes:
        """What executes runs in this process."""

    def variant(self, number: int) -> Variant:
        """The run with this number."""

    def work(self, number: int, task: Task) -> Done:
        """Does a task."""


PackedImage: TypeAlias = tuple[str, str, bytes]
"""A program that travels: the name of its PLC, its fingerprint, and its bytes."""


def packed(images: Mapping[str, Image]) -> tuple[PackedImage, ...]:
    """Programs by the names of their PLCs, ready to travel."""
    return tuple((name, image.fingerprint, encode(image)) for name, image in images.items())


def unpacked(images: Iterable[PackedImage], version: str) -> dict[str, Image]:
    """Programs that have come from a process with this version of fbvm.  Raises Mismatch."""
    if version != VERSION:
        raise Mismatch(f"this process has fbvm {VERSION}, not {version}")
    found = {}
    for name, fingerprint, content in images:
        found[name] = decode(content)
        if found[name].fingerprint != fingerprint:
            raise Mismatch(f"{name} has arrived as another program")
    return found


@dataclass(frozen=True)
class Bench:
    """All that a process needs: the plan, the programs as bytes with their fingerprints by name, and the version of fbvm."""

    plan: Plan
    images: tuple[PackedImage, ...]
    version: str
    mark: str
    """A hash of all that results depend on."""
    batch_ns: int = BATCH_NS
    ends_processes: ClassVar[bool] = False

    @classmethod
    def of(cls, plan: Plan, images: Mapping[str, Image]) -> Bench:
        """The bench of a campaign."""
        encoded = packed(images)
        depends = repr((VERSION, plan, [(name, fingerprint) for name, fingerprint, _ in encoded]))
        return cls(plan, encoded, VERSION, hashlib.sha256(depends.encode()).hexdigest())

    def prepare(self, number: int) -> None:
        """Makes a process ready.  Raises Mismatch."""
        self.execution()

    def execution(self) -> Execution:
        """What executes runs in this process.  Raises Mismatch."""
        if self.mark not in _executions:
            images = unpacked(self.images, self.version)
            _executions.clear()
            _executions[self.mark] = Execution(self.plan, images)
        return _executions[self.mark]

    def limited(self, task: Task, limit_ns: int) -> Done:
        """Does a task in a worker of a cluster, where nothing that hangs can be ended: scans have a budget of statements."""
        return self.work(0, task)

    def close(self) -> None:
        """Called in a worker of a cluster when no more tasks come."""
        _executions.pop(self.mark, None)

    def variant(self, number: int) -> Variant:
        """The run with this number."""
        return draw(self.plan, number)

    def work(self, number: int, task: Task) -> Done:
        """Does a task."""
        execution = self.execution()
        if isinstance(task, Batch):
            return [execution.result(self.variant(number)) for number in task.numbers]
        return shrink(execution, self.variant(task.result.number), task.result)


_executions: dict[str, Execution] = {}
"""Of this process, by the mark of the bench."""
