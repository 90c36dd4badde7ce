"""`proved` in tests: blocks and programs, what is free, failures with their run, proofs that are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fbvm.base.data import data_folder
from fbvm.prove import stored
from fbvm.testing import NotProved, double_writes, proved

GATE = """
FUNCTION_BLOCK Gate
VAR_INPUT Open, Close : BOOL; END_VAR
VAR_OUTPUT Up, Down : BOOL; END_VAR
    Up := (Open OR Up) AND NOT Close;
    Down := (Close OR Down) AND NOT Open;
END_FUNCTION_BLOCK
"""


@pytest.mark.slow
def test_a_block_is_proved_for_all_inputs(fb: Any) -> None:
    verdict = proved(fb("Gate", text=GATE), never="Up AND Down")
    assert (verdict.word, verdict.how) == ("proved", "by induction over 2 scans")


def test_what_is_broken_fails_with_the_shortest_run(fb: Any) -> None:
    with pytest.raises(NotProved) as failed:
        proved(fb("Gate", text=GATE), never="Down AND NOT Close")
    assert str(failed.value).splitlines() == [
        "never Down AND NOT Close: BROKEN after 2 scans, by the shortest run", "       0", "Close  #.", "Down   ##"]


def test_an_assumption_is_kept_by_all_runs(fb: Any) -> None:
    gate = fb("Gate", text=GATE)
    assert proved(gate, never="Down", assume="NOT Close").notes == ("assumed: NOT Close",)


@pytest.mark.slow
def test_a_proof_is_kept_until_the_program_changes(fb: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    prove = stored.prove
    monkeypatch.setattr(stored, "prove", lambda *arguments: asked.append(arguments) or prove(*arguments))
    text = GATE.replace("Gate", "KeptGate")
    first = proved(fb("KeptGate", text=text), never="Up AND Down")
    assert proved(fb("KeptGate", text=text), never="Up AND Down").how == first.how
    assert len(asked) <= 1
    proved(fb("KeptGate", text=text), never="Down AND Up")
    proved(fb("KeptGate", text=text.replace("Close OR Down", "Close OR Down AND NOT Up")), never="Up AND Down")
    assert len(asked) <= 3


@pytest.mark.parametrize("asked", [{}, {"never": "Up", "always": "Up"}])
def test_one_property_is_asked_at_a_time(fb: Any, asked: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="one of never, always, no_trap and written_once"):
        proved(fb("Gate", text=GATE), **asked)


def test_standard_blocks_never_trap(fb: Any) -> None:
    for block in ("TON", "TOF", "TP", "CTU", "CTD", "R_TRIG", "SR", "RS"):
        assert proved(fb(block), no_trap=True).word == "proved"


INTERLOCKS = [
    ("interlock", "Main.Left AND Main.Right"),
    ("fault_latch", "Main.Fault AND Main.Motor"),
    ("first_in", "Main.Lamp_A AND Main.Lamp_B OR Main.Lamp_B AND Main.Lamp_C OR Main.Lamp_A AND Main.Lamp_C"),
    ("pump_alternation", "Main.First AND Main.Second AND NOT Main.High"),
    ("traffic_light", "Main.Red AND Main.Green"),
    ("batch_sequence", "Main.Inlet AND Main.Outlet"),
]


@pytest.mark.slow
@pytest.mark.parametrize("twin", ["", "_ladder"])
@pytest.mark.parametrize(("name", "never"), [pytest.param(*row, id=row[0]) for row in INTERLOCKS])
def test_the_interlocks_of_the_classics_hold(plc: Any, name: str, never: str, twin: str) -> None:
    rig = plc(str(Path(data_folder("examples")) / "classics" / f"{name}{twin}.st"))
    assert proved(rig, never=never).word == "proved"


DOUBLE = """
FUNCTION_BLOCK Signal
VAR_INPUT Run, Fault : BOOL; END_VAR
VAR_OUTPUT Lamp, Horn : BOOL; END_VAR
    Lamp := Run;
    IF Fault THEN
        Lamp := TRUE;
    END_IF
    Horn := Fault;
END_FUNCTION_BLOCK
"""


def test_an_output_that_two_statements_write_fails_with_both(fb: Any) -> None:
    assert proved(fb("Signal", text=DOUBLE), written_once="Horn").word == "proved"
    with pytest.raises(NotProved) as failed:
        proved(fb("Signal", text=DOUBLE), written_once="Lamp")
    first, *_, last = str(failed.value).splitlines()
    assert first == "written once Lamp: BROKEN after 1 scan, by the shortest run"
    assert last.split(" by ")[1].split(" in ")[0].endswith(":5:5") and last.endswith(":7:9 in Signal")
    rig = fb("Signal", text=DOUBLE)
    place = f"{rig.subject.prefix}Lamp"
    assert double_writes(rig.plc, place) == []
    rig.plc.write(f"{rig.subject.prefix}Fault", True)
    assert len(double_writes(rig.plc, place)) == 2
