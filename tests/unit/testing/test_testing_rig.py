"""The test rig: values by name, time, forces, stubs, and what it says when something is wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fbvm.net.peers import ModbusPeer
from fbvm.testing import Rig, Trapped, ns
from fbvm.testing.report import LOOKED_BACK
from fbvm.testing.subject import SubjectError, subject
from fbvm.watch.paths import UnknownPlace
from fbvm.wire.link import Peer

PUMP = """
TYPE Limits : STRUCT Low, High : INT; END_STRUCT END_TYPE
FUNCTION_BLOCK Pump
VAR_INPUT Start : BOOL; Wait : TIME := T#50ms; END_VAR
VAR_OUTPUT Running : BOOL; Starts : INT; END_VAR
VAR Delay : TON; Edge : R_TRIG; Range : Limits; Table : ARRAY[1..3] OF INT; run : BOOL; END_VAR
VAR RETAIN Total : INT; END_VAR
    Delay(IN := Start, PT := Wait);
    Running := Delay.Q;
    Edge(CLK := Running);
    IF Edge.Q THEN
        Starts := Starts + 1;
        Total := Total + 1;
    END_IF
END_FUNCTION_BLOCK
"""


def rig(name: str = "Pump", text: str = PUMP, cycle: str = "10ms", **given: Any) -> Rig:
    stubs = given.get("stubs")
    return Rig(subject([], name, [], stubs, text), cycle, **given)


# --- values -----------------------------------------------------------------------------------------------------------


def test_inputs_outputs_and_inner_variables_have_names() -> None:
    pump = rig()
    pump.Start = True
    pump["Range.High"] = 7
    pump.Range.Low = -1
    pump["Table[2]"] = 5
    pump.scan()
    assert (pump.start, pump.Delay.IN, pump["Delay.ET"], pump.Table) == (True, True, 0, [0, 5, 0])
    assert pump.Range == {"Low": -1, "High": 7}
    assert "Limits" in repr(pump.Range)


def test_text_is_read_for_the_type_of_the_variable() -> None:
    pump = rig().write(Wait="1.5s", Start="TRUE")
    assert (pump.Wait, pump.Start) == (ns("1.5s"), True)


BATCH = """
TYPE Phase : (Idle, Filling := 3, Mixing); Row : STRUCT Phase : Phase; Time : TIME; END_STRUCT END_TYPE
FUNCTION_BLOCK Batch
VAR_INPUT MixTime : TIME; Long : LTIME; Day : DATE; Hour : TOD; When : DT; Times : ARRAY[1..2] OF TIME; In_Row : Row; END_VAR
VAR_OUTPUT State : Phase; Rows : ARRAY[1..2] OF Row; Colour : (Red, Green); END_VAR
    State := Filling; Rows[2].Phase := Mixing;
