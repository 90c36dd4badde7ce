"""Parts of the compiler by tables: what work costs, what a warm start keeps, where copies go, paths of instances, constants."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.base import arithmetic
from fbvm.base.arithmetic import INF
from fbvm.base.dialects import DIALECTS
from fbvm.code.builder.emitter import DEEPEST, Emitter
from fbvm.code.builder.evaluation import value_of
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.code.layout.objects import runs
from fbvm.code.lowering.step_costs import _Costs
from fbvm.code.operations import Node


def image(text: str, **options: Any) -> Image:
    made = compile_text(text, lint=False, **options)
    assert made.image is not None, made.errors[0].render()
    return made.image


def const(form: str, value: Any) -> Node:
    return "const", form, value


AT = ("abs", 0, ())
FIVE, NINE, WIDE = const("s8", b"12345"), const("s8", b"123456789"), const("s16", "12345")
TEXT = ("load_text", "s8", AT, 80)
N = const("i16", 1)

# --- costs of operations ------------------------------------------------------------------------------------------------


@each_of("node, units", [
    (N, 32), (("add", "i16", N, N), 96), (("load", "i16", AT), 64), (TEXT, 64 + 2 * 80),
    (("load_text", "s16", AT, 80), 64 + 4 * 80),
    (("copy", AT, AT, 500), 96 + 500), (("fill", AT, b"1234"), 64 + 4), (("reverse", AT, 10), 64 + 20),
    (("eq", "b", "i16", N, N), 96), (("eq", "b", "s8", FIVE, NINE), 96 + 2 * 14), (("lt", "b", "s16", WIDE, WIDE), 96 + 2 * 20),
    (("select", "i16", N, N, N), 128), (("select", "s8", N, FIVE, NINE), 128 + 2 * (14 + 9)),
    (("concat", "s8", FIVE, NINE), 96 + 2048 + 2 * (14 + 14)), (("length", "i16", FIVE), 64 + 10),
    (("find", "i16", FIVE, NINE), 96 + 8 * 14),
    (("from_text", "i16", "INT", FIVE, 0), 64 + 32 * 1024 + 8 * 5), (("left", "s8", NINE, N, 0), 96 + 2048 + 2 * 18),
    (("to_text", "s8", "INT", N), 64 + 8 * 1024), (("math", "f64", "sin", const("f64", 1.0)), 64 + 128),
    (("store_text", AT, 80, FIVE), 96 + 10), (("let", 1, "s8", FIVE), 64),
    (("mux", "s8", N, (FIVE, NINE), 0), 32 + 32 + 32 + 64 + 2 * (14 + 9)),
])
def test_what_an_operation_costs(node: Node, units: int) -> None:
    assert _Costs(0).units(node) == units, _Costs(0).units(node)


@each_of("node, length", [
    (FIVE, 5), (TEXT, 80), (("concat", "s8", FIVE, NINE), 14), (("insert", "s8", FIVE, NINE, N, 0), 14),
    (("replace", "s8", FIVE, NINE, N, N, 0), 14), (("left", "s8", NINE, N, 0), 9), (("select", "s8", N, FIVE, NINE), 9),
    (("mux", "s8", N, (FIVE, NINE), 0), 9), (("to_text", "s8", "INT", N), 64), (("enum_text", "s8", (), N), 64),
    (("character", "s8", N), 1), (("tmp", "s8", 7), 65_534), (("concat", "s8", ("tmp", "s8", 7), FIVE), 65_534),
    (("tmp", "s8", 3), 12), (("recode", "s16", NINE), 9),
])
def test_how_long_a_text_may_get(node: Node, length: int) -> None:
    costs = _Costs(0)
    costs.lengths[3] = 12
    assert costs.length(node) == length


@each_of("block, found, units", [
    ((("copy", AT, AT, 100),), None, 96 + 100),
    ((("observe", "statement", 4), ("copy", AT, AT, 16 * 1024)), [("charge", 16, 4)], 0),
    ((("copy", AT, AT, 16 * 1024 - 97),), None, 16 * 1024 - 1), ((("copy", AT, AT, 16 * 1024 - 96),), [("charge", 16, 9)], 0),
    ((("if", ((N, (("copy", AT, AT, 20 * 1024),)),), ()),), [("charge", 20, 9)], 64),
    ((("case", "i16", N, ((((1, 1),), (("copy", AT, AT, 100),)),), (("copy", AT, AT, 50),)),), None, 64 + 196 + 146),
    ((("loop", (("charge", 1, 5),), (("copy", AT, AT, 5000),), ()),), [("charge", 5, 5)], 0),
    ((("loop", (("charge", 7, 5),), (("copy", AT, AT, 5000),), ()),), None, 0),
])
def test_what_a_region_charges(block: Any, found: list[Node] | None, units: int) -> None:
    costs = _Costs(9)
    made, total = costs.region(block)
    assert total == units, total
    assert (made is block or made == block) == (found is None), made
    charges = [part for part in flat(made) if part[:1] == ("charge",)]
    assert found is None or charges == found, charges


def flat(item: Any) -> list[Any]:
    return [] if not isinstance(item, tuple) else [item, *(inner for part in item for inner in flat(part))]


# --- layout -------------------------------------------------------------------------------------------------------------

BLOCK = "FUNCTION_BLOCK B VAR x : INT; END_VAR VAR RETAIN y : DINT; END_VAR VAR t : TON; END_VAR END_FUNCTION_BLOCK\n"
TYPES = "TYPE S : STRUCT a : INT; b : B; c : BOOL; END_STRUCT; P : STRUCT a, b : INT; END_STRUCT; END_TYPE\n"


@pytest.mark.slow
@each_of("declared, kept", [
    ("VAR RETAIN a : ARRAY[1..3] OF INT; END_VAR", [("Main.a", 6)]), ("VAR a : ARRAY[1..3] OF INT; END_VAR", []),
    ("VAR RETAIN p : P; END_VAR", [("Main.p", 4)]), ("VAR b : B; END_VAR", [("Main.b.y", 4)]),
    ("VAR b : ARRAY[2..3] OF B; END_VAR", [("Main.b[2].y", 4), ("Main.b[3].y", 4)]),
    ("VAR b : ARRAY[0..1, 5..6] OF B; END_VAR", [("Main.b[0, 5].y", 4), ("Main.b[0, 6].y", 4), ("Main.b[1, 5].y", 4),
                                                 ("Main.b[1, 6].y", 4)]),
    ("VAR s : S; END_VAR", [("Main.s.b.y", 4)]), ("VAR s : ARRAY[1..2] OF S; END_VAR", [("Main.s[1].b.y", 4),
    ("Main.s[2].b.y", 4)]),
    ("VAR RETAIN s : S; END_VAR", [("Main.s.a", 2), ("Main.s.b.x", 2), ("Main.s.b.y", 4), ("Main.s.c", 1)]),
    ("VAR n : INT; END_VAR VAR RETAIN n2 : INT; s : STRING[10]; END_VAR", [("Main.n2", 2), ("Main.s", 11)]),
])
def test_what_a_warm_start_keeps(declared: str, kept: list[tuple[str, int]]) -> None:
    made = image(f"{TYPES}{BLOCK}PROGRAM Main {declared} END_PROGRAM")
    rows = [(row.name, row.size) for row in made.retained if ".t." not in row.name]
    assert rows == kept
    where = [row.offset for row in made.retained]
    assert where == sorted(where) and len(set(where)) == len(where)


def test_a_copy_leaves_out_where_instances_begin() -> None:
    made = image(f"{TYPES}{BLOCK}PROGRAM Main VAR s : S; a : ARRAY[1..2] OF B; p : P; b : B; END_VAR END_PROGRAM")
    fields = {name: made.symbols["MAIN"].type.fields[name.upper()].type for name in "sapb"}  # type: ignore[attr-defined]
    for name, kind in fields.items():
        copied = [byte for start, count in runs(kind) for byte in range(start, start + count)]
        assert len(set(copied)) == len(copied) and copied == sorted(copied)
        headers = {"s": 2, "a": 4, "p": 0, "b": 2}[name]  # one of B and one of the TON in it, each
        assert len(copied) == kind.size - 8 * headers, name
    inner = fields["s"].fields["B"]
    assert list(runs(fields["p"])) == [(0, 4)] and next(runs(fields["s"])) == (0, inner.offset)
    assert next(runs(fields["b"])) == (8, fields["b"].fields["T"].offset - 8)


FRAMES = """FUNCTION F : INT
VAR_INPUT a : INT; r : REFERENCE TO INT; END_VAR
VAR CONSTANT K : INT := 3; END_VAR
VAR b : ARRAY[1..2] OF DINT; END_VAR
    F := a + K;
