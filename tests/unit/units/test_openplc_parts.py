"""Parts of OpenPLC's server alone: its tables number by number, the numbers of addresses, its front, what it cannot be."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.units.front import Front, Lamp, Socket
from fbvm.units.openplc import tables
from fbvm.units.openplc.tables import Bits, Registers, numbers_of, plain
from fbvm.units.openplc.unit import OpenPlc
from fbvm.wire.link import Close, Closed, Failed, Grant, Listen, Opened, Peer, Received


class Areas:
    """A memory with some areas of four words each."""

    def __init__(self, *names: str) -> None:
        self.held = {name: memoryview(bytearray(8)).cast("H") for name in names}

    def words(self, area: str) -> memoryview:
        return self.held[area]


@pytest.mark.parametrize("names", [("%QX",), ()])
def test_bits_one_by_one_and_in_rows(names: tuple[str, ...]) -> None:
    memory, kept = Areas(*names), dict[str, dict[int, int]]()
    bits = Bits(memory, tables.COILS, kept)  # type: ignore[arg-type]
    bits[17], bits[3:6] = 1, [True, False, 5]
    assert (len(bits), bits[17], bits[16], bits[2:7]) == (8192, 1, 0, [0, 1, 0, 1, 0])
    bits[17] = 0
    held = list(memory.held["%QX"]) if names else kept["%QX"]
    assert bits[17] == 0 and held == ([0x28, 0, 0, 0] if names else {17: 0, 3: 1, 4: 0, 5: 1})
    with pytest.raises(ValueError, match="argument 2 is"):
        bits[0:2] = [1]


def test_registers_lie_in_their_areas_the_highest_word_of_a_value_first() -> None:
    memory, kept = Areas("%QW", "%MD", "%ML"), dict[str, dict[int, int]]()
    registers = Registers(memory, tables.HOLDING_REGISTERS, kept)  # type: ignore[arg-type]
    assert len(registers) == 8192
    registers[3], registers[1024], registers[2047] = 0xFFFF, 5, 6
    registers[2048:2052] = [1, 2, 3, 4]
    registers[4096:4100] = [7, 8, 9, 10]
    assert {name: list(words) for name, words in memory.held.items()} == {
        "%QW": [0, 0, 0, 0xFFFF], "%MD": [2, 1, 4, 3], "%ML": [10, 9, 8, 7]}
    assert kept["%MW"] == {0: 5, 1023: 6} and plain(kept) == (
        ("%QW", ()), ("%MW", ((0, 5), (1023, 6))), ("%MD", ()), ("%ML", ()))
    assert (registers[3], registers[1024], registers[1025], registers[2049], registers[4097:4099]) == (0xFFFF, 5, 0, 2, [8, 9])


@each_of(("address", "found"), [
    (("%QX", 0, 0), [("coil", "01 05 0F", range(1))]), (("%QX", 1023, 7), [("coil", "01 05 0F", range(8191, 8192))]),
    (("%QX", 1024, 0), []), (("%QX", 5, None), []), (("%IX", 2, 3), [("discrete input", "02", range(19, 20))]),
    (("%IW", 1023, None), [("input register", "04", range(1023, 1024))]), (("%IW", 1024, None), []), (("%IW", 3, 2), []),
    (("%QW", 7, None), [("holding register", "03 06 10", range(7, 8))]),
    (("%MW", 0, None), [("holding register", "03 06 10", range(1024, 1025))]),
    (("%MD", 1023, None), [("holding register", "03 06 10", range(4094, 4096))]), (("%MD", 1024, None), []),
    (("%ML", 1023, None), [("holding register", "03 06 10", range(8188, 8192))]), (("%ML", 1024, None), []),
    (("%MB", 0, None), []),
])  # fmt: skip
def test_under_which_numbers_an_address_is_found(address: tuple[str, int, int | None], found: list[Any]) -> None:
    assert list(numbers_of(*address)) == found


@each_of(("arguments", "said"), [
    ({"port": 1}, ""), ({"port": 65_535}, ""), ({"clients": 1}, ""), ({"clients": 64}, ""), ({"port": 0}, "0 is no port"),
    ({"port": 65_536}, "65536 is no port"), ({"clients": 0}, "there may be 1 to 64 clients at once, not 0"),
    ({"clients": 65}, "there may be 1 to 64 clients at once, not 65"),
])  # fmt: skip
def test_the_bounds_of_its_arguments(arguments: dict[str, Any], said: str) -> None:
    if said:
        with pytest.raises(ValueError, match=said):
            OpenPlc(**arguments)
    else:
        assert OpenPlc(**arguments).configuration == {
            "address": "192.168.250.25", "port": 502, "clients": 8, "read_only": False, **arguments}


def test_its_front_and_what_it_asks_again_behind_failures() -> None:
    unit, memory, client = OpenPlc(clients=3), Areas(), Peer("192.168.250.9", 50000)
    assert unit.refresh(memory, [], 0) == [Listen(0, 502), Listen(1, 502), Listen(2, 502)]  # type: ignore[arg-type]
    told = [Opened(1, 502, client), Opened(0, 502, client), Failed(2, "open", "EADDRINUSE"), Failed(1, "send", "EPIPE")]
    assert unit.refresh(memory, told, 1) == [Grant(1, 2080), Grant(0, 2080), Close(1, True)]  # type: ignore[arg-type]
    assert unit.front(memory) == Front(  # type: ignore[arg-type]
        settings=(("port", "502"), ("clients at once", "3")), lamps=(Lamp("RUN", False, "the port cannot be used"),),
        sockets=(Socket("client 0", "CONNECTED", "502", "192.168.250.9:50000"),))  # fmt: skip
    assert unit.refresh(memory, [Failed(1, "send", "EPIPE"), Closed(1)], 2) == [Listen(1, 502)]  # type: ignore[arg-type]
    assert unit.reset(memory) == [Close(0, True), Close(1, True)]  # type: ignore[arg-type]
    assert unit.front(memory).lamps == (Lamp("RUN", True, "serves"),)  # type: ignore[arg-type]
    assert unit.refresh(memory, [Closed(0)], 3) == [Listen(0, 502), Listen(2, 502)]  # type: ignore[arg-type]


def test_a_unit_that_goes_on_from_a_state_has_the_clients_of_that_state_alone() -> None:
    unit, memory = OpenPlc(clients=3), Areas()
    unit.refresh(memory, [], 0)  # type: ignore[arg-type]
    nobody = unit.state
    unit.refresh(memory, [Opened(number, 502, Peer("192.168.250.9", 50000 + number)) for number in (0, 2)], 1)  # type: ignore
    unit.refresh(memory, [Received(2, b"\0\1\0\0\0\6\1")], 2)  # type: ignore[arg-type]  # a part of a frame
    two = unit.state
    for state, clients in ((nobody, []), (two, ["client 0", "client 2"]), (nobody, [])):
        unit.resume(state, memory)  # type: ignore[arg-type]
        assert [socket.name for socket in unit.front(memory).sockets] == clients and unit.state == state  # type: ignore[arg-type]


def test_a_frame_of_another_protocol_is_passed_over_and_what_is_no_frame_ends_the_connection() -> None:
    unit, memory = OpenPlc(clients=1), Areas()
    unit.refresh(memory, [], 0)  # type: ignore[arg-type]
    unit.refresh(memory, [Opened(0, 502, Peer("192.168.250.9", 50000))], 1)  # type: ignore[arg-type]
    foreign, endless = b"\0\1\0\1\0\2\1\3", b"\0\1\0\0\xff\xff"
    assert unit.refresh(memory, [Received(0, foreign)], 2) == [Grant(0, 2080)]  # type: ignore[arg-type]
    assert unit.refresh(memory, [Received(0, foreign + endless)], 3) == [Close(0)]  # type: ignore[arg-type]
