"""Which networks of a document are rungs of mnemonics, and which bodies are exported as rungs and as lists."""

from __future__ import annotations

from drawings import RAIL, block, coil, contact, document, pou, result, value, variable
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml


def exported(body: str) -> str:
    made = export_xml([Source("Main.st", f"PROGRAM Main\nVAR a, b, x : BOOL; n, m : INT; END_VAR\n{body}\nEND_PROGRAM\n")])
    assert made.text is not None, "\n".join(each.render() for each in made.errors)
    return made.text


def body_of(text: str, order: str = "network") -> list[str]:
    """The lines of the body that comes of a document, with single spaces."""
    main = import_xml(text.encode(), order=order).files["Main.st"]
    lines = main.rpartition("END_VAR\n")[2].splitlines()
    return [" ".join(line.split()) for line in lines if not line.strip().startswith("//")]


@each_of("other, body", [
    ("AND", ["LADDER", "RUNG 1", "LD a", "AND= n m", "OUT x", "END_LADDER", "END_PROGRAM"]),
    ("and", ["LADDER", "RUNG 1", "LD a", "AND= n m", "OUT x", "END_LADDER", "END_PROGRAM"]),
    ("OR", ["x := a OR n = m;", "END_PROGRAM"]),
    ("XOR", ["x := a XOR n = m;", "END_PROGRAM"]),
    ('AND" instanceName="t', ["t(IN1 := a, IN2 := n = m);", "x := t.OUT;", "END_PROGRAM"]),
])
def test_an_and_block_alone_joins_a_comparison_to_the_power_before_it(other: str, body: list[str]) -> None:
    text = exported("LADDER\nLD a\nAND=(300) n m\nOUT x\nEND_LADDER")
    assert text.count('typeName="AND"') == 1
    assert body_of(text.replace('typeName="AND"', f'typeName="{other}"')) == body


@each_of("steps", [
    ["LD a", "MOV n m"], ["LD a", "NOT", "OUT x"], ["LD a", "AND b", "NOT", "MOV n m"], ["LD a", "@SET x"], ["LD= n m", "OUT x"],
    ["LD a", "OUT x", "ANDNOT b", "MOV n m"], ["LD a", "+ n &1 m"], ["LD a", "OR= n m", "DIFU x"], ["@LD a", "SET x"],
])
def test_steps_come_back_as_they_were_exported(steps: list[str]) -> None:
    found = body_of(exported("\n".join(["LADDER", *steps, "END_LADDER"])))
    assert found == ["LADDER", "RUNG 1", *steps, "END_LADDER", "END_PROGRAM"]


THIRD = '<variable formalParameter="IN3"><connectionPointIn><connection refLocalId="2"/></connectionPointIn></variable>'
RIGHT = "<rightPowerRail"


@each_of("edits, body", [
    ({}, ["LADDER", "RUNG 1", "LD a", "AND= n m", "OUT x", "END_LADDER"]),
    ({"</inputVariables>": f"{THIRD}</inputVariables>"}, ["x := a AND n = m AND a;"]),
    ({RIGHT: coil(70, "5.OUT", "y", at="520,200") + RIGHT}, ["Power_5 := n = m;", "x := a AND Power_5;", "y := Power_5;"]),
    ({'refLocalId="5"': 'refLocalId="71"', RIGHT: contact(71, "1", "b") + RIGHT}, ["x := a AND b;"]),
])  # fmt: skip
def test_an_and_block_joins_one_comparison_that_nothing_else_takes(edits: dict[str, str], body: list[str]) -> None:
    text = exported("LADDER\nLD a\nAND=(300) n m\nOUT x\nEND_LADDER")
    before, kind, behind = text.partition('typeName="AND"')
    for old, new in edits.items():
        behind = behind.replace(old, new, 1)
    assert body_of(before + kind + behind) == [*body, "END_PROGRAM"]


