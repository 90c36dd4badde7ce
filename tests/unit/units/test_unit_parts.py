"""Parts of units alone: settings and state of FINS, commands for the unit, faults, data areas, lines of a mailbox."""

from __future__ import annotations

from array import array
from types import SimpleNamespace
from typing import Any

import pytest
import test_noc as noc
from common_unit_tests import FakeMemory
from fins_rig import FinsRig, TcpClient
from rows import each_of
from test_fins_connections import ClientRig
from test_noc import COMMAND as LINE_COMMAND
from test_noc import LINE, STATE, ScriptedPeer

from fbvm.base.areas import NEVER
from fbvm.units.etn21 import data
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.faults import Fault
from fbvm.units.etn21.fins.service import FinsService
from fbvm.units.etn21.fins.state import (
    BEFORE_CLIENTS,
    TCP_CHANNELS,
    UDP_CHANNEL,
    Connection,
    FinsSettings,
    FinsState,
    endpoints_of,
)
from fbvm.units.etn21.fins.unit_commands import Asked, execute
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import Address, Command, Header
from fbvm.wire.fins.tcp import Kind, Message
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
)

UNIT = "192.168.250.3"
SERVER = Peer("192.168.250.26", 9600)

# --- FINS: settings and state -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("given", "said"), [
    ({"port": 65_536}, "port 65536"), ({"port": 0}, "port 0"), ({"node": 255}, "node 255"), ({"node": -1}, "node -1"),
    ({"nodes": {0: SERVER}}, "node 0"), ({"nodes": {255: SERVER}}, "node 255"), ({"clients": {0: SERVER}}, "connection 0"),
    ({"clients": {17: SERVER}}, "connection 17"), ({"clients": {1: Peer(UNIT, 9601)}}, "leads to the unit itself"),
])  # fmt: skip
def test_settings_out_of_their_ranges_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        FinsSettings(UNIT, **given)


def test_settings_at_the_ends_of_their_ranges_are_taken() -> None:
    for port in (1, 65_535):
        assert FinsSettings(UNIT, port=port).port == port
    for node in (1, 254):
        made = FinsSettings(UNIT, node=node, nodes={node: SERVER})
        assert (made.own_node, made.disagrees) == (node, False)
    assert {*FinsSettings(UNIT, clients={1: SERVER, 16: SERVER}).clients} == {1, 16}


@pytest.mark.parametrize(("node", "nodes", "own", "disagrees"), [
    (None, {}, 3, False), (3, {}, 3, False), (0, {}, 3, False), (7, {}, 7, True), (7, {9: SERVER}, 7, False),
])  # fmt: skip
def test_a_node_disagrees_with_the_address_if_no_table_says_why(
    node: int | None, nodes: dict[int, Peer], own: int, disagrees: bool
) -> None:
    made = FinsSettings(UNIT, node=node, nodes=nodes)
    assert (made.own_node, made.disagrees, made.host_part) == (own, disagrees, 3)


def test_endpoints_as_projects_write_them() -> None:
    assert endpoints_of({"2": "10.0.0.2", "30": "10.255.0.255:1", "4": "0.0.0.4:65535"}) == {
        2: Peer("10.0.0.2", 9600), 30: Peer("10.255.0.255", 1), 4: Peer("0.0.0.4", 65_535)}


@pytest.mark.parametrize("written", [
    {"x": "10.0.0.2"}, {"2": "10.0.0"}, {"2": "10.0.0.2.3"}, {"2": "10.0.0.256"}, {"2": "10.0.0.2:0"}, {"2": "10.0.0.2:65536"},
    {"2": "10.0.0.2:y"}, {"2": "10.0.0.z"},
])  # fmt: skip
def test_what_is_no_endpoint_is_refused(written: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="is no node with its address"):
        endpoints_of(written)


def test_the_state_of_the_service_is_the_same_behind_its_plain_values() -> None:
    state = FinsState(
        {1, 5}, {5}, {6}, True, {3: Connection(2, 9600, SERVER, True, 40, 26, b"FI")}, {7: SERVER}, [Received(1, b"x")],
        [Send(3, b"a"), SendTo(1, SERVER, b"b")], 8, 9, {4: SERVER}, {4: 77}, {2: SERVER})  # fmt: skip
    assert FinsState.of(state.plain) == state


# --- FINS: commands for the unit --------------------------------------------------------------------------------------


