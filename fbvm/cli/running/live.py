"""`fbvm live`: runs a program or a project and serves a page on which it can be seen and touched."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

from fbvm.cli.shared.live.origins import FileOrigin, project_origin
from fbvm.cli.shared.live.page import PageOptions, serve_page
from fbvm.cli.shared.networks import build_network, mailbox_names, net_of, try_doors
from fbvm.cli.shared.options import (
    Door,
    Mapping,
    check_live_installed,
    cycle_option,
    debug_option,
    door_option,
    map_option,
    net_option,
)
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.project_arguments import allow_outside_option, project_argument
from fbvm.cli.shared.sources import compile_options, compile_or_exit, source_options
from fbvm.code.image import Image
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running


@click.command("live")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE... | PROJECT]", type=SourcePath(), callback=taken_folders)
@cycle_option
@net_option
@map_option
@door_option
@allow_outside_option
@click.option("--port", type=click.IntRange(0, 65535), default=0, show_default="any free one", help="The port of the page.")
@click.option("--bind", default="127.0.0.1", show_default=True, metavar="ADDRESS",
              help="Where the page is served; others than this computer reach it with another address.")
@click.option("--read-only", is_flag=True, help="Let pages look and nothing else.")
@click.option("--allow-write", "writable", multiple=True, metavar="NAME",
              help="Let pages write and force this variable or address and what is in it, and nothing else; may be repeated.")
@click.option("--frame", "frames", multiple=True, metavar="SOURCE",
              help="Let pages of this scheme or origin, such as vscode-webview:, show the page in a frame; may be repeated.")
@click.option("--paused", is_flag=True, help="Wait before the first scan.")
@click.option("--speed", type=click.FloatRange(0, 1000), default=1.0, show_default=True, metavar="N",
              help="How fast virtual time passes: 1 as the clock, 0.1 ten times slower, 0 as fast as it goes.")
@debug_option
@click.option("--trace", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Record the run, with what is done on the page, for `fbvm chart`, `table`, `why`, `convert` and `replay`.")
def command(
    files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], cycle_ns: int, net: str,
    mappings: tuple[Mapping, ...], doors: tuple[Door, ...], port: int, bind: str, read_only: bool, writable: tuple[str, ...],
    frames: tuple[str, ...], paused: bool, speed: float, debug_port: int | None, trace: Path | None,
) -> None:  # fmt: skip
    """Run a program or a PROJECT and print the address of a page on which it lives: values, rungs with power, the scan that
    stops, steps and goes back, units, frames and faults.  When the files change, the page offers to begin the changed program.

    Ends by Ctrl-C.  The address has a token: who does not have it sees nothing.  Status 3 if the program has errors, 5 if the
    network or the port of the page cannot be used."""
    check_live_installed()
    from fbvm.live.guard import FRAME

    if debug_port is not None and trace:
        raise click.UsageError("--debug looks into scans itself: leave out --trace")
    for frame in frames:
        if not FRAME.fullmatch(frame):
            raise click.UsageError(f"--frame {frame}: write a scheme or an origin, such as vscode-webview: or http://127.0.0.1:8080")
    control = Control(is_paused=paused, speed=speed)
    options = PageOptions(bind, port, read_only, writable, frames, debug_port)
    if project := project_argument(files):
        if mappings or doors:
            raise click.UsageError("--map and --door are for FILE: what a project does stands in its file")
        said = click.get_current_context().get_parameter_source("net") is not ParameterSource.DEFAULT
        origin = project_origin(project, net if said else None, lambda run: Running(run.plc, scans=ENDLESS, writes=run.writes))
        serve_page(origin, control, options, {"trace": trace})
        return
    kind = net_of(net, doors)
    if kind == "loop" and (doors or any(row.host is not None for row in mappings)):
        raise click.UsageError("--door and --map to a real host leave memory: add --net tcp")
    image = compile_or_exit(files, program, libraries, runnable=True)
    made = FileOrigin(files, libraries, image, _wiring(cycle_ns, kind, mappings, doors), lambda plc: Running(plc, scans=ENDLESS),
                      {"program": program, **compile_options(files)}, repeatable=kind == "loop" and not mappings)  # fmt: skip
    serve_page(made, control, options, {"trace": trace})


def _wiring(cycle_ns: int, net: str, mappings: tuple[Mapping, ...],
            doors: tuple[Door, ...]) -> Callable[[Image], tuple[Plc, Callable[[], None]]]:  # fmt: skip
    """What gives a program its PLC, units and network."""

    def wire(image: Image) -> tuple[Plc, Callable[[], None]]:
        network = build_network(net, mappings, 0, "127.0.0.1", doors)
        plc = Plc(image, cycle_ns)
        for unit in usual_units(mailbox_names(image)):
            plc.attach(unit, network)
        try_doors(plc, network, mappings, doors)
        return plc, network.close

    return wire
