"""Instructions of ladder: results and flags row by row, and arithmetic beside Python's integers."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.code.compiler import compile_text
from fbvm.plc import Plc
from fbvm.syntax.instruction_set import instruction_set

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


ROWS = """
MOV #1234 D0              |                     | 0=1234              |
MOV #0 D0                 | 0=1                 |                     | EQ
MOV #8000 D0              |                     | 0=8000              | N
MOVL #12345678 D0         |                     | 0=5678 1=1234       |
MVN D0 D1                 | 0=FFFF              | 0=FFFF              | EQ
MOVB D0 #0403 D1          | 0=0008              | 0=0008 1=0010       |
MOVB D0 #1003 D1          | 0=0008              | 0=0008              | ER
MOVD D0 #0210 D1          | 0=4321 1=FFFF       | 0=4321 1=21FF       |
MOVD D0 #0013 D1          | 0=4321              | 0=4321 1=0014       |
XFER #3 D0 D1             | 0=1 1=2 2=3 3=4     | 0=1 1=1 2=2 3=3     |
XFER #3 D1 D0             | 1=1 2=2 3=3         | 0=1 1=2 2=3 3=3     |
XFER &3 D32766 D0         | 0=1                 | 0=1                 | ER
BSET #7 D1 D3             |                     | 1=7 2=7 3=7         |
BSET #7 D3 D1             |                     |                     | ER
XCHG D0 D1                | 0=1 1=2             | 0=2 1=1             |
DIST #5 D0 D10            | 10=3                | 3=5 10=3            |
COLL D0 D10 D11           | 3=5 10=3            | 3=5 10=3 11=5       |
ASL D0                    | 0=8001              | 0=2                 | CY
ASLL D0                   | 0=8000 1=8000       | 1=1                 | CY
ASR D0                    | 0=1                 |                     | CY EQ
ROL D0                    | 0=4000              | 0=8000              | N
ROR D0                    | 0=3                 | 0=1                 | CY
RLNC D0                   | 0=8001              | 0=3                 | CY
RRNC D0                   | 0=1                 | 0=8000              | CY N
WSFT #9 D0 D2             | 0=1 1=2 2=3         | 0=9 1=1 2=2         |
SLD D0 D1                 | 0=1234 1=5678       | 0=2340 1=6781       |
SRD D0 D1                 | 0=1234 1=5678       | 0=8123 1=0567       |
++ D0                     | 0=FFFF              |                     | CY EQ
-- D0                     |                     | 0=FFFF              | CY N
++L D0                    | 0=FFFF 1=1          | 1=2                 |
++B D0                    | 0=9999              |                     | CY EQ
++B D0                    | 0=00FA              | 0=00FA              | ER
--B D0                    | 0=1000              | 0=0999              |
+ D0 D1 D2                | 0=7FFF 1=1          | 0=7FFF 1=1 2=8000   | N OF
+ D0 D1 D2                | 0=FFFF 1=1          | 0=FFFF 1=1          | CY EQ
+ D0 D1 D2                | 0=8000 1=FFFF       | 0=8000 1=FFFF 2=7FFF | CY UF
- D0 D1 D2                | 0=1 1=2             | 0=1 1=2 2=FFFF      | CY N
+B D0 D1 D2               | 0=9999 1=1          | 0=9999 1=1          | CY EQ
-B D0 D1 D2               | 0=1 1=2             | 0=1 1=2 2=9999      | CY
+B D0 D1 D2               | 0=A 1=1             | 0=A 1=1             | ER
* D0 D1 D2                | 0=FFFF 1=2          | 0=FFFF 1=2 2=FFFE 3=FFFF | N
*U D0 D1 D2               | 0=FFFF 1=FFFF       | 0=FFFF 1=FFFF 2=1 3=FFFE | N
/ D0 D1 D2                | 0=FFF9 1=2          | 0=FFF9 1=2 2=FFFD 3=FFFF | N
/ D0 D1 D2                | 0=8000 1=FFFF       | 0=8000 1=FFFF 2=8000 | N
/U D0 D1 D2               | 0=7 1=2             | 0=7 1=2 2=3 3=1     |
/U D0 D1 D2               | 0=7                 | 0=7                 | ER
*B D0 D1 D2               | 0=9999 1=9999       | 0=9999 1=9999 2=1 3=9998 |
/B D0 D1 D2               | 0=7 1=2             | 0=7 1=2 2=3 3=1     |
BIN D0 D1                 | 0=9999              | 0=9999 1=270F       |
BCD D0 D1                 | 0=270F              | 0=270F 1=9999       |
BCD D0 D1                 | 0=2710              | 0=2710              | ER
NEG D0 D1                 | 0=1                 | 0=1 1=FFFF          | N
SIGN D0 D1                | 0=8000              | 0=8000 1=8000 2=FFFF | N
ANDW D0 D1 D2             | 0=FF0F 1=0FFF       | 0=FF0F 1=0FFF 2=0F0F |
XNRW D0 D1 D2             | 0=FFFF 1=FFFF       | 0=FFFF 1=FFFF 2=FFFF | N
ORWL D0 D2 D4             | 0=1 3=8000          | 0=1 3=8000 4=1 5=8000 | N
COM D0                    | 0=FFFF              |                     | EQ
BCNT #2 D0 D2             | 0=FFFF 1=1          | 0=FFFF 1=1 2=11     |
+F D0 D2 D4               | 1=3F80 3=4000       | 1=3F80 3=4000 5=4040 |
/F D0 D2 D4               | 1=3F80              | 1=3F80 5=7F80       | OF
/F D0 D2 D4               |                     |                     | ER
FIX D0 D2                 | 1=C020              | 1=C020 2=FFFE       | N
FIX D0 D2                 | 1=4780              | 1=4780              | ER
FLT D0 D1                 | 0=FFFF              | 0=FFFF 2=BF80       | N
SETB D0 #F                |                     | 0=8000              |
RSTB D0 &0                | 0=3                 | 0=2                 |
SETB D0 &16               |                     |                     | ER
SETA D0 &14 &4            |                     | 0=C000 1=3          |
RSTA D0 &4 &8             | 0=FFFF              | 0=F00F              |
CMP D0 #5                 | 0=6                 | 0=6                 | GT
CPS D0 #5                 | 0=FFFF              | 0=FFFF              | LT
ZCP #5 #5 #9              |                     |                     | EQ
ZCP #A #5 #9              |                     |                     | GT
ZCP #5 #9 #5              |                     |                     | ER
STC                       |                     |                     | CY
"""


def words(text: str) -> dict[int, int]:
    pairs = (item.split("=") for item in text.split())
    return {int(number): int(value, 16) for number, value in pairs}


@pytest.mark.parametrize("row", [row for row in ROWS.splitlines() if row], ids=lambda row: row.split("|")[0].strip())
def test_result_and_flags(row: str) -> None:
    instruction, before, after, flags = (part.strip() for part in row.split("|"))
    assert execute(instruction, words(before)) == (words(after), set(flags.split()))


def test_nothing_is_done_with_the_condition_off() -> None:
    plc = plc_of("LD P_Off\nMOV #1 D0\n++ D1\n+ D0 D1 D2")
    plc.scan()
    assert plc.memory.words("D")[:3].tolist() == [0, 0, 0]


@pytest.mark.slow
def test_every_instruction_that_is_not_refused_compiles() -> None:
    """With operands of the kinds that it takes; those that are refused say so."""
    shown = {"b": "0.00", "w": "D0", "d": "D0", "r": "D0", "B": "W0.00", "W": "D20", "A": "D20", "t": "5", "c": "5"}
    for row in instruction_set().rows.values():
        if not row.does or row.does.startswith("."):
            continue
        lines = ["LD P_On"] * row.inputs + [f"{row.mnemonic} {' '.join(shown[kind] for kind in row.operands)}"]
        lines += ["OUT W0.00"] * (row.kind == "?")
        made = compile_text("PROGRAM Main\nLADDER\n" + "\n".join(lines) + "\nEND_LADDER\nEND_PROGRAM")
        assert made.diagnostics == [], row.mnemonic


def test_what_is_known_and_not_built_is_refused_by_name() -> None:
    made = compile_text("PROGRAM Main\nLADDER\nLD P_On\nSEND(090) D0 D1 D2\nEND_LADDER\nEND_PROGRAM")
    assert [(d.code, d.message) for d in made.diagnostics] == [
        ("S0110", "SEND is understood but not executed by this version")]


# --- beside Python --------------------------------------------------------------------------------------------------

WORD = st.one_of(st.sampled_from([0, 1, 0x7FFF, 0x8000, 0xFFFF]), st.integers(0, 0xFFFF))


def signed(word: int, bits: int = 16) -> int:
    return word - (1 << bits) if word >> bits - 1 else word


@settings(max_examples=60, deadline=None)
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


@settings(max_examples=60, deadline=None)
@given(WORD, WORD)
def test_products_and_quotients(a: int, b: int) -> None:
    after, _ = execute("* D0 D1 D2", {0: a, 1: b})
    assert after.get(2, 0) | after.get(3, 0) << 16 == signed(a) * signed(b) & 0xFFFF_FFFF
    after, flags = execute("/U D0 D1 D2", {0: a, 1: b})
    assert (after.get(2, 0), after.get(3, 0)) == (divmod(a, b) if b else (0, 0)) and ("ER" in flags) == (not b)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 9999), st.integers(0, 9999))
def test_bcd(a: int, b: int) -> None:
    before = {0: int(f"{a}", 16), 1: int(f"{b}", 16)}
    added, subtracted = execute("+B D0 D1 D2", before), execute("-B D0 D1 D2", before)
    assert added[0].get(2, 0) == int(f"{(a + b) % 10000}", 16) and ("CY" in added[1]) == (a + b > 9999)
    assert subtracted[0].get(2, 0) == int(f"{(a - b) % 10000}", 16) and ("CY" in subtracted[1]) == (a < b)


# --- timers and counters --------------------------------------------------------------------------------------------


def run_bits(rungs: str, rows: list[dict[str, bool]], shown: str) -> list[list[int]]:
    """The values of `shown` after each scan of 100 ms, with these bits written before it."""
    plc = Plc(plc_of(rungs).image, 100 * MS)
    seen = []
    for row in rows:
        for name, value in row.items():
            plc.write(name, value)
        plc.scan()
        seen.append([int(plc.read(name)) for name in shown.split()])
    return seen


def test_tim_counts_down_and_starts_again() -> None:
    rows = [{"CIO 0.00": True}, {}, {}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}]
    assert run_bits("LD 0.00\nTIM 0 #0002", rows, "T0 TF0") == [[2, 0], [1, 0], [0, 1], [0, 1], [2, 0], [2, 0]]


def test_tim_of_zero_is_over_at_once_and_a_set_value_that_is_no_bcd_is_refused() -> None:
    assert run_bits("LD 0.00\nTIM 0 #0000", [{"CIO 0.00": True}], "TF0") == [[1]]
    assert run_bits("LD 0.00\nTIM 0 #000A", [{"CIO 0.00": True}], "TF0 CF3") == [[0, 1]]


def test_timx_is_binary_and_an_interlock_resets_it() -> None:
    rows = [{"CIO 0.00": True}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}]
    assert run_bits("LD 0.00\nIL\nLD P_On\nTIMX 3 &20\nILC", rows, "T3") == [[20], [19], [20], [20]]


def test_ttim_keeps_what_has_passed() -> None:
    rows = [{"CIO 0.00": True}, {}, {"CIO 0.00": False}, {"CIO 0.00": True}, {}, {"CIO 0.01": True}]
    assert run_bits("LD 0.00\nLD 0.01\nTTIM 1 #0002", rows, "T1 TF1") == [[0, 0], [1, 0], [1, 0], [1, 0], [2, 1], [0, 0]]


def test_cnt_counts_rises_down_and_reset_comes_first() -> None:
    up = {"CIO 0.00": True}
    rows = [up, {"CIO 0.00": False}, up, {"CIO 0.00": False}, up, {"CIO 0.01": True}, {"CIO 0.01": False}]
    assert run_bits("LD 0.00\nLD 0.01\nCNT 7 #0002", rows, "C7 CNF7") == [
        [2, 0], [2, 0], [1, 0], [1, 0], [0, 1], [2, 0], [2, 0]]


def test_cntr_goes_round() -> None:
    up, down, off = {"CIO 0.00": True}, {"CIO 0.01": True}, {"CIO 0.00": False, "CIO 0.01": False}
    rows = [up, off, up, off, down, off, {**up, **down}]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nCNTR 2 #0001", rows, "C2 CNF2") == [
        [1, 0], [1, 0], [0, 1], [0, 1], [1, 1], [1, 1], [1, 1]]


def test_sft_moves_on_the_rise_of_its_clock() -> None:
    rows = [{"CIO 0.00": True, "CIO 0.01": True}, {}, {"CIO 0.01": False}, {"CIO 0.01": True}, {"CIO 0.02": True}]
    assert run_bits("LD 0.00\nLD 0.01\nLD 0.02\nSFT W0 W1", rows, "W0") == [[1], [1], [1], [3], [0]]
