"""What canonical Structured Text looks like."""

from __future__ import annotations

from textwrap import dedent

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.check.spelling import OUTSIDE
from fbvm.syntax.formatter.formatter import formatted
from fbvm.syntax.formatter.layout import WIDTH, shifted


def written(text: str) -> str:
    text, wrong = formatted(Source("x.st", text))
    assert wrong == []
    assert formatted(Source("x.st", text)) == (text, [])
    return text


def body(statements: str) -> str:
    """Statements as they are written in a program, without its indentation."""
    lines = written(f"PROGRAM p\n{statements} END_PROGRAM").split("\n")
    assert lines[0] == "PROGRAM p" and lines[-2:] == ["END_PROGRAM", ""]
    return dedent("\n".join(lines[1:-2])) + "\n"


def text(picture: str) -> str:
    return dedent(picture).lstrip("\n")


def test_a_program_is_laid_out_by_its_structure() -> None:
    assert written("""
        type Color:(red,Green:=5);P:struct x,y:real;end_struct end_type
        program Main var_input a:int:=3;end_var var constant b at %mw4:word;end_var
        if a>1 then b:=2;elsif a<0 then b:=3;else ;end_if for i:=1 to 9 by 2 do exit;end_for end_program
        configuration c resource r task t(interval:=t#1s,PRIORITY:=1);program m with t:Main(a:=5);end_resource end_configuration
        """) == text("""
        TYPE
            Color : (red, Green := 5);
            P : STRUCT
                x, y : REAL;
            END_STRUCT;
        END_TYPE

        PROGRAM Main
        VAR_INPUT
            a : INT := 3;
        END_VAR
        VAR CONSTANT
            b AT %MW4 : WORD;
        END_VAR
            IF a > 1 THEN
                b := 2;
            ELSIF a < 0 THEN
                b := 3;
            ELSE
                ;
            END_IF;
            FOR i := 1 TO 9 BY 2 DO
                EXIT;
            END_FOR;
        END_PROGRAM

        CONFIGURATION c
            RESOURCE r
                TASK t(INTERVAL := T#1s, PRIORITY := 1);
                PROGRAM m WITH t : Main(a := 5);
            END_RESOURCE
        END_CONFIGURATION
        """)


def test_declarations_stand_in_columns() -> None:
    assert written("""VAR_GLOBAL
        a : INT := 5; // one
        Longer : DINT := 10; // two
        here AT D5 : INT;
        there AT CIO   1519.03 : BOOL;
        block : A_long_name := (x := 1);
        last AT D7 : INT := 2;

        x : INT;
        A_name_that_is_much_longer_than_x : INT;
        END_VAR""") == text("""
        VAR_GLOBAL
            a      : INT  := 5;   // one
            Longer : DINT := 10;  // two
            here  AT D5          : INT;
            there AT CIO 1519.03 : BOOL;
            block : A_long_name := (x := 1);
            last AT D7 : INT := 2;

            x : INT;
            A_name_that_is_much_longer_than_x : INT;
        END_VAR
        """)


@pytest.mark.parametrize(("given", "wanted"), [
    ("a:=b+c*-d;", "a := b + c * -d;"),
    ("a := - - b ** + c;", "a := - -b ** +c;"),
    ("a:=not(b)and not not c&d;", "a := NOT (b) AND NOT NOT c & d;"),
    ("a:=b:=c<=d;", "a := b := c <= d;"),
    ("x s=true; y Ref= z; w?=v;", "x S= TRUE;\ny REF= z;\nw ?= v;"),
    ("a [ 1 , 2 ] . b ^ . 3:=c.%b1;", "a[1, 2].b^.3 := c.%B1;"),
    ("f ( a:=1 , b=>c , not d=>e , g:= );", "f(a := 1, b => c, NOT d => e, g :=);"),
    ("a:=16#aB+1_000+1.5e3;", "a := 16#aB + 1_000 + 1.5e3;"),
    ("a:=int#16#fF; t:=t#1h_30m; d:=d#2020-1-2;", "a := INT#16#fF;\nt := T#1h_30m;\nd := D#2020-1-2;"),
    ("a:='it$'s  %x';", "a := 'it$'s  %x';"),
    ("%qx0.1:=%ix1.2;", "%QX0.1 := %IX1.2;"),
    ("a := and(b, xor (c, d));", "a := AND(b, XOR(c, d));"),
    ("repeat;until a end_repeat;;", "REPEAT\n    ;\nUNTIL a\nEND_REPEAT;\n;"),
    ("while a do continue; end_while return;", "WHILE a DO\n    CONTINUE;\nEND_WHILE;\nRETURN;"),
    ("case a of 1,2..5:b;-3:;else c();end_case",
     "CASE a OF\n    1, 2..5:\n        b;\n    -3:\n        ;\nELSE\n    c();\nEND_CASE;"),
])
def test_statements(given: str, wanted: str) -> None:
    assert body(given) == wanted + "\n"


