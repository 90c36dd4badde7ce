"""TwinCAT's objects as sources: the words that the files leave out, at places that are those of the files."""

from __future__ import annotations

import re

import pytest
from rows import each_of
from twincat_files import COUNTER, HEAD, MAIN, POINT

from fbvm.interchange.twincat.objects import read_object

DOCUMENT_TYPE = "the document declares a document type, and with it perhaps entities: it is not read"


def source_of(text: str) -> str:
    made = read_object(text.encode(), "FB.TcPOU")
    assert made.source is not None and made.diagnostics == []
    return made.source.text


def code(text: str) -> list[str]:
    """The lines that are not blank, with one blank between words."""
    return [" ".join(line.split()) for line in source_of(text).splitlines() if line.strip()]


def test_a_block_with_all_that_belongs_to_it() -> None:
    assert code(COUNTER) == [
        "// counts", "FUNCTION_BLOCK FB_Counter", "VAR", "nCount : INT;", "END_VAR", "nCount := nCount + 1; // once a call",
        "METHOD PUBLIC Reset : BOOL", "VAR_INPUT", "n : INT;", "END_VAR", "nCount := n;", "Reset := TRUE;", "END_METHOD",
        "PROPERTY Count : INT", "GET", "VAR", "END_VAR", "Count := nCount;", "END_GET END_PROPERTY ACTION Stop:",
        "nCount := SEL(nCount < 5, 0, nCount);", "END_ACTION END_FUNCTION_BLOCK"]  # fmt: skip


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_an_object_is_read_in_each_encoding_of_unicode(encoding: str) -> None:
    made = read_object(COUNTER.removeprefix("\ufeff").encode(encoding), "FB.TcPOU")
    assert made.source is not None and (made.source.text.split(), made.diagnostics) == (source_of(COUNTER).split(), [])


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_each_piece_of_code_stands_where_it_stands_in_the_file(newline: str) -> None:
    text = COUNTER.replace("\n", newline).removeprefix("\ufeff")
    lines, made = text.split(newline), source_of(COUNTER.replace("\n", newline)).split(newline)
    assert len(made) == len(lines)
    for line, given in zip(made, lines, strict=True):
        code = line.strip().partition("<")[0].strip()
        if code and not re.match(r"(?:END_(?:METHOD|GET|ACTION)|GET$)", code):
            assert line.index(code) == given.index(code), given


def test_types_and_programs_need_no_more_than_they_say() -> None:
    assert code(POINT) == ["TYPE ST_Point :", "STRUCT", "nX : INT;", "END_STRUCT", "END_TYPE"]
    assert code(MAIN)[-1] == "END_PROGRAM"


def test_an_enumeration_with_a_text_list_is_a_type() -> None:
    text = HEAD + """<EnumerationTextList Name="E" Id="{1}"><Declaration><![CDATA[TYPE E : (One, Two) BYTE; END_TYPE
]]></Declaration><XmlArchive><Data><o><v n="TextID">"One"</v></o></Data></XmlArchive></EnumerationTextList></TcPlcObject>"""
    assert code(text) == ["TYPE E : (One, Two) BYTE; END_TYPE"]


def test_an_interface_has_prototypes() -> None:
    itf = HEAD + """<Itf Name="I_Count" Id="{1}"><Declaration><![CDATA[INTERFACE I_Count
]]></Declaration>
<Method Name="Reset" Id="{2}"><Declaration><![CDATA[METHOD Reset : BOOL
]]></Declaration></Method>
<Property Name="Count" Id="{3}"><Declaration><![CDATA[PROPERTY Count : INT]]></Declaration>
<Get Name="Get" Id="{4}"><Declaration><![CDATA[]]></Declaration></Get></Property>
</Itf></TcPlcObject>"""
    assert code(itf) == ["INTERFACE I_Count", "METHOD Reset : BOOL", "END_METHOD PROPERTY Count : INT",
                         "GET END_GET END_PROPERTY END_INTERFACE"]  # fmt: skip


