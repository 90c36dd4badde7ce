"""A part of a fleet from both ends of its line: what it tells, when it ends, and what its process is told."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from images import counter_image
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.campaign.fleet import shard as module
from fbvm.campaign.fleet.shard import BUILDING, FAILED, GO_ON, OVER, RUNNING, STOP, Figures, Shard, ShardProcess, run_shard
from fbvm.campaign.work import Mismatch
from fbvm.machine.plc import Plc
from fbvm.net.tcp import TcpNetwork
from fbvm.run.project import Project
from fbvm.wire.link import Peer

NOTHING = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
S = 1_000_000_000


class Line:
    """The line of a part: takes what comes from the other end, one row a poll; an exception stands for a line that is broken."""

    def __init__(self, *comes: Any) -> None:
        self.comes, self.sent, self.waited = list(comes), list[Any](), list[float]()

    def poll(self, wait_s: float = 0.0) -> bool:
        self.waited.append(wait_s)
        return bool(self.comes) and self.comes[0] is not None or bool(self.comes) and bool(self.comes.pop(0))

    def recv(self) -> Any:
        found = self.comes.pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    def send(self, said: Any) -> None:
        if self.comes and isinstance(self.comes[0], OSError):
            raise self.comes[0]
        self.sent.append(said)


# --- what it is told --------------------------------------------------------------------------------------------------


@each_of("comes, unheard, over", [
    ([], False, False), ([GO_ON], False, False), ([STOP], False, True), ([GO_ON, GO_ON, STOP], False, True),
    ([STOP, GO_ON], False, True), ([], True, True), ([GO_ON], True, True), ([EOFError()], False, True),
    ([OSError()], False, True), ([GO_ON, EOFError()], False, True)])
def test_a_part_ends_when_it_is_told_to_or_hears_nothing_any_more(comes: list[Any], unheard: bool, over: bool,
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[int] = []
    monkeypatch.setattr(module, "time_limit", lambda limit_ns: limits.append(limit_ns) or (lambda: unheard))
    line = Line(*comes)
    told = module._Told(line)  # type: ignore[arg-type]
    assert not told()
    told.listen(wait_s=1.0)
    assert told() is over and line.comes == []
    heard = sum(not isinstance(each, Exception) for each in comes)
    assert limits == [30 * S] * (1 + len(comes)), "what comes, and be it the end, gives it as much time again"
    assert line.waited == [1.0, *[0.0] * heard][: len(line.waited)]


def test_what_was_told_to_stop_stays_so(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(STOP)
    told = module._Told(line)  # type: ignore[arg-type]
    told.listen()
    line.comes = [GO_ON]
    told.listen()
    assert told()


# --- what it tells ----------------------------------------------------------------------------------------------------


def running(scans: int, missed: int = 0, trap: object = None, reason: str = "") -> Any:
    plc = Plc(counter_image())
    plc.run(scans=scans)
    plc.lateness.missed = missed
    plc.trap = trap  # type: ignore[assignment]
    for _ in range(scans):
        plc.scan_times.note(0, 1000 * scans)
        plc.lateness.note(0, 10 * scans)
    return SimpleNamespace(plc=plc, reason=reason)


class Plant:
    """Some PLCs that run; `diagnostics` are none."""

    diagnostics = ()
    network: Any = None

    def __init__(self, *given: Any, **named: Any) -> None:
        self.given, self.is_closed = (given, named), False
        self.runs = [running(3, 1), running(5, 2, "R0101", "trap"), running(4, 0, None, "time"), running(1, 0, None, "time")]
        self.doors = {Peer("10.0.0.1", 502): Peer("127.0.0.1", 1502)}

    def close(self) -> None:
        self.is_closed = True


def test_the_figures_of_a_part_are_sums_over_its_plcs() -> None:
    plant: Any = Plant()
    wanted = Figures(7, RUNNING, 4, 13, 3, 1, 0, 1.5, {"trap": 1, "time": 2})
    assert module.figures(7, plant, lambda: 1_500_000_000) == wanted
    plant.network = SimpleNamespace(connections=9)
    assert module.figures(7, plant, lambda: 0).connections == 0, "in memory nothing is open"
    plant.network = TcpNetwork(None, "127.0.0.1")
    try:
        plant.network.__class__ = type("Open", (TcpNetwork,), {"connections": 9})
        assert module.figures(7, plant, lambda: 0).connections == 9
    finally:
        plant.network.close()


class Loop:
    """Stands in for the loop, which looks in several times; `unpacked` images are none."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, looks: int = 3, error: Exception | None = None) -> None:
        self.plants: list[Plant] = []
        self.again: list[int] = []

        def plant(*given: Any, **named: Any) -> Plant:
            if error:
                raise error
            self.plants.append(Plant(*given, **named))
            return self.plants[-1]

        def run_all(runs: Any, tick: Any, until: Any) -> None:
            assert runs is self.plants[0].runs and not self.plants[0].is_closed
            for _ in range(looks):
                tick()
            self.told = until()

        monkeypatch.setattr(module, "Plant", plant)
        monkeypatch.setattr(module, "run_all", run_all)
        monkeypatch.setattr(module, "unpacked", lambda images, version: {"of": (images, version)})
        monkeypatch.setattr(module, "stopwatch", lambda: lambda: 2 * S)
        monkeypatch.setattr(module, "time_limit", self.limit)

    def limit(self, limit_ns: int) -> Any:
        """Over at once for a negative time, never else."""
        self.again.append(limit_ns)
        return lambda: limit_ns < 0


