"""Texts of any length, records of CSV, tables and queues of Tc2_Utilities: what fits, what is cut, and what is refused."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of
from test_twincat_blocks import after, image_of

from fbvm.machine.plc import Plc

# --- texts by their addresses -------------------------------------------------------------------------------------------

COPIES = """VAR
    a, b, s : STRING(20); d, e, f : STRING(20); w, v : WSTRING(20); x, y, z : WSTRING(20); n : UDINT;
    one, two, three, four, five, six : BOOL;
    lengths : ARRAY[0..3] OF UDINT; nulls : ARRAY[0..9] OF BOOL;
END_VAR
d := 'keep'; e := 'keep'; f := 'keep'; x := "keep"; y := "keep"; z := "keep";
one := STRNCPY(ADR(d), ADR(a), n); two := CONCAT2(ADR(a), ADR(b), ADR(e), n);
three := WSTRNCPY(ADR(x), ADR(w), n); four := WCONCAT2(ADR(w), ADR(v), ADR(y), n);
five := STRING_TO_WSTRING2(ADR(z), ADR(a), n); six := WSTRING_TO_STRING2(ADR(f), ADR(w), n);
lengths[0] := LEN2(ADR(a)); lengths[1] := LEN2(NULL); lengths[2] := WLEN2(ADR(w)); lengths[3] := WLEN2(NULL);
nulls[0] := STRNCPY(NULL, ADR(a), 9); nulls[1] := STRNCPY(ADR(s), NULL, 9); nulls[2] := WSTRNCPY(NULL, ADR(w), 9);
nulls[3] := WSTRNCPY(ADR(s), NULL, 9); nulls[4] := STRING_TO_WSTRING2(NULL, ADR(a), 9);
nulls[5] := STRING_TO_WSTRING2(ADR(s), NULL, 9);
nulls[6] := WSTRING_TO_STRING2(NULL, ADR(w), 9); nulls[7] := WSTRING_TO_STRING2(ADR(s), NULL, 9);"""


@pytest.mark.slow
@each_of(("size", "copy", "joined", "wide", "wide_joined", "widened", "narrowed"), [
    (0, ("keep", False), ("keep", False), ("keep", False), ("keep", False), ("keep", False), ("keep", False)),
    (1, ("", False), ("", False), ("keep", False), ("keep", False), ("keep", False), ("", False)),
    (2, ("a", False), ("a", False), ("", False), ("", False), ("", False), ("a", False)),
    (3, ("ab", False), ("ab", False), ("", False), ("", False), ("", False), ("ab", False)),
    (4, ("abc", True), ("abc", False), ("a", False), ("a", False), ("a", False), ("abc", True)),
    (5, ("abc", True), ("abcd", False), ("a", False), ("a", False), ("a", False), ("abc", True)),
    (6, ("abc", True), ("abcde", True), ("ab", False), ("ab", False), ("ab", False), ("abc", True)),
    (8, ("abc", True), ("abcde", True), ("abc", True), ("abc", False), ("abc", True), ("abc", True)),
    (10, ("abc", True), ("abcde", True), ("abc", True), ("abcd", False), ("abc", True), ("abc", True)),
    (12, ("abc", True), ("abcde", True), ("abc", True), ("abcde", True), ("abc", True), ("abc", True)),
])  # fmt: skip
def test_copies_are_cut_at_the_size_of_their_place(size: int, copy: tuple[str, bool], **rest: tuple[str, bool]) -> None:
    plc = Plc(image_of(COPIES))
    given = {"a": "abc", "b": "de", "w": "abc", "v": "de", "n": size}
    found = after(plc, "d one e two x three y four z five f six", **given)
    wanted = [copy, *(rest[name] for name in ("joined", "wide", "wide_joined", "widened", "narrowed"))]
    assert [found[2 * at : 2 * at + 2] for at in range(6)] == wanted
    assert plc.read("Main.lengths") == [3, 0, 3, 0]
    assert plc.read("Main.nulls") == [False] * 10


@pytest.mark.slow
@each_of(("first", "second", "size", "joined", "wide"), [
    ("abc", "", 3, ("ab", False), ("", False)), ("abc", "", 4, ("abc", True), ("a", False)),
    ("", "ab", 3, ("ab", True), ("", False)), ("", "ab", 6, ("ab", True), ("ab", True)),
    ("abc", "", 8, ("abc", True), ("abc", True)), ("", "", 1, ("", True), ("keep", False)), ("", "", 2, ("", True), ("", True)),
])  # fmt: skip
def test_a_joined_text_is_whole_if_neither_was_cut(first: str, second: str, size: int, joined: tuple[str, bool],
                                                   wide: tuple[str, bool]) -> None:  # fmt: skip
    given = {"a": first, "b": second, "w": first, "v": second, "n": size}
    assert after(Plc(image_of(COPIES)), "e two y four", **given) == (*joined, *wide)


@pytest.mark.slow
def test_nothing_is_joined_to_a_text_that_fills_its_place() -> None:
    plc = Plc(image_of("""VAR a, b : STRING(8); w, v : WSTRING(8); n : UDINT; one, two : BOOL; END_VAR
