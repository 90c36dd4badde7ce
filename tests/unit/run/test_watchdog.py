"""The watch cycle time: it ends a scan that takes too long in real time, and a replay ends it at the same statement."""

from __future__ import annotations

import io
from collections.abc import Iterator

import pytest
from rows import each_of

from fbvm import Etn21, Plc, compile_text
from fbvm.base.areas import NOW
from fbvm.code.image import Image
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.engine.native import engine as native
from fbvm.engine.python.engine import PythonEngine
from fbvm.machine.plc import STEP_BUDGET
from fbvm.net.journal import Journal, open_journal
from fbvm.net.tcp import TcpNetwork
from fbvm.record.recording.journal_replay import Replay
from fbvm.record.recording.recording import Recording
from fbvm.run import run, watchdog
from fbvm.run.watchdog import FIRST_STEPS, Watchdog

ENGINES = ["python", "native"] if native.available() else ["python"]
MS = 1_000_000
ENDLESS = """PROGRAM Main
VAR n : LINT; END_VAR
WHILE TRUE DO
    n := n + 1;
END_WHILE;
END_PROGRAM
"""


def image_of(text: str) -> Image:
    image = compile_text(text, "main.st").image
    assert image
    return image


# --- who is ended, and when -------------------------------------------------------------------------------------------


