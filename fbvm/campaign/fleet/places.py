"""Where the parts of a fleet run: in processes of this machine, or of the workers of a cluster."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from fbvm.campaign.fleet.shard import FAILED, Figures, Shard, ShardProcess

if TYPE_CHECKING:
    from distributed import Client


class Places(Protocol):
    """The parts of a fleet, wherever they run."""

    def figures(self) -> dict[int, tuple[str, Figures]]:
        """For each part by its number: where it is, and what it has told last."""

    def stop(self) -> None:
        """Tells all of them to stop."""


class Here:
    """The parts are processes of this machine."""

    def __init__(self, shards: Sequence[Shard]) -> None:
        self._parts = [ShardProcess(shard) for shard in shards]

    def figures(self) -> dict[int, tuple[str, Figures]]:
        told = [part.figures() for part in self._parts]
        return {each.number: ("here", each) for each in told}

    def stop(self) -> None:
        for part in self._parts:
            part.stop()

    def end(self) -> None:
        """Ends all processes."""
        for part in self._parts:
            part.end()


@contextmanager
def here(shards: Sequence[Shard]) -> Iterator[Places]:
    """Runs the parts in processes of this machine, which are ended behind the `with` block."""
    places = Here(shards)
    try:
        yield places
    finally:
        places.end()


# --- in the workers of a cluster --------------------------------------------------------------------------------------

_parts: dict[str, dict[int, ShardProcess]] = {}
"""Of this worker: its parts, by the mark of the fleet and by their numbers."""


def _begin(mark: str, shard: Shard) -> None:
    _parts.setdefault(mark, {})[shard.number] = ShardProcess(shard)


def _figures(mark: str) -> dict[int, Figures]:
    return {number: part.figures() for number, part in _parts.get(mark, {}).items()}


def _stop(mark: str) -> None:
    for part in _parts.get(mark, {}).values():
        part.stop()


def _end(mark: str) -> None:
    for part in _parts.pop(mark, {}).values():
        part.end()


class InCluster:
    """The parts run beside the workers of a cluster, each worker having as many as the others."""

    def __init__(self, client: Client, shards: Sequence[Shard]) -> None:
        self._client: Any = client
        self._mark = uuid.uuid4().hex
        workers = sorted(self._client.scheduler_info(n_workers=-1)["workers"])
        self._where = {shard.number: workers[number % len(workers)] for number, shard in enumerate(shards)}
        for shard in shards:
            self._client.run(_begin, self._mark, shard, workers=[self._where[shard.number]])

    def figures(self) -> dict[int, tuple[str, Figures]]:
        found = self._client.run(_figures, self._mark, on_error="ignore")
        told = {number: figures for parts in found.values() for number, figures in parts.items()}
        return {number: (where, told.get(number) or Figures(number, FAILED, message="its worker has gone away"))
                for number, where in self._where.items()}  # fmt: skip

    def stop(self) -> None:
        self._client.run(_stop, self._mark, on_error="ignore")

    def end(self) -> None:
        """Ends all processes."""
        self._client.run(_end, self._mark, on_error="ignore")


@contextmanager
def in_cluster(cluster: AbstractContextManager[Client], shards: Callable[[int], Sequence[Shard]]) -> Iterator[Places]:
    """Runs parts beside the workers of a cluster; they are ended behind the `with` block.  `shards` makes them for a number of
    workers."""
    with cluster as client:
        connection: Any = client
        places = InCluster(client, shards(len(connection.scheduler_info(n_workers=-1)["workers"])))
        try:
            yield places
        finally:
            places.end()
