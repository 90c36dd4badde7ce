"""Suites of TwinCAT in parts: what the log and the flags say, where tests failed, what pytest is told of each."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.base.types import BOOL
from fbvm.code.image import Site
from fbvm.record.trace.events import Call, Frame, Return
from fbvm.testing.subject import SubjectError
from fbvm.testing.suites import items, program, results
from fbvm.testing.suites.items import SuiteItem, SuitesFile, SuiteTestFailed
from fbvm.testing.suites.plugin import pytest_sessionfinish
from fbvm.testing.suites.program import FoundTest, find_suites
from fbvm.testing.suites.results import Failure, SuiteRun, SuiteTestResult
from fbvm.watch.paths import UnknownPlace

# --- the log and the flags ----------------------------------------------------------------------------------------------


def plc_of(values: dict[str, Any], scans: int = 8, now_ns: int = 70) -> Any:
    return SimpleNamespace(read=lambda name: values[name], scans=scans, now_ns=now_ns)


def test_failures_are_read_from_the_log_until_its_last_line() -> None:
    values: dict[str, Any] = {"TwinCAT_LogCount": 0}
    log = results._Log(plc_of(values))

    def write(text: str, mask: int = 4) -> None:
        at = values["TwinCAT_LogCount"] % 256
        values[f"TwinCAT_Log[{at}].Text"], values[f"TwinCAT_Log[{at}].Mask"] = text, mask
        values["TwinCAT_LogCount"] += 1

    write("FAILED TEST 'Main.suite@adds', EXP: 4, ACT: 5, MSG: wrong\nsum")
    write("FAILED TEST 'Main.suite@adds', EXP: 6, ACT: 7", mask=1)
    write("something else")
    log.look()
    log.look()
    assert [(path, name, each.text, each.scan, each.now_ns) for path, name, each in log.failures] == [
        ("Main.suite", "adds", "EXP: 4, ACT: 5, MSG: wrong\nsum", 7, 70)]
    assert not log.is_over
    write("| ===================================== done")
    for number in range(300):
        write(f"FAILED TEST 'a@b', EXP: {number}")
    log.look()
    assert [each.text for _, _, each in log.failures][1:] == [f"EXP: {number}" for number in range(44, 300)], "the last 256"
    assert not log.is_over
    write("| =====================================")
    log.look()
    write("behind")
    log.look()
    assert log.is_over and len(log.failures) == 257


def test_flags_say_in_which_scan_a_test_has_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = bytearray(10)

    def find(symbols: Any, areas: Any, name: str) -> Any:
        number = int(name.partition("[")[2].partition("]")[0])
        if number > {"A": 2, "B": 1}[name[0]]:
            raise UnknownPlace(name)
        place = object.__new__(results.Place)
        object.__setattr__(place, "offset", number + 4 * (name[0] == "B"))
        object.__setattr__(place, "bit", None)
        object.__setattr__(place, "hops", ())
        return place

    plc = cast(Any, SimpleNamespace(image=SimpleNamespace(symbols={}), memory=SimpleNamespace(areas={}, u8=memory), scans=1))
    monkeypatch.setattr(results, "find", find)
    failed = results._FailedIn(plc, ["A", "B"])
    assert results._flags(plc, ["A", "B"]) == {("A", 1): 1, ("A", 2): 2, ("B", 1): 5}
    failed.look()
    assert failed.scans == {}
    memory[2], plc.scans = 1, 5
    failed.look()
    memory[5], plc.scans = 1, 9
    failed.look()
    assert failed.scans == {("A", 2): 4, ("B", 1): 8}


@each_of("bit, hops, found", [(None, (), True), (None, (9,), False), (0, (), False), (0, (9,), False)])
def test_a_flag_is_looked_at_where_it_is_a_byte_at_a_fixed_place(bit: int | None, hops: tuple[int, ...], found: bool) -> None:
    plc = cast(Any, SimpleNamespace(image=SimpleNamespace(symbols={}), memory=SimpleNamespace(areas={})))
    places = iter([results.Place("Tests[1].TestIsFailed", BOOL, 7, bit, hops)])

    def find(*given: Any) -> Any:
        for place in places:
            return place
        raise UnknownPlace("no more")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "find", find)
        assert results._flags(plc, ["A"]) == ({("A", 1): 7} if found else {})


@each_of("scan, before", [(50, 30), (20, 0), (21, 1), (5, 0)])
def test_scans_in_front_of_a_failure_are_recorded_too(scan: int, before: int) -> None:
    done: list[Any] = []

    class Again:
        scans = 0
        now_ns = 4711

        def run(self, scans: int) -> None:
            done.append(("run", scans))
            self.scans += scans

    plc = Again()
    test, other = SuiteTestResult(True, True, False, 1, 0.0, [Failure("a", 99, 9)]), SuiteTestResult(True, True, False, 1, 0.0,
    [])
    crowd = SuiteTestResult(True, True, False, 9, 0.0, [Failure("b", 98, 9)] * 6)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "_plc", lambda image: done.append("power") or plc)
        patch.setattr(results, "Recording", lambda: SimpleNamespace(add=lambda name, plc: (done.append("recorded"), "scans")[1]))
        patch.setattr(results, "_place", lambda recorded, failures: done.append((recorded, len(failures))))
        results._show_again(cast(Any, None), [(scan, test), (scan, other), (scan + 1, crowd)])
    assert done == ["power", ("run", before), "recorded", ("run", scan + 1 - before), ("scans", 1)]
    assert (test.failures[0].scan, test.failures[0].now_ns, test.recorded, other.recorded, crowd.recorded) == (
        scan, 4711, "scans", "scans", None)


def test_scans_with_failures_are_shown_again_behind_a_run() -> None:
    test, shown = SuiteTestResult(True, True, False, 1, 0.0, []), []
    plc = SimpleNamespace(elapsed_ns=results.LIMIT_NS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "_plc", lambda image: plc)
        patch.setattr(results, "_results", lambda plc, path: [("adds", test)])
        patch.setattr(results, "_FailedIn", lambda plc, suites: SimpleNamespace(scans={("Main.suite", 1): 7, ("gone", 1): 8}))
        patch.setattr(results, "_show_again", lambda image, failed: shown.extend(failed))
        made = results.run_suites(cast(Any, SimpleNamespace(bodies=[])), ["Main.suite"])
    assert shown == [(7, test)] and made.results == {("Main.suite", "adds"): test} and not made.is_over


def test_so_many_scans_are_shown_again_and_no_more() -> None:
    done: list[str] = []
    failed = [(scan, SuiteTestResult(True, True, False, 1, 0.0, [])) for scan in range(30, 0, -1)]
    plc = SimpleNamespace(run=lambda scans: None, scans=0, now_ns=0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "_plc", lambda image: done.append("power") or plc)
        patch.setattr(results, "Recording", lambda: SimpleNamespace(add=lambda name, plc: "scans"))
        patch.setattr(results, "_place", lambda recorded, failures: None)
        results._show_again(cast(Any, None), failed)
    assert len(done) == 10 and [bool(test.recorded) for scan, test in sorted(failed, key=lambda row: row[0])] == [True] * 10 + [
        False] * 20


def test_an_assertion_is_placed_where_it_was_called() -> None:
    names = ["FB_TestSuite.AssertEquals_INT", "FB_TestSuite.SetTestFailed", "Pump", "TCUNIT_VALUES.ASSERT_X",
    "TCUNIT_SUITE.SETTESTFAILED"]
    sites = [Site("a.st", "", line, 1) for line in range(9)]
    plc = cast(Any, SimpleNamespace(image=SimpleNamespace(sites=sites, bodies=[SimpleNamespace(name=name) for name in names])))
    seen = results._Assertions(plc)
    for body, site in ((0, 3), (2, 4), (1, 5), (3, 6), (4, 7), (0, 8)):
        seen.event(plc, Call(Frame(body, 0, site, None)))
        seen.event(plc, Return(Frame(body, 0, site, None)))
    assert seen.failed == [sites[3], sites[6]]


@each_of("found, placed", [(2, True), (1, False), (3, False)])
def test_places_are_told_where_there_are_as_many_as_failures(found: int, placed: bool) -> None:
    failures = [Failure("a", 3, 0), Failure("b", 3, 0)]
    sites = [Site("a.st", "", line, 1) for line in range(3)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "_Assertions", lambda plc: SimpleNamespace(failed=sites[:found]))
        followed: list[range] = []
        results._place(cast(Any, SimpleNamespace(plc=None, follow=lambda seen, scans: followed.append(scans))), failures)
    assert followed == [range(3, 4)] and [each.site for each in failures] == (sites[:2] if placed else [None, None])


# --- what pytest is told ------------------------------------------------------------------------------------------------


def result(**more: Any) -> SuiteTestResult:
    return SuiteTestResult(**({"finished": True, "failed": False, "skipped": False, "asserts": 3, "duration_s": 0.5} | more))


TRAP = "R0101 here"


def run_of(found: dict[str, SuiteTestResult], trap: str | None = None) -> Any:
    plc = cast(Any, SimpleNamespace(trap=trap, elapsed_ns=60_000_000_000))
    return SuiteRun(plc, None, {("Main.suite", name): each for name, each in found.items()} | {("Main.other", "x"): result()},
    True)


def item_of(name: str, *others: str, run: Any = None) -> Any:
    made = object.__new__(SuiteItem)
    subject = SimpleNamespace(line=lambda file, number: f"line {number}")
    made.suite, made.test, made.user_properties = "Main.suite", FoundTest(name, "T.TcPOU", 7, False, (("wrong", 9), ("twice", 1),
                                                                                                     ("twice", 2))), []
    made.parent = cast(Any, SimpleNamespace(subject=subject, results=lambda: run))
    siblings = []
    for other in others:
        sibling = object.__new__(SuiteItem)
        sibling.suite, sibling.test = "Main.suite", FoundTest(other, "T.TcPOU", 1)
        siblings.append(sibling)
    made.session = cast(Any, SimpleNamespace(items=[*siblings, object()]))
    made.name = name
    return made


@each_of("found, trap, said", [
    ({"adds": result()}, None, ""), ({"adds": result(failed=True)}, None, "an assertion failed"),
    ({"adds": result(finished=False, skipped=True)}, None, ""),
    ({"adds": result(finished=False)}, None, "TEST_FINISHED was never reached within 1m of the PLC's time"),
    ({"adds": result(finished=False)}, TRAP, f"not finished: the program stopped: {TRAP}"),
    ({"other": result()}, None, "the suite never executed it"), ({}, TRAP, f"not executed: the program stopped: {TRAP}"),
])
def test_what_becomes_of_a_test(found: dict[str, SuiteTestResult], trap: str | None, said: str) -> None:
    item = item_of("adds", run=run_of(found, trap))
    if said:
        with pytest.raises(SuiteTestFailed) as failed:
            item.runtest()
        assert str(failed.value) == said and (failed.value.suite, failed.value.name) == ("Main.suite", "adds")
    else:
        item.runtest()
    assert item.user_properties == ([("plc_seconds", 0.5), ("assertions", 3)] if "adds" in found else [])


def test_tests_with_names_that_the_program_makes_up_are_the_others() -> None:
    run = run_of({"adds": result(), "made up": result(), "and": result(failed=True)})
    item = item_of(items.OTHERS, "adds", items.OTHERS, run=run)
    assert [name for name, _ in item._results(run)] == ["made up", "and"]
    with pytest.raises(SuiteTestFailed) as failed:
        item.runtest()
    assert failed.value.name == "and" and len(item.user_properties) == 4


def test_a_failure_is_told_at_its_place() -> None:
    item = item_of("adds")
    here = "T.TcPOU:7: in Main.suite, test adds"
    error = SuiteTestFailed("Main.suite", "adds", [], "the suite never executed it")
    assert item._said(error) == f"{here}\nE   the suite never executed it" == item.repr_failure(cast(Any,
    SimpleNamespace(value=error)))
    error.page = "every scan, in a browser: x"
    assert item.repr_failure(cast(Any, SimpleNamespace(value=error))).endswith("\n\nevery scan, in a browser: x")
    placed = Failure("EXP: 1, ACT: 2", 4, 30_000_000, Site("Other.TcPOU", "", 12, 3))
    by_message = Failure("EXP: 1, ACT: 2, MSG: wrong", 5, 40_000_000)
    nowhere = Failure("EXP: 1, ACT: 2, MSG: twice", 6, 50_000_000)
    error = SuiteTestFailed("Main.suite", "adds", [placed, by_message, nowhere], "an assertion failed")
    assert item._said(error).splitlines() == [
        "Other.TcPOU:12: in Main.suite, test adds, scan 4 (30ms)", ">   line 12", "E   EXP: 1, ACT: 2",
        "T.TcPOU:9: in Main.suite, test adds, scan 5 (40ms)", ">   line 9", "E   EXP: 1, ACT: 2, MSG: wrong",
        f"{here}, scan 6 (50ms)", "E   EXP: 1, ACT: 2, MSG: twice"]
    assert item.repr_failure(cast(Any, SimpleNamespace(value=SubjectError("it has errors")))) == "it has errors"
    assert item.reportinfo() == (Path("T.TcPOU"), 6, "adds")


@each_of("failure, line", [
    ("EXP: 1, MSG: wrong", 9), ("EXP: 1, MSG:  wrong ", 9), ("EXP: 1, MSG: twice", None), ("EXP: 1, MSG: nobody", None),
    ("EXP: 1", None), ("EXP: a, MSG: b, MSG: wrong", 9),
])
def test_a_message_that_one_assertion_has_tells_its_line(failure: str, line: int | None) -> None:
    assert FoundTest("adds", "T.TcPOU", 7, False, (("wrong", 9), ("twice", 1), ("twice", 2))).line_of(failure) == line
    assert FoundTest("adds", "T.TcPOU", 7, False, (("", 9), ("x", 1))).line_of("EXP: 1") == 9, "the only one without a message"


def file_of(tmp_path: Path, **project: Any) -> Any:
    made = object.__new__(SuitesFile)
    made.path = tmp_path / "tests.plcproj"
    made.sources, made.suites, made.run, made.subject, made._wrong = [], [], None, None, ""
    made.config = cast(Any, SimpleNamespace(getini=lambda name: [str(tmp_path / "libraries")]))
    return made


def test_a_program_with_errors_is_told_by_each_of_its_tests_and_compiled_once(tmp_path: Path,
monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    wrong = SimpleNamespace(image=None, errors=[SimpleNamespace(render=lambda: "a.st:1:1 S0201")] * 2)
    monkeypatch.setattr(items, "compile_sources", lambda sources, runnable, dialect: calls.append((runnable, dialect)) or wrong)
    made = file_of(tmp_path)
    for _ in range(2):
        with pytest.raises(SubjectError, match=r"^a\.st:1:1 S0201\na.st:1:1 S0201$"):
            made.results()
    assert calls == [(True, "twincat")]
    monkeypatch.setattr(items, "compile_sources", lambda *_, **__: SimpleNamespace(image="image"))
    monkeypatch.setattr(items, "Subject", lambda *given: given)
    monkeypatch.setattr(items, "run_suites", lambda image, suites: calls.append((image, suites)) or "run")
    good = file_of(tmp_path)
    good.suites, good.sources = ["Main.suite"], [Source("a.st", "text")]
    assert good.results() == good.results() == "run" and calls[1:] == [("image", ["Main.suite"])]
    assert good.subject == ("tests", "image", "", {"a.st": good.sources[0]})


def test_sources_of_a_project_of_tests_and_of_libraries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, again = Source("own.st", ""), Source("used.st", "other")
    project = SimpleNamespace(sources=[own], files={"own.st": 1}, errors=[], references=["TcUnit"])
    library = SimpleNamespace(sources=[again, Source("TcUnit.st", "")])
    (tmp_path / "libraries" / "deep").mkdir(parents=True)
    for name in ("TcUnit", "Other"):
        (tmp_path / "libraries" / "deep" / f"{name}.plcproj").write_text("")
    monkeypatch.setattr(items, "read_project", lambda path: library if path.stem == "TcUnit" else project)
    monkeypatch.setattr(items, "sources_by_name", lambda given: {"own.st": "", "used.st": "", "none.st": None})
    found = [program.FoundSuite("Main.suite", (FoundTest("adds", "own.st", 3), FoundTest("subs", "own.st", 5, True)), True)]
    monkeypatch.setattr(items, "find_suites", lambda sources, libraries: found if sources == [own] else [])
    monkeypatch.setattr(SuiteItem, "from_parent", lambda parent, **given: given)
    made = file_of(tmp_path)
    stash: list[Any] = []
    made.session = cast(Any, SimpleNamespace(stash=SimpleNamespace(setdefault=lambda key, value: stash)))
    collected = list(made.collect())
    assert [(each["name"], each["suite"], each["test"].name) for each in collected] == [
        ("Main.suite::adds", "Main.suite", "adds"), ("Main.suite::subs", "Main.suite", "subs"),
        ("Main.suite::(others)", "Main.suite", "(others)")]
    assert [source.name for source in made.sources] == ["TcUnit.st", "used.st", "own.st"]
    assert made.suites == ["Main.suite"] and stash == [made]
    project.errors = [SimpleNamespace(render=lambda: "tests.plcproj:1:1 P0101")]
    with pytest.raises(made.CollectError, match="P0101"):
        list(made.collect())
    found.clear()
    assert list(made.collect()) == []


def test_a_path_is_shown_from_here_where_that_is_shorter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert items._shown(tmp_path / "a" / "b.plcproj") == Path("a/b.plcproj")
    assert items._shown(Path("/x")) == Path("/x")

    def other_drive(path: Path) -> str:
        raise ValueError(path)

    monkeypatch.setattr(os.path, "relpath", other_drive)
    assert items._shown(Path("/x/y")) == Path("/x/y")


# --- suites in programs -------------------------------------------------------------------------------------------------

TESTS = """FUNCTION_BLOCK Base EXTENDS TcUnit.FB_TestSuite
    TEST('of the base'); AssertTrue(TRUE, 'yes'); TEST_FINISHED();
