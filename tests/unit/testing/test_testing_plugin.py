"""The pytest plugin, tried by running pytest on small projects."""

from __future__ import annotations

import html
import re
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from page_rig import ReadPage
from rows import first_quick

import fbvm.code.compiler.passes  # what is loaded before pytest runs within pytest stays loaded
import fbvm.testing.rig  # noqa: F401

pytest_plugins = ["pytester"]

INSTALLED = any(entry.value == "fbvm.testing.plugin" for entry in entry_points(group="pytest11"))
ARGUMENTS = ["-p", "no:cacheprovider", "-p", "no:hypothesispytest"] + ([] if INSTALLED else ["-p", "fbvm.testing.plugin"])

PUMP = """\
FUNCTION_BLOCK Pump
VAR_INPUT
    Start : BOOL;
END_VAR
VAR_OUTPUT
    Running : BOOL;
    Starts : INT;
END_VAR
VAR
    Delay : TON;
    Edge : R_TRIG;
END_VAR
    Delay(IN := Start, PT := T#50ms);
    Running := Delay.Q;
    Edge(CLK := Running);
    IF Edge.Q THEN
        Starts := Starts + 1;
    END_IF
END_FUNCTION_BLOCK
"""
GUIDE = (Path(__file__).parents[3] / "docs" / "howto" / "test.md").read_text(encoding="utf-8")


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    """A folder with `src/pump.st`."""
    pytester.makeini("[pytest]\n")
    folder = pytester.mkdir("src")
    (folder / "pump.st").write_text(PUMP, encoding="utf-8")
    return pytester


