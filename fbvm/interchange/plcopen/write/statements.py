"""Statements between rungs as networks of their ladder diagram: assignments, calls of blocks, conditional assignments.

Expressions stay as they are, in boxes of variables, which take expressions too.  What is nothing but an output of a block that
was drawn just before is a wire from that output: tools that begin with the outputs of a diagram call the block in front of them
then.
"""

from __future__ import annotations

from fbvm.check.calls.functions import OPERATORS, SIGNATURES, TIME_OPERATORS, conversion
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.schema import SIGNS
from fbvm.interchange.plcopen.write.layout import Drawing, Ends
from fbvm.interchange.plcopen.write.types import NotExportable, Types
from fbvm.syntax import tree
from fbvm.syntax.tree.node import walk

FUNCTIONS = {**{sign: name for name, sign in SIGNS.items()}, "**": "EXPT"}
"""By operator, the function that is drawn for it."""
COLUMN = 3
"""Where blocks stand, so that their values fit in front of them."""


def _standard_call(call: tree.Call) -> tuple[str, list[tuple[str, tree.Expr]]] | None:
    """The name of a standard function and its operands by pin; None for another call, and for one that is not written plainly."""
    if not isinstance(call.callee, tree.NameRef) or any(
            argument.kind == "=>" or argument.negated or argument.value is None for argument in call.arguments):
        return None
    name = call.callee.text.upper()
    pins = _pins(name, len(call.arguments))
    if len(pins) != len(call.arguments):
        return None
    return name, [(argument.name.text if argument.name else pin, argument.value)
                  for pin, argument in zip(pins, call.arguments, strict=True) if argument.value is not None]


def _pins(name: str, count: int) -> list[str]:
    """The inputs of a standard function that takes so many operands; none if it takes no such number, or is none."""
    row = SIGNATURES.get(name)
    if name in OPERATORS or name in TIME_OPERATORS:
        return [f"IN{at}" for at in range(1, count + 1)]
    if conversion(name) is not None:
        return ["IN"]
    if row is None:
        return []
    pins = [pin for pin, _ in row.parameters]
    while row.repeats and len(pins) < count:
        pins.append(f"IN{int(pins[-1].removeprefix('IN')) + 1}")
    return pins


