"""The columns of a page, fed with the ends of scans of a small PLC; the rows of its scans."""

from __future__ import annotations

import zlib
from array import array
from collections.abc import Callable
from typing import Any

import pytest
from trace_rig import image

from fbvm.base.memory import FORMATS
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.page import columns as module
from fbvm.record.page import inside
from fbvm.record.page.cells import BIT, SIZES, TEXT, Cell, cell_of
from fbvm.record.page.columns import Columns
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.recorder import Signal
from fbvm.watch.paths import Place

TEXT_PROGRAM = """\
FUNCTION Next : INT
VAR_INPUT x : INT; END_VAR
Next := x + 1;
END_FUNCTION
PROGRAM Main
VAR
    n : INT; same : DINT := 7; flag : BOOL; r : REAL; w AT D7 : WORD; bit AT D9.03 : BOOL; s : STRING[6] := 'ab'; late : LINT;
    odd AT D13 : DINT;
END_VAR
n := Next(n);
flag := n MOD 2 = 0; r := r - 0.5;
IF n = 4 THEN w := 16#1234; late := -5; s := 'cd'; END_IF
bit := n > 5;
odd := odd - 70000;
END_PROGRAM
"""
NAMES = ("n", "same", "flag", "r", "bit", "s", "late", "odd")


@pytest.fixture(scope="module")
def program() -> Image:
    return image(TEXT_PROGRAM)


def place(plc: Plc, name: str) -> Place:
    found = plc.find(f"Main.{name}")
    assert isinstance(found, Place)
    return found


def values(columns: Columns, number: int) -> list[Any]:
    """The values of a column at all scans, unpacked as a page does it."""
    column, code = columns.columns[number], columns.columns[number].cell.code
    size, entries = SIZES[code], {entry.block: entry for entry in column.entries}
    streams = {}
    packed = iter(columns.streams)
    for block in range(len(columns.blocks)):
        for at, other in enumerate(columns.columns):
            for entry in other.entries:
                if entry.block == block and entry.length:
                    stream = next(packed)
                    assert len(stream) == entry.length
                    if at == number:
                        streams[block] = zlib.decompress(stream, -15)
    made, last = b"", column.initial
    for block, count in enumerate(columns.blocks):
        entry = entries.get(block)
        first = entry.first if entry else last
        differences = streams.get(block, bytes(size * count))
        now = int.from_bytes(first, "little")
        for at in range(count):
            now = now + int.from_bytes(differences[at * size : (at + 1) * size], "little") & (1 << 8 * size) - 1
            made += now.to_bytes(size, "little")
        last = entry.last if entry else last
        assert last == made[-size:]
        if entry and code not in (BIT, TEXT):
            numbers = memoryview(made[-size * count :]).cast(FORMATS[code]).tolist()  # type: ignore[call-overload]
            assert (entry.low, entry.high) == (min(numbers), max(numbers))
    return memoryview(made).cast("B" if code == BIT else "I" if code == TEXT else FORMATS[code]).tolist()  # type: ignore[call-overload]


def collected(plc: Plc, scans: int, watched: str = "", before: Callable[[Plc], None] = lambda plc: None) -> Columns:
    cells = [cell_of(Signal(place(plc, name), ""), number) for number, name in enumerate(NAMES)]
    areas = [plc.memory.areas[name] for name in ("D", "CIO", "TF", "M")]
    columns = Columns(cells, areas, lambda number, moment: str(moment.read(place(plc, NAMES[number]))),
                      frozenset(cell for cell, name in zip(cells, NAMES, strict=True) if name in watched.split()))  # fmt: skip
    for _ in range(scans):
        before(plc)
        plc.scan()
        columns.add(plc)  # type: ignore[arg-type]
    columns.end()
    return columns