def run(project: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    return project.runpytest(*ARGUMENTS, *arguments)


def test_one_block_on_a_rig(project: pytest.Pytester) -> None:
    project.makepyfile("""
        from fbvm.testing import ns

        def test_waits(fb):
            pump = fb("src/pump.st::Pump", cycle="10ms")
            pump.run("50ms", Start=True)
            assert not pump.Running
            assert pump.scan().Running
            assert pump.Delay.ET == ns("50ms")

        def test_without_a_file(fb):
            assert fb("TON").run(scans=2, IN=True).Q
    """)
    run(project).assert_outcomes(passed=2)


@pytest.mark.slow
def test_a_failure_explains_itself(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_wrong(fb):
            pump = fb("src/pump.st::Pump")
            other = fb("TON").scan()
            pump.at("30ms", Start=True).run("200ms")
            assert pump.Delay.IN
            assert (pump.Start and
                    not pump.Running)
    """)
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([
        "*fbvm <Pump, 20 scans, 200ms>*",
        "Start is TRUE since scan 3 (30ms), written from outside the program",
        "Running is TRUE since scan 8 (80ms), written last in scan 19, by src/pump.st:14:  Running := Delay.Q;  "
        "with Delay.Q = TRUE",
        "scan 3   30ms     Start   Running",
        "  pump.st:14*>TRUE",
    ])  # fmt: skip
    result.stdout.no_fnmatch_line("*TON,*")
    result.stdout.no_fnmatch_line("Delay.IN is*")


@pytest.mark.slow
def test_a_failure_says_where_its_page_is(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_wrong(fb):
            pump = fb("src/pump.st::Pump").run("60ms", Start=True)
            assert not pump.Running
    """)
    name = ".fbvm/test_a_failure_says_where_its_page_is.test_wrong.html"
    run(project).stdout.fnmatch_lines([f"every scan, in a browser: {name}"])
    page = (project.path / name).read_text(encoding="utf-8")
    assert "test_wrong</title>" in page
    shown = re.search('<pre id="failure"[^>]*>(.*?)</pre>', page, re.S)
    assert shown and html.unescape(shown[1]).splitlines()[:3] == [
        "test_a_failure_says_where_its_page_is.py:3", ">   assert not pump.Running", "E   AssertionError: assert not True"]


@pytest.mark.slow
def test_a_mistake_of_the_test_ends_in_the_test(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_name(fb):
            fb("src/pump.st::Pump").scan(Strat=True)
        def test_condition(fb):
            fb("src/pump.st::Pump").until("Runing")
        def test_value(fb):
            fb("src/pump.st::Pump").Start = 5
        def test_block(fb):
            fb("src/pump.st::Pumps")
        def test_file(fb):
            fb("src/pumps.st::Pump")
    """)
    result = run(project)
    result.assert_outcomes(failed=5)
    result.stdout.fnmatch_lines([
        "E*: Pump has no Strat; it has Start, Running, Starts, Delay, Edge", "E*: Pump has no Runing; *",
        "E*TypeError: Start is BOOL and takes TRUE or FALSE, not 5", "E*: there is no Pumps; there is Pump",
        "E*FileNotFoundError: src/pumps.st is not in *",
    ])  # fmt: skip
    result.stdout.no_fnmatch_line("*rig.py:*")
    assert "rig.py:" in run(project, "--full-trace", "-k", "test_value").stdout.str()


@pytest.mark.slow
def test_what_a_function_of_the_test_asked_for_counts(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def check(pump):
            assert pump.Running

        def test_wrong(fb):
            check(fb("src/pump.st").scan(Start=True))
    """)
    run(project).stdout.fnmatch_lines(["Running is FALSE since power-on, written last in scan 0, by src/pump.st:14*"])


@pytest.mark.slow
def test_a_condition_that_never_holds(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_wrong(fb):
            fb("src/pump.st").until("Running", max="70ms")
    """)
    result = run(project)
    result.stdout.fnmatch_lines(["E*Running does not hold within 70ms", "Running is FALSE since power-on*"])
    result.stdout.no_fnmatch_line("*__tracebackhide__*")


@pytest.mark.slow
def test_forces_left_behind_fail(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_left(fb):
            fb("src/pump.st").force({"Delay.Q": True})

        def test_ended(fb):
            with fb("src/pump.st").force(Start=True):
                pass
    """)
    result = run(project)
    result.assert_outcomes(failed=1, passed=1)
    result.stdout.fnmatch_lines(["left forced: Delay.Q; end a force with unforce()*"])


@pytest.mark.slow
def test_a_program_with_stubs_on_a_network(project: pytest.Pytester) -> None:
    project.makepyfile(test_net="""
        from fbvm import ModbusPeer, Peer

        def test_reads(plc, network):
            network.place(Peer("192.168.250.1", 502), ModbusPeer())
            main = plc("line.st", etn21="192.168.250.21", network=network)
            main.until("Link.ENO", max="5s")
            assert main.Main.Seconds == 3

        def test_without_the_link(plc):
            main = plc("line.st", stubs={"MTCP_ETN_Connect": "ENO := EN;"}).scan()
            assert main.Link.ENO and main["Main.Link.ENO"]
    """)
    (project.path / "line.st").write_text("""\
FUNCTION_BLOCK Spare VAR n : INT; END_VAR n := 1; END_FUNCTION_BLOCK
PROGRAM Main
VAR Link : MTCP_ETN_Connect; Seconds : INT := 3; END_VAR
    Link(EN := TRUE, Connect := TRUE, IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1);
END_PROGRAM
""", encoding="utf-8")  # fmt: skip
    run(project).assert_outcomes(passed=2)


@pytest.mark.slow
def test_what_cannot_be_had_says_why(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_no_file(fb):
            fb("src/fan.st")

        def test_no_block(fb):
            fb("src/pump.st::Fan")
    """)
    result = run(project, "--tb=short")
    result.assert_outcomes(failed=2)
    result.stdout.fnmatch_lines(["E*FileNotFoundError: src/fan.st is not in*", "E*there is no Fan; there is Pump"])


@pytest.mark.slow
def test_libraries_of_the_project(project: pytest.Pytester) -> None:
    project.makeini("[pytest]\nfbvm_libraries = blocks\n")
    (project.mkdir("blocks") / "Twice.st").write_text(
        "FUNCTION Twice : INT VAR_INPUT x : INT; END_VAR Twice := 2 * x; END_FUNCTION", encoding="utf-8")  # fmt: skip
    project.makepyfile("""
        def test_by_name(fb):
            assert fb("Twice").scan(x=4).Result == 8

        def test_a_block_finds_its_neighbours(fb):
            user = fb("User", text="FUNCTION_BLOCK User VAR P : Pump; n : INT; END_VAR P(); n := Twice(3); END_FUNCTION_BLOCK")
            assert user.scan().n == 6
    """)
    run(project).assert_outcomes(passed=2)


@pytest.mark.slow
def test_a_trace_of_a_rig(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_it(fb, trace):
            pump = fb("src/pump.st")
            run = trace(pump)
            pump.at("30ms", Start=True).run("120ms")
            assert run.chart("Start", "Running", "D5") == '''
                Start    ...#########
                Running  ........####
                D5       0
            '''
            assert run.why("Running").startswith("Running = TRUE since scan 8 (80ms), by src/pump.st:14")
            assert "if Delay.IN = TRUE since scan 3" in run.why("Running")
            assert "FALSE since power-on" in run.why("Running", scan=7)
            assert "pump.st:14           >TRUE" in run.table("Start", "Running")
            assert run.path.stat().st_size > 100

        def test_less(fb, trace):
            pump = fb("src/pump.st")
            run = trace(pump, "Running", depth="scans")
            pump.run("100ms", Start=True)
            assert run.chart() == "Running  .....#####"
    """)
    run(project).assert_outcomes(passed=2)


@pytest.mark.slow
def test_with_xdist(project: pytest.Pytester) -> None:
    pytest.importorskip("xdist")
    project.makepyfile("""
        def test_one(fb):
            assert fb("src/pump.st").scan(Start=True).Running
    """)
    project.makefile(".st", test_pump="PROGRAM Test_two VAR P : Pump; END_VAR P(); ASSERT(NOT P.Running); END_PROGRAM")
    result = project.runpytest_subprocess(*ARGUMENTS, "-n", "2", f"--rootdir={project.path}")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["Running is FALSE since power-on*"])


