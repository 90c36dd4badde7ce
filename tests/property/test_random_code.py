"""Code made at random does the same on every engine: a slice of what `random_code.py` compares by the thousand."""

from __future__ import annotations

from random import Random

import pytest
from depth import times

from fbvm.code.operations import EXPRESSIONS, STATEMENTS
from fbvm.engine.native import engine as native

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from hand_image import operations_in
from random_code import Maker, differing

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", range(times(16, 50)))
def test_every_engine_agrees(seed: int) -> None:
    assert differing(Random(seed)) is None


def test_every_operation_is_made() -> None:
    made: set[str] = set()
    for seed in range(150):
        for block in Maker(Random(seed), 3).program():
            made |= operations_in(block)
    assert made >= {*EXPRESSIONS, *STATEMENTS} - {"stop", "observe", "mark"}  # test_power.py compares engines on `mark`
