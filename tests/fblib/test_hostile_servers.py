"""Every kind of hostile server against every client library on both engines: right data or none, and nobody stuck."""

from __future__ import annotations

import pytest
from client_rig import KINDS, ClientRig
from depth import times

from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS, RudePeer, by_script, by_seed, right

every_client = pytest.mark.parametrize("client", KINDS)
TIMINGS = pytest.mark.parametrize("timing", ["exact", pytest.param("real", marks=pytest.mark.slow)])

def ends_after(client: str, misdeed: str, timing: str) -> list[str]:
    """The ends of four commands, of which the first meets a misdeed."""
    rig = ClientRig(client, timing=timing, seed=len(misdeed))
    rig.peer.reply = by_script(misdeed)
    return [rig.read() for _ in range(4)]


@pytest.mark.slow
@pytest.mark.parametrize("misdeed", MISDEEDS)
@TIMINGS
def test_every_later_command_works(misdeed: str, timing: str) -> None:
    for client in KINDS:
        ends = ends_after(client, misdeed, timing)
        assert ends[1:] == ["ok"] * 3, (client, ends)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
@every_client
def test_a_flood_behind_each_reply_costs_no_command(client: str, engine: str) -> None:
    """20,000 bytes behind a reply; the next request goes out when they are dropped."""
    if engine == "native":
        pytest.importorskip("llvmlite")
    rig = ClientRig(client, engine=engine)
    rig.peer.reply = MISDEEDS["flood behind"]
    assert [rig.read() for _ in range(4)] == ["ok"] * 4
    assert len(rig.peer.received) == 4


@pytest.mark.slow
@every_client
def test_after_a_flood_without_end_the_next_connection_works(client: str) -> None:
    rig = ClientRig(client)
    rig.place(RUDE_PEERS["floods from the start"](rig.server))
    first = rig.read()
    rig.place(rig.peer)
    ends = [rig.read(wait_s=20) for _ in range(3)]
    assert first in ("ok", "0045") and ends[1:] == ["ok"] * 2, (first, ends)


@pytest.mark.slow
@every_client
def test_both_engines_end_alike(client: str) -> None:
    """Two commands after each misdeed, on one PLC, to the same memory."""
    pytest.importorskip("llvmlite")
    ended = []
    for engine in ("python", "native"):
        rig = ClientRig(client, engine=engine, timing="real", seed=5)
        ends = []
        for misdeed in MISDEEDS:
            rig.peer.reply = by_script(misdeed)
            ends += [(misdeed, rig.read(wait_s=20), rig.read(wait_s=20))]
        ended.append((ends, bytes(rig.plc.memory.u8)))
    assert ended[0] == ended[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RUDE_PEERS if "flood" not in name])
@TIMINGS
def test_a_server_that_is_rude_and_then_reforms(name: str, timing: str) -> None:
    """Three commands with it; then a good server is there, and the second command at the latest works."""
    for client in KINDS:
        rig = ClientRig(client, timing=timing, seed=len(name))
        peer = RUDE_PEERS[name](rig.server)
        rig.place(peer)
        ends = [rig.read(wait_s=1) for _ in range(3)]
        rig.place(rig.peer)
        if isinstance(peer, RudePeer):
            peer.reform()
        again = [rig.read(wait_s=100) for _ in range(3)]
        assert again[1:] == ["ok", "ok"], (client, ends, again)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(times(4)))
@every_client
def test_anything_at_any_reply(client: str, seed: int) -> None:
    """Of all misdeeds, one after the other on one PLC; it ends with a good server."""
    rig = ClientRig(client, timing=("exact", "real")[seed % 2], seed=seed)
    rig.peer.reply = by_seed(seed)
    ends = [rig.read(wait_s=20) for _ in range(30)]
    assert "-" not in ends and ends.count("ok") >= 8, ends
    rig.peer.reply = right
    assert [rig.read(wait_s=20) for _ in range(3)][-2:] == ["ok", "ok"]


def test_there_are_enough_of_them() -> None:
    assert len(MISDEEDS) + len(RUDE_PEERS) >= 80