# --- tests in ST ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_programs_are_tests(project: pytest.Pytester) -> None:
    project.makefile(".st", test_pump="""\
PROGRAM Test_starts_late
VAR P : Pump; n : INT; Done : BOOL; END_VAR
    P(Start := TRUE);
    ASSERT(P.Running = (n >= 5));
    n := n + 1;
    Done := n = 8;
END_PROGRAM

PROGRAM Test_once
VAR P : Pump; END_VAR
    P(Start := TRUE);
    ASSERT(NOT P.Running);
END_PROGRAM
""")  # fmt: skip
    result = run(project, "-v")
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["test_pump.st::Test_starts_late PASSED*", "test_pump.st::Test_once PASSED*"])


@pytest.mark.slow
def test_a_failure_names_the_contacts_of_a_rung(project: pytest.Pytester) -> None:
    rungs = "LD Start\nOR Motor\nANDNOT Stop\nOUT Motor"
    (project.path / "src" / "motor.st").write_text(
        f"PROGRAM Main VAR Start, Stop, Motor : BOOL; END_VAR\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM", encoding="utf-8")
    project.makepyfile("""
        def test_it(plc):
            main = plc("src/motor.st")
            main.scan(Start=True, Stop=True)
            assert main.Motor
    """)
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["Motor is FALSE *OUT Motor  with Start = TRUE, Motor = FALSE, Stop = TRUE"])


