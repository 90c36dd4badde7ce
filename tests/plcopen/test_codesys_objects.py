"""Methods, properties, interfaces and inheritance that CODESYS keeps in addData become sources that run."""

from __future__ import annotations

from pathlib import Path

from fbvm import Plc
from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.plcopen.read.importing import import_xml

DOCUMENT = Path(__file__).parent / "documents" / "codesys_objects.xml"


def test_objects_of_codesys_are_taken_over_and_run() -> None:
    made = import_xml(DOCUMENT)
    assert made.errors == []
    compiled = compile_sources([Source(name, text) for name, text in made.files.items()], "Main", dialect="codesys")
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    plc = Plc(compiled.image)
    plc.scan()
    assert [plc.read(f"Main.{name}") for name in ("a", "b", "far.x", "far.y")] == [117, 40, 3, 4]


def test_what_stands_beside_heads_is_in_the_text() -> None:
    files = import_xml(DOCUMENT).files
    assert files["Motor.st"].startswith("{attribute 'call_after_init'}\nFUNCTION_BLOCK Motor IMPLEMENTS Drive\n")
    assert "    METHOD PROTECTED Own : INT\n" in files["Motor.st"]
    assert files["Fast.st"].startswith("FUNCTION_BLOCK Fast EXTENDS Motor\n")
    assert "fast : Fast (1, second := 2);" in files["Main.st"]
    assert files["NamedDrive.st"].startswith("INTERFACE NamedDrive EXTENDS Drive\n")