END_FUNCTION
FUNCTION_BLOCK B VAR n : INT; END_VAR VAR_TEMP t : LINT; END_VAR t := n; END_FUNCTION_BLOCK
PROGRAM Main VAR n : INT; b : B; END_VAR VAR_TEMP t : INT; END_VAR
    n := F(n, n); b(); FOR t := 1 TO 3 DO n := n + t; END_FOR
END_PROGRAM
"""


def test_variables_of_frames_are_found_by_their_names() -> None:
    made = image(FRAMES, dialect="codesys")
    shown = {pou: {name: (field.name, field.type.name, field.kind, field.reference, field.constant, field.absolute)
                   for name, field in fields.items()} for pou, fields in made.frames.items() if fields}
    assert {name: row for name, row in shown["F"].items() if name != "F"} == {
        "A": ("a", "INT", "VAR_INPUT", False, False, True), "R": ("r", "REFERENCE TO INT", "VAR_INPUT", False, False, True),
        "B": ("b", "ARRAY [1..2] OF DINT", "VAR", False, False, True), **({"K": shown["F"]["K"]} if "K" in shown["F"] else {})}
    assert shown["B"] == {"T": ("t", "LINT", "VAR_TEMP", False, False, True)}
    assert shown["MAIN"] == {"T": ("t", "INT", "VAR_TEMP", False, False, True)}
    places = [(field.offset, field.type.size) for fields in made.frames.values() for field in fields.values()]
    assert len({offset for offset, _ in places}) == len(places)
    assert all(field.frame_at == () for fields in made.frames.values() for field in fields.values())


PATHS = """{{attribute 'reflection'}}
FUNCTION_BLOCK B
VAR
    {{attribute 'instance-path'}}
    path : STRING[{}];
    plain : STRING[20];
