"""Traces: what is written is what is read, at every depth, while it grows, and from damaged files."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of
from trace_rig import TEXT, image, press, record, traced

from fbvm import Depth, Trace, TraceWriter
from fbvm.base.types import ArrayType, EnumType, StringType, StructType, SubrangeType
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Phase, Plc
from fbvm.record.draw.chart import draw
from fbvm.record.draw.table import ScanTable
from fbvm.record.trace import symbols
from fbvm.record.trace.events import Call, Event, Frame, Read, Return, Statement, Write
from fbvm.record.trace.format import (
    BLOCK,
    CONTACT,
    FRAME,
    MAGIC,
    READ,
    SCAN,
    STATEMENT,
    Cursor,
    TraceError,
    chunks,
    put,
    read_chunk,
    write_chunk,
    xor,
)
from fbvm.record.trace.observing import observing
from fbvm.record.trace.selection import select, single_places, symbol_places
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.writer import START
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, UnknownPlace

# --- values at the end of each scan -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_whole_memory_of_every_scan_comes_back() -> None:
    plc, states = Plc(image()), []
    plc.watchers.append(lambda plc: states.append(bytes(plc.memory.snapshot())[START:]))
    trace = Trace(io.BytesIO(record(plc, 250)))
    assert trace.scans == range(250)
    for moment in trace.moments():
        assert bytes(moment.memory.u8[START:]) == states[moment.scans]
    for scan in (0, 99, 100, 101, 249):
        assert bytes(trace.at(scan).memory.u8[START:]) == states[scan]


@pytest.mark.slow
def test_values_are_read_by_name() -> None:
    trace = traced()
    assert trace.at(41).read("Main.Delay.ET") == 50_000_000
    assert trace.at(41).read("D199..D200") == [0, 7]
    assert trace.at(41).read("Main.Both[2]") == {"a": 0, "b": 21.0}
    assert trace.at(41).now_ns == 410_000_000
    assert trace.at(2).read("CIO 0.00") is False


def test_where_sizes_are_apart_addresses_are_those_of_their_size() -> None:
    text = "PROGRAM Main VAR lamp AT %QX0.1 : BOOL; n AT %QW0 : INT; END_VAR n := n + 1; lamp := n > 1; END_PROGRAM"
    made = compile_text(text, dialect="matiec").image
    assert made is not None
    plc, file = Plc(made), io.BytesIO()
    with_trace = TraceWriter(plc, file, Depth.SCANS)
    plc.run(scans=3)
    with_trace.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    assert [[trace.at(scan).read(name) for name in ("%QW0", "%QX0.1", "%QX0.0")] for scan in range(3)] == [
        [1, False, False], [2, True, False], [3, True, False]]
    assert trace.names.address(trace.find("Main.lamp")) == "%QX0.1"
    with pytest.raises(UnknownPlace, match="names no address such as %QB0"):
        trace.at(0).read("%QB0")


@pytest.mark.slow
def test_a_scan_that_is_not_there() -> None:
    with pytest.raises(ValueError, match="scan 10 is not in the trace, which has scans 0 to 9"):
        traced(10).at(10)
    with pytest.raises(ValueError, match="which has no scans"):
        traced(0).at(0)


def test_a_recording_begins_where_it_begins() -> None:
    plc = Plc(image())
    plc.write("D5", 77)
    plc.run(scans=7)
    trace = Trace(io.BytesIO(record(plc, 3)))
    assert trace.scans == range(7, 10)
    assert trace.at(7).read("D5") == 77


@pytest.mark.slow
def test_time_travel_writes_over_what_was_undone() -> None:
    plc, file = Plc(image()), io.BytesIO()
    writer = TraceWriter(plc, file)
    plc.run(scans=120)
    state = plc.snapshot()
    plc.write("D5", 1)
    plc.run(scans=30)
    plc.restore(state)
    plc.write("D5", 2)
    plc.run(scans=10)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    assert [moment.scans for moment in trace.moments()] == list(range(130))
    assert (trace.at(119).read("D5"), trace.at(125).read("D5")) == (0, 2)


def test_a_trapped_scan_is_the_last_one() -> None:
    plc = Plc(image("PROGRAM Main VAR n : INT := 3; m : INT; END_VAR n := n - 1; m := 6 / n; END_PROGRAM"))
    file = io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=9)
    writer.close()
    trace = Trace(io.BytesIO(file.getvalue()))
    assert trace.scans == range(3)
    assert (trace.at(2).read("Main.n"), trace.at(2).read("Main.m")) == (0, 6)


# --- what happened inside ---------------------------------------------------------------------------------------------


class Log:
    """Events without their frames' identity."""

    def __init__(self, names: Names) -> None:
        self.rows: list[Any] = []
        self.names = names

    def phase(self, plc: Any, phase: Phase) -> None:
        self.rows.append((plc.scans, phase, plc.read("Main.Both[2].b"), plc.read("CIO 0.00")))

    def event(self, plc: Any, event: Event) -> None:
        frame = event.frame
        fields = [getattr(event, name) for name in ("site", "offset", "bit", "old", "value") if hasattr(event, name)]
        self.rows.append((type(event).__name__, self._path(frame), *fields, plc.read("Main.Pump")))

    def _path(self, frame: Frame) -> tuple[Any, ...]:
        caller = frame.caller
        above = self._path(caller) if caller is not None and caller.body >= 0 else ()
        return (*above, frame.body, self.names.instance(frame.base), frame.site)


