"""`fbvm dap`: the debugger for editors, by the Debug Adapter Protocol."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Any

import click

from fbvm.cli.shared import status
from fbvm.cli.shared.debug.launch import open_launch
from fbvm.cli.shared.terminal import say
from fbvm.dap.server import pass_on, serve
from fbvm.dap.target import LaunchError, Target
from fbvm.net.streams import Listener, Stream, connect

READ_BYTES = 65536


@click.command("dap")
@click.option("--listen", "port", type=click.IntRange(0, 65535), metavar="PORT",
              help="Wait for editors at this port, one after the other; 0 is one that the system picks.")
@click.option("--bind", default="127.0.0.1", show_default=True, metavar="HOST", help="Where to listen.")
@click.option("--connect", "address", metavar="[HOST:]PORT",
              help="Debug what runs there (`fbvm dap --listen`), and speak to the editor over stdin and stdout.")
def command(port: int | None, bind: str, address: str | None) -> None:
    """Debug programs from an editor: VS Code, Neovim, Emacs, Helix.

    The editor starts this and speaks the Debug Adapter Protocol over stdin and stdout; nothing else is ever printed there."""
    if port is not None and address is not None:
        raise click.UsageError("--listen or --connect, not both")
    try:
        if port is not None:
            _listen(bind, port)
        elif address is not None:
            with _connected(address) as stream:
                pass_on(_read, _write, stream.receive, stream.send, stream.end)
        else:
            _report(serve(open_target, _read, _write))
    except OSError as error:
        say(f"the network cannot be used: {error.strerror or error}", err=True)
        sys.exit(status.NETWORK)


def open_target(how: str, arguments: Mapping[str, Any]) -> Target:
    """What an editor asks for.  Raises LaunchError."""
    if how == "attach":
        raise LaunchError("attach: start `fbvm dap --connect PORT` as the adapter of a program that runs")
    return open_launch(arguments)


def _read() -> bytes:
    return os.read(0, READ_BYTES)


def _write(data: bytes) -> None:
    sys.stdout.buffer.write(data)
    sys.stdout.buffer.flush()


def _report(wrong: str) -> None:
    if wrong:
        say(wrong, err=True)
        sys.exit(status.USAGE)


def _listen(bind: str, port: int) -> None:
    """Serves editors one after the other, until Ctrl-C."""
    listener = Listener(bind, port)
    say(f"the debugger listens at {bind}:{listener.port}")
    try:
        while True:
            with listener.accept() as stream:
                if wrong := serve(open_target, stream.receive, stream.send):
                    say(wrong, err=True)
    finally:
        listener.close()


def _connected(address: str) -> Stream:
    host, _, port = address.rpartition(":")
    if not port.isdecimal():
        raise click.UsageError(f"{address!r} is no [HOST:]PORT")
    return connect(host or "127.0.0.1", int(port))

