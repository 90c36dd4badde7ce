"""One line of a mailbox port, word by word: what it asks of the network, and what the program finds in its words."""

from __future__ import annotations

from array import array
from dataclasses import replace

import pytest
from rows import each_of

from fbvm.units.port.line import Line
from fbvm.units.port.port import Port
from fbvm.units.port.words import Commands, Lines, LineWords, States
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    Sent,
)

AT = LineWords(module=0, command=1, state=2, error=3, remote_ip=4, remote_port=6, local_port=7, keep_alive=8, peer_ip=9,
               peer_port=11, sending=12, received=13, outgoing=14, incoming=18)  # fmt: skip
CLOSE, CONNECT, LISTEN, RESET = 10, 11, 12, 13
CLOSED, OPENING, OPEN, ENDED, FAILED, CLOSING = 20, 21, 22, 23, 24, 25
LINES = Lines(0, 1, 22, AT, outgoing_bytes=7, incoming_bytes=8, commands=Commands(CLOSE, CONNECT, LISTEN, RESET),
              states=States(CLOSED, OPENING, OPEN, ENDED, FAILED, CLOSING))  # fmt: skip
PEER = Peer("10.0.1.2", 502)
NUMBERS = {"ECONNREFUSED": 77, "ECONNRESET": 78}


class Rig:
    """A line with number 3, its words, and a program that writes them."""

    def __init__(self, command: int = CLOSE) -> None:
        self.line = Line(3, LINES, NUMBERS.__getitem__)
        self.words = memoryview(array("H", [CLOSED if number == AT.state else 0 for number in range(22)]))
        self.words[AT.remote_ip], self.words[AT.remote_ip + 1], self.words[AT.remote_port] = 0x0A00, 0x0102, 502
        self.words[AT.command] = command

    def ask(self, is_mine: bool = True) -> list[Request]:
        return self.line.exchange(self.words, is_mine)

    def hear(self, *events: object) -> None:
        for event in events:
            self.line.take(event, self.words)  # type: ignore[arg-type]

    def opened(self) -> Rig:
        self.words[AT.command] = CONNECT
        self.ask()
        self.hear(Opened(3, 1024, PEER))
        self.ask()
        return self

    @property
    def state(self) -> int:
        return self.words[AT.state]

    def incoming(self, words: int = 4) -> list[str]:
        return [f"{word:04X}" for word in self.words[AT.incoming : AT.incoming + words]]


@each_of("command, keep_alive, asked", [
    (CONNECT, 0, Connect(3, PEER, 1024, False)), (CONNECT, 1, Connect(3, PEER, 1024, True)),
    (LISTEN, 0, Listen(3, 1024, PEER, False)), (LISTEN, 5, Listen(3, 1024, PEER, True)),
])
def test_a_connection_is_asked_for_once(command: int, keep_alive: int, asked: Request) -> None:
    rig = Rig(command)
    rig.words[AT.local_port], rig.words[AT.keep_alive] = 1024, keep_alive
    rig.words[AT.error] = rig.words[AT.received] = 9
    assert rig.line.is_idle and rig.ask() == [asked] and not rig.line.is_idle
    assert (rig.state, rig.words[AT.error], rig.words[AT.received]) == (OPENING, 0, 0)
    assert rig.ask() == [] and rig.state == OPENING
    rig.hear(Opened(3, 1024, Peer("192.168.0.9", 4711)))
    assert [*rig.words[AT.peer_ip : AT.peer_port + 1]] == [0xC0A8, 0x0009, 4711] and rig.state == OPEN
    assert rig.ask() == [Grant(3, 8)] and rig.ask() == []


def test_bytes_are_sent_when_those_before_have_gone() -> None:
    rig = Rig().opened()
    rig.words[AT.outgoing], rig.words[AT.outgoing + 1] = 0x0102, 0x0304
    rig.words[AT.sending] = 3
    assert rig.ask() == [Send(3, b"\x01\x02\x03")] and rig.words[AT.sending] == 0
    rig.words[AT.sending] = 1
    assert rig.ask() == [] and rig.words[AT.sending] == 1
    rig.hear(Sent(3, 3))
    assert rig.ask() == [Send(3, b"\x01")]
    rig.hear(Sent(3, 1))
    rig.words[AT.sending] = 100
    [sent] = rig.ask()
    assert isinstance(sent, Send) and len(sent.data) == 7, "as many as the words of the line hold"


def test_bytes_that_come_lie_behind_those_that_wait() -> None:
    rig = Rig().opened()
    rig.hear(Received(3, b"\x01\x02\x03", PEER))
    assert (rig.incoming(2), rig.words[AT.received], rig.ask()) == (["0102", "0300"], 3, [])
    rig.hear(Received(3, b"\x04\x05", PEER))
    assert (rig.incoming(3), rig.words[AT.received], rig.ask()) == (["0102", "0304", "0500"], 5, [])
    rig.words[AT.received] = 2
    assert rig.ask() == [Grant(3, 6)], "what the program has taken makes room"
    rig.hear(Received(3, b"\x11\x12\x13\x14\x15\x16\x17", PEER))
    assert (rig.incoming(), rig.words[AT.received]) == (["0102", "1112", "1314", "1516"], 8), "the last one has no room"
    assert rig.ask() == [] and rig.line.take(Received(3, b"\x99", PEER), rig.words) is None and rig.words[AT.received] == 8
    rig.words[AT.received] = 20
    rig.hear(Received(3, b"\x99", PEER))
    assert (rig.words[AT.received], rig.ask()) == (8, [])


