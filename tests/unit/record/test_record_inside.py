"""What happens inside a scan, the names of places, and the scan table."""

from __future__ import annotations

import io
from typing import Any

import pytest
from rows import each_of

from fbvm import Depth, Trace, TraceWriter
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Phase, Plc
from fbvm.record.draw.table import ScanTable
from fbvm.record.trace.events import Call, Event, ObservedEngine, Read, Return, Statement, Write
from fbvm.record.trace.observing import observing
from fbvm.record.trace.recorder import Signal, signals_of
from fbvm.record.trace.writes import double_writes
from fbvm.watch.names import Names

TEXT = """\
TYPE Pair : STRUCT a, b : INT; END_STRUCT END_TYPE
VAR_GLOBAL Total : DINT; END_VAR
FUNCTION_BLOCK Step
VAR_INPUT Go : BOOL; END_VAR
VAR_IN_OUT n : INT; END_VAR
VAR Inner : R_TRIG; END_VAR
    Inner(CLK := Go);
    IF Inner.Q THEN
        n := n + 1;
    END_IF
END_FUNCTION_BLOCK
FUNCTION Double : INT VAR_INPUT x : INT; END_VAR
    Double := 2 * x;
END_FUNCTION
PROGRAM Main
VAR
    Steps : ARRAY[1..2] OF Step;
    Go : BOOL;
    n, m : INT;
    Pairs : ARRAY[0..1, 1..2] OF Pair;
    Lamp AT CIO 100.03 : BOOL;
    Words AT D10 : ARRAY[0..3] OF WORD;
END_VAR
    Steps[1](Go := Go, n := n);
    m := Double(n);
    Pairs[1, 2].b := m;
    Lamp := NOT Lamp;
    Words[2] := 7;
    %D200 := 5;
END_PROGRAM
"""


@pytest.fixture(scope="module")
def image() -> Image:
    made = compile_text(TEXT, "steps.st").image
    assert made is not None
    return made


@pytest.fixture
def plc(image: Image) -> Plc:
    return Plc(image)


@pytest.fixture
def names(plc: Plc) -> Names:
    return Names.of(plc.image, plc.memory.areas)


class Log:
    """Writes down phases and events."""

    def __init__(self) -> None:
        self.rows: list[Any] = []

    def phase(self, plc: Plc, phase: Phase) -> None:
        self.rows.append(phase)

    def event(self, plc: Plc, event: Event) -> None:
        self.rows.append(event)

    def of(self, kind: type) -> list[Any]:
        return [row for row in self.rows if isinstance(row, kind)]


def look(plc: Plc) -> Log:
    log = Log()
    with observing(plc, log):
        plc.scan()
    return log


# --- inside -----------------------------------------------------------------------------------------------------------


def test_bodies_begin_and_end_as_they_call_each_other(plc: Plc, names: Names) -> None:
    shown = [(type(row).__name__, names.instance(row.frame.base)) for row in look(plc).rows if isinstance(row, Call | Return)]
    assert shown == [
        ("Call", "Main"), ("Call", "Main.Steps[1]"), ("Call", "Main.Steps[1].Inner"), ("Return", "Main.Steps[1].Inner"),
        ("Return", "Main.Steps[1]"), ("Call", ""), ("Return", ""), ("Return", "Main"),
    ]  # fmt: skip


def test_a_frame_knows_the_statement_that_called(plc: Plc, image: Image) -> None:
    inner = look(plc).of(Call)[2].frame
    assert image.sites[inner.site].line == 7
    assert image.sites[inner.caller.site].line == 24
    assert inner.caller.caller.site == -1


def test_statements_in_the_order_of_execution(plc: Plc, image: Image) -> None:
    plc.write("Main.Go", True)
    sites = [image.sites[row.site] for row in look(plc).of(Statement)]
    lines = [site.line for site in sites if site.file == "steps.st"]
    assert lines == [24, 7, 8, 9, 25, 13, 26, 27, 28, 29]


