"""Where the memory of a PLC of OpenPLC lies in the four tables of its Modbus server, as sequences that read and write it.

From OpenPLC's documentation, Modbus addressing, and its runtime (v3, `modbus.cpp`): a register of 32 or 64 bits fills two or
four registers of Modbus, the highest first.  What no variable of the program is at keeps what clients write."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fbvm.units.contract import AreaMemory

BITS_PER_WORD = 16


@dataclass(frozen=True)
class Part:
    """Registers of a table, from number `first` on: an area of the PLC, each address of which fills `size` registers."""

    first: int
    count: int
    area: str
    size: int = 1


COILS, DISCRETE_INPUTS = ("%QX", 8192), ("%IX", 8192)
"""Area and number of the bits of a table."""
INPUT_REGISTERS = (Part(0, 1024, "%IW"),)
HOLDING_REGISTERS = (Part(0, 1024, "%QW"), Part(1024, 1024, "%MW"), Part(2048, 2048, "%MD", 2), Part(4096, 4096, "%ML", 4))
Kept = dict[str, dict[int, int]]
"""By area that the program does not use, what clients have written there: words, or bits, by their numbers."""


def words_of(memory: AreaMemory, area: str) -> memoryview | None:
    """The words of an area; None if the program uses none of its addresses."""
    try:
        return memory.words(area)
    except KeyError:
        return None


class Table(ABC):
    """What both kinds of tables share: numbers from 0 to `count`, one by one or in slices without a step."""

    count: int

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, place: int | slice) -> Any:
        if isinstance(place, slice):
            return [self._read(number) for number in range(*place.indices(self.count))]
        return self._read(place)

    def __setitem__(self, place: int | slice, given: Any) -> None:
        numbers = range(*place.indices(self.count)) if isinstance(place, slice) else (place,)
        values: Iterable[int] = given if isinstance(place, slice) else (given,)
        for number, value in zip(numbers, values, strict=True):
            self._write(number, int(value))

    @abstractmethod
    def _read(self, number: int) -> int:
        """What stands under a number."""

    @abstractmethod
    def _write(self, number: int, value: int) -> None:
        """Puts a value there."""


class Bits(Table):
    """The bits of an area."""

    def __init__(self, memory: AreaMemory, table: tuple[str, int], kept: Kept) -> None:
        area, self.count = table
        self._words, self._kept = words_of(memory, area), kept.setdefault(area, {})

    def _read(self, number: int) -> int:
        if self._words is None:
            return self._kept.get(number, 0)
        return self._words[number // BITS_PER_WORD] >> number % BITS_PER_WORD & 1

    def _write(self, number: int, value: int) -> None:
        if self._words is None:
            self._kept[number] = int(value != 0)
            return
        word, bit = number // BITS_PER_WORD, 1 << number % BITS_PER_WORD
        self._words[word] = self._words[word] | bit if value else self._words[word] & ~bit


class Registers(Table):
    """Registers over several areas, one behind the other."""

    def __init__(self, memory: AreaMemory, parts: Sequence[Part], kept: Kept) -> None:
        self.count = sum(part.count for part in parts)
        self._parts = [(part, words_of(memory, part.area), kept.setdefault(part.area, {})) for part in parts]

    def _place(self, number: int) -> tuple[memoryview | None, dict[int, int], int]:
        """The words of the area in which a register lies, what is kept for it without one, and the number of its word there:
        memory has the lowest word of a value first."""
        part, words, kept = next(row for row in self._parts if number < row[0].first + row[0].count)
        value, register = divmod(number - part.first, part.size)
        return words, kept, value * part.size + part.size - 1 - register

    def _read(self, number: int) -> int:
        words, kept, place = self._place(number)
        return kept.get(place, 0) if words is None else int(words[place])

    def _write(self, number: int, value: int) -> None:
        words, kept, place = self._place(number)
        if words is None:
            kept[place] = value
        else:
            words[place] = value


def numbers_of(area: str, number: int, bit: int | None) -> Iterator[tuple[str, str, range]]:
    """Under which numbers clients find an address: the table, its function codes, and the numbers in the order of the value."""
    for title, codes, (bits, count) in (("coil", "01 05 0F", COILS), ("discrete input", "02", DISCRETE_INPUTS)):
        at = 8 * number + (bit or 0)
        if area == bits and bit is not None and at < count:
            yield title, codes, range(at, at + 1)
    for title, codes, parts in (("input register", "04", INPUT_REGISTERS), ("holding register", "03 06 10", HOLDING_REGISTERS)):
        for part in parts:
            first = part.first + part.size * number
            if area == part.area and bit is None and first < part.first + part.count:
                yield title, codes, range(first, first + part.size)


def plain(kept: Mapping[str, Mapping[int, int]]) -> tuple[tuple[str, tuple[tuple[int, int], ...]], ...]:
    """What is kept, as recordings have it."""
    return tuple((area, tuple(values.items())) for area, values in kept.items())
