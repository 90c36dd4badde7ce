"""A source that nobody has formatted beside what `fmt` makes of it, word for word.  `FBVM_REWRITE=1 pytest` of this file writes
the text anew; read the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.formatter.names import Outside
from fbvm.syntax.ladder.notation import Form, Notation
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Declaration, Pou, TypeDecl

TEXTS = Path(__file__).parent / "texts"


OUTSIDE = """FUNCTION_BLOCK Pump VAR_INPUT Level : INT; END_VAR VAR_OUTPUT Place : Point; END_VAR END_FUNCTION_BLOCK
TYPE Point : STRUCT East, North : INT; END_STRUCT; END_TYPE TYPE Mode : (Off, Auto); END_TYPE
FUNCTION Twice : INT VAR_INPUT Value : INT; END_VAR END_FUNCTION
"""


def outside(name: str) -> Declaration | None:
    """The declaration of a name in other files."""
    declared = (each for each in parse(Source("", OUTSIDE))[0].declarations if isinstance(each, Pou | TypeDecl))
    return next((each for each in declared if each.name.text.upper() == name.upper()), None)


def test_names_are_spelt_as_other_files_declare_them() -> None:
    text = ("PROGRAM Main VAR p : PUMP; q : point := (east := 1); m : mode := mode#off; END_VAR\n"
            "p(LEVEL := abs(3)); q.NORTH := p.place.EAST + TWICE(VALUE := 2); m := MODE#AUTO; END_PROGRAM\n")
    made, wrong = formatted(Source("m.st", text), Outside(outside, lambda name: name.upper() == "ABS"))
    assert wrong == []
    assert " ".join(made.split()) == (
        "PROGRAM Main VAR p : Pump; q : Point := (East := 1); m : Mode := Mode#Off; END_VAR p(Level := ABS(3)); "
        "q.North := p.Place.East + Twice(Value := 2); m := Mode#Auto; END_PROGRAM")


def test_a_sign_behind_rungs_and_types_that_name_each_other_are_formatted() -> None:
    text = ("TYPE a : b; B : A; END_TYPE\nPROGRAM P VAR x : a := (M := 1); Y : b; END_VAR\nLADDER\nLD x\nOUT y\nEND_LADDER\n;\n"
            "X.m := y.m;\nEND_PROGRAM\n")
    assert formatted(Source("m.st", text)) == (
        "TYPE\n    a : B;\n    B : a;\nEND_TYPE\n\nPROGRAM P\nVAR\n    x : a := (M := 1);\n    Y : B;\nEND_VAR\n    LADDER\n"
        "        LD      x\n        OUT     y\n    END_LADDER;\n    x.m := Y.m;\nEND_PROGRAM\n", [])


@pytest.mark.slow
def test_what_a_source_is_formatted_to() -> None:
    ugly = (TEXTS / "ugly.st").read_text(encoding="utf-8")
    made, wrong = formatted(Source("ugly.st", ugly), notation=Notation(Form.DRAWING))
    assert [found.render() for found in wrong] == []
    if os.environ.get("FBVM_REWRITE"):
        (TEXTS / "pretty.st").write_text(made, encoding="utf-8")
    assert made == (TEXTS / "pretty.st").read_text(encoding="utf-8")
    assert formatted(Source("pretty.st", made), notation=Notation(Form.DRAWING)) == (made, [])
