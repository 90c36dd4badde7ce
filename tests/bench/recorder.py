"""The price of looking inside scans: python tests/bench/recorder.py [SCANS].

One program of 100 lines (programs/lines100.st), 10,000 scans of 10 ms unless another number is given.  Prints each figure
beside its limit, in processor time, with the ratios that the limits speak of; gates nothing.  The scan is timed without a
recorder, the best of some runs; what recording adds is a recorded run less a plain one, which take turns
every few scans: the speed of a machine changes from second to second."""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.code.compiler import compile_files, compile_text  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.engine.native.engine import NativeEngine  # noqa: E402
from fbvm.machine.counting import counting  # noqa: E402
from fbvm.machine.plc import Phase, Plc  # noqa: E402
from fbvm.machine.power import powering  # noqa: E402
from fbvm.record.page.data import page_data  # noqa: E402
from fbvm.record.page.page import page  # noqa: E402
from fbvm.record.recording.file_reader import RecordingFile  # noqa: E402
from fbvm.record.recording.file_writer import Described, RecordingWriter  # noqa: E402
from fbvm.record.recording.program_text import ProgramText  # noqa: E402
from fbvm.record.recording.recording import Recording  # noqa: E402
from fbvm.record.recording.scans import RecordedScans  # noqa: E402
from fbvm.record.trace.events import Event  # noqa: E402
from fbvm.record.trace.observing import observing  # noqa: E402
from fbvm.record.trace.writer import source_lines  # noqa: E402

PROGRAM = Path(__file__).parent / "programs" / "lines100.st"
SCANS = 10_000
WARM = 100
"""Scans before the clock starts."""
LONGEST_BUILD_S = 120
NATIVE_SCANS, PYTHON_SCANS, OBSERVED_SCANS, TIMES = 20_000, 500, 100, 5
POWER_SCANS, POWER_TIMES = 100_000, 20
LEAST_SCANS = 200
TURNS = 20
"""So many pieces the scans have that two PLCs do in turn."""
RUNGS = 100


