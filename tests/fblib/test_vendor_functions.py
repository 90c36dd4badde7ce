"""Blocks and functions of CODESYS's Util and Standard64 and of TwinCAT's Tc2_Utilities, call by call.

Expected values follow the vendors' pages that each source names; a test's name says what these leave open (`assumed`).
"""

from __future__ import annotations

from functools import cache
from random import Random
from typing import Any

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

MS = 1_000_000


@cache
def image_of(text: str) -> Image:
    made = compile_text(f"PROGRAM Main\n{text}\nEND_PROGRAM")
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


def value_of(expression: str, type: str) -> Any:
    """What an expression is in a scan."""
    plc = Plc(image_of(f"VAR v : {type}; END_VAR\nv := {expression};"))
    assert plc.scan() is None
    return plc.read("Main.v")


def outputs(block: str, pins: str, *calls: tuple[Any, ...]) -> list[Any]:
    """Calls a block once for each row: the time in ms, then the inputs; the row of its outputs `pins` after each call."""
    given, _, wanted = pins.partition(" -> ")
    plc = Plc(image_of(f"VAR b : {block}; END_VAR\nb();"))
    found = []
    for at_ms, *inputs in calls:
        for name, value in zip(given.split(), inputs, strict=True):
            plc.write(f"Main.b.{name}", value)
        assert plc.scan(at_ms * MS) is None
        row = [plc.read(f"Main.b.{name}") for name in wanted.split()]
        found.append(row[0] if len(row) == 1 else tuple(row))
    return found


# --- Util: limits, bits -------------------------------------------------------------------------------------------------


def test_hysteresis_switches_beyond_its_limits() -> None:
    calls = [(0, level, 20, 10) for level in (15, 10, 9, 15, 20, 21, 15)]
    assert outputs("HYSTERESIS", "IN HIGH LOW -> OUT", *calls) == [False, False, True, True, True, False, False]


def test_limitalarm_says_where_the_value_is() -> None:
    calls = [(0, level, 20, 10) for level in (9, 10, 20, 21)]
    assert outputs("LIMITALARM", "IN HIGH LOW -> O U IL", *calls) == [
        (False, True, False), (False, False, True), (False, False, True), (True, False, False)]  # fmt: skip


@pytest.mark.slow
@each_of(("expression", "type", "value"), [
    ("EXTRACT(16#80000001, 31)", "BOOL", True), ("EXTRACT(16#80000001, 1)", "BOOL", False),
    ("EXTRACT(16#FFFFFFFF, 32)", "BOOL", False), ("EXTRACT(16#FFFFFFFF, 255)", "BOOL", False),
    ("PUTBIT(16#F0, 0, TRUE)", "DWORD", 0xF1), ("PUTBIT(16#F0, 7, FALSE)", "DWORD", 0x70),
    ("PUTBIT(16#F0, 32, TRUE)", "DWORD", 0xF0),
    ("SETBIT(0, 31)", "DWORD", 1 << 31), ("SWITCHBIT(3, 1)", "DWORD", 1), ("SWITCHBIT(1, 1)", "DWORD", 3),
    ("PACK(TRUE, FALSE, TRUE, FALSE, FALSE, FALSE, FALSE, TRUE)", "BYTE", 0x85),
    ("Util.SETBIT(X := 0, N := 2)", "DWORD", 4),
])  # fmt: skip
def test_functions_of_bits(expression: str, type: str, value: object) -> None:
    assert value_of(expression, type) == value


