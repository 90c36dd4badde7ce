"""The command line: what it prints, and the status with which it ends."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result
from rows import each_of

from fbvm.base.codes import CODES
from fbvm.cli.main import GROUP_OF, main
from fbvm.cli.running.demo import Comparison, command_name
from fbvm.cli.shared.debug.attach import open_attached
from fbvm.cli.shared.options import split_names
from fbvm.cli.shared.run_result import RunResult
from fbvm.code.compiler import compile_text
from fbvm.dap.target import LaunchError
from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import Chart
from fbvm.record.export.pcapng import Capture

HOUSE = Path(__file__).resolve().parents[3]
DEMO = str(HOUSE / "examples" / "demo.st")
COUNTER = """
TYPE Colour : (Red, Green); END_TYPE
PROGRAM Main
VAR
    n : INT;
    step : INT := 1;
    wait : TIME;
    r : REAL := 0.5;
    name : STRING := 'ab';
    colour : Colour;
    done : BOOL;
    divisor : INT := 1;
    list : ARRAY[1..2, 0..1] OF INT;
END_VAR
    n := n + step / divisor;
    done := n >= 5;
END_PROGRAM
"""


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return "counter.st"


def fbvm(*arguments: str) -> Result:
    result = CliRunner().invoke(main, arguments)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def run(*arguments: str) -> Result:
    return fbvm("run", "counter.st", *arguments)


def values(*arguments: str) -> dict[str, object]:
    result = run(*arguments, "--json")
    data: dict[str, object] = json.loads(result.stdout)
    return data


# --- run: how it ends -------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "stopped", "scans", "status"), [
    (["--scans", "7"], "scans", 7, 0),
    (["--for", "1s"], "time", 100, 0),
    (["--for", "T#95ms", "--cycle", "20ms"], "time", 5, 0),
    (["--until", "Main.done"], "until", 5, 0),
    (["--until", "Main.done", "--max", "1s"], "until", 5, 0),
    (["--until", "Main.n < 0", "--max", "50ms"], "max", 5, 1),
    (["--scans", "5", "--set", "Main.divisor=0@20ms"], "trap", 3, 4),
])
def test_a_run_ends(counter: str, arguments: list[str], stopped: str, scans: int, status: int) -> None:
    result = run(*arguments, "--json")
    data = json.loads(result.stdout)
    assert (data["stopped"], data["scans"], result.exit_code) == (stopped, scans, status)


def test_a_trap_names_its_place(counter: str) -> None:
    result = run("--scans", "1", "--set", "Main.divisor=0")
    assert "R0101 counter.st:15:" in result.stderr
    trap = values("--scans", "1", "--set", "Main.divisor=0")["trap"]
    assert isinstance(trap, dict)
    assert (trap["code"], trap["file"], trap["pou"], trap["line"]) == ("R0101", "counter.st", "Main", 15)


def test_json_values_are_what_they_are(counter: str) -> None:
    names = ["Main.n", "Main.wait", "Main.r", "Main.name", "Main.colour", "Main.done", "Main.list", "D5..D7"]
    names.append("CIO 5.00")
    data = values("--scans", "3", "--set", "Main.wait=1.5s", *[part for name in names for part in ("--show", name)])
    assert data == {
        "scans": 3, "time_ms": 30, "stopped": "scans", "trap": None,
        "values": {"Main.n": 3, "Main.wait": 1_500_000_000, "Main.r": 0.5, "Main.name": "ab", "Main.colour": 0,
                   "Main.done": False, "Main.list": [0, 0, 0, 0], "D5..D7": [0, 0, 0], "CIO 5.00": False},
    }  # fmt: skip


def test_times_below_a_millisecond_are_told(counter: str) -> None:
    assert values("--scans", "3", "--cycle", "500us")["time_ms"] == 1.5


def test_values_are_shown(counter: str) -> None:
    names = ["Main.n", "Main.wait", "Main.name", "Main.colour", "Main.done", "D5", "D5..D7", "Main.list"]
    result = run("--scans", "3", "--set", "D5=255", *[part for name in names for part in ("--show", name)])
    assert result.stdout == (
        "Main.n = 3\nMain.wait = T#0s\nMain.name = 'ab'\nMain.colour = Red (0)\nMain.done = FALSE\n"
        "D5 = 255 (16#00FF)\nD5..D7 = 255 0 0\nMain.list = [0, 0, 0, 0]\n"
    )


def test_values_are_shown_by_lists_too(counter: str) -> None:
    result = run("--scans", "3", "--show", "Main.n, Main.list[2,0],D5..D6", "--show", "Main.done")
    assert result.stdout == "Main.n = 3\nMain.list[2,0] = 0\nD5..D6 = 0 0\nMain.done = FALSE\n"


def test_what_is_declared_to_be_read_in_hexadecimal_is_shown_in_both_ways(counter: str) -> None:
    Path(counter).write_text(
        "PROGRAM Main VAR {attribute 'displaymode' := 'hex'} Code : UINT; END_VAR END_PROGRAM", encoding="utf-8"
    )
    assert run("--scans", "1", "--set", "Main.Code=129", "--show", "Main.Code").stdout == "Main.Code = 129 (16#0081)\n"


@pytest.mark.parametrize(("setting", "name", "value"), [
    ("Main.step=-2", "Main.n", -6),
    ("Main.step=10@20ms", "Main.n", 12),
    ("Main.step=10@25ms", "Main.n", 3),
    ("Main.name='a@b'", "Main.name", "a@b"),
    ("Main.name=x y@20ms", "Main.name", "x y"),
    ("Main.colour=Green", "Main.colour", 1),
    ("Main.list[2,0]=7", "Main.list", [0, 0, 7, 0]),
    ("D5..D7=1,16#10,3", "D5..D7", [1, 16, 3]),
    ("CIO 5.01=TRUE", "CIO 5", 2),
])
def test_a_setting_is_written_once_before_its_scan(counter: str, setting: str, name: str, value: object) -> None:
    data = values("--scans", "3", "--set", setting, "--show", name)
    assert data["values"] == {name: value}


def test_a_chart_is_drawn(counter: str) -> None:
    result = run("--scans", "7", "--chart", "Main.done,A200.11", "--chart", "Main.list[1,0]")
    assert Chart(result.stdout) == """
                         0
        Main.done        ....###
        A200.11          #......
        Main.list[1, 0]  0
    """


def test_a_chart_that_cannot_be_drawn_leaves_no_file(counter: str) -> None:
    result = run("--scans", "1", "--chart", "Main.list", "--trace", "wrong.fbtrace", "--html", "wrong.html")
    assert (result.exit_code, [*Path.cwd().glob("wrong.*")]) == (2, [])


@pytest.mark.slow
def test_quiet_in_a_pipe(counter: str) -> None:
    assert run("--scans", "5000").output == ""


# --- run: wrong usage -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("arguments", "message"), [
    ([], "say when to end by one of --scans, --for and --until; none given"),
    (["--scans", "1", "--for", "1s"], "one of --scans, --for and --until; 2 given"),
    (["--scans", "1", "--max", "1s"], "--max bounds --until, which is not given"),
    (["--for", "10"], "'10' is no time; write 10ms, 1.5s or T#1m30s"),
    (["--for", "0s"], "0s is not a time that can pass"),
    (["--scans", "-1"], "-1 is not in the range"),
    (["--until", "Main.n"], "is no condition"),
    (["--until", "Main.m > 1"], "Main has no m; it has n, step"),
    (["--scans", "1", "--set", "Main.n"], "'Main.n' is not NAME=VALUE"),
    (["--scans", "1", "--set", "Main.n=40000"], "Main.n: 40000 is out of range of INT, which holds -32768..32767"),
    (["--scans", "1", "--set", "Main.n=1@now"], "'now' is no time"),
    (["--scans", "1", "--set", "Main.wait=5"], "Main.wait is TIME and takes a time such as 10ms, not 5"),
    (["--scans", "1", "--set", "D5..D7=1"], "D5..D7 takes 3 values parted by commas, 1 given"),
    (["--scans", "1", "--show", "n"], "did you mean Main.n?"),
    (["--scans", "1", "--show", "D99999"], "D ends at 32767; 99999 does not exist"),
    (["--scans", "1", "--chart", "Main.list"], "which is no single value; name its elements, such as Main.list["),
    (["--scans", "1", "--map", "1.2.3.4:502"], "is not IP:PORT=HOST:PORT or IP:PORT=peer"),
    (["--scans", "1", "--map", "server:502=peer"], "'server' is no IPv4 address"),
    (["--scans", "1", "--map", "1.2.3.4:502=host"], "'host' is not an address and a port"),
    (["--scans", "1", "--map", "1.2.3.4:502=localhost:1502"], "leaves memory: add --net tcp"),
    (["--scans", "1", "--net", "tcp", "--map", "1.2.3.4:502=peer"], "is in memory: leave out --net tcp"),
    (["--scans", "1", "--pace", "event"], "--pace event is for real time"),
    (["--scans", "1", "--pcap", "no/such/folder.pcapng"], "cannot be written"),
])
def test_wrong_usage_is_said_in_a_sentence(counter: str, arguments: list[str], message: str) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


def test_what_json_has_no_number_for_is_text(counter: str) -> None:
    Path("wild.st").write_text("PROGRAM Main\nVAR a, z : REAL; l : LREAL; END_VAR\na := -1.0 / z;\nl := z / z;\nEND_PROGRAM\n",
                               encoding="utf-8")
    told = fbvm("run", "wild.st", "--scans", "1", "--json", "--show", "Main.a", "--show", "Main.l").stdout
    assert "NaN" not in told and json.loads(told)["values"] == {"Main.a": "-inf", "Main.l": "nan"}


@pytest.mark.slow
def test_tests_that_cannot_be_collected_have_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("test_a.py").write_text("def test_a(:\n", encoding="utf-8")
    assert fbvm("test", "-q", "-p", "no:cacheprovider").exit_code == 1


@pytest.mark.slow
def test_what_cannot_be_written_is_said_alike_by_every_verb(counter: str) -> None:
    chart = "PROGRAM Main\nINITIAL_STEP A: END_STEP\nTRANSITION FROM A TO A := TRUE; END_TRANSITION\nEND_PROGRAM\n"
    Path("chart.st").write_text(chart, encoding="utf-8")
    for arguments in (
        ["ladder", counter, "--svg", "none/x"], ["sfc", "chart.st", "--svg", "none/x"], ["export", counter, "-o", "none/x"],
        ["run", counter, "--scans", "1", "--journal", "none/x"], ["run", counter, "--scans", "1", "--html", "none/x"],
        ["run", counter, "--scans", "1", "--trace", "none/x"], ["new", f"{counter}/x"],
    ):
        result = fbvm(*arguments)
        assert result.exit_code == 2, arguments
        assert f"{arguments[-1]} cannot be written: no" in result.stderr, arguments


def test_a_network_that_cannot_be_is_status_5(counter: str) -> None:
    result = run("--scans", "1", "--net", "tcp", "--map", "1.2.3.4:502=no.such.host.invalid:502")
    assert result.exit_code == 5
    assert "the network cannot be used" in result.stderr


def test_which_of_several_programs(counter: str) -> None:
    text = "".join(f"PROGRAM {name}\nVAR x : INT; END_VAR\n x := {n};\nEND_PROGRAM\n" for n, name in enumerate("AB"))
    Path("two.st").write_text(text, encoding="utf-8")
    result = fbvm("run", "two.st", "--scans", "1")
    assert (result.exit_code, "--program" in result.stderr) == (3, True)
    assert fbvm("run", "two.st", "--program", "B", "--scans", "1", "--show", "B.x").stdout == "B.x = 1\n"


# --- run: networks ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_example_runs_against_a_peer_in_memory(tmp_path: Path) -> None:
    capture = tmp_path / "demo.pcapng"
    result = fbvm("run", DEMO, "--until", "Main.Done", "--max", "5s", "--map", "192.168.250.1:502=peer", "--json",
                  "--show", "D200..D209", "--show", "Main.Connection.ENO", "--pcap", str(capture))  # fmt: skip
    data = json.loads(result.stdout)
    assert (result.exit_code, data["stopped"]) == (0, "until")
    assert data["values"] == {"D200..D209": list(range(1000, 1010)), "Main.Connection.ENO": True}
    assert capture.read_bytes()[:4] == b"\x0a\x0d\x0d\x0a"


@pytest.mark.slow
def test_without_a_server_the_example_goes_on_trying() -> None:
    result = fbvm("run", DEMO, "--until", "Main.Done", "--max", "3s", "--json", "--show", "Main.Connection.Error_Code")
    data = json.loads(result.stdout)
    assert (result.exit_code, data["stopped"]) == (1, "max")
    assert data["values"]["Main.Connection.Error_Code"] != 0


# --- check, list, explain ---------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_check_is_silent_when_nothing_is_wrong() -> None:
    result = fbvm("check", DEMO)
    assert (result.exit_code, result.output) == (0, "")
    assert json.loads(fbvm("check", DEMO, "--json").stdout) == {"diagnostics": []}


def test_check_warns_and_run_does_not(counter: str) -> None:
    result = fbvm("check", counter)
    assert result.exit_code == 0 and "warning S0290: wait is never used" in result.stderr
    assert result.stderr.endswith("5 warnings; `fbvm explain CODE` says more about each\n")
    assert run("--scans", "1").stderr == fbvm("list", counter).stderr == ""


def test_warnings_that_are_not_wanted(counter: str) -> None:
    assert fbvm("check", counter, "--no-warn", "s0290").output == ""
    assert fbvm("check", counter, "--no-warn", "S0390,S0290").output == ""
    assert fbvm("check", counter, "--no-warn", "S0390", "--no-warn", "all").output == ""
    wrong = fbvm("check", counter, "--no-warn", "S0201")
    assert wrong.exit_code == 2 and "S0201 is no code of a warning; there are S0190, S0191" in wrong.stderr


def test_warnings_as_errors(counter: str) -> None:
    result = fbvm("check", counter, "--warnings-as-errors")
    assert result.exit_code == 3 and "error S0290: wait is never used" in result.stderr and "5 errors;" in result.stderr
    data = json.loads(fbvm("check", counter, "--warnings-as-errors", "--json").stdout)
    assert {row["severity"] for row in data["diagnostics"]} == {"error"}
    assert fbvm("check", counter, "--warnings-as-errors", "--no-warn", "S0290").exit_code == 0


def test_check_says_what_is_wrong(counter: str) -> None:
    Path("wrong.st").write_text("PROGRAM Main\nVAR n : INT; END_VAR\n    n := m;\nEND_PROGRAM\n", encoding="utf-8")
    result = fbvm("check", "wrong.st")
    assert result.exit_code == 3
    assert "wrong.st:3:10: error S0201" in result.stderr
    assert "^" in result.stderr
    assert "1 error;" in result.stderr
    rows = json.loads(fbvm("check", "wrong.st", "--json").stdout)["diagnostics"]
    assert [(row["code"], row["line"], row["column"]) for row in rows] == [("S0201", 3, 10)]
    assert fbvm("run", "wrong.st", "--scans", "1").exit_code == 3
    assert json.loads(fbvm("run", "wrong.st", "--scans", "1", "--json").stdout)["diagnostics"][0]["code"] == "S0201"


def test_a_missing_file_is_wrong_usage() -> None:
    result = fbvm("check", "no_such_file.st")
    assert (result.exit_code, "does not exist" in result.stderr) == (2, True)


def test_a_file_that_is_no_text_is_said(counter: str) -> None:
    Path("junk.st").write_bytes(bytes(range(256)) * 4)
    assert fbvm("check", "junk.st").exit_code == 3


def test_own_libraries_are_found(counter: str) -> None:
    Path("own/tools").mkdir(parents=True)
    Path("own/tools/Twice.st").write_text(
        "FUNCTION Twice : INT\nVAR_INPUT x : INT; END_VAR\n Twice := 2 * x;\nEND_FUNCTION\n", encoding="utf-8")
    Path("user.st").write_text("PROGRAM Main\nVAR n : INT; END_VAR\n n := Twice(21);\nEND_PROGRAM\n", encoding="utf-8")
    assert fbvm("run", "user.st", "--scans", "1").exit_code == 3
    result = fbvm("run", "user.st", "--scans", "1", "--library", "own", "--show", "Main.n")
    assert (result.exit_code, result.stdout) == (0, "Main.n = 42\n")


def test_what_is_no_folder_of_libraries_is_told_what_makes_one(counter: str) -> None:
    Path("own").mkdir()
    Path("own/BASIC.lib").write_bytes(b"CoDeSys+")
    for given, said in (
        ("own", "there is no library in 'own': it holds no .st and no library.toml; `fbvm import FILE -o DIR` makes"),
        ("own/BASIC.lib", "'own/BASIC.lib' is a file, and libraries are folders; name it among the sources, or make a folder of "
         "it by `fbvm import own/BASIC.lib -o DIR`"),
        (counter, "'counter.st' is a file, and libraries are folders; name it among the sources, or give its folder"),
        ("owm", "Directory 'owm' does not exist; did you mean own?"),
    ):  # fmt: skip
        result = fbvm("check", counter, "--library", given)
        assert result.exit_code == 2 and said in " ".join(result.stderr.split()), given


def test_list_prints_the_image(counter: str) -> None:
    result = fbvm("list", counter)
    assert result.exit_code == 0
    assert "Main" in result.stdout
    assert "store" in result.stdout


def test_explain_lists_all_codes() -> None:
    lines = fbvm("explain").stdout.splitlines()
    assert [line[:5] for line in lines] == list(CODES)


def test_explain_of_no_code_is_wrong_usage() -> None:
    result = fbvm("explain", "S0999")
    assert (result.exit_code, "there is no diagnostic S0999" in result.stderr) == (2, True)
    assert "`fbvm explain` alone lists all" in fbvm("explain", "X").stderr


def test_explain_shows_blocks_and_functions_with_their_pins() -> None:
    shown = fbvm("explain", "ton").stdout
    assert shown.startswith("# TON\n\nOn-delay: Q follows IN")
    assert "    PT : TIME;\nEND_VAR\nVAR_OUTPUT\n" in shown and "Running" not in shown
    assert "FUNCTION DAY_OF_WEEK : USINT" in fbvm("explain", "DAY_OF_WEEK").stdout
    assert "CONTROL : ANY;" in fbvm("explain", "MBP_MSTR").stdout
    assert fbvm("explain", "PVOID").exit_code == 2


def test_explain_prints_the_page() -> None:
    assert "S0201" in fbvm("explain", "s0201").stdout


# --- the command itself -----------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("verb", GROUP_OF)
def test_every_verb_has_help(verb: str) -> None:
    result = fbvm(verb, "--help")
    assert result.exit_code == 0
    assert result.stdout.startswith(f"Usage: main {verb}")


def test_help_names_every_verb() -> None:
    output = fbvm("--help").stdout
    assert set(re.findall(r"^  (\w+)  +\w", output, re.MULTILINE)) == set(GROUP_OF)


def test_an_unknown_verb_is_wrong_usage() -> None:
    assert fbvm("fly").exit_code == 2


@each_of(("text", "names"), [
    ("Main.a,D5", ["Main.a", "D5"]), ("a[1,2], b", ["a[1,2]", "b"]), ("", []), (",x,", ["x"]),
])  # fmt: skip
def test_names_are_parted_outside_brackets(text: str, names: list[str]) -> None:
    assert split_names(text) == names


# --- run: what is said of options that do nothing -----------------------------------------------------------------------


def test_a_write_before_power_on_is_refused(counter: str) -> None:
    result = run("--scans", "1", "--set", "Main.n=1@-5ms")
    assert result.exit_code == 2
    assert "nothing is before power-on" in result.stderr


def test_a_write_that_was_never_reached_is_told(counter: str) -> None:
    result = run("--scans", "3", "--set", "Main.n=1@20ms", "--set", "Main.n=7@30ms")
    assert result.exit_code == 0
    assert result.stderr.splitlines() == ["--set Main.n=7@30ms was never written: the run ended before"]


def test_a_task_that_wants_to_be_quicker_than_the_cycle_is_told(counter: str) -> None:
    Path("tasks.st").write_text(COUNTER + """
