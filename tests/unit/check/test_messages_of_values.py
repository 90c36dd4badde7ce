"""What is said of subscripts and of initial values that mean nothing, word for word."""

from __future__ import annotations

from rows import each_of

from fbvm.code.compiler.driver import compile_text


@each_of("access, kind, hint", [
    ("n[3]", "INT", "a bit is written n.3"), ("n[15]", "INT", "a bit is written n.15"),
    ("n[16]", "INT", "bits are written n.0 to n.15"), ("n[0]", "INT", "a bit is written n.0"),
    ("n[-1]", "INT", "bits are written n.0 to n.15"), ("n[16#A]", "INT", "a bit is written n.10"),
    ("n[1.5]", "INT", "bits are written n.0 to n.15"), ("n[n]", "INT", "bits are written n.0 to n.15"),
    ("n[k]", "INT", "a bit is written n.2"), ("n[1, 2]", "INT", ""), ("b[i]", "BYTE", "bits are written b.0 to b.7"),
    ("b[7]", "BYTE", "a bit is written b.7"), ("a[0][3]", "LWORD", "a bit is written a[0].3"),
    ("a[0][64]", "LWORD", "bits are written a[0].0 to a[0].63"), ("r[1]", "REAL", ""), ("t[1]", "TIME", ""), ("x[0]", "BOOL", ""),
])  # fmt: skip
def test_a_subscript_of_a_number_may_mean_a_bit(access: str, kind: str, hint: str) -> None:
    errors = compile_text(f"""PROGRAM Main
    VAR n : INT; b : BYTE; a : ARRAY [0..3] OF LWORD; r : REAL; t : TIME; x : BOOL; i : USINT; END_VAR
    VAR CONSTANT k : INT := 2; END_VAR
    x := {access};
    END_PROGRAM""").errors
    said = [(each.code, each.line, each.message, each.hint) for each in errors]
    assert said == [("S0304", 4, f"this is {kind}, not an array", hint)]


IN_BODY = "assign it in the body instead"
OR_TAKE = f"{IN_BODY}, or take --dialect codesys, twincat or rusty"


@each_of("dialect, value, hint", [
    ("standard", "x", OR_TAKE), ("standard", "b.o", OR_TAKE), ("standard", "x + 1", IN_BODY), ("standard", "F()", IN_BODY),
    ("codesys", "F()", IN_BODY), ("rusty", "F() + 1", IN_BODY), ("matiec", "x", OR_TAKE),
])
def test_a_dialect_is_named_in_which_a_variable_is_an_initial_value(dialect: str, value: str, hint: str) -> None:
    errors = compile_text(f"""FUNCTION_BLOCK B VAR_OUTPUT o : INT; END_VAR END_FUNCTION_BLOCK
    FUNCTION F : INT F := 1; END_FUNCTION
    PROGRAM Main
    VAR b : B; x : INT := 1; y : INT := {value}; END_VAR
    END_PROGRAM""", dialect=dialect).errors  # fmt: skip
    said = [(each.code, each.line, each.message, each.hint) for each in errors]
    assert said == [("S0701", 4, "an initial value must be known before the program runs", hint)]
