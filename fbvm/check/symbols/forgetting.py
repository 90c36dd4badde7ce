"""What is known about a POU that another version has replaced, dropped without a new check of everything."""

from __future__ import annotations

from fbvm.check.symbols.facts import Facts, Pou
from fbvm.syntax import tree
from fbvm.syntax.tree.node import changed, walk


def forget(facts: Facts, pou: Pou, written: tree.Node) -> None:
    """Drop the facts about a POU without methods, whose text is `written`, and its body.

    Its variables stay: callers that are not checked again have instances of it.  Without this a program that is checked again
    at each key would keep all versions of what is typed."""
    parts = pou, *pou.actions.values()
    _forget_facts(facts, [written, *(part.tree for part in parts)])
    for part in parts:
        part.tree = changed(part.tree, body=(), actions=())
        part.calls, part.dynamic_calls = {}, {}
    pou.written_actions = []


def _forget_facts(facts: Facts, trees: list[tree.Node]) -> None:
    """Drop the facts about all nodes of some trees, and about those that stand for them, such as a + b for ADD(a, b)."""
    while trees:
        nodes = {node for part in trees for node in walk(part)}
        trees = []
        for table in vars(facts).values():
            if isinstance(table, set):
                table -= nodes
            elif isinstance(table, dict):
                dropped = [table.pop(node) for node in table.keys() & nodes]
                trees += (each for each in dropped if isinstance(each, tree.Node) and each not in nodes)
