"""The CPU unit's communications ports alone: what an instruction sends, what a response does, times and words."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.base.areas import NEVER
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.machine.servicing import ports as module
from fbvm.machine.servicing.ports import COMPLETION, ENABLED, ERRORS, CommunicationsPorts, ports_of
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import Address, Command, Header, Response

TEXT = """PROGRAM Main
LADDER
LD P_Off
SEND(090) D0 D100 D300
RECV(098) D0 D100 D300
CMND(490) D0 D100 D300
END_LADDER
END_PROGRAM
"""
D = 0x10000
"""The PLC memory address of D0."""
SECOND_NS = 1_000_000_000


class Ports:
    """The ports of a PLC, and the commands that they send."""

    def __init__(self) -> None:
        image = compile_text(TEXT).image
        assert image is not None
        self.plc = Plc(image)
        found = ports_of(image, self.plc.memory)
        assert isinstance(found, CommunicationsPorts)
        self.ports, self.sent, self.answers = found, list[Command](), list[Any]()
        self.a, self.d = self.plc.memory.words("A"), self.plc.memory.words("D")
        self.a[ENABLED] = 0

    def ask(self, port: int, instruction: str, **more: int) -> None:
        given = {"First": D, "Second": D + 100, "Size": 2, "Network": 1, "Node": 7, "Unit": 0, "Silent": 0, "Retries": 0,
        "Limit": 0,
                 "Most": 100}  # fmt: skip
        for name, value in (given | more).items():
            self.ports._set(port, name, value)
        self.ports._set(port, "Instruction", {"SEND": self.ports._send, "RECV": self.ports._recv,
        "CMND": self.ports._cmnd}[instruction])
        self.ports._set(port, "State", self.ports._asked)

    def serve(self, now_ns: int) -> bool:
        return self.ports.serve(now_ns, self.send)

    def send(self, command: Command) -> tuple[int, bytes] | None:
        self.sent.append(command)
        return self.answers.pop(0) if self.answers else None

    def respond(self, code: int, end_code: int = 0, data: bytes = b"", node: int = 7, service: int | None = None) -> bool:
        header = Header(Address(), Address(1, node, 0), self.sent[-1].header.service if service is None else service, 0xC0)
        return self.ports.take_response(Response(header, code, end_code, data))

    def words(self, port: int) -> tuple[bool, int, bool]:
        """Whether the port is free, its end code, and its error flag."""
        return bool(self.a[ENABLED] >> port & 1), self.a[COMPLETION + port], bool(self.a[ERRORS] >> port & 1)


@pytest.fixture(scope="module")
def made() -> Ports:
    return Ports()


@pytest.fixture
def ports(made: Ports) -> Ports:
    """Ports that nobody uses."""
    for port in range(8):
        made.ports._set(port, "State", made.ports._free)
        made.a[COMPLETION + port] = 0
    made.a[ENABLED] = made.a[ERRORS] = 0
    made.sent.clear()
    made.answers.clear()
    for number in range(400):
        made.d[number] = number
    return made


@each_of("instruction, code, parameters", [
    ("SEND", 0x0102, "82 0064 00 0002 0000 0001"), ("RECV", 0x0101, "82 0000 00 0002"), ("CMND", 0x0000, ""),
])
def test_an_instruction_becomes_a_command(ports: Ports, instruction: str, code: int, parameters: str) -> None:
    ports.sent.clear()
    ports.ask(2, instruction)
    assert ports.ports.wake_ns == 0 and not ports.serve(5 * SECOND_NS)
    [command] = ports.sent
    assert (command.code, command.parameters.hex()) == (code, parameters.replace(" ", ""))
    assert (command.header.destination, command.header.wants_response) == (Address(1, 7, 0), True)
    assert ports.ports.wake_ns == 7 * SECOND_NS, "a response is awaited for 2 s"
    assert not ports.serve(7 * SECOND_NS - 1) and len(ports.sent) == 1
    assert ports.serve(7 * SECOND_NS) and ports.words(2) == (True, EndCode.TIMED_OUT, True) and ports.ports.wake_ns == NEVER


def test_the_limit_counts_tenths_of_a_second_and_retries_count_down(ports: Ports) -> None:
    ports.ask(0, "SEND", Limit=3, Retries=2)
    for now_ns, sent in ((0, 1), (299_999_999, 1), (300_000_000, 2), (599_999_999, 2), (600_000_000, 3)):
        assert not ports.serve(now_ns)
        assert len(ports.sent) == sent, now_ns
    assert ports.sent[0] == ports.sent[1] == ports.sent[2]
    assert ports.serve(900_000_000) and ports.words(0) == (True, EndCode.TIMED_OUT, True)


def test_services_are_numbered_on_and_wrap(ports: Ports) -> None:
    at = ports.ports._service
    ports.plc.memory.u8[at:at + 2] = (253).to_bytes(2, "little")
    for port in range(4):
        ports.ask(port, "SEND")
    ports.serve(0)
    assert [command.header.service for command in ports.sent] == [254, 255, 0, 1]


def test_a_free_port_is_enabled_and_the_others_are_left(ports: Ports) -> None:
    ports.ask(1, "SEND")
    assert not ports.serve(0)
    assert [ports.words(port)[0] for port in range(8)] == [True, False] + [True] * 6 and ports.a[ENABLED] >> 15 == 1


@each_of("end_code, data, words, stored", [
    (0, b"\x11\x22\x33\x44", (True, 0, False), (0x1122, 0x3344, 102)), (0, b"\x11\x22", (True, EndCode.COUNT, True),
    (100, 101, 102)),
    (0x0040, b"\x11\x22\x33\x44", (True, 0x0040, False), (0x1122, 0x3344, 102)), (0x2108, b"", (True, 0x2108, True),
    (100, 101, 102)),
])
def test_what_recv_has_got(ports: Ports, end_code: int, data: bytes, words: tuple[bool, int, bool], stored: tuple[int,
...]) -> None:
    for number in range(100, 103):
        ports.d[number] = number
    ports.ask(3, "RECV")
    ports.serve(0)
    assert not ports.respond(0x0102) and not ports.respond(0x0101, node=8) and not ports.respond(0x0101, service=99)
    assert ports.respond(0x0101, end_code, data) and not ports.respond(0x0101, end_code, data)
    assert ports.words(3) == words and tuple(ports.d[100:103]) == stored


@each_of("end_code, data, more, words, stored", [
    (0, b"\xAB", {}, (True, 0, False), (0x0501, 0x0000, 0xAB66)), (0x2108, b"", {}, (True, 0x2108, False), (0x0501, 0x2108, 102)),
    (0, b"\xAB", {"Most": 4}, (True, EndCode.RESPONSE_TOO_LONG, True), (100, 101, 102)),
    (0, b"\xAB", {"Most": 5}, (True, 0, False), (0x0501, 0x0000, 0xAB66)),
    (EndCode.TOO_LONG, b"", {}, (True, EndCode.TOO_LONG, False), (0x0501, EndCode.TOO_LONG, 102)),
])
def test_what_cmnd_has_got(ports: Ports, end_code: int, data: bytes, more: dict[str, int], words: tuple[bool, int, bool],
                           stored: tuple[int, ...]) -> None:  # fmt: skip
    for number in range(100, 103):
        ports.d[number] = number
    ports.d[0] = 0x0501
    ports.ask(4, "CMND", **more)
    ports.serve(0)
    assert ports.sent[-1].code == 0x0501 and ports.respond(0x0501, end_code, data)
    assert ports.words(4) == words and tuple(ports.d[100:103]) == stored


@each_of("instruction, more, answers, words, sent", [
    ("SEND", {"Node": 255}, [], (True, EndCode.HEADER, True), 0), ("SEND", {"Node": 255, "Silent": 1}, [], (True, 0, False), 1),
    ("SEND", {"Silent": 1}, [(0, b"")], (True, 0, False), 1),
    ("SEND", {"Silent": 1}, [(EndCode.TIMED_OUT, b"")], (True, EndCode.TIMED_OUT, True), 1),
    ("SEND", {}, [(0x0401, b"")], (True, 0x0401, True), 1), ("RECV", {}, [(0, b"\1\2\3\4")], (True, 0, False), 1),
    ("RECV", {"First": 0x7FFFF}, [], (True, EndCode.NO_AREA, True), 0),
    ("SEND", {"Second": 0x7FFFF}, [], (True, EndCode.NO_AREA, True), 0),
])
def test_what_ends_at_once(ports: Ports, instruction: str, more: dict[str, int], answers: list[Any], words: tuple[bool, int,
bool],
                           sent: int) -> None:  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_fins_address", lambda address: None if address == 0x7FFFF else b"\x82\0\0\0")
        ports.sent.clear()
        ports.answers[:] = answers
        ports.ask(5, instruction, **more)
        assert ports.serve(0) and len(ports.sent) == sent and ports.words(5) == words


def test_an_error_flag_goes_with_the_next_good_end(ports: Ports) -> None:
    ports.answers[:] = [(0x0401, b""), (0, b"")]
    ports.ask(6, "SEND")
    ports.a[ERRORS] = 1 << 2
    ports.serve(0)
    assert ports.a[ERRORS] == 1 << 2 | 1 << 6
    ports.ask(6, "SEND")
    ports.serve(0)
    assert ports.a[ERRORS] == 1 << 2


def test_odd_bytes_lie_in_the_high_half_of_the_last_word(ports: Ports) -> None:
    ports.d[100], ports.d[101], ports.d[102] = 0x1122, 0x3344, 0x5566
    assert ports.ports._bytes(D + 100, 3) == b"\x11\x22\x33" and ports.ports._bytes(D + 100, 0) == b""
    ports.ports._store(D + 100, b"\xAA\xBB\xCC")
    assert [ports.d[number] for number in (100, 101, 102)] == [0xAABB, 0xCC44, 0x5566]


@each_of("address, place", [
    (D, ("D", 0)), (D + 32767, ("D", 32767)), (0xC000, ("CIO", 0)), (0xD7FF, ("CIO", 6143)), (0xD800, ("A", 0)),
    (0xDC00, ("H", 0)),
    (0xDE05, ("W", 5)), (0xE001, ("T", 1)), (0xF002, ("C", 2)), (0x18000, ("E0", 0)), (0x18000 + 32768, ("E1", 0)),
    (0xBE00, None),
    (0xBF05, None), (0xBDFF, None), (0, None),
])
def test_where_a_plc_memory_address_is(address: int, place: tuple[str, int] | None) -> None:
    assert module._place(address) == place and (module._fins_address(address) is None) == (place is None)


@each_of("address, fins", [(D + 5, "82 0005 00"), (0xC00A, "B0 000A 00"), (0xDE00, "B1 0000 00"), (0xDC01, "B2 0001 00")])
def test_a_plc_memory_address_in_fins(address: int, fins: str) -> None:
    assert module._fins_address(address) == bytes.fromhex(fins)
