"""Travel in time: whatever a PLC did, a snapshot leads back to it and the same scans lead to the same memory."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

PROGRAM = """
PROGRAM Main
VAR
    In : ARRAY[0..3] OF BOOL;
    On : TON;
    Off : TOF;
    Pulse : TP;
    Count : CTUD;
    Edge : R_TRIG;
    Sum AT D100 : DINT;
    Text : STRING[20];
END_VAR
VAR RETAIN Kept : INT; END_VAR
    On(IN := In[0], PT := T#25ms);
    Off(IN := In[1], PT := T#15ms);
    Pulse(IN := In[2], PT := T#35ms);
    Edge(CLK := In[3]);
    Count(CU := On.Q, CD := Off.Q, R := Pulse.Q, LD := FALSE, PV := 3);
    Sum := Sum * 31 + INT_TO_DINT(Count.CV);
    IF Edge.Q THEN Kept := Kept + 1; Text := CONCAT(Text, 'x'); END_IF;
END_PROGRAM
"""
inputs = st.lists(st.tuples(*[st.booleans()] * 4), max_size=12)


@cache
def image() -> Image:
    compiled = compile_text(PROGRAM).image
    assert compiled is not None
    return compiled


def feed(plc: Plc, rows: list[tuple[bool, ...]]) -> bytes:
    for row in rows:
        plc.write("Main.In", list(row))
        plc.scan()
    return bytes(plc.memory.snapshot())


@pytest.mark.slow
@settings(deadline=None)
@given(before=inputs, after=inputs, astray=inputs)
def test_a_way_back_is_a_way_back(before: list[tuple[bool, ...]], after: list[tuple[bool, ...]],
                                  astray: list[tuple[bool, ...]]) -> None:  # fmt: skip
    plc = Plc(image())
    feed(plc, before)
    state, twin = plc.snapshot(), plc.fork()
    first = feed(plc, after)
    feed(plc, astray)
    plc.restore(state)
    assert feed(plc, after) == first
    assert feed(twin, after) == first


@pytest.mark.slow
@settings(deadline=None)
@given(rows=inputs)
def test_plain_and_observed_agree(rows: list[tuple[bool, ...]]) -> None:
    assert feed(Plc(image()), rows) == feed(Plc(image(), observed=True), rows)


@pytest.mark.slow
@settings(deadline=None)
@given(rows=inputs)
def test_a_warm_start_keeps_what_is_retained_and_nothing_else(rows: list[tuple[bool, ...]]) -> None:
    plc = Plc(image())
    feed(plc, rows)
    kept, total = plc.read("Main.Kept"), plc.read("Main.Sum")
    plc.warm_start()
    assert (plc.read("Main.Kept"), plc.read("Main.Sum"), plc.read("Main.Text")) == (kept, total, "")
    assert plc.read("Main.On") == Plc(image()).read("Main.On")
