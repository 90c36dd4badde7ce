"""Blocks of a network as calls: operators, functions, and instances of function blocks, with EN and ENO."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.check.calls.functions import is_standard
from fbvm.interchange.plcopen.read.diagram import Object, Pin, Wire
from fbvm.interchange.plcopen.read.rung_parts import instruction
from fbvm.interchange.plcopen.read.scope import SHARED
from fbvm.interchange.plcopen.read.values import ATOM, CHAINED, INFIX, TRUE, Unexecutable, Value, joined, negation

if TYPE_CHECKING:
    from fbvm.interchange.plcopen.read.statements import Statements


class Calls:
    """Writes calls into the statements of a network."""

    def __init__(self, statements: Statements) -> None:
        self.statements = statements
        self.guards: dict[tuple[Object, str], Value] = {}
        """Conditions under which results may be assigned: those of functions whose EN is connected."""
        self.reads: frozenset[str] = frozenset()
        """What the arguments of the call at work read."""

    def write(self, item: Object) -> None:
        """The call of a block."""
        self.reads = frozenset()
        row = instruction(item)
        if row is not None and row.kind != "?" and row.does != ".not":
            raise Unexecutable(item, f"the instruction {item.mnemonic} cannot stand outside of a rung", "")
        if item.instance:
            self._instance(item)
        elif is_standard(item.text.upper()) and not item.in_outs:
            self._standard(item)
        else:
            self._function(item)

    def guard(self, pin: Pin) -> Value | None:
        """The condition under which what reaches a pin is to be assigned; None if always."""
        if len(pin.wires) != 1:
            return None
        return self.guards.get((pin.wires[0].source, pin.wires[0].pin))

    # --- function blocks ---

    def _instance(self, item: Object) -> None:
        statements = self.statements
        arguments = self._arguments(item, [pin for pin in item.inputs if pin.connected])
        root = statements.scope.root(item.instance)
        writes = {root, SHARED, *(statements.scope.root(text) for text in self._in_outs(item, arguments))}
        enabled = any(text.startswith("EN :=") for text in arguments)
        if enabled:
            for sink, wire in self._next_sinks(item):
                arguments.append(f"{wire.pin} => {sink.text}")
                writes.add(statements.drop(sink, wire))
        held = enabled and any(statements.uses[item, pin.name] for pin in item.outputs if pin.name.upper() != "ENO")
        eno = self._eno(item, arguments, held)
        if eno:
            statements.effect(f"{eno.text} := FALSE;", eno.reads)
        statements.effect(f"{item.instance}({', '.join(arguments)});", frozenset(writes))
        for pin in item.outputs:
            wire = Wire(item, pin.name)
            if pin.name.upper() == "ENO":
                statements.give(wire, eno or TRUE)
            else:
                if eno and enabled:
                    self.guards[item, pin.name] = eno
                value = Value(f"{item.instance}.{pin.name}", ATOM, frozenset((root,)))
                statements.give(wire, statements.changed(item, value, pin.negated, pin.edge))

    def _next_sinks(self, item: Object) -> list[tuple[Object, Wire]]:
        """The plain variables that get outputs of a block, if they are the next in the order."""
        objects = self.statements.network.objects
        found = []
        for other in objects[objects.index(item) + 1:]:
            wires = other.inputs[0].wires if other.kind == "outVariable" else []
            if len(wires) == 1 and wires[0].source is item and not (other.negated or other.edge or other.storage):
                if wires[0].pin.upper() == "ENO" or any(pin.name == wires[0].pin for pin in item.in_outs):
                    break
                found.append((other, wires[0]))
            elif other.kind != "inVariable":
                break
        return found

    def _eno(self, item: Object, arguments: list[str], wanted: bool = False) -> Value | None:
        """A variable for ENO, if somebody uses it."""
        statements = self.statements
        if not statements.uses[item, "ENO"] and not wanted:
            return None
        name = statements.scope.new(f"Enabled_{item.id}", "BOOL", False)
        arguments.append(f"ENO => {name}")
        return Value(name, ATOM, frozenset((name.upper(),)))

    def _arguments(self, item: Object, pins: list[Pin]) -> list[str]:
        """Inputs by name; an EN that is always TRUE is left out."""
        arguments = []
        for pin in pins:
            value = self.statements.take(item, pin)
            self.reads |= value.reads
            if pin.name.upper() != "EN" or not value.is_true:
                arguments.append(f"{pin.name} := {value.text}")
        return arguments

    def _in_outs(self, item: Object, arguments: list[str]) -> list[str]:
        """Add what is connected to in-outs, and say what it is."""
        names = []
        for pin in item.in_outs:
            texts = [pin.expression] if pin.expression else [wire.source.text for wire in pin.wires
                                                            if wire.source.kind in ("inVariable", "inOutVariable")]
            through = [wire for wire in pin.wires if wire.source.kind == "block"]
            if through and len(pin.wires) == 1:
                texts = [self.statements.take(item, pin).text]
            if len(texts) != 1:
                raise Unexecutable(item, f"in-out {pin.name} of {item.text} must be connected to one variable", "")
            if not through and not pin.expression:
                self.statements.take(item, pin)
            names += texts
            arguments.append(f"{pin.name} := {texts[0]}")
            self.statements.give(Wire(item, pin.name), self.statements.expression(texts[0]))
        return names

    # --- functions ---

    def _standard(self, item: Object) -> None:
        """A function of the standard: an expression."""
        statements = self.statements
        result = next((pin for pin in item.outputs if pin.name.upper() != "ENO"), None)
        wire = Wire(item, result.name if result else "")
        if not statements.needed(wire) and not statements.uses[item, "ENO"]:
            statements.idle(item)
            for pin in item.inputs:
                statements.take(item, pin)
            return
        condition = self._enable(item)
        pins = [pin for pin in item.inputs if pin.name.upper() != "EN"]
        while pins and not pins[-1].connected and len(pins) > 2:
            pins.pop()
        if loose := [pin.name or "an input" for pin in pins if not pin.connected]:
            raise Unexecutable(item, f"{', '.join(loose)} of {item.text} is not connected", "a function needs all its inputs")
        value = self._called(item.text, [statements.take(item, pin) for pin in pins])
        if result is not None:
            value = statements.changed(item, value, result.negated, result.edge)
        if condition is None:
            statements.give(Wire(item, "ENO"), TRUE)
            statements.give(wire, value, keep=True)
        else:
            self._guarded(item, wire, condition, value)

    def _called(self, name: str, values: list[Value]) -> Value:
        folded = name.upper()
        if folded == "NOT" and len(values) == 1:
            return negation(values[0])
        if folded in ("MOVE",) and len(values) == 1:
            return values[0]
        if folded in INFIX and (len(values) == 2 or len(values) > 2 and folded in CHAINED):
            return joined(folded, values)
        reads = frozenset().union(*(value.reads for value in values))
        return Value(f"{name}({', '.join(value.text for value in values)})", ATOM - 1, reads)

    def _enable(self, item: Object) -> Value | None:
        """What reaches EN; None if nothing does, or always TRUE."""
        pin = item.pin("EN")
        if pin is None or not pin.connected:
            return None
        value = self.statements.take(item, pin)
        return None if value.is_true else value

    def _guarded(self, item: Object, wire: Wire, condition: Value, value: Value) -> None:
        """A result that is worked out only while EN is ON, and otherwise stays what it was."""
        statements, scope = self.statements, self.statements.scope
        sinks = [(sink, pin) for sink in statements.network.objects for pin in sink.pins if pin.wires == [wire]]
        if (sink := self._next_sink(item, wire)) is not None:
            statements.assign(sink, value, condition)
        elif statements.uses[wire.source, wire.pin]:
            eno = scope.new(f"Enabled_{item.id}", "BOOL", False)
            enabled = Value(eno, ATOM, frozenset((eno.upper(),)))
            name = self._result(item, wire, sinks)
            statements.effect(f"{eno} := {condition.text};", enabled.reads)
            statements.effect(f"IF {eno} THEN {name} := {value.text}; END_IF;", frozenset((name.upper(),)))
            self.guards[item, wire.pin] = enabled
            statements.give(wire, Value(name, ATOM, frozenset((name.upper(),))))
            statements.give(Wire(item, "ENO"), enabled)
        else:
            statements.give(Wire(item, "ENO"), condition, keep=True)

    def _next_sink(self, item: Object, wire: Wire) -> Object | None:
        """The variable that gets a result, if it is the only one who does, and the next in the order."""
        if self.statements.uses[item, wire.pin] != 1 or self.statements.uses[item, "ENO"]:
            return None
        return next((sink for sink, found in self._next_sinks(item) if found == wire), None)

    def _result(self, item: Object, wire: Wire, sinks: list[tuple[Object, Pin]]) -> str:
        """A variable that keeps a result from pass to pass."""
        scope = self.statements.scope
        kind = scope.wire_type(wire) or next((found for sink, _ in sinks if sink.kind != "block"
                                              and (found := scope.type_of(sink.text))), "")
        if not kind:
            raise Unexecutable(item, f"the type of the result of {item.text} is not known", "lead it to a variable")
        return scope.new(f"Result_{item.id}", kind, True)

    def _function(self, item: Object) -> None:
        """A function of the project or a library, which may write more than its result."""
        statements, scope = self.statements, self.statements.scope
        condition = self._enable(item)
        arguments = self._arguments(item, [pin for pin in item.inputs if pin.connected and pin.name.upper() != "EN"])
        writes = {SHARED, *(scope.root(text) for text in self._in_outs(item, arguments))}
        known = scope.pous.get(item.text.upper())
        result = next((pin for pin in item.outputs
                       if pin.name.upper() != "ENO" and not (known and known.variable(pin.name))), None)
        for pin in item.outputs:
            if pin is not result and pin.name.upper() != "ENO" and statements.uses[item, pin.name]:
                name = scope.new(f"{pin.name}_{item.id}", scope.wire_type(Wire(item, pin.name)) or "BOOL", condition is not None)
                arguments.append(f"{pin.name} => {name}")
                statements.give(Wire(item, pin.name), Value(name, ATOM, frozenset((name.upper(),))))
        wire = Wire(item, result.name if result else "")
        if condition is None and not statements.uses[item, "ENO"] and not any("=>" in text for text in arguments) \
                and not item.in_outs and statements.uses[item, wire.pin] == 1 and result and not result.edge:
            statements.settle(frozenset((SHARED,)))
            value = Value(f"{item.text}({', '.join(arguments)})", ATOM - 1, self.reads | {SHARED})
            statements.give(wire, negation(value) if result.negated else value)
            return
        self._as_statement(item, wire if statements.uses[item, wire.pin] else None, condition, arguments, frozenset(writes))

    def _as_statement(self, item: Object, wire: Wire | None, condition: Value | None, arguments: list[str],
                      writes: frozenset[str]) -> None:
        statements = self.statements
        eno = self._eno(item, arguments)
        target = ""
        if wire is not None:
            sinks = [(sink, pin) for sink in statements.network.objects for pin in sink.pins if pin.wires == [wire]]
            target = self._result(item, wire, sinks)
            writes |= {target.upper()}
        call = f"{f'{target} := ' if target else ''}{item.text}({', '.join(arguments)});"
        if eno:
            statements.effect(f"{eno.text} := FALSE;", eno.reads)
        if condition is not None:
            enabled = statements.scope.new(f"Enable_{item.id}", "BOOL", False)
            statements.effect(f"{enabled} := {condition.text};", frozenset((enabled.upper(),)))
            if wire is not None:
                self.guards[item, wire.pin] = Value(enabled, ATOM, frozenset((enabled.upper(),)))
            call = f"IF {enabled} THEN {call} END_IF;"
        statements.effect(call, writes)
        if eno:
            statements.give(Wire(item, "ENO"), eno)
        if wire is not None:
            statements.give(wire, Value(target, ATOM, frozenset((target.upper(),))))
