"""The scans behind a keyframe as bytes and back, for the file of a recording: times, inputs, fingerprints of the memory.

Events are written by the codec of `fbvm.net.journal`.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from fbvm.machine.state import State
from fbvm.net.journal import from_event, to_event
from fbvm.record.recording.chunks import Chunk, ScanInputs, Times, UnitKeyframe, Write
from fbvm.record.recording.plain_data import number, parts_of, payload_of
from fbvm.wire.link import read_peer
from fbvm.wire.tap import TapEvent, TapKind


class StoredChunk(Chunk):
    """A chunk of a file.  The inputs of a scan are decoded when somebody asks for them, which of most scans nobody does."""

    inputs: list[Any]

    def __init__(self, state: State, units: Sequence[UnitKeyframe], budget: int, follows: bool, size: int) -> None:
        super().__init__(state, units, budget, follows)
        self._size = size

    def add_segment(self, segment: Segment) -> None:
        """Adds some scans behind those that are there.  Raises ValueError for times that are not in their order."""
        times = self.times
        last_ns = times.at(times.end - 1) if times.end > self.first else self.state.now_ns
        for _, time_ns, step_ns, scans in segment.times.rows(segment.first):
            if time_ns < last_ns:
                raise ValueError("time runs backwards")
            times.add(time_ns, scans, step_ns)
            last_ns = time_ns + (scans - 1) * step_ns
        self.machine = self.machine or segment.machine
        self.numbers += segment.numbers
        self.inputs += segment.inputs

    def _inputs_at(self, at: int) -> ScanInputs:
        return decode_inputs(self.inputs[at], self._size)


@dataclass
class Segment:
    """Some scans behind a keyframe."""

    first: int
    """The number of the first of them."""
    times: Times
    numbers: list[int]
    """The numbers of the scans that have inputs."""
    inputs: list[Any]
    """Of each of them, for `decode_inputs`."""
    machine: bool
    """True if machine code did some of the scans behind the keyframe."""
    memory: int
    """The fingerprint of the memory behind the last scan."""
    memories: Sequence[int]
    """Behind each scan, if asked for; else empty."""


def encode_scans(rows: list[list[int]], inputs: Sequence[ScanInputs], machine: bool, memory: int,
                 memories: Sequence[int]) -> bytes:  # fmt: skip
    """Some scans as bytes: their times, their inputs, the fingerprint behind the last one, or (`memories`) behind each."""
    data = {"times": rows, "inputs": [encode_inputs(row) for row in inputs], "machine": machine, "memory": memory}
    return payload_of(data, [array("I", memories).tobytes()] if memories else [])


def decode_scans(payload: bytes, first: int, scans: int) -> Segment:
    """The scans that `encode_scans` was given; their inputs are not decoded yet.

    Raises errors of several classes for other bytes."""
    data, rest = parts_of(payload)
    times = Times(first)
    at = first
    for scan, time_ns, step_ns, count in data["times"]:
        if number(scan) != at:
            raise ValueError(f"scan {scan} where {at} should be")
        times.add(number(time_ns), number(count, scans), number(step_ns))
        at += count
    if at != first + scans or len(rest) not in (0, 4 * scans):
        raise ValueError(f"{at - first} scans where {scans} should be")
    numbers = [number(row["scan"]) for row in data["inputs"]]
    if sorted(set(numbers)) != numbers or (numbers and not first <= numbers[0] <= numbers[-1] < at):
        raise ValueError("inputs that belong to no scan, or are not in their order")
    memories = memoryview(rest).cast("I") if rest else ()
    return Segment(first, times, numbers, data["inputs"], bool(data["machine"]), number(data["memory"]), memories)


WRITES = ("writes", "results", "refreshed")
"""Those inputs that are bytes at offsets."""


def _writes(writes: Sequence[Write]) -> list[Any]:
    return [[offset, data.hex()] for offset, data in writes]


def encode_inputs(inputs: ScanInputs) -> dict[str, Any]:
    """The inputs of a scan as plain data."""
    found: dict[str, Any] = {"scan": inputs.scan}
    if inputs.writes or inputs.results or inputs.refreshed:
        found.update((name, _writes(writes)) for name in WRITES if (writes := getattr(inputs, name)))
    if inputs.forces is not None:
        found["forces"] = dict(inputs.forces)
    if inputs.budget is not None:
        found["budget"] = inputs.budget
    if inputs.settings:
        found["settings"] = list(inputs.settings.items())
    if inputs.events:
        found["events"] = [[unit, [from_event(event) for event in events]] for unit, events in inputs.events.items()]
    if inputs.traffic:
        found["traffic"] = [_passing(*row) for row in inputs.traffic]
    if inputs.watch is not None:
        found["watch"] = inputs.watch
    return found


def decode_inputs(row: Mapping[str, Any], size: int) -> ScanInputs:
    """The inputs of a scan again; `size` is that of the memory.  Raises errors of several classes for other data."""
    made = ScanInputs(number(row["scan"]))
    for name, data in row.items():
        if name in WRITES:
            setattr(made, name, [_write(size, *write) for write in data])
        elif read := _DECODED.get(name):
            setattr(made, name, read(data))
    return made


_DECODED: dict[str, Callable[[Any], object]] = {
    "forces": dict,
    "budget": number,
    "settings": lambda rows: {number(unit): dict(given) for unit, given in rows},
    "events": lambda rows: {number(unit): [to_event(event) for event in events] for unit, events in rows},
    "traffic": lambda rows: [_passed(*passing) for passing in rows],
    "watch": lambda row: (number(row[0]), number(row[1])),
}


def _write(size: int, offset: int, data: str) -> Write:
    content = bytes.fromhex(data)
    if number(offset) + len(content) > size:
        raise ValueError(f"{len(content)} bytes at {offset} are outside the memory")
    return offset, content


def _passing(now_ns: int, unit: str, event: TapEvent) -> list[Any]:
    local, remote = event.local, event.remote
    return [now_ns, unit, event.kind.value, local.host, local.port, remote.host, remote.port, int(event.out),
            int(event.mirrored), event.data.hex()]  # fmt: skip


def _passed(now_ns: int, unit: str, kind: str, host: str, port: int, other: str, other_port: int, out: int, mirrored: int,
            data: str) -> tuple[int, str, TapEvent]:  # fmt: skip
    event = TapEvent(_KINDS[kind], _peer(host, port), _peer(other, other_port), bool(out), bytes.fromhex(data), bool(mirrored))
    return number(now_ns), str(unit), event


_KINDS = {kind.value: kind for kind in TapKind}


_peer = lru_cache(read_peer)
