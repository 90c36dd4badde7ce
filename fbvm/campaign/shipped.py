"""Work that needs the files of a folder, on computers that do not have it: the files travel, and each task is done by a process
in a copy of the folder.

The process is one of its own, so that tests may change what belongs to a process, and one that hangs can be ended."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Generic, Protocol, TypeVar

from fbvm.base.version import VERSION
from fbvm.campaign.processes import Crashed, Late, Pool
from fbvm.campaign.project_copies import unpack_project

Task = TypeVar("Task")
Result = TypeVar("Result", covariant=True)


class FolderBench(Protocol[Task, Result]):
    """What does tasks in copies of a folder, one for each process."""

    def in_folders(self, folders: Sequence[str]) -> FolderBench[Task, Result]:
        """The same in these copies."""

    def prepare(self, number: int) -> None:
        """Called first in the process with this number."""

    def work(self, number: int, task: Task) -> Result:
        """Does a task in the copy of a process."""


@dataclass(frozen=True)
class Shipped(Generic[Task, Result]):
    """A bench and its folder, which is called `name` and packed in `files`; see `project_copies`."""

    bench: FolderBench[Task, Result]
    name: str
    files: bytes

    @property
    def mark(self) -> str:
        """A hash of all that results depend on."""
        return hashlib.sha256(repr((VERSION, self.bench, self.name)).encode() + self.files).hexdigest()

    def limited(self, task: Task, limit_ns: int) -> Result | Late | Crashed:
        """Does a task, for `limit_ns` at most; a worker with several threads has a process for each."""
        mark = self.mark
        place = _places.get(mark) or _places.setdefault(mark, _Place())
        try:
            pool = place.idle.pop()
        except IndexError:  # other threads of the worker have them
            pool = self._opened(place)
        try:
            ((_, result),) = pool.results([task], limit_ns)
        finally:
            place.idle.append(pool)
        return result

    def _opened(self, place: _Place) -> Pool[Any, Any]:
        folder = Path(place.stack.enter_context(TemporaryDirectory(prefix="fbvm-", ignore_cleanup_errors=True)), self.name)
        unpack_project(self.files, folder)
        bench = self.bench.in_folders([str(folder)])
        return place.stack.enter_context(Pool[Any, Any](1, bench.prepare, bench.work))

    def close(self) -> None:
        """Ends the processes of this worker, and removes their copies."""
        if place := _places.pop(self.mark, None):
            place.stack.close()


class _Place:
    """The processes of a worker for one bench, and those that have nothing to do."""

    def __init__(self) -> None:
        self.stack = ExitStack()
        self.idle = deque[Pool[Any, Any]]()


_places: dict[str, _Place] = {}
"""Of this worker, by the marks of the benches."""
