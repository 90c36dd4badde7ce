"""A soak of the blocks and of scans: python tests/bench/soak.py [scans|memory|sockets|reconnects|all] [SECONDS].

`scans` is 10,000,000 scans in virtual time, in one piece and one by one, of a program with timers, counters and texts; at the end
each timer has ended exactly as often as its time fits into the time that has passed.
`memory` is one hour of the PLC's time in virtual time, over a network that cuts and joins as it likes; `sockets` is two
minutes on real connections to a server in a process of its own.  All blocks are busy all the time.
`reconnects` is ten minutes (or SECONDS) of eight clients that come and go at a server program, while every kind of fault is
switched at its door: at the end of each part all eight have to be served at once.  Prints what was done and what the process
holds as it goes; ends with an error if a command fails, a word is wrong, or anything grows.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(HOUSE), str(HOUSE / "tests" / "fblib")]

from soak_plant import BLOCKS, SERVER, UNIT_ADDRESS, Usage, check, contents, plant, usage  # noqa: E402

from fbvm import Etn21, LoopNetwork, ModbusPeer, Plc, TcpNetwork, compile_text  # noqa: E402
from fbvm.cli.running.demo import modbus_server  # noqa: E402
from fbvm.net.faults import KINDS, Fault  # noqa: E402
from fbvm.run import run  # noqa: E402
from fbvm.wire.link import Peer  # noqa: E402

SECOND_NS = 1_000_000_000
MEMORY_S, SOCKETS_S = 3600, 120
PARTS = 12
GROWTH_OBJECTS, GROWTH_BYTES = 500, 8 << 20
"""What may come and go by itself: caches of the host's libraries, fragments of its heap."""


def show(plc: Plc, ended: int, began_s: float, now: Usage) -> None:
    print(
        f"{plc.elapsed_ns / 1e9:8.0f} s {plc.scans:9,} scans {ended:9,} exchanges {ended / (time.time() - began_s):8,.0f}/s"
        f"   {now.objects:,} objects, {now.handles} handles, {now.resident_bytes >> 10:,} KiB",
        flush=True,
    )


