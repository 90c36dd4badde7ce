"""`fbvm ladder`: the rungs of a program as drawings."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import click

from fbvm.base.files import write_file
from fbvm.cli.shared.drawings import SVG_WIDTH, comment_lines, print_lines, rail_column, rung_lines, say_section, symbol_addresses
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.given_sources import sources_of
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.sources import compile_or_exit, source_arguments
from fbvm.cli.shared.terminal import say
from fbvm.interchange.contents import contents
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.ladder_text import ladder_surface
from fbvm.syntax.ladder.drawing.widths import Annotations


@click.command("ladder")
@source_arguments
@click.option("--width", type=click.IntRange(min=24), help="Columns of text; the terminal's if not given.")
@click.option("--comments", "commented", is_flag=True, help="Print names, addresses and comments of operands below each rung.")
@click.option("--svg", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Write an SVG file instead.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], width: int | None,
            commented: bool, svg: Path | None) -> None:
    """Draw the rungs of the files, POU by POU."""
    image = compile_or_exit(files, program, libraries, runnable=False, drawn=True)
    if not image.rungs:
        raise click.UsageError("there is nothing to draw in these files")
    if svg:
        names = {body: symbol_addresses(image, body) for body in {rung.body for rung in image.rungs}}
        annotated = [(rung, Annotations(None, names[rung.body], others=names[rung.body])) for rung in image.rungs]
        widest = rail_column(annotated, width or SVG_WIDTH)
        drawn = [ladder_surface(rung, width or SVG_WIDTH, annotations, widest) for rung, annotations in annotated]
        with writing(svg):
            write_file(svg, ladder_svg(drawn))
        return
    declared = contents(sources_of(files)) if commented else None
    for body, group in groupby(image.rungs, lambda rung: rung.body):
        rungs = list(group)
        say(f"{image.bodies[body].kind} {image.bodies[body].name}")
        for rung, lines in zip(rungs, rung_lines(image, rungs, width or chart_width()), strict=True):
            remarks = comment_lines(rung, image.bodies[body].name, symbol_addresses(image, body), declared) if declared else []
            say_section(rung)
            print_lines([*lines, *remarks])
