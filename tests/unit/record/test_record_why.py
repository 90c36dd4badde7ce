"""Why a variable has its value."""

from __future__ import annotations

import io

import pytest
from trace_rig import image, press, traced

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Phase, Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.draw.why import Cause, cause_text, why
from fbvm.record.trace.outline import outer_statements
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.writer import Depth, TraceWriter
from fbvm.units.etn21.unit import Etn21
from fbvm.watch.paths import Place


@pytest.fixture(scope="module")
def trace() -> Trace:
    return traced(300, Depth.STATEMENTS)


def ask(trace: Trace, name: str, scan: int, deepest: int = 6) -> Cause:
    place = trace.find(name)
    assert isinstance(place, Place)
    return why(trace, place, scan, deepest)


@pytest.mark.slow
def test_the_statement_and_what_it_read(trace: Trace) -> None:
    cause = ask(trace, "Main.Pump", 41)
    assert cause.value == "TRUE"
    assert cause.change and cause.change.site
    assert (cause.change.scan, cause.change.site.line, cause.change.instance) == (8, 17, "Main")
    assert [(inner.place.name, inner.value, inner.guard) for inner in cause.causes] == [("Main.Delay.Q", "TRUE", False)]


@pytest.mark.slow
def test_conditions_around_a_statement_count(trace: Trace) -> None:
    cause = ask(trace, "D200", 41)
    assert [(inner.place.name, inner.value) for inner in cause.causes if inner.guard] == [
        ("Main.Pump", "TRUE"), ("Main.Starts.CV", "1"),
    ]  # fmt: skip


@pytest.mark.slow
def test_the_chain_goes_back_to_what_came_from_outside(trace: Trace) -> None:
    text = cause_text(trace, ask(trace, "Main.Pump", 41))
    assert text.splitlines()[0] == "Main.Pump = TRUE since scan 8 (80ms), by pump.st:17 in Main:  Pump := Delay.Q;"
    assert "Main.Start = TRUE since scan 3 (30ms), from outside the program" in text
    assert "(see above)" in text


@pytest.mark.slow
def test_each_scan_has_its_own_answer(trace: Trace) -> None:
    assert "FALSE since power-on" in cause_text(trace, ask(trace, "Main.Pump", 7))
    assert "FALSE since scan 150" in cause_text(trace, ask(trace, "Main.Pump", 299))


@pytest.mark.slow
def test_only_so_deep(trace: Trace) -> None:
    assert len(cause_text(trace, ask(trace, "Main.Pump", 41, 0)).splitlines()) == 1
    assert len(cause_text(trace, ask(trace, "Main.Pump", 41, 1)).splitlines()) == 2


@pytest.mark.slow
def test_what_is_long_ago_is_found() -> None:
    trace = traced(400, Depth.STATEMENTS)
    assert "FALSE since scan 150" in cause_text(trace, ask(trace, "Main.Pump", 399))


@pytest.mark.slow
def test_a_trace_that_begins_later_says_so() -> None:
    plc, file = Plc(image()), io.BytesIO()
    for _ in range(20):
        press(plc)
        plc.scan()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=5)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    assert cause_text(trace, ask(trace, "Main.Pump", 24)) == "Main.Pump = TRUE since before scan 20, the first of the trace"


@pytest.mark.slow
def test_a_copy_of_a_large_array_is_a_write_of_its_elements() -> None:
    plc, file = Plc(image("PROGRAM Main VAR n : DINT; a, b : ARRAY[0..1999] OF DINT; END_VAR\n"
                          "n := n + 1;\nIF n = 3 THEN b[7] := n; END_IF\na := b;\nEND_PROGRAM")), io.BytesIO()  # fmt: skip
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=6)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    lines = [cause_text(trace, ask(trace, name, 5, 0)) for name in ("Main.a[7]", "Main.a[8]")]
    assert lines == ["Main.a[7] = 3 since scan 2 (20ms), by pump.st:4 in Main", "Main.a[8] = 0 since power-on"]


@pytest.mark.slow
def test_a_unit_changes_words_in_the_refresh() -> None:
    plc, file = Plc(image()), io.BytesIO()
    plc.attach(Etn21(0, "192.168.250.21"), LoopNetwork())
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=3)
    plc.write("CIO 1519.00", True)
    plc.run(scans=3)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    phases = {name: ask(trace, name, 5).change for name in ("CIO 1509.15", "CIO 1519.00")}
    assert {name: change.phase for name, change in phases.items() if change} == {"CIO 1519.00": Phase.REFRESH}


