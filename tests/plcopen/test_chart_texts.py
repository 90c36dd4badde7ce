"""Charts of documents beside the steps, transitions and actions that they become, and what is said of those that are left out."""

from __future__ import annotations

from drawings import contact, document, pou, value, variable, wires
from rows import each_of
from test_charts import actions, does, inline, jump, node, step, transition

from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml

DECLARED = variable("a") + variable("b") + variable("x") + variable("n", "INT") + variable("m", "Motor")
S, T, E = step(1, "s", first=True), transition(2, "1", inline("a")), step(3, "e", "2")


def chart(*parts: str, order: str = "") -> Imported:
    text = document(pou("".join(parts), DECLARED, language="SFC"))
    return import_xml(text, order=order) if order else import_xml(text)


def body(made: Imported) -> str:
    """What stands behind the declarations, with single spaces and without the ends of steps, transitions and actions."""
    text = made.files["Main.st"].rpartition("END_VAR")[2]
    return " ".join(word for word in text.split() if word not in ("END_STEP", "END_TRANSITION", "END_ACTION", "END_PROGRAM"))


def conditioned(condition: str, negated: bool = False) -> str:
    marks = ' negated="true"' if negated else ""
    return (f'<transition localId="2"><position x="0" y="0"/>{wires("1")}<connectionPointOut/><condition{marks}>{condition}'
            "</condition></transition>")


LIST = '<inline name="go"><IL><xhtml:p>LD a\nAND b</xhtml:p></IL></inline>'
TIMED = actions(7, "1", f"{does('x')}|qualifier=\"S\"", f"{does('m.Stop')}|qualifier=\"L\" duration=\"T#5s\" indicator=\"b\"",
                f"{does('m.On')}|qualifier=\"D\" duration=\"PT5S\"", does("M.ON"), f"{does(' b ')}|qualifier=\"L\"",
                f"{does('b')}|qualifier=\"SD\" duration=\"Wait\"",
                "<inline><documentation/><ST><xhtml:p>n := 1;</xhtml:p></ST></inline>|qualifier=\"P1\"")
BACK = [(transition(number, "3", inline("a"), f'priority="{priority}"'), jump(number + 1, str(number), target))
        for number, priority, target in ((4, "2", "S"), (6, "1", "E"), (8, "0", "s"), (10, "x", "s"))]
PARALLEL = (T, node("simultaneousDivergence", 5, "2").replace("localId", 'name="par" localId'), step(3, "e", "5"),
            step(6, "f", "5"), node("simultaneousConvergence", 7, "3 6"), transition(8, "7", inline("b")), jump(9, "8", "PAR"))


@each_of("parts, text", [
    ((S, TIMED, T, E),
     "INITIAL_STEP s: x(S); m_Stop(L, T#5s, b); m_On(D, T#5s); m_On(N); b(L, T#0s); b(SD, Wait); s_7(P1); STEP e: "
     "TRANSITION FROM s TO e := a; ACTION m_Stop: m.Stop(); ACTION m_On: m.On(); ACTION s_7: n := 1;"),
    ((S, T, E, *(part for pair in BACK for part in pair)),
     "INITIAL_STEP s: STEP e: TRANSITION (PRIORITY := 2) FROM e TO s := a; TRANSITION (PRIORITY := 1) FROM e TO e := a; "
     "TRANSITION FROM e TO s := a; TRANSITION FROM e TO s := a; TRANSITION FROM s TO e := a;"),
    ((S, *PARALLEL), "INITIAL_STEP s: STEP e: STEP f: TRANSITION FROM (e, f) TO (e, f) := b; TRANSITION FROM s TO (e, f) := a;"),
    ((S, T, node("selectionConvergence", 5, "2 5"), step(3, "e", "5")),
     "INITIAL_STEP s: STEP e: TRANSITION FROM s TO e := a;"),
    ((S, conditioned(LIST), E), "INITIAL_STEP s: STEP e: TRANSITION go FROM s TO e: LD a AND b"),
    ((S, conditioned(LIST, True), E), "INITIAL_STEP s: STEP e: TRANSITION go FROM s TO e: LD a AND b NOT"),
    ((S, conditioned(inline("IF a THEN T2 := b; END_IF;"), True), E),
     "INITIAL_STEP s: STEP e: TRANSITION T2 FROM s TO e: IF a THEN T2 := b; END_IF; T2 := NOT T2;"),
    ((S, conditioned(inline("a OR b"), True), E), "INITIAL_STEP s: STEP e: TRANSITION FROM s TO e := NOT (a OR b);"),
    ((S, conditioned(does(" leave "), True), E), "INITIAL_STEP s: STEP e: TRANSITION FROM s TO e := NOT (leave);"),
    ((S, conditioned(inline("T2 := a; T2 := b;").replace('""', '"1x"')), E),
     "INITIAL_STEP s: STEP e: TRANSITION T2 FROM s TO e: T2 := a; T2 := b;"),
], ids=lambda row: row[1])  # fmt: skip
def test_a_chart_becomes_steps_transitions_and_actions(parts: tuple[str, ...], text: str) -> None:
    made = chart(*parts)
    assert body(made) == text
    assert made.diagnostics == []