one := CONCAT2(ADR(a), ADR(b), ADR(a), n); two := WCONCAT2(ADR(w), ADR(v), ADR(w), n);"""))
    for size in (0, 1, 2, 3):
        assert after(plc, "a one w two", a="abc", b="d", w="ab", v="d", n=size) == ("abc", False, "ab", False)


@pytest.mark.slow
def test_a_text_is_joined_to_itself_and_characters_that_a_string_has_not_are_left_out() -> None:
    plc = Plc(image_of("""VAR a : STRING(8); b : STRING(8); w : WSTRING(8); v, u : WSTRING(8); s : STRING(8); n : UDINT;
    one, two, three : BOOL;
END_VAR
one := CONCAT2(ADR(a), ADR(b), ADR(a), n); two := WCONCAT2(ADR(w), ADR(v), ADR(w), n);
three := WSTRING_TO_STRING2(ADR(s), ADR(u), n);"""))
    found = after(plc, "a one w two s three", a="ab", b="cd", w="a", v="b", u="\u0100\u00ffx\u1234", n=5)
    assert found == ("abcd", True, "a", False, "\u00ffx", True)
    found = after(plc, "a one w two s three", a="ab", b="cde", w="a", v="b", u="x\u0100y\u0100", n=6)
    assert found == ("abcde", True, "ab", True, "xy", True)
    assert after(plc, "s three", a="", b="", w="", v="", n=2) == ("x", False)


PLACES = """VAR search, new, src, dst, gone, left, right, l2, r2 : STRING(20); n, m : UDINT; found, deleted, split, back : BOOL;
END_VAR
dst := 'keep'; gone := 'keep'; left := 'keep'; right := 'keep'; l2 := 'keep'; r2 := 'keep';
found := FindAndReplace(ADR(search), ADR(new), ADR(src), ADR(dst), n);
deleted := FindAndDelete(ADR(search), ADR(src), ADR(gone), n);
split := FindAndSplit(ADR(search), ADR(src), ADR(left), n, ADR(right), m, FALSE);
back := FindAndSplit(ADR(search), ADR(src), ADR(l2), m, ADR(r2), n, TRUE);"""


@pytest.mark.slow
@each_of(("search", "src", "replaced", "deleted", "split", "back"), [
    ("b", "abcb", ("aXYcXY", True), ("ac", True), ("a", "cb", True), ("abc", "", True)),
    ("bc", "abcbc", ("aXYXY", True), ("a", True), ("a", "bc", True), ("abc", "", True)),
    ("aa", "aaa", ("XYa", True), ("a", True), ("", "a", True), ("a", "", True)),
    ("c", "ab", ("ab", False), ("ab", False), ("ab", "", False), ("ab", "", False)),
    ("abc", "ab", ("ab", False), ("ab", False), ("ab", "", False), ("ab", "", False)),
    ("bd", "abab", ("abab", False), ("abab", False), ("abab", "", False), ("abab", "", False)),
    ("ab", "ab", ("XY", True), ("", True), ("", "", True), ("", "", True)),
    ("", "ab", ("keep", False), ("keep", False), ("ab", "", False), ("ab", "", False)),
    ("a", "", ("", False), ("", False), ("", "", False), ("", "", False)),
])  # fmt: skip
def test_places_of_a_text_in_another(search: str, src: str, replaced: tuple[str, bool], deleted: tuple[str, bool],
                                     split: tuple[str, str, bool], back: tuple[str, str, bool]) -> None:  # fmt: skip
    found = after(Plc(image_of(PLACES)), "dst found gone deleted left right split l2 r2 back",
                  search=search, new="XY", src=src, n=21, m=21)  # fmt: skip
    assert found == (*replaced, *deleted, *split, *back)


@pytest.mark.slow
def test_what_is_replaced_and_split_is_cut_at_the_size_of_its_place() -> None:
    plc = Plc(image_of(PLACES))
    names = "dst found gone deleted left right split"
    given = {"search": "-", "new": "XY", "src": "ab-cd"}
    assert after(plc, names, n=7, m=3, **given) == ("abXYcd", True, "abcd", True, "ab", "cd", True)
    assert after(plc, names, n=6, m=2, **given) == ("abXYc", False, "abcd", True, "ab", "c", True)
    assert after(plc, names, n=5, m=1, **given) == ("abXY", False, "abcd", True, "ab", "", True)
    assert after(plc, names, n=4, m=0, **given) == ("abX", False, "abc", False, "ab", "keep", True)
    assert after(plc, names, n=3, **given) == ("ab", False, "ab", False, "ab", "keep", True)
    assert after(plc, names, n=2, **given) == ("a", False, "a", False, "a", "keep", True)
    assert after(plc, names, n=1, **given) == ("", False, "", False, "", "keep", True)
    assert after(plc, names, n=0, m=3, **given) == ("keep", False, "keep", False, "keep", "cd", True)
    assert after(plc, "left right split", n=1, m=1, search="x") == ("", "", False)


# --- CSV ----------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of(("text", "quoted", "field"), [
    ("", True, '""'), ("a", True, '"a"'), ('"', True, '""""'), ('a"b', True, '"a""b"'), ('""', True, '""""""'),
    ('a"b', False, 'a"b'),
    ('"ab"', False, '"ab"'), ("a b", True, '"a b"'),
])  # fmt: skip
def test_a_text_goes_into_a_field_and_comes_back(text: str, quoted: bool, field: str) -> None:
    plc = Plc(image_of("VAR text, field, back : T_MaxString; qm : BOOL; END_VAR\n"
                       "field := STRING_TO_CSVFIELD(text, qm); back := CSVFIELD_TO_STRING(field, qm);"))  # fmt: skip
    assert after(plc, "field back", text=text, qm=quoted) == (field, text)


