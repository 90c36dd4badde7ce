"""Functions of TwinCAT's Tc2_Utilities, Tc2_System and Tc2_Math at their limits: texts, numbers, addresses, dates."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from test_twincat_blocks import MS, after, image_of

from fbvm.machine.plc import Plc


def values(rows: list[tuple[str, Any]], type: str, declared: str = "") -> list[Any]:
    """What the expressions of rows are, in one program."""
    names = ", ".join(f"v{at}" for at in range(len(rows)))
    lines = "\n".join(f"v{at} := {row[0]};" for at, row in enumerate(rows))
    found = after(Plc(image_of(f"VAR {names} : {type}; {declared} END_VAR\n{lines}")), names.replace(",", ""))
    return [(row[0], value) for row, value in zip(rows, found, strict=True)]


DIGITS = [
    ("BYTE_TO_DECSTR(255, 0)", "255"), ("BYTE_TO_DECSTR(7, 3)", "007"), ("BYTE_TO_DECSTR(0, 0)", ""),
    ("BYTE_TO_DECSTR(0, 1)", "0"),
    ("WORD_TO_DECSTR(16#FFFF, 4)", "65535"), ("DWORD_TO_DECSTR(16#FFFFFFFF, 11)", "04294967295"),
    ("LWORD_TO_DECSTR(16#FFFFFFFFFFFFFFFF, -1)", "18446744073709551615"), ("LWORD_TO_DECSTR(1, 255)", f"{1:0255}"),
    ("LWORD_TO_DECSTR(1, 300)", f"{1:0255}"), ("BYTE_TO_BINSTR(16#A5, 0)", "10100101"),
    ("WORD_TO_BINSTR(16#8000, 0)", f"{1:<016}"),
    ("DWORD_TO_BINSTR(16#80000000, 33)", f"0{1:<032}"), ("LWORD_TO_BINSTR(16#8000000000000001, 0)", f"1{1:063}"),
    ("LWORD_TO_BINSTR(0, 0)", ""), ("LWORD_TO_BINSTR(0, 300)", "0" * 255), ("BYTE_TO_OCTSTR(16#FF, 4)", "0377"),
    ("WORD_TO_OCTSTR(16#FFFF, 0)", "177777"), ("DWORD_TO_OCTSTR(16#FFFFFFFF, 0)", "37777777777"),
    ("LWORD_TO_OCTSTR(16#FFFFFFFFFFFFFFFF, 0)", "1777777777777777777777"), ("LWORD_TO_OCTSTR(0, 0)", ""),
    ("LWORD_TO_OCTSTR(0, 300)", "0" * 255), ("DINT_TO_DECSTR(0, 0)", ""), ("DINT_TO_DECSTR(0, 1)", "0"),
    ("DINT_TO_DECSTR(-1, 0)", "-1"), ("DINT_TO_DECSTR(-2147483648, 11)", "-02147483648"),
    ("DINT_TO_DECSTR(2147483647, 0)", "2147483647"),
    ("PVOID_TO_HEXSTR(NULL, 3, TRUE)", "000"), ("PVOID_TO_HEXSTR(NULL, 0, TRUE)", ""),
    *((f"{kind}_TO_HEXSTR(16#{'F0' * size}, 0, {low})", ("f0" if low == "TRUE" else "F0") * size)
      for kind, size in (("BYTE", 1), ("WORD", 2), ("DWORD", 4), ("LWORD", 8)) for low in ("TRUE", "FALSE")),
    *((f"{kind}_TO_HEXSTR(0, {count}, FALSE)", "0" * min(count, 255)) for kind in ("BYTE", "WORD", "DWORD", "LWORD")
      for count in (0, 1, 255, 300)),
    *((f"{kind}_TO_HEXSTR(16#{digit}, 1, {low})", digit.lower() if low == "TRUE" else digit)
      for kind in ("BYTE", "WORD", "DWORD", "LWORD") for digit in "19AF" for low in ("TRUE", "FALSE")),
    ("LREAL_TO_FMTSTR(0.5, 0, TRUE)", "1"), ("LREAL_TO_FMTSTR(0.4375, 0, TRUE)", "0"), ("LREAL_TO_FMTSTR(0.75, 0, FALSE)", "0"),
    ("LREAL_TO_FMTSTR(0.75, 0, TRUE)", "1"), ("LREAL_TO_FMTSTR(1.25, 1, TRUE)", "1.3"),
    ("LREAL_TO_FMTSTR(1.25, 1, FALSE)", "1.2"),
    ("LREAL_TO_FMTSTR(-1.25, 1, TRUE)", "-1.3"), ("LREAL_TO_FMTSTR(0.0, 2, TRUE)", "0.00"),
    ("LREAL_TO_FMTSTR(12.0, -1, FALSE)", "12"),
    ("LREAL_TO_FMTSTR(1.5, 18, FALSE)", "1.5" + "0" * 17), ("LREAL_TO_FMTSTR(1.5, 19, FALSE)", "1.5" + "0" * 17),
    ("LREAL_TO_FMTSTR(1.75E19, 0, FALSE)", "17500000000000000000"), ("LREAL_TO_FMTSTR(1.03125, 5, FALSE)", "1.03125"),
    ("F_ToCHR(0)", ""), ("F_ToCHR(16#41)", "A"), ("F_ToLCase('@AZ[`az{')", "@az[`az{"), ("F_ToUCase('@AZ[`az{')", "@AZ[`AZ{"),
    ("F_LTrim('   ')", ""), ("F_RTrim('')", ""), ("F_LTrim('$Ta ')", "\ta "),
]  # fmt: skip


@pytest.mark.slow
def test_numbers_as_texts() -> None:
    assert values(DIGITS, "T_MaxString") == DIGITS
    [(_, large), (_, same)] = values([("LREAL_TO_FMTSTR(1.8E19, 0, FALSE)", 0), ("LREAL_TO_STRING(1.8E19)", 0)], "T_MaxString")
    assert large == same


NUMBERS = [
    ("F_ToASC('B')", 66), ("F_ToASC('')", 0), ("F_GetDOYOfYearMonthDay(2023, 1, 1)", 1),
    ("F_GetDOYOfYearMonthDay(2023, 2, 1)", 32),
    ("F_GetDOYOfYearMonthDay(2023, 3, 1)", 60), ("F_GetDOYOfYearMonthDay(2024, 3, 1)", 61),
    ("F_GetDOYOfYearMonthDay(2023, 12, 31)", 365),
    *((f"F_GetMaxMonthDays(2023, {month})", days)
    for month, days in enumerate((0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31, 0))),
    *((f"F_GetMaxMonthDays({year}, 2)", days) for year, days in ((1900, 28), (2000, 29), (2004, 29), (2100, 28), (2400, 29))),
    ("F_CheckSum16(ADR(d), 9, 0)", 0x1DD), ("F_CheckSum16(ADR(d), 1, 16#FFFF)", 0x30),
    ("F_CheckSum16(ADR(d), 0, 16#FFFF)", 0xFFFF),
    ("F_CheckSum16(ADR(d), 1, 16#FFCE)", 0xFFFF), ("F_CheckSum16(ADR(d), 1, 16#FFCF)", 0),
    ("F_CheckSum16(ADR(d), 2, 16#FFCF)", 0x32),
    ("F_DATA_TO_CRC16_CCITT(ADR(d), 9, 16#FFFF)", 0x29B1), ("F_DATA_TO_CRC16_CCITT(ADR(d), 9, 0)", 0x31C3),
    ("F_DATA_TO_CRC16_CCITT(ADR(d), 0, 16#1234)", 0x1234), ("F_BYTE_TO_CRC16_CCITT(16#31, 0)", 0x2672),
    ("F_BYTE_TO_CRC16_CCITT(1, 0)", 0x1021), ("F_BYTE_TO_CRC16_CCITT(0, 16#100)", 0x1021), ("F_BYTE_TO_CRC16_CCITT(0, 1)", 0x100),
    ("HOST_TO_BE16(16#1234)", 0x3412), ("BE16_TO_HOST(16#1234)", 0x3412), ("HOST_TO_BE32(16#12345678)", 0x78563412),
    ("BE32_TO_HOST(16#12345678)", 0x78563412), ("HOST_TO_BE64(16#123456789ABCDEF0)", 0xF0DEBC9A78563412),
    ("BE64_TO_HOST(16#123456789ABCDEF0)", 0xF0DEBC9A78563412), ("SETBIT32(0, 0)", 1), ("SETBIT32(0, 31)", 1 << 31),
    ("SETBIT32(0, 32)", 0), ("SETBIT32(0, -1)", 0), ("CLEARBIT32(16#FFFFFFFF, 0)", 0xFFFFFFFE),
    ("CLEARBIT32(16#FFFFFFFF, 31)", 0x7FFFFFFF), ("CLEARBIT32(16#FFFFFFFF, 32)", 0xFFFFFFFF), ("CLEARBIT32(1, -1)", 1),
    ("CSETBIT32(16#F0, 4, FALSE)", 0xE0), ("CSETBIT32(16#F0, 0, TRUE)", 0xF1),
    ("FILETIME64_TO_DCTIME64(125911584000000000)", 0), ("FILETIME64_TO_DCTIME64(125911583999999999)", 0),
    ("FILETIME64_TO_DCTIME64(125911584000000001)", 100), ("DCTIME64_TO_FILETIME64(199)", 125911584000000001),
    ("DCTIME64_TO_FILETIME64(200)", 125911584000000002), ("DT_TO_FILETIME64(DT#1970-01-01-00:00:00)", 116444736000000000),
    ("DT_TO_FILETIME64(DT#2024-02-29-23:59:58)", 133537247980000000),
    ("DT_TO_FILETIME(DT#2024-02-29-23:59:58).dwLowDateTime", 133537247980000000 % 2**32),
    ("DT_TO_FILETIME(DT#2024-02-29-23:59:58).dwHighDateTime", 133537247980000000 // 2**32),
    *((f"LEN(DATA_TO_HEXSTR(ADR(l), {count}, TRUE))", 2 * count if count < 128 else 0) for count in (0, 1, 126, 127, 128)),
    ("HEXSTR_TO_DATA('0aFf', ADR(o), 2)", 2), ("HEXSTR_TO_DATA('0aFf', ADR(o), 1)", 0), ("HEXSTR_TO_DATA('0aF', ADR(o), 2)", 0),
    ("HEXSTR_TO_DATA('0aFg', ADR(o), 2)", 0), ("HEXSTR_TO_DATA('/0', ADR(o), 2)", 0), ("HEXSTR_TO_DATA('', ADR(o), 2)", 0),
    ("HEXSTR_TO_DATA('9F10', ADR(o), 3)", 2), ("o[0]", 0x9F), ("o[1]", 0x10), ("o[2]", 0x55),
]  # fmt: skip


@pytest.mark.slow
def test_texts_bits_and_dates_as_numbers() -> None:
    given = [(f"TO_ULINT({expression})", number) for expression, number in NUMBERS]
    declared = ("d : ARRAY[0..8] OF BYTE := [16#31, 16#32, 16#33, 16#34, 16#35, 16#36, 16#37, 16#38, 16#39]; "
                "l : ARRAY[0..127] OF BYTE; o : ARRAY[0..2] OF BYTE := [3(16#55)];")  # fmt: skip
    assert values(given, "ULINT", declared) == given


@pytest.mark.slow
def test_bits_of_numbers_leap_years_results_and_areas_of_memory() -> None:
    rows = [
        ("GETBIT32(1, 0)", True), ("GETBIT32(16#80000000, 31)", True), ("GETBIT32(16#FFFFFFFF, 32)", False),
        ("GETBIT32(16#FFFFFFFF, -1)", False), ("GETBIT32(16#FFFFFFFE, 0)", False), ("GETBIT32(16#7FFFFFFF, 31)", False),
        *((f"F_YearIsLeapYear({year})", year in (1600, 2000, 2024)) for year in (1600, 1900, 2000, 2023, 2024, 2025, 2100)),
        *((f"{name}({number})", (number >= 0) == (name == "SUCCEEDED")) for name in ("SUCCEEDED", "FAILED")
        for number in (-1, 0, 1)),
        ("LrealIsFinite(1.0)", True), ("LrealIsFinite(1.0E308 * ten)", False), ("LrealIsNaN(1.0E308 * ten)", False),
        ("LrealIsNaN(1.0)", False), ("F_CheckMemoryArea(ADR(ten), 1) = E_TcMemoryArea.Static", True),
        ("F_CheckMemoryArea(ADR(ten), 0) = E_TcMemoryArea.Unknown", True),
        ("F_CheckMemoryArea(0, 1) = E_TcMemoryArea.Unknown", True),
        *((f"{name}(1.0E308 * ten - 1.0E308 * ten)", name == "LrealIsNaN") for name in ("LrealIsNaN", "LrealIsFinite")),
    ]  # fmt: skip
    assert values(rows, "BOOL", "ten : LREAL := 10.0;") == rows


@pytest.mark.slow
def test_functions_of_tc2_math_at_whole_numbers_and_without_a_range() -> None:
    rows = [
        ("FLOOR(3.0)", 3.0), ("FLOOR(-3.0)", -3.0), ("FLOOR(-0.5)", -1.0), ("FLOOR(0.5)", 0.0), ("FRAC(3.0)", 0.0),
        ("FRAC(2.75)", 0.75),
        ("LTRUNC(4503599627370495.5)", 4503599627370495.0), ("LTRUNC(-4503599627370495.5)", -4503599627370495.0),
        ("LTRUNC(4503599627370497.0)", 4503599627370497.0), ("LTRUNC(0.75)", 0.0), ("LMOD(5.5, 2.5)", 0.5),
        ("LMOD(5.5, -2.5)", 0.5),
        ("LMOD(5.5, 0.0)", 0.0), ("LMOD(5.0, 2.5)", 0.0), ("MODABS(360.0, 360.0)", 0.0), ("MODABS(-360.0, 360.0)", 0.0),
        ("MODABS(359.5, 360.0)", 359.5), ("MODABS(5.0, 0.0)", 0.0), ("MODTURNS(359.5, 360.0)", 0.0),
        ("MODTURNS(720.0, 360.0)", 2.0),
        ("MODTURNS(-720.5, 360.0)", -3.0), ("MODTURNS(5.0, 0.0)", 0.0),
    ]  # fmt: skip
    assert values(rows, "LREAL") == rows


ADDRESSES = [
    *((f"F_CreateAmsNetId(F_ScanAmsNetIds('{text}'))", text if good else "0.0.0.0.0.0") for text, good in (
        ("255.0.10.99.100.1", True), ("1.2.3.4.5.255", True), ("256.0.10.99.100.1", False), ("1.2.3.4.5.256", False),
        ("1.2.3.4.5", False), ("1.2.3.4.5.6.7", False), ("1.2.3.4.5.", False), (".2.3.4.5.6", False), ("1..3.4.5.6", False),
        ("1.2.3.4.5./", False), ("1.2.3.4.5.:", False), ("a.2.3.4.5.6", False), ("1.2.3.4.5.6a", False), ("", False),
        ("9.8.7.6.0.0", True), ("0001.2.3.4.5.6", False))),
    ("F_CreateAmsNetId(F_ScanAmsNetIds('001.02.3.4.5.6'))", "1.2.3.4.5.6"),
    *((f"F_CreateIPv4Addr(F_ScanIPv4AddrIds('{text}'))", text if good else "0.0.0.0") for text, good in (
        ("255.0.10.99", True), ("192.168.100.255", True), ("256.0.10.99", False), ("1.2.3.256", False), ("1.2.3", False),
        ("1.2.3.4.5", False), ("1.2.3.", False), (".2.3.4", False), ("1..3.4", False), ("1.2.3./", False), ("1.2.3.:", False),
        ("a.2.3.4", False), ("1.2.3.4a", False), ("", False), ("9.8.0.0", True), ("0001.2.3.4", False))),
    ("F_CreateIPv4Addr(F_ScanIPv4AddrIds('001.02.3.4'))", "1.2.3.4"),
]  # fmt: skip


@pytest.mark.slow
def test_addresses_and_their_numbers() -> None:
    assert values(ADDRESSES, "STRING") == ADDRESSES


CLOCKS = [(count, f"{datetime(2000, 1, 1) + timedelta(seconds=count // 10**9):%Y-%m-%d-%H:%M:%S}.{count % 10**9:09}")
          for count in (0, 1, 999_999_999, 1_000_000_000, 86_399_123_456_789, 1_000_000_000_000_000_001, 2**64 - 1)]  # fmt: skip
CONNECTION = """h : T_HSOCKET := (handle := 16#A, localAddr := (nPort := 7, sAddr := '1.2.3.4'),
    remoteAddr := (nPort := 65535, sAddr := '100.100.100.100')); s : TIMESTRUCT := (wYear := 65535, wMonth := 10);
    d : ARRAY[0..3] OF BYTE := [16#A, 16#FF, 16#10, 16#22];"""


@pytest.mark.slow
def test_texts_of_connections_and_of_clocks() -> None:
    local, remote = " Local:1.2.3.4:7", " Remote:100.100.100.100:65535"
    rows = [
        *((f"HSOCKET_TO_STRINGEX(h, {here}, {there})", f"Handle:0xA{local * (here == 'TRUE')}{remote * (there == 'TRUE')}")
          for here in ("FALSE", "TRUE") for there in ("FALSE", "TRUE")),
        ("HSOCKET_TO_STRING(h)", f"Handle:0xA{local}{remote}"),
        ("HSOCKET_TO_STRING(TCPADS_NULL_HSOCKET)", "Handle:0x0 Local::0 Remote::0"),
        ("SOCKETADDR_TO_STRING(h.remoteAddr)", "100.100.100.100:65535"),
        ("SYSTEMTIME_TO_STRING(s)", "65535-10-00-00:00:00.00"), ("DATA_TO_HEXSTR(ADR(d), 3, FALSE)", "0AFF10"),
        ("DATA_TO_HEXSTR(ADR(d), 2, TRUE)", "0aff"),
        *((f"DCTIME64_TO_STRING({count})", text) for count, text in CLOCKS),
    ]  # fmt: skip
    assert values(rows, "T_MaxString", CONNECTION) == rows


# --- dates --------------------------------------------------------------------------------------------------------------

EPOCH = datetime(1601, 1, 1)
DATES = """VAR text : STRING(40); s, t : TIMESTRUCT; f : T_FILETIME64; h : T_FILETIME; back, other : STRING(23); d, e : DT;
END_VAR
s := STRING_TO_SYSTEMTIME(text); f := SYSTEMTIME_TO_FILETIME64(s); h := SYSTEMTIME_TO_FILETIME(s);
back := SYSTEMTIME_TO_STRING(FILETIME64_TO_SYSTEMTIME(f)); other := SYSTEMTIME_TO_STRING(FILETIME_TO_SYSTEMTIME(h));
d := FILETIME64_TO_DT(f); e := FILETIME_TO_DT(h); t := DT_TO_SYSTEMTIME(d);"""
FIELDS = "wYear wMonth wDayOfWeek wDay wHour wMinute wSecond wMilliseconds"


@pytest.mark.slow
def test_dates_are_those_of_the_calendar() -> None:
    plc = Plc(image_of(DATES))
    moments = [datetime(1601, 1, 1, 0, 0, 0, 1000), datetime(1604, 2, 29), datetime(1604, 12, 31, 23, 59, 59, 999000),
               datetime(1700, 3, 1), datetime(1969, 12, 31, 23, 59, 59, 999000), datetime(1970, 1, 1),
               datetime(1970, 1, 1, 0, 0, 1),
               datetime(1999, 12, 31, 23, 59, 59, 7000), datetime(2000, 2, 29, 12), datetime(2000, 12, 31), datetime(2001, 1, 1),
               datetime(2024, 2, 29, 23, 59, 58, 123000), datetime(2024, 3, 1), datetime(2105, 12, 31, 23, 59, 59),
               datetime(2106, 1, 1), datetime(2400, 12, 31), datetime(9999, 12, 31, 23, 59, 59, 999000)]  # fmt: skip
    for at in moments:
        text = f"{at:%Y-%m-%d-%H:%M:%S}.{at.microsecond // 1000:03}"
        whole = (at - EPOCH) // timedelta(microseconds=1) * 10
        found = after(plc, "f h.dwLowDateTime h.dwHighDateTime back other", text=text)
        assert found == (whole, whole % 2**32, whole // 2**32, text, text), text
        assert after(plc, " ".join(f"s.{name}" for name in FIELDS.split())) == (
            at.year, at.month, at.isoweekday() % 7, at.day, at.hour, at.minute, at.second,
            at.microsecond // 1000), text  # fmt: skip
        kept = at.replace(microsecond=0) if 1970 <= at.year < 2106 else datetime(1970, 1, 1)
        assert after(plc, " ".join(f"t.{name}" for name in FIELDS.split())) == (
            kept.year, kept.month, kept.isoweekday() % 7, kept.day, kept.hour, kept.minute, kept.second, 0), text  # fmt: skip
        assert plc.read("Main.d") == plc.read("Main.e")


@pytest.mark.slow
def test_texts_that_are_no_dates_are_zeros() -> None:
    plc, good = Plc(image_of(DATES)), "2024-02-29-23:59:58.007"
    names = " ".join(f"s.{name}" for name in FIELDS.split())
    wrong = [good[:-1], "", good.replace(":", "."), good.replace(".", ":")]
    wrong += [good[:at] + sign + good[at + 1 :] for at in range(23) for sign in ("/:" if good[at].isdigit() else "0 ")]
    for text in wrong:
        assert after(plc, names, text=text) == (0,) * 8, text
    assert after(plc, "s.wYear f", text=good) == after(plc, "s.wYear f", text=good + "1") == (2024, 133537247980070000)


@pytest.mark.slow
def test_a_part_of_a_date_beyond_its_limit_makes_it_invalid() -> None:
    plc = Plc(image_of("VAR s : TIMESTRUCT; f : T_FILETIME64; micro, nano : WORD; t : T_DCTIME64; d : DT; END_VAR\n"
                       "f := SYSTEMTIME_TO_FILETIME64(s); t := SYSTEMTIME_TO_DCTIME64(s, micro, nano);\n"
                       "d := SYSTEMTIME_TO_DT(s);"))  # fmt: skip
    good = {"wYear": 2024, "wMonth": 12, "wDay": 31, "wHour": 23, "wMinute": 59, "wSecond": 59, "wMilliseconds": 999}
    whole = (datetime(2024, 12, 31, 23, 59, 59, 999000) - EPOCH) // timedelta(microseconds=1) * 10
    clock = (whole - 125911584000000000) * 100

    def told(micro: int = 0, nano: int = 0, **parts: int) -> tuple[Any, ...]:
        return after(plc, "f t", micro=micro, nano=nano, **{f"s.{name}": value for name, value in {**good, **parts}.items()})

    assert told() == (whole, clock)
    assert plc.read("Main.d") == datetime(2024, 12, 31, 23, 59, 59, tzinfo=UTC).timestamp() * 10**9
    assert told(999, 998) == (whole, clock + 999998)
    assert told(0, 999) == (whole, clock + 999)
    assert told(1000, 0) == told(0, 1000) == (whole, 0)
    for name, value in (("wYear", 1600), ("wYear", 0), ("wMonth", 0), ("wMonth", 13), ("wDay", 0), ("wDay", 32), ("wHour", 24),
                        ("wMinute", 60), ("wSecond", 60), ("wMilliseconds", 1000)):  # fmt: skip
        assert told(**{name: value}) == told(5, 6, **{name: value}) == (0, 0), (name, value)
        assert plc.read("Main.d") == 0, (name, value)
    assert told(wYear=1601) != (0, 0)
    assert told(wDay=1, wHour=0, wMinute=0, wSecond=0, wMilliseconds=0)[0] == whole - 30 * 864000000000 - 863999990000


@pytest.mark.slow
def test_a_duration_and_its_parts() -> None:
    plc = Plc(image_of("VAR given, back : TIME; o : OTSTRUCT; END_VAR\n"
                       "o := TIME_TO_OTSTRUCT(given); back := OTSTRUCT_TO_TIME(o);"))
    names = "back o.wWeek o.wDay o.wHour o.wMinute o.wSecond o.wMilliseconds"
    for parts in ((0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 999), (0, 0, 0, 0, 59, 999), (0, 0, 0, 59, 59, 999),
    (0, 0, 23, 59, 59, 999),
                  (0, 6, 23, 59, 59, 999), (1, 0, 0, 0, 0, 0), (0, 1, 0, 0, 0, 0), (0, 0, 1, 0, 0, 0), (0, 0, 0, 1, 0, 0),
                  (0, 0, 0, 0, 1, 0), (3, 2, 4, 5, 6, 7)):  # fmt: skip
        weeks, days, hours, minutes, seconds, rest = parts
        given = ((((weeks * 7 + days) * 24 + hours) * 60 + minutes) * 60 + seconds) * 1000 + rest
        assert after(plc, names, given=given * MS) == (given * MS, *parts)


@pytest.mark.slow
def test_the_texts_of_durations_in_twincat() -> None:
    rows = [("LTIME#0ns", "LTIME#0ns"), ("LTIME#1ns", "LTIME#1ns"), ("LTIME#1d2h3m4s5ms6us7ns", "LTIME#1d2h3m4s5ms6us7ns"),
            ("LTIME#23h59m59s999ms999us999ns", "LTIME#23h59m59s999ms999us999ns"), ("LTIME#24h", "LTIME#1d"),
            ("LTIME#60m", "LTIME#1h"),
            ("LTIME#60s", "LTIME#1m"), ("LTIME#1000ms", "LTIME#1s"), ("LTIME#1000us", "LTIME#1ms"), ("LTIME#1000ns", "LTIME#1us"),
            ("LTIME#213503d", "LTIME#213503d")]  # fmt: skip
    given = [(f"LTIME_TO_STRING({text})", told) for text, told in rows]
    assert values(given, "STRING(80)") == given
