"""The table of breakpoints alone: which bytes a watchpoint compares, which passes stop, what goes back; statements of a stop."""

from __future__ import annotations

import ctypes
import struct
from typing import Any

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base.areas import AREAS, NOW, SCANS
from fbvm.base.memory import Memory
from fbvm.engine import stops
from fbvm.engine.stops import AT_STATEMENT, COUNT, ROW_BYTES, ROWS, TABLE, WATCHING, LineStop, StopTable, Watchpoint

SIZE = 4096


@pytest.fixture
def memory() -> Memory:
    return Memory(SIZE, AREAS)


# --- lines --------------------------------------------------------------------------------------------------------------


@each_of("held, wanted, passed, passes", [
    (None, None, True, 1), (True, None, True, 1), (False, None, False, 0), ("unknown", None, None, 0), (True, 2, False, 1),
    (True, 1, True, 1),
])
def test_a_line_counts_the_passes_with_its_test(held: Any, wanted: int | None, passed: bool | None, passes: int) -> None:
    bases: list[int | None] = []
    answer = None if held == "unknown" else held
    line = LineStop(frozenset([3]), None if held is None else lambda base: bases.append(base) or answer,
     # type: ignore[func-returns-value]
                    None if wanted is None else lambda number: number == wanted)
    assert line.passed(77) is passed and line.passes == passes and bases == ([] if held is None else [77])


# --- watched bytes ------------------------------------------------------------------------------------------------------


@each_of("extents, mask, chunks", [
    ([(100, 1)], 0, [(100, 0xFF)]), ([(100, 2)], 0, [(100, 0xFFFF)]), ([(100, 8)], 0, [(100, (1 << 64) - 1)]),
    ([(100, 9)], 0, [(100, (1 << 64) - 1), (108, 0xFF)]), ([(100, 1)], 0x10, [(100, 0x10)]), ([(100, 1), (200, 3)], 0, [
        (100, 0xFF), (200, 0xFFFFFF)]), ([(SIZE - 1, 1)], 0, [(SIZE - 8, 0xFF << 56)]),
        ([(SIZE - 8, 8)], 0, [(SIZE - 8, (1 << 64) - 1)]),
    ([(SIZE - 4, 4)], 0, [(SIZE - 8, 0xFFFFFFFF << 32)]), ([(SIZE - 1, 1)], 0x04, [(SIZE - 8, 0x04 << 56)]),
])
def test_watched_bytes_are_eight_each_within_the_memory(extents: list[tuple[int, int]], mask: int, chunks: list[tuple[int,
int]]) -> None:
    memory = Memory(SIZE, AREAS)
    memory.u8[:] = bytes(number * 7 % 256 for number in range(SIZE))
    point = Watchpoint(extents, mask)
    point.begin(memory)
    assert point.chunks == chunks
    for (offset, size) in extents:
        for at in range(offset, offset + size):
            was = memory.u8[at]
            memory.u8[at] = was ^ (mask or 0xFF)
            assert point.seen(memory) != point.last
            memory.u8[at] = was ^ (~mask & 0xFF if mask else 0)
            assert point.seen(memory) == point.last
            memory.u8[at] = was
        for beside in {offset - 1, min(offset + size, SIZE - 1)} - set(range(offset, offset + size)):
            memory.u8[beside] ^= 0xFF
            assert point.seen(memory) == point.last
            memory.u8[beside] ^= 0xFF


@each_of("edge, wanted, stops_at", [
    (False, None, [False, True, True, False, True]), (True, None, [False, True, False, False, True]),
    (False, 2, [False, False, True, False, False]), (True, 2, [False, False, False, False, True]),
])
def test_a_watchpoint_stops_where_its_test_holds(edge: bool, wanted: int | None, stops_at: list[bool], ) -> None:
    memory = Memory(SIZE, AREAS)
    point = Watchpoint([(100, 1)], test=lambda: memory.u8[100] in (2, 3, 5), edge=edge, read=lambda: memory.u8[100],
                       wanted=None if wanted is None else lambda number: number == wanted)
    point.begin(memory)
    seen = []
    for value in (1, 2, 3, 4, 5):
        memory.u8[100] = value
        seen.append(point.changed(point.seen(memory)))
        assert (point.before, point.value, point.last) == (value - 1, value, (value,))
    assert seen == stops_at


def test_a_test_that_holds_already_is_no_edge_and_a_look_is_undone() -> None:
    memory = Memory(SIZE, AREAS)
    point = Watchpoint([(100, 1)], test=lambda: True, edge=True)
    point.begin(memory)
    memory.u8[100] = 1
    assert not point.changed(point.seen(memory)) and point.passes == 0
    free = Watchpoint([(100, 1)], read=lambda: memory.u8[100])
    free.begin(memory)
    was = free.state
    memory.u8[100] = 2
    assert free.changed(free.seen(memory)) and (free.passes, free.value, free.last) == (1, 2, (2,)) and free.state != was
    free.back(was)
    assert (free.passes, free.value, free.last) == (0, 1, (1,)) and free.state == was


# --- the table ----------------------------------------------------------------------------------------------------------


def rows_of(table: StopTable) -> list[tuple[int, int, int]]:
    """The rows of watched bytes as machine code reads them."""
    count, = struct.unpack("<q", ctypes.string_at(table.at + COUNT, 8))
    where, = struct.unpack("<q", ctypes.string_at(table.at + ROWS, 8))
    return [struct.unpack("<3Q", ctypes.string_at(where + ROW_BYTES * number, ROW_BYTES)) for number in range(count)]


