"""The layout of a chart: the node above each node, and the links that are drawn as jumps.

Steps and transitions are the nodes.  A link that leads back, or to a step that is drawn somewhere else, is a jump.  Of
the other links, a node with several predecessors, where branches converge, is drawn below the node where these branches
diverge: its immediate dominator.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.code.image import SfcPicture


@dataclass(frozen=True)
class Node:
    """A step or a transition by its number."""

    is_step: bool
    number: int


class Graph:
    """The links of a chart.  Steps in `apart` are drawn by themselves: links to them are jumps."""

    def __init__(self, picture: SfcPicture, apart: frozenset[int] = frozenset()) -> None:
        self.picture = picture
        self.apart = apart
        self.following: dict[Node, list[Node]] = {}
        """The successors of a node, jumps included, transitions in the order of their priority."""
        order = sorted(range(len(picture.transitions)), key=lambda n: (not picture.transitions[n][2], picture.transitions[n][2]))
        for number in range(len(picture.steps)):
            self.following[Node(True, number)] = [Node(False, n) for n in order if number in picture.transitions[n][3]]
        for number, (_, _, _, _, targets, _) in enumerate(picture.transitions):
            self.following[Node(False, number)] = [Node(True, step) for step in targets]
        self.roots: list[Node] = []
        self.order: list[Node] = []
        """All nodes, each behind its predecessors."""
        self._back: set[tuple[Node, Node]] = set()
        self._walk()
        self.before: dict[Node, list[Node]] = {node: [] for node in self.order}
        for node in self.order:
            for follower in self.following[node]:
                if not self.is_jump(node, follower):
                    self.before[follower].append(node)
        self.met = {follower for node, follower in self._back if node.is_step}
        """Transitions to which a jump leads."""
        self.above: dict[Node, Node | None] = {}
        self._dominate()
        self.below: dict[Node, list[Node]] = {node: [] for node in self.order}
        """By node the nodes where the branches that diverge there converge, in order."""
        for node in self.order:
            above = self.above[node]
            if above is not None and len(self.before[node]) > 1:
                self.below[above].append(node)

    def is_jump(self, node: Node, follower: Node) -> bool:
        """Whether a link is drawn as a jump: it leads back, or to what is drawn apart."""
        return (node, follower) in self._back or follower.is_step and follower.number in self.apart

    def _walk(self) -> None:
        """Orders the nodes: roots are initial steps, then steps that are drawn apart, then steps without predecessors."""
        steps = self.picture.steps
        begins = [n for n, step in enumerate(steps) if step[1]]
        others = [n for n in range(len(steps)) if n not in begins]
        done: set[Node] = set()
        left: list[list[Node]] = []
        for number in [*begins, *(n for n in others if n in self.apart), *others]:
            root = Node(True, number)
            if root not in done:
                self.roots.append(root)
                left.append(self._from(root, done))
        self.order = [node for part in left for node in part]

    def _from(self, root: Node, done: set[Node]) -> list[Node]:
        """The nodes that are reached from a root, in order; links to nodes that are still open lead back."""
        open_: set[Node] = {root}
        path = [(root, iter(self.following[root]))]
        finished: list[Node] = []
        while path:
            node, followers = path[-1]
            for follower in followers:
                if follower.is_step and follower.number in self.apart:
                    continue
                if follower in open_:
                    self._back.add((node, follower))
                elif follower not in done:
                    open_.add(follower)
                    path.append((follower, iter(self.following[follower])))
                    break
            else:
                path.pop()
                open_.discard(node)
                if node not in done:
                    done.add(node)
                    finished.append(node)
        mine = set(finished)
        for node in finished:
            for follower in self.following[node]:
                if follower in done and follower not in mine:
                    self._back.add((node, follower))
        return finished[::-1]

    def _dominate(self) -> None:
        """Finds the immediate dominator of each node: the last node through which all paths from the root lead."""
        depth: dict[Node, int] = {}
        for node in self.order:
            predecessors = self.before[node]
            above: Node | None = predecessors[0] if predecessors else None
            for predecessor in predecessors[1:]:
                other: Node | None = predecessor
                while above != other:
                    if above is None or other is None:
                        above = other = None
                    elif depth[above] >= depth[other]:
                        above = self.above[above]
                    else:
                        other = self.above[other]
            self.above[node] = above
            depth[node] = depth[above] + 1 if above is not None else 0
