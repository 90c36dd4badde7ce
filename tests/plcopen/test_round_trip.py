"""Export and import: what comes back means the same, and the document keeps the rules of the schema."""

from __future__ import annotations

import re
from collections import Counter
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from lang_check import _at, _place, _value
from lang_corpus import Program, programs
from random_rungs import random_ladder
from schema_rules import breaches, wires_lead_somewhere

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import Exported, export_xml
from fbvm.machine.plc import Plc
from fbvm.syntax.text import read
from fbvm.watch.paths import Place

ROOT = Path(__file__).resolve().parents[2]


BUDGET = 100_000


def document(made: Exported) -> Element:
    assert made.text is not None
    found = parse_markup(made.text.encode(), "made.xml")
    assert not isinstance(found, Diagnostic)
    return found[1]


def lawful(made: Exported) -> None:
    root = document(made)
    assert breaches(root) == []
    assert wires_lead_somewhere(root) == []


def there_and_back(text: str) -> Imported:
    """A text of ours after export and import, without a loss."""
    made = export_xml([Source("Main.st", text)])
    assert not made.errors, "\n".join(d.render() for d in made.errors)
    lawful(made)
    assert made.text is not None
    back = import_xml(made.text.encode())
    assert not back.errors, "\n".join(d.render() for d in back.errors)
    return back


def same(before: Any, after: Any) -> bool:
    """Whether values are equal; names that nobody wrote, and what the import added, do not count.  A step that shares its name
    with a variable has another name behind the import."""
    if isinstance(before, dict):
        return isinstance(after, dict) and all(
            name.startswith("$") or ((kept := name.replace(" step", "_2")) in after and same(value, after[kept]))
            for name, value in before.items())
    return repr(before) == repr(after)


def machine(files: dict[str, str], program: Program) -> Plc:
    sources = [Source(name, text) for name, text in files.items()]
    made = compile_sources(sources, runnable=True, dialect=program.dialect, lint=False)
    assert made.image is not None, "\n".join(d.render() for d in made.diagnostics)
    return Plc(made.image, program.cycle_ns, budget=BUDGET)


MOST_BYTES = 10_000
"""Values of more bytes, such as the files of TwinCAT's library, are read element by element only where these bytes differ."""


def _content(plc: Plc, name: str) -> bytes:
    """The bytes of a variable."""
    place = plc.find(name)
    assert isinstance(place, Place)
    return bytes(plc.memory.u8[place.offset:place.offset + place.type.size])


def compare(program: Program, back: Imported) -> None:
    """Run both, and compare every variable and every word of the areas after each scan."""
    plcs = machine({program.name: program.text}, program), machine(back.files, program)
    for scan in range(1, program.scans + 1):
        for plc in plcs:
            for item in _at(program.written, scan):
                plc.write(place := _place(plc, item), _value(place, item.value))
            plc.scan()
        first, second = plcs
        for name in (symbol for symbol in first.image.symbols if " " not in symbol):  # others are VAR_STAT of methods
            before, after = (_content(plc, name) for plc in plcs)
            if len(before) > MOST_BYTES and before == after:
                continue
            assert same(first.read(name), second.read(name)), f"{program.name}:{program.line}: {name} after scan {scan}"
        for name, area in first.memory.areas.items():
            other = second.memory.areas.get(name)
            assert other is None or (bytes(first.memory.u8[area.offset:area.offset + area.size_bytes])
                                     == bytes(second.memory.u8[other.offset:other.offset + other.size_bytes])), name


LACKING = re.compile(r"\b(has no|have no name|is worked out|(is|are) not exported)\b")
"""How messages name what TC6 2.01 has no form for."""


def round_trips(folder: str, each: int = 1) -> Counter[str]:
    """The programs of a folder of the corpus there and back, or every so many of them; how many are the same, and how many
    cannot be said."""
    count: Counter[str] = Counter()
    for program in list(programs(ROOT / "tests" / "lang" / folder))[::each]:
        if not program.runs or program.trap or "__POSITION" in program.text:  # lines and columns are others behind it
            continue
        made = export_xml([Source(program.name, program.text)])
        lawful(made)
        if made.errors:
            assert [error.message for error in made.errors if not LACKING.search(error.message)] == [], program.name
            count["unsaid"] += 1
            continue
        assert made.text is not None
        back = import_xml(made.text.encode())
        assert not back.errors, "\n".join(d.render() for d in back.errors)
        compare(program, back)
        count["same"] += 1
    return count