@pytest.mark.slow
@each_of(("field", "text"), [('"', '"'), ('"a', '"a'), ('a"', 'a"'), ("ab", "ab"), ('"a"b"', 'a"b'), ('""a"', '"a'),
('"""', '"')])
def test_a_field_that_is_not_between_quotation_marks_stays_assumed(field: str, text: str) -> None:
    plc = Plc(image_of("VAR field, back : T_MaxString; END_VAR\nback := CSVFIELD_TO_STRING(field, TRUE);"))
    assert after(plc, "back", field=field) == (text,)


BYTES = """VAR
    from, field, into : ARRAY[0..11] OF BYTE; text, read : T_MaxString; n, room, size, done, back, written, taken : UDINT;
    qm : BOOL;
    nulls : ARRAY[0..5] OF UDINT;
END_VAR
MEMSET(ADR(field), 46, SIZEOF(field)); MEMSET(ADR(into), 46, SIZEOF(into)); read := 'keepkeep';
done := ARG_TO_CSVFIELD(F_BIGTYPE(ADR(from), n), qm, ADR(field), room);
back := CSVFIELD_TO_ARG(ADR(field), done, qm, F_BIGTYPE(ADR(into), size));
written := ARG_TO_CSVFIELD(F_STRING(text), qm, ADR(field), room);
taken := CSVFIELD_TO_ARG(ADR(field), written, qm, F_STRING(read));
nulls[0] := ARG_TO_CSVFIELD(F_BIGTYPE(NULL, 3), qm, ADR(field), 9);
nulls[1] := ARG_TO_CSVFIELD(F_BIGTYPE(ADR(from), 3), qm, NULL, 9);
nulls[2] := CSVFIELD_TO_ARG(NULL, 3, qm, F_BIGTYPE(ADR(into), 9));
nulls[3] := CSVFIELD_TO_ARG(ADR(field), 3, qm, F_BIGTYPE(NULL, 9));
nulls[4] := ARG_TO_CSVFIELD(F_BIGTYPE(ADR(from), 0), qm, ADR(field), 9);
nulls[5] := CSVFIELD_TO_ARG(ADR(field), 1, TRUE, F_BIGTYPE(ADR(into), 9));"""


