"""New PLCs that do again what others did: orders in front of the same scans, PLCs in the order of their times, up to a scan."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from rows import each_of

from fbvm.live.futures import Order, run_again


class Rig:
    """PLCs by name, with a cycle and a last scan each, and a log of what is done."""

    def __init__(self, **cycles: int) -> None:
        self.log: list[str] = []
        self.plcs = {name: self._plc(name) for name in cycles}
        self.runs: list[Any] = [self._run(name, cycle) for name, cycle in cycles.items()]
        self.bench: Any = SimpleNamespace(
            plcs={name: SimpleNamespace(plc=plc) for name, plc in self.plcs.items()},
            do=lambda action, fields: self.log.append(f"{action} {fields}"))

    def _plc(self, name: str) -> Any:
        made = SimpleNamespace(scans=0)

        def run(scans: int) -> None:
            self.log.append(f"{name} runs {scans}")
            made.scans += scans

        made.run = run
        return made

    def _run(self, name: str, cycle: int) -> Any:
        made = SimpleNamespace(plc=self.plcs[name], reason="", writes=[], due_ns=0, last=99, begun=[])

        def scan(now_ns: int) -> None:
            self.log.append(f"{name} at {now_ns}")
            made.plc.scans += 1
            made.due_ns += cycle
            made.reason = "scans" if made.plc.scans >= made.last else ""

        made.scan, made.begin = scan, made.begun.append
        return made


def order(what: str, **scans: int) -> Order:
    return Order(what, {}, scans)


@each_of(("orders", "scans", "log"), [
    ([], 5, ["a runs 5"]), ([order("write", a=2)], 5, ["a runs 2", "write {}", "a runs 3"]),
    ([order("write", a=0), order("force", a=0), order("mode", a=5)], 5, ["write {}", "force {}", "a runs 5", "mode {}"]),
    ([order("write", a=6)], 5, ["a runs 5"]), ([order("write", a=0)], 0, ["write {}"]),
])  # fmt: skip
def test_one_plc_runs_at_once_from_order_to_order(orders: list[Order], scans: int, log: list[str]) -> None:
    rig = Rig(a=10)
    run_again(rig.bench, rig.runs, orders, "a", scans)
    assert rig.log == log and rig.runs[0].begun == [0]


def test_timed_writes_of_one_plc_are_met_scan_by_scan() -> None:
    rig = Rig(a=10)
    rig.runs[0].writes = ["something"]
    run_again(rig.bench, rig.runs, [order("write", a=1)], "a", 3)
    assert rig.log == ["a at 0", "write {}", "a at 10", "a at 20"]


def test_several_plcs_scan_in_the_order_of_their_times_and_orders_wait_for_all_of_them() -> None:
    rig = Rig(a=10, b=25)
    run_again(rig.bench, rig.runs, [order("write", a=1, b=2), order("mode", a=4, b=2)], "a", 5)
    assert rig.log == ["a at 0", "b at 0", "a at 10", "a at 20", "b at 25", "write {}", "a at 30", "mode {}", "a at 40"]


def test_nothing_is_done_again_where_all_have_ended() -> None:
    rig = Rig(a=10, b=10)
    rig.runs[0].last = rig.runs[1].last = 2
    run_again(rig.bench, rig.runs, [], "a", 5)
    assert rig.log == ["a at 0", "b at 0", "a at 10", "b at 10"]
    rig = Rig(a=10, b=10)
    rig.runs[1].last = 1
    run_again(rig.bench, rig.runs, [], "a", 3)
    assert rig.log == ["a at 0", "b at 0", "a at 10", "a at 20"], "who has ended scans no more"
