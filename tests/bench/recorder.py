"""The price of recording, by depth: python tests/bench/recorder.py [SCANS].  Processor time a scan, and bytes a scan on disk;
prints, and gates nothing.

The limit is the scan without a recorder: as machine code, where only ends of scans are written down, and as the observed
build in Python, where every write or statement is; what is above is looking at values and packing what changed.  `auto` has
the way to machine code in it, which few scans do not pay for."""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.cli.running.demo import SIGNALS  # noqa: E402
from fbvm.code.compiler import compile_files  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.machine.plc import Plc  # noqa: E402
from fbvm.net.loop import LoopNetwork  # noqa: E402
from fbvm.net.peers import ModbusPeer  # noqa: E402
from fbvm.record.page.data import page_data  # noqa: E402
from fbvm.record.page.page import page  # noqa: E402
from fbvm.record.trace.reader import Trace  # noqa: E402
from fbvm.record.trace.recorder import Recorder  # noqa: E402
from fbvm.record.trace.writer import Depth, TraceWriter  # noqa: E402
from fbvm.units.etn21.unit import Etn21  # noqa: E402
from fbvm.wire.link import Peer  # noqa: E402

HERE = Path(__file__).parent
PROGRAMS = {"demo": HOUSE / "examples" / "demo.st", "100 rungs": HERE / "programs" / "logic.st",
            "PID": HERE / "programs" / "pid.st"}  # fmt: skip
SCANS_OF_A_PAGE = 10_000
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


def opening(image: Image) -> None:
    """The page of 10,000 scans: written, and opened by a browser where playwright and one are there."""
    plc, file = plc_of(image), io.BytesIO()
    writer = TraceWriter(plc, file)
    plc.run(scans=SCANS_OF_A_PAGE)
    writer.close()
    start = time.process_time()
    text = page(page_data(Trace(io.BytesIO(file.getvalue())), title="demo"))
    print(f"\npage of {SCANS_OF_A_PAGE} scans: made in {time.process_time() - start:.1f} s, {len(text) / 1024:.0f} KiB")
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None or find_spec("playwright") is None:
        print("opening it was not measured: needs playwright and chromium")
        return
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "run.html"
        path.write_text(text, encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        for name, viewport in (("desktop", {"width": 1300, "height": 850}), ("phone", {"width": 390, "height": 800})):
            shown = browser.new_page(viewport=viewport)
            begun = time.monotonic()
            shown.goto(path.as_uri())
            shown.wait_for_function("document.getElementById('where').textContent.startsWith('scan')")
            opened = time.monotonic()
            for _ in range(100):
                shown.keyboard.press("ArrowRight")
            shown.wait_for_function("document.getElementById('where').textContent.startsWith('scan 100,')")
            step_ms = (time.monotonic() - opened) * 10
            print(f"opened ({name}) in {(opened - begun) * 1e3:.0f} ms; a step of the cursor {step_ms:.1f} ms")
        browser.close()


def main() -> None:
    scans = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    for name, path in PROGRAMS.items():
        image = compile_files([path], runnable=True).image
        assert image is not None, name
        bench(name, image, scans)
        if name == "demo":
            ten_minutes(image)
            opening(image)
            print()


if __name__ == "__main__":
    main()
