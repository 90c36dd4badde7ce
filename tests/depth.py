"""How much the tests try: what fits into a whole run, or with `pytest --deep` many times that.

`--deep` takes hours, not minutes: it is for the night, and for the day on which a piece of work is finished.
"""

from __future__ import annotations

import os

SWITCH = "FBVM_TESTS_DEEP"
"""Set by `--deep`, also for the processes of pytest-xdist."""


def times(count: int, deep: int = 20) -> int:
    """`count` examples, seeds, scans or connections in every run, `deep` times as many with `--deep`."""
    return count * deep if os.environ.get(SWITCH) else count
