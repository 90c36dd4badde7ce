"""What is said of blocks, classes and interfaces that extend, implement and override, word for word."""

from __future__ import annotations

from rows import each_of

from fbvm.code.compiler.driver import compile_text

Said = list[tuple[str, int, str, str]]
ALIKE = "an override has the same parameters, in the same order, and the same result"
WIDELY = "what overrides may be seen as widely as what it overrides"
ITSELF = "a base is declared without what is derived from it"
HEADS = """\
CLASS C END_CLASS FUNCTION_BLOCK B END_FUNCTION_BLOCK INTERFACE I END_INTERFACE FUNCTION Fu : INT Fu := 1; END_FUNCTION
PROGRAM Main END_PROGRAM
"""


def said(text: str) -> Said:
    return [(each.code, each.line, each.message, each.hint) for each in compile_text(text, dialect="codesys").errors]


@each_of("head, message, hint", [
    ("FUNCTION_BLOCK G EXTENDS C IMPLEMENTS I END_FUNCTION_BLOCK", "", ""), ("CLASS D EXTENDS C IMPLEMENTS I END_CLASS", "", ""),
    ("INTERFACE J EXTENDS I, __SYSTEM.IQueryInterface END_INTERFACE", "", ""),
    ("FUNCTION_BLOCK G EXTENDS I END_FUNCTION_BLOCK", "I is an INTERFACE", "IMPLEMENTS names interfaces"),
    ("CLASS D EXTENDS I END_CLASS", "I is an INTERFACE", "IMPLEMENTS names interfaces"),
    ("FUNCTION_BLOCK G EXTENDS Fu END_FUNCTION_BLOCK", "Fu is a FUNCTION", ""),
    ("FUNCTION_BLOCK G IMPLEMENTS Fu END_FUNCTION_BLOCK", "Fu is a FUNCTION", ""),
    ("FUNCTION_BLOCK G IMPLEMENTS C END_FUNCTION_BLOCK", "C is a CLASS", "EXTENDS names blocks"),
    ("FUNCTION_BLOCK G IMPLEMENTS B END_FUNCTION_BLOCK", "B is a FUNCTION_BLOCK", "EXTENDS names blocks"),
    ("CLASS D EXTENDS B END_CLASS", "B is a FUNCTION_BLOCK", "a class extends classes only"),
    ("INTERFACE J EXTENDS B END_INTERFACE", "B is a FUNCTION_BLOCK", "an interface extends interfaces only"),
    ("INTERFACE J EXTENDS C END_INTERFACE", "C is a CLASS", "an interface extends interfaces only"),
    ("INTERFACE J IMPLEMENTS I END_INTERFACE", "an INTERFACE implements nothing", "an interface EXTENDS others"),
    ("FUNCTION F : INT IMPLEMENTS I F := 1; END_FUNCTION", "a FUNCTION extends and implements nothing", ""),
    ("FUNCTION_BLOCK G EXTENDS Nix END_FUNCTION_BLOCK", "there is no FUNCTION_BLOCK or CLASS Nix", ""),
    ("CLASS D EXTENDS Nix END_CLASS", "there is no CLASS Nix", ""),
    ("INTERFACE J EXTENDS Nix END_INTERFACE", "there is no INTERFACE Nix", ""),
    ("INTERFACE Joint EXTENDS Joints END_INTERFACE", "there is no INTERFACE Joints", ""),
    ("INTERFACE J EXTENDS J END_INTERFACE", "J extends itself", ITSELF),
    ("FUNCTION_BLOCK Motor END_FUNCTION_BLOCK FUNCTION_BLOCK Motor2 EXTENDS Motr END_FUNCTION_BLOCK",
     "there is no FUNCTION_BLOCK or CLASS Motr", "did you mean Motor?"),
    ("INTERFACE Motor END_INTERFACE FUNCTION_BLOCK Motor2 IMPLEMENTS Motr END_FUNCTION_BLOCK", "there is no INTERFACE Motr",
     "did you mean Motor?"),
    ("FUNCTION_BLOCK X EXTENDS Y END_FUNCTION_BLOCK FUNCTION_BLOCK Y EXTENDS Z END_FUNCTION_BLOCK\n"
     "FUNCTION_BLOCK Z EXTENDS X END_FUNCTION_BLOCK", "X extends or holds Z", ITSELF),
])  # fmt: skip
def test_a_head_says_what_it_may_name(head: str, message: str, hint: str) -> None:
    line = 4 if "\n" in head else 3
    assert said(HEADS + head) == ([("S1001", line, message, hint)] if message else [])


