"""Operands of ladder instructions and pins of blocks: the address, the number or the symbol that a text means."""

from __future__ import annotations

from rows import each_of

from fbvm.syntax.ladder.operands import OperandError, Operands
from fbvm.syntax.tree import Direct, Expr, Literal
from fbvm.syntax.tree.ladder import Contents


def told(text: str, wanted: str) -> str:
    """The operand in the words of Structured Text, or why it is none; `pin` is a pin of a block."""
    operands = Operands()
    try:
        made: Expr = operands.pin(text, 0, len(text)) if wanted == "pin" else operands.expression(text, wanted, 0, len(text))
    except OperandError as error:
        return str(error.args[0])
    if isinstance(made, Contents):
        made = made.of
    return made.text if isinstance(made, Direct) else str(made.value) if isinstance(made, Literal) else type(made).__name__


@each_of("text, as_bit, as_word", [
    ("HR1003", "%H10.03", "%H1003"), ("HR5", "%H0.05", "%H5"), ("HR05", "%H0.05", "%H5"), ("hr10", "%H0.10", "%H10"),
    ("HR1003.05", "%H1003.05", "H1003.05 is a bit, and a pin is a word"),
    ("AR1207", "%A12.07", "A ends at 959; 1207 does not exist"),
    ("AR10.3", "%A10.03", "A10.03 is a bit, and a pin is a word"), ("DM100", "D100 is a word, and a pin is a bit", "%D100"),
    ("TIM5", "%TF5", "%T5"), ("CNT12", "%CNF12", "%C12"), ("10203", "%CIO102.03", "CIO ends at 6143; 10203 does not exist"),
    ("00105", "%CIO1.05", "%CIO105"), ("100", "CIO 100 is a word, and a pin is a bit", "%CIO100"),
])
def test_addresses_of_the_c_series(text: str, as_bit: str, as_word: str) -> None:
    assert (told(text, "b"), told(text, "w")) == (as_bit, as_word)


@each_of("text, made", [
    ("+1.5", "1.5"), ("-2,5", "-2.5"), ("&18446744073709551615", str((1 << 64) - 1)), ("#FFFF", "65535"),
    ("&18446744073709551616", "&18446744073709551616 does not fit in 64 bits"),
    ("0.05", "%CIO0.05"), ("100", "%CIO100"), ("D100", "%D100"), ("W3.15", "%W3.15"), ("P_1S", "%CF102"), ("p_on", "%CF113"),
    ("TIM5", "%T5"), ("HR1003", "%H1003"), ("pump", "NameRef"), ("pump.speed", "Member"), ("list[2]", "Index"),
    ("@D5", "an address that is worked out cannot stand here"), ("*D5", "an address that is worked out cannot stand here"),
])
def test_what_a_pin_of_a_block_takes(text: str, made: str) -> None:
    assert told(text, "pin") == made
