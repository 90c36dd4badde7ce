"""The Modbus server of OpenPLC's runtime as a unit: which memory has which number, clients that come and go."""

from __future__ import annotations

from copy import deepcopy

import pytest
from rows import each_of

from fbvm import OpenPlc, Peer, Plc
from fbvm.base.areas import NEVER
from fbvm.code.compiler import compile_text
from fbvm.net.loop import LoopNetwork
from fbvm.wire import modbus
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    PeerClosed,
    Received,
    Request,
    Send,
)
from fbvm.wire.modbus import Adu

PROGRAM = """PROGRAM Main
VAR
    coil AT %QX0.3 : BOOL; last AT %QX1023.7 : BOOL; input AT %IX2.1 : BOOL := TRUE; analog AT %IW5 : UINT := 500;
    out AT %QW7 : INT := -2; w AT %MW9 : WORD := 16#ABCD; two AT %MD3 : DINT := 16#12345678;
    four AT %ML2 : LWORD := 16#1122334455667788; ratio AT %MD4 : REAL := 1.0;
END_VAR
    coil := coil;
END_PROGRAM"""
CLIENT = Peer("192.168.250.9", 50000)


class Rig:
    """A unit, the memory of a PLC, and a client on channel 0."""

    def __init__(self, unit: OpenPlc | None = None, program: str = PROGRAM) -> None:
        image = compile_text(program, dialect="matiec").image
        assert image is not None
        self.plc, self.unit = Plc(image), unit or OpenPlc()
        self.unit.reset(self.plc.memory)
        self.refresh()
        self.refresh(Opened(0, 502, CLIENT))

    def refresh(self, *events: Event) -> list[Request]:
        return self.unit.refresh(self.plc.memory, events, 0)

    def ask(self, pdu: bytes) -> bytes:
        """The answer to a request."""
        said, granted = self.refresh(Received(0, Adu(7, 1, pdu).to_bytes()))
        assert isinstance(said, Send) and isinstance(granted, Grant)
        answer = modbus.parse_adu(said.data)
        assert isinstance(answer, Adu) and (answer.transaction, answer.unit) == (7, 1)
        return answer.pdu

    def registers(self, function: int, first: int, count: int) -> list[int]:
        answer = modbus.decode_reply(self.ask(modbus.read(function, first, count)))
        return modbus.unpack_registers(answer.data) if not answer.exception else [-answer.exception]

    def bits(self, function: int, first: int, count: int) -> list[bool]:
        return modbus.unpack_bits(modbus.decode_reply(self.ask(modbus.read(function, first, count))).data, count)


READ = {
    (4, 5, 1): [500], (4, 1023, 1): [0], (3, 7, 1): [0xFFFE], (3, 1024 + 9, 1): [0xABCD], (3, 2048 + 6, 2): [0x1234, 0x5678],
    (3, 2048 + 7, 2): [0x5678, 0x3F80], (3, 2048 + 8, 2): [0x3F80, 0], (3, 4096 + 8, 4): [0x1122, 0x3344, 0x5566, 0x7788],
    (3, 1022, 4): [0, 0, 0, 0], (3, 8191, 1): [0], (3, 8191, 2): [-2], (4, 1023, 2): [-2], (3, 0, 126): [-3],
}  # fmt: skip
"""Function, first register and number: what is read, or the exception."""


@each_of("asked", READ)
def test_registers_have_the_numbers_of_openplc(asked: tuple[int, int, int]) -> None:
    assert Rig().registers(*asked) == READ[asked]


def test_bits_have_the_numbers_of_openplc() -> None:
    rig = Rig()
    assert rig.bits(2, 16, 3) == [False, True, False] and rig.bits(1, 3, 1) == [False]
    assert rig.ask(modbus.write_coil(3, True)) == modbus.write_coil(3, True)
    assert rig.unit.changed_words and rig.plc.read("Main.coil") is True and rig.bits(1, 2, 3) == [False, True, False]
    rig.ask(modbus.write_coils(8190, [False, True]))
    assert rig.plc.read("Main.last") is True
    assert rig.ask(modbus.read(1, 8191, 2)) == modbus.exception_reply(1, 2)
    assert not rig.unit.changed_words


def test_what_clients_write_stands_in_the_variables() -> None:
    rig = Rig()
    rig.ask(modbus.write_register(7, 0xFFFF))
    rig.ask(modbus.write_registers(2048 + 6, [0x8000, 1]))
    rig.ask(modbus.write_register(4096 + 9, 0xAAAA))
    read = {name: rig.plc.read(f"Main.{name}") for name in ("out", "two", "four")}
    assert read == {"out": -1, "two": -0x7FFFFFFF, "four": 0x1122_AAAA_5566_7788}


def test_addresses_that_the_program_does_not_use_keep_what_is_written() -> None:
    rig = Rig(program="PROGRAM Main END_PROGRAM")
    rig.ask(modbus.write_registers(2047, [1, 2, 3]))
    rig.ask(modbus.write_coils(9, [True, True]))
    twin, other = deepcopy(rig.unit), OpenPlc()
    other.resume(rig.unit.state, rig.plc.memory)
    for unit in (rig.unit, twin, other):
        rig.unit = unit
        assert rig.registers(3, 2046, 4) == [0, 1, 2, 3] and rig.bits(1, 8, 4) == [False, True, True, False]
    rig.unit.reset(rig.plc.memory)
    rig.refresh(Closed(0))
    rig.refresh(Opened(0, 502, CLIENT))
    assert rig.registers(3, 2047, 1) == [0]