@each_of("use, code, message, hint", [
    ("x := I;", "S0201", "I is an INTERFACE and has no value",
     "declare a variable of it, and assign an instance that implements it"),
    ("x := B;", "S0201", "B is a FUNCTION_BLOCK and has no value",
     "declare an instance, such as  my_B : B;  and name an output of it"),
    ("I();", "S0401", "I is an INTERFACE: what is called is an instance of it", "declare one, such as  my_i : I;"),
])
def test_the_name_of_an_interface_or_a_block_is_no_value(use: str, code: str, message: str, hint: str) -> None:
    assert said(f"{HEADS}FUNCTION F : INT VAR x : INT; END_VAR {use} END_FUNCTION") == [(code, 3, message, hint)]


def block(name: str, *methods: str, head: str = "FUNCTION_BLOCK") -> str:
    """A block, each method on a line of its own behind its head; a method's body is empty."""
    lines = "".join(f"METHOD {each} END_METHOD\n" for each in methods)
    return f"{head} {name}\n{lines}END_{head.split()[0]}\n"


@each_of("base, derived, difference", [
    ("M : INT", "M : INT", ""), ("M : INT", "M", "its result is none here and INT there"),
    ("M", "M : INT", "its result is INT here and none there"), ("M : INT", "M : REAL", "its result is REAL here and INT there"),
    ("M VAR_INPUT a : INT; END_VAR", "m VAR_INPUT A : INT; END_VAR", ""),
    ("M VAR_INPUT a : INT; END_VAR VAR x : INT; END_VAR", "M VAR y : REAL; END_VAR VAR_INPUT a : INT; END_VAR", ""),
    ("M VAR_INPUT a : INT; END_VAR", "M VAR_INPUT a, b, c : INT; END_VAR", "b stands here only"),
    ("M VAR_INPUT a, b : INT; END_VAR", "M", "a stands there only"),
    ("M VAR_INPUT a, b : INT; END_VAR", "M VAR_INPUT a : INT; END_VAR", "b stands there only"),
    ("M VAR_INPUT a, b : INT; END_VAR", "M VAR_INPUT b, a : INT; END_VAR", "VAR_INPUT b stands here for VAR_INPUT a"),
    ("M VAR_INPUT a : INT; END_VAR", "M VAR_IN_OUT a : INT; END_VAR", "VAR_IN_OUT a stands here for VAR_INPUT a"),
    ("M VAR_INPUT a : INT; END_VAR", "M VAR_OUTPUT a : INT; END_VAR", "VAR_OUTPUT a stands here for VAR_INPUT a"),
    ("M VAR_INPUT a : INT; END_VAR", "M VAR_INPUT a : REAL; END_VAR", "a is REAL here and INT there"),
    ("PRIVATE M", "M : INT", ""),
    ("FB_EXIT : BOOL VAR_INPUT a : BOOL; END_VAR", "FB_EXIT : BOOL VAR_INPUT b : BOOL; END_VAR", ""),
])  # fmt: skip
def test_an_override_has_the_parameters_and_the_result_of_what_it_overrides(base: str, derived: str, difference: str) -> None:
    name = derived[0]
    message = f"the method {name} of D differs from the one of B: {difference}"
    assert said(block("B", base) + block("D EXTENDS B", derived)) == ([("S1004", 5, message, ALIKE)] if difference else [])


def test_a_declaration_with_an_error_is_compared_with_nothing() -> None:
    text = block("B", "M VAR_INPUT a : Nix; END_VAR", "N") + block("D EXTENDS B", "M", "N VAR_INPUT a : Nux; END_VAR")
    assert [each[:3] for each in said(text)] == [("S0204", 2, "there is no type or block Nix"),
                                                 ("S0204", 7, "there is no type or block Nux")]  # fmt: skip


