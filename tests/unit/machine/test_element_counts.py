"""How many elements one command of FINS reads."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from images import counter_image
from rows import each_of

from fbvm.base.memory import Memory
from fbvm.machine.servicing.commands import execute
from fbvm.machine.servicing.cpu import Machine
from fbvm.machine.servicing.elements import MOST_SEVERAL
from fbvm.machine.servicing.registers import Registers
from fbvm.units.contract import FinsAccess
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import Address, Command, Header


def answer(code: int, parameters: bytes) -> tuple[int, int]:
    """The end code, and how many bytes are answered."""
    layout = counter_image().layout
    memory = Memory(layout.size, layout.areas)
    machine = cast(Machine, SimpleNamespace(memory=memory, is_running=False))
    command = Command(Header(Address(), Address(0, 9, 0), 1), code, parameters)
    end, data, *_ = execute(machine, Registers(memory), command, FinsAccess())
    return end, len(data)


@each_of(("area", "most", "size"), ((0x82, 999, 2), (0xB0, 999, 2), (0x30, 1998, 1), (0x09, 1998, 1)))
def test_an_answer_is_as_long_as_a_frame_can_be(area: int, most: int, size: int) -> None:
    def read(count: int) -> tuple[int, int]:
        return answer(0x0101, bytes((area, 0, 0, 0)) + count.to_bytes(2, "big"))

    assert read(most) == (EndCode.NORMAL, most * size)
    assert read(most + 1) == (EndCode.RESPONSE_TOO_LONG, 0)


def test_single_elements_are_so_many_at_most() -> None:
    one = bytes((0x82, 0, 5, 0))
    assert answer(0x0104, one * MOST_SEVERAL) == (EndCode.NORMAL, 3 * MOST_SEVERAL)
    assert answer(0x0104, one * (MOST_SEVERAL + 1)) == (EndCode.TOO_LONG, 0)
    assert answer(0x0104, one + one[:3]) == (EndCode.TOO_SHORT, 0)
