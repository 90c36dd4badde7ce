"""`fbvm prove`: verdicts, charts, recordings, tests, and exit statuses."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner, Result
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.cli.main import main
from fbvm.cli.programs import prove, prove_tests
from fbvm.cli.programs.prove import command
from fbvm.code.compiler import compile_text
from fbvm.code.image import Site
from fbvm.prove import solver
from fbvm.prove.cover import Covered, Reaching, Spot
from fbvm.prove.prover import Limits
from fbvm.testing.plugin import RigMaker

INTERLOCK = str(data_folder("examples") / "classics" / "interlock.st")
DIVIDES = "PROGRAM Main\nVAR a AT %IW0 : INT; b : INT; END_VAR\n    b := 100 / a;\nEND_PROGRAM\n"


def proved(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["prove", *arguments])


@pytest.mark.slow
def test_a_proof_has_status_0_and_says_how() -> None:
    result = proved(INTERLOCK, "--never", "Main.Left AND Main.Right")
    assert (result.exit_code, result.stdout) == (0, "never Main.Left AND Main.Right: PROVED by induction over 1 scan\n")


def test_a_broken_property_has_status_1_and_a_chart() -> None:
    result = proved(INTERLOCK, "--never", "Main.Left")
    assert result.exit_code == 1
    assert result.stdout.splitlines() == [
        "never Main.Left: BROKEN after 1 scan, by the shortest run", "               0", "Main.Backward  #", "Main.Left      #"]


def test_json_has_the_inputs_scan_by_scan() -> None:
    result = proved(INTERLOCK, "--never", "Main.Left", "--json")
    [found] = json.loads(result.stdout)["properties"]
    assert (result.exit_code, found["verdict"], found["run"]["writes"]) == (
        1, "broken", [{"scan": 0, "values": {"Main.Backward": True}}])


@pytest.mark.slow
def test_the_test_that_is_written_fails_until_the_program_keeps_the_property(tmp_path: Path) -> None:
    program, test = tmp_path / "program.st", tmp_path / "test_found.py"
    program.write_text(DIVIDES, encoding="utf-8")
    assert proved(str(program), "--no-trap", "--test", str(test)).exit_code == 1
    found = runpy.run_path(str(test))["test_no_trap"]
    with pytest.raises(AssertionError):
        found()
    program.write_text(DIVIDES.replace("100 / a", "100 + a"), encoding="utf-8")
    found()
    assert proved(str(program), "--no-trap").exit_code == 0


@pytest.mark.slow
def test_an_answer_that_comes_too_late_is_written_as_a_test(tmp_path: Path) -> None:
    program, test = tmp_path / "program.st", tmp_path / "test_late.py"
    text = "PROGRAM Main\nVAR In AT %IX0.0 : BOOL; t : TON; END_VAR\n    t(IN := In, PT := T#50ms);\nEND_PROGRAM\n"
    program.write_text(text, encoding="utf-8")
    result = proved(str(program), "--within", "Main.In", "Main.t.Q", "30ms", "--test", str(test))
    assert (result.exit_code, result.stdout.splitlines()[0]) == (
        1, "Main.t.Q within 30ms of Main.In: BROKEN after 4 scans, by the shortest run")
    late = runpy.run_path(str(test))["test_main_t_q_within_30ms_of_main_in"]
    with pytest.raises(AssertionError):
        late()
    program.write_text(text.replace("50ms", "20ms"), encoding="utf-8")
    late()


@pytest.mark.slow
def test_an_output_that_two_statements_write_is_shown_and_written_as_a_test(tmp_path: Path) -> None:
    program, test = tmp_path / "program.st", tmp_path / "test_double.py"
    text = "PROGRAM Main\nVAR In AT %IX0.0 : BOOL; Q AT %QX0.0 : BOOL; END_VAR\n" \
           "    Q := FALSE;\n    IF In THEN Q := TRUE; END_IF\nEND_PROGRAM\n"
    program.write_text(text, encoding="utf-8")
    result = proved(str(program), "--written-once", "Main.Q, Main.In", "--test", str(test))
    first, *_, last, other, note = result.stdout.splitlines()
    assert (result.exit_code, first, other) == (1, "written once Main.Q: BROKEN after 1 scan, by the shortest run",
                                                "written once Main.In: PROVED by induction over 1 scan")  # fmt: skip
    assert last == f"  written in its last scan by {program}:3:5 in Main and {program}:4:16 in Main"
    assert note == "  no statement writes Main.In"
    [row] = json.loads(proved(str(program), "--written-once", "Main.Q", "--json").stdout)["properties"]
    assert [place.split(":")[-2] for place in row["run"]["writers"]] == ["3", "4"]
    double = runpy.run_path(str(test))["test_written_once_main_q"]
    with pytest.raises(AssertionError):
        double()
    program.write_text(text.replace("    Q := FALSE;\n", ""), encoding="utf-8")
    double()


@pytest.mark.slow
def test_two_blocks_are_compared(tmp_path: Path) -> None:
    program = tmp_path / "blocks.st"
    block = "FUNCTION {} : INT\nVAR_INPUT a : INT; END_VAR\n    {} := {};\nEND_FUNCTION\n"
    rows = (("Twice", "a + a"), ("Shifted", "2 * a"), ("Thrice", "3 * a"))
    program.write_text("".join(block.format(name, name, value) for name, value in rows), encoding="utf-8")
    good, wrong = (proved(str(program), "--equal", "Twice", other) for other in ("Shifted", "Thrice"))
    assert (good.exit_code, good.stdout) == (0, "Twice and Shifted are equal: PROVED by induction over 1 scan\n")
    assert (wrong.exit_code, wrong.stdout.splitlines()[0]) == (
        1, "Twice and Thrice are equal: BROKEN after 1 scan, by the shortest run")
    assert proved(str(program), "--equal", "Twice", "Nobody").exit_code == 2


@pytest.mark.slow
def test_the_run_is_recorded(tmp_path: Path) -> None:
    trace = tmp_path / "found.fbtrace"
    assert proved(INTERLOCK, "--never", "Main.Left", "--trace", str(trace)).exit_code == 1
    chart = CliRunner().invoke(main, ["chart", str(trace), "Main.Left", "Main.Backward"])
    assert (chart.exit_code, chart.stdout.split()) == (0, ["0", "Main.Left", "#", "Main.Backward", "#"])


@pytest.mark.slow
def test_what_was_found_is_written_also_for_a_reader_who_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in `fbvm prove ... --trace F | head -1`."""
    def gone(text: object, **options: Any) -> None:
        raise BrokenPipeError

    monkeypatch.setattr(prove, "say", gone)
    files = [tmp_path / name for name in ("found.fbtrace", "found.html", "test_found.py")]
    options = [text for option, file in zip(("--trace", "--html", "--test"), files, strict=True) for text in (option, str(file))]
    result = CliRunner().invoke(command, [INTERLOCK, "--never", "Main.Left", *options])
    assert isinstance(result.exception, BrokenPipeError)
    assert all(file.stat().st_size for file in files)


