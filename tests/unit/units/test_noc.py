"""The Ethernet module as a unit: what every unit owes, its head, its connections, restart, wrong arguments."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence

import noc_words
import pytest
from common_unit_tests import CYCLE_NS, CommonUnitTests, FakeMemory
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from noc_words import AREA, COMMAND, HEAD_WORDS, LINE, LINES, MODULES, OWN_IP, STATE
from rows import each_of

from fbvm.base.areas import NEVER
from fbvm.base.data import data_folder
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.net.peers import Fin, Reset, Say, ScriptedPeer
from fbvm.units.contract import Unit
from fbvm.units.port.noc import ERRNO, FTP, HTTP, RESTART_NS, Noc, Statistic, _services
from fbvm.wire.link import (
    Broken,
    Close,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
)

OWN = Peer("192.168.250.22", 502)
SERVER = Peer("192.168.250.2", 502)
SLOTS_AT = MODULES * HEAD_WORDS


def slot(memory: FakeMemory, number: int = 0) -> memoryview:
    start = SLOTS_AT + number * LINES.size
    return memory.words("NOC")[start : start + LINES.size]


def command(words: memoryview, what: int, remote: Peer = SERVER, local_port: int = 0, place: int = 7) -> None:
    octets = [int(part) for part in remote.host.split(".")]
    words[LINE.module] = place + 1
    words[LINE.remote_ip], words[LINE.remote_ip + 1] = octets[0] << 8 | octets[1], octets[2] << 8 | octets[3]
    words[LINE.remote_port], words[LINE.local_port] = remote.port, local_port
    words[LINE.command] = what


def say(words: memoryview, data: bytes) -> None:
    padded = data + b"\0"
    for number in range((len(data) + 1) // 2):
        words[LINE.outgoing + number] = int.from_bytes(padded[2 * number : 2 * number + 2], "big")
    words[LINE.sending] = len(data)


def heard(words: memoryview) -> bytes:
    size = words[LINE.received]
    data = b"".join(word.to_bytes(2, "big") for word in words[LINE.incoming : LINE.incoming + (size + 1) // 2])
    return data[:size]


class TestNocIsAUnit(CommonUnitTests):
    def new_unit(self) -> Unit:
        return Noc()

    def may_write(self) -> set[tuple[str, int]]:
        head = range(7 * HEAD_WORDS, 8 * HEAD_WORDS)
        unit_words = (LINE.command, LINE.state, LINE.error, LINE.peer_ip, LINE.peer_ip + 1,
                      LINE.peer_port, LINE.sending, LINE.received)  # fmt: skip
        return {("NOC", word) for word in head} | {("NOC", SLOTS_AT + word) for word in unit_words}

    def data_words(self) -> set[tuple[str, int]]:
        return {("NOC", SLOTS_AT + word) for word in range(LINE.incoming, LINES.size)}

    def ask(self, memory: FakeMemory) -> None:
        command(slot(memory), COMMAND.connect)

    def is_answered(self, memory: FakeMemory) -> bool:
        return slot(memory)[LINE.state] == STATE.open


class Rig:
    """A module, its memory, a network in memory; `step` is one refresh."""

    def __init__(self, noc: Noc | None = None, network: LoopNetwork | None = None) -> None:
        self.noc = noc or Noc(restart_ns=5 * CYCLE_NS)
        self.memory = FakeMemory()
        self.network = network or LoopNetwork()
        self.link: LoopLink = self.network.attach(self.noc.address)
        self.now_ns = 0
        self.link.submit(self.noc.reset(self.memory), 0)
        self.requests: list[Request] = []

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.now_ns += CYCLE_NS
            self.requests = self.noc.refresh(self.memory, self.link.events(self.now_ns), self.now_ns)
            self.link.submit(self.requests, self.now_ns)

    def head(self, place: int = 7) -> memoryview:
        return self.memory.words("NOC")[place * HEAD_WORDS : (place + 1) * HEAD_WORDS]

    def table(self) -> list[int]:
        return self.head()[noc_words.STATISTICS : noc_words.STATISTICS + noc_words.TABLE_WORDS].tolist()

    def counter(self, place: int) -> int:
        low, high = self.table()[place : place + 2]
        return low | high << 16


# --- the head -----------------------------------------------------------------------------------------------------------


def test_the_library_declares_what_the_unit_brings() -> None:
    written = tomllib.loads((data_folder("fblib") / "schneider" / "mbp_mstr" / "library.toml").read_text())["mailbox"]
    assert written == {"area": AREA, "head": SLOTS_AT, "slots": LINES.count, "slot": LINES.size}
    assert len(FakeMemory().words("NOC")) == SLOTS_AT + LINES.count * LINES.size


def test_the_table_of_the_sheet() -> None:
    """MAC 00 00 54 00 12 34 and IP 198.202.137.113 as the help writes them; link, 100 Mbit/s, full duplex, NOC, running."""
    rig = Rig(Noc(address="198.202.137.113"))
    table = rig.table()
    assert table[0:3] == [0x0000, 0x5400, 0x1234]
    assert table[36:38] == [0x8971, 0xC6CA]
    assert table[3] == 0x8000 | 0x1000 | 14 << 4 | 4 | 2 | 1
    assert not any(table[4:36])


def test_the_board_status_follows_the_settings() -> None:
    rig = Rig(Noc(module_type=21))
    rig.noc.settings = {"link_up": False, "configured": False}
    rig.step()
    assert rig.table()[3] == 0x1000 | 21 << 4 | 4
    assert rig.head()[noc_words.STATUS] == noc_words.UNCONFIGURED


@each_of(("rack_slot", "place"), [(0, 0), (7, 7), (16, 16), (254, 17)])
def test_the_head_of_each_slot(rack_slot: int, place: int) -> None:
    rig = Rig(Noc(rack_slot, http=False))
    head = rig.head(place)
    assert (head[noc_words.STATUS], head[noc_words.RACK_SLOT]) == (noc_words.READY, rack_slot)
    assert head[noc_words.CONFIGURED] == head[noc_words.SERVICES] == FTP
    assert head[OWN_IP : OWN_IP + 2].tolist() == [0xC0A8, 0xFA16]
    assert rig.noc.name == f"NOC {rack_slot}"


@each_of("module_type", [*range(6), 7, 8, 10, 11, 12, 14, *range(17, 22)])
def test_the_board_status_shows_each_type_of_module(module_type: int) -> None:
    assert Rig(Noc(module_type=module_type)).table()[3] >> 4 & 0xFF == module_type


@each_of("wrong", [
    {"rack_slot": -1}, {"rack_slot": 17}, {"rack_slot": 255}, {"module_type": 6}, {"module_type": 22}, {"mac": "00:11"},
    {"mac": "00:00:54:00:12:3g"},
])  # fmt: skip
def test_wrong_arguments(wrong: dict[str, int | str]) -> None:
    with pytest.raises(ValueError):
        Noc(**wrong)  # type: ignore[arg-type]


def test_a_mode_change_clears_the_words_but_not_what_the_module_knows() -> None:
    rig = Rig()
    rig.head()[noc_words.SERVICES] = 0
    rig.head()[noc_words.STATISTICS + 4] = 9
    rig.step()
    rig.memory.words("NOC")[:] = memoryview(bytes(2 * 13664)).cast("H")
    rig.step()
    assert (rig.head()[noc_words.SERVICES], rig.counter(4)) == (0, 9)
    rig.noc.reset(rig.memory)
    assert (rig.head()[noc_words.SERVICES], rig.counter(4)) == (FTP | HTTP, 0)


def test_a_plc_without_a_mailbox_leaves_it_idle() -> None:
    class Bare:
        def words(self, area: str) -> memoryview:
            raise KeyError(area)

    noc = Noc()
    assert noc.reset(Bare()) == []
    assert noc.refresh(Bare(), [Opened(0, 1, SERVER)], 0) == []


# --- connections --------------------------------------------------------------------------------------------------------


def test_connect_send_receive_close() -> None:
    rig = Rig()
    peer = ScriptedPeer([Say(b"worlds")])
    rig.network.place(SERVER, peer)
    words = slot(rig.memory, 31)
    command(words, COMMAND.connect)
    say(words, b"hello")
    states = []
    for _ in range(4):
        rig.step()
        states.append(words[LINE.state])
    assert states == [STATE.opening, STATE.open, STATE.open, STATE.open]
    assert peer.received == [b"hello"]
    assert (words[LINE.sending], heard(words)) == (0, b"worlds")
    assert words[LINE.peer_ip : LINE.peer_port + 1].tolist() == [0xC0A8, 0xFA02, 502]
    words[LINE.command] = COMMAND.close
    rig.step()
    assert (rig.requests, words[LINE.state]) == ([Close(31)], STATE.closing)
    rig.step()
    assert words[LINE.state] == STATE.closed
    assert peer.log == ["fin"]


def test_what_the_program_leaves_stays_in_the_network() -> None:
    """Room is granted as the program takes bytes away; the word's other half is kept at an odd count."""
    rig = Rig()
    data = bytes(range(256)) * 4
    rig.network.place(SERVER, ScriptedPeer(greeting=[Say(data)]))
    words = slot(rig.memory)
    command(words, COMMAND.connect)
    rig.step(5)
    assert heard(words) == data[:504]
    words[LINE.received] = 0
    rig.step(3)
    assert heard(words) == data[504:1008]
    words[LINE.received] = 3
    rig.step(3)
    assert heard(words) == data[504:507] + data[1008:]


