"""Graphs: which of their nodes lie on a cycle."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import TypeVar

Node = TypeVar("Node", bound=Hashable)


def cycles(nodes: Iterable[Node], successors: Callable[[Node], Iterable[Node]]) -> list[list[Node]]:
    """The groups of nodes that lead to one another (strongly connected components), without single nodes that do not lead back.

    nodes: where to begin; nodes that are only reached from these count as well.
    successors: the nodes to which one leads.

    The method is R. Tarjan's (1972), without recursion.

    >>> cycles("abcd", {"a": "b", "b": "ac", "c": "d", "d": ""}.__getitem__)
    [['a', 'b']]
    """
    found: list[list[Node]] = []
    numbers: dict[Node, int] = {}
    lowest: dict[Node, int] = {}
    open_nodes: dict[Node, None] = {}
    for first in nodes:
        path: list[tuple[Node, Iterator[Node]]] = []
        if first not in numbers:
            path.append(_entered(first, successors, numbers, lowest, open_nodes))
        while path:
            node, rest = path[-1]
            following = next((other for other in rest if other not in numbers or other in open_nodes), None)
            if following is None:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[node])
                if lowest[node] == numbers[node]:
                    group = _closed(node, open_nodes)
                    if len(group) > 1 or node in successors(node):
                        found.append(group)
            elif following in numbers:
                lowest[node] = min(lowest[node], numbers[following])
            else:
                path.append(_entered(following, successors, numbers, lowest, open_nodes))
    return found


def _entered(node: Node, successors: Callable[[Node], Iterable[Node]], numbers: dict[Node, int], lowest: dict[Node, int],
             open_nodes: dict[Node, None]) -> tuple[Node, Iterator[Node]]:
    """A node for the path, which gets its number."""
    numbers[node] = lowest[node] = len(numbers)
    open_nodes[node] = None
    return node, iter(successors(node))


def _closed(node: Node, open_nodes: dict[Node, None]) -> list[Node]:
    """The group of a node whose successors are all known: the open nodes from it on, in the order in which they were met."""
    group: list[Node] = []
    while not group or group[-1] != node:
        group.append(open_nodes.popitem()[0])
    return group[::-1]
