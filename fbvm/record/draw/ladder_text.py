"""Rungs of an Image as drawings: the headline, and what `syntax/ladder/drawing/drawing.py` draws of the steps."""

from __future__ import annotations

from fbvm.code.image import RungPicture
from fbvm.syntax.ladder.drawing.box_lines import Surface
from fbvm.syntax.ladder.drawing.drawing import rung_surface
from fbvm.syntax.ladder.drawing.widths import Annotations

AT_REST = Annotations()


def ladder_text(picture: RungPicture, width: int = 80, annotations: Annotations = AT_REST, least: int = 0) -> list[str]:
    """The lines of a rung, whose right rail stands in column `least` or behind it."""
    return [_head(picture), *_surface(picture, width, annotations, least).rows()]


def ladder_surface(picture: RungPicture, width: int = 80, annotations: Annotations = AT_REST,
                   least: int = 0) -> tuple[str, Surface]:
    """The headline of a rung, which names the section that begins with it, and its drawing."""
    section = f"SECTION {picture.section}, " if picture.section else ""
    return section + _head(picture), _surface(picture, width, annotations, least)


def _head(picture: RungPicture) -> str:
    return " ".join(filter(None, (f"RUNG {picture.number}", picture.comment)))


def _surface(picture: RungPicture, width: int, annotations: Annotations, least: int) -> Surface:
    return rung_surface([step[1:] for step in picture.steps], width, annotations, least) if picture.steps else Surface()
