"""Objects of TwinCAT beside the sources that are made of them, blank for blank.  `FBVM_REWRITE=1 pytest` of this file writes the
text anew; read the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

from twincat_files import COUNTER, MAIN, POINT

from fbvm.interchange.twincat.objects import read_object

TEXT = Path(__file__).parent / "texts" / "objects.txt"


def declared(text: str) -> str:
    return f"<Declaration><![CDATA[{text}]]></Declaration>"


def body(text: str) -> str:
    return f"<Implementation><ST><![CDATA[{text}]]></ST></Implementation>"


def pou(head: str, code: str, more: str = "") -> str:
    return f'<TcPlcObject><POU Name="P">{declared(head)}{body(code)}{more}</POU></TcPlcObject>'


METHOD = f'<Method Name="M">{declared("METHOD M : INT{}")}{body("M := 1;{}")}</Method>'
PROPERTY = f"""<Property Name="N">{declared("PROPERTY N : INT")}<Get Name="Get"><Declaration></Declaration><Implementation>\
<ST>N := 1;</ST></Implementation></Get><Set Name="Set"><Declaration><![CDATA[VAR\nEND_VAR\n]]></Declaration>\
<Implementation><ST>x := N &lt; 3; // a &amp; b</ST></Implementation></Set></Property>"""
OBJECTS = {
    "a block": COUNTER, "a block with other line ends": COUNTER.replace("\n", "\r\n"), "a structure": POINT, "a program": MAIN,
    "one line": pou("PROGRAM P", "x := 1;"), "a comment at the end": pou("PROGRAM P // one", "x := 1; // two"),
    "a comment and a line": pou("PROGRAM P // one\n", "x := 1; // two\n"), "an empty body": pou("PROGRAM P", ""),
    "methods in one line": pou("FUNCTION_BLOCK P", "M();", METHOD.format("", "") + METHOD.format("", " // three")),
    "methods in several lines": pou("FUNCTION_BLOCK P\n", "M();\n", "\n" + METHOD.format("\n",
    "\n") + "\n" + METHOD.format("\n", "") + "\n"),
    "properties": pou("FUNCTION_BLOCK P", "M();", PROPERTY), "properties in lines": pou("FUNCTION_BLOCK P\n", "M();\n",
    "\n" + PROPERTY + "\n" + PROPERTY),
    "an action": pou("PROGRAM P",
    "A();", '<Action Name="A"><Implementation><ST><![CDATA[x := 2;]]></ST></Implementation></Action>'),
    "words in a comment": pou("(* FUNCTION *) // PROGRAM\nFUNCTION_BLOCK P",
    "x := 1;"), "no word": pou("VAR x : INT; END_VAR", "x := 1;"),
    "no declaration": '<TcPlcObject><POU Name="P"><Implementation><ST>x := 1;</ST></Implementation></POU></TcPlcObject>',
}  # fmt: skip


def test_where_each_word_of_an_object_stands() -> None:
    lines = []
    for name, text in OBJECTS.items():
        made = read_object(text.encode(), "FB.TcPOU")
        lines.append(f"=== {name}")
        lines += [f"{line!r}" for line in made.source.text.splitlines(keepends=True)] if made.source is not None else []
        lines += [found.message for found in made.diagnostics]
    text = "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        TEXT.write_text(text, encoding="utf-8")
    assert text == TEXT.read_text(encoding="utf-8")
