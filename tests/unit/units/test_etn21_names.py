"""What an ETN21's bits and words are called, and that charts show it."""

from __future__ import annotations

import pytest
from images import counter_image
from rows import each_of

from fbvm.base.areas import parse_address
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.draw.chart import chart
from fbvm.units.etn21.unit import Etn21


@each_of(("number", "address", "name"), [
    (0, "CIO 1519.02", "TCP Active Open Request Switch"),
    (0, "CIO 1519.11", "Send Request Switch 2"),
    (0, "CIO 1522.13", "Close Request Switch 8"),
    (0, "CIO 1509.15", "TCP Open Flag"),
    (0, "CIO 1508.00", "UDP Opening Flag 8"),
    (0, "D30001", "Number of Bytes Received"),
    (0, "D30016", "TCP Connection State 8"),
    (0, "D30027", "Response Code"),
    (0, "D30097", "Response Code 8"),
    (15, "CIO 1894.02", "TCP Active Open Request Switch"),
    (15, "CIO 1875.02", "Socket Force-close Switch"),
    (15, "D31527", "Response Code"),
])
def test_names_follow_the_unit_number(number: int, address: str, name: str) -> None:
    assert Etn21(number).descriptions[address] == name


@pytest.mark.parametrize("number", [0, 15])
def test_every_key_is_an_address_as_charts_write_it(number: int) -> None:
    assert [key for key in Etn21(number).descriptions if str(parse_address(key)) != key] == []


def test_a_chart_shows_them() -> None:
    plc = Plc(counter_image())
    plc.attach(Etn21(0), LoopNetwork())
    plc.write("D30018", 1)
    plc.write("CIO 1519.05", True)
    assert chart(plc, scans=3, signals=["CIO 1519.05", "CIO 1509.03", "D30027"]) == """
        CIO1519.05  #..      Close Request Switch
        CIO1509.03  ...      TCP Closing Flag
        D30027      0|8720   Response Code
    """


@each_of(("code", "said"), [(0x0000, "normal end"), (0x2211, "unit busy"), (0x0045, "ECONNABORTED")])
def test_response_codes_have_words_also_those_that_no_emulated_unit_ends_with(code: int, said: str) -> None:
    """W421 6-9 lists them; a recorded real unit may have them."""
    assert said in Etn21().meanings["D30027"][code]


@each_of("number", [0, 15])
def test_what_is_described_lies_in_the_words_of_the_unit(number: int) -> None:
    """25 CIO words from n on and 100 D words from m on, W420 4-1, 4-2: of eight areas and sockets, and none behind them."""
    n, m, unit = 1500 + 25 * number, 30000 + 100 * number, Etn21(number)
    found = [address for key in unit.descriptions if (address := parse_address(key)) is not None]
    assert {address.number for address in found if address.area == "CIO"} == {n, *range(n + 1, n + 24)}
    own = {address.number for address in found if address.area == "D"}
    assert own <= set(range(m + 1, m + 100)) and {m + 27 + 10 * area for area in range(8)} <= own
    assert {int(key[1:]) for key in unit.meanings} == {*range(m + 9, m + 17), *(m + 27 + 10 * area for area in range(8))}


def test_the_bits_and_words_of_a_socket_and_an_area_are_those_of_the_manuals() -> None:
    """Status words W420 4-1 p80-82, switches p84, error status p84, parameter areas W421 6-7-4 p117; of unit 1, whose n is 1525
    and whose m is 30100."""
    found = Etn21(1).descriptions
    assert [found.get(f"CIO 1534.{bit:02}", "") for bit in range(16)] == [
        "TCP Opening Flag", "TCP Receiving Flag", "TCP Sending Flag", "TCP Closing Flag", *[""] * 9, "TCP Data Received Flag", "",
        "TCP Open Flag"]  # fmt: skip
    assert [found.get(f"CIO 1527.{bit:02}", "") for bit in (0, 4, 15)] == ["UDP Opening Flag 2", "", "UDP Open Flag 2"]
    assert [found.get(f"CIO 1544.{bit:02}", "") for bit in range(16)] == [
        f"{name} Request Switch{number}" if name else "" for number in ("", " 2")
        for name in ("UDP Open", "TCP Passive Open", "TCP Active Open", "Send", "Receive", "Close", "", "")]  # fmt: skip
    assert [found.get(f"CIO 1543.{bit:02}", "") for bit in range(16)] == [
        "", "", "IP Address Setting Error", "IP Address Table Error", "IP Router Table Error", "DNS Server Error",
        "Routing Table Error", "", "", "", "", "SNTP Server Error", "SMTP Server Error", "POP Server Error",
        "Address Disagreement", "EEPROM Error"]  # fmt: skip
    assert [found.get(f"D{word}", "") for word in range(30118, 30129)] == [
        "Option and Socket Number", "Local Port", "Remote IP Address, high", "Remote IP Address, low", "Remote Port",
        "Number of Bytes to Send or Receive", "Send or Receive Data Address, high", "Send or Receive Data Address, low",
        "Time-out Value", "Response Code", "Option and Socket Number 2"]  # fmt: skip


def test_the_words_that_ask_something_of_the_unit_are_watched() -> None:
    assert Etn21(1).watched == (("CIO", 1525), ("CIO", 1542), ("CIO", 1544), ("A", 501))
