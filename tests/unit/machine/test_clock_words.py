"""What the CPU unit tells each task about itself."""

from __future__ import annotations

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Mode, Plc


def test_the_first_task_flag_is_on_while_a_task_is_executed_for_the_first_time() -> None:
    """A200.15, seen by two tasks of which the first begins when a bit turns ON, and again after a change of mode."""
    made = compile_text("""
        PROGRAM Sees VAR Seen AT D200 : ARRAY[0..1] OF UINT; First AT A200.15 : BOOL; END_VAR
            Seen[0] := Seen[0] + 1; Seen[1] := Seen[1] * 2 + BOOL_TO_UINT(First);
        END_PROGRAM
        PROGRAM Sees_Too VAR Seen AT D210 : ARRAY[0..1] OF UINT; First AT A200.15 : BOOL; END_VAR
            Seen[0] := Seen[0] + 1; Seen[1] := Seen[1] * 2 + BOOL_TO_UINT(First);
        END_PROGRAM
        CONFIGURATION Plant
            VAR_GLOBAL Go : BOOL; END_VAR
            RESOURCE Cpu ON PLC
                TASK Now_And_Then(SINGLE := Go, PRIORITY := 1);
                TASK Always(INTERVAL := T#0s, PRIORITY := 2);
                PROGRAM A WITH Now_And_Then : Sees;
                PROGRAM B WITH Always : Sees_Too;
            END_RESOURCE
        END_CONFIGURATION""")
    assert made.image is not None, made.diagnostics
    plc = Plc(made.image)
    ends = []
    for scan in range(6):
        plc.write("Go", scan in (2, 4))
        plc.scan()
        ends.append(plc.read("A200.15"))
    assert (plc.read("D200..D201"), plc.read("D210..D211")) == ([2, 0b10], [6, 0b100000])
    assert ends == [True, False, False, False, False, False], "in scan 2 the second task has had its first time long ago"
    plc.mode = Mode.PROGRAM
    plc.mode = Mode.RUN
    plc.scan()
    assert plc.read("D211") == 0b1000001
