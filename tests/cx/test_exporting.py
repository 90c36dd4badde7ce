"""Sources into a project that was saved: what differs is replaced, every other byte stays, and counters fit."""

from __future__ import annotations

import difflib
import re

import pytest
from click.testing import CliRunner
from cx_text import SAMPLE, Cxt
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.cli.main import main
from fbvm.interchange.cx.compression import compress, decompress
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.cx.write.exporting import ExportedProject, export_into

LATER = Cxt(
    ("Start,0.00,BOOL,,,start button", "Pump,100.00,BOOL,,,", "Level,D100,CHANNEL,,,raw, ", "No,520,NUMBER,,,"),
    local=("Helper,,BOOL,,A,",),
    sections=(
        ("One", ("LD Start\nOUT Pump", "# alone", "LD Pump\n//  0\nMOV(021) #0001 Level\n~ a note", "")),
        ("END", ("END(001)", "")),
    ),
)
"""Two sections of plain rungs."""


def exported(cxt: Cxt, *changes: tuple[str, str], compressed: bool = False) -> ExportedProject:
    """The project with its own sources, in which texts are replaced."""
    sources = []
    used = set()
    for name, text in import_project(cxt.bytes(), "line.cxt").files.items():
        for old, new in changes:
            if old in text:
                used.add(old)
                text = text.replace(old, new)
        sources.append(Source(name, text))
    assert used == {old for old, _ in changes}
    return export_into(cxt.bytes(), "line.cxt", sources, compressed)


def difference(cxt: Cxt, made: ExportedProject) -> list[str]:
    """The lines that were taken away and added."""
    assert made.data is not None, [d.render() for d in made.diagnostics]
    before, after = cxt.bytes().decode("cp1252").split("\n"), made.data.decode("cp1252").split("\n")
    return [line.rstrip("\r") for line in difflib.ndiff(before, after) if line[0] in "+-"]


def again(made: ExportedProject) -> dict[str, str]:
    assert made.data is not None, [d.render() for d in made.diagnostics]
    found = import_project(made.data, "again.cxt")
    assert not found.diagnostics
    return found.files


@pytest.mark.slow
def test_sources_that_say_the_same_change_no_byte() -> None:
    for cxt in (SAMPLE, LATER):
        made = exported(cxt)
        assert made.data == cxt.bytes()
        assert made.changed == []


@pytest.mark.slow
def test_a_program_without_symbols_of_its_own_and_sections_without_rungs_stay_as_they_are() -> None:
    saved = Cxt(sections=(("One", ("LD 0.00\nOUT 1.00",)), ("Two", ("",)), ("Three", ()))).bytes()
    data = re.sub(rb"(?s) *LocalVariables:=.*? END;\s+(?=TaskID)", b"", saved)
    assert b"LocalVariables" not in data and len(data) < len(saved)
    files = import_project(data, "line.cxt").files
    for old, new, changed in (("", "", []), ("LD      0.00", "LDNOT   0.00", ["NewProgram1, section One: 1 rung changed"])):
        made = export_into(data, "line.cxt", [Source(name, text.replace(old, new)) for name, text in files.items()], False)
        assert (made.diagnostics, made.changed, made.data == data) == ([], changed, not changed)
    with_symbol = files | {"NewProgram1.st": files["NewProgram1.st"].replace("    LADDER", "VAR n : INT; END_VAR\n    LADDER")}
    made = export_into(data, "line.cxt", [Source(name, text) for name, text in with_symbol.items()], False)
    assert made.data is None and [(said.code, said.message) for said in made.diagnostics] == [
        ("X0402", "symbol of NewProgram1 n: the project that was saved has no table of symbols for it")]


def test_one_rung_that_changes_changes_that_rung_only() -> None:
    made = exported(LATER, ("LD      Start\n", "LD      Start\n        ANDNOT  Pump\n"))
    assert difference(LATER, made) == ["+ ANDNOT Pump"]
    assert made.changed == ["NewProgram1, section One: 1 rung changed"]


@pytest.mark.slow
def test_a_new_rung_moves_numbers_of_rungs_and_markers() -> None:
    made = exported(
        LATER,
        (
            "RUNG 1 alone",
            'RUNG 9 the "new" one\n        LD      Start // first, start\n        TIM     0001 #0010\n    RUNG 1 alone',
        ),
    )
    text = made.data.decode("cp1252") if made.data else ""
    assert "RC:=5;" in text
    assert "TIM 0001 #0010\n" in text
    assert '0:="first, start";' in text
    numbers = [
        int(number)
        for number in re.findall(r"(?:^|\n)\$\?St\$Bk\?_#\[(\d+)\]|BEGIN_LIST_\$#\[(\d+)\]", text)
        for number in number
        if number
    ]
    assert sorted(set(numbers)) == list(range(1, max(numbers) + 1))
    assert [line.strip() for line in again(made)["NewProgram1.st"].splitlines() if "RUNG" in line] == [
        "RUNG 0", 'RUNG 1 the "new" one', "RUNG 2 alone", "RUNG 3", "RUNG 4"]  # fmt: skip


