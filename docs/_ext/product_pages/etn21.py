"""The page of the ETN21: its words and bits, request switches, parameter areas, states and response codes."""

from __future__ import annotations

import inspect

from fbvm.units.etn21 import codes, names
from fbvm.units.etn21 import map as words
from fbvm.units.etn21.unit import Etn21
from product_pages.markdown import code, page, table

NAME = "reference/etn21"


def pages() -> dict[str, str]:
    """The page of the unit."""
    layout = words.Layout.of(0)
    return {NAME: page(
        "# ETN21",
        inspect.getdoc(Etn21) or "",
        f"The unit with number N exchanges words with the CPU unit in each I/O refresh: {words.CIO_WORDS} words from "
        f"n = 1500 + 25 x N in CIO and {words.D_WORDS} words from m = 30000 + 100 x N in D. Addresses on this page are those of "
        f"unit number 0, where n is {layout.n} and m is {layout.m}. How it decides is a program in Structured Text, "
        "[`omron/etn21`](libraries/omron-etn21.md).",
        "## First words of each unit number",
        table(("unit number", "n (CIO)", "m (D)"), [(number, words.Layout.of(number).n, words.Layout.of(number).m)
                                                    for number in words.UNIT_NUMBERS]),
        "## Words and bits by address", *_descriptions(layout),
        "## Request switches", "Each parameter area has a byte of request switches. A program turns a switch ON, the unit turns "
        "it OFF when the service has ended.",
        table(("bit of the area's byte", "switch"), [(switch.value, name) for switch, name in names.SWITCH_NAMES.items()]),
        "## Status bits of a socket", table(("bit", "flag"), [(f"{bit:02}", name) for bit, name in names.FLAG_NAMES.items()]),
        "## Words of a parameter area", f"Area k begins at m + {words.PARAMETERS} + {words.PARAMETERS_LENGTH} x (k - 1).",
        table(("offset", "address in area 1", "word"), [(offset, code(f"D{layout.parameters(1) + offset}"), name)
                                                        for offset, name in names.PARAMETER_NAMES.items()]),
        "## TCP connection states", table(("value", "state"), [(f"{state.value:04X}", state.name) for state in words.TcpState]),
        "## Response codes", _about_codes(),
        table(("code", "meaning"), [(f"{value:04X}", said) for value, said in sorted(_codes().items())]),
    )}  # fmt: skip


def _descriptions(layout: words.Layout) -> list[str]:
    """A table for the unit as a whole, and one each for the first area, the first TCP and the first UDP socket."""
    said = names.descriptions(layout)
    first = {address: name for address, name in said.items() if not name.rpartition(" ")[2].isdecimal()}
    return [table(("address", "name"), [(code(address), name) for address, name in first.items()]),
            "Sockets and areas 2 to 8 follow: a status word each, a parameter area of ten words each, and a byte of request "
            f"switches each. All {len(said)} names stand in charts: `fbvm run FILE --scans 20 --chart` draws those that "
            "changed."]  # fmt: skip


def _about_codes() -> str:
    return " ".join((codes.__doc__ or "").partition("\n\n")[2].split())


def _codes() -> dict[int, str]:
    return {value: codes.meaning_of(value) for value in [*codes.MEANING, *codes.ERRNO.values()]}
