"""Hidden variables that the compiler adds to a POU for what its instances need."""

from __future__ import annotations

from fbvm.base.types import BOOL
from fbvm.check.symbols.facts import Pou, Variable, is_block
from fbvm.check.symbols.statement_lists import names_of_eno
from fbvm.check.symbols.symbol_table import SymbolTable


def add_hidden(project: SymbolTable, pou: Pou) -> None:
    """Declare for instances of a POU whether a task of its own runs them, and whether their last call has."""
    for name in sorted(project.tasked(pou.name)) if pou.kind == "PROGRAM" else ():
        block = _instance(pou, name)
        if block is not None:
            pou.tasked[block] = _flag(pou, block, "task")
    for name in sorted(names_of_eno(pou)):
        block = _instance(pou, name)
        if block is not None and block.owner is pou:
            block.eno = _flag(pou, block, "ENO")


def _instance(pou: Pou, name: str) -> Variable | None:
    block = pou.variables.get(name)
    return block if block is not None and block.kind == "VAR" and is_block(block.type) else None


def _flag(pou: Pou, block: Variable, what: str) -> Variable:
    flag = Variable(f"{block.name} {what}", BOOL, "VAR", pou.source, block.node, pou, initial=b"\0")
    pou.order.append(flag)
    return flag