@pytest.mark.slow
def test_a_bit_of_a_word_that_was_written_whole() -> None:
    made = image("PROGRAM Main VAR n : INT; w : WORD; END_VAR n := n + 1; %W5 := INT_TO_WORD(n); w := %W5; END_PROGRAM")
    plc, file = Plc(made), io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=10)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    changes = [ask(trace, name, 9).change for name in ("W5.00", "W5.02", "W5.03")]
    assert [change and change.scan for change in changes] == [9, 7, 7]


def _recorded(text: str, scans: int = 1, *ons: str) -> Trace:
    """The trace of some scans of a program, in which BOOL variables become TRUE after the first."""
    plc, file = Plc(image(text)), io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.scan()
    for on in ons:
        plc.write(on, True)
    plc.run(scans=scans - 1)
    writer.close()
    return Trace(io.BytesIO(file.getvalue()))


def _causes(text: str, name: str, *ons: str) -> list[tuple[str, str]]:
    """What gave a place its value after 30 scans, each with the value that it had."""
    cause = ask(_recorded(text, 30, *ons), name, 29, 1)
    return [(inner.place.name, inner.value) for inner in cause.causes]


@pytest.mark.slow
def test_contacts_of_a_rung_are_what_its_coil_read() -> None:
    rungs = "LD Start\nOR Motor\nANDNOT Stop\nOUT Motor\nLD Motor\nTIM 0001 #0002\nLD T0001\nANDNOT C0001\nOUT Lamp"
    text = f"PROGRAM Main VAR Start, Stop, Motor, Lamp : BOOL; END_VAR LADDER\n{rungs}\nEND_LADDER END_PROGRAM"
    assert _causes(text, "Main.Motor", "Main.Start") == [("Main.Start", "TRUE"), ("Main.Motor", "FALSE"), ("Main.Stop", "FALSE")]
    assert _causes(text, "Main.Lamp", "Main.Start") == [("T0001", "TRUE"), ("C0001", "FALSE")]


@pytest.mark.slow
def test_what_an_instruction_does_inside_counts_to_its_rung() -> None:
    rungs = "LD Start\nTIM 0001 #0002\nLD T0001\n@++ D200\nLD P_On\nMOV T1 D201"
    text = f"PROGRAM Main VAR Start : BOOL; END_VAR\nLADDER\n{rungs}\nEND_LADDER END_PROGRAM"
    trace = _recorded(text, 30, "Main.Start")
    assert cause_text(trace, ask(trace, "D200", 29)).splitlines() == [
        "D200 = 1 since scan 21 (210ms), by pump.st:6 in Main",
        "└ T0001 = TRUE since scan 21 (210ms), by pump.st:4 in Main",
        "  └ Main.Start = TRUE since scan 1 (10ms), from outside the program",
    ]
    assert [(cause.place.name, cause.value) for cause in ask(trace, "D201", 29, 1).causes][1:] == [("T1", "0")]


@pytest.mark.slow
def test_what_a_function_was_given_is_what_its_result_is_made_of() -> None:
    text = """FUNCTION Scaled : INT
        VAR_INPUT raw, low : INT; END_VAR
        VAR i : INT; END_VAR
        FOR i := 1 TO 3 DO Scaled := Scaled + raw; END_FOR
        Scaled := Scaled + low;
        END_FUNCTION
        PROGRAM Main
        VAR on : BOOL; raw : INT := 5; low : INT := 100; shown, other : INT; END_VAR
        IF on THEN shown := Scaled(raw, low); END_IF
        END_PROGRAM"""
    assert sorted(_causes(text, "Main.shown", "Main.on")) == [("Main.low", "100"), ("Main.on", "TRUE"), ("Main.raw", "5")]


def test_a_scan_that_is_not_there(trace: Trace) -> None:
    with pytest.raises(ValueError, match="scan 300 is not in the trace"):
        ask(trace, "D200", 300)


def test_rungs_whose_statements_begin_at_one_place_come_to_an_end() -> None:
    """A rung, its first step, a jump back and the loop that it makes all begin at the same characters."""
    rungs = "LD 0.00\nTIM 1 #0001\nJME 7\nLD T0001\nOUT W0.00\nLD P_Off\nCJP 7"
    made = compile_text(f"PROGRAM Main\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM").image
    assert made is not None
    outer = outer_statements(made)
    for site in range(len(outer)):
        steps = 0
        while site >= 0:
            site, steps = outer[site], steps + 1
            assert steps < 10


