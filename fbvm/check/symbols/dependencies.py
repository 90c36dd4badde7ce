"""What the check of a body asks of the project, so that it can be asked again where the check is spared.

Besides facts about its own nodes, the check of a body has POUs, types and global variables made known, in an order that
decides where they lie.  A library never sees what users write, so this order is the same in every program."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.check.checker import Checker
    from fbvm.check.symbols.project import Project

Key = tuple[str, str]
"""Library and folded name of a POU."""


class Asked:
    """The questions of one body, each once, in their order, and whom it calls."""

    def __init__(self) -> None:
        self.questions: dict[tuple[str, str, str], None] = {}
        self.calls: list[tuple[Key, tree.Node]] = []
        self.again = True
        """False if the check did what no question says."""

    def note(self, what: str, name: str, owner: str = "") -> None:
        """Remember that something was asked for."""
        self.questions[what, name, owner] = None

    def end(self, pou: Pou, project: Project) -> None:
        """Remember the calls of a body that was checked."""
        for callee, node in pou.calls.items():
            key = key_of(callee)
            self.again = self.again and project.pous.get(key) is callee
            self.calls.append((key, node))

    def repeat(self, pou: Pou, checker: Checker) -> None:
        """Ask the same for the same body of another project."""
        project, source = checker.project, pou.source
        for what, name, owner in self.questions:
            if what == "interface":
                checker.interface(project.pous[owner, name], source, pou.tree)
            elif what == "declared":
                checker.specs.declared(name, source)
            elif what == "area":
                checker.use_area(name)
            else:
                _LOOK[what](project, name, source)
        for key, node in self.calls:
            pou.calls[project.pous[key]] = node


def key_of(pou: Pou) -> Key:
    """The name of a POU for all programs."""
    return pou.source.library, fold(pou.name)


def is_lasting(pou: Pou) -> bool:
    """True for the POU of a library as it is written: not an ACTION, nor what was made for one call or one program."""
    return bool(pou.source.library) and pou.kind in ("FUNCTION", "FUNCTION_BLOCK") and \
        pou.as_written and not pou.written_actions


_LOOK: dict[str, Callable[[Project, str, Source], object]] = {
    "POU": lambda project, name, source: project.pou(name, source),
    "type": lambda project, name, source: project.type_entry(name, source),
    "global": lambda project, name, source: project.global_variable(name, source),
}
