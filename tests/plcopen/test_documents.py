"""Whole documents in the manner of the editors: what comes of them can be checked and run as any other source."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from drawings import plc as running
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.cli.main import main
from fbvm.code.compiler import compile_files, compile_sources
from fbvm.interchange.formats.given import usual_dialect
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.machine.plc import Plc

DOCUMENTS = Path(__file__).parent / "documents"


@pytest.mark.slow
def test_a_project_of_beremiz_is_checked_without_a_word_and_runs(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["import", str(DOCUMENTS / "beremiz.xml"), "-o", str(tmp_path / "made")])
    assert done.exit_code == 0, done.output
    files = sorted((tmp_path / "made").glob("*.st"))
    assert {file.stem for file in files} == {"Config0", "Counting", "Mean", "Pump", "types"}
    compiled = compile_files(files, runnable=True)
    assert compiled.image is not None
    assert not compiled.diagnostics
    plc = Plc(compiled.image)
    plc.write("%IX0.0", True)
    plc.scan()
    assert plc.read("%QX0.0") is True
    assert plc.read("Instance0.n") == 17
    plc.run(scans=4)
    assert plc.read("Instance0.Lamp") is True
    assert plc.read("Instance0.n") == 18


def test_a_project_of_codesys_keeps_its_lists_of_globals_and_its_methods(tmp_path: Path) -> None:
    made = import_xml(DOCUMENTS / "codesys.xml")
    assert set(made.files) == {"types.st", "GVL.st", "Plant.st", "PLC_PRG.st", "Device.st"}
    assert made.errors == []
    assert "    METHOD Reset\n        full := FALSE;\n    END_METHOD\n" in made.files["PLC_PRG.st"]
    assert "RUNG 1 The press runs" in made.files["PLC_PRG.st"]
    assert "// Parts are counted" in made.files["PLC_PRG.st"]
    compiled = compile_sources([Source(name, text) for name, text in made.files.items()], runnable=True)
    assert compiled.image is not None, [d.render() for d in compiled.diagnostics]
    plc = Plc(compiled.image, 20_000_000)
    for scan in range(6):
        plc.write("PLC_PRG.start", scan % 2 == 0)
        plc.scan()
    assert plc.read("PLC_PRG.run") is True
    assert (plc.read("PLC_PRG.sum"), plc.read("PLC_PRG.full"), plc.read("PLC_PRG.part")["name"]) == (6, True, "new")


@pytest.mark.slow
def test_importing_again_gives_the_same_to_the_letter() -> None:
    data = (DOCUMENTS / "beremiz.xml").read_bytes()
    first, second = import_xml(data), import_xml(data)
    assert first.files == second.files
    assert [d.render() for d in first.diagnostics] == [d.render() for d in second.diagnostics]


@pytest.mark.slow
def test_files_that_are_there_stay_without_force(tmp_path: Path) -> None:
    (tmp_path / "Pump.st").write_text("mine", encoding="utf-8")
    command = ["import", str(DOCUMENTS / "beremiz.xml"), "-o", str(tmp_path)]
    refused = CliRunner().invoke(main, command)
    assert refused.exit_code == 2
    assert "--force" in refused.output
    assert (tmp_path / "Pump.st").read_text(encoding="utf-8") == "mine"
    assert CliRunner().invoke(main, [*command, "--force"]).exit_code == 0
    assert "PROGRAM Pump" in (tmp_path / "Pump.st").read_text(encoding="utf-8")


def test_a_document_of_twincat_is_imported(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["import", str(DOCUMENTS / "twincat.xml"), "-o", str(tmp_path / "made")])
    assert done.exit_code == 0
    assert "--dialect twincat" in done.output
    assert "P_Strokes : UDINT" in (tmp_path / "made" / "FB_Press.st").read_text(encoding="utf-8")
    assert "// network 7\n    Edge_70000000002(CLK := bStart);" in (tmp_path / "made" / "MAIN.st").read_text(encoding="utf-8")
    refused = CliRunner().invoke(main, ["import", str(DOCUMENTS / "x.TcPOU"), "-o", str(tmp_path / "made")])
    assert refused.exit_code == 2


def test_a_program_that_lacks_something_has_status_3(tmp_path: Path) -> None:
    file = tmp_path / "bad.xml"
    file.write_text("<project/>", encoding="utf-8")
    done = CliRunner().invoke(main, ["import", str(file), "-o", str(tmp_path / "made"), "--json"])
    assert done.exit_code == 3
    assert '"code": "X0104"' in done.output


def test_no_list_of_globals_is_lost_when_files_of_two_would_have_one_name() -> None:
    listed = "".join(f'<globalVars name="{name}"><variable name="{variable}"><type><INT/></type></variable></globalVars>'
                     for name, variable in (("Line 1", "a"), ("Line.1", "b"), ("line_1", "c"), ("Line 1", "d"), ("Types", "e")))
    made = import_xml(f'<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes><dataType name="Level">'
                      f'<baseType><INT/></baseType></dataType></dataTypes><pous/></types><addData><data>{listed}</data></addData>'
                      f'</project>'.encode())
    assert not made.errors
    declared = {name: [variable for variable in "abcde" if f"{variable} : INT" in text] for name, text in made.files.items()}
    assert declared == {"types.st": [], "Line_1.st": ["a", "d"], "Line_1_2.st": ["b"], "line_1_3.st": ["c"], "Types_2.st": ["e"]}


def project(declared: str, text: str, *, header: str = "", version: str = "tc6_0201", kind: str = "program",
            more: str = "") -> bytes:
    """A document with the POU Main in Structured Text."""
    return (f'<project xmlns="http://www.plcopen.org/xml/{version}">{header}<types><pous><pou name="Main" pouType="{kind}">'
            f"<interface>{declared}</interface><body><ST>{text}</ST></body></pou></pous></types>{more}</project>").encode()


def variable(name: str, kind: str, value: str = "") -> str:
    initial = f'<initialValue><simpleValue value="{value}"/></initialValue>' if value else ""
    return f'<variable name="{name}"><type>{kind}</type>{initial}</variable>'


def test_tc6_of_its_first_version_names_types_and_intervals_otherwise() -> None:
    task = '<task name="Fast" interval="00:00:00.100000" priority="0"><pouInstance name="one" type="Main"/></task>'
    declared = f"<localVars>{variable('n', '<INT/>')}</localVars>"
    made = import_xml(project(declared, "n := n + 1;", version="tc6.xsd", kind="PROGRAM",
                              more=f'<instances><configurations><configuration name="C"><resource name="R">{task}</resource>'
                              "</configuration></configurations></instances>"))
    assert made.errors == []
    assert "INTERVAL := T#100ms" in made.files["C.st"]
    assert "PROGRAM one WITH Fast : Main;" in made.files["C.st"]


def test_an_interval_that_is_no_duration_is_named_with_its_task() -> None:
    task = '<task name="Fast" interval="soon" priority="0"><pouInstance name="one" typeName="Main"/></task>'
    more = ('<instances><configurations><configuration name="C"><resource name="R">' + task +
            "</resource></configuration></configurations></instances>")
    made = import_xml(project("", ";", more=more))
    says = "the interval of task Fast is 'soon', which is no duration"
    assert [d.code for d in made.diagnostics if says in d.message] == ["X0203"]
    assert "INTERVAL" not in "".join(made.files.values())


def test_parts_of_a_window_of_beremiz_are_told_and_nobody_presses_them() -> None:
    parts = {"start": "Button", "lamp": "Led", "said": "TextCtrl", "boolean": "GetBoolString"}
    declared = "".join(variable(name, f'<derived name="{kind}"/>') for name, kind in parts.items()) + variable("n", "<INT/>")
    text = ("start(set_state := TRUE, state_in := TRUE); lamp(state_in := TRUE); said(set_text := TRUE, text := 'a'); "
            "boolean(VALUE := TRUE); n := SEL(start.state_out, LEN(boolean.CODE), 0);")
    declared = f"<localVars>{declared}</localVars>"
    made = import_xml(project(declared, text, header='<fileHeader companyName="Beremiz" productName="Beremiz"/>'))
    assert [d.code for d in made.diagnostics] == ["X0292"] * 3
    assert all("svgui" in d.message for d in made.diagnostics)
    compiled = compile_sources(made.sources, "Main", dialect="matiec", lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.diagnostics]
    plc = Plc(compiled.image)
    assert plc.scan() is None
    assert plc.read("Main.n") == 4


def test_globals_of_other_files_of_a_beremiz_project_are_declared_and_told() -> None:
    declared = f"<externalVars>{variable('Level', '<INT/>')}</externalVars>" \
        f"""<localVars>{variable('py', '<derived name="python_eval"/>')}</localVars>"""
    made = import_xml(project(declared, "Level := Level + 1; py(TRIG := TRUE, CODE := '1');",
                              header='<fileHeader companyName="Beremiz" productName="Beremiz"/>'))
    assert [d.code for d in made.diagnostics] == ["X0292"] * 2
    assert all("Level" in d.message or "never acknowledges" in d.message for d in made.diagnostics)
    sources = [Source(name, text) for name, text in made.files.items()]
    compiled = compile_sources(sources, runnable=True, dialect="matiec", lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.diagnostics]
    plc = Plc(compiled.image)
    plc.scan()
    assert (plc.read("Level"), plc.read("Main.py.ACK")) == (1, False)


@each_of(("company", "dialect"), [("Beremiz", "matiec"), ("3S CODESYS", "codesys"), ("Somebody", "standard")])
def test_a_document_has_the_dialect_of_the_tool_that_its_header_names(company: str, dialect: str, tmp_path: Path) -> None:
    text = project(f"<localVars>{variable('n', '<INT/>')}</localVars>", "n := n + 1;",
                   header=f'<fileHeader companyName="{company}" productName="x"/>')
    (tmp_path / "plc.xml").write_bytes(text)
    (tmp_path / "more.st").write_text("PROGRAM Other\nEND_PROGRAM\n")
    assert usual_dialect([tmp_path / "more.st", tmp_path / "plc.xml"]) == dialect


def test_an_import_names_the_dialect_of_its_sources(tmp_path: Path) -> None:
    (tmp_path / "plc.xml").write_bytes(project("", ";", header='<fileHeader companyName="Beremiz" productName="Beremiz"/>'))
    done = CliRunner().invoke(main, ["import", str(tmp_path / "plc.xml"), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "these sources are written for --dialect matiec: the header names Beremiz" in done.output


@pytest.mark.parametrize(("family", "value", "kind", "text"), [
    ("CODESYS", "42 pcs", "string", "'42 pcs'"), ("CODESYS", "&quot;it's&quot;", "string", "'it$'s'"),
    ("CODESYS", "'done'", "string", "'done'"),
    ("CODESYS", "Name", "string", "Name"), ("CODESYS", "42 pcs", "wstring", '"42 pcs"'),
    ("Beremiz", "42 pcs", "string", "'42 pcs'"), ("Beremiz", "&quot;it's&quot;", "string", "'\"it$'s\"'"),
    ("Beremiz", "'done'", "string", "'done'"),
    ("Beremiz", "Name", "string", "'Name'"), ("Beremiz", "STRING#'a'", "string", "STRING#'a'"),
    ("Beremiz", "Name", "wstring", '"Name"'), ("Beremiz", "&quot;done&quot;", "wstring", '"done"'),
])
def test_texts_get_the_quotes_that_their_tool_leaves_out(family: str, value: str, kind: str, text: str) -> None:
    header = f'<fileHeader companyName="" productName="{family}"/>'
    made = import_xml(project(f"<localVars>{variable('a', f'<{kind}/>', value)}</localVars>", ";", header=header))
    [line] = [line for line in made.files["Main.st"].splitlines() if "STRING" in line]
    assert line.split(" := ")[1] == f"{text};"


@pytest.mark.parametrize(("family", "length"), [("Beremiz", 5), ("CODESYS", 3)])
def test_double_quotes_of_a_string_are_characters_where_its_tool_has_them_so(family: str, length: int) -> None:
    header = f'<fileHeader companyName="" productName="{family}"/>'
    declared = variable("a", "<string/>", "&quot;abc&quot;") + variable("n", "<INT/>", "0")
    made = import_xml(project(f"<localVars>{declared}</localVars>", "n := LEN(a);", header=header))
    machine = running(made)
    machine.scan()
    assert machine.read("Main.n") == length


@pytest.mark.slow
def test_a_document_is_run_as_it_is() -> None:
    done = CliRunner().invoke(main, ["run", str(DOCUMENTS / "beremiz.xml"), "--scans", "3", "--show", "Instance0.n"])
    assert (done.exit_code, done.stdout) == (0, "Instance0.n = 17\n")


def test_a_project_of_e_cockpit_runs_with_what_only_its_texts_declare() -> None:
    """Its application stands in addData, its task has an interval of another form, and LTIME is a type that the format lacks."""
    made = import_xml(DOCUMENTS / "ecockpit.xml")
    assert made.errors == [] and made.family == "codesys"
    said = [one.message for one in made.diagnostics if one.code == "X0292"]
    assert said == ["POU Step: since: only the plain text of the declaration has this, and it is taken from there"]
    compiled = compile_sources(made.sources, runnable=True, dialect="codesys")
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    plc = Plc(compiled.image, 20_000_000)
    seen = []
    for go in (False, True, True, False, True, True):
        plc.write("PLC_PRG.x", go)
        plc.scan()
        seen.append((plc.read("PLC_PRG.m"), plc.read("PLC_PRG.s.since") // 1_000_000))
    assert seen == [(0, 20), (1, 40), (2, 60), (2, 80), (3, 100), (3, 120)]
