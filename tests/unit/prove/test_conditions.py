"""Conditions of users as terms say of a scan what the same conditions say of a PLC; which inputs random runs get."""

from __future__ import annotations

from random import Random
from types import SimpleNamespace

import pytest
from symbolic import CYCLE_NS, encoded, held, term_value

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources, compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.cells import BIT, NUMBER, Cell
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.expressions import constant_term, constant_value
from fbvm.prove.encoding.properties import condition_term
from fbvm.prove.encoding.scan import read_bool
from fbvm.prove.encoding.terms import Term, Terms
from fbvm.prove.equality import PROGRAM, equality, pair
from fbvm.prove.invariants import Bounds, Clause, Guess, Literal, Ordered, Sample, guesses
from fbvm.prove.runs import InputWriter, RandomInputs
from fbvm.watch.conditions import parse_condition
from fbvm.watch.paths import Place

TEXT = """TYPE Mode : (Off, Slow, Fast); END_TYPE
PROGRAM Main
VAR
    a, b : INT; u : UINT; m : Mode; t : TIME; d : DINT; l : LINT; p, q : BOOL; w : WORD; x, y : REAL; z : LREAL; r : REF_TO INT;
    f : ARRAY[0..1] OF SINT; s : STRING[5]; bit AT CIO 7.03 : BOOL; v : USINT; n : REF_TO INT; g : REF_TO BOOL;
END_VAR
u := INT_TO_UINT(a); d := INT_TO_DINT(a) * b; l := d; f[0] := INT_TO_SINT(b); p := a > b; q := a > 0; w := INT_TO_WORD(a);
IF a > 5 THEN m := Fast; ELSIF b > 5 THEN m := Slow; END_IF t := INT_TO_TIME(b); bit := b < 0; v := INT_TO_USINT(b);
r := REF(a); IF p THEN r := REF(b); END_IF g := REF(q);
END_PROGRAM"""
ROWS = [(-1.5, -0.0), (0.0, 2.5), (float("nan"), 2.5), (2.5, 2.5), (1.0, -1.5)]
NAN = float("nan")
NUMBERS = [(0, 0), (-32768, 7), (6, -1), (100, 200), (300, 9), (32767, -300), (-1, -128)]


@pytest.fixture(scope="module")
def plc() -> Plc:
    image = compile_text(TEXT, lint=False).image
    assert image is not None
    return Plc(image, CYCLE_NS, engine="python")


def found(plc: Plc, name: str) -> Place:
    place = plc.find(name if name.startswith(("CIO", "D")) else f"Main.{name}")
    assert isinstance(place, Place)
    return place


@pytest.fixture(scope="module")
def scanned(plc: Plc) -> tuple[object, dict[Term, Cell], bytes]:
    made, variables = encoded(plc, [found(plc, name) for name in "abxyz"])
    return made, variables, bytes(plc.memory.u8)


CONDITIONS = """a < b, a <= b, a = b, a <> b, a >= b, a > b, u > a, u - a <= 0, a + b = 309, a * b > 70
a - b < -300, -a > 7, a / 7 = 0
a MOD 7 = -1, d / -3 > 100, l = d, f[0] = b, m = Fast, m <> Off, t > T#8ms, t = T#-1ms, p AND q, p OR q, p XOR q, NOT p, p & NOT q
p = q, p <> q, p < q, p >= q, w = 16#12C, w.3, w.15 AND p, x < y, x <= y, x = y, x <> y, x >= y, x > y, z > 1.5, x = 0, bit
CIO 7 = 8, r^ = 9, r^ > a, r^ <= b, TRUE, FALSE AND p, v = b, v < 200, v > f[0], g^, NOT g^ OR p, x > -1, 2 < y
a + u * 2 > d"""

ALWAYS_ALIKE = ("TRUE", "FALSE AND p", "l = d", "x = 0", "r^ <= b", "r^ > a", "u - a <= 0", "t = T#-1ms")