def test_up_to_one_empty_line_stays_between_statements() -> None:
    assert body("\n\n\na;\n\n\n\nb;\nIF c THEN\n\nd;\n\nEND_IF\n\n// e\n\n\n") == "a;\n\nb;\nIF c THEN\n    d;\nEND_IF;\n\n// e\n"


def test_declarations_stand_apart() -> None:
    two = "FUNCTION a : INT END_FUNCTION\n// about b\nFUNCTION b : INT END_FUNCTION // end\n// last\n"
    assert written(two) == text("""
        FUNCTION a : INT
        END_FUNCTION

        // about b
        FUNCTION b : INT
        END_FUNCTION  // end
        // last
        """)


# --- long lines ---


def test_a_long_call_has_one_argument_a_line() -> None:
    long = "First := Something.Long, Second := Another_Thing_That_Is_Long, Third := SEL(a, b, c), Fourth := 4"
    assert body(f"Block({long});") == text("""
        Block(First := Something.Long,
              Second := Another_Thing_That_Is_Long,
              Third := SEL(a, b, c),
              Fourth := 4);
        """)


def test_a_call_of_hundred_columns_is_not_long() -> None:
    call = f"f({'x' * (WIDTH - 8)});"
    assert body(call) == call + "\n"
    assert body(f"ff(x, {call[2:-2]}, y);").count("\n") == 3


def test_a_long_condition_is_broken_at_its_weakest_operator() -> None:
    words = [f"Condition_Number_{n}" for n in range(6)]
    condition = f"{words[0]} AND {words[1]} OR {words[2]} AND ({words[3]} OR {words[4]}) OR {words[5]}"
    assert body(f"IF {condition} THEN a; END_IF") == text("""
        IF Condition_Number_0 AND Condition_Number_1
           OR Condition_Number_2 AND (Condition_Number_3 OR Condition_Number_4)
           OR Condition_Number_5 THEN
            a;
        END_IF;
        """)


def test_a_part_that_is_broken_itself_stands_further_in() -> None:
    words = [f"Condition_Number_{n}" for n in range(7)]
    assert body(f"IF {' AND '.join(words[:6])} OR {words[6]} THEN a; END_IF") == text("""
        IF Condition_Number_0
               AND Condition_Number_1
               AND Condition_Number_2
               AND Condition_Number_3
               AND Condition_Number_4
               AND Condition_Number_5
           OR Condition_Number_6 THEN
            a;
        END_IF;
        """)


def test_where_no_room_is_left_arguments_begin_on_a_line_of_their_own() -> None:
    name = "Somewhere_In_A_Plant.Some_Machine.Some_Group.Some_Member_Of_It.Move_To_A_Place"
    assert body(f"{name}(First_Argument := 1234567, Second := 2345678);") == (
        f"{name}(\n        First_Argument := 1234567, Second := 2345678);\n")


def test_tables_fill_their_lines() -> None:
    numbers = ", ".join(str(n) for n in range(1000, 1040))
    lines = written(f"VAR_GLOBAL t : ARRAY[0..39] OF INT := [{numbers}]; END_VAR").split("\n")
    assert [len(line) for line in lines[1:-2]] == [97, 97, 97, 74]
    assert lines[2].startswith(" " * 32 + "1011, ")


# --- comments and pragmas ---


def test_comments_behind_one_another_keep_a_space_between_them() -> None:
    assert body("a; (* one *) (* two *)(* three *)\nb;") == "a;  (* one *) (* two *) (* three *)\nb;\n"


def test_comments_stay_where_they_belong() -> None:
    assert body("""
        // above
        a := 1; // behind
        bbbbb := 2; (* behind too *)
        (* in front *) c := (* within *) 3;
        IF a // why
            AND b THEN // then
            // inside
            c;
            // at the end
        // of the other
        ELSE // else
        END_IF // over
        f(a, // first
          b  // second
        );
        {region 'x'} // named
        {endregion}
        """) == text("""
        // above
        a := 1;        // behind
        bbbbb := 2;    (* behind too *)
        (* in front *) c := (* within *) 3;
        IF a           // why
           AND b THEN  // then
            // inside
            c;
            // at the end
        // of the other
        ELSE     // else
        END_IF;  // over
        f(a,     // first
          b);    // second
        {region 'x'}  // named
        {endregion}
        """)


