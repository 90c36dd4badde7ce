"""Sequential function charts of documents: what comes of them runs as the chart says."""

from __future__ import annotations

from itertools import groupby

import pytest
from drawings import RAIL, block, codes, contact, document, imported, plc, pou, states, value, variable, wires
from rows import each_of

from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.charts import STEP_ACTIONS, with_new_names
from fbvm.interchange.plcopen.read.importing import import_xml

CODESYS = "http://www.3s-software.com/plcopenxml/"


def step(number: int, name: str, sources: str = "", first: bool = False) -> str:
    into = wires(sources) if sources else ""
    return (f'<step localId="{number}" name="{name}" initialStep="{"true" if first else "false"}"><position x="0" y="0"/>{into}'
            '<connectionPointOut formalParameter=""/><connectionPointOutAction formalParameter=""/></step>')


def transition(number: int, sources: str, condition: str, marks: str = "", at: str = "0,0") -> str:
    x, y = at.split(",")
    return (f'<transition localId="{number}" {marks}><position x="{x}" y="{y}"/>{wires(sources)}<connectionPointOut/>'
            f"<condition>{condition}</condition></transition>")


def inline(text: str) -> str:
    return f'<inline name=""><ST><xhtml:p>{text}</xhtml:p></ST></inline>'


def node(kind: str, number: int, sources: str) -> str:
    return f'<{kind} localId="{number}"><position x="0" y="0"/>{wires(sources)}<connectionPointOut/></{kind}>'


def jump(number: int, sources: str, target: str) -> str:
    return f'<jumpStep localId="{number}" targetName="{target}"><position x="0" y="0"/>{wires(sources)}</jumpStep>'


def actions(number: int, source: str, *listed: str) -> str:
    inner = "".join(f'<action localId="0" {marks}><relPosition x="0" y="0"/>{what}</action>'
                    for what, _, marks in (text.partition("|") for text in listed))
    return f'<actionBlock localId="{number}"><position x="0" y="0"/>{wires(source)}{inner}</actionBlock>'


def does(name: str) -> str:
    return f'<reference name="{name}"/>'


def chart(*parts: str, declared: str, more: str = "") -> Imported:
    text = pou("".join(parts), declared, language="SFC")
    return imported(text.replace("</interface>", f"</interface>{more}"))


def test_steps_transitions_and_a_jump_back() -> None:
    made = chart(step(1, "idle", first=True), transition(2, "1", inline("go")), step(3, "busy", "2"), actions(4, "3", does("x")),
                 transition(5, "3", inline(":= done;")), jump(6, "5", "idle"), declared="go done x")
    assert made.errors == []
    assert states(made, "x", ["", "go=1", "go=0", "done=1", ""]) == ["0", "1", "1", "0", "0"]


@pytest.mark.slow
def test_a_selection_goes_by_priority_and_else_from_left_to_right() -> None:
    split = node("selectionDivergence", 2, "1")
    plain = chart(step(1, "s", first=True), split, transition(3, "2", inline("go"), at="90,0"), step(4, "right", "3"),
                  transition(5, "2", inline("go"), at="10,0"), step(6, "left", "5"), actions(7, "4", does("x")),
                  actions(8, "6", does("y")), declared="go x y")
    assert states(plain, "x y", ["", "go=1"]) == ["0 0", "0 1"]
    first = chart(step(1, "s", first=True), split, transition(3, "2", inline("go"), 'priority="1"', "90,0"),
                  step(4, "right", "3"), transition(5, "2", inline("go"), 'priority="2"', "10,0"), step(6, "left", "5"),
                  actions(7, "4", does("x")), actions(8, "6", does("y")), declared="go x y")
    assert states(first, "x y", ["", "go=1"]) == ["0 0", "1 0"]


@pytest.mark.slow
@pytest.mark.parametrize("at", ["x y,0", "nan,inf", ",1e999"])
def test_a_transition_at_no_place_counts_as_the_first(at: str) -> None:
    made = chart(step(1, "s", first=True), node("selectionDivergence", 2, "1"), transition(3, "2", inline("go"), at="90,0"),
                 step(4, "right", "3"), transition(5, "2", inline("go"), at=at), step(6, "left", "5"), actions(7, "4", does("x")),
                 actions(8, "6", does("y")), declared="go x y")
    assert states(made, "x y", ["", "go=1"]) == ["0 0", "0 1"]


