"""Each thing that a library's body may name, in programs in which it lies elsewhere: linked and lowered alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from rows import first_quick

from fbvm.base.dialects import STANDARD
from fbvm.check.symbols import library
from fbvm.code.compiler import compile_text
from fbvm.code.store import object_code
from fbvm.code.store.encoding import encode

LIBRARY = """
a/library.toml
globals = ['Both.st']
[mailbox]
area = 'BOX'
head = 4
slots = 2
slot = 8
---
a/Both.st
VAR_GLOBAL CONSTANT Most : INT := 7; END_VAR
VAR_GLOBAL total : DINT := 3; row : ARRAY [5..9] OF INT; END_VAR
---
a/Colour.st
TYPE Colour : (Red, Green := 5, Blue); END_TYPE
---
a/Pair.st
TYPE Pair : STRUCT first, second : INT := 4; END_STRUCT END_TYPE
---
a/Named.st
FUNCTION_BLOCK Named
VAR n : INT; END_VAR
    n := Most; total := total + n; row[n] := 1;
END_FUNCTION_BLOCK
---
a/Coloured.st
FUNCTION_BLOCK Coloured
VAR n : INT; END_VAR
    IF n = 1 THEN n := Sum_Of(a := n, b := 2); END_IF;
    CASE n OF 1: n := TO_INT(Colour#Green); END_CASE;
END_FUNCTION_BLOCK
---
a/Sum_Of.st
FUNCTION Sum_Of : INT
VAR_INPUT a, b, c : INT := 9; p : Pair; END_VAR
VAR i : INT; f : ARRAY [100..120] OF DINT; END_VAR
    FOR i := 100 TO 110 DO f[i] := i; END_FOR;
    Sum_Of := TO_INT(f[105]) + b + p.first;
END_FUNCTION
---
a/Static.st
FUNCTION_BLOCK Static
VAR_STAT calls : DINT; END_VAR
VAR_TEMP t : ARRAY [-3..3] OF INT; END_VAR
    calls := calls + 1; t[-3] := TO_INT(calls);
END_FUNCTION_BLOCK
---
a/Lies.st
FUNCTION_BLOCK Lies
VAR_OUTPUT d AT D100 : INT; b AT W3.04 : BOOL; m AT BOX2 : WORD; END_VAR
    d := d + 1; b := NOT b; m := NOT m;
END_FUNCTION_BLOCK
---
a/Direct.st
FUNCTION_BLOCK Direct
VAR x : WORD; END_VAR
    x := %E2_7; %BOX3 := x; %D9 := %E1_4;
END_FUNCTION_BLOCK
---
b/Uses.st
FUNCTION_BLOCK Uses
VAR lies : Lies; s : Static; k : INT; flag : BOOL; END_VAR
    lies(); s(); k := lies.d; flag := lies.b;
END_FUNCTION_BLOCK
---
b/Refers.st
FUNCTION_BLOCK Refers
VAR x : INT; p : POINTER TO INT; d : Sum_In; END_VAR
    p := ADR(x); p^ := 1; d();
END_FUNCTION_BLOCK
---
b/Sum_In.st
FUNCTION_BLOCK Sum_In
VAR n : INT; END_VAR
    n := Sum_Of(a := 1, c := 3); n := Most_Of(n, 5);
END_FUNCTION_BLOCK
---
b/Most_Of.st
FUNCTION Most_Of : ANY_INT
VAR_INPUT a, b : ANY_INT; END_VAR
    IF a > b THEN Most_Of := a; ELSE Most_Of := b; END_IF;
END_FUNCTION
---
b/Acts.st
FUNCTION_BLOCK Acts
VAR n : INT; END_VAR
    Up();
ACTION Up: n := n + 1; END_ACTION
END_FUNCTION_BLOCK
---
b/Holds.st
FUNCTION Holds : INT
VAR s : Static; c : Coloured; END_VAR
    s(); c(); Holds := 1;
END_FUNCTION
---
b/Wants.st
FUNCTION_BLOCK Wants
VAR_INPUT CLK : BOOL R_EDGE; END_VAR
VAR n : INT; t : STRING[9]; END_VAR
    IF CLK THEN n := n / (n + 1) + Holds(); END_IF;
    t := CONCAT(t, 'ab');
END_FUNCTION_BLOCK
---
b/Steps.st
FUNCTION_BLOCK Steps
VAR_OUTPUT n : INT; END_VAR
METHOD PUBLIC Up : INT n := n + 1; Up := n; END_METHOD
PROPERTY PUBLIC Twice : INT GET Twice := 2 * n; END_GET END_PROPERTY
END_FUNCTION_BLOCK
---
b/Asks.st
FUNCTION_BLOCK Asks
VAR s : Steps; n : INT; END_VAR
    n := s.Up() + s.Twice;
END_FUNCTION_BLOCK
---
b/Stepper.st
INTERFACE Stepper
METHOD Step : INT VAR_INPUT n : INT; END_VAR END_METHOD
END_INTERFACE
---
b/library.toml
globals = ['Whose.st']
---
b/Whose.st
VAR_GLOBAL whose : Stepper; END_VAR
---
b/Turn.st
FUNCTION Turn : INT
VAR_INPUT n : INT; END_VAR
    Turn := whose.Step(n := n - 1);
END_FUNCTION
---
b/Around.st
FUNCTION Around : INT
VAR_INPUT n : INT; END_VAR
VAR kept : INT; END_VAR
    kept := n;
    IF n > 0 THEN kept := Turn(n) + kept; END_IF;
    Around := kept;
END_FUNCTION
"""
BLOCKS = ("Named", "Coloured", "Static", "Lies", "Direct", "Uses", "Refers", "Sum_In", "Acts", "Wants", "Asks")
APART = {"Named", "Coloured", "Sum_Of", "Static", "Lies", "Direct", "Uses"}
"""What has object code, of those that any program here has."""
AROUND = ("", "VAR_GLOBAL g : ARRAY [1..9] OF LREAL; END_VAR\n", """
FUNCTION Begin_At : INT VAR x : ARRAY [1..50] OF INT; END_VAR Begin_At := 1; END_FUNCTION
FUNCTION_BLOCK Own VAR s : Static; bank AT E1_0 : WORD; END_VAR s(); END_FUNCTION_BLOCK
""")


@pytest.fixture(autouse=True)
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """These libraries in place of those that come along."""
    for part in LIBRARY.strip().split("\n---\n"):
        name, _, text = part.partition("\n")
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    libraries = tuple(replace(each, shipped=True) for each in library._libraries_below(tmp_path))
    monkeypatch.setattr(library, "_shipped", lambda: libraries)
    monkeypatch.setattr(library, "_shipped_files", lambda: frozenset(n for each in libraries for n in each.files))


def image_of(text: str) -> bytes:
    made = compile_text(text, lint=False)
    assert made.image is not None, [diagnostic.render() for diagnostic in made.diagnostics]
    return encode(made.image)


def program(names: tuple[str, ...], front: str = "") -> str:
    own = "first : Own; " if "Own" in front else ""
    declared = "".join(f"b{number} : {name}; " for number, name in enumerate(names))
    called = "n := Begin_At(); first();" if own else ""
    return f"{front}PROGRAM Main\nVAR {own}{declared}n : INT; END_VAR\n{called}\nb0();\nEND_PROGRAM\n"


@pytest.mark.slow
@pytest.mark.parametrize("each", [(), pytest.param(tuple((name,) for name in BLOCKS), marks=pytest.mark.slow)])
def test_linked_is_lowered_whatever_lies_before(each: tuple[tuple[str, ...], ...], monkeypatch: pytest.MonkeyPatch) -> None:
    texts = [program(names, front) for front in AROUND for names in (*each, BLOCKS, BLOCKS[::-1])]
    alone = {}
    for text in texts:
        monkeypatch.setattr(object_code, "_libraries", {})
        alone[text] = image_of(text)
    for order in (texts, texts[::-1])[:1 + len(each)]:
        monkeypatch.setattr(object_code, "_libraries", {})
        for text in (*order, *order):
            assert image_of(text) == alone[text], text
        kept = {code.name for code in object_code.library_for(STANDARD).code.values() if code is not None}
        assert kept >= APART and not kept & {"Refers", "Acts", "Sum_In", "Most_Of", "Holds", "Asks"}


@pytest.mark.slow
@pytest.mark.parametrize("name", first_quick(BLOCKS))
def test_what_one_program_had_made_known_another_has_too(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(object_code, "_libraries", {})
    alone = image_of(program((name,)))
    for _ in range(3):
        image_of(program(BLOCKS))
    assert image_of(program((name,))) == alone


def test_a_library_that_a_users_method_leads_back_into_has_a_frame_for_each_call(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(object_code, "_libraries", {})
    straight, back = (f"""
        FUNCTION_BLOCK Own IMPLEMENTS Stepper
        METHOD PUBLIC Step : INT VAR_INPUT n : INT; END_VAR Step := {step}; END_METHOD
        END_FUNCTION_BLOCK
        PROGRAM Main VAR own : Own; r : INT; END_VAR whose := own; r := Around(3); END_PROGRAM""" for step in ("n", "Around(n)"))
    alone = image_of(back)
    monkeypatch.setattr(object_code, "_libraries", {})
    for _ in range(3):
        image_of(straight)
    assert "Around" in {code.name for code in object_code.library_for(STANDARD).code.values() if code is not None}
    assert image_of(back) == alone


def test_libraries_of_the_users_own_and_var_config_are_lowered_with_their_program(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(object_code, "_libraries", {})
    own = tmp_path / "own"
    own.mkdir()
    (own / "Mine.st").write_text("FUNCTION_BLOCK Mine\nVAR s : Static; END_VAR\ns();\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    for _ in range(3):
        assert compile_text("PROGRAM Main\nVAR m : Mine; END_VAR\nm();\nEND_PROGRAM\n", libraries=[own]).image is not None
        completed = ("PROGRAM Main\nVAR x AT %I* : BOOL; s : Static; END_VAR\ns();\nEND_PROGRAM\nCONFIGURATION c\n"
                     "RESOURCE r ON cpu\nTASK t(PRIORITY := 1);\nPROGRAM m WITH t : Main;\nEND_RESOURCE\n"
                     "VAR_CONFIG r.m.x AT %IX0.0 : BOOL; END_VAR\nEND_CONFIGURATION\n")
        assert compile_text(completed).image is not None
    assert not any(library.code or library.seen for library in object_code._libraries.values())
