"""Types of arguments that name files: a misspelt name gets a suggestion, and a file that is no source is told what it is."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click

from fbvm.base.files import Unreadable, folders_below, reason, resolved

_HEAD_BYTES = 4_000
_SOURCES = (b"plcopen.org/xml/tc6", b"<tcplcobject", b"<tcsmproject", b"developer/msbuild")
"""What documents in PLCopen XML, objects, systems and projects of TwinCAT have among their first bytes, in lower case: they are
taken as the sources within them."""
_FORMS = (
    ((b"fbvmrec",), "a recording", "`fbvm chart`, `table`, `why` and `step` look at it, `fbvm replay` does its run again"),
    ((b"fbvmtrc",), "a trace", "`fbvm chart`, `fbvm table` and `fbvm why` look at it"),
    ((b'{"journal"',), "a journal", "`fbvm replay` does its run again"),
    ((b"<!doctype html", b"<html"), "a page", "open it in a browser"),
    ((b"<?xml", b"<project"), "XML", "`fbvm import FILE -o DIR` makes sources of a PLCopen project"),
    ((b"%pdf", b"pk\x03\x04", b"\x1f\x8b"), "no text", "unpack or export the sources from it"),
)
"""How files begin that are no sources, in lower case: what such a file is, and what to do with it."""
_SUFFIXES = {".html": 3, ".htm": 3, ".xml": 4}
"""Files that are known by their names, by the row of `_FORMS`."""


def suggestion(word: str, known: Iterable[str]) -> str:
    """`; did you mean run or learn?` for a misspelt word, "" if no known one is like it.

    >>> suggestion("chek", ["check", "chart", "run"])
    '; did you mean check?'
    """
    import difflib  # a command that is spelt right starts without it

    shown = {each.lower(): each for each in known}
    close = difflib.get_close_matches(word.lower(), list(shown), n=2, cutoff=0.6)
    return f"; did you mean {' or '.join(shown[each] for each in close)}?" if close else ""


class ExistingPath(click.Path):
    """A path that exists; the message about one that does not names the files that are called alike."""

    def __init__(self, **options: Any) -> None:
        super().__init__(exists=True, path_type=Path, **options)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path.  Raises BadParameter."""
        if not os.path.lexists(value) and not (self.allow_dash and str(value) == "-"):
            what = "File" if not self.dir_okay else "Directory" if not self.file_okay else "Path"
            self.fail(f"{what} {str(value)!r} does not exist{_alike(Path(value), self.file_okay)}", param, ctx)
        return super().convert(value, param, ctx)


class SourcePath(ExistingPath):
    """A source, or a folder where one may be given; a file of another kind is refused with what it is and who reads it."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path.  Raises BadParameter."""
        path = super().convert(value, param, ctx)
        if said := foreign(Path(path)):
            self.fail(said, param, ctx)
        return path


class LibraryFolder(ExistingPath):
    """A folder of libraries; a file, and a folder that has none, are told what makes one of them."""

    def __init__(self) -> None:
        super().__init__(file_okay=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path.  Raises BadParameter."""
        if os.path.isfile(value):
            other = "give its folder" if str(value).endswith(".st") else f"make a folder of it by `fbvm import {value} -o DIR`"
            self.fail(f"{str(value)!r} is a file, and libraries are folders; name it among the sources, or {other}", param, ctx)
        path = Path(super().convert(value, param, ctx))
        try:
            names = [name for _, inside in folders_below(path) for name in inside]
        except Unreadable as error:
            self.fail(f"{str(path)!r}: {reason(error)}", param, ctx)
        if not any(name.endswith(".st") or name == "library.toml" for name in names):
            self.fail(f"there is no library in {str(path)!r}: it holds no .st and no library.toml; `fbvm import FILE -o DIR` "
                      "makes them of other tools' libraries", param, ctx)
        return path


PROJECTS = ("fbvm.toml", "campaign.toml")
"""Files that make a folder a project or a campaign."""


def sources_in(folder: Path) -> list[Path]:
    """The sources of a folder: its files that end in .st, by name."""
    return sorted(file for file in folder.glob("*.st") if file.is_file())


def taken_folders(context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> tuple[Path, ...]:
    """Called by click with FILE...: each folder that is no project stands for its sources.

    Raises UsageError for one that has none, and for a project where the verb takes sources only."""
    takes_projects = "PROJECT" in (parameter.metavar or "")
    for path in files:
        if path.is_dir() and not takes_projects and not _is_of_sources(path):
            raise click.UsageError(f"{path} is a project, and `{context.command_path}` takes sources: name the files of one PLC")
    return tuple(file for path in files for file in (_taken(path) if _is_of_sources(path) else [path]))


def _is_of_sources(path: Path) -> bool:
    return path.is_dir() and not any((path / name).exists() for name in PROJECTS)


def _taken(folder: Path) -> list[Path]:
    found = sources_in(folder)
    if not found:
        raise click.UsageError(f"there is neither an fbvm.toml nor a source (.st) in {resolved(folder)}; give a FILE, or a "
                               "folder with a project or with sources")  # fmt: skip
    return found


def foreign(path: Path) -> str:
    """What a file is that is no source, and what to do with it; "" for all that may be one."""
    if not path.is_file():
        return ""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError:
        return ""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if start.startswith(b"<") and any(mark in start for mark in _SOURCES):
        return ""
    row = next((row for row in _FORMS if start.startswith(row[0])), None)
    if row is None and path.suffix.lower() in _SUFFIXES:
        row = _FORMS[_SUFFIXES[path.suffix.lower()]]
    return f"{path} is {row[1]} and no source of a program; {row[2].replace('FILE', str(path))}" if row else ""


def _alike(path: Path, files: bool) -> str:
    """The suggestion for a path that does not exist: names like its own in its folder, or its own name with another suffix."""
    try:
        there = {entry.name.lower(): entry.name for entry in os.scandir(path.parent) if files or entry.is_dir()}
    except (OSError, ValueError):
        return ""
    import difflib

    wanted = path.name.lower()
    close = [name for name in there if Path(name).stem == wanted] or difflib.get_close_matches(wanted, there, n=2, cutoff=0.6)
    return f"; did you mean {' or '.join(str(path.with_name(there[name])) for name in close)}?" if close else ""
