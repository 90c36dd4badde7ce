"""Which rows of a container a client gets that asks for a page of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client

TEXT = """\
FUNCTION_BLOCK Own
VAR a, b : INT; END_VAR
PROPERTY P : INT
GET P := a; END_GET
END_PROPERTY
PROPERTY Q : INT
GET Q := b; END_GET
END_PROPERTY
END_FUNCTION_BLOCK
PROGRAM Main
VAR own : Own; full : ARRAY[0..255] OF INT; over : ARRAY[1..257] OF BOOL; END_VAR
own.a := 1;
END_PROGRAM
"""


def begun(path: Path, **said: object) -> Client:
    path.write_text(TEXT.replace("own.a := 1", "full[0] := 1"), encoding="utf-8")
    client = Client(**said)
    client.begin(program=str(path))
    return client


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Client:
    return begun(tmp_path_factory.mktemp("pages") / "own.st")


def test_the_properties_of_an_instance_follow_its_variables_on_every_page(client: Client) -> None:
    own = client.rows(client.scopes()["Locals"]["variablesReference"])["own"]
    assert own["namedVariables"] == 4
    names = ["a", "b", "P", "Q"]
    for start in range(6):
        assert list(client.rows(own["variablesReference"], start=start)) == names[start:]
        for count in range(1, 6):
            assert list(client.rows(own["variablesReference"], start=start, count=count)) == names[start : start + count]


def test_the_units_of_an_area_are_words_or_bits_as_it_is_addressed(client: Client) -> None:
    areas = client.rows(client.scopes()["Areas"]["variablesReference"])
    for area, start, names in (("D", 32766, ["D32766", "D32767"]), ("CIO", 9, ["CIO 9", "CIO 10", "CIO 11"]),
                               ("TF", 7, ["TF7", "TF8", "TF9"]), ("CNF", 4094, ["CNF4094", "CNF4095"])):  # fmt: skip
        found = client.rows(areas[area]["variablesReference"], start=start, count=3)
        assert list(found) == names == [row["evaluateName"] for row in found.values()]
        assert {row["type"] for row in found.values()} == {"BOOL" if area in ("TF", "CNF") else "WORD"}


def test_a_client_that_does_not_page_gets_256_elements_at_once_and_more_in_nodes(tmp_path: Path) -> None:
    client = begun(tmp_path / "own.st", supportsVariablePaging=False)
    rows = client.rows(client.scopes()["Locals"]["variablesReference"])
    assert list(client.rows(rows["full"]["variablesReference"])) == [f"[{number}]" for number in range(256)]
    assert list(client.rows(rows["full"]["variablesReference"], start=254, count=9)) == ["[254]", "[255]"]
    nodes = client.rows(rows["over"]["variablesReference"])
    assert (rows["full"]["indexedVariables"], rows["over"]["indexedVariables"], list(nodes)) == (256, 2, ["[0..255]", "[256..256]"])
    assert list(client.rows(nodes["[256..256]"]["variablesReference"])) == ["[257]"]