@pytest.mark.slow
def test_ladder_of_the_corpus_there_and_back() -> None:
    count = round_trips("ladder", each=6)
    assert count["same"] >= 6
    assert count["unsaid"] <= 3


@pytest.mark.slow
def test_a_call_behind_an_interlock_there_and_back() -> None:
    title = "a number of timers or counters belongs to one instruction in all programs"
    [program] = [program for program in programs(ROOT / "tests" / "lang" / "warnings") if program.title == title]
    back = import_xml((export_xml([Source(program.name, program.text)]).text or "").encode())
    assert back.errors == []
    compare(program, back)


def test_what_a_text_begins_with_is_an_expression_there_and_back() -> None:
    back = there_and_back("""FUNCTION_BLOCK Part
VAR_INPUT name : STRING := 'part'; END_VAR
END_FUNCTION_BLOCK
PROGRAM Main
VAR p : Part; both : STRING := CONCAT('my ', p.name); END_VAR
    p();
END_PROGRAM
""")
    assert "both : STRING := CONCAT('my ', p.name);" in " ".join("".join(back.files.values()).split())


@pytest.mark.slow
def test_a_tenth_of_the_corpus_there_and_back() -> None:
    count = round_trips("", each=10)
    assert count["same"] >= 50
    assert count["unsaid"] < count["same"]


@pytest.mark.slow
def test_examples_there_and_back() -> None:
    said = 0
    for path in sorted((ROOT / "examples").glob("*.st")):
        source = read(path, path.name)
        assert isinstance(source, Source)
        made = export_xml([source])
        lawful(made)
        assert made.errors == []
        assert made.text is not None
        back = import_xml(made.text.encode())
        assert not back.errors
        compare(Program(path, 1, path.stem, source.text), back)
        said += 1
    assert said >= 3


RUNGS = """PROGRAM Main
VAR a, b, c, d, e, x, y, z : BOOL; t : TON; n : INT; v : ARRAY [0..3] OF BOOL; END_VAR
LADDER
RUNG 1 Nested blocks
    LD      a
    LD      b
    AND     c
    OR NOT  d
    AND LD
    LD      e
    AND     a
    OR LD
    OUT     x
RUNG 2 Branches of branches
    LD      a
    OUT     TR0
    AND     b
    OUT     TR1
    AND     c
    OUT     x
    LD      TR1
    ANDNOT  c
    OUT     y
    LD      TR0
    @AND    d
    SET     z
RUNG 3
    LD      a
    OR      v[2]
    NOT
    DIFU    y
    LD      b
    UP
    @RSET   z
    LD      a
    LD      b
    KEEP    e
RUNG 4 A block between
    LD      a
    AND     b
    FBCALL  TON t IN:=TRUE PT:=T#20ms Q=>c
    AND     b
    OUT     d
END_LADDER
n := n + 1;
IF a AND n > 2 THEN b := TRUE; END_IF;
t(IN := e, PT := T#30ms, Q => v[1]);
END_PROGRAM
"""


@pytest.mark.slow
def test_rungs_and_statements_between_them_mean_the_same_for_all_inputs() -> None:
    back = there_and_back(RUNGS)
    assert "RUNG 1 Nested blocks" in back.files["Main.st"]
    program = Program(Path("Main.st"), 1, "", RUNGS)
    plcs = machine({"Main.st": RUNGS}, program), machine(back.files, program)
    for scan in range(96):
        bits = scan * 0x9E3779B1 >> 3
        for plc in plcs:
            for at, name in enumerate("abcde"):
                plc.write(f"Main.{name}", bool(bits >> at & 1))
            plc.scan()
        assert same(plcs[0].read("Main"), plcs[1].read("Main")), scan


PARTS = """
PROGRAM Main
VAR a, b, d : BOOL; n : INT; t : TON; END_VAR
LADDER
RUNG 1
    LD      a
    OR      b
    NOT
    AND>    n #5
    FBCALL  TON t IN:=b PT:=T#20ms
    OUT     d
END_LADDER
END_PROGRAM
"""


def test_each_kind_of_element_comes_back_as_it_was() -> None:
    """A contact beside another one, NOT, a comparison, a call."""
    lines = [line.split() for line in PARTS.splitlines()]
    again = [line.split() for line in there_and_back(PARTS).files["Main.st"].splitlines()]
    assert again[again.index(["RUNG", "1"]):] == lines[lines.index(["RUNG", "1"]):]


