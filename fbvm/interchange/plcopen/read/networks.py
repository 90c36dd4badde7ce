"""The networks of a diagram, and the order in which their objects are evaluated.

A network is a set of objects that wires connect, rails not counted.  Where Beremiz and OpenPLC Editor say the order
(`sequence.py`), networks whose sinks stand among one another are one network, if they touch the same variables.

Else networks are in the order of executionOrderId if all have one, else from top to bottom; without positions, as written.
In a network an object follows all objects that feed it; objects that could be next go by executionOrderId, then from top to
bottom and from left to right.  A loop is cut at the wire that leaves a variable, if the loop contains one, else at a wire into
the block that comes first; a cut wire carries the value of the pass before.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf

from fbvm.base.digits import whole_number
from fbvm.interchange.plcopen.read.accesses import Access, accesses
from fbvm.interchange.plcopen.read.diagram import Diagram, Object, Wire
from fbvm.interchange.plcopen.read.producer import NETWORK
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.interchange.plcopen.read.sequence import sequence

LARGEST, MOST_LOOPS = 5_000, 200
"""Most objects and most loops of a network that is taken over; drawings of people have far fewer."""
BAND = 10_000_000_000
"""Distance of the localIds of one network of an FBD from those of the next (CODESYS, TwinCAT)."""
MIXED = 40
"""Most networks standing among one another of which each pair is compared; more become one network."""
RAILS = ("leftPowerRail", "rightPowerRail")
SINKS = ("coil", "outVariable", "inOutVariable", "block", "jump", "return", "label")
"""Kinds of objects that have an effect."""


@dataclass(eq=False)
class Network:
    """Objects in the order of their evaluation.  `cut` are wires (consumer, wire) that carry the value of the pass before;
    `comments` stand above the network."""

    objects: list[Object]
    cut: set[tuple[Object, Wire]] = field(default_factory=set)
    comments: list[str] = field(default_factory=list)
    number: int = 0
    refused: str = ""
    """Why the network is not taken over; "" if it is."""
    rereads: bool = False
    """Whether contacts and variables are read again for each sink, and that makes a difference."""

    @property
    def broken(self) -> bool:
        """Whether something in it was not understood, and has a diagnostic."""
        return any(item.broken for item in self.objects)


def networks(diagram: Diagram, scope: Scope, order: str = NETWORK) -> list[Network]:
    """The networks of a diagram in their order, which is one of `producer.ORDERS`."""
    free = [item for item in diagram.objects if item.kind not in RAILS]
    flat = len({(item.x, item.y) for item in diagram.objects}) <= 1
    groups: dict[Object, list[Object]] = {}
    root = _Joined(free)
    for item in free:
        groups.setdefault(root(item), []).append(item)
    if order == NETWORK:
        made = [_network(group, flat) for group in groups.values()]
        made.sort(key=lambda network: min(_place(item, flat) for item in network.objects))
        made = _by_number(made) or made
    else:
        made = _generated(free, list(groups.values()), scope, order)
    for number, network in enumerate(made, 1):
        network.number = _shown(network) or number
    _comment(made, diagram.comments, flat)
    return made


def _shown(network: Network) -> int:
    """The number of a network in the editor of CODESYS or TwinCAT, by the localIds of an FBD; 0 if these do not tell it."""
    numbers = {whole_number(item.id) // BAND if item.id.isdecimal() else 0 for item in network.objects}
    shown = numbers.pop() if len(numbers) == 1 else 0
    return shown if shown <= LARGEST else 0


def _place(item: Object, flat: bool) -> tuple[float, ...]:
    return (item.place,) if flat else (item.y, item.x, item.place)


def _by_number(made: list[Network]) -> list[Network] | None:
    """The networks by executionOrderId, if all objects with an effect have one and no two networks mix theirs; else None."""
    spans = []
    for network in made:
        numbers = [item.order for item in network.objects if _acts(item)]
        if not numbers or not all(numbers):
            return None
        spans.append((min(numbers), max(numbers), network))
    spans.sort(key=lambda span: span[:2])
    if any(before[1] >= behind[0] for before, behind in pairwise(spans)):
        return None
    return [network for _, _, network in spans]


def _acts(item: Object) -> bool:
    """Whether an object has an effect of its own; a variable at an in-out of a block, to which no wire leads, has none."""
    return item.kind in SINKS and item.kind != "label" and (item.kind != "inOutVariable" or item.inputs[0].connected)


def _comment(made: list[Network], comments: list[Object], flat: bool) -> None:
    """Give each comment to the network that comes next below it, else to the last one."""
    ends = [max(_place(item, flat) for item in network.objects) for network in made]
    for comment in sorted(comments, key=lambda item: _place(item, flat)):
        here = _place(comment, flat)
        at = next((at for at, end in enumerate(ends) if end >= here), len(made) - 1)
        if comment.text and made:
            made[at].comments.append(comment.text)


# --- networks in the sequence of a generator --------------------------------------------------------------------------


def _generated(free: list[Object], groups: list[list[Object]], scope: Scope, order: str) -> list[Network]:
    """The networks, in the sequence in which a generator evaluates their objects."""
    made, cut = sequence(free, order)
    place = {item: at for at, item in enumerate(made)}
    known = accesses(free, scope)
    effects = {item: _with_leaves(item, known) for item in free}
    for group in groups:
        group.sort(key=place.__getitem__)
    groups.sort(key=lambda group: place[group[0]])
    found = []
    for group in (one for mixed in _mixed(groups, place) for one in _parted(mixed, place, effects)):
        loops = {(item, wire) for item, wire in cut if item in set(group)}
        if len(group) > LARGEST or len(loops) > MOST_LOOPS:
            found.append(_refused(group))
        else:
            through = any(item.kind == "contact" for item, _ in loops)
            found.append(Network(group, loops, rereads=through or _rereads(group, known)))
    return found


def _mixed(groups: list[list[Object]], place: dict[Object, int]) -> Iterator[list[list[Object]]]:
    """Groups whose objects stand among one another in the sequence, together."""
    together: list[list[Object]] = []
    end = -1
    for group in groups:
        if together and place[group[0]] > end:
            yield together
            together = []
        together.append(group)
        end = max(end, place[group[-1]])
    if together:
        yield together


def _parted(mixed: list[list[Object]], place: dict[Object, int], known: dict[Object, Access]) -> list[list[Object]]:
    """Groups that stand among one another as networks one behind the other, those together for which that would matter."""
    if len(mixed) > MIXED:
        return [sorted((item for group in mixed for item in group), key=place.__getitem__)]
    left = list(mixed)
    at = 0
    while at < len(left):
        joined = next((other for other in left[at + 1:] if _interfere(left[at], other, place, known)), None)
        if joined is None:
            at += 1
        else:
            left.remove(joined)
            left[at] = sorted([*left[at], *joined], key=place.__getitem__)
            at = 0
    return left


def _interfere(first: list[Object], second: list[Object], place: dict[Object, int], known: dict[Object, Access]) -> bool:
    """Whether it matters that all of `first` is evaluated in front of all of `second`."""
    return any(place[early] > place[late] and known[early].conflicts(known[late]) for early in first for late in second)


def _with_leaves(item: Object, known: dict[Object, Access]) -> Access:
    """What an object reads and writes, with the variables that a generator reads anew where it writes the object."""
    if item.kind not in SINKS:
        return known[item]
    leaves = (leaf for leaf in _leaves(item) if leaf in known and (leaf.kind != "block" or leaf.instance))
    return Access(known[item].reads.union(*(known[leaf].reads for leaf in leaves)), known[item].writes)


def _rereads(group: list[Object], known: dict[Object, Access]) -> bool:
    """Whether it matters that what several sinks have in common is read anew for each: something is written in between."""
    first: dict[Object, int] = {}
    written: dict[str, int] = {}
    for at, item in enumerate(group):
        if item.kind not in SINKS:
            continue
        for leaf in _leaves(item):
            since = first.setdefault(leaf, at)
            names = known[leaf].reads if leaf in known else frozenset()
            if any(since <= written.get(name, -1) for name in names):
                return True
        written.update(dict.fromkeys(known[item].writes, at))
        first.setdefault(item, at + 1)
    return False


def _leaves(sink: Object) -> list[Object]:
    """Contacts, variables and blocks that the value of a sink is made of, up to the next blocks."""
    found: dict[Object, None] = {}
    todo = [wire.source for pin in sink.pins for wire in pin.wires]
    while todo:
        item = todo.pop()
        if item not in found and item.kind not in RAILS:
            found[item] = None
            if item.kind == "contact":
                todo += [wire.source for wire in item.inputs[0].wires]
    return list(found)


# --- one network ------------------------------------------------------------------------------------------------------


class _Joined:
    """Which objects are connected: called with an object, returns the one that stands for its whole network (union-find)."""

    def __init__(self, items: list[Object]) -> None:
        self.parent = {item: item for item in items}
        for item in items:
            for pin in item.pins:
                for wire in pin.wires:
                    if wire.source in self.parent:
                        self.parent[self(wire.source)] = self(item)

    def __call__(self, item: Object) -> Object:
        while self.parent[item] is not item:
            self.parent[item] = item = self.parent[self.parent[item]]
        return item


def _key(item: Object, flat: bool) -> tuple[float, ...]:
    return (item.order or inf, *_place(item, flat))


def _feeds(item: Object, inside: set[Object], cut: set[tuple[Object, Wire]]) -> list[Wire]:
    return [wire for pin in item.pins for wire in pin.wires if wire.source in inside and (item, wire) not in cut]


def _network(group: list[Object], flat: bool) -> Network:
    """A network with its objects sorted; if only loops are left, one is cut."""
    if len(group) > LARGEST:
        return _refused(group)
    inside = set(group)
    cut: set[tuple[Object, Wire]] = set()
    order: list[Object] = []
    done: set[Object] = set()
    waiting = {item: set(_feeds(item, inside, cut)) for item in group}
    consumers: dict[Object, dict[Object, None]] = {}
    for item in group:
        for wire in _feeds(item, inside, cut):
            consumers.setdefault(wire.source, {})[item] = None
    ready = [(_key(item, flat), at) for at, item in enumerate(group) if not waiting[item]]
    heapq.heapify(ready)
    place = {item: at for at, item in enumerate(group)}
    while len(order) < len(group):
        while not ready:
            if len(cut) >= MOST_LOOPS:
                return _refused(group)
            item, wire = _back([one for one in group if one not in done], inside, cut, flat)
            cut.add((item, wire))
            waiting[item].discard(wire)
            if not waiting[item]:
                heapq.heappush(ready, (_key(item, flat), place[item]))
        item = group[heapq.heappop(ready)[1]]
        order.append(item)
        done.add(item)
        for consumer in consumers.get(item, ()):
            left = {wire for wire in waiting[consumer] if wire.source is not item}
            waiting[consumer], was_waiting = left, bool(waiting[consumer])
            if was_waiting and not left:
                heapq.heappush(ready, (_key(consumer, flat), place[consumer]))
    return Network(order, cut)


def _refused(group: list[Object]) -> Network:
    return Network(group, refused=f"the network has more than {LARGEST} elements, or more than {MOST_LOOPS} loops")


def _back(left: list[Object], inside: set[Object], cut: set[tuple[Object, Wire]], flat: bool) -> tuple[Object, Wire]:
    """The wire at which a loop is cut, and its consumer."""
    loop = _loops(left, inside, cut)
    wires = [(item, wire) for item in left for wire in _feeds(item, inside, cut) if loop.get(wire.source, -1) == loop[item]]

    def late(found: tuple[Object, Wire]) -> tuple[bool, bool, tuple[float, ...]]:
        item, wire = found
        return wire.source.kind != "inOutVariable", item.kind != "block", _key(item, flat)

    return min(wires, key=late)


def _loops(left: list[Object], inside: set[Object], cut: set[tuple[Object, Wire]]) -> dict[Object, int]:
    """Numbers of the strongly connected components: two objects in a loop have the same number (Tarjan 1972, without
    recursion)."""
    among = set(left)
    index: dict[Object, int] = {}
    low: dict[Object, int] = {}
    number: dict[Object, int] = {}
    open_: list[Object] = []
    for start in left:
        todo = [] if start in index else [(start, iter(_feeds(start, inside, cut)))]
        while todo:
            item, wires = todo[-1]
            if item not in index:
                index[item] = low[item] = len(index)
                open_.append(item)
            following = next((wire.source for wire in wires if wire.source in among), None)
            if following is None:
                todo.pop()
                if todo:
                    low[todo[-1][0]] = min(low[todo[-1][0]], low[item])
                if low[item] == index[item]:
                    at = open_.index(item)
                    number.update((one, index[item]) for one in open_[at:])
                    del open_[at:]
            elif following not in index:
                todo.append((following, iter(_feeds(following, inside, cut))))
            elif following not in number:
                low[item] = min(low[item], index[following])
    return number
