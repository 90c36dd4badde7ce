"""The parts of the check import one another in one direction only, for typing and within functions, too."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from graphlib import TopologicalSorter
from pathlib import Path

import fbvm.check

CHECK = Path(fbvm.check.__file__).parent
MODULES = {f"fbvm.check.{'.'.join(path.relative_to(CHECK).with_suffix('').parts)}": path for path in CHECK.rglob("*.py")}


def imported(path: Path) -> Iterator[str]:
    """All modules of the check that a module imports, wherever the import stands."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [f"{node.module}.{alias.name}" for alias in node.names] + [node.module or ""] \
            if isinstance(node, ast.ImportFrom) else []
        yield from (name for name in names if name in MODULES)


IMPORTS = {name: set(imported(path)) for name, path in MODULES.items()}


def sort(graph: Mapping[str, set[str]]) -> list[str]:
    """The nodes in an order in which each stands behind all that it imports; CycleError if there is none."""
    return list(TopologicalSorter(graph).static_order())


def test_no_modules_import_each_other() -> None:
    assert len(sort(IMPORTS)) == len(MODULES)


def test_folders_can_be_ordered() -> None:
    folders: dict[str, set[str]] = {}
    for name, others in IMPORTS.items():
        folder = name.rpartition(".")[0]
        folders.setdefault(folder, set()).update(other.rpartition(".")[0] for other in others)
    order = sort({folder: others - {folder} for folder, others in folders.items()})
    assert order[0] == "fbvm.check.symbols" and order.index("fbvm.check.expressions") == 1


def test_only_the_checker_imports_the_parts() -> None:
    parts = ("fbvm.check.calls.calls", "fbvm.check.declarations.interfaces", "fbvm.check.declarations.globals",
             "fbvm.check.expressions.rules")  # fmt: skip
    importers = {part: {name for name, others in IMPORTS.items() if part in others} for part in parts}
    assert importers == {part: {"fbvm.check.checker"} | ({"fbvm.check.statements"} if part.endswith("calls") else set())
                         for part in parts}  # fmt: skip