@pytest.mark.slow
def test_the_first_run_is_recorded_and_every_one_becomes_a_test(tmp_path: Path) -> None:
    trace, tests = tmp_path / "found.fbtrace", tmp_path / "test_found.py"
    asked = ("--never", "Main.Left AND Main.Right", "--never", "Main.Left", "--never", "Main.Right")
    assert proved(INTERLOCK, *asked, "--trace", str(trace), "--test", str(tests)).exit_code == 1
    chart = CliRunner().invoke(main, ["chart", str(trace), "Main.Left", "Main.Right"])
    assert chart.stdout.split() == ["0", "Main.Left", "#", "Main.Right", "."]
    assert tests.read_text(encoding="utf-8").count("\ndef test_") == 2


@pytest.mark.parametrize("arguments", [[], ["--never", "Main.Nobody"], ["--never", "Main.Left +"], ["--always", "3"],
                                       ["--never", "Main.Left", "--free", "Nobody"],
                                       ["--written-once", "Main.Left,Nobody"], ["--never", "Main.Left", "--unit-rules", "0:9"],
                                       ["--tests", "t.py", "--lemma", "Main.Left"]])  # fmt: skip
def test_wrong_use_has_status_2(arguments: list[str]) -> None:
    result = proved(INTERLOCK, *arguments)
    assert result.exit_code == 2, result.output
    assert "Error: " in result.stderr


