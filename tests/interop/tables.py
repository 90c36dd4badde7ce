"""What all servers of these tests hold: values that tell their place.  The same as `fbvm peer` serves."""

from __future__ import annotations

COUNT = 65536
COILS = bytes(number % 2 == 0 for number in range(COUNT))
DISCRETE_INPUTS = bytes(number % 3 == 0 for number in range(COUNT))
HOLDING_REGISTERS = [1000 + number & 0xFFFF for number in range(COUNT)]
INPUT_REGISTERS = [2000 + number & 0xFFFF for number in range(COUNT)]