@pytest.mark.slow
def test_a_trace_tells_what_a_listener_was_told() -> None:
    plc = Plc(image())
    names = Names.of(plc.image, plc.memory.areas)
    live, told = Log(names), Log(names)
    file = io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.phases.append(live.phase)
    report, plc.engine.report = plc.engine.report, lambda event: (report(event), live.event(plc, event))  # type: ignore[attr-defined]
    for _ in range(12):
        press(plc)
        plc.scan()
    writer.close()
    Trace(io.BytesIO(file.getvalue())).follow(told)
    assert told.rows == live.rows


@pytest.mark.parametrize(("depth", "kinds"), [
    (Depth.SCANS, set()), (Depth.WRITES, {Call, Write}), (Depth.STATEMENTS, {Call, Return, Statement, Read, Write}),
])  # fmt: skip
def test_each_depth_holds_its_events(depth: Depth, kinds: set[type]) -> None:
    found: set[type] = set()

    class Kinds:
        def phase(self, plc: Any, phase: Phase) -> None:
            pass

        def event(self, plc: Any, event: Event) -> None:
            found.add(type(event))

    traced(5, depth).follow(Kinds())
    assert found == kinds


@pytest.mark.slow
def test_the_scan_table_of_a_trace_is_that_of_the_plc() -> None:
    plc = Plc(image())
    names = Names.of(plc.image, plc.memory.areas)
    trace = traced(12, Depth.STATEMENTS)
    made = waveforms(trace, ["Main.Start", "Main.Pump", "D200"])
    signals = [track.signal for track in made.tracks]
    live, told = ScanTable(plc.image.sites, names, signals), ScanTable(trace.sites, trace.names, signals)
    with observing(plc, live):
        for _ in range(12):
            press(plc)
            plc.scan()
    trace.follow(told)
    assert told.draw() == live.draw()
    assert "pump.st:19" in told.draw()


def test_the_engine_is_given_back() -> None:
    plc = Plc(image())
    engine = plc.engine
    record(plc, 3, Depth.WRITES)
    assert plc.engine is engine
    assert not plc.watchers and not plc.phases


# --- selection --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of(("patterns", "found"), [
    (["Main.Delay.Q"], ["Main.Delay.Q"]),
    (["main.*.q"], ["Main.Delay.Q", "Main.Starts.Q"]),
    (["Main.Both[*].b"], ["Main.Both[1].b", "Main.Both[2].b"]),
    (["Main.Words[*]"], ["Main.Words"]),
    (["D200..D202", "CIO 5.03"], ["D200", "D201", "D202", "CIO 5.03"]),
    (["Main.Delay"], ["Main.Delay"]),
])  # fmt: skip
def test_patterns_name_places(patterns: list[str], found: list[str]) -> None:
    plc = Plc(image())
    assert [place.name for place in select(plc.image.symbols, plc.memory.areas, patterns).places] == found


def test_a_pattern_that_fits_nothing() -> None:
    plc = Plc(image())
    with pytest.raises(UnknownPlace, match=r"called like Main.\*.Foo"):
        select(plc.image.symbols, plc.memory.areas, ["Main.*.Foo"])
    with pytest.raises(UnknownPlace, match="Foo"):
        TraceWriter(plc, io.BytesIO(), selected=["Main.Foo"])


