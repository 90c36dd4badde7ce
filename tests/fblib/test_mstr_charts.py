"""MBP_MSTR scan by scan: one column is the end of a scan of 10 ms, with a server that answers at once."""

from __future__ import annotations

import re

import noc_words
import pytest
from mstr_rig import SERVER_IP, Rig

from fbvm.base.data import data_folder
from fbvm.net.peers import Say, ScriptedPeer
from fbvm.record.draw.chart import chart

READ = (2, 0, 3, 1, 0x0700, *SERVER_IP)
WRITE = (1, 0, 3, 1, 0x0700, *SERVER_IP)
BOTH = (23, 0, 3, 1, 0x0700, *SERVER_IP, 3, 1)
REMOTE = (7, 0, 38, 0, 0x07FF, *SERVER_IP)
PINS = ("m1_ENABLE", "m1_ABORT", "m1.ACTIVE", "m1.SUCCESS", "m1.ERROR", "m1_CONTROL[2]")


def begun(rig: Rig, control: tuple[int, ...] = READ) -> Rig:
    """The rig with ENABLE TRUE and something in CONTROL[2] that is not the result."""
    rig.control(control[0], 0xAAAA, *control[2:])
    rig.set("m1_ENABLE", True)
    return rig


@pytest.mark.slow
@pytest.mark.parametrize("control", [READ, WRITE, BOTH])
def test_as_long_as_enable_is_true_an_operation_follows_the_other_assumed(control: tuple[int, ...]) -> None:
    """The first connects, which takes a scan more.  SUCCESS is TRUE for one scan."""
    rig = begun(Rig(), control)
    assert rig.chart(11, *PINS) == """
        Main.m1_ENABLE      ###########
        Main.m1_ABORT       ...........
        Main.m1.ACTIVE      ###.##.##.#
        Main.m1.SUCCESS     ...#..#..#.
        Main.m1.ERROR       ...........
        Main.m1_CONTROL[2]  0
    """
    rig.set("m1_ENABLE", False)
    assert rig.chart(3, *PINS[:4]) == """
        Main.m1_ENABLE   ...
        Main.m1_ABORT    ...
        Main.m1.ACTIVE   ...
        Main.m1.SUCCESS  ...
    """


def test_remote_statistics_of_a_server_that_does_not_know_them() -> None:
    assert begun(Rig(), REMOTE).chart(7, *PINS[2:]) == """
        Main.m1.ACTIVE      ###.##.
        Main.m1.SUCCESS     .......
        Main.m1.ERROR       ...#..#
        Main.m1_CONTROL[2]  0  ||0|12289   = 0, 12289, 0, 12289
    """


@pytest.mark.slow
def test_edge_and_hold_are_switches() -> None:
    assert begun(Rig(options="Edge := TRUE")).chart(8, *PINS[2:5]) == """
        Main.m1.ACTIVE   ###.....
        Main.m1.SUCCESS  ...#....
        Main.m1.ERROR    ........
    """
    rig = begun(Rig(options="Edge := TRUE, Hold := TRUE"))
    assert rig.chart(8, *PINS[2:5]) == """
        Main.m1.ACTIVE   ###.....
        Main.m1.SUCCESS  ...#####
        Main.m1.ERROR    ........
    """
    rig.set("m1_ENABLE", False)
    assert rig.chart(2, *PINS[2:5]) == """
        Main.m1.ACTIVE   ..
        Main.m1.SUCCESS  ..
        Main.m1.ERROR    ..
    """
    rig.set("m1_ENABLE", True)
    assert rig.chart(5, *PINS[2:5]) == """
        Main.m1.ACTIVE   ##...
        Main.m1.SUCCESS  ..###
        Main.m1.ERROR    .....
    """
    assert begun(Rig(options="Hold := TRUE")).chart(8, *PINS[2:5]) == """
        Main.m1.ACTIVE   ###.##.#
        Main.m1.SUCCESS  ...#..#.
        Main.m1.ERROR    ........
    """


@pytest.mark.slow
def test_held_errors() -> None:
    rig = begun(Rig(options="Edge := TRUE, Hold := TRUE"), (2, 0, 0, 1, 0x0700))
    assert rig.chart(3, *PINS[2:]) == """
        Main.m1.ACTIVE      ...
        Main.m1.SUCCESS     ...
        Main.m1.ERROR       ###
        Main.m1_CONTROL[2]  8195
    """


