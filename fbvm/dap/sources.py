"""Sources as editors name them: files by their paths, texts of recordings by numbers; lines and columns as the client counts."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from fbvm.code.image import Site
from fbvm.interchange.twincat import OBJECT_SUFFIXES
from fbvm.step.statement_ends import StatementEnds


class Sources:
    """The sources of what is debugged.

    `texts` by name, `paths` where they lie on the host, `sites` of all programs; names without a path get a number."""

    def __init__(self, texts: Mapping[str, str], paths: Mapping[str, Path], client: Mapping[str, Any],
                 sites: Sequence[Site] = ()) -> None:  # fmt: skip
        self.texts, self._paths = texts, {name: path.absolute() for name, path in paths.items()}
        self._lines_from = 1 if client.get("linesStartAt1", True) else 0
        self._columns_from = 1 if client.get("columnsStartAt1", True) else 0
        self._as_uri = client.get("pathFormat") == "uri"
        self._numbered = [name for name in texts if name not in self._paths]
        self._said: dict[str, str] = {}
        """How the client writes the path of a source."""
        self._lines = {name: text.split("\n") for name, text in texts.items()}
        self._ends = StatementEnds(texts)
        self.statements: dict[str, set[tuple[int, int]]] = {}
        """By source the lines and columns at which statements begin."""
        for site in sites:
            self.statements.setdefault(site.file, set()).add((site.line, site.column))

    # --- sources

    def source(self, name: str) -> dict[str, Any]:
        """The `Source` of a name."""
        text = self.texts.get(name)
        found: dict[str, Any] = {"name": name.rpartition("/")[2]}
        if name in self._paths:
            path = self._paths[name]
            found["path"] = self._said.get(name) or (path.as_uri() if self._as_uri else str(path))
        elif text is not None:
            found["sourceReference"] = self._numbered.index(name) + 1
            found["path"] = name
            found["origin"] = "library or recording"
        if text is not None and not name.lower().endswith(OBJECT_SUFFIXES):  # of these the text is only a part of the file
            found["checksums"] = [{"algorithm": "SHA256", "checksum": hashlib.sha256(text.encode("utf-8")).hexdigest()}]
        return found

    def name_of(self, source: Mapping[str, Any]) -> str | None:
        """The name of a `Source`, None for one that is not of this program."""
        number = source.get("sourceReference")
        if isinstance(number, int) and 0 < number <= len(self._numbered):
            return self._numbered[number - 1]
        said = source.get("path")
        if not isinstance(said, str) or not said:
            return None
        path = _plain(said)
        for name, own in self._paths.items():
            if path == str(own) or path.replace("\\", "/").lower() == str(own).replace("\\", "/").lower():
                self._said[name] = said
                return name
        for name, own in self._paths.items():
            if Path(path).is_file() and own.is_file() and Path(path).samefile(own):
                self._said[name] = said
                return name
        return next((name for name in self.texts if path == name), None)

    def text(self, number: int) -> str | None:
        """The text behind a `sourceReference`, None if there is none."""
        return self.texts[self._numbered[number - 1]] if 0 < number <= len(self._numbered) else None

    @property
    def all(self) -> list[dict[str, Any]]:
        """All sources."""
        return [self.source(name) for name in sorted(self.texts)]

    def line_text(self, name: str, line: int) -> str:
        """A line of a source, "" behind its end."""
        rows = self._lines.get(name, [])
        return rows[line - 1] if 0 < line <= len(rows) else ""

    def lines(self, name: str, first: int, last: int) -> list[tuple[int, str]]:
        """The lines of a source from one number to another, as far as it has them, with their numbers."""
        return [(number, text) for number, text in enumerate(self._lines.get(name, ()), 1) if first <= number <= last]

    # --- lines and columns

    def line(self, said: int) -> int:
        """A line of ours, from 1 on, for one of the client."""
        return said + 1 - self._lines_from

    def client_line(self, line: int) -> int:
        """A line of the client for one of ours."""
        return line - 1 + self._lines_from

    def client_column(self, name: str, line: int, column: int) -> int:
        """A column of the client, in UTF-16 units, for one of ours, in characters."""
        before = self.line_text(name, line)[: column - 1]
        return len(before.encode("utf-16-le", "surrogatepass")) // 2 + self._columns_from

    def place(self, site: Site) -> dict[str, Any]:
        """`line`, `column` and, where it is known, the end of the statement of a site."""
        column = self.client_column(site.file, site.line, site.column)
        found: dict[str, Any] = {"line": self.client_line(site.line), "column": column}
        if end := self._ends.end(site):
            found["endLine"], found["endColumn"] = self.client_line(end[0]), self.client_column(site.file, *end)
        return found

    def locations(self, name: str, first: int, last: int) -> list[dict[str, Any]]:
        """The places of breakpoints in some lines, of the client's."""
        found = sorted(place for place in self.statements.get(name, ()) if first <= place[0] <= last)
        return [{"line": self.client_line(line), "column": self.client_column(name, line, column)} for line, column in found]


def _plain(said: str) -> str:
    """A path, where a client says a URI."""
    if "://" in said:
        path = unquote(urlsplit(said).path)
        return path[1:] if path[2:3] == ":" else path
    return said
