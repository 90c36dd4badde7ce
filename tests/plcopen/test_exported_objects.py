"""Objects, settings of a configuration and actions outside of their POU come back from a document with the same meaning."""

from __future__ import annotations

from pathlib import Path
from random import Random

import class_hierarchies
import pytest
from depth import times
from rows import each_of
from schema_rules import breaches

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_sources
from fbvm.engine.native.engine import available
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import parse_markup
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.machine.plc import Plc

DOCUMENTS = Path(__file__).parent / "documents"
ENGINES = ("python", "native") if available() else ("python",)


def back(*texts: str) -> Imported:
    """Texts after an export without a loss, whose document keeps the rules of the schema, and its import."""
    made = export_xml([Source(f"File{number}.st", text) for number, text in enumerate(texts)])
    assert made.text is not None and not made.errors, [d.render() for d in made.errors]
    found = parse_markup(made.text.encode(), "made.xml")
    assert not isinstance(found, Diagnostic)
    assert breaches(found[1]) == []
    again = import_xml(made.text.encode())
    assert not again.errors, [d.render() for d in again.errors]
    return again


def plcs(made: Imported, dialect: str = "codesys") -> list[Plc]:
    """A PLC for each engine."""
    compiled = compile_sources(made.sources, runnable=True, dialect=dialect, lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    return [Plc(compiled.image, 20_000_000, engine=engine) for engine in ENGINES]


def hierarchies(seeds: range) -> None:
    """Hierarchies at random do behind an export and an import what they do as Python objects."""
    for seed in seeds:
        random = Random(seed)
        blocks = class_hierarchies.hierarchy(random)
        instances = [random.choice(blocks) for _ in range(random.randint(1, 5))]
        text, wanted = class_hierarchies.text(random, blocks, instances)
        for plc in plcs(back(text)):
            assert plc.scan() is None
            assert [plc.read(f"Main.r[{place}]") for place in range(len(wanted))] == wanted, f"seed {seed}"


@pytest.mark.slow
def test_hierarchies_there_and_back() -> None:
    hierarchies(range(times(3, 30)))


def test_a_document_of_codesys_is_the_same_program_behind_an_export() -> None:
    made = import_xml(DOCUMENTS / "codesys_objects.xml")
    again = back(*made.files.values())
    for name in ("Motor", "Fast", "Drive", "NamedDrive"):
        assert again.files[f"{name}.st"] == made.files[f"{name}.st"]
    for plc in plcs(again):
        plc.scan()
        assert [plc.read(f"Main.{name}") for name in ("a", "b", "far.x", "far.y")] == [117, 40, 3, 4]


FORMS = """\
{attribute 'call_after_init'}
FUNCTION_BLOCK A EXTENDS B IMPLEMENTS I, J
VAR n : INT; END_VAR
{attribute 'hide'}
METHOD PRIVATE M : INT VAR_INPUT a : INT; END_VAR VAR t : INT; END_VAR t := a; M := t; END_METHOD
// the body
n := n + M(a := 3);
PROPERTY P : INT SET n := P; END_SET PRIVATE GET P := n; END_GET END_PROPERTY
PROPERTY_GET Q : INT Q := n + 1; END_PROPERTY
ACTION twice: n := n * 2; END_ACTION
END_FUNCTION_BLOCK
"""


@pytest.mark.parametrize("line", [
    "{attribute 'call_after_init'}\nFUNCTION_BLOCK A EXTENDS B IMPLEMENTS I, J\n", "    // the body\n    n := n + M(a := 3);\n",
    "{attribute 'hide'}\nMETHOD PRIVATE M : INT\n", "    t := a;\n    M := t;\nEND_METHOD\n",
    "    PRIVATE GET\n        P := n;\n    END_GET\n",
    "    SET\n        n := P;\n    END_SET\n",
    "PROPERTY Q : INT\n    GET\n        Q := n + 1;\n    END_GET\n",
    "ACTION twice:\n    n := n * 2;\n",
])
def test_parts_of_a_block_stand_in_the_text_again(line: str) -> None:
    assert line in back(FORMS).files["A.st"]


@each_of(("text", "message"), [
    ("FUNCTION_BLOCK A METHOD m END_METHOD END_FUNCTION_BLOCK", "the objects of A are kept as CODESYS and TwinCAT have them"),
    ("INTERFACE I END_INTERFACE", "INTERFACE I is kept as CODESYS and TwinCAT have it"),
    ("TYPE T EXTENDS U : STRUCT a : INT; END_STRUCT END_TYPE", "the base of T is kept as CODESYS and TwinCAT have it"),
    ("{attribute 'strict'} TYPE T : (a, b); END_TYPE", "the pragma {attribute 'strict'} is kept as CODESYS and TwinCAT have it"),
    ("FUNCTION_BLOCK A VAR r : REFERENCE TO INT; END_VAR END_FUNCTION_BLOCK", "REFERENCE TO is written as CODESYS has it"),
    ("FUNCTION_BLOCK A VAR r : REFERENCE TO A(THIS^); END_VAR END_FUNCTION_BLOCK", "REFERENCE TO is written as CODESYS has it"),
    ("FUNCTION_BLOCK A VAR b : B(1); END_VAR END_FUNCTION_BLOCK", "what the variable gives FB_init is kept as CODESYS has it"),
    ("FUNCTION_BLOCK B END_FUNCTION_BLOCK FUNCTION_BLOCK A VAR k : INT; b : ARRAY[1..2] OF B(k); END_VAR END_FUNCTION_BLOCK",
     "what the variable gives FB_init is kept as CODESYS has it"),
])  # fmt: skip
def test_what_only_codesys_reads_is_said(text: str, message: str) -> None:
    made = export_xml([Source("Main.st", text)])
    assert [(found.code, found.message.partition(";")[0].partition(",")[0]) for found in made.diagnostics] == [("X0390", message)]


@each_of("given", ["(k)", "(n := k)", "(2 + 3)", ""])
def test_what_fb_init_is_given_comes_back(given: str) -> None:
    again = back(f"FUNCTION_BLOCK B END_FUNCTION_BLOCK PROGRAM Main VAR k : INT; b, c : B{given}; d : ARRAY[1..2] OF B{given}; "
                 "END_VAR END_PROGRAM\n")
    text = "".join("".join(again.files.values()).split())
    written = given.replace(" ", "")
    assert f"b:B{written};" in text and f"c:B{written};" in text and f"d:ARRAY[1..2]OFB{written};" in text


def test_settings_of_a_configuration_and_actions_outside_of_their_pou_come_back() -> None:
    again = back("FUNCTION_BLOCK A VAR n : INT; on : BOOL; END_VAR\ngo();\nEND_FUNCTION_BLOCK\n"
                 "ACTIONS ACTION go: IF on THEN n := n + 2; END_IF; END_ACTION END_ACTIONS\n",
                 "PROGRAM Main VAR a : A; b AT %I* : BOOL; k : INT; END_VAR a(); step(); END_PROGRAM\n"
                 "CONFIGURATION C VAR_GLOBAL g : INT; END_VAR RESOURCE R ON PLC TASK t(INTERVAL := T#20ms, PRIORITY := 1); "
                 "PROGRAM p WITH t : Main; END_RESOURCE VAR_ACCESS shared : R.p.k : INT READ_WRITE; END_VAR "
                 "VAR_CONFIG R.p.b AT %IX0.3 : BOOL; R.p.a.on : BOOL := TRUE; END_VAR END_CONFIGURATION\n",
                 "ACTION Main.step: IF b THEN k := k + 1; g := k; END_IF; END_ACTION\n")
    for plc in plcs(again, "standard"):
        seen = []
        for on in (False, True, True):
            plc.write("%IX0.3", on)
            plc.scan()
            seen.append([plc.read(name) for name in ("p.a.n", "p.k", "g", "p.b")])
        assert seen == [[2, 0, 0, False], [4, 1, 1, True], [6, 2, 2, True]]


def test_settings_are_named_where_no_program_runs() -> None:
    text = back("PROGRAM Main VAR b AT %I* : BOOL; END_VAR END_PROGRAM\nCONFIGURATION C RESOURCE R ON PLC PROGRAM p : Main; "
                "END_RESOURCE VAR_CONFIG R.p.b AT %IX0.3 : BOOL; END_VAR END_CONFIGURATION\n").files["C.st"]
    assert "VAR_CONFIG" in text
    document = export_xml([Source("C.st", text)]).text
    assert document is not None
    without = document.replace('<pouInstance name="p" typeName="Main"/>', "")
    assert ["no resource has a program" in found.message for found in import_xml(without.encode()).errors] == [True]


def test_rungs_of_a_method_that_need_memory_are_refused() -> None:
    made = export_xml([Source("A.st", "FUNCTION_BLOCK A VAR x, y : BOOL; END_VAR METHOD m\nLADDER\nRUNG\n"
                                      "LD x\nUP\nOUT y\nEND_LADDER\nEND_METHOD END_FUNCTION_BLOCK")])
    assert [found.code for found in made.errors] == ["X0301"], [d.render() for d in made.diagnostics]


def test_a_body_ends_in_front_of_an_end_that_is_one_word() -> None:
    made = export_xml([Source("a.st", "FUNCTIONBLOCK B\nVAR n : INT; END_VAR\n    n := 1;\nEND_FUNCTIONBLOCK\n")])
    assert made.text is not None and "n := 1;" in made.text and "END_FUNCTION" not in made.text


def test_what_belongs_to_what_is_named_for_twincat() -> None:
    """TwinCAT takes methods, properties and actions only if `projectstructure` names them."""
    text = ("INTERFACE I\nMETHOD M : INT\nEND_METHOD\nEND_INTERFACE\nFUNCTION_BLOCK A IMPLEMENTS I\n"
            "METHOD M : INT\nM := 1;\nEND_METHOD\nPROPERTY P : INT\nGET\nP := 2;\nEND_GET\nEND_PROPERTY\n"
            "ACTION X:\n;\nEND_ACTION\nEND_FUNCTION_BLOCK\n"
            "PROGRAM Main\nVAR a : A; END_VAR\na();\nEND_PROGRAM\n")
    made = export_xml([Source("a.st", text)])
    assert made.text is not None
    found = parse_markup(made.text.encode(), "made.xml")
    assert not isinstance(found, Diagnostic)
    assert breaches(found[1]) == []
    rows = {row.get("ObjectId"): row.get("Name") for row in found[1].walk() if row.name == "Object"}
    assert sorted(rows.values()) == ["A", "I", "M", "M", "Main", "P", "X"]
    named = {one.get("ObjectId"): one.get("name") for one in found[1].walk() if one.name in ("Method", "Property", "Interface")}
    kept = {one.text.strip(): "" for one in found[1].walk() if one.name == "ObjectId"}
    assert {identity: rows[identity] for identity in named} == named
    assert rows.keys() == {*named, *kept}
    assert export_xml([Source("a.st", text)]).text == made.text
    plain = export_xml([Source("a.st", "PROGRAM Main\nVAR a : BOOL; END_VAR\na := TRUE;\nEND_PROGRAM\n")]).text
    assert plain is not None and "objectid" not in plain.lower()


def test_a_property_behind_letters_that_have_longer_capitals_is_found() -> None:
    made = back("FUNCTION_BLOCK A\nVAR n : INT; END_VAR\n// Straße, groß\nn := n + 1;\nPROPERTY P : INT\nGET\nP := n;\nEND_GET\n"
                "END_PROPERTY\nEND_FUNCTION_BLOCK\nPROGRAM Main\nVAR a : A; r : INT; END_VAR\na(); r := a.P;\nEND_PROGRAM\n")
    for plc in plcs(made):
        assert plc.scan() is None
        assert plc.read("Main.r") == 1
