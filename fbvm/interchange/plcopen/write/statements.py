"""Statements between rungs as networks of their ladder diagram: assignments, calls of blocks, conditional assignments.

Expressions stay as they are, in boxes of variables, which take expressions too.
"""

from __future__ import annotations

from fbvm.interchange.plcopen.write.layout import Drawing, Ends
from fbvm.interchange.plcopen.write.types import NotExportable, Types
from fbvm.syntax import tree

COLUMN = 3
"""Where blocks stand, so that their values fit in front of them."""


class StatementWriter:
    """Draws simple statements of one POU."""

    def __init__(self, drawing: Drawing, types: Types) -> None:
        self.drawing, self.types = drawing, types

    def write(self, statement: tree.Statement) -> None:
        """Draw one statement as a network of its own.  Raises NotExportable."""
        drawing = self.drawing
        if isinstance(statement, tree.Assign) and statement.op == ":=" and len(statement.targets) == 1:
            end = drawing.in_variable(self.types.text(statement.value), drawing.x(1), drawing.y(0))
            drawing.out_variable(self.types.text(statement.targets[0]), end)
            drawing.skip(1)
        elif isinstance(statement, tree.CallStatement) and isinstance(statement.call, tree.Call):
            self._call(statement.call)
        elif isinstance(statement, tree.If):
            self._conditional(statement)
        elif not isinstance(statement, tree.Empty):
            raise self._not_exportable(statement)

    def _not_exportable(self, statement: tree.Statement) -> NotExportable:
        return NotExportable(statement, "this statement among rungs has no form in a ladder diagram",
                             "put it into a POU of Structured Text")

    def _call(self, call: tree.Call) -> None:
        """A call of an instance with named arguments; its type is that of its declaration."""
        inputs: list[tuple[str, Ends | str]] = []
        outputs: list[tuple[str, str]] = []
        for argument in call.arguments:
            if argument.name is None or argument.negated or not isinstance(call.callee, tree.NameRef):
                raise self._not_exportable(tree.CallStatement(call.start, call.end, call))
            if argument.kind == "=>":
                outputs.append((argument.name.text, self.types.text(argument.value) if argument.value else ""))
            elif argument.value is not None:
                inputs.append((argument.name.text, self.types.text(argument.value)))
        assert isinstance(call.callee, tree.NameRef)
        name = call.callee.text
        kind = self.types.instances.get(name.upper())
        if kind is None:
            raise self._not_exportable(tree.CallStatement(call.start, call.end, call))
        self.drawing.block(kind, name, inputs, outputs, COLUMN, 0)
        self.drawing.skip(max(len(inputs), len(outputs), 2) // 2 + 1)

    def _conditional(self, statement: tree.If) -> None:
        """`IF c THEN v := e; END_IF` as MOVE with EN."""
        if len(statement.branches) != 1 or statement.otherwise or len(statement.branches[0][1]) != 1:
            raise self._not_exportable(statement)
        condition, (only,) = statement.branches[0]
        if not isinstance(only, tree.Assign) or only.op != ":=" or len(only.targets) != 1:
            raise self._not_exportable(statement)
        drawing = self.drawing
        inputs: list[tuple[str, Ends | str]] = [("EN", self.types.text(condition)), ("IN", self.types.text(only.value))]
        drawing.block("MOVE", "", inputs, [("ENO", ""), ("OUT", self.types.text(only.targets[0]))], COLUMN, 0)
        drawing.skip(2)


