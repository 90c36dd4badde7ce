"""DATE(735): the program sets the PLC's clock, by a variable that servicing looks at (fblib/omron/ladder/CX_Clock.st)."""

from __future__ import annotations

from fbvm.base.memory import Memory
from fbvm.base.types import fold
from fbvm.code.image import Image
from fbvm.machine.servicing.registers import Registers
from fbvm.processor.contract import Contract

SETTING = "CX_Clock_Setting"


class ClockSetting:
    """The variable of one PLC whose program has DATE."""

    def __init__(self, image: Image, memory: Memory) -> None:
        self._words, self._at = memory.views["i64"], Contract(image).offset(SETTING) // 8

    def serve(self, registers: Registers, now_ns: int) -> bool:
        """Sets the clock if the program has asked for it.  Returns True if it did."""
        asked = int(self._words[self._at])
        if not asked:
            return False
        registers.clock_ns, self._words[self._at] = asked - 1 - now_ns, 0
        return True


def clock_setting_of(image: Image, memory: Memory) -> ClockSetting | None:
    """The variable of a program; None if it has no DATE."""
    return ClockSetting(image, memory) if fold(SETTING) in image.symbols else None