@pytest.mark.slow
@each_of(("given", "quoted", "room", "size", "done", "back"), [
    ('a"b', True, 6, 3, 6, 3), ('a"b', True, 5, 3, 0, 0), ('a"b', True, 6, 2, 6, 0), ('a"b', False, 4, 3, 4, 3),
    ('a"b', False, 3, 3, 0, 0),
    ("ab", True, 4, 2, 4, 2), ("ab", True, 3, 2, 0, 0), ("ab", False, 2, 2, 2, 2), ("ab", False, 1, 2, 0, 0),
    ('"', True, 4, 1, 4, 1),
    ('""', True, 6, 2, 6, 2), ("ab", True, 1, 2, 0, 0), ("a;\n", True, 5, 3, 5, 3), ('"', True, 3, 1, 0, 0),
    ('ab"', False, 4, 3, 4, 3), ('ab"', False, 3, 3, 0, 0), ("a#", True, 4, 2, 4, 2), ("#", False, 1, 1, 1, 1),
])  # fmt: skip
def test_bytes_go_into_a_field_and_come_back(given: str, quoted: bool, room: int, size: int, done: int, back: int) -> None:
    plc = Plc(image_of(BYTES))
    raw = [*given.encode(), *bytes(12 - len(given))]
    found = after(plc, "done back into written taken read nulls", n=len(given), room=room, size=size, qm=quoted, text=given,
                  **{"from": raw})  # fmt: skip
    assert found[:2] == (done, back)
    assert not back or found[2] == [*given.encode(), *b"." * (12 - back)]
    mark = '"' * quoted
    assert not done or bytes(plc.read("Main.field"))[:done] == (mark + given.replace('"', '""') + mark).encode()
    assert found[3:5] == (done, len(given) if done else 0)
    assert found[5] == (given if done else "keepkeep")
    assert found[6] == [0] * 6


WRITER = """VAR w : FB_CSVMemBufferWriter; line : ARRAY[0..9] OF BYTE; more : ARRAY[0..2] OF BYTE := [120, 121, 122];
size, room : UDINT; END_VAR
w(pBuffer := ADR(line), cbBuffer := room, pValue := ADR(more), cbValue := size);"""
WRITTEN = "w.bOk w.cbWrite w.cbSize w.cbFree w.nFields w.nRecords"


@pytest.mark.slow
def test_fields_are_written_as_long_as_they_fit() -> None:
    plc = Plc(image_of(WRITER))

    def write(cmd: int, value: str, end: bool = False, size: int = 0, room: int = 10) -> tuple[Any, ...]:
        return after(plc, WRITTEN, room=room, size=size, **{"w.eCmd": cmd, "w.putValue": value, "w.bCRLF": end})

    assert write(0, "ab") == (True, 2, 2, 8, 1, 0)
    assert write(1, "c", True) == (True, 4, 6, 4, 2, 1)
    assert write(1, "dxy", True) == (False, 0, 6, 4, 2, 1)
    assert write(1, "d", size=3) == (True, 3, 9, 1, 3, 1)
    assert write(1, "e") == (False, 0, 9, 1, 3, 1)
    assert write(1, "") == (True, 1, 10, 0, 4, 1)
    assert bytes(plc.read("Main.line")) == b"ab;c\r\nxyz;"
    assert write(2, "") == (False, 0, 10, 0, 4, 1)
    assert write(1, "", room=9) == (False, 0, 10, 0, 4, 1)
    assert write(0, "ab", True, room=4) == (True, 4, 4, 0, 1, 1)
    assert write(0, "abc", True, room=4) == (False, 0, 0, 4, 0, 0)


