"""What a program does when another one takes its place: FB_exit of all its instances."""

from __future__ import annotations

from fbvm.base.areas import BUDGET
from fbvm.base.hidden import ENDING
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import Trap
from fbvm.machine.plc import STEP_BUDGET, Plc


def end_instances(plc: Plc) -> Trap | None:
    """Call FB_exit of all instances of a PLC that is given up; what it writes stands in the PLC's memory afterwards.

    Returns the trap that ended a call, if any: the instances behind it are not told then."""
    body = next((number for number, body in enumerate(plc.image.bodies) if body.name == ENDING), None)
    if body is None or plc.trap is not None:
        return None
    plc.memory.views["i64"][BUDGET // 8] = STEP_BUDGET
    return PythonEngine(plc.image, plc.memory).call(body)