def test_ways_side_by_side_begin_and_end_together() -> None:
    made = chart(step(1, "s", first=True), transition(2, "1", inline("go")), node("simultaneousDivergence", 3, "2"),
                 step(4, "a", "3"), step(5, "b", "3"), actions(6, "4", does("x")), actions(7, "5", does("y")),
                 node("simultaneousConvergence", 8, "4 5"), transition(9, "8", inline("done")), step(10, "e", "9"),
                 actions(11, "10", does("z")), declared="go done x y z")
    assert "TRANSITION FROM s TO (a, b) := go;" in " ".join(made.files["Main.st"].split())
    assert states(made, "x y z", ["", "go=1", "done=1", ""]) == ["0 0 0", "1 1 0", "0 0 1", "0 0 1"]


def test_a_jump_to_a_divergence_enters_the_steps_behind_it() -> None:
    both = node("simultaneousDivergence", 3, "2").replace("localId", 'name="Both" localId', 1)
    made = chart(step(1, "s", first=True), transition(2, "1", inline("go")), both, step(4, "a", "3"), step(5, "b", "3"),
                 node("simultaneousConvergence", 8, "4 5"), transition(9, "8", inline("go")), jump(10, "9", "both"),
                 declared="go")  # fmt: skip
    assert "TRANSITION FROM (a, b) TO (a, b) := go;" in " ".join(made.files["Main.st"].split())


def test_branches_of_a_selection_join_again() -> None:
    made = chart(step(1, "s", first=True), node("selectionDivergence", 2, "1"), transition(3, "2", inline("a")),
                 transition(4, "2", inline("b")), node("selectionConvergence", 5, "3 4"), step(6, "e", "5"),
                 actions(7, "6", does("x")), declared="a b x")
    assert states(made, "x", ["", "b=1"]) == ["0", "1"]


def test_conditions_that_are_drawn_with_contacts_and_blocks() -> None:
    drawn = f"{wires('11.Q')}"
    made = chart(step(1, "s", first=True), transition(2, "1", drawn), step(3, "e", "2"), actions(4, "3", does("x")),
                 value(9, "T#20ms"), RAIL.replace('localId="1"', 'localId="8"'), contact(10, "8", "go"),
                 block(11, "TON", "IN=10 PT=9", "Q,ET", "t"), declared=variable("go") + variable("x") + variable("t", "TON"))
    assert made.errors == []
    assert states(made, "x", ["", "go=1", "", "", ""]) == ["0", "0", "0", "0", "1"]


@pytest.mark.slow
@each_of("body", ["go AND NOT stop", ":= go AND NOT stop;", "leave := go AND NOT stop;",
                  "IF stop THEN leave := FALSE; ELSE leave := go; END_IF;"])
def test_a_transition_by_its_name(body: str) -> None:
    named = f'<transitions><transition name="leave"><body><ST><xhtml:p>{body}</xhtml:p></ST></body></transition></transitions>'
    made = chart(step(1, "s", first=True), transition(2, "1", does("leave")), step(3, "e", "2"), actions(4, "3", does("x")),
                 declared="go stop x", more=named)
    assert made.errors == []
    assert states(made, "x", ["go=1 stop=1", "stop=0"]) == ["0", "1"]


def test_actions_with_bodies_qualifiers_and_times() -> None:
    listed = '<actions><action name="count"><body><ST><xhtml:p>n := n + 1;</xhtml:p></ST></body></action></actions>'
    block_of = actions(4, "1", f"{does('count')}|qualifier=\"P1\"", f"{does('x')}|qualifier=\"D\" duration=\"T#20ms\"",
                       "<inline><ST><xhtml:p>m := m + 10;</xhtml:p></ST></inline>|qualifier=\"N\"")
    made = chart(step(1, "s", first=True), block_of, more=listed,
                 declared=variable("x") + variable("n", "INT") + variable("m", "INT"))
    assert made.errors == []
    assert states(made, "n m x", ["", "", "", ""]) == ["1 10 0", "1 20 0", "1 30 1", "1 40 1"]


