"""`fbvm run --trace`, `chart`, `table`, `why` and `convert`."""

from __future__ import annotations

import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from trace_rig import TEXT

from fbvm.cli.main import main

Fbvm = Callable[..., Result]


@pytest.fixture
def fbvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fbvm:
    """Runs the command in a folder with `pump.st`."""
    monkeypatch.chdir(tmp_path)
    Path("pump.st").write_text(TEXT, encoding="utf-8")
    return lambda *arguments: CliRunner().invoke(main, list(arguments))


def record(fbvm: Fbvm, *more: str) -> None:
    result = fbvm("run", "pump.st", "--scans", "60", "--set", "CIO 0.00=TRUE@30ms", "--trace", "run.fbtrace", *more)
    assert result.exit_code == 0, result.output


@pytest.mark.slow
def test_a_chart_of_a_trace(fbvm: Fbvm) -> None:
    record(fbvm)
    result = fbvm("chart", "run.fbtrace", "Main.Start,Main.Pump", "D200", "--scans", "2..12")
    assert result.output == (
        "            2       10\n"
        "Main.Start  .##########\n"
        "Main.Pump   ......#####\n"
        "D200        0     |7\n")  # fmt: skip


@pytest.mark.slow
def test_a_long_chart_is_wrapped_and_cut(fbvm: Fbvm) -> None:
    record(fbvm)
    assert "~" in fbvm("chart", "run.fbtrace", "Main.Pump").output
    assert fbvm("chart", "run.fbtrace", "Main.Pump", "--whole", "--width", "40").output.count("Main.Pump") == 3


@pytest.mark.slow
def test_a_page_and_a_picture_of_a_trace(fbvm: Fbvm) -> None:
    record(fbvm, "--depth", "statements")
    assert fbvm("convert", "run.fbtrace", "run.html").exit_code == 0
    assert "<title>run</title>" in Path("run.html").read_text(encoding="utf-8")
    assert fbvm("convert", "run.fbtrace", "run.svg", "Main.Pump,D200").exit_code == 0
    assert ">Main.Pump<" in Path("run.svg").read_text(encoding="utf-8")
    for target in ("run.html", "run.svg"):
        assert fbvm("convert", "run.fbtrace", target, "Main.Nobody").exit_code == 2
        assert fbvm("convert", "run.fbtrace", target, "--scans", "900..").exit_code == 2
    assert fbvm("convert", "run.fbtrace", "run.html", "--inside", "3..5", "--inside", "8").exit_code == 0
    refused = fbvm("convert", "run.fbtrace", "run.csv", "--inside", "3..5")
    assert refused.exit_code == 2 and "--inside is about pages" in refused.output


@pytest.mark.slow
def test_a_capture_of_a_trace(fbvm: Fbvm, tmp_path: Path) -> None:
    demo = str(Path(__file__).parents[3] / "examples" / "demo.st")
    assert fbvm("run", demo, "--until", "Main.Done", "--map", "192.168.250.1:502=peer", "--trace", "demo.fbtrace",
                "--pcap", "run.pcapng").exit_code == 0  # fmt: skip
    assert fbvm("convert", "demo.fbtrace", "trace.pcapng").exit_code == 0
    assert Path("trace.pcapng").read_bytes() == Path("run.pcapng").read_bytes()
    assert fbvm("convert", "demo.fbtrace", "trace.pcapng", "Main.Done").exit_code == 2


@pytest.mark.slow
def test_states_of_sockets_have_names(fbvm: Fbvm) -> None:
    demo = str(Path(__file__).parents[3] / "examples" / "demo.st")
    assert fbvm("run", demo, "--until", "Main.Done", "--map", "192.168.250.1:502=peer", "--trace", "demo.fbtrace").exit_code == 0
    assert "= CLOSED, SYN_SENT, ESTABLISHED   TCP Connection State" in fbvm("chart", "demo.fbtrace", "D30009").output
    assert fbvm("convert", "demo.fbtrace", "demo.csv", "D30009").exit_code == 0
    assert Path("demo.csv").read_text(encoding="utf-8").splitlines()[-1].endswith(",4")


