"""Values as tests read and write them, what strategies choose from, and what a failed test is told in words."""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import strategies as st
from rows import each_of

import fbvm.testing
from fbvm.base import types as t
from fbvm.testing import ns, strategies
from fbvm.testing.course import lessons, words
from fbvm.testing.coverage import FileCoverage
from fbvm.testing.coverage_report import _source
from fbvm.testing.report import Report
from fbvm.testing.rig import Rig
from fbvm.testing.session import failure_page
from fbvm.testing.value_types import Member, Nanoseconds, as_read, for_writing
from fbvm.testing.values import Values, as_dict
from fbvm.watch.paths import UnknownPlace

STATE = t.EnumType("State", 2, 2, t.INT, {"IDLE": 0, "RUNNING": 1}, {0: "Idle", 1: "Running"})
DAY_NS = 86_400_000_000_000


def date(days: int) -> Nanoseconds:
    return Nanoseconds(days * DAY_NS, t.DATE)


# --- times and members ------------------------------------------------------------------------------------------------


@each_of("function, left, right, value, kind", [
    (operator.add, ns("1s"), ns("50ms"), "T#1s50ms", t.TIME), (operator.add, ns("1s"), 5, "T#1s5ns", t.TIME),
    (operator.add, 5, ns("1s"), "T#1s5ns", t.TIME), (operator.add, date(2), ns("1d"), "D#1970-01-04", t.DATE),
    (operator.add, ns("1d"), date(2), "D#1970-01-04", t.DATE), (operator.sub, ns("1s"), ns("50ms"), "T#950ms", t.TIME),
    (operator.sub, date(5), date(2), "T#3d", t.TIME), (operator.sub, date(5), ns("1d"), "D#1970-01-05", t.DATE),
    (operator.sub, date(5), DAY_NS, "D#1970-01-05", t.DATE), (operator.sub, 2_000_000, ns("1ms"), "T#1ms", t.TIME),
    (operator.mul, ns("20ms"), 3, "T#60ms", t.TIME), (operator.mul, 3, ns("20ms"), "T#60ms", t.TIME),
    (operator.floordiv, ns("100ms"), 3, "T#33ms333us333ns", t.TIME), (operator.mod, ns("100ms"), ns("30ms"), "T#10ms", t.TIME),
    (operator.floordiv, date(5), 5, "D#1970-01-02", t.DATE),
])
def test_sums_of_times_are_times(function: Callable[..., Any], left: Any, right: Any, value: str, kind: t.Type) -> None:
    made = function(left, right)
    assert isinstance(made, Nanoseconds) and (repr(made), made.type) == (value, kind)


