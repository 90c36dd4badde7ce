"""The folders of fblib: each file named as its POU, each library described, its README's program running."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from mtcp_rig import SERVER
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Leave, ModbusPeer, Say
from fbvm.record.draw.chart import chart
from fbvm.units.etn21.unit import Etn21

FBLIB = data_folder("fblib")
FILES = sorted(FBLIB.rglob("*.st"))
BLOCKS = [path for path in FILES if "\nFUNCTION_BLOCK " in path.read_text(encoding="utf-8")]
LIBRARIES = sorted({path.parent for path in FILES})
MTCP = FBLIB / "omron" / "mtcp_etn"


def wrong_with(path: Path) -> list[str]:
    described = tomllib.loads((path.parent / "library.toml").read_text(encoding="utf-8"))
    text = path.read_text(encoding="utf-8")
    pous = re.findall(r"^(?:FUNCTION_BLOCK|FUNCTION|PROGRAM|TYPE) (\w+)", text, re.M)
    lists = (*described["globals"], *described.get("lists", ()))
    kept = {
        "it holds the POU that it is named after": pous == ([] if path.name in lists else [path.stem]),
        "it says what it is for": text.startswith("//"),
        "its lines are short": max(map(len, text.splitlines())) <= 120,
    }
    return [rule for rule, keeps in kept.items() if not keeps]


@pytest.mark.slow
def test_each_file_holds_one_pou_and_says_what_it_is_for() -> None:
    assert {path.name: wrong for path in FILES if (wrong := wrong_with(path))} == {}


@each_of("folder", LIBRARIES, ids=lambda path: path.name)
def test_a_library_is_described(folder: Path) -> None:
    described = tomllib.loads((folder / "library.toml").read_text(encoding="utf-8"))
    assert {"title", "sheet", "globals"} <= described.keys()
    files = {path.name for path in folder.glob("*.st") if re.search(r"^VAR_GLOBAL", path.read_text("utf-8"), re.MULTILINE)}
    assert {*described["globals"], *described.get("lists", ())} == files
    assert (folder / "README.md").is_file()


@pytest.mark.slow
@each_of("path", BLOCKS, ids=lambda path: path.stem)
def test_no_block_gives_a_message(path: Path) -> None:
    """Functions are checked with the blocks that use them."""
    made = compile_text(f"PROGRAM Main VAR b : {path.stem}; END_VAR b(); END_PROGRAM")
    assert [d for d in made.diagnostics if d.source.library] == []


@pytest.mark.slow
def test_the_program_and_the_charts_in_the_readme() -> None:
    readme = (MTCP / "README.md").read_text(encoding="utf-8")
    text = re.search(r"```\n(PROGRAM.*?)```", readme, re.S)
    first, lost = re.findall(r"```\n(CIO15.*?)```", readme, re.S)
    assert text is not None
    made = compile_text(text[1])
    assert made.image is not None
    plc, network = Plc(made.image), LoopNetwork()
    peer = ModbusPeer(reply=lambda frame: [Say(frame), Leave(200_000_000)])
    peer.server.holding_registers[1000] = 4711
    network.place(SERVER, peer)
    unit = Etn21(0, "192.168.250.1")
    plc.attach(unit, network)
    assert chart(plc, 10, signals(first, unit)) == first
    plc.run(until="D30009 = 5", max_ns=10**9)
    assert chart(plc, 8, signals(lost, unit)) == lost


def signals(drawn: str, unit: Etn21) -> list[tuple[str, str]]:
    """The signals of a chart, as the unit describes them."""
    names = [line.split()[0] for line in drawn.splitlines()]
    shown = [re.sub(r"^CIO", "CIO ", name) for name in names]
    return [(name, unit.descriptions.get(name, "")) for name in shown]


@pytest.mark.slow
def test_the_time_limits_may_be_set_by_a_declaration() -> None:
    made = compile_text(
        "PROGRAM Main VAR rd : MTCP_ETN_Fn03 := (Reply_Time := T#2s); "
        "conn : MTCP_ETN_Connect := (Open_Time := T#3s, Retry_Time := T#4s); END_VAR END_PROGRAM"
    )
    assert made.image is not None
    plc = Plc(made.image)
    names = ("Main.rd.Reply_Time", "Main.conn.Open_Time", "Main.conn.Retry_Time")
    assert [plc.read(name) for name in names] == [2 * 10**9, 3 * 10**9, 4 * 10**9]
