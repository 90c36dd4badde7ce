"""The page of a run: one HTML file that opens offline, with everything in it.

Its contents are those of `page.data`; HTML, CSS and JavaScript are files of this folder, which are put together unchanged.
"""

from __future__ import annotations

import base64
import html
import re
from functools import cache
from pathlib import Path

from fbvm.record.page.data import PageData, packed

FOLDER = Path(__file__).parent
SCRIPTS = ("inflate.js", "columns.js", "model.js", "drawing.js", "chart.js", "panels.js", "main.js")
_PLACE = re.compile(r"\{\{(title|failure|style|script|data)\}\}")
"""Where the parts of a page go in `page.html`; what is put in is not searched again."""


def page(data: PageData, failure: str = "") -> str:
    """The text of the HTML file; `failure` is the text of a failed assertion."""
    failure = html.escape(failure)
    head = packed(data.head)
    parts = {
        "title": html.escape(str(data.head["title"])),
        "failure": f'<pre id="failure" aria-label="The failed assertion">{failure}</pre>' if failure else "",
        "style": _file("page.css"),
        "script": "\n".join(_file(name) for name in SCRIPTS),
        "data": base64.b64encode(b"".join([len(head).to_bytes(4, "little"), head, *data.parts])).decode("ascii"),
    }
    return _PLACE.sub(lambda place: parts[place[1]], _file("page.html"))


@cache
def _file(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