END_FUNCTION_BLOCK
FUNCTION_BLOCK Adds EXTENDS Base
VAR name : STRING; END_VAR
    TEST('adds');
    AssertEquals_INT(1, 2, 'wrong');
    AssertEquals(Expected := 1, Actual := 2, Message := 'named');
    AssertTrue(FALSE);
    TEST_FINISHED();
    TEST_ORDERED('disabled_subs'); AssertTrue(TRUE, 'later'); TEST_FINISHED();
    TEST('adds'); TEST_FINISHED();
    {}
END_FUNCTION_BLOCK
FUNCTION_BLOCK Plain VAR n : INT; END_VAR END_FUNCTION_BLOCK
VAR_GLOBAL shared : Adds; other : Plain; END_VAR
PROGRAM Main
VAR one, two : Adds; plain : Plain; number : INT; base : TcUnit.FB_TestSuite; END_VAR
    {}
END_PROGRAM
"""


@each_of("more, others", [("", False), ("TEST(name);", True), ("TEST();", False)])
def test_suites_of_a_program_with_their_tests(more: str, others: bool) -> None:
    found = find_suites([Source("tests.st", TESTS.format(more, "TcUnit.RUN();"))])
    assert [(suite.path, suite.has_others) for suite in found] == [
        ("tests.shared", others), ("Main.one", others), ("Main.two", others)]
    adds, subs, base = found[1].tests
    assert (adds.name, adds.line, adds.skipped, adds.asserts) == ("adds", 6, False, (("wrong", 7), ("named", 8), ("", 9)))
    assert (subs.name, subs.line, subs.skipped, subs.asserts) == ("subs", 11, True, (("later", 11),))
    assert (base.name, base.line, base.file) == ("of the base", 2, "tests.st")


def test_a_program_that_runs_no_suites_has_none() -> None:
    assert find_suites([Source("tests.st", TESTS.format("", "number := 1;"))]) == []
    assert find_suites([Source("a.st", "PROGRAM Main RUN(); END_PROGRAM")], [Source("tests.st", TESTS.format("", ""))]) == []
    assert len(find_suites([Source("tests.st", TESTS.format("", "RUN_IN_SEQUENCE();"))])) == 3
    circle = "FUNCTION_BLOCK A EXTENDS B END_FUNCTION_BLOCK FUNCTION_BLOCK B EXTENDS A END_FUNCTION_BLOCK\n"
    assert find_suites([Source("a.st", circle + "PROGRAM Main VAR a : A; END_VAR RUN(); END_PROGRAM")]) == []


def test_the_results_of_the_suites_that_ran_are_written_where_the_option_says(monkeypatch: pytest.MonkeyPatch) -> None:
    wrote: list[tuple[Path, list[Any]]] = []
    monkeypatch.setattr("fbvm.testing.suites.xunit.write_xunit", lambda path, runs: wrote.append((path, runs)))
    session: Any = SimpleNamespace(stash=pytest.Stash(), config=SimpleNamespace(getoption=lambda name: options[name]))
    for said in ("", "out.xml"):
        options = {"fbvm_xunit": said}
        pytest_sessionfinish(session)
        session.stash[items.FILES] = [SimpleNamespace(run="one"), SimpleNamespace(run=None), SimpleNamespace(run="two")]
    pytest_sessionfinish(session)
    assert wrote == [(Path("out.xml"), ["one", "two"])] * 2
    del session.stash[items.FILES]
    pytest_sessionfinish(session)
    assert wrote[2] == (Path("out.xml"), [])
