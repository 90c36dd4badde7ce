"""Writes the expressions of one body as Python: names, addresses, and three forms of an operand.

Inside a sum or product integers stay Python's own and are wrapped into their type once, at the end; a wrap that cannot happen is
left out.  Expressions nested deeper than Python's parser allows are moved into functions of their own."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from fbvm.base.arithmetic import limits, width
from fbvm.code.operations import INTEGERS, SIZES, Address, Node
from fbvm.engine.effects import located
from fbvm.engine.ranges import Range, is_float, mask, never_wraps, value_range

DEEPEST = 24
"""Levels of nodes in one Python expression: at most four parentheses each, where Python takes 200 in all."""
LONGEST_TWICE = 40
"""Characters of an expression that may be written twice, of which one is executed."""
ARITHMETIC = ("add", "sub", "mul", "neg", "abs", "convert")
"""Integer operations whose number is cut to the width at its end."""


class Rows(NamedTuple):
    """The tables of rows, by operation.

    `values` write the very value and are called with the operands.  `loose` and `conditions` are shortcuts, called with the
    node: they write a number that is still to be wrapped into its type, and something that is true in Python for TRUE."""

    values: Mapping[str, Callable[..., str]]
    loose: Mapping[str, Callable[[Expressions, Node], str]]
    conditions: Mapping[str, Callable[[Expressions, Node], str]]


_QUOTED = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"")


def view(machine: str) -> str:
    """The name of the view of a machine type in generated code."""
    return "u1" if machine == "b" else machine


def bare(text: str) -> str:
    """The same expression without the pair of parentheses around all of it, if it has one.

    >>> bare("(a + b)"), bare("(a) + (b)")
    ('a + b', '(a) + (b)')
    """
    if not text.startswith("(") or not text.endswith(")"):
        return text
    depth = 0
    for at, letter in enumerate(_QUOTED.sub(lambda quoted: "_" * len(quoted[0]), text)):
        depth += (letter == "(") - (letter == ")")
        if depth == 0 and at < len(text) - 1:
            return text
    return text[1:-1]


def plus(text: str, number: int) -> str:
    """The expression `text` plus a constant.

    >>> plus("b1", 4), plus("b1", 0), plus("12", -2)
    ('b1 + 4', 'b1', '10')
    """
    if text.isdigit():
        return str(int(text) + number)
    return text if number == 0 else f"{text} + {number}" if number > 0 else f"{text} - {-number}"


class Expressions(ABC):
    """Writes the expressions of one body.

    `constants` are objects by the names under which generated code finds them; `base` is the byte at which the body's only
    instance begins, None if there are several or that is unknown.  Known afterwards: `own`, the types of the views of its
    instance that the code uses, `views`, the names of those of the whole memory, and `routines`, functions that the body has to
    define."""

    def __init__(self, rows: Rows, constants: dict[str, Any]) -> None:
        self.rows = rows
        self.constants = constants
        self.base: int | None = None
        self.own: set[str] = set()
        self.views: set[str] = set()
        self.routines: list[list[str]] = []
        self.perhaps = 0
        """How many parts of expressions around may stay unevaluated."""
        self.apart = False
        """True inside an expression that becomes a function of its own."""
        self._depth = 0
        self._names = 0

    def name(self, letter: str) -> str:
        """A local name that nothing else uses."""
        self._names += 1
        return f"{letter}{self._names}"

    def once(self, text: str) -> tuple[str, str]:
        """Python that works something out, and Python for its value from then on."""
        if text.isidentifier() or text.isdigit():
            return text, text
        v = self.name("v")
        return f"({v} := {bare(text)})", v

    def constant(self, value: Any) -> str:
        """The name of an object that is made once."""
        name = f"K{len(self.constants) + 1}"
        self.constants[name] = value
        return name

    # --- three ways to read an expression

    def value(self, node: Node) -> str:
        """Python for the very value; a BOOL is False or True."""
        return self._descend(node, self._value)

    def loose(self, node: Node) -> str:
        """Python for a number that becomes the value when it is brought into its type (low bits, or 32-bit float)."""
        return self._descend(node, self._loose)

    def condition(self, node: Node) -> str:
        """Python for something that is true if the BOOL is TRUE."""
        return self._descend(node, self._condition)

    def _descend(self, node: Node, how: Callable[[Node], str]) -> str:
        outer = self._depth
        deep = outer >= DEEPEST and node[0] not in ("const", "tmp")
        self._depth = 0 if deep else outer + 1
        inside, self.apart = self.apart, self.apart or deep
        text = how(node)
        self._depth, self.apart = outer, inside
        if not deep:
            return text
        name = self.name("e")
        self.routines.append([f"def {name}():", f"    return {text}"])
        return f"{name}()"

    def _value(self, node: Node) -> str:
        return self.rows.values[node[0]](self, *node[1:])

    def _loose(self, node: Node) -> str:
        name, machine = node[0], node[1]
        row = self.rows.loose.get(name) if is_float(machine) or name in ARITHMETIC else None
        return row(self, node) if row else self._value(node)

    def _condition(self, node: Node) -> str:
        row = self.rows.conditions.get(node[0])
        return row(self, node) if row else self._value(node)

    def aside(self, read: Callable[[Node], str], node: Node) -> str:
        """What `read` writes of a part that may stay unevaluated."""
        self.perhaps += 1
        text = read(node)
        self.perhaps -= 1
        return text

    # --- what a build that holds values in local variables does otherwise

    @abstractmethod
    def kept(self, machine: str, address: Address) -> str | None:
        """Python for what an item of the memory holds, if that need not be read from there."""

    @abstractmethod
    def known_range(self, node: Node) -> Range | None:
        """What is known of the value of a load or temporary besides its type."""

    def rounded(self, node: Node, text: str) -> str:
        """Python for the value of `node`, whose number, not yet rounded to 32 bits, is `text`."""
        return self.bring(text, "f32")

    def range_of(self, node: Node) -> Range:
        """The least and greatest value of an integer expression at this place."""
        return self.known_range(node) or value_range(node, self.range_of)

    def never_wraps(self, node: Node) -> bool:
        """True if the number that an integer operation yields always fits its type."""
        return never_wraps(node, self.range_of)

    def bring(self, text: str, machine: str) -> str:
        """Python for a number brought into its type."""
        if machine == "f32":
            return f"single({bare(text)})"
        if machine == "b":
            return f"({text} & 1 != 0)"
        low, high = limits(machine)
        if low == 0:
            return f"({text} & {high})"
        first, v = self.once(text)
        return f"({v} if {low} <= {first} <= {high} else ({v} + {-low} & {high - low}) - {-low})"

    def stored(self, machine: str, node: Node) -> tuple[str, str]:
        """The type of the view and Python for what is stored there: cheaper than the value where the view rounds."""
        if is_float(machine):
            if (node[0] == "const" and node[2] == node[2]) or (node[0] == "convert" and not is_float(node[2])):
                return machine, self.value(node)
            first, v = self.once(self.loose(node))
            return machine, f"{v} if {first} == {v} else NAN"
        if machine in INTEGERS and node[0] in ARITHMETIC and not self.never_wraps(node):
            return f"u{width(machine)}", f"{self.loose(node)} & {mask(machine)}"
        return machine, bare(self.value(node))

    # --- addresses

    def known(self, address: Address) -> Address:
        """The address as one of the buffer if the body's instance is known."""
        return located(address, self.base)

    def place(self, address: Address, count: int) -> str:
        """Python for the byte offset of an address whose `count` bytes are used."""
        base, offset, terms = self.known(address)
        if isinstance(base, tuple):
            _, reference, site = base
            delta = self._sum("", offset, [(stride, term) for stride, term in terms])
            return f"at({bare(self.value(reference))}, {delta}, {count}, {site})"
        return self._sum("b1" if base == "self" else "", offset, list(terms))

    def cell(self, address: Address, machine: str) -> tuple[str, str]:
        """Python for the view in which a place without reference is an item, and for its index there."""
        base, offset, terms = self.known(address)
        size = SIZES[machine]
        if offset % size or any(stride % size for stride, _ in terms):
            return view(machine), f"{self.place(address, size)} >> {size.bit_length() - 1}"
        if base == "self":
            self.own.add(machine)
        else:
            self.views.add(view(machine))
        return f"{view(machine)}{'s' * (base == 'self')}", bare(self._sum("", offset // size, [(s // size, t) for s, t in terms]))

    def item(self, address: Address, machine: str) -> str:
        """Python for a place without reference as an item of a view."""
        return "{}[{}]".format(*self.cell(address, machine))

    def _sum(self, base: str, offset: int, terms: list[tuple[int, Node]]) -> str:
        parts = [base] if base else []
        for stride, term in terms:
            text = self.value(term)
            parts.append(text if stride == 1 else f"{text} * {stride}")
        if not parts:
            return str(offset)
        text = plus(" + ".join(parts), offset)
        return text if text in parts and "*" not in text else f"({text})"
