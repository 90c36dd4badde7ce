"""Rungs that are stored as cells, to instructions: the bodies of function blocks, and rungs that call one.

An element stands in a cell of a grid.  Power enters at the left edge of column 0.  Contacts, lines and instructions in series
lead from the left edge of their column to that of the next; a vertical line joins the left edges of two rows.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import NoReturn

from fbvm.interchange.cx.read.project import Elements, FunctionBlock
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Pin, drawn_contact, joined
from fbvm.syntax.ladder.drawing.network import INLINE, Nets
from fbvm.syntax.ladder.drawing.steps import steps
from fbvm.syntax.ladder.drawing.wires import BUS, SINK, Net
from fbvm.syntax.ladder.instructions.instruction_set import instruction_set, spelling
from fbvm.syntax.ladder.text import instruction_text

CONTACT, COIL, HORIZONTAL, VERTICAL, INSTRUCTION, BLOCK, PIN = "1", "2", "3", "4", "5", "7", "8"
"""Kinds of elements."""
_CONTACTS = {"0": " ", "1": "↑", "8": "/"}
_COILS = {"0": " ", "8": "/"}
"""Attributes of contacts and coils in bodies of function blocks -> their marks."""
_LEAST_WORDS = {CONTACT: 1, COIL: 1, INSTRUCTION: 1, BLOCK: 2, PIN: 2}
"""Kinds of elements -> how many words they have at least: a name, and for blocks and pins what they belong to."""
BLOCK_COLUMNS = 2
"""Columns that the box of a function block is wide."""

Definition = Callable[[str], tuple[str, FunctionBlock] | None]
"""Finds the definition of an instance: its name in the sources, and what it has."""


class ElementError(Exception):
    """Elements that cannot be taken over; the argument says why."""


@dataclass(frozen=True)
class _Element:
    x: int
    y: int
    kind: str
    words: tuple[str, ...]
    """Name and operands."""
    attribute: str = "0"
    in_series: bool = False


def instructions(elements: Elements, definition: Definition) -> list[str]:
    """The lines of a rung.  Raises ElementError."""
    read = _of_block if elements.separator == "," else _of_program
    found = []
    for row, _ in elements.rows:
        try:
            one = read(row.split(elements.separator))
            if len(one.words) < _LEAST_WORDS.get(one.kind, 0):
                raise ValueError("words are missing")
            found.append(one)
        except (IndexError, ValueError):
            raise ElementError(f"the element {row.replace(elements.separator, ' ')!a} is not understood") from None
    network = _Cells(sorted(found, key=lambda one: (one.y, one.x)), definition)
    bar = network.diagram()
    if not bar.outs:
        raise ElementError("nothing hangs on the left bar")
    return [instruction_text(one.prefix + one.mnemonic, *one.operands) for one in steps(bar)]


def _of_block(fields: list[str]) -> _Element:
    """x, y, connections at the left and at the right, number of pairs, kind, and pairs of a text and its attribute."""
    x, y, _, right, _, kind, *pairs = fields
    words = tuple(text.strip().replace("^", ",") for text in pairs[::2])
    return _Element(int(x), int(y), kind.strip(), words, pairs[1].strip() if len(pairs) > 1 else "0", right.strip() == "1")


def _of_program(fields: list[str]) -> _Element:
    """x, y, kind; behind these two numbers, the name, the operands, and the class of the element: 2 stands in series."""
    x, y, kind, *more = fields
    return _Element(int(x), int(y), kind, tuple(more[2:-1]), "", bool(more) and more[-1] in ("1", "2"))


class _Cells(Nets):
    """The nets of a rung of cells."""

    def __init__(self, elements: list[_Element], definition: Definition) -> None:
        super().__init__()
        self.definition = definition
        self._above: dict[Hashable, Hashable] = {}
        self._pins = [one for one in elements if one.kind == PIN]
        for one in elements:
            if one.kind == HORIZONTAL:
                self._join((one.x, one.y), (one.x + 1, one.y))
            elif one.kind == VERTICAL:
                self._join((one.x, one.y), (one.x, one.y + 1))
        self._starts = {self._net(one.x, one.y + (one.kind == BLOCK)).name
                        for one in elements if one.kind not in (HORIZONTAL, VERTICAL, PIN)}
        for one in elements:
            if one.kind not in (HORIZONTAL, VERTICAL, PIN):
                self._place(one)

    def bad(self, part: object, message: str, hint: str) -> NoReturn:
        """Raises ElementError."""
        raise ElementError(f"{message} ({hint})")

    def _root(self, name: Hashable) -> Hashable:
        while name in self._above:
            name = self._above[name]
        return name

    def _join(self, one: tuple[int, int], other: tuple[int, int]) -> None:
        first, second = self._net(*one).name, self._net(*other).name
        if first != second:
            kept, gone = (first, second) if first == BUS else (second, first)
            self._above[gone] = kept

    def _net(self, x: int, y: int) -> Net:
        return Net(self._root(BUS if x == 0 else (x, y)), (y,))

    def _place(self, one: _Element) -> None:
        start = self._net(one.x, one.y)
        if one.kind == BLOCK:
            self._block(one)
        elif one.kind == CONTACT and one.attribute:
            if one.attribute not in _CONTACTS:
                raise ElementError(f"a contact with the attribute {one.attribute} is not known ({' '.join(one.words)})")
            mark = _CONTACTS[one.attribute]
            contact = drawn_contact(-1, "@" if mark == "↑" else "", "NOT" if mark == "/" else "", one.words)
            self._series(start, one, contact)
        elif one.kind == COIL and one.attribute:
            if one.attribute not in _COILS:
                raise ElementError(f"a coil with the attribute {one.attribute} is not known ({' '.join(one.words)})")
            self.add_output(start, Coil(-1, _COILS[one.attribute], one.words))
        elif one.kind in (CONTACT, COIL, INSTRUCTION):
            self._instruction(one, start)
        else:
            raise ElementError(f"an element of the kind {one.kind} is not known ({' '.join(one.words)})")

    def _series(self, start: Net, one: _Element, part: object) -> None:
        end = self._net(one.x + 1, one.y)
        if start.name == end.name:
            raise ElementError(f"a line leads around {' '.join(one.words)}")
        self.add_edge(start, end.name, part)  # type: ignore[arg-type]

    def _instruction(self, one: _Element, start: Net) -> None:
        name, *operands = one.words
        bare = name.lstrip("!@%")
        prefix = name[:len(name) - len(bare)]
        mnemonic, bracket, code = bare.partition("(")
        how = joined(mnemonic) or joined("LD" + mnemonic)
        if spelling(mnemonic) in INLINE:
            self._series(start, one, Box(-1, mnemonic, through=True))
        elif one.in_series and how is not None and (how[1] or operands):
            self._series(start, one, drawn_contact(-1, prefix, how[1] + (bracket + code if how[1] != "NOT" else ""),
                                                   tuple(operands)))
        elif spelling(mnemonic) in ("OUT", "OUTNOT", "OUT NOT"):
            self.add_output(start, Coil(-1, prefix + ("/" if "NOT" in mnemonic.upper() else " " * (not prefix)), tuple(operands)))
        else:
            row = instruction_set().rows.get(spelling(mnemonic))
            count = row.inputs if row else 1
            others = [self._net(one.x, one.y + below) for below in range(1, count)]
            self.add_output(start, Box(-1, name, tuple(operands)), others)

    def _block(self, one: _Element) -> None:
        instance = one.words[1]
        found = self.definition(instance)
        if found is None:
            raise ElementError(f"there is no definition of the function block of {instance}")
        name, block = found
        top, right = one.y, one.x + BLOCK_COLUMNS
        pins: list[Pin] = []
        for usage, column in (("1", one.x - 1), ("2", right)):
            variables = [variable for variable in block.variables if variable.usage == usage]
            for pin in (pin for pin in self._pins if pin.x == column and pin.y >= top + 2):
                position = pin.y - top - 2
                if position >= len(variables):
                    break
                pins.append(Pin(variables[position].name, pin.words[1], usage == "2"))
        end = self._net(right, top + 1).name
        box = Box(-1, name, (), (), True, instance, tuple(pins), ("EN",), "ENO")
        self.add_edge(self._net(one.x, top + 1), end if end in self._starts else SINK, box)