class Listener:
    """Receives each event, and counts."""

    events = 0

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Does nothing."""

    def event(self, plc: Plc, event: Event) -> None:
        """Counts."""
        self.events += 1


def seconds(work: Callable[[], object]) -> float:
    """Processor time."""
    start = time.process_time()
    work()
    return time.process_time() - start


def in_turns(plcs: Sequence[Plc], scans: int, turns: int = TURNS) -> list[float]:
    """Runs PLCs, each for so many scans: a piece of each in turn.  Returns how many seconds each of them took."""
    took = [0.0] * len(plcs)
    for turn in range(turns):
        piece = scans * (turn + 1) // turns - scans * turn // turns
        for number, plc in enumerate(plcs):
            took[number] += seconds(lambda plc=plc, piece=piece: plc.run(scans=piece))
    return took


def scan_us(plc: Plc, scans: int) -> float:
    """Microseconds a scan, the best of some runs; of machine code, those of the optimised build."""
    return scans_us([plc], scans, TIMES)[0]


def scans_us(plcs: list[Plc], scans: int, times: int) -> list[float]:
    """The same of several PLCs that take turns, so that all meet the same machine: its speed changes from second to second."""
    for plc in plcs:
        plc.run(scans=WARM)
        optimised(plc)
    took = [[seconds(lambda plc=plc: plc.run(scans=scans)) for plc in plcs] for _ in range(times)]
    return [min(row[number] for row in took) / scans * 1e6 for number in range(len(plcs))]


def optimised(plc: Plc) -> None:
    """Waits for the optimised build, if machine code runs: it is made beside the run and takes some seconds."""
    end = time.monotonic() + LONGEST_BUILD_S
    while isinstance(plc.engine, NativeEngine) and not plc.engine.optimised:
        assert time.monotonic() < end, "the optimised build is not ready yet"
        time.sleep(0.05)


def ladder(rungs: int) -> str:
    """A program of so many rungs: a self-hold with two conditions, and the timer that it starts."""
    made = ["PROGRAM Main", "VAR", *(f"    t{n} : TON; run{n} : BOOL;" for n in range(rungs)), "END_VAR"]
    for n in range(rungs):
        made += ["LADDER", f"    LD W{n}.00", f"    OR run{n}", f"    ANDNOT W{n}.01", f"    AND W{n}.02", f"    OUT run{n}",
                 "END_LADDER", f"    t{n}(IN := run{n}, PT := T#50ms);"]  # fmt: skip
    return "\n".join([*made, "END_PROGRAM", ""])


def power_us() -> None:
    """What it costs to note the power in the rungs of a ladder program."""
    image = compile_text(ladder(RUNGS)).image
    assert image is not None
    plain, noting = (Plc(image, engine="native") for _ in range(2))
    for plc in (plain, noting):
        for n in range(RUNGS):
            plc.write(f"W{n}", [0, 1, 4, 5][n % 4])
    with powering(noting):
        without, noted = scans_us([plain, noting], POWER_SCANS, POWER_TIMES)
    row(f"a scan of {RUNGS} rungs, native", f"{without:.2f} us")
    row("  the same with power noted", f"{noted:.2f} us")
    row("  with power / without", f"{noted / without:.2f}", "<= 1.3")


def scan_counted_us(image: Image, engine: str) -> float:
    plc = Plc(image, engine=engine)
    with counting(plc, {site.file for site in image.sites if site.pou == "Main"}):  # as coverage does: no libraries
        return scan_us(plc, NATIVE_SCANS if engine == "native" else PYTHON_SCANS)


def row(what: str, ours: str, limit: str = "") -> None:
    print(f"{what:<58} {ours:>16}   {limit}", flush=True)


def scans_of_each_build(image: Image) -> None:
    native = scan_us(Plc(image, engine="native"), NATIVE_SCANS)
    python = scan_us(Plc(image, engine="python"), PYTHON_SCANS)
    observed = scan_us(Plc(image, observed=True), OBSERVED_SCANS)
    row("a scan, native", f"{native:.2f} us")
    row("a scan, python", f"{python:.1f} us")
    row("a scan, observed", f"{observed:.1f} us")
    row("  observed / python", f"{observed / python:.1f}", "<= 4")
    counted_native, counted_python = (scan_counted_us(image, engine) for engine in ("native", "python"))
    row("a scan that counts statements and ways, native", f"{counted_native:.2f} us")
    row("  counted / native", f"{counted_native / native:.2f}", "<= 1.3")
    row("  counted / python, both in Python", f"{counted_python / python:.2f}")
    plc, told = Plc(image, engine="python"), Listener()
    with observing(plc, told):
        listened = scan_us(plc, OBSERVED_SCANS)
    row("a scan with a listener that is told every event", f"{listened:.1f} us")
    row("  events a scan; listener / python", f"{told.events / plc.scans:.0f}; {listened / python:.1f}")


def paged(image: Image, scans: int) -> None:
    """A page of a run that was recorded in memory."""
    plc, text = Plc(image), ""
    recorded = Recording().add("lines100", plc)
    plc.run(scans=scans)
    lines = source_lines(image, {"lines100.st": PROGRAM.read_text(encoding="utf-8")})

    def make() -> None:
        nonlocal text
        data = page_data(RecordedScans(recorded, lines), title="lines100")
        windows = ", ".join(f"{first} to {last}" for first, last in data.head["windows"])
        row("  scans of which it has each statement", windows)
        text = page(data)

    row(f"a page of {scans} scans, made in", f"{seconds(make):.1f} s", f"<= {max(1, scans / SCANS) * 2:.2g} s")
    row("  size", f"{len(text) / 1e6:.2f} MB", "<= 3 MB")
    opening(text)


def shown(image: Image, scans: int) -> None:
    """One scan in the middle of a run, done again with a listener that is told every event."""
    plc = Plc(image)
    recorded = Recording().add("lines100", plc)
    plc.run(scans=scans)
    middle = scans // 2
    taken = seconds(lambda: recorded.follow(Listener(), range(middle, middle + 1)))
    row("a scan shown at statement depth", f"{taken * 1e3:.1f} ms", "<= 50 ms")


def in_a_file(image: Image, scans: int) -> None:
    """A run that is recorded into a file, the same at any depth: its price, its size, and scans that are shown from there."""
    text = ProgramText(((str(PROGRAM), PROGRAM.read_text(encoding="utf-8")),))
    for engine in ("native", "python"):
        plcs = [Plc(image, engine=engine) for _ in range(4)]
        plcs[0].run(scans=WARM)
        files = [io.BytesIO(), io.BytesIO()]
        in_memory = Recording()
        recordings = [*(Recording(file=RecordingWriter(file, verify=file is files[1])) for file in files), in_memory]
        begun = [seconds(lambda plc=plc, recording=recording: recording.add("lines100", plc, Described(text)))
                 for plc, recording in zip(plcs[1:], recordings, strict=True)]  # fmt: skip
        plain, *took = in_turns(plcs, scans)
        added = [begun[number] + took[number] - plain + seconds(recording.close) for number, recording in enumerate(recordings)]
        row(f"{scans} scans, {engine}", f"{plain:.3f} s")
        for said, number in (("", 0), (", fingerprint at every scan", 1)):
            row(f"added by a file of {scans} scans, {engine}{said}", f"{added[number]:.3f} s",
                "" if number else f"<= {0.3 * scans / SCANS:.2g} s")  # fmt: skip
            row("  size", f"{len(files[number].getvalue()) / 1e6:.3f} MB", f"<= {1 + 20e-6 * scans:.2f} MB")
        row(f"added by {scans} scans in memory, {engine}", f"{added[2]:.3f} s", f"<= {0.3 * scans / SCANS:.2g} s")
        row("  size", f"{in_memory.size_bytes / 1e6:.2f} MB", f"<= {1 + 20e-6 * scans:.2f} MB")
        recorded = RecordingFile(io.BytesIO(files[1].getvalue()))["lines100"]
        opened = seconds(lambda recorded=recorded: recorded.follow(Listener(), range(1)))
        row(f"the first scan shown from the file, {engine}", f"{opened * 1e3:.0f} ms", "with compiling the program")
        wanted = range(scans // 7, scans, max(1, scans // 97))
        took = [seconds(lambda recorded=recorded, scan=scan: recorded.follow(Listener(), range(scan, scan + 1)))
                for scan in wanted]  # fmt: skip
        row("  others, anywhere, the slowest", f"{max(took) * 1e3:.1f} ms", "<= 50 ms")


def opening(text: str) -> None:
    """A page, opened by a browser where playwright and one are there."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None or find_spec("playwright") is None:
        row("  opens in", "not measured", "<= 1 s, needs playwright and chromium")
        return
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder) / "run.html"
        path.write_text(text, encoding="utf-8")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        there = browser.new_page(viewport={"width": 1300, "height": 850})
        protocol = there.context.new_cdp_session(there)
        protocol.send("Performance.enable")
        begun = time.monotonic()
        there.goto(path.as_uri())
        there.wait_for_function("document.getElementById('where').textContent.startsWith('scan')")
        opened = time.monotonic()
        worked = {row["name"]: row["value"] for row in protocol.send("Performance.getMetrics")["metrics"]}
        for _ in range(100):
            there.keyboard.press("ArrowRight")
        there.wait_for_function("document.getElementById('where').textContent.startsWith('scan 100,')")
        row("  opens in, on a quiet machine", f"{opened - begun:.2f} s", "<= 1 s")
        row("  of these, work of the process of the page", f"{worked['ProcessTime']:.2f} s")
        row("  a step of the cursor", f"{(time.monotonic() - opened) * 10:.1f} ms")
        browser.close()


def main() -> None:
    scans = max(LEAST_SCANS, int(sys.argv[1])) if len(sys.argv) > 1 else SCANS
    image = compile_files([PROGRAM], runnable=True).image
    assert image is not None
    scans_of_each_build(image)
    power_us()
    shown(image, LEAST_SCANS)
    in_a_file(image, scans)
    paged(image, scans)


if __name__ == "__main__":
    main()
