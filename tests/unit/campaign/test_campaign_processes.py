"""Pools of processes that are threads of this one: what comes of tasks, who is ended and replaced; parts of a fleet."""

from __future__ import annotations

import io
import signal
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import Pipe
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from rows import each_of

from fbvm.base.host import signals_held
from fbvm.campaign import processes, shipped
from fbvm.campaign.fleet import places, shard
from fbvm.campaign.fleet.shard import BUILDING, FAILED, GO_ON, OVER, RUNNING, STOP, Figures, Shard
from fbvm.campaign.processes import LATE, TRIES, Crashed, Hopeless, NotStarted, Pool, Process
from fbvm.campaign.project_copies import pack_project
from fbvm.campaign.shipped import Shipped

MS = 1_000_000


class InThread:
    """Takes the place of a process: does what it is told at its line first."""

    made: ClassVar[list[InThread]] = []

    def __init__(self) -> None:
        self.line, theirs = Pipe()
        self.is_ended = False
        self.thread = Thread(target=self._serve, args=(theirs,), daemon=True)
        self.thread.start()
        self.made.append(self)

    @staticmethod
    def _serve(line: Any) -> None:
        with line, suppress(EOFError, OSError):
            line.recv()(line)

    def ended(self) -> Crashed:
        return Crashed("by its thread")

    def end(self) -> None:
        self.is_ended = True
        self.line.close()


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[InThread]]:
    InThread.made = []
    monkeypatch.setattr(processes, "started", InThread)
    monkeypatch.setattr(processes, "POLL_S", 0.005)
    _prepared.clear()
    yield InThread.made
    _gate.set()
    for each in InThread.made:
        each.thread.join(5)
    _gate.clear()


_prepared: list[int] = []
_gate = Event()
_fragile: list[str] = []


def prepare(number: int) -> None:
    _prepared.append(number)


def work(number: int, task: Any) -> Any:
    if task == "hopeless":
        raise Hopeless("nothing can be done")
    if task == "waits":
        _gate.wait(5)
    if task == "crashes" or task == "crashes once" and _fragile.pop():
        raise EOFError
    return task, number


def done(count: int, tasks: list[Any], limit_ns: int = 5000 * MS) -> list[tuple[Any, Any]]:
    with Pool[Any, Any](count, prepare, work) as pool:
        return list(pool.results(tasks, limit_ns))


def test_all_tasks_are_done_by_as_many_processes_as_there_are_tasks_for(made: list[InThread]) -> None:
    found = done(3, list(range(9)))
    assert sorted((task, result[0]) for task, result in found) == [(task, task) for task in range(9)]
    assert {result[1] for _, result in found} <= {0, 1, 2} and sorted(_prepared) == [0, 1, 2]
    assert len(made) == 3 and all(each.is_ended for each in made)
    assert len(done(5, ["a", "b"])) == 2 and len(made) == 5
    assert done(2, []) == [] and len(made) == 5


def test_a_task_that_ends_its_process_is_tried_again_and_the_process_replaced(made: list[InThread]) -> None:
    found = done(1, ["a", "crashes", "b"])
    assert found == [("a", ("a", 0)), ("crashes", Crashed("by its thread")), ("b", ("b", 0))]
    assert (len(made), _prepared) == (1 + TRIES, [0] * (1 + TRIES)) and all(each.is_ended for each in made)
    _fragile[:] = ["", "once"]
    assert done(1, ["crashes once"]) == [("crashes once", ("crashes once", 0))]


def test_a_task_that_takes_too_long_is_late_and_its_process_ended(made: list[InThread]) -> None:
    found = done(1, ["waits", "b"], 20 * MS)
    assert found == [("waits", LATE), ("b", ("b", 0))] and len(made) == 2


def test_a_hopeless_task_ends_all(made: list[InThread]) -> None:
    with pytest.raises(Hopeless, match="nothing can be done"):
        done(2, ["hopeless", "waits"])
    assert all(each.is_ended for each in made)


# --- a process itself -------------------------------------------------------------------------------------------------


def process(**about: Any) -> tuple[Process, list[str]]:
    """A process with these parts, and what is done with it."""
    log: list[str] = []
    popen = SimpleNamespace(stdout=io.BytesIO(about.get("said", b"+")), kill=lambda: log.append("kill"))
    popen.wait = about.get("wait", lambda *limit: log.append("wait"))
    line = SimpleNamespace(close=lambda: log.append("line closed"))
    door = SimpleNamespace(accept=lambda: line, close=lambda: log.append("door"))
    return Process(popen, door), log  # type: ignore[arg-type]


