"""Network diagrams of TwinCAT's files as the elements of PLCopen XML that say the same, for the reader of those.

A network is a list of trees, each evaluated after the one before:

    BoxTreeOperand      an Operand, with its own Flags
    BoxTreeAssign       RValue, and in OutputItems who gets it: variables, a label to jump to, RETURN
    BoxTreeBox          BoxType, Instance, CallType; InputItems with InputParam's Names (EN the first) and InputFlags; OutputItems
                        with OutputParam's Names (ENO the first), of which the one that is nothing leads on
    BoxTreeDemux        a wire that branches, numbered by VarId: with its Input where it begins, alone where it is taken
    BoxTreeParallel     Trees in parallel behind Input
    BoxTreeTerminator   an open end: the left rail

Ladder is kept as boxes AND and OR over contacts.  What else stands in a diagram is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.check.calls.functions import is_standard
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.networks import BAND
from fbvm.interchange.twincat.archive import (
    FALLING,
    JUMP,
    NEGATED,
    RETURN,
    RISING,
    SET,
    bits,
    flags,
    is_true,
    listed,
    member,
    text,
    words,
)

ROOT = "NWLImplementationObject"
UNKNOWN_OPERAND = "???"
"""What the editor writes where an operand is still missing."""
MOST_DEEP = 150
"""Deepest tree of a network."""
_MODIFIERS = NEGATED | RISING | FALLING
_LOGIC = ("BOOL", "BIT", "")
"""Types of operands that are contacts and coils in ladder."""
_SERIES = ("AND", "OR")
_CALLS = ("functionblock", "method", "function", "program", "action")
_MORE = ("ADR", "SIZEOF")
"""Boxes that are no function of the standard; their only input is IN."""
Feeds = tuple[tuple[str, str], ...]
"""Where a value comes from: localIds of elements and the names of their outputs; several are a wired OR, none is TRUE."""


class Unreadable(Exception):
    """A network has something that is not known; the arguments are the element and a message."""


@dataclass(frozen=True)
class Pins:
    """A type of boxes and its pins, as one of them shows them: names and types of inputs and outputs."""

    name: str
    inputs: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, str], ...]
    is_block: bool


@dataclass
class Diagram:
    """A body as an element LD or FBD; the types of its boxes by their names in capitals; why networks were left out."""

    element: Element
    pins: dict[str, Pins]
    starts: dict[int, int]
    """By number of a network the offset at which it begins."""
    refused: list[Unreadable]


def read_networks(body: Element) -> Diagram | None:
    """The diagram in an element NWL; None if there is none in it."""
    root = next((one for one in body.walk() if one.name == "o" and one.get("t") == ROOT), None)
    if root is None:
        return None
    is_ladder = text(root, "DefaultViewMode").lower() == "ld"
    made = Diagram(Element("LD" if is_ladder else "FBD", "", {}, body.at), {}, {}, [])
    for number, (_, network) in enumerate(listed(root, "NetworkList"), 1):
        made.starts[number] = network.at
        reader = _Network(number, is_ladder, made.pins)
        try:
            reader.read(network)
        except Unreadable as refusal:
            made.refused.append(refusal)
            continue
        made.element.content += reader.elements
    return made


class _Network:
    """Reads one network: `elements` grows in the order of evaluation."""

    def __init__(self, number: int, is_ladder: bool, pins: dict[str, Pins]) -> None:
        self.is_ladder, self.pins = is_ladder, pins
        self.elements: list[Element] = []
        self.wires: dict[str, Feeds] = {}
        """By VarId what feeds a wire that branches."""
        self.closed: dict[str, str] = {}
        """By localId of a box why nobody can take what it gives."""
        self.rail = ""
        """The localId of the rail, or of the TRUE in its place; "" before the first."""
        self.number = number * BAND
        self.deep = 0

    def read(self, network: Element) -> None:
        """The elements of a network.  Raises Unreadable."""
        said = "\n".join(filter(None, (text(network, "Title").strip(), text(network, "Comment").strip())))
        trees = listed(network, "NetworkItems")
        if is_true(network, "OutCommented"):
            return
        if not trees and listed(network, "ILLines"):
            raise Unreadable(network, "the network is an instruction list")
        if said and trees:
            self._add("comment", network, {}, Element("content", "", {}, network.at, [said]))
        if label := text(network, "Label").strip():
            self._add("label", network, {"label": label})
        for kind, tree in trees:
            self._value(kind, tree, ())

    def _add(self, name: str, at: Element, attributes: dict[str, str], *content: Element) -> str:
        """Add an element; returns its localId."""
        self.number += 1
        self.elements.append(Element(name, "", {"localId": str(self.number), **attributes}, at.at, list(content)))
        return str(self.number)

    def _point(self, at: Element, feeds: Feeds) -> Element:
        """The point at which wires from `feeds` end."""
        if not feeds:
            if not self.rail:
                self.rail = (self._add("leftPowerRail", at, {}) if self.is_ladder else
                             self._add("inVariable", at, {}, expression("TRUE", at)))
            feeds = ((self.rail, ""),)
        if closed := next((self.closed[number] for number, _ in feeds if number in self.closed), ""):
            raise Unreadable(at, closed)
        wires = [Element("connection", "", {"refLocalId": number, "formalParameter": pin}, at.at) for number, pin in feeds]
        return Element("connectionPointIn", "", {}, at.at, [*wires])

    # --- trees ---

    def _value(self, kind: str, tree: Element, power: Feeds) -> Feeds:
        """What a tree gives, while `power` reaches it.  Raises Unreadable."""
        self.deep += 1
        if self.deep > MOST_DEEP:
            raise Unreadable(tree, f"the network is deeper than {MOST_DEEP}")
        made = _TREES.get(kind, _Network._strange)(self, tree, power)
        self.deep -= 1
        return made

    def _strange(self, tree: Element, power: Feeds) -> Feeds:
        raise Unreadable(tree, f"nobody knows what {tree.get('t') or 'a part without a type'} does")

    def _input(self, tree: Element, name: str, power: Feeds) -> Feeds | None:
        """What the tree gives that is the member of that name; None without one."""
        inner = member(tree, name)
        return None if inner is None else self._value(inner.get("t"), inner, power)

    def _operand(self, tree: Element, power: Feeds) -> Feeds:
        operand = member(tree, "Operand")
        if operand is None:
            raise Unreadable(tree, "an operand is missing")
        name, own = _named(operand), flags(operand)
        if own & ~_MODIFIERS:
            raise Unreadable(tree, f"{name} has flags that only outputs have")
        if self.is_ladder and text(operand, "Type").upper() in _LOGIC:
            return ((self._add("contact", tree, _modified(own), self._point(tree, power),
                               Element("variable", "", {}, tree.at, [name])), ""),)
        here = ((self._add("inVariable", tree, _modified(own), expression(name, tree)), ""),)
        return self._series(tree, power, here)

    def _series(self, tree: Element, power: Feeds, behind: Feeds) -> Feeds:
        """Both of two values."""
        if not power or not behind:
            return power or behind
        pins = []
        for name, feeds in (("IN1", power), ("IN2", behind)):
            pins.append(_variable(tree, name, 0))
            pins[-1].content.append(self._point(tree, feeds))
        return ((self._add("block", tree, {"typeName": "AND"}, pins_of("inputVariables", tree, pins),
                           pins_of("outputVariables", tree, [_variable(tree, "OUT", 0)])), "OUT"),)

    def _demux(self, tree: Element, power: Feeds) -> Feeds:
        number = text(tree, "VarId")
        begun = self._input(tree, "Input", ())
        if begun is not None:
            self.wires[number] = begun
        if number not in self.wires:
            raise Unreadable(tree, f"the wire {number} begins nowhere")
        return self._series(tree, power, self.wires[number])

    def _parallel(self, tree: Element, power: Feeds) -> Feeds:
        feed = self._input(tree, "Input", power)
        if any(one.get("n") == "BoxType" and one.text.strip('" \r\n').upper() not in _SERIES for branch in _branches(tree)
               for one in branch.walk()):
            raise Unreadable(tree, "a box stands in a branch in parallel")
        return _either([self._value(kind, branch, power if feed is None else feed) for kind, branch in listed(tree, "Trees")])

    def _terminator(self, tree: Element, power: Feeds) -> Feeds:
        inner = self._input(tree, "Input", power)
        return power if inner is None else inner

    # --- what gets a value ---

    def _assign(self, tree: Element, power: Feeds) -> Feeds:
        value = member(tree, "RValue")
        if value is None:
            raise Unreadable(tree, "nothing is assigned")
        if value.get("t") == "BoxTreeTerminator" and not self.is_ladder and not any(
                flags(out) & (JUMP | RETURN) for kind, out in _outputs(tree) if kind):
            raise Unreadable(tree, "nothing is assigned")
        feeds = self._value(value.get("t"), value, power)
        for kind, out in _outputs(tree):
            if kind and (text(out, "Operand").strip() or flags(out) & RETURN):
                self._target(out, feeds)
        return feeds

    def _target(self, out: Element, feeds: Feeds) -> None:
        """A variable, a label or RETURN that gets a value."""
        own = flags(out)
        if own & RETURN:
            self._add("return", out, _modified(own), self._point(out, feeds))
            return
        name = _named(out)
        if own & JUMP:
            self._add("jump", out, {"label": name, **_modified(own)}, self._point(out, feeds))
            return
        stored = {"storage": "reset" if own & NEGATED else "set"} if own & SET else {}
        said = {**_modified(own & ~NEGATED if stored else own), **stored}
        if self.is_ladder and text(out, "Type").upper() in _LOGIC:
            self._add("coil", out, said, self._point(out, feeds), Element("variable", "", {}, out.at, [name]))
        else:
            self._add("outVariable", out, said, self._point(out, feeds), expression(name, out))

    # --- boxes ---

    def _box(self, tree: Element, power: Feeds) -> Feeds:
        kind = text(tree, "BoxType").strip()
        if self.is_ladder and _is_series(tree, kind):
            return self._contacts(tree, kind.upper(), power)
        names = words(tree, "InputParam", "Names")
        _check(tree, kind, names)
        instance, outputs = _instance(tree, kind), _outputs(tree)
        outs = words(tree, "OutputParam", "Names") or ([] if instance else [""] * max(len(outputs), 1))
        self._note(tree, kind, outs, bool(instance))
        leads = next((at for at, (entry, _) in enumerate(outputs) if not entry), 0)
        pins, in_outs = self._inputs(tree, names)
        shown = [_variable(tree, name, flags(tree) if at == leads else 0) for at, name in enumerate(outs)]
        number = self._add("block", tree, {"typeName": kind, **({"instanceName": instance} if instance else {})},
                           pins_of("inputVariables", tree, pins), pins_of("inOutVariables", tree, in_outs),
                           pins_of("outputVariables", tree, shown))
        for at, (entry, out) in enumerate(outputs):
            if entry and text(out, "Operand").strip():
                if at >= len(outs):
                    raise Unreadable(tree, f"an output of the box {kind} has no name")
                self._target(out, ((number, outs[at]),))
        return self._behind(tree, power, number, outs[leads] if leads < len(outs) else None)

    def _behind(self, tree: Element, power: Feeds, number: str, pin: str | None) -> Feeds:
        """What a box leads on, which is nothing if it has no output for that."""
        kind = text(tree, "BoxType")
        if pin is None:
            self.closed[number] = f"the box {kind} has no output that could be taken"
        elif is_true(tree, "EN") and pin.upper() != "ENO" and text(tree, "CallType").lower() != "functionblock":
            self.closed[number] = f"what the box {kind} gives while its EN is FALSE is not known: it has no ENO"
        here = ((number, pin or ""),)
        return here if number in self.closed else self._series(tree, power, here)

    def _contacts(self, tree: Element, kind: str, power: Feeds) -> Feeds:
        """Contacts in series (AND) or in parallel (OR)."""
        given = listed(tree, "InputItems")
        if kind == "OR":
            return _either([self._value(entry, inner, power) for entry, inner in given])
        for entry, inner in given:
            power = self._value(entry, inner, power)
        return power

    def _inputs(self, tree: Element, names: list[str]) -> tuple[list[Element], list[Element]]:
        """The inputs and the in-outs of a box."""
        modifiers = [bits(entry) for _, entry in listed(tree, "InputFlags")]
        types = words(tree, "InputParam", "Types")
        is_lone = text(tree, "BoxType").strip().upper() in _MORE
        pins: list[Element] = []
        in_outs: list[Element] = []
        for at, (entry, inner) in enumerate(listed(tree, "InputItems")):
            own = modifiers[at] if at < len(modifiers) else 0
            if own & ~_MODIFIERS:
                raise Unreadable(inner, "an input has flags that are not known")
            pin = _variable(inner, (names[at] if at < len(names) else "") or ("IN" if is_lone else f"IN{at + 1}"), own)
            is_in_out = at < len(types) and types[at].endswith("[REF]")
            (in_outs if is_in_out else pins).append(pin)
            operand = member(inner, "Operand") if entry == "BoxTreeOperand" else None
            if not entry or operand is not None and not text(operand, "Operand").strip():
                continue
            if operand is not None and is_in_out:
                pin.content.append(Element("connectionPointIn", "", {}, inner.at, [expression(_named(operand), inner)]))
            else:
                pin.content.append(self._point(inner, self._value(entry, inner, ())))
        return pins, in_outs

    def _note(self, tree: Element, kind: str, outs: list[str], is_block: bool) -> None:
        """Note the pins of a type of boxes."""
        inputs = zip(words(tree, "InputParam", "Names"), words(tree, "InputParam", "Types"), strict=False)
        outputs = zip(outs, words(tree, "OutputParam", "Types"), strict=False)
        self.pins.setdefault(kind.upper(), Pins(
            kind, tuple(row for row in inputs if row[0] != "EN"), tuple(row for row in outputs if row[0] != "ENO"), is_block))


def _either(branches: list[Feeds]) -> Feeds:
    """A wired OR."""
    return tuple(dict.fromkeys(wire for branch in branches for wire in branch)) if all(branches) else ()


# --- parts ------------------------------------------------------------------------------------------------------------


def _check(tree: Element, kind: str, names: list[str]) -> None:
    """Raises Unreadable for a box with something that is not known."""
    if is_true(tree, "ProvidesSTSnippet"):
        raise Unreadable(tree, "a box has Structured Text in it")
    if flags(tree) & ~_MODIFIERS:
        raise Unreadable(tree, f"the box {kind} has flags that are not known")
    if is_true(tree, "EN") and names[:1] != ["EN"]:
        raise Unreadable(tree, f"the first input of the box {kind} is not its EN")


def _instance(tree: Element, kind: str) -> str:
    """The instance that a box calls; "" for a function.  Raises Unreadable where it is missing."""
    held = member(tree, "Instance")
    name = text(held, "Operand").strip() if held is not None else ""
    called = text(tree, "CallType").lower()
    if name == UNKNOWN_OPERAND or called == "functionblock" and not name:
        raise Unreadable(tree, f"the box {kind} has no instance")
    if called not in _CALLS and not is_standard(kind.upper()) and kind.upper() not in _MORE:
        raise Unreadable(tree, f"nobody knows what a box {kind} of the kind {called or 'that it does not tell'} does")
    return name


def _is_series(tree: Element, kind: str) -> bool:
    """Whether a box AND or OR is how a ladder has contacts in series and in parallel."""
    given = listed(tree, "InputItems")
    if kind.upper() not in _SERIES or is_true(tree, "EN") or flags(tree) or len(given) < 2:
        return False
    if any(bits(entry) for _, entry in listed(tree, "InputFlags")):
        return False
    return all(entry and (entry != "BoxTreeOperand" or _type(inner) in _LOGIC) for entry, inner in given)


def _type(tree: Element) -> str:
    operand = member(tree, "Operand")
    return text(operand, "Type").upper() if operand is not None else ""


def _branches(tree: Element) -> list[Element]:
    return [branch for _, branch in listed(tree, "Trees")]


def _outputs(tree: Element) -> list[tuple[str, Element]]:
    held = member(tree, "OutputItems")
    return listed(held, "OutputItems") if held is not None else []


def _named(operand: Element) -> str:
    """The name or expression of an operand.  Raises Unreadable if it is missing."""
    name = text(operand, "Operand").strip()
    if name in ("", UNKNOWN_OPERAND):
        raise Unreadable(operand, "an operand is missing")
    return name


def _modified(found: int) -> dict[str, str]:
    """The attributes that say how a value is modified."""
    edge = "rising" if found & RISING else "falling" if found & FALLING else ""
    return {**({"negated": "true"} if found & NEGATED else {}), **({"edge": edge} if edge else {})}


def expression(written: str, at: Element) -> Element:
    """An operand that is typed at a pin."""
    return Element("expression", "", {}, at.at, [written])


def pin_named(at: Element, name: str, attributes: dict[str, str]) -> Element:
    """A pin of a block."""
    return Element("variable", "", {"formalParameter": name, **attributes}, at.at)


def _variable(at: Element, name: str, modifiers: int) -> Element:
    return pin_named(at, name, _modified(modifiers))


def pins_of(name: str, at: Element, pins: list[Element]) -> Element:
    """The inputs, in-outs or outputs of a block."""
    return Element(name, "", {}, at.at, [*pins])


_TREES = {"BoxTreeOperand": _Network._operand, "BoxTreeAssign": _Network._assign, "BoxTreeBox": _Network._box,
          "BoxTreeDemux": _Network._demux, "BoxTreeParallel": _Network._parallel, "BoxTreeTerminator": _Network._terminator}
