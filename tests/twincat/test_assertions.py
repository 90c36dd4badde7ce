"""TcUnit's assertions, type by type: what is equal, where arrays differ, how far a real may be off, and the lines of the log."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.testing.suites.results import SuiteRun, run_suites

PAIRS = {
    "BOOL": ("TRUE", "FALSE"), "BYTE": ("0xAB", "0x0C"), "WORD": ("0xAB00", "0x000C"), "DWORD": ("0xAB000000", "0x0000000C"),
    "LWORD": ("0xAB00000000000000", "0x000000000000000C"), "SINT": ("-128", "5"), "INT": ("-32768", "5"),
    "DINT": ("-2147483648", "5"), "LINT": ("-9000000000000000000", "5"), "USINT": ("255", "5"), "UINT": ("65535", "5"),
    "UDINT": ("4294967295", "5"), "ULINT": ("18446744073709551615", "5"), "REAL": ("2.5", "-0.5"), "LREAL": ("2.5", "-0.5"),
}  # fmt: skip
"""By type the texts of two values of it in the log."""
OTHERS = {
    "TIME": ("T#1s", "T#2s"), "LTIME": ("LTIME#1s", "LTIME#1d2h3m4s5ms6us7ns"), "DATE": ("D#2026-11-29", "D#1970-01-01"),
    "TIME_OF_DAY": ("TOD#01:02:03", "TOD#00:00:00"), "DATE_AND_TIME": ("DT#2026-11-29-01:02:03", "DT#1970-01-01-00:00:00"),
    "STRING": ("ab", ""),
}  # fmt: skip
UNPRINTED = tuple(f"Not possible to print {word} unicode WSTRING value" for word in ("EXP", "ACT"))


def written(text: str) -> str:
    """A value of the log in ST."""
    return text.replace("0x", "16#") if text.startswith("0x") else f"'{text}'" if text in ("ab", "") else text


def run_of(declared: str, body: str, types: str = "", program: str = "s : FB_Suite;", run: str = "RUN();") -> SuiteRun:
    made = compile_text(f"""{types}
