"""What references lead to, by name, wherever values are shown."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from page_rig import ReadPage
from rows import each_of
from trace_rig import record

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import draw
from fbvm.record.draw.table import ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.export.vcd import write_vcd
from fbvm.record.page.data import page_data
from fbvm.record.trace.csv_writer import write_csv
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.samples import chosen_signals
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.writer import Depth
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport
from fbvm.watch.names import Names
from fbvm.watch.paths import Place

TEXT = """\
TYPE Part : STRUCT x, y : INT; END_STRUCT END_TYPE
TYPE Box : STRUCT p : Part; text : STRING[10]; END_STRUCT END_TYPE
FUNCTION_BLOCK Node
VAR_INPUT next : POINTER TO Node; END_VAR
VAR_IN_OUT io : INT; END_VAR
VAR own : INT; q, kept : POINTER TO INT; END_VAR
    q := ADR(own); kept := ADR(io);
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    a : ARRAY[0..4] OF INT; b : Box; n : ARRAY[1..2] OF Node; i : INT;
    Level AT D200 : WORD; Lamp AT CIO 100.02 : BOOL;
    element, member, away, before, none : POINTER TO INT; odd : POINTER TO BYTE;
    part : POINTER TO Part; box : REF_TO Box; all : POINTER TO ARRAY[0..4] OF INT; text : POINTER TO STRING[10];
    node : POINTER TO Node; tank : POINTER TO WORD; light : POINTER TO BOOL;
    direct, mark : POINTER TO WORD; two : ARRAY[0..1] OF REF_TO INT; past : POINTER TO WORD;
END_VAR
    element := ADR(a) + 2 * i; member := ADR(b.p.x); away := ADR(a) + 10; before := ADR(a) - 1; odd := ADR(a) + 3;
    part := ADR(b.p); box := REF(b); all := ADR(a); text := ADR(b.text); node := ADR(n[2]);
    tank := ADR(Level); light := ADR(Lamp); direct := ADR(%D300); mark := ADR(%MW20); two[1] := REF(b.p.y);
    past := ADR(%D0) - 2;
    n[1](next := ADR(n[2]), io := i);
    i := i + 1;
