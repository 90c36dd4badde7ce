"""How many runs a second a campaign executes: python tests/bench/campaigns.py [RUNS].

The client of examples/demo.st under two network faults and a power cut a run, two seconds of virtual time each: in one process,
in two, and by two Dask workers of this machine; and whether all came to the same results.

Beside the rate stands the processor time of a run, by whoever executes it, and in this process, which hands out and collects:
on a machine that does nothing else the rate of N processes is N over their sum.  To start two Dask workers takes seconds, which
the rate leaves out, and which many runs pay for."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.campaign.execution import Result  # noqa: E402
from fbvm.campaign.executors import ByWorkers, Executor, InThisProcess, in_processes  # noqa: E402
from fbvm.campaign.plan_file import Written, any_cuts, any_faults, with_about  # noqa: E402
from fbvm.campaign.planning import images_of, plan_of, program_project  # noqa: E402
from fbvm.campaign.runs import Outcome, conduct  # noqa: E402
from fbvm.campaign.work import Bench  # noqa: E402
from fbvm.wire.link import Peer  # noqa: E402

RUNS, WORKERS = 10_000, 2
RUN_NS = 2_000_000_000


def demo(runs: int) -> Bench:
    """The campaign."""
    about = {"for": RUN_NS, "runs": runs, "never": ("Main.Done AND Main.Written <> Main.Quantity",),
             "servers": (Peer("192.168.250.1", 502),)}  # fmt: skip
    written = replace(with_about(Written(), **about), faults=(any_faults(2, RUN_NS),), cuts=(any_cuts(1, RUN_NS),))
    project = program_project([HOUSE / "examples" / "demo.st"], written.about, HOUSE)
    images, _ = images_of(project)
    return Bench.of(plan_of(written, project, images), images)


def processor_s() -> tuple[float, float]:
    """Seconds of processor time: of this process, and of those that it has started and that are over."""
    used = os.times()
    return used.user + used.system, used.children_user + used.children_system


def conducted(bench: Bench, executor: Executor, jobs: int) -> tuple[float, float, Outcome]:
    """Runs a second once all is started, seconds to start it, and what came of it.

    The first two runs are done by this process, before others are started: the rate is that from the first result that the
    executor gives to the last one.  Where all come at once, it is that with the start."""
    outcome, taken = Outcome(bench.plan), list[tuple[float, int]]()

    def take(results: Sequence[Result]) -> None:
        outcome.add(results)
        taken.append((time.monotonic(), len(outcome.results)))

    conduct(bench, outcome, jobs, take, executor, shrinks=False)
    (begun, known), (started, before), (ended, count) = taken[1], taken[2], taken[-1]
    rate = (count - before) / (ended - started) if count > before else (count - known) / (ended - begun)
    return rate, started - begun, outcome


def row(what: str, ours: str, besides: str = "") -> None:
    print(f"{what:<58} {ours:>16}   {besides}", flush=True)


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    bench = demo(runs)
    ways: dict[str, tuple[Executor, int]] = {
        "one process": (InThisProcess(bench), 1), f"{WORKERS} processes": (in_processes(bench, WORKERS), WORKERS)}  # fmt: skip
    if find_spec("distributed") is not None:
        from fbvm.campaign.cluster import LOCAL, Cluster

        ways[f"{WORKERS} Dask workers"] = ByWorkers(Cluster(bench, LOCAL, WORKERS)), WORKERS
    first: list[Result] = []
    alone = 0.0
    for name, (executor, jobs) in ways.items():
        before = processor_s()
        rate, start_s, outcome = conducted(bench, executor, jobs)
        here, there = (1000 * (now - then) / runs for now, then in zip(processor_s(), before, strict=True))
        alone = alone or rate
        first = first or outcome.rows
        row(f"{runs:,} runs by {name}", f"{rate:.0f} a second", f"{rate / alone:.2f} times one process, first result after "
            f"{start_s:.1f} s; processor time of a run, with the start, {there:.2f} ms there, {here:.2f} ms here")  # fmt: skip
        assert outcome.rows == first, f"{name} came to other results"
    row("  scans in all, all ways with the same results", f"{sum(result.scans for result in first):,}")


if __name__ == "__main__":
    main()