def test_a_wire_has_corners_where_its_ends_stand_in_two_rows() -> None:
    """Else it is one line from the right to the left."""
    seen = set()
    for connection in document(export_xml([Source("Main.st", PARTS)])).walk():
        if connection.name == "connection":
            points = [(int(point.get("x")), int(point.get("y"))) for point in connection.children]
            (right, top), (left, bottom) = points[0], points[-1]
            assert right > left and all(one[0] == other[0] or one[1] == other[1] for one, other in pairwise(points))
            seen.add((len(points), top == bottom))
    assert seen == {(2, True), (4, False)}


@pytest.mark.slow
def test_a_rung_comes_back_as_it_was() -> None:
    text = RUNGS[:RUNGS.index("RUNG 3")] + "END_LADDER\nEND_PROGRAM\n"
    again = there_and_back(text).files["Main.st"]
    steps = [line.split() for line in text.splitlines() if line.startswith("    ")]
    assert [line.split() for line in again.splitlines() if line.startswith("        ")] == [
        ["ORNOT", "d"] if step[:2] == ["OR", "NOT"] else ["".join(step)] if step[1] == "LD" else step for step in steps]


@pytest.mark.slow
def test_exporting_what_was_imported_gives_the_same_document() -> None:
    text = RUNGS[:RUNGS.index("RUNG 3")] + "END_LADDER\nEND_PROGRAM\n"
    first = export_xml([Source("Main.st", text)])
    assert first.text is not None
    again = export_xml([Source(name, made) for name, made in import_xml(first.text.encode()).files.items()])
    assert again.text == first.text


def test_an_address_that_is_no_iec_location_is_kept_for_ourselves_and_named() -> None:
    made = export_xml([Source("Main.st", "PROGRAM Main VAR a AT D100 : UINT; b AT %MW4 : UINT; END_VAR a := b; END_PROGRAM")])
    assert [(d.code, d.severity) for d in made.diagnostics] == [("X0390", "warning")]
    assert made.text is not None
    assert "a AT D100 : UINT" in import_xml(made.text.encode()).files["Main.st"].replace("  ", " ")
    assert [element.get("address") for element in document(made).walk() if element.name == "variable"] == ["", "%MW4"]


def test_a_condition_in_an_instruction_list_stands_in_its_transition() -> None:
    text = """PROGRAM Main
VAR a, b : BOOL; END_VAR
INITIAL_STEP s: END_STEP
TRANSITION FROM s TO s:
    LD a
    AND b
END_TRANSITION
END_PROGRAM
"""
    made = export_xml([Source("Main.st", text)])
    [inline] = [element for element in document(made).walk() if element.name == "inline"]
    assert inline.text.split() == ["LD", "a", "AND", "b"]
    assert "FROM s TO s: LD a AND b END_TRANSITION" in " ".join(there_and_back(text).files["Main.st"].split())


@pytest.mark.slow
def test_charts_of_the_corpus_there_and_back() -> None:
    count = round_trips("sfc")
    assert count["same"] >= 20
    assert count["unsaid"] == 0


@pytest.mark.slow
def test_instructions_come_back_as_they_were() -> None:
    text = "PROGRAM Main\nVAR a : BOOL; n : WORD; END_VAR\nLADDER\n" + "".join(f"RUNG\n{rung}" for rung in (
        "LD a\nAND<> n #5\n@MOV &200 D500\n", "LD a\nLD W0.00\nCNT 0003 #0002\n", "LD>= D1 D2\nOR= n &7\nNOT\nOUT W1.00\n",
        "LD P_On\nMOV @D500 D502\n", "LD a\nIL\n", "LD 0.05\nTIM 0 #10\n", "ILC\n")) + "END_LADDER\nEND_PROGRAM\n"
    back = there_and_back(text).files["Main.st"]
    steps = [line.split() for line in back.splitlines() if line.startswith("        ")]
    assert steps == [line.split() for line in text.splitlines() if line.split()[0] not in (
        "PROGRAM", "VAR", "LADDER", "RUNG", "END_LADDER", "END_PROGRAM")]


def test_a_class_is_refused_since_neither_the_format_nor_codesys_has_one() -> None:
    made = export_xml([Source("Main.st", "CLASS A END_CLASS\nFUNCTION_BLOCK Kept END_FUNCTION_BLOCK")])
    assert [(d.code, d.message) for d in made.diagnostics] == [("X0301", "A: CLASS is not exported")]
    assert [element.get("name") for element in document(made).walk() if element.name in ("pou", "dataType")] == ["Kept"]