END_VAR
END_FUNCTION_BLOCK
{{attribute 'reflection'}}
FUNCTION_BLOCK C EXTENDS B
VAR
    {{attribute 'instance-path'}}
    own : STRING[40];
END_VAR
END_FUNCTION_BLOCK
TYPE S : STRUCT n : INT; b : B; END_STRUCT; END_TYPE
PROGRAM Main
VAR one : B; many : ARRAY[1..2, 3..4] OF B; s : S; c : C; n : ARRAY[0..3] OF INT; END_VAR
END_PROGRAM
"""


@pytest.mark.slow
@each_of("size, cut", [(40, 40), (10, 10)])
def test_paths_of_instances_lie_in_their_texts(size: int, cut: int) -> None:
    from fbvm.machine.plc import Plc

    plc = Plc(image(PATHS.format(size), dialect="twincat"))
    texts = ["one", "many[1,3]", "many[2,4]", "s.b", "c"]
    found = [str(plc.read(f"Main.{name}.path")) for name in texts]
    assert found == [f"PLC.Main.{name}"[:cut] for name in texts], found
    assert (plc.read("Main.c.own"), plc.read("Main.one.plain")) == ("PLC.Main.c", "")


# --- constants ----------------------------------------------------------------------------------------------------------


@each_of("node, value", [
    (("add", "i16", const("i16", 32767), N), -32768), (("sub", "u8", const("u8", 0), const("u8", 1)), 255),
    (("mul", "i64", const("i64", 3), const("i64", -4)), -12), (("div", "i16", const("i16", -7), const("i16", 2)), -3),
    (("div", "i16", const("i16", -32768), const("i16", -1), 0), -32768),
    (("div", "f64", const("f64", 1.0), const("f64", 0.0), 0), INF),
    (("add", "f32", const("f32", 0.1), const("f32", 0.2)), arithmetic.single(0.1 + 0.2)),
    (("and", "u8", const("u8", 12), const("u8", 10)), 8), (("or", "u8", const("u8", 12), const("u8", 10)), 14),
    (("xor", "u8", const("u8", 12), const("u8", 10)), 6), (("shl", "u8", const("u8", 0x81), const("i64", 1), 0), 2),
    (("shr", "u8", const("u8", 0x81), const("i64", 1), 0), 0x40), (("rol", "u8", const("u8", 0x81), const("i64", 1), 0), 3),
    (("ror", "u8", const("u8", 0x81), const("i64", 1), 0), 0xC0), (("lt", "b", "i16", N, const("i16", 2)), True),
    (("le", "b", "i16", N, N), True), (("gt", "b", "i16", N, N), False), (("ge", "b", "i16", N, N), True),
    (("ne", "b", "i16", N, N), False), (("is_set", "b", "i16", const("i16", 4)), True),
    (("is_set", "b", "i16", const("i16", 0)), False),
    (("select", "i16", const("b", 1), N, const("i16", 7)), 7), (("select", "i16", const("b", 0), N, const("i16", 7)), 1),
    (("min", "i16", N, const("i16", -7)), -7), (("max", "i16", N, const("i16", -7)), 1),
    (("mux", "i16", const("i64", 1), (N, const("i16", 7)), 0), 7), (("floor_div", "i64", const("i64", -7), const("i64", 2)), -4),
    (("check", "i16", N, 1, 1, "R0105", 0), 1), (("length", "i16", FIVE), 5), (("find", "i16", NINE, const("s8", b"45")), 4),
    (("concat", "s8", FIVE, NINE), b"12345123456789"), (("left", "s8", NINE, const("i64", 3), 0), b"123"),
    (("right", "s8", NINE, const("i64", 3), 0), b"789"), (("mid", "s8", NINE, const("i64", 3), const("i64", 2), 0), b"234"),
    (("insert", "s8", FIVE, const("s8", b"x"), const("i64", 2), 0), b"12x345"),
    (("delete", "s8", FIVE, const("i64", 2), const("i64", 2), 0), b"145"), (("character", "s8", const("u8", 65)), b"A"),
    (("first", "u8", FIVE), 49), (("to_text", "s8", "INT", const("i16", -5)), b"-5"),
    (("from_text", "i16", "INT", const("s8", b"12"), 0), 12), (("enum_text", "s8", ((0, "Off"),
    (1, "On")), const("i64", 1)), b"On"),
    (("convert", "u8", "i16", const("i16", -1)), 255), (("nearest", "i16", "f64", const("f64", 2.5), 0), 2),
    (("truncate", "i16", "f64", const("f64", -2.9), 0), -2), (("abs", "i16", const("i16", -4)), 4),
    (("from_bcd", "u16", "u16", const("u16", 0x1234), 0), 1234), (("to_bcd", "u16", "u16", const("u16", 1234), 0), 0x1234),
])
def test_constants_are_worked_out_as_programs_do(node: Node, value: Any) -> None:
    assert value_of(node if node[0] != "div" or len(node) == 5 else (*node, 0)) == value


@each_of("node, code", [
    (("div", "i16", N, const("i16", 0), 0), "R0101"), (("mux", "i16", const("i64", 2), (N, N), 0), "R0107"),
    (("mux", "i16", const("i64", -1), (N, N), 0), "R0107"), (("check", "i16", N, 2, 5, "R0105", 0), "R0105"),
    (("check", "i16", N, -5, 0, "R0105", 0), "R0105"),
])
def test_constants_that_would_trap_are_not_worked_out(node: Node, code: str) -> None:
    with pytest.raises(arithmetic.Undefined) as undefined:
        value_of(node)
    assert undefined.value.args[0] == code or code in str(vars(undefined.value))


NUMBERS = """FUNCTION_BLOCK Sum
METHOD Down : DINT
VAR_INPUT n : DINT; END_VAR
VAR k : DINT; p : REF_TO DINT; END_VAR
    p := REF(k); p^ := n;
    IF n > 0 THEN Down := THIS.Down(n - 1) + k; END_IF
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    a : BYTE; b : WORD; c : DWORD; d : LWORD; e : USINT := 250; f : UDINT; g : SINT; h : ARRAY[-3..3] OF INT;
    i : INT(0..9); s : STRING[9];
    x : BOOL; r : REF_TO WORD; k : LINT; sum : Sum;
