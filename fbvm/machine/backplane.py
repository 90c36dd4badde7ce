"""The units that there are by name, and those that are on the backplane of a PLC where nobody says which."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from fbvm.units.contract import Unit
from fbvm.units.etn21.unit import Etn21
from fbvm.units.openplc.unit import OpenPlc
from fbvm.units.port.noc import Noc
from fbvm.units.port.tianxing import Tianxing

UNITS: Mapping[str, Callable[..., Unit]] = {"Etn21": Etn21, "Noc": Noc, "OpenPlc": OpenPlc, "Tianxing": Tianxing}
"""What makes a unit, by the name of its class, as journals write it."""
KINDS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "ETN21": ("Etn21", {"number": "unit_number", "timing": "timing", "seed": "seed", "fins": "fins", "fins_port": "fins_port",
                        "fins_node": "fins_node", "fins_nodes": "fins_nodes", "fins_clients": "fins_clients",
                        "fins_permitted": "fins_permitted", "fins_access": "fins_access",
                        "fins_error_flags": "fins_error_flags"}),
    "NOC": ("Noc", {"slot": "rack_slot", "mac": "mac", "module": "module_type", "http": "http", "ftp": "ftp",
                    "restart": "restart_ns"}),
    "OpenPLC": ("OpenPlc", {"port": "port", "clients": "clients", "read_only": "read_only"}),
    "Tianxing": ("Tianxing", {"model": "model"}),
}  # fmt: skip
"""What a project calls a unit: the class, and the arguments by the keys that are written for them."""
BRINGERS: Mapping[str, Callable[[], Unit]] = {unit.table.area: unit for unit in (Noc, Tianxing)}
"""What makes the unit that brings a mailbox, by the mailbox's name."""
UNIT_OF_AREA: Mapping[str, str] = {Noc.table.area: "NOC", Tianxing.table.area: "Tianxing"}
"""What a project calls the unit that brings a mailbox, by the mailbox's name."""
ETN21_ADDRESS = "192.168.250.21"


def make_unit(kind: str, address: str, options: Mapping[str, object]) -> Unit:
    """A unit as a project describes it.  Raises ValueError for what its class refuses."""
    name, arguments = KINDS[kind]
    return UNITS[name](address=address, **{arguments[key]: value for key, value in options.items()})


def usual_units(mailboxes: Iterable[str], timing: str = "exact", seed: int = 0,
                fins: Mapping[str, Any] | None = None) -> list[Unit]:
    """An ETN21 with unit number 0, and the unit of each mailbox that the program uses.  `fins` are arguments of the ETN21 about
    FINS, None for none."""
    brought = [BRINGERS[name]() for name in mailboxes if name in BRINGERS]
    return [Etn21(0, ETN21_ADDRESS, timing=timing, seed=seed, **(fins or {})), *brought]