END_FUNCTION_BLOCK
"""


def test_an_enumeration_reads_as_its_member() -> None:
    batch = rig("Batch", BATCH).scan()
    assert batch.State == 3 and batch.State == "Filling" and batch.State == "phase#FILLING" and batch.State == "Phase.filling"
    assert batch.State != 0 and batch.State != "Mixing" and batch.State != "Row#Filling" and batch.State in ("Idle", "Filling")
    assert (repr(batch.State), str(batch.State), f"{batch.State:02d}") == ("Phase#Filling (3)", "Phase#Filling", "03")
    assert {3: "three"}[batch.State] == "three" and batch.State + 1 == 4 and isinstance(batch.State, int)
    assert batch.Rows[1]["Phase"] == "Mixing" and batch.Colour == "Red"
    assert repr(batch["Rows[2]"]) == "Row {'Phase': Phase#Mixing (4), 'Time': T#0s}"
    with pytest.raises(AssertionError, match=re.escape("Phase#Filling (3) is no Mixing")):
        assert batch.State == "Mixing", f"{batch.State!r} is no Mixing"
    batch.State = batch.Rows[1]["Phase"]
    assert batch.State == "Mixing"
    batch.plc.memory.u8[batch.find("State").offset] = 9
    assert batch.State == 9, "no member"


@pytest.mark.slow
@pytest.mark.parametrize("give", [
    lambda batch, name, value: batch.scan({name: value}), lambda batch, name, value: batch.write(**{name: value}),
    lambda batch, name, value: batch.run(scans=1, **{name: value}), lambda batch, name, value: setattr(batch, name, value),
    lambda batch, name, value: batch.until(lambda rig: True, **{name: value}),
    lambda batch, name, value: batch.force({name: value}), lambda batch, name, value: batch.__setitem__(name, value),
    lambda batch, name, value: batch.at("1s", {name: value}),
], ids=["scan", "write", "run", "attribute", "until", "force", "item", "at"])  # fmt: skip
def test_a_bare_number_is_no_time(give: Callable[[Rig, str, object], object]) -> None:
    """As `--set Main.MixTime=2` is refused: it may be meant as seconds."""
    batch = rig("Batch", BATCH)
    for name, kind, takes in (("MixTime", "TIME", "a time such as 10ms"), ("Long", "LTIME", "a time such as 10ms"),
                              ("Day", "DATE", "a date such as D#2024-01-31"),
                              ("Hour", "TIME_OF_DAY", "a time of day such as TOD#12:30:00"),
                              ("When", "DATE_AND_TIME", "a date and time such as DT#2024-01-31-12:30:00")):  # fmt: skip
        with pytest.raises(TypeError, match=re.escape(f"{name} is {kind} and takes {takes}, not 2")):
            give(batch, name, 2)
    with pytest.raises(TypeError, match=re.escape("Times[1] is TIME and takes a time such as 10ms, not 2")):
        give(batch, "Times", ["1s", 2])
    with pytest.raises(TypeError, match=re.escape("In_Row.Time is TIME and takes a time such as 10ms, not 2")):
        give(batch, "In_Row", {"time": 2})
    assert (batch.MixTime, batch.Times) == (0, [0, 0])


def test_times_are_written_as_text_as_ns_and_as_they_were_read() -> None:
    batch = rig("Batch", BATCH).scan(MixTime=2 * ns("1s"), Times=["1s", ns("5ms")], In_Row={"Time": "3s", "Phase": "Mixing"},
                                     When="DT#2024-01-31-12:30:00", Day="2024-01-31")  # fmt: skip
    assert (batch.MixTime, batch.Times, batch.In_Row) == (2_000_000_000, [ns("1s"), ns("5ms")], {"Time": ns("3s"), "Phase": 4})
    batch.Long = batch.MixTime - ns("5ms")
    assert (repr(batch.Long), repr(batch.When), repr(batch.Day)) == ("T#1s995ms", "DT#2024-01-31-12:30:00", "D#2024-01-31")
    batch.When = batch.When + ns("1d")
    assert repr(batch.When) == "DT#2024-02-01-12:30:00" and repr(batch.When - ns("1s")) == "DT#2024-02-01-12:29:59"
    batch.scan(MixTime=batch.When - batch.When)
    assert batch.MixTime == 0 and repr(batch.Times) == "[T#1s, T#5ms]"


def test_a_plc_takes_literals_of_times_as_its_messages_say() -> None:
    batch = rig("Batch", BATCH)
    batch.plc.write("Test.Block.MixTime", "10ms")
    with pytest.raises(TypeError, match="takes a time such as 10ms, not 5"):
        batch.plc.write("Test.Block.MixTime", "5")
    assert batch.MixTime == ns("10ms")


def test_addresses_are_names_too() -> None:
    pump = rig().scan({"D200": 5, "CIO 0.03": True})
    assert (pump["D200"], pump["CIO 0"]) == (5, 8)
    pump["D300..D302"] = [1, 2, 3]
    assert pump["D300..D302"] == [1, 2, 3]


def test_a_wrong_name_says_what_there_is() -> None:
    pump = rig()
    with pytest.raises(AttributeError, match="has no Strat; it has Start"):
        _ = pump.Strat
    with pytest.raises(AttributeError, match="Lo"):
        pump.Range.Lo = 5
    with pytest.raises(UnknownPlace, match="Strat"):
        pump.at("1s", Strat=True)


def test_a_value_that_does_not_fit_is_refused() -> None:
    pump = rig()
    with pytest.raises(ValueError, match="out of range"):
        pump["Starts"] = 40_000
    with pytest.raises(TypeError, match="Start"):
        pump.scan(Start=5.5)


def test_a_variable_called_like_a_word_of_the_rig_is_an_item() -> None:
    pump = rig()
    pump["run"] = True
    assert pump["run"] is True
    with pytest.raises(TypeError, match=r"write rig\['run'\]"):
        assert pump.run
    with pytest.raises(TypeError, match=r"write rig\['run'\]"):
        assert pump.run == True  # noqa: E712
    assert pump.run(scans=2).scans == 2


def test_in_outs_are_variables_of_the_test() -> None:
    text = "FUNCTION_BLOCK Add VAR_IN_OUT Sum : DINT; END_VAR VAR_INPUT x : DINT; END_VAR Sum := Sum + x; END_FUNCTION_BLOCK"
    add = rig("Add", text)
    add.Sum = 100
    assert add.scan(x=5).Sum == 105


def test_a_function_has_its_result() -> None:
    text = """FUNCTION Halve : INT VAR_INPUT x : INT; END_VAR VAR_OUTPUT Odd : BOOL; END_VAR
        Halve := x / 2; Odd := x MOD 2 <> 0; END_FUNCTION"""
    halve = rig("Halve", text).scan(x=7)
    assert (halve.Result, halve.Odd) == (3, True)


def test_a_program_is_a_subject() -> None:
    main = rig("Main", "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").run(scans=3)
    assert (main.n, main["Main.n"]) == (3, 3)


def test_a_block_of_a_library_needs_no_file() -> None:
    assert rig("CTU", "").scan(CU=True, PV=1).Q is True


# --- time -------------------------------------------------------------------------------------------------------------


def test_until_ends_with_the_scan_in_which_the_condition_holds() -> None:
    pump = rig().until("Running", max="1s", Start=True)
    assert pump.elapsed_ns == ns("60ms")
    pump.until(lambda pump: not pump.Running, Start=False)
    assert pump.scans == 7


def test_until_gives_up() -> None:
    with pytest.raises(AssertionError, match="Running does not hold within 100ms"):
        rig().until("Running", max="100ms")


def test_at_writes_later() -> None:
    pump = rig().at("100ms", Start=False).at("30ms", Start=True)
    assert pump.chart("Start", "Running", scans=12) == """
        Start    ...#######..
        Running  ........##..
    """


def test_a_chart_of_the_block_and_of_addresses() -> None:
    assert rig().write(Start=True).chart("Start", "D200", "Running", scans=7) == """
        Start    #######
        D200     0
        Running  .....##
    """


def test_run_takes_a_time_or_scans() -> None:
    pump = rig(cycle="4ms").run("1s")
    assert (pump.elapsed_ns, pump.scans) == (ns("1s"), 250)
    with pytest.raises(TypeError, match="say how long"):
        pump.run()
    with pytest.raises(TypeError, match="say how long"):
        pump.run("1s", scans=5)


def test_a_cycle_is_a_time_or_nanoseconds() -> None:
    assert Rig(subject([], "TON"), 1_000_000).scan().elapsed_ns == 1_000_000


def test_power_on_keeps_what_is_retained() -> None:
    pump = rig().until("Running", Start=True)
    pump.power_on()
    assert (pump.Total, pump.Starts, pump.Running) == (1, 0, False)
    pump.cold_start()
    assert pump.Total == 0


def test_in_program_mode_the_program_stands() -> None:
    pump = rig().mode("PROGRAM").run("1s", Start=True)
    assert not pump.Running
    assert pump.mode("RUN").run("60ms", Start=True).Running


def test_a_trap_is_raised_with_its_place() -> None:
    bad = rig("Bad", "FUNCTION_BLOCK Bad\nVAR_INPUT x : INT; END_VAR\nx := 5 / x;\nEND_FUNCTION_BLOCK")
    bad.scan(x=1)
    with pytest.raises(Trapped, match="5 divided by 0") as caught:
        bad.scan(x=0)
    assert (caught.value.trap.code, caught.value.trap.site.line) == ("R0101", 3)


# --- forces -----------------------------------------------------------------------------------------------------------


def test_a_force_holds_until_it_is_ended() -> None:
    pump = rig()
    pump.force({"Delay.Q": True})
    assert pump.scan()["Delay.Q"]
    pump.unforce("Delay.Q")
    assert not pump.scan()["Delay.Q"]
    assert not pump.plc.forces


def test_a_force_ends_with_its_block() -> None:
    pump = rig()
    with pump.force(Start=True, Wait="0s"):
        assert pump.scan(Start=False).Start
    assert not pump.plc.forces


# --- stubs ------------------------------------------------------------------------------------------------------------


def test_python_takes_the_place_of_a_block() -> None:
    asked = []

    def ton(timer: Any) -> None:
        asked.append(timer.PT)
        timer.Q = timer.IN

    pump = rig(stubs={"TON": ton}).scan(Start=True)
    assert pump.Running
    assert asked == [ns("50ms")]


def test_st_takes_the_place_of_a_body() -> None:
    assert rig(stubs={"TON": "Q := IN;"}).scan(Start=True).Running


def test_st_takes_the_place_of_a_block() -> None:
    text = "FUNCTION_BLOCK TON VAR_INPUT IN : BOOL; PT : TIME; END_VAR VAR_OUTPUT Q : BOOL := TRUE; ET : TIME; END_VAR"
    assert rig(stubs={"ton": text + " END_FUNCTION_BLOCK"}).scan().Running


def test_a_stub_in_the_same_file_leaves_the_lines_of_others() -> None:
    text = """FUNCTION_BLOCK One