@pytest.mark.slow
@each_of(("block", "whole", "bits"), [
    ("UNPACK", "B", [f"B{n}" for n in range(8)]), ("BYTE_AS_BIT", "B", [f"B{n}" for n in range(8)]),
    ("WORD_AS_BIT", "W", [f"B{n:02}" for n in range(16)]), ("DWORD_AS_BIT", "X", [f"B{n:02}" for n in range(32)]),
])  # fmt: skip
def test_blocks_from_and_to_bits(block: str, whole: str, bits: list[str]) -> None:
    number = 0x9ABCDEF1 & (1 << len(bits)) - 1
    [found] = outputs(block, f"{whole} -> {' '.join(bits)}", (0, number))
    assert sum(bit << place for place, bit in enumerate(found)) == number
    back = f"BIT_AS_{block.partition('_')[0]}" if block != "UNPACK" else "BIT_AS_BYTE"
    alone = [(0, *(at == place for at in range(len(bits)))) for place in range(len(bits))]
    single = [1 << place for place in range(len(bits))]
    assert outputs(back, f"{' '.join(bits)} -> {whole}", (0, *found), *alone) == [number, *single]
    assert outputs(block, f"{whole} -> {' '.join(bits)}", *((0, value) for value in single)) == [row[1:] for row in alone]


# --- Util: curves, values -----------------------------------------------------------------------------------------------

CURVE = """VAR c : CHARCURVE; N : BYTE := 4; level : INT;
    p : ARRAY[0..10] OF POINT := [(X := 0, Y := 0), (X := 250, Y := 50), (X := 500, Y := -150), (X := 750, Y := 400)]; END_VAR
c(IN := level, N := N, P := p);"""


@each_of(("level", "out", "err"), [
    (0, 0, 0), (125, 25, 0), (250, 50, 0), (375, -50, 0), (750, 400, 0), (751, 400, 2), (-1, 0, 2)])  # fmt: skip
def test_charcurve_is_straight_between_its_points(level: int, out: int, err: int) -> None:
    plc = Plc(image_of(CURVE))
    plc.write("Main.level", level)
    plc.scan()
    assert (plc.read("Main.c.OUT"), plc.read("Main.c.ERR")) == (out, err)


@each_of(("name", "value", "err"), [("N", 1, 4), ("N", 12, 4), ("N", 0, 4), ("N", 5, 1), ("p[1].X", 500, 1), ("p[2].X", 100, 1)])
def test_charcurve_refuses_what_is_no_curve(name: str, value: int, err: int) -> None:
    plc = Plc(image_of(CURVE))
    plc.write("Main.level", 125)
    plc.scan()
    plc.write(f"Main.{name}", value)
    plc.write("Main.level", 250)
    plc.scan()
    assert (plc.read("Main.c.OUT"), plc.read("Main.c.ERR")) == (25, err)


@pytest.mark.parametrize("block", ["RAMP_INT", "RAMP_REAL"])
def test_a_ramp_rises_and_falls_with_time(block: str) -> None:
    pins = "IN ASCEND DESCEND TIMEBASE RESET -> OUT"
    second = 1000 * MS
    calls = [(0, 100, 50, 20, second, False), (1000, 100, 50, 20, second, False), (1500, 100, 50, 20, second, False),
             (3000, 100, 50, 20, second, False), (4000, 0, 50, 20, second, False), (5000, 0, 50, 20, second, True),
             (6000, 0, 50, 20, second, False)]  # fmt: skip
    assert outputs(block, pins, *calls) == [0, 50, 75, 100, 80, 80, 60]


def test_a_ramp_without_time_counts_calls() -> None:
    calls = [(at, 10, 4, 3, 0, False) for at in (0, 1, 1, 9)] + [(10, -10, 4, 3, 0, False)]
    assert outputs("RAMP_INT", "IN ASCEND DESCEND TIMEBASE RESET -> OUT", *calls) == [0, 4, 8, 10, 7]


def test_a_ramp_keeps_parts_of_a_whole_number_assumed() -> None:
    calls = [(at, 100, 1, 1, 1000 * MS, False) for at in range(0, 5000, 100)]
    assert outputs("RAMP_INT", "IN ASCEND DESCEND TIMEBASE RESET -> OUT", *calls)[-1] == 5


