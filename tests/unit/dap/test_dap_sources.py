"""Sources as editors name them: paths, numbers, lines and columns from 0 or 1, ends of statements, places of breakpoints."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Any

from rows import each_of

from fbvm.code.image import Site
from fbvm.dap.sources import Sources

TEXT = "PROGRAM Main\n    y := '\N{GRINNING FACE}'; z := 2 *\n 3;\nEND_PROGRAM\n"
SITES = [Site("pump.st", "Main", *place) for place in ((2, 15), (2, 5), (3, 1))] + [Site("lib/T.st", "T", 1, 1)]
FOLDER = Path(__file__).parent


def sources(**client: Any) -> Sources:
    texts = {"pump.st": TEXT, "lib/T.st": "q := 1;", "lib/A.st": "a := 1;", "obj.TcPOU": "o := 1;"}
    return Sources(texts, {"pump.st": FOLDER / "pump.st", "obj.TcPOU": FOLDER / "obj.TcPOU"}, client, SITES)


def test_how_a_source_is_described() -> None:
    found = sources()
    digest = sha256(TEXT.encode()).hexdigest()
    assert found.source("pump.st") == {
        "name": "pump.st", "path": str(FOLDER / "pump.st"), "checksums": [{"algorithm": "SHA256", "checksum": digest}]}
    own = found.source("lib/A.st")
    assert own.pop("checksums")[0]["checksum"] == sha256(b"a := 1;").hexdigest()
    assert own == {"name": "A.st", "sourceReference": 2, "path": "lib/A.st", "origin": "library or recording"}
    assert found.source("obj.TcPOU") == {"name": "obj.TcPOU", "path": str(FOLDER / "obj.TcPOU")}
    assert found.source("nowhere.st") == {"name": "nowhere.st"}
    assert [row["name"] for row in found.all] == ["A.st", "T.st", "obj.TcPOU", "pump.st"]
    assert [found.text(number) for number in (0, 1, 2, 3)] == [None, "q := 1;", "a := 1;", None]


@each_of("said, name", [
    ({"sourceReference": 1}, "lib/T.st"), ({"sourceReference": 2, "path": "x"}, "lib/A.st"), ({"sourceReference": 3}, None),
    ({"sourceReference": 0, "path": "lib/A.st"}, "lib/A.st"), ({"path": "lib/T.st"}, "lib/T.st"), ({"path": ""}, None),
    ({}, None), ({"path": 5}, None), ({"path": "/nowhere/pump.st"}, None),
    ({"sourceReference": "1", "path": "lib/A.st"}, "lib/A.st"),
    ({"path": str(FOLDER / "pump.st")}, "pump.st"), ({"path": str(FOLDER / "PUMP.st").replace("/", "\\")}, "pump.st"),
    ({"path": (FOLDER / "pump.st").as_uri()}, "pump.st"),
])
def test_which_source_an_editor_means(said: dict[str, object], name: str | None) -> None:
    assert sources().name_of(said) == name


def test_a_path_is_written_as_the_editor_writes_it(tmp_path: Path) -> None:
    found, said = sources(pathFormat="uri"), str(FOLDER / "PUMP.st")
    assert found.source("pump.st")["path"] == (FOLDER / "pump.st").as_uri()
    assert found.name_of({"path": said}) == "pump.st" and found.source("pump.st")["path"] == said
    (tmp_path / "real.st").write_text("a := 1;")
    (tmp_path / "link.st").symlink_to(tmp_path / "real.st")
    linked, link = Sources({"real.st": "a := 1;"}, {"real.st": tmp_path / "real.st"}, {}), str(tmp_path / "link.st")
    assert linked.name_of({"path": link}) == "real.st" and linked.source("real.st")["path"] == link
    assert linked.name_of({"path": "C:/x"}) is None and linked.name_of({"path": "file:///C:/x"}) is None


@each_of("client, first", [({}, 1), ({"linesStartAt1": True, "columnsStartAt1": True}, 1),
                           ({"linesStartAt1": False, "columnsStartAt1": False}, 0)])
def test_lines_and_columns_are_counted_as_the_client_does(client: dict[str, object], first: int) -> None:
    found = sources(**client)
    assert (found.line(7), found.client_line(7)) == (8 - first, 6 + first)
    assert [found.client_column("pump.st", 2, column) for column in (1, 5, 15)] == [first, 4 + first, 15 + first], "UTF-16"
    assert found.place(SITES[0]) == {"line": 1 + first, "column": 15 + first, "endLine": 2 + first, "endColumn": 2 + first}
    assert found.place(Site("pump.st", "Main", 1, 1)) == {"line": first, "column": first}
    assert found.locations("pump.st", 2, 2) == [{"line": 1 + first, "column": column + first} for column in (4, 15)]
    assert found.locations("pump.st", 3, 9) == [{"line": 2 + first, "column": first}] and found.locations("x.st", 1, 9) == []
    assert [found.line_text("lib/T.st", line) for line in (0, 1, 2)] == ["", "q := 1;", ""]
    assert found.lines("pump.st", 0, 1) == [(1, "PROGRAM Main")] and found.lines("x.st", 1, 9) == []
    assert found.lines("pump.st", 4, 9) == [(4, "END_PROGRAM"), (5, "")]
    assert [found.line_text("pump.st", line) for line in (0, 1, 5, 6)] == ["", "PROGRAM Main", "", ""]