@each_of(("part", "says"), [
    ('<macroStep localId="7" name="m"/>', "macro step"),
    (transition(7, "1", inline("TRUE")), "no step stands below"),
    (transition(7, "1", "") + jump(8, "7", "nowhere"), "no step nowhere"),
    (transition(7, "1", "") + jump(8, "7", "s"), "has no condition"),
    (transition(7, "1", inline("x")) + node("simultaneousDivergence", 8, "7") + step(9, "e", "8")
     + transition(10, "9", inline("x")) + jump(11, "10", ""), "there is no step  to jump to"),
    (actions(7, "1", f"{does('x')}|qualifier=\"DL\" duration=\"T#1s\""), "qualifier DL"),
])
def test_a_chart_that_cannot_be_taken_over_is_left_out_with_a_reason(part: str, says: str) -> None:
    made = chart(step(1, "s", first=True), part, declared="x")
    assert codes(made) == ["X0203"]
    assert says in made.errors[0].message
    assert "was not taken over" in made.files["Main.st"]


def test_a_chart_without_a_beginning_is_refused() -> None:
    made = chart(step(1, "s"), declared="x")
    assert [d.code for d in made.errors] == ["X0203"]
    assert "no initial step" in made.errors[0].message


def test_what_stands_beside_the_chart_is_named() -> None:
    made = chart(step(1, "s", first=True), value(5, "x"), declared="x")
    assert [d.code for d in made.errors] == ["X0203"]
    assert "belongs to no transition" in made.errors[0].message


def test_a_condition_in_an_instruction_list() -> None:
    text = '<inline name=""><IL><xhtml:p>LD go\nANDN done</xhtml:p></IL></inline>'
    negated = transition(5, "3", text.replace("LD go\nANDN", "LD")).replace("<condition>", '<condition negated="true">')
    made = chart(step(1, "idle", first=True), transition(2, "1", text), step(3, "busy", "2"), actions(4, "3", does("x")),
                 negated, jump(6, "5", "idle"), declared="go done x")
    assert made.errors == []
    assert states(made, "x", ["go=1 done=1", "done=0", "done=1"]) == ["0", "1", "1"]


def phases(made: Imported, name: str, scans: int) -> list[int]:
    """How many scans a BOOL variable stayed as it was, in each of its states; the last one is not over."""
    machine = plc(made)
    machine.cycle_ns = 20_000_000
    seen = []
    for _ in range(scans):
        machine.scan()
        seen.append(machine.read(f"Main.{name}"))
    return [len(list(group)) for _, group in groupby(seen)][:-1]


LIGHT = (step(1, "red", first=True), transition(2, "1", wires("11.Q")), step(3, "green", "2"), transition(4, "3", wires("12.Q")),
         jump(5, "4", "red"), actions(7, "3", does("x")), value(8, "red.X"), value(9, "T#100ms"), value(10, "green.X"),
         block(11, "TON", "IN=8 PT=9", "Q,ET", "t1"), block(12, "TON", "IN=10 PT=9", "Q,ET", "t2"))
TIMERS = variable("x") + variable("t1", "TON") + variable("t2", "TON")


def test_timers_that_are_wired_to_transitions_run_in_every_scan() -> None:
    made = chart(*LIGHT, declared=TIMERS)
    assert made.errors == []
    assert phases(made, "x", 60) == [6] * 9


def test_a_timer_in_the_diagram_of_a_named_transition_runs_in_every_scan() -> None:
    def body(number: int, name: str) -> str:
        drawn = value(1, f"{name}.X") + value(2, "T#100ms") + block(3, "TON", "IN=1 PT=2", "Q,ET", f"t{number}") \
            + f'<outVariable localId="4">{wires("3.Q")}<expression>after_{name}</expression></outVariable>'
        return f'<transition name="after_{name}"><body><FBD>{drawn}</FBD></body></transition>'

    made = chart(step(1, "red", first=True), transition(2, "1", does("after_red")), step(3, "green", "2"),
                 transition(4, "3", does("after_green")), jump(5, "4", "red"), actions(7, "3", does("x")), declared=TIMERS,
                 more=f"<transitions>{body(1, 'red')}{body(2, 'green')}</transitions>")
    assert made.errors == []
    assert phases(made, "x", 60) == [6] * 9


@each_of(("more", "lost"), [
    (contact(9, "3.Q", "y"), []), (value(9, "after"), []),
    (f'<outVariable localId="9">{wires("3.Q")}<expression>y</expression></outVariable>', ["y"]),
    (block(9, "TON", "IN=1 PT=2", "Q,ET", "u") + f'<coil localId="8">{wires("9.Q")}<variable>y</variable></coil>', ["TON", "y"])])
