"""The stack of frames: where a POU has its variables whose calls may come back while it runs.

The part of the stack that is in use is the extent of a lease, whose end is the top of the stack.  A caller of a function or
method puts a frame on the stack, writes the inputs there, and takes it off when it has read the result; a block, which has no
inputs there, does it itself.  An access to such a frame is one behind a reference, so back ends need no rule for it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from fbvm.base.areas import FRAME_HEAD, FRAME_LINK
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import BOOL
from fbvm.check.symbols.facts import Pou, PouCall
from fbvm.code.builder.places import Place
from fbvm.code.layout.layout import FrameStack
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import BUFFER_OBJECT, LEASED, OBJECT_SHIFT, OFFSET_SHIFT, Address, Node

_FULL = "R0121"
"""The trap of a call for whose frame the stack has no room left."""


@contextmanager
def frame(body: BodyContext, called: PouCall, site: int) -> Iterator[Place | None]:
    """The frame of a call, which is on the stack while the `with` statement emits; None if it has a fixed place or is not
    the caller's to put there."""
    pou = called.pou
    own = called.instance is None or called.instance in body.facts.selves
    shares = own and pou.home is not None and pou.owner is body.pou.owner
    if not pou.stack_bytes or shares or not (pou.is_routine or pou.home is not None):
        yield None
        return
    start = _push(body, pou, site)
    yield _place(body, start, site)
    body.emit(_set_top(body, start))


def enter(body: BodyContext) -> None:
    """Emit what a body with its frame on the stack does first: find the frame, and note it as the newest of this POU."""
    pou = body.pou
    if not pou.stack_bytes:
        return
    site = body.entry_site
    if pou.is_routine or pou.home is not None:
        start = body.to_temporary(("sub", "u32", ("load", "u32", _top(body)), ("const", "u32", pou.stack_bytes)))
    else:
        start = _push(body, pou, site)
        body.at_return += (_set_top(body, start),)
    body.frame = _place(body, start, site)
    newest: Address = ("abs", pou.frame_offset, ())
    before = body.frame.moved(FRAME_LINK, BOOL).address
    body.emit(("store_raw", "ref", before, ("load", "ref", newest)), ("store", "ref", newest, body.frame.reference()))
    body.at_return += (("store", "ref", newest, ("load_raw", "ref", before)),)


def enter_part(body: BodyContext) -> None:
    """Emit what a part of a POU with a body of its own does first: find the frame of the POU, its newest one."""
    if body.pou.stack_bytes:
        frame = body.to_temporary(("load", "ref", ("abs", body.pou.frame_offset, ())))
        body.frame = Place((("ref", frame, body.entry_site), 0, ()), BOOL)


def kept(body: BodyContext) -> list[tuple[str, Address]]:
    """The words that calls change until they return: the top of the stack, and the newest frame of each POU."""
    if body.program.stack is None:
        return []
    return [("u32", _top(body)), *(("ref", ("abs", pou.frame_offset, ())) for pou in body.checker.bodies if pou.stack_bytes)]


def leased(body: BodyContext, bits: Node) -> Node:
    """A reference to a variable in a frame on the stack, by its bits: one that holds as long as the frame is in use."""
    number = LEASED + (_stack(body).lease << body.program.held_bits) + 1
    position = ("and", "u64", bits, ("const", "u64", (1 << OBJECT_SHIFT) - 1))
    return ("bits", "ref", "u64", ("or", "u64", position, ("const", "u64", number << OBJECT_SHIFT)))


def _push(body: BodyContext, pou: Pou, site: int) -> Node:
    """Emit the move of the top over one more frame.  Returns where the frame starts, as u32."""
    start = body.to_temporary(("load", "u32", _top(body)))
    last = _stack(body).end - pou.stack_bytes
    body.emit(("if", ((("gt", "b", "u32", start, ("const", "u32", last)), (("stop", _FULL, site),)),), ()),
              _set_top(body, ("add", "u32", start, ("const", "u32", pou.stack_bytes))))
    return start


def _place(body: BodyContext, start: Node, site: int) -> Place:
    """The frame behind its head, which starts at an offset in the buffer."""
    first = ("convert", "u64", "u32", ("add", "u32", start, ("const", "u32", FRAME_HEAD)))
    bits = ("mul", "u64", first, ("const", "u64", 1 << OFFSET_SHIFT))
    whole = ("const", "u64", BUFFER_OBJECT << OBJECT_SHIFT | WHOLE_BYTES)
    return Place((("ref", body.to_temporary(("bits", "ref", "u64", ("or", "u64", bits, whole))), site), 0, ()), BOOL)


def _stack(body: BodyContext) -> FrameStack:
    stack = body.program.stack
    assert stack is not None
    return stack


def _top(body: BodyContext) -> Address:
    return ("abs", _stack(body).top_at, ())


def _set_top(body: BodyContext, offset: Node) -> Node:
    return ("store", "u32", _top(body), offset)

