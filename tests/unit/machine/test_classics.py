"""The classic rungs of a course, in ladder and in Structured Text: equal memory after each scan, whatever the inputs do."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random

import pytest
from click.testing import CliRunner
from rows import first_quick

from fbvm.cli.main import main
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "classics"
NAMES = sorted(path.stem.removesuffix("_ladder") for path in FOLDER.glob("*_ladder.st"))
WORDS = {"CIO": range(200), "W": range(8), "H": range(8), "D": range(32)}
ACTIVE = {"seal_in": "Motor", "double_coil": "Between", "interlock": "Left", "edge_counting": "Full", "shift_register": "Ejector",
          "traffic_light": "Green", "batch_sequence": "Outlet", "fault_latch": "Horn", "pump_alternation": "Other",
          "delays": "Fan", "flasher": "Lamp", "first_in": "Lamp_C", "scaling": "Alarm"}
"""An output of each that the inputs must have switched on, so that a comparison says something."""


@cache
def image(name: str) -> Image:
    made = compile_files([FOLDER / f"{name}.st"], runnable=True)
    assert made.image is not None and made.diagnostics == []
    return made.image


PHASES = [(mask, longest) for mask in (1, 2, 3, 4, 5, 7, 15) for longest in (1, 2, 6)] + [(1, 120), (3, 120)]
"""Bits of CIO 0 that change for some time, the others being OFF, and for how many scans they keep a value at the most."""


def course(random: Random) -> Iterator[tuple[int, int]]:
    """What stands in CIO 0 and CIO 1 in each scan."""
    for mask, longest in random.sample(PHASES, len(PHASES)):
        for _ in range(4 if longest > 100 else 60 // (longest + 1) + 6):
            yield from [(random.randrange(16) & mask, random.randrange(4001))] * random.randint(1 + longest // 2, longest)


def states(plc: Plc) -> dict[str, list[int]]:
    return {area: list(plc.memory.words(area)[words.start:words.stop]) for area, words in WORDS.items()}


@pytest.mark.slow
def test_all_examples_are_written_and_drawn_as_fmt_does() -> None:
    made = CliRunner().invoke(main, ["fmt", "--check", str(FOLDER.parent)])
    assert (made.exit_code, made.output) == (0, "")


def test_each_classic_has_its_twin() -> None:
    assert {path.stem for path in FOLDER.glob("*.st")} == {form for name in ACTIVE for form in (name, f"{name}_ladder")}


@pytest.mark.slow
@pytest.mark.parametrize("name", first_quick(NAMES))
def test_twins_have_equal_memory_after_each_scan(name: str) -> None:
    ladder, text = Plc(image(f"{name}_ladder")), Plc(image(name))
    active = False
    for scan, given in enumerate(course(Random(name))):
        for plc in (ladder, text):
            plc.write("CIO 0", given[0])
            plc.write("CIO 1", given[1])
        assert ladder.scan() is None and text.scan() is None
        assert states(ladder) == states(text), f"scan {scan} with inputs {given}"
        active |= bool(text.read(f"Main.{ACTIVE[name]}"))
    assert active