def test_files_without_a_program_have_status_3(tmp_path: Path) -> None:
    text = "FUNCTION_BLOCK Lamp VAR n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK"
    (tmp_path / "blocks.st").write_text(text, encoding="utf-8")
    result = proved(str(tmp_path / "blocks.st"), "--no-trap")
    assert (result.exit_code, result.stdout) == (3, "") and "error S0209: there is no PROGRAM to run" in result.stderr


@each_of("text, unit", [("0:1", (0, 1)), ("15:8", (15, 8)), *((text, None) for text in (
    "16:1", "0:0", "0:9", "0", "01", ":1", "0:", "a:1", "0:b", "-1:1", "0:1:1", ""))])
def test_a_unit_is_a_number_to_15_and_a_socket_of_1_to_8(text: str, unit: tuple[int, int] | None) -> None:
    if unit is not None:
        assert prove._unit(text) == unit
    else:
        with pytest.raises(click.BadParameter, match=f"^'{text}' is not UNIT:SOCKET, .*: write 0:1$"):
            prove._unit(text)


@pytest.mark.parametrize("kind", ["STRING[3]", "WSTRING[3]"])
def test_a_property_of_a_text_cannot_be_followed(tmp_path: Path, kind: str) -> None:
    program = tmp_path / "program.st"
    program.write_text(f"PROGRAM Main VAR s, t : {kind}; END_VAR END_PROGRAM\n", encoding="utf-8")
    result = proved(str(program), "--never", "Main.s = Main.t")
    assert (result.exit_code, f"Main.s is {kind}, and texts cannot be followed" in result.stderr) == (3, True)


def test_a_program_that_cannot_be_followed_has_status_3_and_its_line(tmp_path: Path) -> None:
    program = tmp_path / "program.st"
    text = "PROGRAM Main\nVAR i AT %ID0 : DINT; a : ARRAY [0..9999] OF INT; END_VAR\n    a[i] := 1;\nEND_PROGRAM\n"
    program.write_text(text, encoding="utf-8")
    result = proved(str(program), "--no-trap")
    assert result.exit_code == 3
    assert "program.st:3:5" in result.stderr
    assert "an index has no bounds that could be followed" in result.stderr


def test_without_the_solver_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))  # another test may have kept the answer

    def missing(name: str) -> object:
        raise ImportError(name)

    monkeypatch.setattr(solver.importlib, "import_module", missing)
    result = CliRunner().invoke(command, [INTERLOCK, "--never", "Main.Left"])
    assert result.exit_code == 2
    assert "pip install 'fbvm[prove]'" in result.stderr


BLOCK = """FUNCTION_BLOCK Job
VAR_INPUT Execute, Fails : BOOL; END_VAR
VAR_OUTPUT Done, Busy, Error : BOOL; END_VAR
    Busy := Execute AND NOT Fails;
    Error := Execute AND Fails;
    Done := {};
END_FUNCTION_BLOCK
PROGRAM Main
VAR_INPUT Execute, Fails : BOOL; END_VAR
VAR job : Job; t : TON; END_VAR
    job(Execute := Execute, Fails := Fails);
END_PROGRAM
"""


def test_the_handshake_of_a_block_and_at_most_one(tmp_path: Path) -> None:
    program, page = tmp_path / "job.st", tmp_path / "job.html"
    program.write_text(BLOCK.format("FALSE"), encoding="utf-8")
    two = ("--handshake", "Main.job", "--at-most-one", "Main.job.Busy, Main.job.Error")
    result = proved(str(program), *two, "--html", str(page))
    assert (result.exit_code, result.stdout.count(": PROVED by induction over 1 scan\n")) == (0, 2)
    assert not page.exists()  # there is no run to show
    program.write_text(BLOCK.format("Execute"), encoding="utf-8")
    broken = proved(str(program), "--handshake", "Main.job", "--html", str(page))
    assert (broken.exit_code, broken.stdout.splitlines()[0]) == (
        1, "handshake of Main.job (Busy, Done, Error): BROKEN after 1 scan, by the shortest run")
    assert "<title>job" in page.read_text(encoding="utf-8")
    assert "no two of the outputs" in proved(str(program), "--handshake", "Main.t").stderr
    assert "name two or more" in proved(str(program), "--at-most-one", "Main.t.Q").stderr