@pytest.mark.slow
def test_only_what_is_selected_is_kept() -> None:
    trace = traced(200, Depth.STATEMENTS, ["Main.Delay", "D200"])
    moment = trace.at(41)
    assert (moment.read("Main.Delay.ET"), moment.read("D200"), moment.read("Main.Both[2].b")) == (50_000_000, 7, 0.0)
    assert {track.signal.label for track in waveforms(trace).tracks} == {
        "Main.Delay.IN", "Main.Delay.Q", "Main.Delay.ET", "Main.Delay.Running", "Main.Delay.Start", "D200",
    }  # fmt: skip


def test_a_program_stands_for_its_located_variables() -> None:
    trace = traced(20, Depth.SCANS, ["Main"])
    assert trace.at(10).read("CIO 0.00") is True


# --- charts and lines -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_chart_of_some_scans() -> None:
    assert draw(waveforms(traced(), ["Main.Start", "Main.Pump", "D200"], range(2, 12))) == """
        Main.Start  .#########
        Main.Pump   ......####
        D200        0     |7
    """


def test_without_names_what_changed_is_charted() -> None:
    labels = [track.signal.label for track in waveforms(traced(12)).tracks]
    assert "Main.Delay.ET" in labels and "Main.Mode" in labels
    assert "Main.Few" not in labels and "Main.Words[0]" not in labels


def test_lines_of_the_source_travel_along() -> None:
    trace = traced(3)
    site = next(site for site in trace.sites if (site.file, site.line) == ("pump.st", 17))
    assert trace.line(site) == "Pump := Delay.Q;"
    assert trace.line(next(site for site in trace.sites if site.file != "pump.st")) == ""


# --- growing and damaged files ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_trace_is_read_while_it_grows() -> None:
    plc, file = Plc(image()), io.BytesIO()
    writer = TraceWriter(plc, file)
    reader = io.BytesIO()

    def copy() -> None:
        reader.seek(0, 2)
        reader.write(file.getvalue()[reader.tell() :])

    copy()
    reader.seek(0)
    trace = Trace(reader)
    assert trace.scans == range(0)
    plc.run(scans=130)
    copy()
    trace.refresh()
    assert trace.scans == range(100)
    writer.flush()
    copy()
    trace.refresh()
    assert trace.at(129).read("Main.Both[2].b") == 65.0


@pytest.mark.slow
@pytest.mark.parametrize("cut", [1, 10, 30])
def test_a_block_that_is_cut_off_is_not_there(cut: int) -> None:
    data = record(Plc(image()), 150)
    assert Trace(io.BytesIO(data[:-cut])).scans == range(100)


def test_what_is_no_trace_says_so() -> None:
    with pytest.raises(TraceError, match="no trace"):
        Trace(io.BytesIO(b"PROGRAM Main"))
    with pytest.raises(TraceError, match="no header yet"):
        Trace(io.BytesIO(MAGIC))
    with pytest.raises(TraceError, match="header is damaged"):
        Trace(io.BytesIO(_with_header(b"[]")))
    with pytest.raises(TraceError, match="format 9"):
        Trace(io.BytesIO(_with_header(b'{"format":9}')))
    with pytest.raises(TraceError, match="header is damaged"):
        Trace(io.BytesIO(_with_header(b'{"format":1}')))


def _with_header(payload: bytes) -> bytes:
    from fbvm.record.trace.format import HEADER, write_chunk

    file = io.BytesIO()
    file.write(MAGIC)
    write_chunk(file, HEADER, payload)
    return file.getvalue()


def test_scans_with_other_numbers_than_their_block_says_are_told() -> None:
    data = io.BytesIO(record(Plc(image()), 5))
    data.seek(len(MAGIC))
    _, block = chunks(data)
    damaged = io.BytesIO(data.getvalue()[: block.at])
    damaged.seek(0, io.SEEK_END)
    write_chunk(damaged, BLOCK, read_chunk(data, block.at), first=1, scans=5)
    damaged.seek(0)
    with pytest.raises(TraceError, match="scan 0 stands where scan 1 belongs"):
        list(Trace(damaged).moments())


