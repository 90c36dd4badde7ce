"""Types, values, sections and tasks of documents as Structured Text, and back."""

from __future__ import annotations

import pytest
from drawings import block, codes, document, imported, pou, result, value, variable
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.read.scope import _library_pins
from fbvm.interchange.plcopen.read.types import duration
from fbvm.interchange.plcopen.write.exporting import export_xml


def test_types_of_pins_are_those_of_the_library() -> None:
    assert _library_pins("TON") == {"IN": "BOOL", "PT": "TIME", "Q": "BOOL", "ET": "TIME"}
    assert _library_pins("NOBODY") == {}


@each_of(("written", "meant"), [
    ("T#20ms", "T#20ms"), ("TIME#1s", "TIME#1s"), ("t#1.5s", "t#1.5s"), ("PT0.02S", "T#20ms"), ("PT1M30S", "T#1m30s"),
    ("P1DT2H", "T#1d2h"), ("PT0.000250S", "T#250us"), ("20ms", "T#20ms"), ("1h30m", "T#1h30m"), ("Interval", ""), ("", ""),
    ("P", ""), ("20", ""), (f"PT{'9' * 400}S", ""), (f"P{'9' * 5000}D", ""),
], ids=lambda text: text[:12])
def test_intervals_in_all_their_spellings(written: str, meant: str) -> None:
    assert duration(written) == meant


@pytest.mark.slow
@each_of(("element", "text"), [
    ("<BOOL/>", "BOOL"), ("<bool/>", "BOOL"), ("<string/>", "STRING"), ('<string length="20"/>', "STRING[20]"),
    ('<wstring length="4"/>', "WSTRING[4]"), ('<derived name="TON"/>', "TON"),
    ("<pointer><baseType><INT/></baseType></pointer>", "POINTER TO INT"),
    ('<array><dimension lower="0" upper="N"/><dimension lower="1" upper="2"/><baseType><REAL/></baseType></array>',
     "ARRAY[0..N, 1..2] OF REAL"),
    ('<enum><values><value name="A"/><value name="B" value="4"/></values></enum>', "(A, B := 4)"),
    ('<subrangeUnsigned><range lower="1" upper="9"/><baseType><UINT/></baseType></subrangeUnsigned>', "UINT (1..9)"),
    ('<subrange lower="0" upper="100"><baseType><int/></baseType></subrange>', "INT (0..100)"),
])
def test_types(element: str, text: str) -> None:
    made = import_xml(document(pou("", f'<variable name="v"><type>{element}</type></variable>', language="ST")))
    assert made.diagnostics == []
    assert f"v : {text};" in " ".join(made.files["Main.st"].split())


@each_of("wrong", ["<type/>", "<type><complex/></type>", '<type><derived name="a b"/></type>', ""])
def test_a_variable_without_a_type_that_can_be_said_is_named(wrong: str) -> None:
    made = import_xml(document(pou("", f'<variable name="v">{wrong}</variable>', language="ST")))
    assert [d.code for d in made.errors] == ["X0105"]


def test_an_initial_value_in_the_name_of_a_type_is_one() -> None:
    def made(name: str, more: str = "") -> Imported:
        kind = f'<type><derived name="{name}"/></type>'
        return import_xml(document(pou("", f'<variable name="v">{kind}{more}</variable>', language="ST")))

    assert "v : DWORD := 2#0101;" in made("DWORD := 2#0101").files["Main.st"]
    assert [d.code for d in made("DWORD := 2#0101").diagnostics] == ["X0292"]
    assert "v : DWORD := 3;" in made("DWORD := 4", '<initialValue><simpleValue value="3"/></initialValue>').files["Main.st"]
    assert "v : Valve (2) := (n := 1);" in " ".join(made("Valve (2) := (n := 1)").files["Main.st"].split())
    assert [d.code for wrong in ("DWORD :=", "a b := 1", "INT := 1; END_VAR") for d in made(wrong).errors] == ["X0105"] * 3


