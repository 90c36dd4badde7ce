"""The order in which drawings are evaluated, as each generation of the generator of Beremiz and OpenPLC Editor has it."""

from __future__ import annotations

import re

import pytest
from drawings import NAMESPACE, RAIL, block, coil, contact, document, plc, pou, result, states, value, variable, wires
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read import networks
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.read.producer import ORDERS
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.machine.plc import Plc

UNKNOWN = '<fileHeader companyName="Unknown" productName="Unnamed" productVersion="1"/>'


def headed(data: bytes, header: str = UNKNOWN, date: str = "2023-05-01T10:00:00", scaling: int = 10) -> bytes:
    """A document with a header and the date of its last change, as Beremiz and OpenPLC Editor write them."""
    scalings = "".join(f'<{kind}><scaling x="{scaling}" y="{scaling}"/></{kind}>' for kind in ("fbd", "ld", "sfc"))
    content = f'<contentHeader name="n" modificationDateTime="{date}"><coordinateInfo>{scalings}</coordinateInfo></contentHeader>'
    return data.replace(b"<types>", f"{header}{content}<types>".encode())


def statements(made: Imported) -> list[str]:
    """The assignments and calls of Main, one a line; rungs as `coil := contact`."""
    text = made.files["Main.st"].partition("END_VAR\n")[2].rpartition("END_VAR\n")[2]
    text = re.sub(r"LD\s+(\w+)\s+OUT\s+(\w+)", r"\2 := \1;", text)
    return [line.strip() for line in text.splitlines() if ":=" in line]


CROSSED = pou(RAIL + contact(2, "1", "c", at="50,200") + coil(3, "2", "b", at="90,200")
              + contact(4, "1", "go", at="50,20") + coil(5, "4", "c", at="90,20"), "go b c")
DOWN, UP = ["c := go;", "b := c;"], ["b := c;", "c := go;"]


@each_of(("order", "expected"), [("network", DOWN), ("beremiz1", DOWN), ("document", UP), ("position", DOWN), ("ids", UP)])
def test_two_rungs_that_stand_crosswise(order: str, expected: list[str]) -> None:
    assert statements(import_xml(document(CROSSED), order=order)) == expected


def numbered(*orders: int) -> bytes:
    """Two networks, the lower one first in the document, each with two results of these numbers."""
    rows = zip("pqrs", (200, 220, 20, 40), orders, strict=True)
    results = [result(3 + at, "1" if at < 2 else "2", name, f'executionOrderId="{order}"', f"90,{y}")
               for at, (name, y, order) in enumerate(rows)]
    drawn = "".join([value(1, "a", at="10,200"), value(2, "b", at="10,20"), *results])
    return document(pou(drawn, "a b p q r s", language="FBD"))


@each_of(("orders", "first"), [((1, 2, 3, 4), "p := a;"), ((3, 4, 1, 2), "r := b;"), ((1, 3, 2, 4), "r := b;")])
def test_networks_stand_in_the_order_of_their_numbers_unless_two_of_them_mix(orders: tuple[int, ...], first: str) -> None:
    """Where they mix, networks go from top to bottom."""
    assert statements(import_xml(numbered(*orders), order="network"))[0] == first


SINK_BELOW = pou(value(1, "a", at="10,20") + block(2, "CTU", "CU=1", "Q,CV", "k", at="80,20") + value(3, "k.CV", at="10,300")
                 + result(4, "3", "n", at="200,300"), variable("a") + variable("n", "INT") + variable("k", "CTU"), language="FBD")
"""A block above, and far below it a variable that reads the block without a wire."""


@each_of(("order", "first"), [("network", "k(CU := a);"), ("beremiz1", "n := k.CV;"), ("document", "n := k.CV;"),
                              ("position", "k(CU := a);"), ("ids", "k(CU := a);")])
def test_a_block_above_and_a_sink_below(order: str, first: str) -> None:
    assert statements(import_xml(document(SINK_BELOW), order=order))[0] == first


@each_of(("header", "date", "scaling", "order"), [
    (UNKNOWN, "2023-05-01", 10, UP), (UNKNOWN, "2019-05-01", 0, DOWN),
    ('<fileHeader companyName="Beremiz" productName="Beremiz" productVersion="1"/>', "2024-01-01", 0, UP),
    ('<fileHeader companyName="Desconocido" productName="Sin nombre" productVersion="1"/>', "2024-01-01", 10, UP),
    ('<fileHeader companyName="" productName="CODESYS" productVersion="CODESYS V3.5"/>', "2024-01-01", 1, DOWN),
    ('<fileHeader companyName="me" productName="mine" productVersion="2"/>', "2024-01-01", 10, DOWN),
])
def test_the_header_tells_the_order(header: str, date: str, scaling: int, order: list[str]) -> None:
    assert statements(import_xml(headed(document(CROSSED), header, date, scaling))) == order


