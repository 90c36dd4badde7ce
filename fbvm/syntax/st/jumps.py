"""JMP and labels of Structured Text as conditions, and as a loop for a jump back.

A jump stores the number of its label in a variable.  Statements that the jump passes over are executed only while the variable
is 0, and loops that the jump leads out of are left.  The label sets its number back to 0.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
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
    """A statement of a list with the jumps that leave it, or a label; `has_exit`: an EXIT or CONTINUE of a loop around."""

    statement: Statement
    leaving: tuple[str, ...] = ()
    label: str = ""
    has_exit: bool = False


class Jumps:
    """The jumps of one body; `targets` and `labels` say which statements are jumps and labels, and of what name.

    `others` is how many bodies of the POU have jumps besides, each with a variable of its own."""

    def __init__(self, targets: Mapping[Statement, str], labels: Mapping[Statement, str], others: int = 0) -> None:
        self.targets = targets
        self.labels = labels
        self._known = {fold(label) for label in labels.values()}
        self._numbers: dict[str, int] = {}
        """Numbers of the labels that are jumped to, by folded label."""
        self._name = f"$JMP{others or ''}"

    def body(self, body: Block) -> Block:
        """The same body without jumps.  Raises Tangled if there is no such body."""
        made, leaving = self._block(body, None)
        if leaving:
            raise Tangled
        return made

    def astray(self) -> list[Statement]:
        """Jumps to labels that do not exist."""
        return [jump for jump, label in self.targets.items() if fold(label) not in self._known]

    @property
    def is_needed(self) -> bool:
        """True if a jump needs the variable."""
        return bool(self._numbers)

    def section(self, body: Block) -> tree.VarSection:
        """The variable that jumps need."""
        start, end = body[0].start, body[-1].end
        name, kind = tree.Name(start, end, self._name), tree.NamedType(start, end, "DINT")
        return tree.VarSection(start, end, "VAR_TEMP", (), (tree.VarDecl(start, end, (name,), None, kind, None),), True)

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
            return Row(self._store(statement, self._number(name)), (name,))
        leaving: list[str] = []

        def inner(block: Block) -> Block:
            made, more = self._block(block, "" if isinstance(statement, LOOPS) else None)
            leaving.extend(name for name in more if name not in leaving)
            return made

        return Row(_rebuilt(statement, inner), tuple(leaving), has_exit=_has_exit(statement))

    def _sequence(self, rows: list[Row], loop: str | None) -> tuple[Block, tuple[str, ...]]:
        """Put the statements behind a jump under the condition that it has not been taken.  In the body of a loop, `loop` is the
        label of the jump back that makes the loop, or ""."""
        rows = self._with_loops(rows)
        made: list[Statement] = []
        group: list[Statement] = []
        passing: dict[str, None] = {}
        gone: dict[str, None] = {}
        last = {row.label: at for at, row in enumerate(rows)}
        for at, row in enumerate(rows):
            if not row.label:
                group.append(row.statement)
                if not row.leaving:
                    continue
            made += self._guarded(group) if passing else group
            group = []
            if row.label in passing:
                del passing[row.label]
                made.append(self._arrived(row.statement, row.label, passing))
            out = dict.fromkeys(name for name in row.leaving if last.get(name, -1) <= at)
            gone |= out
            passing |= dict.fromkeys(row.leaving if loop is None else [name for name in row.leaving if name not in out])
            if loop is not None:
                made += self._leaves(row.statement, out, loop)
        return (*made, *(self._guarded(group) if passing else group)), tuple(gone)

    def _arrived(self, at: Statement, label: str, passing: Collection[str]) -> Statement:
        """The end of jumps to a label, which may stand among what jumps to other labels pass over."""
        if not passing:
            return self._store(at, 0)
        stored = self._store(tree.Empty(at.start, at.start), 0)
        return tree.If(at.start, at.end, ((self._compared(at, "=", self._number(label)), (stored,)),), None)

    def _leaves(self, at: Statement, names: Collection[str], loop: str) -> Iterator[Statement]:
        """Leave the loop if a jump to a label behind it was taken; continue it for its own label."""
        for name in names:
            leave = (tree.Continue if name == loop else tree.Exit)(at.start, at.end)
            yield tree.If(at.start, at.end, ((self._compared(at, "=", self._number(name)), (leave,)),), None)

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
        if any(each.has_exit for each in inside):
            raise Tangled
        body, leaving = self._sequence(inside, label)
        first, whole = inside[0].statement, tree.Empty(inside[0].statement.start, inside[-1].statement.end)
        is_over = self._compared(whole, "<>", self._number(label))
        return Row(tree.Repeat(whole.start, whole.end, (self._store(first, 0), *body), is_over),
                   tuple(name for name in leaving if name != label))  # fmt: skip

    def _guarded(self, group: list[Statement]) -> list[Statement]:
        if not group:
            return group
        whole = tree.Empty(group[0].start, group[-1].end)
        return [tree.If(whole.start, whole.end, ((self._compared(whole, "=", 0), tuple(group)),), None)]

    def _store(self, at: Statement, number: int) -> Statement:
        return tree.Assign(at.start, at.end, (NameRef(at.start, at.end, self._name),), ":=", _literal(at, number))

    def _compared(self, at: Statement, sign: str, number: int) -> Expr:
        return tree.Binary(at.start, at.end, sign, NameRef(at.start, at.end, self._name), _literal(at, number), at.start)

    def _number(self, label: str) -> int:
        return self._numbers.setdefault(label, len(self._numbers) + 1)


def _literal(at: Statement, number: int) -> Expr:
    return tree.Literal(at.start, at.end, "int", number, None, str(number))


def _has_exit(statement: Statement) -> bool:
    """Whether a statement contains an EXIT or CONTINUE of a loop around the statement."""
    if isinstance(statement, tree.Exit | tree.Continue):
        return True
    found: list[bool] = []

    def look(block: Block) -> Block:
        found.extend(_has_exit(each) for each in block)
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
