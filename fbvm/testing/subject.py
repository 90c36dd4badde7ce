"""The program of a test: one POU with a generated program around it, or a whole program, with stubs in place of blocks.

A stub in ST takes the place of the whole declaration, or of the body alone if it declares nothing.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import Any, TypeAlias

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.base.dialects import dialect as named_dialect
from fbvm.base.files import reason
from fbvm.base.types import fold
from fbvm.check.lint.suppression import ANY, Wanted
from fbvm.check.symbols.library import Libraries
from fbvm.check.symbols.report import Report
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.interchange.formats.given import usual_dialect, within
from fbvm.record.trace.source_texts import source_texts
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read

Stub: TypeAlias = "str | Callable[[Any], None]"
"""ST, or a function that is called with the variables of the instance."""
WRAPPER, INSTANCE = "Test", "Block"
"""The program around a block, and the instance in it."""
LIBRARY = Path(__file__).parent / "library"
"""The library with ASSERT, which tests in ST call."""
_DECLARES = re.compile(r"\s*(FUNCTION|FUNCTION_BLOCK|PROGRAM)\b", re.I)
_FIRST = re.compile(r"\w+")
_OPEN = re.compile(r"\[\s*\*|^\s*ANY(_\w+)?\s*$", re.I)
"""Types of in-outs that accept several types: arrays of any length, ANY and other generic types."""
UNKNOWN = ("S0201", "S0204", "S0401")
"""Codes of diagnostics about unknown names."""
MOST_FILES = 300
"""Files in which an unknown name is looked for."""
MOST_FOLDERS = 300
"""Folders below the present one in which such files are looked for."""
_images: dict[tuple[object, ...], Subject] = {}


class SubjectError(Exception):
    """The program of a test cannot be compiled; the message has all diagnostics."""


@dataclass(frozen=True)
class Subject:
    """A compiled program and the POU under test.

    `prefix` is the path of the POU with a dot, in front of all names of the test; `sources` are texts by name."""

    name: str
    image: Image
    prefix: str
    sources: Mapping[str, Source]
    libraries: tuple[Path, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    """Warnings about the user's own sources."""
    in_outs: frozenset[str] = frozenset()
    """In-outs of a block by folded name: the test sees the variables of the program that are passed."""

    def path(self, name: str) -> str:
        """The path in the PLC of a name of the test."""
        first = _FIRST.match(name)
        if first and fold(first[0]) in self.in_outs:
            return f"{WRAPPER}.{INSTANCE}_{name}"
        return f"{self.prefix}{name}"

    def plain(self, text: str) -> str:
        """A message without the names of the generated program."""
        return text.replace(self.prefix, "").replace(self.prefix.rstrip("."), self.name) if self.prefix else text

    def line(self, file: str, number: int) -> str:
        """A line of a source without its margin, "" if the source is unknown."""
        rows = self.texts.get(file, "").split("\n")
        return rows[number - 1].strip() if 0 < number <= len(rows) else ""

    @cached_property
    def texts(self) -> dict[str, str]:
        """The texts of all sources, libraries too, by name."""
        return source_texts(self.image, {name: source.text for name, source in self.sources.items()}, self.libraries)


def subject(files: Sequence[Path], name: str | None, libraries: Sequence[Path] = (), stubs: Mapping[str, Stub] | None = None,
            text: str = "", wanted: Wanted = ANY, dialect: str = "", alone: bool = False) -> Subject:  # fmt: skip
    """Compiles the POU `name` of some files, or, without files, of a library; "" is the only POU, None the whole program.

    `text` is ST that is compiled with the files, `stubs` are ST or Python functions by the name of a block, `wanted` selects
    the warnings, `dialect` is the dialect of the compiler, "" that of the files.  With `alone` the files' other programs are
    left out.  Raises SubjectError, and ValueError for an unknown dialect."""
    __tracebackhide__ = True
    sources = [source for path in files for source in _read(path)] + ([Source("test.st", text)] if text else [])
    if alone and name:
        sources = [_without_other_programs(source, name) for source in sources]
    stubs, dialect = stubs or {}, dialect or usual_dialect(files)
    written = {fold(stubbed): stub for stubbed, stub in stubs.items() if isinstance(stub, str)}
    texts = tuple((source.name, source.text) for source in sources)
    key = texts, name, tuple(libraries), tuple(written.items()), wanted, dialect
    if key not in _images:
        _images[key] = _build(sources, name, libraries, written, wanted, dialect)
    return _images[key]


