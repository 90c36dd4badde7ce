"""What a user's library declares in a NAMESPACE, each POU in a file of its name."""

from __future__ import annotations

from pathlib import Path

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.check.symbols import library

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
