"""What pages of `fbvm live` take from the scans of a PLC: three of them, each with 200 names and ten rungs.

Prints the processor time of the slices between scans in which pages are told and long questions answered, and of scans with and
without pages.  A scan that is due during a slice begins later by what is left of it: with real connections that is the most that
pages cost.

    python tests/bench/live.py [--updates 300] [--seconds 10]

In real time: a PLC with real connections whose period is 10 ms, its page served to three programs that take every update; how
late scans begin by the clock, and the processor time that they take.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from itertools import pairwise
from typing import Any

from fbvm import Plc, Recording, TcpNetwork, compile_text
from fbvm.live.host import LiveHost
from fbvm.live.plcs import LivePlc
from fbvm.live.session import Session
from fbvm.live.updates import UPDATE_NS
from fbvm.live.workbench import Workbench
from fbvm.machine.backplane import usual_units
from fbvm.run.interactive import AUDIENCE_NS, Control, run_interactive
from fbvm.run.running import Running

PAGES, NAMES, RUNGS, SCANS = 3, 200, 10, 10
"""Pages, names of each, rungs of the program, and scans between two updates: 100 ms of 10 ms."""

WARM_S = 3
"""Seconds in which pages come and machine code is made, which are not counted."""


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


def questions() -> list[tuple[str, list[int]]]:
    """The processor time of each slice in which a page's long questions are answered, in nanoseconds: 1,000 names to look at, a
    source of 5,000 lines, the 500 parts of an array."""
    lines = "".join(f"a[{number % 500 + 1}] := a[{number % 500 + 1}] + 1;\n" for number in range(5000))
    text = f"PROGRAM Main\nVAR a : ARRAY[1..1000] OF INT; END_VAR\n{lines}END_PROGRAM\n"
    image = compile_text(text).image
    assert image is not None
    plc = Plc(image)
    live = LivePlc("pump", plc, Recording().add("pump", plc), {image.sites[0].file: text})
    session = Session(Workbench([live], Control()))
    asked = [("look", {"names": [f"Main.a[{number}]" for number in range(1, 1001)]}), ("source", {"instance": "Main"}),
             ("parts", {"name": "Main.a"})]  # fmt: skip
    taken: list[tuple[str, list[int]]] = []
    for do, fields in asked:
        slices, began_ns = list[int](), time.thread_time_ns()
        told = session.answer(json.dumps({"do": do, "plc": "pump", **fields}))
        while told is None:
            slices.append(time.thread_time_ns() - began_ns)
            began_ns = time.thread_time_ns()
            told = session.update(0, lambda: time.thread_time_ns() - began_ns >= AUDIENCE_NS)  # noqa: B023
        slices.append(time.thread_time_ns() - began_ns)
        taken.append((do, slices))
    return taken


PAGE = """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1]) as page:
    page.send(json.dumps({"id": 1, "do": "hello"}))
    page.send(json.dumps({"id": 2, "do": "look", "plc": "pump", "names": json.loads(sys.argv[2]), "instance": "Main",
                          "scan": True}))
    for text in page:
        if "update" in json.loads(text):
            page.send('{"do": "ready"}')
"""
"""A page that shows nothing but takes every update."""


def in_real_time(pages: int, seconds: float) -> tuple[list[int], list[int], int]:
    """How late each scan began by the clock, the processor time that it took, in nanoseconds, and how many updates were sent."""
    text = program()
    image = compile_text(text).image
    assert image is not None
    plc, network = Plc(image), TcpNetwork()
    for unit in usual_units([]):
        plc.attach(unit, network)
    bench = Workbench([live := LivePlc("pump", plc, Recording().add("pump", plc), {image.sites[0].file: text})], Control())
    host = LiveHost(bench)
    begun: list[int] = []
    taken: list[int] = []
    updates = 0

    class Timed(LiveHost):
        """Notes when scans begin and end."""

        def __init__(self) -> None:
            self.__dict__ = host.__dict__

        def before_scan(self, number: int, now_ns: int) -> None:
            super().before_scan(number, now_ns)
            begun.append(time.monotonic_ns())
            taken.append(-time.thread_time_ns())

        def after_scan(self, number: int, now_ns: int) -> None:
            taken[-1] += time.thread_time_ns()
            super().after_scan(number, now_ns)

    send = Session.update

    def counted(self: Session, *args: Any) -> str | None:
        nonlocal updates
        text = send(self, *args)
        updates += text is not None
        return text

    Session.update = counted  # type: ignore[method-assign]
    port, token = host.server.guard.port, host.server.guard.token
    names = json.dumps([f"Main.a[{number}]" for number in range(1, NAMES + 1)])
    started = [subprocess.Popen([sys.executable, "-c", PAGE, f"ws://127.0.0.1:{port}/live?token={token}", names])
               for _ in range(pages)]  # fmt: skip
    try:
        end_ns = time.monotonic_ns() + round((seconds + WARM_S) * 1e9)
        run_interactive([Running(plc, scans=1 << 60)], bench.control, Timed(), until=lambda: time.monotonic_ns() > end_ns)
    finally:
        for one in started:
            one.kill()
            one.wait()
        live.end_power()
        host.close()
        network.close()
        Session.update = send  # type: ignore[method-assign]
    first = next(number for number, at_ns in enumerate(begun) if at_ns > begun[0] + WARM_S * 1e9)
    period = plc.cycle_ns
    late = [now - before - period for before, now in pairwise(begun[first:])]
    return [max(0, one) for one in late], taken[first:], updates


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--updates", type=int, default=300)
    arguments.add_argument("--seconds", type=float, default=10)
    given = arguments.parse_args()
    updates = given.updates
    print(f"{PAGES} pages, {NAMES} names and {RUNGS} rungs each, {updates} updates; processor time, median, at 99 %, longest")
    for said, pages, is_observed in (("no page", 0, False), ("values", PAGES, False), ("values and rungs", PAGES, True)):
        slices, scans = measured(pages, updates, is_observed)
        print(f"{said:17} scan {at(scans, 0.5)} {at(scans, 0.99)} {at(scans, 1)}"
              + (f"   slice of a page {at(slices, 0.5)} {at(slices, 0.99)} {at(slices, 1)}" if slices else ""))  # fmt: skip
    for do, slices in questions():
        print(f"{do:17} {len(slices):4} slices{'':18} slice of a page {at(slices, 0.5)} {at(slices, 0.99)} {at(slices, 1)}")
    print(f"real time, {given.seconds:g} s, period 10 ms; median, at 99 %, longest")
    for pages in (0, PAGES):
        late, scans, sent = in_real_time(pages, given.seconds)
        print(f"{pages} pages{'':10} scan {at(scans, 0.5)} {at(scans, 0.99)} {at(scans, 1)}   late {at(late, 0.5)} "
              f"{at(late, 0.99)} {at(late, 1)}   {sent / max(1, pages) / (given.seconds + WARM_S):4.1f} updates/s")  # fmt: skip


if __name__ == "__main__":
    main()