def test_every_loss_is_named_and_the_rest_is_there() -> None:
    made = export_xml([Source("Main.st", "PROGRAM A VAR p : REF_TO INT; END_VAR END_PROGRAM\nPROGRAM B END_PROGRAM\n"
                                         "TYPE U : UNION a : INT; b : WORD; END_UNION END_TYPE")])
    assert [d.code for d in made.diagnostics] == ["X0301", "X0301"]
    assert made.diagnostics[0].message.startswith("A: ")
    names = [element.get("name") for element in document(made).walk() if element.name in ("pou", "dataType")]
    assert names == ["B"]


def test_a_source_with_syntax_errors_gives_no_document() -> None:
    made = export_xml([Source("Main.st", "PROGRAM Main x := ; END_PROGRAM")])
    assert made.text is None
    assert [d.code for d in made.errors] == ["S0101"]


@pytest.mark.slow
def test_coordinates_of_networks_go_down_and_elements_do_not_lie_on_each_other() -> None:
    root = document(export_xml([Source("Main.st", RUNGS)]))
    [body] = [element for element in root.walk() if element.name == "LD"]
    places = [(child.one("position").get("x"), child.one("position").get("y"))  # type: ignore[union-attr]
              for child in body.children if child.name in ("contact", "coil", "block")]
    assert len(set(places)) == len(places)
    rails = [int(child.one("position").get("y")) for child in body.children if child.name == "leftPowerRail"]  # type: ignore[union-attr]
    assert rails == sorted(rails)


