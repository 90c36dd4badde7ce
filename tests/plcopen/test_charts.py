"""Sequential function charts of documents: what comes of them runs as the chart says."""

from __future__ import annotations

import pytest
from drawings import RAIL, block, codes, contact, imported, pou, states, value, variable, wires
from rows import each_of

from fbvm.interchange.plcopen.read.importing import Imported


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
