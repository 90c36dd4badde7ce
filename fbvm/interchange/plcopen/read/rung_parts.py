"""The objects of a network as elements of a rung: contacts, comparisons, blocks that power goes through, outputs, and the
values at their pins."""

from __future__ import annotations

import re

from fbvm.interchange.plcopen.read.diagram import Object, Pin, Wire
from fbvm.interchange.plcopen.read.networks import Network
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.syntax.ladder.instructions.instruction_set import Instruction, instruction_set
from fbvm.syntax.ladder.operands import OperandError, Operands
from fbvm.syntax.ladder.text import instruction_text
from fbvm.syntax.tree import Index, Member, NameRef

CONTACTS = {(False, ""): "", (True, ""): "NOT", (False, "rising"): "@", (False, "falling"): "%"}
"""Negation and edge of a contact -> what its mnemonic has for them."""
COILS = {(False, "", ""): "OUT", (True, "", ""): "OUT NOT", (False, "", "set"): "SET", (False, "", "reset"): "RSET",
         (False, "rising", ""): "DIFU", (False, "falling", ""): "DIFD", (False, "rising", "set"): "@SET",
         (False, "rising", "reset"): "@RSET", (False, "falling", "set"): "%SET", (False, "falling", "reset"): "%RSET"}
"""Negation, edge and storage of a coil -> its mnemonic."""
_CONDITION = re.compile(r"EN|C\d+")


class Inexact(Exception):
    """Mnemonics cannot do what the network does."""


def instruction(item: Object) -> Instruction | None:
    """The row of the instruction that a block stands for; None for another block."""
    name = item.mnemonic.lstrip("!@%")
    rows = instruction_set().rows
    return (rows.get(name) or rows.get(f"LD{name}")) if name else None


