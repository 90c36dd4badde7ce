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
    "n := REAL_TO_INT(2.5);": {"CRO n := REAL_TO_INT(0.0);", "SDL ;;"},
    "n := REAL_TO_INT(REAL#0.0);": {"CRO n := REAL_TO_INT(REAL#1.0);", "SDL ;;"},
    "t := T#5ms;": {"CRO t := T#15ms;", "SDL ;;"}, "t := TIME#10ms;": {"CRO t := TIME#20ms;", "CRO t := TIME#0ms;", "SDL ;;"},
    "t := T#5us;": {"SDL ;;"}, "a R= b;": {"SRO a S= b;", "SDL ;;"}, "a := BOOL#FALSE;": {"CRO a := BOOL#TRUE;", "SDL ;;"},
    "n := -n;": {"SDL ;;"}, "a := NOT b;": {"NIO a := (b);", "SDL ;;"},
    "WHILE a DO EXIT; END_WHILE": {"NIO WHILE NOT (a) DO EXIT; END_WHILE", "SDL WHILE a DO ;; END_WHILE"},
    "REPEAT CONTINUE; UNTIL a END_REPEAT": {"NIO REPEAT CONTINUE; UNTIL NOT (a) END_REPEAT", "SDL REPEAT ;; UNTIL a END_REPEAT"},
    "IF a THEN RETURN; ELSIF b THEN ; ELSE n := 0; END_IF": {
        "NIO IF NOT (a) THEN RETURN; ELSIF b THEN ; ELSE n := 0; END_IF",
        "NIO IF a THEN RETURN; ELSIF NOT (b) THEN ; ELSE n := 0; END_IF",
        "SDL IF a THEN ;; ELSIF b THEN ; ELSE n := 0; END_IF", "SDL IF a THEN RETURN; ELSIF b THEN ; ELSE ;; END_IF",
        "CRO IF a THEN RETURN; ELSIF b THEN ; ELSE n := 1; END_IF"},
    "IF a THEN ; END_IF": {"NIO IF NOT (a) THEN ; END_IF"},
    "IF a THEN JMP x; END_IF; b := c; x: n := 0;": {
        "NIO IF NOT (a) THEN JMP x; END_IF; b := c; x: n := 0;", "SDL IF a THEN ;; END_IF; b := c; x: n := 0;",
        "SDL IF a THEN JMP x; END_IF; ;; x: n := 0;", "SDL IF a THEN JMP x; END_IF; b := c; x: ;;",
        "CRO IF a THEN JMP x; END_IF; b := c; x: n := 1;"},
    "x: a := b; IF c THEN JMP x; END_IF": {
        "SDL x: ;; IF c THEN JMP x; END_IF", "NIO x: a := b; IF NOT (c) THEN JMP x; END_IF", "SDL x: a := b; IF c THEN ;; END_IF",
        "SDL x: a := b; ;"},
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


def of_rows(rows: str, head: str = HEAD) -> set[str]:
    """The mutants of a LADDER with these rows, each as its operator and the rows that have changed, but for those that leave out
    a rung."""
    before = f"LADDER\n{rows}\nEND_LADDER".split("\n")
    found = [each.partition(" ")[::2] for each in lines("\n".join(before), head, "RDL")]
    return {"\n".join([operator, *(row for row, old in zip(body.split("\n"), before, strict=True) if row != old)])
            for operator, body in found}  # fmt: skip


