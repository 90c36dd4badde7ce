"""Entry points: functions of machine code without arguments, each bound to one task of one PLC.

Python calls a function without arguments in a tenth of a microsecond.  Entry points are compiled in blocks, once, and loaded
as often as needed.  Each reads from its slot which function to call, with which memory and context, so that it can be bound
to another PLC and be given better code between two calls."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache

from fbvm.engine.native.llvm import cache as native_cache
from fbvm.engine.native.llvm.cache import Stored, name_of
from fbvm.engine.native.llvm.compiler import Linked, compile_text

BLOCK = 32
"""Entry points of one block, which are loaded together."""
SLOT_BYTES = 24
"""A slot: the addresses of function, memory and context."""
_FUNCTION = ctypes.PYFUNCTYPE(ctypes.c_int32)
_ENTRY = """
define i32 @e{0}() {{
%f = load ptr, ptr getelementptr (i8, ptr @slots, i64 {1})
%m = load ptr, ptr getelementptr (i8, ptr @slots, i64 {2})
%c = load ptr, ptr getelementptr (i8, ptr @slots, i64 {3})
%p = tail call i32 %f(ptr %m, ptr %c)
ret i32 %p
}}"""


class EntryPoint:
    """One entry point.  `call` executes the task and returns the point at which it ended, 0 for its end; `bind` and
    `set_target` come before the first call."""

    def __init__(self, block: _Block, number: int) -> None:
        self._block, self._number = block, number
        self._slot = (ctypes.c_void_p * 3).from_address(block.slots + SLOT_BYTES * number)
        self.call: Callable[[], int] = _FUNCTION(block.linked.address(f"e{number}"))

    def bind(self, memory: int, context: int) -> None:
        """Sets the addresses of memory and context."""
        self._slot[1], self._slot[2] = memory, context

    def set_target(self, function: int) -> None:
        """Sets the address of the function that is called from now on.  The worker's thread may do so between two calls."""
        self._slot[0] = function

    @property
    def function_at(self) -> int:
        """The address at which the address of the function lies, whichever function that is by then."""
        return self._block.slots + SLOT_BYTES * self._number

    def release(self) -> None:
        """Gives the slot to the next who asks for an entry point; `call` must not be used any more."""
        self._block.free.append(self._number)
        _open.append(self._block)


class _Block:
    """A block that is loaded, and the numbers of its free entry points."""

    def __init__(self) -> None:
        self.linked = Linked(_compiled(), ["slots", *(f"e{number}" for number in range(BLOCK))])
        self.slots = self.linked.address("slots")
        self.free = list(range(BLOCK - 1, -1, -1))


_open: list[_Block] = []
"""Blocks with free entry points; a block is in here once for each that was released."""


@cache
def _compiled() -> bytes:
    """The object file of a block."""
    entries = [_ENTRY.format(number, *(SLOT_BYTES * number + part for part in (0, 8, 16))) for number in range(BLOCK)]
    head = f"@slots = global [{SLOT_BYTES * BLOCK} x i8] zeroinitializer, align 8"
    text = "\n".join([head, *entries])
    name = name_of("entries", text)
    stored = native_cache.read(name)
    if stored is None:
        stored = Stored({}, compile_text(text, 0))  # there is nothing to optimise, and much to load for it
        native_cache.write(name, stored)
    return stored.compiled


def entry() -> EntryPoint:
    """An entry point that is in use nowhere else, from a loaded block or a new one."""
    while _open and not _open[-1].free:
        _open.pop()
    if not _open:
        _open.append(_Block())
    return EntryPoint(_open[-1], _open[-1].free.pop())
