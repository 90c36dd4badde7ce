"""The debugger on a recording, scan by scan: its end is behind the last statement of its last scan, not before."""

from __future__ import annotations

import pytest
from dap_client import Client, RefusedError
from test_adapter_plants import COUNTER, past

END = "this is the end of the recording"


@pytest.mark.slow
def test_a_recording_is_gone_through_to_the_end_of_its_last_scan() -> None:
    client = Client(lambda how, arguments: past(COUNTER.format(step=1), 5))
    client.begin()
    client.go("fbvm/gotoScan", scan=3)
    stops = []
    while True:
        stops.append((client.frames[-1]["name"], client.line, client.value("Main.n")))
        try:
            client.go("next")
        except RefusedError as refused:
            assert str(refused) == END
            break
    assert stops == [("scan 3, 30ms", 3, "3"), ("scan 3, 30ms", 0, "4"), ("scan 4, 40ms", 3, "4"), ("scan 4, 40ms", 0, "5")]
    for command in ("continue", "stepIn", "stepOut", "fbvm/stepScan"):
        with pytest.raises(RefusedError, match=END):
            client.ask(command, threadId=1)
    assert client.go("fbvm/stepBackScan")["description"] == "back in scan 4, 40ms"
    assert client.go("fbvm/stepBackScan", scans=2)["description"] == "back in scan 2, 20ms"
    assert client.go("fbvm/stepScan", scans=2)["description"] == "scan 4, 40ms"
