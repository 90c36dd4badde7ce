"""The blocks of matiec: its counters and timers against tables, the additional ones beside a straight model of each."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from rows import each_of
from test_iec_blocks import COUNTERS, MS, image_of, plain, plays

from fbvm.base.data import data_folder
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc


def scans(declared: str, call: str, count: int, dialect: str = "matiec") -> Iterator[Any]:
    """The block `b` after each scan; `n` counts the scans from 1."""
    made = compile_text(f"PROGRAM Main VAR b : {declared}; n : INT; END_VAR n := n + 1; b({call}); END_PROGRAM", dialect=dialect)
    assert made.image is not None, [d.render() for d in made.errors]
    plc = Plc(made.image, 100_000_000)
    for _ in range(count):
        plc.scan()
        yield plc.read("Main.b")


@pytest.mark.parametrize("dialect", ["matiec", "strucpp"])
def test_pid_against_a_model_in_seconds(dialect: str) -> None:
    call = "AUTO := n > 2, PV := INT_TO_REAL(n) * 0.5, SP := 3.0, X0 := 0.25, KP := 2.0, TR := 4.0, TD := 0.5, CYCLE := T#100ms"
    integral, past = 0.0, [0.0, 0.0, 0.0]
    for n, block in enumerate(scans("PID", call, 20, dialect), 1):
        error, slope = n * 0.5 - 3.0, 0.0
        if n > 2:
            integral += error * 0.1
            slope = (3 * (error - past[2]) + past[0] - past[1]) / (10 * 0.1)
            past = [error, *past[:2]]
        else:
            integral, past = 4.0 * (0.25 - error), [error] * 3
        assert block["XOUT"] == pytest.approx(2.0 * (error + integral / 4.0 + slope * 0.5), abs=1e-4), n


def test_ramp_up_and_back() -> None:
    seen = [(block["XOUT"], block["BUSY"]) for block in scans(
        "RAMP", "RUN := n > 1 AND n < 7, X0 := 2.0, X1 := 10.0, TR := T#400ms, CYCLE := T#100ms", 8)]
    assert seen == [(2.0, False), (2.0, True), (4.0, True), (6.0, True), (8.0, True), (10.0, False), (2.0, False), (2.0, False)]


@pytest.mark.slow
def test_integral_begins_where_it_is_set() -> None:
    seen = [(block["XOUT"], block["Q"]) for block in scans(
        "INTEGRAL", "RUN := n <> 4, R1 := n = 2, XIN := 5.0, X0 := 100.0, CYCLE := T#200ms", 5)]
    assert seen == [(1.0, True), (100.0, False), (101.0, True), (101.0, True), (102.0, True)]


def test_derivative_of_a_straight_line_is_its_slope() -> None:
    seen = [block["XOUT"] for block in scans("DERIVATIVE", "RUN := n > 1, XIN := INT_TO_REAL(n) * 3.0, CYCLE := T#1s", 8)]
    assert seen[0] == 0.0
    assert seen[5:] == pytest.approx([3.0, 3.0, 3.0])


def test_hysteresis_keeps_its_output_between_its_limits() -> None:
    seen = [block["Q"] for block in scans("HYSTERESIS", "XIN1 := INT_TO_REAL(ABS(6 - n)), XIN2 := 3.0, EPS := 1.0", 11)]
    assert seen == [n <= 4 or n == 11 for n in range(1, 12)]


def test_a_clock_is_set_and_goes_on() -> None:
    seen = [str(block["CDT"]) for block in scans("RTC", "IN := n > 2, PDT := DT#2024-02-28-23:59:59", 4)]
    moments = [int(text) for text in seen]
    assert moments[1] - moments[0] == 100_000_000
    assert moments[3] - moments[2] == 100_000_000
    assert moments[2] == 1_709_164_799 * 10**9


def test_a_claim_wins_over_a_release() -> None:
    seen = [block["BUSY"] for block in scans("SEMA", "CLAIM := n = 2 OR n = 4, RELEASE := n >= 4", 6)]
    assert seen == [False, True, True, True, False, False]


def test_a_message_is_kept_at_each_rise() -> None:
    *_, block = scans("LOGGER", "TRIG := n = 2 OR n > 3, MSG := CONCAT('message ', INT_TO_STRING(n))", 6)
    assert (block["Last"], block["Count"]) == ("message 4", 2)


@each_of(("level", "kept"), [("", 2), (", LEVEL := LOGLEVEL#CRITICAL", 0), (", LEVEL := LOGLEVEL#DEBUG", 3)])
def test_a_message_is_kept_with_its_level_which_is_info_unless_told(level: str, kept: int) -> None:
    blocks = scans("LOGGER", f"TRIG := n >= 2, MSG := 'now'{level}", 3)
    assert [(block["Last"], block["Last_Level"], block["Count"]) for block in blocks] == [
        ("", 0, 0), ("now", kept, 1), ("now", kept, 1)]  # fmt: skip


def test_a_clock_is_set_at_each_rise_and_shows_the_time_of_the_plc_between() -> None:
    call = "IN := n = 2 OR n = 3 OR n >= 5, PDT := SEL(n > 3, DT#2024-02-28-23:59:59, DT#2030-01-01-00:00:00)"
    seen = [(block["Q"], int(block["CDT"])) for block in scans("RTC", call, 6)]
    first, second, scan = 1_709_164_799 * 10**9, 1_893_456_000 * 10**9, 100_000_000
    assert seen == [(False, 0), (True, first), (True, first + scan), (False, 3 * scan), (True, second), (True, second + scan)]


def test_a_derivative_weighs_four_values_and_begins_anew_without_run() -> None:
    found, past = [], [0.0, 0.0, 0.0]
    for n in range(1, 12):
        value = float(n * n % 7)
        if n in (1, 6):
            found.append(0.0)
            past = [value] * 3
        else:
            found.append((3 * (value - past[2]) + past[0] - past[1]) / (10 * 0.5))
            past = [value, *past[:2]]
    call = "RUN := n <> 1 AND n <> 6, XIN := INT_TO_REAL(n * n MOD 7), CYCLE := T#500ms"
    assert [block["XOUT"] for block in scans("DERIVATIVE", call, 11)] == pytest.approx(found)


def test_an_integral_stands_without_run_and_is_set_with_or_without_it() -> None:
    call = "RUN := n <> 3 AND n <> 4, R1 := n = 4 OR n = 6, XIN := -4.0, X0 := INT_TO_REAL(n), CYCLE := T#2s"
    assert [(block["XOUT"], block["Q"]) for block in scans("INTEGRAL", call, 7)] == [
        (-8.0, True), (-16.0, True), (-16.0, True), (4.0, False), (-4.0, True), (6.0, False), (-2.0, True)]  # fmt: skip


def test_a_ramp_goes_down_too_and_begins_anew() -> None:
    call = "RUN := n <> 1 AND n <> 5, X0 := 8.0, X1 := -4.0, TR := T#300ms, CYCLE := T#100ms"
    assert [(block["XOUT"], block["BUSY"]) for block in scans("RAMP", call, 9)] == [
        (8.0, False), (8.0, True), (4.0, True), (0.0, True), (8.0, False), (8.0, True), (4.0, True), (0.0, True),
        (-4.0, False)]  # fmt: skip


BEREMIZ = ["csv_read_by_int", "csv_read_by_string", "csv_reload", "python_eval", "python_gear", "python_poll"]


@each_of("block", BEREMIZ)
def test_nobody_acknowledges_a_block_of_beremiz(block: str) -> None:
    plc = Plc(image_of(block, "matiec"))
    plc.write("Main.b.ACK", True)
    plc.write("Main.b.RESULT", "before")
    plc.scan()
    assert (plc.read("Main.b.ACK"), plc.read("Main.b.RESULT")) == (False, "")


def test_a_button_of_beremiz_is_not_pressed_and_a_bool_has_a_word_of_python() -> None:
    plc = Plc(image_of("Button", "matiec"))
    plc.write("Main.b.state_out", True)
    plc.scan()
    assert plc.read("Main.b.state_out") is False
    assert [block["CODE"] for block in scans("GetBoolString", "VALUE := n = 2", 3)] == ["False", "True", "False"]


def test_where_the_blocks_are_is_told() -> None:
    [error] = compile_text("PROGRAM Main VAR b : SEMA; END_VAR END_PROGRAM").errors
    assert (error.code, error.hint) == ("S0204", "it is a block of Beremiz and OpenPLC: --dialect matiec or strucpp brings it")


# --- counters, which stop at PV and at 0, and the timer -----------------------------------------------------------------


@each_of("suffix", COUNTERS)
def test_a_counter_up_stops_at_pv(suffix: str) -> None:
    plays("CTU" + suffix, "CU R PV", "Q CV", """
        0  0 0 2  0 0
        1  1 0 2  0 1
        2  1 0 2  0 1
        3  0 0 2  0 1
        4  1 0 2  1 2
        5  0 0 2  1 2
        6  1 0 2  1 2
        7  1 1 2  0 0
        8  1 0 2  0 0
        9  0 1 0  1 0
        10 1 1 2  0 0
        11 1 0 2  0 0
    """, dialect="matiec")  # fmt: skip


@each_of("suffix", COUNTERS)
def test_a_counter_down_stops_at_zero(suffix: str) -> None:
    plays("CTD" + suffix, "CD LD PV", "Q CV", """
        0  0 0 2  1 0
        1  1 0 2  1 0
        2  0 0 2  1 0
        3  1 1 2  0 2
        4  1 0 2  0 2
        5  0 0 2  0 2
        6  1 0 2  0 1
        7  0 0 2  0 1
        8  1 0 2  1 0
        9  0 0 2  1 0
        10 1 0 2  1 0
        11 0 1 0  1 0
    """, dialect="matiec")  # fmt: skip


@each_of("suffix", COUNTERS)
def test_a_counter_up_and_down_stops_at_pv_and_at_zero(suffix: str) -> None:
    plays("CTUD" + suffix, "CU CD R LD PV", "QU QD CV", """
        0  0 0 0 0 2  0 1 0
        1  0 1 0 0 2  0 1 0
        2  1 0 0 0 2  0 0 1
        3  1 0 0 0 2  0 0 1
        4  0 0 0 0 2  0 0 1
        5  1 1 0 0 2  0 0 1
        6  0 0 0 0 2  0 0 1
        7  1 0 0 0 2  1 0 2
        8  0 1 0 0 2  0 0 1
        9  0 1 0 0 2  0 0 1
        10 1 0 0 0 2  1 0 2
        11 0 0 0 0 2  1 0 2
        12 1 0 0 0 2  1 0 2
        13 1 1 0 0 2  0 0 1
        14 1 1 1 1 2  0 1 0
        15 1 1 0 1 2  1 0 2
        16 0 0 0 0 2  1 0 2
        17 0 1 0 0 2  0 0 1
        18 1 1 0 0 2  1 0 2
        19 0 0 1 0 0  1 1 0
    """, dialect="matiec")  # fmt: skip


@each_of("kind", ["CTU", "CTD", "CTUD"])
@each_of("suffix", COUNTERS)
def test_matiecs_counters_of_all_types_are_one_text(kind: str, suffix: str) -> None:
    folder = data_folder("fblib") / "matiec" / "blocks"
    text = re.sub(r"\bINT\b", COUNTERS[suffix][0], plain(folder / f"{kind}.st"))
    assert plain(folder / f"{kind}{suffix}.st") == text.replace(f"FUNCTION_BLOCK {kind}\n", f"FUNCTION_BLOCK {kind}{suffix}\n")


@each_of("block", ["TON", "TON_TIME"])
def test_an_on_delay_is_over_in_the_scan_after_its_rise_at_the_earliest(block: str) -> None:
    plays(block, "IN PT", "Q ET", """
        0   0 30  0 0
        10  1 30  0 0
        25  1 30  0 15
        39  1 30  0 29
        40  1 30  1 30
        90  1 90  1 30
        95  0 30  0 0
        96  1 30  0 0
        99  1 30  0 3
        100 0 30  0 0
        101 1 30  0 0
        500 1 30  1 30
    """, dialect="matiec")  # fmt: skip
    for pt in (0, -5):
        plays(block, "IN PT", "Q ET", f"0 1 {pt} 0 0 \n 1 1 {pt} 1 0 \n 2 1 {pt} 1 0 \n 3 0 {pt} 0 0", dialect="matiec")


@each_of("block", ["TON", "TON_TIME"])
def test_a_running_on_delay_of_matiec_says_when_it_will_end(block: str) -> None:
    plc = Plc(image_of(block, "matiec"))
    plc.write("Main.b.PT", 30 * MS)
    plc.write("Main.b.IN", True)
    for at in (5, 20, 34):
        plc.scan(at * MS)
        assert plc.due_ns == 35 * MS
    plc.scan(35 * MS)
    assert plc.due_ns > 1000 * MS