def test_lines_of_a_comment_keep_their_places_to_one_another() -> None:
    assert body("  (* one\n       two\n\n  three *)\na;") == "(* one\n     two\n\nthree *)\na;\n"
    assert shifted("(* a\n\tb *)", 2) == ["(* a", "      b *)"]


def test_each_part_of_try_stands_by_itself() -> None:
    assert body("__try x:=1; (* one *)\n // of the handler\n__catch ( e ) y:=2 ; __finally // last\n z:=3; __endtry a;") == """\
__TRY
    x := 1;  (* one *)
    // of the handler
__CATCH(e)
    y := 2;
__FINALLY  // last
    z := 3;
__ENDTRY;
a;
"""
    assert body("__TRY __CATCH(e) __ENDTRY; a;") == "__TRY\n__CATCH(e)\n__ENDTRY;\na;\n"


# --- namespaces ---


def test_usings_stand_together_and_namespaces_apart() -> None:
    assert written("using A ;using B.C,D;namespace internal A function F:int using B; F:=1;end_function end_namespace "
                   "namespace B end_namespace") == """\
USING A;
USING B.C, D;

NAMESPACE INTERNAL A
FUNCTION F : INT USING B;
    F := 1;
END_FUNCTION
END_NAMESPACE

NAMESPACE B
END_NAMESPACE
"""


# --- names ---


def test_names_are_written_as_declared() -> None:
    assert written("""
        TYPE Point : STRUCT X : INT; END_STRUCT; Kind : (Small, Large); END_TYPE
        FUNCTION_BLOCK Motor VAR_INPUT Go : BOOL; END_VAR VAR_OUTPUT Place : point; END_VAR END_FUNCTION_BLOCK
        VAR_GLOBAL Origin : POINT := (x := 0); END_VAR
        PROGRAM Main
        VAR m, N : ARRAY[1..2] OF MOTOR; k : KIND; small : Int; END_VAR
        VAR_EXTERNAL ORIGIN : Point; END_VAR
        M[1](GO := TRUE, place => origin); SMALL := n[2].PLACE.x; K := kind#LARGE; unknown := Unknown; k := large;
        END_PROGRAM""").split("\n")[-7:] == [
            "    m[1](Go := TRUE, Place => Origin);", "    small := N[2].Place.X;", "    k := Kind#Large;",
            "    unknown := Unknown;", "    k := Large;", "END_PROGRAM", ""]


def test_names_of_members_steps_actions_tasks_and_programs_are_written_as_declared() -> None:
    lines = [" ".join(line.split()) for line in written("""
        TYPE In : STRUCT A : INT; END_STRUCT; Out : STRUCT One : In; Many : ARRAY[0..1] OF In; END_STRUCT; Alias : Out; END_TYPE
        FUNCTION_BLOCK Motor VAR_INPUT Go : BOOL; END_VAR END_FUNCTION_BLOCK
        PROGRAM Main
        VAR o : alias := (ONE := (a := 1), many := [(A := 2), 1((a := 3))]); m : MOTOR := (GO := TRUE);
            l : ARRAY[1..2] OF out := [(one := (a := 4))]; END_VAR
        INITIAL_STEP Start: work(N); END_STEP
        TRANSITION T1 FROM START TO next := O.ONE.a > 1; END_TRANSITION
        STEP Next: WORK(S); END_STEP
        ACTION Work: M(go := start.x); END_ACTION
        END_PROGRAM
        CONFIGURATION Conf RESOURCE Res ON PLC TASK Quick(PRIORITY := 1); PROGRAM P1 WITH QUICK : MAIN; END_RESOURCE
        END_CONFIGURATION""").split("\n")]
    for line in ("o : Alias := (One := (A := 1), Many := [(A := 2), 1((A := 3))]);", "m : Motor := (Go := TRUE);",
                 "l : ARRAY[1..2] OF Out := [(One := (A := 4))];", "Work(N);", "TRANSITION T1 FROM Start TO Next := o.One.A > 1;",
                 "Work(S);", "m(Go := Start.X);", "PROGRAM P1 WITH Quick : Main;"):  # fmt: skip
        assert line in lines


