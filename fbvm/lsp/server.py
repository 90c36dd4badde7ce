"""The server: texts as the editor has them, the checks that follow a change, and the diagnostics that are told.

After a key the POU in which it fell is checked at once; when nobody types for a moment, everything is, in steps between which
requests are answered.  A change of what others see begins with everything."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.lsp.server import LanguageServer

from fbvm.analysis.garbage import Garbage
from fbvm.analysis.parts import File
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.twincat import TASK_SUFFIX
from fbvm.lsp import foreign, project_file
from fbvm.lsp.positions import Positions
from fbvm.lsp.projects import Project, Projects, Settings, path_of
from fbvm.lsp.protocol import Protocol, Refused, tell_in_a_line
from fbvm.run.project import FILE

AFTER_KEY_S = 0.02
"""How long after a key the check of its POU begins: keys that come together are one change."""
QUIET_S = 0.3
"""How long nobody types before warnings are looked for."""
READ_S = 0.2
"""So long at most the end of the server waits for the thread that reads; at the end of the input it is there at once."""
TRIES = 5
"""How often a request waits for the check of texts that change meanwhile."""
COLLECTED_AFTER_S = 10.0
"""How long nobody types before Python's garbage is collected, which takes tenths of a second."""
START = types.Range(types.Position(0, 0), types.Position(0, 0))
UNUSED = ("S0290", "S0291", "S0293")
"""Warnings of names that nobody uses, which editors show faded."""
_SEVERITY = {"error": types.DiagnosticSeverity.Error, "warning": types.DiagnosticSeverity.Warning}


