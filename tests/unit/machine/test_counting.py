"""Counting what is executed: on every tier, beside stubs and listeners."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.choice import tiers
from fbvm.engine.choice.tiers import TieredEngine, python_of
from fbvm.engine.counted import counted
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.machine.counting import counting
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import Event, Statement
from fbvm.record.trace.observing import observing

TEXT = """FUNCTION_BLOCK Half
VAR_INPUT n : INT; END_VAR
VAR_OUTPUT q : INT; END_VAR
  q := n / 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR n : INT; h : Half; END_VAR
  n := n + 1;
  h(n := n);
  IF h.q > 1 THEN
    n := 0;
  END_IF;
END_PROGRAM"""


@pytest.fixture
def image() -> Image:
    made = compile_text(TEXT).image
    assert made is not None
    return made


def lines(image: Image, counts: dict[int, int]) -> dict[int, int]:
    return {image.sites[site].line: count for site, count in sorted(counts.items())}


def test_the_memory_is_that_of_a_run_that_nobody_counts(image: Image) -> None:
    plc, plain = Plc(image), Plc(image)
    with counting(plc) as counts:
        assert plc.run(scans=8) == plain.run(scans=8)
    assert bytes(plc.memory.u8) == bytes(plain.memory.u8)
    assert lines(image, counts.executed()) == {4: 8, 8: 8, 9: 8, 10: 8, 11: 2}
    assert lines(image, counts.skipped()) == {10: 6}


@pytest.mark.parametrize("engine", ["python", *["native"] * native.available()])
def test_files_that_nobody_asks_for_are_not_counted(engine: str) -> None:
    made = compile_text("PROGRAM Main VAR t : TON; n : INT; END_VAR t(IN := TRUE, PT := T#25ms); n := n + 1; END_PROGRAM").image
    assert made is not None
    plc, plain = Plc(made, engine=engine), Plc(made, engine=engine)
    with counting(plc, {"text.st"}) as counts:
        assert plc.run(scans=5) == plain.run(scans=5)
    assert bytes(plc.memory.u8) == bytes(plain.memory.u8)
    assert [(made.sites[site].file, count) for site, count in counts.executed().items()] == [("text.st", 5)] * 2


@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_tiers_count_together(image: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 20)
    kept = code_of(counted(image).image)
    kept.prepare(2)
    plc = Plc(image, engine="auto")
    with counting(plc) as counts:
        plc.run(scans=12)
        assert isinstance(plc.engine, TieredEngine) and plc.engine.native
    assert lines(image, counts.executed()) == {4: 12, 8: 12, 9: 12, 10: 12, 11: 3}


def test_a_function_in_place_of_a_block_can_come_later(image: Image) -> None:
    plc = Plc(image)
    with counting(plc) as counts:
        python_of(plc.engine).substitute(next(n for n, body in enumerate(image.bodies) if body.name == "Half"), lambda base: None)
        plc.run(scans=2)
    assert lines(image, counts.executed()) == {4: 0, 8: 2, 9: 2, 10: 2, 11: 0}


@pytest.mark.parametrize("stands_still", [False, True])
@pytest.mark.parametrize("engine", ["auto", "python", *["native"] * native.available()])
def test_who_looks_inside_takes_nothing_away(image: Image, engine: str, stands_still: bool) -> None:
    class Seen:
        statements = 0

        def phase(self, plc: Plc, phase: Phase) -> None:
            """Nothing."""

        def event(self, plc: Plc, event: Event) -> None:
            self.statements += isinstance(event, Statement)

    plc, seen, second = Plc(image, engine=engine), Seen(), Seen()
    with counting(plc) as counts:
        plc.run(scans=3)
        with observing(plc, seen, stands_still), observing(plc, second):
            plc.run(scans=4)
        plc.run(scans=1)
    assert seen.statements == second.statements == 17
    assert lines(image, counts.executed()) == {4: 8, 8: 8, 9: 8, 10: 8, 11: 2}


def test_a_scan_that_is_done_again_counts_once(image: Image) -> None:
    plc = Plc(image)
    with counting(plc) as counts:
        plc.run(scans=2)
        state, before = plc.snapshot(), counts.read()
        plc.run(scans=5)
        plc.restore(state)
        counts.back_to(before)
        plc.run(scans=1)
    assert lines(image, counts.executed()) == {4: 3, 8: 3, 9: 3, 10: 3, 11: 0}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", *["native"] * native.available()])
def test_statements_in_front_of_a_trap_count_each_time(engine: str) -> None:
    """Machine code counts a piece at its beginning and takes back what a trap has left out, once for each trap."""
    text = """PROGRAM Main
VAR n, d : INT; END_VAR
  n := n + 1;
  d := d + 1;
  IF n > 2 THEN
    d := 10 / (n - 4);
    d := d + 1;
  END_IF;
END_PROGRAM"""
    made = compile_text(text).image
    assert made is not None
    plc = Plc(made, engine=engine)
    with counting(plc) as counts:
        for times in (1, 2, 3):
            assert plc.run(scans=10) == "trap"
            assert lines(made, counts.executed()) == {3: 4 * times, 4: 4 * times, 5: 4 * times, 6: 2 * times, 7: times}
            assert lines(made, counts.skipped()) == {5: 2 * times}
            plc.warm_start()


def test_a_function_that_is_in_place_of_a_block_stays_there(image: Image) -> None:
    plc, calls = Plc(image, engine="python"), list[int]()
    python_of(plc.engine).substitute(next(n for n, body in enumerate(image.bodies) if body.name == "Half"), calls.append)
    with counting(plc) as counts:
        plc.run(scans=3)
    plc.scan()
    assert len(calls) == 4 and len(set(calls)) == 1
    assert lines(image, counts.executed())[8] == 3 and not lines(image, counts.executed()).get(4)


def test_machine_code_alone_has_no_place_for_python() -> None:
    with pytest.raises(ValueError, match=r"^Python in place of a block needs the Python engine$"):
        python_of(object())