INSTRUCTIONS = {
    "LD a\nANDNOT c\nOUT b": {"CONTACT\nLDNOT a", "VRO\nLD b", "CONTACT\nAND c", "LRO\nORNOT c", "VRO\nANDNOT a",
                             "COIL\nOUTNOT b", "VRO\nOUT c"},
    "@LD a": {"CONTACT\n@LDNOT a", "VRO\n@LD b", "EDGE\nLD a"},
    "LD NOT 0.01\nOUT 0.02": {"CONTACT\nLD 0.01", "VRO\nLD NOT 0.02", "COIL\nOUTNOT 0.02", "VRO\nOUT 0.01"},
    "LD> D0 &9": {"ROR\nLD>= D0 &9", "ROR\nLD<= D0 &9", "CRO\nLD> D0 &8", "CRO\nLD> D0 &10"},
    "AND<=L D0 D2": {"ROR\nAND<L D0 D2", "ROR\nAND>L D0 D2", "LRO\nOR<=L D0 D2", "VRO\nAND<=L D2 D2", "VRO\nAND<=L D0 D0"},
    "@SET a": {"COIL\n@OUT a", "VRO\n@SET b", "EDGE\nSET a"},
    "FBCALL TON x IN:=TRUE PT:=T#1s": {
        "CRO\nFBCALL TON x IN:=FALSE PT:=T#1s", "CRO\nFBCALL TON x IN:=TRUE PT:=T#1010ms",
        "CRO\nFBCALL TON x IN:=TRUE PT:=T#990ms",
        "TRO\nFBCALL TOF x IN:=TRUE PT:=T#1s", "TRO\nFBCALL TP x IN:=TRUE PT:=T#1s"},
    "FBCALL TON x IN:=* PT:=T#10ms": {"CRO\nFBCALL TON x IN:=* PT:=T#20ms", "CRO\nFBCALL TON x IN:=* PT:=T#0ms",
                                      "TRO\nFBCALL TOF x IN:=* PT:=T#10ms", "TRO\nFBCALL TP x IN:=* PT:=T#10ms"},
    "FBCALL TON x IN:=* PT:=T#9ms": {"CRO\nFBCALL TON x IN:=* PT:=T#19ms",
                                     "TRO\nFBCALL TOF x IN:=* PT:=T#9ms", "TRO\nFBCALL TP x IN:=* PT:=T#9ms"},
    "MOV &1 D0": {"CRO\nMOV &2 D0", "CRO\nMOV &0 D0"},
    "MOV &0 D0": {"CRO\nMOV &1 D0"}, "MOV #9 D0": {"CRO\nMOV #8 D0"}, "MOV #0F D0": {"CRO\nMOV #10 D0", "CRO\nMOV #0E D0"},
    "TIM 0001 #0010": {"CRO\nTIM 0001 #0011", "CRO\nTIM 0001 #0009"},
    "@+(400) D0 #000F D0": {"ARO\n@- D0 #000F D0", "EDGE\n+(400) D0 #000F D0", "CRO\n@+(400) D0 #0010 D0",
                            "CRO\n@+(400) D0 #000E D0"},
    "FBCALL TON x IN:=* PT:=T#1s": {"CRO\nFBCALL TON x IN:=* PT:=T#1010ms", "CRO\nFBCALL TON x IN:=* PT:=T#990ms",
                                    "TRO\nFBCALL TOF x IN:=* PT:=T#1s", "TRO\nFBCALL TP x IN:=* PT:=T#1s"},
}  # fmt: skip


@each_of("rows", INSTRUCTIONS)
def test_an_instruction_of_a_rung_has_these_mutants(rows: str) -> None:
    assert of_rows(rows) == INSTRUCTIONS[rows]


def test_a_rung_is_left_out_and_of_several_outputs_one() -> None:
    found = lines("LADDER\nRUNG 1\nLD a\nOUT b\nOUT c\nRUNG 2 x\nLD b\nOUT a\nEND_LADDER")
    assert {each for each in found if each[1:3] == "DL"} == {
        "RDL LADDER\nRUNG 2 x\nLD b\nOUT a\nEND_LADDER", "RDL LADDER\nRUNG 1\nLD a\nOUT b\nOUT c\nEND_LADDER",
        "SDL LADDER\nRUNG 1\nLD a\n\nOUT c\nRUNG 2 x\nLD b\nOUT a\nEND_LADDER",
        "SDL LADDER\nRUNG 1\nLD a\nOUT b\n\nRUNG 2 x\nLD b\nOUT a\nEND_LADDER"}  # fmt: skip


def test_what_a_subroutine_of_rungs_is_lowered_to_has_no_mutants() -> None:
    assert of_rows("LD a\nSBS 0\nSBN 0\nLD b\n++ D0\nRET") == {
        "CONTACT\nLDNOT a", "VRO\nLD b", "CONTACT\nLDNOT b", "VRO\nLD c", "ARO\n-- D0"}  # fmt: skip


