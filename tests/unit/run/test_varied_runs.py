"""What a run of a campaign does to each PLC that a test makes: values, cycles, timings, phases, faults, power cuts."""

from __future__ import annotations

from functools import cache

import pytest
from images import counter_image
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.run.varied import Conditions, PowerCut, VariedPlc, VariedRun, Written

MS = 1_000_000
TEXT = """PROGRAM Main
VAR n, m, late : INT; END_VAR
VAR RETAIN kept : INT; END_VAR
    n := n + 1;
    kept := kept + 1;
END_PROGRAM
"""


@cache
def image() -> Image:
    made = compile_text(TEXT).image
    assert made is not None
    return made


def plc() -> Plc:
    return Plc(image())


def made(given: Conditions, name: str = "", run: VariedRun | None = None) -> VariedPlc:
    own = plc()
    return (run or VariedRun(given)).made(name, own, own.find, None)


def scan(found: VariedPlc, count: int) -> None:
    for _ in range(count):
        found.before_scan()
        found.plc.scan()
        found.after_scan()


def test_values_are_written_before_the_first_scan_at_or_behind_their_times() -> None:
    found = made(Conditions(written=(Written("Main.m", 7), Written("Main.late", 5, 15 * MS), Written("Main.n", 100, 20 * MS))))
    assert found.plc.read("Main.m") == 7 and found.plc.read("Main.late") == 0, "what belongs to the beginning is there at once"
    seen = []
    for _ in range(4):
        scan(found, 1)
        seen.append((found.plc.now_ns // MS, found.plc.read("Main.late"), found.plc.read("Main.n")))
    assert seen == [(0, 0, 1), (10, 0, 2), (20, 5, 101), (30, 5, 102)]
    found.plc.write("Main.late", 1)
    scan(found, 3)
    assert found.plc.read("Main.late") == 1, "once"


@each_of("name, rows, values, used", [
    ("", (Written("Main.m", 1), Written("Nobody.m", 2)), 1, {"Main.m"}), ("tank", (Written("Main.m", 1),), 0, set()),
    ("tank", (Written("tank.Main.m", 1), Written("pump.Main.m", 2)), 1, {"tank.Main.m"}),
    ("tank[2]", (Written("tank.Main.m", 1),), 1, {"tank.Main.m"}),
    ("tank[2]", (Written("tank[2].Main.m", 3),), 3, {"tank[2].Main.m"}),
    ("tank[2]", (Written("tank[1].Main.m", 3),), 0, set()), ("tank", (Written("tank.Main.nobody", 1),), 0, set()),
])
def test_which_plc_a_value_is_for(name: str, rows: tuple[Written, ...], values: int, used: set[str]) -> None:
    run = VariedRun(Conditions(written=rows))
    found = made(run.conditions, name, run)
    assert (found.plc.read("Main.m"), run.used) == (values, used)


def test_what_does_not_fit_its_place_is_refused() -> None:
    with pytest.raises((TypeError, ValueError), match="INT"):
        made(Conditions(written=(Written("Main.m", 99_999),)))


@each_of("cold, kept", [(False, 5), (True, 2)])
def test_a_power_cut_begins_the_plc_anew_and_lets_it_stand_for_its_time(cold: bool, kept: int) -> None:
    cuts = (PowerCut("", 90 * MS, 50 * MS), PowerCut("", 25 * MS, 30 * MS, cold))
    found = made(Conditions(written=(Written("Main.m", 7),), cuts=cuts))
    scan(found, 3)
    found.plc.write("Main.m", 1)
    assert found.elapsed_ns == 30 * MS
    found.before_scan()
    assert (found.plc.read("Main.m"), found.elapsed_ns) == (7, 55 * MS), "parameters of the beginning are there again"
    scan(found, 1)
    assert found.plc.read("Main.n") == 1
    scan(found, 1)
    assert (found.plc.read("Main.n"), found.plc.read("Main.kept")) == (2, kept) and len(found.cuts) == 1


def test_a_cut_is_that_of_its_plc_or_of_the_first_one() -> None:
    run = VariedRun(Conditions(cuts=(PowerCut("", 0, 1), PowerCut("b", 5, 1), PowerCut("c", 0, 1))))
    assert [[cut.at_ns for cut in made(run.conditions, name, run).cuts] for name in ("a", "b")] == [[0], [5]]
    assert [one.name for one in run.plcs] == ["a", "b"]


def test_cycles_timings_and_phases_are_by_the_names_of_plcs() -> None:
    run = VariedRun(Conditions(timing="real", cycles_ns=(("pump", 5), ("", 9)), timings=(("tank[2]", "exact"),),
                               phases_ns=(("pump", 3), ("", 4), ("tank", 100))))  # fmt: skip
    assert [run.cycle_ns(name, 1) for name in ("pump", "pump[7]", "tank")] == [5, 5, 9]
    assert VariedRun(Conditions(cycles_ns=(("pump", 5),))).cycle_ns("tank", 1) == 1
    assert [run.timing(name) for name in ("tank[2]", "tank[1]", "pump")] == ["exact", "real", "real"]
    assert [made(run.conditions, name, run).begins_ns for name in ("pump", "tank[1]", "x")] == [7, 104, 4]
    found = made(run.conditions, "pump", run)
    found.plc.scan()
    assert found.elapsed_ns == max(found.plc.elapsed_ns, 7)


def test_a_network_gets_its_seed_and_its_faults_once() -> None:
    run, network, other = VariedRun(Conditions(seed=4, faults=(Fault(silent=True),))), LoopNetwork(), LoopNetwork()
    network.faults.append(Fault(reset=True))
    for where in (network, network, other, None):
        own = Plc(counter_image())
        run.made("", own, own.find, where)
    assert network.faults == [Fault(silent=True), Fault(reset=True)] and other.faults == [Fault(silent=True)]


def test_a_plc_that_runs_alone_is_judged_behind_each_scan() -> None:
    judged: list[int] = []
    run = VariedRun(Conditions(), judge=lambda run, now_ns: judged.append(now_ns))
    scan(made(run.conditions, "", run), 3)
    scan(made(run.conditions, "pump", run), 2)
    assert judged == [0, 10 * MS, 20 * MS], "PLCs of a plant are judged by that"
    run.scanned(5)
    assert judged[-1] == 5
    VariedRun(Conditions()).scanned(5)
