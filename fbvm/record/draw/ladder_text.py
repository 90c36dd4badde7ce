"""Rungs of an Image as drawings: the headline, and what `syntax/ladder/drawing/drawing.py` draws of the steps."""

from __future__ import annotations

from fbvm.code.image import RungPicture
from fbvm.syntax.ladder.drawing.box_lines import Surface
from fbvm.syntax.ladder.drawing.drawing import rung_surface
from fbvm.syntax.ladder.drawing.widths import Annotations

AT_REST = Annotations()


def ladder_text(picture: RungPicture, width: int = 80, annotations: Annotations = AT_REST, least: int = 0) -> list[str]:
    """The lines of a rung, whose right rail stands in column `least` or behind it."""
    head, surface = ladder_surface(picture, width, annotations, least)
    return [head, *surface.rows()]


def ladder_surface(picture: RungPicture, width: int = 80, annotations: Annotations = AT_REST,
                   least: int = 0) -> tuple[str, Surface]:
    """The headline of a rung and its drawing."""
    head = " ".join(filter(None, (f"RUNG {picture.number}", picture.comment)))
    if not picture.steps:
        return head, Surface()
    return head, rung_surface([step[1:] for step in picture.steps], width, annotations, least)
