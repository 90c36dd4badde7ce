"""The eight functions at small, middle and greatest quantities, against the server's tables; nothing else changes."""

from __future__ import annotations

import random
from array import array

import pytest
from mtcp_rig import Rig
from rows import each_of, first_quick

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

BITS = [1, 7, 8, 9, 15, 16, 17, 19, 255, 256, 1000, 1968]
REGISTERS = [1, 2, 3, 64, 122, 123]


def filled(seed: int, **blocks: str) -> Rig:
    """A connected rig whose server and D words (but those of the unit) hold random values."""
    rig = Rig(**blocks)  # type: ignore[arg-type]
    dice = random.Random(seed)
    rig.fill(0, array("H", dice.randbytes(60000)))
    rig.server.coils[:4096] = bytes(byte & 1 for byte in dice.randbytes(4096))
    rig.server.discrete_inputs[:4096] = bytes(byte & 1 for byte in dice.randbytes(4096))
    rig.server.holding_registers[:2048] = array("H", dice.randbytes(4096))
    rig.server.input_registers[:2048] = array("H", dice.randbytes(4096))
    return rig.connect()


def words_of(bits: bytes) -> list[int]:
    """Bit i in bit i mod 16 of word i / 16, the rest 0."""
    number = sum(bit << place for place, bit in enumerate(bits))
    return [number >> 16 * place & 0xFFFF for place in range((len(bits) + 15) // 16)]


@pytest.mark.slow
@each_of("quantity", [*BITS, 2000])
@each_of("code", ["01", "02"])
def test_bits_read(code: str, quantity: int) -> None:
    rig = filled(quantity, rd=f"Fn{code}(Coil_Address := 321, Coil_Qty := {quantity}, RespData_DM := 5000)")
    table = rig.server.coils if code == "01" else rig.server.discrete_inputs
    expected = rig.all_words()
    source = words_of(bytes(table[321 : 321 + quantity]))
    expected[5000 : 5000 + len(source)] = source
    rig.command("rd")
    assert rig.result("rd") == (1, "")
    assert rig.all_words() == expected


@pytest.mark.slow
@each_of("quantity", [*REGISTERS, 125])
@each_of("code", ["03", "04"])
def test_registers_read(code: str, quantity: int) -> None:
    rig = filled(quantity, rd=f"Fn{code}(Register_Address := 321, Register_Qty := {quantity}, RespData_DM := 5000)")
    table = rig.server.holding_registers if code == "03" else rig.server.input_registers
    expected = rig.all_words()
    expected[5000 : 5000 + quantity] = table[321 : 321 + quantity]
    rig.command("rd")
    assert rig.result("rd") == (1, "")
    assert rig.all_words() == expected


@pytest.mark.slow
@pytest.mark.parametrize("quantity", BITS)
def test_bits_written(quantity: int) -> None:
    rig = filled(quantity, wr=f"Fn0F(Coil_Address := 321, Coil_Qty := {quantity}, DataAddress_DM := 5000)")
    before, coils = rig.all_words(), bytearray(rig.server.coils)
    words = rig.words(5000, 130)
    coils[321 : 321 + quantity] = bytes(words[place // 16] >> place % 16 & 1 for place in range(quantity))
    rig.command("wr")
    assert rig.result("wr") == (1, "")
    assert (rig.server.coils, rig.all_words()) == (coils, before)


@pytest.mark.parametrize("quantity", REGISTERS)
def test_registers_written(quantity: int) -> None:
    rig = filled(quantity, wr=f"Fn10(Register_Address := 321, Register_Qty := {quantity}, DataAddress_DM := 5000)")
    before, registers = rig.all_words(), array("H", rig.server.holding_registers)
    registers[321 : 321 + quantity] = array("H", rig.words(5000, quantity))
    rig.command("wr")
    assert rig.result("wr") == (1, "")
    assert (rig.server.holding_registers, rig.all_words()) == (registers, before)


@pytest.mark.parametrize("value", [0, 1, 0x3AC5, 65535])
def test_one_register_written(value: int) -> None:
    rig = filled(value, wr=f"Fn06(Register_Address := 65535, Value := {value})")
    before = rig.all_words()
    rig.command("wr")
    assert (rig.result("wr"), rig.server.holding_registers[65535], rig.all_words()) == ((1, ""), value, before)


@pytest.mark.slow
@pytest.mark.parametrize("value", ["TRUE", "FALSE"])
def test_one_coil_written(value: str) -> None:
    rig = filled(1, wr=f"Fn05(Coil_Address := 65535, Value := {value})")
    rig.server.coils[65535] = value == "FALSE"
    before = rig.all_words()
    rig.command("wr")
    assert (rig.result("wr"), bool(rig.server.coils[65535]), rig.all_words()) == ((1, ""), value == "TRUE", before)


@pytest.mark.parametrize("code", first_quick(["01", "02", "03", "04", "05", "06", "0F", "10"]))
def test_a_block_is_enabled_as_long_as_nobody_says_otherwise(code: str) -> None:
    plc = Plc(compile_text(f"PROGRAM Main VAR fn : MTCP_ETN_Fn{code}; END_VAR fn(); END_PROGRAM").image)
    assert (plc.read("Main.fn.EN"), plc.read("Main.fn.ENO")) == (True, False)
    assert plc.scan() is None
    assert plc.read("Main.fn.ENO") is True


SHORT = [
    "Fn01(Coil_Address := 0, Coil_Qty := 19, RespData_DM := 200)",
    "Fn03(Register_Address := 0, Register_Qty := 125, RespData_DM := 200)",
    "Fn05(Coil_Address := 0, Value := TRUE)",
    "Fn06(Register_Address := 0, Value := 7)",
    "Fn0F(Coil_Address := 0, Coil_Qty := 8, DataAddress_DM := 200)",
]


@pytest.mark.parametrize("block", SHORT)
def test_a_short_request_stays_in_its_area(block: str) -> None:
    """Nobody owns D32507 to D32509, and D32643 is behind the reply's area."""
    rig = Rig(rd=block).connect()
    rig.fill(32500, [0xAAAA] * 143)
    rig.fill(32643, [0xBBBB])
    rig.command("rd")
    assert rig.result("rd") == (1, "")
    assert (rig.words(32507, 3), rig.words(32643, 1)) == ([0xAAAA] * 3, [0xBBBB])


@pytest.mark.slow
def test_the_blocks_use_no_other_memory() -> None:
    """CIO 1500-1524, D30000-30099 and the areas of the sheet."""
    rig = Rig(
        a="Fn03(Register_Address := 0, Register_Qty := 125, RespData_DM := 200)",
        b="Fn10(Register_Address := 0, Register_Qty := 123, DataAddress_DM := 200)",
    ).connect()
    rig.command("a", "b")
    cio = rig.plc.memory.words("CIO")
    assert not any(cio[:1500]) and not any(cio[1525:])
    for area in ("W", "H"):
        assert not any(rig.plc.memory.words(area))
    assert not any(rig.all_words())
