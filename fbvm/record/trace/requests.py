"""Who asked a Modbus server what, and what came of it: a network's tap as JSON lines, one a reply."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from typing import IO

from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Splitter, decode_request
from fbvm.wire.tap import Happening, What

SECOND_NS = 1_000_000_000


class _Conversation:
    """One connection: its two streams, and the requests that have no reply yet."""

    def __init__(self) -> None:
        self.asked = Splitter()
        self.answered = Splitter()
        self.open: deque[Adu] = deque()


class RequestLog:
    """Writes a line for each request when it is answered: time (seconds since 1970), peer, function, address, count,
    result (0 or the exception code) and scan; null where a request has none.

    `epoch_ns` is the date of the PLC's time 0, `scan` tells the number of the scan.  Knows only what passed the tap."""

    def __init__(self, file: IO[str], epoch_ns: int, scan: Callable[[], int]) -> None:
        self._file = file
        self._epoch_ns = epoch_ns
        self._scan = scan
        self._conversations: dict[tuple[Peer, Peer], _Conversation] = {}

    def tap(self, now_ns: int, unit: str, happening: Happening) -> None:
        """What a network calls."""
        key = happening.local, happening.remote
        if happening.what is What.DATA:
            self._data(now_ns, self._conversations.setdefault(key, _Conversation()), happening)
        elif happening.what in (What.OPEN, What.RST):
            self._conversations.pop(key, None)

    def _data(self, now_ns: int, there: _Conversation, happening: Happening) -> None:
        if not happening.out:
            there.open += [found for found in there.asked.feed(happening.data) if isinstance(found, Adu)]
            return
        for found in there.answered.feed(happening.data):
            if isinstance(found, Adu) and there.open:
                self._write(now_ns, happening.remote, there.open.popleft(), found)
        self._file.flush()

    def _write(self, now_ns: int, peer: Peer, request: Adu, reply: Adu) -> None:
        asked = decode_request(request.pdu)
        row = {
            "time": round((self._epoch_ns + now_ns) / SECOND_NS, 6),
            "peer": str(peer),
            "function": request.pdu[0],
            "address": asked.fields.get("address"),
            "count": asked.fields.get("quantity", 1 if "value" in asked.fields else None),
            "result": reply.pdu[1] if reply.pdu[0] & 0x80 else 0,
            "scan": self._scan(),
        }
        self._file.write(json.dumps(row) + "\n")
