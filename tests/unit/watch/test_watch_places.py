"""Which variable a byte or a bit belongs to, in slots and areas; ranges, lists of places, what is written to several."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base import types as t
from fbvm.base.areas import AREAS, SLOTS_OFFSET, e_bank
from fbvm.base.memory import WHOLE_BYTES, Memory
from fbvm.base.types import Field
from fbvm.code.image import Image
from fbvm.code.operations import FIRST_OBJECT, OBJECT_SHIFT, OFFSET_SHIFT
from fbvm.watch import places
from fbvm.watch.conditions import DEEPEST, ConditionError, parse_condition, parse_expression, split_condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.scanner import listed_places

TEXT = """
TYPE Pair : STRUCT a : INT; b : DINT; END_STRUCT END_TYPE
TYPE Link : STRUCT there : REF_TO INT; n : INT; END_STRUCT END_TYPE
FUNCTION_BLOCK Pump
VAR n : INT; level AT D50 : INT; last : BOOL; pair : Pair; END_VAR
VAR_IN_OUT io : INT; END_VAR
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    pumps : ARRAY[1..2, 0..1] OF Pump; pair : Pair; wide AT CIO 30 : ARRAY[0..3] OF WORD; word AT CIO 31 : WORD;
    bit AT CIO 31.04 : BOOL; b AT %MX5.3 : BOOL; m AT %MW2 : WORD; r : REF_TO BOOL; t : STRING[4]; c : CHAR; d : DATE; l : LREAL;
    flag : BOOL; e : ARRAY[0..1] OF Pair; bits AT CIO 40.06 : ARRAY[0..11] OF BOOL; w : REF_TO WORD;
    links : ARRAY[0..1] OF Link;
END_VAR
    r := REF(bit); w := REF(%MW20); links[1].there := REF(pair.a);
