"""`fbvm map`: each word and bit under all its numbers."""

from __future__ import annotations

from click.testing import CliRunner
from rows import each_of

from fbvm.cli.running.map import command


def mapped(*arguments: str) -> list[list[str]]:
    """The lines below the titles, at two spaces or more parted."""
    result = CliRunner().invoke(command, list(arguments))
    assert result.exit_code == 0, result.output
    return [[part.strip() for part in line.split("  ") if part.strip()] for line in result.output.splitlines()[1:]]


def test_a_register_and_a_bit() -> None:
    assert mapped("D1000") == [["D1000", "holding register", "03 06 10", "1000", "03E8", "1001", "41001", "401001"]]
    assert mapped("CIO 2.02") == [
        ["CIO 2.02", "coil", "01 05", "34", "0022", "35", "00035", "000035"],
        ["CIO 2.02", "discrete input", "02", "34", "0022", "35", "10035", "100035"],
    ]
    assert mapped("CIO 1000") == [["CIO 1000", "input register", "04", "1000", "03E8", "1001", "31001", "301001"]]


def test_addresses_of_openplc() -> None:
    assert mapped("%QX1.2", "%IX0.0", "%IW7") == [
        ["%QX1.2", "coil", "01 05 0F", "10", "000A", "11", "00011", "000011"],
        ["%IX0.0", "discrete input", "02", "0", "0000", "1", "10001", "100001"],
        ["%IW7", "input register", "04", "7", "0007", "8", "30008", "300008"]]
    assert [line[3] for line in mapped("%QW1023", "%MW0", "%MD0", "%ML1023")] == [
        "1023", "1024", "2048", "2049", "8188", "8189", "8190", "8191"]
    assert [line[1] for line in mapped("%QW1024", "%MB3", "%IL0")] == ["not served"] * 3


def test_ranges() -> None:
    assert [line[0] for line in mapped("D7..D9", "CIO 400.14..CIO 401.01")] == [
        "D7", "D8", "D9", "CIO 400.14", "CIO 400.15", "CIO 401.00", "CIO 401.01",
    ]  # fmt: skip


def test_where_the_tables_end() -> None:
    assert mapped("D9998")[0][6] == "49999"
    assert mapped("D9999")[0][6:] == ["-", "410000"]
    assert mapped("D32767")[0][3:] == ["32767", "7FFF", "32768", "-", "432768"]
    assert mapped("CIO 4095.15")[0][3:] == ["65535", "FFFF", "65536", "-", "065536"]
    assert len(mapped("CIO 319.15")) == 2
    assert len(mapped("CIO 320.00")) == 1, "no discrete input any more"
    for outside in ("CIO 4096.00", "CIO 5801", "W480", "D0.00", "H0"):
        assert mapped(outside)[0][1] == "not served"


def test_without_an_address_the_ends_of_all_tables() -> None:
    lines = mapped()
    assert {line[1] for line in lines} == {"coil", "discrete input", "input register", "holding register"}
    assert ["CIO 5800", "input register", "04", "5800", "16A8", "5801", "35801", "305801"] in lines


@each_of("text", ["X5", "D5..CIO 7", "D5..D7.01", "D9..D7", "D40000", "D1.."])
def test_what_is_no_range(text: str) -> None:
    assert CliRunner().invoke(command, [text]).exit_code == 2
