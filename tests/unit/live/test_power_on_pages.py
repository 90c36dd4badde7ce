"""Power of rungs on pages: which PLCs note it for whom, and which values stand beside their contacts."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest
from browsers import Page
from test_workbench import CHART

from fbvm.code.compiler import compile_text
from fbvm.live.host import LiveHost
from fbvm.live.program import PowerView, _values_now
from fbvm.live.updates import UPDATE_NS
from fbvm.machine.plc import Plc

RUNGS = """\
PROGRAM Main
VAR
    on : BOOL := TRUE; off, out : BOOL; n : UINT := 7; m : INT; few : ARRAY[1..2] OF INT := [4, 3];
    Word1 AT D100 : WORD; Bit1 AT CIO 10.01 : BOOL;
END_VAR
LADDER
    LD on
    AND> n &5
    OR Bit1
    OR 10.02
    OUT out
    LD on
    MOV n m
    LD on
    AND> few[2] few[1]
    OUT W0.00
    LD on
    AND> D100 W3
    AND> Word1 W3
    OUT off
END_LADDER
END_PROGRAM
"""


@pytest.mark.parametrize(("shows", "held", "noted"), [
    ((True, True), "", {"a", "b"}), ((True, False), "", {"a"}), ((False, False), "", set()), ((True, True), "a debugger", set())])
def test_power_is_noted_where_a_page_shows_rungs_and_nobody_else_has_the_plcs(
    shows: tuple[bool, bool], held: str, noted: set[str]
) -> None:
    class Live(SimpleNamespace):
        __hash__ = object.__hash__
        power = True

        def end_power(self) -> None:
            self.power = False

    lives = {name: Live() for name in "abc"}
    bench: Any = SimpleNamespace(plcs=lives, changes=None, pictures=None, groups=None, held_by=held,
                                 let_go=lambda: None)
    host = LiveHost(bench, token="t")
    host.close()
    pages = [SimpleNamespace(live=live, shows_inside=is_shown) for live, is_shown in zip(lives.values(), shows, strict=False)]
    host.server = SimpleNamespace(sessions=pages, update=lambda now_ns, is_late: None)  # type: ignore[assignment]
    host.update(UPDATE_NS - 1, lambda: False)
    assert all(live.power for live in lives.values()), "it is not time yet"
    host.update(UPDATE_NS, lambda: False)
    assert {name for name, live in lives.items() if live.power} == noted


@pytest.mark.slow
def test_values_that_are_no_bits_stand_beside_the_contacts_of_the_present() -> None:
    page = Page(RUNGS, real=True)
    page.done("hello", version=1)
    page.done("look", plc="pump", instance="Main", scan=True)
    page.update()
    page.plc.write("D100", 0x12)
    page.scan(2)
    pictures = page.update()["inside"]["pictures"]
    assert [texts(svg) for _, svg in pictures] == [
        "on n &amp;5 out &gt; = 7 Bit1 10.02", "on MOV n = 7 m = 7", "on few[2] few[1] W0.00 &gt; = 3, 4",
        "on D100 W3 Word1 W3 off &gt; &gt; = 18, 0000h = 18, 0000h"]
    operands = ("on", "Bit1", "10.02", "n", "few[2]", "few", "Nobody", "&5", "D100", "Word1", "%D100", "W3")
    rung: Any = SimpleNamespace(picture=SimpleNamespace(steps=[(0, "", "", ("m",)), (0, "", "", operands)]))
    assert _values_now(page.plc, rung, "Main") == {
        (0, "m"): "7", (1, "n"): "7", (1, "few[2]"): "3", (1, "D100"): "18", (1, "Word1"): "18", (1, "%D100"): "18",
        (1, "W3"): "0000h"}, "bits, what is no single value, and what is no place have none"


def test_transitions_that_machine_code_has_noted_are_drawn_as_tested() -> None:
    image = compile_text(CHART).image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    chart = image.charts[0]
    rows = [site for site, *_ in chart.transitions]
    drawn = []
    for noted in ({}, {rows[0]: True}, {rows[0]: False}, {rows[1]: True}):
        power: Any = SimpleNamespace(body=lambda name: (chart.body, plc.find("Main").offset),
                                     elements=lambda name, noted=noted: {(site, 0): value for site, value in noted.items()})
        steps = PowerView(plc, power, "Main", {}).steps_of("Main")
        assert next(steps) is None
        with pytest.raises(StopIteration) as ended:
            next(steps)
        made = ended.value.value
        assert (made["scan"], made["executed"], len(made["pictures"])) == (0, [], 1)
        drawn.append(made["pictures"][0][1])
    assert len(set(drawn)) == 4, "not tested; passed; not passed; the other one passed"


def texts(svg: str) -> str:
    """What is written in a drawing."""
    return " ".join(re.findall(">([^<>]+)</text>", svg))
