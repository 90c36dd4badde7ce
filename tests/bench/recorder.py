"""The price of recording, by depth: processor time a scan, and bytes a scan on disk.  Prints, and gates nothing.

    python tests/bench/recorder.py [SCANS]
"""

from __future__ import annotations

import io
import sys
import time
from pathlib import Path

from fbvm.cli.demo import SIGNALS
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.plc import Plc
from fbvm.record.recorder import Recorder
from fbvm.record.trace import Trace
from fbvm.record.trace_writer import Depth, TraceWriter
from fbvm.units.etn21 import Etn21
from fbvm.wire.link import Peer

HERE = Path(__file__).parent
PROGRAMS = {"demo": HERE.parents[1] / "examples" / "demo.st", "100 rungs": HERE / "programs" / "logic.st",
            "PID": HERE / "programs" / "pid.st"}  # fmt: skip
MINUTES_10 = 60_000
"""Scans of ten minutes at 10 ms."""


def plc_of(image: Image, engine: str = "auto") -> Plc:
    plc = Plc(image, engine=engine)
    network = LoopNetwork()
    network.place(Peer("192.168.250.1", 502), ModbusPeer())
    plc.attach(Etn21(0, "192.168.250.21"), network)
    return plc


def seconds(plc: Plc, scans: int) -> float:
    start = time.process_time()
    plc.run(scans=scans)
    return time.process_time() - start


def row(name: str, what: str, scans: int, taken: float, size_bytes: int = 0) -> None:
    size = f"{size_bytes / scans:10.1f} bytes/scan" if size_bytes else ""
    print(f"{name:10} {what:24} {taken / scans * 1e6:9.1f} us/scan {size}")


def bench(name: str, image: Image, scans: int) -> None:
    for engine in ("python", "auto"):
        row(name, f"off ({engine})", scans, seconds(plc_of(image, engine), scans))
    if name == "demo":
        plc = plc_of(image)
        Recorder(plc, SIGNALS)
        row(name, "recorder of 12 signals", scans, seconds(plc, scans))
    for depth, patterns in ((Depth.SCANS, ()), (Depth.SCANS, ("D200..D299",)), (Depth.WRITES, ()), (Depth.STATEMENTS, ())):
        plc, file = plc_of(image), io.BytesIO()
        writer = TraceWriter(plc, file, depth, patterns)
        taken = seconds(plc, scans)
        writer.close()
        row(name, f"{depth.value}{' of 100 words' if patterns else ''}", scans, taken, writer.size_bytes)


def ten_minutes(image: Image) -> None:
    plc, file = plc_of(image), io.BytesIO()
    writer = TraceWriter(plc, file)
    taken = seconds(plc, MINUTES_10)
    writer.close()
    print(f"\n10 virtual minutes of the demo, recorded at scan depth: {taken:.1f} s, {writer.size_bytes / 1024:.0f} KiB")
    start = time.process_time()
    moment = Trace(io.BytesIO(file.getvalue())).at(MINUTES_10 - 1)
    print(f"the last scan found and read: {(time.process_time() - start) * 1e3:.1f} ms, scan {moment.scans}")


def main() -> None:
    scans = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    for name, path in PROGRAMS.items():
        image = compile_files([path], runnable=True).image
        assert image is not None, name
        bench(name, image, scans)
        if name == "demo":
            ten_minutes(image)
            print()


if __name__ == "__main__":
    main()
