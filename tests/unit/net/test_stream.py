"""The ends of a connection in memory: when each is over, and how much a relay takes of one."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import pytest
from rows import each_of

from fbvm.net.faults import Fault
from fbvm.net.relays import Opening, Relay, RelayedPort, Relays
from fbvm.net.stream import WINDOW_BYTES, End
from fbvm.wire.link import Broken, Close, Event, Failed, Grant, Opened, Peer, PeerClosed, Received, Request, Send, SendTo, Sent
from fbvm.wire.tap import TapKind

CLIENT, SERVER = Peer("192.168.250.2", 1024), Peer("192.168.250.1", 502)


class Carrier:
    """A network without delays, whose deliveries wait for `run`."""

    def __init__(self) -> None:
        self.calls: list[Callable[[int], None]] = []

    def at(self, due_ns: int, call: Callable[[int], None]) -> None:
        self.calls.append(call)

    def fault(self, one: Peer, other: Peer) -> Fault:
        return Fault()

    def latency_ns(self, fault: Fault) -> int:
        return 0

    def cut(self, fault: Fault, data: bytes) -> list[bytes]:
        return [data]

    def tell(self, end: End, what: TapKind, out: bool, data: bytes) -> None:
        """Nobody listens."""

    def run(self) -> None:
        while self.calls:
            self.calls.pop(0)(0)


class Owner:
    """Takes note of what it is told."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def sent(self, size_bytes: int) -> None:
        self.told.append(f"sent {size_bytes}")

    def readable(self, now_ns: int) -> None:
        self.told.append("readable")

    def finished(self, now_ns: int) -> None:
        self.told.append("finished")

    def broken(self, error: str, unsent: int, now_ns: int) -> None:
        self.told.append(f"{error} {unsent}")


@pytest.fixture
def joined() -> tuple[Carrier, End, End, Owner, Owner]:
    carrier, one, other = Carrier(), Owner(), Owner()
    client, server = End(carrier, CLIENT, SERVER, None, one), End(carrier, SERVER, CLIENT, None, other)
    client.join(server)
    return carrier, client, server, one, other


def test_an_end_whose_owner_has_half_closed_is_not_over(joined: tuple[Carrier, End, End, Owner, Owner]) -> None:
    """Also when both sides have sent FIN: data that came before are still there to be taken."""
    carrier, client, server, one, other = joined
    server.send(b"last words", 0)
    client.finish(0)
    server.finish(0)
    carrier.run()
    assert one.told == ["readable", "finished"] and other.told == ["sent 10", "finished"]
    assert not client.gone and not server.gone
    assert client.take(99, 0) == b"last words"
    client.leave(0)
    assert client.gone and not server.gone


def test_an_end_that_was_left_is_over_when_both_have_sent_fin(joined: tuple[Carrier, End, End, Owner, Owner]) -> None:
    carrier, client, server, _, other = joined
    client.leave(0)
    carrier.run()
    assert other.told == ["finished"] and not client.gone
    server.leave(0)
    carrier.run()
    assert client.gone and server.gone and not client.error


def test_who_sends_to_an_end_that_was_left_is_reset(joined: tuple[Carrier, End, End, Owner, Owner]) -> None:
    carrier, client, server, one, other = joined
    client.leave(0)
    carrier.run()
    server.send(b"more", 0)
    carrier.run()
    assert other.told == ["finished", "sent 4", "ECONNRESET 0"] and one.told == []
    assert client.gone and server.gone


def test_a_relay_holds_no_more_than_a_window_that_the_host_has_not_taken() -> None:
    class Behind:
        def submit(self, requests: list[Request], now_ns: int) -> None:
            asked.extend(requests)

    asked: list[Request] = []
    carrier, owner = Carrier(), Owner()
    unit = End(carrier, CLIENT, SERVER, None, owner)
    relay = Relay(carrier, Behind(), 7, unit)  # type: ignore[arg-type]
    unit.send(bytes(3 * WINDOW_BYTES), 0)
    carrier.run()
    assert asked == [Send(7, bytes(WINDOW_BYTES))] and owner.told == []
    relay.told(Sent(7, WINDOW_BYTES), 0)
    carrier.run()
    assert asked == 2 * [Send(7, bytes(WINDOW_BYTES))] and owner.told == [f"sent {3 * WINDOW_BYTES}"]
    unit.leave(0)
    carrier.run()
    relay.told(Sent(7, WINDOW_BYTES), 0)
    assert asked[2:] == [Send(7, bytes(WINDOW_BYTES)), Close(7)]


