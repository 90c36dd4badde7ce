"""Groups of names to be watched, kept in a file beside the project or the program, and read again when it changes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from fbvm.base.files import read_file, reason, write_file
from fbvm.base.toml import TomlError, load_toml
from fbvm.live.changes import stamp
from fbvm.live.messages import MOST_NAMES, MessageError

MOST_GROUPS = 100
MOST_NAME = 60
"""Characters of the name of a group."""
MOST_BYTES = 1 << 20
HEAD = "# Groups of names that the page of `fbvm live` watches together; a name of a PLC stands behind it: tank/Main.Level.\n"


class WatchGroups:
    """The groups in a file, which need not be there; `rows` is their names by the name of the group, in the order of the file."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.rows: dict[str, list[str]] = {}
        self._stamp = stamp(file)
        self._load()

    def look(self) -> None:
        """Reads the file again if it has changed; called a few times a second."""
        if stamp(self._file) != self._stamp:
            self._load()

    def keep(self, name: str, names: Sequence[str]) -> None:
        """Writes a group; without `names` it is removed.  Raises MessageError."""
        name = name.strip()
        if not name or len(name) > MOST_NAME or not name.isprintable():
            raise MessageError(f"a group has a name of 1 to {MOST_NAME} characters")
        rows = {known: kept for known, kept in self.rows.items() if known != name}
        if names:
            rows[name] = list(names)[:MOST_NAMES]
        if len(rows) > MOST_GROUPS:
            raise MessageError(f"there are {MOST_GROUPS} groups already")
        text = HEAD + "".join(f"\n[[group]]\nname = {_quoted(known)}\nnames = [{', '.join(map(_quoted, kept))}]\n"
                              for known, kept in rows.items())  # fmt: skip
        try:
            write_file(self._file, text)
        except OSError as error:
            raise MessageError(f"{self._file.name} cannot be written: {reason(error)}") from None
        self.rows, self._stamp = rows, stamp(self._file)

    def _load(self) -> None:
        """Takes the groups of the file as far as they are well formed; a file that is none changes nothing."""
        self._stamp = stamp(self._file)
        if self._stamp is None:
            self.rows = {}
            return
        try:
            found = load_toml(read_file(self._file, MOST_BYTES).decode()).get("group", [])
        except (OSError, UnicodeDecodeError, TomlError):
            return
        rows = [row for row in (found if isinstance(found, list) else [])[:MOST_GROUPS] if isinstance(row, dict)]
        self.rows = {row["name"]: [name for name in row["names"] if isinstance(name, str)][:MOST_NAMES]
                     for row in rows if isinstance(row.get("name"), str) and isinstance(row.get("names"), list)}  # fmt: skip


def _quoted(text: str) -> str:
    """A text as TOML writes it: the escapes of JSON are TOML's, too."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
