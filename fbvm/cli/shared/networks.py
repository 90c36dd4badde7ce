"""The network that the options --net and --map describe."""

from __future__ import annotations

import sys

import click

from fbvm.cli.shared import status
from fbvm.cli.shared.options import Mapping
from fbvm.code.image import Image
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.net.tcp import TcpNetwork
from fbvm.wire import registers


def build_network(net: str, mappings: tuple[Mapping, ...], seed: int = 0) -> LoopNetwork | TcpNetwork:
    """A network in memory (`net` "loop", with a Modbus server at each mapped endpoint) or on the host's TCP ("tcp").

    `seed` starts the random numbers of the network in memory.  Ends with status 5 if a host name has no address."""
    if net == "loop":
        network = LoopNetwork(seed)
        for row in mappings:
            network.place(row.endpoint, ModbusPeer(registers.server()))
        return network
    for row in mappings:
        try:
            TcpNetwork({row.endpoint: (row.host or "", row.port)}).close()
        except (OSError, UnicodeError) as error:  # a host without an address, or a name that cannot be one
            reason = getattr(error, "strerror", "no name of a host")
            click.echo(f"the network cannot be used: {row.host}: {reason}", err=True)
            sys.exit(status.NETWORK)
    return TcpNetwork({row.endpoint: (row.host or "", row.port) for row in mappings})


def mailbox_names(image: Image) -> list[str]:
    """The names of the mailboxes that a program uses, such as `noc`."""
    return [box.name for box in image.layout.mailboxes]
