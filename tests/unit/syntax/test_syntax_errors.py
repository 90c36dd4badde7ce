"""Errors are told once, in words of the language, and hide nothing that comes behind them."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_text
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Assign, For, If, Pou, SourceText


def wrong(text: str) -> list[Diagnostic]:
    return [d for d in parse(Source("x.st", text))[1] if d.severity == "error"]


def body(statements: str) -> tuple[Pou, list[Diagnostic]]:
    """The POU around some statements and its errors; a POU behind it must be found too."""
    source = Source("x.st", f"FUNCTION_BLOCK f\n{statements}\nEND_FUNCTION_BLOCK\nPROGRAM p z := 1; END_PROGRAM\n")
    tree, diagnostics = parse(source)
    first, second = tree.declarations
    assert isinstance(first, Pou) and isinstance(second, Pou) and len(second.body) == 1
    return first, diagnostics


ONE_ERROR = [
    ("x := 1\ny := 2;", "`;` expected after the statement", 2),
    ("IF a THEN x := 1 END_IF y := 2;", "`;` expected after the statement", 2),
    ("x := (a + b; y := 1;", "`)` expected before `;`", 2),
    ("x := a[1; y := 1;", "`]` expected before `;`", 2),
    ("x := a + b); y := 1;", "`)` without `(`", 2),
    ("f(a := 1 b := 2); y := 1;", "`,` expected before `b`", 2),
    ("IF a x := 1; END_IF y := 1;", "`THEN` expected before `x`", 2),
    ("WHILE a x := 1; END_WHILE y := 1;", "`DO` expected before `x`", 2),
    ("CASE a 1: x := 1; END_CASE y := 1;", "`OF` expected before `1`", 2),
    ("IF a + THEN x := 1; END_IF y := 1;", "an expression expected, but `THEN` found", 2),
    ("IF THEN x := 1; END_IF y := 1;", "an expression expected, but `THEN` found", 2),
    ("FOR i = 1 TO 2 DO x := 1; END_FOR y := 1;", "`:=` expected, but `TO` found", 2),
    ("x := ; y := 1;", "an expression expected, but `;` found", 1),
    ("x := * 2; y := 1;", "an expression expected, but `*` found", 2),
    ("END_IF; y := 1;", "`END_IF` without IF", 1),
    ("IF a THEN x := 1; ENDIF; y := 1;", "`ENDIF` is no word of Structured Text", 2),
    ("IF a THEN x := 1; ELSEIF b THEN x := 2; END_IF y := 1;", "`ELSEIF` is no word of Structured Text", 2),
    ("x := a == b; y := 1;", "`==` is no operator of Structured Text", 2),
    ("x := a && b; y := 1;", "`&&` is no operator of Structured Text", 2),
    ("x += 1; y := 1;", "`+=` is no operator of Structured Text", 2),
    ("x := !a; y := 1;", "`!` is no operator of Structured Text", 2),
    ("x := a @ ; y := 1;", "unexpected character '@'", 2),
    ("x := TYPE; y := 1;", "an expression expected, but `TYPE` found", 1),
    ("FOR := 1; y := 1;", "`FOR` is a reserved word and cannot be a name", 2),
    ("x := 'open\n; y := 1;", "string literal without end on its line", 2),
    ("REPEAT x := 1; UNTIL END_REPEAT y := 1;", "an expression expected, but `END_REPEAT` found", 2),
    ("x := .5; y := 1;", "an expression expected, but `.5` found", 1),
    ("VAR q : INT; END_VAR y := 1;", "", 1),
    ("y := 1; VAR q : INT; END_VAR", "`VAR` behind the first statement", 1),
    ("CASE a OF x := 1; 1: x := 2; END_CASE y := 1;",
     "a statement in CASE stands behind a label, none is in front of this one", 2),
    ("x : = 1; y := 1;", "`: =` is no operator of Structured Text", 2),
    ("x =: 1; y := 1;", "`=:` is no operator of Structured Text", 2),
    ("i++; y := 1;", "`++` is no operator of Structured Text", 2),
    ("IF a THEN x := 1; END IF y := 1;", "`END IF` is no word of Structured Text", 2),
    ("CASE a OF 1: x := 1; ELSE: x := 2; END_CASE y := 1;", "`:` behind ELSE", 2),
    ("CASE a OF 1 x := 1; END_CASE y := 1;", "`:` expected before `x`", 2),
    ("fb(a := 1; b := 2); y := 1;", "`,` expected, but `;` found", 2),
    ("REPEAT x := 1; UNTIL a; y := 1;", "`END_REPEAT` expected before `y`", 2),
    ("VAR a := 1; END_VAR y := 1;", "`:`, `,` or `AT` expected, but `:=` found", 1),
    ("VAR_IN a : INT; END_VAR y := 1;", "`VAR_IN` is no word of Structured Text", 1),
    ("VAR END, VAR_X : INT; END_VAR END := VAR_X; VAR_X := END + VAR_X;", "", 2),
    ("(a : INT) y := 1;", "`(` behind the name `f` of a POU", 1),
    ("a : INT; y := 1;", "a declaration stands in front of all statements", 2),
    ("1: x := 1;", "label of CASE outside of a CASE statement", 2),
    ("§1: x := 1;", "unexpected character '§'", 2),
]


@pytest.mark.slow
@each_of(("text", "message", "statements"), ONE_ERROR, ids=[e[0].replace("\n", " ") for e in ONE_ERROR])
def test_one_mistake_gives_one_message_and_the_rest_is_read(text: str, message: str, statements: int) -> None:
    pou, diagnostics = body(text)
    assert [d.message for d in diagnostics] == ([message] if message else [])
    assert len(pou.body) == statements


def test_the_message_points_behind_the_statement_that_lacks_its_semicolon() -> None:
    _, (error,) = body("x := 1\ny := 2;")
    assert error.render() == (
        "x.st:2:7: error S0101: `;` expected after the statement\n"
        "    x := 1\n"
        "          ^")


def test_a_comment_that_another_one_keeps_open_is_marked_at_its_sign() -> None:
    [error] = compile_text("PROGRAM p\n(* a (* b *)\nEND_PROGRAM\n").diagnostics
    assert error.render() == (
        "text.st:2:1: error S0103: comment without end\n"
        "    (* a (* b *)\n"
        "    ^^\n"
        "  help: close it with *), once for each sign of a beginning, or take --dialect matiec or omron")


def test_an_open_block_is_named_with_its_line() -> None:
    pou, (error,) = body("\nIF a THEN\n  x := 1;")
    assert error.message == "END_IF expected before `END_FUNCTION_BLOCK`: the IF of line 3 is still open"
    assert error.related is not None and error.related[0].place(error.related[1]) == (3, 1)
    assert isinstance(pou.body[0], If) and len(pou.body[0].branches[0][1]) == 1


def test_the_indentation_tells_which_block_lacks_its_end() -> None:
    _, (error,) = body("IF a THEN\n  IF b THEN\n    x := 1;\n  y := 2;\nEND_IF")
    assert error.hint == ("by the indentation, the END_IF of line 6 ends another block: "
                          "the IF of line 3 may be the one without its end")


def test_else_if_is_explained() -> None:
    _, (error,) = body("IF a THEN x := 1; ELSE IF b THEN x := 2; END_IF")
    assert error.hint == "ELSE IF in line 2 opens a second IF; write ELSIF"


def test_the_block_of_a_wrong_head_is_read() -> None:
    pou, diagnostics = body("FOR i := 1 UNTO 5 DO x := ; y := 1; END_FOR z := 1;")
    assert [d.message for d in diagnostics] == ["`TO` expected, but `UNTO` found", "an expression expected, but `;` found"]
    assert isinstance(pou.body[0], For) and len(pou.body[0].body) == 1 and isinstance(pou.body[1], Assign)


def test_every_missing_semicolon_is_told() -> None:
    _, diagnostics = body("a := 1\nb := 2\nc := 3\nd := 4;")
    assert [d.line for d in diagnostics] == [2, 3, 4]


def test_a_missing_end_var_is_told_and_the_statements_are_read() -> None:
    pou, (error,) = body("VAR a : INT;\na := 1;\nb := 2;")
    assert error.message == "END_VAR expected before `a`, which begins a statement"
    assert len(pou.sections[0].variables) == 1 and len(pou.body) == 2


def test_a_pou_without_end_is_named() -> None:
    errors = wrong("FUNCTION_BLOCK pump x := 1;\nPROGRAM p END_PROGRAM")
    assert [d.message for d in errors] == [
        "END_FUNCTION_BLOCK expected before `PROGRAM`: the FUNCTION_BLOCK `pump` of line 1 is still open"]


def test_text_between_pous_is_told_once() -> None:
    tree, diagnostics = parse(Source("x", "some words; and more; of it\nPROGRAM p END_PROGRAM"))
    assert len(diagnostics) == 1 and len(tree.declarations) == 1


def test_the_end_of_the_text_is_where_the_last_word_ends() -> None:
    (error,) = wrong("PROGRAM p x := 1;\n\n\n")
    assert (error.line, error.column) == (1, 18)
    assert "the end of the text" in error.message


def test_a_comment_without_end_is_the_only_message() -> None:
    (error,) = wrong("PROGRAM p x := 1; (* and the rest\nEND_PROGRAM")
    assert (error.code, error.start) == ("S0103", 18)


def test_a_method_without_end_stops_at_its_pou() -> None:
    errors = wrong("FUNCTION_BLOCK f METHOD m x := 1; END_FUNCTION_BLOCK PROGRAM p END_PROGRAM")
    assert [d.message for d in errors] == [
        "END_METHOD expected before `END_FUNCTION_BLOCK`: the METHOD of line 1 is still open"]


@pytest.mark.slow
def test_there_is_an_end_of_errors() -> None:
    assert len(wrong("PROGRAM p\n" + "x := 1\n" * 1000 + "END_PROGRAM")) == 100


@pytest.mark.slow
def test_what_was_read_before_too_many_errors_is_kept() -> None:
    tree, _ = parse(Source("x", "PROGRAM p END_PROGRAM TYPE t : INT; END_TYPE PROGRAM q\n" + "x := 1\n" * 200))
    assert isinstance(tree, SourceText) and len(tree.declarations) == 2


@pytest.mark.parametrize("name", ["x_", "a__b", "__NEW"])
def test_names_the_standard_forbids_are_warned_of_where_they_are_declared(name: str) -> None:
    _, diagnostics = parse(Source("x", f"PROGRAM p VAR {name} : INT; END_VAR {name} := 1; END_PROGRAM"))
    assert [(d.code, d.severity) for d in diagnostics] == [("S0191", "warning")]


@each_of(("pragma", "known"), [
    ("{region 'x'}", True), ("{ENDREGION}", True), ("{attribute 'qualified_only'}", True), ("{ }", True),
    ("{attribute 'pack_mode' := '1'}", True), ("{attribute 'pack_mode' := '3'}", False), ("{IF defined(x)}", False),
    ("{??}", False)])
def test_pragmas_that_might_matter_are_warned_of(pragma: str, known: bool) -> None:
    tree, diagnostics = parse(Source("x", f"{pragma} PROGRAM p END_PROGRAM"))
    assert [d.code for d in diagnostics] == ([] if known else ["S0190"])
    assert tree.pragmas[0].text == pragma[1:-1] and len(tree.declarations) == 1


def test_a_byte_order_mark_is_no_text() -> None:
    assert parse(Source("x", "\ufeffPROGRAM p END_PROGRAM"))[1] == []


def test_an_odd_character_does_not_hide_an_open_block() -> None:
    _, diagnostics = body("IF a THEN x := 1; @")
    assert [d.code for d in diagnostics] == ["S0102", "S0101"]


def test_words_that_matter_in_one_place_can_be_set_and_reset() -> None:
    pou, diagnostics = body("on S= TRUE; with R= step; step S= on; IF S=1 THEN ; END_IF")
    assert diagnostics == [] and [getattr(s, "op", "") for s in pou.body] == ["S=", "R=", "S=", ""]


@pytest.mark.parametrize(("signs", "pieces"), [
    ("??", ["??"]), ("?" * 5000, ["?" * 5000]), ("@?#", ["@?#"]), ("? ?", ["?", "?"]), ("???= 1", ["??"]), ("@+ 1", ["@"]),
    ("@'a'", ["@"]), ("@(* *)", ["@"]), ("@%MW3", ["@"]), ("@5", ["@"])])
def test_signs_that_begin_no_token_are_one_error_up_to_the_next_token(signs: str, pieces: list[str]) -> None:
    _, diagnostics = body(f"x := y {signs};")
    odd = [d for d in diagnostics if d.code == "S0102"]
    assert [d.source.text[d.start:d.end] for d in odd] == pieces