VAR_OUTPUT Q : INT; END_VAR
    Q := 1;
END_FUNCTION_BLOCK
FUNCTION_BLOCK Two
VAR a : One; b : INT; END_VAR
    a();
    b := 5 / (a.Q - 2);
END_FUNCTION_BLOCK"""
    with pytest.raises(Trapped) as caught:
        rig("Two", text, stubs={"One": "Q := 2;"}).scan()
    assert caught.value.trap.site.line == 8


def test_only_blocks_have_python_in_their_place() -> None:
    with pytest.raises(ValueError, match="Nobody is no function block"):
        rig(stubs={"Nobody": print})


# --- subjects ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_without_a_name_the_only_pou_is_meant(tmp_path: Path) -> None:
    file = tmp_path / "pump.st"
    file.write_text(PUMP, encoding="utf-8")
    assert subject([file], "").name == "Pump"
    file.write_text(PUMP + PUMP.replace("Pump", "Fan").replace("Limits", "Edges"), encoding="utf-8")
    assert subject([file], "").name == "Pump"
    other = tmp_path / "both.st"
    other.write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(SubjectError, match=r"both.st::NAME; there is Pump, Fan"):
        subject([other], "")


@pytest.mark.slow
def test_what_cannot_be_compiled_says_why(tmp_path: Path) -> None:
    with pytest.raises(SubjectError, match="there is no Fan; there is Pump"):
        rig("Fan")
    with pytest.raises(SubjectError, match="there is no Fan in any library"):
        subject([], "Fan")
    with pytest.raises(SubjectError, match="error S0201"):
        rig("Bad", "FUNCTION_BLOCK Bad x := 1; END_FUNCTION_BLOCK")
    with pytest.raises(SubjectError, match="error S01"):
        rig("Bad", "FUNCTION_BLOCK Bad IF END_FUNCTION_BLOCK")
    with pytest.raises(SubjectError, match="S0107"):
        subject([tmp_path / "none.st"], "")


# --- units and networks -----------------------------------------------------------------------------------------------


def test_an_ethernet_unit_is_on_the_backplane(tmp_path: Path) -> None:
    master = Rig(subject([], "MTCP_ETN_Connect"), "10ms", etn21="192.168.250.21")
    master.network.place(Peer("192.168.250.1", 502), ModbusPeer())
    master.write(EN=True, Connect=True, IP_Address1=192, IP_Address2=168, IP_Address3=250, IP_Address4=1)
    master.until("ENO AND NOT Waiting_Server", max="5s")
    assert not master.Error
    assert "CIO1519.05" in master.chart("CIO 1519.05", scans=2)


# --- what it says -----------------------------------------------------------------------------------------------------


def test_who_wrote_a_variable_and_why() -> None:
    pump = rig().run("100ms", Start=True)
    assert pump.Running
    said = pump.explain()
    assert "Running is TRUE since scan 5 (50ms), written last in scan 9, by test.st:9:  Running := Delay.Q;" in said
    assert "with Delay.Q = TRUE" in said
    assert "scan 5   50ms   Running\n  inputs        FALSE\n  test.st:9    >TRUE\nscan 9" in said


def test_what_never_changed_is_said_with_its_writer() -> None:
    pump = rig().run("30ms", Start=True)
    assert not pump.Running
    assert "Running is FALSE since power-on, written last in scan 2, by test.st:9" in pump.explain()


def test_what_nobody_wrote_is_said() -> None:
    pump = rig().run("30ms")
    assert pump["Range.Low"] == 0
    assert "Range.Low is 0 since power-on; no statement wrote it" in pump.explain()


@pytest.mark.slow
def test_what_was_written_before_the_kept_scans_is_not_said_to_be_written_by_nobody() -> None:
    once = rig("Once", "PROGRAM Once VAR Started : BOOL; END_VAR IF NOT Started THEN Started := TRUE; END_IF END_PROGRAM")
    once.run(scans=LOOKED_BACK + 50)
    assert once.Started
    assert "Started is TRUE since before scan 50; writes are known from scan 50 on" in once.explain()


def test_an_input_came_from_outside() -> None:
    pump = rig().scan().scan(Start=True)
    assert pump.Start
    assert "Start is TRUE since scan 1 (10ms), written from outside the program" in pump.explain()
    pump.Start = False
    assert not pump.Start
    assert "Start is FALSE, written after the last scan" in pump.explain()


def test_pins_are_told_of_the_blocks_that_were_read_and_of_nothing_else() -> None:
    """Not of the block under test, nor of what a global variable or an address belongs to."""
    block = rig("Gate", "VAR_GLOBAL Open : BOOL := TRUE; END_VAR\nFUNCTION_BLOCK Gate VAR_INPUT Go : BOOL; END_VAR "
                "VAR_OUTPUT Q : BOOL; END_VAR VAR Edge : R_TRIG; END_VAR\nEdge(CLK := Go);\n"
                "Q := Go AND Open AND NOT %IX7.0 OR Edge.Q;\nEND_FUNCTION_BLOCK\n")  # fmt: skip
    block.scan(Go=True)
    assert block.Q
    told = [line for line in block.explain().splitlines() if ": " in line and " with " in line and "test.st" not in line]
    assert told == ["Edge: R_TRIG with CLK = TRUE, Q = TRUE"]


def test_stubs_are_not_called_again() -> None:
    calls = []

    def ton(timer: Any) -> None:
        calls.append(timer.IN)
        timer.Q = len(calls) > 3

    pump = rig(stubs={"TON": ton}).run(scans=5)
    assert pump.Running
    said = pump.explain()
    assert "Running is TRUE since scan 3 (30ms)" in said
    assert len(calls) == 5


def test_what_a_stub_or_a_force_has_changed_is_told() -> None:
    def ton(timer: Any) -> None:
        timer.Q = timer.IN

    pump = rig(stubs={"TON": ton}).scan().scan(Start=True).scan()
    assert pump["Delay.Q"]
    assert "Delay.Q is TRUE since scan 1 (10ms), by a stub\n" in pump.explain()
    forced = rig().scan(Start=True)
    with forced.force({"Delay.IN": False}):
        forced.scan()
        assert not forced["Delay.IN"]
        assert "Delay.IN is FALSE since scan 1 (10ms), written from outside the program\n" in forced.explain()


def test_a_table_of_the_last_scans() -> None:
    pump = rig().run("60ms", Start=True)
    assert pump.table("Running", "Starts", scans=1) == """\
