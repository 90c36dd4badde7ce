"""Units whose processors run inside the scans of machine code: to the bit, and to the scan, what refreshes from outside do."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, cast

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import first_quick
from toy_unit import Echoing, Toy

from fbvm import Etn21, LoopNetwork, Plc, compile_text
from fbvm.base.areas import NEVER, NOW
from fbvm.code.image import Image
from fbvm.engine.clock import Clock
from fbvm.engine.native import engine as native
from fbvm.engine.native.engine import NativeEngine
from fbvm.machine.fast.paths import FastPath, ProgramAlone
from fbvm.machine.fast.units_in_code import WithUnits
from fbvm.machine.plc import Mode
from fbvm.units.etn21.faults import Fault

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

MS = 1_000_000
ZERO_NS, NUMBER = 3_600_123_456_789, 7
FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.POINTER(ctypes.c_int64))
MAIN = """
PROGRAM Main
VAR
  n, hash : UDINT; every : UDINT := {every}; i : INT; trap : UDINT := {trap};
  words AT %CIO1500 : ARRAY[0..7] OF WORD; tables AT %D20000 : ARRAY[0..13] OF WORD; shared AT %W5 : WORD;
END_VAR
  n := n + 1;
  FOR i := 0 TO 7 DO hash := hash * 31 + WORD_TO_UDINT(words[i]); END_FOR;
  hash := hash * 31 + WORD_TO_UDINT(tables[1]) + WORD_TO_UDINT(tables[8]) + WORD_TO_UDINT(shared);
  IF n MOD every = 0 AND NOT words[0].0 THEN tables[0] := UDINT_TO_WORD(n); words[0].0 := TRUE; END_IF;
  IF n MOD (every + 3) = 1 AND NOT words[4].0 THEN tables[7] := UDINT_TO_WORD(hash); words[4].0 := TRUE; END_IF;
  IF n = trap THEN n := n / (n - trap); END_IF;
END_PROGRAM
PROGRAM Slow
VAR n : UDINT; shared AT %W5 : WORD; END_VAR
  n := n + 1;
  IF n MOD 4 = 0 THEN shared.9 := NOT shared.9; END_IF;
