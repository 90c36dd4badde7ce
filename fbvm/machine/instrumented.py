"""Has a PLC execute another image of its program for a while: one that also counts, or notes power."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fbvm.code.image import Image
from fbvm.engine.choice.tiers import Engine, choice_of, engine_for, image_of, python_of, substitutes_of
from fbvm.machine.plc import Plc


@contextmanager
def instrumented(plc: Plc, image: Image) -> Iterator[Engine]:
    """Executes `image`, which has the layout of the program of `plc`, in place of that inside the `with` block.

    Yields the engine that does.  Raises ValueError if somebody looks into every scan of `plc`, or another image is executed
    already."""
    program = plc.engine
    choice = choice_of(program)
    if image_of(program, plc.image) is not plc.image:
        raise ValueError("this PLC counts or notes power already; do one after the other")
    plc.engine = engine = engine_for(image, plc.memory, choice)
    for body, function in substitutes_of(program).items():
        python_of(engine).substitute(body, function)
    try:
        yield engine
    finally:
        plc.engine = program
