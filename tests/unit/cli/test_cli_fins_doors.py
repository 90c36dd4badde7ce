"""Where FINS is served, by which node, with which rights, and what is said of it."""

from __future__ import annotations

from typing import cast

import click
import pytest
from rows import each_of

from fbvm.cli.shared.fins import ENDPOINT, FinsDoor, fins_door, say_fins, try_fins
from fbvm.net.switchboard import TCP, UDP
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import Peer

HERE, THERE = "127.0.0.1", "192.168.250.7"


@each_of("bind, node, control, read_only, wanted", [
    (HERE, None, False, False, (1, "full")), (THERE, None, False, False, (7, "no-control")),
    (THERE, None, True, False, (7, "full")), (THERE, 20, False, False, (20, "no-control")),
    ("0.0.0.0", None, False, False, (0, "no-control")),
    ("0.0.0.0", 9, False, False, (9, "no-control")), ("10.0.0.254", None, False, False, (254, "no-control")),
    ("10.0.0.255", None, False, False, (0, "no-control")), ("10.0.1.0", None, False, False, (0, "no-control")),
    (HERE, None, False, True, (1, "read-only")), (THERE, None, True, True, (7, "read-only")),
])
def test_which_node_may_do_what(bind: str, node: int | None, control: bool, read_only: bool, wanted: tuple[int, str]) -> None:
    door = fins_door(bind, 9600, node, control, read_only)
    assert (door.node, door.access) == wanted
    assert door.real == Peer(bind, 9600) and door.rows == {ENDPOINT: (bind, 9600)}
    assert (door.unit["fins"], door.unit["fins_node"], door.unit["fins_access"]) == (True, *wanted)
    assert door.unit["fins_nodes"] == ({str(wanted[0]): ENDPOINT.host} if wanted[0] else {})


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(click.BadParameter, match="--fins-bind nobody is not an IPv4 address"):
        fins_door("nobody", 9600, None, False, False)


class Ports:
    """A host that gives the port for the kinds that are named; which were asked for, and whether all was closed."""

    def __init__(self, *gives: str) -> None:
        self.gives, self.asked, self.is_closed = gives, list[tuple[Peer, str]](), False

    def try_door(self, door: Peer, kind: str = TCP) -> None:
        self.asked.append((door, kind))
        if kind not in self.gives:
            raise OSError(98, f"{kind} {door} cannot be used: Address already in use")

    def host_endpoint(self, endpoint: Peer, kind: str = TCP) -> Peer:
        assert endpoint == ENDPOINT
        return Peer(THERE, 9600 if kind == TCP else 9601)

    def close(self) -> None:
        self.is_closed = True


def tried(ports: Ports, access: str) -> None:
    try_fins(cast(TcpNetwork, ports), FinsDoor(Peer(THERE, 0), 7, access))


@each_of("access, said", [
    ("full", "read and write and stop the PLC."), ("read-only", "read."),
    ("no-control", "read and write; it cannot change the mode without --fins-control."),
])
def test_others_who_reach_it_are_warned_of(access: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    ports = Ports(TCP, UDP)
    tried(ports, access)
    assert ports.asked == [(Peer(THERE, 0), TCP), (Peer(THERE, 9601), UDP)] and not ports.is_closed
    assert capsys.readouterr().err == (
        f"Other computers can reach {THERE}:9600 by FINS, which knows no password: whoever sends may {said}\n")


@each_of("gives", [(TCP,), (UDP,), ()])
def test_a_port_that_is_not_free_ends_the_verb(gives: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    ports = Ports(*gives)
    with pytest.raises(SystemExit) as ended:
        tried(ports, "full")
    assert ended.value.code == 5 and ports.is_closed
    assert "cannot be used: Address already in use" in capsys.readouterr().err


@each_of("node, shown", [(7, "7"), (0, "any")])
def test_where_it_is_served_is_said(node: int, shown: str, capsys: pytest.CaptureFixture[str]) -> None:
    say_fins(FinsDoor(Peer(HERE, 0), node, "full"), Peer(HERE, 9600))
    assert capsys.readouterr().out == f"FINS: listening on 127.0.0.1:9600, node {shown}\n"