def test_what_the_diagram_of_a_named_transition_writes_beside_its_condition_is_named(more: str, lost: list[str]) -> None:
    drawn = value(1, "red.X") + value(2, "T#100ms") + block(3, "TON", "IN=1 PT=2", "Q,ET", "t") \
        + f'<outVariable localId="4">{wires("3.Q")}<expression>AFTER</expression></outVariable>' + more
    made = chart(step(1, "red", first=True), transition(2, "1", does("after")), step(3, "green", "2"),
                 declared="".join(variable(name, "TON") for name in "tu") + variable("y"),
                 more=f'<transitions><transition name="after"><body><FBD>{drawn}</FBD></body></transition></transitions>')
    assert [(found.code, found.message.partition(": ")[2]) for found in made.diagnostics] == [
        ("X0203", f"{name} does not belong to the condition of transition after, and is not taken over") for name in lost]
    assert "TRANSITION FROM red TO green := t.Q;" in made.files["Main.st"]


def test_a_function_in_front_of_a_transition_is_one_scan_late_as_beremiz_has_it() -> None:
    text = document(pou("".join((step(1, "s", first=True), transition(2, "1", wires("5")), step(3, "e", "2"),
                                 actions(4, "3", does("x")), value(6, "n"), value(7, "INT#1"),
                                 block(5, "GT", "IN1=6 IN2=7", "OUT"))),
                        variable("x") + variable("n", "INT"), language="SFC"))
    seen = ["", "n=2", "", ""]
    assert states(import_xml(text), "x", seen) == ["0", "1", "1", "1"]
    assert states(import_xml(text, order="document"), "x", seen) == ["0", "0", "1", "1"]


def acting(*inner: str, main: str, declared: str) -> Imported:
    """A chart that runs the chart of its action Sub."""
    named = f'<actions><action name="Sub"><body><SFC>{"".join(inner)}</SFC></body></action></actions>'
    return chart(main, declared=declared, more=named)


def test_a_variable_is_set_by_one_chart_and_reset_by_another() -> None:
    made = acting(step(1, "a", first=True), transition(2, "1", inline("back")), step(3, "b", "2"),
                  actions(4, "3", f"{does('x')}|qualifier=\"R\""), transition(5, "3", inline("NOT back")), jump(6, "5", "a"),
                  main=step(1, "idle", first=True) + actions(2, "1", does("Sub")) + transition(3, "1", inline("go"))
                  + step(4, "on", "3") + actions(5, "4", f"{does('x')}|qualifier=\"S\"", does("Sub"))
                  + transition(6, "4", inline("NOT go")) + jump(7, "6", "idle"), declared="go back x")
    assert made.errors == []
    assert states(made, "x", ["", "go=1", "go=0", "back=1", "back=0", "go=1"]) == ["0", "1", "1", "0", "0", "1"]


def test_steps_of_two_charts_may_have_one_name_and_each_flag_is_of_its_own() -> None:
    made = acting(step(1, "Init", first=True), transition(2, "1", inline("Init.X AND go")), step(3, "b", "2"),
                  actions(4, "3", does("y")),
                  main=step(1, "Init", first=True) + actions(2, "1", does("Sub")) + transition(3, "1", inline("Init.X AND leave"))
                  + step(4, "e", "3") + actions(5, "4", does("x")), declared="go leave x y")
    assert made.errors == []
    assert states(made, "x y", ["", "go=1", "leave=1"]) == ["0 0", "0 1", "1 1"]


def test_the_actions_of_a_step_in_codesys_run_when_it_is_entered_active_and_left() -> None:
    guids = {kind: guid for guid, kind in STEP_ACTIONS.items()}
    listed = "".join(f'<attribute guid="{guids[kind]}">{name}</attribute>'
                     for kind, name in (("entry", "In"), ("active", "Is"), ("exit", "Out")))
    added = f'<addData><data name="{CODESYS}sfc/element"><attributes>{listed}</attributes></data></addData>'
    bodies = "".join(f'<action name="{name}"><body><ST><xhtml:p>{text}</xhtml:p></ST></body></action>'
                     for name, text in (("In", "a := a + 1;"), ("Is", "b := b + 1;"), ("Out", "c := c + 1;")))
    entered = step(3, "e", "2").replace("</step>", f"{added}</step>")
    made = chart(step(1, "s", first=True), transition(2, "1", inline("go")), entered,
                 transition(4, "3", inline("NOT go")), jump(5, "4", "s"), more=f"<actions>{bodies}</actions>",
                 declared=variable("go") + variable("a", "INT") + variable("b", "INT") + variable("c", "INT"))
    assert codes(made) == []
    assert states(made, "a b c", ["", "go=1", "", "go=0", ""]) == ["0 0 0", "1 1 0", "1 2 0", "1 2 1", "1 2 1"]


