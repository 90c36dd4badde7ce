"""Formats, tables, queues, clocks, time zones and the log of Tc2_Utilities and Tc2_System, call by call."""

from __future__ import annotations

from typing import Any

import pytest
from test_twincat_blocks import MS, after, image_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

# --- FB_FormatString ----------------------------------------------------------------------------------------------------

GIVEN = """n : INT := -7; s : SINT := -128; d : DINT := -2147483648; l : LINT := -9000000000000000000; us : USINT := 255;
u : UINT := 65535;
ud : UDINT := 4294967295; ul : ULINT := 18446744073709551615; bb : BYTE := 16#A5; w : WORD := 16#A5F0; dw : DWORD := 16#A5F01234;
lw : LWORD := 16#A5F0123456789ABC; b : BOOL := TRUE; r : REAL := 0.4; x : LREAL := 999999999.0; y : LREAL := 1.0E9;
z : LREAL := -0.001;
v : LREAL := 1.0625; t : T_MaxString := 'abc'; e : T_MaxString; d0, d1, d2, d3, d4, d5, d6, d7, d8, d9 : INT;"""
TOLD = [
    ("%d %d %d %d", "F_SINT(s) F_INT(n) F_DINT(d) F_LINT(l)", "-128 -7 -2147483648 -9000000000000000000"),
    ("%i %i %i %i", "F_USINT(us) F_UINT(u) F_UDINT(ud) F_ULINT(ul)", "255 65535 4294967295 18446744073709551615"),
    ("%u %u %u %u", "F_BYTE(bb) F_WORD(w) F_DWORD(dw) F_LWORD(lw)", f"165 {0xA5F0} {0xA5F01234} {0xA5F0123456789ABC}"),
    ("%d %d %d %d", "F_BYTE(bb) F_WORD(w) F_DWORD(dw) F_LWORD(lw)", f"165 {0xA5F0} {0xA5F01234} {0xA5F0123456789ABC}"),
    ("%x %X %x %X", "F_SINT(s) F_INT(n) F_DWORD(dw) F_LWORD(lw)", "80 FFF9 a5f01234 A5F0123456789ABC"),
    ("%o %b %o", "F_BYTE(bb) F_BYTE(bb) F_ULINT(ul)", "245 10100101 1777777777777777777777"),
    ("%d %u %x", "F_BOOL(b) " * 3, "1 1 1"),
    ("%.4x %.2X %.3o %.9b", "F_BYTE(bb) " * 4, "00a5 A5 245 010100101"),
    ("%6.4x|%-6.4x|%06.4x", "F_BYTE(bb) " * 3, "  00a5|00a5  |0000a5"),
    ("%x %u", "F_INT(d0) F_INT(d0)", "0 0"), ("%c%c", "F_BYTE(bb) F_WORD(w)", "\xa5\xf0"), ("%2c", "F_BYTE(bb)", " \xa5"),
    ("%f %.1f %.9f %.10f", "F_REAL(r) F_REAL(r) F_LREAL(v) F_LREAL(v)", "0.400000 0.4 1.062500000 1.062500000"),
    ("%.0f %.1f", "F_LREAL(x) F_LREAL(x)", "999999999 999999999.0"), ("%.2f %.3f", "F_LREAL(z) F_LREAL(z)", "0.00 -0.001"),
    ("%07.2f|%-7.2f|%7.2f", "F_LREAL(v) " * 3, "0001.06|1.06   |   1.06"), ("%.02f", "F_LREAL(v)", "1.06"),
    ("%07.3f", "F_LREAL(z)", "-00.001"),
    ("%.0s|%.3s|%.4s|%5s|%-5s|%05s|%3s", "F_STRING(t) " * 7, "|abc|abc|  abc|abc  |00abc|abc"),
    ("%s|%2s", "F_STRING(e) F_STRING(e)", "|  "),
    ("%10d|%-10d|%-05d|%05d|%2d", "F_INT(n) " * 5, "        -7|-7        |-7   |-0007|-7"), ("%003d", "F_INT(n)", "-07"),
    ("%d" * 10, " ".join(f"F_INT(d{at})" for at in range(10)), "0123456789"), ("%300d", "F_INT(n)", f"{-7:255}"),
    ("%255s", "F_STRING(t)", f"{'abc':>255}"),
    ("%.300b", "F_BYTE(bb)", f"{0xA5:0255b}"), ("a%%b%%", "", "a%b%"), ("%%%d", "F_INT(n)", "%-7"),
    ("%x", "F_BIGTYPE(ADR(dw),2)", "1234"),
    ("%x", "F_BIGTYPE(ADR(lw),9)", "a5f0123456789abc"),
]  # fmt: skip
REFUSED = [("%f", "F_LREAL(y)"), ("x%s", "F_REAL(r)"), ("%d", "F_REAL(r)"), ("%c", "F_STRING(t)"), ("%5", "F_INT(n)"),
("%", "F_INT(n)"),
           ("%s", "F_BIGTYPE(ADR(t),3)"), ("%d", "F_BIGTYPE(NULL,2)"), ("%s", ""), ("%d%f", "F_INT(n) F_INT(n)"),
           ("%z", "F_INT(n)")]  # fmt: skip


