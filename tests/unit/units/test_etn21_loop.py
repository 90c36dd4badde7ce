"""The ETN21 on a network in memory: whole conversations, driven by request switches alone."""

from __future__ import annotations

import pytest
from depth import times
from etn21_rig import CIO, D, Rig
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Leave, ModbusPeer, Reset, Say, ScriptedPeer
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

SERVER = Peer("192.168.250.7", 502)
ANYBODY = Peer("0.0.0.0", 0)
timings = st.sampled_from(["exact", "real"])


class Station:
    """A rig that is attached to a network."""

    def __init__(self, network: LoopNetwork, unit: Etn21 | None = None) -> None:
        self.rig = Rig(unit)
        self.network = network
        self.link = network.attach(self.rig.unit.address)

    def scan(self) -> None:
        rig = self.rig
        rig.now_ns += rig.cycle_ns
        requests = rig.unit.refresh(rig.memory, self.link.events(rig.now_ns), rig.now_ns)
        self.link.submit(requests, rig.now_ns)

    def serve(self, switch: Switch, limit: int = 200, **parameters: object) -> str:
        """Make one request and scan until its switch is OFF; gives back the response code."""
        self.rig.parameters(**parameters)  # type: ignore[arg-type]
        self.rig.turn_on(switch)
        for _ in range(limit):
            self.scan()
            if not self.rig.is_on(switch):
                return self.rig.code()
        raise AssertionError(f"{switch.name} is still ON")

    def put(self, data: bytes) -> None:
        for offset in range(0, len(data), 2):
            self.rig.d[1000 + offset // 2] = int.from_bytes(data[offset : offset + 2].ljust(2, b"\0"), "big")

    def received(self) -> bytes:
        count = self.rig.result(5)
        words = self.rig.d[1000 : 1000 + (count + 1) // 2].tolist()
        return b"".join(word.to_bytes(2, "big") for word in words)[:count]


@pytest.mark.parametrize("timing", ["exact", "real"])
def test_a_modbus_client_reads_registers(timing: str) -> None:
    network = LoopNetwork()
    peer = ModbusPeer()
    peer.server.holding_registers[0x10] = 0xCAFE
    network.place(SERVER, peer)
    client = Station(network, Etn21(timing=timing))
    assert client.serve(Switch.ACTIVE_OPEN) == "0000"
    for _ in range(8):
        client.scan()
    assert client.rig.is_open()
    client.put(bytes.fromhex("0001 0000 0006 01 03 0010 0001"))
    assert client.serve(Switch.SEND, count=12) == "0000"
    assert client.serve(Switch.RECEIVE, count=260) == "0000"
    assert client.received() == bytes.fromhex("0001 0000 0005 01 03 02 CAFE")
    assert client.serve(Switch.CLOSE) == "0000"


def test_two_units_talk_to_each_other() -> None:
    network = LoopNetwork()
    server, client = Station(network, Etn21(0, SERVER.host)), Station(network, Etn21(1, "192.168.250.1"))
    server.rig.parameters(local_port=502, remote=ANYBODY)
    server.rig.turn_on(Switch.PASSIVE_OPEN)
    server.scan()
    assert client.serve(Switch.ACTIVE_OPEN) == "0000"
    server.scan()
    assert server.rig.is_open()
    assert server.rig.result(3) == 0xFA01
    assert server.rig.result(4) == client.rig.result(1)
    client.put(b"ping")
    assert client.serve(Switch.SEND, count=4) == "0000"
    assert server.serve(Switch.RECEIVE, count=100) == "0000"
    assert server.received() == b"ping"
    assert client.serve(Switch.CLOSE) == "0000"
    server.scan()
    assert (server.rig.state(), server.rig.is_open()) == (5, True)
    assert server.serve(Switch.CLOSE) == "0000"


def test_sockets_that_wait_on_one_port_are_served_from_the_lowest_number_on_assumed() -> None:
    """Whatever their order and areas; the next caller is refused.  A socket that is closed may wait again."""
    network = LoopNetwork()
    server, client = Station(network, Etn21(0, SERVER.host)), Station(network, Etn21(1, "192.168.250.1"))
    for area, socket in ((1, 3), (2, 1), (3, 2)):
        server.rig.parameters(area, socket, local_port=502, remote=ANYBODY)
        server.rig.turn_on(Switch.PASSIVE_OPEN, area)
        server.scan()
    seen = []
    for socket in (1, 2, 3):
        client.rig.parameters(socket, socket)
        client.rig.turn_on(Switch.ACTIVE_OPEN, socket)
        for _ in range(3):
            client.scan()
            server.scan()
        seen.append([server.rig.is_open(number) for number in (1, 2, 3)])
    assert seen == [[True, False, False], [True, True, False], [True, True, True]]
    assert [server.rig.result(4, area) for area in (2, 3, 1)] == [client.rig.result(1, area) for area in (1, 2, 3)]
    client.rig.parameters(4, 4)
    client.rig.turn_on(Switch.ACTIVE_OPEN, 4)
    for _ in range(3):
        client.scan()
    assert client.rig.code(4) == "004A"


def test_004a_nobody_listens() -> None:
    assert Station(LoopNetwork()).serve(Switch.ACTIVE_OPEN) == "004A"


def test_0053_nobody_answers_assumed() -> None:
    client = Station(LoopNetwork(faults=[Fault(silent=True)]))
    client.rig.cycle_ns = 1_000_000_000
    assert client.serve(Switch.ACTIVE_OPEN) == "0053"
    assert client.rig.now_ns >= 75_000_000_000


def test_a_slow_program_closes_the_window_and_loses_nothing() -> None:
    network = LoopNetwork()
    flood = bytes(number % 251 for number in range(20_000))
    network.place(SERVER, ScriptedPeer(greeting=[Say(flood), Leave(1)]))
    client = Station(network)
    client.serve(Switch.ACTIVE_OPEN)
    for _ in range(20):
        client.scan()
    assert client.rig.waiting() == 1984
    taken = b""
    while client.serve(Switch.RECEIVE, count=1984) == "0000" and client.rig.result(5):
        taken += client.received()
    assert taken == flood
    assert client.rig.state() == 5


def test_004b_the_peer_resets() -> None:
    network = LoopNetwork()
    network.place(SERVER, ScriptedPeer([Reset()]))
    client = Station(network)
    client.serve(Switch.ACTIVE_OPEN)
    client.serve(Switch.SEND, count=2)
    assert client.serve(Switch.RECEIVE, count=10) == "004B"
    assert client.serve(Switch.SEND, count=2) == "0020"
    assert client.serve(Switch.CLOSE) == "0000"


def test_udp_between_two_units() -> None:
    network = LoopNetwork()
    one, other = Station(network, Etn21(0, SERVER.host)), Station(network, Etn21(1, "192.168.250.1"))
    assert one.serve(Switch.UDP_OPEN, local_port=3000) == "0000"
    assert other.serve(Switch.UDP_OPEN, local_port=4000) == "0000"
    one.put(b"datagram")
    assert one.serve(Switch.SEND, count=8, remote=Peer("192.168.250.1", 4000)) == "0000"
    assert other.serve(Switch.RECEIVE, count=100, timeout=10) == "0000"
    assert (other.received(), other.rig.result(4)) == (b"datagram", 3000)


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(st.binary(min_size=1, max_size=6000), st.integers(1, 1984), st.integers(1, 700), timings)
def test_the_stream_arrives_whole_however_it_is_cut(data: bytes, count: int, cut: int, timing: str) -> None:
    network = LoopNetwork(faults=[Fault(segment_bytes=cut, random_cut=True, gap_ns=1000)])
    network.place(SERVER, ScriptedPeer(greeting=[Say(data), Leave()]))
    client = Station(network, Etn21(timing=timing, seed=cut))
    client.serve(Switch.ACTIVE_OPEN)
    for _ in range(8):
        client.scan()
    taken = b""
    while True:
        assert client.serve(Switch.RECEIVE, count=count) == "0000"
        if not client.rig.result(5):
            break
        taken += client.received()
    assert taken == data


turns = st.tuples(
    st.integers(1, 8),
    st.sampled_from(Switch),
    st.fixed_dictionaries(
        {
            "socket": st.integers(1, 3),
            "option": st.integers(0, 3),
            "local_port": st.sampled_from([0, 502, 3000]),
            "remote": st.sampled_from([ANYBODY, SERVER, Peer("192.168.250.1", 3000)]),
            "count": st.sampled_from([0, 1, 12, 1984]),
            "address": st.sampled_from([(D, 1000, 0), (CIO, 100, 0)]),
            "timeout": st.sampled_from([0, 1]),
        }
    ),
)


@pytest.mark.slow
@settings(max_examples=times(100), deadline=None)
@given(st.lists(st.lists(turns, max_size=3), max_size=30), timings, st.sampled_from([10, 90]))
def test_any_program_on_a_network_opens_a_channel_only_when_it_is_free(
    script: list[list[tuple[int, Switch, dict[str, object]]]], timing: str, cycle_ms: int
) -> None:
    """The network raises ValueError if a channel in use is opened once more."""
    network = LoopNetwork()
    network.place(SERVER, ModbusPeer())
    station = Station(network, Etn21(timing=timing))
    station.rig.cycle_ns = cycle_ms * 1_000_000
    for program in script:
        for area, switch, parameters in program:
            station.rig.parameters(area, **parameters)  # type: ignore[arg-type]
            station.rig.turn_on(switch, area)
        station.scan()
    station.rig.cio[1500] |= 4
    for _ in range(40):
        station.scan()
    assert station.rig.cio[1500:1524].tolist() == [*[0] * 17, 1 << 14, *[0] * 6]