def late(*limit: float) -> int:
    raise subprocess.TimeoutExpired("python", 1)


@each_of(("wait", "how"), [
    (lambda *limit: -9, "by SIGKILL"), (lambda *limit: 3, "with status 3"), (lambda *limit: 0, "with status 0"),
    (lambda *limit: -200, "by signal 200"), (late, ""),
])  # fmt: skip
def test_how_a_process_has_ended_is_told_by_signal_or_status(wait: Any, how: str) -> None:
    assert process(wait=wait)[0].ended() == Crashed(how)


def test_a_process_that_ends_before_it_connects_says_so() -> None:
    with pytest.raises(NotStarted, match="ended with status 7 before it began"):
        assert process(said=b"", wait=lambda *limit: 7)[0].line


def test_a_process_is_killed_and_what_was_opened_for_it_closed() -> None:
    one, log = process()
    one.end()
    assert log == ["kill", "wait", "door"] and one.process.stdout and one.process.stdout.closed
    other, log = process()
    first = other.line
    assert other.line is first
    other.end()
    assert log == ["kill", "wait", "line closed", "door"]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="POSIX only")
def test_a_process_can_be_ended_by_signals_although_it_was_started_while_they_were_held() -> None:
    with signals_held(), Pool[int, set[int]](1, prepare, blocked) as pool:
        assert list(pool.results([0], 60_000 * MS)) == [(0, set())]


def blocked(number: int, task: int) -> set[int]:
    """The signals that do not reach this process."""
    return {int(each) for each in signal.pthread_sigmask(signal.SIG_BLOCK, [])}


# --- beside the workers of a cluster ----------------------------------------------------------------------------------


class SquareBench:
    """Does its tasks in a folder of its own."""

    folders: ClassVar[list[str]] = []

    def in_folders(self, folders: list[str]) -> SquareBench:
        self.folders.extend(folders)
        assert (Path(folders[0]) / "a.st").read_text() == "text"
        return self

    def __repr__(self) -> str:
        return "a bench"

    prepare, work = staticmethod(prepare), staticmethod(work)


def test_a_shipped_bench_keeps_its_process_for_the_next_task_until_it_is_closed(made: list[InThread], tmp_path: Path) -> None:
    (tmp_path / "plant").mkdir()
    (tmp_path / "plant" / "a.st").write_text("text")
    bench: Any = Shipped(SquareBench(), "plant", pack_project(tmp_path / "plant"))  # type: ignore[arg-type]
    other: Any = Shipped(SquareBench(), "plot", bench.files)  # type: ignore[arg-type]
    assert bench.mark != other.mark and bench.mark == Shipped(SquareBench(), "plant", bench.files).mark  # type: ignore[arg-type]
    assert [bench.limited(task, 5000 * MS) for task in ("a", "b")] == [("a", 0), ("b", 0)] and len(made) == 1
    assert isinstance(bench.limited("crashes", 5000 * MS), Crashed) and bench.limited("c", 5000 * MS) == ("c", 0)
    [folder] = SquareBench.folders
    assert Path(folder).name == "plant" and Path(folder).is_dir()
    bench.close()
    assert not Path(folder).exists() and all(each.is_ended for each in made) and bench.mark not in shipped._places
    bench.close()


# --- a fleet ----------------------------------------------------------------------------------------------------------


class Line:
    """A line on which these figures come; an error is raised in its turn."""

    def __init__(self, *coming: Any) -> None:
        self.coming, self.sent, self.waits = list(coming), list[Any](), list[float]()

    def poll(self, wait_s: float = 0.0) -> bool:
        self.waits.append(wait_s)
        return bool(self.coming)

    def recv(self) -> Any:
        first = self.coming.pop(0)
        if isinstance(first, Exception):
            raise first
        return first

    def send(self, what: Any) -> None:
        self.sent.append(what)
        if what is STOP and self.waits == [-1.0]:
            raise BrokenPipeError


class Parts(list[Any]):
    """Makes processes of parts whose lines are given, one after the other."""

    def __call__(self) -> Any:
        self.ended = getattr(self, "ended", 0)

        def end() -> None:
            self.ended += 1

        return SimpleNamespace(line=self.pop(0), end=end)


def part(number: int = 0) -> Shard:
    return Shard(number, None, (), "")  # type: ignore[arg-type]


