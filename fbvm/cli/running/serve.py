"""`fbvm serve`: a PLC with the server program of `examples/server.st` as a service on real TCP."""

from __future__ import annotations

import ipaddress
import signal
import sys
from contextlib import AbstractContextManager, ExitStack
from io import TextIOWrapper
from pathlib import Path
from types import FrameType
from typing import IO, NoReturn

import click

from fbvm.base.data import data_folder
from fbvm.base.files import reason
from fbvm.base.host import ending_signals, handling, saving_signals
from fbvm.cli.running.peer import LISTENING
from fbvm.cli.shared import status
from fbvm.cli.shared.files import OutputError, growing_file, writing
from fbvm.cli.shared.options import time_ns, watch_cycle_option
from fbvm.code.compiler import compile_files
from fbvm.machine.backplane import ETN21_ADDRESS
from fbvm.machine.plc import Plc
from fbvm.net.tcp import TcpNetwork
from fbvm.record.trace import memory_images
from fbvm.record.trace.requests import RequestLog
from fbvm.run import loop
from fbvm.run.running import EVENT
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

CYCLE_NS = 10_000_000
START_LIMIT_NS = 5_000_000_000
SCANS_OF_AN_OPEN = 4
"""The scans within which a unit reports that a port cannot be used."""
ENDPOINT = Peer(ETN21_ADDRESS, 502)
SERVED = {"CIO": 5801, "D": 32768}
"""Words of each area that clients can reach, fblib/omron/etn_modbus/README.md."""


@click.command("serve")
@click.option("--bind", default="127.0.0.1", show_default=True, metavar="ADDRESS",
              help="Address of this computer to listen on; 0.0.0.0 is all.")
@click.option("--port", type=click.IntRange(0, 65535), default=1502, show_default=True, help="0: any free port.")
@click.option("--sockets", type=click.IntRange(1, 8), default=1, show_default=True, help="Clients at once.")
@click.option("--backlog/--no-backlog", default=True, show_default=True,
              help="Hold callers until a socket is free, where a unit refuses them.")
