"""The heap of __NEW and __DELETE: where blocks lie, how large it is, and what tools say of pointers into it."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.code.image import LARGEST_HEAP, USUAL_HEAP, Image, Objects
from fbvm.code.listing import listing
from fbvm.code.operations import LEASED, OFFSET_MASK, OFFSET_SHIFT
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc
from fbvm.step.session import Session

COUNT, HEAD = 12, 8
TEXT = f"""
PROGRAM Main
VAR
    op, slot : INT; size, i : UDINT; ok : BOOL := TRUE;
    p : ARRAY[0..{COUNT - 1}] OF POINTER TO BYTE; sizes : ARRAY[0..{COUNT - 1}] OF UDINT;
END_VAR
    IF op = 1 THEN
        p[slot] := __NEW(BYTE, size); sizes[slot] := size;
        IF p[slot] <> 0 AND size > 0 THEN
            FOR i := 0 TO size - 1 DO ok := ok AND p[slot][i] = 0; p[slot][i] := TO_BYTE(slot + 1); END_FOR
        END_IF
    ELSIF op = 2 THEN
        IF p[slot] <> 0 AND sizes[slot] > 0 THEN
            FOR i := 0 TO sizes[slot] - 1 DO ok := ok AND p[slot][i] = slot + 1; END_FOR
        END_IF
        __DELETE(p[slot]);
    END_IF
END_PROGRAM
"""
SMALL = 280
FILLED = """
PROGRAM Main
VAR p : POINTER TO INT; q : POINTER TO BYTE; n : INT; r : POINTER TO INT; END_VAR
    IF p = 0 THEN p := __NEW(INT, 4); r := ADR(n); END_IF
    n := n + 1; p[n MOD 4] := n;
    q := __NEW(BYTE, 5000);
    __DELETE(q);
END_PROGRAM
"""


def image_of(text: str, heap: int | None = None) -> Image:
    image = compile_text(text, dialect="codesys", heap=heap).image
    assert image is not None
    return image


class Heap:
    """First fit among blocks of whole units behind heads of one unit, as Python has it."""

    def __init__(self, size: int) -> None:
        self.size = size // 8 * 8
        self.taken: dict[int, tuple[int, int]] = {}

    def new(self, at: int, size: int) -> int | None:
        """The offset of a variable of so many bytes in the heap."""
        wanted, start = HEAD + -(-size // 8) * 8, 0
        for begin, end in sorted(self.taken.values()):
            if begin - start >= wanted:
                break
            start = end
        if start + wanted > self.size:
            return None
        self.taken[at] = start, start + wanted
        return start + HEAD


@pytest.mark.parametrize("seed", range(3))
def test_the_first_block_that_is_large_enough_is_taken(seed: int) -> None:
    random_, plc, model = random.Random(seed), Plc(image_of(TEXT, SMALL), engine="python"), Heap(SMALL)
    begin = plc.image.layout.heap_at
    full = 0
    for _ in range(120):
        at, size = random_.randrange(COUNT), random_.choice((0, 1, 7, 8, 9, *(random_.randrange(n) for n in (60, 120, 200))))
        known = at in model.taken
        plc.write("Main.op", 2 if known else 1)
        plc.write("Main.slot", at)
        plc.write("Main.size", size)
        assert plc.scan() is None, plc.trap
        place = plc.find(f"Main.p[{at}]")
        found = int.from_bytes(plc.memory.u8[place.offset : place.offset + 8], "little") >> OFFSET_SHIFT & OFFSET_MASK
        if known:
            del model.taken[at]
            assert found == 0
        else:
            offset = model.new(at, size)
            full += offset is None
            assert found == (0 if offset is None else begin + offset)
    assert plc.read("Main.ok") is True and full > 2


def test_the_number_of_an_object_says_whether_new_has_made_it() -> None:
    """The heap's rows are the last ones; without any, a number belongs to what else is leased."""
    first = LEASED + (2 << 21)  # of four rows the third
    for rows, number, made in ((1, first, True), (2, first + 5, True), (1, first - 1, False), (0, first, False), (1, 2, False)):
        assert Objects(leases=4, heap_rows=rows, heap_row=2).is_made(number) is made, (rows, number)


