"""What is told of a run of tests: where it has failed, and the values of places of its PLCs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fbvm import Plc, compile_text
from fbvm.base.diagnostics import Source
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.items.execution import ItemsExecution, ItemsSession, NoTests, _failure, _line, _placed, _shown
from fbvm.campaign.items.watched import Violated
from fbvm.campaign.judge import NEVER, TEST, TRAP, Failure
from fbvm.campaign.plan import Judging, Plan
from fbvm.campaign.variants import Variant
from fbvm.code.image import Site
from fbvm.engine.trap import Trap
from fbvm.run.project import Project
from fbvm.run.varied import VariedRun
from fbvm.testing.rig import Trapped
from fbvm.testing.session import VARIED
from fbvm.testing.st_items import AssertFailed

NOTHING = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
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


class Session:
    """A session of pytest with these tests, each a function that is called with the run; keeps how often it has collected."""

    def __init__(self, *tests: Callable[[Any], None]) -> None:
        self.collected = 0
        self.config: Any = SimpleNamespace(stash={})
        self.items = [SimpleNamespace(config=SimpleNamespace(hook=SimpleNamespace(
            pytest_runtest_protocol=lambda item, nextitem, test=test: test(self.config.stash[VARIED])))) for test in tests]

    def perform_collect(self) -> None:
        self.collected += 1


def test_each_run_collects_anew_and_ends_with_the_first_failure() -> None:
    done: list[str] = []
    session = Session(lambda run: done.append("first"), lambda run: fail(), lambda run: done.append("third"))
    items = ItemsSession(Plan(NOTHING), session)  # type: ignore[arg-type]

    def fail() -> None:
        done.append("second")
        items.failure = Failure(TEST, "second")

    found = [items.result(Variant(number, 0, ())) for number in range(3)]
    assert [(result.number, result.failure and result.failure.text) for result in found] == [
        (0, "second"), (1, "second"), (2, "second")]
    assert done == ["first", "second"] * 3 and session.config.stash == {}
    assert session.collected == 2, "the first run has what the session began with"


def test_a_value_that_no_plc_has_and_conditions_that_fit_none_are_told() -> None:
    axes = (axis_from_text("Main.a=1,2"), axis_from_text("Main.b=1"), axis_from_text("cycle=10ms"))
    values = Variant(0, 0, (1, 0, 0))

    def uses(*names: str) -> Session:
        return Session(lambda run: run.used.update(names))

    assert ItemsSession(Plan(NOTHING, axes=axes), uses("Main.a", "Main.b")).result(values).failure is None  # type: ignore[arg-type]
    with pytest.raises(NoTests, match=r"^no PLC that these tests make has Main\.b$"):
        ItemsSession(Plan(NOTHING, axes=axes), uses("Main.a")).result(values)  # type: ignore[arg-type]
    judged = Plan(NOTHING, judging=Judging(never=("Main.Up",)))
    with pytest.raises(NoTests, match="these tests make no PLC by a fixture, of which conditions could hold"):
        ItemsSession(judged, uses()).result(Variant(0, 0, ()))  # type: ignore[arg-type]

    def makes(run: Any) -> None:
        run.plcs.append(varied("", 1))
        run.judge(run, 0)

    with pytest.raises(NoTests, match=r"the conditions fit no PLC that these tests make: .*Up"):
        ItemsSession(judged, Session(makes)).result(Variant(0, 0, ()))  # type: ignore[arg-type]
    known = Plan(NOTHING, judging=Judging(never=("Main.n > 5",)))
    assert ItemsSession(known, Session(makes)).result(Variant(0, 0, ())).scans == 1  # type: ignore[arg-type]


def test_the_latest_trace_of_a_run_is_kept_under_its_name_and_others_beside_it(tmp_path: Path) -> None:
    class Recorded(ItemsExecution):
        def within(self, body: Any, *options: str) -> Any:
            assert options[0] == "--fbvm-traces"
            for age, name in enumerate(("old", "older", "oldest")):
                (Path(options[1]) / name).write_text(name)
                os.utime(Path(options[1]) / name, (1000 - age, 1000 - age))
            return "result"

    path = tmp_path / "1.fbtrace"
    path.write_text("of an earlier campaign")
    result, kept = Recorded(Plan(NOTHING), ".").recorded(Variant(0, 0, ()), path)
    assert (result, [file.name for file in kept]) == ("result", ["1.fbtrace", "1.2.fbtrace", "1.3.fbtrace"])
    assert [file.read_text() for file in kept] == ["old", "older", "oldest"]

    class Silent(ItemsExecution):
        def within(self, body: Any, *options: str) -> Any:
            return "result"

    assert Silent(Plan(NOTHING), ".").recorded(Variant(0, 0, ()), path) == ("result", []) and not path.exists()
