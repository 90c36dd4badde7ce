"""A small model of sequential function charts, written from the standard's rules (6.7.4.6, 6.7.5, 6.7.6) and not from ours.

It knows steps, transitions and actions, and nothing of statements, memory or engines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random

TIMED = ("L", "D", "SD", "DS", "SL")
QUALIFIERS = ("N", "R", "S", "P", "P0", "P1", *TIMED)
INPUTS = ("b0", "b1", "b2")
CODED, VARIABLES = ("c0", "c1"), ("v0", "v1")


@dataclass(frozen=True)
class Way:
    """A transition; `condition` is (kind, detail)."""

    sources: tuple[int, ...]
    targets: tuple[int, ...]
    priority: int | None
    condition: tuple[str, object]


@dataclass(frozen=True)
class Use:
    """An association of a step: action, qualifier, time in ms."""

    step: int
    action: str
    qualifier: str
    time_ms: int


@dataclass(frozen=True)
class Chart:
    steps: int
    ways: tuple[Way, ...]
    uses: tuple[Use, ...]


def random_chart(random: Random) -> Chart:
    """A chart of one network that begins at step 0, with all kinds of divergence and convergence, safe or not."""
    steps = random.randint(1, 6)
    ways = [_way(random, steps, at) for at in range(1, steps)] + [_way(random, steps, 0) for _ in range(random.randint(0, 4))]
    uses = tuple(Use(random.randrange(steps), random.choice(CODED + VARIABLES), random.choice(QUALIFIERS),
                     random.choice((0, 10, 20, 30, 45))) for _ in range(random.randint(0, 7)))
    return Chart(steps, tuple(ways), tuple(sorted(uses, key=lambda use: use.step)))


def _way(random: Random, steps: int, at: int) -> Way:
    """A transition that leads to step `at`, if that is not the first, from one in front of it."""
    sources = {random.randrange(at) if at else random.randrange(steps)}
    targets = {at or random.randrange(steps)}
    for side in (sources, targets):
        if random.random() < 0.3:
            side.add(random.randrange(steps))
    step = random.randrange(steps)
    condition = random.choice((
        ("input", random.choice(INPUTS)), ("not", random.choice(INPUTS)), ("time", (step, random.choice((10, 20, 30)))),
        ("active", step), ("true", None)))
    priority = random.choice((None, None, 1, 2, 3))
    return Way(tuple(sorted(sources)), tuple(sorted(targets)), priority, condition)


def text(chart: Chart) -> str:
    """The chart as a program."""
    lines = ["PROGRAM Main", f"VAR {', '.join(INPUTS + VARIABLES)} : BOOL; {', '.join(c + '_n' for c in CODED)} : INT;",
             f"{', '.join(c + '_f' for c in CODED)} : INT; END_VAR"]
    for step in range(chart.steps):
        lines.append(f"{'STEP' if step else 'INITIAL_STEP'} s{step}:")
        for use in chart.uses:
            if use.step == step:
                time = f", T#{use.time_ms}ms" if use.qualifier in TIMED else ""
                lines.append(f"    {use.action}({use.qualifier}{time});")
        lines.append("END_STEP")
    for way in chart.ways:
        priority = f"(PRIORITY := {way.priority}) " if way.priority else ""
        lines.append(f"TRANSITION {priority}FROM {_side(way.sources)} TO {_side(way.targets)} :=")
        lines.append(f"    {_condition(way)}; END_TRANSITION")
    for name in CODED:
        lines += [f"ACTION {name}: {name}_n := {name}_n + 1;",
                  f"IF NOT {name}.Q THEN {name}_f := {name}_f + 1; END_IF END_ACTION"]
    return "\n".join([*lines, "END_PROGRAM"])


def _side(steps: Sequence[int]) -> str:
    names = [f"s{step}" for step in steps]
    return names[0] if len(names) == 1 else f"({', '.join(names)})"


def _condition(way: Way) -> str:
    kind, detail = way.condition
    if kind == "time":
        assert isinstance(detail, tuple)
        return f"s{detail[0]}.T >= T#{detail[1]}ms"
    return {"input": f"{detail}", "not": f"NOT {detail}", "active": f"s{detail}.X", "true": "TRUE"}[kind]


@dataclass
class Control:
    """The state of one action."""

    q: bool = False
    a: bool = False
    stored: bool = False
    delayed_ms: int | None = None
    limited_ms: int | None = None


@dataclass
class Model:
    """Executes a chart scan by scan."""

    chart: Chart
    final_scan: bool = True
    begun: bool = False
    active: set[int] = field(default_factory=set)
    since_ms: dict[int, int] = field(default_factory=dict)
    passed_ms: dict[int, int] = field(default_factory=dict)
    controls: dict[str, Control] = field(default_factory=dict)
    runs: dict[str, int] = field(default_factory=dict)
    finals: dict[str, int] = field(default_factory=dict)

    def scan(self, now_ms: int, inputs: dict[str, bool]) -> None:
        left: set[int] = set()
        entered: set[int] = set()
        if not self.begun:
            self.begun, entered = True, {0}
        else:
            for step in self.active:
                self.passed_ms[step] = now_ms - self.since_ms[step]
            for way in sorted(self.chart.ways, key=lambda w: w.priority or 1000):
                if set(way.sources) <= self.active - left and self._holds(way, inputs):
                    left |= set(way.sources)
                    entered |= set(way.targets)
        self.active = self.active - left | entered
        for step in entered:
            self.since_ms[step], self.passed_ms[step] = now_ms, 0
        for action in {use.action for use in self.chart.uses}:
            self._control(action, now_ms, entered, left)
        for action in CODED:
            control = self.controls.get(action)
            if control and control.a:
                self.runs[action] = self.runs.get(action, 0) + 1
                self.finals[action] = self.finals.get(action, 0) + (not control.q)

    def _holds(self, way: Way, inputs: dict[str, bool]) -> bool:
        kind, detail = way.condition
        if kind in ("input", "not"):
            return inputs[str(detail)] is (kind == "input")
        if kind == "time":
            assert isinstance(detail, tuple)
            return self.passed_ms.get(detail[0], 0) >= detail[1]
        return kind == "true" or detail in self.active

    def _control(self, action: str, now_ms: int, entered: set[int], left: set[int]) -> None:
        control = self.controls.setdefault(action, Control())
        uses = [use for use in self.chart.uses if use.action == action]

        def on(qualifier: str) -> list[Use]:
            return [use for use in uses if use.qualifier == qualifier and use.step in self.active]

        level = bool(on("N") or [u for u in on("L") if self.passed_ms[u.step] < u.time_ms]
                     or [u for u in on("D") if self.passed_ms[u.step] >= u.time_ms])
        pulse = any(use.qualifier == "P" and use.step in entered for use in uses)
        once = any(use.qualifier == "P1" and use.step in entered or use.qualifier == "P0" and use.step in left for use in uses)
        if on("R"):
            control.stored, control.delayed_ms, control.limited_ms = False, None, None
        else:
            delayed, limited = on("SD"), on("SL")
            control.stored |= bool(on("S") or [u for u in on("DS") if self.passed_ms[u.step] >= u.time_ms])
            if delayed and control.delayed_ms is None:
                control.delayed_ms = now_ms + delayed[0].time_ms
            if limited and control.limited_ms is None:
                control.limited_ms = now_ms + limited[0].time_ms
        before = control.q
        control.q = not on("R") and (
            level or pulse or control.stored or control.delayed_ms is not None and now_ms >= control.delayed_ms
            or control.limited_ms is not None and now_ms < control.limited_ms)
        if action in VARIABLES:
            control.q = control.q or once and not on("R")
        control.a = control.q or once or before and self.final_scan
