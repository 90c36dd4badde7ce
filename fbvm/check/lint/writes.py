"""Warnings about outputs that are written twice, and timers that are called conditionally.

One pass over a body in the order of execution.  An output is visible outside of its body: a located variable, an address, a
global variable, an output of the POU.  A value that is given to it counts as lost if the same block gives it another one
before anything may have read the first.  A default that a branch overrides is therefore none of these.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from typing import Any

from fbvm.base.areas import OUTPUT_AREAS, Address
from fbvm.base.types import BOOL, base
from fbvm.check.expressions.writes import place
from fbvm.check.lint.body import Body
from fbvm.check.symbols.facts import PouCall, Variable
from fbvm.syntax import tree
from fbvm.syntax.tree import il, ladder, sfc

SCANNED = frozenset((
    "R_TRIG", "F_TRIG", "TP", "TON", "TOF", "CTU", "CTD", "CTUD",
    *(f"{name}_{kind}" for name in ("TP", "TON", "TOF") for kind in ("TIME", "LTIME")), "LTP", "LTON", "LTOF",
    *(f"{name}_{kind}" for name in ("CTU", "CTD", "CTUD") for kind in ("DINT", "LINT", "UDINT", "ULINT")),
))
"""Standard blocks that see an edge or time only if they are called in every scan (tables 44 to 46)."""
MANY_WORDS = 16
"""An access to more words than that counts as one to the whole area."""

_NAMES = (tree.NameRef, tree.Direct)
_FOLLOWING = (tree.Deref, tree.Index)
_PARTS = (*_FOLLOWING, tree.Member, tree.Part)

Key = Hashable
"""A place that can be written: its variable or address, and the steps to the part."""


@dataclass(slots=True)
class _Store:
    """A value given to an output in a block, which nothing has read yet."""

    node: tree.Node
    literal: bool


Definite = dict[Key, tree.Node]
"""Places that a block writes and instances that it calls on every path through it, each with the node."""


class Writes:
    """What the bodies of a project write; `finish` warns of outputs that several bodies write."""

    def __init__(self) -> None:
        self._writers: dict[Key, list[tuple[Body, tree.Node]]] = {}
        self._numbers: dict[Address, tuple[Body, tree.Call]] = {}
        """The first instruction with each timer or counter number, by its completion flag."""

    def body(self, body: Body) -> None:
        """Look at one body."""
        order = _Order(body)
        definite = order.block(body.pou.tree.body)
        order.warn_of_conditional_calls(definite)
        self._count(body)
        for key, node in definite.items():
            if _is_coil(key):
                self._writers.setdefault(key, []).append((body, node))

    def _count(self, body: Body) -> None:
        """Warn of numbers of timers and counters that two instructions use (W474 3-6: each in one of them only)."""
        for node, flag in body.numbered():
            first, call = self._numbers.setdefault(flag, (body, node))
            if call is node:
                continue
            kind = "timer" if flag.area == "TF" else "counter"
            body.warn("S0693", node, f"{kind} number {flag.number} is used twice: both instructions write its completion flag "
                      "and its present value", f"each {kind} needs a number of its own", first.there(call, "used here, too"))

    def finish(self) -> None:
        """Warn of outputs that several POUs write on every path: the last one decides."""
        for key, writers in self._writers.items():
            first = writers[0]
            for body, node in writers[1:]:
                name = key.name if isinstance(key, Variable) else key
                body.warn("S0690", node, f"{name} is written in {first[0].pou.name} and in {body.pou.name}: "
                          "what runs last decides", "let one place decide, and give it the conditions of both",
                          first[0].there(first[1], "written here, too"))


def _is_coil(key: Key) -> bool:
    """True for a bit that is visible outside of its body, and for any output address."""
    if isinstance(key, Address):
        return key.bit is not None or key.area in OUTPUT_AREAS
    return isinstance(key, Variable) and key.owner is None and base(key.type) == BOOL


class _Order:
    """Goes through one body in the order of execution."""

    def __init__(self, body: Body) -> None:
        self.body, self.facts = body, body.facts
        self.stores: dict[Key, dict[tuple[Key, int], _Store]] = {}
        """Values that nothing has read yet, by what a read would name: the variable, or the word of an area."""
        self.coils: dict[tuple[Key, int], tree.Node] = {}
        """Outputs of rungs by their blocks, also those that were read since."""
        self.in_rung = False
        self.blocks = [0]
        self._count = 0
        self.calls: dict[Key, list[tree.Call]] = {}
        """Calls of timers and the like by instance."""

    def block(self, statements: Iterable[tree.Statement]) -> Definite:
        """Go through a block; returns what it does on every path."""
        self._count += 1
        self.blocks.append(self._count)
        definite: Definite = {}
        for statement in statements:
            _STEPS[type(statement)](self, statement, definite)
        self.blocks.pop()
        return definite

    # --- statements -------------------------------------------------------------------------------------------------

    def assign(self, node: tree.Assign, definite: Definite) -> None:
        self.read(node.value)
        literal = self.body.constant(node.value) is not None
        for target in node.targets:
            self.steps(target)
            if node.op == ":=":
                self.write(target, node, literal, definite)
            else:
                self.read(target)

    def call(self, node: tree.CallStatement, definite: Definite) -> None:
        self.read(node.call)
        called = self.facts.calls.get(node.call) if isinstance(node.call, tree.Call) else None
        if isinstance(called, PouCall):
            for _, target, _ in called.outputs:
                self.write(target, target, False, definite)
            if called.instance is not None and (called.pou.name.upper() in SCANNED or called.pou.edges):
                key = place(self.facts, called.instance) or (self.facts.variables.get(self.facts.root(called.instance)),)
                assert isinstance(node.call, tree.Call)
                self.calls.setdefault(key, []).append(node.call)
                definite[key] = node.call

    def choice(self, node: tree.If, definite: Definite) -> None:
        ways = []
        for condition, block in node.branches:
            self.read(condition)
            ways.append(self.block(block))
        ways.append(self.block(node.otherwise or ()))
        self.meet(ways, definite)

    def case(self, node: tree.Case, definite: Definite) -> None:
        self.read(node.selector)
        ways = [self.block(branch.body) for branch in node.branches]
        ways.append(self.block(node.otherwise or ()))
        self.meet(ways, definite)

    def meet(self, ways: list[Definite], definite: Definite) -> None:
        """Add what every branch does to `definite`."""
        for key, node in min(ways, key=len).items():
            if all(key in way for way in ways):
                if isinstance(node, tree.Call):
                    definite[key] = node
                else:
                    self.store(key, ways[0][key], False, definite)

    def loop(self, node: tree.For | tree.While | tree.Repeat, definite: Definite) -> None:
        """The body of FOR counts as executed, that of WHILE does not."""
        if isinstance(node, tree.For):
            for expr in (node.first, node.last, node.step):
                self.read(expr)
        elif isinstance(node, tree.While):
            self.read(node.condition)
        inside = self.block(node.body)
        if isinstance(node, tree.Repeat):
            self.read(node.until)
        if not isinstance(node, tree.While):
            definite.update((key, call) for key, call in inside.items() if isinstance(call, tree.Call))

    def attempt(self, node: tree.Try, definite: Definite) -> None:
        """What is assigned between __TRY and __CATCH may be read by the handler; it counts as executed.

        The place of the code is found only after one of these statements, which leaves nothing unread."""
        for statement in node.body:
            definite.update(self.block((statement,)))
            self.stores.clear()
        self.block(node.handler)
        definite.update(self.block(node.final or ()))

    def body_of(self, node: ladder.Ladder | ladder.Rung | sfc.Sfc | il.InstructionList, definite: Definite) -> None:
        """Go through the statements of rungs or of a chart as through those of the block around them."""
        self.in_rung = isinstance(node, ladder.Rung)
        for statement in node.body:
            _STEPS[type(statement)](self, statement, definite)
        self.in_rung = False

    def leave(self, node: tree.Return | tree.Exit | tree.Continue, definite: Definite) -> None:
        """Forget unread values: after RETURN, EXIT or CONTINUE they may be read."""
        if isinstance(node, tree.Return):
            self.read(node.value)
        self.stores.clear()

    def nothing(self, node: tree.Statement, definite: Definite) -> None:
        """An empty statement does nothing."""

    # --- reading and writing ----------------------------------------------------------------------------------------

    def read(self, expr: tree.Expr | None) -> None:
        """Forget the unread values of all that an expression may read."""
        todo: list[tree.Node | None] = [expr]
        while todo and self.stores:
            node = todo.pop()
            if isinstance(node, _NAMES):
                self.forget(node)
            elif isinstance(node, _FOLLOWING) and not self.facts.is_part(node):
                self.stores.clear()
            called = self.facts.calls.get(node) if isinstance(node, tree.Call) else None
            if isinstance(called, PouCall):
                self.shared_is_read()
                todo += [called.instance, called.enable, *(value for _, value in (*called.inputs, *called.in_outs))]
                for _, target, _ in called.outputs:
                    self.steps(target)
            elif node is not None:
                todo.extend(self.body.below(node))

    def steps(self, target: tree.Expr) -> None:
        """The subscripts of a place that is written are read; a reference to it is no output."""
        while isinstance(target, _PARTS):
            if isinstance(target, tree.Index):
                for subscript in target.subscripts:
                    self.read(subscript)
            target = target.of

    def forget(self, node: tree.NameRef | tree.Direct) -> None:
        variable = self.facts.variables.get(node)
        if node in self.facts.followed or variable is not None and variable.reference:
            self.stores.clear()
        address = variable.location if variable is not None else self.facts.directs.get(node)
        if address is None:
            self.stores.pop(variable, None)
            return
        size_bytes = variable.type.size if variable is not None else max(1, address.size_bits // 8)
        first, last = address.byte_offset() // 2, (address.byte_offset() + size_bytes - 1) // 2
        if last - first < MANY_WORDS:
            for word in range(first, last + 1):
                self.stores.pop((address.area, word), None)
        else:
            self.stores = {root: kept for root, kept in self.stores.items()
                           if not isinstance(root, tuple) or root[0] != address.area}

    def shared_is_read(self) -> None:
        """Forget the unread values that another POU may read: all but outputs of this one."""
        self.stores = {root: kept for root, kept in self.stores.items()
                       if isinstance(root, Variable) and root.owner is self.body.pou and root.location is None}

    def write(self, target: tree.Expr, node: tree.Node, literal: bool, definite: Definite) -> None:
        path = place(self.facts, target)
        if path is None:
            return
        root = path[0]
        if isinstance(root, Variable):
            if root.reference or not (root.location or root.owner is None or root.kind == "VAR_OUTPUT"):
                return
            root = root.location or root
        self.store(root if len(path) == 1 else (root, *path[1:]), node, literal, definite)

    def store(self, key: Key, node: tree.Node, literal: bool, definite: Definite) -> None:
        """Record that a place gets a value in the present block, and warn if its last value was not read."""
        root = key[0] if isinstance(key, tuple) else key
        if isinstance(root, Address):
            root = (root.area, root.byte_offset() // 2)
        known, here = self.stores.setdefault(root, {}), (key, self.blocks[-1])
        before, coil = known.get(here), self.coils.get(here)
        if before is not None and (literal or not before.literal):
            self.written_twice(node, before.node, "is written twice: what it was given before is never used")
        elif self.in_rung and coil is not None:
            self.written_twice(node, coil, "is the output of two rungs: it leaves as the last one says, and only rungs between "
                               "see the first")
        known[here] = _Store(node, literal)
        if self.in_rung:
            self.coils[here] = node
        definite[key] = node

    def written_twice(self, node: tree.Node, before: tree.Node, what: str) -> None:
        shown = node.targets[0] if isinstance(node, tree.Assign) else node
        self.body.warn("S0596", shown, f"{self.body.text(shown)} {what}",
                       "let one statement decide, and give it the conditions of both",
                       self.body.there(before, "written here before"))

    # --- timers -----------------------------------------------------------------------------------------------------

    def warn_of_conditional_calls(self, definite: Definite) -> None:
        """Warn of a timer or its like that is called in one place only, and not on every path.

        Two calls are taken as a deliberate choice."""
        for key, calls in self.calls.items():
            if len(calls) == 1 and key not in definite:
                pou = self.facts.calls[calls[0]]
                assert isinstance(pou, PouCall)
                name = self.body.text(calls[0].callee)
                self.body.warn("S0490", calls[0], f"the {pou.pou.name} {name} is called only on some ways through "
                               f"{self.body.pou.name}: on the others it sees neither its inputs nor the time",
                               "call it in every scan, and let an input carry the condition")


_STEPS: dict[type, Callable[[_Order, Any, Definite], None]] = {
    tree.Assign: _Order.assign, tree.CallStatement: _Order.call, tree.If: _Order.choice, tree.Case: _Order.case,
    tree.For: _Order.loop, tree.While: _Order.loop, tree.Repeat: _Order.loop, tree.Try: _Order.attempt,
    tree.Return: _Order.leave,
    tree.Exit: _Order.leave, tree.Continue: _Order.leave, tree.Empty: _Order.nothing,
    tree.RefusedStatement: _Order.nothing, il.InstructionList: _Order.body_of,
    ladder.Ladder: _Order.body_of, ladder.Rung: _Order.body_of,
    sfc.Sfc: _Order.body_of,
}