@pytest.mark.slow
def test_formats_of_each_type_and_their_widths() -> None:
    calls = [*((text, arguments, (False, 0, said)) for text, arguments, said in TOLD), *((*row, (True, 1, ""))
    for row in REFUSED)]
    rows = []
    for number, (text, arguments, _) in enumerate(calls):
        pins = "".join(f", arg{at} := {one}" for at, one in enumerate(arguments.split(), 1))
        rows.append(f"{number}: f(sFormat := '{text}'{pins});")
    lines = "\n".join(rows)
    digits = " ".join(f"d{at} := {at};" for at in range(10))
    plc = Plc(image_of(f"VAR f : FB_FormatString; {GIVEN} what : INT; END_VAR\n{digits}\nCASE what OF\n{lines}\nEND_CASE;"))
    for number, (text, _, expected) in enumerate(calls):
        plc.cold_start()
        assert after(plc, "f.bError f.nErrId f.sOut", what=number) == expected, text


@pytest.mark.slow
def test_what_a_format_says_holds_for_one_call() -> None:
    plc = Plc(image_of("VAR f : FB_FormatString; n : INT := 5; form : T_MaxString; END_VAR\n"
                       "f(sFormat := form, arg1 := F_INT(n));"))  # fmt: skip
    rows = [("%-04d|", (False, 0, "5   |")), ("%04d", (False, 0, "0005")), ("%d%", (True, 1, "")), ("%d", (False, 0, "5")),
            ("%d%d", (True, 1, "")), ("x", (False, 0, "x")), ("%%", (False, 0, "%")), ("%", (True, 1, ""))]  # fmt: skip
    assert [(form, after(plc, "f.bError f.nErrId f.sOut", form=form)) for form, _ in rows] == rows


@pytest.mark.slow
def test_ten_arguments_are_the_most_and_a_text_is_cut_at_255_characters() -> None:
    pins = ", ".join(f"arg{number} := F_INT(n)" for number in range(1, 11))
    plc = Plc(image_of(f"VAR f, g : FB_FormatString; n : INT := 5; form : T_MaxString; long : STRING(300); END_VAR\n"
                       f"MEMSET(ADR(long), 66, 300); f(sFormat := form, {pins});\n"
                       "g(sFormat := '%s', arg1 := F_STRING(long));"))  # fmt: skip
    assert after(plc, "f.sOut f.bError", form="%d" * 10) == ("5" * 10, False)
    assert after(plc, "f.sOut f.bError", form="%d" * 11) == ("", True)
    assert after(plc, "g.sOut g.bError") == ("B" * 255, False)


@pytest.mark.slow
def test_an_argument_of_no_kind_is_refused() -> None:
    plc = Plc(image_of("VAR f : FB_FormatString; n : INT := 5; given : T_Arg; none : BOOL; END_VAR\ngiven := F_INT(n);\n"
                       "IF none THEN given.eType := ARGTYPE_UNKNOWN; END_IF f(sFormat := '%d', arg1 := given);"))  # fmt: skip
    assert [after(plc, "f.bError f.sOut", none=none) for none in (False, True)] == [(False, "5"), (True, "")]


@pytest.mark.slow
def test_the_length_of_a_text_as_an_argument_counts_its_end() -> None:
    plc = Plc(image_of("VAR t : STRING(9); n : UDINT; kind : BOOL; END_VAR\n"
                       "n := F_STRING(t).cbLen; kind := F_STRING(t).eType = ARGTYPE_STRING;"))  # fmt: skip
    assert [after(plc, "n kind", t=text) for text in ("", "a", "abcdefghi")] == [(1, True), (2, True), (10, True)]


# --- tables and queues --------------------------------------------------------------------------------------------------