END_PROGRAM
""".replace("word AT", "one AT")


@pytest.fixture(scope="module")
def image() -> Image:
    made = compile_text(TEXT, lint=False)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


@pytest.fixture
def plc(image: Image) -> Plc:
    plc = Plc(image)
    plc.scan()
    return plc


@pytest.fixture
def names(plc: Plc) -> Names:
    return Names.of(plc.image, plc.memory.areas)


def place(plc: Plc, name: str) -> Place:
    found = plc.find(name)
    assert isinstance(found, Place)
    return found


@each_of(("inside", "behind", "name"), [
    ("Main.pumps[1, 0].n", 1, "Main.pumps[1, 0].n"), ("Main.pumps[2, 1].pair.b", 3, "Main.pumps[2, 1].pair.b"),
    ("Main.e[1].a", 0, "Main.e[1].a"), ("Main.wide[3]", 1, "Main.wide[3]"), ("CIO 30", 0, "Main.wide[0]"),
    ("CIO 31", 1, "Main.one"), ("CIO 34", 0, "CIO 34"), ("%MB4", 0, "Main.m"), ("%MB6", 0, "%MB6"),
    ("D50", 0, "Main.pumps[1, 0].level"), ("D51", 1, "D51"),
    ("Main.pair.a", 2, None), ("Main.pumps[1, 1].io", 0, "Main.pumps[1, 1].io"),
])  # fmt: skip
def test_a_byte_belongs_to_the_smallest_variable_that_has_it(
    plc: Plc, names: Names, inside: str, behind: int, name: str | None
) -> None:
    where = place(plc, inside)
    if inside.endswith(".io"):  # the slot of the reference, not what it is bound to
        where = Place("", where.type, where.offset)
    found = names.at(where.offset + behind)
    assert (found and found.name) == name
    if inside.endswith(".io"):
        assert found is not None and isinstance(found.type, t.RefType) and found.type.target is t.INT


def test_a_global_reference_is_known_by_its_own_eight_bytes() -> None:
    names = Names({"R": Field("r", t.INT, SLOTS_OFFSET + 16, reference=True)}, AREAS)
    found = names.at(SLOTS_OFFSET + 23)
    assert found is not None and isinstance(found.type, t.RefType) and (found.name, found.type.target) == ("r", t.INT)
    assert names.at(SLOTS_OFFSET + 24) is None


def test_bytes_without_a_name_are_passed_over_one_by_one() -> None:
    block = t.StructType("Block", 16, 8, {"R": Field("r", t.INT, 0, reference=True), "N": Field("n", t.BOOL, 8)}, block=True)
    own = {"X": Field("x", t.BOOL, SLOTS_OFFSET + 17), "Y": Field("y", t.BOOL, SLOTS_OFFSET + 18)}
    names = Names({**own, "B": Field("b", block, SLOTS_OFFSET + 24)}, AREAS)
    assert [found.name for found in names.within(SLOTS_OFFSET + 16, 17)] == ["x", "y", "b.r", "b.n"]


def test_each_of_several_single_bytes_has_its_name() -> None:
    names = Names({"A": Field("a", t.array(((0, 2),), t.BYTE), SLOTS_OFFSET + 16)}, AREAS)
    assert [found.name for found in names.within(SLOTS_OFFSET + 16, 3)] == ["a[0]", "a[1]", "a[2]"]


def test_a_pointer_is_outside_of_the_variable_that_fills_its_object_or_of_what_begins_there() -> None:
    start = SLOTS_OFFSET + 16
    names = Names({"A": Field("a", t.array(((0, 2),), t.INT), start)}, AREAS, [(start, start + 6), (start, start + 4), (4, 8)])
    told = [names.reference_name(FIRST_OBJECT + row << OBJECT_SHIFT | 9 << OFFSET_SHIFT | WHOLE_BYTES, t.INT) for row in range(3)]
    assert told == ["outside of a", "outside of a[0]", "outside of its variable"]


@each_of(("address", "name"), [
    ("CIO 31.04", "Main.bit"), ("CIO 31.05", "CIO 31.05"), ("CIO 33.15", "CIO 33.15"), ("%MX5.3", "Main.b"), ("%MX5.4", "%MX5.4"),
    ("D51.09", "D51.09"), ("CIO 40.06", "Main.bits[0]"), ("CIO 40.15", "Main.bits[9]"), ("TF5", "T0005"), ("W3.08", "W3.08"),
])  # fmt: skip
def test_a_bit_is_that_of_a_located_bool_or_of_its_address(plc: Plc, names: Names, address: str, name: str) -> None:
    where = place(plc, address)
    found = names.at(where.offset, where.bit)
    assert found is not None and (found.offset, found.bit) == (where.offset, where.bit)
    assert found.name == name or name.startswith("Main.bits")


def test_the_first_and_the_last_byte_of_an_area_are_its_own(plc: Plc, names: Names) -> None:
    for area in plc.memory.areas.values():
        for offset in (area.offset, area.offset + area.size_bytes - 1):
            found = names.at(offset)
            assert found is not None and (found.area == area.name or found.name.startswith("Main.")), (area.name, offset)


def test_a_reference_that_is_read_as_what_it_is_bound_to_is_read_so_in_a_structure_and_an_array() -> None:
    image = compile_text("""TYPE S : STRUCT r : REFERENCE TO INT; n : INT; END_STRUCT END_TYPE
