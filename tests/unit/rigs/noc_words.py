"""Words of the NOC's mailbox by the names that its library gives them, for tests that look at them as a program does."""

from __future__ import annotations

from fbvm.units.port.noc import Noc
from fbvm.units.port.words import mailbox

BOX = mailbox(Noc.table.block, Noc.table.area, Noc.table.lines)
AREA = Noc.table.area
LINES, LINE, COMMAND, STATE = BOX.lines, BOX.lines.words, BOX.lines.commands, BOX.lines.states
HEAD_WORDS = BOX.word("MSTR_Modules[1]")[1]
"""Of each module."""
MODULES = 18
"""Slots 0 to 16 of the rack, and the port of the CPU."""


def _head(name: str) -> int:
    return BOX.word(f"MSTR_Modules[1].{name}")[0]


STATUS, RACK_SLOT, CONFIGURED, SERVICES = _head("Status"), _head("Rack_Slot"), _head("Configured"), _head("Services")
RESTART, OWN_IP, STATISTICS = _head("Restart"), _head("IP"), _head("Statistics")
TABLE_WORDS = BOX.word("MSTR_Modules[1].Statistics")[1]
_status = BOX.enumeration("MSTR_Modules[1].Status")
READY, RESTARTING, UNCONFIGURED = _status["ready"], _status["restarting"], _status["unconfigured"]