def test_the_end_and_the_break_of_a_connection() -> None:
    rig = Rig()
    rig.network.place(SERVER, ScriptedPeer([Say(b"x"), Fin()], [Reset()]))
    words = slot(rig.memory)
    command(words, COMMAND.connect)
    say(words, b"1")
    rig.step(5)
    assert (words[LINE.state], heard(words)) == (STATE.ended, b"x")
    say(words, b"2")
    rig.step(3)
    assert (words[LINE.state], words[LINE.error]) == (STATE.failed, 0x36)
    rig.step(3)
    assert words[LINE.state] == STATE.failed
    words[LINE.command] = COMMAND.close
    rig.step(2)
    assert words[LINE.state] == STATE.closed


def test_an_open_that_fails_waits_for_the_program() -> None:
    rig = Rig()
    words = slot(rig.memory)
    command(words, COMMAND.connect)
    rig.step(3)
    assert (words[LINE.state], words[LINE.error], rig.requests) == (STATE.failed, 0x3D, [])
    words[LINE.command] = COMMAND.close
    rig.step()
    assert (words[LINE.state], rig.requests) == (STATE.closed, [])
    words[LINE.command] = COMMAND.connect
    rig.step()
    assert rig.requests == [Connect(0, SERVER)]


def test_slots_listen_at_once_and_the_first_gets_the_first_caller() -> None:
    rig = Rig()
    first, second = slot(rig.memory, 3), slot(rig.memory, 5)
    for words in (first, second):
        command(words, COMMAND.listen, Peer("0.0.0.0", 0), 502)
    rig.step()
    assert rig.requests == [Listen(3, 502), Listen(5, 502)]
    clients = [rig.network.attach(f"192.168.250.{number}") for number in (50, 51)]
    for client in clients:
        client.submit([Connect(1, OWN), Send(1, b"hi"), Grant(1, 100)], rig.now_ns)
        rig.step(3)
    assert [words[LINE.state] for words in (first, second)] == [STATE.open, STATE.open]
    assert [words[LINE.peer_ip + 1] for words in (first, second)] == [0xFA32, 0xFA33]
    first[LINE.command] = COMMAND.reset
    rig.step(2)
    assert Broken(1, "ECONNRESET") in clients[0].events(rig.now_ns)