def test_columns_hold_the_values_of_all_scans(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK_SCANS", 3)
    plc, seen = Plc(program), dict[str, list[Any]]()
    plc.watchers.append(lambda plc: [seen.setdefault(name, []).append(plc.read(f"Main.{name}")) for name in NAMES])
    columns = collected(plc, 8, "flag n late r")
    assert columns.blocks == [3, 3, 2] and len(columns) == 8 and columns.first == 1
    numbers = [columns.number(cell_of(Signal(place(plc, name), ""), at)) for at, name in enumerate(NAMES)]
    for name, number in zip(NAMES, numbers, strict=True):
        if name != "s":
            assert values(columns, number) == seen[name], name
    text = numbers[NAMES.index("s")]
    assert list(columns.texts[text].numbers) == ["ab", "cd"] and values(columns, text) == [0, 0, 0, 1, 1, 1, 1, 1]
    assert values(columns, 0) == [10_000_000 * scan for scan in range(8)]
    assert numbers[NAMES.index("same")] not in columns.varying and {0, text, *numbers[2:4]} <= {*columns.varying}
    changed = {name: columns.columns[number].changed for name, number in zip(NAMES, numbers, strict=True)}
    moving = dict.fromkeys(("n", "flag", "r"), range(2, 9))
    assert changed == {name: [4] if name == "late" else [*moving.get(name, ())] for name in NAMES}


def test_the_latest_changes_of_a_watched_variable_are_known(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK_SCANS", 4)
    monkeypatch.setattr(module, "LATEST_CHANGES", 3)
    plc = Plc(program)
    columns = collected(plc, 10, "n late")
    numbers = [columns.number(cell_of(Signal(place(plc, name), ""), 0)) for name in ("n", "late")]
    assert [columns.columns[number].changed for number in numbers] == [[8, 9, 10], [4]]


def test_words_of_areas_that_change_are_columns_and_the_others_constants(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK_SCANS", 3)
    plc = Plc(program)
    plc.write("D100", 77)
    plc.write("D101", 5)
    plc.write("CIO 40", 1)
    plc.write("%MW3", 9)

    def write(plc: Plc) -> None:
        if plc.scans == 5:
            plc.write("D101", 6)

    columns = collected(plc, 7, before=write)
    assert columns.constants["D"] == {13: 65536 - 70000 % 65536, 14: 0xFFFE, 100: 77, 101: 5}
    assert columns.constants["CIO"] == {40: 1} and not {"TF", "M"} & {*columns.constants}
    assert {*columns.words["D"]} == {7, 9, 13, 14, 101} and "CIO" not in columns.words
    assert values(columns, columns.words["D"][7]) == [0, 0, 0, *[0x1234] * 4]
    assert values(columns, columns.words["D"][101]) == [5, 5, 5, 5, 5, 6, 6]
    assert values(columns, columns.words["D"][9]) == [0, 0, 0, 0, 0, 8, 8]


def test_a_block_ends_earlier_if_much_is_held(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    plc = Plc(program)
    monkeypatch.setattr(module, "MOST_HELD_BYTES", 8 * module.LINE)
    assert max(collected(plc, 12).blocks) < 5


def test_the_index_tells_of_a_block_its_length_first_value_and_extremes(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK_SCANS", 3)
    plc = Plc(program)
    columns = collected(plc, 6)
    rows, data = len(columns.varying) * 2, columns.index()
    assert len(data) == 28 * rows
    lengths, firsts, lows, highs = (data[at * rows : end * rows] for at, end in ((0, 4), (4, 12), (12, 20), (20, 28)))
    late = 2 * columns.varying.index(columns.number(Cell("i64", place(plc, "late").offset)))
    n = 2 * columns.varying.index(columns.number(Cell("i16", place(plc, "n").offset)))
    found = [array(code, part).tolist() for code, part in (("I", lengths), ("q", firsts), ("d", lows), ("d", highs))]
    assert [part[late : late + 2] for part in found] == [[0, 0], [0, -5], [0.0, -5.0], [0.0, -5.0]]
    assert [part[n : n + 2] for part in found[1:]] == [[1, 4], [1.0, 4.0], [3.0, 6.0]] and all(found[0][n : n + 2])


# --- rows -------------------------------------------------------------------------------------------------------------


def rows_of(program: Image, scans: range, most: int = 1000, names: tuple[str, ...] = ("n", "flag", "w", "bit", "late")) -> Any:
    plc = Plc(program, engine="python")
    recorded = Recording().add("main", plc)
    plc.run(scans=6)
    source = RecordedScans(recorded, {})
    found = inside.Insides(source, [Signal(place(plc, name), name) for name in names])
    return found, source, found.window(scans, most)


def test_what_a_statement_changes_behind_its_call_is_one_row() -> None:
    """Both outputs are assigned behind the body of the block: once more the statement of the call, with two changes."""
    made = image("FUNCTION_BLOCK F VAR_OUTPUT a, b : INT; END_VAR a := a + 1; b := b + 1; END_FUNCTION_BLOCK\n"
                 "PROGRAM Main VAR f : F; n, late : INT; END_VAR\nf(a => n, b => late);\nEND_PROGRAM\n")
    found, source, window = rows_of(made, range(3, 4), names=("n", "late"))
    lines = {number: source.sites[site].line for site, number in found.sites.items() if site >= 0}
    assert [(lines.get(where, where), moved) for where, _, *moved in window.rows[3]] == [
        (-1, []), (3, []), (1, []), (1, []), (3, [0, "4", 1, "4"])]


def test_a_row_is_a_statement_with_what_it_changed(program: Image) -> None:
    found, source, window = rows_of(program, range(3, 4))
    numbers = {number: source.sites[site].line for site, number in found.sites.items() if site >= 0}
    rows = [(numbers.get(where, where), *rest) for where, _, *rest in window.rows[3]]
    assert list(window.rows) == [3] and window.count == len(rows) and window.scans == range(3, 4)
    assert rows == [(-1,), (10,), (10,), (3,), (10, 0, "4"), (11, 1, "1"), (11,), (12,), (12, 2, "4660"), (12, 4, "-5"), (12,),
                    (13,), (14,)]  # fmt: skip


def test_of_too_many_rows_the_latest_scans_are_kept(program: Image) -> None:
    _, _, whole = rows_of(program, range(1, 6))
    rows = [len(whole.rows[scan]) for scan in range(1, 6)]
    _, _, window = rows_of(program, range(1, 6), sum(rows[-2:]))
    assert list(window.rows) == [4, 5] and window.count == sum(rows[-2:])
    assert window.rows[5][0] == [-1, *window.rows[5][0][1:]]
    _, _, one = rows_of(program, range(1, 6), 1)
    assert list(one.rows) == [5]


def test_what_is_known_of_the_last_scans_is_not_executed_again(program: Image) -> None:
    found, _, known = rows_of(program, range(4, 6))
    both = found.window(range(2, 6), 1000, known)
    assert list(both.rows) == [2, 3, 4, 5] and both.count == sum(map(len, both.rows.values()))
    assert both.rows[4] is known.rows[4]
    assert found.window(range(4, 6), 1000, known) is known


def test_executions_with_the_same_states_share_a_drawing(program: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    found, _, _ = rows_of(program, range(3, 4))
    made: list[int] = []

    def lines() -> list[str]:
        made.append(1)
        return ["a", "b"]

    assert [found.picture(("x", 1), lines), found.picture(("x", 1), lines), found.picture(("x", 2), lines)] == [0, 0, 1]
    assert len(made) == 2 and found.pictures == ["a\nb", "a\nb"]
    monkeypatch.setattr(inside, "MOST_PICTURES", 2)
    assert found.picture(("x", 3), lines) is None and found.picture(("x", 2), lines) == 1