@pytest.mark.slow
def test_a_failure_in_a_chart_names_what_was_written(project: pytest.Pytester) -> None:
    chart = "INITIAL_STEP A: Lamp(L, T#1s); END_STEP\nTRANSITION FROM A TO A := Go; END_TRANSITION"
    (project.path / "src" / "lamp.st").write_text(
        f"PROGRAM Main VAR Go, Lamp : BOOL; END_VAR\n{chart}\nEND_PROGRAM", encoding="utf-8")
    project.makepyfile("""
        def test_it(plc):
            assert not plc("src/lamp.st").run(scans=3).Lamp
    """)
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["Lamp is TRUE since scan *, by src/lamp.st:2:*"])
    assert "$" not in result.stdout.str()


@pytest.mark.slow
def test_a_block_in_a_file_of_another_name_is_found_for_the_message(project: pytest.Pytester) -> None:
    (project.path / "src" / "queues.st").write_text("FUNCTION_BLOCK Fifo END_FUNCTION_BLOCK", encoding="utf-8")
    project.makefile(".st", test_queue="PROGRAM Test_it VAR q : Fifo; END_VAR q(); ASSERT(TRUE); END_PROGRAM")
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["Fifo is declared in src/queues.st; a test finds it in a file of its own name, Fifo.st, in *"])


NEIGHBOURS = """
PROGRAM Test_sound VAR n : INT; END_VAR n := n + 1; ASSERT(n = 1); Helper(); END_PROGRAM
PROGRAM Test_bad VAR n : INT; END_VAR %s END_PROGRAM
PROGRAM Helper VAR n : INT; END_VAR ASSERT(n = 0); END_PROGRAM
"""


@pytest.mark.slow
@pytest.mark.parametrize(("text", "said"), first_quick([
    ("ASSERT(m);", "test_it.st:2:* error S0201: m is not declared"),
    ("ASSERT(n = ); ASSERT(TRUE);", "test_it.st:2:* error S0101: *"),
    ("IF n = 0 THEN ASSERT(TRUE);", "test_it.st:2:* error S01*"),
]), ids=["unknown name", "no expression", "not closed"])  # fmt: skip
def test_a_bad_program_does_not_fail_its_neighbours(project: pytest.Pytester, text: str, said: str) -> None:
    """Also one that another program calls."""
    project.makefile(".st", test_it=NEIGHBOURS % text)
    result = run(project)
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines([said, "FAILED test_it.st::Test_bad*"])


@pytest.mark.slow
def test_the_file_of_a_block_is_named_wherever_it_is(project: pytest.Pytester) -> None:
    """In a folder beside the tests, for a test in ST and in Python, and no suggestion is the name of a file."""
    project.mkdir("blocks")
    (project.path / "blocks" / "kilns.st").write_text("FUNCTION_BLOCK Kiln END_FUNCTION_BLOCK", encoding="utf-8")
    (project.path / "src" / "weirs.st").write_text("FUNCTION_BLOCK Weir END_FUNCTION_BLOCK", encoding="utf-8")
    project.makefile(".st", test_queue="PROGRAM Test_it VAR q : Kiln; p : Weir; END_VAR q(); ASSERT(TRUE); END_PROGRAM")
    project.makepyfile("def test_kiln(fb):\n    fb('Kiln')\n")
    result = run(project)
    result.assert_outcomes(failed=2)
    for name, file in (("Kiln", "blocks/kilns.st"), ("Weir", "src/weirs.st")):
        result.stdout.fnmatch_lines([f"{name} is declared in {file}; a test finds it in a file of its own name, {name}.st, in *"])
    result.stdout.fnmatch_lines(["E*SubjectError: there is no Kiln in any library", "E*Kiln is declared in blocks/kilns.st; *"])
    result.stdout.no_fnmatch_line("*did you mean*")


