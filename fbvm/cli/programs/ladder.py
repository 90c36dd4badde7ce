"""`fbvm ladder`: rungs as drawings; and what `fbvm run --ladder` draws."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from fbvm.base.types import StructType, fold
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.outcome import chart_width
from fbvm.cli.shared.sources import compiled, source_arguments
from fbvm.code.image import Image, RungPicture
from fbvm.machine.plc import Plc
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.ladder_text import ladder_surface, ladder_text
from fbvm.record.draw.power import Power
from fbvm.record.draw.rung_values import Values
from fbvm.record.trace.history import looking
from fbvm.syntax.ladder.drawing.widths import Sight
from fbvm.watch.names import Names
from fbvm.watch.paths import Place

SVG_WIDTH = 120
"""Columns of a picture."""
_SPAN = re.compile(r"([0-9]{1,18})(?:\.\.([0-9]{1,18}))?")


@click.command("ladder")
@source_arguments
@click.option("--width", type=click.IntRange(min=24), help="Columns of text; the terminal's if not given.")
@click.option("--svg", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE", help="Draw into a picture instead.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], width: int | None,
            svg: Path | None) -> None:
    """Draw the rungs of the files, POU by POU."""
    image = compiled(files, program, libraries, runnable=False, drawn=True)
    if not image.rungs:
        raise click.UsageError("there is nothing to draw in these files")
    if svg:
        drawn = [ladder_surface(rung, width or SVG_WIDTH, Sight(None, _places(image, rung.body))) for rung in image.rungs]
        with writing(svg):
            svg.write_text(ladder_svg(drawn), encoding="utf-8")
        return
    body = -1
    for rung in image.rungs:
        if rung.body != body:
            body = rung.body
            click.echo(f"{image.bodies[body].kind} {image.bodies[body].name}")
        _draw(rung, width or chart_width(), Sight(None, _places(image, rung.body)))


def _draw(rung: RungPicture, width: int, sight: Sight) -> None:
    for line in ladder_text(rung, width, sight):
        click.echo(line)
    click.echo()


def _places(image: Image, body: int) -> Callable[[str], str]:
    """The addresses of what a POU declares AT one, and of global variables."""
    own = image.types.get(fold(image.bodies[body].name))
    names = Names.of(image, image.layout.areas)

    def place(symbol: str) -> str:
        name = fold(symbol)
        field = own.fields.get(name) if isinstance(own, StructType) else None
        field = field or image.symbols.get(name)
        if field is None or not field.absolute:
            return ""
        return names.address(Place(field.name, field.type, field.offset, field.bit)).removeprefix("CIO ")

    return place


def scans_named(text: str) -> Callable[[int], bool]:
    """Which scans `3,5..7` names.  Another text is a mistake of usage."""
    wanted: list[range] = []
    for part in text.split(","):
        match = _SPAN.fullmatch(part.strip())
        if not match or not (span := range(int(match[1]), int(match[2] or match[1]) + 1)):
            raise click.UsageError(f"{text!r} names no scans; write 3 or 3,5..7")
        wanted.append(span)
    return lambda scan: any(scan in span for span in wanted)


def tell_nothing_drawn(plc: Plc, option: str, part: str, there: bool) -> None:
    """Says why an option drew nothing: no such `part` is in the program, or none was executed in the scans it names."""
    why = f"no {part} was executed in these scans; the run had scans 0 to {plc.scans - 1}" if there and plc.scans else \
        f"no {part} was executed" if there else f"there is no {part} in this program"  # fmt: skip
    click.secho(f"{option}: {why}", fg="yellow", err=True)


@contextmanager
def drawing(plc: Plc, scans: str | None) -> Iterator[None]:
    """Watches the power in the rungs of a PLC meanwhile, and then draws them as they were in these scans."""
    if not scans:
        yield
        return
    values = Values(plc.image, plc.memory.areas)
    power = Power(plc.image.rungs, scans_named(scans), values.keep)
    with looking(plc, power):
        yield
    if not power.executed:
        tell_nothing_drawn(plc, f"--ladder {scans}", "rung", bool(plc.image.rungs))
    names = Names.of(plc.image, plc.memory.areas)
    before: tuple[int, int] | None = None
    for made in power.executed:
        if before != (made.scan, made.base):
            before = made.scan, made.base
            click.echo(f"scan {made.scan}, {names.instance(made.base)}")
        _draw(made.picture, chart_width(), Sight(made.states, _places(plc.image, made.picture.body), values.of(made)))
