"""FINS/TCP connections of which the unit is the client: their nodes, what goes over them, loss, and another server by 2730."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import pytest
from fins_rig import UNIT, FinsRig, compiled

from fbvm import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import Address, Command, Header
from fbvm.wire.fins.tcp import Kind, Message, client_node
from fbvm.wire.link import Broken, Close, Closed, Event, Grant, Listen, Opened, Peer, PeerClosed, Received, Send

SERVER = "192.168.250.26"
READ = Command(Header(Address(0, 26), Address(0, 0), 9), 0x0101, bytes.fromhex("82 0064 00 0001"))


class Server:
    """What a unit meets at an address: something that waits for one connection at a time and says bytes."""

    def __init__(self, network: LoopNetwork, plc: Plc, address: str, port: int = 9600) -> None:
        self.plc, self.port = plc, port
        self.link = network.attach(address)
        self.callers: list[Peer] = []
        self.ended: list[Event] = []
        self.wait()

    def wait(self) -> None:
        """Takes the next caller."""
        self.link.submit([Listen(1, self.port), Grant(1, 65_536)], self.plc.now_ns)

    def hear(self) -> bytes:
        """What has come since the last call."""
        came = b""
        for event in self.link.events(self.plc.now_ns):
            if isinstance(event, Received):
                came += event.data
            elif isinstance(event, Opened):
                self.callers.append(event.remote)
            elif isinstance(event, PeerClosed | Broken):
                self.ended.append(event)
                self.link.submit([Close(1)], self.plc.now_ns)
            elif isinstance(event, Closed):
                self.wait()
        return came

    def scan(self, scans: int = 3) -> bytes:
        """What comes within some scans of the PLC."""
        came = b""
        for _ in range(scans):
            self.plc.scan()
            came += self.hear()
        return came

    def say(self, *messages: Message) -> bytes:
        """Says messages, and returns what the unit answers."""
        self.link.submit([Send(1, message.to_bytes()) for message in messages], self.plc.now_ns)
        return self.scan()

    def leave(self, reset: bool = False) -> None:
        self.link.submit([Close(1, reset)], self.plc.now_ns)


class ClientRig(FinsRig):
    """A PLC whose connection 3 leads to node 26, and the server there, which has not agreed on nodes yet."""

    def __init__(self, **fins: object) -> None:
        super().__init__(plc=compiled(), fins_clients={"3": SERVER}, **fins)
        self.server = Server(self.network, self.plc, SERVER)

    def agree(self) -> None:
        """The server agrees on nodes."""
        self.plc.run(for_ns=4_000_000_000)
        assert self.server.scan(4) == client_node(1).to_bytes()
        assert self.server.say(tcp.server_node(1, 26)) == b""


@pytest.fixture
def rig() -> ClientRig:
    return ClientRig()


def test_the_client_says_its_node_and_its_bit_is_on_when_the_server_has_said_its_own(rig: ClientRig) -> None:
    rig.plc.run(for_ns=4_000_000_000)
    assert rig.server.scan() == client_node(1).to_bytes()
    assert rig.plc.read("CIO 1523") == 0
    rig.server.say(tcp.server_node(1, 26))
    assert rig.plc.read("CIO 1523") == 1 << 2


def test_commands_for_the_node_go_over_the_connection_and_its_responses_come_over_it(rig: ClientRig) -> None:
    rig.agree()
    assert rig.unit.send(READ) == 0
    sent = rig.server.scan()
    assert sent[:16] == bytes.fromhex("46494E53 0000001A 00000002 00000000")
    assert sent[16:].hex(" ") == "80 00 02 00 1a 00 00 01 00 09 01 01 82 00 64 00 00 01"
    assert rig.datagrams() == []


def test_a_command_for_a_node_without_a_connection_goes_by_udp() -> None:
    rig = ClientRig(fins_nodes={"26": f"{UNIT}:5001"})
    assert rig.unit.send(READ) == 0
    taken: list[Peer] = []
    rig.network.tap = lambda now_ns, unit, event: taken.append(event.remote)
    rig.plc.scan()
    assert taken[-1] == Peer(UNIT, 5001)


def test_the_server_may_ask_over_the_connection_too(rig: ClientRig) -> None:
    rig.agree()
    rig.plc.write("D100", 0x4321)
    asked = Message(Kind.FRAME, bytes.fromhex("80 00 02 00 01 00 00 1A 00 07 01 01 82 00 64 00 00 01"))
    assert rig.server.say(asked)[16:].hex(" ") == "c0 00 02 00 1a 00 00 01 00 07 01 01 00 00 43 21"


def test_a_confirmation_is_thrown_away(rig: ClientRig) -> None:
    rig.agree()
    assert rig.server.say(Message(Kind.CONFIRMATION)) == b""
    assert rig.plc.read("CIO 1523") == 4


@pytest.mark.parametrize("said", [
    tcp.server_node(0, 0, tcp.Error.NODE_CONNECTED), tcp.server_node(1, 1), tcp.server_node(1, 0), tcp.server_node(1, 255),
    Message(Kind.SERVER_NODE, bytes(4)), Message(Kind.ERROR, b"", 3),
])  # fmt: skip
@pytest.mark.slow
def test_a_server_without_a_good_answer_is_left_and_asked_again_seconds_later(rig: ClientRig, said: Message) -> None:
    rig.plc.run(for_ns=4_000_000_000)
    rig.server.scan()
    assert rig.server.say(said) == b""
    assert rig.server.ended
    assert rig.plc.read("CIO 1523") == 0
    rig.plc.run(for_ns=1_000_000_000)
    assert rig.server.scan() == b""
    rig.plc.run(for_ns=2_500_000_000)
    assert rig.server.scan() == client_node(1).to_bytes()


@pytest.mark.parametrize("said", [
    client_node(7), tcp.server_node(1, 26), Message(4), Message(Kind.FRAME, bytes(11))])  # fmt: skip
@pytest.mark.slow
def test_what_a_server_must_not_say_is_answered_by_a_notification(rig: ClientRig, said: Message) -> None:
    rig.agree()
    answer = rig.server.say(said)
    assert answer[:12] == bytes.fromhex("46494E53 00000008 00000003")
    assert rig.server.ended


@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.slow
def test_a_lost_connection_is_opened_again_for_ever(rig: ClientRig, reset: bool) -> None:
    rig.agree()
    for _ in range(3):
        rig.server.leave(reset)
        rig.server.scan()
        assert rig.plc.read("CIO 1523") == 0
        rig.plc.run(for_ns=3_500_000_000)
        assert rig.server.scan() == client_node(1).to_bytes()
        rig.server.say(tcp.server_node(1, 26))
        assert rig.plc.read("CIO 1523") == 4
    assert len(rig.server.callers) == 4


@pytest.mark.slow
def test_a_server_that_says_nothing_is_left_after_ten_seconds(rig: ClientRig) -> None:
    rig.plc.run(for_ns=4_000_000_000)
    rig.server.scan()
    rig.plc.run(for_ns=11_000_000_000)
    rig.server.hear()
    assert rig.server.ended


def test_numbers_of_clients_are_not_given_to_callers(rig: ClientRig) -> None:
    assert rig.command(0x2731, "0003", unit=0x10)[1].startswith("00 03 00 04 C0 A8 FA 01")
    service = FinsRig(fins_clients={str(number): f"192.168.250.{100 + number}" for number in range(1, 17)}).unit
    assert service.configuration["fins_clients"]["16"] == "192.168.250.116"


def test_2731_shows_a_client(rig: ClientRig) -> None:
    """Number, service 4, own endpoint, server's, TCP state: CLOSED until it is tried again, then ESTABLISHED."""
    assert rig.command(0x2731, "0003", unit=0x10)[1] == "00 03 00 04 C0 A8 FA 01 00 00 00 00 00 00 00 00 00 00 00 00"
    rig.agree()
    status = rig.command(0x2731, "0003", unit=0x10)[1]
    assert status[:23] == "00 03 00 04 C0 A8 FA 01"
    assert status[30:] == "C0 A8 FA 1A 25 80 00 00 00 04"