PUMP = """PROGRAM Main
VAR Level AT %IW0 : UINT; Pump AT %QX0.0 : BOOL; t : TON; END_VAR
    t(IN := Level > 80, PT := T#20ms);
    IF t.Q THEN
        Pump := TRUE;
    ELSIF Level < 20 THEN
        Pump := FALSE;
    ELSIF Level > 90 AND Level < 80 THEN
        Pump := FALSE;
    END_IF
END_PROGRAM
"""


REPORT = """<?xml version="1.0"?>
<coverage><packages><package name="."><classes><class name="pump" filename="{}"><lines>
<line number="3" hits="9" branch="false"/>
<line number="4" hits="9" branch="true" condition-coverage="{}"/>
<line number="5" hits="{}" branch="false"/>
<line number="7" hits="2" branch="false"/>
</lines></class></classes></package></packages></coverage>
"""


@pytest.mark.slow
def test_tests_for_what_no_test_executes(tmp_path: Path, plc: RigMaker) -> None:
    program, tests, report = (tmp_path / name for name in ("pump.st", "test_pump.py", "cov.xml"))
    program.write_text(PUMP, encoding="utf-8")
    result = proved(str(program), "--tests", str(tests))
    assert (result.exit_code, result.stdout.splitlines()) == (0, [
        f"5 of 6 statements and branches are executed, with 2 new tests in {tests}", f"  {program}:9: no run ever does it"])
    made = [run for name, run in runpy.run_path(str(tests)).items() if name.startswith("test_")]
    assert len(made) == 2
    for run in made:
        run(plc)
    report.write_text(REPORT.format(program, "25% (1/4)", 0), encoding="utf-8")
    more = json.loads(proved(str(program), "--tests", str(tests), "--covered", str(report), "--json").stdout)
    assert [each["executes"] for each in more["tests"]] == [[f"{program}:5", f"{program}:4 without a branch"]]
    report.write_text(REPORT.format(program, "75% (3/4)", 1), encoding="utf-8")
    none = proved(str(program), "--tests", str(tests), "--covered", str(report), "--json")
    assert json.loads(none.stdout) == {"met": 5, "tests": [], "never": [f"{program}:9"], "missed": []}
    short = proved(str(program), "--tests", str(tests), "--scans", "1")
    assert (short.exit_code, f"{program}:5: no run of 1 scan does it" in short.stdout) == (1, True)
    assert proved(str(program), "--tests", str(tests), "--scans", "1", "--dialect", "codesys").exit_code == 1
    assert f"plc({str(program)!r}, 10_000_000, dialect='codesys')" in tests.read_text()


ANSWERED = """PROGRAM Main
VAR Asked AT CIO 1519.02 : BOOL; Code AT D30027 : UINT; Waits, Fault, Odd : BOOL; END_VAR
    IF NOT Waits THEN
        Asked := TRUE;
    ELSIF NOT Asked AND Code <> 0 THEN
        Fault := TRUE;
        IF Code = 5 THEN
            Odd := TRUE;
        END_IF
    END_IF
    Waits := Asked;
END_PROGRAM
"""


@pytest.mark.slow
def test_tests_drive_the_words_of_a_unit_as_its_rules_say(tmp_path: Path, plc: RigMaker) -> None:
    program, tests = tmp_path / "asks.st", tmp_path / "test_asks.py"
    program.write_text(ANSWERED, encoding="utf-8")
    result = proved(str(program), "--tests", str(tests), "--unit-rules", "0:1", "--scans", "4")
    assert f"{program}:8" in result.stdout  # 0005 is no response code
    assert f"{program}:6" not in result.stdout
    text = tests.read_text(encoding="utf-8")
    assert "machine.write('Main.Asked', False)" in text
    assert "machine.write('Main.Code', " in text
    for name, run in runpy.run_path(str(tests)).items():
        if name.startswith("test_"):
            run(plc)


def test_options_of_tests_that_do_not_go_together(tmp_path: Path) -> None:
    program = tmp_path / "pump.st"
    program.write_text(PUMP, encoding="utf-8")
    rows = [(("--tests", "t.py", "--no-trap"), "--tests stands alone"), (("--covered", "c.xml", "--no-trap"), "--covered says"),
            (("--tests", "t.py", "--covered", str(program)), "is no report of --fbvm-cov-xml")]  # fmt: skip
    for arguments, said in rows:
        result = proved(str(program), *arguments)
        assert (result.exit_code, said in result.stderr) == (2, True), result.output


