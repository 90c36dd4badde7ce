"""A debug session with a project: whatever an editor asks for, forth and back and from PLC to PLC, each PLC has the memory that
it has in a plain run at that time."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client, RefusedError
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.step.position import Position
from fbvm.step.session import Session

pytestmark = pytest.mark.slow
CYCLES_MS = {"fast": 10, "slow": 30, "odd": 70}
TEXT = """\
FUNCTION_BLOCK Sum
VAR_INPUT A : DINT; END_VAR
VAR_OUTPUT Q : DINT; END_VAR
    Q := Q + A;
END_FUNCTION_BLOCK
PROGRAM Main
VAR N AT D200 : DINT; S : Sum; T : TON; END_VAR
    N := N + STEP;
    S(A := N);
    T(IN := NOT T.Q, PT := T#50ms);
    IF T.Q THEN
        N := 0;
    END_IF;
END_PROGRAM
"""
NAMES = ("D200", "Main.N", "Main.S.A", "Main.S.Q", "Main.T.Q", "Main.T.ET")
MOVES = ("stepIn", "next", "stepOut", "stepBack", "fbvm/stepBackInto", "fbvm/stepScan", "fbvm/stepBackScan", "fbvm/gotoScan",
         "continue", "reverseContinue")  # fmt: skip


def text(name: str) -> str:
    return TEXT.replace("STEP", str(len(name)))


def values(plc: Plc) -> list[object]:
    return [plc.read(name) for name in NAMES]


def plain(name: str, scan: int, step: int) -> list[object]:
    """The variables of a PLC that runs alone, before a statement of a scan."""
    image = compile_text(text(name), f"{name}.st").image
    assert image is not None
    plc = Plc(image, CYCLES_MS[name] * 1_000_000)
    if not step:
        if scan:
            plc.run(scans=scan)
        return values(plc)
    session = Session.of(lambda: plc)
    session.goto(scan)
    for _ in range(step):
        session.step()
    return values(session.plc)


def begun(name: str, focus: str, scan: int) -> int:
    """How many scans of a PLC begin before a scan of another one.  Those that no move has executed yet wait for the next one."""
    now_ms, names = scan * CYCLES_MS[focus], list(CYCLES_MS)
    goes_first = names.index(name) < names.index(focus)
    return -(-(now_ms + goes_first) // CYCLES_MS[name])


@given(moves=st.lists(st.tuples(st.sampled_from(MOVES), st.integers(1, 3)), min_size=1, max_size=12),
       line=st.sampled_from((4, 9, 12)))  # fmt: skip
@settings(max_examples=times(25), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_requests_leave_each_plc_as_it_is_in_a_plain_run(tmp_path: Path, moves: list[tuple[str, int]], line: int) -> None:
    rows = ""
    for name, cycle_ms in CYCLES_MS.items():
        (tmp_path / f"{name}.st").write_text(text(name), encoding="utf-8")
        rows += f'[plc.{name}]\nsources = ["{name}.st"]\ncycle = "{cycle_ms}ms"\n'
    (tmp_path / "fbvm.toml").write_text(rows, encoding="utf-8")
    client = Client()
    client.begin(project=str(tmp_path), stopOnEntry=True)
    client.ask("setBreakpoints", source={"path": str(tmp_path / "slow.st")}, breakpoints=[{"line": line, "hitCondition": "% 3"}])
    for what, thread in moves:
        try:
            client.go(what, threadId=thread, scan=7)
        except RefusedError as refused:
            assert "beginning of what is kept" in str(refused)
        debugger = client.adapter.debug.running
        focus, here = debugger.focus, debugger.session.here
        for name, plc in debugger.plcs.items():
            assert isinstance(plc.session, Session)
            at = plc.session.here
            if name != focus:
                assert at == Position(min(begun(name, focus, here.scan), plc.end)), (what, name)
            assert values(plc.session.plc) == plain(name, at.scan, at.step), (what, name)
