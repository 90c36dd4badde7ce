"""The debug adapter on a project of TwinCAT: breakpoints and frames are in the files of its objects."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "twincat"


@pytest.mark.slow
def test_a_breakpoint_in_an_object_stops_there_in_its_file() -> None:
    file = FOLDER / "FB_Conveyor.TcPOU"
    client = Client()
    client.begin({"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": [{"line": 16}]}},
                 program=str(FOLDER / "Conveyor.plcproj"))  # fmt: skip
    client.go("continue")
    assert client.frames[0]["source"] == {"name": file.name, "path": str(file)} and client.line == 16
