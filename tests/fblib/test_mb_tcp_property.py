"""MB_TCP_SERVER under any requests and any cut of them, beside our own Modbus server as the model."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mb_tcp_rig import Rig

from fbvm.wire.link import Send
from fbvm.wire.modbus import Adu, Splitter
from fbvm.wire.modbus_server import ModbusServer

COILS, INPUTS, HOLDING, REGISTERS = 100, 80, 200, 200
SERVED = (1, 2, 3, 4, 5, 6, 15, 16)
COMMON = settings(max_examples=times(15), deadline=None, suppress_health_check=[HealthCheck.too_slow])


def request(dice: Random) -> bytes:
    """A PDU that is mostly right."""
    code = dice.choice((*SERVED, dice.randrange(256)))
    first, count = dice.choice((dice.randrange(60), dice.randrange(220))), dice.choice((1, 2, 7, 8, 9, 17, 40))
    pdu = bytes((code,)) + first.to_bytes(2, "big")
    if code == 5:
        pdu += dice.choice((b"\xff\0", b"\0\0", b"\0\1"))
    elif code == 6:
        pdu += dice.randbytes(2)
    elif code in (15, 16):
        size = (count + 7) // 8 if code == 15 else 2 * count
        pdu += count.to_bytes(2, "big") + bytes((size,)) + dice.randbytes(size)
    else:
        pdu += count.to_bytes(2, "big")
    return pdu if dice.random() < 0.9 else pdu[: dice.randrange(1, len(pdu) + 1)]


@pytest.mark.slow
@COMMON
@given(st.integers(0, 2**32), st.integers(1, 60))
def test_as_the_model_answers(seed: int, cut: int) -> None:
    dice = Random(seed)
    rig, model = Rig(), ModbusServer(
        coils=COILS, discrete_inputs=INPUTS, holding_registers=HOLDING, input_registers=REGISTERS, functions=SERVED)  # fmt: skip
    for number in range(INPUTS // 8):
        value = dice.randrange(256)
        rig.set(f"inputs[{number}]", value)
        model.discrete_inputs[8 * number : 8 * number + 8] = bytes(value >> bit & 1 for bit in range(8))
    for number in range(REGISTERS):
        model.input_registers[number] = dice.randrange(65536)
        rig.set(f"registers[{number}]", model.input_registers[number])
    client = rig.client().connect()
    frames = [Adu(number, dice.randrange(256), request(dice)) for number in range(12)]
    stream = b"".join(frame.to_bytes() for frame in frames)
    for start in range(0, len(stream), cut):
        client.submit(Send(1, stream[start : start + cut]))
        client.step()
    client.step(30)
    replies = [found for found in Splitter().feed(client.data) if isinstance(found, Adu)]
    assert replies == [Adu(frame.transaction, frame.unit, model.answer_pdu(frame.pdu)) for frame in frames]
    assert [rig.get(f"coils[{number}]") for number in range(COILS)] == [bool(bit) for bit in model.coils]
    assert [rig.get(f"holding[{number}]") for number in range(HOLDING)] == list(model.holding_registers)


@pytest.mark.slow
@COMMON
@given(st.binary(max_size=600), st.integers(1, 100))
def test_any_bytes_leave_it_serving(data: bytes, cut: int) -> None:
    rig = Rig()
    client = rig.client().connect()
    for start in range(0, len(data), cut):
        client.submit(Send(1, data[start : start + cut]))
        client.step()
    client.step(5)
    assert client.connect().ask("03 0000 0001")[:5] == "03 02"