@each_of("drawn, body", [
    (block(5, "Blk", "EN=2", "ENO", "t"), ["FBCALL Blk t"]),
    (block(5, "Blk", "EN=2", "ENO", "t") + coil(6, "5.ENO", "x"), ["FBCALL Blk t", "OUT x"]),
    (value(3, "n") + block(5, "Blk", "EN=2 k=3", "ENO,q", "t") + result(6, "5.q", "m"), ["FBCALL Blk t k:=n q=>m"]),
    (value(3, "b") + block(5, "Blk", "EN=2 !k=3", "ENO,q", "t"), "t(EN := a, k := NOT b);"),
    (value(3, "b") + block(5, "Blk", "EN=2", "ENO,q", "t", in_outs="k=3"), "t(EN := a, k := b);"),
    (contact(3, "1", "b") + block(5, "Blk", "EN=2 k=3", "ENO,q", "t"), "t(EN := a, k := b);"),
    (value(3, "b", 'negated="true"') + block(5, "Blk", "EN=2 k=3", "ENO,q", "t"), "t(EN := a, k := NOT b);"),
    (value(3, "b") + value(4, "x") + block(5, "Blk", "EN=2 k=3+4", "ENO,q", "t"), "t(EN := a, k := b OR x);"),
    (block(5, "Blk", "!EN=2", "ENO", "t"), "t(EN := NOT a);"),
    (block(5, "Blk", "k=2", "q", "t"), "t(k := a);"),
    (value(3, "n") + block(5, "Blk", "EN=2 k=3", "ENO,q", "t") + coil(6, "5.q", "x"),
     "Enabled_5 := FALSE; t(EN := a, k := n, ENO => Enabled_5); IF Enabled_5 THEN x := t.q; END_IF;"),
    (value(3, "b") + block(5, "Blk", "EN=2 k=3", "ENO,q", "t") + result(6, "5.q", "y", 'negated="true"'),
     "Enabled_5 := FALSE; t(EN := a, k := b, ENO => Enabled_5); IF Enabled_5 THEN y := NOT t.q; END_IF;"),
    (value(3, "n") + block(5, "Fun", "EN=2 k=3", "ENO,q") + result(6, "5.q", "m"),
     "Enable_5 := a; IF Enable_5 THEN Result_5 := Fun(k := n); END_IF; IF Enable_5 THEN m := Result_5; END_IF;"),
])  # fmt: skip
def test_a_block_that_power_goes_through_is_called_by_a_rung(drawn: str, body: list[str] | str) -> None:
    names = "".join(map(variable, ("a", "b", "x", "y"))) + variable("n", "INT") + variable("m", "INT") + variable("t", "Blk")
    text = " ".join(body_of(document(pou(RAIL + contact(2, "1", "a") + drawn, names)).decode()))
    wanted = body if isinstance(body, str) else " ".join(["LADDER", "RUNG 1", "LD a", *body, "END_LADDER"])
    assert text == f"{wanted} END_PROGRAM"


@each_of("body, language", [
    ("x := a;", "ST"), ("REPEAT x := a; UNTIL a END_REPEAT;", "ST"), ("IF a THEN x := b; END_IF;", "ST"),
    ("LD a\nST x", "IL"), ("LD a\nJMPC on\nLD b\non: ST x", "IL"),
    ("on: LD a\nST x\nJMPC on", "IL"),  # all of it is a loop
    ("LADDER\nLD a\nOUT x\nEND_LADDER", "LD"), ("LADDER\nLD a\nJMP #1\nLD b\nOUT x\nJME #1\nEND_LADDER", "LD"),
    ("LADDER\nLD a // JMP\nOUT x\n// goes: on\nEND_LADDER", "LD"), ("LADDER\nLD a\nOUT x\nEND_LADDER\nx := a;", "LD"),
])  # fmt: skip
def test_a_body_is_exported_in_the_language_that_it_is_written_in(body: str, language: str) -> None:
    text = exported(body)
    assert [each for each in ("ST", "IL", "LD") if f"<{each}>" in text] == [language]


RUNG = ["LADDER", "RUNG 1", "LD a", "OUT TR0"]


@each_of("branch, output, order, body", [
    (contact(5, "2", "c") + coil(6, "5", "y"), coil(7, "3", "z"), "network",
     [*RUNG, "AND b", "OUT x", "OUT z", "LD TR0", "AND c", "OUT y", "END_LADDER"]),
    (contact(5, "2", "s.f") + coil(6, "5", "y"), coil(7, "3", "z"), "network",
     [*RUNG, "AND b", "OUT x", "OUT z", "LD TR0", "AND s.f", "OUT y", "END_LADDER"]),
    (contact(5, "2", "z") + coil(6, "5", "y"), coil(7, "3", "z"), "network",
     ["Power_3 := a AND b;", "x := Power_3;", "y := a AND z;", "z := Power_3;"]),
    (contact(5, "2", "%MX0.3") + coil(6, "5", "y"), coil(7, "3", "z"), "network",
     [*RUNG, "AND b", "OUT x", "OUT z", "LD TR0", "AND %MX0.3", "OUT y", "END_LADDER"]),
    (contact(5, "2", "%MX0.3") + coil(6, "5", "y"), coil(7, "3", "%MX0.4"), "network",
     ["Power_3 := a AND b;", "x := Power_3;", "y := a AND %MX0.3;", "%MX0.4 := Power_3;"]),
    (contact(5, "2", "c") + coil(6, "5", "y"), block(7, "Blk", "EN=3", "ENO", "t"), "network",
     ["Power_3 := a AND b;", "x := Power_3;", "y := a AND c;", "t(EN := Power_3);"]),  # a block may touch any memory
    (contact(5, "2", "c") + block(6, "Blk", "EN=5", "ENO", "t"), coil(7, "3", "z"), "network",
     ["Power_3 := a AND b;", "x := Power_3;", "t(EN := a AND c);", "z := Power_3;"]),
    (contact(5, "2", "c") + block(6, "Blk", "EN=5", "ENO", "t"), coil(7, "3", "z"), "document",
     [*RUNG, "AND b", "OUT x", "OUT z", "LD TR0", "AND c", "FBCALL Blk t", "END_LADDER"]),  # blocks come last there
])  # fmt: skip
def test_a_rung_reads_and_writes_in_the_order_of_its_network(branch: str, output: str, order: str, body: list[str]) -> None:
    drawn = RAIL + contact(2, "1", "a") + contact(3, "2", "b") + coil(4, "3", "x") + branch + output
    assert body_of(document(pou(drawn, "a b c x y z")).decode(), order) == [*body, "END_PROGRAM"]