HASHED = """VAR
    t : FB_HashTableCtrl; h : T_HHASHTABLE; entries : ARRAY[0..2] OF T_HashTableEntry; what : INT; k : DWORD; value, no : UDINT;
    got, place : UDINT; made : BOOL; size : UDINT; posed : BOOL;
END_VAR
CASE what OF
    0: made := F_CreateHashTableHnd(pEntries := SEL(posed, ADR(entries), NULL), cbEntries := size, hTable := h);
    1: t.A_Add(hTable := h, key := k, putValue := UDINT_TO_DWORD(value));
    2: t.A_Lookup(hTable := h, key := k);
    3: t.A_Remove(hTable := h, key := k);
    4: t.A_GetFirst(hTable := h);
    5: t.A_GetNext(hTable := h, putPosPtr := t.getPosPtr);
    6: t.A_GetIndexAtPosPtr(hTable := h, putPosPtr := ADR(entries[no]));
    7: t.A_RemoveFirst(hTable := h);
    8: t.A_RemoveAll(hTable := h);
    9: t.A_Reset(hTable := h);
    10: t.A_GetIndexAtPosPtr(hTable := h, putPosPtr := NULL);
    11: t(hTable := h);
END_CASE
got := t.getValue; place := 99;
IF t.getPosPtr <> NULL THEN place := DINT_TO_UDINT(t.getPosPtr - ADR(entries)) / SIZEOF(T_HashTableEntry); END_IF"""


@pytest.mark.slow
def test_a_table_of_three_places_finds_goes_on_and_removes() -> None:
    plc = Plc(image_of(HASHED))

    def did(what: int, **inputs: Any) -> tuple[Any, ...]:
        return after(plc, "t.bOk got place h.nCount h.nFree", what=what, **inputs)

    assert did(1, k=1) == did(2) == did(4) == did(7) == (False, 0, 99, 0, 0)
    assert [did(what)[0] for what in (5, 6)] == [False, False]
    bytes_each = next(size for size in range(1, 64) if after(plc, "made", what=0, size=size)[0])
    assert after(plc, "made h.nCount h.nFree h.Places", size=3 * bytes_each - 1) == (True, 0, 2, 2)
    assert after(plc, "made h.nCount h.nFree h.Places", posed=True) == (False, 0, 0, 0)
    assert after(plc, "made h.nCount h.nFree h.Places", posed=False, size=bytes_each - 1) == (False, 0, 0, 0)
    assert after(plc, "made h.nCount h.nFree h.Places", size=bytes_each) == (True, 0, 1, 1)
    assert [did(1, k=7, value=70), did(1, k=8), did(2, k=7)] == [(True, 70, 0, 1, 0), (False, 0, 99, 1, 0), (True, 70, 0, 1, 0)]
    assert did(6, no=0) == (True, 0, 0, 1, 0)
    assert after(plc, "made h.nCount h.nFree h.Places", what=0, size=3 * bytes_each) == (True, 0, 3, 3)
    assert did(1, k=2, value=20) == (True, 20, 2, 1, 2)
    assert did(1, k=5, value=50) == (True, 50, 0, 2, 1)
    assert did(1, k=8, value=80) == (True, 80, 1, 3, 0)
    assert did(1, k=0, value=1) == (False, 0, 99, 3, 0)
    assert did(1, k=5, value=55) == (True, 55, 0, 3, 0)
    assert [did(2, k=k)[:3] for k in (2, 5, 8, 0, 11)] == [(True, 20, 2), (True, 55, 0), (True, 80, 1), (False, 0, 99),
    (False, 0, 99)]
    assert [did(what)[:3] for what in (4, 5, 5, 5)] == [(True, 55, 0), (True, 80, 1), (True, 20, 2), (False, 0, 99)]
    assert [did(6, no=place)[:3] for place in (0, 1, 2)] == [(True, 0, 0), (True, 1, 1), (True, 2, 2)]
    assert did(10) == (False, 0, 99, 3, 0)
    assert did(3, k=5) == (True, 55, 0, 2, 1)
    assert did(3, k=5) == did(2, k=5) == (False, 0, 99, 2, 1)
    assert did(2, k=8) == (True, 80, 1, 2, 1)
    assert did(11)[0] is False
    assert [did(what)[:3] for what in (4, 5, 5)] == [(True, 80, 1), (True, 20, 2), (False, 0, 99)]
    assert did(1, k=11, value=110) == (True, 110, 0, 3, 0)
    assert did(7) == (True, 110, 0, 2, 1)
    assert did(7) == (True, 80, 1, 1, 2)
    assert did(9) == (True, 0, 99, 0, 3)
    assert did(7) == (False, 0, 99, 0, 3)
    assert did(1, k=4, value=4) == (True, 4, 1, 1, 2)
    assert did(8) == (True, 0, 99, 0, 3)
    assert [did(1, k=k)[0] for k in (0, 1, 2)] == [True] * 3
    assert after(plc, "made h.nCount h.nFree h.Places", what=0, size=bytes_each) == (True, 0, 1, 1)
    assert did(4) == did(2, k=1) == (False, 0, 99, 0, 1)