@pytest.mark.slow
def test_2730_leads_a_client_to_another_server_until_the_unit_restarts(rig: ClientRig) -> None:
    rig.agree()
    other = Server(rig.network, rig.plc, "192.168.250.27", 9700)
    assert rig.command(0x2730, "0003 C0A8FA1A 2580", unit=0x10) == ("2230", "")
    assert rig.command(0x2730, "0003 C0A8FA1B 25E4", unit=0x10) == ("0000", "")
    came = other.scan(6)
    rig.server.scan()
    assert rig.server.ended
    assert came == client_node(1).to_bytes()
    other.say(tcp.server_node(1, 27))
    assert rig.plc.read("CIO 1523") == 4
    rig.plc.write("A501.00", True)
    rig.plc.run(for_ns=1_000_000_000)
    other.hear()
    assert other.ended
    assert rig.server.scan() == client_node(1).to_bytes()


@pytest.mark.slow
def test_a_copy_of_the_plc_goes_on_with_its_connections(rig: ClientRig) -> None:
    rig.agree()
    copy = deepcopy(rig.unit)
    assert copy.state == rig.unit.state


@pytest.mark.parametrize("clients", [{"0": SERVER}, {"17": SERVER}, {"x": SERVER}, {"1": "plc"}, {"1": UNIT}])
def test_settings_that_cannot_be(clients: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="FINS/TCP connection"):
        Etn21(0, UNIT, fins=True, fins_clients=clients)


@pytest.mark.parametrize("given", [{"fins_clients": {"1": "192.168.250.2"}}, {"fins_permitted": ["192.168.250.2"]},
                                   {"fins_nodes": {"2": "192.168.250.2"}}, {"fins_error_flags": True}])  # fmt: skip
def test_settings_of_fins_are_refused_where_there_is_none(given: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="are settings of FINS; write fins = true, too"):
        Etn21(0, UNIT, **given)
