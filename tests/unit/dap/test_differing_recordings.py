"""The exception filter `differs`: a recording whose scans come out differently here."""

from __future__ import annotations

import io

import pytest
from dap_client import Client

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.dap.target import Target
from fbvm.machine.plc import Plc
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.recording.file_writer import Described, RecordingWriter
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.recording import Recording
from fbvm.record.trace.writer import Depth
from fbvm.step.past_session import PastSession

COUNTER = "PROGRAM Main VAR n : DINT; END_VAR n := n + 1; END_PROGRAM"
OTHER = COUNTER.replace("n + 1", "n + SEL(n = 25, DINT#1, DINT#0)")  # scan 25 is the first that differs


def image(text: str) -> Image:
    made = compile_text(text).image
    assert made is not None
    return made


def recording(here: str) -> Target:
    """A recording of 40 scans of the counter by another version, with another program in this one."""
    plc, file = Plc(image(COUNTER)), io.BytesIO()
    made = Recording(file=RecordingWriter(file, "0.1", True))
    made.add("counter", plc, Described(ProgramText((("text.st", COUNTER),))))
    plc.run(scans=40)
    made.close()
    read = RecordingFile(io.BytesIO(file.getvalue()), images={"counter": image(here)}, version="9.9")["counter"]
    return Target({"counter": PastSession(FileScans(read, Depth.STATEMENTS), "counter")}, {"text.st": here})


@pytest.mark.parametrize(("here", "differs"), [(OTHER, True), (COUNTER, False)])
def test_a_scan_that_differs_from_the_recording_stops_both_ways(here: str, differs: bool) -> None:
    client = Client(lambda how, arguments: recording(here))
    client.begin({"setExceptionBreakpoints": {"filterOptions": [{"filterId": "differs"}]}})
    stops = [client.go("reverseContinue"), client.go("reverseContinue"), client.go("continue")]
    said = [stop["description"] for stop in stops if stop["reason"] == "exception"]
    assert said == ["scan 25 comes out differently here: its memory is not the recorded one"] * (2 if differs else 0)
    if differs:
        assert client.ask("exceptionInfo", threadId=1)["exceptionId"] == "differs"
        assert client.frames[-1]["name"].startswith("scan 26")