@each_of(("date", "order"), [("2025-11-01T00:00:00", DOWN), ("2025-01-01T00:00:00", UP)])
def test_the_newer_editor_of_openplc_declares_its_namespace_twice(date: str, order: list[str]) -> None:
    data = headed(document(CROSSED), date=date, scaling=16).replace(
        f'<project xmlns="{NAMESPACE}"'.encode(), f'<project xmlns="{NAMESPACE}" xmlns:ns1="{NAMESPACE}"'.encode())
    assert statements(import_xml(data)) == order


def test_orders_that_would_differ_are_told_with_the_elements_that_swap() -> None:
    made = import_xml(headed(document(CROSSED)))
    [told] = [d for d in made.diagnostics if d.code == "X0292"]
    assert "contact c (2) is evaluated before coil c (5)" in told.message
    assert "'document'" in told.message
    assert "--order beremiz1" in told.hint
    assert not [d for d in import_xml(headed(document(CROSSED)), order="document").diagnostics if d.code == "X0292"]


def test_orders_that_have_the_same_effect_are_not_mentioned() -> None:
    apart = pou(RAIL + contact(2, "1", "a", at="50,200") + coil(3, "2", "b", at="90,200")
                + contact(4, "1", "c", at="50,20") + coil(5, "4", "d", at="90,20"), "a b c d")
    assert "X0292" not in [d.code for d in import_xml(headed(document(apart))).diagnostics]


SHARED = pou(RAIL + contact(2, "1", "a", 'negated="true"') + coil(3, "2", "a") + coil(4, "2", "b"), "a b")


@each_of(("order", "seen"), [("network", ["1 1", "0 0", "1 1"]), ("document", ["1 0", "0 1", "1 0"])])
def test_a_contact_in_front_of_two_coils_is_read_once_or_for_each(order: str, seen: list[str]) -> None:
    machine = plc(import_xml(document(SHARED), order=order))
    found = []
    for _ in seen:
        machine.scan()
        found.append(f"{int(machine.read('Main.a'))} {int(machine.read('Main.b'))}")
    assert found == seen


def test_a_contact_behind_the_rail_is_read_for_each_of_its_coils() -> None:
    """Only what has to be worked out goes to a variable of its own."""
    drawn = RAIL + contact(2, "1", "a") + contact(3, "1", "b") + coil(4, "2 3", "x") + coil(5, "2", "y")
    assert statements(import_xml(document(pou(drawn, "a b x y")))) == ["x := a OR b;", "y := a;"]


def flashing(sink: str) -> bytes:
    """TON -> NOT -> TON, with an output variable behind one of them, or none."""
    parts = [value(1, "T#20ms"), block(2, "TON", "IN=3 PT=1", "Q,ET", "t"), block(3, "NOT", "IN=2.Q", "OUT")]
    if sink:
        parts.append(result(4, sink, "x"))
    return document(pou("".join(parts), variable("x") + variable("t", "TON"), language="FBD"))


@each_of(("sink", "first", "expected"), [
    ("3", False, ["t(IN := Before_3, PT := T#20ms);", "Before_3 := NOT t.Q;", "x := Before_3;"]),
    ("2.Q", True, ["Before_3 := NOT t.Q;", "t(IN := Before_3, PT := T#20ms);", "x := t.Q;"]),
])
def test_a_loop_is_cut_where_the_generator_comes_back_to_the_block_it_met_first(sink: str, first: bool,
                                                                               expected: list[str]) -> None:
    made = import_xml(flashing(sink), order="document")
    machine = plc(made)
    machine.scan()
    assert machine.read("Main.t.IN") is first
    assert [d.code for d in made.diagnostics if d.code.startswith("X02")] == ["X0290"]


@each_of(("limit", "most", "is_refused"), [("LARGEST", 4, False), ("LARGEST", 3, True), ("MOST_LOOPS", 1, False),
                                             ("MOST_LOOPS", 0, True)])  # fmt: skip
