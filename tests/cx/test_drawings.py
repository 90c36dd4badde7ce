"""What an electrician knows, beside the rungs: names, addresses and comments."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from cx_text import SAMPLE

from fbvm.cli.main import main


def drawn(tmp_path: Path, old: bytes = b"", new: bytes = b"") -> list[str]:
    file = tmp_path / "line.cxt"
    file.write_bytes(SAMPLE.bytes().replace(old, new))
    done = CliRunner().invoke(main, ["ladder", str(file), "--comments"])
    assert done.exit_code == 0, done.output
    return [" ".join(line.split()) for line in done.output.splitlines()]


@pytest.mark.slow
def test_names_addresses_and_comments_stand_below_the_rung(tmp_path: Path) -> None:
    lines = drawn(tmp_path)
    at = lines.index("RUNG 0 self hold")
    assert [line for line in lines[at:] if line and line[0] not in "│├"][:6] == [
        "RUNG 0 self hold", "Start_PB 0.00 start button", 'Pump 100.00 pump of the 2" line',
        "Stop_PB 0.01 stop button, normally open", "RUNG 1", "D100 raw level"]  # fmt: skip
    assert "X raw value" in lines


def test_a_rung_that_was_stored_by_address_shows_the_symbol(tmp_path: Path) -> None:
    lines = drawn(tmp_path, b"LD Start_PB", b"LD 0.00")
    assert "││ Start_PB │ 0.01 100.00 │" in lines
    assert "Start_PB 0.00 start button" in lines


@pytest.mark.slow
def test_sections_and_the_other_names_of_operands_are_drawn(tmp_path: Path) -> None:
    file = tmp_path / "line.cxt"
    file.write_bytes(SAMPLE.bytes().replace(b",D100,CHANNEL", b"Level,D100,CHANNEL")
                     .replace(b"LD Start_PB\n", b"LD Start_PB\nAND=(300) D100 &5\nTIM 0003 D100\nLD TIM0003\n"))  # fmt: skip
    done = CliRunner().invoke(main, ["ladder", str(file)])
    assert done.exit_code == 0, done.output
    lines = [" ".join(line.split()) for line in done.output.splitlines()]
    at = lines.index("PROGRAM NewProgram1")
    assert lines[at + 1 : at + 3] == ["SECTION Pumping", "RUNG 0 self hold"]
    assert "SECTION END" in lines[at:]
    assert any("│ D100 (Level) │" in line for line in lines)
    compared = next(number for number, line in enumerate(lines) if "D100 &5" in line)
    assert "Level" in lines[compared + 2], "below the comparison"
    assert "CX_" not in done.output, "names of the library are not the electrician's"


@pytest.mark.slow
def test_executed_rungs_are_drawn_with_their_sections_and_right_rails_in_one_column(tmp_path: Path) -> None:
    file = tmp_path / "line.cxt"
    file.write_bytes(SAMPLE.bytes())
    done = CliRunner().invoke(main, ["run", str(file), "--set", "Start_PB=TRUE", "--scans", "2", "--ladder", "1"])
    assert done.exit_code == 0, done.output
    _, _, shown = done.output.partition("scan 1, NewProgram1\n")
    assert shown.startswith("SECTION Pumping\nRUNG 0 self hold\n")
    rungs = [line for line in shown.partition("scan 1, Dbl1")[0].splitlines() if line[:1] in "┃┣┠"]
    assert {len(line) for line in rungs if line} == {len(rungs[0])}


@pytest.mark.slow
def test_a_picture_has_its_right_rails_in_one_column(tmp_path: Path) -> None:
    file, picture = tmp_path / "line.cxt", tmp_path / "line.svg"
    file.write_bytes(SAMPLE.bytes())
    done = CliRunner().invoke(main, ["ladder", str(file), "--svg", str(picture)])
    assert done.exit_code == 0, done.output
    wires = re.findall(r'<path d="([^"]+)"', picture.read_text(encoding="utf-8"))
    rails = [max(float(x) for x in re.findall(r"[ML]([\d.]+) ", wire)) for wire in wires]
    assert len(rails) >= 3
    assert len(set(rails)) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("step", "shown"), [("TIM 0001 #0030", "0001 = #0027"), ("TIMX(550) 0001 &30", "0001 = 27")])
def test_executed_rungs_show_present_values_and_what_blocks_gave(tmp_path: Path, step: str, shown: str) -> None:
    file = tmp_path / "line.cxt"
    file.write_bytes(SAMPLE.bytes().replace(b"OUT Pump\n", f"OUT Pump\n{step}\n".encode()))
    done = CliRunner().invoke(main, ["run", str(file), "--set", "Start_PB=TRUE", "--set", "D100=21", "--scans", "32",
                                     "--ladder", "31"])  # fmt: skip
    assert done.exit_code == 0, done.output
    assert f"│ {shown} " in done.output
    assert "├─D101 = 42" in done.output


DELAYS = """FUNCTION_BLOCK Delay
VAR_INPUT Go : BOOL; END_VAR
LADDER
Pause,,TIMER,,,,"";
LD Go
TIM Pause #0005
END_LADDER
END_FUNCTION_BLOCK
PROGRAM Main
LADDER
LD P_On
FBCALL Delay A Go:=0.00
LD P_On
FBCALL Delay B Go:=0.01
END_LADDER
END_PROGRAM"""


@pytest.mark.slow
def test_a_timer_of_each_instance_shows_its_own_present_value(tmp_path: Path) -> None:
    file = tmp_path / "delays.st"
    file.write_text(DELAYS, encoding="utf-8")
    done = CliRunner().invoke(main, ["run", str(file), "--set", "0.00=TRUE", "--set", "0.01=TRUE@300ms", "--scans", "36",
                                     "--ladder", "35"])  # fmt: skip
    assert done.exit_code == 0, done.output
    first, _, second = done.output.partition("scan 35, Main.B\n")
    assert "│ Pause = #0002 │" in first
    assert "│ Pause = #0005 │" in second
