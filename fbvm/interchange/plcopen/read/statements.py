"""A network as statements of Structured Text, in the order of its evaluation.

Each object is evaluated once a pass.  Its value is written where it is used, unless it is used several times or
something that it reads is written in between: then it is kept in a variable.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from fbvm.interchange.plcopen.read.calls import Calls
from fbvm.interchange.plcopen.read.diagram import Object, Pin, Wire
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.read.networks import Network
from fbvm.interchange.plcopen.read.scope import SHARED, Scope
from fbvm.interchange.plcopen.read.values import ATOM, FALSE, TRUE, UNARY, Unexecutable, Value, both, either, negation, written

LONGEST = 500
"""Characters of the longest expression that is written several times."""
Key = tuple[Object, str]
"""An object and the name of its output."""


@dataclass
class Held:
    """A value on its way to `left` consumers."""

    value: Value
    wire: Wire
    left: int


class Statements:
    """Writes the networks of one body; what they need is declared in the scope."""

    def __init__(self, reading: Reading, scope: Scope) -> None:
        self.reading, self.scope = reading, scope
        self.calls = Calls(self)
        self.lines: list[str] = []
        self.held: dict[Key, Held] = {}
        self.uses: Counter[Key] = Counter()
        self.network: Network

    def write(self, network: Network) -> list[str]:
        """The statements of a network.  Raises Unexecutable."""
        if network.refused:
            raise Unexecutable(network.objects[0], network.refused, "draw it in parts")
        self.lines, self.held, self.network = [], {}, network
        self.memories: dict[Key, str] = {}
        self.uses = Counter((wire.source, wire.pin) for item in network.objects for pin in item.pins for wire in pin.wires)
        for consumer, wire in network.cut:
            self.uses[wire.source, wire.pin] -= 1
            self._remember(consumer, wire)
        self.done: set[Object] = set()
        for item in network.objects:
            if item in self.done:
                continue
            _WRITERS.get(item.kind, Statements._strange)(self, item)
        for item in network.objects:
            if item.kind in ("jump", "return"):
                self._leave(item)
        return self.lines

    # --- values ---

    def take(self, consumer: Object, pin: Pin) -> Value:
        """What reaches a pin, with the pin's own negation and edge."""
        if pin.storage:
            self.doubt(consumer, f"storage at pin {pin.name or 'in'} has no effect")
        if pin.expression:
            value = self.expression(pin.expression)
        else:
            if len(pin.wires) > 1 and consumer.kind in ("block", "outVariable", "inOutVariable"):
                kinds = {kind for wire in pin.wires if (kind := self.scope.wire_type(wire)) not in ("", "BOOL")}
                if kinds:
                    raise Unexecutable(consumer, f"several wires of type {', '.join(sorted(kinds))} reach {pin.name or 'it'}",
                                       "only BOOL wires can be joined")
            value = either([self._carried(consumer, wire) for wire in pin.wires])
        return self.changed(consumer, value, pin.negated, pin.edge)

    def changed(self, item: Object, value: Value, negated: bool, edge: str) -> Value:
        """A value behind a negation and an edge, of the inverse if both are there."""
        if negated:
            value = negation(value)
        if not edge:
            return value
        if negated:
            self.doubt(item, f"negated and {edge}: it is read as the {edge} edge of the inverse")
        if edge not in ("rising", "falling"):
            raise Unexecutable(item, f"there is no edge {edge!r}", "")
        if self.scope.is_function:
            raise Unexecutable(item, "an edge needs memory, which a function does not have", "make it a function block")
        if edge == "falling":
            return self._fallen(item, value)
        instance = self.scope.new(f"Edge_{item.id}", "R_TRIG", True)
        self.effect(f"{instance}(CLK := {value.text});", frozenset((instance.upper(),)))
        return Value(f"{instance}.Q", ATOM, frozenset((instance.upper(),)))

    def _fallen(self, item: Object, value: Value) -> Value:
        """The falling edge; F_TRIG of the standard has one in its first call too, where nothing has fallen yet."""
        before = self.scope.new(f"Was_{item.id}", "BOOL", True)
        fallen = self.scope.new(f"Edge_{item.id}", "BOOL", False)
        self.effect(f"{fallen} := {before} AND {negation(value).at(UNARY)};", frozenset((fallen.upper(),)))
        self.effect(f"{before} := {value.text};", frozenset((before.upper(),)))
        return Value(fallen, ATOM, frozenset((fallen.upper(),)))

    def expression(self, text: str) -> Value:
        return TRUE if text.upper() == "TRUE" else FALSE if text.upper() == "FALSE" else written(text, self.scope.roots(text))

    def _carried(self, consumer: Object, wire: Wire) -> Value:
        """What a wire brings."""
        item, key = wire.source, (wire.source, wire.pin)
        if item.kind == "leftPowerRail":
            return TRUE
        if (consumer, wire) in self.network.cut:
            return self._before(wire)
        if key not in self.held and item.kind == "inVariable":
            self.give(wire, self.changed(item, self.expression(item.text), item.negated, item.edge))
        held = self.held.get(key)
        if held is None:
            raise Unexecutable(item, f"nothing can be taken from output {wire.pin or item.kind}", "")
        held.left -= 1
        if not held.left:
            del self.held[key]
        return held.value

    def needed(self, wire: Wire) -> bool:
        """Whether somebody uses an output, in this pass or the next."""
        return self.uses[wire.source, wire.pin] > 0 or (wire.source, wire.pin) in self.memories

    def give(self, wire: Wire, value: Value, keep: bool = False) -> None:
        """Say what an output carries from now on.  `keep` one that must not be worked out twice."""
        uses = self.uses[wire.source, wire.pin]
        if not self.needed(wire):
            return
        if keep and uses > 1 and value.level < ATOM:
            value = self.kept(wire, value)
        if memory := self.memories.get((wire.source, wire.pin)):
            self.lines.append(f"{memory} := {value.text};")
            value = Value(memory, ATOM, frozenset((memory.upper(),)))
        if uses > 0:
            self.held[wire.source, wire.pin] = Held(value, wire, uses)

    def kept(self, wire: Wire, value: Value) -> Value:
        """The same value in a variable; as it is if nobody knows its type."""
        kind = self.scope.wire_type(wire)
        if not kind:
            if len(value.text) > LONGEST:
                raise Unexecutable(wire.source, "it is used in several places, and its type is not known",
                                   "lead it over a variable")
            self.doubt(wire.source, "its type is not known, and it is worked out where it is used")
            return value
        name = self.scope.new(f"{'Power' if kind == 'BOOL' else 'Value'}_{wire.source.id}", kind, False)
        self.lines.append(f"{name} := {value.text};")
        return Value(name, ATOM, frozenset((name.upper(),)))

    def effect(self, statement: str, writes: frozenset[str]) -> None:
        """A statement that writes variables: what was read before them is kept first."""
        self.settle(writes)
        self.lines.append(statement)

    def settle(self, writes: frozenset[str]) -> None:
        """Keep what was read of variables that are about to be written."""
        for held in self.held.values():
            if held.value.reads & writes:
                held.value = self.kept(held.wire, held.value)

    def _remember(self, consumer: Object, wire: Wire) -> None:
        """See to the value of the pass before, which a loop needs."""
        item = wire.source
        self.reading.report("X0290", consumer.element, "the wires make a loop: what comes back is the value of the pass before")
        if item.kind == "inOutVariable" or (item.instance and wire.pin.upper() != "ENO") or (item, wire.pin) in self.memories:
            return
        kind = self.scope.wire_type(wire)
        if self.scope.is_function or not kind:
            raise Unexecutable(consumer, "the wires make a loop, and nothing in it keeps a value",
                               "lead the wire over a variable")
        self.memories[item, wire.pin] = self.scope.new(f"Before_{item.id}", kind, True)

    def _before(self, wire: Wire) -> Value:
        item = wire.source
        if memory := self.memories.get((item, wire.pin)):
            return Value(memory, ATOM, frozenset((memory.upper(),)))
        text = f"{item.instance}.{wire.pin}" if item.kind == "block" else item.text
        return written(text, self.scope.roots(text))

    def doubt(self, item: Object, message: str) -> None:
        self.reading.report("X0292", item.element, message)

    def idle(self, item: Object) -> None:
        """Say that nobody uses what an object gives."""
        self.reading.report("X0291", item.element, f"nothing comes of {item.text or item.kind}: it reaches no output")

    # --- objects ---

    def _contact(self, item: Object) -> None:
        wire = Wire(item, "")
        if not self.needed(wire):
            self.idle(item)
            return
        if not item.inputs[0].wires:
            self.doubt(item, f"contact {item.text} is not connected on its left, and lets no power through")
        power = self.take(item, item.inputs[0])
        state = self.changed(item, self.expression(self.scope.bit(item.text)), item.negated, item.edge)
        self.give(wire, both(power, state), keep=True)

    def _in_variable(self, item: Object) -> None:
        if self.uses[item, ""] < 1:
            self.idle(item)

    def _target(self, item: Object) -> tuple[str, frozenset[str]]:
        if not item.text:
            raise Unexecutable(item, "it has no variable", "name one")
        root = self.scope.root(item.text)
        return self.scope.bit(item.text), frozenset((root, SHARED) if root == SHARED else (root,))

    def _sink(self, item: Object) -> None:
        """A coil or an output variable."""
        pin = item.inputs[0]
        if not pin.connected:
            self.doubt(item, f"{item.text} is not connected, and is not written")
            return
        target, writes = self._target(item)
        guard = self.calls.guard(pin)
        value = self.changed(item, self.take(item, pin), item.negated, item.edge)
        if item.storage in ("set", "reset"):
            self.effect(_when(value, f"{target} := {'TRUE' if item.storage == 'set' else 'FALSE'};"), writes)
        elif item.storage:
            raise Unexecutable(item, f"there is no storage {item.storage!r}", "")
        elif guard:
            self.effect(_when(guard, f"{target} := {value.text};"), writes)
        else:
            self.effect(f"{target} := {value.text};", writes)

    def drop(self, sink: Object, wire: Wire) -> str:
        """Take a variable out of the order that gets its value otherwise, and say what memory it is."""
        self.done.add(sink)
        self.uses[wire.source, wire.pin] -= 1
        return self.scope.root(self._target(sink)[0])

    def assign(self, sink: Object, value: Value, condition: Value) -> None:
        """Write a variable under a condition, before its turn."""
        target, writes = self._target(sink)
        self.done.add(sink)
        self.effect(_when(condition, f"{target} := {value.text};"), writes)

    def _condition(self, item: Object) -> None:
        """The condition of a transition, by the name in its text."""
        value = self.take(item, item.inputs[0])
        self.lines.append(f"{item.text} := {(negation(value) if item.negated else value).text};")

    def _in_out_variable(self, item: Object) -> None:
        if item.inputs[0].connected:
            target, writes = self._target(item)
            self.effect(f"{target} := {self.take(item, item.inputs[0]).text};", writes)
        self.give(Wire(item, ""), self.changed(item, self.expression(item.text), item.negated, item.edge))

    def _label(self, item: Object) -> None:
        self.lines.insert(0, f"{item.text}:")

    def _power(self, item: Object) -> None:
        """Take what reaches a jump where the jump stands; it is done at the end of the network."""
        key = item, "jump"
        value = negation(self.take(item, item.inputs[0])) if item.negated else self.take(item, item.inputs[0])
        self.uses[key] = 1
        self.held[key] = Held(value, Wire(item, "jump"), 1)

    def _leave(self, item: Object) -> None:
        if item.kind == "jump" and not item.text:
            raise Unexecutable(item, "the jump names no label", "")
        self.lines.append(_when(self.held.pop((item, "jump")).value, f"JMP {item.text};" if item.kind == "jump" else "RETURN;"))

    def _block(self, item: Object) -> None:
        self.calls.write(item)

    def _strange(self, item: Object) -> None:
        raise Unexecutable(item, f"nobody knows what <{item.kind}>{f' {item.text!r}' if item.text else ''} does", "")


def _when(condition: Value, statement: str) -> str:
    """A statement under a condition."""
    if condition.is_true:
        return statement
    return f"IF {condition.text} THEN {statement} END_IF;"


_WRITERS = {"contact": Statements._contact, "coil": Statements._sink, "outVariable": Statements._sink,
            "inOutVariable": Statements._in_out_variable, "inVariable": Statements._in_variable, "label": Statements._label,
            "jump": Statements._power, "return": Statements._power, "block": Statements._block,
            "condition": Statements._condition}