def test_lin_trafo_carries_a_value_over() -> None:
    pins = "IN IN_MIN IN_MAX OUT_MIN OUT_MAX -> OUT ERROR"
    calls = [(0, 5.0, 0.0, 10.0, 100.0, 300.0), (0, 10.5, 0.0, 10.0, 100.0, 300.0), (0, 2.5, 10.0, 0.0, 0.0, 8.0),
             (0, 1.0, 1.0, 1.0, 0.0, 8.0)]  # fmt: skip
    assert outputs("LIN_TRAFO", pins, *calls) == [(200.0, False), (200.0, True), (6.0, False), (6.0, True)]


def test_statistics_and_variance_of_what_came() -> None:
    calls = [(0, 3, False), (0, -1, False), (0, 10, False)]
    assert outputs("STATISTICS_INT", "IN RESET -> MN MX AVG", *calls, (0, 5, True), (0, 5, False)) == [
        (3, 3, 3), (-1, 3, 1), (-1, 10, 4), (32767, -32768, 0), (5, 5, 5)]  # fmt: skip
    real = [(0, 1.0, False), (0, 2.0, False), (0, 3.0, False), (0, 9.0, True), (0, 9.0, False)]
    assert outputs("STATISTICS_REAL", "IN RESET -> AVG", *real) == [1.0, 1.5, 2.0, 0.0, 9.0]
    assert outputs("VARIANCE", "IN RESET -> OUT", *real) == [0.0, 0.25, pytest.approx(2 / 3), 0.0, 0.0]


def test_the_integral_sums_value_times_milliseconds_until_it_is_beyond_real() -> None:
    calls = [(0, 2.0, 10, False), (0, -1.0, 5, False), (0, 3e38, 2, False), (0, 1.0, 1, False), (0, 1.0, 1, True),
             (0, 1.0, 1, False)]  # fmt: skip
    assert outputs("INTEGRAL", "IN TM RESET -> OUT OVERFLOW", *calls) == [
        (20.0, False), (15.0, False), (15.0, True), (15.0, True), (0.0, False), (1.0, False)]  # fmt: skip


# --- Util: signals ------------------------------------------------------------------------------------------------------


def test_the_derivative_is_of_four_values_and_their_times() -> None:
    pins = "IN TM RESET -> OUT"
    calls = [(0, 5.0, 10, False), *((0, 5.0 + 2.0 * n, 10, False) for n in range(1, 5)), (0, 7.0, 10, True), (0, 8.0, 5, False)]
    # 6/30, (12 + 2)/70, (18 + 2)/100, as far as the line goes back; then 3 / 15
    assert outputs("DERIVATIVE", pins, *calls) == pytest.approx([0.0, 0.2, 0.2, 0.2, 0.2, 0.0, 0.2], abs=1e-6)


def test_a_controller_of_p_and_d_with_limits() -> None:
    pins = "ACTUAL SET_POINT KP TV Y_MANUAL Y_OFFSET Y_MIN Y_MAX MANUAL RESET -> Y LIMITS_ACTIVE"
    rest = (2.0, 0.5, 7.0, 1.0)
    calls = [(100, 0.0, 10.0, *rest, 0.0, 0.0, False, False), (200, 1.0, 10.0, *rest, 0.0, 0.0, False, False),
             (300, 1.0, 10.0, *rest, 0.0, 15.0, False, False), (400, 8.0, 10.0, *rest, 0.0, 15.0, False, False),
             (500, 8.0, 10.0, *rest, 0.0, 15.0, True, False), (600, 8.0, 10.0, *rest, 0.0, 15.0, False, True),
             (700, 8.0, 10.0, *rest, 0.0, 15.0, False, False)]  # fmt: skip
    assert outputs("PD", pins, *calls) == [
        (21.0, False), (9.0, False), (15.0, True), (0.0, True), (7.0, False), (1.0, False), (5.0, False)]  # fmt: skip


PID_PINS = "ACTUAL SET_POINT KP TN TV Y_MANUAL Y_OFFSET Y_MIN Y_MAX MANUAL RESET"