def test_a_heap_has_as_many_bytes_as_are_asked_for() -> None:
    usual, none, large = image_of(FILLED), image_of(FILLED, 0), image_of(FILLED, 3_000_001)
    assert [each.layout.heap_bytes for each in (usual, none, large)] == [USUAL_HEAP, 0, 3_000_000]
    assert usual.layout.size - none.layout.size == USUAL_HEAP and len({each.fingerprint for each in (usual, none, large)}) == 3
    assert [body.code for body in usual.bodies] == [body.code for body in large.bodies]
    plain = image_of("PROGRAM Main VAR n : INT; END_VAR n := 1; END_PROGRAM", 100)
    assert plain.layout.heap_bytes == 0
    for size in (-1, LARGEST_HEAP + 1):
        with pytest.raises(ValueError, match=f"a heap has 0 to {LARGEST_HEAP} bytes"):
            usual.with_heap(size)


def test_e_banks_lie_before_the_heap() -> None:
    image = image_of(FILLED).with_e_banks(["E1"])
    plc = Plc(image, engine="python")
    assert image.layout.heap_at >= image.layout.areas["E1"].offset + image.layout.areas["E1"].size_bytes
    assert [plc.scan(), plc.scan()] == [None, None] and plc.read("Main.n") == 2


def test_a_listing_says_where_the_heap_is() -> None:
    image = image_of(FILLED)
    assert f"heap      {image.layout.heap_at}       1048576 bytes for __NEW" in listing(image)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", pytest.param("native", marks=pytest.mark.skipif(
    not native.available(), reason="llvmlite is not installed"))])  # fmt: skip
def test_power_on_empties_the_heap(engine: str) -> None:
    plc = Plc(image_of(FILLED, 200), engine=engine)
    for _ in range(3):
        plc.scan()
    before = plc.read("Main.p")
    plc.cold_start()
    assert plc.read("Main.p") is None
    plc.scan()
    assert plc.read("Main.p") == before and plc.read("Main.n") == 1


def test_stepping_back_finds_the_heap_as_it_was() -> None:
    image = image_of(FILLED, 200)
    session = Session.of(lambda: Plc(image))
    heap = slice(image.layout.heap_at, image.layout.heap_at + 200)

    def at(scan: int) -> tuple[bytes, bytes]:
        session.goto(scan)
        memory = bytes(session.plc.memory.u8)
        return memory, memory[heap]

    forward = [at(scan) for scan in range(5)]
    assert len({part for _, part in forward}) == 5
    assert [at(scan) for scan in (3, 1, 4, 0, 2)] == [forward[scan] for scan in (3, 1, 4, 0, 2)]
    for _ in range(4):
        session.step()
    assert bytes(session.plc.memory.u8)[heap] != forward[2][1]
    for _ in range(4):
        session.back()
    assert bytes(session.plc.memory.u8) == forward[2][0]


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "heap.st").write_text(FILLED, encoding="utf-8")
    (tmp_path / "fbvm.toml").write_text(
        'run = {scans = 3}\n[plc.pump]\nsources = ["heap.st"]\ndialect = "codesys"\nheap = 64\nwatch = ["Main.p", "Main.q"]\n',
        encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return "heap.st"


def fbvm(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, arguments)
    return result.exit_code, result.output


def test_the_option_and_the_key_of_a_project(source: str) -> None:
    few = ("run", source, "--dialect", "codesys", "--scans", "3", "--show", "Main.p")
    assert fbvm(*few, "--heap", "0")[0] == 4
    status, shown = fbvm(*few, "--heap", "64", "--show", "Main.q,Main.r")
    assert status == 0 and shown.startswith("Main.p = -> INT of __NEW (16#")
    assert shown.endswith("\nMain.q = NULL\nMain.r = -> Main.n\n")
    assert fbvm(*few, "--heap", "-1")[0] == 2
    status, shown = fbvm("run")
    assert status == 0 and "-> INT of __NEW (16#" in shown
    assert fbvm("run", "--heap", "64")[0] == 2


def test_a_recording_knows_how_large_the_heap_was(source: str) -> None:
    status, _ = fbvm("run", source, "--dialect", "codesys", "--scans", "3", "--heap", "64", "--trace", "heap.fbt")
    assert status == 0
    status, shown = fbvm("replay", "heap.fbt", "--show", "Main.p", "--show", "Main.n")
    assert status == 0 and "Main.p = -> INT of __NEW (16#" in shown and "Main.n = 3" in shown
