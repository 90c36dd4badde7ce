"""Operands of rungs at pins of drawn blocks: as Structured Text has them, or as they are, which other tools cannot read."""

from __future__ import annotations

from types import SimpleNamespace

from rows import each_of

from fbvm.interchange.plcopen.write.rungs import Contact, RungWriter, Ways, _contacts


@each_of(("text", "drawn", "is_foreign"), (
    ("P_On", "TRUE", False), ("p_off", "FALSE", False), ("&12", "12", False), ("#1A", "16#1A", False), ("+5", "5", False),
    ("-5.5", "-5.5", False), ("+5.5", "5.5", False), ("'text'", "'text'", False), ("INT#5", "INT#5", False),
    ("true", "true", False),
    ("Level", "Level", False), ("Tank.Level[3].High", "Tank.Level[3].High", False), ("Wärme", "Wärme", False),
    ("T5", "Delay", False), ("t5", "Delay", False), ("@D100", "@D100", True), ("0.01", "0.01", True), ("3a", "3a", True),
    ("&", "&", True), ("+", "+", True), ("a..b", "a..b", True)))  # fmt: skip
def test_an_operand_at_a_pin(text: str, drawn: str, is_foreign: bool) -> None:
    writer = RungWriter.__new__(RungWriter)
    types = SimpleNamespace(foreign=[])
    writer.types, writer.numbered, writer.step = types, {"T5": "Delay"}, object()  # type: ignore[assignment]
    assert writer._operand(text) == drawn
    said = f"{text} is an address, for which other tools have no name; declare a variable AT it"
    assert types.foreign == ([(writer.step, said)] if is_foreign else [])


def test_contacts_of_ways_inside_ways_are_found() -> None:
    one, two, three = (Contact(name, {}) for name in "abc")
    assert _contacts([one, Ways([[two], [Ways([[three], []])]])]) == [one, two, three]