QUEUE = """VAR q : FB_StringRingBuffer; room : ARRAY[0..19] OF BYTE; what : INT; END_VAR
q.pBuffer := ADR(room); q.cbBuffer := SIZEOF(room);
CASE what OF 0: q.A_Reset(); 1: q.A_AddTail(); 2: q.A_GetHead(); 3: q.A_RemoveHead(); END_CASE"""


@pytest.mark.slow
def test_a_queue_of_texts_counts_its_bytes() -> None:
    plc = Plc(image_of(QUEUE))

    def did(what: int, text: str = "", over: bool = False) -> tuple[Any, ...]:
        return after(plc, "q.bOk q.getValue q.nCount q.cbSize q.cbFree", what=what, **{"q.putValue": text, "q.bOverwrite": over})

    assert did(0) == (True, "", 0, 0, 20)
    assert did(2) == did(3) == (False, "", 0, 0, 20)
    assert did(1, "abc") == (True, "", 1, 8, 12)
    assert did(1, "") == (True, "", 2, 13, 7)
    assert did(1, "xyz") == (False, "", 2, 13, 7)
    assert did(1, "xy") == (True, "", 3, 20, 0)
    assert did(2) == (True, "abc", 3, 20, 0)
    assert did(3) == (True, "abc", 2, 12, 8)
    assert did(3) == (True, "", 1, 7, 13)
    assert did(1, "a" * 9, over=True) == (True, "", 1, 14, 6)
    assert did(1, "a" * 15, over=True) == (True, "", 1, 20, 0)
    assert did(1, "a" * 16, over=True) == (False, "", 0, 0, 20)
    assert did(1, "b") == (True, "", 1, 6, 14)
    assert did(2) == (True, "b", 1, 6, 14)
    assert did(0) == (True, "", 0, 0, 20)
    assert did(3) == (False, "", 0, 0, 20)
    for what in (2, 3):
        assert [did(1, "c"), did(3), did(what)] == [(True, "", 1, 6, 14), (True, "c", 0, 0, 20), (False, "", 0, 0, 20)]


@pytest.mark.slow
def test_a_record_of_a_ring_begins_with_its_length_of_four_bytes() -> None:
    plc = Plc(image_of("""VAR
    q : FB_MemRingBuffer; room : ARRAY[0..69999] OF BYTE; give, take : ARRAY[0..66999] OF BYTE; go : INT;
END_VAR
q.pBuffer := ADR(room); q.cbBuffer := SIZEOF(room); q.pWrite := ADR(give); q.pRead := ADR(take); q.cbRead := SIZEOF(take);
CASE go OF 1: give[0] := 7; give[66050] := 9; q.cbWrite := 16#10203; q.A_AddTail(); 2: q.A_RemoveHead(); 3: q.cbWrite := 16#1FF;
q.A_AddTail(); END_CASE"""))
    told = "q.bOk q.nCount q.cbSize q.cbReturn"
    assert after(plc, told, go=1) == (True, 1, 0x10207, 0)
    assert [plc.read(f"Main.room[{at}]") for at in range(5)] == [3, 2, 1, 0, 7]
    assert after(plc, told, go=2) == (True, 0, 0, 0x10203)
    assert [plc.read(f"Main.take[{at}]") for at in (0, 66049, 66050, 66051)] == [7, 0, 9, 0]
    assert after(plc, told, go=3) == (True, 1, 0x203, 0x10203)
    assert [plc.read(f"Main.room[{at}]") for at in range(0x10207, 0x1020B)] == [255, 1, 0, 0]
    assert after(plc, told, go=2) == (True, 0, 0, 0x1FF)


# --- clocks -------------------------------------------------------------------------------------------------------------

