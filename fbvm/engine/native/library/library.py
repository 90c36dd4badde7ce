"""The library of machine code: routines that all images share, compiled part by part when the first image calls one."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterable, Mapping
from functools import cache
from types import ModuleType

from fbvm.engine.native.library import literals as native_literals
from fbvm.engine.native.library import reading
from fbvm.engine.native.library import routines as native_routines
from fbvm.engine.native.library import times as native_times
from fbvm.engine.native.library.subset import OUTSIDE, Routine

PARTS: tuple[tuple[ModuleType, ...], ...] = ((native_routines,), (reading, native_times, native_literals))
"""Modules of routines that are compiled together; a part may call those before it."""


@cache
def _functions(part: int) -> dict[str, tuple[ast.FunctionDef, ModuleType]]:
    """The functions of a part by name, each with its module."""
    return {node.name: (node, module) for module in PARTS[part] for node in ast.parse(inspect.getsource(module)).body
            if isinstance(node, ast.FunctionDef)}


def parts_of(routines: Iterable[str]) -> list[int]:
    """The numbers of the parts that have these routines, and of those that their routines call."""
    last = max((part for part in range(len(PARTS)) for name in routines if name in _functions(part)), default=-1)
    return list(range(last + 1))


def routines_of(part: int) -> list[str]:
    """The names of a part's routines."""
    return list(_functions(part))


def declaration(name: str) -> str:
    """The declaration of a routine in LLVM's language, for modules that call it."""
    function = next(_functions(part)[name][0] for part in range(len(PARTS)) if name in _functions(part))
    return f"declare i64 @{name}({', '.join('i64' for _ in function.args.args)}) #1"


def module_text(part: int) -> str:
    """The module of a part in LLVM's language."""
    constants: dict[bytes, str] = {}
    own = _functions(part)
    lines: list[str] = []
    called: set[str] = set()
    for function, source in own.values():
        routine = Routine(function, vars(source), lambda value: constants.setdefault(value + b"\0", f"@k{len(constants)}"))
        lines += routine.translate()
        called |= routine.calls
    declared = [declaration(name) for name in sorted(called - set(own))]
    return "\n".join([*definitions(constants), *lines, *declared, *OUTSIDE, "attributes #1 = { nounwind }"])


def definitions(constants: Mapping[bytes, str]) -> list[str]:
    """The definitions of constants, whose names are given by their bytes."""
    return [f"{name} = private unnamed_addr constant [{len(value)} x i8] {_bytes(value)}"
            for value, name in constants.items()]


def _bytes(value: bytes) -> str:
    return 'c"' + "".join(f"\\{byte:02X}" for byte in value) + '"'
