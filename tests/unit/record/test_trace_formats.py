"""Recordings in other formats: VCD, as pyvcd reads it back, and CSV, out and in."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from typing import Any, TextIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of
from trace_rig import image, traced

from fbvm.machine.plc import Plc
from fbvm.record.export.vcd import write_vcd
from fbvm.record.trace.csv_reader import CsvError, read_csv
from fbvm.record.trace.csv_writer import write_csv
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Recorder, Waveforms
from fbvm.record.trace.samples import Samples, samples
from fbvm.record.trace.scan_source import Moment
from fbvm.record.trace.signals import waveforms


def rows(made: Waveforms) -> str:
    file = io.StringIO(newline="")
    write_csv(made, file)
    return file.getvalue()


def as_trace(text: str) -> Trace:
    out = io.BytesIO()
    count = read_csv(io.StringIO(text, newline=""), out)
    trace = Trace(io.BytesIO(out.getvalue()))
    assert count == len(trace.scans)
    return trace


NAMES = ["Main.Pump", "Main.Delay.ET", "Main.Starts.CV", "Main.Mode", "Main.Text", "Main.Both[2].b", "D200", "CIO 0.00"]


# --- CSV --------------------------------------------------------------------------------------------------------------


def test_a_row_is_a_scan() -> None:
    assert rows(waveforms(traced(10), NAMES, range(6, 9))) == """\
scan,time_ms,Main.Pump,Main.Delay.ET [ms],Main.Starts.CV,Main.Mode,Main.Text,Main.Both[2].b,D200,CIO 0.00
6,60,FALSE,30,0,Low,,3.5,0,TRUE
7,70,FALSE,40,0,Low,,4.0,0,TRUE
8,80,TRUE,50,1,High,on,4.5,7,TRUE
"""


def test_times_below_a_millisecond_are_kept() -> None:
    plc = Plc(image(), cycle_ns=1_500_000)
    made = Recorder(plc, ["D200"])
    plc.run(scans=3)
    assert [line.split(",")[1] for line in rows(made).splitlines()[1:]] == ["0", "1.5", "3"]


def test_a_real_has_the_digits_that_it_needs() -> None:
    plc = Plc(image("PROGRAM Main VAR r : REAL := 0.1; l : LREAL := 0.1; END_VAR r := r * 3.0; l := l * 3.0; END_PROGRAM"))
    made = Recorder(plc, ["Main.r", "Main.l"])
    plc.scan()
    assert rows(made).splitlines()[1] == "0,0,0.3,0.30000000000000004"


@pytest.mark.slow
def test_what_goes_out_comes_in() -> None:
    text = rows(waveforms(traced(30), NAMES))
    back = as_trace(text)
    assert rows(waveforms(back, NAMES)) == text
    assert back.at(8).read("Main.Delay.ET") == 50_000_000
    assert back.scans == range(30)


def test_arrays_dates_and_large_numbers_go_out_and_in() -> None:
    plc = Plc(image("""TYPE P : STRUCT n : ULINT := 16#FFFF_FFFF_FFFF_FFFF; t : ARRAY[-1..0, 2..3] OF TIME; END_STRUCT END_TYPE
PROGRAM Main VAR d : DATE := D#2024-02-29; at_ : DT := DT#2024-02-29-12:30:00; p : ARRAY[1..3] OF P; END_VAR
p[2].t[-1, 3] := p[2].t[-1, 3] + T#1ms; p[3].t[0, 2] := T#1us; END_PROGRAM"""))
    names = ["Main.d", "Main.at_", "Main.p[2].n", "Main.p[2].t[-1, 3]", "Main.p[3].t[0, 2]"]
    made = Recorder(plc, names)
    plc.run(scans=2)
    text = rows(made)
    assert text == """\
scan,time_ms,Main.d,Main.at_,Main.p[2].n,"Main.p[2].t[-1, 3] [ms]","Main.p[3].t[0, 2] [ms]"
0,0,D#2024-02-29,DT#2024-02-29-12:30:00,18446744073709551615,1,0.001
1,10,D#2024-02-29,DT#2024-02-29-12:30:00,18446744073709551615,2,0.001
"""
    assert rows(waveforms(as_trace(text), names)) == text


