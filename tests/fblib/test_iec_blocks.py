"""The standard blocks against tables: one row a call, the time in ms and the inputs, then the outputs expected.

Rules: IEC 61131-3 ed. 3 tables 43 to 46; where the standard leaves a choice, the test's name says which was taken.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

MS = 1_000_000
FOLDER = data_folder("fblib") / "iec"
TIMERS = ["{}", "{}_TIME", "{}_LTIME", "L{}"]
COUNTERS = {
    "": ("INT", -32768, 32767),
    "_INT": ("INT", -32768, 32767),
    "_DINT": ("DINT", -(2**31), 2**31 - 1),
    "_LINT": ("LINT", -(2**63), 2**63 - 1),
    "_UDINT": ("UDINT", 0, 2**32 - 1),
    "_ULINT": ("ULINT", 0, 2**64 - 1),
}


@cache
def image_of(block: str, dialect: str = "standard") -> Image:
    made = compile_text(f"PROGRAM Main VAR b : {block}; END_VAR b(); END_PROGRAM", dialect=dialect)
    assert made.image is not None, [message.message for message in made.diagnostics]
    return made.image


def plays(block: str, inputs: str, outputs: str, table: str, *, time_unit: int = MS, dialect: str = "standard") -> None:
    """Plays a table.  Columns: time, the inputs, then the outputs, all as numbers; `-` leaves an input as it was."""
    plc = Plc(image_of(block, dialect))
    shown = []
    rows = [row.split() for row in table.strip().splitlines()]
    for row in rows:
        for name, cell in zip(inputs.split(), row[1:], strict=False):
            if cell != "-":
                value = bool(int(cell)) if isinstance(plc.read(f"Main.b.{name}"), bool) else int(cell)
                plc.write(f"Main.b.{name}", value * MS if name in ("PT", "SD_T", "SL_T") else value)
        assert plc.scan(int(row[0]) * time_unit) is None
        texts = []
        for name in outputs.split():
            result = plc.read(f"Main.b.{name}")
            assert isinstance(result, int)
            texts.append(str(result // MS if name == "ET" else int(result)))
        shown.append([*row[: 1 + len(inputs.split())], *texts])
    assert shown == rows


# --- bistables and edges (tables 43, 44) ------------------------------------------------------------------------------


def test_sr_set_wins() -> None:
    plays("SR", "S1 R", "Q1", """
        0  0 0  0
        1  1 0  1
        2  0 0  1
        3  0 1  0
        4  1 1  1
        5  0 1  0
    """)  # fmt: skip


def test_rs_reset_wins() -> None:
    plays("RS", "S R1", "Q1", """
        0  0 0  0
        1  1 0  1
        2  0 0  1
        3  1 1  0
        4  1 0  1
        5  0 1  0
    """)  # fmt: skip


@each_of(
    ("block", "table"),
    [
        ("R_TRIG", "0 0 0 \n 1 1 1 \n 2 1 0 \n 3 0 0 \n 4 1 1"),
        ("R_TRIG", "0 1 1 \n 1 1 0"),
        ("F_TRIG", "0 1 0 \n 1 0 1 \n 2 0 0 \n 3 1 0 \n 4 0 1"),
        ("F_TRIG", "0 0 1 \n 1 0 0"),
    ],
    ids=["rise", "TRUE in the first call rises", "fall", "FALSE in the first call falls, as in the standard's body"],
)
def test_edges(block: str, table: str) -> None:
    plays(block, "CLK", "Q", table)


def test_the_first_call_of_a_falling_edge_has_none_before_it_in_codesys() -> None:
    plays("F_TRIG", "CLK", "Q", "0 0 0 \n 1 1 0 \n 2 0 1 \n 3 0 0 \n 4 1 0 \n 5 0 1", dialect="codesys")
    plays("F_TRIG", "CLK", "Q", "0 1 0 \n 1 0 1 \n 2 0 0", dialect="codesys")


# --- counters (table 45) ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("suffix", COUNTERS)
def test_ctu(suffix: str) -> None:
    plays("CTU" + suffix, "CU R PV", "Q CV", """
        0  1 0 2  0 1
        1  1 0 2  0 1
        2  0 0 2  0 1
        3  1 0 2  1 2
        4  0 0 2  1 2
        5  1 0 2  1 3
        6  1 1 2  0 0
        7  0 1 2  0 0
        8  1 1 2  0 0
        9  1 0 2  0 0
        10 0 0 0  1 0
    """)  # fmt: skip


@each_of("suffix", COUNTERS)
def test_ctd(suffix: str) -> None:
    plays("CTD" + suffix, "CD LD PV", "Q CV", """
        0  0 0 2  1 0
        1  0 1 2  0 2
        2  1 1 2  0 2
        3  1 0 2  0 2
        4  0 0 2  0 2
        5  1 0 2  0 1
        6  0 0 2  0 1
        7  1 0 2  1 0
        8  1 1 2  0 2
    """)  # fmt: skip


@pytest.mark.slow
@each_of("suffix", COUNTERS)
def test_ctud(suffix: str) -> None:
    plays("CTUD" + suffix, "CU CD R LD PV", "QU QD CV", """
        0  0 0 0 0 2  0 1 0
        1  1 0 0 0 2  0 0 1
        2  0 0 0 0 2  0 0 1
        3  1 1 0 0 2  0 0 1
        4  0 0 0 0 2  0 0 1
        5  1 0 0 0 2  1 0 2
        6  1 1 0 0 2  0 0 1
        7  0 0 0 1 2  1 0 2
        8  0 0 1 1 2  0 1 0
        9  1 0 1 0 2  0 1 0
        10 1 0 0 0 2  0 1 0
    """)  # fmt: skip


@each_of("suffix", COUNTERS)
def test_counters_stop_at_the_limits_of_their_type(suffix: str) -> None:
    _, low, high = COUNTERS[suffix]
    plays("CTU" + suffix, "CV CU PV", "CV", f"0 {high - 1} 1 {high} {high} \n 1 - 0 - {high} \n 2 - 1 - {high}")
    plays("CTD" + suffix, "CV CD PV", "CV", f"0 {low + 1} 1 0 {low} \n 1 - 0 - {low} \n 2 - 1 - {low}")
    plays("CTUD" + suffix, "CV CU CD PV", "CV", f"0 {high} 1 0 0 {high} \n 1 {low} 0 1 0 {low}")


@pytest.mark.parametrize("suffix", [suffix for suffix, (_, low, _) in COUNTERS.items() if low < 0])
def test_counting_down_goes_below_zero(suffix: str) -> None:
    plays("CTD" + suffix, "CD LD PV", "Q CV", "0 1 0 5 1 -1")
    plays("CTUD" + suffix, "CU CD", "QU QD CV", "0 0 1 0 1 -1")


# --- timers (table 46) ------------------------------------------------------------------------------------------------


@each_of("form", TIMERS)
def test_ton(form: str) -> None:
    plays(form.format("TON"), "IN PT", "Q ET", """
        0   0 30  0 0
        10  1 30  0 0
        25  1 30  0 15
        39  1 30  0 29
        40  1 30  1 30
        90  1 30  1 30
        95  0 30  0 0
        96  1 30  0 0
        100 0 30  0 0
        101 1 30  0 0
        500 1 30  1 30
    """)  # fmt: skip


@each_of("form", TIMERS)
def test_tof(form: str) -> None:
    plays(form.format("TOF"), "IN PT", "Q ET", """
        0   0 30  0 0
        5   1 30  1 0
        10  0 30  1 0
        25  0 30  1 15
        30  1 30  1 0
        35  0 30  1 0
        64  0 30  1 29
        65  0 30  0 30
        99  0 30  0 30
        100 1 30  1 0
    """)  # fmt: skip


@each_of("form", TIMERS)
def test_tp(form: str) -> None:
    plays(form.format("TP"), "IN PT", "Q ET", """
        0   0 30  0 0
        10  1 30  1 0
        15  0 30  1 5
        20  1 30  1 10
        39  1 30  1 29
        40  1 30  0 30
        60  1 30  0 30
        61  0 30  0 0
        62  1 30  1 0
        70  0 30  1 8
        92  0 30  0 0
        93  1 30  1 0
    """)  # fmt: skip


@each_of("form", TIMERS)
def test_the_first_call_with_in_true(form: str) -> None:
    plays(form.format("TON"), "IN PT", "Q ET", "100 1 30 0 0 \n 130 1 30 1 30")
    plays(form.format("TOF"), "IN PT", "Q ET", "100 1 30 1 0 \n 110 0 30 1 0")
    plays(form.format("TP"), "IN PT", "Q ET", "100 1 30 1 0 \n 130 1 30 0 30")


@each_of("pt", [0, -5])
@each_of("form", TIMERS)
def test_no_time_at_all(form: str, pt: int) -> None:
    """TON is TRUE in the call in which IN rises, TP never, TOF follows IN."""
    plays(form.format("TON"), "IN PT", "Q ET", f"0 0 {pt} 0 0 \n 1 1 {pt} 1 0 \n 2 1 {pt} 1 0 \n 3 0 {pt} 0 0")
    plays(form.format("TP"), "IN PT", "Q ET", f"0 1 {pt} 0 0 \n 1 1 {pt} 0 0 \n 2 0 {pt} 0 0 \n 3 1 {pt} 0 0")
    plays(form.format("TOF"), "IN PT", "Q ET", f"0 1 {pt} 1 0 \n 1 0 {pt} 0 0 \n 2 0 {pt} 0 0")


@each_of("form", TIMERS)
def test_pt_is_read_in_each_call_until_the_time_is_over(form: str) -> None:
    plays(form.format("TON"), "IN PT", "Q ET", "0 1 30 0 0 \n 20 1 15 1 15 \n 21 1 90 1 15")
    plays(form.format("TOF"), "IN PT", "Q ET", "0 1 30 1 0 \n 5 0 30 1 0 \n 20 0 10 0 10 \n 21 0 90 0 10")
    plays(form.format("TP"), "IN PT", "Q ET", "0 1 30 1 0 \n 20 1 15 0 15 \n 21 1 90 0 15")


def test_a_timer_that_is_not_called_does_not_move() -> None:
    made = compile_text(
        "PROGRAM Main VAR b : TON; call : BOOL := TRUE; END_VAR "
        "IF call THEN b(IN := TRUE, PT := T#30ms); END_IF; END_PROGRAM"
    )
    assert made.image is not None
    plc = Plc(made.image)
    plc.scan(0)
    plc.write("Main.call", False)
    plc.scan(100 * MS)
    assert (plc.read("Main.b.Q"), plc.read("Main.b.ET")) == (False, 0)
    plc.write("Main.call", True)
    plc.scan(110 * MS)
    assert (plc.read("Main.b.Q"), plc.read("Main.b.ET")) == (True, 30 * MS)


@each_of("form", TIMERS)
@each_of("kind", ["TON", "TOF", "TP"])
def test_a_running_timer_says_when_it_will_end(kind: str, form: str) -> None:
    plc = Plc(image_of(form.format(kind)))
    plc.write("Main.b.PT", 30 * MS)
    plc.write("Main.b.IN", True)
    plc.scan(5 * MS)
    start = 5
    if kind == "TOF":
        plc.write("Main.b.IN", False)
        plc.scan(7 * MS)
        start = 7
    assert plc.due_ns == (start + 30) * MS
    plc.scan((start + 30) * MS)
    assert plc.due_ns > 1000 * MS


# --- actions of charts (tables 59, 60) --------------------------------------------------------------------------------

ACTION = "N R S P P1 P0 SD DS SL SD_T SL_T"
CHARTS = {"standard": "with a final scan", "matiec": "without a final scan"}
"""A table of an action has Q, then A with a final scan; without one A is Q, or TRUE in a scan of P1 or P0."""


def plays_action(dialect: str, table: str) -> None:
    """Plays a table of the inputs N to SL, Q and A; the delay is 20 ms, the limit 30 ms."""
    rows = []
    for row in table.strip().splitlines():
        at, *inputs, is_on, runs = row.split()
        if dialect == "matiec":
            runs = str(int(is_on == "1" or "1" in inputs[4:6]))
        rows.append(" ".join([at, *inputs, "20", "30", is_on, runs]))
    plays("SFC_ACTION_CONTROL", ACTION, "Q A", "\n".join(rows), dialect=dialect)


@each_of("dialect", CHARTS, ids=CHARTS.values())
def test_an_action_runs_by_the_qualifiers_of_its_steps(dialect: str) -> None:
    plays_action(dialect, """
        0  0 0 0 0 0 0 0 0 0  0 0
        1  1 0 0 0 0 0 0 0 0  1 1
        2  0 0 0 0 0 0 0 0 0  0 1
        3  0 0 0 0 0 0 0 0 0  0 0
        4  0 0 0 1 0 0 0 0 0  1 1
        5  1 1 0 1 0 0 0 0 0  0 1
        6  0 0 0 0 1 0 0 0 0  0 1
        7  0 0 0 0 0 1 0 0 0  0 1
        8  0 0 0 0 0 0 0 0 0  0 0
        9  0 0 1 0 0 0 0 0 0  1 1
        10 0 0 0 0 0 0 0 0 0  1 1
        11 0 1 1 0 0 0 0 0 0  0 1
        12 0 0 0 0 0 0 0 0 0  0 0
        13 0 0 0 0 0 0 0 1 0  1 1
        14 0 0 0 0 0 0 0 0 0  1 1
        15 0 1 0 0 0 0 0 0 0  0 1
        16 0 0 0 0 0 0 0 0 0  0 0
    """)  # fmt: skip


@each_of("dialect", CHARTS, ids=CHARTS.values())
def test_an_action_that_is_stored_begins_late_or_ends_early(dialect: str) -> None:
    plays_action(dialect, """
        100 0 0 0 0 0 0 1 0 0  0 0
        110 0 0 0 0 0 0 1 0 0  0 0
        119 0 0 0 0 0 0 0 0 0  0 0
        120 0 0 0 0 0 0 0 0 0  1 1
        130 0 0 0 0 0 0 1 0 0  1 1
        131 0 1 0 0 0 0 0 0 0  0 1
        132 0 0 0 0 0 0 0 0 0  0 0
        200 0 0 0 0 0 0 0 0 1  1 1
        210 0 0 0 0 0 0 0 0 1  1 1
        229 0 0 0 0 0 0 0 0 0  1 1
        230 0 0 0 0 0 0 0 0 0  0 1
        231 0 0 0 0 0 0 0 0 1  0 0
        232 0 1 0 0 0 0 0 0 0  0 0
        233 0 0 0 0 0 0 0 0 1  1 1
        234 0 1 0 0 0 0 0 0 1  0 1
        235 0 0 0 0 0 0 0 0 0  0 0
        240 0 0 0 0 0 0 1 0 0  0 0
        241 0 1 0 0 0 0 0 0 0  0 0
        270 0 0 0 0 0 0 0 0 0  0 0
    """)  # fmt: skip


@each_of("dialect", CHARTS, ids=CHARTS.values())
@each_of(("pin", "after"), [("SD", 20), ("SL", 30)])
def test_an_action_says_when_it_will_begin_or_end(dialect: str, pin: str, after: int) -> None:
    plc = Plc(image_of("SFC_ACTION_CONTROL", dialect))
    for name, value in (("SD_T", 20 * MS), ("SL_T", 30 * MS), (pin, True)):
        plc.write(f"Main.b.{name}", value)
    plc.scan(5 * MS)
    assert plc.due_ns == (5 + after) * MS
    plc.scan((5 + after - 1) * MS)
    assert plc.due_ns == (5 + after) * MS
    plc.scan((5 + after) * MS)
    assert plc.due_ns > 1000 * MS


# --- the files --------------------------------------------------------------------------------------------------------


def plain(path: Path) -> str:
    """The text of a block without its comments."""
    return "\n".join(re.sub(r"//.*", "", line).rstrip() for line in path.read_text(encoding="utf-8").splitlines())


@each_of("kind", ["CTU", "CTD", "CTUD"])
@each_of("suffix", COUNTERS)
def test_counters_of_all_types_are_one_text(kind: str, suffix: str) -> None:
    name, low, high = COUNTERS[suffix]
    text = plain(FOLDER / f"{kind}.st")
    text = text.replace("INT#-32768", f"INT#{low}").replace("INT#32767", f"INT#{high}")
    text = re.sub(r"\bINT\b", name, text).replace(f"FUNCTION_BLOCK {kind}\n", f"FUNCTION_BLOCK {kind}{suffix}\n")
    assert plain(FOLDER / f"{kind}{suffix}.st") == text


@each_of("kind", ["TON", "TOF", "TP"])
@each_of("form", TIMERS)
def test_timers_of_both_types_are_one_text(kind: str, form: str) -> None:
    name = form.format(kind)
    text = plain(FOLDER / f"{name}.st").replace(f"FUNCTION_BLOCK {name}", f"FUNCTION_BLOCK {kind}")
    text = text.replace("TIME_TO_LTIME(TIME())", "TIME()").replace("LTIME_TO_TIME(Start + PT)", "Start + PT")
    text = text.replace("LTIME#", "T#").replace("LTIME", "TIME")
    assert text == plain(FOLDER / f"{kind}.st")
