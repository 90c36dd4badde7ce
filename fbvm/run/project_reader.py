"""Reads TOML by a table of keys.  Returns values of the right kind, or diagnostics that say which key is wrong and what to write.

Knows nothing of PLCs; the tables are in `project`."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.run.toml_keys import Path, span
from fbvm.watch.values import parse_time_ns
from fbvm.wire.link import Peer

REQUIRED = object()
"""The default of a key that has none."""


@dataclass(frozen=True)
class Key:
    """A row of a table of keys.

    `kind` converts what is written to the value, or raises ValueError with what to write.  Or it is a table of keys itself: of
    a table, of each table in an array (`many`), or of each table by its name (`named`)."""

    kind: Callable[[Any], Any] | Mapping[str, Key]
    default: Any = REQUIRED
    many: bool = False
    named: bool = False


Keys = Mapping[str, Key]


@dataclass
class Reading:
    """One file that is being read; its mistakes come into `diagnostics`."""

    source: Source
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def load(self) -> dict[str, Any]:
        """The file as Python reads TOML; {} and a diagnostic if it is no TOML."""
        try:
            return tomllib.loads(self.source.text)
        except tomllib.TOMLDecodeError as error:
            what, _, where = str(error).rpartition(" (at ")
            line, column = [int(part) for part in where.rstrip(")").replace("line ", "").split(", column ")] \
                if where.startswith("line ") else (len(self.source.line_starts), 1)  # fmt: skip
            start = self.source.line_starts[min(line, len(self.source.line_starts)) - 1] + column - 1
            hint = "texts stand in quotes, tables begin with [name]; see https://toml.io"
            self.diagnostics.append(Diagnostic("P0101", self.source, start, start + 1, (what or str(error)).lower(), hint))
            return {}

    def report(self, code: str, path: Path, message: str, hint: str = "") -> None:
        """Adds a diagnostic about what stands at a path."""
        self.diagnostics.append(Diagnostic(code, self.source, *span(self.source, path), message, hint))

    def table(self, written: object, keys: Keys, path: Path = ()) -> dict[str, Any]:
        """The values of a table by its keys, with the default where nothing usable is written."""
        if not isinstance(written, dict):
            self.report("P0103", path, f"{_called(path)} is no table", f"write [{_called(path)}] and its keys below")
            return {name: key.default for name, key in keys.items()}
        for name in written:
            if name not in keys:
                near = get_close_matches(name, keys, 1)
                hint = f"did you mean {near[0]}?" if near else f"keys are {', '.join(keys)}"
                self.report("P0102", (*path, name), f"{_called((*path, name))} is no key of a project", hint)
        return {name: self._value(written, name, key, (*path, name)) for name, key in keys.items()}

    def _value(self, table: Mapping[str, Any], name: str, key: Key, path: Path) -> Any:
        if name not in table:
            if key.default is REQUIRED:
                self.report("P0104", path, f"{_called(path)} is missing")
            return key.default
        written = table[name]
        if not callable(key.kind):
            return self._tables(written, key, path)
        try:
            return key.kind(written)
        except ValueError as error:
            self.report("P0103", path, f"{_called(path)}: {error}")
            return key.default

    def _tables(self, written: Any, key: Key, path: Path) -> Any:
        assert not callable(key.kind)
        if key.many:
            if not isinstance(written, list):
                self.report("P0103", path, f"{_called(path)} is no list of tables", f"write [[{_called(path)}]]")
                return key.default
            return [self.table(row, key.kind, (*path, number)) for number, row in enumerate(written)]
        if key.named and isinstance(written, dict):
            return {name: self.table(row, key.kind, (*path, name)) for name, row in written.items()}
        return self.table(written, key.kind, path)


def _called(path: Path) -> str:
    """A path as people write it; tables of an array count from 1."""
    text = ""
    for part in path:
        text += f" {part + 1}" if isinstance(part, int) else f".{part}" if text else part
    return text


# --- kinds --------------------------------------------------------------------------------------------------------------


def text(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"{value!r} is no text; write it in quotes")
    return value


def texts(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(item, str) and item for item in value):
        raise ValueError(f'{value!r} is no list of texts; write ["one", "other"]')
    return tuple(value)


def flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{value!r} is neither true nor false")
    return value


def anything(value: object) -> object:
    return value


def time_ns(value: object) -> int:
    """A time longer than 0, in nanoseconds.  Raises ValueError.

    >>> time_ns("10ms")
    10000000
    """
    passed_ns = moment_ns(value)
    if not passed_ns:
        raise ValueError(f"{value!r} is no time that can pass")
    return passed_ns


def moment_ns(value: object) -> int:
    """A time from power-on, 0 or more, in nanoseconds: `"2s"`.  Raises ValueError."""
    if not isinstance(value, str):
        raise ValueError(f'{value!r} is no time; write it with its unit in quotes: "10ms"')
    passed_ns = parse_time_ns(value)
    if passed_ns < 0:
        raise ValueError(f"{value!r} is before power-on")
    return passed_ns


def whole(first: int, last: int) -> Callable[[object], int]:
    """A whole number from first to last."""

    def kind(value: object) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not first <= value <= last:
            raise ValueError(f"{value!r} is no whole number from {first} to {last}")
        return value

    return kind


def one_of(names: Sequence[str]) -> Callable[[object], str]:
    """One of these texts."""

    def kind(value: object) -> str:
        if value not in names:
            raise ValueError(f"{value!r} is none of {', '.join(names)}")
        return str(value)

    return kind


def ip(value: object) -> str:
    """An IPv4 address: `"192.168.250.21"`.  Raises ValueError."""
    parts = value.split(".") if isinstance(value, str) else []
    if len(parts) != 4 or not all(part.isdecimal() and int(part) <= 255 for part in parts):
        raise ValueError(f'{value!r} is no IPv4 address; write "192.168.250.21"')
    return str(value)


def endpoint(value: object) -> Peer:
    """An IPv4 address and a port: `"192.168.250.1:502"`.  Raises ValueError."""
    host, port = _parted(value, "192.168.250.1:502")
    return Peer(ip(host), port)


def host(value: object) -> tuple[str, int]:
    """An address or name of the host's network, and a port: `"127.0.0.1:15020"`.  Raises ValueError."""
    return _parted(value, "127.0.0.1:15020")


def _parted(value: object, example: str) -> tuple[str, int]:
    before, colon, port = value.rpartition(":") if isinstance(value, str) else ("", "", "")
    if not colon or not before or not port.isdecimal() or int(port) > 65535:
        raise ValueError(f'{value!r} is no address and port; write "{example}"')
    return before, int(port)