@pytest.mark.parametrize(("scans", "behind", "message"), [
    (9, 9, "scans 5 to 8 are missing"),
    (5, 7, "scans 5 to 6 are missing"),
])
def test_scans_that_are_missing_are_told(scans: int, behind: int, message: str) -> None:
    """Charts and tables have a column for each scan."""
    data = io.BytesIO(record(Plc(image()), 5))
    data.seek(len(MAGIC))
    _, block = chunks(data)
    damaged = io.BytesIO(data.getvalue()[: block.at])
    damaged.seek(0, io.SEEK_END)
    write_chunk(damaged, BLOCK, read_chunk(data, block.at), first=0, scans=scans)
    write_chunk(damaged, BLOCK, b"\0", first=behind, scans=1)
    damaged.seek(0)
    with pytest.raises(TraceError, match=message):
        list(Trace(damaged).moments())


def test_a_reference_that_leads_out_of_the_memory_is_told() -> None:
    plc = Plc(image("PROGRAM Main VAR a : INT; r : REF_TO INT; END_VAR r := REF(a); END_PROGRAM"))
    moment = Trace(io.BytesIO(record(plc, 2, before=lambda plc: None))).at(1)
    place = moment.find("Main.r")
    assert isinstance(place, Place)
    moment.memory.u8[place.offset : place.offset + 8] = b"\x7f" * 8
    with pytest.raises(TraceError, match="the memory of scan 1 is damaged"):
        moment.read("Main.r^")


def test_a_damaged_block_is_told() -> None:
    data = bytearray(record(Plc(image()), 50))
    data[-5] ^= 0x40
    trace = Trace(io.BytesIO(bytes(data)))
    with pytest.raises(TraceError, match="is damaged"):
        trace.at(49)


@pytest.mark.parametrize("tag", [STATEMENT, READ, CONTACT])
def test_a_statement_that_the_trace_does_not_have_is_told(tag: int) -> None:
    """What shows events looks its line up."""
    data = record(Plc(image()), 1)
    body = bytearray()
    put(body, 0, SCAN, 0, 0, FRAME, 0, START, 0, 0, tag, 0, 9999, 0, 0, 0, 0)
    whole = io.BytesIO()
    whole.write(data[: Trace(io.BytesIO(data))._blocks[0].at])
    write_chunk(whole, BLOCK, bytes(body), 0, 1)
    whole.seek(0)

    class Ignoring:
        def phase(self, moment: object, phase: object) -> None:
            """Nothing is kept."""

        def event(self, moment: object, event: object) -> None:
            """Nothing is kept."""

    with pytest.raises(TraceError, match="there is no statement"):
        Trace(whole).follow(Ignoring())


@pytest.mark.slow
@given(st.binary(max_size=200), st.integers(0, 400))
def test_any_bytes_give_a_trace_or_an_error(noise: bytes, at: int) -> None:
    data = bytearray(good())
    data[at : at + len(noise)] = noise
    try:
        trace = Trace(io.BytesIO(bytes(data)))
        for moment in trace.moments():
            assert moment.scans in trace.scans
    except TraceError as error:
        assert str(error)


@cache
def good() -> bytes:
    return record(Plc(image()), 20, Depth.STATEMENTS)


# --- numbers and symbols ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@given(st.lists(st.integers(0, 1 << 70)))
def test_numbers_come_back(numbers: list[int]) -> None:
    out = bytearray()
    put(out, *numbers)
    cursor = Cursor(bytes(out))
    assert [cursor.number() for _ in numbers] == numbers
    assert not cursor.more


@pytest.mark.slow
@given(st.binary(min_size=1), st.data())
def test_xor_undoes_itself(a: bytes, data: st.DataObject) -> None:
    b = data.draw(st.binary(min_size=len(a), max_size=len(a)))
    assert xor(xor(a, b), b) == a


def test_symbols_come_back() -> None:
    made = compile_text(TEXT + "VAR_GLOBAL G : ARRAY[0..1, 2..3] OF STRING[5]; END_VAR").image
    assert made is not None
    back = symbols.from_data(symbols.to_data(made.symbols))
    assert back == made.symbols
    main, known = back["MAIN"].type, made.symbols["MAIN"].type
    assert isinstance(main, StructType) and isinstance(known, StructType)
    assert main.fields == known.fields
    kinds = {type(field.type) for field in main.fields.values()}
    assert {ArrayType, EnumType, StringType, StructType, SubrangeType} <= kinds


@pytest.mark.parametrize("data", [{}, {"types": [], "symbols": [5]}, {"types": [], "symbols": [["a", ["?"], 0, "", None, 1]]}])
def test_what_are_no_symbols(data: dict[str, Any]) -> None:
    with pytest.raises(symbols.SymbolError, match="no symbols"):
        symbols.from_data(data)


