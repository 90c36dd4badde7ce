"""Parts of what editors are told: paths and calls at a place, what a key means, which parts of a text stay."""

from __future__ import annotations

from functools import cache

from editing import at_mark
from rows import each_of

from fbvm.analysis import describe
from fbvm.analysis.calls import open_call
from fbvm.analysis.completion import complete
from fbvm.analysis.declarations import Declared, find
from fbvm.analysis.fixes import applied, fixes
from fbvm.analysis.hover import hover
from fbvm.analysis.outline import outline
from fbvm.analysis.parts import File
from fbvm.analysis.program import Program
from fbvm.analysis.scopes import Scope, scope_at
from fbvm.analysis.tokens import address_hints

TEXT = """\
FUNCTION_BLOCK Base
METHOD Turn : INT
VAR_INPUT n : INT; END_VAR
VAR_INST turns : INT; END_VAR
    Turn := turns;
END_METHOD
METHOD PRIVATE Hidden
END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK B EXTENDS Base
    ‸A();
END_FUNCTION_BLOCK
ACTION B.A: ; END_ACTION
FUNCTION F : INT
VAR_IN_OUT x : B; END_VAR
    F := x.Turn(1);
END_FUNCTION
PROGRAM Main
VAR
    b : B; a AT %MB4 : ARRAY[0..3] OF BYTE; d AT %MD8 : ARRAY[0..3] OF DINT; w AT %MW20 : ARRAY[1..3] OF INT;
    m AT %MW30 : ARRAY[0..1, 0..1] OF INT; i AT %MW40 : INT; k : ARRAY[0..3] OF INT;
END_VAR
    a[1] := 2; d[1] := 3; w[2] := 3; w[i] := 1; m[0, 1] := 2; k[1] := i; b();
END_PROGRAM
"""


@cache
def plant() -> tuple[Program, int]:
    return at_mark(TEXT, "codesys")


def scope() -> Scope:
    program, at = plant()
    found = scope_at(program, "pump.st", at)
    assert found is not None
    return found


# --- paths and calls ------------------------------------------------------------------------------------------------------


@each_of("path, name", [
    ("THIS.Turn", "Base.Turn"), ("SUPER.Turn", "Base.Turn"), ("THIS^.Turn", "Base.Turn"), (" Turn ", "Base.Turn"),
    ("THIS.Gone", None), ("Gone.Turn", None),
])  # fmt: skip
def test_a_path_to_a_method(path: str, name: str | None) -> None:
    found = scope().method(path)
    assert (found.name if found is not None else None) == name


@each_of("path, name, inputs", [
    ("CTUD", "CTUD", ["CU", "CD", "R", "LD", "PV"]), ("F", "F", []), ("THIS.Turn", "Base.Turn", ["n"]), ("Gone", None, []),
    ("a.b", None, []),
])  # fmt: skip
def test_what_is_called(path: str, name: str | None, inputs: list[str]) -> None:
    found = scope().callee(path)
    assert (found.name if found is not None else None) == name
    if found is not None:
        assert [each.name for each in found.order if each.kind == "VAR_INPUT" and " " not in each.name] == inputs


@each_of("before, text", [("PROGRAM Main\nVAR b : INT; END_VAR", "‸"), ("PROGRAM Main\nVAR b : INT; END_VAR", "b := 1; ‸"),
                          ("PROGRAM Main\nVAR b : ARRAY[0..1] OF INT; END_VAR", "b[‸"), ("‸", "")])  # fmt: skip
def test_where_no_call_is_open(before: str, text: str) -> None:
    program, at = at_mark(f"{before}{text}")
    assert open_call(program, "pump.st", at) is None


def test_in_a_function_the_public_methods_of_an_instance_are_offered() -> None:
    program, _ = plant()
    at = program.files["pump.st"].text.index("x.Turn(1)") + 2
    assert [item.label for item in complete(program, "pump.st", at)] == ["A", "Turn"]


# --- what a key means -----------------------------------------------------------------------------------------------------


