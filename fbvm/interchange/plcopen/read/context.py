"""The values on the wires of a network while its objects are written as statements.

Each object is evaluated once a pass.  Its value is written where it is used, unless it is used several times or
something that it reads is written in between: then it is kept in a variable.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from fbvm.interchange.plcopen.read.diagram import Object, Pin, Wire
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.read.networks import Network
from fbvm.interchange.plcopen.read.producer import NETWORK
from fbvm.interchange.plcopen.read.scope import SHARED, Scope
from fbvm.interchange.plcopen.read.values import (
    ATOM,
    FALSE,
    TRUE,
    UNARY,
    Unexecutable,
    Value,
    either,
    negation,
    variable,
    written,
)

LONGEST = 500
"""Characters of the longest expression that is written several times."""
Key = tuple[Object, str]
"""An object and the name of its output."""


@dataclass
class Held:
    """The value of an output that `left` consumers have not taken yet."""

    value: Value
    wire: Wire
    left: int


class NetworkContext:
    """The state of one network at a time: `lines` grows, and `scope` by the variables that the lines need."""

    network: Network

    def __init__(self, reading: Reading, scope: Scope) -> None:
        self.reading, self.scope = reading, scope
        self.generates = reading.producer.generates
        """Whether drawings are executed as the generator of Beremiz and OpenPLC Editor writes them."""
        self.reads_in_outs = reading.producer.order != NETWORK
        """Whether a variable that a diagram reads and writes at one place is read where its value is used (`sequence.py`)."""
        self.apart = False
        """Whether the statements are executed apart from what reads their values: variables last to the next call then."""
        self._clear()

    def _clear(self) -> None:
        self.lines: list[str] = []
        self.uses: Counter[Key] = Counter()
        """How many consumers of an output are still to be written."""
        self.held: dict[Key, Held] = {}
        """Values of outputs that are still to be used."""
        self.memories: dict[Key, str] = {}
        """Variables with the values of outputs in the pass before, for wires that make a loop."""
        self.done: set[Object] = set()
        """Variables that were written before their turn."""
        self.conditions: dict[Object, str] = {}
        """The expression of each condition of a transition."""

    def begin(self, network: Network) -> None:
        """Begin a network: count the consumers of each output, and declare memories for its loops."""
        self._clear()
        self.network = network
        self.uses = Counter((wire.source, wire.pin) for item in network.objects for pin in item.pins for wire in pin.wires)
        for consumer, wire in network.cut:
            self.uses[wire.source, wire.pin] -= sum(pin.wires.count(wire) for pin in consumer.pins)
        for consumer, wire in sorted(network.cut, key=lambda cut: (cut[0].place, cut[1].source.place)):
            self._add_memory(consumer, wire)

    # --- values ---

    def value_at(self, consumer: Object, pin: Pin) -> Value:
        """The value at a pin, with the pin's own negation and edge.  Raises Unexecutable."""
        if pin.storage:
            self.warn(consumer, f"storage at pin {pin.name or 'in'} has no effect")
        if pin.expression:
            value = self.expression(pin.expression)
        else:
            if len(pin.wires) > 1 and consumer.kind in ("block", "outVariable", "inOutVariable"):
                kinds = {kind for wire in pin.wires if (kind := self.scope.wire_type(wire)) not in ("", "BOOL")}
                if kinds:
                    raise Unexecutable(consumer, f"several wires of type {', '.join(sorted(kinds))} reach {pin.name or 'it'}",
                                       "only BOOL wires can be joined")
            value = either([self._value_of(consumer, wire) for wire in pin.wires])
        return self.modified(consumer, value, pin.negated, pin.edge)

    def modified(self, item: Object, value: Value, negated: bool, edge: str) -> Value:
        """A value behind a negation and an edge, of the inverse if both are there."""
        if negated:
            value = negation(value)
        if not edge:
            return value
        if negated and self.generates:
            self.warn(item, f"negated and {edge}: Beremiz and OpenPLC Editor leave the edge out")
            return value
        if negated:
            self.warn(item, f"negated and {edge}: it is read as the {edge} edge of the inverse")
        if edge not in ("rising", "falling"):
            raise Unexecutable(item, f"there is no edge {edge!r}", "")
        if self.scope.is_function:
            raise Unexecutable(item, "an edge needs memory, which a function does not have", "make it a function block")
        if edge == "falling" and not self.generates:
            return self._falling_edge(item, value)
        instance = self.scope.new(f"Edge_{item.id}", "F_TRIG" if edge == "falling" else "R_TRIG", True)
        self.write(f"{instance}(CLK := {value.text});", frozenset((instance.upper(),)))
        return Value(f"{instance}.Q", ATOM, frozenset((instance.upper(),)))

    def _falling_edge(self, item: Object, value: Value) -> Value:
        """The falling edge of a value.  F_TRIG is not used: it is TRUE in its first call too, where nothing has fallen yet."""
        before = self.scope.new(f"Was_{item.id}", "BOOL", True)
        fallen = self.scope.new(f"Edge_{item.id}", "BOOL", False)
        self.write(f"{fallen} := {before} AND {negation(value).at(UNARY)};", frozenset((fallen.upper(),)))
        self.write(f"{before} := {value.text};", frozenset((before.upper(),)))
        return variable(fallen)

    def expression(self, text: str) -> Value:
        return TRUE if text.upper() == "TRUE" else FALSE if text.upper() == "FALSE" else written(text, self.scope.roots(text))

    def _value_of(self, consumer: Object, wire: Wire) -> Value:
        """The value that a wire carries to a consumer."""
        item, key = wire.source, (wire.source, wire.pin)
        if item.kind == "leftPowerRail":
            return TRUE
        if (consumer, wire) in self.network.cut:
            return self._from_pass_before(wire)
        if item.kind == "inOutVariable" and self.reads_in_outs:
            return self.modified(item, self.expression(item.text), item.negated, item.edge)
        if key not in self.held and item.kind == "inVariable":
            self.set_output(wire, self.modified(item, self.expression(item.text), item.negated, item.edge))
        held = self.held.get(key)
        if held is None:
            raise Unexecutable(item, f"nothing can be taken from output {wire.pin or item.kind}", "")
        held.left -= 1
        if not held.left:
            del self.held[key]
        return held.value

    def is_used(self, wire: Wire) -> bool:
        """Whether something uses an output, in this pass or the next."""
        return self.uses[wire.source, wire.pin] > 0 or self.is_remembered(wire)

    def is_remembered(self, wire: Wire) -> bool:
        """Whether the value of an output is kept for the next pass in a variable."""
        return (wire.source, wire.pin) in self.memories

    def set_output(self, wire: Wire, value: Value, keep: bool = False) -> None:
        """Set the value of an output.  With `keep`, a value with several consumers goes to a variable, to be evaluated once."""
        uses = self.uses[wire.source, wire.pin]
        if not self.is_used(wire):
            return
        function = wire.source.kind == "block" and not wire.source.instance
        if (function and (self.network.rereads or (self.apart and self.generates))) or (
                keep and uses > 1 and value.level < ATOM and not self._is_reread(wire)):
            value = self.in_variable(wire, value)
        if memory := self.memories.get((wire.source, wire.pin)):
            self.write(f"{memory} := {value.text};", frozenset((memory.upper(),)))
            value = variable(memory)
        if uses > 0:
            self.held[wire.source, wire.pin] = Held(value, wire, uses)

    def in_variable(self, wire: Wire, value: Value) -> Value:
        """The value in a variable of its own; the value itself, with a warning, if its type is not known."""
        kind = self.scope.wire_type(wire)
        if not kind and not value.reads.isdisjoint(name.upper() for name in self.memories.values()):
            kind = self.sink_type(wire)  # later the loop has another value
        if not kind:
            if len(value.text) > LONGEST:
                raise Unexecutable(wire.source, "it is used in several places, and its type is not known",
                                   "lead it over a variable")
            self.warn(wire.source, "its type is not known, and it is worked out where it is used")
            return value
        name = self.scope.new(f"{'Power' if kind == 'BOOL' else 'Value'}_{wire.source.id}", kind, self.apart)
        self.lines.append(f"{name} := {value.text};")
        return variable(name)

    def write(self, statement: str, writes: frozenset[str]) -> None:
        """Write a statement that writes the variables `writes`; values that were read of them go to variables first."""
        self.save_values(writes)
        self.lines.append(statement)

    def save_values(self, writes: frozenset[str]) -> None:
        """Put values that were read of the variables `writes` into variables of their own."""
        for held in self.held.values():
            if held.value.reads & writes and not self._is_reread(held.wire):
                held.value = self.in_variable(held.wire, held.value)

    def _is_reread(self, wire: Wire) -> bool:
        """Whether each consumer of an output reads the variables that it depends on anew."""
        item = wire.source
        return self.network.rereads and (item.kind in ("contact", "inVariable", "inOutVariable") or bool(item.instance))

    def _add_memory(self, consumer: Object, wire: Wire) -> None:
        """Declare a variable for the value that a loop brings back from the pass before, unless an instance keeps that value."""
        item = wire.source
        if (item, wire.pin) in self.memories:
            return
        self.reading.report("X0290", consumer.element, "the wires make a loop: what comes back is the value of the pass before")
        if item.kind == "inOutVariable" or (item.instance and wire.pin.upper() != "ENO"):
            return
        kind = self.scope.wire_type(wire) or self.sink_type(wire)
        if self.scope.is_function or not kind:
            raise Unexecutable(consumer, "the wires make a loop, and nothing in it keeps a value",
                               "lead the wire over a variable")
        self.memories[item, wire.pin] = self.scope.new(f"Before_{item.id}", kind, True)

    def _from_pass_before(self, wire: Wire) -> Value:
        item = wire.source
        if memory := self.memories.get((item, wire.pin)):
            return variable(memory)
        text = f"{item.instance}.{wire.pin}" if item.kind == "block" else item.text
        return written(text, self.scope.roots(text))

    def sink_type(self, wire: Wire) -> str:
        """The type of a variable to which an output leads, also through functions whose result has the type of their operands;
        "" if it leads to none."""
        seen: set[Object] = set()
        todo = [wire]
        while todo:
            here = todo.pop(0)
            for item in self.network.objects:
                if item in seen or not any(here in pin.wires for pin in item.pins):
                    continue
                if item.kind != "block" and (found := self.scope.type_of(item.text)):
                    return found
                if item.kind == "block" and self.scope.has_type_of_operands(item):
                    seen.add(item)
                    outs = [Wire(item, pin.name) for pin in item.outputs if pin.name.upper() != "ENO"]
                    todo += outs
                    if found := next((kind for out in outs if (kind := self.scope.wire_type(out))), ""):
                        return found
        return ""

    def warn(self, item: Object, message: str) -> None:
        self.reading.report("X0292", item.element, message)

    def warn_unused(self, item: Object) -> None:
        """Report that nothing uses the value of an object."""
        self.reading.report("X0291", item.element, f"nothing comes of {item.text or item.kind}: it reaches no output")

    # --- variables that are written ---

    def target(self, item: Object) -> tuple[str, frozenset[str]]:
        if not item.text:
            raise Unexecutable(item, "it has no variable", "name one")
        root = self.scope.root(item.text)
        return self.scope.bit(item.text), frozenset((root, SHARED) if root == SHARED else (root,))

    def take_over(self, sink: Object, wire: Wire) -> str:
        """Let a call write the variable at `sink` itself; returns the root of the variable (`Scope.root`)."""
        self.done.add(sink)
        self.uses[wire.source, wire.pin] -= 1
        return self.scope.root(self.target(sink)[0])

    def assign(self, sink: Object, value: Value, condition: Value) -> None:
        """Assign `value` to the variable at `sink` under a condition, before its turn."""
        target, writes = self.target(sink)
        self.done.add(sink)
        self.write(when(condition, f"{target} := {value.text};"), writes)


def when(condition: Value, statement: str) -> str:
    """A statement that is executed under a condition."""
    if condition.is_true:
        return statement
    return f"IF {condition.text} THEN {statement} END_IF;"
