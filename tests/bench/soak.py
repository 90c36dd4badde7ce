"""A soak of the blocks: python tests/bench/soak.py [memory|sockets|all].

`memory` is one hour of the PLC's time in virtual time, over a network that cuts and joins as it likes; `sockets` is two
minutes on real connections to a server in a process of its own.  All blocks are busy all the time.  Prints what was
done and what the process holds as it goes; ends with an error if a command fails, a word is wrong, or anything grows.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(HOUSE), str(HOUSE / "tests" / "fblib")]

from soak_plant import BLOCKS, SERVER, UNIT_ADDRESS, Usage, check, contents, plant, usage  # noqa: E402

from fbvm import Etn21, LoopNetwork, ModbusPeer, Plc, TcpNetwork  # noqa: E402
from fbvm.cli.running.demo import modbus_server  # noqa: E402
from fbvm.net.faults import Fault  # noqa: E402
from fbvm.run import run  # noqa: E402

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


if __name__ == "__main__":
    wanted = sys.argv[1] if len(sys.argv) > 1 else "all"
    for name, work in (("memory", memory), ("sockets", sockets)):
        if wanted in (name, "all"):
            print(f"--- {name}")
            work()
