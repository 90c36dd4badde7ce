"""Prints what many virtual PLCs cost: python tests/bench/many.py [COUNT...].  Gates nothing.

Each PLC runs the hundred rungs of `logic`, or a few lines with a timer that waits, at a cycle of 100 ms in real time, with an
ETN21 that has nothing to do, as `fbvm run` does it: spread over the cycle in steps of 1 ms.  What it costs is the machine
around the program: the loop, its queue and measurements, and one call of machine code for times, clock pulses, program and the
unit's switches.  One PLC alone takes 4 us a scan that way, half of it in the loop; among thousands a scan takes several times
that, since whatever it touches (a dozen Python objects, five pages of the PLC's own) has left the processor's caches since the
scan before.  The limit is the program alone, called from Python (the column `alone`, some hundred times less), and a core: when
COUNT scans take 100 ms it is full, and scans begin late: at 10 to 20 us a scan with 5,000 to 10,000 PLCs.  A busy host makes
scans late before that.
In `event` pace a PLC that has nothing to do is not scanned before its period ends, here after 10 s; its timer wakes it once a
second.  Memory has the interpreter's and LLVM's share in it, divided by COUNT."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm import Etn21, Plc, TcpNetwork, compile_files, compile_text  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.machine.scan_times import Lateness  # noqa: E402
from fbvm.run import Running, run_all  # noqa: E402

BENCH = Path(__file__).resolve().parent
MS = 1_000_000
COUNTS = (1_000, 10_000)
RUN_MS = 5_000
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


def resident_kib() -> int:
    """Memory of the process; 0 where the host has no /proc."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024 if statm.exists() else 0


def image_of(name: str) -> Image:
    compilation = compile_text(TIMER) if name == "timer" else compile_files([BENCH / "programs" / "logic.st"])
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
    image, network, before_kib = image_of(name), TcpNetwork(), resident_kib()
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
    print(f"{name:<7}{pace:<8}{count:>7,}{made_us:>9,.0f}{kib:>8,.1f}{used / passed * 100:>8.1f}{scans / passed:>11,.0f}"
          f"{each:>9,.1f}{alone_us(plcs[0]):>8.2f}"
          f"{late.within_ns(0.99) / 1e6:>10,.1f}{late.missed:>9,}",
          flush=True)  # fmt: skip
    network.close()


def main() -> None:
    if len(sys.argv) == 5:
        measure(sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
        return
    counts = [int(word) for word in sys.argv[1:]] or COUNTS
    print(f"Python {sys.version.split()[0]} on {sys.platform}; {RUN_MS // 1000} s of real time")
    print(f"{'':<15}{'PLCs':>7}{'us to':>9}{'KiB':>8}{'% of a':>8}{'scans':>11}{'us a':>9}{'alone':>8}{'99 % late':>10}"
          f"{'periods':>9}")
    print(f"{'':<15}{'':>7}{'make':>9}{'each':>8}{'core':>8}{'a second':>11}{'scan':>9}{'us':>8}{'ms':>10}{'missed':>9}",
          flush=True)
    for count in counts:
        for row in (("timer", count, "cyclic", 100), ("logic", count, "cyclic", 100), ("timer", count, "event", 10_000)):
            subprocess.run([sys.executable, __file__, *map(str, row)], check=True)  # with a heap of its own


if __name__ == "__main__":
    main()
