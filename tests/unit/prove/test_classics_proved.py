"""Proofs of the classics: what each interlock, latch, timer and sequence promises, in ST and in ladder, for any time from 1 to
100 ms between two scans; and runs that show that no proof is about a program that does nothing."""

from __future__ import annotations

import pytest

from fbvm.base.data import data_folder
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, Question

pytestmark = pytest.mark.slow
ANY_TIME = Limits(1_000_000, scans=80, simulated_scans=100, longest_ns=100_000_000)

NEVERS = [
    ("interlock", "Main.Right AND Main.Left"),
    ("interlock", "Main.Stop AND (Main.Right OR Main.Left)"),
    ("seal_in", "Main.Stop AND Main.Motor"),
    ("fault_latch", "Main.Motor AND (Main.Fault OR Main.Stop)"),
    ("fault_latch", "Main.Horn AND NOT Main.Fault"),
    ("first_in", "Main.Lamp_A AND Main.Lamp_B OR Main.Lamp_B AND Main.Lamp_C OR Main.Lamp_A AND Main.Lamp_C"),
    ("first_in", "Main.Next AND (Main.Lamp_A OR Main.Lamp_B OR Main.Lamp_C)"),
    ("pump_alternation", "Main.First AND Main.Other AND NOT Main.High"),
    ("pump_alternation", "Main.Demand AND NOT Main.First AND NOT Main.Other"),
    ("batch_sequence", "Main.Inlet AND Main.Outlet"),
    ("batch_sequence", "Main.Stirrer AND (Main.Inlet OR Main.Outlet)"),
    ("batch_sequence", "Main.Abort AND (Main.Inlet OR Main.Stirrer OR Main.Outlet)"),
    ("traffic_light", "Main.Red AND Main.Green"),
    ("traffic_light", "Main.Yellow AND Main.Green"),
    ("traffic_light", "NOT Main.Enabled AND (Main.Red OR Main.Yellow OR Main.Green)"),
    ("shift_register", "Main.Ejector AND NOT Main.Pulse"),
    ("double_coil", "Main.Lamp <> Main.Two OR Main.Between <> Main.One"),
    ("edge_counting", "Main.Clear AND Main.Full"),
]
"""Classics, and what never is."""
ALWAYS_SO = [
    ("edge_counting", "Main.Full = (Main.Bottles >= 6)"),
    ("scaling", "Main.Alarm = (Main.Percent > 90)"),
]
SHOWN = [
    ("interlock", "Main.Left"), ("seal_in", "Main.Motor"), ("fault_latch", "Main.Horn"), ("first_in", "Main.Lamp_C"),
    ("pump_alternation", "Main.First AND Main.Other"), ("batch_sequence", "Main.Outlet"), ("traffic_light", "Main.Green"),
    ("shift_register", "Main.Ejector"), ("double_coil", "Main.Lamp"), ("edge_counting", "Main.Full"), ("scaling", "Main.Alarm"),
    ("delays", "Main.Fan"), ("flasher", "Main.Lamp"),
]  # fmt: skip
"""Classics, and what some run gets to."""
KINDS = ("", "_ladder")


def classic(name: str) -> Image:
    image = compile_files([data_folder("examples") / "classics" / f"{name}.st"], runnable=True, lint=False).image
    assert image is not None
    return image


@pytest.mark.parametrize("twin", KINDS, ids=["st", "ladder"])
@pytest.mark.parametrize(("name", "text"), NEVERS)
def test_what_never_is(name: str, text: str, twin: str) -> None:
    verdict = prove(classic(name + twin), Question(NEVER, text), ANY_TIME)
    assert verdict.word == "proved", verdict
    assert not [note for note in verdict.notes if note.startswith("no run")], verdict.notes


@pytest.mark.parametrize("twin", KINDS, ids=["st", "ladder"])
@pytest.mark.parametrize(("name", "text"), ALWAYS_SO)
def test_what_always_is(name: str, text: str, twin: str) -> None:
    assert prove(classic(name + twin), Question(ALWAYS, text), ANY_TIME).word == "proved"


@pytest.mark.parametrize("twin", KINDS, ids=["st", "ladder"])
@pytest.mark.parametrize(("name", "text"), SHOWN)
def test_what_a_run_gets_to(name: str, text: str, twin: str) -> None:
    assert prove(classic(name + twin), Question(REACH, text), ANY_TIME).word == "reached"


@pytest.mark.parametrize("name", sorted({name for name, _ in SHOWN}))
def test_no_classic_traps(name: str) -> None:
    for twin in KINDS:
        assert prove(classic(name + twin), Question(NO_TRAP), ANY_TIME).word == "proved", twin
