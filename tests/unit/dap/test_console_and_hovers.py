"""What editors ask about words of a source: values beside lines, completions, hovers, and what is typed in their console."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from dap_client import Client, RefusedError
from rows import each_of

TEXT = """\
FUNCTION_BLOCK Own
VAR k : INT := 4; END_VAR VAR_OUTPUT q : INT := 4; END_VAR
PROPERTY Twice : INT
GET Twice := 2 * k; END_GET
END_PROPERTY
PROPERTY Wrong : INT
GET Wrong := 2 / (k - 4); END_GET
END_PROPERTY
METHOD Add : INT
k := k + 1; Add := k;
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR n : INT := 5; s : STRING := 'a'; b : BOOL; t : TON; own : Own; r : REAL := 2.5; d : TIME := T#3s; END_VAR
VAR list : ARRAY[1..3] OF INT; END_VAR
n := N; s := 'it$'s b'; // d
b := own.q = 4 (* r *) OR n > 4 AND s = 'r'; t(IN := b);
n := n + list[2] + list[n - 4] + own.Twice;
n := own.Add() + own.Wrong + list[3]; /* b */
END_PROGRAM
"""


METHOD = "own.Add is a method, which may change variables: the debugger calls none; a breakpoint at it shows what it does"


class Console:
    """A client that stands at the first statement of the program."""

    def __init__(self, path: Path, **said: Any) -> None:
        path.write_text(TEXT, encoding="utf-8")
        self.path, self.client = path, Client(**said)
        self.client.begin(program=str(path))
        self.frame = self.client.frames[0]["id"]

    def beside(self, **lines: int) -> list[tuple[int, int, str, str]]:
        rows = self.client.ask("fbvm/inlineValues", source={"path": str(self.path)}, frameId=self.frame, **lines)["values"]
        return [(row["line"], row["column"], row["expression"], row["text"]) for row in rows]

    def completed(self, text: str, **where: int) -> dict[str, tuple[str, int, int]]:
        rows = self.client.ask("completions", text=text, frameId=self.frame, **where)["targets"]
        assert all(row["label"] == row["text"] for row in rows)
        return {row["label"]: (row["type"], row["start"], row["length"]) for row in rows}

    def evaluated(self, text: str, **more: Any) -> dict[str, Any]:
        return self.client.ask("evaluate", expression=text, frameId=self.frame, **more)


@pytest.fixture(scope="module")
def console(tmp_path_factory: pytest.TempPathFactory) -> Console:
    return Console(tmp_path_factory.mktemp("console") / "own.st")


def test_beside_a_line_stand_the_values_of_its_words_but_not_those_of_texts_and_comments(console: Console) -> None:
    assert console.beside(startLine=16) == [(16, 1, "Main.n", "n = 5"), (16, 9, "Main.s", "s = 'a'")]
    assert console.beside(startLine=17, endLine=18) == [
        (17, 1, "Main.b", "b = FALSE"), (17, 6, "Main.own.q", "own.q = 4"), (17, 27, "Main.n", "n = 5"),
        (17, 37, "Main.s", "s = 'a'"),
        (18, 1, "Main.n", "n = 5"), (18, 10, "Main.list[2]", "list[2] = 0"), (18, 34, "Main.own.Twice", "own.Twice = 8")]
    assert console.beside(startLine=19, endLine=99) == [(19, 1, "Main.n", "n = 5"), (19, 30, "Main.list[3]", "list[3] = 0")]
    assert console.beside() == [] and console.beside(startLine=18, endLine=17) == []
    assert console.client.ask("fbvm/inlineValues", source={"path": "/nowhere.st"}, startLine=1, endLine=9) == {"values": []}


@pytest.mark.slow
def test_completions_are_places_and_at_the_beginning_commands(console: Console, tmp_path: Path) -> None:
    assert console.completed("Main.o") == {"Main.own": ("variable", 1, 6)}
    members = ("k", "q", "Twice", "Wrong")
    assert console.completed("Main.own.", column=10) == {f"Main.own.{name}": ("variable", 1, 9) for name in members}
    assert console.completed("own.", column=5) == {f"own.{name}": ("variable", 1, 4) for name in members}
    assert console.completed("n := n+lis", column=11) == {"list": ("variable", 8, 3)}
    assert console.completed("n := lis(more", column=9) == {"list": ("variable", 6, 3)}
    for text, start in (("print ow", 7), ("b=ow", 3), ("f(ow", 3), ("1,ow", 3), ("1<ow", 3), ("1>ow", 3), ("2*ow", 3),
                        ("2/ow", 3), ("2-ow", 3)):  # fmt: skip
        assert console.completed(text, column=len(text) + 1) == {"own": ("variable", start, 2)}, text
    words = {name for name, (kind, *_) in console.completed("").items() if kind == "keyword"}
    assert words >= {"print", "why", "write", "force"} and not words & {"quit", "break", "unbreak", "q"}
    assert console.completed("WR", column=3) == {"write": ("keyword", 1, 2)}
    assert console.completed("  wr", column=5) == {"write": ("keyword", 3, 2)} and console.completed("n wr", column=5) == {}
    from_0 = Console(tmp_path / "own.st", columnsStartAt1=False)
    assert from_0.completed("own", column=2) == {"own": ("variable", 0, 2)} == from_0.completed("ow")
    at_0 = from_0.completed("own", column=0)
    assert at_0["own"] == ("variable", 0, 0) and at_0["Main"] == ("variable", 0, 0) and at_0["why"] == ("keyword", 0, 0)


@each_of("text, more, value, kind", [
    ("n", {}, "5", "INT"), (" Main.n ", {}, "5", "INT"), ("s", {}, "'a'", "STRING[80]"), ("own", {}, "Own", "Own"),
    ("list[1]", {}, "0", "INT"), ("own.Twice", {}, "8", "INT"), ("own.Twice + n", {}, "13", "INT"),
    ("n + 1", {}, "6", "INT"), ("n > 4 AND NOT b", {}, "TRUE", "BOOL"), ("r * 2.0", {}, "5.0", "REAL"),
    ("1 + 1", {}, "2", "a number"), ("'x'", {}, "'x'", "a text"), ("T#1s", {}, "T#1s", "a time"),
    ("D1", {}, "0 (16#0000)", "WORD"),
    ("n", {"format": {"hex": True}}, "16#0005", "INT"), ("n", {"format": {}}, "5", "INT"),
    ("D1", {"context": "clipboard"}, "0", "WORD"), ("D1", {"context": "hover"}, "0 (16#0000)", "WORD"),
    ("D1..D2", {}, "[0 (16#0000), 0 (16#0000)]", None),
])
def test_an_expression_has_a_value_and_a_type(console: Console, text: str, more: dict[str, Any], value: str, kind: str) -> None:
    found = console.evaluated(text, **more)
    assert (found["result"], found.get("type")) == (value, kind)
    assert bool(found["variablesReference"]) is (text == "own") and not found.keys() & {"name", "value", "evaluateName"}


@each_of("text, context, said", [
    ("", "repl", "there is nothing to evaluate"), ("  ", "watch", "there is nothing to evaluate"),
    ("own.Add()", "watch", METHOD), ("own.Add", "repl", METHOD),
    ("quit", "repl", "quit: the editor has that of its own"), ("BREAK 5", None, "break: the editor has that of its own"),
    ("n / (n - 5)", "watch", "n / (n - 5) cannot be computed: division by zero"),
    ("1 / 0", "watch", "division by zero in '1 / 0'"), ("n MOD 0", "repl", "division by zero in 'n MOD 0'"),
    ("n MOD (n - 5)", "repl", "n MOD (n - 5) cannot be computed: division by zero"),
    ("n > wrong", "repl", "there is no wrong; known here: Main"),
])
def test_what_cannot_be_evaluated_says_why(console: Console, text: str, context: str | None, said: str) -> None:
    with pytest.raises(RefusedError) as refused:
        console.evaluated(text, **({} if context is None else {"context": context}))
    assert str(refused.value) == said


@pytest.mark.slow
def test_commands_are_taken_where_somebody_types_and_nowhere_else(tmp_path: Path) -> None:
    console = Console(tmp_path / "own.st")
    for context in ("watch", "hover", "clipboard", "variables"):
        for text in ("print n", "n := 7", "goto 3"):
            with pytest.raises(RefusedError):
                console.evaluated(text, context=context)
    with pytest.raises(RefusedError):
        console.evaluated("n := 7")
    assert console.client.value("n") == "5"
    assert "5" in console.evaluated("PRINT n")["result"] and "5" in console.client.value("p n", "repl")


@pytest.mark.slow
def test_an_assignment_is_one_where_its_variable_is_called_as_a_command(tmp_path: Path) -> None:
    console = Console(tmp_path / "own.st")
    for text, name, value in (("n := 7", "n", "7"), ("S := 'new'", "s", "'new'"), ("b := TRUE", "b", "TRUE"),
                              ("r :=1.5", "r", "1.5"), ("n:=8", "n", "8")):  # fmt: skip
        console.client.value(text, "repl")
        assert console.client.value(name) == value, text
    assert console.client.value("b = FALSE", "repl") == "FALSE", "what has a value is no command"
    assert (console.client.value("n"), console.client.line) == ("8", 16)


@pytest.mark.slow
def test_names_are_those_of_the_plc_whose_frame_is_asked(tmp_path: Path) -> None:
    (tmp_path / "fbvm.toml").write_text('[plc.one]\nsources = ["one.st"]\n[plc.two]\nsources = ["two.st"]\n', encoding="utf-8")
    for name, value in (("one", 1), ("two", 2)):
        text = f"PROGRAM Main\nVAR n, {name}_only : INT := {value}; END_VAR\nn := {value};\nEND_PROGRAM\n"
        (tmp_path / f"{name}.st").write_text(text, encoding="utf-8")
    client = Client()
    client._said.pop("columnsStartAt1")
    client.begin(project=str(tmp_path))
    frames = {name: client.ask("stackTrace", threadId=number)["stackFrames"][0]["id"]
              for number, name in ((1, "one"), (2, "two"))}
    for name, value in (("one", "1"), ("two", "2")):
        source = {"path": str(tmp_path / f"{name}.st")}
        rows = client.ask("fbvm/inlineValues", source=source, startLine=3, frameId=frames[name])["values"]
        assert [row["text"] for row in rows] == [f"n = {value}"]
        assert client.ask("evaluate", expression="n", frameId=frames[name])["result"] == value
        targets = client.ask("completions", text=f"{name}_", column=5, frameId=frames[name])["targets"]
        assert [(row["label"], row["start"]) for row in targets] == [(f"{name}_only", 1)]