def test_a_table_from_elsewhere_becomes_a_trace() -> None:
    trace = as_trace("scan,time_ms,Tank.Level,Tank.Full,D5,Speed\n3,0.5,-7,FALSE,9,1.5\n4,2,8,TRUE,,2\n")
    assert trace.at(4).read("Tank") == {"Level": 8, "Full": True}
    assert (trace.at(4).read("D5"), trace.at(4).read("Speed"), trace.at(3).now_ns) == (9, 2.0, 500_000)


def test_an_empty_cell_is_the_empty_text_and_for_others_the_value_that_they_have() -> None:
    trace = as_trace("scan,time_ms,s,n,t [ms],r,b\n0,0,,,,,\n1,1,on,7,5,0.5,TRUE\n2,2,,,,,\n")
    seen = [[trace.at(scan).read(name) for name in ("s", "n", "t", "r", "b")] for scan in trace.scans]
    assert seen == [["", 0, 0, 0.0, False], ["on", 7, 5_000_000, 0.5, True], ["", 7, 5_000_000, 0.5, True]]


def test_a_text_that_becomes_empty_goes_out_and_in() -> None:
    text = "scan,time_ms,s\n3,0,\n4,10,on\n5,20,\n6,30,off\n"
    assert rows(waveforms(as_trace(text), ["s"])) == text


def test_names_are_those_of_the_language_and_empty_lines_no_scans() -> None:
    trace = as_trace("\nscan,time_ms,Tank.Level,TANK.full,tank.Pumps[1].on,Tank.pumps[2].On\n\n3,1,7,TRUE,FALSE,TRUE\n\n")
    assert trace.at(3).read("Tank") == {"Level": 7, "full": True, "Pumps": [{"on": False}, {"on": True}]}


@each_of(("cells", "kind"), [
    (["TRUE", "FALSE"], "BOOL"), ([""], "BOOL"), (["TRUE", "1"], "STRING[4]"), (["1", "-2", "+3"], "LINT"),
    (["9223372036854775807"], "LINT"), (["9223372036854775808"], "ULINT"), (["1", "2.5"], "LREAL"), (["-1e9", "nan"], "LREAL"),
    (["inf", "-inf"], "LREAL"), (["1.", "2"], "LREAL"), (["x", "1"], "STRING[1]"), (["x" * 254], "STRING[254]"),
    (["1 "], "STRING[2]"),
])
def test_a_column_has_the_narrowest_type_that_holds_its_cells(cells: list[str], kind: str) -> None:
    trace = as_trace("scan,time_ms,a\n" + "".join(f"{at},{at},{cell}\n" for at, cell in enumerate(cells)))
    assert trace.find("a").type.name == kind