END_VAR
    a := TO_BIG_ENDIAN(a); b := TO_BIG_ENDIAN(b); c := TO_BIG_ENDIAN(c); d := FROM_BIG_ENDIAN(d); f := TO_BIG_ENDIAN(f);
    x := IS_VALID_BCD(b); b := SHL(b, 3) OR ROL(b, 5); b.%X15 := x; d.%B7 := a; e := e + 255; g := TO_SINT(k);
    FOR g := -128 TO 120 BY 7 DO h[g MOD 4] := LIMIT(-32768, h[0], 32767); END_FOR
    CASE i OF 0..4: r := REF(b); 9: r^ := 16#FFFF; END_CASE
    k := sum.Down(3) + FIND(s, 'x') + SEL(x, 16#7FFF_FFFF_FFFF_FFFF, k); s := MID(s, 2, i); f := TO_UDINT(d);
    i := MUX(e, 1, 2, i);
END_PROGRAM
"""


@each_of("dialect", ["standard", "codesys", "rusty"])
def test_constants_are_numbers_of_their_types(dialect: str) -> None:
    """So that no back end has to cut one."""
    found = [part for body in image(NUMBERS, dialect=dialect).bodies for part in flat(body.code)
             if part[:1] == ("const",) and part[1][0] in "iu"]
    assert len(found) > 60
    ranges = {form: arithmetic.limits(form) for _, form, _ in found}
    assert [part for part in found if not ranges[part[1]][0] <= part[2] <= ranges[part[1]][1]] == []


# --- the emitter --------------------------------------------------------------------------------------------------------


def test_operands_in_front_of_a_statement_are_kept_before_it() -> None:
    emitter = Emitter(DIALECTS["standard"])

    def values() -> Any:
        yield ("load", "i16", AT)
        yield N
        emitter.emit(("call", 1))
        yield ("load", "i16", ("abs", 2, ()))
        yield ("tmp", "i16", 40)
        emitter.emit(("call", 2))
        yield N

    assert emitter.sequence(values()) == [("tmp", "i16", 1), N, ("tmp", "i16", 2), ("tmp", "i16", 40), N]
    later = ("load", "i16", ("abs", 2, ()))
    assert emitter.out == [("let", 1, "i16", ("load", "i16", AT)), ("call", 1), ("let", 2, "i16", later), ("call", 2)]


def test_temporaries_are_made_once_and_where_they_are_needed() -> None:
    emitter = Emitter(DIALECTS["standard"])
    load = ("load", "i16", AT)
    assert [emitter.to_temporary(load), emitter.to_temporary(N), emitter.to_temporary(("tmp", "i16", 1))] == [
        ("tmp", "i16", 1), N, ("tmp", "i16", 1)]
    assert emitter.to_temporary(N, always=True) == ("tmp", "i16", 2)
    with emitter.block() as inner:
        emitter.emit(("call", 3))
    assert inner == [("call", 3)] and emitter.out == [("let", 1, "i16", load), ("let", 2, "i16", N)]


def test_what_is_nested_deeply_is_cut() -> None:
    emitter = Emitter(DIALECTS["standard"])
    node: Node = N
    for _ in range(DEEPEST - 1):
        node = emitter.cut_if_deep(("add", "i16", node, N))
        assert node[0] == "add" and emitter.cut_if_deep(node) is node
    assert emitter.out == []
    deepest = emitter.cut_if_deep(("add", "i16", node, N))
    assert deepest == ("tmp", "i16", 1) and len(emitter.out) == 1
    assert emitter.cut_if_deep(("add", "i16", N, node))[0] == "tmp", "the deeper operand counts, wherever it stands"
    assert emitter.cut_if_deep(("add", "i16", deepest, N))[0] == "add"


# --- pictures -----------------------------------------------------------------------------------------------------------

BOOLS = [f"b{number}" for number in range(62)]


def said(body: str) -> str:
    """The comment of the first rung of a body, "" if it is drawn."""
    declared = f"{', '.join(BOOLS)} : BOOL; n, m : INT; b : B;"
    made = image(f"{BLOCK}FUNCTION F : BOOL VAR_INPUT x : BOOL; END_VAR F := x; END_FUNCTION\n"
                 f"PROGRAM Main VAR {declared} END_VAR\n{body}\nEND_PROGRAM", drawn=True)
    first = next(rung for rung in made.rungs if made.bodies[rung.body].name == "Main")
    assert bool(first.steps) != bool(first.comment)
    return first.comment.removeprefix("in line 4 is not drawn: ")


@pytest.mark.slow
@each_of("body, why", [
    ("WHILE b0 DO b0 := b1; END_WHILE", "WHILE"), ("REPEAT b0 := b1; UNTIL b0 END_REPEAT", "REPEAT"),
    ("CASE n OF 1: b0 := b1; END_CASE", "CASE"),
    ("IF b0 THEN b1 := b2; END_IF", "an IF that does more than setting and resetting"),
    ("IF b0 THEN b1 S= TRUE; END_IF", "an IF that does more than setting and resetting"),
    ("IF b0 THEN b1 := TRUE; ELSIF b2 THEN b1 := FALSE; END_IF", "an IF with ELSE"), ("IF b0 THEN END_IF", "an empty IF"),
    ("F(b0);", "a call that is none of a function block"), ("b0 := F(b1);", "a call in an expression"), ("b();", ""),
    (f"b0 := {' AND '.join(BOOLS[1:61])};", ""), (f"b0 := {' OR '.join(BOOLS[1:61])};", ""),
    (f"b0 := {' AND '.join(BOOLS[1:62])};", "an expression of more than 60 contacts"),
    ("b0 := b1 XOR b2 XOR b3 XOR b4 XOR b5;", ""),
    ("b0 := b1 XOR b2 XOR b3 XOR b4 XOR b5 XOR b6;", "an expression of more than 60 contacts"),
    ("n := 5;", "an assignment that is not of BOOL"), ("b0 := n > 3;", ""), ("IF n > 3 THEN b0 := TRUE; b1 := FALSE; END_IF", ""),
])
def test_what_is_no_rung_is_named(body: str, why: str) -> None:
    assert said(body) == why
