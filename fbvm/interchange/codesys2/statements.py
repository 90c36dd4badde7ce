"""Networks of an export of CODESYS 2.3 as rungs and statements: contacts and coils as a rung, all else as statements.

A value is evaluated once: a network with several outputs hands it from one to the next.  A block in a row of contacts takes the
power in front of it at its first input, and passes on its first output.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from fbvm.interchange.codesys2.diagrams import Network, Output, Unreadable
from fbvm.interchange.codesys2.diagrams import Value as Node
from fbvm.interchange.plcopen.read.values import ATOM, CHAINED, FALSE, INFIX, TRUE, Value, both, either, joined, negation, written
from fbvm.syntax.ladder.operands import OperandError, Operands
from fbvm.syntax.ladder.text import instruction_text
from fbvm.syntax.tree import Index, Member, NameRef

Pins = Callable[[str], tuple[Sequence[str], Sequence[str]] | None]
"""The inputs and outputs of a type of function blocks; None if nothing declares it."""
_OPERAND = re.compile(r"[^\W\d]\w*(?:\.[^\W\d]\w*|\[\d+\])*")
"""What a contact or coil of a rung can look like; others, such as addresses and bits of words, stand in statements."""
_TEMPORARY = re.compile(r"TR\d+", re.IGNORECASE)
_COILS = {(False, False): "OUT", (True, False): "OUTNOT", (False, True): "SET", (True, True): "RSET"}


class Writer:
    """Writes the networks of one body.  `power` grows by the names of BOOLs that the POU must declare."""

    def __init__(self, pins: Pins) -> None:
        self.pins = pins
        self.power: list[str] = []
        self.lines: list[str] = []

    def network(self, number: int, network: Network) -> list[str]:
        """The lines of a network.  Raises Unreadable."""
        notes = [line.strip().strip("'").strip() for line in network.comment]
        notes = [note for note in notes if note]
        if rung := _rung(network):
            title = f"RUNG {number} {notes[0] if notes else ''}".rstrip()
            return ["LADDER", title, *(f"'{note}" for note in notes[1:]), *rung, "END_LADDER"]
        self.lines = [f"// {note}" for note in notes]
        value = self._value(network.value)
        if network.boxes:
            if network.outputs:
                name = f"Power_{number}"
                self.power.append(name)
                self.lines.append(f"{name} := {value.text};")
                value = Value(name)
            self._boxes(value, network.boxes)
        self._assign(value, network.outputs)
        if not network.boxes and not network.outputs and network.value.kind != "empty" and len(self.lines) == len(notes):
            raise Unreadable(network.start, "nothing comes of a network")
        return self.lines

    def _boxes(self, power: Value, boxes: Sequence[tuple[Node, tuple[Output, ...]]]) -> None:
        """The boxes with EN, while the power is TRUE."""
        outer, self.lines = self.lines, []
        for box, outputs in boxes:
            if not box.enabled:
                raise Unreadable(box.at, "a box without EN stands among those with EN")
            self._assign(self._value(box, enabled=True), outputs)
        inner, self.lines = self.lines, outer
        self.lines += inner if power.is_true else [f"IF {power.text} THEN", *inner, "END_IF;"]

    def _assign(self, value: Value, outputs: Sequence[Output]) -> None:
        """Give a value to all outputs: plain ones first, each of which then holds it.  Those that store do so behind one
        condition, which may read what they change."""
        stored = [f"{one.name} := {'FALSE' if one.negated else 'TRUE'};" for one in outputs if one.name and one.stores]
        for output in outputs:
            if output.name and not output.stores:
                given = negation(value) if output.negated else value
                self.lines.append(f"{output.name} := {given.text};")
                value = negation(Value(output.name)) if output.negated else Value(output.name)
        if stored:
            self.lines += stored if value.is_true else [f"IF {value.text} THEN {' '.join(stored)} END_IF;"]

    # --- values ---

    def _value(self, node: Node, enabled: bool = False) -> Value:
        """The value of a node that stands for itself."""
        if node.enabled and not enabled:
            raise Unreadable(node.at, "a box with EN stands outside of ENABLELIST")
        if node.kind == "empty":
            return TRUE
        if node.kind == "not":
            return negation(self._value(node.parts[0]))
        made = self._plain(node)
        return negation(made) if node.negated else made

    def _plain(self, node: Node) -> Value:
        """The value of a node without its own negation."""
        if node.kind == "functionblock":
            return self._instance(node, TRUE)
        if node.kind == "ld_and":
            return self._row(node.parts)
        if node.kind == "ld_or":
            return either([self._value(part) for part in node.parts])
        if node.kind in ("operator", "function"):
            return self._called(node)
        text = node.text.upper()
        return TRUE if text == "TRUE" else FALSE if text == "FALSE" else written(node.text, frozenset())

    def _row(self, parts: Sequence[Node]) -> Value:
        """The power behind elements in series: a block whose first input has no operand takes the power in front of it there."""
        made = TRUE
        for part in parts:
            if part.kind == "functionblock" and part.parts and part.parts[0].kind == "empty":
                made = negation(self._instance(part, made)) if part.negated else self._instance(part, made)
            else:
                made = both(made, self._value(part))
        return made

    def _called(self, node: Node) -> Value:
        name, values = node.text.upper(), [self._input(part) for part in node.parts]
        if name == "NOT" and len(values) == 1:
            return negation(values[0])
        if name in INFIX and (len(values) == 2 or len(values) > 2 and name in CHAINED):
            return joined(name, values)
        return Value(f"{node.text}({', '.join(value.text for value in values)})", ATOM)

    def _input(self, node: Node) -> Value:
        if node.kind == "empty":
            raise Unreadable(node.at, "an input of a function has no operand")
        return self._value(node)

    def _instance(self, node: Node, power: Value) -> Value:
        """Call an instance; the value is its first output, and `power` what its first input gets if it has no operand."""
        pins = self.pins(node.type)
        if pins is None or not pins[1]:
            raise Unreadable(node.at, f"nothing in the file declares {node.type}, whose outputs have to be known")
        inputs, outputs = pins
        if len(node.parts) > len(inputs) or len(node.outputs) > len(outputs):
            raise Unreadable(node.at, f"{node.type} has other inputs or outputs than its box")
        given = []
        for at, (name, part) in enumerate(zip(inputs, node.parts, strict=False)):
            if part.kind != "empty":
                given.append(f"{name} := {self._value(part).text}")
            elif at == 0:
                given.append(f"{name} := {power.text}")
        self.lines.append(f"{node.text}({', '.join(given)});")
        behind = outputs[1:] if len(node.outputs) < len(outputs) else outputs
        for name, output in zip(behind, node.outputs, strict=False):
            self._assign(Value(f"{node.text}.{name}"), (output,))
        return Value(f"{node.text}.{outputs[0]}")


# --- rungs ------------------------------------------------------------------------------------------------------------


def _rung(network: Network) -> list[str]:
    """The steps of a network of contacts and coils; none if it has something else."""
    if network.boxes or not network.outputs or not _is_plain(network.value):
        return []
    if not all(_is_bit(output.name) for output in network.outputs):
        return []
    coils = (instruction_text(_COILS[one.negated, one.stores], one.name) for one in network.outputs)
    return [*_steps(network.value, "LD"), *coils]


def _is_plain(node: Node) -> bool:
    if node.kind == "ld_contact":
        return _is_bit(node.text)
    return node.kind in ("ld_and", "ld_or") and not node.negated and bool(node.parts) and all(map(_is_plain, node.parts))


def _is_bit(text: str) -> bool:
    """Whether a rung can name it, which reads names such as T1, D5 and P_On as its own."""
    if not _OPERAND.fullmatch(text) or _TEMPORARY.fullmatch(text) or text.upper() in ("TRUE", "FALSE"):
        return False
    try:
        return isinstance(Operands().expression(text, "b", 0, 0), (NameRef, Member, Index))
    except OperandError:
        return False


def _steps(node: Node, how: str) -> list[str]:
    """The steps of a contact, a row or branches, joined to what is written: `how` is LD, AND or OR."""
    if node.kind == "ld_contact":
        return [instruction_text(f"{how}NOT" if node.negated else how, node.text)]
    if len(node.parts) == 1:
        return _steps(node.parts[0], how)
    first, *more = node.parts
    joins = "AND" if node.kind == "ld_and" else "OR"
    lines = _steps(first, "LD")
    for part in more:
        lines += _steps(part, joins)
    return lines if how == "LD" else [*lines, f"{how} LD"]
