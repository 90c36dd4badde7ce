"""Which networks of a document are rungs of mnemonics, and which bodies are exported as rungs and as lists."""

from __future__ import annotations

from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml


def exported(body: str) -> str:
    made = export_xml([Source("Main.st", f"PROGRAM Main\nVAR a, b, x : BOOL; n, m : INT; END_VAR\n{body}\nEND_PROGRAM\n")])
    assert made.text is not None, "\n".join(each.render() for each in made.errors)
    return made.text


def body_of(text: str) -> list[str]:
    """The lines of the body that comes of a document, in single words."""
    main = import_xml(text.encode()).files["Main.st"]
    lines = main.partition("END_VAR\n")[2].splitlines()
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
