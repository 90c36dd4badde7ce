"""The project file: what it may say, what is said of a bad one, and the PLCs that come of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.engine.choice.tiers import choice_of
from fbvm.engine.native import engine as native
from fbvm.net.faults import KINDS, Fault
from fbvm.net.loop import LoopNetwork
from fbvm.run import run_all
from fbvm.run.fault_rows import FAULT
from fbvm.run.plant import MANY, Plant
from fbvm.run.project import PLC, RUN, SERVER, Project, near, project_file, read_project
from fbvm.run.toml_keys import span
from fbvm.wire.link import Peer

MS = 1_000_000
COUNTER = """
PROGRAM Main
VAR n : INT; step : INT := 1; wait : TIME; words AT D200 : ARRAY[0..1] OF WORD; END_VAR
    n := n + step;
END_PROGRAM
"""
CLIENT = """
PROGRAM Main
VAR conn : MTCP_ETN_Connect; read : MTCP_ETN_Fn03; END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    read(EN := conn.ENO, Register_Address := 0, Register_Qty := 2, RespData_DM := 200, Cmd_Read := TRUE, SlaveID := 1);
END_PROGRAM
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "counter.st").write_text(COUNTER, encoding="utf-8")
    (tmp_path / "client.st").write_text(CLIENT, encoding="utf-8")
    return tmp_path


def read(folder: Path, text: str) -> Project | list[Diagnostic]:
    (folder / "fbvm.toml").write_text(text, encoding="utf-8")
    return read_project(folder / "fbvm.toml")


def project(folder: Path, text: str) -> Project:
    found = read(folder, text)
    assert isinstance(found, Project), [diagnostic.render() for diagnostic in found]
    return found


def said(diagnostics: list[Diagnostic]) -> list[tuple[str, int, str]]:
    return [(diagnostic.code, diagnostic.line, diagnostic.message) for diagnostic in diagnostics]


# --- reading ----------------------------------------------------------------------------------------------------------

WHOLE = """
run = {net = "tcp", for = "1m", seed = 7}

[[server]]
address = "192.168.250.1:502"
host = "127.0.0.1:15020"

[[door]]
address = "192.168.250.21:502"
host = "127.0.0.1:0"

[[fault]]
kind = "cut"
peer = "192.168.250.1:502"
from = "2s"
until = "3s"
gap = "0s"

[plc.pump]
sources = ["counter.st"]
cycle = "5ms"
pace = "event"
engine = "python"
count = 3
until = "Main.n > 2"
watch = ["Main.n"]
set = [{name = "Main.step", value = 2, at = "10ms"}]

[[plc.pump.unit]]
address = "192.168.250.21"

[[plc.pump.unit]]
number = 1
address = "192.168.251.21"
timing = "real"
"""


def test_everything_that_can_be_said(folder: Path) -> None:
    found = project(folder, WHOLE)
    assert (found.net, found.for_ns, found.seed, found.scans) == ("tcp", 60_000 * MS, 7, None)
    assert found.servers == ((Peer("192.168.250.1", 502), ("127.0.0.1", 15020)),)
    assert found.doors == ((Peer("192.168.250.21", 502), ("127.0.0.1", 0)),)
    (fault,) = found.faults
    assert (fault.segment_bytes, fault.random_cut) == (KINDS["cut"].segment_bytes, True)
    assert (fault.peer, fault.from_ns, fault.until_ns, fault.gap_ns) == (Peer("192.168.250.1", 502), 2000 * MS, 3000 * MS, 0)
    (plc,) = found.plcs
    assert (plc.name, plc.sources, plc.cycle_ns, plc.pace) == ("pump", (folder / "counter.st",), 5 * MS, "event")
    assert (plc.engine, plc.count, plc.until, plc.watch) == ("python", 3, "Main.n > 2", ("Main.n",))
    assert [(unit.kind, unit.address, unit.options) for unit in plc.units] == [
        ("ETN21", "192.168.250.21", {}), ("ETN21", "192.168.251.21", {"number": 1, "timing": "real"})]  # fmt: skip
    assert [(row.name, row.value, row.at_ns) for row in plc.sets] == [("Main.step", 2, 10 * MS)]