@each_of("base, derived, seen", [
    ("PRIVATE", "PUBLIC", ""), ("PROTECTED", "INTERNAL", ""), ("INTERNAL", "PROTECTED", ""), ("PROTECTED", "PUBLIC", ""),
    ("PUBLIC", "", ""), ("", "PUBLIC", ""), ("PROTECTED", "PRIVATE", "PRIVATE here and PROTECTED"),
    ("INTERNAL", "PRIVATE", "PRIVATE here and INTERNAL"), ("PUBLIC", "INTERNAL", "INTERNAL here and PUBLIC"),
    ("PUBLIC", "PROTECTED", "PROTECTED here and PUBLIC"), ("", "PROTECTED", "PROTECTED here and PUBLIC"),
    ("", "PRIVATE", "PRIVATE here and PUBLIC"),
])
def test_an_override_is_seen_as_widely_as_what_it_overrides(base: str, derived: str, seen: str) -> None:
    text = block("B", f"{base} M") + block("D EXTENDS B", f"{derived} M")
    assert said(text) == ([("S1006", 5, f"the method M is {seen} in B", WIDELY)] if seen else [])


def test_a_method_that_contradicts_its_base_is_shown_beside_it() -> None:
    text = block("B", "FINAL F", "M", "N") + block("D EXTENDS B", "F", "M : INT", "PRIVATE N")
    errors = compile_text(text, dialect="codesys").errors
    assert [(each.code, each.line, each.message, each.hint) for each in errors] == [
        ("S1002", 7, "the method F is FINAL in B and cannot be overridden", ""),
        ("S1004", 8, "the method M of D differs from the one of B: its result is INT here and none there", ALIKE),
        ("S1006", 9, "the method N is PRIVATE here and PUBLIC in B", WIDELY),
    ]
    shown = [(source.place(at)[0], words) for source, at, words in filter(None, (each.related for each in errors))]
    assert shown == [(2, "declared here"), (3, "declared here"), (4, "declared here")]


@each_of("text, expected", [
    (block("B", "M") + block("D EXTENDS B", "OVERRIDE M"), []),
    (block("B", "OVERRIDE M"), [("S1003", 2, "the method M overrides nothing", "leave OVERRIDE out, or name what it overrides")]),
    (block("I", "M", head="INTERFACE") + block("B IMPLEMENTS I", "OVERRIDE M"), []),
    (block("B EXTENDS Nix", "OVERRIDE M"), [("S1001", 1, "there is no FUNCTION_BLOCK or CLASS Nix", "")]),
    (block("B", "ABSTRACT M"), [("S1007", 2, "the method M is ABSTRACT, and B is not", "write FUNCTION_BLOCK ABSTRACT B")]),
    (block("B", "ABSTRACT M", head="CLASS"), [("S1007", 2, "the method M is ABSTRACT, and B is not", "write CLASS ABSTRACT B")]),
    (block("I", "ABSTRACT M", head="INTERFACE"), []),
])
def test_override_and_abstract_fit_the_block(text: str, expected: Said) -> None:
    assert said(text) == expected


I = block("I", "M : BOOL VAR_INPUT a : INT; END_VAR", "N", head="INTERFACE")  # noqa: E741
LACKS = block("B", "M : BOOL", "PROTECTED N")
M = "M : BOOL VAR_INPUT a : INT; END_VAR"


@each_of("text, expected", [
    (LACKS + block("D EXTENDS B IMPLEMENTS I"),
     [("S1004", 6, "the method M of B differs from the one of I: a stands there only", ALIKE),
      ("S1006", 7, "the method N is PROTECTED here and PUBLIC in I", WIDELY)]),
    (LACKS + block("D EXTENDS B IMPLEMENTS I", "M : BOOL", "N"),
     [("S1004", 10, "the method M of D differs from the one of I: a stands there only", ALIKE)]),
    (block("B", M) + block("D EXTENDS B IMPLEMENTS I", "N"), []),
    (block("B IMPLEMENTS I", M),
     [("S1003", 5, "B lacks method N of I", "write METHOD N, or make it FUNCTION_BLOCK ABSTRACT B")]),
    (block("B IMPLEMENTS I", "N", head="CLASS"),
     [("S1003", 5, "B lacks method M of I", "write METHOD M : BOOL, or make it CLASS ABSTRACT B")]),
    (block("B IMPLEMENTS I", M, head="FUNCTION_BLOCK ABSTRACT") + block("D EXTENDS B"),
     [("S1003", 8, "D lacks method N of I", "write METHOD N, or make it FUNCTION_BLOCK ABSTRACT D")]),
    (block("B IMPLEMENTS I", M, head="FUNCTION_BLOCK ABSTRACT") + block("D EXTENDS B", "N") + block("E EXTENDS D"), []),
    (block("J EXTENDS I", "O", head="INTERFACE") + block("B IMPLEMENTS J", M),
     [("S1003", 8, "B lacks method N of I, method O of J", "write METHOD N, or make it FUNCTION_BLOCK ABSTRACT B")]),
    (block("B EXTENDS Nix IMPLEMENTS I"), [("S1001", 5, "there is no FUNCTION_BLOCK or CLASS Nix", "")]),
])
def test_a_block_has_the_methods_of_its_interfaces(text: str, expected: Said) -> None:
    assert said(I + text) == expected


