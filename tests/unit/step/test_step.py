"""Stepping: statement by statement, scan by scan, forth and back, with units and network, and its language."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_of

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.record.recording import recording as recording_module
from fbvm.record.recording.recording import Recording
from fbvm.step import world as world_module
from fbvm.step.commands import COMMANDS, CommandError, Commands, ExpectationError
from fbvm.step.session import Position, Session
from fbvm.step.stop_report import StopReport
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

HOUSE = Path(__file__).resolve().parents[3]
TEXT = """\
FUNCTION_BLOCK Twice
VAR_INPUT A : INT; END_VAR
VAR_OUTPUT Q : INT; END_VAR
    Q := A;
    Q := Q * 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    Button AT CIO 0.00 : BOOL;
    N, R : INT;
    T : Twice;
END_VAR
    N := N + 1;
    T(A := N);
    IF Button THEN
        R := 100 / (N - 5);
    END_IF;
END_PROGRAM
"""


def made(text: str = TEXT) -> Commands:
    compilation = compile_text(text)
    assert compilation.image is not None
    image = compilation.image
    session = Session.of(lambda: Plc(image))
    return Commands(session, StopReport(session, {image.sites[0].file: text}))


def said(commands: Commands, *lines: str) -> str:
    return "\n".join(text for line in lines for text in commands.run(line))


def line_of(commands: Commands) -> int | None:
    site = commands.report.site()
    return site.line if site else None


def test_each_statement_is_a_stop() -> None:
    commands = made()
    lines = [line_of(commands)]
    for _ in range(6):
        commands.session.step()
        lines.append(line_of(commands))
    assert lines == [13, 14, 4, 5, 15, None, 13]
    assert commands.session.here == Position(1, 0)


@pytest.mark.slow
def test_blocks_at_once_and_out_of_them() -> None:
    commands = made()
    said(commands, "next", "next")
    assert line_of(commands) == 15
    said(commands, "back", "step")
    assert line_of(commands) == 15
    said(commands, "goto 0", "step", "step")
    assert line_of(commands) == 4
    said(commands, "out")
    assert line_of(commands) == 15


def test_what_changed_is_said() -> None:
    commands = made()
    assert "  Main.N: 0 -> 1" in said(commands, "step")
    assert "  Main.N: 1 -> 0" in said(commands, "back")


def test_a_value_that_changed_at_both_ends_is_said_once() -> None:
    middle = "-" * 60
    commands = made(f"PROGRAM Main\nVAR s : STRING := 'a{middle}b'; END_VAR\n    s := 'c{middle}d';\nEND_PROGRAM\n")
    assert said(commands, "step").count("Main.s: ") == 1


@pytest.mark.slow
@given(moves=st.lists(st.sampled_from(["step", "next", "out", "scan", "back", "back scan", "goto 2", "run 14"]), max_size=12),
       button=st.integers(0, 12))  # fmt: skip
@settings(max_examples=times(40), deadline=None)
def test_a_place_is_the_same_however_one_got_there(moves: list[str], button: int) -> None:
    commands = made()
    for number, move in enumerate(moves):
        if number == button:
            said(commands, "CIO 0.00 = TRUE")
        said(commands, move)
    session = commands.session
    here, memory = session.here, bytes(session.plc.memory.u8)
    session.goto(0)
    session.goto(here.scan)
    for _ in range(here.step):
        session.step()
    assert session.here == here
    assert bytes(session.plc.memory.u8) == memory


@pytest.mark.slow
@each_of("room", [64 << 20, 8_000])
def test_any_scan_is_there_however_long_ago(room: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world_module, "Recording", lambda: Recording(limit_bytes=room))
    monkeypatch.setattr(recording_module, "AGAIN_NS", 1_000_000)
    commands = made()
    said(commands, "scan 100", "Main.R := 7", "step", "Main.N := 1000", "scan 900")
    session = commands.session
    assert (session.world.recorded("plc").scans.start > 0) == (room < 1 << 20)
    for scan, number in ((1000, 1899), (40, 40), (100, 100), (101, 1000), (700, 1599), (3, 3), (999, 1898)):
        session.goto(scan)
        assert (session.here, session.read("Main.N"), session.read("Main.R")) == (Position(scan), number, 7 * (scan >= 100))


def test_what_is_written_in_the_past_leads_elsewhere() -> None:
    commands = made()
    said(commands, "scan 10", "goto 3", "step", "Main.N := 40", "scan")
    assert commands.session.read("Main.N") == 40
    said(commands, "scan 2")
    assert commands.session.read("Main.N") == 42
    said(commands, "goto 2")
    assert commands.session.read("Main.N") == 2


def test_what_is_written_in_the_past_takes_back_what_was_written_later() -> None:
    commands = made()
    said(commands, "scan 6", "Main.R := 7", "scan 2", "goto 3", "Main.N := 40", "scan 3")
    assert commands.session.here == Position(6)
    assert (commands.session.read("Main.N"), commands.session.read("Main.R")) == (43, 0)


def test_back_scan_goes_to_the_beginning_of_this_scan_and_then_of_the_one_before() -> None:
    commands = made()
    said(commands, "goto 5", "step", "step", "back scan")
    assert commands.session.here == Position(5)
    said(commands, "back scan")
    assert commands.session.here == Position(4)
    commands.session.back_scan(3)
    assert commands.session.here == Position(1)


def test_a_write_in_mid_scan_stays_when_the_scan_is_done_again() -> None:
    commands = made()
    said(commands, "run 5", "Main.T.Q = 7", "step")
    assert commands.session.read("Main.T.Q") == 14
    said(commands, "scan", "goto 0", "run 15")
    assert commands.session.read("Main.T.Q") == 14


def test_a_force_holds_and_ends() -> None:
    commands = made()
    said(commands, "force Main.N = 3", "scan 4")
    assert commands.session.read("Main.N") == 3
    said(commands, "unforce", "scan")
    assert commands.session.read("Main.N") == 4


def test_a_trap_can_be_gone_back_from() -> None:
    commands = made()
    text = said(commands, "CIO 0.00 = TRUE", "run 1s")
    assert "100 divided by 0" in text
    assert " >  16          R := 100 / (N - 5);" in text
    assert commands.session.here.scan == 4
    said(commands, "scan", "step")
    assert commands.session.trap
    said(commands, "goto 4", "CIO 0.00 = FALSE", "scan 3")
    assert commands.session.trap is None
    assert commands.session.read("Main.N") == 7


@pytest.mark.slow
def test_run_and_back_to_lines_conditions_and_breakpoints() -> None:
    commands = made()
    said(commands, "run Main.N = 3")
    assert (commands.session.here, line_of(commands)) == (Position(2, 1), 14)
    said(commands, "run Twice")
    assert line_of(commands) == 4
    said(commands, "back Main.N = 2")
    assert commands.session.here == Position(2, 0)
    assert "1  " in said(commands, "break 15")
    said(commands, "run")
    assert line_of(commands) == 15
    assert "was not reached in" in said(commands, "run Main.N > 30000")
    assert said(commands, "unbreak 1", "break") == ""


def test_a_run_for_a_time_ends_at_a_breakpoint() -> None:
    commands = made()
    said(commands, "break Main.N = 4", "run 1s")
    assert (commands.session.here, line_of(commands)) == (Position(3, 1), 14)
    said(commands, "run 50ms")
    assert commands.session.here == Position(8, 0)
    said(commands, "unbreak", "break Twice", "run 10ms")
    assert (commands.session.here, line_of(commands)) == (Position(8, 2), 4)


@pytest.mark.slow
def test_a_condition_stops_run_where_it_becomes_true() -> None:
    """As `fbvm run --break-if` does."""
    commands = made()
    said(commands, "break Main.N > 2", "run")
    assert commands.session.here == Position(2, 1)
    said(commands, "run 1s")
    assert commands.session.here == Position(102, 0)


@pytest.mark.slow
@each_of("text, scan, line", [
    ("text.st:14 IF Main.N > 3", 3, 14), ("14 if Main.N > 3", 3, 14), ("Twice IF Main.N = 3", 2, 4),
    ("Main.N > 3", 3, 14), ("text.st : 14", 0, 14), ("Main . N = 2", 1, 14), ("Main.N > 3 IF Main.N > 5", 5, 14),
    ("D 200 = 0 AND Main.N = 2", 1, 14),
])  # fmt: skip
def test_breakpoints_are_written_as_those_of_run(text: str, scan: int, line: int) -> None:
    commands = made()
    said(commands, f"break {text}", "run")
    assert (commands.session.here.scan, line_of(commands)) == (scan, line)


@pytest.mark.slow
def test_what_is_not_reached_is_said_and_moves_nothing_back() -> None:
    commands = made()
    assert said(commands, "// a remark", "  //") == ""
    said(commands, "scan 3", "step")
    here = commands.session.here
    with pytest.raises(CommandError, match="set breakpoints first"):
        said(commands, "back run")
    assert said(commands, "back Main.N = 40").startswith("Main.N = 40 was never reached before")
    assert commands.session.here == here
    assert "no breakpoint was reached in" not in said(commands, "break Main.N = 30000", "run 50ms")
    assert commands.session.here == Position(8)
    with pytest.raises(CommandError, match="no Nobody"):
        said(commands, "why Nobody")


def test_a_time_of_day_in_a_condition_is_no_line() -> None:
    commands = made("PROGRAM Main VAR t : TOD := TOD#12:29:59; END_VAR t := t + T#1s; END_PROGRAM")
    said(commands, "break Main.t = TOD#12:30:01", "run")
    assert commands.session.here == Position(1, 1)


@pytest.mark.slow
@each_of("text, names", [
    ("D200..D201", ["D200", "D201"]), ("CIO 0.00..CIO 0.02", ["CIO 0.00", "CIO 0.01", "CIO 0.02"]),
    ("CIO 0 .. CIO 1", ["CIO 0", "CIO 1"]), ("%W5 Main . N", ["W5", "Main.N"]), ("D 200, 0.01", ["D200", "CIO 0.01"]),
    ("Main.T.Q Main.R", ["Main.T.Q", "Main.R"]), ("W0.14..W1.00", ["W0.14", "W0.15", "W1.00"]),
])  # fmt: skip
def test_places_are_written_as_those_of_run(text: str, names: list[str]) -> None:
    commands = made()
    assert [row.partition(" = ")[0] for row in said(commands, f"watch {text}").splitlines()] == names
    assert [row.partition(" = ")[0] for row in said(commands, "scan").splitlines()[-len(names):]] == names
    said(commands, f"unwatch {text}")
    assert not commands.watches


def test_a_watch_with_a_condition() -> None:
    commands = made()
    said(commands, "watch Main.R D200 IF Main.N > 1")
    assert "Main.R = 0" not in said(commands, "scan")
    assert said(commands, "scan").endswith("Main.R = 0\nD200 = 0 (16#0000)")


def test_the_scan_table_the_cause_and_the_calls() -> None:
    commands = made()
    text = said(commands, "run 5", "scan", "table Main.T.Q")
    assert ">1" in text and ">2" in text
    assert "Q := Q * 2" in said(commands, "why Main.T.Q")
    assert ">3" not in said(commands, "scan", "scan", "goto 2", "table Main.N")
    calls = said(commands, "run 5", "calls").splitlines()[-2:]
    assert [row.split()[1] for row in calls] == ["Main.T", "Main"]


def test_between_two_scans_nothing_is_called_and_no_chart_is_here() -> None:
    commands = made()
    said(commands, "scan 2", "back")
    assert commands.session.statement is None and said(commands, "calls") == ""
    with pytest.raises(CommandError, match="no chart here"):
        said(commands, "sfc")


def test_a_reference_and_what_it_refers_to_are_printed() -> None:
    commands = made("""TYPE Pair : STRUCT a : INT := 3; b : BOOL; END_STRUCT END_TYPE