def test_a_pid_sums_the_error_over_the_time_between_its_calls_assumed() -> None:
    calls = [(at, 0.0, 4.0, 2.0, 8.0, 0.0, 9.0, 1.0, 0.0, 0.0, manual, reset)
             for at, manual, reset in ((1000, 0, 0), (2000, 0, 0), (4000, 0, 0), (5000, 1, 0), (6000, 0, 0), (7000, 0, 1))]
    assert outputs("PID", f"{PID_PINS} -> Y", *calls) == [9.0, 10.0, 12.0, 9.0, 9.0, 1.0]


def test_parameters_of_a_pid_are_read_where_it_begins() -> None:
    def call(gain: float, cycle: float, reset: bool = False) -> tuple[Any, ...]:
        return (0, 0.0, 4.0, gain, 8.0, 1.0, 9.0, 1.0, 0.0, 0.0, False, reset, cycle)

    calls = [call(2.0, 1.0, True), call(2.0, 1.0), call(5.0, 1.0), call(5.0, 1.0, True), call(5.0, 1.0)]
    assert outputs("PID_FIXCYCLE", f"{PID_PINS} CYCLE -> Y", *calls) == [1.0, 9.0, 10.0, 1.0, 21.0]


def test_the_sum_of_a_pid_does_not_grow_beyond_a_limit_assumed() -> None:
    def call(actual: float) -> tuple[Any, ...]:
        return (0, actual, 4.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 10.0, False, False, 1.0)

    calls = [call(0.0)] * 6 + [call(5.0)] * 2
    assert outputs("PID_FIXCYCLE", f"{PID_PINS} CYCLE -> Y LIMITS_ACTIVE OVERFLOW", *calls) == [
        (4.0, False, False), (8.0, False, False), (10.0, True, False), (10.0, True, False), (10.0, True, False),
        (10.0, True, False), (6.0, False, False), (5.0, False, False)]  # fmt: skip


def test_the_sum_of_a_pid_overflows_until_it_is_reset() -> None:
    calls = [(0, 0.0, 3e38, 1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 1.0, False, reset, cycle)
             for reset, cycle in ((True, 1.0), (False, 1.0), (False, 1.0))]
    free = [(*call[:8], 0.0, 0.0, *call[10:]) for call in calls]
    assert outputs("PID_FIXCYCLE", f"{PID_PINS} CYCLE -> OVERFLOW", *free, (*free[1][:-1], 2.0), free[0]) == [
        False, False, False, True, False]  # fmt: skip


@pytest.mark.slow
@each_of(("mode", "values"), [
    ("TRIANGLE", [-100, 0, 100, 0, -100, 0]), ("TRIANGLE_POS", [0, 50, 100, 50, 0, 50]),
    ("SAWTOOTH_RISE", [-100, -50, 0, 50, -100, -50]), ("SAWTOOTH_FALL", [100, 50, 0, -50, 100, 50]),
    ("RECTANGLE", [-100, -100, 100, 100, -100, -100]), ("SINE", [0, 100, 0, -100, 0, 100]),
    ("COSINE", [100, 0, -100, 0, 100, 0]),
])  # fmt: skip
def test_a_generator_of_periodic_values_by_calls_and_by_time_assumed(mode: str, values: list[int]) -> None:
    for by_time, head in (("FALSE", "CYCLES := 4"), ("TRUE", "PERIOD := T#4s")):
        plc = Plc(image_of(f"VAR g : GEN; r : BOOL; END_VAR\n"
                           f"g(MODE := GEN_MODE#{mode}, BASE := {by_time}, {head}, AMPLITUDE := 100, RESET := r);"))
        found = []
        for at in range(6):
            assert plc.scan(at * 1000 * MS) is None
            found.append(plc.read("Main.g.OUT"))
        assert found == values
        plc.write("Main.r", True)
        plc.scan(7000 * MS)
        assert plc.read("Main.g.OUT") == 0
        plc.write("Main.r", False)
        plc.scan(9500 * MS)
        assert plc.read("Main.g.OUT") == values[0]