def test_a_step_calls_an_action_of_an_instance_after_a_time() -> None:
    block_of = '<actions><action name="Stop"><body><ST><xhtml:p>stops := stops + 1;</xhtml:p></ST></body></action></actions>'
    motor = pou("stops := stops;", f"<localVars>{variable('stops', 'INT')}</localVars>", "functionBlock", "Drive",
                "ST").replace("<ST>", "<ST><xhtml:p>").replace("</ST>", "</xhtml:p></ST>", 1).replace("</interface>",
                                                                                                   f"</interface>{block_of}")
    main = pou(step(1, "s", first=True) + actions(2, "1", f"{does('Motor.Stop')}|qualifier=\"D\" duration=\"T#20ms\"")
               + transition(3, "1", inline("FALSE")) + jump(4, "3", "s"), variable("Motor", "Drive"), language="SFC")
    made = import_xml(document(main, motor))
    assert made.errors == []
    machine = plc(made)
    seen = []
    for _ in range(5):
        machine.scan()
        seen.append(machine.read("Main.Motor.stops"))
    assert seen == [0, 0, 1, 2, 3]


@pytest.mark.slow
@each_of("text", ["a AND NOT b;", "a AND NOT b ;;", "a\n AND NOT b;\n"])
def test_a_condition_that_ends_with_a_semicolon(text: str) -> None:
    beside = chart(step(1, "s", first=True), transition(2, "1", wires("9")), step(3, "e", "2"), actions(4, "3", does("x")),
                   value(9, text), declared="a b x")
    assert beside.errors == []
    assert states(beside, "x", ["a=1 b=1", "b=0"]) == ["0", "1"]


@each_of("text, condition", [
    ("a", "a"), (":= a;", "a"), ("leave := a  AND\n b;", "a AND b"), ("a; // ready", "a"), ("a // ready\n AND b", "a AND b"),
    ("// ready;\n a (* := *) AND /* ; */ b ;", "a AND b"), ("text = 'a  // b' ;;", "text = 'a  // b'"),
    ("", "TRUE"), (";", "TRUE"),
])  # fmt: skip
def test_a_condition_is_one_line_without_comments(text: str, condition: str) -> None:
    written = f'<inline name="leave"><ST><xhtml:p>{text}</xhtml:p></ST></inline>'
    made = chart(step(1, "s", first=True), transition(2, "1", written), step(3, "e", "2"), declared="a b")
    assert f"TRANSITION FROM s TO e := {condition};" in made.files["Main.st"]


def test_a_drawn_condition_is_one_line_without_comments() -> None:
    made = chart(step(1, "s", first=True), transition(2, "1", wires("9")), step(3, "e", "2"), value(9, "a // ready\n = 'b  c'"),
                 declared=variable("a", "STRING"))
    assert "TRANSITION FROM s TO e := a = 'b  c';" in made.files["Main.st"]


def test_members_of_instances_are_no_flags_of_steps() -> None:
    assert with_new_names("x := go.X AND Go . T > t AND m.go.X AND logo.X AND go.Xs;", {"GO": "go_2"}) == \
        "x := go_2.X AND go_2.T > t AND m.go.X AND logo.X AND go.Xs;"


FORKED = pou(step(1, "s", "9", first=True) + node("selectionDivergence", 2, "1") + transition(3, "2", inline("go"), at="90,0")
             + step(4, "right", "3") + transition(5, "2", inline("go"), at="10,0") + step(6, "left", "5")
             + transition(7, "4", inline("back")) + transition(8, "6", inline("back"))
             + node("selectionConvergence", 9, "7 8") + actions(10, "4", does("x")) + actions(11, "6", does("y")),
             "go back x y", language="SFC")


