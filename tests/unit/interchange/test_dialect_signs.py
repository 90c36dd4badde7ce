"""Signs in sources that tell the dialect for which they were written."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import DIALECTS
from fbvm.cli.main import main
from fbvm.interchange.dialect_signs import guessed

DOCUMENTS = Path(__file__).parents[2] / "plcopen" / "documents"


@each_of(("text", "dialect"), [
    ("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM", "standard"),
    ("{attribute 'qualified_only'}\nVAR_GLOBAL n : INT; END_VAR", "codesys"),
    ("PROGRAM Main VAR p : POINTER TO INT; END_VAR END_PROGRAM", "codesys"),
    ("PROGRAM Main VAR s : T_MaxString; f : FB_FormatString; END_VAR END_PROGRAM", "twincat"),
    ("CONFIGURATION Config0 RESOURCE Res0 ON PLC END_RESOURCE END_CONFIGURATION", "matiec"),
    ("PROGRAM Main VAR c : RTC; END_VAR END_PROGRAM", "matiec"),
    ("{external} FUNCTION f : INT END_FUNCTION", "rusty"),
    ("CONFIGURATION config RESOURCE resource1 ON PLC END_RESOURCE END_CONFIGURATION", "matiec"),
    ("TEST 'the lamp is on'\nEND_TEST", "strucpp"),
    ("PROGRAM Main VAR k : SMC_TRAFO; END_VAR END_PROGRAM", "codesys"),
    ("PROGRAM Main // POINTER TO\nVAR s : STRING := '{attribute'; (* RESOURCE Res0 ON PLC *) END_VAR END_PROGRAM", "standard"),
])
def test_constructs_tell_the_dialect(text: str, dialect: str) -> None:
    found = guessed([], [Source("main.st", text)])
    assert found.dialect == dialect
    assert ("main.st" in found.because) == (dialect != "standard")


@each_of(("name", "dialect"), [("LIB/FILL.EXP", "codesys2"), ("plc/pous/programs/main.st", "matiec"),
                            ("plc/programs/main.st", "standard")])
def test_names_of_files_tell_the_dialect(name: str, dialect: str) -> None:
    found = guessed([], [Source(name, "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM")])
    assert found.dialect == dialect
    assert (f"the file {name}" in found.because) == (dialect != "standard")


def test_the_tool_that_wrote_a_document_counts_more_than_constructs() -> None:
    found = guessed([("beremiz", "the header names Beremiz")], [Source("a.st", "VAR p : POINTER TO INT; END_VAR")])
    assert (found.dialect, found.because) == ("matiec", "the header names Beremiz")


@pytest.mark.slow
@each_of(("name", "dialect", "reason"), [("beremiz.xml", "matiec", "it has a Config0 with a Res0"),
                                         ("codesys.xml", "codesys", "the header names CODESYS")])
def test_a_document_is_checked_in_the_dialect_of_its_tool_which_is_said(name: str, dialect: str, reason: str) -> None:
    done = CliRunner().invoke(main, ["check", str(DOCUMENTS / name), "--dialect", "auto", "--json", "--no-warn", "all"])
    assert f"dialect {dialect}: {reason}" in done.stderr
    assert "X0101" not in done.stdout


class Project(NamedTuple):
    """A project of the table: its name, the dialect, words of the reason, the code of an error if it is refused, its files."""

    name: str
    dialect: str
    reason: str
    refused: str
    files: dict[str, str]


def read_projects() -> Iterator[Project]:
    """The projects of `dialect_projects.txt`, in their order."""
    table = Path(__file__).with_name("dialect_projects.txt").read_text(encoding="utf-8")
    for piece in re.split(r"(?m)^==== ", table)[1:]:
        head, *files = re.split(r"(?m)^---- ", piece)
        name, said, *refused = head.strip().splitlines()
        dialect, reason = said.split(": ", 1)
        yield Project(name, dialect, reason, refused[0].removeprefix("refused: ") if refused else "",
                      dict(file.split("\n", 1) for file in files))


PROJECTS = tuple(read_projects())


@pytest.mark.slow
@each_of("project", PROJECTS, ids=lambda project: project.name)
def test_auto_takes_the_dialect_of_a_project_which_it_is_accepted_in(project: Project, tmp_path: Path) -> None:
    folder = tmp_path / str(PROJECTS.index(project))
    paths = [folder / name for name in project.files]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(project.files[path.relative_to(folder).as_posix()], encoding="utf-8")
    done = CliRunner().invoke(main, ["check", *map(str, paths), "--dialect", "auto", "--no-warn", "all"])
    said = done.stderr.replace(f"{folder}{os.sep}", "").replace("\\", "/")
    assert f"dialect {project.dialect}: {project.reason}\n" in said
    assert (done.exit_code == 0) is not bool(project.refused), done.output
    assert project.refused in done.output


def test_there_are_projects_of_every_dialect() -> None:
    assert {project.dialect for project in PROJECTS} == set(DIALECTS)
    assert len(PROJECTS) >= 20