def test_blink_begins_high_and_stays_when_it_is_disabled() -> None:
    low, high = 20 * MS, 30 * MS
    calls = [(at, at < 90 or at >= 110, low, high) for at in range(0, 150, 10)]
    assert "".join(" #"[level] for level in outputs("BLINK", "ENABLE TIMELOW TIMEHIGH -> OUT", *calls)) == "###  ###   ### "


def test_freq_measure_is_the_mean_of_periods() -> None:
    calls = [(at, at % 100 < 50 and at < 500, 2, False) for at in range(0, 800, 50)]
    found = outputs("FREQ_MEASURE", "IN PERIODS RESET -> OUT VALID", *calls)
    assert found[3] == (0.0, False)
    assert found[4] == (10.0, True)
    assert found[12] == (10.0, True)
    assert found[13] == (0.0, False)


# --- texts --------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of(("expression", "type", "value"), [
    ('WLEN("ab\u20ac")', "INT", 3), ('WLEFT("abcd", 2)', "WSTRING", "ab"), ('WRIGHT("abcd", 1)', "WSTRING", "d"),
    ('WMID("abcd", 2, 2)', "WSTRING", "bc"), ('WCONCAT("ab", "cd")', "WSTRING", "abcd"),
    ('WINSERT("ad", "bc", 1)', "WSTRING", "abcd"),
    ('WDELETE("abcd", 2, 2)', "WSTRING", "ad"), ('WREPLACE("abcd", "x", 2, 2)', "WSTRING", "axd"),
    ('WFIND("abcd", "cd")', "INT", 3),
    ('Standard64.WFIND("abcd", "x")', "INT", 0),
    ("F_LTrim('  a b ')", "STRING", "a b "), ("F_RTrim(' a b  ')", "STRING", " a b"), ("F_RTrim('   ')", "STRING", ""),
    ("F_ToLCase('AZaz[09')", "STRING", "azaz[09"), ("F_ToUCase('AZaz{09')", "STRING", "AZAZ{09"),
    ("BYTE_TO_HEXSTR(16#AF, 4, TRUE)", "STRING", "00af"), ("BYTE_TO_HEXSTR(0, 0, FALSE)", "STRING", ""),
    ("WORD_TO_HEXSTR(16#AF, 1, FALSE)", "STRING", "AF"), ("DWORD_TO_HEXSTR(16#80000000, 8, FALSE)", "STRING", "80000000"),
    ("LWORD_TO_HEXSTR(16#FEDCBA9876543210, 8, FALSE)", "STRING", "FEDCBA9876543210"),
    ("Tc2_Utilities.BYTE_TO_HEXSTR(in := 7, iPrecision := 2, bLoCase := FALSE)", "T_MaxString", "07"),
])  # fmt: skip
def test_functions_of_texts(expression: str, type: str, value: object) -> None:
    assert value_of(expression, type) == value


# --- Tc2_Utilities: texts of arguments, records in a buffer ---------------------------------------------------------------


FORMATS = [
    ("%d and %5d.", ["F_INT(n)", "F_DINT(m)"], "-7 and    42."), ("%-5d|%05d", ["F_DINT(m)", "F_INT(n)"], "42   |-0007"),
    ("%u %x %X %o %b", ["F_UINT(u)"] * 5, "171 ab AB 253 10101011"), ("100%%%d%%", ["F_DINT(m)"], "100%42%"),
    ("%f %.2f %.0f", ["F_REAL(r)", "F_LREAL(l)", "F_LREAL(l)"], "1.500000 -2.25 -2"), ("%8.1f|", ["F_REAL(r)"], "     1.5|"),
    ("%s,%.2s,%4.1s", ["F_STRING(t)"] * 3, "abc,ab,   a"), ("%c", ["F_BYTE(b)"], "A"),
    ("%4c|%-4c|", ["F_BYTE(b)"] * 2, "   A|A   |"), ("%d%d%d%d%d%d%d%d%d%d", ["F_DINT(m)"] * 10, "42" * 10),
    ("plain", [], "plain"), ("", [], ""),
]  # fmt: skip
WRONG_FORMATS = [("%d", []), ("%q", ["F_DINT(m)"]), ("%d", ["F_STRING(t)"]), ("%s", ["F_DINT(m)"]), ("%f", ["F_DINT(m)"]),
                 ("x%", ["F_DINT(m)"]), ("%d%d%d%d%d%d%d%d%d%d%d", ["F_DINT(m)"] * 10), ("%d %d", ["F_DINT(m)"])]  # fmt: skip