@pytest.mark.slow
def test_a_rung_that_goes_takes_its_marker_along() -> None:
    made = exported(LATER, ("RUNG 1 alone\n", ""))
    assert made.data is not None
    assert b"RC:=3;" in made.data
    assert made.changed == ["NewProgram1, section One: 1 rung removed"]
    assert "alone" not in again(made)["NewProgram1.st"]


def test_symbols_get_comments_addresses_and_rows() -> None:
    made = exported(LATER, ("// start button", "// the green one"), ("Pump  AT CIO 100.00", "Pump  AT CIO 100.01"),
                    ("VAR_GLOBAL\n", "VAR_GLOBAL\n    Extra AT D7 : INT; // more, of it\n"))  # fmt: skip
    assert [line for line in difference(LATER, made) if line[0] == "+"] == [
        "+    Start,0.00,BOOL,,,the green one;", "+    Pump,100.01,BOOL,,,;", '+    Extra,D7,INT,,,"more, of it";',
        "+   VariableCount:=5;"]  # fmt: skip
    assert sorted(made.changed) == ["global symbol Extra", "global symbol Pump", "global symbol Start"]
    assert "VariableCount:=5;" in (made.data or b"").decode("cp1252")


@each_of(("version", "row"), [("1.5", "Extra,,INT,A,more"), ("1.8", "Extra,,INT,,A,more"), ("2.2", "Extra,,INT,,A,,more")])
def test_a_new_symbol_has_as_many_fields_as_the_format_of_its_file(version: str, row: str) -> None:
    cxt = Cxt(sections=(("One", ("LD 0.00\nOUT 1.00",)),), version=version, symbols=("Pump,100.00,BOOL,,",))
    made = exported(cxt, ("VAR_GLOBAL\n", "VAR_GLOBAL\n    Extra : INT; // more\n"))
    assert f"+    {row};" in difference(cxt, made)


ANEW = "save the project anew"


@pytest.mark.slow
@each_of(("old", "new", "file", "place", "message", "hint"), [
    ("PROGRAM NewProgram1", "PROGRAM Other", "NewProgram1.st", (1, 9, "O"),
     "the project that was saved has no program Other", f"insert it in CX-Programmer, and {ANEW}"),
    ("SECTION END", "SECTION Last", "NewProgram1.st", (1, 9, "N"),
     "program NewProgram1 has no section Last in the project that was saved", f"insert it in CX-Programmer, and {ANEW}"),
    ("FBCALL  DOUBLE Dbl1 X:=D100 Y=>D101", "FBCALL  DOUBLE Dbl1 X:=D200 Y=>D101", "NewProgram1.st", (18, 5, "R"),
     "a rung that calls a function block is stored as cells, not written",
     "leave the rung as it was saved, and change it in CX-Programmer"),
    ("++(590) Runs", "++(590) X", "DOUBLE.st", (1, 1, "F"),
     "DOUBLE differs from what was saved, and function blocks are not written", ""),
    ("FUNCTION_BLOCK DOUBLE", "FUNCTION_BLOCK TRIPLE", "DOUBLE.st", (1, 1, "F"),
     "the project that was saved has no TRIPLE", f"make the function block in CX-Programmer, and {ANEW}"),
    ("// start button", "// кнопка", "globals.st", (1, 1, ""),
     "the character '\\u043a' is not in cp1252, the code page of the project", "write the comment in letters of that code page"),
    ("Helper : BOOL", "Helper : TON", "NewProgram1.st", (6, 5, "H"),
     "symbol of NewProgram1 Helper: a table of symbols has no type TON; instances are made in CX-Programmer", "")])
def test_what_has_no_place_is_refused_and_nothing_is_written(old: str, new: str, file: str, place: tuple[int, int, str],
                                                             message: str, hint: str) -> None:
    made = exported(SAMPLE, (old, new))
    assert (made.data, made.changed) == (None, [])
    said, = made.diagnostics
    assert (said.code, said.source.name, said.message, said.hint) == ("X0402", file, message, hint)
    assert (said.line, said.column, said.source.text[said.start : said.end]) == place


@pytest.mark.slow
def test_a_folder_goes_back_into_the_compressed_project(tmp_path) -> None:  # type: ignore[no-untyped-def]
    saved, out, folder = tmp_path / "saved.cxp", tmp_path / "line.cxp", tmp_path / "sources"
    saved.write_bytes(compress(SAMPLE.bytes()))
    run = CliRunner().invoke
    assert run(main, ["import", str(saved), "-o", str(folder)]).exit_code == 0
    program = folder / "NewProgram1.st"
    program.write_text(program.read_text().replace("OR      Pump", "OR      Pump\n        AND     0.05"))
    done = run(main, ["export", str(folder), "--into", str(saved), "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "section Pumping: 1 rung changed" in done.output
    assert "has not been tried" in done.output
    assert b"OR Pump\nAND 0.05\n" in decompress(out.read_bytes())
    assert run(main, ["check", str(out)]).exit_code == 0
    assert (
        run(main, ["run", str(out), "--set", "Start_PB=TRUE", "--set", "0.05=TRUE", "--for", "50ms", "--show", "Pump"]).output
        == "Pump = TRUE\n"
    )
