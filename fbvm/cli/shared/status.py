"""The exit statuses of the command `fbvm`."""

from __future__ import annotations

GOOD = 0
FAILED = 1
USAGE = 2
PROGRAM_ERRORS = 3
STOPPED = 4
NETWORK = 5
INTERRUPTED = 130
OUTPUT_CLOSED = 141