def test_the_least_that_must_be_said(folder: Path) -> None:
    found = project(folder, '[plc.a]\nsources = ["counter.st"]\n')
    assert (found.net, found.for_ns, found.servers, found.faults) == ("loop", None, (), ())
    assert (found.plcs[0].cycle_ns, found.plcs[0].pace, found.plcs[0].count) == (10 * MS, "cyclic", None)


@pytest.mark.parametrize(("text", "messages"), [
    ("", [("P0104", 1, "plc is missing")]),
    ("[plc]", [("P0104", 1, "there is no PLC")]),
    ("a = [1", [("P0101", 1, "unclosed array")]),
    ("[plc.a]\nsources = ['counter.st']\nsource = 1", [("P0102", 3, "plc.a.source is no key of a project")]),
    ("plc = 3", [("P0103", 1, "plc is no table")]),
    ("[[plc]]\nname = 'a'", [("P0103", 1, "plc is no table")]),
    ("[plc]\nsources = ['counter.st']\ncycle = '10ms'", [("P0103", 1, "sources, cycle: of which plc?")]),
    ("[plc.a]\nsources = []", [("P0103", 2, 'plc.a.sources: [] is no list of texts; write ["one", "other"]')]),
    ("[plc.a]\nsources = ['c.st']\ncount = true", [
        ("P0103", 3, "plc.a.count: True is no whole number from 1 to 100000")]),
    ("[plc.a]\nsources = ['c.st']\ncycle = '0s'", [("P0103", 3, "plc.a.cycle: '0s' is no time that can pass")]),
    ("[plc.a]\nsources = ['c.st']\n[[plc.a.unit]]\naddress = '1.2.3.4'\n[[plc.a.unit]]\nnumber = 1", [
        ("P0104", 5, "plc.a.unit 2.address is missing")]),
    ("[plc.a]\nsources = ['c.st']\n[[plc.a.unit]]\naddress = '1.2.3.4'\ntype = 'NOC'\nnumber = 1\nmodel = 'T3'", [
        ("P0102", 6, "number is no key of a unit of type NOC"), ("P0102", 7, "model is no key of a unit of type NOC")]),
    ("[plc.a]\nsources = ['c.st']\nunit = 1", [("P0103", 3, "plc.a.unit is no list of tables")]),
    ("[plc.a]\nsources = ['c.st']\n[[server]]\naddress = 'here:502'", [
        ("P0103", 4, "server 1.address: 'here' is no IPv4 address; write \"192.168.250.21\"")]),
    ("[plc.a]\nsources = ['c.st']\n[[server]]\naddress = '1.2.3.4'", [
        ("P0103", 4, "server 1.address: '1.2.3.4' is no address and port; write \"192.168.250.1:502\"")]),
    ("[plc.a]\nsources = ['c.st']\n[[fault]]\nkind = 'odd'\nsilent = 1\nfrom = '-1s'", [
        ("P0103", 4, "fault 1.kind: 'odd' is none of " + ", ".join(KINDS)),
        ("P0103", 5, "fault 1.silent: 1 is neither true nor false"),
        ("P0103", 6, "fault 1.from: '-1s' is before power-on")]),
])  # fmt: skip
def test_what_is_wrong_is_said_where_it_stands(folder: Path, text: str, messages: list[tuple[str, int, str]]) -> None:
    found = read(folder, text)
    assert isinstance(found, list)
    assert said(found) == messages


def test_a_misspelt_key_is_offered_in_the_right_spelling(folder: Path) -> None:
    found = read(folder, '[plc.a]\nsources = ["c.st"]\ncycel = "1ms"\n')
    assert isinstance(found, list)
    assert found[0].render().endswith('cycel = "1ms"\n    ^^^^^^^^^^^^^\n  help: did you mean cycle?')