@pytest.mark.slow
def test_a_failed_assert_shows_line_and_values(project: pytest.Pytester) -> None:
    project.makefile(".st", test_pump="""\
PROGRAM Test_wrong
VAR P : Pump; n, before : INT; Done : BOOL; END_VAR
    before := before + 1; P(Start := n > 2);
    ASSERT(n < 3 OR NOT P.Running);
    n := n + 1;
    ASSERT(n < 100);
END_PROGRAM
""")  # fmt: skip
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([
        "test_pump.st:4: in Test_wrong, scan 8 (80ms)",
        ">   ASSERT(n < 3 OR NOT P.Running);",
        "E   n = 8",
        "E   P.Running = TRUE",
        "scan 8*",
        "  pump.st:14*>TRUE",
        "every scan, in a browser: .fbvm/*.html",
        "FAILED test_pump.st::Test_wrong*",
    ])  # fmt: skip
    result.stdout.no_fnmatch_line("E   before*")  # an earlier statement has read it
    [page] = (project.path / ".fbvm").glob("*.html")
    assert "test_pump.st:4: in Test_wrong, scan 8 (80ms)\n&gt;   ASSERT(n &lt; 3 OR NOT P.Running);\nE   n = 8\n" in \
        page.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(("text", "said"), first_quick([
    ("PROGRAM Test_nothing VAR n : INT; END_VAR n := 1; END_PROGRAM", "Test_nothing ended without one ASSERT"),
    ("PROGRAM Test_late VAR Done : BOOL; END_VAR ASSERT(TRUE); END_PROGRAM", "Done is still FALSE after 1m"),
    ("PROGRAM Test_trap VAR n : INT; END_VAR n := 1 / n; ASSERT(TRUE); END_PROGRAM", "R0101*1 divided by 0"),
    ("PROGRAM Test_unknown VAR n : INT; END_VAR ASSERT(m); END_PROGRAM", "*error S0201*"),
]), ids=["no assert", "never done", "trap", "unknown name"])  # fmt: skip
def test_what_else_fails(project: pytest.Pytester, text: str, said: str) -> None:
    project.makefile(".st", test_it=text)
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([said])


@pytest.mark.slow
def test_a_file_that_cannot_be_read_is_an_error(project: pytest.Pytester) -> None:
    project.makefile(".st", test_it="PROGRAM Test IF END_PROGRAM")
    result = run(project)
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*test_it.st:1:*error S01*"])


@pytest.mark.slow
def test_other_files_are_left_alone(project: pytest.Pytester, tmp_path: Path) -> None:
    result = run(project, "--collect-only")
    assert result.ret == pytest.ExitCode.NO_TESTS_COLLECTED


# --- the guide --------------------------------------------------------------------------------------------------------


def in_guide(language: str, part: str) -> str:
    """The block of the guide that contains a text."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```", GUIDE, re.M | re.S)
    return next(str(block) for block in blocks if part in block)


@pytest.mark.slow
def test_the_tests_of_the_guide_pass(project: pytest.Pytester) -> None:
    project.makepyfile(in_guide("python", "def test_the_pump_waits_50_ms"))
    project.makefile(".st", test_pump=in_guide("iecst", "PROGRAM Test_the_pump_waits"))
    result = run(project)
    result.assert_outcomes(passed=2)
    result.stdout.no_fnmatch_line("*warning S*")


@pytest.mark.slow
def test_the_failure_of_the_guide_looks_like_that(project: pytest.Pytester) -> None:
    project.mkdir("tests").joinpath("test_pump.py").write_text(
        in_guide("python", "def test_starts"), encoding="utf-8")
    lines = run(project).outlines
    shown = in_guide("console", "assert pump.Starts == 2").splitlines()[1:]
    assert [line for line in shown if line != "..." and line not in lines] == []


GOLDEN = """
    def test_golden(fb, trace):
        pump = fb("src/pump.st")
        run = trace(pump)
        pump.at("20ms", Start=True).run("100ms")
        run.golden("golden/start.txt", "Start", "Running")
