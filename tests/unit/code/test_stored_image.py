"""Images as bytes and back: everything that is in them comes back, and nothing that is damaged does."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import pytest
from rows import each_of

from fbvm.base.types import ELEMENTARY, Field, RefType, StructType, Type
from fbvm.code.compiler import compile_text
from fbvm.code.image import Body, Image
from fbvm.code.listing import listing
from fbvm.code.store.encoding import decode, encode
from fbvm.machine.plc import Plc

TYPES = """
TYPE
    Colour : (Red, Green := 5);
    Level : INT(-5..100);
    Name : STRING[7];
    Tank : STRUCT Fill : REAL; Next : REF_TO Tank; Names : ARRAY[1..2, 0..1] OF Name; END_STRUCT;
END_TYPE
VAR_GLOBAL Shared AT D100 : ARRAY[0..3] OF WORD; END_VAR
FUNCTION_BLOCK Pump
VAR_INPUT Start : BOOL; END_VAR
VAR_IN_OUT Any_Tanks : ARRAY[*] OF Tank; END_VAR
VAR Delay : TON; END_VAR
    Delay(IN := Start, PT := T#1s);
    Any_Tanks[1].Fill := 0.5;
END_FUNCTION_BLOCK
PROGRAM Main
VAR P : Pump; Tanks : ARRAY[1..2] OF Tank; C : Colour := Green; L : Level; Text : WSTRING := "a"; Kept : CHAR; END_VAR
VAR RETAIN R : LREAL := 1.5E300; END_VAR
    P(Start := TRUE, Any_Tanks := Tanks);
    Tanks[1].Next := REF(Tanks[2]);
    Tanks[1].Names[1, 1] := 'x$FFy';
    L := L + 1;
    R := -0.0;
    Shared[0] := 16#FFFF;
END_PROGRAM
CONFIGURATION C
    TASK Fast(INTERVAL := T#5ms, PRIORITY := 1);
    PROGRAM Only WITH Fast : Main;
END_CONFIGURATION
"""


def image_of(text: str) -> Image:
    compilation = compile_text(text)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def plain(body: Body) -> Body:
    """A body whose code has been read."""
    return Body(body.name, body.kind, body.code, body.instance_size)


def same(one: Image, other: Image) -> bool:
    """Equal in all that an image is made of, and in the members of its types."""
    return replace(one, bodies=()) == replace(other, bodies=()) and list(map(plain, one.bodies)) == list(map(plain, other.bodies))


def members(kind: Type) -> dict[str, Field]:
    assert isinstance(kind, StructType)
    return kind.fields


def test_all_kinds_of_types_come_back() -> None:
    image = image_of(TYPES)
    back = decode(encode(image))
    assert same(image, back)
    assert back.types.keys() == image.types.keys()
    for name, kind in image.types.items():
        if isinstance(kind, StructType):
            assert members(back.types[name]) == kind.fields
            assert list(members(back.types[name])) == list(kind.fields)
    tank = back.types["TANK"]
    there = members(tank)["NEXT"].type
    assert isinstance(there, RefType)
    assert there.target is tank
    main = back.symbols["ONLY"].type
    assert members(main)["KEPT"].type is ELEMENTARY["CHAR"]
    assert listing(back) == listing(image)


def test_a_run_is_the_same() -> None:
    image = image_of(TYPES)
    plcs = [Plc(each, engine="python") for each in (image, decode(encode(image)))]
    for plc in plcs:
        plc.run(scans=3)
    assert bytes(plcs[0].memory.snapshot()) == bytes(plcs[1].memory.snapshot())
    assert plcs[1].read("Only.C") == plcs[0].read("Only.C")


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1, 5000])
def test_the_fingerprint_is_that_of_equal_code(depth: int) -> None:
    def nested(*words: str) -> Any:
        code: Any = words
        for _ in range(depth):
            code = ("not", code)
        return code

    image = image_of(TYPES)

    def of(*words: str) -> str:
        return replace(image, bodies=(Body("B", "PROGRAM", nested(*words), 4),)).fingerprint

    assert of("load", "b") == of("".join(["lo", "ad"]), "".join(["b", ""]))
    assert len({of("load", "b"), of("loadb"), of("load", "b", ""), of("load", "i8")}) == 4


def test_the_fingerprint_needs_no_code() -> None:
    image = image_of(TYPES)
    back = decode(encode(image))
    assert back.fingerprint == image.fingerprint
    assert not any("code" in vars(body) for body in back.bodies)
    again = replace(back, bodies=back.bodies)
    assert again.fingerprint == image.fingerprint


@each_of("content", [b"", b"{}", b"[]", b"3", b'{"types": 3}', b'{"layout": [1]}', b"\xff"])
def test_what_is_no_image_is_refused(content: bytes) -> None:
    with pytest.raises((ValueError, LookupError, TypeError)):
        decode(content)


@pytest.mark.slow
@pytest.mark.parametrize("body", [
    "IF x > 0 THEN\n" * 180 + "x := x + 1;\n" + "END_IF\n" * 180,
    "x := " + "x + " * 990 + "1;",
])
def test_code_that_is_nested_deep_comes_back(body: str) -> None:
    image = image_of(f"PROGRAM Main\nVAR x : LINT := 1; END_VAR\n{body}\nEND_PROGRAM")
    back, limit = decode(encode(image)), sys.getrecursionlimit()
    assert [plain(stored).code for stored in back.bodies] == [plain(made).code for made in image.bodies]
    assert sys.getrecursionlimit() == limit
