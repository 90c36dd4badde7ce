"""Charts made at random do what a model of the standard's rules does, scan by scan, on every engine."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from sfc_model import CODED, INPUTS, VARIABLES, Chart, Control, Model, random_chart, text

from fbvm.base.memory import compare
from fbvm.code.compiler import compile_text
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc

CYCLE_MS = 10
SCANS = 14


def inputs_of(random: Random) -> list[dict[str, bool]]:
    """Inputs that stay a while, for every scan."""
    rows, now = [], dict.fromkeys(INPUTS, False)
    for _ in range(SCANS):
        now = {name: random.random() < 0.5 if random.random() < 0.4 else value for name, value in now.items()}
        rows.append(now)
    return rows


def agree(chart: Chart, rows: list[dict[str, bool]], dialect: str, machine_code: bool = False) -> None:
    """Run a chart beside the model, and perhaps as machine code beside that."""
    compilation = compile_text(text(chart), dialect=dialect)
    assert compilation.image is not None, "\n".join(d.render() for d in compilation.diagnostics)
    plcs = [Plc(compilation.image, CYCLE_MS * 1_000_000, engine="python") for _ in range(1 + machine_code)]
    if machine_code:
        plcs[1].engine = native.NativeEngine(compilation.image, plcs[1].memory)
    model = Model(chart, final_scan=dialect != "matiec")
    for scan, row in enumerate(rows):
        for plc in plcs:
            for name, value in row.items():
                plc.write(f"Main.{name}", value)
            plc.scan()
            assert plc.trap is None
        model.scan((scan + 1) * CYCLE_MS, row)
        for plc in plcs[1:]:
            assert compare(plc.memory.snapshot(), plcs[0].memory.snapshot()) == []
        _check(plcs[0], model, scan)


def _check(plc: Plc, model: Model, scan: int) -> None:
    where = f"scan {scan + 1} of\n{text(model.chart)}"
    for step in range(model.chart.steps):
        assert plc.read(f"Main.s{step}.X") is (step in model.active), f"s{step}.X in {where}"
        assert plc.read(f"Main.s{step}.T") == model.passed_ms.get(step, 0) * 1_000_000, f"s{step}.T in {where}"
    for name in VARIABLES:
        assert plc.read(f"Main.{name}") is model.controls.get(name, Control()).q, f"{name} in {where}"
    for name in CODED:
        assert plc.read(f"Main.{name}_n") == model.runs.get(name, 0), f"runs of {name} in {where}"
        assert plc.read(f"Main.{name}_f") == model.finals.get(name, 0), f"final scans of {name} in {where}"


@pytest.mark.slow
@settings(deadline=None, max_examples=times(150))
@given(random=st.randoms(use_true_random=False), dialect=st.sampled_from(("standard", "matiec")))
def test_charts_do_what_the_model_does(random: Random, dialect: str) -> None:
    chart = random_chart(random)
    agree(chart, inputs_of(random), dialect)


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
@settings(deadline=None, max_examples=times(150))
@given(random=st.randoms(use_true_random=False))
def test_machine_code_keeps_the_same_memory(random: Random) -> None:
    chart = random_chart(random)
    agree(chart, inputs_of(random), "standard", machine_code=True)