def test_a_port_under_faults_that_was_closed_sends_and_hears_nothing_more() -> None:
    asked: list[object] = []
    link = SimpleNamespace(pending=[])
    behind = SimpleNamespace(submit=lambda requests, now_ns: asked.extend(requests))
    late: list[Callable[[int], None]] = []
    relays = SimpleNamespace(is_unit=lambda remote: remote.host == "10.0.0.1", run=lambda now_ns: None,
                             pass_datagram=lambda local, remote, data, deliver: late.append(lambda now_ns: deliver(data, now_ns)))
    unit, host = Peer("10.0.0.1", 9600), Peer("10.0.0.9", 9600)
    port = RelayedPort(relays, link, 3, behind, 7, Peer("10.0.0.2", 9600))  # type: ignore[arg-type]
    assert port.send_to(host, b"out", 0) == ""
    port.told(Received(7, b"in", host), 0)
    port.told(Received(7, b"unit", unit), 0)
    assert link.pending == [Sent(3, 3), Received(3, b"unit", unit)] and len(late) == 2
    for deliver in late:
        deliver(1)
    assert asked == [SendTo(7, host, b"out")] and link.pending[2:] == [Received(3, b"in", host)]
    port.close(False, 2)
    assert asked[1:] == [Close(7)]
    for deliver in late:
        deliver(3)
    port.told(Received(7, b"unit", unit), 3)
    assert len(asked) == 2 and len(link.pending) == 3


class Relayed:
    """A relay between a unit's end and a connection 7 of the host, and all that each side is told, in order."""

    def __init__(self) -> None:
        self.said: list[object] = []
        self.carrier, self.owner = Carrier(), Owner()
        self.owner.told = self.said  # type: ignore[assignment]
        self.unit = End(self.carrier, CLIENT, SERVER, None, self.owner)
        behind = SimpleNamespace(submit=lambda requests, now_ns: self.said.extend(requests))
        self.relay = Relay(self.carrier, behind, 7, self.unit)  # type: ignore[arg-type]

    def do(self, act: Callable[[], object]) -> list[object]:
        """What is told when something is done, and all that follows from it."""
        self.said.clear()
        act()
        self.carrier.run()
        return list(self.said)

    def tell(self, *events: Event) -> list[object]:
        return self.do(lambda: [self.relay.told(event, 0) for event in events])

    def refresh(self) -> list[object]:
        return self.do(lambda: self.relay.refresh(0))


def test_a_relay_grants_what_the_unit_has_room_for() -> None:
    rig = Relayed()
    assert rig.relay.endpoints == (CLIENT, SERVER) and not rig.relay.is_over
    assert rig.refresh() == [Grant(7, WINDOW_BYTES)]
    assert rig.tell(Received(7, b"abc"), Received(7, b"de")) == ["readable", "readable"]
    assert rig.unit.take(1, 0) == b"a"
    waiting = rig.relay._end.waiting_bytes
    assert rig.refresh() == [Grant(7, WINDOW_BYTES - waiting)] and waiting == 0
    rig.tell(Received(7, bytes(3 * WINDOW_BYTES)))
    assert rig.relay._end.waiting_bytes > WINDOW_BYTES and rig.refresh() == [Grant(7, 0)]


def test_the_answers_that_are_owed_to_a_unit_are_told_and_others_are_the_relays() -> None:
    rig, answered = Relayed(), list[object]()
    connection = SimpleNamespace(answer=answered.append)
    rig.relay.owe(2, connection)  # type: ignore[arg-type]
    assert rig.do(lambda: rig.unit.send(b"xyz", 0)) == ["sent 3", Send(7, b"xyz")]
    assert rig.tell(Sent(7, 5), Failed(7, "send", "EPIPE")) == [] and answered == [Sent(7, 5), Failed(7, "send", "EPIPE")]
    assert rig.relay._unsent_bytes == 3
    assert rig.tell(Sent(7, 3), Failed(7, "send", "EPIPE")) == [] and len(answered) == 2 and rig.relay._unsent_bytes == 0