METHODS = """FUNCTION_BLOCK Base
VAR Speed : INT; END_VAR
METHOD PUBLIC Start : BOOL
VAR_INPUT Go : BOOL; END_VAR
    START := GO AND speed > 3;
END_METHOD
PROPERTY Run : BOOL
GET
    run := SPEED > 0;
END_GET
SET
    SPEED := BOOL_TO_INT(RUN);
END_SET
END_PROPERTY
END_FUNCTION_BLOCK
INTERFACE IWork
METHOD Work END_METHOD
END_INTERFACE
FUNCTION_BLOCK Motor EXTENDS base IMPLEMENTS iwork
VAR Other : BASE; END_VAR
METHOD Work
VAR Own, other : INT; END_VAR
    OWN := SPEED; start(GO := TRUE); OTHER := 1; this^.WORK(); super^.start(go := TRUE); RUN := FALSE;
END_METHOD
work(); START(go := OTHER.RUN);
ACTION Act: SPEED := 1; END_ACTION
END_FUNCTION_BLOCK
PROGRAM Main
VAR M : Motor; I : IWork; END_VAR
m.WORK(); m.START(GO := TRUE); m.RUN := m.SPEED = 1; i := m; i.WORK(); m.ACT();
END_PROGRAM
"""


def test_names_in_and_of_methods_and_properties_are_written_as_declared() -> None:
    text = written(METHODS)
    for line in ("Start := Go AND Speed > 3;", "Run := Speed > 0;", "Speed := BOOL_TO_INT(Run);", "EXTENDS Base IMPLEMENTS IWork",
                 "Own := Speed;", "Start(Go := TRUE);", "other := 1;", "THIS^.Work();", "SUPER^.Start(Go := TRUE);",
                 "Run := FALSE;", "Start(Go := Other.Run);", "M.Run := M.Speed = 1;",
                 "I := M;", "I.Work();", "M.Act();"):  # fmt: skip
        assert line in text


def test_an_external_variable_without_its_global_one_is_spelt_as_it_is_declared() -> None:
    given = "PROGRAM p VAR_EXTERNAL Pump, Valve : INT; END_VAR pump := VALVE; END_PROGRAM VAR_GLOBAL VaLve : INT; END_VAR"
    assert "    Pump, VaLve : INT;" in written(given) and "    Pump := VaLve;" in written(given)


# --- the text as a whole ---


@each_of("wrong", ["PROGRAM p a := ; END_PROGRAM", "x", "(* without end", "PROGRAM p a := 5x; END_PROGRAM"])
def test_a_text_with_errors_is_left_alone(wrong: str) -> None:
    text, errors = formatted(Source("x.st", wrong))
    assert text == wrong and errors and all(d.severity == "error" for d in errors)


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_line_ends_are_kept(line_end: str) -> None:
    given = "PROGRAM p\n(* a\n b *) a; // c\nEND_PROGRAM".replace("\n", line_end)
    assert formatted(Source("x", given))[0] == "PROGRAM p\n    (* a\n     b *) a;  // c\nEND_PROGRAM\n".replace("\n", line_end)


@pytest.mark.parametrize(("given", "wanted"), [("", ""), (" \n\n ", ""), ("// a", "// a\n"), ("\n\n(* a *)\n\n", "(* a *)\n")])
def test_a_text_without_declarations(given: str, wanted: str) -> None:
    assert formatted(Source("x", given)) == (wanted, [])


@pytest.mark.slow
def test_depth_is_no_limit() -> None:
    assert body("a := " + "(" * 150 + "b" + ")" * 150 + ";").count("(") == 150
    assert body("a := " + " + ".join(["b"] * 900) + ";").count("\n") == 900
    assert body("a := " + "NOT " * 900 + "b;").count("NOT ") == 900
    assert body("a" + ".b" * 900 + " := c;").count(".b") == 900
    assert body("IF a THEN " * 150 + "b; " + "END_IF; " * 150).count("END_IF;") == 150


WRITTEN_LIST = """\
PROGRAM Main
VAR
    Go, b : BOOL;
    n     : INT;
    t     : TON;
END_VAR
        LD      Go  // the button
        ANDN    b  // (* and *)

        // both
        ST      b  (* one *)  (* two *)
        JMPC    over
        LD      n
        ADD     (
            LD      3
            MUL     -1
        )
        &N      16#0F
        ST      n
    over:
        CAL     t(  // a timer
                    IN := Go,
                    PT := T#1s
                )
        CAL     t(IN := NOT b, Q => Go)
        LD      n
        LIMIT   3, n
        ST      n
END_PROGRAM
"""
"""An instruction list in canonical text."""


