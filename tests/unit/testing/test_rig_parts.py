"""Parts of rigs, tests in ST and the plugin without a session: where files are found, rules of the state machine, failures."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rows import each_of

from fbvm.base import types as t
from fbvm.base.diagnostics import Source
from fbvm.code.image import ProgramRun, TaskRow
from fbvm.prove.encoding.execution import Refused
from fbvm.testing import Rig, Trapped, machine, plugin, proofs, proved, strategies
from fbvm.testing import subject as subjects
from fbvm.testing.coverage import FileCoverage
from fbvm.testing.coverage_plugin import CoveragePlugin
from fbvm.testing.reads import VariableReads
from fbvm.testing.recorded import Recorded
from fbvm.testing.session import UNEXPLAINED, VARIED, library_folders, search_folders
from fbvm.testing.st_items import AssertFailed, StFile, StItem
from fbvm.testing.subject import LIBRARY, SubjectError, subject
from fbvm.testing.suites import results
from fbvm.testing.warning_plugin import WarningPlugin, add_options
from fbvm.watch.paths import Place

MS = 1_000_000
COUNT = "FUNCTION_BLOCK Count VAR_INPUT up : BOOL; END_VAR VAR_OUTPUT n : INT; END_VAR " \
        "IF up THEN n := n + 1; END_IF END_FUNCTION_BLOCK"

# --- where files are ----------------------------------------------------------------------------------------------------


def config(root: Path, **ini: Any) -> Any:
    return SimpleNamespace(rootpath=root, getini=lambda name: ini.get(name, []), stash={}, getoption=lambda name: [],
                           pluginmanager=SimpleNamespace(has_plugin=lambda name: False, get_plugin=lambda name: ini.get(name)))


def test_files_are_looked_for_beside_the_test_and_above_it_up_to_the_root(tmp_path: Path) -> None:
    root = tmp_path / "project"
    test = root / "tests" / "deep" / "test_a.py"
    assert search_folders(test, root) == [root / "tests" / "deep", root / "tests", root]
    assert search_folders(tmp_path / "other" / "test_a.py", root) == [tmp_path / "other"]
    for name in ("src", "tests/src"):
        (root / name).mkdir(parents=True)
    given = config(root, fbvm_libraries=[root / "libs", root / "src"])
    assert library_folders(given, test) == [root / "libs", root / "src", root / "tests" / "src"]


def test_a_rig_takes_its_file_from_the_first_folder_that_has_it_and_blocks_from_beside_it(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    made: list[Any] = []
    monkeypatch.setattr("fbvm.testing.rig.subject", lambda *given: made.append(given) or (_ for _ in ()).throw(SubjectError("x")))
    monkeypatch.chdir(tmp_path)
    here, above, libs = tmp_path / "tests" / "deep", tmp_path / "tests", tmp_path / "libs"
    for path in (here / "a.st", above / "a.st", above / "b.st", tmp_path / "c.st", libs / "d.st"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()

    def of(what: str, **more: Any) -> tuple[Any, ...]:
        with pytest.raises(SubjectError, match="x"):
            Rig.of(what, folders=[here, above, tmp_path], libraries=[libs], **more)
        return cast("tuple[Any, ...]", made[-1])

    assert of("a.st::A")[:3] == ([here / "a.st"], "A", [libs, here])
    assert of("a.st")[:3] == ([here / "a.st"], "", [libs, here]), "the only block"
    assert of("a.st", block=False)[1] is None, "the whole program"
    assert of("b.st::B")[:3] == ([above / "b.st"], "B", [libs]), "folders above the test are no libraries"
    assert of("c.st::C")[2] == of(str(libs / "d.st"))[2] == [libs], "nor is the present folder, nor one twice"
    assert of("TON")[:3] == ([], "TON", [libs])
    assert of("TON", sources=["a.st", "b.st"])[:2] == ([here / "a.st", above / "b.st"], "TON")
    assert of("a.st", sources=["a.st"])[2] == [libs, here]
    assert of("TON", text="t", stubs={"x": "y"}, dialect="rusty")[3:] == ({"x": "y"}, "t", of("TON")[5], "rusty")
    with pytest.raises(FileNotFoundError, match=r"^none\.st is neither in .*deep nor in .*tests nor in "):
        Rig.of("none.st", folders=[here, above, tmp_path])
    with pytest.raises(SubjectError, match="x"):
        Rig.of("c.st")
    assert made[-1][:3] == ([tmp_path / "c.st"], "", [])


# --- rigs ---------------------------------------------------------------------------------------------------------------


def test_a_machine_of_hypothesis_drives_a_rig_by_its_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []

    class Plain:
        TestCase = "case"

        def __init_subclass__(cls) -> None:
            made.append(cls)

    notes: list[Any] = []
    monkeypatch.setattr(machine, "RuleBasedStateMachine", Plain)
    monkeypatch.setattr(machine, "note", notes.append)
    few = lambda rig: rig.n < 2  # noqa: E731
    assert machine.block_machine(lambda: Rig.of("Count", text=COUNT), [few, lambda rig: None]) == "case"
    case = made[0]()
    case.holds()
    case.power()
    case.holds()
    case.scan({"up": True})
    case.wait(0)
    assert (case.rig.n, case.rig.scans) == (1, 1)
    case.holds()
    case.wait(30 * MS)
    assert (case.rig.n, case.rig.scans) == (4, 4)
    with pytest.raises(AssertionError, match="<lambda> does not hold"):
        case.holds()
    assert len(notes) == 1 and "n is 4 since scan 3 (30ms)" in repr(notes[0])
    rig = case.rig
    case.power_off_and_on()
    assert case.rig is rig and (rig.n, rig.scans) == (0, 4)
    rig.scan()
    assert repr(machine._LazyReport(rig)) == repr(rig) == "<Count, 5 scans, 50ms>", "nothing was read"
    case.change_faults(["one"])
    assert rig.network.faults == ["one"]
    case.power()
    assert case.rig is not rig


def test_writes_that_were_scheduled_come_in_the_order_of_their_times() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR a, b : INT; END_VAR b := b * 10 + a; END_PROGRAM")
    rig.at("20ms", a=2).at("10ms", {"a": 1}).at("20ms", a=3).at("15ms", a=7)
    assert rig.run("40ms").b == 133, "0, 1, then 7 and 2 and 3 at 20 ms"
    assert rig._timed == []


def test_a_table_shows_the_last_ten_scans_unless_told() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR n : INT; a : ARRAY[0..1] OF INT; END_VAR n := n + 1; END_PROGRAM").run(scans=12)
    shown = [line for line in rig.table("n", "D0..D1").splitlines() if line.startswith("scan")]
    assert [line.split()[1] for line in shown] == [str(scan) for scan in range(2, 12)]
    assert shown[0].split() == ["scan", "2", "20ms", "n"]


def test_the_packets_that_passed_last_stand_below_a_report() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").run(scans=3)
    assert rig.n == 3 and "network" not in rig.explain()
    rig._packets.extend((scan, cast(Any, f"packet {scan}")) for scan in range(1, 9))
    assert rig.explain().endswith("\n\nwhat passed the network last:\n  scan 3    packet 3\n  scan 4    packet 4\n"
                                  "  scan 5    packet 5\n  scan 6    packet 6\n  scan 7    packet 7\n  scan 8    packet 8")
    rig.scan()
    assert rig.explain() == "", "nothing was read since the last scan"


def test_reads_belong_to_the_lines_of_the_test() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR a, b : INT; END_VAR END_PROGRAM").scan()
    line = sys._getframe().f_lineno
    assert rig.a == 0
    assert rig["b"] == 0 and rig.a == 0
    assert [(Path(file).name, at - line, place.name) for file, at, place in rig.reads] == [
        ("test_rig_parts.py", 1, "Main.a"), ("test_rig_parts.py", 2, "Main.b"), ("test_rig_parts.py", 2, "Main.a")]
    reads = rig._reads
    assert [place.name for place in reads.places()] == ["Main.a", "Main.b"]
    assert [place.name for place in reads.places(__file__, range(line + 2, line + 3))] == ["Main.b", "Main.a"]
    assert [place.name for place in reads.places(__file__, range(1, 2))] == ["Main.a", "Main.b"]
    assert VariableReads().places() == []


def test_a_trap_is_told_with_the_instance_of_its_block() -> None:
    text = "FUNCTION_BLOCK Halve VAR d : INT; END_VAR d := 1 / d; END_FUNCTION_BLOCK\n" \
           "PROGRAM Main VAR h : Halve; END_VAR h(); END_PROGRAM"
    rig = Rig.of("Main", text=text)
    with pytest.raises(Trapped, match=r"Main\.h") as caught:
        rig.scan()
    assert caught.value.trap is rig.plc.trap and str(Trapped(caught.value.trap)) == caught.value.trap.message
    assert repr(rig) == f"<Main, {rig.scans} scans, {rig.elapsed_ns // MS}ms>".replace(" 0ms", " 0s")


@each_of("intervals, cycle_ms", [([], 10), ([0], 10), ([50, 20], 20), ([0, 5], 5)])
def test_suites_run_at_the_cycle_of_the_quickest_task(intervals: list[int], cycle_ms: int) -> None:
    image = cast(Any, SimpleNamespace(tasks=[TaskRow(f"t{number}", 0, ms * MS, "", (ProgramRun("M", 0, 0),))
                                             for number, ms in enumerate(intervals)]))  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "Plc", lambda image, cycle_ns, budget: (cycle_ns, budget))
        assert results._plc(image) == (cycle_ms * MS, 1 << 32)


# --- subjects -----------------------------------------------------------------------------------------------------------


def test_a_name_that_another_file_declares_is_hinted_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("lib/other.st", "  FUNCTION_BLOCK Pump\nEND_FUNCTION_BLOCK"), ("deep/b.ST", "function Mean : INT"),
                       ("deep/a.st", "TYPE\tLevel : INT; END_TYPE"), (".git/c.st", "FUNCTION Hidden : INT"),
                       ("_x/d.st", "FUNCTION Under : INT"),
                       ("beside/e.st", "FUNCTION_BLOCK FINAL ABSTRACT Last"), ("deep/f.txt", "FUNCTION Text : INT")):  # fmt: skip
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "deep" / "bad.st").write_bytes(b"\xff\0")
    names = ["Pump", "LEVEL", "mean", "Hidden", "Under", "Last", "Text", "Pum"]
    said = list(subjects._hints(names, [Source("beside/main.st", "")], [tmp_path / "lib"]))
    assert [line.partition("; a test")[0] for line in said] == [
        f"{name} is declared in {Path(file)}"
        for name, file in (("Pump", "lib/other.st"), ("LEVEL", "deep/a.st"), ("mean", "deep/b.ST"), ("Last", "beside/e.st"))]
    assert said[0].endswith("; a test finds it in a file of its own name, Pump.st, in src/ or in a folder of fbvm_libraries")


OTHERS = """PROGRAM One
VAR n : INT; END_VAR
END_PROGRAM
PROGRAM Two
VAR n : INT; END_VAR
    n := wrong;
