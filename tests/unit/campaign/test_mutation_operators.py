"""Which changes of a text are mutants, exactly where they stand."""

from __future__ import annotations

from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.campaign.mutation.mutants import Change, Mutant
from fbvm.campaign.mutation.session import mutants_of

HEAD = "PROGRAM Main\nVAR a, b, c : BOOL; n : INT; t : TIME; END_VAR\n"


def lines(body: str, head: str = HEAD, without: str = "VRO") -> set[str]:
    """The mutants of a body, each as `OPERATOR the body afterwards`, but for those of one operator."""
    text = f"{head}{body}\nEND_PROGRAM\n"
    found = [each for each in mutants_of([Source("main.st", text)]) if each.change.operator != without]
    return {f"{each.change.operator} {each.applied(text)[len(head):-len('END_PROGRAM') - 2]}" for each in found}


STATEMENTS = {
    "n := 0;": {"CRO n := 1;", "SDL ;;"},
    "n := INT#-1;": {"CRO n := INT#0;", "CRO n := INT#-2;", "SDL ;;"},
    "n := n + 1;": {"ARO n := n - 1;", "CRO n := n + 0;", "CRO n := n + 2;", "SDL ;;"},
    "a := b AND NOT c;": {"LRO a := b OR NOT c;", "NIO a := NOT b AND NOT c;", "NIO a := b AND (c);", "SDL ;;"},
    "a := n <= 3;": {"ROR a := n < 3;", "ROR a := n > 3;", "CRO a := n <= 2;", "CRO a := n <= 4;", "SDL ;;"},
    "a S= b;": {"SRO a R= b;", "SDL ;;"},
    "t := T#50ms;": {"CRO t := T#40ms;", "CRO t := T#60ms;", "SDL ;;"},
    "a := TRUE; b := a;": {"CRO a := FALSE; b := a;", "SDL ;; b := a;", "SDL a := TRUE; ;;", "SWAP b := a; a := TRUE;"},
    "IF a THEN ; END_IF": {"NIO IF NOT (a) THEN ; END_IF"},
}


@each_of("body", STATEMENTS)
def test_a_statement_has_these_mutants(body: str) -> None:
    assert lines(body) == STATEMENTS[body]


def test_a_variable_is_replaced_by_the_next_one_of_its_type() -> None:
    found = lines("a := b AND t > T#0s;", without="")
    assert {each for each in found if each.startswith("VRO")} == {"VRO b := b AND t > T#0s;", "VRO a := c AND t > T#0s;"}


CHART = """INITIAL_STEP One: a(N);{} END_STEP
TRANSITION FROM One TO Two := b; END_TRANSITION
STEP Two: c(L, T#1s); END_STEP
TRANSITION FROM Two TO One := n > 1; END_TRANSITION"""
BACK = "TRANSITION FROM Two TO One := n > 1; END_TRANSITION"


def test_a_chart_loses_transitions_and_actions_and_has_other_qualifiers_and_conditions() -> None:
    """What the chart is lowered to stands in no text, and has no mutants."""
    chart = CHART.format("")
    first, rest = "a(N);", "TRANSITION FROM One TO Two := b; END_TRANSITION"
    assert lines(chart) == {
        "TRD " + chart.replace(rest, ""), "TRD " + chart.replace(BACK, ""),
        "NIO " + chart.replace(":= b;", ":= NOT (b);"), "NIO " + chart.replace("n > 1", "NOT (n > 1)"),
        "ASD " + chart.replace(first, ""), "ASD " + chart.replace("c(L, T#1s);", ""),
        "QUAL " + chart.replace("(N)", "(S)"), "QUAL " + chart.replace("(N)", "(P)"), "QUAL " + chart.replace("(L,", "(D,"),
        "CRO " + chart.replace("T#1s", "T#1010ms"), "CRO " + chart.replace("T#1s", "T#990ms"),
        "CRO " + chart.replace("> 1", "> 2"), "CRO " + chart.replace("> 1", "> 0"),
        "ROR " + chart.replace("> 1", ">= 1"), "ROR " + chart.replace("> 1", "<= 1")}  # fmt: skip


LIST = """LD a
ANDN b
ST c
LD n
GT (
LD 3
ADD n
)
S c"""


def test_an_instruction_list_has_its_operators_changed_where_they_stand() -> None:
    def after(line: int, new: str) -> str:
        rows = LIST.split("\n")
        return "\n".join([*rows[:line], new, *rows[line + 1:]])

    left_out = {f"SDL {after(line, '')}" for line in (0, 1, 2, 3, 5, 6, 8)}
    changed = {"NIO": [(0, "LDN a"), (1, "AND b"), (2, "STN c"), (3, "LDN n"), (5, "LDN 3")], "LRO": [(1, "ORN b")],
               "ROR": [(4, "GE ("), (4, "LT (")], "ARO": [(6, "SUB n")], "SRO": [(8, "R c")],
               "CRO": [(5, "LD 2"), (5, "LD 4")]}  # fmt: skip
    assert lines(LIST) == left_out | {f"{name} {after(*row)}" for name, rows in changed.items() for row in rows}


BLOCKS = {"TON": {"TOF", "TP"}, "TOF": {"TON"}, "R_TRIG": {"F_TRIG"}, "RS": {"SR"}, "CTU": {"CTD"}}


@each_of("block", BLOCKS)
def test_a_standard_block_is_taken_for_its_relatives(block: str) -> None:
    text = f"PROGRAM Main\nVAR x : {block}; END_VAR\nEND_PROGRAM\n"
    assert {each.change.text for each in mutants_of([Source("main.st", text)])} == BLOCKS[block]


def test_rungs_in_mnemonics_have_contacts_coils_edges_and_themselves_changed() -> None:
    found = lines("LADDER\nRUNG 1\nLD a\nANDNOT b\n@SET c\nEND_LADDER")
    assert found == {
        "CONTACT LADDER\nRUNG 1\nLDNOT a\nANDNOT b\n@SET c\nEND_LADDER",
        "CONTACT LADDER\nRUNG 1\nLD a\nAND b\n@SET c\nEND_LADDER",
        "COIL LADDER\nRUNG 1\nLD a\nANDNOT b\n@OUT c\nEND_LADDER",
        "EDGE LADDER\nRUNG 1\nLD a\nANDNOT b\nSET c\nEND_LADDER",
        "RDL LADDER\nEND_LADDER",
    }  # fmt: skip


def test_drawn_rungs_keep_their_drawing() -> None:
    found = lines("LADDER\nRUNG 1\n│  a    b       c  │\n├──┤ ├──┤/├────( )─┤\nEND_LADDER")
    assert {each.split("\n")[3] for each in found if each.startswith("CO")} == {
        "├──┤/├──┤/├────( )─┤", "├──┤ ├──┤ ├────( )─┤", "├──┤ ├──┤/├────(/)─┤"}  # fmt: skip


def test_a_diff_names_the_file_and_the_line() -> None:
    mutant = Mutant(1, "src/a.st", 2, Change("CRO", 7, 8, "1", "A"))
    assert mutant.diff("a := 0\nb:= 0;\n") == "--- src/a.st\n+++ src/a.st\n@@ -2 +2 @@\n-b:= 0;\n+1:= 0;"
