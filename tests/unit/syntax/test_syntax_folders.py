"""The folders of `syntax/` and of `interchange/` have an order: each imports those before it, and no others."""

from __future__ import annotations

import ast
from pathlib import Path

from rows import each_of

PACKAGE = Path(__file__).resolve().parents[3] / "fbvm"
ORDERS = {
    "syntax": ("tree", "st", "ladder/instructions", "ladder/drawing", "ladder", "sfc", "recovery", "", "formatter"),
    "interchange": ("plcopen", "plcopen/read", "plcopen/write"),
}
"""Folders below each room, the lowest first; "" are the modules of the room itself."""
UNRELATED = {("ladder/drawing", "st"), ("sfc", "ladder"), ("recovery", "ladder"), ("recovery", "sfc"),
             ("plcopen/write", "plcopen/read")}  # fmt: skip
"""A folder, and another one before it that it does not import all the same."""
ANYWHERE = {"syntax/text.py"}
"""Modules that import nothing of their room."""


def folders_imported(path: Path, room: str) -> set[str]:
    """The folders of a room from which a module imports, also within functions and for type checking."""
    dotted = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            dotted |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    modules = [PACKAGE.parent / Path(*name.split(".")).with_suffix(".py") for name in dotted if name.startswith(f"fbvm.{room}.")]
    packages = [PACKAGE.parent.joinpath(*name.split(".")) for name in dotted if name.startswith(f"fbvm.{room}.")]
    found = [module.parent for module in modules if module.exists() and module.relative_to(PACKAGE).as_posix() not in ANYWHERE]
    found += [package for package in packages if package.is_dir()]
    return {"" if folder == PACKAGE / room else folder.relative_to(PACKAGE / room).as_posix() for folder in found}


@each_of("room", sorted(ORDERS))
def test_a_folder_imports_those_before_it(room: str) -> None:
    order, wrong = ORDERS[room], []
    for path in sorted((PACKAGE / room).rglob("*.py")):
        here = path.parent.relative_to(PACKAGE / room).as_posix().removeprefix(".")
        if path.name == "__init__.py" and here not in order:
            continue
        for other in folders_imported(path, room) - {here}:
            if order.index(other) > order.index(here) or (here, other) in UNRELATED:
                wrong.append(f"{path.relative_to(PACKAGE)} imports {other or room}")
    assert wrong == []


@each_of("room", sorted(ORDERS))
def test_every_folder_has_its_place(room: str) -> None:
    folders = {path.parent.relative_to(PACKAGE / room).as_posix().removeprefix(".") for path in (PACKAGE / room).rglob("*.py")
               if path.name != "__init__.py"}
    assert folders == set(ORDERS[room])
