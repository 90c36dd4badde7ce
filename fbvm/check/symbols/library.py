"""Libraries of blocks: folders with a `library.toml` and one POU a file, found by the file's name.

A library for a unit that has no words of its own in the PLC's areas declares them, the unit's mailbox:

    [mailbox]
    area = "NOC"        # as the library's variables name it behind AT
    head = 512          # words for the unit as a whole
    slots = 32
    slot = 400          # words of a slot

`by_dialect = true` hides a library from all but the dialects that name it (base.dialects).

Names that programs put in front of its own, with a point, are its `spaces = ["Standard"]`.

In blocks of a tool that knows EN as an input like any other (`plain_en` of base.dialects), `plain_en = true` says so.

Files of global variables and constants that are read when a program names one of them, or their file with a point:
`lists = ["TwinCAT_SystemInfoVarList.st"]`.  If one of these was read, each task calls in front of its programs the function
`task = "TwinCAT_TaskBegins"` with Index (from 1 on), CycleTime (a ULINT in units of 100 ns), Priority and Name.

Pins that other tools call otherwise have their other names there too:

    [pins]
    SR = { SET1 = "S1", RESET = "R" }
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cache, lru_cache
from pathlib import Path

from fbvm.base.areas import AREAS, Mailbox, refusal
from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SETTINGS_BYTES, Unreadable, folders_below, read_file, reason
from fbvm.base.toml import TomlError, load_toml
from fbvm.base.types import fold
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read


@dataclass
class Library:
    """One folder: its name (path below the root), its files by folded stem, and the files that hold its globals."""

    name: str
    folder: Path
    files: dict[str, Path]
    globals: tuple[str, ...] = ()
    mailbox: Mailbox | None = None
    pins: dict[str, dict[str, str]] = field(default_factory=dict)
    """By folded name of a POU the other names of its pins, folded, and their own."""
    spaces: frozenset[str] = frozenset()
    """Folded names under which programs know the library: `Standard` in Standard.TON."""
    writes: tuple[str, ...] = ()
    """Areas that programs may only read, and this library writes."""
    by_dialect: bool = False
    """True for blocks that replace others in the dialects that name the library."""
    lists: tuple[str, ...] = ()
    """Files of global variables that are read when a program names the file or one of the variables."""
    listed: dict[str, str] = field(default_factory=dict)
    """By the folded name of such a file, and of each of its variables: the file."""
    task: str = ""
    """The function that each task calls in front of its programs, if one of `lists` was read."""
    plain_en: bool = False
    """True if a declared EN is an input like any other in its blocks, whatever the dialect of the program."""
    shipped: bool = False
    """True for one that comes with fbvm, whose files do not change."""
    loaded: set[str] = field(default_factory=set)


class LibraryError(ValueError):
    """The `library.toml` of a library is damaged; the message says where and how."""

    def __init__(self, described: Path, why: str) -> None:
        super().__init__(f"{described}: {why}")
        self.described, self.why = described, why

    @property
    def diagnostic(self) -> Diagnostic:
        """The error as a diagnostic."""
        try:
            text = read_file(self.described, SETTINGS_BYTES).decode("utf-8", "replace")
        except OSError:
            text = ""
        return Diagnostic("P0201", Source(str(self.described), text), 0, len(text.partition("\n")[0]), self.why)


_KEYS = ("globals", "mailbox", "pins", "spaces", "writes", "by_dialect", "lists", "task", "plain_en")
"""What a `library.toml` can say to the compiler; everything else in it is for people."""


def _libraries_below(root: Path) -> Iterator[Library]:
    try:
        folders = folders_below(root)
    except Unreadable as error:
        raise LibraryError(root, reason(error)) from error
    for folder, names in folders:
        sources = [name for name in names if name.endswith(".st")]
        if not sources and "library.toml" not in names:
            continue
        described = folder / "library.toml"
        table = _described(described) if os.path.lexists(described) else {}
        name = folder.relative_to(root).as_posix() if folder != root else root.name
        files = {fold(source[:-len(".st")]): folder / source for source in sources}
        spaces = _listed(table, "spaces", described, "a list of names")
        lists = _files_of(table, "lists", described)
        yield Library(name, folder, files, _files_of(table, "globals", described),
                      _mailbox(table, described), _pins(table, described), frozenset(map(fold, spaces)),
                      _written(table, described), _flag(table, "by_dialect", described),
                      lists, _names_in(folder, lists, described), _task(table, files, described),
                      _flag(table, "plain_en", described))


def _described(described: Path) -> dict[str, object]:
    """What a `library.toml` says; a key that looks like one of ours must be one."""
    try:
        table = load_toml(read_file(described, SETTINGS_BYTES).decode("utf-8"))
    except TomlError as error:
        raise LibraryError(described, f"{error} (at line {error.line}, column {error.column})") from error
    except UnicodeDecodeError as error:
        raise LibraryError(described, str(error)) from error
    except OSError as error:
        raise LibraryError(described, f"it cannot be read: {reason(error)}") from error
    for key in table:
        if key not in _KEYS and (meant := get_close_matches(key, _KEYS, n=1, cutoff=0.8)):
            raise LibraryError(described, f"{key} says nothing; did you mean {meant[0]}?")
    return table


def _listed(table: dict[str, object], key: str, described: Path, what: str) -> tuple[str, ...]:
    listed = table.get(key, [])
    if not isinstance(listed, list) or not all(isinstance(name, str) for name in listed):
        raise LibraryError(described, f"{key} must be {what}")
    return tuple(listed)


def _files_of(table: dict[str, object], key: str, described: Path) -> tuple[str, ...]:
    """The files that a key names, which stand beside the description."""
    files = _listed(table, key, described, "a list of file names")
    for name in files:
        if Path(name).name != name:
            raise LibraryError(described, f"{key}: {name} is no file of this folder")
        if not (described.parent / name).is_file():
            raise LibraryError(described, f"{key}: there is no file {name} in this folder")
    return files


_DECLARED = re.compile(r"^\s*([A-Za-z_]\w*)\s*(?:AT\b[^:]*)?:", re.M)


def _names_in(folder: Path, lists: tuple[str, ...], described: Path) -> dict[str, str]:
    """By folded name of a list of global variables, and of each of its variables unless it is qualified_only: its file."""
    names: dict[str, str] = {}
    for listed in lists:
        found = read(folder / listed, listed)
        if not isinstance(found, Source):
            raise LibraryError(described, f"{listed} cannot be read")
        variables = [] if "qualified_only" in found.text else _DECLARED.findall(found.text)
        for name in (Path(listed).stem, *variables):
            names.setdefault(fold(name), listed)
    return names


def _task(table: dict[str, object], files: Mapping[str, Path], described: Path) -> str:
    task = table.get("task", "")
    if not isinstance(task, str):
        raise LibraryError(described, "task must be the name of a function")
    if task and fold(task) not in files:
        raise LibraryError(described, f"task: there is no file {task}.st in this folder")
    return task


def _flag(table: dict[str, object], key: str, described: Path) -> bool:
    flag = table.get(key, False)
    if not isinstance(flag, bool):
        raise LibraryError(described, f"{key} must be true or false")
    return flag


@cache
def _shipped() -> tuple[Library, ...]:
    """The libraries that come with fbvm, whose files do not change while it runs."""
    return tuple(replace(library, shipped=True) for library in _libraries_below(data_folder("fblib")))


@cache
def _shipped_files() -> frozenset[str]:
    """The folded names of their files."""
    return frozenset(name for library in _shipped() for name in library.files)


def _pins(table: dict[str, object], described: Path) -> dict[str, dict[str, str]]:
    """The other names of pins."""
    written = table.get("pins", {})
    pins: dict[str, dict[str, str]] = {}
    for pou, row in written.items() if isinstance(written, dict) else [("", None)]:
        if not isinstance(row, dict) or not all(isinstance(own, str) for own in row.values()):
            raise LibraryError(described, "pins has for each POU a table of names and what the POU calls them")
        pins[fold(pou)] = {fold(other): fold(own) for other, own in row.items()}
    return pins


def _written(table: dict[str, object], described: Path) -> tuple[str, ...]:
    """The areas that the library writes though programs only read them."""
    areas = _listed(table, "writes", described, "a list of areas")
    if not set(areas) <= AREAS.keys():
        raise LibraryError(described, "writes must be a list of areas")
    return areas


def _mailbox(table: dict[str, object], described: Path) -> Mailbox | None:
    """The mailbox of the library's unit."""
    written = table.get("mailbox")
    if written is None:
        return None
    row = written if isinstance(written, dict) else {}
    sizes = [size for key in ("head", "slots", "slot") if type(size := row.get(key)) is int]
    if set(row) != {"area", "head", "slots", "slot"} or len(sizes) != 3:
        raise LibraryError(described, "a mailbox has an area and whole numbers for head, slots and slot")
    mailbox = Mailbox(str(row["area"]), *sizes)
    if why := refusal(mailbox):
        raise LibraryError(described, why)
    return mailbox