class Server(LanguageServer):
    """One client's server.  The features are in `navigation`, `editing` and `appearance`."""

    def __init__(self, version: str) -> None:
        super().__init__("fbvm", version, text_document_sync_kind=types.TextDocumentSyncKind.Incremental, protocol_cls=Protocol)
        self.projects = Projects(self.open_text)
        self.open_paths: dict[Path, str] = {}
        """The files that the editor has open, and their URIs as it writes them."""
        self.told: dict[str, list[types.Diagnostic]] = {}
        """The diagnostics that the editor has of each URI, where there are any."""
        self._garbage = Garbage()
        tell_in_a_line()
        self._collection: asyncio.TimerHandle | None = None

    def shutdown(self) -> None:
        """Ends the server.  Raises KeyboardInterrupt where a thread still reads what the editor says: then a signal has asked for
        the end, which pygls keeps to itself, and the thread cannot be waited for."""
        pool, self._thread_pool = self._thread_pool, None
        super().shutdown()  # type: ignore[no-untyped-call]
        if pool:
            pool.shutdown(wait=False)
            for thread in pool._threads:
                thread.join(READ_S)
                if thread.is_alive():
                    raise KeyboardInterrupt

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Shows the editor what went wrong beside the answers to its requests."""
        if not isinstance(error, Refused):
            super().report_server_error(error, source)

    # --- texts ------------------------------------------------------------------------------------------------------

    def open_text(self, path: Path) -> str | None:
        """The text of a file that is open; None for others."""
        uri = self.open_paths.get(path)
        return self.workspace.get_text_document(uri).source if uri is not None else None

    def text(self, uri: str) -> str:
        """The text of a file that an editor asks about, open or not; "" for one that cannot be read."""
        try:
            return self.workspace.get_text_document(uri).source
        except (OSError, ValueError):
            return ""

    def uri(self, path: Path) -> str:
        """The URI of a file, as the editor writes it if it has it open; of a source within a container, that of the container."""
        path = foreign.container_of(str(path)) or path
        return self.open_paths.get(path) or path.as_uri()

    def positions(self, source: Source) -> Positions:
        """Places in a text in the units that were agreed upon."""
        return Positions(source, self.workspace.position_encoding or types.PositionEncodingKind.Utf16)

    def opened(self, uri: str) -> None:
        """A file is open from now on."""
        path = path_of(uri)
        self.open_paths[path] = uri
        if path.name == FILE:
            self.project_file_changed(path)
            return
        for project in self.projects.open(path):
            self.changed(project, path)
        self._tell_project_files()

    def text_changed(self, uri: str) -> None:
        """The editor has another text of a file."""
        path = path_of(uri)
        if path.name == FILE:
            self.project_file_changed(path)
            return
        for project in self.projects.of(path):
            self.changed(project, path)

    def closed(self, uri: str) -> None:
        """A file is open no more: what is on disk counts again."""
        path = path_of(uri)
        self.open_paths.pop(path, None)
        if path.name == FILE:
            self.project_file_changed(path)
            return
        for project in self.projects.of(path):
            self.changed(project, path)
        self._forgotten(self.projects.close(self.open_paths))

    def disk_changed(self, path: Path) -> None:
        """A file was written, made or removed by somebody."""
        if path.name == FILE:
            self.project_file_changed(path)
        elif foreign.is_container(path) or path.suffix.lower() == TASK_SUFFIX:
            self._forgotten(self.projects.forget_container(path))
            self._open_again()
        elif path not in self.open_paths:
            self._forgotten(self.projects.forget_regrouped(path))
            for project in self.projects.of(path):
                self.changed(project, path)
            self._open_again()

    def project_file_changed(self, path: Path | None) -> None:
        """What belongs together may have changed: the programs are begun anew.  None: the settings have changed."""
        self._forgotten(self.projects.forget(path))
        if path in self.projects.wrong:
            self.projects.wrong[path] = []
        self._open_again()
        if path is not None and path in self.open_paths:
            self.projects.wrong[path] = project_file.diagnostics(path, self.open_text(path))
        self._tell_project_files()

    def _open_again(self) -> None:
        """Begin the programs of open files that have none any more."""
        for each in self.open_paths:
            if each.name != FILE and not self.projects.of(each):
                for project in self.projects.open(each):
                    self.changed(project, each)

    def _forgotten(self, projects: list[Project]) -> None:
        for project in projects:
            if isinstance(project.task, asyncio.Task):
                project.task.cancel()
            for path in project.paths:
                if not self.projects.of(path):
                    self._tell(self.uri(path), [])
            for path in project.libraries_told.difference(*(each.libraries_told for each in self.projects.all)):
                self._tell(self.uri(path), [])

    # --- checks -----------------------------------------------------------------------------------------------------

    def changed(self, project: Project, path: Path) -> None:
        """Take the present text of a file into a program, and check it soon."""
        self.projects.take(project, path)
        if isinstance(project.task, asyncio.Task):
            project.task.cancel()
        project.task = asyncio.ensure_future(self._check(project))

    async def _check(self, project: Project) -> None:
        """Check a program whose texts have changed; ended by the next change."""
        program = project.program
        await asyncio.sleep(AFTER_KEY_S)
        if program.check_changes():
            self.tell(project)
            self._garbage.typed()
            await asyncio.sleep(QUIET_S)
        steps = program.check()
        try:
            for _ in steps:
                await asyncio.sleep(0)
        finally:
            steps.close()
        self.tell(project)
        program.release()
        self._garbage.checked()
        self._collect_later()

    def _collect_later(self) -> None:
        if self._collection is not None:
            self._collection.cancel()
        self._collection = asyncio.get_running_loop().call_later(COLLECTED_AFTER_S, self._garbage.collect)

    async def ready(self, uri: str) -> tuple[Project, File] | None:
        """The program of a file, checked as its text is now; None for a file of no program."""
        path = path_of(uri)
        found = self.projects.of(path)
        if not found:
            return None
        project = found[0]
        for _ in range(TRIES):
            if project.program.is_current or project.program.check_changes():
                break
            if isinstance(project.task, asyncio.Task) and not project.task.done():
                await asyncio.wait([project.task])
            else:
                project.program.check_all()
        file = project.program.files.get(str(path))
        return (project, file) if file is not None else None

    # --- diagnostics ------------------------------------------------------------------------------------------------

    def tell(self, project: Project) -> None:
        """Tell the editor what is wrong with the files of a program, as far as that has changed."""
        for path in project.paths:
            found: dict[tuple[str, int, int, str], types.Diagnostic] = {}
            for other in self.projects.of(path):
                file = other.program.files.get(str(path))
                rows = [(each, file.source) for each in other.program.diagnostics(file.name)] if file is not None else []
                for each, source in [*((each, each.source) for each in other.said.get(path, ())), *rows]:
                    found.setdefault((each.code, each.start, each.end, each.message), self.diagnostic(each, source))
            held = self._within(project, path) if foreign.is_container(path) else []
            self._tell(self.uri(path), [*found.values(), *held])
        self._tell_libraries(project)

    def _within(self, project: Project, container: Path) -> list[types.Diagnostic]:
        """What is wrong with the sources within a container, where it stands in it; at its beginning if that cannot be told."""
        found = []
        for name in project.held:
            for each in project.program.diagnostics(name) if container in Path(name).parents else ():
                made, place = self.diagnostic(each, each.source), self.projects.place_in_container(each.source, each.start)
                line, column = each.source.place(each.start)
                where = place.where if place is not None else f"{Path(name).relative_to(container)}:{line}:{column}"
                made.message = f"{where}: {made.message}"
                made.range = self.range(each.source, each.start, each.end)
                found.append(made)
        return found

    def range(self, source: Source, start: int, end: int) -> types.Range:
        """A piece of a source; of one within a container where it stands in it, or the container's beginning."""
        if foreign.container_of(source.name) is None:
            return self.positions(source).range(start, end)
        place = self.projects.place_in_container(source, start)
        if place is None:
            return START
        return self.positions(place.document).range(*foreign.narrowed(place, source.text[start:end]))

    def _tell_libraries(self, project: Project) -> None:
        """Tell what is wrong with the files of libraries that a program uses."""
        checked = project.program.checked
        found: dict[Path, list[types.Diagnostic]] = {path: [] for path in project.libraries_told}
        for each in project.program.library_errors() if checked is not None else ():
            path = checked.project.libraries.path(each.source) if checked is not None else None
            if path is not None:
                found.setdefault(path, []).append(self.diagnostic(each, each.source))
        project.libraries_told = {path for path, rows in found.items() if rows}
        for path, rows in found.items():
            self._tell(self.uri(path), rows)

    def _tell_project_files(self) -> None:
        for path, found in self.projects.wrong.items():
            self._tell(self.uri(path), [self.diagnostic(each, each.source) for each in found])

    def _tell(self, uri: str, found: list[types.Diagnostic]) -> None:
        if self.told.get(uri, []) == found:
            return
        self.told[uri] = found
        if not found:
            del self.told[uri]
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, found))

    def diagnostic(self, found: Diagnostic, source: Source) -> types.Diagnostic:
        """A diagnostic in the form of the protocol."""
        start, end = found.start, found.end
        if end <= start < len(source.text) and source.text[start] not in "\r\n":
            end = start + 1
        message = f"{found.message}\n{found.hint}" if found.hint else found.message
        related = []
        if found.related is not None and Path(found.related[0].name).is_absolute():
            other, at, said = found.related
            place = self.range(other, at, at + 1)
            related = [types.DiagnosticRelatedInformation(types.Location(self.uri(Path(other.name)), place), said)]
        return types.Diagnostic(
            self.positions(source).range(start, end), message, _SEVERITY[found.severity], found.code, None, "fbvm",
            [types.DiagnosticTag.Unnecessary] if found.code in UNUSED else None, related or None)

    def configure(self, settings: object) -> None:
        """Take the settings of an editor: `dialect`, and `libraries` as a list of folders."""
        given = settings.get("fbvm", settings) if isinstance(settings, dict) else {}
        dialect, libraries = given.get("dialect") or "standard", given.get("libraries") or []
        if project_file.is_dialect(dialect) and isinstance(libraries, list):
            self.projects.settings = Settings(dialect, tuple(Path(str(each)) for each in libraries))