@pytest.mark.parametrize("text", CONDITIONS.replace("\n", ", ").split(", "))
def test_a_condition_is_a_term_with_its_value(plc: Plc, scanned: tuple[object, dict[Term, Cell], bytes], text: str) -> None:
    made, variables, begun = scanned
    condition = parse_condition(text, lambda name: found(plc, name))
    term = condition_term(made.contents, condition.term)  # type: ignore[attr-defined]
    seen = set()
    for number, (a, b) in enumerate(NUMBERS):
        plc.memory.u8[:] = begun
        x, y = ROWS[number % len(ROWS)]
        for name, value in zip("abxyz", (a, b, x, y, x), strict=True):
            plc.write(f"Main.{name}", value)
        values = {variable: held(cell, bytes(plc.memory.u8)) for variable, cell in variables.items()}
        plc.scan()
        assert term_value(term, values) == condition.holds(plc.read), (text, a, b, x, y)
        seen.add(condition.holds(plc.read))
    assert len(seen) == 2 or text in ALWAYS_ALIKE


def test_a_bool_lies_in_a_byte_or_in_a_bit_of_one(plc: Plc, scanned: tuple[object, dict[Term, Cell], bytes]) -> None:
    made, variables, begun = scanned
    contents = made.contents  # type: ignore[attr-defined]
    for name in ("p", "bit"):
        for a, b in ((1, -1), (1, 2)):
            plc.memory.u8[:] = begun
            plc.write("Main.a", a)
            plc.write("Main.b", b)
            values = {variable: held(cell, bytes(plc.memory.u8)) for variable, cell in variables.items()}
            assert term_value(read_bool(contents, found(plc, name)), values) == (b < 0)


@pytest.mark.parametrize(("text", "reason"), [
    ("a / b > 1", "divides by a variable"), ("x + y > 1", "compare whole numbers"), ("x > a", "compare"),
    ("x < z", "one of its type"),
    ("s = 'on'", "texts cannot be followed"), ("n^ = 1", "may be null"), ("a > 1.5", "compare whole numbers"),
])  # fmt: skip
def test_what_cannot_be_followed_says_why(
    plc: Plc, scanned: tuple[object, dict[Term, Cell], bytes], text: str, reason: str
) -> None:
    with pytest.raises(Refused, match=reason):
        condition_term(scanned[0].contents, parse_condition(text, lambda name: found(plc, name)).term)  # type: ignore[attr-defined]


def test_constants_of_code_are_terms_of_their_value_and_back() -> None:
    x = SimpleNamespace(terms=T)
    for machine, value in (("b", True), ("b", False), ("i16", -5), ("u16", 65_531), ("f32", -0.5), ("f64", 1e300), ("s8", b"ab")):
        term = constant_term(x, machine, value)  # type: ignore[arg-type]
        assert term.is_constant and constant_value(machine, term) == value and type(constant_value(machine, term)) is type(value)
    assert constant_term(x, "b", True) is T.true and constant_term(x, "b", False) is T.false  # type: ignore[arg-type]
    assert constant_term(x, "f32", NAN).value == 0x7FC0_0000  # type: ignore[arg-type]


# --- inputs of random runs --------------------------------------------------------------------------------------------

INPUTS = """TYPE Mode : (Off := 3, Slow := 9, Back := -2); END_TYPE
PROGRAM Main
VAR w AT %IW2 : WORD; d AT %ID4 : DWORD; m AT %IW12 : Mode; s AT %IW14 : INT(-3..4); b AT %IX20.2 : BOOL; two AT %IW22 : WORD;
    low AT %IB22 : BYTE; x : DWORD; END_VAR
END_PROGRAM"""


@pytest.fixture(scope="module")
def inputs() -> Image:
    image = compile_text(INPUTS, lint=False).image
    assert image is not None
    return image