@pytest.mark.slow
def test_a_run_as_a_page(fbvm: Fbvm) -> None:
    arguments = ("run", "pump.st", "--scans", "60", "--set", "CIO 0.00=TRUE@30ms")
    assert fbvm(*arguments, "--html", "run.html").exit_code == 0
    made = Path("run.html").read_text(encoding="utf-8")
    record(fbvm, "--depth", "statements")
    assert fbvm("convert", "run.fbtrace", "run.html").exit_code == 0
    assert Path("run.html").read_text(encoding="utf-8") == made
    assert fbvm(*arguments, "--html", "no/run.html").exit_code == 2


@pytest.mark.slow
def test_a_table_of_a_trace(fbvm: Fbvm) -> None:
    record(fbvm, "--depth", "writes")
    result = fbvm("table", "run.fbtrace", "CIO 0.00,Main.Pump")
    assert result.output == """\
scan 3   30ms   CIO0.00   Main.Pump
  inputs       >TRUE      FALSE
scan 8   80ms
  inputs        TRUE      FALSE
  pump.st:17             >TRUE
"""
    assert "pump.st:16" not in result.output
    assert fbvm("table", "run.fbtrace", "D300").exit_code == 1


@pytest.mark.slow
def test_a_table_of_a_long_trace_is_of_its_end(fbvm: Fbvm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.cli.recordings.table.MOST_SCANS", 40)
    record(fbvm)
    late = fbvm("table", "run.fbtrace", "Main.Start,Main.Pump")
    assert (late.exit_code, late.output) == (
        1, "only scans 20 to 59 were looked at; --scans FIRST..LAST looks at others\nnone of these changed\n")
    assert "scan 3 " in fbvm("table", "run.fbtrace", "Main.Start", "--scans", "..").output
    monkeypatch.setattr("fbvm.cli.recordings.table.MOST_SCANS", 60)
    assert fbvm("table", "run.fbtrace", "Main.Start").output.startswith("scan 3 ")


@pytest.mark.slow
def test_every_statement(fbvm: Fbvm) -> None:
    record(fbvm, "--depth", "statements")
    assert "pump.st:16" in fbvm("table", "run.fbtrace", "D200", "--scans", "8", "--every").output


@pytest.mark.slow
def test_why(fbvm: Fbvm) -> None:
    record(fbvm, "--depth", "statements")
    result = fbvm("why", "D200", "--scan", "41")
    assert result.exit_code == 0
    lines = result.output.splitlines()
    assert lines[0] == "D200 = 7 since scan 8 (80ms), by pump.st:19 in Main:  %D200 := 7;"
    assert lines[1] == "├ if Main.Pump = TRUE since scan 8 (80ms), by pump.st:17 in Main:  Pump := Delay.Q;"
    assert "by iec/TON.st:28 in Main.Delay:  Q := TRUE;" in lines[2]
    assert fbvm("why", "D200", "run.fbtrace", "--deep", "0").output == lines[0] + "\n"
    last, before = (fbvm("why", "Main.Both[2].b", "--deep", "0", *more).output for more in ([], ["--scan", "58"]))
    assert last.startswith("Main.Both[2].b = 30.0 since scan 59 (590ms), by pump.st:")
    assert before.startswith("Main.Both[2].b = 29.5 since scan 58 (580ms), by pump.st:")


@pytest.mark.slow
def test_stepping_through_a_trace(fbvm: Fbvm) -> None:
    record(fbvm)
    Path("pump.st").unlink()
    script = "back Main.Pump = FALSE\nexpect Main.Pump = FALSE\ngoto 4\nstep\nwhy Main.Start\nD200 := 3\n"
    result = CliRunner().invoke(main, ["step", "run.fbtrace", "--watch", "Main.Start"], input=script)
    assert result.exit_code == 2
    assert "> back Main.Pump = FALSE\nscan 8, 80ms: pump.st:" in result.output
    assert "  Main.Pump: TRUE -> FALSE\n" in result.output
    assert "Main.Start = TRUE since scan 3 (30ms), from outside the program" in result.output
    assert result.output.endswith("> D200 := 3\nthis is a recording: it can be looked at, not changed\n")


@pytest.mark.parametrize("arguments, said", [
    (["--cycle", "5ms"], "--cycle: a trace has happened already; beside it there are --plc, --library, --watch"),
    (["--plc", "nobody"], "choose a PLC with --plc NAME; the recording has pump"),
    (["--watch", "nobody"], "nobody"),
])  # fmt: skip
def test_what_stepping_through_a_trace_refuses(fbvm: Fbvm, arguments: list[str], said: str) -> None:
    record(fbvm)
    result = fbvm("step", "run.fbtrace", *arguments)
    assert (result.exit_code, said in result.output) == (2, True), result.output


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGTERM to react to")
def test_what_clients_of_a_server_did(fbvm: Fbvm) -> None:
    command = [sys.executable, "-m", "fbvm", "serve", "--port", "0", "--trace", "run.fbtrace"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            port = int(process.stdout.readline().rpartition(":")[2])
            with socket.create_connection(("127.0.0.1", port), timeout=30) as client:
                for value in (100, 200):
                    client.sendall(bytes.fromhex("0001 0000 0006 01 06 000A") + value.to_bytes(2, "big"))
                    assert len(client.recv(100)) == 12
        finally:
            process.terminate()
        assert process.wait(timeout=60) == 0
    assert re.search(r"ETN_Modbus_Write.st:18 +>200\n", fbvm("table", "run.fbtrace", "D10").output)
    assert "D10 = 200 since scan" in fbvm("why", "D10", "run.fbtrace").output


@pytest.mark.slow
def test_out_as_csv_and_in_again(fbvm: Fbvm) -> None:
    record(fbvm)
    assert fbvm("convert", "run.fbtrace", "run.csv", "Main.Pump,Main.Delay.ET", "--scans", "7..8").exit_code == 0
    assert Path("run.csv").read_text() == (
        "scan,time_ms,Main.Pump,Main.Delay.ET [ms]\n7,70,FALSE,40\n8,80,TRUE,50\n")  # fmt: skip
    assert fbvm("convert", "run.csv", "back.fbtrace").exit_code == 0
    assert "Main.Pump  .#" in fbvm("chart", "back.fbtrace", "Main.Pump").output


@pytest.mark.slow
def test_what_cannot_be_converted_leaves_files_as_they_were(fbvm: Fbvm) -> None:
    record(fbvm)
    Path("table.csv").write_text("a,b\n")
    for arguments, target in (("run.fbtrace old.csv Nothing", "old.csv"), ("run.fbtrace new.csv Nothing", "new.csv"),
                              ("table.csv old.fbtrace", "old.fbtrace"), ("table.csv new.fbtrace", "new.fbtrace")):
        if "old" in target:
            Path(target).write_text("old")
        assert fbvm("convert", *arguments.split()).exit_code == 2
        assert [path.read_text() for path in Path().glob(target)] == ["old"] * ("old" in target), target


@pytest.mark.slow
def test_out_as_vcd(fbvm: Fbvm) -> None:
    pytest.importorskip("vcd")
    record(fbvm)
    assert fbvm("convert", "run.fbtrace", "run.vcd").exit_code == 0
    assert "$scope module Delay $end" in Path("run.vcd").read_text()


@pytest.mark.slow
def test_vcd_without_its_package(fbvm: Fbvm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "vcd", None)
    record(fbvm)
    assert "pip install 'fbvm[vcd]'" in fbvm("convert", "run.fbtrace", "run.vcd").output
    assert not Path("run.vcd").exists()


@pytest.mark.slow
def test_only_what_is_selected(fbvm: Fbvm) -> None:
    record(fbvm, "--select", "Main.Delay", "--select", "*.CV")
    assert [line.split()[0] for line in fbvm("chart", "run.fbtrace").output.splitlines()[1:]] == [
        "Main.Delay.IN", "Main.Delay.Q", "Main.Delay.ET", "Main.Delay.Running", "Main.Delay.Start", "Main.Starts.CV",
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "said"), [
    ("chart pump.st", "this is no trace"),
    ("chart run.fbtrace Foo", "there is no Foo"),
    ("chart run.fbtrace Main.Both", "name its elements"),
    ("chart run.fbtrace --scans 900..", "the trace has scans 0 to 59"),
    ("chart run.fbtrace --scans 9..3", "has no scan in it"),
    ("chart run.fbtrace --scans x", "is not scans such as"),
    ("chart run.fbtrace --plc other", "choose a PLC with --plc NAME; the recording has pump"),
    ("table back.fbtrace D200", "values at scan ends only"),
    ("why D200 back.fbtrace", "does not hold what statements read"),
    ("convert run.fbtrace run.xyz", "what it shall be is not clear"),
    ("convert run.fbtrace none/run.csv", "cannot be written"),
    ("convert table.csv run.vcd", "a table becomes a trace"),
    ("convert table.csv run2.fbtrace", "line 1"),
    ("run pump.st --scans 1 --select D5", "--trace"),
    ("run pump.st --scans 1 --trace x.fbtrace --select Foo", "there is no Foo"),
    ("run pump.st --scans 1 --trace none/x.fbtrace", "cannot be written"),
])  # fmt: skip
def test_mistakes_of_usage(fbvm: Fbvm, arguments: str, said: str) -> None:
    record(fbvm)
    Path("table.csv").write_text("scan,time_ms,D200\n0,0,7\n")
    assert fbvm("convert", "table.csv", "back.fbtrace").exit_code == 0
    Path("table.csv").write_text("a,b\n")
    result = fbvm(*arguments.split())
    assert result.exit_code == 2, result.output
    assert said in result.output


@pytest.mark.slow
def test_why_wants_one_trace_and_one_place(fbvm: Fbvm) -> None:
    assert "there is none here" in fbvm("why", "D200").output
    record(fbvm, "--depth", "statements")
    Path("b.fbtrace").write_bytes(Path("run.fbtrace").read_bytes())
    assert "there are b.fbtrace, run.fbtrace" in fbvm("why", "D200").output
    assert "name one place" in fbvm("why", "D200..D201", "b.fbtrace").output
    assert "scan 99 is not in the trace" in fbvm("why", "D200", "b.fbtrace", "--scan", "99").output


@pytest.mark.slow
def test_what_the_guide_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    guide = (Path(__file__).parents[3] / "docs" / "howto" / "recording.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w+)\n(.*?)^```", guide, re.M | re.S)
    monkeypatch.chdir(tmp_path)
    Path("pump.st").write_text(next(text for kind, text in blocks if kind == "iecst"), encoding="utf-8")
    shown = next(text for kind, text in blocks if kind == "console" and "fbvm why" in text)
    for command, said in re.findall(r"^\$ fbvm (.*)\n((?:(?!\$ ).*\n)*)", shown, re.M):
        assert CliRunner().invoke(main, shlex.split(command)).output == said, command


@pytest.mark.slow
def test_what_rungs_remember_is_not_drawn_unasked(tmp_path: Path) -> None:
    program = tmp_path / "edge.st"
    rungs = "LD P_On\nTIM 1 #0001\nLD T0001\n@SET Over\n"
    program.write_text(f"PROGRAM Main\nVAR Over : BOOL; END_VAR\nLADDER\n{rungs}END_LADDER\nEND_PROGRAM\n", encoding="utf-8")
    trace = str(tmp_path / "edge.trace")
    assert CliRunner().invoke(main, ["run", str(program), "--scans", "20", "--trace", trace]).exit_code == 0
    drawn = CliRunner().invoke(main, ["chart", trace]).output
    assert "Main.Over  .........." in drawn and "$" not in drawn
