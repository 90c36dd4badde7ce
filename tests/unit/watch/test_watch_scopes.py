"""Names inside an instance, instances of a block, what a reference points to, the part that has changed, writes that meet."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import INT, Field
from fbvm.code.image import Image
from fbvm.code.operations import FIRST_OBJECT, OBJECT_SHIFT, OFFSET_SHIFT
from fbvm.watch.bits import bits_of, meet, written_bits, written_twice
from fbvm.watch.changes import changed
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.watch.scopes import Scope, every_instance, instances, place_of

TEXT = """
TYPE Pair : STRUCT a : INT; b : REAL; END_STRUCT END_TYPE
VAR_GLOBAL n : DINT; spare : Deep; there AT CIO 9 : WORD; END_VAR
FUNCTION_BLOCK Low VAR n : INT; END_VAR ; END_FUNCTION_BLOCK
FUNCTION_BLOCK Deep VAR inner : Low; END_VAR ; END_FUNCTION_BLOCK
PROGRAM Main
VAR
    one : Low; two : ARRAY[1..2] OF Low; deep : Deep; pair : Pair; pairs : ARRAY[0..1] OF Pair; bits : ARRAY[0..9] OF BOOL;
    p : REF_TO INT; q : REF_TO WORD; w : WORD; low AT CIO 7.3 : BOOL;
END_VAR
    p := REF(pair.a); q := REF(w);
END_PROGRAM
"""


@pytest.fixture(scope="module")
def image() -> Image:
    made = compile_text(TEXT)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


@pytest.fixture
def plc(image: Image) -> Plc:
    plc = Plc(image)
    plc.scan()
    return plc


def place(plc: Plc, name: str) -> Place:
    found = plc.find(name)
    assert isinstance(found, Place)
    return found


@each_of(("instance", "text", "name"), [
    ("Main.one", "n", "Main.one.n"), ("Main.one", "THIS.n", "Main.one.n"), ("Main.one", "this^.n", "Main.one.n"),
    ("Main.one", "Main.w", "Main.w"), ("Main.one", "D7", "D7"), ("Main", "pair.a", "Main.pair.a"), (None, "n", "n"),
    ("Main.w", "n", "n")])
def test_a_name_is_one_of_the_instance_first(plc: Plc, instance: str | None, text: str, name: str) -> None:
    found = Scope(plc.find, place(plc, instance) if instance else None).find(text)
    assert isinstance(found, Place) and found.name == name


def test_outside_of_instances_there_is_no_this(plc: Plc) -> None:
    with pytest.raises(UnknownPlace):
        Scope(plc.find).find("THIS.n")
    assert (place_of(plc.find, ""), place_of(plc.find, "Main.nobody"), place_of(plc.find, "D1..D3")) == (None, None, None)
    assert place_of(plc.find, "Main.one") == place(plc, "Main.one")


def test_what_lives_in_the_body_alone_is_found_in_front_of_the_instance(plc: Plc) -> None:
    local = {"N": Field("n", INT, 96), "PAIR": Field("pair", place(plc, "Main.pair").type, 104)}
    scope = Scope(plc.find, place(plc, "Main.one"), local)
    assert [found.offset for found in map(scope.find, ("n", "Pair.b")) if isinstance(found, Place)] == [96, 108]
    with pytest.raises(UnknownPlace, match="n is INT and has no member a"):
        scope.find("n.a")


@each_of(("text", "said"), [
    ("pear.a", "there is no pear; did you mean pair?"), ("lcoal", "there is no lcoal; did you mean local?"),
    ("xyz", "there is no xyz; known here: Main, spare, n, there"), ("Main.pear", "Main has no pear; it has one, two, deep, pair"),
    ("D40000", "D ends at 32767; 40000 does not exist"),
])
def test_a_misspelt_name_of_the_body_gets_a_suggestion(plc: Plc, text: str, said: str) -> None:
    with pytest.raises(UnknownPlace) as error:
        Scope(plc.find, place(plc, "Main"), {"LOCAL": Field("local", INT, 96)}).find(text)
    assert str(error.value).startswith(said)


@each_of(("pou", "most", "found"), [
    ("low", 9, ["Main.one", "Main.two[1]", "Main.two[2]", "Main.deep.inner", "spare.inner"]),
    ("Low", 2, ["Main.one", "spare.inner"]),
    ("Deep", 9, ["spare", "Main.deep"]), ("Main", 9, ["Main"]), ("Pair", 9, []), ("Nobody", 9, [])])
def test_instances_are_found_those_nearest_to_the_top_first(plc: Plc, pou: str, most: int, found: list[str]) -> None:
    made = instances(plc.image.symbols, pou, most)
    assert sorted(each.name for each in made) == sorted(found)
    assert all(each.offset == place(plc, each.name).offset for each in made)


def test_instances_in_structures_and_in_arrays_of_two_dimensions_are_found() -> None:
    plc = Plc(compile_text("""FUNCTION_BLOCK Pump VAR n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK
TYPE Line : STRUCT id : INT; p : Pump; q : ARRAY [0..1, 2..3] OF Pump; END_STRUCT;
     Plain : STRUCT n : INT; END_STRUCT; END_TYPE
