"""Each misdeed is what its name says, as a client sees it."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.net.loop import LoopNetwork
from fbvm.net.misdeeds import (
    FLOOD_BYTES,
    LATE_NS,
    MISDEEDS,
    NEXT_NS,
    RUDE_PEERS,
    RudePeer,
    _next_exception,
    by_script,
    by_seed,
)
from fbvm.net.peers import ModbusPeer, Say
from fbvm.wire import modbus
from fbvm.wire.link import Broken, Connect, Event, Grant, Opened, Peer, PeerClosed, Received, Send, Sent
from fbvm.wire.modbus import Adu, Fault, Splitter, mismatch
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("10.0.0.1", 502)
PDU = modbus.read(3, 0, 2)
SECOND_NS = 1_000_000_000


def seen(name: str, until_ns: int) -> list[str]:
    """What a client that asks one thing makes of what comes, in words."""
    network = LoopNetwork()
    network.place(SERVER, ModbusPeer(reply=MISDEEDS[name]))
    return client(network, until_ns)


def client(network: LoopNetwork, until_ns: int) -> list[str]:
    link = network.attach("10.0.0.2")
    link.submit([Connect(1, SERVER), Grant(1, 99_999)], 0)
    assert link.events(0) == [Opened(1, 49152, SERVER)]
    link.submit([Send(1, Adu(7, 1, PDU).to_bytes())], 0)
    splitter, words = Splitter(), list[str]()
    for event in [event for now_ns in (0, until_ns) for event in link.events(now_ns)]:
        match event:
            case Received(data=data):
                for found in splitter.feed(data):
                    if isinstance(found, Fault):
                        words.append(found.reason)
                    elif (found.transaction, found.unit) != (7, 1):
                        words.append("not mine")
                    else:
                        words.append(mismatch(PDU, found.pdu) or f"{found.pdu.hex()}")
            case PeerClosed():
                words.append("fin")
            case Broken(error=error):
                words.append(error)
            case other:
                assert isinstance(other, Sent)
    return [*words, f"{len(splitter.pending)} pending"] if splitter.pending else words


RIGHT = "030400000000"


AFTER_A_MISDEED = [
    ("late", []),
    ("late by one request", []),
    ("again later", [RIGHT, RIGHT]),
    ("a wrong one first", ["not mine", RIGHT]),
    ("a wrong one last", [RIGHT, "not mine"]),
    ("garbage behind", [RIGHT, "length 12081 outside 2..254"]),
    ("a byte behind", [RIGHT, "1 pending"]),
    ("a frame begun behind", [RIGHT, "11 pending"]),
    ("the next reply, too", [RIGHT, "not mine"]),
    ("the next reply soon", [RIGHT, "not mine"]),
    ("the next exception, too", [RIGHT, "not mine"]),
    ("flood behind", [RIGHT] + ["not mine"] * (FLOOD_BYTES // 13)),
    ("right, then fin", [RIGHT, "fin"]),
    ("right, then closed", [RIGHT, "fin"]),
    ("right, then reset", [RIGHT, "ECONNRESET"]),
    ("transaction swapped", ["not mine"]),
    ("neighbour's function", ["function code 02 instead of 03"]),
    ("two bytes more", ["6 data bytes instead of 4"]),
    ("fewer data", ["2 data bytes instead of 4"]),
    ("function only", ["too short"]),
    ("exception 00", ["wrong length"]),
    ("illegal function", ["8301"]),
    ("gateway without target", ["830b"]),
    ("exception 0C", ["830c"]),
    ("exception FF", ["83ff"]),
    ("another's exception", ["function code 02 instead of 03"]),
    ("exception without code", ["exception reply without code"]),
    ("exception with more", ["wrong length"]),
    ("length 0", ["length 0 outside 2..254"]),
    ("length 1", ["length 1 outside 2..254"]),
    ("length 255", ["length 255 outside 2..254"]),
    ("length one less", ["byte count 4, 3 follow", "1 pending"]),
    ("length one more", ["13 pending"]),
    ("length 254", ["13 pending"]),
    ("garbage first", ["length 12081 outside 2..254"]),
    ("flood", ["length 65535 outside 2..254"]),
    ("one byte", ["1 pending"]),
    ("all but one byte", ["12 pending"]),
    ("half, the rest late", ["9 pending"]),
    ("half closed", ["fin"]),
    ("one byte, then reset", ["ECONNRESET", "1 pending"]),
    ("header, then closed", ["fin", "7 pending"]),
    ("two pieces", [RIGHT]),
    ("byte by byte", [RIGHT]),
    ("twice", [RIGHT, RIGHT]),
    ("wrong transaction", ["not mine"]),
    ("wrong unit", ["not mine"]),
    ("wrong function", ["function code 2B instead of 03"]),
    ("wrong content", ["byte count 251, 4 follow"]),
    ("one byte short", ["byte count 4, 3 follow"]),
    ("server failure", ["8304"]),
    ("wrong protocol", ["protocol id 1 is not 0"]),
    ("impossible length", ["length 65287 outside 2..254"]),
    ("garbage", ["length 12081 outside 2..254"]),
    ("silence", []),
    ("half", ["6 pending"]),
    ("half, then fin", ["fin", "6 pending"]),
    ("fin", ["fin"]),
    ("reset", ["ECONNRESET"]),
    ("half, then reset", ["ECONNRESET", "6 pending"]),
]


@each_of(("name", "words"), AFTER_A_MISDEED)
def test_a_misdeed(name: str, words: list[str]) -> None:
    assert seen(name, SECOND_NS) == words


def test_every_misdeed_is_tried() -> None:
    assert {name for name, _ in AFTER_A_MISDEED} == set(MISDEEDS)
    assert seen("late", LATE_NS) == [RIGHT]
    assert seen("late by one request", NEXT_NS) == [RIGHT]


# --- servers that misbehave as a whole --------------------------------------------------------------------------------


def conversation(name: str, requests: int, until_ns: int = SECOND_NS) -> list[str]:
    """What a client that asks so often sees, 10 ms between its requests; names of other events than bytes."""
    network = LoopNetwork()
    network.place(SERVER, RUDE_PEERS[name](ModbusServer()))
    link, words = network.attach("10.0.0.2"), list[str]()
    link.submit([Connect(1, SERVER), Grant(1, 99_999)], 0)
    for number in range(requests + 1):
        for event in link.events(number * 10_000_000):
            words += said(event)
        if number < requests:
            link.submit([Send(1, Adu(number, 1, PDU).to_bytes())], number * 10_000_000)
    return [*words, *(word for event in link.events(until_ns) for word in said(event))]


def said(event: Event) -> list[str]:
    """Numbers of transactions in what was received, or the kind of event."""
    if not isinstance(event, Received):
        return [] if isinstance(event, Sent | Opened) else [getattr(event, "error", type(event).__name__)]
    found = Splitter().feed(event.data)
    return [f"{adu.transaction}" if isinstance(adu, Adu) else adu.reason for adu in found] or ["part"]


AFTER_A_RUDE_PEER = [
    ("nobody listens", ["ECONNREFUSED", "ENOTCONN", "ENOTCONN", "ENOTCONN"]),
    ("never accepts", ["ENOTCONN"] * 3),
    ("closes at once", ["PeerClosed", "ECONNRESET", "EPIPE", "EPIPE"]),
    ("half closes at once", ["PeerClosed"]),
    ("resets at once", ["ECONNRESET", "EPIPE", "EPIPE", "EPIPE"]),
    ("closes after a while", ["0", "1", "2", "PeerClosed"]),
    ("closes between requests", ["0", "1", "2", "PeerClosed"]),
    ("resets between requests", ["0", "1", "2", "ECONNRESET"]),
    ("takes one connection only", ["0", "PeerClosed", "ECONNRESET", "EPIPE"]),
    ("never reads", []),
    ("never reads, then resets", ["ECONNRESET"]),
    ("closes in mid-request", ["PeerClosed", "ECONNRESET", "EPIPE"]),
    ("resets in mid-request", ["ECONNRESET", "EPIPE", "EPIPE"]),
    ("hears every second request", ["1"]),
    ("previous reply instead", ["0", "1"]),
    ("previous reply first", ["0", "0", "1", "1", "2"]),
    ("previous reply behind", ["0", "1", "0", "2", "1"]),
    ("speaks first", ["32768", "0", "1", "2"]),
    ("speaks first, garbage", ["length 12081 outside 2..254", "0", "1", "2"]),
    ("drips for ever", ["part", "part", "part", "part"]),
    ("floods from the start", ["32768"]),
]


@pytest.mark.slow
@each_of(("name", "words"), AFTER_A_RUDE_PEER)
def test_a_rude_peer(name: str, words: list[str]) -> None:
    seen = conversation(name, 3)
    if name == "floods from the start":
        assert (len(seen), set(seen)) == (101 * 40 + 3, {"32768", "0", "1", "2"})
    else:
        assert seen == words


def test_every_rude_peer_is_tried() -> None:
    assert {name for name, _ in AFTER_A_RUDE_PEER} == set(RUDE_PEERS)


def test_a_rude_peer_may_reform() -> None:
    network, peer = LoopNetwork(), RudePeer(reads=False, greeting=[Say(b"hello")], connections=1)
    network.place(SERVER, peer)
    link = network.attach("10.0.0.2")
    link.submit([Connect(1, SERVER), Grant(1, 4096)], 0)
    link.submit([Send(1, Adu(5, 1, PDU).to_bytes())], 0)
    assert said(link.events(0)[-1]) == ["part"]
    link.submit([Connect(2, SERVER)], 0)
    assert [word for event in link.events(1) for word in said(event)] == ["ECONNREFUSED"]
    peer.reform()
    link.submit([Send(1, Adu(6, 1, PDU).to_bytes()), Connect(2, SERVER), Grant(2, 4096)], 2)
    assert [word for event in link.events(2) for word in said(event)] == ["5", "6"]
    link.submit([Send(2, Adu(7, 1, PDU).to_bytes())], 3)
    assert [word for event in link.events(3) for word in said(event)] == ["7"], "it reads on new connections, too"


def test_misdeeds_by_script_and_by_seed() -> None:
    frame = Adu(7, 1, b"\x03\x02\0\0").to_bytes()
    script = by_script("twice", "", "silence")
    assert [list(script(frame)) for _ in range(4)] == [[Say(frame * 2)], [Say(frame)], [], [Say(frame)]]

    def told(seed: int, chance: float) -> list[list[object]]:
        reply = by_seed(seed, chance, ["silence", "fin", "reset"])
        return [list(reply(frame)) for _ in range(40)]

    assert told(1, 0.5) == told(1, 0.5) != told(2, 0.5)
    assert told(1, 0) == [[Say(frame)]] * 40
    assert [Say(frame)] not in told(1, 1)


def test_an_exception_that_nobody_has_asked_for_is_one_of_the_same_function() -> None:
    """Of the request behind this one, by its transaction."""
    frame = Adu(0x1FF, 17, modbus.data_reply(3, b"\1\2")).to_bytes()
    assert _next_exception(frame) == Adu(0x200, 17, modbus.exception_reply(3, 2)).to_bytes()
