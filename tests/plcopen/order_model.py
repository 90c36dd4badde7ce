"""A second reading of the orders of evaluation: random diagrams of function blocks, and what they do scan by scan.

Written from the rules alone, without the code of the import.  In the orders of Beremiz and OpenPLC Editor: sinks and blocks are
gone through in their order (`_candidates`); each has what it needs called in front of it, a block once; a block counts as called
before its inputs are looked at, so a wire that comes back to it carries what it last gave; a block with a number does not have
others called, and takes what they last gave.  In the order `network`: networks from top to bottom, in each of them producers in
front of consumers, and a jump skips the networks up to its label.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from drawings import block, document, pou, result, value, variable, wires

BITS, NUMBERS, INPUTS = ("u", "v"), ("k", "n"), ("a", "b")
STEP = pou("<p>IF x THEN n := n + 1; END_IF; y := n * 2;</p>",
           f"<inputVars>{variable('x')}</inputVars><inOutVars>{variable('n', 'INT')}</inOutVars>"
           f"<outputVars>{variable('y', 'INT')}</outputVars>", kind="functionBlock", name="Step", language="ST")
Source = tuple[int, str]
"""The number of a node and the name of its output."""


def _whole(number: int) -> int:
    return (number + 0x8000) % 0x10000 - 0x8000


# --- what blocks do ---------------------------------------------------------------------------------------------------

FUNCTIONS: dict[str, tuple[str, dict[str, str], Callable[..., Any]]] = {
    "AND": ("BOOL", {"IN1": "BOOL", "IN2": "BOOL"}, lambda first, second: first and second),
    "XOR": ("BOOL", {"IN1": "BOOL", "IN2": "BOOL"}, lambda first, second: first != second),
    "NOT": ("BOOL", {"IN": "BOOL"}, lambda first: not first),
    "GT": ("BOOL", {"IN1": "typed", "IN2": "INT"}, lambda first, second: first > second),
    "ADD": ("INT", {"IN1": "typed", "IN2": "INT"}, lambda first, second: _whole(first + second)),
    "SUB": ("INT", {"IN1": "typed", "IN2": "INT"}, lambda first, second: _whole(first - second)),
}
"""Type of the result, types of the inputs (`typed`: a variable), and the function."""
BLOCKS = {
    "R_TRIG": ({"CLK": "BOOL"}, {"Q": "BOOL"}),
    "CTU": ({"CU": "BOOL", "R": "BOOL", "PV": "INT"}, {"Q": "BOOL", "CV": "INT"}),
    "SR": ({"S1": "BOOL", "R": "BOOL"}, {"Q1": "BOOL"}),
    "Step": ({"x": "BOOL"}, {"y": "INT"}),
}
"""Inputs and outputs of the function blocks, with their types; Step has the in-out n besides."""


def _call(kind: str, pins: dict[str, Any], variables: dict[str, Any], through: str) -> None:
    """Execute a function block, whose `pins` are its inputs, outputs and memory; `through` is the variable at its in-out."""
    if kind == "R_TRIG":
        pins["Q"], pins["M"] = pins["CLK"] and not pins.get("M", False), pins["CLK"]
    elif kind == "SR":
        pins["Q1"] = pins["S1"] or (not pins["R"] and pins["Q1"])
    elif kind == "Step":
        variables[through] = _whole(variables[through] + pins["x"])
        pins["y"] = _whole(variables[through] * 2)
    else:
        rose, pins["M"] = pins["CU"] and not pins.get("M", False), pins["CU"]
        if pins["R"]:
            pins["CV"] = 0
        elif rose and pins["CV"] < pins["PV"]:
            pins["CV"] += 1
        pins["Q"] = pins["CV"] >= pins["PV"]


# --- diagrams ---------------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class Node:
    """An element: `kind` is value, sink, function, block, inout or jump; `text` its variable, function, type or label; `feeds` by
    pin what is wired to it; `number` its executionOrderId; `through` the variable node at its in-out."""

    id: int
    kind: str
    text: str
    x: int
    y: int
    number: int = 0
    feeds: dict[str, list[Source]] = field(default_factory=dict)
    through: int = 0

    @property
    def is_sink(self) -> bool:
        return self.kind == "sink" or (self.kind == "inout" and bool(self.feeds))


def diagram(random: Random, loops: bool, numbers: bool, jumps: int = 0) -> list[Node]:
    """A diagram of one worksheet, with `loops` of wires, `numbers` of execution, and `jumps` to a label in its middle."""
    made: list[Node] = []

    def add(kind: str, text: str) -> Node:
        made.append(Node(len(made) + 1, kind, text, random.randrange(8) * 40, random.randrange(12) * 20))
        return made[-1]

    for text in (*INPUTS, *BITS, *NUMBERS, "INT#3"):
        add("value", text)
    for text in random.sample(BITS + NUMBERS, 3):
        add("inout", text)
    for _ in range(random.randint(3, 9)):
        function = random.random() < 0.6
        add("function" if function else "block", random.choice([*FUNCTIONS] if function else [*BLOCKS]))
    for _ in range(random.randint(4, 8)):
        add("sink", random.choice(BITS + NUMBERS))
    for _ in range(jumps):
        add("jump", "middle").y = random.randrange(5) * 20
    for node in made:
        _wire(random, made, node, loops, add)
    if jumps:
        add("label", "middle").y = 110
    random.shuffle(made)
    for node in random.sample(made, len(made) // 2) if numbers else ():
        node.number = random.randint(1, 30) if node.kind in ("function", "block", "sink") else 0
    taken = [node.number for node in made if node.number]
    for node in made:
        if taken.count(node.number) > 1:
            node.number = 0
    return made


def _wire(random: Random, made: list[Node], node: Node, loops: bool, add: Callable[[str, str], Node]) -> None:
    """Wire the inputs of a node at random; without `loops`, to nodes in front of it."""
    kinds = {"": "BOOL" if node.kind == "jump" else _type(node.text)} if node.kind in ("sink", "jump") else {}
    if node.kind == "inout" and random.random() < 0.4:
        kinds = {"": _type(node.text)}
    elif node.kind in ("function", "block"):
        kinds = FUNCTIONS[node.text][1] if node.kind == "function" else BLOCKS[node.text][0]
    for pin, kind in kinds.items():
        if node.kind == "block" and random.random() < 0.2:
            continue
        within = [one for one in made if one is not node or loops]
        fits = [(one.id, name) for one in within for name, gives in _outputs(one).items()
                if gives == ("INT" if kind == "typed" else kind) and (kind != "typed" or one.kind == "value")
                and (loops or one.id < node.id) and not (node.kind == "inout" and one.kind == "inout")]
        boxes = [source for source in fits if made[source[0] - 1].kind in ("function", "block")]
        node.feeds[pin] = [random.choice(boxes if boxes and random.random() < 0.6 else fits)]
        if kind == "BOOL" and random.random() < 0.15 and (other := random.choice(fits)) not in node.feeds[pin]:
            node.feeds[pin].append(other)
    if node.text == "Step":
        node.through = random.choice([one.id for one in made if one.kind in ("value", "inout") and one.text in NUMBERS])


def _type(name: str) -> str:
    return "BOOL" if name in BITS + INPUTS else "INT"


def _outputs(node: Node) -> dict[str, str]:
    if node.kind in ("value", "inout"):
        return {"": _type(node.text)}
    if node.kind == "function":
        return {"OUT": FUNCTIONS[node.text][0]}
    return BLOCKS[node.text][1] if node.kind == "block" else {}


def drawn(nodes: list[Node]) -> bytes:
    """The document of a diagram."""
    declared = [variable(name) for name in INPUTS + BITS] + [variable(name, "INT") for name in NUMBERS]
    declared += [f'<variable name="i{node.id}"><type><derived name="{node.text}"/></type></variable>'
                 for node in nodes if node.kind == "block"]
    return document(STEP, pou("".join(map(_element, nodes)), "".join(declared), language="FBD"))


def _element(node: Node) -> str:
    def written(sources: list[Source]) -> str:
        return " ".join(f"{number}.{pin}" if pin else str(number) for number, pin in sources)

    at, marks = f"{node.x},{node.y}", f'executionOrderId="{node.number}"'
    if node.kind == "value":
        return value(node.id, node.text, at=at)
    if node.kind == "sink":
        return result(node.id, written(node.feeds[""]), node.text, marks, at)
    if node.kind == "inout":
        reached = wires(written(node.feeds[""])) if node.feeds else "<connectionPointIn/>"
        return (f'<inOutVariable localId="{node.id}"><position x="{node.x}" y="{node.y}"/>{reached}<connectionPointOut/>'
                f"<expression>{node.text}</expression></inOutVariable>")
    if node.kind in ("jump", "label"):
        reached = wires(written(node.feeds[""])) if node.feeds else ""
        return (f'<{node.kind} localId="{node.id}" label="{node.text}"><position x="{node.x}" y="{node.y}"/>{reached}'
                f"</{node.kind}>")
    inputs = " ".join(f"{pin}={'+'.join(written([source]) for source in sources)}" for pin, sources in node.feeds.items())
    return block(node.id, node.text, inputs, ",".join(_outputs(node)), f"i{node.id}" if node.kind == "block" else "", at, marks,
                 f"n={node.through}" if node.through else "")


# --- what they do -----------------------------------------------------------------------------------------------------


class Model:
    """Executes a diagram in one of the orders of Beremiz and OpenPLC Editor, or in that of networks."""

    def __init__(self, nodes: list[Node], order: str) -> None:
        self.nodes = {node.id: node for node in nodes}
        self.variables: dict[str, Any] = dict.fromkeys(INPUTS + BITS, False) | dict.fromkeys(NUMBERS, 0)
        self.pins: dict[int, dict[str, Any]] = {}
        for node in nodes:
            types = _outputs(node) | (BLOCKS[node.text][0] if node.kind == "block" else {})
            self.pins[node.id] = {name: False if kind == "BOOL" else 0 for name, kind in types.items()}
        self.networks: list[list[Node]] = [[]]
        self.rereads = order != "network"
        """Whether a variable is read wherever its value is used, and not once: an in-out at its turn, another one for its first
        use, also at an in-out of a block."""
        if order == "network":
            self._divide(nodes)
        else:
            begun: set[int] = set()
            for node in _candidates(nodes, order):
                self._generate(node, begun)

    def _generate(self, node: Node, begun: set[int]) -> None:
        if node.id in begun:
            return
        begun.add(node.id)
        sources = [source for sources in node.feeds.values() for source in sources]
        for number, _ in sources:
            if self.nodes[number].kind in ("function", "block") and not (node.number and node.kind in ("function", "block")):
                self._generate(self.nodes[number], begun)
        self.networks[0].append(node)

    def _divide(self, nodes: list[Node]) -> None:
        """Networks by their topmost node; in each, what is ready by number, then from top to bottom and from left to right."""
        place = {node.id: at for at, node in enumerate(nodes)}
        joined = {node.id: {node.id} for node in nodes}
        for node in nodes:
            for number in _needs(node):
                if joined[number] is not joined[node.id]:
                    joined[node.id] |= joined[number]
                    for one in joined[number]:
                        joined[one] = joined[node.id]
        groups = {id(group): group for group in joined.values()}.values()

        def where(number: int) -> tuple[int, int, int]:
            return self.nodes[number].y, self.nodes[number].x, place[number]

        for group in sorted(groups, key=lambda group: min(map(where, group))):
            done: list[int] = []
            while len(done) < len(group):
                ready = [number for number in group
                         if number not in done and all(one in done for one in _needs(self.nodes[number]))]
                done.append(min(ready, key=lambda number: (self.nodes[number].number or 99, where(number))))
            self.networks.append([self.nodes[number] for number in done])

    def scan(self, inputs: dict[str, bool]) -> dict[str, Any]:
        """One scan; returns the variables."""
        self.variables |= inputs
        at = 0
        while at < len(self.networks):
            leaves = [self._execute(node) for node in self.networks[at]]
            labels = [place for place, network in enumerate(self.networks) if any(node.kind == "label" for node in network)]
            at = labels[0] if any(leaves) else at + 1
        return dict(self.variables)

    def _execute(self, node: Node) -> bool:
        """Execute a node; whether it is a jump that is taken at the end of its network."""
        if node.is_sink:
            self.variables[node.text] = self._at(node.feeds[""])
        if node.kind == "value":
            self.pins[node.id].pop("", None)
        elif node.kind == "inout":
            self.pins[node.id][""] = self._read(node)
        elif node.kind == "function":
            self.pins[node.id]["OUT"] = FUNCTIONS[node.text][2](*(self._at(feeds) for feeds in node.feeds.values()))
        elif node.kind == "block":
            self.pins[node.id] |= {pin: self._at(feeds) for pin, feeds in node.feeds.items()}
            if node.through:
                self._of(self.nodes[node.through], "")
            _call(node.text, self.pins[node.id], self.variables, self.nodes[node.through].text if node.through else "")
        return node.kind == "jump" and bool(self._at(node.feeds[""]))

    def _at(self, feeds: list[Source]) -> Any:
        values = [self._of(self.nodes[number], pin) for number, pin in feeds]
        return any(values) if len(values) > 1 else values[0]

    def _of(self, node: Node, pin: str) -> Any:
        if node.kind in ("value", "inout") and self.rereads:
            return self._read(node)
        if node.kind == "value":
            self.pins[node.id].setdefault("", self._read(node))
        return self.pins[node.id][pin]

    def _read(self, node: Node) -> Any:
        return 3 if node.text == "INT#3" else self.variables[node.text]


def _needs(node: Node) -> Iterator[int]:
    """The nodes that must be evaluated in front of a node."""
    yield from (number for sources in node.feeds.values() for number, _ in sources)
    if node.through:
        yield node.through


def _candidates(nodes: list[Node], order: str) -> list[Node]:
    numbered = sorted((node for node in nodes if node.number), key=lambda node: node.number)
    sinks = [node for node in nodes if node.is_sink and not node.number]
    blocks = [node for node in nodes if node.kind in ("function", "block") and not node.number]
    if order == "document":
        return [*numbered, *sinks, *blocks]
    if order == "beremiz1":
        return [*numbered, *sorted(sinks, key=_place), *sorted(blocks, key=_place)]
    together = [node for node in nodes if node in {*sinks, *blocks}]
    return [*numbered, *(sorted(together, key=_place) if order == "position" else together)]


def _place(node: Node) -> tuple[int, int]:
    return node.y, node.x