PROGRAM Main VAR a, b : INT; s : S; rs : ARRAY[0..1] OF REFERENCE TO INT; END_VAR
a := 5; b := 300; s.r REF= a; rs[0] REF= b; rs[1] REF= a; END_PROGRAM""", dialect="codesys", lint=False).image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    assert plc.read("Main.s") == {"r": 5, "n": 0}
    assert plc.read("Main.rs") == [300, 5]
    assert (plc.read("Main.s.r"), plc.read("Main.rs[1]")) == (5, 5)


def test_a_variable_in_a_bank_behind_the_slots_has_its_own_bits_alone() -> None:
    bank = e_bank("E0", 2 * SLOTS_OFFSET)
    names = Names({"X": Field("x", t.BOOL, bank.offset, bit=3, absolute=True)}, {**AREAS, "E0": bank})
    assert [found and found.name for found in (names.at(bank.offset, bit) for bit in (3, 4))] == ["x", "E0_0.04"]


def test_nothing_has_a_name_behind_all_areas(plc: Plc, names: Names) -> None:
    assert names.at(0) is None and names.at(plc.memory.size - 1) is None


def test_the_values_in_some_bytes_are_named_once_each(plc: Plc, names: Names) -> None:
    first = place(plc, "Main.e[0].a").offset
    assert [found.name for found in names.within(first, 16)] == ["Main.e[0].a", "Main.e[0].b", "Main.e[1].a", "Main.e[1].b"]
    assert [found.name for found in names.within(first + 1, 3)] == ["Main.e[0].a"]
    assert [found.name for found in names.within(place(plc, "D60").offset, 4)] == ["D60", "D61"]


@each_of(("name", "address"), [
    ("Main.one", "CIO 31"), ("CIO 0", "CIO 0"), ("D0", "D0"), ("%MB0", "%MB0"),
    ("Main.bit", "CIO 31.04"), ("Main.b", "%MX5.3"), ("Main.wide[2]", "CIO 32"),
    ("Main.bits[2]", "CIO 40.08"), ("Main.bits[11]", "CIO 41.01"), ("Main.flag", ""),
    ("Main.m", "%MB4"), ("Main.pumps[2, 0].level", "D50"),
])  # fmt: skip
def test_the_address_of_a_located_variable(plc: Plc, names: Names, name: str, address: str) -> None:
    assert names.address(place(plc, name)) == address


def test_instances_are_known_by_where_they_begin(plc: Plc, names: Names) -> None:
    for name in ("Main", "Main.pumps[1, 0]", "Main.pumps[2, 1]"):
        assert names.instance(place(plc, name).offset) == name
    assert names.instance(place(plc, "Main.pumps[1, 1]").offset + 1) == names.instance(place(plc, "Main.pair").offset) == ""


def test_references_are_read_as_names(plc: Plc, names: Names) -> None:
    assert names.read(plc.read, place(plc, "Main.r")) == "-> Main.bit"
    assert names.read(plc.read, place(plc, "Main.w")) == "-> %MW20"
    links = [{"there": None, "n": 0}, {"there": "-> Main.pair.a", "n": 0}]
    assert names.read(plc.read, place(plc, "Main.links")) == links
    assert names.read(plc.read, place(plc, "Main.pair")) == {"a": 0, "b": 0}
    assert names.read(plc.read, place(plc, "Main.flag")) is False


def test_a_reference_that_has_left_an_area_is_outside_of_it() -> None:
    start, end = AREAS["D"].offset, AREAS["D"].offset + AREAS["D"].size_bytes
    names = Names({}, AREAS, [(start, end)])
    told = [names.reference_name(FIRST_OBJECT << OBJECT_SHIFT | at << OFFSET_SHIFT | WHOLE_BYTES, t.WORD)
            for at in (start - 2, start, end - 2, end)]
    assert told == ["outside of D", "-> D0", "-> D32767", "outside of D"]


def test_a_reference_to_a_word_of_several_bytes_has_the_address_of_its_size() -> None:
    start, names = AREAS["M"].offset, Names({}, AREAS)
    kinds = ((t.WORD, 20), (t.DWORD, 20), (t.LWORD, 24), (t.DWORD, 22), (t.BYTE, 22))
    told = [names.reference_name(FIRST_OBJECT << OBJECT_SHIFT | start + at << OFFSET_SHIFT | WHOLE_BYTES, kind)
            for kind, at in kinds]
    assert told == ["-> %MW10", "-> %MD5", "-> %ML3", "-> %MB22", "-> %MB22"]


def test_an_array_in_out_that_is_bound_to_nothing_yet_is_read_as_none() -> None:
    image = compile_text("""FUNCTION_BLOCK Low VAR_IN_OUT all : ARRAY[0..1] OF REF_TO INT; one : INT; END_VAR END_FUNCTION_BLOCK