FUNCTION_BLOCK FB_Suite EXTENDS FB_TestSuite
VAR {declared} END_VAR
{body}
END_FUNCTION_BLOCK
PROGRAM Main VAR {program} END_VAR {run} END_PROGRAM""", dialect="twincat")
    assert made.image is not None, [message.render() for message in made.errors]
    return run_suites(made.image, ["Main.s"], 10**9)


def told(run: SuiteRun, test: str = "t") -> list[str]:
    return [failure.text for failure in run.results["Main.s", test].failures]


@pytest.mark.slow
def test_each_assertion_about_a_value_tells_both_and_takes_equal_ones() -> None:
    rows = {name: pair for name, pair in {**PAIRS, **OTHERS}.items() if name not in ("REAL", "LREAL")}
    checks, expected = [], []
    for name, (one, other) in rows.items():
        for left, right in ((one, one), (other, other), (one, other), (other, one)):
            checks.append(f"AssertEquals_{name}({written(left)}, {written(right)}, '{name}');")
            expected += [f"EXP: {left}, ACT: {right}, MSG: {name}"] * (left != right)
    for left, right in (("a", "a"), ("a", "b"), ("ab", "a")):
        checks.append(f"AssertEquals_WSTRING(\"{left}\", \"{right}\", '{left}');")
        expected += [f"EXP: {UNPRINTED[0]}, ACT: {UNPRINTED[1]}, MSG: {left}"] * (left != right)
    checks.append("AssertTrue(TRUE, 'a'); AssertTrue(FALSE, 'b'); AssertFalse(FALSE, 'c'); AssertFalse(TRUE, 'd');")
    expected += ["EXP: TRUE, ACT: FALSE, MSG: b", "EXP: FALSE, ACT: TRUE, MSG: d"]
    run = run_of("", "TEST('t');\n" + "\n".join(checks) + "\nTEST_FINISHED();")
    assert told(run) == expected
    assert run.results["Main.s", "t"].asserts == 4 * len(rows) + 3 + 4


@pytest.mark.slow
@each_of("type", ["REAL", "LREAL"])
def test_a_real_may_be_off_by_delta_and_no_more(type: str) -> None:
    rows = [("2.0", "2.5", "0.5", True), ("2.0", "1.5", "0.5", True), ("2.0", "2.75", "0.5", False),
            ("2.0", "1.25", "0.5", False), ("-2.0", "-2.5", "0.5", True),
            ("1.0", "1.0", "0.0", True), ("1.0", "1.5", "0.0", False)]  # fmt: skip
    checks = "\n".join(f"AssertEquals_{type}({one}, {other}, {delta}, '');" for one, other, delta, _ in rows)
    assert told(run_of("", f"TEST('t');\n{checks}\nTEST_FINISHED();")) == [
        f"EXP: {one}, ACT: {other}" for one, other, _, good in rows if not good]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("type", PAIRS)
def test_arrays_of_each_type_are_equal_or_differ_at_an_element_or_in_size(type: str) -> None:
    one, other = (written(text) for text in PAIRS[type])
    delta = " 0.0," if "REAL" in type else ""
    declared = " ".join(f"{name} : ARRAY[{bounds}] OF {type} := [{', '.join(values)}];" for name, bounds, values in (
        ("e", "1..3", (one, other, one)), ("same", "5..7", (one, other, one)), ("last", "5..7", (one, other, other)),
        ("first", "-1..1", (other, other, one)), ("short", "2..3", (one, other))))  # fmt: skip
    pairs = [("e", "same"), ("same", "e"), ("e", "last"), ("last", "e"), ("e", "first"), ("e", "short"), ("short", "e")]
    checks = "\n".join(f"AssertArrayEquals_{type}({left}, {right},{delta} 'm');" for left, right in pairs)
    run = run_of(declared, f"TEST('t');\n{checks}\nTEST_FINISHED();")
    one, other = PAIRS[type]
    size = "MSG: m, size of arrays not matching."
    assert told(run) == [
        f"EXP: ARRAY[3] = {one}, ACT: ARRAY[7] = {other}, MSG: m", f"EXP: ARRAY[7] = {other}, ACT: ARRAY[3] = {one}, MSG: m",
        f"EXP: ARRAY[1] = {one}, ACT: ARRAY[-1] = {other}, MSG: m",
        f"EXP: SIZE = 3, ACT: SIZE = 2, {size}", f"EXP: SIZE = 2, ACT: SIZE = 3, {size}"]  # fmt: skip
    assert run.results["Main.s", "t"].asserts == len(pairs)


@pytest.mark.slow
@pytest.mark.parametrize("type", ["REAL", "LREAL"])
def test_tables_of_reals_differ_at_an_element_or_along_a_dimension(type: str) -> None:
    declared = " ".join(f"{name} : ARRAY[{bounds}] OF {type} := [{values}];" for name, bounds, values in (
        ("e", "1..2, 3..5", "1, 2, 3, 4, 5, 6"), ("same", "-1..0, 7..9", "1, 2, 3, 4, 5, 6"),
        ("last", "-1..0, 7..9", "1, 2, 3, 4, 5, 8"), ("first", "-1..0, 7..9", "8, 2, 3, 4, 5, 6"),
        ("low", "1..3, 3..5", "9(1)"), ("wide", "1..2, 3..6", "8(1)"),
        ("f", "1..2, 3..4, 5..7", "12(1)"), ("alike", "2..3, 4..5, 6..8", "12(1)"), ("end", "2..3, 4..5, 6..8", "11(1), 2"),
        ("begin", "2..3, 4..5, 6..8", "2, 11(1)"), ("x", "1..3, 3..4, 5..7", "18(1)"), ("y", "1..2, 3..5, 5..7", "18(1)"),
        ("z", "1..2, 3..4, 5..8", "16(1)")))  # fmt: skip
    flat = [("e", "same"), ("same", "e"), ("e", "last"), ("last", "e"), ("e", "first"), ("e", "low"), ("wide", "e")]
    deep = [("f", "alike"), ("alike", "f"), ("f", "end"), ("end", "f"), ("f", "begin"), ("f", "x"), ("y", "f"), ("f", "z")]
    checks = "\n".join(f"AssertArray{dimensions}dEquals_{type}({left}, {right}, 0.0, '');"
                       for dimensions, pairs in ((2, flat), (3, deep)) for left, right in pairs)  # fmt: skip
    run = run_of(declared, f"TEST('t');\n{checks}\nTEST_FINISHED();")
    size, plain, cube = "MSG: size of arrays not matching.", "SIZE = [1..2,3..5] (2x3)", "SIZE = [1..2,3..4,5..7] (2x2x3)"
    assert told(run) == [
        "EXP: ARRAY[2,5] = 6.0, ACT: ARRAY[0,9] = 8.0", "EXP: ARRAY[0,9] = 8.0, ACT: ARRAY[2,5] = 6.0",
        "EXP: ARRAY[1,3] = 1.0, ACT: ARRAY[-1,7] = 8.0", f"EXP: {plain}, ACT: SIZE = [1..3,3..5] (3x3), {size}",
        f"EXP: SIZE = [1..2,3..6] (2x4), ACT: {plain}, {size}",
        "EXP: ARRAY[2,4,7] = 1.0, ACT: ARRAY[3,5,8] = 2.0", "EXP: ARRAY[3,5,8] = 2.0, ACT: ARRAY[2,4,7] = 1.0",
        "EXP: ARRAY[1,3,5] = 1.0, ACT: ARRAY[2,4,6] = 2.0",
        f"EXP: {cube}, ACT: SIZE = [1..3,3..4,5..7] (3x2x3), {size}",
        f"EXP: SIZE = [1..2,3..5,5..7] (2x3x3), ACT: {cube}, {size}",
        f"EXP: {cube}, ACT: SIZE = [1..2,3..4,5..8] (2x2x4), {size}"]  # fmt: skip
    assert run.results["Main.s", "t"].asserts == len(flat) + len(deep)


@pytest.mark.slow
@pytest.mark.parametrize("type", ["REAL", "LREAL"])
def test_delta_is_a_part_of_the_expected_element(type: str) -> None:
    rows = [("4.0", "5.0", True), ("4.0", "3.0", True), ("4.0", "5.125", False), ("4.0", "2.875", False), ("-4.0", "-5.0", True),
            ("-4.0", "-5.125", False), ("0.0", "0.125", False), ("0.0", "0.0", True)]  # fmt: skip
    declared = " ".join(f"a{at}, b{at} : ARRAY[0..0] OF {type};" for at in range(len(rows)))
    given = " ".join(f"a{at}[0] := {one}; b{at}[0] := {other};" for at, (one, other, _) in enumerate(rows))
    checks = " ".join(f"AssertArrayEquals_{type}(a{at}, b{at}, 0.25, '');" for at in range(len(rows)))
    assert told(run_of(declared, f"{given}\nTEST('t');\n{checks}\nTEST_FINISHED();")) == [
        f"EXP: ARRAY[0] = {one}, ACT: ARRAY[0] = {other}" for one, other, good in rows if not good]  # fmt: skip


@pytest.mark.slow
def test_values_of_different_kinds_are_told_by_their_classes() -> None:
    names = [*PAIRS, *OTHERS, "WSTRING"]
    declared = " ".join(f"v_{name}, w_{name} : {name};" for name in names) + "p : POINTER TO INT; i : INT; x, y : Pair;"
    checks = [f"AssertEquals(v_{name}, x, '');" for name in names] + ["AssertEquals(p, x, '');", "AssertEquals(x, y, '');"]
    run = run_of(declared, "x.a := 1;\nTEST('t');\n" + "\n".join(checks) + "\nTEST_FINISHED();",
                 "TYPE Pair : STRUCT a, b : INT; END_STRUCT END_TYPE")  # fmt: skip
    found = told(run)
    kind = found[0].rpartition("= ")[2].rstrip(")")
    assert kind.isdigit()
    assert found == [f"EXP: (Type class = {name}), ACT: (Type class = {kind})" for name in [*names, "POINTER"]] + [
        "EXP: (bytes), ACT: (bytes)"]  # fmt: skip
    assert run.results["Main.s", "t"].asserts == len(checks)


@pytest.mark.slow
def test_two_variables_are_equal_byte_by_byte_and_two_texts_up_to_their_end() -> None:
    run = run_of("a, b, c : STRING(8); i : INT := 16#0100; j : INT := 16#0200; x : LREAL := 1.0; y : LREAL := 1.5;",
                 """MEMSET(ADR(a), 65, 8); MEMSET(ADR(b), 66, 8); a := 'xy'; b := 'xy';
