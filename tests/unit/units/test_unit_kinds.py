"""What a unit's class tells about it, kept for each class, is what Python finds by looking at the unit."""

from __future__ import annotations

import pytest

from fbvm import Etn21, Noc, OpenPlc, Tianxing
from fbvm.units.contract import FinsUnit, ProcessorUnit, Unit, has_processor, serves_fins

UNITS = {"ETN21": Etn21, "NOC": Noc, "OpenPLC": OpenPlc, "Tianxing": Tianxing}


@pytest.mark.parametrize("kind", UNITS)
def test_each_unit_is_of_the_kind_that_its_members_show(kind: str) -> None:
    unit: Unit = UNITS[kind]()
    assert has_processor(unit) is isinstance(unit, ProcessorUnit)
    assert serves_fins(unit) is isinstance(unit, FinsUnit)


def test_an_ethernet_unit_has_a_processor_and_serves_fins() -> None:
    assert has_processor(Etn21()) and serves_fins(Etn21())
    assert not serves_fins(Noc())
