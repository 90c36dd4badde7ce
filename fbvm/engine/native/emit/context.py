"""The context: bytes beside a PLC's memory in which machine code keeps what is no part of the PLC's state.

Machine code has the address of its fields.  Behind them lie scratch bytes for the texts of one statement, in front of them the
texts of temporaries.  Nothing in the context outlives a scan."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Iterable, Iterator
from typing import Any

from fbvm.base.arithmetic import NAN
from fbvm.base.memory import STRUCTS
from fbvm.engine.allowance import Allowance
from fbvm.engine.native.library.reading import CLEANED

FIELDS = {"size": 0, "values": 8, "least": 32, "ask": 40, "result": 48, "f32": 56, "f64": 64, "stops": 72}
"""Offsets of its 64-bit fields: size of the memory; up to three values of a trap; the fewest steps that may be left of the
budget, and the address of the function that may allow fewer, or 0; a second result of a routine, or the instance of a trap; the
canonical NaN of each float type (here LLVM does not see it, which takes one NaN for as good as another); the address of the
table of `stops`."""
DIGITS = FIELDS["result"] + CLEANED
"""Where routines of the library write the text of a number before they read the number."""
SCRATCH = 512
"""Where the scratch bytes of texts begin; each statement uses them from the start."""

Shown = tuple[str, Any]
"""One value of a trap: (machine type, None) or ("text", None) if it is in the context, else ("const", value).  The last entry is
the instance whose body was executed: (INSTANCE, offset), with None if it is in the context."""
INSTANCE = "instance"
Point = tuple[str, int, tuple[Shown, ...]]
"""A point at which a run can end early: code of the trap, number of the site, values."""

_ASK = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_int64)


class Context:
    """The context of one PLC.  `at` is the address of its fields.

    `kept_bytes` lie in front of the fields, `context_bytes` from the fields on; `memory_bytes` is the size of the PLC's memory,
    `stops_at` the address of the stop table, if the code has stops."""

    def __init__(self, kept_bytes: int, context_bytes: int, memory_bytes: int, stops_at: int = 0) -> None:
        self._content = (ctypes.c_char * (kept_bytes + context_bytes))()
        self._start = kept_bytes
        self.at = ctypes.addressof(self._content) + kept_bytes
        self._ask: ctypes._FuncPointer | None = None
        self._put("<q", "size", memory_bytes)
        self._put("<q", "stops", stops_at)
        self._put("<f", "f32", NAN)
        self._put("<d", "f64", NAN)

    def allow(self, allowance: Allowance) -> None:
        """Sets the allowance of the runs from now on."""
        self._ask = _ASK(allowance.ask) if allowance.ask else None  # which stays while machine code may call it
        self._put("<q", "least", allowance.least)
        self._put("<q", "ask", ctypes.c_int64.from_buffer(self._ask).value if self._ask else 0)

    def _put(self, form: str, field: str, value: float) -> None:
        struct.pack_into(form, self._content, self._start + FIELDS[field], value)

    def values(self, shown: Iterable[Shown]) -> Iterator[Any]:
        """The values of a trap in their order: a float, an integer, or the bytes of a text."""
        at = self._start + FIELDS["values"]
        for kind, constant in shown:
            if kind == INSTANCE:
                return
            if kind == "const":
                yield constant
            elif kind == "text":
                yield ctypes.string_at(*struct.unpack_from("<qq", self._content, at))
                at += 16
            else:
                form = "f64" if kind[0] == "f" else "i64" if kind[0] == "i" else "u64"
                yield STRUCTS[form].unpack_from(self._content, at)[0]
                at += 8

    def instance(self, shown: tuple[Shown, ...]) -> int:
        """The byte of the memory at which the instance begins whose body a trap has ended."""
        given: int | None = dict(shown).get(INSTANCE)
        at = self._start + FIELDS["result"]
        return int(STRUCTS["i64"].unpack_from(self._content, at)[0]) if given is None else given