@each_of("key, name", [
    (("variable", "", "GONE", "X"), None), (("variable", "", "BASE.TURN", "TURNS"), "turns"),
    (("variable", "", "BASE", "TURNS"), None), (("variable", "", "BASE.TURN", "N"), "n"),
    (("variable", "", "BASE.GONE", "N"), None), (("pou", "", "BASE"), "Base"),
])  # fmt: skip
def test_a_key_leads_to_its_declaration(key: tuple[str, ...], name: str | None) -> None:
    checked = plant()[0].checked
    assert checked is not None
    found = find(checked.checker, key)
    assert (found.name if found is not None else None) == name


def test_a_variable_of_a_method_that_its_instances_keep_is_shown_as_it_is_written() -> None:
    program, _ = plant()
    shown = hover(program, "pump.st", program.files["pump.st"].text.index("turns;"))
    assert shown is not None and "VAR_INST turns : INT" in shown.markdown


def test_a_variable_of_a_pou_that_is_not_checked_yet_is_its_name() -> None:
    block = scope().callee("CTUD")
    assert block is not None
    variable = Declared(("variable", "iec", "CTUD", "CV"), "CV", block.source, block.tree.name, pou=block)
    whole = Declared(("pou", "iec", "CTUD"), "CTUD", block.source, block.tree.name, pou=block)
    assert [describe.declaration(each) for each in (variable, whole)] == ["CV", describe.head(block)]


def test_actions_outside_of_their_block_are_in_the_outline() -> None:
    shown = [(symbol.name, symbol.kind, [child.name for child in symbol.children])
             for symbol in outline(plant()[0].files["pump.st"])]  # fmt: skip
    assert shown == [("Base", "FUNCTION_BLOCK", ["Turn", "Hidden"]), ("B", "FUNCTION_BLOCK", []), ("A", "ACTION", []),
                     ("F", "FUNCTION", ["x"]), ("Main", "PROGRAM", ["b", "a", "d", "w", "m", "i", "k"])]  # fmt: skip


def test_addresses_of_words_alone_are_shown_behind_names_and_elements() -> None:
    program, _ = plant()
    file = program.files["pump.st"]
    shown = [(file.text[:hint.at].split()[-1], hint.text) for hint in address_hints(program, file, 0, len(file.text))]
    assert shown == [("w[2]", "%MW21"), ("w[i", "%MW40"), ("i", "%MW40")]


def test_a_colon_behind_a_head_is_removed() -> None:
    program, _ = at_mark("PROGRAM Main:‸\nEND_PROGRAM\n")
    text = program.files["pump.st"].text
    [fix] = [each for each in fixes(program, "pump.st", 0, len(text)) if each.title.startswith("Remove")]
    assert (fix.title, applied(text, fix.edits)) == ("Remove :", "PROGRAM Main\nEND_PROGRAM\n")


# --- which parts stay -----------------------------------------------------------------------------------------------------

A, B, T = "FUNCTION A : INT END_FUNCTION\n", "PROGRAM B END_PROGRAM\n", "TYPE T : INT; END_TYPE\n"


@each_of("before, after, stay, pairs", [
    ([A, B], [A, T, B], [0, None, 1], [(None, T)]), ([A, T, B], [A, B], [0, 2], [(T, None)]),
    ([A, B], [T, B], [None, 1], [(A, T)]), ([A, B], [A, T], [0, None], [(B, T)]), ([A, T, B], [T, B], [1, 2], [(A, None)]),
    ([A, T], [A, T, B, T], [0, 1, None, None], [(None, B), (None, T)]), ([A, B], [B, A], [None, None], [(A, B), (B, A)]),
    ([B, A, T], [T, B, A, T], [None, 0, 1, 2], [(None, T)]),
])  # fmt: skip
def test_parts_with_the_same_text_stay(before: list[str], after: list[str], stay: list[int | None],
                                       pairs: list[tuple[str | None, str | None]]) -> None:  # fmt: skip
    file = File("a.st", "".join(before))
    old = list(file.parts)
    told = [tuple(part.source.text if part is not None else None for part in pair) for pair in file.replace("".join(after))]
    assert [part.source.text for part in file.parts] == after
    assert [old.index(part) if part in old else None for part in file.parts] == stay
    assert told == pairs
    assert [part.base for part in file.parts] == [len("".join(after[:at])) for at in range(len(after))]
