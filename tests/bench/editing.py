"""Prints how long an editor waits: python tests/bench/editing.py [LINES ...].  It gates nothing.

A text of blocks is opened, then statements are typed at random places, key by key; each key is checked as the language server
does it, and the wait is processor time, so that other work of the computer does not count.  After it come a change of an
interface, warnings of the whole text, hover, completion, renaming, and the memory of 20,000 keys.

Wanted of 5,000 lines: 100 ms after a key in 95 of 100, 500 ms after a change of an interface and for warnings."""

from __future__ import annotations

import gc
import random
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH.parents[1]), str(BENCH)]

from large_text import text_of  # noqa: E402

from fbvm.analysis.completion import complete  # noqa: E402
from fbvm.analysis.garbage import Garbage  # noqa: E402
from fbvm.analysis.hover import hover  # noqa: E402
from fbvm.analysis.program import Program  # noqa: E402
from fbvm.analysis.references import rename  # noqa: E402

SIZES = (5_000, 50_000)
TYPED = "x := y + 1;"
PLACES, KEYS = 40, 20_000
NAME = "a.st"


def measured(work: Callable[[], object]) -> float:
    """Processor time in milliseconds."""
    start = time.process_time_ns()
    work()
    return (time.process_time_ns() - start) / 1e6


def resident_mib() -> float:
    """Memory of this process, 0 where the system does not tell."""
    status = Path("/proc/self/status")
    found = re.search(r"VmRSS:\s+(\d+)", status.read_text(encoding="ascii")) if status.exists() else None
    return int(found[1]) / 1024 if found else 0.0


class Typist:
    """Somebody who types statements into a program."""

    def __init__(self, program: Program, text: str) -> None:
        self.program, self.text = program, text
        self.chosen = random.Random(1)
        self.local = 0
        """Keys after which one POU was checked."""

    def key(self) -> None:
        """What the server does after a key."""
        self.program.replace(NAME, self.text)
        self.local += self.program.check_changes()
        self.program.diagnostics(NAME)

    def statement(self) -> list[float]:
        """Type a statement and take it back; the milliseconds of each key."""
        before = self.text
        at = self.chosen.choice([found.end() for found in re.finditer(r";\n", before)])
        waited = []
        for number in range(1, len(TYPED) + 1):
            self.text = before[:at] + TYPED[:number] + before[at:]
            waited.append(measured(self.key))
        self.text = before
        self.key()
        return waited


def checked(program: Program) -> None:
    """What the server does before it tells of everything."""
    for _ in program.check():
        pass
    program.diagnostics(NAME)


def report(lines: int, places: int = PLACES, keys: int = KEYS) -> None:
    """Print the figures of one size."""
    text = text_of(lines)
    program, garbage = Program(), Garbage()
    first = measured(lambda: (program.replace(NAME, text), program.check_all(), program.diagnostics(NAME)))
    gc.collect()
    typist = Typist(program, text)
    waited = sorted(wait for _ in range(places) for wait in typist.statement())
    print(f"{len(text.splitlines())} lines: first diagnostics {first:.0f} ms")
    print(f"  a key: median {waited[len(waited) // 2]:.0f} ms, 95 of 100 within {waited[int(len(waited) * 0.95)]:.0f} ms, "
          f"longest {waited[-1]:.0f} ms ({typist.local} checked one POU alone)")
    program.replace(NAME, text.replace("Level : INT", "Level : DINT", 1))
    print(f"  a change of an interface, with warnings: {measured(lambda: checked(program)):.0f} ms")
    program.replace(NAME, text)
    program.check_all()
    place = text.index("Sum := Sum")
    print(f"  hover {measured(lambda: hover(program, NAME, place)):.0f} ms, "
          f"completion {measured(lambda: complete(program, NAME, place)):.0f} ms")
    print(f"  renaming a block: {measured(lambda: rename(program, NAME, text.index('Station_0'), 'First')):.0f} ms")
    if keys:
        memory = [resident_mib()]
        for number in range(1, keys // len(TYPED) + 1):
            typist.statement()
            garbage.typed()
            if number % 20 == 0:  # somebody pauses
                program.check_all()
                garbage.checked()
            if number % max(1, keys // len(TYPED) // 4) == 0:
                memory.append(resident_mib())
        garbage.collect()
        print(f"  memory: {', '.join(f'{each:.0f}' for each in memory)} MiB at each quarter of {keys} keys, "
              f"{resident_mib():.0f} MiB when garbage is collected")
    garbage.end()


if __name__ == "__main__":
    for size in [int(each) for each in sys.argv[1:]] or SIZES:
        report(size, keys=KEYS if size <= 5_000 else 0)
