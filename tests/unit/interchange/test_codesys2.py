"""Files of CODESYS 2.3: exports as text, and libraries in the form that they were found to have."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from codesys2_files import EXPORT, LIBRARY, binary_object
from growth import assert_linear, assert_within_s, least_s
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.cli.main import main
from fbvm.code.compiler import compile_sources
from fbvm.interchange.codesys2.importing import import_codesys2, read_export
from fbvm.interchange.formats.given import usual_dialect, within
from fbvm.machine.plc import Plc

DIAGRAM = EXPORT.replace("d(IN := r + 1);\nr := d.OUT;", "_FBD_BODY\n_NETWORKS : 1\n_NETWORK\n_OUTPUTS : 0")


def test_an_export_runs_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "project.exp"
    path.write_bytes(EXPORT.encode("cp1252").replace(b"\n", b"\r\n"))
    made = within(path)
    assert made is not None and usual_dialect([path]) == "codesys2"
    source, = made.sources
    assert source.text.count("\n") == EXPORT.count("\n")
    assert [said.message for said in made.diagnostics] == ["the task Fast is not taken over"]
    compiled = compile_sources([source], runnable=True, dialect="codesys2")
    assert compiled.image is not None
    plc = Plc(compiled.image)
    for expected in (2, 6, 14):
        plc.scan()
        assert plc.read("PLC_PRG.r") == expected
    assert plc.read("Calls") == 3


def test_an_import_of_an_export_makes_a_file_of_each_object() -> None:
    made = import_codesys2(EXPORT.encode(), "project.exp")
    assert list(made.files) == ["Doubler.st", "PLC_PRG.st", "Settings.st"] and not made.errors
    assert made.files["Doubler.st"].endswith("END_ACTION\n") and "@" not in "".join(made.files.values())
    assert compile_sources(made.sources, runnable=True, dialect="codesys2").image is not None


def test_an_object_without_a_declaration_makes_no_file() -> None:
    objects = ("PROGRAM P\nVAR n : INT; END_VAR\nn := 1;\nEND_PROGRAM\n", "n := 1;\n", "", "VAR_GLOBAL\nEND_VAR\n",
               "VAR_GLOBAL\na : INT;\nEND_VAR\n")  # fmt: skip
    made = import_codesys2("".join(f"(* @PATH := '' *)\n{each}" for each in objects).encode(), "project.exp")
    assert made.files == {"P.st": objects[0], "Globals.st": objects[4]} and not made.diagnostics


def test_a_diagram_of_an_export_is_refused_by_name() -> None:
    made = import_codesys2(DIAGRAM.encode(), "project.exp")
    error, = made.errors
    assert error.code == "X0203" and "PROGRAM PLC_PRG is a diagram (FBD)" in error.message
    assert DIAGRAM[error.start:].startswith("_OUTPUTS : 0")


def test_a_library_is_read_and_found_by_name(tmp_path: Path) -> None:
    (tmp_path / "own.lib").write_bytes(LIBRARY)
    done = CliRunner().invoke(main, ["import", str(tmp_path / "own.lib"), "-o", str(tmp_path / "libs" / "own")])
    assert done.exit_code == 0 and "the PROGRAM Demo of the library is a diagram and is left out" in done.output
    assert sorted(path.name for path in (tmp_path / "libs" / "own").iterdir()) == \
        ["Limits.st", "Pair.st", "Sum.st", "Twice.st", "library.toml"]
    assert "für alle" in (tmp_path / "libs" / "own" / "Limits.st").read_text(encoding="utf-8")
    program = Source("main.st", "PROGRAM Main VAR p : Pair := (a := 2, b := 9); n, top : INT; t : Twice; END_VAR\n"
                     "n := Sum(p); top := HIGHEST; t(n := n); END_PROGRAM")
    image = compile_sources([program], runnable=True, dialect="codesys2", libraries=[tmp_path / "libs"]).image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    assert (plc.read("Main.n"), plc.read("Main.top"), plc.read("Main.t.m")) == (5, 5, 10)


NO_TEXT = "open the project in CODESYS 3 and export it as PLCopen XML"


@each_of(("name", "declared", "code", "message", "hint"), [
    ("own.pro", "PROGRAM P", "X0203", "the body of PROGRAM P is a diagram, which is not read from own.pro", NO_TEXT),
    ("a.lib", "FUNCTION_BLOCK P", "X0203", "the body of FUNCTION_BLOCK P is a diagram, which is not read from a.lib", NO_TEXT),
    ("a.lib", "FUNCTIONBLOCK P", "X0203", "the body of FUNCTION_BLOCK P is a diagram, which is not read from a.lib", NO_TEXT),
    ("own.lib", "PROGRAM P", "X0190", "the PROGRAM P of the library is a diagram and is left out", ""),
    ("OWN.LIB", "PROGRAM P", "X0190", "the PROGRAM P of the library is a diagram and is left out", "")])
def test_a_pou_whose_body_is_a_diagram_is_named(name: str, declared: str, code: str, message: str, hint: str) -> None:
    data = b"CoDeSys+" + bytes(50) + binary_object("L", "VAR_GLOBAL\n\tg : INT;\nEND_VAR\n") \
        + binary_object("P", f"{declared}\nVAR x : INT; END_VAR\n", "not text", kind=0x29)
    made = import_codesys2(data, name)
    assert made.diagnostics == [Diagnostic(code, Source(name, ""), 0, 0, message, hint)]
    assert made.files == {"L.st": "VAR_GLOBAL\n\tg : INT;\nEND_VAR\n"} and not made.is_text
    assert (made.family, made.because) == ("codesys2", f"{name} is a file of CODESYS 2.3")


def test_an_export_of_one_pou_without_marks_begins_at_its_first_character() -> None:
    text = "PROGRAM P\nVAR x : INT; END_VAR\nx := 1;\nEND_PROGRAM\n"
    made = import_codesys2(text.encode(), "own.exp")
    assert (made.files, made.diagnostics, made.is_text) == ({"P.st": text}, [], True)


def test_a_file_without_declarations_says_how_to_export_it() -> None:
    made = import_codesys2(b"CoDeSys+" + bytes(50), "own.pro")
    assert made.diagnostics == [Diagnostic("X0105", Source("own.pro", ""), 0, 0, "own.pro has no declaration that can be read",
                                           "export the project as text from CODESYS: Project > Export")] and not made.files


def test_a_damaged_library_is_refused() -> None:
    for data in (LIBRARY[:60], b"CoDeSys+" + bytes(1000), b"CoDeSys+\xff\xff\xff\xffPROGRAM"):
        made = import_codesys2(data, "own.lib")
        assert not made.files and [error.code for error in made.errors] == ["X0105"]
    for cut in range(60, len(LIBRARY), 37):
        import_codesys2(LIBRARY[:cut], "own.lib")


def test_a_diagram_in_the_first_line_of_an_export_has_the_name_of_its_pou() -> None:
    text = "PROGRAM First\nVAR\nEND_VAR\n_CFC_BODY\n_ITEMS : 0\nEND_PROGRAM\n(* @NESTEDCOMMENTS := 'Yes' *)\n"
    [error] = import_codesys2(text.encode(), "first.exp").errors
    assert error.message == ("the body of PROGRAM First is a diagram (CFC), which is not read from an export as text: "
                             "only ladder and FBD are read")
    assert error.source.text[error.start : error.end] == "_CFC_BODY"


@pytest.mark.slow
@each_of("part", [
    "VISUALISATION V{}\nEND_VISUALISATION\n", "LIBRARY\nL{}.lib\nEND_LIBRARY\n", "ACTION A{}:\nx := 1;\nEND_ACTION\n",
    "FUNCTION_BLOCK B{}\nVAR END_VAR\n_CFC_BODY\n_ITEMS : 0\nEND_FUNCTION_BLOCK\n",
])
def test_the_time_of_an_export_grows_with_its_parts(part: str) -> None:
    def prepared(count: int) -> Callable[[], object]:
        text = EXPORT + "".join(part.format(number) for number in range(count))
        return lambda: read_export(text.encode(), "many.exp")

    assert_linear(prepared, 1000)


@pytest.mark.slow
def test_the_time_of_a_damaged_library_does_not_grow_with_the_lengths_that_it_claims() -> None:
    def work(length: int) -> Callable[[], object]:
        data = b"CoDeSys+" + bytes(50) + (length.to_bytes(4, "little") + b"TYPE ") * 10_000 + bytes(1 << 20)
        return lambda: import_codesys2(data, "own.lib")

    assert_within_s(work((1 << 20) - 1), 3 * least_s(work(1023)))
