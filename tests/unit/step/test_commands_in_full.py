"""The commands of `fbvm step`, each with all that it prints and where it stands then, over the corner cases of its arguments."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Mode, Plc
from fbvm.step import commands as module
from fbvm.step.commands import COMMANDS, CommandError, Commands
from fbvm.step.session import Position, Session
from fbvm.step.stop_report import StopReport

MS = 1_000_000
TEXT = """\
FUNCTION_BLOCK Twice
VAR_INPUT A : INT; END_VAR
VAR_OUTPUT Q : INT; END_VAR
    Q := A * 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR Button AT CIO 0.00 : BOOL; N, R : INT; T : Twice; END_VAR
    N := N + 1;
    T(A := N);
    R := 100 / (N - 9);
END_PROGRAM
"""
IMAGE = compile_text(TEXT).image
"""Of a scan the statements are those of the lines 8, 9, 4 and 10."""


def commands(packets: list[Any] | None = None) -> Commands:
    assert IMAGE is not None
    image = IMAGE
    session = Session.of(lambda: Plc(image))
    return Commands(session, StopReport(session, {"text.st": TEXT}), lambda: packets or [])


def said(made: Commands, line: str) -> list[str]:
    """What is printed, without what each stop prints."""
    try:
        printed = list(made.run(line))
    except CommandError as error:
        return [f"! {error}"]
    end = next((number for number, text in enumerate(printed) if text.startswith("scan ")), len(printed))
    return printed[:end]


def place(made: Commands) -> tuple[int, int | None]:
    site = made.report.site()
    return made.session.here.scan, site.line if site else None


EXPRESSION = "! {} is an expression: `expect` says whether a condition holds, `print` shows variables"


@each_of("lines, printed, stands", [
    # moves count from 1, and one of them is meant if nobody says how many
    ("step", [], (0, 9)), ("step 3", [], (0, 10)), ("next 2", [], (0, 10)), ("step 2|next", [], (0, 10)),
    ("step 2|out", [], (0, 10)),
    ("scan", [], (1, 8)), ("SCAN 3", [], (3, 8)), ("step|scan", [], (1, 8)), ("goto 0", [], (0, 8)), ("goto 4|goto", [], (1, 8)),
    ("step 3|back", [], (0, 4)), ("step 3|back 2", [], (0, 9)), ("scan 2|step 2|back scan", [], (2, 8)),
    ("scan 2|step 2|back SCAN|back scan", [], (1, 8)),
    # a line that goes on with an operator is an expression, whatever its variable is called
    ("n MOD 0", [EXPRESSION.format("n MOD 0")], (0, 8)), ("S > 3", [EXPRESSION.format("S > 3")], (0, 8)),
    ("n + 1", [EXPRESSION.format("n + 1")], (0, 8)), ("b  and c", [EXPRESSION.format("b  and c")], (0, 8)),
    ("run -Main.N > 0", ["-Main.N > 0 was not reached in 6 scans"], (6, 8)),
    ("step 0", ["! '0' is no number of steps"], (0, 8)), ("back 0", ["! '0' is no number of steps"], (0, 8)),
    ("scan x", ["! 'x' is no number of steps"], (0, 8)), ("goto -1", ["! '-1' is no number of steps"], (0, 8)),
    # an empty line does the last move again
    ("|", [], (0, 4)), ("scan 2|print Main.N|", [], (4, 8)),
    # run: a place or a condition is looked for in some scans, a time is that of whole scans
    ("run 4", [], (0, 4)), ("run text.st:10", [], (0, 10)), ("run Twice", [], (0, 4)), ("run Main.N = 3", [], (2, 9)),
    ("run 1ms", [], (1, 8)), ("run 10ms", [], (1, 8)), ("run 11ms", [], (2, 8)), ("run T#20ms", [], (2, 8)),
    ("run t#0s", [], (1, 8)),    ("run 0.03s", [], (3, 8)),
    ("run", ["! say where to: a line, a condition or a time; or set breakpoints"], (0, 8)),
    ("run Main.N = -3", ["Main.N = -3 was not reached in 6 scans"], (6, 8)),
    ("run Main.R = 7", ["Main.R = 7 was not reached in 6 scans"], (6, 8)),
    ("break Main.N = -3|run", ["no breakpoint was reached in 6 scans"], (6, 8)),
    ("break Main.N = -3|run 70ms", [], (7, 8)),
    ("scan 4|run Main.N = -3", [], (8, 10)), ("break Main.N = -3|scan 4|run", [], (8, 10)),
    ("break Main.N = 2|run", ["Main.N = 2 holds"], (1, 9)), ("break Main.N = 2|run 50ms", ["Main.N = 2 holds"], (1, 9)),
    # back: to where it was so, or to the last breakpoint
    ("scan 4|back Main.N = 2", [], (2, 8)), ("scan 4|back 4", [], (3, 9)), ("scan 4|back text.st:4", [], (3, 4)),
    ("scan 2|back Main.N = 77", ["Main.N = 77 was never reached before"], (2, 8)),
    ("scan 2|back run", ["! set breakpoints first, or say where to: a line or a condition"], (2, 8)),
    ("break Twice|scan 2|back RUN", ["breakpoint text.st:4"], (1, 4)),
    ("break Main.N = 77|scan 2|back run", ["no breakpoint was reached before"], (0, 8)),
    # a remark does nothing
    ("// scan|  //", [], (0, 8)),
])
def test_where_a_move_ends_and_what_it_says(lines: str, printed: list[str], stands: tuple[int, int | None],
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LOOK_AHEAD_NS", 69 * MS)
    made = commands()
    assert ([said(made, line) for line in lines.split("|")][-1], place(made)) == (printed, stands)


@each_of("ahead_ms, scans", [(5, 1), (15, 1), (20, 2), (39, 3)])
def test_a_run_looks_through_one_scan_at_least(ahead_ms: int, scans: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LOOK_AHEAD_NS", ahead_ms * MS)
    assert said(commands(), "run Main.N = -3") == [f"Main.N = -3 was not reached in {scans} scans"]


def test_a_refused_move_is_what_an_empty_line_does_again() -> None:
    made = commands()
    refused = ["! 'x' is no number of steps"]
    assert [said(made, line) for line in ("scan 2", "goto x", "")] == [[], refused, refused]
    assert place(made) == (2, 8)


HERE = "text.st:8 in Main"


@each_of("lines, printed", [
    # breakpoints are listed with their numbers, which are counted anew
    ("break Main.N|break Twice IF Main.N > 3|break 10 HITS % 2|break Main.N = 4|unbreak 1|break",
     ["  1  text.st:4 IF Main.N > 3", "  2  text.st:10 HITS % 2", "  3  Main.N = 4"]),
    ("break Main.N|break Main.R HITS 3|unbreak 2|break", ["  1  change of Main.N"]),
    ("break Main.N|break Main.R|unbreak 3", ["! there is no breakpoint 3"]), ("unbreak 1", ["! there is no breakpoint 1"]),
    ("break Main.N|break Main.R|unbreak|break", []), ("break", []),
    # values
    ("print Main.N, Main.R D7", ["Main.N = 0", "Main.R = 0", "D7 = 0 (16#0000)"]), ("print", ["! name something"]),
    ("watch", ["! name something"]), ("watch Main.N|watch main.n Main.R|scan 2|watch Main.T.Q", ["Main.T.Q = 4"]),
    ("watch Main.N IF Main.N =", ["! 'Main.N =' ends too early"]),
    ("write Main.N = 5", ["Main.N = 5"]), ("write Main.N := 5", ["Main.N = 5"]), ("write Main.N=5", ["Main.N = 5"]),
    ("Main.N := 5", ["Main.N = 5"]), ("Main.N = 5", ["Main.N = 5"]), ("write Main.N 5", ["! write NAME = VALUE"]),
    ("write = 5", ["! there is no write; known here: Main"]), ("write Main.N =", ["! write NAME = VALUE"]),
    ("Main.N <= 5", ["! 'Main.N' is no command; `help` lists them"]),
    ("Main.N >= 5", ["! 'Main.N' is no command; `help` lists them"]),
    ("write D0..D1 = 1, 2", ["D0 = 1 (16#0001)\nD1 = 2 (16#0002)"]),
    ("force Main.N = 5|scan 3|print Main.N", ["Main.N = 5"]), ("force D0..D1 = 1, 2", ["! force one place after the other"]),
    ("unforce Nobody", ["! there is no Nobody; known here: Main"]),
    ("unforce Main.T", ["! name one variable, not a block, an array or a range"]),
    ("expect Main.N = 0", []), ("expect Main.N = 1", [f"! Main.N = 1 does not hold in scan 0, 0s: {HERE}"]),
    ("scan|expect Main.N = 0", [f"! Main.N = 0 does not hold in scan 1, 10ms: {HERE}"]),
    # between two scans
    ("mode program|scan|print Main.N", ["Main.N = 0"]), ("mode", ["! mode PROGRAM, or mode RUN"]),
    ("mode stop", ["! mode PROGRAM, or mode RUN"]), ("power COLD", []), ("power off", ["! power, or power cold"]),
    ("step|mode RUN", ["! that can be done between two scans only; `scan` or `back scan` goes there"]),
    ("step|power", ["! that can be done between two scans only; `scan` or `back scan` goes there"]),
    # the last five scans
    ("table", ["! name variables, or watch some"]), ("calls", ["  text.st:8            Main (Main)"]),
    ("list 0", ["! '0' is no number of steps"]), ("rung", ["! there are no rungs here"]), ("sfc", ["! there is no chart here"]),
    ("why Main.T", ["! name one variable, not a block, an array or a range"]), ("why", ["! name something"]),
    # words that are none
    ("brek", ["! 'brek' is no command; did you mean break?"]), ("BREK 3", ["! 'BREK' is no command; did you mean break?"]),
    ("xyzzy", ["! 'xyzzy' is no command; `help` lists them"]), ("help xyzzy", ["! 'xyzzy' is no command"]),
    ("help brek", ["! 'brek' is no command; did you mean break?"]),
    ("help next", ["  n  next [N]                         one statement on, blocks at once"]),
    ("help N", ["  n  next [N]                         one statement on, blocks at once"]),
    ("help UNBREAK", ["     unbreak [NUMBER]                 takes a breakpoint away, or all"]),
])
def test_what_a_command_prints(lines: str, printed: list[str]) -> None:
    made = commands()
    assert [said(made, line) for line in lines.split("|")][-1] == printed


def test_a_stop_tells_the_place_the_source_what_changed_and_what_is_watched() -> None:
    made = commands()
    list(made.run("watch Main.N D7 IF Main.N > 1"))
    list(made.run("watch Main.R"))
    stop = ["scan 1, 10ms: text.st:8 in Main", "     6  PROGRAM Main",
            "     7  VAR Button AT CIO 0.00 : BOOL; N, R : INT; T : Twice; END_VAR",
            " >   8      N := N + 1;", "     9      T(A := N);", "    10      R := 100 / (N - 9);"]
    assert list(made.run("scan")) == [*stop, "  Main.N: 0 -> 1", "  Main.R: 0 -> -12", "  Main.T.A: 0 -> 1", "  Main.T.Q: 0 -> 2",
                                      "Main.R = -12"]
    assert list(made.run("step"))[-4:] == ["  Main.N: 1 -> 2", "Main.N = 2", "D7 = 0 (16#0000)", "Main.R = -12"]
    list(made.run("watch main.r D7"))
    assert [(each.name, each.condition is None) for each in made.watches] == [("Main.N", False), ("main.r", True), ("D7", True)]
    list(made.run("unwatch MAIN.N"))
    assert [each.name for each in made.watches] == ["main.r", "D7"]
    list(made.run("unwatch"))
    assert made.watches == []


@pytest.mark.slow
@each_of("scans, first", [(1, 0), (4, 0), (5, 1), (7, 3)])
def test_a_table_has_the_last_five_scans(scans: int, first: int) -> None:
    made = commands()
    list(made.run(f"scan {scans}"))
    made.session.step()
    [drawn] = list(made.run("table Main.N"))
    assert [line.split()[1] for line in drawn.splitlines() if line.startswith("scan")] == [
        str(number) for number in range(first, scans + 1)]
    list(made.run("watch Main.N"))
    assert list(made.run("table")) == [drawn]


class Row:
    """Something that has passed the network."""

    def __init__(self, now_ms: int) -> None:
        self.now_ns = now_ms * MS

    def __str__(self) -> str:
        return f"at {self.now_ns // MS}ms"


@each_of("line, printed", [("net", [20, 29]), ("net 2", [10, 19, 20, 29]), ("net 9", [0, 10, 19, 20, 29])])
def test_the_network_of_the_last_scans(line: str, printed: list[int]) -> None:
    made = commands([Row(at) for at in (0, 10, 19, 20, 29, 30, 31)])
    list(made.run("scan 3"))
    assert said(made, line) == [f"  at {at}ms" for at in printed]


def test_mode_and_power_are_those_of_the_plc() -> None:
    made, plc = commands(), lambda: made.session.plc
    assert plc().mode is Mode.RUN
    for line, mode, number in (("scan 3", Mode.RUN, 3), ("mode Program", Mode.PROGRAM, 3), ("scan", Mode.PROGRAM, 3),
                               ("mode RUN", Mode.RUN, 0), ("scan", Mode.RUN, 1), ("power", Mode.RUN, 0), ("scan 2", Mode.RUN, 2),
                               ("power cold", Mode.RUN, 0)):  # fmt: skip
        list(made.run(line))
        assert (plc().mode, made.session.read("Main.N")) == (mode, number), line
    assert made.session.here == Position(7) and not made.ended
    assert list(made.run(" Quit ")) == [] and made.ended


@each_of("text, wanted", [
    ("", [each.name for each in COMMANDS]), ("UN", ["unbreak", "unwatch", "unforce"]), ("  st", ["step"]), ("xyz", []),
    ("help un", ["unbreak", "unwatch", "unforce"]), ("help S", ["step", "s", "scan", "sfc"]),
    ("h w", ["watch", "w", "write", "why"]),
    ("print ", ["Main"]), ("PRINT m", ["Main"]), ("print Main.", ["Main.Button", "Main.N", "Main.R", "Main.T"]),
    ("p main.t.", ["main.t.A", "main.t.Q"]), ("watch Main.N, Main.T.q", ["Main.T.Q"]), ("expect (Main.b", ["Main.Button"]),
    ("break Ma", ["Main"]), ("print Main.N.", []), ("print Nobody.", []), ("print D0..", []), ("mode ", []), ("calls M", []),
    ("Main.N := Main.R", ["Main.R"]), ("step ", []),
])
def test_how_a_line_may_go_on(text: str, wanted: list[str]) -> None:
    assert commands().completions(text) == wanted


@each_of("line, kept", [("power", 3), ("power cold", 0), ("power COLD", 0)])
def test_what_is_retained_is_forgotten_by_a_cold_start_only(line: str, kept: int) -> None:
    text = "PROGRAM Main\nVAR n : INT; END_VAR\nVAR RETAIN k : INT; END_VAR\n    n := n + 1; k := k + 1;\nEND_PROGRAM\n"
    image = compile_text(text).image
    assert image is not None
    session = Session.of(lambda: Plc(image))
    made = Commands(session, StopReport(session, {"text.st": text}))
    assert said(made, "scan 3") == said(made, line) == []
    assert [session.read(f"Main.{name}") for name in ("n", "k")] == [0, kept]


@pytest.mark.slow
def test_a_rung_may_have_the_number_0() -> None:
    text = "PROGRAM Main\nLADDER\nRUNG 0\nLD 0.00\nOUT 1.00\nRUNG 1\nLD 0.01\nOUT 1.01\nEND_LADDER\nEND_PROGRAM\n"
    image = compile_text(text).image
    assert image is not None
    session = Session.of(lambda: Plc(image))
    made = Commands(session, StopReport(session, {"text.st": text}))
    assert [said(made, f"rung {number}")[0].split()[:2] for number in (0, 1)] == [["RUNG", "0"], ["RUNG", "1"]]
    assert said(made, "rung 2") == ["! there is no rung 2; rungs are 0 to 1"]


@each_of("text, least, wanted", [("", 1, 1), ("", 0, 1), ("1", 1, 1), ("0", 0, 0), ("12", 1, 12), ("0", 1, None), ("-1", 0, None),
                                 ("+1", 1, None), ("1.0", 1, None), ("1_0", 1, None)])
def test_how_many_is_a_number_in_digits(text: str, least: int, wanted: int | None) -> None:
    if wanted is None:
        with pytest.raises(CommandError, match="is no number of steps"):
            module._count(text, least)
    else:
        assert module._count(text, least) == wanted