@pytest.mark.slow
def test_an_operation_of_the_module_itself_ends_in_its_scan() -> None:
    """By level it is done again in every scan."""
    assert begun(Rig(), (3, 0, 38, 0, 0x0700)).chart(4, *PINS[2:]) == """
        Main.m1.ACTIVE      ....
        Main.m1.SUCCESS     ####
        Main.m1.ERROR       ....
        Main.m1_CONTROL[2]  0
    """
    assert begun(Rig(options="Edge := TRUE"), (4, 0, 0, 0, 0x0700)).chart(4, *PINS[2:5]) == """
        Main.m1.ACTIVE   ....
        Main.m1.SUCCESS  #...
        Main.m1.ERROR    ....
    """
    assert begun(Rig(), (0xFFF0, 0, 1, 1, 0x0700)).chart(4, *PINS[2:]) == """
        Main.m1.ACTIVE      ....
        Main.m1.SUCCESS     #...
        Main.m1.ERROR       .###
        Main.m1_CONTROL[2]  0|20584
    """


def test_what_is_wrong_is_said_in_the_same_scan() -> None:
    assert begun(Rig(), (99, 0, 0, 0, 0x0700)).chart(3, *PINS[2:]) == """
        Main.m1.ACTIVE      ...
        Main.m1.SUCCESS     ...
        Main.m1.ERROR       ###
        Main.m1_CONTROL[2]  8193
    """


def test_abort() -> None:
    rig = begun(Rig(ScriptedPeer([])))
    rig.scan(3)
    rig.set("m1_ABORT", True)
    assert rig.chart(3, *PINS[1:]) == """
        Main.m1_ABORT       ###
        Main.m1.ACTIVE      ...
        Main.m1.SUCCESS     ...
        Main.m1.ERROR       ###
        Main.m1_CONTROL[2]  4097
    """


def test_enable_that_falls_early_assumed() -> None:
    """Nothing is reported, CONTROL[2] stays at 0, and the reply that still comes is nobody's."""
    rig = begun(Rig(ScriptedPeer([Say(bytes.fromhex("0001 0000 0009 00 03 06 0001 0002 0003"), 50_000_000)])))
    rig.scan(3)
    rig.set("m1_ENABLE", False)
    assert rig.chart(10, *PINS) == """
        Main.m1_ENABLE      ..........
        Main.m1_ABORT       ..........
        Main.m1.ACTIVE      ..........
        Main.m1.SUCCESS     ..........
        Main.m1.ERROR       ..........
        Main.m1_CONTROL[2]  0
    """
    assert rig.databuf(3) == [0, 0, 0]


def test_the_result_stays_while_enable_is_false() -> None:
    rig = begun(Rig(refused=True))
    rig.scan(3)
    assert rig.status() == "503D"
    rig.set("m1_ENABLE", False)
    rig.scan(5)
    assert (rig.status(), rig.outputs()) == ("503D", "")


@pytest.mark.slow
def test_a_block_that_is_not_executed_keeps_its_outputs() -> None:
    text = """
    PROGRAM Main
    VAR m1 : MBP_MSTR; go : BOOL := TRUE; c : ARRAY[1..9] OF INT := [2, 0, 1, 1, 16#0700, 192, 168, 250, 2];
        d : ARRAY[1..9] OF INT; END_VAR
        m1(EN := go, ENABLE := TRUE, ABORT := FALSE, CONTROL := c, DATABUF := d);
    END_PROGRAM
    """
    rig = Rig(text=text)
    rig.scan()
    rig.set("go", False)
    rig.scan(10)
    assert (rig.get("m1.ACTIVE"), rig.get("m1.SUCCESS"), rig.get("c[2]")) == (True, False, 0)
    rig.set("go", True)
    rig.scan()
    assert rig.outputs() == "S", "the reply has come meanwhile"


# --- several blocks -----------------------------------------------------------------------------------------------------


def many(count: int, options: str = "", control: tuple[int, ...] = READ) -> Rig:
    rig = Rig(blocks=count, options=options)
    for number in range(1, count + 1):
        rig.control(*control[:3], 10 * number, *control[4:], block=number)
        rig.set(f"m{number}_ENABLE", True)
    return rig


