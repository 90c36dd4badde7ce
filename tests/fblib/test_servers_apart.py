"""No byte of one connection reaches another, whichever server, whichever engine, whoever resets when."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from server_rig import ENGINES, KINDS, READ, SMALL, Caller, ServerRig

import fbvm.net.stream

every_kind = pytest.mark.parametrize("kind", KINDS)
ENDS = {"fin": False, "reset": True}
WINDOW_BYTES = 700
UNREAD = 8
"""Requests whose replies have no room in such a window on the way to a client that reads nothing."""


@pytest.fixture(autouse=True)
def small_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replies that nobody takes wait in the program and the unit after a few requests, not after hundreds."""
    monkeypatch.setattr(fbvm.net.stream, "WINDOW_BYTES", WINDOW_BYTES)


def rig_of(kind: str, engine: str, **options: object) -> ServerRig:
    if engine == "native":
        pytest.importorskip("llvmlite")
    return ServerRig(kind, engine=engine, **options)  # type: ignore[arg-type]


def next_client_is_served(rig: ServerRig, caller: Caller) -> None:
    """Somebody else asks with the connection, and again later; the replies are those and no others."""
    caller.dial(SMALL)
    caller.wait_for_replies()
    caller.ask(SMALL, SMALL)
    caller.wait_for_replies()


@pytest.mark.parametrize("engine", ENGINES)
@every_kind
def test_replies_that_nobody_took_are_not_for_the_next_client(kind: str, engine: str) -> None:
    """The first asks much, reads nothing and resets: whatever waits in the program, the unit or the network is gone."""
    rig = rig_of(kind, engine)
    first, second = rig.caller(), rig.caller()
    first.dial(*[READ] * UNREAD, reads=False)
    rig.scan(UNREAD * 4)
    assert len(first.unanswered) == UNREAD
    first.hang_up(reset=True)
    next_client_is_served(rig, second)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("end", ENDS)
@every_kind
def test_a_reset_at_every_point_of_an_exchange(kind: str, end: str, engine: str) -> None:
    """One client after the other on one PLC: each leaves a scan later in the exchange than the one before."""
    rig = rig_of(kind, engine)
    first, second = rig.caller(), rig.caller()
    for reads in (True, False):
        for point in range(times(14, deep=3)):
            first.dial(READ, reads=reads)
            first.ask(SMALL, READ)
            first.say(SMALL[:3])
            rig.scan(point)
            assert len(first.unanswered) <= 3
            first.hang_up(reset=ENDS[end])
            next_client_is_served(rig, second)
            second.hang_up(reset=point % 2 == 0)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("seed", range(times(8)))
@every_kind
def test_any_mixture_of_clients(kind: str, seed: int, engine: str) -> None:
    """Connect, ask, pipeline, say a part of a request, read or not, close and reset, as it comes."""
    dice = Random(seed)
    rig = rig_of(kind, engine, clients=dice.choice((1, 2, 3)), timing=dice.choice(("exact", "real")), seed=seed,
                 latency_ns=dice.choice((0, 0, 3_000_000, 25_000_000)))  # fmt: skip
    callers = [rig.caller() for _ in range(4)]
    for _ in range(150):
        caller = dice.choice(callers)
        match dice.choice(("call", "ask", "ask", "pipeline", "part", "read on", "fin", "reset", "wait", "wait")):
            case "call":
                caller.call(*[SMALL] * dice.choice((0, 1, 3)), reads=dice.random() < 0.6)
            case "ask":
                caller.ask(dice.choice((SMALL, READ)))
            case "pipeline":
                caller.ask(*[dice.choice((SMALL, READ))] * dice.choice((2, 50, UNREAD)))
            case "part":
                caller.say(b"\0")
                caller.hang_up(reset=dice.random() < 0.5)
            case "read on":
                caller.read_on()
            case "fin" | "reset" as end:
                caller.hang_up(reset=ENDS[end])
            case "wait":
                pass
        rig.scan(dice.choice((0, 1, 1, 2, 5, 40)))
        for each in callers:
            assert each.unanswered is not None, "and what has come is theirs"
    for caller in callers:
        caller.hang_up(reset=True)
    rig.scan(10)
    next_client_is_served(rig, callers[0])


@pytest.mark.slow
@every_kind
def test_what_comes_with_the_connection_is_served(kind: str) -> None:
    """Whatever is no valid request has its exception; nobody is closed who said frames."""
    dice = Random(7)
    rig = ServerRig(kind)
    caller = rig.caller()
    for size in 4 * [1, 1, 2, 3, 4, 5, 5, 5, 6, 7, 13, 60, 252, 253]:
        pdu = bytes((dice.choice((*rig.kind.functions, dice.randrange(1, 128))), *dice.randbytes(size - 1)))
        caller.dial(pdu)
        caller.wait_for_replies()
