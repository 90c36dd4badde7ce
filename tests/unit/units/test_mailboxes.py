"""Mailboxes: areas that units bring, declared by a library, named behind AT, laid out, seen by unit, watch and listing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.areas import AREAS, PAGE_BYTES, SLOTS_OFFSET, AddressError, Mailbox, parse_address
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image, Layout
from fbvm.code.listing import listing
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.writer import TraceWriter
from fbvm.units.contract import AreaMemory
from fbvm.watch.paths import UnknownPlace
from fbvm.wire.link import Event, Request

BOX = Mailbox("PBX", 4, 2, 8)
TOML = 'title = "t"\nglobals = ["Box_Memory.st"]\n[mailbox]\narea = "PBX"\nhead = 4\nslots = 2\nslot = 8\n'
MEMORY = """
TYPE Box_Slot : STRUCT Owner : UINT; Data : ARRAY[0..6] OF WORD; END_STRUCT; END_TYPE
VAR_GLOBAL Ready AT PBX0.03 : BOOL; Slots AT PBX4 : ARRAY[1..2] OF Box_Slot; END_VAR
"""
BLOCK = """
FUNCTION_BLOCK Box_Claim
VAR_OUTPUT Slot : UINT; END_VAR
VAR_TEMP i : UINT; END_VAR
VAR_EXTERNAL Slots : ARRAY[1..2] OF Box_Slot; END_VAR
IF Slot = 0 THEN
    FOR i := 1 TO 2 DO
        IF Slots[i].Owner = 0 THEN Slots[i].Owner := 1; Slot := i; EXIT; END_IF;
    END_FOR;