PROGRAM Main VAR l : Line; plain : ARRAY [1..9] OF Plain; k : ARRAY [5..6] OF Line; END_VAR l.p(); END_PROGRAM""").image)
    made = instances(plc.image.symbols, "Pump", 99)
    inside = ("p", *(f"q[{row}, {column}]" for row in (0, 1) for column in (2, 3)))
    assert sorted(each.name for each in made) == sorted(
        f"Main.{line}.{name}" for line in ("l", "k[5]", "k[6]") for name in inside)
    assert all(each.offset == place(plc, each.name).offset for each in made)
    assert [each.name for each in every_instance(plc.image.symbols, 1)] == [
        "Main", "Main.l.p", "Main.l.q[0, 2]", "Main.k[5].p", "Main.k[5].q[0, 2]"]


def test_a_reference_is_read_as_the_name_of_what_it_points_to(plc: Plc) -> None:
    names = Names.of(plc.image, plc.image.layout.areas)
    assert [names.read(plc.read, place(plc, name)) for name in ("Main.p", "Main.q")] == ["-> Main.pair.a", "-> Main.w"]
    assert names.read(plc.read, place(plc, "Main.w")) == 0
    assert names.name_references(place(plc, "Main.pair").type, {"a": 1, "b": 2.0}) == {"a": 1, "b": 2.0}
    plc.write("Main.one.n", 5)
    assert names.read(plc.read, place(plc, "Main.one")) == {"n": 5}


def test_bytes_behind_the_last_variable_have_no_name(plc: Plc) -> None:
    names, areas = Names.of(plc.image, plc.image.layout.areas), plc.image.layout.areas.values()
    own = [(field.offset, field.type.size) for field in plc.image.symbols.values()
           if not any(area.offset <= field.offset < area.offset + area.size_bytes for area in areas)]  # fmt: skip
    end = max(offset + size for offset, size in own)
    assert (names.at(end), names.at(end + 1), names.instance(end)) == (None, None, "")
    located, word = place(plc, "there"), place(plc, "D7")
    assert [found and found.name for found in (names.at(located.offset), names.at(word.offset))] == ["there", "D7"]
    assert not word.hexadecimal and not located.hexadecimal


def test_a_reference_that_has_left_its_variable_names_it_and_one_to_nothing_is_a_number(plc: Plc) -> None:
    image = compile_text("PROGRAM Main VAR a : ARRAY[0..3] OF INT; p : REF_TO INT; END_VAR p := REF(a[1]); END_PROGRAM").image
    assert image is not None
    names, [(_, end)] = Names.of(image, image.layout.areas), image.objects.extents
    assert names.reference_name(FIRST_OBJECT << OBJECT_SHIFT | end << OFFSET_SHIFT | WHOLE_BYTES, INT) == "outside of Main.a"
    program = image.symbols["MAIN"]
    nowhere = program.offset + program.type.size << OFFSET_SHIFT | WHOLE_BYTES
    assert names.reference_name(nowhere, INT) == f"no variable (16#{nowhere:016X})"


def test_a_structure_takes_no_number(plc: Plc) -> None:
    with pytest.raises(TypeError, match=r"Main\.pair is Pair; write its members one by one"):
        plc.write("Main.pair", 5)


@each_of(("name", "before", "after", "part"), [
    ("Main.pair", None, {"a": 1, "b": 2.0}, "Main.pair"), ("Main.pair", {"a": 1, "b": 2.0}, None, "Main.pair"),
    ("Main.w", 1, 2, "Main.w"), ("Main.pair", {"a": 1, "b": 2.0}, {"a": 1, "b": 3.0}, "Main.pair.b"),
    ("Main.pair", {"a": 1, "b": 2.0}, {"a": 2, "b": 3.0}, "Main.pair"),
    ("Main.pairs", [{"a": 1, "b": 2.0}] * 2, [{"a": 1, "b": 2.0}, {"a": 4, "b": 2.0}], "Main.pairs[1].a"),
    ("Main.bits", [False] * 10, [False] * 9 + [True], "Main.bits[9]"), ("D5..D7", [1, 2, 3], [1, 9, 3], "D6"),
    ("D5..D7", [1, 2, 3], [0, 9, 3], "D5..D7")])
def test_the_smallest_part_with_all_differences(plc: Plc, name: str, before: object, after: object, part: str) -> None:
    found, old, new = changed(plc.find(name), before, after)  # type: ignore[arg-type]
    assert found.name == part and repr(old) != repr(new)


@each_of(("name", "first", "count"), [("Main.w", 0, 16), ("Main.low", 3, 1), ("Main.pairs", 0, 128)])
def test_the_bits_of_a_place(plc: Plc, name: str, first: int, count: int) -> None:
    at = place(plc, name)
    assert bits_of(at) == range(8 * at.offset + first, 8 * at.offset + first + count)


def test_writes_by_two_statements_that_share_a_watched_bit() -> None:
    one, other, third = (((site, 0),) for site in (1, 2, 3))
    writes = [(one, written_bits(4, 2)), (other, written_bits(5, 1)), (third, written_bits(4, 1, 0)),
              (one, written_bits(5, 1, 3))]  # fmt: skip
    assert list(written_twice(writes, [range(1000)])) == [
        (writes[0], writes[1]), (writes[0], writes[2]), (writes[1], writes[3])]
    assert list(written_twice(writes, [range(32, 40)])) == [(writes[0], writes[2])]
    assert list(written_twice(writes, [])) == []
    assert (written_bits(5, 2), written_bits(5, 2, 3)) == (range(40, 56), range(43, 44))
    assert meet(range(5), range(4, 9)) and not meet(range(4), range(4, 9))
