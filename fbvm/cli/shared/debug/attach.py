"""What a debugger opens, from the arguments of `attach`: PLCs that run, from now on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fbvm.dap.target import LaunchError, Target, checked
from fbvm.run.real_pace import RealPace
from fbvm.step.session import Session
from fbvm.step.world import Debugged, World
from fbvm.watch.places import parse_for

ATTACH: dict[str, tuple[type, ...]] = {"stopOnEntry": (bool,), "force": (dict,), "keepForces": (bool,), "cwd": (str,),
                                       "connect": (str, int), "plc": (str,)}  # fmt: skip
"""The keys of an attach configuration; `connect` is for the extension that starts `fbvm dap --connect`."""
NOTE = "going back shows what was recorded, read-only: real connections do not travel in time"


def open_attached(debugged: Sequence[Debugged], paths: Mapping[str, Path], texts: Mapping[str, str],
                  arguments: Mapping[str, Any]) -> Target:  # fmt: skip
    """PLCs that run.  `paths` are their sources by name, `texts` all texts.  Raises LaunchError."""
    given = checked(arguments, ATTACH, "attach")
    plcs = {one.name: one.plc for one in debugged}
    chosen = given.get("plc", next(iter(plcs)))
    if chosen not in plcs:
        raise LaunchError(f"there is no PLC {chosen}; there is {', '.join(plcs)}")
    pace = RealPace(list(plcs.values()))
    plc = plcs[chosen]
    try:
        world = World(lambda: debugged, is_fixed=True, pace=pace if pace.is_real else None)
        forced = {name: set(one.forces) for name, one in plcs.items()}
        for name, value in given.get("force", {}).items():
            place = plc.find(name)
            plc.force(name, parse_for(place, literal(value)))
    except (LookupError, TypeError, ValueError) as error:
        raise LaunchError(str(error)) from None

    def close() -> None:
        world.leave()
        for name, one in plcs.items() if not given.get("keepForces") else ():
            for held in set(one.forces) - forced[name]:
                one.unforce(held)

    names = [chosen, *(name for name in plcs if name != chosen)]
    return Target({name: Session(world, name) for name in names}, texts, paths, stop_on_entry=given.get("stopOnEntry"),
                  notes=[NOTE], close=close)  # fmt: skip


def literal(value: object) -> str:
    """A JSON value as a literal of a program."""
    return str(value).upper() if isinstance(value, bool) else str(value)
