"""What tshark says of a capture."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

TSHARK = shutil.which("tshark")
WRONG = "_ws.malformed || tcp.checksum.status == 0 || ip.checksum.status == 0 || ({}_ws.expert.severity >= 6291456)"
"""Malformed, a wrong checksum, or a warning or error of any dissector."""


def tshark(capture: Path, *arguments: str) -> list[str]:
    """The words that tshark prints about a capture."""
    command = [str(TSHARK), "-n", "-r", str(capture), "-o", "tcp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def dissected(capture: Path, with_resets: bool = False) -> list[str]:
    """Function codes of the Modbus frames that tshark finds, if it has nothing to say against the capture.

    It warns of each RST, which is right `with_resets`: a server may close with linger.  An empty list where tshark is not
    installed."""
    if not TSHARK:
        return []
    assert tshark(capture, "-Y", WRONG.format("!tcp.flags.reset == 1 && " if with_resets else "")) == []
    return tshark(capture, "-Y", "modbus", "-T", "fields", "-e", "modbus.func_code")
