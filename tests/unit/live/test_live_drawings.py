"""Drawings of others: only what draws gets into the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbvm.live.drawings import DrawingError, clean_drawing

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 9 9">'


def cleaned(inside: str, head: str = HEAD) -> tuple[str, list[str]]:
    return clean_drawing(f"{head}{inside}</svg>".encode())


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("<script>alert(1)</script>", "<script>"),
        ('<rect onclick="alert(1)"/>', "onclick"),
        ('<rect onload="alert(1)" ONMOUSEOVER="alert(2)"/>', "onload"),
        ('<foreignObject><body xmlns="http://www.w3.org/1999/xhtml"><img src="x"/></body></foreignObject>', "<foreignObject>"),
        ('<image href="http://evil.example/x.png"/>', "<image>"),
        ('<a href="javascript:alert(1)"><rect/></a>', "<a>"),
        ('<use href="http://evil.example/x.svg#a"/>', "a reference to another file"),
        ('<use xlink:href="data:image/svg+xml;base64,AAAA#a"/>', "a reference to another file"),
        ("<style>@import url(http://evil.example/x.css)</style>", "<style>"),
        ('<rect fill="url(http://evil.example/#a)"/>', "fill with a reference"),
        ('<rect style="fill: URL( \'http://evil.example/\' )"/>', "fill with a reference"),
        ('<rect style="fill: u\\72l(http://evil.example/)"/>', "fill with a reference"),
        ('<animate attributeName="href" values="javascript:alert(1)"/>', "<animate>"),
        ('<set attributeName="onclick" to="alert(1)"/>', "<set>"),
        ("<filter><feImage href='http://evil.example/'/></filter>", "<filter>"),
        ('<rect tabindex="0" class="chip"/>', "class"),
    ],
)  # fmt: skip
def test_what_does_more_than_draw_is_left_out_and_said(inside: str, said: str) -> None:
    svg, left_out = cleaned(inside)
    assert said in left_out
    for word in ("alert", "evil", "script", "onclick", "data:", "xhtml", "import"):
        assert word not in svg.lower()


def test_elements_of_other_languages_are_left_out_silently_as_editors_write_them() -> None:
    svg, left_out = cleaned('<i:layer xmlns:i="http://inkscape.org/x" onclick="alert(1)"/><g i:label="a" xmlns:i="http://i.org/"/>')
    assert left_out == [] and "layer" not in svg and "label" not in svg and "<g" in svg


def test_shapes_texts_gradients_and_styles_stay_with_ids_of_their_own() -> None:
    svg, left_out = cleaned('<defs><linearGradient id="watch"><stop offset="1" style="stop-color:#fff"/></linearGradient></defs>'
                            '<rect id="log" style="fill:url(#watch);stroke:red;-inkscape-x:1"/><use href="#log"/>'
                            '<text x="1">a &lt;b&gt;<tspan>c</tspan> d</text>')  # fmt: skip
    assert left_out == [] and svg.startswith("<svg ") and svg.count('xmlns="http://www.w3.org/2000/svg"') == 1
    assert 'viewBox="0 0 9 9"' in svg
    assert 'id="m-watch"' in svg and 'fill="url(#m-watch)"' in svg and 'href="#m-log"' in svg and 'stop-color="#fff"' in svg
    assert 'stroke="red"' in svg and "a &lt;b&gt;<tspan>c</tspan> d" in svg


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b'<!DOCTYPE svg [<!ENTITY a "b">]><svg xmlns="http://www.w3.org/2000/svg">&a;</svg>', "entities"),
        (b"<html/>", "no SVG"), (b"<svg/>", "no SVG"), (b"", "no SVG"), (b"\xff\xfe<svg/>", "UTF-8"),
        (b" " * ((1 << 20) + 1), "1 MiB"),
        (HEAD.encode() + b"<g>" * 200 + b"</g>" * 200 + b"</svg>", "100 within each other"),
    ],
)  # fmt: skip
def test_what_is_no_drawing_is_refused_in_words(data: bytes, said: str) -> None:
    with pytest.raises(DrawingError, match=said):
        clean_drawing(data)


@pytest.mark.parametrize("name", ["tank/tank.svg", "conveyor/conveyor.svg"])
def test_the_shipped_drawings_lose_nothing(name: str) -> None:
    assert clean_drawing((Path(__file__).parents[3] / "examples" / name).read_bytes())[1] == []