@click.option("--read-only", is_flag=True, help="Refuse everything that writes.")
@click.option("--fn0f", is_flag=True, help="Serve 0F, write multiple coils, too.")
@click.option("--full-dm", is_flag=True, help="Let 10, write multiple registers, begin anywhere in D.")
@click.option("--idle", "idle_ns", type=time_ns, metavar="TIME", help="Leave a client that is silent so long (60s).")
@watch_cycle_option
@click.option("--image", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Memory: loaded at the start if the file is there, saved at the end and on SIGUSR1.")
@click.option("--log", type=click.Path(dir_okay=False, allow_dash=True, path_type=Path), metavar="FILE",
              help="Write who asked what, a JSON object a line; - is the terminal.")
def command(
    bind: str, port: int, sockets: int, backlog: bool, read_only: bool, fn0f: bool, full_dm: bool, idle_ns: int | None,
    watch_ns: int, image: Path | None, log: Path | None,
) -> None:  # fmt: skip
    """Serve the memory of a PLC by Modbus TCP until Ctrl-C or SIGTERM.

    Status 5 if the port cannot be used, 4 if a trap stopped the program, 2 if the memory could not be saved, else 0."""
    settings = {"Sockets": sockets, "Read_Only": read_only, "Fn0F": fn0f, "Full_DM": full_dm}
    if idle_ns is not None:
        settings["Idle_Time"] = idle_ns
    signals = Signals()
    with ExitStack() as stack:
        stack.enter_context(signals.installed())
        plc = _plc(settings, image)
        plc.watch_cycle.time_ns = watch_ns
        network = _network(bind, port, backlog)
        stack.callback(network.close)
        if log:
            network.tap = RequestLog(_opened(stack, log), loop.epoch_ns(), lambda: plc.scans).tap
        plc.attach(Etn21(0, ETN21_ADDRESS), network)
        reason, saved = _start(plc, network), True
        while reason != "trap" and not signals.end:
            try:
                reason = loop.run(plc, until=lambda _: signals.end or signals.save, pace=EVENT)
            except OutputError:  # the log; the memory is saved nevertheless
                _save(plc, image)
                raise
            signals.save = False
            saved = _save(plc, image)
    if plc.trap:
        click.echo(str(plc.trap), err=True)
    sys.exit(status.STOPPED if reason == "trap" else status.GOOD if saved else status.USAGE)


def _plc(settings: dict[str, int], image: Path | None) -> Plc:
    """A PLC with the server program, its settings written and its memory loaded."""
    program = compile_files([data_folder("examples") / "server.st"], runnable=True, lint=False).image
    assert program is not None, "the server's own program compiles"
    plc = Plc(program, CYCLE_NS)
    for name, value in settings.items():
        plc.write(f"Main.Server.{name}", value)
    if image:
        with writing(image):
            memory_images.check_writable(image)
    if image and image.exists():
        try:
            memory_images.load(plc.memory, image)
        except OSError as error:
            raise click.UsageError(f"{image} cannot be read: {reason(error)}") from None
        except memory_images.ImageError as error:
            raise click.UsageError(str(error)) from None
    return plc


def _opened(stack: ExitStack, log: Path) -> IO[str]:
    with writing(log):
        if str(log) == "-":
            return sys.stdout
        return stack.enter_context(TextIOWrapper(growing_file(log, "ab"), encoding="utf-8"))


def _network(bind: str, port: int, backlog: bool) -> TcpNetwork:
    try:
        if not ipaddress.ip_address(bind).is_loopback:
            click.echo(f"Other computers can reach {bind} and write this PLC's memory.", err=True)
        network = TcpNetwork({ENDPOINT: (bind, port)}, backlog=backlog)
        network.host_endpoint(ENDPOINT)
    except ValueError:
        raise click.UsageError(f"--bind {bind} is not an IP address") from None
    except OSError as error:
        _unusable(Peer(bind, port), str(error))
    return network


def _start(plc: Plc, network: TcpNetwork) -> str:
    """Runs until the unit listens, and prints the endpoint; returns the reason of the end."""
    opening, failed = plc.find("CIO 1509.00"), plc.find("Main.Server.Error_Code")
    reason = loop.run(plc, until=lambda _: bool(plc.read(opening)), max_ns=START_LIMIT_NS, pace=EVENT)
    if reason == "until":
        reason = loop.run(plc, scans=SCANS_OF_AN_OPEN, pace=EVENT)
    real = network.host_endpoint(ENDPOINT)
    if reason == "max" or plc.read(failed):
        _unusable(real, f"response code {plc.read(failed):04X}")
    if reason == "scans":
        click.echo(f"{LISTENING}{real}")
        sys.stdout.flush()
    return reason


def _unusable(real: Peer, why: str) -> NoReturn:
    click.echo(f"{real} cannot be used: {why}", err=True)
    sys.exit(status.NETWORK)


# --- signals and images -----------------------------------------------------------------------------------------------


class Signals:
    """The signals that the process has received: `end` (SIGTERM, Ctrl-C), `save` the image (SIGUSR1, where it exists).

    They only set flags, so that no scan is interrupted."""

    def __init__(self) -> None:
        self.end = False
        self.save = False

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if number in saving_signals():
            self.save = True
        else:
            self.end = True

    def installed(self) -> AbstractContextManager[None]:
        """Installs the handlers inside a `with` block."""
        return handling((signal.SIGINT, *ending_signals(), *saving_signals()), self._handle)


def _save(plc: Plc, image: Path | None) -> bool:
    """Saves the memory, if `image` is given; says why it cannot and returns False if the host refuses."""
    if image:
        try:
            memory_images.save(plc.memory, image, SERVED)
        except OSError as error:
            click.echo(f"{image} cannot be written: {reason(error)}", err=True)
            return False
    return True
