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
    # POUs in types/pous, no instance; a method, a property, an action and an enumeration with attributes; FBD without places.
    "twincat": ("MAIN.bRun MAIN.fbPress.eMode MAIN.nSeen MAIN.nFull MAIN.bLate MAIN.tLate", [
        ({}, [False, 0, 0, 0, False, 0]), ({"MAIN.bStart": True}, [True, 10, 2, 0, False, 0]),
        ({"MAIN.bStart": False}, [True, 10, 4, 0, True, 20]), ({}, [True, 10, 6, 1, True, 20]), ({}, [True, 10, 2, 1, True, 20]),
        ({"MAIN.bStop": True}, [False, 0, 2, 1, False, 0])]),
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
