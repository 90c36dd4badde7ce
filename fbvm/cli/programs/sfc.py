"""`fbvm sfc`: the sequential function charts of a program as drawings."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.base.files import write_file
from fbvm.cli.shared.drawings import SVG_WIDTH, print_lines
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.sources import compile_or_exit, source_arguments
from fbvm.cli.shared.terminal import say
from fbvm.code.image import Image, SfcPicture
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.sfc_text import LEAST, sfc_surface, sfc_text


@click.command("sfc")
@source_arguments
@click.option("--width", type=click.IntRange(min=LEAST), help="Columns of text; the terminal's if not given.")
@click.option("--svg", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Write an SVG file instead.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], width: int | None,
            svg: Path | None) -> None:
    """Draw the sequential function charts of the files, POU by POU."""
    image = compile_or_exit(files, program, libraries, runnable=False)
    if not image.charts:
        raise click.UsageError("there is no chart in these files: no POU has an INITIAL_STEP")
    if svg:
        drawn = [(_head(image, chart), sfc_surface(chart, width or SVG_WIDTH)) for chart in image.charts]
        with writing(svg):
            write_file(svg, ladder_svg(drawn))
        return
    for chart in image.charts:
        say(_head(image, chart))
        print_lines(sfc_text(chart, width or chart_width()))


def _head(image: Image, chart: SfcPicture) -> str:
    return f"{image.bodies[chart.body].kind} {image.bodies[chart.body].name}"
