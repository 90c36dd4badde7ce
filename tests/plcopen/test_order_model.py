"""Random diagrams with loops, in-outs, numbers and jumps do, in each order of evaluation, what a second reading of it does."""

from __future__ import annotations

from random import Random

import order_model
import pytest
from depth import times

from fbvm.code.compiler import compile_sources
from fbvm.engine.native.engine import available
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.machine.plc import Plc

ORDERS = ("document", "beremiz1", "position", "ids")
UNTYPED = "the wires make a loop, and nothing in it keeps a value"
"""What is said of a loop of functions whose type nothing in it tells, such as an AND that is wired to itself alone."""
SCANS = 8


def compared(nodes: list[order_model.Node], order: str, random: Random,
             engines: tuple[str, ...] = ("python",)) -> list[str] | None:
    """Run a diagram and the model of it; the states of the model by scan, None if the diagram has a loop without a type."""
    made = import_xml(order_model.drawn(nodes), order=order)
    if made.errors:
        assert all(UNTYPED in error.message for error in made.errors), [error.message for error in made.errors]
        return None
    compiled = compile_sources(made.sources, "Main", dialect="matiec", lint=False)
    assert compiled.image is not None, [d.render() for d in compiled.errors]
    given = [{name: random.random() < 0.5 for name in order_model.INPUTS} for _ in range(SCANS)]
    states = []
    for engine in engines:
        plc, model = Plc(compiled.image, engine=engine), order_model.Model(nodes, order)
        states = []
        for scan, inputs in enumerate(given):
            for name, value in inputs.items():
                plc.write(f"Main.{name}", value)
            assert plc.scan() is None
            wanted = model.scan(inputs)
            assert {name: plc.read(f"Main.{name}") for name in wanted} == wanted, f"{order}, {engine}, scan {scan}"
            states.append(str(wanted))
    return states


def ordered(seeds: range, engines: tuple[str, ...] = ("python",)) -> None:
    """Diagrams with these seeds, half of them with numbers, in the orders of Beremiz and OpenPLC Editor."""
    differing, untyped = 0, 0
    for seed in seeds:
        random = Random(seed)
        nodes = order_model.diagram(random, loops=True, numbers=seed % 2 == 0)
        found = [compared(nodes, order, Random(seed), engines) for order in ORDERS]
        untyped += None in found
        differing += len({str(states) for states in found}) > 1
    assert differing * 4 >= len(seeds), "the orders hardly ever differ"
    assert untyped * 5 <= len(seeds)


def jumping(seeds: range, engines: tuple[str, ...] = ("python",)) -> None:
    """Diagrams with these seeds, without loops and with jumps, in the order of networks."""
    for seed in seeds:
        nodes = order_model.diagram(Random(seed), loops=False, numbers=False, jumps=seed % 3)
        assert compared(nodes, "network", Random(seed), engines) is not None, f"seed {seed}"


@pytest.mark.slow
@pytest.mark.parametrize("part", range(2))
def test_diagrams(part: int) -> None:
    count = times(5, 100)
    ordered(range(100 + part * count, 100 + (part + 1) * count))
    jumping(range(100 + part * count, 100 + (part + 1) * count))


@pytest.mark.slow
@pytest.mark.skipif(not available(), reason="needs llvmlite")
def test_diagrams_on_both_engines() -> None:
    ordered(range(101, 102), ("python", "native"))
    jumping(range(101, 103), ("python", "native"))