@pytest.mark.slow
def test_what_lies_behind_a_reference_is_explained_where_it_lies() -> None:
    plc = Plc(image("FUNCTION_BLOCK Adder VAR_IN_OUT total : INT; END_VAR\ntotal := total + 1;\nEND_FUNCTION_BLOCK\n"
                    "PROGRAM Main VAR a, b : INT; r, none : REF_TO INT; f : REFERENCE TO INT; add : Adder; END_VAR\n"
                    "f REF= b; r := REF(a);\n"
                    "r^ := r^ + 1;\n"
                    "add(total := b);\n"
                    "END_PROGRAM"))
    file = io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=3)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    lines = {name: cause_text(trace, ask(trace, name, 2, 0)) for name in ("Main.r^", "Main.f", "Main.add.total", "Main.none^")}
    assert lines == {
        "Main.r^": "Main.r^ (Main.a) = 3 since scan 2 (20ms), by pump.st:6 in Main",
        "Main.f": "Main.f (Main.b) = 3 since scan 2 (20ms), by pump.st:2 in Main.add",
        "Main.add.total": "Main.add.total (Main.b) = 3 since scan 2 (20ms), by pump.st:2 in Main.add",
        "Main.none^": "Main.none^ = NULL since power-on",
    }


@pytest.mark.slow
def test_an_interlock_is_why_its_outputs_are_off() -> None:
    rungs = "LD Go\nANDNOT Stop\nIL\nLD P_On\nOUT Motor\nILC\nLD P_On\nOUT Lamp"
    variables = "VAR Go : BOOL := TRUE; Stop, Motor, Lamp : BOOL; n : INT; END_VAR"
    text = f"PROGRAM Main {variables} LADDER\n{rungs}\nEND_LADDER n := 5; END_PROGRAM"
    plc, file = Plc(image(text)), io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=5)
    plc.write("Main.Stop", True)
    plc.run(scans=5)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    assert cause_text(trace, ask(trace, "Main.Motor", 9, 1)).splitlines()[1:] == [
        "├ if Main.Go = TRUE since power-on",
        "└ if Main.Stop = TRUE since scan 5 (50ms), from outside the program",
    ]
    assert ask(trace, "Main.n", 9, 1).causes == []


FIRST = """PROGRAM Main
VAR Seen, Copied, Given, Taken : INT; END_VAR
IF Seen = 0 THEN
Seen := 5;
END_IF
IF Copied = 0 THEN
Copied := Seen;
END_IF
IF Taken = 0 THEN
Taken := Given;
END_IF
END_PROGRAM
"""


def recorded_from(first: int, scans: int) -> Trace:
    """A trace of FIRST whose first scan has that number; Given is written from outside before the first and third of them."""
    plc, file = Plc(image(FIRST)), io.BytesIO()
    for _ in range(first):
        plc.scan()
        plc.write("Main.Seen", 0)
        plc.write("Main.Copied", 0)
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    for number in range(scans):
        if number in (0, 2):
            plc.write("Main.Given", 7 + number)
        plc.scan()
    writer.close()
    return Trace(io.BytesIO(file.getvalue()))


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, 20])
@pytest.mark.parametrize("asked", [0, 1, 98, 99, 100, 101])
def test_a_cause_in_the_first_recorded_scan(first: int, asked: int) -> None:
    """Also from outside the program, and where the search begins with the scans behind it."""
    trace, at = recorded_from(first, 102), f"since scan {first} ({f'{first * 10}ms' if first else '0s'})"
    assert cause_text(trace, ask(trace, "Main.Copied", first + asked)).splitlines() == [
        f"Main.Copied = 5 {at}, by pump.st:7 in Main",
        f"├ Main.Seen = 5 {at}, by pump.st:4 in Main",
        f"│ └ if Main.Seen = 0 {'since before scan 20, the first of the trace' if first else 'since power-on'}",
        f"└ if Main.Copied = 0 {'since before scan 20, the first of the trace' if first else 'since power-on'}",
    ]