class Libraries:
    """The shipped libraries and the user's own; names are looked up in own ones first."""

    def __init__(self, own: Sequence[Path] = (), shipped: bool = True, preferred: Sequence[str] = ()) -> None:
        shelves = [list(_libraries_below(Path(root))) for root in own]
        shelves += [[replace(library, loaded=set()) for library in _shipped()]] if shipped else []
        self._libraries: dict[str, Library] = {}
        for below in shelves:
            for library in sorted(below, key=lambda library: library.name not in preferred):
                if not library.by_dialect or library.name in preferred:
                    self._put(library)
        self._files = {name for below in shelves[:len(own)] for library in below for name in library.files}
        self._holders: dict[str, dict[str, None]] = {}
        for library in self._libraries.values():
            for name in library.files:
                self._holders.setdefault(name, {})[library.name] = None
        self._block_names: list[str] | None = None
        self.mailboxes: dict[str, Mailbox] = {}
        """What the libraries' units bring, by area."""
        for library in self._libraries.values():
            if library.mailbox and self.mailboxes.setdefault(library.mailbox.name, library.mailbox) != library.mailbox:
                described = library.folder / "library.toml"
                raise LibraryError(described, f"{library.mailbox.name} is another library's mailbox, too")

    def _put(self, library: Library) -> None:
        """Knows a library by its name: one of the user's own hides a shipped one; beside another own one of that name it has the
        name of its folder."""
        other = self._libraries.get(library.name, library)
        if not library.shipped and other.folder != library.folder:
            library.name = library.folder.as_posix()
        self._libraries.setdefault(library.name, library)

    def has_file(self, name: str) -> bool:
        """True if a library may have a file for a folded name."""
        return name in _shipped_files() or name in self._files

    def holders(self, name: str) -> Collection[str]:
        """The libraries that have a file for a folded name, in the order of `names`."""
        return self._holders.get(name, ())

    def has_own_file(self, name: str) -> bool:
        """True if a library of the user has a file for a folded name."""
        return name in self._files

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._libraries)

    def path(self, source: Source) -> Path | None:
        """Where the file of a library's text lies; None for a text of no library."""
        library = self._libraries.get(source.library)
        return library.folder / source.name.removeprefix(f"{library.name}/") if library is not None else None

    def other_pins(self, owner: str, pou: str) -> dict[str, str]:
        """Other names of the pins of a library's POU, folded, and their own."""
        library = self._libraries.get(owner)
        return library.pins.get(fold(pou), {}) if library is not None else {}

    def has_space(self, name: str) -> bool:
        """True if programs know a library under that name."""
        return any(fold(name) in library.spaces for library in self._libraries.values())

    def is_in_space(self, owner: str, space: str) -> bool:
        """True if programs know that library under the folded name `space`."""
        library = self._libraries.get(owner)
        return library is not None and space in library.spaces

    def tasks(self) -> list[tuple[str, str]]:
        """Of libraries whose lists were read: the library, and the function that each task calls in front of its programs."""
        return [(library.name, library.task) for library in self._libraries.values()
                if library.task and not library.loaded.isdisjoint(library.lists)]

    def writes(self, owner: str) -> tuple[str, ...]:
        """Areas that a library writes though programs only read them."""
        library = self._libraries.get(owner)
        return library.writes if library else ()

    def is_shipped(self, name: str) -> bool:
        """True for a library that comes with fbvm."""
        return self._libraries[name].shipped

    def declares_space(self, name: str) -> bool:
        """True if the text of a user's library has a NAMESPACE that is called or contains `name`, with points between."""
        pattern = re.compile(rf"(?i)\bNAMESPACE\s+(?:INTERNAL\s+)?(?:\w+\s*\.\s*)*{re.escape(name.rpartition('.')[2])}\b")
        texts = (read(path, path.name) for library in self._libraries.values() if not library.shipped
                 for path in library.files.values())
        return any(isinstance(each, Source) and pattern.search(each.text) is not None for each in texts)

    def has_plain_en(self, name: str) -> bool:
        """True for a library in whose blocks a declared EN is an input like any other."""
        return self._libraries[name].plain_en

    def is_by_dialect(self, name: str) -> bool:
        """True for a library whose blocks stand in place of others in what users write, and not in shipped libraries."""
        return self._libraries[name].by_dialect

    def block_names(self) -> list[str]:
        """The names under which files are found, as their files are named, but for a user's file that declares no such name."""
        if self._block_names is None:
            self._block_names = [path.stem for library in self._libraries.values() for path in library.files.values()
                                 if library.shipped or _declares_its_name(path)]
        return self._block_names

    def load(self, name: str, owner: str, report: Report) -> list[tuple[Source, tree.SourceText]]:
        """Trees of the file that `owner` has for `name`, and of its globals; nothing if it is loaded or unknown."""
        library = self._libraries.get(owner)
        if library is None or fold(name) not in library.files:
            return []
        wanted = [library.files[fold(name)], *(library.folder / listed for listed in library.globals)]
        return [loaded for path in wanted if (loaded := self._parse(library, path, report))]

    def load_list(self, name: str, report: Report) -> list[tuple[Source, tree.SourceText]]:
        """Trees of the lists of global variables that have that folded name, or a variable of that name, as far as they
        were not read before."""
        wanted = [(library, library.folder / library.listed[name]) for library in self._libraries.values()
                  if name in library.listed]
        return [loaded for library, path in wanted if (loaded := self._parse(library, path, report))]

    def _parse(self, library: Library, path: Path, report: Report) -> tuple[Source, tree.SourceText] | None:
        if path.name in library.loaded:
            return None
        library.loaded.add(path.name)
        known = (_shipped_file if library.shipped else _file)(library.name, path)
        if isinstance(known, Diagnostic):
            report.diagnostics.append(known)
            return None
        source, text, diagnostics = known
        report.diagnostics.extend(diagnostics)
        return source, text


def _declares_its_name(path: Path) -> bool:
    """True if a file seems to declare a POU or a type of the file's name."""
    found = read(path, path.name)
    declared = rf"(?:\b(?:FUNCTION_BLOCK|FUNCTION|PROGRAM|TYPE|FINAL|ABSTRACT)\s+|^\s*){re.escape(path.stem)}\b"
    return isinstance(found, Source) and re.search(declared, found.text, re.I | re.M) is not None


Parsed = tuple[Source, tree.SourceText, tuple[Diagnostic, ...]]
"""A file of a library, its tree and what is wrong with it."""


def _file(library: str, path: Path) -> Parsed | Diagnostic:
    found = read(path, f"{library}/{path.name}", library)
    return _parsed(found.name, found.text, found.library) if isinstance(found, Source) else found


_shipped_file = cache(_file)
"""Parsed shipped files, kept while the process runs: trees are values, and tests compile them often."""


@lru_cache(maxsize=512)
def _parsed(name: str, text: str, library: str) -> Parsed:
    """The tree of a library's file, kept as long as the text stays."""
    source = Source(name, text, library)
    parsed, diagnostics = parse(source)
    return source, parsed, tuple(diagnostics)
