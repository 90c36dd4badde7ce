"""JMP and labels of Structured Text as conditions, and as a loop for a jump back.

A jump sets a variable.  Statements that the jump passes over are executed only while the variable is FALSE, and loops that
the jump leads out of are left.  The label sets the variable back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.tree import Block, Expr, NameRef, Statement
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.node import changed

LOOPS = tree.For | tree.While | tree.Repeat


class Tangled(Exception):
    """Conditions and loops cannot say what these jumps do: one leads into a block, or two jumps back cross each other."""


@dataclass(frozen=True)
class Row:
    """A statement of a list with the jumps that leave it, or a label."""

    statement: Statement
    leaving: tuple[str, ...] = ()
    label: str = ""


class Jumps:
    """The jumps of one body; `targets` and `labels` say which statements are jumps and labels, and of what name.

    `others` is how many bodies of the POU have jumps besides, which have their own variables for labels of the same name."""

    def __init__(self, targets: Mapping[Statement, str], labels: Mapping[Statement, str], others: int = 0) -> None:
        self.targets = targets
        self.labels = labels
        self.others = others
        self._known = {fold(label) for label in labels.values()}
        self.flags: dict[str, str] = {}
        """Names of the variables that jumps set, by folded label."""

    def body(self, body: Block) -> Block:
        """The same body without jumps.  Raises Tangled if there is no such body."""
        made, leaving = self._block(body, None)
        if leaving:
            raise Tangled
        return made

    def astray(self) -> list[Statement]:
        """Jumps to labels that do not exist."""
        return [jump for jump, label in self.targets.items() if fold(label) not in self._known]

    def section(self, body: Block) -> tree.VarSection:
        """The variables that jumps need."""
        start, end = body[0].start, body[-1].end
        variables = [tree.VarDecl(start, end, (tree.Name(start, end, name),), None, tree.NamedType(start, end, "BOOL"), None)
                     for name in self.flags.values()]
        return tree.VarSection(start, end, "VAR_TEMP", (), tuple(variables), True)

    def _block(self, block: Block, loop: str | None) -> tuple[Block, tuple[str, ...]]:
        """The statements of a list without jumps, and the labels of jumps that leave the list; `loop` is None if the list is not
        the body of a loop."""
        return self._sequence([self._row(each) for each in block], loop)

    def _row(self, statement: Statement) -> Row:
        if statement in self.labels:
            return Row(statement, label=fold(self.labels[statement]))
        if statement in self.targets:
            name = fold(self.targets[statement])
            if name not in self._known:
                return Row(tree.Empty(statement.start, statement.end))
            return Row(self._set(statement, name, True), (name,))
        leaving: list[str] = []

        def inner(block: Block) -> Block:
            made, more = self._block(block, "" if isinstance(statement, LOOPS) else None)
            leaving.extend(name for name in more if name not in leaving)
            return made

        return Row(_rebuilt(statement, inner), tuple(leaving))

    def _sequence(self, rows: list[Row], loop: str | None) -> tuple[Block, tuple[str, ...]]:
        """Put the statements behind a jump under the condition that it has not been taken.  In the body of a loop, `loop` is the
        label of the jump back that makes the loop, or ""."""
        rows = self._with_loops(rows)
        made: list[Statement] = []
        group: list[Statement] = []
        passing: list[str] = []
        gone: list[str] = []
        last = {row.label: at for at, row in enumerate(rows)}
        for at, row in enumerate(rows):
            if not row.label:
                group.append(row.statement)
                if not row.leaving:
                    continue
            made += self._guarded(group, passing)
            group = []
            if row.label in passing:
                passing.remove(row.label)
                made.append(self._set(row.statement, row.label, False))
            out = [name for name in row.leaving if last.get(name, -1) <= at]
            gone += [name for name in out if name not in gone]
            stays = row.leaving if loop is None else [name for name in row.leaving if name not in out]
            passing += [name for name in stays if name not in passing]
            if loop is not None:
                made += self._leaves(row.statement, out, loop)
        return (*made, *self._guarded(group, passing)), tuple(gone)

    def _leaves(self, at: Statement, names: list[str], loop: str) -> Iterator[Statement]:
        """Leave the loop if a jump to a label behind it was taken; continue it for its own label."""
        for name in names:
            leave = (tree.Continue if name == loop else tree.Exit)(at.start, at.end)
            yield tree.If(at.start, at.end, ((self._flag(at, name), (leave,)),), None)

    def _with_loops(self, rows: list[Row]) -> list[Row]:
        """Rows with loops for jumps back: each from its label up to the last jump to that label.  Raises Tangled."""
        jumps: dict[str, list[int]] = {}
        for at, row in enumerate(rows):
            for name in row.leaving:
                jumps.setdefault(name, []).append(at)
        made, last = list[Row](), -1
        for first, row in enumerate(rows):
            if first <= last:
                continue
            made.append(row)
            if row.label and jumps.get(row.label, [-1])[-1] > first:
                last = jumps[row.label][-1]
                inside = rows[first + 1:last + 1]
                if any(not first < at <= last for each in inside if each.label for at in jumps.get(each.label, ())):
                    raise Tangled
                made.append(self._loop(row.label, inside))
        return made

    def _loop(self, label: str, inside: list[Row]) -> Row:
        """The loop of a jump back to a label: what stands between both.  Raises Tangled."""
        if any(_leaves_loop(each.statement) for each in inside):
            raise Tangled
        body, leaving = self._sequence(inside, label)
        start, end = inside[0].statement.start, inside[-1].statement.end
        taken = self._set(inside[0].statement, label, False)
        again = tree.Unary(start, end, "NOT", NameRef(start, end, self._name(label)))
        return Row(tree.Repeat(start, end, (taken, *body), again), tuple(n for n in leaving if n != label))

    def _guarded(self, group: list[Statement], passing: list[str]) -> list[Statement]:
        if not group or not passing:
            return group
        start, end = group[0].start, group[-1].end
        over: Expr = NameRef(start, end, self._name(passing[0]))
        for name in passing[1:]:
            over = tree.Binary(start, end, "OR", over, NameRef(start, end, self._name(name)), start)
        return [tree.If(start, end, ((tree.Unary(start, end, "NOT", over), tuple(group)),), None)]

    def _set(self, at: Statement, label: str, value: bool) -> Statement:
        truth = tree.Literal(at.start, at.end, "bool", value, None, "TRUE" if value else "FALSE")
        return tree.Assign(at.start, at.end, (self._flag(at, label),), ":=", truth)

    def _flag(self, at: Statement, label: str) -> NameRef:
        return NameRef(at.start, at.end, self._name(label))

    def _name(self, label: str) -> str:
        return self.flags.setdefault(label, f"$JMP{self.others or ''} {label}")


def _leaves_loop(statement: Statement) -> bool:
    """Whether a statement contains an EXIT or CONTINUE of a loop around the statement."""
    if isinstance(statement, tree.Exit | tree.Continue):
        return True
    found: list[bool] = []

    def look(block: Block) -> Block:
        found.extend(_leaves_loop(each) for each in block)
        return block

    if not isinstance(statement, LOOPS):
        _rebuilt(statement, look)
    return any(found)


def _rebuilt(node: Statement, inner: Callable[[Block], Block]) -> Statement:
    """The statement with `inner` of each block in place of the block."""
    if isinstance(node, tree.If):
        branches = tuple((condition, inner(block)) for condition, block in node.branches)
        return changed(node, branches=branches, otherwise=None if node.otherwise is None else inner(node.otherwise))
    if isinstance(node, tree.Case):
        cases = tuple(changed(branch, body=inner(branch.body)) for branch in node.branches)
        return changed(node, branches=cases, otherwise=None if node.otherwise is None else inner(node.otherwise))
    if isinstance(node, tree.Try):
        return changed(node, body=inner(node.body), handler=inner(node.handler),
                       final=None if node.final is None else inner(node.final))
    if isinstance(node, tree.For | tree.While | tree.Repeat | InstructionList):
        return changed(node, body=inner(node.body))
    return node
