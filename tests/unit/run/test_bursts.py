"""Scans in event pace that follow at once, on machine code: what the program gets to see, and in how many scans.

The network answers when somebody waits for it; the clock is a stand-in that never waits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import pytest
from test_run_loop import Clock

from fbvm import Etn21, Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.clock import Clock as PlcClock
from fbvm.engine.native import engine as native
from fbvm.run import loop as run_loop
from fbvm.run import run
from fbvm.run.running import MOST_AT_ONCE
from fbvm.wire.link import Connect, Event, Link, Opened, Received, Request, Send, Sent

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

MS = 1_000_000
POLL = """
PROGRAM Main
VAR
    Send_Switch AT CIO 1519.03 : BOOL; Receive_Switch AT CIO 1519.04 : BOOL; Open_Switch AT CIO 1519.02 : BOOL;
    Waiting AT D30001 : UINT; P AT D30018 : ARRAY[0..9] OF WORD; Reply AT D200 : ARRAY[0..1] OF WORD;
    State : INT; Exchanges : INT; Scans : INT; Sum : DINT;
END_VAR
    Scans := Scans + 1;
    CASE State OF
        0: P[0] := 1; P[2] := 16#C0A8; P[3] := 16#FA01; P[4] := 502; Open_Switch := TRUE; State := 1;
        1: IF NOT Open_Switch THEN State := 2; END_IF;
        3: IF NOT Send_Switch THEN State := 4; END_IF;
        5: IF NOT Receive_Switch THEN Exchanges := Exchanges + 1; Sum := Sum + WORD_TO_INT(Reply[0]); State := 2; END_IF;
    END_CASE;
    IF State = 2 THEN
        P[5] := 4; P[6] := 16#8200; P[7] := 16#6400; Send_Switch := TRUE; State := 3;
    ELSIF State = 4 AND Waiting = 4 THEN
        P[5] := 4; P[6] := 16#8200; P[7] := 16#C800; Receive_Switch := TRUE; State := 5;
    END_IF;