ZONES = """VAR
    text : STRING(23); zone : ST_TimeZoneInformation; utc : FB_TzSpecificLocalTimeToSystemTime;
    here : FB_SystemTimeToTzSpecificLocalTime;
    there, back : STRING(23); first, second : INT;
END_VAR
utc(in := STRING_TO_SYSTEMTIME(text), tzInfo := zone); there := SYSTEMTIME_TO_STRING(utc.out); first := TO_INT(utc.eTzID);
here(in := STRING_TO_SYSTEMTIME(text), tzInfo := zone); back := SYSTEMTIME_TO_STRING(here.out); second := TO_INT(here.eTzID);"""
UNKNOWN, STANDARD, DAYLIGHT = 0, 1, 2


def zone(bias: int, standard: tuple[int, ...] = (), daylight: tuple[int, ...] = (), moved: int = -60,
         kept: int = 0) -> dict[str, int]:  # fmt: skip
    """A zone whose times begin at (month, number of the week, day of the week, hour), and the year and the day if it has one."""
    given = {"zone.bias": bias, "zone.standardBias": kept, "zone.daylightBias": moved}
    for name, rule in (("standardDate", standard), ("daylightDate", daylight)):
        for part, value in zip(("wMonth", "wDay", "wDayOfWeek", "wHour", "wYear"), rule, strict=False):
            given[f"zone.{name}.{part}"] = value
    return given


@pytest.mark.slow
@pytest.mark.parametrize(("given", "rows"), [
    pytest.param(zone(-60, (10, 5, 0, 3), (3, 5, 0, 2)), [
        ("2024-03-31-01:59:59.999", "2024-03-31-00:59:59.999", STANDARD, "2024-03-31-03:59:59.999", DAYLIGHT),
        ("2024-03-31-02:00:00.000", "2024-03-31-00:00:00.000", DAYLIGHT, "2024-03-31-04:00:00.000", DAYLIGHT),
        ("2024-03-31-00:59:59.999", "2024-03-30-23:59:59.999", STANDARD, "2024-03-31-01:59:59.999", STANDARD),
        ("2024-10-27-02:59:59.999", "2024-10-27-00:59:59.999", DAYLIGHT, "2024-10-27-03:59:59.999", STANDARD),
        ("2024-10-27-03:00:00.000", "2024-10-27-02:00:00.000", STANDARD, "2024-10-27-04:00:00.000", STANDARD),
        ("2024-10-27-00:59:59.999", "2024-10-26-22:59:59.999", DAYLIGHT, "2024-10-27-02:59:59.999", DAYLIGHT),
        ("2024-10-27-01:00:00.000", "2024-10-26-23:00:00.000", DAYLIGHT, "2024-10-27-02:00:00.000", STANDARD),
        ("2024-12-31-23:30:00.000", "2024-12-31-22:30:00.000", STANDARD, "2025-01-01-00:30:00.000", STANDARD),
        ("2024-12-31-22:30:00.000", "2024-12-31-21:30:00.000", STANDARD, "2024-12-31-23:30:00.000", STANDARD),
    ], id="the last Sunday"),
    pytest.param(zone(300, (11, 1, 0, 2), (3, 2, 0, 2)), [
        ("2024-03-10-01:59:59.999", "2024-03-10-06:59:59.999", STANDARD, "2024-03-09-20:59:59.999", STANDARD),
        ("2024-03-10-02:00:00.000", "2024-03-10-06:00:00.000", DAYLIGHT, "2024-03-09-21:00:00.000", STANDARD),
        ("2024-03-10-06:59:59.999", "2024-03-10-10:59:59.999", DAYLIGHT, "2024-03-10-01:59:59.999", STANDARD),
        ("2024-03-10-07:00:00.000", "2024-03-10-11:00:00.000", DAYLIGHT, "2024-03-10-03:00:00.000", DAYLIGHT),
        ("2024-11-03-05:59:59.999", "2024-11-03-10:59:59.999", STANDARD, "2024-11-03-01:59:59.999", DAYLIGHT),
        ("2024-11-03-06:00:00.000", "2024-11-03-11:00:00.000", STANDARD, "2024-11-03-01:00:00.000", STANDARD),
        ("2024-11-03-01:59:59.999", "2024-11-03-05:59:59.999", DAYLIGHT, "2024-11-02-21:59:59.999", DAYLIGHT),
        ("2024-11-03-02:00:00.000", "2024-11-03-07:00:00.000", STANDARD, "2024-11-02-22:00:00.000", DAYLIGHT),
    ], id="the first and the second"),
    pytest.param(zone(-600, (4, 1, 0, 3), (10, 1, 0, 2)), [
        ("2024-04-07-02:59:59.999", "2024-04-06-15:59:59.999", DAYLIGHT, "2024-04-07-12:59:59.999", STANDARD),
        ("2024-04-07-03:00:00.000", "2024-04-06-17:00:00.000", STANDARD, "2024-04-07-13:00:00.000", STANDARD),
        ("2024-10-06-01:59:59.999", "2024-10-05-15:59:59.999", STANDARD, "2024-10-06-12:59:59.999", DAYLIGHT),
        ("2024-10-06-02:00:00.000", "2024-10-05-15:00:00.000", DAYLIGHT, "2024-10-06-13:00:00.000", DAYLIGHT),
    ], id="summer at the turn of the year"),
    pytest.param(zone(-720, (1, 3, 0, 3), (11, 2, 0, 2)), [
        ("2020-01-19-02:59:59.999", "2020-01-18-13:59:59.999", DAYLIGHT, "2020-01-19-14:59:59.999", STANDARD),
        ("2020-01-19-03:00:00.000", "2020-01-18-15:00:00.000", STANDARD, "2020-01-19-15:00:00.000", STANDARD),
        ("2020-01-18-13:59:59.999", "2020-01-18-00:59:59.999", DAYLIGHT, "2020-01-19-02:59:59.999", DAYLIGHT),
        ("2020-01-18-14:00:00.000", "2020-01-18-01:00:00.000", DAYLIGHT, "2020-01-19-02:00:00.000", STANDARD),
        ("2020-11-08-01:59:59.999", "2020-11-07-13:59:59.999", STANDARD, "2020-11-08-14:59:59.999", DAYLIGHT),
        ("2020-11-08-02:00:00.000", "2020-11-07-13:00:00.000", DAYLIGHT, "2020-11-08-15:00:00.000", DAYLIGHT),
    ], id="standard time from January on"),
    pytest.param(zone(-60, (10, 20, 0, 3, 2024), (4, 10, 0, 2, 2024), moved=-120, kept=-30), [
        ("2024-04-10-01:59:59.999", "2024-04-10-00:29:59.999", STANDARD, "2024-04-10-04:59:59.999", DAYLIGHT),
        ("2024-04-10-02:00:00.000", "2024-04-09-23:00:00.000", DAYLIGHT, "2024-04-10-05:00:00.000", DAYLIGHT),
        ("2024-10-20-03:00:00.000", "2024-10-20-01:30:00.000", STANDARD, "2024-10-20-04:30:00.000", STANDARD),
    ], id="at dates of a year"),
    pytest.param(zone(-330), [
        ("2024-07-01-00:00:00.000", "2024-06-30-18:30:00.000", UNKNOWN, "2024-07-01-05:30:00.000", UNKNOWN)], id="no summer"),
])  # fmt: skip
def test_local_times_of_a_zone_and_utc(given: dict[str, int], rows: list[tuple[Any, ...]]) -> None:
    plc = Plc(image_of(ZONES))
    for text, *wanted in rows:
        assert after(plc, "there first back second", text=text, **given) == tuple(wanted), text


