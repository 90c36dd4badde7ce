"""The events of one scan, one by one: what is read and written, with old and new values, calls, rungs and contacts."""

from __future__ import annotations

import pytest

from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import Call, Contact, Cut, Event, Read, Return, Statement, Write
from fbvm.record.trace.observing import observing
from fbvm.watch.names import Names

TEXT = """FUNCTION_BLOCK Half
VAR_INPUT x : INT; END_VAR
VAR_OUTPUT y : INT; END_VAR
    y := x / 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR on AT W0.03 : BOOL := TRUE; off AT W0.04 : BOOL; n : INT := 6; big : LINT := -2; h : Half; s : STRING[3] := 'ab'; END_VAR
    n := n + 1;
    off := on;
    off := on;
    h(x := n);
    big := h.y;
    s := 'cd';
LADDER
    LD on
    ANDNOT off
    OUT W0.05
END_LADDER
END_PROGRAM
"""
SCAN = """\
8 Statement
8 Read n 0600
8 Write n 0600 0700
9 Statement
9 Read on 01
9 Write off 00 01
10 Statement
10 Read on 01
10 Write off 01 01
11 Statement
11 Read n 0700
11 Write h.x 0000 0700
11 Call Half
4 Statement
4 Read h.x 0700
4 Write h.y 0000 0300
11 Return Half
12 Statement
12 Read h.y 0300
12 Write big feffffffffffffff 0300000000000000
13 Statement
13 Write s 61620000 63640000
15 Statement of a rung
17 Read on 01
17 Read off 01
15 Contact True
16 Contact False
17 Contact False
17 Write ? 00 00
17 Statement
17 Read ? 00
17 Write W0.05 00 00
"""


def told(plc: Plc, event: Event) -> str:
    """An event in words; the line in front is that of its statement."""
    sites = plc.image.sites
    name = type(event).__name__
    if isinstance(event, Call | Return):
        body = plc.image.bodies[event.frame.body].name
        return f"{sites[event.frame.site].line} {name} {body}" if event.frame.site >= 0 else f"- {name} {body}"
    assert not isinstance(event, Cut) and isinstance(event, Statement | Read | Write | Contact)
    line = sites[event.site].line
    if isinstance(event, Statement):
        return f"{line} {name}" + (" of a rung" if event.is_rung else "")
    if isinstance(event, Contact):
        return f"{line} {name} {event.value}"
    names = Names(plc.image.symbols, plc.memory.areas)
    place = names.at(event.offset, event.bit if event.bit != WHOLE_BYTES else None)
    values = [event.value.hex()] if isinstance(event, Read) else [event.old.hex(), event.value.hex()]
    return " ".join([str(line), name, place.name.removeprefix("Main.") if place else "?", *values])


class Told:
    """Keeps the events of scans in words."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Nothing happens in phases here."""

    def event(self, plc: Plc, event: Event) -> None:
        """Adds an event."""
        self.lines.append(told(plc, event))


@pytest.mark.parametrize("stands_still", [True, False])
def test_the_events_of_a_scan(stands_still: bool) -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc, heard = Plc(image), Told()
    with observing(plc, heard, stands_still):
        assert plc.scan() is None
    assert "\n".join(line for line in heard.lines if not line.startswith("-")) + "\n" == SCAN