FUNCTION_BLOCK Near VAR_IN_OUT one : INT; END_VAR END_FUNCTION_BLOCK
PROGRAM Main VAR low : Low; near : Near; x : INT := 300; END_VAR near(one := x); END_PROGRAM""", lint=False).image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    assert plc.read("Main.near") == {"one": 300}
    assert Names.of(image, plc.memory.areas).read(plc.read, place(plc, "Main.low")) == {"all": None, "one": None}


def test_a_reader_gives_what_read_gives_for_each_type(plc: Plc) -> None:
    for name, value in (("pair.b", -70_000), ("flag", True), ("bit", True), ("t", "ab"), ("c", "x"), ("l", 2.5), ("wide[1]", 77),
                        ("bits[11]", True), ("d", 86_400_000_000_000)):  # fmt: skip
        where = place(plc, f"Main.{name}")
        reading = places.reader(plc.memory, where)
        before = reading()
        plc.write(where, value)
        assert reading() == plc.read(where) == value != before, name
    behind = places.reader(plc.memory, place(plc, "Main.r^"))
    plc.write("Main.bit", False)
    assert behind() is False
    plc.write("Main.bit", True)
    assert behind() is True
    plc.write("CIO 31.05", True)
    plc.write("Main.bit", False)
    assert places.reader(plc.memory, place(plc, "Main.bit"))() is False, "its neighbour is another one"


@each_of(("text", "names"), [
    ("CIO 30.14..CIO 31.01", ["CIO 30.14", "CIO 30.15", "CIO 31.00", "CIO 31.01"]),
    ("%MX0.6..%MX1.1", ["%MX0.6", "%MX0.7", "%MX1.0", "%MX1.1"]),
    ("CIO 30.14..CIO 31.00", ["CIO 30.14", "CIO 30.15", "CIO 31.00"]),
    ("D5..D5", ["D5"]), ("D5.03..D5.03", ["D5.03"]), ("W1..W3", ["W1", "W2", "W3"]),
])  # fmt: skip
def test_a_range_has_both_its_ends(plc: Plc, text: str, names: list[str]) -> None:
    found = plc.find(text)
    assert isinstance(found, Span) and [each.name for each in found.places] == names and found.name == f"{names[0]}..{names[-1]}"


@pytest.mark.parametrize("text", ["D5..D4", "D5.03..D5.02", "D5.01..D5.00", "D5..W6", "D5..D6.00", "%MX1.0..%MX0.7",
                                  "%MW1..%MB2"])
def test_what_is_no_range(plc: Plc, text: str) -> None:
    with pytest.raises(UnknownPlace, match="is no range"):
        plc.find(text)


def test_a_range_takes_as_many_values_as_it_has(plc: Plc) -> None:
    memory: Memory = plc.memory
    found = plc.find("D5..D7")
    places.write_found(memory, found, [1, 2, 3])
    assert places.read_found(memory, found) == [1, 2, 3]
    for wrong in ([1, 2], "abc", 5, [1, 2, 3, 4]):
        with pytest.raises(ValueError, match=r"D5\.\.D7 takes a list of 3 values"):
            places.write_found(memory, found, wrong)
    assert places.read_found(memory, found) == [1, 2, 3]
    places.write_found(memory, plc.find("D9"), 4)
    assert places.read_found(memory, plc.find("D9")) == 4


@each_of(("text", "said"), [
    ("T5.Q", "TF5"), ("TIM5 . DN", "TF5"), ("CNT7.CF", "CNF7"), ("DR5", "D5"), ("HR 3.04", "H3.04"), ("EM0_7", "E0_7"),
    ("IR30", "CIO 30"), ("n", "did you mean Main.pumps[1, 0].n"), ("pumps[1]", "did you mean Main.pumps"),
])  # fmt: skip
def test_who_writes_as_other_software_is_told_the_spelling_here(plc: Plc, text: str, said: str) -> None:
    with pytest.raises(UnknownPlace, match=r"did you mean|bank") as raised:
        plc.find(text)
    assert said in str(raised.value)


def test_members_of_structures_are_not_proposed(plc: Plc) -> None:
    with pytest.raises(UnknownPlace, match="there is no a; known here: Main"):
        plc.find("a")


def test_a_name_that_an_instance_declares_is_proposed_by_its_own_path_and_not_by_references() -> None:
    image = compile_text("""FUNCTION_BLOCK Low VAR_INPUT only : INT; END_VAR END_FUNCTION_BLOCK
