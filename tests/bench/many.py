"""Prints what many virtual PLCs cost: python tests/bench/many.py [COUNT...].  Gates nothing.

Each PLC runs the hundred rungs of `logic`, or a few lines with a timer that waits, at a cycle of 100 ms in real time, with an
ETN21 that has nothing to do, as `fbvm run` does it: spread over the cycle in steps of 1 ms.  One call of machine code scans all
that are due together (`run/batches.py`): 1 us a scan, most of it waiting for five pages of the PLC's own, which have left the
processor's caches since the scan before; the program alone, called from Python, is the column `alone`.  `polling` reads ten
registers of a server in another process once a second by MTCP_ETN_Fn03: a PLC with an open connection scans by itself, which
takes some 20 us among thousands, since a dozen Python objects have left the caches, too.  A busy host makes scans late before a
core is full.  To make a PLC and to switch it on takes 0.3 ms; they are switched on one after another, which is in the figures.
In `event` pace a PLC that has nothing to do is not scanned before its period ends, here after 10 s; its timer wakes it once a
second.  Memory has the interpreter's and LLVM's share in it, divided by COUNT."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm import Etn21, Peer, Plc, TcpNetwork, compile_files, compile_text  # noqa: E402
from fbvm.cli.running.demo import modbus_server  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.machine.scan_times import Lateness  # noqa: E402
from fbvm.run import Running, run_all  # noqa: E402

BENCH = Path(__file__).resolve().parent
MS = 1_000_000
COUNTS = (1_000, 10_000)
RUN_MS = 5_000
MOST_POLLING = 1_000
"""As many connections, at either end, as one process usually may have."""
SERVER = Peer("192.168.250.1", 502)
TIMER = """
PROGRAM Main
VAR t : TON; n : UDINT; END_VAR
    t(IN := TRUE, PT := T#1s);
    IF t.Q THEN
        n := n + 1;
        t(IN := FALSE);
        t(IN := TRUE);
    END_IF;
END_PROGRAM
"""


POLLING = """
PROGRAM Main
VAR Connection : MTCP_ETN_Connect; Read : MTCP_ETN_Fn03; Second : TON; Seen : UINT; Exchanges : UDINT; END_VAR
    Connection(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    Second(IN := NOT Second.Q, PT := T#900ms);
    Read(EN := Connection.ENO, Register_Address := 0, Register_Qty := 10, RespData_DM := 200, Cmd_Read := Second.Q, SlaveID := 1);
    IF Read.Rcv_Counter <> Seen THEN
        Seen := Read.Rcv_Counter;
        Exchanges := Exchanges + 1;
    END_IF;
END_PROGRAM
"""
TEXTS = {"timer": TIMER, "polling": POLLING}


def resident_kib() -> int:
    """Memory of the process; 0 where the host has no /proc."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024 if statm.exists() else 0


def image_of(name: str) -> Image:
    text = TEXTS.get(name)
    compilation = compile_text(text) if text else compile_files([BENCH / "programs" / f"{name}.st"])
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def alone_us(plc: Plc) -> float:
    """The program of a PLC, called from Python."""
    best, run = 1.0, plc.engine.run
    for _ in range(200):
        began = time.perf_counter()
        run(0)
        best = min(best, time.perf_counter() - began)
    return best * 1e6


def measure(name: str, count: int, pace: str, cycle_ms: int) -> None:
    with ExitStack() as stack:
        reached = {SERVER: ("127.0.0.1", stack.enter_context(modbus_server()))} if name == "polling" else {}
        run_many(name, count, pace, cycle_ms, TcpNetwork(reached))


def run_many(name: str, count: int, pace: str, cycle_ms: int, network: TcpNetwork) -> None:
    image, before_kib = image_of(name), resident_kib()
    began = time.perf_counter()
    plcs = [Plc(image, cycle_ms * MS, engine="native") for _ in range(count)]
    for number, plc in enumerate(plcs):
        plc.attach(Etn21(0, f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}"), network)
    made_us = (time.perf_counter() - began) / count * 1e6
    used, began = time.process_time(), time.perf_counter()
    step_ns = cycle_ms * MS / count
    run_all([Running(plc, for_ns=RUN_MS * MS, pace=pace, phase_ns=int(number * step_ns) // MS * MS)
             for number, plc in enumerate(plcs)])  # fmt: skip
    used, passed = time.process_time() - used, time.perf_counter() - began
    scans, kib = sum(plc.scans for plc in plcs), (resident_kib() - before_kib) / count
    late = Lateness()
    for plc in plcs:
        late.add(plc.lateness)
    each = used / scans * 1e6 if scans else 0.0
    print(f"{name:<8}{pace:<8}{count:>7,}{made_us:>9,.0f}{kib:>8,.1f}{used / passed * 100:>8.1f}{scans / passed:>11,.0f}"
          f"{each:>9,.1f}{alone_us(plcs[0]):>8.2f}"
          f"{late.within_ns(0.99) / 1e6:>10,.1f}{late.missed:>9,}", end="")  # fmt: skip
    if name == "polling":
        asked = sum(int(str(plc.read("Main.Exchanges"))) for plc in plcs)
        print(f"   {asked / passed:,.0f} exchanges/s", end="")
    print(flush=True)
    network.close()


def main() -> None:
    if len(sys.argv) == 5:
        measure(sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
        return
    counts = [int(word) for word in sys.argv[1:]] or COUNTS
    print(f"Python {sys.version.split()[0]} on {sys.platform}; {RUN_MS // 1000} s of real time")
    print(f"{'':<16}{'PLCs':>7}{'us to':>9}{'KiB':>8}{'% of a':>8}{'scans':>11}{'us a':>9}{'alone':>8}{'99 % late':>10}"
          f"{'periods':>9}")
    print(f"{'':<16}{'':>7}{'make':>9}{'each':>8}{'core':>8}{'a second':>11}{'scan':>9}{'us':>8}{'ms':>10}{'missed':>9}",
          flush=True)
    for count in counts:
        for row in (("timer", count, "cyclic", 100), ("logic", count, "cyclic", 100), ("timer", count, "event", 10_000),
                    *([("polling", count, "cyclic", 100)] if count <= MOST_POLLING else [])):  # fmt: skip
            subprocess.run([sys.executable, __file__, *map(str, row)], check=True)  # with a heap of its own


if __name__ == "__main__":
    main()
