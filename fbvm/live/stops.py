"""Breakpoints that pages set, and where a scan stands at one."""

from __future__ import annotations

from typing import Any

from fbvm.live.messages import MessageError
from fbvm.live.plcs import LivePlc
from fbvm.machine.breakpoints import Breakpoint, Halt

MOST_BREAKPOINTS = 100
STATEMENT = "statement"


def set_breakpoint(live: LivePlc, kind: str, where: str, when: str = "", hits: str = "") -> Breakpoint:
    """Sets a breakpoint as `Breakpoints` takes it, by its kind: "line", "change" or "condition".

    Raises MessageError, and what `Breakpoints` raises."""
    rows = live.plc.breakpoints
    if len(rows) >= MOST_BREAKPOINTS:
        raise MessageError(f"there are {MOST_BREAKPOINTS} breakpoints already")
    if kind == "line":
        return rows.line(where, when, hits)
    if kind == "change":
        return rows.change(where, when, hits)
    if kind == "condition":
        return rows.condition(where, hits)
    raise MessageError(f"a breakpoint is a line, a change or a condition, not {kind[:20]!r}")


def shown_breakpoints(live: LivePlc) -> list[Breakpoint]:
    """Those that somebody has set, in their order."""
    return [row for row in live.plc.breakpoints if row.kind != STATEMENT]


def stop_at_next_statement(live: LivePlc) -> None:
    """Lets the PLC stand before its next statement; `forget_statement` ends that."""
    if not any(row.kind == STATEMENT for row in live.plc.breakpoints):
        live.plc.breakpoints.statement()


def forget_statement(live: LivePlc) -> None:
    """To be called when a scan stands: further statements stop it no more."""
    for row in list(live.plc.breakpoints):
        if row.kind == STATEMENT:
            live.plc.breakpoints.remove(row)


def halt_row(live: LivePlc, halt: Halt) -> dict[str, Any]:
    """Where a scan stands, as pages show it: the statement that comes next, the instance, and why."""
    frame, site = halt.frames[0], halt.site
    said = [reason for reason, row in zip(halt.reasons, halt.breakpoints, strict=True) if row.kind != STATEMENT]
    file, line = (site.file, site.line) if site else ("", 0)
    return {"scan": halt.scan, "file": file, "line": line, "instance": live.names.instance(frame.base) if frame.base else "",
            "pou": frame.pou, "why": "; ".join(said)}  # fmt: skip