def test_a_slot_of_another_module_is_left_alone_and_closed_when_it_changes_hands() -> None:
    rig = Rig()
    rig.network.place(SERVER, ScriptedPeer())
    words = slot(rig.memory)
    command(words, COMMAND.connect, place=8)
    rig.step(3)
    assert words[LINE.state] == STATE.closed
    words[LINE.module] = 8
    rig.step(3)
    assert words[LINE.state] == STATE.open
    words[LINE.module] = 0
    rig.step()
    assert rig.requests == [Close(0)]


def test_keep_alive_is_an_option() -> None:
    rig = Rig()
    words = slot(rig.memory)
    command(words, COMMAND.connect)
    words[LINE.keep_alive] = 1
    rig.step()
    assert rig.requests == [Connect(0, SERVER, 0, True)]


@each_of("errno", [*ERRNO, "EUNHEARDOF"])
def test_errors_by_their_numbers(errno: str) -> None:
    noc, memory = Noc(), FakeMemory()
    noc.reset(memory)
    command(slot(memory), COMMAND.connect)
    noc.refresh(memory, [], 1)
    noc.refresh(memory, [Failed(0, "open", errno)], 2)
    assert slot(memory)[LINE.error] == ERRNO.get(errno, 5)
    assert slot(memory)[LINE.state] == STATE.failed


