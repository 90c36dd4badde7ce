"""XML that is no project, or means harm: each has a message with its place, and nothing else happens."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from depth import times
from drawings import RAIL, block, coil, contact, imported, pou, result, value
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, parse_markup
from fbvm.interchange.plcopen.read.importing import import_xml

BOMB = b'<?xml version="1.0"?>\n<!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>\n<project>&b;</project>'
FETCHED = b'<!DOCTYPE project [<!ENTITY x SYSTEM "file:///etc/hostname">]>\n<project>&x;</project>'
DTD = b'<!DOCTYPE project SYSTEM "http://127.0.0.1:9/project.dtd">\n<project/>'


def only(data: bytes) -> Diagnostic:
    found = import_xml(data, "bad.xml")
    assert not found.files
    [diagnostic] = found.diagnostics
    assert diagnostic.hint
    return diagnostic


@pytest.mark.parametrize("data", [BOMB, FETCHED, DTD], ids=["bomb", "external entity", "external DTD"])
def test_a_document_type_is_refused_before_anything_is_expanded_or_fetched(data: bytes) -> None:
    found = only(data)
    assert found.code == "X0102"
    assert "<!DOCTYPE" in found.source.line(found.line)


@each_of(("data", "code", "says"), [
    (b"", "X0101", "no element found"),
    (b"PROGRAM Main END_PROGRAM", "X0101", "syntax error"),
    (b"<project><types>", "X0101", "no element found"),
    (b"<project></types>", "X0101", "mismatched tag"),
    (b"<project>&nbsp;</project>", "X0101", "undefined entity"),
    (b"<a:project/>", "X0101", "unbound prefix"),
    (b"<project>\x00</project>", "X0101", "invalid token"),
    (b"<project a='1' a='2'/>", "X0101", "duplicate attribute"),
    (b"<html/>", "X0104", "<html> of no namespace"),
    (b'<project xmlns="http://maven.apache.org/POM/4.0.0"/>', "X0104", "maven"),
    (b'<Project xmlns="www.iec.ch/public/TC65SC65BWG7TF10"/>', "X0104", "IEC 61131-10"),
    (b'<Project xmlns="http://example.org/61131-10"/>', "X0104", "IEC 61131-10"),
    (b'<Project xmlns="http://example.org/build"/>', "X0104", "<Project> of http://example.org/build, no PLCopen project"),
    (b'<project xmlns="http://example.org/61131-10"/>', "X0104", "<project> of http://example.org/61131-10, no PLCopen project"),
])
def test_what_is_no_project_says_what_it_is(data: bytes, code: str, says: str) -> None:
    found = only(data)
    assert found.code == code
    assert says in found.message


def test_a_truncated_file_names_the_element_that_is_open() -> None:
    found = only(b'<project xmlns="http://www.plcopen.org/xml/tc6_0201">\n<types>\n<pous>\n')
    assert found.line == 4
    assert "<pous> of line 3 is open" in found.hint


def test_deep_nesting_ends_at_the_limit() -> None:
    found = only(b"<a>" * 1_000_000)
    assert found.code == "X0103"
    assert str(MAX_DEPTH) in found.message


def test_too_many_elements_end_at_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.interchange.markup.MAX_ELEMENTS", 1_000)
    assert MAX_ELEMENTS >= 1_000
    assert only(b"<a>" + b"<b/>" * 1_001 + b"</a>").code == "X0103"


@pytest.mark.slow
def test_a_huge_file_is_not_even_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.xml"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    [found] = import_xml(path).diagnostics
    assert found.code == "X0103"


def test_a_text_with_too_many_bytes_ends_at_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.interchange.markup.MAX_BYTES", 2 << 20)
    found = only(b" " * (2 << 20) + b"<a/>")
    assert (found.code, found.message) == ("X0103", "bad.xml has more than 2 MiB")


def test_a_folder_and_a_missing_file_are_messages(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.xml"):
        assert [d.code for d in import_xml(path).diagnostics] == ["X0101"]


@each_of(("data", "says"), [
    (b"<a>\xff\xfe</a>", "names no encoding, and so is UTF-8, and is none at byte 3"),
    (b'<?xml version="1.0" encoding="utf-16"?><a/>', "says that it is UTF-16"),
    (b'<?xml version="1.0" encoding="utf-7"?><a/>', "written in utf-7, which is not read"),
    (b'<?xml version="1.0" encoding="idna"?><a/>', "written in idna"),
    (b'<?xml version="1.0" encoding="nonsense"?><a/>', "written in nonsense"),
])
def test_a_wrong_encoding_is_named(data: bytes, says: str) -> None:
    found = only(data)
    assert (found.code, found.start, found.end) == ("X0101", 0, 0)  # nothing of it can be shown
    assert says in found.message


@each_of("encoding", ["utf-8-sig", "utf-16", "latin-1", "cp1252"])
def test_encodings_that_tools_write_are_read(encoding: str) -> None:
    name = {"latin-1": "iso-8859-1", "cp1252": "windows-1252"}.get(encoding)
    declared = f'<?xml version="1.0" encoding="{name}"?>' if name else ""
    found = parse_markup(f"{declared}<a>grün</a>".encode(encoding), "a.xml")
    assert not isinstance(found, Diagnostic)
    assert found[1].text == "grün"


def test_places_are_exact_behind_letters_and_line_ends_of_all_kinds() -> None:
    found = parse_markup("<a>äöü€😀\r\nß\r<b/><c/>\n</a>".encode(), "a.xml")
    assert not isinstance(found, Diagnostic)
    source, root = found
    assert [source.text[child.at:child.at + 4] for child in root.children] == ["<b/>", "<c/>"]


def test_depth_within_the_limit_needs_no_deep_stack() -> None:
    found = parse_markup(b"<a>" * MAX_DEPTH + b"x" + b"</a>" * MAX_DEPTH, "a.xml")
    assert not isinstance(found, Diagnostic)
    assert found[1].text == "x"
    assert sys.getrecursionlimit() >= 200


def chain(count: int, element: Callable[[int], str]) -> Imported:
    return imported(pou(RAIL + "".join(element(number) for number in range(2, count + 2)), "a x"))


@pytest.mark.slow
def test_long_chains_of_coils_and_contacts_need_no_deep_stack() -> None:
    backwards = chain(2_000, lambda number: coil(number, str(number + 1) if number < 2_001 else "1", "x"))
    assert backwards.errors == []
    forwards = chain(1_100, lambda number: contact(number, str(number - 1), "a") if number < 1_101 else coil(number, "1100", "x"))
    assert forwards.errors == []
    assert forwards.files["Main.st"].count(" a") > 1_000


def test_values_that_are_doubled_again_and_again_end_with_a_message() -> None:
    adds = value(1, "who") + "".join(block(n, "ADD", f"IN1={n - 1} IN2={n - 1}", "OUT") for n in range(2, 60))
    made = imported(pou(adds + result(99, "59", "x"), "x", language="FBD"))
    assert "X0202" in {d.code for d in made.errors}
    assert len(made.files["Main.st"]) < 10_000


@pytest.mark.slow
def test_a_network_of_nothing_but_loops_ends_with_a_message() -> None:
    count = 30
    everybody = "+".join(str(n) for n in range(1, count))
    made = imported(pou("".join(block(n, "OR", f"IN1={everybody}", "OUT") for n in range(1, count)), "x", language="FBD"))
    assert "X0202" in {d.code for d in made.errors}
    assert "loops" in made.errors[-1].message


@pytest.mark.slow
def test_a_network_that_is_too_large_is_refused() -> None:
    made = chain(5_100, lambda number: contact(number, str(number - 1), "a"))
    assert [d.code for d in made.errors] == ["X0202"]


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(data=st.data())
def test_documents_that_were_spoiled_raise_nothing(data: st.DataObject) -> None:
    text = (Path(__file__).parent / "documents" / data.draw(st.sampled_from(["beremiz.xml", "codesys.xml"]))).read_bytes()
    at = data.draw(st.integers(0, len(text)))
    length = data.draw(st.integers(0, 60))
    put = data.draw(st.sampled_from([b"", b"0", b"<", b"-1", b'"', b"\xc3", b"<pou>", b"12"]))
    made = import_xml(text[:at] + put + text[at + length:])
    for diagnostic in made.diagnostics:
        assert diagnostic.render()


def test_a_local_id_of_thousands_of_digits_is_a_name_like_any_other() -> None:
    number = "9" * 5_000
    made = imported(pou(value(number, "a") + result(2, number, "b"), "a b", language="FBD"))
    assert made.errors == [] and "b := a;" in made.files["Main.st"]
