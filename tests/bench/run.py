"""Prints how fast things are here: python tests/bench/run.py.  It compares within one run and gates nothing.

What limits each: compiling is Python that goes over each token and each node once (of 5,195 lines half of the time is
parsing, a quarter checking and looking for slips, a sixth lowering).  An idle scan cannot be quicker than the program alone,
which is one call of machine code; `Plc.run` stays inside it while nobody has to be told.  An observed scan is Python that reports
each statement.  An exchange in memory is four scans and as many refreshes of the unit, which are Python.  A warm start cannot be
quicker than the imports and the reading of two files; a cold one also makes the tables of the grammar, once an installation."""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm import Etn21, LoopNetwork, ModbusPeer, Peer, Plc, compile_files  # noqa: E402
from fbvm.code.image import Image  # noqa: E402

DEMO = HOUSE / "examples" / "demo.st"
BENCH = Path(__file__).resolve().parent
SERVER = Peer("192.168.250.1", 502)
SCANS = 20_000


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
    show("compile examples/demo.st with its libraries", best_s(lambda: compile_files([DEMO], cache=False)) * 1e3, "ms")
    for path in sorted(BENCH.glob("lines*.st")):
        lines = len(path.read_text(encoding="utf-8").splitlines())
        taken_s = best_s(lambda path=path: compile_files([path], cache=False), 2)
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


FIRST_SCAN = """
import sys, time
from fbvm import Plc, compile_files
began, worked = time.perf_counter(), time.process_time()
image = compile_files([sys.argv[1]], runnable=True).image
read = time.perf_counter()
assert Plc(image, engine="auto").scan() is None
print(*((now - since) * 1e3 for now, since in (
    (read, began), (time.perf_counter(), began), (time.process_time(), worked))))
"""


def starting() -> None:
    """From text to the end of the first scan, in a process of its own each time; a warm start finds image and code on disk.

    A warm start reads 2 MB, checks a hash over them, and links an object; it neither parses nor checks nor compiles."""
    more = "VAR_GLOBAL NOW : TIME; D : ARRAY [0..1023] OF WORD; END_VAR\n"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lines5000.st"
        path.write_text((BENCH / path.name).read_text(encoding="utf-8") + more, encoding="utf-8")
        for program in (DEMO, path):
            for state in ("cold", "warm", "warm"):
                environment = os.environ | {"FBVM_CACHE": folder, "PYTHONPATH": str(HOUSE)}
                said = subprocess.check_output([sys.executable, "-c", FIRST_SCAN, str(program)], env=environment, text=True)
                image_ms, all_ms, work_ms = map(float, said.split())
                show(f"{program.name}, {state}: text to image", image_ms, "ms")
                show("  text to the end of the first scan", all_ms, "ms")
                show("  of these, work of the processor", work_ms, "ms")


STARTS = 5
"""New processes of each kind, of which the one that worked least counts."""


def clean_environment(folder: str) -> dict[str, str]:
    """The environment of a process that has its bytecode and fbvm's cache in a folder."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return kept | {"FBVM_CACHE": folder, "PYTHONPYCACHEPREFIX": folder, "PYTHONPATH": str(HOUSE),
                   "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # fmt: skip


def work_ms(folder: str, *words: str) -> float:
    """The least work of a new process of Python with a `clean_environment`, after one that fills its caches."""
    environment, taken = clean_environment(folder), []
    for _ in range(1 + STARTS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, *words], env=environment, cwd=folder, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        taken.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(taken[1:]) * 1e3


def plugin_ms(folder: str) -> tuple[float, float]:
    """The work of a session of pytest with a test that does nothing, and what the plugin adds."""
    (Path(folder) / "test_nothing.py").write_text("def test_nothing() -> None:\n    pass\n", encoding="utf-8")
    (Path(folder) / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    plain = work_ms(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    return plain, work_ms(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "fbvm.testing.plugin") - plain


def loading() -> None:
    """What a verb works on a program that has not changed, and what the plugin adds to a session of pytest without PLC code.

    Both are imports, nearly all: what is not loaded costs nothing."""
    with tempfile.TemporaryDirectory() as folder:
        show("Python alone, work of the processor", work_ms(folder, "-c", "pass"), "ms")
        show("  fbvm check demo.st, unchanged (wanted: 150)", work_ms(folder, "-m", "fbvm", "check", str(DEMO)), "ms")
        show("  fbvm run demo.st --scans 3, unchanged", work_ms(folder, "-m", "fbvm", "run", str(DEMO), "--scans", "3"), "ms")
        plain, more = plugin_ms(folder)
        show("  pytest, a test that does nothing", plain, "ms")
        show("  what the plugin adds (wanted: 50)", more, "ms")


if __name__ == "__main__":
    print(f"Python {sys.version.split()[0]} on {sys.platform}")
    compiling()
    scanning()
    starting()
    loading()