PROGRAM Main VAR p : Pair; r : REF_TO Pair; n, none : REF_TO INT; END_VAR r := REF(p); n := REF(p.a); END_PROGRAM""")
    said(commands, "scan")
    assert said(commands, "print Main.p Main.r^.a Main.r Main.n Main.none").splitlines() == [
        "Main.p = Pair (a := 3, b := FALSE)", "Main.r^.a = 3", "Main.r = -> Main.p", "Main.n = -> Main.p.a", "Main.none = NULL"]


def test_an_empty_line_steps_and_later_moves_again() -> None:
    commands = made()
    said(commands, "", "print Main.N", "")
    assert commands.session.here == Position(0, 2)
    said(commands, "scan 2", "// a comment", "force Main.R = 3", "")
    assert commands.session.here == Position(4)


def test_mode_and_power_between_scans_only() -> None:
    commands = made()
    said(commands, "scan 2", "mode PROGRAM", "scan 2")
    assert commands.session.read("Main.N") == 2
    said(commands, "mode run", "scan")
    assert commands.session.read("Main.N") == 1
    said(commands, "step")
    with pytest.raises(CommandError, match="between two scans"):
        said(commands, "power")
    said(commands, "back scan", "power cold", "scan")
    assert commands.session.read("Main.N") == 1


@pytest.mark.slow
@each_of("line", [
    "nonsense", "print", "print Nobody", "run 33", "run x.st:1", "step -1", "goto x", "write Main.N", "Main.N = 99999",
    "unbreak 3", "mode x", "power x", "table", "why Main.T", "run", "expect Main.N", "help x", "run Main.N", "D0..D1 = 1",
    "force D0..D1 = 1,2", "rung",
])  # fmt: skip
def test_a_mistake_is_said_and_changes_nothing(line: str) -> None:
    commands = made()
    before = bytes(commands.session.plc.memory.u8)
    with pytest.raises(CommandError):
        said(commands, line)
    assert commands.session.here == Position()
    assert bytes(commands.session.plc.memory.u8) == before


def test_every_command_is_in_the_help_and_exists() -> None:
    commands = made()
    text = said(commands, "help")
    for command in COMMANDS:
        assert command.usage in text
        assert command.usage in said(commands, f"help {command.name}")
        assert hasattr(commands, f"_{command.name}")


def test_completion() -> None:
    commands = made()
    assert commands.completions("pr") == ["print"]
    assert commands.completions("print Main.T") == ["Main.T"]
    assert commands.completions("print Main.T.") == ["Main.T.A", "Main.T.Q"]
    assert commands.completions("help br") == ["break"]
    assert commands.completions("print Nobody.") == []
    assert commands.completions("mode R") == [] and commands.completions("D2") == []
    assert commands.completions("watch Main.R Main.T.") == ["Main.T.A", "Main.T.Q"]


LADDER = """\
PROGRAM Main
VAR
    Start AT CIO 0.00 : BOOL;
    Motor AT CIO 100.00 : BOOL;