def said(made: Imported) -> list[str]:
    """Each message behind the word that it marks."""
    return [f"{each.code} {each.source.text[each.start + 1:each.end]}: {each.message.removeprefix('POU Main')}"
            for each in made.diagnostics]


@each_of("parts, message", [
    ((S, '<macroStep localId="7" name="m"/>'), "X0203 macroStep: , macroStep 7: the macro step m is not taken over"),
    ((step(1, "s"), T, E), "X0203 SFC: : the chart has no initial step"),
    ((step(1, "", first=True), T, E), "X0203 step: , step 1: a step has no name"),
    ((S, actions(7, "1", "|qualifier=\"N\""), T, E), "X0203 action: , action 0: an action of step s names nothing"),
    ((S, actions(7, "1", "<inline/>"), T, E), "X0203 action: , action 0: an action of step s names nothing"),
    ((S, actions(7, "1", f"{does('x')}|qualifier=\"DL\""), T, E), "X0203 action: , action 0: the qualifier DL is not executed"),
    ((S, transition(2, "1", ""), E), "X0203 transition: , transition 2: transition 2 has no condition"),
    ((S, T.replace("<condition>", "<other>").replace("</condition>", "</other>"), E),
     "X0203 transition: , transition 2: transition 2 has no condition"),
    ((S, transition(2, "1", '<inline name=""/>'), E), "X0203 inline: : the condition is empty"),
    ((S, transition(2, "9", inline("a")), E), "X0203 transition: , transition 2: no step stands above transition 2"),
    ((S, T), "X0203 transition: , transition 2: no step stands below transition 2"),
    ((S, T, transition(4, "2", inline("b")), step(3, "e", "4")),
     "X0203 transition: , transition 2: no step stands below transition 2"),
    ((S, T, jump(5, "2", "q")), "X0203 jumpStep: , jumpStep 5: there is no step q to jump to"),
], ids=lambda row: row[1])  # fmt: skip
def test_a_chart_that_is_left_out_is_named_and_stands_as_a_comment(parts: tuple[str, ...], message: str) -> None:
    made = chart(*parts)
    assert said(made) == [message]
    assert body(made) == f"// the sequential function chart was not taken over: {message.rpartition(': ')[2]}"


def test_what_belongs_to_no_transition_is_named_but_for_a_rail() -> None:
    made = chart(S, T, E, value(8, "x"), contact(9, "", "b"), '<rightPowerRail localId="10"/>')
    none = "belongs to no transition of the chart, and is not taken over"
    assert said(made) == [f"X0203 inVariable: , inVariable 8: x {none}", f"X0203 contact: , contact 9: b {none}"]
    assert body(made) == "INITIAL_STEP s: STEP e: TRANSITION FROM s TO e := a;"


def test_a_transition_below_no_step_is_left_out_where_its_generator_does() -> None:
    made = chart(S, transition(2, "9", inline("a")), transition(4, "1", inline("b")), step(3, "e", "4"), order="document")
    assert body(made) == "INITIAL_STEP s: STEP e: TRANSITION FROM s TO e := b;"
    assert said(made) == [
        "X0292 transition: , transition 2: no step stands above transition 2: Beremiz and OpenPLC Editor leave it out"]


def test_flags_are_read_of_the_steps_that_they_were_of_before_these_got_other_names() -> None:
    flags = transition(2, "1", inline("a.X AND A_2 . T > b.T"))
    made = chart(step(1, "a", first=True), flags, step(3, "A_2", "2"), step(4, "n", "2"))
    assert body(made) == "INITIAL_STEP a_2: STEP A_2_2: STEP n_2: TRANSITION FROM a_2 TO (A_2_2, n_2) := a_2.X AND A_2_2.T > b.T;"
    assert said(made) == [
        "X0190 step: names of steps that a variable, an action or another chart of the POU has, too, are changed (3 times, here "
        "for the first)"]
