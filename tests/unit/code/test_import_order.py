"""The floors inside `code/`: modules form no circle, and folders only import those below, imports for type checking included."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import fbvm

PACKAGE = Path(fbvm.__file__).parent
ORDER = ("code", "code/builder", "code/layout", "code/pictures", "code/lowering", "code/store", "code/compiler")
"""Each folder imports from itself and from those in front of it."""


def imported(path: Path) -> set[Path]:
    """The modules of `code/` that a module imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fbvm.code"):
            for alias in node.names:
                inner = PACKAGE.parent.joinpath(*str(node.module).split("."), alias.name).with_suffix(".py")
                found.add(inner if inner.exists() else PACKAGE.parent.joinpath(*str(node.module).split(".")).with_suffix(".py"))
    return found


MODULES = {path: imported(path) for path in (PACKAGE / "code").rglob("*.py") if path.name != "__init__.py"}


def test_modules_form_no_circle() -> None:
    order = list(TopologicalSorter(MODULES).static_order())
    assert set(order) == set(MODULES)


def test_folders_import_only_those_below() -> None:
    floor = {PACKAGE / folder: number for number, folder in enumerate(ORDER)}
    climbing = [(path.name, other.name) for path, others in MODULES.items() for other in others
                if floor[path.parent] < floor[other.parent]]
    assert climbing == []