END_VAR
LADDER
RUNG 1 Seal-in
    LD      Start
    OR      Motor
    OUT     Motor
RUNG 2
    LDNOT   Motor
    OUT     100.01
END_LADDER
END_PROGRAM
"""


def test_where_power_flows_in_rungs() -> None:
    commands = made(LADDER)
    assert " ON" not in said(commands, "list 10")
    said(commands, "Main.Start = TRUE", "run 11")
    text = said(commands, "list 10")
    assert [row.split()[-1] for row in text.splitlines() if " LD " in row or " OR " in row] == ["ON", "off"]
    assert "LDNOT   Motor\n" in text + "\n"
    assert "Start" in said(commands, "rung 1") and "━" in said(commands, "rung 1")
    with pytest.raises(CommandError, match="no rung 9"):
        said(commands, "rung 9")
    said(commands, "run 12")
    assert [row.split()[1] for row in said(commands, "rung").splitlines() if row.startswith("RUNG")] == ["1", "2"]
    assert [row.split()[1] for row in said(commands, "goto 1", "rung").splitlines() if row.startswith("RUNG")] == ["1"]
    assert not [row for row in said(commands, "goto 1", "list 10").splitlines() if row.endswith(("ON", "off"))]
    with pytest.raises(CommandError, match="there are no rungs here"):
        said(commands, "run 12", "scan", "back", "rung")


def test_the_rungs_that_are_shown_are_those_of_the_pou() -> None:
    block = LADDER.replace("PROGRAM", "FUNCTION_BLOCK").replace(" Main", " Lamp", 1).replace("RUNG 1", "RUNG 7")
    commands = made(block + LADDER.replace("END_VAR", "l : Lamp; END_VAR l();", 1))
    said(commands, "step")
    with pytest.raises(CommandError, match="there is no rung 1; rungs are 7 to "):
        said(commands, "rung 1")
    assert said(commands, "rung 7") and [row for row in said(commands, "rung").splitlines() if row.startswith("RUNG")]


@pytest.mark.slow
@pytest.mark.parametrize(("instruction", "lines"), [
    ("OUT     Motor", 1), ("SET     Motor", 1), ("MOV(021) #5 D200", 1), ("TIM     0 #10", 1), ("DIFU(013) 100.05", 1),
    ("CNT 1 #3", 1), ("@+(400) D1 D2 D3", 1), ("OUT     Motor", 2), ("MOV(021) #5 *D200", 1), ("KEEP(011) Motor", 1),
])  # fmt: skip
def test_a_step_of_a_rung_is_one_stop(instruction: str, lines: int) -> None:
    """Also with an operand that is computed, with an edge, and under an interlock that inhibits or does not."""
    conditions = 2 if instruction.startswith(("CNT", "KEEP")) else 1
    rung = "".join("    LD      Start\n" for _ in range(conditions)) + f"    {instruction}\n" * lines
    text = ("PROGRAM Main\nVAR Start AT CIO 0.00 : BOOL; Motor AT CIO 100.00 : BOOL; Go AT CIO 0.01 : BOOL; END_VAR\nLADDER\n"
            f"RUNG 1\n{rung}RUNG 2\n    LD      Go\n    IL(002)\nRUNG 3\n{rung}RUNG 4\n    ILC(003)\nEND_LADDER\nEND_PROGRAM\n")
    for start, go in ((False, False), (True, False), (True, True)):
        commands = made(text)
        said(commands, f"Main.Start = {start}", f"Main.Go = {go}")
        stops: list[int] = []
        while commands.session.here.scan == 0:
            if (site := commands.report.site()) and text.splitlines()[site.line - 1].strip() == instruction:
                stops.append(site.line)
            commands.session.step_over()
        assert len(stops) == len(set(stops)), (stops, start, go)
        assert len(stops) in ((lines, 2 * lines) if not go else (2 * lines,))


def test_a_breakpoint_at_a_coil_stops_a_scan_once() -> None:
    compilation = compile_text(LADDER)
    assert compilation.image is not None
    plc = Plc(compilation.image)
    plc.breakpoints.line("text.st:10")
    halts = []
    for _ in range(4):
        plc.scan()
        halts.append(plc.breakpoints.halted is not None)
    assert (halts, plc.scans) == ([True, False, True, False], 2)


CHART = """PROGRAM Main
VAR go, lamp : BOOL; n : INT; END_VAR
INITIAL_STEP Dark: END_STEP
TRANSITION FROM Dark TO Bright := go;
END_TRANSITION
STEP Bright: lamp(N); Count(N); END_STEP
TRANSITION FROM Bright TO Dark := NOT go;
END_TRANSITION
ACTION Count:
    n := n + 1;