def test_what_a_key_means_is_said_beside_a_wrong_value(folder: Path) -> None:
    found = read(folder, '[plc.a]\nsources = ["c.st"]\ncycle = 10\n[[server]]\n')
    assert isinstance(found, list)
    assert {row.hint for row in found} == {SERVER["address"].meaning, PLC["cycle"].meaning}


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    found = read_project(tmp_path / "fbvm.toml")
    assert isinstance(found, list)
    assert [diagnostic.code for diagnostic in found] == ["S0107"]


def test_a_project_is_a_folder_or_its_file(folder: Path) -> None:
    assert project_file(folder) is None
    file = folder / "fbvm.toml"
    file.write_text("", encoding="utf-8")
    assert project_file(folder) == project_file(file) == file
    assert project_file(folder / "counter.st") is None


@each_of(("path", "line"), [
    (("a",), 1), (("t", "b"), 3), (("t", "b", "deeper"), 3), (("t", "inner", "c"), 5), (("rows", 0, "d"), 7),
    (("rows", 1, "d"), 9), (("rows", 1, "sub", 0, "e"), 11), (("rows", 1, "absent"), 8), (("q r", "f"), 13),
])  # fmt: skip
def test_where_keys_stand(path: tuple[str | int, ...], line: int) -> None:
    source = Source("x.toml", """a = 1
[t]
b.deeper = 2
[t.inner]
c = 3
[[rows]]
d = 4
[[rows]]
d = 5
[[rows.sub]]
e = 6
["q r"]
f = 7
""")
    assert source.place(span(source, path)[0])[0] == line


# --- building and running ---------------------------------------------------------------------------------------------


def plant(folder: Path, text: str, **options: int) -> Plant:
    built = Plant(project(folder, text), **options)  # type: ignore[arg-type]
    assert not errors(built.diagnostics), [diagnostic.render() for diagnostic in built.diagnostics]
    return built


def test_units_of_each_type(folder: Path) -> None:
    built = plant(folder, """
[plc.a]
sources = ["counter.st"]
[[plc.a.unit]]
address = "192.168.250.21"
[[plc.a.unit]]
type = "NOC"
slot = 9
address = "192.168.250.22"
mac = "00:80:F4:01:02:03"
http = false
restart = "1s"
[[plc.a.unit]]
type = "Tianxing"
model = "T3"
address = "192.168.250.23"
""")
    units = [attached.unit for attached in built.kinds[0].runs[0].plc.units]
    assert [unit.name for unit in units] == ["ETN21 0", "NOC 9", "Tianxing T3"]
    assert (units[1].configuration["restart_ns"], units[1].configuration["http"]) == (1000 * MS, False)


def test_a_unit_that_cannot_be_is_said(folder: Path) -> None:
    found = project(folder, """
[plc.a]
sources = ["counter.st"]
[[plc.a.unit]]
type = "NOC"
slot = 99
address = "192.168.250.22"
""")
    assert said(errors(Plant(found).diagnostics)) == [
        ("P0103", 4, "a module is in slot 0 to 16 of the rack, or 254 within the CPU; not 99")]


def test_two_kinds_with_ends_of_their_own(folder: Path) -> None:
    built = plant(folder, """
[plc.short]
sources = ["counter.st"]
until = "Main.n = 6"
watch = ["Main.n", "D200..D201"]
set = [{name = "Main.step", value = 2}, {name = "Main.wait", value = "T#1s"}, {name = "D200..D201", value = [1, 2]}]
[plc.other]
sources = ["counter.st"]
cycle = "5ms"
""")
    run_all(built.runs)
    assert [run.reason for run in built.runs] == ["until", "until"]
    assert [run.plc.scans for run in built.runs] == [3, 5]
    assert built.kinds[0].values(built.runs[0]) == {"Main.n": 6, "D200..D201": [1, 2]}
    assert built.runs[0].plc.read("Main.wait") == 1000 * MS


