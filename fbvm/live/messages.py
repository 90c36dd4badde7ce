"""The messages between a page and its PLCs: JSON objects, one in a WebSocket message.  docs/reference/live-protocol.md.

A page sends `{"id": 7, "do": "write", "plc": "pump", "name": "Main.n", "value": "5"}` and gets `{"re": 7, "ok": {...}}` or
`{"re": 7, "error": "..."}`.  Between them come updates, `{"update": {...}}`, of which one is under way at most: the page asks
for the next by `{"do": "ready"}`."""

from __future__ import annotations

import json
import re
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

VERSION = 1
"""Grows when a message changes its meaning; new actions and new fields may come without."""
MOST_MESSAGE_BYTES = 64 << 10
"""Of a message of a page; a longer one ends its connection."""
MOST_TEXT = 4096
"""Characters of a text in a message."""
MOST_NAMES = 1000
"""Names that a page sees at once."""
PIECE = 50
"""Items of a long list or mapping that are written as JSON in one step."""
NUMBER = (int, float)
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


@dataclass(frozen=True)
class Action:
    """What a page may ask for: the fields of its message with their types, those that may be left out, and whether it changes
    anything, so that `--read-only` refuses it."""

    fields: Mapping[str, type | tuple[type, ...]]
    optional: Mapping[str, type | tuple[type, ...]]
    changes: bool = False


def _asks(**fields: type | tuple[type, ...]) -> Action:
    return Action(fields, {})


def _does(**fields: type | tuple[type, ...]) -> Action:
    return Action(fields, {}, True)


ACTIONS: dict[str, Action] = {
    "hello": Action({}, {"version": int}),
    "ready": _asks(),
    "look": Action({"plc": str}, {"names": list, "instance": str, "memory": str, "first": int, "units": bool,
                                  "network": bool, "scan": bool, "pictures": bool,
                                  "times": bool, "plant": bool}),
    "program": _asks(plc=str),
    "source": _asks(plc=str, instance=str),
    "search": _asks(plc=str, text=str),
    "parts": _asks(plc=str, name=str),
    "history": _asks(plc=str, names=list, scans=int),
    "why": _asks(plc=str, name=str),
    "test": _asks(plc=str),
    "view": Action({"plc": str}, {"scan": int, "future": int}),
    "predict": _does(names=list, values=list),
    "check": _does(),
    "solution": _asks(),
    "capture": _asks(plc=str),
    "write": Action({"plc": str, "name": str, "value": str}, {"held": bool}, True),
    "force": _does(plc=str, name=str, value=str),
    "release": Action({"plc": str}, {"name": str}, True),
    "group": _does(name=str, names=list),
    "run": _does(),
    "pause": _does(),
    "step": _does(scans=int),
    "statement": _does(plc=str),
    "break": Action({"plc": str, "kind": str, "where": str}, {"when": str, "hits": str}, True),
    "unbreak": Action({"plc": str}, {"number": int}, True),
    "speed": _does(factor=NUMBER),
    "mode": _does(plc=str, mode=str),
    "start": _does(plc=str, kind=str),
    "restart": _does(),
    "branch": _does(plc=str),
    "cable": _does(plc=str, unit=str, plugged=bool),
    "fault": Action({"kind": str}, {"peer": str, "percent": int, "time": str}, True),
    "mend": Action({}, {"number": int}, True),
}  # fmt: skip
"""All actions by name."""


class MessageError(ValueError):
    """A message that is none, or an action that cannot be done; the text says why, and is shown to the user."""


def parse(text: str) -> dict[str, Any]:
    """The message of a page, checked: `do` is known, its fields are there and have their types.  Raises MessageError."""
    try:
        message = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise MessageError("the message is not JSON") from None
    if _SURROGATE.search(text):
        try:
            dump({"": message}).encode()
        except UnicodeEncodeError:
            raise MessageError("a text has half a surrogate pair, which is no character") from None
    if not isinstance(message, dict) or not isinstance(message.get("do"), str):
        raise MessageError('a message is an object with "do"')
    action = ACTIONS.get(message["do"])
    if action is None:
        raise MessageError(f"there is no action {message['do'][:40]!r}; there are {', '.join(ACTIONS)}")
    for name, kind in action.fields.items():
        if name not in message:
            raise MessageError(f"{message['do']} needs {name}")
        _check(message["do"], name, message[name], kind)
    for name, kind in action.optional.items():
        if name in message and message[name] is not None:
            _check(message["do"], name, message[name], kind)
    if unknown := set(message) - {"id", "do", *action.fields, *action.optional}:
        raise MessageError(f"{message['do']} has no {sorted(unknown)[0][:40]}")
    return message


def _refuse(constant: str) -> object:
    raise ValueError(constant)


def _check(action: str, name: str, value: object, kind: type | tuple[type, ...]) -> None:
    wanted = kind if isinstance(kind, tuple) else (kind,)
    if not isinstance(value, wanted) or isinstance(value, bool) and bool not in wanted:
        raise MessageError(f"{action}: {name} is a {' or '.join(one.__name__ for one in wanted)}")
    if isinstance(value, str) and len(value) > MOST_TEXT:
        raise MessageError(f"{action}: {name} has {len(value)} characters, more than {MOST_TEXT}")
    if isinstance(value, int | float) and abs(value) >= 1 << 62:  # 1e999 is infinite
        raise MessageError(f"{action}: {name} is too large")
    if isinstance(value, list) and (len(value) > MOST_NAMES or not all(isinstance(one, str) and len(one) <= MOST_TEXT
                                                                      for one in value)):  # fmt: skip
        raise MessageError(f"{action}: {name} is a list of at most {MOST_NAMES} texts")


def dump(message: Mapping[str, Any]) -> str:
    """A message as it is sent."""
    return _dumped(message)


def _dumped(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def dump_in_steps(message: Mapping[str, Any]) -> Generator[None, None, str]:
    """As `dump`, in short steps: long lists and mappings in it are written in pieces."""
    pieces: list[str] = []
    for name, value in message.items():
        pieces.append(f"{',' if pieces else ''}{json.dumps(name)}:")
        if not isinstance(value, Mapping | list) or len(value) <= PIECE and not _holds_long(value):
            pieces.append(_dumped(value))
            continue
        if isinstance(value, Mapping) and _holds_long(value):
            pieces.append((yield from dump_in_steps(value)))
            continue
        items = iter(value.items() if isinstance(value, Mapping) else value)
        opening, closing = "{}" if isinstance(value, Mapping) else "[]"
        pieces.append(opening)
        is_first = True
        while part := list(islice(items, PIECE)):
            pieces.append(("" if is_first else ",") + _dumped(dict(part) if isinstance(value, Mapping) else part)[1:-1])
            is_first = False
            yield
        pieces.append(closing)
    return f"{{{''.join(pieces)}}}"


def _holds_long(value: Any) -> bool:
    """True for a mapping in which a list or a mapping is long."""
    return isinstance(value, Mapping) and len(value) <= PIECE and any(
        isinstance(one, Mapping | list) and len(one) > PIECE for one in value.values())  # fmt: skip


def message_id(text: str) -> int | None:
    """The id of a message that cannot be understood, as far as it has one, so that its page learns which it was."""
    try:
        found = json.loads(text).get("id")
    except (ValueError, AttributeError, RecursionError):
        return None
    return found if type(found) is int and abs(found) < 1 << 53 else None