@pytest.mark.slow
def test_a_cause_before_all_windows_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.record.draw.why.WINDOWS", (2, 4))
    trace = recorded_from(20, 12)
    for asked in range(12):
        assert cause_text(trace, ask(trace, "Main.Seen", 20 + asked)).splitlines() == [
            "Main.Seen = 5 since scan 20 (200ms), by pump.st:4 in Main",
            "└ if Main.Seen = 0 since before scan 20, the first of the trace"]


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, 20])
def test_a_cause_from_outside_in_the_third_scan_and_none_before_the_first(first: int) -> None:
    """What was written before the first recorded scan is there when the trace begins."""
    trace, begin = recorded_from(first, 105), "since before scan 20, the first of the trace" if first else "since power-on"
    assert cause_text(trace, ask(trace, "Main.Taken", first + 4)).splitlines() == [
        f"Main.Taken = 7 since scan {first} ({f'{first * 10}ms' if first else '0s'}), by pump.st:10 in Main",
        f"├ Main.Given = 7 {begin}",
        f"└ if Main.Taken = 0 {begin}",
    ]
    assert cause_text(trace, ask(trace, "Main.Given", first + 1)) == f"Main.Given = 7 {begin}"
    for asked in (2, 3, 100, 101, 102, 104):
        assert cause_text(trace, ask(trace, "Main.Given", first + asked)) == \
            f"Main.Given = 9 since scan {first + 2} ({10 * first + 20}ms), from outside the program"


OBJECTS = """FUNCTION_BLOCK Motor
    VAR speed : INT; END_VAR
    METHOD PUBLIC Start : INT
    VAR_INPUT much : INT; END_VAR
    VAR_OUTPUT twice : INT; END_VAR
    twice := 2 * much;
    Start := speed;
    END_METHOD
    PROPERTY PUBLIC Actual : INT
    GET Actual := speed * 2; END_GET
    SET speed := Actual; END_SET
    END_PROPERTY
    END_FUNCTION_BLOCK
    PROGRAM Main
    VAR fast, slow : Motor; limit : INT := 7; seen, got, doubled : INT; high, even : BOOL; END_VAR
    fast.Actual := 5;
    slow.Actual := limit;
    seen := fast.Actual + slow.Actual;
    IF fast.Actual > 9 THEN high := TRUE; END_IF;
    got := fast.Start(much := 2);
    WHILE slow.Actual < 10 DO EXIT; END_WHILE;
    slow.Start(much := limit, twice => doubled);
    END_PROGRAM"""


@pytest.mark.parametrize(
    ("name", "causes"),
    [
        ("seen", ["Main.fast.Actual = 10 line 10", "Main.slow.Actual = 14 line 10"]),
        ("high", ["Main.fast.Actual = 10 line 10"]),
        ("got", ["Main.fast.Start.twice = 4 line 6", "Main.fast.Start = 5 line 7"]),
        ("doubled", ["Main.limit = 7", "Main.slow.Start.twice = 14 line 6", "Main.slow.Start = 7 line 7"]),
        ("slow.speed", ["Main.limit = 7"]),
    ],
)
def test_what_a_property_or_method_returns_names_its_assignment(name: str, causes: list[str]) -> None:
    found = ask(_recorded(OBJECTS), f"Main.{name}", 0).causes
    lines = [f" line {cause.change.site.line}" if cause.change and cause.change.site else "" for cause in found]
    assert [f"{cause.place.name} = {cause.value}{line}" for cause, line in zip(found, lines, strict=True)] == causes


def test_methods_of_a_namespace_are_named_by_their_instance() -> None:
    block, _, program = OBJECTS.partition("PROGRAM Main")
    text = f"NAMESPACE Plant.Drives {block} END_NAMESPACE PROGRAM Main{program.replace(': Motor', ': Plant.Drives.Motor')}"
    found = ask(_recorded(text), "Main.got", 0).causes
    assert [cause.place.name for cause in found] == ["Main.fast.Start.twice", "Main.fast.Start"]


def test_a_method_that_calls_itself_returns_what_its_calls_have_read() -> None:
    text = OBJECTS.replace("Start := speed;", "IF much > 1 THEN Start := THIS^.Start(much - 1); RETURN; END_IF; Start := speed;")
    assert [(cause.place.name, cause.value) for cause in ask(_recorded(text), "Main.got", 0).causes] == [("Main.fast.speed", "5")]


def test_the_result_of_a_function_is_made_of_the_globals_that_it_has_read() -> None:
    text = """VAR_GLOBAL offset : INT := 3; END_VAR
        FUNCTION Shifted : INT
        VAR_INPUT raw : INT; END_VAR
        VAR_EXTERNAL offset : INT; END_VAR
        Shifted := raw + offset;
        END_FUNCTION
        PROGRAM Main
        VAR raw : INT := 5; shown : INT; END_VAR
        shown := Shifted(raw);
        END_PROGRAM"""
    assert sorted(cause.place.name for cause in ask(_recorded(text), "Main.shown", 0).causes) == ["Main.raw", "offset"]