def done(code: int, parameters: str = "", state: FinsState | None = None, **settings: Any) -> tuple[int, str]:
    made = Asked(FinsSettings(UNIT, **settings), state or FinsState(), 0xFFFF, bytes.fromhex(parameters))
    end_code, answer = execute(code, made)
    return end_code, answer.hex(" ")


def test_packets_are_counted_up_to_what_four_bytes_hold() -> None:
    most, state = "ff ff ff ff", FinsState(received=(1 << 32) + 5, sent=(1 << 32) - 1)
    nothing = "00 00 00 00"
    assert done(0x0601, state=state) == (0, f"c1 de {most} {nothing} {most} {nothing} {nothing}")


@pytest.mark.parametrize(("code", "parameters", "end_code"), [
    (0x0501, "00", 0x1001), (0x2102, "0000 00", 0x1002), (0x2102, "0000 0000 00", 0x1001), (0x2102, "0040 0001", 0x1103),
    (0x2102, "003f 0001", 0), (0x2102, "0000 0000", 0x110C), (0x2730, "0000 0a000001 2580", 0x1100),
    (0x2730, "0011 0a000001 2580", 0x1100), (0x2730, "0001 00000000 2580", 0x1100), (0x2730, "0001 0a000001 0000", 0x1100),
    (0x2731, "0000", 0x1100), (0x2731, "0011", 0x1100), (0x2731, "0010", 0), (0x2765, "", 0),
])  # fmt: skip
def test_parameters_of_commands_for_the_unit(code: int, parameters: str, end_code: int) -> None:
    assert f"{done(code, parameters, clients={1: SERVER})[0]:04X}" == f"{end_code:04X}"


def test_another_server_is_taken_for_a_connection_that_is_a_client_and_leads_elsewhere() -> None:
    other, connected = "0002 c0a8fa1a 2580", FinsState(connections={9: Connection(1, 9600, SERVER, True, 0, 26)})
    state = FinsState()
    assert done(0x2730, "0001 0a000001 0fa1", state, clients={1: SERVER}) == (0, "")
    assert state.changed_servers == {1: Peer("10.0.0.1", 0x0FA1)}
    assert done(0x2730, other, connected, clients={1: SERVER, 2: Peer("10.0.0.9", 9600)})[0] != 0, "it leads there already"
    assert done(0x2730, other, FinsState(), clients={2: Peer("10.0.0.9", 9600)})[0] == 0
    assert done(0x2730, other, FinsState(), clients={1: SERVER})[0] != 0, "connection 2 waits for clients"


# --- FINS: the service ------------------------------------------------------------------------------------------------

CHANNEL = TCP_CHANNELS[0]
S = 1_000_000_000


class Service(FinsService):
    """A service that is told events one servicing after another, without a CPU unit."""

    def told(self, *events: Event, now_ns: int = 0) -> list[Request]:
        assert self.take(events) == []
        return self.serve(None, now_ns)  # type: ignore[arg-type]


def begun(**settings: Any) -> Service:
    """A service whose channels are open."""
    made = Service(FinsSettings(UNIT, **settings))
    made.told()
    made.told(Opened(UDP_CHANNEL, 9600, Peer("0.0.0.0", 0)))
    return made


def test_a_service_opens_its_channels_once() -> None:
    made = Service(FinsSettings(UNIT, clients={3: SERVER}))
    requests = made.told()
    assert [type(request).__name__ for request in requests] == ["Bind", *["Listen"] * len(TCP_CHANNELS), "Connect"]
    assert requests[-1].remote == SERVER and made.told() == []  # type: ignore[union-attr]


def test_a_channel_that_cannot_be_opened_stays_shut_and_one_that_was_closed_is_opened_again() -> None:
    made = begun()
    assert made.told(Failed(CHANNEL, "open", "EADDRINUSE")) == [] and made.state.failed == {CHANNEL}
    assert made.told(Closed(CHANNEL + 1)) == [Listen(CHANNEL + 1, 9600)]


def test_a_client_whose_server_refuses_tries_again_three_seconds_later() -> None:
    made = begun(clients={3: SERVER})
    channel = BEFORE_CLIENTS + 3
    assert made.told(Failed(channel, "open", "ECONNREFUSED"), now_ns=S) == [] and made.wake_ns == 4 * S
    assert made.told(now_ns=4 * S - 1) == [] and made.told(now_ns=4 * S) == [Connect(channel, SERVER)]


