"""Which values of the memory are in local variables of Python, too, at the place that is being written.

All values stay in the memory, where anybody finds them after a run or a trap; but what a body has just stored or loaded need not
be read from there again: a local variable takes Python a tenth of the time.  A value is forgotten at a store that may change
it, and where branches meet that do not agree.  In a loop only what nothing else in it may change is held from pass to pass.
Of integers the least and greatest value are known, too, so that wraps and checks that cannot happen are left out."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from typing import Any

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.arithmetic import limits
from fbvm.code.operations import INTEGERS, SIZES, Address, Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.effects import Effects, Spans, located
from fbvm.engine.python.writer import view
from fbvm.engine.ranges import Range, RangeOf

MOST_NAMES = 250
"""Variables of one body for values that are held: each costs at every call."""
SLOT = 8
"""Bytes of the largest value, at whose multiples no value begins and ends in two places."""
Key = tuple[str, str, int]
"""Machine type, base and offset of a value in the memory; ("tmp", "", number) is a temporary, whose range is known."""
State = dict[Key, Range | None]
"""What is held, with the range of integers."""
INVERSE = {"lt": "ge", "ge": "lt", "gt": "le", "le": "gt", "eq": "ne", "ne": "eq"}


def full_range(machine: str) -> Range | None:
    return limits(machine) if machine in INTEGERS else None


class Held:
    """What is held while one body is written.

    `loads` are those of the body.  `state` is None where nothing is to be held, as behind a RETURN.  `instance` is the byte at
    which the body's only instance begins, if it is known, and `instances` are the bytes between which all lie, None if that is
    unknown.  `range_of` says what is known anywhere in the body.  `must` are the values that a loop around holds, which every
    store has to keep up to date."""

    def __init__(self, loads: Iterable[Node], effects: Effects, instance: int | None, instances: Range | None,
                 range_of: RangeOf) -> None:  # fmt: skip
        self.state: State | None = {}
        self.must: frozenset[Key] = frozenset()
        self.exits: list[list[State | None]] = []
        self._effects, self._instance, self._instances, self._range_of = effects, instance, instances, range_of
        self._loads = Counter(self.key(machine, address) for _, machine, address in loads)
        self._names: dict[Key, str] = {}
        self._slots: defaultdict[tuple[str, int], list[Key]] = defaultdict(list)

    def key(self, machine: str, address: Address) -> Key | None:
        """The key of a place whose value may be held; None for others."""
        base, offset, terms = located(address, self._instance)
        if terms or isinstance(base, tuple) or offset % SIZES[machine] or (base == "abs" and offset < PAGE_BYTES):
            return None
        return machine, base, offset

    def name(self, key: Key) -> str:
        """The local variable of a value."""
        return self._names[key]

    def worth(self, key: Key | None, times: int) -> bool:
        """True if it is worth while to hold a value, which the body loads in so many places at least."""
        if key is None or self.state is None or (self._loads[key] < times and key not in self.must):
            return False
        if key not in self._names:
            if len(self._names) >= MOST_NAMES:
                return False
            machine, base, offset = key
            self._names[key] = f"{view(machine)}_{'at_' if base == 'abs' else ''}{offset}".replace("-", "before_")
            self._slots[base, offset // SLOT].append(key)
        return True

    def range(self, key: Key | None) -> Range | None:
        """The range of an integer that is held, or of a temporary."""
        return self.state.get(key) if self.state and key else None

    def hold(self, key: Key, range_: Range | None) -> None:
        if self.state is not None:
            self.state[key] = range_

    # --- what ends

    def forget(self, node: Node, range_of: RangeOf, but: Key | None = None) -> None:
        """Forgets what a statement may have stored elsewhere than at `but`."""
        if self.state:
            self._drop(self.state, self._effects.of(node, self._instance, range_of), but)

    def _drop(self, state: State, spans: Spans, but: Key | None) -> None:
        if spans is None:
            state.clear()
            return
        for base, first, end in spans:
            near: Iterable[Key] = [key for key in state if key[1] == base]
            if end - first <= SLOT:
                near = [key for slot in {first // SLOT, (end - 1) // SLOT} for key in self._slots.get((base, slot), ())]
            for key in near:
                if key != but and key[2] < end and first < key[2] + SIZES[key[0]]:
                    state.pop(key, None)
            self._drop_aliases(state, base, first, end)

    def _drop_aliases(self, state: State, base: str, first: int, end: int) -> None:
        """Where it is not known at which byte the instance begins, places of the memory may be places in it."""
        low, high = self._instances or (first, end)
        if base == "self":
            start, stop = (low + first, high + end) if self._instances else (0, 1 << 62)
            for key in [key for key in state if key[1] == "abs" and key[2] < stop and start < key[2] + SIZES[key[0]]]:
                del state[key]
        elif low < end and first < high:
            for key in [key for key in state if key[1] == "self"]:
                del state[key]

    # --- branches and loops

    def copy(self) -> State | None:
        return None if self.state is None else dict(self.state)

    def begin_loop(self, loop: Node) -> frozenset[Key]:
        """Makes the state that of the head of a loop: what is held in front of it, and no statement in it forgets.  Returns
        what is for `end_loop`."""
        around = self.must
        if self.state is not None:
            self._keep_through(self.state, loop)
        self.must = frozenset(key for key in self.state or () if key[0] != "tmp")
        self.exits.append([])
        return around

    def _keep_through(self, state: State, loop: Node) -> None:
        for node in statements((loop,)):
            if node[0] in ("let", "attempt"):
                state.pop(("tmp", "", node[1 if node[0] == "let" else 3]), None)
            if node[0] == "let":
                continue
            key = self.key(node[1], node[2]) if node[0] == "store" else None
            self._drop(state, self._effects.of(node, self._instance, self._range_of), key)
            if key and key in state:
                state[key] = full_range(key[0])

    def exit(self) -> None:
        """Here the innermost loop is left."""
        self.exits[-1].append(self.state)
        self.state = None

    def end_loop(self, around: frozenset[Key]) -> None:
        self.must = around
        self.meet(self.exits.pop())

    def enter(self) -> tuple[bool, frozenset[Key]]:
        """Begins a function of Python, which has local variables of its own.  Returns what is for `leave`."""
        around = self.state is not None, self.must
        self.state, self.must = ({} if around[0] else None), frozenset()
        return around

    def leave(self, around: tuple[bool, frozenset[Key]]) -> list[Key]:
        """Goes back to the function around, which has to load again what its loops hold: the keys."""
        holds, self.must = around
        self.state = {key: full_range(key[0]) for key in self.must} if holds else None
        return sorted(self.must)

    def meet(self, states: Iterable[State | None]) -> None:
        """The state where ways meet: what is held on each of them."""
        reached = [state for state in states if state is not None]
        if len(reached) < 2:
            self.state = reached[0] if reached else None
            return
        self.state = {key: _around([state[key] for state in reached]) for key in min(reached, key=len)
                      if all(key in state for state in reached)}

    def learn(self, condition: Node, truth: bool) -> None:
        """Narrows the ranges of what a condition compares with constants, where the condition is `truth`."""
        if self.state is None:
            return
        name = condition[0]
        if name == "not":
            self.learn(condition[2], not truth)
        elif (name in ("and", "and_then") and truth) or (name in ("or", "or_else") and not truth):
            self.learn(condition[2], truth)
            self.learn(condition[3], truth)
        elif name in INVERSE and condition[3][0] == "load" and condition[4][0] == "const":
            key = self.key(condition[3][1], condition[3][2])
            known = self.range(key)
            if key and known:
                low, high = _narrowed(name if truth else INVERSE[name], condition[4][2], *known)
                self.state[key] = (low, high) if low <= high else known


def _narrowed(name: str, number: int, low: int, high: int) -> Range:
    if name in ("lt", "le"):
        return low, min(high, number - (name == "lt"))
    if name in ("gt", "ge"):
        return max(low, number + (name == "gt")), high
    return (max(low, number), min(high, number)) if name == "eq" else (low, high)


def _around(ranges: list[Range | None]) -> Range | None:
    known = [each for each in ranges if each]
    return (min(low for low, _ in known), max(high for _, high in known)) if known else None


def uses(code: Block) -> tuple[list[Node], bool]:
    """The loads of a body, once for each place where they stand, and whether it reaches something by a reference."""
    found: list[Node] = []
    references = False
    rest: list[tuple[Any, ...]] = [code]
    while rest:
        for part in rest.pop():
            if part.__class__ is tuple and part and part[0] != "observe":
                if part[0] == "load":
                    found.append(part)
                elif part[0] == "ref" and part[1].__class__ is tuple:
                    references = True
                rest.append(part)
    return found, references