END_ACTION
END_PROGRAM
"""


@pytest.mark.slow
def test_a_chart_is_gone_through_by_its_transitions_and_actions() -> None:
    commands = made(CHART)
    said(commands, "Main.go = TRUE", "scan")
    lines = [said(commands, "step").splitlines()[0] for _ in range(5)]
    assert [line.split(": ")[1] for line in lines] == [
        "text.st:4 in Main", "text.st:4 in Main", "text.st:10 in Main", "end of the program; the I/O refresh comes next",
        "text.st:3 in Main"]
    said(commands, "goto 1", "run 10")
    drawn = said(commands, "sfc")
    assert "● Bright" in drawn and "go → TRUE" in drawn and "● Dark" not in drawn
    with pytest.raises(CommandError, match="no rungs here"):
        said(commands, "rung")


# --- units and network ------------------------------------------------------------------------------------------------


@pytest.fixture
def demo() -> Callable[[], Plc]:
    compilation = compile_text((HOUSE / "examples" / "demo.st").read_text(encoding="utf-8"))
    assert compilation.image is not None
    image = compilation.image

    def make() -> Plc:
        plc, network, peer = Plc(image), LoopNetwork(), ModbusPeer()
        for register in range(20):
            peer.server.holding_registers[register] = 100 + register
        network.place(Peer("192.168.250.1", 502), peer)
        plc.attach(Etn21(0, "192.168.250.21"), network)
        return plc

    return make


@pytest.mark.slow
def test_back_goes_back_with_unit_and_network(demo: Callable[[], Plc]) -> None:
    session = Session.of(demo)
    assert session.run(lambda statement: session.read("Main.Done") is True, 100)
    assert session.read("D200..D202") == [100, 101, 102]
    session.goto(3)
    assert session.read("D200..D202") == [0, 0, 0]
    session.act(lambda plc: plc.write("Main.Source", 5))
    assert session.run(lambda statement: session.read("Main.Done") is True, 100)
    assert session.read("D200..D202") == [105, 106, 107]
    session.goto(session.here.scan)
    twin = demo()
    twin.run(scans=3)
    twin.write("Main.Source", 5)
    twin.run(scans=session.here.scan - 3)
    for name in ("Main", "D0..D999", "D30000..D32767", "CIO 1500..CIO 1524"):
        assert twin.read(name) == session.read(name)


# --- the verb ---------------------------------------------------------------------------------------------------------


def called(script: str, *arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["step", str(HOUSE / "examples" / "demo.st"), *arguments], input=script)
    return result.exit_code, result.output


@pytest.mark.slow
def test_a_script_from_a_pipe() -> None:
    code, output = called("// until it is done\nrun Main.Done\nexpect D200 = 1002\nnet 20\nquit\nnonsense\n",
                          "--map", "192.168.250.1:502=peer", "--set", "Main.Source=2", "--watch", "D200")  # fmt: skip
    assert code == 0
    assert "D200 = 1002 (16#03EA)" in output
    assert "Modbus 1, unit 1: 03 read holding registers, address 2, quantity 10" in output


@pytest.mark.slow
def test_a_script_ends_with_what_is_wrong() -> None:
    assert called("expect D200 = 1\nquit\n") == (1, called("expect D200 = 1\n")[1])
    assert "does not hold in scan 0" in called("expect D200 = 1\n")[1]
    assert called("nonsense\n")[0] == 2
    assert called("", "--map", "192.168.250.1:502=127.0.0.1:502")[0] == 2
    assert called("", "--set", "Nobody=1")[0] == 2
    assert called("expect D8 = 2\nquit\n", "--set", "D7..D8=1,2")[0] == 0
    assert "leave out @1s" in called("", "--set", "D7=1@1s")[1] and called("", "--set", "D7=1@1s")[0] == 2
    assert called("", "--watch", "Nobody")[0] == 2
    assert "E3_5 = 7 (16#0007)" in called("scan\n", "--set", "E3_5=7", "--watch", "E3_5 IF E3_5 > 0")[1]


TWO = """
[plc.server]
sources = ["server.st"]
[[plc.server.unit]]
address = "192.168.250.1"
[plc.client]
sources = ["given.st"]
cycle = "20ms"
set = [{name = "D500", value = 7, at = "30ms"}]
[[plc.client.unit]]
address = "192.168.250.2"
"""


@pytest.mark.slow
def test_one_plc_of_a_project_while_the_others_scan_along(tmp_path: Path) -> None:
    for name in ("server.st", "given.st"):
        text = (HOUSE / "examples" / "lessons" / "12-two-plcs-one-wire" / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "fbvm.toml").write_text(TWO, encoding="utf-8")
    script = ("run Main.Beat > 60\nexpect Main.Beat < 100\nexpect D500 = 7\ngoto 1\nexpect D500 = 0\nexpect Main.Beat = 0\n"
              "run 1s\nexpect Main.Alive AND D500 = 7\nnet 100\n")  # fmt: skip
    result = CliRunner().invoke(main, ["step", str(tmp_path), "--plc", "client"], input=script)
    assert result.exit_code == 0, result.output
    assert "03 read holding registers, address 1000, quantity 2" in result.output
    for arguments in ([], ["--plc", "nobody"]):
        wrong = CliRunner().invoke(main, ["step", str(tmp_path), *arguments])
        assert wrong.exit_code == 2 and "there is server, client" in wrong.output
    (tmp_path / "fbvm.toml").write_text("[plc.x]\n", encoding="utf-8")
    assert CliRunner().invoke(main, ["step", str(tmp_path)]).exit_code == 3


def test_errors_raised_for_scripts_are_told_apart() -> None:
    with pytest.raises(ExpectationError):
        said(made(), "expect Main.N = 1")


@pytest.mark.slow
def test_nobody_stands_in_what_no_statement_calls() -> None:
    """At the beginning of a scan with rungs the front end calls CX_Begin."""
    commands = made("PROGRAM Main\nLADDER\nLD 0.00\nTIM 1 #0002\nLD T0001\nOUT W0.00\nEND_LADDER\nEND_PROGRAM")
    session = commands.session
    stands = []
    while session.here.scan < 2:
        if session.statement is not None:
            stands.append(session.plc.image.sites[session.statement.site].pou)
        session.step()
    assert stands[0] == "Main" and "CX_TIM" in stands and "CX_Begin" not in stands
    session.goto(1)
    session.back()
    assert session.statement is None and session.here.scan == 0


@pytest.mark.slow
def test_breakpoints_at_changes_with_conditions_and_hit_counts() -> None:
    commands = made()
    assert said(commands, "break Main.N IF Main.N > 3", "break Twice HITS % 3") == (
        "  1  change of Main.N IF Main.N > 3\n  1  change of Main.N IF Main.N > 3\n  2  text.st:4 HITS % 3")
    assert "breakpoint text.st:4" in said(commands, "run") and commands.session.here == Position(2, 2)
    assert "Main.N was 3, is 4" in said(commands, "run 1s") and commands.session.here == Position(3, 1)
    assert "breakpoint text.st:4" in said(commands, "back run") and commands.session.here == Position(2, 2)
    assert "no breakpoint was reached before" in said(commands, "back run") and commands.session.here == Position(0, 0)
