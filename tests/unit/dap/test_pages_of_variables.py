"""Which rows of a container a client gets that asks for a page of them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from dap_client import Client
from rows import each_of

from fbvm.base.areas import AREAS
from fbvm.dap.variables import _written, text_of
from fbvm.watch import places
from fbvm.watch.paths import find_place

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


def test_an_array_that_is_not_shown_with_its_elements_is_not_read(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Any] = []
    monkeypatch.setattr(places, "read_found", lambda memory, place: read.append(place.name) or 0)
    rows = client.rows(client.scopes()["Locals"]["variablesReference"])
    assert rows["full"]["value"] == client.value("full") == "ARRAY [0..255] OF INT"
    assert read == []


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


@pytest.mark.slow
def test_a_client_that_does_not_page_gets_256_elements_at_once_and_more_in_nodes(tmp_path: Path) -> None:
    client = begun(tmp_path / "own.st", supportsVariablePaging=False)
    rows = client.rows(client.scopes()["Locals"]["variablesReference"])
    assert list(client.rows(rows["full"]["variablesReference"])) == [f"[{number}]" for number in range(256)]
    assert list(client.rows(rows["full"]["variablesReference"], start=254, count=9)) == ["[254]", "[255]"]
    nodes = client.rows(rows["over"]["variablesReference"])
    assert (rows["full"]["indexedVariables"], rows["over"]["indexedVariables"]) == (256, 2)
    assert list(nodes) == ["[0..255]", "[256..256]"]
    assert list(client.rows(nodes["[256..256]"]["variablesReference"])) == ["[257]"]


@pytest.mark.slow
def test_what_is_written_is_told_with_the_scans_that_are_forgotten_and_said_anew(tmp_path: Path) -> None:
    path = tmp_path / "said.st"
    path.write_text("PROGRAM Main\nVAR n, m : INT; END_VAR\nn := n + 1;\nm := n;\nEND_PROGRAM\n", encoding="utf-8")
    client = Client()
    point = {"source": {"path": str(path)}, "breakpoints": [{"line": 4, "logMessage": "n {n}"}]}
    client.begin(program=str(path))
    client.ask("setBreakpoints", **point)
    client.go("fbvm/stepScan", scans=3)
    client.go("fbvm/gotoScan", scan=2)

    def told() -> list[str]:
        return [row["output"].strip().rpartition("  ")[2] for row in client.events("output")]

    before = len(told())
    client.ask("setExpression", expression="n", value="50")
    assert client.events("output")[-1]["output"] == "wrote Main.n := 50 in scan 2\n"
    client.go("fbvm/stepScan")
    client.go("fbvm/stepScan")
    assert any("51" in line for line in told()[before:]) and any("52" in line for line in told()[before:]), told()
    client.go("fbvm/gotoScan", scan=1)
    client.ask("setExpression", expression="n", value="7")
    assert client.events("output")[-1]["output"] == "wrote Main.n := 7 in scan 1; scans 2..3 are forgotten\n"


@each_of("name, value, text", [
    ("D5", 4, "4 (16#0004)  State: open"), ("D5", 5, "5 (16#0005)  State"), ("D6", 4, "4 (16#0004)"),
    ("D7", 4, "4 (16#0004)  Count"), ("D5.00", True, "TRUE  Ready"), ("CIO 7", 65535, "65535 (16#FFFF)"),
])
def test_a_word_of_a_unit_is_shown_with_what_it_means(name: str, value: int, text: str) -> None:
    facts = SimpleNamespace(described={"D5": "State", "D7": "Count", "D5.00": "Ready"}, meanings={"D5": {4: "open"}})
    session: Any = SimpleNamespace(facts=facts, names=SimpleNamespace(name_references=lambda kind, found: found),
                                   player=SimpleNamespace(read=lambda place: value))
    debug: Any = SimpleNamespace(hexadecimal=False)
    place = find_place({}, AREAS, name)
    assert text_of(debug, session, place) == text and text_of(debug, session, place, bare=True) == text.split()[0]
    assert _written(text) == _written(f" {text} (forced)") == text.split()[0]


@each_of("text", ["'a (5)'", "'a (5)  b'", "'(16#0F)  '", '"x (7)  y"', "'$' (5)  '", "['a  b', 'c']", "(n := 1, s := 'a  b')"])
def test_a_text_is_taken_as_it_is_shown(text: str) -> None:
    assert _written(text) == _written(f"{text} (forced)") == text
