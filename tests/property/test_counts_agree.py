"""What a program counts while it runs is what a listener counts who is told every statement: on each engine, traps included."""

from __future__ import annotations

from collections import Counter

import pytest
from depth import times
from rows import each_of
from st_programs import budget, made
from st_text import text_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.counting import counting
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.branches import branches
from fbvm.record.trace.events import Event, Frame, Return, Statement
from fbvm.record.trace.observing import observing

SCANS = 4
ENGINES = ["python", "auto", *["native"] * native.available()]


class Told:
    """Counts statements, and by IF or CASE how often none of its statements followed."""

    def __init__(self, image: Image) -> None:
        self.executed: Counter[int] = Counter()
        self.skipped: Counter[int] = Counter()
        self._branches = {branch.site: branch for branch in branches(image)}
        self._open: dict[Frame, int] = {}

    def phase(self, plc: Plc, phase: Phase) -> None:
        self._open.clear()

    def event(self, plc: Plc, event: Event) -> None:
        if isinstance(event, Statement):
            self._decide(event.frame, event.site)
            self.executed[event.site] += 1
            if event.site in self._branches:
                self._open[event.frame] = event.site
        elif isinstance(event, Return):
            self._decide(event.frame, -1)

    def _decide(self, frame: Frame, site: int) -> None:
        chose = self._open.pop(frame, None)
        if chose is not None and site not in self._branches[chose].targets:
            self.skipped[chose] += 1


def difference(image: Image, engine: str, budget: int, ways: bool = True) -> str:
    """Where the counts of statements, and with `ways` of IF and CASE, differ, in words; "" if they are the same."""
    seen, plc = Told(image), Plc(image, budget=budget, engine="python")
    with observing(plc, seen):
        for _ in range(SCANS):
            if plc.trap is None:
                plc.scan()
    trap, plc = plc.trap, Plc(image, budget=budget, engine=engine)
    with counting(plc) as counts:
        plc.run(scans=SCANS)
    assert repr(plc.trap) == repr(trap)
    executed, skipped = counts.executed(), counts.skipped()
    wrong = [f"executed {image.sites[site]}: {count} times, not {seen.executed[site]}" for site, count in executed.items()
             if count != seen.executed[site]]  # fmt: skip
    for branch in branches(image) if ways else ():
        if branch.may_skip and skipped[branch.site] != seen.skipped[branch.site]:
            wrong.append(f"skipped {image.sites[branch.site]}: {skipped[branch.site]} times, not {seen.skipped[branch.site]}")
    return "; ".join(wrong)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(times(8, 50)))
def test_programs_made_at_random(seed: int) -> None:
    """What jumps are made of are IFs, too, which stand at statements that are none."""
    text = text_of(made(seed))[0]
    image = compile_text(text).image
    for engine in ENGINES if image else ():
        assert difference(image, engine, budget(image), "JMP" not in text) == "", engine  # type: ignore[arg-type]


def text(statements: str) -> str:
    return f"""FUNCTION Third : INT VAR_INPUT n : INT; END_VAR
Third := 3;
IF n > 2 THEN Third := n / (n - 4); ELSE Third := 1; END_IF;
Third := Third + 1;
END_FUNCTION
PROGRAM Main VAR n, i : INT; a : ARRAY [0..3] OF INT; END_VAR
n := n + 1;
{statements}
n := n + 0;
END_PROGRAM"""


@pytest.mark.slow
@each_of("statements", [
    "IF n = 2 THEN RETURN; END_IF;", "IF n = 1 THEN i := 1; ELSIF n = 3 THEN i := 2; END_IF;",
    "IF n = 2 THEN ; ELSE i := 2; END_IF;",
    "IF n = 2 OR_ELSE Third(1) > Third(n) THEN i := 1; ELSIF n = 1 AND_THEN Third(2) = 2 THEN i := 2; END_IF;",
    "CASE n OF 1: i := 1; 2, 3: ; END_CASE;", "CASE n OF 1: i := 1; 2: i := 2; ELSE i := 3; END_CASE;",
    "FOR i := 0 TO n DO IF i = 2 THEN EXIT; END_IF; a[1] := i; END_FOR;",
    "WHILE i < n DO i := i + 1; IF i = 1 THEN CONTINUE; END_IF; a[0] := 1; END_WHILE;",
    "a[n] := 1; i := 2;", "IF n > 1 THEN IF a[n + 1] = 0 THEN i := 1; END_IF; i := 2; END_IF;", "i := Third(n);",
    "IF Third(n) = 1 THEN i := 3; END_IF;",
    "IF n = 3 THEN WHILE TRUE DO i := 0; END_WHILE; END_IF;", "REPEAT i := i + 1; UNTIL a[i] > n END_REPEAT;",
    "CASE a[n + 1] OF 0: i := Third(n + 1); END_CASE; i := 4;",
])  # fmt: skip
def test_small_programs(statements: str) -> None:
    image = compile_text(text(statements), lint=False).image
    assert image is not None
    for engine in ENGINES:
        assert difference(image, engine, 1000) == "", engine


@pytest.mark.slow
def test_a_trap_inside_hundreds_of_calls_of_one_method() -> None:
    image = compile_text("""FUNCTION_BLOCK Node
METHOD Sum : INT VAR_INPUT n : INT; END_VAR
IF n > 0 THEN Sum := Sum(n - 1); END_IF;
Sum := Sum + 100 / n;
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main VAR node : Node; END_VAR
node.Sum(300);
END_PROGRAM""", lint=False).image
    assert image is not None
    assert [difference(image, engine, 10_000) for engine in ENGINES] == [""] * len(ENGINES)
