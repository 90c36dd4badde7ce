"""The scans behind a keyframe as bytes and back, for the file of a recording: times, inputs, fingerprints of the memory.

Events are written by the codec of `fbvm.net.journal`.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fbvm.net.journal import from_event, to_event
from fbvm.record.recording.chunks import ScanInputs, Times, Writes
from fbvm.record.recording.plain_data import number, parts_of, payload_of
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind


@dataclass
class Segment:
    """Some scans behind a keyframe."""

    first: int
    """The number of the first of them."""
    times: Times
    inputs: list[ScanInputs]
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


def decode_scans(payload: bytes, first: int, scans: int, size: int) -> Segment:
    """The scans that `encode_scans` was given; `size` is that of the memory.

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
    inputs = [decode_inputs(row, size) for row in data["inputs"]]
    scans_with = [row.scan for row in inputs]
    if sorted(set(scans_with)) != scans_with or (scans_with and not first <= scans_with[0] <= scans_with[-1] < at):
        raise ValueError("inputs that belong to no scan, or are not in their order")
    memories = memoryview(rest).cast("I") if rest else ()
    return Segment(first, times, inputs, bool(data["machine"]), number(data["memory"]), memories)


def _writes(writes: Writes) -> list[Any]:
    return [[offset, data.hex()] for offset, data in writes]


def encode_inputs(inputs: ScanInputs) -> dict[str, Any]:
    """The inputs of a scan as plain data."""
    found: dict[str, Any] = {"scan": inputs.scan}
    for name in ("writes", "results", "refreshed"):
        if writes := getattr(inputs, name):
            found[name] = _writes(writes)
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
    """The inputs of a scan again.  Raises errors of several classes for other data."""
    writes, results, refreshed = ([_write(size, *write) for write in row.get(name, ())]
                                  for name in ("writes", "results", "refreshed"))  # fmt: skip
    watch = row.get("watch")
    return ScanInputs(
        number(row["scan"]), writes, None if "forces" not in row else dict(row["forces"]),
        number(row["budget"]) if "budget" in row else None,
        {number(unit): dict(given) for unit, given in row.get("settings", ())},
        {number(unit): [to_event(event) for event in events] for unit, events in row.get("events", ())},
        results, [_passed(*passing) for passing in row.get("traffic", ())],
        None if watch is None else (number(watch[0]), number(watch[1])), refreshed)  # fmt: skip


def _write(size: int, offset: int, data: str) -> tuple[int, bytes]:
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
    return number(now_ns), str(unit), TapEvent(TapKind(kind), Peer(str(host), int(port)), Peer(str(other), int(other_port)),
                                                bool(out), bytes.fromhex(data), bool(mirrored))  # fmt: skip
