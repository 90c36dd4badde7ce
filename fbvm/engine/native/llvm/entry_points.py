"""Entries: functions without arguments, each bound to one task of one PLC, which Python calls in a tenth of a microsecond.

They come in blocks, made once and loaded as often as needed.  An entry reads from its slot what to call and with which
memory and context, so that it can be bound anew and be given better code between two calls."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache

from fbvm.engine.native.llvm import cache as native_cache
from fbvm.engine.native.llvm.cache import Stored, name_of
from fbvm.engine.native.llvm.compiler import Linked, compile_text

BLOCK = 32
"""Entries that are loaded together."""
SLOT_BYTES = 24
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
    """One entry: `call` is the function.  It has to be bound before it is called."""

    def __init__(self, block: _Block, number: int) -> None:
        self._block, self._number = block, number
        self._slot = (ctypes.c_void_p * 3).from_address(block.slots + SLOT_BYTES * number)
        self.call: Callable[[], int] = _FUNCTION(block.linked.address(f"e{number}"))

    def bind(self, memory: int, context: int) -> None:
        """Say over which memory and context the entry works."""
        self._slot[1], self._slot[2] = memory, context

    def set_target(self, function: int) -> None:
        """Say what the entry calls from now on; another thread may say so."""
        self._slot[0] = function

    @property
    def function_at(self) -> int:
        """Where the address of what it calls lies, at any time."""
        return self._block.slots + SLOT_BYTES * self._number

    def release(self) -> None:
        """Somebody else may have the slot; `call` must not be used any more."""
        self._block.free.append(self._number)
        _open.append(self._block)


class _Block:
    """Entries that were loaded together, and the numbers of those that nobody has."""

    def __init__(self) -> None:
        self.linked = Linked(_compiled(), ["slots", *(f"e{number}" for number in range(BLOCK))])
        self.slots = self.linked.address("slots")
        self.free = list(range(BLOCK - 1, -1, -1))


_open: list[_Block] = []
"""Blocks with free entries, each as often as it got one."""


@cache
def _compiled() -> bytes:
    """The object of a block."""
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
    """An entry that nobody else has."""
    while _open and not _open[-1].free:
        _open.pop()
    if not _open:
        _open.append(_Block())
    return EntryPoint(_open[-1], _open[-1].free.pop())
