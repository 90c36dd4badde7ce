"""What log points say: of a slice so many lines at most, and how many more there were."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client

from fbvm.dap import adapter

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("most", "said", "more"), [(3, 3, ["... 2 more\n"]), (4, 4, ["... 1 more\n"]), (5, 5, []), (6, 5, [])])
def test_of_many_log_points_in_a_slice_the_first_are_told_and_the_number_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int, said: int, more: list[str]
) -> None:
    monkeypatch.setattr(adapter, "MOST_SAID", most)
    file = tmp_path / "a.st"
    loop = "    FOR i := 1 TO 5 DO\n        n := n + 1;\n    END_FOR;\n"
    file.write_text(f"PROGRAM Main\nVAR n, i : INT; END_VAR\n{loop}END_PROGRAM\n", encoding="utf-8")
    client = Client()
    client.begin({"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": [{"line": 4, "logMessage": "{n}"}]}},
                 program=str(file), stopOnEntry=True)  # fmt: skip
    client.go("fbvm/stepScan")
    told = [row for row in client.events("output") if "source" in row]
    assert [row["output"] for row in told] == [f"scan 0, 0s: {number}\n" for number in range(said)]
    assert {row["line"] for row in told} == {4}
    assert [row["output"] for row in client.events("output") if "source" not in row] == more
