"""What a scan that exceeds the watch cycle time leaves in the memory: flag, error code, cycle time words."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.areas import AREAS, BUDGET, PAGE_BYTES
from fbvm.base.memory import Memory
from fbvm.code.image import Site
from fbvm.engine.trap import Trap
from fbvm.machine.scan.watch_cycle import WatchCycle

SITE = Site("a.st", "Main", 3, 5)
LOOP = Trap("R0104", SITE, (), "a loop")
SIZE = -(-max(area.offset + area.size_bytes for area in AREAS.values()) // PAGE_BYTES) * PAGE_BYTES


@pytest.fixture
def memory() -> Memory:
    return Memory(SIZE, AREAS)


@each_of("time_ns, longest, words, longest_words", [
    (1_000_000_000, 0, (10_000, 0), (10_000, 0)), (1_000_000_000, 65_541, (10_000, 0), (5, 1)),
    (7_000_000_000, 65_541, (4_464, 1), (4_464, 1)), (1_000_000_000, 9_999, (10_000, 0), (10_000, 0)),
    (1_000_000_000, 10_001, (10_000, 0), (10_001, 0)),
])
def test_a_scan_that_took_too_long(memory: Memory, time_ns: int, longest: int, words: tuple[int, int],
                                   longest_words: tuple[int, int]) -> None:
    watch, a = WatchCycle(memory), memory.words("A")
    watch.time_ns = time_ns
    a[401], a[262], a[263] = 0x0F, longest & 0xFFFF, longest >> 16
    memory.write(BUDGET, "i64", 400)
    trap = watch.judged(LOOP)
    assert trap is not None and (trap.code, trap.site) == ("R0112", SITE)
    assert (a[401], a[400]) == (0x010F, 0x809F) and (a[264], a[265], a[262], a[263]) == (*words, *longest_words)
    assert watch.ended(trap, 1000) == (600, time_ns) and watch.ended(LOOP, 1000) is None and watch.ended(None, 1000) is None
    watch.clear()
    assert (a[401], a[400]) == (0x0F, 0)
    a[400] = 0x80F1
    watch.clear()
    assert a[400] == 0x80F1, "another error"


@each_of("trap, left", [(None, 400), (Trap("R0101", SITE, (), "divided"), 400), (LOOP, -1)])
def test_other_ends_leave_the_words_alone(memory: Memory, trap: Trap | None, left: int) -> None:
    memory.write(BUDGET, "i64", left)
    a = memory.words("A")
    a[400] = a[401] = 0
    assert WatchCycle(memory).judged(trap) is trap and (a[400], a[401]) == (0, 0)


def test_the_last_step_of_the_budget_is_the_watch_cycle_time(memory: Memory) -> None:
    memory.write(BUDGET, "i64", 0)
    trap = WatchCycle(memory).judged(LOOP)
    assert trap is not None and trap.code == "R0112"
