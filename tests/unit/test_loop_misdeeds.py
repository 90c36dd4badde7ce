"""Each misdeed is what its name says, as a client sees it."""

from __future__ import annotations

import pytest

from fbvm.net.loop import LoopNetwork
from fbvm.net.misdeeds import LATE_NS, MISDEEDS
from fbvm.net.peers import ModbusPeer
from fbvm.wire import modbus
from fbvm.wire.link import Broken, Connect, Grant, Opened, Peer, PeerClosed, Received, Send, Sent
from fbvm.wire.modbus import Adu, Fault, Splitter, mismatch

SERVER = Peer("10.0.0.1", 502)
PDU = modbus.read(3, 0, 2)
SECOND_NS = 1_000_000_000


def seen(name: str, until_ns: int) -> list[str]:
    """What a client that asks one thing makes of what comes, in words."""
    network = LoopNetwork()
    network.place(SERVER, ModbusPeer(reply=MISDEEDS[name]))
    link = network.attach("10.0.0.2")
    link.submit([Connect(1, SERVER), Grant(1, 4096)], 0)
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


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("late", []),
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
    ],
)
def test_a_misdeed(name: str, words: list[str]) -> None:
    assert seen(name, SECOND_NS) == words


def test_every_misdeed_is_tried() -> None:
    [mark] = test_a_misdeed.pytestmark  # type: ignore[attr-defined]
    assert {name for name, _ in mark.args[1]} == set(MISDEEDS)
    assert seen("late", LATE_NS) == [RIGHT]
