"""Random hierarchies of blocks do on every engine what the same hierarchies do as Python objects."""

from __future__ import annotations

from random import Random

import class_hierarchies
import pytest
from depth import times

from fbvm.code.compiler import compile_text
from fbvm.engine.native.engine import available
from fbvm.machine.plc import Plc

PARTS, HIERARCHIES = 5, 20
"""Tests, and what each of them makes; with `--deep` sixty times as many."""


def compared(seed: int, engines: tuple[str, ...]) -> None:
    """Make the hierarchy of that number, run it, and compare; what engines leave in memory is equal to the bit."""
    random = Random(seed)
    blocks = class_hierarchies.hierarchy(random)
    instances = [random.choice(blocks) for _ in range(random.randint(1, 5))]
    text, wanted = class_hierarchies.text(random, blocks, instances)
    made = compile_text(text, dialect="codesys", lint=False)
    assert made.image is not None, f"seed {seed}: {[d.render() for d in made.errors]}"
    memories = []
    for engine in engines:
        plc = Plc(made.image, engine="native") if engine == "native" else Plc(made.image, observed=engine == "observed")
        assert plc.scan() is None, f"seed {seed}, {engine}"
        assert [plc.read(f"Main.r[{place}]") for place in range(len(wanted))] == wanted, f"seed {seed}, {engine}\n{text}"
        memories.append([plc.read(f"Main.o{number}.{name}") for number, block in enumerate(instances)
                         for name in ("count", *(f"own{level.name}" for level in block.lineage()))])
    assert all(memory == memories[0] for memory in memories), f"seed {seed}"


def test_a_few_hierarchies() -> None:
    for seed in range(4):
        compared(seed, ("python",))


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_hierarchies_on_every_engine(part: int) -> None:
    engines = ("python", "observed", "native") if available() else ("python", "observed")
    count = times(HIERARCHIES, 60)
    for seed in range(part * count, (part + 1) * count):
        compared(seed, engines)
