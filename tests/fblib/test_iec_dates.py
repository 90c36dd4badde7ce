"""CONCAT_... and SPLIT_... of dates against Python's calendar, and the dates that there are not."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

FIRST, LAST = date(1677, 9, 22), date(2262, 4, 11)
"""Between them lie the dates whose nanoseconds since 1970 have 64 bits."""
NS = 1_000_000_000

PROGRAM = """
PROGRAM Main
VAR Y, M, D, h, n, s, ms : LINT; moment : LDT; day : DATE; weekday : INT; y2, m2, d2, h2, n2, s2, ms2 : INT; END_VAR
moment := CONCAT_LDT(Y, M, D, h, n, s, ms);
day := CONCAT_DATE(Y, M, D);
weekday := DAY_OF_WEEK(day);
SPLIT_LDT(moment, y2, m2, d2, h2, n2, s2, ms2);
END_PROGRAM
"""


@cache
def plc() -> Plc:
    made = compile_text(PROGRAM)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return Plc(made.image)


def run(**inputs: int) -> Plc:
    machine = plc()
    machine.cold_start()
    for name, value in inputs.items():
        machine.write(f"Main.{name}", value)
    machine.scan()
    return machine


@pytest.mark.slow
@given(st.datetimes(datetime(1677, 9, 23), datetime(2262, 4, 10)))
def test_a_moment_is_put_together_and_taken_apart(moment: datetime) -> None:
    parts = [moment.year, moment.month, moment.day, moment.hour, moment.minute, moment.second, moment.microsecond // 1000]
    machine = run(**dict(zip(["Y", "M", "D", "h", "n", "s", "ms"], parts, strict=True)))
    assert machine.trap is None
    since = moment.replace(microsecond=parts[-1] * 1000) - datetime(1970, 1, 1)
    assert machine.read("Main.moment") == (since.days * 86_400 + since.seconds) * NS + since.microseconds * 1000
    assert machine.read("Main.day") == since.days * 86_400 * NS
    assert machine.read("Main.weekday") == moment.isoweekday() % 7
    assert [machine.read(f"Main.{name}2") for name in ("y", "m", "d", "h", "n", "s", "ms")] == parts


@pytest.mark.slow
@each_of("year", [1900, 2000, 2023, 2024])
@each_of("month", range(1, 13))
def test_each_month_ends_with_its_last_day(year: int, month: int) -> None:
    following = date(year + month // 12, month % 12 + 1, 1)
    last = (following - timedelta(days=1)).day
    assert run(Y=year, M=month, D=last).trap is None
    trap = run(Y=year, M=month, D=last + 1).trap
    assert trap is not None and trap.code == "R0103" and f"value {last + 1} outside 1..{last}" in trap.message


@each_of(("day", "good"), [
    (FIRST, True), (FIRST - timedelta(days=1), False), (LAST, True), (LAST + timedelta(days=1), False)])
def test_a_date_that_64_bits_cannot_hold_stops_the_program(day: date, good: bool) -> None:
    trap = run(Y=day.year, M=day.month, D=day.day, h=12).trap
    assert (trap is None) == good
    assert trap is None or trap.code == "R0103"


def test_the_last_moment() -> None:
    inputs = {"Y": 2262, "M": 4, "D": 11, "h": 23, "n": 47, "ms": 999}
    assert run(**inputs, s=15).trap is None
    trap = run(**inputs, s=16).trap
    assert trap is not None and trap.code == "R0103"


# --- each function at its limits ----------------------------------------------------------------------------------------

PARTS = ("Y", "M", "D", "h", "n", "s", "ms")
WHOLE = """
PROGRAM Main
VAR Y, M, D, h, n, s, ms : LINT; short : DT; long, joined_long : LDT; joined : DT; clock : TOD; long_clock : LTOD; day : DATE;
    weekday : INT; of_short, of_long, of_parts, of_long_parts : ARRAY[1..7] OF INT; END_VAR
