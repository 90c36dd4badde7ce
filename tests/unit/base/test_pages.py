"""Every code has its page, and the programs on it do what the page says."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from zipfile import ZipFile

import pytest
from rows import each_of

from fbvm.base.codes import CODES
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.pages import UnknownCode, near, page
from fbvm.code.compiler import Compilation, compile_sources
from fbvm.engine.allowance import Allowance
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.cx.write.exporting import export_into
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.interchange.twincat.objects import read_object
from fbvm.machine.plc import Plc
from fbvm.run.project import Project, read_project
from fbvm.syntax.text import decode

SCANS = 3
BUDGET = 100_000
"""Statements that a program of a page may execute in one scan: endless ones end soon."""
ROWS = 12
"""Lines of a program that still fit on a page; a reader sees the difference between two such programs."""

PAGE = re.compile(
    r"# (?P<title>[^\n]+)\n\n(?P<reason>.+?)\n\n"
    r"## Wrong\n\n```(?P<language>st|sh|toml|xml|text)\n(?P<wrong>.+?)```\n\n"
    r"## Right\n\n```(?P=language)\n(?P<right>.+?)```"
    r"(?:\n\n## See also\n(?P<neighbours>(?:\n- [^\n]+)+))?",
    re.DOTALL,
)

project_codes = [code for code in CODES if code.startswith("P01")]
library_codes = [code for code in CODES if code.startswith("P02")]
xml_codes = [code for code in CODES if code.startswith("X")]
program_codes = [code for code in CODES if code != "S0107" and code not in project_codes + library_codes + xml_codes]
"""All of programs but that of a file which is no text, and which a page cannot show."""
source_codes = [code for code in program_codes if code.startswith("S")]
trap_codes = [code for code in program_codes if code.startswith("R")]


@cache
def parts(code: str) -> dict[str, str]:
    """What stands under each heading of a page."""
    found = PAGE.fullmatch(page(code))
    assert found, f"the page of {code} has another form"
    return found.groupdict(default="")


limits = {"R0112": BUDGET // 2}
"""With how many steps left the watch cycle time is over, for the page about it."""


def compiled(text: str) -> Compilation:
    """A program of a page, in the dialect that a comment names."""
    dialect = re.search(r"// --dialect (\w+)", text)
    return compile_sources([Source("page.st", text)], runnable=True, dialect=dialect[1] if dialect else "standard")


def shown(compilation: Compilation) -> str:
    return "\n".join(diagnostic.render() for diagnostic in compilation.diagnostics)


def trap_of(compilation: Compilation, limit: int = 0) -> str:
    """The code of the trap that ends the first scans, "" if none does.  With fewer steps left than `limit` time is up."""
    assert compilation.image is not None, shown(compilation)
    plc = Plc(compilation.image, budget=BUDGET)
    plc.engine.allowance = Allowance(limit)
    plc.run(scans=SCANS)
    return plc.trap.code if plc.trap else ""


# --- the form of a page -----------------------------------------------------------------------------------------------


def breaking(rule: Callable[[str], bool], codes: Iterable[str] = CODES) -> list[str]:
    """The codes whose page does not keep a rule."""
    return [code for code in codes if not rule(code)]


def has_neighbours(code: str) -> bool:
    """What a page names beside its own code is other codes with their titles, once each."""
    neighbours = re.findall(r"^- (.+)$", parts(code)["neighbours"], re.MULTILINE)
    rows = [f"{row.code} {row.title}" for row in CODES.values() if row.code != code]
    return len(set(neighbours)) == len(neighbours) and set(neighbours) <= set(rows)


def is_a_small_change(code: str) -> bool:
    wrong, right = (set(parts(code)[half].splitlines()) for half in ("wrong", "right"))
    return bool(wrong & right) and wrong != right


def test_the_title_is_that_of_the_table() -> None:
    assert breaking(lambda code: parts(code)["title"] == f"{code} {CODES[code].title}") == []


def test_the_reason_is_one_paragraph() -> None:
    assert breaking(lambda code: "\n\n" not in parts(code)["reason"]) == []


def test_a_page_fits_on_a_screen() -> None:
    assert breaking(lambda code: max(map(len, page(code).splitlines())) <= 120) == []
    assert breaking(lambda code: all(len(parts(code)[half].splitlines()) <= ROWS for half in ("wrong", "right"))) == []


def test_neighbours_are_other_codes_with_their_titles() -> None:
    assert breaking(has_neighbours) == []


def test_both_programs_are_nearly_the_same() -> None:
    assert breaking(is_a_small_change, program_codes) == []


def test_no_page_is_left_over() -> None:
    import fbvm.base.pages as module

    assert {path.stem for path in Path(module.__file__).with_suffix("").iterdir()} == set(CODES)


# --- what its programs do ---------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("code", source_codes)
def test_the_wrong_program_gives_this_diagnostic_and_no_other(code: str) -> None:
    compilation = compiled(parts(code)["wrong"])
    assert [diagnostic.code for diagnostic in compilation.diagnostics] == [code], shown(compilation)


@pytest.mark.slow
@each_of("code", [code for code in source_codes if CODES[code].severity == "warning"])
def test_a_program_with_a_warning_runs(code: str) -> None:
    assert trap_of(compiled(parts(code)["wrong"])) == ""


@pytest.mark.slow
@each_of("code", trap_codes)
def test_the_wrong_program_compiles_and_traps(code: str) -> None:
    compilation = compiled(parts(code)["wrong"])
    assert not compilation.diagnostics, shown(compilation)
    assert trap_of(compilation, limits.get(code, 0)) == code


@pytest.mark.slow
@each_of("code", program_codes)
def test_the_right_program_compiles_without_a_word_and_runs(code: str) -> None:
    compilation = compiled(parts(code)["right"])
    assert not compilation.diagnostics, shown(compilation)
    assert trap_of(compilation, limits.get(code, 0)) == ""


@pytest.mark.parametrize("code", project_codes)
def test_the_wrong_project_gives_this_diagnostic_and_the_right_one_none(code: str, tmp_path: Path) -> None:
    file = tmp_path / "fbvm.toml"
    file.write_text(parts(code)["wrong"], encoding="utf-8")
    found = read_project(file)
    assert isinstance(found, list)
    assert [diagnostic.code for diagnostic in found] == [code]
    file.write_text(parts(code)["right"], encoding="utf-8")
    assert isinstance(read_project(file), Project)


@pytest.mark.parametrize("code", library_codes)
def test_the_wrong_library_gives_this_diagnostic_and_the_right_one_none(code: str, tmp_path: Path) -> None:
    program = Source("page.st", "PROGRAM Main VAR x : INT; END_VAR x := x + 1; END_PROGRAM")
    for half, expected in (("wrong", [code]), ("right", [])):
        (tmp_path / "library.toml").write_text(parts(code)[half], encoding="utf-8")
        found = compile_sources([program], libraries=[tmp_path]).diagnostics
        assert [diagnostic.code for diagnostic in found] == expected


def found_in(text: str) -> list[Diagnostic]:
    """The diagnostics of a document: XML of PLCopen or TwinCAT, a project of CX-Programmer, sources, or sources that are written
    into a project."""
    if text.startswith("<TcPlcObject"):
        return read_object(text.encode(), "page.TcPOU").diagnostics
    if text.startswith("<"):
        return import_xml(text.encode()).diagnostics
    if not text.startswith("CX"):
        return export_xml([Source("page.st", text)]).diagnostics
    saved, into, source = text.partition("(* into *)\n")
    if into:
        return export_into(saved.encode(), "page.cxt", [Source("page.st", source)], False).diagnostics
    return import_project(saved.encode(), "page.cxt").diagnostics


@pytest.mark.slow
@each_of("code", xml_codes)
def test_the_wrong_document_gives_this_diagnostic_and_the_right_one_none(code: str) -> None:
    for half, expected in (("wrong", [code]), ("right", [])):
        assert [diagnostic.code for diagnostic in found_in(parts(code)[half])] == expected


def test_a_file_that_is_no_text_has_a_page_for_the_shell() -> None:
    text = "PROGRAM Main END_PROGRAM"
    assert text in parts("S0107")["wrong"]
    refused = decode(text.encode("utf-16-le"), "pump.st")
    assert isinstance(refused, Diagnostic)
    assert refused.code == "S0107"
    assert refused.render().splitlines()[0] in parts("S0107")["wrong"].splitlines()
    mended = decode(text.encode("utf-8"), "pump8.st")
    assert isinstance(mended, Source)
    assert compile_sources([mended]).diagnostics == []


# --- finding a page ---------------------------------------------------------------------------------------------------


def test_case_and_spaces_do_not_matter() -> None:
    assert page(" s0203 ") == page("S0203")


@each_of(("misspelt", "meant"), [
    ("S203", "S0203"), ("S02003", "S0203"), ("SO203", "S0203"), ("0203", "S0203"), ("R0113", "R0112"),
    ("s0299", "S0294"), ("watchdog", "R0104"), ("Division", "R0101"),
])
def test_a_misspelt_code_lists_those_near_it(misspelt: str, meant: str) -> None:
    assert CODES[meant] in near(misspelt)
    with pytest.raises(UnknownCode, match=f"there is no diagnostic {misspelt}; near it are") as raised:
        page(misspelt)
    assert f"{meant}  {CODES[meant].title}" in str(raised.value)


def test_a_code_of_a_known_range_lists_that_range_only() -> None:
    assert {row.code[:3] for row in near("S0299")} == {"S02"}


@each_of("nonsense", ["", "   ", "q1y2", "../codes"])
def test_nonsense_lists_nothing(nonsense: str) -> None:
    with pytest.raises(UnknownCode) as raised:
        page(nonsense)
    assert (raised.value.near, str(raised.value)) == ([], f"there is no diagnostic {nonsense}")


@pytest.mark.slow
def test_the_wheel_holds_every_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from hatchling.build import build_wheel

    monkeypatch.chdir(Path(__file__).resolve().parents[3])
    with ZipFile(tmp_path / build_wheel(str(tmp_path))) as wheel:
        held = {name for name in wheel.namelist() if name.startswith("fbvm/base/pages/")}
    assert held == {f"fbvm/base/pages/{code}.md" for code in CODES}