class StatementWriter:
    """Draws simple statements of one POU."""

    def __init__(self, drawing: Drawing, types: Types) -> None:
        self.drawing, self.types = drawing, types
        self.blocks: dict[str, Element] = {}
        """By instance in capitals, the blocks of the network at work.  A statement without a wire from them begins another."""
        self._is_wired = False
        self._has_effects = False
        """Whether something other than calls has been drawn behind the blocks at work: calls in a row may all be read by the next
        one, and their wires make one network of them."""

    def end_network(self) -> None:
        """Let no wire lead from what is drawn so far to what follows: a rung stands in between."""
        self.blocks = {}
        self._has_effects = False

    def write(self, statement: tree.Statement) -> None:
        """Draw one statement as a network of its own, or behind the blocks whose outputs it takes.  Raises NotExportable."""
        self._is_wired = False
        if isinstance(statement, tree.Assign) and statement.op == ":=" and len(statement.targets) == 1:
            self._assign(self.types.text(statement.targets[0]), statement.value)
        elif isinstance(statement, tree.CallStatement) and isinstance(statement.call, tree.Call):
            self._call(statement.call)
        elif isinstance(statement, tree.If):
            self._conditional(statement)
        elif not isinstance(statement, tree.Empty):
            raise self._not_exportable(statement)
        if not isinstance(statement, tree.CallStatement):
            self._has_effects = True
            if not self._is_wired:
                self.end_network()

    def _value(self, expr: tree.Expr) -> Ends | str:
        """A value as a wire if it is an output of a block at work or made of one by operators, which are blocks then; else as its
        text.

        Operators and standard functions of a literal that names its type are blocks, too: of `n + INT#1` written at a pin,
        Beremiz takes all in front of the `#` for the type of the value."""
        if not any(self._block_of(part) is not None for part in walk(expr)) and "#" not in self.types.text(expr):
            return self.types.text(expr)
        if isinstance(expr, tree.Member) and (block := self._block_of(expr)) is not None:
            self._is_wired = True
            return (self.drawing.output(block, expr.name.text),)
        if isinstance(expr, tree.Unary) and expr.op == "NOT":
            return self._function("NOT", [("IN", expr.operand)])
        if isinstance(expr, tree.Binary) and expr.op in FUNCTIONS:
            return self._function(FUNCTIONS[expr.op], [("IN1", expr.left), ("IN2", expr.right)])
        if isinstance(expr, tree.Call) and (called := _standard_call(expr)) is not None:
            return self._function(*called)
        return self.types.text(expr)

    def _function(self, name: str, operands: list[tuple[str, tree.Expr]]) -> Ends:
        inputs = [(pin, self._value(operand)) for pin, operand in operands]
        ends = self.drawing.block(name, "", inputs, [("OUT", "")], COLUMN, 0)
        self.drawing.skip(max(len(operands) // 2, 1))
        return (ends["OUT"],)

    def _block_of(self, part: tree.Node) -> Element | None:
        """The block at work that `part` names an output of."""
        if not isinstance(part, tree.Member) or not isinstance(part.of, tree.NameRef):
            return None
        block = self.blocks.get(part.of.text.upper())
        is_output = block is not None and part.name.text.upper() in self.types.outputs.get(block.get("typeName").upper(), ())
        return block if is_output else None

    def _assign(self, target: str, expr: tree.Expr) -> None:
        drawing, value = self.drawing, self._value(expr)
        block = self._block_of(expr)
        if block is not None and any(pin.get("formalParameter").upper() == "EN" for pin in block.walk()):
            value = self._function("MOVE", [("IN", expr)])  # a wire from the block itself writes while ENO is TRUE
        end = drawing.in_variable(value, drawing.x(1), drawing.y(0)) if isinstance(value, str) else value[0]
        drawing.out_variable(target, end, drawing.y(0))
        drawing.skip(1)

    def _not_exportable(self, statement: tree.Statement) -> NotExportable:
        return NotExportable(statement, "this statement among rungs has no form in a ladder diagram",
                             "put it into a POU of Structured Text")

    def _call(self, call: tree.Call) -> None:
        """A call of an instance with named arguments; its type is that of its declaration."""
        inputs: list[tuple[str, Ends | str]] = []
        outputs: list[tuple[str, str]] = []
        for argument in call.arguments:
            if argument.name is None or argument.negated:
                raise self._not_exportable(tree.CallStatement(call.start, call.end, call))
            if argument.kind == "=>":
                outputs.append((argument.name.text, self.types.text(argument.value) if argument.value else ""))
            elif argument.value is not None:
                inputs.append((argument.name.text, self._value(argument.value)))
        name = call.callee.text if isinstance(call.callee, tree.NameRef) else ""
        kind = self.types.instances.get(name.upper())
        if kind is None:
            raise self._not_exportable(tree.CallStatement(call.start, call.end, call))
        if not self._is_wired and self._has_effects:
            self.end_network()
        self.drawing.block(kind, name, inputs, outputs, COLUMN, 0)
        self.blocks[name.upper()] = next(made for made in reversed(self.drawing.elements) if made.get("instanceName") == name)
        self.drawing.skip(max(len(inputs), len(outputs), 2) // 2 + 1)

    def _conditional(self, statement: tree.If) -> None:
        """`IF c THEN v := e; END_IF` as MOVE with EN."""
        if len(statement.branches) != 1 or statement.otherwise or len(statement.branches[0][1]) != 1:
            raise self._not_exportable(statement)
        condition, (only,) = statement.branches[0]
        if not isinstance(only, tree.Assign) or only.op != ":=" or len(only.targets) != 1:
            raise self._not_exportable(statement)
        drawing = self.drawing
        inputs = [("EN", self._value(condition)), ("IN", self._value(only.value))]
        drawing.block("MOVE", "", inputs, [("ENO", ""), ("OUT", self.types.text(only.targets[0]))], COLUMN, 0)
        drawing.skip(2)