@each_of(("order", "seen"), [("document", ["0 0", "1 0"]), ("network", ["0 0", "0 1"])])
def test_a_selection_of_beremiz_is_tested_in_the_order_in_which_its_generator_meets_it(order: str, seen: list[str]) -> None:
    assert states(import_xml(document(FORKED), order=order), "x y", ["", "go=1"]) == seen


FIRST_RIGHT, FIRST_LEFT = "1 0", "0 1"


@each_of(("joins", "seen"), [
    (node("selectionConvergence", 9, "7 8"), FIRST_RIGHT), (node("selectionConvergence", 9, "8 7"), FIRST_LEFT),
    (node("selectionConvergence", 9, "12 7") + node("simultaneousConvergence", 12, "8"), FIRST_RIGHT),
    (node("selectionConvergence", 9, "12 7") + node("selectionDivergence", 12, "13") + node("simultaneousDivergence", 13, "8"),
     FIRST_RIGHT),
    (node("selectionConvergence", 9, "12 13") + node("selectionConvergence", 12, "8") + node("selectionConvergence", 13, "7"),
     FIRST_LEFT),
    (node("selectionConvergence", 9, "9 8 7"), FIRST_LEFT), (node("selectionConvergence", 9, "99 8 7"), FIRST_LEFT)])
def test_the_generator_of_beremiz_goes_along_the_wires_of_a_convergence_as_they_are_listed(joins: str, seen: str) -> None:
    text = FORKED.replace(node("selectionConvergence", 9, "7 8"), joins)
    assert states(import_xml(document(text), order="document"), "x y", ["", "go=1"]) == ["0 0", seen]


@each_of(("first", "seen"), [
    ("", FIRST_RIGHT), (jump(10, "8", "s"), FIRST_LEFT), (jump(10, "7", "s"), FIRST_RIGHT),
    (transition(8, "6", inline("back")), FIRST_LEFT), (step(6, "left", "5"), FIRST_LEFT),
    (node("selectionDivergence", 2, "1"), FIRST_RIGHT), (node("selectionConvergence", 13, "8 7"), FIRST_RIGHT)])
def test_the_generator_of_beremiz_begins_with_what_is_written_first(first: str, seen: str) -> None:
    parts = [step(1, "s", first=True), node("selectionDivergence", 2, "1"), transition(3, "2", inline("go")),
             step(4, "right", "3"), transition(5, "2", inline("go")), step(6, "left", "5"), transition(7, "4", inline("back")),
             transition(8, "6", inline("back")), jump(9, "7", "s"), jump(10, "8", "s"),
             actions(11, "4", does("x")), actions(12, "6", does("y"))]
    text = pou(first + "".join(part for part in parts if part != first), "go back x y", language="SFC")
    assert states(import_xml(document(text), order="document"), "x y", ["", "go=1"]) == ["0 0", seen]


def test_a_function_with_en_in_front_of_a_transition_keeps_its_result_while_en_is_off() -> None:
    made = chart(step(1, "s", first=True), transition(2, "1", wires("5.OUT")), step(3, "e", "2"), actions(4, "3", does("x")),
                 transition(9, "3", inline("back")), jump(10, "9", "s"), value(6, "n"), value(7, "INT#1"), value(8, "on"),
                 block(5, "GT", "EN=8 IN1=6 IN2=7", "ENO,OUT"), declared=f"{''.join(map(variable, ('x', 'on', 'back')))}"
                 + variable("n", "INT"))
    assert made.errors == []
    assert states(made, "x", ["n=2", "on=1", "on=0 n=-3", "back=1", ""]) == ["0", "1", "1", "0", "1"]


@each_of(("order", "found"), [("document", ["X0292"]), ("network", ["X0203"])])
def test_a_transition_that_no_step_leads_to_is_left_out_as_beremiz_does(order: str, found: list[str]) -> None:
    text = pou(step(1, "s", first=True) + transition(2, "1", inline("go")) + step(3, "t", "2") + actions(4, "3", does("x"))
               + transition(5, "", inline("go")) + jump(6, "5", "s"), "go x", language="SFC")
    made = import_xml(document(text), order=order)
    assert [code for code in codes(made) if code != "X0190"] == found
    if not made.errors:
        assert states(made, "x", ["", "go=1", ""]) == ["0", "1", "1"]