def test_a_service_wakes_for_what_waits_and_for_those_who_owe_something() -> None:
    made = begun()
    assert made.wake_ns == NEVER
    made.told(Opened(CHANNEL, 9600, SERVER), now_ns=5)
    assert made.wake_ns == 5 + 10 * S, "the client owes its node"
    made.told(Received(CHANNEL, b"F"), now_ns=6)
    assert made.wake_ns == 5 + 10 * S, "a part of it is not its node"
    made.told(Received(CHANNEL, tcp.client_node(26).to_bytes()[1:]), now_ns=7)
    assert made.wake_ns == NEVER and made.connection_bits == 1
    made.told(Received(CHANNEL, b"FI"), now_ns=9)
    assert made.wake_ns == 9 + 10 * S, "the rest of a message"
    made.told(Received(CHANNEL, b"N"), now_ns=11)
    assert made.wake_ns == 9 + 10 * S, "a part of it is not the rest"
    assert made.told(now_ns=9 + 10 * S) == [Close(CHANNEL, True)] and made.connection_bits == 0
    made.take([Closed(CHANNEL)])
    assert made.wake_ns == 0


@pytest.mark.parametrize(("event", "reset"), [(PeerClosed(CHANNEL), False), (Broken(CHANNEL, "ECONNRESET"), False),
                                              (Failed(CHANNEL, "send", "ENOBUFS"), True)])  # fmt: skip
def test_a_connection_that_has_ended_or_fails_is_closed(event: Event, reset: bool) -> None:
    made = begun()
    made.told(Opened(CHANNEL, 9600, SERVER))
    assert made.told(event) == [Close(CHANNEL, reset)] and made.state.connections == {}
    assert made.told(event) == [], "once"


COMMAND = Command(Header(Address(0, 26), Address(0, 3), 9), 0x0101, bytes.fromhex("82 0064 00 0001"))


def test_a_command_goes_over_the_connection_of_its_node_and_by_udp_to_others() -> None:
    made, data = begun(), COMMAND.to_bytes()
    assert made.send(COMMAND) == 0 and made.wake_ns == 0
    assert made.told() == [SendTo(UDP_CHANNEL, Peer("192.168.250.26", 9600), data)] and made.state.sent == 1
    made.told(Opened(CHANNEL, 9600, SERVER), Received(CHANNEL, tcp.client_node(26).to_bytes()))
    assert made.send(COMMAND) == 0
    assert made.told() == [Send(CHANNEL, Message(Kind.FRAME, data).to_bytes())]
    made.send(COMMAND)
    assert made.told(PeerClosed(CHANNEL)) == [Close(CHANNEL, False)], "what was for a connection that has ended is lost"


def test_commands_wait_for_the_port_and_are_refused_without_one() -> None:
    made = Service(FinsSettings(UNIT))
    made.told()
    assert made.send(COMMAND) == 0 and made.told() == []
    assert [type(request) for request in made.told(Opened(UDP_CHANNEL, 9600, Peer("0.0.0.0", 0)))] == [SendTo]
    shut = Service(FinsSettings(UNIT))
    shut.told()
    shut.send(COMMAND)
    assert shut.told(Failed(UDP_CHANNEL, "open", "EADDRINUSE")) == [] and shut.state.outgoing == []
    assert shut.send(COMMAND) == 0x0101


def test_a_restart_breaks_everything_off_but_what_closes_already() -> None:
    made = begun()
    made.told(Opened(CHANNEL, 9600, SERVER), Opened(CHANNEL + 1, 9600, SERVER))
    assert made.told(PeerClosed(CHANNEL)) == [Close(CHANNEL, False)]
    made.take([Closed(CHANNEL + 2), Failed(CHANNEL + 3, "open", "EIO")])
    closed = [request.channel for request in made.reset() if isinstance(request, Close) and request.reset]
    assert closed == [channel for channel in (UDP_CHANNEL, *TCP_CHANNELS) if channel not in (CHANNEL, CHANNEL + 2, CHANNEL + 3)]
    assert made.state.received == 0 and not made.state.udp_open and made.state.closing == made.state.busy
    assert {request.channel for request in made.told()} == {CHANNEL + 2, CHANNEL + 3}, "those are opened again"


