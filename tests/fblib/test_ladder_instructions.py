"""Instructions of ladder: results and flags row by row, and arithmetic beside Python's integers."""

from __future__ import annotations

from array import array
from functools import cache
from pathlib import Path

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import first_quick

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set

FLAGS = {"ER": "CF3", "CY": "CF4", "GT": "CF5", "EQ": "CF6", "LT": "CF7", "N": "CF8", "OF": "CF9", "UF": "CF10"}
MS = 1_000_000


@cache
def plc_of(rungs: str) -> Plc:
    made = compile_text(f"PROGRAM Main\nLADDER\n{rungs}\nEND_LADDER\nEND_PROGRAM")
    assert made.image is not None, made.errors[0].render()
    return Plc(made.image, engine="python")


def execute(instruction: str, before: dict[int, int], carry: bool = False) -> tuple[dict[int, int], set[str]]:
    """D words from 0 to 19 that are not 0 after one execution, and the flags that are ON."""
    plc = plc_of(f"LD P_On\n{'STC' if carry else 'CLC'}\n{instruction}")
    plc.cold_start()
    plc.memory.words("D")[:20] = memoryview(bytes(40)).cast("H")
    for number, value in before.items():
        plc.memory.words("D")[number] = value
    assert plc.scan() is None
    words = plc.memory.words("D")
    return {n: words[n] for n in range(20) if words[n]}, {name for name, at in FLAGS.items() if plc.read(at)}


@pytest.mark.parametrize(("name", "operands", "holds", "order"), [
    ("=", "D0 D3", False, "GT"), ("=S", "D0 D3", False, "LT"), ("<>", "D0 D3", True, "GT"), ("<>S", "D0 D3", True, "LT"),
    ("=L", "D0 D3", False, "GT"), ("=SL", "D0 D3", False, "LT"), ("<>L", "D0 D3", True, "GT"), ("<>SL", "D0 D3", True, "LT"),
    ("=S", "D0 D0", True, "EQ"), ("<>SL", "D0 D0", False, "EQ")])  # fmt: skip
def test_equality_sets_the_flags_of_the_order_with_or_without_a_sign(name: str, operands: str, holds: bool, order: str) -> None:
    """FFFF is more than 1 without a sign, and less with one."""
    before = {0: 0xFFFF, 1: 0xFFFF, 3: 1}
    after, flags = execute(f"AND{name} {operands}\nOUT D9.00", before)
    assert after == before | ({9: 1} if holds else {})
    assert flags == {order}


RELATIONS = {"=": "EQ", "<>": "LT GT", "<": "LT", "<=": "LT EQ", ">": "GT", ">=": "GT EQ"}
"""Comparison -> the orders of its operands for which it holds."""
COMPARED = {
    "": ([1], [0xFFFF]), "S": ([0xFFFF], [1]), "L": ([0xFFFF], [0, 1]), "SL": ([0xFFFF, 0xFFFF], [1]),
    "F": ([0, 0xBFC0], [0, 0x3F80]), "D": ([0, 0, 0, 0xBFF8], [0, 0, 0, 0x3FF0]),
    "DT": ([0x1530, 0x3022, 0x2611], [0x1531, 0x3022, 0x2611]), "$": ([0x4142], [0x4143])}  # fmt: skip
"""Letters of a comparison -> a smaller and a larger operand: -1.5 and 1.0, two moments, AB and AC."""