END_PROGRAM
"""


class Answering:
    """A real network, and its only link: each send is answered by four bytes when somebody waits."""

    virtual_time = driven = False
    address = ""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.told: list[Event] = []
        self.answers: list[Event] = []
        self.sent = 0
        self.looks = 0
        """How often somebody asked for events."""

    def attach(self, address: str) -> Link:
        return self

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        for request in requests:
            if isinstance(request, Connect):
                self.told.append(Opened(request.channel, 5000, request.remote))
            elif isinstance(request, Send):
                self.sent += 1
                self.told.append(Sent(request.channel, len(request.data)))
                self.answers.append(Received(request.channel, bytes([0, self.sent % 100, 0, 0])))

    @property
    def is_quiet(self) -> bool:
        return not self.told

    def events(self, now_ns: int) -> Sequence[Event]:
        self.looks += 1
        told, self.told = self.told, []
        return told

    def pass_by(self, refreshes: int) -> None:
        """It does not count them."""

    def wait(self, timeout_s: float) -> bool:
        self.clock.now_ns += 50_000 if self.answers else round(timeout_s * 1e9)
        return bool(self.answers)

    def serve(self, now_ns: int) -> Sequence[Link]:
        if not self.answers:
            return []
        self.told += self.answers
        self.answers.clear()
        return [self]

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    stand_in = Clock()
    monkeypatch.setattr(run_loop, "time", stand_in)
    return stand_in


@pytest.fixture(scope="module")
def image() -> Image:
    compilation = compile_text(POLL)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def polling(image: Image, clock: Clock) -> tuple[Plc, Answering]:
    plc, network = Plc(image, MS, engine="native"), Answering(clock)
    plc.attach(Etn21(0, "192.168.250.21"), network)
    return plc, network


@pytest.mark.slow
def test_a_burst_gives_what_single_scans_give(image: Image, clock: Clock) -> None:
    plc, network = polling(image, clock)
    assert run(plc, for_ns=20 * MS, pace="event") == "time"
    single, _ = polling(image, clock)
    single.watchers.append(lambda plc: None)
    exchanges = plc.read("Main.Exchanges")
    assert run(single, until=f"Main.Exchanges = {exchanges}", max_ns=1000 * MS, pace="event") == "until"
    assert isinstance(exchanges, int) and 20 < exchanges <= network.sent <= exchanges + 1
    assert single.read("Main.Sum") == plc.read("Main.Sum") == sum(number % 100 for number in range(1, exchanges + 1))
    assert plc.read("Main.Scans") == plc.scans == plc.scan_times.count


def test_an_answer_is_fetched_before_the_program_that_it_wakes(image: Image, clock: Clock) -> None:
    """Upon the answer: receive, end of the receive, next send, end of the send, nothing.  The network is asked where it has
    something to tell: the answer, and what became of the send."""
    plc, network = polling(image, clock)
    assert run(plc, for_ns=20 * MS, pace="event") == "time"
    network.serve(0)
    plc.scan_at_once(16, plc.now_ns, PlcClock(lambda: plc.now_ns + 1000))
    for _ in range(20):
        exchanges, looks = plc.read("Main.Exchanges"), network.looks
        network.serve(0)
        assert len(plc.scan_at_once(16, plc.now_ns, PlcClock(lambda: plc.now_ns + 1000))) == 5
        assert plc.read("Main.Exchanges") == exchanges + 1  # type: ignore[operator]
        assert network.looks == looks + 2


def test_more_events_than_a_unit_takes_at_once_reach_it_in_the_same_burst(image: Image, clock: Clock) -> None:
    plc, network = polling(image, clock)
    assert run(plc, for_ns=20 * MS, pace="event") == "time"
    network.answers.clear()
    network.told += [Received(1, bytes(1)) for _ in range(300)]
    before = plc.read("D30001")
    assert before == 0
    while plc.due_ns <= plc.now_ns or network.told:
        assert 0 < len(plc.scan_at_once(16, plc.now_ns, PlcClock(lambda: plc.now_ns + 1000))) < 16
    assert plc.read("D30001") == 300


@pytest.mark.slow
def test_a_burst_ends_so_that_others_have_their_turn(clock: Clock) -> None:
    """A program that asks its unit for something in each scan."""
    compilation = compile_text("""PROGRAM Main
        VAR Close_Switch AT CIO 1519.05 : BOOL; P AT D30018 : ARRAY[0..9] OF WORD; n : INT; END_VAR
        P[0] := 1; Close_Switch := TRUE; n := n + 1;
        END_PROGRAM""")
    assert compilation.image
    plc, network = polling(compilation.image, clock)
    served: list[int] = []
    serve = network.serve

    def noted(now_ns: int) -> Sequence[Link]:
        served.append(plc.scans)
        return serve(now_ns)

    network.serve = noted  # type: ignore[method-assign]
    assert run(plc, for_ns=40 * MS, pace="event") == "time"
    assert max(later - earlier for earlier, later in pairwise(served)) == MOST_AT_ONCE
    assert plc.read("D30027") == 0x2210


def test_time_ends_a_run_between_two_bursts(image: Image, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last cycle, which counts as gone when it begins, is made of bursts like those before it."""
    plc, _ = polling(image, clock)
    plc.cycle_ns = 1000 * MS
    bursts: list[int] = []
    at_once = plc.scan_at_once

    def counted(most: int, now_ns: int, clock: PlcClock) -> list[int]:
        times = at_once(most, now_ns, clock)
        bursts.append(len(times))
        return times

    monkeypatch.setattr(plc, "scan_at_once", counted)
    assert run(plc, for_ns=1010 * MS, pace="event") == "time"
    assert bursts[-1] == bursts[-2] == 5
    assert 10 * MS <= plc.now_ns < 11 * MS


def test_ctrl_c_in_a_burst_loses_no_scan(image: Image, clock: Clock) -> None:
    plc, network = polling(image, clock)
    assert run(plc, for_ns=20 * MS, pace="event") == "time"
    network.serve(0)
    scans, now_ns, looks = plc.scans, plc.now_ns, 0

    def interrupted() -> int:
        nonlocal looks
        looks += 1
        if looks == 3:
            raise KeyboardInterrupt
        return now_ns + looks

    with pytest.raises(KeyboardInterrupt):
        plc.scan_at_once(16, plc.now_ns, PlcClock(interrupted))
    assert (plc.scans, plc.now_ns) == (scans + 2, now_ns + 2)
    assert plc.read("Main.Scans") == plc.scans


def test_a_trap_ends_a_burst(clock: Clock) -> None:
    compilation = compile_text(POLL.replace("State := 4; END_IF;", "State := 4; Sum := Sum / Scans / (4 - State); END_IF;"))
    assert compilation.image
    plc, _ = polling(compilation.image, clock)
    assert run(plc, for_ns=20 * MS, pace="event") == "trap"
    assert plc.trap and plc.scans == plc.read("Main.Scans")
