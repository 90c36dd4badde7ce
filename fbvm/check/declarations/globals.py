"""Global variables: each is declared when its turn comes, or earlier if the declaration of another one asks for it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.check.symbols.dependencies import Asked
from fbvm.check.symbols.facts import Variable, is_open, list_name
from fbvm.syntax import tree

if TYPE_CHECKING:
    from fbvm.check.checker import Checker

Key = tuple[str, str]
"""Library ("" for the user's own) and folded name."""


@dataclass(eq=False)
class Turn:
    """One declaration of global variables, and whether it has had its turn."""

    declared: tree.VarDecl
    section: tree.VarSection
    source: Source
    taken: bool = False


class Globals:
    """Declares the VAR_GLOBAL sections of a project."""

    def __init__(self, checker: Checker) -> None:
        self.checker = checker
        self.project = checker.project
        self.order: list[Variable] = []
        """Global variables and program instances in the order of their slots."""
        self._turns: list[Turn] = []
        self._waiting: dict[Key, Turn] = {}
        self._busy: set[Key] = set()
        self._damaged: set[Key] = set()
        self.project.late_global = self._on_demand

    def enroll(self) -> None:
        """Know the names of everything that was read since the last time; who asks for one has it declared."""
        new = self.project.sections
        if not new:
            return
        self.project.sections = []
        turns = [Turn(declared, section, source) for section, source in new for declared in section.variables]
        for section, source in new:
            self.checker.interfaces.qualified(section, source, "program")
        for turn in turns:
            for key in self._keys(turn):
                self._waiting.setdefault(key, turn)
                self.project.waiting.add(key[1])
        self._turns += turns

    def declare(self) -> None:
        """Declare everything that was read."""
        self.enroll()
        while self._turns:
            turns, self._turns = self._turns, []
            for turn in turns:
                self._declare(turn)
            self.enroll()

    def _keys(self, turn: Turn) -> list[Key]:
        """Under which names the variables of a declaration are found; with that of their list if they must have it."""
        space = f"{list_name(turn.source)}." if turn.section in self.project.qualified_only else ""
        return [(turn.source.library, f"{space}{fold(name.text)}") for name in turn.declared.names]

    def is_told(self, name: tree.NameRef, source: Source) -> bool:
        """True if it has been said why there is no such variable; says it if the name asks for itself."""
        keys = [(owner, fold(name.text)) for owner in self.project.owners(source)]
        if any(key in self._busy for key in keys):
            self.project.report.add("S0207", source, name, f"the initial value of {name.text} needs {name.text} itself")
            return True
        return any(key in self._damaged for key in keys)

    def is_lost(self, space: str, name: str, source: Source) -> bool:
        """True if it has been said why a list has no variable of that name."""
        keys = {(owner, fold(text)) for owner in self.project.owners(source) for text in (name, f"{space}.{name}")}
        return not keys.isdisjoint(self._damaged)

    def _on_demand(self, key: Key) -> None:
        """Declare a variable whose turn has not come, if there is one."""
        self.enroll()
        turn = self._waiting.get(key)
        if turn is not None:
            self._declare(turn)

    def _declare(self, turn: Turn) -> None:
        if turn.taken:
            return
        turn.taken = True
        keys = self._keys(turn)
        self._busy.update(keys)
        with self.project.asking(Asked()):
            resolved = self.checker.interfaces.typed(turn.declared, turn.source, None)
        self._busy.difference_update(keys)
        if resolved is None:
            self._damaged.update(keys)
            return
        for name, key in zip(turn.declared.names, keys, strict=True):
            variable = self.checker.interfaces.variable(turn.declared, name, turn.section, turn.source, resolved)
            location = turn.declared.location
            variable.qualified = turn.section in self.project.qualified_only
            variable.space = Path(turn.source.name).stem if list_name(turn.source) in self.project.lists else ""
            variable.place = "area" if location is not None and not is_open(location, variable.type) else "abs"
            if not self.project.room.has(variable.type.size, f"{name.text} takes", turn.source, name):
                self._damaged.add(key)
                continue
            other = self.project.globals.setdefault(key, variable)
            if other is variable:
                self.order.append(variable)
            else:
                self.project.report.add("S0202", turn.source, name, f"the global {name.text} is declared twice", "",
                                        (other.source, other.node.start, "first declared here"))