def test_a_cell_of_inputs_is_named_by_its_variable(inputs: Image) -> None:
    plc = Plc(inputs)
    at = {name: plc.find(f"Main.{name}").offset for name in ("w", "x", "b", "two")}  # type: ignore[union-attr]
    cells = {"whole": Cell(at["w"], 2, NUMBER), "bit": Cell(at["x"] + 2, 1, BIT, 5), "own bit": Cell(at["b"], 1, BIT, 2),
             "shared": Cell(at["two"], 2, NUMBER)}  # fmt: skip
    places = InputWriter(plc, list(cells.values())).places
    names = {kind: [(place.name, place.bit) for place in places[cell]] for kind, cell in cells.items()}
    assert names["whole"] == [("Main.w", None)] and names["own bit"] == [("Main.b", 2)]
    assert names["bit"] == [("Main.x.21", 5)] and {name for name, _ in names["shared"]} >= {"Main.two"}
    [place] = places[cells["bit"]]
    plc.write("Main.x", 1 << 21)
    assert plc.read(place) is True
    plc.write("Main.x", 1 << 20)
    assert plc.read(place) is False


def test_inputs_are_written_and_read_by_their_cells(inputs: Image) -> None:
    plc = Plc(inputs)
    word, bit = plc.find("Main.w"), plc.find("Main.b")
    assert isinstance(word, Place) and isinstance(bit, Place)
    writer = InputWriter(plc, [Cell(word.offset, 2, NUMBER), Cell(bit.offset, 1, BIT, 2)])
    for cell, value in zip(writer.cells, (0xBEEF, 1), strict=True):
        writer.write(cell, value)
    assert (plc.read("Main.w"), plc.read("Main.b"), [writer.read(cell) for cell in writer.cells]) == (0xBEEF, True, [0xBEEF, 1])
    writer.write(writer.cells[1], 0)
    assert (plc.read("Main.b"), writer.read(writer.cells[1])) == (False, 0)


def test_random_inputs_have_the_values_of_their_types(inputs: Image) -> None:
    plc = Plc(inputs)
    places = {name: plc.find(f"Main.{name}") for name in ("m", "s", "w", "b")}
    cells = {name: Cell(place.offset, 2, NUMBER) for name, place in places.items() if name != "b"}  # type: ignore[union-attr]
    cells["b"] = Cell(places["b"].offset, 1, BIT, 2)  # type: ignore[union-attr]
    drawn = RandomInputs(InputWriter(plc, list(cells.values())), Random(1))
    seen = {name: {drawn.value(cell) for _ in range(400)} for name, cell in cells.items()}
    assert seen["m"] == {3, 9, 0xFFFE} and seen["b"] == {0, 1}
    assert seen["s"] == {*range(5), 0xFFFD, 0xFFFE, 0xFFFF}
    assert {0, 1, 0xFFFF, 0x7FFF, 0x8000, 10, 100} <= seen["w"] and len(seen["w"]) > 100 and max(seen["w"]) == 0xFFFF


# --- invariants -------------------------------------------------------------------------------------------------------

T = Terms()
FLAG, SMALL, WIDE, OTHER, LONG = (T.variable(name, width) for name, width in zip("fswol", (0, 8, 16, 16, 64), strict=True))
SAMPLES = [Sample({FLAG: 1, SMALL: 3, WIDE: 0xFFFB, OTHER: 7, LONG: 40}, 50),
           Sample({FLAG: 0, SMALL: 250, WIDE: 9, OTHER: 9, LONG: 60}, 60)]  # fmt: skip
BROKEN = Sample({FLAG: 0, SMALL: 3, WIDE: 20, OTHER: 0xFFFF, LONG: 70}, 65)