END_IF;
END_FUNCTION_BLOCK
"""
PROGRAM = """
PROGRAM Main
VAR a, b, c : Box_Claim; seen : BOOL; seventh AT %PBX13 : WORD; bank AT E2_7 : WORD; END_VAR
a(); b(); c(); seen := %PBX0.03; %PBX11 := 16#1234; bank := 5;
END_PROGRAM
"""


@pytest.fixture
def library(tmp_path: Path) -> Path:
    folder = tmp_path / "lib" / "box"
    folder.mkdir(parents=True)
    (folder / "library.toml").write_text(TOML)
    (folder / "Box_Memory.st").write_text(MEMORY)
    (folder / "Box_Claim.st").write_text(BLOCK)
    return tmp_path / "lib"


@pytest.fixture
def image(library: Path) -> Image:
    made = compile_text(PROGRAM, libraries=[library])
    assert made.image is not None, [message.message for message in made.diagnostics]
    return made.image


class Box:
    """A unit that reports that it is ready and puts a number beside the owner of each slot."""

    name, address = "box", "192.168.250.9"

    watched = exchanged = None

    def __init__(self) -> None:
        self.wake_ns = 1 << 63
        self.changed_words = False
        self.configuration: dict[str, Any] = {}
        self.settings: dict[str, Any] = {}

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        words = memory.words("PBX")
        before = words.tobytes()
        words[0] |= 8
        for slot in range(BOX.head_words, BOX.words, BOX.slot_words):
            words[slot + 1] = 100 + slot if words[slot] else 0
        self.changed_words = words.tobytes() != before
        return []

    def reset(self, memory: AreaMemory) -> list[Request]:
        memory.words("PBX")[:] = memoryview(bytearray(2 * BOX.words)).cast("H")
        return []


@pytest.mark.parametrize("engine", ["python", "native"])
def test_instances_claim_slots_and_the_unit_meets_them_there(image: Image, engine: str) -> None:
    if engine == "native":
        pytest.importorskip("llvmlite")
    plc = Plc(image, engine=engine)
    plc.attach(Box(), LoopNetwork())
    plc.scan()
    assert [plc.read(f"Main.{name}.Slot") for name in "abc"] == [1, 2, 0]
    assert (plc.read("Main.seen"), plc.read("PBX0.03"), plc.read("PBX 4"), plc.read("PBX5")) == (False, True, 1, 104)
    assert plc.read("Slots[2].Data[0]") == 112
    plc.scan()
    assert plc.read("Main.seen") is True
    assert plc.read("PBX10..PBX12") == [0, 0x1234, 1]
    plc.write("PBX13", 77)
    assert plc.read("Main.seventh") == 77


def test_it_lies_behind_the_slots_and_before_the_banks(image: Image) -> None:
    layout = image.layout
    assert layout.mailboxes == (BOX,)
    box, bank = layout.areas["PBX"], layout.areas["E2"]
    assert (box.count, box.offset % PAGE_BYTES, bank.offset) == (20, 0, box.offset + PAGE_BYTES)
    assert layout.size == bank.offset + bank.size_bytes
    assert box.offset >= SLOTS_OFFSET + layout.slots_size


def test_a_program_that_does_not_use_it_has_none(library: Path) -> None:
    made = compile_text("PROGRAM Main VAR x : INT; END_VAR x := 1; END_PROGRAM", libraries=[library])
    assert made.image is not None
    assert made.image.layout == Layout(made.image.layout.slots_size)
    with pytest.raises(UnknownPlace):
        Plc(made.image).read("PBX0")


def test_a_restart_clears_it(image: Image) -> None:
    plc = Plc(image)
    plc.write("PBX3", 9)
    plc.warm_start()
    assert plc.read("PBX3") == 0


def test_it_is_listed_and_traced(image: Image, tmp_path: Path) -> None:
    text = listing(image)
    assert "mailbox   PBX: 4 words, then 2 slots of 8" in text
    assert "PBX0.03" in text
    plc = Plc(image)
    with (tmp_path / "t").open("wb") as file:
        writer = TraceWriter(plc, file)
        plc.run(scans=2)
        writer.close()
    with Trace.open(tmp_path / "t") as trace:
        assert trace.at(1).read("PBX11") == 0x1234


def test_addresses() -> None:
    areas = {**AREAS, "PBX": BOX.at(0)}
    assert [str(parse_address(text, areas)) for text in ("PBX5", "%pbx 5", "PBX19.15")] == ["PBX5", "PBX5", "PBX19.15"]
    for text, why in (("PBX20", "PBX ends at 19"), ("PBX1.16", "bits are 0 to 15"), ("PCX1", "is not an address")):
        with pytest.raises(AddressError, match=why):
            parse_address(text, areas)
    with pytest.raises(AddressError):
        parse_address("PBX5")


def test_what_runs_past_its_end_is_refused(library: Path) -> None:
    made = compile_text(
        "PROGRAM Main VAR a : Box_Claim; x AT PBX19 : DWORD; y AT PBX20 : WORD; END_VAR a(); END_PROGRAM",
        libraries=[library],
    )
    assert [message.code for message in made.diagnostics if message.code < "S0900"][:2] == ["S0601", "S0601"]


@pytest.mark.parametrize(("area", "sizes", "why"), [
    ('"D"', (1, 1, 1), "cannot name an area"),
    ('"CIO"', (1, 1, 1), "cannot name an area"),
    ('"E5"', (1, 1, 1), "cannot name an area"),
    ('"pbx"', (1, 1, 1), "cannot name an area"),
    ('"PBX"', (0, 0, 5), "would have 0 words"),
    ('"PBX"', (4, -1, 5), "would have"),
    ('"PBX"', (1, 1 << 16, 1 << 16), "would have"),
    ('"PBX"', (1, 1, '"x"'), "whole numbers"),
])
def test_a_mailbox_that_cannot_be(tmp_path: Path, area: str, sizes: tuple[object, ...], why: str) -> None:
    head, slots, slot = sizes
    (tmp_path / "library.toml").write_text(f"[mailbox]\narea = {area}\nhead = {head}\nslots = {slots}\nslot = {slot}\n")
    made = compile_text("PROGRAM Main END_PROGRAM", libraries=[tmp_path])
    [found] = made.diagnostics
    assert made.image is None
    assert found.code == "P0201"
    assert why in found.message


def test_what_a_library_cannot_mean(tmp_path: Path) -> None:
    (tmp_path / "inside").mkdir()
    for text, why in (
        ("global = ['A.st']", "did you mean globals?"), ("by_dialects = true", "did you mean by_dialect?"),
        ("spaces = 'Standard'", "spaces must be a list of names"), ("by_dialect = 'yes'", "by_dialect must be true or false"),
        ("writes = ['X']", "writes must be a list of areas"), ("globals = [1]", "globals must be a list of file names"),
        ("lists = ['gone.st']", "lists: there is no file gone.st in this folder"),
        ("globals = ['gone.st']", "globals: there is no file gone.st in this folder"),
        ("globals = ['inside']", "globals: there is no file inside in this folder"),
        ("lists = ['../gone.st']", "lists: ../gone.st is no file of this folder"),
        ("task = 'Gone'", "task: there is no file Gone.st in this folder"), ("task = 5", "task must be the name of a function"),
        ("[pins]\nA = 1", "pins has for each POU a table"), ("x =", "Invalid value"),
    ):
        (tmp_path / "library.toml").write_text(text, encoding="utf-8")
        [found] = compile_text("PROGRAM Main END_PROGRAM", libraries=[tmp_path]).diagnostics
        assert found.code == "P0201" and why in found.message, text
    (tmp_path / "library.toml").write_text("title = 'x'\nlicence = 'MIT'\npages = 3\n", encoding="utf-8")
    assert not compile_text("PROGRAM Main END_PROGRAM", libraries=[tmp_path]).diagnostics


def test_two_libraries_cannot_mean_different_mailboxes(library: Path) -> None:
    other = library / "other"
    other.mkdir()
    (other / "Box_Memory.st").write_text(MEMORY)
    (other / "library.toml").write_text(TOML.replace("slots = 2", "slots = 3"))
    [found] = compile_text("PROGRAM Main END_PROGRAM", libraries=[library]).diagnostics
    assert (found.code, found.message) == ("P0201", "PBX is another library's mailbox, too")
