"""Plain data as bytes and back: JSON with bytes in it, and behind it pages of memory."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, get_args

from fbvm.units.etn21.fins.state import Connection, FinsState
from fbvm.wire.link import Event, Peer, Request

LENGTH_BYTES = 4
LARGEST = 1 << 62
"""No time, number of a scan or step budget is larger."""


def _packed(item: object) -> object:
    if isinstance(item, bytes):
        return {"bytes": item.hex()}
    raise TypeError(f"{item!r} is no part of a recording")


def _bytes(row: dict[str, Any]) -> Any:
    return bytes.fromhex(row["bytes"]) if row.keys() == {"bytes"} else row


_dump = json.JSONEncoder(separators=(",", ":"), check_circular=False, default=_packed).encode


def dump(data: object) -> bytes:
    """Plain data as bytes; bytes may be among them."""
    return _dump(data).encode()


def load(payload: bytes) -> Any:
    """The data that `dump` was given.  Raises ValueError, RecursionError, KeyError."""
    return json.loads(payload, object_hook=_bytes if b'{"bytes":' in payload else None)  # a hook takes as long as the rest


def payload_of(data: object, pages: Sequence[bytes] = ()) -> bytes:
    """The size of the data as JSON, the JSON, the pages."""
    text = dump(data)
    return b"".join((len(text).to_bytes(LENGTH_BYTES, "little"), text, *pages))


def parts_of(payload: bytes) -> tuple[Any, memoryview]:
    """The data of a payload, and what is behind them.  Raises as `load`."""
    behind = LENGTH_BYTES + int.from_bytes(payload[:LENGTH_BYTES], "little")
    return load(payload[LENGTH_BYTES:behind]), memoryview(payload)[behind:]


def number(value: Any, most: int = LARGEST) -> int:
    """A whole number from 0 on.  Raises ValueError for anything else."""
    if type(value) is not int or not 0 <= value <= most:
        raise ValueError(f"{value!r} is no number from 0 to {most}")
    return value


CLASSES: dict[str, Any] = {kind.__name__: kind for kind in (*get_args(Event), *get_args(Request), Peer, FinsState, Connection)}
"""What units keep beside numbers and texts, by name."""
_FIELDS = {name: tuple(row.name for row in fields(kind)) for name, kind in CLASSES.items()}
_COLLECTIONS: dict[str, Callable[[Any], Any]] = {"tuple": tuple, "list": list, "set": set}


def tagged(item: Any) -> Any:
    """What units keep beside their memory, for JSON: collections and rows get a tag.

    Raises TypeError for anything else."""
    if item is None or isinstance(item, bool | int | float | str | bytes):
        return item
    name = type(item).__name__
    if name in _COLLECTIONS:
        return {name: [tagged(part) for part in (sorted(item) if isinstance(item, set) else item)]}
    if isinstance(item, dict):
        return {"dict": [[tagged(key), tagged(value)] for key, value in item.items()]}
    if CLASSES.get(name) is type(item):
        return {name: [tagged(getattr(item, field)) for field in _FIELDS[name]]}
    raise TypeError(f"{item!r} is no state of a unit that can be written")


def untagged(item: Any) -> Any:
    """What `tagged` was given.  Raises errors of several classes for other data."""
    if not isinstance(item, dict):
        return item
    ((tag, inside),) = item.items()
    if tag == "dict":
        return {untagged(key): untagged(value) for key, value in inside}
    parts = [untagged(part) for part in inside]
    return _COLLECTIONS[tag](parts) if tag in _COLLECTIONS else CLASSES[tag](*parts)
