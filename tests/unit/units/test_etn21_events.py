"""Events of the network for which the processor of an ETN21 has no room yet."""

from __future__ import annotations

from etn21_rig import SERVER, Rig

from fbvm.wire.link import Close, Closed, Failed, PeerClosed, Received


def test_events_that_wait_at_power_on_are_forgotten() -> None:
    """Of 193 events 64 wait in the processor's table and the others beside it; none reaches what begins afterwards."""
    rig = Rig()
    rig.open()
    rig.unit.post([*[Received(1, b"old", SERVER)] * 192, Failed(1, "open", "ECONNREFUSED")])
    assert rig.unit.reset(rig.memory) == [Close(1, reset=True)]
    inside = rig.unit.exchanged
    assert inside is not None
    assert [inside.processor.view(name, "u32")[0] for name in ("ETN21_Posted", "ETN21_Behind")] == [0, 0]
    rig.scan(Closed(1))
    rig.open()
    assert (rig.code(), rig.waiting()) == ("0000", 0)


def test_events_that_find_no_room_come_in_the_next_refreshes_in_their_order() -> None:
    rig = Rig()
    rig.open()
    counts = []
    rig.scan(*[Received(1, b"new", SERVER)] * 130, PeerClosed(1))
    for _ in range(4):
        counts.append((rig.waiting(), rig.state()))
        rig.scan()
    assert counts == [(192, 4), (384, 4), (390, 5), (390, 5)]