@pytest.mark.slow
def test_sixteen_blocks_at_once() -> None:
    rig = many(17)
    for number in range(1, 18):
        rig.server.holding_registers[10 * number - 1] = number
    rig.scan()
    assert [rig.outputs(number) for number in range(1, 18)] == 16 * ["A"] + [""]
    rig.scan(3)
    assert [rig.outputs(number) for number in range(1, 18)] == 16 * ["S"] + ["A"]
    rig.scan(2)
    assert rig.outputs(17) == "S"
    assert [rig.databuf(1, number)[0] for number in range(1, 18)] == list(range(1, 18))


@pytest.mark.slow
def test_four_paths_as_in_older_modules() -> None:
    """The fifth shows nothing until a path is free, here in the scan in which the first ones end."""
    rig = many(5, "Max_Paths := 4")
    pins = [f"m{number}.{pin}" for number in (4, 5) for pin in ("ACTIVE", "SUCCESS", "ERROR")]
    assert rig.chart(7, *pins) == """
        Main.m4.ACTIVE   ###...#
        Main.m4.SUCCESS  ...#...
        Main.m4.ERROR    .......
        Main.m5.ACTIVE   ...##.#
        Main.m5.SUCCESS  .....#.
        Main.m5.ERROR    .......
    """


@pytest.mark.slow
@pytest.mark.parametrize(("operation", "waits"), [(1, True), (2, True), (8, True), (23, True), (3, False), (4, False),
                                                  (7, False), (10, False), (0xFFF0, False)])  # fmt: skip
def test_which_operations_need_a_path(operation: int, waits: bool) -> None:
    rig = Rig(ScriptedPeer([]), blocks=2, options="Max_Paths := 1")
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.control(operation, 0, 1, 1, 0x07FF, *(SERVER_IP if operation != 0xFFF0 else (0, 0, 0, 0)), 1, 1, block=2)
    rig.set("m2_ENABLE", True)
    rig.scan()
    assert rig.outputs(1) == "A"
    assert (rig.outputs(2) == "") == waits


@pytest.mark.slow
@pytest.mark.parametrize("scans", [1, 2, 4])
def test_a_block_whose_enable_falls_gives_its_path_back(scans: int) -> None:
    rig = Rig(ScriptedPeer([]), blocks=2, options="Max_Paths := 1")
    for block in (1, 2):
        rig.control(*READ, block=block)
    rig.set("m1_ENABLE", True)
    rig.scan(scans)
    rig.set("m2_ENABLE", True)
    rig.scan()
    assert (rig.outputs(1), rig.outputs(2)) == ("A", "")
    rig.set("m1_ENABLE", False)
    rig.scan()
    assert (rig.outputs(1), rig.outputs(2)) == ("", "A")


@pytest.mark.slow
def test_a_waiting_block_may_be_aborted_or_give_up() -> None:
    rig = many(2, "Max_Paths := 0")
    rig.scan(3)
    assert rig.outputs(1) == rig.outputs(2) == ""
    rig.set("m1_ABORT", True)
    rig.set("m2_ENABLE", False)
    rig.scan()
    assert (rig.outputs(1), rig.status(1), rig.outputs(2)) == ("E", "1001", "")


@pytest.mark.slow
def test_a_module_that_restarts_gives_all_paths_back() -> None:
    rig = many(17)
    rig.scan(2)
    rig.plc.write(f"NOC{7 * noc_words.HEAD_WORDS + noc_words.RESTART}", 1)
    rig.scan(2)
    assert {rig.outputs(number) for number in range(1, 18)} == {"E"}
    rig.scan(12)
    assert sum(rig.outputs(number) != "" for number in range(1, 18)) >= 16


# --- the README ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_program_and_the_charts_of_the_readme() -> None:
    readme = (data_folder("fblib") / "schneider" / "mbp_mstr" / "README.md").read_text(encoding="utf-8")
    text = re.findall(r"```\n(PROGRAM.*?)```", readme, re.S)[0]
    good, refused = re.findall(r"```\n(Main\..*?)```", readme, re.S)
    rig = Rig(text=text)
    rig.server.holding_registers[2] = 4711
    rig.scan(5)
    assert (rig.plc.read("%MW110..%MW113"), rig.get("go")) == ([0, 0, 4711, 0], False)
    again = text.replace("go := FALSE;", ";")
    names = [f"Main.{name}" for name in ("mstr.ACTIVE", "mstr.SUCCESS", "mstr.ERROR", "CONTROL[2]")]
    assert chart(Rig(text=again).plc, 10, names) == good
    assert chart(Rig(text=again, refused=True).plc, 10, names) == refused
