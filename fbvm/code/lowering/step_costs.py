"""Step costs: how much of the step budget each piece of a body charges.

A *region* is a body, or the body of a loop, without the loops inside.  A region charges at its start the number of its
statements; or, if that is more, what its work comes to: the operations of long expressions, functions that take longer than an
operator, and the bytes and characters of values that are moved, compared and searched, by the sizes that are declared.  A single
statement that moves much charges for itself, so that a copy of a large array costs nothing where the program does not come to it.

All of this is known when a body is lowered, so every engine charges the same, and the default budget ends any loop within
about a second: a step is the time of a simple statement, and so is the work that is counted as one."""

from __future__ import annotations

from collections.abc import Callable
from operator import is_
from typing import Any

from fbvm.check.declarations.specs import MAX_STRING
from fbvm.check.symbols.statement_lists import bodies
from fbvm.code.operations import TEXT_UNITS, Block, Node
from fbvm.syntax import tree

UNITS_A_STEP = 1024
"""Units of work that are charged as one step."""
OPERATION = 32
"""Units of an operation, and of an address."""
LARGE = 16 * UNITS_A_STEP
"""Units from which on a statement charges for itself."""
MOVED_BYTE, TEXT_BYTE, READ_BYTE = 1, 2, 8
"""Units of a byte that is copied as it is; of a byte of a text, whose end has to be found; of one that is searched or read as a
literal."""
CALCULATED, TEXT_MADE, VALUE_WRITTEN, VALUE_READ = 128, 2 * UNITS_A_STEP, 8 * UNITS_A_STEP, 32 * UNITS_A_STEP
"""Units that do not depend on a size: of a function such as SIN or EXPT; of one that makes a text of another; of a value that is
written as a text, and of one that is read from a text.  They are measured in Python, where these take longest."""

_LOOPS = tree.For | tree.While | tree.Repeat
_PLAIN = frozenset((tree.Assign, tree.CallStatement))
"""Statements without statements inside."""


def step_cost(statements: tree.Block) -> int:
    """The number of statements of a block, without those inside loops and behind __TRY, which charge for themselves."""
    total = 0
    for statement in statements:
        total += 1
        if type(statement) in _PLAIN:
            continue
        if isinstance(statement, tree.Try):
            total += step_cost(statement.handler) + step_cost(statement.final or ())
        elif not isinstance(statement, _LOOPS):
            total += sum(step_cost(inner) for inner in bodies(statement))
    return total


def with_costs(code: Block) -> Block:
    """The code of a body in which each region charges what its work comes to.

    code: begins with the charge of the body, and the head of each loop with that of the loop.  Each has a number of steps, here
    that of the statements, and a site."""
    costs = _Costs(code[0][2])
    code, work = costs.region(code)
    return _charging(code, work)


def _charging(block: Block, work: int) -> Block:
    """A block whose first operation charges at least the steps that so many units of work are."""
    name, count, site = block[0]
    steps = work // UNITS_A_STEP
    return block if steps <= count else ((name, steps, site), *block[1:])


