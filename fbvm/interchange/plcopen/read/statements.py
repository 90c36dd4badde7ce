"""The objects of a network as statements of Structured Text, in the order of their evaluation."""

from __future__ import annotations

from fbvm.interchange.plcopen.read.calls import Calls
from fbvm.interchange.plcopen.read.context import Held, NetworkContext, when
from fbvm.interchange.plcopen.read.diagram import Object, Wire
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.read.networks import Network
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.interchange.plcopen.read.values import Unexecutable, both, negation


class Statements:
    """Writes the networks of one body; the variables that their statements need are declared in the scope."""

    def __init__(self, reading: Reading, scope: Scope) -> None:
        self.context = NetworkContext(reading, scope)
        self.calls = Calls(self.context)

    def conditions(self, network: Network, apart: bool) -> tuple[list[str], dict[Object, str]]:
        """The statements of a network with conditions of transitions, and the expression of each condition.  With `apart` the
        statements are executed elsewhere: what they leave to conditions lasts.  Raises Unexecutable."""
        self.context.apart = apart
        lines = self.write(network)
        return lines, self.context.conditions

    def write(self, network: Network) -> list[str]:
        """The statements of a network.  Raises Unexecutable."""
        if network.refused:
            raise Unexecutable(network.objects[0], network.refused, "draw it in parts")
        self.context.begin(network)
        for item in network.objects:
            if item not in self.context.done:
                _WRITERS.get(item.kind, Statements._strange)(self, item)
        for item in network.objects:
            if item.kind in ("jump", "return"):
                self._leave(item)
        return self.context.lines

    # --- objects ---

    def _contact(self, item: Object) -> None:
        context = self.context
        wire = Wire(item, "")
        if not context.is_used(wire):
            context.warn_unused(item)
            return
        if not item.inputs[0].wires:
            context.warn(item, f"contact {item.text} is not connected on its left, and lets no power through")
        power = context.value_at(item, item.inputs[0])
        state = context.modified(item, context.expression(context.scope.bit(item.text)), item.negated, item.edge)
        context.set_output(wire, both(power, state), keep=True)

    def _in_variable(self, item: Object) -> None:
        if self.context.uses[item, ""] < 1:
            self.context.warn_unused(item)

    def _sink(self, item: Object) -> None:
        """A coil or an output variable."""
        context = self.context
        pin = item.inputs[0]
        if not pin.connected:
            context.warn(item, f"{item.text} is not connected, and is not written")
            return
        target, writes = context.target(item)
        is_bare = context.generates and item.kind == "coil"  # a generator has no IF around coils
        guard = None if is_bare else self.calls.guard(pin)
        value = context.modified(item, context.value_at(item, pin), item.negated, item.edge)
        if item.storage and item.negated and context.generates:
            context.warn(item, f"negated and {item.storage}: Beremiz and OpenPLC Editor assign the inverse in every scan")
            context.write(f"{target} := {value.text};", writes)
        elif item.storage in ("set", "reset"):
            power = both(guard, value) if guard else value
            context.write(when(power, f"{target} := {'TRUE' if item.storage == 'set' else 'FALSE'};"), writes)
        elif item.storage:
            raise Unexecutable(item, f"there is no storage {item.storage!r}", "")
        elif guard:
            context.write(when(guard, f"{target} := {value.text};"), writes)
        else:
            context.write(f"{target} := {value.text};", writes)

    def _condition(self, item: Object) -> None:
        """Note the expression of the condition of a transition."""
        value = self.context.value_at(item, item.inputs[0])
        self.context.conditions[item] = (negation(value) if item.negated else value).text

    def _in_out_variable(self, item: Object) -> None:
        context = self.context
        if item.inputs[0].connected:
            target, writes = context.target(item)
            text = f"{target} := {context.value_at(item, item.inputs[0]).text};"
            guard = self.calls.guard(item.inputs[0])
            context.write(when(guard, text) if guard else text, writes)
        if not context.reads_in_outs:
            context.set_output(Wire(item, ""), context.modified(item, context.expression(item.text), item.negated, item.edge))

    def _label(self, item: Object) -> None:
        self.context.lines.insert(0, f"{item.text}:")

    def _power(self, item: Object) -> None:
        """Evaluate the condition of a jump or return at its turn; the jump itself is the end of the network."""
        context = self.context
        key = item, "jump"
        value = negation(context.value_at(item, item.inputs[0])) if item.negated else context.value_at(item, item.inputs[0])
        context.uses[key] = 1
        context.held[key] = Held(value, Wire(item, "jump"), 1)

    def _leave(self, item: Object) -> None:
        context = self.context
        power = context.held.pop((item, "jump")).value
        context.lines.append(when(power, f"JMP {item.text};" if item.kind == "jump" else "RETURN;"))

    def _block(self, item: Object) -> None:
        self.calls.write(item)

    def _strange(self, item: Object) -> None:
        raise Unexecutable(item, f"nobody knows what <{item.kind}>{f' {item.text!r}' if item.text else ''} does", "")


_WRITERS = {"contact": Statements._contact, "coil": Statements._sink, "outVariable": Statements._sink,
            "inOutVariable": Statements._in_out_variable, "inVariable": Statements._in_variable, "label": Statements._label,
            "jump": Statements._power, "return": Statements._power, "block": Statements._block,
            "condition": Statements._condition}
