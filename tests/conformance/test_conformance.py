"""The tables of IEC 61131-3 ed. 3: a file a table, a program a feature; what is not executed is refused by its code."""

from __future__ import annotations

import os
from functools import partial
from itertools import groupby

import pytest
from feature_tables import GRAPHIC, HERE, LIST, choices, listing, numbers, titles
from lang_check import BUDGET, BUILDS, REFERENCE, check
from lang_corpus import Program, programs, read
from rows import go_through

from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc

TABLES = {stem: list(inside) for stem, inside in groupby(programs(HERE), lambda program: program.path.stem)}
"""The programs of each file."""
RUNNING = {stem: running for stem, inside in TABLES.items() if (running := [program for program in inside if program.runs])}


@pytest.mark.slow
@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_features(table: list[Program]) -> None:
    go_through((f"{p.path.stem}:{p.line} {p.title}", partial(check, p, REFERENCE)) for p in table)


@pytest.mark.slow
@pytest.mark.parametrize("table", RUNNING.values(), ids=RUNNING)
def test_features_on_every_engine(table: list[Program]) -> None:
    def build(image: Image, cycle_ns: int) -> Plc:
        return Plc(image, cycle_ns, budget=BUDGET, engine="native")

    builds = BUILDS | ({"native": build} if native.available() else {})
    go_through((f"{p.path.stem}:{p.line} {p.title}", partial(check, p, builds)) for p in table)


def test_every_program_expects_something() -> None:
    """A program without an expectation would show no more than that it compiles."""
    everything = (p for table in TABLES.values() for p in table)
    assert [f"{p.name}:{p.line}" for p in everything if not (p.expected or p.diagnostics or p.trap)] == []


def test_every_table_is_there() -> None:
    covered = {number for path in HERE.glob("*.st") for number in numbers(path)} | set(GRAPHIC)
    assert covered == set(titles()) == set(range(1, 77))


def test_every_choice_is_shown_by_programs() -> None:
    assert [path for _, _, path in choices() if not any(read(path))] == []


def test_the_list_says_what_the_programs_show() -> None:
    """`FBVM_REWRITE=1 pytest tests/conformance` writes the list anew; look at the difference before you keep it."""
    if os.environ.get("FBVM_REWRITE"):
        LIST.write_text(listing(), encoding="utf-8")
    assert LIST.read_text(encoding="utf-8") == listing()
