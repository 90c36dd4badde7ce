"""`[[fault]]` of a project file: its keys, what is wrong with a row, and the page of `fbvm explain fault`."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from fbvm.net.addresses import fits
from fbvm.net.faults import FOREVER, NAMED, NO_FAULT, Fault
from fbvm.run.project_reader import Key, Keys, Kind, Reading, endpoint, flag, moment_ns, one_of, time_ns, whole
from fbvm.watch.values import show_time
from fbvm.wire.link import Peer

MOST_SCANS = 1 << 62


def _errno_name(value: object) -> str:
    if not isinstance(value, str) or not value.startswith("E") or not hasattr(errno, value):
        raise ValueError(f"{value!r} is no errno name such as ECONNREFUSED or EHOSTUNREACH")
    return value


FAULT: Keys = {
    "kind": Key(one_of(tuple(NAMED)), "A named fault, of which the other keys set or change single values.", None),
    "peer": Key(endpoint, "Only connections with this endpoint; 0.0.0.0 and port 0 fit any.", None),
    "from": Key(moment_ns, "Since when after power-on.", 0),
    "until": Key(time_ns, "Until when after power-on; without it to the end.", FOREVER),
    "from_scan": Key(whole(0, MOST_SCANS), "Since which scan of the unit's PLC; 0 is the first.", 0),
    "until_scan": Key(whole(1, MOST_SCANS), "Before which scan it ends; without it never.", FOREVER),
    "latency": Key(time_ns, "How long data take for one way.", None),
    "jitter": Key(time_ns, "How much longer than that at most, by the seed.", None),
    "segment_bytes": Key(whole(1, 65535), "Data arrive in pieces of so many bytes.", None),
    "gap": Key(moment_ns, "The time between two pieces.", None),
    "join": Key(time_ns, "What is sent arrives together at multiples of this time.", None),
    "random_cut": Key(flag, "Pieces have 1 to `segment_bytes` bytes, by the seed.", None),
    "lose_percent": Key(whole(1, 100), "So many of a hundred pieces and datagrams are lost, by the seed.", None),
    "duplicate_percent": Key(whole(1, 100), "So many of a hundred pieces and datagrams arrive twice, by the seed.", None),
    "reset_after_bytes": Key(whole(1, MOST_SCANS), "Connections break when so many bytes have passed, both ways together.", None),
    "silent": Key(flag, "Nothing passes: a dead host, a pulled cable.", None),
    "reset": Key(flag, "What is open breaks.", None),
    "error": Key(Kind("an errno name", _errno_name), "Opening fails at once with this errno name, such as ECONNREFUSED.",
                 None),
}  # fmt: skip
FIELDS = {
    "from": "from_ns", "until": "until_ns", "latency": "latency_ns", "jitter": "jitter_ns", "gap": "gap_ns", "join": "join_ns",
}  # fmt: skip
"""The fields of `Fault` that have another name than their key."""
_KEYS = {field: key for key, field in FIELDS.items()}


def key_of(field: str) -> str:
    """The key of a field of `Fault`."""
    return _KEYS.get(field, field)


def fault_of(row: Mapping[str, Any]) -> Fault:
    """The fault of a row that has been read, by its keys."""
    written = {FIELDS.get(key, key): value for key, value in row.items() if key != "kind" and value is not None}
    base = NAMED[row["kind"]].fault if row["kind"] else NO_FAULT
    return Fault(**{name: written.get(name, getattr(base, name)) for name in Fault.__dataclass_fields__})


def check_faults(reading: Reading, rows: Sequence[Mapping[str, Any]]) -> None:
    """Reports what makes a row say nothing, or nothing clear."""
    for number, row in enumerate(rows):
        for field in NAMED[row["kind"]].needed if row["kind"] else ():
            if row[key := key_of(field)] is None:
                meaning = FAULT[key].meaning
                reading.report("P0104", ("fault", number), f"fault {number + 1}.{key} is missing: kind {row['kind']}", meaning)
        fault = fault_of(row)
        for key in ("gap", "random_cut"):
            if row[key] is not None and not fault.segment_bytes:
                reading.report("P0103", ("fault", number, key), f"fault {number + 1}.{key} does nothing without segment_bytes",
                               FAULT["segment_bytes"].meaning)
        if fault.from_ns >= fault.until_ns:
            reading.report("P0103", ("fault", number), f"fault {number + 1} ends before it begins: until is not after from")
        if fault.from_scan >= fault.until_scan:
            reading.report("P0103", ("fault", number),
                           f"fault {number + 1} ends before it begins: until_scan is not after from_scan")


def impossible_on_the_host(faults: Iterable[Fault], doors: Iterable[Peer]) -> Iterator[tuple[int, str]]:
    """Rows that cannot be done with real connections: number and message."""
    known = list(doors)
    for number, fault in enumerate(faults):
        door = next((door for door in known if fault.peer.host == door.host and fits(fault.peer, door)), None)
        if door and fault.error not in ("", "ECONNREFUSED") and not fault.silent:
            yield number, (f"fault {number + 1}: callers of the door {door} cannot be given {fault.error} with real connections, "
                           "only ECONNREFUSED, or silent = true")


def page() -> str:
    """The page of faults: every kind with what it sets, every key."""
    lines = [
        "# Faults of a network", "",
        "A row of fbvm.toml, [[fault]], says what befalls connections with an endpoint, in memory as with real connections",
        '(net = "tcp"), of peers as of doors. The first row that fits and is in force counts.', "",
        "    [[fault]]", '    kind = "slow"', '    latency = "80ms"', '    peer = "192.168.250.1:502"', '    from = "2s"', "",
        "## Kinds", "",
    ]  # fmt: skip
    for name, kind in NAMED.items():
        needed = [key_of(field) for field in kind.needed]
        needs = f"; needs {', '.join(needed)}" if needed else ""
        lines.append(f"{name:<13}{kind.meaning}{needs}")
        lines.append(" " * 13 + ", ".join(f"{key} = {value}" for key, value in settings(kind.fault, needed)))
    lines += ["", "## Keys", ""]
    for name, key in FAULT.items():
        lines.append(f"{name:<19}{key.meaning}")
    lines += ["", "From Python: network.faults is a list of rows, which may be changed while PLCs run.", "",
              "    from fbvm.net.faults import fault",
              '    plant.network.faults.append(fault("slow", latency_ns=80_000_000))']  # fmt: skip
    return "\n".join(lines)


def settings(fault: Fault, without: Iterable[str] = ()) -> Iterator[tuple[str, str]]:
    """The keys that a fault sets, and their values as they are written; `without` those that stand for an example only."""
    for field in Fault.__dataclass_fields__:
        value, key = getattr(fault, field), key_of(field)
        if value == getattr(NO_FAULT, field):
            continue
        if key in without:
            yield key, "..."
        elif isinstance(value, bool):
            yield key, str(value).lower()
        elif field.endswith("_ns"):
            yield key, f'"{show_time(value).removeprefix("T#")}"'
        else:
            yield key, f'"{value}"' if isinstance(value, str) else str(value)
