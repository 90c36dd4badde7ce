"""What a user's library declares in a NAMESPACE, each POU in a file of its name."""

from __future__ import annotations

from pathlib import Path

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base.diagnostics import Source
from fbvm.check.symbols import library, symbol_table
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.code.compiler import compile_sources

TWICE = "NAMESPACE Plant FUNCTION Twice : INT VAR_INPUT x : INT; END_VAR Twice := 2 * x; END_FUNCTION END_NAMESPACE"
PUMP = "NAMESPACE Plant FUNCTION_BLOCK Pump VAR_OUTPUT q : INT; END_VAR q := Twice(q + 1); END_FUNCTION_BLOCK END_NAMESPACE"


@pytest.mark.parametrize("text", [
    "PROGRAM Main VAR p : Plant.Pump; n : INT; END_VAR p(); n := Plant.Twice(4); END_PROGRAM",
    "USING Plant; PROGRAM Main VAR p : Pump; n : INT; END_VAR p(); n := Twice(4); END_PROGRAM",
])
def test_it_is_found_by_its_full_name_and_by_using(tmp_path: Path, text: str) -> None:
    (tmp_path / "Twice.st").write_text(TWICE)
    (tmp_path / "Pump.st").write_text(PUMP)
    compiled = compile_text(text, libraries=[tmp_path])
    assert compiled.image is not None, [message.render() for message in compiled.errors]
    plc = Plc(compiled.image)
    plc.scan()
    assert (plc.read("Main.n"), plc.read("Main.p.q")) == (8, 2)


def test_a_namespace_that_no_library_has_is_reported(tmp_path: Path) -> None:
    (tmp_path / "Twice.st").write_text(TWICE)
    compiled = compile_text("USING Plants; PROGRAM Main END_PROGRAM", libraries=[tmp_path])
    assert [(each.code, each.message) for each in compiled.errors] == [("S0211", "there is no NAMESPACE Plants")]


@each_of("body, value", [
    ("m := Plant.Auto;", 3), ("m := Auto;", 3), ("m := Plant.Mode.Auto;", 3), ("m := Plant.Mode#Auto;", 3),
    ("m := Plant.Gone;", "Plant has no Gone"), ("m := Other.Auto;", "Other is not declared"),
])
def test_members_of_an_enumeration_are_named_behind_their_library(tmp_path: Path, body: str, value: int | str) -> None:
    (tmp_path / "library.toml").write_text("title = 'Plant'\nspaces = ['Plant']\n")
    (tmp_path / "Mode.st").write_text("TYPE Mode : (Off, Auto := 3); END_TYPE")
    compiled = compile_text(f"PROGRAM Main VAR m : Plant.Mode; END_VAR {body} END_PROGRAM", libraries=[tmp_path], lint=False)
    if isinstance(value, str):
        assert [each.message for each in compiled.errors] == [value]
        return
    assert compiled.image is not None, [message.render() for message in compiled.errors]
    plc = Plc(compiled.image)
    plc.scan()
    assert plc.read("Main.m") == value


def test_a_list_of_a_library_that_is_no_text_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "library.toml").write_text("title = 'Plant'\nlists = ['G.st']\n")
    (tmp_path / "G.st").write_text("VAR_GLOBAL g : INT; END_VAR")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(library, "read", lambda path, name: None)
        [found] = compile_text("PROGRAM Main END_PROGRAM", libraries=[tmp_path]).errors
    assert (found.code, found.message.endswith("G.st cannot be read")) == ("P0201", True)


def test_what_a_file_declares_in_a_namespace_is_called_by_its_full_name_alone(tmp_path: Path) -> None:
    (tmp_path / "Twice.st").write_text(TWICE)
    compiled = compile_text("PROGRAM Main VAR n : INT; END_VAR n := Plant.Twice(4); n := Other.Twice(4); END_PROGRAM",
                            libraries=[tmp_path])  # fmt: skip
    assert [each.message for each in compiled.errors] == ["Other is not declared"]


@each_of("body, said", [
    ("n := Hidden(1);", "Hidden is INTERNAL"), ("n := Plant.Hidden(1);", "there is no function or instance Plant.Hidden"),
    ("n := Shown(1);", ""), ("n := b1.x;", ""), ("n := List.x;", ""), ("n := Other.x;", "Other has no x"),
])  # fmt: skip
def test_what_is_internal_in_a_library_is_seen_by_that_library_alone(tmp_path: Path, body: str, said: str) -> None:
    (tmp_path / "library.toml").write_text("title = 'Plant'\nspaces = ['Plant']\n")
    (tmp_path / "Hidden.st").write_text("FUNCTION INTERNAL Hidden : INT VAR_INPUT x : INT; END_VAR Hidden := x; END_FUNCTION")
    (tmp_path / "Shown.st").write_text("FUNCTION Shown : INT VAR_INPUT x : INT; END_VAR Shown := Hidden(x); END_FUNCTION")
    sources = [Source("List.st", "VAR_GLOBAL x : INT := 2; END_VAR"), Source("Other.st", "VAR_GLOBAL y : INT; END_VAR"), Source(
        "Main.st", "TYPE B : STRUCT x : INT; END_STRUCT; END_TYPE "
        f"PROGRAM Main VAR n : INT; b1 : B; END_VAR {body} END_PROGRAM")]  # fmt: skip
    compiled = compile_sources(sources, libraries=[tmp_path], lint=False)
    assert [each.message for each in compiled.errors] == ([said] if said else [])


def test_after_many_comparisons_there_are_no_more_hints(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "PROGRAM Main VAR lamp : BOOL; END_VAR lamb := TRUE; lamq := TRUE; END_PROGRAM"
    both = [each.hint for each in compile_text(text).errors]
    compared = SymbolTable.nearest.__globals__["COMPARISONS"]
    monkeypatch.setattr(symbol_table, "COMPARISONS", 0)
    assert (both, [each.hint for each in compile_text(text).errors]) == (["did you mean lamp?"] * 2, ["", ""])
    assert compared == 50_000


def test_two_folders_of_one_name_are_two_libraries(tmp_path: Path) -> None:
    for vendor, block, step in (("acme", "Up", 3), ("apex", "Down", -2)):
        folder = tmp_path / vendor / "blocks"
        folder.mkdir(parents=True)
        (folder / f"{block}.st").write_text(
            f"FUNCTION_BLOCK {block} VAR_OUTPUT q : INT; END_VAR q := q + {step}; END_FUNCTION_BLOCK")
    text = "PROGRAM Main VAR u : Up; d : Down; END_VAR u(); d(); END_PROGRAM"
    for own in ([tmp_path / "acme", tmp_path / "apex"], [tmp_path / "acme" / "blocks", tmp_path / "apex" / "blocks"]):
        compiled = compile_text(text, libraries=own)
        assert compiled.image is not None, [message.render() for message in compiled.errors]
        plc = Plc(compiled.image)
        plc.scan()
        assert (plc.read("Main.u.q"), plc.read("Main.d.q")) == (3, -2)
