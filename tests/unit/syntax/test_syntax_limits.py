"""No text brings the parser down: depth is limited, sizes only cost time."""

from __future__ import annotations

import pytest

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.syntax.parser import parse
from fbvm.syntax.st.automaton import NESTING_LIMIT
from fbvm.syntax.st.builder import CHAIN_LIMIT
from fbvm.syntax.tree import Pou

pytestmark = pytest.mark.slow

MANY = 100_000
MOST_LINES = 5_000


def codes(statements: str, declarations: str = "") -> list[str]:
    """Codes of the errors of a block; the program behind it must be found."""
    tree, diagnostics = parse(Source(
        "x", f"FUNCTION_BLOCK f VAR {declarations} END_VAR\n{statements}\nEND_FUNCTION_BLOCK\nPROGRAM p x := 1; END_PROGRAM"))
    last = tree.declarations[-1]
    assert isinstance(last, Pou) and last.kind == "PROGRAM" and len(last.body) == 1
    return [d.code for d in diagnostics]


DEEP = {
    "parentheses": "a := " + "(" * MANY + "1" + ")" * MANY + ";",
    "open parentheses": "a := " + "(" * MANY,
    "blocks": "IF a THEN\n" * MANY + "END_IF\n" * MANY,
    "open blocks": "WHILE a DO\n" * MANY,
    "sum": "a := " + "a + " * MANY + "a;",
    "power": "a := " + "a ** " * MANY + "a;",
    "signs": "a := " + "NOT " * MANY + "a;",
    "members": "a" + ".a" * MANY + " := 1;",
    "pointers": "a" + "^" * MANY + " := 1;",
    "calls": "a" + "()" * MANY + ";",
    "subscripts": "a" + "[1]" * MANY + " := 1;",
    "nested subscripts": "a := " + "a[" * MANY + "1" + "]" * MANY + ";",
    "nested calls": "a := " + "f(" * MANY + "1" + ")" * MANY + ";",
}


@pytest.mark.parametrize("name", DEEP)
def test_deep_statements_are_refused_once(name: str) -> None:
    assert codes(DEEP[name] + " b := 1;") == ["S0106"]


DEEP_DECLARATIONS = {
    "arrays": "a : " + "ARRAY [0..1] OF " * MANY + "INT;",
    "references": "a : " + "REF_TO " * MANY + "INT;",
    "structures": "a : " + "STRUCT a : " * MANY + "INT;",
    "array values": "a : INT := " + "[" * MANY + "1" + "]" * MANY + ";",
    "structure values": "a : INT := " + "(a := " * MANY + "1" + ")" * MANY + ";",
}


@pytest.mark.parametrize("name", DEEP_DECLARATIONS)
def test_deep_declarations_are_refused_once(name: str) -> None:
    assert codes("b := 1;", DEEP_DECLARATIONS[name]) == ["S0106"]


def test_the_deepest_nesting_allowed() -> None:
    depth = NESTING_LIMIT
    assert codes("a := " + "(" * depth + "1" + ")" * depth + ";") == []
    assert codes("a := " + "(" * (depth + 1) + "1" + ")" * (depth + 1) + ";") == ["S0106"]
    assert codes("IF a THEN\n" * depth + "END_IF\n" * depth) == []
    assert codes("IF a THEN\n" * (depth + 1) + "END_IF\n" * (depth + 1)) == ["S0106"]


def test_the_longest_chain_allowed() -> None:
    assert codes("a := " + "a + " * (CHAIN_LIMIT - 1) + "a;") == []
    assert codes("a := " + "a + " * CHAIN_LIMIT + "a; b := 1;") == ["S0106"]


LISTS = {
    "nested brackets": "ADD (\nLD n\n" * MOST_LINES + ")\n" * MOST_LINES,
    "operations in brackets": "ADD (\nLD n\n" + "ADD 1\n" * MOST_LINES + ")\n",
    "brackets in brackets": "ADD (\nLD n\n" + "ADD (\nLD n\n)\n" * MOST_LINES + ")\n",
    "open brackets": "ADD (\n" * MOST_LINES,
}


@pytest.mark.parametrize("name", LISTS)
def test_deep_instruction_lists_are_refused(name: str) -> None:
    assert set(codes(f"LD n\n{LISTS[name]}ST n")) == {"S0114"}


def test_the_deepest_instruction_lists_allowed() -> None:
    assert codes("LD n\n" + "ADD (\nLD n\n" * NESTING_LIMIT + ")\n" * NESTING_LIMIT + "ST n") == []
    for inside in ("ADD (\nLD n\n" + "ADD 1\n" * (CHAIN_LIMIT - 2) + ")\n", "ADD (\nLD n\n)\n" * MOST_LINES):
        text = f"PROGRAM p VAR n : INT; END_VAR\nLD n\n{inside}ST n\nEND_PROGRAM\n"
        assert compile_sources([Source("x", text)], runnable=True).image is not None


WIDE = {
    "statements": ";" * MANY,
    "targets": "a := " * MANY + "1;",
    "arguments": "f(" + "1, " * MANY + "1);",
    "elsif": "IF a THEN b; " + "ELSIF a THEN b;\n" * 10_000 + "END_IF",
    "labels": "CASE a OF " + "1: ;\n" * 10_000 + "END_CASE",
    "comments": "(*" * MANY + "*)" * MANY,
    "names": "a" * 1_000_000 + " := 1;",
}


@pytest.mark.parametrize("name", WIDE)
def test_width_is_not_limited(name: str) -> None:
    assert codes(WIDE[name]) == []


ODD = {
    "nothing": "", "spaces": " \n\t\r\n\f", "nul": "\0" * MANY, "surrogates": "\ud800 x \udfff", "signs": "@#$%^&*" * 1000,
    "dots": "." * MANY, "open comments": "(*" * MANY, "open pragma": "{" * MANY, "open string": "'" + "x" * MANY,
    "quotes": "'\n" * 1000, "words": "FUNCTION_BLOCK " * 1000, "ends": "END_IF " * 1000, "ifs": "IF " * 1000,
    "else": "PROGRAM p IF a THEN " + "ELSE " * 1000, "mark": "\ufeffPROGRAM p END_PROGRAM", "methods": "METHOD m " * 1000,
    "types": "TYPE a : " * 1000, "at": "VAR_GLOBAL " + "AT " * 1000, "not closed": "PROGRAM p x := f(a := [1, (",
    "digits": "9" * MANY,
    "repetitions": "VAR_GLOBAL a : ARRAY[0..1] OF INT := [999999999(1, 2)]; END_VAR", "bidi": "PROGRAM \u202e p",
    "a place cut off": "PROGRAM p VAR x : AT", "a head cut off": "FUNCTION F(:):",
}


@pytest.mark.parametrize("name", ODD)
def test_no_text_raises(name: str) -> None:
    source = Source("x", ODD[name])
    _, diagnostics = parse(source)
    assert len(diagnostics) <= 100
    assert all(0 <= d.start <= d.end <= len(source.text) and d.render() for d in diagnostics)