def test_writes_with_what_was_there_before(plc: Plc, names: Names) -> None:
    plc.write("Main.Go", True)
    plc.write("D12", 3)
    writes = {place.name: (row.old, row.value) for row in look(plc).of(Write)
              if (place := names.at(row.offset, row.bit if row.bit < 8 else None))}  # fmt: skip
    assert writes["Main.Lamp"] == (b"\0", b"\1")
    assert writes["Main.Words[2]"] == (b"\3\0", b"\7\0")
    assert writes["D200"] == (b"\0\0", b"\5\0")
    assert writes["Main.Pairs[1, 2].b"] == (b"\0\0", b"\2\0")
    assert writes["Main.n"] == (b"\0\0", b"\1\0")


def test_reads_with_their_values(plc: Plc, names: Names) -> None:
    plc.write("CIO 100.03", True)
    reads = [(names.at(row.offset, row.bit if row.bit < 8 else None), row.value) for row in look(plc).of(Read)]
    assert (("Main.Lamp"), b"\1") in [(place.name, value) for place, value in reads if place]


def test_phases_stand_between_the_events(plc: Plc) -> None:
    rows = look(plc).rows
    assert (rows[0], rows[-2:]) == (Phase.INPUTS, [Phase.PROGRAM, Phase.REFRESH])


def test_a_trap_comes_back_and_nothing_returns() -> None:
    made = compile_text("PROGRAM Main VAR a : INT; END_VAR a := 1 / a; END_PROGRAM").image
    assert made is not None
    plc = Plc(made)
    log = look(plc)
    assert plc.trap and plc.trap.code == "R0101"
    assert not log.of(Return)


def test_the_engine_is_given_back(plc: Plc) -> None:
    engine = plc.engine
    with observing(plc, Log()):
        assert isinstance(plc.engine, ObservedEngine)
    assert plc.engine is engine
    assert not plc.phases


def test_looking_changes_nothing(image: Image) -> None:
    plain, seen = Plc(image), Plc(image)
    with observing(seen, Log()):
        for scan in range(5):
            for plc in (plain, seen):
                plc.write("Main.Go", scan % 2 == 1)
                plc.scan()
    assert bytes(plain.memory.snapshot()) == bytes(seen.memory.snapshot())


# --- names ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", [
    "Main.n", "Main.Steps[2].Inner.CLK", "Main.Pairs[0, 2].a", "Total", "Main.Words[3]", "D9", "CIO 100", "W5", "A200", "%MB7",
])  # fmt: skip
def test_a_place_is_found_back(plc: Plc, names: Names, path: str) -> None:
    place = plc.find(path)
    found = names.at(place.offset)  # type: ignore[union-attr]
    assert found is not None and found.name == path


@pytest.mark.parametrize("path", ["Main.Lamp", "CIO 100.04", "W5.09", "%MX7.3", "A200.11", "CF113"])
def test_a_bit_is_found_back(plc: Plc, names: Names, path: str) -> None:
    place = plc.find(path)
    found = names.at(place.offset, place.bit)  # type: ignore[union-attr]
    assert found is not None and found.name == path


def test_an_in_out_is_a_reference(plc: Plc, names: Names) -> None:
    steps = plc.find("Main.Steps[1]")
    field = steps.type.fields["N"]  # type: ignore[union-attr]
    place = names.at(steps.offset + field.offset)  # type: ignore[union-attr]
    assert place is not None and (place.name, place.type.name) == ("Main.Steps[1].n", "reference")


def test_what_has_no_name(names: Names, plc: Plc) -> None:
    assert names.at(0) is None
    assert names.at(plc.memory.size - 1) is None
    assert names.instance(0) == ""


def test_the_values_within_some_bytes(plc: Plc, names: Names) -> None:
    pair = plc.find("Main.Pairs[1, 1]")
    inside = names.within(pair.offset, pair.type.size)  # type: ignore[union-attr]
    assert [place.name for place in inside] == ["Main.Pairs[1, 1].a", "Main.Pairs[1, 1].b"]


# --- scan table -------------------------------------------------------------------------------------------------------


def table(plc: Plc, names: Names, *signals: str, every: bool = False) -> ScanTable:
    chosen = [signal for name in signals for signal in signals_of(plc, name)]
    return ScanTable(plc.image.sites, names, chosen, every)


