"""What all tests rely on."""

from __future__ import annotations

import gc
import signal

# A shell's background jobs ignore Ctrl-C, and so would every program that a test starts and ends by it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Thousands of tests stay where they are until the end: the host need not look through them again and again."""
    gc.collect()
    gc.freeze()