def test_operands_of_instruction_lists_are_spelt_as_everywhere() -> None:
    declared = "TYPE Colour : (Red, Green); END_TYPE\nPROGRAM Main\nVAR c : Colour; w : WORD; d : DATE; b : BOOL; END_VAR\n"
    operands = "ld c\neq colour#GREEN\nst b\nld w.2\nst b\nld d\neq d#2020-1-2\nst b\nEND_PROGRAM\n"
    written, _ = formatted(Source("x.st", declared + operands))
    assert [line.split()[1] for line in written.splitlines()[-9:-1]] == [
        "c", "Colour#Green", "b", "w.2", "b", "d", "D#2020-1-2", "b"]


def test_an_instruction_list_stands_in_columns() -> None:
    loose = WRITTEN_LIST.replace("LD      Go  ", "ld GO ").replace(" := ", ":=")
    loose = loose.replace("over:\n        CAL     t(", "over :  cal t (").replace("        // both", "\n\n // both")
    loose = loose.replace("ADD     (", "add(").replace("            MUL", "mul")
    assert formatted(Source("x.st", loose)) == (WRITTEN_LIST, [])
    assert formatted(Source("x.st", WRITTEN_LIST)) == (WRITTEN_LIST, [])


def test_a_comment_of_several_lines_in_a_list_keeps_its_shape() -> None:
    loose = "PROGRAM Main\nVAR a : BOOL; END_VAR\n  LD a\n      (* of two\n         lines,\n   or three *)\n  ST a\nEND_PROGRAM\n"
    written, _ = formatted(Source("x.st", loose))
    assert written.splitlines()[4:-1] == [
        "    LD      a", "    (* of two", "       lines,", "    or three *)", "    ST      a"]
    assert formatted(Source("x.st", written)) == (written, [])


def test_an_instruction_list_with_a_mistake_stays_as_it_is() -> None:
    text = "PROGRAM Main\nVAR a, b : BOOL; END_VAR\n  LD a\n  AND b + 1\n  ST a\nEND_PROGRAM\n"
    written, wrong = formatted(Source("x.st", text))
    assert written == text and [d.code for d in wrong] == ["S0114"]


def test_labels_stay_as_they_are_written() -> None:
    body = "    IF n > 0 THEN\n        JMP Next;\n    END_IF;\n    n := 1;\n    next: n := 2;\n"
    text = f"PROGRAM Main\nVAR\n    n : INT;\nEND_VAR\n{body}END_PROGRAM\n"
    written, wrong = formatted(Source("x.st", text))
    assert wrong == [] and "JMP Next;" in written and "$" not in written


def test_a_text_with_a_warning_is_formatted() -> None:
    text = "{attribute 'pack_mode' := '3'}\nTYPE S : STRUCT a : byte; END_STRUCT END_TYPE\n"
    written, wrong = formatted(Source("a.st", text))
    assert wrong == [] and "    a : BYTE;\n" in written


def test_a_pragma_without_end_in_what_reads_as_an_instruction_list_is_left_as_it_is() -> None:
    """The parser tells of the list alone, and its tokens end where the pragma begins."""
    declared = "VAR_INPUT\n    R   BOOL;\nEND_VAR\nVAR\n    b { efore : BOOL;\nEND_VAR\n"
    text = f"FUNCTION_BLOCK A\n{declared}    b := R;\nEND_FUNCTION_BLOCK\n"
    same, wrong = formatted(Source("a.st", text))
    assert same == text and wrong


def test_names_are_spelled_as_declared_also_those_of_libraries_and_of_enumerations_in_a_variable() -> None:
    loose = "PROGRAM p VAR t : ton; c : (Red, Green); END_VAR t(); c := RED; END_PROGRAM"
    text, wrong = formatted(Source("a.st", loose), OUTSIDE)
    assert wrong == [] and "    t : TON;\n" in text and "    c := Red;\n" in text


def test_all_comments_in_front_of_a_semicolon_are_kept() -> None:
    assert body("x := 1 // one\n// two\n// three\n; // four\ny := 2;") == (
        "x := 1;  // one\n// two\n// three\n// four\ny := 2;\n")
