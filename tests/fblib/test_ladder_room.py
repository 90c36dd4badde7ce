"""Operands of several words at the end of DM: the last place where all of their words lie in it, and the one behind."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_ladder_instructions import CARRY, FLAGS, plc_of, words

ROWS = [[cell.strip() for cell in row.split("|")]
        for row in (Path(__file__).parent / "ladder_room.txt").read_text(encoding="utf-8").splitlines()[1:]]
END = 32768
"""The number of words of DM."""
PARTS = 4


def moved(instruction: str, operand: str, which: int, at: int) -> str:
    """The instruction with its operand of that number at another place."""
    parts = instruction.split()
    assert parts[which] == operand
    parts[which] = f"D{at}"
    return " ".join(parts)


def cases(rows: list[list[str]]) -> list[tuple[str, dict[int, int], bool]]:
    """An instruction that has no room, or just enough, the words of DM before it, and whether it has none.

    What stands at the operand stands at its new place, too, as far as DM reaches."""
    made = []
    for instruction, before, rooms in rows:
        for room in dict.fromkeys(rooms.split()):
            operand, _, count = room.partition("=")
            for which in (n for n, part in enumerate(instruction.split()) if n and part == operand):
                for missing in (0, 1):
                    first = END - int(count) + missing
                    there = {first + number - int(operand[1:]): word for number, word in words(before).items()
                             if 0 <= number - int(operand[1:]) < END - first}  # fmt: skip
                    text = CARRY.strip() * ("CY" in before) + "\n" + moved(instruction, operand, which, first)
                    made.append((text.strip(), words(before) | there, bool(missing)))
    return made


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_words_behind_the_end_of_an_area_are_an_error_and_those_in_front_of_it_none(part: int) -> None:
    """An instruction in error writes nothing."""
    rows = cases(ROWS[part::PARTS])
    plc = plc_of("\n".join(f"LD W{n // 16}.{n % 16:02}\n{text}" for n, (text, _, _) in enumerate(rows)))
    dm, wrong = plc.memory.words("D"), []
    for number, (text, before, is_short) in enumerate(rows):
        dm[:] = memoryview(bytes(2 * END)).cast("H")
        for at, word in before.items():
            dm[at] = word
        whole = dm.tobytes()
        plc.memory.words("W")[number // 16] = 1 << number % 16
        assert plc.scan() is None, text
        plc.memory.words("W")[number // 16] = 0
        if plc.read(FLAGS["ER"]) is not is_short or is_short and dm.tobytes() != whole:
            wrong.append(text)
    assert wrong == [] and len(rows) > 50
