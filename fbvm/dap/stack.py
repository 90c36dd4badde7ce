"""Threads and stacks: a thread a PLC, a frame a body in execution, and one for the scan below them."""

from __future__ import annotations

from fbvm.dap.session import Arguments, Body, DebugSession, Refusal, StackFrame
from fbvm.step.stepping import Stepping
from fbvm.watch.values import show_time


def threads(debug: DebugSession) -> Body:
    """threads: the PLCs, with their tasks."""
    rows = []
    for number, (name, plc) in enumerate(debug.running.plcs.items(), 1):
        facts = plc.session.facts
        tasks = ", ".join(f"{task.name} {show_time(task.interval_ns or facts.cycle_ns)[2:]}" for task in facts.image.tasks)
        rows.append({"id": number, "name": f"{name} / {tasks}" if tasks else name})
    return {"threads": rows}


def plc_of_thread(debug: DebugSession, number: object) -> str:
    """The PLC of a thread.  Raises Refusal."""
    names = list(debug.running.plcs)
    if not isinstance(number, int) or not 0 < number <= len(names):
        raise Refusal(f"there is no thread {number}")
    return names[number - 1]


def thread_of(debug: DebugSession, plc: str) -> int:
    """The thread of a PLC."""
    return list(debug.running.plcs).index(plc) + 1


def stack_trace(debug: DebugSession, arguments: Arguments) -> Body:
    """stackTrace: the bodies in execution, the innermost first, and the scan."""
    name = plc_of_thread(debug, arguments.get("threadId"))
    session = debug.plc(name)
    frames: list[tuple[StackFrame, Body]] = []
    statement = session.statement
    if statement is not None:
        frame, site = statement.frame, statement.site
        while frame.caller is not None:
            frames.append(_row(debug, session, StackFrame(name, frame, site)))
            frame, site = frame.caller, frame.site
    elif session.trap and session.trap.site.line:
        place = session.trap.site
        body: Body = {"name": place.pou, "source": debug.sources.source(place.file), **debug.sources.place(place)}
        frames.append((StackFrame(name, None, None), body))
    label = {"name": scan_text(session), "line": 0, "column": 0, "presentationHint": "label"}
    frames.append((StackFrame(name, None, None), label))
    first, levels = int(arguments.get("startFrame") or 0), int(arguments.get("levels") or 0)
    chosen = frames[first : first + levels if levels else None]
    rows = [{"id": debug.refer(frame), **row} for frame, row in chosen]
    return {"stackFrames": rows, "totalFrames": len(frames)}


def scan_text(session: Stepping) -> str:
    """`scan 41, 410ms`."""
    return f"scan {session.here.scan}, {show_time(session.now_ns)[2:]}"


def _row(debug: DebugSession, session: Stepping, frame: StackFrame) -> tuple[StackFrame, Body]:
    assert frame.frame is not None and frame.site is not None
    facts = session.facts
    name = facts.body_name(frame.frame.body)
    path = session.names.instance(frame.frame.base)
    row: Body = {"name": f"{name}  {path}" if path and path.upper() != name.upper() else name}
    site = facts.sites[frame.site]
    rung = next((rung for rung in reversed(facts.rungs) if rung.body == frame.frame.body and not rung.is_text
                 and facts.sites[rung.site].line <= site.line), None)  # fmt: skip
    if rung is not None:
        row["name"] += f"  rung {rung.number}" + (f" {rung.comment}" if rung.comment else "")
    source = debug.sources.source(site.file)
    if "path" in source and "sourceReference" in source:
        source["presentationHint"] = "deemphasize"
    return frame, {**row, "source": source, **debug.sources.place(site), "canRestart": True}
