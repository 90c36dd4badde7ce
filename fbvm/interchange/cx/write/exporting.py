"""Export into a project that CX-Programmer saved: rungs and symbols that differ are replaced, every other byte stays.

The saved project is imported, and what that gives is compared with the sources: so a rung that says the same keeps its bytes.
Calls of function blocks and their definitions are stored as cells, which are not written; a change there is refused by name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.interchange.contents import Contents, Declared, Program, WrittenRung, contents
from fbvm.interchange.cx.compression import compress
from fbvm.interchange.cx.markup import CxText, Value, read_markup
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.cx.read.project import Plc, Section, read_plcs
from fbvm.interchange.cx.read.project import Program as SavedProgram
from fbvm.interchange.cx.read.symbols import spelling
from fbvm.interchange.cx.write.markers import renumbered
from fbvm.interchange.cx.write.rows import RowError, changed_rows
from fbvm.interchange.cx.write.rungs import rung_text

UNTRIED = "whether CX-Programmer opens what fbvm writes has not been tried; keep the project that it saved"


@dataclass(frozen=True)
class ExportedProject:
    """The result of an export."""

    data: bytes | None
    """The bytes of the file; None if something could not be written."""
    diagnostics: list[Diagnostic]
    """Why not."""
    changed: list[str]
    """What differs from the saved project, in words: rungs by program and section, symbols."""

    @property
    def errors(self) -> list[Diagnostic]:
        """Diagnostics about parts of the sources that cannot be written."""
        return errors(self.diagnostics)


@dataclass(frozen=True)
class Edit:
    """A part of the saved text and what stands there instead."""

    start: int
    end: int
    text: str


def export_into(saved: bytes, name: str, sources: Sequence[Source], compressed: bool, plc: str | None = None) -> ExportedProject:
    """Write programs, symbols and comments of sources into a saved project.

    saved: the bytes of the file that CX-Programmer saved, called `name` in messages.
    compressed: make a `.cxp`, else a `.cxt`.  plc: the name of the PLC, where the project has several."""
    text = read_markup(saved, name)
    if isinstance(text, Diagnostic):
        return ExportedProject(None, [text], [])
    before = import_project(saved, name, plc)
    if before.errors:
        return ExportedProject(None, before.errors, [])
    old = contents(Source(file, content) for file, content in before.files.items())
    new = contents(sources)
    if new.diagnostics:
        return ExportedProject(None, new.diagnostics, [])
    found = next(one for one in read_plcs(text) if plc is None or one.name.casefold() == plc.casefold())
    writer = _Writer(text, found, old, new)
    edits = sorted(writer.edits(), key=lambda edit: edit.start)
    if writer.diagnostics:
        return ExportedProject(None, sorted(writer.diagnostics, key=Diagnostic.order), [])
    made, at = [], 0
    for edit in edits:
        made += [text.text[at:edit.start], edit.text]
        at = edit.end
    written = renumbered("".join([*made, text.text[at:]]), text.text)
    try:
        data = text.encoded(written)
    except UnicodeEncodeError as error:
        sign = error.object[error.start]
        why = f"the character {sign!a} is not in {text.encoding}, the code page of the project"
        wrong = Diagnostic("X0402", sources[0], 0, 0, why, "write the comment in letters of that code page")
        return ExportedProject(None, [wrong], [])
    return ExportedProject(compress(data) if compressed else data, [], writer.changed)


class _Writer:
    def __init__(self, text: CxText, plc: Plc, old: Contents, new: Contents) -> None:
        self.text, self.plc, self.old, self.new = text, plc, old, new
        self.diagnostics: list[Diagnostic] = []
        self.changed: list[str] = []

    def refuse(self, source: Source, at: int, message: str, hint: str = "") -> None:
        """Reports what cannot be written."""
        self.diagnostics.append(Diagnostic("X0402", source, at, at + 1, message, hint))

    def edits(self) -> Iterator[Edit]:
        """What is to be replaced in the saved text."""
        for name, (source, at, words) in self.new.others.items():
            kept = self.old.others.get(name)
            if kept is None:
                self.refuse(source, at, f"the project that was saved has no {words.split(' ')[1]}",
                            "make the function block in CX-Programmer, and save the project anew")
            elif kept[2] != words:
                self.refuse(source, at, f"{words.split(' ')[1]} differs from what was saved, and function blocks are not written")
        table = self.plc.value.get("GlobalVariables", "VariableList")
        symbols = {key: one for key, (_, one) in self.new.symbols.items() if not one.name.endswith("_initial")}
        where = next(iter(self.new.symbols.values()))[0] if self.new.symbols else self.text.source
        known = {key: one for key, (_, one) in self.old.symbols.items()}
        yield from self._rows(table, self.plc.value.get("GlobalVariables"), known, symbols, where, "global symbol")
        saved = {spelling(program.name).casefold(): program for program in self.plc.programs}
        for name, program in self.new.programs.items():
            if name not in saved:
                self.refuse(program.source, program.at, f"the project that was saved has no program {program.name}",
                            "insert it in CX-Programmer, and save the project anew")
                continue
            yield from self._program(saved[name], self.old.programs.get(name), program)

    def _rows(self, table: Value | None, holder: Value | None, old: dict[str, Declared], new: dict[str, Declared], source: Source,
              what: str) -> Iterator[Edit]:
        if table is None:
            for one in (one for key, one in new.items() if old.get(key) != one):
                self.refuse(source, one.at, f"{what} {one.name}: the project that was saved has no table of symbols for it",
                            "insert it in CX-Programmer, and save the project anew")
            return
        try:
            made = changed_rows(self.text, table, old, new)
        except RowError as error:
            self.refuse(source, error.args[0].at, f"{what} {error.args[0].name}: {error.args[1]}")
            return
        if made is None:
            return
        rows, count, names = made
        self.changed += [f"{what} {name}" for name in names]
        yield Edit(table.inner, table.inner_end, rows)
        counter = holder.get("VariableCount") if holder else None
        if counter is not None:
            yield Edit(counter.inner, counter.inner_end, str(count))

    def _program(self, saved: SavedProgram, old: Program | None, new: Program) -> Iterator[Edit]:
        table = saved.value.get("LocalVariables", "VariableList")
        if old is not None:
            yield from self._rows(table, saved.value.get("LocalVariables"), dict(old.declared), dict(new.declared), new.source,
                                  f"symbol of {saved.name}")
        sections = {" ".join(section.name.split()): section for section in saved.sections}
        names = {one.own.casefold(): one.name for one in (*self.plc.symbols, *saved.symbols) if one.name}
        for name, rungs in new.sections.items():
            section = sections.get(name) or (saved.sections[0] if not name and saved.sections else None)
            if section is None:
                self.refuse(new.source, new.at, f"program {new.name} has no section {name} in the project that was saved",
                            "insert it in CX-Programmer, and save the project anew")
                continue
            yield from self._section(section, old.sections.get(name, []) if old else [], rungs, new, names)
        for name, section in sections.items():
            if name not in new.sections and old is not None and old.sections.get(name):
                yield from self._section(section, old.sections[name], [], new, names)

    def _section(self, section: Section, old: list[WrittenRung], new: list[WrittenRung], program: Program,
                 names: dict[str, str]) -> Iterator[Edit]:
        """The rungs of a section, if one differs: those that say the same keep their text."""
        if old == new:
            return
        data = section.value.get("ProgramData")
        filled = [rung for rung in section.rungs if not rung.is_empty]
        if data is None or len(filled) != len(old):
            self.refuse(program.source, program.at, f"the rungs of section {section.name} are not found in the saved project")
            return
        made: list[str] = []
        indent = self._indent(section)
        for how, first, last, begin, end in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
            if how == "equal":
                made += [self._saved(rung.value) for rung in filled[first:last]]
                continue
            for rung in new[begin:end]:
                if any(step.is_call for step in rung.steps):
                    self.refuse(program.source, rung.at, "a rung that calls a function block is stored as cells, not written",
                                "leave the rung as it was saved, and change it in CX-Programmer")
                made.append(rung_text(rung, indent, self.text, names))
            self.changed.append(f"{program.name}, section {section.name}: " + _counted(last - first, end - begin))
        empty = [rung for rung in section.rungs if rung.is_empty]
        made += [self._saved(rung.value) for rung in empty]
        first_key = self._key_start(section.rungs[0].value) if section.rungs else data.inner_end
        last_end = section.rungs[-1].value.end if section.rungs else data.inner_end
        yield Edit(first_key, last_end, "".join(f"{indent}R[{number}]:={body}" for number, body in enumerate(made)))
        if counter := data.get("RC"):
            yield Edit(counter.inner, counter.inner_end, str(len(made)))

    def _saved(self, value: Value) -> str:
        """The text of a rung behind its key."""
        return self.text.text[value.start:value.end]

    def _key_start(self, value: Value) -> int:
        return self.text.text.rfind("\n", 0, value.start) + 1

    def _indent(self, section: Section) -> str:
        value = section.rungs[0].value if section.rungs else section.value
        line = self.text.text[self._key_start(value):value.start]
        return line[:len(line) - len(line.lstrip())] + ("" if section.rungs else "  ")


def _counted(gone: int, come: int) -> str:
    """How many rungs were changed, removed and added, in words."""
    changed = min(gone, come)
    parts = [f"{count} rung{'s' * (count > 1)} {what}" for count, what in
             ((changed, "changed"), (gone - changed, "removed"), (come - changed, "added")) if count]
    return ", ".join(parts)