class _Costs:
    """Works out the costs of one body, from its first statement to the last.  `site` is that of the statement it has come to."""

    def __init__(self, site: int) -> None:
        self.site = site
        self.lengths: dict[int, int] = {}
        """The most characters of the text in each temporary that has one."""

    def region(self, block: Block) -> tuple[Block, int]:
        """A block in which loops and large statements charge what is theirs, and the units of all others."""
        total, found = 0, []
        for node in block:
            name = node[0]
            if name == "observe":
                if node[1] == "statement":
                    self.site = node[2]
            elif name in _NESTED:
                node, units = _NESTED[name](self, node)
                total += units
            else:
                units = self.units(node)
                if name == "let" and node[2] in TEXT_UNITS:
                    self.lengths[node[1]] = self.length(node[3])
                if units >= LARGE:
                    found.append(("charge", units // UNITS_A_STEP, self.site))
                else:
                    total += units
            found.append(node)
        same = len(found) == len(block) and all(map(is_, found, block))
        return block if same else tuple(found), total

    def units(self, node: Node) -> int:
        """The units of an operation with all its operands."""
        total, todo = 0, [node]
        for item in todo:  # which grows
            total += OPERATION
            if item[0] in _SIZED:
                total += _SIZED[item[0]](self, item)
            for part in item:
                if type(part) is tuple and part:
                    todo.append(part)
        return total

    def length(self, node: Node) -> int:
        """The most characters that a text can have."""
        name = node[0]
        if name == "const":
            return len(node[2])
        if name == "load_text":
            return int(node[3])
        if name == "tmp":
            return self.lengths.get(node[2], MAX_STRING)
        if name in _SHORT:
            return _SHORT[name]
        parts = [self.length(part) for part in _texts(node)]
        return min(MAX_STRING, sum(parts) if name in _JOINING else max(parts, default=MAX_STRING))

    def bytes_of(self, node: Node) -> int:
        """The most bytes of the texts that an operation works on, and of the one that it makes."""
        texts = [*_texts(node), *([node] if node[1] in TEXT_UNITS else ())]
        return sum(self.length(text) * TEXT_UNITS[text[1]] for text in texts)


def _texts(node: Node) -> list[Node]:
    """The operands of an operation that are texts."""
    parts = node[3] if node[0] == "mux" else node[2:]
    return [part for part in parts if type(part) is tuple and len(part) > 1 and part[1] in TEXT_UNITS]


# --- statements with statements inside --------------------------------------------------------------------------------


def _if(costs: _Costs, node: Node) -> tuple[Node, int]:
    rows, otherwise = node[1:]
    total, found, same = OPERATION, [], True
    for condition, block in rows:
        inner, units = costs.region(block)
        total += costs.units(condition) + units
        same = same and inner is block
        found.append((condition, inner))
    inner, units = costs.region(otherwise)
    if same and inner is otherwise:
        return node, total + units
    return ("if", tuple(found), inner), total + units


def _case(costs: _Costs, node: Node) -> tuple[Node, int]:
    _, form, value, rows, otherwise = node
    total, found = OPERATION + costs.units(value), []
    for labels, block in rows:
        inner, units = costs.region(block)
        total += units
        found.append((labels, inner))
    inner, units = costs.region(otherwise)
    return ("case", form, value, tuple(found), inner), total + units


def _loop(costs: _Costs, node: Node) -> tuple[Node, int]:
    """A loop, which is a region of its own: the one around it charges nothing for it."""
    (head, first), (body, second), (tail, third) = map(costs.region, node[1:])
    return ("loop", _charging(head, first + second + third), body, tail), 0


_NESTED: dict[str, Callable[[_Costs, Node], tuple[Node, int]]] = {"if": _if, "case": _case, "loop": _loop}

# --- operations whose work depends on a size --------------------------------------------------------------------------

_Cost = Callable[[_Costs, Node], int]


def _moved(costs: _Costs, node: Node) -> int:
    return TEXT_BYTE * costs.bytes_of(node)


def _made(costs: _Costs, node: Node) -> int:
    return TEXT_MADE + _moved(costs, node)


def _read(costs: _Costs, node: Node) -> int:
    return READ_BYTE * costs.bytes_of(node)


def _compared(costs: _Costs, node: Node) -> int:
    return TEXT_BYTE * costs.bytes_of(node) if node[2] in TEXT_UNITS else 0


def _chosen(costs: _Costs, node: Node) -> int:
    return TEXT_BYTE * costs.bytes_of(node) if node[1] in TEXT_UNITS else 0


def _loaded(costs: _Costs, node: Node) -> int:
    return TEXT_BYTE * int(node[3]) * TEXT_UNITS[node[1]]


_SIZED: dict[Any, _Cost] = {
    "load_text": _loaded,
    **dict.fromkeys(("left", "right", "mid", "concat", "insert", "delete", "replace", "recode"), _made),
    **dict.fromkeys(("length", "store_text"), _moved),
    **dict.fromkeys(("find", "characters", "units_of"), _read),
    **dict.fromkeys(("from_text", "from_leading"), lambda costs, node: VALUE_READ + _read(costs, node)),
    **dict.fromkeys(("to_text", "enum_text"), lambda costs, node: VALUE_WRITTEN),
    **dict.fromkeys(("math", "atan2", "pow"), lambda costs, node: CALCULATED),
    **dict.fromkeys(("eq", "ne", "lt", "le", "gt", "ge"), _compared),
    **dict.fromkeys(("select", "mux", "min", "max", "let"), _chosen),
    "copy": lambda costs, node: MOVED_BYTE * int(node[3]),
    "fill": lambda costs, node: MOVED_BYTE * len(node[2]),
    "reverse": lambda costs, node: TEXT_BYTE * int(node[2]),
}
"""By name of the operation: the units that it has besides its own."""
_JOINING = ("concat", "insert", "replace")
"""Operations that make a text as long as those that it is made of."""
_SHORT = {"to_text": 64, "enum_text": 64, "character": 1}
"""The most characters that are made of a value; names of enumerations are seldom longer."""