short := CONCAT_DT(Y, M, D, h, n, s, ms); long := CONCAT_LDT(Y, M, D, h, n, s, ms);
clock := CONCAT_TOD(h, n, s, ms); long_clock := CONCAT_LTOD(h, n, s, ms);
day := CONCAT_DATE(Y, M, D); weekday := DAY_OF_WEEK(day);
joined := CONCAT_DATE_TOD(day, clock); joined_long := CONCAT_DATE_LTOD(day, long_clock + LTIME#1ns);
SPLIT_DT(short, of_short[1], of_short[2], of_short[3], of_short[4], of_short[5], of_short[6], of_short[7]);
SPLIT_LDT(long, of_long[1], of_long[2], of_long[3], of_long[4], of_long[5], of_long[6], of_long[7]);
SPLIT_DATE(day, of_parts[1], of_parts[2], of_parts[3]); SPLIT_TOD(clock, of_parts[4], of_parts[5], of_parts[6], of_parts[7]);
SPLIT_DATE(day, of_long_parts[1], of_long_parts[2], of_long_parts[3]);
SPLIT_LTOD(long_clock, of_long_parts[4], of_long_parts[5], of_long_parts[6], of_long_parts[7]);
END_PROGRAM
"""


@cache
def image_of(text: str) -> Image:
    made = compile_text(text)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


@each_of("parts", [
    (1677, 9, 22, 0, 0, 0, 0), (1677, 12, 31, 23, 59, 59, 999), (1678, 1, 1, 0, 0, 0, 0), (1699, 12, 31, 1, 1, 1, 1),
    (1700, 2, 28, 23, 0, 59, 0), (1700, 3, 1, 0, 59, 0, 999), (1969, 12, 31, 23, 59, 59, 999), (1970, 1, 1, 0, 0, 0, 0),
    (1970, 1, 1, 0, 0, 0, 1), (2000, 2, 29, 12, 30, 15, 500), (2000, 3, 1, 0, 0, 1, 0), (2001, 2, 28, 0, 1, 0, 0),
    (2023, 12, 31, 23, 59, 59, 999), (2024, 2, 29, 1, 0, 0, 0), (2100, 2, 28, 9, 8, 7, 6), (2100, 3, 1, 9, 8, 7, 6),
    (2262, 4, 11, 23, 47, 15, 999), (2262, 1, 31, 0, 0, 0, 0),
])  # fmt: skip
def test_all_functions_of_dates_agree_with_a_calendar(parts: tuple[int, ...]) -> None:
    machine = Plc(image_of(WHOLE))
    for name, value in zip(PARTS, parts, strict=True):
        machine.write(f"Main.{name}", value)
    machine.scan()
    assert machine.trap is None
    moment = datetime(*parts[:6])
    since = moment - datetime(1970, 1, 1)
    day = since.days * 86_400 * NS
    clock = since.seconds * NS + parts[6] * 1_000_000
    names = ("short", "long", "joined", "joined_long", "clock", "long_clock", "day", "weekday")
    found = [machine.read(f"Main.{name}") for name in names]
    assert found == [day + clock, day + clock, day + clock, day + clock + 1, clock, clock, day, moment.isoweekday() % 7]
    for name in ("of_short", "of_long", "of_parts", "of_long_parts"):
        assert machine.read(f"Main.{name}") == list(parts), name


CALLS = {"CONCAT_DT": (0, 7), "CONCAT_LDT": (0, 7), "CONCAT_DATE": (0, 3), "CONCAT_TOD": (3, 7), "CONCAT_LTOD": (3, 7)}
"""A function and which of the seven parts it takes."""
RANGES = [(1677, 2262), (1, 12), (1, 31), (0, 23), (0, 59), (0, 59), (0, 999)]


@each_of("function", CALLS)
def test_each_part_of_a_date_or_time_has_limits(function: str) -> None:
    first, end = CALLS[function]
    names, kind = PARTS[first:end], function.removeprefix("CONCAT_")
    machine = Plc(image_of(f"PROGRAM Main VAR v : {kind}; {', '.join(names)} : LINT; END_VAR "
                           f"v := {function}({', '.join(names)}); END_PROGRAM"))
    for name, (low, high) in zip(names, RANGES[first:end], strict=True):
        for value, good in ((low - 1, False), (low, True), (high, True), (high + 1, False)):
            machine.cold_start()
            for other, usual in zip(PARTS, (2000, 1, 1, 1, 1, 1, 1), strict=True):
                if other in names:
                    machine.write(f"Main.{other}", usual)
            if name == "Y" and value == low:
                machine.write("Main.M", 10)
            machine.write(f"Main.{name}", value)
            machine.scan()
            trap = machine.trap
            assert (trap is None) == good, (name, value)
            assert trap is None or (trap.code == "R0103" and f"value {value} outside {low}..{high}" in trap.message)


NAMES = ("YEAR", "MONTH", "DAY", "HOUR", "MINUTE", "SECOND", "MILLISECOND")
SPLITS = {"SPLIT_DT": (0, 7), "SPLIT_LDT": (0, 7), "SPLIT_DATE": (0, 3), "SPLIT_TOD": (3, 7), "SPLIT_LTOD": (3, 7)}


@each_of("function", SPLITS)
def test_each_part_that_is_taken_apart_says_its_range(function: str) -> None:
    """A variable that can hold no part is told the type and the range of each."""
    first, end = SPLITS[function]
    calls = " ".join(f"{function}(IN := v, {name} => b);" for name in NAMES[first:end])
    errors = compile_text(f"PROGRAM Main VAR v : {function.removeprefix('SPLIT_')}; b : BOOL; END_VAR {calls} END_PROGRAM").errors
    for error, name, (low, high) in zip(errors, NAMES[first:end], RANGES[first:end], strict=True):
        assert f"{name} is {'UINT' if high > 255 else 'USINT'} ({low}..{high})" in error.message


@each_of("function", ["CONCAT_DATE_TOD", "CONCAT_DATE_LTOD"])
def test_a_date_and_a_time_that_64_bits_cannot_hold_stop_the_program(function: str) -> None:
    kind = function.rpartition("_")[2]
    for second, good in ((15, True), (16, False)):
        machine = Plc(image_of(f"PROGRAM Main VAR v : {'L' * (kind == 'LTOD')}DT; END_VAR "
                               f"v := {function}(D#2262-04-11, {kind}#23:47:{second}.5); END_PROGRAM"))
        machine.scan()
        assert (machine.trap is None) == good
        assert not good or machine.read("Main.v") == (106_751 * 86_400 + 85_635) * NS + NS // 2


@each_of(("ns", "day", "weekday"), [(-1, 31, 3), (-86_400 * NS, 31, 3), (-86_400 * NS - 1, 30, 2), (-2 * 86_400 * NS, 30, 2)])
def test_a_moment_before_1970_is_of_the_day_that_it_is_in(ns: int, day: int, weekday: int) -> None:
    machine = Plc(image_of("PROGRAM Main VAR ns : LINT; d : DATE; y, m, n, w : INT; END_VAR "
                           "d := LDATE_TO_DATE(LINT_TO_LDATE(ns)); SPLIT_DATE(d, y, m, n); w := DAY_OF_WEEK(d); END_PROGRAM"))
    machine.write("Main.ns", ns)
    machine.scan()
    assert [machine.read(f"Main.{name}") for name in ("y", "m", "n", "w")] == [1969, 12, day, weekday]
