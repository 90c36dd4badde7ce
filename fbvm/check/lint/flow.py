"""Warnings about control flow: what is never executed, conditions that always hold, the member that a CASE forgets."""

from __future__ import annotations

from fbvm.base.types import Elementary, EnumType, base
from fbvm.check.expressions.values import is_any
from fbvm.check.lint.body import Body
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc

_LEAVES = {tree.Return: "RETURN", tree.Exit: "EXIT", tree.Continue: "CONTINUE"}
_TURNED = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}


def flow(body: Body) -> None:
    """Warn of unreachable statements, conditions that never change and CASE statements that forget one member."""
    _Flow(body).block(body.pou.tree.body)


_GOES_ON = (tree.Assign, tree.CallStatement)


class _Flow:
    def __init__(self, body: Body) -> None:
        self.body = body
        self.left: list[bool] = []
        """For each enclosing loop, the innermost last: True if an EXIT leaves it."""
        self.returns = False
        """True if a RETURN was met."""

    def block(self, statements: tree.Block) -> bool:
        """Check statements; True if their end is never reached."""
        over: tree.Statement | None = None
        for statement in statements:
            if over is not None and not isinstance(statement, tree.Empty):
                word = _LEAVES.get(type(over), "")
                self.body.warn("S0592", statement, "this is never executed", "",
                               self.body.there(over, f"{word} stands in front of it" if word else "this never goes on"))
                return True
            if self.ends(statement) and over is None:
                over = statement
        return over is not None

    def ends(self, statement: tree.Statement) -> bool:
        """Check a statement; True if the next one is never reached."""
        if isinstance(statement, _GOES_ON) or statement in self.body.facts.conditional:
            return False
        if isinstance(statement, tree.If):
            return self.choice(statement)
        if isinstance(statement, tree.Case):
            self.members(statement)
            ends = [self.block(branch.body) for branch in statement.branches]
            return statement.otherwise is not None and self.block(statement.otherwise) and all(ends)
        if isinstance(statement, tree.For | tree.While | tree.Repeat):
            return self.loop(statement)
        if isinstance(statement, tree.Try):
            both = [self.block(statement.body), self.block(statement.handler)]
            return self.block(statement.final or ()) or all(both)
        if isinstance(statement, ladder.Ladder | ladder.Rung | sfc.Sfc | il.InstructionList):
            return self.block(statement.body)
        if isinstance(statement, tree.Exit) and self.left:
            self.left[-1] = True
        self.returns = self.returns or isinstance(statement, tree.Return)
        return type(statement) in _LEAVES

    def choice(self, node: tree.If) -> bool:
        ends = []
        for condition, block in node.branches:
            value = self.always(condition)
            if value is not None:
                self.body.warn("S0593", condition, f"this is always {'TRUE' if value else 'FALSE'}",
                               "" if value else "what stands behind THEN is never executed")
            ends.append(self.block(block))
        return node.otherwise is not None and self.block(node.otherwise) and all(ends)

    def loop(self, node: tree.For | tree.While | tree.Repeat) -> bool:
        """Check a loop, and warn if it never ends; True if the next statement is never reached."""
        before, self.returns = self.returns, False
        self.left.append(False)
        self.block(node.body)
        left = self.left.pop()
        endless = False
        if isinstance(node, tree.While | tree.Repeat):
            condition = node.condition if isinstance(node, tree.While) else node.until
            value, on = self.always(condition), isinstance(node, tree.While)
            endless = value is on and not left
            if endless and not self.returns:
                self.body.warn("S0593", condition, f"this is always {'TRUE' if value else 'FALSE'}: the loop never ends",
                               "let something in the loop change it, or leave by EXIT")
            elif value is False and on:
                self.body.warn("S0593", condition, "this is always FALSE", "the loop is never executed")
        self.returns = self.returns or before
        return endless

    def always(self, condition: tree.Expr) -> bool | None:
        """The value that a condition always has, None if it may have both.  Named constants count as variables."""
        value = self.body.constant(condition)
        if value is not None:
            return bool(value)
        if not isinstance(condition, tree.Binary) or condition.op not in _TURNED:
            return None
        for expr, other, op in ((condition.left, condition.right, condition.op),
                                (condition.right, condition.left, _TURNED[condition.op])):
            bound = self.body.constant(other)
            kind = base(self.body.facts.types.get(expr, base(self.body.facts.operands[condition])))
            if bound is not None and expr not in self.body.facts.constants and isinstance(kind, Elementary) \
                    and is_any(kind, "ANY_INT", "ANY_BIT"):
                return _within(op, kind, bound)
        return None

    def members(self, node: tree.Case) -> None:
        """Warn of the one member of an enumeration that a CASE without ELSE has no branch for; several are deliberate."""
        kind = self.body.facts.types.get(node.selector)
        if not isinstance(kind, EnumType) or node.otherwise is not None:
            return
        spans = [span for branch in node.branches for span in self.body.facts.labels.get(branch, ())]
        missing = [name for value, name in kind.shown.items() if not any(low <= value <= high for low, high in spans)]
        if len(missing) == 1 and len(kind.shown) > 2:
            self.body.warn("S0595", node.selector, f"this CASE has a branch for every member but {missing[0]}",
                           "add it, or an ELSE for the rest")


def _within(op: str, kind: Elementary, bound: int) -> bool | None:
    """The value that `x op bound` has for all x of an integer type, None if both occur."""
    if op in ("<", ">="):
        return op == ">=" if bound <= kind.low else op == "<" if bound > kind.high else None
    return op == "<=" if bound >= kind.high else op == ">" if bound < kind.low else None
