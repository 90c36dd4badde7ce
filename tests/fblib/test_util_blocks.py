"""Blocks of CODESYS's Util at their limits, call by call: each input is varied, each output is looked at."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of
from test_vendor_functions import MS, image_of, outputs, value_of

from fbvm.machine.plc import Plc

LEAST, MOST = -32768, 32767

# --- bits, characters ---------------------------------------------------------------------------------------------------


@each_of(("expression", "type", "value"), [
    ("EXTRACT(1, 0)", "BOOL", True), ("EXTRACT(16#FFFFFFFE, 0)", "BOOL", False), ("EXTRACT(16#7FFFFFFF, 31)", "BOOL", False),
    ("PUTBIT(0, 31, TRUE)", "DWORD", 1 << 31), ("PUTBIT(16#FFFFFFFF, 31, FALSE)", "DWORD", (1 << 31) - 1),
    ("PUTBIT(16#FFFFFFFF, 32, FALSE)", "DWORD", (1 << 32) - 1), ("PUTBIT(1, 0, TRUE)", "DWORD", 1),
    ("SETBIT(4, 0)", "DWORD", 5), ("SETBIT(4, 2)", "DWORD", 4), ("SETBIT(4, 32)", "DWORD", 4),
    ("SWITCHBIT(0, 31)", "DWORD", 1 << 31), ("SWITCHBIT(1, 0)", "DWORD", 0), ("SWITCHBIT(5, 32)", "DWORD", 5),
    ("GRAY_TO_BYTE(16#80)", "BYTE", 0xFF), ("BYTE_TO_GRAY(16#FF)", "BYTE", 0x80), ("GRAY_TO_WORD(16#8000)", "WORD", 0xFFFF),
    ("WORD_TO_GRAY(16#FFFF)", "WORD", 0x8000), ("GRAY_TO_DWORD(16#80000000)", "DWORD", 0xFFFFFFFF),
    ("DWORD_TO_GRAY(16#FFFFFFFF)", "DWORD", 0x80000000), ("GRAY_TO_BYTE(1)", "BYTE", 1), ("GRAY_TO_DWORD(2)", "DWORD", 3),
    ("BYTE_TO_HEXinASCII(16#9A)", "WORD", 0x3941), ("BYTE_TO_HEXinASCII(16#0F)", "WORD", 0x3046),
    ("BYTE_TO_HEXinASCII(16#A0)", "WORD", 0x4130), ("WORD_AS_STRING(16#4100, TRUE)", "STRING(2)", "A"),
])  # fmt: skip
def test_functions_of_bits_at_the_first_and_the_last_bit(expression: str, type: str, value: object) -> None:
    assert value_of(expression, type) == value


def test_a_byte_packed_of_one_bit_is_a_power_of_two() -> None:
    pins = [f"b{n}" for n in range(8)]
    plc = Plc(image_of(f"VAR {', '.join(pins)} : BOOL; v : BYTE; END_VAR\nv := PACK({', '.join(pins)});"))
    for place in range(8):
        for at, pin in enumerate(pins):
            plc.write(f"Main.{pin}", at == place)
        plc.scan()
        assert plc.read("Main.v") == 1 << place


def test_hexadecimal_digits_are_told_from_their_neighbours() -> None:
    plc = Plc(image_of("VAR w : WORD; v : BYTE; END_VAR\nv := HEXinASCII_TO_BYTE(w);"))
    for high, low in [*((sign, ord("0")) for sign in range(256)), *((ord("1"), sign) for sign in range(256))]:
        pair = chr(high) + chr(low)
        plc.write("Main.w", high << 8 | low)
        plc.scan()
        good = all(one in "0123456789abcdefABCDEF" for one in pair)
        assert plc.read("Main.v") == (int(pair, 16) if good else 0), pair


# --- limits, curves, values ---------------------------------------------------------------------------------------------


def test_a_limit_alarm_with_its_limits_crossed_is_above_and_below() -> None:
    assert outputs("LIMITALARM", "IN HIGH LOW -> O U IL", (0, 15, 10, 20), (0, 10, 10, 10)) == [
        (True, True, False), (False, False, True)]  # fmt: skip


def test_lin_trafo_takes_its_limits_in_either_order() -> None:
    pins = "IN IN_MIN IN_MAX OUT_MIN OUT_MAX -> OUT ERROR"
    calls = [(0, value, *ends, 100.0, 300.0) for ends in ((0.0, 10.0), (10.0, 0.0)) for value in (0.0, 10.0, 2.5, -0.5, 10.5)]
    assert outputs("LIN_TRAFO", pins, *calls) == [
        (100.0, False), (300.0, False), (150.0, False), (150.0, True), (150.0, True),
        (300.0, False), (100.0, False), (250.0, False), (250.0, True), (250.0, True)]  # fmt: skip


CURVE = """VAR c : CHARCURVE; N : BYTE; level : INT; i : INT; p : ARRAY[0..10] OF POINT; END_VAR
FOR i := 0 TO 10 DO p[i].X := i * 10 - 50; p[i].Y := i * i * 100; END_FOR
c(IN := level, N := N, P := p);"""


@each_of(("count", "level", "out", "err"), [
    (11, 50, 10000, 0), (11, 49, 9810, 0), (11, 51, 10000, 2), (11, -50, 0, 0), (11, -51, 0, 2), (11, -49, 10, 0),
    (11, 0, 2500, 0), (11, 1, 2610, 0), (11, -1, 2410, 0), (2, -40, 100, 0), (2, -39, 100, 2), (3, -30, 400, 0), (3, -29, 400, 2),
    (1, 0, 0, 4), (12, 0, 0, 4), (255, 0, 0, 4),
])  # fmt: skip
def test_charcurve_has_two_to_eleven_points(count: int, level: int, out: int, err: int) -> None:
    plc = Plc(image_of(CURVE))
    plc.write("Main.N", count)
    plc.write("Main.level", level)
    plc.scan()
    assert (plc.read("Main.c.OUT"), plc.read("Main.c.ERR")) == (out, err)


def test_charcurve_forgets_an_error() -> None:
    plc = Plc(image_of(CURVE))
    for count, level, out, err in ((3, 51, 400, 2), (3, -51, 0, 2), (3, -45, 50, 0), (1, 0, 50, 4), (2, -40, 100, 0)):
        plc.write("Main.N", count)
        plc.write("Main.level", level)
        plc.scan()
        assert (plc.read("Main.c.OUT"), plc.read("Main.c.ERR")) == (out, err)


@each_of("first", [-40, -39])
def test_the_first_two_points_of_charcurve_are_in_order_too(first: int) -> None:
    plc = Plc(image_of(CURVE.replace("c(IN", f"p[0].X := {first};\nc(IN")))
    plc.write("Main.N", 3)
    plc.scan()
    assert plc.read("Main.c.ERR") == 1


@each_of("block", ["RAMP_INT", "RAMP_REAL"])
def test_a_ramp_stops_at_its_input_from_above_and_from_below(block: str) -> None:
    pins = "IN ASCEND DESCEND TIMEBASE RESET -> OUT"
    calls = [(0, 10, 4, 3, 0, False), (1, 10, 4, 3, 0, False), (2, 10, 4, 3, 0, True), (3, 10, 4, 3, 0, False),
             (4, 10, 4, 3, 0, False), (5, 10, 4, 3, 0, False), (6, 5, 4, 3, 0, False), (7, 5, 4, 3, 0, False),
             (8, 5, 4, 3, 0, False), (9, -9, 4, 7, 0, False), (10, -9, 4, 7, 0, False)]  # fmt: skip
    assert outputs(block, pins, *calls) == [0, 4, 4, 8, 10, 10, 7, 5, 5, -2, -9]


@each_of("block", ["RAMP_INT", "RAMP_REAL"])
def test_a_ramp_is_at_its_input_in_time(block: str) -> None:
    pins = "IN ASCEND DESCEND TIMEBASE RESET -> OUT"
    half = 500 * MS
    calls = [(9000, 100, 10, 20, half, False), (9250, 100, 10, 20, half, False), (10250, 100, 10, 20, half, False),
             (11250, 100, 10, 20, half, True), (11750, 100, 10, 20, half, False), (12000, 20, 10, 20, half, False),
             (12250, 20, 10, 20, half, False)]  # fmt: skip
    assert outputs(block, pins, *calls) == [0, 5, 25, 25, 35, 25, 20]


def test_statistics_begin_anew_with_a_reset() -> None:
    calls = [(0, 0, True), (0, -3, False), (0, 5, False), (0, 1, False), (0, 9, True), (0, -7, False), (0, -8, False)]
    assert outputs("STATISTICS_INT", "IN RESET -> MN MX AVG", *calls) == [
        (MOST, LEAST, 0), (-3, -3, -3), (-3, 5, 1), (-3, 5, 1), (MOST, LEAST, 0), (-7, -7, -7), (-8, -7, -7)]  # fmt: skip
    found = outputs("STATISTICS_REAL", "IN RESET -> MN MX AVG", *((at, float(value), reset) for at, value, reset in calls))
    ends = pytest.approx((3.402823e38, -3.402823e38, 0.0), rel=1e-6)
    assert found == [ends, (-3.0, -3.0, -3.0), (-3.0, 5.0, 1.0), (-3.0, 5.0, 1.0), ends, (-7.0, -7.0, -7.0), (-8.0, -7.0, -7.5)]
    assert outputs("VARIANCE", "IN RESET -> OUT", *((at, float(value), reset) for at, value, reset in calls)) == pytest.approx(
        [0.0, 0.0, 16.0, 32 / 3, 0.0, 0.0, 0.25])  # fmt: skip


@each_of("sign", [1.0, -1.0])
def test_the_integral_overflows_in_both_directions(sign: float) -> None:
    calls = [(0, sign * 3e38, 1, False), (0, sign * 3e38, 1, False), (0, -sign * 3e38, 1, False), (0, 0.0, 0, True),
             (0, sign * 2.0, 3, False)]  # fmt: skip
    held = pytest.approx(sign * 3e38)
    assert outputs("INTEGRAL", "IN TM RESET -> OUT OVERFLOW", *calls) == [
        (held, False), (held, True), (held, True), (0.0, False), (sign * 6.0, False)]  # fmt: skip


def test_the_derivative_weighs_each_of_its_times() -> None:
    calls = [(0, 0.0, 10, False), (0, 6.0, 10, False), (0, 10.0, 20, False), (0, 20.0, 5, False), (0, 21.0, 40, False),
             (0, 5.0, 3, True), (0, 9.0, 0, False), (0, 9.0, 10, False)]  # fmt: skip
    assert outputs("DERIVATIVE", "IN TM RESET -> OUT", *calls) == pytest.approx(
        [0.0, 0.6, 0.36, 0.512, 0.275, 0.0, 0.0, 16 / 30])  # fmt: skip
    calls = [(0, value, 10, value == 5.0) for value in (1.0, 2.0, 4.0, 5.0, 6.0)]
    assert outputs("DERIVATIVE", "IN TM RESET -> OUT", *calls)[3:] == pytest.approx([0.0, 0.1])


# --- controllers --------------------------------------------------------------------------------------------------------

CONTROL = "ACTUAL SET_POINT KP TN TV Y_MANUAL Y_OFFSET Y_MIN Y_MAX MANUAL RESET"


def fixed(error: float, gain: float = 2.0, tn: float = 0.0, tv: float = 0.0, limits: tuple[float, float] = (0.0, 0.0),
          manual: bool = False, reset: bool = False, cycle: float = 0.5) -> tuple[Any, ...]:  # fmt: skip
    """A call of PID_FIXCYCLE with the set point 4."""
    return (0, 4.0 - error, 4.0, gain, tn, tv, 20.0, 1.0, *limits, manual, reset, cycle)


def controlled(*calls: tuple[Any, ...]) -> list[Any]:
    return outputs("PID_FIXCYCLE", f"{CONTROL} CYCLE -> Y LIMITS_ACTIVE", *calls)


def test_a_pid_adds_its_three_parts() -> None:
    for tn, expected in ((0.0, [9.0, 5.0, 7.0]), (2.0, [9.0, 6.5, 10.0])):
        assert controlled(*(fixed(error, tn=tn, tv=0.5) for error in (4.0, 3.0, 3.0))) == [(y, False) for y in expected]


def test_a_pid_without_a_cycle_has_no_sum_and_no_change() -> None:
    calls = [fixed(error, tn=2.0, tv=0.5, cycle=cycle) for error, cycle in ((4.0, 0.5), (3.0, 0.0), (2.0, -1.0), (2.0, 0.5))]
    assert [y for y, _ in controlled(*calls)] == [9.0, 7.0, 5.0, 6.0]


def test_a_pid_begins_anew_behind_manual_and_reset() -> None:
    calls = [fixed(3.0, tn=1.0), fixed(3.0, tn=1.0), fixed(3.0, tn=1.0, manual=True), fixed(5.0, tn=1.0, tv=1.0),
             fixed(5.0, tn=1.0), fixed(5.0, tn=1.0, manual=True, reset=True), fixed(4.0, tn=1.0, tv=1.0), fixed(4.0, 9.0, 9.0)]
    assert controlled(*calls) == [(7.0, False), (10.0, False), (20.0, False), (11.0, False), (16.0, False), (1.0, False),
                                  (9.0, False), (13.0, False)]  # fmt: skip


@each_of("sign", [1.0, -1.0])
def test_the_sum_of_a_pid_stays_at_either_limit_for_either_gain(sign: float) -> None:
    for gain in (1.0, -1.0):
        calls = [fixed(sign * error, gain, tn=1.0, limits=(-9.0, 11.0), cycle=1.0) for error in (4.0, 4.0, 4.0, 4.0, 4.0, -1.0)]
        held = sign * gain * 10.0 + 1.0
        assert controlled(*calls) == [
            (sign * gain * 4.0 + 1.0, False), (sign * gain * 8.0 + 1.0, False), (held, True), (held, True), (held, True),
            (sign * gain * 6.0 + 1.0, False)]  # fmt: skip


def test_limits_of_a_controller_are_active_beyond_them_only() -> None:
    errors, limits = (5.0, 5.25, -6.0, -6.25), (-11.0, 11.0)
    assert controlled(*(fixed(error, limits=limits) for error in errors)) == [
        (11.0, False), (11.0, True), (-11.0, False), (-11.0, True)]  # fmt: skip
    assert controlled(*(fixed(error, limits=ends) for error in (5.0, -9.0) for ends in ((5.0, 5.0), (6.0, 5.0)))) == [
        (11.0, False), (11.0, False), (-17.0, False), (-17.0, False)]  # fmt: skip
    assert controlled(fixed(-9.0, limits=limits), fixed(-9.0, limits=limits, reset=True)) == [(-11.0, True), (1.0, False)]
    assert controlled(fixed(9.0, limits=limits), fixed(9.0, limits=limits, manual=True), fixed(9.0, limits=limits),
                      fixed(9.0, limits=limits, reset=True)) == [(11.0, True), (20.0, False), (11.0, True), (1.0, False)]
    pins = "ACTUAL SET_POINT KP TV Y_MANUAL Y_OFFSET Y_MIN Y_MAX MANUAL RESET -> Y LIMITS_ACTIVE"
    calls = [(0, 4.0 - error, 4.0, 2.0, 0.0, 20.0, 1.0, *ends, False, False)
             for error, ends in [*((error, limits) for error in errors), (5.0, (5.0, 5.0)), (5.0, (6.0, 5.0))]]
    assert outputs("PD", pins, *calls) == [
        (11.0, False), (11.0, True), (-11.0, False), (-11.0, True), (11.0, False), (11.0, False)]  # fmt: skip


def test_a_pd_sees_a_change_between_two_times_of_its_own_work() -> None:
    pins = "ACTUAL SET_POINT KP TV Y_MANUAL Y_OFFSET Y_MIN Y_MAX MANUAL RESET -> Y"
    calls = [(at, 4.0 - error, 4.0, 2.0, 0.5, 20.0, 1.0, 0.0, 0.0, manual, reset) for at, error, manual, reset in (
        (500, 4.0, False, False), (500, 3.0, False, False), (1000, 4.0, False, False), (2000, 1.0, True, True),
        (3000, 2.0, False, False), (3500, 3.0, False, False), (4000, 3.0, True, False), (4500, 5.0, False, False))]
    assert outputs("PD", pins, *calls) == [9.0, 7.0, 11.0, 1.0, 5.0, 9.0, 20.0, 11.0]


def test_a_pid_that_measures_the_time_hands_all_on() -> None:
    calls = [(at, actual, 4.0, 2.0, 4.0, 0.5, 7.0, 1.0, -10.0, 10.0, manual, reset) for at, actual, manual, reset in (
        (1000, 0.0, 0, 0), (1500, 1.0, 0, 0), (2000, -3.0, 0, 0), (2500, 0.0, 1, 0), (3000, 0.0, 0, 1), (3500, 20.0, 0, 0))]
    assert outputs("PID", f"{CONTROL} -> Y LIMITS_ACTIVE OVERFLOW", *calls) == [
        (9.0, False, False), (5.75, False, False), (10.0, True, False), (7.0, False, False), (1.0, False, False),
        (-10.0, True, False)]  # fmt: skip
    calls = [(at, 0.0, 3e38, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, manual, False)
             for at, manual in ((1000, False), (2000, False), (4000, False), (5000, True))]
    assert outputs("PID", f"{CONTROL} -> OVERFLOW", *calls) == [False, False, True, False]


# --- signals ------------------------------------------------------------------------------------------------------------


def generated(head: str, *times: int) -> list[int]:
    plc = Plc(image_of(f"VAR g : GEN; END_VAR\ng(MODE := GEN_MODE#SAWTOOTH_RISE, AMPLITUDE := 1000, {head});"))
    found = []
    for at in times:
        plc.scan(at * MS)
        found.append(plc.read("Main.g.OUT"))
    return found


def test_a_generator_has_a_period_of_a_second_or_of_1000_calls() -> None:
    assert generated("BASE := TRUE", 300, 550, 1299, 1300, 5050) == [-1000, -500, 998, -1000, 500]
    assert generated("BASE := FALSE", 300, 550, 550) == [-1000, -998, -996]
    assert generated("BASE := FALSE", *range(1001))[500:] == [*range(0, 1000, 2), -1000]
    assert generated("BASE := TRUE, PERIOD := SEL(g.OUT = -500, T#1s, T#0s)", 300, 550, 560, 570) == [-1000, -500, -1000, -460]
    for head in ("BASE := TRUE, PERIOD := T#0s", "BASE := TRUE, PERIOD := T#-1s", "BASE := FALSE, CYCLES := 0",
                 "BASE := FALSE, CYCLES := -1", "BASE := FALSE, CYCLES := 1"):
        assert generated(head, 300, 550, 800) == [-1000, -1000, -1000]


def test_blink_says_when_it_will_change() -> None:
    plc = Plc(image_of("VAR b : BLINK; on : BOOL := TRUE; END_VAR\nb(ENABLE := on, TIMELOW := T#20ms, TIMEHIGH := T#30ms);"))
    for at, due, level in ((5, 35, True), (34, 35, True), (35, 55, False), (54, 55, False), (60, 90, True)):
        plc.scan(at * MS)
        assert (plc.due_ns, plc.read("Main.b.OUT")) == (due * MS, level)
    plc.write("Main.on", False)
    plc.scan(90 * MS)
    assert plc.due_ns > 1000 * MS
    assert plc.read("Main.b.OUT")


def rises(*times: int, periods: int) -> list[tuple[Any, ...]]:
    """Calls of FREQ_MEASURE with a rise at each time, and a fall one ms later."""
    return [(at + after, after == 0, periods, False) for at in times for after in (0, 1)]


def test_freq_measure_waits_for_its_periods() -> None:
    pins = "IN PERIODS RESET -> OUT VALID"
    calls = [*rises(0, 100, 250, periods=2), (500, False, 2, False), (501, False, 2, False), *rises(600, periods=2)]
    found = outputs("FREQ_MEASURE", pins, *calls)
    assert found[:6] == [(0.0, False)] * 4 + [(8.0, True)] * 2
    assert found[6:] == [(8.0, True), (0.0, False), (4.0, True), (4.0, True)]
    assert outputs("FREQ_MEASURE", pins, *rises(0, 100, periods=0))[2:] == [(10.0, True)] * 2
    by_default = [call[:2] for call in rises(0, 100, periods=1)]
    assert outputs("FREQ_MEASURE", "IN -> OUT VALID", *by_default)[2:] == [(10.0, True)] * 2
    at_once = [(0, level, 1, False) for level in (True, False, True, False)]
    assert outputs("FREQ_MEASURE", pins, *at_once) == [(0.0, False)] * 4
    for periods, seen in ((10, 10), (11, 10), (9, 9)):
        found = outputs("FREQ_MEASURE", pins, *rises(*range(0, 1200, 100), periods=periods))
        assert [valid for _, valid in found[::2]] == [number >= seen for number in range(12)]


def test_freq_measure_forgets_with_a_reset() -> None:
    calls = [*rises(0, 100, periods=1), (150, True, 1, True), (160, True, 1, False), (170, False, 1, False),
             *rises(200, 250, periods=1)]  # fmt: skip
    found = outputs("FREQ_MEASURE", "IN PERIODS RESET -> OUT VALID", *calls)
    assert found == [(0.0, False)] * 2 + [(10.0, True)] * 2 + [(0.0, False)] * 5 + [(20.0, True)] * 2