END_PROGRAM
"""
LEADS = [
    ("element", "-> Main.a[2]"), ("member", "-> Main.b.p.x"), ("part", "-> Main.b.p"), ("box", "-> Main.b"), ("all", "-> Main.a"),
    ("text", "-> Main.b.text"), ("node", "-> Main.n[2]"), ("tank", "-> Main.Level"), ("light", "-> Main.Lamp"),
    ("direct", "-> D300"), ("mark", "-> %MW20"), ("odd", "-> Main.a[1] + 1 byte"), ("away", "outside of Main.a"),
    ("before", "outside of Main.a"), ("past", "outside of D"), ("none", None), ("two", [None, "-> Main.b.p.y"]),
    ("n[1].next", "-> Main.n[2]"), ("n[1].q", "-> Main.n[1].own"), ("n[1].kept", "-> Main.i"), ("i", 3),
]  # fmt: skip


def made() -> Plc:
    image = compile_text(TEXT, "leads.st").image
    assert image is not None
    return Plc(image)


@pytest.fixture(scope="module")
def trace() -> Trace:
    return Trace(io.BytesIO(record(made(), 3, depth=Depth.STATEMENTS, before=lambda plc: None)))


@pytest.fixture(scope="module")
def ran() -> Plc:
    plc = made()
    plc.run(scans=3)
    return plc


@pytest.mark.slow
@each_of("name, lead", LEADS)
def test_what_a_reference_leads_to(ran: Plc, trace: Trace, name: str, lead: object) -> None:
    names, place = Names.of(ran.image, ran.memory.areas), ran.find(f"Main.{name}")
    assert names.read(ran.read, place) == trace.names.read(trace.at(2).read, place) == lead


def test_without_extents_a_pointer_is_where_it_is(ran: Plc) -> None:
    names, place = Names(ran.image.symbols, ran.memory.areas), ran.find("Main.element")
    assert names.read(ran.read, place) == "-> Main.a[2]"


def test_what_no_variable_has_is_said_so(ran: Plc) -> None:
    names = Names.of(ran.image, ran.memory.areas)
    assert names.reference_name((1 << 40) + 255, None) == "-> a local variable"
    assert names.reference_name(255, None) == "no variable (16#00000000000000FF)"


def test_each_lead_is_looked_up_once(ran: Plc, monkeypatch: pytest.MonkeyPatch) -> None:
    names, place = Names.of(ran.image, ran.memory.areas), ran.find("Main.element")
    once = names.read(ran.read, place)
    monkeypatch.setattr(names, "_find_reference_name", lambda *_: pytest.fail("looked up again"))
    assert names.read(ran.read, place) == once


@pytest.mark.slow
def test_why_and_stepping_say_it(trace: Trace) -> None:
    place = trace.find("Main.element")
    assert isinstance(place, Place)
    assert cause_text(trace, why(trace, place, 2)).startswith("Main.element = -> Main.a[2] since scan 2")
    session = Session.of(made)
    words = StopReport(session, {})
    session.scan()
    session.mark()
    session.scan()
    assert "  Main.element: Main.a[0] -> Main.a[1]" in list(words.changes())
    assert words.value("Main.element") == "Main.element = -> Main.a[1]"
    assert words.value("Main.two") == "Main.two = [NULL, -> Main.b.p.y]"


def test_charts_and_rows_show_references_that_are_named(trace: Trace) -> None:
    wanted, rows = waveforms(trace, ["Main.element", "Main.none"]), io.StringIO(newline="")
    assert [track.changes for track in wanted.tracks] == [
        [(0, "-> Main.a[0]"), (1, "-> Main.a[1]"), (2, "-> Main.a[2]")], [(0, None)],
    ]  # fmt: skip
    assert "= -> Main.a[0], -> Main.a[1], -> Main.a[2]" in draw(wanted)
    assert "Main.element" not in [track.signal.label for track in waveforms(trace).tracks]
    write_csv(wanted, rows)
    assert rows.getvalue().splitlines()[2] == "1,10,-> Main.a[1],"


def test_a_dump_shows_references_as_texts(trace: Trace) -> None:
    pytest.importorskip("vcd")
    dump = io.StringIO()
    write_vcd(waveforms(trace, ["Main.element", "Main.none"]), dump)
    assert {"s->_Main.a[2]", "sNULL"} <= set(dump.getvalue().split())


def test_a_scan_table_shows_references(trace: Trace) -> None:
    table = ScanTable(trace.sites, trace.names, chosen_signals(trace, ["Main.element"]))
    trace.follow(table)
    assert [row.values for row in table.bands[1].rows] == [["-> Main.a[0]"], ["-> Main.a[1]"]]


def test_the_page_of_a_run_shows_references(trace: Trace) -> None:
    read = ReadPage(page_data(trace, names=["Main.element"]))
    assert sorted(set(read.values("Main.element"))) == ["-> Main.a[0]", "-> Main.a[1]", "-> Main.a[2]"]


def test_a_watch_says_it() -> None:
    plc = made()
    plc.breakpoints.change("Main.element")
    plc.scan()
    assert plc.halted is not None
    assert plc.halted.reasons == ("Main.element was NULL, is -> Main.a[0]",)


def test_people_and_scripts_read_the_same(tmp_path: Path) -> None:
    (tmp_path / "leads.st").write_text(TEXT, encoding="utf-8")
    arguments = ["run", str(tmp_path / "leads.st"), "--scans", "3", "--show", "Main.away", "--show", "Main.two"]
    assert "Main.away = outside of Main.a\nMain.two = [NULL, -> Main.b.p.y]\n" in CliRunner().invoke(main, arguments).stdout
    values = json.loads(CliRunner().invoke(main, [*arguments, "--json"]).stdout)["values"]
    assert values == {"Main.away": "outside of Main.a", "Main.two": [None, "-> Main.b.p.y"]}