def test_many_equal_plcs_share_everything_but_their_memory(folder: Path) -> None:
    built = plant(folder, f"""
run = {{for = "30ms"}}
[plc.pump]
sources = ["counter.st"]
count = {MANY}
[[plc.pump.unit]]
address = "10.0.0.250"
""")
    run_all(built.runs)
    plcs = [run.plc for run in built.runs]
    assert built.kinds[0].names[::MANY - 1] == ["pump[1]", f"pump[{MANY}]"]
    assert [plc.units[0].unit.address for plc in plcs][4:8] == ["10.0.0.254", "10.0.0.255", "10.0.1.0", "10.0.1.1"]
    assert len({id(plc.image) for plc in plcs}) == 1
    assert {type(plc.engine).__name__ for plc in plcs} == {"NativeEngine" if native.available() else "PythonEngine"}
    plcs[3].write("Main.n", 77)
    assert [plc.read("Main.n") for plc in plcs[2:5]] == [3, 77, 3]


@each_of(("count", "engine", "chosen"), [(MANY - 1, "auto", "auto"), (MANY, "auto", "native"), (MANY, "python", "python")])
@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_machine_code_from_the_first_scan_on_is_for_many_plcs_that_leave_it_open(folder: Path, count: int, engine: str,
                                                                                chosen: str) -> None:  # fmt: skip
    built = plant(folder, f'[plc.pump]\nsources = ["counter.st"]\ncount = {count}\nengine = "{engine}"\n')
    assert {choice_of(run.plc.engine) for run in built.runs} == {chosen}


PAIR = """
run = {{for = "2s"}}
[[server]]
address = "192.168.250.1:502"
{fault}
[plc.client]
sources = ["client.st"]
until = "Main.read.Rcv_Counter = 1"
[[plc.client.unit]]
address = "192.168.250.21"
"""


@pytest.mark.slow
def test_a_server_in_memory_answers(folder: Path) -> None:
    built = plant(folder, PAIR.format(fault=""))
    assert isinstance(built.network, LoopNetwork)
    run_all(built.runs)
    assert (built.runs[0].reason, built.runs[0].plc.read("D200..D201")) == ("until", [1000, 1001])


@pytest.mark.slow
def test_faults_lie_on_the_way(folder: Path) -> None:
    built = plant(folder, PAIR.format(fault='[[fault]]\nkind = "refused"'))
    run_all(built.runs)
    assert (built.runs[0].reason, built.runs[0].plc.read("Main.conn.Error_Code")) == ("max", 0x4A)


def test_the_command_line_says_more_than_the_file(folder: Path) -> None:
    text = 'run = {for = "1s"}\n[plc.a]\nsources = ["counter.st"]\n'
    built = plant(folder, text, scans=2)
    run_all(built.runs)
    assert [(run.reason, run.plc.scans) for run in built.runs] == [("scans", 2)]


@pytest.mark.parametrize(("text", "line", "message"), [
    ('until = "Main.m > 1"', 3, "Main has no m"),
    ('watch = ["Main.n", "D99999"]', 3, "99999 does not exist"),
    ('set = [{name = "Main.n", value = "much"}]', 3, "Main.n"),
    ('set = [{name = "Main.n", value = 40000}]', 3, "40000"),
    ('set = [{name = "D200..D201", value = [1]}]', 3, "D200..D201 takes a list of 2 values"),
    ('libraries = ["nowhere"]', 3, "there is no folder"),
    ("[[plc.a.unit]]\naddress = '1.2.3.4'\n[[plc.a.unit]]\naddress = '1.2.3.5'", 5, "ETN21 0 is on the backplane already"),
    ("[[plc.a.unit]]\naddress = '1.2.3.4'\n[[plc.a.unit]]\naddress = '1.2.3.4'\nnumber = 1", 5, "1.2.3.4 is attached"),
])  # fmt: skip
def test_what_does_not_fit_the_program(folder: Path, text: str, line: int, message: str) -> None:
    built = Plant(project(folder, f'[plc.a]\nsources = ["counter.st"]\n{text}\n'))
    (found,) = errors(built.diagnostics)
    assert (found.code, found.line) == ("P0103", line)
    assert message in found.message