"""


@pytest.mark.slow
def test_a_golden_trace_is_written_kept_and_told_apart(project: pytest.Pytester) -> None:
    project.makepyfile(GOLDEN)
    run(project).stdout.fnmatch_lines(["*start.txt is not there; look at this run, then write it with --fbvm-golden:*"])
    run(project, "--fbvm-golden").assert_outcomes(passed=1)
    kept = (project.path / "golden" / "start.txt").read_text(encoding="utf-8")
    assert kept == (
        "scans 0 to 9\n\nStart\n  scan 0      0s        FALSE\n  scan 2      20ms      TRUE\n"
        "\nRunning\n  scan 0      0s        FALSE\n  scan 7      70ms      TRUE\n"
    )
    run(project).assert_outcomes(passed=1)
    (project.path / "src" / "pump.st").write_text(PUMP.replace("50ms", "60ms"), encoding="utf-8")
    result = run(project)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["E*Running", "E*- scan 7      70ms      TRUE", "E*+ scan 8      80ms      TRUE"])


@pytest.mark.slow
def test_the_block_that_was_read_shows_its_pins(project: pytest.Pytester) -> None:
    project.makepyfile("""
        def test_wrong(fb):
            pump = fb("src/pump.st").run("30ms", Start=True)
            assert pump.Running
    """)
    run(project).stdout.fnmatch_lines(["Delay: TON with IN = TRUE, PT = 50ms, Q = FALSE, ET = 20ms"])


@pytest.mark.slow
def test_a_project_within_another_folder_finds_its_files(project: pytest.Pytester) -> None:
    inner = project.mkdir("inner")
    (project.path / "src").rename(inner / "src")
    (inner / "tests").mkdir()
    (inner / "tests" / "test_pump.py").write_text(
        "def test_there(fb):\n    assert not fb('src/pump.st').scan().Running\n"
        "def test_by_name(fb):\n    assert not fb('x.st::X', text='').Running\n".replace("x.st::X", "Pump"), encoding="utf-8")
    run(project).assert_outcomes(passed=2)


# --- warnings ---------------------------------------------------------------------------------------------------------

SLACK = PUMP.replace("    Edge : R_TRIG;\n", "    Edge : R_TRIG;\n    Idle : INT;\n")


@pytest.fixture
def slack(project: pytest.Pytester) -> pytest.Pytester:
    (project.path / "src" / "pump.st").write_text(SLACK, encoding="utf-8")
    project.makepyfile("""
        def test_one(fb):
            fb("src/pump.st::Pump").scan(Start=True)

        def test_other(fb):
            fb("src/pump.st::Pump").scan()
    """)
    return project


@pytest.mark.slow
def test_warnings_are_shown_once_at_the_end(slack: pytest.Pytester) -> None:
    result = run(slack)
    result.assert_outcomes(passed=2)
    assert result.stdout.str().count("warning S0290: Idle is never used") == 1
    result.stdout.fnmatch_lines(["*= warnings of PLC code =*", "*pump.st:12:5: warning S0290: Idle is never used"])


@pytest.mark.slow
@pytest.mark.parametrize("argument", ["--fbvm-no-warn=S0290", "--fbvm-no-warn=S0390,s0290", "--fbvm-no-warn=all"])
def test_warnings_that_are_not_wanted_are_not_shown(slack: pytest.Pytester, argument: str) -> None:
    assert "S0290" not in run(slack, argument).stdout.str()


@pytest.mark.slow
def test_warnings_can_fail_a_test(slack: pytest.Pytester) -> None:
    result = run(slack, "--fbvm-warnings-as-errors")
    result.assert_outcomes(failed=2)
    result.stdout.fnmatch_lines(["*error S0290: Idle is never used"])
    slack.makeini("[pytest]\nfbvm_warnings_as_errors = true\n")
    run(slack).assert_outcomes(failed=2)
    slack.makeini("[pytest]\nfbvm_warnings_as_errors = true\nfbvm_no_warn = S0290\n")
    run(slack).assert_outcomes(passed=2)


@pytest.mark.slow
def test_what_is_no_code_of_a_warning_is_wrong_usage(slack: pytest.Pytester) -> None:
    result = run(slack, "--fbvm-no-warn=S0201")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--fbvm-no-warn: S0201 is no code of a warning*"])


PROJECT = """
[run]
for = "1s"
[[server]]
address = "192.168.250.1:502"
[plc.pump]
sources = ["src/main.st", "src/pump.st"]
cycle = "10ms"
set = [{name = "CIO 0.00", value = true, at = "30ms"}]
[[plc.pump.unit]]
address = "192.168.250.21"
[plc.slow]
sources = ["src/main.st", "src/pump.st"]
cycle = "25ms"
count = 2
"""
MAIN = """
PROGRAM Main
VAR Button AT CIO 0.00 : BOOL; P : Pump; END_VAR
    P(Start := Button);