def soak(plc: Plc, seconds: int, go: Callable[[int], str]) -> None:
    """So long, in parts; the first one warms up."""
    began_s, first, ended = time.time(), None, 0
    for _ in range(PARTS):
        reason = go(seconds * SECOND_NS // PARTS)
        assert reason == "time", reason
        now, before, ended = usage(), ended, check(plc)
        assert ended > before, "nothing was done"
        show(plc, ended, began_s, now)
        first = first or now
        assert now.handles == first.handles, "handles are not constant"
        assert now.objects <= first.objects + GROWTH_OBJECTS, "objects grow"
        assert now.resident_bytes <= first.resident_bytes + GROWTH_BYTES, "memory grows"
    counts = ", ".join(f"{name} {plc.read(f'Main.{name}_Busy.Ended'):,}" for name in BLOCKS)
    print(f"no error, nothing grew: {counts}")


SCANS, CYCLE_NS = 10_000_000, 10_000_000
SCANS_BYTES = 2 << 20
"""How much a process may grow in these scans after the first parts, in which the helper delivers fast code."""
WARM_PARTS = 3
TIMERS = """
PROGRAM Main
VAR t : TON; ends, scans : LINT; half : TP; edges : CTU; edge : R_TRIG; s : STRING; level : LREAL; END_VAR
t(IN := NOT t.Q, PT := T#70ms);
IF t.Q THEN ends := ends + 1; END_IF;
scans := scans + 1;
half(IN := t.Q, PT := T#30ms);
edge(CLK := half.Q);
edges(CU := edge.Q, PV := 1000, R := edges.Q);
level := level + (20.0 - level) * 0.001;
s := CONCAT(LINT_TO_STRING(scans), ' scans');
END_PROGRAM
"""
SCANS_OF_A_TIMER = 9
"""A TON of 70 ms ends seven scans of 10 ms after its start; one scan resets it, and the next starts it again."""


def one_by_one(plc: Plc, count: int) -> None:
    for _ in range(count):
        plc.scan()


def scans() -> None:
    image = compile_text(TIMERS).image
    assert image
    ways: dict[str, Callable[[Plc, int], object]] = {
        "in one piece": lambda plc, count: plc.run(scans=count),
        "one by one": one_by_one,
    }
    for way, go in ways.items():
        plc, first = Plc(image, CYCLE_NS, engine="native"), None
        began_s = time.time()
        for part in range(PARTS):
            go(plc, SCANS // PARTS)
            now = usage()
            first = now if part < WARM_PARTS else first or now
            print(f"{way}: {plc.scans:10,} scans {plc.scans / (time.time() - began_s):10,.0f}/s   {now.objects:,} objects, "
                  f"{now.handles} handles, {now.resident_bytes >> 10:,} KiB", flush=True)
            assert plc.trap is None, plc.trap
            assert plc.read("Main.scans") == plc.scans
            assert plc.read("Main.ends") == (plc.scans + 1) // SCANS_OF_A_TIMER, "a timer has drifted"
            assert now.handles == first.handles, "handles are not constant"
            assert now.resident_bytes <= first.resident_bytes + SCANS_BYTES, "memory grows"


def memory() -> None:
    plc, network, peer = plant(), LoopNetwork(1, latency_ns=2_000_000), ModbusPeer(contents())
    network.faults.append(Fault(segment_bytes=120, random_cut=True, gap_ns=1_000_000))
    network.place(SERVER, peer)
    plc.attach(Etn21(0, UNIT_ADDRESS), network)

    def go(time_ns: int) -> str:
        reason = plc.run(for_ns=time_ns)
        peer.received.clear()
        return reason

    soak(plc, MEMORY_S, go)


def sockets() -> None:
    with modbus_server() as port:
        plc, network = plant(), TcpNetwork({SERVER: ("127.0.0.1", port)})
        try:
            plc.attach(Etn21(0, UNIT_ADDRESS), network)
            soak(plc, SOCKETS_S, lambda time_ns: run(plc, for_ns=time_ns, pace="event"))
            print(plc.scan_times)
        finally:
            network.close()


# --- reconnects ---------------------------------------------------------------------------------------------------------

RECONNECTS_S, RECONNECT_PARTS, SWITCH_NS = 600, 10, SECOND_NS
SERVER_PROGRAM = """
PROGRAM Main
VAR Level AT D1000 : UINT; Server : ETN_Modbus_Server := (Sockets := 8, Idle_Time := T#2s); END_VAR
    Server();
    Level := 77;
END_PROGRAM
"""
SERVER_DOOR = Peer("192.168.250.21", 502)


def switched(dice: random.Random, changes_bytes: bool) -> list[Fault]:
    """No fault in one of three times, else one of the kinds; of those that change what is said only with `changes_bytes`."""
    ms = 1_000_000
    changed = {"slow": {"latency_ns": 5 * ms}, "unsteady": {"jitter_ns": 8 * ms}, "dripping": {"gap_ns": ms},
               "joined": {"join_ns": 20 * ms}, "lossy": {"lose_percent": 20}, "doubled": {"duplicate_percent": 20},
               "interrupted": {"reset_after_bytes": 20}}  # fmt: skip
    kind = dice.choice([kind for kind in KINDS if changes_bytes or kind not in ("lossy", "doubled")])
    return [] if dice.random() < 1 / 3 else [replace(KINDS[kind], peer=SERVER_DOOR, **changed.get(kind, {}))]


def _started(script: str, *arguments: str) -> subprocess.Popen[str]:
    """A program of this folder in a process of its own, which a line on its standard input ends."""
    return subprocess.Popen([sys.executable, str(HOUSE / "tests" / "bench" / script), *arguments],
                            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)  # fmt: skip


def _end(program: subprocess.Popen[str]) -> None:
    assert program.stdin
    program.stdin.write("end\n")
    program.stdin.flush()


def _told(program: subprocess.Popen[str]) -> dict[str, int]:
    """What a program that ends has counted."""
    said = json.loads(program.communicate()[0])
    assert isinstance(said, dict)
    return said


def reconnects(seconds: int) -> None:
    made = compile_text(SERVER_PROGRAM)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    plc, network, dice = Plc(made.image, CYCLE_NS), TcpNetwork({SERVER_DOOR: ("127.0.0.1", 0)}, seed=1), random.Random(1)
    plc.attach(Etn21(0, SERVER_DOOR.host), network)
    port, first, total, lost = network.host_endpoint(SERVER_DOOR).port, None, Counter[str](), 0
    run(plc, for_ns=SECOND_NS)
    bare = _started("bare_loop.py", str(CYCLE_NS / 1e6))
    began_s = time.time()
    try:
        for part in range(RECONNECT_PARTS):
            clients = _started("reconnecting_clients.py", str(port), str(part))
            for _ in range(seconds // RECONNECT_PARTS):
                network.faults[:] = switched(dice, part % 2 == 1)
                run(plc, for_ns=SWITCH_NS)
            network.faults.clear()
            _end(clients)
            while clients.poll() is None:
                run(plc, for_ns=SWITCH_NS // 4)
            counts = Counter(_told(clients))
            lost += 8 - counts.pop("served at once", 0)
            assert part % 2 == 1 or not counts["wrong"], "a reply is wrong although no fault changes what is said"
            total += counts
            run(plc, for_ns=4 * SECOND_NS)  # what was left open ends by its idle time
            now = usage()
            show(plc, total["right"], began_s, now)
            first = first or now
            assert now.handles == first.handles, "handles are not constant"
            assert now.objects <= first.objects + GROWTH_OBJECTS, "objects grow"
            assert now.resident_bytes <= first.resident_bytes + GROWTH_BYTES, "memory grows"
            assert network.relays.carried == {}, "a connection is still led through wires"
    finally:
        network.close()
        _end(bare)
        host = _told(bare)
    print(f"{dict(total)}\n{lost} slots lost; {plc.lateness} of {plc.scans:,}; "
          f"a loop that does nothing missed {host['missed']:,} of {host['periods'] + host['missed']:,} beside it")
    assert not lost, "not all of eight clients were served at once"


if __name__ == "__main__":
    wanted = sys.argv[1] if len(sys.argv) > 1 else "all"
    for_s = int(sys.argv[2]) if len(sys.argv) > 2 else RECONNECTS_S
    for name, work in (("scans", scans), ("memory", memory), ("sockets", sockets), ("reconnects", lambda: reconnects(for_s))):
        if wanted in (name, "all"):
            print(f"--- {name}")
            work()
