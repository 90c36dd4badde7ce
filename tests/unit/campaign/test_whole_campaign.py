"""A whole campaign beside what comes of it, and all mutants of a program with each language in it, word for word.
`FBVM_REWRITE=1 pytest` of this file writes the texts anew; read the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.campaign.groups import in_common
from fbvm.campaign.mutation.session import mutants_of
from fbvm.campaign.plan_file import Written, read_plan_file
from fbvm.campaign.planning import images_of, plan_of, program_project
from fbvm.campaign.runs import Outcome, conduct
from fbvm.campaign.store import columns, rows
from fbvm.campaign.work import Bench

TEXTS = Path(__file__).parent / "texts"
PROGRAM = """PROGRAM Main
VAR n : INT; Step : INT := 1; Limit : INT := 9; a : ARRAY[0..30] OF INT; Busy, Done, Late : BOOL; x : REAL := 1.5; END_VAR
VAR RETAIN Kept : INT; END_VAR
    n := n + Step;
    Kept := Kept + 1;
    a[n] := Kept;
    Busy := n > 4;
    Late := n > Limit;
    IF Late THEN Done := n > 12; END_IF
END_PROGRAM
"""
CAMPAIGN = """[campaign]
sources = ["main.st"]
for = "120ms"
runs = 40
seed = 3
until = "Main.Done"
never = ["Main.Late AND Main.Kept > 11"]
always = ["Main.n < 20"]
show = ["Main.n", "Main.Kept", "Main.x"]

[[vary]]
name = "Main.Step"
values = [1, 2, 5]

[[vary]]
name = "Main.Limit"
from = 4
to = 10
step = 3

[[vary]]
setting = "cycle"
values = ["10ms", "20ms"]

[[vary]]
setting = "phase"
values = ["0ms", "3ms"]

[[power]]
chance = 40
between = ["15ms", "60ms"]
lasts = ["5ms", "20ms"]

[[within]]
trigger = "Main.Busy"
answer = "Main.Late"
within = "40ms"
"""
WRONG = (
    "runs = 0", "runs = -1", "runs = 20000000", 'for = "soon"', 'for = 3', 'timing = "late"', 'seed = "a"', "never = 3",
    'dialect = "basic"',
    'cycle = "0ms"', "color = 1", '[[vary]]\nname = "a"', '[[vary]]\nname = "a"\nsetting = "cycle"\nvalues = [1]',
    "[[vary]]\nvalues = [1]",
    '[[vary]]\nname = "a"\nfrom = 3', '[[vary]]\nname = "a"\nfrom = 3\nto = 1',
    '[[vary]]\nname = "a"\nfrom = 1\nto = 3\nstep = 0',
    '[[vary]]\nname = "a"\nfrom = 1\nto = 10000000', '[[vary]]\nsetting = "cycle"\nvalues = [3]',
    '[[vary]]\nsetting = "timing"\nvalues = ["x"]',
    '[[vary]]\nname = "a"\nfrom = "T#1s"\nto = "T#3s"\nstep = "soon"', '[[fault]]\nkind = "odd"', "[[fault]]\nchance = 0",
    "[[fault]]\nchance = 101",
    '[[fault]]\nkind = "slow"\nfrom = "1s"', '[[fault]]\nkind = "slow"\nbetween = ["2s", "1s"]',
    "[[fault]]\ncount = 1001", '[[power]]\nstart = "hot"',
    '[[within]]\ntrigger = "a"', '[[golden]]\nfile = "a"', '[golden]\nfile = "a"', "[[campaign]]",
    'tests = ["a"]\nproject = "b"',
    '[[vary]]\nname = "a"\nvalues = []', '[[vary]]\nname = "a"\nfrom = true\nto = 3',
    '[[vary]]\nname = "a"\nfrom = 0.1\nto = nan',
)  # fmt: skip


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_whole_campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("main.st").write_text(PROGRAM, encoding="utf-8")
    Path("campaign.toml").write_text(CAMPAIGN, encoding="utf-8")
    written = read_plan_file(Path("campaign.toml"))
    assert isinstance(written, Written), written
    project = program_project([Path("main.st")], written.about, Path())
    images = images_of(project)[0]
    plan = plan_of(written, project, images)
    outcome = Outcome(plan)
    conduct(Bench.of(plan, images), outcome, 1, outcome.add)
    lines = [" | ".join(columns(plan)), *(" | ".join(map(str, row)) for row in rows(outcome))]
    for group in outcome.groups:
        found, shrunk = group.failure, group.shrunk
        lines += ["", f"{len(group.numbers)} runs, first {group.first}: {found}", f"    {found.plc} {found.pou} {found.detail}",
                  *(f"    all have {trait}" for trait in in_common(plan, group, outcome.results))]  # fmt: skip
        if shrunk is not None:
            variant, least = shrunk.variant, shrunk.result.failure
            assert least is not None
            lines.append(f"    smallest: {variant.values} {variant.timing} {'; '.join(map(str, variant.cuts))} {least} "
                         f"in scan {least.scan}, {shrunk.tries} tries")
    lines.append(f"{outcome.failing} failing, left {outcome.left}")
    check("campaign.txt", lines)


@pytest.mark.slow
def test_what_is_said_of_campaign_files_that_are_wrong(tmp_path: Path) -> None:
    lines, file = [], tmp_path / "campaign.toml"
    for text in WRONG:
        file.write_text(f'[campaign]\nfor = "1s"\n{text}\n'.replace('for = "1s"\nfor', "for"), encoding="utf-8")
        found = read_plan_file(file)
        lines.append(f"=== {text!r}")
        lines += [told(each) for each in found] if isinstance(found, list) else ["nothing"]
    check("wrong.txt", lines)


def told(found: Diagnostic) -> str:
    line, column = found.source.place(found.start)
    marked = " ".join(found.source.text[found.start : found.end].split())
    return f"{line}:{column} {found.code} {found.message}; {found.hint} [{marked}]"


PLANT = """FUNCTION_BLOCK B
VAR_INPUT a, b : BOOL; n, m : INT := 3; END_VAR
VAR_OUTPUT q : BOOL; w : WORD; END_VAR
VAR t : TON; u : CTU; r : REAL := 2.5; d : TIME := T#1s; e : (Off, On); END_VAR
    IF a AND NOT b OR n >= 10 THEN q := TRUE; ELSIF m <> n THEN w := w + 16#10; END_IF
    CASE n OF 1, 2..4: m := -m; ELSE m := n * 2 - 1; END_CASE
    FOR n := 0 TO 9 DO IF a XOR b THEN EXIT; END_IF m := m MOD 3; END_FOR
    t(IN := a, PT := d); u(CU := b, PV := 5); r := SQRT(r) / 2.0; e := On; d := d + T#20ms;
    REPEAT m := m + 1; UNTIL m > 5 END_REPEAT
    q S= a; w := SHL(w, 2) AND 16#00FF; RETURN;
