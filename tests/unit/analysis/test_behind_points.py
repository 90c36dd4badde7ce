"""What can be written behind a point: all of it, with its kinds and types, for each form of a path."""

from __future__ import annotations

from functools import cache

from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis.calls import signature
from fbvm.analysis.completion import Item, complete

PLANT = """\
TYPE Tank : STRUCT Level : INT; Valves : ARRAY [1..2] OF Valve; Next : POINTER TO Tank; END_STRUCT END_TYPE
TYPE Valve : STRUCT Open : BOOL; END_STRUCT END_TYPE
TYPE Mode : (Off, Runs); END_TYPE
INTERFACE I_Drive
METHOD Go : BOOL
END_METHOD
PROPERTY Speed : INT
GET
END_GET
END_PROPERTY
END_INTERFACE
FUNCTION_BLOCK Drive IMPLEMENTS I_Drive
VAR_INPUT inp : INT; END_VAR
VAR_OUTPUT outp : Tank; END_VAR
VAR_IN_OUT io : Valve; END_VAR
VAR own : Tank; END_VAR
METHOD Go : BOOL
    {drive}
END_METHOD
METHOD PRIVATE Secret : INT
END_METHOD
METHOD PROTECTED Guarded : INT
END_METHOD
METHOD Plain
END_METHOD
PROPERTY Speed : INT
GET
    Speed := inp;
END_GET
END_PROPERTY
PROPERTY Held : Tank
GET
    Held := own;
END_GET
SET
    own := Held;
END_SET
END_PROPERTY
ACTION Act:
    inp := 1;
END_ACTION
END_FUNCTION_BLOCK
FUNCTION_BLOCK Fast EXTENDS Drive
VAR_INPUT more : INT; END_VAR
VAR deep : Valve; END_VAR
METHOD Inside : BOOL
VAR v : Valve; END_VAR
    {inside}
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Other
VAR_INPUT pin : INT; END_VAR
VAR hidden : Tank; END_VAR
END_PROGRAM
PROGRAM Main
VAR d : Drive; f : ARRAY [0..1] OF Fast; i : I_Drive; t : Tank; p : POINTER TO Tank; r : REFERENCE TO Tank; pd : POINTER TO Fast;
    n : INT; m : Mode; END_VAR
    {main}
END_PROGRAM
"""
TANK = "Level INT, Valves ARRAY [1..2] OF Valve, Next POINTER TO Tank"
VALVE = "Open BOOL"
DRIVE = "inp INT, outp Tank, own Tank, Act, Go BOOL, Speed INT, Plain, Held Tank"
FAST = "inp INT, outp Tank, own Tank, more INT, deep Valve, Act, Go BOOL, Speed INT, Plain, Held Tank, Inside BOOL"
FAST_INSIDE = FAST.replace("Plain", "Guarded INT, Plain")
MODE = "Off Mode, Runs Mode"


@cache
def offered(where: str, written: str) -> list[Item]:
    """What is offered at the end of a statement that is begun in Main, in the method Go of Drive or in Inside of Fast."""
    text = PLANT
    for place in ("main", "drive", "inside"):
        text = text.replace(f"{{{place}}}", f"{written}{MARK}" if place == where else "")
    program, offset = at_mark(text, "codesys")
    return complete(program, "pump.st", offset)


def check(where: str, path: str, names: str) -> None:
    assert ", ".join(f"{item.label} {item.detail}".rstrip() for item in offered(where, f"n := {path}")) == names


@each_of("path, names", [
    ("d.", DRIVE), ("D.", DRIVE), ("d.ou", DRIVE), ("f[0].", FAST), ("f[n].outp.", TANK), ("f[1].outp.Valves[1].", VALVE),
    ("f[ABS(-1)].", FAST), ("d.own.", TANK), ("d.io.", VALVE), ("i.", "Go BOOL, Speed INT"), ("t.", TANK), ("t.Next^.", TANK),
    ("p^.", TANK), ("p^.Next^.Valves[2].", VALVE), ("r.", TANK), ("r.Next^.Next^.", TANK), ("pd^.", FAST), ("m.", MODE),
    ("Mode.", MODE), ("mode#", MODE), ("Mode#Ru", MODE), ("Other.", "pin INT, hidden Tank"), ("other.hidden.", TANK),
    ("d.Held.", TANK), ("f[0].Held.Next^.Valves[1].", VALVE), ("1 + t.", TANK), ("f[t.", TANK),
])
def test_what_the_parts_of_a_path_are(path: str, names: str) -> None:
    check("main", path, names)


@each_of("path", ["t.Next.", "p.", "pd.", "i^.", "r^.", "n.", "d.Speed.", "d.Go.", "d.Plain.", "d.Act.", "Tank.", "Drive.",
                  "I_Drive.", "t.Valves.", "t[0].", "d^.", "t.Level.", "t.Levl.", "TON.", "ABS.", "nobody.", "t.Level#",
                  "SUPER^.", "Held.", "d.Held^."])  # fmt: skip
