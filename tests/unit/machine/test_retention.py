"""What a changed program keeps of the one before it."""

from __future__ import annotations

from fbvm import Plc, compile_text
from fbvm.machine.endings import end_instances
from fbvm.machine.retention import start_with_retained


def plc(text: str) -> Plc:
    image = compile_text(text).image
    assert image is not None
    return Plc(image)


OLD = """TYPE Point : STRUCT x, y : INT; END_STRUCT END_TYPE
FUNCTION_BLOCK Counter VAR RETAIN n : INT; END_VAR VAR passing : INT; END_VAR
n := n + 1; passing := passing + 1; END_FUNCTION_BLOCK
PROGRAM Main VAR RETAIN total : INT; name : STRING[10]; p : Point; a : ARRAY[3..5] OF INT; gone : INT; kind : INT; END_VAR
VAR lost : INT; counters : ARRAY[1..2] OF Counter; END_VAR
total := total + 1; lost := lost + 1; name := 'pump 1'; p.x := 7; p.y := 8; a[3] := 3; a[5] := 5; kind := 4;
counters[2](); END_PROGRAM"""
NEW = """TYPE Point : STRUCT new : LINT; y, x : INT; END_STRUCT END_TYPE
FUNCTION_BLOCK Counter VAR RETAIN before : LINT; n : INT; END_VAR VAR passing : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK
PROGRAM Main VAR lost : INT := 70; END_VAR VAR more : LINT; counters : ARRAY[2..3] OF Counter; END_VAR
VAR RETAIN kind : REAL := 1.5; a : ARRAY[4..9] OF INT := [6(1)]; p : Point; name : STRING[4] := 'new'; total : INT; END_VAR
more := more + 1; END_PROGRAM"""


def test_retained_variables_are_found_by_name_wherever_they_lie_now() -> None:
    old, new = plc(OLD), plc(NEW)
    old.run(scans=3)
    kept = {place.name for place in start_with_retained(new, old)}
    assert new.read("Main.total") == 3
    assert (new.read("Main.p.x"), new.read("Main.p.y"), new.read("Main.p.new")) == (7, 8, 0)
    assert [new.read(f"Main.a[{number}]") for number in (4, 5, 6)] == [0, 5, 1]
    assert new.read("Main.counters[2].n") == 3 and new.read("Main.counters[2].passing") == 0
    assert kept == {"Main.total", "Main.p.x", "Main.p.y", "Main.a[4]", "Main.a[5]", "Main.counters[2].n"}


def test_a_name_that_begins_as_a_retained_one_is_not_retained() -> None:
    old = plc("PROGRAM Main VAR RETAIN n : INT := 1; END_VAR VAR n2 : INT := 2; END_VAR n := 3; n2 := 4; END_PROGRAM")
    new = plc("PROGRAM Main VAR RETAIN n, n2 : INT; END_VAR n := n; n2 := n2; END_PROGRAM")
    old.run(scans=1)
    assert [place.name for place in start_with_retained(new, old)] == ["Main.n"]
    assert (new.read("Main.n"), new.read("Main.n2")) == (3, 0)


def test_what_is_not_retained_or_does_not_fit_begins_anew() -> None:
    old, new = plc(OLD), plc(NEW)
    old.run(scans=3)
    start_with_retained(new, old)
    assert new.read("Main.lost") == 70
    assert new.read("Main.kind") == 1.5 and new.read("Main.name") == "new"