def test_a_peer_that_ends_can_still_be_written_to() -> None:
    rig = Rig().opened()
    rig.hear(PeerClosed(3))
    rig.words[AT.sending], rig.words[AT.received] = 1, 0
    assert rig.state == ENDED and rig.ask() == [Send(3, b"\x00")]
    rig.hear(Sent(3, 1), Broken(3, "ECONNRESET"))
    assert (rig.state, rig.words[AT.error]) == (FAILED, 78)
    rig.hear(PeerClosed(3))
    assert rig.state == FAILED and rig.ask() == []


@each_of("command, is_reset", [(CLOSE, False), (RESET, True), (99, False)])
def test_a_close_is_confirmed_before_the_next_connection(command: int, is_reset: bool) -> None:
    rig = Rig().opened()
    rig.words[AT.sending] = 4
    rig.words[AT.command] = command
    assert rig.ask() == [Close(3, is_reset)] and (rig.state, rig.words[AT.sending]) == (CLOSING, 0)
    assert rig.ask() == [] and not rig.line.is_idle
    rig.hear(Received(3, b"\x01", PEER), Opened(3, 1, PEER), Broken(3, "ECONNRESET"))
    assert (rig.state, rig.words[AT.received]) == (CLOSING, 0), "what is told now is about the past"
    rig.words[AT.command] = CONNECT
    assert rig.ask() == []
    rig.words[AT.command] = command
    rig.hear(Closed(3))
    rig.words[AT.sending] = 4
    assert rig.line.is_idle and rig.ask() == [] and (rig.state, rig.words[AT.sending]) == (CLOSED, 0)
    rig.words[AT.sending] = 4
    assert rig.ask() == [] and rig.words[AT.sending] == 4, "a closed line is left alone"
    rig.words[AT.command] = CONNECT
    assert rig.ask() == [Connect(3, PEER)]
    rig.hear(Opened(3, 1, PEER))
    assert rig.ask() == [Send(3, b"\x00" * 4), Grant(3, 8)], "a new connection begins with all its room"


def test_two_closes_are_both_confirmed() -> None:
    rig = Rig().opened()
    assert rig.line.close(False) == [Close(3, False)] and rig.line.close(False) == []
    rig.hear(Closed(3), Closed(3))
    rig.words[AT.state] = CLOSED
    assert rig.line.is_idle and rig.ask() == [Connect(3, PEER)]


def test_an_opening_that_fails_stays_so_until_the_program_closes() -> None:
    rig = Rig(CONNECT)
    rig.ask()
    rig.hear(Failed(3, "open", "ECONNREFUSED"))
    assert (rig.state, rig.words[AT.error], rig.line.is_idle) == (FAILED, 77, True)
    assert rig.ask() == []
    rig.words[AT.command] = CLOSE
    assert rig.ask() == [] and rig.state == CLOSED
    other = Rig().opened()
    other.hear(Failed(3, "send", "ECONNRESET"))
    assert (other.state, other.words[AT.error], other.line.is_idle) == (FAILED, 78, False)


def test_a_line_of_another_unit_is_closed_and_its_words_are_left_to_that() -> None:
    rig = Rig().opened()
    assert rig.ask(is_mine=False) == [Close(3, False)]
    rig.hear(Closed(3))
    rig.words[AT.state], rig.words[AT.sending] = OPEN, 4
    assert rig.ask(is_mine=False) == [] and (rig.state, rig.words[AT.sending]) == (OPEN, 4)


def test_a_port_asks_its_own_lines_and_those_with_a_connection_that_carry_another_number_by_now() -> None:
    port, words = Port(5, replace(LINES, count=3), NUMBERS.__getitem__), memoryview(array("H", bytes(2 * 3 * 22)))
    lines = [words[at : at + 22] for at in (0, 22, 44)]
    for line, module in zip(lines, (6, 5, 5), strict=True):
        line[AT.module], line[AT.state], line[AT.command] = module, CLOSED, CONNECT
        line[AT.remote_ip], line[AT.remote_ip + 1], line[AT.remote_port] = 0x0A00, 0x0102, 502
    assert port.exchange(words) == [Connect(1, PEER), Connect(2, PEER)]
    port.take(words, [Opened(1, 1024, PEER), Opened(-1, 1, PEER), Opened(3, 1, PEER)])
    assert [line[AT.state] for line in lines] == [CLOSED, OPEN, OPENING]
    assert port.exchange(words) == [Grant(1, 8)]
    lines[1][AT.module] = 6
    assert port.exchange(words) == [Close(1)] and lines[1][AT.state] == CLOSING
    assert port.exchange(words) == []
    port.take(words, [Closed(1)])
    lines[1][AT.state] = OPEN
    assert port.exchange(words) == [] and lines[1][AT.state] == OPEN, "it is the other unit's"
    lines[0][AT.module] = 5
    assert port.exchange(words) == [Connect(0, PEER)]
    assert port.reset(words) == [Close(0, True), Close(2, True)]
    assert [(line[AT.command], line[AT.state]) for line in lines] == [(0, 0), (CONNECT, OPEN), (0, 0)]


def test_on_a_host_that_keeps_the_high_byte_first_bytes_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.byteorder", "big")
    rig = Rig().opened()
    rig.words[AT.outgoing] = 0x0201
    rig.words[AT.sending] = 2
    assert rig.ask() == [Send(3, b"\x01\x02")]
    rig.hear(Received(3, b"\x01\x02", PEER))
    assert rig.incoming(1) == ["0201"]
