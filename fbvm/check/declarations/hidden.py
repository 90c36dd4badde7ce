"""Hidden variables that the compiler adds to a POU for what its instances need."""

from __future__ import annotations

from fbvm.base.types import BOOL, AnyType, OpenArrayType
from fbvm.check.symbols.facts import Pou, Variable, is_block
from fbvm.check.symbols.statement_lists import names_of_eno
from fbvm.check.symbols.symbol_table import SymbolTable

_PLACED = ("VAR", "VAR_INPUT", "VAR_OUTPUT")
"""Sections whose variables VAR_CONFIG may give a place, whatever their declaration says, in a dialect that takes this."""


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
    for variable in [v for v in pou.order if not pou.is_routine and v.owner is pou and not is_block(v.type)]:
        if project.dialect.in_outs_are_written and _is_in_out(pou, variable):
            _add_own(pou, variable)
        elif project.dialect.places_for_all and _is_placed(project, pou, variable):
            variable.open = variable.reference = True
            _add_own(pou, variable)


def _is_in_out(pou: Pou, variable: Variable) -> bool:
    """True for an in-out whose values an instance can hold."""
    return pou.kind == "FUNCTION_BLOCK" and variable.kind == "VAR_IN_OUT" and not variable.by_reference and \
        not isinstance(variable.type, OpenArrayType | AnyType)


def _is_placed(project: SymbolTable, pou: Pou, variable: Variable) -> bool:
    """True for a variable of the user's to which VAR_CONFIG may give a place, though it is not declared AT %I*."""
    return variable.kind in _PLACED and variable.place == "self" and not (variable.reference or variable.constant) and \
        not pou.source.library and project.completes(variable.name)


def _add_own(pou: Pou, variable: Variable) -> None:
    """Declare the variable that holds the value of another one, which is a reference, until it gets another place."""
    kind, name = variable.type, own_name(variable.name)
    variable.own = Variable(name, kind, "VAR", pou.source, variable.node, pou, initial=variable.initial)
    pou.order.append(variable.own)


def own_name(name: str) -> str:
    """The name of the hidden variable for the values of another one: it has a space, so that no program can name it."""
    return f"{name} own"


def _instance(pou: Pou, name: str) -> Variable | None:
    block = pou.variables.get(name)
    return block if block is not None and block.kind == "VAR" and is_block(block.type) else None


def _flag(pou: Pou, block: Variable, what: str) -> Variable:
    flag = Variable(f"{block.name} {what}", BOOL, "VAR", pou.source, block.node, pou, initial=b"\0")
    pou.order.append(flag)
    return flag
