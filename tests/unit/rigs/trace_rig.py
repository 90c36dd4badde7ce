"""A small program, recorded into memory."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.writer import Depth, TraceWriter, source_lines

TEXT = """\
TYPE Level : (Low, High) := Low; END_TYPE
TYPE Pair : STRUCT a : INT; b : REAL; END_STRUCT END_TYPE
PROGRAM Main
VAR
    Start AT CIO 0.00 : BOOL;
    Pump AT CIO 100.00 : BOOL;
    Delay : TON;
    Starts : CTU;
    Mode : Level;
    Both : ARRAY[1..2] OF Pair;
    Text : STRING[12];
    Few : INT(0..9);
    Words : ARRAY[0..99] OF WORD;
END_VAR
    Delay(IN := Start, PT := T#50ms);
    Starts(CU := Delay.Q, PV := 10);
    Pump := Delay.Q;
    IF Pump AND Starts.CV > 0 THEN
        %D200 := 7;
        Mode := High;
        Text := 'on';
    END_IF
    Both[2].b := Both[2].b + 0.5;
END_PROGRAM
"""


def image(text: str = TEXT) -> Image:
    made = compile_text(text, "pump.st").image
    assert made is not None
    return made


def press(plc: Plc) -> None:
    """ON in scan 3, OFF in scan 150."""
    if plc.scans in (3, 150):
        plc.write("CIO 0.00", plc.scans == 3)


def record(
    plc: Plc, scans: int, depth: Depth = Depth.SCANS, selected: Sequence[str] = (), before: Callable[[Plc], None] = press
) -> bytes:
    """The trace of so many scans."""
    file = io.BytesIO()
    writer = TraceWriter(plc, file, depth, selected, source_lines(plc.image, {"pump.st": TEXT}))
    for _ in range(scans):
        before(plc)
        plc.scan()
    writer.close()
    assert writer.size_bytes == len(file.getvalue())
    return file.getvalue()


def traced(scans: int = 300, depth: Depth = Depth.SCANS, selected: Sequence[str] = ()) -> Trace:
    return Trace(io.BytesIO(record(Plc(image()), scans, depth, selected)))
