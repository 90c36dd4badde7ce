"""A page of a long run: python tests/bench/pages.py [SCANS].

A program with a counter, a wave, a bit and a timer runs so many scans, a million unless another number is given, and is shown
on a page; a browser opens it where playwright and one are there.  Prints how long making and opening take, how large the page
is, and how long a picture takes while the chart is moved, from all scans in view down to a few; gates nothing."""

from __future__ import annotations

import resource
import shutil
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.code.compiler import compile_text  # noqa: E402
from fbvm.machine.plc import Plc  # noqa: E402
from fbvm.record.page.data import page_data  # noqa: E402
from fbvm.record.page.page import page  # noqa: E402
from fbvm.record.recording.recording import Recording  # noqa: E402
from fbvm.record.recording.scans import RecordedScans  # noqa: E402

PROGRAM = """
PROGRAM Main
VAR count : DINT; phase : LREAL; wave : REAL; high : BOOL; delay : TON; text : STRING[20]; END_VAR
    count := count + 1;
    phase := phase + 0.001;
    wave := LREAL_TO_REAL(SIN(phase) * 100.0 + SIN(phase * 37.0));
    high := wave > 60.0;
    delay(IN := high, PT := T#2s);
    IF count MOD 1000 = 0 THEN text := CONCAT('thousand ', DINT_TO_STRING(count / 1000)); END_IF
END_PROGRAM
"""
NAMES = ["Main.count", "Main.wave", "Main.high", "Main.delay.Q", "Main.delay.ET", "Main.text"]
SCANS = 1_000_000
PICTURES = 60
MOVE = """async ([span, pictures]) => {
    const run = window.fbvm, times = [];
    run.move({span, start: 0});
    for (let at = 0; at < pictures; at++) {
        run.move({start: at * (run.count - span) / pictures});
        await new Promise(done => requestAnimationFrame(done));
        await new Promise(done => setTimeout(done));
        times.push(run.drawn());
    }
    return times;
}"""


def row(what: str, ours: str, limit: str = "") -> None:
    print(f"{what:<58} {ours:>16}   {limit}", flush=True)


def made(scans: int) -> str:
    image = compile_text(PROGRAM).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("pages", plc)
    plc.run(scans=scans)
    begun = time.process_time()
    text = page(page_data(RecordedScans(recorded, {}), NAMES, title=f"{scans} scans"))
    row(f"a page of {scans} scans of {len(NAMES)} variables, made in", f"{time.process_time() - begun:.1f} s")
    row("  size", f"{len(text) / 1e6:.1f} MB")
    row("  most memory of the process", f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    return text


def shown(path: Path, scans: int) -> None:
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None or find_spec("playwright") is None:
        row("  opens in", "not measured", "needs playwright and chromium")
        return
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        there = browser.new_page(viewport={"width": 1600, "height": 900})
        there.goto(path.as_uri())
        there.wait_for_function("document.getElementById('where').textContent.startsWith('scan')")
        row("  opens in", f"{there.evaluate('window.fbvm.opened') / 1e3:.2f} s", "<= 1 s")
        span = scans
        while span > 100:
            times = sorted(there.evaluate(MOVE, [span, PICTURES]))
            row(f"  a picture with {span} scans in view, median and longest",
                f"{times[len(times) // 2]:.1f} {times[-1]:.1f} ms", "<= 16 ms is smooth")
            span //= 10
        browser.close()


def main() -> None:
    scans = int(sys.argv[1]) if len(sys.argv) > 1 else SCANS
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.html"
        path.write_text(made(scans), encoding="utf-8")
        shown(path, scans)


if __name__ == "__main__":
    main()
