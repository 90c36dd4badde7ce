"""Syntax errors do not hide what is wrong elsewhere, and are not followed by messages that only follow from them."""

from __future__ import annotations

from fbvm.code.compiler import compile_text


def found(text: str) -> list[tuple[str, int]]:
    return [(d.code, d.line) for d in compile_text(text).diagnostics]


def test_a_missing_semicolon_does_not_hide_the_rest() -> None:
    assert found("PROGRAM Main\nVAR a : INT; END_VAR\na := 5 / c\na := TRUE;\nEND_PROGRAM") == [
        ("S0201", 3), ("S0101", 3), ("S0301", 4)]


def test_a_statement_that_was_skipped_silences_its_own_line_only() -> None:
    assert found("FUNCTION F : INT\nVAR_INPUT x : INT; END_VAR\nF := x + ;\nlost := 3;\nEND_FUNCTION\n"
                 "PROGRAM Main\nVAR a : INT; END_VAR\na := F(x := 2);\nb := 1;\nEND_PROGRAM") == [
        ("S0101", 3), ("S0201", 4), ("S0201", 9)]


def test_a_body_of_skipped_statements_is_taken_for_another_language() -> None:
    lost = "x := + ;\n" * 4
    assert found(f"PROGRAM Main\nVAR x : INT; END_VAR\n{lost}lost := 3;\nEND_PROGRAM\n"
                 "FUNCTION_BLOCK F\nlost := 3;\nEND_FUNCTION_BLOCK") == [
        *(("S0101", line) for line in range(3, 7)), ("S0201", 10)]


def test_a_wrong_operator_or_literal_hides_nothing() -> None:
    assert found("PROGRAM Main\nVAR a : INT; END_VAR\nIF a == 1 THEN b := 2; END_IF;\na := 0xFF + TRUE;\na := TRUE;\n"
                 "END_PROGRAM") == [("S0101", 3), ("S0201", 3), ("S0105", 4), ("S0301", 5)]


def test_an_end_that_is_missing_or_wrong_hides_nothing() -> None:
    assert found("PROGRAM Main\nVAR a : INT; END_VAR\nIF a = 1 THEN\n  a := b;\nEND_FOR;\na := c;\nIF a = 2 THEN\n"
                 "  a := d;\nEND_PROGRAM") == [("S0201", 4), ("S0101", 5), ("S0201", 6), ("S0201", 8), ("S0101", 9)]


def test_names_of_a_damaged_declaration_are_not_unknown() -> None:
    assert found("PROGRAM Main\nVAR a : ; b : INT; END_VAR\na := 1; b := TRUE;\nEND_PROGRAM") == [("S0101", 2)]


def test_names_of_a_damaged_type_are_not_unknown_elsewhere() -> None:
    assert found("TYPE T : STRUCT x : ; END_STRUCT END_TYPE\nPROGRAM Main\nVAR t : T; i : INT; END_VAR\n"
                 "t.x := 1; i := TRUE;\nEND_PROGRAM") == [("S0101", 1), ("S0301", 4)]


def test_methods_after_a_base_that_is_unknown_are_not_complained_about() -> None:
    assert found("FUNCTION_BLOCK B EXTENDS A\nVAR a : INT; END_VAR\nAct();\nMETHOD Act\na := 1;\nEND_METHOD\nEND_FUNCTION_BLOCK\n"
                 "PROGRAM Main\nVAR f : B; END_VAR\nf.Act();\nf.M();\nEND_PROGRAM") == [("S1001", 1)]