def _build(sources: list[Source], name: str | None, libraries: Sequence[Path], stubs: Mapping[str, str],
           wanted: Wanted, dialect: str) -> Subject:  # fmt: skip
    __tracebackhide__ = True
    compiled = partial(_compiled, libraries=libraries, wanted=wanted, dialect=dialect)
    if name == "":
        name = _only(sources)
    for stubbed, stub in stubs.items():
        sources = _stubbed(sources, stubbed, stub, libraries, dialect)
    if name is None:
        return compiled(sources, None, "")
    node, source = _declared(sources, name, libraries, dialect)
    if node.kind == "PROGRAM":
        return compiled(sources, node.name.text, f"{node.name.text}.")
    wrapper = Source(f"<test of {node.name.text}>", _wrapper(node, source))
    if node.kind == "FUNCTION":
        return compiled([*sources, wrapper], WRAPPER, f"{WRAPPER}.", node.name.text)
    made = compiled([*sources, wrapper], WRAPPER, f"{WRAPPER}.{INSTANCE}.", node.name.text)
    return replace(made, in_outs=frozenset(fold(each) for each, _ in _variables(node, "VAR_IN_OUT", source)))


def _only(sources: Sequence[Source]) -> str:
    """The name of the only POU of some sources, or of the POU with the name of the first file."""
    __tracebackhide__ = True
    names = [node.name.text for source in sources for node in pous(source)]
    stem = fold(Path(sources[0].name).stem) if sources else ""
    chosen = names if len(names) == 1 else [name for name in names if fold(name) == stem]
    if len(chosen) != 1:
        raise SubjectError(f"say which: {sources[0].name}::NAME; there is {', '.join(names) or 'nothing'}")
    return chosen[0]


def _compiled(sources: list[Source], program: str | None, prefix: str, name: str = "", *, libraries: Sequence[Path],
              wanted: Wanted, dialect: str) -> Subject:  # fmt: skip
    __tracebackhide__ = True
    made = compile_sources(sources, program, libraries, runnable=True, dialect=dialect, no_warn=wanted.no_warn,
                           warnings_as_errors=wanted.as_errors)  # fmt: skip
    if made.image is None:
        said = [message.render() for message in made.errors]
        names = dict.fromkeys(each.source.text[each.start : each.end] for each in made.errors if each.code in UNKNOWN)
        raise SubjectError("\n".join([*said, *_hints(names, sources, libraries)]))
    if not prefix and len(made.image.tasks) == 1 and len(made.image.tasks[0].programs) == 1:
        prefix = f"{made.image.tasks[0].programs[0].name}."
    return Subject(name or prefix.rstrip(".") or "PLC", made.image, prefix,
                   {source.name: source for source in sources}, tuple(libraries),
                   tuple(each for each in made.diagnostics if not each.source.name.startswith("<")))  # fmt: skip


def _hints(names: Iterable[str], sources: Sequence[Source], libraries: Sequence[Path]) -> Iterator[str]:
    """Hints for unknown names that are declared in a file of another name, beside the test or elsewhere in the project."""
    files: list[Path] | None = None
    for name in names:
        declared = re.compile(rf"^[ \t]*(?:FUNCTION_BLOCK|FUNCTION|TYPE)(?:\s+(?:FINAL|ABSTRACT))*\s+{re.escape(name)}\b",
                              re.I | re.M)  # fmt: skip
        if files is None:
            files = list(islice(_files_near(sources, libraries), MOST_FILES))
        for file in files:
            found = read(file, file.name)
            if isinstance(found, Source) and declared.search(found.text):
                shown = os.path.relpath(file) if file.is_absolute() and file.is_relative_to(Path.cwd()) else file
                yield (f"{name} is declared in {shown}; a test finds it in a file of its own name, {name}.st, in src/ or in a "
                       "folder of fbvm_libraries")
                break


def _files_near(sources: Sequence[Source], libraries: Sequence[Path]) -> Iterator[Path]:
    """Sources in the folders of libraries, beside some sources, and below the present folder."""
    yield from (file for folder in libraries for file in folder.rglob("*.st"))
    yield from (file for folder in dict.fromkeys(Path(source.name).parent for source in sources) for file in folder.glob("*.st"))
    for at, folders, names in islice(os.walk(Path.cwd()), MOST_FOLDERS):
        folders[:] = sorted(folder for folder in folders if not folder.startswith((".", "_")))
        yield from (Path(at, name) for name in sorted(names) if name.lower().endswith(".st"))


def _without_other_programs(source: Source, name: str) -> Source:
    """The source with blanks in place of all programs but `name` and those that the rest names; lines keep their numbers."""
    text, _ = parse(source)
    programs = [node for node in text.declarations if isinstance(node, tree.Pou) and node.kind == "PROGRAM"]
    others = [node for node in programs if fold(node.name.text) != fold(name)]
    rest = _blanked(source.text, others)
    unused = [node for node in others if not re.search(rf"\b{re.escape(node.name.text)}\b", rest, re.I)]
    return Source(source.name, _blanked(source.text, unused))


def _blanked(text: str, nodes: Iterable[tree.Pou]) -> str:
    """A text with blanks in place of some POUs."""
    for node in nodes:
        text = text[: node.start] + re.sub(r"[^\n]", " ", text[node.start : node.end]) + text[node.end :]
    return text


