"""The network that the options --net and --map describe."""

from __future__ import annotations

import sys

import click
from click.core import ParameterSource

from fbvm.cli.shared import status
from fbvm.cli.shared.doors import notice_teller, say_doors, unusable
from fbvm.cli.shared.options import Door, Mapping
from fbvm.cli.shared.terminal import named, say
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.net.tcp import TcpNetwork
from fbvm.wire import registers
from fbvm.wire.link import Peer

HOW_TO_MAP = "say where by --map {endpoint}=127.0.0.1:{port} or --door {port}"


def build_network(
    net: str, mappings: tuple[Mapping, ...], seed: int = 0, bind: str = "127.0.0.1", doors: tuple[Door, ...] = ()
) -> LoopNetwork | TcpNetwork:
    """A network in memory (`net` "loop", with a Modbus server at each mapped endpoint) or on the host's TCP ("tcp").

    `seed` starts the random numbers of the network in memory; units without a row listen on `bind`, and at `doors`.  Ends with
    status 5 if a host name has no address or a door cannot be used."""
    if net == "loop":
        network = LoopNetwork(seed)
        for row in mappings:
            network.place(row.endpoint, ModbusPeer(registers.server()))
        return network
    rows = {row.endpoint: (row.host or "", row.port) for row in mappings}
    rows |= {door.endpoint: (door.host or bind, door.port) for door in doors if door.endpoint}
    for said, (host, port) in rows.items():
        try:
            TcpNetwork({said: (host, port)}).close()
        except (OSError, UnicodeError) as error:  # a host without an address, or a name that cannot be one
            reason = getattr(error, "strerror", "no name of a host")
            say(f"the network cannot be used: {named(host)}: {reason}", err=True)
            sys.exit(status.NETWORK)
    first = next((Peer(door.host or bind, door.port) for door in doors if not door.endpoint), None)
    real = TcpNetwork(rows, bind, door=first)
    try:
        if first:
            real.try_door(first)
    except OSError as error:
        real.close()
        unusable(error)
    return real


def net_of(net: str, doors: tuple[Door, ...]) -> str:
    """The network that --net and --door of the present command say: a door is on the host's TCP."""
    said = click.get_current_context().get_parameter_source("net") is not ParameterSource.DEFAULT
    return net if said or not doors else "tcp"


def try_doors(plc: Plc, network: LoopNetwork | TcpNetwork, mappings: tuple[Mapping, ...], doors: tuple[Door, ...]) -> None:
    """Tries the endpoints of units that --map and --door name, and says where each is.  Ends with status 5 if one cannot be
    used."""
    if isinstance(network, LoopNetwork):
        return
    own = {attached.unit.address for attached in plc.units}
    named = [row.endpoint for row in mappings if row.endpoint.host in own and row.endpoint.port]
    try:
        found = network.try_doors([*named, *(door.endpoint for door in doors if door.endpoint)])
    except OSError as error:
        unusable(error)
    say_doors(found)
    network.notices.tell = notice_teller(HOW_TO_MAP, found)


def mailbox_names(image: Image) -> list[str]:
    """The names of the mailboxes that a program uses, such as `noc`."""
    return [box.name for box in image.layout.mailboxes]