CONFIGURATION C
    TASK Fast (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM P WITH Fast : Main;
END_CONFIGURATION
""", encoding="utf-8")
    slow = fbvm("run", "tasks.st", "--scans", "1", "--cycle", "20ms")
    assert slow.stderr.startswith("task Fast wants 10ms, the PLC scans every 20ms: ")
    assert fbvm("run", "tasks.st", "--scans", "1").stderr == ""


@pytest.mark.parametrize(("option", "said"), [
    (["--chart", ""], "Invalid value for '--chart': it is empty"),
    (["--chart", "Main.n", "--chart", " , "], "--chart names nothing to draw")])
def test_a_chart_of_nothing_is_refused(counter: str, option: list[str], said: str) -> None:
    result = run("--scans", "1", *option)
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize(("setting", "shown", "text"), [
    ("Main.list=[1,2,3,4]", "Main.list", "[1, 2, 3, 4]"),
    ("Main.list=1,2,3,4", "Main.list[2, 1]", "4"),
    ("D5..D6=[7, 8]", "D5..D6", "7 8"),
    ("Main.colour=Colour.Green", "Main.colour", "Green (1)"),
    ("CIO 1.00=ON", "CIO 1.00", "TRUE"),
    ("D 10=5", "D 10", "5 (16#0005)"),
    ("E3_100=9", "E3 : 100", "9 (16#0009)"),
])
def test_what_is_set_is_shown(counter: str, setting: str, shown: str, text: str) -> None:
    result = run("--scans", "1", "--set", setting, "--show", shown)
    assert (result.stdout, result.stderr) == (f"{shown} = {text}\n", "")


def test_e_banks_that_only_options_name_are_there(counter: str) -> None:
    result = run("--until", "E2_5 = 3 AND E0:1 = 0", "--set", "E2_5=3@10ms", "--max", "1s", "--chart", "EC_0,E2_5")
    assert (result.exit_code, result.stderr) == (0, "")
    assert Chart(result.stdout.partition("\n")[2]) == """
        EC_0  0
        E2_5  0|3
    """


def test_a_journal_knows_the_banks_of_its_options(counter: str) -> None:
    run("--scans", "3", "--set", "E2_5=3@10ms", "--journal", "run.journal")
    result = fbvm("replay", "run.journal", "--show", "E2_5")
    assert (result.stdout, result.exit_code) == ("E2_5 = 3 (16#0003)\n", 0)


@pytest.mark.parametrize("text", ["Main.n = 'a'", "Main.n = 40000", "Main.wait > 10", "Main.n / 0 = 1"])
def test_what_never_holds_ends_before_the_first_scan(counter: str, text: str) -> None:
    assert run("--until", text, "--max", "1s").exit_code == 2


# --- run: how values are shown ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["0.1", "5.001221", "16777216.0", "1e-20", "-0.3333333"])
def test_a_real_is_shown_as_the_shortest_text_that_is_read_as_it(counter: str, text: str) -> None:
    setting = ("--set", f"Main.r={text}")
    assert run("--scans", "1", *setting, "--show", "Main.r").stdout == f"Main.r = {text}\n"
    assert values("--scans", "1", *setting, "--show", "Main.r")["values"] == {"Main.r": float(text)}
    assert run("--scans", "1", *setting, "--chart", "Main.r").stdout.splitlines()[1].split() == ["Main.r", text]


def test_of_an_instance_the_pins_come_first_and_no_constants(counter: str) -> None:
    Path("block.st").write_text("""
FUNCTION_BLOCK Half
VAR CONSTANT Two : INT := 2; END_VAR
VAR seen : INT; END_VAR
VAR_OUTPUT Y : REAL; END_VAR
VAR_INPUT X : REAL; END_VAR
    Y := X / 2.0;
    seen := seen + Two;
END_FUNCTION_BLOCK
PROGRAM Main VAR h : Half; END_VAR
    h(X := 0.2);
END_PROGRAM
""", encoding="utf-8")
    result = fbvm("run", "block.st", "--scans", "1", "--show", "Main.h")
    assert result.stdout == "Main.h = (X := 0.2, Y := 0.1, seen := 2)\n"


# --- what was meant -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "meant"), [
    ("T5.Q", "TF5"), ("C5.Q", "CNF5"), ("EM1_5", "E1_5"), ("EM 1:5", "E1_5"), ("HR0", "H0"), ("WR3.05", "W3.05"),
    ("TIM5", "T5"), ("IR100.01", "CIO 100.01"),
])
def test_an_address_of_another_spelling_is_offered_in_the_right_one(counter: str, text: str, meant: str) -> None:
    result = run("--scans", "1", "--show", text)
    assert result.exit_code == 2
    assert f"there is no {text}; did you mean {meant}" in result.stderr


def test_list_writes_bits_and_tasks_as_everybody_does(counter: str) -> None:
    Path("bits.st").write_text("""PROGRAM Main
VAR Start AT CIO 0.00 : BOOL; Pump AT CIO 100.10 : BOOL; Lamp AT %QX1.3 : BOOL; END_VAR
    Pump := Start AND Lamp;
END_PROGRAM
""", encoding="utf-8")
    lines = fbvm("list", "bits.st").stdout.splitlines()
    assert "task      no task: every cycle" in lines
    assert "symbol    CIO 0.00     Main.Start : BOOL" in lines
    assert "symbol    CIO 100.10   Main.Pump : BOOL" in lines
    assert "symbol    %QX1.3       Main.Lamp : BOOL" in lines


def test_a_row_of_the_map_that_nobody_used_is_told(counter: str) -> None:
    rows = [part for row in ("1.2.3.4:502=127.0.0.1:9", "192.168.250.21:502=127.0.0.1:0") for part in ("--map", row)]
    result = run("--scans", "1", "--net", "tcp", *rows)
    told = [line for line in result.stderr.splitlines() if "nobody" in line]
    assert told == ["--map 1.2.3.4:502: nobody used it; ETN21 0 has 192.168.250.21"]


def test_a_host_that_is_not_known_is_named(counter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(host: str) -> str:
        raise OSError(2, "Name or service not known")

    monkeypatch.setattr("fbvm.net.tcp.socket.gethostbyname", unknown)
    result = run("--scans", "1", "--net", "tcp", "--map", "1.2.3.4:502=nohost:502")
    assert (result.exit_code, result.stderr) == (
        5, "the network cannot be used: nohost: Name or service not known\n")


@pytest.mark.parametrize(("found", "argument", "called_so"), [
    ("/usr/bin/fbvm", "/usr/bin/fbvm", "fbvm"),
    (None, ".venv/bin/fbvm", ".venv/bin/fbvm"),
    (None, "{here}/.venv/bin/fbvm", ".venv/bin/fbvm"),
    (None, "fbvm/__main__.py", f"{sys.executable} -m fbvm"),
], ids=["installed", "relative", "absolute", "module"])
def test_the_demo_names_the_command_as_it_can_be_called(
    found: str | None, argument: str, called_so: str, counter: str, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("fbvm.cli.running.demo.shutil.which", lambda name: found)
    monkeypatch.setattr(sys, "argv", [argument.format(here=Path.cwd())])
    assert command_name() == called_so


@pytest.mark.slow
def test_a_capture_is_flushed_while_a_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever opens it before the end sees what has been sent."""
    path = tmp_path / "run.pcapng"
    seen: list[int] = []

    def flush(capture: Capture, original: Callable[[Capture], None] = Capture.flush) -> None:
        original(capture)
        seen.append(path.stat().st_size)

    monkeypatch.setattr(Capture, "flush", flush)
    monkeypatch.setattr("fbvm.run.loop.PROGRESS_NS", 0)
    assert fbvm("run", str(DEMO), "--map", "192.168.250.1:502=peer", "--scans", "60", "--pcap", str(path)).exit_code == 0
    assert any(0 < size < path.stat().st_size for size in seen)


@pytest.mark.slow
def test_a_run_that_shows_nothing_says_what_ran(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal only: scripts get what they asked for."""
    made = compile_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").image
    assert made is not None
    plc = Plc(made)
    result = RunResult(plc, plc.run(scans=1500), {}, None, False, "")
    result.print()
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    result.print()
    assert click.unstyle(capsys.readouterr().err) == "1,500 scans in 15s, ended by scans\n"
    RunResult(plc, "scans", {"Main.n": plc.find("Main.n")}, None, False, "").print()
    assert click.unstyle(capsys.readouterr().out) == "Main.n = 1500\n"


def test_words_that_are_not_there_are_not_equal() -> None:
    found = [Comparison("", [], words, 0, registers).equal for words, registers in (([1], [1]), ([1], [2]), ([], []))]
    assert found == [True, False, False]


def test_an_editor_that_names_no_plc_of_the_run_is_told_those_there_are() -> None:
    debugged: Any = [SimpleNamespace(name="pump", plc=None), SimpleNamespace(name="mix", plc=None)]
    with pytest.raises(LaunchError, match="there is no PLC tank; there is pump, mix"):
        open_attached(debugged, {}, {}, {"plc": "tank"})


@pytest.mark.slow
def test_a_page_in_memory_has_no_doors_to_the_host(tmp_path: Path) -> None:
    (tmp_path / "a.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM", encoding="utf-8")
    for more in (("--door", "192.168.250.2:502=127.0.0.1:0"), ("--map", "192.168.250.1:502=127.0.0.1:1502")):
        result = CliRunner().invoke(main, ["live", str(tmp_path / "a.st"), "--net", "loop", *more])
        assert (result.exit_code, "leave memory: add --net tcp" in result.stderr) == (2, True), result.stderr
