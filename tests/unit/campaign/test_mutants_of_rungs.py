"""Which constants, addresses and instructions of rungs are taken for which others."""

from __future__ import annotations

import pytest
from rows import each_of
from test_mutation_operators import of_rows

from fbvm.campaign.mutation import rungs


@each_of("constant, others", [
    # a number one more or less, `#` with as many digits; decimal where its digits are
    ("&0", "&1"), ("&9", "&10 &8"), ("&99", "&100 &98"), ("#0", "#1"), ("#9", "#8"), ("#F", "#E"), ("#00", "#01"),
    ("#0A", "#0B #09"), ("#FF", "#FE"), ("#0099", "#0100 #0098"), ("&FF", "&100 &FE"), ("#00ff", "#0100 #00FE"),
    # a time a scan longer or shorter
    ("T#0s", "T#10ms"), ("T#5ms", "T#15ms"), ("T#10ms", "T#20ms T#0ms"), ("TIME#1s", "TIME#1010ms TIME#990ms"),
    ("t#20MS", "t#30ms t#10ms"), ("T#1m", ""), ("TRUE", "FALSE"), ("true", "FALSE"), ("False", "TRUE"),
    ("x", ""), ("&", ""), ("+5", ""), ("D0", "")])
def test_another_value_of_a_constant(constant: str, others: str) -> None:
    assert list(rungs._values(constant)) == others.split()


@each_of("mnemonic, others", [
    ("LD", "CONTACT LDNOT"), ("LDNOT", "CONTACT LD"), ("AND", "CONTACT ANDNOT, LRO OR"), ("ORNOT", "CONTACT OR, LRO ANDNOT"),
    ("ANDLD", "LRO ORLD"), ("ORLD", "LRO ANDLD"), ("OUT", "COIL OUTNOT"), ("OUTNOT", "COIL OUT"), ("SET", "COIL OUT"),
    ("RSET", "COIL SET"), ("DIFU", "COIL DIFD"), ("DIFD", "COIL DIFU"), ("LD<", "ROR LD<=, ROR LD>="),
    ("LD<=", "ROR LD<, ROR LD>"), ("LD>", "ROR LD>=, ROR LD<="), ("LD>=", "ROR LD>, ROR LD<"), ("LD=$", "ROR LD<>$"),
    ("AND<>", "ROR AND=, LRO OR<>"), ("OR>=L", "ROR OR>L, ROR OR<L, LRO AND>=L"),
    ("+", "ARO -"), ("-L", "ARO +L"), ("*U", "ARO /U"), ("/", "ARO *"),
    ("++", "ARO --"), ("--BL", "ARO ++BL"), ("+$", ""), ("MOV", ""), ("TIM", ""), ("<", ""), ("KEEP", ""), ("END", "")])
def test_another_instruction(mnemonic: str, others: str) -> None:
    assert [" ".join(pair) for pair in rungs._others(mnemonic)] == [each for each in others.split(", ") if each]


@each_of("address, kind", [
    ("D0", "D word"), ("d100", "D word"), ("W5.03", "W bit"), ("0.01", " bit"), ("100", " word"), ("CIO0.01", " bit"),
    ("cio5", " word"), ("T0001", "T word"), ("x", ""), ("D0.1.2", ""), ("", ""), ("*D5", ""), ("#5", ""), ("E0_5", "")])
def test_addresses_of_one_area_are_of_one_kind(address: str, kind: str) -> None:
    assert rungs._kind(address) == kind


@pytest.mark.slow
def test_a_bit_of_cio_is_taken_for_another_one_however_the_area_is_written() -> None:
    assert of_rows("LD 0.01\nOUT CIO0.02") == {"CONTACT\nLDNOT 0.01", "VRO\nLD CIO0.02", "COIL\nOUTNOT CIO0.02", "VRO\nOUT 0.01"}
