"""Where importers of PLCopen XML go wrong: what a diagram means is seen by running what comes of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from drawings import (
    RAIL,
    block,
    codes,
    coil,
    contact,
    document,
    imported,
    plc,
    pou,
    result,
    states,
    value,
    variable,
    wires,
)
from rows import each_of

from fbvm.interchange.formats.given import within
from fbvm.interchange.plcopen.read.importing import import_xml

BRANCH = RAIL + contact(2, "1", "a") + contact(3, "1", "b")


TWICE = ('<pou name="Twice" pouType="function"><interface><returnType><INT/></returnType><inputVars><variable name="v">'
         '<type><INT/></type></variable></inputVars></interface><body><ST><xhtml:p>Twice := 2 * v;</xhtml:p></ST></body></pou>')


@each_of(("pins", "n", "x"), [("EN=2 v=4", ["0", "6", "6"], ["0", "1", "0"]), ("v=4", ["6", "6", "6"], ["1", "1", "1"])])
def test_a_function_of_the_project_is_called_once_where_its_en_is_true(pins: str, n: list[str], x: list[str]) -> None:
    """Two variables take its result, so it is a statement of its own."""
    drawn = (RAIL + contact(2, "1", "a") + value(4, "3") + block(3, "Twice", pins, "ENO,OUT") + result(5, "3.OUT", "n")
             + result(6, "3.OUT", "m") + coil(7, "3.ENO", "x"))
    declared = variable("a") + variable("x") + variable("n", "INT") + variable("m", "INT")
    made = imported(TWICE, pou(drawn, declared))
    assert made.files["Main.st"].count("Twice(") == 1
    assert states(made, "n", ["", "a=1", "a=0"]) == n
    assert states(made, "x", ["", "a=1", "a=0"]) == x


def test_literals_have_the_type_of_the_result_to_which_they_lead() -> None:
    """Nothing else says which type MOVE keeps while its EN is FALSE."""
    drawn = (value(2, "a") + value(3, "30") + block(4, "MOVE", "EN=2 IN=3", "ENO,OUT") + value(5, "b")
             + block(6, "MOVE", "EN=5 IN=3", "ENO,OUT") + block(7, "ADD", "IN1=4.OUT IN2=6.OUT", "OUT") + value(8, "5")
             + block(9, "MAX", "IN1=7.OUT IN2=8", "OUT") + result(10, "9.OUT", "Speed"))
    declared = f"<inputVars>{variable('a')}{variable('b')}</inputVars>"
    function = pou(drawn, declared, "function", "Speed").replace("<returnType><BOOL/>", "<returnType><INT/>")
    main = pou(value(2, "x") + value(3, "y") + block(4, "Speed", "a=2 b=3", "OUT") + result(5, "4.OUT", "n"),
               variable("x") + variable("y") + variable("n", "INT"))
    made = imported(function, main)
    assert not made.errors
    assert states(made, "n", ["", "x=1", "y=1", "x=0"]) == ["5", "30", "60", "30"]


def test_a_function_without_enable_that_two_variables_take_is_called_once() -> None:
    drawn = value(4, "3") + block(3, "Twice", "v=4", "OUT") + result(5, "3.OUT", "n") + result(6, "3.OUT", "m")
    made = imported(TWICE, pou(drawn, variable("n", "INT") + variable("m", "INT"), language="FBD"))
    assert made.files["Main.st"].count("Twice(") == 1
    assert states(made, "n m", [""]) == ["6 6"]


def test_what_a_block_gives_is_taken_only_while_it_is_enabled() -> None:
    """Also where something else stands between the call and who takes it."""
    drawn = (RAIL + contact(2, "1", "a") + value(6, "u") + value(7, "9") + block(3, "CTU", "EN=2 CU=6 PV=7", "ENO,Q,CV", "k")
             + coil(4, "3.ENO", "x") + result(5, "3.CV", "n") + block(8, "ADD", "IN1=3.CV IN2=7", "OUT")
             + result(9, "8.OUT", "m"))
    declared = (variable("a") + variable("u") + variable("x") + variable("n", "INT") + variable("m", "INT")
                + variable("k", "CTU"))
    assert states(imported(pou(drawn, declared)), "x n", ["a=1 u=1", "a=0 n=99", "a=1"]) == ["1 1", "0 99", "1 1"]


@each_of(("element", "found"), [
    (contact(2, "1", "a").replace('localId="2"', 'localId="two"'), ["X0105"]),
    ('<vendorElement typeName="note"><position x="0" y="0"/></vendorElement>', [])])
def test_an_element_without_a_number_is_named_unless_it_is_a_tools_own(element: str, found: list[str]) -> None:
    made = imported(pou(RAIL + element + contact(3, "1", "a") + coil(4, "3", "x"), "a x"))
    assert [code for code in codes(made) if code == "X0105"] == found


def test_two_wires_at_a_coil_are_ored() -> None:
    made = imported(pou(BRANCH + coil(4, "2 3", "x"), "a b x"))
    assert states(made, "x", ["", "a=1", "a=0 b=1"]) == ["0", "1", "1"]
    assert "LADDER" in made.files["Main.st"]


@pytest.mark.parametrize("strange", [
    '<vendorElement localId="9">{}<alternativeText><xhtml:p>box</xhtml:p></alternativeText></vendorElement>',
    '<teleporter localId="9">{}</teleporter>', '<error localId="9">{}<content><xhtml:p>lost</xhtml:p></content></error>',
])
def test_a_diagram_that_is_not_understood_does_not_become_an_empty_program(strange: str) -> None:
    good = contact(5, "1", "a") + coil(6, "5", "y")
    made = imported(pou(RAIL + strange.format(wires("1")) + coil(4, "9", "x") + good, "a x y"))
    assert [d.code for d in made.errors] == ["X0202"]
    assert " 9: " in made.errors[0].message
    assert "was not taken over" in made.files["Main.st"]
    assert states(made, "x y", ["a=1"]) == ["0 1"]


def test_a_shared_contact_in_front_of_set_and_reset_is_evaluated_once() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a", 'negated="true"', "50,0") + coil(4, "2", "a", 'storage="set"', "90,0")
                        + coil(5, "2", "y", 'storage="set"', "90,50"), "a y"))
    assert states(made, "a y", ["", ""]) == ["1 1", "1 1"]


def test_a_shared_contact_is_kept_when_statements_write_what_it_read() -> None:
    adds = (contact(2, "1", "a", 'negated="true"', "50,0") + value(6, "n", at="60,20")
            + block(3, "ADD", "EN=2 IN1=6 IN2=6", "ENO,OUT", at="90,0"))
    made = imported(pou(RAIL + adds + coil(4, "3.ENO", "a", 'storage="set"', "150,0")
                        + result(7, "3.OUT", "n", at="150,20") + coil(5, "2", "y", 'storage="set"', "90,90"),
                        variable("a") + variable("y") + variable("n", "INT", "2")))
    assert states(made, "a y n", ["", ""]) == ["1 1 4", "1 1 4"]


def test_of_two_coils_of_one_variable_the_last_network_wins() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x") + contact(4, "1", "b") + coil(5, "4", "x"), "a b x"))
    assert states(made, "x", ["a=1", "a=0 b=1"]) == ["0", "1"]


def test_a_sink_that_is_drawn_above_its_block_comes_behind_it() -> None:
    made = imported(pou(result(1, "2.OUT", "n", at="200,0") + block(2, "ADD", "IN1=3 IN2=4", "OUT", at="100,50")
                        + value(3, "m", at="0,50") + value(4, "1", at="0,70"),
                        variable("n", "INT") + variable("m", "INT"), language="FBD"))
    assert states(made, "n", ["m=4"]) == ["5"]


def test_without_positions_things_happen_as_they_are_written() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x") + contact(4, "1", "x") + coil(5, "4", "y"), "a x y"))
    assert states(made, "x y", ["a=1"]) == ["1 1"]
    made = imported(pou(RAIL + contact(4, "1", "x") + coil(5, "4", "y") + contact(2, "1", "a") + coil(3, "2", "x"), "a x y"))
    assert states(made, "x y", ["a=1", ""]) == ["1 0", "1 1"]


def test_with_positions_the_place_decides_and_not_the_writing() -> None:
    made = imported(pou(RAIL + contact(4, "1", "x", at="50,100") + coil(5, "4", "y", at="90,100")
                        + contact(2, "1", "a", at="50,10") + coil(3, "2", "x", at="90,10"), "a x y"))
    assert states(made, "x y", ["a=1"]) == ["1 1"]


def test_execution_order_goes_before_places() -> None:
    made = imported(pou(value(1, "x", at="0,0") + result(2, "1", "y", 'executionOrderId="2"', "50,0")
                        + value(3, "a", at="0,50") + result(4, "3", "x", 'executionOrderId="1"', "50,50"),
                        "a x y", language="FBD"))
    assert states(made, "x y", ["a=1"]) == ["1 1"]


def test_the_second_output_and_the_second_input_are_what_they_say() -> None:
    made = imported(pou(value(1, "n") + value(2, "3") + block(3, "SUB", "IN2=1 IN1=2", "OUT") + result(4, "3.OUT", "m")
                        + value(5, "a") + value(6, "T#0s") + block(7, "TON", "IN=5 PT=6", "Q,ET", "t") + result(8, "7.ET", "e"),
                        "".join((variable("n", "INT", "1"), variable("m", "INT"), variable("a"), variable("t", "TON"),
                                 variable("e", "TIME", "T#5s"))), language="FBD"))
    text = made.files["Main.st"]
    assert "e := t.ET;" in text
    assert "m := n - 3;" in text


@pytest.mark.parametrize("reference", ["undefined", "99", ""])
def test_a_wire_to_nothing_is_an_error_with_its_place(reference: str) -> None:
    loose = contact(2, "1", "a").replace('refLocalId="1"', f'refLocalId="{reference}"')
    made = imported(pou(RAIL + loose + coil(3, "2", "x"), "a x"))
    [found] = made.errors
    assert found.code == "X0201"
    assert "POU Main" in found.message
    assert "was not taken over" in made.files["Main.st"]


@pytest.mark.parametrize("pin", ["", ' formalParameter=""', ' formalParameter="none"'])
def test_a_pin_without_a_name_is_the_first_output_that_is_not_eno(pin: str) -> None:
    wire = f'<connection refLocalId="3"{pin}/>'
    made = imported(pou(value(1, "n") + value(2, "3") + block(3, "ADD", "IN1=1 IN2=2", "ENO,OUT")
                        + result(4, "3", "n").replace('<connection refLocalId="3"/>', wire),
                        variable("n", "INT"), language="FBD"))
    assert states(made, "n", ["", ""]) == ["3", "6"]


def test_an_output_that_there_is_not_is_an_error() -> None:
    made = imported(pou(value(1, "n") + block(3, "ADD", "IN1=1 IN2=1", "OUT") + result(4, "3.SUM", "n"), variable("n", "INT"),
                        language="FBD"))
    assert [d.code for d in made.errors] == ["X0201"]
    assert "its outputs are OUT" in made.errors[0].hint


@each_of("holder", ['<xhtml:p><![CDATA[{}]]></xhtml:p>', '<xhtml xmlns="http://www.w3.org/1999/xhtml">{}</xhtml>',
                    "<![CDATA[{}]]>", "<xhtml:p>{}</xhtml:p>"])
def test_structured_text_is_found_in_all_its_wrappings_with_its_blanks(holder: str) -> None:
    body = "\n  (* one\n     two *)\n  x := a;\n"
    made = imported(pou(holder.format(body), "a x", language="ST"))
    assert "(* one\n       two *)" in made.files["Main.st"]
    assert states(made, "x", ["a=1"]) == ["1"]


def test_initial_values_of_arrays_and_structures() -> None:
    types = ('<dataType name="Pair"><baseType><struct><variable name="l"><type><INT/></type></variable>'
             '<variable name="r"><type><array><dimension lower="0" upper="2"/><baseType><INT/></baseType></array></type>'
             "</variable></struct></baseType></dataType>")
    initial = ('<variable name="p"><type><derived name="Pair"/></type><initialValue><structValue>'
               '<value member="l"><simpleValue value="4"/></value><value member="r"><arrayValue>'
               '<value repetitionValue="2"><simpleValue value="5"/></value><value><simpleValue value="6"/></value>'
               "</arrayValue></value></structValue></initialValue></variable>")
    main = pou("<xhtml:p>n := p.l + p.r[1] + p.r[2];</xhtml:p>", initial + variable("n", "INT"), language="ST")
    made = import_xml(document(main, types=types))
    assert states(made, "n", [""]) == ["15"]


def test_a_language_that_is_not_read_is_named() -> None:
    made = imported(pou("x", "x", language="CFC"))
    assert codes(made) == ["X0203"]
    assert "CFC" in made.errors[0].message


def test_jump_label_and_return() -> None:
    jump = f'<jump localId="3" label="over">{wires("2")}</jump>'
    back = f'<return localId="9">{wires("8")}</return>'
    made = imported(pou(RAIL + contact(2, "1", "a") + jump + contact(4, "1", "b") + coil(5, "4", "x")
                        + '<label localId="6" label="over"/>' + contact(8, "1", "b") + back + contact(10, "1", "a")
                        + coil(11, "10", "y"), "a b x y"))
    assert states(made, "x y", ["b=1", "a=1 b=0", "b=1"]) == ["1 0", "1 1", "1 1"]


def test_a_negated_coil_with_storage_keeps_both() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'negated="true" storage="set"'), "a x"))
    assert states(made, "x", ["a=1", "a=0", "a=1"]) == ["0", "1", "1"]


def test_negated_with_an_edge_is_the_edge_of_the_inverse_assumed() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a", 'negated="true" edge="rising"') + coil(3, "2", "x"), "a x"))
    assert "X0292" in codes(made)
    assert states(made, "x", ["a=1", "a=0", ""]) == ["0", "1", "0"]


def test_edges_of_contacts_and_coils() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a", 'edge="rising"') + coil(3, "2", "x") + contact(4, "1", "a")
                        + coil(5, "4", "y", 'edge="falling"'), "a x y"))
    assert states(made, "x y", ["", "a=1", "", "a=0", ""]) == ["0 0", "1 0", "0 0", "0 1", "0 0"]
    assert "@LD" in made.files["Main.st"]


@each_of(("edge", "seen"), [("falling", ["0", "0", "1", "0"]), ("rising", ["0", "1", "0", "0"])])
def test_edges_of_inputs_of_a_block(edge: str, seen: list[str]) -> None:
    both = block(3, "AND", "IN1=1 IN2=2", "OUT").replace('formalParameter="IN1"', f'formalParameter="IN1" edge="{edge}"', 1)
    made = imported(pou(value(1, "a") + value(2, "b") + both + result(4, "3.OUT", "x"), "a b x", language="FBD"))
    assert codes(made) == [] and states(made, "x", ["b=1", "a=1", "a=0", ""]) == seen


def test_a_loop_through_a_block_takes_what_was_there_a_pass_before() -> None:
    made = imported(pou(value(1, "a") + block(2, "XOR", "IN1=1 IN2=2.OUT", "OUT") + result(3, "2.OUT", "x"),
                        "a x", language="FBD"))
    assert codes(made) == ["X0290"]
    assert states(made, "x", ["a=1", "", ""]) == ["1", "0", "1"]


def test_a_loop_through_a_variable_is_cut_there() -> None:
    variable_in_it = (f'<inOutVariable localId="3"><position x="0" y="0"/>{wires("2.OUT")}<connectionPointOut/>'
                      "<expression>n</expression></inOutVariable>")
    made = imported(pou(value(1, "1") + variable_in_it + block(2, "ADD", "IN1=1 IN2=3", "OUT") + result(4, "3", "m"),
                        variable("n", "INT", "5") + variable("m", "INT"), language="FBD"))
    assert codes(made) == ["X0290"]
    assert states(made, "n m", ["", ""]) == ["6 6", "7 7"]


@pytest.mark.slow
@each_of(("places", "marks", "wanted"), [
    (("0,0", "0,50"), ("", ""), ["1 1", "0 0", "1 1"]),
    (("0,50", "0,0"), ("", ""), ["1 0", "0 1", "1 0"]),
    (("50,0", "0,0"), ("", ""), ["1 0", "0 1", "1 0"]),
    (("0,0", "0,50"), ('executionOrderId="2"', 'executionOrderId="1"'), ["1 0", "0 1", "1 0"]),
    (("0,50", "0,0"), ('executionOrderId="1"', 'executionOrderId="2"'), ["1 1", "0 0", "1 1"]),
])
def test_a_loop_is_cut_at_the_wire_into_its_first_block(
    places: tuple[str, str], marks: tuple[str, str], wanted: list[str]
) -> None:
    """x is a XOR y, y is b XOR x: the first of the two takes what the other one gave a pass before."""
    made = imported(pou(value(1, "a") + value(2, "b")
                        + block(3, "XOR", "IN1=1 IN2=4.OUT", "OUT", at=places[0], marks=marks[0])
                        + block(4, "XOR", "IN1=2 IN2=3.OUT", "OUT", at=places[1], marks=marks[1])
                        + result(5, "3.OUT", "x") + result(6, "4.OUT", "y"), "a b x y", language="FBD"))
    assert codes(made) == ["X0190", "X0290"]
    assert states(made, "x y", ["a=1", "", ""]) == wanted


def test_a_wire_out_of_a_loop_is_not_cut() -> None:
    """Although it goes to the block that stands first, z is b XOR x of the same pass."""
    made = imported(pou(value(1, "a") + value(2, "b") + block(7, "XOR", "IN1=2 IN2=3.OUT", "OUT", at="0,0")
                        + block(3, "XOR", "IN1=1 IN2=3.OUT", "OUT", at="0,50") + result(5, "3.OUT", "x")
                        + result(6, "7.OUT", "z"), "a b x z", language="FBD"))
    assert codes(made) == ["X0190", "X0290"]
    assert states(made, "x z", ["a=1", "", "b=1"]) == ["1 1", "0 0", "1 0"]


def test_a_loop_of_a_contact_and_a_block_is_cut_in_front_of_the_block() -> None:
    """Although the contact stands first: it takes the block's output of this pass, the block the contact's of the last."""
    made = imported(pou(RAIL + contact(2, "3.OUT", "c", at="0,0") + block(3, "XOR", "IN1=4 IN2=2", "OUT", at="50,50")
                        + contact(4, "1", "a", at="0,50") + coil(5, "3.OUT", "x", at="100,50"), "a c x"))
    assert codes(made) == ["X0190", "X0290"]
    assert states(made, "x", ["a=1", "c=1", "", ""]) == ["1", "1", "0", "1"]


def test_a_loop_of_two_blocks_and_a_variable_is_cut_behind_the_variable() -> None:
    """Wherever it stands: y is 10 * (1 + n), and n is y when both blocks have been evaluated."""
    for places in (("0,0", "0,50", "0,90"), ("0,50", "0,90", "0,0"), ("0,90", "0,0", "0,50")):
        variable_in_it = (f'<inOutVariable localId="5"><position x="0" y="{places[2][2:]}"/>{wires("4.OUT")}'
                          "<connectionPointOut/><expression>n</expression></inOutVariable>")
        made = imported(pou(value(1, "1") + value(2, "10") + variable_in_it
                            + block(3, "ADD", "IN1=1 IN2=5", "OUT", at=places[0])
                            + block(4, "MUL", "IN1=2 IN2=3.OUT", "OUT", at=places[1]) + result(6, "4.OUT", "y"),
                            variable("n", "INT", "4") + variable("y", "INT"), language="FBD"))
        assert codes(made) == ["X0190", "X0290"]
        assert states(made, "n y", ["", ""]) == ["50 50", "510 510"], places


def test_power_goes_on_behind_a_coil() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'negated="true"') + contact(4, "3", "b")
                        + coil(5, "4", "y") + '<rightPowerRail localId="6"/>', "a b x y"))
    assert states(made, "x y", ["a=1 b=1", "b=0"]) == ["0 1", "0 0"]


def test_without_a_right_rail_nothing_is_missing_and_a_dead_end_is_named() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x") + contact(4, "1", "b"), "a b x"))
    assert codes(made) == ["X0291"]
    assert states(made, "x", ["a=1"]) == ["1"]


@pytest.mark.parametrize("pin", ["OUT", ""])
def test_a_function_with_en_holds_its_result_while_en_is_off(pin: str) -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + value(6, "n") + value(7, "1")
                        + block(3, "ADD", "EN=2 IN1=6 IN2=7", f"ENO,{pin}" if pin else "ENO,") + result(4, f"3.{pin}", "n"),
                        variable("a") + variable("n", "INT")))
    assert states(made, "n", ["a=1", "", "a=0", "n=9"]) == ["1", "2", "2", "9"]


def test_a_block_with_en_and_eno() -> None:
    made = imported(pou(RAIL + contact(2, "1", "a") + value(5, "TRUE") + value(6, "T#0s")
                        + block(3, "TON", "EN=2 IN=5 PT=6", "ENO,Q", "t") + coil(4, "3.ENO", "x") + coil(7, "3.Q", "y"),
                        variable("a") + variable("x") + variable("y") + variable("t", "TON")))
    assert states(made, "x y", ["", "a=1", "a=0"]) == ["0 0", "1 1", "0 1"]


def test_one_local_id_in_two_bodies_is_right_and_twice_in_one_is_not() -> None:
    body = RAIL + contact(2, "1", "a") + coil(3, "2", "x")
    assert codes(imported(pou(body, "a x"), pou(body, "a x", name="Other"))) == []
    made = imported(pou(body + contact(2, "1", "a") + coil(4, "2", "a"), "a x"))
    assert {d.code for d in made.errors} == {"X0105"}


def test_several_lists_of_inputs_keep_their_order() -> None:
    lists = (f'<inputVars>{variable("p", "INT")}</inputVars><localVars>{variable("l")}</localVars>'
             f'<inputVars>{variable("q", "INT")}</inputVars>')
    made = imported(pou("<xhtml:p>F := p &gt; q;</xhtml:p>", lists, "function", "F", "ST"),
                    pou("<xhtml:p>x := F(2, 1); y := F(1, 2);</xhtml:p>", "x y", language="ST"))
    assert states(made, "x y", [""]) == ["1 0"]


@pytest.mark.parametrize("namespace", ["http://www.plcopen.org/xml/tc6_0201", "http://www.plcopen.org/xml/tc6_0200",
                                       "http://www.plcopen.org/xml/tc6.xsd"])
def test_namespaces_of_all_versions_and_a_prefix_for_the_same(namespace: str) -> None:
    text = document(pou(RAIL + contact(2, "1", "a") + coil(3, "2", "x"), "a x"), namespace=namespace).decode()
    twice = text.replace("<project ", f'<project xmlns:ns1="{namespace}" ')
    prefixed = text.replace(f'xmlns="{namespace}"', f'xmlns:p="{namespace}"').replace("<project", "<p:project").replace(
        "</project", "</p:project")
    for variant in (text, twice, prefixed.replace("<types>", f'<types xmlns="{namespace}">')):
        made = import_xml(variant.encode())
        assert codes(made) == []
        assert states(made, "x", ["a=1"]) == ["1"]


def test_data_of_the_tools_own_is_listed_once_a_kind_with_its_count() -> None:
    data = '<addData><data name="http://example.com/colour" handleUnknown="preserve"><red/></data></addData>'
    text = document(pou("<xhtml:p>x := TRUE;</xhtml:p>", "x", language="ST")).decode().replace(
        "</pou>", f"{data}</pou>").replace("</pous>", f"</pous>{data}")
    [found] = import_xml(text.encode()).diagnostics
    assert found.code == "X0190"
    assert "http://example.com/colour" in found.message
    assert "2 times" in found.message


def test_wires_of_numbers_cannot_be_joined() -> None:
    made = imported(pou(value(1, "n") + value(2, "m") + block(3, "ADD", "IN1=1+2 IN2=1", "OUT") + result(4, "3.OUT", "n"),
                        variable("n", "INT") + variable("m", "INT"), language="FBD"))
    assert [d.code for d in made.errors] == ["X0202"]
    assert "only BOOL" in made.errors[0].hint


def test_an_in_out_needs_one_variable() -> None:
    inner = pou("<xhtml:p>v := v + 1;</xhtml:p>", f'<inOutVars>{variable("v", "INT")}</inOutVars>', "functionBlock", "Up", "ST")
    lists = variable("u", "Up") + variable("n", "INT")
    good = imported(inner, pou(value(1, "n") + block(2, "Up", "", "", "u", in_outs="v=1"), lists, language="FBD"))
    assert states(good, "n", ["", ""]) == ["1", "2"]
    loose = imported(inner, pou(block(2, "Up", "", "", "u", in_outs="v="), lists, language="FBD"))
    assert [d.code for d in loose.errors] == ["X0202"]


def test_connectors_are_wires() -> None:
    lines = f'<connector localId="4" name="far">{wires("2")}</connector><continuation localId="5" name="FAR"/>'
    made = imported(pou(RAIL + contact(2, "1", "a") + lines + contact(6, "5", "b") + coil(7, "6", "x"), "a b x"))
    assert states(made, "x", ["a=1", "b=1"]) == ["0", "1"]
    lost = imported(pou(RAIL + '<continuation localId="5" name="far"/>' + coil(7, "5", "x"), "x"))
    assert [d.code for d in lost.errors] == ["X0201"]


def test_an_operand_that_is_typed_at_a_pin_counts() -> None:
    typed = block(3, "ADD", "IN1=1 IN2=1", "OUT").replace(
        '<variable formalParameter="IN2"><connectionPointIn><connection refLocalId="1"/></connectionPointIn>',
        '<variable formalParameter="IN2"><connectionPointIn><expression>40</expression></connectionPointIn>')
    made = imported(pou(value(1, "n") + typed + result(4, "3.OUT", "m"), variable("n", "INT", "2") + variable("m", "INT"),
                        language="FBD"))
    assert states(made, "m", [""]) == ["42"]


def test_an_instruction_list_is_taken_over() -> None:
    made = imported(pou("<xhtml:p>LD a\nANDN b\nJMPC on\nLD FALSE\non: ST q</xhtml:p>", "a b q", language="IL"))
    assert codes(made) == []
    assert states(made, "q", ["a=1", "b=1", "b=0"]) == ["1", "0", "1"]


@each_of(("order", "found"), [("document", ["X0292"]), ("network", ["X0202"])])
def test_an_input_that_nothing_is_wired_to_is_left_out_where_its_tool_does(order: str, found: list[str]) -> None:
    drawn = value(1, "n") + value(2, "3") + block(3, "EQ", "IN1= IN2=1 IN3=2", "OUT") + result(4, "3.OUT", "x")
    text = pou(drawn, variable("n", "INT") + variable("x"), language="FBD").replace(wires(""), "<connectionPointIn/>")
    made = import_xml(document(text), order=order)
    assert [code for code in codes(made) if code != "X0190"] == found
    if not made.errors:
        assert states(made, "x", ["n=2", "n=3"]) == ["0", "1"]


def test_a_reference_in_the_place_of_a_name_is_a_type() -> None:
    text = pou("", '<variable name="r"><type><derived name="REFERENCE TO BOOL"/></type></variable>', language="LD")
    assert "r : REFERENCE TO BOOL;" in imported(text).files["Main.st"]


def test_the_type_of_a_moved_literal_is_that_of_the_variable_which_its_sum_reaches() -> None:
    moved = [value(1, "a") + value(2, "30") + block(3, "MOVE", "EN=1 IN=2", "ENO,OUT"),
             value(4, "b") + value(5, "-10") + block(6, "MOVE", "EN=4 IN=5", "ENO,OUT")]
    added = block(7, "ADD", "IN1=3.OUT IN2=6.OUT", "OUT") + result(8, "7.OUT", "n")
    made = imported(pou("".join(moved) + added, variable("a") + variable("b") + variable("n", "INT"), language="FBD"))
    assert made.errors == []
    assert states(made, "n", ["", "a=1", "b=1", "a=0"]) == ["0", "30", "20", "20"]


INSTANCES = ('<instances><configurations><configuration name="C"><resource name="R">'
             '<task name="t" priority="0" interval="PT0.01S"><pouInstance name="i" typeName="Main"/></task></resource>'
             '</configuration></configurations></instances></project>')


def test_an_instance_that_nothing_in_a_whole_project_declares_is_declared() -> None:
    """Some tools keep the instances of a diagram with its boxes.  POUs alone may belong to a project that has it elsewhere."""
    drawn = pou(RAIL + contact(2, "1", "a") + value(5, "T#20ms") + block(3, "TON", "IN=2 PT=5", "Q,ET", "late")
                + coil(4, "3", "x"), "a x")
    made = import_xml(document(drawn).replace(b"</project>", INSTANCES.encode()))
    assert codes(made) == ["X0292"]
    assert "nothing declares late: it becomes a variable of Main of the type TON" in made.diagnostics[0].message
    assert states(made, "x", ["a=1", "", "", "a=0"]) == ["0", "0", "1", "0"]
    assert "late : TON" not in imported(drawn).files["Main.st"]


def test_variables_of_python_beside_a_document_begin_with_their_values(tmp_path: Path) -> None:
    """A project of Beremiz declares them in the file of its Python code, which is not executed."""
    code = ('<?xml version="1.0"?><PyFile><variables><variable name="Speed" type="INT" initial="5"/>'
            '<variable name="Mode" type="STRING" initial="fast"/><variable name="ON" type="BOOL" initial="True"/></variables>'
            "<globals><p>Speed = 7</p></globals></PyFile>")
    (tmp_path / "python_0@py_ext").mkdir()
    (tmp_path / "python_0@py_ext" / "pyfile.xml").write_text(code, encoding="utf-8")
    (tmp_path / "broken@py_ext").mkdir()
    (tmp_path / "broken@py_ext" / "pyfile.xml").write_text("<PyFile><variables>", encoding="utf-8")
    outside = (f"<externalVars>{variable('Speed', 'INT')}{variable('Mode', 'string')}{variable('ON')}{variable('Other')}"
               "</externalVars>").replace('<derived name="string"/>', "<string/>")
    drawn = value(2, "Speed") + result(3, "2", "n") + value(4, "ON") + result(5, "4", "x")
    text = document(pou(drawn, outside + f"<localVars>{variable('n', 'INT')}{variable('x')}</localVars>")).decode()
    header = '<fileHeader companyName="Unknown" productName="Unnamed"/>'
    (tmp_path / "plc.xml").write_text(text.replace("<types>", f"{header}<types>"), encoding="utf-8")
    for made in (import_xml(tmp_path / "plc.xml"), within(tmp_path / "plc.xml")):
        assert made is not None and not made.errors
        said = [one.message for one in made.diagnostics if one.code == "X0292"]
        assert [message.partition(": ")[0] for message in said] == ["Speed, Mode, ON", "no global list has Other"]
        machine = plc(made)
        machine.scan()
        assert (machine.read("Main.n"), machine.read("Main.x"), machine.read("Mode")) == (5, True, "fast")


TWO = RAIL + contact(2, "1", "a") + coil(3, "2", "x")
WRONG: dict[str, tuple[str, str, str, str]] = {  # body, language, declared, message
    "no edge of this name": (RAIL + contact(2, "1", "a", 'edge="both"') + coil(3, "2", "x"), "LD", "a x",
                             "there is no edge 'both'"),
    "no storage of this name": (RAIL + contact(2, "1", "a") + coil(3, "2", "x", 'storage="keep"'), "LD", "a x",
                                "there is no storage 'keep'"),
    "a jump to nowhere": (RAIL + contact(2, "1", "a") + '<jump localId="3" label="Far">' + wires("2") + "</jump>", "LD", "a x",
                          "there is no label Far"),
    "an element of charts": (TWO + '<step localId="4" name="s"/>', "LD", "a x", "step stands in a body of LD"),
    "two of one number": (TWO + contact(2, "1", "x"), "LD", "a x", "localId 2 is there twice"),
    "two connectors": (TWO + f'<connector localId="4" name="far">{wires("2")}</connector>'
                       f'<connector localId="5" name="FAR">{wires("2")}</connector>'
                       '<continuation localId="6" name="far"/>' + coil(7, "6", "x"), "LD", "a x",
                       "there are two connectors FAR"),
    "a block without a type": (TWO + '<block localId="4"><inputVariables/><outputVariables/></block>', "LD", "a x",
                               "<block> has no typeName"),
    "an instruction outside": (value(1, "n") + block(2, "MOVE", "IN=1", "OUT") + result(3, "2.OUT", ""), "FBD",
                               variable("n", "INT"), "it has no variable"),
}  # fmt: skip


@pytest.mark.slow
@each_of("what", WRONG)
def test_what_is_wrong_with_an_element_is_said_where_it_stands(what: str) -> None:
    body, language, declared, message = WRONG[what]
    made = imported(pou(body, declared, language=language))
    assert codes(made) and any(message in error.message for error in made.errors), [each.message for each in made.diagnostics]
    assert "was not taken over" in made.files["Main.st"]


def test_a_body_that_is_a_whole_pou_is_taken_as_it_is() -> None:
    whole = "PROGRAM Main\nVAR\n    n : INT := 4;\nEND_VAR\nn := n + 1;\nEND_PROGRAM"
    made = imported(f'<pou name="Main" pouType="PROGRAM"><body><st><![CDATA[\n{whole}\n]]></st></body></pou>')
    assert codes(made) == ["X0292"]
    machine = plc(made)
    machine.scan()
    assert machine.read("Main.n") == 5
    beside = imported(pou(f"<p>{whole}</p>", "m", language="ST"))
    assert [error.message for error in beside.errors] == [
        "POU Main: the body is a whole PROGRAM, and beside it the document declares parts of it"]
    other = imported(pou(f"<p>{whole.replace('Main', 'Other')}</p>", "", language="ST"))
    assert "PROGRAM Other" in other.files["Main.st"]