def test_a_part_tells_its_last_figures_and_is_told_to_go_on_while_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(Figures(0, RUNNING, 1), Figures(0, RUNNING, 2))
    monkeypatch.setattr(shard, "started", Parts([line]))
    one = shard.ShardProcess(part())
    one.begin()
    assert one.figures() == Figures(0, RUNNING, 2) and line.sent[1:] == [GO_ON]
    line.coming = [Figures(0, OVER, 3), Figures(0, RUNNING, 4)]
    assert one.figures() == Figures(0, OVER, 3) == one.figures() and line.sent[1:] == [GO_ON] and len(line.coming) == 1
    one.stop()
    assert line.sent[2:] == [STOP]
    line.waits = [-1.0]
    one.stop()
    lost = Line(EOFError())
    monkeypatch.setattr(shard, "started", Parts([lost]))
    other = shard.ShardProcess(part(4))
    assert (other.figures().state, other.figures().message, other.figures().number) == (FAILED, "its process has ended", 4)


def test_parts_of_this_machine_are_ended_behind_an_error_too(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = Line(Figures(0, RUNNING, 1)), Line()
    parts = Parts(lines)
    monkeypatch.setattr(shard, "started", parts)
    with pytest.raises(KeyError), places.here([part(0), part(1)]) as running:
        assert running.figures() == {0: ("here", Figures(0, RUNNING, 1)), 1: ("here", Figures(1, BUILDING))}
        running.stop()
        raise KeyError
    assert parts.ended == 2 and [line.sent[-1] for line in lines] == [STOP, STOP]


@each_of("problem", [OSError(24, "Too many open files"), KeyboardInterrupt()])
def test_parts_that_were_started_are_ended_where_another_cannot_be(
    problem: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = []

    def started() -> Any:
        if len(ended) == 2:
            raise problem
        number = len(ended)
        ended.append(False)
        return SimpleNamespace(line=Line(), end=lambda: ended.__setitem__(number, True))

    monkeypatch.setattr(shard, "started", started)
    with pytest.raises(type(problem)), places.here([part(0), part(1), part(2)]):
        pass
    assert ended == [True, True]


class Cluster:
    """A client of a cluster whose workers are here; each has parts of its own."""

    def __init__(self, *workers: str) -> None:
        self.workers, self.is_there = dict.fromkeys(workers), True
        self.parts: dict[str, dict[str, Any]] = {worker: {} for worker in workers}

    def scheduler_info(self, n_workers: int) -> dict[str, Any]:
        assert n_workers == -1
        return {"workers": self.workers}

    def run(self, function: Any, *given: Any, workers: list[str] | None = None, on_error: str = "raise") -> dict[str, Any]:
        if not self.is_there:
            raise OSError
        found = {}
        for worker in workers or self.workers:
            places._parts = self.parts[worker]
            found[worker] = function(*given)
        return found

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *raised: object) -> None:
        self.is_there = False


def test_parts_of_a_cluster_are_spread_and_those_of_a_worker_that_goes_have_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    parts = Parts([Line(Figures(0, RUNNING, 7)), Line(Figures(1, RUNNING, 8)), Line(Figures(2, OVER, 9))])
    monkeypatch.setattr(shard, "started", parts)
    monkeypatch.setattr(places, "_parts", {})
    cluster: Any = Cluster("b", "a")
    with places.in_cluster(cluster, lambda count: [part(number) for number in range(count + 1)]) as fleet:
        told = fleet.figures()
        assert {number: (where, each.plcs) for number, (where, each) in told.items()} == {0: ("a", 7), 1: ("b", 8), 2: ("a", 9)}
        fleet.stop()
        del cluster.workers["a"]
        after = {number: (each.state, each.message) for number, (_, each) in fleet.figures().items()}
        assert after == {0: (FAILED, "its worker has gone away"), 1: (RUNNING, ""), 2: (OVER, "")}
        cluster.is_there = False
        assert fleet.figures()[1][1].message == places.SCHEDULER_GONE
        cluster.is_there = True
    assert parts.ended == 1, "that of the worker that is there"


def test_a_part_takes_all_that_it_is_told_and_waits_once(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(GO_ON, GO_ON)
    told = shard._Told(line)
    told.listen()
    assert (told(), line.waits) == (False, [0.0, 0.0, 0.0])
    line.coming, line.waits = [GO_ON, STOP, GO_ON], []
    told.listen(1.0)
    assert (told(), line.waits) == (True, [1.0, 0.0, 0.0, 0.0])
    gone = shard._Told(Line(EOFError()))
    gone.listen()
    assert gone()
    monkeypatch.setattr(shard, "UNHEARD_NS", -1)
    unheard = shard._Told(Line())
    unheard.listen()
    assert unheard()
