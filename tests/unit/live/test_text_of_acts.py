"""The test that a page writes of what was done by hand, word for word; and where a scan stands, as pages show it."""

from __future__ import annotations

import logging
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.live.connection import Connection
from fbvm.live.futures import run_again
from fbvm.live.guard import Guard
from fbvm.live.plcs import LivePlc
from fbvm.live.pytest_text import DOCSTRING, pytest_text
from fbvm.live.stops import halt_row
from fbvm.live.workbench import Act, Order
from fbvm.machine.plc import Plc
from fbvm.net.faults import Fault
from fbvm.run.running import Running
from fbvm.wire.link import Peer

RUN = "def test_what_was_done_by_hand():\n    image = compile_files(['a.st', 'b.st'], program='Main', runnable=True).image\n" \
      "    plc = Plc(image, cycle_ns=10_000_000)\n"


def live(scans: int) -> LivePlc:
    image = compile_text("PROGRAM Main VAR n : INT; r : REAL; END_VAR n := n + 1; END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    plc.run(scans=scans)
    return cast(LivePlc, SimpleNamespace(name="plc", plc=plc))


def written(acts: list[Act], scans: int, seen: tuple[str, ...] = (), **more: Any) -> str:
    found = live(scans)
    return pytest_text(acts, found, [(found, name) for name in seen], [Path("a.st"), Path("b.st")], "Main", **more)


def act(scan: int, what: str, name: str = "", value: object = None, plc: str = "plc", text: str = "") -> Act:
    return Act(plc, scan, 0, what, text, name, value)


@each_of("acts, scans, seen, names, body", [
    ([], 0, (), "Plc, compile_files", ["assert plc.scans == 0 and plc.trap is None"]),
    ([], 3, ("Main.n",), "Plc, compile_files", ["plc.run(scans=3)", "assert plc.read('Main.n') == 3"]),
    ([act(0, "write", "Main.n", 5), act(1, "force", "Main.n", 7), act(1, "keep", "Main.r", float("nan")),
      act(4, "release", "Main.n"), act(4, "release")], 4, (), "Plc, compile_files",
     ["plc.write('Main.n', 5)", "plc.run(scans=1)", "plc.force('Main.n', 7)", "plc.write('Main.r', float('nan'))",
      "plc.run(scans=3)", "plc.unforce('Main.n')", "plc.unforce()", "assert plc.scans == 4 and plc.trap is None"]),
    ([act(2, "mode", value="PROGRAM"), act(2, "start", value="cold"), act(2, "write", "x", 1, "other")], 3, (),
     "Mode, Plc, compile_files",
     ["plc.run(scans=2)", "plc.mode = Mode('PROGRAM')", "plc.cold_start()", "plc.run(scans=1)",
      "assert plc.scans == 3 and plc.trap is None"]),
    ([act(1, "step", text="a step\nmore"), act(1, "odd")], 1, (), "Plc, compile_files",
     ["plc.run(scans=1)", "# not repeated: a step", "# not repeated: odd", "assert plc.scans == 1 and plc.trap is None"]),
])
def test_acts_become_statements(acts: list[Act], scans: int, seen: tuple[str, ...], names: str, body: list[str]) -> None:
    assert written(acts, scans, seen) == f"{DOCSTRING}\n\nfrom fbvm import {names}\n\n\n{RUN}" + "".join(
        f"    {line}\n" for line in body)


@each_of("row, names, line", [
    (Fault(silent=True), "Plc, compile_files", "network.faults.append(Fault(silent=True))"),
    (Fault(peer=Peer("10.0.0.1", 502), latency_ns=5), "Peer, Plc, compile_files",
     "network.faults.append(Fault(peer=Peer('10.0.0.1', 502), latency_ns=5))"),
    (None, "Plc, compile_files", "network.faults.clear()"), (2, "Plc, compile_files", "del network.faults[2]"),
])
def test_faults_become_rows_of_the_network(row: object, names: str, line: str) -> None:
    text = written([act(0, "fault" if isinstance(row, Fault) else "mend", value=row)], 0)
    has_row = "from fbvm.net.faults import Fault\n" * isinstance(row, Fault)
    assert text.startswith(f"{DOCSTRING}\n\nfrom fbvm import {names}\n{has_row}\n\n") and f"\n    {line}\n" in text


@each_of("site, base, shown", [
    (SimpleNamespace(file="a.st", line=7), 3, {"file": "a.st", "line": 7, "instance": "Main.t"}),
    (None, 0, {"file": "", "line": 0, "instance": ""}),
])
def test_where_a_scan_stands(site: object, base: int, shown: dict[str, object]) -> None:
    found = cast(LivePlc, SimpleNamespace(names=SimpleNamespace(instance=lambda at: "Main.t" if at == 3 else "wrong")))
    rows = [SimpleNamespace(kind="line"), SimpleNamespace(kind="statement"), SimpleNamespace(kind="change")]
    halt = SimpleNamespace(frames=[SimpleNamespace(base=base, pou="T")], site=site, scan=5, reasons=("one", "two", "three"),
                           breakpoints=rows)  # fmt: skip
    assert halt_row(found, cast(Any, halt)) == {"scan": 5, "pou": "T", "why": "one; three", **shown}


def test_what_browsers_do_wrong_is_not_logged() -> None:
    told: list[logging.LogRecord] = []
    listener, root = logging.Handler(), logging.getLogger()
    listener.emit = told.append  # type: ignore[method-assign]
    level, _ = root.level, root.addHandler(listener)
    root.setLevel(logging.DEBUG)
    try:
        connection = Connection(Guard(8000))
        connection.receive(b"nonsense\r\n\r\n")
    finally:
        root.removeHandler(listener)
        root.setLevel(level)
    assert connection.ends and told == []


def test_all_plcs_do_the_past_again_in_the_order_of_their_times() -> None:
    """With what was done before the same scans as then; a single PLC does its scans at once."""
    for cycles, ends in (((10_000_000, 20_000_000), [6, 3]), ((10_000_000,), [6])):
        image = compile_text("PROGRAM Main VAR n, m : INT; END_VAR n := n + 1; END_PROGRAM").image
        assert image is not None
        plcs = [Plc(image, cycle_ns) for cycle_ns in cycles]
        done: list[tuple[str, list[int]]] = []

        def do(action: str, fields: object, done: list[tuple[str, list[int]]] = done, plcs: list[Plc] = plcs) -> None:
            done.append((action, [plc.scans for plc in plcs]))

        bench = SimpleNamespace(plcs={name: SimpleNamespace(plc=plc) for name, plc in zip("ab", plcs, strict=False)}, do=do)
        orders = [Order("early", {}, {"a": 0, "b": 0}), Order("then", {}, {"a": 4, "b": 2}), Order("late", {}, {"a": 7, "b": 4})]
        run_again(cast(Any, bench), [Running(plc, scans=1000) for plc in plcs], orders, "a", 6)
        assert [plc.scans for plc in plcs] == ends
        assert done == [("early", [0] * len(plcs)), ("then", [4, 2][:len(plcs)])]
