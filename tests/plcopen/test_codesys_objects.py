"""Methods, properties, interfaces and inheritance that CODESYS keeps in addData become sources that run."""

from __future__ import annotations

from pathlib import Path

from fbvm import Plc
from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml

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


STATIC = """<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><pous>
<pou name="Count" pouType="functionBlock"><interface>
<outputVars><variable name="out"><type><INT/></type></variable></outputVars>
<globalVars><variable name="all"><type><INT/></type></variable></globalVars></interface>
<body><ST><xhtml>all := all + 1; out := all; Twice();</xhtml></ST></body><addData>
<data name="http://www.3s-software.com/plcopenxml/method" handleUnknown="implementation"><Method name="Twice">
<interface><returnType><INT/></returnType></interface><body><ST><xhtml>kept := kept + 2; Twice := kept;</xhtml></ST></body>
<InterfaceAsPlainText><xhtml>METHOD Twice : INT
VAR_INST
  kept : INT;
END_VAR
</xhtml></InterfaceAsPlainText><addData/></Method></data>
<data name="http://www.3s-software.com/plcopenxml/interfaceasplaintext" handleUnknown="implementation"><InterfaceAsPlainText>
<xhtml>FUNCTION_BLOCK Count
VAR_STAT
  all : INT;
END_VAR
VAR
  many : INT := 5;
END_VAR</xhtml></InterfaceAsPlainText></data></addData></pou>
<pou name="Main" pouType="program"><interface><localVars><variable name="a"><type><derived name="Count"/></type></variable>
<variable name="b"><type><derived name="Count"/></type></variable><variable name="n"><type><INT/></type></variable>
<variable name="m"><type><INT/></type></variable></localVars></interface>
<body><ST><xhtml>a(); b(); n := a.Twice(); m := b.out;</xhtml></ST></body></pou></pous></types></project>"""


def test_static_variables_are_those_that_a_pou_calls_global_and_variables_of_a_method_stand_in_its_text() -> None:
    made = import_xml(STATIC.encode())
    assert made.errors == []
    assert "VAR_STAT\n    all : INT;" in made.files["Count.st"]
    assert "    VAR_INST\n        kept : INT;" in made.files["Count.st"]
    again = export_xml([Source("a.st", made.files["Count.st"].replace("VAR_INST", "VAR")), Source("b.st", made.files["Main.st"])])
    assert [(found.code, found.source.text[found.start : found.start + 8], found.message.partition(";")[0])
            for found in again.diagnostics if "VAR_STAT" in found.message] == \
        [("X0390", "VAR_STAT", "VAR_STAT is written as CODESYS and TwinCAT have it")]
    assert again.errors == []
    assert again.text is not None
    for sources, kept in ((made.sources, 4), (import_xml(again.text.encode()).sources, 2)):
        compiled = compile_sources(sources, "Main", dialect="codesys", lint=False)
        assert compiled.image is not None, [d.render() for d in compiled.errors]
        plc = Plc(compiled.image)
        plc.scan()
        assert [plc.read("Main.n"), plc.read("Main.m"), plc.read("Main.b.many")] == [kept, 2, 5]


def test_a_variable_that_two_texts_of_a_declaration_have_is_declared_once() -> None:
    """The texts differ in a blank, so they are no copies of one another; what only the second one has is added."""
    text = STATIC[STATIC.index('<data name="http://www.3s-software.com/plcopenxml/interfaceasplaintext"'):STATIC.index("</addData></pou>")]
    other = text.replace("many : INT", "Many :  INT").replace("END_VAR</xhtml>", "  more : INT;\nEND_VAR</xhtml>")
    made = import_xml(STATIC.replace(text, text + other).encode())
    assert made.errors == []
    lines = [" ".join(line.split()) for line in made.files["Count.st"].splitlines()]
    assert [line for line in lines if "many" in line.lower() or "more" in line] == ["many : INT := 5;", "more : INT;"]
