"""Shifts, arithmetic and conversions of ladder beside Python's integers: all instructions in one scan, over random words."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import isqrt

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from test_ladder_instructions import plc_of

from fbvm.machine.plc import Plc

pytestmark = pytest.mark.slow
WORD = st.one_of(st.sampled_from([0, 1, 0x7FFF, 0x8000, 0xFFFF]), st.integers(0, 0xFFFF))
TWO = st.one_of(st.sampled_from([0, 1, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF]), st.integers(0, 0xFFFF_FFFF))
ROOM = 8
"""Words that each instruction has for its result, from D100 on."""
Model = Callable[[int, int, int], "tuple[int, int | None]"]
"""From the operands and the carry to the result, of all words as one number, and the carry; None where it stays."""


def signed(number: int, bits: int) -> int:
    return number - (1 << bits) if number >> bits - 1 else number


def low(number: int, bits: int) -> int:
    return number & (1 << bits) - 1


def left(bits: int, enters: Callable[[int, int], int]) -> Model:
    return lambda a, b, carry: (low(a << 1, bits) | enters(a, carry), a >> bits - 1)


def right(bits: int, enters: Callable[[int, int], int]) -> Model:
    return lambda a, b, carry: (a >> 1 | enters(a, carry) << bits - 1, a & 1)


def shifted(bits: int, up: bool) -> Model:
    """NASL and its like; b has how many bits and what enters."""
    def model(a: int, b: int, carry: int) -> tuple[int, int | None]:
        count, fills = b & 0xFF, b >> 15
        if up:
            filled = low(-(a & fills & 1), count)
            return low(a << count, bits) | filled, a >> bits - count & 1 if count else 0
        filled = low(-(a >> bits - 1 & fills), count) << bits - count
        return a >> count | filled, a >> count - 1 & 1 if count else 0
    return model


def summed(bits: int, sign: int, carried: bool) -> Model:
    def model(a: int, b: int, carry: int) -> tuple[int, int | None]:
        true = a + sign * (b + carry * carried)
        return low(true, bits), int(not 0 <= true < 1 << bits)
    return model


def divided(bits: int) -> Model:
    """Toward 0, the remainder behind the quotient."""
    def model(a: int, b: int, carry: int) -> tuple[int, int | None]:
        x, y = signed(a, bits), signed(b, bits)
        quotient = abs(x) // abs(y) * (1 if (x < 0) == (y < 0) else -1)
        return low(quotient, bits) | low(x - quotient * y, bits) << bits, None
    return model


IN_PLACE: dict[str, tuple[int, Model]] = {
    "ASL": (16, left(16, lambda a, c: 0)), "ASLL": (32, left(32, lambda a, c: 0)),
    "ASR": (16, right(16, lambda a, c: 0)), "ASRL": (32, right(32, lambda a, c: 0)),
    "ROL": (16, left(16, lambda a, c: c)), "ROLL": (32, left(32, lambda a, c: c)),
    "ROR": (16, right(16, lambda a, c: c)), "RORL": (32, right(32, lambda a, c: c)),
    "RLNC": (16, left(16, lambda a, c: a >> 15)), "RLNL": (32, left(32, lambda a, c: a >> 31)),
    "RRNC": (16, right(16, lambda a, c: a & 1)), "RRNL": (32, right(32, lambda a, c: a & 1)),
    "++": (16, lambda a, b, c: (low(a + 1, 16), int(a == 0xFFFF))),
    "++L": (32, lambda a, b, c: (low(a + 1, 32), int(a + 1 >> 32))),
    "--": (16, lambda a, b, c: (low(a - 1, 16), int(a == 0))), "--L": (32, lambda a, b, c: (low(a - 1, 32), int(a == 0))),
    "COM": (16, lambda a, b, c: (a ^ 0xFFFF, None)), "COML": (32, lambda a, b, c: (a ^ 0xFFFF_FFFF, None)),
    "SWAP #1": (16, lambda a, b, c: (a >> 8 | low(a, 8) << 8, None))}  # fmt: skip
COUNTED: dict[str, tuple[int, Model]] = {
    "NASL": (16, shifted(16, True)), "NSLL": (32, shifted(32, True)), "NASR": (16, shifted(16, False)),
    "NSRL": (32, shifted(32, False))}
TWO_OPERANDS: dict[str, tuple[int, Model]] = {
    "+": (16, summed(16, 1, False)), "+C": (16, summed(16, 1, True)), "-": (16, summed(16, -1, False)),
    "-C": (16, summed(16, -1, True)), "+L": (32, summed(32, 1, False)), "+CL": (32, summed(32, 1, True)),
    "-L": (32, summed(32, -1, False)), "-CL": (32, summed(32, -1, True)), "/": (16, divided(16)), "/L": (32, divided(32)),
    "*": (16, lambda a, b, c: (low(signed(a, 16) * signed(b, 16), 32), None)), "*U": (16, lambda a, b, c: (a * b, None)),
    "*L": (32, lambda a, b, c: (low(signed(a, 32) * signed(b, 32), 64), None)), "*UL": (32, lambda a, b, c: (a * b, None)),
    "/U": (16, lambda a, b, c: (a // b | a % b << 16, None)), "/UL": (32, lambda a, b, c: (a // b | a % b << 32, None)),
    "ANDW": (16, lambda a, b, c: (a & b, None)), "ANDL": (32, lambda a, b, c: (a & b, None)),
    "ORW": (16, lambda a, b, c: (a | b, None)), "ORWL": (32, lambda a, b, c: (a | b, None)),
    "XORW": (16, lambda a, b, c: (a ^ b, None)), "XORL": (32, lambda a, b, c: (a ^ b, None)),
    "XNRW": (16, lambda a, b, c: (a ^ b ^ 0xFFFF, None)), "XNRL": (32, lambda a, b, c: (a ^ b ^ 0xFFFF_FFFF, None))}  # fmt: skip
ONE_OPERAND: dict[str, tuple[int, Model]] = {
    "MVN": (16, lambda a, b, c: (a ^ 0xFFFF, None)), "MVNL": (32, lambda a, b, c: (a ^ 0xFFFF_FFFF, None)),
    "NEG": (16, lambda a, b, c: (low(-a, 16), None)), "NEGL": (32, lambda a, b, c: (low(-a, 32), None)),
    "SIGN": (16, lambda a, b, c: (low(signed(a, 16), 32), None)),
    "ROTB": (32, lambda a, b, c: (isqrt(min(a, 0x3FFF_FFFF)), None))}


def run(rungs: list[str], carry: bool, before: dict[int, int]) -> Plc:
    """One scan of these instructions, each with this carry and followed by its carry in a bit of W."""
    lines = []
    for number, rung in enumerate(rungs):
        lines += ["LD P_On", "STC" if carry else "CLC", rung, "LD P_CY", f"OUT W{number // 16}.{number % 16:02}"]
    plc = machine("\n".join(lines))
    plc.cold_start()
    memory = plc.memory.words("D")
    for at, value in before.items():
        memory[at], memory[at + 1] = value & 0xFFFF, value >> 16
    assert plc.scan() is None
    return plc


@cache
def machine(rungs: str) -> Plc:
    return plc_of(rungs)


def compare(table: dict[str, tuple[int, Model]], form: str, carry: bool, a: int, b: int) -> None:
    """`form` is how an instruction is written, with r for its result; D0 has 16 bits of a, D2 32, D4 and D6 of b."""
    rungs = []
    for number, (name, (bits, _)) in enumerate(table.items()):
        a_at, b_at = ("D0", "D4") if bits == 16 else ("D2", "D6")
        rungs.append(form.format(name=name, a=a_at, b=b_at, r=f"D{100 + ROOM * number}"))
    plc = run(rungs, carry, {0: a & 0xFFFF, 2: a, 4: b & 0xFFFF, 6: b})
    words, flags = plc.memory.words("D"), plc.memory.words("W")
    for number, (name, (bits, model)) in enumerate(table.items()):
        result, out = model(low(a, bits), low(b, bits), int(carry))
        at = 100 + ROOM * number
        seen = sum(words[at + word] << 16 * word for word in range(4))
        assert seen == result, (name, hex(a), hex(b))
        seen_carry = flags[number // 16] >> number % 16 & 1
        assert seen_carry == (int(carry) if out is None else out), (name, hex(a), hex(b), "carry")


@settings(max_examples=times(40), deadline=None)
@given(TWO, st.booleans())
def test_what_works_on_a_word_in_its_place(a: int, carry: bool) -> None:
    compare(IN_PLACE, "MOVL D2 {r}\n{name} {r}", carry, a, 0) if a >> 16 == 0 else None
    wide = {name: row for name, row in IN_PLACE.items() if row[0] == 32}
    compare(wide, "MOVL D2 {r}\n{name} {r}", carry, a, 0)


@settings(max_examples=times(60), deadline=None)
@given(TWO, st.integers(0, 16), st.booleans())
def test_shifts_by_a_number_of_bits(a: int, count: int, fills: bool) -> None:
    compare({n: row for n, row in COUNTED.items() if row[0] == 32}, "MOVL D2 {r}\n{name} {r} D6", False, a, count | fills << 15)
    compare({n: row for n, row in COUNTED.items() if row[0] == 16}, "MOV D0 {r}\n{name} {r} D4", False, a, count | fills << 15)


@settings(max_examples=times(60), deadline=None)
@given(TWO, TWO, st.booleans())
def test_two_operands(a: int, b: int, carry: bool) -> None:
    b = b if b & 0xFFFF else b | 1
    compare(TWO_OPERANDS, "{name} {a} {b} {r}", carry, a, b)


@settings(max_examples=times(60), deadline=None)
@given(TWO)
def test_one_operand(a: int) -> None:
    compare(ONE_OPERAND, "{name} {a} {r}", False, a, 0)


@settings(max_examples=times(60), deadline=None)
@given(st.integers(0, 99_999_999), st.integers(0, 99_999_999))
def test_bcd_of_eight_digits(a: int, b: int) -> None:
    rungs = ["BINL D0 D100", "BCDL D100 D108", "+BL D0 D2 D116", "-BL D0 D2 D124", "*BL D0 D2 D132", "ROOT D0 D140",
             "MOVL D0 D148\n++BL D148", "MOVL D0 D156\n--BL D156"]  # fmt: skip
    plc = run(rungs, False, {0: int(f"{a}", 16), 2: int(f"{b}", 16)})
    words = plc.memory.words("D")
    seen = [sum(words[at + word] << 16 * word for word in range(4)) for at in range(100, 164, ROOM)]
    top = 100_000_000
    decimal = [(a + b) % top, (a - b) % top, a * b, isqrt(a), (a + 1) % top, (a - 1) % top]
    assert seen == [a, int(f"{a}", 16), *(int(f"{number}", 16) for number in decimal)]


RANGES = [(-999, 999), (-7999, 7999), (-999, 9999), (-1999, 9999)]


@settings(max_examples=times(60), deadline=None)
@given(st.integers(-8100, 10100), st.integers(-80_000_100, 100_000_100))
def test_signed_bcd_and_back(word: int, two: int) -> None:
    rungs = []
    for form in range(4):
        rungs += [f"BCDS #{form} D0 D{100 + form}\nBINS #{form} D{100 + form} D{110 + form}",
                  f"BDSL #{form} D2 D{120 + 2 * form}\nBISL #{form} D{120 + 2 * form} D{140 + 2 * form}"]
    words = run(rungs, False, {0: word & 0xFFFF, 2: two & 0xFFFF_FFFF}).memory.words("D")
    for form, (least, most) in enumerate(RANGES):
        back = signed(words[110 + form], 16)
        assert back == (word if least <= word <= most else 0), form
        wide = signed(words[140 + 2 * form] | words[141 + 2 * form] << 16, 32)
        fits = least * 10_000 - 9_999 <= two <= most * 10_000 + 9_999
        assert wide == (two if fits else 0), form


@settings(max_examples=times(40), deadline=None)
@given(WORD, st.integers(0, 3))
def test_decoding_and_encoding_undo_each_other(word: int, first: int) -> None:
    rungs = [f"MLPX D0 #003{first} D100\nDMPX D100 D110 #003{first}", "MLPX D0 #1010 D120\nDMPX D120 D160 #1010",
             f"ASC D0 #003{first} D170\nHEX D170 #003{first} D180", f"ASC D0 #213{first} D190\nHEX D190 #213{first} D200"]
    words = run(rungs, False, {0: word}).memory.words("D")
    assert [words[at] for at in (110, 160, 180, 200)] == [word] * 4
    assert [words[100 + at].bit_count() for at in range(4)] == [1] * 4


@settings(max_examples=times(40), deadline=None)
@given(st.lists(WORD, min_size=3, max_size=3), st.integers(0, 15), st.integers(0, 30), st.booleans())
def test_shifts_over_several_words(given_words: list[int], first: int, count: int, bit: bool) -> None:
    whole = sum(word << 16 * at for at, word in enumerate(given_words))
    control = 0x4000 | bit << 13
    rungs = [f"XFER #3 D0 D100\nSFTR #{control | 0x1000:04X} D100 D102", f"XFER #3 D0 D108\nSFTR #{control:04X} D108 D110",
             f"XFER #3 D0 D116\nNSFL D116 &{first} &{count}", f"XFER #3 D0 D124\nNSFR D124 &{first} &{count}",
             "XFER #3 D0 D132\nSLD D132 D134", "XFER #3 D0 D140\nSRD D140 D142"]
    plc = run(rungs, False, dict(enumerate(given_words)))
    words, carries = plc.memory.words("D"), plc.memory.words("W")[0]
    seen = [sum(words[at + word] << 16 * word for word in range(3)) for at in range(100, 148, ROOM)]
    part, mask = whole >> first & (1 << count) - 1, (1 << count) - 1 << first
    up, down = low(part << 1, count), part >> 1
    assert seen == [low(whole << 1, 48) | bit, whole >> 1 | bit << 47, whole & ~mask | up << first,
                    whole & ~mask | down << first, low(whole << 4, 48), whole >> 4]
    assert [carries >> at & 1 for at in range(4)] == [whole >> 47, whole & 1, part >> count - 1 if count else 0, part & 1]