ABSTRACT = """\
FUNCTION_BLOCK ABSTRACT B
METHOD ABSTRACT M : ARRAY [0..2] OF INT END_METHOD
PROPERTY ABSTRACT P : INT GET END_GET SET END_SET END_PROPERTY
END_FUNCTION_BLOCK
TYPE S : STRUCT n : INT; b : ARRAY [0..1] OF B; END_STRUCT END_TYPE
"""
OF_P = "Get of the property P of B, Set of the property P of B"
NO_INSTANCES = ("S1007", 6, "B is ABSTRACT and has no instances",
                "declare one of a block that extends it and has the method M, Get of the property P, Set of the property P")


@each_of("text, expected", [
    (block("D EXTENDS B"), [("S1003", 6, f"D lacks method M of B, {OF_P}",
                             "write METHOD M : ARRAY [0..2] OF INT, or make it FUNCTION_BLOCK ABSTRACT D")]),
    (block("D EXTENDS B", "M : ARRAY [0..2] OF INT"),
     [("S1003", 6, f"D lacks {OF_P}", "write PROPERTY P with GET, or make it FUNCTION_BLOCK ABSTRACT D")]),
    (block("D EXTENDS B", head="FUNCTION_BLOCK ABSTRACT"), []),
    ("PROGRAM Main VAR b : B; END_VAR END_PROGRAM", [NO_INSTANCES]),
    ("PROGRAM Main VAR b : ARRAY [0..1] OF ARRAY [0..1] OF B; END_VAR END_PROGRAM", [NO_INSTANCES]),
    ("PROGRAM Main VAR s : S; END_VAR END_PROGRAM", [NO_INSTANCES]),
    ("PROGRAM Main VAR s : ARRAY [0..1] OF S; END_VAR END_PROGRAM", [NO_INSTANCES]),
    ("FUNCTION_BLOCK E VAR_INPUT b : B; END_VAR END_FUNCTION_BLOCK", [NO_INSTANCES]),
    ("FUNCTION F : INT VAR b : B; END_VAR F := 1; END_FUNCTION", [NO_INSTANCES]),
    ("FUNCTION F : B END_FUNCTION", [NO_INSTANCES]),
    ("FUNCTION_BLOCK E METHOD M : S END_METHOD END_FUNCTION_BLOCK", [NO_INSTANCES]),
    ("FUNCTION F : INT VAR_INPUT b : B; END_VAR F := 1; END_FUNCTION", []),
    ("VAR_GLOBAL b : B; END_VAR", [NO_INSTANCES]), ("VAR_GLOBAL s : S; END_VAR", [NO_INSTANCES]),
    ("FUNCTION F : INT VAR_IN_OUT b : B; END_VAR F := 1; END_FUNCTION", []),
    ("FUNCTION F : INT VAR_INPUT b : POINTER TO B; r : REFERENCE TO B; END_VAR F := 1; END_FUNCTION", []),
    ("FUNCTION_BLOCK ABSTRACT E END_FUNCTION_BLOCK PROGRAM Main VAR e : E; END_VAR END_PROGRAM",
     [("S1007", 6, "E is ABSTRACT and has no instances", "declare one of a block that extends it")]),
])
def test_a_block_that_is_abstract_has_no_instances(text: str, expected: Said) -> None:
    assert said(ABSTRACT + text) == expected
