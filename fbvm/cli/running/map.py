"""`fbvm map`: the Modbus addresses of the words and bits that the ETN21 server program serves, in all notations, and of %I, %Q
and %M those of OpenPLC's server."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import click

from fbvm.base.areas import AREAS, SIZED_AREAS, Address, AddressError, parse_address, with_sizes_apart
from fbvm.cli.shared.terminal import say
from fbvm.units.openplc.tables import numbers_of
from fbvm.watch.paths import UnknownPlace, address_range


class Table(NamedTuple):
    """One of Modbus's four tables and the area that it is mapped to; its addresses are 0 to `last`."""

    name: str
    area: str
    bits: bool
    codes: str
    last: int
    digit: str
    """First digit of its addresses in documents that count from 1."""


TABLES = (  # the sheet's sections 1.3 and 2, read as fblib/omron/etn_modbus/README.md says
    Table("coil", "CIO", True, "01 05", 65535, "0"),
    Table("discrete input", "CIO", True, "02", 5119, "1"),
    Table("input register", "CIO", False, "04", 5800, "3"),
    Table("holding register", "D", False, "03 06 10", 32767, "4"),
)
DIGITS = {"coil": "0", "discrete input": "1", "input register": "3", "holding register": "4"}
TITLES = ("PLC", "Modbus", "functions", "PDU", "hex", "from 1", "5 digits", "6 digits")
FORMAT = "{:<14}{:<18}{:<11}{:>6}{:>7}{:>8}{:>10}{:>10}"


@click.command("map")
@click.argument("ranges", nargs=-1, metavar="[ADDRESS|FIRST..LAST]...")
def command(ranges: tuple[str, ...]) -> None:
    """Print where Modbus clients find words and bits of a PLC that runs the server program.

    `fbvm map D1000..D1002 'CIO 1.04'`; without an address the first and the last of each table.  `fbvm map %QX0.3 %MD4` tells
    where they are on a PLC of OpenPLC: each register of 16 bits has a line, that with the highest bits first."""
    addresses = [address for text in ranges for address in _range(text)] or list(_ends())
    say(FORMAT.format(*TITLES))
    for address in addresses:
        rows = [row(table, address) for table in TABLES if _number(table, address) is not None]
        rows += [_columns(str(address), title, codes, number, DIGITS[title])
                 for title, codes, numbers in numbers_of(address.area, address.number, address.bit) for number in numbers]
        for line in rows or [(str(address), "not served", *[""] * 6)]:
            say(FORMAT.format(*line).rstrip())


def row(table: Table, address: Address) -> tuple[str, ...]:
    """The row of an address in a table: its Modbus address in all notations."""
    number = _number(table, address)
    assert number is not None, "asked only for what the table has"
    return _columns(str(address), table.name, table.codes, number, table.digit)


def _columns(plc: str, name: str, codes: str, number: int, digit: str) -> tuple[str, ...]:
    counted = number + 1
    return (plc, name, codes, str(number), f"{number:04X}", str(counted), f"{digit}{counted:04}" if counted <= 9999 else "-",
            f"{digit}{counted:05}")


def _number(table: Table, address: Address) -> int | None:
    """Address in the PDU, or None if the table does not have it."""
    if address.area != table.area or (address.bit is not None) != table.bits:
        return None
    number = address.number if address.bit is None else 16 * address.number + address.bit
    return number if number <= table.last else None


def _ends() -> Iterator[Address]:
    for first, last in (("CIO 0.00", "CIO 4095.15"), ("CIO 319.15", "CIO 0"), ("CIO 5800", "D0"), ("D32767", "")):
        yield from (parse_address(text) for text in (first, last) if text)


def _range(text: str) -> list[Address]:
    """The addresses of `D100` or `D100..D109`."""
    try:
        areas = with_sizes_apart(AREAS, SIZED_AREAS.values())
        return address_range(areas, text) if ".." in text else [parse_address(text, areas)]
    except (AddressError, UnknownPlace) as error:
        raise click.UsageError(str(error)) from None