CLOCKS = """VAR
    go : BOOL; nt : NT_GetTime; zone : FB_GetTimeZoneInformation; now : FB_LocalSystemTime; sys : GETSYSTEMTIME;
    cpu, more : GETCPUCOUNTER;
    a, b, c : T_DCTIME64; f : ULINT; told, local : STRING(23);
END_VAR
nt(START := go); zone(bExecute := go); now(bEnable := go); sys(); cpu(); more();
a := F_GetActualDcTime64(); b := F_GetCurDcTaskTime64(); c := F_GetCurDcTickTime64(); f := F_GetSystemTime();
told := SYSTEMTIME_TO_STRING(nt.TIMESTR); local := SYSTEMTIME_TO_STRING(now.systemTime);"""


@pytest.mark.slow
def test_clocks_tell_the_virtual_time() -> None:
    plc = Plc(image_of(CLOCKS))

    def at(ms: int, names: str, **inputs: Any) -> tuple[Any, ...]:
        for name, value in inputs.items():
            plc.write(f"Main.{name}", value)
        assert plc.scan(ms * MS) is None
        return tuple(plc.read(f"Main.{name}") for name in names.split())

    begin, never = 116444736000000000, "0000-00-00-00:00:00.000"
    names = "nt.BUSY told zone.bBusy zone.tzInfo.standardName now.bValid local"
    assert at(0, names) == (False, never, False, "", False, never)
    assert at(10, names, go=True) == (True, never, True, "", True, "1970-01-01-00:00:00.010")
    assert at(25, names) == (False, "1970-01-01-00:00:00.025", False, "UTC", True, "1970-01-01-00:00:00.025")
    assert at(30, names) == (False, "1970-01-01-00:00:00.025", False, "UTC", True, "1970-01-01-00:00:00.030")
    assert at(40, names, go=False) == (False, "1970-01-01-00:00:00.025", False, "UTC", False, "1970-01-01-00:00:00.030")
    assert at(50, "nt.BUSY zone.tzInfo.daylightName now.tzID zone.tzID", go=True) == (True, "UTC", UNKNOWN, UNKNOWN)
    assert at(60, "told a b c f") == ("1970-01-01-00:00:00.060", 60 * MS, 60 * MS, 60 * MS, begin + 600_000)
    counters = "sys.timeLoDw sys.timeHiDW cpu.cpuCntLoDW cpu.cpuCntHiDW more.cpuCntLoDW"
    assert at(70, counters) == ((begin + 700_000) % 2**32, (begin + 700_000) // 2**32, 700_001, 0, 700_002)
    assert at(70, counters)[2:] == (700_003, 0, 700_004)
    later = 500_000_000_000
    assert at(later, counters)[2:] == ((later * 10_000 + 1) % 2**32, later * 10_000 // 2**32, (later * 10_000 + 2) % 2**32)


@pytest.mark.slow
def test_clocks_go_on_from_what_the_rise_of_en_has_set() -> None:
    plc = Plc(image_of("""VAR en : BOOL; given : DT; text, fine : STRING(23); ms, us : DWORD; a : RTC; b : RTC_EX;
    c : RTC_EX2; END_VAR
a(EN := en, PDT := given); b(EN := en, PDT := given, PMSEK := ms); c(EN := en, PDT := STRING_TO_SYSTEMTIME(text), PMICRO := us);
fine := SYSTEMTIME_TO_STRING(c.CDT);"""))
    names, second = "a.Q a.CDT b.Q b.CDT b.CMSEK c.Q fine c.CMICRO", 1_000_000_000
    given = {"given": 86_400 * second, "text": "2000-01-01-00:00:00.990", "ms": 990, "us": 700}
    assert after(plc, names, **given) == (False, 0, False, 0, 0, False, "0000-00-00-00:00:00.000", 0)
    set_to = after(plc, names, en=True)
    day = set_to[1]
    assert set_to == (True, day, True, day, 990, True, "2000-01-01-00:00:00.990", 700)
    after(plc, names, given=0, text="2001-01-01-00:00:00.000", ms=0, us=0)
    later = after(plc, names)
    assert (later[1], later[3], later[4], later[6], later[7]) == (day, day + second, 10, "2000-01-01-00:00:01.010", 700)
    for _ in range(97):
        later = after(plc, names)
    assert (later[1], later[3], later[4], later[6], later[7]) == (day, day + second, 980, "2000-01-01-00:00:01.980", 700)
    assert after(plc, names)[1:5] == (day + second, True, day + second, 990)
    assert after(plc, names)[1:5] == (day + second, True, day + 2 * second, 0)


@pytest.mark.slow
def test_random_numbers_follow_from_the_first_seed() -> None:
    plc = Plc(image_of("VAR a, b : DRAND; seed : INT; END_VAR\na(Seed := seed); b(Seed := -seed);"))
    state = 5
    for seed in (4, 4, 9):
        state = state * 48271 % 2147483647
        assert after(plc, "a.Num b.Num", seed=seed) == (state / 2147483647,) * 2


@pytest.mark.slow
def test_the_log_keeps_the_last_256_messages() -> None:
    plc = Plc(image_of("""VAR n, r, q : DINT; text, other, given : T_MaxString; END_VAR
n := n + 1; r := ADSLOGDINT(DINT_TO_DWORD(n), text, n); q := ADSLOGSTR(7, other, given);"""))
    count = "r q"
    assert after(plc, count, text="%d of %d", other="%d: %s, %s", given="x") == (0, 0)
    assert [plc.read(f"TwinCAT_Log[{at}].Text") for at in (0, 1)] == ["1 of %d", "%d: x, %s"]
    assert [plc.read(f"TwinCAT_Log[{at}].Mask") for at in (0, 1)] == [1, 7]
    after(plc, count, text="%", other="%", given="x")
    after(plc, count, text="a" * 255, other="a" * 255)
    assert [plc.read(f"TwinCAT_Log[{at}].Text") for at in (2, 3, 4, 5)] == ["%", "%", "a" * 253, "a" * 253]
    assert [plc.read(f"TwinCAT_Log[{at}].Since") for at in (0, 2, 4)] == [0, 10 * MS, 20 * MS]
    for _ in range(125):
        after(plc, count, text="%d;", other="%s", given="y")
    assert plc.read("TwinCAT_LogCount") == 256
    assert [plc.read(f"TwinCAT_Log[{at}].Text") for at in (0, 254, 255)] == ["1 of %d", "128;", "y"]
    after(plc, count)
    assert [plc.read(f"TwinCAT_Log[{at}].Text") for at in (0, 1, 2, 255)] == ["129;", "y", "%", "y"]


@pytest.mark.slow
def test_persistent_data_are_written_for_one_call() -> None:
    plc = Plc(image_of("VAR go : BOOL; a : WritePersistentData; b : FB_WritePersistentData; END_VAR\n"
                       "a(START := go); b(START := go);"))  # fmt: skip
    found = [after(plc, "a.BUSY b.BUSY a.ERR b.ERR", go=go) for go in (False, True, True, False, True)]
    assert found == [(busy, busy, False, False) for busy in (False, True, False, False, True)]


TASKS = """PROGRAM Main
VAR n : DINT; index : GETCURTASKINDEX; number : DINT; info, other : PlcTaskSystemInfo; app : PlcAppSystemInfo; first : BOOL;
END_VAR
n := n + 1; index(); number := GETCURTASKINDEXEX(); info := TwinCAT_SystemInfoVarList._TaskInfo[number];
first := first OR info.FirstCycle;
app := TwinCAT_SystemInfoVarList._AppInfo; other := TwinCAT_SystemInfoVarList._TaskInfo[3 - number];
END_PROGRAM
CONFIGURATION Line
RESOURCE PLC ON fbvm
    TASK Fast(INTERVAL := T#10ms, PRIORITY := 3); TASK Slow(INTERVAL := T#30ms, PRIORITY := 7);
    PROGRAM A WITH Fast : Main; PROGRAM B WITH Slow : Main;
END_RESOURCE
END_CONFIGURATION"""


@pytest.mark.slow
def test_there_is_no_task_in_front_of_the_first_cycle_and_from_32_on_tasks_share_a_number() -> None:
    made = compile_text("""FUNCTION_BLOCK FB_Early
VAR cycles : UDINT := 7; index : DINT := 7; END_VAR
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; END_VAR
index := GETCURTASKINDEXEX(); cycles := TwinCAT_SystemInfoVarList._TaskInfo[index].CycleCount;
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main VAR early : FB_Early; index : DINT; END_VAR index := GETCURTASKINDEXEX(); END_PROGRAM
CONFIGURATION Line RESOURCE PLC ON fbvm
""" + "".join(f"TASK T{at}(INTERVAL := T#10ms, PRIORITY := {at}); PROGRAM P{at} WITH T{at} : Main;\n" for at in range(1, 35))
        + "END_RESOURCE END_CONFIGURATION", dialect="twincat")  # fmt: skip
    assert made.image is not None, [message.render() for message in made.diagnostics]
    plc = Plc(made.image)
    assert plc.scan() is None
    assert [plc.read(f"P{at}.index") for at in range(1, 35)] == [*range(1, 33), 32, 32]
    assert (plc.read("P1.early.index"), plc.read("P1.early.cycles")) == (0, 0)
    assert plc.read("TwinCAT_SystemInfoVarList._AppInfo.TaskCnt") == 34


@pytest.mark.slow
def test_a_program_knows_its_task_and_its_project() -> None:
    made = compile_text(TASKS, dialect="twincat")
    assert made.image is not None, [message.render() for message in made.diagnostics]
    plc = Plc(made.image)
    names = "CycleTime Priority CycleCount FirstCycle TaskName"

    def told(program: str, part: str) -> tuple[Any, ...]:
        return tuple(plc.read(f"{program}.{part}.{name}") for name in names.split())

    assert plc.scan(0) is None
    assert told("A", "info") == (100_000, 3, 1, True, "Fast")
    assert told("B", "info") == (300_000, 7, 1, True, "Slow")
    for at in range(1, 7):
        assert plc.scan(at * 10 * MS) is None
    assert told("A", "info") == (100_000, 3, 7, False, "Fast")
    assert told("B", "info") == (300_000, 7, 3, False, "Slow")
    assert told("B", "other") == (100_000, 3, 7, False, "Fast")
    assert [plc.read(f"{name}.{what}") for name in "AB" for what in ("index.index", "number")] == [1, 1, 2, 2]
    assert [plc.read(f"A.app.{name}") for name in ("TaskCnt", "AppName", "ProjectName")] == [2, "Line", "Line"]
