"""What pages may ask of a run, up to its bounds, what is refused in words, and the panels of an update."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import pytest
from browsers import PUMP, Page
from rows import each_of

from fbvm import LoopNetwork, Peer
from fbvm.engine.trap import Trap
from fbvm.live.messages import MOST_NAMES, MOST_TEXT
from fbvm.live.plcs import MOST_CAPTURE_BYTES
from fbvm.live.session import Session
from fbvm.live.updates import ACTS, MEMORY_WORDS, MOST_SHOWN, UPDATE_NS, VIEW_NS
from fbvm.live.workbench import FASTEST, MOST_STEPS, SLOWEST, Workbench, fault_rows
from fbvm.net.faults import Fault, fault
from fbvm.run.interactive import Control
from fbvm.watch.paths import UnknownPlace
from fbvm.wire.tap import TapEvent, TapKind

CHART = """PROGRAM Main
VAR go : BOOL; n : INT; END_VAR
INITIAL_STEP Dark: END_STEP
STEP Bright: Count(N); END_STEP
TRANSITION FROM Dark TO Bright := go; END_TRANSITION
TRANSITION FROM Bright TO Dark := NOT go; END_TRANSITION
ACTION Count: n := n + 1; END_ACTION
END_PROGRAM"""


def opened(text: str = PUMP, **settings: Any) -> Page:
    page = Page(text, **settings)
    page.done("hello", version=1)
    return page


@pytest.fixture
def page() -> Page:
    return opened()


@each_of(("do", "fields", "said"), [
    ("step", {"scans": 0}, "a step has 1 to 100,000 scans, not 0"), ("step", {"scans": MOST_STEPS + 1}, "not 100001"),
    ("speed", {"factor": SLOWEST / 2}, "a speed is 0, as fast as it goes, or 0.001 to 1000"),
    ("speed", {"factor": -1}, "a speed"), ("speed", {"factor": FASTEST * 1.01}, "a speed is"),
    ("start", {"plc": "pump", "kind": "lukewarm"}, "warm or cold"), ("mode", {"plc": "pump", "mode": "MONITOR"}, "a mode is"),
    ("look", {"plc": "none"}, "there is no PLC 'none'; there are pump"),
    ("look", {"plc": "pump", "memory": "ZZ"}, "no area 'ZZ'"), ("branch", {"plc": "pump"}, "look at a scan of the present run"),
    ("cable", {"plc": "pump", "unit": "ETN21 7", "plugged": True}, "there is no unit 'ETN21 7' in pump"),
    ("fault", {"kind": "gone"}, "there is no fault 'gone'; there are"), ("mend", {"number": 0}, "there is no fault 0"),
    ("fault", {"kind": "lossy", "percent": 101}, "101 is not 0 to 100 percent"),
    ("fault", {"kind": "lossy", "percent": -1}, "-1 is"),
    ("fault", {"kind": "slow", "time": "0s"}, "0s is not a time that can pass"),
    ("unbreak", {"plc": "pump", "number": 0}, "no breakpoint"),
    ("fault", {"kind": "slow", "peer": "192.168.250.256"}, "no IPv4 address"),
    ("fault", {"kind": "slow", "peer": "1.2.3"}, "no IPv4"), ("fault", {"kind": "slow", "peer": "1.2.3.0004"}, "no IPv4"),
    ("fault", {"kind": "slow", "peer": "1.2.3.4:65536"}, "'65536' is no port"),
    ("fault", {"kind": "slow", "peer": "1.2.3.4:000502"}, "'000502' is no port"),
    ("force", {"plc": "pump", "name": "D10..D11", "value": "1"}, "a range; force its places one by one"),
    ("group", {"name": "a", "names": ["D1"]}, "no file beside which"),
    ("predict", {"names": [], "values": []}, "has no lesson"), ("check", {}, "has no lesson"),
    ("solution", {}, "has no lesson"), ("test", {"plc": "pump"}, "a test repeats runs in virtual time"),
    ("why", {"plc": "pump", "name": "Main.Curve"}, "is no single value"),
    ("why", {"plc": "pump", "name": "Main.Level"}, "no scan has"),
    ("view", {"plc": "pump", "scan": 0}, "no scan has been recorded yet"),
    ("view", {"plc": "pump", "scan": 0, "future": 0}, "no future 0"),
    ("hello", {"version": 0}, "speaks version 1 of its messages, not 0"),
    ("search", {"plc": "pump", "text": "x" * (MOST_TEXT + 1)}, "more than"),
    ("look", {"plc": "pump", "names": ["D0"] * (MOST_NAMES + 1)}, "at most 1000 texts"), ("step", {"scans": True}, "is a int"),
    ("step", {"scans": 1 << 62}, "is too large"), ("step", {"scans": 1, "more": 1}, "step has no more"),
    ("step", {}, "step needs scans"),
])  # fmt: skip
def test_what_cannot_be_done_is_refused_in_words(do: str, fields: dict[str, Any], said: str) -> None:
    page = opened()
    assert said in page.ask(do, **fields)["error"]
    assert (page.bench.acts, page.network.faults, page.control.steps, page.control.speed) == ([], [], 0, 1.0)


def test_bounds_are_taken(page: Page) -> None:
    for factor in (SLOWEST, FASTEST, 0):
        page.done("speed", factor=factor)
        assert page.control.speed == factor
    page.done("step", scans=MOST_STEPS)
    assert page.control.steps == MOST_STEPS and page.control.is_paused
    page.done("pause")
    assert page.control.stands
    page.done("fault", kind="lossy", percent=100)
    page.done("fault", kind="doubled", percent=7, peer="255.255.255.255:65535")
    assert [act.text for act in page.bench.acts] == ["fault lossy", "fault doubled at 255.255.255.255:65535"]
    assert [(row.lose_percent, row.duplicate_percent) for row in page.network.faults] == [(100, 0), (0, 7)]
    assert page.network.faults[1].peer == Peer("255.255.255.255", 65535)
    page.done("fault", kind="lossy", percent=0)
    page.done("fault", kind="slow", time="1ns", peer="1.2.3.4:65535")
    page.done("fault", kind="interrupted")
    assert page.network.faults[2:] == [fault("lossy", lose_percent=0), fault("slow", latency_ns=1, peer=Peer("1.2.3.4", 65535)),
                                       fault("interrupted", reset_after_bytes=16)]
    assert page.done("search", plc="pump", text="x" * MOST_TEXT)["found"] == []
    assert len(page.done("look", plc="pump", names=["D0"] * MOST_NAMES)["rows"]) == 1
    assert page.done("write", plc="pump", name="D10..D12", value="1,2,3")["value"] == "1, 2, 3"


def test_with_allow_write_only_values_are_changed() -> None:
    page = opened(writable=["main.level", "Main.Curve"])
    page.done("write", plc="pump", name="Main.Level", value="30")
    page.done("write", plc="pump", name="Main.Curve[2]", value="3")
    page.done("force", plc="pump", name="Main.Level", value="31")
    page.done("release", plc="pump", name="Main.Level")
    assert "may not be written: --allow-write names Main.Level, Main.Curve" in page.ask(
        "write", plc="pump", name="Main.Pump", value="TRUE")["error"]  # fmt: skip
    assert "one by one" in page.ask("release", plc="pump")["error"]
    page.scan(3)
    page.done("view", plc="pump", scan=1)
    for do, fields in {"restart": {}, "branch": {"plc": "pump"}, "group": {"name": "a", "names": []}, "fault": {"kind": "cut"},
                       "mend": {}, "cable": {"plc": "pump", "unit": "ETN21 0", "plugged": False},
                       "break": {"plc": "pump", "kind": "line", "where": "Main"}, "mode": {"plc": "pump", "mode": "PROGRAM"},
                       "start": {"plc": "pump", "kind": "warm"}, "statement": {"plc": "pump"}}.items():  # fmt: skip
        assert page.ask(do, **fields)["error"] == "with --allow-write only values can be changed", do
        if do == "branch":
            page.done("view", plc="pump")
    assert page.plc.scans == 3 and page.plc.mode.value == "RUN" and not len(page.plc.breakpoints)


@pytest.mark.slow
def test_a_name_that_may_be_written_is_found_in_any_plc() -> None:
    for texts in ((PUMP, CHART), (CHART, PUMP)):
        lives = [Page(text).live for text in texts]
        lives[0].name = "first"
        assert Workbench(lives, Control(), writable=["Main.Level", "Main.go"]).writable == ["Main.Level", "Main.go"]
    with pytest.raises(UnknownPlace, match="Nowhere"):
        Workbench(lives, Control(), writable=["Main.Nowhere"])


def test_what_is_written_inside_a_scan_is_there_in_the_scans_behind_it(page: Page) -> None:
    page.done("break", plc="pump", kind="line", where="Main", when="Level = 22")
    page.run(20)
    page.done("write", plc="pump", name="Main.Level", value="60")
    page.done("unbreak", plc="pump")
    page.done("run")
    page.scan(5)
    seen = page.done("history", plc="pump", names=["Main.Level"], scans=5)["values"]["Main.Level"]
    assert (seen[1:], page.plc.read("Main.Level")) == (["62", "63", "64", "65"], 65)


@pytest.mark.slow
def test_of_another_plc_than_the_one_whose_past_is_looked_at_the_last_scans_are_told() -> None:
    page, other = Page(), Page()
    other.live.name = "slow"
    page.session = Session(Workbench([page.live, other.live], page.control))
    page.scan(20)
    other.scan(3)
    page.done("view", plc="pump", scan=15)
    for plc, first, levels in (("slow", 1, ["22", "23"]), ("pump", 14, ["35", "36"])):
        found = page.done("history", plc=plc, names=["Main.Level"], scans=2)
        assert (found["first"], found["values"]) == (first, {"Main.Level": levels})
    assert "since scan 2 (20ms)" in page.done("why", plc="slow", name="Main.Level")["text"]


def test_with_real_connections_time_passes_as_it_does() -> None:
    page = opened(real=True)
    assert page.ask("speed", factor=2)["error"] == "with real connections time passes as it does"
    assert "step whole scans" in page.ask("statement", plc="pump")["error"]
    page.scan(3)
    assert "pause first" in page.ask("history", plc="pump", names=["Main.Level"], scans=2)["error"]
    page.done("pause")
    assert page.done("history", plc="pump", names=["Main.Level"], scans=2)["values"] == {"Main.Level": ["22", "23"]}


def test_a_start_waits_until_the_scan_that_stands_has_gone_on(page: Page) -> None:
    page.done("break", plc="pump", kind="line", where="Main", when="Level = 22")
    page.run(20)
    assert page.ask("start", plc="pump", kind="cold")["error"] == "the scan stands at a breakpoint: let it go on first"
    assert page.plc.halted and page.plc.read("Main.Level") == 22


def test_the_present_is_gone_on_with_from_the_past(page: Page) -> None:
    page.done("look", plc="pump", names=["Main.Level"])
    page.scan(10)
    page.done("view", plc="pump", scan=4)
    found = page.done("history", plc="pump", names=["Main.Level", "D10..D11"], scans=3)
    assert found["values"] == {"Main.Level": ["23", "24", "25"]}
    assert page.ask("branch", plc="pump")["error"].startswith("the past of these PLCs cannot be done again")
    page.done("step", scans=1)
    assert page.update()["state"] == "run" and page.control.steps == 1


@each_of(("do", "fields", "state"), (
    ("run", {}, "run"), ("step", {"scans": 1}, "run"), ("statement", {"plc": "pump"}, "run"), ("view", {"plc": "pump"}, "run")))
def test_who_leaves_the_past_is_shown_all_of_the_present_at_once(do: str, fields: dict[str, Any], state: str) -> None:
    page = opened()
    page.done("look", plc="pump", names=["Main.Level"])
    page.scan(10)
    page.done("view", plc="pump", scan=9)
    seen = page.update()
    assert (seen["state"], seen["scan"], seen["values"]) == ("past", 9, {"Main.Level": "30"})
    page.done(do, **fields)
    text = page.session.update(page.now_ns)
    assert text is not None
    found = json.loads(text)["update"]
    assert (found["state"], found["scan"], found["values"]) == (state, 9, {"Main.Level": "30"})


def test_who_sees_the_present_and_goes_on_is_told_what_has_changed_and_in_time(page: Page) -> None:
    page.done("look", plc="pump", names=["Main.Level"])
    page.scan(10)
    page.update()
    page.done("run")
    assert page.session.update(page.now_ns) is None
    assert "values" not in page.update()


def test_the_instances_of_a_program_are_listed_from_outside_inwards() -> None:
    page = opened("""FUNCTION_BLOCK In VAR n : INT; END_VAR n := n + 1; END_FUNCTION_BLOCK
