"""Everything that is drawn and written of one recorded run, word for word, beside `plant/`.  `FBVM_REWRITE=1 pytest` of this file
writes it anew: fbvm itself does, so look at the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main

HERE = Path(__file__).parent / "plant"
SET = [f"--set=Main.{each}" for each in ("Start=TRUE@30ms", "Start=FALSE@60ms", "Stop=TRUE@230ms")]
TRACE = "plant.fbtrace"


def check(name: str, text: str) -> None:
    path = HERE / name
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


def said(folder: Path, *arguments: str) -> str:
    """What a verb prints in a folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        done = CliRunner(env={"COLUMNS": "100"}).invoke(main, arguments)
    finally:
        os.chdir(before)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the plant and the trace of its run; the rungs and charts that the run has drawn are in `run.txt`."""
    made = tmp_path_factory.mktemp("plant")
    (made / "plant.st").write_bytes((HERE / "plant.st").read_bytes())
    output = said(made, "run", "plant.st", "--scans=30", *SET, f"--trace={TRACE}", "--ladder=3,9", "--sfc=2..7",
                  "--show=Main.pair,Main.text,D100..D110", "--chart=Main.Motor,Main.Speed")  # fmt: skip
    (made / "run.txt").write_text(output, encoding="utf-8")
    return made


VERBS = {
    "chart.txt": ("chart", TRACE, "--width=100"),
    "chart_whole.txt": ("chart", TRACE, "Main.level", "Main.text", "--whole", "--width=60"),
    "why_lit.txt": ("why", "Main.lamps[1].lit", TRACE), "why_level.txt": ("why", "Main.level", TRACE, "--scan=12", "--deep=3"),
    "table.txt": ("table", TRACE, "Main.Speed", "Main.mode", "Main.pair.a", "Main.Start", "--scans=0..8"),
    "table_every.txt": ("table", TRACE, "Main.Motor", "--every", "--scans=2..4"),
    "ladder.txt": ("ladder", "plant.st", "--comments", "--width=80"), "sfc.txt": ("sfc", "plant.st", "--width=80"),
}  # fmt: skip
FILES = {
    "plant.csv": ("convert", TRACE, "plant.csv"), "plant.vcd": ("convert", TRACE, "plant.vcd"),
    "plant.svg": ("convert", TRACE, "plant.svg", "Main.Motor", "Main.Speed", "Main.mode", "Main.level", "--scans=0..12"),
    "ladder.svg": ("ladder", "plant.st", "--svg=ladder.svg"), "sfc.svg": ("sfc", "plant.st", "--svg=sfc.svg"),
}  # fmt: skip


@pytest.mark.slow
def test_what_a_run_draws(folder: Path) -> None:
    check("run.txt", (folder / "run.txt").read_text(encoding="utf-8"))


@pytest.mark.slow
@each_of("name", VERBS)
def test_what_a_verb_prints(folder: Path, name: str) -> None:
    check(name, said(folder, *VERBS[name]))


@pytest.mark.slow
@each_of("name", FILES)
def test_what_a_verb_writes(folder: Path, name: str) -> None:
    said(folder, *FILES[name])
    check(name, (folder / name).read_text(encoding="utf-8"))
