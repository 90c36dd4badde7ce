"""`fbvm peer`: a Modbus TCP server to talk to, by pymodbus."""

from __future__ import annotations

import asyncio
import logging
import sys
from typing import Any, NoReturn

import click

from fbvm.base.host import ending_signals, handling
from fbvm.cli.shared import status
from fbvm.cli.shared.doors import LISTENING, unusable, warn_if_reachable
from fbvm.cli.shared.ending import loading
from fbvm.cli.shared.files import check_free_files
from fbvm.cli.shared.terminal import say
from fbvm.net.tcp import TcpNetwork
from fbvm.wire import registers
from fbvm.wire.link import Peer

OWN_FILES = 6
"""Files and sockets that the server has open for itself."""


@click.command("peer")
@click.option("--port", type=click.IntRange(0, 65535), default=15020, show_default=True, help="0: any free port.")
@click.option("--bind", "--host", "host", default="127.0.0.1", show_default=True, metavar="ADDRESS",
              help="Address of this computer to listen on; 0.0.0.0 is all.")
@click.option("--trace", is_flag=True, help="Print the frames that come and go.")
def command(port: int, host: str, trace: bool) -> None:
    """Serve Modbus TCP until Ctrl-C or SIGTERM, for every unit id.

    Holding register i holds 1000 + i, input register i 2000 + i, every second coil and every third discrete input is
    ON.  Status 0 if a signal ends the server, 5 if the port cannot be used."""
    check_free_files(OWN_FILES)
    try:
        with loading():
            import pymodbus.server  # noqa: F401
    except ImportError:
        raise click.UsageError("pymodbus is missing: pip install 'fbvm[peer]'") from None
    warn_if_reachable(Peer(host, port))
    try:
        asyncio.run(_serve(host, port, trace))
    except (KeyboardInterrupt, asyncio.CancelledError):
        sys.exit(status.GOOD)
    except OSError:
        _unusable(host, port)


def _unusable(host: str, port: int) -> NoReturn:
    """Says why the port cannot be used, which pymodbus does not tell, and ends the verb."""
    network = TcpNetwork()
    try:
        network.try_door(Peer(host, port))
    except OSError as error:
        unusable(error)
    finally:
        network.close()
    unusable(OSError(f"{host}:{port} cannot be used"))


async def _serve(host: str, port: int, trace: bool) -> None:
    serving = asyncio.current_task()
    assert serving is not None, "a coroutine runs in a task"
    loop = asyncio.get_running_loop()
    with handling(ending_signals(), lambda number, frame: loop.call_soon_threadsafe(serving.cancel)):
        await _listen(host, port, trace)


async def _listen(host: str, port: int, trace: bool) -> None:
    from pymodbus.server import ModbusTcpServer

    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    server: Any = ModbusTcpServer(device(), address=(host, port), trace_packet=_trace if trace else None)
    if not await server.listen():
        raise OSError("pymodbus says no more")
    _, bound_port = server.transport.sockets[0].getsockname()[:2]
    say(f"{LISTENING}{host}:{bound_port}")
    try:
        await server.serving
    finally:
        await server.shutdown()


def device() -> Any:
    """The contents in the form of pymodbus; device id 0 answers every unit id."""
    from pymodbus.simulator import DataType, SimData, SimDevice

    bits = [[SimData(0, values=values, datatype=DataType.BITS)]
            for values in (registers.coils(), registers.discrete_inputs())]  # fmt: skip
    words = [[SimData(0, values=values, datatype=DataType.REGISTERS)]
             for values in (registers.holding_registers(), registers.input_registers())]  # fmt: skip
    return SimDevice(0, simdata=(bits[0], bits[1], words[0], words[1]))


def _trace(sending: bool, data: bytes) -> bytes:
    if data:
        say(f"{'->' if sending else '<-'} {data.hex(' ').upper()}")
    return data
