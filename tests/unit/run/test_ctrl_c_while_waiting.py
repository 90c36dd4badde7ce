"""Ctrl-C is noted within a scan, and ends a wait at once."""

from __future__ import annotations

import signal

import pytest

from fbvm.run import loop
from fbvm.run.interrupts import Interrupts


def test_ctrl_c_ends_a_wait_at_once_and_is_noted_otherwise() -> None:
    with Interrupts() as interrupts:
        interrupts.begin_wait()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert not interrupts.noted
        interrupts.waits = False
        interrupts.check()
        signal.raise_signal(signal.SIGINT)
        assert interrupts.noted
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
        with pytest.raises(KeyboardInterrupt):
            interrupts.begin_wait()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_behind_the_wait_for_a_scan_ctrl_c_is_noted_again() -> None:
    with Interrupts() as interrupts:
        now_ns, _ = loop._RealClock([], [], 0, interrupts).reach(1_000_000)
        assert now_ns >= 1_000_000 and not interrupts.waits
