"""Prints how fast things are here: python tests/bench/run.py.  It compares within one run and gates nothing."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm import Etn21, LoopNetwork, ModbusPeer, Peer, Plc, TcpNetwork, compile_files  # noqa: E402
from fbvm.cli.demo import modbus_server  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.run import run  # noqa: E402

DEMO = HOUSE / "examples" / "demo.st"
BENCH = Path(__file__).resolve().parent
SERVER = Peer("192.168.250.1", 502)
SCANS = 20_000
EXCHANGES_S = 3


def best_s(work: Callable[[], object], times: int = 5) -> float:
    """The shortest of several runs, in seconds."""
    taken = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return min(taken)


def show(what: str, value: float, unit: str) -> None:
    print(f"{what:<58}{value:>12,.1f} {unit}", flush=True)


def compiled(path: Path) -> Image:
    compilation = compile_files([path], runnable=True)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def compiling() -> None:
    show("compile examples/demo.st with its libraries", best_s(lambda: compile_files([DEMO])) * 1e3, "ms")
    for path in sorted(BENCH.glob("lines*.st")):
        lines = len(path.read_text(encoding="utf-8").splitlines())
        taken_s = best_s(lambda path=path: compile_files([path]), 2)
        show(f"compile {path.name}", taken_s * 1e3, "ms")
        show(f"  {lines:,} lines", lines / taken_s, "lines/s")
    command = [sys.executable, "-m", "fbvm", "check", str(DEMO)]
    taken = [best_s(lambda: subprocess.run(command, cwd=HOUSE, check=True), 1) for _ in range(7)]
    show("fbvm check examples/demo.st, from start to end (median)", statistics.median(taken) * 1e3, "ms")
    command = [sys.executable, "-c", "pass"]
    show("  of these, Python itself", best_s(lambda: subprocess.run(command, check=True)) * 1e3, "ms")


def scanning() -> None:
    image = compiled(DEMO)
    for observed in (False, True):
        plc = Plc(image, observed=observed)
        network = LoopNetwork()
        network.place(SERVER, ModbusPeer())
        plc.attach(Etn21(0, "192.168.250.21"), network)
        plc.run(until="Main.Done", max_ns=5_000_000_000)
        taken_s = best_s(lambda plc=plc: plc.run(scans=SCANS), 3)
        show(f"demo, connected and idle, {'observed' if observed else 'plain'}", SCANS / taken_s, "scans/s")
        engine = plc.engine
        plc.memory.write(16, "i64", 1 << 60)
        taken_s = best_s(lambda engine=engine: [engine.run(0) for _ in range(SCANS)], 3)
        show("  the program alone", SCANS / taken_s, "runs/s")
    poll = compiled(BENCH / "poll.st")
    plc, network = Plc(poll), LoopNetwork()
    network.place(SERVER, ModbusPeer())
    plc.attach(Etn21(0, "192.168.250.21"), network)
    plc.run(until="Main.Exchanges > 0", max_ns=5_000_000_000)
    taken_s = best_s(lambda: plc.run(scans=SCANS), 1)
    exchanges = int(str(plc.read("Main.Exchanges")))
    show("poll.st in memory", SCANS / taken_s, "scans/s")
    show(f"  with {SCANS / exchanges:.1f} scans an exchange", exchanges / taken_s, "exchanges/s")


def exchanging() -> None:
    from pymodbus.client import ModbusTcpClient

    image = compiled(BENCH / "poll.st")
    with modbus_server() as port:
        network = TcpNetwork({SERVER: ("127.0.0.1", port)})
        try:
            plc = Plc(image)
            plc.attach(Etn21(0, "192.168.250.21"), network)
            run(plc, until="Main.Exchanges > 10", pace="event", max_ns=10_000_000_000)
            before = int(str(plc.read("Main.Exchanges")))
            began = time.perf_counter()
            run(plc, for_ns=EXCHANGES_S * 1_000_000_000, pace="event")
            taken_s = time.perf_counter() - began
            done = int(str(plc.read("Main.Exchanges"))) - before
        finally:
            network.close()
        show("MTCP_ETN_Fn03 over loopback TCP, pace event", done / taken_s, "exchanges/s")
        client = ModbusTcpClient("127.0.0.1", port=port)
        client.connect()
        count, began = 0, time.perf_counter()
        while time.perf_counter() - began < EXCHANGES_S:
            client.read_holding_registers(0, count=10)
            count += 1
        taken_s = time.perf_counter() - began
        show("pymodbus's plain client, the same request and server", count / taken_s, "exchanges/s")
        client.close()


if __name__ == "__main__":
    print(f"Python {sys.version.split()[0]} on {sys.platform}")
    compiling()
    scanning()
    exchanging()
