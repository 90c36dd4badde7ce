"""All that is promised of speed in one run, with limits and peers: python tests/bench/limits.py [WORD...].  Gates nothing.

With words only the rows that have one of them.  Start-up and compilation are processor time, which others on the machine disturb
least; rates are ratios to a peer that takes turns with us.  What needs a compiler of C is left out where there is none.  What a
recording costs is in recorder.py and recorded_day.py, what an editor waits for in editing.py."""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH.parents[1]), str(BENCH)]

import exchanges  # noqa: E402
import native  # noqa: E402
import run  # noqa: E402
import servers  # noqa: E402

from fbvm import compile_files  # noqa: E402

Row = tuple[str, str, str]
"""What was measured, the figure, its limit."""
PYTHON = {"logic": 130, "pid": 400, "crc": 220, "mtcp": 760}
MACHINE = {"logic": 0.8, "pid": 1.5, "crc": 1.4, "mtcp": 2.5}
"""The limits of a scan of the four programs, as multiples of C by hand."""
MOST = 10_000
"""The memory of each is promised of so many: with 1,000 the compiler's 50 MiB, which are there once, are more than their own."""
MANY = (("logic", 1_000), ("logic", MOST), ("polling", 1_000))
AT_ONCE = 8
ROUNDS = 9
"""In how many rounds two servers take turns."""
PROCESSES = 9
IN_ONE_PROCESS = "in-one-process"
"""The word by which a new process is asked for its figures of the four programs."""


def starting() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        check_ms = run.work_ms(folder, "-m", "fbvm", "check", str(run.DEMO))
        yield "fbvm check examples/demo.st, unchanged", f"{check_ms:.0f} ms", "<= 150 ms"
        yield "an empty session of pytest: what the plugin adds", f"{run.plugin_ms(folder)[1]:.0f} ms", "<= 50 ms"


def compiling() -> Iterator[Row]:
    more = "VAR_GLOBAL NOW : TIME; D : ARRAY [0..1023] OF WORD; END_VAR\n"
    text = (BENCH / "lines5000.st").read_text(encoding="utf-8") + more
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lines5000.st"
        path.write_text(text, encoding="utf-8")
        taken = []
        for _ in range(3):
            began = time.process_time()
            compile_files([path], cache=False)
            taken.append(time.process_time() - began)
        lines = len(text.splitlines())
        yield f"{lines:,} lines, text to image", f"{lines / min(taken):,.0f} lines/s", ">= 15,000 lines/s"
        took = [cold_ms(folder, number, path) for number in range(1 + run.STARTS)]  # the first one makes bytecode
        yield "  the same, cold, from start to first native scan", f"{min(took[1:]):,.0f} ms", "<= 1,000 ms"
        optimised = [float(in_new_process(OPTIMISED, folder, path)) for _ in range(3)]
        yield "  O2 of it in the helper process", f"{min(optimised):.2f} s", "<= 6 s"


def cold_ms(folder: str, number: int, path: Path) -> float:
    """The work of a new process from its start to the first scan; of the helper that optimises meanwhile nothing is in it."""
    return float(in_new_process(COLD, folder, path, str(Path(folder) / f"cold{number}")))


def in_new_process(program: str, folder: str, path: Path, cache: str = "") -> str:
    """What a program of Python prints that is given the file of the source."""
    environment = run.clean_environment(folder) | {"FBVM_CACHE": cache or folder}
    return subprocess.check_output([sys.executable, "-c", program, str(path)], env=environment, text=True)


COLD = """
import sys, time
from fbvm import Plc, compile_files
assert Plc(compile_files([sys.argv[1]], runnable=True).image, engine="native").scan() is None
print(time.process_time() * 1e3)
"""


OPTIMISED = """
import io, sys, time
from fbvm import compile_files
from fbvm.engine.native.emit.module import translate
from fbvm.engine.native.llvm import worker
text = translate(compile_files([sys.argv[1]], runnable=True).image).text.encode()
job = io.BytesIO(len(text).to_bytes(8, "little") + text)
began = time.process_time()
worker.serve(job, io.BytesIO(), len(text) > worker.LONGEST_HERE[2])
print(time.process_time() - began)
"""


