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


@pytest.mark.parametrize("kind", UNITS)
def test_a_unit_is_given_an_ipv4_address(kind: str) -> None:
    for address in ("0.0.0.0", "192.168.250.255", "255.255.255.255"):
        unit = UNITS[kind](address=address)  # type: ignore[operator]
        assert unit.address == address and unit.changed_words is False
    for wrong in ("", "plc", "192.168.250", "192.168.250.256", "256.1.1.1", "1.2.3.4.5", "1.2.3.-4", "1.2.3.", "1.2.3.4:502",
                  f"1.2.3.{'4' * 5000}"):
        with pytest.raises(ValueError, match=r'is no IPv4 address; write "192\.168\.250\.1"\Z'):
            UNITS[kind](address=wrong)  # type: ignore[operator]
