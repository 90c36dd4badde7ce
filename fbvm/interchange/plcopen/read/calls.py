"""Blocks of a network as calls: operators, functions, and instances of function blocks, with EN and ENO."""

from __future__ import annotations

from textwrap import dedent

from fbvm.check.calls.functions import is_standard
from fbvm.interchange.plcopen.read.context import NetworkContext
from fbvm.interchange.plcopen.read.diagram import Object, Pin, Wire
from fbvm.interchange.plcopen.read.rung_parts import instruction
from fbvm.interchange.plcopen.read.scope import SHARED
from fbvm.interchange.plcopen.read.values import (
    ATOM,
    CALL,
    CHAINED,
    EXTENSIBLE,
    INFIX,
    TRUE,
    Unexecutable,
    Value,
    joined,
    negation,
    variable,
)


class Calls:
    """Writes the calls of a network's blocks into its context."""

    def __init__(self, context: NetworkContext) -> None:
        self.context = context
        self.guards: dict[tuple[Object, str], Value] = {}
        """By output of a block whose EN is connected, the condition under which its value may be assigned."""
        self.reads: frozenset[str] = frozenset()
        """Roots of the variables that the arguments of the call at work read."""

    def write(self, item: Object) -> None:
        """The call of a block."""
        self.reads = frozenset()
        row = instruction(item)
        if row is not None and row.kind != "?" and row.does != ".not":
            raise Unexecutable(item, f"the instruction {item.mnemonic} cannot stand outside of a rung", "")
        if item.code:
            self._statements(item)
        elif item.instance:
            self._instance(item)
        elif is_standard(item.text.upper()) and not item.in_outs:
            self._standard(item)
        else:
            self._function(item)

    def guard(self, pin: Pin) -> Value | None:
        """The condition under which the value at a pin may be assigned; None if always.  A block behind a coil or a connector has
        none (`GetUsedEno` of Beremiz)."""
        if len(pin.wires) != 1 or [number for number, _, _ in pin.raw] != [pin.wires[0].source.id]:
            return None
        return self.guards.get((pin.wires[0].source, pin.wires[0].pin))

    # --- function blocks ---

    def _instance(self, item: Object) -> None:
        context = self.context
        arguments = self._arguments(item, [pin for pin in item.inputs if pin.connected])
        root = context.scope.root(item.instance)
        in_outs = self._in_outs(item, arguments)
        writes = {root, SHARED, *map(context.scope.root, in_outs)}
        enabled = any(text.upper().startswith("EN :=") for text in arguments)
        if enabled:
            for sink, wire in self._next_sinks(item):
                arguments.append(f"{wire.pin} => {sink.text}")
                writes.add(context.take_over(sink, wire))
        held = enabled and any(context.uses[item, pin.name] for pin in item.outputs if pin.name.upper() != "ENO")
        eno = self._eno(item, arguments, held)
        if eno:
            context.write(f"{eno.text} := FALSE;", eno.reads)
        context.write(f"{item.instance}({', '.join(arguments)});", frozenset(writes))
        self._lead_on(item, in_outs)
        for pin in item.outputs:
            wire = Wire(item, pin.name)
            if pin.name.upper() == "ENO":
                self._set_eno(item, eno or TRUE, guards=enabled)
            else:
                if eno and enabled:
                    self.guards[item, pin.name] = eno
                value = Value(f"{item.instance}.{pin.name}", ATOM, frozenset((root,)))
                context.set_output(wire, context.modified(item, value, pin.negated, pin.edge))

    def _statements(self, item: Object) -> None:
        """The statements inside of a block EXECUTE, while its EN is TRUE."""
        context = self.context
        condition = self._enable(item)
        eno = TRUE
        lines = dedent(item.code).splitlines()
        if condition is not None:
            enabled = context.scope.new(f"Enable_{item.id}", "BOOL", context.apart)
            context.write(f"{enabled} := {condition.text};", frozenset((enabled.upper(),)))
            eno = variable(enabled)
            lines = [f"IF {enabled} THEN", *lines, "END_IF;"]
        first, *more = lines
        context.write(first, frozenset((SHARED, *context.scope.roots(item.code))))
        context.lines += more
        context.set_output(Wire(item, "ENO"), eno)

    def _next_sinks(self, item: Object) -> list[tuple[Object, Wire]]:
        """The output variables that a call can write itself, one for each output: those that directly follow the block in the
        order of evaluation."""
        objects = self.context.network.objects
        found: list[tuple[Object, Wire]] = []
        for other in objects[objects.index(item) + 1:]:
            wires = other.inputs[0].wires if other.kind == "outVariable" else []
            if len(wires) == 1 and wires[0].source is item and not (other.negated or other.edge or other.storage):
                if wires[0].pin.upper() == "ENO" or any(pin.name == wires[0].pin for pin in item.in_outs) \
                        or any(wires[0] == wire for _, wire in found):
                    break
                found.append((other, wires[0]))
            elif other.kind != "inVariable":
                break
        return found

    def _eno(self, item: Object, arguments: list[str], wanted: bool = False) -> Value | None:
        """A variable for ENO, if ENO is used or `wanted`; added to the arguments of the call."""
        context = self.context
        if not context.is_used(Wire(item, "ENO")) and not wanted:
            return None
        name = context.scope.new(f"Enabled_{item.id}", "BOOL", context.apart)
        arguments.append(f"ENO => {name}")
        return variable(name)

    def _arguments(self, item: Object, pins: list[Pin]) -> list[str]:
        """The arguments for input pins, by name; an EN that is always TRUE is left out."""
        arguments = []
        for pin in pins:
            value = self.context.value_at(item, pin)
            self.reads |= value.reads
            if pin.name.upper() != "EN" or not value.is_true:
                arguments.append(f"{pin.name} := {value.text}")
        return arguments

    def _in_outs(self, item: Object, arguments: list[str]) -> list[str]:
        """Add the arguments for in-outs; returns the variables that are connected to them."""
        names = []
        for pin in item.in_outs:
            texts = [pin.expression] if pin.expression else [wire.source.text for wire in pin.wires
                                                            if wire.source.kind in ("inVariable", "inOutVariable")]
            through = [wire for wire in pin.wires if wire.source.kind == "block"]
            if through and len(pin.wires) == 1:
                texts = [self.context.value_at(item, pin).text]
            if len(texts) != 1:
                raise Unexecutable(item, f"in-out {pin.name} of {item.text} must be connected to one variable", "")
            if not through and not pin.expression:
                self.context.value_at(item, pin)
            names += texts
            arguments.append(f"{pin.name} := {texts[0]}")
        return names

    def _lead_on(self, item: Object, in_outs: list[str]) -> None:
        """Behind a call, lead the variables at its in-outs on to what is wired to their right."""
        for pin, text in zip(item.in_outs, in_outs, strict=True):
            self.context.set_output(Wire(item, pin.name), self.context.expression(text))

    # --- functions ---

    def _standard(self, item: Object) -> None:
        """A function of the standard: an expression."""
        context = self.context
        result = next((pin for pin in item.outputs if pin.name.upper() != "ENO"), None)
        wire = Wire(item, result.name if result else "")
        if not context.is_used(wire) and not context.is_used(Wire(item, "ENO")):
            context.warn_unused(item)
            for pin in item.inputs:
                context.value_at(item, pin)
            return
        condition = self._enable(item)
        pins = [pin for pin in item.inputs if pin.name.upper() != "EN"]
        while pins and not pins[-1].connected and len(pins) > 2:
            pins.pop()
        pins = self._without_loose(item, pins)
        if loose := [pin.name or "an input" for pin in pins if not pin.connected]:
            raise Unexecutable(item, f"{', '.join(loose)} of {item.text} is not connected", "a function needs all its inputs")
        value = self._called(item.text, [context.value_at(item, pin) for pin in pins])
        if result is not None:
            value = context.modified(item, value, result.negated, result.edge)
        if condition is None:
            context.set_output(Wire(item, "ENO"), TRUE)
            context.set_output(wire, value, keep=True)
        else:
            self._guarded(item, wire, condition, value)

    def _without_loose(self, item: Object, pins: list[Pin]) -> list[Pin]:
        """The inputs that Beremiz and OpenPLC Editor pass on: they leave out those that nothing is wired to."""
        wired = [pin for pin in pins if pin.connected]
        if not self.context.generates or len(wired) < 2 or len(wired) == len(pins) or item.text.upper() not in EXTENSIBLE:
            return pins
        self.context.warn(item, f"{item.text} has inputs that nothing is wired to: Beremiz and OpenPLC Editor leave them out")
        return wired

    def _called(self, name: str, values: list[Value]) -> Value:
        folded = name.upper()
        if folded == "NOT" and len(values) == 1:
            return negation(values[0])
        if folded in ("MOVE",) and len(values) == 1:
            return values[0]
        if folded in INFIX and (len(values) == 2 or len(values) > 2 and folded in CHAINED):
            return joined(folded, values)
        reads = frozenset().union(*(value.reads for value in values))
        return Value(f"{name}({', '.join(value.text for value in values)})", CALL, reads)

    def _enable(self, item: Object) -> Value | None:
        """The value at EN; None if EN is not connected or always TRUE."""
        pin = item.pin("EN")
        if pin is None or not pin.connected:
            return None
        value = self.context.value_at(item, pin)
        return None if value.is_true else value

    def _guarded(self, item: Object, wire: Wire, condition: Value, value: Value) -> None:
        """Set a result that is evaluated while `condition` is TRUE, and otherwise keeps its value."""
        context, scope = self.context, self.context.scope
        if (sink := self._next_sink(item, wire)) is not None:
            context.assign(sink, value, condition)
        elif context.is_used(wire):
            eno = scope.new(f"Enabled_{item.id}", "BOOL", context.apart)
            enabled = variable(eno)
            name = self._result(item, wire)
            context.write(f"{eno} := {condition.text};", enabled.reads)
            context.write(f"IF {eno} THEN {name} := {value.text}; END_IF;", frozenset((name.upper(),)))
            self.guards[item, wire.pin] = enabled
            context.set_output(wire, variable(name))
            self._set_eno(item, enabled, guards=True)
        elif context.generates and context.uses[item, "ENO"]:
            eno = scope.new(f"Enabled_{item.id}", "BOOL", context.apart)
            context.write(f"{eno} := {condition.text};", frozenset((eno.upper(),)))
            self._set_eno(item, variable(eno), guards=True)
        else:
            context.set_output(Wire(item, "ENO"), condition, keep=True)

    def _set_eno(self, item: Object, eno: Value, guards: bool) -> None:
        """Set the value at ENO.  With `guards` the block has an EN: a generator then writes a variable at ENO while ENO is TRUE,
        as it does with those at other outputs."""
        if guards and self.context.generates:
            self.guards[item, "ENO"] = eno
        self.context.set_output(Wire(item, "ENO"), eno)

    def _next_sink(self, item: Object, wire: Wire) -> Object | None:
        """The output variable of a result, if it is the only consumer and directly follows in the order of evaluation."""
        if self.context.uses[item, wire.pin] != 1 or self.context.is_used(Wire(item, "ENO")) or self.context.is_remembered(wire):
            return None
        return next((sink for sink, found in self._next_sinks(item) if found == wire), None)

    def _result(self, item: Object, wire: Wire) -> str:
        """The name of a new variable that keeps a result from pass to pass; in text of a generator it has the first value of its
        type in each pass in which EN is FALSE, as functions of matiec give it then."""
        scope = self.context.scope
        kind = scope.wire_type(wire) or self.context.sink_type(wire)
        if not kind:
            raise Unexecutable(item, f"the type of the result of {item.text} is not known", "lead it to a variable")
        return scope.new(f"Result_{item.id}", kind, not self.context.generates)

    def _function(self, item: Object) -> None:
        """A function of the project or of a library, which may write more than its result."""
        context = self.context
        condition = self._enable(item)
        arguments = self._arguments(item, [pin for pin in item.inputs if pin.connected and pin.name.upper() != "EN"])
        in_outs = self._in_outs(item, arguments)
        writes = {SHARED, *map(context.scope.root, in_outs)}
        result = self._result_pin(item)
        self._take_outputs(item, result, arguments, keeps=condition is not None)
        wire = Wire(item, result.name if result else "")
        if condition is None and result is not None and self._is_expression(item, result, arguments):
            context.save_values(frozenset((SHARED,)))
            value = Value(f"{item.text}({', '.join(arguments)})", CALL, self.reads | {SHARED})
            context.set_output(wire, negation(value) if result.negated else value)
            return
        self._as_statement(item, wire if context.is_used(wire) else None, condition, arguments, frozenset(writes))
        self._lead_on(item, in_outs)

    def _result_pin(self, item: Object) -> Pin | None:
        """The output of a function that is its result: the first one that is neither ENO nor a VAR_OUTPUT."""
        known = self.context.scope.pous.get(item.text.upper())
        return next((pin for pin in item.outputs
                     if pin.name.upper() != "ENO" and not (known and known.variable(pin.name))), None)

    def _take_outputs(self, item: Object, result: Pin | None, arguments: list[str], keeps: bool) -> None:
        """Lead every VAR_OUTPUT of a function that is used to a variable; one that `keeps` its value if the call is not
        executed."""
        context = self.context
        for pin in item.outputs:
            wire = Wire(item, pin.name)
            if pin is not result and pin.name.upper() != "ENO" and context.is_used(wire):
                name = context.scope.new(f"{pin.name}_{item.id}", context.scope.wire_type(wire) or "BOOL", keeps)
                arguments.append(f"{pin.name} => {name}")
                context.set_output(wire, variable(name))

    def _is_expression(self, item: Object, result: Pin, arguments: list[str]) -> bool:
        """Whether the call of a function can stand where its result is used: once, and nothing else of the call is used."""
        uses = self.context.uses
        has_outputs = bool(self.context.is_used(Wire(item, "ENO")) or item.in_outs or any("=>" in text for text in arguments))
        return not has_outputs and uses[item, result.name] == 1 and not result.edge

    def _as_statement(self, item: Object, wire: Wire | None, condition: Value | None, arguments: list[str],
                      writes: frozenset[str]) -> None:
        context = self.context
        eno = self._eno(item, arguments)
        target = ""
        if wire is not None:
            target = self._result(item, wire)
            writes |= {target.upper()}
        call = f"{f'{target} := ' if target else ''}{item.text}({', '.join(arguments)});"
        if eno:
            context.write(f"{eno.text} := FALSE;", eno.reads)
        if condition is not None:
            enabled = context.scope.new(f"Enable_{item.id}", "BOOL", context.apart)
            context.write(f"{enabled} := {condition.text};", frozenset((enabled.upper(),)))
            self.guards |= {(item, pin.name): variable(enabled) for pin in item.outputs if pin.name.upper() != "ENO"}
            call = f"IF {enabled} THEN {call} END_IF;"
        context.write(call, writes)
        if eno:
            self._set_eno(item, eno, guards=condition is not None)
        if wire is not None:
            context.set_output(wire, variable(target))
