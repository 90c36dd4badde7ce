"""FINS/TCP: nodes, connections and their numbers, framing, and clients of every kind that mean no good."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from fins_rig import FinsRig, TcpClient

from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import Address, Command, Header
from fbvm.wire.fins.tcp import Kind, Message, Splitter, Unreadable, client_node

READ = "80 00 02 00 01 00 00 {node:02X} 00 01 01 01 82 00 64 00 00 01"


@pytest.fixture
def rig() -> FinsRig:
    return FinsRig()


def error_of(answer: str) -> int:
    """The error field of the last message in some bytes."""
    [*_, last] = Splitter().feed(bytes.fromhex(answer))
    assert isinstance(last, Message)
    return last.error


def test_nodes_are_allotted_by_the_number_of_the_connection(rig: FinsRig) -> None:
    clients = [TcpClient(rig, 100 + number) for number in range(3)]
    assert [client.connect()[-23:-12] for client in clients] == ["00 00 00 EF", "00 00 00 F0", "00 00 00 F1"]
    assert rig.plc.read("CIO 1523") == 7
    clients[1].leave()
    rig.plc.run(scans=3)
    assert rig.plc.read("CIO 1523") == 5
    assert TcpClient(rig, 110).connect()[-23:-12] == "00 00 00 F0"


def test_a_client_may_have_the_node_that_it_names(rig: FinsRig) -> None:
    client = TcpClient(rig)
    assert client.connect(25).endswith("00 00 00 19 00 00 00 01")
    assert client.frame(READ.format(node=25)).endswith("01 01 00 00 00 00")


@pytest.mark.parametrize(("node", "error"), [(1, 0x24), (255, 0x23), (1000, 0x23)])
def test_nodes_that_nobody_can_have(rig: FinsRig, node: int, error: int) -> None:
    client = TcpClient(rig)
    assert error_of(client.connect(node)) == error
    assert client.ended
    assert rig.plc.read("CIO 1523") == 0


def test_a_node_that_is_connected_stays_with_its_connection_which_is_asked_whether_it_lives(rig: FinsRig) -> None:
    first, second = TcpClient(rig, 100), TcpClient(rig, 101)
    first.connect(25)
    first.hear()
    assert error_of(second.connect(25)) == 0x21
    assert second.ended
    assert first.hear() == Message(Kind.CONFIRMATION).to_bytes()
    assert first.frame(READ.format(node=25)).endswith("01 01 00 00 00 00")


def test_the_seventeenth_client_is_told_that_all_connections_are_in_use(rig: FinsRig) -> None:
    clients = [TcpClient(rig, 100 + number) for number in range(17)]
    for client in clients[:16]:
        assert error_of(client.connect()) == 0
    assert rig.plc.read("CIO 1523") == 0xFFFF
    assert error_of(clients[16].connect()) == 0x20
    assert clients[16].ended
    clients[3].leave()
    rig.plc.run(scans=3)
    assert TcpClient(rig, 130).connect()[-23:-12] == "00 00 00 F2"


def test_only_permitted_addresses_get_a_connection() -> None:
    rig = FinsRig(fins_permitted=["192.168.250.100"])
    assert error_of(TcpClient(rig, 100).connect()) == 0
    refused = TcpClient(rig, 101)
    assert error_of(refused.connect()) == 0x22
    assert refused.ended
    assert rig.command(0x0101, "82 0064 00 0001")[0] == "0000"  # by UDP from a third address: not protected


def test_several_messages_in_a_segment_are_answered_in_their_order(rig: FinsRig) -> None:
    client = TcpClient(rig)
    client.connect()
    frames = [Command(Header(Address(0, 1), Address(0, 239), number), 0x0601) for number in (5, 6, 7)]
    answer = client.ask(b"".join(Message(Kind.FRAME, frame.to_bytes()).to_bytes() for frame in frames).hex())
    messages = Splitter().feed(bytes.fromhex(answer))
    assert [message.body[9] for message in messages if isinstance(message, Message)] == [5, 6, 7]


def test_a_message_in_several_segments_is_one(rig: FinsRig) -> None:
    client = TcpClient(rig)
    client.connect()
    whole = Message(Kind.FRAME, bytes.fromhex(READ.format(node=239))).to_bytes()
    for byte in whole[:-1]:
        assert client.ask(f"{byte:02X}") == ""
    assert client.ask(f"{whole[-1]:02X}").endswith("01 01 00 00 00 00")


@pytest.mark.parametrize("size", [1, 3, 17, 64])
def test_any_cut_of_a_stream_gives_the_same_messages(size: int) -> None:
    stream = client_node(25).to_bytes() + b"".join(Message(Kind.FRAME, bytes(12 + number)).to_bytes() for number in range(5))
    whole, cut = Splitter().feed(stream), Splitter()
    assert [found for at in range(0, len(stream), size) for found in cut.feed(stream[at : at + size])] == whole
    assert len(whole) == 6


@pytest.mark.parametrize(("data", "error"), [
    (b"G", tcp.Error.NOT_FINS), (b"FINX", tcp.Error.NOT_FINS), (b"FINS\0\0\0\7", tcp.Error.TOO_LONG),
    (b"FINS\0\0\7\xe5", tcp.Error.TOO_LONG), (b"FINS\x80\0\0\0", tcp.Error.TOO_LONG),
])  # fmt: skip
def test_a_stream_that_is_no_fins_is_known_early(data: bytes, error: tcp.Error) -> None:
    splitter = Splitter()
    [found] = splitter.feed(data)
    assert isinstance(found, Unreadable)
    assert found.error == error
    assert splitter.broken
    assert splitter.feed(client_node().to_bytes()) == []


# --- hostile clients ---------------------------------------------------------------------------------------------------

Deed = Callable[[FinsRig, TcpClient], None]
HEAD = b"FINS"


def _says(*parts: bytes, after_hello: bool = False) -> Deed:
    def deed(rig: FinsRig, client: TcpClient) -> None:
        if after_hello:
            client.connect()
        for part in parts:
            client.say(part)
            rig.plc.run(scans=2)
            client.hear()

    return deed


def _frame(data: bytes) -> bytes:
    return Message(Kind.FRAME, data).to_bytes()


def _is_silent(rig: FinsRig, client: TcpClient) -> None:
    rig.plc.run(for_ns=11_000_000_000)


def _stops_in_a_message(rig: FinsRig, client: TcpClient) -> None:
    client.connect()
    client.say(HEAD + b"\0\0\0\x1a\0")
    rig.plc.run(for_ns=11_000_000_000)


def _floods_with_datagrams(rig: FinsRig, client: TcpClient) -> None:
    for number in range(300):
        rig.say(bytes.fromhex(f"80 00 02 00 01 00 00 19 00 {number % 256:02X} 06 01"))
    rig.plc.run(scans=10)
    assert len(rig.datagrams()) <= 300


def _sends_responses(rig: FinsRig, client: TcpClient) -> None:
    rig.say(bytes.fromhex("C0 00 02 00 01 00 00 19 00 01 01 01 00 00 12 34"))
    rig.plc.scan()
    assert rig.datagrams() == []


def _goes_without_reading(rig: FinsRig, client: TcpClient) -> None:
    client.connect()
    request = _frame(bytes.fromhex("80 00 02 00 01 00 00 EF 00 01 01 01 82 00 00 00 03 E7"))
    for _ in range(200):
        client.say(request)
        rig.plc.scan()


def _opens_all_and_says_nothing(rig: FinsRig, client: TcpClient) -> None:
    others = [TcpClient(rig, 150 + number) for number in range(20)]
    rig.plc.run(for_ns=11_000_000_000)
    for other in others:
        other.hear()
        assert other.ended or not other.is_open  # the last ones are refused at once


DEEDS: dict[str, Deed] = {
    "an HTTP request": _says(b"GET / HTTP/1.1\r\nHost: plc\r\n\r\n"),
    "a TLS hello": _says(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"),
    "a megabyte of zeros": _says(*[bytes(4000)] * 250),
    "a length of 0": _says(HEAD + bytes(12)),
    "a length of 2^31": _says(HEAD + b"\x80\0\0\0" + bytes(8)),
    "a length of 4 GB": _says(HEAD + b"\xff\xff\xff\xff" + bytes(8)),
    "a frame before its node": _says(_frame(bytes.fromhex(READ.format(node=25)))),
    "a second hello": _says(client_node().to_bytes(), client_node().to_bytes()),
    "a hello that is too long": _says(Message(Kind.CLIENT_NODE, bytes(40)).to_bytes()),
    "the answer of a server": _says(tcp.server_node(5, 6).to_bytes()),
    "a confirmation": _says(Message(Kind.CONFIRMATION).to_bytes(), after_hello=True),
    "an error notification": _says(Message(Kind.ERROR, b"", 3).to_bytes(), after_hello=True),
    "commands 4 and 5": _says(Message(4).to_bytes(), Message(5).to_bytes(), after_hello=True),
    "command 2^32 - 1": _says(HEAD + b"\0\0\0\x08\xff\xff\xff\xff" + bytes(4), after_hello=True),
    "a frame of no bytes": _says(_frame(b""), after_hello=True),
    "a frame of eleven bytes": _says(_frame(bytes(11)), after_hello=True),
    "frames of random bytes": _says(
        *[_frame(bytes((number * 37 + at * 11) % 256 for at in range(12, 60))) for number in range(40)], after_hello=True),
    "a response that nobody waits for": _sends_responses,
    "silence": _is_silent,
    "half a message": _stops_in_a_message,
    "a flood of datagrams": _floods_with_datagrams,
    "no appetite for answers": _goes_without_reading,
    "twenty silent connections": _opens_all_and_says_nothing,
}
LONG = {"silence", "half a message", "a flood of datagrams", "twenty silent connections", "a megabyte of zeros"}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in DEEDS])
def test_a_good_client_is_served_beside_one_that_brings(rig: FinsRig, name: str) -> None:
    good, bad = TcpClient(rig, 100), TcpClient(rig, 101)
    good.connect(50)
    rig.plc.run(scans=3)
    DEEDS[name](rig, bad)
    rig.plc.write("D100", 0x0BAD)
    rig.plc.run(scans=3)
    assert good.frame(READ.format(node=50)).endswith("01 01 00 00 0B AD")
    assert rig.plc.trap is None
    bad.leave()
    rig.plc.run(scans=5)
    assert rig.plc.read("CIO 1523") == 1
    assert error_of(TcpClient(rig, 140).connect()) == 0


def test_more_commands_than_the_unit_has_buffers_are_answered_and_not_executed(rig: FinsRig) -> None:
    """Of two clients with a hundred writes each, those behind 192 find the destination busy."""
    clients = [TcpClient(rig, number) for number in (100, 101)]
    for client in clients:
        client.connect()
    for client in clients:
        written = [bytes.fromhex(f"80 00 02 00 01 00 00 EF 00 {number:02X} 01 03 82 00 {number:02X} 00 00 01 00 01")
                   for number in range(100)]  # fmt: skip
        client.say(b"".join(Message(Kind.FRAME, one).to_bytes() for one in written))
    rig.plc.scan()
    ends = [[message.body[12:].hex() for message in Splitter().feed(client.hear()) if isinstance(message, Message)]
            for client in clients]
    assert ends == [["0000"] * 100, ["0000"] * 92 + ["0204"] * 8]
