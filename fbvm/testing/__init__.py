"""Tests of function blocks with pytest: the fixtures `fb`, `plc` and `network`, and tests written in ST.

The plugin is found by pytest when the package is installed.  `Rig` is what the fixtures give; `ns` turns `"50ms"` into
nanoseconds, as which TIME values are read; `proved` asserts what holds for all inputs in all scans; `double_writes` tells
which statements write the same output in a scan.  A name is imported when it
is first used: pytest loads this package in every session, also where no PLC code is tested.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fbvm.record.trace.writes import double_writes as double_writes
    from fbvm.testing.proofs import NotProved as NotProved
    from fbvm.testing.proofs import proved as proved
    from fbvm.testing.rig import Rig as Rig
    from fbvm.testing.rig import Trapped as Trapped
    from fbvm.testing.value_types import ns as ns
    from fbvm.testing.values import Values as Values

_HOME_OF = {"NotProved": "testing.proofs", "Rig": "testing.rig", "Trapped": "testing.rig", "Values": "testing.values",
            "ns": "testing.value_types", "proved": "testing.proofs", "double_writes": "record.trace.writes"}  # fmt: skip
"""The public names, each with the module that defines it."""
__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'fbvm.testing' has no attribute {name!r}")
    return getattr(importlib.import_module(f"fbvm.{_HOME_OF[name]}"), name)