def structure(name: str, inner: Any) -> list[Any]:
    return [name, 8, 8, False, [["part", inner, 0, "VAR", None, 0]]]


@pytest.mark.slow
@pytest.mark.parametrize(("types", "message"), [
    ([structure("A", ["struct", 0])], "A holds itself"),
    ([structure("A", ["struct", 1]), structure("B", ["array", [[0, 1]], ["struct", 0]])], "holds itself"),
    ([structure(f"S{number}", ["struct", number + 1]) for number in range(200)] + [structure("Last", "INT")], "deeper than 200"),
])  # fmt: skip
def test_types_that_only_damage_makes(types: list[Any], message: str) -> None:
    with pytest.raises(symbols.SymbolError, match=message):
        symbols.from_data({"types": types, "symbols": [["a", ["struct", 0], 0, "VAR", None, 0]]})


def test_a_type_may_refer_to_itself() -> None:
    types = [structure("A", ["ref", "REF_TO A", ["struct", 0], False, False])]
    found = symbols.from_data({"types": types, "symbols": [["a", ["struct", 0], 0, "VAR", None, 0]]})
    assert found["A"].type.name == "A"


def test_references_may_lead_through_thousands_of_types() -> None:
    last = 3000
    types = [structure(f"S{number}", ["ref", "", ["struct", number + 1], False, False]) for number in range(last)]
    data = {"types": [*types, structure("Last", "INT")], "symbols": [["a", ["struct", 0], 0, "VAR", None, 0]]}
    assert symbols.to_data(symbols.from_data(data)) == data


@pytest.mark.parametrize("selected", [(), ("Main.*",)])
def test_references_are_left_out_of_a_chart_of_everything(selected: Sequence[str]) -> None:
    plc = Plc(image("PROGRAM Main\nVAR a : INT; r : REF_TO INT; p : POINTER TO INT; f : REFERENCE TO INT;\n"
                    "both : ARRAY[1..2] OF REF_TO INT; END_VAR\n"
                    "a := a + 1; r := REF(a); p := ADR(a); f REF= a; both[2] := r;\nEND_PROGRAM"))
    trace = Trace(io.BytesIO(record(plc, 3, selected=selected, before=lambda plc: None)))
    assert [track.signal.label for track in waveforms(trace).tracks] == ["Main.a"]
    assert [track.changes for track in waveforms(trace, ["Main.r", "Main.p"]).tracks] == [[(0, "-> Main.a")]] * 2


def test_what_references_lead_to_is_read_from_a_trace() -> None:
    plc = Plc(image("TYPE Node : STRUCT n : INT; next : REF_TO Node; END_STRUCT END_TYPE\n"
                    "PROGRAM Main VAR a : ARRAY[0..1] OF Node; r : REF_TO Node; p : POINTER TO INT; f : REFERENCE TO INT;"
                    " none : REF_TO INT; END_VAR\n"
                    "a[0].n := a[0].n + 1; a[1].n := 7; a[0].next := REF(a[1]); r := REF(a[0]); p := ADR(a[1].n); f REF= a[0].n;"
                    "\nEND_PROGRAM"))
    trace = Trace(io.BytesIO(record(plc, 3, before=lambda plc: None)))
    names = ["Main.r^.n", "Main.r^.next^.n", "Main.p^", "Main.f", "Main.none^"]
    assert [trace.at(2).read(name) for name in names] == [plc.read(name) for name in names] == [3, 7, 7, 3, None]
    assert [track.changes for track in waveforms(trace, ["Main.f"]).tracks] == [[(0, 1), (1, 2), (2, 3)]]
    assert [track.signal.label for track in waveforms(trace).tracks] == ["Main.a[0].n"]


def test_small_arrays_are_charted_element_by_element_whatever_their_subscripts() -> None:
    made = compile_text("PROGRAM Main VAR a : ARRAY [0..1, 3..4] OF INT; b : ARRAY [1..2] OF BOOL; c : ARRAY [0..32] OF INT; "
                        "END_VAR a[0, 3] := c[0]; b[1] := TRUE; END_PROGRAM").image
    assert made is not None
    names = [single.name for place in symbol_places(made.symbols) for single in single_places(place)]
    assert names == ["Main.a[0, 3]", "Main.a[0, 4]", "Main.a[1, 3]", "Main.a[1, 4]", "Main.b[1]", "Main.b[2]"]
