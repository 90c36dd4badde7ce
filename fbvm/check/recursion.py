"""Recursion: calls that come back to the POU that makes them.

A call by name that comes back is an error (IEC 61131-3 ed. 3, 6.6.1).  Methods, and blocks that are called through a base, may
come back, since such a call can mean another object: every POU on such a cycle has frames on a stack, not a fixed one."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from fbvm.base.areas import FRAME_HEAD, LEAST_FRAMES, MOST_FRAMES, STACK_BYTES
from fbvm.base.graphs import cycles
from fbvm.check.symbols.containment import Containment
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree

FRAME_STEP = 16
"""Bytes to whose multiple a frame on the stack is rounded up."""


def check_recursion(context: Context) -> None:
    """Report POUs that call themselves by name, directly or through others (S0408); give those that may come back through
    methods the size of their frames on the stack (`Pou.stack_bytes`)."""
    if _report(context) or not _may_come_back(context):
        return
    stacked = {pou for group in cycles(context.bodies, _callees(context)) for pou in group}
    families = _families(context) if stacked else []
    count = 0
    while count != len(stacked):  # whoever is called in place of another one has its frame where that has it
        count = len(stacked)
        stacked |= {pou for family in families if family & stacked for pou in family}
    _measure(stacked, families)
    _report_self_references(context, stacked)


def _report(context: Context) -> bool:
    """Report cycles of calls by name.  Returns whether there is any."""
    found = False
    done: set[Pou] = set()
    path: list[Pou] = []

    def visit(pou: Pou) -> None:
        nonlocal found
        if pou in path:
            found = True
            ring = [p.name for p in path[path.index(pou):]] + [pou.name]
            context.report.add("S0408", path[-1].source, path[-1].calls[pou],
                               f"{' calls '.join(ring)}: calls must not come back", "use a loop")
            return
        if pou in done:
            return
        done.add(pou)
        path.append(pou)
        for callee in pou.calls:
            if _is_by_name(pou, callee):
                visit(callee)
        path.pop()

    for pou in list(context.bodies):
        visit(pou)
    return found


def _is_by_name(pou: Pou, callee: Pou) -> bool:
    """True if a call means the callee and, if that is an ACTION, on the same instance."""
    node = pou.dynamic_calls.get(callee)
    return callee.block is None and (
        node is None or callee.home is not None and isinstance(node, tree.Call) and isinstance(node.callee, tree.NameRef))


def _may_come_back(context: Context) -> bool:
    """True if any call may mean another object than its caller knows."""
    return any(pou.dynamic_calls or any(callee.block is not None for callee in pou.calls) for pou in context.bodies)


def _callees(context: Context) -> Callable[[Pou], tuple[Pou, ...]]:
    """A function from a POU to those whose bodies its calls may execute."""
    @cache
    def callees(pou: Pou) -> tuple[Pou, ...]:
        meant = [found for named in pou.dynamic_calls for found in context.candidates(named)]
        return tuple(dict.fromkeys(context.executed(each) for each in (*pou.calls, *meant)))

    return callees


def _families(context: Context) -> list[set[Pou]]:
    """Groups of POUs whose frames are laid out alike: methods that one call may mean, actions with their block."""
    named = dict.fromkeys(named for pou in context.bodies for named in pou.dynamic_calls if named.is_routine)
    return [{each, *context.candidates(each)} for each in named] + \
        [{pou, *pou.actions.values()} for pou in context.bodies if pou.actions]


def _measure(stacked: set[Pou], families: list[set[Pou]]) -> None:
    """Give all POUs of a family the size of the largest frame in it."""
    sizes = {pou: FRAME_HEAD - -pou.owner.frame_size // FRAME_STEP * FRAME_STEP for pou in stacked}
    least = stack_bytes(max(sizes.values(), default=0)) // MOST_FRAMES
    for pou, size in sizes.items():
        pou.stack_bytes = max(size, -(-least // FRAME_STEP) * FRAME_STEP)
    shared = [family for family in families if family & stacked]
    grows = True
    while grows:
        grows = False
        for family in shared:
            most = max(pou.stack_bytes for pou in family)
            grows = grows or any(pou.stack_bytes < most for pou in family)
            for pou in family:
                pou.stack_bytes = most


def stack_bytes(largest: int) -> int:
    """Bytes of a stack of frames of which the largest takes so many."""
    return max(STACK_BYTES, LEAST_FRAMES * largest)


def _report_self_references(context: Context, stacked: set[Pou]) -> None:
    """Report instances in frames on the stack whose initial values refer to themselves: they have no fixed place."""
    starts = {start.pou for start in context.facts.starts}
    refers = Containment(context, lambda pou: pou in starts)
    for pou in stacked:
        for variable in pou.order:
            if variable.place == "frame" and not variable.reference and refers(variable.type):
                context.report.add("S0408", variable.source, variable.node,
                                   f"{variable.name} refers to variables of its own, and {pou.name} may be called while it runs",
                                   f"declare {variable.name} outside of {pou.name}")
