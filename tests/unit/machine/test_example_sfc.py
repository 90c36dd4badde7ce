"""The tank of the example: its chart and its twin in Structured Text do the same in every scan."""

from __future__ import annotations

from pathlib import Path

from fbvm.code.compiler import compile_files
from fbvm.machine.plc import Plc

EXAMPLE = Path(__file__).resolve().parent.parent.parent.parent / "examples" / "sfc.st"
SECOND_NS = 10**9


def test_both_do_the_same_in_every_scan() -> None:
    made = compile_files([EXAMPLE], runnable=True)
    assert made.image is not None and made.diagnostics == []
    plc = Plc(made.image, SECOND_NS)
    for scan in range(120):
        plc.write("Main.Start", scan % 50 < 30)
        plc.scan()
        assert plc.read("Main.Same"), scan
    assert plc.read("Main.Mixer.Batches") == plc.read("Main.Twin.Batches") == 5
