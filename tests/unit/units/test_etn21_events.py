"""Events of the network for which the processor of an ETN21 has no room yet."""

from __future__ import annotations

from etn21_rig import SERVER, Rig

from fbvm.units.etn21.map import Switch
from fbvm.wire.link import Close, Closed, Failed, PeerClosed, Received


def test_events_that_wait_at_power_on_are_forgotten() -> None:
    """Of 193 events 64 wait in the processor's table and the others beside it; none reaches what begins afterwards."""
    rig = Rig()
    rig.open()
    rig.unit.post([*[Received(1, b"old", SERVER)] * 192, Failed(1, "open", "ECONNREFUSED")])
    assert rig.unit.reset(rig.memory) == [Close(1, reset=True)]
    inside = rig.unit.exchanged
    assert inside is not None
    assert [inside.processor.view(name)[0] for name in ("ETN21_Posted", "ETN21_Behind")] == [0, 0]
    rig.scan(Closed(1))
    rig.open()
    assert (rig.code(), rig.waiting()) == ("0000", 0)


def test_events_that_find_no_room_come_in_the_next_refreshes_in_their_order() -> None:
    rig = Rig()
    rig.open()
    counts = []
    rig.scan(*[Received(1, b"new", SERVER)] * 130)
    for events in ([Received(1, b"last"), PeerClosed(1)], [], [], []):
        counts.append((rig.waiting(), rig.state()))
        rig.scan(*events)
    assert counts == [(192, 4), (384, 4), (394, 5), (394, 5)]
    rig.parameters(count=394)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert b"".join(int(word).to_bytes(2, "big") for word in rig.d[1000:1197]) == b"new" * 130 + b"last"