@each_of(("text", "said"), [
    ("", "line 1: the first two columns"),
    ("time,scan\n", "line 1: the first two columns"),
    ("scan,time_ms,a\n1,2\n", "line 2: 2 cells, 3 expected"),
    ("scan,time_ms,a b\n", "line 1: 'a b' is neither"),
    ("scan,time_ms,a,a\n", "line 1: a stands there twice"),
    ("scan,time_ms,a,a.b\n", "line 1: a is a variable and has members"),
    ("scan,time_ms,a[1],a.b\n", "line 1: a has elements and members"),
    ("scan,time_ms,a[1],a[1].b\n", "line 1: a is a variable and has members"),
    ("scan,time_ms,a[1],a[2].b\n", "line 1: the elements of a differ"),
    ('scan,time_ms,a[1],"a[1,2]"\n', "line 1: the elements of a differ"),
    ("scan,time_ms,a[1],a[2000000000]\n", "line 1: a has 2000000000 elements, and no"),
    ("scan,time_ms,a[1].b[1],a[90000].b[90000]\n", "line 1: a has 90000 elements, and no"),
    ("scan,time_ms,a[]\n", "line 1: 'a\\[\\]' is neither"),
    ("scan,time_ms,a\nx,2,3\n", "line 2: 'x' is no number of a scan"),
    ("scan,time_ms,a\n-1,2,3\n", "line 2: '-1' is no number of a scan"),
    ("scan,time_ms,a\n9223372036854775807,2,3\n", "line 2: '9223372036854775807' is no number of a scan"),
    ("scan,time_ms,a\n5,1,3\n\n8,2,3\n", "line 4: scan 8 stands where scan 6 belongs"),
    ("scan,time_ms,a\n0,1,3\n0,2,3\n", "line 3: scan 0 stands where scan 1 belongs"),
    ("scan,time_ms,a\n5,1,3\n6,2,3\n4,3,3\n", "line 4: scan 4 stands where scan 7 belongs"),
    ("scan,time_ms,a\n1,x,3\n", "line 2: 'x' is no number of milliseconds"),
    ("scan,time_ms,a\n1,nan,3\n", "line 2: 'nan' is no number of milliseconds"),
    ("scan,time_ms,a\n1,1e999999,3\n", "line 2: 1e999999 ms are more than 64 bits of nanoseconds hold"),
    ("scan,time_ms,a\n1,9223372036854.775808,3\n", "line 2: 9223372036854.775808 ms are more than 64 bits"),
    ('scan,time_ms,a\n1,5,"two\nlines"\n\n2,6\n', "line 5: 2 cells, 3 expected"),
    ("scan,time_ms,D5,DM5\n", "line 1: DM5 stands there twice"), ("scan,time_ms,a.b,A.B\n", "line 1: A.B stands there twice"),
    ("scan,time_ms,a.b,A\n", "line 1: A stands there twice"), ("scan,time_ms,a,A.b\n", "line 1: A is a variable and has members"),
    ('scan,time_ms,"a[1, 2]","A[1,2]"\n', r"line 1: A\[1,2\] stands there twice"),
    ("scan,time_ms,a [ms],a\n", "line 1: a stands there twice"),
    ("scan,time_ms,a\n1,5,3\n2,4,3\n", "line 3: time runs forward only"),
    (f"scan,time_ms,a\n1,5,{'9' * 5000}\n", "line 2: a: 10{40} is out of range of ULINT"),
    ("scan,time_ms,D5\n1,5,99999\n", "line 2: D5: 99999 is out of range"),
])  # fmt: skip
def test_what_is_no_such_table(text: str, said: str) -> None:
    with pytest.raises(CsvError, match=said):
        read_csv(io.StringIO(text, newline=""), io.BytesIO())


@pytest.mark.slow
@given(st.lists(st.tuples(st.booleans(), st.integers(-(1 << 63), (1 << 63) - 1), st.floats(allow_nan=False),
                          st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=20)), min_size=1))  # fmt: skip
def test_any_values_go_out_and_in(values: list[tuple[Any, ...]]) -> None:
    lines = [f'{n},{n},{b!s},{i},{f!r},"x{t.replace(chr(34), chr(34) * 2)}"' for n, (b, i, f, t) in enumerate(values)]
    text = "scan,time_ms,b,i,f,t\n" + "\n".join(lines).replace("True", "TRUE").replace("False", "FALSE") + "\n"
    again = rows(waveforms(as_trace(text), ["b", "i", "f", "t"]))
    assert rows(waveforms(as_trace(again), ["b", "i", "f", "t"])) == again
    assert len(again.splitlines()) == len(values) + 1


# --- VCD --------------------------------------------------------------------------------------------------------------


def dump(made: Waveforms) -> str:
    pytest.importorskip("vcd")
    file = io.StringIO()
    write_vcd(made, file)
    return file.getvalue()