@pytest.mark.slow
@pytest.mark.parametrize("order", ["LT", "EQ", "GT"])
def test_contacts_that_compare(order: str) -> None:
    """Operands lie at D0 and D4, D10 and D14 and so on; each word from D100 on has a bit for each relation."""
    operands = [f"{'#0 ' * (letters == 'DT')}D{10 * at} D{10 * at + 4}" for at, letters in enumerate(COMPARED)]
    plc = plc_of("\n".join(f"LD{relation}{letters} {operands[at]}\nOUT D{100 + at}.{bit:02}"
                           for at, letters in enumerate(COMPARED) for bit, relation in enumerate(RELATIONS)))
    memory = plc.memory.words("D")
    for at, (smaller, larger) in enumerate(COMPARED.values()):
        first, second = {"LT": (smaller, larger), "EQ": (smaller, smaller), "GT": (larger, smaller)}[order]
        for place, value in ((10 * at, first), (10 * at + 4, second)):
            memory[place:place + 4] = memoryview(array("H", [*value, 0, 0, 0, 0][:4]))
    assert plc.scan() is None
    holds = sum(1 << bit for bit, orders in enumerate(RELATIONS.values()) if order in orders.split())
    assert dict(zip(COMPARED, memory[100:108], strict=True)) == dict.fromkeys(COMPARED, holds)


MOMENTS = """
0 0102 0304 0506 | 0102 0304 0506 | EQ
0 0102 0304 0506 | 0103 0304 0506 | LT
1 0102 0304 0506 | 0103 0304 0506 | EQ
0 0102 0304 0506 | 0201 0304 0506 | LT
2 0102 0304 0506 | 0201 0304 0506 | GT
0 0201 0304 0506 | 0101 0305 0506 | LT
4 0201 0304 0506 | 0101 0305 0506 | GT
0 0000 0305 0506 | 0000 0404 0506 | LT
8 0000 0305 0506 | 0000 0404 0506 | GT
0 0000 0404 0506 | 0000 0304 0507 | LT
10 0000 0404 0506 | 0000 0304 0507 | GT
0 0000 0404 0507 | 0000 0404 0606 | LT
20 0000 0404 0507 | 0000 0404 0606 | GT
3F 0001 0404 0507 | 0000 0505 0606 | EQ
40 0000 0000 0000 | 0000 0000 0000 | ER
0 0000 0000 9801 | 0000 0000 0001 | LT
0 0000 0000 9801 | 0000 0000 9901 | LT
0 0000 0000 9801 | 0000 0000 9701 | LT
0 0000 0000 9901 | 0000 0000 0001 | LT
0 0000 0000 0001 | 0000 0000 9701 | LT
0 0000 0000 0001 | 0000 0000 9801 | GT
0 0000 0000 0001 | 0000 0000 9901 | GT
0 0000 0000 9701 | 0000 0000 9801 | GT
0 0000 0000 9901 | 0000 0000 9801 | GT
0 010A 0000 0000 | 0009 0000 0000 | ER
0 0009 0000 0000 | 0A00 0000 0000 | ER
0 0000 0000 0A00 | 0000 0000 0000 | ER
0 0000 0000 0000 | 0000 0000 000A | ER
"""
"""What is left out; minute and second, day and hour, year and month; the same of the second operand; their order."""
LETTERS = """
4142 | 4142 | EQ
4142 | 4143 | LT
4200 | 4143 | GT
4241 | 4142 | GT
4142 | 4241 | LT
4100 | 4142 | LT
4142 4300 | 4142 | GT
0000 | 0000 | EQ
"""


def compared(letters: str, operands: str, before: dict[int, int]) -> tuple[set[str], set[str]]:
    """Which relations hold, and the flags."""
    rungs = [f"LD{relation}{letters} {operands}\nOUT D19.{bit:02}" for bit, relation in enumerate(RELATIONS)]
    after, flags = execute("\n".join(rungs), before)
    return {relation for bit, relation in enumerate(RELATIONS) if after.get(19, 0) >> bit & 1}, flags


def holding(order: str) -> tuple[set[str], set[str]]:
    return {relation for relation, orders in RELATIONS.items() if order in orders.split()}, {order}