def many() -> Iterator[Row]:
    for name, count in MANY:
        told = subprocess.check_output([sys.executable, str(BENCH / "many.py"), name, str(count), "cyclic", "100"], text=True)
        _, _, _, _, kib, core, _, each, _, _, missed, *_ = told.split()
        limits = "<= 100 %, 0" if name != "logic" else "<= 25 %, 0, 50 KiB" if count == MOST else "<= 25 %, 0"
        yield f"{count:,} PLCs at 100 ms, {name}: of a core, missed, each", f"{core} %, {missed}, {kib} KiB", limits
        yield "  a scan of one, with the start", f"{each} us", ""


def programs() -> Iterator[Row]:
    """Machine code and C are compared in each of some new processes, of which the median counts: how fast the code of a process
    is follows the physical pages in which the host puts it (see native.py), on both sides."""
    command = [sys.executable, __file__, IN_ONE_PROCESS]
    told = [json.loads(subprocess.check_output(command, text=True)) for _ in range(PROCESSES)]
    for name, step_ns in native.PROGRAMS.items():
        hands, machines = zip(*(process[name] for process in told), strict=True)
        yield f"{name}: machine code, times C by hand, {PROCESSES} processes", times(machines, hands), f"<= {MACHINE[name]}"
        image = native.compiled(BENCH / "programs" / f"{name}.st")
        python = native.shortest_ns(native.in_python(image, step_ns), 5) / statistics.median(hands)
        yield f"{name}: python engine, times C by hand", f"{python:.0f}", f"<= {PYTHON[name]}"


def times(ours: Sequence[float], theirs: Sequence[float]) -> str:
    """How many times theirs ours are: the median of all rounds, each of which compares the two, and the range."""
    ratios = sorted(our / their for our, their in zip(ours, theirs, strict=True))
    return f"{statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})"


def in_one_process() -> dict[str, tuple[float, float]]:
    """A scan of each of the four programs in nanoseconds: C by hand, machine code."""
    with tempfile.TemporaryDirectory() as folder:
        return {name: (native.shortest_ns(native.by_hand(name, Path(folder), step_ns)),
                       native.shortest_ns(native.natively(native.compiled(BENCH / "programs" / f"{name}.st"), 2, step_ns)))
                for name, step_ns in native.PROGRAMS.items()}  # fmt: skip


def peers() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "modbus"
        subprocess.run(["cc", "-O2", "-o", str(binary), str(BENCH / "programs" / "modbus.c"), "-ldl"], check=True)
        with ExitStack() as stack:  # what takes part in exchanges has ended before servers are measured
            port = stack.enter_context(exchanges.server(binary))
            ours = "blocks, native, event"
            rates, used = exchanges.measure({
                exchanges.BEST: exchanges.in_c(binary, "plain", port), exchanges.PLAIN: exchanges.pymodbus(stack, port),
                ours: exchanges.Blocks(stack, exchanges.poll(), port, "native", "event", 10)})  # fmt: skip
        yield "an exchange of the blocks, own processor time", f"{statistics.median(used[ours]):.0f} us", "<= 60 us"
        yield "  its rate, times C that only sends and receives", times(rates[ours], rates[exchanges.BEST]), ">= 0.6"
        yield "  its rate, times pymodbus's client", times(rates[ours], rates[exchanges.PLAIN]), ""
        commands = servers.commands(binary)
        found: dict[str, list[float]] = {"etn_modbus, 8 sockets": [], "pymodbus": []}
        for _ in range(ROUNDS):
            for name, measured in found.items():
                with servers.server(commands[name]) as served:
                    measured.append(servers.rate(binary, served, AT_ONCE))
        yield f"{AT_ONCE} clients on {AT_ONCE} sockets, times pymodbus's server", times(*found.values()), ">= 2"


PARTS: dict[str, Callable[[], Iterator[Row]]] = {
    "starting": starting, "compiling": compiling, "many": many, "programs": programs, "peers": peers,
}  # fmt: skip
WITH_C = ("programs", "peers")


def main() -> None:
    if sys.argv[1:] == [IN_ONE_PROCESS]:
        print(json.dumps(in_one_process()))
        return
    wanted = sys.argv[1:] or list(PARTS)
    for name in wanted:
        if name in WITH_C and shutil.which("cc") is None:
            print(f"{name}: not measured, there is no compiler of C")
            continue
        for what, ours, limit in PARTS[name]():
            print(f"{what:<66}{ours:>26}   {limit}", flush=True)


if __name__ == "__main__":
    main()