class Parts:
    """The elements of one network; `outputs` are those that nothing follows.  Raises Inexact for an object that no rung has."""

    def __init__(self, network: Network, scope: Scope) -> None:
        self.network, self.scope = network, scope
        self.consumers: dict[Object, list[tuple[Object, Wire]]] = {}
        for item in network.objects:
            for pin in item.pins:
                for wire in pin.wires:
                    self.consumers.setdefault(wire.source, []).append((item, wire))
        self.joined = {item: test for item in network.objects if (test := self._joiner(item))}
        self.calls = {item for item in network.objects if self._is_call(item)}
        self.outputs = [item for item in network.objects if self._is_output(item)]
        self.elements = [item for item in network.objects if item.kind in ("contact", "coil") or instruction(item)
                         or item in self.calls]
        for item in network.objects:
            if item not in self.elements and item not in self.joined and not self._belongs(item):
                raise Inexact

    # --- what an object is ---

    def _is_test(self, item: Object) -> bool:
        row = instruction(item)
        return row is not None and row.kind == "?"

    def _joiner(self, item: Object) -> Object | None:
        """The comparison that an AND block joins to the power before it; None for another block."""
        if item.kind != "block" or item.text.upper() != "AND" or item.instance or item.mnemonic or len(item.inputs) != 2:
            return None
        wires = item.inputs[1].wires
        test = wires[0].source if len(wires) == 1 else None
        return test if test is not None and self._is_test(test) and len(self.consumers.get(test, ())) == 1 else None

    def _is_call(self, item: Object) -> bool:
        """Whether a block can be an FBCALL: power goes through EN and ENO, all other pins have operands."""
        if item.kind != "block" or not item.instance or item.mnemonic or item.in_outs or not item.pin("EN"):
            return False
        plain = all(self._operand_of(pin) for pin in item.inputs if pin.connected and pin.name.upper() != "EN")
        outputs = [consumer for consumer, wire in self.consumers.get(item, ()) if wire.pin.upper() != "ENO"]
        return plain and not any(pin.negated or pin.edge for pin in (*item.inputs, *item.outputs)) \
            and all(self._is_plain_variable(consumer) for consumer in outputs)

    def _is_plain_variable(self, item: Object) -> bool:
        return item.kind == "outVariable" and len(item.inputs[0].wires) == 1 and not (item.negated or item.edge or item.storage)

    def _operand_of(self, pin: Pin) -> str:
        """The operand at a pin; "" if something else is connected."""
        if pin.negated or pin.edge:
            return ""
        if pin.expression:
            return pin.expression
        source = pin.wires[0].source if len(pin.wires) == 1 else None
        plain = source is not None and source.kind == "inVariable" and not (source.negated or source.edge)
        return source.text if source is not None and plain else ""

    def _is_output(self, item: Object) -> bool:
        if item.kind == "coil":
            return True
        row = instruction(item)
        if item in self.calls:
            return not any(wire.pin.upper() == "ENO" for _, wire in self.consumers.get(item, ()))
        return row is not None and row.kind != "?" and row.does != ".not"

    def _belongs(self, item: Object) -> bool:
        """Whether an object is a value at the pin of a block that is written with it."""
        if item.kind == "inVariable":
            return all(consumer in self.calls or instruction(consumer) for consumer, _ in self.consumers.get(item, ()))
        return self._is_plain_variable(item) and item.inputs[0].wires[0].source in self.calls

    # --- power ---

    def powers(self, output: Object) -> list[tuple[Wire, ...]]:
        """For each condition of an output, the wires that lead to it."""
        if output.kind == "coil":
            return [tuple(output.inputs[0].wires)]
        return [tuple(pin.wires) for pin in output.inputs if _CONDITION.fullmatch(pin.name.upper())]

    def element(self, wire: Wire) -> tuple[Object, tuple[Wire, ...]]:
        """The element that a wire comes from, and the wires into that element; no wires at the rail."""
        item = wire.source
        if item.kind == "contact":
            if not item.inputs[0].wires:
                raise Inexact
            return item, tuple(item.inputs[0].wires)
        if item in self.joined:
            return self.joined[item], tuple(item.inputs[0].wires)
        if self._is_test(item):
            return item, ()
        if item in self.calls and wire.pin.upper() == "ENO":
            return item, self.powers(item)[0]
        if (row := instruction(item)) is not None and row.does == ".not":
            return item, tuple(item.inputs[0].wires)
        raise Inexact

    def goes_through(self, item: Object) -> bool:
        """Whether power goes through an element and comes out changed: FBCALL and NOT."""
        return item in self.calls or item.mnemonic == "NOT"

    # --- text ---

    def contact(self, how: str, item: Object) -> str:
        """A contact or a comparison."""
        if item.kind == "block":
            operands = [_constant(self._operand_of(pin)) for pin in item.inputs]
            if not all(operands):
                raise Inexact
            return instruction_text(f"{how}{item.mnemonic}", *operands)
        form = CONTACTS.get((item.negated, item.edge))
        if form is None or item.storage or item.text.upper() in ("TRUE", "FALSE"):  # TwinCAT lets a contact be a literal
            raise Inexact
        return instruction_text(f"{form}{how}" if form in ("@", "%") else f"{how} {form}".rstrip(), self._bit(item))

    def through(self, item: Object) -> str:
        """FBCALL or NOT."""
        if item not in self.calls:
            return "NOT"
        pins = [f"{pin.name}:={_constant(self._operand_of(pin))}" for pin in item.inputs
                if pin.connected and pin.name.upper() != "EN"]
        pins += [f"{wire.pin}=>{consumer.text}" for consumer, wire in self.consumers.get(item, ()) if wire.pin.upper() != "ENO"]
        if any(" " in pin for pin in pins):
            raise Inexact
        return instruction_text("FBCALL", item.text, item.instance, *pins)

    def output(self, item: Object) -> str:
        """A coil, an instruction, or an FBCALL behind which nothing comes."""
        if item in self.calls:
            return self.through(item)
        if item.kind == "block":
            return instruction_text(item.mnemonic, *(self._operand_of(pin) for pin in item.inputs
                                                     if not _CONDITION.fullmatch(pin.name.upper())))
        mnemonic = COILS.get((item.negated, item.edge, item.storage))
        if mnemonic is None:
            raise Inexact
        return instruction_text(mnemonic, self._bit(item))

    def _bit(self, item: Object) -> str:
        """The operand for a bit: a variable whose name a rung does not read as an address (as T1 or D5), or an address that no
        declaration has as its name."""
        text = item.text
        if text.upper().startswith("TR") and text[2:].isdecimal():
            raise Inexact
        try:
            meant = Operands().expression(text, "b", 0, 0)
        except OperandError:
            raise Inexact from None
        if not isinstance(meant, (NameRef, Member, Index)) and self.scope.declares(text):
            raise Inexact
        return text

    # --- order ---

    def compare(self, order: list[Object], place: dict[Object, int]) -> None:
        """Raise Inexact unless each element has one step, and reads and writes of the same memory keep the network's order."""
        if len(set(order)) < len(order) or len(order) < len(self.elements):
            raise Inexact
        touched = {item: self._touched(item) for item in order}
        for at, item in enumerate(order):
            for behind in order[at + 1:]:
                if place[behind] < place[item] and (self._writes(item) or self._writes(behind)):
                    first, second = touched[item], touched[behind]
                    if first is None or second is None or first & second:
                        raise Inexact

    def _writes(self, item: Object) -> bool:
        return item.kind != "contact" and not self._is_test(item)

    def _touched(self, item: Object) -> frozenset[str] | None:
        """Roots of the memory that an element reads or writes; None for any memory."""
        if item.kind != "block":
            return self.scope.roots(item.text)
        if self._is_test(item):
            return frozenset().union(*(self.scope.roots(self._operand_of(pin)) for pin in item.inputs))
        return None if item.mnemonic != "NOT" else frozenset()


def _constant(text: str) -> str:
    """An operand of a rung for a value of Structured Text."""
    if re.fullmatch(r"\d+", text):
        return f"&{text}"
    if re.fullmatch(r"16#[0-9A-Fa-f]+", text):
        return f"#{text[3:]}"
    return f"+{text}" if re.fullmatch(r"\d+\.\d+", text) else text
