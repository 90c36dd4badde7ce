"""The encoder executes what the engine executes: the same memory, cell by cell, and the same traps."""

from __future__ import annotations

from collections import Counter
from functools import partial
from itertools import accumulate, groupby
from pathlib import Path
from random import Random

import lang_check
import lang_corpus
import pytest
import st_programs
from depth import times
from encoded import compare_scans
from rows import go_through

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_files, compile_sources, compile_text
from fbvm.code.operations import EXPRESSIONS, STATEMENTS
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.expressions import EXPRESSION_ROWS
from fbvm.prove.encoding.statements import BRANCHES, LEAVES, STATEMENT_ROWS

CLASSICS = sorted((data_folder("examples") / "classics").glob("*.st"))
CYCLE_NS, BUDGET = 10_000_000, 20_000


def pressed(random: Random, plc: Plc, number: int) -> None:
    """Writes some inputs at random, and a word that programs scale."""
    for bit in range(6):
        if random.random() < 0.3:
            plc.write(f"CIO 0.{bit:02}", random.random() < 0.5)
    plc.write("D100", random.randrange(1 << 16))


@pytest.mark.slow
@pytest.mark.parametrize("path", [pytest.param(path, id=path.stem) for path in CLASSICS])
def test_classics_with_random_inputs(path: Path) -> None:
    image = compile_files([path], runnable=True).image
    assert image is not None
    compare_scans(image, 3 * CYCLE_NS, times(100, 60), BUDGET, partial(pressed, Random(1)))


ENCODED = [p for p in lang_corpus.programs() if p.runs]
REFUSED_AT_MOST = 20
"""Programs of the corpus with pointers to variables that end with their call."""
DYNAMIC_MEMORY = "what __NEW has made cannot be followed"
"""Why programs that call __NEW, and no others, may be refused."""


def compare_program(program: lang_corpus.Program, refused: Counter[str]) -> None:
    source = Source(program.name, program.text)
    image = compile_sources([source], runnable=True, dialect=program.dialect, lint=False).image
    assert image is not None

    def write(plc: Plc, number: int) -> None:
        for item in lang_check._at(program.written, number + 1):
            place = lang_check._place(plc, item)
            plc.write(place, lang_check._value(place, item.value))

    try:
        compare_scans(image, program.cycle_ns, program.scans, BUDGET, write)
    except Refused as reason:
        if reason.reason != DYNAMIC_MEMORY or "__NEW" not in program.text:
            refused[reason.reason] += 1


@pytest.mark.slow
@pytest.mark.parametrize("folder", [pytest.param(list(inside), id=name)
                                    for name, inside in groupby(ENCODED, lambda p: p.path.parent.name)])
def test_programs_of_the_corpus(folder: list[lang_corpus.Program]) -> None:
    refused: Counter[str] = Counter()
    go_through((f"{p.name}:{p.line} {p.title}", partial(compare_program, p, refused)) for p in folder)
    assert refused.total() <= REFUSED_AT_MOST, refused
    assert set(refused) <= {"a pointer to a variable that ends with its call cannot be followed",
                            "calls come back more than 32 times, which is too deep to be followed"}


@pytest.mark.slow
def test_random_programs() -> None:
    refused = 0
    for seed in range(times(100, 80)):
        text, _ = st_programs.text_of(st_programs.made(seed))
        image = compile_text(text).image
        if image is not None:
            try:
                compare_scans(image, CYCLE_NS, 3, st_programs.budget(image))
            except Refused:
                refused += 1
    assert refused <= times(20, 80)


CLOCKED = """PROGRAM Slow VAR n : INT; END_VAR n := n + 1; END_PROGRAM
PROGRAM Fast
VAR
    longest AT A262 : UDINT; last AT A264 : UDINT; n : INT; sum : UDINT; t : TON; First AT A200.11 : BOOL;
END_VAR
sum := sum + last + longest; n := n + 1; IF First THEN n := 100; END_IF t(IN := NOT t.Q, PT := T#35ms);
END_PROGRAM
PROGRAM Pulses VAR q : ARRAY[0..4] OF BOOL; w, x : WORD; a0 AT A0 : WORD; a1 AT A1 : WORD; END_VAR
LADDER
LD P_0_02s
OUT q[0]
LD P_0_1s
OUT q[1]
LD P_0_2s
OUT q[2]
LD P_1s
OUT q[3]
LD P_1min
OUT q[4]
LD P_On
MOV a0 w
MOV a1 x
END_LADDER
END_PROGRAM
CONFIGURATION C RESOURCE R ON PLC
TASK S(INTERVAL := T#70ms, PRIORITY := 2); TASK F(INTERVAL := T#10ms, PRIORITY := 1); TASK P(INTERVAL := T#1ms, PRIORITY := 3);
PROGRAM A WITH S : Slow; PROGRAM B WITH F : Fast; PROGRAM C WITH P : Pulses;
END_RESOURCE END_CONFIGURATION
"""


@pytest.mark.slow
@pytest.mark.parametrize("longest_ns", [9_000_000, 45_000_000, 3_000_000_000])
def test_scans_at_any_times(longest_ns: int) -> None:
    image = compile_text(CLOCKED).image
    assert image is not None
    random = Random(longest_ns)
    times_ns = [0, *accumulate(random.randint(1_000, longest_ns) for _ in range(60))]
    compare_scans(image, CYCLE_NS, 60, BUDGET, times_ns=times_ns)


def test_clock_pulses_behind_pauses_of_many_periods() -> None:
    image = compile_text("PROGRAM Main VAR q : BOOL; END_VAR\nLADDER\nLD P_0_02s\nOUT q\nEND_LADDER\nEND_PROGRAM").image
    assert image is not None
    times_ns = [0, *accumulate([3_000_000, 75_000_000, 1_234_567_000, 11_000_000])]
    compare_scans(image, CYCLE_NS, 5, BUDGET, times_ns=times_ns)


def test_every_operation_has_its_row() -> None:
    assert set(EXPRESSION_ROWS) == set(EXPRESSIONS)
    made_for_others = {"count", "mark"}  # by engines, of an image that has none
    assert {*STATEMENT_ROWS, *BRANCHES, *LEAVES} | made_for_others == set(STATEMENTS)


def test_an_interlock_with_random_inputs() -> None:
    image = compile_files([data_folder("examples") / "classics" / "interlock.st"], runnable=True).image
    assert image is not None
    compare_scans(image, CYCLE_NS, 8, BUDGET, partial(pressed, Random(2)))
