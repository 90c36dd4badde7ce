"""The linter: warnings about what is allowed and probably a mistake.

A pass of its own over the bodies of a project without errors, linear in their size.  It looks at what the user wrote,
never at libraries.  `suppression` removes those that a pragma or the caller switches off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from fbvm.check.lint import declared
from fbvm.check.lint import sfc as lint_sfc
from fbvm.check.lint import values as lint_values
from fbvm.check.lint.body import Body
from fbvm.check.lint.flow import flow
from fbvm.check.lint.writes import Writes
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax.tree import sfc

_RULES: dict[type, Callable[[Body, Any], None]] = {**lint_values.RULES, sfc.Sfc: lint_sfc.look_at}
"""By class of node the rule that looks at it."""


def lint(context: Context, program: str | None) -> None:
    """Report what the bodies and declarations of a checked project are to be warned of; `program` is the one to run."""
    for _ in lint_steps(context, program):
        pass


def lint_steps(context: Context, program: str | None) -> Iterator[None]:
    """As `lint`, but stops in front of each POU, so that a caller can do something else, or give up, between two of them."""
    facts, report = context.project.facts, context.report
    own = [pou for pou in context.bodies if not pou.source.library and " " not in pou.name]
    uses, writes = declared.Uses(facts), Writes()
    for pou in own:
        yield
        body = Body(pou, context)
        for node in body.nodes:
            if rule := _RULES.get(type(node)):
                rule(body, node)
        flow(body)
        writes.body(body)
        declared.result(body)
        declared.overlaps(report, [variable for variable in pou.order if variable.owner is pou])
    for pou in own:
        yield
        declared.unused(report, pou, uses)
        declared.pins(report, pou, uses)
    writes.finish()
    for source, expr, code, message in facts.losses:
        if not source.library:
            report.add(code, source, expr, message)
    _globals(context, uses)
    if program is None and context.project.configurations:
        _tasks(context, own)


def _globals(context: Context, uses: declared.Uses) -> None:
    """Check global variables; those of one source count as one list of declarations."""
    by_source: dict[str, list[Variable]] = {}
    for variable in context.global_order:
        if not variable.source.library and variable.kind == "VAR_GLOBAL":
            by_source.setdefault(variable.source.name, []).append(variable)
            declared.never_called(context.report, variable, uses)
    for variables in by_source.values():
        declared.overlaps(context.report, variables)


def _tasks(context: Context, own: list[Pou]) -> None:
    """Warn of programs that a CONFIGURATION forgets."""
    run = {run.instance.type for task in context.tasks for run in task.runs if run.block is None}
    called = {callee for pou in own for callee in pou.calls}
    named = set(context.project.pous.values())  # without what the system calls before the first cycle
    for pou in own:
        if pou.kind == "PROGRAM" and pou in named and pou.type not in run and pou not in called:
            context.report.add("S0890", pou.source, pou.tree.name, f"no task runs the PROGRAM {pou.name}",
                               f"write in the CONFIGURATION: PROGRAM {pou.name}1 WITH task : {pou.name};")