scan 5   50ms   Running   Starts
  inputs        FALSE     0
  test.st:9    >TRUE
  test.st:12             >1"""


def test_nothing_asked_nothing_said() -> None:
    assert rig().scan().explain() == ""


CALLER = """
PROGRAM Main
VAR c : MTCP_ETN_Connect; Wanted : BOOL; END_VAR
    c(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := Wanted);
END_PROGRAM
"""


@pytest.mark.slow
def test_what_a_unit_changed_is_told_apart_from_what_the_test_wrote() -> None:
    caller = rig("Main", CALLER, etn21="192.168.250.21")
    caller.network.place(Peer("192.168.250.1", 502), ModbusPeer())
    caller.run(scans=3).run(scans=6, Wanted=True)
    assert caller["D30009"] == 4 and caller.Wanted
    said = caller.explain()
    assert "Wanted is TRUE since scan 3 (30ms), written from outside the program" in said
    assert re.search(r"D30009 is 4 since scan \d \(\d0ms\), by a unit in the I/O refresh", said)
    assert "  I/O refresh" in said


@pytest.mark.parametrize("kind", ["ARRAY [*] OF BYTE", "ARRAY[ *, *] OF INT", "ANY", "ANY_INT"])
def test_in_outs_of_many_types_have_no_rig(kind: str) -> None:
    text = f"FUNCTION_BLOCK Sum VAR_IN_OUT Data : {kind}; END_VAR END_FUNCTION_BLOCK"
    with pytest.raises(SubjectError, match=re.escape(f"Sum takes what has no type of its own, Data : {kind}: test a PROGRAM")):
        rig("Sum", text)