def test_a_part_tells_figures_at_once_and_its_measures_once_it_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    loop, line = Loop(monkeypatch), Line(None, None, None, None, GO_ON, STOP)
    run_shard(Shard(7, NOTHING, (), "1.0", 5 * S), line)  # type: ignore[arg-type]
    [plant] = loop.plants
    assert plant.given == ((NOTHING,), {"images": {"of": ((), "1.0")}, "for_ns": 5 * S}) and plant.is_closed and not loop.told
    first, last = line.sent
    doors = {"10.0.0.1:502": "127.0.0.1:1502"}
    assert first == Figures(7, RUNNING, 4, 13, 3, 1, 0, 2.0, {"trap": 1, "time": 2}, doors)
    assert (last.state, last.plcs, last.scans, last.doors, last.message) == (OVER, 4, 13, doors, "")
    assert (last.scan_time["longest_ns"], last.scan_time["mean_ns"]) == (5000, (9 + 25 + 16 + 1) * 1000 // 13)
    assert (last.lateness["longest_ns"], last.lateness["missed_periods"]) == (50, 3)
    assert loop.again[:3] == [30 * S, -1, S], "a second passes until it tells them again"
    assert line.waited == [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0], "once it is over it waits for the stop"


@each_of("error, said", [
    (Mismatch("the images are of 1.0, not 2.0"), "the images are of 1.0, not 2.0"),
    (OSError(98, "Address already in use"), "address already in use"), (ValueError("no such host"), "no such host")])
def test_a_part_that_cannot_begin_says_why(error: Exception, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Loop(monkeypatch, error=error)
    line = Line()
    run_shard(Shard(7, NOTHING, (), "1.0"), line)  # type: ignore[arg-type]
    assert line.sent == [Figures(7, FAILED, message=said)]


def test_a_part_whose_line_breaks_or_whose_loop_fails_leaves_its_network(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, looks=0)
    line = Line(OSError("broken"))
    run_shard(Shard(7, NOTHING, (), "1.0"), line)  # type: ignore[arg-type]
    assert line.sent == [] and loop.plants[0].is_closed
    monkeypatch.setattr(module, "run_all", lambda *given: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        run_shard(Shard(7, NOTHING, (), "1.0"), Line())  # type: ignore[arg-type]
    assert loop.plants[1].is_closed


# --- its process ------------------------------------------------------------------------------------------------------


def process(monkeypatch: pytest.MonkeyPatch, *comes: Any) -> tuple[ShardProcess, Line, list[str]]:
    line, done = Line(*comes), list[str]()
    monkeypatch.setattr(module, "started", lambda: SimpleNamespace(line=line, end=lambda: done.append("ended")))
    return ShardProcess(Shard(7, NOTHING, (), "1.0")), line, done


def test_a_process_is_told_what_to_run_and_to_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    made, line, done = process(monkeypatch)
    made.begin()
    [begun] = line.sent
    assert isinstance(begun, partial)
    assert (begun.func, begun.args, begun.keywords) == (run_shard, (Shard(7, NOTHING, (), "1.0"),), {})
    made.stop()
    assert line.sent[1:] == [STOP] and done == []
    made.end()
    assert done == ["ended"]
    line.comes = [OSError("broken")]
    made.stop()


BEGUN = Figures(7)
RUNS = [Figures(7, RUNNING, 4, scans) for scans in (10, 20)]
FINAL, WRONG = Figures(7, OVER, 4, 30), Figures(7, FAILED, message="why")


@each_of("comes, told, sent", [
    ([], [BEGUN], [[GO_ON]]), (RUNS, [RUNS[1]], [[GO_ON]]),
    ([RUNS[0], None, RUNS[1]], [RUNS[0], RUNS[1]], [[GO_ON], [GO_ON] * 2]),
    ([RUNS[0], FINAL, "never read"], [FINAL, FINAL], [[], []]), ([WRONG], [WRONG], [[]]),
    ([RUNS[0], EOFError()], [Figures(7, FAILED, 4, 10, message="its process has ended")] * 2, [[], []]),
    ([OSError()], [Figures(7, FAILED, message="its process has ended")], [[]])])
def test_the_last_figures_of_a_process_are_told_and_it_goes_on_while_somebody_asks(
        comes: list[Any], told: list[Figures], sent: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    made, line, _ = process(monkeypatch, *comes)
    for figures, said in zip(told, sent, strict=True):
        assert made.figures() == figures and line.sent == said
    assert BEGUN.state == BUILDING
