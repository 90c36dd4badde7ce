"""Another future of a run in virtual time: new PLCs do the past again, with all that was done to them, up to a scan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fbvm.live.plcs import LivePlc
from fbvm.live.workbench import Order, Workbench
from fbvm.run.running import Running

REPEATED = frozenset(("write", "force", "release", "mode", "start", "cable", "fault", "mend"))
"""Actions that are inputs of PLCs, and are done again."""


@dataclass(frozen=True)
class Future:
    """PLCs as they went on before somebody began another future, by their names; they run no more."""

    name: str
    plcs: dict[str, LivePlc]


def run_again(bench: Workbench, runs: Sequence[Running], orders: Sequence[Order], plc: str, scans: int) -> None:
    """Executes new PLCs until one of them has done so many scans, and does what `orders` say before the same scans as then."""
    waiting = [order for order in orders if order.scans[plc] <= scans]
    for run in runs:
        run.begin(0)
    while True:
        while waiting and all(live.plc.scans >= waiting[0].scans[name] for name, live in bench.plcs.items()):
            order = waiting.pop(0)
            bench.do(order.action, order.fields)
        if bench.plcs[plc].plc.scans >= scans:
            return
        left = [run for run in runs if not run.reason]
        if not left:
            return
        if len(runs) == 1 and not runs[0].writes:
            next_stop = min([scans, *(order.scans[plc] for order in waiting[:1])])
            runs[0].plc.run(scans=next_stop - runs[0].plc.scans)
            continue
        due_ns = min(run.due_ns for run in left)
        for run in left:
            if run.due_ns == due_ns:
                run.scan(due_ns)
