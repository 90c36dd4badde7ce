"""Which operators of a list and which qualifiers of an action are taken for which others."""

from __future__ import annotations

import pytest
from rows import each_of
from test_mutation_operators import lines

CHART = """INITIAL_STEP One: {} END_STEP
TRANSITION FROM One TO Two := b; END_TRANSITION
STEP Two: END_STEP
TRANSITION FROM Two TO One: {} END_TRANSITION"""
OTHERS = {"N": "S P", "S": "N R", "R": "S", "P": "N", "P0": "P1", "P1": "P0", "L": "D", "D": "L",
          "SD": "SL DS", "DS": "SD", "SL": "SD"}


@pytest.mark.slow
@each_of("qualifier", OTHERS)
def test_a_qualifier_is_taken_for_its_relatives(qualifier: str) -> None:
    time = ", T#1s" if qualifier in ("L", "D", "SD", "DS", "SL") else ""
    for written in (f"({qualifier}{time})", f"( {qualifier.lower()} {time})"):
        chart = CHART.format(f"a{written}; c(N);", ":= b;").replace("One: :=", "One :=")
        own = {each.partition("a(")[2].partition(")")[0].partition(",")[0].strip() for each in lines(chart)
               if each.startswith("QUAL") and "c(N)" in each}  # fmt: skip
        assert own == set(OTHERS[qualifier].split())


def test_an_action_without_a_qualifier_is_left_out_only() -> None:
    chart = CHART.format("a;", ":= b;").replace("One: :=", "One :=")
    assert {each[:4] for each in lines(chart) if "a;" not in each} == {"ASD "}
    assert not [each for each in lines(chart) if each.startswith("QUAL")]


def changed(row: str, before: str = "LD n", behind: str = "ST n") -> set[str]:
    """The mutants of a row of a list that change it, each as `OPERATOR row`."""
    found = set()
    for each in lines(f"{before}\n{row}\n{behind}"):
        operator, _, text = each.partition(" ")
        rows = text.split("\n")
        if rows[0] == before and rows[-1] == behind and operator != "CRO":
            found.add(f"{operator} {rows[1]}".rstrip())
    return found


WORDS = {
    "GT 3": "ROR GE|ROR LT", "GE 3": "ROR GT|ROR LE", "LT 3": "ROR LE|ROR GT", "LE 3": "ROR LT|ROR GE", "EQ 3": "ROR NE",
    "NE 3": "ROR EQ", "ADD 3": "ARO SUB", "SUB 3": "ARO ADD", "MUL 3": "ARO DIV", "DIV 3": "ARO MUL", "MOD 3": "ARO DIV",
    "add 3": "ARO SUB", "Gt 3": "ROR GE|ROR LT", "NOT": "",
}  # fmt: skip
BITS = {
    "AND b": "LRO OR|NIO ANDN", "OR b": "LRO AND|NIO ORN", "XOR b": "LRO OR|NIO XORN", "ANDN b": "LRO ORN|NIO AND",
    "ORN b": "LRO ANDN|NIO OR", "XORN b": "LRO ORN|NIO XOR", "LD b": "NIO LDN", "LDN b": "NIO LD", "ST b": "NIO STN",
    "STN b": "NIO ST", "S b": "SRO R", "R b": "SRO S", "RET": "", "RETC": "NIO RETCN", "RETCN": "NIO RETC",
}  # fmt: skip


def wanted(row: str, others: str) -> set[str]:
    operand = row.partition(" ")[2]
    return {"SDL", *(f"{each} {operand}".rstrip() for each in others.split("|") if each)}


@each_of("row", WORDS)
def test_an_operator_of_numbers_is_taken_for_its_relatives(row: str) -> None:
    assert changed(row) == wanted(row, WORDS[row])


@each_of("row", BITS)
def test_an_operator_of_bits_is_taken_for_its_relatives(row: str) -> None:
    assert changed(row, "LD a", "ST c") == wanted(row, BITS[row])


def test_what_opens_or_closes_a_bracket_is_not_left_out() -> None:
    assert changed("AND(\nLD b\n)", "LD a", "ST c") == {"LRO OR(", "NIO ANDN(", "NIO AND(", "SDL AND("}