# --- counters and restart -----------------------------------------------------------------------------------------------


def counted(*events: Event, link_up: bool = True) -> list[int]:
    """The table's counters after a connection has been asked for and these events have come."""
    noc, memory = Noc(), FakeMemory()
    noc.reset(memory)
    noc.settings = {"link_up": link_up, "configured": True}
    command(slot(memory), COMMAND.connect)
    noc.refresh(memory, [], 1)
    noc.refresh(memory, events, 2)
    first = 7 * HEAD_WORDS + noc_words.STATISTICS
    return memory.words("NOC")[first + 4 : first + 36].tolist()


@each_of(("events", "expected"), [
    ([], {}),
    ([Opened(0, 1, SERVER)], {4: 1}),
    ([Opened(0, 1, SERVER), Received(0, b"1"), Received(0, b"2"), PeerClosed(0)], {4: 4}),
    ([Failed(0, "open", "ECONNREFUSED")], {4: 1}),
    ([Failed(0, "open", "ETIMEDOUT")], {8: 1}),
    ([Opened(0, 1, SERVER), Broken(0, "ETIMEDOUT")], {4: 1, 8: 1}),
    ([Opened(0, 1, SERVER), Failed(0, "send", "ENOBUFS")], {4: 1, 26: 1}),
])  # fmt: skip
def test_what_is_counted(events: Sequence[Event], expected: dict[int, int]) -> None:
    found = counted(*events)
    assert {place: found[place - 4] for place in range(4, 36) if found[place - 4]} == {6: 1, **expected}


def test_what_goes_out_without_a_cable_is_lost_carrier() -> None:
    found = counted(link_up=False)
    assert (found[6 - 4], found[32 - 4]) == (1, 1)


def test_a_counter_goes_on_in_its_high_word_and_from_the_end_to_0() -> None:
    for before, after in (((0xFFFF, 0), [0, 1]), ((0xFFFF, 0xFFFF), [0, 0])):
        rig = Rig()
        rig.head()[noc_words.STATISTICS + 6], rig.head()[noc_words.STATISTICS + 7] = before
        command(slot(rig.memory), COMMAND.connect)
        rig.step()
        assert rig.table()[6:8] == after


def test_a_restart_breaks_connections_and_restores_the_configuration() -> None:
    rig = Rig()
    peer = ScriptedPeer()
    rig.network.place(SERVER, peer)
    words = slot(rig.memory)
    command(words, COMMAND.connect)
    rig.step(3)
    rig.head()[noc_words.SERVICES] = 0
    rig.head()[noc_words.RESTART] = 1
    rig.step()
    assert rig.requests == [Close(0, reset=True)]
    assert (rig.head()[noc_words.STATUS], rig.head()[noc_words.RESTART]) == (noc_words.RESTARTING, 0)
    assert (words[LINE.command], words[LINE.state]) == (COMMAND.close, STATE.closed)
    assert rig.head()[noc_words.SERVICES] == FTP | HTTP
    assert (rig.counter(Statistic.DRIVER_RESTARTS), rig.counter(Statistic.RECEIVER_INTERRUPTS)) == (1, 0)
    words[LINE.command] = COMMAND.connect
    rig.step(4)
    assert (rig.head()[noc_words.STATUS], words[LINE.state]) == (noc_words.RESTARTING, STATE.closed)
    words[LINE.command] = COMMAND.connect
    rig.step()
    assert rig.head()[noc_words.STATUS] == noc_words.READY
    rig.step()
    assert words[LINE.state] == STATE.open
    assert peer.log == ["ECONNRESET"]
    assert Noc().configuration["restart_ns"] == RESTART_NS


