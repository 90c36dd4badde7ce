"""All quick fixes of a program: their titles, which one an editor makes by itself (*), and the text behind each of them."""

from __future__ import annotations

from editing import MARK, at_mark
from rows import each_of

from fbvm.analysis.fixes import applied, fixes

BODY = "PROGRAM Main VAR b, c : BOOL; n AT D5 : INT; r : REAL; END_VAR {} END_PROGRAM\n"


def check(text: str, made: list[tuple[str, str]], frame: str = "{}", dialect: str = "standard") -> None:
    """Fails unless the fixes of all diagnostics of a text within a frame are these, each with what it makes of the text."""
    whole = frame.replace("{}", text)
    program, _ = at_mark(MARK + whole, dialect)
    found = [(fix.title + "*" * fix.best, applied(whole, fix.edits)) for fix in fixes(program, "pump.st", 0, len(whole))]
    assert found == [(title, frame.replace("{}", then)) for title, then in made]


@each_of("written, made", [
    ("b := b && c;", [("Write AND*", "b := b AND c;")]), ("b := b&&c;", [("Write AND*", "b := b AND c;")]),
    ("b := b ||c;", [("Write OR*", "b := b OR c;")]), ("b := (b)|| c;", [("Write OR*", "b := (b)OR c;")]),
    ("b := !c;", [("Write NOT*", "b := NOT c;")]), ("b := ~(c);", [("Write NOT*", "b := NOT(c);")]),
    ("n := n%2;", [("Write MOD*", "n := n MOD 2;")]), ("b := b != c;", [("Write <>*", "b := b <> c;")]),
    ("b := b!=c;", [("Write <>*", "b := b<>c;")]), ("b := n =<2;", [("Write <=*", "b := n <=2;")]),
    ("b := b == c;", [("Write =*", "b := b = c;")]), ("n : = 1;", [("Write :=*", "n := 1;")]),
    ("b := n < = 1;", [("Write <=*", "b := n <= 1;")]), ("b := n > = 1;", [("Write >=*", "b := n >= 1;")]),
    ("b := n < > 1;", [("Write <>*", "b := n <> 1;")]), ("n =: 1;", [("Write :=*", "n := 1;")]),
    ("n = 1;", [("Write :=*", "n := 1;")]), ("IF n := 1 THEN END_IF", [("Write =*", "IF n = 1 THEN END_IF")]),
    ("b = n >= 1;", [("Write :=*", "b := n >= 1;")]), ("n >= 1;", []), ("n <= 1;", []), ("n <> 1;", []),
])
def test_operators_of_other_languages_become_those_of_structured_text(written: str, made: list[tuple[str, str]]) -> None:
    check(written, made, BODY)


@each_of("written, made", [
    ("b := ON;", [("Write TRUE*", "b := TRUE;")]), ("n := STRLEN('a');", [("Write LEN*", "n := LEN('a');")]),
    ("r := PI;", [("Write 3.14159265358979*", "r := 3.14159265358979;")]),
    ("n := r;", [("Write REAL_TO_INT(r)*", "n := REAL_TO_INT(r);")]),
    ("n := r + r;", [("Write REAL_TO_INT(r + r)*", "n := REAL_TO_INT(r + r);")]),
    ("b := 1 < n < 3;", [("Write 1 < n AND n < 3*", "b := 1 < n AND n < 3;")]),
    ("CASE n OF 5..2: n := 1; END_CASE;", []), ("n := n / 0;", []), ("nobody(1);", []),
])
def test_what_a_hint_says_is_written_where_it_helps(written: str, made: list[tuple[str, str]]) -> None:
    check(written, made, BODY)


@each_of("written, made", [
    ("IF b n := 2; END_IF", [("Insert THEN*", "IF b THEN n := 2; END_IF")]),
    ("IF b\nn := 2; END_IF", [("Insert THEN*", "IF b THEN\nn := 2; END_IF")]),
    ("FOR n 0 TO 3 DO END_FOR", [("Insert :=*", "FOR n := 0 TO 3 DO END_FOR")]),
    ("n := (1 + 2;", [("Insert )*", "n := (1 + 2);")]), ("n := 1 r := 2.0;", [("Insert ;*", "n := 1; r := 2.0;")]),
    ("CASE n OF 1: n := 3;", [("Insert END_CASE*", "CASE n OF 1: n := 3; END_CASE")]),
    ("IF b THEN\n  n := 1;\n ", [("Insert END_IF*", "IF b THEN\n  n := 1;\n  END_IF;\n ")]),
    ("IF b THEN\n\tCASE n OF\n1: n := 2;\n\tEND_IF", [
        ("Insert END_CASE*", "IF b THEN\n\tCASE n OF\n1: n := 2;\n\tEND_CASE;\n\tEND_IF")]),
    ("IF b THEN CASE n OF\n1: n := 2; END_IF", [("Insert END_CASE*", "IF b THEN CASE n OF\n1: n := 2; END_CASE END_IF")]),
])
def test_a_word_that_is_missing_is_inserted_where_it_is_expected(written: str, made: list[tuple[str, str]]) -> None:
    check(written, made, BODY)