@pytest.mark.slow
@pytest.mark.parametrize(("letters", "operands", "table"), [("DT", "D8 D0 D4", MOMENTS), ("$", "D0 D4", LETTERS)])
def test_the_order_of_moments_and_texts(letters: str, operands: str, table: str) -> None:
    """An operand that is no moment sets P_ER, and no relation holds; years 98 and 99 lie before 00."""
    for row in table.split("\n")[1:-1]:
        first, second, order = row.split(" | ")
        mask, *moment = [int(word, 16) for word in (first if letters == "DT" else f"0 {first}").split()]
        before = {8: mask} | dict(enumerate(moment)) | {4 + at: int(word, 16) for at, word in enumerate(second.split())}
        before |= {3: 9} if letters == "DT" else {}
        assert compared(letters, operands, before) == holding(order), row


@pytest.mark.slow
@pytest.mark.parametrize(("letters", "place", "words_there", "order"), [
    ("DT #0", 32765, [0x102, 0x304, 0x506], "EQ"), ("DT #0", 32766, [0x304, 0x506], "ER"), ("$", 32767, [0x4100], "EQ"),
    ("$", 32767, [0x4141], "ER")])  # fmt: skip
def test_moments_and_texts_at_the_end_of_an_area(letters: str, place: int, words_there: list[int], order: str) -> None:
    """A text without 0 up to the end is none."""
    name, *mask = letters.split()
    given = dict(enumerate(words_there))
    before = (given if order == "EQ" else {}) | {place + at: word for at, word in given.items()}
    for one, other in ((0, place), (place, 0)):
        assert compared(name, " ".join([*mask, f"D{one}", f"D{other}"]), before) == holding(order)


CARRY = "\nSTC"
"""In front of an instruction whose row has CY before it."""
TABLES = sorted((Path(__file__).parent / "ladder").glob("*.txt"))


def words(text: str) -> dict[int, int]:
    pairs = (item.split("=") for item in text.split() if "=" in item)
    return {int(number): int(value, 16) for number, value in pairs}


def lines(instructions: str) -> str:
    """What stands in a row, with instructions that follow one another."""
    return instructions.strip().replace(" ; ", "\n")


