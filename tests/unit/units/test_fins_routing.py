"""Where frames go: which commands a unit refuses by their header, which it executes itself, and what is added to end codes."""

from __future__ import annotations

from collections import defaultdict
from types import SimpleNamespace

from rows import each_of

from fbvm.units.contract import FinsAccess
from fbvm.units.etn21.fins.routing import error_flags, execute, refusal, restarts
from fbvm.units.etn21.fins.state import FinsSettings, FinsState
from fbvm.wire.fins.frames import Address, Command, Header

UNIT = 0x12
"""The unit address of unit number 2."""


def command(code: int = 0x0801, parameters: bytes = b"", network: int = 0, node: int = 0, unit: int = 0) -> Command:
    return Command(Header(Address(network, node, unit), Address(0, 1)), code, parameters)


@each_of("to, own, size_bytes, end_code", [
    ({}, None, 2012, 0), ({}, None, 2013, 0x1001), ({"node": 255}, None, 1473, 0), ({"node": 255}, None, 1474, 0x1001),
    ({"node": 3}, None, 2012, 0), ({"node": 3}, None, 2013, 0x1001), ({"node": 4}, None, 12, 0x1005),
    ({"node": 254}, None, 12, 0x1005),
    ({"node": 4}, 4, 12, 0), ({"node": 3}, 4, 12, 0x1005), ({"node": 4}, 0, 12, 0), ({"node": 4}, 0, 2013, 0x1001),
    ({"network": 1}, None, 12, 0x0502), ({"network": 1, "node": 4, "unit": 1}, None, 2013, 0x0502),
    ({"node": 4, "unit": 1}, None, 2013, 0x1005), ({"unit": 1}, None, 2013, 0x0202), ({"unit": UNIT}, None, 12, 0),
    ({"unit": UNIT - 1}, None, 12, 0x0202), ({"unit": UNIT + 1}, None, 12, 0x0202), ({"unit": 0xFE}, None, 12, 0),
    ({"unit": 0xFF}, None, 12, 0x0202),
])  # fmt: skip
def test_a_command_is_refused_by_its_header_and_its_length(to: dict[str, int], own: int | None, size_bytes: int,
                                                           end_code: int) -> None:
    """Of what is wrong, the network counts first, then the node, the unit, the length; node 0 is every node of the settings."""
    settings = FinsSettings("192.168.250.3", unit_number=2, node=own)
    assert refusal(settings, command(**to), size_bytes) == end_code


@each_of("code, parameters, access, answer", [
    (0x0801, b"", FinsAccess(), (0x1002, b"")), (0x0801, b"x", FinsAccess(), (0, b"x")),
    (0x0801, bytes(1998), FinsAccess(), (0, bytes(1998))), (0x0801, bytes(1999), FinsAccess(), (0x1001, b"")),
    (0x0403, b"", FinsAccess(), (0, b"")), (0x0403, b"", FinsAccess(may_control=False), (0x2102, b"")),
    (0x0403, b"", FinsAccess(may_write=False), (0, b"")),
    (0x0802, b"", FinsAccess(), (0x0402, b"")), (0x0803, b"", FinsAccess(), (0x0402, b"")),
    (0x0804, b"", FinsAccess(), (0x0401, b"")),
    (0x2701, b"", FinsAccess(), (0x0402, b"")), (0x2700, b"", FinsAccess(), (0x0401, b"")),
    (0x2764, b"", FinsAccess(), (0x0402, b"")),
    (0x2766, b"", FinsAccess(), (0x0401, b"")), (0x0101, b"", FinsAccess(), (0x0401, b"")), (0x2103, b"", FinsAccess(), (0, b"")),
])  # fmt: skip
def test_what_the_unit_answers_itself(code: int, parameters: bytes, access: FinsAccess, answer: tuple[int, bytes]) -> None:
    asked: list[tuple[int, FinsAccess]] = []
    cpu = SimpleNamespace(execute=lambda command, access: (asked.append((command.code, access)), (7, b"cpu"))[1])
    settings = FinsSettings("192.168.250.3", access=access)
    assert execute(settings, FinsState(), 0, command(code, parameters, unit=0x10), cpu) == answer  # type: ignore[arg-type]
    assert asked == []
    assert execute(settings, FinsState(), 0, command(code, parameters), cpu) == (7, b"cpu")  # type: ignore[arg-type]
    assert asked == [(code, access)]


@each_of("words, flags", [({}, 0), ({401: 1}, 0x80), ({402: 0x8000}, 0x40), ({401: 2, 402: 1}, 0xC0), ({400: 1, 403: 1}, 0)])
def test_errors_of_the_plc_are_flags_of_an_end_code(words: dict[int, int], flags: int) -> None:
    held = defaultdict[int, int](int, words)
    assert error_flags(SimpleNamespace(memory=SimpleNamespace(words={"A": held}.__getitem__))) == flags  # type: ignore[arg-type]


@each_of("code, unit, end_code, wanted", [
    (0x0403, 0x10, 0, True), (0x0403, 0xFE, 0, True), (0x0403, 0, 0, False), (0x0403, 0x10, 0x2102, False),
    (0x0402, 0x10, 0, False)])
def test_a_reset_that_the_unit_has_executed_restarts_it(code: int, unit: int, end_code: int, wanted: bool) -> None:
    assert restarts(command(code, unit=unit), end_code) is wanted
