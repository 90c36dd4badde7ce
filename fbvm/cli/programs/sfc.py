"""`fbvm sfc`: sequential function charts as drawings; and what `fbvm run --sfc` draws."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from fbvm.cli.programs.ladder import SVG_WIDTH, scans_named, tell_nothing_drawn
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.outcome import chart_width
from fbvm.cli.shared.sources import compiled, source_arguments
from fbvm.code.image import Image, SfcPicture
from fbvm.machine.plc import Plc
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.sfc_seen import Evolutions
from fbvm.record.draw.sfc_text import LEAST, sfc_surface, sfc_text
from fbvm.record.trace.history import looking
from fbvm.watch.names import Names


@click.command("sfc")
@source_arguments
@click.option("--width", type=click.IntRange(min=LEAST), help="Columns of text; the terminal's if not given.")
@click.option("--svg", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Draw into a picture instead.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], width: int | None,
            svg: Path | None) -> None:
    """Draw the sequential function charts of the files, POU by POU."""
    image = compiled(files, program, libraries, runnable=False)
    if not image.charts:
        raise click.UsageError("there is no chart in these files: no POU has an INITIAL_STEP")
    if svg:
        drawn = [(_head(image, chart), sfc_surface(chart, width or SVG_WIDTH)) for chart in image.charts]
        with writing(svg):
            svg.write_text(ladder_svg(drawn), encoding="utf-8")
        return
    for chart in image.charts:
        click.echo(_head(image, chart))
        _print(sfc_text(chart, width or chart_width()))


def _head(image: Image, chart: SfcPicture) -> str:
    return f"{image.bodies[chart.body].kind} {image.bodies[chart.body].name}"


def _print(lines: list[str]) -> None:
    for line in lines:
        click.echo(line)
    click.echo()


@contextmanager
def drawing(plc: Plc, scans: str | None) -> Iterator[None]:
    """Watches the charts of a PLC meanwhile, and then draws them as they were in these scans."""
    if not scans:
        yield
        return
    seen = Evolutions(plc.image.charts, scans_named(scans))
    with looking(plc, seen):
        yield
    if not seen.called:
        tell_nothing_drawn(plc, f"--sfc {scans}", "chart", bool(plc.image.charts))
    names = Names.of(plc.image, plc.memory.areas)
    for called in seen.called:
        click.echo(f"scan {called.scan}, {names.instance(called.base)}")
        _print(sfc_text(called.picture, chart_width(), called.sighted))
