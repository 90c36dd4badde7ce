"""Warnings about declarations: variables and instances that nobody uses, results never set, places that overlap."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.base.areas import FIXED_OR_SIZED_AREAS, FLAG_AREAS, Address
from fbvm.base.types import BOOL, ArrayType, Type, base, fold
from fbvm.check.expressions.values import is_any
from fbvm.check.lint.body import Body
from fbvm.check.symbols.facts import Facts, Pou, PouCall, Variable, is_block
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree
from fbvm.syntax.tree import sfc

OWN = ("VAR", "VAR_TEMP", "VAR_STAT")
"""Sections whose variables only the POU itself can use."""


class Uses:
    """Which variables and instances a project uses."""

    def __init__(self, facts: Facts) -> None:
        self.variables = set(facts.variables.values())
        self.called: set[Variable | None] = set()
        """Variables that are, or contain, an instance which is called or handed on or referred to."""
        for call in facts.calls.values():
            if isinstance(call, PouCall):
                roots = [value for _, value in call.in_outs] + ([call.instance] if call.instance else [])
                self.called.update(facts.variables.get(facts.root(root)) for root in roots)
        assigned = [call.instance for call in facts.sets.values() if call.instance]
        self.called.update(facts.variables.get(facts.root(place)) for place in (*assigned, *facts.holders, *facts.as_interfaces))


def unused(report: Report, pou: Pou, uses: Uses) -> None:
    """Warn of variables of a POU that it does not use; a name that begins with `_` is unused on purpose."""
    for variable in pou.order:
        if variable.owner is not pou or variable.kind not in OWN or variable.constant:
            continue
        if " " in variable.name or variable.name.startswith("_"):
            continue
        if _instance(variable.type):
            never_called(report, variable, uses)
        elif variable not in uses.variables and variable.location is None:
            report.add("S0290", variable.source, variable.node, f"{variable.name} is never used", "remove it")


def pins(report: Report, pou: Pou, uses: Uses) -> None:
    """Warn of inputs that a function or block never reads, and of outputs that it never sets.

    POUs without statements are skipped, and programs, whose pins are read from outside."""
    if pou.kind not in ("FUNCTION", "FUNCTION_BLOCK") or not _has_statements(pou):
        return
    hidden = {edge.raw: edge.hidden for edge in pou.edges}
    for variable in pou.order:
        if variable.owner is not pou or variable.location or variable.open:
            continue
        if variable.name.startswith("_") or variable.name.upper() in ("EN", "ENO"):
            continue
        if variable.kind in ("VAR_INPUT", "VAR_IN_OUT") and hidden.get(variable, variable) not in uses.variables:
            what = "input" if variable.kind == "VAR_INPUT" else "in-out"
            report.add("S0293", variable.source, variable.node, f"nothing in {pou.name} reads the {what} {variable.name}",
                       f"remove it, or call it _{variable.name} if callers need it")
        elif variable.kind == "VAR_OUTPUT" and not (variable.written or variable.explicit or is_block(variable.type)):
            report.add("S0294", variable.source, variable.node, f"nothing in {pou.name} sets the output {variable.name}",
                       f"assign it: {variable.name} := ...")


def _has_statements(pou: Pou) -> bool:
    """True for a body that is more than a stub, without names that failed."""
    statements = [pou.tree.body, *(action.tree.body for action in pou.actions.values())]
    return any(not isinstance(s, tree.Empty | sfc.Sfc) for body in statements for s in body) and \
        not any(isinstance(s, sfc.Sfc) for body in statements for s in body)


def never_called(report: Report, variable: Variable, uses: Uses) -> None:
    """Warn of an instance that is declared and never called: its outputs never change."""
    kind = _instance(variable.type)
    tasked = variable.owner is not None and variable in variable.owner.tasked
    if kind and variable not in uses.called and not variable.reference and not tasked:
        use = f"call it: {variable.name}{'[...]' if isinstance(variable.type, ArrayType) else ''}(...)"
        report.add("S0291", variable.source, variable.node, f"the instance {variable.name} of {kind} is never called",
                   use if variable in uses.variables else f"{use}, or remove it")


def _instance(kind: Type) -> str:
    """The name of the block of an instance or of an array of instances; "" for other types."""
    while isinstance(kind, ArrayType):
        kind = kind.element
    return kind.name if is_block(kind) else ""


UNREAD = ("FB_INIT", "FB_REINIT", "FB_EXIT")
"""Methods that the system calls, by folded name."""


def result(body: Body) -> None:
    """Warn of a function that never sets its result; nobody reads that of FB_init and its like, which have to declare one."""
    pou = body.pou
    if pou.kind == "METHOD" and fold(pou.tree.name.text) in UNREAD:
        return
    if pou.result is None or pou.result.written or not any(not isinstance(s, tree.Empty) for s in pou.tree.body):
        return
    if not any(isinstance(node, tree.Return) and node.value is not None and node not in body.facts.conditional
               for node in body.nodes):
        body.warn("S0292", pou.tree.name, f"{pou.name} never sets its result, which stays as it begins",
                  f"assign it: {pou.result.name} := ...")


# --- places in memory -------------------------------------------------------------------------------------------------


def overlaps(report: Report, variables: Iterable[Variable]) -> None:
    """Warn of located variables of one list of declarations that share memory, unless one is a part of the other.

    Parts are bits of words, and elements of arrays, structures and bit strings."""
    spans: dict[str, list[tuple[int, int, Variable]]] = {}
    for variable in variables:
        hidden = variable.name.startswith("$")  # what rungs have at an address: others may have it as another type
        if variable.location is not None and variable.location.area in FIXED_OR_SIZED_AREAS and not hidden:
            first = _first_bit(variable.location)
            size = 1 if base(variable.type) == BOOL else variable.type.size * 8
            spans.setdefault(variable.location.area, []).append((first, first + size, variable))
    for placed in spans.values():
        placed.sort(key=lambda span: span[:2])
        for (first, end, lower), (second, other_end, upper) in _neighbours(placed):
            if _clash((first, end, lower.type), (second, other_end, upper.type)):
                later, earlier = sorted((lower, upper), key=lambda v: -v.node.start)
                report.add("S0691", later.source, later.node,
                           f"{later.name} at {later.location} shares memory with {earlier.name} at {earlier.location}, "
                           f"which is {earlier.type}", "",
                           (earlier.source, earlier.node.start, "declared here"))


def _neighbours(placed: list[tuple[int, int, Variable]]) -> Iterable[tuple[tuple[int, int, Variable], ...]]:
    """Each span that begins within an earlier one, with the earlier one that reaches farthest."""
    farthest = placed[0]
    for span in placed[1:]:
        if span[0] < farthest[1]:
            yield farthest, span
        farthest = max(farthest, span, key=lambda each: each[1])


def _first_bit(address: Address) -> int:
    return address.number if address.area in FLAG_AREAS else address.byte_offset() * 8 + address.bit_in_byte()


def _clash(lower: tuple[int, int, Type], upper: tuple[int, int, Type]) -> bool:
    if lower[:2] == upper[:2]:
        return lower[2] == upper[2]
    if upper[1] <= lower[1]:
        outer, inner = lower[2], upper[2]
    elif lower[0] == upper[0]:
        outer, inner = upper[2], lower[2]
    else:
        return True
    return base(inner) != BOOL and is_any(outer, "ANY_NUM", "ANY_DURATION", "ANY_DATE")