@pytest.mark.slow
@settings(max_examples=times(25), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_random_ladder_there_and_back_means_the_same(seed: int) -> None:
    random = Random(seed)
    text = random_ladder(random)
    back = there_and_back(text)
    program = Program(Path("Main.st"), 1, "", text)
    plcs = machine({"Main.st": text}, program), machine(back.files, program)
    for scan in range(12):
        bits = random.getrandbits(5)
        for plc in plcs:
            for at, name in enumerate("abcde"):
                plc.write(f"Main.{name}", bool(bits >> at & 1))
            plc.scan()
        assert same(plcs[0].read("Main"), plcs[1].read("Main")), f"{scan}\n{text}"


def test_enumerations_and_subranges_of_variables_have_names_that_other_tools_can_read() -> None:
    text = ("TYPE Main_level : (a, b); END_TYPE\nPROGRAM Main\nVAR level : (low, high) := high; n : INT (0..9) := 3; "
            "s : BOOL; END_VAR\n"
            "s := level = high AND n = 3;\nEND_PROGRAM\n")
    back = there_and_back(text)
    names = [line.split()[0] for line in back.files["types.st"].splitlines() if " : " in line]
    assert names == ["Main_level", "Main_level_2", "Main_n"]
    program = Program(Path("Main.st"), 1, "", text)
    plc = machine(back.files, program)
    plc.scan()
    assert plc.read("Main.s") is True


def test_what_ladder_of_other_tools_does_not_have_is_said() -> None:
    for rung, what in (("LD P_On\nBPRG 0\nBEND", "block program (BPRG)"),
                       ("LD 0.00\nOUT TR0\nAND 0.01\nLD TR0\nAND 0.02\nCNT 5 #2",
                        "CNT of which two inputs begin at a branch point")):  # fmt: skip
        made = export_xml([Source("a.st", f"PROGRAM Main\nLADDER\n{rung}\nEND_LADDER\nEND_PROGRAM")])
        assert [d.message for d in made.errors] == [f"Main: ladder of PLCopen XML has no {what}"]


def test_flags_of_steps_that_get_new_names_are_read_by_them_in_actions() -> None:
    made = there_and_back("PROGRAM Main VAR Go : BOOL; n : INT; END_VAR INITIAL_STEP Go: Count(N); END_STEP STEP Next: END_STEP "
                   "TRANSITION FROM Go TO Next := FALSE; END_TRANSITION TRANSITION FROM Next TO Go := TRUE; END_TRANSITION "
                   "ACTION Count: IF Go.X THEN n := n + 1; END_IF END_ACTION END_PROGRAM")
    text = made.files["Main.st"]
    assert "INITIAL_STEP Go_2:" in text
    assert "IF Go_2.X THEN" in text


CALLED = """PROGRAM Main
VAR up, down : BOOL; r, s : R_TRIG; c : CTUD; n : INT; END_VAR
LADDER
RUNG
    LD up
    OUT down
END_LADDER
r(CLK := up);
s(CLK := down);
c(CU := r.Q, CD := s.Q, PV := 3);
n := c.CV;
IF up THEN n := n + INT#1; END_IF
END_PROGRAM"""


def test_blocks_that_one_call_reads_are_all_wired_to_it() -> None:
    text = export_xml([Source("Main.st", CALLED)]).text
    assert text is not None
    assert {typed for typed in ("r.Q", "s.Q", "n + INT#1") if f"<expression>{typed}<" in text} == set()
    assert 'typeName="ADD"' in text


def test_an_output_of_a_block_with_en_is_assigned_in_each_pass() -> None:
    back = there_and_back("FUNCTION_BLOCK Inverse\nVAR_INPUT a : BOOL; END_VAR\nVAR_OUTPUT b : BOOL; END_VAR\nb := NOT a;\n"
                          "END_FUNCTION_BLOCK\nPROGRAM Main\nVAR go, x, y, e : BOOL; i : Inverse; END_VAR\n"
                          "i(EN := go, a := x, ENO => e);\ny := i.b;\nLADDER\nRUNG 1\n LD e\n OUT x\nEND_LADDER\nEND_PROGRAM")
    compiled = compile_sources(back.sources, "Main", lint=False)
    assert compiled.image is not None
    plc = Plc(compiled.image)
    seen = []
    for go, y in ((True, False), (False, False), (False, True), (True, True)):
        plc.write("Main.go", go)
        plc.write("Main.y", y)
        plc.scan()
        seen.append((plc.read("Main.y"), plc.read("Main.e")))
    assert seen == [(True, True), (True, False), (True, False), (True, True)]


def test_functions_of_typed_literals_are_blocks() -> None:
    """Beremiz takes what stands in front of a `#` for the type of a value."""
    text = ("PROGRAM Main\nVAR a : BOOL; t : TIME; n : INT; END_VAR\nt := SUB_TIME(T#500ms, T#350ms);\n"
            "IF a THEN n := MUX(n, INT#1, 2, LIMIT(MN := INT#0, IN := n, MX := 9)); END_IF\n"
            "LADDER\nRUNG 1\n    LD a\n    OUT a\nEND_LADDER\nEND_PROGRAM\n")
    made = export_xml([Source("Main.st", text)])
    walked = list(document(made).walk())
    assert [one.get("typeName") for one in walked if one.name == "block"] == ["SUB_TIME", "LIMIT", "MUX", "MOVE"]
    assert [pin.get("formalParameter") for one in walked if one.get("typeName") == "MUX" for pin in one.walk()
            if pin.name == "variable" and pin.one("connectionPointIn")] == ["K", "IN0", "IN1", "IN2"]
    assert all("(" not in one.text for one in walked if one.name == "expression")


def test_outputs_of_counters_of_all_widths_are_wires() -> None:
    """A value that names `c.CV` would be read in front of the call by tools that begin with the outputs of a diagram."""
    text = ("PROGRAM Main\nVAR a : BOOL; c : CTU_ULINT; n : ULINT; END_VAR\nc(CU := a, PV := 5);\nn := c.CV;\n"
            "LADDER\nRUNG 1\n    LD a\n    OUT a\nEND_LADDER\nEND_PROGRAM\n")
    made = export_xml([Source("Main.st", text)])
    assert "c.CV" not in [one.text.strip() for one in document(made).walk() if one.name == "expression"]


def test_a_call_behind_something_else_begins_a_network_of_its_own() -> None:
    """What stands behind it and names a block of before has a name there, no wire; calls in a row share a network."""
    text = ("PROGRAM Main\nVAR a, b, x, y : BOOL; t, u : TON; END_VAR\n{}\nLADDER\nRUNG 1\n    LD a\n    OUT b\nEND_LADDER\n"
            "END_PROGRAM\n")  # fmt: skip
    calls = "t(IN := a, PT := T#1s);", "u(IN := b, PT := T#1s);"
    for statements, named in ((f"{calls[0]} x := t.Q; {calls[1]} y := t.Q;", ["t.Q"]),
                              (f"{calls[0]} {calls[1]} x := t.Q; y := u.Q;", [])):  # fmt: skip
        made = export_xml([Source("Main.st", text.format(statements))])
        assert [element.text.strip() for element in document(made).walk() if element.name == "expression"
                and element.text.strip() in ("t.Q", "u.Q")] == named  # fmt: skip
