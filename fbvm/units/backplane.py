"""The units that there are by name, and those that are on the backplane of a PLC where nobody says which."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from fbvm.units import noc_map, tianxing
from fbvm.units.etn21 import Etn21
from fbvm.units.noc import Noc
from fbvm.units.tianxing import Tianxing
from fbvm.units.unit import Unit

UNITS: Mapping[str, Callable[..., Unit]] = {"Etn21": Etn21, "Noc": Noc, "Tianxing": Tianxing}
"""What makes a unit, by the name of its class, as journals write it."""
BRINGERS: Mapping[str, Callable[[], Unit]] = {noc_map.AREA: Noc, tianxing.AREA: Tianxing}
"""What makes the unit that brings a mailbox, by the mailbox's name."""
ETN21_ADDRESS = "192.168.250.21"


def usual_units(mailboxes: Iterable[str], timing: str = "exact", seed: int = 0) -> list[Unit]:
    """An ETN21 with unit number 0, and the unit of each mailbox that the program uses."""
    brought = [BRINGERS[name]() for name in mailboxes if name in BRINGERS]
    return [Etn21(0, ETN21_ADDRESS, timing=timing, seed=seed), *brought]