FUNCTION_BLOCK Near VAR_IN_OUT lent : Low; END_VAR END_FUNCTION_BLOCK
FUNCTION_BLOCK Store VAR kept : ARRAY[2..3] OF Low; END_VAR END_FUNCTION_BLOCK
FUNCTION_BLOCK Deep VAR store : Store; END_VAR END_FUNCTION_BLOCK
PROGRAM Main VAR near : Near; deep : Deep; END_VAR ; END_PROGRAM""", lint=False).image
    assert image is not None
    with pytest.raises(UnknownPlace, match=r"did you mean Main\.deep\.store\.kept\[2\]\.only"):
        Plc(image).find("only")


@each_of(("text", "found"), [
    ("Main.a CIO 0.00, D200..D209", ["Main.a", "CIO 0.00", "D200..D209"]), (" %MW5 ,x[1, 2].b ", ["%MW5", "x[1, 2].b"]), ("", []),
    ("a^ b", ["a^", "b"]),
])  # fmt: skip
def test_a_list_of_places(text: str, found: list[str]) -> None:
    assert listed_places(text) == found


@pytest.mark.parametrize("text", ["a +", ", a", "a; b"])
def test_what_is_no_list_of_places(text: str) -> None:
    with pytest.raises(ValueError, match="is neither a name nor an address nor a range"):
        listed_places(text)


def test_a_condition_stands_behind_if(plc: Plc) -> None:
    assert split_condition("pump.st:12 if Main.n > 5") == ("pump.st:12", "Main.n > 5")
    assert split_condition("CIO 0.00") == ("CIO 0.00", "")
    assert parse_expression("Main.pair.a * 2 + 7", plc.find).value(plc.read) == 7
    with pytest.raises(ConditionError, match="is not expected"):
        parse_expression("1 + 2 3", plc.find)


def test_parentheses_go_so_deep_and_not_deeper(plc: Plc) -> None:
    most = DEEPEST - 1  # the condition itself is one
    deep = "(" * most + "TRUE" + ")" * most
    assert parse_condition(deep, plc.find).holds(plc.read)
    with pytest.raises(ConditionError):
        parse_condition(f"({deep})", plc.find)
    with pytest.raises(ConditionError):
        parse_condition("(TRUE) AND " * most + f"({deep})", plc.find)


APART = """PROGRAM Main
VAR speed AT %QW2 : INT; row AT %MW0 : ARRAY[0..3] OF INT; lamp AT %QX0.3 : BOOL; level AT %MD7 : DINT; p : REF_TO WORD; END_VAR
p := REF(%MW9);
END_PROGRAM"""


@each_of("text, name", [
    ("%QW2", "Main.speed"), ("%QW3", "%QW3"), ("%QX0.3", "Main.lamp"), ("%QX0.4", "%QX0.4"),
    ("%MW2", "Main.row[2]"), ("%MD7", "Main.level"),
    ("%MD8", "%MD8"), ("%MW9", "%MW9"),
])
def test_where_sizes_are_apart_a_byte_has_the_name_of_its_size(text: str, name: str) -> None:
    made = compile_text(APART, dialect="matiec", lint=False)
    assert made.image is not None
    plc = Plc(made.image)
    names, where = Names.of(made.image, plc.memory.areas), place(plc, text)
    found = names.at(where.offset, where.bit)
    assert found is not None and (found.name, found.offset) == (name, where.offset)
    plc.scan()
    assert names.read(plc.read, place(plc, "Main.p")) == "-> %MW9"
    with pytest.raises(UnknownPlace, match="the program names no address such as %IW0"):
        place(plc, "%IW0")