ENDED = """VAR_GLOBAL RETAIN log : STRING(200); END_VAR
FUNCTION Note VAR_INPUT t : STRING(20); END_VAR log := CONCAT(CONCAT(log, t), ' '); END_FUNCTION
FUNCTION_BLOCK Inner VAR me : STRING(10); END_VAR
METHOD FB_init : BOOL VAR_INPUT bInitRetains, bInCopyCode : BOOL; name : STRING(10); END_VAR
me := name; Note(CONCAT(SEL(bInitRetains, '-', '+'), me)); END_METHOD
METHOD FB_exit : BOOL VAR_INPUT bInCopyCode : BOOL; END_VAR Note(CONCAT(SEL(bInCopyCode, 'x', 'X'), me)); END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK Base VAR i : Inner('i'); j : Inner('j'); END_VAR
METHOD FB_exit : BOOL VAR_INPUT bInCopyCode : BOOL; END_VAR Note('base'); END_METHOD END_FUNCTION_BLOCK
FUNCTION_BLOCK Derived EXTENDS Base
METHOD FB_exit : BOOL VAR_INPUT bInCopyCode : BOOL; END_VAR Note('derived'); END_METHOD END_FUNCTION_BLOCK
VAR_GLOBAL g : Inner('g'); END_VAR
PROGRAM Main VAR d : Derived; a : ARRAY[1..2] OF Inner('a'); END_VAR END_PROGRAM"""


def objects(text: str) -> Plc:
    image = compile_text(text, dialect="codesys").image
    assert image is not None
    return Plc(image)


def test_what_was_or_is_behind_a_reference_is_not_kept() -> None:
    main = "PROGRAM Main VAR RETAIN n : INT; r : {} INT; END_VAR {} n := n + 1; END_PROGRAM"
    refers, holds = main.format("REFERENCE TO", "r REF= n;"), main.format("", "")
    for before, after in ((refers, holds), (holds, refers), (refers, refers)):
        old, new = objects(before), objects(after)
        old.run(scans=2)
        assert {place.name for place in start_with_retained(new, old)} == {"Main.n"}
        assert new.read("Main.n") == 2
        if after == holds:
            assert new.read("Main.r") == 0


def test_an_area_that_only_one_of_them_has_is_no_hindrance() -> None:
    with_bank = "PROGRAM Main VAR e AT E0_5 : INT; n : INT; END_VAR n := e; END_PROGRAM"
    old, new = plc(OLD), plc(with_bank)
    old.write("D100", 7)
    start_with_retained(new, old)
    new.write("E0_5", 6)
    assert (new.read("D100"), new.read("E0_5")) == (7, 6)
    again = plc(with_bank)
    start_with_retained(again, new)
    start_with_retained(old, new)
    assert (again.read("E0_5"), old.read("D100")) == (6, 7)


def test_fb_exit_ends_instances_in_the_opposite_order_of_fb_init() -> None:
    old, new = objects(ENDED), objects(ENDED)
    old.scan()
    assert end_instances(old) is None
    assert {place.name for place in start_with_retained(new, old)} == {"log"}
    new.scan()
    assert str(new.read("log")).split() == [
        *["+g", "+i", "+j", "+a", "+a"], *["xa", "xa", "derived", "base", "xj", "xi", "xg"], *["-g", "-i", "-j", "-a", "-a"]]


def test_fb_init_is_told_whether_retained_values_are_kept() -> None:
    one = objects(ENDED)
    one.scan()
    one.warm_start()
    one.scan()
    assert str(one.read("log")).split() == [*["+g", "+i", "+j", "+a", "+a"], *["-g", "-i", "-j", "-a", "-a"]]
    one.cold_start()
    one.scan()
    assert str(one.read("log")).split() == ["+g", "+i", "+j", "+a", "+a"]


def test_a_trap_in_fb_exit_is_told() -> None:
    one = objects("FUNCTION_BLOCK F VAR n : INT; END_VAR METHOD FB_exit : BOOL VAR_INPUT bInCopyCode : BOOL; END_VAR "
                  "n := 1 / n; END_METHOD END_FUNCTION_BLOCK PROGRAM Main VAR f : F; END_VAR END_PROGRAM")
    one.scan()
    trap = end_instances(one)
    assert trap is not None and trap.code == "R0101"


def test_retained_areas_are_kept_and_others_are_not() -> None:
    old, new = plc(OLD), plc(NEW)
    old.write("D100", 7)
    old.write("H5", 8)
    old.write("W5", 9)
    start_with_retained(new, old)
    assert (new.read("D100"), new.read("H5"), new.read("W5")) == (7, 8, 0)
    assert new.scans == 0