def test_what_has_no_parts(path: str) -> None:
    check("main", path, "")


@each_of("path, names", [
    ("THIS^.", FAST_INSIDE), ("THIS.", FAST_INSIDE), ("this^.", FAST_INSIDE), ("THIS^.Held.", TANK), ("Held.", TANK),
    ("SUPER^.", DRIVE.replace("Plain", "Guarded INT, Plain")), ("SUPER^.own.", TANK), ("deep.", VALVE), ("own.", TANK),
    ("v.", VALVE), ("io.", VALVE), ("outp.Valves[1].", VALVE),
    ("Inside.", ""), ("inp.", ""), ("Fast.", ""), ("d.", ""), ("Secret.", ""), ("Main.t.", TANK), ("Main.f[0].", FAST_INSIDE),
])
def test_what_can_be_named_in_a_method_of_a_block_that_extends_another(path: str, names: str) -> None:
    check("inside", path, names)


def test_a_private_method_is_offered_in_its_own_block_alone() -> None:
    check("drive", "THIS^.", DRIVE.replace("Plain", "Secret INT, Guarded INT, Plain"))


@each_of("where, named, absent", [
    ("drive", {"inp", "own", "io", "Act", "Go", "Secret", "Guarded", "Plain", "Speed", "Held"}, {"more", "deep", "Inside", "n"}),
    ("inside", {"inp", "own", "io", "more", "deep", "v", "Act", "Go", "Guarded", "Plain", "Speed", "Held", "Inside"},
     {"Secret", "n", "hidden"}),
    ("main", {"d", "f", "n", "Off", "Runs"}, {"inp", "Act", "Go", "Secret", "hidden", "pin"}),
])
def test_what_is_named_without_a_point(where: str, named: set[str], absent: set[str]) -> None:
    kinds = {item.label: (item.kind, item.insert) for item in offered(where, "")}
    assert named <= set(kinds) and not absent & set(kinds)
    if "Act" in named:
        assert (kinds["Act"], kinds["Go"], kinds["Speed"]) == (("action", "Act();"), ("method", "Go($0)"), ("property", ""))


@each_of("place, named", [("first", {"i", "x"}), ("second", {"b", "y"}), ("method", {"b", "y", "z"}), ("third", {"w"})])
def test_the_names_at_a_place_of_a_namespace_are_those_of_the_pou_around_it(place: str, named: set[str]) -> None:
    text = """\
NAMESPACE Plant
FUNCTION A : INT
VAR_INPUT i : INT; END_VAR VAR x : INT; END_VAR
{first}
END_FUNCTION
TYPE T : INT; END_TYPE
FUNCTION_BLOCK B
VAR_INPUT b : INT; END_VAR VAR y : INT; END_VAR
{second}
METHOD M : INT
VAR z : INT; END_VAR
{method}
END_METHOD
END_FUNCTION_BLOCK
FUNCTION C : INT
VAR w : INT; END_VAR
{third}
END_FUNCTION
TYPE U : INT; END_TYPE
END_NAMESPACE
"""
    for each in ("first", "second", "method", "third"):
        text = text.replace(f"{{{each}}}", MARK if each == place else "")
    program, offset = at_mark(text)
    assert {item.label for item in complete(program, "pump.st", offset) if item.kind == "variable"} - {"A", "C", "M"} == named


@each_of("written, names", [
    ("s := 'a//b'; t.", TANK), ("s := 'a(*b'; t.", TANK), ("s := 'it$'s'; t.", TANK), ("(* a *) t.", TANK), ("// a\nt.", TANK),
    ("(* a\n // *) t.", TANK), ("/* a */ t.", TANK), ("s := \"'\"; t.", TANK), ("(* VAR\nVAR *)\nt.", TANK),
    ("// t.", ""), ("n := 1; // a t.", ""), ("(* t.", ""), ("(* a\n t.", ""), ("/* a\n t.", ""), ("s := 't.", ""),
    ("s := \"t.", ""), ("(* a *) // t.", ""), ("// (* a\n// t.", ""),
])
def test_in_comments_and_texts_nothing_is_offered(written: str, names: str) -> None:
    assert ", ".join(f"{item.label} {item.detail}" for item in offered("main", written)) == names


@each_of("written, label", [
    ("d(", "Drive"), ("// d(", ""), ("(* d(", ""), ("(*\n d(", ""), ("d(// f[0](\n", "Drive"), ("d((* f( *)", "Drive"),
    ("s := '//'; d(", "Drive"), ("d(s := '(*', ", "Drive"), ("/* d(", ""),
])
def test_in_a_comment_no_call_is_open(written: str, label: str) -> None:
    text = PLANT.replace("{main}", written + MARK).replace("{drive}", "").replace("{inside}", "")
    program, offset = at_mark(text, "codesys")
    found = signature(program, "pump.st", offset)
    assert (found.label.partition("(")[0] if found is not None else "") == label
