"""Ctrl-C: it ends a run between two scans, or at once while the run waits, and loses nothing that was half done."""

from __future__ import annotations

import signal
from collections.abc import Iterable

import pytest
from test_bursts import MS, POLL, Answering
from test_run_loop import Clock

from fbvm import Etn21, Plc, compile_text
from fbvm.run import loop as run_loop
from fbvm.run import run
from fbvm.run.interrupts import Interrupts
from fbvm.wire.link import Request, Send


class Interrupted(Answering):
    """Ctrl-C comes while something is being sent, or while somebody waits."""

    def __init__(self, clock: Clock, sends: int = 0, waits: int = 0) -> None:
        super().__init__(clock)
        self.sends, self.waits = sends, waits

    def submit(self, requests: Iterable[Request], now_ns: int) -> None:
        for request in requests:
            if isinstance(request, Send) and self.sends:
                self.sends -= 1
                signal.raise_signal(signal.SIGINT)
            super().submit([request], now_ns)

    def wait(self, timeout_s: float) -> bool:
        if self.waits:
            self.waits -= 1
            signal.raise_signal(signal.SIGINT)
        return super().wait(timeout_s)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    stand_in = Clock()
    monkeypatch.setattr(run_loop, "time", stand_in)
    return stand_in


@pytest.mark.parametrize(("engine", "sends", "waits"), [("native", 5, 0), ("native", 0, 5), ("python", 5, 0)])
def test_exchanges_go_on_after_ctrl_c(clock: Clock, engine: str, sends: int, waits: int) -> None:
    image = compile_text(POLL).image
    assert image
    plc, network = Plc(image, MS, engine=engine), Interrupted(clock, sends, waits)
    plc.attach(Etn21(0, "192.168.250.21"), network)
    for _ in range(5):  # on the Python engine this network never lets it wait
        assert run(plc, for_ns=1000 * MS, pace="event") == "interrupted"
    assert run(plc, until="Main.Exchanges >= 20", max_ns=100_000 * MS, pace="event") == "until"
    assert plc.read("Main.Sum") == sum(range(1, 21))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_second_one_does_not_wait() -> None:
    with Interrupts() as interrupts:
        signal.raise_signal(signal.SIGINT)
        assert interrupts.noted
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_whoever_has_a_handler_keeps_it() -> None:
    told: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: told.append(number))
    try:
        with Interrupts() as interrupts:
            signal.raise_signal(signal.SIGINT)
        assert (told, interrupts.noted) == ([signal.SIGINT], False)
    finally:
        signal.signal(signal.SIGINT, before)
