"""A plant's project all the way: file, sources, run, test, a changed rung, difference, file again."""

from __future__ import annotations

import difflib
from pathlib import Path

import pytest
from click.testing import CliRunner
from cx_text import DOUBLE, Cxt

from fbvm.cli.main import main
from fbvm.interchange.cx.compression import compress, decompress
from fbvm.testing.rig import Rig
from fbvm.testing.subject import subject

PLANT = Cxt(
    symbols=(
        "Start_PB,0.00,BOOL,,,start button",
        'Stop_PB,0.01,BOOL,,,"stop button, normally open"',
        "Guard,0.02,BOOL,,,guard is shut",
        "Pump,100.00,BOOL,,,pump of the line",
        "Lamp,100.01,BOOL,,,runs and is watched",
        "Valve,100.02,BOOL,,,opens half a second later",
        ",D100,CHANNEL,,,raw level",
        "Dbl1,,FUNCTION BLOCK,DOUBLE,A,",
    ),
    blocks=(DOUBLE,),
    sections=(
        ("Drive", (
            "# self hold\nLD Start_PB\nOR Pump\nANDNOT Stop_PB\nOUT TR0\nOUT Pump\nAND Guard\nOUT Lamp\nLD TR0\nANDNOT Guard\n"
            "OUT 100.03\n~ opens the hold",
            "",
        )),
        ("Interlocks", (
            "# nothing moves while the guard is open\nLD Guard\nIL(002)",
            "LD Pump\nTIM 0001 #0005",
            "LD TIM0001\nOUT Valve",
            "ILC(003)",
        )),
        ("Levels", (
            ("0|1|1|1|1|LD|P_On|1", "2|0|7|1|1|FBCALL|Dbl1|9", "1|2|8|1|1|FB_INPUT|D100|10", "4|2|8|1|1|FB_OUTPUT|D101|11",
             "1|1|3"),
            "",
        )),
        ("END", ("END(001)", "")),
    ),
)  # fmt: skip
"""Three sections and END: a temporary relay, an interlock with a timer, a block, rungs stored by name and by address."""


def line(file: Path) -> list[object]:
    """What a test of the line sees: pump, lamp, valve and level while it starts, is guarded, waits, stops."""
    rig, seen = Rig(subject([file], None)), []
    for given, wait in (({}, "20ms"), ({"Start_PB": True, "D100": 21}, "20ms"), ({"Start_PB": False, "Guard": True}, "400ms"),
                        ({}, "200ms"), ({"Guard": False}, "20ms"), ({"Stop_PB": True}, "20ms")):  # fmt: skip
        for name, value in given.items():
            rig[name] = value
        rig.run(wait)
        seen.append([int(rig[name]) for name in ("Pump", "Lamp", "100.03", "Valve", "D101")])
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["cxt", "cxp"])
def test_file_sources_run_test_change_difference_file(tmp_path: Path, ending: str) -> None:
    def fbvm(*words: object, status: int = 0) -> str:
        done = CliRunner().invoke(main, [str(word) for word in words])
        assert done.exit_code == status, (words, done.output)
        return done.output

    saved, made, folder = tmp_path / f"saved.{ending}", tmp_path / f"made.{ending}", tmp_path / "line"
    saved.write_bytes(compress(PLANT.bytes()) if ending == "cxp" else PLANT.bytes())
    behaviour = line(saved)
    assert behaviour == [
        [0, 0, 0, 0, 0], [1, 0, 1, 0, 42], [1, 1, 0, 0, 42], [1, 1, 0, 1, 42], [1, 0, 1, 0, 42], [0, 0, 0, 0, 42]]  # fmt: skip

    fbvm("import", saved, "-o", folder)
    assert fbvm("diff", saved, folder) == ""
    given = ("--set", "Start_PB=TRUE", "--set", "Guard=TRUE", "--for", "600ms", "--show", "Valve")
    ran = fbvm("run", *sorted(folder.iterdir()), *given)
    assert ran == "Valve = TRUE\n"

    fbvm("export", folder, "--into", saved, "-o", made)
    assert fbvm("diff", saved, made) == ""
    assert line(made) == behaviour
    text = decompress(made.read_bytes()) if ending == "cxp" else made.read_bytes()
    assert text == PLANT.bytes()

    program = folder / "NewProgram1.st"
    before = program.read_text(encoding="utf-8")
    after = before.replace("TIM     0001 #0005", "TIM     0001 #0030")
    assert after != before
    program.write_text(after, encoding="utf-8")
    assert "section Interlocks: 1 rung changed" in fbvm("export", folder, "--into", saved, "-o", made)
    text = decompress(made.read_bytes()) if ending == "cxp" else made.read_bytes()
    assert [row for row in difflib.ndiff(PLANT.text.split("\n"), text.decode("cp1252").split("\n")) if row[0] in "+-"] == [
        "- TIM 0001 #0005", "+ TIM 0001 #0030"]  # fmt: skip
    shown = fbvm("diff", saved, made, status=1)
    assert "section Interlocks: 1 rung changed" in shown
    assert fbvm("diff", "-q", saved, made, status=1) == ""
    assert [row[3] for row in line(made)] == [0] * 6
    assert fbvm("diff", made, folder) == ""