@each_of("value, number, kind", [
    (ns("100ms") // ns("30ms"), 3, int), (ns("100ms") / ns("50ms"), 2.0, float), (ns("1ms") * 1.5, 1_500_000.0, float),
    (1.5 * ns("1ms"), 1_500_000.0, float),
])
def test_ratios_of_times_are_numbers(value: Any, number: float, kind: type) -> None:
    assert type(value) is kind and value == number


def test_a_time_below_nothing_and_a_date_are_shown_as_programs_write_them() -> None:
    assert repr(-ns("5ms")) == "T#-5ms" and (-date(0)).type == t.DATE and repr(Nanoseconds(3, t.TOD)).startswith("TOD#")


def test_a_member_of_an_enumeration_is_its_number_and_its_names() -> None:
    idle, running = Member(0, STATE), Member(1, STATE)
    others = (1, 0, "Running", "running", "State#Running", "state.running", "Other#Running", "Idle", idle, running, None)
    assert [running == other for other in others] == [True, False, True, True, True, True, False, False, False, True, False]
    assert (running != "Idle", running != 1, hash(running)) == (True, False, hash(1))
    assert [str(running), repr(running), f"{running}", f"{running:03}"] == ["State#Running", "State#Running (1)", "State#Running",
                                                                          "001"]
    assert str(Member(1, t.EnumType("(Idle, Running)", 2, 2, t.INT, {}, {0: "Idle", 1: "Running"}))) == "Running"


def read(declared: str, value: Any) -> Any:
    """A value of a declared type as a test reads it."""
    rig = Rig.of("Main", text=f"TYPE Mode : (Off, On); END_TYPE PROGRAM Main VAR x : {declared}; END_VAR END_PROGRAM")
    return as_read(cast(Any, rig.find("x")).type, value)


@pytest.mark.slow
def test_values_know_what_they_are() -> None:
    assert repr(read("ARRAY[1..2] OF TIME", [1_000_000, 2_000_000])) == "[T#1ms, T#2ms]"
    assert repr(read("Mode", 1)) == "Mode#On (1)" and type(read("Mode", 7)) is int
    assert repr(read("TOD", 0)).startswith("TOD#") and read("INT", 5) == 5 and read("STRING", "a") == "a"
    made = read("TON", {"IN": True, "PT": 5_000_000})
    assert (list(made), repr(made["PT"])) == (["IN", "PT"], "T#5ms")
    assert type(read("REAL", 1.0)) is float
    kind = cast(Any, Rig.of("Main", text="PROGRAM Main VAR x : TON; END_VAR END_PROGRAM").find("x")).type
    assert for_writing(kind, {"PT": "5ms", "Unknown": "5ms"}, "x") == {"PT": 5_000_000, "Unknown": "5ms"}


@each_of("kind, value, given", [
    (t.TIME, "50ms", 50_000_000), (t.WORD, "16#FF", 255), (t.INT, 5, 5), (t.TIME, ns("2s"), 2_000_000_000),
    (t.string(5), "50", "50"),
    (t.array(((1, 2),), t.TIME), ["1ms", ns("2ms")], [1_000_000, 2_000_000]), (t.BOOL, True, True),
    (t.array(((1, 2),), t.INT), (1, "2"), [1, 2]),
])
def test_what_is_written_is_read_for_its_type(kind: t.Type, value: object, given: object) -> None:
    assert for_writing(kind, value, "x") == given


@each_of("kind, value, said", [
    (t.TIME, 2, "x"), (t.DATE, 2, "x"), (t.array(((1, 2),), t.TIME), [ns("1s"), 5], r"x\[1\]"), (t.INT, "many", "x"),
])
def test_a_bare_number_is_no_time(kind: t.Type, value: object, said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        for_writing(kind, value, "x")


def test_elements_of_an_array_are_read_and_written_in_place() -> None:
    rig = Rig.of("Main", text="""
        TYPE Channel : STRUCT Raw : INT; Limits : ARRAY[1..2] OF INT; END_STRUCT; END_TYPE
        PROGRAM Main
        VAR channels : ARRAY[3..4] OF Channel; timers : ARRAY[0..1] OF TON; times : ARRAY[0..1, 1..2] OF TIME; END_VAR
            timers[1](IN := TRUE, PT := T#10ms);
        END_PROGRAM""")
    rig.channels[0].Raw = 7
    rig.channels[-1].Limits[1] = 9
    rig.times[3] = "20ms"
    assert (rig["channels[3].Raw"], rig["channels[4].Limits[2]"], rig["times[1, 2]"]) == (7, 9, ns("20ms"))
    assert rig.channels == [{"Raw": 7, "Limits": [0, 0]}, {"Raw": 0, "Limits": [0, 9]}]
    found = rig.times
    found[0] = "1s"
    assert found == [ns("1s"), 0, 0, ns("20ms")] == rig.times
    assert rig.run(scans=2).timers[1].Q is True
    with pytest.raises(TypeError, match="assign to one element"):
        rig.times[0:2] = ["1s", "2s"]
    with pytest.raises(IndexError):
        rig.channels[2].Raw = 1


WITH_PROPERTIES = """
    FUNCTION_BLOCK Pump
    VAR_INPUT Run : BOOL; END_VAR
    VAR count, divisor : INT; END_VAR
        IF Run THEN count := count + 1; END_IF
    PROPERTY PUBLIC Starts : INT GET Starts := count * 2; END_GET END_PROPERTY
    PROPERTY PUBLIC Share : INT GET Share := 100 / divisor; END_GET END_PROPERTY
    METHOD PUBLIC Reset count := 0; END_METHOD
    END_FUNCTION_BLOCK
    """
MAIN = "PROGRAM Main VAR pumps : ARRAY[1..2] OF Pump; END_VAR pumps[2](Run := TRUE); END_PROGRAM"


def test_properties_are_read_as_variables_are() -> None:
    block = Rig.of("Pump", text=WITH_PROPERTIES)
    whole = Rig.of("Main", text=WITH_PROPERTIES + MAIN)
    assert block.scan(Run=True).Starts == 2 and block["starts"] == 2
    assert whole.scan()["pumps[2].Starts"] == 2 == whole.pumps[1].Starts
    with pytest.raises(ValueError, match="Share cannot be computed: R0101"):
        block["Share"]
    with pytest.raises(AttributeError, match="Reset is a method: call it in a test in Structured Text"):
        block.Reset()
    with pytest.raises(AttributeError, match="has no Stops"):
        block.Stops  # noqa: B018


def test_variables_of_an_instance_are_attributes() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR d : TON; END_VAR d(IN := TRUE, PT := T#30ms); END_PROGRAM")
    rig.scan()
    timer = rig.d
    assert isinstance(timer, Values) and timer.IN is True and repr(timer.PT) == "T#30ms"
    assert {"IN", "PT", "Q", "ET"} <= set(dir(timer))
    assert timer == as_dict(timer) and timer == rig["d"] and repr(timer).startswith("TON {") and timer != {}
    timer.PT = "70ms"
    assert timer["PT"] == ns("70ms")
    for name in ("nobody", "__wrapped__"):
        with pytest.raises(AttributeError):
            getattr(timer, name)
    with pytest.raises(AttributeError, match="has no nobody"):
        timer.nobody = 1
    with pytest.raises(UnknownPlace):
        timer["nobody"] = 1
    with pytest.raises(TypeError):
        hash(timer)
    with pytest.raises(AttributeError, match="has no nobody"):
        rig.nobody = 1
    with pytest.raises(AttributeError):
        rig.__wrapped__  # noqa: B018


def test_forces_are_released_one_by_one_or_all() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR a, b, c : INT; END_VAR END_PROGRAM")
    for name in "abc":
        rig.force(**{name: 5})
    assert set(rig.unforce("a").plc.forces) == {"Main.b", "Main.c"} and set(rig.unforce("b").plc.forces) == {"Main.c"}
    rig.force(a=1)
    assert rig.unforce() is rig and not rig.plc.forces


def test_names_of_the_package_are_loaded_when_they_are_used() -> None:
    fresh = importlib.reload(fbvm.testing)
    assert fresh.__all__ == sorted(["NotProved", "Rig", "Trapped", "Values", "ns", "proved", "double_writes"])
    assert fresh.Rig is Rig and fresh.Values is Values
    with pytest.raises(AttributeError, match=r"^module 'fbvm\.testing' has no attribute 'nobody'$"):
        _ = fresh.nobody


# --- strategies -------------------------------------------------------------------------------------------------------


class Written:
    """Stands in for hypothesis: a strategy is written down as the call that makes it."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Call:
            return Call(f"{name}({', '.join([*map(str, given), *(f'{key}={named[key]}' for key in sorted(named))])})")

        return call


class Call(str):
    def map(self, function: Any) -> str:
        return f"{self} as {getattr(function, '__name__', function)}"


@each_of("kind, written", [
    (t.BOOL, "booleans()"), (t.SINT, "integers(-128, 127)"), (t.WORD, "integers(0, 65535)"), (t.UINT, "integers(0, 65535)"),
    (t.SubrangeType("INT(2..9)", 2, 2, t.INT, 2, 9), "integers(2, 9)"), (STATE, "sampled_from([0, 1])"),
    (t.string(5), "text(characters(max_codepoint=126, min_codepoint=32), max_size=5)"),
    (t.array(((1, 3),), t.BOOL), "lists(booleans(), max_size=3, min_size=3)"), (t.REAL, "floats(width=32)"),
    (t.LREAL, "floats(width=64)"), (t.TIME, "integers(0, 3600000000000) as Nanoseconds"),
    (t.LTIME, "integers(0, 3600000000000) as Nanoseconds"),
    (t.ELEMENTARY["CHAR"], "characters(categories=('L', 'N', 'P', 'S', 'Z'), max_codepoint=255, min_codepoint=0)"),
    (t.ELEMENTARY["WCHAR"], "characters(categories=('L', 'N', 'P', 'S', 'Z'), max_codepoint=65535, min_codepoint=0)"),
])
def test_a_strategy_has_the_values_of_its_type(kind: t.Type, written: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strategies, "st", Written())
        assert strategies.values(kind) == written


def test_dates_are_chosen_among_all_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strategies, "st", Written())
    shown = str(strategies.values(t.DATE))
    assert shown.startswith("integers(-9223372036854775808, 9223372036854775807) as functools.partial") and "DATE" in shown
    with pytest.raises(TypeError, match=r"there are no values of POINTER TO INT to choose from"):
        strategies.values(cast(Any, SimpleNamespace(name="POINTER TO INT")))


BLOCK = """FUNCTION_BLOCK Job VAR_INPUT a : INT; END_VAR VAR_IN_OUT b : BOOL; END_VAR VAR_OUTPUT q : INT; END_VAR
VAR inner : INT; END_VAR END_FUNCTION_BLOCK"""


def test_inputs_and_in_outs_are_chosen_and_no_others() -> None:
    rig = Rig.of("Job", text=BLOCK)
    assert list(strategies._inputs(rig)) == ["a", "b"]
    chosen = repr(strategies.inputs(rig, a=st.just(7)))
    assert "'a': just(7)" in chosen and "'b': booleans()" in chosen and "optional=" in chosen


def test_a_course_is_followed_step_by_step() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR n, seen : INT; END_VAR seen := seen + n; END_PROGRAM")
    assert strategies.follow(rig, [(0, {"n": 1}), (30_000_000, {"n": 10})]) is rig
    assert (rig.scans, rig.seen) == (5, 1 + 3 + 10)


# --- words ------------------------------------------------------------------------------------------------------------


@each_of("name, said, sentence", [
    ("test_the_lamp_is_on", "AssertionError: it is off in scan 3\nassert x", "the lamp is on: it is off in scan 3"),
    ("test_the_lamp_is_on", "assert False", "the lamp is on"), ("test_the_lamp_is_on[3-x]", "", "the lamp is on"),
    ("test_program", "AssertionError: the lamp is off", "the lamp is off"), ("test_program", "assert 1 == 2", "program"),
])
def test_a_failed_check_is_told_in_a_sentence(name: str, said: str, sentence: str) -> None:
    assert lessons.mistake(name, said) == sentence


@each_of("failed, error, told", [
    (True, AssertionError("the lamp is off"), "lamp: the lamp is off"), (True, ValueError("x"), "traceback"),
    (False, AssertionError("x"), "traceback"), (True, None, "traceback"),
])
def test_only_a_failed_assertion_is_told_in_words(failed: bool, error: BaseException | None, told: str) -> None:
    info = error and SimpleNamespace(value=error, errisinstance=lambda kind: isinstance(error, kind))
    report = SimpleNamespace(failed=failed, longrepr="traceback")
    hook = words.pytest_runtest_makereport(cast(Any, SimpleNamespace(name="test_lamp")), cast(Any, SimpleNamespace(excinfo=info)))
    next(hook)
    with pytest.raises(StopIteration) as ended:
        hook.send(cast(Any, report))
    assert ended.value.value is report and report.longrepr == told


def test_lessons_are_the_folders_that_have_a_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, file in (("02-two", "lesson.md"), ("01-one", "lesson.md"), ("03-none", "other.md")):
        (tmp_path / "lessons" / name).mkdir(parents=True)
        (tmp_path / "lessons" / name / file).write_text(f"# {name}\ntext", encoding="utf-8")
    monkeypatch.setattr(lessons, "data_folder", lambda name: tmp_path)
    found = lessons.lessons.__wrapped__()
    assert [(each.number, each.slug, each.title) for each in found] == [(1, "01-one", "01-one"), (2, "02-two", "02-two")]
    (tmp_path / "mine" / "01-one").mkdir(parents=True)
    (tmp_path / "mine" / "01-one" / "answers.toml").write_text("# Which scan?\nlamp = [\n", encoding="utf-8")
    assert lessons.questions(found[0], tmp_path / "mine") == [("lamp", "Which scan?", "")]


def test_a_page_that_cannot_be_written_is_told_and_others_are_counted(tmp_path: Path) -> None:
    written: list[Path] = []
    config = SimpleNamespace(stash=SimpleNamespace(setdefault=lambda key, value: written), getoption=lambda name: 2,
                             rootpath=tmp_path, invocation_params=SimpleNamespace(dir=tmp_path))
    item = cast(Any, SimpleNamespace(config=config, nodeid="test_a.py::test_b"))

    def refuses(path: Path) -> bool:
        raise OSError("disk full")

    assert failure_page(item, "", refuses) == "the page could not be written: disk full" and written == []
    assert failure_page(item, "", lambda path: False) == "" and written == []
    for suffix in ("", "#2"):
        assert failure_page(item, suffix, lambda path: True).startswith("every scan, in a browser: ")
    assert len(set(written)) == 2 and failure_page(item, "#3", lambda path: True) == ""


def test_a_source_that_is_gone_is_told_in_its_page(tmp_path: Path) -> None:
    said = _source(str(tmp_path / "no<1>.st"), FileCoverage())
    assert said.startswith("<p>") and said.endswith("</p>") and "<1>" not in said


def test_what_a_stub_has_written_is_told() -> None:
    assert Report._by(cast(Any, None), cast(Any, SimpleNamespace(site=None))) == "a stub"


def test_only_blocks_and_programs_have_names() -> None:
    rig = Rig.of("Main", text="PROGRAM Main VAR n : INT; d : TON; END_VAR END_PROGRAM")
    told = Report(rig.plc, cast(Any, None), cast(Any, None), cast(Any, None))
    assert [told.names_in(prefix) for prefix in ("", "Main.", "Main.n.", "D0..D3.")] == [[], ["n", "d"], [], []]
    assert told.names_in("Main.d.")[:2] == ["IN", "PT"]
