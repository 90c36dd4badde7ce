"""Doors: which endpoint of a unit is met where on the host, which cannot be together, and why one cannot be used."""

from __future__ import annotations

import errno
from collections.abc import Iterator

import pytest
from rows import each_of

from fbvm.net.addresses import AddressMap, is_reachable, why_unusable
from fbvm.net.notices import EACH_TIME, Notice, NoticeKind, Notices
from fbvm.net.switchboard import errno_name
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import Peer

ONE, TWO = Peer("192.168.250.1", 502), Peer("192.168.250.2", 502)
EVERY = "0.0.0.0"


class Untried(TcpNetwork):
    """A network that takes every port of the host for a free one, and notes which were tried."""

    def __init__(self, rows: dict[Peer, Peer]) -> None:
        super().__init__({one: (real.host, real.port) for one, real in rows.items()})
        self.tried: list[Peer] = []
        for unit in (ONE, TWO):
            self.attach(unit.host)

    def try_door(self, real: Peer, transport: str = "tcp") -> None:
        self.tried.append(real)


@pytest.fixture
def networks() -> Iterator[list[TcpNetwork]]:
    made: list[TcpNetwork] = []
    yield made
    for network in made:
        network.close()


@each_of(("first", "second", "taken"), [
    (Peer("127.0.0.1", 5000), Peer("127.0.0.1", 5001), False), (Peer("127.0.0.1", 5000), Peer("127.0.0.2", 5000), False),
    (Peer("127.0.0.1", 5000), Peer("127.0.0.1", 5000), True), (Peer(EVERY, 5000), Peer("127.0.0.1", 5000), True),
    (Peer("127.0.0.1", 5000), Peer(EVERY, 5000), True), (Peer(EVERY, 5000), Peer("127.0.0.1", 5001), False),
    (Peer(EVERY, 5000), Peer(EVERY, 5000), True),
])  # fmt: skip
def test_two_doors_may_not_be_one(first: Peer, second: Peer, taken: bool) -> None:
    network = Untried({ONE: first, TWO: second})
    try:
        if taken:
            with pytest.raises(OSError, match=f"{second} cannot be used for {TWO}: it is the door of {ONE}"):
                network.try_doors([ONE, TWO])
            assert network.doors == {}
        else:
            assert network.try_doors([ONE, TWO]) == network.doors == {ONE: first, TWO: second}
        assert network.tried == [first, second]
    finally:
        network.close()


def test_a_door_belongs_to_a_unit(networks: list[TcpNetwork]) -> None:
    network = Untried({})
    networks.append(network)
    with pytest.raises(OSError, match=r"no unit has the address 10\.0\.0\.9; units: 192.*\.1, 192"):
        network.try_doors([Peer("10.0.0.9", 502)])
    empty = TcpNetwork()
    networks.append(empty)
    with pytest.raises(OSError, match="units: none"):
        empty.try_doors([ONE])


def test_an_endpoint_without_a_row_does_not_get_a_port_of_the_host_s_own(networks: list[TcpNetwork]) -> None:
    network = Untried({TWO: Peer("127.0.0.1", 5002)})
    networks.append(network)
    told: list[Notice] = []
    network.notices.tell = told.append
    with pytest.raises(OSError, match="not mapped") as raised:
        network.listening_endpoint(ONE)
    assert raised.value.errno == errno.EACCES
    assert [(notice.kind, notice.endpoint, notice.real) for notice in told] == [
        (NoticeKind.NOT_MAPPED, ONE, Peer("127.0.0.1", 502))]
    assert network.listening_endpoint(TWO) == Peer("127.0.0.1", 5002)
    assert network.listening_endpoint(Peer(ONE.host, 1024)) == Peer("127.0.0.1", 1024)
    with pytest.raises(OSError, match="not mapped"):
        network.listening_endpoint(Peer(ONE.host, 1023))


def test_the_first_endpoint_without_a_row_gets_the_door() -> None:
    book = AddressMap({TWO: Peer("127.0.0.1", 5002)}, "127.0.0.1", Peer("127.0.0.1", 1502))
    assert book.is_mapped(TWO) and book.is_mapped(ONE) and not book.is_mapped(Peer(ONE.host, 503))
    assert book.local(ONE) == Peer("127.0.0.1", 1502)
    assert book.is_mapped(Peer(ONE.host, 0)) and book.is_mapped(Peer(ONE.host, 1024)) and not book.is_mapped(Peer(ONE.host, 1023))


def test_rows_that_nobody_has_used_are_known() -> None:
    rows = {ONE: Peer("127.0.0.1", 5001), TWO: Peer("127.0.0.1", 5002), Peer("10.0.0.3", 0): Peer("127.0.0.3", 0)}
    book = AddressMap(rows, "127.0.0.1")
    assert book.unused == list(rows)
    assert book.inward(Peer("127.0.0.1", 5002), {ONE.host}) == TWO
    book.outward(ONE)
    assert book.inward(Peer("127.0.0.3", 77), ()) == Peer("10.0.0.3", 77)
    assert book.unused == []
    assert book.inward(Peer("127.0.0.1", 5001), {ONE.host}) == Peer("127.0.0.1", 5001), "that row is for listening"


@each_of(("host", "reachable"), [("127.0.0.1", False), ("127.9.9.9", False), (EVERY, True), ("10.0.0.1", True),
                                 ("localhost", False), ("pump.local", True)])  # fmt: skip
def test_who_can_reach_an_address_of_the_host(host: str, reachable: bool) -> None:
    assert is_reachable(host) is reachable


@each_of(("number", "name"), [
    (errno.ECONNREFUSED, "ECONNREFUSED"), (errno.ETIMEDOUT, "ETIMEDOUT"), (99_999, "EIO"), (None, "EIO")])  # fmt: skip
def test_errors_of_the_host_have_the_names_of_posix(number: int | None, name: str) -> None:
    assert errno_name(OSError(number, "?") if number else OSError("?")) == name


def test_a_reason_that_is_not_known_is_that_of_the_system() -> None:
    assert why_unusable(OSError(errno.EINVAL, "Invalid Argument")) == "invalid argument"
    assert why_unusable(OSError("Odd")) == "odd"
    assert why_unusable(OSError(errno.EADDRINUSE, "x")) == "somebody else listens there"


def test_a_notice_is_told_once_for_an_endpoint_but_for_those_that_are_told_each_time() -> None:
    for kind in NoticeKind:
        notices, told = Notices(), list[Notice]()
        notices.note(kind, TWO, TWO)  # nobody listens yet
        notices.tell = told.append
        for endpoint in (ONE, ONE, TWO):
            notices.note(kind, endpoint, TWO, "why")
        assert [notice.endpoint for notice in told] == ([ONE, ONE, TWO] if kind in EACH_TIME else [ONE])
        assert told[0] == Notice(kind, ONE, TWO, "why")
