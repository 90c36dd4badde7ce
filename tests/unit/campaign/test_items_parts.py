"""What is told of a run of tests: where it has failed, and the values of places of its PLCs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fbvm import Plc, compile_text
from fbvm.campaign.items.execution import ItemsSession, _failure, _line, _placed, _shown
from fbvm.campaign.items.watched import Violated
from fbvm.campaign.judge import NEVER, TEST, TRAP, Failure
from fbvm.campaign.plan import Plan
from fbvm.campaign.variants import Variant
from fbvm.code.image import Site
from fbvm.engine.trap import Trap
from fbvm.run.varied import VariedRun
from fbvm.testing.rig import Trapped
from fbvm.testing.st_items import AssertFailed

TEXT = "PROGRAM Main VAR n, pump : INT; END_VAR n := n + 1; END_PROGRAM"


def varied(name: str, scans: int) -> Any:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    plc.run(scans=scans)
    return SimpleNamespace(name=name, plc=plc, find=plc.find)


def run(*plcs: Any) -> VariedRun:
    return SimpleNamespace(plcs=list(plcs))  # type: ignore[return-value]


def test_a_value_is_that_of_the_first_plc_that_has_the_place() -> None:
    pump, tank = varied("pump", 3), varied("tank", 5)
    names = ("Main.n", "pump.Main.n", "tank.Main.n", "Main.nothing", "other.Main.n", "n")
    assert [_shown(run(pump, tank), name) for name in names] == [3, 3, 5, "", "", ""]
    assert [_shown(run(varied("", 7)), name) for name in ("Main.n", "pump.Main.n", ".Main.n")] == [7, "", ""]
    assert _shown(run(), "Main.n") == ""


def test_a_failure_lies_in_the_last_scan_of_its_plc() -> None:
    found = _placed(Failure(TEST, "t", code="c", file="f", pou="p", line=3, detail="d"), varied("pump", 4))
    assert found == Failure(TEST, "t", "pump", 3, 30_000_000, "c", "f", "p", 3, "d")
    assert _placed(Failure(TEST, "t"), varied("", 4)).plc == "plc"


def test_a_run_is_summed_over_its_plcs() -> None:
    session: Any = SimpleNamespace(failure=Failure(TEST, "t"), _plan=Plan(SimpleNamespace(plcs=()), shown=("Main.n",)))  # type: ignore[arg-type]
    one, other = varied("", 3), varied("", 5)
    found = ItemsSession._summed(session, Variant(7, 0, ()), run(one, other))
    assert (found.number, found.scans, found.time_ns, found.shown) == (7, 8, 50_000_000, (3,))
    assert found.failure and (found.failure.scan, found.failure.now_ns) == (4, 40_000_000)
    turned = ItemsSession._summed(session, Variant(7, 0, ()), run(other, one))
    assert turned.memory != found.memory and turned.failure == found.failure
    alone = ItemsSession._summed(session, Variant(7, 0, ()), run())
    assert (alone.scans, alone.time_ns, alone.memory, alone.failure, alone.shown) == (0, 0, 0, Failure(TEST, "t"), ("",))


SITE = Site("mix.st", "Main", 14, 5)


def failed(error: Exception, *entries: tuple[str, int], item: str = "tests/test_a.py") -> Failure:
    path = Path(item).absolute()
    raised: Any = SimpleNamespace(value=error, exconly=lambda: f"{type(error).__name__}: {error}\nmore",
                                  traceback=[SimpleNamespace(path=Path(name).absolute(), lineno=line) for name, line in entries])
    tested: Any = SimpleNamespace(nodeid="tests/test_a.py::test_a", path=path, reportinfo=lambda: (path, 8, "test_a"))
    return _failure(tested, SimpleNamespace(excinfo=raised), SimpleNamespace(longreprtext=""))  # type: ignore[arg-type]


def test_a_trap_and_an_assert_are_told_with_the_line_of_the_program() -> None:
    trapped = failed(Trapped(Trap("R0102", SITE, (), "index 9 is outside")))
    assert (trapped.kind, trapped.code, trapped.file, trapped.pou, trapped.line) == (TRAP, "R0102", "mix.st", "Main", 14)
    assert trapped.detail == "tests/test_a.py::test_a: Trapped: index 9 is outside"
    said = failed(AssertFailed(SITE, 5, 0, []))
    assert (said.kind, said.text, said.file, said.pou, said.line) == (TEST, "tests/test_a.py::test_a", "mix.st", "Main", 14)
    assert said.detail == f"AssertFailed: {SITE}: ASSERT failed in scan 5"


def test_other_failures_are_told_with_the_last_line_of_the_test() -> None:
    entries = (("tests/test_a.py", 3), ("tests/test_a.py", 5), ("fbvm/other.py", 7))
    said = failed(ValueError("wrong"), *entries)
    assert (said.kind, said.text, said.file, said.line, said.detail) == (
        TEST, "tests/test_a.py::test_a", "tests/test_a.py", 6, "ValueError: wrong")
    violated = failed(Violated(Failure(NEVER, "Main.Up", "plc", 3, 5, file="x", line=1)), *entries)
    assert violated == Failure(NEVER, "Main.Up", "plc", 3, 5, file="tests/test_a.py", line=6, detail="tests/test_a.py::test_a")
    assert failed(ValueError("wrong"), ("fbvm/other.py", 7)).line == 9, "the test begins there"


def test_what_fails_without_an_error_is_told_by_its_report() -> None:
    item: Any = SimpleNamespace(nodeid="a::b", path=Path("a.py").absolute(), reportinfo=lambda: (Path("a.py"), None, ""))
    call: Any = SimpleNamespace(excinfo=None)
    found = _failure(item, call, SimpleNamespace(longreprtext="first\nlast"))  # type: ignore[arg-type]
    assert (found.detail, found.line, _line(item, call)) == ("last", 1, 1)


@pytest.mark.parametrize("name", ["Main.pump", "pump.Main.pump"])
def test_a_name_that_begins_as_a_plc_is_called_is_a_path_in_it(name: str) -> None:
    assert _shown(run(varied("pump", 1)), name) == 0