def test_a_network_with_too_many_elements_or_loops_is_refused(limit: str, most: int, is_refused: bool,
                                                              monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(networks, limit, most)
        made = import_xml(flashing("3"), order="document")
    assert [found.code for found in made.errors] == ["X0202"] * is_refused


def test_a_function_that_feeds_itself_counts() -> None:
    body = value(1, "INT#1") + block(2, "ADD", "IN1=1 IN2=2", "OUT") + result(3, "2", "n")
    machine = plc(import_xml(document(pou(body, variable("n", "INT"), language="FBD")), order="document"))
    for _ in range(5):
        machine.scan()
    assert machine.read("Main.n") == 5


def test_by_number_a_block_reads_what_comes_behind_it_as_the_pass_before_left_it() -> None:
    body = (block(1, "CTU", "CU=2.Q", "Q,CV", "k", marks='executionOrderId="1"') + value(3, "a")
            + block(2, "R_TRIG", "CLK=3", "Q", "edge", marks='executionOrderId="2"'))
    made = import_xml(document(pou(body, variable("a") + variable("k", "CTU") + variable("edge", "R_TRIG"), language="FBD")),
                      order="document")
    assert statements(made) == ["k(CU := edge.Q);", "edge(CLK := a);"]


def test_a_negated_set_coil_assigns_the_inverse_and_is_told() -> None:
    body = RAIL + contact(2, "1", "a") + coil(3, "2", "b", 'negated="true" storage="set"')
    made = import_xml(headed(document(pou(body, "a b"))))
    assert statements(made) == ["b := NOT a;"]
    assert "assign the inverse in every scan" in " ".join(d.message for d in made.diagnostics)


def test_jumps_are_not_executed_where_the_tool_executes_none() -> None:
    body = RAIL + contact(2, "1", "a") + '<jump localId="3" label="end"><position x="0" y="0"/><connectionPointIn>' \
        '<connection refLocalId="2"/></connectionPointIn></jump><label localId="4" label="end"/>' + coil(5, "2", "b")
    data = document(pou(body, "a b"))
    assert "JMP" not in import_xml(headed(data)).files["Main.st"]
    assert "JMP" in import_xml(data).files["Main.st"]


def test_every_order_says_what_it_is() -> None:
    assert all(len(text) > 30 for text in ORDERS.values())


def _text(body: str, language: str, declared: str, actions: str = "") -> str:
    """What comes of a POU in a document of Beremiz, in the order of its generator since October 2022."""
    whole = document(pou(body, declared, language=language)).replace(b"<body>", f"{actions}<body>".encode(), 1)
    return import_xml(headed(whole), order="document").files["Main.st"]


def test_who_reads_a_variable_that_is_written_at_the_same_place_does_not_wait_for_that() -> None:
    body = (result(2, "3", "q") + f'<inOutVariable localId="3">{wires("7.OUT")}<connectionPointOut/><expression>n</expression>'
            "</inOutVariable>" + block(7, "ADD", "IN1=3 IN2=5", "OUT") + value(5, "1"))
    text = _text(body, "FBD", variable("n", "INT") + variable("q", "INT"))
    assert text.index("q := n;") < text.index("n := n + 1;")


def test_actions_are_executed_in_the_order_in_which_steps_along_the_transitions_name_them() -> None:
    def action(name: str) -> str:
        return f'<action name="{name}"><body><ST><p xmlns="http://www.w3.org/1999/xhtml">;</p></ST></body></action>'

    def step(number: int, name: str, source: str, marks: str = "") -> str:
        return f'<step localId="{number}" name="{name}" {marks}>{wires(source)}<connectionPointOutAction/></step>'

    def block_of(number: int, step_number: int, name: str) -> str:
        return (f'<actionBlock localId="{number}">{wires(str(step_number))}<action localId="0" qualifier="N">'
                f'<reference name="{name}"/></action></actionBlock>')

    def transition(number: int, source: str) -> str:
        return f'<transition localId="{number}">{wires(source)}<condition><reference name="go"/></condition></transition>'

    body = (step(1, "First", "6", 'initialStep="true"') + block_of(11, 1, "Third") + step(3, "Late", "5") + block_of(13, 3, "One")
            + step(2, "Next", "4") + block_of(12, 2, "Two") + transition(4, "1") + transition(5, "2") + transition(6, "3"))
    text = _text(body, "SFC", variable("go"), f"<actions>{action('One')}{action('Two')}{action('Third')}</actions>")
    assert re.findall(r"ACTION (\w+):", text) == ["Third", "Two", "One"]


def test_a_body_without_a_statement_is_exported_with_a_text() -> None:
    exported = export_xml([Source("Main.st", "PROGRAM Main\nEND_PROGRAM\n")]).text
    assert exported is not None
    assert re.search(r"<ST>\s*<xhtml:p>\n</xhtml:p>", exported)


WIRED = """PROGRAM Main
VAR go, on, both, last : BOOL; t1, t2 : TON; e : R_TRIG; was : TIME; END_VAR
    LADDER
        LD go
        OUT on
    END_LADDER
    e(CLK := NOT on);
    t1(IN := e.Q, PT := T#20ms);
    both := go OR NOT t1.Q;
    was := t1.ET;
    t2(IN := both, PT := t1.PT);
    last := t2.Q;
END_PROGRAM
"""


def test_what_is_exported_is_evaluated_in_its_order_by_each_generator() -> None:
    exported = export_xml([Source("Main.st", WIRED)])
    assert not exported.errors
    assert exported.text is not None
    runs = []
    for order in ORDERS:
        made = plc(import_xml(exported.text.encode(), order=order))
        seen = []
        for scan in range(12):
            made.write("Main.go", scan % 5 > 2)
            made.scan()
            seen.append([made.read(f"Main.{name}") for name in ("on", "both", "last", "was", "t1.ET", "e.Q")])
        runs.append(seen)
    assert all(seen == runs[0] for seen in runs)
    assert len({str(row) for row in runs[0]}) > 3


BETWEEN = pou(RAIL + contact(2, "1", "a") + contact(3, "1", "b") + coil(4, "2", "x") + coil(5, "3", "a") + coil(6, "2", "y"),
             "a b x y")
"""A contact in front of two coils, between which another network writes what it reads."""


@each_of(("order", "y"), [("document", True), ("network", False)])
def test_a_contact_is_read_anew_for_each_coil_although_another_network_stands_between(order: str, y: bool) -> None:
    machine = plc(import_xml(document(BETWEEN), order=order))
    machine.write("Main.b", True)
    machine.scan()
    assert (machine.read("Main.x"), machine.read("Main.y")) == (False, y)


@each_of(("order", "x"), [("document", True), ("network", False)])
def test_a_falling_edge_of_beremiz_is_its_f_trig_also_in_the_first_scan(order: str, x: bool) -> None:
    made = import_xml(document(pou(RAIL + contact(2, "1", "a", 'edge="falling"') + coil(3, "2", "x"), "a x")), order=order)
    sources = [Source(name, text) for name, text in made.files.items()]
    image = compile_sources(sources, "Main", dialect="matiec", lint=False).image
    assert image is not None
    machine = Plc(image)
    machine.scan()
    assert machine.read("Main.x") is x
    machine.scan()
    assert machine.read("Main.x") is False


@each_of(("header", "configuration", "family"), [
    ('companyName="Unknown" productName="Line 4"', "plant", "beremiz"),
    ('companyName="Acme" productName="Unnamed"', "plant", "beremiz"),
    ('companyName="Acme" productName="Line 4"', "Config0", "beremiz"),
    ('companyName="Acme" productName="Line 4"', "plant", ""),
    ('companyName="Acme" productName="CODESYS"', "Config0", "codesys"),
])
def test_a_renamed_project_of_beremiz_is_known_by_what_its_user_left(header: str, configuration: str, family: str) -> None:
    text = document(pou(coil(2, "1", "a") + RAIL, "a")).decode().replace("<types>", f"<fileHeader {header}/><types>")
    text = text.replace("</project>", f'<instances><configurations><configuration name="{configuration}"><resource name="Res0"/>'
                        "</configuration></configurations></instances></project>")
    assert import_xml(text.encode()).family == family


@each_of(("order", "expected"), [("network", ["0 0 7", "1 1 8", "1 1 8"]), ("document", ["0 0 7", "1 1 8", "0 1 8"])])
def test_a_function_that_is_not_enabled_gives_what_its_tool_gives(order: str, expected: list[str]) -> None:
    """Behind a generator of Beremiz a coil takes FALSE then; a variable keeps its value, as everywhere."""
    drawn = (value(2, "a") + value(3, "3") + value(4, "5") + block(5, "LT", "EN=2 IN1=3 IN2=4", "ENO,OUT") + coil(6, "5.OUT", "x")
             + result(7, "5.OUT", "y") + block(8, "ADD", "EN=2 IN1=3 IN2=4", "ENO,OUT") + result(9, "8.OUT", "n"))
    declared = variable("a") + variable("x") + variable("y") + variable("n", "INT", "7")
    made = import_xml(document(pou(drawn, declared)), order=order)
    assert not made.errors
    assert states(made, "x y n", ["", "a=1", "a=0"]) == expected


SPLIT = """<pou name="Split" pouType="function"><interface><returnType><INT/></returnType><inputVars><variable name="v"><type>
<INT/></type></variable></inputVars><outputVars><variable name="rest"><type><INT/></type></variable></outputVars></interface>
<body><ST><xhtml:p>Split := v / 10; rest := v MOD 10;</xhtml:p></ST></body></pou>"""


@each_of("order", ["network", "document"])
def test_what_takes_an_output_of_a_function_keeps_its_value_while_the_function_is_not_enabled(order: str) -> None:
    drawn = (value(2, "a") + value(3, "48") + block(5, "Split", "EN=2 v=3", "ENO,Split,rest") + result(6, "5.Split", "n")
             + result(7, "5.rest", "m"))
    declared = variable("a") + variable("n", "INT", "7") + variable("m", "INT", "9")
    assert states(import_xml(document(pou(drawn, declared), SPLIT), order=order), "n m", ["", "a=1", "a=0"]) == [
        "7 9", "4 8", "4 8"]


@each_of("enable", ["EN", "en"])
def test_what_takes_an_output_of_a_block_keeps_its_value_while_the_block_is_not_enabled(enable: str) -> None:
    drawn = value(2, "a") + value(3, "b") + block(4, "CTU", f"{enable}=2 CU=3", f"{enable}O,Q,CV", "s") + result(5, "4.CV", "n") \
        + contact(6, "4.Q", "b") + coil(7, "6", "x")  # so that no call gives n its value
    declared = variable("a") + variable("b") + variable("x") + variable("n", "INT", "7") + variable("s", "CTU")
    assert states(import_xml(document(pou(drawn, declared))), "n", ["b=1", "a=1", "a=0"]) == ["7", "1", "1"]


def test_what_came_back_through_a_loop_is_kept_for_who_reads_it_behind_the_loop() -> None:
    body = (value(1, "n") + value(2, "INT#3") + block(3, "ADD", "IN1=1 IN2=4", "OUT", marks='executionOrderId="1"')
            + result(5, "4", "m") + result(6, "3", "k") + block(4, "SUB", "IN1=2 IN2=4", "OUT"))
    declared = variable("n", "INT", "5") + variable("m", "INT") + variable("k", "INT")
    made = import_xml(document(pou(body, declared, language="FBD")), order="document")
    assert states(made, "m k", ["", "", ""]) == ["3 5", "0 8", "3 5"]


def test_a_variable_that_is_read_and_written_at_one_place_in_the_order_of_numbers() -> None:
    body = (f'<inOutVariable localId="1">{wires("4")}<connectionPointOut/><expression>n</expression></inOutVariable>'
            + result(2, "1", "m", 'executionOrderId="1"') + value(3, "INT#2") + block(4, "ADD", "IN1=3 IN2=1", "OUT"))
    made = import_xml(document(pou(body, variable("n", "INT") + variable("m", "INT"), language="FBD")), order="ids")
    assert states(made, "n m", ["", "", ""]) == ["2 0", "4 2", "6 4"]


def test_a_wire_that_comes_from_nothing_is_left_out_by_the_generators() -> None:
    drawn = (value(2, "n") + block(3, "Add", "x=2 y=9", "sum", "s") + result(4, "3.sum", "m") + result(5, "9", "n")
             + RAIL + contact(6, "1", "a") + coil(7, "6 9", "b"))
    add = pou("<p>sum := x + y;</p>", f"<inputVars>{variable('x', 'INT')}{variable('y', 'INT', '5')}</inputVars>"
              f"<outputVars>{variable('sum', 'INT')}</outputVars>", kind="functionBlock", name="Add", language="ST")
    declared = variable("a") + variable("b") + variable("n", "INT", "1") + variable("m", "INT") + variable("s", "Add")
    made = import_xml(document(pou(drawn, f"<localVars>{declared}</localVars>"), add), order="document")
    assert [each.code for each in made.diagnostics if "there is not" in each.message] == ["X0292"] * 3 and not made.errors
    assert states(made, "m b n", ["a=0", "a=1"]) == ["6 0 1", "6 1 1"]
    alone = pou(RAIL + contact(2, "9", "a") + coil(3, "2", "b"), "a b")
    assert [each.code for each in import_xml(document(alone), order="document").errors] == ["X0201"]