CONFIGURATION = """
TYPE Colour : (Red, Green := 4) := Green; Level : INT (0..100); Row : ARRAY [1..2, 0..1] OF REAL := [1.0, 3(2.5)]; END_TYPE
VAR_GLOBAL CONSTANT N : INT := (2 + 3) * 2; END_VAR
FUNCTION_BLOCK Block
VAR_INPUT a : BOOL := TRUE; END_VAR  // the first
VAR_INPUT CONSTANT b : LTIME := LTIME#1s; END_VAR
VAR_OUTPUT q : STRING[8] := 'a $'b$' & <c>'; END_VAR
VAR_IN_OUT io : DWORD; END_VAR
VAR RETAIN kept : DATE_AND_TIME; END_VAR
VAR_TEMP t : Colour; END_VAR
    (* nothing
         to do *)
    io := io + 1;
END_FUNCTION_BLOCK
PROGRAM Main
VAR b : Block; d : DWORD; n : INT; END_VAR
VAR_EXTERNAL g : INT; END_VAR
b(io := d); n := N;
Again();
ACTION Again: n := n + g; END_ACTION
END_PROGRAM
CONFIGURATION C
VAR_GLOBAL g : INT := 5; END_VAR
RESOURCE R ON PLC
    TASK Fast (INTERVAL := T#10ms, PRIORITY := 1);
    TASK Slow (INTERVAL := T#1s, PRIORITY := 9);
    PROGRAM One WITH Fast : Main;
    PROGRAM Two WITH Slow : Main;
END_RESOURCE
END_CONFIGURATION
"""


@pytest.mark.slow
def test_declarations_tasks_and_texts_survive_the_way_there_and_back() -> None:
    first = export_xml([Source("Main.st", CONFIGURATION)])
    assert first.diagnostics == []
    assert first.text is not None
    back = import_xml(first.text.encode())
    assert back.diagnostics == []
    texts = {name: " ".join(text.split()) for name, text in back.files.items()}
    assert "Colour : (Red, Green := 4) := Green;" in texts["types.st"]
    assert "Level : INT (0..100);" in texts["types.st"]
    assert "[1.0, 3(2.5)]" in texts["types.st"]
    assert "N : INT := (2 + 3) * 2;" in texts["Main.st"]
    assert "q : STRING[8] := 'a $'b$' & <c>';" in texts["Block.st"]
    assert "VAR RETAIN kept : DT; END_VAR" in texts["Block.st"]
    assert "ACTION Again: n := n + g; END_ACTION" in texts["Main_2.st"]
    assert "PROGRAM Two WITH Slow : Main;" in texts["C.st"]
    again = export_xml([Source(name, text) for name, text in back.files.items()])
    assert import_xml((again.text or "").encode()).files == back.files


def test_the_difference_of_two_moments_is_a_duration_under_the_short_name_of_their_type_too() -> None:
    body = (block(1, "RTC", "", "Q,CDT", "r", at="0,0") + value(2, "d", at="0,60") + value(3, "b", at="0,30")
            + block(4, "SUB", "EN=3 IN1=1.CDT IN2=2", "ENO,OUT", at="90,0") + value(5, "T#1h", at="90,60")
            + block(6, "LT", "EN=4.ENO IN1=4.OUT IN2=5", "ENO,OUT", at="180,0") + result(7, "6.OUT", "c", at="270,0"))
    made = imported(pou(body, variable("b") + variable("c") + variable("d", "DT") + variable("r", "RTC"), language="FBD"))
    assert "Result_4 : TIME;" in made.files["Main.st"]


@pytest.mark.parametrize("written", ["ARRAY[1..Most] OF POINTER TO Kind", "REF_TO INT", "REFERENCE TO BOOL"])
def test_a_type_in_the_place_of_a_name_is_taken_as_it_is(written: str) -> None:
    made = imported(pou("", f'<variable name="r"><type><derived name="{written}"/></type></variable>'))
    assert not made.errors and f"r : {written};" in made.files["Main.st"]


def test_what_is_no_type_is_not_taken_for_one() -> None:
    made = imported(pou("", '<variable name="r"><type><derived name="ARRAY[1..2; x : INT] OF INT"/></type></variable>'))
    assert codes(made) == ["X0105"]


@each_of("used, said", [
    ("s := DONE;", ["X0301 an enumeration without a name is not exported while another one has DONE, too: Kind#DONE",
                    "X0301 an enumeration without a name is not exported while another one has DONE, too: Kind#DONE"]),
    ("s := IDLE;", []), ("", [])])  # fmt: skip
def test_a_member_of_two_enumerations_without_a_name_is_exported_if_nothing_names_it(used: str, said: list[str]) -> None:
    made = export_xml([Source("one.st", f"FUNCTION_BLOCK One VAR s : (IDLE, DONE); END_VAR {used} END_FUNCTION_BLOCK"),
                       Source("two.st", "FUNCTION_BLOCK Two VAR p : (WAIT, DONE); END_VAR END_FUNCTION_BLOCK")])
    assert [f"{each.code} {each.message.partition(': ')[2]}: {each.hint.rpartition(' ')[2]}" for each in made.errors] == said