def test_machine_code_finds_lines_and_watched_bytes(memory: Memory) -> None:
    table = StopTable(memory, 5)
    assert not table.armed and bytes(table.table) == bytes(6) and rows_of(table) == []
    first, second, point = LineStop(frozenset([1, 3])), LineStop(frozenset([3])), Watchpoint([(100, 2), (200, 1)])
    memory.u8[100:102] = b"\x34\x12"
    table.put([first])
    assert table.armed and bytes(table.table) == bytes([0, AT_STATEMENT, 0, AT_STATEMENT, 0, 0]) and rows_of(table) == []
    table.put([first, point, second])
    assert bytes(table.table) == bytes([WATCHING, 3, WATCHING, 3, WATCHING, WATCHING])
    assert rows_of(table) == [(100, 0xFFFF, 0x1234), (200, 0xFF, 0)]
    assert ctypes.string_at(table.at + TABLE, 6) == bytes(table.table)
    memory.u8[100] = 0x35
    table.put([point])
    assert rows_of(table)[0] == (100, 0xFFFF, 0x1234), "a row that stays goes on from its last look"
    assert table.hit(0, False) and table.reasons == (point,) and rows_of(table)[0] == (100, 0xFFFF, 0x1235)
    assert not table.hit(0, False) and table.reasons == ()
    table.put([])
    assert not table.armed and bytes(table.table) == bytes(6) and rows_of(table) == []


def test_a_hit_names_all_its_reasons_and_a_write_is_no_statement(memory: Memory) -> None:
    table = StopTable(memory, 5)
    first, second, point = LineStop(frozenset([1, 3])), LineStop(frozenset([3]), lambda base: base == 8), Watchpoint([(100, 1)])
    table.put([first, second, point])
    assert table.hit(3, True, 8) and table.reasons == (first, second)
    assert table.hit(3, True, 9) and table.reasons == (first,) and not table.hit(3, False, 8) and not table.hit(2, True, 8)
    memory.u8[100] = 1
    assert table.hit(1, True, 9) and table.reasons == (point, first) and not table.hit(-1, False)
    was = table.state
    memory.u8[100] = 2
    assert table.hit(3, True, 8) and table.reasons == (point, first, second)
    assert (first.passes, second.passes, point.passes) == (4, 2, 2)
    table.back(was)
    assert (first.passes, second.passes, point.passes, table.reasons) == (3, 1, 1, ())
    assert rows_of(table) == [(100, 0xFF, 1)]
    table.begin({first: 40})
    assert (first.passes, second.passes, point.passes) == (40, 0, 0) and rows_of(table) == [(100, 0xFF, 2)]


def test_a_message_is_told_with_its_scan_and_does_not_stop(memory: Memory) -> None:
    table = StopTable(memory, 5)
    memory.write(SCANS, "i64", 7)
    memory.write(NOW, "i64", 70)
    line = LineStop(frozenset([2]), message=lambda base: None if base is None else f"at {base}")
    never = LineStop(frozenset([4]), lambda base: False, message=lambda base: "never")
    table.put([line, never])
    assert not table.hit(2, True, 16) and not table.hit(4, True, 16)
    assert [(each.site, each.scan, each.now_ns, each.text) for each in table.told] == [(2, 7, 70, "at 16")]
    was = table.state
    assert not table.hit(2, True, 24) and len(table.told) == 2
    assert table.hit(2, True) and table.reasons == (line,) and len(table.told) == 2, "the instance decides and is not known"
    table.back(was)
    assert [each.text for each in table.told] == ["at 16"]


@each_of("what, site, statement", [(7, 3, True), (6, 3, False), (-2, -1, False)])
def test_machine_code_asks_by_site_and_kind(what: int, site: int, statement: bool) -> None:
    asked: list[Any] = []
    table = StopTable(Memory(SIZE, AREAS), 5)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table, "hit", lambda *given: asked.append(given) or len(asked) == 1)
        assert (table._ask(None, what), table._ask(None, what)) == (True, False) and asked == [(site, statement)] * 2
        error = RuntimeError("the reader is broken")

        def fails(*_: object) -> bool:
            raise error

        patch.setattr(table, "hit", fails)
        assert table._ask(None, what) == 1 and table.failure is error


def test_the_function_that_machine_code_calls_is_in_the_head(memory: Memory) -> None:
    table = StopTable(memory, 2)
    asked: list[Any] = []
    table.hit = lambda *given: asked.append(given) or True  # type: ignore[method-assign]
    where, = struct.unpack("<q", ctypes.string_at(table.at + stops.ASK, 8))
    assert stops._ASK(where)(None, 5) == 1 and asked == [(2, True)]


# --- statements of a stop -----------------------------------------------------------------------------------------------

TEXT = """FUNCTION_BLOCK B VAR_OUTPUT n : INT; END_VAR
n := n + 1;
n := n + 1;
END_FUNCTION_BLOCK
PROGRAM Main VAR a, b : INT; f : B; END_VAR
a := 1;
f();
b := f.n;
IF b > 0 THEN a := 2; END_IF
END_PROGRAM
"""


@each_of("kind, where, statements, pous", [
    ("line", "text.st:6", [0], "Main"), ("line", "text.st:7", [1], "Main"), ("line", "text.st:2", [2], "B"),
    ("line", "text.st:3", [3], "B"), ("line", "text.st:8", [4], "Main"), ("line", "text.st:9", [5], "Main"),
    ("change", "Main.a", [1, 7], "Main"), ("change", "Main.b", [5], "Main"), ("change", "Main.f.n", [3, 4], "B"),
])
def test_so_many_statements_have_begun_before_a_stop(kind: str, where: str, statements: list[int], pous: str) -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image, engine="python")
    getattr(plc.breakpoints, kind)(where)
    found = []
    while plc.run(scans=1 - plc.scans) == "break":
        assert plc.halted is not None
        found.append((plc.halted.statement, plc.halted.frames[0].pou))
    assert found == [(number, pous) for number in statements]
