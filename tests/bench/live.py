"""What pages of `fbvm live` take from the scans of a PLC: three of them, each with 200 names and ten rungs.

Prints the processor time of the slices between scans in which pages are told, and of scans with and without pages.  A scan that
is due during a slice begins later by what is left of it: with real connections that is the most that pages cost.

    python tests/bench/live.py [--updates 300]
"""

from __future__ import annotations

import argparse
import json
import time

from fbvm import Plc, Recording, compile_text
from fbvm.live.plcs import LivePlc
from fbvm.live.session import Session
from fbvm.live.updates import UPDATE_NS
from fbvm.live.workbench import Workbench
from fbvm.run.interactive import AUDIENCE_NS, Control

PAGES, NAMES, RUNGS, SCANS = 3, 200, 10, 10
"""Pages, names of each, rungs of the program, and scans between two updates: 100 ms of 10 ms."""


def program() -> str:
    """A program with ten rungs and 200 counters that all move."""
    rungs = "".join(f"LD d[{number}]\nANDNOT c[{number}]\nOUT c[{number}]\n" for number in range(1, RUNGS + 1))
    return f"""PROGRAM Main VAR a : ARRAY[1..{NAMES}] OF INT; c, d : ARRAY[1..{RUNGS}] OF BOOL; i : INT; END_VAR
FOR i := 1 TO {NAMES} DO a[i] := a[i] + i; END_FOR
LADDER
{rungs}END_LADDER
END_PROGRAM"""


def at(times: list[int], share: float) -> str:
    return f"{sorted(times)[min(len(times) - 1, int(share * len(times)))] / 1e6:8.3f} ms"


def measured(pages: int, updates: int, is_observed: bool) -> tuple[list[int], list[int]]:
    """The processor time of each slice in which one page is told, and of each scan, in nanoseconds."""
    text = program()
    image = compile_text(text).image
    assert image is not None
    plc = Plc(image)
    live = LivePlc("pump", plc, Recording().add("pump", plc), {image.sites[0].file: text})
    bench = Workbench([live], Control())
    sessions = [Session(bench) for _ in range(pages)]
    for session in sessions:
        session.answer(json.dumps({"do": "hello"}))
        seen = {"names": [f"Main.a[{number}]" for number in range(1, NAMES + 1)]}
        inside = {"instance": "Main", "scan": True} if is_observed else {}
        session.answer(json.dumps({"do": "look", "plc": "pump", **seen, **inside}))
    slices: list[int] = []
    scans: list[int] = []
    for update in range(1, updates + 1):
        for _ in range(SCANS):
            live.before_scan()
            began_ns = time.thread_time_ns()
            plc.scan()
            scans.append(time.thread_time_ns() - began_ns)
            live.after_scan()
        for session in sessions:
            began_ns = time.thread_time_ns()
            while session.update(update * UPDATE_NS, lambda: time.thread_time_ns() - began_ns >= AUDIENCE_NS) is None:  # noqa: B023
                if not session.is_behind:
                    break
                slices.append(time.thread_time_ns() - began_ns)
                began_ns = time.thread_time_ns()
            slices.append(time.thread_time_ns() - began_ns)
            session.answer('{"do": "ready"}')
    return slices, scans


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--updates", type=int, default=300)
    updates = arguments.parse_args().updates
    print(f"{PAGES} pages, {NAMES} names and {RUNGS} rungs each, {updates} updates; processor time, median, at 99 %, longest")
    for said, pages, is_observed in (("no page", 0, False), ("values", PAGES, False), ("values and rungs", PAGES, True)):
        slices, scans = measured(pages, updates, is_observed)
        print(f"{said:17} scan {at(scans, 0.5)} {at(scans, 0.99)} {at(scans, 1)}"
              + (f"   slice of a page {at(slices, 0.5)} {at(slices, 0.99)} {at(slices, 1)}" if slices else ""))  # fmt: skip


if __name__ == "__main__":
    main()
