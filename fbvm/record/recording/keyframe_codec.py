"""Keyframes of a recording as bytes and back, for its file.

A payload is JSON and pages of memory.  Pages are kept as the exclusive or with those of an earlier keyframe, the base: what has
not changed since then is zeros.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, cast

from fbvm.base.areas import NEVER, PAGE_BYTES
from fbvm.base.memory import Snapshot
from fbvm.code.image import Image, Site
from fbvm.engine.trap import Trap
from fbvm.machine.backplane import UNITS
from fbvm.machine.scan.tasks import TaskScheduleState
from fbvm.machine.state import Mode, State
from fbvm.record.recording.chunks import Chunk, UnitKeyframe
from fbvm.record.recording.plain_data import number, parts_of, payload_of, tagged, untagged
from fbvm.record.recording.scan_codec import StoredChunk
from fbvm.units.contract import Unit, UnitState
from fbvm.watch.paths import Place, find_place
from fbvm.watch.values import Value

MOST_PAGES = 1 << 17
"""Of a memory."""
MOST_TASKS = 1 << 16
_ZERO_PAGE = bytes(PAGE_BYTES)


def encode_keyframe(chunk: Chunk, base: Sequence[Snapshot] = (), base_at: int = 0) -> bytes:
    """A keyframe as bytes.  `base` are the snapshots of the keyframe at byte `base_at` of the file, if this one is not its own
    base."""
    state, memories, pages = chunk.state, [], list[bytes]()
    for at, snapshot in enumerate(chunk.memories):
        known = base[at].pages if base else (None,) * len(snapshot.pages)
        pairs = zip(snapshot.pages, known, strict=True)
        changed = [page for page, (new, old) in enumerate(pairs) if new is not old and new != old]
        memories.append([len(snapshot.pages), changed])
        pages += [_xor(snapshot.pages[page] or _ZERO_PAGE, known[page]) for page in changed]
    planned, levels, fresh = state.schedule
    trap = state.trap
    return payload_of({
        "base": base_at, "scan": state.scans, "now_ns": state.now_ns, "follows": chunk.follows, "budget": chunk.budget,
        "mode": state.mode.value, "first": state.first,
        "schedule": [list(planned.items()), list(levels.items()), sorted(fresh)],
        "forces": {place.name: value for place, value in state.forces.items()},
        "trap": trap and [trap.code, *vars(trap.site).values(), trap.values, trap.message, trap.instance],
        "units": [_unit(frame) for frame in chunk.units], "memories": memories,
    }, pages)  # fmt: skip


def _unit(frame: UnitKeyframe) -> list[Any]:
    unit, state = frame.unit, frame.state
    kept = None if state is None else [state.memory is not None, tagged(state.other)]
    known = UNITS.get(type(unit).__name__) is type(unit)
    return [type(unit).__name__ if known else "", unit.configuration if known else {}, unit.name, unit.address, kept]


def _xor(page: bytes, known: bytes | None) -> bytes:
    if known is None:
        return page
    return (int.from_bytes(page, "little") ^ int.from_bytes(known, "little")).to_bytes(PAGE_BYTES, "little")


class KeyframeReader:
    """Reads keyframes of one PLC with a memory of `size` bytes.  `image` is its program, None if that is not had."""

    def __init__(self, size: int, image: Image | None) -> None:
        self._size, self._image = size, image
        self._units: dict[str, Unit] = {}

    def base(self, payload: bytes) -> list[Snapshot]:
        """The memories of a keyframe that is its own base.  Raises as `chunk`."""
        data, rest = parts_of(payload)
        if data["base"]:
            raise ValueError("a base that has a base")
        return self._memories(data["memories"], rest, ())

    def chunk(self, payload: bytes, base_of: Callable[[int], Sequence[Snapshot]]) -> StoredChunk:
        """A keyframe, before it has scans.  `base_of` gives the memories of the keyframe at a byte of the file.

        Raises errors of several classes for other bytes."""
        data, rest = parts_of(payload)
        base_at = number(data["base"])
        memories = self._memories(data["memories"], rest, base_of(base_at) if base_at else ())
        planned, levels, fresh = data["schedule"]
        last = len(self._image.tasks) - 1 if self._image else MOST_TASKS
        schedule: TaskScheduleState = (
            {number(task, last): number(due, NEVER) for task, due in planned},
            {number(task, last): bool(level) for task, level in levels}, frozenset(number(task, last) for task in fresh))
        trap = data["trap"]
        own = iter(memories[1:])
        units = [self._frame(own, *row) for row in data["units"]]
        state = State(memories[0], number(data["now_ns"]), number(data["scan"]), schedule, self._forces(data["forces"]),
                      Mode(data["mode"]), bool(data["first"]), None if trap is None else _trap(*trap))  # fmt: skip
        return StoredChunk(state, units, number(data["budget"]), bool(data["follows"]), self._size)

    def _memories(self, rows: list[Any], rest: memoryview, base: Sequence[Snapshot]) -> list[Snapshot]:
        made, at = [], 0
        if not rows or (base and len(base) != len(rows)):
            raise ValueError("its base has other memories")
        for row, (count, changed) in enumerate(rows):
            if (row == 0 and count * PAGE_BYTES != self._size) or number(count) > MOST_PAGES:
                raise ValueError(f"{count} pages of memory")
            pages: list[bytes | None] = list(base[row].pages) if base else [None] * count
            for page in changed:
                found = bytes(rest[at : at + PAGE_BYTES])
                if len(found) < PAGE_BYTES:
                    raise ValueError("a page of memory is missing")
                pages[number(page, count - 1)] = _xor(found, pages[page])
                at += PAGE_BYTES
            made.append(Snapshot(tuple(pages)))
        return made

    def _forces(self, forces: Mapping[str, Value]) -> dict[Place, Value]:
        image = self._image
        if image is None:
            return {}
        return {find_place(image.symbols, image.layout.areas, name): value
                for name, value in forces.items()}  # fmt: skip

    def _frame(self, own: Iterator[Snapshot], kind: str, configuration: dict[str, Any], name: str, address: str,
               kept: Any) -> UnitKeyframe:  # fmt: skip
        key = json.dumps([kind, configuration, name, address])
        unit = self._units.get(key)
        if unit is None:
            unit = self._units[key] = UNITS[kind](**configuration) if kind else cast(Unit, _ForeignUnit(str(name), str(address)))
        if kept is None:
            return UnitKeyframe(unit, None)
        has_memory, other = kept
        return UnitKeyframe(unit, UnitState(next(own) if has_memory else None, untagged(other)))


class _ForeignUnit:
    """What is known of a unit whose class fbvm does not have: what its refreshes changed is recorded."""

    def __init__(self, name: str, address: str) -> None:
        self.name, self.address = name, address


def _trap(code: str, file: str, pou: str, line: int, column: int, values: list[Any], message: str, instance: int) -> Trap:
    return Trap(str(code), Site(str(file), str(pou), int(line), int(column)), tuple(values), str(message), int(instance))
