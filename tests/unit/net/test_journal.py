"""Journals: what is written down of a run, and that the run can be done again to the bit."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from images import counter_image
from rows import first_quick

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Mode, Plc
from fbvm.net.faults import Fault
from fbvm.net.journal import Act, End, Entry, Header, Journal, JournalError, Scan, open_journal
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.record.recording.journal_replay import Replay
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.units.etn21.unit import Fault as UnitFault
from fbvm.wire.link import Peer

SERVER = Peer("192.168.250.2", 502)
POLL = """
PROGRAM Main
VAR
    conn : MTCP_ETN_Connect; rd : MTCP_ETN_Fn03; Connect : BOOL := TRUE; Cmd : BOOL; x : REAL; s : STRING[9];
END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := Connect);
    rd(EN := conn.ENO, Register_Address := 7, Register_Qty := 5, RespData_DM := 200, Cmd_Read := Cmd);
    Cmd := NOT Cmd;
END_PROGRAM
"""


@cache
def image_of(text: str = POLL) -> Image:
    image = compile_text(text).image
    assert image is not None
    return image


class Run:
    """A PLC that writes a journal, polling a server in memory."""

    def __init__(self, timing: str = "exact", seed: int = 0) -> None:
        self.file = io.StringIO()
        self.journal = Journal(self.file, {"seed": seed})
        self.plc = Plc(image_of(), journal=self.journal)
        self.network, self.peer = LoopNetwork(seed), ModbusPeer()
        self.network.place(SERVER, self.peer)
        self.unit = Etn21(0, "192.168.250.1", timing=timing, seed=seed)
        self.plc.attach(self.unit, self.network)

    def text(self) -> str:
        self.journal.close()
        return self.file.getvalue()


def replay_of(text: str, image: Image | None = None) -> Replay:
    header, entries = open_journal(text.splitlines(keepends=True))
    return Replay(header, entries, image or image_of())


def entries_of(text: str) -> list[Entry]:
    header, entries = open_journal(text.splitlines(keepends=True))
    return [header, *entries]


def same_again(plc: Plc, text: str, image: Image | None = None) -> Replay:
    """Replays to the end and compares everything that a PLC is."""
    replay = replay_of(text, image)
    assert replay.run() == "end"
    again = replay.plc
    assert bytes(again.memory.u8) == bytes(plc.memory.u8)
    assert (again.now_ns, again.scans, again.mode, again.forces) == (plc.now_ns, plc.scans, plc.mode, plc.forces)
    assert replay.complete
    assert replay.differs is None
    return replay


# --- the same again ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_run_over_a_network_is_done_again_without_it() -> None:
    run = Run()
    run.peer.server.holding_registers[7] = 4711
    run.plc.run(scans=200)
    replay = same_again(run.plc, run.text())
    assert replay.plc.read("D200") == 4711
    assert replay.plc.read("Main.rd.Rcv_Counter") == run.plc.read("Main.rd.Rcv_Counter") != 0


def scanning(plc: Plc) -> None:
    plc.run(scans=3)


def writing(plc: Plc) -> None:
    plc.write("Main.x", 0.1)
    plc.write("Main.s", "so")
    plc.write("D300..D302", [1, 2, 3])
    plc.memory.words("W")[5] = 0xABCD
    plc.scan()


def writing_what_is_there(plc: Plc) -> None:
    plc.write("D300", plc.read("D300"))
    plc.scan()


def forcing(plc: Plc) -> None:
    plc.force("Main.Connect", False)
    plc.force("CIO 1500.02", True)
    plc.force("Main.x", float("nan"))
    plc.scan()
    plc.write("Main.x", 2.0)
    plc.force("Main.Connect", True)
    plc.scan()
    plc.unforce("CIO 1500.02")
    plc.scan()
    plc.unforce()


def standing(plc: Plc) -> None:
    plc.force("W1", 7)
    plc.mode = Mode.PROGRAM
    plc.write("W1", 8)
    plc.run(scans=3)
    plc.force("W2", 1)
    plc.write("W2", 0)
    plc.scan()
    plc.mode = Mode.RUN


def holding(plc: Plc) -> None:
    plc.write("A500.12", True)
    plc.write("W9", 9)
    plc.mode = Mode.PROGRAM
    plc.mode = Mode.RUN
    plc.write("W9", 0)


def warm(plc: Plc) -> None:
    plc.write("D400", 4)
    plc.warm_start()
    plc.write("D401", 1)


def cold(plc: Plc) -> None:
    plc.cold_start()


def waiting(plc: Plc) -> None:
    plc.scan(plc.now_ns + 123_456_789)


def breaking(plc: Plc) -> None:
    unit = plc.units[0].unit
    assert isinstance(unit, Etn21)
    unit.faults += [UnitFault(0x2211, Switch.SEND), UnitFault(0x0302)]
    unit.link_up = not unit.link_up
    plc.run(scans=2)
    unit.error_status = 0x4000


def watching(plc: Plc) -> None:
    """A watcher that writes: from outside, too."""
    plc.watchers.append(lambda plc: plc.write("D900", plc.scans & 0xFFFF))
    plc.run(scans=2)
    plc.watchers.clear()


DEEDS = [scanning, writing, writing_what_is_there, forcing, standing, holding, warm, cold, waiting, breaking, watching]


@pytest.mark.parametrize("deed", DEEDS)
@pytest.mark.parametrize("after", [0, 1, 25])
def test_whatever_is_done_from_outside_is_done_again(deed: Callable[[Plc], None], after: int) -> None:
    run = Run()
    run.plc.run(scans=after)
    deed(run.plc)
    run.plc.run(scans=20)
    same_again(run.plc, run.text())


@pytest.mark.slow
@given(
    st.sampled_from(["exact", "real"]),
    st.integers(0, 10**6),
    st.lists(st.sampled_from(DEEDS), max_size=8),
    st.integers(0, 9),
)
@settings(max_examples=times(15), deadline=None)
def test_any_order_of_anything(timing: str, seed: int, deeds: list[Callable[[Plc], None]], cut: int) -> None:
    run = Run(timing, seed)
    run.network.faults.append(Fault(segment_bytes=cut, random_cut=True))
    for deed in deeds:
        deed(run.plc)
        run.plc.run(scans=7)
    same_again(run.plc, run.text())


def test_a_program_that_stopped_and_was_started_again() -> None:
    file = io.StringIO()
    journal = Journal(file)
    image = image_of("PROGRAM Main VAR n : INT; d : INT := 2; END_VAR n := 100 / d; d := d - 1; END_PROGRAM")
    plc = Plc(image, journal=journal, budget=1000)
    assert plc.run(scans=9) == "trap"
    plc.warm_start()
    plc.budget = 1
    plc.run(scans=2)
    plc.cold_start()
    plc.budget = 3000
    plc.run(scans=2)
    journal.close()
    replay = same_again(plc, file.getvalue(), image)
    assert replay.plc.scans == plc.scans > 3


@pytest.mark.slow
def test_a_replay_stops_where_one_wants_to_look() -> None:
    run = Run()
    run.plc.run(scans=60)
    replay = replay_of(run.text())
    assert (replay.run(scans=5), replay.plc.scans) == ("scans", 5)
    assert (replay.run(until="Main.rd.Rcv_Counter = 2"), replay.plc.read("Main.rd.Rcv_Counter")) == ("until", 2)
    assert replay.run(until=lambda plc: plc.scans == 40) == "until"
    assert not replay.complete
    assert (replay.run(), replay.plc.scans, replay.complete) == ("end", 60, True)


@pytest.mark.slow
@pytest.mark.parametrize("options", first_quick([{"observed": True}, {"engine": "python"}, {"engine": "native"}]), ids=str)
def test_any_engine_replays(options: dict[str, Any]) -> None:
    if options.get("engine") == "native":
        pytest.importorskip("llvmlite")
    run = Run()
    run.plc.run(scans=300)
    header, entries = open_journal(run.text().splitlines(keepends=True))
    replay = Replay(header, entries, image_of(), **options)
    assert replay.run() == "end"
    assert replay.differs is None


@pytest.mark.slow
def test_a_program_nested_deeper_than_the_host_recurses() -> None:
    image = image_of(f"PROGRAM Main VAR n, one : LINT := 1; END_VAR n := n{' + one' * 900}; END_PROGRAM")
    file = io.StringIO()
    journal = Journal(file)
    plc = Plc(image, journal=journal)
    plc.run(scans=3)
    journal.close()
    assert same_again(plc, file.getvalue(), image).plc.read("Main.n") == 2701


# --- what is written --------------------------------------------------------------------------------------------------


def test_the_lines_of_a_small_run() -> None:
    """Offset 163840 is D24576; people read `by`, which is for them alone."""
    file = io.StringIO()
    journal = Journal(file, {"who": "me"})
    plc = Plc(counter_image(), journal=journal)
    plc.write("D24576", 0x1234)
    plc.force("Go", True)
    plc.scan()
    plc.mode = Mode.PROGRAM
    plc.scan(15_000_000)
    journal.close()
    lines = [json.loads(line) for line in file.getvalue().splitlines()]
    assert {key: lines[0][key] for key in ("journal", "cycle_ns", "budget", "about")} == {
        "journal": 1, "cycle_ns": 10_000_000, "budget": 2_000_000, "about": {"who": "me"},
    }  # fmt: skip
    fingerprints = [line.pop("memory") for line in lines if "scan" in line]
    assert len(set(fingerprints)) == 2
    assert lines[1:] == [
        {"scan": 0, "now_ns": 0, "by": ["D24576 := 4660"], "write": [[163840, "3412"], [180324, "01"]],
         "force": {"Go": True}},
        {"mode": "PROGRAM"},
        {"scan": 1, "now_ns": 15_000_000},
        {"end": 2},
    ]  # fmt: skip


def test_what_the_network_told_stands_in_its_scan() -> None:
    run = Run()
    run.plc.run(scans=12)
    [header, unit, *rest] = entries_of(run.text())
    assert isinstance(header, Header)
    assert isinstance(unit, Act)
    assert unit.value["with"]["address"] == "192.168.250.1"
    scans = [entry for entry in rest if isinstance(entry, Scan)]
    told = [type(event).__name__ for scan in scans for event in scan.events.get(0, ())]
    assert told[:3] == ["Opened", "Sent", "Received"]
    assert rest[-1] == End(12)


def test_a_run_without_a_journal_is_the_same() -> None:
    run, plain = Run(), Plc(image_of())
    network = LoopNetwork()
    network.place(SERVER, ModbusPeer())
    plain.attach(Etn21(0, "192.168.250.1"), network)
    plain.run(scans=50)
    run.plc.run(scans=50)
    assert bytes(plain.memory.u8) == bytes(run.plc.memory.u8)


def test_a_unit_that_does_not_say_how_it_was_made_is_refused() -> None:
    class Odd:
        name, address = "Odd 0", "192.168.250.9"

    with pytest.raises(TypeError, match="Odd has no configuration"):
        Run().plc.attach(Odd(), LoopNetwork())  # type: ignore[arg-type]


def test_a_plc_with_a_journal_goes_forward_only() -> None:
    plc = Plc(counter_image(), journal=Journal(io.StringIO()))
    with pytest.raises(ValueError, match="cannot go back"):
        plc.restore(plc.snapshot())
    assert plc.fork().scan() is None


# --- damaged files ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def good() -> str:
    run = Run()
    run.plc.write("D300", 1)
    run.plc.run(scans=15)
    return run.text()


def broken(text: str) -> str:
    """The message with which a replay of this text ends."""
    with pytest.raises(JournalError) as raised:
        replay_of(text).run()
    return str(raised.value)


def test_files_that_are_no_journals() -> None:
    assert broken("") == "the file is empty"
    assert broken("\n") == "line 1: Expecting value at column 1"
    assert broken("PROGRAM Main\n") == "line 1: Expecting value at column 1"
    assert broken("[1, 2]\n") == "line 1: no entry of a journal"
    assert broken('{"journal":1') == "line 1: Expecting ',' delimiter at column 13"
    assert broken('{"journal":2}\n') == "line 1: a journal of format 2; this version of fbvm reads format 1"
    assert broken('{"journal":1}\n') == "line 1: 'image' is missing"
    assert broken('{"scan":0,"now_ns":0,"memory":""}\n') == "line 1: no journal of fbvm: it begins without a header"
    assert broken("[" * 100_000 + "\n").startswith("line 1: ")


def test_the_journal_of_another_program(good: str) -> None:
    with pytest.raises(JournalError, match="was written by another program"):
        replay_of(good, counter_image())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"scan":3,', '"scan":4,', "line 6: scan 4 where 3 should be: lines are missing, or not in their order"),
        ('"now_ns":20000000,', "", "line 5: 'now_ns' is missing"),
        ('"now_ns":20000000', '"now_ns":1e999', "line 5: cannot convert float infinity to integer"),
        ('"now_ns":20000000', '"now_ns":"soon"', "line 5: invalid literal for int() with base 10: 'soon'"),
        ('["Opened",1,', '["Opened",', "line 6: 'Opened' with 2 values is no event"),
        ('["Opened",', '["Exploded",', "line 6: 'Exploded' with 3 values is no event"),
        ('[[115288,"01"', '[[115288,"0"', "line 3: non-hexadecimal number found"),
        ('"end":15', '"end":14', "line 18: scan 14 where 15 should be: lines are missing, or not in their order"),
        ('[[115288,', '[[-5,', "scan 0 cannot be done again: 1 bytes at -5 are outside the memory"),
        ('"Etn21"', '"Etn99"', "scan 0 cannot be done again: nothing here makes a unit of class Etn99"),
        ('"exact"', '"brisk"', "scan 0 cannot be done again: timing 'brisk' is neither 'exact' nor 'real'"),
        ('"events":{"0"', '"events":{"1"', "scan 3 cannot be done again: list index out of range"),
        ('"now_ns":50000000', '"now_ns":5', "scan 5 cannot be done again: time runs forward only: 5 ns is before"),
        ('"write"', '"force":{"Main.nobody":1},"write"', "scan 0 cannot be done again: "),
    ],
)  # fmt: skip
def test_a_damaged_line(good: str, old: str, new: str, message: str) -> None:
    assert good.count(old) >= 1
    assert broken(good.replace(old, new, 1)).startswith(message)


@pytest.mark.slow
def test_lines_that_are_missing(good: str) -> None:
    lines = good.splitlines(keepends=True)
    assert broken("".join(lines[:7] + lines[8:])).startswith("line 8: scan 6 where 5 should be")
    assert broken("".join([lines[0], *lines])).startswith("line 2: a second header")


def test_a_journal_that_was_cut_off_is_done_as_far_as_it_goes(good: str) -> None:
    replay = replay_of(good[: good.index('"scan":9') + 20])
    assert (replay.run(), replay.plc.scans, replay.complete, replay.differs) == ("end", 9, False, None)


@pytest.mark.parametrize(("old", "new", "scan"), [
    ('[[115288,"01', '[[115288,"02', 0), ('"now_ns":50000000', '"now_ns":50000001', 5),
    ('["Opened",1,49152', '["Opened",1,49153', 3), ('["Sent",1,12]', '["Sent",1,10]', 6), ('0dff030a0', '0dff030a1', 8),
])  # fmt: skip
def test_a_changed_value_is_found_out(good: str, old: str, new: str, scan: int) -> None:
    replay = replay_of(good.replace(old, new, 1))
    assert (replay.run(), replay.differs) == ("differs", scan)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=times(80), deadline=None)
def test_any_damage_gives_a_clear_error_or_is_found_out(good: str, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(good) - 1))
    size = data.draw(st.integers(0, 9))
    text = good[:at] + data.draw(st.text(max_size=9)) + good[at + size :]
    try:
        replay = replay_of(text)
        reason = replay.run()
    except JournalError as error:
        assert str(error)
    else:
        assert reason in ("end", "differs")