TEST('t'); AssertEquals(a, b, ''); b := 'x$01y'; c := 'x$01z'; AssertEquals(b, c, ''); c := 'x$01'; AssertEquals(b, c, '');
AssertEquals(i, j, ''); AssertEquals(x, y, ''); AssertEquals(a, a, ''); TEST_FINISHED();""")  # fmt: skip
    assert told(run) == ["EXP: x\x01y, ACT: x\x01z", "EXP: x\x01y, ACT: x\x01", "EXP: 256, ACT: 512", "EXP: 1.0, ACT: 1.5"]
    assert run.results["Main.s", "t"].asserts == 6


# --- tests of a suite, and the log --------------------------------------------------------------------------------------


def log_of(run: SuiteRun) -> list[tuple[int, str]]:
    """Kind and text of each message."""
    read = run.plc.read
    return [(read(f"TwinCAT_Log[{at}].Mask"), read(f"TwinCAT_Log[{at}].Text")) for at in range(read("TwinCAT_LogCount"))]


@pytest.mark.slow
def test_the_log_of_suites_of_several_cycles() -> None:
    run = run_of("t : TON; n : INT;", """n := n + 1;
TEST('good'); AssertTrue(TRUE, ''); AssertTrue(TRUE, ''); TEST_FINISHED();
TEST('bad'); t(IN := TRUE, PT := T#20ms); AssertEquals_INT(1, 2, 'm'); IF t.Q THEN AssertFalse(TRUE, 'n'); TEST_FINISHED(); END_IF
TEST(' DISABLED_off '); AssertTrue(FALSE, ''); TEST_FINISHED();
IF n = 2 THEN TEST('good'); AssertTrue(FALSE, 'twice'); END_IF""", program="s, other : FB_Suite;")
    bad = [(4, "FAILED TEST 'Main.{}@bad', EXP: 1, ACT: 2, MSG: m"),
           (4, "FAILED TEST 'Main.{}@bad', EXP: FALSE, ACT: TRUE, MSG: n")]  # fmt: skip
    twice = (4, "Test with name 'good' already exists in test suite 'Main.{}'")
    begun = [(mask, text.format(name)) for mask, text in (bad[0], twice) for name in ("s", "other")]
    ended = [(bad[1][0], bad[1][1].format(name)) for name in ("s", "other")]
    report = [(1, f"| {line}") for number, name in enumerate(("s", "other")) for line in (
        f"Test suite ID={number} 'Main.{name}'", f"ID={number} number of tests=3, number of failed tests=1, duration=0.02",
        "Test name=good", f"Test class name=Main.{name}", "Test status=PASS, number of asserts=2, duration=0.0",
        "Test name=bad", f"Test class name=Main.{name}", "Test status=FAIL, number of asserts=4, duration=0.02",
        "Test assert message=EXP: 1, ACT: 2, MSG: m", "Test assert type=INT",
        "Test name=off", f"Test class name=Main.{name}", "Test status=SKIP, number of asserts=0, duration=0.0")]  # fmt: skip
    last = [(1, f"| {line}") for line in (
        "==========TESTS FINISHED RUNNING==========", "Test suites: 2", "Tests: 6", "Successful tests: 4", "Failed tests: 2",
        "Duration: 0.03", "======================================")]  # fmt: skip
    assert log_of(run) == begun + ended + report + last
    assert run.plc.scan() is None
    assert len(log_of(run)) == len(begun + ended + report + last)


@pytest.mark.slow
def test_the_duration_of_all_suites_begins_with_their_first_cycle() -> None:
    run = run_of("n : INT; done : BOOL;", "n := n + 1; TEST('t'); IF n = 3 THEN done := TEST_FINISHED(); END_IF",
                 program="s : FB_Suite; n : INT;", run="n := n + 1; IF n > 5 THEN RUN(); END_IF")  # fmt: skip
    assert (1, "| Duration: 0.03") in log_of(run)
    assert (run.results["Main.s", "t"].duration_s, run.plc.read("Main.s.done")) == (0.02, True)


@pytest.mark.slow
def test_suites_run_one_after_the_other_or_side_by_side() -> None:
    body = "n := n + 1; TEST('t'); IF n = 3 THEN TEST_FINISHED(); END_IF"
    for run, cycles in (("RUN();", 3), ("RUN_IN_SEQUENCE();", 6)):
        found = run_of("n : INT;", body, program="s, other, last : FB_Suite; now, done : INT;",
                       run=f"{run} now := now + 1; IF done = 0 AND other.n = 3 THEN done := now; END_IF")  # fmt: skip
        assert (found.plc.read("Main.done"), found.plc.read("Main.s.n"), found.plc.read("Main.last.n")) == (cycles, 3, 3)


@pytest.mark.slow
def test_a_suite_keeps_a_hundred_tests_and_counts_no_assertion_of_more() -> None:
    run = run_of("n : INT; ok, none : BOOL;", """FOR n := 1 TO 101 DO
    TEST(INT_TO_STRING(n)); AssertTrue(n < 100, 'm'); TEST_FINISHED();
END_FOR
ok := TEST_FINISHED_NAMED('1'); none := TEST_FINISHED_NAMED('101');""")
    names = [name for _, name in run.results]
    assert names == [str(number) for number in range(1, 101)]
    assert [name for name in names if run.results["Main.s", name].failed] == ["100"]
    assert (run.plc.read("Main.s.ok"), run.plc.read("Main.s.none"), run.plc.read("Main.s.NumberOfTests")) == (True, False, 100)


@pytest.mark.slow
def test_a_test_that_is_finished_asserts_no_more_and_is_ended_by_its_name() -> None:
    run = run_of("n : INT; a, b, c, d : BOOL;", """n := n + 1;
a := IS_TEST_FINISHED('one'); d := IS_TEST_FINISHED('none');
TEST('one'); AssertTrue(TRUE, ''); AssertTrue(n < 2, 'late');
TEST('two'); IF n = 1 THEN b := IS_TEST_FINISHED('one'); TEST_FINISHED_NAMED('one'); c := IS_TEST_FINISHED('one'); END_IF
AssertTrue(n < 3, 'third'); IF n = 4 THEN TEST_FINISHED(); END_IF""")
    read = run.plc.read
    assert [read(f"Main.s.{name}") for name in "abcd"] == [True, False, True, False]
    one, two = run.results["Main.s", "one"], run.results["Main.s", "two"]
    assert (one.finished, one.failed, one.asserts, one.duration_s) == (True, False, 2, 0.0)
    assert (two.finished, two.failed, two.asserts, two.duration_s) == (True, True, 4, 0.03)
    assert [(failure.text, failure.scan) for failure in two.failures] == [("EXP: TRUE, ACT: FALSE, MSG: third", 2)]


@pytest.mark.slow
def test_ordered_tests_have_their_turn_one_after_the_other() -> None:
    run = run_of("n : INT; first, second, off, third : INT;", """n := n + 1;
IF TEST_ORDERED('a') THEN first := first + 1; IF n = 2 THEN TEST_FINISHED(); END_IF END_IF
IF TEST_ORDERED('disabled_b') THEN off := off + 1; TEST_FINISHED(); END_IF
IF TEST_ORDERED('c') THEN second := second + 1; AssertTrue(TRUE, ''); IF n = 4 THEN TEST_FINISHED(); END_IF END_IF
IF TEST_ORDERED('d') THEN third := third + 1; TEST_FINISHED(); END_IF""")
    assert [run.plc.read(f"Main.s.{name}") for name in ("first", "off", "second", "third")] == [2, 0, 3, 1]
    assert [(result.finished, result.asserts) for result in run.results.values()] == [(True, 0), (False, 0), (True, 3), (True, 0)]


@pytest.mark.slow
def test_an_ordered_test_whose_name_is_taken_has_no_turn() -> None:
    run = run_of("n, twice : INT;", """n := n + 1;
IF TEST_ORDERED('a') THEN IF n = 2 THEN TEST_FINISHED(); END_IF END_IF
IF n = 1 THEN IF TEST_ORDERED('a') THEN twice := 1; END_IF AssertTrue(FALSE, ''); TEST_FINISHED(); END_IF""")
    assert (run.is_over, run.plc.read("Main.s.twice"), run.results["Main.s", "a"].asserts) == (True, 0, 0)


@pytest.mark.slow
def test_a_message_of_a_test_stands_in_the_log_and_a_disabled_name_begins_with_the_word() -> None:
    run = run_of("r : DINT := 5;", """TEST('not disabled_x'); r := TCUNIT_ADSLOGSTR(2, 'a %s c', 'b'); TEST_FINISHED();
TEST('Disabled_'); AssertTrue(FALSE, ''); TEST_FINISHED();""")
    assert log_of(run)[0] == (2, "a b c")
    assert run.plc.read("Main.s.r") == 0
    assert {name: result.skipped for (_, name), result in run.results.items()} == {"not disabled_x": False, "": True}


@pytest.mark.slow
def test_the_duration_of_an_ordered_test_begins_with_its_turn() -> None:
    run = run_of("n : INT;", """n := n + 1;
TEST('beside'); IF n = 7 THEN TEST_FINISHED(); END_IF
IF TEST_ORDERED('a') THEN IF n = 3 THEN TEST_FINISHED(); END_IF END_IF
IF TEST_ORDERED('b') THEN AssertTrue(TRUE, ''); IF n = 4 THEN TEST_FINISHED(); END_IF END_IF
IF TEST_ORDERED('c') THEN IF n = 6 THEN TEST_FINISHED(); END_IF END_IF""")
    assert {name: result.duration_s for (_, name), result in run.results.items()} == {
        "beside": 0.06, "a": 0.02, "b": 0.01, "c": 0.02}  # fmt: skip
    assert run.results["Main.s", "b"].asserts == 2


@pytest.mark.slow
def test_a_name_that_is_given_twice_is_told_once() -> None:
    run = run_of("n : INT;", """n := n + 1;
TEST('a'); TEST('a'); TEST('b'); IF n = 3 THEN TEST('b'); TEST_FINISHED_NAMED('a'); TEST_FINISHED_NAMED('b'); END_IF""")
    assert [text for _, text in log_of(run) if "already" in text] == [
        f"Test with name '{name}' already exists in test suite 'Main.s'" for name in "ab"]  # fmt: skip


@pytest.mark.slow
def test_a_program_has_a_hundred_suites_and_runs_no_more() -> None:
    run = run_of("n : INT;", "n := n + 1; TEST('t'); TEST_FINISHED();",
                 program="first : ARRAY[1..99] OF FB_Suite; s, last : FB_Suite;")  # fmt: skip
    assert [run.plc.read(f"Main.{name}.n") for name in ("first[1]", "first[99]", "s", "last")] == [1, 1, 1, 0]
    assert run.plc.read("TcUnit_Run.NumberOfSuites") == 100


WRITABLE = {**PAIRS, **{name: pair for name, pair in OTHERS.items() if name not in ("LTIME", "STRING")}}


@pytest.mark.slow
def test_a_variable_that_a_test_may_not_assign_is_written_through_its_address() -> None:
    declared = " ".join(f"o_{name} : {name};" for name in WRITABLE) + " o_s : STRING; o_w : WSTRING;"
    checks = []
    for name, (value, _) in WRITABLE.items():
        delta = "0.0, " if "REAL" in name else ""
        checks.append(f"WRITE_PROTECTED_{name}(ADR(k.o_{name}), {written(value)}); "
                      f"AssertEquals_{name}({written(value)}, k.o_{name}, {delta}'{name}');")
    checks.append("WRITE_PROTECTED_STRING(ADR(k.o_s), 'abc'); AssertEquals_STRING('abc', k.o_s, 'STRING');")
    checks.append("WRITE_PROTECTED_WSTRING(ADR(k.o_w), \"abc\"); AssertEquals_WSTRING(\"abc\", k.o_w, 'WSTRING');")
    run = run_of("k : FB_Kept;", "TEST('t');\n" + "\n".join(checks) + "\nTEST_FINISHED();",
                 f"FUNCTION_BLOCK FB_Kept VAR_OUTPUT {declared} END_VAR END_FUNCTION_BLOCK")  # fmt: skip
    assert (told(run), run.results["Main.s", "t"].asserts) == ([], len(checks))