FUNCTION_BLOCK Out VAR_IN_OUT x : In; END_VAR VAR a : In; b : ARRAY[1..2] OF In; t : TON; w : ARRAY[0..300] OF In; END_VAR a();
END_FUNCTION_BLOCK
PROGRAM Main VAR o : Out; i : In; grid : ARRAY[1..2, 1..2] OF In; k : INT; END_VAR k := 1; o(x := i); END_PROGRAM""")
    found = page.done("program", plc="pump")["instances"]
    assert [(row["path"], row["pou"]) for row in found[:11]] == [
        ("Main", "Main"), ("Main.o", "Out"), ("Main.i", "In"), ("Main.o.a", "In"), ("Main.o.t", "TON"), ("Main.grid[1, 1]", "In"),
        ("Main.grid[1, 2]", "In"), ("Main.grid[2, 1]", "In"), ("Main.grid[2, 2]", "In"), ("Main.o.b[1]", "In"),
        ("Main.o.b[2]", "In")]  # fmt: skip
    first = [f"Main.o.w[{number}]" for number in range(100)]
    assert [row["path"] for row in found[11:]] == first, "of an array the first hundred"
    assert found == page.done("hello", version=1)["plcs"][0]["instances"]


# --- what an update has -----------------------------------------------------------------------------------------------


def test_a_scan_is_observed_once_for_a_look(page: Page) -> None:
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    page.scan(2)
    view = page.live.view
    assert view is not None and view.scan == 0 and not page.live.wants_view
    page.scan(3)
    assert page.live.view is view and view.scan == 0, "the scans behind it are nobody's"
    assert page.update()["inside"]["scan"] == 0
    page.scan(1)
    assert page.live.view is not None and page.live.view.scan == 5, "the update has wished for the next one"
    page.now_ns += VIEW_NS - 2 * UPDATE_NS - 1
    page.update()
    page.scan(1)
    assert page.live.view.scan == 5, "a quarter of a second has to pass between two"


def test_a_scan_that_executes_no_program_is_observed_as_the_scan_that_it_is(page: Page) -> None:
    page.scan(3)
    page.done("mode", plc="pump", mode="PROGRAM")
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    page.scan(2)
    assert page.update()["inside"] == {"scan": 3, "executed": [], "pictures": []}
    page.done("view", plc="pump", scan=4)
    assert page.update()["inside"] == {"scan": 4, "executed": [], "pictures": []}


@pytest.mark.slow
def test_a_chart_is_drawn_as_it_was_in_the_scan() -> None:
    page = opened(CHART)
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    page.scan(1)
    [[head, drawn]] = page.update()["inside"]["pictures"]
    assert head == "" and "<svg" in drawn and "Dark" in drawn and "Bright" in drawn
    page.done("write", plc="pump", name="Main.go", value="TRUE")
    page.now_ns += VIEW_NS
    page.update()
    page.scan(2)
    page.now_ns += VIEW_NS
    [[_, later]] = page.update()["inside"]["pictures"]
    assert later != drawn


def test_memory_shows_which_words_are_forced(page: Page) -> None:
    page.plc.write("D5..D6", [1, 2])
    for name in ("D4", "D5", "D205", "Main.Level"):
        page.done("force", plc="pump", name=name, value="9")
    page.done("look", plc="pump", names=[], memory="D", first=5)
    shown = page.update()["memory"]
    assert (shown["area"], shown["first"], len(shown["words"]), shown["forced"]) == ("D", 5, MEMORY_WORDS, [0])
    page.done("look", plc="pump", names=[], memory="D", first=32_760)
    assert len(page.update()["memory"]["words"]) == 8
    page.done("look", plc="pump", names=[], memory="D", first=-7)
    assert page.update()["memory"]["first"] == 0


def test_long_values_are_cut() -> None:
    page = opened("PROGRAM Main VAR s : STRING[400] := ''; t : STRING[298]; END_VAR END_PROGRAM")
    page.plc.write("Main.s", "x" * 400)
    page.plc.write("Main.t", "y" * (MOST_SHOWN - 2))
    page.done("look", plc="pump", names=["Main.s", "Main.t", "D0..D99"])
    values = page.update()["values"]
    assert values["Main.s"] == "'" + "x" * (MOST_SHOWN - 2) + "…" and values["Main.t"] == f"'{'y' * (MOST_SHOWN - 2)}'"
    assert values["D0..D99"] == "[" + ", ".join(["0"] * 64) + "]"


def test_a_page_is_told_the_last_acts_and_then_the_new_ones(page: Page) -> None:
    for number in range(ACTS + 5):
        page.done("write", plc="pump", name="D1", value=str(number))
    assert [text for _, _, text in page.update()["acts"]] == [f"D1 := {number}" for number in range(5, ACTS + 5)]
    page.done("write", plc="pump", name="D1", value="7")
    assert page.update()["acts"] == [["pump", 0, "D1 := 7"]]
    assert "acts" not in page.update()


@pytest.mark.slow
def test_a_plant_shows_what_has_passed_between_whom() -> None:
    page = opened()
    unit, peer, other = Peer("192.168.250.21", 1025), Peer("192.168.250.1", 502), Peer("192.168.250.9", 502)
    tell = page.network.tap
    assert tell is not None
    for to, count in ((peer, 3), (other, 1)):
        for _ in range(count):
            tell(0, unit.host, TapEvent(TapKind.SYN, unit, to, out=True))
    tell(0, "192.168.250.99", TapEvent(TapKind.SYN, Peer("192.168.250.99", 1), peer, out=True))
    page.network.doors = {unit: Peer("127.0.0.1", 1502)}  # type: ignore[attr-defined]
    page.done("fault", kind="slow", peer="192.168.250.1:502", time="5ms")
    page.done("cable", plc="pump", unit="ETN21 0", plugged=False)
    page.done("look", plc="pump", names=[], plant=True, network=True)
    update = page.update()
    links = {(one, two): frames for one, two, frames, _ in update["plant"]["links"]}
    assert links == {("192.168.250.1", "192.168.250.21"): 3, ("192.168.250.21", "192.168.250.9"): 1}
    assert update["plant"]["doors"] == [["192.168.250.21:1025", "127.0.0.1:1502"]]
    assert update["plant"]["faults"] == ["192.168.250.1", "192.168.250.21"]
    assert [text for _, _, text in update["acts"]] == ["fault slow at 192.168.250.1:502", "cable of ETN21 0 pulled"]
    assert update["plant"]["plcs"][0]["units"] == [{"name": "ETN21 0", "address": "192.168.250.21", "plugged": False}]
    assert [row["number"] for row in update["frames"]] == [0, 1, 2, 3] and all(row["out"] for row in update["frames"])
    assert "frames" not in page.update()
    tell(0, unit.host, TapEvent(TapKind.SYN, unit, peer, out=False))
    [row] = page.update()["frames"]
    assert (row["number"], row["out"], row["from"]) == (4, False, str(peer))
    assert [row["number"] for row in page.live.frame_rows(3, None)] == [3, 4]
    assert [row["number"] for row in page.live.frame_rows(0, 0, 2)] == [3, 4]


@pytest.mark.slow
def test_a_capture_has_the_last_events_up_to_a_size(page: Page) -> None:
    unit, peer = Peer("192.168.250.21", 1025), Peer("192.168.250.1", 502)
    tell = page.network.tap
    assert tell is not None
    size, events = 1 << 16, MOST_CAPTURE_BYTES // (1 << 16)
    tell(0, unit.host, TapEvent(TapKind.SYN, unit, peer, out=True))
    for _ in range(events + 3):
        tell(0, unit.host, TapEvent(TapKind.DATA, unit, peer, out=True, data=bytes(size)))
    assert MOST_CAPTURE_BYTES * 0.9 < len(page.live.capture()) < MOST_CAPTURE_BYTES * 1.1


def test_a_change_is_told_before_it_is_checked() -> None:
    changes = SimpleNamespace(state={"files": ["pump.st"], "ready": False, "mistakes": []}, compile=lambda: False)
    page = opened(changes=changes)
    assert page.update()["change"] == {"files": ["pump.st"], "ready": False, "mistakes": []}
    assert page.ask("restart")["error"] == "the changed program cannot run yet: it is checked, or it has errors"
    assert not page.bench.wants_restart and not page.control.has_ended


def test_the_end_of_a_fault_is_noted_by_its_kind_where_it_has_one(page: Page) -> None:
    for percent in (0, 5):
        page.done("fault", kind="lossy", percent=percent)
    for _ in range(2):
        page.done("mend", number=0)
    page.done("mend")
    assert [act.text for act in page.bench.acts] == ["fault lossy", "fault lossy", "fault ended", "fault lossy ended",
                                                     "all faults ended"]


def test_a_program_without_a_network_has_no_faults() -> None:
    page = opened()
    page.bench.networks.clear()
    for do, fields in {"fault": {"kind": "cut"}, "mend": {}}.items():
        assert page.ask(do, **fields)["error"] == "this program has no network"
    assert isinstance(page.network, LoopNetwork) and page.network.faults == []


def test_while_somebody_else_has_the_plc_a_page_looks_on(page: Page) -> None:
    page.bench.held_by = "an editor"
    said = page.ask("write", plc="pump", name="Main.Level", value="5")["error"]
    assert said == "an editor has the PLC: this page looks on meanwhile" and page.bench.acts == []
    assert page.done("search", plc="pump", text="Main.Level")["found"][0]["name"] == "Main.Level"
    page.bench.held_by = ""
    page.done("write", plc="pump", name="Main.Level", value="5")


@pytest.mark.slow
def test_there_are_so_many_breakpoints_and_found_names_and_no_more(page: Page) -> None:
    page.done("break", plc="pump", kind="change", where="Main.Level")
    for number in range(99):
        page.done("break", plc="pump", kind="condition", where=f"Main.Level = {number}")
    assert "there are 100 breakpoints already" in page.ask("break", plc="pump", kind="change", where="D5")["error"]
    assert [row.kind for row in page.plc.breakpoints][:2] == ["change", "condition"]
    assert len(page.done("search", plc="pump", text=" ")["found"]) == 200


def test_what_a_restart_has_kept_is_noted_as_writes(page: Page) -> None:
    old = opened()
    place = page.plc.find("Main.Level")
    trap = Trap("R0101", page.plc.image.sites[0], (2, 0), "2 divided by 0")
    page.bench.note_restart(old.bench, {"pump": [place]}, {"pump": trap})
    assert [(act.what, act.scan, act.name, act.value) for act in page.bench.acts] == [
        ("restart", 0, "", None), ("restart", 0, "", None), ("keep", 0, "Main.Level", page.plc.read("Main.Level"))]
    assert page.bench.acts[2].now_ns == 0
    assert [act.text for act in page.bench.acts] == [
        "restart with the changed ; 1 retained variables kept their values",
        f"FB_exit of the program before ended with {trap}", "Main.Level kept"]  # fmt: skip


def test_faults_are_listed_by_their_kinds() -> None:
    host = "10.0.0.1"
    rows = [fault("slow", latency_ns=5), fault("silent"), Fault(peer=Peer(host, 0), gap_ns=5), Fault(peer=Peer(host, 502))]
    assert [(row["kind"], row["peer"]) for row in fault_rows(rows)] == [
        ("slow", "all"), ("silent", "all"), ("fault", "10.0.0.1"), ("fault", "10.0.0.1:502")]
    assert [bool(row["meaning"]) for row in fault_rows(rows)] == [True, True, False, False]
