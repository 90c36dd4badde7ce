"""What an ETN21 has that is not emulated: each row of the list in docs/howto/fins.md, as programs and clients see it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from fins_rig import UNIT, FinsRig, compiled

from fbvm.wire.link import Connect, Failed, Peer

GUIDE = Path(__file__).parents[3] / "docs" / "howto" / "fins.md"
N, M = 1500, 30000
ALL_SCANS = 50
OUTSIDE = """PROGRAM Main
VAR Switches AT %CIO1500 : WORD; Asked : BOOL; END_VAR
IF NOT Asked THEN Switches := {word}; Asked := TRUE; END_IF;
END_PROGRAM"""


def seen(word: int) -> tuple[int, int, int, int]:
    """n, n+17, n+18 and m+17 after a program has turned switches of n ON and waited."""
    rig = FinsRig(plc=compiled(OUTSIDE.format(word=word)))
    rig.plc.run(scans=ALL_SCANS)
    return tuple(rig.plc.read(name) for name in (f"CIO {N}", f"CIO {N + 17}", f"CIO {N + 18}", f"D{M + 17}"))  # type: ignore[return-value]


def is_refused(rig: FinsRig, port: int) -> bool:
    """Whether the unit refuses connections to one of its ports."""
    link = rig.network.attach("192.168.250.99")
    link.submit([Connect(1, Peer(UNIT, port))], rig.plc.now_ns)
    events = []
    for _ in range(3):
        rig.plc.scan()
        events += link.events(rig.plc.now_ns)
    return any(isinstance(event, Failed) and event.error == "ECONNREFUSED" for event in events)


def refusals(codes: list[int], unit: int = 0, end_code: str = "0402", **header: int) -> bool:
    """Whether all of these commands end with an end code and change nothing."""
    rig = FinsRig()
    return all(rig.command(code, "", unit=unit, **header) == (end_code, "") for code in codes)


def mail() -> None:
    switches, service, error, status = seen(word=1)
    assert switches == 1
    assert (service & 0b110, error & 0x3000, status) == (0, 0, 0)


def ftp() -> None:
    rig = FinsRig()
    assert is_refused(rig, 21)
    assert not is_refused(FinsRig(), 9600)
    assert rig.plc.read(f"CIO {N + 17}.00") is False


def sntp() -> None:
    switches, _, error, _ = seen(word=0x10)
    assert (switches, error & 0x0820) == (0x10, 0)
    rig = FinsRig()
    assert rig.command(0x0702, "26 11 22 13 44 04 00")[0] == "0000"
    rig.plc.scan()
    assert rig.plc.read("A352..A353") == [0x2213, 0x2611]


def setup() -> None:
    assert seen(word=0)[1] & 0x0F00 == 0
    assert refusals([0x0201, 0x0202, 0x0203])
    assert refusals([0x2750, 0x2760], unit=0x10)


def sockets() -> None:
    assert refusals([0x2701, 0x2702, 0x2703, 0x2704, 0x2710, 0x2711, 0x2712, 0x2713, 0x2714], unit=0x10)


def routing() -> None:
    assert refusals([0x0101, 0x0601], end_code="0502", network=3)


def files() -> None:
    assert refusals([0x0306, 0x0307, 0x0308, *range(0x2201, 0x2206), 0x2207, 0x2208, 0x220A, 0x220B, 0x220C, 0x2215, 0x2220])


def messages() -> None:
    assert refusals([0x0920])


def logs() -> None:
    assert refusals([0x2140, 0x2141])
    assert refusals([0x0802, 0x0803, 0x2720, *range(0x2761, 0x2765)], unit=0x10)


ROWS: dict[str, Callable[[], None]] = {
    "mail": mail, "FTP": ftp, "SNTP": sntp, "the unit's setup": setup, "sockets by CMND": sockets, "routing tables": routing,
    "files, programs": files, "message display": messages, "tests and logs": logs,
}  # fmt: skip


@pytest.mark.parametrize("row", ROWS)
def test_what_is_seen_of(row: str) -> None:
    ROWS[row]()


def test_the_list_has_these_rows() -> None:
    table = GUIDE.read_text(encoding="utf-8").partition("## What an ETN21 has that is not emulated")[2]
    assert re.findall(r"^\| (.+?) \| ", table, re.M)[1:] == list(ROWS)
