"""A loop that does nothing, each PERIOD_MS: python bare_loop.py PERIOD_MS.

What it misses the host makes anybody miss: the figure beside that of a PLC with the same period.  Runs until a line comes on the
standard input; prints a JSON object with the periods and how many of them were missed."""

from __future__ import annotations

import json
import select
import sys
import time


def main(period_ns: int) -> None:
    due_ns, periods, missed = time.monotonic_ns(), 0, 0
    while not select.select([sys.stdin], [], [], max(0, due_ns - time.monotonic_ns()) / 1e9)[0]:
        late = (time.monotonic_ns() - due_ns) // period_ns
        if late < 0:
            continue
        periods, missed, due_ns = periods + 1, missed + late, due_ns + (late + 1) * period_ns
    print(json.dumps({"periods": periods, "missed": missed}))


if __name__ == "__main__":
    main(int(float(sys.argv[1]) * 1e6))
