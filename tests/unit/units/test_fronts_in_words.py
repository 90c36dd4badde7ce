"""Fronts of units from words that are set by hand, and all names of an ETN21's words, beside `etn21_words.txt`.

`FBVM_REWRITE=1 pytest` of this file writes the names anew; W420 4-1 and 4-2, W421 6-6, 6-7 and 6-9 have them."""

from __future__ import annotations

import os
from itertools import groupby
from pathlib import Path

from common_unit_tests import FakeMemory
from rows import each_of

from fbvm.units.etn21.front import front
from fbvm.units.etn21.map import Layout
from fbvm.units.etn21.unit import Etn21
from fbvm.units.front import Lamp, Socket

NAMES = Path(__file__).with_name("etn21_words.txt")
QUIET = ["RUN works", "ERC off no error", "ERH off no error", "LNK linked", "TCP off no connection"]


def memory(**words: int) -> FakeMemory:
    """A memory with a linked unit 2 (n = 1550, m = 30200) and these words, such as CIO1550 or D30210."""
    made = FakeMemory()
    made.words("CIO")[1567] = 1 << 14
    for name, value in words.items():
        area = name.rstrip("0123456789")
        made.words(area)[int(name[len(area) :])] = value
    return made


def shown(lamp: Lamp) -> str:
    return f"{lamp.name} {'' if lamp.is_on else 'off '}{lamp.said}"


@each_of(("words", "lamps"), [
    ({}, []), ({"A302": 1 << 2}, ["RUN off being initialized"]), ({"A302": 0xFFFB}, []),
    ({"CIO1568": 1 << 2 | 1 << 15}, ["ERC IP Address Setting Error, EEPROM Error"]),
    ({"CIO1568": 1 << 14}, ["ERH Address Disagreement"]), ({"CIO1567": 0xBFFF}, ["LNK off no link: the cable is pulled"]),
    ({"CIO1559": 1 << 15, "D30209": 4}, ["TCP 1 connected"]),
    ({"D30209": 4, "D30216": 4, "D30210": 3, "CIO1551": 1 << 15}, ["TCP 2 connected"]),
])  # fmt: skip
def test_the_lamps_of_an_etn21(words: dict[str, int], lamps: list[str]) -> None:
    found = [shown(lamp) for lamp in front(Layout.of(2), 10, memory(**words)).lamps]
    changed = {lamp.partition(" ")[0]: lamp for lamp in lamps}
    assert found == [changed.get(lamp.partition(" ")[0], lamp) for lamp in QUIET]


HOST = {"D30220": 0xC0A8, "D30221": 0xFA07}


@each_of(("words", "sockets"), [
    ({}, []), ({"D30218": 9}, []), ({"D30218": 0x0308}, [Socket("TCP 8", "CLOSED")]),
    ({"D30210": 4}, [Socket("TCP 2", "ESTABLISHED")]), ({"D30210": 0x1F}, [Socket("TCP 2", "16#1F")]),
    ({"D30210": 2, "CIO1560": 0x9, "D30202": 77}, [Socket("TCP 2", "SYN_SENT, opening, closing", received=77)]),
    ({"CIO1552": 0x8006, "D30202": 77}, [Socket("UDP 2", "OPEN, receiving, sending")]), ({"CIO1552": 1}, [
        Socket("UDP 2", "CLOSED, opening")]),
    ({"D30218": 1, "D30209": 4, "D30219": 502, **HOST, "D30222": 1024, "D30223": 12, "D30227": 0}, [
        Socket("TCP 1", "ESTABLISHED", "502", "192.168.250.7:1024", 0, 12)]),
    ({"D30218": 1, "D30222": 9}, [Socket("TCP 1", "CLOSED", "", "0.0.0.0:9")]),
    ({"D30218": 1, **HOST}, [Socket("TCP 1", "CLOSED", "", "192.168.250.7:0")]),
    ({"D30218": 1, "D30227": 0x2211}, [Socket("TCP 1", "CLOSED", result="2211 unit busy")]),
    ({"D30218": 1, "D30227": 0x004A}, [Socket("TCP 1", "CLOSED", result="004A ECONNREFUSED")]),
    ({"D30218": 1, "D30227": 0xABCD}, [Socket("TCP 1", "CLOSED", result="ABCD")]),
    ({"D30288": 3, "CIO1553": 0x8000, "D30297": 0x0302}, [  # the last area serves socket 3, which both protocols have
        Socket("TCP 3", "CLOSED", result="0302 CPU Unit error, cannot execute"),
        Socket("UDP 3", "OPEN", result="0302 CPU Unit error, cannot execute")]),
])  # fmt: skip
def test_the_sockets_of_an_etn21(words: dict[str, int], sockets: list[Socket]) -> None:
    made = front(Layout.of(2), 10, memory(**words))
    assert list(made.sockets) == sockets
    assert made.settings == (("UNIT No.", "2"), ("NODE No.", "0A")) and made.restart == ("A501.02", "TRUE")


def test_the_name_of_each_word_and_bit_of_an_etn21_and_what_its_values_mean() -> None:
    unit = Etn21(1)
    lines = [f"{address:<12} {name}" for address, name in unit.descriptions.items()]
    for _, rows in groupby(unit.meanings.items(), key=lambda row: id(row[1])):
        some = list(rows)
        lines += ["", f"{some[0][0]} to {some[-1][0]}"]
        lines += [f"    {value:04X} {said}" for value, said in sorted(some[0][1].items())]
    came = "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        NAMES.write_text(came, encoding="utf-8")
    assert came == NAMES.read_text(encoding="utf-8")