END_PROGRAM
CONFIGURATION C
  TASK Often({interval}PRIORITY := 2);
  TASK Seldom(INTERVAL := T#25ms, PRIORITY := 1);
  PROGRAM Main WITH Often : Main;
  {slow}
END_CONFIGURATION
"""


@cache
def image(every: int = 5, interval: str = "", trap: int = 0, slow: bool = True) -> Image:
    text = MAIN.replace("{every}", str(every)).replace("{trap}", str(trap)).replace("{interval}", interval)
    compilation = compile_text(text.replace("{slow}", "PROGRAM Slow WITH Seldom : Slow;" if slow else ""))
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


class Steps:
    """A clock: each look takes some microseconds, never the same; it stops the one who looks too often."""

    def __init__(self) -> None:
        self.now_ns, self.looks, self.stop = 0, 0, 0

    def __call__(self) -> int:
        self.looks += 1
        if self.looks == self.stop:
            raise KeyboardInterrupt
        self.now_ns += 1000 * (3 + self.looks % 5)
        return self.now_ns

    def tell(self, number: int, where: Any) -> int:
        """The same as `clock_gettime` tells it, of clock 7 and a while later."""
        assert number == NUMBER
        where[0], where[1] = divmod(self() + ZERO_NS, 1_000_000_000)
        return 0


class Rig:
    """A PLC with toys, and all that can be known of them."""

    def __init__(self, code: Image, delays_ns: tuple[int, ...] = (0,), latency_ns: int = 0, *, engine: str = "native",
                 is_inside: bool = True, is_watched: bool = False, virtual_time: bool = True,
                 is_told: bool = True) -> None:  # fmt: skip
        self.plc, self.clock = Plc(code, MS, engine=engine), Steps()
        self.function = FUNCTION(self.clock.tell)
        at = 0 if is_told else ctypes.cast(self.function, ctypes.c_void_p).value or 0
        self.time = Clock(self.clock, at, NUMBER, ZERO_NS)
        self.toys = [Toy(number, delay_ns, is_inside) for number, delay_ns in enumerate(delays_ns)]
        self.networks = [Echoing(latency_ns, virtual_time) for _ in delays_ns]
        for toy, network in zip(self.toys, self.networks, strict=True):
            self.plc.attach(toy, network)
        if is_watched:
            self.plc.phases.append(lambda plc, phase: None)

    @property
    def state(self) -> tuple[Any, ...]:
        plc = self.plc
        own = [(bytes(toy.own.memory.u8), toy.wake_ns) for toy in self.toys]
        logs = [(network.log, [link.refreshes for link in network.links]) for network in self.networks]
        return bytes(plc.memory.u8), plc.now_ns, plc.scans, str(plc.trap), plc.trap or plc.due_ns, own, logs


def four(code: Image, *operands: Any) -> list[Rig]:
    """The same four times: inside machine code, beside it, looked into, in Python."""
    return [Rig(code, *operands), Rig(code, *operands, is_inside=False), Rig(code, *operands, is_watched=True),
            Rig(code, *operands, engine="python")]  # fmt: skip


def way(rig: Rig) -> FastPath | None:
    return rig.plc.fast_path()


def agree(rigs: list[Rig], do: Callable[[Plc], object]) -> None:
    for rig in rigs:
        do(rig.plc)
        for attached in rig.plc.units:  # what was left out is told at the latest by the next refresh
            attached.link.pass_by(rig.plc._io.skipped)
        rig.plc._io.skipped = 0
    for rig in rigs[1:]:
        assert rig.state == rigs[0].state


SHAPES = [
    ((), (0,), 0), ((5, "INTERVAL := T#7ms, "), (3 * MS, 0), 0), ((1,), (0, 0), 2_500_000),
    ((9, "INTERVAL := T#2ms, "), (MS, 90), 0),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("program", "delays_ns", "latency_ns"), first_quick(SHAPES))
def test_scan_by_scan(program: tuple[Any, ...], delays_ns: tuple[int, ...], latency_ns: int) -> None:
    rigs = four(image(*program), delays_ns, latency_ns)
    for _ in range(120):
        agree(rigs, Plc.scan)
    assert isinstance(way(rigs[0]), WithUnits) and isinstance(way(rigs[1]), ProgramAlone)
    assert rigs[0].plc.read("D20001") > 2 and rigs[0].networks[0].log
    assert rigs[0].toys[0].refreshes < rigs[1].toys[0].refreshes


@pytest.mark.slow
@pytest.mark.parametrize(("program", "delays_ns", "latency_ns"), first_quick(SHAPES, 2))
def test_many_at_once(program: tuple[Any, ...], delays_ns: tuple[int, ...], latency_ns: int) -> None:
    rigs = four(image(*program), delays_ns, latency_ns)
    for scans in (1, 2, 7, 30, 500, 3, 200):
        agree(rigs, lambda plc, scans=scans: plc.run(scans=scans))  # type: ignore[misc]
    assert rigs[0].plc.scans == 743 and rigs[0].plc.read("D20001") > 20


@pytest.mark.slow
def test_a_trap_of_the_program_ends_a_run_and_a_restart_begins_anew() -> None:
    rigs = four(image(every=5, trap=47), (MS,))
    agree(rigs, lambda plc: plc.run(scans=100))
    assert rigs[0].plc.trap and rigs[0].plc.scans == 47
    agree(rigs, Plc.warm_start)
    agree(rigs, lambda plc: plc.run(scans=40))
    assert rigs[0].plc.scans == 87 and not rigs[0].plc.trap


@pytest.mark.slow
@pytest.mark.parametrize("do", [lambda plc: plc.scan(), lambda plc: plc.run(scans=50)], ids=["scan", "run"])
@pytest.mark.parametrize(("body", "trap"), [("d := 10 / (9 - n);", "R0101"), ("WHILE n = 9 DO ; END_WHILE", "R0104")])
def test_the_only_trap_of_a_program_ends_it(body: str, trap: str, do: Callable[[Plc], object]) -> None:
    code = compile_text(f"PROGRAM Main VAR n, d : INT; END_VAR {body} n := n + 1; END_PROGRAM").image
    assert code is not None
    rigs = four(code, (0,))
    for rig in rigs:
        rig.plc.budget = 1000
    while not rigs[0].plc.trap:
        agree(rigs, do)
    assert (rigs[0].plc.scans, rigs[0].plc.trap.code) == (10, trap)


@pytest.mark.slow
@pytest.mark.parametrize("do", [lambda plc: plc.scan(), lambda plc: plc.run(scans=50)], ids=["scan", "run"])
def test_a_scan_that_has_no_steps_left_for_its_program_ends(do: Callable[[Plc], object]) -> None:
    code = compile_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; n := n + 1; n := n + 1; END_PROGRAM").image
    assert code is not None
    rigs = four(code, (0,))
    agree(rigs, lambda plc: plc.run(scans=10))
    for rig in rigs:
        rig.plc.budget = 1
    agree(rigs, do)
    trap = rigs[0].plc.trap
    assert (rigs[0].plc.scans, trap and trap.code, rigs[0].plc.read("Main.n")) == (11, "R0104", 30)


@pytest.mark.slow
def test_a_trap_of_a_units_program_is_a_fault_of_ours() -> None:
    for rig in four(image(every=50), (0, 0)):
        rig.plc.run(scans=10)
        rig.plc.write("CIO1504.1", True)
        with pytest.raises(RuntimeError, match=r"R0101 unit\.st:\d+:\d+ in Toy: \d divided by 0"):
            rig.plc.run(scans=3)


@pytest.mark.slow
def test_what_is_written_from_outside_is_seen() -> None:
    rigs = four(image(every=1000, slow=False), (0, 2 * MS))
    agree(rigs, lambda plc: plc.run(scans=20))
    runs = rigs[0].plc.read("CIO1502")

    def ask(plc: Plc) -> None:
        plc.write("D20000", 0x1234)
        plc.write("CIO1500.0", True)
        plc.run(scans=4)

    agree(rigs, ask)
    assert (rigs[0].plc.read("CIO1503"), rigs[0].plc.read("CIO1502")) == (0x34 ^ 0xFF, runs + 2)  # type: ignore[operator]
    agree(rigs, lambda plc: plc.write("W7", 1))
    agree(rigs, Plc.scan)
    assert rigs[0].plc.read("CIO1502") == runs + 3  # type: ignore[operator]


@pytest.mark.slow
def test_its_time_comes_in_the_middle_of_many_scans() -> None:
    rigs = four(image(every=10_000, slow=False), (700 * MS,))
    agree(rigs, lambda plc: plc.run(scans=20))
    for rig in rigs:
        rig.plc.write("CIO1500.0", True)
    agree(rigs, lambda plc: plc.run(until="NOT CIO1500.0"))
    assert rigs[0].plc.scans == 20 + 702
    assert rigs[0].toys[0].refreshes < 5


@pytest.mark.slow
def test_scans_in_one_piece_and_others_take_turns() -> None:
    rigs = four(image(), (MS, 0))
    for number in range(12):
        agree(rigs, lambda plc: plc.run(scans=11))
        if number % 3 == 0:
            agree(rigs, lambda plc: plc.force("W9", 5))
        if number % 3 == 1:
            agree(rigs, Plc.unforce)
        if number == 6:
            agree(rigs, lambda plc: setattr(plc, "mode", Mode.PROGRAM))
            agree(rigs, lambda plc: plc.run(scans=3))
            agree(rigs, lambda plc: setattr(plc, "mode", Mode.RUN))
        if number == 8:
            agree(rigs, lambda plc: plc.units.append(plc.units.pop(0)))
    assert isinstance(way(rigs[0]), WithUnits)


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(st.data())
def test_any_order_of_happenings(data: st.DataObject) -> None:
    every, interval = data.draw(st.integers(1, 9)), data.draw(st.sampled_from(["", "INTERVAL := T#7ms, "]))
    delays_ns = tuple(data.draw(st.lists(st.sampled_from([0, 1, MS, 10 * MS]), min_size=1, max_size=4)))
    rigs = four(image(every, interval), delays_ns, data.draw(st.sampled_from([0, 0, 300_000, 5 * MS])))
    for _ in range(data.draw(st.integers(1, 12))):
        scans, word = data.draw(st.integers(1, 60)), data.draw(st.integers(0, 15))
        value = data.draw(st.integers(0, 0xFFFF)) & ~2
        agree(rigs, lambda plc, scans=scans: plc.run(scans=scans))  # type: ignore[misc]
        agree(rigs, lambda plc, word=word, value=value: plc.write(f"CIO{1500 + word}", value))  # type: ignore[misc]


# --- when they cannot -------------------------------------------------------------------------------------------------


def test_units_of_different_kinds_are_refreshed_from_outside() -> None:
    rig = Rig(image(), (0,))
    rig.plc.attach(Toy(1, is_inside=False), Echoing())
    rig.plc.run(scans=5)
    assert isinstance(way(rig), ProgramAlone)


def test_a_processor_without_machine_code_is_run_from_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, other = Rig(image(), (0,)), Rig(image(), (0,))
    with monkeypatch.context() as patch:
        patch.setattr(native, "available", lambda: False)
        other.toys[0].own = other.toys[0].own.copy()
        other.toys[0].connect()
    for scans in (1, 5, 300):
        agree([rig, other], lambda plc, scans=scans: plc.run(scans=scans))  # type: ignore[misc]
    assert isinstance(way(other), ProgramAlone) and isinstance(way(rig), WithUnits)


@pytest.mark.slow
def test_with_the_python_engine_no_program_of_a_unit_is_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(NativeEngine, "run", lambda self, task: pytest.fail("machine code"))
    rig, etn21 = Rig(image(), (0, MS), engine="python"), Etn21(0, "192.168.250.20")
    rig.plc.attach(etn21, LoopNetwork())
    rig.plc.write("CIO1519.0", True)  # an open, which switches the processor of the unit on
    rig.plc.run(scans=50)
    assert etn21.exchanged and etn21.exchanged.processor.machine is None
    assert [toy.own.machine for toy in rig.toys] == [None, None] and rig.plc.read("D20001") > 2  # type: ignore[operator]


def test_a_unit_that_is_attached_goes_over_to_the_engine_of_its_plc() -> None:
    etn21 = Etn21(0, "192.168.250.20", faults=[Fault(0x2211)])
    assert etn21.exchanged and etn21.exchanged.processor.machine is not None
    Plc(image(), MS, engine="python").attach(etn21, LoopNetwork())
    assert etn21.exchanged.processor.machine is None
    Plc(image(), MS, engine="native").attach(etn21, LoopNetwork())
    assert etn21.exchanged.processor.machine is not None


# --- bursts -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_plc_whose_units_have_something_to_hear_or_to_ask_enters_no_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(image(every=1000, slow=False))
    rig.plc.run(scans=3)
    path = way(rig)
    assert isinstance(path, WithUnits)
    path._parameters.events_collected = 1
    assert path.enter_batch(rig.plc.now_ns, 77) == (path._scans, NEVER)
    assert (path._parameters.scan_budget, path._parameters.events_collected) == (77, 0)
    path._parameters.unfinished = 1
    assert path.enter_batch(rig.plc.now_ns, 88) is None
    path._parameters.unfinished = 0
    monkeypatch.setattr(path, "_has_pending_events", lambda: True)
    assert path.enter_batch(rig.plc.now_ns, 88) is None and path._parameters.scan_budget == 77
    monkeypatch.undo()
    skipped, path._io.changed_words = path._io.skipped, True
    path.leave_batch(5)
    assert (path._io.skipped, path._io.changed_words) == (skipped + 5, False)
    assert path.enter_batch(rig.plc.now_ns, 88) is not None


def bursts(rig: Rig, count: int, most: int, pause_ns: int, stop: int = 0) -> list[list[int]]:
    """Bursts as in event pace: upon what a network has, and at the latest when a millisecond is over."""
    clock, found = rig.clock, []
    rig.plc.scan(clock())
    rig.plc.scan(clock())
    clock.stop = stop
    for _ in range(count):
        clock.now_ns += pause_ns
        for network in rig.networks:
            network.serve(clock.now_ns)
        try:
            found.append(rig.plc.scan_at_once(most, clock.now_ns, rig.time))
        except KeyboardInterrupt:
            found.append([])
        if rig.plc.trap:
            break
    return found


CASES = [((0,), 0, 16), ((MS,), 300_000, 16), ((0, 50_000), 10_000, 3), ((0,), 0, 1), ((7000, 0, MS), 0, 16)]


@pytest.mark.slow
@pytest.mark.parametrize("program", first_quick([(2,), ((3, "INTERVAL := T#1ms, "),), ((2, "", 150),)]))
@pytest.mark.parametrize(("delays_ns", "latency_ns", "most"), first_quick(CASES))
@pytest.mark.parametrize("virtual_time", [False, True])
def test_bursts(program: tuple[Any, ...], delays_ns: tuple[int, ...], latency_ns: int, most: int, virtual_time: bool) -> None:
    """Machine code reads the clock itself, or is told the time; or the units are beside it."""
    rigs = [Rig(image(*program), delays_ns, latency_ns, is_inside=is_inside, virtual_time=virtual_time, is_told=is_told)
            for is_inside, is_told in ((True, False), (True, True), (False, True))]  # fmt: skip
    for pause_ns in (200_000, 1000, 20_000):
        times = [bursts(rig, 60, most, pause_ns) for rig in rigs]
        assert times[0] == times[1] == times[2]
        agree(rigs, lambda plc: None)
        if rigs[0].plc.trap:
            break
    assert rigs[0].plc.read("D20001") > 3 and max(rig.toys[0].refreshes for rig in rigs[:2]) <= 6  # type: ignore[operator]


def test_machine_code_that_reads_the_clock_comes_back_less_often() -> None:
    calls = []
    for is_told in (True, False):
        rig, points = Rig(image(2), (0,), virtual_time=False, is_told=is_told), list[int]()
        bursts(rig, 1, 16, 1000)
        series = cast(WithUnits, way(rig))._scans
        call, scans, looks = series.call_burst, rig.plc.scans, rig.clock.looks
        series.call_burst = lambda at, call=call, points=points: points.append(call(at)) or points[-1]  # type: ignore[misc]
        bursts(rig, 40, 16, 1000)
        assert rig.plc.scans - scans == rig.clock.looks - looks > 60
        calls.append(len(points))
    assert calls[1] < calls[0] * 2 // 3


@pytest.mark.slow
def test_ctrl_c_in_a_burst_loses_nothing() -> None:
    for stop in range(3, 40):
        inside, beside = (Rig(image(2), (0,), is_inside=is_inside, virtual_time=False) for is_inside in (True, False))
        assert bursts(inside, 30, 16, 1000, stop) == bursts(beside, 30, 16, 1000, stop)
        assert inside.state == beside.state


def test_ctrl_c_when_machine_code_comes_back_loses_nothing() -> None:
    for stop in range(1, 12):
        rig, calls = Rig(image(2), (0,), virtual_time=False, is_told=False), iter(range(1, 1000))
        bursts(rig, 5, 16, 1000)
        series = cast(WithUnits, way(rig))._scans
        call = series.call_burst

        def interrupted(at: int, call: Any = call, calls: Iterator[int] = calls, stop: int = stop) -> int:
            point: int = call(at)
            if next(calls) == stop:
                raise KeyboardInterrupt
            return point

        series.call_burst = interrupted
        times = bursts(rig, 12, 16, 1000)
        assert [] in times and rig.plc.scans == rig.plc.read("Main.n")
        assert rig.plc.now_ns == rig.plc.memory.views["i64"][NOW // 8]
        assert len(rig.networks[0].log) >= rig.plc.read("D20001") > 3  # type: ignore[operator]


@pytest.mark.slow
def test_a_burst_takes_over_when_tasks_are_due_from_scans_in_python() -> None:
    found = []
    for is_inside in (True, False):
        rig = Rig(image(3, "INTERVAL := T#1ms, "), (0,), is_inside=is_inside)
        bursts(rig, 5, 16, 1000)

        def watch(plc: Plc, phase: object) -> None:
            pass

        rig.plc.phases.append(watch)
        for _ in range(4):
            rig.clock.now_ns += 700_000
            rig.plc.scan(rig.clock())
        rig.plc.phases.remove(watch)
        rig.clock.now_ns += 100_000
        times = [rig.plc.scan_at_once(16, rig.clock.now_ns, rig.time) for _ in range(3)]
        found.append((times, rig.plc.read("D20001"), rig.state))
    assert found[0] == found[1]
