"""Who may talk to the page's server: a browser of this computer that was given the address with its token, and nobody else.

The token is a secret in the address.  Host and Origin are checked besides, so that neither a site that the user visits
(cross-site request forgery) nor a name that an attacker lets point to 127.0.0.1 (DNS rebinding) gets anything."""

from __future__ import annotations

import hmac
import re
import secrets
from collections.abc import Sequence
from http import HTTPStatus
from urllib.parse import parse_qs

TOKEN_BYTES = 24
SOCKET_PATH = "/live"
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
"""Names by which a browser may call a server on this computer's loopback."""
SECURITY_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; "
                               "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}  # fmt: skip
"""What answers say to the browser, as long as nobody may hold the page in a frame.  No Access-Control header is among them: other
sites read nothing."""
FRAME = re.compile(r"[a-z][a-z0-9+.-]*:(?://(?:\*\.)?[a-z0-9.-]+(?::(?:\d{1,5}|\*))?)?", re.I)
"""Who may hold the page in a frame: a scheme such as `vscode-webview:`, or an origin; `*` is any port or subdomain."""


def security_headers(frames: Sequence[str] = ()) -> dict[str, str]:
    """What every answer says to the browser; pages of `frames` may hold the page in a frame.  Raises ValueError for what is no
    scheme and no origin."""
    for frame in frames:
        if not FRAME.fullmatch(frame):
            raise ValueError(f"{frame!r} is no scheme and no origin, such as vscode-webview: or http://127.0.0.1:8080")
    if not frames:
        return SECURITY_HEADERS
    policy = SECURITY_HEADERS["Content-Security-Policy"].replace("frame-ancestors 'none'", f"frame-ancestors {' '.join(frames)}")
    held = ("X-Frame-Options", "Cross-Origin-Resource-Policy")
    return {name: text for name, text in SECURITY_HEADERS.items() if name not in held} | {"Content-Security-Policy": policy}


def new_token() -> str:
    """A token that nobody can guess."""
    return secrets.token_urlsafe(TOKEN_BYTES)


class Guard:
    """Checks requests.  `port` is the server's, `bind` the address at which it listens, `token` the secret; pages of `frames`
    may hold the page in a frame."""

    def __init__(self, port: int, bind: str = "127.0.0.1", token: str | None = None, frames: Sequence[str] = ()) -> None:
        self.headers = security_headers(frames)
        self.token = token or new_token()
        self.port = port
        self._names = {name for name in (*LOOPBACK, bind) if name != "0.0.0.0"}
        self._is_open = bind == "0.0.0.0"

    def address(self, name: str = "127.0.0.1") -> str:
        """The address for the user's browser.  The token stands behind the #, which browsers send to nobody."""
        return f"http://{name}:{self.port}/#token={self.token}"

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> tuple[HTTPStatus, str] | None:
        """Why a request is refused: status and sentence; None if it is not.

        `path` is the request target, `hosts` and `origins` are the values of its Host and Origin headers.  Files of the page hold
        no secret and want no token; the WebSocket does, in its query."""
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return HTTPStatus.MISDIRECTED_REQUEST, "this server answers to the address that fbvm has printed"
        is_socket = path.partition("?")[0] == SOCKET_PATH
        if is_socket and len(origins) > 1 or any(origin != f"http://{hosts[0]}" for origin in origins):
            return HTTPStatus.FORBIDDEN, "another site's page may not talk to a PLC"
        if is_socket and not self._knows(path):
            return HTTPStatus.FORBIDDEN, "the token is missing or wrong: open the address that fbvm has printed"
        return None

    def _is_own(self, host: str) -> bool:
        name, colon, port = host.rpartition(":")
        if not colon or port != str(self.port):
            return False
        return name.lower() in self._names or self._is_open and _is_ipv4(name)

    def _knows(self, path: str) -> bool:
        try:
            given = parse_qs(path.partition("?")[2], max_num_fields=4).get("token", [])
        except ValueError:
            return False
        return len(given) == 1 and hmac.compare_digest(given[0].encode("utf-8", "replace"), self.token.encode())


def _is_ipv4(name: str) -> bool:
    """True for four numbers, which no name server can point elsewhere."""
    parts = name.split(".")
    return len(parts) == 4 and all(part.isascii() and part.isdecimal() and len(part) <= 3 and int(part) <= 255 for part in parts)