NAMES = "PROGRAM Main\nVAR Go, Valve, Stop : BOOL; n, Full : INT; END_VAR\n"
DRAWINGS = {
    """
│ Go          n &9  Stop │
├─┤/├──┬──────┤>├───( )──┤
│ Valve│                 │
├─┤P├──┘                 │""": {
        "CONTACT\n├─┤ ├──┬──────┤>├───( )──┤", "CONTACT\n├─┤N├──┘                 │", "EDGE\n├─┤ ├──┘                 │",
        "COIL\n├─┤/├──┬──────┤>├───(/)──┤", "ROR\n├─┤/├──┬──────┤>=├──( )──┤", "ROR\n├─┤/├──┬──────┤<=├──( )──┤",
        "VRO\n│ Valve       n &9  Stop │", "VRO\n│ Go       Full &9  Stop │", "VRO\n│ Go          n &9  Go   │",
        "VRO\n│ Stop │                 │", "CRO\n│ Go          n &8  Stop │", "CRO\n│ Go          n &10 Stop │"},
    """
| Go       Stop    Valve |
|-| |--+---|/|------(S)--|
| Stop |                 |
|-|P|--+                 |""": {
        "CONTACT\n|-|/|--+---|/|------(S)--|", "CONTACT\n|-| |--+---| |------(S)--|", "COIL\n|-| |--+---|/|------( )--|",
        "CONTACT\n|-|N|--+                 |", "EDGE\n|-| |--+                 |", "VRO\n| Valve    Stop    Valve |",
        "VRO\n| Go       Go      Valve |", "VRO\n| Go       Stop    Stop  |", "VRO\n| Go   |                 |"},
    """
|--[ Go ]--[/Stop]---( Valve )--|""": {
        "CONTACT\n|--[/Go ]--[/Stop]---( Valve )--|", "CONTACT\n|--[ Go ]--[ Stop ]--( Valve )--|",
        "COIL\n|--[ Go ]--[/Stop]---(/Valve )--|", "VRO\n|--[ Go ]--[/Go]-----( Valve )--|",
        "VRO\n|--[ Go ]--[/Stop]---( Stop )---|"},
    """
|--[P Go ]----[ Stop ]---(R Valve )--|""": {
        "CONTACT\n|--[N Go ]----[ Stop ]---(R Valve )--|", "EDGE\n|--[ Go ]-----[ Stop ]---(R Valve )--|",
        "CONTACT\n|--[P Go ]----[/Stop ]---(R Valve )--|", "COIL\n|--[P Go ]----[ Stop ]---(S Valve )--|",
        "VRO\n|--[P Valve ]-[ Stop ]---(R Valve )--|", "VRO\n|--[P Go ]----[ Go ]-----(R Valve )--|",
        "VRO\n|--[P Go ]----[ Stop ]---(R Stop )---|"},
    """
│ Go          ┌──────────┐ │
├──┤ ├────────┤ @MOV     │ │
│             │ &10      │ │
│             │ n        │ │
│             └──────────┘ │""": {
        "CONTACT\n├──┤/├────────┤ @MOV     │ │", "EDGE\n├──┤ ├────────┤ MOV      │ │", "VRO\n│ Valve       ┌──────────┐ │",
        "CRO\n│             │ &11      │ │", "CRO\n│             │ &9       │ │", "VRO\n│             │ Full     │ │"},
}  # fmt: skip


@each_of("rows", DRAWINGS)
def test_a_drawn_rung_keeps_its_columns(rows: str) -> None:
    assert of_rows(rows.strip("\n"), NAMES) == DRAWINGS[rows]


CALL = """
│ Go             ┌─ Late : TON ─┐    Valve │
├──┤ ├───────────┤IN           Q├─────( )──┤
│        T#100ms─┤PT            │          │
│                └──────────────┘          │"""


def test_the_type_of_a_drawn_block_changes_with_its_declaration() -> None:
    found = of_rows(CALL.strip("\n"), NAMES.replace("n, Full", "Late, Wait : TON; n, Full"))
    assert {each for each in found if each[:3] in ("CRO", "VRO")} == {
        "CRO\n│        T#110ms─┤PT            │          │", "CRO\n│         T#90ms─┤PT            │          │",
        "VRO\n│ Go             ┌─ Wait : TON ─┐    Valve │", "VRO\n│ Valve          ┌─ Late : TON ─┐    Valve │",
        "VRO\n│ Go             ┌─ Late : TON ─┐    Stop  │"}  # fmt: skip
    text = f"{NAMES.replace('n, Full', 'Late : TON; n, Full')}LADDER{CALL}\nEND_LADDER\nEND_PROGRAM\n"
    types = [each.applied(text) for each in mutants_of([Source("main.st", text)]) if each.change.operator == "TRO"]
    assert types == [text.replace("TON ─", "TOF ─").replace("TON", "TOF"), text.replace("TON ─", "TP  ─").replace("TON", "TP")]


def test_a_diff_names_the_file_and_the_line() -> None:
    mutant = Mutant(1, "src/a.st", 2, Change("CRO", 7, 8, "1", "A"))
    assert mutant.diff("a := 0\nb:= 0;\n") == "--- src/a.st\n+++ src/a.st\n@@ -2 +2 @@\n-b:= 0;\n+1:= 0;"
