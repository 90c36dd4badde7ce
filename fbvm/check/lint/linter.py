"""Warnings: what is allowed, does something, and is hardly what was meant.

A pass of its own over the bodies of a project without errors, linear in their size.  It looks at what the user wrote,
never at libraries.  Which of the warnings are wanted is asked elsewhere (`silence`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from fbvm.check.lint import declared
from fbvm.check.lint import sfc as lint_sfc
from fbvm.check.lint import values as lint_values
from fbvm.check.lint.body import Body
from fbvm.check.lint.flow import flow
from fbvm.check.lint.writes import Writes
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax.tree import sfc

if TYPE_CHECKING:
    from fbvm.check.checker import Checker

_RULES: dict[type, Callable[[Body, Any], None]] = {**lint_values.RULES, sfc.Sfc: lint_sfc.look_at}
"""What looks at a node, by its kind."""


def lint(checker: Checker, program: str | None) -> None:
    """Report what the bodies and declarations of a checked project are to be warned of; `program` is the one to run."""
    facts, report = checker.project.facts, checker.report
    own = [pou for pou in checker.bodies if not pou.source.library and " " not in pou.name]
    uses, writes = declared.Uses(facts), Writes()
    for pou in own:
        body = Body(pou, facts, report)
        for node in body.nodes:
            if rule := _RULES.get(type(node)):
                rule(body, node)
        flow(body)
        writes.body(body)
        declared.result(body)
        declared.overlaps(report, pou.order)
    for pou in own:
        declared.unused(report, pou, uses)
        declared.pins(report, pou, uses)
    writes.finish()
    for source, expr, code, message in facts.losses:
        if not source.library:
            report.add(code, source, expr, message)
    _globals(checker, uses)
    if program is None and checker.project.configurations:
        _tasks(checker, own)


def _globals(checker: Checker, uses: declared.Uses) -> None:
    """Look at global variables; those of one source stand side by side."""
    by_source: dict[str, list[Variable]] = {}
    for variable in checker.global_order:
        if not variable.source.library and variable.kind == "VAR_GLOBAL":
            by_source.setdefault(variable.source.name, []).append(variable)
            declared.never_called(checker.report, variable, uses)
    for variables in by_source.values():
        declared.overlaps(checker.report, variables)


def _tasks(checker: Checker, own: list[Pou]) -> None:
    """Warn of programs that a CONFIGURATION forgets."""
    run = {run.instance.type for task in checker.tasks for run in task.runs if run.block is None}
    called = {callee for pou in own for callee in pou.calls}
    for pou in own:
        if pou.kind == "PROGRAM" and pou.type not in run and pou not in called:
            checker.report.add("S0890", pou.source, pou.tree.name, f"no task runs the PROGRAM {pou.name}",
                               f"write in the CONFIGURATION: PROGRAM {pou.name}1 WITH task : {pou.name};")