@pytest.mark.slow
def test_a_field_is_the_text_unless_bytes_are_given_and_needs_a_buffer() -> None:
    plc = Plc(image_of("""VAR w : FB_CSVMemBufferWriter;
line : ARRAY[0..9] OF BYTE; more : ARRAY[0..2] OF BYTE := [120, 121, 122];
none, posed : BOOL; size : UDINT; END_VAR
w(pBuffer := SEL(none, ADR(line), NULL), cbBuffer := 10, pValue := SEL(posed, NULL, ADR(more)), cbValue := size,
  putValue := 'abcd');"""))
    for posed, size, told, first in ((False, 0, 4, b"abcd"), (False, 3, 4, b"abcd"), (True, 0, 4, b"abcd"), (True, 1, 1, b"xbcd"),
                                     (True, 3, 3, b"xyzd")):  # fmt: skip
        assert after(plc, WRITTEN, posed=posed, size=size, **{"w.eCmd": 0}) == (True, told, told, 10 - told, 1, 0)
        assert bytes(plc.read("Main.line"))[:4] == first
    assert after(plc, WRITTEN, none=True) == (False, 0, 0, 10, 0, 0)


READER = """VAR r : FB_CSVMemBufferReader; line : ARRAY[0..299] OF BYTE; size : UDINT; place : DINT; none : BOOL; END_VAR
r(pBuffer := SEL(none, ADR(line), NULL), cbBuffer := size); place := -1;
IF r.pValue <> NULL THEN place := r.pValue - ADR(line); END_IF"""
READ = "r.bOk r.getValue place r.cbValue r.bCRLF r.cbRead"


@pytest.mark.slow
def test_fields_are_read_up_to_the_last_that_ends() -> None:
    plc, text = Plc(image_of(READER)), b'ab;;"c;""\r\n";\r\nd\re;f\n\r'
    plc.write("Main.line", [*text, *bytes(300 - len(text))])
    nothing = (False, "", -1, 0, False, 0)
    first = (True, "ab", 0, 2, False, 3)
    rest = [(True, "", -1, 0, False, 1), (True, '"c;""\r\n"', 4, 8, False, 9), (True, "", -1, 0, True, 2),
    (True, "d\re", 15, 3, False, 4)]
    for _ in range(2):
        assert after(plc, READ, size=len(text), **{"r.eCmd": 0}) == first
        assert [after(plc, READ, **{"r.eCmd": 1}) for _ in rest] == rest
        assert after(plc, READ) == after(plc, READ) == nothing
    assert after(plc, READ, **{"r.eCmd": 2}) == nothing
    assert after(plc, READ, size=2, **{"r.eCmd": 0}) == nothing
    assert after(plc, READ, size=3) == first
    assert after(plc, READ, none=True) == nothing


@pytest.mark.slow
def test_a_field_whose_quotation_mark_is_not_closed_is_not_read_and_keeps_no_other_from_being_read() -> None:
    plc = Plc(image_of(READER))
    plc.write("Main.line", [*b'"a;b', *bytes(296)])
    assert after(plc, READ, size=4, **{"r.eCmd": 0}) == (False, "", -1, 0, False, 0)
    plc.write("Main.line", [*b"ab;c", *bytes(296)])
    assert after(plc, READ) == (True, "ab", 0, 2, False, 3)


@pytest.mark.slow
def test_a_field_of_more_than_255_characters_is_read_up_to_there() -> None:
    plc = Plc(image_of(READER))
    plc.write("Main.line", [*b"x" * 256, *b";yy\r\n", *bytes(39)])
    assert after(plc, READ, size=300, **{"r.eCmd": 0}) == (True, "x" * 255, 0, 256, False, 257)
    assert after(plc, READ, size=260, **{"r.eCmd": 1}) == (False, "", -1, 0, False, 0)
    assert after(plc, READ, size=261) == (True, "yy", 257, 2, True, 4)


@pytest.mark.slow
def test_an_empty_field_is_an_empty_text() -> None:
    plc = Plc(image_of(BYTES))
    assert after(plc, "written taken read", n=1, room=2, size=1, qm=True, text="") == (2, 0, "")
    assert after(plc, "written taken read", room=1) == (0, 0, "keepkeep")