END_PROGRAM
PROGRAM Three
END_PROGRAM
VAR_GLOBAL three : INT; END_VAR
"""


def test_other_programs_become_blanks_unless_the_rest_names_them() -> None:
    made = subjects._without_other_programs(Source("a.st", OTHERS), "one").text
    assert len(made) == len(OTHERS) and made.count("\n") == OTHERS.count("\n")
    lines = made.splitlines()
    assert lines[:3] == OTHERS.splitlines()[:3] and lines[7:] == OTHERS.splitlines()[7:]
    assert [line.strip() for line in lines[3:7]] == [""] * 4


@each_of("pou, stub, text", [
    ("FUNCTION_BLOCK A VAR q : INT; END_VAR q := 1; END_FUNCTION_BLOCK", "q := 2;",
     "FUNCTION_BLOCK A VAR q : INT; END_VAR\nq := 2;\nEND_FUNCTION_BLOCK\n"),
    ("FUNCTION A : INT A := 1; END_FUNCTION;", "A := 2;", "FUNCTION A : INT\nA := 2;\nEND_FUNCTION\n"),
    ("function_block A ; end_function_block", " x(); ", "function_block A\n x(); \nend_function_block\n"),
    ("FUNCTION A : INT A := 1; END_FUNCTION", "\n function A : INT END_FUNCTION ;", "function A : INT END_FUNCTION \n"),
])
def test_a_stub_takes_the_place_of_a_body_or_of_all(pou: str, stub: str, text: str) -> None:
    kept, made = subjects._stubbed([Source("a.st", f"// first\n{pou}\nPROGRAM M END_PROGRAM")], "a", stub, [], "standard")
    assert (made.name, made.text) == ("<stub of A>", text)
    assert kept.text.splitlines()[::2] == ["// first", "PROGRAM M END_PROGRAM"] and kept.text.splitlines()[1].strip(" ;") == ""


def test_a_subject_knows_its_lines_and_speaks_without_the_program_around_it() -> None:
    made = subject([], "Count", [], None, f"// head\n  {COUNT}\n")
    assert (made.name, made.prefix, made.in_outs) == ("Count", "Test.Block.", frozenset())
    assert [made.line("test.st", number) for number in (0, 1, 2, 3, 4)] == ["", "// head", COUNT, "", ""]
    assert made.line("none.st", 1) == ""
    assert made.plain("Test.Block.n of Test.Block") == "n of Count"
    add = "FUNCTION_BLOCK Add VAR_IN_OUT Sum, x2 : INT; END_VAR VAR n : INT; END_VAR END_FUNCTION_BLOCK"
    passed = subject([], "Add", [], None, add)
    assert [passed.path(name) for name in ("Sum", "SUM[1]", "X2", "n", "Summe", "[x")] == [
        "Test.Block_Sum", "Test.Block_SUM[1]", "Test.Block_X2", "Test.Block.n", "Test.Block.Summe", "Test.Block.[x"]


def test_programs_are_compiled_once_for_all_tests_of_them() -> None:
    first = subject([], "Count", [], None, COUNT)
    assert subject([], "Count", [], None, COUNT) is first
    assert subject([], "Count", [], {}, COUNT, dialect="codesys") is not first
    assert subject([], "Count", [], {"Count": "n := 7;"}, COUNT) is not first


# --- failures of tests in Python ----------------------------------------------------------------------------------------


def test_frames_of_fbvm_are_cut_off_what_a_test_has_caused() -> None:
    rig = Rig.of("Count", text=COUNT)

    def frames(error: BaseException) -> list[str]:
        entry, found = error.__traceback__, []
        while entry is not None:
            found.append(Path(entry.tb_frame.f_code.co_filename).name)
            entry = entry.tb_next
        return found

    with pytest.raises(AttributeError) as wrong:
        rig.nobody = 1
    assert len(frames(wrong.value)) > 1
    plugin._shorten(wrong.value)
    assert frames(wrong.value) == ["test_rig_parts.py"]
    with pytest.raises(ZeroDivisionError) as other:
        rig.until(lambda rig: 1 / rig.n)
    before = frames(other.value)
    plugin._shorten(other.value)
    assert frames(other.value) == before and before[0] == before[-1] == "test_rig_parts.py"
    plugin._shorten(ValueError())


def test_the_statement_that_failed_is_told_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "tests" / "test_a.py"
    file.parent.mkdir()
    file.write_text("def test():\n    assert (1 ==\n            2)\n")
    item = cast(Any, SimpleNamespace(path=file, config=SimpleNamespace(rootpath=tmp_path)))

    def info(*entries: tuple[Path, int]) -> Any:
        return SimpleNamespace(traceback=[SimpleNamespace(path=path, lineno=line - 1) for path, line in entries],
                               exconly=lambda: "AssertionError: x\nassert 1 == 2")

    said = f"{Path('tests/test_a.py')}:2\n>   assert (1 ==\n>           2)\nE   AssertionError: x\nE   assert 1 == 2"
    assert plugin._assertion(info((file, 3), (Path("/none.py"), 9)), item) == said
    assert plugin._assertion(info((file, 1), (file, 2)), item) == said
    elsewhere = tmp_path.parent / "x.py"
    assert plugin._assertion(info((elsewhere, 9)), item).startswith(f"{elsewhere}:9\nE   Asser")


# --- tests in ST --------------------------------------------------------------------------------------------------------


def st_item(path: Path, name: str, **ini: Any) -> StItem:
    made = object.__new__(StItem)
    given = config(path.parent.parent, fbvm_warned=WarningPlugin(config(path.parent)), **ini)
    made.__dict__.update(line=3)
    made.path, made.config, made.name, made.subject = path, given, name, None
    return made


PROGRAMS = """PROGRAM Good
VAR n : INT; END_VAR
    n := 5; ASSERT(n = 5);
