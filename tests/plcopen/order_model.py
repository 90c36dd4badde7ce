"""A second reading of the orders of evaluation: random diagrams of function blocks, and what they do scan by scan.

Written from the rules alone, without the code of the import.  In the orders of Beremiz and OpenPLC Editor: sinks and blocks are
gone through in their order (`_candidates`); each has what it needs called in front of it, a block once; a block counts as called
before its inputs are looked at, so a wire that comes back to it carries what it last gave; a block with a number does not have
others called, and takes what they last gave.  In the order `network`: networks from top to bottom, in each of them producers in
front of consumers, each element once; a loop is cut at a wire out of a variable, else at one into the block that comes first;
a jump skips the networks up to its label, a return all that follow.  In the order `number` (CFC) all that is executed has a
number, and nothing else counts.

A contact lets power through while its variable is TRUE, a coil passes on what reaches it; a generator reads contacts anew for
each output.  A box whose EN is FALSE is not executed, its ENO is FALSE, and an output variable at it is not written (at
its ENO: by a generator alone); its outputs stay as they are, but a function of a generator gives the first value of its type
then, and its coils are written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from random import Random
from typing import Any

from drawings import RAIL, block, coil, contact, document, pou, result, value, variable, wires

BITS, NUMBERS, INPUTS = ("u", "v"), ("k", "n"), ("a", "b")
POWERED = ("contact", "coil", "jump", "return")
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
    """An element: `kind` is value, sink, function, block, inout, rail, contact, coil, jump, label or return; `text` its variable,
    function, type or label; `feeds` by pin what is wired to it; `number` its executionOrderId; `through` the variable node at its
    in-out; `marks` are negated, set or reset."""

    id: int
    kind: str
    text: str
    x: int
    y: int
    number: int = 0
    feeds: dict[str, list[Source]] = field(default_factory=dict)
    through: int = 0
    has_en: bool = False
    marks: str = ""

    @property
    def is_sink(self) -> bool:
        return self.kind in ("sink", "coil") or (self.kind == "inout" and bool(self.feeds))

    @property
    def is_box(self) -> bool:
        return self.kind in ("function", "block")


def diagram(random: Random, loops: bool, numbers: bool, jumps: int = 0, power: bool = False, cfc: bool = False) -> list[Node]:
    """A diagram of one worksheet, with `loops` of wires, `numbers` of execution, and `jumps` to a label in its middle; with
    `power` one that has contacts, coils, EN, ENO, and with jumps also a return; a `cfc` numbers all that is executed."""
    made: list[Node] = []
    if power:
        made.append(Node(1, "rail", "", 0, 0))

    def add(kind: str, text: str) -> Node:
        made.append(Node(len(made) + 1, kind, text, random.randrange(8) * 40, random.randrange(12) * 20))
        return made[-1]

    for text in (*INPUTS, *BITS, *NUMBERS, "INT#3"):
        add("value", text)
    for text in random.sample(BITS + NUMBERS, 0 if cfc else 3):
        add("inout", text)
    for _ in range(random.randint(3, 9)):
        function = random.random() < 0.6
        add("function" if function else "block", random.choice([*FUNCTIONS] if function else [*BLOCKS]))
        made[-1].has_en = (power or cfc) and random.random() < 0.4
    for _ in range(random.randint(4, 8)):
        add("sink", random.choice(BITS + NUMBERS))
        for kind in ("contact", "coil") if power else ():
            add(kind, random.choice(BITS + INPUTS if kind == "contact" else BITS))
            made[-1].marks = random.choice(("", "", "negated", *(("set", "reset") if kind == "coil" else ())))
    if power:
        _in_another_order(random, made)
    if power and jumps:
        add("return", "").y = random.randrange(12) * 20
    for _ in range(jumps):
        add("jump", "middle").y = random.randrange(5) * 20
    for node in made:
        _wire(random, made, node, loops, add)
    if jumps:
        add("label", "middle").y = 110
    if power:
        made.sort(key=lambda node: (node.kind != "rail", random.random()))
    else:
        random.shuffle(made)
    for node in random.sample(made, len(made) // 2) if numbers else ():
        node.number = random.randint(1, 30) if node.kind in ("function", "block", "sink") else 0
    if cfc:
        for number, node in enumerate(random.sample([node for node in made if node.is_box or node.is_sink], len(made) - 7), 1):
            node.number = number
        return made
    taken = [node.number for node in made if node.number]
    for node in made:
        if taken.count(node.number) > 1:
            node.number = 0
    return made


def _in_another_order(random: Random, made: list[Node]) -> None:
    """Number the nodes behind the first ones anew, so that contacts stand in front of boxes and behind them."""
    behind = [node for node in made if node.kind not in ("rail", "value", "inout")]
    numbers = [node.id for node in behind]
    random.shuffle(behind)
    for number, node in zip(numbers, behind, strict=True):
        node.id = number
    made.sort(key=lambda node: node.id)


def _wire(random: Random, made: list[Node], node: Node, loops: bool, add: Callable[[str, str], Node]) -> None:
    """Wire the inputs of a node at random; without `loops`, to nodes in front of it."""
    kinds = {"": _type(node.text)} if node.kind == "sink" else {"": "BOOL"} if node.kind in POWERED else {}
    if node.kind == "inout" and random.random() < 0.4:
        kinds = {"": _type(node.text)}
    elif node.kind in ("function", "block"):
        kinds = FUNCTIONS[node.text][1] if node.kind == "function" else BLOCKS[node.text][0]
        kinds = ({"EN": "BOOL"} if node.has_en else {}) | kinds
    for pin, kind in kinds.items():
        if node.kind == "block" and pin != "EN" and random.random() < 0.2:
            continue
        within = [one for one in made if one is not node or loops]
        fits = [(one.id, name) for one in within for name, gives in _outputs(one).items()
                if gives == ("INT" if kind == "typed" else kind) and (kind != "typed" or one.kind == "value")
                and (loops or one.id < node.id) and not (node.kind == "inout" and one.kind == "inout")
                and not (one.kind in ("contact", "coil") and node.kind in ("contact", "coil") and one.id >= node.id)]
        boxes = [source for source in fits if made[source[0] - 1].kind in ("function", "block", "contact")]
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
    if node.kind in ("rail", "contact", "coil"):
        return {"": "BOOL"}
    eno = {"ENO": "BOOL"} if node.has_en else {}
    if node.kind == "function":
        return eno | {"OUT": FUNCTIONS[node.text][0]}
    return eno | BLOCKS[node.text][1] if node.kind == "block" else {}


def drawn(nodes: list[Node], cfc: bool = False) -> bytes:
    """The document of a diagram; a CFC stands in data of CODESYS beside an empty text."""
    declared = [variable(name) for name in INPUTS + BITS] + [variable(name, "INT") for name in NUMBERS]
    declared += [f'<variable name="i{node.id}"><type><derived name="{node.text}"/></type></variable>'
                 for node in nodes if node.kind == "block"]
    if cfc:
        made = pou("", "".join(declared), language="ST").replace("</ST>", '</ST><addData><data name="http://www.3s-software.com/'
                   f'plcopenxml/cfc" handleUnknown="implementation"><CFC>{"".join(map(_element, nodes))}</CFC></data></addData>')
        return document(STEP, made)
    language = "LD" if any(node.kind == "rail" for node in nodes) else "FBD"
    return document(STEP, pou("".join(map(_element, nodes)), "".join(declared), language=language))


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
    if node.kind == "rail":
        return RAIL
    if node.kind in ("contact", "coil"):
        said = {"": "", "negated": 'negated="true"'}.get(node.marks, f'storage="{node.marks}"')
        return (contact if node.kind == "contact" else coil)(node.id, written(node.feeds[""]), node.text, said, at)
    if node.kind in ("jump", "label", "return"):
        reached = wires(written(node.feeds[""])) if node.feeds else ""
        label = f' label="{node.text}"' if node.text else ""
        return (f'<{node.kind} localId="{node.id}"{label}><position x="{node.x}" y="{node.y}"/>{reached}'
                f"</{node.kind}>")
    inputs = " ".join(f"{pin}={'+'.join(written([source]) for source in sources)}" for pin, sources in node.feeds.items())
    return block(node.id, node.text, inputs, ",".join(_outputs(node)), f"i{node.id}" if node.kind == "block" else "", at, marks,
                 f"n={node.through}" if node.through else "")


# --- what they do -----------------------------------------------------------------------------------------------------


class Model:
    """Executes a diagram in one of the orders of Beremiz and OpenPLC Editor, in that of networks, or by number."""

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
        self.generates = order not in ("network", "ids", "number")
        self.cut: set[tuple[int, Source]] = set()
        """Wires, by the number of their consumer, that carry the value of the pass before."""
        self.executed: set[int] = set()
        """Boxes that have been executed in this pass."""
        if order == "network":
            self._divide(nodes)
        elif order == "number":
            self.networks[0] = sorted((node for node in nodes if node.number), key=lambda node: node.number)
        else:
            begun: set[int] = set()
            for node in _candidates(nodes, order):
                self._generate(node, begun)

    def _generate(self, node: Node, begun: set[int]) -> None:
        if node.id in begun:
            return
        begun.add(node.id)
        for source in self._boxes(node):
            if not (node.number and node.is_box):
                self._generate(source, begun)
        self.networks[0].append(node)

    def _boxes(self, node: Node) -> Iterator[Node]:
        """The boxes whose values reach a node, also through contacts and coils, in the order of the wires."""
        todo, seen = [number for sources in node.feeds.values() for number, _ in sources][::-1], set()
        while todo:
            source = self.nodes[todo.pop()]
            if source.is_box:
                yield source
            elif source.kind in ("contact", "coil") and source.id not in seen:
                seen.add(source.id)
                todo += [number for number, _ in source.feeds[""]][::-1]

    def _divide(self, nodes: list[Node]) -> None:
        """Networks by their topmost node; in each, what is ready by number, then from top to bottom and from left to right."""
        place = {node.id: at for at, node in enumerate(nodes)}
        joined = {node.id: {node.id} for node in nodes}
        for node in nodes:
            for number, _ in self._needs(node):
                if joined[number] is not joined[node.id] and self.nodes[number].kind != "rail":
                    joined[node.id] |= joined[number]
                    for one in joined[number]:
                        joined[one] = joined[node.id]
        groups = {id(group): group for group in joined.values() if self.nodes[min(group)].kind != "rail"}.values()

        def where(number: int) -> tuple[int, int, int]:
            return self.nodes[number].y, self.nodes[number].x, place[number]

        for group in sorted(groups, key=lambda group: min(map(where, group))):
            done: list[int] = []
            while len(done) < len(group):
                left = [number for number in sorted(group, key=place.__getitem__) if number not in done]
                ready = [number for number in left if not self._waits(number, left)]
                if ready:
                    done.append(min(ready, key=lambda number: (self.nodes[number].number or 99, where(number))))
                    continue
                loops = [(number, source) for number in left for source in self._waits(number, left)
                         if self._leads(number, source[0], left)]
                self.cut.add(min(loops, key=lambda wire: (self.nodes[wire[1][0]].kind != "inout", not self.nodes[wire[0]].is_box,
                                                          self.nodes[wire[0]].number or 99, where(wire[0]))))
            self.networks.append([self.nodes[number] for number in done])

    def _waits(self, number: int, left: list[int]) -> list[Source]:
        """The wires from nodes that are not evaluated yet, for which a node waits."""
        return [source for source in self._needs(self.nodes[number]) if source[0] in left and (number, source) not in self.cut]

    def _leads(self, start: int, end: int, left: list[int]) -> bool:
        """Whether wires lead from one node to another."""
        reached, todo = {end}, [end]
        while todo:
            todo = [source for number in todo for source, _ in self._waits(number, left) if source not in reached]
            reached.update(todo)
        return start in reached

    def _needs(self, node: Node) -> Iterator[Source]:
        """The wires that end at a node; those into a coil in place of one from a coil, which passes its power on."""
        todo = [source for sources in node.feeds.values() for source in sources][::-1]
        seen: set[int] = set()
        while todo:
            source = todo.pop()
            if self.nodes[source[0]].kind != "coil":
                yield source
            elif source[0] not in seen:
                seen.add(source[0])
                todo += self.nodes[source[0]].feeds[""][::-1]
        if node.through:
            yield node.through, ""

    def scan(self, inputs: dict[str, bool]) -> dict[str, Any]:
        """One scan; returns the variables."""
        self.variables |= inputs
        self.executed = set()
        at = 0
        while at < len(self.networks):
            leaves = [node.kind for node in self.networks[at] if self._execute(node)]
            if leaves and leaves[0] == "return":
                break
            labels = [place for place, network in enumerate(self.networks) if any(node.kind == "label" for node in network)]
            at = labels[0] if leaves else at + 1
        return dict(self.variables)

    def _execute(self, node: Node) -> bool:
        """Execute a node; whether it is a jump or return that is taken at the end of its network."""
        if node.is_sink:
            self._write(node)
        if node.kind == "value":
            self.pins[node.id].pop("", None)
        elif node.kind == "inout":
            self.pins[node.id][""] = self._read(node)
        elif node.kind == "contact":
            self.pins[node.id][""] = self._contact(node)
        elif node.is_box:
            self._box(node)
        return node.kind in ("jump", "return") and bool(self._at(node, ""))

    def _box(self, node: Node) -> None:
        pins = self.pins[node.id]
        self.executed.add(node.id)
        given = {pin: self._at(node, pin) for pin in node.feeds}
        enabled = given.pop("EN", True)
        if node.has_en:
            pins["ENO"] = enabled
        if node.kind == "function":
            if enabled:
                pins["OUT"] = FUNCTIONS[node.text][2](*given.values())
            elif self.generates:
                pins["OUT"] = False if FUNCTIONS[node.text][0] == "BOOL" else 0
            return
        if node.through:
            self._of(self.nodes[node.through], "")
        if enabled:
            pins |= given
            _call(node.text, pins, self.variables, self.nodes[node.through].text if node.through else "")

    def _write(self, node: Node) -> None:
        """Write the variable of a sink."""
        power, sources = self._at(node, ""), node.feeds[""]
        box = self.nodes[sources[0][0]]
        if len(sources) == 1 and (sources[0][1] != "ENO" or self.generates) and box.has_en and box.id in self.executed \
                and not (node.kind == "coil" and self.generates) and not self.pins[box.id]["ENO"]:
            return
        if node.marks not in ("set", "reset"):
            self.variables[node.text] = power != (node.marks == "negated") if node.marks else power
        elif power:
            self.variables[node.text] = node.marks == "set"

    def _at(self, node: Node, pin: str, consumer: int = 0) -> Any:
        """The value at a pin, for the node `consumer` behind it if that takes it through coils."""
        consumer = consumer or node.id
        values = [self._read(self.nodes[number]) if self.nodes[number].kind == "inout" and (consumer, (number, name)) in self.cut
                  else self._of(self.nodes[number], name, consumer) for number, name in node.feeds[pin]]
        return any(values) if len(values) > 1 else values[0]

    def _of(self, node: Node, pin: str, consumer: int = 0) -> Any:
        if node.kind == "rail":
            return True
        if node.kind == "coil":
            return self._at(node, "", consumer)
        if node.kind == "contact" and self.rereads:
            return self._contact(node)
        if node.kind in ("value", "inout") and self.rereads:
            return self._read(node)
        if node.kind == "value":
            self.pins[node.id].setdefault("", self._read(node))
        return self.pins[node.id][pin]

    def _contact(self, node: Node) -> bool:
        return bool(self._at(node, "")) and self.variables[node.text] != (node.marks == "negated")

    def _read(self, node: Node) -> Any:
        return 3 if node.text == "INT#3" else self.variables[node.text]


def _candidates(nodes: list[Node], order: str) -> list[Node]:
    numbered = sorted((node for node in nodes if node.number), key=lambda node: node.number)
    sinks = [node for node in nodes if node.is_sink and not node.number]
    blocks = [node for node in nodes if node.is_box and not node.number]
    if order == "document":
        return [*numbered, *sinks, *blocks]
    if order == "beremiz1":
        return [*numbered, *sorted(sinks, key=_place), *sorted(blocks, key=_place)]
    together = [node for node in nodes if node in {*sinks, *blocks}]
    return [*numbered, *(sorted(together, key=_place) if order == "position" else together)]


def _place(node: Node) -> tuple[int, int]:
    return node.y, node.x