END_PROGRAM
"""


@pytest.mark.slow
def test_a_network_of_plcs_from_a_project_file(project: pytest.Pytester) -> None:
    (project.path / "fbvm.toml").write_text(PROJECT, encoding="utf-8")
    (project.path / "src" / "main.st").write_text(MAIN, encoding="utf-8")
    project.makepyfile("""
        import pytest
        from fbvm.watch.conditions import ConditionError

        def test_all(plant):
            made = plant()
            assert list(made.rigs) == ["pump", "slow[1]", "slow[2]"]
            made.run("100ms")
            assert [rig.scans for rig in made.rigs.values()] == [10, 4, 4]
            assert made.pump.P.Running and not made["slow[1]"].P.Running
            made["slow[2]"].Button = True
            made.until("slow[2].P.Running AND pump.P.Starts = 1", max="1s")
            with pytest.raises(AssertionError, match="does not hold within 50ms"):
                made.until("slow[1].P.Running", max="50ms")
            with pytest.raises(ConditionError, match="name of no PLC"):
                made.until("P.Running")
            with pytest.raises(AttributeError, match="no PLC valve"):
                made.valve

        def test_wrong(plant):
            assert plant().run("100ms").pump.P.Starts == 2
    """)
    result = run(project)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["P.Starts is 1 since scan 8 (80ms), by src/pump.st:17 in P:*"])


@pytest.mark.slow
def test_a_project_file_that_is_wrong(project: pytest.Pytester) -> None:
    (project.path / "fbvm.toml").write_text("[plc.a]\nsource = 1\n", encoding="utf-8")
    project.makepyfile("def test_wrong(plant):\n    plant()\ndef test_none(plant):\n    plant('other.toml')\n")
    run(project).stdout.fnmatch_lines(["E*fbvm.toml:2:*", "E*FileNotFoundError: other.toml is not in*"])


CALLER = """
    from fbvm import ModbusPeer, Peer

    TEXT = \'\'\'
    PROGRAM Main
    VAR c : MTCP_ETN_Connect; END_VAR
        c(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    END_PROGRAM\'\'\'

    def test_wrong(fb, network):
        network.place(Peer("192.168.250.1", 502), ModbusPeer())
        main = fb("Main", text=TEXT, etn21="192.168.250.21", network=network).run(scans=8)
        assert main["D200"] == 5
"""


@pytest.mark.slow
def test_a_failure_with_a_unit_shows_the_network_and_the_units_words(project: pytest.Pytester) -> None:
    project.makepyfile(CALLER)
    run(project).stdout.fnmatch_lines([
        "D200 is 0 since power-on; no statement wrote it", "what passed the network last:",
        "  scan 2    192.168.250.21:49152 -> 192.168.250.1:502  asks for a connection",
    ])  # fmt: skip
    [page] = (project.path / ".fbvm").glob("*.html")
    read = ReadPage.of_html(page.read_text(encoding="utf-8"))
    assert read.head["pinned"] == ["D200"] and "D200" in [signal["name"] for signal in read.head["signals"]]
    assert read.head["described"]["CIO 1519.03"] == "Send Request Switch"
    assert read.head["meanings"]["D30009"]["4"] == "ESTABLISHED"
    assert read.frames[0][4] == "asks for a connection"


@pytest.mark.slow
def test_a_plc_hears_what_another_one_answers(project: pytest.Pytester) -> None:
    lesson = Path(__file__).resolve().parents[3] / "examples" / "lessons" / "12-two-plcs-one-wire"
    for name in ("server.st", "given.st", "given.toml"):
        (project.path / name).write_text((lesson / name).read_text(encoding="utf-8"), encoding="utf-8")
    project.makepyfile("""
        def test_wrong(plant):
            made = plant("given.toml").run("500ms")
            assert made.client.Beat == 0
    """)
    run(project).stdout.fnmatch_lines([
        "  scan * 192.168.250.2:49152 -> 192.168.250.1:502  Modbus 1, unit 1: 03 read holding registers, address 1000, *",
        "  scan * 192.168.250.1:502 -> 192.168.250.2:49152  Modbus 1, unit 1: 03 read holding registers, data *",
    ])  # fmt: skip


@pytest.mark.slow
def test_the_dialect_of_a_rig_and_of_a_session(project: pytest.Pytester) -> None:
    project.makeini("[pytest]\nfbvm_dialect = codesys\n")
    block = "FUNCTION_BLOCK Last VAR_INPUT w : WORD; END_VAR VAR_OUTPUT n : WORD; END_VAR n := w + 1; END_FUNCTION_BLOCK"
    (project.path / "src" / "last.st").write_text(block, "utf-8")
    program = "PROGRAM Test_words VAR w : WORD := 7; END_VAR w := w + 1; ASSERT(w = 8); END_PROGRAM"
    (project.path / "test_st.st").write_text(program, "utf-8")
    project.makepyfile("""
        import pytest

        def test_of_the_session(fb):
            last = fb("src/last.st")
            last.w = 5
            last.scan()
            assert last.n == 6

        def test_of_its_own(fb):
            with pytest.raises(Exception, match="WORD has no arithmetic"):
                fb("src/last.st", dialect="standard")
    """)
    run(project).assert_outcomes(passed=3)


@pytest.mark.slow
@pytest.mark.parametrize("order", [[], ["two", "one"]], ids=["from_above", "named"])
def test_projects_and_lessons_lie_side_by_side(pytester: pytest.Pytester, order: list[str]) -> None:
    """Each has a test module of the same name, and sources of its own: `fbvm new one`, `fbvm new two`, and pytest above them."""
    for name, starts in (("one", 1), ("two", 2)):
        folder = pytester.path / name
        for part, text in {
            "fbvm.toml": "", "pytest.ini": "[pytest]\n", "src/part.st": PUMP.replace("Starts + 1", f"Starts + {starts}"),
            "tests/test_part.py": "def test_starts(fb):\n    pump = fb('src/part.st::Pump')\n    pump.run('100ms', Start=True)\n"
                                  f"    assert pump.Starts == {starts}\n",
            "lesson/answers.toml": "lamp = true\n",
            "lesson/test_lesson.py": "from fbvm.testing.lesson import predicted\n\n\ndef test_lamp():\n"
                                     "    assert predicted(__file__, 'lamp') is True\n",
        }.items():  # fmt: skip
            (folder / part).parent.mkdir(parents=True, exist_ok=True)
            (folder / part).write_text(text, encoding="utf-8")
    run(pytester, *order).assert_outcomes(passed=4)


@pytest.mark.slow
def test_modules_of_one_name_in_no_project_are_refused_as_ever(pytester: pytest.Pytester) -> None:
    for name in ("one", "two"):
        pytester.mkdir(name).joinpath("test_part.py").write_text("def test_it():\n    pass\n", encoding="utf-8")
    run(pytester).stdout.fnmatch_lines("*import file mismatch*")
