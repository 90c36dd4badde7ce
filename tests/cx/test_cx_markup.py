"""The tree of a project's text: what entries, lists and texts are, and where damage is."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.cx.compression import _codes
from fbvm.interchange.cx.markup import DEEPEST, CxText, Value, read_markup

HEAD = 'CXProgVer:="1.8";\r\n'


def tree(text: str) -> Value:
    made = read_markup((HEAD + text).encode(), "x.cxt")
    assert isinstance(made, CxText), made
    return made.root


def refused(text: str) -> tuple[int, str, str]:
    made = read_markup((HEAD + text).encode(), "x.cxt")
    assert isinstance(made, Diagnostic)
    assert (made.code, made.end) == ("X0401", min(made.start + 1, len(HEAD + text)))
    return made.start - len(HEAD), made.message, made.hint


BLOCK = "A:=\nBEGIN\n"
DAMAGED, CUT = "the file is damaged", "the file is cut"


@each_of(("text", "at", "message", "hint"), (
    ("A:=1;\nEND;\n", 6, "END stands here without its BEGIN", DAMAGED),
    (f"{BLOCK}B:=1;\n", 3, "the file ends before the END of this block", CUT),
    (f"{BLOCK}B:=1;\n\n \n", 3, "the file ends before the END of this block", CUT),
    ("A:=1;\nwhat\n", 6, "this is no entry: a key and := are missing", DAMAGED),
    ("A:=\n", 3, "nothing stands behind this :=", DAMAGED),
    ("A:=\nwhat\n", 3, "nothing stands behind this :=", DAMAGED),
    ("A:=1\n", 3, "the `;` at the end of this value is missing", DAMAGED),
    ('A:="b;\n', 3, 'the `"` at the end of this value is missing', DAMAGED),
    ('A:=";\n', 3, 'the `"` at the end of this value is missing', DAMAGED),
    ("A:=\n $?St$Bk?_#[7]\nb\n", 5, "the second marker $?St$Bk?_#[7] of this text is missing", CUT),
    ("A:=\n $?St$Bk?_#[7]\nb\n$?St$Bk?_#[8]\n", 5, "the second marker $?St$Bk?_#[7] of this text is missing", CUT),
    ("A:=\n BEGIN_LIST_$#[7]\nb;\n", 4, "the end of list 7 is missing", CUT),
    ("A:=\n BEGIN_LIST_$#[7]\nb;\nEND_LIST_$#[8];\n", 4, "the end of list 7 is missing", CUT),
    ("A:=\nBEGIN_LIST_$#[7]\n\n b\nEND_LIST_$#[7];\n", 23, "the `;` at the end of this row is missing", DAMAGED),
    ("A:=\nBEGIN_LIST_$#[7]\nb,\n$?St$Bk?_#[9]\nc\nEND_LIST_$#[7];\n", 24,
     "the second marker $?St$Bk?_#[9] of this text is missing", CUT)))  # fmt: skip
def test_damage_has_its_place(text: str, at: int, message: str, hint: str) -> None:
    assert refused(text) == (at, message, hint)


def test_empty_lines_stand_between_entries_and_rows() -> None:
    made = tree("\r\n \t\r\nA:=\r\nBEGIN\r\n\r\n  B:= 1 ;\r\n \r\nEND;\r\n\r\nC:=\r\nBEGIN_LIST_$#[1]\r\n\r\n a,b;\r\n"
                "\r\nEND_LIST_$#[1];\r\n")  # fmt: skip
    assert list(made.entries) == ["CXProgVer", "A", "C"]
    assert made.string("A", "B") == "1"
    assert [row.fields for row in made.entries["C"].rows] == [("a", "b")]


@each_of(("line", "text"), (("A:=12;", "12"), ('A:="b c";', "b c"), ('A:="";', ""), ('A:="a"b";', 'a"b'), ("A:=  true ;", "true"),
                            ('A:= "b" ;', "b"), ("A:=;", ""), ('A:="b;";', "b;")))  # fmt: skip
def test_a_scalar_knows_what_it_encloses(line: str, text: str) -> None:
    made = tree(f"X:=1;\n {line}\nY:=2;\n")
    value = made.entries["A"]
    assert (value.kind, value.text) == ("scalar", text)
    whole = f"{HEAD}X:=1;\n {line}\nY:=2;\n"
    assert whole[value.inner : value.inner_end] == text
    assert whole[value.start : value.end] == line.removeprefix("A:=").lstrip() + "\n"
    assert made.string("Y") == "2"


def test_blocks_lists_and_texts_know_what_they_enclose() -> None:
    text = ("A:=\n BEGIN\n  B:=1;\n END;\nL:=\nBEGIN_LIST_$#[3]\n a,\"b,c\",d;\n e,f\n$?St$Bk?_#[4]\nlong;\n$?St$Bk?_#[4]\n g;\n"
            "END_LIST_$#[3];\nT:=\n$?St$Bk?_#[5]\nany\nEND;\n$?St$Bk?_#[5]\nE:=9;\n")  # fmt: skip
    made, whole = tree(text), HEAD + text
    kept = {name: (value.kind, whole[value.start : value.end], whole[value.inner : value.inner_end])
            for name, value in made.entries.items() if name in "ALT"}  # fmt: skip
    assert kept == {
        "A": ("block", "\n BEGIN\n  B:=1;\n END;\n", "  B:=1;\n"),
        "L": ("list", text[text.index("L:=") + 3 : text.index("T:=")],
              ' a,"b,c",d;\n e,f\n$?St$Bk?_#[4]\nlong;\n$?St$Bk?_#[4]\n g;\n'),
        "T": ("text", "\n$?St$Bk?_#[5]\nany\nEND;\n$?St$Bk?_#[5]\n", "any\nEND;\n"),
    }  # fmt: skip
    assert [(row.fields, whole[row.start : row.end]) for row in made.entries["L"].rows] == [
        (("a", "b,c", "d"), 'a,"b,c",d;\n'), (("e", "long;\n"), "e,f\n$?St$Bk?_#[4]\nlong;\n$?St$Bk?_#[4]\n"), (("g",), "g;\n")]
    assert made.entries["T"].text == "any\nEND;\n"
    assert made.string("E") == "9"
    assert (made.kind, made.start, made.end, made.inner, made.inner_end) == ("block", 0, len(whole), 0, len(whole))


def test_blocks_stand_inside_one_another_up_to_a_limit() -> None:
    def deep(count: int) -> str:
        return BLOCK * count + "END;\n" * count

    assert list(tree(deep(DEEPEST)).entries) == ["CXProgVer", "A"]
    at, message, hint = refused(deep(DEEPEST + 1))
    assert (at, message, hint) == (len(BLOCK) * (DEEPEST + 1), f"more than {DEEPEST} blocks stand inside one another", DAMAGED)


def test_values_are_asked_for_by_their_keys() -> None:
    made = tree("A:=\nBEGIN\nB[10]:=1;\nB[2]:=2;\nB[x]:=3;\nC:=4;\nXB[1]:=5;\nEND;\n")
    block = made.get("A")
    assert block is not None
    assert [value.text for value in block.numbered("B")] == ["2", "1"]
    assert (made.string("A", "C"), made.string("A", "D"), made.string("Z", "C"), made.string("A", "C", "E")) == ("4", "", "", "")
    assert made.get("Z", "C") is None
    assert made.get() is made


@pytest.mark.parametrize(("data", "encoding", "mark", "text"), (
    (b"CXProgVer:=1;\nA:=\"\xb0C\";\n", "cp1252", b"", "°C"),
    ("\ufeffCXProgVer:=1;\nA:=\"\u00b0C\";\n".encode(), "utf-8", b"\xef\xbb\xbf", "°C"),
    ("CXProgVer:=1;\nA:=\"\u041d\u0430\u0441\u043e\u0441\";\n".encode(), "utf-8", b"", "Насос"),
    (b"CXProgVer:=1;\nA:=\"x\";\n", "cp1252", b"", "x")))  # fmt: skip
def test_a_text_keeps_its_encoding_and_its_mark(data: bytes, encoding: str, mark: bytes, text: str) -> None:
    made = read_markup(data, "x.cxt")
    assert isinstance(made, CxText)
    assert (made.encoding, made.mark, made.compressed, made.root.string("A")) == (encoding, mark, False, text)
    assert made.encoded(made.text) == data


def test_codes_of_compression_are_complete() -> None:
    for code in _codes():
        assert code.counts[0] == 0
        assert sum(count << 16 - bits for bits, count in enumerate(code.counts)) == 1 << 16
