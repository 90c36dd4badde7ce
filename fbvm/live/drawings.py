"""Drawings of others, made safe: of an SVG file only shapes, texts and what colours them get into the page.

No script, no handler of events, no style sheet, no image and no reference to another file passes; whatever is not in the tables
below is left out, and is said."""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.etree import ElementTree

MOST_BYTES = 1 << 20
MOST_ELEMENTS = 20_000
SVG = "http://www.w3.org/2000/svg"
XLINK = "{http://www.w3.org/1999/xlink}href"
ELEMENTS = {
    "svg", "g", "defs", "symbol", "use", "title", "desc", "path", "rect", "circle", "ellipse", "line", "polyline", "polygon",
    "text", "tspan", "linearGradient", "radialGradient", "stop", "clipPath", "marker", "pattern",
}  # fmt: skip
"""Elements of SVG 1.1 that only draw."""
LOOKS = {
    "fill", "fill-opacity", "fill-rule", "stroke", "stroke-width", "stroke-opacity", "stroke-linecap", "stroke-linejoin",
    "stroke-dasharray", "stroke-dashoffset", "stroke-miterlimit", "opacity", "color", "display", "visibility", "font-family",
    "font-size", "font-weight", "font-style", "text-anchor", "dominant-baseline", "letter-spacing", "stop-color",
    "stop-opacity", "clip-path", "clip-rule", "marker-start", "marker-mid", "marker-end", "paint-order",
}  # fmt: skip
"""Presentation attributes, which may stand in a style attribute, too."""
ATTRIBUTES = LOOKS | {
    "id", "d", "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "fx", "fy", "dx", "dy", "width", "height", "points",
    "transform", "viewBox", "preserveAspectRatio", "offset", "gradientUnits", "gradientTransform", "spreadMethod",
    "clipPathUnits", "markerWidth", "markerHeight", "markerUnits", "refX", "refY", "orient", "patternUnits",
    "patternContentUnits", "patternTransform", "textLength", "lengthAdjust", "rotate",
}  # fmt: skip
_FUNCTION = re.compile(r"url\s*\(", re.I)
_OWN = re.compile(r"\s*url\(\s*['\"]?#([\w.-]+)['\"]?\s*\)((?:\s+[\w#-]+)?)\s*")
PREFIX = "m-"
"""Begins the ids of a drawing in the page, so that they are not taken for those of the page's own elements."""
_FORBIDDEN = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.I)
_PLAIN = re.compile(r"[^<>\\]*")


class DrawingError(ValueError):
    """A file that is no drawing; the text says why."""


def clean_drawing(data: bytes) -> tuple[str, list[str]]:
    """The drawing in an SVG file as text that is safe in a page, its ids behind `PREFIX`, and what was left out.

    Raises DrawingError."""
    if len(data) > MOST_BYTES:
        raise DrawingError(f"it has more than {MOST_BYTES >> 20} MiB")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise DrawingError("it is not UTF-8") from None
    if _FORBIDDEN.search(text):
        raise DrawingError("it declares entities or a document type: save it as plain SVG")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise DrawingError(f"it is no SVG: {error}") from None
    if root.tag != f"{{{SVG}}}svg":
        raise DrawingError("it is no SVG: its first element is no <svg> of http://www.w3.org/2000/svg")
    cleaning = _Cleaning()
    made = cleaning.element(root, 0)
    assert made is not None
    made.set("xmlns", SVG)
    return ElementTree.tostring(made, encoding="unicode"), sorted(cleaning.left_out)


class _Cleaning:
    """Copies of what may stay, and the names of what may not."""

    def __init__(self) -> None:
        self.left_out: set[str] = set()
        self._count = 0

    def element(self, old: ElementTree.Element, depth: int) -> ElementTree.Element | None:
        tag = old.tag if isinstance(old.tag, str) else ""
        space, _, name = tag.rpartition("}")
        if space != f"{{{SVG}" or name not in ELEMENTS:
            if space == f"{{{SVG}":
                self.left_out.add(f"<{name[:40]}>")
            return None
        self._count += 1
        if self._count > MOST_ELEMENTS or depth > 100:
            raise DrawingError(f"it has more than {MOST_ELEMENTS:,} elements, or 100 within each other")
        made = ElementTree.Element(name, dict(self._attributes(old)))
        made.text = old.text
        for child in old:
            kept = self.element(child, depth + 1)
            if kept is not None:
                kept.tail = child.tail
                made.append(kept)
        return made

    def _attributes(self, old: ElementTree.Element) -> Iterator[tuple[str, str]]:
        for name, value in old.attrib.items():
            if name == "style":
                yield from self._styles(value)
            elif name in ("href", XLINK):
                if re.fullmatch(r"#[\w.-]+", value):
                    yield "href", f"#{PREFIX}{value[1:]}"
                else:
                    self.left_out.add("a reference to another file")
            elif name in ATTRIBUTES:
                yield from self._attribute(name, value)
            elif not name.startswith("{"):
                self.left_out.add(name[:40])

    def _styles(self, text: str) -> Iterator[tuple[str, str]]:
        for declaration in text.split(";"):
            name, colon, value = declaration.partition(":")
            if colon and name.strip() in LOOKS:
                yield from self._attribute(name.strip(), value.strip().removesuffix("!important").strip())

    def _attribute(self, name: str, value: str) -> Iterator[tuple[str, str]]:
        own = _OWN.fullmatch(value)
        if name == "id":
            yield name, PREFIX + value
        elif own:
            yield name, f"url(#{PREFIX}{own[1]}){own[2]}"
        elif _FUNCTION.search(value) or not _PLAIN.fullmatch(value):
            self.left_out.add(f"{name} with a reference")
        else:
            yield name, value
