"""CONCAT_... and SPLIT_... of dates against Python's calendar, and the dates that there are not."""

from __future__ import annotations

from datetime import date, datetime, timedelta
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.code.compiler import compile_text
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