def _read(path: Path) -> list[Source]:
    """The source in a file, or those within a project of another tool."""
    __tracebackhide__ = True
    name = os.path.relpath(path) if path.is_relative_to(Path.cwd()) else str(path)
    try:
        project = within(Path(name))
    except OSError as error:
        raise SubjectError(f"{name} cannot be read: {reason(error)}") from None
    if project is not None:
        if wrong := project.errors:
            raise SubjectError("\n".join(message.render() for message in wrong))
        return project.sources
    source = read(path, name)
    if not isinstance(source, Source):
        raise SubjectError(source.render())
    return [source]


def pous(source: Source) -> list[tree.Pou]:
    """The POUs that a text declares.  Raises SubjectError for syntax errors."""
    __tracebackhide__ = True
    text, diagnostics = parse(source)
    if wrong := errors(diagnostics):
        raise SubjectError("\n".join(message.render() for message in wrong))
    return [node for node in text.declarations if isinstance(node, tree.Pou)]


def _declared(sources: Sequence[Source], name: str, libraries: Sequence[Path], dialect: str) -> tuple[tree.Pou, Source]:
    __tracebackhide__ = True
    known = [(node, source) for source in sources for node in pous(source)]
    for node, source in known:
        if fold(node.name.text) == fold(name):
            return node, source
    found = _in_libraries(name, libraries, dialect)
    if found is None:
        there = ", ".join(node.name.text for node, _ in known)
        said = f"there is no {name}" + (f"; there is {there}" if there else " in any library")
        raise SubjectError("\n".join([said, *_hints([name], sources, libraries)]))
    return found


def _in_libraries(name: str, libraries: Sequence[Path], dialect: str) -> tuple[tree.Pou, Source] | None:
    shelves, report = Libraries(libraries, preferred=named_dialect(dialect).libraries), Report()
    for owner in shelves.names:
        for source, text in shelves.load(name, owner, report):
            for node in text.declarations:
                if isinstance(node, tree.Pou) and fold(node.name.text) == fold(name):
                    return node, source
    return None


# --- the program around a POU -----------------------------------------------------------------------------------------


def _variables(pou: tree.Pou, kind: str, source: Source) -> list[tuple[str, str]]:
    """Names and types, as written, of the variables of a section."""
    return [(name.text, source.text[row.spec.start : row.spec.end]) for section in pou.sections
            if section.kind == kind for row in section.variables for name in row.names]  # fmt: skip


def _wrapper(pou: tree.Pou, source: Source) -> str:
    """The text of a program that calls a block, or a function with variables of the names of its inputs and outputs.

    In-outs are connected to variables of the program, which a test names as the in-outs."""
    __tracebackhide__ = True
    name = pou.name.text
    in_outs = _variables(pou, "VAR_IN_OUT", source)
    if open_ones := [f"{each} : {kind}" for each, kind in in_outs if _OPEN.search(kind)]:
        raise SubjectError(f"{name} takes what has no type of its own, {', '.join(open_ones)}: test a PROGRAM that calls it "
                           "with a variable")
    if pou.kind == "FUNCTION_BLOCK":
        declared = [(INSTANCE, name), *((f"{INSTANCE}_{each}", kind) for each, kind in in_outs)]
        call = f"{INSTANCE}({', '.join(f'{each} := {INSTANCE}_{each}' for each, _ in in_outs)})"
    else:
        inputs, outputs = _variables(pou, "VAR_INPUT", source), _variables(pou, "VAR_OUTPUT", source)
        declared = [*inputs, *in_outs, *outputs]
        given = [f"{each} := {each}" for each, _ in (*inputs, *in_outs)] + [f"{each} => {each}" for each, _ in outputs]
        call = f"{name}({', '.join(given)})"
        if pou.result is not None:
            declared.append(("Result", source.text[pou.result.start : pou.result.end]))
            call = f"Result := {call}"
    lines = "".join(f"    {each} : {kind};\n" for each, kind in declared)
    return f"PROGRAM {WRAPPER}\nVAR\n{lines}END_VAR\n    {call};\nEND_PROGRAM\n"


# --- stubs ------------------------------------------------------------------------------------------------------------


def _stubbed(sources: list[Source], name: str, stub: str, libraries: Sequence[Path], dialect: str) -> list[Source]:
    """The sources with a stub in place of the POU, or of its body, of a name.  All other lines keep their numbers."""
    node, source = _declared(sources, name, libraries, dialect)
    text = stub
    if not _DECLARES.match(stub):
        start, end = _body(node, source)
        text = f"{source.text[node.start : start]}\n{stub}\n{source.text[end : node.end]}"
    text = text.strip().removesuffix(";") + "\n"
    kept = [Source(each.name, _blanked(each.text, [node])) if each is source else each for each in sources]
    return [*kept, Source(f"<stub of {node.name.text}>", text)]


def _body(node: tree.Pou, source: Source) -> tuple[int, int]:
    """Where the statements of a POU begin and end."""
    heads = [section.end for section in node.sections] + [node.name.end] + ([node.result.end] if node.result else [])
    closing = list(re.finditer(r"\bEND_(FUNCTION_BLOCK|FUNCTION|PROGRAM)\b", source.text[: node.end], re.I))
    return max(heads), closing[-1].start()