END_PROGRAM
PROGRAM Waits
VAR n, m : INT; Done : BOOL; END_VAR
    n := n + 1;
    ASSERT(n < 3 AND m = 0);
    m := m + 0;
    Done := n = {};
END_PROGRAM
PROGRAM Silent
VAR n : INT; Done : INT; END_VAR
    IF n > 0 THEN ASSERT(FALSE); END_IF
END_PROGRAM
PROGRAM Traps
VAR n : INT; END_VAR
    ASSERT(1 / n = 1);
END_PROGRAM
"""


def test_programs_in_st_pass_fail_or_trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "tests" / "test_it.st"
    file.parent.mkdir()
    monkeypatch.chdir(tmp_path)
    file.write_text(PROGRAMS.format(2), encoding="utf-8")
    for name in ("Good", "Waits"):
        st_item(file, name).runtest()
    for name, error, said in (("Silent", AssertionError, r"^Silent ended without one ASSERT$"),
                              ("Traps", Trapped, "1 divided by 0")):
        item = st_item(file, name)
        with pytest.raises(error, match=said) as caught:
            item.runtest()
        assert item.repr_failure(cast(Any, caught)) == str(caught.value)
    assert item.reportinfo() == (file, 2, "Traps")
    monkeypatch.setattr("fbvm.testing.st_items.failure_page", lambda item, suffix, write: f"page{suffix}")
    file.write_text(PROGRAMS.format(9), encoding="utf-8")
    item = st_item(file, "Waits")
    with pytest.raises(AssertionError) as failed:
        item.runtest()
    assert item.repr_failure(cast(Any, failed)) == (
        f"{Path('tests/test_it.st')}:8: in Waits, scan 2 (20ms)\n>   ASSERT(n < 3 AND m = 0);\nE   n = 3\nE   m = 0\n\n"
        "scan 0   0s      n   m\n  inputs         0   0\n  test_it.st:7  >1\nscan 1   10ms\n  inputs         1   0\n"
        "  test_it.st:7  >2\nscan 2   20ms\n  inputs         2   0\n  test_it.st:7  >3\n\npage")


@pytest.mark.slow
def test_a_failed_assert_shows_bits_by_their_names_and_no_scan_where_none_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fbvm.testing.st_items.failure_page", lambda item, suffix, write: "page")
    file = tmp_path / "tests" / "test_it.st"
    file.parent.mkdir()
    monkeypatch.chdir(tmp_path)
    file.write_text("PROGRAM Bits VAR b AT CIO 0.03 : BOOL; k AT CIO 1.15 : BOOL; c : BOOL; END_VAR\n"
                    "    ASSERT(b OR k OR c OR b);\nEND_PROGRAM", encoding="utf-8")  # fmt: skip
    item = st_item(file, "Bits")
    with pytest.raises(AssertFailed) as failed:
        item.runtest()
    assert item.repr_failure(cast(Any, failed)) == (
        f"{Path('tests/test_it.st')}:2: in Bits, scan 0 (0s)\n>   ASSERT(b OR k OR c OR b);\n"
        "E   b = FALSE\nE   k = FALSE\nE   c = FALSE\n\npage")


def test_a_program_in_st_that_is_never_done_fails_after_a_minute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.testing.st_items.LIMIT_NS", 30 * MS)
    file = tmp_path / "tests" / "test_it.st"
    file.parent.mkdir()
    file.write_text("PROGRAM Waits VAR Done : BOOL; n : INT; END_VAR n := n + 1; ASSERT(n < 4); END_PROGRAM", encoding="utf-8")
    with pytest.raises(AssertionError, match=r"^Done is still FALSE after 30ms$"):
        st_item(file, "Waits").runtest()


def test_the_programs_of_a_file_are_its_tests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = object.__new__(StFile)
    file.path = tmp_path / "test_it.st"
    monkeypatch.setattr(StItem, "from_parent", lambda parent, **given: given)

    def collected(text: str) -> list[Any]:
        file.path.write_text(text, encoding="utf-8")
        return list(file.collect())

    assert collected(f"{COUNT}\n{PROGRAMS.format(2)}") == [
        {"name": "Good", "line": 2}, {"name": "Waits", "line": 6}, {"name": "Silent", "line": 13}, {"name": "Traps", "line": 17}]
    assert collected(PROGRAMS.format(";"))[1] == {"name": "Waits", "line": 5}, "an error in one of several is told by its test"
    for text in ("PROGRAM A n := ; END_PROGRAM", f"PROGRAM\n{PROGRAMS.format(2)}", f"{PROGRAMS}\n{COUNT.replace('n + 1', '')}"):
        with pytest.raises(file.CollectError, match=r"test_it\.st"):
            collected(text)
    file.path = tmp_path / "none.st"
    with pytest.raises(file.CollectError, match="S0107"):
        list(file.collect())


# --- warnings -----------------------------------------------------------------------------------------------------------


@each_of("option, ini, codes, as_errors", [
    ([], [], [], False), (["S0290,S0390"], [], ["S0290", "S0390"], False), (["S0390"], ["S0290"], ["S0290", "S0390"], True),
])
def test_unwanted_warnings_are_those_of_the_ini_and_of_the_command(option: list[str], ini: list[str], codes: list[str],
                                                                   as_errors: bool) -> None:
    given = {"fbvm_no_warn": option, "fbvm_warnings_as_errors": as_errors}
    as_ini = {"fbvm_no_warn": ini, "fbvm_warnings_as_errors": as_errors}
    by_option, by_ini = {**as_ini, "fbvm_warnings_as_errors": False}, {**given, "fbvm_warnings_as_errors": False}
    for options, own in ((given, by_option), (by_ini, as_ini)):
        made = WarningPlugin(cast(Any, SimpleNamespace(getoption=options.get, getini=own.get)))
        assert made._unwanted == codes and made._as_errors is as_errors
        assert made.wanted.as_errors is as_errors and set(codes) <= set(made.wanted.no_warn)


def test_options_of_warnings_are_off_unless_given() -> None:
    rows: dict[str, Any] = {}
    add_options(cast(Any, SimpleNamespace(addini=lambda name, help, **more: rows.update({name: more}))),
                cast(Any, SimpleNamespace(addoption=lambda name, help, **more: rows.update({name: more}))))
    assert rows == {"fbvm_no_warn": {"type": "args", "default": []},
                    "fbvm_warnings_as_errors": {"type": "bool", "default": False},
                    "--fbvm-no-warn": {"action": "append", "default": [], "metavar": "CODE"},
                    "--fbvm-warnings-as-errors": {"action": "store_true"}}  # fmt: skip


def test_the_library_of_assert_is_there() -> None:
    assert (LIBRARY / "ASSERT.st").is_file() and isinstance(Rig.of("Count", text=COUNT).find("n"), Place)


# --- what is refused in words -------------------------------------------------------------------------------------------


def test_a_range_has_no_causes_and_a_session_hands_over_what_it_counted(tmp_path: Path) -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").scan()
    seen = Recorded(rig, tmp_path / "t.fbtrace")
    with pytest.raises(ValueError, match=r"^D0\.\.D3 is a range; name one place$"):
        seen.why("D0..D3")
    counted = CoveragePlugin(config(tmp_path))
    worker = FileCoverage({(3, 5): 2}, {(3, 5): {(4, 9): 1}})
    counted.coverage.files["a.st"] = worker
    data: dict[str, Any] = {}
    counted.pytest_sessionfinish(cast(Any, SimpleNamespace(config=SimpleNamespace(workeroutput=data))))
    together = CoveragePlugin(config(tmp_path))
    for node in (SimpleNamespace(workeroutput=data), SimpleNamespace(workeroutput={}), SimpleNamespace(),
                 SimpleNamespace(workeroutput=data)):
        together.pytest_testnodedown(node, None)
    assert together.coverage.files == {"a.st": FileCoverage({(3, 5): 4}, {(3, 5): {(4, 9): 2}})}


@each_of("site, said", [(-1, r"^too deep$"), (0, r"^test\.st:1:\d+ in Count: too deep$")])
def test_a_proof_of_what_cannot_be_followed_says_where(site: int, said: str) -> None:
    def refuse(*given: Any) -> Any:
        raise Refused("too deep", site)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(proofs, "proved_once", refuse)
        with pytest.raises(ValueError, match=said):
            proved(Rig.of("Count", text=COUNT), never="n > 1")
        with pytest.raises(ValueError, match=r"^say what to prove: one of never, always, no_trap and written_once$"):
            proved(Rig.of("Count", text=COUNT))


def test_values_of_a_structure_are_those_of_its_members_but_constants() -> None:
    kind = t.StructType("S", 8, 4, {"A": t.Field("a", t.BOOL, 0), "K": t.Field("k", t.INT, 2, constant=True),
                                    "B": t.Field("b", t.UINT, 4)})
    assert repr(strategies.values(kind)) == "fixed_dictionaries({'a': booleans(), 'b': integers(min_value=0, max_value=65535)})"


def test_of_a_failure_that_nobody_reads_no_page_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pages: list[str] = []
    monkeypatch.setattr("fbvm.testing.st_items.failure_page", lambda item, suffix, write: pages.append(item.name) or "page")
    file = tmp_path / "tests" / "test_it.st"
    file.parent.mkdir()
    file.write_text("PROGRAM Wrong VAR n : INT; END_VAR n := n + 1; ASSERT(n < 1); END_PROGRAM", encoding="utf-8")
    for unexplained in (False, True):
        item = st_item(file, "Wrong")
        item.config.stash[UNEXPLAINED] = unexplained
        with pytest.raises(AssertFailed) as failed:
            item.runtest()
        assert (failed.value.page, pages) == ("" if unexplained else "page", ["Wrong"])


def test_a_campaign_is_asked_before_and_told_behind_each_scan_of_a_test_in_st(tmp_path: Path) -> None:
    told: list[object] = []
    varied = SimpleNamespace(before_scan=lambda: told.append("before"), after_scan=lambda: told.append("after"), elapsed_ns=None)
    run = SimpleNamespace(cycle_ns=lambda name, cycle_ns: 7 * MS,
                          made=lambda name, plc, find, more: told.append((name, plc.cycle_ns, more)) or varied)
    file = tmp_path / "tests" / "test_it.st"
    file.parent.mkdir()
    file.write_text("PROGRAM Waits VAR Done : BOOL; n : INT; END_VAR n := n + 1; ASSERT(n < 4); Done := n = 3; END_PROGRAM",
                    encoding="utf-8")
    item = st_item(file, "Waits")
    item.config.stash[VARIED] = cast(Any, run)
    item.runtest()
    assert told == [("", 7 * MS, None), *["before", "after"] * 3]