ARGUMENTS = """VAR f : FB_FormatString; n : INT := -7; m : DINT := 42; u : UINT := 171; r : REAL := 1.5; l : LREAL := -2.25;
    t : T_MaxString := 'abc'; b : BYTE := 65; what : INT; END_VAR"""


@pytest.mark.slow
def test_arguments_are_put_into_a_text_and_what_does_not_fit_is_an_error() -> None:
    calls = [*((text, arguments, (False, 0, said)) for text, arguments, said in FORMATS),
             *((*wrong, (True, 1, "")) for wrong in WRONG_FORMATS)]  # fmt: skip
    pins = ["".join(f", arg{at} := {one}" for at, one in enumerate(arguments, 1)) for _, arguments, _ in calls]
    rows = "\n".join(f"{number}: f(sFormat := '{call[0]}'{pins[number]});" for number, call in enumerate(calls))
    plc = Plc(image_of(f"{ARGUMENTS}\nCASE what OF\n{rows}\nEND_CASE;"))
    for number, (text, _, expected) in enumerate(calls):
        plc.cold_start()
        plc.write("Main.what", number)
        assert plc.scan() is None
        assert (plc.read("Main.f.bError"), plc.read("Main.f.nErrId"), plc.read("Main.f.sOut")) == expected, text


RING = """VAR f : FB_MemRingBuffer; buffer : ARRAY[0..18] OF BYTE; give, take : ARRAY[0..15] OF BYTE; size, room : UDINT;
    what : INT; END_VAR
f.pBuffer := ADR(buffer); f.cbBuffer := SIZEOF(buffer);
f.pWrite := ADR(give); f.cbWrite := size; f.pRead := ADR(take); f.cbRead := room;
CASE what OF 0: f.A_AddTail(); 1: f.A_GetHead(); 2: f.A_RemoveHead(); 3: f.A_Reset(); END_CASE;"""
RING_BYTES, LENGTH_BYTES = 19, 4


@pytest.mark.slow
def test_records_come_out_of_a_ring_as_they_went_in() -> None:
    """Against a list of records, with which the ring goes round several times; lengths of 0 are refused."""
    draw, plc, records = Random(1), Plc(image_of(RING)), list[bytes]()
    refused = 0
    for _ in range(300):
        what, size, room = draw.choices((0, 1, 2, 3), (12, 4, 10, 1))[0], draw.randrange(9), draw.randrange(10)
        given = bytes(draw.randrange(256) for _ in range(16))
        plc.write("Main.give", list(given))
        for name, value in (("what", what), ("size", size), ("room", room)):
            plc.write(f"Main.{name}", value)
        assert plc.scan() is None
        used = sum(len(record) + LENGTH_BYTES for record in records)
        good, length = True, plc.read("Main.f.cbReturn")
        if what == 0:
            good = size > 0 and used + size + LENGTH_BYTES <= RING_BYTES
            records += [given[:size]] * good
        elif what == 3:
            records.clear()
        else:
            head = records[0] if records else b""
            good = bool(records) and len(head) <= room
            assert length == len(head)
            assert not good or bytes(plc.read("Main.take")[:length]) == head
            records = records[1:] if good and what == 2 else records
        refused += not good
        now = sum(len(record) + LENGTH_BYTES for record in records)
        assert (plc.read("Main.f.bOk"), plc.read("Main.f.nCount"), plc.read("Main.f.cbSize")) == (good, len(records), now)
    assert 50 < refused < 250
