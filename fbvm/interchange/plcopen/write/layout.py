"""Elements of a ladder diagram with their places: contacts in columns, branches in rows, wires with corners."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import MNEMONIC

LEFT, COLUMN, ROW, GAP = 20, 110, 60, 40
"""Units of the drawing: the x of the rail, and the distances of columns, rows and networks."""
SYMBOL_WIDTH, SYMBOL_HEIGHT = 21, 15
"""Size of a contact and of a coil, as Beremiz draws them."""
RAIL_WIDTH, VARIABLE_WIDTH, VARIABLE_HEIGHT, BLOCK_WIDTH, PIN = 3, 80, 25, 90, 25
AXIS = 20
"""How far below a row's top its wire runs."""


@dataclass(frozen=True)
class End:
    """An output from which wires may come: the number of its element, its pin, and its position."""

    id: int
    pin: str
    x: int
    y: int


Ends = tuple[End, ...]


class Drawing:
    """The drawing of one body: `elements` grows from top to bottom."""

    def __init__(self) -> None:
        self.elements: list[Element] = []
        self.top = GAP
        self.number = 0
        self.first = 0
        """Number of elements before those of the network at work."""

    def next_id(self) -> int:
        self.number += 1
        return self.number

    def y(self, row: int) -> int:
        """Where the wire of a row runs."""
        return self.top + row * ROW + AXIS

    def x(self, column: int) -> int:
        return LEFT + 60 + column * COLUMN

    # --- elements ---

    def comment(self, text: str) -> None:
        lines = text.splitlines() or [""]
        self.elements.append(element("comment", _position(LEFT, self.top), element("content", element("xhtml:p", text)),
                                     localId=self.next_id(), height=20 * len(lines), width=600))
        self.top += 20 * len(lines) + 20

    def rail(self) -> tuple[Element, End]:
        """Begin a network with its left rail; the outputs of the rail are added by `close`."""
        self.first = len(self.elements)
        made = element("leftPowerRail", _position(LEFT, self.top), localId=self.next_id(), height=ROW, width=RAIL_WIDTH)
        self.elements.append(made)
        return made, End(self.number, "", LEFT + RAIL_WIDTH, self.y(0))

    def symbol(self, kind: str, variable: str, ends: Ends, column: int, row: int, **marks: str) -> End:
        """A contact or a coil."""
        x, y = self.x(column), self.y(row)
        made = element(kind, _position(x, y - SYMBOL_HEIGHT // 2), wired(ends, x, y, 0, SYMBOL_HEIGHT // 2),
                       element("connectionPointOut", _relative(SYMBOL_WIDTH, SYMBOL_HEIGHT // 2)), element("variable", variable),
                       localId=self.next_id(), height=SYMBOL_HEIGHT, width=SYMBOL_WIDTH, **{"negated": "false", **marks})
        self.elements.append(made)
        return End(self.number, "", x + SYMBOL_WIDTH, y)

    def in_variable(self, text: str, x: int, y: int) -> End:
        """A value; `x` is where it ends."""
        made = element("inVariable", _position(x - VARIABLE_WIDTH, y - VARIABLE_HEIGHT // 2),
                       element("connectionPointOut", _relative(VARIABLE_WIDTH, VARIABLE_HEIGHT // 2)),
                       element("expression", text), localId=self.next_id(), height=VARIABLE_HEIGHT, width=VARIABLE_WIDTH,
                       negated="false")
        self.elements.append(made)
        return End(self.number, "", x, y)

    def out_variable(self, text: str, end: End, y: int | None = None) -> None:
        """A variable right of an output, in its row or where the wire of another row runs."""
        x, y = end.x + 30, end.y if y is None else y
        self.elements.append(element(
            "outVariable", _position(x, y - VARIABLE_HEIGHT // 2), wired((end,), x, y, 0, VARIABLE_HEIGHT // 2),
            element("expression", text), localId=self.next_id(), height=VARIABLE_HEIGHT, width=VARIABLE_WIDTH, negated="false"))

    def block(self, kind: str, instance: str, inputs: list[tuple[str, Ends | str]], outputs: list[tuple[str, str]], column: int,
              row: int, mnemonic: str = "") -> dict[str, End]:
        """A block; returns the ends of its outputs by name.  Each input is a name with the wires or the text that it takes, each
        output a name with the variable that gets it, or "".  `mnemonic` is kept as fbvm's own data."""
        x, y = self.x(column), self.y(row) - PIN
        pins: list[Element] = []
        values = [(name, (self.in_variable(what, x - 20, y + PIN * (at + 1)),) if isinstance(what, str) else what)
                  for at, (name, what) in enumerate(inputs)]
        number = self.next_id()
        for at, (name, ends) in enumerate(values, 1):
            pins.append(element("variable", wired(ends, x, y + PIN * at, 0, PIN * at), formalParameter=name))
        made_ends, outs = {}, []
        for at, (name, _) in enumerate(outputs, 1):
            point = element("connectionPointOut", _relative(BLOCK_WIDTH, PIN * at))
            outs.append(element("variable", point, formalParameter=name))
            made_ends[name] = End(number, name, x + BLOCK_WIDTH, y + PIN * at)
        named = {"typeName": kind, **({"instanceName": instance} if instance else {})}
        height = PIN * (max(len(inputs), len(outputs)) + 1)
        made = element("block", _position(x, y), element("inputVariables", *pins), element("inOutVariables"),
                       element("outputVariables", *outs), own_data(MNEMONIC, mnemonic) if mnemonic else None,
                       localId=number, **named, height=height, width=BLOCK_WIDTH)
        self.elements.append(made)
        for name, variable in outputs:
            if variable:
                self.out_variable(variable, made_ends[name])
        return made_ends

    def output(self, block: Element, pin: str) -> End:
        """The end of an output of a block that is drawn already; the block gets the output if it has none of that name."""
        outs = block.all("outputVariables")[0]
        names = [one.get("formalParameter").upper() for one in outs.all("variable")]
        if pin.upper() not in names:
            outs.content.append(element("variable", element("connectionPointOut", _relative(BLOCK_WIDTH, PIN * (len(names) + 1))),
                                        formalParameter=pin))
            names.append(pin.upper())
            block.attributes["height"] = str(max(int(block.get("height")), PIN * (len(names) + 1)))
        at, place = names.index(pin.upper()) + 1, block.all("position")[0]
        return End(int(block.get("localId")), outs.all("variable")[at - 1].get("formalParameter"),
                   int(place.get("x")) + BLOCK_WIDTH, int(place.get("y")) + PIN * at)

    def close(self, rail: Element, coils: list[End], columns: int, rows: int) -> None:
        """Finish a network: the right rail, and as many outputs of the left one as it needs."""
        height = max(rows, 1) * ROW
        rail.attributes["height"] = str(height)
        wired_rows = sorted({int(position.get("y")) for made in self.elements[self.first:] for point in made.walk()
                             for wire in point.all("connection") if wire.get("refLocalId") == rail.get("localId")
                             for position in wire.all("position")[-1:]})
        rail.content += [element("connectionPointOut", _relative(RAIL_WIDTH, y - self.top), formalParameter="")
                         for y in wired_rows or [self.y(0)]]
        if coils:
            x = self.x(columns)
            points = [wired((end,), x, end.y, 0, end.y - self.top) for end in coils]
            self.elements.append(element("rightPowerRail", _position(x, self.top), *points, localId=self.next_id(), height=height,
                                         width=RAIL_WIDTH))
        self.top += height + GAP

    def skip(self, rows: int) -> None:
        """Finish a network that has no rails."""
        self.top += rows * ROW + GAP


def own_data(name: str, text: str) -> Element:
    """An `addData` that only fbvm understands."""
    return element("addData", element("data", element("text", text), name=name, handleUnknown="discard"))


def _position(x: int, y: int) -> Element:
    return element("position", x=x, y=y)


def _relative(x: int, y: int) -> Element:
    return element("relPosition", x=x, y=y)


def wired(ends: Ends, x: int, y: int, in_x: int, in_y: int) -> Element:
    """A connectionPointIn at a place, with a wire from each end."""
    wires = []
    for end in ends:
        corner = [(x - 15, y), (x - 15, end.y)] if end.y != y else []
        path = [(x, y), *corner, (end.x, end.y)]
        named = {"formalParameter": end.pin} if end.pin else {}
        wires.append(element("connection", *(_position(*point) for point in path), refLocalId=end.id, **named))
    return element("connectionPointIn", _relative(in_x, in_y), *wires)
