"""TKON and TKOF: cyclic tasks that instructions start and stop, and their flags.  From memory of the family, assumed."""

from __future__ import annotations

import pytest

from fbvm import Mode, Plc, compile_text

SOURCE = """PROGRAM Boss
IF NOT CX_Task(0, TRUE) THEN RETURN; END_IF;
LADDER
LD 0.00
@TKON 2
LD 0.01
@TKOF &2
LD 0.02
TKOF 0
LD TK02
OUT 1.00
LD P_On
++ D1
END_LADDER
END_PROGRAM

PROGRAM Worker
IF NOT CX_Task(2, FALSE) THEN RETURN; END_IF;
LADDER
LD P_On
++ D2
OUT 1.01
LD 0.03
TKON 0
END_LADDER
END_PROGRAM

CONFIGURATION Project RESOURCE R ON PLC PROGRAM Boss : Boss; PROGRAM Worker : Worker; END_RESOURCE END_CONFIGURATION"""


@pytest.fixture
def plc() -> Plc:
    compilation = compile_text(SOURCE)
    assert compilation.image, [str(found) for found in compilation.diagnostics]
    return Plc(compilation.image)


def after(plc: Plc, bit: str, scans: int = 2) -> tuple[object, ...]:
    """D1, D2, the flag of task 2 and an output of it after a bit was ON for some scans."""
    plc.write(bit, True)
    plc.run(scans=scans)
    plc.write(bit, False)
    return plc.read("D1"), plc.read("D2"), plc.read("CIO 1.00"), plc.read("CIO 1.01")


def test_a_task_runs_from_the_cycle_on_in_which_it_is_started_until_it_is_stopped(plc: Plc) -> None:
    assert after(plc, "CIO 5.00") == (2, 0, False, False)
    assert after(plc, "CIO 0.00") == (4, 2, True, True)
    assert after(plc, "CIO 0.01") == (6, 2, False, True), "its outputs keep their states"


def test_a_task_that_stops_itself_ends_with_that_instruction_and_another_starts_it_again(plc: Plc) -> None:
    after(plc, "CIO 0.00")
    assert after(plc, "CIO 0.02") == (2, 4, True, True)
    assert after(plc, "CIO 0.03") == (3, 6, True, True), "its turn comes again in the cycle behind"


def test_when_operation_begins_again_tasks_are_as_their_programs_say(plc: Plc) -> None:
    after(plc, "CIO 0.00")
    plc.mode = Mode.PROGRAM
    plc.scan()
    plc.mode = Mode.RUN
    before = plc.read("D2")
    plc.run(scans=3)
    assert plc.read("D2") == before
    assert plc.read("CIO 1.00") is False


@pytest.mark.parametrize(("step", "message"), [
    ("LD P_On\nTKON 128", "128 is no number of a cyclic task"), ("LD P_On\nTKOF D5", "D5 is no number of a cyclic task"),
    ("LD TK128\nOUT 0.00", "TK128 cannot be LD"), ("LD P_On\nMOV TK01 D0", "TK01 cannot be S of MOV"),
    ("LD P_On\nOUT TK01", "TK01 cannot be OUT"),
])  # fmt: skip
def test_numbers_and_flags_that_cannot_be(step: str, message: str) -> None:
    compilation = compile_text(f"PROGRAM Main\nLADDER\n{step}\nEND_LADDER\nEND_PROGRAM")
    assert message in str([found.message for found in compilation.diagnostics])


@pytest.mark.parametrize("step", ["MSKS 6 #0", "CLI 100 #0", "@DI"])
def test_instructions_about_interrupts_are_taken_and_do_nothing(step: str) -> None:
    compilation = compile_text(f"PROGRAM Main\nLADDER\nLD P_On\n{step}\nOUT 0.00\nEI\nEND_LADDER\nEND_PROGRAM")
    assert compilation.image, [str(found) for found in compilation.diagnostics]
    plc = Plc(compilation.image)
    plc.scan()
    assert plc.read("CIO 0.00") is True