def test_a_server_that_may_only_be_read_refuses_the_functions_that_write() -> None:
    rig = Rig(OpenPlc(read_only=True))
    assert rig.ask(modbus.write_register(7, 1)) == modbus.exception_reply(6, 1) and rig.registers(3, 7, 1) == [0xFFFE]
    assert Rig().ask(modbus.mask_write(7, 0, 0)) == modbus.exception_reply(0x16, 1)


def test_clients_come_and_go() -> None:
    unit = OpenPlc(clients=2)
    rig = Rig.__new__(Rig)
    rig.unit, rig.plc = unit, Rig().plc
    assert unit.wake_ns == 0 and rig.refresh() == [Listen(0, 502), Listen(1, 502)] and unit.wake_ns == NEVER
    assert rig.refresh(Opened(1, 502, CLIENT)) == [Grant(1, 2080)]
    assert [socket.peer for socket in unit.front(rig.plc.memory).sockets] == ["192.168.250.9:50000"]
    frame = Adu(1, 1, modbus.read(3, 7, 1)).to_bytes()
    assert rig.refresh(Received(1, frame[:5])) == [Grant(1, 2080)]
    said = rig.refresh(Received(1, frame[5:] + frame))
    assert [type(each) for each in said] == [Send, Send, Grant]
    assert rig.refresh(PeerClosed(1)) == [Close(1)] and rig.refresh(Broken(1, "ECONNRESET")) == []
    assert rig.refresh(Closed(1)) == [Listen(1, 502)]
    rig.refresh(Opened(0, 502, CLIENT))
    assert rig.refresh(Received(0, b"\0\1\0\0\xff\xff")) == [Close(0)]
    assert rig.refresh(Failed(1, "open", "EADDRINUSE"), Closed(0)) == [Listen(0, 502)]
    assert not unit.front(rig.plc.memory).lamps[0].is_on
    assert unit.reset(rig.plc.memory) == [Close(0, True)] and unit.wake_ns == 0


def test_words_have_changed_where_one_of_the_requests_of_a_refresh_wrote_them() -> None:
    rig = Rig()
    write, refused, read = modbus.write_register(7, 1), modbus.write_register(8192, 1), modbus.read(3, 7, 1)
    for pdus, changed in (((write,), True), ((write, read), True), ((write, refused), True), ((read, write), True),
                          ((refused,), False), ((read,), False), ((), False)):
        rig.refresh(Received(0, b"".join(Adu(1, 1, pdu).to_bytes() for pdu in pdus)))
        assert rig.unit.changed_words is changed, pdus
    rig.ask(write)
    rig.refresh()
    assert not rig.unit.changed_words
    only = Rig(OpenPlc(read_only=True))
    only.ask(write)
    assert not only.unit.changed_words


def test_what_comes_behind_the_end_of_a_connection_is_not_answered() -> None:
    rig, frame = Rig(), Adu(1, 1, modbus.write_register(7, 1)).to_bytes()
    assert rig.refresh(PeerClosed(0), Received(0, frame)) == [Close(0)]
    assert rig.refresh(Received(0, frame), Failed(0, "send", "EPIPE")) == [] and rig.plc.read("Main.out") == -2
    assert rig.unit.reset(rig.plc.memory) == [Close(channel, True) for channel in range(1, 8)], "it closes already"
    rig.refresh(*(Closed(channel) for channel in range(8)), Opened(3, 502, CLIENT))
    assert [type(each) for each in rig.refresh(Received(3, frame + b"\0\1\0\0\xff\xff"))] == [Send, Close]
    assert rig.plc.read("Main.out") == 1


def test_a_copy_has_the_port_the_clients_and_the_failures_of_the_unit_and_goes_its_own_way() -> None:
    rig = Rig(OpenPlc("192.168.250.26", port=503, clients=3, read_only=True))
    rig.refresh(Received(0, Adu(1, 1, modbus.read(3, 7, 1)).to_bytes()[:5]), Failed(1, "open", "EADDRINUSE"),
                Opened(2, 503, CLIENT), PeerClosed(2))
    twin = deepcopy(rig.unit)
    assert (twin.configuration, twin.state) == (rig.unit.configuration, rig.unit.state)
    assert twin.front(rig.plc.memory) == rig.unit.front(rig.plc.memory)
    rest = Adu(1, 1, modbus.read(3, 7, 1)).to_bytes()[5:]
    for unit in (twin, rig.unit):
        rig.unit = unit
        assert [type(each) for each in rig.refresh(Received(0, rest), Closed(2))] == [Send, Grant, Listen]
        assert rig.refresh() == []


def test_a_client_of_a_network_in_memory_is_answered() -> None:
    network, plc = LoopNetwork(), Plc(Rig().plc.image)
    plc.attach(OpenPlc(port=1502), network)
    client = network.attach("192.168.250.9")
    plc.scan()
    client.submit([Connect(0, Peer("192.168.250.25", 1502)), Grant(0, 300)], plc.now_ns)
    heard: list[Event] = []
    for _ in range(6):
        plc.scan()
        for event in client.events(plc.now_ns):
            heard.append(event)
            if isinstance(event, Opened):
                client.submit([Send(0, Adu(1, 1, modbus.read(3, 7, 1)).to_bytes())], plc.now_ns)
    said = b"".join(event.data for event in heard if isinstance(event, Received))
    assert modbus.parse_adu(said) == Adu(1, 1, b"\3\2\xff\xfe")


@pytest.mark.parametrize(("arguments", "said"), [({"port": 0}, "0 is no port"), ({"clients": 65}, "1 to 64 clients")])
def test_a_server_that_cannot_be(arguments: dict[str, int], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        OpenPlc(**arguments)  # type: ignore[arg-type]
