"""What a page sees and does, in virtual time and without a browser: messages in, messages out."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import pytest
from browsers import PUMP, Page

from fbvm.live.futures import Future, run_again
from fbvm.live.groups import WatchGroups
from fbvm.live.messages import PIECE, dump, dump_in_steps
from fbvm.live.plcs import LivePlc
from fbvm.live.pytest_text import pytest_text
from fbvm.live.session import Session
from fbvm.live.updates import UPDATE_NS
from fbvm.run.running import Running
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

RUNGS = """PROGRAM Main
VAR on, off, out : BOOL; n : UINT := 7; END_VAR
LADDER
LD on
AND> n &5
OUT out
END_LADDER
END_PROGRAM"""


@pytest.fixture
def page() -> Page:
    made = Page()
    made.done("hello", version=1)
    return made


def test_only_what_is_seen_is_sent_and_only_when_it_changes(page: Page) -> None:
    page.done("look", plc="pump", names=["Main.Level", "D10"])
    first = page.update()
    assert first["values"] == {"Main.Level": "20", "D10": "90"}
    assert not {"memory", "units", "frames", "inside"} & set(first)
    page.scan()
    assert page.update()["values"] == {"Main.Level": "21"}
    assert page.update() == {}


def test_updates_are_100_ms_apart(page: Page) -> None:
    assert page.session.update(UPDATE_NS) is not None
    page.ask("ready")
    page.scan()
    assert page.session.update(2 * UPDATE_NS - 1) is None
    assert page.session.update(2 * UPDATE_NS) is not None


def test_a_page_that_has_gone_gets_no_update(page: Page) -> None:
    page.done("look", plc="pump", names=["Main.Level"])
    page.session.end()
    assert page.session.update(UPDATE_NS) is None


def test_a_name_that_does_not_exist_is_said_and_the_others_are_shown(page: Page) -> None:
    found = page.done("look", plc="pump", names=["Main.Levl", "Main.Level", "D10..D12"])
    assert list(found["unknown"]) == ["Main.Levl"]
    assert page.update()["values"] == {"Main.Level": "20", "D10..D12": "[90, 0, 0]"}


def test_a_value_is_written_once_and_the_program_goes_on_with_it(page: Page) -> None:
    assert page.done("write", plc="pump", name="Main.Level", value="50") == {"value": "50", "scan": page.plc.scans}
    page.scan()
    assert page.plc.read("Main.Level") == 51


def test_a_force_holds_until_it_is_released_and_is_shown_where_it_acts(page: Page) -> None:
    page.done("force", plc="pump", name="main.level", value="5")
    page.scan(3)
    assert page.plc.read("Main.Level") == 5
    assert page.update()["forces"] == {"Main.Level": "5"}
    page.done("release", plc="pump", name="Main.Level")
    page.scan()
    assert page.plc.read("Main.Level") == 6
    assert page.update()["forces"] == {}


def test_search_finds_names_types_addresses_and_words_of_units(page: Page) -> None:
    def names(text: str) -> list[str]:
        return [row["name"] for row in page.done("search", plc="pump", text=text)["found"]]

    assert names("leve") == ["Main.Level"]
    assert names("bool pump") == ["Main.Pump"]
    assert names("D100..D102")[0] == "D100..D102"
    assert any("CIO 15" in name for name in names("send request"))


def test_a_variable_is_shown_and_found_with_the_comment_of_its_declaration() -> None:
    page = Page("""TYPE Valve : STRUCT Way : INT; // of the lever, mm
        END_STRUCT END_TYPE
        PROGRAM Main VAR
            Inlet : ARRAY[1..2] OF Valve;   (* from the well *)
            Level : INT;
        END_VAR Level := Level + 1; END_PROGRAM""")
    rows = page.done("look", plc="pump", names=["Main.Inlet[2].Way", "Main.Inlet", "Main.Level", "CIO 1517.14"])["rows"]
    assert [row["said"] for row in rows.values()] == ["of the lever, mm", "from the well", "", "Link Status"]
    assert [one["name"] for one in page.done("search", plc="pump", text="well")["found"]] == ["Main.Inlet"]


def test_an_array_opens_into_its_elements(page: Page) -> None:
    parts = page.done("parts", plc="pump", name="Main.Curve")["parts"]
    assert [part["name"] for part in parts] == ["Main.Curve[1]", "Main.Curve[2]", "Main.Curve[3]"]
    assert "Main.Level" in [part["name"] for part in page.done("parts", plc="pump", name="Main")["parts"]]


def test_the_source_has_the_values_that_stand_on_each_line(page: Page) -> None:
    found = page.done("source", plc="pump", instance="Main")
    line = next(line for line in found["lines"] if line["text"].startswith("IF Pump"))
    assert line["names"] == ["Main.Pump", "Main.Level"]


def test_a_source_of_one_line_is_shown() -> None:
    text = "PROGRAM Main VAR n : INT; END_VAR n := 1; END_PROGRAM"
    page = Page(text)
    page.done("hello", version=1)
    assert [line["text"] for line in page.done("source", plc="pump", instance="Main")["lines"]] == [text]


def test_an_observed_scan_says_which_lines_it_executed(page: Page) -> None:
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    page.scan(2)
    found = page.done("source", plc="pump", instance="Main")
    texts = {found["first"] + at: line["text"] for at, line in enumerate(found["lines"])}
    executed = [texts[number] for number in page.update()["inside"]["executed"]]
    assert any("Curve[1] := Level" in text for text in executed)


def test_lines_of_methods_and_properties_belong_to_their_instance() -> None:
    text = """FUNCTION_BLOCK Counter VAR n : INT; END_VAR
