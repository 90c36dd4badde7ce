"""What each misdeed makes of a reply, and what each rude server does, word for word, beside `misdeeds_kept.txt`.

A line has the name and what is done, with the milliseconds it waits; of many pieces the first two and the last.  The replies
are to Fn 03, two registers, and to Fn 06.  `FBVM_REWRITE=1 pytest` of this file writes it anew: read the difference before you
keep it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS, by_script, by_seed
from fbvm.net.peers import Actions, Say
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

READ, WRITE = bytes.fromhex("0102 0000 0007 11 03 04 0A0B 0C0D"), bytes.fromhex("0103 0000 0006 11 06 0010 00FF")
ASKED = [bytes.fromhex(text) for text in ("0104 0000 0006 11 03 0000 0001", "0105 0000 0006 11 03 0001 0001",
                                          "0106 0000 0006 11 03 0002 0001")]  # fmt: skip
MS = 1_000_000


def spaced(data: bytes) -> str:
    """A frame in its fields; of long bytes the beginning, and how many there are."""
    if len(data) > 60:
        return f"{data[:8].hex(' ')} ... {len(data)} bytes"
    parts = data[:2], data[2:4], data[4:6], data[6:7], data[7:8], data[8:]
    return " ".join(part.hex() for part in parts if part)


def done(actions: Actions) -> str:
    said = []
    for action in actions:
        text = f"{type(action).__name__.lower()}" + (f" {spaced(action.data)}" if isinstance(action, Say) else "")
        said.append(text + (f" at {action.after_ns // MS}" if action.after_ns else ""))
    if len(said) > 4:
        said = [*said[:2], f"... {len(said)} ...", said[-1]]
    return "; ".join(said) or "nothing"


def lines() -> Iterator[str]:
    for name, reply in MISDEEDS.items():
        yield f"{name}: {done(reply(READ))}"
        yield f"{' ' * len(name)}  {done(reply(WRITE))}"
    scripted = by_script("one byte", "", "fin")
    yield "by script: " + " | ".join(done(scripted(READ)) for _ in range(4))
    drawn = by_seed(3, 0.5, ["one byte", "fin"])
    yield "by seed: " + " | ".join(done(drawn(READ)) for _ in range(8))
    for name, make in RUDE_PEERS.items():
        peer = make(ModbusServer())
        conversations = [peer.accept(Peer("10.0.0.1", 5000 + number)) for number in range(2)]
        taken = sum(each is not None for each in conversations)
        yield f"{name}: takes {taken} of 2" + ("; deaf" if peer.deaf else "")
        if (found := conversations[0]) is not None:
            yield f"    {'reads' if found.reads else 'does not read'}; begins with {done(found.connected(0))}"
            yield "    " + " | ".join(done(found.received(asked, 0)) for asked in ASKED)
            peer.reform()  # type: ignore[attr-defined]
            again = found.connected(0), found.received(ASKED[0], 0)
            assert found.reads and peer.accept(Peer("10.0.0.1", 1)) is not None
            yield f"    reformed: {done(again[0])}, {done(again[1])}"


def test_misdeeds_are_done_as_they_are_kept() -> None:
    file = Path(__file__).with_name("misdeeds_kept.txt")
    came = "".join(f"{line}\n" for line in lines())
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == file.read_text(encoding="utf-8")
