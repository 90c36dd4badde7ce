"""The debugger: python tests/bench/debugger.py [SCANS].

A program of 100 lines runs so many scans, 10,000 unless another number is given, under the debugger.  Prints how long these take:
the run up to a breakpoint in the last scan, the answer to the same breakpoint once more, one step back there, reverse to a
statement 5,000 scans before, and the way to any scan; gates nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.code.compiler import compile_text  # noqa: E402
from fbvm.machine.breakpoints import Breakpoint  # noqa: E402
from fbvm.machine.plc import Plc  # noqa: E402
from fbvm.step.debugger import Debugger, Move  # noqa: E402
from fbvm.step.session import Session  # noqa: E402

LINES = 100
SCANS = 10_000


def program() -> str:
    """A hundred lines, each with a counter, a comparison and a timer."""
    names = "".join(f"v{number}, " for number in range(LINES))
    timers = "".join(f"t{number}, " for number in range(LINES))
    rows = "".join(f"v{number} := v{number} + {number % 7 + 1}; b := v{number} > 20000; t{number}(IN := b, PT := T#50ms);\n"
                   f"IF t{number}.Q THEN v{number} := 0; END_IF;\n" for number in range(LINES))  # fmt: skip
    return f"PROGRAM Main\nVAR {names}n : DINT; {timers}t : TON; b : BOOL; END_VAR\nn := n + 1;\n{rows}END_PROGRAM\n"


def done(move: Move) -> None:
    """Carries out a whole move."""
    for _ in move:
        pass


def timed(what: str, action: Callable[[], object]) -> None:
    """Prints how long something takes."""
    began = time.perf_counter()
    action()
    print(f"{what:<52} {1000 * (time.perf_counter() - began):10.1f} ms")


def main(scans: int) -> None:
    """Prints all rows."""
    image = compile_text(program()).image
    assert image is not None
    found = Debugger({"plc": Session.of(lambda: Plc(image, engine="auto"))})
    session = found.session
    last = Breakpoint("line", "text.st:5", f"n = {scans}")
    found.here.put([last])
    timed(f"a run of {scans} scans up to a breakpoint", lambda: done(found.resume()))
    assert session.here.scan == scans - 1
    timed("one step back in the last scan", found.back_over)
    timed("one step back once more", found.back_over)
    timed("to the breakpoint again", lambda: done(found.resume()))
    timed("one scan on", lambda: done(found.scan(1)))
    found.here.put([Breakpoint("condition", f"Main.n >= {scans // 2}")])
    timed(f"back to a change {scans // 2} scans before", lambda: done(found.reverse()))
    assert session.here.scan in (scans // 2 - 1, scans // 2)
    timed("to another scan, far away", lambda: session.goto(scans // 10))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SCANS)
