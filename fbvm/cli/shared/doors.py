"""What is said about doors in one voice: where units and servers listen, who reaches them, why one cannot be used."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import NoReturn

from fbvm.cli.shared import status
from fbvm.cli.shared.terminal import say
from fbvm.net.addresses import is_reachable
from fbvm.net.notices import EACH_TIME, Notice, NoticeKind
from fbvm.wire.link import Peer

LISTENING = "listening on "
"""The beginning of what follows the name of a door: host and port."""
MOST_CALLERS = 20
"""Callers of which is told that they wait or were turned away."""


def warn_if_reachable(real: Peer) -> None:
    """Warns of a port that other computers can reach."""
    if is_reachable(real.host):
        say(f"Other computers can reach {real}: whoever connects may read and write.", fg="yellow", err=True)


def say_doors(doors: Mapping[Peer, Peer]) -> None:
    """Says where on the host each unit's endpoint is, and warns of those that other computers can reach."""
    for endpoint, real in doors.items():
        say(f"{endpoint}: {LISTENING}{real}", err=True)
    for real in doors.values():
        warn_if_reachable(real)


def unusable(error: OSError) -> NoReturn:
    """Says why the network or a port cannot be used, and ends the verb with status 5."""
    why = error.strerror or str(error)
    say(why if "cannot be used" in why else f"the network cannot be used: {why}", err=True)
    sys.exit(status.NETWORK)


def notice_teller(how_to_map: str, known: Mapping[Peer, Peer] | None = None) -> Callable[[Notice], None]:
    """A function that says notices of a network on stderr.  `how_to_map` is what to write for a port that is mapped nowhere, with
    {endpoint} and {port}; of `known` doors is not said again that they listen."""
    turned_away = 0

    def tell(notice: Notice) -> None:
        nonlocal turned_away
        endpoint, real = notice.endpoint, notice.real
        if notice.kind is NoticeKind.LISTENING:
            if endpoint not in (known or {}):
                say_doors({endpoint: real})
            return
        if notice.kind in EACH_TIME:
            turned_away += 1
            if turned_away > MOST_CALLERS:
                return
        said = {
            NoticeKind.NOT_MAPPED: f"{endpoint} is not tried: ports below 1024 belong to the host; "
                                   + how_to_map.format(endpoint=endpoint, port=1000 + endpoint.port),
            NoticeKind.UNUSABLE: f"{endpoint}: {real} cannot be used: {notice.error}",
            NoticeKind.UNREACHED: f"{endpoint}: nobody answers at {real} ({notice.error})",
            NoticeKind.FULL: f"{endpoint}: a caller waits at {real}, since all sockets are in use",
            NoticeKind.TURNED_AWAY: f"{endpoint}: {real} is turned away, since no socket waits",
        }[notice.kind]  # fmt: skip
        say(said, fg="yellow", err=True)

    return tell
