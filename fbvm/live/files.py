"""The files of the page, as they are served: from a table, so that no path of a request ever reaches the disk."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from http import HTTPStatus
from pathlib import Path

from websockets.datastructures import Headers
from websockets.http11 import Response

from fbvm.live.guard import SECURITY_HEADERS

FOLDER = Path(__file__).parent / "page"
HTML, SCRIPT, STYLE = "text/html; charset=utf-8", "text/javascript; charset=utf-8", "text/css; charset=utf-8"
FILES = {
    "/": ("live.html", HTML),
    "/live.css": ("live.css", STYLE),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
    **{f"/{name}.js": (f"{name}.js", SCRIPT)
       for name in ("main", "socket", "dom", "scan", "program", "watch", "trend", "units", "network", "memory", "plant", "press",
                    "change", "picture", "times", "lesson")},
}  # fmt: skip
"""The file and its media type by the path of a request."""


@cache
def _content(name: str) -> bytes:
    return (FOLDER / name).read_bytes()


def file_response(path: str, headers: Mapping[str, str] = SECURITY_HEADERS) -> Response:
    """The answer to a request for a file; 404 for a path that is not in the table.  `headers` are those of `guard`."""
    found = FILES.get(path.partition("?")[0])
    if found is None:
        return text_response(HTTPStatus.NOT_FOUND, "there is no such file")
    return _response(HTTPStatus.OK, found[1], _content(found[0]), headers)


def text_response(status: HTTPStatus, text: str) -> Response:
    """An answer of one sentence."""
    return _response(status, "text/plain; charset=utf-8", f"{text}\n".encode())


def _response(status: HTTPStatus, kind: str, body: bytes, headers: Mapping[str, str] = SECURITY_HEADERS) -> Response:
    said = Headers({"Content-Type": kind, "Content-Length": str(len(body)), "Connection": "close", **headers})
    return Response(status.value, status.phrase, said, body)
