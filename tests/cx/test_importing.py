"""Projects of CX-Programmer to sources: symbols, rungs, function blocks, tasks, and what is refused."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from cx_text import DOUBLE, SAMPLE, Cxt
from rows import each_of

from fbvm import Plc
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.cx.compression import compress
from fbvm.interchange.cx.markup import CxText, _fields, is_project, read_markup
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.cx.read.memory import initial_values
from fbvm.interchange.cx.write.exporting import export_into
from fbvm.interchange.imported import Imported


def imported(cxt: Cxt) -> Imported:
    return import_project(cxt.bytes(), "line.cxt")


def started(made: Imported) -> Plc:
    compilation = compile_sources([Source(name, text) for name, text in made.files.items()], runnable=True)
    assert compilation.image is not None, [error.render() for error in compilation.errors]
    return Plc(compilation.image)


def with_rung(rung: str, *symbols: str) -> Imported:
    return imported(Cxt(symbols, sections=(("Main", (rung,)),)))


def parsed(data: bytes, encoding: str = "") -> CxText:
    text = read_markup(data, "line.cxt", encoding)
    assert isinstance(text, CxText), text.render()
    return text


@each_of("number, declared", [
    ("0", "UINT := 0"), ("65535", "UINT := 65535"), ("65536", "UDINT := 65536"), ("+7", "UINT := 7"), ("-1", "INT := -1"),
    ("4294967295", "UDINT := 4294967295"), ("4294967296", "ULINT := 4294967296"), ("9999999999", "ULINT := 9999999999"),
    ("-32768", "INT := -32768"), ("-32769", "DINT := -32769"), ("-2147483648", "DINT := -2147483648"),
    ("-2147483649", "LINT := -2147483649"),
])
def test_a_number_has_a_type_that_holds_it(number: str, declared: str) -> None:
    made = imported(Cxt((f"Most,{number},NUMBER,,,",)))
    assert f"    Most : {declared};" in made.files["globals.st"] and not made.diagnostics


# --- the text ---


@pytest.mark.slow
def test_text_and_compressed_text_are_the_same_project() -> None:
    plain, packed = imported(SAMPLE), import_project(compress(SAMPLE.bytes()), "line.cxp")
    assert plain.files == packed.files
    assert not plain.diagnostics


def test_the_text_is_kept_to_the_byte_whatever_its_line_ends_are() -> None:
    for data in (SAMPLE.bytes(), SAMPLE.bytes().replace(b"\r\n", b"\n"), SAMPLE.bytes().replace(b"\n", b"\r\n"),
                 b"\xef\xbb\xbf" + SAMPLE.bytes()):  # fmt: skip
        text = parsed(data)
        assert text.encoded(text.text) == data


def test_a_text_between_markers_is_opaque() -> None:
    inner = 'END;\r\nR[0]:=\r\n$?St$Bk?_#[99]\r\nEND_LIST_$#[1];"'
    text = parsed(Cxt(symbols=(f"Pump,100.00,BOOL,,,\n{inner}",)).bytes())
    table = text.root.get("Resource[0]", "GlobalVariables", "VariableList")
    assert table is not None
    assert [row.fields[-1] for row in table.rows] == [inner]


def test_the_code_page_is_found_by_the_names_or_taken_as_told() -> None:
    for encoding, name in (("cp949", "연습"), ("cp1252", "PÅDRAG"), ("utf-8", "température"), ("cp932", "運転")):
        data = Cxt(symbols=(f"{name},100.00,BOOL,,,",)).bytes(encoding)
        assert f"{name} AT CIO 100.00" in import_project(data, "a.cxt", encoding=encoding).files["globals.st"]
        if encoding != "cp932":
            assert parsed(data).encoding == encoding


def test_damaged_and_foreign_files_get_a_sentence() -> None:
    whole = SAMPLE.text
    for text, words in ((whole[: whole.index(" PLC:=")], "the file ends before the END"),
                        (whole.replace("  END_LIST_$#[1];", ""), "at the end of this row is missing"),
                        (whole.replace('Name:="Sample";', 'Name:="Sample"'), "`;`"),
                        (whole.replace("END;", "EN;", 1), "no entry"),
                        ("<xml/>", "does not begin with CXProgVer"), (whole.replace("Resource[0]", "Resource"), "holds no PLC"),
                        ("CXProgVer:=1;\n" + "a:=\nBEGIN\n" * 100, "stand inside one another")):  # fmt: skip
        made = import_project(text.encode(), "line.cxt")
        assert [d.code for d in made.diagnostics] == ["X0401"], text[:40]
        assert words in made.diagnostics[0].message
        assert not made.files
    other = import_project(whole.encode(), "line.cxt", plc="Elsewhere")
    assert [each.render().splitlines()[0] for each in other.diagnostics] == [
        "line.cxt:1:1: error X0401: the project has no PLC Elsewhere"]
    assert "Sysmac" in import_project(b"PK\x03\x04", "a.smc2").diagnostics[0].message
    assert "cut" in import_project(compress(SAMPLE.bytes())[:500], "a.cxp").diagnostics[0].message


@each_of(("data", "is_one"), [
    (SAMPLE.bytes(), True), (compress(SAMPLE.bytes()), True), (compress(SAMPLE.bytes())[:8] + b"\xff" * 50, True),
    (compress(b"another text" * 20), False), (b"\x00\x06\x80" + b"\xff" * 50, False), (b"PROGRAM Main", False)])
def test_a_project_is_known_by_how_it_begins_also_a_damaged_one(data: bytes, is_one: bool) -> None:
    assert is_project(data) is is_one


@pytest.mark.slow
def test_no_damage_raises() -> None:
    seeded = random.Random(5)
    data = SAMPLE.bytes()
    for _ in range(150):
        hurt = bytearray(data)
        for _ in range(seeded.randrange(1, 6)):
            hurt[seeded.randrange(len(hurt))] = seeded.randrange(256)
        made = import_project(bytes(hurt[: seeded.randrange(len(hurt))] if seeded.random() < 0.3 else hurt), "line.cxt")
        assert made.files or made.diagnostics


@each_of(("line", "fields"), [
    ('a,"b,c",d;', ["a", "b,c", "d"]), ('"a","b","c";', ["a", "b", "c"]), ('"a" b,c;', ['"a" b', "c"]),
    ('"a""b",c;', ['a""b', "c"]), ('a,"b;', ["a", '"b']), (";", [""]), (",;", ["", ""]), ('"";', [""]),
    ('"a,b",,"";', ["a,b", "", ""]), ("a;;", ["a;"])])
def test_the_fields_of_a_row(line: str, fields: list[str]) -> None:
    assert _fields(line) == fields


# --- symbols ---


def test_symbols_become_global_variables_with_addresses_and_comments() -> None:
    made = imported(Cxt(("Start,0.00,BOOL,,,start button", "Level,D100,CHANNEL,,,", "Late,T0010,BOOL,,,",
                         "Flow,D200,REAL,,,", "Auto1,,UINT,,A,",
                         "No,520,NUMBER,,,timer of the pump", "Old,DM7,INT,,,", "Table,D300,WORD[11],,,"),
                        sections=(("Main", ("LD Start\nOUT 1.00",)),)))  # fmt: skip
    assert not made.diagnostics
    lines = [" ".join(line.split()) for line in made.files["globals.st"].splitlines()]
    for line in (
        "Start AT CIO 0.00 : BOOL; // start button",
        "Level AT D100 : WORD;",
        "Late AT TF0010 : BOOL;",
        "Flow AT D200 : REAL;",
        "Auto1 : UINT;",
        "No : UINT := 520; // timer of the pump",
        "Old AT D7 : INT;",
        "Table AT D300 : ARRAY[0..10] OF WORD;",
    ):
        assert line in lines, line
    assert started(made).trap is None


def test_tables_of_all_formats_have_their_comment_last() -> None:
    for version, row in (("1.5", "Pump,100.00,BOOL,,main pump"), ("1.8", "Pump,100.00,BOOL,,,main pump"),
                         ("2.2", "Pump,100.00,BOOL,,,,main pump")):  # fmt: skip
        made = imported(Cxt((row,), version=version))
        assert "Pump AT CIO 100.00 : BOOL;  // main pump" in made.files["globals.st"], version


def test_a_name_that_is_a_reserved_word_is_changed_everywhere_and_told() -> None:
    made = with_rung("LD VAR\nOUT Pump", "VAR,0.00,BOOL,,,", "Pump,100.00,BOOL,,,", "KEEP,0.01,BOOL,,,")
    assert [(d.code, "called VAR_1 here" in d.message) for d in made.diagnostics] == [("X0190", True)]
    plc = started(made)
    plc.write("VAR_1", True)
    plc.scan(0)
    assert plc.read("Pump") is True


def test_a_symbol_of_no_known_type_or_address_is_named() -> None:
    made = with_rung("LD P_On\nOUT 1.00", "S,D0,Recipe,,,", "T,Q5,BOOL,,,")
    assert [d.code for d in made.diagnostics] == ["X0203", "X0203"]
    assert "symbol S" in made.diagnostics[0].message
    assert "type RECIPE" in made.diagnostics[0].message


# --- rungs ---


@pytest.mark.slow
def test_the_sample_runs() -> None:
    plc = started(imported(SAMPLE))
    plc.write("Start_PB", True)
    plc.write("D100", 21)
    plc.scan(0)
    plc.write("Start_PB", False)
    plc.scan(10_000_000)
    assert plc.read("Pump") is True
    assert plc.read("D101") == 42
    assert plc.read("Dbl1.Runs") == 1
    plc.write("Stop_PB", True)
    plc.scan(20_000_000)
    assert plc.read("Pump") is False


def test_sections_comments_and_notes_stand_where_they_stood() -> None:
    text = imported(SAMPLE).files["NewProgram1.st"]
    assert [line.strip() for line in text.splitlines() if line.strip()][8:] == [
        ',D100,CHANNEL,,,,"raw level";', "SECTION Pumping", "RUNG 0 self hold", "LD      Start_PB", "OR      Pump",
        "ANDNOT  Stop_PB  // opens the hold", "OUT     Pump", "RUNG 1", "LD      P_On", "FBCALL  DOUBLE Dbl1 X:=D100 Y=>D101",
        "SECTION END", "RUNG 2", "END(001)", "END_LADDER", "END_PROGRAM"]  # fmt: skip


@pytest.mark.slow
def test_operands_of_any_width_and_decimal_commas() -> None:
    made = with_rung("LD P_On\nMOV(021) *Pointer D50\n+F(454) Level +1,5E+0 D60\nMOVL(498) #10002 Level",
                     "Pointer,D10,CHANNEL,,,", "Level,D40,CHANNEL,,,")  # fmt: skip
    plc = started(made)
    plc.write("D10", 0x20)
    plc.write("D20", 77)
    plc.scan(0)
    assert (plc.read("D50"), plc.read("D40"), plc.read("D41")) == (77, 2, 1)


def test_cells_of_a_function_block_contact_branch_keep_and_index_register() -> None:
    body = """BEGIN
