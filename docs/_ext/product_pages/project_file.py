"""The page of `fbvm.toml`: every table and key, made of the tables by which the file is read."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

from fbvm.machine.backplane import KINDS as UNIT_KINDS
from fbvm.machine.backplane import UNITS
from fbvm.net.faults import NAMED
from fbvm.run import project
from fbvm.run.fault_rows import key_of, settings
from fbvm.run.project_reader import REQUIRED, Key, Keys, Kind
from fbvm.watch.values import show_time
from product_pages.markdown import code, fence, page, table

NAME = "reference/project-file"


def pages() -> dict[str, str]:
    """The page of all keys."""
    head, _, example = (inspect.getdoc(project) or "").partition("\n\n")
    parts = [
        "# Project file", head,
        "`fbvm run`, `fbvm check` and `fbvm step` take a folder with an `fbvm.toml`, or that file. Every key is read by a "
        "table of the product, from which this page is made; a wrong key or value is told with its line and what to write.",
        fence(inspect.cleandoc(example), "toml"),
    ]  # fmt: skip
    for name, key in project.PROJECT.items():
        parts += _table(name, key, name)
    parts += ["## Keys of a unit by its type", *_units(), "## Kinds of faults",
              "`kind` of a `[[fault]]` names one of these; keys beside it set or change single values. `fbvm explain fault` "
              "prints them.",
              table(("kind", "what happens, and what it sets"), [(code(kind), _fault(kind)) for kind in NAMED])]  # fmt: skip
    return {NAME: page(*parts)}


def all_keys(table_of: Keys = project.PROJECT, path: str = "") -> Iterator[tuple[str, Key]]:
    """Every key that has a value, by its path such as `plc.unit.address`."""
    for name, key in table_of.items():
        if isinstance(key.kind, Kind):
            yield f"{path}{name}", key
        else:
            yield from all_keys(key.kind, f"{path}{name}.")


def _table(name: str, key: Key, path: str) -> list[str]:
    """The section of a table of the file, and those of the tables within it."""
    assert not isinstance(key.kind, Kind)
    path = f"{name}.NAME" if key.named else path
    heading = f"[[{path}]]" if key.many else f"[{path}]"
    plain = [(one, row, row.kind.called) for one, row in key.kind.items() if isinstance(row.kind, Kind)]
    rows = [(code(one), called, _default(row), row.meaning) for one, row, called in plain]
    parts = [f"## {heading}", key.meaning, table(("key", "value", "without it", "meaning"), rows)]
    for one, row in key.kind.items():
        if not isinstance(row.kind, Kind):
            parts += _table(one, row, f"{path}.{one}")
    return parts


def _default(key: Key) -> str:
    return "**needed**" if key.default is REQUIRED else code(key.usual) if key.usual else ""


def _units() -> Iterator[str]:
    for kind, (name, arguments) in UNIT_KINDS.items():
        parameters = inspect.signature(UNITS[name]).parameters
        rows = [(code(key), _shown(argument, parameters[argument].default)) for key, argument in arguments.items()]
        yield f"Type {code(kind)}:"
        yield table(("key", "without it"), rows)


def _shown(argument: str, value: object) -> str:
    is_time = argument.endswith("_ns") and isinstance(value, int)
    return code(show_time(value).removeprefix("T#") if is_time else str(value).lower() if isinstance(value, bool) else value)


def _fault(kind: str) -> str:
    """What a kind of fault sets, in the keys of the file; `...` stands for what a row has to say itself."""
    needed = [key_of(field) for field in NAMED[kind].needed]
    return f"{NAMED[kind].meaning}: " + ", ".join(f"`{key} = {value}`" for key, value in settings(NAMED[kind].fault, needed))