LADDER
RUNG 1
    LD a
    OR b
    ANDNOT q
    OUT q
RUNG 2
    @LD a
    AND> n &5
    ORLD
    SET q
    RSET q
    TON t IN:=a PT:=T#1s
RUNG 3
    LD P_On
    MOV #10 w
    +(400) w D10 D20
    @INC D10
    CNT 5 #20
RUNG 4
    │   a      b       q   │
    ├──┤ ├────┤/├─────(S)──┤
    │  n &7            q   │
    ├──┤>=├───────────( )──┤
RUNG 5
    │   a    ┌─ t : TON ─┐     q   │
    ├──┤↑├───┤IN        Q├────(/)──┤
    │   T#2s─┤PT         │         │
    │        └───────────┘         │
    │   b    ┌──────────┐          │
    ├──┤ ├───┤ @MOV     │          │
    │        │ #1       │          │
    │        │ D10      │          │
    │        └──────────┘          │
END_LADDER
END_FUNCTION_BLOCK
PROGRAM Chart
VAR go, on : BOOL; n : INT; END_VAR
INITIAL_STEP S: on(N); on(L, T#2s); END_STEP
STEP W: on(R); Count(P1); END_STEP
TRANSITION FROM S TO W := go AND n < 3; END_TRANSITION
TRANSITION FROM W TO S : LD go END_TRANSITION
ACTION Count: n := n + 1; END_ACTION
END_PROGRAM
FUNCTION F : INT
VAR_INPUT a : INT; b : BOOL; END_VAR
    LD a
    ADD ( 2
    MUL 3
    )
    GT 5
    ANDN b
    JMPC over
    LD 7
    ST F
over:
    LDN b
    RETC
    S b
END_FUNCTION
"""


@pytest.mark.slow
def test_all_mutants_of_a_program() -> None:
    lines = []
    for mutant in mutants_of([Source("plant.st", PLANT)]):
        change = mutant.change
        then, now = (text.splitlines() for text in (PLANT, mutant.applied(PLANT)))
        first = next((at for at, (one, other) in enumerate(zip(then, now, strict=False)) if one != other), len(now))
        shown = f"{then[first].strip()} -> {now[first].strip() if first < len(now) else ''}"
        lines.append(f"{mutant.number} {change.pou} {mutant.line} {change.operator}: {shown}"
                     + (f" ({len(now) - len(then)} lines)" if len(now) != len(then) else ""))  # fmt: skip
    check("mutants.txt", lines)
