"""Documents in the manner of each tool, and what their programs do scan by scan on both engines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fbvm.code.compiler import compile_sources
from fbvm.engine.native.engine import available
from fbvm.interchange.dialect_signs import FAMILIES
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.machine.plc import Plc

DOCUMENTS = Path(__file__).parent / "documents"
ENGINES = ("python", "native") if available() else ("python",)
Scan = tuple[dict[str, Any], list[Any]]
"""What is written in front of a scan, and what the variables of the row are behind it."""

ROWS: dict[str, tuple[str, list[Scan]]] = {
    # An EXECUTE box, operands typed at outputs, a list of globals whose variables have qualifiers of their own, typeName="".
    "codesys_device": ("PLC_PRG.el PLC_PRG.xDone PLC_PRG.n b a", [
        ({}, [0, False, 0, 0, 0]), ({"PLC_PRG.xStart": True}, [0, False, 0, 0, 0]), ({}, [20, False, 0, 0, 0]),
        ({}, [40, True, 1, 10, 0]), ({}, [40, True, 2, 20, 0]), ({"PLC_PRG.xStart": False}, [0, False, 2, 20, 0])]),
    # A CFC beside an empty ST: outputs and blocks by number, bends of wires as connectors without a name, a sum of itself.
    "codesys_cfc": ("PLC_PRG.nLate PLC_PRG.nNow PLC_PRG.xDone PLC_PRG.tGone", [
        ({}, [0, 1, False, 0]), ({"PLC_PRG.xGo": True}, [1, 2, False, 0]), ({}, [2, 3, False, 20]), ({}, [3, 4, True, 40])]),
    # POUs in types/pous, no instance; a method, a property, actions and an enumeration with attributes; FBD without places, whose
    # networks are told by localId, with EN, ENO, SR as TwinCAT names its pins, a jump; in a LD of an action a contact TRUE.
    "twincat": ("MAIN.bRun MAIN.fbPress.eMode MAIN.nSeen MAIN.nFull MAIN.bLate MAIN.tLate MAIN.nLess MAIN.nTens MAIN.bKept "
                "MAIN.bKept2 MAIN.nNotKept MAIN.bLamp", [
        ({}, [False, 0, 0, 0, False, 0, 0, 0, True, True, 0, False]),
        ({"MAIN.bStart": True}, [True, 10, 2, 0, False, 0, 0, 0, True, True, 0, True]),
        ({"MAIN.bStart": False}, [True, 10, 4, 0, True, 20, 2, 0, True, True, 0, True]),
        ({}, [True, 10, 6, 1, True, 20, 4, 0, True, True, 0, True]), ({}, [True, 10, 2, 1, True, 20, 0, 0, True, True, 0, True]),
        ({"MAIN.bStop": True}, [False, 0, 2, 1, False, 0, 0, 10, True, True, 0, False]),
        ({"MAIN.bStart": True}, [False, 0, 2, 1, False, 0, 0, 10, False, False, 1, False])]),
    # OpenPLC Editor until 2025: outputs in the order of the document, although a rung is drawn above; a sum that feeds itself.
    "openplc": ("%QX0.0 instance0.relay instance0.late instance0.n", [
        ({}, [False, False, False, 2]), ({"%IX0.0": True}, [False, True, False, 4]), ({}, [True, True, False, 6]),
        ({}, [True, True, True, 8]), ({"%IX0.0": False}, [True, False, False, 10]), ({}, [False, False, False, 12])]),
    # The newer editor: the namespace twice, scaling 16, outputs and blocks from top to bottom.
    "openplc_editor": ("%QX0.0 instance0.relay instance0.late instance0.n", [
        ({}, [False, False, False, 2]), ({"%IX0.0": True}, [True, True, False, 4]), ({}, [True, True, False, 6]),
        ({}, [True, True, True, 8]), ({"%IX0.0": False}, [False, False, False, 10]), ({}, [False, False, False, 12])]),
    # A tool that keeps to the schema: jump, label, return, connectors, VAR_CONFIG, VAR_ACCESS, a type with a value, RETAIN.
    "strict": ("counter1.n counter1.m counter1.k", [
        ({}, [3, 6, 1]), ({"%IX0.4": True}, [3, 6, 2]), ({"counter1.done": True}, [3, 6, 2]), ({"%IX0.4": False}, [6, 12, 2]),
        ({"counter1.done": False}, [9, 18, 3])]),
    # pouInstance type=, an interval as a time of day, executionId, a block changes its in-out before a variable takes it.
    "tc6_101": ("tank1.level tank1.done tank1.was", [
        ({}, [25, False, 25]), ({"tank1.valve": True}, [50, False, 50]), ({}, [75, False, 75]), ({}, [100, True, 100]),
        ({}, [100, True, 100]), ({"tank1.level": 0, "tank1.valve": False}, [0, False, 0])]),
}


@pytest.mark.parametrize("name", ROWS)
def test_a_document_in_the_manner_of_a_tool_runs_on_both_engines(name: str) -> None:
    made = import_xml(DOCUMENTS / f"{name}.xml")
    assert made.errors == [], [d.render() for d in made.errors]
    compiled = compile_sources(made.sources, runnable=True, dialect=FAMILIES.get(made.family, "standard"), lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    read, scans = ROWS[name]
    for engine in ENGINES:
        plc = Plc(compiled.image, 20_000_000, engine=engine)
        seen = []
        for writes, _ in scans:
            for place, value in writes.items():
                plc.write(place, value)
            assert plc.scan() is None
            seen.append([_plain(plc.read(place)) for place in read.split()])
        assert seen == [expected for _, expected in scans], engine


def _plain(value: Any) -> Any:
    """A value to compare: a duration as its milliseconds, an enumeration as its number."""
    return value // 1_000_000 if type(value) is int and value >= 1_000_000 else value


CFC = """<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><pous><pou name="P" pouType="program"><interface><localVars>
<variable name="a"><type><BOOL/></type></variable></localVars></interface>
<body><ST><xhtml/></ST><addData>
<data name="http://www.3s-software.com/plcopenxml/{}" handleUnknown="implementation"><{}><inVariable localId="1">
<position x="1" y="1"/><connectionPointOut/><expression>a</expression></inVariable>
<return localId="2"><position x="1" y="2"/><connectionPointIn><connection refLocalId="1"/></connectionPointIn></return>
</{}></data></addData></body></pou></pous></types></project>"""


@pytest.mark.parametrize(("name", "element", "message"), [
    ("cfc", "CFC", "POU P, return 2: a CFC with <return> is not taken over"),
    ("uml", "UML", "POU P: the body that the tool keeps in addData http://www.3s-software.com/plcopenxml/uml is not taken over")])
def test_a_body_in_added_data_never_becomes_an_empty_one(name: str, element: str, message: str) -> None:
    made = import_xml(CFC.format(name, element, element).encode())
    assert [error.message for error in made.errors] == [message]
