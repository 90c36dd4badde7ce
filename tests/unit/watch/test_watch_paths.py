"""Names and addresses to places."""

import pytest
from rows import each_of

from fbvm.base import types as t
from fbvm.base.areas import AREAS
from fbvm.base.types import Field, StructType
from fbvm.watch.paths import Place, Span, UnknownPlace, find, find_place

POINT = StructType("Point", 8, 4, {"X": Field("x", t.INT, 0), "Y": Field("y", t.DINT, 4)})
ROWS = t.array(((1, 3), (0, 1)), POINT)
CONN = StructType("Conn", 16, 8, {"ENO": Field("ENO", t.BOOL, 8, "VAR_OUTPUT")}, block=True)
MAIN = StructType("Main", 200, 8, {
    "CONN": Field("conn", CONN, 8),
    "A": Field("a", ROWS, 24),
    "FLAGS": Field("flags", t.WORD, 80),
    "SWITCH": Field("switch", t.BOOL, AREAS["CIO"].offset + 3038, bit=2, absolute=True),
    "SHARED": Field("shared", POINT, 88, "VAR_IN_OUT", reference=True),
    "LIMIT": Field("limit", t.INT, 96, constant=True),
    "X2": Field("x2", t.WORD, 100),
    "X2_POS": Field("x2_pos", t.INT, 102),
}, block=True)
STEP = StructType("Step", 8, 8, {"X": Field("X", t.BOOL, 0)})
CHART = StructType("Chart", 32, 8, {  # with steps that are called as a variable and as the chart itself
    "FILL": Field("fill", t.INT, 0), "X": Field("X", t.BOOL, 2), "FILL STEP": Field("fill step", STEP, 8),
    "CHART STEP": Field("Chart step", STEP, 16),
}, block=True)
SYMBOLS = {"CHART": Field("Chart", CHART, 190000), "MAIN": Field("Main", MAIN, 180224), "D200": Field("d200", t.INT, 181000)}


def place(text: str) -> Place:
    return find_place(SYMBOLS, AREAS, text)


@each_of(("text", "name", "type_name", "offset", "bit"), [
    ("Main.conn.ENO", "Main.conn.ENO", "BOOL", 180224 + 16, None),
    ("main . CONN.eno", "Main.conn.ENO", "BOOL", 180224 + 16, None),
    ("Main.a[1, 0].y", "Main.a[1, 0].y", "DINT", 180224 + 28, None),
    ("Main.a[3,1].x", "Main.a[3, 1].x", "INT", 180224 + 24 + 40, None),
    ("Main.flags.8", "Main.flags.8", "BOOL", 180224 + 81, 0),
    ("Main.flags.9", "Main.flags.9", "BOOL", 180224 + 81, 1),
    ("Main.flags.%X0", "Main.flags.0", "BOOL", 180224 + 80, 0),
    ("Main.flags.X1", "Main.flags.1", "BOOL", 180224 + 80, 1),
    ("Main.X2", "Main.x2", "WORD", 180224 + 100, None),
    ("Main. x2_pos", "Main.x2_pos", "INT", 180224 + 102, None),
    ("Chart.fill", "Chart.fill", "INT", 190000, None), ("Chart.fill.X", "Chart.fill step.X", "BOOL", 190008, None),
    ("Chart.X", "Chart.X", "BOOL", 190002, None),
    ("Main.x2.x3", "Main.x2.3", "BOOL", 180224 + 100, 3),
    ("Main.switch", "Main.switch", "BOOL", AREAS["CIO"].offset + 3038, 2),
    ("D200", "d200", "INT", 181000, None),
    ("%D200", "D200", "WORD", AREAS["D"].offset + 400, None),
    ("D201", "D201", "WORD", AREAS["D"].offset + 402, None),
    ("CIO 1509.15", "CIO 1509.15", "BOOL", AREAS["CIO"].offset + 3019, 7),
    ("cio1509.15", "CIO 1509.15", "BOOL", AREAS["CIO"].offset + 3019, 7),
    ("%MW10", "%MW10", "WORD", AREAS["M"].offset + 20, None),
    ("%MD3", "%MD3", "DWORD", AREAS["M"].offset + 12, None),
    ("%MB3", "%MB3", "BYTE", AREAS["M"].offset + 3, None),
    ("%IX0.3", "%IX0.3", "BOOL", AREAS["I"].offset, 3),
    ("%ML1", "%ML1", "LWORD", AREAS["M"].offset + 8, None),
    ("CF102", "CF102", "BOOL", AREAS["CF"].offset + 12, 6),
])
def test_text_names_a_place(text: str, name: str, type_name: str, offset: int, bit: int | None) -> None:
    found = place(text)
    assert (found.name, found.type.name, found.offset, found.bit) == (name, type_name, offset, bit)


def test_a_way_through_a_reference_is_kept() -> None:
    found = place("Main.shared.y")
    assert (found.offset, found.hops, found.type.name) == (180224 + 88, (4,), "DINT")


def test_what_lies_in_an_older_frame_is_found_through_the_links() -> None:
    found = find_place({"OLD": Field("old", t.INT, 4, frame_at=(190100, 8, 16))}, AREAS, "old")
    assert (found.offset, found.hops) == (190100, (8, 16, 4))