def test_the_access_word_of_an_accessor_stands_in_front_of_it_and_no_name_of_its_code_does() -> None:
    block = HEAD + """<POU Name="P" Id="{1}"><Declaration><![CDATA[FUNCTION_BLOCK P
]]></Declaration><Property Name="Count" Id="{3}"><Declaration><![CDATA[PROPERTY Count : INT]]></Declaration>
<Set Name="Set" Id="{4}"><Declaration><![CDATA[// PRIVATE or not
{attribute 'x'} protected
VAR
END_VAR
]]></Declaration><Implementation><ST><![CDATA[Internal := 1;]]></ST></Implementation></Set></Property></POU></TcPlcObject>"""
    assert code(block)[:3] == ["FUNCTION_BLOCK P", "PROPERTY Count : INT", "protected SET // PRIVATE or not"]
    assert code(block)[3:] == ["{attribute 'x'}", "VAR", "END_VAR", "Internal := 1; END_SET END_PROPERTY END_FUNCTION_BLOCK"]


def test_code_in_one_line_without_a_line_end_behind_a_comment() -> None:
    one = '<TcPlcObject><POU Name="P"><Declaration><![CDATA[PROGRAM P]]></Declaration><Implementation><ST><![CDATA[; // x]]>' \
          "</ST></Implementation></POU></TcPlcObject>"
    assert code(one) == ["PROGRAM P ; // x", "END_PROGRAM"]


def test_code_that_holds_the_end_of_a_section_is_split_over_two() -> None:
    text = MAIN.replace("fbCounter();", "nSeen := a[b[1]]]]><![CDATA[>0];")
    assert "nSeen := a[b[1]] >0];" in code(text)


@pytest.mark.parametrize(("body", "said"), [
    ("<SFC/>", "a sequential function chart"), ("<LADDER/>", "ladder"),
])  # fmt: skip
def test_bodies_in_other_languages_are_named_with_their_place(body: str, said: str) -> None:
    text = MAIN.replace(MAIN[MAIN.index("<ST>"):MAIN.index("</ST>") + 5], body)
    made = read_object(text.encode(), "MAIN.TcPOU")
    [found] = made.diagnostics
    assert (found.code, found.message) == ("X0203", f"the body of MAIN is {said}, which is not read from this file")
    assert found.source.text[found.start:found.end].removeprefix("<").isalnum()
    assert found.source.place(found.start)[0] == 12
    assert made.source is not None and made.source.text.split()[-1] == "END_PROGRAM"


@each_of("archive", ["", '<XmlArchive><Data><o t="CFCImplementationObject"/></Data></XmlArchive>'])
def test_a_network_diagram_without_networks_is_named_with_its_place(archive: str) -> None:
    made = read_object(MAIN.replace("<ST>", f"<NWL>{archive}</NWL><ST>").encode(), "MAIN.TcPOU")
    [found] = made.diagnostics
    assert (found.code, found.message) == ("X0203", "the network diagram of MAIN is empty or damaged")
    assert found.source.place(found.start)[0] == 12


@pytest.mark.parametrize(("text", "code", "said"), [
    ("<TcPlcObject></TcPlcObject>", "X0501", "the file holds no object of TwinCAT"),
    ("<project><POU/></project>", "X0501", "the file holds no object of TwinCAT"),
    ("<TcPlcObject><POU/><DUT/></TcPlcObject>", "X0501", "the file holds 2 objects of TwinCAT"),
    ("<TcPlcObject><POU>", "X0101", "this is no well-formed XML: no element found"),
    ("<!DOCTYPE a><TcPlcObject/>", "X0102", DOCUMENT_TYPE),
])  # fmt: skip
def test_what_is_no_object(text: str, code: str, said: str) -> None:
    made = read_object(text.encode(), "x.TcPOU")
    assert made.source is None
    assert [(found.code, found.message) for found in made.diagnostics] == [(code, said)]