def test_of_several_names_that_are_meant_the_nearest_one_is_the_best() -> None:
    check("Leve", [("Write Lever*", "Lever"), ("Write Level", "Level"), ("Write Levels", "Levels")],
          "PROGRAM Main VAR Level, Levels, Lever : INT; END_VAR {} := 1; END_PROGRAM\n")


def test_of_several_enumerations_those_are_proposed_that_fit() -> None:
    frame = ("TYPE A : (Red, Green); B : (Red, Blue); END_TYPE\nPROGRAM Main VAR a1 : A; b1 : B; n : INT; END_VAR\n"
             "a1 := Red; b1 := Red; {} END_PROGRAM\n")
    check("IF Red = a1 THEN n := 1; END_IF", [("Write A#Red*", "IF A#Red = a1 THEN n := 1; END_IF")], frame)
    check("IF Red = b1 THEN n := 1; END_IF", [("Write B#Red*", "IF B#Red = b1 THEN n := 1; END_IF")], frame)


@each_of("written, made", [
    ("VAR\n    n : INT;\nEND_VAR\n", "VAR\n    n : INT;\n    k : INT;\nEND_VAR\n"),
    ("VAR n : INT; END_VAR\n", "VAR n : INT; k : INT; END_VAR\n"),
    ("  VAR\n    n : INT;\n  END_VAR\n", "  VAR\n    n : INT;\n      k : INT;\n  END_VAR\n"),
    ("VAR RETAIN n : INT; END_VAR\n", "VAR RETAIN n : INT; END_VAR\nVAR\n    k : INT;\nEND_VAR\n"),
    ("VAR n : INT; END_VAR VAR m : INT; END_VAR\nm := 2;", "VAR n : INT; END_VAR VAR m : INT; k : INT; END_VAR\nm := 2;"),
    ("VAR n : INT; END_VAR VAR_TEMP m : INT; END_VAR\nm := 2;",
     "VAR n : INT; k : INT; END_VAR VAR_TEMP m : INT; END_VAR\nm := 2;"),
])
def test_a_name_is_declared_behind_the_variables_of_the_last_plain_section(written: str, made: str) -> None:
    check(written, [("Declare k : INT*", made)], "PROGRAM Main\n{}n := k;\nEND_PROGRAM\n")


@each_of("written, made", [
    ("    n + 1;", [("Suppress S0193 on this line", "    {warning disable S0193}\n    n + 1;\n    {warning restore S0193}")]),
    ("n = 1;", [("Write :=*", "n := 1;"),
                ("Suppress S0193 on this line", "{warning disable S0193}\nn = 1;\n{warning restore S0193}")]),
    ("\tn := 2; n + 1; // said", [
        ("Suppress S0193 on this line",
         "\t{warning disable S0193}\n\tn := 2; n + 1; // said\n\t{warning restore S0193}")]),
])
def test_a_warning_is_switched_off_around_its_line(written: str, made: list[tuple[str, str]]) -> None:
    check(written, made, "PROGRAM Main VAR n : INT; END_VAR\n{}\nEND_PROGRAM\n", "codesys")


def test_a_fix_that_brings_an_error_in_another_file_is_not_offered() -> None:
    text = "FUNCTION F : INT\nVAR_INPUT a : INT; b : INT; END_VAR\nF := a;\nEND_FUNCTION\n"
    for called, titles in (("a := 1", ["Remove b", "Suppress S0293 on this line"]), ("1, 2", ["Suppress S0293 on this line"])):
        program, _ = at_mark(MARK + text)
        program.replace("main.st", f"PROGRAM Main VAR n AT D5 : INT; END_VAR n := F({called}); END_PROGRAM\n")
        program.check_all()
        assert [fix.title for fix in fixes(program, "pump.st", 0, len(text))] == titles