METHOD PUBLIC Add VAR_INPUT Step : INT; END_VAR
n := n + Step;
END_METHOD
PROPERTY Count : INT GET
Count := n;
END_GET END_PROPERTY END_FUNCTION_BLOCK
PROGRAM Main VAR c : Counter; seen : INT; END_VAR c.Add(Step := 2); IF seen < 3 THEN seen := c.Count; END_IF END_PROGRAM"""
    page = Page(text)
    page.done("hello", version=1)
    page.done("look", plc="pump", names=[], instance="Main.c", scan=True)
    assert page.done("source", plc="pump", instance="Main.c")["lines"][2]["names"] == ["Main.c.n"]
    page.scan()
    assert page.update()["inside"]["executed"] == [3, 6]


def test_the_past_is_looked_at_and_not_written(page: Page) -> None:
    page.done("look", plc="pump", names=["Main.Level"])
    page.scan(30)
    page.done("view", plc="pump", scan=9)
    update = page.update()
    assert (update["state"], update["scan"], update["values"]) == ("past", 9, {"Main.Level": "30"})
    assert "past" in page.ask("write", plc="pump", name="Main.Level", value="1")["error"]
    page.done("view", plc="pump")
    assert page.update()["values"] == {"Main.Level": "50"}
    assert "recorded" in page.ask("view", plc="pump", scan=99)["error"]


def test_rungs_of_the_present_are_shown_where_an_instance_is_looked_at(page: Page) -> None:
    page.scan(3)
    assert not page.session.shows_inside
    page.done("look", plc="pump", names=[], instance="Main", scan=True)
    assert page.session.shows_inside
    page.done("view", plc="pump", scan=1)
    assert not page.session.shows_inside
    page.done("view", plc="pump")
    assert page.session.shows_inside


def test_history_has_every_one_of_the_last_scans(page: Page) -> None:
    page.scan(30)
    found = page.done("history", plc="pump", names=["Main.Level", "Main.Pump"], scans=4)
    assert (found["first"], found["values"]) == (26, {"Main.Level": ["47", "48", "49", "50"], "Main.Pump": ["FALSE"] * 4})
    assert found["times"][1] - found["times"][0] == page.plc.cycle_ns


@pytest.mark.slow
def test_why_names_the_statement_that_gave_a_value(page: Page) -> None:
    page.scan(80)
    text = page.done("why", plc="pump", name="Main.Pump")["text"]
    assert "Main.Pump" in text and "Level >= High" in text


def test_a_pulled_cable_lets_nothing_pass_and_the_unit_says_so(page: Page) -> None:
    page.done("look", plc="pump", names=[], units=True)
    [unit] = page.update()["units"]
    assert (unit["name"], unit["plugged"]) == ("ETN21 0", True)
    page.done("cable", plc="pump", unit="ETN21 0", plugged=False)
    page.scan(2)
    [unit] = page.update()["units"]
    assert [lamp["name"] for lamp in unit["front"]["lamps"] if lamp["is_on"]] == ["RUN"]
    assert not unit["plugged"] and page.network.faults[0].silent and not page.plc.units[0].unit.settings["link_up"]
    page.done("cable", plc="pump", unit="ETN21 0", plugged=True)
    assert page.network.faults == [] and page.plc.units[0].unit.settings["link_up"]


@pytest.mark.slow
def test_the_restart_button_of_a_unit_restarts_it(page: Page) -> None:
    page.done("look", plc="pump", names=[], units=True)
    page.scan(3)
    [unit] = page.update()["units"]
    restart, value = unit["front"]["restart"]
    [initializing] = [address for address, said, *_ in unit["words"] if said.endswith("Initializing Flag")]
    page.done("write", plc="pump", name=restart, value=value)
    seen = [(True, False)]
    while any(seen[-1]) and len(seen) < 1000:
        page.scan()
        seen.append((page.plc.read(restart), page.plc.read(initializing)))
    assert (True, True) in seen and seen[-1] == (False, False), "it initializes, and turns the bit OFF when it is done"


def test_faults_are_switched_on_and_off_by_name(page: Page) -> None:
    page.done("look", plc="pump", names=[], network=True)
    measures = page.done("hello")["measures"]
    assert (measures["slow"], measures["lossy"], {"cut", "interrupted"} & set(measures)) == ("time", "percent", set())
    page.done("fault", kind="slow", peer="192.168.250.1:502", time="30ms")
    page.done("fault", kind="lossy", percent=50)
    assert [row.lose_percent for row in page.network.faults] == [0, 50] and page.network.faults[0].latency_ns == 30_000_000
    assert [(row["kind"], row["peer"]) for row in page.update()["faults"]] == [("slow", "192.168.250.1:502"), ("lossy", "all")]
    for peer in ("192.168.250.1:70000", "192.168.250.1:999999", "192.168.250.1:x"):
        assert "is no port" in page.ask("fault", kind="slow", peer=peer, time="30ms")["error"]
    page.done("mend", number=0)
    assert [row.lose_percent for row in page.network.faults] == [50]
    page.done("mend")
    assert page.network.faults == []


def test_memory_is_shown_from_a_word_on(page: Page) -> None:
    page.plc.write("D201", 7)
    page.done("look", plc="pump", names=[], memory="D", first=200)
    assert page.update()["memory"]["words"][:3] == [0, 7, 0]


def test_a_trap_is_shown_and_a_start_ends_it() -> None:
    page = Page("PROGRAM Main VAR a, b : INT; END_VAR a := 1 / b; END_PROGRAM")
    page.done("hello")
    page.scan()
    assert (update := page.update())["state"] == "trap" and "Main" in update["trap"]
    page.done("start", plc="pump", kind="warm")
    assert page.update()["state"] == "run"


def test_modes_and_starts_are_acts(page: Page) -> None:
    page.scan(5)
    page.done("mode", plc="pump", mode="PROGRAM")
    page.scan(5)
    assert page.plc.read("Main.Level") == 25
    page.plc.write("D100", 7)
    for kind, kept in (("warm", 7), ("cold", 0)):
        page.done("start", plc="pump", kind=kind)
        assert (page.plc.read("Main.Level"), page.plc.read("D100")) == (20, kept)
    assert [text for _, _, text in page.update()["acts"]] == ["mode PROGRAM", "warm start", "cold start"]


def test_two_pages_see_the_same_plc_and_what_the_other_did(page: Page) -> None:
    from fbvm.live.session import Session

    other = Session(page.bench)
    other.answer('{"do":"hello"}')
    page.done("write", plc="pump", name="Main.Level", value="70")
    text = other.update(UPDATE_NS)
    assert text is not None and "Main.Level := 70" in text


def test_what_was_done_by_hand_becomes_a_pytest_that_passes(tmp_path: Any) -> None:
    from browsers import PUMP

    source = tmp_path / "pump.st"
    source.write_text(PUMP)

    def made(acts: Any, live: LivePlc, seen: Any) -> str:
        return pytest_text(acts, live, seen, [source])

    page = Page(test=made)
    page.done("hello")
    page.done("look", plc="pump", names=["Main.Level", "Main.Pump", "Main.Said"])
    page.scan(7)
    page.done("write", plc="pump", name="Main.Level", value="88")
    page.scan(2)
    page.done("force", plc="pump", name="Main.Pump", value="FALSE")
    page.scan(5)
    page.done("release", plc="pump", name="Main.Pump")
    text = page.done("test", plc="pump")["text"]
    assert "plc.write('Main.Level', 88)" in text and "Fault" not in text
    execute(text)


def execute(text: str) -> None:
    """Runs a test that a page has written."""
    space: dict[str, Any] = {}
    exec(compile(text, "test_by_hand.py", "exec"), space)
    space["test_what_was_done_by_hand"]()


@pytest.mark.slow
def test_faults_and_cables_are_done_again_by_the_pytest(tmp_path: Any) -> None:
    source = tmp_path / "client.st"
    source.write_text("""PROGRAM Main VAR Connection : MTCP_ETN_Connect; Link AT CIO 1517.14 : BOOL; Up : BOOL; END_VAR
        Connection(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
        Up := Link;
        END_PROGRAM""")
    page = Page(source.read_text(), test=lambda acts, live, seen: pytest_text(acts, live, seen, [source]))
    page.done("hello")
    page.done("look", plc="pump", names=["Main.Up", "D30009", "D30027"])
    page.done("fault", kind="silent", peer="192.168.250.1")
    page.done("fault", kind="slow", peer="192.168.250.1:502", time="30ms")
    page.scan(4)
    page.done("mend", number=1)
    page.done("cable", plc="pump", unit="ETN21 0", plugged=False)
    page.scan(4)
    text = page.done("test", plc="pump")["text"]
    assert "latency_ns=30000000" in text and "not repeated" not in text
    assert "plc.read('Main.Up') == False" in text and "plc.read('D30009') == 2" in text
    execute(text)
    page.done("cable", plc="pump", unit="ETN21 0", plugged=True)
    page.scan(4)
    page.done("mend")
    execute(page.done("test", plc="pump")["text"])


def test_every_act_is_in_the_recording_and_is_done_again_to_the_same_memory() -> None:
    page = Page()
    page.scan(5)
    page.done("write", plc="pump", name="Main.Level", value="70")
    page.scan(3)
    page.done("force", plc="pump", name="Main.Pump", value="TRUE")
    page.scan(3)
    page.done("cable", plc="pump", unit="ETN21 0", plugged=False)
    page.done("release", plc="pump")
    page.scan(5)
    recorded = page.recording["pump"]
    assert [recorded.at(scan).read("Main.Level") for scan in (5, 6, 8, 9, 11)] == [25, 71, 73, 71, 67]
    again = recorded.at(page.plc.scans)
    assert bytes(again.memory.map[:]) == bytes(page.plc.memory.map[:])


def test_a_restart_is_refused_while_nothing_has_changed(page: Page) -> None:
    assert page.ask("restart")["error"] == "the program has not changed"


def test_a_scan_stands_at_a_breakpoint_and_goes_on_by_statements(page: Page) -> None:
    page.done("break", plc="pump", kind="condition", where="Main.Level > 22")
    page.run(10)
    update = page.update()
    assert update["state"] == "halt" and update["halt"]["why"] == "Main.Level > 22 holds" and page.control.is_paused
    assert page.plc.read("Main.Level") == 23 and page.plc.scans == 2
    line = update["halt"]["line"]
    page.done("statement", plc="pump")
    page.run(1)
    update = page.update()
    assert update["halt"]["line"] > line or update["halt"]["line"] == 0
    assert update["halt"]["why"] == ""
    assert [row.kind for row in page.plc.breakpoints] == ["condition"]
    page.done("unbreak", plc="pump", number=0)
    page.done("run")
    page.run(3)
    assert page.update()["state"] == "run" and page.update().get("breaks", []) == []


def test_a_breakpoint_at_a_line_has_a_condition_and_is_listed(page: Page) -> None:
    page.done("break", plc="pump", kind="line", where="Main", when="Level = 25")
    assert page.update()["breaks"] == [f"line {next(iter(page.plc.breakpoints))}"]
    assert page.bench.acts[-1].text == f"breakpoint at line {next(iter(page.plc.breakpoints))}"
    page.run(20)
    assert page.plc.read("Main.Level") == 25 and page.update()["halt"]["instance"] == "Main"


def test_a_breakpoint_that_cannot_be_set_is_refused_in_words(page: Page) -> None:
    assert "no" in page.ask("break", plc="pump", kind="line", where="nowhere.st:3")["error"]
    assert page.ask("break", plc="pump", kind="moon", where="x")["error"].startswith("a breakpoint is a line")
    assert page.ask("unbreak", plc="pump", number=4)["error"] == "there is no breakpoint 4"
    assert "only look" in Page(read_only=True).ask("break", plc="pump", kind="line", where="Main")["error"]


def test_lines_and_pictures_are_seen_while_a_breakpoint_is_armed(page: Page) -> None:
    page.done("look", plc="pump", instance="Main", scan=True)
    page.done("break", plc="pump", kind="condition", where="Main.Level > 1000")
    page.update()
    page.run(3)
    assert page.update()["inside"]["executed"]


def test_a_write_at_a_breakpoint_is_recorded(page: Page) -> None:
    page.done("break", plc="pump", kind="line", where="Main", when="Level = 22")
    page.run(20)
    page.done("write", plc="pump", name="Main.Level", value="60")
    page.done("unbreak", plc="pump")
    page.done("run")
    page.run(4)
    scans = page.live.recorded.scans
    assert page.live.recorded.at(scans.stop).read("Main.Level") == page.plc.read("Main.Level") == 64


def test_what_has_passed_is_saved_for_wireshark(page: Page) -> None:
    data = base64.b64decode(page.done("capture", plc="pump")["pcapng"])
    assert data[:4] == bytes.fromhex("0a0d0d0a") and b"fbvm" in data
    [unit] = [attached.unit.address for attached in page.plc.units]
    empty, packets = len(data), []
    for address in ("192.168.250.99", unit):
        local, remote = Peer(address, 1025), Peer("192.168.250.1", 502)
        tell = page.network.tap
        assert tell is not None
        tell(0, address, TapEvent(TapKind.SYN, local, remote, out=True))
        packets.append(len(page.live.capture()) > empty)
    assert packets == [False, True]


def test_scan_times_are_told_as_a_histogram_where_they_are_looked_at(page: Page) -> None:
    page.plc.scan_times.note(0, 1000)
    page.plc.scan_times.note(1, 1000)
    page.plc.scan_times.note(2, 70_000)
    assert "times" not in page.update()
    page.done("look", plc="pump", times=True)
    bins = page.update()["times"]
    assert [count for _, count in bins] == [2, 1]
    assert 960 <= bins[0][0] <= 1000 and 67_000 <= bins[1][0] <= 70_000


def test_another_future_begins_behind_a_past_scan_and_has_done_the_same_before() -> None:
    old, new = Page(), Page()
    new.done("hello", version=1)
    old.bench.can_branch = True
    old.scan(5)
    old.done("write", plc="pump", name="Main.Level", value="60")
    old.scan(5)
    old.done("write", plc="pump", name="Main.Level", value="70")
    old.scan(5)
    old.done("view", plc="pump", scan=7)
    assert "past" in old.ask("write", plc="pump", name="Main.Level", value="1")["error"]
    old.done("branch", plc="pump")
    assert old.bench.branch_at == ("pump", 8) and old.control.has_ended
    run_again(new.bench, [Running(new.plc, scans=1000)], old.bench.orders, "pump", 8)
    assert new.plc.scans == 8 and new.plc.memory.map[:] == old.live.recorded.at(8).memory.map[:]
    new.bench.futures = [Future("future 1", {"pump": old.live})]
    new.done("view", plc="pump", scan=14, future=0)
    new.done("look", plc="pump", names=["Main.Level"])
    update = new.update()
    assert (update["state"], update["scan"], update["values"]["Main.Level"]) == ("past", 14, "75")
    assert "there is no future" in new.ask("view", plc="pump", scan=1, future=3)["error"]


def test_a_past_that_cannot_be_done_again_has_one_future(page: Page) -> None:
    page.scan(3)
    page.done("view", plc="pump", scan=1)
    assert "cannot be done again" in page.ask("branch", plc="pump")["error"]


@pytest.mark.slow
def test_with_real_connections_machine_code_notes_the_power_of_rungs_until_nobody_looks() -> None:
    page = Page(RUNGS, real=True)
    page.done("hello", version=1)
    page.done("look", plc="pump", instance="Main", scan=True)
    page.plc.write("Main.on", True)
    page.update()
    page.scan(2)
    assert page.live.power is not None
    update = page.update()["inside"]
    (_, svg), = update["pictures"]
    assert update["scan"] == 1 and "power" in svg and ">= 7<" in svg
    page.done("break", plc="pump", kind="condition", where="Main.n > 100")
    page.scan()
    assert page.live.power is None
    page.done("unbreak", plc="pump")
    for _ in range(3):  # at most each 250 ms somebody asks for it
        page.update()
    assert page.live.power is not None
    page.live.end_power()
    page.scan(2)
    assert page.live.power is None


def test_an_update_is_of_one_moment_though_it_takes_many_slices(page: Page) -> None:
    page.done("look", plc="pump", names=[*(f"D{number}" for number in range(100, 130)), "Main.Level"])
    assert page.session.update(UPDATE_NS, lambda: True) is None
    slices = 1
    while (text := page.session.update(UPDATE_NS + slices, lambda: True)) is None:
        page.scan()
        slices += 1
    update = json.loads(text)["update"]
    assert slices > 3 and (update["scan"], update["values"]["Main.Level"]) == (-1, "20")
    assert not page.session.is_behind


def test_names_of_another_plc_stand_beside() -> None:
    page, other = Page(), Page()
    page.bench.plcs["tank"] = other.live
    page.done("hello", version=1)
    found = page.done("look", plc="pump", names=["tank/Main.Level", "tank/x", "none/x"], plant=True)
    assert list(found["rows"]) == ["tank/Main.Level"] and len(found["unknown"]) == 2
    other.scan(3)
    update = page.update()
    assert update["values"] == {"tank/Main.Level": "23"}
    assert [row["units"][0]["plugged"] for row in update["plant"]["plcs"]] == [True, True]


def test_who_looks_at_another_plc_looks_at_its_present() -> None:
    page, other = Page(), Page()
    page.bench.plcs["tank"] = other.live
    page.done("hello", version=1)
    page.done("look", plc="pump", names=["Main.Level"])
    page.scan(30)
    page.done("view", plc="pump", scan=9)
    page.done("look", plc="pump", names=["Main.Level", "D10"])
    assert page.update()["state"] == "past", "the same PLC is still seen as it was"
    page.done("look", plc="tank", names=["Main.Level"])
    update = page.update()
    assert (update["state"], update["values"]) == ("run", {"Main.Level": "20"})


def test_groups_are_kept_in_a_file_and_read_again_when_it_changes(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "watch.toml"
    assert "no file" in page.ask("group", name="a", names=["D10"])["error"]
    page.bench.groups = WatchGroups(file)
    page.done("group", name='The "pump"', names=["pump/Main.Level", "D10"])
    page.done("group", name="b", names=["D10"])
    page.done("group", name="b", names=[])
    assert page.update()["groups"] == {'The "pump"': ["pump/Main.Level", "D10"]} == WatchGroups(file).rows
    file.write_text("[[group]]\nname = 'by hand'\nnames = ['D20', 5]\n[[group]]\nname = 7\n")
    page.bench.groups.look()
    assert page.update()["groups"] == {"by hand": ["D20"]}
    file.write_text("[[group")
    page.bench.groups.look()
    assert page.bench.groups.rows == {"by hand": ["D20"]}
    assert "characters" in page.ask("group", name="x" * 61, names=["D10"])["error"]
    file.unlink()
    page.bench.groups.look()
    assert page.bench.groups.rows == {}


def slices(page: Page, do: str, **fields: object) -> tuple[dict[str, Any], int]:
    """A reply, and the number of slices between scans that it takes if time is up after each step."""
    text, taken = page.session.answer(json.dumps({"id": 1, "do": do, **fields})), 1
    while text is None:
        text, taken = page.session.update(0, lambda: True), taken + 1
    return json.loads(text)["ok"], taken


@pytest.mark.slow
def test_long_replies_are_worked_out_and_written_in_slices() -> None:
    lines = "".join(f"a[{number}] := a[{number}] + 1;\n" for number in range(1, 121))
    page = Page(f"PROGRAM Main\nVAR a : ARRAY[1..120] OF INT; END_VAR\n{lines}END_PROGRAM\n")
    names = [f"Main.a[{number}]" for number in range(1, 121)]
    seen, taken = slices(page, "look", plc="pump", names=[*names, "Main.b"])
    assert list(seen["rows"]) == names and list(seen["unknown"]) == ["Main.b"] and taken > 24
    listed, taken = slices(page, "parts", plc="pump", name="Main.a")
    assert [part["name"] for part in listed["parts"]] == names and taken > 10
    source, taken = slices(page, "source", plc="pump", instance="Main")
    assert [line["names"] for line in source["lines"]][2:122] == [[name] for name in names] and taken > 60


def test_what_is_looked_at_changes_in_the_order_of_the_questions(page: Page) -> None:
    page.scan(3)
    asked = [{"do": "look", "plc": "pump", "names": ["Main.Level"] * 40},
             {"do": "view", "plc": "pump", "scan": 1}, {"do": "view", "plc": "pump"}]  # fmt: skip
    told = [page.session.answer(json.dumps({"id": number, **one})) for number, one in enumerate(asked)]
    assert told == [None] * 3
    assert [json.loads(page.session.update(0) or "")["re"] for _ in asked] == [0, 1, 2]


def test_a_message_that_is_written_in_steps_reads_the_same() -> None:
    long = {str(number): [number] for number in range(200)}
    rows: list[tuple[dict[str, Any], int]] = [
        ({}, 0), ({"re": 1, "ok": {}}, 0), ({"a": [*range(PIECE)]}, 0), ({"a": [*range(PIECE + 1)]}, 2),
        ({"a": long}, -(-200 // PIECE)),
        ({"a": {"b": {"c": long}}}, 0), (long, 0),
        ({"re": None, "ok": {"a": [*range(200)], "b": "\u00e4", "c": long, "d": {"e": [[]] * 60}}},
         2 * -(-200 // PIECE) - (-60 // PIECE)),
    ]  # fmt: skip
    for message, wanted in rows:
        steps, count = dump_in_steps(message), 0
        with pytest.raises(StopIteration) as ended:
            while True:
                next(steps)
                count += 1
        assert (ended.value.value, count) == (dump(message), wanted), message


@pytest.mark.slow
def test_two_pages_see_three_hours_of_virtual_time_and_where_they_end() -> None:
    page = Page(PUMP, cycle_ns=10_000_000_000)
    other = Session(page.bench)
    for session in (page.session, other):
        session.answer('{"do": "hello"}')
        session.answer('{"do": "look", "plc": "pump", "names": ["Main.Level"]}')
    updates = 0
    for _ in range(3 * 60):
        page.scan(6)
        updates += bool(page.update().get("values"))
    told = json.loads(other.update(page.now_ns) or "")["update"]
    assert updates > 150 and told["ns"] == page.plc.now_ns == (3 * 3600 - 10) * 10**9 and told["values"]["Main.Level"]
    assert page.done("view", plc="pump", scan=told["held"][0]) == {"scan": told["held"][0]}
