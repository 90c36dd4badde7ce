"""The names that generated Python uses: typed views of one memory, and functions for operations that Python has no operator for.

A function that can trap takes the number of the site last and raises Stop.  Arithmetic is in `base.arithmetic`, strings are in
`base.strings`, literals in `syntax.st.texts`; here they are given memory and sites."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from fbvm.base import arithmetic, strings
from fbvm.base.arithmetic import Undefined
from fbvm.base.memory import FORMATS, STRUCTS, WHOLE_BYTES, Memory
from fbvm.code.image import Objects
from fbvm.code.operations import (
    BIT_MASK,
    BUFFER_OBJECT,
    FIRST_OBJECT,
    LEASE_BYTES,
    LEASED,
    OBJECT_SHIFT,
    OFFSET_MASK,
    OFFSET_SHIFT,
    SIZES,
)
from fbvm.engine.observation import Observation
from fbvm.engine.trap import Stop
from fbvm.syntax.st import texts

T = TypeVar("T")


def stop(code: str, site: int, *values: Any) -> Any:
    """Raises Stop; a function, so that it can stand in an expression."""
    raise Stop(code, site, *values)


def wrapped(number: int, machine: str, low: int, high: int, code: str, site: int) -> int:
    """A number brought into its type, which has to lie within low..high."""
    return within(arithmetic.wrap(number, machine), low, high, code, site)


def within(value: int, low: int, high: int, code: str, site: int) -> int:
    if not low <= value <= high:
        raise Stop(code, site, value, low, high)
    return value


def quotient(a: int, b: int, site: int) -> int:
    """As `arithmetic.quotient`; written out here because `sited` would cost each division one call more."""
    if b == 0:
        raise Stop("R0101", site, a, b)
    return a // b if (a < 0) == (b < 0) else -(-a // b)


def remainder(a: int, b: int, site: int) -> int:
    if b == 0:
        raise Stop("R0101", site, a, b)
    return a - b * (a // b if (a < 0) == (b < 0) else -(-a // b))


def choose(g: bool, a: T, b: T) -> T:
    return b if g else a


def mux(k: int, choices: tuple[T, ...], site: int) -> T:
    if 0 <= k < len(choices):
        return choices[k]
    raise Stop("R0107", site, k, len(choices) - 1)


def sited(function: Callable[..., T]) -> Callable[..., T]:
    """Gives a function of arithmetic one more argument, a site, at which its exception Undefined becomes a trap."""

    def answer(*operands: Any) -> T:
        try:
            return function(*operands[:-1])
        except Undefined as undefined:
            raise Stop(undefined.code, operands[-1], *undefined.values) from None

    return answer


def bit_behind(reference: int, n: int) -> int:
    """A reference to bit n counted from where `reference` points."""
    start = reference & BIT_MASK
    n += 0 if start == WHOLE_BYTES else start
    offset = (reference >> OFFSET_SHIFT) + (n >> 3) & OFFSET_MASK
    return reference >> OBJECT_SHIFT << OBJECT_SHIFT | offset << OFFSET_SHIFT | n & 7


_PURE: dict[str, Any] = {
    "Observation": Observation, "Stop": Stop, "NAN": arithmetic.NAN, "INF": arithmetic.INF, "stop": stop, "bisect": bisect_right,
    "quotient": quotient, "remainder": remainder, "divide": arithmetic.divide, "power": arithmetic.power,
    "lesser": arithmetic.lesser, "greater": arithmetic.greater, "choose": choose, "mux": mux,
    "within": within, "wrapped": wrapped,
    "single": arithmetic.single, "single_of_integer": arithmetic.single_of_integer, "bits": arithmetic.bits,
    "arctangent": arithmetic.arctangent, "find": strings.find,
    "characters": strings.characters, "units_of": strings.units_of, "to_text": texts.to_text, "enum_text": texts.enum_text,
    "from_leading": texts.from_leading,
    "bit_behind": bit_behind,
    "character": strings.character, "first": strings.first, "widened": strings.widened, "narrowed": strings.narrowed,
    **{function.__name__: sited(function) for function in (
        arithmetic.nearest, arithmetic.truncate, arithmetic.from_bcd, arithmetic.to_bcd, arithmetic.shift_left,
        arithmetic.shift_right, arithmetic.rotate_left, arithmetic.rotate_right, strings.left, strings.right,
        strings.mid, strings.insert, strings.delete, strings.replace, texts.from_text)},
    **{f"math_{name}": function for name, function in arithmetic.FUNCTIONS.items()},
}


class OwnViews(dict[int, tuple[memoryview, ...]]):
    """By the byte at which an instance begins, views of the memory from there on, one for each type of `machines`."""

    def __init__(self, memory: Memory, machines: Sequence[str]) -> None:
        super().__init__()
        self._views = [(memory.views[machine], SIZES[machine]) for machine in machines]

    def __missing__(self, base: int) -> tuple[memoryview, ...]:
        views = self[base] = tuple(view[base // size:] for view, size in self._views)
        return views


def environment(memory: Memory, objects: Objects) -> dict[str, Any]:
    """The globals of generated code over a memory.

    A view is named by its machine type (`i16`), that of BOOL `u1`; `get_i16` and `put_i16` work at any byte of `buffer`."""
    names: dict[str, Any] = dict(_PURE)
    for machine in FORMATS:
        names["u1" if machine == "b" else machine] = memory.views[machine]
        names[f"get_{machine}"], names[f"put_{machine}"] = STRUCTS[machine].unpack_from, STRUCTS[machine].pack_into
    names["buffer"] = memory.map
    names["r32"] = memoryview(bytearray(4)).cast("f")  # rounds what is stored in it
    return names | _references(memory, objects) | _texts(memory)


def _extents(memory: Memory, objects: Objects) -> Callable[[int], tuple[int, int]]:
    """A function from the number of an object to its extent: first byte, and the byte behind the last; (0, 0) if it has ended."""
    u32, first, held_bits = memory.views["u32"], objects.leases_at // 4, objects.held_bits
    extents, leases = objects.extents, objects.leases

    def extent(number: int) -> tuple[int, int]:
        if FIRST_OBJECT <= number < FIRST_OBJECT + len(extents):
            return extents[number - FIRST_OBJECT]
        row, held = divmod(number - LEASED, 1 << held_bits)
        if 0 <= row < leases and held:
            start, end, holder, _ = u32[first + row * LEASE_BYTES // 4:first + (row + 1) * LEASE_BYTES // 4]
            if held == holder:
                return start, end
        return 0, 0

    return extent


def _references(memory: Memory, objects: Objects) -> dict[str, Any]:
    size, u8, extent = memory.size, memory.u8, _extents(memory, objects)

    def at(reference: int, delta: int, count: int, site: int) -> int:
        """The offset of `count` bytes, `delta` bytes behind where the reference points."""
        if reference >> OBJECT_SHIFT == BUFFER_OBJECT:
            offset = (reference >> OFFSET_SHIFT & OFFSET_MASK) + delta
            if 0 <= offset <= size - count:
                return offset
        elif reference:
            start, end = extent(reference >> OBJECT_SHIFT)
            offset = (reference >> OFFSET_SHIFT & OFFSET_MASK) + delta
            if start <= offset <= end - count:
                return offset
        raise Stop("R0110", site, reference)

    def moved(reference: int, delta: int, bit: int, site: int) -> int:
        """A reference to what lies `delta` bytes further on in the same object."""
        offset = at(reference, delta, 1, site)
        return reference >> OBJECT_SHIFT << OBJECT_SHIFT | offset << OFFSET_SHIFT | bit

    def get_flag(reference: int, delta: int, site: int) -> bool:
        byte, bit = u8[at(reference, delta, 1, site)], reference & BIT_MASK
        return byte != 0 if bit == WHOLE_BYTES else byte >> (bit & 7) & 1 == 1

    def put_flag(reference: int, delta: int, site: int, value: bool) -> None:
        offset, bit = at(reference, delta, 1, site), reference & BIT_MASK
        if bit == WHOLE_BYTES:
            u8[offset] = bool(value)
        else:
            u8[offset] = u8[offset] & ~(1 << (bit & 7)) | bool(value) << (bit & 7)

    return {"at": at, "moved": moved, "get_flag": get_flag, "put_flag": put_flag}


def _texts(memory: Memory) -> dict[str, Any]:
    buffer, u8 = memory.map, memory.u8

    def get_s8(offset: int, capacity: int) -> bytes:
        return buffer[offset:offset + capacity].partition(b"\0")[0]

    def put_s8(offset: int, capacity: int, text: bytes) -> None:
        text = text[:capacity] + b"\0"
        u8[offset:offset + len(text)] = text

    def get_s16(offset: int, capacity: int) -> str:
        return strings.units(buffer[offset:offset + 2 * capacity]).partition("\0")[0]

    def put_s16(offset: int, capacity: int, text: str) -> None:
        data = strings.packed(text[:capacity]) + b"\0\0"
        u8[offset:offset + len(data)] = data

    def copy(to: int, source: int, count: int) -> None:
        u8[to:to + count] = u8[source:source + count]

    def reverse(at: int, runs: tuple[tuple[int, int, int, int], ...]) -> None:
        for offset, count, stride, size in runs:
            for start in range(at + offset, at + offset + count * stride, stride):
                u8[start:start + size] = bytes(u8[start:start + size])[::-1]

    def fill(to: int, pattern: bytes) -> None:
        u8[to:to + len(pattern)] = pattern

    return {"get_s8": get_s8, "put_s8": put_s8, "get_s16": get_s16, "put_s16": put_s16, "copy": copy, "fill": fill,
            "reverse": reverse}
