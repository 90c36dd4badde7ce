"""FINS on the command line: the options of a verb that serves it, the unit's arguments, its port on the host."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import Any, TypeVar

import click

from fbvm.cli.shared.doors import LISTENING, unusable
from fbvm.cli.shared.options import address
from fbvm.cli.shared.terminal import say
from fbvm.machine.backplane import ETN21_ADDRESS
from fbvm.net.addresses import is_reachable
from fbvm.net.switchboard import UDP
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.fins.frames import LAST_NODE, PORT
from fbvm.wire.link import Peer

Verb = TypeVar("Verb", bound=Callable[..., Any])
ENDPOINT = Peer(ETN21_ADDRESS, PORT)
"""Where the program's ETN21 serves FINS."""


@dataclass(frozen=True)
class FinsDoor:
    """Where on the host FINS is served, by which node, and what it may do: "full", "no-control" or "read-only".

    `node` 0 takes the frames for every node."""

    real: Peer
    node: int
    access: str

    @property
    def unit(self) -> dict[str, Any]:
        """The arguments of the ETN21.  Its address table has its own node, which need not be a part of its address then."""
        nodes = {str(self.node): ETN21_ADDRESS} if self.node else {}
        return {"fins": True, "fins_node": self.node, "fins_nodes": nodes, "fins_access": self.access}

    @property
    def rows(self) -> dict[Peer, tuple[str, int]]:
        """The row of the network's map."""
        return {ENDPOINT: (self.real.host, self.real.port)}


def fins_options(verb: Verb) -> Verb:
    """The options --fins, --fins-bind, --fins-port, --fins-node and --fins-control."""
    for option in reversed((
        click.option("--fins", is_flag=True, help="Serve FINS, too, by UDP and TCP."),
        click.option("--fins-bind", default="127.0.0.1", show_default=True, metavar="ADDRESS",
                     help="Address of this computer at which FINS is served."),
        click.option("--fins-port", type=click.IntRange(0, 65535), default=PORT, show_default=True,
                     help="Port of FINS, the same for UDP and TCP.  0: any free port."),
        click.option("--fins-node", type=click.IntRange(1, LAST_NODE), metavar="NODE",
                     help="The PLC's FINS node; else the last part of the address, and with 0.0.0.0 every node."),
        click.option("--fins-control", is_flag=True,
                     help="Let FINS change the operating mode also where other computers can reach it."),
    )):  # fmt: skip
        verb = option(verb)
    return verb


def fins_door(bind: str, port: int, node: int | None, control: bool, read_only: bool) -> FinsDoor:
    """What the options ask for.  Raises BadParameter for an address that is none."""
    host = address(bind, "--fins-bind")
    last = int(IPv4Address(host)) & 0xFF
    known = node if node is not None else last if 0 < last <= LAST_NODE else 0
    access = "read-only" if read_only else "full" if control or not is_reachable(host) else "no-control"
    return FinsDoor(Peer(host, port), known, access)


def try_fins(network: TcpNetwork, door: FinsDoor) -> None:
    """Tries the port for TCP and UDP, and warns where others reach it.  Ends with status 5 if the host does not give the port."""
    try:
        network.try_door(door.real)
        real = network.host_endpoint(ENDPOINT)
        network.try_door(network.host_endpoint(ENDPOINT, UDP), UDP)
    except OSError as error:
        network.close()
        unusable(error)
    if is_reachable(real.host):
        mode = "; it cannot change the mode without --fins-control" if door.access == "no-control" else (
            " and stop the PLC" if door.access == "full" else "")  # fmt: skip
        may = "read" if door.access == "read-only" else "read and write" + mode
        say(f"Other computers can reach {real} by FINS, which knows no password: whoever sends may {may}.", fg="yellow", err=True)


def say_fins(door: FinsDoor, real: Peer) -> None:
    """Says where FINS is served, as soon as it is: a datagram that came before would be lost."""
    say(f"FINS: {LISTENING}{real}, node {door.node or 'any'}")
