"""The statement lists inside statements, and searches through them."""

from __future__ import annotations

import re

from fbvm.base.types import fold
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc

_PLAIN = tree.Assign | tree.CallStatement
_WITH_BODY = tree.For | tree.While | tree.Repeat | ladder.Ladder | ladder.Rung | sfc.Sfc | il.InstructionList


def bodies(statement: tree.Statement) -> list[tree.Block]:
    """The statement lists inside a statement."""
    if isinstance(statement, _PLAIN):
        return []
    if isinstance(statement, tree.If):
        return [body for _, body in statement.branches] + [statement.otherwise or ()]
    if isinstance(statement, tree.Case):
        return [branch.body for branch in statement.branches] + [statement.otherwise or ()]
    if isinstance(statement, tree.Try):
        return [statement.body, statement.handler, statement.final or ()]
    if isinstance(statement, _WITH_BODY):
        return [statement.body]
    return []


_ENO_OF = re.compile(r"(?i)(?<![\w.])(\w+)\s*\.\s*ENO\b")


def names_of_eno(pou: Pou) -> set[str]:
    """The folded names in front of `.ENO` in the text of a POU, among them those of instances whose ENO it reads."""
    node = pou.tree
    return {fold(name) for name in _ENO_OF.findall(pou.source.text, node.start, node.end)} if _may_name_eno(pou) else set()


def writes_eno(pou: Pou) -> bool:
    """True if the body of a POU assigns ENO anywhere."""
    return _may_name_eno(pou) and _assigns_to(pou.tree.body, "ENO")


def _may_name_eno(pou: Pou) -> bool:
    """False for most POUs, which do not name it anywhere: a look at the text is faster than one at each name."""
    return "ENO" in pou.source.text[pou.tree.start:pou.tree.end].upper()


def _assigns_to(statements: tree.Block, name: str) -> bool:
    for statement in statements:
        if isinstance(statement, tree.Assign) and any(
                isinstance(t, tree.NameRef) and fold(t.text) == name for t in statement.targets):
            return True
        if any(_assigns_to(body, name) for body in bodies(statement)):
            return True
    return False
