"""A trap ends a scan in which breakpoints are set as it ends any other, on every engine."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

TEXT = "PROGRAM Main\nVAR a, b, n : INT; END_VAR\n    n := n + 1;\n    a := 1 / b;\n    n := 7;\nEND_PROGRAM\n"


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native", "auto"])
@pytest.mark.parametrize(("kind", "where"), [("condition", "Main.n = 77"), ("change", "Main.b"), ("line", "text.st:5")])
def test_a_trap_is_told_while_breakpoints_are_set(engine: str, kind: str, where: str) -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image, engine=engine)
    getattr(plc.breakpoints, kind)(where)
    plc.scan()
    assert plc.trap is not None and (plc.trap.code, plc.trap.site.line) == ("R0101", 4)
    assert plc.halted is None and plc.read("Main.n") == 1


@pytest.mark.slow
def test_a_trap_behind_a_stop_is_told_when_the_scan_goes_on() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image, engine="python")
    plc.breakpoints.line("text.st:4")
    plc.scan()
    assert plc.halted is not None and plc.trap is None
    plc.scan()
    assert plc.halted is None and plc.trap is not None and plc.trap.code == "R0101"