class Asking:
    """A PLC whose scans ask its watchdog at times that the test sets, in milliseconds."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, watch_ms: int = 1000) -> None:
        self.plc = Plc(image_of("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM"), engine="python")
        self.plc.watch_cycle.time_ns = watch_ms * MS
        self.dog = Watchdog(self.plc)
        self.now_ns = 0
        monkeypatch.setattr(watchdog, "time", self)

    def monotonic_ns(self) -> int:
        return self.now_ns

    def begin(self, at_ms: int) -> None:
        self.dog.begin(at_ms * MS)

    def least(self, left: int, at_ms: int) -> int:
        """What a scan with so many steps left is answered."""
        self.now_ns = at_ms * MS
        ask = self.plc.engine.allowance.ask
        assert ask
        return ask(left)

    def may_go_on(self, left: int, at_ms: int) -> bool:
        return self.least(left, at_ms) <= left


@pytest.fixture
def asking(monkeypatch: pytest.MonkeyPatch) -> Asking:
    return Asking(monkeypatch)


def test_a_scan_is_ended_after_its_time_and_not_before(asking: Asking) -> None:
    asking.begin(5000)
    assert asking.may_go_on(1_000_000, 5999)
    assert not asking.may_go_on(900_000, 6000)
    asking.dog.end()
    asking.begin(6000)
    assert asking.may_go_on(1_000_000, 6500)


def test_the_first_question_comes_after_the_first_steps_of_each_scan(asking: Asking) -> None:
    for _ in range(3):
        asking.begin(0)
        assert asking.plc.engine.allowance.least == STEP_BUDGET - FIRST_STEPS
        assert asking.least(STEP_BUDGET - FIRST_STEPS - 1, 1) < STEP_BUDGET - FIRST_STEPS - 1
        asking.dog.end()


@each_of(("taken_ms", "more"), [(1, 10_000), (125, 10_000), (250, 5000), (500, 2500), (999, 1251)])
def test_the_next_question_comes_within_an_eighth_of_the_time(taken_ms: int, more: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        asking = Asking(patch)
        asking.begin(0)
        left = STEP_BUDGET - 10_000
        assert left - asking.least(left, taken_ms) == more


def test_a_used_up_budget_ends_a_scan_at_any_time(asking: Asking) -> None:
    asking.begin(0)
    assert asking.least(-1, 1) == 0
    assert asking.least(3, 2) == 0


def test_scans_of_a_burst_are_told_from_each_other_by_their_time(asking: Asking) -> None:
    asking.begin(0)
    for scan in range(1, 20):
        asking.plc.memory.views["i64"][NOW // 8] = scan
        assert asking.may_go_on(1_000_000, 300 * scan)
        assert asking.may_go_on(900_000, 300 * scan + 200)
    assert not asking.may_go_on(800_000, 300 * 19 + 1000)


def test_a_scan_behind_one_that_has_asked_has_its_time_from_its_own_beginning(asking: Asking) -> None:
    asking.begin(0)
    assert asking.may_go_on(1_000_000, 100)
    asking.dog.end()
    asking.plc.memory.views["i64"][NOW // 8] = 200
    asking.begin(200)
    assert not asking.may_go_on(1_000_000, 1200)


def test_a_scan_of_a_batch_begins_when_it_asks_for_the_first_time(asking: Asking) -> None:
    asking.begin(0)
    asking.dog.begin_batch()
    for first_ms in (5000, 20_000):
        assert asking.may_go_on(1_000_000, first_ms)
        assert asking.may_go_on(900_000, first_ms + 999)
        assert not asking.may_go_on(800_000, first_ms + 1000)
        asking.dog.end()


def test_where_breakpoints_are_set_nobody_is_ended(asking: Asking) -> None:
    asking.plc.breakpoints.condition("Main.n > 100")
    asking.begin(0)
    assert asking.plc.engine.allowance is WHOLE_BUDGET


def test_another_budget_and_another_engine_are_watched_as_well(asking: Asking) -> None:
    asking.plc.budget = 10_000
    asking.begin(0)
    assert asking.plc.engine.allowance.least == 10_000 - FIRST_STEPS
    asking.plc.engine = PythonEngine(asking.plc.image, asking.plc.memory)
    asking.begin(0)
    assert asking.plc.engine.allowance.least == 10_000 - FIRST_STEPS
    asking.dog.stop()
    assert asking.plc.engine.allowance is WHOLE_BUDGET


def test_what_a_signal_raises_while_a_scan_asks_is_raised_at_its_end(asking: Asking, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> int:
        raise KeyboardInterrupt

    asking.begin(0)
    monkeypatch.setattr(asking, "monotonic_ns", interrupted)
    assert not asking.may_go_on(1_000_000, 1)
    with pytest.raises(KeyboardInterrupt):
        asking.dog.end()


@each_of("time_ns", [0, -1, 9_999_999, 40_000_000_001])
def test_a_time_that_no_cpu_unit_takes(time_ns: int) -> None:
    plc = Plc(image_of(ENDLESS))
    with pytest.raises(ValueError, match="10 ms to 40 s"):
        plc.watch_cycle.time_ns = time_ns


# --- a run ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def network() -> Iterator[TcpNetwork]:
    made = TcpNetwork({})
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_scan_without_end_is_ended_in_real_time_and_again_as_recorded(engine: str, network: TcpNetwork) -> None:
    image, file = image_of(ENDLESS), io.StringIO()
    journal = Journal(file)
    plc = Plc(image, engine=engine, budget=1 << 60, journal=journal)
    recorded = Recording().add("plc", plc)
    plc.watch_cycle.time_ns = 10 * MS
    plc.attach(Etn21(0, "192.168.250.1"), network)
    assert run(plc, scans=3) == "trap"
    assert plc.trap is not None
    assert plc.trap.message == "R0112 main.st:3:1 in Main: the scan took longer than the watch cycle time of 10 ms"
    assert plc.read("A401.08") is True
    assert plc.read("A400") == 0x809F
    assert (plc.read("A264"), plc.read("A262")) == (100, 100)
    assert plc.read("Main.n") > 0
    assert plc.engine.allowance is WHOLE_BUDGET
    journal.close()
    for again in ENGINES:
        replay = Replay(*open_journal(file.getvalue().splitlines(keepends=True)), image, engine=again)
        assert replay.run() == "end"
        assert replay.differs is None
        assert replay.plc.read("Main.n") == plc.read("Main.n")
        assert str(replay.plc.trap) == str(plc.trap)
    assert str(recorded.at(plc.scans).trap) == str(plc.trap)
    assert bytes(recorded.at(plc.scans).memory.u8) == bytes(plc.memory.u8)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scan_without_end_that_nobody_records(engine: str, network: TcpNetwork) -> None:
    plc = Plc(image_of(ENDLESS), engine=engine, budget=1 << 60)
    plc.watch_cycle.time_ns = 10 * MS
    plc.attach(Etn21(0, "192.168.250.1"), network)
    assert run(plc, scans=3, pace="event") == "trap"
    assert plc.trap and plc.trap.code == "R0112"
    plc.warm_start()
    assert plc.read("A401.08") is False


def test_a_scan_ends_with_the_budget_if_that_is_used_up_first(network: TcpNetwork) -> None:
    plc = Plc(image_of(ENDLESS), engine="python", budget=1000)
    plc.attach(Etn21(0, "192.168.250.1"), network)
    assert run(plc, scans=3) == "trap"
    assert plc.trap and plc.trap.code == "R0104"
    assert plc.read("A401.08") is False


def test_virtual_time_knows_no_watch_cycle_time() -> None:
    plc = Plc(image_of(ENDLESS), engine="python", budget=200_000)
    plc.watch_cycle.time_ns = 10 * MS
    assert run(plc, scans=3) == "trap"
    assert plc.trap and plc.trap.code == "R0104"


@pytest.mark.parametrize("engine", ENGINES)
def test_engines_end_at_the_charge_at_which_too_few_steps_are_left(engine: str) -> None:
    plc = Plc(image_of(ENDLESS), engine=engine, budget=1000)
    plc.engine.allowance = Allowance(501)
    trap = plc.scan()
    assert trap and trap.code == "R0112"
    with pytest.raises(ValueError, match="fewer than none"):
        Allowance(-1)
    assert plc.read("Main.n") == 248  # 1000 - 2 - 249 * 2 = 500: two for the body, two for a pass


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_breakpoint_that_stops_nothing_leaves_a_scan_the_steps_that_it_is_allowed(engine: str) -> None:
    plc = Plc(image_of(ENDLESS), engine=engine, budget=1000)
    plc.breakpoints.condition("Main.n < 0")
    for least, passes in ((501, 248), (301, 348)):  # each is for the engine that the breakpoint takes the place of
        plc.engine.allowance = Allowance(least)
        plc.cold_start()
        trap = plc.scan()
        assert trap and (trap.code, plc.read("Main.n")) == ("R0112", passes)
