"""The mutation operators: which small mistakes can be made at a node of a tree, as changes of the source text.

The names are those of the literature (Enoiu et al. on function block diagrams; STMutants, arXiv 2606.05499): ROR relational
operator replacement, LRO logical, ARO arithmetic, NIO negation insertion or omission, CRO constant replacement, TRO timers and
other standard blocks, VRO a variable replaced by another one of its type, SRO set for reset, SDL statement deletion, SWAP two
statements in the other order.  See also `rungs` and `charts_and_lists`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise

from fbvm.base.types import fold
from fbvm.campaign.mutation.charts_and_lists import Replacement, Table, of_association, of_list, of_transition
from fbvm.campaign.mutation.mutants import Change
from fbvm.campaign.mutation.rungs import BLOCKS, CYCLE_MS, called, of_ladder
from fbvm.syntax import tree
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.ladder import Ladder
from fbvm.syntax.tree.node import Node, names_of, walk
from fbvm.syntax.tree.sfc import Association, Sfc, Transition

_RELATIONS: Table = {"<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "=": ("<>",), "<>": ("=",)}
_LOGICAL: Table = {"AND": ("OR",), "OR": ("AND",), "XOR": ("OR",), "AND_THEN": ("OR_ELSE",), "OR_ELSE": ("AND_THEN",)}
_ARITHMETIC: Table = {"+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "MOD": ("/",)}
_OPERATORS = {"ROR": _RELATIONS, "LRO": _LOGICAL, "ARO": _ARITHMETIC}
"""What stands for an operator, by the name of the mutation operator."""

_WORD = re.compile(r"[A-Z_]+|\S", re.I)
_JUMP = re.compile(r"JMP\b", re.I)


def changes(text: str, node: tree.Pou) -> Iterator[Change]:
    """The changes of a POU, its methods and its actions, in the order of the text; each text of the POU once."""
    seen = set[tuple[int, int, str]]()
    found = sorted(_replacements(text, node), key=lambda each: each[1:])
    for operator, start, end, new in found:
        if (start, end, new) not in seen and text[start:end] != new:
            seen.add((start, end, new))
            yield Change(operator, start, end, new, node.name.text)


def _replacements(text: str, pou: tree.Pou) -> Iterator[Replacement]:
    specs = _specs(pou)
    others = _others({name: fold(" ".join(text[start:end].split())) for name, (start, end) in specs.items()})
    in_rungs = {name for part in _written(pou) if isinstance(part, Ladder) for name in called(part)}
    for part in _written(pou):
        if isinstance(part, tree.NameRef) and (other := others.get(fold(part.text))):
            yield "VRO", part.start, part.end, other
        elif isinstance(part, Ladder):
            yield from of_ladder(text, part, specs)
        elif isinstance(part, tree.VarDecl) and any(fold(name.text) in in_rungs for name in part.names):
            continue
        yield from _of_node(text, part)


def _of_node(text: str, part: Node) -> Iterator[Replacement]:
    """What is tried at a node by its class, and with the statements in it."""
    for kind, rule in _RULES:
        if isinstance(part, kind) and not _is_made(part):
            yield from rule(text, part)
    for name in names_of(part) if not isinstance(part, Ladder | Sfc | InstructionList) else ():
        yield from _of_statements(text, getattr(part, name))


def _is_made(node: Node) -> bool:
    """True for what a jump and its label are made of: stores and comparisons of a variable that nobody wrote, and the IF or the
    loop that such a comparison decides."""
    test = node.branches[0][0] if isinstance(node, tree.If) else node.until if isinstance(node, tree.Repeat) else node
    name = test.left if isinstance(test, tree.Binary) else test.targets[0] if isinstance(test, tree.Assign) else None
    return isinstance(name, tree.NameRef) and name.text.startswith("$")


def _specs(pou: tree.Pou) -> dict[str, tuple[int, int]]:
    """Where the types of the variables of a POU stand, by names as they are declared."""
    declarations = [each for part in _written(pou) if isinstance(part, tree.VarSection) for each in part.variables]
    return {name.text: (each.spec.start, each.spec.end) for each in declarations for name in each.names}


def _written(pou: tree.Pou) -> Iterator[Node]:
    """The nodes of a POU that stand in its text: not the statements that execute a rung or a chart."""
    left: list[object] = [pou]
    ladders = [each for each in walk(pou) if isinstance(each, Ladder)]
    while left:
        item = left.pop()
        if isinstance(item, tuple):
            left += item
        elif isinstance(item, Ladder):
            yield item
        elif isinstance(item, Sfc):
            yield item
            left += [item.steps, item.transitions]
        elif isinstance(item, InstructionList):
            yield item
            yield from (each for each in walk(item) if isinstance(each, tree.Literal | tree.NameRef))  # at their operands
        elif isinstance(item, tree.Action) and any(item in ladder.subroutines for ladder in ladders):
            continue
        elif isinstance(item, Node) and not (isinstance(item, tree.VarSection) and item.hidden):
            yield item
            left += [getattr(item, name) for name in names_of(item)]


def _others(types: Mapping[str, str]) -> dict[str, str]:
    """For each variable the next one of the same type, and for the last the first; by folded names."""
    by_type: dict[str, list[str]] = {}
    for name, type_ in types.items():
        by_type.setdefault(type_, []).append(name)
    return {fold(name): names[(number + 1) % len(names)] for names in by_type.values() if len(names) > 1
            for number, name in enumerate(names)}  # fmt: skip


# --- expressions ------------------------------------------------------------------------------------------------------


def _binary(text: str, node: Node) -> Iterator[Replacement]:
    assert isinstance(node, tree.Binary)
    written = _WORD.match(text, node.op_start) if node.op not in ("<=", ">=", "<>", "**") else None
    end = written.end() if written else node.op_start + len(node.op)
    for operator, table in _OPERATORS.items():
        for new in table.get(node.op, ()):
            yield operator, node.op_start, end, new


def _condition(text: str, node: Node) -> Iterator[Replacement]:
    """The condition of an IF, a WHILE or a REPEAT, negated."""
    conditions = [condition for condition, _ in node.branches] if isinstance(node, tree.If) else (
        [node.until] if isinstance(node, tree.Repeat) else [node.condition] if isinstance(node, tree.While) else [])  # fmt: skip
    for each in conditions:
        yield "NIO", each.start, each.end, f"NOT ({text[each.start : each.end]})"


def _negation(text: str, node: Node) -> Iterator[Replacement]:
    assert isinstance(node, tree.Unary)
    if node.op == "NOT":
        yield "NIO", node.start, node.end, f"({text[node.operand.start : node.operand.end]})"


def _operand(text: str, node: Node) -> Iterator[Replacement]:
    """A variable beside AND, OR or XOR, negated."""
    assert isinstance(node, tree.Binary)
    if node.op in _LOGICAL:
        for each in (node.left, node.right):
            if isinstance(each, tree.NameRef | tree.Member):
                yield "NIO", each.start, each.end, f"NOT {text[each.start : each.end]}"


def _assigned(text: str, node: Node) -> Iterator[Replacement]:
    """S= for R=, and the other way round: a missing or a wrong reset."""
    assert isinstance(node, tree.Assign)
    swapped = {"S=": "R=", "R=": "S="}.get(node.op.upper())
    found = re.compile(re.escape(node.op), re.IGNORECASE).search(text, node.targets[-1].end, node.value.start)
    if swapped and found:
        yield "SRO", *found.span(), swapped


def _literal(text: str, node: Node) -> Iterator[Replacement]:
    assert isinstance(node, tree.Literal)
    for new in _values(node) if text[node.start : node.end] == node.text else ():  # jumps hold numbers that nobody wrote
        yield "CRO", node.start, node.end, new


def _values(node: tree.Literal) -> Iterator[str]:
    """Other values for a literal: an integer one more or less, TRUE for FALSE, a time a cycle longer or shorter, 0."""
    prefix = node.text.rpartition("#")[0].partition("#")[0]
    typed = f"{prefix}#" if node.type_name and prefix else ""
    if node.kind == "bool":
        yield f"{typed}{'FALSE' if node.value else 'TRUE'}"
    elif node.kind == "int":
        assert isinstance(node.value, int)
        yield from (f"{typed}{value}" for value in (node.value + 1, node.value - 1) if value >= 0 or node.value < 0)
    elif node.kind == "real":
        yield from (f"{typed}0.0" if node.value else f"{typed}1.0",)
    elif node.kind == "time":
        assert isinstance(node.value, int)
        milliseconds, rest = divmod(node.value, 1_000_000)
        if not rest:
            changed = (milliseconds + CYCLE_MS, milliseconds - CYCLE_MS)
            yield from (f"{typed}{value}ms" for value in changed if value >= 0)


# --- declarations -----------------------------------------------------------------------------------------------------


def _block(text: str, node: Node) -> Iterator[Replacement]:
    """The type of a timer, a trigger, a flip-flop or a counter, exchanged for its relative."""
    assert isinstance(node, tree.VarDecl)
    if isinstance(node.spec, tree.NamedType):
        for new in BLOCKS.get(node.spec.text.upper(), ()):
            yield "TRO", node.spec.start, node.spec.end, new


# --- statements -------------------------------------------------------------------------------------------------------


_SIMPLE = (tree.Assign, tree.CallStatement, tree.Exit, tree.Return, tree.Continue)
"""Statements without others in them."""


def _of_statements(text: str, part: object) -> Iterator[Replacement]:
    """Of statements that follow one another: one left out, two in the other order."""
    if not isinstance(part, tuple) or not part:
        return
    for inner in part:
        yield from _of_statements(text, inner)
    if not all(isinstance(each, tree.Statement) for each in part):
        return
    simple = [each for each in part if isinstance(each, _SIMPLE) and not (_is_made(each) and not _JUMP.match(text, each.start))]
    for each in simple:
        yield "SDL", each.start, each.end, ";"
    for first, second in pairwise(part):
        if first in simple and second in simple:
            between = text[first.end : second.start]
            yield "SWAP", first.start, second.end, text[second.start : second.end] + between + text[first.start : first.end]


_RULES: tuple[tuple[type[Node], Callable[[str, Node], Iterator[Replacement]]], ...] = (
    (tree.Binary, _binary), (tree.Binary, _operand), (tree.If, _condition), (tree.While, _condition), (tree.Repeat, _condition),
    (tree.Unary, _negation), (tree.Assign, _assigned), (tree.Literal, _literal), (tree.VarDecl, _block),
    (Transition, of_transition), (Association, of_association), (InstructionList, of_list))  # fmt: skip
"""What is tried at each kind of node."""
