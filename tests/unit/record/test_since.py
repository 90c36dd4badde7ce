"""Since when a value is as it is, in words; what is read of the network, and of bits in memory."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.code.image import Site
from fbvm.record.draw.why import Cause, Change, Phase, _since
from fbvm.record.trace.events import NetworkEvent, bit_at
from fbvm.record.trace.reader import _passing
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

SITE = Site("a.st", "Main", 7, 1)
WHEN = " since scan 5 (20ms)"


@each_of(("first", "change", "repeated", "said"), (
    (0, None, False, " since power-on"), (3, None, True, " since before scan 3, the first of the trace"),
    (1, None, True, " since before scan 1, the first of the trace"),
    (0, {"phase": Phase.REFRESH}, False, f"{WHEN}, by a unit in the I/O refresh"),
    (0, {"phase": Phase.PROGRAM}, False, f"{WHEN}, by a statement that is not recorded: there were too many in this scan"),
    (0, {"phase": Phase.INPUTS}, False, f"{WHEN}, from outside the program"), (0, {}, False, f"{WHEN}, by a stub"),
    (0, {"site": SITE}, False, f"{WHEN}, by a.st:7:  x := y;"),
    (0, {"site": SITE, "instance": "Main.f"}, True, f"{WHEN}, by a.st:7 in Main.f:  x := y;  (see above)"),
    (0, {"site": Site("b.st", "Main", 9, 1)}, True, f"{WHEN}, by b.st:9  (see above)")))
def test_since_when_a_value_is_as_it_is(first: int, change: dict[str, Any] | None, repeated: bool, said: str) -> None:
    trace: Any = SimpleNamespace(scans=range(first, 9), line=lambda site: "x := y;" if site.file == "a.st" else "")
    place: Any = None
    made = None if change is None else Change(5, 20_000_000, 1, **change)
    assert _since(trace, Cause(place, "1", made, repeated=repeated)) == said


def test_what_passed_the_network_is_read() -> None:
    row = [20, "data", "192.168.250.1", 502, "192.168.250.2", 5000, 1, "", "00ff"]
    found = _passing(json.dumps(row).encode())
    assert found == NetworkEvent(20, TapEvent(
        TapKind.DATA, Peer("192.168.250.1", 502), Peer("192.168.250.2", 5000), True, b"\0\xff", False))
    for at, wrong in ((0, "now"), (1, "words"), (3, "x"), (8, "0g")):
        with pytest.raises(IndexError, match="an event of the network cannot be read"):
            _passing(json.dumps([*row[:at], wrong, *row[at + 1 :]]).encode())
    with pytest.raises(IndexError):
        _passing(json.dumps(row[:-1]).encode())


def test_the_value_of_a_bit_is_a_byte() -> None:
    memory = b"\x00\x81\x02\x03"
    assert [bit_at(memory, 1, bit) for bit in (0, 1, 7)] == [b"\1", b"\0", b"\1"]
