"""Tests of function blocks with pytest: the fixtures `fb`, `plc` and `network`, and tests written in ST.

The plugin is found by pytest when the package is installed.  `Rig` is what the fixtures give; `ns` turns `"50ms"` into
nanoseconds, as which TIME values are read; `proved` asserts what holds for all inputs in all scans.
"""

from __future__ import annotations

from fbvm.testing.proofs import NotProved, proved
from fbvm.testing.rig import Rig, Trapped
from fbvm.testing.value_types import ns
from fbvm.testing.values import Values

__all__ = ["NotProved", "Rig", "Trapped", "Values", "ns", "proved"]