def test_a_row_where_something_changed(plc: Plc, names: Names) -> None:
    made = table(plc, names, "Main.Go", "Main.n", "Main.m")
    with observing(plc, made):
        plc.scan()
        plc.write("Main.Go", True)
        plc.scan()
    assert made.draw() == """\
scan 0   0s     Main.Go   Main.n   Main.m
  inputs        FALSE     0        0
scan 1   10ms
  inputs       >TRUE      0        0
  steps.st:9             >1
  steps.st:25                     >2"""


def test_every_statement_if_wanted(plc: Plc, names: Names) -> None:
    made = table(plc, names, "D200", every=True)
    with observing(plc, made):
        plc.scan()
    labels = [row.label for row in made.bands[0].rows]
    assert labels[:4] == ["inputs", "steps.st:24", "steps.st:7", "R_TRIG.st:13"]
    assert labels[-2:] == ["steps.st:28", "steps.st:29"]


def test_who_wrote_last_also_if_nothing_changed(plc: Plc, names: Names) -> None:
    made = table(plc, names, "Main.m", "Main.Lamp")
    with observing(plc, made):
        plc.run(scans=3)
    m, lamp = made.signals
    assert made.last_change(m) is None
    assert (made.writers[m].scan, made.writers[m].site.line, made.writers[m].instance) == (2, 25, "Main")  # type: ignore[union-attr]
    assert made.writers[lamp].reads == (("Main.Lamp", "FALSE"),)
    assert made.last_change(lamp).new is True  # type: ignore[union-attr]


def test_bits_of_a_word_are_told_apart(plc: Plc, names: Names) -> None:
    made = table(plc, names, "CIO 100.03", "CIO 100.04", "CIO 100")
    with observing(plc, made):
        plc.scan()
    assert [isinstance(signal, Signal) and signal in made.writers for signal in made.signals] == [True, False, True]


def test_a_write_is_one_of_the_bytes_that_it_covers_alone() -> None:
    image = compile_text("PROGRAM Main VAR a, b, c : INT; x, y, z : BOOL; END_VAR b := 1; y := TRUE; END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    made = table(plc, Names.of(image, plc.memory.areas), *[f"Main.{name}" for name in "abcxyz"])
    with observing(plc, made):
        plc.scan()
    assert [signal.label for signal in made.writers] == ["Main.b", "Main.y"]


# --- double writes ----------------------------------------------------------------------------------------------------


@each_of(("body", "writers"), [
    ("lamp := a;\nlamp := TRUE;", ["twice.st:4:1 in Main", "twice.st:5:1 in Main"]), ("lamp := a;\nother := TRUE;", []),
    ("Set(a, lamp);\nSet(TRUE, lamp);", [f"twice.st:1:71 in Set, called by twice.st:{line}:1 in Main" for line in (4, 5)])])
def test_two_statements_that_write_the_same_bit_in_a_scan(body: str, writers: list[str]) -> None:
    made = compile_text("FUNCTION Set VAR_INPUT v : BOOL; END_VAR VAR_IN_OUT q : BOOL; END_VAR q := v; END_FUNCTION\n"
                        f"PROGRAM Main\nVAR a, lamp, other : BOOL; END_VAR\n{body}\nEND_PROGRAM\n", "twice.st").image
    assert made is not None
    assert double_writes(Plc(made), "Main.lamp") == writers


@pytest.mark.slow
@each_of("depth", [*Depth])
def test_behind_a_way_back_memory_is_that_of_the_later_scans(image: Image, depth: Depth) -> None:
    """Also where it is 0 as at the end of the scans that no longer count, but not as in the last one that does."""
    plc, file = Plc(image), io.BytesIO()
    writer = TraceWriter(plc, file, depth)
    plc.write("D700", 7)
    plc.run(scans=2)
    kept = plc.snapshot()
    for _ in range(2):
        plc.restore(kept)
        plc.write("D700", 0)
        plc.run(scans=2)
    writer.close()
    assert [moment.read("D700") for moment in Trace(io.BytesIO(file.getvalue())).moments()] == [7, 7, 0, 0]