def variables(text: str) -> tuple[dict[str, list[tuple[int, Any]]], list[str]]:
    """What pyvcd reads: changes by full name, and the scopes."""
    from vcd.reader import TokenKind, tokenize

    names: dict[str, str] = {}
    scopes: list[str] = []
    inner: list[str] = []
    changes: dict[str, list[tuple[int, Any]]] = {}
    now = 0
    for token in tokenize(io.BytesIO(text.encode())):
        if token.kind is TokenKind.SCOPE:
            inner.append(token.scope.ident)
            scopes.append(".".join(inner))
        elif token.kind is TokenKind.UPSCOPE:
            inner.pop()
        elif token.kind is TokenKind.VAR:
            names[token.var.id_code] = ".".join([*inner, token.var.reference])
        elif token.kind is TokenKind.CHANGE_TIME:
            now = token.time_change
        elif token.kind.name.startswith("CHANGE_"):
            change = token.data
            changes.setdefault(names[change.id_code], []).append((now, change.value))
    return changes, scopes


def test_pyvcd_reads_it_back() -> None:
    changes, scopes = variables(dump(waveforms(traced(12), NAMES)))
    assert {"Main", "Main.Delay", "Main.Starts", "fbvm", "memory.D", "memory.CIO"} <= set(scopes)
    assert changes["Main.Pump"] == [(0, "0"), (80_000_000, "1")]
    assert changes["Main.Delay.ET"][-1] == (80_000_000, 50_000_000)
    assert changes["Main.Mode"] == [(0, "Low"), (80_000_000, "High")]
    assert changes["Main.Both(2).b"][:2] == [(0, 0.5), (10_000_000, 1.0)]
    assert changes["memory.D.D200"] == [(0, 0), (80_000_000, 7)]
    assert changes["memory.CIO.CIO0_00"] == [(0, "0"), (30_000_000, "1")]


def test_the_scan_is_a_signal() -> None:
    changes, _ = variables(dump(waveforms(traced(5), ["D200"])))
    assert changes["fbvm.scan"] == [(scan * 10_000_000, scan) for scan in range(5)]


def test_negative_numbers_and_texts_with_blanks() -> None:
    text = "PROGRAM Main VAR n : INT; s : STRING[9]; END_VAR n := n - 1; s := 'a b'; END_PROGRAM"
    plc = Plc(image(text))
    made = Recorder(plc, ["Main.n", "Main.s"])
    plc.run(scans=2)
    changes, _ = variables(dump(made))
    assert changes["Main.n"][-1][0] == 10_000_000
    assert changes["Main.n"][-1][1] & 0xFFFF == 0xFFFE
    assert changes["Main.s"] == [(0, "a_b")]


class _Read:
    """Goes through the scans of a trace, and knows how far it has come."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, trace: Trace) -> None:
        self.scans = 0
        moments = trace.moments

        def counted(scans: range | None = None) -> Iterator[Moment]:
            for moment in moments(scans):
                self.scans = moment.scans
                yield moment

        monkeypatch.setattr(trace, "moments", counted)


@pytest.mark.slow
@pytest.mark.parametrize("write", [write_csv, write_vcd])
def test_each_scan_is_written_when_it_has_been_read(
    write: Callable[[Samples, TextIO], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is written follows what is read: nothing waits in memory for the end of the run."""
    pytest.importorskip("vcd")
    trace = traced(300)
    read = _Read(monkeypatch, trace)
    reached: list[int] = []

    class File(io.StringIO):
        def write(self, text: str) -> int:
            reached.append(read.scans)
            return super().write(text)

    found, whole = File(), io.StringIO()
    write(samples(trace, ["Main.Pump", "Main.Both[2].b"]), found)
    assert set(range(1, 300)) <= set(reached)
    write(waveforms(trace, ["Main.Pump", "Main.Both[2].b"]), whole)
    assert found.getvalue() == whole.getvalue()


@pytest.mark.slow
def test_without_names_what_changes_is_written() -> None:
    trace = traced(30)
    assert [signal.label for signal in samples(trace).signals] == [track.signal.label for track in waveforms(trace).tracks]
    assert [signal.label for signal in samples(trace, scans=range(2)).signals] == [
        track.signal.label for track in waveforms(trace, scans=range(2)).tracks]