def test_what_the_compiler_has_added_is_known() -> None:
    added = {"Main.conn.ENO": False, "CIO 1509.15": False, "Main.a[1, 0].y": False}
    assert {text: place(text).is_generated for text in added} == added
    assert [Place(name, t.INT, 0).is_generated for name in ("Main.$edge", "Main.pump ENO")] == [True, True]


def test_constants_are_known() -> None:
    assert place("Main.limit").constant


@each_of(("text", "names"), [
    ("D300..D302", ["D300", "D301", "D302"]),
    ("%D200..%D201", ["D200", "D201"]),
    ("CIO 1519.14..CIO 1520.01", ["CIO 1519.14", "CIO 1519.15", "CIO 1520.00", "CIO 1520.01"]),
    ("%IX0.6..%IX1.1", ["%IX0.6", "%IX0.7", "%IX1.0", "%IX1.1"]),
])
def test_a_range_is_its_places(text: str, names: list[str]) -> None:
    found = find(SYMBOLS, AREAS, text)
    assert isinstance(found, Span)
    assert [part.name for part in found.places] == names


@pytest.mark.parametrize(("text", "message"), [
    ("Main.conn.EN", "Main.conn has no EN; it has ENO"),
    ("conn.ENO", "did you mean Main.conn.ENO?"),
    ("ENO", "did you mean Main.conn.ENO?"),
    ("nothing", "there is no nothing; known here: Chart, Main, d200"),
    ("D40000", "D ends at 32767; 40000 does not exist"),
    ("Main.a[4, 0].x", "Main.a[4, 0]: 4 is outside 1..3"),
    ("Main.a[1].x", "Main.a has 2 subscripts, 1 given"),
    ("Main.a[i, 0]", "a subscript is a whole number"),
    ("Chart.fill.y", "Chart.fill is INT and has no member y"), ("HR99999", "is not an address"),
    ("Main.flags[0]", "Main.flags is WORD, not an array"),
    ("Main.flags.16", "Main.flags has bits 0..15; 16 does not exist"),
    ("Main.flags.bit", "Main.flags is WORD and has no member bit"),
    ("Main.conn.ENO.0", "has no bits"),
    ("Main.conn.x1", "Main.conn has no x1; it has ENO"),
    ("Main.conn.%X1", "has no bits"),
    ("Main.", "ends too early"),
    ("Main conn", "is not a path"),
    ("Main.conn^", "is no reference"),
    ("D5..D2", "the lower end first"),
    ("D5..CIO 9", "both ends must lie in one area"),
    ("D5..Main", "is no range of addresses"),
    ("E0_5", "this PLC has no E0 bank"),
    ("", "is not an address"),
])
def test_what_names_nothing_says_why(text: str, message: str) -> None:
    with pytest.raises(UnknownPlace) as error:
        find(SYMBOLS, AREAS, text)
    assert message in str(error.value)


def test_where_there_are_many_names_those_like_the_wanted_one_come_first() -> None:
    fields = {name.upper(): Field(name, t.INT, 2 * at) for at, name in enumerate([*"abcdefghijkl", "Start", "Stop"])}
    many = {"MAIN": Field("Main", StructType("Main", 28, 2, fields, block=True), 180224)}
    with pytest.raises(UnknownPlace, match=r"^Main has no Strat; it has Start, a, b, c, d, e, f, g, h, i, j, k, \.\.\.$"):
        find(many, AREAS, "Main.Strat")
    with pytest.raises(UnknownPlace, match=r"^there is no Strat; known here: Start, Stop, a, b, c, d, e, f, \.\.\.$"):
        find({**fields, "STRATA.X": Field("x", t.INT, 0, reference=True)}, AREAS, "Strat")


def test_one_place_is_not_a_range() -> None:
    with pytest.raises(UnknownPlace, match="is a range; name one place"):
        place("D1..D3")


LISTS = {**SYMBOLS, "GVL.LEVEL": Field("GVL.level", t.INT, 182000, "VAR_GLOBAL", space="GVL"),
         "GVL.TANK": Field("GVL.tank", POINT, 182008, "VAR_GLOBAL", space="GVL"),
         "TWO.TANK": Field("Two.tank", POINT, 182016, "VAR_GLOBAL", space="Two"),
         "FREE": Field("free", t.INT, 182024, "VAR_GLOBAL", space="Two")}


@each_of(("text", "offset"), [
    ("GVL.level", 182000), ("gvl . LEVEL", 182000), ("level", 182000), ("GVL.tank.y", 182012), ("two.tank.x", 182016),
    ("free", 182024), ("Two.free", 182024), ("Main.x2", 180324)])
def test_lists_of_global_variables_stand_in_front(text: str, offset: int) -> None:
    assert find_place(LISTS, AREAS, text).offset == offset


@pytest.mark.parametrize(("text", "message"), [
    ("GVL.free", "it has GVL.level, GVL.tank"), ("tank.x", "there is no tank"), ("GVL.levle", "the list has no such variable")])
def test_what_a_list_does_not_have(text: str, message: str) -> None:
    with pytest.raises(UnknownPlace, match=message):
        find_place(LISTS, AREAS, text)