def test_errors_of_programs_are_told_as_always(folder: Path) -> None:
    (folder / "bad.st").write_text("PROGRAM Main\n    x := 1;\nEND_PROGRAM\n", encoding="utf-8")
    (folder / "dots.st").mkdir()
    built = Plant(project(folder, '[plc.a]\nsources = ["bad.st"]\n[plc.b]\nsources = ["dots.st"]\n'))
    assert [found.code for found in errors(built.diagnostics)] == ["S0201", "S0107"]


def test_a_source_that_is_not_there_is_told_at_its_place(folder: Path) -> None:
    for written, hint in (("countre.st", "did you mean counter.st?"), ("x/y.st", "")):
        found = Plant(project(folder, f"[plc.a]\ncycle = '10ms'\nsources = ['{written}']\n")).diagnostics
        assert said(found) == [("P0103", 3, f"plc.a.sources: there is no file {folder / written}")]
        assert found[0].hint == hint
    found = Plant(project(folder, "[plc.a]\nsources = ['valve.st']\n")).diagnostics
    assert found[0].hint.startswith("there is ") and "counter.st" in found[0].hint


def test_a_hint_names_five_sources_at_most(tmp_path: Path) -> None:
    for number in range(1, 6):
        (tmp_path / f"{number}.st").touch()
    assert near(tmp_path / "valve.st") == "there is 1.st, 2.st, 3.st, 4.st, 5.st"
    (tmp_path / "6.st").touch()
    assert near(tmp_path / "valve.st") == "there is 1.st, 2.st, 3.st, 4.st, 5.st, ..."
    assert near(tmp_path / "nowhere" / "valve.st") == ""


def test_a_picture_that_is_not_there_is_told_at_its_place(folder: Path) -> None:
    text = '[plc.a]\nsources = ["counter.st"]\n[[picture]]\nfile = "tank.svg"\n'
    found = errors(Plant(project(folder, text)).diagnostics)
    assert said(found) == [("P0103", 4, f"picture 1: there is no file {folder / 'tank.svg'}")]
    (folder / "tank.svg").write_text("<svg/>")
    assert errors(Plant(project(folder, text)).diagnostics) == []


@pytest.mark.slow
@pytest.mark.parametrize(("program", "unit", "said"), [
    ("PROGRAM Main VAR s : ETN_Modbus_Server; END_VAR s(); END_PROGRAM", "ETN21", "the library omron/etn_modbus"),
    ("PROGRAM Main VAR c : MTCP_ETN_Connect; END_VAR c(Connect := TRUE); END_PROGRAM", "ETN21", "the library omron/mtcp_etn"),
    ("PROGRAM Main VAR s : MSTR_Server; END_VAR s(); END_PROGRAM", "NOC", "the mailbox NOC"),
])  # fmt: skip
def test_a_program_without_the_unit_that_it_talks_to_is_told_of(folder: Path, program: str, unit: str, said: str) -> None:
    (folder / "talks.st").write_text(program, encoding="utf-8")
    text = "[plc.a]\nsources = ['talks.st']\n"
    (message,) = Plant(project(folder, text)).missing_units()
    assert message == (f"a has no unit of type {unit}, to which blocks of {said} talk: they reach nobody; "
                       "write [[plc.a.unit]] with its address")  # fmt: skip
    with_unit = text + f"[[plc.a.unit]]\ntype = '{unit}'\naddress = '10.0.0.1'\n" + "slot = 3\n" * (unit == "NOC")
    assert list(Plant(project(folder, with_unit)).missing_units()) == []