COVERED_TEXT = "PROGRAM Main VAR a AT %IW0 : INT; n : INT; END_VAR\nIF a > 3 THEN\n    n := 1;\nEND_IF\nn := 2;\nEND_PROGRAM\n"


@each_of("runs, never, missed, status, said", [
    (0, [], {}, 0, "3 of 3 statements and branches are executed, no new test is needed"),
    (1, [], {}, 0, "3 of 3 statements and branches are executed, with 1 new test in test_all.py"),
    (2, [], {}, 0, "3 of 3 statements and branches are executed, with 2 new tests in test_all.py"),
    (0, [(3, False)], {}, 0, "3 of 4 statements and branches are executed, no new test is needed\n"
                             "  text.st:3: no run ever does it"),
    (0, [(2, True)], {}, 0, "3 of 4 statements and branches are executed, no new test is needed\n"
                            "  text.st:2 without a branch: no run ever does it"),
    (1, [], {(3, False): 5}, 1, "3 of 4 statements and branches are executed, with 1 new test in test_all.py\n"
                                "  text.st:3: no run of 5 scans does it"),
    (0, [], {(3, False): 1, (5, False): 0}, 1,
     "3 of 5 statements and branches are executed, no new test is needed\n  text.st:3: no run of 1 scan does it\n"
     "  text.st:5: it was not found out whether a run does it"),
])
def test_what_is_said_of_tests_that_execute_everything(
    runs: int, never: list[tuple[int, bool]], missed: dict[tuple[int, bool], int], status: int, said: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    Path("text.st").write_text(COVERED_TEXT, encoding="utf-8")
    Path("test_all.py").unlink(missing_ok=True)
    image = compile_text(COVERED_TEXT).image
    assert image is not None

    def spot(line: int, is_skip: bool) -> Spot:
        return Spot(next(number for number, site in enumerate(image.sites) if site.line == line), is_skip)

    found = Covered(3, [Reaching(cast(Any, SimpleNamespace(scans=2)), (spot(3, False), spot(2, True)), ())] * runs,
                    [spot(*each) for each in never], {spot(*each): scans for each, scans in missed.items()})
    asked: list[Limits] = []
    monkeypatch.setattr(prove_tests, "cover", lambda image, limits, *more: asked.append(limits) or found)
    monkeypatch.setattr(prove_tests, "covering_text", lambda *given: "# tests\n")
    result = proved("text.st", "--tests", "test_all.py")
    assert (result.exit_code, result.stdout) == (status, f"{said}\n"), result.output
    assert Path("test_all.py").exists() == bool(runs) and len(asked) == 1
    told = json.loads(proved("text.st", "--tests", "test_all.py", "--json").stdout)
    assert told == {
        "met": 3, "tests": [{"scans": 2, "executes": ["text.st:3", "text.st:2 without a branch"]}] * runs,
        "never": [f"text.st:{line}" + " without a branch" * is_skip for line, is_skip in never],
        "missed": [{"place": f"text.st:{line}", "scans": scans} for (line, _), scans in missed.items()]}


THREE_LINES = """<coverage><packages><package><classes><class filename="text.st"><lines>
<line number="2" hits="4" branch="true" condition-coverage="50% (1/2)"/><line number="3" hits="{}"/><line number="5" hits="4"/>
</lines></class></classes></package></packages></coverage>"""


@each_of("hits, ways, known", [
    (0, "1/2", [False, True]), (4, "1/2", [True, False]), (4, "2/2", [True, True]), (0, "0/2", [False, False]),
])
def test_what_a_report_says_to_be_executed(hits: int, ways: str, known: list[bool], tmp_path: Path,
                                           monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    """`known` are the statement in the branch, and the way past the branch: executed if more ways were taken than branches."""
    monkeypatch.chdir(tmp_path)
    Path("report.xml").write_text(THREE_LINES.format(hits).replace("1/2", ways), encoding="utf-8")
    asked = prove_tests._known(Path("report.xml"))
    inside, whole = Site("text.st", "Main", 3, 5), Site("text.st", "Main", 2, 1)
    assert [asked(inside, []), asked(whole, [inside])] == known
    assert asked(Site("text.st", "Main", 5, 1), []) and not asked(Site("text.st", "Main", 6, 1), [])
    assert not asked(Site("other.st", "Main", 5, 1), [])
