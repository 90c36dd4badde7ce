"""What a program that is being edited keeps: as much after many keys as after few."""

from __future__ import annotations

import gc
import itertools
import sys
from collections.abc import Callable

import pytest
from growth import least_kept_bytes
from rows import each_of

from fbvm.analysis import garbage
from fbvm.analysis.hover import hover
from fbvm.analysis.program import Program
from fbvm.analysis.references import references, use_at
from fbvm.syntax import tree

BODY = "".join(f"    Level := Level + {number};\n" for number in range(50))
TEXT = f"PROGRAM Main\nVAR Level : DINT; END_VAR\n{BODY}    Level := 0;\nEND_PROGRAM\n"
KEYS, MOST_BYTES = 40, 25_000
"""Keys that are typed, and the bytes that may be kept of them: less than half the text of each."""


def check_changes(program: Program) -> None:
    assert program.check_changes()


def look(program: Program) -> None:
    """What somebody asks who stands at a name."""
    assert program.check_changes()
    place = program.files["a.st"].text.index("Level")
    assert hover(program, "a.st", place) is not None
    found = use_at(program, "a.st", place)
    assert found is not None and len(references(program, found[1].key)) > 50


WAYS = {"a POU is checked": check_changes, "everything is checked": Program.check_all, "a name is looked at": look}


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_heap")
@each_of("way", WAYS.values(), ids=WAYS)
def test_keys_leave_nothing_behind(way: Callable[[Program], None]) -> None:
    program = Program()
    program.replace("a.st", TEXT)
    program.check_all()

    numbers = itertools.count(1000)

    def typed(keys: int) -> None:
        for number in itertools.islice(numbers, keys):
            program.replace("a.st", TEXT.replace("Level := 0;", f"Level := {number};"))
            way(program)
            program.diagnostics("a.st")
        program.check_all()

    typed(5)
    assert least_kept_bytes(lambda: typed(KEYS)) < MOST_BYTES


@pytest.mark.slow
def test_keys_without_a_pause_leave_one_version_of_a_body() -> None:
    program = Program()
    program.replace("a.st", TEXT + "ACTION Main.More:\n" + BODY + "END_ACTION\n")
    program.check_all()
    known, bodies = [], []
    for number in range(5):
        program.replace("a.st", program.files["a.st"].text.replace("Level := ", f"Level := ADD(1, {number}) + ", 1))
        check_changes(program)
        assert program.checked is not None
        known.append(sum(len(table) for table in vars(program.checked.project.facts).values()))
        gc.collect()
        bodies.append(sum(isinstance(each, tree.Pou) and len(each.body) > 50 for each in gc.get_objects()))
    assert bodies[-1] == bodies[0]
    assert known[-1] - known[0] < known[0] // 10, "what was added, and no former version"


class Ring:
    """What only a collection frees."""

    def __init__(self) -> None:
        self.itself = self
        self.held = [object() for _ in range(1000)]


@pytest.mark.slow
@pytest.mark.usefixtures("frozen_heap")
def test_garbage_is_collected_when_memory_has_grown_by_a_part(monkeypatch: pytest.MonkeyPatch) -> None:
    allocated = sys.getallocatedblocks
    others = allocated() - 300_000
    monkeypatch.setattr(sys, "getallocatedblocks", lambda: allocated() - others)  # however much earlier tests have left
    monkeypatch.setattr(garbage, "LEAST_BLOCKS", 20_000)
    known = garbage.Garbage()
    try:
        known.collect()
        before = most = sys.getallocatedblocks()
        for way, times in ((known.typed, garbage.AT_MOST), (known.checked, garbage.IN_A_PAUSE)):
            for _ in range(3 * before // 1000):
                gc.collect(1)  # what is made becomes old
                Ring()
                way()
                most = max(most, sys.getallocatedblocks())
            assert most < before * times + 20_000
            most = before
    finally:
        known.end()
        gc.collect()


def test_growth_counts_from_the_last_collection(monkeypatch: pytest.MonkeyPatch) -> None:
    known = garbage.Garbage()
    collected: list[int] = []

    def collections(way: Callable[[], None], *blocks: int) -> list[int]:
        """At which of these numbers of blocks all is collected."""
        collected.clear()
        for now in blocks:
            monkeypatch.setattr(sys, "getallocatedblocks", lambda now=now: now)
            monkeypatch.setattr(gc, "collect", lambda now=now: collected.append(now))
            way()
        return list(collected)

    try:
        collections(known.collect, 1_000_000)
        assert collections(known.typed, 1_900_000, 2_100_000, 2_700_000, 4_100_000, 4_300_000) == [2_100_000, 4_300_000]
        assert collections(known.checked, 5_300_000, 5_400_000, 5_500_000) == [5_400_000]
    finally:
        known.end()


def test_python_collects_by_itself_again_at_the_end() -> None:
    before = gc.get_threshold()
    kept = garbage.Garbage()
    assert gc.get_threshold() == (*before[:2], garbage.NEVER)
    kept.end()
    assert gc.get_threshold() == before
