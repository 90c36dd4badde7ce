"""The sequence in which the generator of Beremiz and OpenPLC Editor evaluates the objects of a diagram, and CODESYS a CFC.

The generator goes through the sinks of a body, and through its blocks, and writes what each needs in front of it, a block once.
A block counts as written before its inputs are looked at: so a wire that comes back to it carries the value of the pass before.
Contacts are part of the expressions that they stand in front of, and are written for each anew.
A variable that a diagram reads and writes at one place (inOutVariable) is written at its turn; whoever reads it does not wait for
that.

In a CFC every output and every block has a number, and is executed at that number: what it takes of a block that comes later is
the value of the pass before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cmp_to_key

from fbvm.interchange.plcopen.read.diagram import Object, Wire
from fbvm.interchange.plcopen.read.producer import ALL_BY_POSITION, BY_NUMBER, IDS, SINKS_BY_POSITION

ROW = 10
"""Objects whose y differ by less stand in one row (Beremiz, `SortInstances`)."""
OUTPUTS = ("outVariable", "inOutVariable", "coil", "condition")
Cut = set[tuple[Object, Wire]]


def sequence(objects: Iterable[Object], order: str) -> tuple[list[Object], Cut]:
    """The objects in the order of their evaluation, and the wires, each with its consumer, that carry the value of the pass
    before.  Objects that feed nothing with an effect come last."""
    items = list(objects)
    run = _Generation(frozenset(items), ("block", *OUTPUTS) if order == BY_NUMBER else ("block",))
    for candidate in _candidates(items, order):
        run.add(candidate)
    for item in items:
        run.add(item)
    return run.made, run.cut


def _candidates(items: list[Object], order: str) -> list[Object]:
    """Sinks and blocks, in the order in which the generator begins with them."""
    numbered = sorted((item for item in items if item.order and item.kind in ("outVariable", "inOutVariable", "block")),
                      key=lambda item: item.order)
    plain = [item for item in items if item not in set(numbered)]
    outputs = [item for item in plain if item.kind in OUTPUTS]
    blocks = [item for item in plain if item.kind == "block"]
    by_position = cmp_to_key(_by_position)
    if order in (IDS, BY_NUMBER):
        return [*numbered, *(item for item in plain if item.kind in (*OUTPUTS, "block"))]
    if order == SINKS_BY_POSITION:
        return [*numbered, *sorted(outputs, key=by_position), *sorted(blocks, key=by_position)]
    if order == ALL_BY_POSITION:
        return [*numbered, *sorted((item for item in plain if item.kind in (*OUTPUTS, "block")), key=by_position)]
    return [*numbered, *outputs, *blocks]


def _by_position(first: Object, second: Object) -> int:
    apart = first.x - second.x if abs(first.y - second.y) < ROW else first.y - second.y
    return (apart > 0) - (apart < 0)


class _Generation:
    """One pass of the generator over a body."""

    def __init__(self, inside: frozenset[Object], waiting: tuple[str, ...]) -> None:
        self.inside, self.waiting = inside, waiting
        self.made: list[Object] = []
        self.cut: Cut = set()
        self.begun: set[Object] = set()
        self.done: set[Object] = set()

    def add(self, start: Object) -> None:
        """Add an object behind all blocks that it needs, unless it is there already."""
        if start in self.begun:
            return
        self.begun.add(start)
        todo = [(start, self._blocks(start))]
        while todo:
            item, blocks = todo[-1]
            block = next((one for one in blocks if one not in self.begun), None)
            if block is None:
                todo.pop()
                self._finish(item)
            else:
                self.begun.add(block)
                todo.append((block, self._blocks(block)))

    def _blocks(self, item: Object) -> Iterator[Object]:
        """The blocks that are to be called in front of an object, also those behind contacts, in the order of the wires."""
        seen: set[Object] = set()
        todo = [] if self._numbered(item) else self._sources(item)[::-1]
        while todo:
            source = todo.pop().source
            if source.kind == "block":
                yield source
            elif source not in seen:
                seen.add(source)
                todo += self._sources(source)[::-1]

    def _finish(self, start: Object) -> None:
        """Add an object behind the contacts and variables in front of it.  These wait for nothing: their wires from blocks
        that are still to be called are cut."""
        todo = [(start, iter(self._sources(start)))]
        while todo:
            item, wires = todo[-1]
            wire = next((one for one in wires if one.source not in self.done), None)
            if wire is None:
                todo.pop()
                self.done.add(item)
                self.made.append(item)
            elif wire.source.kind == "block" or any(wire.source is one for one, _ in todo):
                self.cut.add((item, wire))
            else:
                self.begun.add(wire.source)
                todo.append((wire.source, iter(self._sources(wire.source))))

    def _numbered(self, item: Object) -> bool:
        """Whether an object reads blocks that are still to come as they are: one of these kinds with an executionOrderId does."""
        return item.kind in self.waiting and item.order > 0

    def _sources(self, item: Object) -> list[Wire]:
        """The wires into an object; variables that are read and written at one place are not waited for."""
        return [wire for pin in item.pins for wire in pin.wires
                if wire.source in self.inside and wire.source.kind != "inOutVariable"]