@pytest.mark.slow
@pytest.mark.parametrize("table", first_quick(TABLES), ids=lambda table: table.stem)
def test_results_and_flags(table: Path) -> None:
    """Each row is a rung of one program, and each scan executes one of them."""
    rows = [row.split("|") for row in table.read_text(encoding="utf-8").splitlines() if row and not row.startswith("#")]
    plc = plc_of("\n".join(f"LD W{n // 16}.{n % 16:02}{CARRY * ('CY' in row[1])}\n{lines(row[0])}"
                           for n, row in enumerate(rows)))
    memory, wrong = plc.memory, []
    for number, (instruction, before, after, flags) in enumerate(rows):
        memory.words("D")[:20] = memoryview(bytes(40)).cast("H")
        for number_of_word, value in words(before).items():
            memory.words("D")[number_of_word] = value
        memory.words("W")[number // 16] = 1 << number % 16
        trap = plc.scan()
        memory.words("W")[number // 16] = 0
        assert trap is None, instruction
        left = {at: value for at, value in enumerate(memory.words("D")[:20]) if value}
        seen = left, {name for name, at in FLAGS.items() if plc.read(at)}
        if seen != (words(after), set(flags.split())):
            wrong.append((instruction.strip(), seen))
    assert wrong == []


BEFORE = {"CMP #1 #1": "GE LE EQ", "CMP #1 #2": "NE LE LT", "CMP #2 #1": "GE NE GT", "MOV #8000 D0": "N", "STC": "CY",
          "+ #7FFF #1 D0": "N OF", "+ #8000 #8000 D0": "CY EQ UF", "/ #1 #0 D0": "ER"}  # fmt: skip
"""Instruction -> the flags that are ON behind it."""


@pytest.mark.slow
@pytest.mark.parametrize("instruction", BEFORE)
def test_flags_are_off_when_a_program_begins(instruction: str) -> None:
    """Whatever the cycle before has left: W473 p6-43."""
    names = ["GE", "NE", "LE", *FLAGS]
    read = "\n".join(f"LD P_{name}\nOUT {{}}.{bit:02}" for bit, name in enumerate(names))
    plc = plc_of(f"{read.replace('{}', 'W0')}\nLD P_On\n{instruction}\n{read.replace('{}', 'W1')}")
    for _ in range(2):
        assert plc.scan() is None
        seen = [{name for bit, name in enumerate(names) if int(plc.read(word)) >> bit & 1} for word in ("W0", "W1")]
        assert seen == [set(), set(BEFORE[instruction].split())]


@pytest.mark.slow
def test_words_of_a_variable_without_an_address() -> None:
    """A stack needs addresses; XFER holds 32768 words at most."""
    for instruction, wrong in (("SSET own #5", True), ("XFER #8000 own own", False), ("XFER #8001 own own", True)):
        made = compile_text(f"PROGRAM Main\nVAR own : ARRAY[0..39999] OF WORD; END_VAR\nLADDER\nLD P_On\n{instruction}\n"
                            "END_LADDER\nEND_PROGRAM")  # fmt: skip
        assert made.image is not None, made.errors[0].render()
        plc = Plc(made.image)
        assert plc.scan() is None
        assert plc.read("CF3") is wrong, instruction


@pytest.mark.slow
def test_messages() -> None:
    """Up to 32 characters, up to the first 0 or the end of the area."""
    plc = plc_of("LD P_On\nMSG D0 D10\nMSG #7 D32767\nMSG #0 D30")
    for at, text in ((10, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghij"), (32767, "XY"), (30, "odd\0")):
        for word in range(len(text) // 2):
            plc.write(f"D{at + word}", ord(text[2 * word]) << 8 | ord(text[2 * word + 1]))
    plc.write("D0", 5)
    assert plc.scan() is None
    assert [plc.read(f"CX_Message[{number}]") for number in (0, 5, 6, 7)] == ["odd", "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdef", "", "XY"]


@pytest.mark.slow
def test_four_words_for_a_subroutine_and_back() -> None:
    """At the end of an area, too; with fewer words there it is an error."""
    rungs = ("LD 0.00\nMCRO 3 D0 D32764\nLD 0.01\nMCRO 3 D32764 D4\nLD 0.02\nMCRO 3 D0 D32765\nLD P_ER\nOUT W0.00\n"
             "SBN 3\nLD P_On\nMOV A600 A607\nMOV A601 A606\nMOV A602 A605\n"
             "MOV A603 A604\nRET\nEND")  # fmt: skip
    plc = plc_of(rungs)
    for word in range(4):
        plc.write(f"D{word}", word + 1)
    for bit, wrong in (("CIO 0.00", 0), ("CIO 0.01", 0), ("CIO 0.02", 1)):
        plc.write(bit, True)
        assert plc.scan() is None
        plc.write(bit, False)
        assert plc.read("W0") == wrong, bit
        assert [plc.read(f"D{at}") for at in (32764, 32765, 32766, 32767)] == [4, 3, 2, 1]
    assert [plc.read(f"D{at}") for at in range(4, 9)] == [1, 2, 3, 4, 0]


@pytest.mark.slow
def test_fals_stops_the_program() -> None:
    plc = Plc(plc_of("LD 0.00\nFALS 511 #0\nLD P_On\nFALS 1 #0").image, engine="python")
    trap = plc.scan()
    assert trap is not None and trap.code == "R0120"
    assert (plc.read("A400"), plc.read("A401.06")) == (0xC101, True)
    plc = Plc(plc_of("LD 0.00\nFALS 511 #0\nLD P_On\nOUT W0.00").image, engine="python")
    assert plc.scan() is None and plc.read("A401.06") is False
    plc.write("CIO 0.00", True)
    assert plc.scan() is not None
    assert (plc.read("A400"), plc.read("A401.06")) == (0xC2FF, True)


@pytest.mark.slow
def test_nothing_is_done_with_the_condition_off() -> None:
    plc = plc_of("LD P_Off\nMOV #1 D0\n++ D1\n+ D0 D1 D2")
    plc.scan()
    assert plc.memory.words("D")[:3].tolist() == [0, 0, 0]


@pytest.mark.slow
def test_every_instruction_that_is_not_refused_compiles() -> None:
    """With operands of the kinds that it takes."""
    shown = {**dict.fromkeys("wzZdrlak", "D0"), "b": "0.00", "B": "W0.00", "W": "D20", "A": "D20", "t": "5", "c": "5"}
    rungs = []
    for row in instruction_set().rows.values():
        if row.does and not row.does.startswith("."):
            rungs += ["RUNG", *["LD P_On"] * row.inputs, f"{row.mnemonic} {' '.join(shown[kind] for kind in row.operands)}"]
            rungs += ["OUT W0.00"] * (row.kind == "?")
    made = compile_text("PROGRAM Main\nLADDER\n" + "\n".join(rungs) + "\nEND_LADDER\nEND_PROGRAM", no_warn=("S0596", "S0693"))
    assert made.diagnostics == []


def test_every_instruction_has_a_row() -> None:
    """Of its result and flags; blocks and what the front end does have tests of their own."""
    tested = {row.split("|")[0].split()[0] for table in TABLES for row in table.read_text(encoding="utf-8").splitlines()}
    executed = {name for name, row in instruction_set().rows.items() if row.does.startswith("CX_") and not row.kind}
    assert executed - tested - {"MSG", "CCS", "CCL"} == set()


def test_what_is_known_and_not_built_is_refused_by_name() -> None:
    made = compile_text("PROGRAM Main\nLADDER\nLD P_On\nPMCR(260) #0 #0 D0 D1\nEND_LADDER\nEND_PROGRAM")
    assert [(d.code, d.message) for d in made.diagnostics] == [
        ("S0110", "PMCR is understood and not executed")]
    assert "no serial line" in made.diagnostics[0].hint


# --- beside Python --------------------------------------------------------------------------------------------------

WORD = st.one_of(st.sampled_from([0, 1, 0x7FFF, 0x8000, 0xFFFF]), st.integers(0, 0xFFFF))


def signed(word: int, bits: int = 16) -> int:
    return word - (1 << bits) if word >> bits - 1 else word


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(WORD, WORD, st.booleans())
def test_sums_and_differences(a: int, b: int, carry: bool) -> None:
    for sign, extra in (("+", 0), ("-", 0), ("+C", carry), ("-C", carry)):
        after, flags = execute(f"{sign} D0 D1 D2", {0: a, 1: b}, carry)
        true = a + b + extra if sign[0] == "+" else a - b - extra
        span = signed(a) + signed(b) + extra if sign[0] == "+" else signed(a) - signed(b) - extra
        result = true & 0xFFFF
        wanted = {name for name, on in {"CY": not 0 <= true <= 0xFFFF, "EQ": not result, "N": result >> 15,
                                        "OF": span > 32767, "UF": span < -32768}.items() if on}  # fmt: skip
        assert (after.get(2, 0), flags) == (result, wanted), sign


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(WORD, WORD)
def test_products_and_quotients(a: int, b: int) -> None:
    after, _ = execute("* D0 D1 D2", {0: a, 1: b})
    assert after.get(2, 0) | after.get(3, 0) << 16 == signed(a) * signed(b) & 0xFFFF_FFFF
    after, flags = execute("/U D0 D1 D2", {0: a, 1: b})
    assert (after.get(2, 0), after.get(3, 0)) == (divmod(a, b) if b else (0, 0)) and ("ER" in flags) == (not b)


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(st.integers(0, 9999), st.integers(0, 9999))
def test_bcd(a: int, b: int) -> None:
    before = {0: int(f"{a}", 16), 1: int(f"{b}", 16)}
    added, subtracted = execute("+B D0 D1 D2", before), execute("-B D0 D1 D2", before)
    assert added[0].get(2, 0) == int(f"{(a + b) % 10000}", 16) and ("CY" in added[1]) == (a + b > 9999)
    assert subtracted[0].get(2, 0) == int(f"{(a - b) % 10000}", 16) and ("CY" in subtracted[1]) == (a < b)