FBType:="FBLadder";
FunctionBlock:=
BEGIN
Name:="HOLD";
POUHeader:=
BEGIN
PouVarList:=
<list>
1,A,0,,0,FALSE,0,;
1,B,0,,0,FALSE,0,;
1,C,0,,0,FALSE,0,;
2,Q,0,,0,FALSE,0,;
2,K,0,,0,FALSE,0,;
2,L,0,,0,FALSE,0,;
</list>
END;
POUBody:=
BEGIN
FBProgramData:=
BEGIN
FBRC:=2;
FBR[0]:=
BEGIN
[0]:="0,0,1,1,1,1,A, 0";
[1]:="0,1,1,1,1,1,B, 0";
[2]:="1,0,1,1,0,4";
[3]:="1,0,1,1,1,1,C, 8";
[4]:="2,0,1,0,1,2,Q, 0";
[5]:="1,2,1,1,0,4";
END;
FBR[1]:=
BEGIN
[0]:="0,0,1,1,1,1,A, 0";
[1]:="0,1,1,1,1,1,C, 0";
[2]:="1,0,2,0,2,5,KEEP(011), 0,K, 0";
END;
END;
END;
END;
END;"""
    rung = ("0|1|1|1|1|LD|P_On|1", "1|0|7|1|1|FBCALL|Hold1|9", "0|2|8|1|1|FB_INPUT|0.00|10", "0|3|8|1|1|FB_INPUT|0.01|10",
            "0|4|8|1|1|FB_INPUT|0.02|10", "3|2|8|1|1|FB_OUTPUT|1.00|11", "3|3|8|1|1|FB_OUTPUT|1.01|11",
            "3|1|1|1|1|AND|0.03|1", "4|1|5|1|1|OUT|1.03|7")  # fmt: skip
    made = imported(Cxt(("Hold1,,FUNCTION BLOCK,HOLD,A,",), sections=(("Main", (rung,)),), blocks=(body,)))
    assert not made.errors, [d.render() for d in made.errors]
    plc = started(made)
    seen = []
    for scan, bits in enumerate(("1001", "0000", "0100", "0011", "0010")):
        for bit, state in enumerate(bits):
            plc.write(f"CIO 0.0{bit}", state == "1")
        plc.scan(scan * 10_000_000)
        seen.append(tuple(int(bool(plc.read(f"CIO 1.0{bit}"))) for bit in (0, 1, 3)))
    assert seen == [(1, 1, 1), (0, 1, 0), (1, 1, 0), (0, 0, 1), (0, 0, 0)]


DELAY = """BEGIN
FBType:="FBLadder";
FunctionBlock:=
BEGIN
IEC1131Type:=3;
Name:="DELAY";
POUHeader:=
BEGIN
PouVarList:=
<list>
1,A,0,,0,FALSE,0,;
2,Q,0,,0,FALSE,0,;
0,Pause,13,,0,0,0,between the two;
0,Parts,14,,0,0,0,;
</list>
PouVarCount:=4;
END;
POUBody:=
BEGIN
FBProgramData:=
BEGIN
FBRC:=2;
FBR[0]:=
BEGIN
[0]:="0,0,1,1,1,1,A, 0";
[1]:="1,0,1,0,3,5,TIM, 0,Pause, 0,#3, 0";
END;
FBR[1]:=
BEGIN
[0]:="0,0,1,1,1,1,Pause, 0";
[1]:="1,0,1,0,1,2,Q, 0";
END;
END;
END;
END;
END;"""


@pytest.mark.slow
def test_a_timer_of_a_block_is_one_of_each_instance() -> None:
    def call(name: str, entering: str, leaving: str) -> tuple[str, ...]:
        return ("0|1|1|1|1|LD|P_On|1", f"1|0|7|1|1|FBCALL|{name}|9", f"0|2|8|1|1|FB_INPUT|{entering}|10",
                f"3|2|8|1|1|FB_OUTPUT|{leaving}|11")  # fmt: skip

    rungs = (call("D1x", "0.00", "1.00"), call("D2x", "0.01", "1.01"))
    instances = "D1x,,FUNCTION BLOCK,DELAY,A,", "D2x,,FUNCTION BLOCK,DELAY,A,"
    made = imported(Cxt(instances, sections=(("Main", rungs),), blocks=(DELAY,)))
    assert not made.errors, [d.render() for d in made.errors]
    assert 'Pause,,TIMER,,,,"between the two";' in made.files["DELAY.st"]
    plc = started(made)
    seen = []
    for scan in range(8):
        plc.write("CIO 0.00", scan < 6)
        plc.write("CIO 0.01", scan >= 2)
        plc.scan(scan * 100_000_000)
        seen.append((plc.read("CIO 1.00"), plc.read("CIO 1.01")))
    assert [first for first, _ in seen] == [False, False, False, True, True, True, False, False]
    assert [second for _, second in seen] == [False] * 5 + [True] * 3


@each_of(("row", "declared"), [
    ("0,Runs,2,D100,0,5,0,;", "Runs AT D100 : UINT := 5;"), ("0,Runs,2,D100,7,3,1,;", "Runs AT D100 : ARRAY[0..6] OF UINT;"),
    ("2,Runs,2,D100,0,5,0,;", "Runs AT D100 : UINT;"), ("2,Runs,2,,0,5,0,;", "Runs : UINT := 5;")])
def test_a_variable_of_a_block_has_its_initial_value_but_for_arrays_and_pins_at_an_address(row: str, declared: str) -> None:
    made = imported(replace(SAMPLE, blocks=(DOUBLE.replace("0,Runs,2,,0,0,1,;", row),)))
    assert declared in " ".join(made.files["DOUBLE.st"].split())


def test_a_timer_as_a_pin_is_refused_by_name() -> None:
    made = imported(Cxt(blocks=(DELAY.replace("0,Pause,13", "1,Pause,13"),)))
    assert "variable Pause is not taken over: a TIMER as a pin is not emulated" in made.errors[0].message


def test_elements_that_are_not_known_are_named_with_their_rung() -> None:
    for rung, words in ((("0|1|6|1|1|LD|P_On|1",), "kind 6"), (("broken",), "is not understood"),
                        (("0|1|1|1|1|LD|P_On|1", "1|0|7|1|1|FBCALL|Nobody|9"), "no definition")):  # fmt: skip
        made = imported(Cxt(sections=(("Main", (rung,)),)))
        assert [d.code for d in made.errors] == ["X0203"]
        assert words in made.errors[0].message
        assert "program NewProgram1, section Main, rung 0" in made.errors[0].message


# --- programs ---


@pytest.mark.slow
def test_what_is_no_ladder_protected_or_in_no_task_is_told() -> None:
    text = SAMPLE.text
    for changed, code, words in (
            (text.replace("IEC1131Type:=11;", "IEC1131Type:=12;", 1), "X0203", "section Pumping is not taken over"),
            (text.replace('"FBLadder"', '"FBSt"'), "X0203",
             "function block DOUBLE: the function block is not taken over: its body is no ladder (FBSt)"),
            (text.replace("TaskID:=256;", "TaskID:=140;"), "X0190", "interrupt task 140"),
            (text.replace("TaskID:=256;", "TaskID:=-1;"), "X0190", "given to no task"),
            (text.replace("1,X,1,", "3,X,1,"), "X0203", "usage 3")):  # fmt: skip
        made = import_project(changed.encode(), "line.cxt")
        assert any(d.code == code and words in d.message for d in made.diagnostics), words
        marked = [d.source.text[d.start : d.end] for d in made.diagnostics]
        assert all(text == text.rstrip() and len(text) <= 80 and "\n" not in text for text in marked)


@each_of(("task", "why"), [(0, "it belongs to interrupt task 0,"), (-1, "it is given to no task"), (255, "interrupt task 255")])
def test_a_program_that_no_cyclic_task_runs_is_named(task: int, why: str) -> None:
    made = imported(Cxt(sections=(("Main", ("LD 0.00\nOUT 1.00", "LD 0.01\n@TKON(820) 3")),), task=task))
    assert not any("IF NOT CX_Task" in text for text in made.files.values())
    assert [d.code for d in made.diagnostics if why in d.message] == ["X0190"]


def test_a_plc_setup_is_named_as_not_read_and_stays_in_the_file() -> None:
    setup = "  Settings:=\n  BEGIN\n   Data:=\n$?St$Bk?_#[900]\n5A 5A\n$?St$Bk?_#[900]\n  END;"
    data = replace(SAMPLE, plc_keys=setup).bytes()
    made = import_project(data, "line.cxt")
    assert [d.severity for d in made.diagnostics] == ["warning"]
    assert "PLC Setup (cycle time, startup mode) is not read" in made.diagnostics[0].message
    sources = [Source(name, text) for name, text in made.files.items()]
    assert export_into(data, "line.cxt", sources, compressed=False).data == data


def test_one_of_several_plcs_is_chosen_by_name() -> None:
    second = SAMPLE.text[SAMPLE.text.index("Resource[0]") :].replace("Resource[0]", "Resource[1]").replace("NewPLC1", "Other")
    data = (SAMPLE.text + second).encode()
    made = import_project(data, "two.cxt")
    assert "NewPLC1, Other" in made.diagnostics[0].message
    assert "Other" in import_project(data, "two.cxt", plc="other").files["configuration.st"]
    assert "no PLC Third" in import_project(data, "two.cxt", plc="Third").diagnostics[0].message


@each_of(("line", "declared"), [
    ("D=0:0,1:7789,2:24aa", "D_1_initial AT D1 : ARRAY [0..1] OF WORD := [16#7789, 16#24AA];"),
    ("W=8-10:5", "W_8_initial AT W8 : ARRAY [0..2] OF WORD := [16#0005, 16#0005, 16#0005];"),
    ("Ea_=4:1", "EA_4_initial AT EA_4 : ARRAY [0..0] OF WORD := [16#0001];"),
    ("D=65535:1,65536:1", "D_65535_initial AT D65535 : ARRAY [0..0] OF WORD := [16#0001];"), ("CIO=0:7", ""), ("D=9:0", "")])
def test_words_of_the_memory_window_that_follow_one_another_are_an_array(line: str, declared: str) -> None:
    made = initial_values(line.encode().hex())
    assert made == (["// Contents of the memory window", "VAR_GLOBAL", declared, "END_VAR"] if declared else [])


def test_what_is_no_dump_of_the_memory_window_gives_no_values() -> None:
    assert initial_values("44 3D zz") == []


@pytest.mark.slow
def test_the_memory_window_gives_initial_values_on_request() -> None:
    lines = "[OMRON.Data Monitor.Component]\nCIO=0:7\nD=0:0,1:7789,2:24aa,3048-3050:5\nE0_=4:1\n"
    dump = " ".join(f"{byte:02X}" for byte in lines.encode())
    keys = f"  Memory:=\n  BEGIN\n   Data:=\n$?St$Bk?_#[900]\n{dump}\n$?St$Bk?_#[900]\n  END;"
    cxt = replace(SAMPLE, plc_keys=keys)
    assert "memory.st" not in imported(cxt).files
    plc = started(import_project(cxt.bytes(), "line.cxt", memory=True))
    assert [plc.read(word) for word in ("D0", "D1", "D2", "D3049", "E0_4")] == [0, 0x7789, 0x24AA, 5, 1]


@pytest.mark.slow
def test_the_same_definition_serves_several_instances() -> None:
    assert DOUBLE.count("FBR[") == 1
    calls = tuple(
        ("0|1|1|1|1|LD|P_On|1", f"1|0|7|1|1|FBCALL|D{n}x|9", f"0|2|8|1|1|FB_INPUT|D{n}|10", f"3|2|8|1|1|FB_OUTPUT|D{n + 10}|11")
        for n in (1, 2)
    )
    plc = started(
        imported(
            Cxt(("D1x,,FUNCTION BLOCK,DOUBLE,A,", "D2x,,FUNCTION BLOCK,DOUBLE,A,"), sections=(("Main", calls),), blocks=(DOUBLE,))
        )
    )
    plc.write("D1", 4)
    plc.write("D2", 5)
    plc.scan(0)
    assert (plc.read("D11"), plc.read("D12")) == (8, 10)


def test_diagnostics_stand_in_the_project_at_the_rung() -> None:
    made = imported(Cxt(sections=(("Main", (("broken",),)),)))
    assert isinstance(made.errors[0], Diagnostic)
    line, _ = made.errors[0].source.place(made.errors[0].start)
    assert made.errors[0].source.line(line).strip() == "R[0]:="


def test_each_line_of_a_source_has_its_place_in_the_project() -> None:
    made = import_project(SAMPLE.bytes(), "line3.cxt")
    found = {line.strip(): place for file, text in made.files.items()
             for line, place in zip(text.splitlines(), made.places.get(file, ()), strict=False)}

    def at(line: str) -> tuple[str, str]:
        place = found[line]
        assert place is not None
        return place.where, place.document.text[place.start:place.end]

    pumping = "program NewProgram1, section Pumping"
    assert at("OUT     Pump") == (f"{pumping}, rung 0, step 4 (OUT Pump)", "OUT Pump")
    assert at("ANDNOT  Stop_PB  // opens the hold") == (f"{pumping}, rung 0, step 3 (ANDNOT Stop_PB)", "ANDNOT Stop_PB")
    where, element = at("FBCALL  DOUBLE Dbl1 X:=D100 Y=>D101")
    assert where.startswith(f"{pumping}, rung 1, step 2 (FBCALL") and "FBCALL" in element and "Dbl1" in element
    assert at("RUNG 2") == ("program NewProgram1, section END, rung 0", "R[0]:=")
    assert at("+(400)  X X Y") == ("function block DOUBLE, rung 0, step 4 (+(400) X X Y)", "1,2,1,0,4,5,+(400), 0,X, 0,X, 0,Y, 0")
    assert at("Runs : UINT := 0;") == ("function block DOUBLE, symbol Runs", "0,Runs,2,,0,0,1,;")
    assert at("Start_PB AT CIO 0.00   : BOOL;  // start button")[1] == "Start_PB,0.00,BOOL,,,start button;"
    assert at(',D100,CHANNEL,,,,"raw level";') == ("program NewProgram1, symbol D100", ",D100,CHANNEL,,,raw level;")
    assert at("PROGRAM NewProgram1") == ("program NewProgram1", "Program[0]:=")