def test_events_of_others_are_given_back_and_all_that_came_is_counted() -> None:
    made = begun()
    mine, other = Received(UDP_CHANNEL, b"x", SERVER), Received(500, b"y")
    assert made.take([mine, other, Closed(501)]) == [other, Closed(501)]
    assert made.state.received == 2 and made.state.events == [mine]


def test_a_unit_without_fins_has_a_node_and_sends_nothing() -> None:
    plain, unit = Etn21(5, "192.168.250.77"), Etn21(0, "192.168.250.77", fins=True, fins_node=9)
    assert (plain.has_fins, plain.node, plain.unit_number) == (False, 77, 5) and (unit.has_fins, unit.node) == (True, 9)
    assert plain.send(COMMAND) == 0x0101 and plain.execute(COMMAND, None)[1] == b""  # type: ignore[arg-type]
    assert plain.serve(None, 0) == [] and unit.send(COMMAND) == 0  # type: ignore[arg-type]


# --- FINS over connections --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_server_may_have_node_1() -> None:
    rig = ClientRig(fins_node=7, fins_nodes={"30": "192.168.250.30"})
    rig.plc.run(for_ns=4_000_000_000)
    rig.server.scan(4)
    rig.server.say(tcp.server_node(7, 1))
    assert rig.plc.read("CIO 1523") == 1 << 2 and not rig.server.ended


@pytest.mark.slow
def test_who_begins_another_message_has_ten_seconds_for_it_again() -> None:
    rig = FinsRig()
    client = TcpClient(rig)
    client.connect()
    whole = Message(Kind.FRAME, bytes.fromhex("80 00 02 00 01 00 00 EF 00 09 01 01 82 00 64 00 00 01")).to_bytes()
    client.say(whole[:5])
    rig.plc.run(for_ns=8_000_000_000)
    client.say(whole[5:] + whole[:5])
    rig.plc.run(for_ns=8_000_000_000)
    assert client.hear() and not client.ended, "the second message was begun 8 seconds ago"
    rig.plc.run(for_ns=3_000_000_000)
    client.hear()
    assert client.ended


# --- faults and data of an ETN21 --------------------------------------------------------------------------------------


def test_faults_are_a_list_of_codes_with_what_they_fit() -> None:
    unit = Etn21(0)
    faults, first, second = unit.faults, Fault(0, Switch.SEND, 3), Fault(0xFFFF)
    before = unit.times_set
    faults.append(first)
    faults.insert(0, second)
    assert unit.times_set == before + 2
    assert list(faults) == [second, first] and len(faults) == 2 and faults[1] == first and faults[:1] == [second]
    faults[0] = Fault(5, Switch.UDP_OPEN)
    assert faults == [Fault(5, Switch.UDP_OPEN), first] and "code=5" in repr(faults)
    del faults[0]
    assert faults == [first]
    unit.faults = [second]
    assert unit.faults == [second]
    for code in (-1, 0x10000):
        with pytest.raises(ValueError, match=f"response code {code} is not"):
            faults.append(Fault(code))
    faults[:] = [first] * 255
    with pytest.raises(ValueError, match="room for 255 faults; 256 were given"):
        faults.append(first)


def test_what_may_be_set_on_a_unit_is_plain_and_makes_another_one_alike() -> None:
    unit, other = Etn21(0), Etn21(0)
    assert (unit.link_up, unit.error_status, unit.settings["faults"]) == (True, 0, [])
    before = unit.times_set
    unit.link_up, unit.error_status = False, 0x8000
    unit.faults = [Fault(3, Switch.SEND, 2), Fault(4)]
    assert unit.times_set == before + 3
    other.settings = unit.settings
    assert other.settings == unit.settings == {
        "faults": [[3, Switch.SEND, 2], [4, None, None]], "link_up": False, "error_status": 0x8000}
    assert list(other.faults) == list(unit.faults) and Etn21(**unit.configuration).configuration == unit.configuration
    other.link_up = True
    assert other.link_up and not unit.link_up


class Areas:
    """Memory areas with so many words."""

    def __init__(self, **words: int) -> None:
        self.held = {name: array("H", range(count)) if count <= 0x10000 else array("H", bytes(2 * count))
                     for name, count in words.items()}  # fmt: skip

    def words(self, area: str) -> memoryview:
        return memoryview(self.held[area])


