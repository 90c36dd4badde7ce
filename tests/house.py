"""Reads the modules of fbvm: what each imports, its statements, how its functions branch.  For the rules of the house."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

HOUSE = Path(__file__).resolve().parent.parent
PACKAGE = HOUSE / "fbvm"


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(text_of(path))


MODULES = sorted(PACKAGE.rglob("*.py"))


@cache
def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def room_of(dotted: str) -> str:
    """The room of `fbvm.units.etn21.unit` is "units", that of `fbvm` itself ""."""
    parts = dotted.split(".")
    return parts[1] if len(parts) > 1 else ""


BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")
"""Where statements hold others."""


@cache
def statements(path: Path) -> list[ast.AST]:
    """All statements of a module, also within functions."""
    found: list[ast.AST] = [tree(path)]
    for node in found:
        found += [inner for block in BLOCKS for inner in getattr(node, block, ())]
    return found


@cache
def imports(path: Path) -> list[str]:
    """Dotted names of all that a module imports, also within functions."""
    found = []
    for node in statements(path):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}: relative import"
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                found.append(name if is_module(name) else node.module or "")
    return found


@cache
def is_module(name: str) -> bool:
    """True for the dotted name of a module or folder of this repository."""
    place = HOUSE / name.replace(".", "/")
    return place.with_suffix(".py").exists() or (place / "__init__.py").exists()


@cache
def dotted(path: Path) -> str:
    """`fbvm.base.types` for fbvm/base/types.py, `fbvm.base` for fbvm/base/__init__.py."""
    return ".".join(("fbvm", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """The nodes that reach one another: strongly connected components of more than one node (Tarjan)."""
    order: dict[str, int] = {}
    lowest: dict[str, int] = {}
    waiting: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = lowest[node] = len(order)
        waiting.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in order:
                visit(other)
            if other in waiting:
                lowest[node] = min(lowest[node], lowest[other])
        if lowest[node] == order[node]:
            ended = waiting[waiting.index(node):]
            del waiting[waiting.index(node):]
            if len(ended) > 1:
                found.append(sorted(ended))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return found


@cache
def folder_of(module: str) -> str:
    """`syntax/st` for `fbvm.syntax.st.lexer`, and for `fbvm.syntax.st`, if that is a folder."""
    parts = module.split(".")[1:]
    return "/".join(parts if (PACKAGE.joinpath(*parts) / "__init__.py").exists() else parts[:-1])


FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
DECISIONS = (ast.If, ast.For, ast.While, ast.IfExp, ast.ExceptHandler, ast.match_case)
WORDS_OF_DECISIONS = re.compile(r"\b(?:if|elif|for|while|except|case|and|or)\b")


def functions(path: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    """All functions of a module, methods and inner ones, too."""
    return (node for node in statements(path) if isinstance(node, FUNCTION))


def branches(function: ast.AST) -> int:
    """The cyclomatic complexity of a function: one, and one more for each decision in it; inner functions count by themselves."""
    found, todo = 1, list(ast.iter_child_nodes(function))
    for node in todo:
        found += isinstance(node, DECISIONS)
        found += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
        found += 1 + len(node.ifs) if isinstance(node, ast.comprehension) else 0
        if not isinstance(node, FUNCTION):
            todo += ast.iter_child_nodes(node)
    return found


def most_branches(function: ast.FunctionDef | ast.AsyncFunctionDef, lines: list[str]) -> int:
    """At least as many as `branches`, and found without a walk: each decision has a word of its own in the lines of a module."""
    text = "\n".join(lines[function.lineno - 1 : function.end_lineno])
    return 1 + sum(1 for _ in WORDS_OF_DECISIONS.finditer(text))
