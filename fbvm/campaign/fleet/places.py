"""Where the parts of a fleet run: in processes of this machine, or of the workers of a cluster."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, cast

from fbvm.base.host import signals_held
from fbvm.campaign.fleet.shard import FAILED, OVER, Figures, Shard, ShardProcess

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

    def __init__(self) -> None:
        self._parts: list[ShardProcess] = []

    def begin(self, shards: Sequence[Shard]) -> None:
        """Starts the processes, all at once.  Raises OSError; those that were started are ended by `end`."""
        for shard in shards:
            with signals_held():
                self._parts.append(ShardProcess(shard))
        for part in self._parts:
            part.begin()

    def figures(self) -> dict[int, tuple[str, Figures]]:
        told = [part.figures() for part in self._parts]
        return {each.number: ("here", each) for each in told}

    def stop(self) -> None:
        for part in self._parts:
            part.stop()

    def end(self) -> None:
        """Ends all processes."""
        with signals_held():
            for part in self._parts:
                part.end()


@contextmanager
def here(shards: Sequence[Shard]) -> Iterator[Places]:
    """Runs the parts in processes of this machine, which are ended behind the `with` block."""
    places = Here()
    try:
        places.begin(shards)
        yield places
    finally:
        places.end()


# --- in the workers of a cluster --------------------------------------------------------------------------------------

_parts: dict[str, dict[int, ShardProcess]] = {}
"""Of this worker: its parts, by the mark of the fleet and by their numbers."""


def _begin(mark: str, shard: Shard) -> None:
    with signals_held():
        part = _parts.setdefault(mark, {})[shard.number] = ShardProcess(shard)
    part.begin()


def _figures(mark: str) -> dict[int, Figures]:
    return {number: part.figures() for number, part in _parts.get(mark, {}).items()}


def _stop(mark: str) -> None:
    for part in _parts.get(mark, {}).values():
        part.stop()


def _end(mark: str) -> None:
    for part in _parts.pop(mark, {}).values():
        part.end()


SCHEDULER_GONE = "the scheduler has gone away; a part that hears nothing ends by itself within half a minute"


class InCluster:
    """The parts run beside the workers of a cluster, each worker having as many as the others."""

    def __init__(self, client: Client, shards: Sequence[Shard]) -> None:
        self._client: Any = client
        self._mark = uuid.uuid4().hex
        workers = sorted(self._client.scheduler_info(n_workers=-1)["workers"])
        self._where = {shard.number: workers[number % len(workers)] for number, shard in enumerate(shards)}
        self._told = {shard.number: Figures(shard.number) for shard in shards}

    def begin(self, shards: Sequence[Shard]) -> None:
        """Starts the parts, which are ended by `end`, also if not all could be started."""
        for shard in shards:
            self._client.run(_begin, self._mark, shard, workers=[self._where[shard.number]])

    def figures(self) -> dict[int, tuple[str, Figures]]:
        """What the parts tell; of those whose worker or scheduler has gone what they told last, as failed."""
        found = self._asked(_figures)
        now = {number: figures for parts in (found or {}).values() for number, figures in parts.items()}
        why = SCHEDULER_GONE if found is None else "its worker has gone away"
        for number, before in self._told.items():
            if number in now:
                self._told[number] = now[number]
            elif before.state not in (OVER, FAILED):
                self._told[number] = replace(before, state=FAILED, message=why)
        return {number: (where, self._told[number]) for number, where in self._where.items()}

    def stop(self) -> None:
        self._asked(_stop)

    def end(self) -> None:
        """Ends all processes."""
        self._asked(_end)

    def _asked(self, function: Callable[[str], Any]) -> dict[str, Any] | None:
        """What each worker answers that is there; None without a scheduler."""
        try:
            return cast(dict[str, Any], self._client.run(function, self._mark, on_error="ignore"))
        except (OSError, RuntimeError):  # the connection is closed, or nobody accepts another one
            return None


@contextmanager
def in_cluster(cluster: AbstractContextManager[Client], shards: Callable[[int], Sequence[Shard]]) -> Iterator[Places]:
    """Runs parts beside the workers of a cluster; they are ended behind the `with` block.  `shards` makes them for a number of
    workers."""
    with cluster as client:
        connection: Any = client
        parts = shards(len(connection.scheduler_info(n_workers=-1)["workers"]))
        places = InCluster(client, parts)
        try:
            places.begin(parts)
            yield places
        finally:
            places.end()