def test_a_data_address_reaches_the_words_that_an_area_has() -> None:
    found = data.lengths(Areas(CIO=6144, D=32768, E0=40_000, E2=100, H=1536))  # type: ignore[arg-type]
    assert found == {0xB0: 6144, 0x82: 32768, 0x98: 32768, 0xA0: 32768, 0xA2: 100, 0xB2: 512}


def test_bytes_come_from_and_go_to_the_words_of_a_data_address() -> None:
    memory = Areas(D=1000, CIO=10)
    assert data.fetch(memory, 0x8201, 0x0200, 5) == bytes.fromhex("01 02 01 03 01")  # type: ignore[arg-type]
    assert data.fetch(memory, 0xB000, 0x0300, 2) == bytes.fromhex("00 03")  # type: ignore[arg-type]
    data.store(memory, 0x8200, 0x0500, b"\x11\x22\x33", 0xEE)  # type: ignore[arg-type]
    assert list(memory.held["D"][4:8]) == [4, 0x1122, 0x33EE, 7]
    memory.held["D"][6] = 0xABCD
    data.store(memory, 0x8200, 0x0500, b"\x44\x55\x66", None)  # type: ignore[arg-type]
    assert list(memory.held["D"][4:8]) == [4, 0x4455, 0x66CD, 7]


@pytest.mark.parametrize("bit", [2, 3, 4, 5, 6, 11, 12, 13, 14, 15])
def test_each_error_of_n_18_has_a_name_of_its_own(bit: int) -> None:
    """W420 4-1 p84."""
    names = Etn21(0).descriptions
    own = names[f"CIO 1518.{bit:02}"]
    assert own and [address for address, name in names.items() if name == own] == [f"CIO 1518.{bit:02}"]
    assert f"CIO 1518.{bit + 1:02}" in names or bit in (6, 15)


# --- lines of a mailbox -----------------------------------------------------------------------------------------------


def test_a_line_that_closes_shows_nothing_to_send_and_hears_nothing_until_that_is_confirmed() -> None:
    rig = noc.Rig()
    rig.network.place(noc.SERVER, ScriptedPeer())
    words, line = noc.slot(rig.memory), rig.noc._port._lines[0]
    noc.command(words, LINE_COMMAND.connect)
    rig.step(3)
    noc.say(words, b"late")
    words[LINE.command] = LINE_COMMAND.close
    assert line.exchange(words, True) == [Close(0)] and not line.is_idle
    assert (words[LINE.state], words[LINE.sending]) == (STATE.closing, 0)
    for event in (Opened(0, 1, Peer("10.0.0.1", 1)), Received(0, b"old"), Failed(0, "open", "EIO"), Broken(0, "ECONNRESET")):
        line.take(event, words)
    assert (words[LINE.state], words[LINE.error], words[LINE.received]) == (STATE.closing, 0, 0)
    assert line.exchange(words, True) == [] and words[LINE.state] == STATE.closing
    line.take(Closed(0), words)
    words[LINE.sending] = 4
    assert line.is_idle and line.exchange(words, True) == [] and (words[LINE.state], words[LINE.sending]) == (STATE.closed, 0)
    line.take(Closed(0), words)
    noc.command(words, LINE_COMMAND.connect)
    assert [type(request) for request in line.exchange(words, True)] == [Connect], "a confirmation too many changes nothing"
    line.take(Opened(0, 9, noc.SERVER), words)
    assert words[LINE.state] == STATE.open
    words[LINE.command] = LINE_COMMAND.close
    line.exchange(words, True)
    line.take(Closed(0), words)
    assert line.is_idle


def test_a_line_that_is_not_the_unit_s_any_more_is_closed_and_its_words_are_left() -> None:
    rig = noc.Rig()
    rig.network.place(noc.SERVER, ScriptedPeer())
    words, line = noc.slot(rig.memory), rig.noc._port._lines[0]
    noc.command(words, LINE_COMMAND.connect)
    rig.step(3)
    assert line.exchange(words, False) == [Close(0)]
    line.take(Closed(0), words)
    words[LINE.state], words[LINE.sending] = STATE.open, 5
    assert line.exchange(words, False) == [] and (words[LINE.state], words[LINE.sending]) == (STATE.open, 5)