def test_a_program_that_talks_to_nobody_needs_no_unit(folder: Path) -> None:
    assert list(Plant(project(folder, ONE)).missing_units()) == []


# --- faults, doors and paths --------------------------------------------------------------------------------------------

ONE = "[plc.a]\nsources = ['counter.st']\n"


@pytest.mark.parametrize(("text", "messages"), [
    ("[[fault]]\nkind = 'slow'", [("P0104", 3, "fault 1.latency is missing: kind slow")]),
    ("[[fault]]\nkind = 'unsteady'", [("P0104", 3, "fault 1.jitter is missing: kind unsteady")]),
    ("[[fault]]\nkind = 'joined'", [("P0104", 3, "fault 1.join is missing: kind joined")]),
    ("[[fault]]\nkind = 'lossy'\n[[fault]]\nkind = 'interrupted'", [
        ("P0104", 3, "fault 1.lose_percent is missing: kind lossy"),
        ("P0104", 5, "fault 2.reset_after_bytes is missing: kind interrupted")]),
    ("[[fault]]\nkind = 'doubled'\nduplicate_percent = 101", [
        ("P0103", 5, "fault 1.duplicate_percent: 101 is no whole number from 1 to 100")]),
    ("[[fault]]\ngap = '5ms'", [("P0103", 4, "fault 1.gap does nothing without segment_bytes")]),
    ("[[fault]]\nrandom_cut = true", [("P0103", 4, "fault 1.random_cut does nothing without segment_bytes")]),
    ("[[fault]]\nsilent = true\nfrom = '2s'\nuntil = '1s'", [
        ("P0103", 3, "fault 1 ends before it begins: until is not after from")]),
    ("[[fault]]\nsilent = true\nfrom_scan = 5\nuntil_scan = 5", [
        ("P0103", 3, "fault 1 ends before it begins: until_scan is not after from_scan")]),
    ("[[fault]]\nerror = 'ECONREFUSED'", [
        ("P0103", 4, "fault 1.error: 'ECONREFUSED' is no errno name such as ECONNREFUSED or EHOSTUNREACH")]),
    ("[[door]]\naddress = '1.2.3.4:502'", [("P0104", 3, "door 1.bind is missing")]),
    ("[[door]]\naddress = '1.2.3.4:502'\nbind = '127.0.0.1:0'\nbacklog = 5", [
        ("P0103", 6, "door 1.backlog: 5 is neither true nor false")]),
    ("[[door]]\naddress = '1.2.3.4:502'\nbind = '127.0.0.1:0'\nhost = '127.0.0.1:0'", [
        ("P0103", 6, "door 1 has bind and host, which are the same")]),
    ("[[door]]\naddress = '1.2.3.4:502'\nbind = '127.0.0.1:0'\n[[door]]\naddress = '1.2.3.4:502'\nbind = '127.0.0.1:1'", [
        ("P0103", 6, "door 2 has the address of door 1")]),
    ("[[server]]\naddress = '1.2.3.4:502'\n[[server]]\naddress = '1.2.3.4:502'", [
        ("P0103", 5, "server 2 has the address of server 1")]),
])  # fmt: skip
def test_what_says_nothing_or_too_much_is_refused(folder: Path, text: str, messages: list[tuple[str, int, str]]) -> None:
    found = read(folder, ONE + text)
    assert isinstance(found, list)
    assert said(found) == messages


@each_of(("key", "least", "most"), [
    ("lose_percent", 1, 100), ("duplicate_percent", 1, 100), ("segment_bytes", 1, 65535), ("from_scan", 0, 1 << 62),
    ("until_scan", 1, 1 << 62), ("reset_after_bytes", 1, 1 << 62),
])  # fmt: skip
def test_numbers_of_a_fault_have_bounds(key: str, least: int, most: int) -> None:
    value = FAULT[key].kind.value  # type: ignore[union-attr]
    assert (value(least), value(most)) == (least, most)
    for wrong in (least - 1, most + 1):
        with pytest.raises(ValueError, match="no whole number"):
            value(wrong)


