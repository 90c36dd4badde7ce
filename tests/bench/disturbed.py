"""A plugin of pytest that disturbs the processes of the tests as a busy machine does, to find tests that measure too closely:

    PYTHONPATH=tests/bench pytest -p disturbed -n auto

In each process a thread makes bursts at random moments: objects that are kept for a moment, handles that are open for a
moment, 20 ms of processor time.  Beside it, a process of its own stops the tests' process for up to 200 ms, as other work of
the host does.  A test that measures objects, handles, memory, or time of the processor or the clock fails sooner here."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

BURST_S, KEPT_S, BUSY_S = 1.0, 0.3, 0.02
"""The mean time between two bursts, how long their objects are kept, and the processor time of each."""
OBJECTS, HANDLES = 2000, 3
"""Of each burst: half a megabyte, and what a compiler of C and its files need."""
STOP_S, STOPPED_S = 1.0, 0.2
"""The mean time between two stops, and the longest stop."""


class Disturbance:
    """The thread and the process that disturb this one, from its making to `end`."""

    def __init__(self) -> None:
        self._ended = threading.Event()
        self._kept: list[tuple[float, list[list[int]]]] = []
        threading.Thread(target=self._bursts, name="disturbance", daemon=True).start()
        self._stopping = subprocess.Popen([sys.executable, __file__, str(os.getpid())], start_new_session=True)

    def end(self) -> None:
        """The tests are over."""
        self._ended.set()
        self._stopping.terminate()
        self._stopping.wait()

    def _bursts(self) -> None:
        chance = random.Random()
        while not self._ended.wait(chance.expovariate(1 / BURST_S)):
            now_s = time.monotonic()
            self._kept = [(until_s, kept) for until_s, kept in self._kept if until_s > now_s]
            self._kept.append((now_s + KEPT_S, [[number] * 20 for number in range(OBJECTS)]))
            handles = [os.open(os.devnull, os.O_RDONLY) for _ in range(HANDLES)]
            began_s = time.thread_time()
            while time.thread_time() - began_s < BUSY_S:
                pass
            for handle in handles:
                with contextlib.suppress(OSError):  # a test may have closed it
                    os.close(handle)


def pytest_configure(config: pytest.Config) -> None:
    """The process that only hands out tests is left alone."""
    if getattr(config.option, "dist", "no") == "no" or hasattr(config, "workerinput"):
        disturbance = Disturbance()
        config.add_cleanup(disturbance.end)


def stop_now_and_then(process: int) -> None:
    """Stops a process at random until it has ended."""
    chance = random.Random()
    with contextlib.suppress(ProcessLookupError):
        while True:
            time.sleep(chance.expovariate(1 / STOP_S))
            os.kill(process, signal.SIGSTOP)
            time.sleep(chance.uniform(0, STOPPED_S))
            os.kill(process, signal.SIGCONT)


if __name__ == "__main__":
    stop_now_and_then(int(sys.argv[1]))
