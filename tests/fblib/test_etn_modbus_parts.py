"""Functions of the library alone: the words that a request writes for the unit, by hand from W421 6-7-4 and 6-7-5."""

from __future__ import annotations

from functools import cache

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

REQUEST = """PROGRAM Main
VAR socket, switch, count, first, timeout : UINT; END_VAR
    ETN_Modbus_Request(Socket := socket, Switch := switch, Count := count, First := first, Timeout := timeout);
END_PROGRAM"""
CLOSE, SEND, RECEIVE, OPEN = 5, 3, 4, 2


@cache
def plc() -> Plc:
    image = compile_text(REQUEST).image
    assert image is not None
    return Plc(image)


@pytest.mark.slow
@each_of(("socket", "switch", "before", "after"), [
    (1, SEND, [0x0000, 0, 0, 0], [0x0008, 0, 0, 0]), (1, SEND, [0xFFFF, 1, 2, 3], [0xFF08, 1, 2, 3]),
    (2, OPEN, [0xFFFF, 1, 2, 3], [0x04FF, 1, 2, 3]), (2, RECEIVE, [0x0812, 0, 0, 0], [0x1012, 0, 0, 0]),
    (3, RECEIVE, [1, 0xABCD, 2, 3], [1, 0xAB10, 2, 3]), (8, SEND, [1, 2, 3, 0xABCD], [1, 2, 3, 0x08CD]),
    (1, CLOSE, [0x0018, 0, 0, 0], [0x0038, 0, 0, 0]), (2, CLOSE, [0x1834, 5, 6, 7], [0x3834, 5, 6, 7]),
    (7, CLOSE, [1, 2, 3, 0x0108], [1, 2, 3, 0x0128]),
])  # fmt: skip
def test_a_request_puts_the_other_switches_of_its_area_out_and_a_close_leaves_them(
    socket: int, switch: int, before: list[int], after: list[int]
) -> None:
    made = plc()
    for number, word in enumerate(before, 1519):
        made.memory.words("CIO")[number] = word
    area = 30018 + 10 * (socket - 1)
    for number in range(30008, 30108):
        made.write(f"D{number}", number % 7 + 1)
    for name, value in {"socket": socket, "switch": switch, "count": 77, "first": 6001, "timeout": 35}.items():
        made.write(f"Main.{name}", value)
    assert made.scan() is None
    assert list(made.memory.words("CIO")[1519:1523]) == after
    # keep-alive and linger, the socket; local port, address and port of the other end stay; count, CIO 6001, time, 0081
    stay = [number % 7 + 1 for number in range(area + 1, area + 5)]
    assert list(made.memory.words("D")[area : area + 10]) == [0x0300 | socket, *stay, 77, 0xB017, 0x7100, 35, 0x81]
    others = [number for number in range(30008, 30108) if number not in range(area, area + 10)]
    assert [made.memory.words("D")[number] for number in others] == [number % 7 + 1 for number in others]
