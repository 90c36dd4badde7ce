"""XML to elements and back: what a text is, where an element stands, and what is refused in which words."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.markup import MAX_DEPTH, Element, element, parse_markup, written
from fbvm.interchange.plcopen.read.diagram import Object
from fbvm.interchange.plcopen.read.sequence import sequence


def parsed(text: str | bytes) -> Element:
    found = parse_markup(text.encode() if isinstance(text, str) else text, "a.xml")
    assert not isinstance(found, Diagnostic), found.message
    return found[1]


@each_of(("xml", "text"), [
    ("<p>a<br/>b<br></br>c</p>", "a\nb\nc"), ("<p> a <b>b<i>c</i></b>d </p>", " a bcd "), ("<p/>", ""),
    ("<p>&lt;&amp;<![CDATA[<b>]]></p>", "<&<b>"), ("<p><!-- no -->x<?no?></p>", "x")])
def test_the_text_of_an_element(xml: str, text: str) -> None:
    assert parsed(xml).text == text


def test_elements_know_their_places_names_and_parts() -> None:
    text = '<a xmlns="urn:one" xmlns:o="urn:two">\n  <b n="1"/>x<o:c o:n="2"><b/></o:c>\n</a>'
    root = parsed(text)
    assert [(part.name, part.namespace, part.at, part.attributes) for part in root.walk()] == [
        ("a", "urn:one", 0, {}), ("b", "urn:one", text.index("<b"), {"n": "1"}), ("c", "urn:two", text.index("<o:c"), {"n": "2"}),
        ("b", "urn:one", text.index("<b/>"), {})]  # fmt: skip
    assert [part.name for part in root.all("c", "b")] == ["b", "c"]
    assert (inner := root.one("c", "b")) is not None and inner.at == text.index("<b/>")
    assert root.one("c", "d") is None and root.one("d", "b") is None and root.one() is root
    assert (root.children[0].get("n"), root.children[0].get("m"), root.children[0].get("m", "3")) == ("1", "", "3")


@each_of(("text", "code", "message", "hint", "at"), [
    ("<a>\n<b>\n</a>", "X0101", "this is no well-formed XML: mismatched tag", "<b> of line 2 is open here", 10),
    ("", "X0101", "no element found", "an export of a PLC tool begins with <?xml", 0),
    ("<a/>x", "X0101", "junk after document element", "an export of a PLC tool begins", 4),
    ("<!DOCTYPE a><a/>", "X0102", "the document declares a document type", "take <!DOCTYPE ...> out", 11),
    ("<a>" * (MAX_DEPTH + 1), "X0103", "elements are nested more than 200 deep", "no PLC tool writes that", 603)])
def test_what_is_refused_with_its_place(text: str, code: str, message: str, hint: str, at: int) -> None:
    found = parse_markup(text.encode(), "a.xml")
    assert isinstance(found, Diagnostic)
    assert (found.code, message in found.message, hint in found.hint, found.start) == (code, True, True, at), found.render()


def test_the_deepest_nesting_is_read() -> None:
    assert parsed("<a>" * MAX_DEPTH + "</a>" * MAX_DEPTH).name == "a"


def test_as_many_elements_are_read_as_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.interchange.markup.MAX_ELEMENTS", 3)
    assert [each.name for each in parsed("<a><b/><c/></a>").children] == ["b", "c"]
    found = parse_markup(b"<a><b/><c/><d/></a>", "a.xml")
    assert isinstance(found, Diagnostic) and (found.code, found.message) == ("X0103", "there are more than 3 elements")


@each_of(("data", "message"), [
    ('<?xml version="1.0" encoding="latin-1"?><a>\xe9</a>'.encode("latin-1"), ""),
    ('<?xml version="1.0" encoding="utf-16"?><a>\xe9</a>'.encode("utf-16"), ""), ("<a>\xe9</a>".encode("utf-8-sig"), ""),
    ("<a>\xe9</a>".encode("utf-16-le"), ""), ('<?xml version="1.0" encoding="utf-16"?><a>\xe9</a>'.encode("utf-16-be"), ""),
    (b'<?xml version="1.0" encoding="rot13"?><a/>', "a.xml is written in rot13, which is not read here"),
    (b'<?xml version="1.0" encoding="nosuch"?><a/>', "a.xml is written in nosuch, which is not read here"),
    ('<?xml version="1.0" encoding="ascii"?><a>\xe9</a>'.encode(), "a.xml says that it is ASCII, and is none at byte 41"),
    (b"<a>\xe9</a>", "a.xml names no encoding, and so is UTF-8, and is none at byte 3")])
def test_in_which_letters_a_document_is_written(data: bytes, message: str) -> None:
    found = parse_markup(data, "a.xml")
    assert (found.message if isinstance(found, Diagnostic) else "") == message
    assert isinstance(found, Diagnostic) or found[1].text == "\xe9"


def test_what_is_written_has_an_element_with_text_on_one_line() -> None:
    inner = element("b", "1 < 2", element("c", "x", d='"&'))
    made = element("a", inner, None, element("e"), element("f", element("g", n=3)), n=1)
    assert written(made) == ('<?xml version="1.0" encoding="utf-8"?>\n<a n="1">\n  <b>1 &lt; 2<c d=\'"&amp;\'>x</c></b>\n  <e/>\n'
                             '  <f>\n    <g n="3"/>\n  </f>\n</a>\n')  # fmt: skip
    assert parsed(written(made)).text.split() == ["1", "<", "2x"]


@each_of(("first", "second", "order"), [
    ((0, 0), (1, 0), "ab"), ((1, 0), (0, 0), "ba"), ((1, 0), (0, 9), "ba"), ((1, 9), (0, 0), "ba"), ((1, 0), (0, 10), "ab"),
    ((0, 10), (1, 0), "ba"), ((0.5, 0), (0, 0), "ba"), ((0, 0), (0, 0), "ab"), ((0, 9), (0, 0), "ab"), ((0, 10.5), (0, 0), "ba")])
def test_sinks_go_row_by_row_from_left_to_right(first: tuple[float, float], second: tuple[float, float], order: str) -> None:
    """Two stand in one row if their y differ by less than 10; at one place they keep the order of writing."""
    drawn = [Object("coil", str(at), at, x, y, 0, name, element("coil")) for at, (name, (x, y)) in
             enumerate((("a", first), ("b", second)))]  # fmt: skip
    for way in ("position", "beremiz1"):
        assert "".join(item.text for item in sequence(drawn, way)[0]) == order, way
    assert "".join(item.text for item in sequence(drawn, "document")[0]) == "ab"
