"""`fbvm.toml` in an editor: what is wrong with it, what can be written in it, what its keys mean."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.dialects import DIALECTS
from fbvm.run.project import PROJECT, read_project
from fbvm.run.project_reader import Key, Keys, Kind

_HEADER = re.compile(r"^[ \t]*\[\[?\s*([^\]\n]+?)\s*\]\]?", re.M)
_KEY = re.compile(r"[ \t]*([\w-]+)")


def is_dialect(name: object) -> bool:
    """True for the name of a dialect."""
    return isinstance(name, str) and name in DIALECTS


def diagnostics(path: Path, text: str | None) -> list[Diagnostic]:
    """What is wrong with a project file that has this text, None: as it is on disk."""
    found = read_project(path, allow_outside=True, text=text)
    return found if isinstance(found, list) else []


def keys_at(text: str, offset: int) -> Keys:
    """The keys of the table in which a place lies; {} where it has none, such as in `[plc]` without a name."""
    header = None
    for header in _HEADER.finditer(text, 0, offset):  # noqa: B007
        pass
    keys: Keys = PROJECT
    named = False
    for name in [part.strip().strip("\"'") for part in header[1].split(".")] if header is not None else []:
        if named:
            named = False
            continue
        key = keys.get(name)
        if key is None or isinstance(key.kind, Kind):
            return {}
        keys, named = key.kind, key.named
    return {} if named else keys


def completions(text: str, offset: int) -> Iterator[tuple[str, str, str]]:
    """What can be written at a place: label, its meaning, and the text that is inserted."""
    line = text[text.rfind("\n", 0, offset) + 1:offset]
    if line.lstrip().startswith("["):
        yield from _headers("", PROJECT)
    elif "=" not in line:
        for name, key in keys_at(text, offset).items():
            if isinstance(key.kind, Kind):
                yield name, f"{key.meaning}\n\n{key.kind.called}", f"{name} = "
        if not line.strip():
            yield from (("[" + label, meaning, "[" + inserted) for label, meaning, inserted in _headers("", PROJECT))
    else:
        yield from _values(keys_at(text, offset), line)


def _values(keys: Keys, line: str) -> Iterator[tuple[str, str, str]]:
    """The values of a key that has only some."""
    name = _KEY.match(line)
    key = keys.get(name[1]) if name is not None else None
    if name is None or key is None or not isinstance(key.kind, Kind):
        return
    words: Sequence[str] = ("true", "false") if key.kind.called == "true or false" else re.findall(r'"([^"]+)"', key.kind.called)
    if name[1] == "dialect":
        words = tuple(DIALECTS)
    quoted = '"' if words != ("true", "false") and line.count('"') % 2 == 0 else ""
    yield from ((word, key.meaning, f"{quoted}{word}{quoted}") for word in words)


def _headers(path: str, keys: Keys) -> Iterator[tuple[str, str, str]]:
    """The tables of the file, as they are written behind the first bracket."""
    for name, key in keys.items():
        if isinstance(key.kind, Kind):
            continue
        full = f"{path}{name}" + (".NAME" if key.named else "")
        text = f"[{full}]]" if key.many else f"{full}]"
        yield text, key.meaning, text
        yield from _headers(f"{full}.", key.kind)


def meaning_at(text: str, offset: int) -> str:
    """What the key on the line of a place means; "" if there is none."""
    start = text.rfind("\n", 0, offset) + 1
    line = text[start:(text.find("\n", offset) + len(text) + 1) % (len(text) + 1)]
    name = _KEY.match(line)
    key: Key | None = keys_at(text, start).get(name[1]) if name is not None else None
    if name is None or key is None:
        return ""
    kind = f"\n\n{key.kind.called}" if isinstance(key.kind, Kind) else ""
    default = f"\n\nWithout it: {key.usual}" if key.usual else ""
    return f"**{name[1]}**: {key.meaning}{kind}{default}"