def test_a_restart_ends_at_its_time_when_nothing_else_happens() -> None:
    rig = Rig()
    rig.head()[noc_words.RESTART] = 1
    rig.step()
    assert rig.noc.wake_ns == rig.now_ns + 5 * CYCLE_NS
    rig.step(4)
    assert rig.head()[noc_words.STATUS] == noc_words.RESTARTING
    rig.step()
    assert rig.head()[noc_words.STATUS] == noc_words.READY and rig.noc.wake_ns == NEVER


@pytest.mark.slow
@settings(max_examples=times(40), deadline=None)
@given(st.lists(st.integers(0, 0xFFFF), min_size=16, max_size=16),
       st.lists(st.sampled_from([*vars(COMMAND).values()]), max_size=8))  # fmt: skip
def test_any_words_in_a_slot_are_survived(content: list[int], commands: list[int]) -> None:
    rig = Rig()
    rig.network.place(SERVER, ScriptedPeer(greeting=[Say(bytes(2000))]))
    words = slot(rig.memory)
    for number, value in enumerate(content):
        words[number] = value
    words[LINE.module] = 8
    rig.step(2)
    for wanted in commands:
        command(words, wanted, Peer(SERVER.host, content[7]), content[8] % 65536)
        words[LINE.received] = content[9]
        words[LINE.sending] = content[10]
        rig.step(2)
        assert words[LINE.state] in vars(STATE).values()


def test_what_waits_to_be_sent_ends_with_its_connection() -> None:
    """A program has put a reply down for a caller that is gone; the next one does not get it."""
    rig = Rig()
    words, caller = slot(rig.memory), rig.network.attach("192.168.250.9")
    for number in range(3):
        command(words, COMMAND.listen, Peer("0.0.0.0", 0), 502)
        rig.step(2)
        caller.submit([Connect(1, OWN), Grant(1, 100)], rig.now_ns)
        rig.step(2)
        assert words[LINE.state] == STATE.open
        events = caller.events(rig.now_ns)
        assert not any(isinstance(event, Received) for event in events), number
        caller.submit([Close(1, reset=True)], rig.now_ns)
        rig.step(number)
        say(words, b"meant for this one")
        command(words, COMMAND.close)
        rig.step(3)
        assert (words[LINE.state], words[LINE.sending]) == (STATE.closed, 0)


def test_the_errors_of_the_stack_that_both_generations_have() -> None:
    """5000h + errno, Schneider's list of TCP/IP error codes: EINVAL is 5016."""
    table = {"EINTR": "04", "EIO": "05", "ENXIO": "06", "EBADF": "09", "ENOMEM": "0C", "EACCES": "0D", "EEXIST": "11",
             "EINVAL": "16", "EPIPE": "20", "EADDRINUSE": "30", "EADDRNOTAVAIL": "31", "ENETUNREACH": "33", "ENETRESET": "34",
             "ECONNABORTED": "35", "ECONNRESET": "36", "ENOBUFS": "37", "EISCONN": "38", "ENOTCONN": "39", "ETIMEDOUT": "3C",
             "ECONNREFUSED": "3D", "EHOSTUNREACH": "41"}  # fmt: skip
    assert {name: f"{number:02X}" for name, number in ERRNO.items()} == table


@each_of("ftp, http, word", [(False, False, 0), (True, False, FTP), (False, True, HTTP), (True, True, FTP | HTTP)])
def test_the_word_of_the_services(ftp: bool, http: bool, word: int) -> None:
    noc = Noc()
    noc.ftp, noc.http = ftp, http
    assert _services(noc) == word
