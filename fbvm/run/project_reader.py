"""Reads TOML by a table of keys.  Returns values of the right kind, or diagnostics that say which key is wrong and what to write.

Knows nothing of PLCs; the tables are in `project`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.digits import whole_number
from fbvm.base.toml import TomlError, load_toml
from fbvm.net.faults import FOREVER
from fbvm.run.toml_keys import Path, span
from fbvm.watch.values import parse_time_ns, show_time
from fbvm.wire.link import Peer

REQUIRED = object()
"""The default of a key that has none."""


@dataclass(frozen=True)
class Kind:
    """A kind of value: what people call it, and the functions that make the value of what is written, and the other way.

    `value` raises ValueError with what to write instead."""

    called: str
    value: Callable[[object], Any]
    written: Callable[[Any], str] = str


@dataclass(frozen=True)
class Key:
    """A row: `kind` of its value; or the table of keys of a table, of each table of an array (`many`), or of each table by
    its name (`named`).  `meaning` is a sentence for messages and for the page of all keys."""

    kind: Kind | Mapping[str, Key]
    meaning: str
    default: Any = REQUIRED
    many: bool = False
    named: bool = False

    @property
    def usual(self) -> str:
        """The default as people write it; "" for a key that has none, or none that can be written."""
        if not isinstance(self.kind, Kind) or not isinstance(self.default, str | int) or self.default == FOREVER:
            return ""
        return self.kind.written(self.default)


Keys = Mapping[str, Key]


@dataclass
class Reading:
    """One file that is being read, of `kind`; its mistakes come into `diagnostics`."""

    source: Source
    diagnostics: list[Diagnostic] = field(default_factory=list)
    kind: str = "project"

    def load(self) -> dict[str, Any]:
        """The file as Python reads TOML; {} and a diagnostic if it is no TOML."""
        try:
            return load_toml(self.source.text)
        except TomlError as error:
            starts = self.source.line_starts
            start = starts[min(error.line, len(starts)) - 1] + error.column - 1
            hint = "texts stand in quotes, tables begin with [name]; see https://toml.io"
            self.diagnostics.append(Diagnostic("P0101", self.source, start, start + 1, str(error).lower(), hint))
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
                self.report("P0102", (*path, name), f"{_called((*path, name))} is no key of a {self.kind}", hint)
        return {name: self._value(written, name, key, (*path, name)) for name, key in keys.items()}

    def _value(self, table: Mapping[str, Any], name: str, key: Key, path: Path) -> Any:
        if name not in table:
            if key.default is REQUIRED:
                self.report("P0104", path, f"{_called(path)} is missing", key.meaning)
            return key.default
        written = table[name]
        if not isinstance(key.kind, Kind):
            return self._tables(written, key, path)
        try:
            return key.kind.value(written)
        except ValueError as error:
            self.report("P0103", path, f"{_called(path)}: {error}", key.meaning)
            return key.default

    def _tables(self, written: Any, key: Key, path: Path) -> Any:
        assert not isinstance(key.kind, Kind)
        if key.many:
            if not isinstance(written, list):
                self.report("P0103", path, f"{_called(path)} is no list of tables", f"write [[{_called(path)}]]")
                return key.default
            return [self.table(row, key.kind, (*path, number)) for number, row in enumerate(written)]
        if key.named:
            return self._named_tables(written, key.kind, path)
        return self.table(written, key.kind, path)

    def _named_tables(self, written: Any, keys: Keys, path: Path) -> dict[str, Any]:
        """Tables to which the user gives names, such as [plc.NAME]."""
        hint = f"write [{_called(path)}.NAME], with a name of your choice, and its keys below"
        if not isinstance(written, dict):
            self.report("P0103", path, f"{_called(path)} is no table", hint)
            return {}
        nameless = [name for name, row in written.items() if name in keys and not isinstance(row, dict)]
        if nameless:
            self.report("P0103", path, f"{', '.join(nameless)}: of which {_called(path)}?", hint)
        return {name: self.table(row, keys, (*path, name)) for name, row in written.items() if name not in nameless}


def _called(path: Path) -> str:
    """A path as people write it; tables of an array count from 1."""
    text = ""
    for part in path:
        text += f" {part + 1}" if isinstance(part, int) else f".{part}" if text else part
    return text


# --- kinds --------------------------------------------------------------------------------------------------------------


def _text(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"{value!r} is no text; write it in quotes")
    return value


def _texts(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or not all(isinstance(item, str) and item for item in value):
        raise ValueError(f'{value!r} is no list of texts; write ["one", "other"]')
    return tuple(value)


def _texts_by_name(value: object) -> dict[str, str]:
    if not isinstance(value, dict) or not value or not all(isinstance(item, str) and item for item in value.values()):
        raise ValueError(f'{value!r} is no table of texts; write {{ one = "this", other = "that" }}')
    return dict(value)


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{value!r} is neither true nor false")
    return value


def _time_ns(value: object) -> int:
    passed_ns = _moment_ns(value)
    if not passed_ns:
        raise ValueError(f"{value!r} is no time that can pass")
    return passed_ns


def _written_time(passed_ns: int) -> str:
    return show_time(passed_ns).removeprefix("T#")


def _moment_ns(value: object) -> int:
    if not isinstance(value, str):
        raise ValueError(f'{value!r} is no time; write it with its unit in quotes: "10ms"')
    passed_ns = parse_time_ns(value)
    if passed_ns < 0:
        raise ValueError(f"{value!r} is before power-on")
    return passed_ns


def _ip(value: object) -> str:
    parts = value.split(".") if isinstance(value, str) else []
    if len(parts) != 4 or not all(part.isdecimal() and whole_number(part) <= 255 for part in parts):
        raise ValueError(f'{value!r} is no IPv4 address; write "192.168.250.21"')
    return str(value)


def _endpoint(value: object) -> Peer:
    address, port = _parted(value, "192.168.250.1:502")
    return Peer(_ip(address), port)


def _parted(value: object, example: str) -> tuple[str, int]:
    before, colon, port = value.rpartition(":") if isinstance(value, str) else ("", "", "")
    if not colon or not before or not port.isdecimal() or whole_number(port) > 65535:
        raise ValueError(f'{value!r} is no address and port; write "{example}"')
    return before, whole_number(port)


def whole(first: int, last: int) -> Kind:
    """A whole number from first to last."""

    def value_of(value: object) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not first <= value <= last:
            raise ValueError(f"{value!r} is no whole number from {first} to {last}")
        return value

    return Kind(f"a whole number from {first} to {last}" if last < 1 << 62 else f"a whole number from {first}", value_of)


def time_between(shortest_ns: int, longest_ns: int, spoken: str) -> Kind:
    """A time in these bounds, which `spoken` names."""

    def value_of(value: object) -> int:
        found = _time_ns(value)
        if not shortest_ns <= found <= longest_ns:
            raise ValueError(f"{value!r} is no time {spoken}")
        return found

    return Kind(f"a time {spoken}", value_of, _written_time)


def one_of(names: Sequence[str]) -> Kind:
    """One of these texts."""

    def value_of(value: object) -> str:
        if value not in names:
            raise ValueError(f"{value!r} is none of {', '.join(names)}")
        return str(value)

    return Kind(" or ".join(f'"{name}"' for name in names), value_of)


def one_or_more(kind: Kind) -> Kind:
    """A value of a kind, or a list of such values; it becomes a tuple."""

    def value_of(value: object) -> tuple[Any, ...]:
        if isinstance(value, list) and not value:
            raise ValueError("a list without a value says nothing")
        return tuple(kind.value(item) for item in (value if isinstance(value, list) else [value]))

    return Kind(f"{kind.called}, or a list of such", value_of)


def first_and_last(kind: Kind) -> Kind:
    """A value of a kind, or a list of two, the first and the last of a range."""

    def value_of(value: object) -> tuple[Any, Any]:
        found = [kind.value(item) for item in (value if isinstance(value, list) else [value, value])]
        if len(found) != 2 or found[0] > found[1]:
            raise ValueError(f"{value!r} is no range; write [first, last]")
        return found[0], found[1]

    return Kind(f"{kind.called}, or a list of two, the first and the last", value_of)


text = Kind("a text", _text)
texts = Kind("a list of texts", _texts)
texts_by_name = Kind("a table of texts", _texts_by_name)
flag = Kind("true or false", _flag, lambda on: str(on).lower())
anything = Kind("a value", lambda value: value)
time_ns = Kind('a time above 0, such as "10ms"', _time_ns, _written_time)
moment_ns = Kind('a time, such as "2s" or "0s"', _moment_ns, _written_time)
ip = Kind('an IPv4 address, such as "192.168.250.21"', _ip)
endpoint = Kind('an IPv4 address and a port, such as "192.168.250.1:502"', _endpoint)
host = Kind('an address or a name of the host and a port, such as "127.0.0.1:15020"',
            lambda value: _parted(value, "127.0.0.1:15020"))
