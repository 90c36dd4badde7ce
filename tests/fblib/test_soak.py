"""All nine blocks busy for minutes of the PLC's time.  The hour, and real sockets: `python tests/bench/soak.py`."""

from __future__ import annotations

import pytest
from depth import times
from soak_plant import BLOCKS, SERVER, UNIT_ADDRESS, check, contents, plant, usage

from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.units.etn21.unit import Etn21

MINUTE_NS = 60_000_000_000


@pytest.mark.slow
@pytest.mark.parametrize(("timing", "minutes"), [("exact", 5), ("real", 3)])
def test_minutes_with_all_blocks_busy(timing: str, minutes: int) -> None:
    """No error, no wrong word, and as many objects and handles at the end as after the first minute."""
    plc, network, peer = plant(), LoopNetwork(5), ModbusPeer(contents())
    network.faults.append(Fault(segment_bytes=100, random_cut=True, gap_ns=1_000_000))
    network.place(SERVER, peer)
    plc.attach(Etn21(0, UNIT_ADDRESS, timing=timing, seed=5), network)
    plc.run(for_ns=MINUTE_NS)
    before = usage()
    ended = check(plc)
    for _ in range(2 * times(minutes, 12) - 2):
        peer.received.clear()
        assert plc.run(for_ns=MINUTE_NS // 2) == "time"
        now = check(plc)
        assert now > ended
        ended = now
    peer.received.clear()
    after = usage()
    assert after.objects <= before.objects + 300
    assert after.handles <= before.handles
    assert after.resident_bytes <= before.resident_bytes + (12 << 20)
    served = [plc.read(f"Main.{name}_Busy.Ended") for name in BLOCKS]
    assert max(served) - min(served) <= 1, "each has had its turn"  # type: ignore[operator, type-var]
    assert peer.server.counts["exceptions"] == 0