@pytest.mark.parametrize(("guess", "holds"), [
    (Literal(FLAG, 1), [True, False, False]), (Literal(SMALL, 3, False), [False, True, False]),
    (Clause(Literal(FLAG, 1), Literal(SMALL, 250)), [True, True, False]),
    (Bounds(WIDE, -5, 9), [True, True, False]), (Bounds(SMALL, -6, 2), [False, True, False]),
    (Ordered(WIDE, OTHER), [True, True, False]), (Ordered(OTHER, WIDE), [False, True, True]),
    (Ordered(LONG, None), [True, True, False]),
])  # fmt: skip
def test_a_guess_is_a_term_that_is_true_where_it_holds(guess: Guess, holds: list[bool]) -> None:
    now = T.variable("now", 64)
    for sample, wanted in zip([*SAMPLES, BROKEN], holds, strict=True):
        assert guess.holds(sample) is wanted
        term = guess.term(T, {variable: variable for variable in sample.values}, now)
        assert term_value(term, {**sample.values, now: sample.now_ns}) == wanted


def test_what_holds_in_all_samples_is_guessed() -> None:
    made = guesses([FLAG, SMALL, WIDE, OTHER, LONG], SAMPLES)
    assert all(guess.holds(sample) for guess in made for sample in SAMPLES)
    top = 1 << 15
    assert {Bounds(SMALL, -6, 3), Bounds(WIDE, -5, 9), Bounds(WIDE, -5, top - 1), Bounds(WIDE, -top, 9),
            Bounds(OTHER, 0, top - 1), Ordered(WIDE, OTHER), Ordered(LONG, None)} <= {*made}
    assert Literal(SMALL, 3, False) not in made
    assert Clause(Literal(FLAG, 1), Literal(SMALL, 250)) in made and Clause(Literal(FLAG, 1), Literal(SMALL, 3)) not in made
    assert Ordered(OTHER, WIDE) not in made and not [each for each in made if isinstance(each, Ordered) and each.lesser is SMALL]


def test_a_clause_with_a_side_that_always_holds_is_left_out_unless_that_is_doubted() -> None:
    always = [Sample({FLAG: 1, SMALL: 3}, 0), Sample({FLAG: 1, SMALL: 4}, 0)]
    both = Clause(Literal(FLAG, 1), Literal(SMALL, 3))
    assert Literal(FLAG, 1) in guesses([FLAG, SMALL], always) and both not in guesses([FLAG, SMALL], always)
    assert both in guesses([FLAG, SMALL], always, {Literal(FLAG, 1)})


# --- two blocks beside each other -------------------------------------------------------------------------------------

BLOCKS = """FUNCTION_BLOCK One VAR_INPUT i : INT; END_VAR VAR_OUTPUT o : ARRAY[0..1] OF INT; r : REAL; END_VAR
VAR_IN_OUT io : INT; END_VAR END_FUNCTION_BLOCK
FUNCTION_BLOCK Two VAR_INPUT i : INT; END_VAR VAR_OUTPUT o : ARRAY[0..1] OF INT; r : REAL; END_VAR
VAR_IN_OUT io : INT; END_VAR END_FUNCTION_BLOCK
FUNCTION F : INT VAR_INPUT i : INT; END_VAR VAR_OUTPUT q : BOOL; END_VAR END_FUNCTION
FUNCTION G : INT VAR_INPUT i : INT; END_VAR VAR_OUTPUT q : BOOL; END_VAR END_FUNCTION"""


@pytest.mark.parametrize(("left", "right", "compared"), [
    ("One", "Two", ["o[0]", "o[1]", "r", "io"]), ("F", "G", ["q", "Result"]),
])  # fmt: skip
def test_all_outputs_are_compared(left: str, right: str, compared: list[str]) -> None:
    sources = [Source("blocks.st", BLOCKS)]
    made = compile_sources([*sources, pair(sources, (left, right))], PROGRAM, runnable=True, lint=False)
    assert made.image is not None, made.diagnostics
    asked = equality(made.image, (left, right)).text
    for name in compared:
        sides = [f"Equal.{side}{'.' if left == 'One' and name != 'io' else '_'}{name}" for side in ("Left", "Right")]
        assert f"{sides[0]} = {sides[1]}" in asked, asked
    assert asked.count("Left") == len(compared) + 2 * ("r" in compared)