@each_of(("error", "wanted"), [
    ("host", [Close(7, True), "ECONNRESET 0"]), ("peer", ["finished"]), ("fault", ["ECONNRESET 0", Close(7, True)]),
    ("no fault", []), ("unit", [Close(7, False)]), ("unit breaks", [Close(7, True)])])
def test_how_a_relay_ends(error: str, wanted: list[object]) -> None:
    rig = Relayed()
    acts: dict[str, Callable[[], object]] = {
        "host": lambda: rig.relay.told(Broken(7, "ETIMEDOUT"), 0), "peer": lambda: rig.relay.told(PeerClosed(7), 0),
        "fault": lambda: rig.relay.break_if(True, 0), "no fault": lambda: rig.relay.break_if(False, 0),
        "unit": lambda: rig.unit.leave(0), "unit breaks": lambda: rig.unit.reset(0),
    }  # fmt: skip
    assert rig.do(acts[error]) == wanted
    is_closed = any(isinstance(each, Close) for each in wanted)
    assert (rig.relay.closed, rig.refresh()) == (is_closed, [] if is_closed else [Grant(7, WINDOW_BYTES)])
    assert rig.relay.is_over is is_closed
    if error == "host":
        assert rig.do(acts[error]) == [], "nothing is closed twice"


def test_a_relay_whose_unit_hears_nothing_any_more_gives_its_connection_up() -> None:
    rig = Relayed()
    rig.unit._break("ETIMEDOUT", 0)
    assert rig.refresh() == [Close(7, True)] and rig.refresh() == []


@each_of(("links", "before", "scan"), [
    ({}, False, 0), ({CLIENT.host: 0}, False, 0), ({CLIENT.host: 0}, True, 0), ({CLIENT.host: 1}, False, 0),
    ({CLIENT.host: 1}, True, 1), ({SERVER.host: 5}, False, 4), ({SERVER.host: 5, CLIENT.host: 7}, True, 7)])
def test_of_which_scan_a_fault_between_two_is(links: dict[str, int], before: bool, scan: int) -> None:
    made = {host: SimpleNamespace(refreshes=refreshes) for host, refreshes in links.items()}
    assert Relays.scan_of(SimpleNamespace(_links=made, _before_refresh=before), CLIENT, SERVER) == scan  # type: ignore[arg-type]


@each_of(("event", "wanted"), [
    (Failed(9, "open", "ECONNREFUSED"), [("tap", 25, TapKind.RST, False), ("refused", 25, "ECONNREFUSED")]),
    (Failed(9, "open", "EHOSTUNREACH"), [("refused", 25, "EHOSTUNREACH")]),
    (Opened(9, 40_000, SERVER), [("lead", 9), ("answered", 25, Peer(CLIENT.host, 40_000), SERVER, "", True)]),
    (Sent(9, 1), []), (None, [("refused", 20, "ETIMEDOUT")])])
def test_the_answer_to_an_open_under_faults_comes_a_latency_later(event: Event | None, wanted: list[object]) -> None:
    said, due = list[object](), list[tuple[int, Callable[[int], None]]]()
    relays = SimpleNamespace(
        now_ns=20, fault=lambda one, other: Fault(latency_ns=5), latency_ns=lambda fault: fault.latency_ns,
        at=lambda due_ns, call: due.append((due_ns, call)), lead=lambda channel, link, end: said.append(("lead", channel)),
        tell_unit=lambda unit, what, local, remote, out: said.append(("tap", due[0][0], what, out)))
    connection = SimpleNamespace(
        link=None, refused=lambda error, now_ns: said.append(("refused", now_ns, error)),
        answered=lambda end, error, active, now_ns: said.append(("answered", now_ns, end.local, end.remote, error, active)))
    opening = Opening(relays, connection, CLIENT, SERVER)  # type: ignore[arg-type]
    if event is None:
        opening.time_out(20)
    else:
        opening.told(event, 20)
        assert not opening.is_over
    for due_ns, call in due:
        call(due_ns)
    assert said == wanted
    assert opening.is_over is isinstance(event, Failed | None)
