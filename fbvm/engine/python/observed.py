"""What the builds that tell observations have in common: what they tell of a store is where it went.

A store may change its own subscripts, as in `a[a[0]] := 5`.  So these are worked out once, in front of it."""

from __future__ import annotations

from typing import Any

from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.image import DISPATCH
from fbvm.code.operations import Address, Block, Node, detail_size
from fbvm.engine.effects import STORES
from fbvm.engine.inlining import in_place
from fbvm.engine.python.statements import PlainWriter
from fbvm.engine.python.writer import bare


class ObservedWriter(PlainWriter):
    """Writes one body that tells observations."""

    may_hold = False

    def head(self, name: str) -> list[str]:
        return [f"def {name}(b1):"]

    def returning(self) -> str:
        return "return"

    def block(self, block: Block) -> None:
        nodes: list[Node | None] = [*block, None]
        for number, node in enumerate(block):
            here, following = nodes[number] or node, nodes[number + 1]
            if here[0] == "call" and self.image.bodies[here[1]].kind == DISPATCH:  # nobody sees that these have a body
                self.block(in_place(self.image.bodies[here[1]].code, here[2]))
                continue
            if here[0] not in STORES:
                self.emitters[here[0]](self, *here[1:])
                continue
            address = STORES[here[0]](here)[0]
            once = self._evaluated(address)
            if once is not address:
                here = _with_address(here, once)
                if following and following[:2] == ("observe", "write") and following[3][1] == address:
                    form, _, bit = following[3]
                    following = nodes[number + 1] = (*following[:3], (form, once, bit))
            self.store(here, _tells(following, here))

    def store(self, node: Node, told: bool) -> None:
        """Writes a store; `told` says that the observation behind it tells all that it has stored."""
        self.emitters[node[0]](self, *node[1:])

    def _evaluated(self, address: Address) -> Address:
        """The same address with its subscripts and reference in temporaries."""
        base, offset, terms = address
        if not terms and not isinstance(base, tuple):
            return address
        start = ("ref", self._kept(base[1]), base[2]) if isinstance(base, tuple) else base
        return start, offset, tuple((stride, self._kept(term)) for stride, term in terms)

    def _kept(self, node: Node) -> Node:
        if node[0] in ("tmp", "const"):
            return node
        name = self.name("_")
        self.line(f"t{name} = {bare(self.value(node))}")
        return "tmp", node[1], name


def _with_address(node: Node, address: Address) -> Node:
    at = 2 if node[0] in ("store", "store_raw") else 1
    return (*node[:at], address, *node[at + 1 :])


def names_bit(form: Any, address: Address, bit: int) -> bool:
    """True for a BOOL behind a reference, which says whether the BOOL is a byte or a bit of one."""
    return form == "b" and isinstance(address[0], tuple) and bit == WHOLE_BYTES


def _tells(observed: Node | None, node: Node) -> bool:
    """True if an observation tells all that a statement has stored."""
    if observed is None or observed[:2] != ("observe", "write"):
        return False
    form, address, bit = observed[3]
    return STORES[node[0]](node) == (address, detail_size(form) if bit == WHOLE_BYTES else 1)
