"""Breakpoints of a client as they are kept: their numbers, what another program has of them, and when all are taken away."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.dap.breakpoints import BreakpointRequests, Wanted, _codes
from fbvm.machine.breakpoints import Breakpoint
from fbvm.machine.plc import Plc
from fbvm.step.facts import ProgramFacts

ROWS = {name: Breakpoint("line", name, "", "") for name in ("a", "b", "c", "gone")}


class Debugged:
    """Two PLCs, what was set on each, and what the client was told."""

    def __init__(self) -> None:
        self.put: list[tuple[str, list[str]]] = []
        self.sent: list[tuple[str, Any]] = []
        self.checks: dict[str, object] = {"one": object()}
        self.running = SimpleNamespace(plcs={name: SimpleNamespace(put=lambda rows, name=name: self.put.append(
            (name, [row.where for row in rows]))) for name in ("one", "two")}, checks={"one": object()})  # fmt: skip

    def send_event(self, name: str, body: object) -> None:
        self.sent.append((name, body))

    def plc(self, name: str) -> Any:
        return SimpleNamespace(source=None, facts=SimpleNamespace(described={}))


def wanted(number: int, *rows: tuple[str, str]) -> Wanted:
    return Wanted(number, tuple((plc, ROWS[row]) for plc, row in rows))


def requests(*groups: list[Wanted]) -> tuple[Any, Debugged]:
    debugged = Debugged()
    made = BreakpointRequests(debugged, {str(number): group for number, group in enumerate(groups)}, {"late": ""}, 7)  # type: ignore
    return made, debugged


def test_each_plc_gets_its_own_rows_of_all_groups() -> None:
    made, debugged = requests([wanted(1, ("one", "a"), ("two", "a"))], [wanted(2, ("two", "b")), wanted(3)])
    made.apply()
    assert debugged.put == [("one", ["a"]), ("two", ["a", "b"])] and list(debugged.running.checks) == ["one", "two"]
    assert not made.is_empty and made.is_on("late")
    made.clear()
    assert debugged.put[2:] == [("one", []), ("two", [])] and debugged.running.checks == {}
    assert made.is_empty and not made.is_on("late")


def test_another_program_has_what_it_can_have_and_the_client_hears_of_the_rest() -> None:
    first = [wanted(1, ("one", "a"), ("gone", "a")), wanted(2, ("one", "gone")), wanted(3), wanted(4, ("gone", "b"))]
    made, debugged = requests(first, [wanted(5, ("two", "c"))])
    made._try = lambda rows: ([(plc, row) for plc, row in rows if row.where != "gone"], "there is no line gone")
    made.renew()
    assert made._groups == {"0": [wanted(1, ("one", "a")), wanted(2), wanted(3), wanted(4)], "1": [wanted(5, ("two", "c"))]}
    assert debugged.put == [("one", ["a"]), ("two", ["c"])]
    assert debugged.sent == [("breakpoint", {"reason": "changed", "breakpoint": {
        "id": number, "verified": False, "reason": "failed", "message": "there is no line gone"}}) for number in (2, 4)]


def test_numbers_count_on_and_are_kept_where_the_client_knows_them() -> None:
    made, _ = requests([wanted(1, ("one", "a")), wanted(2, ("one", "b"))])
    pending = made.pending(2)["breakpoints"]
    assert pending == [{"id": number, "verified": False, "reason": "pending", "message": "the program is not loaded yet"}
                       for number in (7, 8)] and made.pending(1)["breakpoints"][0]["id"] == 9
    assert made._answer("x", [([("two", ROWS["c"])], {"line": 3}), ([], {"message": "no"})]) == {"breakpoints": [
        {"id": 10, "verified": True, "line": 3}, {"id": 11, "verified": False, "message": "no"}]}
    made.keep_numbers({10: 7, 1: 5})
    assert made._groups == {"0": [wanted(5, ("one", "a")), wanted(2, ("one", "b"))], "x": [wanted(7, ("two", "c")), wanted(11)]}
    for plc, reached, numbers in (("one", "a", [5]), ("two", "a", []), ("two", "c", [7]), ("one", "gone", [])):
        assert made.numbers(plc, [ROWS[reached]]) == numbers


CHARTS = """FUNCTION_BLOCK Gait
VAR n : INT; END_VAR
INITIAL_STEP Start: END_STEP
STEP Walk: END_STEP
TRANSITION FROM Start TO Walk := n > 1; END_TRANSITION
TRANSITION FROM Walk TO Start := TRUE; END_TRANSITION
END_FUNCTION_BLOCK
PROGRAM Main
VAR left, right : Gait; END_VAR
INITIAL_STEP Idle: END_STEP
STEP Walk: Both(N); END_STEP
TRANSITION FROM Idle TO Walk := TRUE; END_TRANSITION
TRANSITION FROM Walk TO Idle := TRUE; END_TRANSITION
ACTION Both: left(); right(); END_ACTION
END_PROGRAM"""


@each_of(("name", "when", "row"), [
    ("Main.Walk", "", ("condition", "Main.Walk.X", "")), ("main.walk", "n > 1", ("condition", "Main.walk.X AND (n > 1)", "")),
    ("Main.Other", "", ("line", "Main.Other", "")), ("Walk", "n > 1", ("line", "Walk", "n > 1")),
    ("Nobody.Walk", "", ("line", "Nobody.Walk", "")), ("Main.Start", "", ("line", "Main.Start", "")),
    ("Gait.Walk", "", ("condition", "Main.left.Walk.X", "")), ("GAIT.START", "", ("condition", "Main.left.START.X", "")),
    ("main.RIGHT.Walk", "n", ("condition", "main.RIGHT.Walk.X AND (n)", "")), ("Gait.Idle", "", ("line", "Gait.Idle", "")),
])  # fmt: skip
def test_a_step_of_a_chart_is_a_condition_of_the_first_instance(name: str, when: str, row: tuple[str, str, str]) -> None:
    debugged, image = Debugged(), compile_text(CHARTS).image
    assert image
    facts = ProgramFacts.of(Plc(image))
    debugged.plc = lambda name: SimpleNamespace(facts=facts)  # type: ignore[method-assign]
    made = BreakpointRequests(debugged)._function("one", name, when, "3")  # type: ignore[arg-type]
    assert (made.kind, made.where, made.when, made.hits) == (*row, "3")


@each_of(("condition", "codes"), [
    ("", set()), ("  ", set()), ("2", {2}), (" 16#0302 ", {0x302}), ("code = 2", {2}), ("Code=2, 3,16#10", {2, 3, 16}),
    ("= 7", {7}), ("0", {0}),
    *((text, None) for text in ("x", "TRUE", "1.5", "2,", "code", "codes = 2", "2 = code", "'2'"))])  # fmt: skip
def test_the_condition_of_a_filter_names_codes(condition: str, codes: set[int] | None) -> None:
    debugged = Debugged()
    debugged.running.plcs = {}
    made = BreakpointRequests(debugged)  # type: ignore[arg-type]
    (answer,) = made.set_exceptions({"filterOptions": [{"filterId": "modbus", "condition": condition}]})["breakpoints"]
    assert (answer["verified"], made.is_on("modbus")) == (codes is not None, codes is not None), answer
    if codes is not None:
        assert _codes(condition) == codes


def test_filters_are_those_of_the_last_request() -> None:
    debugged = Debugged()
    debugged.running.plcs = {}
    made = BreakpointRequests(debugged)  # type: ignore[arg-type]
    made.set_exceptions({"filters": ["modbus", "trap"]})
    made.set_exceptions({"filters": ["trap", "nobody"], "filterOptions": [{"filterId": "response"}]})
    assert [name for name in ("modbus", "trap", "response", "nobody") if made.is_on(name)] == ["trap", "response"]
    made.set_exceptions({})
    assert not made.is_on("trap")


def test_the_places_of_one_line_are_asked_for_by_its_number() -> None:
    asked: list[tuple[str, int, int]] = []
    sources = SimpleNamespace(name_of=lambda source: source.get("path"), line=lambda number: number,
                              locations=lambda *given: asked.append(given) or [given[1:]])  # type: ignore[func-returns-value]
    made = BreakpointRequests(SimpleNamespace(sources=sources))  # type: ignore[arg-type]
    for arguments, places in (({"line": 5}, [(5, 5)]), ({"line": 5, "endLine": 7}, [(5, 7)])):
        assert made.locations({"source": {"path": "a.st"}, **arguments}) == {"breakpoints": places}
    assert made.locations({"line": 5}) == {"breakpoints": []} and len(asked) == 2