@pytest.mark.parametrize(("peer", "remote", "shown"), [
    ((0xC0A8, 0xFA02, 502), (0, 0, 0), "192.168.250.2:502"), ((0, 2, 0), (1, 1, 1), "0.0.0.2:0"),
    ((0x0A00, 0, 0), (1, 1, 1), "10.0.0.0:0"),
    ((0, 0, 7), (1, 1, 1), "0.0.0.0:7"), ((0, 0, 0), (0x0A00, 3, 44), "10.0.0.3:44"), ((0, 0, 0), (0, 0, 5), "0.0.0.0:5"),
    ((0, 0, 0), (0, 0, 0), ""),
])  # fmt: skip
def test_people_see_the_peer_of_a_line_or_whom_it_is_to_reach(
    peer: tuple[int, ...], remote: tuple[int, ...], shown: str
) -> None:
    rig = noc.Rig()
    words = noc.slot(rig.memory, 2)
    words[LINE.module], words[LINE.state], words[LINE.error], words[LINE.received] = 8, STATE.failed, 0x36, 3
    for first, values in ((LINE.peer_ip, peer[:2]), (LINE.remote_ip, remote[:2])):
        words[first], words[first + 1] = values
    words[LINE.peer_port], words[LINE.remote_port] = peer[2], remote[2]
    [socket] = rig.noc.front(rig.memory).sockets
    assert (socket.name, socket.state, socket.peer, socket.result) == ("line 2", "FAILED", shown, "ECONNRESET")
    words[LINE.error], words[LINE.state] = 0x99, 77
    [socket] = rig.noc.front(rig.memory).sockets
    assert (socket.state, socket.result) == ("77", "16#99")


def test_lamps_and_counters_of_a_module_are_read_from_its_head() -> None:
    rig = noc.Rig()
    rig.step()
    front = rig.noc.front(rig.memory)
    assert [(lamp.name, lamp.is_on) for lamp in front.lamps] == [("RUN", True), ("LINK", True), ("100 MB", True)]
    rig.noc.link_up = rig.noc.configured = False
    rig.step()
    front = rig.noc.front(rig.memory)
    assert [(lamp.name, lamp.said) for lamp in front.lamps] == [("RUN", "off"), ("LINK", "off"), ("100 MB", "on")]
    assert ("sent", "0") in front.settings and ("slot", "7") in front.settings


N, M = 1500, 30_000


@pytest.mark.slow
@each_of(("area", "word", "value", "left"), [
    ("CIO", 0, 0, None), ("A", at.RESTART, 1, 0), ("A", at.INITIALIZING, 1, 0), ("CIO", N + 5, 7, 0),
    ("CIO", N + at.SWITCHES, 8, 0), ("CIO", N, at.FORCE_CLOSE, 0), ("CIO", N + at.SERVICE_STATUS, 9, 0x4000), ("D", M + 1, 5, 0),
    ("D", M, 5, None), ("D", M + at.PARAMETERS, 3, None), ("A", at.RESTART, 2, None), ("A", at.INITIALIZING, 2, None),
])  # fmt: skip
def test_at_power_on_a_word_that_was_left_is_cleared(area: str, word: int, value: int, left: int | None) -> None:
    """Only a unit that finds something to clear is switched on for it; words of the user, and bits of others, stay."""
    unit, memory = Etn21(), FakeMemory()
    memory.words(area)[word] = value
    assert unit.reset(memory) == []
    is_on = unit.exchanged is not None
    assert (memory.words(area)[word], is_on, unit.changed_words) == (value if left is None else left, left is not None, is_on)
    assert memory.words("CIO")[N + at.SERVICE_STATUS] == 0x4000


def test_a_restart_that_the_own_program_commands_is_asked_for_until_it_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = [0]
    monkeypatch.setattr("fbvm.units.etn21.fins.service.routing", SimpleNamespace(
        refusal=lambda settings, command, size: refused[0], execute=lambda *given: (len(given), b"x"),
        restarts=lambda command, end_code: command.code == 0x0403))  # fmt: skip
    service: Any = object.__new__(FinsService)
    service.settings = service.state = None
    service.error_status, service.asks_restart = 0, False
    told = []
    for code, refusal in ((0x0501, 0), (0x0403, 0x1001), (0x0403, 0), (0x0501, 0)):
        refused[0] = refusal
        answer = service.execute(SimpleNamespace(code=code, to_bytes=lambda: b"12"), None)
        told.append((answer, service.asks_restart))
    assert told == [((5, b"x"), False), ((0x1001, b""), False), ((5, b"x"), True), ((5, b"x"), True)]