def test_faults_by_scan_and_by_kind(folder: Path) -> None:
    rows = "[[fault]]\nkind = 'slow'\nlatency = '5ms'\nfrom_scan = 3\nuntil_scan = 9\n[[fault]]\nlose_percent = 30"
    assert project(folder, ONE + rows).faults == (Fault(latency_ns=5 * MS, from_scan=3, until_scan=9), Fault(lose_percent=30))


DOORED = ONE + """
[[plc.a.unit]]
address = "1.2.3.4"
[[door]]
address = "1.2.3.4:502"
bind = "127.0.0.1:0"
[[fault]]
peer = "1.2.3.4:502"
"""


def test_doors_hold_callers_only_where_the_file_says_so(folder: Path) -> None:
    assert project(folder, DOORED).backlog == frozenset()
    assert project(folder, DOORED.replace("[[fault]]", "backlog = true\n[[fault]]")).backlog == {Peer("1.2.3.4", 502)}


def test_what_cannot_be_done_with_real_connections_is_refused(folder: Path) -> None:
    message = ("P0103", 9, "fault 1: callers of the door 1.2.3.4:502 cannot be given ENETUNREACH with real connections, "
               "only ECONNREFUSED, or silent = true")  # fmt: skip
    in_memory = project(folder, DOORED + "error = 'ENETUNREACH'")
    assert said(errors(Plant(in_memory, net="tcp").diagnostics)) == [message]
    Plant(in_memory).close()
    found = read(folder, "run = {net = 'tcp'}\n" + DOORED + "error = 'ENETUNREACH'")
    assert isinstance(found, list)
    assert said(found) == [(message[0], 10, message[2])]
    for good in ("error = 'ECONNREFUSED'", "kind = 'unreachable'", "kind = 'refused'"):
        assert project(folder, "run = {net = 'tcp'}\n" + DOORED + good)


def test_real_connections_have_the_faults_of_the_file(folder: Path) -> None:
    built = Plant(project(folder, "run = {net = 'tcp', seed = 4}\n" + DOORED + "silent = true"))
    assert built.network.faults == [Fault(Peer("1.2.3.4", 502), silent=True)]
    assert list(built.doors) == [Peer("1.2.3.4", 502)]
    built.close()


def test_paths_stay_inside_the_project(folder: Path) -> None:
    inside = folder / "project"
    (inside / "own").mkdir(parents=True)
    (inside / "link.st").symlink_to(folder / "counter.st")
    (inside / "here.st").write_text(COUNTER, encoding="utf-8")
    for written in ("../counter.st", str(folder / "counter.st"), "own/../../counter.st", "link.st", "/etc/passwd"):
        found = read(inside, f"[plc.a]\nsources = ['here.st', '{written}']\n")
        assert isinstance(found, list)
        assert said(found) == [("P0103", 2, f"plc.a.sources: {written} is outside of the project")]
        assert isinstance(read_project(inside / "fbvm.toml", allow_outside=True), Project)
    found = read(inside, "[plc.a]\nsources = ['here.st']\nlibraries = ['..']\n")
    assert isinstance(found, list)
    assert said(found) == [("P0103", 3, "plc.a.libraries: .. is outside of the project")]
    assert project(inside, f"[plc.a]\nsources = ['{inside / 'here.st'}', 'own/../here.st']\nlibraries = ['own']\n")


def test_a_bound_that_nobody_reaches_is_not_said() -> None:
    assert RUN["seed"].kind.called == "a whole number from 0"  # type: ignore[union-attr]
    assert PLC["count"].kind.called == "a whole number from 1 to 100000"  # type: ignore[union-attr]
